//! A move on the emulated board, and the machine under the set-points that the board really sent.

use super::run::{Run, StudyError};
use crate::device::{
    DeviceError, Progress, Qemu, Session, Settings, TransportError, Uploaded, qemu,
};
use crate::movefile::MoveFile;
use crate::simulate::ClosedLoop;
use crate::simulate::trajectory::board_limits;
use std::time::{Duration, Instant};
use stillpoint_firmware::bench::{AXES, Record, TickRecord, rows};
use stillpoint_firmware::{Setpoint, State};
use stillpoint_shared::Trajectory;
use stillpoint_shared::protocol::{Greeting, Request};
use stillpoint_shared::status::{CommsPolicy, StartRequest};

/// Longest time to wait for a tick of the emulated board.
const PATIENCE: Duration = Duration::from_secs(20);

/// What happens, for whoever watches.
#[derive(Clone, Copy, Debug)]
pub enum Step<'a> {
    /// The board has answered the greeting after this time.
    Greeted(&'a Greeting, Duration),
    /// The upload has come so far.
    Upload(Progress),
    /// The move has come so far.
    Move(&'a TickRecord),
}

/// A move on the emulated board.
#[derive(Clone, Debug)]
pub struct BoardRun {
    /// The machine under the set-points that the board sent.
    pub run: Run,
    /// What the upload took.
    pub uploaded: Uploaded,
    /// Set-points sent, from the first tick of the move until they do not change any more.
    pub sent: Vec<[Setpoint; AXES]>,
}

/// Why a move was not played on the emulated board.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BoardError {
    /// The machine is none of the board's.
    #[error("the machine has {axes} axes, the emulated board {AXES}")]
    Axes {
        /// Axes of the machine.
        axes: usize,
    },
    /// The board does not run, does not answer or refuses.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The board ended the move.
    #[error("the emulated board is in state {state:?} at {time_s:.4} s of the move")]
    Ended {
        /// Its state.
        state: State,
        /// Time in the move.
        time_s: f64,
    },
    /// The board does not go on.
    #[error("the emulated board stands still: is this computer very busy? Try again")]
    Silent,
    /// The machine cannot be simulated.
    #[error(transparent)]
    Study(#[from] StudyError),
}

impl From<TransportError> for BoardError {
    fn from(error: TransportError) -> Self {
        Self::Device(error.into())
    }
}

/// Plays a trajectory on an emulated board that is started for it, and feeds what the board sends into the simulated
/// drives of the move file, as [`play`](super::play) does with the executor on this computer.
///
/// # Errors
/// [`BoardError`].
pub fn play_on_board(
    name: &str,
    file: &MoveFile,
    trajectory: &Trajectory,
    mut watch: impl FnMut(Step<'_>),
) -> Result<BoardRun, BoardError> {
    let axes = trajectory.axes();
    if axes != AXES {
        return Err(BoardError::Axes { axes });
    }
    let options = qemu::Options {
        records: true,
        ..qemu::Options::default()
    };
    let mut board = Qemu::start(&options).map_err(TransportError::from)?;
    board.turn_to(&trajectory.coefficients()[..AXES])?;
    let began = Instant::now();
    let mut session = Session::open(board, Settings::default())?;
    watch(Step::Greeted(&session.identity().greeting, began.elapsed()));
    let limits = board_limits(&file.limits, file.machine.plant());
    let limits = limits.map_err(|error| {
        let source = crate::simulate::ClosedLoopError::Limits(error);
        let name = name.to_owned();
        StudyError::Play { name, source }
    })?;
    session.order(&Request::SetLimits(limits.axes().iter().copied().collect()))?;
    let uploaded = session.upload(trajectory, |progress| watch(Step::Upload(progress)))?;
    session.order(&Request::Arm)?;
    session.start(&StartRequest {
        trajectory_hash: trajectory.header().content_hash,
        limits_hash: limits.hash(),
        comms: CommsPolicy::Continue,
        comms_timeout_ticks: 0,
        dry_run: false,
    })?;
    let sent = until_done(&session, &mut watch)?;

    let real = file.drive.real_machine(&file.machine);
    let closed_loop = ClosedLoop::new(real.plant(), &file.limits, &file.from, &file.drive);
    let recording = closed_loop.feed(trajectory, &sent);
    let recording = recording.map_err(|source| StudyError::Play {
        name: name.to_owned(),
        source,
    })?;
    Ok(BoardRun {
        run: Run::new(name, real.plant(), recording),
        uploaded,
        sent,
    })
}

/// The set-points of the move and its end.
fn until_done(
    session: &Session<Qemu>,
    watch: &mut impl FnMut(Step<'_>),
) -> Result<Vec<[Setpoint; AXES]>, BoardError> {
    let mut during = Vec::new();
    loop {
        let records = session.transport().records();
        let record = records.recv_timeout(PATIENCE);
        let Record::Tick(record) = record.map_err(|_| BoardError::Silent)? else {
            continue;
        };
        let (state, sent) = (record.state, record.sent.map(|rows| rows.map(setpoint)));
        watch(Step::Move(&record));
        match (state, sent) {
            (State::Running, Some(sent)) => during.push(sent),
            (State::Done, Some(sent)) => {
                // The limiter may still be on its way to the last set-point.
                let at_rest = during.last() == Some(&sent);
                during.push(sent);
                if at_rest {
                    return Ok(during);
                }
            }
            _ if during.is_empty() => {}
            (state, _) => {
                let time_s = stillpoint_shared::time::seconds(record.path_ticks);
                return Err(BoardError::Ended { state, time_s });
            }
        }
    }
}

fn setpoint([position_rad, velocity_rad_per_s, torque_nm]: [f32; 3]) -> Setpoint {
    Setpoint {
        position_rad,
        velocity_rad_per_s,
        torque_nm,
    }
}

impl BoardRun {
    /// The first tick of the move, from 0, in which the board has not sent what `replay`, the executor on this computer, has:
    /// compared to the bit.
    #[must_use]
    pub fn differs_from(&self, replay: &Run) -> Option<usize> {
        let bits = |sent: [Setpoint; AXES]| rows(sent).map(|row| row.map(f32::to_bits));
        let mut commands = replay.recording.commands.iter();
        self.sent.iter().position(|&sent| {
            let replayed = commands.next();
            let replayed = replayed.and_then(|c| c.setpoints.as_slice().try_into().ok());
            replayed.map(bits) != Some(bits(sent))
        })
    }
}
