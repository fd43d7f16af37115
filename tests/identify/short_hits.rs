//! Uncertainties from one short hit of a few samples, against an independent fine-step simulation.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use crate::noise::Noise;
use crate::util::{Folder, codes};

const RATE_HZ: f64 = 5000.0;

/// A half-sine force, and the motion of a stand under it, by the classical Runge–Kutta method.
fn hit(hz: f64, ratio: f64, pulse_s: f64, at_s: f64) -> Vec<(f64, f64)> {
    const STEPS: usize = 10;
    let omega = TAU * hz;
    let force = |t: f64| match (t - at_s) / pulse_s {
        part if (0.0..1.0).contains(&part) => (PI * part).sin(),
        _ => 0.0,
    };
    let slope =
        |t: f64, [x, v]: [f64; 2]| [v, omega * omega * (force(t) - x) - 2.0 * ratio * omega * v];
    let h = 1.0 / RATE_HZ / STEPS as f64;
    let mut state = [0.0; 2];
    let mut rows = Vec::new();
    for row in 0..3000 {
        let start = f64::from(row) / RATE_HZ;
        rows.push((force(start), state[0]));
        for step in 0..STEPS {
            let t = start + step as f64 * h;
            let on = |by: f64, d: [f64; 2]| [state[0] + by * d[0], state[1] + by * d[1]];
            let a = slope(t, state);
            let b = slope(t + 0.5 * h, on(0.5 * h, a));
            let c = slope(t + 0.5 * h, on(0.5 * h, b));
            let d = slope(t + h, on(h, c));
            let sum = |i: usize| a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i];
            state = on(h / 6.0, [sum(0), sum(1)]);
        }
    }
    rows
}

#[test]
fn the_uncertainty_of_one_short_hit_covers_its_error() {
    let folder = Folder::new();
    let mut noise = Noise(11);
    let (mut held, mut stated, mut wide, mut warned) = (0, 0, 0, 0);
    for trial in 0..40 {
        let part = |step: f64| (f64::from(trial) * step).fract();
        let (hz, ratio) = (60.0 + 240.0 * part(0.618), 0.01 + 0.03 * part(0.755));
        let pulse_s = (3.0 + 17.0 * part(0.57)) / RATE_HZ;
        let size = 10.0_f64.powf(-5.0 + 2.0 * part(0.819));
        let rows = hit(hz, ratio, pulse_s, 0.05 + part(0.31) / RATE_HZ);
        let rows = rows.iter().enumerate().map(|(row, (force, x))| {
            let (force, x) = (force + size * noise.normal(), x + size * noise.normal());
            format!("{:.4},{force:.9e},{x:.9e}\n", row as f64 / RATE_HZ)
        });
        folder.write(
            "hit.csv",
            format!("time_s,force [N m],T [N m]\n{}", rows.collect::<String>()),
        );
        let verb = ["identify", "response", "hit.csv", "--modes", "1", "--json"];
        let report = folder.json(&[&verb[..], &["--applied", "force", "--measured", "T"]].concat());
        let warnings = report["warnings"].as_array().expect("warnings");
        warned += i32::from(warnings.iter().any(|w| w["code"] == "one-hit"));
        for (name, truth) in [("natural_frequency", hz), ("damping_ratio", ratio)] {
            let all = report["parameters"].as_array().expect("parameters");
            let found = all.iter().find(|p| p["name"] == name).expect(name);
            let number = |key: &str| found[key].as_f64().expect("a number");
            stated += 1;
            held += i32::from((number("value") - truth).abs() <= 1.96 * number("std"));
            wide += i32::from(number("std") > 0.05 * truth);
        }
    }
    assert!(
        5 * warned >= 2 * stated,
        "{warned} of {stated} fits are said to rest on the force"
    );
    assert!(10 * held >= 9 * stated, "{held} of {stated}");
    assert!(10 * wide <= stated, "{wide} of {stated} are of no use");
}

