//! The tick of a board, compiled for speed.
//!
//! Generic code is compiled as the crate that uses it wants, and a board image wants to be small.
//! Here the drive loop is used once for the boards' number of axes, so that it is compiled with
//! this library. The drives come by reference: their type is the image's.

use crate::bench::AXES;
use crate::drive::NoAnswer;
use crate::{DriveGroup, Machine, TickInputs, TickReport};

/// [`Machine::tick`].
#[inline(never)]
pub fn tick<'m>(
    machine: &'m mut Machine<AXES>,
    drives: &mut dyn DriveGroup<AXES, Error = NoAnswer>,
    inputs: &TickInputs,
) -> TickReport<'m, AXES> {
    machine.tick(drives, inputs)
}
