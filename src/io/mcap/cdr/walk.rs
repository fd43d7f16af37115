//! Execution of the steps of a plan on the bytes of a message.

use super::plan::{CdrPlan, Item, List, Pick, Sinks, Step};
use crate::io::mcap::decode::{Damage, NameSearch, Reading};
use crate::io::mcap::route::Hop;
use crate::io::mcap::schema::Number;
use crate::io::mcap::tree::item_place;

/// The bytes of a number and their start, after padding from `at` on. An option, since an error that may own a text
/// would have to be dropped at every number.
#[inline(always)]
fn number_at<const N: usize>(data: &[u8], at: usize, align: usize) -> Option<(usize, [u8; N])> {
    let start = at.checked_next_multiple_of(align)?;
    let bytes = data.get(start..)?.first_chunk()?;
    Some((start, *bytes))
}

/// A position in a message.
pub struct CdrWalk<'a> {
    /// The message after its encapsulation header; alignment is relative to its start.
    pub data: &'a [u8],
    /// The position.
    pub at: usize,
    /// Whether numbers are big-endian.
    pub is_big: bool,
    /// The plan.
    pub plan: &'a CdrPlan,
    /// The result.
    pub reading: &'a mut Reading,
    /// The wanted name.
    pub names: NameSearch<'a>,
}

impl<'a> CdrWalk<'a> {
    /// Executes steps.
    pub fn follow(&mut self, steps: &'a [Step]) -> Result<(), Damage> {
        for step in steps {
            match step {
                Step::Skip(item) => self.skip(item)?,
                Step::Read(number, sinks) => self.read(*number, *sinks)?,
                Step::Name => self.compare()?,
                Step::Numbers(list, number) => self.numbers(list, *number)?,
                Step::Pick(pick) => self.pick(pick)?,
            }
        }
        Ok(())
    }

    /// Skips an item.
    pub fn skip(&mut self, item: &'a Item) -> Result<(), Damage> {
        match item {
            Item::Fixed(run) => self.forward(run.length_from(self.at)),
            Item::Text => {
                let length = self.count()?;
                self.forward(length);
            }
            Item::WideText => {
                let length = self.count()?;
                self.forward(length.saturating_mul(usize::from(self.plan.rules.wide)));
            }
            Item::Struct(index) => {
                let steps = &self.plan.structs[*index];
                self.follow(steps)?;
            }
            Item::List(list) => self.skip_list(list)?,
        }
        if self.at > self.data.len() {
            return Err(Damage::Short);
        }
        Ok(())
    }

    fn forward(&mut self, length: usize) {
        self.at = self.at.saturating_add(length);
    }

    fn skip_list(&mut self, list: &'a List) -> Result<(), Damage> {
        if list.size_ahead {
            let size = self.count()?;
            self.forward(size);
            return Ok(());
        }
        let count = self.length(list)?;
        self.skip_items(list, count)
    }

    /// Number of items of the list that starts here.
    fn length(&mut self, list: &List) -> Result<usize, Damage> {
        match list.count {
            Some(count) => Ok(count as usize),
            None => self.count(),
        }
    }

    fn skip_items(&mut self, list: &'a List, count: usize) -> Result<(), Damage> {
        match (&list.item, list.stride) {
            _ if count == 0 => {}
            (Item::Fixed(run), Some(stride)) => {
                self.forward(run.length_from(self.at));
                let stride = usize::try_from(stride).unwrap_or(usize::MAX);
                self.forward(stride.saturating_mul(count - 1));
            }
            (Item::Fixed(run), None) => {
                let count = u32::try_from(count).unwrap_or(u32::MAX);
                self.forward(run.repeat(count).length_from(self.at));
            }
            (Item::Text, _) => self.skip_texts(count)?,
            (item, _) => {
                // Each of them has its own length, so bytes run out before the count does.
                for _ in 0..count {
                    self.skip(item)?;
                }
            }
        }
        Ok(())
    }

    /// Skips consecutive texts.
    fn skip_texts(&mut self, count: usize) -> Result<(), Damage> {
        let (data, is_big) = (self.data, self.is_big);
        let align = 4.min(usize::from(self.plan.rules.largest_align));
        let mut at = self.at;
        for _ in 0..count {
            let Some((start, bytes)) = number_at(data, at, align) else {
                return Err(Damage::Short);
            };
            let length = match is_big {
                true => u32::from_be_bytes(bytes),
                false => u32::from_le_bytes(bytes),
            };
            at = (start + 4).saturating_add(length as usize);
        }
        self.at = at;
        Ok(())
    }

