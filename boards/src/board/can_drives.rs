//! The drives on the two CAN buses, if they are configured.

use stillpoint_firmware::drive::NoAnswer;
use stillpoint_firmware::{Cia402Group, DriveGroup, Feedback, Setpoint};
use stillpoint_shared::DriveConfig;
use stillpoint_shared::time::DRIVE_PERIOD_TICKS;
use stm32f4::stm32f405::{CAN1, CAN2};

use super::can::Bus;
use super::serve::AXES;

/// Both buses.
pub type Buses = (Bus<CAN1>, Bus<CAN2>);

/// Drives, or none.
#[derive(Debug)]
pub struct CanDrives(Option<Cia402Group<AXES, Buses>>);

impl CanDrives {
    /// The drives of a configuration.
    pub fn new(config: Option<&DriveConfig>, buses: Option<Buses>) -> Self {
        let (Some(config), Some(buses)) = (config, buses) else {
            defmt::info!("no drives, or no such bit rate");
            return Self(None);
        };
        match Cia402Group::new(config, buses, DRIVE_PERIOD_TICKS) {
            Ok(group) => Self(Some(group)),
            Err(error) => {
                defmt::warn!("no drives: {}", error);
                Self(None)
            }
        }
    }

    /// Resets the faults of drives that are off.
    pub fn request_fault_reset(&mut self) {
        if let Self(Some(group)) = self {
            group.request_fault_reset();
        }
    }
}

impl DriveGroup<AXES> for CanDrives {
    type Error = NoAnswer;

    #[inline]
    fn exchange(&mut self, setpoints: &[Setpoint; AXES]) -> Result<[Feedback; AXES], NoAnswer> {
        let group = self.0.as_mut().ok_or(NoAnswer)?;
        group.exchange(setpoints).map_err(|_| NoAnswer)
    }

    #[inline]
    fn observe(&mut self) -> Result<[Feedback; AXES], NoAnswer> {
        let group = self.0.as_mut().ok_or(NoAnswer)?;
        group.observe().map_err(|_| NoAnswer)
    }

    #[inline]
    fn safe(&mut self) {
        if let Self(Some(group)) = self {
            group.safe();
        }
    }
}
