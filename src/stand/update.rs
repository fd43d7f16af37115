//! Writing what was found into a stand file, leaving the rest of it as it is.

use toml_edit::{DocumentMut, InlineTable, Item, Table, value};
use torqcomp_model::Kind;

use crate::failure::Failure;

/// One entry of a stand file.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Its section, such as `mechanics`.
    pub section: &'static str,
    /// Its key, such as `stiffness`.
    pub key: &'static str,
    /// Value in SI units.
    pub value: f64,
    /// Its standard uncertainty.
    pub std: Option<f64>,
    /// Unit to write; empty for a ratio.
    pub unit: String,
    /// Where it comes from.
    pub source: String,
}

const SCHEMA: &str = "torqcomp.stand/1";
/// Keys of `[mechanics]` that exclude each other.
const CONSTANTS: [&str; 3] = ["inertia", "damping", "stiffness"];
/// Relative standard uncertainty that these three share.
pub const COMMON: &str = "common_std";
const MODAL: [&str; 2] = ["natural_frequency", "damping_ratio"];

/// The text of a stand file with the entries put in; `existing` is its text so far, if there is one.
/// Comments, order and all other entries stay.
///
/// # Errors
/// If the existing text is no stand file, or describes the mechanics in the other way.
pub fn update(name: &str, existing: Option<&str>, entries: &[Entry]) -> Result<String, Failure> {
    let mut document = match existing {
        Some(text) => text.parse::<DocumentMut>().map_err(|error| {
            Failure::failed(format_args!(
                "{name}: cannot be updated: {}; correct it, or write to another file",
                error.message().replace('\n', ", ")
            ))
        })?,
        None => DocumentMut::new(),
    };
    match document.get("schema").and_then(Item::as_str) {
        Some(SCHEMA) => {}
        None if existing.is_none() => {
            document["schema"] = value(SCHEMA);
        }
        _ => {
            return Err(Failure::failed(format_args!(
                "{name}: this is not a stand file (schema = \"{SCHEMA}\" is missing); write to another \
                 file"
            )));
        }
    }
    if entries.iter().any(|entry| CONSTANTS.contains(&entry.key)) {
        // It belongs to the constants that are replaced.
        if let Some(mechanics) = document
            .get_mut("mechanics")
            .and_then(Item::as_table_like_mut)
        {
            mechanics.remove(COMMON);
        }
    }
    for entry in entries {
        put(name, &mut document, entry)?;
    }
    Ok(document.to_string())
}

fn put(name: &str, document: &mut DocumentMut, entry: &Entry) -> Result<(), Failure> {
    let section = document
        .entry(entry.section)
        .or_insert_with(|| Item::Table(Table::new()));
    let Some(table) = section.as_table_like_mut() else {
        return Err(Failure::failed(format_args!(
            "{name}: [{}] is not a table; correct it",
            entry.section
        )));
    };
    let others: &[&str] = match entry.key {
        key if CONSTANTS.contains(&key) => &MODAL,
        key if MODAL.contains(&key) => &CONSTANTS,
        _ => &[],
    };
    if let Some(other) = others.iter().find(|other| table.contains_key(other)) {
        return Err(Failure::failed(format_args!(
            "{name}: [{}] has {other}, so that {} cannot be written beside it; remove it, or write to \
             another file",
            entry.section, entry.key
        )));
    }
    let text = |number: f64| {
        format!("{} {}", number_text(number), entry.unit)
            .trim()
            .to_owned()
    };
    let mut inline = InlineTable::new();
    inline.insert("value", text(entry.value).into());
    if let Some(std) = entry.std {
        inline.insert("std", text(std).into());
    }
    inline.insert("source", entry.source.as_str().into());
    match table.get_mut(entry.key) {
        Some(item) => {
            // The comment after the value belongs to the user.
            let decor = item.as_value().map(|v| v.decor().clone());
            let mut new = toml_edit::Value::InlineTable(inline);
            if let Some(decor) = decor {
                *new.decor_mut() = decor;
            }
            *item = Item::Value(new);
        }
        None => {
            table.insert(entry.key, value(inline));
        }
    }
    Ok(())
}

/// Nine significant digits: more than any record tells.
fn number_text(number: f64) -> String {
    crate::io::digits::text(number, 9)
}

/// A quantity of `[mechanics]` in SI units and its standard uncertainty, from the text of a stand file
/// that need not be complete.
///
/// # Errors
/// If it is there and cannot be read.
pub fn declared(
    name: &str,
    text: &str,
    key: &str,
    kind: Kind,
) -> Result<Option<(f64, Option<f64>)>, Failure> {
    let wrong = |error: &dyn std::fmt::Display| {
        Failure::failed(format_args!("{name}: [mechanics] {key}: {error}"))
    };
    let document = text
        .parse::<DocumentMut>()
        .map_err(|error| wrong(&error.message()))?;
    let Some(item) = document
        .get("mechanics")
        .and_then(|section| section.get(key))
    else {
        return Ok(None);
    };
    let part = |key: &str| item.get(key).and_then(Item::as_str);
    let Some(text) = item.as_str().or_else(|| part("value")) else {
        return Err(wrong(&"expected a text with a unit"));
    };
    let value = kind.parse(text).map_err(|error| wrong(&error))?;
    let std = part("std").map(|text| kind.parse_std(text)).transpose();
    Ok(Some((value, std.map_err(|error| wrong(&error))?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stiffness(section: &'static str) -> Entry {
        Entry {
            section,
            key: "stiffness",
            value: 1.5e5,
            std: Some(20.0),
            unit: "N m/rad".to_owned(),
            source: "fitted: decay.csv".to_owned(),
        }
    }

    #[test]
    fn other_entries_and_comments_stay() {
        let text = "schema = \"torqcomp.stand/1\" # the schema\n\n# who made it\nname = \"mine\"\n\n\
                    [mechanics]\ninertia = \"2 kg m^2\" # weighed\nstiffness = \"1 N m/rad\" # guess\n";
        let got = update("s.toml", Some(text), &[stiffness("mechanics")]).unwrap();
        let want = text.replace(
            "\"1 N m/rad\"",
            "{ value = \"150000 N m/rad\", std = \"20 N m/rad\", source = \"fitted: decay.csv\" }",
        );
        assert_eq!(got, want);
        let inertia = declared("s.toml", &got, "inertia", Kind::Inertia).unwrap();
        assert_eq!(inertia, Some((2.0, None)));
        let read = declared("s.toml", &got, "stiffness", Kind::AngularStiffness).unwrap();
        assert_eq!(read, Some((1.5e5, Some(20.0))));
    }

    #[test]
    fn a_new_file_begins_with_its_schema() {
        let got = update("s.toml", None, &[stiffness("mechanics")]).unwrap();
        assert!(got.starts_with("schema = \"torqcomp.stand/1\"\n"), "{got}");
        assert!(got.contains("[mechanics]\nstiffness = {"), "{got}");
    }

    #[test]
    fn what_is_no_stand_file_or_says_it_otherwise_is_left_alone() {
        let refused =
            |text: &str| update("s.toml", Some(text), &[stiffness("mechanics")]).unwrap_err();
        assert!(refused("a = 1\n").to_string().contains("not a stand file"));
        assert!(refused("a = \n").to_string().contains("cannot be updated"));
        let modal = "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"5 Hz\"\n";
        assert!(refused(modal).to_string().contains("natural_frequency"));
    }
}
