//! Every sample recording through every command that reads: all of them select the same channel, with the same name,
//! unit, number of samples, rate and start, and give the same warnings.
//!
//! `tests/recordings/disagreements.txt` lists the exceptions, one sample per line. The file is compared as a whole, so
//! that neither a new difference nor a resolved one goes unnoticed;
//! `SNAPSHOTS=overwrite cargo test --test tests agreement` rewrites it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;
use snapbox::Data;
use snapbox::assert::DEFAULT_ACTION_ENV;

use crate::golden::settle::{readable, settle};
use crate::golden::{Ran, workplace};
use crate::recordings::{in_parallel, options, samples};

/// MCAP files with their signal: topic and field.
const MCAP: [(&str, &str, &str); 5] = [
    ("made/json.mcap", "/stand", "bridge.volts"),
    ("made/protobuf.mcap", "/stand", "bridge.volts"),
    ("made/ros2.mcap", "/joint_states", "effort[0]"),
    ("made/cut.mcap", "/joint_states", "effort[0]"),
    ("made/damaged.mcap", "/joint_states", "effort[0]"),
];

/// Prefixes of warning codes about reading. The others are about the signal or the command's own work.
const READING: [&str; 16] = [
    "extra-cells",
    "lines-skipped",
    "mcap-",
    "no-time-axis",
    "rate-contradicts-stamps",
    "rate-overrides-stamps",
    "sample-count",
    "samples-missing",
    "screen-steps",
    "time-assumed",
    "time-falls",
    "time-left-out",
    "truncated-last-line",
    "unended-last-line",
    "unreadable-characters",
    "zero-bytes",
];

/// Reasons for rejecting a recording, and parts of the corresponding messages.
const REASONS: [(&str, &[&str]); 5] = [
    ("option", &["unexpected argument"]),
    (
        "uneven",
        &[
            "not uniform",
            "time runs backwards",
            "repeats the one before",
            "usual step",
        ],
    ),
    (
        "rate",
        &[
            "the sampling rate is unknown",
            "the sampling rate of",
            "gives no unit",
            "allow any rate",
            "has no unit",
            "none is known to be the time",
        ],
    ),
    (
        "hole",
        &[
            "has no number there",
            "bridge it with --fill",
            "expected a number",
            "not a finite number",
            "the input exceeds its range",
        ],
    ),
    (
        "no recording",
        &[
            "no table of numbers",
            "not a table of numbers",
            "file is empty",
            "not a recording",
            "no column besides the time",
            "variables in turn",
            "block of its own",
            "there is no column",
            "there is no channel",
            "say which with",
        ],
    ),
];

/// Commands that reject a good recording because of its signal, with their own messages: too short, slow or
/// constant.
const CHOOSY: [&str; 4] = ["compensate", "harmonics", "identify", "diagnose"];

/// Facts that a command reports about its input, by name.
type Taken = BTreeMap<&'static str, String>;

#[test]
fn every_verb_takes_the_same_from_a_recording() {
    let names: Vec<String> = samples()
        .iter()
        .map(|name| format!("recordings/{name}"))
        .chain(MCAP.map(|(name, ..)| name.to_owned()))
        .collect();
    let actual = readable(&in_parallel(&names, differences).concat());
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recordings/disagreements.txt");
    let expected = fs::read_to_string(&path).unwrap_or_default();
    snapbox::Assert::new().action_env(DEFAULT_ACTION_ENV).eq(
        settle(&expected, &actual),
        Data::read_from(&path, Some(snapbox::data::DataFormat::Text)).raw(),
    );
}

/// The facts of a sample on which commands disagree, with the commands for each value.
fn differences(name: &str) -> String {
    let taken = every_verb(name);
    let mut text = String::new();
    for fact in [
        "refused", "name", "unit", "samples", "rate", "start", "warnings",
    ] {
        let mut said: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for (verb, taken) in &taken {
            if let Some(value) = taken.get(fact) {
                said.entry(value).or_default().push(verb);
            }
        }
        let differ = match fact {
            "refused" => refuse_differently(&taken),
            _ => said.len() > 1,
        };
        if differ {
            let said = said
                .iter()
                .map(|(value, verbs)| format!("{value}: {}", verbs.join(", ")));
            let _ = writeln!(text, "  {fact} {}", said.collect::<Vec<_>>().join("; "));
        }
    }
    if text.is_empty() {
        return text;
    }
    format!("{name}\n{text}")
}

