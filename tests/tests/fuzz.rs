//! The fuzzer's functions on seeds and mutations of them: the same bytes in every run, no coverage to guide them. The
//! real search is `tests/fuzz/run`.

use std::fs;
use std::path::Path;
use stillpoint_tests::fuzz::{TARGETS, seeds};

/// Mutations per target.
const RUNS: u64 = 20_000;

/// SplitMix64 (Steele, Lea, Flood 2014).
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, most: usize) -> usize {
        (self.bits() % most.max(1) as u64) as usize
    }
}

/// A few changes such as a fuzzer makes.
fn mutate(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    for _ in 0..=random.below(4) {
        let place = random.below(bytes.len());
        match random.below(8) {
            0 | 1 => {
                if let Some(byte) = bytes.get_mut(place) {
                    *byte ^= 1 << random.below(8);
                }
            }
            2 => {
                if let Some(byte) = bytes.get_mut(place) {
                    *byte = [0, 1, 0x7f, 0x80, 0xff][random.below(5)];
                }
            }
            3 => bytes.insert(place.min(bytes.len()), random.bits() as u8),
            4 if !bytes.is_empty() => drop(bytes.remove(place)),
            5 => bytes.truncate(place),
            6 => bytes.extend(&other[random.below(other.len())..]),
            _ => {
                // A whole number or float at once.
                let value = random.bits().to_le_bytes();
                let end = (place + 4).min(bytes.len());
                let count = end - place.min(end);
                bytes[end - count..end].copy_from_slice(&value[..count]);
            }
        }
    }
    bytes.truncate(4096);
}

#[test]
fn mutated_seeds_break_no_promise() {
    for (target, run) in TARGETS {
        let seeds: Vec<_> = seeds()
            .into_iter()
            .filter(|seed| seed.target == target)
            .collect();
        assert!(seeds.len() >= 2, "{target}");
        let mut pool: Vec<Vec<u8>> = seeds.into_iter().map(|seed| seed.bytes).collect();
        let mut random = Random(1);
        for bytes in &pool {
            run(bytes);
        }
        for _ in 0..RUNS {
            let mut bytes = pool[random.below(pool.len())].clone();
            let other = pool[random.below(pool.len())].clone();
            mutate(&mut bytes, &other, &mut random);
            run(&bytes);
            // Some go on from where they are.
            if random.below(50) == 0 && pool.len() < 200 {
                pool.push(bytes);
            }
        }
    }
}

/// The seeds kept for the fuzzer are those of this code; `STILLPOINT_WRITE_SEEDS=1` writes them anew. What the fuzzer
/// once found is there, too, and is run again.
#[test]
fn the_seeds_kept_are_those_of_the_code() {
    let corpus = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/corpus"));
    for seed in seeds() {
        let file = corpus.join(seed.target).join(seed.name);
        if std::env::var_os("STILLPOINT_WRITE_SEEDS").is_some() {
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(&file, &seed.bytes).unwrap();
        }
        let kept = fs::read(&file).unwrap_or_default();
        assert!(
            kept == seed.bytes,
            "{} is of another version",
            file.display()
        );
    }
    for (target, run) in TARGETS {
        for file in fs::read_dir(corpus.join(target)).unwrap() {
            run(&fs::read(file.unwrap().path()).unwrap());
        }
    }
}
