//! Path profiles: how far along its path a move is at each time, from 0 to 1, as users would pick them.
//!
//! A quintic or a jerk-limited S-curve, and either convolved with an input shaper. The convolution of polynomials with
//! impulses is a sum of delayed polynomials, so it is exact.

use super::shaper::Shaper;

/// How a move goes from 0 to 1 in a time of 1, without a shaper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// The quintic 6s⁵ − 15s⁴ + 10s³.
    Quintic,
    /// Piecewise constant jerk: acceleration rises for an eighth of the time, holds for a quarter, turns to its opposite in
    /// another quarter, and so back to zero.
    SCurve,
}

/// Jerk of the S-curve: an acceleration of 16/3 within an eighth of the time.
const JERK: f64 = 128.0 / 3.0;
/// Where the S-curve's jerk changes, and by how much.
const JERK_STEPS: [(f64, f64); 6] = [
    (0.0, JERK),
    (0.125, -JERK),
    (0.375, -JERK),
    (0.625, JERK),
    (0.875, JERK),
    (1.0, -JERK),
];

impl Law {
    /// Times at which a piece begins or ends, ascending.
    fn breaks(self) -> Vec<f64> {
        match self {
            Self::Quintic => vec![0.0, 1.0],
            Self::SCurve => JERK_STEPS.iter().map(|(s, _)| *s).collect(),
        }
    }

    /// All breaks are multiples of one over this.
    fn parts(self) -> f64 {
        match self {
            Self::Quintic => 1.0,
            Self::SCurve => 8.0,
        }
    }

    /// Position and its first three derivatives in s, at rest outside of [0, 1].
    fn at(self, s: f64) -> [f64; 4] {
        if s <= 0.0 {
            return [0.0; 4];
        } else if s >= 1.0 {
            return [1.0, 0.0, 0.0, 0.0];
        }
        match self {
            Self::Quintic => [
                s * s * s * ((6.0 * s - 15.0) * s + 10.0),
                30.0 * s * s * (1.0 - s) * (1.0 - s),
                60.0 * s * (1.0 - s) * (1.0 - 2.0 * s),
                60.0 + 360.0 * s * (s - 1.0),
            ],
            Self::SCurve => {
                let mut sum = [0.0; 4];
                for (from, step) in JERK_STEPS.into_iter().filter(|(from, _)| *from < s) {
                    let t = s - from;
                    sum[0] += step * t * t * t / 6.0;
                    sum[1] += step * t * t / 2.0;
                    sum[2] += step * t;
                    sum[3] += step;
                }
                sum
            }
        }
    }
}

/// A law of a given duration, convolved with a shaper.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    law: Law,
    law_s: f64,
    shaper: Shaper,
}

/// Times of a profile that intervals of a trajectory can have are multiples of this: ten ticks, so that no interval is shorter.
const GRID_S: f64 = 1e-6;

impl Profile {
    /// A law that lasts `law_s` before it is shaped.
    #[must_use]
    pub fn new(law: Law, law_s: f64, shaper: Shaper) -> Self {
        Self { law, law_s, shaper }
    }

    /// The same with all its times on whole microseconds, where intervals of a trajectory can begin and end.
    #[must_use]
    pub fn on_grid(&self) -> Self {
        let parts = self.law.parts();
        Self {
            law: self.law,
            law_s: (self.law_s / (parts * GRID_S)).round().max(1.0) * parts * GRID_S,
            shaper: self.shaper.on_grid(GRID_S),
        }
    }

    /// The same with a law that lasts longer by a factor, behind the same shaper.
    #[must_use]
    pub fn slower(&self, factor: f64) -> Self {
        Self {
            law_s: self.law_s * factor,
            ..self.clone()
        }
    }

