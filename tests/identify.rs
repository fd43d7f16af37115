//! `identify` through the binary, and its estimators on simulated records. The records are made here,
//! from closed forms or by small steps, with no code of the estimators.

use nalgebra::DMatrix;
use serde_json::Value;
use torqcomp::identify::{Found, Outcome, decay, response, runup};

use crate::util::{Folder, assert_close};

const TAU: f64 = std::f64::consts::TAU;

/// Normal noise, the same on every run.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        // xorshift64*, S. Vigna.
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        ((self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}

fn times(count: usize, rate_hz: f64) -> Vec<f64> {
    (0..count).map(|i| i as f64 / rate_hz).collect()
}

fn ring(times_s: &[f64], values: &[f64], rate_hz: f64) -> decay::Evaluated {
    let record = decay::Ringing {
        name: "simulated",
        times_s,
        rate_hz: Some(rate_hz),
        values,
    };
    decay::identify(&[record], &decay::Options::default()).unwrap()
}

fn of<'a>(outcome: &'a Outcome, name: &str) -> &'a Found {
    outcome
        .get(name)
        .unwrap_or_else(|| panic!("{name} in {:?}", outcome.found))
}

/// Share of true values within 1.96 standard uncertainties.
struct Coverage {
    inside: usize,
    all: usize,
}

impl Coverage {
    fn count(&mut self, found: &Found, truth: f64) {
        let std = found
            .std
            .unwrap_or_else(|| panic!("{} has no uncertainty", found.name));
        self.inside += usize::from((found.value - truth).abs() <= 1.96 * std);
        self.all += 1;
    }

    fn check(&self) {
        let share = self.inside as f64 / self.all as f64;
        assert!(
            (0.92..=0.98).contains(&share),
            "{} of {}: {share}",
            self.inside,
            self.all
        );
    }
}

/// The stand of figure 5: 1.7 ms a cycle, from 2 to 0.5 in 5.3 ms.
const OMEGA: f64 = TAU / 1.7e-3;

fn sigma() -> f64 {
    4.0_f64.ln() / 5.3e-3
}

/// A decay of that stand with an offset and noise so many decibels below its first amplitude.
fn figure_5(decibel: f64, noise: &mut Noise) -> (Vec<f64>, Vec<f64>, f64) {
    let rate_hz = 40_000.0;
    let t = times(1200, rate_hz);
    let size = 2.0 * 10_f64.powf(-decibel / 20.0);
    let y = t
        .iter()
        .map(|t| 2.0 * (-sigma() * t).exp() * (OMEGA * t).cos() + 0.1 + size * noise.normal())
        .collect();
    (t, y, rate_hz)
}

#[test]
fn intervals_of_decays_cover_the_truth() {
    let mut noise = Noise(11);
    let natural = OMEGA.hypot(sigma());
    let mut covered = Coverage { inside: 0, all: 0 };
    for k in 0..240 {
        let decibel = [60.0, 50.0, 40.0, 30.0, 20.0][k % 5];
        let (t, y, rate_hz) = figure_5(decibel, &mut noise);
        let found = ring(&t, &y, rate_hz);
        assert_eq!(found.fit.poles.len(), 1, "at {decibel} dB");
        covered.count(of(&found.outcome, "natural_frequency"), natural / TAU);
        covered.count(of(&found.outcome, "damping_ratio"), sigma() / natural);
    }
    covered.check();
}

/// Least standard deviations of frequency (Hz) and decay rate (1/s) that any unbiased estimator can have
/// (Cramér and Rao), from the sensitivities of 2e^{−σt}cos(ωt + φ) + c + dt to σ, ω, amplitude, φ, c, d.
fn least_std(t: &[f64], std: f64) -> (f64, f64) {
    let rows = DMatrix::from_fn(t.len(), 6, |i, j| {
        let fall = 2.0 * (-sigma() * t[i]).exp();
        let (sin, cos) = (OMEGA * t[i]).sin_cos();
        [
            -t[i] * fall * cos,
            -t[i] * fall * sin,
            fall * cos,
            -fall * sin,
            1.0,
            t[i] * 1e3,
        ][j]
    });
    let bound = rows.tr_mul(&rows).try_inverse().expect("regular") * std * std;
    (bound[(1, 1)].sqrt() / TAU, bound[(0, 0)].sqrt())
}

