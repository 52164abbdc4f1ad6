//! Trajectories put together from blocks in any order.

mod common;

use common::{limits, paper_shaped};
use proptest::prelude::*;
use stillpoint_shared::assembly::{self, Arrived, Assembly, AssemblyError, Outline};
use stillpoint_shared::trajectory::{MAX_COEFFICIENTS, MAX_ENCODED_BYTES};
use stillpoint_shared::{Trajectory, TrajectoryBuilder, TrajectoryError};

fn bytes(trajectory: &Trajectory, block: u8) -> Vec<u8> {
    let values = assembly::block(trajectory, block).iter();
    values.flat_map(|value| value.to_le_bytes()).collect()
}

fn blocks(trajectory: &Trajectory) -> u8 {
    (0..)
        .find(|&block| bytes(trajectory, block).is_empty())
        .unwrap()
}

/// An assembly with its place.
struct Place {
    assembly: Assembly,
    trajectory: Trajectory,
}

impl Place {
    fn new() -> Self {
        Self {
            assembly: Assembly::NONE,
            trajectory: Trajectory::empty(),
        }
    }

    fn begin(&mut self, outline: &Outline) -> Result<(), TrajectoryError> {
        self.assembly.begin(outline, &mut self.trajectory)
    }

    fn take(&mut self, tag: u32, block: u8, bytes: &[u8]) -> Result<(), AssemblyError> {
        self.assembly.take(tag, block, bytes, &mut self.trajectory)
    }

    fn arrived(&self) -> Arrived {
        self.assembly.arrived()
    }

    fn finish(&mut self) -> Result<&Trajectory, AssemblyError> {
        self.assembly.finish(&mut self.trajectory)?;
        Ok(&self.trajectory)
    }
}

fn begun(trajectory: &Trajectory) -> (Place, u32) {
    let mut place = Place::new();
    let outline = Outline::of(trajectory);
    place.begin(&outline).unwrap();
    (place, outline.tag())
}

/// Intervals of the most points on three axes until nothing more fits.
fn full() -> Trajectory {
    let mut builder = TrajectoryBuilder::new(9, &limits());
    let mut values = (1..).map(f64::from);
    let row: Vec<_> = values.by_ref().take(33 * 9).collect();
    while builder.interval(7, 32, &row).is_ok() {}
    let rows = MAX_COEFFICIENTS % row.len() / 9;
    let row: Vec<_> = values.take(rows * 9).collect();
    builder.interval(9, rows - 1, &row).unwrap();
    builder.finish().unwrap()
}

#[test]
fn the_largest_trajectory_fits() {
    let trajectory = full();
    assert!(trajectory.coefficients().len() > MAX_COEFFICIENTS - 9);
    assert_eq!(blocks(&trajectory), 24);
    let (mut place, tag) = begun(&trajectory);
    for block in (0..24).rev() {
        place.take(tag, block, &bytes(&trajectory, block)).unwrap();
    }
    assert_eq!(place.finish(), Ok(&trajectory));
}

proptest! {
    /// Whatever the order, and whatever comes twice, the whole is the original; before that,
    /// nothing comes out.
    #[test]
    fn any_order_gives_the_trajectory(order in prop::collection::vec(0u8..5, 0..30)) {
        let trajectory = paper_shaped();
        prop_assert_eq!(blocks(&trajectory), 5);
        let (mut place, tag) = begun(&trajectory);
        let mut bits = 0u32;
        for block in order {
            place.take(tag, block, &bytes(&trajectory, block)).unwrap();
            bits |= 1 << block;
            let arrived = Arrived { tag, blocks: 5, bits };
            prop_assert_eq!(place.arrived(), arrived);
            prop_assert_eq!(arrived.missing(), 5 - bits.count_ones());
            if bits == 0b11111 {
                prop_assert_eq!(place.finish(), Ok(&trajectory));
            } else {
                prop_assert_eq!(place.finish(), Err(AssemblyError::Missing(arrived)));
            }
        }
    }
}

#[test]
fn begun_again_it_goes_on_and_another_one_starts_anew() {
    let trajectory = paper_shaped();
    let outline = Outline::of(&trajectory);
    let (mut place, tag) = begun(&trajectory);
    place.take(tag, 2, &bytes(&trajectory, 2)).unwrap();
    place.begin(&outline).unwrap();
    assert_eq!(place.arrived().bits, 0b100);

    // The same hash promised for another move: nothing of the first may stay.
    let mut other = outline.clone();
    other.spans[0].duration_ticks += 1;
    place.begin(&other).unwrap();
    assert_eq!(place.arrived().bits, 0);

    let mut other = outline.clone();
    other.content_hash ^= 1 << 40;
    place.begin(&outline).unwrap();
    place.take(tag, 2, &bytes(&trajectory, 2)).unwrap();
    place.begin(&other).unwrap();
    assert_eq!(place.arrived().bits, 0);

    // After the end, too, so that a lost answer to the commit costs nothing.
    place.begin(&outline).unwrap();
    for block in 0..5 {
        place.take(tag, block, &bytes(&trajectory, block)).unwrap();
    }
    assert!(place.finish().is_ok());
    place.begin(&outline).unwrap();
    assert_eq!(place.arrived().missing(), 0);
    assert_eq!(place.finish(), Ok(&trajectory));
}

