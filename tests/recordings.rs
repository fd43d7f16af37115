//! Every sample in `tests/recordings`, read through the binary, compared with `expected.toml`: channels, units, counts,
//! rates, starts and sums.
//!
//! To add a dialect, put a file there and run `SNAPSHOTS=overwrite cargo test --test tests recordings`, then check the
//! new entry against the file by hand. Options required for a file are in its entry as `options`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use serde_json::Value;
use snapbox::Data;
use snapbox::assert::DEFAULT_ACTION_ENV;
use toml_edit::DocumentMut;

use crate::golden::Ran;
use crate::golden::settle::{readable, settle};

/// The expected content of the samples.
const EXPECTED: &str = "expected.toml";

/// The folder of the samples.
fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recordings")
}

/// Names of the samples, sorted.
pub fn samples() -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder())
        .expect("the samples")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .into_string()
                .expect("a name")
        })
        .filter(|name| ![EXPECTED, "disagreements.txt"].contains(&name.as_str()))
        .collect();
    names.sort();
    names
}

/// Options required for a sample, from its entry.
pub fn options(name: &str) -> Vec<String> {
    static TABLE: LazyLock<DocumentMut> = LazyLock::new(|| {
        let text = std::fs::read_to_string(folder().join(EXPECTED)).expect("expectations");
        text.parse().expect("TOML")
    });
    let options = TABLE
        .get(name)
        .and_then(|entry| entry.get("options")?.as_array());
    let text = |option: &toml_edit::Value| option.as_str().expect("a text").to_owned();
    options.map_or(Vec::new(), |options| options.iter().map(text).collect())
}

#[test]
fn samples_hold_what_is_expected_of_them() {
    let path = folder().join(EXPECTED);
    let expected = std::fs::read_to_string(&path).expect("expectations");
    let entries = in_parallel(&samples(), |name| entry(name, &options(name)));
    let actual = settle(&expected, &readable(&entries.concat()));
    snapbox::Assert::new().action_env(DEFAULT_ACTION_ENV).eq(
        actual,
        Data::read_from(&path, Some(snapbox::data::DataFormat::Text)).raw(),
    );
}

/// Results of a job for each sample, in order.
pub fn in_parallel<T: Send>(samples: &[String], job: impl Fn(&str) -> T + Sync) -> Vec<T> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let part = &|names: &[String]| names.iter().map(|name| job(name)).collect::<Vec<T>>();
    std::thread::scope(|scope| {
        let parts = samples.chunks(samples.len().div_ceil(threads));
        let running: Vec<_> = parts
            .map(|names| scope.spawn(move || part(names)))
            .collect();
        running
            .into_iter()
            .flat_map(|thread| thread.join().expect("the job ends"))
            .collect()
    })
}

/// Content of a sample, as an entry of `expected.toml`.
fn entry(name: &str, options: &[String]) -> String {
    let mut text = format!("[{name:?}]\n");
    if !options.is_empty() {
        let _ = writeln!(text, "options = {options:?}");
    }
    let file = format!("recordings/{name}");
    let options: Vec<&str> = options.iter().map(String::as_str).collect();
    let Ran {
        code,
        stdout,
        stderr,
    } = Ran::of(&[&["inspect", &file, "--json"], &options[..]].concat());
    if code == 1 {
        let _ = writeln!(text, "refused = {}\n", quoted(&stderr));
        return text;
    }
    let report: Value = serde_json::from_str(&stdout).expect("one JSON document");
    let _ = writeln!(text, "dialect = {}", report["dialect"]);
    lines(
        &mut text,
        "details",
        list(&report["details"]),
        ("key", "value"),
    );
    lines(
        &mut text,
        "warnings",
        list(&report["warnings"]),
        ("code", "message"),
    );
    let segments = list(&report["segments"]);
    if !segments.is_empty() {
        let starts = segments
            .iter()
            .map(|segment| format!("[{}, {}]", segment["start_s"], segment["start_time"]));
        let starts: Vec<String> = starts
            .map(|start| start.replace("null", "\"unknown\""))
            .collect();
        let _ = writeln!(text, "segments = [{}]", starts.join(", "));
    }
    if report["data_lost"] == true {
        text.push_str("data_lost = true\n");
    }
    let _ = writeln!(text, "channels = [");
    for (index, channel) in list(&report["channels"]).iter().enumerate() {
        let number = (index + 1).to_string();
        let extract = ["extract", &file, "--channel", &number, "-q"];
        let ran = Ran::of(&[&extract, &options[..]].concat());
        let _ = writeln!(text, "  {{ {}{} }},", facts(channel), extracted(&ran));
    }
    text.push_str("]\n\n");
    text
}

/// An array of texts, one per line, if there are any.
fn lines(text: &mut String, name: &str, items: &[Value], (left, right): (&str, &str)) {
    if items.is_empty() {
        return;
    }
    let _ = writeln!(text, "{name} = [");
    for item in items {
        let part = |field: &str| item[field].as_str().expect("a text");
        let line = format!("{}: {}", part(left), part(right));
        let _ = writeln!(text, "  {},", quoted(&line));
    }
    text.push_str("]\n");
}

/// Facts about a channel reported by `inspect`.
fn facts(channel: &Value) -> String {
    let mut text = format!("name = {}", channel["name"]);
    for (key, field) in [
        ("unit", "unit"),
        ("samples", "samples"),
        ("rate_hz", "rate_hz"),
        ("rate_in_head_hz", "header_rate_hz"),
        ("start", "start"),
        ("start_time", "start_time"),
        ("segment", "segment"),
        ("assumed", "assumed"),
        ("stamps_rounded_to_s", "stamps_rounded_to_s"),
        ("gaps", "gaps"),
        ("holes", "non_finite"),
        ("mean", "mean"),
    ] {
        let value = &channel[field];
        if !value.is_null() && *value != 0 {
            let _ = write!(text, ", {key} = {value}");
        }
    }
    if !channel["unit"].is_null() && channel["unit_known"] == false {
        text.push_str(", unit_known = false");
    }
    text
}

/// Count and sum of the values output by `extract`, or why there are none.
fn extracted(ran: &Ran) -> String {
    if !matches!(ran.code, 0 | 3) {
        return format!(", extract = {}", quoted(&ran.stderr));
    }
    let values: Vec<f64> = ran
        .stdout
        .lines()
        .skip(1)
        .map(|line| {
            line.rsplit(',')
                .next()
                .expect("cells")
                .parse()
                .expect("a number")
        })
        .collect();
    format!(
        ", extracted = {}, sum = {:?}",
        values.len(),
        values.iter().sum::<f64>()
    )
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

/// A quoted TOML text.
fn quoted(text: &str) -> String {
    Value::from(text.trim()).to_string()
}
