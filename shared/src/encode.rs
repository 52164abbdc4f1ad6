//! Postcard's bytes of a value, written piece by piece.
//!
//! The one serializer of the board, for frames, check sums and the store. Postcard's own is another
//! piece of code for every place its bytes go to, and takes an index on trust that a compiler for
//! size does not see through: a board's image would be larger, and not free of panics. Here a sink
//! that takes no more is noted and nothing else goes wrong, so that no field has to be followed by a
//! question whether it did. Bytes are read with postcard itself.
//!
//! Format: <https://postcard.jamesmunns.com/wire-format>.

use core::fmt;

use serde::ser::{
    Error, Serialize, SerializeMap, SerializeSeq, SerializeStruct, SerializeStructVariant,
    SerializeTuple, SerializeTupleStruct, SerializeTupleVariant, Serializer,
};

/// Gives the bytes of `value` to `sink`, piece by piece, until it takes no more; returns whether it
/// took all. Every list must know its length before, and no type may have an error of its own.
pub fn encode<T: Serialize + ?Sized>(value: &T, sink: &mut dyn FnMut(&[u8]) -> bool) -> bool {
    let mut encoder = Encoder {
        sink,
        refused: false,
    };
    value.serialize(&mut encoder).is_ok() && !encoder.refused
}

/// Writes the bytes of `value` into `buffer` and returns the part used; `None` if it is too small.
pub fn to_slice<'b, T: Serialize + ?Sized>(
    value: &T,
    buffer: &'b mut [u8],
) -> Option<&'b mut [u8]> {
    let mut end = 0;
    let fits = encode(value, &mut |piece| {
        let place = buffer.get_mut(end..).unwrap_or_default();
        let Some(place) = place.get_mut(..piece.len()) else {
            return false;
        };
        for (to, from) in place.iter_mut().zip(piece) {
            *to = *from;
        }
        end += piece.len();
        true
    });
    if fits { buffer.get_mut(..end) } else { None }
}

struct Encoder<'s> {
    sink: &'s mut dyn FnMut(&[u8]) -> bool,
    /// The sink took no more, or a list did not know its length.
    refused: bool,
}

/// What a type's own `Serialize` has to report. The encoder has no error: it only notes.
#[derive(Debug)]
struct OwnError;

impl fmt::Display for OwnError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an error of the type's own")
    }
}

impl core::error::Error for OwnError {}

impl Error for OwnError {
    fn custom<T: fmt::Display>(_: T) -> Self {
        Self
    }
}

impl Encoder<'_> {
    #[inline(never)]
    fn put(&mut self, bytes: &[u8]) -> Result<(), OwnError> {
        self.refused = self.refused || !(self.sink)(bytes);
        Ok(())
    }

    /// Seven bits per byte, the lowest first; the highest bit says that more follow.
    #[inline(never)]
    fn varint(&mut self, value: u32) -> Result<(), OwnError> {
        self.long_varint(value.into())
    }

    #[inline(never)]
    fn long_varint(&mut self, mut value: u64) -> Result<(), OwnError> {
        while value >= 0x80 {
            self.put(&[value as u8 | 0x80])?;
            value >>= 7;
        }
        self.put(&[value as u8])
    }

    /// Signed ones with the sign in the lowest bit.
    fn zigzag(&mut self, value: i64) -> Result<(), OwnError> {
        self.long_varint((value << 1 ^ value >> 63) as u64)
    }

    fn length(&mut self, length: Option<usize>) -> Result<(), OwnError> {
        self.refused |= length.is_none();
        self.varint(length.unwrap_or(0) as u32)
    }
}

impl<'e, 's> Serializer for &'e mut Encoder<'s> {
    type Ok = ();
    type Error = OwnError;
    type SerializeSeq = Self;
    type SerializeTuple = Self;
    type SerializeTupleStruct = Self;
    type SerializeTupleVariant = Self;
    type SerializeMap = Self;
    type SerializeStruct = Self;
    type SerializeStructVariant = Self;

    fn is_human_readable(&self) -> bool {
        false
    }

    fn serialize_bool(self, v: bool) -> Result<(), OwnError> {
        self.put(&[v.into()])
    }

    fn serialize_i8(self, v: i8) -> Result<(), OwnError> {
        self.put(&v.to_le_bytes())
    }

