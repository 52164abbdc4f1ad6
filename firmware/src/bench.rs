//! A test bench for boards without a machine: drives that do as they are told until the bench tells
//! them to misbehave, and the record of every tick that the bench reads.
//!
//! The emulated board has one on its second port, for the tests; the host's simulated board uses
//! the same drives.

use core::convert::Infallible;

use heapless::Vec;
use nalgebra::SVector;
use serde::{Deserialize, Serialize};
use stillpoint_shared::{decode, encode};

use crate::drive::NoAnswer;
use crate::{DriveGroup, DriveStatus, Feedback, IdealDrives, Setpoint, State};

/// What the bench can do. On its port, postcard: [`Action::encode`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Action {
    /// Nothing is wrong any more.
    Repair,
    /// Presses the emergency stop.
    Stop,
    /// The bus to the drives fails.
    CutBus,
    /// The next tick takes longer than the monitor usually allows.
    Overrun,
    /// The drive of an axis stops by itself, with code [`DRIVE_FAULT`], until it is reset.
    Fault {
        /// Axis, from 0.
        axis: u8,
    },
    /// The drive of an axis switches off without saying why.
    SwitchOff {
        /// Axis, from 0.
        axis: u8,
    },
    /// The messages of an axis are lost.
    Silence {
        /// Axis, from 0.
        axis: u8,
    },
    /// An axis is held fast where it is.
    Block {
        /// Axis, from 0.
        axis: u8,
    },
    /// Turns an axis by hand, with the drives off.
    Turn {
        /// Axis, from 0.
        axis: u8,
        /// To this angle in rad.
        position_rad: f32,
    },
    /// The emulated board starts again, as after a reset; what survives one, does.
    Reset,
    /// The emulated board reports [`Record::Stack`].
    MeasureStack,
}

/// Most bytes of an [`Action`].
pub const MAX_ACTION_BYTES: usize = 8;

/// Code of a drive fault that the bench makes: CiA 402, "generic error".
pub const DRIVE_FAULT: u16 = 0x1000;

impl Action {
    /// The bytes that mean this, in `buffer`.
    pub fn encode<'b>(&self, buffer: &'b mut [u8; MAX_ACTION_BYTES]) -> &'b [u8] {
        // There is room: this cannot fail.
        encode::to_slice(self, buffer).unwrap_or_default()
    }
}

/// Finds actions in a stream of bytes.
#[derive(Debug, Clone, Default)]
pub struct ActionReader {
    bytes: Vec<u8, MAX_ACTION_BYTES>,
}

impl ActionReader {
    /// Takes a byte; returns the action that it ends, if it ends one. Bytes that mean nothing are
    /// forgotten.
    pub fn take(&mut self, byte: u8) -> Option<Action> {
        let _ = self.bytes.push(byte);
        match decode::front(&self.bytes) {
            Err(postcard::Error::DeserializeUnexpectedEnd) => None,
            read => {
                self.bytes.clear();
                read.ok()
            }
        }
    }
}

/// Drives on the bench. They take [`ENABLING_TICKS`] to follow, as real ones take their time.
#[derive(Debug, Clone)]
pub struct BenchDrives<const N: usize> {
    ideal: IdealDrives<N>,
    last: [Feedback; N],
    trouble: [Trouble; N],
    bus_cut: bool,
    enabling_ticks: u32,
    sent: Option<[Setpoint; N]>,
}

/// Ticks from the first set-point to the first one that is followed.
pub const ENABLING_TICKS: u32 = 8;

/// What is wrong with an axis.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Trouble {
    status: Option<DriveStatus>,
    silent: bool,
    blocked: bool,
}

impl<const N: usize> BenchDrives<N> {
    /// Disabled drives that stand still at a position in rad.
    pub fn at(position_rad: &SVector<f32, N>) -> Self {
        let mut ideal = IdealDrives::at(position_rad);
        let Ok(last) = ideal.observe();
        Self {
            ideal,
            last,
            trouble: [Trouble::default(); N],
            bus_cut: false,
            enabling_ticks: 0,
            sent: None,
        }
    }

    /// Makes trouble, or ends it; actions that are not the drives' do nothing.
    pub fn act(&mut self, action: Action) {
        match action {
            Action::Repair => {
                self.trouble = [Trouble::default(); N];
                self.bus_cut = false;
            }
            Action::CutBus => self.bus_cut = true,
            Action::Fault { axis } => {
                self.trouble_of(axis, |trouble| {
                    trouble.status = Some(DriveStatus::Fault { code: DRIVE_FAULT });
                });
            }
            Action::SwitchOff { axis } => {
                self.trouble_of(axis, |trouble| {
                    trouble.status = Some(DriveStatus::Disabled);
                });
            }
            Action::Silence { axis } => self.trouble_of(axis, |trouble| trouble.silent = true),
            Action::Block { axis } => self.trouble_of(axis, |trouble| trouble.blocked = true),
            Action::Turn { axis, position_rad } => self.turn(axis, position_rad),
            Action::Stop | Action::Overrun | Action::Reset | Action::MeasureStack => {}
        }
    }

