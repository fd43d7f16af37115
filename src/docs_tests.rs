//! Pages of `docs/` generated from the code. `SNAPSHOTS=overwrite cargo test --lib docs_tests` updates them.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use serde_json::Value;
use torqcomp_model::UnitSystem;
use torqcomp_model::effects::{
    EFFECTS, Effect, EffectParameter, Form, ParameterScale, Stage, Unit,
};

use crate::commands::schema::{DOCUMENTS, types};
use crate::failure::ErrorCode;
use crate::stand::keys::{SECTIONS, Takes};
use crate::warning::CODES;

const WRITTEN: &str =
    "<!-- Written from the code by `SNAPSHOTS=overwrite cargo test --lib docs_tests`. -->\n";

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Compares a page with the file, or updates the file.
fn compare(name: &str, page: &str) {
    let path = project("docs").join(name);
    if std::env::var_os("SNAPSHOTS").is_some_and(|action| action == "overwrite") {
        std::fs::write(&path, page).unwrap();
        return;
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    let difference = found.lines().zip(page.lines()).find(|(a, b)| a != b);
    assert!(
        found == page,
        "docs/{name} is not what the code says (first difference: {difference:?}); \
         SNAPSHOTS=overwrite cargo test --lib docs_tests writes it anew"
    );
}

#[test]
fn the_list_of_effects_is_that_of_the_code() {
    let mut page = format!(
        "# Effects\n\n{WRITTEN}\n\
         Effects beyond the plain stand `x'' + 2 zeta w0 x' + w0^2 x = w0^2 G u`, with `u` the applied and `x` the \
         recorded quantity. A stand file declares an effect by its kind, its form (the first one by default) and its \
         parameters:\n\n\
         ```toml\n[[effects]]\nkind = \"coulomb-friction\"\nform = \"tanh\"\ntorque = \"2.5 N m\"\n\
         transition_speed = \"40 N m/s\"\n```\n\n\
         `diagnose` finds effects in records and writes them into the stand file, `simulate` applies them, and \
         `compensate` removes them ([how](compensation.md)). In the equations, `n` is a torque in the stand, \
         `x'' + 2 zeta w0 x' + w0^2 (x + n) = w0^2 G u`, and `y` is the record. With a `coupled` second mode, `n` acts \
         on the first of the two inertias, and with `structural-damping` on a stand that is exact at its natural \
         frequency. The tables show V for the unit of the record. For a stand that gives torque, with a calibration for example, read N m instead, whatever the unit of \
         the record; for one with `static_gain`, the unit of the record in that key. Bounds are those of `diagnose`, \
         in multiples of `rms` and `peak` of the record about its mean, of `w0` and `f0`, the natural frequency in \
         rad/s and Hz, and of the `length` of the record in s. A stand file may exceed them.\n\n"
    );
    for effect in EFFECTS {
        write!(page, "- [`{0}`](#{0})", effect.name).unwrap();
        writeln!(page, ": {}", effect.equation.replace('|', "\\|")).unwrap();
    }
    for effect in EFFECTS {
        section(&mut page, effect);
    }
    compare("effects.md", &page);
}

fn section(page: &mut String, effect: &Effect) {
    let named = |names: &[&str]| {
        let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        quoted.join(", ")
    };
    write!(
        page,
        "\n## {}\n\n{} {}\n\nSource: {}. Valid {}. Mistaken for {}. To distinguish them: {}.\n\n| form | equation | \
         where | parameters, unit, bounds | compensate |\n|---|---|---|---|---|\n",
        effect.name,
        effect.meaning,
        effect.remedy,
        effect.source,
        effect.validity,
        named(effect.mistaken_for),
        effect.experiment
    )
    .unwrap();
    for form in effect.forms {
        let parameters: Vec<String> = form.parameters.iter().map(parameter).collect();
        let middle = vec![1.0; form.parameters.len()];
        writeln!(
            page,
            "| `{}` | `{}` | {} | {} | {} |",
            form.name,
            form.law.replace('|', "\\|"),
            place(form),
            parameters.join("; "),
            (form.build)(&middle).treatment().name()
        )
        .unwrap();
    }
}

fn place(form: &Form) -> &'static str {
    match form.stage {
        Stage::Stand => "torque in the stand",
        Stage::Dynamics => "response of the stand",
        Stage::Gage => "gage and bridge",
        Stage::Chain => "recorder",
        Stage::Limit => "range of the recorder",
        Stage::Disturbance => "added to the record",
    }
}

