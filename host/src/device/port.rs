//! Names of ports, as people type them.

use super::{Qemu, Serial, Tcp, Transport, TransportError, qemu};
use std::fmt;
use std::str::FromStr;

/// Rate of a serial port where none is named, in bit/s.
const DEFAULT_BAUD: u32 = 921_600;

/// A port by name.
///
/// | name | meaning |
/// |---|---|
/// | `/dev/ttyUSB0`, `COM3` | a serial port at 921,600 bit/s |
/// | `/dev/ttyUSB0@115200` | the same at another rate |
/// | `tcp:host:port` | a TCP connection |
/// | `qemu:` | an emulated board, started for this process |
/// | `sim:` | a simulated board in this process |
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Port {
    /// A serial port.
    Serial {
        /// Its path or name.
        path: String,
        /// Its rate in bit/s.
        baud: u32,
    },
    /// A TCP connection.
    Tcp {
        /// Host and port, `host:port`.
        address: String,
    },
    /// An emulated board, started for this process.
    Qemu,
    /// A simulated board in this process.
    Sim,
}

/// Why a name is none of a port.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` is no port: {problem}; give /dev/tty…, COM…, tcp:host:port, qemu: or sim:")]
pub struct PortError {
    /// The name.
    pub name: String,
    /// What is wrong with it.
    pub problem: &'static str,
}

impl FromStr for Port {
    type Err = PortError;

    fn from_str(name: &str) -> Result<Self, PortError> {
        let wrong = |problem| {
            Err(PortError {
                name: name.to_owned(),
                problem,
            })
        };
        if name == "sim:" {
            return Ok(Self::Sim);
        }
        if name == "qemu:" {
            return Ok(Self::Qemu);
        }
        if let Some(address) = name.strip_prefix("tcp:") {
            return match address.rsplit_once(':') {
                Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok() => {
                    Ok(Self::Tcp {
                        address: address.to_owned(),
                    })
                }
                _ => wrong("a TCP port is named by host and number"),
            };
        }
        let (path, baud) = match name.split_once('@') {
            None => (name, Ok(DEFAULT_BAUD)),
            Some((path, baud)) => (path, baud.parse()),
        };
        match baud {
            _ if path.is_empty() => wrong("it has no name"),
            _ if path.contains(':') => wrong("this kind of port is not known"),
            Err(_) | Ok(0) => wrong("the rate behind @ is a number of bit/s"),
            Ok(baud) => Ok(Self::Serial {
                path: path.to_owned(),
                baud,
            }),
        }
    }
}

impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial {
                path,
                baud: DEFAULT_BAUD,
            } => f.write_str(path),
            Self::Serial { path, baud } => write!(f, "{path}@{baud}"),
            Self::Tcp { address } => write!(f, "tcp:{address}"),
            Self::Qemu => f.write_str("qemu:"),
            Self::Sim => f.write_str("sim:"),
        }
    }
}

impl Port {
    /// Opens the port. The axes of an emulated board stand at `position_rad`, or at zero where it
    /// names none. A simulated board needs to know its machine and is made with
    /// [`Simulated::new`](super::Simulated::new) instead: for [`Port::Sim`] this calls `simulated`.
    ///
    /// # Errors
    /// [`TransportError`] where it is absent, in use or silent.
    pub fn open(
        &self,
        position_rad: &[f32],
        simulated: impl FnOnce() -> Result<Box<dyn Transport>, TransportError>,
    ) -> Result<Box<dyn Transport>, TransportError> {
        Ok(match self {
            Self::Serial { path, baud } => Box::new(Serial::open(path, *baud)?),
            Self::Tcp { address } => Box::new(Tcp::connect(address)?),
            Self::Qemu => {
                let mut board = Qemu::start(&qemu::Options::default())?;
                board.turn_to(position_rad)?;
                Box::new(board)
            }
            Self::Sim => simulated()?,
        })
    }
}
