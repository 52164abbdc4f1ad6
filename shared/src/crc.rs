//! The two check sums, four bits at a time: with 16 entries the tables of both take 192 bytes of a
//! board's flash, where those for whole bytes take 3 kB, and the `crc` crate without tables 0.5 kB more.

/// CRC-32/ISO-HDLC, bit-reversed polynomial.
const POLYNOMIAL_32: u32 = 0xedb8_8320;

/// CRC-64/XZ, bit-reversed polynomial.
const POLYNOMIAL_64: u64 = 0xc96c_5795_d787_0f42;

static TABLE_32: [u32; 16] = {
    let mut table = [0; 16];
    let mut index = 0;
    while index < 16 {
        table[index] = table_entry(index as u64, POLYNOMIAL_32 as u64) as u32;
        index += 1;
    }
    table
};

static TABLE_64: [u64; 16] = {
    let mut table = [0; 16];
    let mut index = 0;
    while index < 16 {
        table[index] = table_entry(index as u64, POLYNOMIAL_64);
        index += 1;
    }
    table
};

/// What four bits become that are shifted out.
const fn table_entry(mut bits: u64, polynomial: u64) -> u64 {
    let mut shifted = 0;
    while shifted < 4 {
        bits = bits >> 1 ^ if bits & 1 == 1 { polynomial } else { 0 };
        shifted += 1;
    }
    bits
}

/// CRC-32/ISO-HDLC of bytes that come in pieces.
#[derive(Debug, Clone, Copy)]
pub struct Crc32(u32);

impl Default for Crc32 {
    fn default() -> Self {
        Self::new()
    }
}

impl Crc32 {
    /// No bytes yet.
    pub const fn new() -> Self {
        Self(!0)
    }

    /// Adds a piece.
    #[inline(never)]
    pub const fn update(&mut self, mut piece: &[u8]) {
        while let Some((&byte, rest)) = piece.split_first() {
            self.0 ^= byte as u32;
            self.0 = TABLE_32[(self.0 & 15) as usize] ^ self.0 >> 4;
            self.0 = TABLE_32[(self.0 & 15) as usize] ^ self.0 >> 4;
            piece = rest;
        }
    }

    /// The check sum.
    pub const fn sum(self) -> u32 {
        !self.0
    }

    /// The check sum of these bytes.
    pub const fn of(bytes: &[u8]) -> u32 {
        let mut crc = Self::new();
        crc.update(bytes);
        crc.sum()
    }
}

/// CRC-64/XZ of bytes that come in pieces.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Crc64(u64);

impl Crc64 {
    pub(crate) const fn new() -> Self {
        Self(!0)
    }

    #[inline(never)]
    pub(crate) fn update(&mut self, piece: &[u8]) {
        for &byte in piece {
            self.0 ^= u64::from(byte);
            self.0 = TABLE_64[(self.0 & 15) as usize] ^ self.0 >> 4;
            self.0 = TABLE_64[(self.0 & 15) as usize] ^ self.0 >> 4;
        }
    }

    pub(crate) const fn sum(self) -> u64 {
        !self.0
    }
}
