//! Definitions in OMG IDL, as used by ROS 2.
//!
//! <https://design.ros2.org/articles/idl_interface_definition.html>; several definitions are joined
//! with lines of `=` and `IDL: package/msg/Name` between them.

use std::collections::HashMap;

use super::token::{SchemaToken, tokens};
use super::{Field, FieldKind, MOST_STRUCTS, Number, Schema, SchemaError, Struct};

/// Maximum number of dimensions or levels of a list.
const DEEPEST_LIST: usize = 16;

/// Parses the definition of the type `name` and of everything it refers to.
///
/// # Errors
/// [`SchemaError`] with the line.
pub fn read(name: &str, text: &str) -> Result<Schema, SchemaError> {
    let tokens = tokens(text)?;
    let mut declared = Declared::default();
    let mut parser = IdlParser {
        tokens: &tokens,
        at: 0,
        scope: Vec::new(),
        declared: &mut declared,
    };
    parser.file()?;
    resolve(&declared, &name.replace('/', "::"))
}

/// A type as written.
#[derive(Debug, Clone)]
enum Written {
    FieldKind(FieldKind),
    /// A name and the scope in which it is used.
    Named(String, Vec<String>, usize),
    Many(Box<Written>, Option<u32>),
}

struct Member {
    name: String,
    kind: Written,
    unit: Option<String>,
}

/// All declarations, by full name.
#[derive(Default)]
struct Declared {
    structs: Vec<(String, Vec<Member>)>,
    by_name: HashMap<String, usize>,
    aliases: HashMap<String, Written>,
    constants: HashMap<String, u32>,
}

struct IdlParser<'a, 'd> {
    tokens: &'a [SchemaToken<'a>],
    at: usize,
    scope: Vec<String>,
    declared: &'d mut Declared,
}

