//! JSON Schemas from the types of the documents. The program contains their texts, as the code that generates them
//! is 0.3 MiB larger than the texts.

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

use super::{
    BatchReport, CompensateReport, DOCUMENTS, Diagnosis, ErrorDocument, HarmonicsReport,
    Identification, InspectReport, LogLine, ManifestLine, Merged, PredictReport, ProgressLine,
    SimulateReport, TableReport,
};
use crate::print::{self, Document};

/// The text of each document's schema, in the order of [`DOCUMENTS`].
pub(crate) fn texts() -> Vec<String> {
    let schemas: [fn(&str) -> Value; DOCUMENTS.len()] = [
        closed::<Document<CompensateReport>, CompensateReport>,
        closed::<Document<HarmonicsReport>, HarmonicsReport>,
        closed::<Document<TableReport>, TableReport>,
        closed::<Document<PredictReport>, PredictReport>,
        closed::<Document<InspectReport>, InspectReport>,
        closed::<Document<Identification>, Identification>,
        closed::<Document<SimulateReport>, SimulateReport>,
        closed::<Document<Diagnosis>, Diagnosis>,
        closed::<Document<Merged>, Merged>,
        closed::<Document<BatchReport>, BatchReport>,
        closed::<Document<ErrorDocument>, ErrorDocument>,
        closed::<ManifestLine, ManifestLine>,
        closed::<LogLine, LogLine>,
        closed::<ProgressLine, ProgressLine>,
    ];
    let pairs = schemas.iter().zip(DOCUMENTS);
    pairs
        .map(|(make, document)| print::json(&make(document.schema)))
        .collect()
}

/// The schema of a document `D` with a report `R`, without keys other than those of the types.
fn closed<D: JsonSchema, R: JsonSchema>(name: &str) -> Value {
    let settings = || {
        let settings = SchemaSettings::draft2020_12().for_serialize();
        settings.with(|settings| settings.inline_subschemas = true)
    };
    let mut schema = settings()
        .into_generator()
        .into_root_schema_for::<D>()
        .to_value();
    let report = settings().into_generator().into_root_schema_for::<R>();
    schema["title"] = json!(name);
    schema["description"] = report.get("description").cloned().unwrap_or_default();
    name_it(&mut schema, name);
    close(&mut schema, false);
    schema
}

/// Sets the name of the document in its own schema key.
fn name_it(schema: &mut Value, name: &str) {
    if let Some(own) = schema.pointer_mut("/properties/schema") {
        own["const"] = json!(name);
    }
    for variant in schema
        .get_mut("anyOf")
        .and_then(Value::as_array_mut)
        .into_iter()
        .flatten()
    {
        name_it(variant, name);
    }
}

/// Keywords whose schemas apply to the same object.
const IN_PLACE: [&str; 3] = ["allOf", "anyOf", "oneOf"];

/// Describes the key that names a variant with the description of the variant.
fn describe_tag(variant: &mut Value) {
    let Some(about) = variant.get("description").cloned() else {
        return;
    };
    let properties = variant.get_mut("properties").and_then(Value::as_object_mut);
    for (_, property) in properties.into_iter().flat_map(Map::iter_mut) {
        if property.get("const").is_some() && property.get("description").is_none() {
            property["description"] = about.clone();
        }
    }
}

/// Disallows other keys in all objects; `is_part`: the remaining keys of the object are in the enclosing schema.
fn close(schema: &mut Value, is_part: bool) {
    let Value::Object(keywords) = schema else {
        return;
    };
    if let Some(Value::String(text)) = keywords.get_mut("description") {
        // Doc comments contain line breaks.
        *text = text.replace('\n', " ");
    }
    let has_keys = keywords.contains_key("properties");
    let has_parts = IN_PLACE
        .iter()
        .any(|keyword| keywords.contains_key(*keyword));
    if has_keys && !is_part {
        // Only this keyword takes the keys in parts into account.
        let keyword = match has_parts {
            true => "unevaluatedProperties",
            false => "additionalProperties",
        };
        keywords.insert(keyword.to_owned(), json!(false));
    }
    for keyword in IN_PLACE {
        let parts = keywords.get_mut(keyword).and_then(Value::as_array_mut);
        for part in parts.into_iter().flatten() {
            describe_tag(part);
            close(part, is_part || has_keys);
        }
    }
    let properties = keywords
        .get_mut("properties")
        .and_then(Value::as_object_mut);
    for (_, property) in properties.into_iter().flat_map(Map::iter_mut) {
        close(property, false);
    }
    if let Some(items) = keywords.get_mut("items") {
        close(items, false);
    }
}
