//! The port to the test bench of the emulated board: UART4.
//!
//! In the emulator a byte is sent at once, for as long as it takes the host to accept it, and the
//! emulated clock stands still meanwhile: nothing gets lost and nothing depends on the host's speed.

use stillpoint_firmware::bench::{Action, ActionReader, MAX_RECORD_BYTES, Record};
use stm32f4::stm32f405::UART4;

/// Receiving half, for the interrupt.
#[derive(Debug)]
pub struct BenchReceiver(ActionReader);

/// Sending half.
#[derive(Debug)]
pub struct BenchTransmitter(());

/// Switches the port on, its clock being on already.
pub fn start(port: UART4) -> (BenchTransmitter, BenchReceiver) {
    port.cr1().write(|w| {
        w.ue().set_bit();
        w.te().set_bit();
        w.re().set_bit();
        w.rxneie().set_bit()
    });
    (BenchTransmitter(()), BenchReceiver(ActionReader::default()))
}

impl BenchReceiver {
    /// Takes a byte; returns the action that it ends, if it ends one.
    pub fn take(&mut self) -> Option<Action> {
        // SAFETY: this half only reads DR, and there is one such half.
        let port = unsafe { &*UART4::ptr() };
        self.0.take(port.dr().read().dr().bits() as u8)
    }
}

impl BenchTransmitter {
    /// Sends a record.
    pub fn send(&mut self, record: &Record) {
        let mut buffer = [0; MAX_RECORD_BYTES];
        // A record has at most that many bytes.
        let bytes = record.encode(&mut buffer);
        // SAFETY: this half only writes DR, and there is one such half.
        let port = unsafe { &*UART4::ptr() };
        for byte in bytes.iter() {
            port.dr().write(|w| w.dr().set((*byte).into()));
        }
    }
}
