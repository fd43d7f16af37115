//! The fields of a protobuf message as they are on the wire.
//!
//! <https://protobuf.dev/programming-guides/encoding/>

use crate::io::mcap::decode::Damage;
use crate::io::mcap::schema::{Number, Wire};

/// Deepest nesting of groups.
const DEEPEST_GROUP: usize = 64;

/// The content of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content<'a> {
    /// A whole number of varying length.
    Varint(u64),
    /// Four bytes.
    Four([u8; 4]),
    /// Eight bytes.
    Eight([u8; 8]),
    /// Bytes with a length: text, a message, packed numbers.
    Bytes(&'a [u8]),
}

/// A message taken apart, one field after the other.
#[derive(Debug, Clone)]
pub struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    /// Starts at the front of a message.
    #[must_use]
    pub fn new(message: &'a [u8]) -> Self {
        Self { rest: message }
    }

    /// Number and content of the next field; none at the end.
    ///
    /// # Errors
    /// [`Damage`] if the bytes are no fields.
    pub fn field(&mut self) -> Result<Option<(u32, Content<'a>)>, Damage> {
        if self.rest.is_empty() {
            return Ok(None);
        }
        let (number, kind) = self.key()?;
        let content = match kind {
            0 => Content::Varint(self.varint()?),
            1 => Content::Eight(self.array()?),
            2 => Content::Bytes(self.bytes()?),
            3 => Content::Bytes(self.group(number)?),
            5 => Content::Four(self.array()?),
            other => return Err(malformed(&format!("wire type {other} is not known"))),
        };
        Ok(Some((number, content)))
    }

    fn key(&mut self) -> Result<(u32, u64), Damage> {
        let key = self.varint()?;
        let number = u32::try_from(key >> 3).ok().filter(|number| *number > 0);
        let number = number.ok_or_else(|| malformed("a field has no number"))?;
        Ok((number, key & 7))
    }

    fn varint(&mut self) -> Result<u64, Damage> {
        let mut value = 0_u64;
        for (at, byte) in self.rest.iter().enumerate().take(10) {
            value |= u64::from(byte & 0x7f) << (7 * at);
            if byte & 0x80 == 0 {
                self.rest = &self.rest[at + 1..];
                return Ok(value);
            }
        }
        Err(malformed("a number does not end"))
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Damage> {
        let (taken, rest) = self.rest.split_first_chunk().ok_or(Damage::Short)?;
        self.rest = rest;
        Ok(*taken)
    }

    fn bytes(&mut self) -> Result<&'a [u8], Damage> {
        let length = usize::try_from(self.varint()?).map_err(|_| Damage::Short)?;
        let (taken, rest) = self.rest.split_at_checked(length).ok_or(Damage::Short)?;
        self.rest = rest;
        Ok(taken)
    }

    /// The fields of a group, without its end.
    fn group(&mut self, number: u32) -> Result<&'a [u8], Damage> {
        let whole = self.rest;
        let mut open = vec![number];
        loop {
            let before = self.rest.len();
            let (number, kind) = self.key()?;
            match kind {
                0 => drop(self.varint()?),
                1 => drop(self.array::<8>()?),
                2 => drop(self.bytes()?),
                5 => drop(self.array::<4>()?),
                3 if open.len() < DEEPEST_GROUP => open.push(number),
                4 if open.pop() == Some(number) => {
                    if open.is_empty() {
                        return Ok(&whole[..whole.len() - before]);
                    }
                }
                _ => return Err(malformed("a group does not end")),
            }
        }
    }
}

fn malformed(why: &str) -> Damage {
    Damage::Malformed(why.to_owned())
}

/// A number as a value and, for stamps, as a whole number.
pub type Both = (f64, i64);

/// The number that a field's content is; none if it is of another type.
#[must_use]
pub fn number(kind: Number, wire: &Wire, content: Content) -> Option<Both> {
    match content {
        Content::Varint(raw) if !wire.fixed => varint(kind, wire, raw),
        Content::Four(raw) if kind == Number::F32 => {
            Some(float(f64::from(f32::from_le_bytes(raw))))
        }
        Content::Four(raw) if wire.fixed => match kind {
            Number::I32 => Some(whole(i32::from_le_bytes(raw).into())),
            Number::U32 => Some(whole(u32::from_le_bytes(raw).into())),
            _ => None,
        },
        Content::Eight(raw) if kind == Number::F64 => Some(float(f64::from_le_bytes(raw))),
        Content::Eight(raw) if wire.fixed => match kind {
            Number::I64 => Some(whole(i64::from_le_bytes(raw))),
            Number::U64 => Some(large(u64::from_le_bytes(raw))),
            _ => None,
        },
        _ => None,
    }
}

