//! The keys that a type reads, asked of its own `Deserialize`: no second list that could fall behind.

use serde::de::value::Error;
use serde::de::{DeserializeOwned, Deserializer, Error as _, Visitor};

/// Names of the fields of a struct; `None` for anything else.
pub(super) fn fields_of<T: DeserializeOwned>() -> Option<&'static [&'static str]> {
    let mut found = None;
    // Always an error: the question is what it asks for on the way.
    drop(T::deserialize(Listener(&mut found)));
    found
}

struct Listener<'f>(&'f mut Option<&'static [&'static str]>);

impl<'de> Deserializer<'de> for Listener<'_> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, _visitor: V) -> Result<V::Value, Error> {
        Err(Error::custom("only listening"))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        fields: &'static [&'static str],
        _visitor: V,
    ) -> Result<V::Value, Error> {
        *self.0 = Some(fields);
        Err(Error::custom("only listening"))
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit
        unit_struct newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

#[cfg(test)]
mod tests {
    use super::fields_of;
    use crate::machine::{ThreeRrr, TwoMassAxis};

    #[test]
    fn knows_what_a_machine_reads() {
        let fields = fields_of::<ThreeRrr>().expect("a struct");
        assert!(fields.contains(&"gauge_position") && !fields.contains(&"elastic_damping_ratio"));
        assert_eq!(fields_of::<TwoMassAxis>().map(<[_]>::len), Some(5));
        assert_eq!(fields_of::<f64>(), None);
    }
}
