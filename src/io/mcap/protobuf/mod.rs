//! Messages of protobuf.

pub mod wire;

use std::borrow::Cow;
use std::sync::Arc;

use super::decode::{Damage, Names, Reading, Targets};
use super::route::Hop;
use super::schema::{Field, Kind, Schema, Wire};
use wire::{Both, Content, Fields};

/// Takes wanted numbers out of messages of one type.
pub struct Decoder {
    schema: Arc<Schema>,
    targets: Targets,
    /// Numbers of the list an item is picked from.
    list: Vec<f64>,
}

impl Decoder {
    /// Prepares for messages of one type.
    #[must_use]
    pub fn new(schema: &Arc<Schema>, targets: Targets) -> Self {
        Self {
            schema: Arc::clone(schema),
            targets,
            list: Vec::new(),
        }
    }

    /// Reads a message.
    ///
    /// # Errors
    /// [`Damage`] if the message does not hold the value.
    pub fn read(&mut self, message: &[u8], reading: &mut Reading) -> Result<(), Damage> {
        let value = &self.targets.value;
        let mut found = None;
        if let Some(lookup) = &value.lookup {
            let names = Names::search(lookup.name.as_bytes(), |names| {
                let mut search = Search(names);
                search.run(&self.schema, self.schema.root, &lookup.hops, message)?;
                Ok(search.0)
            })?;
            found = names.found;
        }
        let mut collect = Collect {
            schema: &self.schema,
            found,
            list: &mut self.list,
            values: &mut reading.values,
        };
        collect.run(self.schema.root, &value.hops, message)?;
        let single = |hops: &[Hop]| single(&self.schema, self.schema.root, hops, message);
        if let Some(stamp) = &self.targets.stamp {
            reading.seconds = single(&stamp.seconds)?.map(|(_, whole)| whole);
            reading.nanoseconds = single(&stamp.nanoseconds)?.map(|(_, whole)| whole);
        }
        if let Some(spacing) = &self.targets.spacing {
            reading.spacing = single(spacing)?.map(|(value, _)| value);
        }
        Ok(())
    }
}

/// A field of a type, its wire form, and what is left of the way behind it.
fn step<'a>(
    schema: &'a Schema,
    index: usize,
    hops: &'a [Hop],
) -> Result<(&'a Field, Wire, &'a [Hop]), Damage> {
    let lost = || Damage::Malformed("the way to the field is lost".to_owned());
    let (Hop::Field(place), rest) = hops.split_first().ok_or_else(lost)? else {
        return Err(lost());
    };
    let field = schema.structs[index].fields.get(*place).ok_or_else(lost)?;
    Ok((field, field.wire.ok_or_else(lost)?, rest))
}

/// All of a message's bytes in a field. A message given in parts is its parts put together.
fn inner<'a>(message: &'a [u8], number: u32) -> Result<Option<Cow<'a, [u8]>>, Damage> {
    let mut whole: Option<Cow<[u8]>> = None;
    let mut fields = Fields::new(message);
    while let Some((found, content)) = fields.field()? {
        if let (true, Content::Bytes(bytes)) = (found == number, content) {
            match &mut whole {
                None => whole = Some(Cow::Borrowed(bytes)),
                Some(before) => before.to_mut().extend_from_slice(bytes),
            }
        }
    }
    Ok(whole)
}

/// The number at the end of a way without lists; none if it is not set.
fn single(
    schema: &Schema,
    index: usize,
    hops: &[Hop],
    message: &[u8],
) -> Result<Option<Both>, Damage> {
    let (field, wire, rest) = step(schema, index, hops)?;
    match &field.kind {
        Kind::Struct(next) => match inner(message, wire.number)? {
            Some(inner) => single(schema, *next, rest, &inner),
            None => Ok(None),
        },
        Kind::Number(kind) => {
            let mut last = wire.absent.map(|value| (value, value as i64));
            let mut fields = Fields::new(message);
            while let Some((found, content)) = fields.field()? {
                if found == wire.number
                    && let Some(both) = wire::number(*kind, &wire, content)
                {
                    last = Some(both);
                }
            }
            Ok(last)
        }
        _ => Ok(None),
    }
}