#[test]
fn decays_are_as_exact_as_the_noise_allows() {
    let mut noise = Noise(12);
    let natural = OMEGA.hypot(sigma());
    let (mut squares, mut rates) = (0.0, 0.0);
    let mut least = (0.0, 0.0);
    let runs = 120;
    for _ in 0..runs {
        let (t, y, rate_hz) = figure_5(40.0, &mut noise);
        let found = ring(&t, &y, rate_hz);
        let frequency = of(&found.outcome, "damped_frequency").value;
        assert_close(
            of(&found.outcome, "natural_frequency").value,
            natural / TAU,
            1e-3,
        );
        squares += (frequency - OMEGA / TAU).powi(2);
        rates += (of(&found.outcome, "decay_rate").value - sigma()).powi(2);
        let start = found.starts_s[0];
        let used: Vec<f64> = t
            .iter()
            .filter(|t| **t >= start)
            .map(|t| t - start)
            .collect();
        // What is left of the amplitude where the fit begins scales both alike.
        let fallen = (-sigma() * start).exp();
        least = least_std(&used, 2.0 * 0.01 / fallen);
    }
    let spread = (
        (squares / f64::from(runs)).sqrt(),
        (rates / f64::from(runs)).sqrt(),
    );
    // 120 runs tell a standard deviation to 6.5 %.
    assert!(
        spread.0 < 1.3 * least.0,
        "frequency: {} against {}",
        spread.0,
        least.0
    );
    assert!(
        spread.1 < 1.3 * least.1,
        "rate: {} against {}",
        spread.1,
        least.1
    );
    // 0.02 % of the frequency, 1 % of the damping ratio.
    assert!(
        spread.0 / (OMEGA / TAU) < 2e-4 * 5.0 && spread.1 / sigma() < 1e-2,
        "{spread:?}"
    );
}

#[test]
fn several_modes_and_hits_are_found() {
    let mut noise = Noise(13);
    let rate_hz = 20_000.0;
    let t = times(12_000, rate_hz);
    let hit = |t: f64, size: f64| {
        if t < 0.0 {
            return 0.0;
        }
        let one = (-80.0 * t).exp() * (TAU * 590.0 * t).sin();
        size * (one + 0.4 * (-120.0 * t).exp() * (TAU * 1480.0 * t).sin())
    };
    let y: Vec<f64> = t
        .iter()
        .map(|t| hit(t - 0.02, 1.0) + hit(t - 0.3, 0.7) + 0.01 * t + 1e-3 * noise.normal())
        .collect();
    let found = ring(&t, &y, rate_hz);
    assert_eq!((found.fit.poles.len(), found.stretches.len()), (2, 2));
    for (name, want, within) in [
        ("mode_1_damped_frequency", 590.0, 2e-4),
        ("mode_1_decay_rate", 80.0, 1e-2),
        ("mode_2_damped_frequency", 1480.0, 2e-4),
        ("mode_2_decay_rate", 120.0, 2e-2),
    ] {
        assert_close(of(&found.outcome, name).value, want, within);
    }
}

#[test]
fn the_law_of_damping_is_told() {
    let mut noise = Noise(14);
    let rate_hz = 10_000.0;
    let t = times(4000, rate_hz);
    let mut law = |envelope: &dyn Fn(f64) -> f64| {
        let y: Vec<f64> = t
            .iter()
            .map(|t| envelope(*t) * (TAU * 120.0 * t).cos() + 2e-3 * noise.normal())
            .collect();
        ring(&t, &y, rate_hz)
    };
    let dry = law(&|t| (1.0 - 3.0 * t).max(0.0));
    assert_eq!(dry.laws[0].law, decay::Law::Dry);
    assert!(dry.outcome.warnings.iter().any(|w| w.code == "not-viscous"));
    let drag = law(&|t| 1.0 / (1.0 + 20.0 * t));
    assert_eq!(drag.laws[0].law, decay::Law::Quadratic);
    let viscous = law(&|t| (-12.0 * t).exp());
    assert!(
        !viscous
            .outcome
            .warnings
            .iter()
            .any(|w| w.code == "not-viscous")
    );
    let both = law(&|t| ((1.0 + 0.1) * (-6.0 * t).exp() - 0.1).max(0.0));
    assert!(
        both.outcome
            .warnings
            .iter()
            .any(|w| w.code == "amplitude-dependent" || w.code == "not-viscous")
    );
}

