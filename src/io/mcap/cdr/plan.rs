//! Compilation of a message's layout into the fewest steps to the wanted numbers.

use super::size::PaddedSize;
use crate::io::mcap::decode::Targets;
use crate::io::mcap::route::Hop;
use crate::io::mcap::schema::{FieldKind, Number, Schema};

/// Rules of data layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rules {
    /// Largest padding: 8 in CDR, 4 in XCDR2, 1 in ROS 1.
    pub largest_align: u8,
    /// Size of a type without fields: 1 in ROS 2, 0 in ROS 1.
    pub empty: u8,
    /// Size of a wide character.
    pub wide: u8,
    /// Whether lists of anything but numbers begin with their size in bytes, as in XCDR2.
    pub size_ahead: bool,
}

/// Destinations of a number, as a bit set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sinks(u8);

impl Sinks {
    /// The values.
    pub const VALUE: Self = Self(1);
    /// Seconds of the stamp.
    pub const SECONDS: Self = Self(2);
    /// Nanoseconds of the stamp.
    pub const NANOSECONDS: Self = Self(4);
    /// The spacing of samples.
    pub const SPACING: Self = Self(8);
    /// The names that are searched.
    pub const NAME: Self = Self(16);

    /// Whether any of the others is included.
    pub fn has(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
}

/// An item to be skipped.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// Of a size that follows from its start.
    Fixed(PaddedSize),
    /// Text.
    Text,
    /// Text of wide characters.
    WideText,
    /// A type of variable size, by its index.
    Struct(usize),
    /// A list.
    List(Box<List>),
}

/// A list, or an array of items of variable size.
#[derive(Debug, Clone, PartialEq)]
pub struct List {
    /// Number of items if it is not in the message.
    pub count: Option<u32>,
    /// Its items.
    pub item: Item,
    /// Length of each item except the first, if constant.
    pub stride: Option<u64>,
    /// Whether its size in bytes precedes it.
    pub size_ahead: bool,
}

/// One step through a message.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// Skips an item.
    Skip(Item),
    /// Reads a number.
    Read(Number, Sinks),
    /// Compares a text with the wanted name.
    Name,
    /// Enters an item of a list.
    Pick(Box<Pick>),
    /// Reads all numbers of a list.
    Numbers(Box<List>, Number),
}

/// Selection of list items.
#[derive(Debug, Clone, PartialEq)]
pub struct Pick {
    /// The list.
    pub list: List,
    /// The item, or all.
    pub which: Hop,
    /// Steps in the item.
    pub inside: Vec<Step>,
    /// Whether something after the list is wanted, too.
    pub resume: bool,
}

/// Steps to the wanted numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct CdrPlan {
    /// Rules of data layout.
    pub rules: Rules,
    /// The steps.
    pub steps: Vec<Step>,
    /// Steps that find the named item.
    pub lookup: Vec<Step>,
    /// Steps over each type of variable size.
    pub structs: Vec<Vec<Step>>,
    /// The whole message.
    pub whole: Item,
}

impl CdrPlan {
    /// Plans the steps through messages of a non-recursive type.
    pub fn new(schema: &Schema, targets: &Targets, rules: Rules) -> Self {
        let mut planner = Planner {
            schema,
            rules,
            items: vec![None; schema.structs.len()],
            structs: vec![Vec::new(); schema.structs.len()],
        };
        let mut wanted = vec![(&targets.value.hops[..], Sinks::VALUE)];
        if let Some(stamp) = &targets.stamp {
            wanted.push((&stamp.seconds, Sinks::SECONDS));
            wanted.push((&stamp.nanoseconds, Sinks::NANOSECONDS));
        }
        if let Some(spacing) = &targets.spacing {
            wanted.push((spacing, Sinks::SPACING));
        }
        let names = targets.value.lookup.as_ref();
        let names = names.map(|lookup| (&lookup.hops[..], Sinks::NAME));
        let names: Vec<_> = names.into_iter().collect();
        let whole = planner.item(&FieldKind::Struct(schema.root));
        Self {
            rules,
            steps: planner.steps(&FieldKind::Struct(schema.root), &wanted, false),
            lookup: match names.is_empty() {
                true => Vec::new(),
                false => planner.steps(&FieldKind::Struct(schema.root), &names, false),
            },
            structs: planner.structs,
            whole,
        }
    }
}

type CdrTarget<'a> = (&'a [Hop], Sinks);

struct Planner<'a> {
    schema: &'a Schema,
    rules: Rules,
    /// How to skip each type, once known.
    items: Vec<Option<Item>>,
    structs: Vec<Vec<Step>>,
}

