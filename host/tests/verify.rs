//! `stillpoint verify`: a certificate is believed only if it can be computed again.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use stillpoint::certify::{Coordinates, Limited, Proof, certify};
use stillpoint::movefile::MoveFile;
use stillpoint::simulate::trajectory::board_limits;
use stillpoint::sptfile::{Section, SectionError, SptFile};
use stillpoint_shared::{Trajectory, TrajectoryBuilder, lgr};

const AXIS: &str = include_str!("../moves/axis.toml");

fn file() -> MoveFile {
    MoveFile::parse(AXIS, "axis.toml").expect("a move")
}

/// The axis pushes against its brake with `torque_nm` (1 − x²)² for a second and twists by a little.
fn push(torque_nm: f64) -> (Trajectory, Section) {
    const POINTS: usize = 6;
    let file = file();
    let plant = file.machine.plant();
    let mut nodes = [0.0; POINTS + 1];
    lgr::support_nodes(&mut nodes).unwrap();
    let bell = |x: f64| (1.0 - x * x).powi(2);
    let mut builder = TrajectoryBuilder::new(1, &board_limits(&file.limits, plant).unwrap());
    let rows = nodes.map(|x| [0.0, 0.0, torque_nm * bell(x)]);
    builder
        .interval(10_000_000, POINTS, rows.as_flattened())
        .unwrap();
    let trajectory = builder.finish().unwrap();
    let values = nodes.map(|x| [0.0, 0.01 * bell(x) as f32]);
    let coordinates = Coordinates {
        count: 2,
        values: values.as_flattened().to_vec(),
    };
    let certificate = certify(&trajectory, &coordinates, &file.limits, plant).unwrap();
    let section = Section {
        coordinates,
        certificate,
        remarks: Vec::new(),
    };
    (trajectory, section)
}

fn encoded(trajectory: &Trajectory, section: Option<&Section>) -> Vec<u8> {
    let mut buffer = vec![0; 4096];
    let mut bytes = trajectory.encode(&mut buffer).unwrap().to_vec();
    bytes.extend(section.map(Section::encode).unwrap_or_default());
    bytes
}

/// Runs the command on a file with these bytes and this move file.
fn verify(name: &str, bytes: &[u8], move_text: &str, json: bool) -> Output {
    let folder: PathBuf = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("verify-{name}"));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("m.spt"), bytes).unwrap();
    std::fs::write(folder.join("m.toml"), move_text).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_stillpoint"));
    command.args(["verify", "m.spt", "--move", "m.toml"]);
    if json {
        command.arg("--json");
    }
    command.current_dir(&folder).output().unwrap()
}

/// Fails with this status and a sentence that has these words in it.
fn refused(name: &str, bytes: &[u8], move_text: &str, status: &str, words: &str) {
    let output = verify(name, bytes, move_text, true);
    assert_eq!(output.status.code(), Some(1), "{name}");
    let object: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(object["status"], status, "{name}: {object}");
    let message = object["message"].as_str().unwrap();
    assert!(message.contains(words), "{name}: {message}");
    let output = verify(name, bytes, move_text, false);
    assert_eq!(output.status.code(), Some(1), "{name}");
    assert!(
        String::from_utf8_lossy(&output.stderr).contains(words),
        "{name}"
    );
}

#[test]
fn a_good_file_is_verified() {
    let (trajectory, section) = push(19.9);
    let bytes = encoded(&trajectory, Some(&section));
    let output = verify("good", &bytes, AXIS, false);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    for words in [
        "torque rate of axis 1",
        "twist_rad",
        "19.9000",
        "Certified: every limit holds",
    ] {
        assert!(table.contains(words), "{words} is not in\n{table}");
    }
    let output = verify("good", &bytes, AXIS, true);
    let object: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(object["status"], "certified");
    let proofs = object["proofs"].as_array().unwrap();
    let torque = proofs
        .iter()
        .find(|proof| proof["limited"] == "Torque")
        .unwrap();
    // The largest value lies between the nodes, in the middle; the values are f32.
    let bound = torque["bound"].as_f64().unwrap();
    assert!((19.9 - 1e-5..19.9 + 1e-4).contains(&bound), "{bound}");
    assert!((torque["time_s"].as_f64().unwrap() - 0.5).abs() < 1e-3);
}

/// Words of the refusal, and what is wrong.
type Change<'a> = (&'a str, fn(&mut Proof));

