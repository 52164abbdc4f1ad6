//! What a drive is told before it is used, step by step. Tables of the objects are in the parent
//! module.

use stillpoint_shared::drive_config::{Mapping, interpolation_time};
use stillpoint_shared::{AxisDrive, BusConfig};

use super::CYCLIC_SYNCHRONOUS_POSITION;
use super::frame::{RPDO1, TPDO1};
use super::nmt::NmtCommand;
use super::sdo::{Answer, Object, Value};
use super::state::Command;
use super::trouble::Trouble;

/// One step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    Nmt(NmtCommand),
    Read(Object),
    Write(Object, Value),
    /// Not needed with this configuration.
    Skip,
}

/// The device profile, in the lower 16 bits of the device type.
const PROFILE: u32 = 402;

const DEVICE_TYPE: Object = object(0x1000, 0);
const RATED_TORQUE: Object = object(0x6076, 0);

/// Bit 31 of a COB-ID: the PDO is switched off. Bit 30: it cannot be asked for.
const OFF: u32 = 1 << 31;
const NO_REQUEST: u32 = 1 << 30;

/// Transmission type: at every SYNC.
const EVERY_SYNC: u8 = 1;

const fn object(index: u16, sub: u8) -> Object {
    Object { index, sub }
}

/// Step number `number`, from 0; `None` after the last one.
pub(super) fn step(number: u8, drive: &AxisDrive, bus: &BusConfig) -> Option<Step> {
    let write_u8 = |index, sub, value| Step::Write(object(index, sub), Value::U8(value));
    let write_u16 = |index, sub, value| Step::Write(object(index, sub), Value::U16(value));
    let write_u32 = |index, sub, value| Step::Write(object(index, sub), Value::U32(value));
    let (period, exponent) = interpolation_time(bus.period_us).unwrap_or_default();
    let guard = u32::from(bus.controller_node) << 16 | u32::from(bus.heartbeat_timeout_ms);
    let node = u16::from(drive.node);
    let (setpoint_id, feedback_id) = (u32::from(RPDO1 + node), u32::from(TPDO1 + node));
    Some(match number {
        // Twice: it is not answered, and may be lost.
        0 | 2 => Step::Nmt(NmtCommand::EnterPreOperational),
        1 => Step::Read(DEVICE_TYPE),
        3 => write_u16(0x6040, 0, Command::DisableVoltage.controlword()),
        4 => Step::Read(RATED_TORQUE),
        5 => write_u16(0x1017, 0, bus.heartbeat_ms),
        6 if bus.controller_node == 0 => Step::Skip,
        6 => write_u32(0x1016, 1, guard),
        7 => write_u8(0x60c2, 1, period),
        8 => write_u8(0x60c2, 2, exponent as u8),
        9 => write_u8(0x6060, 0, CYCLIC_SYNCHRONOUS_POSITION as u8),
        10..=28 if drive.mapping == Mapping::Preset => Step::Skip,
        // Set-points. A mapping can be changed only while its PDO is off and it has no entries.
        10 => write_u32(0x1400, 1, OFF | setpoint_id),
        11 => write_u8(0x1400, 2, EVERY_SYNC),
        12 => write_u8(0x1600, 0, 0),
        13 => write_u32(0x1600, 1, 0x6040_0010),
        14 => write_u32(0x1600, 2, 0x607a_0020),
        15 => write_u32(0x1600, 3, 0x60b2_0010),
        16 => write_u8(0x1600, 0, 3),
        17 => write_u32(0x1400, 1, setpoint_id),
        // Feedback.
        18 => write_u32(0x1800, 1, OFF | NO_REQUEST | feedback_id),
        19 => write_u8(0x1800, 2, EVERY_SYNC),
        20 => write_u8(0x1a00, 0, 0),
        21 => write_u32(0x1a00, 1, 0x6041_0010),
        22 => write_u32(0x1a00, 2, 0x6064_0020),
        23 => write_u32(0x1a00, 3, 0x6061_0008),
        24 => write_u8(0x1a00, 0, 3),
        25 => write_u32(0x1800, 1, NO_REQUEST | feedback_id),
        // What else the drive may send by itself would load the bus.
        26 => write_u32(0x1801, 1, OFF | NO_REQUEST | (feedback_id + 0x100)),
        27 => write_u32(0x1802, 1, OFF | NO_REQUEST | (feedback_id + 0x200)),
        28 => write_u32(0x1803, 1, OFF | NO_REQUEST | (feedback_id + 0x300)),
        29 => Step::Nmt(NmtCommand::Start),
        _ => return None,
    })
}

/// Whether an answer to a step's request lets the next step follow.
pub(super) fn judge(step: Step, answer: Answer, drive: &AxisDrive) -> Result<(), Trouble> {
    match (step, answer) {
        (Step::Read(DEVICE_TYPE), Answer::Read(device_type)) => {
            if device_type & 0xffff == PROFILE {
                Ok(())
            } else {
                Err(Trouble::NotADrive { device_type })
            }
        }
        (Step::Read(RATED_TORQUE), Answer::Read(millinewtonmetres)) => {
            let drive_nm = millinewtonmetres as f32 * 1e-3;
            let configured_nm = drive.rated_torque_nm;
            // 1 %, and the rounding of the object.
            if (drive_nm - configured_nm).abs() <= 0.01 * configured_nm + 0.5e-3 {
                Ok(())
            } else {
                Err(Trouble::RatedTorque {
                    configured_nm,
                    drive_nm,
                })
            }
        }
        (Step::Read(object) | Step::Write(object, _), Answer::Refused(code)) => {
            if code.is_absent() && may_be_absent(object) {
                Ok(())
            } else {
                Err(Trouble::Refused { object, code })
            }
        }
        _ => Ok(()),
    }
}

/// Objects a drive can do without: the rated torque then is not compared, and PDOs that are not
/// there send nothing.
fn may_be_absent(object: Object) -> bool {
    object == RATED_TORQUE || matches!(object.index, 0x1801..=0x1803)
}
