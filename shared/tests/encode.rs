//! The board's serializer gives postcard's bytes.

use proptest::collection::{btree_map, vec};
use proptest::prelude::*;
use serde::Serialize;
use stillpoint_shared::encode;

#[derive(Debug, Serialize)]
struct Unit;

#[derive(Debug, Serialize)]
struct Wrapped(i32);

#[derive(Debug, Serialize)]
struct Pair(u8, char);

#[derive(Debug, Serialize)]
enum Choice {
    Nothing,
    One(u64),
    Two(i16, bool),
    Named { text: String, rest: Option<i64> },
}

type Numbers = (u8, u16, u32, u64, i8, i16, i32, i64, f32, f64);

/// Into a buffer that is just large enough, as postcard does; not into one that is a byte shorter.
fn check<T: Serialize>(value: &T) {
    let mut expected = [0; 512];
    let expected = postcard::to_slice(value, &mut expected).unwrap();
    let mut buffer = [0; 512];
    let exact = &mut buffer[..expected.len()];
    assert_eq!(encode::to_slice(value, exact).as_deref(), Some(&*expected));
    if let Some(shorter) = expected.len().checked_sub(1) {
        assert_eq!(encode::to_slice(value, &mut buffer[..shorter]), None);
    }
}

fn text() -> impl Strategy<Value = String> {
    vec(any::<char>(), 0..10).prop_map(String::from_iter)
}

proptest! {
    #[test]
    fn numbers(value: Numbers) {
        check(&value);
    }

    #[test]
    fn composed(
        texts in vec((any::<char>(), text()), 0..4),
        map in btree_map(any::<u16>(), any::<Option<i8>>(), 0..20),
        number: u64,
        small: (i32, i16, bool),
        rest: Option<i64>,
    ) {
        check(&(Unit, Wrapped(small.0), &texts, &map));
        check(&Pair(number as u8, 'ß'));
        check(&Choice::Nothing);
        check(&Choice::One(number));
        check(&Choice::Two(small.1, small.2));
        let text = texts.into_iter().map(|(_, text)| text).next().unwrap_or_default();
        check(&Choice::Named { text, rest });
    }
}

#[test]
fn the_largest_and_the_smallest() {
    check(&(u16::MAX, u32::MAX, u64::MAX));
    check(&(i16::MIN, i32::MIN, i64::MIN, i64::MAX, 127u32, 128u32));
}
