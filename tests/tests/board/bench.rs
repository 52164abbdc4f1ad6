//! An emulated board with the paper's move, and what its test bench has seen.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use stillpoint::device::{DeviceError, Qemu, Session, Settings, Uploaded, qemu};
use stillpoint::movefile::{MoveFile, PAPER_MOVE};
use stillpoint::nlp::Pounce;
use stillpoint::plan::plan;
use stillpoint::simulate::trajectory::board_limits;
use stillpoint_firmware::bench::{AXES, Action, Record, TickRecord};
use stillpoint_firmware::{Refusal, State};
use stillpoint_shared::protocol::{Denial, Request, Status};
use stillpoint_shared::status::{CommsPolicy, StartRequest};
use stillpoint_shared::{Limits, Trajectory, TrajectoryBuilder};

/// Longest time to wait for anything: far more than it takes on a busy computer.
pub(super) const PATIENCE: Duration = Duration::from_secs(20);

/// Slow enough to act in the middle of the move, however busy the computer is: the move takes 2.5 s.
pub(super) const SLOWLY_PERCENT: u8 = 2;

/// Limits of the paper's machine and its move, planned once.
pub(super) fn paper() -> &'static (Limits, Trajectory) {
    static PAPER: OnceLock<(Limits, Trajectory)> = OnceLock::new();
    PAPER.get_or_init(|| {
        let file = MoveFile::parse(PAPER_MOVE, "paper.toml").unwrap();
        let limits = board_limits(&file.limits, file.machine.plant()).unwrap();
        let plan = plan(&file, &Pounce, Box::new(|_, _| true)).unwrap();
        (limits, plan.trajectory)
    })
}

/// Positions in rad at which a trajectory begins.
pub(super) fn first_rad(trajectory: &Trajectory) -> [f32; AXES] {
    std::array::from_fn(|axis| trajectory.coefficients()[axis])
}

/// A move that stays where it is, of as many blocks as the paper's.
pub(super) fn still(id: u32) -> Trajectory {
    let (limits, trajectory) = paper();
    let mut builder = TrajectoryBuilder::new(id, limits);
    let mut row = first_rad(trajectory).map(f64::from).to_vec();
    row.resize(9, 0.0);
    for _ in 0..6 {
        builder.interval(80_000, 10, &row.repeat(11)).unwrap();
    }
    builder.finish().unwrap()
}

/// Start of the paper's move, without supervision of the host.
pub(super) fn start_request() -> StartRequest {
    let header = paper().1.header();
    StartRequest {
        trajectory_hash: header.content_hash,
        limits_hash: header.limits_hash,
        comms: CommsPolicy::Continue,
        comms_timeout_ticks: 0,
        dry_run: false,
    }
}

/// An emulated board and the session with it.
pub(super) struct Bench {
    pub(super) session: Session<Qemu>,
    /// What the bench has seen so far.
    pub(super) seen: Vec<TickRecord>,
}

impl Bench {
    /// A board as new, without a session. Its axes are turned to where the paper's move begins.
    pub(super) fn board() -> Qemu {
        let options = qemu::Options {
            records: true,
            ..qemu::Options::default()
        };
        let mut board = Qemu::start(&options).unwrap_or_else(|error| panic!("{error}"));
        board.turn_to(&first_rad(&paper().1)).unwrap();
        board
    }

    /// A board as new, whose axes stand where the paper's move begins.
    pub(super) fn new() -> Self {
        // The line loses nothing. To ask again would be a sign of life that nobody means.
        let settings = Settings {
            response_timeout: PATIENCE,
            attempts: 1,
            ..Settings::default()
        };
        let session = Session::open(Self::board(), settings).unwrap();
        let mut bench = Self {
            session,
            seen: Vec::new(),
        };
        bench.until_measured(&first_rad(&paper().1));
        bench
    }

    /// A board that knows its limits.
    pub(super) fn configured() -> Self {
        let mut bench = Self::new();
        let limits = &paper().0;
        let axes = limits.axes().iter().copied().collect();
        bench.session.order(&Request::SetLimits(axes)).unwrap();
        bench
    }

