//! Sessions with a simulated board, on good and on bad lines.

mod line;
mod moves;
mod ports;
mod script;
mod uploads;

use super::{Faults, Faulty, Session, Settings, Simulated};
use std::time::Duration;
use stillpoint_shared::{AxisLimits, Limits, Trajectory, TrajectoryBuilder, lgr};

const AXES: usize = 2;
const START_RAD: [f64; AXES] = [0.25, -1.0];

fn limits() -> Limits {
    let axis = AxisLimits {
        torque_nm: 100.0,
        torque_rate_nm_per_s: 20_000.0,
        speed_rad_per_s: 20.0,
        knee_speed_rad_per_s: 15.0,
        slope_nm_s_per_rad: 10.0,
    };
    Limits::new(&[axis; AXES]).unwrap()
}

/// A quintic from rest to rest over so far, in four intervals of 12 points: 312 values, three blocks.
fn quintic(id: u32, reach_rad: f64) -> Trajectory {
    const INTERVALS: usize = 4;
    const POINTS: usize = 12;
    const INTERVAL_TICKS: u32 = 200_000;
    let mut nodes = [0.0; POINTS + 1];
    lgr::support_nodes(&mut nodes).unwrap();
    let duration_s = f64::from(INTERVALS as u32 * INTERVAL_TICKS) * 1e-7;
    let mut builder = TrajectoryBuilder::new(id, &limits());
    for interval in 0..INTERVALS {
        let mut rows = Vec::new();
        for node in nodes {
            let s = (interval as f64 + (node + 1.0) / 2.0) / INTERVALS as f64;
            let position = s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s);
            let velocity = 30.0 * s * s * (1.0 - s).powi(2) / duration_s;
            let torque = 6.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / duration_s.powi(2);
            rows.extend(START_RAD.map(|start| start + reach_rad * position));
            rows.extend([reach_rad * velocity; AXES]);
            rows.extend([reach_rad * torque; AXES]);
        }
        builder.interval(INTERVAL_TICKS, POINTS, &rows).unwrap();
    }
    builder.finish().unwrap()
}

fn board() -> Simulated<AXES> {
    Simulated::new(Some(limits()), START_RAD.map(|rad| rad as f32)).unwrap()
}

fn settings(seed: u64) -> Settings {
    Settings {
        seed,
        ..Settings::default()
    }
}

type Line = Faulty<Simulated<AXES>>;

/// A session over a line that is good for the greeting.
fn session(seed: u64) -> Session<Line> {
    Session::open(
        Faulty::new(
            board(),
            Faults {
                seed,
                ..Faults::NONE
            },
        ),
        settings(seed),
    )
    .unwrap()
}

fn loaded(session: &Session<Line>) -> &Trajectory {
    session.transport().inner().machine.executor.trajectory()
}

const A_MOMENT: Duration = Duration::from_millis(10);
