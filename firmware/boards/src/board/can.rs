//! The two CAN controllers (bxCAN, RM0090 chapter 32), as `embedded-can` wants them.
//!
//! The most urgent frame leaves first; one that has the identifier of a waiting one is refused until
//! that is gone, so that they cannot overtake each other. Only data frames with 11-bit identifiers
//! are sent and received, those of even identifiers into one FIFO of three and those of odd ones
//! into the other. Nothing waits.
//!
//! The `bxcan` crate is not used, since a frame from the wire with a length code above 8, which is
//! legal and means 8, makes it panic.

use core::ops::Deref;

use embedded_can::nb::Can;
use embedded_can::{ErrorKind, Id, StandardId};
use stillpoint_firmware::can_filters::{self, ID_SHIFT};
use stillpoint_firmware::can_timing::{self, QUANTA_AFTER_SAMPLE, QUANTA_BEFORE_SAMPLE};
use stillpoint_firmware::cia402::Controller;
use stm32f4::stm32f405::can1::RegisterBlock;
use stm32f4::stm32f405::{CAN1, CAN2, RCC};

use super::clock::APB1_HZ;

/// A data frame with an 11-bit identifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    id: StandardId,
    length: u8,
    data: [u8; 8],
}

/// Received frames were lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Overrun;

/// A CAN controller that takes part in the bus.
#[derive(Debug)]
pub struct Bus<C>(C);

/// Switches both controllers on, at 1000, 750, 600, 500, 375, 300, 250, 200, 150 or 125 kbit/s or any
/// other rate that divides 3000; `None` at any other. They take part in their bus as soon as they
/// find it idle, and again after they were off it for too many errors.
pub fn start(
    rcc: &RCC,
    can1: CAN1,
    can2: CAN2,
    rate_kbit_per_s: u16,
) -> Option<(Bus<CAN1>, Bus<CAN2>)> {
    let divider = can_timing::divider(APB1_HZ, rate_kbit_per_s)?;
    rcc.apb1enr().modify(|_, w| {
        w.can1en().set_bit();
        w.can2en().set_bit()
    });
    configure(&can1, divider);
    configure(&can2, divider);
    filter(&can1);
    for controller in [&*can1, &*can2] {
        controller.mcr().modify(|_, w| w.inrq().clear_bit());
    }
    Some((Bus(can1), Bus(can2)))
}

fn configure(controller: &RegisterBlock, divider: u32) {
    controller.mcr().write(|w| {
        w.inrq().set_bit();
        w.abom().set_bit()
    });
    // At most the end of a frame from the wire; on the way out of reset none.
    for _ in 0..100_000 {
        if controller.msr().read().inak().bit() {
            break;
        }
    }
    // SAFETY: values of their fields' range, less one each as the register wants them.
    controller.btr().write(|w| unsafe {
        w.brp().bits((divider - 1) as u16);
        w.ts1().bits(QUANTA_BEFORE_SAMPLE as u8 - 1);
        w.ts2().bits(QUANTA_AFTER_SAMPLE as u8 - 1);
        w.sjw().bits(0)
    });
}

/// The filters of both controllers are CAN1's.
fn filter(can1: &CAN1) {
    can1.fmr().write(|w| {
        // SAFETY: a number of filters, at most 28.
        unsafe { w.can2sb().bits(can_filters::CAN2_FIRST) };
        w.finit().set_bit()
    });
    for (number, bank) in (0..).zip(can1.fb_iter()) {
        if can_filters::USED >> number & 1 == 1 {
            // SAFETY: any bits are an identifier and a mask.
            unsafe {
                bank.fr1().write(|w| w.bits(can_filters::wanted(number)));
                bank.fr2().write(|w| w.bits(can_filters::MASK));
            }
        }
    }
    // SAFETY: one bit for every filter; those above 27 are zero.
    unsafe {
        can1.fm1r().write(|w| w.bits(0));
        can1.fs1r().write(|w| w.bits(can_filters::USED));
        can1.ffa1r().write(|w| w.bits(can_filters::TO_FIFO_1));
        can1.fa1r().write(|w| w.bits(can_filters::USED));
    }
    can1.fmr().modify(|_, w| w.finit().clear_bit());
}

impl<C: Deref<Target = RegisterBlock>> Can for Bus<C> {
    type Frame = Frame;
    type Error = Overrun;

