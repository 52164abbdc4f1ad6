//! The filters of the CAN controllers (bxCAN, RM0090 section 32.7.4): data frames with 11-bit
//! identifiers pass, those of even ones into FIFO 0 and those of odd ones into FIFO 1.
//!
//! Both controllers share 28 filters; each uses the first two of its own.

/// Where the identifier stands in the registers, and the marks of other kinds of frames.
pub const ID_SHIFT: u32 = 21;
const EXTENDED: u32 = 1 << 2;
const REMOTE: u32 = 1 << 1;

/// First filter of the second controller.
pub const CAN2_FIRST: u8 = 14;

/// A bit for every filter in use.
pub const USED: u32 = 0b11 | 0b11 << CAN2_FIRST;

/// A bit for every filter whose frames go into FIFO 1.
pub const TO_FIFO_1: u32 = 0b10 | 0b10 << CAN2_FIRST;

const LOWEST_ID_BIT: u32 = 1 << ID_SHIFT;

/// The bits that a filter compares.
pub const MASK: u32 = LOWEST_ID_BIT | EXTENDED | REMOTE;

/// What they have to be.
pub const fn wanted(filter: u32) -> u32 {
    if TO_FIFO_1 >> filter & 1 == 1 {
        LOWEST_ID_BIT
    } else {
        0
    }
}