impl Planner<'_> {
    fn item(&mut self, kind: &FieldKind) -> Item {
        let largest = self.rules.largest_align;
        let align = |size: u8| size.min(largest);
        match kind {
            FieldKind::Number(number) => {
                Item::Fixed(PaddedSize::of(number.size(), align(number.size())))
            }
            FieldKind::Text => Item::Text,
            FieldKind::WideText => Item::WideText,
            FieldKind::Nothing => Item::Fixed(PaddedSize::NONE),
            FieldKind::Struct(index) => self.structure(*index),
            FieldKind::Many(many) => {
                let list = self.list(&many.item, many.count);
                match (&list.item, list.count) {
                    // An empty array takes no bytes, whatever its items.
                    (_, Some(0)) if !list.size_ahead => Item::Fixed(PaddedSize::NONE),
                    (Item::Fixed(run), Some(count)) => {
                        let items = run.repeat(count);
                        let size = PaddedSize::of(4, align(4));
                        Item::Fixed(if list.size_ahead {
                            size.then(&items)
                        } else {
                            items
                        })
                    }
                    _ => Item::List(Box::new(list)),
                }
            }
        }
    }

    fn list(&mut self, item: &FieldKind, count: Option<u32>) -> List {
        let size_ahead = self.rules.size_ahead && !matches!(item, FieldKind::Number(_));
        let item = self.item(item);
        List {
            count,
            stride: match &item {
                Item::Fixed(run) => run.stride(),
                _ => None,
            },
            item,
            size_ahead,
        }
    }

    fn structure(&mut self, index: usize) -> Item {
        if let Some(item) = &self.items[index] {
            return item.clone();
        }
        let schema = self.schema;
        let mut steps = Vec::new();
        if schema.structs[index].fields.is_empty() {
            push_skip(&mut steps, Item::Fixed(PaddedSize::of(self.rules.empty, 1)));
        }
        for field in &schema.structs[index].fields {
            let item = self.item(&field.kind);
            push_skip(&mut steps, item);
        }
        let item = match &steps[..] {
            [] => Item::Fixed(PaddedSize::NONE),
            [Step::Skip(Item::Fixed(run))] => Item::Fixed(*run),
            _ => {
                self.structs[index] = steps;
                Item::Struct(index)
            }
        };
        self.items[index] = Some(item.clone());
        item
    }

    /// Steps to the wanted parts of data of a kind, and to their end if something follows.
    fn steps(&mut self, kind: &FieldKind, wanted: &[CdrTarget], to_end: bool) -> Vec<Step> {
        match kind {
            FieldKind::Struct(index) => self.fields(*index, wanted, to_end),
            FieldKind::Many(many) => {
                let list = self.list(&many.item, many.count);
                vec![self.pick(list, &many.item, wanted, to_end)]
            }
            FieldKind::Number(number) => {
                let sinks = wanted.iter().fold(0, |bits, (_, sinks)| bits | sinks.0);
                vec![Step::Read(*number, Sinks(sinks))]
            }
            FieldKind::Text if wanted.iter().any(|(_, sinks)| sinks.has(Sinks::NAME)) => {
                vec![Step::Name]
            }
            other => vec![Step::Skip(self.item(other))],
        }
    }

    fn fields(&mut self, index: usize, wanted: &[CdrTarget], to_end: bool) -> Vec<Step> {
        let schema = self.schema;
        let fields = &schema.structs[index].fields;
        let place = |hops: &[Hop]| match hops.first() {
            Some(Hop::Field(place)) => Some(*place),
            _ => None,
        };
        let last = wanted.iter().filter_map(|(hops, _)| place(hops)).max();
        let end = if to_end {
            fields.len()
        } else {
            last.map_or(0, |last| last + 1)
        };
        let mut steps = Vec::new();
        for (at, field) in fields.iter().enumerate().take(end) {
            let inside: Vec<CdrTarget> = wanted
                .iter()
                .filter(|(hops, _)| place(hops) == Some(at))
                .map(|(hops, sinks)| (&hops[1..], *sinks))
                .collect();
            if inside.is_empty() {
                let item = self.item(&field.kind);
                push_skip(&mut steps, item);
            } else {
                let more = to_end || last.is_some_and(|last| at < last);
                steps.append(&mut self.steps(&field.kind, &inside, more));
            }
        }
        steps
    }

    fn pick(&mut self, list: List, item: &FieldKind, wanted: &[CdrTarget], resume: bool) -> Step {
        // Only the value or the names are in lists, so all wanted parts share the same hop.
        let which = wanted.first().and_then(|(hops, _)| hops.first());
        let which = which.copied().unwrap_or(Hop::All);
        if let (Hop::All, FieldKind::Number(number)) = (which, item) {
            return Step::Numbers(Box::new(list), *number);
        }
        let inside: Vec<CdrTarget> = wanted
            .iter()
            .map(|(hops, sinks)| (hops.get(1..).unwrap_or(&[]), *sinks))
            .collect();
        Step::Pick(Box::new(Pick {
            inside: self.steps(item, &inside, which == Hop::All),
            list,
            which,
            resume,
        }))
    }
}

/// Adds a skip, merged with the previous one if both are of fixed size.
fn push_skip(steps: &mut Vec<Step>, item: Item) {
    if let (Some(Step::Skip(Item::Fixed(last))), Item::Fixed(next)) = (steps.last_mut(), &item) {
        *last = last.then(next);
        return;
    }
    if item != Item::Fixed(PaddedSize::NONE) {
        steps.push(Step::Skip(item));
    }
}
