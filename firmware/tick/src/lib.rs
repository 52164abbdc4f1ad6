//! The tick of a board, compiled for speed.
//!
//! Generic code is compiled as the crate that uses it wants, and a board image wants to be small.
//! Here the drive loop is used once for the boards' number of axes, and the profile `firmware`
//! compiles this crate for speed. The drives come by reference: their type is the image's.
#![no_std]
#![forbid(unsafe_code)]

use stillpoint_firmware::bench::AXES;
use stillpoint_firmware::drive::NoAnswer;
use stillpoint_firmware::stand_in::StandIn;
use stillpoint_firmware::{DriveGroup, Machine, TickInputs, TickReport};

/// [`Machine::tick`], with what the stand-in has to say to it; it hears what the drives are told.
#[inline(never)]
pub fn tick<'m>(
    machine: &'m mut Machine<AXES>,
    drives: &mut dyn DriveGroup<AXES, Error = NoAnswer>,
    stand_in: &mut StandIn<AXES>,
    mut inputs: TickInputs,
) -> TickReport<'m, AXES> {
    stand_in.hand_back(&mut inputs);
    machine.tick(&mut stand_in.watching(drives), &inputs)
}
