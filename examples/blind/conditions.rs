//! Right answers by the conditions of a record, wrong answers, and times.

use std::fmt::Write as _;

use crate::blind::wide::NATURAL_HZ;
use crate::case::{Answer, Case};
use crate::report::count;

/// Default number of samples of a record.
const SAMPLES: f64 = 32_000.0;

/// The row of a case.
type Row = fn(&Case) -> String;

/// Condition with a table row for each value.
const CONDITIONS: [(&str, Row); 6] = [
    ("natural frequency", natural),
    ("damping ratio", damping),
    ("input", input),
    ("noise on the applied torque", applied_noise),
    ("filter in front of the recorder", filter),
    ("periods", periods),
];

fn number(case: &Case, section: &str, key: &str) -> Option<f64> {
    case.truth[section][key].as_f64()
}

fn natural_hz(case: &Case) -> f64 {
    number(case, "true_constants", "natural_frequency_hz").unwrap_or(f64::NAN)
}

fn natural(case: &Case) -> String {
    let apart = |hz: &f64| (natural_hz(case) / hz).ln().abs();
    let nearest = NATURAL_HZ
        .into_iter()
        .min_by(|a, b| apart(a).total_cmp(&apart(b)));
    nearest.map_or_else(String::new, |hz| format!("about {hz:6} Hz"))
}

fn damping(case: &Case) -> String {
    let ratio = number(case, "true_constants", "damping_ratio").unwrap_or(f64::NAN);
    within(ratio, 0.01, 0.05)
}

/// Range of a number, out of three; the texts sort in the order of the ranges.
fn within(value: f64, low: f64, high: f64) -> String {
    match value {
        _ if value < low => format!("1: below {low}"),
        _ if value <= high => format!("2: {low} to {high}"),
        _ => format!("3: above {high}"),
    }
}

/// The training input, or both inputs if that of the hold-out record differs.
fn input(case: &Case) -> String {
    let kind = |record: &str| {
        let described = case.truth["records"][record].as_str().unwrap_or_default();
        let kinds = ["multisine", "sweep", "random", "steps", "hits"];
        kinds
            .into_iter()
            .find(|kind| described.contains(kind))
            .unwrap_or("?")
    };
    match (kind("train"), kind("holdout")) {
        (one, other) if one == other => one.to_owned(),
        (one, other) => format!("{one}, then {other}"),
    }
}

fn applied_noise(case: &Case) -> String {
    yes(!case.truth["wide"]["applied_noise"].is_null())
}

fn filter(case: &Case) -> String {
    yes(!case.truth["wide"]["filter"].is_null())
}

fn yes(yes: bool) -> String {
    if yes { "yes" } else { "no" }.to_owned()
}

fn periods(case: &Case) -> String {
    let rate_hz = number(case, "records", "rate_hz").unwrap_or(f64::NAN);
    let samples = number(case, "wide", "samples").unwrap_or(SAMPLES);
    within(samples / rate_hz * natural_hz(case), 100.0, 1000.0)
}

/// Right answers by each condition.
pub fn table(text: &mut String, answers: &[Answer]) {
    text.push_str("\n## By condition\n\n| condition | | right |\n|---|---|---|\n");
    for (name, value) in CONDITIONS {
        let mut values: Vec<String> = answers.iter().map(|a| value(&a.case)).collect();
        values.sort_unstable();
        values.dedup();
        for one in values {
            let of = answers.iter().filter(|a| value(&a.case) == one);
            let _ = writeln!(text, "| {name} | {one} | {} |", count(of, Answer::is_right));
        }
    }
}

/// Every wrong answer on one line.
pub fn wrong(text: &mut String, answers: &[Answer]) {
    text.push_str(
        "\n## Wrong answers\n\n\
         | folder | truth | strength: train, held out | answer | verdict | after over noise | s |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for answer in answers.iter().filter(|answer| !answer.is_right()) {
        let case = &answer.case;
        let [train, holdout] = case.strength();
        let _ = writeln!(
            text,
            "| {} | {}: {} | {train:.2}, {holdout:.2} | {} | {} | {:.3} | {:.1} |",
            case.folder.display(),
            case.effect(),
            case.variant(),
            answer.effects().join(", "),
            answer.verdict(),
            answer.after_over_floor(),
            answer.seconds,
        );
    }
}
