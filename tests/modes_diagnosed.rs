//! Diagnosis of stands with several modes, on records of a chain of three inertias, independent of the solver.

use std::f64::consts::TAU;
use std::fmt::Write;

use num_complex::Complex64;
use serde_json::Value;

use crate::modes::{COUNT, RATE_HZ, omega, row_under, stand};
use crate::noise::Noise;
use crate::util::{Folder, assert_close, column};

/// Noise on the record, in N m.
const NOISE_N_M: f64 = 0.01;

/// Time until which a constant torque holds the chain before its release: long enough to come to
/// rest.
const HELD_S: f64 = 0.3;

/// Tones every 22.5 Hz up to 900 Hz, with individual phases.
fn tones(seed: u64, size: f64) -> impl Fn(f64) -> f64 {
    let mut random = Noise(seed);
    let phases: Vec<f64> = (0..40).map(|_| TAU * random.uniform()).collect();
    move |time_s| {
        let tones = phases.iter().enumerate();
        let tone = |(k, phase): (usize, &f64)| (TAU * 22.5 * (k + 1) as f64 * time_s + phase).sin();
        size * tones.map(tone).sum::<f64>()
    }
}

/// A training and a held-out record of the chain with a torque at the gage, and its stand file with frequencies up to 2
/// % wrong. The load is on one of its inertias (1 to 3).
fn bench(load: usize, beside: impl Fn(f64, f64) -> f64) -> Folder {
    let folder = Folder::new();
    let mut text = stand(load);
    for (k, part) in [1.01, 0.985, 1.02].into_iter().enumerate() {
        let hz = omega(k) / TAU;
        text = text.replace(&format!("\"{hz} Hz\""), &format!("\"{} Hz\"", part * hz));
    }
    folder.write("stand.toml", text);
    for (name, seed, size) in [("train.csv", 11, 0.2), ("holdout.csv", 12, 0.12)] {
        let applied = tones(seed, size);
        let mut noise = Noise(seed + 100);
        let mut text = String::from("time_s,applied_n_m,measured_n_m\n");
        for (i, y) in row_under(&applied, (8, load), &beside).iter().enumerate() {
            let time_s = i as f64 / RATE_HZ;
            let y = y + NOISE_N_M * noise.normal();
            let _ = writeln!(text, "{time_s:.6},{:.9},{y:.9}", applied(time_s));
        }
        folder.write(name, text);
    }
    folder
}

const DIAGNOSE: [&str; 14] = [
    "diagnose",
    "--stand",
    "stand.toml",
    "--train",
    "train.csv",
    "--holdout",
    "holdout.csv",
    "--applied",
    "applied_n_m",
    "--measured",
    "measured_n_m",
    "-o",
    "refined.toml",
    "--json",
];

/// The number of a constant of a mode with the effects.
fn constant(report: &Value, mode: usize, name: &str) -> [f64; 2] {
    let constants = report["constants"].as_array().unwrap();
    let is_it = |c: &&Value| c["mode"] == mode && c["name"] == name;
    let found = constants.iter().find(is_it).unwrap();
    ["after", "after_std"].map(|key| found[key].as_f64().unwrap())
}

/// Checks the frequencies of all modes and the hold-out error. The integration error may equal the uncertainty due to
/// noise.
fn check_stand(report: &Value) {
    for k in 0..3 {
        let [hz, std] = constant(report, k + 1, "natural_frequency");
        let off = (hz - omega(k) / TAU).abs();
        let is_right = off < 4.0 * std + 3e-5 * hz && std < 2e-4 * hz;
        assert!(is_right, "mode {}: {hz} ± {std}", k + 1);
    }
    let after = report["error"]["after"]["holdout_rms"].as_f64().unwrap();
    assert!(after < 1.1 * NOISE_N_M, "{after}");
}

fn print_errors(report: &Value) {
    let [before, after] =
        ["before", "after"].map(|key| report["error"][key]["holdout_rms"].as_f64());
    let [before, after] = [before, after].map(|rms| rms.unwrap() / NOISE_N_M);
    println!("before {before:.1}, after {after:.3} times the noise");
}

#[test]
fn nothing_is_missing_beside_three_modes() {
    for load in [1, 3] {
        let folder = bench(load, |_, _| 0.0);
        let report = folder.json(&DIAGNOSE);
        assert_eq!(report["verdict"], "nothing-missing", "{report}");
        check_stand(&report);
    }
}

