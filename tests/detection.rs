//! Detection limits and uncertainties of `diagnose`, against records of a stand integrated here: an effect at its limit
//! is detected in nearly every record, one of a third of it in hardly any; and 95 % intervals cover the truth in 95 %
//! of all records.

use std::f64::consts::TAU;

use serde_json::Value;

use crate::motion;
use crate::noise::Noise;
use crate::util::{Folder, trials};

const NATURAL_HZ: f64 = 60.0;
const DAMPING_RATIO: f64 = 0.03;
const RATE_HZ: f64 = 1000.0;
const COUNT: usize = 6000;
/// Standard deviation of the noise, relative to the RMS of the motion.
const NOISE: f64 = 0.01;

/// Fault of a stand.
#[derive(Clone, Copy)]
enum Fault {
    /// `k x³` in addition to the spring, per (N m)².
    Cubic(f64),
    /// The record lags behind, in s.
    Delay(f64),
    /// A 50 Hz line with its amplitude in N m.
    Mains(f64),
}

/// A fault of a given size.
type Made = fn(f64) -> Fault;

/// Torque at a time: sines at incommensurate frequencies, about 10 N m RMS.
fn torque(time_s: f64) -> f64 {
    let line = |k: u32| {
        let k = f64::from(k);
        (TAU * (3.1 * k + 0.37 * (k * k).sin()) * time_s + 2.4 * k * k).sin()
    };
    2.6 * (1..=30).map(line).sum::<f64>()
}

/// Torque and record of a stand with a fault, after one second of settling, by the Runge–Kutta method in eight steps
/// per sample.
fn record(fault: Fault, noise: &mut Noise) -> (Vec<f64>, Vec<f64>) {
    let cubic = if let Fault::Cubic(k) = fault { k } else { 0.0 };
    let delay_s = if let Fault::Delay(s) = fault { s } else { 0.0 };
    let mains = if let Fault::Mains(a) = fault { a } else { 0.0 };
    let omega = TAU * NATURAL_HZ;
    let slope = |t: f64, [x, v]: [f64; 2]| {
        let pull = torque(t - delay_s) - x - cubic * x.powi(3);
        [v, omega * omega * pull - 2.0 * DAMPING_RATIO * omega * v]
    };
    let step = 1.0 / (8.0 * RATE_HZ);
    let (mut state, mut applied, mut shown) = ([0.0, 0.0], Vec::new(), Vec::new());
    let settled = RATE_HZ as usize;
    for i in 0..settled + COUNT {
        let t = i as f64 / RATE_HZ;
        if i >= settled {
            applied.push(torque(t));
            shown.push(state[0] + mains * (TAU * 50.0 * t + 0.7).cos());
        }
        for k in 0..8 {
            let t = t + f64::from(k) * step;
            let at = |from: [f64; 2], by: f64| [state[0] + by * from[0], state[1] + by * from[1]];
            let a = slope(t, state);
            let b = slope(t + 0.5 * step, at(a, 0.5 * step));
            let c = slope(t + 0.5 * step, at(b, 0.5 * step));
            let d = slope(t + step, at(c, step));
            for j in 0..2 {
                state[j] += step / 6.0 * (a[j] + 2.0 * b[j] + 2.0 * c[j] + d[j]);
            }
        }
    }
    let rms = (shown.iter().map(|x| x * x).sum::<f64>() / COUNT as f64).sqrt();
    shown
        .iter_mut()
        .for_each(|x| *x += NOISE * rms * noise.normal());
    (applied, shown)
}

/// The diagnosis of a record with a fault.
fn diagnosed(fault: Fault, seed: u64) -> Value {
    let (applied, shown) = record(fault, &mut Noise(seed));
    of_record(&applied, &shown)
}

/// Diagnosis of a record with its last 30 % held out.
fn of_record(applied: &[f64], shown: &[f64]) -> Value {
    let folder = Folder::new();
    folder.write(
        "stand.toml",
        format!(
            "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"{NATURAL_HZ} Hz\"\n\
             damping_ratio = {DAMPING_RATIO}\n"
        ),
    );
    let rows = applied.iter().zip(shown).enumerate();
    let rows = rows.map(|(i, (a, y))| format!("{:.3},{a:.9},{y:.9}\n", i as f64 / RATE_HZ));
    let rows: String = rows.collect();
    folder.write("in.csv", format!("time_s,applied_n_m,measured_n_m\n{rows}"));
    let args = ["diagnose", "--stand", "stand.toml", "--train", "in.csv"];
    let channels = ["--applied", "applied_n_m", "--measured", "measured_n_m"];
    folder.json(&[&args[..], &channels, &["--json"]].concat())
}

fn limit(report: &Value, effect: &str) -> f64 {
    let limits = report["detection_limits"].as_array().expect("a list");
    let found = limits.iter().find(|limit| limit["effect"] == effect);
    let found = found.unwrap_or_else(|| panic!("{effect}: {report}"));
    found["value"].as_f64().expect("a number")
}

