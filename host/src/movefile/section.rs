//! One table of a move file, with the place of everything in it.

use super::error::{Fault, Problem};
use super::fields::fields_of;
use super::nearest::nearest;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer, ValueDeserializer};

/// One table, as the file has it.
pub(super) struct Section<'t> {
    /// Name as written in the file: `[machine]`, `move.from`.
    name: String,
    table: DeTable<'t>,
    bytes: Range<usize>,
}

impl<'t> Section<'t> {
    /// The whole file.
    pub(super) fn root(text: &'t str) -> Result<Self, Box<Fault>> {
        let root = DeTable::parse(text).map_err(|error| {
            // A syntax error without a place is one at the end.
            let end = text.len()..text.len();
            let message = error.message().trim().replace('\n', ", ");
            Fault::new(error.span().unwrap_or(end), Problem::Syntax(message))
        })?;
        Ok(Self {
            name: "the file".into(),
            bytes: 0..0,
            table: root.into_inner(),
        })
    }

    /// A table of this one.
    pub(super) fn table(&self, key: &'static str) -> Result<Option<Self>, Box<Fault>> {
        let Some((name, value)) = self.table.get_key_value(key) else {
            return Ok(None);
        };
        match value.get_ref() {
            DeValue::Table(table) => Ok(Some(Self {
                name: if self.bytes == (0..0) {
                    format!("[{key}]")
                } else {
                    format!("`{key}`")
                },
                bytes: name.span(),
                table: table.clone(),
            })),
            other => Err(Fault::new(
                value.span(),
                Problem::Type {
                    key: key.into(),
                    message: format!("expected a table, found {}", other.type_str()),
                },
            )),
        }
    }

    /// Bytes of a key's value, or of the table's name where it has no such key.
    pub(super) fn bytes(&self, key: &str) -> Range<usize> {
        self.table
            .get(key)
            .map_or_else(|| self.bytes.clone(), Spanned::span)
    }

    /// Moves the keys that `keep` likes into a section of their own.
    pub(super) fn split_off(&mut self, keep: impl Fn(&str) -> bool) -> Self {
        let mut taken = Self {
            name: self.name.clone(),
            table: DeTable::new(),
            bytes: self.bytes.clone(),
        };
        for (key, value) in std::mem::take(&mut self.table) {
            let side = if keep(key.get_ref()) {
                &mut taken
            } else {
                &mut *self
            };
            side.table.insert(key, value);
        }
        taken
    }

    /// Fails on the first key (in the order of the file) that is not among the known ones.
    pub(super) fn only(&self, known: &[&'static str]) -> Result<(), Box<Fault>> {
        let stranger = self
            .table
            .keys()
            .filter(|key| !known.contains(&key.get_ref().as_ref()))
            .min_by_key(|key| key.span().start);
        stranger.map_or(Ok(()), |key| {
            Err(Fault::new(
                key.span(),
                Problem::UnknownKey {
                    key: key.get_ref().to_string(),
                    table: self.name.clone(),
                    nearest: nearest(key.get_ref(), known),
                    known: known.to_vec(),
                },
            ))
        })
    }

    /// One value, which must be there.
    pub(super) fn value<T: DeserializeOwned>(&self, key: &str) -> Result<T, Box<Fault>> {
        let value = self
            .table
            .get(key)
            .ok_or_else(|| self.missing(key))?
            .clone();
        let bytes = value.span();
        T::deserialize(ValueDeserializer::from(value)).map_err(|e| self.misread(&e, key, bytes))
    }

    /// The whole table as a type; its unknown keys are errors.
    pub(super) fn read<T: DeserializeOwned>(&self) -> Result<T, Box<Fault>> {
        if let Some(known) = fields_of::<T>() {
            self.only(known)?;
        }
        let table = Spanned::new(self.bytes.clone(), self.table.clone());
        T::deserialize(Deserializer::from(table)).map_err(|error| {
            let bytes = error.span().unwrap_or_else(|| self.bytes.clone());
            // serde names a missing key in words only.
            let missing = error
                .message()
                .strip_prefix("missing field `")
                .and_then(|rest| rest.strip_suffix('`'))
                .filter(|_| bytes == self.bytes);
            match missing {
                Some(key) => self.missing(key),
                None => {
                    let key = self.key_at(&bytes).unwrap_or_else(|| self.name.clone());
                    self.misread(&error, &key, bytes)
                }
            }
        })
    }

    /// All keys, in the order of the file.
    pub(super) fn keys(&self) -> Vec<String> {
        let mut keys: Vec<_> = self.table.keys().collect();
        keys.sort_by_key(|key| key.span().start);
        keys.iter().map(|key| key.get_ref().to_string()).collect()
    }

    /// Every number of the table and of the tables in it, with its key and place.
    pub(super) fn numbers(&self) -> Vec<(String, f64, Range<usize>)> {
        let mut found = Vec::new();
        leaves(&self.table, "", &mut |key, value| {
            if let Ok(number) = f64::deserialize(ValueDeserializer::from(value.clone())) {
                found.push((key, number, value.span()));
            }
        });
        found.sort_by_key(|(_, _, bytes)| bytes.start);
        found
    }

    /// Every key of the table and of the tables in it as `(key, value as written)`, in the order of the file.
    pub(super) fn entries(&self, text: &str) -> Vec<(String, String)> {
        let mut entries = Vec::new();
        leaves(&self.table, "", &mut |key, value| {
            let written = text.get(value.span()).unwrap_or_default();
            entries.push((value.span().start, key, written.trim().to_owned()));
        });
        entries.sort();
        entries
            .into_iter()
            .map(|(_, key, value)| (key, value))
            .collect()
    }

    /// The key whose value covers a place.
    fn key_at(&self, bytes: &Range<usize>) -> Option<String> {
        self.table
            .iter()
            .find(|(_, value)| value.span().start <= bytes.start && bytes.end <= value.span().end)
            .map(|(key, _)| key.get_ref().to_string())
    }

    fn missing(&self, key: &str) -> Box<Fault> {
        Fault::new(
            self.bytes.clone(),
            Problem::MissingKey {
                key: key.into(),
                table: self.name.clone(),
            },
        )
    }

    fn misread(&self, error: &toml::de::Error, key: &str, bytes: Range<usize>) -> Box<Fault> {
        // serde speaks of Rust's types, the reader of the file thinks of numbers.
        let message = error
            .message()
            .replace("expected f64", "expected a number")
            .replace("expected i64", "expected a whole number")
            .replace("expected struct ", "expected the table ");
        Fault::new(
            error.span().unwrap_or(bytes),
            Problem::Type {
                key: key.into(),
                message,
            },
        )
    }
}

/// Visits everything that is not a table, with its dotted key.
fn leaves(table: &DeTable<'_>, prefix: &str, visit: &mut dyn FnMut(String, &Spanned<DeValue<'_>>)) {
    for (key, value) in table {
        let key = format!("{prefix}{}", key.get_ref());
        match value.get_ref() {
            DeValue::Table(inner) => leaves(inner, &format!("{key}."), visit),
            _ => visit(key, value),
        }
    }
}
