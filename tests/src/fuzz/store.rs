//! The store: whatever a flash holds, it is read, and can be written.

use super::bytes::Bytes;
use super::seeds::small_move;
use super::trajectory::limits;
use crc::{CRC_32_ISO_HDLC, Crc};
use stillpoint_firmware::store::flash::{Flash, RamFlash};
use stillpoint_firmware::store::{Layout, Store};
use stillpoint_shared::protocol::StoredMove;
use stillpoint_shared::{Limits, Trajectory};

const SECTOR_BYTES: usize = 1024;

type SmallFlash = RamFlash<4, SECTOR_BYTES>;

const LAYOUT: Layout = Layout {
    moves: [0, 1],
    config: [2, 3],
};

/// Bytes: how the flash is filled, with what, then what is done with the store.
///
/// No panic; what is stored and sound can be loaded; after each change a new mount finds what the store said.
pub fn store(data: &[u8]) {
    let mut bytes = Bytes(data);
    let mut flash = SmallFlash::new();
    let kind = bytes.u8();
    let content = usize::from(bytes.u16());
    let mut content = Bytes(bytes.take(content));
    if kind & 1 == 0 {
        for sector in 0..4 {
            raw(&mut flash, sector, content.take(SECTOR_BYTES));
        }
    } else {
        for sector in 0..4 {
            let generation = (kind >> (2 * sector)) & 3;
            records(&mut flash, sector, u32::from(generation), &mut content);
        }
    }
    let mut store = Store::mount(flash, LAYOUT);
    look(&store);
    // At most as many changes as it takes to move over a few times.
    for step in 0..12 {
        if bytes.is_empty() {
            break;
        }
        let before = found(&store);
        let byte = bytes.u8();
        let changed = match byte % 5 {
            0 | 1 => store.put(&small_move(u32::from(byte / 5) % 4, step)),
            2 => match before.0.get(usize::from(byte / 5) % 4) {
                Some(stored) => store.delete(stored.content_hash),
                None => Ok(()),
            },
            3 => store.put_limits(limits()),
            _ => store.delete_all(),
        };
        let after = found(&store);
        if changed.is_err() {
            assert_eq!(before, after, "a refusal changes nothing");
        }
        let flash = store.into_flash();
        store = Store::mount(flash, LAYOUT);
        assert_eq!(found(&store), after, "what is stored stays");
        look(&store);
    }
}

fn found(store: &Store<SmallFlash>) -> (Vec<StoredMove>, Option<Limits>) {
    let mut moves: Vec<_> = store.moves().collect();
    moves.sort_by_key(|stored| (stored.id, stored.content_hash));
    (moves, store.limits())
}

fn look(store: &Store<SmallFlash>) {
    for stored in store.moves() {
        let bytes = store.find(stored.content_hash).expect("it is listed");
        let _ = Trajectory::decode(bytes);
    }
    let _ = (store.limits(), store.config(), store.drives());
}

fn raw(flash: &mut SmallFlash, sector: u8, content: &[u8]) {
    for (index, word) in content.chunks_exact(4).enumerate() {
        let word = u32::from_le_bytes([word[0], word[1], word[2], word[3]]);
        flash
            .program(sector, 4 * index, word)
            .expect("it is inside");
    }
}

fn check_sum(words: &[u32]) -> u32 {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&bytes)
}

/// Fills a sector with records whose heads are sound, whatever they say, so that the fuzzer need not guess check sums.
fn records(flash: &mut SmallFlash, sector: u8, generation: u32, content: &mut Bytes<'_>) {
    let mut words = vec![u32::from_le_bytes(*b"SPLG"), generation, 1];
    words.push(check_sum(&words));
    for _ in 0..content.u8() % 8 {
        let [flags, kind, format, key] = [
            content.u8(),
            content.u8() % 6,
            content.u8() % 3,
            content.u8() % 4,
        ];
        let given = usize::from(content.u16() % 300);
        let data = content.take(given);
        let length = match flags & 7 {
            0 => u32::MAX - 1,
            1 => u32::from(content.u16()) << 16 | u32::from(content.u16()),
            _ => data.len() as u32,
        };
        let mut padded = data.to_vec();
        padded.resize(data.len().next_multiple_of(4), 0xff);
        let sum = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(data);
        let sum = if flags & 8 == 0 { sum } else { !sum };
        let mut head = vec![
            0x5250_0000 | u32::from(kind) << 8 | u32::from(format),
            u32::from(key),
            length,
            sum,
        ];
        head.push(check_sum(&head));
        words.extend(head);
        let (data, _) = padded.as_chunks();
        words.extend(data.iter().map(|&word| u32::from_le_bytes(word)));
    }
    for (index, word) in words.into_iter().take(SECTOR_BYTES / 4).enumerate() {
        flash
            .program(sector, 4 * index, word)
            .expect("it is inside");
    }
}
