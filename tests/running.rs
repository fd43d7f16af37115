//! `diagnose --running`: the stand in use, with a torque that nobody measures. The records are integrated here by the
//! Runge–Kutta method.

use std::f64::consts::TAU;

use serde_json::Value;

use crate::decays::{NOISE, PLAIN, Stand};
use crate::motion;
use crate::noise::Noise;
use crate::util::{Folder, codes, number};

const RATE_HZ: f64 = 200.0;
const STEPS: usize = 8;
const DURATION_S: f64 = 240.0;
/// Two orders of a steady speed.
const LINES_HZ: [f64; 2] = [13.7, 27.4];

/// A record of the gage while the stand is driven by noise of this size, held over a sample, and by `torque`.
fn record(stand: &Stand, noise_std: f64, torque: impl Fn(f64) -> f64) -> String {
    let omega = TAU * stand.natural_hz;
    let mut noise = Noise(99);
    let mut state = [0.0, 0.0];
    let h = 1.0 / (RATE_HZ * STEPS as f64);
    let mut text = String::from("time_s,gage_V\n");
    for i in 0..(DURATION_S * RATE_HZ) as usize {
        let seen = state[0] + 0.01 + NOISE * noise.normal();
        text += &format!("{:.4},{seen:.7}\n", i as f64 / RATE_HZ);
        let held = noise_std * noise.normal();
        let slope = |t: f64, [x, v]: [f64; 2]| {
            let pushed = torque(t) + held - x - stand.cubic * x.powi(3);
            let damped = 2.0 * stand.damping_ratio * omega * v;
            [v, omega * omega * pushed - damped]
        };
        for step in 0..STEPS {
            state = motion::step(state, (i * STEPS + step) as f64 * h, h, slope);
        }
    }
    text
}

fn steady(t: f64) -> f64 {
    let lines = LINES_HZ.iter().map(|hz| 0.05 * (TAU * hz * t).sin());
    lines.sum::<f64>() + 0.2
}

/// An order that rises from 2 to 50 Hz.
fn rising(t: f64) -> f64 {
    0.05 * (TAU * (2.0 + 24.0 * t / DURATION_S) * t).sin()
}

fn diagnosed(hits: &Stand, running: &str) -> (Folder, Value) {
    let folder = Folder::new();
    folder.write("first.csv", hits.hit(1.0, 1));
    folder.write("second.csv", hits.hit(0.6, 2));
    folder.write("run.csv", running);
    let report = folder.json(&[
        "diagnose",
        "--decay",
        "first.csv",
        "--holdout-decay",
        "second.csv",
        "--running",
        "run.csv",
        "--measured",
        "gage_V",
        "--html",
        "page.html",
        "--json",
    ]);
    (folder, report)
}

/// Deviations of natural frequency and damping ratio from the truth, in standard uncertainties.
fn deviations(report: &Value, truth: &Stand) -> [f64; 2] {
    let check = &report["running"][0];
    let both = [
        ("natural_frequency", truth.natural_hz),
        ("damping_ratio", truth.damping_ratio),
    ];
    both.map(|(name, truth)| {
        let [value, std] = ["value", "std"].map(|key| number(&check[name][key]));
        (value - truth) / std
    })
}

#[test]
fn the_stand_in_use_is_that_of_the_hits() {
    for running in [record(&PLAIN, 0.05, steady), record(&PLAIN, 0.0, rising)] {
        let (folder, report) = diagnosed(&PLAIN, &running);
        let off = deviations(&report, &PLAIN);
        assert!(off.iter().all(|off| off.abs() < 3.0), "{off:?}");
        let codes = codes(&report);
        assert!(!codes.contains(&"running-differs") && !codes.contains(&"resonance-hidden"));
        let said = "in use, the natural frequency is";
        assert!(folder.read("page.html").contains(said));
        assert!(report["running"][0]["hidden"].is_null());
    }
}

#[test]
fn another_stand_in_use_is_said() {
    let softer = Stand {
        natural_hz: 19.2,
        damping_ratio: 0.016,
        ..PLAIN
    };
    let (_, report) = diagnosed(&PLAIN, &record(&softer, 0.05, steady));
    let off = deviations(&report, &softer);
    assert!(off.iter().all(|off| off.abs() < 3.0), "{off:?}");
    assert!(
        codes(&report).contains(&"running-differs"),
        "{:?}",
        codes(&report)
    );
    // 20/19.2 and 0.01/0.016, each minus 1.
    let before = &report["running"][0]["before"];
    assert!((number(&before["natural_frequency"]) - 0.042).abs() < 0.003);
    assert!((number(&before["damping_ratio"]) + 0.375).abs() < 0.15);
    let lines = report["running"][0]["lines"].as_array().expect("lines");
    for wanted in LINES_HZ {
        let is_there = |line: &Value| (number(&line["frequency_hz"]) - wanted).abs() < 0.01;
        assert!(lines.iter().any(is_there), "{lines:?}");
    }
}

#[test]
fn lines_alone_show_no_resonance() {
    let (_, report) = diagnosed(&PLAIN, &record(&PLAIN, 0.0, steady));
    assert!(report["running"][0]["natural_frequency"].is_null());
    assert!(codes(&report).contains(&"resonance-hidden"));
}

#[test]
fn a_running_record_alone_is_no_diagnosis() {
    let folder = Folder::new();
    folder.write("run.csv", record(&PLAIN, 0.05, steady));
    let ran = folder.run(&["diagnose", "--running", "run.csv", "--measured", "gage_V"]);
    ran.says(2, &["--running", "only check", "--decay FILE"]);
}
