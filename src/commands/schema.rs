//! `schema`: the JSON Schema of the `--json` documents.

#[cfg(test)]
pub(crate) mod types;

use serde_json::Value;

use super::Outcome;
use super::compensate::CompensateReport;
use super::harmonics::HarmonicsReport;
use super::inspect::InspectReport;
use super::predict::PredictReport;
use super::simulate::SimulateReport;
use super::table::TableReport;
use crate::batch::{BATCH_SCHEMA, MANIFEST_SCHEMA, Merged};
#[cfg(test)]
use crate::batch::{BatchReport, ManifestLine};
use crate::cli::Schema;
use crate::diagnose::Diagnosis;
#[cfg(test)]
use crate::failure::ErrorDocument;
use crate::failure::{self, ErrorCode, Failure, did_you_mean};
use crate::identify::Identification;
use crate::log;
#[cfg(test)]
use crate::log::LogLine;
use crate::packed_text::{packed, unpack};
use crate::print::Report;
use crate::progress;
#[cfg(test)]
use crate::progress::ProgressLine;

/// A kind of document.
pub(crate) struct DocumentKind {
    /// The verb, or the subject of the document.
    pub(crate) name: &'static str,
    /// Name and version as in the document itself.
    pub(crate) schema: &'static str,
}

impl DocumentKind {
    /// The JSON Schema (2020-12), generated from the types.
    pub(crate) fn text(&self) -> String {
        let all = unpack(packed!("schemas"));
        let mut named = all.split('\0').filter_map(|schema| schema.split_once('\n'));
        let found = named.find(|(name, _)| *name == self.name);
        let (_, text) = found.expect("build.rs packed the schema of every document");
        indented(text)
    }

    /// Description in one sentence.
    pub(crate) fn about(&self) -> String {
        let schema: Option<Value> = serde_json::from_str(&self.text()).ok();
        let about = schema
            .as_ref()
            .and_then(|schema| schema["description"].as_str());
        about.unwrap_or_default().to_owned()
    }
}

/// Lines of a JSON document, indented by two spaces for each level.
fn indented(text: &str) -> String {
    let mut indented = String::new();
    let mut level = 0_usize;
    for line in text.lines() {
        level -= usize::from(line.starts_with(['}', ']']));
        indented += &"  ".repeat(level);
        indented += line;
        indented.push('\n');
        level += usize::from(line.ends_with(['{', '[']));
    }
    indented
}

macro_rules! documents {
    ($($name:literal: $schema:expr),* $(,)?) => {
        /// All documents.
        pub(crate) const DOCUMENTS: &[DocumentKind] = &[$(DocumentKind {
            name: $name,
            schema: $schema,
        }),*];
    };
}

documents! {
    "compensate": CompensateReport::SCHEMA,
    "harmonics": HarmonicsReport::SCHEMA,
    "table": TableReport::SCHEMA,
    "predict": PredictReport::SCHEMA,
    "inspect": InspectReport::SCHEMA,
    "identify": Identification::SCHEMA,
    "simulate": SimulateReport::SCHEMA,
    "diagnose": Diagnosis::SCHEMA,
    "merge": Merged::SCHEMA,
    "batch": BATCH_SCHEMA,
    "error": failure::SCHEMA,
    "manifest": MANIFEST_SCHEMA,
    "log": log::SCHEMA,
    "progress": progress::SCHEMA,
}

/// Runs the verb.
pub fn run(args: &Schema) -> Result<Outcome, Failure> {
    let text = match &args.document {
        Some(name) => find(name)?.text(),
        None => list(),
    };
    let mut output = args.result.open(&[])?;
    output.write(text.as_bytes())?;
    output.finish()?;
    Ok(Outcome::Done)
}

fn find(name: &str) -> Result<&'static DocumentKind, Failure> {
    let known = || DOCUMENTS.iter().map(|document| document.name);
    DOCUMENTS
        .iter()
        .find(|document| document.name == name)
        .ok_or_else(|| {
            let names: Vec<&str> = known().collect();
            ErrorCode::InvalidValue.usage(format_args!(
                "no document of \"{name}\"{}; expected one of {}",
                did_you_mean(name, known()),
                names.join(", ")
            ))
        })
}

/// Names and descriptions of the documents, one per line.
fn list() -> String {
    let width = |text: fn(&DocumentKind) -> &'static str| {
        DOCUMENTS
            .iter()
            .map(|document| text(document).len())
            .max()
            .unwrap_or(0)
    };
    let (name, schema) = (
        width(|document| document.name),
        width(|document| document.schema),
    );
    let line = |document: &DocumentKind| {
        let about = document.about();
        format!(
            "{:name$}  {:schema$}  {about}\n",
            document.name, document.schema
        )
    };
    DOCUMENTS.iter().map(line).collect()
}