/// What says that it is a block that came before is believed; the first one counts.
#[test]
fn a_block_is_written_once() {
    let trajectory = paper_shaped();
    let (mut place, tag) = begun(&trajectory);
    for block in 0..5 {
        let bytes = bytes(&trajectory, block);
        place.take(tag, block, &bytes).unwrap();
        place.take(tag, block, &vec![7; bytes.len()]).unwrap();
    }
    assert_eq!(place.finish(), Ok(&trajectory));
}

#[test]
fn another_content_than_promised_has_to_come_again() {
    let trajectory = paper_shaped();
    let (mut place, tag) = begun(&trajectory);
    for block in 0..5 {
        let mut bytes = bytes(&trajectory, block);
        bytes[17] ^= u8::from(block == 3);
        place.take(tag, block, &bytes).unwrap();
    }
    assert!(matches!(
        place.finish(),
        Err(AssemblyError::Trajectory(TrajectoryError::ContentHash { stored, .. }))
            if stored == trajectory.header().content_hash
    ));
    assert_eq!(place.arrived().missing(), 5);
    for block in 0..5 {
        place.take(tag, block, &bytes(&trajectory, block)).unwrap();
    }
    assert_eq!(place.finish(), Ok(&trajectory));
}

#[test]
fn blocks_that_do_not_belong_are_refused() {
    let trajectory = paper_shaped();
    let first = bytes(&trajectory, 0);
    let nothing = Err(AssemblyError::NothingBegun);
    assert_eq!(Place::new().take(1, 0, &first), nothing);
    assert_eq!(Place::new().finish().map(|_| ()), nothing);
    let (mut place, expected) = begun(&trajectory);
    let tag = expected ^ 1;
    assert_eq!(
        place.take(tag, 0, &first),
        Err(AssemblyError::OtherTag { tag, expected })
    );
    for block in [5, 31, 32, 255] {
        assert_eq!(
            place.take(expected, block, &first),
            Err(AssemblyError::NoSuchBlock { block, blocks: 5 })
        );
    }
    // The last block is shorter: 594 values are 4 × 128 + 82.
    for (block, found, fits) in [(0, 508, 512), (0, 511, 512), (4, 512, 328), (4, 0, 328)] {
        assert_eq!(
            place.take(expected, block, &vec![0; usize::from(found)]),
            Err(AssemblyError::BlockLength {
                block,
                found,
                expected: fits
            })
        );
    }
    assert_eq!(place.arrived().bits, 0);
}

#[test]
fn impossible_outlines_are_refused() {
    let good = Outline::of(&paper_shaped());
    let changed = |change: fn(&mut Outline)| {
        let mut outline = good.clone();
        change(&mut outline);
        let (mut place, _) = begun(&paper_shaped());
        let refused = place.begin(&outline).unwrap_err();
        assert_eq!(place.arrived(), Arrived::default());
        assert_eq!(place.trajectory, Trajectory::empty());
        refused
    };
    use TrajectoryError::{Axes, NoDuration, NoIntervals, Points, TooLong, TooManyCoefficients};
    assert_eq!(changed(|o| o.axes = 0), Axes { axes: 0 });
    assert_eq!(changed(|o| o.axes = 7), Axes { axes: 7 });
    assert_eq!(changed(|o| o.spans.clear()), NoIntervals);
    for (points, byte) in [(1, 1), (33, 33), (255, 255), (0, 0)] {
        let mut outline = good.clone();
        outline.spans[1].points = byte;
        assert_eq!(
            Place::new().begin(&outline),
            Err(Points {
                interval: 1,
                points
            })
        );
    }
    assert_eq!(
        changed(|o| o.spans[2].duration_ticks = 0),
        NoDuration { interval: 2 }
    );
    assert_eq!(
        changed(|o| o.spans[5].duration_ticks = u32::MAX),
        TooLong { interval: 5 }
    );
    let large = changed(|o| {
        let span = o.spans[0];
        while o.spans.push(span).is_ok() {}
    });
    assert!(
        matches!(large, TooManyCoefficients { interval: 31, .. }),
        "{large:?}"
    );
}

#[test]
fn bytes_in_pieces_are_the_bytes() {
    for trajectory in [paper_shaped(), full()] {
        let mut buffer = vec![0; MAX_ENCODED_BYTES];
        let whole = trajectory.encode(&mut buffer).unwrap();
        assert_eq!(trajectory.encoded_bytes(), whole.len());
        let mut pieces: Vec<u8> = Vec::new();
        assert!(trajectory.encode_into(&mut |piece| {
            pieces.extend(piece);
            true
        }));
        assert_eq!(pieces, whole);
        let mut taken = 0;
        assert!(!trajectory.encode_into(&mut |piece| {
            taken += piece.len();
            taken < 100
        }));
        assert!((100..105).contains(&taken));
    }
}
