//! The store over losses of power at every moment of an update.

#[path = "../common/mod.rs"]
mod common;
mod flash;

use common::{axis_limits, limits, trajectory};
use flash::{CutFlash, Random};
use stillpoint_firmware::store::flash::{Flash, RamFlash};
use stillpoint_firmware::store::{Layout, Store};
use stillpoint_shared::drive_config::{AxisDrive, BusConfig, DriveConfig, Mapping};
use stillpoint_shared::protocol::StoreError;
use stillpoint_shared::trajectory::MAX_ENCODED_BYTES;
use stillpoint_shared::{AxisLimits, Limits, Trajectory, TrajectoryBuilder};

const LAYOUT: Layout = Layout {
    moves: [1, 3],
    config: [2, 0],
};

/// Room for two of the test's moves and a bit.
const SECTOR_BYTES: usize = 512;

/// A short move of this name; `version` tells one from another of the same name.
fn short(id: u32, version: u32) -> Trajectory {
    let mut builder = TrajectoryBuilder::new(id, &limits());
    let values: Vec<_> = (0..36).map(|i| f64::from(version * 100 + i)).collect();
    builder.interval(1000 + version, 5, &values).unwrap();
    builder.finish().unwrap()
}

fn put(id: u32, version: u32) -> Update {
    Update::Put(Box::new(short(id, version)))
}

fn hash(trajectory: &Trajectory) -> u64 {
    trajectory.header().content_hash
}

fn drives(node: u8) -> DriveConfig {
    let drive = AxisDrive {
        bus: 0,
        node,
        counts_per_turn: 1e6,
        reversed: true,
        home_counts: -3,
        home_rad: 0.5,
        gear_ratio: 33.0,
        rated_torque_nm: 1.27,
        torque_limit_permille: 3_000,
        mapping: Mapping::Write,
        tells_following: true,
    };
    let axes = [drive, AxisDrive { bus: 1, ..drive }];
    DriveConfig::new(BusConfig::default(), &axes).unwrap()
}

fn limits_of(torque_nm: f32) -> Limits {
    let axis = axis_limits();
    Limits::new(&[axis, AxisLimits { torque_nm, ..axis }]).unwrap()
}

/// All that a store holds, in an order of its own.
#[derive(Debug, Clone, PartialEq, Default)]
struct Content {
    moves: Vec<Trajectory>,
    limits: Option<Limits>,
    drives: Option<DriveConfig>,
}

/// What is read back. Every move has to decode.
fn content<F: Flash>(store: &Store<F>) -> Content {
    let mut moves: Vec<_> = store
        .moves()
        .map(|stored| {
            let bytes = store.find(stored.content_hash).unwrap();
            assert_eq!(bytes.len() as u32, stored.bytes);
            let trajectory = Trajectory::decode(bytes).unwrap();
            assert_eq!(trajectory.header().id, stored.id);
            assert_eq!(hash(&trajectory), stored.content_hash);
            assert_eq!(trajectory.duration_ticks(), stored.duration_ticks);
            trajectory
        })
        .collect();
    moves.sort_by_key(|trajectory| trajectory.header().id);
    Content {
        moves,
        limits: store.limits(),
        drives: store.drives(),
    }
}

#[derive(Debug, Clone)]
enum Update {
    Put(Box<Trajectory>),
    Delete(u64),
    Limits(Limits),
    Drives(DriveConfig),
}

impl Update {
    fn apply<F: Flash>(&self, store: &mut Store<F>) -> Result<(), StoreError> {
        match self {
            Self::Put(trajectory) => store.put(trajectory),
            Self::Delete(hash) => store.delete(*hash),
            Self::Limits(limits) => store.put_limits(limits),
            Self::Drives(drives) => store.put_drives(drives),
        }
    }

