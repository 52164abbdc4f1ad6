//! The drives of the stored configuration, or none: what a board with CAN buses commands.

use core::fmt;

use stillpoint_shared::DriveConfig;
use stillpoint_shared::drive_config::Cycle;

use super::bus::Buses;
use super::group::{Cia402Group, GroupError};
use crate::drive::NoAnswer;
use crate::{DriveGroup, Feedback, Setpoint};

/// The drives of a configuration, once for every start of the board; or none, and why.
#[derive(Debug)]
pub struct ConfiguredDrives<const N: usize, B> {
    group: Result<Cia402Group<N, B>, NoDrives>,
}

/// Why there are no drives.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum NoDrives {
    /// No configuration is stored.
    NotConfigured,
    /// The board has no such bit rate.
    BitRate {
        /// The configured one.
        kbit_per_s: u16,
    },
    /// The configuration does not go with the board.
    Group(GroupError),
}

impl fmt::Display for NoDrives {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotConfigured => write!(f, "no drives are configured: send their configuration"),
            Self::BitRate { kbit_per_s } => write!(
                f,
                "bit_rate_kbit_per_s is {kbit_per_s}, which the board's clock does not divide into: give another"
            ),
            Self::Group(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for NoDrives {}

impl<const N: usize, B: Buses> ConfiguredDrives<N, B> {
    /// The drives of `config` at a tick of `tick_ticks` time ticks; `start` switches the buses on
    /// at a bit rate in kbit/s, if they have it.
    pub fn new(
        config: Option<&DriveConfig>,
        tick_ticks: u32,
        start: impl FnOnce(u16) -> Option<B>,
    ) -> Self {
        let make = |config: &DriveConfig| {
            let kbit_per_s = config.bus().bit_rate_kbit_per_s;
            let buses = start(kbit_per_s).ok_or(NoDrives::BitRate { kbit_per_s })?;
            Cia402Group::new(config, buses, tick_ticks).map_err(NoDrives::Group)
        };
        let group = config.ok_or(NoDrives::NotConfigured).and_then(make);
        Self { group }
    }

    /// The drives, or why there are none.
    pub fn group(&self) -> Result<&Cia402Group<N, B>, NoDrives> {
        self.group.as_ref().map_err(|reason| *reason)
    }

    /// The bus cycle, for [`Executor::allow_for_bus`](crate::Executor::allow_for_bus).
    pub fn cycle(&self) -> Option<Cycle> {
        self.group().ok().map(Cia402Group::cycle)
    }

    fn reach(&mut self) -> Result<&mut Cia402Group<N, B>, NoAnswer> {
        self.group.as_mut().map_err(|_| NoAnswer)
    }
}

impl<const N: usize, B: Buses> DriveGroup<N> for ConfiguredDrives<N, B> {
    type Error = NoAnswer;

    #[inline]
    fn exchange(&mut self, setpoints: &[Setpoint; N]) -> Result<[Feedback; N], NoAnswer> {
        self.reach()?.exchange(setpoints).map_err(|_| NoAnswer)
    }

    #[inline]
    fn observe(&mut self) -> Result<[Feedback; N], NoAnswer> {
        self.reach()?.observe().map_err(|_| NoAnswer)
    }

    #[inline]
    fn safe(&mut self) {
        if let Ok(group) = self.reach() {
            group.safe();
        }
    }

    fn reset_faults(&mut self) {
        if let Ok(group) = self.reach() {
            group.reset_faults();
        }
    }
}
