//! A board on a serial port.

use super::transport::{Transport, TransportError};
use serialport::SerialPort;
use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

/// Longest time to wait for bytes to be taken.
const PATIENCE: Duration = Duration::from_secs(5);

/// A serial port: 8 bits, no parity, one stop bit, no flow control.
pub struct Serial {
    path: String,
    baud: u32,
    port: Box<dyn SerialPort>,
    opened: Instant,
}

impl Serial {
    /// Opens a port at a rate in bit/s.
    ///
    /// # Errors
    /// [`TransportError`] where it is absent or in use.
    pub fn open(path: &str, baud: u32) -> Result<Self, TransportError> {
        Ok(Self {
            path: path.to_owned(),
            baud,
            port: port(path, baud)?,
            opened: Instant::now(),
        })
    }

    /// Names of the serial ports of this computer, sorted.
    ///
    /// # Errors
    /// [`TransportError::Failed`] where the system does not tell.
    pub fn list() -> Result<Vec<String>, TransportError> {
        let ports = serialport::available_ports().map_err(|error| TransportError::Failed {
            port: "list".to_owned(),
            error: error.into(),
        })?;
        let mut names: Vec<_> = ports.into_iter().map(|port| port.port_name).collect();
        names.sort();
        Ok(names)
    }

    fn failed(&self, error: std::io::Error) -> TransportError {
        let port = self.path.clone();
        match error.kind() {
            ErrorKind::BrokenPipe | ErrorKind::UnexpectedEof | ErrorKind::NotFound => {
                TransportError::Closed { port }
            }
            _ => TransportError::Failed { port, error },
        }
    }
}

fn port(path: &str, baud: u32) -> Result<Box<dyn SerialPort>, TransportError> {
    let opened = serialport::new(path, baud).timeout(PATIENCE).open();
    opened.map_err(|error| not_opened(path, baud, error))
}

/// Why a port does not open.
fn not_opened(path: &str, baud: u32, error: serialport::Error) -> TransportError {
    use serialport::ErrorKind as Kind;
    let (port, reason) = (path.to_owned(), error.description);
    match error.kind {
        Kind::NoDevice if std::path::Path::new(path).exists() => {
            TransportError::Busy { port, reason }
        }
        Kind::NoDevice | Kind::Io(ErrorKind::NotFound) => TransportError::Absent { port },
        // Elsewhere, as on Windows, this is what the system says of a port that is in use.
        Kind::Io(ErrorKind::PermissionDenied) if cfg!(unix) => {
            TransportError::Forbidden { port, reason }
        }
        Kind::Io(ErrorKind::PermissionDenied | ErrorKind::ResourceBusy | ErrorKind::WouldBlock) => {
            TransportError::Busy { port, reason }
        }
        _ => TransportError::NotSerial { port, baud, reason },
    }
}

impl Transport for Serial {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.port
            .set_timeout(PATIENCE)
            .map_err(|error| self.failed(error.into()))?;
        self.port
            .write_all(bytes)
            .map_err(|error| self.failed(error))
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        self.port
            .set_timeout(timeout.max(Duration::from_millis(1)))
            .map_err(|error| self.failed(error.into()))?;
        match self.port.read(buffer) {
            Ok(bytes) => Ok(bytes),
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => Ok(0),
                _ => Err(self.failed(error)),
            },
        }
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    fn reconnect(&mut self) -> Result<(), TransportError> {
        // The old one has to be closed first. Where it fails, the next call reports it.
        self.port = port(&self.path, self.baud)?;
        Ok(())
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    /// Whoever runs the tests may be allowed everything, so the system's answer is made up.
    #[test]
    fn a_port_that_is_not_allowed_is_told_from_one_in_use() {
        let said = |kind| {
            let error = serialport::Error::new(serialport::ErrorKind::Io(kind), "as it says");
            not_opened("/dev/ttyUSB0", 921_600, error).to_string()
        };
        let words = said(ErrorKind::PermissionDenied);
        assert!(
            words.contains("you may not use /dev/ttyUSB0")
                && words.contains("sudo usermod -aG dialout $USER"),
            "{words}"
        );
        assert!(said(ErrorKind::WouldBlock).contains("is in use"));
    }
}
