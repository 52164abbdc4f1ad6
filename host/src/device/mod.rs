//! The host's side of the protocol: sessions with boards on serial ports, over TCP, emulated, or simulated in this
//! process.
//!
//! ```text
//! Session ─ Faulty ─ Tcp, Serial, Qemu, Simulated ═ the line ═ firmware's Link
//!            └ optional: loses, damages and delays frames on purpose
//! ```
//!
//! A [`Session`] sends a request again until it is answered, connects anew when the session is lost, and goes on with
//! an upload where it was. It never repeats an order whose repetition could mean something else, and it never sends
//! anything by itself: a board that waits for signs of life hears what its user's program asks for and nothing more.
//! [`stillpoint_shared::protocol`] is the specification.

mod error;
mod fault_record;
mod faults;
mod injector;
mod log;
mod port;
pub mod qemu;
mod receiver;
mod serial;
mod session;
mod sim;
mod start;
mod tcp;
#[cfg(test)]
mod tests;
mod transport;
mod upload;

pub use error::DeviceError;
pub use fault_record::FaultReport;
pub use faults::{Faults, FaultsError, Injected};
pub use injector::Faulty;
pub use log::{LogError, LogImage};
pub use port::{Port, PortError};
pub use qemu::Qemu;
pub use receiver::{Received, Reception};
pub use serial::Serial;
pub use session::{Session, Settings};
pub use sim::{SIMULATED_LINE_BYTES_PER_S, Simulated};
pub use tcp::Tcp;
pub use transport::{Transport, TransportError};
pub use upload::{Progress, Uploaded};
