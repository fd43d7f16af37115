//! Path of a field in user notation: `wrench.torque.z`, `effort[0]`, `effort[-1]`,
//! `effort[name=motor_joint]`, `data[:]`, `data[0::3]`.

use std::fmt;

/// One step into a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PathPart {
    /// A field by its name.
    Name(String),
    /// An item by its index; negative ones count from the end.
    Index(i64),
    /// Some items, or all of them: `[:]`, `[0::3]`.
    Slice(Slice),
    /// An item by its name: `[name=motor_joint]`, `[motor_joint]` for short.
    Called {
        /// Field that contains the names, if given.
        key: Option<String>,
        /// The name.
        name: String,
    },
}

/// Every n-th item of a list in a range: `[start:end:step]` as in Python.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slice {
    /// First item.
    pub start: usize,
    /// End, exclusive.
    pub end: usize,
    /// Step.
    pub step: usize,
}

impl Slice {
    /// All items.
    pub const ALL: Self = Self {
        start: 0,
        end: usize::MAX,
        step: 1,
    };

    fn parse(word: &str) -> Option<Self> {
        let mut numbers = word.split(':').map(str::trim);
        let mut number = |default| match numbers.next() {
            None | Some("") => Some(default),
            Some(text) => text.parse().ok(),
        };
        let found = Self {
            start: number(Self::ALL.start)?,
            end: number(Self::ALL.end)?,
            step: number(Self::ALL.step)?,
        };
        (numbers.next().is_none() && found.start < found.end && found.step > 0).then_some(found)
    }

    /// Removes the other items.
    pub fn keep(&self, items: &mut Vec<f64>) {
        if *self == Self::ALL {
            return;
        }
        items.truncate(self.end);
        let mut place = 0;
        items.retain(|_| {
            let is_kept = place >= self.start && (place - self.start).is_multiple_of(self.step);
            place += 1;
            is_kept
        });
    }
}

impl fmt::Display for Slice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unless = |number: usize, usual| match number == usual {
            true => String::new(),
            false => number.to_string(),
        };
        write!(
            f,
            "{}:{}",
            unless(self.start, 0),
            unless(self.end, usize::MAX)
        )?;
        match self.step {
            1 => Ok(()),
            step => write!(f, ":{step}"),
        }
    }
}

/// Parses a path; empty text is the message itself.
///
/// # Errors
/// A sentence about what was expected.
pub fn parse(text: &str) -> Result<Vec<PathPart>, String> {
    let mut parts = Vec::new();
    let mut rest = text.trim();
    while !rest.is_empty() {
        if let Some(inside) = rest.strip_prefix('[') {
            let (word, behind) = bracket(inside).ok_or_else(|| {
                format!("\"{text}\" has a bracket that is not closed; write it as effort[0]")
            })?;
            parts.push(item(word, text)?);
            rest = behind;
        } else {
            let name = match (rest.strip_prefix('.'), parts.is_empty()) {
                (Some(name), false) => name,
                (None, true) => rest,
                _ => {
                    return Err(format!(
                        "\"{text}\" is not a field; write it as wrench.torque.z"
                    ));
                }
            };
            let end = name.find(['.', '[']).unwrap_or(name.len());
            if end == 0 {
                return Err(format!("\"{text}\" is not a field: a name is missing"));
            }
            parts.push(PathPart::Name(name[..end].to_owned()));
            rest = &name[end..];
        }
    }
    Ok(parts)
}

/// Content of a bracket, and the rest. Quotes may contain brackets.
fn bracket(text: &str) -> Option<(&str, &str)> {
    let mut quote = None;
    for (at, sign) in text.char_indices() {
        match (quote, sign) {
            (None, ']') => return Some((&text[..at], &text[at + 1..])),
            (None, '"' | '\'') => quote = Some(sign),
            (Some(open), _) if open == sign => quote = None,
            _ => {}
        }
    }
    None
}