/// The numbers that a repeated field's content holds, packed or single.
///
/// # Errors
/// [`Damage`] if packed numbers are cut off.
pub fn numbers(
    kind: Number,
    wire: &Wire,
    content: Content,
    each: &mut impl FnMut(f64),
) -> Result<(), Damage> {
    let Content::Bytes(packed) = content else {
        if let Some((value, _)) = number(kind, wire, content) {
            each(value);
        }
        return Ok(());
    };
    let mut rest = Fields::new(packed);
    while !rest.rest.is_empty() {
        let content = match kind {
            Number::F32 => Content::Four(rest.array()?),
            Number::F64 => Content::Eight(rest.array()?),
            Number::I32 | Number::U32 if wire.fixed => Content::Four(rest.array()?),
            Number::I64 | Number::U64 if wire.fixed => Content::Eight(rest.array()?),
            _ => Content::Varint(rest.varint()?),
        };
        if let Some((value, _)) = number(kind, wire, content) {
            each(value);
        }
    }
    Ok(())
}

fn varint(kind: Number, wire: &Wire, raw: u64) -> Option<Both> {
    let signed = if wire.zigzag {
        (raw >> 1) as i64 ^ -((raw & 1) as i64)
    } else {
        raw as i64
    };
    match kind {
        Number::Bool => Some(whole(i64::from(raw != 0))),
        // A number of 32 bits is what the lower 32 bits say.
        Number::I32 => Some(whole(i64::from(signed as i32))),
        Number::U32 => Some(whole(i64::from(raw as u32))),
        Number::I64 => Some(whole(signed)),
        Number::U64 => Some(large(raw)),
        _ => None,
    }
}

fn whole(value: i64) -> Both {
    (value as f64, value)
}

fn large(value: u64) -> Both {
    (value as f64, i64::try_from(value).unwrap_or(i64::MAX))
}

fn float(value: f64) -> Both {
    (value, value as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Wire = Wire {
        number: 1,
        zigzag: false,
        fixed: false,
        absent: None,
    };

    #[test]
    fn fields_of_every_type() {
        // 1: 150; 2: "abc"; 3: group { 4: 1 }; 5: four bytes; 6: eight bytes
        let bytes = b"\x08\x96\x01\x12\x03abc\x1b\x20\x01\x1c\x2d\x01\0\0\0\x31\x02\0\0\0\0\0\0\0";
        let mut fields = Fields::new(bytes);
        let mut found = Vec::new();
        while let Some(field) = fields.field().unwrap() {
            found.push(field);
        }
        assert_eq!(
            found,
            [
                (1, Content::Varint(150)),
                (2, Content::Bytes(b"abc")),
                (3, Content::Bytes(b"\x20\x01")),
                (5, Content::Four([1, 0, 0, 0])),
                (6, Content::Eight([2, 0, 0, 0, 0, 0, 0, 0])),
            ]
        );
    }

    #[test]
    fn negative_zigzag_and_packed_numbers() {
        let zigzag = Wire {
            zigzag: true,
            ..PLAIN
        };
        let minus_two = Content::Varint(u64::MAX - 1);
        assert_eq!(number(Number::I32, &PLAIN, minus_two), Some((-2.0, -2)));
        assert_eq!(
            number(Number::I64, &zigzag, Content::Varint(3)),
            Some((-2.0, -2))
        );
        let mut found = Vec::new();
        let packed = Content::Bytes(b"\x01\xac\x02");
        numbers(Number::U32, &PLAIN, packed, &mut |value| found.push(value)).unwrap();
        assert_eq!(found, [1.0, 300.0]);
        let cut = numbers(Number::F64, &PLAIN, packed, &mut |_| {});
        assert_eq!(cut, Err(Damage::Short));
    }

    #[test]
    fn damage_is_found() {
        for bytes in [
            &b"\x00"[..],
            b"\x08",
            b"\x0f\x01",
            b"\x12\x05ab",
            b"\x0b\x14",
            b"\x0b",
        ] {
            assert!(Fields::new(bytes).field().is_err(), "{bytes:?}");
        }
        let endless = [0x80_u8; 20];
        assert!(Fields::new(&endless).field().is_err());
    }
}
