//! Writing results to a stand file, preserving the rest of it.

use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Table, Value, value};
use torqcomp_decimal::digits;
use torqcomp_dsp::sort_by_number;
use torqcomp_model::{Estimate, Kind};

use crate::failure::{ErrorCode, Failure};

/// One entry of a stand file.
#[derive(Debug, Clone)]
pub struct Entry {
    /// Its section, such as `mechanics`.
    pub section: &'static str,
    /// Its key, such as `stiffness`.
    pub key: &'static str,
    /// Its value.
    content: Value,
}

impl Entry {
    /// A quantity with its standard uncertainty and its source.
    pub fn quantity(
        section: &'static str,
        key: &'static str,
        estimate: &Estimate,
        source: &str,
    ) -> Self {
        Self::with_source(section, key, estimate, Some(source))
    }

    /// The same if the section gives the source of its numbers.
    pub fn measured(section: &'static str, key: &'static str, estimate: &Estimate) -> Self {
        Self::with_source(section, key, estimate, None)
    }

    fn with_source(
        section: &'static str,
        key: &'static str,
        estimate: &Estimate,
        source: Option<&str>,
    ) -> Self {
        Self::of(section, key, table_of(estimate, source))
    }

    fn of(section: &'static str, key: &'static str, content: impl Into<Value>) -> Self {
        Self {
            section,
            key,
            content: content.into(),
        }
    }

    /// A bare number with three digits.
    pub fn number(section: &'static str, key: &'static str, number: f64) -> Self {
        Self::text(section, key, &digits::text(number, 3))
    }

    /// A text.
    pub fn text(section: &'static str, key: &'static str, text: &str) -> Self {
        Self::of(section, key, text)
    }

    /// `[[modes]]`, from the entries of each mode.
    pub fn modes(modes: Vec<Vec<Self>>) -> Self {
        let mut array = Array::new();
        for entries in modes {
            let mut table = InlineTable::new();
            for entry in entries {
                table.insert(entry.key, entry.content);
            }
            array.push(table);
        }
        Self::of(MODES, "", array)
    }

    /// A whole number.
    pub fn whole(section: &'static str, key: &'static str, number: i64) -> Self {
        Self::of(section, key, number)
    }

    /// Points of `[calibration]`: reading, torque and its standard uncertainty, each as text.
    pub fn points(points: &[[String; 3]]) -> Self {
        let mut array = Array::new();
        for texts in points {
            let mut table = InlineTable::new();
            for (key, text) in ["reading", "torque", "std"].into_iter().zip(texts) {
                table.insert(key, text.as_str().into());
            }
            let mut point = Value::InlineTable(table);
            point.decor_mut().set_prefix("\n    ");
            array.push_formatted(point);
        }
        array.set_trailing_comma(true);
        array.set_trailing("\n");
        Self::of("calibration", "points", array)
    }
}

const SCHEMA: &str = "torqcomp.stand/1";
/// Keys of `[mechanics]` that exclude each other.
pub const CONSTANTS: [&str; 3] = ["inertia", "damping", "stiffness"];
/// Relative standard uncertainty common to these three.
pub const COMMON: &str = "common_std";
/// Correlation coefficients of pairs of these three.
pub const CORRELATIONS: [&str; 3] = [
    "correlation_inertia_damping",
    "correlation_inertia_stiffness",
    "correlation_damping_stiffness",
];
/// Section of several modes.
pub const MODES: &str = "modes";
/// Keys of a mode not identifiable from a decay.
const SHARES: [&str; 4] = ["residue", "quadrature", "shape_at_load", "shape_at_gage"];
/// Keys that exclude those in turn.
pub const MODAL: [&str; 2] = ["natural_frequency", "damping_ratio"];

/// The text of a stand file with the entries inserted; `existing` is its present text, if any.
/// Comments, order and all other entries are preserved.
///
/// # Errors
/// If the existing text is not a stand file, or describes the mechanics in the other form.
pub fn update(name: &str, existing: Option<&str>, entries: &[Entry]) -> Result<String, Failure> {
    let mut document = match existing {
        Some(text) => text.parse::<DocumentMut>().map_err(|error| {
            invalid(
                name,
                format_args!(
                    "cannot be updated: {}; correct it, or write to another file",
                    error.message().replace('\n', ", ")
                ),
            )
        })?,
        None => DocumentMut::new(),
    };
    match document.get("schema").and_then(Item::as_str) {
        Some(SCHEMA) => {}
        None if existing.is_none() => {
            document["schema"] = value(SCHEMA);
        }
        _ => {
            return Err(invalid(
                name,
                format_args!(
                    "this is not a stand file (schema = \"{SCHEMA}\" is missing); write to another \
                     file"
                ),
            ));
        }
    }
    make_room(name, &mut document, entries)?;
    if entries.iter().any(|entry| CONSTANTS.contains(&entry.key)) {
        // It belongs to the constants that are replaced.
        if let Some(mechanics) = document
            .get_mut("mechanics")
            .and_then(Item::as_table_like_mut)
        {
            mechanics.remove(COMMON);
            for key in CORRELATIONS {
                mechanics.remove(key);
            }
        }
    }
    for entry in entries {
        put(name, &mut document, entry)?;
    }
    Ok(document.to_string())
}