    fn transmit(&mut self, frame: &Frame) -> nb::Result<Option<Frame>, Overrun> {
        let Self(controller) = self;
        let status = controller.tsr().read();
        let identifier = u32::from(frame.id.as_raw()) << ID_SHIFT;
        let mut free = None;
        for (empty, mailbox) in [
            (status.tme0().bit(), controller.tx(0)),
            (status.tme1().bit(), controller.tx(1)),
            (status.tme2().bit(), controller.tx(2)),
        ] {
            if empty {
                free = Some(mailbox);
            } else if mailbox.tir().read().bits() >> ID_SHIFT == identifier >> ID_SHIFT {
                return Err(nb::Error::WouldBlock);
            }
        }
        let mailbox = free.ok_or(nb::Error::WouldBlock)?;
        let [low @ .., a, b, c, d] = frame.data;
        // SAFETY: any bits are data; the length is at most 8; the identifier fits its field.
        unsafe {
            mailbox.tdtr().write(|w| w.dlc().bits(frame.length));
            mailbox.tdlr().write(|w| w.bits(u32::from_le_bytes(low)));
            mailbox
                .tdhr()
                .write(|w| w.bits(u32::from_le_bytes([a, b, c, d])));
            mailbox.tir().write(|w| w.bits(identifier).txrq().set_bit());
        }
        Ok(None)
    }

    fn receive(&mut self) -> nb::Result<Frame, Overrun> {
        let Self(controller) = self;
        for (fifo, mailbox) in [
            (controller.rf0r(), controller.rx(0)),
            (controller.rf1r(), controller.rx(1)),
        ] {
            let status = fifo.read();
            if status.fovr().bit() {
                // A one clears this flag and releases nothing.
                fifo.write(|w| w.fovr().clear());
                return Err(nb::Error::Other(Overrun));
            }
            if status.fmp().bits() == 0 {
                continue;
            }
            let (low, high) = (mailbox.rdlr().read().bits(), mailbox.rdhr().read().bits());
            let frame = Frame::received(
                mailbox.rir().read().bits(),
                mailbox.rdtr().read().dlc().bits(),
                u64::from(high) << 32 | u64::from(low),
            );
            fifo.write(|w| w.rfom().set_bit());
            return Ok(frame);
        }
        Err(nb::Error::WouldBlock)
    }
}

impl<C: Deref<Target = RegisterBlock>> Controller for Bus<C> {
    fn take_back(&mut self, id: u16) {
        let Self(controller) = self;
        for (mailbox, abort) in controller.tx_iter().zip([1 << 7, 1 << 15, 1 << 23]) {
            if mailbox.tir().read().bits() >> ID_SHIFT == u32::from(id) {
                // SAFETY: ABRQ of this mailbox; zeros change nothing in this register. An empty
                // mailbox has nothing to abort.
                controller.tsr().write(|w| unsafe { w.bits(abort) });
            }
        }
    }
}

impl Frame {
    fn received(register: u32, length_code: u8, data: u64) -> Self {
        Self {
            // Eleven bits are left, which every identifier has.
            id: StandardId::new((register >> ID_SHIFT) as u16).unwrap_or(StandardId::ZERO),
            length: if length_code < 8 { length_code } else { 8 },
            data: data.to_le_bytes(),
        }
    }
}

impl embedded_can::Frame for Frame {
    fn new(id: impl Into<Id>, bytes: &[u8]) -> Option<Self> {
        let Id::Standard(id) = id.into() else {
            return None;
        };
        let mut data = [0; 8];
        for (byte, given) in data.get_mut(..bytes.len())?.iter_mut().zip(bytes) {
            *byte = *given;
        }
        Some(Self {
            id,
            length: bytes.len() as u8,
            data,
        })
    }

    /// There are none here.
    fn new_remote(_: impl Into<Id>, _: usize) -> Option<Self> {
        None
    }

    fn is_extended(&self) -> bool {
        false
    }

    fn is_remote_frame(&self) -> bool {
        false
    }

    fn id(&self) -> Id {
        Id::Standard(self.id)
    }

    fn dlc(&self) -> usize {
        self.length.into()
    }

    fn data(&self) -> &[u8] {
        self.data.get(..self.dlc()).unwrap_or_default()
    }
}

impl embedded_can::Error for Overrun {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Overrun
    }
}
