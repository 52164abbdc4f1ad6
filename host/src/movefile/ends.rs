//! Where the move begins and ends.

use super::error::{Fault, Problem};
use super::kind::MachineKind;
use super::limits::Limits;
use super::section::Section;
use crate::simulate::modes;

/// Poses closer than this in every component (m or rad) are the same: the board's f32 cannot tell them apart.
const SAME_POSE: f64 = 1e-9;

/// Reads `from` and `to`: poses in the order of the machine's names, at which it can stand.
pub(super) fn read_ends(
    section: &Section<'_>,
    machine: &MachineKind,
) -> Result<(Vec<f64>, Vec<f64>), Box<Fault>> {
    section.only(&["from", "to"])?;
    let from = read_pose(section, "from", machine)?;
    let to = read_pose(section, "to", machine)?;
    if from.iter().zip(&to).all(|(a, b)| (a - b).abs() < SAME_POSE) {
        return Err(Fault::new(section.bytes("to"), Problem::NoMove));
    }
    let pairs = machine.regularities(&from).into_iter();
    for ((what, before), (_, after)) in pairs.zip(machine.regularities(&to)) {
        if before * after <= 0.0 {
            return Err(Fault::new(
                section.bytes("to"),
                Problem::SingularBetween {
                    what,
                    before,
                    after,
                },
            ));
        }
    }
    Ok((from, to))
}

fn read_pose(
    section: &Section<'_>,
    end: &'static str,
    machine: &MachineKind,
) -> Result<Vec<f64>, Box<Fault>> {
    let Some(table) = section.table(end)? else {
        // Reports the missing key.
        return section.value(end);
    };
    let names = machine.plant().pose_names();
    table.only(names)?;
    let mut pose = Vec::with_capacity(names.len());
    for name in names {
        let value: f64 = table.value(name)?;
        if !value.is_finite() {
            return Err(Fault::new(
                table.bytes(name),
                Problem::Value {
                    key: (*name).into(),
                    value,
                    rule: "must be a finite number".into(),
                },
            ));
        }
        pose.push(value);
    }
    let place = section.bytes(end);
    machine
        .check_pose(&pose)
        .map_err(|source| Fault::new(place.clone(), Problem::Pose { end, source }))?;
    let plant = machine.plant();
    let rest = plant.rest(&pose);
    let still = vec![0.0; plant.coordinate_count()];
    let moves = plant.forward(&rest, &still, &vec![0.0; plant.axis_count()]);
    let outputs_known = plant.output_values(&rest).iter().all(|x| x.is_finite());
    let angles_known = plant.joint_angles(&rest).iter().all(|x| x.is_finite());
    if moves.is_none() || !outputs_known || !angles_known {
        return Err(Fault::new(place, Problem::Singular { end }));
    }
    match modes::undriven_hz(plant, &rest) {
        Ok(None) => {}
        Ok(Some(frequency_hz)) => {
            return Err(Fault::new(place, Problem::NeverStill { end, frequency_hz }));
        }
        Err(_) => return Err(Fault::new(place, Problem::Singular { end })),
    }
    Ok(pose)
}

/// A limit that the machine breaks by merely standing at an end makes every move impossible.
pub(super) fn check_limits_at_ends(
    section: &Section<'_>,
    machine: &MachineKind,
    limits: &Limits,
    ends: [(&'static str, &[f64]); 2],
) -> Result<(), Box<Fault>> {
    let plant = machine.plant();
    for (end, pose) in ends {
        let values = plant.output_values(&plant.rest(pose));
        for ((output, value), limit) in plant.outputs().iter().zip(values).zip(&limits.outputs) {
            match *limit {
                Some(limit) if value.abs() > limit => {
                    return Err(Fault::new(
                        section.bytes(end),
                        Problem::LimitAtEnd {
                            end,
                            output: output.key,
                            value,
                            limit,
                            unit: output.unit,
                        },
                    ));
                }
                _ => {}
            }
        }
    }
    Ok(())
}
