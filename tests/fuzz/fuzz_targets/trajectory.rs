//! [`stillpoint_tests::fuzz::trajectory`] under libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stillpoint_tests::fuzz::trajectory(data));
