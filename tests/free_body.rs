//! `diagnose` of a body without a spring, through the binary, on records simulated here.

use std::f64::consts::TAU;
use std::fmt::Write;

use crate::noise::Noise;
use crate::util::{Folder, table};

const RATE_HZ: f64 = 200.0;
const COLUMNS: [&str; 4] = ["--applied", "torque_n_m", "--measured", "angle_rad"];

/// Inertia in kg m², damping in N m s, dry friction in N m and stiffness in N m of a body.
struct Body {
    inertia: f64,
    damping: f64,
    friction: f64,
    stiffness: f64,
}

const DRIVE: Body = Body {
    inertia: 0.02,
    damping: 0.03,
    friction: 0.1,
    stiffness: 0.0,
};

impl Body {
    /// Torque and angle while a controller follows a sum of sines, with a constant load; 50 steps per sample, in each
    /// of which dry friction removes up to the whole speed.
    fn record(&self, count: usize, seed: u64) -> String {
        const STEPS: usize = 50;
        let h = 1.0 / (RATE_HZ * STEPS as f64);
        let wanted = |t: f64| {
            let line = |(a, hz): (f64, f64)| a * (TAU * hz * t + 0.7 * seed as f64).sin();
            [(0.9, 0.23), (0.5, 0.61), (0.2, 1.37)]
                .map(line)
                .iter()
                .sum::<f64>()
        };
        let mut noise = Noise(seed);
        let (mut angle, mut speed) = (wanted(0.0), 0.0_f64);
        let mut text = String::from("time_s,torque_n_m,angle_rad\n");
        for step in 0..count * STEPS {
            let t = step as f64 * h;
            let torque = 2.0 * (wanted(t) - angle) - 0.2 * speed;
            if step % STEPS == 0 {
                let seen = angle + 1e-5 * noise.normal();
                let _ = writeln!(text, "{t:.3},{torque:.9},{seen:.9}");
            }
            let others = torque - 0.04 - self.damping * speed - self.stiffness * angle;
            let free = speed + h * others / self.inertia;
            let most = h * self.friction / self.inertia;
            speed = free - free.clamp(-most, most);
            angle += h * speed;
        }
        text
    }
}

fn diagnosed(body: &Body) -> (Folder, serde_json::Value) {
    let folder = Folder::new();
    folder.write("train.csv", body.record(8000, 1));
    folder.write("holdout.csv", body.record(6000, 2));
    let args = [
        "diagnose",
        "--train",
        "train.csv",
        "--holdout",
        "holdout.csv",
    ];
    let report = folder.json(&[&args[..], &COLUMNS, &["-o", "refined.toml", "--json"]].concat());
    (folder, report)
}

/// The value of a constant, or of a parameter of the first candidate.
fn near(list: &serde_json::Value, name: &str, key: &str, truth: f64, part: f64) {
    let found = list.as_array().unwrap().iter().find(|c| c["name"] == name);
    let value = found.unwrap()[key].as_f64().unwrap();
    assert!(
        (value / truth - 1.0).abs() < part,
        "{name}: {value}, {truth}"
    );
}

#[test]
fn inertia_and_friction_of_a_free_body_are_found() {
    let (folder, report) = diagnosed(&DRIVE);
    assert_eq!(report["effects"], serde_json::json!(["coulomb-friction"]));
    near(&report["constants"], "inertia", "after", 0.02, 0.01);
    near(&report["constants"], "damping", "after", 0.03, 0.05);
    let best = &report["candidates"][0];
    near(&best["parameters"], "torque", "value", 0.1, 0.02);
    assert_eq!(best["parameters"][0]["unit"], "(N m)");
    let relative = |which: &str| report["error"][which]["holdout_relative"].as_f64().unwrap();
    assert!(
        relative("before") > 0.05 && relative("after") < 0.02,
        "{report}"
    );
    let codes = report["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|w| &w["code"]);
    assert!(codes.into_iter().any(|code| code == "free-body"));

    // The applied torque of the file, from the motion alone and except for the constant load.
    let args = [
        "compensate",
        "holdout.csv",
        "--stand",
        "refined.toml",
        "--channel",
        "angle_rad",
    ];
    let more = ["--band", "3", "-o", "torque.csv", "--quiet"];
    folder.run(&[&args[..], &more].concat()).says(0, &[]);
    let (_, found) = table(&folder.read("torque.csv"));
    let (_, truth) = table(&folder.read("holdout.csv"));
    let inner = 1000..5000;
    let left = inner
        .clone()
        .map(|i| (truth[i][1] - found[i][1] - 0.04).powi(2));
    let whole = inner.map(|i| truth[i][1].powi(2));
    let relative = (left.sum::<f64>() / whole.sum::<f64>()).sqrt();
    assert!(relative < 0.1, "{relative}");
}

#[test]
fn a_free_body_without_friction_lacks_nothing() {
    let (_, report) = diagnosed(&Body {
        friction: 0.0,
        ..DRIVE
    });
    assert_eq!(report["effects"], serde_json::json!([]));
    near(&report["constants"], "inertia", "after", 0.02, 0.01);
    near(&report["constants"], "damping", "after", 0.03, 0.02);
}

/// A stand with a spring whose record is too short is not a free body.
#[test]
fn a_short_record_of_a_stand_with_a_spring_is_refused() {
    let folder = Folder::new();
    let stand = Body {
        stiffness: 0.6,
        ..DRIVE
    };
    folder.write("train.csv", stand.record(1200, 1));
    let args = [&["diagnose", "--train", "train.csv"][..], &COLUMNS].concat();
    folder.run(&args).says(1, &["periods"]);
}