    /// The set-points of the last `exchange`, once: `None` if there was none since.
    pub fn take_sent(&mut self) -> Option<[Setpoint; N]> {
        self.sent.take()
    }

    fn turn(&mut self, axis: u8, position_rad: f32) {
        let Ok(feedback) = self.ideal.observe();
        let mut at = SVector::<f32, N>::zeros();
        for ((at, feedback), index) in at.iter_mut().zip(&feedback).zip(0u8..) {
            let turned = index == axis && feedback.status != DriveStatus::Enabled;
            *at = if turned {
                position_rad
            } else {
                feedback.position_rad
            };
        }
        if feedback
            .iter()
            .all(|axis| axis.status != DriveStatus::Enabled)
        {
            self.ideal = IdealDrives::at(&at);
        }
    }

    fn trouble_of(&mut self, axis: u8, make: impl FnOnce(&mut Trouble)) {
        if let Some(trouble) = self.trouble.get_mut(usize::from(axis)) {
            make(trouble);
        }
    }

    /// What arrives of what the drives report.
    fn reported(&mut self, mut feedback: [Feedback; N]) -> Result<[Feedback; N], NoAnswer> {
        if self.bus_cut {
            return Err(NoAnswer);
        }
        for ((feedback, last), trouble) in feedback.iter_mut().zip(&self.last).zip(&self.trouble) {
            if trouble.blocked {
                feedback.position_rad = last.position_rad;
                feedback.velocity_rad_per_s = 0.0;
            }
            if let Some(status) = trouble.status {
                feedback.status = status;
            }
            if trouble.silent {
                *feedback = Feedback {
                    age_ticks: last.age_ticks.saturating_add(1),
                    ..*last
                };
            }
        }
        self.last = feedback;
        Ok(feedback)
    }
}

impl<const N: usize> DriveGroup<N> for BenchDrives<N> {
    type Error = NoAnswer;

    fn exchange(&mut self, setpoints: &[Setpoint; N]) -> Result<[Feedback; N], NoAnswer> {
        self.sent = Some(*setpoints);
        let Ok(feedback) = if self.enabling_ticks < ENABLING_TICKS {
            self.enabling_ticks += 1;
            self.ideal.observe()
        } else {
            self.ideal.exchange(setpoints)
        };
        self.reported(feedback)
    }

    fn observe(&mut self) -> Result<[Feedback; N], NoAnswer> {
        let Ok(feedback): Result<_, Infallible> = self.ideal.observe();
        self.reported(feedback)
    }

    fn safe(&mut self) {
        self.enabling_ticks = 0;
        self.ideal.safe();
    }

    fn reset_faults(&mut self) {
        for trouble in &mut self.trouble {
            if let Some(DriveStatus::Fault { .. }) = trouble.status {
                trouble.status = None;
            }
        }
    }
}

/// What the emulated board tells the bench, as postcard one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Record {
    /// The board has started.
    Up,
    /// A tick with the drives on, or with another state than before.
    Tick(TickRecord),
    /// Stack used since the start.
    Stack {
        /// Most bytes in use at a time.
        used_bytes: u32,
        /// Bytes there are.
        available_bytes: u32,
    },
}

/// Most bytes of a [`Record`].
pub const MAX_RECORD_BYTES: usize = 64;

impl Record {
    /// The bytes that mean this, in `buffer`.
    pub fn encode<'b>(&self, buffer: &'b mut [u8; MAX_RECORD_BYTES]) -> &'b [u8] {
        // There is room: this cannot fail.
        encode::to_slice(self, buffer).unwrap_or_default()
    }
}

/// Axes of the emulated board.
pub const AXES: usize = 3;

/// One tick as the drives saw it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TickRecord {
    /// Ticks since the start.
    pub tick: u32,
    /// State after the tick.
    pub state: State,
    /// Time in the trajectory that the set-points belong to, in time ticks.
    pub path_ticks: u32,
    /// Position (rad), velocity (rad/s) and torque (N·m) sent to every axis; `None` with the drives
    /// off.
    pub sent: Option<[[f32; 3]; AXES]>,
    /// Counts of the core clock from the beginning of the tick to the set-points' leaving.
    pub to_setpoint_counts: u16,
    /// Counts of the core clock from the beginning to the end of the tick, without those of
    /// the simulated drives.
    pub whole_counts: u16,
}

/// Set-points as they stand in a [`TickRecord`].
pub fn rows(setpoints: [Setpoint; AXES]) -> [[f32; 3]; AXES] {
    setpoints.map(|setpoint| {
        [
            setpoint.position_rad,
            setpoint.velocity_rad_per_s,
            setpoint.torque_nm,
        ]
    })
}
