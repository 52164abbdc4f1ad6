//! `stillpoint device ports`

use super::line::{self, Explained};
use crate::cli::{Failure, output};
use crate::device::{DeviceError, Serial};
use serde_json::json;

pub(super) fn run(line: &line::Arguments) -> Result<(), Failure> {
    let serial = Serial::list().map_err(DeviceError::from);
    let serial = serial.map_err(Explained::from)?;
    if line.json {
        return output::object(&json!({"status": "done", "serial": serial}));
    }
    let mut text = String::new();
    for name in &serial {
        text += &format!("{name}\n");
    }
    if serial.is_empty() {
        text += "no serial port\n";
    }
    text += "also: tcp:host:port, qemu: (an emulated board), sim: (a simulated board)\n";
    output::text(&text)
}