    fn expect(&self, mut content: Content) -> Content {
        match self {
            Self::Put(trajectory) => {
                let id = trajectory.header().id;
                content.moves.retain(|other| other.header().id != id);
                content.moves.push((**trajectory).clone());
                content
                    .moves
                    .sort_by_key(|trajectory| trajectory.header().id);
            }
            Self::Delete(gone) => content.moves.retain(|other| hash(other) != *gone),
            Self::Limits(limits) => content.limits = Some(limits.clone()),
            Self::Drives(drives) => content.drives = Some(drives.clone()),
        }
        content
    }
}

/// The test: power cut at every single write and erase of every update of a story that
/// appends, moves over, replaces and deletes.
#[test]
fn a_power_cut_at_every_operation_leaves_the_old_or_the_new() {
    let story = [
        put(1, 1),
        put(2, 1),
        Update::Limits(limits_of(50.0)),
        put(1, 2),
        Update::Drives(drives(4)),
        put(1, 3),
        Update::Delete(hash(&short(2, 1))),
        Update::Limits(limits_of(60.0)),
        put(3, 1),
        put(3, 2),
        Update::Drives(drives(5)),
        Update::Limits(limits_of(70.0)),
        Update::Drives(drives(6)),
        put(1, 4),
    ];
    let mut flash = CutFlash::new(SECTOR_BYTES, 1);
    let mut before = Content::default();
    let (mut cuts, mut old, mut new) = (0, 0, 0);
    for update in &story {
        let after = update.expect(before.clone());
        // Each cut with four kinds of leftovers.
        for left in 0.. {
            let mut cut = flash.clone();
            cut.left = Some(left / 4);
            cut.random = Random(left as u64);
            let mut store = Store::mount(cut, LAYOUT);
            assert_eq!(content(&store), before);
            let result = update.apply(&mut store);
            if !store.flash().is_dark() {
                result.unwrap();
                break;
            }
            assert!(matches!(result, Err(StoreError::Flash { .. })));
            cuts += 1;

            // What the next start finds.
            let mut store = Store::mount(store.into_flash().powered(), LAYOUT);
            let found = content(&store);
            if found == before {
                old += 1;
            } else {
                assert_eq!(found, after, "{update:?} cut at operation {}", left / 4);
                new += 1;
            }
            // And it is as good as any other store.
            update.apply(&mut store).or_else(absent).unwrap();
            assert_eq!(content(&store), after);
            let store = Store::mount(store.into_flash(), LAYOUT);
            assert_eq!(content(&store), after);
        }
        let mut store = Store::mount(flash, LAYOUT);
        update.apply(&mut store).unwrap();
        assert_eq!(content(&store), after);
        flash = store.into_flash();
        before = after;
    }
    assert!(cuts > 2500, "{cuts}");
    assert!(old > 0 && new > 0, "{old} {new}");
    assert!(flash.erases > 5, "{}", flash.erases);
}

/// A move that the cut update deleted already.
fn absent(error: StoreError) -> Result<(), StoreError> {
    match error {
        StoreError::NotStored { .. } => Ok(()),
        other => Err(other),
    }
}

/// Random updates with random cuts, again and again into what the last cut left.
#[test]
fn cuts_upon_cuts_never_lose_what_was_stored() {
    let mut random = Random(7);
    for seed in 0..60 {
        let mut flash = CutFlash::new(SECTOR_BYTES, seed);
        let mut expected = Content::default();
        for step in 0..60 {
            let id = random.below(3) as u32;
            let update = match random.below(8) {
                0..4 => put(id, step),
                4 | 5 => match expected.moves.first() {
                    Some(trajectory) => Update::Delete(hash(trajectory)),
                    None => continue,
                },
                6 => Update::Limits(limits_of(step as f32 + 1.0)),
                _ => Update::Drives(drives(1 + step as u8)),
            };
            flash.left = Some(random.below(300));
            let mut store = Store::mount(flash, LAYOUT);
            assert_eq!(content(&store), expected, "seed {seed}, step {step}");
            let result = update.apply(&mut store);
            let after = update.expect(expected.clone());
            flash = store.into_flash();
            if flash.is_dark() {
                flash = flash.powered();
                let found = content(&Store::mount(flash.clone(), LAYOUT));
                assert!(
                    found == expected || found == after,
                    "seed {seed}, step {step}: {update:?} made {found:?} of {expected:?}"
                );
                expected = found;
            } else if let Err(StoreError::NoRoom { .. }) = result {
                assert_eq!(expected.moves.len(), 2);
            } else {
                result.unwrap();
                expected = after;
            }
        }
    }
}

