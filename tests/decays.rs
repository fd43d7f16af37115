//! `diagnose` of free decays only: no torque is measured, only the gage.
//!
//! The records are integrated here by the Runge–Kutta method (dry friction: up to the whole speed, in each of 40 steps
//! per sample).

use std::f64::consts::{PI, TAU};

use serde_json::Value;

use crate::motion;
use crate::noise::Noise;
use crate::util::{Folder, number};

const RATE_HZ: f64 = 2000.0;
const SAMPLES: usize = 8000;
const STEPS: usize = 40;
/// Noise and zero of the gage, in V.
pub const NOISE: f64 = 1e-3;
const ZERO: f64 = 0.05;
/// Start and duration of a hit, in s.
const HIT_S: [f64; 2] = [0.1, 0.003];

/// `x'' + 2 ζ ω x' + ω² (x + c x³ + F sgn x' + d x' |x'|) = ω² u`, `x` in V.
pub struct Stand {
    pub natural_hz: f64,
    pub damping_ratio: f64,
    pub cubic: f64,
    pub friction: f64,
    pub drag: f64,
}

pub const PLAIN: Stand = Stand {
    natural_hz: 20.0,
    damping_ratio: 0.01,
    cubic: 0.0,
    friction: 0.0,
    drag: 0.0,
};

impl Stand {
    /// A record of the gage after a hit with an amplitude of about `volts`.
    pub fn hit(&self, volts: f64, seed: u64) -> String {
        let omega = TAU * self.natural_hz;
        let h = 1.0 / (RATE_HZ * STEPS as f64);
        // The pulse gives the stand the speed ω times the amplitude.
        let top = volts * omega * PI / (2.0 * HIT_S[1]);
        let push = |t: f64| {
            let part = (t - HIT_S[0]) / HIT_S[1];
            if (0.0..1.0).contains(&part) {
                top * (PI * part).sin()
            } else {
                0.0
            }
        };
        let slope = |t: f64, [x, v]: [f64; 2]| {
            let spring = x + self.cubic * x.powi(3) + self.drag * v * v.abs();
            [
                v,
                push(t) - 2.0 * self.damping_ratio * omega * v - omega * omega * spring,
            ]
        };
        let mut noise = Noise(seed);
        let mut state = [0.0, 0.0];
        let mut text = String::from("time_s,gage_V\n");
        for i in 0..SAMPLES {
            let seen = state[0] + ZERO + NOISE * noise.normal();
            text += &format!("{:.6},{seen:.7}\n", i as f64 / RATE_HZ);
            for step in 0..STEPS {
                let t = (i * STEPS + step) as f64 * h;
                let before = state;
                state = motion::step(state, t, h, slope);
                let most = h * self.friction * omega * omega;
                state[1] -= state[1].clamp(-most, most);
                if before[1] == 0.0 && state[1] == 0.0 {
                    // It sticks.
                    state[0] = before[0];
                }
            }
        }
        text
    }

    /// Diagnosis of two hits, the second held out.
    fn diagnosed(&self, more: &[&str]) -> (Folder, Value) {
        let folder = Folder::new();
        folder.write("first.csv", self.hit(1.0, 1));
        folder.write("second.csv", self.hit(0.6, 2));
        let args = [
            "diagnose",
            "--decay",
            "first.csv",
            "--holdout-decay",
            "second.csv",
        ];
        let channel = ["--measured", "gage_V", "--json"];
        let report = folder.json(&[&args, &channel[..], more].concat());
        (folder, report)
    }
}

/// A parameter of the accepted effect: value and standard uncertainty.
pub fn parameter(report: &Value, effect: &str, name: &str) -> [f64; 2] {
    let candidates = report["candidates"].as_array().expect("candidates");
    let accepted = candidates
        .iter()
        .find(|c| c["effect"] == effect && c["status"] == "accepted")
        .expect("an accepted effect");
    let parameters = accepted["parameters"].as_array().expect("parameters");
    let found = parameters.iter().find(|p| p["name"] == name);
    let found = found.expect("the parameter");
    [number(&found["value"]), number(&found["std"])]
}

#[test]
fn a_linear_stand_lacks_nothing() {
    let (_, report) = PLAIN.diagnosed(&[]);
    assert_eq!(report["verdict"], "nothing-missing");
    let error = number(&report["error"]["before"]["holdout_rms"]);
    assert!((0.95..1.05).contains(&(error / NOISE)), "{error}");
    for (constant, want) in [(0, 20.0), (1, 0.01)] {
        let found = &report["constants"][constant];
        let (value, std) = (number(&found["before"]), number(&found["before_std"]));
        assert!(
            (value - want).abs() < 4.0 * std && std < 1e-3 * want,
            "{found}"
        );
    }
}

