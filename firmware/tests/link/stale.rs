//! Where the axes stand counts only as long as their drives are heard.

use stillpoint_firmware::bench::{Action, BenchDrives};
use stillpoint_firmware::{DriveGroup, FaultCause, Feedback, Refusal, Setpoint, State};
use stillpoint_shared::protocol::{Denial, Request, Response};
use stillpoint_shared::status::DriveStatus;

use crate::common::{AXES, FINE, start, trajectory};
use crate::rig::Rig;

fn stale(axis: u8, age_ticks: u16) -> Response {
    let limit_ticks = 2;
    Response::Denied(Denial::Executor(Refusal::Feedback(
        FaultCause::FeedbackStale {
            axis,
            age_ticks,
            limit_ticks,
        },
    )))
}

/// Drives that stand at the start, but one was never heard.
struct NeverHeard;

impl DriveGroup<AXES> for NeverHeard {
    type Error = ();

    fn exchange(&mut self, _: &[Setpoint; AXES]) -> Result<[Feedback; AXES], ()> {
        self.observe()
    }

    fn observe(&mut self) -> Result<[Feedback; AXES], ()> {
        let at = |axis: usize, age_ticks| Feedback {
            position_rad: start()[axis],
            velocity_rad_per_s: 0.0,
            age_ticks,
            status: DriveStatus::Disabled,
        };
        Ok([at(0, 0), at(1, u16::MAX)])
    }

    fn safe(&mut self) {}
}

#[test]
fn nothing_is_loaded_against_a_drive_that_was_never_heard() {
    let mut rig = Rig::new();
    rig.machine.tick(&mut NeverHeard, &FINE);
    assert_eq!(rig.upload(&trajectory()), stale(1, u16::MAX));
    assert_eq!(rig.state(), State::Loading);
}

#[test]
fn nothing_is_loaded_against_a_drive_that_fell_silent_and_all_is_well_when_it_is_back() {
    let mut rig = Rig::new();
    rig.upload(&trajectory());
    rig.done(&Request::Store);
    let mut drives = BenchDrives::at(&start());
    rig.machine.tick(&mut drives, &FINE);
    drives.act(Action::Silence { axis: 0 });
    for _ in 0..3 {
        rig.machine.tick(&mut drives, &FINE);
    }
    let content_hash = trajectory().header().content_hash;
    assert_eq!(rig.ask(&Request::Load { content_hash }), stale(0, 3));
    assert_eq!(rig.ask(&Request::Arm), stale(0, 3));
    assert_eq!(rig.upload(&trajectory()), stale(0, 3));
    drives.act(Action::Repair);
    rig.machine.tick(&mut drives, &FINE);
    rig.done(&Request::UploadCommit { content_hash });
    rig.done(&Request::Load { content_hash });
    rig.done(&Request::Arm);
}
