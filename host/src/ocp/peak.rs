//! Where the polynomials of a solution come nearest to their limits, or exceed them.

use super::problem::{Bounds, OptimalControlProblem};
use super::sample::{Limited, Sample};
use super::solution::{Place, Solution};

/// Places looked at in an interval, per collocation point; extremes are found between them.
const PLACES_PER_POINT: usize = 6;

/// Parabolas that an extreme is found with.
const PARABOLAS: usize = 3;

/// A local extreme of a limited quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Index of the interval.
    pub interval: usize,
    /// Local coordinate in [−1, 1].
    pub local: f64,
    /// What is limited.
    pub limited: Limited,
    /// By how much it exceeds its bounds, as a share of [`Bounds::size`]; negative inside.
    pub excess: f64,
}

/// The polynomials of a solution, with those through the path function's values at the nodes.
///
/// A path function has two courses between the nodes: that polynomial, which is shipped where the board plays it, and
/// the function of the interpolated states, which is what the planned machine does. Limits hold for both.
pub struct Courses<'a> {
    problem: &'a OptimalControlProblem,
    solution: &'a Solution,
    /// Values of the path function at the support points, one after the other.
    path: Vec<f64>,
    /// Whether a path function depends on the control, so that it has no value at an interval's end.
    on_points: Vec<bool>,
}

impl<'a> Courses<'a> {
    /// Of a solution of a problem.
    #[must_use]
    pub fn new(problem: &'a OptimalControlProblem, solution: &'a Solution) -> Self {
        let sizes = problem.sizes;
        let mut values = vec![0.0; sizes.stage_values()];
        let mut path = Vec::with_capacity(solution.states.ncols() * sizes.path);
        for node in 0..solution.states.ncols() {
            let mut z: Vec<f64> = solution.states.column(node).iter().copied().collect();
            if node < solution.controls.ncols() {
                z.extend(solution.controls.column(node).iter());
            }
            z.resize(sizes.stage_variables(), 0.0);
            problem.stage.values(&z, &mut values);
            path.extend_from_slice(&values[sizes.states..sizes.states + sizes.path]);
        }
        Self {
            problem,
            solution,
            path,
            on_points: (0..sizes.path)
                .map(|row| problem.path_needs_control(row))
                .collect(),
        }
    }

    /// Collocation points of an interval.
    pub(crate) fn points(&self, interval: usize) -> usize {
        self.solution.rules[interval].points()
    }

    /// States, controls and the two courses of the path function at a place.
    fn at(&self, place: Place) -> At {
        let sizes = self.problem.sizes;
        let states = self.solution.state_at(place);
        let controls = self.solution.control_at(place);
        let mut values = vec![0.0; sizes.stage_values()];
        let z: Vec<f64> = states.iter().chain(&controls).copied().collect();
        self.problem.stage.values(&z, &mut values);
        let (of_states, of_controls) = self.solution.bases(place);
        let through = |basis: &[f64], row: usize| -> f64 {
            let nodes = basis.iter().zip(place.first_point..);
            nodes
                .map(|(l, node)| l * self.path[node * sizes.path + row])
                .sum()
        };
        let through_nodes = (0..sizes.path).map(|row| {
            let basis = if self.on_points[row] {
                &of_controls
            } else {
                &of_states
            };
            through(basis, row)
        });
        At {
            path_through_nodes: through_nodes.collect(),
            slopes: (0..sizes.path)
                .map(|row| through(&of_controls, row))
                .collect(),
            path: values[sizes.states..sizes.states + sizes.path].to_vec(),
            states,
            controls,
        }
    }

    /// All local extremes beyond `above`, in every interval, of all that is limited.
    #[must_use]
    pub fn peaks(&self, above: f64) -> Vec<Peak> {
        let mut found = Vec::new();
        let mut first_point = 0;
        for (interval, rule) in self.solution.rules.iter().enumerate() {
            let count = PLACES_PER_POINT * rule.points();
            // Chebyshev's extreme points: dense at both ends, where polynomials overshoot.
            let locals: Vec<f64> = (0..=count)
                .map(|k| -(std::f64::consts::PI * k as f64 / count as f64).cos())
                .collect();
            let courses: Vec<At> = locals
                .iter()
                .map(|&local| {
                    self.at(Place {
                        interval,
                        first_point,
                        local,
                    })
                })
                .collect();
            for limited in self.problem.limited() {
                let bounds = self.problem.bounds_of(limited);
                let excesses: Vec<f64> = courses
                    .iter()
                    .map(|at| at.excess(limited, bounds))
                    .collect();
                let at = |local| {
                    let place = Place {
                        interval,
                        first_point,
                        local,
                    };
                    self.at(place).excess(limited, bounds)
                };
                let tops = extremes(&locals, &excesses, above, at);
                found.extend(tops.map(|(local, excess)| Peak {
                    interval,
                    local,
                    limited,
                    excess,
                }));
            }
            first_point += rule.points();
        }
        found
    }

    /// The sample that holds a quantity inside its bounds at a place. For a path function they are drawn in by what the
    /// function of the interpolated states differs there from the polynomial through the nodes.
    #[must_use]
    pub fn sample(&self, interval: usize, local: f64, limited: Limited) -> Sample {
        let mut bounds = self.problem.bounds_of(limited);
        if let Limited::Path(row) = limited {
            let first_point = self.solution.rules[..interval]
                .iter()
                .map(|r| r.points())
                .sum();
            let at = self.at(Place {
                interval,
                first_point,
                local,
            });
            // Where they have nothing to do with each other yet, some room must be left.
            let most = bounds.size() / 2.0;
            let difference = (at.path[row] - at.path_through_nodes[row]).clamp(-most, most);
            bounds.lower -= difference.min(0.0);
            bounds.upper -= difference.max(0.0);
        }
        Sample {
            interval,
            local,
            limited,
            bounds,
        }
    }
}

