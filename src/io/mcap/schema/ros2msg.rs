//! Definitions in the `.msg` language of ROS 2 and ROS 1.
//!
//! <https://design.ros2.org/articles/legacy_interface_definition.html>; several definitions are
//! joined with lines of 80 `=` and `MSG: package/Name` between them.

use std::collections::HashMap;

use super::{Field, FieldKind, MOST_STRUCTS, Number, Schema, SchemaError, Struct};

/// Generation of ROS that wrote the definition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Generation {
    /// ROS 1: has `time` and `duration`, a byte is signed.
    Ros1,
    /// ROS 2.
    Ros2,
}

/// Minimum number of `=` in a line that separates two definitions.
const SEPARATOR: usize = 80;

/// Parses the definition of the type `name` and of everything it refers to.
///
/// # Errors
/// [`SchemaError`] with the line.
pub fn read(name: &str, text: &str, generation: Generation) -> Result<Schema, SchemaError> {
    let sections = sections(name, text)?;
    let mut reader = Reader {
        generation,
        known: HashMap::new(),
        structs: Vec::new(),
    };
    for (place, section) in sections.iter().enumerate() {
        // The first definition of a type counts; recorders repeat some.
        reader.known.entry(section.name.clone()).or_insert(place);
        reader.structs.push(Struct {
            name: section.name.clone(),
            fields: Vec::new(),
        });
    }
    for (place, section) in sections.iter().enumerate() {
        reader.structs[place].fields = reader.fields(section)?;
    }
    let schema = Schema {
        structs: reader.structs,
        root: 0,
        descriptor: None,
    };
    schema.check_nesting()?;
    Ok(schema)
}

/// One definition: the name without `msg`, and its lines.
struct MessageSection<'a> {
    name: String,
    lines: Vec<(usize, &'a str)>,
}

fn sections<'a>(name: &str, text: &'a str) -> Result<Vec<MessageSection<'a>>, SchemaError> {
    let mut sections = vec![MessageSection {
        name: short(name),
        lines: Vec::new(),
    }];
    let mut awaits_name = false;
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.len() >= SEPARATOR && line.bytes().all(|byte| byte == b'=') {
            awaits_name = true;
        } else if awaits_name && !line.is_empty() {
            let named = line.strip_prefix("MSG:").ok_or_else(|| {
                SchemaError::at(
                    index + 1,
                    "expected \"MSG: package/Name\" after the \"=\" line",
                )
            })?;
            sections.push(MessageSection {
                name: short(named.trim()),
                lines: Vec::new(),
            });
            awaits_name = false;
        } else if let Some(section) = sections.last_mut() {
            section.lines.push((index + 1, line));
        }
        if sections.len() > MOST_STRUCTS {
            return Err(SchemaError::at(index + 1, "too many types"));
        }
    }
    // Some writers name the first definition as well.
    if sections.len() > 1
        && sections[0].name == sections[1].name
        && sections[0]
            .lines
            .iter()
            .all(|(_, line)| code(line).trim().is_empty())
    {
        sections.remove(0);
    }
    Ok(sections)
}

/// `package/msg/Name` is the same as `package/Name`.
fn short(name: &str) -> String {
    let mut parts = name.split('/');
    match (parts.next(), parts.next_back()) {
        (Some(package), Some(last)) => format!("{package}/{last}"),
        _ => name.to_owned(),
    }
}

struct Reader {
    generation: Generation,
    known: HashMap<String, usize>,
    structs: Vec<Struct>,
}

impl Reader {
    fn fields(&mut self, section: &MessageSection) -> Result<Vec<Field>, SchemaError> {
        let package = section.name.split_once('/').map_or("", |(first, _)| first);
        let mut fields = Vec::new();
        for (line, text) in &section.lines {
            if let Some((kind, name)) = declaration(text) {
                let kind = self
                    .kind(kind, package)
                    .map_err(|why| SchemaError::at(*line, why))?;
                fields.push(Field::new(name, kind));
            } else if !code(text).trim().is_empty() && !is_constant(text) {
                return Err(SchemaError::at(
                    *line,
                    format_args!("expected \"type name\", got \"{}\"", code(text).trim()),
                ));
            }
        }
        Ok(fields)
    }