/// What every command reads as the first channel of a sample.
fn every_verb(name: &str) -> Vec<(&'static str, Taken)> {
    let file = name.strip_prefix("recordings/").unwrap_or_default();
    let options = options(file);
    let inspected = verb("inspect", &[name, "--json"], &options);
    let report: Value = serde_json::from_str(&inspected.stdout).unwrap_or_default();
    let mut taken = vec![("inspect", inspect(&inspected, &report, name))];
    let signal = MCAP.iter().find(|(mcap, ..)| *mcap == name);
    let (path, select) = match signal {
        Some((_, topic, field)) => (
            format!("{topic}.{field}"),
            vec!["--topic", *topic, "--field", *field],
        ),
        None => ("1".to_owned(), vec!["--channel", "1"]),
    };
    let rate = report["channels"][0]["rate_hz"].as_f64().unwrap_or(1.0);
    let fundamental = format!("{}", rate / 16.0);
    let folder = workplace()
        .join("out/agreement")
        .join(name.replace('/', "-"));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder");
    let out = folder.join("out.csv");
    let out = out.to_str().expect("a name");
    let stand = ["--stand", "stands/bridge.toml"];
    let with_stand = |more: &[&'static str]| [&select[..], &stand, more].concat();

    let ran = verb("extract", &[&[name], &select[..]].concat(), &options);
    taken.push(("extract", extract(&ran)));
    let args = [
        &[name, "--band", &fundamental, "-o", out, "--json", "--force"],
        &with_stand(&[])[..],
    ]
    .concat();
    taken.push(("compensate", reported("compensate", &args, &options)));
    let args = [
        &[
            name,
            "--fundamental",
            &fundamental,
            "--orders",
            "1",
            "--json",
        ],
        &with_stand(&[])[..],
    ]
    .concat();
    taken.push(("harmonics", reported("harmonics", &args, &options)));
    let args = [
        name,
        "--applied",
        &path,
        "-o",
        out,
        "--json",
        "--force",
        stand[0],
        stand[1],
    ];
    taken.push(("simulate", reported("simulate", &args, &options)));
    let args = ["decay", name, "--channel", &path, "--json"];
    taken.push(("identify", reported("identify", &args, &options)));
    if let Some(measured) = second_channel(&report).filter(|_| signal.is_none()) {
        let args = [
            "--train",
            name,
            "--applied",
            "1",
            "--measured",
            &measured,
            "--json",
        ];
        taken.push(("diagnose", reported("diagnose", &args, &options)));
    }
    taken
}

/// Number of a channel that was recorded together with the first one and is numeric throughout.
fn second_channel(report: &Value) -> Option<String> {
    let channels = report["channels"].as_array()?;
    let first = channels.first()?;
    let is_like = |channel: &&Value| {
        ["segment", "samples", "rate_hz", "start"]
            .iter()
            .all(|key| channel[*key] == first[*key])
            && channel["non_finite"].as_u64() == Some(0)
    };
    let place = channels
        .iter()
        .skip(1)
        .position(|channel| is_like(&channel))?;
    Some((place + 2).to_string())
}

fn verb(verb: &str, args: &[&str], options: &[String]) -> Ran {
    let options: Vec<&str> = options.iter().map(String::as_str).collect();
    Ran::of(&[&[verb], args, &options[..]].concat())
}

fn inspect(ran: &Ran, report: &Value, name: &str) -> Taken {
    let mut taken = Taken::new();
    let signal = MCAP.iter().find(|(mcap, ..)| *mcap == name);
    let channels = report["channels"].as_array().map_or(&[][..], Vec::as_slice);
    let wanted = |channel: &&Value| {
        signal.is_none_or(|(_, topic, field)| {
            let field = field.trim_end_matches("[0]");
            channel["name"]
                .as_str()
                .is_some_and(|name| name.starts_with(topic) && name.contains(field))
        })
    };
    taken.insert("refused", refused(ran));
    let Some(channel) = channels.iter().find(wanted) else {
        return taken;
    };
    facts(
        &mut taken,
        channel,
        [("name", "name"), ("unit", "unit"), ("start", "start")],
    );
    numbers(&mut taken, channel);
    let codes = report["warnings"].as_array().into_iter().flatten();
    let codes = codes.filter_map(|warning| warning["code"].as_str());
    taken.insert("warnings", reading(codes));
    taken
}

/// From a table of time and value.
fn extract(ran: &Ran) -> Taken {
    let mut taken = Taken::new();
    taken.insert("refused", refused(ran));
    if !matches!(ran.code, 0 | 3) {
        return taken;
    }
    let mut lines = ran.stdout.lines();
    let heading = lines
        .next()
        .and_then(|head| head.split_once(','))
        .expect("two columns")
        .1;
    let (name, unit) = heading
        .trim_end_matches(']')
        .split_once(" [")
        .unwrap_or((heading, "null"));
    taken.insert("name", format!("{:?}", name.trim_matches('"')));
    taken.insert(
        "unit",
        if unit == "null" {
            unit.to_owned()
        } else {
            format!("{unit:?}")
        },
    );
    let first = lines
        .next()
        .and_then(|row| row.split(',').next())
        .and_then(|cell| cell.parse::<f64>().ok());
    if let Some(first) = first {
        taken.insert("start", format!("{first:e}"));
    }
    taken.insert("samples", (ran.stdout.lines().count() - 1).to_string());
    // "FILE: comma-separated, decimal point; 1000 Hz from the uniform stamps"
    let rate = ran
        .stderr
        .split("; ")
        .nth(1)
        .and_then(|rest| rest.split(" Hz").next()?.parse().ok());
    if let Some(rate) = rate {
        taken.insert("rate", rounded(rate));
    }
    taken.insert("warnings", reading(said(ran)));
    taken
}

/// From a command that reports its input as JSON; with a unit that the stand accepts, if it asks for one.
fn reported(of: &str, args: &[&str], options: &[String]) -> Taken {
    let mut ran = verb(of, args, options);
    let mut taken = Taken::new();
    let mut units = true;
    if ran.code != 0 && ran.stderr.contains("--unit") && !matches!(of, "identify" | "diagnose") {
        units = false;
        ran = verb(of, &[args, &["--unit", "N m"]].concat(), options);
    }
    let mut refused = refused(&ran);
    if refused == "yes" && CHOOSY.contains(&of) {
        refused = "no".to_owned();
    }
    taken.insert("refused", refused);
    if !matches!(ran.code, 0 | 3) {
        return taken;
    }
    let report: Value = serde_json::from_str(&ran.stdout).expect("one JSON document");
    facts(
        &mut taken,
        &report,
        [
            ("name", "channel"),
            ("name", "applied"),
            ("start", "start_s"),
        ],
    );
    if units {
        facts(
            &mut taken,
            &report,
            [("unit", "channel_unit"), ("unit", "applied_unit")],
        );
    }
    if said(&ran).any(|code| code == "unit-assumed") {
        taken.remove("unit");
    }
    numbers(&mut taken, &report);
    taken.insert("warnings", reading(said(&ran)));
    taken
}

fn facts<const N: usize>(taken: &mut Taken, report: &Value, fields: [(&'static str, &str); N]) {
    for (fact, field) in fields {
        if let Some(value) = report.get(field) {
            // Without stamps, time begins at 0.
            let value = match fact {
                "start" => format!("{:e}", value.as_f64().unwrap_or(0.0)),
                _ => value.to_string(),
            };
            taken.insert(fact, value);
        }
    }
}

fn numbers(taken: &mut Taken, report: &Value) {
    if let Some(samples) = report["samples"].as_u64() {
        taken.insert("samples", samples.to_string());
    }
    if let Some(rate) = report.get("rate_hz") {
        // Rates derived from the same stamps in two ways differ by rounding.
        taken.insert("rate", rate.as_f64().map_or("null".to_owned(), rounded));
    }
}

/// A rate to the digits printed by `extract`.
fn rounded(hz: f64) -> String {
    format!("{hz:.4e}")
}

/// Codes of warnings on standard error.
fn said(ran: &Ran) -> impl Iterator<Item = &str> {
    ran.stderr
        .lines()
        .filter_map(|line| line.split_once("warning [")?.1.split_once(']'))
        .map(|(code, _)| code)
}

/// The codes about reading, sorted.
fn reading<'a>(codes: impl Iterator<Item = &'a str>) -> String {
    let mut codes: Vec<&str> = codes
        .filter(|code| READING.iter().any(|begin| code.starts_with(begin)))
        .collect();
    codes.sort_unstable();
    codes.dedup();
    format!("[{}]", codes.join(" "))
}

/// Why a command rejects a recording.
fn refused(ran: &Ran) -> String {
    let says = |part: &&str| ran.stderr.contains(*part);
    if matches!(ran.code, 0 | 3) {
        return "no".to_owned();
    }
    let reason = REASONS.iter().find(|(_, parts)| parts.iter().any(says));
    reason.map_or("yes", |(reason, _)| reason).to_owned()
}

/// Whether commands differ in what they reject. `inspect` accepts any recording, and `extract` and `identify decay`
/// need no uniform steps.
fn refuse_differently(taken: &[(&'static str, Taken)]) -> bool {
    let mut reasons: Vec<&str> = taken
        .iter()
        .filter_map(|(verb, taken)| Some((*verb, taken.get("refused")?.as_str())))
        .filter(|(verb, reason)| {
            *reason != "no" || !["inspect", "extract", "identify"].contains(verb)
        })
        .map(|(_, reason)| reason)
        .collect();
    reasons.sort_unstable();
    reasons.dedup();
    reasons.len() > 1
        || (reasons == ["no recording"] && taken.iter().any(|(_, taken)| taken["refused"] == "no"))
}
