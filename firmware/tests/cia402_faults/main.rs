//! Drives that fail and messages that do not arrive: what the executor is told, what the drives are
//! told, and that nothing comes back by itself.

#[path = "../cia402_sim/mod.rs"]
mod cia402_sim;
mod resets;
mod set_up;
mod silence;
mod starts;

use cia402_sim::{Rig, TICK_US};
use stillpoint_firmware::{DriveStatus, Feedback};

fn statuses<const N: usize>(feedback: [Feedback; N]) -> [DriveStatus; N] {
    feedback.map(|feedback| feedback.status)
}

const fn fault(code: u16) -> DriveStatus {
    DriveStatus::Fault { code }
}

/// Ticks until an axis reports a fault, with the others held where they are; and its code.
fn ticks_to_fault<const N: usize, const B: usize>(rig: &mut Rig<N, B>, axis: usize) -> (u64, u16) {
    let since_us = rig.now_us;
    let mut feedback = rig.exchange_where_they_stand();
    for _ in 0..4_000 {
        if let DriveStatus::Fault { code } = feedback[axis].status {
            return ((rig.now_us - since_us) / TICK_US, code);
        }
        feedback = rig.exchange(&Rig::<N, B>::stay(&feedback)).unwrap();
    }
    panic!("no fault");
}