impl<'a> IdlParser<'a, '_> {
    fn file(&mut self) -> Result<(), SchemaError> {
        while self.at < self.tokens.len() {
            self.declaration()?;
        }
        match self.scope.last() {
            Some(module) => Err(self.error(format_args!("the module \"{module}\" is not closed"))),
            None => Ok(()),
        }
    }

    fn declaration(&mut self) -> Result<(), SchemaError> {
        self.annotations()?;
        match self.next()? {
            "module" => {
                let name = self.next()?.to_owned();
                self.expect("{")?;
                self.scope.push(name);
            }
            "}" if self.scope.pop().is_some() => {
                self.skip(";");
            }
            "struct" => self.structure()?,
            "typedef" => self.alias()?,
            "const" => self.constant()?,
            "enum" => self.enumeration()?,
            "IDL" => {
                self.expect(":")?;
                // package/msg/Name
                self.next()?;
                while self.skip("/") {
                    self.next()?;
                }
            }
            ";" => {}
            other => {
                let message = format_args!(
                    "\"{other}\" is not supported; expected module, struct, typedef, const or enum"
                );
                return Err(self.error(message));
            }
        }
        Ok(())
    }

    fn structure(&mut self) -> Result<(), SchemaError> {
        let name = self.next()?.to_owned();
        self.expect("{")?;
        let mut members = Vec::new();
        loop {
            let unit = self.annotations()?;
            if self.skip("}") {
                break;
            }
            let kind = self.kind(0)?;
            loop {
                let name = self.next()?.to_owned();
                let kind = self.dimensions(kind.clone())?;
                members.push(Member {
                    name,
                    kind,
                    unit: unit.clone(),
                });
                if !self.skip(",") {
                    break;
                }
            }
            self.expect(";")?;
        }
        self.skip(";");
        let full = self.full(&name);
        // ROS adds this member to a type without members; it is one byte, as in an empty type.
        if let [only] = &members[..]
            && only.name == "structure_needs_at_least_one_member"
        {
            members.clear();
        }
        let place = self.declared.structs.len();
        if place >= MOST_STRUCTS {
            return Err(self.error("too many types"));
        }
        self.declared.by_name.entry(full.clone()).or_insert(place);
        self.declared.structs.push((full, members));
        Ok(())
    }

    fn alias(&mut self) -> Result<(), SchemaError> {
        let kind = self.kind(0)?;
        loop {
            let name = self.next()?.to_owned();
            let kind = self.dimensions(kind.clone())?;
            let full = self.full(&name);
            self.declared.aliases.insert(full, kind);
            if !self.skip(",") {
                return self.expect(";");
            }
        }
    }

    fn constant(&mut self) -> Result<(), SchemaError> {
        self.kind(0)?;
        let name = self.next()?.to_owned();
        self.expect("=")?;
        let mut value = None;
        let mut words = 0;
        while !self.skip(";") {
            value = self.next()?.parse().ok();
            words += 1;
        }
        if let (Some(value), 1) = (value, words) {
            let full = self.full(&name);
            self.declared.constants.insert(full, value);
        }
        Ok(())
    }

    fn enumeration(&mut self) -> Result<(), SchemaError> {
        let name = self.next()?.to_owned();
        self.expect("{")?;
        while !self.skip("}") {
            self.next()?;
        }
        self.skip(";");
        let full = self.full(&name);
        let kind = Written::FieldKind(FieldKind::Number(Number::U32));
        self.declared.aliases.insert(full, kind);
        Ok(())
    }

    fn kind(&mut self, level: usize) -> Result<Written, SchemaError> {
        if level > DEEPEST_LIST {
            return Err(self.error("lists are nested too deeply"));
        }
        let first = self.next()?;
        match first {
            "sequence" => {
                self.expect("<")?;
                let item = self.kind(level + 1)?;
                if self.skip(",") {
                    self.next()?;
                }
                self.expect(">")?;
                Ok(Written::Many(Box::new(item), None))
            }
            "string" | "wstring" => {
                if self.skip("<") {
                    self.next()?;
                    self.expect(">")?;
                }
                let text = [FieldKind::Text, FieldKind::WideText];
                let [narrow, wide] = text.map(Written::FieldKind);
                Ok(if first == "string" { narrow } else { wide })
            }
            "wchar" | "map" | "any" | "fixed" | "union" => {
                Err(self.error(format_args!("\"{first}\" is not supported")))
            }
            name => match self.number(name)? {
                Some(number) => Ok(Written::FieldKind(FieldKind::Number(number))),
                None => {
                    let line = self.line();
                    Ok(Written::Named(name.to_owned(), self.scope.clone(), line))
                }
            },
        }
    }

    /// The number type that a word means, including further words; `None` if it is a name.
    fn number(&mut self, first: &str) -> Result<Option<Number>, SchemaError> {
        let number = match first {
            "boolean" => Number::Bool,
            "octet" | "char" => Number::U8,
            "short" => Number::I16,
            "float" => Number::F32,
            "double" => Number::F64,
            "long" if self.skip("long") => Number::I64,
            "long" if self.skip("double") => {
                return Err(self.error("\"long double\" is not supported"));
            }
            "long" => Number::I32,
            "unsigned" => match self.next()? {
                "short" => Number::U16,
                "long" if self.skip("long") => Number::U64,
                "long" => Number::U32,
                other => return Err(self.error(format_args!("\"unsigned {other}\" is not a type"))),
            },
            // Only whole numbers have the names of ROS here as well.
            _ if first.contains("int") => return Ok(Number::named(first)),
            _ => return Ok(None),
        };
        Ok(Some(number))
    }

    /// Dimensions after a name; the last one varies fastest.
    fn dimensions(&mut self, kind: Written) -> Result<Written, SchemaError> {
        let mut counts = Vec::new();
        while self.skip("[") {
            let word = self.next()?.to_owned();
            let count = word.parse().ok().or_else(|| {
                lookup(&word, &self.scope, |full| self.declared.constants.get(full)).copied()
            });
            counts
                .push(count.ok_or_else(|| self.error(format_args!("\"{word}\" is not a length")))?);
            self.expect("]")?;
            if counts.len() > DEEPEST_LIST {
                return Err(self.error("too many dimensions"));
            }
        }
        Ok(counts.into_iter().rev().fold(kind, |item, count| {
            Written::Many(Box::new(item), Some(count))
        }))
    }

    /// Skips annotations; returns the unit if one of them gives it.
    fn annotations(&mut self) -> Result<Option<String>, SchemaError> {
        let mut unit = None;
        while self.skip("@") {
            let name = self.next()?;
            if !self.skip("(") {
                continue;
            }
            let mut level = 1;
            while level > 0 {
                let token = self.token()?;
                match token.text {
                    text if token.is_quoted && name == "unit" => unit = Some(text.to_owned()),
                    _ if token.is_quoted => {}
                    "(" => level += 1,
                    ")" => level -= 1,
                    _ => {}
                }
            }
        }
        Ok(unit)
    }

    fn full(&self, name: &str) -> String {
        let mut full = self.scope.join("::");
        if !full.is_empty() {
            full.push_str("::");
        }
        full + name
    }

    fn token(&mut self) -> Result<SchemaToken<'a>, SchemaError> {
        let token = self.tokens.get(self.at).copied();
        self.at += 1;
        token.ok_or_else(|| self.error("it ends too early"))
    }

    fn next(&mut self) -> Result<&'a str, SchemaError> {
        self.token().map(|token| token.text)
    }

    fn skip(&mut self, sign: &str) -> bool {
        let is_there = self
            .tokens
            .get(self.at)
            .is_some_and(|token| token.text == sign && !token.is_quoted);
        self.at += usize::from(is_there);
        is_there
    }

    fn expect(&mut self, sign: &str) -> Result<(), SchemaError> {
        let found = self.next()?;
        if found == sign {
            Ok(())
        } else {
            Err(self.error(format_args!("expected \"{sign}\", got \"{found}\"")))
        }
    }

    fn line(&self) -> usize {
        let last = self.at.clamp(1, self.tokens.len().max(1)) - 1;
        self.tokens.get(last).map_or(1, |token| token.line)
    }

    fn error(&self, why: impl std::fmt::Display) -> SchemaError {
        SchemaError::at(self.line(), why)
    }
}