#[test]
fn a_stiffness_that_grows_is_found_and_simulated_in_the_stand_file() {
    let stand = Stand {
        cubic: 0.05,
        ..PLAIN
    };
    let (folder, report) = stand.diagnosed(&["--html", "page.html"]);
    assert_eq!(report["verdict"], "explained");
    assert_eq!(report["effects"], serde_json::json!(["cubic-stiffness"]));
    let error = |model: &str| number(&report["error"][model]["holdout_rms"]) / NOISE;
    let (before, after) = (error("before"), error("after"));
    let [value, std] = parameter(&report, "cubic-stiffness", "coefficient");
    println!("{value} ± {std}, error over the noise {before} -> {after}");
    assert!((0.95..1.05).contains(&after), "{after}");
    assert!(
        (value - 0.05).abs() < 4.0 * std && std < 5e-4,
        "{value} ± {std}"
    );
    assert!(folder.read("page.html").contains("second.csv"));
    // The stand file needs the gain, and is read again: with its effect nothing is missing.
    let mechanics = "natural_frequency = \"21 Hz\"\ndamping_ratio = 0.02\nstatic_gain = \"2 V/N\"";
    let file = format!("schema = \"torqcomp.stand/1\"\n[mechanics]\n{mechanics}\n");
    folder.write("stand.toml", file);
    let decays = ["--decay", "first.csv", "--holdout-decay", "second.csv"];
    let diagnose = [&["diagnose", "--measured", "gage_V"], &decays[..]].concat();
    folder
        .run(&[&diagnose[..], &["-o", "refined.toml"]].concat())
        .says(2, &["--stand FILE", "static_gain"]);
    let with_stand = ["--stand", "stand.toml", "-o", "refined.toml"];
    folder
        .run(&[&diagnose[..], &with_stand].concat())
        .says(0, &[]);
    let refined = folder.read("refined.toml");
    assert!(
        refined.contains("cubic-stiffness") && refined.contains("2 V/N"),
        "{refined}"
    );
    let again = folder.json(&[&diagnose[..], &["--stand", "refined.toml", "--json"]].concat());
    assert_eq!(again["verdict"], "nothing-missing");
}

/// Over a long decay, the nonlinear stiffness adds a turn that no plain stand has.
#[test]
fn a_stiffness_that_grows_is_found_with_little_damping() {
    let stand = Stand {
        cubic: 0.05,
        damping_ratio: 0.002,
        ..PLAIN
    };
    let (_, report) = stand.diagnosed(&[]);
    assert_eq!(report["verdict"], "explained");
    assert_eq!(report["effects"], serde_json::json!(["cubic-stiffness"]));
    let [value, std] = parameter(&report, "cubic-stiffness", "coefficient");
    assert!((value - 0.05).abs() < 4.0 * std, "{value} ± {std}");
}

/// A little friction, and so much that the decay ends after a few turns.
#[test]
fn dry_friction_is_found() {
    for (natural_hz, damping_ratio, friction) in [
        (20.0, 0.01, 0.01),
        (43.0, 0.0155, 0.031),
        (35.0, 0.009, 0.049),
    ] {
        let stand = Stand {
            natural_hz,
            damping_ratio,
            friction,
            ..PLAIN
        };
        let (_, report) = stand.diagnosed(&[]);
        assert_eq!(report["effects"], serde_json::json!(["coulomb-friction"]));
        let described = &report["residual"]["described"];
        assert_eq!(
            report["verdict"], "explained",
            "{described} {}",
            report["suspected"]
        );
        let [value, _] = parameter(&report, "coulomb-friction", "torque");
        assert!((value / friction - 1.0).abs() < 0.01, "{value}");
    }
}

#[test]
fn drag_is_found() {
    let omega = TAU * 58.0;
    let stand = Stand {
        natural_hz: 58.0,
        damping_ratio: 0.0274,
        drag: 0.0374 / omega.powi(2),
        ..PLAIN
    };
    let (_, report) = stand.diagnosed(&[]);
    assert_eq!(report["verdict"], "explained");
    assert_eq!(report["effects"], serde_json::json!(["quadratic-damping"]));
    let [value, std] = parameter(&report, "quadratic-damping", "coefficient");
    assert!((value - stand.drag).abs() < 4.0 * std, "{value} ± {std}");
}

