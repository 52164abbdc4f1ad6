//! Path profiles: how far along its path a move is at each time, from 0 to 1, as users would pick them.
//!
//! A quintic, and the quintic convolved with an input shaper: a list of impulses that a mode of vibration answers with
//! nothing. The convolution of a polynomial with impulses is a sum of delayed polynomials, so it is exact.

use std::f64::consts::TAU;

/// A mode that a shaper is tuned to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tuning {
    /// Undamped natural frequency.
    pub frequency_hz: f64,
    /// Damping as ratio of critical, below 1.
    pub damping_ratio: f64,
}

/// One impulse of a shaper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impulse {
    /// Time after the first impulse.
    pub delay_s: f64,
    /// Share of the whole; the shares of a shaper add up to 1.
    pub share: f64,
}

/// An input shaper: impulses in the order of time, the first at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Shaper {
    impulses: Vec<Impulse>,
}

impl Shaper {
    /// Leaves the profile as it is.
    #[must_use]
    pub fn none() -> Self {
        Self {
            impulses: vec![Impulse {
                delay_s: 0.0,
                share: 1.0,
            }],
        }
    }

    /// Zero vibration of one mode: two impulses half a damped period apart, the second smaller by what the mode loses
    /// meanwhile, K = exp(−ζπ/√(1 − ζ²)).
    #[must_use]
    pub fn zv(mode: Tuning) -> Self {
        let root = (1.0 - mode.damping_ratio.powi(2)).sqrt();
        let loss = (-mode.damping_ratio * TAU / 2.0 / root).exp();
        let delay_s = 0.5 / (mode.frequency_hz * root);
        let share = 1.0 / (1.0 + loss);
        Self {
            impulses: vec![
                Impulse {
                    delay_s: 0.0,
                    share,
                },
                Impulse {
                    delay_s,
                    share: 1.0 - share,
                },
            ],
        }
    }

    /// Zero vibration and zero derivative with respect to the frequency: ZV twice.
    #[must_use]
    pub fn zvd(mode: Tuning) -> Self {
        Self::zv(mode).then(&Self::zv(mode))
    }

    /// Both shapers one after the other, which cancels the modes of both.
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        let mut impulses: Vec<Impulse> = self
            .impulses
            .iter()
            .flat_map(|a| {
                next.impulses.iter().map(|b| Impulse {
                    delay_s: a.delay_s + b.delay_s,
                    share: a.share * b.share,
                })
            })
            .collect();
        impulses.sort_by(|a, b| a.delay_s.total_cmp(&b.delay_s));
        impulses.dedup_by(|later, earlier| {
            let same = later.delay_s == earlier.delay_s;
            if same {
                earlier.share += later.share;
            }
            same
        });
        Self { impulses }
    }

    /// The impulses.
    #[must_use]
    pub fn impulses(&self) -> &[Impulse] {
        &self.impulses
    }

    /// How much longer a move becomes.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.impulses.last().map_or(0.0, |last| last.delay_s)
    }
}

/// A quintic 6s⁵ − 15s⁴ + 10s³ of `quintic_s`, convolved with a shaper.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    quintic_s: f64,
    shaper: Shaper,
}

impl Profile {
    /// A quintic that lasts `quintic_s` before it is shaped.
    #[must_use]
    pub fn new(quintic_s: f64, shaper: Shaper) -> Self {
        Self { quintic_s, shaper }
    }

    /// Duration in all, with the shaper's.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.quintic_s + self.shaper.duration_s()
    }

    /// Position along the path (0 to 1) and its first three derivatives, per s, s² and s³.
    #[must_use]
    pub fn at(&self, time_s: f64) -> [f64; 4] {
        let mut sum = [0.0; 4];
        for impulse in self.shaper.impulses() {
            let part = quintic((time_s - impulse.delay_s) / self.quintic_s);
            let mut scale = impulse.share;
            for (sum, part) in sum.iter_mut().zip(part) {
                *sum += scale * part;
                scale /= self.quintic_s;
            }
        }
        sum
    }

    /// Times at which a piece begins or ends, ascending: between them the profile is one polynomial.
    #[must_use]
    pub fn breaks_s(&self) -> Vec<f64> {
        let starts = self.shaper.impulses().iter().map(|i| i.delay_s);
        let mut breaks: Vec<f64> = starts.flat_map(|t| [t, t + self.quintic_s]).collect();
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
        breaks
    }
}

