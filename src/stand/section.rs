//! Parsing of a section of a stand file: every key must be requested, and remaining ones are
//! errors.

use std::cell::RefCell;

use toml_edit::{Item, TableLike};
use torqcomp_model::{Estimate, Kind};

use super::keys::{self, Takes};
use crate::failure::{ErrorCode, Failure, did_you_mean};
use crate::print::rounded;

/// The text of a stand file and its name.
pub struct SourceText<'a> {
    /// Name of the file.
    pub name: &'a str,
    /// Its content.
    pub text: &'a str,
}

impl SourceText<'_> {
    /// A failure at a byte of the file.
    pub fn at(&self, offset: Option<usize>, message: impl std::fmt::Display) -> Failure {
        ErrorCode::InvalidStand
            .failed(message)
            .at(self.name)
            .with(|place| {
                let before = offset.map(|offset| &self.text[..offset]);
                let line = before.map(|text| text.rsplit('\n').next().unwrap_or_default());
                place.line = before.map(|text| text.matches('\n').count() + 1);
                place.column = line.map(|text| text.chars().count() + 1);
                place.byte = offset.map(|offset| offset as u64);
            })
    }
}

/// A table of a stand file.
pub struct Section<'a> {
    source: &'a SourceText<'a>,
    title: String,
    table: &'a dyn TableLike,
    start: Option<usize>,
    asked: RefCell<Vec<&'static str>>,
}

impl<'a> Section<'a> {
    /// A section with a title such as `[mechanics]`.
    pub fn new(
        source: &'a SourceText<'a>,
        title: impl Into<String>,
        table: &'a dyn TableLike,
        start: Option<usize>,
    ) -> Self {
        Self {
            source,
            title: title.into(),
            table,
            start,
            asked: RefCell::default(),
        }
    }

    /// Type of a key according to `keys`. Tables of `value`, `std` and `source` are not listed there, nor are
    /// parameters of effects.
    fn listed(&self, key: &str) -> Option<Takes> {
        keys::takes(&self.title, key)
    }

    fn item(&self, key: &'static str) -> Option<&'a Item> {
        debug_assert!(
            self.listed(key).is_some() || self.title.contains(' ') || self.title == "[[effects]]",
            "{} {key} is not listed in keys.rs",
            self.title
        );
        let mut asked = self.asked.borrow_mut();
        if !asked.contains(&key) {
            asked.push(key);
        }
        self.table.get(key)
    }

    /// The text of a key, known or not, without requesting it.
    pub fn glance(&self, key: &str) -> Option<&'a str> {
        let item = self.table.get(key)?;
        let value = item.as_table_like().and_then(|table| table.get("value"));
        value.unwrap_or(item).as_str()
    }

    /// A failure at a key, or at the section if the key is missing.
    pub fn fail(&self, key: &str, message: impl std::fmt::Display) -> Failure {
        let place = self
            .table
            .get_key_value(key)
            .and_then(|(key, item)| item.span().or(key.span()))
            .map(|span| span.start)
            .or(self.start);
        let name = [self.title.as_str(), key].join(" ");
        match name.trim() {
            "" => self.source.at(place, message),
            name => self.source.at(place, format_args!("{name}: {message}")),
        }
    }

    /// Whether a key is present.
    pub fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// A sub-table.
    pub fn section(&self, key: &'static str) -> Result<Option<Section<'a>>, Failure> {
        let Some(item) = self.item(key) else {
            return Ok(None);
        };
        let title = match self.title.strip_suffix(']') {
            Some(outer) => format!("{outer}.{key}]"),
            None => format!("[{key}]"),
        };
        match item.as_table_like() {
            Some(table) => {
                let start = item.span().map(|span| span.start);
                Ok(Some(Section::new(self.source, title, table, start)))
            }
            None => Err(self.fail(key, format_args!("expected a section, written {title}"))),
        }
    }

    /// A list of tables, written `[[key]]`.
    pub fn sections(&self, key: &'static str) -> Result<Vec<Section<'a>>, Failure> {
        let Some(item) = self.item(key) else {
            return Ok(Vec::new());
        };
        let outer = self.title.trim_matches(['[', ']']);
        let title = match outer {
            "" => format!("[[{key}]]"),
            outer => format!("[[{outer}.{key}]]"),
        };
        if let Some(tables) = item.as_array_of_tables() {
            return Ok(tables
                .iter()
                .map(|table| {
                    let start = table.span().map(|span| span.start);
                    Section::new(self.source, title.clone(), table, start)
                })
                .collect());
        }
        let inline: Option<Vec<Section<'a>>> = item.as_array().and_then(|array| {
            array
                .iter()
                .map(|value| {
                    let start = value.span().map(|span| span.start);
                    let table: &dyn TableLike = value.as_inline_table()?;
                    Some(Section::new(self.source, title.clone(), table, start))
                })
                .collect()
        });
        inline.ok_or_else(|| self.fail(key, format_args!("expected sections written {title}")))
    }