fn parameter(parameter: &EffectParameter) -> String {
    let unit = match parameter.unit.text("V") {
        unit if unit.is_empty() => String::new(),
        unit => format!(" in {unit}"),
    };
    let [lower, upper] = match (parameter.reciprocal, parameter.lower, parameter.upper) {
        // A fit changes the period.
        (true, 0.0, upper) => [upper.recip(), f64::INFINITY],
        (true, lower, upper) => [upper.recip(), lower.recip()],
        (false, lower, upper) => [lower, upper],
    };
    let range = if upper.is_finite() {
        format!("{lower} to {upper}")
    } else {
        format!("at least {lower}")
    };
    let scale = match scale(parameter) {
        scale if scale.is_empty() => scale,
        scale => format!(" × {scale}"),
    };
    format!("`{}`{unit}, {range}{scale}", parameter.name)
}

/// Scale of the bounds of a parameter.
fn scale(parameter: &EffectParameter) -> String {
    let (size, time, frequency) = match parameter.scale {
        ParameterScale::Motion => ("rms", "1/w0", "f0"),
        ParameterScale::Peak => ("peak", "1/w0", "f0"),
        ParameterScale::Record => ("rms", "length", "1/length"),
        ParameterScale::Absolute => return String::new(),
    };
    let power = |base: &str, power: i32| match (base.strip_prefix("1/"), power) {
        (_, 0) => None,
        (_, 1) => Some(base.to_owned()),
        (Some(base), -1) => Some(base.to_owned()),
        (Some(base), power) => Some(format!("{base}^{}", -power)),
        (None, power) => Some(format!("{base}^{power}")),
    };
    match parameter.unit {
        Unit::Number => String::new(),
        Unit::Hertz => frequency.to_owned(),
        Unit::Powers { recorded, second } => [power(size, recorded), power(time, second)]
            .into_iter()
            .flatten()
            .collect::<Vec<_>>()
            .join(" "),
    }
}

#[test]
fn the_list_of_stand_keys_is_that_of_the_code() {
    let mut page = format!(
        "# Keys of the stand file\n\n{WRITTEN}\n\
         For how to write a stand file, see [stand-file.md](stand-file.md). A quantity is a text with its unit, as in the \
         examples, or a table `{{ value = \"…\", std = \"…\", source = \"…\" }}`.\n"
    );
    for (title, about, keys) in SECTIONS {
        let title = match *title {
            "" => "Top of the file".to_owned(),
            title => format!("`{title}`"),
        };
        write!(
            page,
            "\n## {title}\n\n{about}\n\n| key | takes | meaning |\n|---|---|---|\n"
        )
        .unwrap();
        for (name, takes, meaning) in *keys {
            let meaning = meaning.replace('|', "\\|");
            writeln!(page, "| `{name}` | {} | {meaning} |", takes_text(*takes)).unwrap();
        }
    }
    compare("stand-keys.md", &page);
}

fn takes_text(takes: Takes) -> String {
    match takes {
        Takes::Text => "text".to_owned(),
        Takes::Word => "keyword".to_owned(),
        Takes::Whole => "whole number".to_owned(),
        Takes::Quantity(kind) => match kind.unit(UnitSystem::Si) {
            "1" => format!("{}, `\"{}\"`", kind.name(), kind.example()),
            unit => format!("{} in {unit}, `\"{}\"`", kind.name(), kind.example()),
        },
        Takes::RecordQuantity => "quantity in the unit of the record".to_owned(),
        Takes::Section => "section".to_owned(),
    }
}