fn item(word: &str, text: &str) -> Result<PathPart, String> {
    let word = word.trim();
    if word.contains(':')
        && let Some(slice) = Slice::parse(word)
    {
        return Ok(PathPart::Slice(slice));
    }
    if let Ok(index) = word.parse() {
        return Ok(PathPart::Index(index));
    }
    let (key, name) = match word.split_once('=') {
        Some((key, name)) => (Some(key.trim().to_owned()), name.trim()),
        None => (None, word),
    };
    let name = ['"', '\'']
        .iter()
        .find_map(|quote| name.strip_prefix(*quote)?.strip_suffix(*quote))
        .unwrap_or(name);
    if name.is_empty() || key.as_deref() == Some("") || word.contains(':') && key.is_none() {
        return Err(format!(
            "\"[{word}]\" in \"{text}\" does not select an item; write [0], [-1], [name=joint], \
             [:] for all or [0::3] for every third"
        ));
    }
    let name = name.to_owned();
    Ok(PathPart::Called { key, name })
}

/// A path in which the first item of a list, or all items, are replaced by one selected by name.
pub fn by_name(mut parts: Vec<PathPart>, name: &str) -> Option<Vec<PathPart>> {
    let is_place = |part: &&mut PathPart| matches!(part, PathPart::Index(_) | PathPart::Slice(_));
    *parts.iter_mut().find(is_place)? = PathPart::Called {
        key: None,
        name: name.to_owned(),
    };
    Some(parts)
}

/// Converts a path back to text.
pub fn text(parts: &[PathPart]) -> String {
    let mut text = String::new();
    for part in parts {
        match part {
            PathPart::Name(name) if text.is_empty() => text.push_str(name),
            PathPart::Name(name) => text.push_str(&format!(".{name}")),
            PathPart::Index(index) => text.push_str(&format!("[{index}]")),
            PathPart::Slice(slice) => text.push_str(&format!("[{slice}]")),
            PathPart::Called { key, name } => {
                let key = key.as_deref().unwrap_or("name");
                text.push_str(&format!("[{key}={name}]"));
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_to_write_a_field() {
        let name = |name: &str| PathPart::Name(name.to_owned());
        let slice = |start, end, step| Slice { start, end, step };
        let called = |key: Option<&str>, name: &str| PathPart::Called {
            key: key.map(str::to_owned),
            name: name.to_owned(),
        };
        let cases = [
            ("", vec![]),
            (
                "wrench.torque.z",
                vec![name("wrench"), name("torque"), name("z")],
            ),
            ("effort[0]", vec![name("effort"), PathPart::Index(0)]),
            ("effort[-1]", vec![name("effort"), PathPart::Index(-1)]),
            (
                "a[1][2].b",
                vec![name("a"), PathPart::Index(1), PathPart::Index(2), name("b")],
            ),
            ("data[:]", vec![name("data"), PathPart::Slice(Slice::ALL)]),
            (
                "data[2:9:3]",
                vec![name("data"), PathPart::Slice(slice(2, 9, 3))],
            ),
            (
                "data[1::3]",
                vec![name("data"), PathPart::Slice(slice(1, usize::MAX, 3))],
            ),
            (
                "effort[name=m_1]",
                vec![name("effort"), called(Some("name"), "m_1")],
            ),
            ("effort[ m ]", vec![name("effort"), called(None, "m")]),
            (
                "e[n='a ] b'].x",
                vec![name("e"), called(Some("n"), "a ] b"), name("x")],
            ),
        ];
        for (text, parts) in cases {
            assert_eq!(parse(text).unwrap(), parts, "{text}");
        }
        assert_eq!(
            text(&parse("a.b[0][x='y z'].c[:]").unwrap()),
            "a.b[0][x=y z].c[:]"
        );
    }

    #[test]
    fn what_is_no_field_is_refused() {
        for text in [
            "a..b", "a[", "a[]", "a[=x]", "a[n=]", ".a", "a.", "a[2:1]", "a[0]b",
        ] {
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
