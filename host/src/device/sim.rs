//! A board in this process: the firmware's link, executor and store on ideal drives, in simulated time.

use super::transport::{Transport, TransportError};
use nalgebra::SVector;
use std::collections::VecDeque;
use std::time::Duration;
use stillpoint_firmware::link::BoardInfo;
use stillpoint_firmware::store::flash::{Flash, FlashError, RamFlash};
use stillpoint_firmware::store::{Layout, Store};
use stillpoint_firmware::{
    FaultRecord, IdealDrives, Link, Machine, Refusal, TickInputs, TickReport,
};
use stillpoint_shared::Limits;
use stillpoint_shared::time::{DRIVE_PERIOD_TICKS, TIME_TICKS_PER_SECOND};

/// Speed of the simulated line in each direction: 1 Mbit/s with ten bits per byte.
pub const SIMULATED_LINE_BYTES_PER_S: u32 = 100_000;

/// Flash as on the real board, half a megabyte.
struct BoardFlash(Box<RamFlash<4, 131_072>>);

impl Flash for BoardFlash {
    fn sector_bytes(&self) -> usize {
        self.0.sector_bytes()
    }

    fn sector(&self, sector: u8) -> &[u8] {
        self.0.sector(sector)
    }

    fn erase(&mut self, sector: u8) -> Result<(), FlashError> {
        self.0.erase(sector)
    }

    fn program(&mut self, sector: u8, offset: usize, word: u32) -> Result<(), FlashError> {
        self.0.program(sector, offset, word)
    }
}

const LAYOUT: Layout = Layout {
    moves: [0, 1],
    config: [2, 3],
};

/// Somebody who looks at every tick.
type Watch<const AXES: usize> = Box<dyn FnMut(&TickReport<'_, AXES>)>;

/// A simulated board of AXES axes. Its time passes while somebody waits for its bytes, as fast as it can.
pub struct Simulated<const AXES: usize> {
    link: Link,
    /// The board's executor, to look at.
    pub machine: Box<Machine<AXES>>,
    store: Store<BoardFlash>,
    drives: IdealDrives<AXES>,
    /// What the board tells the executor with every tick: an emergency stop can be pressed here.
    pub inputs: TickInputs,
    ticks: u64,
    restarts: u16,
    to_board: VecDeque<u8>,
    to_host: VecDeque<u8>,
    /// Bytes that the line could have carried in each direction and has not, in parts of a byte.
    credit: u32,
    on_tick: Option<Watch<AXES>>,
    mute: bool,
    restart_at: Option<u32>,
}

fn info(restarts: u16) -> BoardInfo {
    BoardInfo {
        board: "sim",
        firmware: env!("CARGO_PKG_VERSION"),
        build_id: 0,
        period_ticks: DRIVE_PERIOD_TICKS,
        start: restarts,
    }
}

impl<const AXES: usize> Simulated<AXES> {
    /// A board that stands at these positions in rad, with limits or still without.
    ///
    /// # Errors
    /// [`Refusal`] where the limits are of another number of axes.
    pub fn new(limits: Option<Limits>, position_rad: [f32; AXES]) -> Result<Self, Refusal> {
        let mut store = Store::mount(BoardFlash(Box::default()), LAYOUT);
        if let Some(limits) = limits {
            // A blank flash takes them: this cannot fail.
            let _ = store.put_limits(&limits);
        }
        let mut board = Self {
            link: Link::new(info(0)),
            machine: Box::new(Machine::unconfigured()),
            store,
            drives: IdealDrives::at(&SVector::from(position_rad)),
            inputs: TickInputs::default(),
            ticks: 0,
            restarts: 0,
            to_board: VecDeque::new(),
            to_host: VecDeque::new(),
            credit: 0,
            on_tick: None,
            mute: false,
            restart_at: None,
        };
        board.start()?;
        Ok(board)
    }

    /// What the board does when it gets power.
    fn start(&mut self) -> Result<(), Refusal> {
        self.link = Link::new(info(self.restarts));
        *self.machine = Machine::unconfigured();
        // A board that is started again and again in one process is a test: it may leak.
        let record = Box::leak(Box::new(FaultRecord::empty()));
        self.machine.executor.record_into(record, 0);
        match self.link.restore(&mut *self.machine, &self.store) {
            Err(Refusal::NotConfigured) => Ok(()),
            restored => restored,
        }
    }

    /// Takes the power away and gives it back: the store stays, the drives are off where they stand, bytes on the line
    /// are lost.
    ///
    /// # Errors
    /// [`Refusal`] where the stored limits are of another number of axes.
    pub fn restart(&mut self) -> Result<(), Refusal> {
        self.restarts = self.restarts.wrapping_add(1);
        self.to_board.clear();
        self.to_host.clear();
        self.start()
    }

    /// [`Simulated::restart`] as soon as the board has seen so many requests since it was started.
    pub fn restart_after_requests(&mut self, requests: u32) {
        self.restart_at = Some(requests.saturating_add(self.link.counters().requests));
    }

    /// Whether what the board sends is lost.
    pub fn mute(&mut self, mute: bool) {
        self.mute = mute;
    }

    /// Calls this with what happens in every tick from now on.
    pub fn on_tick(&mut self, watch: impl FnMut(&TickReport<'_, AXES>) + 'static) {
        self.on_tick = Some(Box::new(watch));
    }

    /// What the board's link has seen.
    pub fn link(&self) -> &Link {
        &self.link
    }

    /// One tick of the drive loop, and what the line carries meanwhile.
    fn tick(&mut self) {
        self.ticks += 1;
        let report = self.machine.tick(&mut self.drives, &self.inputs);
        if let Some(watch) = &mut self.on_tick {
            watch(&report);
        }
        self.credit += SIMULATED_LINE_BYTES_PER_S;
        let per_tick = TIME_TICKS_PER_SECOND / DRIVE_PERIOD_TICKS;
        let bytes = (self.credit / per_tick) as usize;
        self.credit %= per_tick;
        for byte in self.to_board.drain(..bytes.min(self.to_board.len())) {
            self.link.receive(byte);
        }
        while self.link.poll(&mut *self.machine, &mut self.store) && self.link.transmit().is_empty()
        {
        }
        let sent = bytes.min(self.link.transmit().len());
        if !self.mute {
            self.to_host.extend(&self.link.transmit()[..sent]);
        }
        self.link.sent(sent);
        if self.link.wants_start() && self.to_host.is_empty() {
            // The same limits as before: this cannot fail.
            let _ = self.restart();
        }
        if self
            .restart_at
            .is_some_and(|requests| self.link.counters().requests >= requests)
        {
            self.restart_at = None;
            // The same limits as before: this cannot fail.
            let _ = self.restart();
        }
    }

    fn period() -> Duration {
        Duration::from_nanos(u64::from(DRIVE_PERIOD_TICKS) * 100)
    }
}

impl<const AXES: usize> Transport for Simulated<AXES> {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.to_board.extend(bytes);
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        let deadline = self.now() + timeout;
        while self.to_host.is_empty() && self.now() < deadline {
            self.tick();
        }
        let count = buffer.len().min(self.to_host.len());
        for (place, byte) in buffer.iter_mut().zip(self.to_host.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }

    fn now(&self) -> Duration {
        let nanos = self.ticks.saturating_mul(Self::period().as_nanos() as u64);
        Duration::from_nanos(nanos)
    }

    fn reconnect(&mut self) -> Result<(), TransportError> {
        Ok(())
    }
}