    /// A board in `Ready`, with the paper's move.
    pub(super) fn loaded() -> Self {
        let mut bench = Self::configured();
        bench.upload();
        bench
    }

    /// A board that plays the paper's move at a part of its speed.
    pub(super) fn running(percent: u8, start: &StartRequest) -> Self {
        let mut bench = Self::loaded();
        bench.session.order(&Request::Override { percent }).unwrap();
        bench.session.order(&Request::Arm).unwrap();
        bench.start(start);
        bench
    }

    pub(super) fn upload(&mut self) -> Uploaded {
        self.session.upload(&paper().1, |_| {}).unwrap()
    }

    /// Starts as soon as the drives are enabled and the axes stand at the first node.
    pub(super) fn start(&mut self, start: &StartRequest) {
        let began = Instant::now();
        loop {
            match self.session.order(&Request::Start(*start)) {
                Ok(()) => return,
                Err(DeviceError::Denied(Denial::Executor(
                    Refusal::NotEnabled { .. } | Refusal::Approaching { .. },
                ))) if began.elapsed() < PATIENCE => {}
                Err(error) => panic!("{error}"),
            }
        }
    }

    pub(super) fn act(&mut self, action: Action) {
        self.session.transport_mut().act(action).unwrap();
    }

    pub(super) fn status(&mut self) -> Status {
        self.session.status().unwrap()
    }

    /// Waits until a tick is seen that fits, and returns it.
    pub(super) fn until(&mut self, what: &str, fits: impl Fn(&TickRecord) -> bool) -> TickRecord {
        let began = Instant::now();
        while began.elapsed() < PATIENCE {
            match self.session.transport().records().recv_timeout(PATIENCE) {
                Ok(Record::Tick(record)) => {
                    self.seen.push(record);
                    if fits(&record) {
                        return record;
                    }
                }
                Ok(_) => {}
                Err(_) => break,
            }
        }
        panic!("no {what}; last {:?}", self.seen.last());
    }

    /// Waits for a state.
    pub(super) fn until_state(&mut self, state: State) -> TickRecord {
        self.until(&format!("{state:?}"), |record| record.state == state)
    }

    /// Waits until the move is held or done.
    pub(super) fn until_halt(&mut self) -> TickRecord {
        self.until("end of motion", |record| {
            matches!(record.state, State::Held | State::Done)
        })
    }

    /// Waits until a part of the move is played.
    pub(super) fn until_share(&mut self, share: f64) -> TickRecord {
        let ticks = share * f64::from(paper().1.duration_ticks());
        self.until("progress", |record| f64::from(record.path_ticks) >= ticks)
    }

    /// A board that plays the paper's move slowly, and has begun to.
    pub(super) fn under_way() -> Self {
        let mut bench = Self::running(SLOWLY_PERCENT, &start_request());
        bench.until_share(0.05);
        bench
    }

    /// Waits until the axes are measured at these positions: the bench turns them, but does not say when.
    pub(super) fn until_measured(&mut self, position_rad: &[f32; AXES]) {
        let began = Instant::now();
        loop {
            let measured = self.status().axes;
            let measured = measured.iter().map(|axis| axis.measured_rad);
            if measured.eq(position_rad.iter().copied().map(Some)) {
                return;
            }
            assert!(began.elapsed() < PATIENCE, "the axes do not turn");
        }
    }

    /// Waits until the board has played so many ticks more.
    pub(super) fn wait_ticks(&mut self, ticks: u64) {
        let until = self.status().tick + ticks;
        while self.status().tick < until {
            self.session.wait(Duration::from_millis(5)).unwrap();
        }
    }

    /// Ticks seen since the last call or wait, none of which has to come.
    pub(super) fn drain(&mut self) {
        while let Ok(record) = self.session.transport().records().try_recv() {
            if let Record::Tick(record) = record {
                self.seen.push(record);
            }
        }
    }
}
