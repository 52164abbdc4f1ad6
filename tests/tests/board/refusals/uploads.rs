//! Uploads that are no trajectories, or do not fit together.

use std::collections::BTreeSet;

use stillpoint::device::{Session, Transport};
use stillpoint_firmware::{Command, Refusal, State};
use stillpoint_shared::TrajectoryError;
use stillpoint_shared::assembly::{AssemblyError, Outline};
use stillpoint_shared::protocol::{Block, Request};
use stillpoint_shared::status::Quantity;
use stillpoint_shared::trajectory::Span;

use super::super::bench::start_request;
use super::{name, refusal, throughout, variants};

/// Uploads that are no trajectories, or do not fit together.
pub(super) fn uploads<T: Transport>(session: &mut Session<T>) {
    let sound = throughout(Quantity::Torque, 0.0);
    let outline = Outline::of(&sound);
    let mut seen = BTreeSet::new();
    let span = |duration_ticks, points| Span {
        duration_ticks,
        points,
    };
    let cases: [(&[Span], TrajectoryError); 6] = [
        (&[], TrajectoryError::NoIntervals),
        (
            &[span(9, 8), span(9, 1)],
            TrajectoryError::Points {
                interval: 1,
                points: 1,
            },
        ),
        (
            &[span(9, 8), span(0, 8)],
            TrajectoryError::NoDuration { interval: 1 },
        ),
        (
            &[span(u32::MAX, 8), span(1, 8)],
            TrajectoryError::TooLong { interval: 1 },
        ),
        (
            &[2, 3, 4, 5, 6, 7, 8, 9, 10].map(|points| span(9, points)),
            TrajectoryError::TooManyBases { interval: 8 },
        ),
        (
            &[span(9, 32); 11],
            TrajectoryError::TooManyCoefficients {
                interval: 10,
                needed: 11 * 33 * 9,
            },
        ),
    ];
    for (spans, wanted) in cases {
        let mut outline = outline.clone();
        outline.spans = spans.iter().copied().collect();
        let error = session.order(&Request::UploadBegin(outline)).unwrap_err();
        let Refusal::Trajectory(error) = refusal(error) else {
            panic!("{wanted}");
        };
        assert_eq!(error, wanted);
        seen.insert(name(&error));
    }
    for points in [0, 33, 255] {
        let mut outline = outline.clone();
        outline.spans = [span(9, points)].into_iter().collect();
        let error = session.order(&Request::UploadBegin(outline)).unwrap_err();
        assert!(matches!(
            refusal(error),
            Refusal::Trajectory(TrajectoryError::Points { interval: 0, .. })
        ));
    }
    // Those that cannot be said in an outline, and those of encoded trajectories, which do not cross the wire.
    let unsayable = [
        "Axes",
        "Coefficients",
        "NotFinite",
        "OtherAxes",
        "TooManyIntervals",
    ];
    let of_bytes = [
        "BufferTooSmall",
        "Duration",
        "Magic",
        "Malformed",
        "Trailing",
        "Truncated",
        "Version",
    ];
    seen.extend(
        [unsayable.as_slice(), &of_bytes]
            .concat()
            .into_iter()
            .map(str::to_owned),
    );
    seen.insert("ContentHash".to_owned()); // below
    assert_eq!(seen, variants("TrajectoryError"));

    let mut seen = BTreeSet::from(["Trajectory".to_owned()]);
    let mut refused = |session: &mut Session<T>, request: &Request<'_>| -> AssemblyError {
        let Refusal::Upload(error) = refusal(session.order(request).unwrap_err()) else {
            panic!("{request:?}");
        };
        seen.insert(name(&error));
        error
    };
    let tag = outline.tag();
    let content_hash = outline.content_hash;
    let commit = Request::UploadCommit { content_hash };
    let bytes = [0; 512];
    let block = |tag, block, values| Request::UploadBlock(Block { tag, block, values });
    session.order(&Request::UploadAbort).unwrap();
    let error = refused(session, &block(tag, 0, &bytes));
    assert_eq!(error, AssemblyError::NothingBegun);
    session
        .order(&Request::UploadBegin(outline.clone()))
        .unwrap();
    // Start while loading.
    let wrong = refusal(session.order(&Request::Start(start_request())).unwrap_err());
    let (command, state) = (Command::Start, State::Loading);
    assert_eq!(wrong, Refusal::WrongState { command, state });
    let error = refused(session, &block(tag ^ 1, 0, &bytes));
    assert!(matches!(error, AssemblyError::OtherTag { .. }));
    let error = refused(session, &block(tag, 2, &bytes));
    assert_eq!(
        error,
        AssemblyError::NoSuchBlock {
            block: 2,
            blocks: 2
        }
    );
    let error = refused(session, &block(tag, 0, &bytes[..508]));
    assert!(matches!(
        error,
        AssemblyError::BlockLength { found: 508, .. }
    ));
    session.order(&block(tag, 0, &bytes)).unwrap();
    let error = refused(session, &commit);
    assert!(matches!(error, AssemblyError::Missing(arrived) if arrived.missing() == 1));
    // All is there, and it is not what was announced.
    let rest = 4 * (sound.coefficients().len() - 128);
    session.order(&block(tag, 1, &bytes[..rest])).unwrap();
    let error = refused(session, &commit);
    assert!(matches!(
        error,
        AssemblyError::Trajectory(TrajectoryError::ContentHash { stored, .. })
            if stored == content_hash
    ));
    assert_eq!(seen, variants("AssemblyError"));
    session.order(&Request::UploadAbort).unwrap();
}