struct Collect<'a> {
    schema: &'a Schema,
    found: Option<usize>,
    list: &'a mut Vec<f64>,
    values: &'a mut Vec<f64>,
}

impl Collect<'_> {
    fn run(&mut self, index: usize, hops: &[Hop], message: &[u8]) -> Result<(), Damage> {
        let schema = self.schema;
        let (field, wire, rest) = step(schema, index, hops)?;
        match &field.kind {
            Kind::Struct(next) => {
                let inner = inner(message, wire.number)?.ok_or(Damage::Absent)?;
                self.run(*next, rest, &inner)
            }
            Kind::Number(_) => {
                let (value, _) = single(schema, index, hops, message)?.ok_or(Damage::Absent)?;
                self.values.push(value);
                Ok(())
            }
            Kind::Many(many) => match &many.item {
                Kind::Struct(next) => self.messages(*next, wire.number, rest, message),
                Kind::Number(kind) => {
                    let list = &mut *self.list;
                    list.clear();
                    let mut fields = Fields::new(message);
                    while let Some((found, content)) = fields.field()? {
                        if found == wire.number {
                            wire::numbers(*kind, &wire, content, &mut |value| list.push(value))?;
                        }
                    }
                    self.pick(rest)
                }
                _ => Err(Damage::Absent),
            },
            _ => Err(Damage::Absent),
        }
    }

    fn pick(&mut self, rest: &[Hop]) -> Result<(), Damage> {
        match place(rest, self.found, self.list.len())? {
            Some(place) => self.values.push(self.list[place]),
            None => self.values.extend_from_slice(self.list),
        }
        Ok(())
    }

    fn messages(
        &mut self,
        next: usize,
        number: u32,
        rest: &[Hop],
        message: &[u8],
    ) -> Result<(), Damage> {
        let mut items = Vec::new();
        let mut fields = Fields::new(message);
        while let Some((found, content)) = fields.field()? {
            if let (true, Content::Bytes(bytes)) = (found == number, content) {
                items.push(bytes);
            }
        }
        let behind = rest.get(1..).unwrap_or(&[]);
        match place(rest, self.found, items.len())? {
            Some(place) => self.run(next, behind, items[place]),
            None => items
                .iter()
                .try_for_each(|item| self.run(next, behind, item)),
        }
    }
}

/// Which item is wanted; none for all.
fn place(hops: &[Hop], found: Option<usize>, count: usize) -> Result<Option<usize>, Damage> {
    let index = match hops.first() {
        Some(Hop::Item(index)) => *index,
        Some(Hop::Called) => found
            .and_then(|place| i64::try_from(place).ok())
            .unwrap_or(i64::MAX),
        _ => return Ok(None),
    };
    let from_front = if index < 0 {
        index.saturating_add(count as i64)
    } else {
        index
    };
    match usize::try_from(from_front) {
        Ok(place) if place < count => Ok(Some(place)),
        _ => Err(Damage::NoItem {
            index,
            count: count as u64,
        }),
    }
}

/// Looks for a text among those at the end of a way.
struct Search<'a>(Names<'a>);

impl Search<'_> {
    fn run(
        &mut self,
        schema: &Schema,
        index: usize,
        hops: &[Hop],
        message: &[u8],
    ) -> Result<(), Damage> {
        let (field, wire, rest) = step(schema, index, hops)?;
        let behind = rest.get(1..).unwrap_or(&[]);
        let mut fields = Fields::new(message);
        let mut text = None;
        while let Some((found, content)) = fields.field()? {
            let (true, Content::Bytes(bytes)) = (found == wire.number, content) else {
                continue;
            };
            match &field.kind {
                Kind::Text => text = Some(bytes),
                Kind::Struct(next) => self.run(schema, *next, rest, bytes)?,
                Kind::Many(many) => match many.item {
                    Kind::Struct(next) => {
                        let before = self.0.seen;
                        self.run(schema, next, behind, bytes)?;
                        // An item without a name is an item all the same.
                        self.0.seen = before + 1;
                    }
                    _ => self.0.compare(bytes),
                },
                _ => {}
            }
        }
        if let Some(text) = text {
            self.0.compare(text);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
