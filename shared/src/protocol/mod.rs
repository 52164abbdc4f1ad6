//! The protocol between host and board. This header is its specification.
//!
//! # Frames
//! A stream of bytes carries frames: COBS with a closing zero, a CRC-32, postcard inside
//! ([`frame`]). A frame begins with an [`Envelope`]: session and sequence number. Frames that are
//! damaged are counted and have no other effect.
//!
//! # Requests and responses
//! Every request that arrives whole has exactly one response, which carries the request's sequence
//! number.
//!
//! | request | response | meaning |
//! |---|---|---|
//! | `Hello` | `Hello` | opens a session; who is there, what fits, what is loaded and stored; no sign of life |
//! | `Status` | `Status` | how things are |
//! | `KeepAlive` | `Done` | a sign of life |
//! | `UploadBegin` | `Upload` | begins an upload, or goes on with the same one |
//! | `UploadBlock` | `Upload` | 128 values of the trajectory; in any order, twice does no harm |
//! | `UploadProgress` | `Upload` | which blocks have arrived |
//! | `UploadCommit` | `Done` | hash, limits and start are checked, the trajectory is loaded |
//! | `UploadAbort` | `Done` | what was uploaded is thrown away |
//! | `Arm` | `Done` | drives on, creep to the first node |
//! | `Disarm` | `Done` | drives off, at rest |
//! | `Start` | `Done` | plays; quotes the hashes of trajectory and limits, chooses what happens when the host falls silent |
//! | `Hold` | `Done` | slows down on the path, stands still |
//! | `Resume` | `Done` | goes on |
//! | `Override` | `Done` | 0 to 100 % of the planned speed |
//! | `QuickStop` | `Done` | slows down on the path, then torque off, `Fault` |
//! | `Clear` | `Done` | leaves `Fault`; the drives' own faults are reset, in any state with the drives off |
//! | `Store` | `Done` | the loaded trajectory is kept over a loss of power, in place of one with the same id |
//! | `List` | `Stored` | what is stored |
//! | `Load` | `Done` | loads a stored trajectory |
//! | `Erase` | `Done` | forgets a stored trajectory, or all |
//! | `SetTelemetry` | `Done` | every how many drive ticks, which channels; no sign of life |
//! | `GetLimits` | `Limits` | the machine's limits |
//! | `SetLimits` | `Done` | other limits, kept over a loss of power; what was loaded is forgotten |
//! | `GetConfig` | `Config` | how the executor plays: tolerances, monitors, ramps |
//! | `SetConfig` | `Done` | plays otherwise, kept over a loss of power; what was loaded is forgotten |
//! | `GetDrives` | `Drives` | configuration of the drives |
//! | `SetDrives` | `Done` | another one, kept over a loss of power, in force from the next start of the board on, which a board that has such drives makes once the response is sent |
//! | `GetFault` | `Fault` | first cause and head of the fault record, kept over a reset |
//! | `GetFaultSamples` | `FaultSamples` | up to 5 samples of the last second before the fault |
//! | any | `Denied` | refused, with numbers; nothing has changed |
//!
//! Every new request of the open session is a sign of life of the host, but `SetTelemetry`; a
//! greeting and a repetition are none.
//!
//! `Telemetry` is sent unasked, with sequence numbers of its own.
//!
//! Axes, intervals, blocks and buses count from 0 in every message. Texts for people count axes and
//! intervals from 1, as plans and plots do: [`ordinal`](crate::ordinal).
//!
//! # Once, and in order
//! A host that hears no response sends the request again, with the same sequence number. Requests
//! that only ask, and blocks of an upload, are then simply answered again. *Orders* (all others;
//! [`Request::is_order`]) are obeyed at most once: a repetition of the latest order gets the same
//! response again, and an order older than the latest one is `Denied` as overtaken: after a quick
//! stop, no start sent before it can come true. Sequence numbers are compared modulo 2¹⁶; a host
//! begins anywhere, adds one per request and has one order unanswered at a time.
//!
//! A session ends when another one is opened; requests of any other session than the open one are
//! `Denied`, so that bytes left over on the line do nothing, also over a reset of the board: the
//! board draws session numbers from the host's nonce. A `Hello` with the nonce of the open
//! session is a repetition and opens none.
//!
//! # Upload
//! `UploadBegin` gives the outline: the sizes of all intervals, from which each block has its place.
//! Blocks are 128 values each, cut across intervals, so that any legal interval fits; up to
//! [`Capacities::window`] requests may be unanswered at a time. After a lost connection the same
//! `UploadBegin` answers which blocks have arrived, and only the others are sent. Nothing is loaded
//! before `UploadCommit`, which checks the hash over the whole and whether the machine may run it.
//!
//! # Versions
//! Both sides name the oldest and the newest version they understand, and a hash of the message
//! types ([`SCHEMA_HASH`]): the newest common version holds. Where there is none, the board opens no
//! session. Frame, envelope, `Hello` and [`Greeting`] are the same in all versions.
//!
//! New requests, responses and fields are a new version: count [`PROTOCOL`] up. Variants are
//! appended, never reordered.

pub mod frame;

mod denial;
mod fault;
mod hello;
mod request;
mod response;
mod store;
mod telemetry;

use core::ops::RangeInclusive;

use crate::crc::Crc32;

pub use denial::Denial;
pub use fault::{FaultAxis, FaultHead, FaultSample, MAX_FAULT_SAMPLES};
pub use frame::{Envelope, FrameDecoder, FrameError, MAX_FRAME_BYTES};
pub use hello::{Capacities, Greeting, Hello, Identity, MAX_STORED, Versions};
pub use request::{Block, Request};
pub use response::{AxisStatus, LinkCounters, Message, Response, Status, StoredMove};
pub use store::StoreError;
pub use telemetry::{Channels, MAX_CHANNELS, MAX_TELEMETRY_BYTES, Telemetry, TelemetryConfig};

/// Versions of the protocol that this side understands.
pub const PROTOCOL: RangeInclusive<u16> = 1..=1;

/// All message types, field by field and variant by variant, in words. A test compares them with
/// the code; `STILLPOINT_WRITE_SCHEMA=1 cargo test -p stillpoint-shared` writes them anew.
pub const SCHEMA: &str = include_str!("schema.txt");

/// CRC-32 of [`SCHEMA`]: it changes when any message type does.
pub const SCHEMA_HASH: u32 = Crc32::of(SCHEMA.as_bytes());