/// Everything at one place.
struct At {
    states: Vec<f64>,
    controls: Vec<f64>,
    path_through_nodes: Vec<f64>,
    slopes: Vec<f64>,
    path: Vec<f64>,
}

impl At {
    fn excess(&self, limited: Limited, bounds: Bounds) -> f64 {
        match limited {
            Limited::State(i) => bounds.excess(self.states[i]),
            Limited::Control(i) => bounds.excess(self.controls[i]),
            Limited::Slope(i) => bounds.excess(self.slopes[i]),
            Limited::Path(i) => bounds
                .excess(self.path[i])
                .max(bounds.excess(self.path_through_nodes[i])),
        }
    }
}

/// Place and height of the local maxima beyond `above` of a function of which values are known at some places.
fn extremes<'a>(
    places: &'a [f64],
    values: &'a [f64],
    above: f64,
    at: impl Fn(f64) -> f64 + 'a,
) -> impl Iterator<Item = (f64, f64)> + 'a {
    let last = values.len() - 1;
    (0..=last).filter_map(move |k| {
        let value = values[k];
        let highest = (k == 0 || values[k - 1] < value) && (k == last || values[k + 1] <= value);
        if !highest {
            return None;
        }
        let top = if k == 0 || k == last {
            (places[k], value)
        } else {
            top([k - 1, k, k + 1].map(|i| (places[i], values[i])), &at)
        };
        (top.1 > above).then_some(top)
    })
}

/// Top of a function around three places, of which the middle one is the highest: again and again where the parabola through the
/// best three has its own. Far below the margins after two steps; one alone is off by as much as they are wide.
fn top(mut best: [(f64, f64); 3], at: impl Fn(f64) -> f64) -> (f64, f64) {
    for _ in 0..PARABOLAS {
        let [left, middle, right] = best;
        let x = parabola(best);
        if x == middle.0 {
            break;
        }
        let new = (x, at(x));
        let (lower, higher) = if new.1 > middle.1 {
            (middle, new)
        } else {
            (new, middle)
        };
        best = if lower.0 < higher.0 {
            [lower, higher, right]
        } else {
            [left, higher, lower]
        };
    }
    best[1]
}

/// Where the parabola through three points, of which the middle one is the highest, has its top.
fn parabola([(x0, y0), (x1, y1), (x2, y2)]: [(f64, f64); 3]) -> f64 {
    let (left, right) = ((y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1));
    let curvature = (right - left) / (x2 - x0);
    if curvature >= 0.0 {
        return x1;
    }
    let slope = left + curvature * (x1 - x0);
    x1 - slope / (2.0 * curvature)
}

#[cfg(test)]
mod tests {
    use super::{Courses, Limited, extremes};
    use crate::movefile::{MoveFile, PAPER_MOVE};
    use crate::ocp::{Mesh, Transcription};
    use crate::plan::{move_problem, quintic_guess};
    use std::sync::Arc;

    /// However far the function of the interpolated states is from the polynomial through the nodes, a sample leaves room.
    #[test]
    fn bounds_are_never_drawn_in_past_each_other() {
        let file = MoveFile::parse(PAPER_MOVE, "paper.toml").expect("the paper's move");
        let problem = Arc::new(move_problem(&file));
        let guess = quintic_guess(&file, 0.05);
        let program = Transcription::new(Arc::clone(&problem), Mesh::uniform(2, 10), &guess);
        let mut solution = program.solution(&program.unknowns(&guess));
        // Curvatures that swing from node to node: the displacements that follow are far from any polynomial.
        for (node, mut states) in solution.states.column_iter_mut().enumerate() {
            for curvature in 6..9 {
                states[curvature] = if node % 2 == 0 { 3.0 } else { -3.0 };
            }
        }
        let courses = Courses::new(&problem, &solution);
        let mut drawn_in = 0.0_f64;
        for row in 0..problem.sizes.path {
            let whole = problem.path[row].bounds;
            for step in 0..=40 {
                let sample = courses.sample(1, f64::from(step) / 20.0 - 1.0, Limited::Path(row));
                let left = sample.bounds.upper - sample.bounds.lower;
                assert!(
                    left >= 0.749 * (whole.upper - whole.lower),
                    "{row}: {sample:?}"
                );
                drawn_in = drawn_in.max(1.0 - left / (whole.upper - whole.lower));
            }
        }
        // The case is hard enough to need the cap.
        assert!(drawn_in > 0.249, "{drawn_in}");
    }

    #[test]
    fn tops_of_parabolas_and_ends() {
        // 1 − (x − 0.3)² has its top between the places; a rising line at its end.
        let places = [-1.0, -0.4, 0.1, 0.45, 1.0];
        let bow_at = |x: f64| 1.0 - (x - 0.3) * (x - 0.3);
        let bow = places.map(bow_at);
        let found: Vec<_> = extremes(&places, &bow, 0.0, bow_at).collect();
        assert_eq!(found.len(), 1);
        assert!(
            (found[0].0 - 0.3).abs() < 1e-12 && (found[0].1 - 1.0).abs() < 1e-12,
            "{found:?}"
        );
        let line: Vec<_> = extremes(&places, &places, 0.0, |x| x).collect();
        assert_eq!(line, [(1.0, 1.0)]);
        assert_eq!(extremes(&places, &bow, 1.1, bow_at).count(), 0);
    }
}
