//! The protocol's port: USART3, 8 data bits, no parity, one stop bit.
//!
//! Bytes received are taken by interrupt, above the drive loop in priority: the port has room for
//! one byte only, and taking it costs a few instructions. Bytes are sent whenever there is room.

use stm32f4::stm32f405::USART3;

/// Receiving half, for the interrupt.
#[derive(Debug)]
pub struct Receiver(());

/// Sending half, for the idle loop.
#[derive(Debug)]
pub struct Transmitter(());

/// Switches the port on, its clock being on already and running at `clock_hz`.
pub fn start(port: USART3, clock_hz: u32, baud: u32) -> (Transmitter, Receiver) {
    let divider = (clock_hz + baud / 2).checked_div(baud).unwrap_or(1);
    port.brr().write(|w| {
        w.div_mantissa().set((divider >> 4) as u16);
        w.div_fraction().set((divider & 0xf) as u8)
    });
    port.cr1().write(|w| {
        w.ue().set_bit();
        w.te().set_bit();
        w.re().set_bit();
        w.rxneie().set_bit()
    });
    (Transmitter(()), Receiver(()))
}

impl Receiver {
    /// The byte received, and whether one before it was lost. Reading also clears the interrupt.
    pub fn take(&mut self) -> (Option<u8>, bool) {
        // SAFETY: this half only reads SR and DR, and there is one such half.
        let port = unsafe { &*USART3::ptr() };
        let status = port.sr().read();
        let byte = port.dr().read().dr().bits() as u8;
        (status.rxne().bit().then_some(byte), status.ore().bit())
    }
}

impl Transmitter {
    /// Whether [`Transmitter::send`] has room.
    pub fn ready(&self) -> bool {
        // SAFETY: reading SR has an effect only in sequence with reading DR, which is the receiving
        // half's and clears errors; a lost-byte mark that is cleared that way costs a count.
        unsafe { &*USART3::ptr() }.sr().read().txe().bit()
    }

    /// Whether all has left.
    #[cfg(feature = "f405")]
    pub fn is_done(&self) -> bool {
        // SAFETY: as in `ready`.
        unsafe { &*USART3::ptr() }.sr().read().tc().bit()
    }

    /// Sends a byte, if there is room.
    pub fn send(&mut self, byte: u8) {
        // SAFETY: writing DR does not touch what is received, and there is one such half.
        unsafe { &*USART3::ptr() }
            .dr()
            .write(|w| w.dr().set(byte.into()));
    }
}
