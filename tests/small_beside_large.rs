//! Effects that are small beside a larger one, that one kind of record hardly shows, or that hide the stand itself.

use std::f64::consts::TAU;

use serde_json::Value;

use crate::noise::Noise;
use crate::one_mode::{Hung, NATURAL_HZ, RATE_HZ, record, record_with};
use crate::util::{Folder, number};

/// A record whose measured values are changed, with the time, the applied and the measured torque.
fn changed(text: &str, mut change: impl FnMut([f64; 3]) -> f64) -> String {
    let mut rows = text.lines();
    let mut all = rows.next().expect("a heading").to_owned() + "\n";
    for row in rows {
        let numbers: Vec<f64> = row
            .split(',')
            .map(|n| n.parse().expect("a number"))
            .collect();
        let [time_s, applied, measured] = numbers[..] else {
            panic!("three columns: {row}")
        };
        let measured = change([time_s, applied, measured]);
        all += &format!("{time_s:.6},{applied:.9},{measured:.9}\n");
    }
    all
}

/// Diagnosis of records, the last of which is held out.
fn diagnosed(records: &[String]) -> Value {
    let folder = Folder::new();
    let names: Vec<String> = (0..records.len()).map(|k| format!("{k}.csv")).collect();
    let mut words = vec![
        "diagnose",
        "--json",
        "--applied",
        "applied",
        "--measured",
        "measured",
    ];
    for (k, (name, text)) in names.iter().zip(records).enumerate() {
        folder.write(name, text);
        let is_last = k + 1 == records.len();
        words.extend([if is_last { "--holdout" } else { "--train" }, name]);
    }
    let report = folder.json(&words);
    println!(
        "{} {} {}",
        report["verdict"], report["effects"], report["error"]
    );
    report
}

/// Value and standard uncertainty of a parameter of an effect that is named.
fn parameter(report: &Value, effect: &str, name: &str) -> [f64; 2] {
    let candidates = report["candidates"].as_array().expect("a list").iter();
    let mut named = candidates.filter(|c| c["effect"] == effect && c["status"] == "accepted");
    let named = named.next().expect("it is named");
    let mut parameters = named["parameters"].as_array().expect("a list").iter();
    let found = parameters.find(|p| p["name"] == name).expect("a parameter");
    ["value", "std"].map(|key| number(&found[key]))
}

fn check_parameter(report: &Value, (effect, name): (&str, &str), truth: f64) {
    let [value, std] = parameter(report, effect, name);
    assert!(
        (value - truth).abs() < 3.5 * std,
        "{effect} {name}: {value} ± {std}, not {truth}"
    );
}

/// Smooth dry friction.
fn friction(_: f64, _: f64, v: f64) -> f64 {
    0.06 * (8.0 * v).tanh()
}