/// A body with viscous and dry friction under a torque that changes sign, by small steps: angle and
/// torque at 1 kHz, noise on the torque.
fn run_of(decibel: f64, noise: &mut Noise) -> (Vec<f64>, Vec<f64>) {
    let (inertia, viscous, dry, offset) = TRUE_BODY;
    let torque = |t: f64| 3.0 * (TAU * 0.7 * t).sin() + 1.5 * (TAU * 1.9 * t).sin();
    let parts = 40;
    let step = 1e-3 / f64::from(parts);
    let size = 10_f64.powf(-decibel / 20.0) * (0.5_f64 * (9.0 + 2.25)).sqrt();
    let (mut angle, mut speed) = (0.0_f64, 0.05_f64);
    let (mut angles, mut torques) = (Vec::new(), Vec::new());
    for i in 0..4000 {
        angles.push(angle);
        torques.push(torque(f64::from(i) * 1e-3) + size * noise.normal());
        for k in 0..parts {
            let t = f64::from(i) * 1e-3 + (f64::from(k) + 0.5) * step;
            let rest = torque(t) - offset - viscous * speed;
            // Dry friction brakes, and holds a body at rest.
            let before = speed;
            if speed == 0.0 && rest.abs() <= dry {
                continue;
            }
            let way = if speed == 0.0 {
                rest.signum()
            } else {
                speed.signum()
            };
            speed += step * (rest - dry * way) / inertia;
            if before * speed < 0.0 {
                speed = 0.0;
            }
            angle += step * 0.5 * (before + speed);
        }
    }
    (angles, torques)
}

/// Inertia kg m², viscous N m s/rad, dry N m, offset N m.
const TRUE_BODY: (f64, f64, f64, f64) = (0.25, 0.4, 0.6, 0.15);

/// The intervals are somewhat narrow: 91 % of 480 hold the truth at 20 dB, 85 to 90 % at 40 and 60 dB,
/// where the stops, at which the equation does not hold, count for more than the noise. This keeps
/// them from getting worse.
#[test]
fn intervals_of_run_ups_cover_the_truth() {
    let mut noise = Noise(15);
    let mut covered = [60.0, 40.0, 20.0].map(|decibel| (decibel, Coverage { inside: 0, all: 0 }));
    for k in 0..300 {
        let (decibel, coverage) = &mut covered[if k < 240 { 2 } else { k % 2 }];
        let (angles, torques) = run_of(*decibel, &mut noise);
        let run = runup::Run {
            rate_hz: 1000.0,
            motion: &angles,
            kind: runup::Motion::Position,
            effort: &torques,
            body: runup::Body::Turning,
        };
        // A window of its own would be chosen for each; one for all keeps the runs alike.
        let options = runup::Options {
            half_window_s: Some(0.04),
            ..Default::default()
        };
        let found = runup::identify(&run, &options).unwrap();
        for (name, truth) in [("inertia", TRUE_BODY.0), ("viscous_friction", TRUE_BODY.1)] {
            coverage.count(of(&found, name), truth);
        }
        assert_close(of(&found, "inertia").value, TRUE_BODY.0, 0.05);
    }
    for (decibel, coverage) in &covered {
        println!("{decibel} dB: {} of {}", coverage.inside, coverage.all);
    }
    let share = covered[2].1.inside as f64 / covered[2].1.all as f64;
    assert!((0.90..=0.98).contains(&share), "{share}");
}

#[test]
fn a_run_in_one_direction_does_not_invent_a_dry_friction() {
    let speed: Vec<f64> = (0..2000)
        .map(|i| 50.0 * (1.0 - (-1e-3 * f64::from(i)).exp()))
        .collect();
    // 2 N m = J·50 e^{−t} + f·50(1 − e^{−t}) + C with J = f = 0.03, C = 0.5.
    let torque = vec![2.0; 2000];
    let run = runup::Run {
        rate_hz: 1000.0,
        motion: &speed,
        kind: runup::Motion::Speed,
        effort: &torque,
        body: runup::Body::Turning,
    };
    let found = runup::identify(&run, &runup::Options::default());
    // Constant torque and an exponential speed satisfy θ'' + θ' = 50 throughout: only J/f follows.
    match found {
        Ok(found) => {
            assert!(found.get("dry_friction").is_none(), "{:?}", found.found);
            assert!(found.warnings.iter().any(|w| w.code == "one-direction"));
            assert!(!found.correlated.is_empty(), "{found:?}");
        }
        Err(error) => assert!(
            error.to_string().contains("cannot be told apart"),
            "{error}"
        ),
    }
}