/// A stand with every section; `BEAM` and `PART` are placeholders for the variants.
const COMPLETE: &str = r#"schema = "torqcomp.stand/1"
[mechanics]
inertia = "1 kg m^2"
damping = "1 N m s/rad"
stiffness = "1 N m/rad"
[beam]
BEAM
length = "0.1 m"
elastic_modulus = "200 GPa"
radius = "0.1 m"
[beam.thread]
length = "0.01 m"
root_diameter = "0.005 m"
[[parts]]
PART
mass = "1 kg"
[friction]
force_change = "1 N"
speed_change = "1 rad/s"
radius = "0.1 m"
[gage]
gage_factor = 2
resistance = "120 ohm"
[bridge]
layout = "full-poisson"
poisson_ratio = 0.3
excitation = "10 V"
[recorder]
gain = 1
[[effects]]
kind = "gain-error"
error = 0.01
[calibration]
torque_per_volt = "1 N m/V"
[diagnosed]
"#;

/// A mode beside it.
const MODE: &str = "[[modes]]\nnatural_frequency = \"590 Hz\"\ndamping_ratio = 0.07\n";

/// The other form of its calibration.
const POINTS: &str = r#"[[calibration.points]]
reading = "1 V"
torque = "1 N m"
[[calibration.points]]
reading = "2 V"
torque = "2 N m""#;

/// The keys accepted in a section: those listed when an unknown key is rejected.
fn asked(title: &str) -> Vec<String> {
    let variants = [
        (
            "section = \"circle\"\ndiameter = \"0.01 m\"",
            "kind = \"disc\"\nradius = \"0.1 m\"",
        ),
        (
            "section = \"tube\"\nouter_diameter = \"0.02 m\"\ninner_diameter = \"0.01 m\"",
            "kind = \"hollow-cylinder\"\ninner_radius = \"0.1 m\"\nouter_radius = \"0.2 m\"",
        ),
        (
            "width = \"0.01 m\"\ndepth = \"0.01 m\"",
            "kind = \"disc\"\nradius = \"0.1 m\"",
        ),
    ];
    let modal = (
        "inertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\nstiffness = \"1 N m/rad\"",
        "natural_frequency = \"590 Hz\"\ndamping_ratio = 0.07",
    );
    let mut keys = Vec::new();
    for (beam, part) in variants {
        let whole = COMPLETE.replace("BEAM", beam).replace("PART", part);
        for text in [whole.clone(), whole.replace(modal.0, modal.1)] {
            let text = match title {
                "[[modes]]" => text + MODE,
                "[[calibration.points]]" => text.replace("torque_per_volt = \"1 N m/V\"", POINTS),
                _ => text,
            };
            let text = match title {
                "" => format!("zzz = 1\n{text}"),
                title => text.replace(&format!("{title}\n"), &format!("{title}\nzzz = 1\n")),
            };
            let error = crate::stand::parse("s", &text).unwrap_err().to_string();
            let (_, known) = error.split_once("Known here: ").expect(&error);
            keys.extend(known.split(", ").map(str::to_owned));
        }
    }
    keys.sort();
    keys.dedup();
    keys
}

#[test]
fn every_key_of_the_list_is_read() {
    for (title, _, keys) in SECTIONS {
        let asked = asked(title);
        for (key, _, _) in *keys {
            let is_read = asked.iter().any(|name| name == key);
            assert!(is_read, "{title} {key}: {asked:?}");
        }
    }
}

#[test]
fn the_list_of_warnings_is_that_of_the_code() {
    let mut page = format!(
        "# Warnings\n\n{WRITTEN}\n\
         Every verb reports warnings with a stable code, in the text and as `warnings[] {{code, message}}` in the JSON \
         document; with `--strict` any warning gives exit code 3. For the warnings about samples and the time axis, \
         [inspect.md](inspect.md) gives their criteria and false-alarm rates.\n"
    );
    for (group, codes) in CODES {
        write!(
            page,
            "\n## {group}\n\n| code | meaning | what to do |\n|---|---|---|\n"
        )
        .unwrap();
        for [code, meaning, remedy] in *codes {
            writeln!(page, "| `{code}` | {meaning} | {remedy} |").unwrap();
        }
    }
    compare("warnings.md", &page);
}

/// Sources without the list itself and this file.
fn sources(folder: &Path, all: &mut String) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if path.is_dir() {
            sources(&path, all);
        } else if name.ends_with(".rs") && !["warning.rs", "docs_tests.rs"].contains(&&*name) {
            all.push_str(&std::fs::read_to_string(&path).unwrap());
        }
    }
}

