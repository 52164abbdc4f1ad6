//! Pins of the F405 board.
//!
//! | pin | function | electrical |
//! |---|---|---|
//! | PB10, PB11 | USART3 TX, RX: protocol | RX pulled up |
//! | PB8, PB9 | CAN1 RX, TX: drives | to a 3.3 V transceiver |
//! | PB12, PB13 | CAN2 RX, TX: drives | to a 3.3 V transceiver |
//! | PC0 | emergency-stop contact, high while all is well | pulled down |
//! | PC1 | drive enable, high to enable | push-pull, low from reset on if pulled down outside |

use core::convert::Infallible;

use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use stm32f4::stm32f405::{GPIOB, GPIOC, RCC};

/// The emergency-stop contact at PC0.
#[derive(Debug)]
pub struct StopContact(());

/// The drive-enable line at PC1.
#[derive(Debug)]
pub struct DriveEnable(());

/// Gives every pin its function. The drives are disabled from here on.
pub fn start(rcc: &RCC, b: GPIOB, c: GPIOC) -> (StopContact, DriveEnable) {
    rcc.ahb1enr().modify(|_, w| {
        w.gpioben().set_bit();
        w.gpiocen().set_bit()
    });

    c.bsrr().write(|w| w.br1().set_bit());
    c.moder().modify(|_, w| {
        w.moder0().input();
        w.moder1().output()
    });
    c.pupdr().modify(|_, w| {
        w.pupdr0().pull_down();
        w.pupdr1().floating()
    });

    b.pupdr().modify(|_, w| {
        w.pupdr8().pull_up();
        w.pupdr11().pull_up();
        w.pupdr12().pull_up()
    });
    b.ospeedr().modify(|_, w| {
        w.ospeedr9().medium_speed();
        w.ospeedr10().medium_speed();
        w.ospeedr13().medium_speed()
    });
    b.afrh().modify(|_, w| {
        w.afrh8().af9();
        w.afrh9().af9();
        w.afrh10().af7();
        w.afrh11().af7();
        w.afrh12().af9();
        w.afrh13().af9()
    });
    b.moder().modify(|_, w| {
        w.moder8().alternate();
        w.moder9().alternate();
        w.moder10().alternate();
        w.moder11().alternate();
        w.moder12().alternate();
        w.moder13().alternate()
    });
    (StopContact(()), DriveEnable(()))
}

/// Takes the drive-enable line down, from anywhere.
pub fn disable_drives() {
    // SAFETY: a write to BSRR changes the pins named in it and nothing else, in one access.
    unsafe { &*GPIOC::ptr() }
        .bsrr()
        .write(|w| w.br1().set_bit());
}

impl ErrorType for StopContact {
    type Error = Infallible;
}

impl InputPin for StopContact {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        // SAFETY: reading IDR has no effect.
        Ok(unsafe { &*GPIOC::ptr() }.idr().read().idr0().bit())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|high| !high)
    }
}

impl ErrorType for DriveEnable {
    type Error = Infallible;
}

impl OutputPin for DriveEnable {
    fn set_low(&mut self) -> Result<(), Infallible> {
        disable_drives();
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        // SAFETY: as in `disable_drives`.
        unsafe { &*GPIOC::ptr() }
            .bsrr()
            .write(|w| w.bs1().set_bit());
        Ok(())
    }
}