#[test]
fn what_is_at_its_limit_is_seen_and_what_is_far_below_is_not() {
    let clean = diagnosed(Fault::Cubic(0.0), 1);
    assert_eq!(clean["verdict"], "nothing-missing", "{clean}");
    // A line of amplitude A in n samples of noise s reduces the sum of squares by D = n A²/(2 s²) noise powers, with a
    // standard deviation of 2 √D. To be three times that with 95 % confidence, D - 1.645 · 2 √D = 3 · 2 √D: √D = 9.29.
    // The first three time constants of the stand are excluded, 0.265 s.
    let samples = 0.7 * COUNT as f64 - 0.265 * RATE_HZ;
    let noise = clean["error"]["before"]["train_rms"].as_f64();
    let mains = limit(&clean, "mains-pickup");
    let by_hand = 9.29 * noise.expect("a number") * (2.0 / samples).sqrt();
    assert!((mains / by_hand - 1.0).abs() < 0.1, "{mains} {by_hand}");
    let faults: [(&str, Made); 3] = [
        ("cubic-stiffness", Fault::Cubic),
        ("time-delay", Fault::Delay),
        ("mains-pickup", Fault::Mains),
    ];
    let records = trials(3);
    for (effect, fault) in faults {
        let limit = limit(&clean, effect);
        let seen = |size: f64| {
            let reports = (0..records).map(|k| diagnosed(fault(size * limit), 2 + k as u64));
            reports
                .filter(|r| r["verdict"] != "nothing-missing")
                .count()
        };
        let (at, below) = (seen(1.0), seen(1.0 / 3.0));
        println!("{effect}: limit {limit:e}, {at} seen of {records}, {below} of a third of it");
        let all = records as f64;
        assert!(
            at as f64 >= 0.95 * all - 3.0 * (0.0475 * all).sqrt(),
            "{effect}: {at}"
        );
        assert!(below as f64 <= 0.25 * all, "{effect}: {below} of a third");
    }
}

/// Noise on the applied torque passes through the model, and leaves a residual with a peak at the resonance: treated as
/// white noise, half of the intervals of the damping ratio would miss the truth.
#[test]
fn intervals_hold_with_noise_on_the_applied_torque() {
    let records = trials(12);
    let mut inside = [0; 2];
    for seed in 1..=records as u64 {
        let mut noise = Noise(seed);
        let (mut applied, shown) = record(Fault::Cubic(0.0), &mut noise);
        let rms = (applied.iter().map(|u| u * u).sum::<f64>() / COUNT as f64).sqrt();
        applied
            .iter_mut()
            .for_each(|u| *u += 0.005 * rms * noise.normal());
        let report = of_record(&applied, &shown);
        let truths = [
            ("natural_frequency", NATURAL_HZ),
            ("damping_ratio", DAMPING_RATIO),
        ];
        for (inside, (name, truth)) in inside.iter_mut().zip(truths) {
            let constants = report["constants"].as_array().expect("a list");
            let found = constants
                .iter()
                .find(|c| c["name"] == name)
                .expect("a constant");
            let [value, std] = ["before", "before_std"].map(|key| found[key].as_f64());
            let apart = (value.expect("a number") - truth).abs();
            *inside += usize::from(apart < 1.96 * std.expect("a number"));
        }
    }
    println!("{inside:?} of {records}");
    let all = records as f64;
    for inside in inside {
        assert!(
            inside as f64 >= 0.93 * all - 3.0 * (0.0475 * all).sqrt(),
            "{inside} of {all}"
        );
    }
}

/// A spring that bends to one side: a constant load that the records do not tell shifts the frequency, and what is not
/// known of that load belongs to the uncertainty of the frequency.
#[test]
fn the_frequency_of_a_spring_that_bends_to_one_side_is_as_sure_as_stated() {
    let (rate_hz, omega) = (500.0, TAU * 30.0);
    let rows = |seed: u64, size: f64| {
        let mut noise = Noise(seed);
        let phases: Vec<f64> = (0..24).map(|_| TAU * noise.uniform()).collect();
        let tone = |k: usize, t: f64| (TAU * 2.5 * (k + 2) as f64 * t + phases[k]).sin();
        let applied = |t: f64| size * (0..24).map(|k| tone(k, t)).sum::<f64>();
        let slope = |t: f64, [x, v]: [f64; 2]| {
            let spring = x + 0.01 * x * x - applied(t);
            [v, -0.06 * omega * v - omega * omega * spring]
        };
        let (mut state, fine) = ([0.0; 2], 20);
        let mut text = String::from("time_s,applied_Nm,measured_Nm\n");
        for i in 0..6000 {
            let t = f64::from(i) / rate_hz;
            text += &format!(
                "{t:.4},{:.9},{:.9}\n",
                applied(t),
                state[0] + 0.02 * noise.normal()
            );
            for k in 0..fine {
                let h = 1.0 / (rate_hz * f64::from(fine));
                state = motion::step(state, t + f64::from(k) * h, h, slope);
            }
        }
        text
    };
    for seed in [1, 2] {
        let folder = Folder::new();
        folder.write("train.csv", rows(10 * seed, 0.2));
        folder.write("holdout.csv", rows(10 * seed + 1, 0.15));
        let records = ["--train", "train.csv", "--holdout", "holdout.csv"];
        let channels = ["--applied", "applied", "--measured", "measured", "--json"];
        let report = folder.json(&[&["diagnose"], &records[..], &channels[..]].concat());
        assert_eq!(
            report["effects"],
            serde_json::json!(["quadratic-stiffness"])
        );
        let found = &report["constants"][0];
        let [hz, std] = ["after", "after_std"].map(|key| found[key].as_f64().unwrap());
        println!("{hz} ± {std} Hz, true 30");
        assert!((hz - 30.0).abs() < 3.5 * std && std < 0.05, "{hz} ± {std}");
    }
}
