//! The numbers that the boards give their hardware, which nothing but hardware would check.

use proptest::prelude::*;
use stillpoint_firmware::can_filters::{CAN2_FIRST, ID_SHIFT, MASK, TO_FIFO_1, USED, wanted};
use stillpoint_firmware::can_timing::{
    QUANTA_AFTER_SAMPLE, QUANTA_BEFORE_SAMPLE, QUANTA_PER_BIT, divider,
};
use stillpoint_firmware::loop_time::{CORE_HZ, PERIOD_COUNTS, missed_ticks, time_ticks};
use stillpoint_firmware::pll::Pll;
use stillpoint_shared::time::DRIVE_PERIOD_TICKS;

/// Clock of the CAN controllers.
const APB1_HZ: u32 = CORE_HZ / 4;

#[test]
fn every_crystal_gives_exactly_the_core_clock_or_none() {
    for crystal_mhz in 0..=1_000 {
        let Some(pll) = Pll::of(crystal_mhz) else {
            assert!(!(4..=26).contains(&crystal_mhz), "{crystal_mhz} MHz");
            continue;
        };
        let crystal_hz = crystal_mhz * 1_000_000;
        // RM0090, 7.3.2: the input 1 to 2 MHz, PLLM 2 to 63, PLLN 50 to 432, the oscillator 100 to 432 MHz.
        assert!((2..=63).contains(&pll.divider), "{pll:?}");
        assert!((50..=432).contains(&pll.multiplier), "{pll:?}");
        assert_eq!(crystal_hz % u32::from(pll.divider), 0, "{pll:?}");
        let input_hz = crystal_hz / u32::from(pll.divider);
        assert!((1_000_000..=2_000_000).contains(&input_hz), "{pll:?}");
        let vco_hz = input_hz * u32::from(pll.multiplier);
        assert!((100_000_000..=432_000_000).contains(&vco_hz), "{pll:?}");
        assert_eq!(vco_hz, CORE_HZ * u32::from(pll.core_divider), "{pll:?}");
        assert_eq!(vco_hz, 48_000_000 * u32::from(pll.usb_divider), "{pll:?}");
    }
}

#[test]
fn a_can_rate_is_met_exactly_or_refused() {
    for rate_kbit_per_s in 0..=u16::MAX {
        let quanta_hz = 1_000 * QUANTA_PER_BIT * u32::from(rate_kbit_per_s);
        match divider(APB1_HZ, rate_kbit_per_s) {
            Some(divider) => {
                assert!((1..=1024).contains(&divider));
                assert_eq!(divider * quanta_hz, APB1_HZ, "{rate_kbit_per_s} kbit/s");
            }
            None => {
                let met =
                    |divider: u32| u64::from(divider) * u64::from(quanta_hz) == APB1_HZ.into();
                assert!(!(1..=1024).any(met), "{rate_kbit_per_s} kbit/s");
            }
        }
    }
    for (rate_kbit_per_s, expected) in [(1_000, 3), (500, 6), (250, 12), (125, 24)] {
        assert_eq!(divider(APB1_HZ, rate_kbit_per_s), Some(expected));
    }
}

/// CiA 301 wants 87.5 %; 85 to 90 % of a bit are usual. The fields of the register: 1 to 16, and 1 to 8.
#[test]
fn a_bit_is_sampled_where_can_devices_expect_it() {
    let share = f64::from(1 + QUANTA_BEFORE_SAMPLE) / f64::from(QUANTA_PER_BIT);
    assert!((0.85..=0.9).contains(&share), "{share}");
    assert!((1..=16).contains(&QUANTA_BEFORE_SAMPLE));
    assert!((1..=8).contains(&QUANTA_AFTER_SAMPLE));
}

/// Of all kinds of frames each controller takes every data frame with an 11-bit identifier, into one FIFO.
#[test]
fn data_frames_with_short_identifiers_pass_into_the_fifo_of_their_parity() {
    assert_eq!(USED >> 28, 0, "there are 28");
    for id in 0..0x800u32 {
        for marks in 0..4 {
            let register = id << ID_SHIFT | marks << 1;
            for controller in [0, CAN2_FIRST] {
                let own = u32::from(controller)..u32::from(controller) + 14;
                let fifos: Vec<u32> = own
                    .filter(|filter| USED >> filter & 1 == 1)
                    .filter(|&filter| (register ^ wanted(filter)) & MASK == 0)
                    .map(|filter| TO_FIFO_1 >> filter & 1)
                    .collect();
                let expected = if marks == 0 { vec![id & 1] } else { vec![] };
                assert_eq!(fifos, expected, "{id:#x}, marks {marks:#b}");
            }
        }
    }
}

proptest! {
    /// Whenever in their periods the two ticks begin, if no later than half of one.
    #[test]
    fn ticks_left_out_are_counted(
        missed in 0..50_000u32,
        late in 0..PERIOD_COUNTS / 2,
        later in 0..PERIOD_COUNTS / 2,
    ) {
        let counts = (missed + 1) * PERIOD_COUNTS + later - late;
        prop_assert_eq!(u32::from(missed_ticks(counts)), missed);
    }

    #[test]
    fn more_counts_are_no_fewer_ticks(counts: u32, more: u32) {
        let larger = counts.saturating_add(more);
        prop_assert!(missed_ticks(counts) <= missed_ticks(larger));
        prop_assert!(time_ticks(counts) <= time_ticks(larger));
    }

    #[test]
    fn periods_of_counts_are_periods_of_time(periods in 0..400u32) {
        prop_assert_eq!(time_ticks(periods * PERIOD_COUNTS), periods * DRIVE_PERIOD_TICKS);
    }
}

#[test]
fn the_first_tick_has_missed_none() {
    assert_eq!(missed_ticks(0), 0);
}