    /// The value of a key, as `read` from its item.
    fn value<T>(
        &self,
        key: &'static str,
        read: fn(&'a Item) -> Option<T>,
        expected: &str,
    ) -> Result<Option<T>, Failure> {
        let value = self.item(key).map(|item| read(item).ok_or(expected));
        value
            .transpose()
            .map_err(|expected| self.fail(key, expected))
    }

    /// A text.
    pub fn text(&self, key: &'static str) -> Result<Option<&'a str>, Failure> {
        self.value(key, Item::as_str, "expected a text in quotes")
    }

    /// One of several words.
    pub fn word(&self, key: &'static str, words: &[&str]) -> Result<Option<&'a str>, Failure> {
        match self.text(key)? {
            Some(text) if !words.contains(&text) => Err(self.fail(
                key,
                format_args!(
                    "\"{text}\" is not known; expected one of {}{}",
                    words.join(", "),
                    did_you_mean(text, words.iter().copied())
                ),
            )),
            other => Ok(other),
        }
    }

    /// A whole number.
    pub fn whole(&self, key: &'static str) -> Result<Option<i64>, Failure> {
        self.value(key, Item::as_integer, "expected a whole number")
    }

    /// A quantity: a text such as `"22.5 V"`, or a table of `value`, `std` and `source`.
    pub fn quantity(&self, key: &'static str, kind: Kind) -> Result<Option<Estimate>, Failure> {
        debug_assert_eq!(self.listed(key), Some(Takes::Quantity(kind)), "{key}");
        self.quantity_of(key, kind)
    }

    /// The same for a key that accepts several kinds.
    pub fn quantity_of(&self, key: &'static str, kind: Kind) -> Result<Option<Estimate>, Failure> {
        let Some(item) = self.item(key) else {
            return Ok(None);
        };
        let Some(table) = item.as_table_like() else {
            let text = self.quantity_text(key, item)?;
            let value = kind.parse(&text).map_err(|error| self.fail(key, error))?;
            return self
                .estimate(key, kind, value, None, "stand file")
                .map(Some);
        };
        let start = item.span().map(|span| span.start);
        let inner = Section::new(self.source, format!("{} {key}", self.title), table, start);
        let value = inner.item("value").ok_or_else(|| {
            inner.fail("", format_args!("expected value = \"{}\"", kind.example()))
        })?;
        let text = inner.quantity_text("value", value)?;
        let value = kind
            .parse(&text)
            .map_err(|error| inner.fail("value", error))?;
        let std = match inner.item("std") {
            None => None,
            Some(item) => Some(
                kind.parse_std(&inner.quantity_text("std", item)?, &text)
                    .map_err(|error| inner.fail("std", error))?,
            ),
        };
        let source = inner.text("source")?.unwrap_or("stand file");
        inner.finish()?;
        self.estimate(key, kind, value, std, source).map(Some)
    }

    /// A required quantity.
    pub fn required(&self, key: &'static str, kind: Kind) -> Result<Estimate, Failure> {
        self.quantity(key, kind)?
            .ok_or_else(|| self.missing(key, kind))
    }

    /// Failure for a missing key, possibly present with a misspelt name.
    fn missing(&self, key: &str, kind: Kind) -> Failure {
        let misspelt = self
            .table
            .iter()
            .map(|(other, _)| other)
            .filter(|other| !self.asked.borrow().contains(other))
            .find(|other| strsim::jaro_winkler(other, key) > 0.85);
        match misspelt {
            Some(other) => self.fail(other, format_args!("unknown key; did you mean \"{key}\"?")),
            None => {
                let missing = format!("{key} is missing; write {key} = ");
                match self.in_other_terms(key) {
                    Some((other, value)) => self.fail(
                        other,
                        format_args!("{missing}\"{}\" in place of {other}", rounded(value, 4)),
                    ),
                    None => self.fail("", format_args!("{missing}\"{}\"", kind.example())),
                }
            }
        }
    }

    /// A number under an alternative name, converted to the key.
    fn in_other_terms(&self, key: &str) -> Option<(&'a str, f64)> {
        let as_key = |(name, item): (&'a str, &'a Item)| {
            let number = item.as_float().or(item.as_integer().map(|n| n as f64));
            let number = number.or_else(|| item.as_str()?.trim().parse().ok())?;
            keys::from_other_term(key, name).map(|convert| (name, convert(number)))
        };
        self.table.iter().find_map(as_key)
    }

    /// A required quantity greater than zero.
    pub fn positive(&self, key: &'static str, kind: Kind) -> Result<Estimate, Failure> {
        let estimate = self.required(key, kind)?;
        self.check_positive(key, kind, &estimate)?;
        Ok(estimate)
    }

    /// An optional quantity greater than zero.
    pub fn positive_if_any(
        &self,
        key: &'static str,
        kind: Kind,
    ) -> Result<Option<Estimate>, Failure> {
        let estimate = self.quantity(key, kind)?;
        if let Some(estimate) = &estimate {
            self.check_positive(key, kind, estimate)?;
        }
        Ok(estimate)
    }

    fn check_positive(&self, key: &str, kind: Kind, estimate: &Estimate) -> Result<(), Failure> {
        if estimate.value() > 0.0 {
            return Ok(());
        }
        Err(self.fail(
            key,
            format_args!(
                "expected a {} greater than zero, as in \"{}\"",
                kind.name(),
                kind.example()
            ),
        ))
    }

    /// A required quantity that is not negative.
    pub fn not_negative(&self, key: &'static str, kind: Kind) -> Result<Estimate, Failure> {
        let estimate = self.required(key, kind)?;
        if estimate.value() >= 0.0 {
            return Ok(estimate);
        }
        Err(self.fail(
            key,
            format_args!("expected a {} of zero or more", kind.name()),
        ))
    }

    fn estimate(
        &self,
        key: &str,
        kind: Kind,
        value: f64,
        std: Option<f64>,
        source: &str,
    ) -> Result<Estimate, Failure> {
        Estimate::new(kind, value, std, source.to_owned()).map_err(|error| self.fail(key, error))
    }

    /// The text of a quantity; a bare number is passed on so that its kind can reject it.
    fn quantity_text(&self, key: &str, item: &Item) -> Result<String, Failure> {
        if let Some(text) = item.as_str() {
            return Ok(text.to_owned());
        }
        if let Some(number) = item.as_float() {
            return Ok(number.to_string());
        }
        if let Some(number) = item.as_integer() {
            return Ok(number.to_string());
        }
        Err(self.fail(
            key,
            "expected a quantity in quotes, or { value = \"…\", std = \"…\", source = \"…\" }",
        ))
    }

    /// The raw text of a quantity whose unit determines its kind, also from a table of `value`, `std` and `source`.
    pub fn raw(&self, key: &'static str) -> Result<Option<String>, Failure> {
        Ok(self.raw_with_std(key)?.map(|(text, _)| text))
    }

    /// The same, with the raw text of its `std`.
    pub fn raw_with_std(
        &self,
        key: &'static str,
    ) -> Result<Option<(String, Option<String>)>, Failure> {
        let Some(item) = self.item(key) else {
            return Ok(None);
        };
        let Some(table) = item.as_table_like() else {
            return Ok(Some((self.quantity_text(key, item)?, None)));
        };
        let start = item.span().map(|span| span.start);
        let inner = Section::new(self.source, format!("{} {key}", self.title), table, start);
        let value = inner
            .item("value")
            .ok_or_else(|| inner.fail("", "expected value = \"…\""))?;
        let text = inner.quantity_text("value", value)?;
        let std = inner.item("std");
        let std = std.map(|std| inner.quantity_text("std", std)).transpose()?;
        inner.text("source")?;
        inner.finish()?;
        Ok(Some((text, std)))
    }

    /// A correlation coefficient; 0 if missing.
    pub fn correlation(&self, key: &'static str) -> Result<f64, Failure> {
        let given = self.quantity(key, Kind::Ratio)?;
        let value = given.map_or(0.0, |given| given.value());
        match value.abs() <= 1.0 {
            true => Ok(value),
            false => Err(self.fail(key, "expected a correlation from -1 to 1")),
        }
    }

    /// Rejects keys that were not requested.
    pub fn finish(&self) -> Result<(), Failure> {
        let asked = self.asked.borrow();
        match self.table.iter().find(|(key, _)| !asked.contains(key)) {
            None => Ok(()),
            Some((key, _)) => {
                let hint = did_you_mean(key, asked.iter().copied());
                let known = asked.join(", ");
                Err(self.fail(key, format_args!("unknown key{hint}. Known here: {known}")))
            }
        }
    }
}
