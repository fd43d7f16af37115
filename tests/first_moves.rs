//! What a new user does first, with numbers that do not fit: never a wrong torque without a word.

use std::f64::consts::TAU;

use serde_json::Value;

use crate::util::{COMPENSATE, Folder, HARMONICS, assert_close, sampled};

/// A stand of 60 Hz with a calibration and what else its file says.
fn stand(more: &str) -> String {
    format!(
        "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"60 Hz\"\ndamping_ratio = 0.02\n{more}"
    )
}

/// Compensates a record of a slow torque beside a stand file.
fn compensated(stand: &str, heading: &str, level: f64) -> (Folder, Value) {
    let folder = Folder::new();
    folder.write("stand.toml", stand);
    let sample = |t: f64| level * (1.0 + 0.1 * (TAU * 5.0 * t).sin());
    folder.write("in.csv", over_time(heading, 1000.0, 2000, sample));
    let report = folder.json(&[&COMPENSATE[..], &["--json"]].concat());
    (folder, report)
}

/// A record of a function of time in s.
fn over_time(heading: &str, rate_hz: f64, count: usize, value: impl Fn(f64) -> f64) -> String {
    sampled(heading, rate_hz, count, |i| value(i as f64 / rate_hz))
}

fn codes(report: &Value) -> Vec<&str> {
    let warnings = report["warnings"].as_array().expect("warnings");
    warnings.iter().filter_map(|w| w["code"].as_str()).collect()
}

#[test]
fn the_uncertainty_of_the_zero_is_stated() {
    let calibration =
        "[calibration]\ntorque_per_volt = { value = \"12.5 N m/V\", std = \"0.0125 N m/V\" }\n";
    let zero = "[recorder]\nzero = { value = \"0.5 V\", std = \"0.2 V\" }\n";
    let (folder, report) = compensated(&stand(&format!("{calibration}{zero}")), "bridge_V", 2.0);
    // 0.2 V times 12.5 N m/V.
    assert_close(report["zero_std"].as_f64().expect("a number"), 2.5, 1e-9);
    folder
        .run(&[&COMPENSATE[..], &["--force"]].concat())
        .says(0, &["the zero adds 2.5 N m to every value"]);
}

#[test]
fn a_zero_of_another_quantity_is_said() {
    let of_volts = stand("[recorder]\nzero = \"0.5 V\"\n");
    let (_, report) = compensated(&of_volts, "T [N m]", 5.0);
    assert!(codes(&report).contains(&"zero-not-used"), "{report}");
}

#[test]
fn a_gain_below_any_amplifier_is_asked() {
    let folder = Folder::new();
    let calibration =
        "[calibration]\ntorque_per_ratio = \"25 N m/(mV/V)\"\n[bridge]\nexcitation = \"5 V\"\n";
    folder.write(
        "stand.toml",
        stand(&format!("{calibration}[recorder]\ngain = \"5 mV/V\"\n")),
    );
    folder.write("in.csv", over_time("u_V", 1000.0, 100, |t| t));
    folder
        .run(&COMPENSATE)
        .says(1, &["line", "gain", "below 0.01"]);
}

#[test]
fn microstrain_taken_for_strain_is_refused() {
    let folder = Folder::new();
    let beam = "[beam]\nwidth = \"20 mm\"\ndepth = \"5 mm\"\nlength = \"60 mm\"\nelastic_modulus = \"200 GPa\"\nradius = \
                \"80 mm\"\ngage_position = \"10 mm\"\n";
    folder.write("stand.toml", stand(beam));
    folder.write("in.csv", over_time("gage", 1000.0, 100, |t| 450.0 + t));
    let args = [&COMPENSATE[..], &["--unit", "strain"]].concat();
    folder.run(&args).says(1, &["line 2", "--unit ustrain"]);
}

#[test]
fn ringing_above_half_the_rate_is_said() {
    let (_, report) = compensated(&stand(""), "T [N m]", 5.0);
    assert!(!codes(&report).contains(&"resonance-above-nyquist"));
    let folder = Folder::new();
    folder.write("stand.toml", stand(""));
    folder.write(
        "in.csv",
        over_time("T [N m]", 100.0, 2000, |t| (TAU * 2.0 * t).sin()),
    );
    let report = folder.json(&[&COMPENSATE[..], &["--json"]].concat());
    assert!(
        codes(&report).contains(&"resonance-above-nyquist"),
        "{report}"
    );
}

#[test]
fn the_band_stays_below_the_rate_of_new_values() {
    let folder = Folder::new();
    folder.write("stand.toml", stand(""));
    // 100 values a second, each stored ten times.
    let held = |t: f64| (TAU * 3.0 * ((t * 1000.0).round() / 10.0).floor() / 100.0).sin();
    folder.write("in.csv", over_time("T [N m]", 1000.0, 4000, held));
    let report = folder.json(&[&COMPENSATE[..], &["--json"]].concat());
    assert!(
        report["band_hz"].as_f64().expect("a number") <= 20.0,
        "{report}"
    );
    assert_eq!(report["band"]["chosen_from"], "held-samples");
}

