//! JSON Schemas: every document of the golden outputs, of a batch run, of a merge and of a failure conforms to the
//! schema that it names, and no schema accepts fields that its type does not have.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use boon::{Compiler, SchemaIndex, Schemas};
use serde_json::{Value, json};

use crate::util::{Folder, HERTEL};

/// The schemas that the binary prints.
pub struct Printed {
    schemas: Schemas,
    by_name: BTreeMap<String, SchemaIndex>,
    texts: BTreeMap<String, Value>,
}

impl Printed {
    pub fn new() -> Self {
        let folder = Folder::new();
        let list = folder.run(&["schema"]);
        assert_eq!(list.code, 0, "{}", list.stderr);
        let mut printed = Self {
            schemas: Schemas::new(),
            by_name: BTreeMap::new(),
            texts: BTreeMap::new(),
        };
        for line in list.stdout.lines() {
            let mut words = line.split_whitespace();
            let (name, schema) = (words.next().unwrap(), words.next().unwrap());
            assert!(words.next().is_some(), "{line}: it does not say what it is");
            let text = folder.run(&["schema", name]).stdout;
            let text: Value = serde_json::from_str(&text).expect("a JSON document");
            assert_eq!(text["title"], schema);
            let mut compiler = Compiler::new();
            let place = format!("http://torqcomp/{name}.json");
            compiler.add_resource(&place, text.clone()).unwrap();
            let index = compiler.compile(&place, &mut printed.schemas);
            let index = index.unwrap_or_else(|error| panic!("{name}: {error:#}"));
            printed.by_name.insert(schema.to_owned(), index);
            printed.texts.insert(schema.to_owned(), text);
        }
        printed
    }

    /// The problem of a document, if any.
    pub fn fault(&self, document: &Value) -> Option<String> {
        let name = document["schema"].as_str().unwrap_or_default();
        let Some(index) = self.by_name.get(name) else {
            return Some(format!("no schema \"{name}\""));
        };
        let valid = self.schemas.validate(document, *index);
        valid.err().map(|error| format!("{name}: {error:#}"))
    }
}

/// The JSON documents in a text, each beginning on a separate line.
fn documents(text: &str) -> Vec<Value> {
    let starts = text
        .match_indices("{\n  \"schema\": \"torqcomp.")
        .map(|found| found.0);
    let read = |start| {
        serde_json::Deserializer::from_str(&text[start..])
            .into_iter()
            .next()
    };
    starts
        .map(|start| read(start).expect("a document").expect("JSON"))
        .collect()
}

fn texts(folder: &Path, all: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("an entry").path();
        match path.is_dir() {
            true => texts(&path, all),
            false => all.push(path),
        }
    }
}

/// The golden outputs are those of the commands, as other tests ensure.
#[test]
fn every_golden_document_is_of_its_schema() {
    let printed = Printed::new();
    let project = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for folder in ["tests/golden/cases", "docs"] {
        texts(&project.join(folder), &mut files);
    }
    let mut faults = Vec::new();
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for file in files {
        let Ok(text) = fs::read_to_string(&file) else {
            continue;
        };
        for document in documents(&text) {
            let fault = printed.fault(&document);
            faults.extend(fault.map(|fault| format!("{}: {fault}", file.display())));
            let name = document["schema"].as_str().unwrap().to_owned();
            *seen.entry(name).or_default() += 1;
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    let live = [
        "torqcomp.batch/1",
        "torqcomp.log/1",
        "torqcomp.manifest/1",
        "torqcomp.merge/1",
        "torqcomp.progress/1",
    ];
    for name in printed.by_name.keys() {
        let is_seen = seen.contains_key(name) || live.contains(&name.as_str());
        assert!(is_seen, "no golden document of {name}");
    }
}

#[test]
fn documents_of_many_recordings_are_of_their_schemas() {
    let printed = Printed::new();
    let folder = Folder::new();
    folder.write("stand.toml", HERTEL);
    let rows: String = (0..2000)
        .map(|i| {
            format!(
                "{:.4},{}\n",
                1e-4 * f64::from(i),
                (0.37 * f64::from(i)).sin()
            )
        })
        .collect();
    fs::create_dir(folder.path("logs")).unwrap();
    folder.write("logs/a.csv", format!("time_s,bridge_v\n{rows}"));
    folder.write("logs/b.csv", "time_s,bridge_v\n0,1\n0.1,x\n0.2,2\n0.3,2\n");
    let args = [
        "compensate",
        "logs/",
        "--stand",
        "stand.toml",
        "-o",
        "out/",
        "--json",
    ];
    let failed = folder.run(&args);
    assert_eq!(failed.code, 1, "{}", failed.stderr);
    let again = folder.run(&[&args[..], &["--skip-existing"]].concat());
    let merged = folder.run(&["merge", "out/", "-o", "table.csv", "--json"]);
    for ran in [&failed, &again, &merged] {
        let document: Value = serde_json::from_str(&ran.stdout).expect("one document");
        assert_eq!(printed.fault(&document), None);
    }
    let manifest = folder.read("out/torqcomp-manifest.jsonl");
    assert!(manifest.lines().count() >= 6, "{manifest}");
    for line in manifest.lines() {
        let line: Value = serde_json::from_str(line).expect("a line of JSON");
        assert_eq!(printed.fault(&line), None, "{line}");
    }
}

#[test]
fn a_schema_takes_nothing_else() {
    let printed = Printed::new();
    let folder = Folder::new();
    let failed = folder.run(&["inspect", "nowhere.csv", "--json"]);
    let good: Value = serde_json::from_str(&failed.stdout).expect("one document");
    assert_eq!(printed.fault(&good), None);
    let spoilt = |change: &dyn Fn(&mut Value)| {
        let mut document = good.clone();
        change(&mut document);
        printed.fault(&document).is_some()
    };
    assert!(spoilt(&|d| d["more"] = json!(1)));
    assert!(spoilt(&|d| d["error"]["more"] = json!(1)));
    assert!(spoilt(&|d| d["error"]["code"] = json!("no-such-code")));
    assert!(spoilt(&|d| d["error"]["where"]["line"] = json!("3")));
    assert!(spoilt(&|d| {
        d["error"].as_object_mut().unwrap().remove("hint");
    }));
}

/// Checks that every object, including nested ones, is described.
fn check_objects(schema: &Value, place: &str, is_part: bool) {
    let Some(keywords) = schema.as_object() else {
        return;
    };
    let has_keys = keywords.contains_key("properties");
    let is_closed = ["additionalProperties", "unevaluatedProperties"]
        .iter()
        .any(|keyword| keywords.contains_key(*keyword));
    assert!(
        !has_keys || is_part || is_closed,
        "{place}: any keys are taken"
    );
    for keyword in ["allOf", "anyOf", "oneOf"] {
        let parts = keywords.get(keyword).and_then(Value::as_array);
        for part in parts.into_iter().flatten() {
            check_objects(part, place, is_part || has_keys);
        }
    }
    let properties = keywords.get("properties").and_then(Value::as_object);
    for (name, property) in properties.into_iter().flatten() {
        let place = format!("{place}.{name}");
        assert!(
            property["description"].is_string(),
            "{place}: no description"
        );
        check_objects(property, &place, false);
    }
    if let Some(items) = keywords.get("items") {
        check_objects(items, place, false);
    }
}

#[test]
fn every_key_is_described_and_no_other_is_taken() {
    for (name, schema) in Printed::new().texts {
        check_objects(&schema, &name, false);
    }
}
