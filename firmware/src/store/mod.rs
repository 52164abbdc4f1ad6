//! What survives a loss of power: trajectories and configuration.
//!
//! Two logs, each in two sectors: one for trajectories, by the planner's name of the move, one for
//! the configuration, by what it configures. Storing a move replaces the one of the same name. The
//! format of each record carries a version; one of another version is not read.

pub mod flash;
mod log;
mod record;

use serde::Serialize;
use serde::de::DeserializeOwned;
use stillpoint_shared::config::Config;
use stillpoint_shared::protocol::{StoreError, StoredMove};
use stillpoint_shared::trajectory::{FORMAT_VERSION, Header};
use stillpoint_shared::{DriveConfig, Limits, Trajectory, decode, drive_config, encode};

use flash::Flash;
use log::{Data, Entry, Log};
use record::Key;

/// Kind of a trajectory's record; its key is the planner's name for the move.
const MOVE: u8 = 1;

/// Kinds of configuration.
const LIMITS: u8 = 2;
const DRIVES: u8 = 3;
const CONFIG: u8 = 4;

/// Version of the configuration's format: count it up when [`Limits`], [`DriveConfig`] or [`Config`] change.
const CONFIG_FORMAT: u8 = 1;

/// Enough bytes for any configuration.
const MAX_CONFIG_BYTES: usize = 256;
const _: () = assert!(drive_config::MAX_ENCODED_BYTES <= MAX_CONFIG_BYTES);

/// Sectors of the store.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Layout {
    /// Two sectors for trajectories.
    pub moves: [u8; 2],
    /// Two sectors for the configuration.
    pub config: [u8; 2],
}

/// The store in a flash memory.
#[derive(Debug, Clone)]
pub struct Store<F> {
    flash: F,
    moves: Log,
    config: Log,
}

impl<F: Flash> Store<F> {
    /// Reads what is stored; whatever else the flash holds counts as nothing.
    pub fn mount(flash: F, layout: Layout) -> Self {
        Self {
            moves: Log::mount(&flash, layout.moves),
            config: Log::mount(&flash, layout.config),
            flash,
        }
    }

    /// The flash memory.
    pub fn flash(&self) -> &F {
        &self.flash
    }

    /// Gives the flash memory back.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// Bytes for trajectories, those of their records included.
    pub fn bytes(&self) -> usize {
        self.flash
            .sector_bytes()
            .saturating_sub(record::SECTOR_HEAD_BYTES)
    }

    /// The stored trajectories, oldest first.
    pub fn moves(&self) -> impl Iterator<Item = StoredMove> {
        let found = self.moves.entries().iter();
        found.filter_map(|entry| self.read(entry).map(|(stored, _)| stored))
    }

    fn read(&self, entry: &Entry) -> Option<(StoredMove, &[u8])> {
        if entry.head.format != FORMAT_VERSION {
            return None;
        }
        let bytes = self.moves.data(&self.flash, entry)?;
        let header = Header::of(bytes).ok()?;
        let stored = StoredMove {
            id: header.id,
            content_hash: header.content_hash,
            limits_hash: header.limits_hash,
            duration_ticks: header.duration_ticks,
            bytes: bytes.len() as u32,
        };
        Some((stored, bytes))
    }

    /// Bytes of the stored trajectory with this content hash, for [`Trajectory::decode_from`].
    pub fn find(&self, content_hash: u64) -> Result<&[u8], StoreError> {
        let mut found = self
            .moves
            .entries()
            .iter()
            .filter_map(|entry| self.read(entry));
        let found = found.find(|(stored, _)| stored.content_hash == content_hash);
        found
            .map(|(_, bytes)| bytes)
            .ok_or(StoreError::NotStored { content_hash })
    }

    /// Stores a trajectory in place of the one of the same name.
    pub fn put(&mut self, trajectory: &Trajectory) -> Result<(), StoreError> {
        let key = Key {
            kind: MOVE,
            key: trajectory.header().id,
        };
        self.moves
            .put(&mut self.flash, key, FORMAT_VERSION, Data::Move(trajectory))
    }

    /// Forgets the stored trajectory with this content hash.
    pub fn delete(&mut self, content_hash: u64) -> Result<(), StoreError> {
        let stored = self
            .moves()
            .find(|stored| stored.content_hash == content_hash);
        let stored = stored.ok_or(StoreError::NotStored { content_hash })?;
        let key = Key {
            kind: MOVE,
            key: stored.id,
        };
        self.moves.delete(&mut self.flash, key)
    }

    /// Forgets all stored trajectories.
    pub fn delete_all(&mut self) -> Result<(), StoreError> {
        while let Some(entry) = self.moves.entries().last() {
            self.moves.delete(&mut self.flash, entry.head.key)?;
        }
        Ok(())
    }

    /// The machine's limits.
    pub fn limits(&self) -> Option<Limits> {
        self.value(LIMITS)
    }

    /// Stores the machine's limits.
    pub fn put_limits(&mut self, limits: &Limits) -> Result<(), StoreError> {
        self.put_value(LIMITS, limits)
    }

    /// The configuration of the drives.
    pub fn drives(&self) -> Option<DriveConfig> {
        self.value(DRIVES)
    }

    /// Stores the configuration of the drives.
    pub fn put_drives(&mut self, drives: &DriveConfig) -> Result<(), StoreError> {
        self.put_value(DRIVES, drives)
    }

    /// How the executor plays.
    pub fn config(&self) -> Option<Config> {
        self.value(CONFIG)
    }

    /// Stores how the executor plays.
    pub fn put_config(&mut self, config: &Config) -> Result<(), StoreError> {
        self.put_value(CONFIG, config)
    }

    fn value<T: DeserializeOwned>(&self, kind: u8) -> Option<T> {
        let key = Key { kind, key: 0 };
        let mut entries = self.config.entries().iter();
        let entry = entries.find(|entry| entry.head.key == key)?;
        if entry.head.format != CONFIG_FORMAT {
            return None;
        }
        decode::front(self.config.data(&self.flash, entry)?).ok()
    }

    fn put_value<T: Serialize>(&mut self, kind: u8, value: &T) -> Result<(), StoreError> {
        let mut buffer = [0; MAX_CONFIG_BYTES];
        let bytes = encode::to_slice(value, &mut buffer).ok_or(StoreError::NoRoom {
            needed: MAX_CONFIG_BYTES as u32 + 1,
            available: MAX_CONFIG_BYTES as u32,
        })?;
        let key = Key { kind, key: 0 };
        self.config
            .put(&mut self.flash, key, CONFIG_FORMAT, Data::Bytes(bytes))
    }
}
