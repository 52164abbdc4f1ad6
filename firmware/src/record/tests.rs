//! What the record makes of any bytes, and what it rounds.

use stillpoint_shared::status::{Fault, FaultCause, LimitFlags, State};

use super::sample::{from_upper_half, upper_half};
use super::{FaultRecord, HEAD_BYTES, Moment, RECENT, RawSample};

const MOMENT: Moment = Moment {
    tick: 0,
    path_ticks: 70_000,
    state: State::Running,
    limited: LimitFlags::SPEED,
    path_speed: 255,
    age_ticks: 1,
};

fn filled() -> FaultRecord<2> {
    let mut record = FaultRecord::empty();
    record.begin(1, 2, 2_500);
    for tick in 0..2_000 {
        let moment = Moment { tick, ..MOMENT };
        let axis = [0.001_234, -31.4, 139.9];
        record.push(&RawSample::new(&moment, [axis, axis].into_iter()));
    }
    record.close(Fault {
        cause: FaultCause::EmergencyStop,
        tick: 2_000,
    });
    record
}

#[test]
fn values_keep_three_digits() {
    let record = filled();
    let last = record.samples().last().unwrap();
    assert_eq!((last.tick, last.path_ticks), (1_999, 70_000));
    assert_eq!(
        (last.state, last.limited),
        (Some(State::Running), LimitFlags::SPEED)
    );
    for (kept, value) in [
        (last.following_error_rad, 0.001_234),
        (last.velocity_rad_per_s, -31.4),
        (last.torque_nm, 139.9),
    ] {
        assert!((kept[0] / value - 1.0f32).abs() <= 1.0 / 256.0, "{kept:?}");
    }
    for value in [f32::INFINITY, f32::NEG_INFINITY, 0.0, -2.0] {
        assert_eq!(from_upper_half(upper_half(value)), value);
    }
    assert!(from_upper_half(upper_half(f32::NAN)).is_nan());
}

#[test]
fn any_change_of_the_head_makes_the_record_empty() {
    for byte in 0..HEAD_BYTES {
        let mut record = filled();
        record.head[byte] ^= 0x41;
        assert_eq!(record.head(), None, "{byte}");
    }
    let spoils: [fn(&mut FaultRecord<2>); 3] = [
        |record| record.magic ^= 1,
        |record| record.check ^= 1,
        |record| record.check ^= 1 << 31,
    ];
    for spoil in spoils {
        let mut record = filled();
        spoil(&mut record);
        record.recover();
        assert_eq!((record.head(), record.samples().count()), (None, 0));
    }
}

#[test]
fn samples_half_written_are_left_out_and_a_wrong_place_does_no_harm() {
    let mut record = filled();
    let whole = record.samples().count();
    record.recent.samples[3].axes[1][2] ^= 0x10;
    assert_eq!(record.samples().count(), whole - 1);
    record.recent.next = 60_000;
    record.past.next = u16::MAX;
    record.until_past = 0;
    record.recover();
    assert_eq!(record.recent.iter().count(), RECENT - 1);
    let sample = RawSample::new(&MOMENT, [[0.0; 3]; 2].into_iter());
    record.push(&sample);
    assert_eq!((record.recent.next, record.past.next), (1, 1));
}