/// Response of a second-order stand to noise, by its exact step between samples held constant.
fn driven(rate_hz: f64, count: usize, noise: &mut Noise) -> (Vec<f64>, Vec<f64>) {
    let (omega, zeta) = (TAU * 60.0, 0.03);
    let parts = 20;
    let step = 1.0 / rate_hz / f64::from(parts);
    let (mut x, mut v) = (0.0_f64, 0.0_f64);
    let (mut force, mut before, mut smooth) = (0.0, 0.0, 0.0);
    let (mut applied, mut shown) = (Vec::new(), Vec::new());
    for _ in 0..count {
        // Noise with little left near half the rate, so that straight lines between samples are close.
        force = 0.7 * force + noise.normal();
        smooth = 0.7 * smooth + 0.3 * force;
        applied.push(before);
        shown.push(x);
        for k in 0..parts {
            let u = before + (smooth - before) * (f64::from(k) + 0.5) / f64::from(parts);
            let half = v + 0.5 * step * (omega * omega * (u - x) - 2.0 * zeta * omega * v);
            x += step * half;
            v = (half + 0.5 * step * omega * omega * (u - x)) / (1.0 + zeta * omega * step);
        }
        before = smooth;
    }
    (applied, shown)
}

#[test]
fn a_mode_is_found_from_noise() {
    let mut noise = Noise(16);
    let (applied, shown) = driven(1000.0, 60_000, &mut noise);
    let size = 0.01 * (shown.iter().map(|v| v * v).sum::<f64>() / shown.len() as f64).sqrt();
    let measured: Vec<f64> = shown.iter().map(|v| v + size * noise.normal()).collect();
    let record = response::Driven {
        name: "n",
        rate_hz: 1000.0,
        applied: &applied,
        measured: &measured,
    };
    let options = response::Options {
        band_hz: Some((20.0, 150.0)),
        ..Default::default()
    };
    let found = response::identify(&[record], &options).unwrap();
    let outcome = &found.outcome;
    let first = found
        .modal
        .poles
        .iter()
        .find(|p| (p.omega_rad_per_s / TAU - 60.0).abs() < 0.3);
    let pole = first.unwrap_or_else(|| panic!("{:?}", outcome.found));
    assert_close(pole.rate_per_s, 0.03 * TAU * 60.0, 0.05);
}

fn decay_file(folder: &Folder) {
    let mut noise = Noise(17);
    let (t, y, _) = figure_5(60.0, &mut noise);
    let rows: String = t
        .iter()
        .zip(&y)
        .map(|(t, y)| format!("{t},{y}\n"))
        .collect();
    folder.write("decay.csv", format!("time_s,gage_mV\n{rows}"));
}

fn parameter(report: &Value, name: &str) -> (f64, Option<f64>, String) {
    let all = report["parameters"].as_array().expect("parameters");
    let found = all
        .iter()
        .find(|p| p["name"] == name)
        .unwrap_or_else(|| panic!("{name} in {all:?}"));
    let unit = found["unit"].as_str().expect("a unit").to_owned();
    (
        found["value"].as_f64().expect("a value"),
        found["std"].as_f64(),
        unit,
    )
}

/// C7 to C21 from figure 5's numbers and the inertia of the thesis, as in `thesis::mechanics`.
#[test]
fn figure_5_gives_the_constants_of_the_thesis() {
    let folder = Folder::new();
    decay_file(&folder);
    let report = folder.json(&[
        "identify",
        "decay",
        "decay.csv",
        "--inertia",
        "5.85e-3 slug ft^2",
        "--units",
        "us",
        "--json",
        "--stand",
        "stand.toml",
    ]);
    assert_eq!(report["schema"], "torqcomp.identify/1");
    for (name, want, unit) in [
        ("damped_frequency", 588.235, "Hz"),
        ("decay_rate", 261.56, "1/s"),
        ("damping_ratio", 0.070593, ""),
        ("natural_frequency", 589.707, "Hz"),
        ("damping", 3.0603, "ft lbf s/rad"),
        ("stiffness", 80_314.0, "ft lbf/rad"),
    ] {
        let (value, std, got) = parameter(&report, name);
        assert_close(value, want, 1.5e-3);
        assert_eq!(got, unit, "{name}");
        assert!(std.is_some_and(|s| s > 0.0), "{name}");
    }
    assert_eq!(report["fit"]["unit"], "mV");
}

#[test]
fn the_stand_file_is_updated_in_place() {
    let folder = Folder::new();
    decay_file(&folder);
    let before = folder
        .read("stand.toml")
        .replace("[calibration]", "# weighed, not fitted\n[calibration]");
    folder.write("stand.toml", &before);
    folder
        .run(&["identify", "decay", "decay.csv", "-o", "stand.toml"])
        .says(0, &["anchor-without-std"]);
    let after = folder.read("stand.toml");
    assert!(
        after.contains("inertia = \"5.85e-3 slug ft^2\"\n"),
        "{after}"
    );
    assert!(
        after.contains("# weighed, not fitted\n[calibration]"),
        "{after}"
    );
    assert!(
        after.contains("stiffness = { value = \"") && after.contains("std = \""),
        "{after}"
    );
    assert!(
        after.contains("source = \"identify decay: decay.csv\""),
        "{after}"
    );
    // What is written is a stand file.
    assert_eq!(folder.run(&["table", "--stand", "stand.toml"]).code, 0);
    folder.write("other.toml", "a = 1\n");
    folder
        .run(&["identify", "decay", "decay.csv", "-o", "other.toml"])
        .says(1, &["not a stand file"]);
    assert_eq!(folder.read("other.toml"), "a = 1\n");
}