    fn kind(&mut self, text: &str, package: &str) -> Result<FieldKind, String> {
        let Some((base, array)) = text.split_once('[') else {
            return self.base(text, package);
        };
        let item = self.base(base, package)?;
        let bound = array
            .strip_suffix(']')
            .ok_or_else(|| format!("\"{text}\" has no closing bracket"))?;
        if bound.is_empty() || bound.starts_with("<=") {
            return Ok(FieldKind::list(item));
        }
        let count = bound
            .parse()
            .map_err(|_| format!("\"{bound}\" is not an array length"))?;
        Ok(FieldKind::array(item, count))
    }

    fn base(&mut self, text: &str, package: &str) -> Result<FieldKind, String> {
        let name = text.split_once("<=").map_or(text, |(name, _)| name);
        let ros1 = self.generation == Generation::Ros1;
        Ok(match name {
            "string" => FieldKind::Text,
            "wstring" => FieldKind::WideText,
            "byte" if ros1 => FieldKind::Number(Number::I8),
            "time" | "duration" if ros1 => FieldKind::Struct(self.builtin(name)),
            _ => match number(name) {
                Some(number) => FieldKind::Number(number),
                None => FieldKind::Struct(self.named(name, package)?),
            },
        })
    }

    fn named(&mut self, name: &str, package: &str) -> Result<usize, String> {
        let full = short(name);
        let candidates = [
            full.clone(),
            format!("{package}/{full}"),
            // ROS 1 writes its header without a package.
            format!("std_msgs/{full}"),
        ];
        let tried = if name.contains('/') { 1 } else { 3 };
        for candidate in &candidates[..tried] {
            if let Some(place) = self.known.get(candidate) {
                return Ok(*place);
            }
        }
        match full.as_str() {
            "builtin_interfaces/Time" | "builtin_interfaces/Duration" => Ok(self.builtin(&full)),
            _ => Err(format!("the type \"{name}\" is not defined")),
        }
    }

    /// Time stamps, which recorders need not define.
    fn builtin(&mut self, name: &str) -> usize {
        if let Some(place) = self.known.get(name) {
            return *place;
        }
        let (sec, nanosec, whole, part) = match name {
            "time" => ("secs", "nsecs", Number::U32, Number::U32),
            "duration" => ("secs", "nsecs", Number::I32, Number::I32),
            _ => ("sec", "nanosec", Number::I32, Number::U32),
        };
        self.structs.push(Struct {
            name: name.to_owned(),
            fields: vec![
                Field::new(sec, FieldKind::Number(whole)),
                Field::new(nanosec, FieldKind::Number(part)),
            ],
        });
        self.known.insert(name.to_owned(), self.structs.len() - 1);
        self.structs.len() - 1
    }
}

/// The line without its comment.
fn code(line: &str) -> &str {
    line.split_once('#').map_or(line, |(code, _)| code)
}

/// Type and name of a field; `None` for a constant, a comment or anything else.
fn declaration(line: &str) -> Option<(&str, &str)> {
    let mut words = code(line).split_whitespace();
    let (kind, name) = (words.next()?, words.next()?);
    let is_name = name
        .bytes()
        .all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
        && !name.starts_with(|first: char| first.is_ascii_digit());
    let is_constant = words.next().is_some_and(|word| word.starts_with('='));
    (is_name && !is_constant).then_some((kind, name))
}

/// `TYPE NAME=value`; the value of a text may contain anything.
fn is_constant(line: &str) -> bool {
    let mut words = line.splitn(2, char::is_whitespace);
    let (_, rest) = (words.next(), words.next().unwrap_or("").trim_start());
    let name = rest.split('=').next().unwrap_or("").trim_end();
    rest.contains('=')
        && !name.is_empty()
        && name
            .bytes()
            .all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
}

fn number(name: &str) -> Option<Number> {
    match name {
        "byte" | "char" => Some(Number::U8),
        _ => Number::named(name),
    }
}

#[cfg(test)]
#[path = "tests/ros2msg.rs"]
mod tests;