#[test]
fn every_reason_not_to_believe_has_its_sentence() {
    let (trajectory, section) = push(19.9);
    let (other, _) = push(19.8);
    let good = encoded(&trajectory, Some(&section));
    let alone = encoded(&trajectory, None);
    refused(
        "missing",
        &alone,
        AXIS,
        "no-certificate",
        "has no certificate",
    );
    let foreign = encoded(&other, Some(&section));
    refused(
        "foreign",
        &foreign,
        AXIS,
        "other-trajectory",
        "belongs to trajectory",
    );
    let limits = AXIS.replace("twist_rad = 0.05", "twist_rad = 0.06");
    refused(
        "limits",
        &good,
        &limits,
        "other-limits",
        "those of the move file are",
    );
    let axis_limits = AXIS.replace("torque_nm = 20.0", "torque_nm = 21.0");
    refused(
        "axis-limits",
        &good,
        &axis_limits,
        "other-limits",
        "those of the move file are",
    );

    let mut flipped = good.clone();
    let last = flipped.len() - 20;
    flipped[last] ^= 1;
    refused("flipped", &flipped, AXIS, "damaged", "check sum");
    refused(
        "short",
        &good[..good.len() - 1],
        AXIS,
        "damaged",
        "bytes, it should have",
    );
    let tail = [&alone[..], b"more"].concat();
    refused("tail", &tail, AXIS, "damaged", "is no certificate");
    let mut newer = good.clone();
    newer[alone.len() + 4] = 9;
    refused("newer", &newer, AXIS, "damaged", "version 9");

    let (too_much, its_own) = push(20.001);
    let bytes = encoded(&too_much, Some(&its_own));
    refused(
        "beyond",
        &bytes,
        AXIS,
        "not-certified",
        "torque of axis 1 reaches 20.0010",
    );
    let mut forged = section.clone();
    forged.certificate.proofs[0].bound *= 0.9;
    forged.certificate.proofs[2].bound *= 0.9;
    let bytes = encoded(&trajectory, Some(&forged));
    refused("forged", &bytes, AXIS, "differs", "computed anew");
    // Each figure of it, wrong by itself; the limits' hash is left as it was.
    let changes: [Change<'_>; 5] = [
        ("as limit of torque of axis 1", |proof| proof.limit = 25.0),
        ("as bound of torque of axis 1", |proof| proof.bound -= 0.01),
        ("as largest value reached of torque", |proof| {
            proof.reached = 5.0
        }),
        ("as largest value played of torque", |proof| {
            proof.played = Some(19.0)
        }),
        ("as bound in the interval named of torque", |proof| {
            proof.interval = 1
        }),
    ];
    for (words, change) in changes {
        let mut wrong = section.clone();
        let mut proofs = wrong.certificate.proofs.iter_mut();
        change(
            proofs
                .find(|proof| proof.limited == Limited::Torque)
                .unwrap(),
        );
        let bytes = encoded(&trajectory, Some(&wrong));
        refused("wrong", &bytes, AXIS, "differs", words);
    }
    // A twist that is not the plan's any more.
    let mut moved = section.clone();
    moved.coordinates.values[7] *= 1.5;
    let bytes = encoded(&trajectory, Some(&moved));
    refused("moved", &bytes, AXIS, "differs", "twist_rad");
}

#[test]
fn a_trajectory_file_of_any_age_is_read_and_a_damaged_section_leaves_the_trajectory() {
    let (trajectory, section) = push(10.0);
    let old = SptFile::decode(&encoded(&trajectory, None)).unwrap();
    assert_eq!(old.trajectory, trajectory);
    assert_eq!(old.section, Err(SectionError::Missing));
    let good = encoded(&trajectory, Some(&section));
    let read = SptFile::decode(&good).unwrap();
    assert_eq!(read.trajectory, trajectory);
    let mut kept = read.section.unwrap();
    kept.certificate
        .proofs
        .iter_mut()
        .zip(&section.certificate.proofs)
        .for_each(|(kept, own)| {
            // What is not stored.
            kept.intervals.clone_from(&own.intervals);
        });
    assert_eq!(kept, section);
    let start = encoded(&trajectory, None).len();
    for position in start..good.len() {
        let mut bytes = good.clone();
        bytes[position] ^= 0x10;
        let read = SptFile::decode(&bytes).unwrap();
        assert_eq!(read.trajectory, trajectory);
        assert!(read.section.is_err(), "byte {position}");
    }
}
