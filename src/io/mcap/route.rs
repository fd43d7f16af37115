//! Paths to numbers in messages of one type.

use super::path::{self, PathPart, Slice};
use super::schema::leaves::{self, Leaf};
use super::schema::{Field, FieldKind, Number, Schema};
use crate::failure::did_you_mean;
use crate::print::some_of;

/// Path to a field through fields, by their names, and its type.
pub(super) fn way<'a>(schema: &'a Schema, names: &[&str]) -> Option<(Vec<Hop>, &'a FieldKind)> {
    let (last, above) = names.split_last()?;
    let mut fields = &schema.root().fields;
    let mut hops = Vec::with_capacity(names.len());
    for name in above {
        let place = position(fields, name)?;
        let FieldKind::Struct(inner) = fields[place].kind else {
            return None;
        };
        hops.push(Hop::Field(place));
        fields = &schema.structs[inner].fields;
    }
    let place = position(fields, last)?;
    hops.push(Hop::Field(place));
    Some((hops, &fields[place].kind))
}

/// Maximum number of leaves listed in an error message.
const LISTED: usize = 40;

/// One step of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hop {
    /// Into a field, by its index in the type.
    Field(usize),
    /// To one item, from the start or (negative) from the end.
    Item(i64),
    /// To the item whose name was found.
    Called,
    /// Through all items.
    All,
}

/// Texts of a message, among which one is searched for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lookup {
    /// Path to the texts.
    pub hops: Vec<Hop>,
    /// The text.
    pub name: String,
}

/// Path to a number, or to several.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// Path as text, with all choices made.
    pub text: String,
    /// The path.
    pub hops: Vec<Hop>,
    /// Selection among several values.
    pub slice: Slice,
    /// What must be found first.
    pub lookup: Option<Lookup>,
    /// Type of number.
    pub number: Number,
    /// Unit stated by the definition.
    pub unit: Option<String>,
    /// Names of the types on the path, from that of the message to the one that contains the
    /// number.
    pub types: Vec<String>,
    /// Names of the fields on the path.
    pub fields: Vec<String>,
}

impl Route {
    /// Whether a message gives several values.
    pub fn is_whole_list(&self) -> bool {
        self.hops.contains(&Hop::All)
    }

    /// Finds the path to a field. Without any parts it is the only number there is.
    ///
    /// # Errors
    /// A sentence with the available fields and a suggestion.
    pub fn find(schema: &Schema, parts: &[PathPart]) -> Result<Self, String> {
        let only;
        let parts = if parts.is_empty() {
            only = only_leaf(schema)?;
            &only[..]
        } else {
            parts
        };
        let mut walk = RouteWalk::new(schema, parts);
        for place in 0..parts.len() {
            walk.step(place)?;
        }
        walk.finish()
    }
}

fn only_leaf(schema: &Schema) -> Result<Vec<PathPart>, String> {
    let (found, _) = leaves::leaves(schema);
    let mut numbers = found.iter().filter(|leaf| !leaf.is_stamp);
    match (numbers.next(), numbers.next()) {
        (Some(leaf), None) => path::parse(&leaf.with_items("[:]")),
        _ => Err(format!(
            "its messages have several numbers; choose one with --topic TOPIC --field FIELD, or in one as TOPIC.FIELD; {}",
            list(&found)
        )),
    }
}

/// The available fields, for the end of an error message.
fn list(found: &[Leaf]) -> String {
    if found.is_empty() {
        return "there is no number in its messages".to_owned();
    }
    let each = found.iter();
    let each = each.map(|leaf| format!("{} ({})", leaf.path, leaf.number.name()));
    format!("there are: {}", some_of(each, found.len(), LISTED))
}

struct RouteWalk<'a> {
    schema: &'a Schema,
    parts: &'a [PathPart],
    kind: FieldKind,
    hops: Vec<Hop>,
    slice: Slice,
    lookup: Option<Lookup>,
    unit: Option<String>,
    types: Vec<String>,
    fields: Vec<String>,
    /// The type that contains the last field.
    owner: usize,
    /// Number of hops to it.
    owner_hops: usize,
}

impl<'a> RouteWalk<'a> {
    fn new(schema: &'a Schema, parts: &'a [PathPart]) -> Self {
        Self {
            schema,
            parts,
            kind: FieldKind::Struct(schema.root),
            hops: Vec::new(),
            slice: Slice::ALL,
            lookup: None,
            unit: None,
            types: vec![schema.root().name.clone()],
            fields: Vec::new(),
            owner: schema.root,
            owner_hops: 0,
        }
    }

    fn step(&mut self, place: usize) -> Result<(), String> {
        let parts = self.parts;
        match &parts[place] {
            PathPart::Name(name) => self.field(place, name),
            PathPart::Index(index) => self.item(place, Hop::Item(*index)),
            PathPart::Slice(slice) => {
                if self.hops.contains(&Hop::All) {
                    return Err("a field can have only one [:]".to_owned());
                }
                self.slice = *slice;
                self.item(place, Hop::All)
            }
            PathPart::Called { key, name } => self.called(place, key.as_deref(), name),
        }
    }

