//! Input shapers: lists of impulses that a mode of vibration answers with nothing, or nearly so.

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

    /// Extra insensitivity: a mode of exactly this frequency keeps 5 % of its vibration, and one within 20 % of it not much
    /// more. Singhose, Seering, Singer, "Residual vibration reduction using vector diagrams to generate shaped inputs",
    /// Journal of Mechanical Design 116 (1994): exact without damping; with it, impulses shrink as those of ZVD do.
    #[must_use]
    pub fn ei(mode: Tuning) -> Self {
        const LEFT: f64 = 0.05;
        let zvd = Self::zvd(mode);
        // Those of ZVD are 1/4, 1/2, 1/4.
        let factors = [1.0 + LEFT, 1.0 - LEFT, 1.0 + LEFT];
        let mut impulses = zvd.impulses;
        for (impulse, factor) in impulses.iter_mut().zip(factors) {
            impulse.share *= factor;
        }
        let whole: f64 = impulses.iter().map(|impulse| impulse.share).sum();
        for impulse in &mut impulses {
            impulse.share /= whole;
        }
        Self { impulses }
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

    /// The same with all delays rounded to multiples of `step_s`.
    #[must_use]
    pub fn on_grid(&self, step_s: f64) -> Self {
        let mut rounded = self.clone();
        for impulse in &mut rounded.impulses {
            impulse.delay_s = (impulse.delay_s / step_s).round() * step_s;
        }
        rounded
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

#[cfg(test)]
mod tests {
    use super::{Shaper, TAU, Tuning};

    /// What a mode without damping keeps of its vibration: |Σ Aₖ exp(iωtₖ)|.
    fn kept(shaper: &Shaper, frequency_hz: f64) -> f64 {
        let sum = |part: fn(f64) -> f64| -> f64 {
            let angle = |delay_s: f64| TAU * frequency_hz * delay_s;
            let impulses = shaper.impulses().iter();
            impulses.map(|i| i.share * part(angle(i.delay_s))).sum()
        };
        sum(f64::cos).hypot(sum(f64::sin))
    }

    /// Width of the band of frequencies, over the tuned one, in which no more than 5 % is kept.
    fn insensitivity(shaper: &Shaper) -> f64 {
        let inside = (0..20_000).filter(|k| kept(shaper, f64::from(*k) * 1e-4) <= 0.05);
        inside.count() as f64 * 1e-4
    }

    /// The figures that the literature gives, such as Singhose, "Command shaping for flexible systems: a review of the
    /// first 50 years" (2009): 0.06, 0.29 and 0.40.
    #[test]
    fn insensitivities_are_the_published_ones() {
        let mode = Tuning {
            frequency_hz: 1.0,
            damping_ratio: 0.0,
        };
        let published = [
            (Shaper::zv(mode), 0.06),
            (Shaper::zvd(mode), 0.29),
            (Shaper::ei(mode), 0.40),
        ];
        for (shaper, expected) in published {
            let found = insensitivity(&shaper);
            assert!((found - expected).abs() < 0.005, "{found} {expected}");
            let whole: f64 = shaper.impulses().iter().map(|i| i.share).sum();
            assert!((whole - 1.0).abs() < 1e-15);
        }
        assert!((kept(&Shaper::ei(mode), 1.0) - 0.05).abs() < 1e-12);
        assert_eq!(Shaper::ei(mode).duration_s(), 1.0);
    }
}