/// Hysteresis beside the spring leaves as little, with more parameters.
#[test]
fn drag_beside_a_spring_that_softens_is_no_hysteresis() {
    let stand = Stand {
        cubic: -0.05,
        drag: 1.5e-6,
        ..PLAIN
    };
    let (_, report) = stand.diagnosed(&["--range", "0..3"]);
    assert_eq!(report["verdict"], "explained");
    let mut names: Vec<&str> = report["effects"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(Value::as_str)
        .collect();
    names.sort_unstable();
    assert_eq!(names, ["cubic-stiffness", "quadratic-damping"]);
    for (effect, want) in [
        ("cubic-stiffness", stand.cubic),
        ("quadratic-damping", stand.drag),
    ] {
        let [value, std] = parameter(&report, effect, "coefficient");
        let off = (value - want).abs();
        assert!(
            off < 4.0 * std && std < 0.01 * want.abs(),
            "{effect}: {value} ± {std}"
        );
    }
}

#[test]
fn several_hits_in_one_record_are_several_decays() {
    let folder = Folder::new();
    let (first, second) = (PLAIN.hit(1.0, 1), PLAIN.hit(0.6, 2));
    let values = |text: &str| -> Vec<String> {
        let rows = text.lines().skip(1);
        rows.map(|row| row.split(',').nth(1).expect("a value").to_owned())
            .collect()
    };
    let both = [values(&first), values(&second)].concat();
    let rows = both.iter().enumerate();
    let rows: String = rows
        .map(|(i, y)| format!("{:.6},{y}\n", i as f64 / RATE_HZ))
        .collect();
    folder.write("both.csv", format!("time_s,gage_V\n{rows}"));
    let report = folder.json(&[
        "diagnose",
        "--decay",
        "both.csv",
        "--measured",
        "gage_V",
        "--json",
    ]);
    assert_eq!(report["verdict"], "nothing-missing");
    let warnings = report["warnings"].as_array().expect("warnings");
    let held_out = warnings.iter().find(|w| w["code"] == "no-record-held-out");
    let message = held_out.expect("the warning")["message"].to_string();
    assert!(message.contains("the last decay"), "{message}");
}

#[test]
fn what_is_missing_is_said() {
    let folder = Folder::new();
    folder.write("hit.csv", PLAIN.hit(1.0, 1));
    let diagnose = ["diagnose", "--measured", "gage_V"];
    folder
        .run(&[&diagnose[..], &["--decay", "hit.csv"]].concat())
        .says(
            1,
            &["hit.csv", "the only decay is fitted", "--holdout-decay"],
        );
    folder
        .run(&[&diagnose[..], &["--train", "hit.csv", "--decay", "hit.csv"]].concat())
        .says(2, &["--applied"]);
    let quiet: String = (0..2000)
        .map(|i| format!("{:.4},0.0\n", f64::from(i) / 2000.0))
        .collect();
    folder.write("quiet.csv", format!("time_s,gage_V\n{quiet}"));
    folder
        .run(&[&diagnose[..], &["--decay", "quiet.csv"]].concat())
        .says(1, &["quiet.csv", "no free decay"]);
}

#[test]
fn arguments_that_do_not_go_together_are_refused() {
    let folder = Folder::new();
    folder.write("first.csv", PLAIN.hit(1.0, 1));
    folder.write("second.csv", PLAIN.hit(0.6, 2));
    let diagnose = ["diagnose", "--measured", "gage_V"];
    let decays = ["--decay", "first.csv", "--holdout-decay", "second.csv"];
    for (flag, value) in [("--applied", "force_N"), ("--applied-unit", "N")] {
        folder
            .run(&[&diagnose[..], &decays, &[flag, value]].concat())
            .says(2, &[flag, "--decay", "omit", "--train"]);
    }
    folder
        .run(&[&diagnose[..], &["--holdout-decay", "second.csv"]].concat())
        .says(
            2,
            &["no record to fit is given", "--decay FILE", "--train FILE"],
        );
}

#[test]
fn noise_is_no_decay_and_a_hand_on_the_stand_is_warned_of() {
    let folder = Folder::new();
    let mut noise = Noise(7);
    let rows = |value: &mut dyn FnMut(usize) -> f64| -> String {
        let row = |i: usize| format!("{:.6},{:.7}\n", i as f64 / RATE_HZ, value(i));
        let rows: String = (0..SAMPLES).map(row).collect();
        format!("time_s,gage_V\n{rows}")
    };
    folder.write("first.csv", PLAIN.hit(1.0, 1));
    folder.write("noise.csv", rows(&mut |_| ZERO + NOISE * noise.normal()));
    // A hand stops the decay after half a second.
    let omega = TAU * PLAIN.natural_hz;
    let stopped = |i: usize, noise: &mut Noise| {
        let t = i as f64 / RATE_HZ;
        let fading = PLAIN.damping_ratio * omega * t + 60.0 * (t - 0.5).max(0.0);
        ZERO + (-fading).exp() * (omega * t).cos() + NOISE * noise.normal()
    };
    folder.write("stopped.csv", rows(&mut |i| stopped(i, &mut noise)));
    let diagnose = ["diagnose", "--measured", "gage_V", "--decay", "first.csv"];
    folder
        .run(&[&diagnose[..], &["--decay", "noise.csv"]].concat())
        .says(1, &["noise.csv", "no decaying sine", "--range"]);
    folder
        .run(&[&diagnose[..], &["--holdout-decay", "stopped.csv"]].concat())
        .says(
            0,
            &[
                "restart-in-decay",
                "stopped.csv",
                "a hand or a brake",
                "--range",
            ],
        );
    let quiet = folder.run(&[&diagnose[..], &["--holdout-decay", "first.csv"]].concat());
    quiet.says(1, &["same samples"]);
}

/// The scatter of the coefficient between records matches its standard uncertainty.
#[test]
fn uncertainties_of_a_curved_decay_hold() {
    let stand = Stand {
        cubic: 0.05,
        ..PLAIN
    };
    let off = |seed: u64| {
        let folder = Folder::new();
        folder.write("first.csv", stand.hit(1.0, 2 * seed));
        folder.write("second.csv", stand.hit(0.6, 2 * seed + 1));
        let decays = ["--decay", "first.csv", "--holdout-decay", "second.csv"];
        let args = ["diagnose", "--measured", "gage_V", "--json"];
        let report = folder.json(&[&args[..], &decays].concat());
        let [value, std] = parameter(&report, "cubic-stiffness", "coefficient");
        (value - 0.05) / std
    };
    let all: Vec<f64> = (10..22).map(off).collect();
    let rms = (all.iter().map(|z| z * z).sum::<f64>() / all.len() as f64).sqrt();
    // For twelve standardised numbers, the RMS is within 0.52 and 1.54 in 99.9 % of all cases.
    assert!((0.5..1.55).contains(&rms), "{rms}: {all:?}");
}

/// A decay together with a record of plateaus does not change their waveform.
#[test]
fn a_decay_stands_beside_plateaus() {
    let folder = Folder::new();
    folder.write("hit.csv", PLAIN.hit(1.0, 1));
    let omega = TAU * PLAIN.natural_hz;
    let driven = |seed: u64| -> String {
        let mut noise = Noise(seed);
        let h = 1.0 / (RATE_HZ * STEPS as f64);
        let (mut state, mut level) = ([0.0, 0.0], 0.0);
        let mut text = String::from("time_s,force_N,gage_V\n");
        for i in 0..SAMPLES {
            if i % 400 == 0 {
                level = noise.normal();
            }
            let seen = state[0] + NOISE * noise.normal();
            text += &format!("{:.6},{level:.6},{seen:.7}\n", i as f64 / RATE_HZ);
            let slope = |[x, v]: [f64; 2]| {
                [
                    v,
                    omega * omega * (2.0 * level - x) - 2.0 * PLAIN.damping_ratio * omega * v,
                ]
            };
            for _ in 0..STEPS {
                let at = |d: [f64; 2], by: f64| [state[0] + by * d[0], state[1] + by * d[1]];
                let a = slope(state);
                let b = slope(at(a, 0.5 * h));
                let c = slope(at(b, 0.5 * h));
                let d = slope(at(c, h));
                for j in 0..2 {
                    state[j] += h / 6.0 * (a[j] + 2.0 * b[j] + 2.0 * c[j] + d[j]);
                }
            }
        }
        text
    };
    folder.write("train.csv", driven(5));
    folder.write("holdout.csv", driven(6));
    let records = [
        "--train",
        "train.csv",
        "--decay",
        "hit.csv",
        "--holdout",
        "holdout.csv",
    ];
    let channels = ["--applied", "force_N", "--measured", "gage_V", "--json"];
    let report = folder.json(&[&["diagnose"], &records[..], &channels].concat());
    let error = number(&report["error"]["before"]["holdout_rms"]) / NOISE;
    assert!(error < 1.1, "{error}");
    assert_eq!(report["verdict"], "nothing-missing");
}
