//! Torques of no listed law: `diagnose` plots them over displacement and speed, and names no law.

use std::f64::consts::TAU;

use serde_json::Value;

use crate::noise::Noise;
use crate::one_mode::{NATURAL_HZ, RATE_HZ, record};
use crate::util::{Folder, number};

/// A torque over displacement and over speed divided by `ω`, in N m, in addition to a spring of 1.
type Law = fn(f64, f64) -> f64;

/// Diagnosis of the two records in a folder.
fn report(folder: &Folder, more: &[&str]) -> Value {
    let records = ["--train", "train.csv", "--holdout", "holdout.csv"];
    let channels = ["--applied", "applied_n_m", "--measured", "measured_n_m"];
    folder.json(&[&["diagnose", "--json"], &records[..], &channels, more].concat())
}

/// Diagnosis of two records, and the noise of the held-out one.
fn diagnosed(law: Law, folder: &Folder, more: &[&str]) -> (Value, f64) {
    let mut noise = Noise(7);
    let (train, _) = record(|_, x, v| law(x, v), (0.12, 50.0), &mut noise);
    let (holdout, rms) = record(|_, x, v| law(x, v), (0.08, 50.0), &mut noise);
    folder
        .write("train.csv", train)
        .write("holdout.csv", holdout);
    (report(folder, more), rms)
}

/// Points of a curve: position, torque, standard uncertainty.
fn curve(report: &Value, name: &str) -> Vec<[f64; 3]> {
    let points = report["force_surface"][name].as_array().expect("points");
    let point = |p: &Value| ["at", "torque", "std"].map(|key| number(&p[key]));
    points.iter().map(point).collect()
}

/// Largest difference of a curve from a law up to a straight line, relative to its standard uncertainty or a minimum,
/// in the inner part of its range.
fn apart(points: &[[f64; 3]], inner: f64, least: f64, law: impl Fn(f64) -> f64) -> f64 {
    let largest = points.iter().map(|p| p[0].abs()).fold(0.0, f64::max);
    let inner: Vec<&[f64; 3]> = points
        .iter()
        .filter(|p| p[0].abs() < inner * largest)
        .collect();
    let count = inner.len() as f64;
    let left = |p: &[f64; 3]| p[1] - law(p[0]);
    let mean_x = inner.iter().map(|p| p[0]).sum::<f64>() / count;
    let mean_y = inner.iter().map(|p| left(p)).sum::<f64>() / count;
    let square: f64 = inner.iter().map(|p| (p[0] - mean_x).powi(2)).sum();
    let product: f64 = inner
        .iter()
        .map(|p| (p[0] - mean_x) * (left(p) - mean_y))
        .sum();
    let line = |x: f64| mean_y + product / square * (x - mean_x);
    let over = |p: &&[f64; 3]| (left(p) - line(p[0])).abs() / p[2].max(least);
    inner.iter().map(over).fold(0.0, f64::max)
}

fn wavy(x: f64, _: f64) -> f64 {
    0.06 * (2.5 * x).sin()
}

/// A spring with waves, as of a toothed coupling.
#[test]
fn a_wavy_spring_is_drawn_and_gets_no_name() {
    let folder = Folder::new();
    let (report, noise) = diagnosed(wavy, &folder, &["--html", "page.html"]);
    let surface = &report["force_surface"];
    println!("{} {} {surface}", report["verdict"], report["effects"]);
    assert_eq!(report["verdict"], "unexplained");
    assert_eq!(surface["place"], "stand");
    let (before, left) = (
        number(&report["error"]["before"]["holdout_rms"]),
        number(&surface["holdout_rms"]),
    );
    // Linear interpolation between the knots misses some of the waves.
    assert!(
        before > 30.0 * noise && left < 2.0 * noise,
        "{before} {left} {noise}"
    );
    let share = |part: &str| number(&surface["shares"][part]);
    let others = ["speed", "both", "history"].map(share);
    assert!(
        others
            .iter()
            .all(|other| 5.0 * other < share("displacement"))
    );
    let points = curve(&report, "over_displacement");
    let apart = apart(&points, 0.6, 0.002, |x| wavy(x, 0.0));
    assert!(apart < 4.0, "{apart} {points:?}");
    let page = folder.read("page.html");
    assert!(page.contains("The missing torque, without an assumed law"));
}

fn one_way(_: f64, v: f64) -> f64 {
    0.05 * v.max(0.0).powi(2)
}

/// A damper with a valve that closes in one direction.
#[test]
fn damping_in_one_direction_is_drawn() {
    let (report, noise) = diagnosed(one_way, &Folder::new(), &[]);
    let surface = &report["force_surface"];
    println!("{} {} {surface}", report["verdict"], report["effects"]);
    assert_ne!(report["verdict"], "explained");
    let left = number(&surface["holdout_rms"]);
    assert!(left < 1.1 * noise, "{left} {noise}");
    let words = surface["looks_like"].to_string();
    assert!(
        words.contains("differs between the two directions"),
        "{words}"
    );
    // The rate of change in N m/s.
    let points = curve(&report, "over_speed");
    let law = |rate: f64| one_way(0.0, rate / (TAU * NATURAL_HZ));
    let apart = apart(&points, 0.6, 0.002, law);
    assert!(apart < 4.0, "{apart} {points:?}");
}

