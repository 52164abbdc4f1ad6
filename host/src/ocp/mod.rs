//! Optimal control: the problem in continuous time, and its transcription by multi-interval LGR collocation.

mod guess;
pub mod lgr;
mod mechanical;
mod mesh;
mod model;
mod peak;
mod problem;
mod sample;
mod scaling;
mod solution;
mod transcription;

pub use guess::{Guess, Point};
pub use mechanical::{Mechanical, PathRow};
pub use mesh::{Interval, Mesh};
pub use model::{Exact, Model};
pub use peak::{Courses, Peak};
pub use problem::{Bounds, Differentiable, OptimalControlProblem, Quantity, Sizes, Structure};
pub use sample::{Limited, Sample};
pub use scaling::Scaling;
pub use solution::Solution;
pub use transcription::{CollocationNlp, Hamiltonian, RowMeaning, Transcription, VariableMeaning};