/// The quintic and its derivatives in s, at rest outside of [0, 1].
fn quintic(s: f64) -> [f64; 4] {
    if s <= 0.0 {
        [0.0; 4]
    } else if s >= 1.0 {
        [1.0, 0.0, 0.0, 0.0]
    } else {
        [
            s * s * s * ((6.0 * s - 15.0) * s + 10.0),
            30.0 * s * s * (1.0 - s) * (1.0 - s),
            60.0 * s * (1.0 - s) * (1.0 - 2.0 * s),
            60.0 + 360.0 * s * (s - 1.0),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::ode::{Tolerance, integrate};

    fn modes() -> [Tuning; 2] {
        [(35.48, 0.0), (59.02, 0.05)].map(|(frequency_hz, damping_ratio)| Tuning {
            frequency_hz,
            damping_ratio,
        })
    }

    #[test]
    fn derivatives_and_ends_agree() {
        let profile = Profile::new(0.05, Shaper::zv(modes()[1]).then(&Shaper::zvd(modes()[0])));
        let h = 1e-6;
        for k in 1..100 {
            let t = profile.duration_s() * f64::from(k) / 100.0 + 1.3e-5;
            let (before, now, after) = (profile.at(t - h), profile.at(t), profile.at(t + h));
            for order in 0..3 {
                let slope = (after[order] - before[order]) / (2.0 * h);
                let size = 60.0 / 0.05_f64.powi(order as i32 + 1);
                assert!(
                    (slope - now[order + 1]).abs() < 1e-4 * size,
                    "{order} at {t}"
                );
            }
        }
        assert_eq!(profile.at(0.0), [0.0; 4]);
        let end = profile.at(profile.duration_s());
        assert!((end[0] - 1.0).abs() < 1e-14 && end[1..] == [0.0; 3]);
    }

    /// An oscillator pushed by the profile comes to rest if, and only if, a shaper is tuned to it.
    #[test]
    fn shapers_leave_their_modes_at_rest() {
        let [undamped, damped] = modes();
        let both = Shaper::zv(undamped).then(&Shaper::zv(damped));
        let residual = |shaper: &Shaper, mode: Tuning| {
            let profile = Profile::new(0.021, shaper.clone());
            let omega = TAU * mode.frequency_hz;
            let f = |t: f64, x: &[f64], slope: &mut [f64]| {
                let push = omega * omega * (profile.at(t)[0] - x[0]);
                slope.copy_from_slice(&[x[1], push - 2.0 * mode.damping_ratio * omega * x[1]]);
                Some(())
            };
            let tolerance = Tolerance {
                relative: 1e-12,
                scale: vec![1.0, omega],
            };
            let end = integrate(f, (0.0, profile.duration_s()), &[0.0; 2], &tolerance, &[])
                .expect("smooth")
                .end;
            (end[0] - 1.0).hypot(end[1] / omega)
        };
        for mode in modes() {
            assert!(residual(&Shaper::none(), mode) > 0.1);
            assert!(residual(&Shaper::zv(mode), mode) < 1e-9);
            assert!(residual(&Shaper::zvd(mode), mode) < 1e-9);
            assert!(residual(&both, mode) < 1e-9);
            // Off tune by 5 %: a ZV shaper leaves something, a ZVD shaper much less.
            let off = Tuning {
                frequency_hz: 1.05 * mode.frequency_hz,
                ..mode
            };
            let (zv, zvd) = (
                residual(&Shaper::zv(mode), off),
                residual(&Shaper::zvd(mode), off),
            );
            assert!(zv > 0.01 && zvd < 0.2 * zv, "{zv} {zvd}");
        }
    }
}
