//! The words of a log, from the image that writes it: wire format 4 of `defmt`.
//!
//! Every symbol in the image's section `.defmt` is named by a JSON object with a sentence, and its address is the
//! sentence's number. A message is such a number (two bytes) and the values for the sentence's gaps, one after the other,
//! low bytes first. A value can be a sentence itself; one with alternatives, separated by `|`, is preceded by the number of
//! that which is meant.

use defmt_parser::{DisplayHint, Fragment, ParserMode, Type};
use object::read::File;
use object::{Object, ObjectSection, ObjectSymbol};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write;

const WIRE_FORMAT: &str = "4";
const ENCODING: &str = "rzcobs";

/// All sentences of an image, by their numbers.
pub(super) struct Words {
    sentences: BTreeMap<u16, Sentence>,
}

struct Sentence {
    /// Of a message: how important it is.
    level: Option<String>,
    alternatives: Vec<Vec<Piece>>,
}

enum Piece {
    Text(String),
    Value(Type, Option<DisplayHint>),
}

/// The name of a symbol.
#[derive(Deserialize)]
struct Symbol {
    tag: String,
    data: String,
}

impl Words {
    /// Collects them, or says in words what is wrong with the image.
    pub(super) fn of(image: &File<'_>) -> Result<Self, String> {
        let section = image
            .section_by_name(".defmt")
            .ok_or("it logs nothing")?
            .index();
        let mut sentences = BTreeMap::new();
        for symbol in image.symbols() {
            let Ok(name) = symbol.name() else { continue };
            // Linkers differ in whether they keep the quotes.
            let name = name.trim_matches('"');
            for (kind, known) in [("version", WIRE_FORMAT), ("encoding", ENCODING)] {
                let found = name.strip_prefix(&format!("_defmt_{kind}_ = "));
                if let Some(found) = found.filter(|found| *found != known) {
                    return Err(format!(
                        "the {kind} of its log is {found}, this program knows {known}"
                    ));
                }
            }
            if symbol.section_index() != Some(section) || !name.starts_with('{') {
                continue;
            }
            let Symbol { tag, data } =
                serde_json::from_str(name).map_err(|error| format!("{name}: {error}"))?;
            let sentence = Sentence::new(&tag, &data)?;
            let number = u16::try_from(symbol.address()).map_err(|error| error.to_string())?;
            sentences.insert(number, sentence);
        }
        Ok(Self { sentences })
    }

    /// Level and words of a message; `None` if it is damaged.
    pub(super) fn tell(&self, mut message: &[u8]) -> Option<(&str, String)> {
        let sentence = self.sentence(&mut message)?;
        let level = sentence.level.as_deref()?;
        let mut text = String::new();
        self.fill(sentence, &mut message, &mut text)?;
        Some((level, text))
    }

    fn sentence(&self, values: &mut &[u8]) -> Option<&Sentence> {
        self.sentences.get(&u16::from_le_bytes(take(values)?))
    }

    /// Writes a sentence with the values in its gaps.
    fn fill(&self, sentence: &Sentence, values: &mut &[u8], text: &mut String) -> Option<()> {
        let meant = match sentence.alternatives.len() {
            1 => 0,
            _ => u8::from_le_bytes(take(values)?),
        };
        for piece in sentence.alternatives.get(usize::from(meant))? {
            match piece {
                Piece::Text(words) => text.push_str(words),
                Piece::Value(kind, hint) => self.value(kind, hint.as_ref(), values, text)?,
            }
        }
        Some(())
    }

    fn value(
        &self,
        kind: &Type,
        hint: Option<&DisplayHint>,
        values: &mut &[u8],
        text: &mut String,
    ) -> Option<()> {
        let number = match kind {
            Type::U8 => u8::from_le_bytes(take(values)?).into(),
            Type::U16 => u16::from_le_bytes(take(values)?).into(),
            // The board's words have 32 bits.
            Type::U32 | Type::Usize => u32::from_le_bytes(take(values)?).into(),
            Type::U64 => u64::from_le_bytes(take(values)?),
            Type::F32 => return write!(text, "{:?}", f32::from_le_bytes(take(values)?)).ok(),
            Type::F64 => return write!(text, "{:?}", f64::from_le_bytes(take(values)?)).ok(),
            Type::Format => return self.fill(self.sentence(values)?, values, text),
            Type::FormatArray(count) => {
                let sentence = self.sentence(values)?;
                text.push('[');
                for index in 0..*count {
                    text.push_str(if index > 0 { ", " } else { "" });
                    self.fill(sentence, values, text)?;
                }
                text.push(']');
                return Some(());
            }
            // No other gets into a sentence.
            _ => return None,
        };
        let hexadecimal = match hint {
            Some(DisplayHint::Hexadecimal {
                alternate,
                zero_pad,
                ..
            }) => Some((*alternate, *zero_pad)),
            _ => None,
        };
        match hexadecimal {
            Some((true, digits)) => write!(text, "{number:#0digits$x}"),
            Some((false, digits)) => write!(text, "{number:0digits$x}"),
            None => write!(text, "{number}"),
        }
        .ok()
    }
}

