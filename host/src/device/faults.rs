//! Which faults a bad line has, and how often.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// Probabilities of faults per frame, in each direction.
///
/// As text: `5%` for all kinds, or `drop=5%,corrupt=0.1%,seed=7`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Faults {
    /// The frame is lost.
    pub drop: f64,
    /// The frame comes twice.
    pub duplicate: f64,
    /// The frame comes after the next one.
    pub reorder: f64,
    /// A byte is changed.
    pub corrupt: f64,
    /// The frame comes later, by up to `longest_delay`.
    pub delay: f64,
    /// The rest of the frame is lost from some byte on, its end included: it runs into the next one.
    pub cut: f64,
    /// Longest delay.
    pub longest_delay: Duration,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl Faults {
    /// Every kind with the same probability; delays of up to 300 ms.
    pub const fn each(probability: f64, seed: u64) -> Self {
        Self {
            drop: probability,
            duplicate: probability,
            reorder: probability,
            corrupt: probability,
            delay: probability,
            cut: probability,
            longest_delay: Duration::from_millis(300),
            seed,
        }
    }

    /// None.
    pub const NONE: Self = Self::each(0.0, 0);
}

/// Why a text names no faults.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{text}` names no faults: give a probability for all, such as 5%, or some of \
     drop=, duplicate=, reorder=, corrupt=, delay=, cut=, seed=, separated by commas"
)]
pub struct FaultsError {
    /// The part that is not understood.
    pub text: String,
}

impl FromStr for Faults {
    type Err = FaultsError;

    fn from_str(text: &str) -> Result<Self, FaultsError> {
        if let Some(probability) = probability(text) {
            return Ok(Self::each(probability, 1));
        }
        let mut faults = Self {
            seed: 1,
            ..Self::NONE
        };
        for part in text.split(',') {
            let wrong = || FaultsError {
                text: part.to_owned(),
            };
            let (name, value) = part.trim().split_once('=').ok_or_else(wrong)?;
            if name == "seed" {
                faults.seed = value.parse().map_err(|_| wrong())?;
                continue;
            }
            let place = match name {
                "drop" => &mut faults.drop,
                "duplicate" => &mut faults.duplicate,
                "reorder" => &mut faults.reorder,
                "corrupt" => &mut faults.corrupt,
                "delay" => &mut faults.delay,
                "cut" => &mut faults.cut,
                _ => return Err(wrong()),
            };
            *place = probability(value).ok_or_else(wrong)?;
        }
        Ok(faults)
    }
}

/// `5%` or `0.05`, from 0 to 1.
fn probability(text: &str) -> Option<f64> {
    let text = text.trim();
    let value = match text.strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().ok()? / 100.0,
        None => text.parse().ok()?,
    };
    (0.0..=1.0).contains(&value).then_some(value)
}

/// How many faults of each kind there were, both directions together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Injected {
    /// Frames that came by.
    pub frames: u64,
    /// Lost.
    pub dropped: u64,
    /// Doubled.
    pub duplicated: u64,
    /// Overtaken by the next one.
    pub reordered: u64,
    /// Changed.
    pub corrupted: u64,
    /// Late.
    pub delayed: u64,
    /// Cut.
    pub cut: u64,
}

impl fmt::Display for Injected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "of {} frames {} lost, {} doubled, {} overtaken, {} damaged, {} late, {} cut",
            self.frames,
            self.dropped,
            self.duplicated,
            self.reordered,
            self.corrupted,
            self.delayed,
            self.cut
        )
    }
}