#[test]
fn a_full_store_says_so_and_keeps_what_it_has() {
    let mut store = Store::mount(CutFlash::new(SECTOR_BYTES, 3), LAYOUT);
    store.put(&short(1, 1)).unwrap();
    store.put(&short(2, 1)).unwrap();
    let refused = store.put(&short(3, 1));
    let Err(StoreError::NoRoom { needed, available }) = refused else {
        panic!("{refused:?}");
    };
    assert!(needed > available);
    assert_eq!(2 * needed + available, SECTOR_BYTES as u32 - 16);
    assert_eq!(content(&store).moves, [short(1, 1), short(2, 1)]);
    // A move of the same name takes the place of the old one.
    store.put(&short(2, 2)).unwrap();
    assert_eq!(content(&store).moves, [short(1, 1), short(2, 2)]);
    // One larger than any sector.
    let refused = store.put(&trajectory());
    assert!(
        matches!(refused, Err(StoreError::NoRoom { .. })),
        "{refused:?}"
    );

    let mut store = Store::mount(CutFlash::new(8192, 3), LAYOUT);
    for id in 0..12 {
        store.put(&short(id, 1)).unwrap();
    }
    let refused = store.put(&short(16, 1));
    assert_eq!(refused, Err(StoreError::TooMany { most: 12 }));
    store.put(&short(11, 2)).unwrap();
    store.delete_all().unwrap();
    assert_eq!(store.moves().count(), 0);
    store.put(&short(16, 1)).unwrap();
    let store = Store::mount(store.into_flash(), LAYOUT);
    assert_eq!(content(&store).moves, [short(16, 1)]);
}

#[test]
fn what_is_not_stored_is_not_found() {
    let mut store = Store::mount(RamFlash::<4, SECTOR_BYTES>::new(), LAYOUT);
    let content_hash = 77;
    let refused = Err(StoreError::NotStored { content_hash });
    assert_eq!(
        store.find(content_hash).map(<[u8]>::len),
        refused.map(|()| 0)
    );
    assert_eq!(store.delete(content_hash), refused);
    store.delete_all().unwrap();
    assert_eq!(content(&store), Content::default());
    assert_eq!(
        store.flash(),
        &RamFlash::new(),
        "nothing was written for that"
    );
}

#[test]
fn nothing_is_written_where_the_flash_is_not_blank() {
    let mut store = Store::mount(CutFlash::new(SECTOR_BYTES, 5), LAYOUT);
    store.put(&short(1, 1)).unwrap();
    let mut flash = store.into_flash();
    flash.program(1, SECTOR_BYTES - 200, 0x1234).unwrap();
    let mut store = Store::mount(flash, LAYOUT);
    store.put(&short(1, 2)).unwrap();
    assert_eq!(content(&store).moves, [short(1, 2)]);
}

#[test]
fn a_worn_word_is_named_and_the_old_stays() {
    let mut store = Store::mount(CutFlash::new(SECTOR_BYTES, 5), LAYOUT);
    store.put(&short(1, 1)).unwrap();
    let mut flash = store.into_flash();
    // In the data of the next record.
    let (sector, offset) = (1, SECTOR_BYTES - 180);
    flash.worn = Some((sector, offset));
    let mut store = Store::mount(flash, LAYOUT);
    let refused = store.put(&short(1, 2));
    let offset = offset as u32;
    assert_eq!(refused, Err(StoreError::Flash { sector, offset }));
    assert_eq!(content(&store).moves, [short(1, 1)]);
    // The next one goes to the other sector.
    store.put(&short(1, 2)).unwrap();
    let store = Store::mount(store.into_flash(), LAYOUT);
    assert_eq!(content(&store).moves, [short(1, 2)]);
}

