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
    let port = path.to_owned();
    serialport::new(path, baud)
        .timeout(PATIENCE)
        .open()
        .map_err(|error| match error.kind {
            serialport::ErrorKind::NoDevice if std::path::Path::new(path).exists() => {
                TransportError::Busy {
                    port,
                    reason: error.description,
                }
            }
            serialport::ErrorKind::NoDevice | serialport::ErrorKind::Io(ErrorKind::NotFound) => {
                TransportError::Absent { port }
            }
            serialport::ErrorKind::Io(
                ErrorKind::PermissionDenied | ErrorKind::ResourceBusy | ErrorKind::WouldBlock,
            ) => TransportError::Busy {
                port,
                reason: error.description,
            },
            _ => TransportError::NotSerial {
                port,
                baud,
                reason: error.description,
            },
        })
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
