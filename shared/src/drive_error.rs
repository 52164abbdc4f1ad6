//! Error codes of drives in words.
//!
//! The code of an emergency message (and of object 603Fh): classes by CiA 301, those of drives by
//! CiA 402 (IEC 61800-7-201). Drives agree on the classes; the last digits are often their own, so
//! the nearest class that is known is told.

/// What the board itself sees, in a range that the profiles reserve.
pub mod seen {
    /// The node is no CiA 402 drive.
    pub const NOT_A_DRIVE: u16 = 0xb001;
    /// The rated torque is another than configured.
    pub const RATED_TORQUE: u16 = 0xb002;
    /// The drive refuses its set-up.
    pub const REFUSED: u16 = 0xb003;
    /// The drive does not take up its mode.
    pub const MODE: u16 = 0xb004;
    /// The drive sends no feedback.
    pub const NO_FEEDBACK: u16 = 0xb005;
    /// The feedback is not as long as its mapping.
    pub const FEEDBACK_LENGTH: u16 = 0xb006;
    /// The drive stopped sending heartbeats.
    pub const HEARTBEAT_LOST: u16 = 0xb007;
    /// The drive left the operational state.
    pub const NOT_OPERATIONAL: u16 = 0xb008;
    /// The drive started anew.
    pub const RESTARTED: u16 = 0xb009;
    /// Nothing answers.
    pub const NO_ANSWER: u16 = 0xb00a;
}

/// An error that is not further specified.
pub const GENERIC: u16 = 0x1000;

/// What an error code means: as precisely as the profiles say.
pub fn words(code: u16) -> &'static str {
    let exact = EXACT.iter().find(|(known, _)| *known == code);
    let class = CLASSES
        .iter()
        .find(|(class, _)| u16::from(*class) == code >> 8);
    let group = GROUPS
        .iter()
        .find(|(group, _)| u16::from(*group) == code >> 12);
    match (exact, class, group) {
        (Some((_, words)), _, _) | (_, Some((_, words)), _) | (_, _, Some((_, words))) => words,
        _ => "an error of its own",
    }
}

/// What to do about it, beside what its words say.
pub fn cure(code: u16) -> &'static str {
    match code {
        seen::NO_ANSWER => "it is set up as soon as it answers",
        seen::NOT_A_DRIVE..=seen::RESTARTED => "then clear",
        0xff00.. => "see its manual, remove the cause, then clear",
        _ => "remove the cause, then clear",
    }
}

const EXACT: [(u16, &str); 35] = [
    (0x2310, "continuous over-current"),
    (0x2320, "short circuit or earth leakage at the motor"),
    (0x2330, "earth leakage at the motor"),
    (0x2340, "short circuit at the motor"),
    (0x2350, "overload of the motor (I²t)"),
    (0x3110, "mains over-voltage"),
    (0x3120, "mains under-voltage"),
    (0x3130, "a mains phase is missing"),
    (0x3210, "DC link over-voltage"),
    (0x3220, "DC link under-voltage"),
    (0x4210, "the device is too hot"),
    (0x4310, "the drive is too hot"),
    (0x5430, "the power stage's input is faulty"),
    (0x6320, "a parameter is wrong or refused"),
    (0x7121, "the motor is blocked"),
    (0x7305, "the first incremental encoder is faulty"),
    (0x7306, "the second incremental encoder is faulty"),
    (0x8110, "CAN messages were lost (overrun)"),
    (0x8120, "CAN error passive"),
    (0x8130, "no heartbeat"),
    (0x8140, "recovered from CAN bus-off"),
    (0x8210, "a process data message has the wrong length"),
    (0x8250, "set-points did not come in time"),
    (0x8611, "following error"),
    (0x8612, "a position limit was reached"),
    (
        seen::NOT_A_DRIVE,
        "the node is no CiA 402 drive: check the node ids",
    ),
    (
        seen::RATED_TORQUE,
        "its rated torque (6076h) is another than configured: correct one of them",
    ),
    (
        seen::REFUSED,
        "it refuses its set-up: see its manual, or map its process data in the drive and set the mapping to preset",
    ),
    (
        seen::MODE,
        "it does not take up cyclic synchronous position mode: use a drive that has it",
    ),
    (
        seen::NO_FEEDBACK,
        "it sends no feedback at SYNC: check its first transmit PDO (1800h, 1A00h)",
    ),
    (
        seen::FEEDBACK_LENGTH,
        "its feedback does not have 7 bytes: map 6041h, 6064h and 6061h to its first transmit PDO",
    ),
    (
        seen::HEARTBEAT_LOST,
        "its heartbeat is missing: check cabling and supply",
    ),
    (
        seen::NOT_OPERATIONAL,
        "it left the operational state: see its error memory",
    ),
    (seen::RESTARTED, "it started anew: check its supply"),
    (
        seen::NO_ANSWER,
        "it does not answer: check the node id, the cabling and the supply",
    ),
];

