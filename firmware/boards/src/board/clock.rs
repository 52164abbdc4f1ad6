//! 168 MHz from the crystal: RM0090, sections 3.5 (wait states), 5.1.3 (voltage) and 7.2 (clocks).

use stillpoint_firmware::loop_time::CORE_HZ;
use stillpoint_firmware::pll::Pll;
use stm32f4::stm32f405::{FLASH, PWR, RCC};

/// Clock of USART2–5 and of the CAN controllers.
pub const APB1_HZ: u32 = CORE_HZ / 4;

/// What has not become ready in time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum ClockError {
    Crystal,
    Pll,
    Switch,
}

/// Brings the core to its [`CORE_HZ`]. Should the crystal stop later, the hardware raises the
/// non-maskable interrupt.
pub fn start<const CRYSTAL_MHZ: u32>(
    rcc: &RCC,
    pwr: &PWR,
    flash: &FLASH,
) -> Result<(), ClockError> {
    let pll = const {
        match Pll::of(CRYSTAL_MHZ) {
            Some(pll) => pll,
            None => panic!("an STM32F405 takes a crystal of 4 to 26 MHz"),
        }
    };

    rcc.apb1enr().modify(|_, w| w.pwren().set_bit());
    pwr.cr().modify(|_, w| w.vos().set_bit());

    rcc.cr().modify(|_, w| w.hseon().set_bit());
    wait(|| rcc.cr().read().hserdy().bit(), ClockError::Crystal)?;

    // SAFETY: the values are in the range of their fields.
    rcc.pllcfgr().write(|w| unsafe {
        w.pllsrc().hse();
        w.pllm().bits(pll.divider);
        w.plln().bits(pll.multiplier);
        w.pllp().bits(pll.core_divider / 2 - 1);
        w.pllq().bits(pll.usb_divider)
    });
    rcc.cr().modify(|_, w| w.pllon().set_bit());
    wait(|| rcc.cr().read().pllrdy().bit(), ClockError::Pll)?;

    flash.acr().write(|w| {
        w.latency().ws5();
        w.prften().set_bit();
        w.icen().set_bit();
        w.dcen().set_bit()
    });
    rcc.cfgr().modify(|_, w| {
        w.hpre().div1();
        w.ppre1().div4();
        w.ppre2().div2();
        w.sw().pll()
    });
    wait(|| rcc.cfgr().read().sws().is_pll(), ClockError::Switch)?;

    rcc.cr().modify(|_, w| w.csson().set_bit());
    Ok(())
}

/// Why the board was reset last: the upper byte of RCC_CSR (RM0090, section 7.3.21). Clears it.
pub fn take_reset_flags(rcc: &RCC) -> u8 {
    let flags = rcc.csr().read().bits() >> 24;
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    flags as u8
}

/// Waits for at most a few 100 ms at the 16 MHz of the start.
fn wait(ready: impl Fn() -> bool, error: ClockError) -> Result<(), ClockError> {
    for _ in 0..500_000 {
        if ready() {
            return Ok(());
        }
    }
    Err(error)
}
