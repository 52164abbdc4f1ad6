//! What the registers of the CAN controllers (bxCAN, RM0090 chapter 32) are set to: the length of a
//! bit, and which frames go into which FIFO.

/// A bit is 1 + 11 + 2 quanta, sampled after the first 12: at 86 %.
pub const QUANTA_BEFORE_SAMPLE: u32 = 11;
/// Quanta of a bit after its sample.
pub const QUANTA_AFTER_SAMPLE: u32 = 2;
/// Quanta of a bit.
pub const QUANTA_PER_BIT: u32 = 1 + QUANTA_BEFORE_SAMPLE + QUANTA_AFTER_SAMPLE;

/// Largest divider that the register holds.
const MOST: u32 = 1024;

/// By what the controllers' clock is divided for a quantum, at this rate; `None` where it cannot be
/// met exactly.
pub fn divider(clock_hz: u32, rate_kbit_per_s: u16) -> Option<u32> {
    let quanta_khz = u32::from(rate_kbit_per_s) * QUANTA_PER_BIT;
    let divider = (clock_hz / 1_000).checked_div(quanta_khz)?;
    let exact = divider.checked_mul(quanta_khz)?.checked_mul(1_000)? == clock_hz;
    (exact && divider <= MOST).then_some(divider)
}
