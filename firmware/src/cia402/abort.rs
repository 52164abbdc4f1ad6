//! Why an SDO request is refused. Source: CiA 301, table of SDO abort codes.

use core::fmt;

/// The code of a refused request. Its `Display` gives the code and what it means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AbortCode(pub u32);

impl AbortCode {
    /// The object is not there.
    pub const NO_OBJECT: Self = Self(0x0602_0000);
    /// The object is there, the sub-index is not.
    pub const NO_SUB_INDEX: Self = Self(0x0609_0011);
    /// The value has another length.
    pub const LENGTH: Self = Self(0x0607_0010);

    /// Whether there is nothing to be read or written.
    pub fn is_absent(self) -> bool {
        matches!(self, Self::NO_OBJECT | Self::NO_SUB_INDEX)
    }

    /// What the code means.
    pub fn words(self) -> &'static str {
        match self.0 {
            0x0503_0000 => "the toggle bit did not alternate",
            0x0504_0000 => "the transfer timed out in the drive",
            0x0504_0001 => "the drive does not know the command",
            0x0504_0005 => "the drive is out of memory",
            0x0601_0000 => "the drive does not support this access",
            0x0601_0001 => "the object can only be written",
            0x0601_0002 => "the object can only be read",
            0x0602_0000 => "the drive has no such object",
            0x0604_0041 => "the object cannot be mapped to process data",
            0x0604_0042 => "the mapped objects are longer than 8 bytes",
            0x0604_0043 => "the parameter does not go with others",
            0x0604_0047 => "the drive's parameters contradict each other",
            0x0606_0000 => "a hardware error",
            0x0607_0010 => "the value has another length",
            0x0607_0012 => "the value is too long",
            0x0607_0013 => "the value is too short",
            0x0609_0011 => "the object has no such sub-index",
            0x0609_0030 => "the value is out of range",
            0x0609_0031 => "the value is too high",
            0x0609_0032 => "the value is too low",
            0x0609_0036 => "the maximum is below the minimum",
            0x060a_0023 => "a resource is missing",
            0x0800_0000 => "no reason is given",
            0x0800_0020 => "the value cannot be stored",
            0x0800_0021 => "the drive is under local control",
            0x0800_0022 => "the drive's state does not allow it",
            0x0800_0023 => "there is no object dictionary",
            0x0800_0024 => "there is no value",
            _ => "a reason of the drive's own",
        }
    }
}

impl fmt::Display for AbortCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({:08X}h)", self.words(), self.0)
    }
}
