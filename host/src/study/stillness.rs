//! Whether a move stays still enough on every machine that its file holds possible.

use super::sweep::outcome;
use crate::machine::Change;
use crate::movefile::MoveFile;
use std::fmt;
use stillpoint_shared::Trajectory;

/// A machine within the declared uncertainty on which too much is left.
#[derive(Clone, Debug, PartialEq)]
pub struct Loss {
    /// The parameter.
    pub parameter: String,
    /// By which factor it is off.
    pub factor: f64,
    /// What is left in SI units, and in words; or why the move does not get to its end.
    pub left: Result<(f64, String), String>,
    /// What may be left, in the same unit.
    pub allowed: f64,
}

/// Shares of an uncertainty that are tried, both ways.
const SHARES: [f64; 4] = [-1.0, -0.5, 0.5, 1.0];

/// The worst machine of every uncertain parameter that leaves more than the move file allows, played by the executor on the
/// simulated drives; one parameter at a time.
#[must_use]
pub fn lost_stillness(file: &MoveFile, trajectory: &Trajectory) -> Vec<Loss> {
    let Some(uncertainty) = &file.uncertainty else {
        return Vec::new();
    };
    let real = file.drive.real_machine(&file.machine);
    let tries: Vec<(&str, f64)> = (uncertainty.parameters.iter())
        .flat_map(|(parameter, share)| SHARES.map(|part| (parameter.as_str(), 1.0 + part * share)))
        .collect();
    let losses = super::parallel::in_parallel(&tries, |&(parameter, factor)| {
        let machine = real.changed(parameter, Change::Factor(factor)).ok()?;
        let left = outcome(file, trajectory, &machine, &file.drive)
            .map(|outcome| {
                let metrics = outcome.metrics;
                (metrics.residual(), metrics.residual_in_words())
            })
            .map_err(|error| error.to_string());
        let loss = Loss {
            parameter: parameter.to_owned(),
            factor,
            left,
            allowed: uncertainty.residual,
        };
        (loss.size() > loss.allowed).then_some(loss)
    });
    let mut worst: Vec<Loss> = Vec::new();
    for loss in losses.into_iter().flatten() {
        match worst
            .iter_mut()
            .find(|known| known.parameter == loss.parameter)
        {
            Some(known) if known.size() < loss.size() => *known = loss,
            Some(_) => {}
            None => worst.push(loss),
        }
    }
    worst
}

impl Loss {
    /// What is left; infinite where the move is stopped.
    fn size(&self) -> f64 {
        self.left.as_ref().map_or(f64::INFINITY, |(left, _)| *left)
    }
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = (self.factor - 1.0) * 100.0;
        write!(f, "with {} {percent:+.3} %, ", self.parameter)?;
        match &self.left {
            Ok((left, words)) => write!(
                f,
                "{words} is left after the move, {:.1} times what is allowed",
                left / self.allowed
            )?,
            Err(why) => write!(f, "the move does not get to its end ({why})")?,
        }
        f.write_str(
            ": know that parameter better, or plan for it with a [robust] table (docs/robust.md)",
        )
    }
}

#[cfg(test)]
mod tests {
    use super::lost_stillness;
    use crate::baseline::{Baseline, plan_baseline};
    use crate::movefile::{MoveFile, PAPER_MOVE};

    /// Near its frequency a ZVD shaper forgives, a ZV shaper does not.
    #[test]
    fn the_worst_machine_within_the_uncertainty_is_named() {
        let axis = include_str!("../../moves/axis.toml");
        let losses = |name: &str, uncertainty: &str| {
            let text = axis.to_owned() + "\n[machine.uncertainty]\n" + uncertainty;
            let file = MoveFile::parse(&text, "axis.toml").expect("a move");
            let plan = plan_baseline(&file, Baseline::named(name).expect(name));
            lost_stillness(&file, &plan.expect(name).trajectory)
        };
        let allowed = "load_inertia_kg_m2 = 0.1\nresidual_displacement_rad = 5e-3\n";
        assert!(losses("quintic+zvd", allowed).is_empty());
        let lost = losses("quintic+zv", allowed);
        let [loss] = &lost[..] else {
            panic!("one parameter: {lost:?}");
        };
        assert_eq!(loss.parameter, "load_inertia_kg_m2");
        assert!((loss.factor - 1.0).abs() > 0.09);
        let words = loss.to_string();
        for part in ["load_inertia_kg_m2", "10", "rad", "[robust]"] {
            assert!(words.contains(part), "{words}");
        }
        let paper = MoveFile::parse(PAPER_MOVE, "paper.toml").expect("paper");
        assert_eq!(paper.uncertainty, None);
    }
}
