//! [`stillpoint_tests::fuzz::board`] under libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| stillpoint_tests::fuzz::board(data));
