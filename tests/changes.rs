//! A stand that changes within a record: `diagnose` reports when and what, and names no effect.

use std::f64::consts::TAU;

use serde_json::Value;

use crate::noise::Noise;
use crate::one_mode::{DAMPING_RATIO, NATURAL_HZ, RATE_HZ, SAMPLES, record};
use crate::util::{Folder, number};

const MOMENT_S: f64 = 2.9;

/// Diagnosis of a record with a torque, with another part of the same record held out.
fn diagnosed(law: impl Fn(f64, f64, f64) -> f64) -> (Value, f64) {
    let (train, noise_rms) = record(law, (0.12, 50.0), &mut Noise(11));
    let folder = Folder::new();
    folder.write("train.csv", train);
    let channels = ["--applied", "applied_n_m", "--measured", "measured_n_m"];
    let command = ["diagnose", "--json", "--train", "train.csv"];
    (folder.json(&[&command[..], &channels].concat()), noise_rms)
}

/// A spring that loses 4 % of its stiffness: the natural frequency falls by `1 − √0.96`, the static gain grows by `1/0.96`.
#[test]
fn a_joint_that_comes_loose() {
    let loose = |t: f64, x: f64, _: f64| if t > MOMENT_S { -0.04 * x } else { 0.0 };
    let (report, noise_rms) = diagnosed(loose);
    let change = &report["changed_stand"];
    assert_eq!(report["verdict"], "unexplained", "{change}");
    assert_eq!(change["record"], "train.csv");
    assert!(
        (number(&change["time_s"]) - MOMENT_S).abs() < 6.0 / RATE_HZ,
        "{change}"
    );
    let root = 0.96_f64.sqrt();
    let expected = [
        ("natural_frequency", NATURAL_HZ, NATURAL_HZ * root),
        ("damping_ratio", DAMPING_RATIO, DAMPING_RATIO / root),
        ("static_gain", 1.0, 1.0 / 0.96),
    ];
    for (constant, (name, before, after)) in
        change["constants"].as_array().unwrap().iter().zip(expected)
    {
        assert_eq!(constant["name"], name);
        for (side, truth) in [("before", before), ("after", after)] {
            let (value, std) = (
                number(&constant[side]),
                number(&constant[format!("{side}_std")]),
            );
            assert!(
                (value - truth).abs() < 4.0 * std.max(1e-4 * truth),
                "{name} {side}: {value} ± {std}, {truth}"
            );
        }
    }
    let left = number(&change["two_stands_rms"]);
    assert!(
        left < 1.2 * noise_rms && number(&change["one_stand_rms"]) > 10.0 * noise_rms,
        "{change}"
    );
}

/// The same beside a spring that stiffens, which the stand file declares: a change of a stand with that spring.
#[test]
fn a_joint_comes_loose_beside_a_declared_effect() {
    let loose = |t: f64, x: f64| if t > MOMENT_S { -0.02 * x } else { 0.0 };
    let (train, noise_rms) = record(
        |t, x, _| loose(t, x) + 0.03 * x.powi(3),
        (0.12, 50.0),
        &mut Noise(12),
    );
    let folder = Folder::new();
    folder.write("train.csv", train);
    folder.write(
        "stand.toml",
        "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"20 Hz\"\ndamping_ratio = 0.05\n\
         [[effects]]\nkind = \"cubic-stiffness\"\nform = \"beside\"\ncoefficient = \"0.029 1/(N m)^2\"\n",
    );
    let args = "diagnose --json --stand stand.toml --train train.csv --applied applied_n_m --measured measured_n_m";
    let report = folder.json(&args.split_whitespace().collect::<Vec<_>>());
    let change = &report["changed_stand"];
    assert!(
        (number(&change["time_s"]) - MOMENT_S).abs() < 10.0 / RATE_HZ,
        "{change}"
    );
    let [before, after] = ["before", "after"].map(|side| number(&change["constants"][0][side]));
    let fallen = after / before;
    assert!((fallen - 0.98_f64.sqrt()).abs() < 5e-4, "{change}");
    assert!(
        number(&change["two_stands_rms"]) < 1.2 * noise_rms,
        "{change}"
    );
}

/// Linearly growing damping, and a wavy spring: no moment is named.
#[test]
fn what_does_not_happen_at_a_moment() {
    let length_s = SAMPLES as f64 / RATE_HZ;
    let (report, _) = diagnosed(|t, _, v| 0.06 * t / length_s * v);
    assert_eq!(report["verdict"], "unexplained");
    assert!(
        report["changed_stand"].is_null(),
        "{}",
        report["changed_stand"]
    );
    let (report, _) = diagnosed(|_, x, _| 0.06 * (2.5 * x).sin());
    assert_eq!(report["verdict"], "unexplained");
    assert!(
        report["changed_stand"].is_null(),
        "{}",
        report["changed_stand"]
    );
}

/// A spring whose stiffness swings slowly by 1 %, held out at a smaller level: what is left is not periodic, follows
/// nothing sample by sample, and is larger at the larger level, which coloured noise is not.
#[test]
fn a_stiffness_that_swings_slowly_is_no_coloured_noise() {
    let length_s = SAMPLES as f64 / RATE_HZ;
    for seed in [21, 22] {
        let swings = |t: f64, x: f64, _: f64| 0.01 * (TAU * t / (1.7 * length_s) + 0.4).sin() * x;
        let mut noise = Noise(seed);
        let folder = Folder::new();
        folder.write("train.csv", record(swings, (0.12, 50.0), &mut noise).0);
        folder.write("holdout.csv", record(swings, (0.05, 50.0), &mut noise).0);
        let records = ["--train", "train.csv", "--holdout", "holdout.csv"];
        let channels = ["--applied", "applied_n_m", "--measured", "measured_n_m"];
        let report = folder.json(&[&["diagnose", "--json"], &records[..], &channels].concat());
        let described = &report["residual"]["described"];
        println!("{described}");
        assert_eq!(report["verdict"], "unexplained", "{described}");
    }
}

/// An unbalanced rotor that speeds up shakes the stand: nothing of it repeats with the input, so that it would pass for
/// noise, and no effect of the list is its cause.
#[test]
fn an_order_of_a_changing_speed_is_said() {
    let length_s = SAMPLES as f64 / RATE_HZ;
    let turns = |t: f64| NATURAL_HZ * (1.3 + t / length_s) * t;
    let (report, _) = diagnosed(|t, _, _| 0.06 * (TAU * turns(t)).sin());
    let line = &report["residual"]["tests"]["moving_line"];
    assert_eq!(report["verdict"], "unexplained", "{line}");
    let off = |key: &str, expected: f64| (number(&line[key]) / NATURAL_HZ - expected).abs();
    // The last 30 % of the record are held out.
    assert!(
        off("from_hz", 2.7) < 0.2 && off("to_hz", 3.3) < 0.2,
        "{line}"
    );
    let next = &report["next_experiment"];
    assert_eq!(
        next,
        "the same record at a constant speed, or with the motor off"
    );
}
