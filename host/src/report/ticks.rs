//! Where an axis is marked, and how the marks are written.

/// Marks of an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ticks {
    /// Positions in data units.
    pub(super) at: Vec<f64>,
    /// Labels, in the same order.
    pub(super) labels: Vec<String>,
    /// Power of ten that the labels leave out; 0 for none.
    pub(super) exponent: i32,
}

impl Ticks {
    /// Marks on `low..=high`, at multiples of 1, 2 or 5 times a power of ten: the smallest such step that gives at most
    /// `most` steps.
    pub(super) fn new(low: f64, high: f64, most: usize) -> Self {
        let raw = (high - low) / most.max(1) as f64;
        let (step, power) = round_up(raw);
        let first = (low / step - 1e-9).ceil();
        // A narrow range may lie between two marks and have none.
        let steps = (high / step + 1e-9).floor() - first;
        let count = (steps + 1.0).clamp(0.0, 50.0) as usize;
        let at: Vec<f64> = (0..count).map(|i| (first + i as f64) * step).collect();
        let largest = low.abs().max(high.abs());
        let exponent = match largest.log10().floor() as i32 {
            e @ (-2..=4) => e.clamp(0, 0),
            e => e,
        };
        let decimals = usize::try_from(exponent - power).unwrap_or(0).min(12);
        let labels = at
            .iter()
            .map(|x| minus(&format!("{:.decimals$}", x / 10_f64.powi(exponent))))
            .collect();
        Self {
            at,
            labels,
            exponent,
        }
    }

    /// The power of ten that belongs into the axis' title: `×10⁻⁴ `, or nothing.
    pub(super) fn factor(&self) -> String {
        if self.exponent == 0 {
            return String::new();
        }
        let digits = self.exponent.to_string();
        let raised = digits.chars().map(|c| match c.to_digit(10) {
            Some(d) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][d as usize],
            None => '⁻',
        });
        format!("×10{} ", raised.collect::<String>())
    }
}

/// The next of 1, 2, 5 × 10ᵏ, and k.
fn round_up(raw: f64) -> (f64, i32) {
    let power = raw.log10().floor() as i32;
    let unit = 10_f64.powi(power);
    for factor in [1.0, 2.0, 5.0] {
        if factor * unit >= raw * (1.0 - 1e-9) {
            return (factor * unit, power);
        }
    }
    (10.0 * unit, power + 1)
}

/// A number with a true minus sign, and no sign on zero.
pub(super) fn minus(number: &str) -> String {
    match number.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => number.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::Ticks;
    use proptest::prelude::*;

    fn labels(low: f64, high: f64) -> Vec<String> {
        Ticks::new(low, high, 6).labels
    }

    #[test]
    fn steps_are_one_two_five() {
        assert_eq!(
            labels(0.0, 0.06),
            ["0.00", "0.01", "0.02", "0.03", "0.04", "0.05", "0.06"]
        );
        assert_eq!(labels(-157.0, 157.0), ["−100", "0", "100"]);
        assert_eq!(labels(0.0, 0.4), ["0.0", "0.1", "0.2", "0.3", "0.4"]);
        let small = Ticks::new(-3.3e-4, 3.8e-4, 5);
        assert_eq!(small.labels, ["−2", "0", "2"]);
        assert_eq!(small.factor(), "×10⁻⁴ ");
        let large = Ticks::new(0.0, 355e6, 4);
        assert_eq!(
            (large.labels.join(" "), large.factor()),
            ("0 1 2 3".into(), "×10⁸ ".into())
        );
    }

    proptest! {
        /// Few, in range, evenly spaced, all told apart by their labels.
        #[test]
        fn the_tick_law(low in -1e9_f64..1e9, span in 1e-6_f64..1e9, most in 2_usize..10) {
            let high = low + span;
            prop_assume!(high - low > 1e-6 * low.abs());
            let ticks = Ticks::new(low, high, most);
            let step = match ticks.at[..] {
                [a, b, ..] => b - a,
                _ => span,
            };
            prop_assert!(ticks.at.len() <= most + 1);
            prop_assert!(ticks.at.len() >= most / 5);
            let slack = 1e-6 * span + 1e-9 * low.abs();
            for (i, x) in ticks.at.iter().enumerate() {
                prop_assert!(*x >= low - slack && *x <= high + slack);
                prop_assert!((x - ticks.at[0] - i as f64 * step).abs() <= slack);
            }
            for pair in ticks.labels.windows(2) {
                prop_assert_ne!(&pair[0], &pair[1]);
            }
        }
    }
}
