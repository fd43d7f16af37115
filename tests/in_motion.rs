//! Records that begin while the stand moves, integrated here: the free motion in them follows the law of the spring.

use std::f64::consts::TAU;

use serde_json::Value;

use crate::decays::parameter;
use crate::motion;
use crate::noise::Noise;
use crate::util::{Folder, number};

const NATURAL_HZ: f64 = 85.0;
const DAMPING_RATIO: f64 = 0.015;
const RATE_HZ: f64 = 2000.0;
const SAMPLES: usize = 4000;
const STEPS: usize = 16;
const NOISE: f64 = 0.01;
/// Level of the held-out record.
const LOWER: f64 = 0.6;

/// The torque of the spring beyond its linear one.
type Law = fn(f64) -> f64;

/// A folder with two records of thirty sines; the stand starts deflected by the torque at that moment, at rest.
fn records(law: impl Fn(f64) -> f64, seed: u64) -> Folder {
    let mut noise = Noise(seed);
    let lines: Vec<[f64; 2]> = (0..30)
        .map(|_| {
            let hz = 4.0 + 296.0 * noise.uniform();
            let near = if (hz - NATURAL_HZ).abs() < 8.0 {
                0.2
            } else {
                1.0
            };
            [TAU * hz, near * (0.2 + 0.4 * noise.uniform())]
        })
        .collect();
    let folder = Folder::new();
    for (name, level) in [("train.csv", 1.0), ("holdout.csv", LOWER)] {
        let phases: Vec<f64> = lines.iter().map(|_| TAU * noise.uniform()).collect();
        let torque = |t: f64| -> f64 {
            let waves = lines.iter().zip(&phases);
            waves
                .map(|([w, a], phase)| level * a * (w * t + phase).sin())
                .sum()
        };
        let omega = TAU * NATURAL_HZ;
        let slope = |t: f64, [x, v]: [f64; 2]| {
            [
                v,
                omega * omega * (torque(t) - x - law(x)) - 2.0 * DAMPING_RATIO * omega * v,
            ]
        };
        let h = 1.0 / (RATE_HZ * STEPS as f64);
        let mut state = [torque(0.0), 0.0];
        let mut text = "time_s,applied [N m],measured [N m]\n".to_owned();
        for i in 0..SAMPLES {
            let t = i as f64 / RATE_HZ;
            let seen = state[0] + NOISE * noise.normal();
            text += &format!("{t:.4},{:.9},{seen:.9}\n", torque(t));
            for k in 0..STEPS {
                state = motion::step(state, t + k as f64 * h, h, slope);
            }
        }
        folder.write(name, text);
    }
    folder
}

/// Diagnosis with a stand file of these constants, and an effect.
fn diagnosed(folder: &Folder, [natural_hz, damping_ratio]: [f64; 2], effect: &str) -> Value {
    let mechanics =
        format!("natural_frequency = \"{natural_hz} Hz\"\ndamping_ratio = {damping_ratio}\n");
    let stand = format!("schema = \"torqcomp.stand/1\"\n[mechanics]\n{mechanics}{effect}");
    folder.write("stand.toml", stand);
    let records = ["--train", "train.csv", "--holdout", "holdout.csv"];
    let channels = ["--applied", "applied", "--measured", "measured"];
    let args = ["diagnose", "--stand", "stand.toml", "--json"];
    folder.json(&[&args[..], &records, &channels].concat())
}

const NEAR: [f64; 2] = [80.0, 0.02];
const EXACT: [f64; 2] = [NATURAL_HZ, DAMPING_RATIO];