#[test]
fn without_an_anchor_only_ratios_are_written() {
    let folder = Folder::new();
    decay_file(&folder);
    folder
        .run(&[
            "identify",
            "decay",
            "decay.csv",
            "-o",
            "new.toml",
            "--strict",
        ])
        .says(3, &["not-anchored", "--inertia"]);
    let text = folder.read("new.toml");
    assert!(
        text.contains("natural_frequency") && text.contains("damping_ratio"),
        "{text}"
    );
    assert!(!text.contains("stiffness"), "{text}");
    assert_eq!(folder.run(&["table", "--stand", "new.toml"]).code, 0);
}

#[test]
fn the_page_is_complete_in_itself() {
    let folder = Folder::new();
    decay_file(&folder);
    let args = ["identify", "decay", "decay.csv", "--html", "page.html"];
    assert_eq!(folder.run(&args).code, 0);
    let page = folder.read("page.html");
    for part in [
        "<!DOCTYPE html>",
        "natural frequency",
        "Residual",
        "<svg",
        "prefers-color-scheme:dark",
        "@media print",
    ] {
        assert!(page.contains(part), "{part}");
    }
    for outside in ["<script", "src=", "href=", "@import"] {
        assert!(!page.contains(outside), "{outside}");
    }
    folder.run(&args).says(1, &["page.html exists", "--force"]);
    let again = folder.run(&[
        "identify",
        "decay",
        "decay.csv",
        "--html",
        "page.html",
        "--force",
    ]);
    assert_eq!((again.code, folder.read("page.html")), (0, page));
}

#[test]
fn known_loads_give_the_calibration() {
    let folder = Folder::new();
    let rows = "0,0.010\n5,0.511\n10,1.009\n5,0.512\n0,0.011\n0,0.010\n5,0.509\n10,1.011\n5,0.510\n0,0.010\n";
    folder.write("loads.csv", format!("weight (N m),bridge (V)\n{rows}"));
    let args = [
        "identify",
        "static",
        "loads.csv",
        "--load",
        "weight",
        "--reading",
        "bridge",
    ];
    let report = folder.json(&[&args[..], &["--json", "-o", "new.toml"]].concat());
    let (value, std, unit) = parameter(&report, "torque_per_volt");
    assert_close(value, 10.0, 5e-3);
    assert!(std.is_some() && unit == "N m/V");
    let term = |name: &str| {
        let all = report["terms"].as_array().expect("terms");
        all.iter().find(|t| t["name"] == name).expect("the term")["percent"].as_f64()
    };
    // (1.011 − 0.010) − (1.009 − 0.010) over their mean, 1.000: 0.2 %; at 5 N m 0.501 and 0.499: 0.4 %.
    assert!(
        (term("repeatability").unwrap() - 0.4).abs() < 1e-9,
        "{:?}",
        term("repeatability")
    );
    assert_eq!((term("reproducibility"), term("creep")), (None, None));
    let stand = folder.read("new.toml");
    assert!(
        stand.contains("[calibration]\ntorque_per_volt = {")
            && stand.contains("[recorder]\nzero = {")
    );
}

#[test]
fn what_cannot_be_identified_is_said() {
    let folder = Folder::new();
    decay_file(&folder);
    let flat: String = (0..500)
        .map(|i| format!("{},1\n", f64::from(i) * 1e-3))
        .collect();
    folder.write("flat.csv", format!("time_s,gage_V\n{flat}"));
    folder
        .run(&["identify", "decay", "flat.csv"])
        .says(1, &["does not swing"]);
    folder
        .run(&["identify", "decay", "none.csv"])
        .says(1, &["none.csv", "check the path"]);
    folder.run(&["identify", "decay"]).says(2, &["INPUT"]);
    let args = [
        "identify",
        "runup",
        "decay.csv",
        "--motion",
        "gage",
        "--torque",
        "gage",
    ];
    folder.run(&args).says(1, &["mV", "expected an angle"]);
    let args = ["identify", "decay", "decay.csv", "--inertia", "5"];
    folder.run(&args).says(2, &["--inertia", "unit"]);
}