/// Removes a calibration in another form, which would conflict with the new one.
fn make_room(name: &str, document: &mut DocumentMut, entries: &[Entry]) -> Result<(), Failure> {
    let is_new = |key: &str| {
        entries
            .iter()
            .any(|e| e.section == "calibration" && e.key == key)
    };
    let is_gain = |e: &Entry| (e.section, e.key) == ("mechanics", "static_gain");
    if entries.iter().any(is_gain) && has_conversion(document) {
        return Err(invalid(
            name,
            "it converts the record to torque ([calibration] or [beam]), so that static_gain of a force cannot be written \
             beside that; remove it, or write to another file",
        ));
    }
    if !entries.iter().any(|e| e.section == "calibration") {
        return Ok(());
    }
    let gain = document.get("mechanics").and_then(|m| m.get("static_gain"));
    if gain.is_some() {
        return Err(invalid(
            name,
            "[mechanics] has static_gain, which already converts the record; remove it, or write to another file",
        ));
    }
    if let Some(table) = document
        .get_mut("calibration")
        .and_then(Item::as_table_like_mut)
    {
        let keys: Vec<String> = table.iter().map(|(key, _)| key.to_owned()).collect();
        // The rated torque is a property of the transducer, not of its calibration.
        let is_replaced = |key: &&String| !is_new(key) && *key != "rated_torque";
        for key in keys.iter().filter(is_replaced) {
            table.remove(key);
        }
    }
    let zero = entries
        .iter()
        .any(|e| e.section == "recorder" && e.key == "zero");
    if !zero
        && let Some(table) = document
            .get_mut("recorder")
            .and_then(Item::as_table_like_mut)
    {
        // It belongs to the calibration that is replaced.
        table.remove("zero");
    }
    Ok(())
}

/// Replaces the existing `[[modes]]`. If there are as many new ones, with frequency and damping only, the contributions
/// of the existing ones are kept.
fn put_modes(name: &str, document: &mut DocumentMut, entry: &Entry) -> Result<(), Failure> {
    let mechanics = document.get("mechanics").and_then(Item::as_table_like);
    let mut single = CONSTANTS.iter().chain(&MODAL);
    if let Some(key) = single.find(|key| mechanics.is_some_and(|table| table.contains_key(key))) {
        return Err(invalid(
            name,
            format_args!(
                "[mechanics] has {key}, so that [[modes]] cannot be written beside it; remove it, or write to \
                 another file"
            ),
        ));
    }
    let tables = entry.content.as_array().into_iter().flatten();
    let inline = tables.filter_map(Value::as_inline_table);
    let mut modes: Vec<Table> = inline.map(|table| table.clone().into_table()).collect();
    let known = by_frequency(document.get(MODES).and_then(Item::as_array_of_tables));
    if known.len() == modes.len() {
        for (mode, known) in modes.iter_mut().zip(&known) {
            let kept = SHARES.iter().filter(|_| !mode.contains_key(SHARES[0]));
            let kept: Vec<_> = kept
                .filter_map(|key| Some((key, known.get(key)?.clone())))
                .collect();
            for (key, item) in kept {
                mode.insert(key, item);
            }
        }
    }
    document[MODES] = Item::ArrayOfTables(modes.into_iter().collect::<ArrayOfTables>());
    Ok(())
}

/// Modes of a stand file in ascending order of frequency; empty if one of them cannot be read.
fn by_frequency(tables: Option<&ArrayOfTables>) -> Vec<&Table> {
    let hertz = |table: &Table| {
        let item = table.get(MODAL[0])?;
        let text = item.as_str().or_else(|| item.get("value")?.as_str())?;
        Kind::Frequency.parse(text).ok()
    };
    let read = tables.into_iter().flat_map(ArrayOfTables::iter);
    let read: Option<Vec<(f64, &Table)>> = read.map(|table| Some((hertz(table)?, table))).collect();
    let mut read = read.unwrap_or_default();
    sort_by_number(&mut read, |(hertz, _)| *hertz);
    read.into_iter().map(|(_, table)| table).collect()
}