/// A spot that rubs more the farther the stand is from it, beside a line: the spot is where it is, not on the other side.
#[test]
fn a_rubbing_spot_is_on_its_side() {
    let wedge: Law = |x, v| 0.03 * (x + 0.6).abs() * (4.0 * v).tanh();
    let folder = Folder::new();
    let _ = diagnosed(wedge, &folder, &[]);
    let line = |row: usize| 0.02 * (TAU * 33.3 * row as f64 / RATE_HZ).sin();
    for name in ["train.csv", "holdout.csv"] {
        let text = folder.read(name);
        let mut rows = text.lines();
        let head = rows.next().expect("a heading").to_owned();
        let with_line = rows.enumerate().map(|(row, text)| {
            let (before, seen) = text.rsplit_once(',').expect("a number");
            let seen: f64 = seen.parse().expect("a number");
            format!("{before},{:.9}", seen + line(row))
        });
        let all: Vec<String> = std::iter::once(head).chain(with_line).collect();
        folder.write(name, all.join("\n") + "\n");
    }
    let report = report(&folder, &[]);
    println!(
        "{} {} {}",
        report["verdict"], report["effects"], report["candidates"]
    );
    assert_eq!(report["verdict"], "explained");
    let candidates = report["candidates"].as_array().expect("a list").iter();
    let mut named = candidates.filter(|c| c["effect"] == "position-dependent-friction");
    let spot = named
        .find(|c| c["status"] == "accepted")
        .expect("it is named");
    let mut parameters = spot["parameters"].as_array().expect("a list").iter();
    let centre = parameters.find(|p| p["name"] == "centre");
    let centre = centre.expect("a centre");
    let off = number(&centre["value"]) + 0.6;
    assert!(off.abs() < 4.0 * number(&centre["std"]), "{centre}");
}

/// Position-dependent friction is neither dry friction nor nothing; if it grows with the displacement, it has a name.
#[test]
fn friction_that_depends_on_the_place_is_no_dry_friction() {
    let waves: Law = |x, v| 0.004 * (1.0 + 0.8 * (3.0 * x).sin()) * (20.0 * v).tanh();
    let (report, _) = diagnosed(waves, &Folder::new(), &[]);
    let (verdict, effects) = (&report["verdict"], &report["effects"]);
    println!("{verdict} {effects} {}", report["error"]);
    assert!(
        verdict == "unexplained" || verdict == "partly-explained",
        "{verdict} {effects}"
    );
    let wedge: Law = |x, v| 0.02 * x.abs() * (20.0 * v).tanh();
    let (report, _) = diagnosed(wedge, &Folder::new(), &[]);
    assert_eq!(report["verdict"], "explained");
    let named = serde_json::json!(["position-dependent-friction"]);
    assert_eq!(report["effects"], named);
    let parameters = &report["candidates"][0]["parameters"];
    let coefficient = (
        number(&parameters[0]["value"]),
        number(&parameters[0]["std"]),
    );
    let apart = (coefficient.0 - 0.02).abs();
    assert!(
        apart < 4.0 * coefficient.1 && apart < 0.002,
        "{coefficient:?}"
    );
}

/// If a law explains the records, there is nothing to plot.
#[test]
fn a_listed_law_needs_no_surface() {
    let (report, _) = diagnosed(|x, _| 0.05 * x.powi(3), &Folder::new(), &[]);
    assert_eq!(report["verdict"], "explained");
    assert_eq!(report["effects"], serde_json::json!(["cubic-stiffness"]));
    assert!(report["force_surface"].is_null());
}

/// The motion from a slow input follows it nearly proportionally, and a slow disturbance would follow the
/// measured motion in the same way.
#[test]
fn a_slow_disturbance_follows_from_no_motion() {
    let folder = Folder::new();
    let mut noise = Noise(11);
    for (name, level) in [("train.csv", 0.12), ("holdout.csv", 0.08)] {
        let (text, rms) = record(|_, _, _| 0.0, (level, 12.0), &mut noise);
        let (mut lines, mut disturbance) = (text.lines(), 0.0);
        let mut disturbed = format!("{}\n", lines.next().expect("a heading"));
        for line in lines {
            // A wandering zero with a correlation time of half a second.
            disturbance += -disturbance / (0.5 * RATE_HZ) + 0.3 * rms * noise.normal();
            let (rest, seen) = line.rsplit_once(',').expect("three columns");
            let seen: f64 = seen.parse().expect("a number");
            disturbed += &format!("{rest},{:.9}\n", seen + disturbance);
        }
        folder.write(name, disturbed);
    }
    let report = report(&folder, &[]);
    println!("{} {}", report["verdict"], report["effects"]);
    assert!(
        report["force_surface"].is_null(),
        "{}",
        report["force_surface"]
    );
}
