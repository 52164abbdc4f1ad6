//! Object dictionary of the simulated drive: entries with size and access, and the SDO server's
//! rules for reading and writing them.
//!
//! Written from the profiles, not from the code under test.

use std::collections::BTreeMap;

/// One entry.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) value: u32,
    pub(crate) bytes: u8,
    pub(crate) writable: bool,
}

/// Entries by index and sub-index.
#[derive(Debug, Clone)]
pub(crate) struct Dictionary {
    entries: BTreeMap<(u16, u8), Entry>,
    /// Entries the drive refuses to have read or written, and why.
    pub(crate) refused: BTreeMap<(u16, u8), u32>,
}

/// Abort codes of CiA 301.
pub(crate) mod abort {
    pub(crate) const COMMAND: u32 = 0x0504_0001;
    pub(crate) const UNSUPPORTED: u32 = 0x0601_0000;
    pub(crate) const READ_ONLY: u32 = 0x0601_0002;
    pub(crate) const NO_OBJECT: u32 = 0x0602_0000;
    pub(crate) const NOT_MAPPABLE: u32 = 0x0604_0041;
    pub(crate) const MAPPING_TOO_LONG: u32 = 0x0604_0042;
    pub(crate) const LENGTH: u32 = 0x0607_0010;
    pub(crate) const NO_SUB_INDEX: u32 = 0x0609_0011;
    pub(crate) const RANGE: u32 = 0x0609_0030;
}

impl Dictionary {
    /// What a drive has after power-on: the default mapping of CiA 402 is controlword and
    /// statusword alone, sent on events.
    pub(crate) fn power_on(node: u8, rated_torque_mnm: u32) -> Self {
        let node = u32::from(node);
        let mut dictionary = Self {
            entries: BTreeMap::new(),
            refused: BTreeMap::new(),
        };
        for (index, sub, bytes, value, writable) in [
            (0x1000, 0, 4, 0x0002_0192, false),
            (0x1001, 0, 1, 0, false),
            (0x1016, 0, 1, 1, false),
            (0x1016, 1, 4, 0, true),
            (0x1017, 0, 2, 0, true),
            (0x1018, 0, 1, 1, false),
            (0x1018, 1, 4, 0x0abc, false),
            (0x1400, 0, 1, 2, false),
            (0x1400, 1, 4, 0x200 + node, true),
            (0x1400, 2, 1, 255, true),
            (0x1600, 0, 1, 1, true),
            (0x1600, 1, 4, 0x6040_0010, true),
            (0x1600, 2, 4, 0, true),
            (0x1600, 3, 4, 0, true),
            (0x1600, 4, 4, 0, true),
            (0x1800, 0, 1, 5, false),
            (0x1800, 1, 4, 0x4000_0180 + node, true),
            (0x1800, 2, 1, 255, true),
            (0x1a00, 0, 1, 1, true),
            (0x1a00, 1, 4, 0x6041_0010, true),
            (0x1a00, 2, 4, 0, true),
            (0x1a00, 3, 4, 0, true),
            (0x1a00, 4, 4, 0, true),
            (0x1801, 1, 4, 0x4000_0280 + node, true),
            (0x1801, 2, 1, 255, true),
            (0x603f, 0, 2, 0, false),
            (0x6040, 0, 2, 0, true),
            (0x6041, 0, 2, 0, false),
            (0x6060, 0, 1, 0, true),
            (0x6061, 0, 1, 0, false),
            (0x6064, 0, 4, 0, false),
            (0x6076, 0, 4, rated_torque_mnm, false),
            (0x6077, 0, 2, 0, false),
            (0x607a, 0, 4, 0, true),
            (0x60b2, 0, 2, 0, true),
            (0x60c2, 1, 1, 1, true),
            (0x60c2, 2, 1, 0xfd, true),
        ] {
            let entry = Entry {
                value,
                bytes,
                writable,
            };
            dictionary.entries.insert((index, sub), entry);
        }
        dictionary
    }

    /// Removes an object.
    pub(crate) fn lacks(&mut self, index: u16) {
        self.entries.retain(|(at, _), _| *at != index);
    }

    /// Gives an entry another size.
    pub(crate) fn resize(&mut self, index: u16, sub: u8, bytes: u8) {
        if let Some(entry) = self.entries.get_mut(&(index, sub)) {
            entry.bytes = bytes;
        }
    }

