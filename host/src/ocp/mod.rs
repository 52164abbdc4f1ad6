//! Optimal control: the problem in continuous time, and its transcription by multi-interval LGR collocation.

mod answer;
mod arcs;
mod costate;
mod driven;
mod guess;
pub mod lgr;
mod mechanical;
mod mesh;
mod model;
mod motion;
mod parts;
mod peak;
mod problem;
mod refine;
mod sample;
mod scaling;
mod solution;
mod squares;
mod transcription;

pub use answer::Answer;
pub use arcs::{BangArc, BangBang, Optimality, Side, bang_bang};
pub use costate::{Costates, HamiltonianAt};
pub use driven::Driven;
pub use guess::{Guess, Point};
pub use mechanical::{Mechanical, PathRow};
pub use mesh::{Interval, Mesh};
pub use model::{Exact, Model};
pub use parts::{Part, Parts};
pub use peak::{Courses, Peak};
pub use problem::{Bounds, Differentiable, OptimalControlProblem, Quantity, Sizes, Structure};
pub use refine::{Judgement, MeshRecord, RefineEnd, RefineSettings, Refined, judge, refine};
pub use sample::{Limited, Sample};
pub use scaling::Scaling;
pub use solution::Solution;
pub use squares::{Affine, Squares};
pub use transcription::{CollocationNlp, Hamiltonian, RowMeaning, Transcription, VariableMeaning};