    fn field(&mut self, place: usize, name: &str) -> Result<(), String> {
        let FieldKind::Struct(index) = self.kind else {
            let before = path::text(&self.parts[..place]);
            let why = match &self.kind {
                FieldKind::Many(_) => {
                    format!("\"{before}\" is a list: choose an item, as {before}[0]")
                }
                _ => format!("\"{before}\" has no fields"),
            };
            return Err(self.miss(&why));
        };
        let fields = &self.schema.structs[index].fields;
        let Some(found) = position(fields, name) else {
            let hint = did_you_mean(name, fields.iter().map(|f| f.name.as_str()));
            return Err(self.miss(&format!("there is no field \"{name}\"{hint}")));
        };
        let field = &fields[found];
        self.owner = index;
        self.owner_hops = self.hops.len();
        self.hops.push(Hop::Field(found));
        self.kind = field.kind.clone();
        self.unit = field.unit.clone();
        self.fields.push(field.name.clone());
        if let FieldKind::Struct(inner) = innermost(&field.kind) {
            self.types.push(self.schema.structs[*inner].name.clone());
        }
        Ok(())
    }

    fn item(&mut self, place: usize, hop: Hop) -> Result<(), String> {
        let before = path::text(&self.parts[..place]);
        let FieldKind::Many(many) = &self.kind else {
            return Err(self.miss(&format!("\"{before}\" is not a list")));
        };
        if let (Some(count), Hop::Item(index)) = (many.count, hop) {
            let count = i64::from(count);
            if !(-count..count).contains(&index) {
                return Err(self.miss(&format!("\"{before}\" has {count} items, but no [{index}]")));
            }
        }
        self.kind = many.item.clone();
        self.hops.push(hop);
        Ok(())
    }

    /// The names are in a list next to this one, or in a field of its items.
    fn called(&mut self, place: usize, key: Option<&str>, name: &str) -> Result<(), String> {
        if self.lookup.is_some() {
            return Err("only one item can be chosen by name".to_owned());
        }
        let keys: &[&str] = match key {
            Some(ref key) => std::slice::from_ref(key),
            None => &["name", "names", "joint_names", "key"],
        };
        let hops = keys.iter().find_map(|key| self.names(key));
        let Some(hops) = hops else {
            let wanted = key.unwrap_or("name");
            return Err(self.miss(&format!(
                "there are no texts \"{wanted}\" beside or in \"{}\" in which to find \"{name}\"",
                path::text(&self.parts[..place])
            )));
        };
        self.item(place, Hop::Called)?;
        self.lookup = Some(Lookup {
            hops,
            name: name.to_owned(),
        });
        Ok(())
    }

    fn names(&self, key: &str) -> Option<Vec<Hop>> {
        let FieldKind::Many(many) = &self.kind else {
            return None;
        };
        if let FieldKind::Struct(inner) = many.item {
            let fields = &self.schema.structs[inner].fields;
            let found = position(fields, key)?;
            let is_text = fields[found].kind == FieldKind::Text;
            let mut hops = self.hops.clone();
            hops.extend([Hop::All, Hop::Field(found)]);
            return is_text.then_some(hops);
        }
        let fields = &self.schema.structs[self.owner].fields;
        let found = position(fields, key)?;
        let is_texts =
            matches!(&fields[found].kind, FieldKind::Many(many) if many.item == FieldKind::Text);
        let mut hops = self.hops[..self.owner_hops].to_vec();
        hops.extend([Hop::Field(found), Hop::All]);
        is_texts.then_some(hops)
    }

    fn finish(self) -> Result<Route, String> {
        let text = path::text(self.parts);
        let number = match &self.kind {
            FieldKind::Number(number) => *number,
            FieldKind::Many(many) if matches!(many.item, FieldKind::Number(_)) => {
                return Err(self.miss(&format!(
                    "\"{text}\" is a list of numbers: choose one item, as {text}[0] or \
                     {text}[-1], or all as {text}[:]"
                )));
            }
            FieldKind::Text | FieldKind::WideText => {
                return Err(self.miss(&format!("\"{text}\" is text")));
            }
            _ => return Err(self.miss(&format!("\"{text}\" is not one number"))),
        };
        Ok(Route {
            text,
            hops: self.hops,
            slice: self.slice,
            lookup: self.lookup,
            number,
            unit: self.unit,
            types: self.types,
            fields: self.fields,
        })
    }

    /// An error with the available fields below the part that was found.
    fn miss(&self, why: &str) -> String {
        let (found, _) = leaves::leaves(self.schema);
        let start = self.fields.join(".");
        let (mut below, mut rest): (Vec<_>, Vec<_>) = found
            .into_iter()
            .partition(|leaf| !start.is_empty() && leaf.path.starts_with(&start));
        below.append(&mut rest);
        format!("{why}; {}", list(&below))
    }
}

fn position(fields: &[Field], name: &str) -> Option<usize> {
    fields.iter().position(|field| field.name == name)
}

fn innermost(mut kind: &FieldKind) -> &FieldKind {
    while let FieldKind::Many(many) = kind {
        kind = &many.item;
    }
    kind
}

#[cfg(test)]
#[path = "route_tests.rs"]
mod tests;
