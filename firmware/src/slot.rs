//! An `Option` whose empty value is all zero bytes.
//!
//! The executor holds two trajectory buffers. As long as all of its initial bytes are zero, a
//! static one lies in memory that is zeroed at reset; a single byte of another value would put all
//! of them into flash. `Option` marks `None` by a value that its content does not take, often not
//! zero.

/// A value that may be there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slot<T> {
    full: bool,
    value: T,
}

impl<T: Copy> Slot<T> {
    /// Nothing; `zero` is never seen.
    pub(crate) const fn empty(zero: T) -> Self {
        Self {
            full: false,
            value: zero,
        }
    }

    #[inline]
    pub(crate) fn get(&self) -> Option<&T> {
        self.full.then_some(&self.value)
    }

    #[inline]
    pub(crate) fn put(&mut self, value: T) {
        self.full = true;
        self.value = value;
    }

    /// Keeps a value that could be had, in place and without the detour by an `Option`, which costs
    /// a copy.
    #[inline]
    pub(crate) fn keep<E>(&mut self, result: Result<T, E>) -> Option<&T> {
        match result {
            Ok(value) => {
                self.put(value);
                Some(&self.value)
            }
            Err(_) => {
                self.empty_out();
                None
            }
        }
    }

    #[inline]
    pub(crate) fn empty_out(&mut self) {
        self.full = false;
    }
}