    /// Duration in all, with the shaper's.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.law_s + self.shaper.duration_s()
    }

    /// Position along the path (0 to 1) and its first three derivatives, per s, s² and s³.
    #[must_use]
    pub fn at(&self, time_s: f64) -> [f64; 4] {
        let mut sum = [0.0; 4];
        for impulse in self.shaper.impulses() {
            let part = self.law.at((time_s - impulse.delay_s) / self.law_s);
            let mut scale = impulse.share;
            for (sum, part) in sum.iter_mut().zip(part) {
                *sum += scale * part;
                scale /= self.law_s;
            }
        }
        sum
    }

    /// Times at which a piece begins or ends, ascending: between them the profile is one polynomial.
    #[must_use]
    pub fn breaks_s(&self) -> Vec<f64> {
        let law: Vec<f64> = self.law.breaks().iter().map(|s| s * self.law_s).collect();
        let starts = self.shaper.impulses().iter().map(|i| i.delay_s);
        let mut breaks: Vec<f64> = starts
            .flat_map(|start| law.iter().map(move |t| start + t))
            .collect();
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
        breaks
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::ode::{Tolerance, integrate};
    use crate::simulate::shaper::Tuning;
    use std::f64::consts::TAU;

    const LAWS: [Law; 2] = [Law::Quintic, Law::SCurve];

    fn modes() -> [Tuning; 2] {
        [(35.48, 0.0), (59.02, 0.05)].map(|(frequency_hz, damping_ratio)| Tuning {
            frequency_hz,
            damping_ratio,
        })
    }

    #[test]
    fn derivatives_and_ends_agree() {
        for law in LAWS {
            let shaper = Shaper::zv(modes()[1]).then(&Shaper::zvd(modes()[0]));
            let profile = Profile::new(law, 0.05, shaper);
            let h = 1e-6;
            let breaks = profile.breaks_s();
            for k in 1..100 {
                let t = profile.duration_s() * f64::from(k) / 100.0 + 1.3e-5;
                if breaks.iter().any(|b| (b - t).abs() < 2.0 * h) {
                    continue;
                }
                let (before, now, after) = (profile.at(t - h), profile.at(t), profile.at(t + h));
                for order in 0..3 {
                    let slope = (after[order] - before[order]) / (2.0 * h);
                    let size = 60.0 / 0.05_f64.powi(order as i32 + 1);
                    assert!(
                        (slope - now[order + 1]).abs() < 1e-4 * size,
                        "{law:?}: {order} at {t}"
                    );
                }
            }
            assert_eq!(profile.at(0.0), [0.0; 4]);
            let end = profile.at(profile.duration_s());
            assert!((end[0] - 1.0).abs() < 1e-14 && end[1..] == [0.0; 3]);
        }
    }

    /// Acceleration continuous, jerk of one magnitude or none, and as slow at the end as at the start.
    #[test]
    fn an_s_curve_is_limited_in_jerk() {
        let profile = Profile::new(Law::SCurve, 1.0, Shaper::none());
        let h = 1e-9;
        for at in profile.breaks_s() {
            let (before, after) = (profile.at(at - h), profile.at(at + h));
            assert!((before[2] - after[2]).abs() < 1e-6, "{at}");
        }
        let jerk = 128.0 / 3.0;
        for k in 0..64 {
            let t = (f64::from(k) + 0.5) / 64.0;
            let (here, mirrored) = (profile.at(t), profile.at(1.0 - t));
            assert!([0.0, jerk].iter().any(|j| (here[3].abs() - j).abs() < 1e-9));
            assert!((here[0] + mirrored[0] - 1.0).abs() < 1e-12);
            assert!((here[1] - mirrored[1]).abs() < 1e-12);
        }
    }

    #[test]
    fn on_the_grid_every_piece_begins_at_a_microsecond() {
        for law in LAWS {
            let shaper = Shaper::ei(modes()[0]).then(&Shaper::ei(modes()[1]));
            let profile = Profile::new(law, 0.051_234_567, shaper);
            let rounded = profile.on_grid();
            assert!((rounded.duration_s() - profile.duration_s()).abs() < 6e-6);
            for at in rounded.breaks_s() {
                let microseconds = at * 1e6;
                assert!((microseconds - microseconds.round()).abs() < 1e-6, "{at}");
            }
        }
    }

    /// An oscillator pushed by the profile comes to rest if, and only if, a shaper is tuned to it.
    #[test]
    fn shapers_leave_their_modes_at_rest() {
        let [undamped, damped] = modes();
        let both = Shaper::zv(undamped).then(&Shaper::zv(damped));
        let residual = |law: Law, shaper: &Shaper, mode: Tuning| {
            let profile = Profile::new(law, 0.021, shaper.clone());
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
        for (law, mode) in LAWS
            .into_iter()
            .flat_map(|law| modes().map(|mode| (law, mode)))
        {
            let alone = residual(law, &Shaper::none(), mode);
            assert!(alone > 0.1);
            assert!(residual(law, &Shaper::zv(mode), mode) < 1e-9);
            assert!(residual(law, &Shaper::zvd(mode), mode) < 1e-9);
            assert!(residual(law, &both, mode) < 1e-9);
            // Off tune by 5 %: a ZV shaper leaves something, a ZVD shaper much less.
            let off = Tuning {
                frequency_hz: 1.05 * mode.frequency_hz,
                ..mode
            };
            let (zv, zvd) = (
                residual(law, &Shaper::zv(mode), off),
                residual(law, &Shaper::zvd(mode), off),
            );
            assert!(zv > 0.01 && zvd < 0.2 * zv, "{zv} {zvd}");
            // By design an EI shaper leaves a twentieth.
            if mode.damping_ratio == 0.0 {
                let ei = residual(law, &Shaper::ei(mode), mode);
                assert!((ei / alone - 0.05).abs() < 1e-6, "{ei} {alone}");
            }
        }
    }
}
