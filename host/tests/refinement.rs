//! Moves planned on a mesh that is refined as their file asks.

use stillpoint::movefile::{LimitsAt, MoveFile};
use stillpoint::nlp::Pounce;
use stillpoint::plan::{Plan, Shortfall, plan};
use stillpoint_shared::trajectory::MAX_INTERVALS;

const AXIS: &str = include_str!("../moves/axis.toml");

/// The elastic axis with a coarse first mesh, limits at the points.
fn planned(mesh: &str) -> Plan {
    let first = format!("intervals = 5\npoints = 5\n{mesh}");
    let text = AXIS.replace("intervals = 10\npoints = 8", &first);
    let mut file = MoveFile::parse(&text, "axis.toml").expect("a move file");
    file.solver.limits = LimitsAt::Nodes;
    plan(&file, &Pounce, Box::new(|_, _| true)).expect("a plan")
}

#[test]
fn a_mesh_is_left_alone_unless_refinement_is_asked_for() {
    let plan = planned("refine = false");
    assert!(plan.refinement.is_none());
    assert_eq!(plan.solution.mesh.points(), 25);
}

#[test]
fn refinement_brings_the_machine_nearer_to_its_end() {
    let (coarse, fine) = (planned(""), planned("refine = true\ntolerance = 1e-4"));
    let refinement = fine.refinement.as_ref().expect("what was asked for");
    assert_eq!(refinement.shortfall, None, "{}", refinement.in_words());
    let [first, .., last] = refinement.meshes.as_slice() else {
        panic!("{refinement:?}");
    };
    assert_eq!(first.points, 25);
    assert!(first.error > 1e-4 && last.error <= 1e-4, "{refinement:?}");
    assert_eq!(last.points, fine.solution.mesh.points());
    assert!(refinement.in_words().starts_with("Refined over"));
    // The integration knows nothing of the estimate.
    let miss = |plan: &Plan| plan.end_miss.worst().map_or(0.0, |worst| worst.relative());
    assert!(
        miss(&fine) < 0.1 * miss(&coarse),
        "{} {}",
        miss(&fine),
        miss(&coarse)
    );
}

#[test]
fn refinement_ends_where_the_board_is_full() {
    let plan = planned("refine = true\ntolerance = 1e-7");
    let refinement = plan.refinement.expect("what was asked for");
    assert!(
        matches!(refinement.shortfall, Some(Shortfall::Capacity { needed, most, .. }) if needed > most),
        "{refinement:?}"
    );
    assert!(
        refinement
            .in_words()
            .starts_with("The board's capacity ends the refinement")
    );
    // What is planned on the last mesh that fits is a trajectory all the same.
    assert!(plan.solution.mesh.intervals().len() <= MAX_INTERVALS);
    assert!(refinement.meshes.len() > 1);
}