impl Sentence {
    fn new(tag: &str, data: &str) -> Result<Self, String> {
        let level = match tag.strip_prefix("defmt_") {
            Some(level @ ("trace" | "debug" | "info" | "warn" | "error")) => Some(level.to_owned()),
            _ => None,
        };
        let alternatives = match level {
            Some(_) => vec![pieces(data)?],
            None => data.split('|').map(pieces).collect::<Result<Vec<_>, _>>()?,
        };
        if alternatives.len() > usize::from(u8::MAX) {
            return Err(format!(
                "this program does not know “{data}” with so many alternatives"
            ));
        }
        Ok(Self {
            level,
            alternatives,
        })
    }
}

/// The pieces of a sentence, if it has values of the kinds only that this program knows, each once and in order.
fn pieces(sentence: &str) -> Result<Vec<Piece>, String> {
    let fragments = defmt_parser::parse(sentence, ParserMode::Strict)
        .map_err(|error| format!("{sentence}: {error}"))?;
    let mut gaps = 0..;
    let piece = |fragment| match fragment {
        Fragment::Literal(text) => Ok(Piece::Text(text.into_owned())),
        Fragment::Parameter(value) => {
            let is_known = matches!(
                value.ty,
                Type::U8
                    | Type::U16
                    | Type::U32
                    | Type::U64
                    | Type::Usize
                    | Type::F32
                    | Type::F64
                    | Type::Format
                    | Type::FormatArray(_)
            ) && matches!(
                value.hint,
                None | Some(DisplayHint::Debug | DisplayHint::Hexadecimal { .. })
            );
            if !is_known || gaps.next() != Some(value.index) {
                return Err(format!("this program cannot fill “{sentence}”"));
            }
            Ok(Piece::Value(value.ty, value.hint))
        }
    };
    fragments.into_iter().map(piece).collect()
}

fn take<const N: usize>(values: &mut &[u8]) -> Option<[u8; N]> {
    let (first, rest) = values.split_first_chunk()?;
    *values = rest;
    Some(*first)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words() -> Words {
        let sentences = [
            (1, "defmt_info", "state {}, build {=u64:016x}"),
            (2, "defmt_warn", "{}: {=u16:#x}|{=f32:?}"),
            (3, "defmt_derived", "Idle|Fault {{ axis: {=u8:?} }}"),
            (4, "defmt_derived", "At({=[?;2]})"),
            (5, "defmt_prim", "{=u8}"),
        ];
        let sentences = sentences
            .map(|(number, tag, data)| (number, Sentence::new(tag, data).unwrap()))
            .into();
        Words { sentences }
    }

    #[test]
    fn gaps_are_filled() {
        let words = words();
        let build = 0x0123_4567_89ab_cdef_u64.to_le_bytes();
        let message = [&[1, 0, 3, 0, 1, 7][..], &build].concat();
        assert_eq!(
            words.tell(&message),
            Some((
                "info",
                "state Fault { axis: 7 }, build 0123456789abcdef".to_owned()
            ))
        );
        // A message has no alternatives.
        let torque = 1.5f32.to_le_bytes();
        let message = [&[2, 0, 4, 0, 5, 0, 8, 9, 0x34, 0x12][..], &torque].concat();
        assert_eq!(
            words.tell(&message),
            Some(("warn", "At([8, 9]): 0x1234|1.5".to_owned()))
        );
    }

    #[test]
    fn damaged_messages_are_noticed() {
        let words = words();
        let sound = [1, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        assert!(words.tell(&sound).is_some());
        for length in 0..sound.len() {
            assert_eq!(words.tell(&sound[..length]), None, "{length}");
        }
        // A sentence that is no message, one that is not there, an alternative that is not there.
        for message in [&[3, 0, 0][..], &[9, 0], &[1, 0, 3, 0, 2]] {
            assert_eq!(words.tell(message), None);
        }
    }

    #[test]
    fn unknown_kinds_of_values_are_refused() {
        for sentence in ["{=[u8]}", "{=u32:us}", "{1=u8} {0=u8}", "{=u8"] {
            assert!(Sentence::new("defmt_info", sentence).is_err(), "{sentence}");
        }
    }
}