/// Looks a name up in its scope, then in the enclosing ones.
fn lookup<'v, T>(
    name: &str,
    scope: &[String],
    find: impl Fn(&str) -> Option<&'v T>,
) -> Option<&'v T> {
    let name = name.trim_start_matches("::");
    (0..=scope.len()).rev().find_map(|depth| {
        let mut full = scope[..depth].join("::");
        if depth > 0 {
            full.push_str("::");
        }
        find(&(full + name))
    })
}

fn resolve(declared: &Declared, root: &str) -> Result<Schema, SchemaError> {
    let by_last_name = || {
        let wanted = root.rsplit("::").next().unwrap_or(root);
        let is_wanted =
            |(name, _): &(String, Vec<Member>)| name.rsplit("::").next() == Some(wanted);
        declared.structs.iter().position(is_wanted)
    };
    let place = declared.by_name.get(root).copied().or_else(by_last_name);
    let root = place.ok_or_else(|| SchemaError::new(format_args!("{root} is not defined")))?;
    let mut structs = Vec::new();
    for (name, members) in &declared.structs {
        let fields: Result<_, _> = members.iter().map(|m| field(declared, m)).collect();
        structs.push(Struct {
            name: name.replace("::", "/"),
            fields: fields?,
        });
    }
    let schema = Schema {
        structs,
        root,
        descriptor: None,
    };
    schema.check_nesting()?;
    Ok(schema)
}

fn field(declared: &Declared, member: &Member) -> Result<Field, SchemaError> {
    Ok(Field {
        unit: member.unit.clone(),
        ..Field::new(&member.name, kind(declared, &member.kind, 0)?)
    })
}

fn kind(declared: &Declared, written: &Written, level: usize) -> Result<FieldKind, SchemaError> {
    match written {
        Written::FieldKind(kind) => Ok(kind.clone()),
        Written::Many(item, count) => {
            let item = kind(declared, item, level + 1)?;
            Ok(count.map_or_else(
                || FieldKind::list(item.clone()),
                |n| FieldKind::array(item.clone(), n),
            ))
        }
        Written::Named(name, scope, line) => {
            if level > DEEPEST_LIST {
                return Err(SchemaError::at(*line, "circular type definitions"));
            }
            if let Some(alias) = lookup(name, scope, |full| declared.aliases.get(full)) {
                return kind(declared, alias, level + 1);
            }
            lookup(name, scope, |full| declared.by_name.get(full))
                .map(|place| FieldKind::Struct(*place))
                .or_else(|| by_last_name(declared, name))
                .ok_or_else(|| {
                    SchemaError::at(*line, format_args!("the type \"{name}\" is not defined"))
                })
        }
    }
}

/// A type identified by its last name only, if unique.
fn by_last_name(declared: &Declared, name: &str) -> Option<FieldKind> {
    let wanted = name.rsplit("::").next()?;
    let mut found = declared
        .structs
        .iter()
        .enumerate()
        .filter(|(_, (full, _))| full.rsplit("::").next() == Some(wanted));
    match (found.next(), found.next()) {
        (Some((place, _)), None) => Some(FieldKind::Struct(place)),
        _ => None,
    }
}

#[cfg(test)]
#[path = "tests/ros2idl.rs"]
mod tests;
