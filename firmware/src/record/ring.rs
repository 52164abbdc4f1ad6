//! The newest samples.

use super::sample::RawSample;

/// The newest N samples.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(super) struct Ring<const N: usize, const AXES: usize> {
    pub(super) samples: [RawSample<AXES>; N],
    /// Where the next one goes: the oldest.
    pub(super) next: u16,
}

impl<const N: usize, const AXES: usize> Ring<N, AXES> {
    pub(super) const EMPTY: Self = Self {
        samples: [RawSample::EMPTY; N],
        next: 0,
    };

    #[inline]
    pub(super) fn push(&mut self, sample: &RawSample<AXES>) {
        let place = usize::from(self.next);
        // After a reset `next` may be anything.
        let place = if place < N { place } else { 0 };
        if let Some(oldest) = self.samples.get_mut(place) {
            *oldest = *sample;
        }
        self.next = (if place + 1 < N { place + 1 } else { 0 }) as u16;
    }

    /// Whole samples, oldest first.
    pub(super) fn iter(&self) -> impl Iterator<Item = &RawSample<AXES>> {
        let (newer, older) = self
            .samples
            .split_at_checked(usize::from(self.next))
            .unwrap_or((&[], &self.samples));
        older.iter().chain(newer).filter(|sample| sample.is_whole())
    }
}
