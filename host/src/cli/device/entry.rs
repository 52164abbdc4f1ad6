//! Where an error of a board is explained: an entry of the troubleshooting page, named after the variant.

use crate::device::DeviceError;
use std::fmt::Debug;
use stillpoint_shared::assembly::AssemblyError;
use stillpoint_shared::protocol::Denial;
use stillpoint_shared::status::{FaultCause, Refusal};

const PAGE: &str = "docs/troubleshooting.md";

/// The entry about an error, if there is one.
pub(super) fn of(error: &DeviceError) -> Option<String> {
    let entry = match error {
        DeviceError::Silent { .. } => "nothing-answers-on-the-port".to_owned(),
        DeviceError::Versions { .. } => "hello-reports-no-common-version".to_owned(),
        DeviceError::SessionLost { denial } | DeviceError::Denied(denial) => of_denial(denial),
        _ => return None,
    };
    Some(format!("{PAGE}#{entry}"))
}

/// An entry about what people see, rather than what a board says.
pub(super) fn of_symptom(anchor: &str) -> String {
    format!("{PAGE}#{anchor}")
}

/// The entry about a fault.
pub(super) fn of_fault(cause: &FaultCause) -> String {
    format!("{PAGE}#{}", entry("FaultCause", cause))
}

fn of_denial(denial: &Denial) -> String {
    match denial {
        Denial::Executor(refusal) => of_refusal(refusal),
        Denial::Limits(error) => entry("LimitsError", error),
        Denial::Drives(error) => entry("DriveConfigError", error),
        Denial::Store(error) => entry("StoreError", error),
        denial => entry("Denial", denial),
    }
}

fn of_refusal(refusal: &Refusal) -> String {
    match refusal {
        Refusal::Rejected(rejection) => entry("Rejection", rejection),
        Refusal::Feedback(cause) => entry("FaultCause", cause),
        Refusal::Upload(AssemblyError::Trajectory(error)) | Refusal::Trajectory(error) => {
            entry("TrajectoryError", error)
        }
        Refusal::Upload(error) => entry("AssemblyError", error),
        Refusal::Configuration(error) => entry("ConfigError", error),
        refusal => entry("Refusal", refusal),
    }
}

/// `Type.Variant`: the derived `Debug` begins with the variant's name.
fn entry(kind: &str, value: &impl Debug) -> String {
    let debug = format!("{value:?}");
    let end = debug.find(|c: char| !c.is_ascii_alphanumeric());
    let variant = debug.get(..end.unwrap_or(debug.len())).unwrap_or_default();
    format!("{kind}.{variant}")
}
