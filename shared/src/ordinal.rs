//! People count from 1, code and wire from 0.

/// The number by which people know an axis or interval of this index: one more.
pub fn ordinal(index: impl Into<usize>) -> usize {
    index.into().saturating_add(1)
}
