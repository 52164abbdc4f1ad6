//! A board's drives are those of its stored configuration, and its monitor allows what their bus
//! needs.

mod cia402_sim;
mod common;

use std::cell::RefCell;
use std::rc::Rc;

use cia402_sim::drive::Drive;
use cia402_sim::wire::{Port, Wire};
use cia402_sim::{START_COUNTS, TICK_US, axis_drive};
use common::{AXES, FINE, START_RAD, limits, start, trajectory};
use stillpoint_firmware::cia402::{ConfiguredDrives, GroupError, NoDrives};
use stillpoint_firmware::drive::NoAnswer;
use stillpoint_firmware::link::{BoardInfo, Link};
use stillpoint_firmware::store::flash::RamFlash;
use stillpoint_firmware::store::{Layout, Store};
use stillpoint_firmware::{Config, DriveGroup, FaultCause, Machine, Refusal, State};
use stillpoint_shared::drive_config::{AxisDrive, BusConfig, DriveConfig};
use stillpoint_shared::time::DRIVE_PERIOD_TICKS;

const INFO: BoardInfo = BoardInfo {
    board: "box",
    firmware: "1.2.3",
    build_id: 0x1234,
    period_ticks: DRIVE_PERIOD_TICKS,
    start: 41,
};

const LAYOUT: Layout = Layout {
    moves: [0, 1],
    config: [2, 3],
};

/// Drives on a bus at 500 kbit/s that stand where the move starts.
fn config() -> DriveConfig {
    let bus = BusConfig {
        period_us: 4_000,
        bit_rate_kbit_per_s: 500,
        ..BusConfig::default()
    };
    let axes = [0, 1].map(|axis| AxisDrive {
        home_counts: START_COUNTS,
        home_rad: START_RAD[usize::from(axis)] as f32,
        ..axis_drive(0, axis + 1)
    });
    DriveConfig::new(bus, &axes).unwrap()
}

/// A board as it starts with what is stored.
struct Board {
    machine: Machine<AXES>,
    drives: ConfiguredDrives<AXES, [Port; 1]>,
    wire: Rc<RefCell<Wire>>,
    now_us: u64,
}

impl Board {
    fn new(config: Option<DriveConfig>) -> Self {
        let mut store = Store::mount(RamFlash::<4, 4096>::new(), LAYOUT);
        store.put_limits(&limits()).unwrap();
        if let Some(config) = &config {
            store.put_drives(config).unwrap();
        }
        let drives = [1, 2].map(|node| {
            let mut drive = Drive::new(node, 1_270, START_COUNTS);
            drive.traits.largest_step = 40_000;
            drive.power_on();
            drive
        });
        let wire = Rc::new(RefCell::new(Wire::new(drives.into())));
        let mut machine = Machine::unconfigured();
        Link::new(INFO).restore(&mut machine, &store).unwrap();
        let drives =
            ConfiguredDrives::new(store.drives().as_ref(), DRIVE_PERIOD_TICKS, |kbit_per_s| {
                (kbit_per_s == 500).then(|| [Port(Rc::clone(&wire))])
            });
        Self {
            machine,
            drives,
            wire,
            now_us: 0,
        }
    }

    fn tick(&mut self) {
        self.now_us += TICK_US;
        self.wire.borrow_mut().advance(self.now_us);
        self.machine.tick(&mut self.drives, &FINE);
    }

    /// Ticks until a state is reached; false if it is not within a second.
    fn reaches(&mut self, state: State, mut order: impl FnMut(&mut Self)) -> bool {
        (0..4_000).any(|_| {
            self.tick();
            order(self);
            self.machine.executor.state() == state
        })
    }
}

#[test]
fn a_move_is_played_with_default_settings() {
    let mut board = Board::new(Some(config()));
    let cycle = board.drives.cycle();
    assert_eq!(cycle.map(|cycle| cycle.ticks), Some(16));
    board.machine.executor.allow_for_bus(cycle);
    assert_eq!(*board.machine.executor.config(), INFO.config());
    let loaded = board.machine.executor.load(&trajectory(), &start());
    assert_eq!(loaded, Ok(()));
    assert!(board.reaches(State::Armed, |board| {
        let _ = board.machine.executor.arm();
    }));
    assert!(board.reaches(State::Running, |board| {
        let request = board.machine.executor.start_request();
        let _ = board.machine.executor.start(&request);
    }));
    assert!(board.reaches(State::Done, |_| {}));
    assert_eq!(board.machine.executor.fault(), None);
}

#[test]
fn the_monitor_allows_what_is_configured_and_what_the_bus_needs_on_top() {
    let mut board = Board::new(Some(config()));
    let executor = &mut board.machine.executor;
    executor.load(&trajectory(), &start()).unwrap();
    assert_eq!(*executor.allowed(), Config::default().monitor);
    // Without the allowance a healthy bus is too slow.
    for _ in 0..4_000 {
        board.tick();
    }
    let stale = board.machine.executor.arm();
    assert!(
        matches!(
            stale,
            Err(Refusal::Feedback(FaultCause::FeedbackStale {
                limit_ticks: 2,
                ..
            }))
        ),
        "{stale:?}"
    );

    let cycle = board.drives.cycle();
    let executor = &mut board.machine.executor;
    executor.allow_for_bus(cycle);
    // D = 16, L = 5, R = 5 (415 and 440 bits at 500 kbit/s), and two answers may be lost.
    assert_eq!(
        cycle.map(|cycle| (cycle.lead_ticks, cycle.reply_ticks)),
        Some((4, 4))
    );
    assert_eq!(executor.allowed().feedback_age_ticks, 3 * 16 + 4 - 1);
    // Another configuration does not undo it, and what is shown stays what was asked for.
    let mut config = *executor.config();
    config.monitor.feedback_age_ticks = 1;
    executor.configure(&limits(), &config).unwrap();
    assert_eq!(executor.allowed().feedback_age_ticks, 2 * 16 + 4 - 1);
    assert_eq!(*executor.config(), config);
    executor.allow_for_bus(None);
    assert_eq!(*executor.allowed(), config.monitor);
}

#[test]
fn a_configuration_that_cannot_be_used_leaves_no_drives_and_says_why() {
    let mut board = Board::new(None);
    let none = board.drives.group().map(|_| ());
    assert_eq!(none, Err(NoDrives::NotConfigured));
    assert_eq!(board.drives.observe(), Err(NoAnswer));
    let told = [Default::default(); AXES];
    assert_eq!(board.drives.exchange(&told), Err(NoAnswer));
    assert_eq!(board.drives.cycle(), None);
    board.drives.safe();
    board.drives.reset_faults();
    board.tick();
    let executor = &mut board.machine.executor;
    executor.load(&trajectory(), &start()).unwrap();
    assert_eq!(executor.arm(), Err(Refusal::NoFeedback));

    let why = |bus: BusConfig, axes: &[AxisDrive]| {
        let config = DriveConfig::new(bus, axes).unwrap();
        Board::new(Some(config)).drives.group().map(|_| ())
    };
    let given = config();
    let rate = BusConfig::default();
    let kbit_per_s = 1_000;
    assert_eq!(
        why(rate, given.axes()),
        Err(NoDrives::BitRate { kbit_per_s })
    );
    let axes = GroupError::Axes {
        config: 1,
        group: AXES,
    };
    assert_eq!(
        why(*given.bus(), &given.axes()[..1]),
        Err(NoDrives::Group(axes))
    );
}
