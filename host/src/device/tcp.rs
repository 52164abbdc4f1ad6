//! A board behind a TCP connection, such as an emulated one or a serial port served by another computer.

use super::transport::{Transport, TransportError};
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

/// Longest time to wait for a connection, and for bytes to be taken.
const PATIENCE: Duration = Duration::from_secs(5);

/// A TCP connection.
#[derive(Debug)]
pub struct Tcp {
    address: String,
    stream: TcpStream,
    opened: Instant,
}

impl Tcp {
    /// Connects to `host:port`.
    ///
    /// # Errors
    /// [`TransportError`] where nobody listens.
    pub fn connect(address: &str) -> Result<Self, TransportError> {
        Ok(Self {
            address: address.to_owned(),
            stream: stream(address)?,
            opened: Instant::now(),
        })
    }

    fn failed(&self, error: std::io::Error) -> TransportError {
        let port = format!("tcp:{}", self.address);
        match error.kind() {
            ErrorKind::ConnectionReset
            | ErrorKind::ConnectionAborted
            | ErrorKind::BrokenPipe
            | ErrorKind::UnexpectedEof => TransportError::Closed { port },
            _ => TransportError::Failed { port, error },
        }
    }
}

fn stream(address: &str) -> Result<TcpStream, TransportError> {
    let refused = |reason: String| TransportError::Refused {
        address: address.to_owned(),
        reason,
    };
    let addresses = address
        .to_socket_addrs()
        .map_err(|error| refused(error.to_string()))?;
    let mut reason = "the name has no address".to_owned();
    for candidate in addresses {
        match TcpStream::connect_timeout(&candidate, PATIENCE) {
            Ok(stream) => {
                let set_up = stream
                    .set_nodelay(true)
                    .and_then(|()| stream.set_write_timeout(Some(PATIENCE)));
                return set_up
                    .map(|()| stream)
                    .map_err(|error| refused(error.to_string()));
            }
            Err(error) => reason = error.to_string(),
        }
    }
    Err(refused(reason))
}

impl Transport for Tcp {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.stream
            .write_all(bytes)
            .map_err(|error| self.failed(error))
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        // Zero would mean for ever.
        let timeout = timeout.max(Duration::from_millis(1));
        self.stream
            .set_read_timeout(Some(timeout))
            .map_err(|error| self.failed(error))?;
        match self.stream.read(buffer) {
            Ok(0) if !buffer.is_empty() => Err(self.failed(ErrorKind::UnexpectedEof.into())),
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
        self.stream = stream(&self.address)?;
        Ok(())
    }
}
