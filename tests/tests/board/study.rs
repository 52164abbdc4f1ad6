//! The demo's move on the emulated board, and what that board logs.

use std::time::Instant;

use stillpoint::device::{LogError, LogImage, qemu};
use stillpoint::movefile::{MoveFile, PAPER_MOVE};
use stillpoint::study::{Step, play, play_on_board};
use stillpoint_firmware::State;

use super::bench::{Bench, PATIENCE, paper};

/// The machine under the board's set-points does what it does under those of this computer's executor.
#[test]
fn the_demo_on_the_board_is_the_one_on_this_computer() {
    let file = MoveFile::parse(PAPER_MOVE, "paper.toml").unwrap();
    let trajectory = &paper().1;
    let (mut greeted, mut uploaded, mut running) = (false, 0, 0);
    let board = play_on_board("board", &file, trajectory, |step| match step {
        Step::Greeted(greeting, _) => greeted = greeting.board == "qemu",
        Step::Upload(progress) => uploaded = progress.arrived,
        Step::Move(record) => running += u32::from(record.state == State::Running),
    });
    let board = board.unwrap();
    assert!(greeted);
    assert_eq!(uploaded, board.uploaded.blocks);
    assert_eq!(running, trajectory.duration_ticks().div_ceil(2_500));
    let replay = play("host", &file, trajectory).unwrap();
    assert_eq!(board.differs_from(&replay), None);
    // The executors creep to the first node from places that differ by a rounding error.
    let frames = board.run.recording.frames.iter();
    assert_eq!(frames.len(), replay.recording.frames.len());
    for (board, replay) in frames.zip(&replay.recording.frames) {
        let angles = board.joint_angles_rad.iter().zip(&replay.joint_angles_rad);
        for (board, replay) in angles {
            assert!((board - replay).abs() < 1e-6, "{board} {replay} rad");
        }
    }
    // It would be seen if they were not equal.
    let mut other = board.clone();
    other.sent[100][1].torque_nm += 1e-5;
    assert_eq!(other.differs_from(&replay), Some(100));
}

#[test]
fn the_log_is_decoded_with_the_boards_own_image() {
    let bench = Bench::configured();
    let image = LogImage::read(&qemu::image()).unwrap();
    let build_id = bench.session.identity().greeting.build_id;
    image.expect(build_id).unwrap();
    let (mut lines, began) = (Vec::new(), Instant::now());
    let log = || bench.session.transport().take_log();
    while lines.len() < 3 && began.elapsed() < PATIENCE {
        // Whole frames: the board writes each at once.
        image.decode(std::iter::once(log()), |line| lines.push(line.to_owned()));
    }
    assert!(
        lines[0].contains(&format!("build {build_id:016x}")),
        "{lines:?}"
    );
    assert!(lines.iter().any(|line| line.contains("Idle")), "{lines:?}");

    let error = image.expect(build_id ^ 1).unwrap_err();
    assert!(matches!(error, LogError::OtherImage { .. }));
    let words = error.to_string();
    for id in [build_id, build_id ^ 1] {
        assert!(words.contains(&format!("{id:016x}")), "{words}");
    }
    let no_image = LogImage::read(std::path::Path::new("Cargo.toml"));
    assert!(matches!(no_image, Err(LogError::NoImage { .. })));
}
