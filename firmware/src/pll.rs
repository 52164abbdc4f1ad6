//! The factors that make the core clock of the crystal: RM0090, section 7.3.2.

use crate::loop_time::CORE_HZ;

/// What the PLL halves for the core.
const VCO_MHZ: u32 = 2 * CORE_HZ / 1_000_000;

/// Factors of the PLL, as its register takes them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pll {
    /// Divider of the crystal, PLLM.
    pub divider: u8,
    /// Multiplier, PLLN.
    pub multiplier: u16,
    /// Divider for the core, PLLP.
    pub core_divider: u8,
    /// Divider for 48 MHz, PLLQ.
    pub usb_divider: u8,
}

impl Pll {
    /// Factors for a crystal of 4 to 26 MHz; `None` for any other, which an STM32F405 does not take.
    /// The input of the PLL is 2 MHz where possible, which jitters least, or 1 MHz.
    pub const fn of(crystal_mhz: u32) -> Option<Self> {
        if crystal_mhz < 4 || crystal_mhz > 26 {
            return None;
        }
        let input_mhz = if crystal_mhz.is_multiple_of(2) { 2 } else { 1 };
        Some(Self {
            divider: (crystal_mhz / input_mhz) as u8,
            multiplier: (VCO_MHZ / input_mhz) as u16,
            core_divider: 2,
            usb_divider: (VCO_MHZ / 48) as u8,
        })
    }
}