    fn pick(&mut self, pick: &'a Pick) -> Result<(), Damage> {
        let list = &pick.list;
        let start = self.at;
        if list.size_ahead {
            self.count()?;
        }
        let count = self.length(list)?;
        let index = match pick.which {
            Hop::All => {
                for _ in 0..count {
                    self.follow(&pick.inside)?;
                    if self.at > self.data.len() {
                        return Err(Damage::Short);
                    }
                }
                return Ok(());
            }
            Hop::Called => {
                let place = self.names.found.and_then(|place| i64::try_from(place).ok());
                place.ok_or_else(|| Damage::Malformed("no name was looked for".to_owned()))?
            }
            Hop::Item(index) => index,
            Hop::Field(_) => return Err(Damage::Malformed("a list has no fields".to_owned())),
        };
        self.skip_items(list, item_place(index, count)?)?;
        self.follow(&pick.inside)?;
        if pick.resume {
            self.at = start;
            self.skip_list(list)?;
        }
        Ok(())
    }

    fn numbers(&mut self, list: &'a List, number: Number) -> Result<(), Damage> {
        let count = self.length(list)?;
        let there = self.data.len().saturating_sub(self.at) / usize::from(number.size());
        if count > there {
            return Err(Damage::Short);
        }
        self.reading.values.reserve(count);
        for _ in 0..count {
            self.read(number, Sinks::VALUE)?;
        }
        Ok(())
    }

    fn compare(&mut self) -> Result<(), Damage> {
        let length = self.count()?;
        let end = self.at.checked_add(length);
        let Some(text) = end.and_then(|end| self.data.get(self.at..end)) else {
            return Err(Damage::Short);
        };
        // CDR includes the terminating zero of a text, ROS 1 does not.
        let text = text.strip_suffix(&[0]).unwrap_or(text);
        self.names.compare(text);
        self.at += length;
        Ok(())
    }

    #[inline]
    fn count(&mut self) -> Result<usize, Damage> {
        let bytes = self.take::<4>()?;
        Ok(if self.is_big {
            u32::from_be_bytes(bytes)
        } else {
            u32::from_le_bytes(bytes)
        } as usize)
    }

    /// The bytes of a number, after its padding.
    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Damage> {
        let align = N.min(usize::from(self.plan.rules.largest_align));
        let Some((start, bytes)) = number_at(self.data, self.at, align) else {
            return Err(Damage::Short);
        };
        self.at = start + N;
        Ok(bytes)
    }

    fn read(&mut self, number: Number, sinks: Sinks) -> Result<(), Damage> {
        macro_rules! take {
            ($kind:ty) => {{
                let bytes = self.take()?;
                if self.is_big {
                    <$kind>::from_be_bytes(bytes)
                } else {
                    <$kind>::from_le_bytes(bytes)
                }
            }};
        }
        // Stamps are integers, and their value as f64 does not matter; other numbers vice versa.
        let (value, whole) = match number {
            Number::Bool => {
                let whole = i64::from(take!(u8) != 0);
                (whole as f64, whole)
            }
            Number::I8 => both(take!(i8)),
            Number::U8 => both(take!(u8)),
            Number::I16 => both(take!(i16)),
            Number::U16 => both(take!(u16)),
            Number::I32 => both(take!(i32)),
            Number::U32 => both(take!(u32)),
            Number::I64 => {
                let whole = take!(i64);
                (whole as f64, whole)
            }
            Number::U64 => {
                let whole = take!(u64);
                (whole as f64, i64::try_from(whole).unwrap_or(i64::MAX))
            }
            Number::F32 => float(f64::from(take!(f32))),
            Number::F64 => float(take!(f64)),
        };
        if sinks.has(Sinks::VALUE) {
            self.reading.values.push(value);
        }
        if sinks.has(Sinks::SECONDS) {
            self.reading.seconds = Some(whole);
        }
        if sinks.has(Sinks::NANOSECONDS) {
            self.reading.nanoseconds = Some(whole);
        }
        if sinks.has(Sinks::SPACING) {
            self.reading.spacing = Some(value);
        }
        Ok(())
    }
}

fn both<T: Copy + Into<f64> + Into<i64>>(number: T) -> (f64, i64) {
    (number.into(), number.into())
}

fn float(value: f64) -> (f64, i64) {
    (value, value as i64)
}