const CLASSES: [(u8, &str); 29] = [
    (0x00, "no error"),
    (0x10, "an error that is not specified"),
    (0x21, "current on the input side"),
    (0x22, "current inside the device"),
    (0x23, "current on the output side"),
    (0x31, "mains voltage"),
    (0x32, "DC link voltage"),
    (0x33, "output voltage"),
    (0x41, "ambient temperature"),
    (0x42, "device temperature"),
    (0x43, "drive temperature"),
    (0x44, "supply temperature"),
    (0x51, "supply of the electronics"),
    (0x52, "measurement and control electronics"),
    (0x53, "operating unit"),
    (0x54, "power section"),
    (0x55, "data storage"),
    (0x61, "internal software"),
    (0x62, "user software"),
    (0x63, "parameters"),
    (0x71, "power, such as the brake chopper or the motor"),
    (0x72, "measurement circuit"),
    (0x73, "sensor"),
    (0x74, "computation circuit"),
    (0x81, "communication"),
    (0x82, "protocol"),
    (0x83, "torque control"),
    (0x84, "speed control"),
    (0x85, "position control"),
];

const GROUPS: [(u8, &str); 10] = [
    (0x1, "an error that is not specified"),
    (0x2, "current"),
    (0x3, "voltage"),
    (0x4, "temperature"),
    (0x5, "hardware"),
    (0x6, "software"),
    (0x7, "an additional module"),
    (0x8, "monitoring"),
    (0x9, "an external error"),
    (0xf, "an error of the manufacturer's own"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_known_class_is_told() {
        for (code, expected) in [
            (0x7305, "the first incremental encoder is faulty"),
            (0x7380, "sensor"),
            (0x8611, "following error"),
            (0x8700, "monitoring"),
            (0xff01, "an error of the manufacturer's own"),
            (0x0000, "no error"),
            (0xa000, "an error of its own"),
        ] {
            assert_eq!(words(code), expected, "{code:#06x}");
        }
        for (code, part) in [
            (seen::NOT_A_DRIVE, "no CiA 402 drive"),
            (seen::RATED_TORQUE, "6076h"),
            (seen::REFUSED, "refuses its set-up"),
            (seen::MODE, "cyclic synchronous position"),
            (seen::NO_FEEDBACK, "no feedback"),
            (seen::FEEDBACK_LENGTH, "7 bytes"),
            (seen::HEARTBEAT_LOST, "heartbeat is missing"),
            (seen::NOT_OPERATIONAL, "left the operational state"),
            (seen::RESTARTED, "started anew"),
            (seen::NO_ANSWER, "does not answer"),
        ] {
            assert!(words(code).contains(part), "{code:#06x}");
        }
        assert!(EXACT.is_sorted_by(|a, b| a.0 < b.0));
        assert!(CLASSES.is_sorted_by(|a, b| a.0 < b.0));
    }
}