/// The free motion of the linear stand had been removed instead, which left up to twice the noise, with constants up to
/// 7 std off, or other effects.
#[test]
fn a_spring_that_stiffens_is_named() {
    let laws: [(&str, &str, &str, f64, Law); 2] = [
        (
            "cubic-stiffness",
            "coefficient = \"0.004 1/(N m)^2\"",
            "cubic",
            0.004,
            |x| 0.004 * x.powi(3),
        ),
        (
            "quadratic-stiffness",
            "form = \"odd\"\ncoefficient = \"0.02 1/(N m)\"",
            "odd",
            0.02,
            |x| 0.02 * x * x.abs(),
        ),
    ];
    for (name, keys, form, truth, law) in laws {
        for seed in [2, 3, 4] {
            let folder = records(law, seed);
            let report = diagnosed(&folder, NEAR, "");
            let named = (&report["effects"], &report["verdict"]);
            let said = format!("{form} {seed}: {named:?} {}", report["error"]);
            assert_eq!(report["effects"], serde_json::json!([name]), "{said}");
            assert_eq!(report["verdict"], "explained", "{said}");
            let [value, std] = parameter(&report, name, "coefficient");
            assert!((value - truth).abs() < 3.5 * std, "{said} {value} {std}");

            // The stand file that is right is as good after a fit as before it.
            let effect = format!("[[effects]]\nkind = \"{name}\"\n{keys}\n");
            let report = diagnosed(&folder, EXACT, &effect);
            assert_eq!(report["verdict"], "nothing-missing", "{form} {seed}");
            let [declared, after] =
                ["declared", "after"].map(|row| number(&report["error"][row]["train_rms"]));
            assert!(
                after < 1.001 * declared,
                "{form} {seed}: {declared} {after}"
            );
        }
    }
}

/// A stand to which nothing is added had been fitted with the free motion of the stand file's frequency, and any effect
/// that was fitted once more explained the rest.
#[test]
fn a_linear_stand_lacks_nothing() {
    for seed in 1..=8 {
        let report = diagnosed(&records(|_| 0.0, seed), NEAR, "");
        assert_eq!(
            report["verdict"], "nothing-missing",
            "{seed}: {}",
            report["error"]
        );
        let left = number(&report["error"]["before"]["train_rms"]);
        assert!((0.9..1.1).contains(&(left / NOISE)), "{seed}: {left}");
    }
}

/// The place of a single stop is not told from a constant load: it had been a pair of stops beside such a load, with a
/// std of 160000 N m.
#[test]
fn a_stop_on_one_side_has_a_place() {
    for (seed, gap) in [(1, 4.5), (3, 4.5), (5, 3.5)] {
        let report = diagnosed(&records(|x| 2.0 * (x - gap).max(0.0), seed), NEAR, "");
        let said = format!("{seed}: {} {}", report["effects"], report["candidates"][0]);
        assert_eq!(report["effects"], serde_json::json!(["end-stop"]), "{said}");
        assert_eq!(report["verdict"], "explained", "{said}");
        assert_eq!(report["candidates"][0]["form"], "above", "{said}");
        for (name, truth) in [("gap", gap), ("stiffness_ratio", 2.0)] {
            let [value, std] = parameter(&report, "end-stop", name);
            assert!((value - truth).abs() < 4.0 * std, "{said}");
            assert!(std < 0.05 * truth, "{said}");
        }
    }
}

/// They had been refused, with the advice to give them one unit, which made the hold-out record a thousand times larger.
#[test]
fn a_record_in_a_thousandth_of_the_unit_is_converted() {
    let folder = records(|x| 0.004 * x.powi(3), 2);
    let cells = |line: &str, factor: f64| {
        let numbers = line
            .split(',')
            .map(|cell| cell.parse::<f64>().expect("a number"));
        let [t, u, y] = numbers.collect::<Vec<_>>()[..] else {
            panic!("three columns: {line}");
        };
        format!("{t},{},{}\n", factor * u, factor * y)
    };
    let text = folder.read("holdout.csv");
    let rows: String = text.lines().skip(1).map(|line| cells(line, 1e3)).collect();
    folder.write(
        "holdout.csv",
        format!("time_s,applied [mN m],measured [mN m]\n{rows}"),
    );
    let report = diagnosed(&folder, NEAR, "");
    assert_eq!(
        report["effects"],
        serde_json::json!(["cubic-stiffness"]),
        "{report}"
    );
    let left = number(&report["error"]["after"]["holdout_rms"]);
    assert!((0.9..1.1).contains(&(left / NOISE)), "{left}");
}

