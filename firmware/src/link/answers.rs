//! What each request does.

use heapless::{String, Vec};
use stillpoint_shared::drive_config::Cycle;
use stillpoint_shared::protocol::{
    Capacities, Denial, Greeting, Identity, LinkCounters, Request, Response, Versions,
};
use stillpoint_shared::{AxisDrive, AxisLimits, BusConfig, DriveConfig, Limits};

use super::machine::Access;
use super::session::Outcome;
use super::work::{Kept, Work};
use super::{BoardInfo, WINDOW};
use crate::store::Store;
use crate::store::flash::Flash;
use crate::{Config, ConfigError, Refusal};

/// The parts that a request can reach.
pub(super) struct Reach<'a, M, F> {
    pub(super) machine: &'a mut M,
    pub(super) store: &'a mut Store<F>,
    /// Set where an order comes true with the next start of the board only.
    pub(super) wants_start: &'a mut bool,
}

impl<M, F: Flash> Reach<'_, M, F> {
    /// Who is there, for the greeting of the given session.
    pub(super) fn identity<const AXES: usize>(&mut self, info: &BoardInfo, session: u16) -> Identity
    where
        M: Access<AXES>,
    {
        let capacities = Capacities::new(WINDOW, self.store.bytes() as u32);
        let stored = self.store.moves().map(|stored| stored.content_hash);
        let stored = gathered(stored);
        self.machine.with(|machine| Identity {
            greeting: Greeting {
                versions: Versions::OWN,
                session,
                board: name(info.board),
                firmware: name(info.firmware),
                build_id: info.build_id,
            },
            axes: AXES as u8,
            period_ticks: info.period_ticks,
            capacities,
            state: machine.executor.state(),
            limits_hash: machine.limits_hash(),
            loaded: machine.loaded(),
            stored,
        })
    }

    /// Answers a request that is no order.
    #[inline(never)] // Its response is large, and no order should have it on its stack.
    pub(super) fn ask<const AXES: usize>(
        &mut self,
        request: &Request<'_>,
        counters: LinkCounters,
    ) -> Result<Response, Denial>
    where
        M: Access<AXES>,
    {
        Ok(match *request {
            Request::KeepAlive => Response::Done,
            Request::List => Response::Stored(gathered(self.store.moves())),
            Request::GetDrives => Response::Drives(self.store.drives()),
            // With one lock for all: every one more is code again.
            _ => return self.machine.with(|m| m.answer(request, counters)),
        })
    }

    /// Does what takes many ticks or writes flash, if the executor's state allows it. The drive loop
    /// goes on meanwhile, but no other state comes of it: what is refused has changed nothing.
    #[inline(never)] // Once in the image.
    fn at_rest<const AXES: usize>(&mut self, work: Work<'_>) -> Result<(), Denial>
    where
        M: Access<AXES>,
    {
        // Before the drive loop is left without the executor, and when it cannot change any more.
        self.machine.with(|m| m.executor.allows(work.command()))?;
        let store = &mut *self.store;
        self.machine.at_rest(|m| work.carry_out(m, store))
    }

    /// Obeys an order.
    #[inline(never)]
    pub(super) fn obey<const AXES: usize>(
        &mut self,
        request: &Request<'_>,
        info: &BoardInfo,
    ) -> Result<Outcome, Denial>
    where
        M: Access<AXES>,
    {
        match *request {
            Request::UploadBegin(ref outline) => {
                let begun = self
                    .machine
                    .with(|m| m.executor.begin_load(outline).map(|()| m.arrived()));
                return Ok(Outcome::Upload(begun?));
            }
            Request::UploadCommit { content_hash } => {
                self.at_rest(Work::Commit { content_hash })?;
            }
            Request::Store => self.at_rest(Work::Store)?,
            Request::Load { content_hash } => self.at_rest(Work::Load { content_hash })?,
            Request::Erase { content_hash } => self.at_rest(Work::Erase { content_hash })?,
            Request::SetLimits(ref axes) => self.set_limits(axes, info)?,
            Request::SetConfig(config) => {
                let (given_ticks, board_ticks) = (config.period_ticks, info.period_ticks);
                if given_ticks != board_ticks {
                    let error = ConfigError::Period {
                        given_ticks,
                        board_ticks,
                    };
                    return Err(Refusal::from(error).into());
                }
                let (limits, _) = self.machine.with(|m| m.configuration())?;
                self.at_rest(Work::Configure(Kept::Config, &limits, &config))?;
            }
            Request::SetDrives { bus, ref axes } => self.set_drives(bus, axes, info)?,
            // With one lock for all: every one more is code again.
            _ => self.machine.with(|m| m.command(request))?,
        }
        Ok(Outcome::Done)
    }

    // On its own, so that its limits are not on the stack while a trajectory is checked.
    #[inline(never)]
    fn set_limits<const AXES: usize>(
        &mut self,
        axes: &[AxisLimits],
        info: &BoardInfo,
    ) -> Result<(), Denial>
    where
        M: Access<AXES>,
    {
        let limits = Limits::new(axes).map_err(Denial::Limits)?;
        let config = self.machine.with(|m| *m.executor.config());
        let config = if config.period_ticks == 0 {
            info.config()
        } else {
            config
        };
        self.at_rest(Work::Configure(Kept::Limits, &limits, &config))
    }

    #[inline(never)]
    fn set_drives<const AXES: usize>(
        &mut self,
        bus: BusConfig,
        axes: &[AxisDrive],
        info: &BoardInfo,
    ) -> Result<(), Denial>
    where
        M: Access<AXES>,
    {
        if axes.len() != AXES {
            let (given, board) = (axes.len() as u8, AXES as u8);
            return Err(Denial::DriveAxes { given, board });
        }
        let drives = DriveConfig::new(bus, axes).map_err(Denial::Drives)?;
        Cycle::new(&drives, info.period_ticks).map_err(Denial::Drives)?;
        let others = self.store.drives().as_ref() != Some(&drives);
        self.at_rest(Work::PutDrives(&drives))?;
        *self.wants_start |= others;
        Ok(())
    }
}

/// As many as there is room for; `collect` would panic beyond.
pub(super) fn gathered<T, const N: usize>(items: impl Iterator<Item = T>) -> Vec<T, N> {
    let mut gathered = Vec::new();
    for item in items {
        if gathered.push(item).is_err() {
            break;
        }
    }
    gathered
}

/// A name; none if it is too long, which no board's is.
fn name(text: &str) -> String<16> {
    String::try_from(text).unwrap_or_default()
}

impl BoardInfo {
    /// How the executor of this board plays unless it is told otherwise.
    pub fn config(&self) -> Config {
        Config {
            period_ticks: self.period_ticks,
            ..Config::default()
        }
    }
}
