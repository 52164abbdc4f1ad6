//! What takes many ticks or writes flash: done at rest.

use stillpoint_shared::Limits;
use stillpoint_shared::drive_config::DriveConfig;
use stillpoint_shared::protocol::Denial;

use super::machine::Machine;
use crate::store::Store;
use crate::store::flash::Flash;
use crate::{Command, Config};

/// One such thing, whose parts have been looked at.
pub(super) enum Work<'a> {
    Commit { content_hash: u64 },
    Store,
    Load { content_hash: u64 },
    Erase { content_hash: Option<u64> },
    Configure(Kept, &'a Limits, &'a Config),
    PutDrives(&'a DriveConfig),
}

/// What of a configuration is new, and stored.
pub(super) enum Kept {
    Limits,
    Config,
}

impl Work<'_> {
    /// What the executor's state has to allow.
    pub(super) fn command(&self) -> Command {
        match self {
            Self::Commit { .. } => Command::CommitLoad,
            Self::Store => Command::Store,
            Self::Load { .. } => Command::Load,
            Self::Erase { .. } => Command::Erase,
            Self::Configure(..) | Self::PutDrives(_) => Command::Configure,
        }
    }

    /// Does it, if the executor's state allows it.
    pub(super) fn carry_out<const AXES: usize, F: Flash>(
        self,
        machine: &mut Machine<AXES>,
        store: &mut Store<F>,
    ) -> Result<(), Denial> {
        let executor = &mut machine.executor;
        executor.allows(self.command())?;
        match self {
            Self::Commit { content_hash } => {
                let measured_rad = executor.measured_rad()?;
                executor.commit_load(content_hash, &measured_rad)?;
            }
            Self::Store => store.put(executor.trajectory())?,
            Self::Load { content_hash } => {
                let bytes = store.find(content_hash)?;
                let measured_rad = executor.measured_rad()?;
                executor.load_encoded(bytes, &measured_rad)?;
            }
            Self::Erase {
                content_hash: Some(content_hash),
            } => store.delete(content_hash)?,
            Self::Erase { content_hash: None } => store.delete_all()?,
            Self::Configure(kept, limits, config) => {
                machine.may_configure(limits, config)?;
                match kept {
                    Kept::Limits => store.put_limits(limits)?,
                    Kept::Config => store.put_config(config)?,
                }
                machine.executor.configure(limits, config)?;
            }
            Self::PutDrives(drives) => store.put_drives(drives)?,
        }
        Ok(())
    }
}
