//! Where an error is explained: an entry of the troubleshooting page, named after the variant.

use crate::device::{DeviceError, TransportError};
use std::fmt::Debug;
use stillpoint_shared::TrajectoryError;
use stillpoint_shared::assembly::AssemblyError;
use stillpoint_shared::drive_config::DriveConfigError;
use stillpoint_shared::drive_error::seen;
use stillpoint_shared::protocol::Denial;
use stillpoint_shared::status::{FaultCause, Refusal, Rejection};

const PAGE: &str = "docs/troubleshooting.md";

/// The entry about an error, if there is one.
pub(super) fn of(error: &DeviceError) -> Option<String> {
    let entry = match error {
        DeviceError::Transport(error) => return Some(of_transport(error)),
        DeviceError::Silent { .. } | DeviceError::Unanswered { .. } => {
            "nothing-answers-on-the-port".to_owned()
        }
        DeviceError::Versions { .. } | DeviceError::Unexpected { .. } => {
            "hello-reports-no-common-version".to_owned()
        }
        DeviceError::SessionLost { denial } | DeviceError::Denied(denial) => of_denial(denial),
        DeviceError::Interrupted | DeviceError::TooLong { .. } => return None,
    };
    Some(of_symptom(&entry))
}

fn of_transport(error: &TransportError) -> String {
    of_symptom(match error {
        TransportError::Absent { .. } | TransportError::NotSerial { .. } => "there-is-no-such-port",
        TransportError::Busy { .. } | TransportError::Forbidden { .. } => {
            "the-port-is-in-use-or-not-allowed"
        }
        TransportError::Refused { .. } => "nobody-answers-at-the-address",
        TransportError::Closed { .. } | TransportError::Failed { .. } => "the-connection-ends",
        TransportError::Emulator(_) => return "docs/board.md#in-the-emulator".to_owned(),
    })
}

/// An entry about what people see, rather than what a board says.
pub(super) fn of_symptom(anchor: &str) -> String {
    format!("{PAGE}#{anchor}")
}

/// The entry about a fault.
pub(super) fn of_fault(cause: &FaultCause) -> String {
    let entry = match cause {
        FaultCause::DriveFault { code, .. } => of_code(*code),
        _ => None,
    };
    of_symptom(&entry.unwrap_or_else(|| named("FaultCause", cause)))
}

/// The entry about bytes that are no trajectory.
pub(super) fn of_trajectory(error: &TrajectoryError) -> String {
    of_symptom(&named("TrajectoryError", error))
}

/// The entry about drives that cannot be.
pub(super) fn of_drives(error: &DriveConfigError) -> String {
    of_symptom(&drives(error))
}

/// The entry about what the board itself sees of a drive; those of the drive's own codes are in its manual.
fn of_code(code: u16) -> Option<String> {
    let trouble = match code {
        seen::NOT_A_DRIVE => "NotADrive",
        seen::RATED_TORQUE => "RatedTorque",
        seen::REFUSED => "Refused",
        seen::MODE => "Mode",
        seen::NO_FEEDBACK => "NoFeedback",
        seen::FEEDBACK_LENGTH => "FeedbackLength",
        seen::HEARTBEAT_LOST => "HeartbeatLost",
        seen::NOT_OPERATIONAL => "NotOperational",
        seen::RESTARTED => "Restarted",
        seen::NO_ANSWER => "NoAnswer",
        _ => return None,
    };
    Some(format!("Trouble.{trouble}"))
}

fn of_denial(denial: &Denial) -> String {
    match denial {
        Denial::Executor(refusal) => of_refusal(refusal),
        Denial::Limits(error) => named("LimitsError", error),
        Denial::Drives(error) => drives(error),
        Denial::Store(error) => named("StoreError", error),
        denial => named("Denial", denial),
    }
}

fn of_refusal(refusal: &Refusal) -> String {
    match refusal {
        Refusal::Rejected(Rejection::Exceeds { limit, .. }) => named("Limit", limit),
        Refusal::Rejected(rejection) => named("Rejection", rejection),
        Refusal::Feedback(cause) => named("FaultCause", cause),
        Refusal::Upload(AssemblyError::Trajectory(error)) | Refusal::Trajectory(error) => {
            named("TrajectoryError", error)
        }
        Refusal::Upload(error) => named("AssemblyError", error),
        Refusal::Configuration(error) => named("ConfigError", error),
        refusal => named("Refusal", refusal),
    }
}

fn drives(error: &DriveConfigError) -> String {
    match error {
        DriveConfigError::Axis { problem, .. } => named("Problem", problem),
        error => named("DriveConfigError", error),
    }
}

/// `Type.Variant`: the derived `Debug` begins with the variant's name.
fn named(kind: &str, value: &impl Debug) -> String {
    let debug = format!("{value:?}");
    let end = debug.find(|c: char| !c.is_ascii_alphanumeric());
    let variant = debug.get(..end.unwrap_or(debug.len())).unwrap_or_default();
    format!("{kind}.{variant}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use stillpoint_shared::status::{Limit, Place};

    /// The heading that a link to the page leads to.
    fn heading(link: &str) -> String {
        let page = include_str!("../../../../docs/troubleshooting.md");
        let anchor = link.split_once('#').expect("an anchor").1;
        let named = page.split_once(&format!("<a id=\"{anchor}\"></a>\n"));
        let slug = |title: &&str| {
            let title = title.trim_start_matches('#').trim_start().to_lowercase();
            title.replace(',', "").replace(' ', "-") == anchor
        };
        let heading = match named {
            Some((_, entry)) => entry.lines().next(),
            None => page
                .lines()
                .filter(|line| line.starts_with("##"))
                .find(slug),
        };
        heading
            .unwrap_or_else(|| panic!("no place for {link}"))
            .to_owned()
    }

    #[test]
    fn what_the_board_sees_of_a_drive_has_an_entry_for_each_code() {
        for code in seen::NOT_A_DRIVE..=seen::NO_ANSWER {
            let heading = heading(&of_fault(&FaultCause::DriveFault { axis: 0, code }));
            assert!(heading.contains(&format!("({code:04X}h)")), "{heading}");
        }
        let own = FaultCause::DriveFault {
            axis: 0,
            code: 0x7305,
        };
        assert_eq!(
            of_fault(&own),
            "docs/troubleshooting.md#FaultCause.DriveFault"
        );
    }

    #[test]
    fn a_limit_that_is_exceeded_leads_to_that_limit() {
        let exceeds = Rejection::Exceeds {
            at: Place {
                axis: 0,
                interval: 0,
                ticks: 0,
            },
            limit: Limit::TorqueRate,
            value: 2.0,
            allowed: 1.0,
        };
        let denial = Denial::Executor(Refusal::Rejected(exceeds));
        let link = of(&DeviceError::Denied(denial)).expect("an entry");
        assert_eq!(
            heading(&link),
            "### Rejection: torque rate beyond its limit"
        );
    }

    #[test]
    fn every_way_a_line_fails_is_explained() {
        let (port, reason) = (String::new, String::new);
        for error in [
            TransportError::Absent { port: port() },
            TransportError::Busy {
                port: port(),
                reason: reason(),
            },
            TransportError::Forbidden {
                port: port(),
                reason: reason(),
            },
            TransportError::NotSerial {
                port: port(),
                baud: 1,
                reason: reason(),
            },
            TransportError::Refused {
                address: port(),
                reason: reason(),
            },
            TransportError::Closed { port: port() },
            TransportError::Failed {
                port: port(),
                error: std::io::Error::other(""),
            },
        ] {
            heading(&of(&DeviceError::Transport(error)).expect("an entry"));
        }
    }
}
