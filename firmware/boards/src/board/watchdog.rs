//! The independent watchdog: a reset, and with it the end of all torque, unless the drive loop
//! feeds it.
//!
//! It runs on an oscillator of its own, of 17 to 47 kHz (data sheet, "LSI oscillator
//! characteristics"), so the times below are nominal.

use stm32f4::stm32f405::{DBGMCU, IWDG};

/// Nominal clock of the watchdog before its divider.
const CLOCK_HZ: u32 = 32_000;

/// 20 ms, 80 ticks of the drive loop: 14 to 38 ms.
const RUNNING: u16 = (CLOCK_HZ / 4 / 50) as u16;

/// Longest there is, 4096 × 256 clocks: 22 to 61 s.
const LONGEST: u16 = 0xfff;

/// The watchdog's food, for the drive loop.
#[derive(Debug)]
pub struct Feeder(());

/// Starts the watchdog. It stands while a debugger holds the core.
pub fn start(watchdog: IWDG, debug: &DBGMCU) -> Feeder {
    debug.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
    watchdog.kr().write(|w| w.key().start());
    wait_for(Patience::Running);
    Feeder(())
}

impl Feeder {
    /// The drive loop is alive.
    pub fn feed(&self) {
        // SAFETY: writes one register, in one access.
        unsafe { &*IWDG::ptr() }.kr().write(|w| w.key().feed());
    }
}

/// How long the watchdog waits to be fed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Patience {
    /// While the drive loop runs.
    Running,
    /// While flash is erased, with the drives off and the core standing still.
    Erasing,
}

/// Sets the watchdog's patience, and feeds it.
pub fn wait_for(patience: Patience) {
    // SAFETY: the drive loop, which may interrupt this, only feeds. That would lock the other
    // registers again, so the writes below are not interrupted.
    let watchdog = unsafe { &*IWDG::ptr() };
    // An earlier change takes effect within five clocks of the watchdog.
    for _ in 0..100_000 {
        let status = watchdog.sr().read();
        if !status.pvu().bit() && !status.rvu().bit() {
            break;
        }
    }
    cortex_m::interrupt::free(|_| {
        watchdog.kr().write(|w| w.key().unlock());
        match patience {
            Patience::Running => {
                watchdog.pr().write(|w| w.pr().divide_by4());
                watchdog.rlr().write(|w| w.rl().set(RUNNING));
            }
            Patience::Erasing => {
                watchdog.pr().write(|w| w.pr().divide_by256());
                watchdog.rlr().write(|w| w.rl().set(LONGEST));
            }
        }
        watchdog.kr().write(|w| w.key().feed());
    });
}
