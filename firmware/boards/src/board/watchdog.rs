//! The independent watchdog: a reset, and with it the end of all torque, unless the drive loop
//! feeds it. Only a change of its patience, with the drives off, feeds it besides.
//!
//! It runs on an oscillator of its own, of 17 to 47 kHz (data sheet, "LSI oscillator
//! characteristics"), so the times below are nominal.

use stm32f4::stm32f405::{DBGMCU, IWDG, iwdg};

/// Nominal clock of the watchdog before its divider.
const CLOCK_HZ: u32 = 32_000;

/// 20 ms, 80 ticks of the drive loop: 14 to 38 ms.
const RUNNING: u16 = (CLOCK_HZ / 4 / 50) as u16;

/// 2 s: 1.4 to 3.8 s.
const STARTING: u16 = (CLOCK_HZ / 256 * 2) as u16;

/// Longest there is, 4096 × 256 clocks: 22 to 61 s.
const LONGEST: u16 = 0xfff;

/// The watchdog's food, for the drive loop.
#[derive(Debug)]
pub struct Feeder(());

/// Starts the watchdog, with the patience of a start. It stands while a debugger holds the core.
pub fn start(watchdog: IWDG, debug: &DBGMCU) -> Feeder {
    debug.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
    watchdog.kr().write(|w| w.key().start());
    wait_for(Patience::Starting);
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
    /// While the board starts, with the drives off: a full store takes tens of milliseconds.
    Starting,
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
    taken(watchdog);
    cortex_m::interrupt::free(|_| {
        watchdog.kr().write(|w| w.key().unlock());
        let reload = match patience {
            Patience::Running => {
                watchdog.pr().write(|w| w.pr().divide_by4());
                RUNNING
            }
            Patience::Starting => {
                watchdog.pr().write(|w| w.pr().divide_by256());
                STARTING
            }
            Patience::Erasing => {
                watchdog.pr().write(|w| w.pr().divide_by256());
                LONGEST
            }
        };
        watchdog.rlr().write(|w| w.rl().set(reload));
    });
    // Fed earlier, it would begin with the old reload value.
    taken(watchdog);
    watchdog.kr().write(|w| w.key().feed());
}

/// Waits until a change has taken effect: five clocks of the watchdog by the manual, six divided ones
/// by ST's library, 90 ms at most.
fn taken(watchdog: &iwdg::RegisterBlock) {
    for _ in 0..2_000_000 {
        let status = watchdog.sr().read();
        if !status.pvu().bit() && !status.rvu().bit() {
            return;
        }
    }
}