fn put(name: &str, document: &mut DocumentMut, entry: &Entry) -> Result<(), Failure> {
    if entry.section == MODES {
        return put_modes(name, document, entry);
    }
    let is_single = CONSTANTS.contains(&entry.key) || MODAL.contains(&entry.key);
    if is_single && document.contains_key(MODES) {
        return Err(invalid(
            name,
            format_args!(
                "it has [[modes]], so that {} of a single mode cannot be written beside them; remove them, or write \
                 to another file",
                entry.key
            ),
        ));
    }
    let section = document
        .entry(entry.section)
        .or_insert_with(|| Item::Table(Table::new()));
    let Some(table) = section.as_table_like_mut() else {
        return Err(invalid(
            name,
            format_args!("[{}] is not a table; correct it", entry.section),
        ));
    };
    let others: &[&str] = match entry.key {
        key if CONSTANTS.contains(&key) => &MODAL,
        key if MODAL.contains(&key) => &CONSTANTS,
        _ => &[],
    };
    if let Some(other) = others.iter().find(|other| table.contains_key(other)) {
        return Err(invalid(
            name,
            format_args!(
                "[{}] has {other}, so that {} cannot be written beside it; remove it, or write to \
                 another file",
                entry.section, entry.key
            ),
        ));
    }
    match table.get_mut(entry.key) {
        Some(item) => {
            // The comment after the value belongs to the user.
            let decor = item.as_value().map(|v| v.decor().clone());
            let mut new = entry.content.clone();
            if let Some(decor) = decor {
                *new.decor_mut() = decor;
            }
            *item = Item::Value(new);
        }
        None => {
            table.insert(entry.key, Item::Value(entry.content.clone()));
        }
    }
    Ok(())
}

/// A failure due to a stand file of this name.
fn invalid(name: &str, message: impl std::fmt::Display) -> Failure {
    ErrorCode::InvalidStand.failed(message).at(name)
}

/// A quantity with its standard uncertainty and its source, with nine significant digits, more than any record can
/// determine.
pub(super) fn table_of(estimate: &Estimate, source: Option<&str>) -> InlineTable {
    let text = |number: f64| {
        let text = format!("{} {}", digits::text(number, 9), estimate.unit());
        text.trim().to_owned()
    };
    let mut table = InlineTable::new();
    table.insert("value", text(estimate.value()).into());
    if let Some(std) = estimate.std_uncertainty() {
        table.insert("std", text(std).into());
    }
    if let Some(source) = source {
        table.insert("source", source.into());
    }
    table
}

/// Whether a stand file defines the conversion of its record to torque.
pub fn is_calibrated(text: &str) -> bool {
    let Ok(document) = text.parse::<DocumentMut>() else {
        return true;
    };
    let gain = document.get("mechanics").and_then(|m| m.get("static_gain"));
    gain.is_some() || has_conversion(&document)
}

/// Whether a calibration or a drawing converts its record to torque.
pub fn converts(text: &str) -> bool {
    let document = text.parse::<DocumentMut>();
    document.is_ok_and(|document| has_conversion(&document))
}

fn has_conversion(document: &DocumentMut) -> bool {
    let mut sections = ["calibration", "beam"].iter();
    sections.any(|key| document.contains_key(key))
}

/// A quantity of `[mechanics]` in SI units and its standard uncertainty, from the text of a possibly
/// incomplete stand file.
///
/// # Errors
/// If it is present but cannot be read.
pub fn declared(
    name: &str,
    text: &str,
    key: &str,
    kind: Kind,
) -> Result<Option<(f64, Option<f64>)>, Failure> {
    let wrong =
        |error: &dyn std::fmt::Display| invalid(name, format_args!("[mechanics] {key}: {error}"));
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
    let Some(value_text) = item.as_str().or_else(|| part("value")) else {
        return Err(wrong(&"expected a text with a unit"));
    };
    let value = kind.parse(value_text).map_err(|error| wrong(&error))?;
    let std = part("std")
        .map(|text| kind.parse_std(text, value_text))
        .transpose();
    Ok(Some((value, std.map_err(|error| wrong(&error))?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stiffness(section: &'static str) -> Entry {
        let stiffness = Estimate::of(Kind::AngularStiffness, 1.5e5, Some(20.0));
        Entry::quantity(section, "stiffness", &stiffness, "fitted: decay.csv")
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