/// Plateaus from rest of a linear stand with this response to a unit step, at each sample after it.
fn plateaus(response: &[f64], seed: u64) -> Folder {
    const PLATEAUS: usize = 25;
    let mut noise = Noise(seed);
    let folder = Folder::new();
    for (name, level) in [("train.csv", 1.0), ("holdout.csv", LOWER)] {
        let levels: [f64; PLATEAUS] =
            std::array::from_fn(|_| level * (4.0 * noise.uniform() - 2.0));
        let mut text = "time_s,applied [N m],measured [N m]\n".to_owned();
        for i in 0..SAMPLES {
            let last = i * PLATEAUS / SAMPLES;
            let seen = (0..=last).map(|k| {
                let before = k.checked_sub(1).map_or(0.0, |k| levels[k]);
                (levels[k] - before) * response[i - k * SAMPLES / PLATEAUS]
            });
            let seen = seen.sum::<f64>() + 0.5 * NOISE * noise.normal();
            let t = i as f64 / RATE_HZ;
            text += &format!("{t:.4},{:.9},{seen:.9}\n", levels[last]);
        }
        folder.write(name, text);
    }
    folder
}

/// Diagnosis of such plateaus of a stand with a second mode; returns its form.
fn second_mode(response: &[f64], seed: u64) -> String {
    let report = diagnosed(&plateaus(response, seed), NEAR, "");
    let named = (&report["effects"], &report["verdict"], &report["error"]);
    let expected = serde_json::json!(["second-mode"]);
    assert_eq!(report["effects"], expected, "{seed}: {named:?}");
    assert_eq!(report["verdict"], "explained", "{seed}: {named:?}");
    let after = number(&report["error"]["after"]["train_rms"]);
    assert!(after < 1.03 * 0.5 * NOISE, "{seed}: {named:?}");
    let candidates = report["candidates"].as_array().expect("candidates");
    let accepted = candidates.iter().find(|c| c["status"] == "accepted");
    let form = accepted.and_then(|c| c["form"].as_str());
    form.expect("an accepted form").to_owned()
}

/// A mode added to the stand also rings after the first plateau, which had been fitted as if it had lasted forever: up to
/// 26 times the noise was left. Its step response is `1 − e^(−ζωt) (cos ω_d t + ζω/ω_d sin ω_d t)`.
#[test]
fn a_second_mode_rings_from_the_start() {
    let step = |[hz, damping, share]: [f64; 3], t: f64| {
        let omega = TAU * hz;
        let turning = omega * (1.0 - damping * damping).sqrt();
        let (sine, cosine) = (turning * t).sin_cos();
        let swing = cosine + damping * omega / turning * sine;
        share * (1.0 - (-damping * omega * t).exp() * swing)
    };
    for (seed, second) in [(1, [27.0, 0.004, 0.05]), (2, [31.0, 0.008, -0.04])] {
        let first = [NATURAL_HZ, DAMPING_RATIO, 1.0 - second[2]];
        let response = (0..SAMPLES).map(|i| {
            let t = i as f64 / RATE_HZ;
            step(first, t) + step(second, t)
        });
        second_mode(&response.collect::<Vec<_>>(), seed);
    }
}

/// With an inertia coupled to the stand near its frequency, both modes are others than those of its parts; 6 times the
/// noise was left, with a natural frequency 5 % off.
#[test]
fn a_coupled_inertia_rings_from_the_start() {
    let omega = TAU * NATURAL_HZ;
    let [other, damping, ratio] = [TAU * 80.0, 0.006, 0.02];
    let slope = |_: f64, [x, v, y, w]: [f64; 4]| {
        let hung = -2.0 * damping * other * (w - v) - other * other * (y - x);
        let own = omega * omega * (1.0 - x) - 2.0 * DAMPING_RATIO * omega * v;
        [v, own - ratio * hung, w, hung]
    };
    let h = 1.0 / (RATE_HZ * STEPS as f64);
    let mut state = [0.0; 4];
    let response = (0..SAMPLES).map(|_| {
        let now = state[0];
        for _ in 0..STEPS {
            state = motion::step(state, 0.0, h, slope);
        }
        now
    });
    let form = second_mode(&response.collect::<Vec<_>>(), 3);
    assert_eq!(form, "coupled");
}