/// A hardening spring at the gage. The refined stand responds to an unseen torque.
#[test]
fn a_spring_that_stiffens_beside_three_modes() {
    for load in [1, 3] {
        let folder = bench(load, |x, _| 0.004 * x.powi(3));
        let report = folder.json(&DIAGNOSE);
        assert_eq!(report["verdict"], "explained", "{report}");
        assert_eq!(report["effects"], serde_json::json!(["cubic-stiffness"]));
        check_stand(&report);
        let candidates = report["candidates"].as_array().unwrap();
        let mut accepted = candidates.iter().filter(|c| c["status"] == "accepted");
        let found = &accepted.next().unwrap()["parameters"][0];
        let [value, std] = ["value", "std"].map(|key| found[key].as_f64().unwrap());
        assert!((value - 0.004).abs() < 8e-6 && std < 4e-6, "{found}");
        print_errors(&report);
        println!("coefficient {value:.6} ± {std:.6}, true 0.004");

        let args = [
            "simulate",
            "holdout.csv",
            "--stand",
            "refined.toml",
            "--applied",
            "applied_n_m",
            "-o",
            "answer.csv",
            "--force",
        ];
        folder.run(&args).says(0, &[]);
        let answer = column(&folder.read("answer.csv"), "measured");
        let record = column(&folder.read("holdout.csv"), "measured_n_m");
        let both = answer.iter().zip(&record).take(COUNT - 100);
        let left = both.map(|(a, b)| (a - b).powi(2)).sum::<f64>() / (COUNT - 100) as f64;
        assert!(left.sqrt() < 1.1 * NOISE_N_M, "{}", left.sqrt());
    }
}

#[test]
fn dry_friction_beside_three_modes() {
    let folder = bench(1, |_, speed| 0.05 * (speed / 20.0).tanh());
    let report = folder.json(&DIAGNOSE);
    assert_eq!(report["verdict"], "explained", "{report}");
    assert_eq!(report["effects"], serde_json::json!(["coulomb-friction"]));
    check_stand(&report);
    print_errors(&report);
}

/// Residues of mixed signs do not determine how far a torque at the gage moves it: untested effects are reported, those
/// after the stand are found.
#[test]
fn without_shapes_only_the_chain_is_looked_at() {
    let folder = bench(3, |_, _| 0.0);
    let shapes: Vec<[f64; 2]> = folder
        .read("stand.toml")
        .split("[[modes]]")
        .skip(1)
        .map(|mode| ["shape_at_load = ", "shape_at_gage = "].map(|key| number(mode, key)))
        .collect();
    let squares: Vec<f64> = (0..3).map(|k| omega(k).powi(2)).collect();
    let parts: Vec<f64> = shapes
        .iter()
        .zip(&squares)
        .map(|([a, b], w)| a * b / w)
        .collect();
    let sum: f64 = parts.iter().sum();
    let mut text = String::from("schema = \"torqcomp.stand/1\"\n");
    for (k, part) in parts.iter().enumerate() {
        let _ = write!(
            text,
            "[[modes]]\nnatural_frequency = \"{} Hz\"\ndamping_ratio = 0.02\nresidue = {}\n",
            omega(k) / TAU,
            part / sum
        );
    }
    folder.write("stand.toml", text);
    let report = folder.json(&DIAGNOSE);
    let warnings = report["warnings"].as_array().unwrap();
    let said = warnings.iter().find(|w| w["code"] == "no-torques-tried");
    let message = said.unwrap()["message"].as_str().unwrap();
    assert!(message.contains("shape_at_load"), "{message}");
    let candidates = report["candidates"].as_array().unwrap();
    let tried = |name: &str| candidates.iter().any(|c| c["effect"] == name);
    assert!(
        tried("time-delay") && !tried("coulomb-friction"),
        "{report}"
    );
    assert_eq!(report["verdict"], "nothing-missing", "{report}");
    check_stand(&report);
}