    /// Value of an entry that the drive itself uses.
    pub(crate) fn get(&self, index: u16, sub: u8) -> u32 {
        self.entries
            .get(&(index, sub))
            .map_or(0, |entry| entry.value)
    }

    /// Sets an entry from inside the drive.
    pub(crate) fn set(&mut self, index: u16, sub: u8, value: u32) {
        if let Some(entry) = self.entries.get_mut(&(index, sub)) {
            entry.value = match entry.bytes {
                1 => value & 0xff,
                2 => value & 0xffff,
                _ => value,
            };
        }
    }

    fn entry(&self, index: u16, sub: u8) -> Result<&Entry, u32> {
        if let Some(&code) = self.refused.get(&(index, sub)) {
            return Err(code);
        }
        self.entries.get(&(index, sub)).ok_or({
            if self.entries.keys().any(|(at, _)| *at == index) {
                abort::NO_SUB_INDEX
            } else {
                abort::NO_OBJECT
            }
        })
    }

    /// An expedited SDO transfer, request to answer. The second value is the entry that was
    /// written.
    pub(crate) fn serve(&mut self, request: &[u8]) -> ([u8; 8], Option<(u16, u8)>) {
        let mut answer = [0; 8];
        let [command, low, high, sub, value @ ..] = request else {
            return (answer, None);
        };
        answer[1..4].copy_from_slice(&[*low, *high, *sub]);
        let index = u16::from_le_bytes([*low, *high]);
        let result = match (*command, <[u8; 4]>::try_from(value)) {
            (0x40, _) => self.entry(index, *sub).map(|entry| {
                answer[0] = 0x43 | (4 - entry.bytes) << 2;
                answer[4..].copy_from_slice(&entry.value.to_le_bytes());
                // What is beyond the size is undefined.
                answer[4 + usize::from(entry.bytes)..].fill(0xee);
                None
            }),
            (0x23 | 0x27 | 0x2b | 0x2f, Ok(value)) => {
                answer[0] = 0x60;
                let bytes = 4 - (command >> 2 & 3);
                self.write(index, *sub, bytes, u32::from_le_bytes(value))
                    .map(|()| Some((index, *sub)))
            }
            _ => Err(abort::COMMAND),
        };
        match result {
            Ok(written) => (answer, written),
            Err(code) => {
                answer[0] = 0x80;
                answer[4..].copy_from_slice(&code.to_le_bytes());
                (answer, None)
            }
        }
    }

    fn write(&mut self, index: u16, sub: u8, bytes: u8, value: u32) -> Result<(), u32> {
        let entry = *self.entry(index, sub)?;
        if !entry.writable {
            return Err(abort::READ_ONLY);
        }
        if entry.bytes != bytes {
            return Err(abort::LENGTH);
        }
        if matches!(index, 0x1600 | 0x1a00) {
            self.check_mapping(index, sub, value)?;
        }
        self.set(index, sub, value);
        Ok(())
    }

    /// A mapping changes only while its PDO is off and it has no entries; objects must be there
    /// with the length that is told, and fit into 8 bytes.
    fn check_mapping(&self, index: u16, sub: u8, value: u32) -> Result<(), u32> {
        let communication = index - 0x200;
        if self.get(communication, 1) >> 31 == 0 {
            return Err(abort::UNSUPPORTED);
        }
        if sub == 0 {
            let count = u8::try_from(value).map_err(|_| abort::RANGE)?;
            let bits = (1..=count).map(|sub| self.get(index, sub) & 0xff);
            return if bits.sum::<u32>() > 64 {
                Err(abort::MAPPING_TOO_LONG)
            } else {
                Ok(())
            };
        }
        if self.get(index, 0) != 0 {
            return Err(abort::UNSUPPORTED);
        }
        let mapped = ((value >> 16) as u16, (value >> 8) as u8);
        match self.entries.get(&mapped) {
            Some(entry) if u32::from(entry.bytes) * 8 == value & 0xff => Ok(()),
            _ => Err(abort::NOT_MAPPABLE),
        }
    }

    /// Entries of a PDO's mapping with their lengths in bytes.
    pub(crate) fn mapping(&self, index: u16) -> Vec<(u16, u8, usize)> {
        (1..=self.get(index, 0) as u8)
            .map(|sub| {
                let entry = self.get(index, sub);
                let bytes = (entry & 0xff) as usize / 8;
                ((entry >> 16) as u16, (entry >> 8) as u8, bytes)
            })
            .collect()
    }
}
