//! The idle loop: the protocol's work, between the interrupts.

use heapless::spsc::Consumer;
use rtic::Mutex;
use stillpoint_firmware::link::{Access, Link, Machine};
use stillpoint_firmware::store::Store;
use stillpoint_firmware::store::flash::Flash;
use stillpoint_firmware::{State, bench};

use super::receive;
use super::uart::Transmitter;

/// Axes of the boards.
pub const AXES: usize = bench::AXES;

/// Bytes that may wait between the receive interrupt and the link, one less than this: those of the
/// request that may follow the one being obeyed.
pub const RECEIVED: usize = 1024;

/// The machine; away while the idle loop does something long with it.
pub type Place = Option<&'static mut Machine<AXES>>;

/// The idle loop's way to the machine.
#[derive(Debug)]
pub struct Reach<M>(pub M);

impl<M: Mutex<T = Place>> Access<AXES> for Reach<M> {
    fn with<R>(&mut self, act: impl FnOnce(&mut Machine<AXES>) -> R) -> R {
        self.0.lock(|place| match place {
            Some(machine) => act(machine),
            None => never(),
        })
    }

    fn at_rest<R>(&mut self, act: impl FnOnce(&mut Machine<AXES>) -> R) -> R {
        match self.0.lock(Option::take) {
            Some(machine) => {
                let result = act(machine);
                self.0.lock(|place| *place = Some(machine));
                result
            }
            None => never(),
        }
    }
}

/// The machine is away only inside `at_rest`, which does not reach for it again. If it did, the
/// drive loop would stop with it, and the watchdog end that.
fn never() -> ! {
    loop {
        cortex_m::asm::nop();
    }
}

/// The protocol's parts.
pub struct Server<F: 'static> {
    /// The link.
    pub link: &'static mut Link,
    /// The store.
    pub store: &'static mut Store<F>,
    /// Bytes from the host.
    pub received: Consumer<'static, u8>,
    /// Bytes to the host.
    pub transmitter: Transmitter,
}

impl<F: Flash> Server<F> {
    /// Receives, answers and sends as much as can be done now. Returns whether there is more.
    pub fn serve(&mut self, machine: &mut impl Access<AXES>) -> bool {
        self.link.count_lost(receive::take_lost());
        while self.link.free() > 0
            && let Some(byte) = self.received.dequeue()
        {
            self.link.receive(byte);
        }
        let more = self.link.poll(machine, self.store);
        let mut sent = 0;
        for &byte in self.link.transmit() {
            if !self.transmitter.ready() {
                break;
            }
            self.transmitter.send(byte);
            sent += 1;
        }
        self.link.sent(sent);
        more || !self.link.transmit().is_empty() || self.received.ready()
    }
}

/// Logs states and faults as they come.
#[derive(Debug)]
pub struct Diary(Option<State>);

impl Diary {
    /// Nothing is written yet.
    pub const NEW: Self = Self(None);

    /// Looks for something new.
    pub fn look(&mut self, machine: &mut impl Access<AXES>) {
        let (state, fault) = machine.with(|m| (m.executor.state(), m.executor.fault()));
        if self.0 != Some(state) {
            self.0 = Some(state);
            match fault {
                Some(fault) => defmt::warn!("{}: {}", state, fault),
                None => defmt::info!("{}", state),
            }
        }
    }
}
