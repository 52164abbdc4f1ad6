//! Servo drives by CiA 402 over CANopen, in cyclic synchronous position mode with torque offset, on
//! one or two CAN buses behind the `embedded-can` traits.
//!
//! [`Cia402Group`] is the executor's [`DriveGroup`](crate::DriveGroup). It is called once per tick,
//! never waits, and gives at most three frames to a bus and takes at most eight from it per call. A
//! bus cycle is several ticks long: the set-points of one tick, the same for all axes, go out so
//! that they have come when SYNC makes all drives take them; the set-points of the other ticks are
//! not sent. Feedback is what the drives measured at the last SYNC, and its age counts the ticks
//! since. The cycle and the load of the bus are worked out in
//! [`shared::drive_config`](stillpoint_shared::drive_config); what the executor's monitor has to
//! allow because of it is [`Cycle::monitor`](stillpoint_shared::drive_config::Cycle::monitor).
//!
//! The speed is the difference of two positions: it comes in steps of one increment per cycle.
//!
//! # Messages
//!
//! | identifier | from | bytes | content |
//! |---|---|---|---|
//! | 000h | board | 2 | network management: enter pre-operational, start |
//! | 080h | board | 0 | SYNC, every cycle |
//! | 080h + node | drive | 8 | emergency: error code, error register, the maker's |
//! | 180h + node | drive | 7 | first transmit PDO, at SYNC: statusword 6041h (2), actual position 6064h (4), mode shown 6061h (1) |
//! | 200h + node | board | 8 | first receive PDO, taken at SYNC: controlword 6040h (2), target position 607Ah (4), torque offset 60B2h (2) |
//! | 580h + node | drive | 8 | SDO answer |
//! | 600h + node | board | 8 | SDO request, at most one per bus and cycle |
//! | 700h + node | drive | 1 | heartbeat, boot-up |
//! | 700h + board | board | 1 | the board's heartbeat, unless switched off |
//!
//! # Set-up, drive by drive
//!
//! | objects | value | why |
//! |---|---|---|
//! | (NMT) | enter pre-operational | no process data meanwhile |
//! | 1000h | read: 402 | is it a drive at all |
//! | 6040h | 0 | torque off, whatever was before |
//! | 6076h | read: rated torque | must agree with the configuration within 1 %; may be absent |
//! | 1017h | heartbeat period | the board notices when the drive dies |
//! | 1016h:1 | board's node id, timeout | the drive notices when the board dies |
//! | 60C2h:1, :2 | bus period | interpolation between set-points |
//! | 6060h | 8 | cyclic synchronous position |
//! | 1400h, 1600h | mapping above | set-points, taken at SYNC; not if the mapping is preset |
//! | 1800h, 1A00h | mapping above | feedback, measured at SYNC; not if the mapping is preset |
//! | 1801h to 1803h | off | other PDOs would load the bus; may be absent |
//! | (NMT) | start | |
//!
//! A drive that does not answer is asked again every 100 ms, and from the beginning every 300 ms, so
//! it may be switched on later than the board. Network management is not answered: going pre-
//! operational is told twice, starting until feedback comes. A drive that refuses is latched as a
//! [`Trouble`], with the object and the reason.
//!
//! # What is commanded
//! * A drive gets set-points only while it has confirmed Operation enabled, mode 8 and (bit 12 of
//!   the statusword) that it follows. Any other is told to stay where it was measured, without torque
//!   offset; before it has said where it stands it is told nothing.
//! * `exchange` brings a drive from state to state, one command per confirmed state. A drive that
//!   faults, leaves the mode, or lost more than three messages in a row is told to switch its voltage
//!   off.
//! * `safe` makes the very next frame of each axis Disable voltage and brings SYNC forward.
//! * A fault is reset by one rising edge of bit 7, only on
//!   [`request_fault_reset`](Cia402Group::request_fault_reset), which the executor calls for a
//!   `clear`, and only while the drives are off.
//!
//! # Errors in `DriveStatus::Fault`
//! The code of the drive's emergency message; 603Fh is read if that was lost, and 1000h (generic)
//! told until it is known. What the board itself sees has codes of its own, B001h to B00Ah
//! ([`seen`](stillpoint_shared::drive_error::seen)). [`Cia402Group::report`] has the details in words.
//!
//! Sources: CiA 301 (CANopen), CiA 402-2 and -3 (IEC 61800-7-201, -301).

mod abort;
mod axis;
mod bus;
mod configured;
mod error_code;
mod frame;
mod group;
mod measured;
mod nmt;
mod report;
mod reset;
mod sdo;
mod send;
mod setup;
mod state;
mod target;
mod trouble;
mod units;

pub use abort::AbortCode;
pub use bus::{Buses, Controller, Received, Sent};
pub use configured::{ConfiguredDrives, NoDrives};
pub use frame::CanFrame;
pub use group::{BusStuck, Cia402Group, GroupError, MOST_RECEIVED};
pub use nmt::NmtState;
pub use report::{AxisReport, Stage, Traffic};
pub use sdo::Object;
pub use send::MOST_SENT;
pub use state::{Command, DriveState};
pub use trouble::Trouble;
pub use units::{Fitted, Units};

/// Mode of operation 8 (6060h): cyclic synchronous position.
pub const CYCLIC_SYNCHRONOUS_POSITION: i8 = 8;