#[test]
fn every_warning_code_is_used() {
    let mut all = String::new();
    sources(&project("src"), &mut all);
    let codes: Vec<&str> = CODES
        .iter()
        .flat_map(|(_, codes)| codes.iter())
        .map(|c| c[0])
        .collect();
    let variant = |code: &str| -> String {
        let words = code.split('-');
        words
            .map(|word| word[..1].to_uppercase() + &word[1..])
            .collect()
    };
    for code in &codes {
        let names = [
            format!("\"{code}\""),
            format!("WarningCode::{}", variant(code)),
        ];
        assert!(
            names.iter().any(|name| all.contains(name)),
            "{code} is not used"
        );
    }
}

#[test]
fn the_list_of_documents_is_that_of_the_code() {
    let mut page = format!(
        "# JSON documents\n\n{WRITTEN}\n\
         The output of `--json`. Each document names its type in `schema`; `torqcomp schema` lists the types, and \
         `torqcomp schema NAME` prints the JSON Schema (2020-12) of one. Keys may be added to a type; existing keys stay. \
         Unknown numbers are `null`. Below, `[]` stands for the items of a list.\n\n\
         If a command fails, `--json` prints [`torqcomp.error/1`](#error) instead of the report, unless the report has \
         been printed already; the exit code does not change.\n"
    );
    for (document, text) in DOCUMENTS.iter().zip(types::texts()) {
        let own = format!("../src/commands/schema/{}.json", document.name);
        compare(&own, &text);
        let schema: Value = serde_json::from_str(&text).unwrap();
        write!(
            page,
            "\n## {}\n\n`{}`: {}\n\n| key | type | meaning |\n|---|---|---|\n",
            document.name,
            document.schema,
            schema["description"].as_str().unwrap()
        )
        .unwrap();
        let mut rows = Vec::new();
        keys(&schema, "", &mut rows);
        rows.iter().for_each(|row| writeln!(page, "{row}").unwrap());
    }
    page += "\n## Codes of failures\n\n| code | meaning |\n|---|---|\n";
    let schema = schemars::schema_for!(ErrorCode).to_value();
    for code in schema["oneOf"].as_array().unwrap() {
        let text = |key: &str| code[key].as_str().unwrap().replace('\n', " ");
        writeln!(page, "| `{}` | {} |", text("const"), text("description")).unwrap();
    }
    compare("json.md", &page);
}

/// Rows of a table of the keys of a schema, each once.
fn keys(schema: &Value, place: &str, rows: &mut Vec<String>) {
    let properties = schema["properties"].as_object();
    for (name, property) in properties.into_iter().flatten() {
        let place = format!("{place}{name}");
        let meaning = property["description"].as_str().unwrap_or_default();
        let row = format!(
            "| `{place}` | {} | {} |",
            types(property),
            meaning.replace('|', "\\|")
        );
        if !rows.contains(&row) {
            rows.push(row);
        }
        keys(property, &format!("{place}."), rows);
    }
    for keyword in ["anyOf", "oneOf", "allOf"] {
        for part in schema[keyword].as_array().into_iter().flatten() {
            keys(part, place, rows);
        }
    }
    if schema["items"].is_object() {
        let place = place.strip_suffix('.').unwrap_or(place);
        keys(&schema["items"], &format!("{place}[]."), rows);
    }
}

/// Allowed types of a value.
fn types(schema: &Value) -> String {
    if let Some(name) = schema["const"].as_str() {
        return format!("`{name}`");
    }
    if let Some(names) = schema["enum"].as_array() {
        let names: Vec<String> = names
            .iter()
            .map(|name| format!("`{}`", name.as_str().unwrap_or("null")))
            .collect();
        return names.join(", ");
    }
    let list: Vec<&str> = match &schema["type"] {
        Value::String(one) => vec![one],
        Value::Array(several) => several.iter().filter_map(Value::as_str).collect(),
        _ => {
            let parts = ["anyOf", "oneOf"]
                .iter()
                .filter_map(|keyword| schema[*keyword].as_array());
            let mut names: Vec<String> = parts.flatten().map(types).collect();
            names.dedup();
            return names.join(" or ");
        }
    };
    list.join(" or ").replace("array", "list")
}