    fn serialize_i16(self, v: i16) -> Result<(), OwnError> {
        self.zigzag(v.into())
    }

    fn serialize_i32(self, v: i32) -> Result<(), OwnError> {
        self.zigzag(v.into())
    }

    fn serialize_i64(self, v: i64) -> Result<(), OwnError> {
        self.zigzag(v)
    }

    fn serialize_u8(self, v: u8) -> Result<(), OwnError> {
        self.put(&[v])
    }

    fn serialize_u16(self, v: u16) -> Result<(), OwnError> {
        self.varint(v.into())
    }

    fn serialize_u32(self, v: u32) -> Result<(), OwnError> {
        self.varint(v)
    }

    fn serialize_u64(self, v: u64) -> Result<(), OwnError> {
        self.long_varint(v)
    }

    fn serialize_f32(self, v: f32) -> Result<(), OwnError> {
        self.put(&v.to_le_bytes())
    }

    fn serialize_f64(self, v: f64) -> Result<(), OwnError> {
        self.put(&v.to_le_bytes())
    }

    fn serialize_char(self, v: char) -> Result<(), OwnError> {
        self.serialize_str(v.encode_utf8(&mut [0; 4]))
    }

    fn serialize_str(self, v: &str) -> Result<(), OwnError> {
        self.serialize_bytes(v.as_bytes())
    }

    fn serialize_bytes(self, v: &[u8]) -> Result<(), OwnError> {
        self.length(Some(v.len()))?;
        self.put(v)
    }

    fn serialize_none(self) -> Result<(), OwnError> {
        self.put(&[0])
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), OwnError> {
        self.put(&[1])?;
        value.serialize(self)
    }

    fn serialize_unit(self) -> Result<(), OwnError> {
        Ok(())
    }

    fn serialize_unit_struct(self, _: &'static str) -> Result<(), OwnError> {
        Ok(())
    }

    fn serialize_unit_variant(
        self,
        _: &'static str,
        index: u32,
        _: &'static str,
    ) -> Result<(), OwnError> {
        self.varint(index)
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        value: &T,
    ) -> Result<(), OwnError> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        index: u32,
        _: &'static str,
        value: &T,
    ) -> Result<(), OwnError> {
        self.varint(index)?;
        value.serialize(self)
    }

    fn serialize_seq(self, length: Option<usize>) -> Result<Self, OwnError> {
        self.length(length)?;
        Ok(self)
    }

    fn serialize_tuple(self, _: usize) -> Result<Self, OwnError> {
        Ok(self)
    }

    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<Self, OwnError> {
        Ok(self)
    }

    fn serialize_tuple_variant(
        self,
        _: &'static str,
        index: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self, OwnError> {
        self.varint(index)?;
        Ok(self)
    }

    fn serialize_map(self, length: Option<usize>) -> Result<Self, OwnError> {
        self.length(length)?;
        Ok(self)
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Self, OwnError> {
        Ok(self)
    }

    fn serialize_struct_variant(
        self,
        _: &'static str,
        index: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self, OwnError> {
        self.varint(index)?;
        Ok(self)
    }

    fn collect_str<T: fmt::Display + ?Sized>(self, _: &T) -> Result<(), OwnError> {
        self.length(None)
    }
}

/// What stands between the elements of anything composed: nothing.
macro_rules! one_after_the_other {
    ($($of:ident, $element:ident $(($key:ty))?;)*) => {$(
        impl $of for &mut Encoder<'_> {
            type Ok = ();
            type Error = OwnError;

            fn $element<T: Serialize + ?Sized>(&mut self, $(_: $key,)? value: &T) -> Result<(), OwnError> {
                value.serialize(&mut **self)
            }

            fn end(self) -> Result<(), OwnError> {
                Ok(())
            }
        }
    )*};
}

one_after_the_other! {
    SerializeSeq, serialize_element;
    SerializeTuple, serialize_element;
    SerializeTupleStruct, serialize_field;
    SerializeTupleVariant, serialize_field;
    SerializeStruct, serialize_field(&'static str);
    SerializeStructVariant, serialize_field(&'static str);
}

impl SerializeMap for &mut Encoder<'_> {
    type Ok = ();
    type Error = OwnError;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), OwnError> {
        key.serialize(&mut **self)
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), OwnError> {
        value.serialize(&mut **self)
    }

    fn end(self) -> Result<(), OwnError> {
        Ok(())
    }
}
