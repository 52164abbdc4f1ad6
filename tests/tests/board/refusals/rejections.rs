//! Trajectories that may not run on this machine: every reason, with the place and the number.

use std::collections::BTreeSet;

use stillpoint::device::{Session, Transport};
use stillpoint_firmware::bench::AXES;
use stillpoint_firmware::{Refusal, Rejection};
use stillpoint_shared::assembly::{AssemblyError, Outline};
use stillpoint_shared::protocol::{Block, Request};
use stillpoint_shared::status::{Limit, Quantity};
use stillpoint_shared::{Limits, TrajectoryError};

use super::super::bench::{first_rad, paper};
use super::{POINTS, changed, name, refusal, rejected, throughout, variants, with_value};

fn is_at_axis_1(rejection: &Rejection, wanted: Quantity) -> bool {
    match *rejection {
        Rejection::NotFinite { at, quantity }
        | Rejection::Jump { at, quantity, .. }
        | Rejection::NotStill { at, quantity, .. } => at.axis == 1 && quantity == wanted,
        _ => false,
    }
}

/// Uploads a trajectory with a value that no builder takes, under the hash that its bytes then have.
fn upload_raw<T: Transport>(session: &mut Session<T>, node: usize, value: f32) -> Refusal {
    let sound = throughout(Quantity::Torque, 0.0);
    let mut values = sound.coefficients().to_vec();
    values[node * 3 * AXES + 2 * AXES + 1] = value;
    let mut outline = Outline::of(&sound);
    // The board says which hash it finds.
    loop {
        session
            .order(&Request::UploadBegin(outline.clone()))
            .unwrap();
        for (block, values) in (0..).zip(values.chunks(128)) {
            let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            let tag = outline.tag();
            let values = &bytes;
            let block = Request::UploadBlock(Block { tag, block, values });
            session.order(&block).unwrap();
        }
        let content_hash = outline.content_hash;
        let commit = Request::UploadCommit { content_hash };
        match refusal(session.order(&commit).unwrap_err()) {
            Refusal::Upload(AssemblyError::Trajectory(TrajectoryError::ContentHash {
                stored,
                computed,
            })) => {
                assert_eq!(stored, content_hash);
                outline.content_hash = computed;
            }
            refusal => return refusal,
        }
    }
}

/// Every reason of acceptance, with the place and the number.
pub(super) fn rejections<T: Transport>(session: &mut Session<T>) {
    let (limits, trajectory) = paper();
    let mut seen = BTreeSet::new();
    let mut limits_seen = BTreeSet::new();
    let mut see = |rejection: Rejection, fits: bool| {
        assert!(fits, "{rejection:?}");
        seen.insert(name(&rejection));
        if let Rejection::Exceeds { limit, .. } = rejection {
            limits_seen.insert(name(&limit));
        }
    };
    // What is loaded stays loaded, whatever is refused afterwards.
    session.upload(trajectory, |_| {}).unwrap();

    let two = Limits::new(&limits.axes()[..2]).unwrap();
    let found = rejected(session, &changed(&two, |_, _, _, _| None));
    let (trajectory_axes, machine) = (2, 3);
    let wanted = Rejection::Axes {
        trajectory: trajectory_axes,
        machine,
    };
    see(found, found == wanted);

    let mut weaker = limits.axes().to_vec();
    weaker[0].torque_nm *= 0.5;
    let weaker = Limits::new(&weaker).unwrap();
    let found = rejected(session, &changed(&weaker, |_, _, _, _| None));
    let wanted = Rejection::LimitsHash {
        trajectory: weaker.hash(),
        machine: limits.hash(),
    };
    see(found, found == wanted);

    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let Refusal::Rejected(found) = upload_raw(session, 3, value) else {
            panic!("{value} is no torque");
        };
        see(found, is_at_axis_1(&found, Quantity::Torque));
    }

    for quantity in Quantity::ALL {
        let usual = match quantity {
            Quantity::Position => f64::from(first_rad(trajectory)[1]),
            _ => 0.0,
        };
        let found = rejected(session, &with_value(POINTS, quantity, usual + 1e-3));
        let at_the_joint = matches!(found, Rejection::Jump { at, .. } if at.interval == 1);
        see(found, is_at_axis_1(&found, quantity) && at_the_joint);
    }

    let elsewhere_rad = f64::from(first_rad(trajectory)[1]) + 0.01;
    let found = rejected(session, &throughout(Quantity::Position, elsewhere_rad));
    let fits = matches!(
        found,
        Rejection::StartsElsewhere { at, measured_rad, tolerance_rad, .. }
            if at.axis == 1 && measured_rad == first_rad(trajectory)[1] && tolerance_rad == 1e-3
    );
    see(found, fits);

    for (quantity, value) in [(Quantity::Velocity, 1.0), (Quantity::Torque, 5.0)] {
        let found = rejected(session, &throughout(quantity, value));
        see(found, is_at_axis_1(&found, quantity));
    }

    // The limits, each by a value just beyond it that no other one forbids.
    let axis = limits.axes()[1];
    let speed = f64::from(axis.speed_rad_per_s);
    let knee = f64::from(axis.knee_speed_rad_per_s);
    let half_way = 0.5 * (knee + speed);
    let available = f64::from(axis.available_torque_nm(half_way as f32));
    let torque = f64::from(axis.torque_nm);
    let fast_and_strong = |velocity: f64, torque: f64| {
        changed(limits, |_, _, q, a| match q {
            Quantity::Velocity if a == 1 => Some(velocity),
            Quantity::Torque if a == 1 => Some(torque),
            _ => None,
        })
    };
    // From nothing to this in two nodes of 10 ms: far too fast.
    let steep = with_value(4, Quantity::Torque, 0.5 * torque);
    for (trajectory, wanted) in [
        (fast_and_strong(1.01 * speed, 0.0), Limit::Speed),
        (fast_and_strong(0.0, -1.01 * torque), Limit::Torque),
        (
            fast_and_strong(half_way, 1.01 * available),
            Limit::TorqueSpeed,
        ),
        (steep, Limit::TorqueRate),
    ] {
        let found = rejected(session, &trajectory);
        let fits = matches!(
            found,
            Rejection::Exceeds { at, limit, value, allowed }
                if at.axis == 1 && limit == wanted && value.abs() > allowed
        );
        see(found, fits);
    }
    assert_eq!(seen, variants("Rejection"));
    assert_eq!(limits_seen, variants("Limit"));
    let loaded = session.status().unwrap().loaded;
    assert_eq!(loaded, Some(trajectory.header().content_hash));
}
