//! A way to a board for bytes, with a clock.

use super::qemu::QemuError;
use std::io;
use std::time::Duration;

/// A way to a board for bytes.
///
/// It has a clock of its own, so that a simulated board runs in simulated time, as fast as it can.
pub trait Transport {
    /// Sends all of `bytes`.
    ///
    /// # Errors
    /// [`TransportError`] where the way is gone.
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError>;

    /// Waits for bytes at most so long and writes them into `buffer`; returns how many, 0 if none came.
    ///
    /// # Errors
    /// [`TransportError`] where the way is gone.
    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError>;

    /// Time since some moment; never goes back.
    fn now(&self) -> Duration;

    /// Gives the way up and looks for it anew.
    ///
    /// # Errors
    /// [`TransportError`] where it is not found.
    fn reconnect(&mut self) -> Result<(), TransportError>;
}

impl<T: Transport + ?Sized> Transport for Box<T> {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        (**self).send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        (**self).receive(buffer, timeout)
    }

    fn now(&self) -> Duration {
        (**self).now()
    }

    fn reconnect(&mut self) -> Result<(), TransportError> {
        (**self).reconnect()
    }
}

/// Why a way to a board is gone, or was never there.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TransportError {
    /// There is no such port.
    #[error(
        "there is no port {port}: plug the board in; `stillpoint device ports` lists the ports there are"
    )]
    Absent {
        /// The port.
        port: String,
    },
    /// Somebody else has the port.
    #[error("port {port} is in use: close the other program ({reason})")]
    Busy {
        /// The port.
        port: String,
        /// What the system says.
        reason: String,
    },
    /// The system lets only certain users at the port.
    #[error(
        "you may not use {port}: add yourself to the group dialout (`sudo usermod -aG dialout $USER`), then log in again \
         ({reason})"
    )]
    Forbidden {
        /// The port.
        port: String,
        /// What the system says.
        reason: String,
    },
    /// There is something of that name, but it does not work as a serial port.
    #[error(
        "{port} is no serial port, or none that can do {baud} bit/s: name one of those that `stillpoint device ports` \
         lists, or another rate as in {port}@115200 ({reason})"
    )]
    NotSerial {
        /// The name.
        port: String,
        /// The rate in bit/s.
        baud: u32,
        /// What the system says.
        reason: String,
    },
    /// Nobody listens at the address.
    #[error(
        "nobody answers at {address} ({reason}): start the board or its emulation, and check host and port"
    )]
    Refused {
        /// The address.
        address: String,
        /// What the system says.
        reason: String,
    },
    /// The other side has closed the connection.
    #[error("the connection to {port} was closed by the other side")]
    Closed {
        /// The port.
        port: String,
    },
    /// The emulated board does not start.
    #[error(transparent)]
    Emulator(#[from] QemuError),
    /// The system fails.
    #[error("port {port} failed: {error}")]
    Failed {
        /// The port.
        port: String,
        /// How.
        #[source]
        error: io::Error,
    },
}