/// Noise of the force changes each hit as a whole, and with it the gain, but hardly the resonance: the uncertainties of
/// frequency and damping are neither smaller than their errors nor several times as large.
#[test]
fn the_noise_of_the_force_of_several_hits_counts_once() {
    let folder = Folder::new();
    let mut noise = Noise(12);
    let (hz, ratio, trials) = (120.0, 0.02, 20);
    let mut squares = [0.0; 2];
    for trial in 0..trials {
        let mut text = String::from("time_s,force [N m],T [N m]\n");
        for place in 0..5 {
            let at_s = 0.05 + (0.618 * f64::from(5 * trial + place)).fract() / RATE_HZ;
            for (row, (force, x)) in hit(hz, ratio, 12.0 / RATE_HZ, at_s).iter().enumerate() {
                let time_s = (3000 * place as usize + row) as f64 / RATE_HZ;
                let (force, x) = (force + 4e-3 * noise.normal(), x + 1e-4 * noise.normal());
                let _ = writeln!(text, "{time_s:.4},{force:.9e},{x:.9e}");
            }
        }
        folder.write("hits.csv", text);
        let verb = ["identify", "response", "hits.csv", "--modes", "1", "--json"];
        let report = folder.json(&[&verb[..], &["--applied", "force", "--measured", "T"]].concat());
        let all = report["parameters"].as_array().expect("parameters");
        let truths = [("natural_frequency", hz), ("damping_ratio", ratio)];
        for ((name, truth), sum) in truths.iter().zip(&mut squares) {
            let found = all.iter().find(|p| p["name"] == *name).expect(name);
            let number = |key: &str| found[key].as_f64().expect("a number");
            *sum += ((number("value") - truth) / number("std")).powi(2);
        }
    }
    for sum in squares {
        let error = (sum / f64::from(trials)).sqrt();
        assert!(
            (0.55..1.5).contains(&error),
            "{error} standard uncertainties rms"
        );
    }
}

/// Report of four hits of unequal force on a stand of 100 Hz; `recorder` makes a sample of the motion, at most 1.
fn four_hits(seed: u64, recorder: impl Fn(f64) -> f64) -> serde_json::Value {
    let mut noise = Noise(seed);
    let rows = [1.0, 0.62, 0.85, 0.47].into_iter().flat_map(|size| {
        let rows = hit(100.0, 0.03, 0.003, 0.02).into_iter();
        rows.map(move |(force, x)| (size * force, size * x))
    });
    let rows: Vec<(f64, f64)> = rows.collect();
    let largest = rows.iter().fold(0.0, |m: f64, (_, x)| m.max(x.abs()));
    let mut text = String::from("time_s,force [N m],bridge [V]\n");
    for (row, (force, x)) in rows.iter().enumerate() {
        let seen = recorder(x / largest);
        let force = force + 1e-3 * noise.normal();
        let _ = writeln!(text, "{:.4},{force:.6},{seen:.9}", row as f64 / RATE_HZ);
    }
    let folder = Folder::new();
    folder.write("hits.csv", text);
    let verb = ["identify", "response", "hits.csv", "--json"];
    folder.json(&[&verb[..], &["--applied", "force", "--measured", "bridge"]].concat())
}

/// An amplifier that saturates softly had made the static gain up to 34 % too small without a warning.
#[test]
fn distortion_by_hits_is_said() {
    for seed in [1, 2] {
        for (part, is_said) in [(0.0, false), (0.5, true), (1.0, true), (2.0, true)] {
            let report = four_hits(seed, |x| match part {
                0.0 => x,
                part => (part * x).tanh() / part,
            });
            let found = codes(&report);
            assert_eq!(found.contains(&"overtone"), is_said, "{part}: {report}");
        }
    }
}

/// Steps of a converter had been taken for a limit.
#[test]
fn coarse_hits_are_used() {
    let report = four_hits(4, |x| (x * 40.0).round() / 40.0);
    let found = codes(&report);
    assert!(!found.contains(&"hit-left-out"), "{report}");
    assert!(found.contains(&"coarse-quantisation"), "{report}");
    let (value, std, _) = super::parameter(&report, "static_gain");
    // The largest motion is 1.05199 of the static one.
    assert!(
        (value - 1.0 / 1.05199).abs() < 3.0 * std.expect("a std"),
        "{report}"
    );
}

/// A record that begins with a hit, or within one, shows neither the level at rest nor all of the force.
#[test]
fn a_hit_without_a_pretrigger_is_refused() {
    let folder = Folder::new();
    let rows = hit(180.0, 0.02, 4e-3, 0.02);
    for (first, code) in [(101, 1), (100, 1), (80, 0)] {
        let mut noise = Noise(3);
        let rows = rows[first..].iter().enumerate().map(|(row, (force, x))| {
            let (force, x) = (force + 1e-4 * noise.normal(), x + 1e-4 * noise.normal());
            format!("{:.4},{force:.7},{x:.7}\n", row as f64 / RATE_HZ)
        });
        let rows: String = rows.collect();
        folder.write("hit.csv", format!("time_s,force [N m],T [N m]\n{rows}"));
        let verb = ["identify", "response", "hit.csv", "--modes", "1"];
        let channels = ["--applied", "force", "--measured", "T"];
        let ran = folder.run(&[&verb[..], &channels].concat());
        assert_eq!(ran.code, code, "{first}: {}", ran.stderr);
        let is_named = ran
            .stderr
            .contains("record from a few ms before the hit (pretrigger)");
        assert_eq!(is_named, code == 1, "{first}: {}", ran.stderr);
    }
}
