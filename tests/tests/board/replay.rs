//! What the board should have sent: the same executor on this computer, and the planned path in double precision.

use nalgebra::SVector;
use stillpoint_firmware::bench::{AXES, BenchDrives, TickRecord, rows};
use stillpoint_firmware::{Config, Machine, State, TickInputs};
use stillpoint_shared::Trajectory;
use stillpoint_shared::lgr;

use super::bench::{first_rad, paper, start_request};

/// Plays the paper's move on this computer, with the same orders at the same ticks as on the board, and compares every
/// tick to the bit. `seen` begins when the drives are switched on. Returns the number of ticks of the move.
pub(super) fn compare(seen: &[TickRecord]) -> usize {
    let (limits, trajectory) = paper();
    let at = SVector::from(first_rad(trajectory));
    let mut drives = BenchDrives::<AXES>::at(&at);
    let mut machine = Box::new(Machine::<AXES>::new(limits.clone(), Config::default()).unwrap());
    machine.tick(&mut drives, &TickInputs::default());
    machine.executor.load(trajectory, &at).unwrap();
    machine.executor.arm().unwrap();
    let mut last = State::Armed;
    let mut moved = 0;
    for (record, before) in seen
        .iter()
        .zip([None].into_iter().chain(seen.iter().map(Some)))
    {
        if let Some(before) = before {
            assert_eq!(record.tick, before.tick + 1, "a tick is missing");
        }
        if (last, record.state) == (State::Armed, State::Running) {
            machine.executor.start(&start_request()).unwrap();
        }
        let report = machine.tick(&mut drives, &TickInputs::default());
        assert_eq!(
            (report.state, report.path_ticks),
            (record.state, record.path_ticks)
        );
        let bits = |rows: [[f32; 3]; AXES]| rows.map(|row| row.map(f32::to_bits));
        assert_eq!(
            record.sent.map(bits),
            Some(bits(rows(*report.setpoints))),
            "tick {}, path {}",
            record.tick,
            record.path_ticks
        );
        moved += usize::from(record.state == State::Running);
        last = record.state;
    }
    moved
}

/// Position in rad of every axis at a path time, by Lagrange's formula on the coefficients as they are, in double
/// precision, and the largest magnitude of each in its interval.
pub(super) fn planned_position(trajectory: &Trajectory, path_ticks: u32) -> [(f64, f64); AXES] {
    let interval = trajectory
        .intervals()
        .find(|interval| path_ticks <= interval.start_ticks + interval.duration_ticks)
        .unwrap();
    let mut nodes = vec![0.0; interval.points + 1];
    lgr::support_nodes(&mut nodes).unwrap();
    let elapsed = f64::from(path_ticks - interval.start_ticks);
    let x = 2.0 * elapsed / f64::from(interval.duration_ticks) - 1.0;
    let cardinal = |j: usize| -> f64 {
        let others = (0..nodes.len()).filter(|k| *k != j);
        others
            .map(|k| (x - nodes[k]) / (nodes[j] - nodes[k]))
            .product()
    };
    let cardinals: Vec<f64> = (0..nodes.len()).map(cardinal).collect();
    std::array::from_fn(|axis| {
        let values = interval.coefficients.chunks(3 * AXES);
        let values: Vec<f64> = values.map(|row| f64::from(row[axis])).collect();
        let position = values.iter().zip(&cardinals).map(|(v, c)| v * c).sum();
        let largest = values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        (position, largest)
    })
}