/// Free decay of all three modes after release: frequencies up to 2 % wrong are found. The effect of a nonlinear spring
/// on modes with unknown initial states is not searched for, and not called noise.
#[test]
fn free_ringing_of_three_modes() {
    for (cubic, verdict) in [(0.0, "nothing-missing"), (0.004, "unexplained")] {
        let folder = bench(1, |_, _| 0.0);
        for (k, size) in [3.0, 1.5, 2.2].into_iter().enumerate() {
            let mut noise = Noise(31 + k as u64);
            // Held by a constant torque until the record begins.
            let held = |time_s: f64| if time_s < HELD_S { size } else { 0.0 };
            let shown = row_under(held, (8, 3), |x, _| cubic * x.powi(3));
            let from = (HELD_S * RATE_HZ) as usize - 100;
            let mut text = String::from("time_s,measured_n_m\n");
            for (i, y) in shown[from..].iter().enumerate() {
                let time_s = i as f64 / RATE_HZ;
                let _ = writeln!(text, "{time_s:.6},{:.9}", y + 0.005 * noise.normal());
            }
            folder.write(&format!("{k}.csv"), text);
        }
        let args = [
            "diagnose",
            "--stand",
            "stand.toml",
            "--decay",
            "0.csv",
            "--decay",
            "1.csv",
            "--holdout-decay",
            "2.csv",
            "--measured",
            "measured_n_m",
            "--json",
        ];
        let report = folder.json(&args);
        assert_eq!(report["verdict"], verdict, "{report}");
        let warnings = report["warnings"].to_string();
        assert!(warnings.contains("no-torques-tried"), "{warnings}");
        if cubic == 0.0 {
            let [hz, std] = constant(&report, 1, "natural_frequency");
            assert!(
                (hz - omega(0) / TAU).abs() < 4.0 * std && std < 0.01,
                "{hz} ± {std}"
            );
            let [hz, std] = constant(&report, 2, "natural_frequency");
            assert!(
                (hz - omega(1) / TAU).abs() < 4.0 * std && std < 1.0,
                "{hz} ± {std}"
            );
        }
    }
}

/// The acceleration of one mode under tones, by its frequency response: the frequency that was 2 % wrong is found, and
/// the refined file gives the recorded quantity.
#[test]
fn an_acceleration_is_diagnosed_as_one() {
    let folder = Folder::new();
    let (hz, ratio, gain) = (400.0, 0.02, 2e-6);
    let stand = "schema = \"torqcomp.stand/1\"\n[mechanics]\nmeasures = \"acceleration\"\nnatural_frequency = \"408 Hz\"\n\
                 damping_ratio = 0.03\nstatic_gain = \"2.1e-6 (m/s^2)/N\"\n";
    folder.write("stand.toml", stand);
    for (name, seed) in [("train.csv", 21), ("holdout.csv", 22)] {
        let mut random = Noise(seed);
        let phases: Vec<f64> = (0..60).map(|_| TAU * random.uniform()).collect();
        let mut text = String::from("time_s,applied_N,measured_m/s^2\n");
        for i in 0..COUNT {
            let time_s = i as f64 / RATE_HZ;
            let tones = phases.iter().enumerate().map(|(k, phase)| {
                let omega = TAU * 15.0 * (k + 1) as f64;
                let w = omega / (TAU * hz);
                let response = -gain * omega * omega / Complex64::new(1.0 - w * w, 2.0 * ratio * w);
                let tone = Complex64::cis(omega * time_s + phase);
                [tone.im, (response * tone).im]
            });
            let [force, y] = tones.fold([0.0; 2], |sum, tone| [sum[0] + tone[0], sum[1] + tone[1]]);
            let _ = writeln!(
                text,
                "{time_s:.6},{force:.9},{:.9}",
                y + 0.5 * random.normal()
            );
        }
        folder.write(name, text);
    }
    let args = DIAGNOSE.map(|arg| match arg {
        "applied_n_m" => "applied_N",
        "measured_n_m" => "measured_m/s^2",
        arg => arg,
    });
    let report = folder.json(&args);
    assert_eq!(report["verdict"], "nothing-missing", "{report}");
    let found = |k: usize| report["constants"][k]["after"].as_f64().unwrap();
    assert_close(found(0), hz, 1e-4);
    assert_close(found(1), ratio, 1e-3);
    assert_close(found(2), gain, 1e-3);
    let refined = folder.read("refined.toml");
    assert!(refined.contains("measures = \"acceleration\""), "{refined}");
    let warnings = report["warnings"].to_string();
    assert!(
        warnings.contains("they depend on the displacement"),
        "{warnings}"
    );
}

/// The number after a key in a mode's table.
fn number(table: &str, key: &str) -> f64 {
    let line = table.lines().find_map(|line| line.strip_prefix(key));
    line.unwrap().parse().unwrap()
}