#[test]
fn a_changed_byte_anywhere_loses_one_record_at_most() {
    // Heads are at 16 and behind the first record; the second record counts.
    let mut store = Store::mount(RamFlash::<4, SECTOR_BYTES>::new(), LAYOUT);
    store.put(&short(1, 1)).unwrap();
    store.put(&short(1, 2)).unwrap();
    let stored = store.moves().next().unwrap();
    let record = 20 + (stored.bytes as usize).next_multiple_of(4);
    let whole = store.into_flash();
    for offset in 0..SECTOR_BYTES {
        let mut flash = whole.clone();
        // Only what flash can do: bits to zero.
        let word = !(0xff << (8 * (offset % 4)));
        flash.program(1, offset & !3, word).unwrap();
        let found = content(&Store::mount(flash, LAYOUT)).moves;
        let expected = match offset {
            _ if offset < 36 => vec![],
            _ if offset < 16 + record => vec![short(1, 2)],
            _ if offset < 36 + record + stored.bytes as usize => vec![short(1, 1)],
            _ => vec![short(1, 2)],
        };
        let same = flash_unchanged(&whole, offset);
        assert!(
            found == expected || same && found == [short(1, 2)],
            "byte {offset}"
        );
    }
}

fn flash_unchanged<const N: usize>(flash: &RamFlash<4, N>, offset: usize) -> bool {
    flash.sector(1)[offset] == 0
}

/// On the board: 128 KiB sectors, the largest moves.
#[test]
fn seven_of_the_largest_moves_fit_the_board() {
    const SECTOR: usize = 128 * 1024;
    let mut flash = Box::new(RamFlash::<4, SECTOR>::new());
    let mut store = Store::mount(&mut *flash, LAYOUT);
    assert_eq!(store.bytes(), SECTOR - 16);
    let mut builder = TrajectoryBuilder::new(0, &Limits::new(&[axis_limits(); 6]).unwrap());
    while builder.interval(u32::MAX / 64, 2, &[0.1; 54]).is_ok() {}
    let largest = builder.finish().unwrap();
    let bytes = largest.encoded_bytes();
    assert!(bytes <= MAX_ENCODED_BYTES);
    for _ in 0..20 {
        store.put(&largest).unwrap();
    }
    assert_eq!(content(&store).moves, [largest]);
}

#[test]
fn records_lie_in_flash_as_documented() {
    let mut store = Store::mount(RamFlash::<4, SECTOR_BYTES>::new(), LAYOUT);
    store.put_limits(&limits()).unwrap();
    let (words, _) = store.flash().sector(LAYOUT.config[0]).as_chunks();
    let words: Vec<_> = words.iter().copied().map(u32::from_le_bytes).collect();
    // The check sums as another program computes them.
    assert_eq!(words[..4], [u32::from_le_bytes(*b"SPLG"), 1, 1, 49118636]);
    assert_eq!(words[4..9], [0x5250_0201, 0, 41, 2715289176, 2696272921]);
}

/// A record of another format version, as an older or newer firmware would have left it.
#[test]
fn another_format_is_not_read() {
    let mut store = Store::mount(RamFlash::<4, SECTOR_BYTES>::new(), LAYOUT);
    store.put_limits(&limits()).unwrap();
    store.put(&short(1, 1)).unwrap();
    let mut flash = store.into_flash();
    for (sector, head) in [(LAYOUT.config[0], [0; 5]), (LAYOUT.moves[0], [0; 5])] {
        let bytes = flash.sector(sector).to_vec();
        flash.erase(sector).unwrap();
        for (index, word) in bytes.as_chunks().0.iter().enumerate() {
            let word = match index {
                4..9 => head[index - 4],
                _ => u32::from_le_bytes(*word),
            };
            flash.program(sector, 4 * index, word).unwrap();
        }
    }
    let mut store = Store::mount(flash, LAYOUT);
    assert_eq!(content(&store), Content::default());
    // It is replaced like any other.
    store.put_limits(&limits()).unwrap();
    assert_eq!(store.limits(), Some(limits()));
}
