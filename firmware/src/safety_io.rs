//! The two wires of safety: the emergency-stop contact in, the drive-enable line out.
//!
//! The contact is normally closed to the supply, so the input is high while all is well and low
//! when it is pressed or a wire breaks. Hardware removes the torque by itself; here it is observed,
//! and the enable line follows.

use embedded_hal::digital::{InputPin, OutputPin};

/// Emergency-stop input and drive-enable output.
#[derive(Debug)]
pub struct SafetyIo<S, E> {
    stop_contact: S,
    drive_enable: E,
}

impl<S: InputPin, E: OutputPin> SafetyIo<S, E> {
    /// Takes the pins; the enable line is left as it is until the first [`SafetyIo::update`].
    pub fn new(stop_contact: S, drive_enable: E) -> Self {
        Self {
            stop_contact,
            drive_enable,
        }
    }

    /// Enables the drives if they are `wanted` and nothing speaks against it, else disables them;
    /// once per tick.
    ///
    /// Returns false when the emergency stop is pressed, or when a pin cannot be read or set: then
    /// the caller calls [`Executor::emergency_stop`](crate::Executor::emergency_stop).
    #[must_use]
    pub fn update(&mut self, wanted: bool) -> bool {
        let released = self.stop_contact.is_high().unwrap_or(false);
        let set = if wanted && released {
            self.drive_enable.set_high()
        } else {
            self.drive_enable.set_low()
        };
        released && set.is_ok()
    }
}
