//! Increments and thousandths: exact where they can be, signed, offset, cut where they do not fit.

use proptest::prelude::*;
use stillpoint_firmware::cia402::{Fitted, Units};
use stillpoint_shared::drive_config::{AxisDrive, Mapping};

fn drive(counts_per_turn: f64, reversed: bool, home_counts: i32, home_rad: f32) -> AxisDrive {
    AxisDrive {
        bus: 0,
        node: 1,
        counts_per_turn,
        reversed,
        home_counts,
        home_rad,
        gear_ratio: 50.0,
        rated_torque_nm: 1.27,
        torque_limit_permille: 3_000,
        mapping: Mapping::Write,
        tells_following: true,
    }
}

fn exactly<T>(value: T) -> Option<Fitted<T>> {
    Some(Fitted {
        value,
        saturated: false,
    })
}

fn cut<T>(value: T) -> Option<Fitted<T>> {
    Some(Fitted {
        value,
        saturated: true,
    })
}

#[test]
fn a_quarter_turn_is_a_quarter_of_the_counts() {
    let quarter_rad = std::f32::consts::FRAC_PI_2;
    let units = Units::new(&drive(4_000.0, false, 0, 0.0));
    assert_eq!(units.counts(quarter_rad), exactly(1_000));
    assert_eq!(units.counts(-quarter_rad), exactly(-1_000));
    assert_eq!(units.angle_rad(1_000), quarter_rad);
    assert_eq!(units.speed_rad_per_s(-1_000, 0.5), -2.0 * quarter_rad);
    // 63.5 N·m at the joint is the rated torque.
    assert_eq!(units.torque_permille(63.5), exactly(1_000));
    assert_eq!(units.torque_permille(-31.75), exactly(-500));

    let reversed = Units::new(&drive(4_000.0, true, 250, quarter_rad));
    assert_eq!(reversed.counts(quarter_rad), exactly(250));
    assert_eq!(reversed.counts(0.0), exactly(1_250));
    // The f32 quarter turn is 4e-8 rad too long.
    assert!(reversed.angle_rad(1_250).abs() < 1e-7);
    assert_eq!(reversed.speed_rad_per_s(1_000, 0.5), -2.0 * quarter_rad);
    assert_eq!(reversed.torque_permille(63.5), exactly(-1_000));
}

#[test]
fn what_does_not_fit_is_cut_and_what_is_no_number_is_none() {
    let units = Units::new(&drive(4e9, false, 0, 0.0));
    assert_eq!(units.counts(10.0), cut(i32::MAX));
    assert_eq!(units.counts(-10.0), cut(i32::MIN));
    assert_eq!(units.torque_permille(190.5), exactly(3_000));
    assert_eq!(units.torque_permille(190.6), cut(3_000));
    assert_eq!(units.torque_permille(-1e9), cut(-3_000));
    for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(units.counts(wrong), None);
        assert_eq!(units.torque_permille(wrong), None);
    }
}

proptest! {
    /// Increments to angle and back is the same increment, as long as f32 tells increments apart.
    #[test]
    fn counts_come_back(
        counts_per_turn in 100.0..1e6f64,
        reversed: bool,
        home_counts in -1_000_000..1_000_000i32,
        home_rad in -3.0..3.0f32,
        from_home in -100_000..100_000i32,
    ) {
        let units = Units::new(&drive(counts_per_turn, reversed, home_counts, home_rad));
        let counts = home_counts + from_home;
        let rad_per_count = std::f64::consts::TAU / counts_per_turn;
        let angle_rad = units.angle_rad(counts);
        // Half an ulp of the angle, in increments.
        let doubt = f64::from(angle_rad.abs()) * f64::from(f32::EPSILON) / rad_per_count;
        let back = units.counts(angle_rad).unwrap();
        prop_assert!(!back.saturated);
        prop_assert!(f64::from((back.value - counts).abs()) <= 0.5 + doubt);
        if doubt < 0.4 {
            prop_assert_eq!(back.value, counts);
        }
    }

    /// Increments are the nearest to the angle, and grow with it, or fall if reversed.
    #[test]
    fn counts_are_nearest_and_monotonic(
        counts_per_turn in 100.0..1e8f64,
        reversed: bool,
        home_counts in -1_000_000..1_000_000i32,
        home_rad in -3.0..3.0f32,
        angle_rad in -6.0..6.0f32,
        further_rad in 0.0..1.0f32,
    ) {
        let units = Units::new(&drive(counts_per_turn, reversed, home_counts, home_rad));
        let sign = if reversed { -1.0 } else { 1.0 };
        let turns = (f64::from(angle_rad) - f64::from(home_rad)) / std::f64::consts::TAU;
        let exact = f64::from(home_counts) + sign * turns * counts_per_turn;
        let counts = units.counts(angle_rad).unwrap();
        prop_assert!((f64::from(counts.value) - exact).abs() <= 0.5 + 1e-6);
        let further = units.counts(angle_rad + further_rad).unwrap();
        prop_assert!(f64::from(further.value - counts.value) * sign >= 0.0);
    }

    /// The torque offset is within the limit, has the torque's sign, and is the nearest thousandth.
    #[test]
    fn torque_is_within_its_limit(torque_nm in -1e4..1e4f32, reversed: bool, limit in 1u16..=32_767) {
        let mut drive = drive(1e6, reversed, 0, 0.0);
        drive.torque_limit_permille = limit;
        let fitted = Units::new(&drive).torque_permille(torque_nm).unwrap();
        let exact = f64::from(torque_nm) / 63.5 * 1e3 * if reversed { -1.0 } else { 1.0 };
        prop_assert!(fitted.value.unsigned_abs() <= limit);
        if fitted.saturated {
            prop_assert!(exact.abs() > f64::from(limit) * (1.0 - 1e-6));
            prop_assert_eq!(fitted.value.unsigned_abs(), limit);
        } else {
            prop_assert!((f64::from(fitted.value) - exact).abs() <= 0.5 + exact.abs() * 1e-6);
        }
        prop_assert!(f64::from(fitted.value) * exact >= 0.0);
    }
}