/// The drift leaves twice the noise, a small part of what friction does.
#[test]
fn a_drift_of_the_sensitivity_beside_dry_friction() {
    let mut noise = Noise(31);
    let records = [0.12, 0.08].map(|level| {
        let (text, _) = record(friction, (level, 50.0), &mut noise);
        changed(&text, |[time_s, _, y]| y * (1.0 + 0.0015 * time_s))
    });
    let report = diagnosed(&records);
    assert_eq!(report["verdict"], "explained");
    let mut effects: Vec<&str> = report["effects"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(Value::as_str)
        .collect();
    effects.sort_unstable();
    assert_eq!(effects, ["coulomb-friction", "thermal-drift"]);
    check_parameter(&report, ("thermal-drift", "rate"), 0.0015);
    check_parameter(&report, ("coulomb-friction", "torque"), 0.06);
}

/// A record of slow tones shows the creep, the held-out one hardly does.
#[test]
fn creep_that_the_held_out_record_hardly_shows() {
    let mut noise = Noise(32);
    let stiffens = |_: f64, x: f64, _: f64| 0.05 * x.powi(3);
    let corner_hz = 0.3;
    let records = [(0.12, 50.0), (0.06, 1.0), (0.1, 50.0)].map(|(level, to_hz)| {
        let (text, _) = record(stiffens, (level, to_hz), &mut noise);
        let mut lag = 0.0;
        changed(&text, |[_, _, y]| {
            lag += (1.0 - (-TAU * corner_hz / RATE_HZ).exp()) * (y - lag);
            y + 0.03 * lag
        })
    });
    let report = diagnosed(&records);
    assert_eq!(report["verdict"], "explained");
    check_parameter(&report, ("gage-creep", "share"), 0.03);
}

/// Cross-talk of the drive with its square: no effect of the list, and no noise.
#[test]
fn the_square_of_the_input_is_no_noise() {
    let mut noise = Noise(33);
    let records = [0.12, 0.05, 0.08].map(|level| {
        let (text, _) = record(|_, _, _| 0.0, (level, 50.0), &mut noise);
        changed(&text, |[_, u, y]| y + 0.01 * u * u)
    });
    let report = diagnosed(&records);
    assert_eq!(report["verdict"], "unexplained");
    let shares = report["residual"]["tests"]["shares"]
        .as_array()
        .expect("a list");
    let share = |of: &str| {
        let found = shares.iter().find(|s| s["of"] == of);
        number(&found.expect("a share")["share"])
    };
    assert!(share("the square of the input") > 0.2, "{shares:?}");
    let next = report["next_experiment"].to_string();
    assert!(next.contains("bridge unexcited"), "{next}");
}

/// A measured channel that is late by a sixth of a period of the stand: without the delay, no plain stand follows the record.
#[test]
fn a_late_channel_is_a_delay_alone() {
    let mut noise = Noise(34);
    let late = 7;
    let records = [0.12, 0.08].map(|level| {
        let (text, _) = record(|_, _, _| 0.0, (level, 50.0), &mut noise);
        let mut before = std::collections::VecDeque::from(vec![0.0; late]);
        changed(&text, |[_, _, y]| {
            before.push_back(y);
            before.pop_front().expect("as many as it is late")
        })
    });
    let report = diagnosed(&records);
    assert_eq!(report["verdict"], "explained");
    assert_eq!(report["effects"], serde_json::json!(["time-delay"]));
    check_parameter(&report, ("time-delay", "delay"), late as f64 / RATE_HZ);
}

/// A spring that stiffens with the fourth power, beside friction: a joint that slips may imitate it down to the noise.
#[test]
fn an_unlisted_spring_beside_dry_friction() {
    let mut noise = Noise(38);
    let law = |t: f64, x: f64, v: f64| 3e-5 * x.powi(5) + 0.1 * friction(t, x, v);
    let records = [0.12, 0.06, 0.09].map(|level| record(law, (level, 50.0), &mut noise).0);
    let report = diagnosed(&records);
    assert_eq!(report["verdict"], "unexplained", "{}", report["suspected"]);
    let suspected = &report["suspected"];
    assert_eq!(suspected["law"], "quintic-stiffness");
    assert_eq!(suspected["with"], serde_json::json!(["coulomb-friction"]));
}

/// A spot whose friction turns within 3 % of the speed.
#[test]
fn a_spot_that_rubs_sharply_has_its_transition() {
    let mut noise = Noise(35);
    let spot =
        |_: f64, x: f64, v: f64| 0.1 * (-((x - 0.4) / 0.25).powi(2)).exp() * (20.0 * v).tanh();
    let records = [0.12, 0.1, 0.08].map(|level| record(spot, (level, 50.0), &mut noise).0);
    let report = diagnosed(&records);
    assert_eq!(report["verdict"], "explained");
    let effect = "position-dependent-friction";
    check_parameter(&report, (effect, "torque"), 0.1);
    check_parameter(&report, (effect, "width"), 0.25);
    check_parameter(
        &report,
        (effect, "transition_speed"),
        TAU * NATURAL_HZ / 20.0,
    );
}

/// Without the play, a recorder that clips unevenly is as good as a gage that is not linear.
#[test]
fn a_tie_is_settled_by_the_effects_found_later() {
    let mut noise = Noise(36);
    let records = [0.12, 0.1, 0.11].map(|level| {
        let (text, _) = record(|_, _, _| 0.0, (level, 50.0), &mut noise);
        let mut dragged = 0.0_f64;
        changed(&text, |[_, _, y]| {
            dragged = dragged.clamp(y - 0.06, y + 0.06);
            dragged.clamp(-1.6, 2.1) + 0.003 * noise.normal()
        })
    });
    let report = diagnosed(&records);
    let candidates = report["candidates"].as_array().expect("a list");
    for candidate in candidates {
        println!(
            "{} {} {} {}",
            candidate["effect"], candidate["with"], candidate["status"], candidate["why"]
        );
        assert_ne!(candidate["status"], "indistinguishable", "{candidate}");
    }
}

/// Noise of which half of each sample remains in the next.
fn coloured(text: &str, rms: f64, noise: &mut Noise) -> String {
    let mut last = 0.0;
    changed(text, |[_, _, measured]| {
        last = 0.5 * last + (1.0 - 0.25_f64).sqrt() * noise.normal();
        measured + rms * last
    })
}

/// The noise floor, from the top of the spectrum, is that of white noise: it had been called structure above the noise.
#[test]
fn first_order_noise_beside_an_effect_is_noise() {
    let mut noise = Noise(3);
    let records = [(0.08, 50.0), (0.06, 50.0)].map(|excited| {
        let (text, rms) = record(|_, x, _| 0.05 * x * x * x, excited, &mut noise);
        coloured(&text, 4.0 * rms, &mut noise)
    });
    let report = diagnosed(&records);
    assert_eq!(report["verdict"], "explained");
    assert_eq!(report["effects"], serde_json::json!(["cubic-stiffness"]));
    let correlation = number(&report["residual"]["tests"]["first_order_noise"]);
    assert!((correlation - 0.47).abs() < 0.05, "{correlation}");
}

/// Friction acts on the first of two coupled inertias; it had been integrated without the second, which was then
/// `unexplained` (figures of the stand: two modes at 18.6 and 35.4 Hz).
#[test]
fn friction_on_the_first_of_two_inertias() {
    let mut noise = Noise(8);
    let hung = Hung {
        natural_hz: 33.0,
        damping_ratio: 0.03,
        inertia_ratio: 0.1,
    };
    let friction = |_: f64, _: f64, v: f64| 0.03 * (v / 0.002).tanh();
    let records = [(0.08, 60.0), (0.06, 60.0)]
        .map(|excited| record_with(friction, hung, excited, &mut noise).0);
    let report = diagnosed(&records);
    assert_eq!(report["verdict"], "explained");
    let mut names: Vec<&str> = report["effects"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(Value::as_str)
        .collect();
    names.sort_unstable();
    assert_eq!(names, ["coulomb-friction", "second-mode"]);
    check_parameter(&report, ("coulomb-friction", "torque"), 0.03);
}

/// A measured channel late by a 20th of a sample beside a line: a delay, and a low-pass far above half the rate, which the
/// records do not tell apart.
#[test]
fn a_low_pass_beyond_the_rate_is_listed_beside_a_delay() {
    let mut noise = Noise(37);
    let records = [0.12, 0.08].map(|level| {
        let (text, _) = record(|_, _, _| 0.0, (level, 50.0), &mut noise);
        let mut measured = Vec::new();
        changed(&text, |[_, _, y]| {
            measured.push(y);
            y
        });
        let last = measured.len() - 1;
        let mut place = 0..;
        // The parabola through a sample and its neighbours, a 20th of a sample before it.
        changed(&text, |[time_s, _, y]| {
            let k: usize = place.next().expect("a row");
            let [before, after] = [k.saturating_sub(1), (k + 1).min(last)].map(|k| measured[k]);
            let late = 0.02625 * before + 0.9975 * y - 0.02375 * after;
            late + 0.004 * (TAU * 31.7 * time_s).sin()
        })
    });
    let report = diagnosed(&records);
    assert_eq!(report["verdict"], "explained");
    let effects = report["effects"].to_string();
    assert!(effects.contains("rotor-imbalance"), "{effects}");
    let candidates = report["candidates"].as_array().expect("a list").iter();
    let possible = |c: &&Value| c["status"] == "accepted" || c["status"] == "indistinguishable";
    let names: Vec<&str> = candidates
        .filter(possible)
        .filter_map(|c| c["effect"].as_str())
        .collect();
    for name in ["time-delay", "recorder-lowpass"] {
        assert!(names.contains(&name), "{names:?}");
    }
}
