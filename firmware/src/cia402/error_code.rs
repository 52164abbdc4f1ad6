//! Why a drive is in a fault: from its emergency messages (EMCY), or asked for if these were lost.

use stillpoint_shared::drive_error;

use super::sdo::Object;

/// Error code of the last fault.
pub(super) const LAST_FAULT: Object = Object {
    index: 0x603f,
    sub: 0,
};

/// Error code of one drive.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ErrorCode {
    /// 0 for none.
    pub(super) code: u16,
    asked: bool,
}

impl ErrorCode {
    /// Takes an emergency message: bytes 0 and 1 are the code, 0 says that no error is left. Before
    /// the fault the newest code counts, in the fault the first: the others may be consequences.
    pub(super) fn emergency(&mut self, data: &[u8], in_fault: bool) {
        if let Some(&code) = data.first_chunk() {
            let code = u16::from_le_bytes(code);
            if code == 0 || !in_fault || self.code == 0 {
                self.code = code;
            }
        }
    }

    /// Whether a drive in a fault has to be asked; true once per fault.
    pub(super) fn must_ask(&mut self) -> bool {
        let must = self.code == 0 && !self.asked;
        self.asked |= must;
        must
    }

    /// Code of a drive in a fault: generic until it is known.
    pub(super) fn of_fault(&self) -> u16 {
        match self.code {
            0 => drive_error::GENERIC,
            code => code,
        }
    }
}