/// A tap on a stand of 180 Hz with a damping ratio of 0.02, beside hum: the hum is no mode, however strong it is.
#[test]
fn hum_is_not_taken_for_the_stand() {
    let omega = TAU * 180.0;
    let tap = |t: f64| match t {
        t if t < 0.2 => 0.0,
        t => {
            (-0.02 * omega * (t - 0.2)).exp() * (omega * (1.0_f64 - 4e-4).sqrt() * (t - 0.2)).sin()
        }
    };
    let mut noise = crate::noise::Noise(3);
    // The last one is too short to tell the mains from a mode by its frequency alone.
    for (size, count) in [(0.5, 10_000), (0.1, 10_000), (0.03, 10_000), (0.1, 4000)] {
        let folder = Folder::new();
        let noise = (0..count)
            .map(|_| 2e-3 * noise.normal())
            .collect::<Vec<f64>>();
        let sample = |t: f64| {
            tap(t) + size * (TAU * 50.02 * t + 0.3).sin() + noise[(t * 5000.0).round() as usize]
        };
        folder.write("tap.csv", over_time("bridge_V", 5000.0, count, sample));
        let report = folder.json(&["identify", "decay", "tap.csv", "--json"]);
        let of = |name: &str| {
            let all = report["parameters"].as_array().expect("parameters");
            let found = all.iter().find(|p| p["name"] == name);
            found.unwrap_or_else(|| panic!("{name} in {report}"))["value"]
                .as_f64()
                .expect("a number")
        };
        assert_close(of("natural_frequency"), 180.0, 1e-3);
        assert_close(of("damping_ratio"), 0.02, 0.03);
        assert!(codes(&report).contains(&"mains-taken-off"), "{report}");
        let hum = |t: f64| sample(t) - tap(t);
        folder.write("hum.csv", over_time("bridge_V", 5000.0, count, hum));
        folder
            .run(&["identify", "decay", "hum.csv"])
            .says(1, &["no decaying sine", "mains at 50.0"]);
    }
}

/// The speed of the nameplate is not that of the record: 30 Hz given, 29.7 Hz there.
#[test]
fn a_fundamental_beside_the_line_is_said() {
    let folder = Folder::new();
    folder.write("stand.toml", stand(""));
    let mut noise = crate::noise::Noise(5);
    let noise: Vec<f64> = (0..10_000).map(|_| 0.05 * noise.normal()).collect();
    let run = |actual_hz: f64, seconds: f64| {
        let torque = |t: f64| {
            let order = |n: f64, size: f64| size * (TAU * n * actual_hz * t + n).cos();
            5.0 + order(1.0, 1.0) + order(2.0, 0.5) + noise[(t * 1000.0).round() as usize]
        };
        let count = (seconds * 1000.0) as usize;
        folder.write("in.csv", over_time("T [N m]", 1000.0, count, torque));
        folder.json(&[&HARMONICS[..], &["30", "--orders", "1,2", "--json"]].concat())
    };
    for (actual_hz, seconds) in [(29.7, 2.0), (29.9, 10.0), (30.6, 2.0)] {
        let report = run(actual_hz, seconds);
        let warnings = report["warnings"].to_string();
        assert!(
            warnings.contains("fundamental-off"),
            "{actual_hz}: {warnings}"
        );
        assert!(warnings.contains("--refine"), "{warnings}");
    }
    for seconds in [2.0, 10.0] {
        let report = run(30.0, seconds);
        assert!(!codes(&report).contains(&"fundamental-off"), "{report}");
    }
}

/// Components of a steady speed under a load step are no change of speed; a speed that rises from 25 to 35 Hz is one.
#[test]
fn a_changing_speed_is_said_and_a_load_step_is_none() {
    let folder = Folder::new();
    folder.write("stand.toml", stand(""));
    let mut noise = crate::noise::Noise(5);
    let noise: Vec<f64> = (0..10_000).map(|_| 0.05 * noise.normal()).collect();
    let changes = |load: &dyn Fn(f64) -> f64, turns: &dyn Fn(f64) -> f64| {
        let torque = |t: f64| {
            let order = |n: f64, size: f64| size * (TAU * n * turns(t) + n).cos();
            load(t) + order(1.0, 1.0) + order(2.0, 0.5) + noise[(t * 1000.0).round() as usize]
        };
        folder.write("in.csv", over_time("T [N m]", 1000.0, 10_000, torque));
        let report = folder.json(&[&HARMONICS[..], &["30", "--orders", "1,2", "--json"]].concat());
        codes(&report).contains(&"speed-changes")
    };
    let steady = |t: f64| 30.0 * t;
    for at_s in [1.1, 4.7, 7.3] {
        for size in [5.0, -20.0] {
            let step = |t: f64| if t < at_s { 1.0 } else { size };
            assert!(!changes(&step, &steady), "{size} N m at {at_s} s");
        }
    }
    assert!(changes(&|_| 5.0, &|t| 25.0 * t + 0.5 * t * t));
    assert!(changes(&|_| 5.0, &|t| 30.0 * t + 0.005 * t * t));
}
