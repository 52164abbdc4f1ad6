//! A line that fails on purpose: for tests, and for people who want to see what a bad line does.
//!
//! Each frame, in each direction, meets each kind of fault with its own probability, independently; the same seed gives
//! the same faults.

use super::faults::{Faults, Injected};
use super::transport::{Transport, TransportError};
use std::collections::VecDeque;
use std::time::Duration;

/// SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014).
#[derive(Clone, Debug)]
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform on [0, 1).
    fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn happens(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }
}

/// One direction of the line.
#[derive(Debug, Default)]
struct Lane {
    /// Bytes of a frame that has not ended yet.
    begun: Vec<u8>,
    /// A frame that waits for the next one to overtake it, at most until some time.
    held: Option<(Duration, Vec<u8>)>,
    /// Frames on their way and when they arrive, in the order they were sent.
    under_way: VecDeque<(Duration, Vec<u8>)>,
}

impl Lane {
    /// Takes bytes at one end.
    fn put(&mut self, bytes: &[u8], now: Duration, line: &mut Troubles) {
        for &byte in bytes {
            self.begun.push(byte);
            if byte == 0 {
                let frame = std::mem::take(&mut self.begun);
                self.carry(frame, now, line);
            }
        }
    }

    fn carry(&mut self, mut frame: Vec<u8>, now: Duration, line: &mut Troubles) {
        let Troubles {
            faults,
            random,
            injected,
        } = line;
        // A zero alone is no frame.
        if frame.len() == 1 {
            self.under_way.push_back((now, frame));
            return;
        }
        injected.frames += 1;
        if random.happens(faults.corrupt) {
            let place = random.below(frame.len());
            frame[place] ^= 1 << random.below(8);
            injected.corrupted += 1;
        }
        if random.happens(faults.cut) {
            frame.truncate(random.below(frame.len()));
            injected.cut += 1;
        }
        let copies = if random.happens(faults.drop) {
            injected.dropped += 1;
            0
        } else if random.happens(faults.duplicate) {
            injected.duplicated += 1;
            2
        } else {
            1
        };
        let overtaken = self.held.take();
        for _ in 0..copies {
            let mut arrival = now;
            if random.happens(faults.delay) {
                injected.delayed += 1;
                arrival += faults.longest_delay.mul_f64(random.unit());
            }
            if overtaken.is_none() && self.held.is_none() && random.happens(faults.reorder) {
                injected.reordered += 1;
                self.held = Some((arrival + faults.longest_delay, frame.clone()));
            } else {
                self.under_way.push_back((arrival, frame.clone()));
            }
        }
        if let Some((_, frame)) = overtaken {
            self.under_way.push_back((now, frame));
        }
    }

    /// Takes what has arrived at the other end.
    fn take(&mut self, now: Duration, mut give: impl FnMut(&[u8])) {
        if let Some((_, frame)) = self.held.take_if(|(latest, _)| *latest <= now) {
            self.under_way.push_back((now, frame));
        }
        self.under_way.retain(|(arrival, frame)| {
            let arrived = *arrival <= now;
            if arrived {
                give(frame);
            }
            !arrived
        });
    }

    /// When the next frame arrives, as far as it is known.
    fn next(&self) -> Option<Duration> {
        let held = self.held.iter().map(|(latest, _)| *latest);
        self.under_way
            .iter()
            .map(|(arrival, _)| *arrival)
            .chain(held)
            .min()
    }
}

#[derive(Debug)]
struct Troubles {
    faults: Faults,
    random: Random,
    injected: Injected,
}

/// A transport that fails on purpose.
#[derive(Debug)]
pub struct Faulty<T> {
    inner: T,
    troubles: Troubles,
    to_board: Lane,
    to_host: Lane,
    arrived: VecDeque<u8>,
}

impl<T: Transport> Faulty<T> {
    /// Puts faults on a way to a board.
    pub fn new(inner: T, faults: Faults) -> Self {
        Self {
            inner,
            troubles: Troubles {
                faults,
                random: Random(faults.seed),
                injected: Injected::default(),
            },
            to_board: Lane::default(),
            to_host: Lane::default(),
            arrived: VecDeque::new(),
        }
    }

    /// The way without faults.
    pub fn inner(&self) -> &T {
        &self.inner
    }

    /// The way without faults.
    pub fn inner_mut(&mut self) -> &mut T {
        &mut self.inner
    }

    /// How many faults there were.
    pub fn injected(&self) -> Injected {
        self.troubles.injected
    }

    /// Changes the faults from now on; the random numbers go on.
    pub fn set_faults(&mut self, faults: Faults) {
        self.troubles.faults = faults;
    }

    /// Moves what has arrived at either end.
    fn turn(&mut self) -> Result<(), TransportError> {
        let now = self.inner.now();
        let mut bytes = Vec::new();
        self.to_board
            .take(now, |frame| bytes.extend_from_slice(frame));
        if !bytes.is_empty() {
            self.inner.send(&bytes)?;
        }
        self.to_host.take(now, |frame| self.arrived.extend(frame));
        Ok(())
    }
}

impl<T: Transport> Transport for Faulty<T> {
    fn send(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        let now = self.inner.now();
        self.to_board.put(bytes, now, &mut self.troubles);
        self.turn()
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        let deadline = self.inner.now() + timeout;
        loop {
            self.turn()?;
            let now = self.inner.now();
            if !self.arrived.is_empty() || now >= deadline {
                break;
            }
            let next = [self.to_board.next(), self.to_host.next()];
            let until = next.into_iter().flatten().fold(deadline, Duration::min);
            let mut bytes = [0; 1024];
            let count = self.inner.receive(&mut bytes, until.saturating_sub(now))?;
            let now = self.inner.now();
            self.to_host.put(&bytes[..count], now, &mut self.troubles);
        }
        let count = buffer.len().min(self.arrived.len());
        for (place, byte) in buffer.iter_mut().zip(self.arrived.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }

    fn reconnect(&mut self) -> Result<(), TransportError> {
        self.inner.reconnect()
    }
}
