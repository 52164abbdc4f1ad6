//! Values from postcard's bytes.
//!
//! Postcard's deserializer on a source of bytes that a compiler for size sees through: with its own
//! one, a board's image would be larger, and not free of panics.

use postcard::de_flavors::Flavor;
use postcard::{Deserializer, Error, Result};
use serde::Deserialize;

/// A value from the front of `bytes`, and the bytes left over.
pub fn take<'b, T: Deserialize<'b>>(bytes: &'b [u8]) -> Result<(T, &'b [u8])> {
    let mut deserializer = Deserializer::from_flavor(Bytes(bytes));
    let value = T::deserialize(&mut deserializer)?;
    Ok((value, deserializer.finalize()?))
}

/// The value at the front of `bytes`.
pub fn front<'b, T: Deserialize<'b>>(bytes: &'b [u8]) -> Result<T> {
    take(bytes).map(|(value, _)| value)
}

/// Bytes not read yet.
struct Bytes<'b>(&'b [u8]);

impl<'b> Flavor<'b> for Bytes<'b> {
    type Remainder = &'b [u8];
    type Source = &'b [u8];

    fn pop(&mut self) -> Result<u8> {
        let (&first, rest) = self
            .0
            .split_first()
            .ok_or(Error::DeserializeUnexpectedEnd)?;
        self.0 = rest;
        Ok(first)
    }

    // So that the length is seen to be the one asked for.
    #[inline(always)]
    fn try_take_n(&mut self, count: usize) -> Result<&'b [u8]> {
        let (taken, rest) = self
            .0
            .split_at_checked(count)
            .ok_or(Error::DeserializeUnexpectedEnd)?;
        self.0 = rest;
        Ok(taken)
    }

    #[inline(always)]
    fn try_take_n_temp<'a>(&'a mut self, count: usize) -> Result<&'a [u8]>
    where
        'b: 'a,
    {
        self.try_take_n(count)
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.0.len())
    }

    fn finalize(self) -> Result<&'b [u8]> {
        Ok(self.0)
    }
}
