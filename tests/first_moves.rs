//! First steps of a new user, with inconsistent numbers: never a wrong torque without a warning.

use std::f64::consts::TAU;

use serde_json::Value;

use crate::util::{COMPENSATE, Folder, HARMONICS, assert_close, codes, sampled, steady};

/// A stand of 60 Hz with a calibration and further entries.
fn stand(more: &str) -> String {
    format!(
        "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"60 Hz\"\ndamping_ratio = 0.02\n{more}"
    )
}

/// Compensates a record of a slow torque with a stand file.
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

/// The value of a constant that `identify` found.
fn constant(report: &Value, name: &str) -> f64 {
    let all = report["parameters"].as_array().expect("parameters");
    let found = all.iter().find(|p| p["name"] == name);
    let found = found.unwrap_or_else(|| panic!("{name} in {report}"));
    found["value"].as_f64().expect("a number")
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
        .says(0, &["the zero adds 2.5 N m, the same for every sample"]);
}

#[test]
fn a_zero_of_another_quantity_is_said() {
    let of_volts = stand("[recorder]\nzero = \"0.5 V\"\n");
    let (_, report) = compensated(&of_volts, "T [N m]", 5.0);
    assert!(codes(&report).contains(&"zero-not-used"), "{report}");
}

/// A load cell with a lever arm: the key of a torque, and its number.
#[test]
fn a_calibration_of_forces_is_answered_with_the_torque() {
    let folder = Folder::new();
    folder.write("in.csv", over_time("U [V]", 1000.0, 2000, |t| t));
    let arm = "lever_arm = \"0.5 m\"\n";
    for (form, says) in [
        (
            format!("force_per_volt = \"50 N/V\"\n{arm}"),
            "torque_per_volt = \"25 N m/V\"; omit lever_arm",
        ),
        (
            format!("torque_per_volt = \"50 N/V\"\n{arm}"),
            "torque_per_volt = \"25 N m/V\"; omit lever_arm",
        ),
        (
            "force_per_volt = \"50 N/V\"\n".to_owned(),
            "at 1 m it is torque_per_volt = \"50 N m/V\"",
        ),
        (
            format!("force_per_ratio = \"250 N/(mV/V)\"\n{arm}"),
            "torque_per_ratio = \"125 N m/(mV/V)\"",
        ),
        (
            format!("sensitivity = \"2 V\"\nrated_torque = \"500 N\"\n{arm}"),
            "rated_torque = \"250 N m\"; omit lever_arm",
        ),
        (
            format!("sensitivity = \"2 V\"\nrated_force = \"500 N\"\n{arm}"),
            "rated_torque = \"250 N m\"; omit lever_arm",
        ),
    ] {
        folder.write("stand.toml", stand(&format!("[calibration]\n{form}")));
        folder.run(&COMPENSATE).says(1, &[says]);
    }
    let right = "[calibration]\nsensitivity = \"2 V\"\nrated_torque = \"250 N m\"\n";
    folder.write("stand.toml", stand(right));
    folder.run(&COMPENSATE).says(0, &[]);
}

/// Two sensors of one logger that write their rows in turn, without a column that names them.
#[test]
fn two_sensors_in_turn_are_said() {
    let one = |t: f64| 2.0 + (20.0 * t).sin();
    let other = |t: f64| 2.0 + 0.9 * (33.0 * t + 1.0).sin();
    let ripple = |t: f64| 0.3 * (TAU * 400.0 * t).sin();
    let folder = Folder::new();
    folder.write("stand.toml", stand(""));
    let is_said = |value: fn(&[f64; 3], usize) -> f64| {
        let row = |i: usize| {
            let t = i as f64 / 1000.0;
            let noise = 1e-3 * ((i * 7919 % 101) as f64 / 50.0 - 1.0);
            value(&[one(t), other(t), ripple(t)], i) + noise
        };
        folder.write("in.csv", sampled("T [N m]", 1000.0, 4000, row));
        let report = folder.json(&[&COMPENSATE[..], &["--json", "--force"]].concat());
        codes(&report).contains(&"two-signals")
    };
    assert!(is_said(|signals, i| signals[i % 2]));
    assert!(!is_said(|signals, _| signals[0]));
    assert!(!is_said(|signals, _| signals[0] + signals[2]));
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
    // 100 values per second, each stored ten times.
    let held = |t: f64| (TAU * 3.0 * ((t * 1000.0).round() / 10.0).floor() / 100.0).sin();
    folder.write("in.csv", over_time("T [N m]", 1000.0, 4000, held));
    let report = folder.json(&[&COMPENSATE[..], &["--json"]].concat());
    assert!(
        report["band_hz"].as_f64().expect("a number") <= 20.0,
        "{report}"
    );
    assert_eq!(report["band"]["chosen_from"], "held-samples");
}

/// A tap on a stand of 180 Hz with a damping ratio of 0.02, with hum: the hum is not a mode, however strong it
/// is.
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
    // The last one is too short to distinguish the mains from a mode by its frequency alone.
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
        assert_close(constant(&report, "natural_frequency"), 180.0, 1e-3);
        assert_close(constant(&report, "damping_ratio"), 0.02, 0.03);
        assert!(codes(&report).contains(&"mains-taken-off"), "{report}");
        let hum = |t: f64| sample(t) - tap(t);
        folder.write("hum.csv", over_time("bridge_V", 5000.0, count, hum));
        folder
            .run(&["identify", "decay", "hum.csv"])
            .says(1, &["no decaying sine", "mains at 50.0"]);
    }
}

/// The speed of the nameplate is not that of the record: 30 Hz given, 29.7 Hz recorded.
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
    // Beyond the default span of --refine, the advice must be one that works.
    let report = run(29.1, 2.0);
    let advice = "--refine --refine-span 5";
    assert!(report["warnings"].to_string().contains(advice), "{report}");
    let refine = |more: &str| {
        let orders = ["30", "--orders", "1,2"].iter().copied();
        let all = orders.chain(more.split(' ')).collect::<Vec<_>>();
        folder.run(&[&HARMONICS[..], &all].concat())
    };
    refine("--refine").says(1, &["--refine-span searches beyond 2 %"]);
    let refined = refine(advice);
    assert!(refined.stdout.contains("29.1"), "{}", refined.stdout);
    for seconds in [2.0, 10.0] {
        let report = run(30.0, seconds);
        assert!(!codes(&report).contains(&"fundamental-off"), "{report}");
    }
}

/// Steady speed under a load step is not a change of speed; a rise from 25 to 35 Hz is one.
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

/// The first cycles of a decay are beyond the recorder's range: the rest has the frequency and the damping, with noise
/// and without, where only the digits of the file remain.
#[test]
fn a_clipped_decay_is_fitted_behind_its_last_clipped_sample() {
    let folder = Folder::new();
    let omega = TAU * 590.0;
    let decay = |t: f64| match t {
        t if t < 0.2 => 0.0,
        t => {
            (-0.01 * omega * (t - 0.2)).exp() * (omega * (1.0_f64 - 1e-4).sqrt() * (t - 0.2)).sin()
        }
    };
    for size in [5e-3, 0.0] {
        let mut noise = crate::noise::Noise(7);
        let rows = (0..16_000).map(|i| {
            let value = decay(f64::from(i) / 8000.0) + size * noise.normal();
            format!("{},{:.5e}\n", f64::from(i) / 8000.0, value.clamp(-0.5, 0.5))
        });
        let rows: String = rows.collect();
        folder.write("tap.csv", format!("time_s,bridge_V\n{rows}"));
        let report = folder.json(&["identify", "decay", "tap.csv", "--json"]);
        assert!(codes(&report).contains(&"clipped"), "{report}");
        // Several modes would be numbered.
        assert_close(constant(&report, "natural_frequency"), 590.0, 1e-4);
        assert_close(constant(&report, "damping_ratio"), 0.01, 0.01);
    }
}

/// A torque with the wrong sign, or in mN m under a heading in N m, is not an effect of the stand.
#[test]
fn a_wrong_sign_or_unit_is_no_effect() {
    let folder = Folder::new();
    folder.write(
        "stand.toml",
        "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"590 Hz\"\ndamping_ratio = 0.07\n",
    );
    let parts: Vec<(f64, f64, f64)> = (1..150)
        .map(|k| (0.05, 7.0 * f64::from(k), f64::from(k * k)))
        .collect();
    let (shown, acted) = steady(&parts, 8000.0, 8000);
    let mut noise = crate::noise::Noise(9);
    let noise: Vec<f64> = shown.iter().map(|_| 2e-3 * noise.normal()).collect();
    let diagnose = |factor: f64| {
        let pair = |i: usize| format!("{},{}", acted[i], factor * (shown[i] + noise[i]));
        let rows: String = (0..8000)
            .map(|i| format!("{},{}\n", i as f64 / 8000.0, pair(i)))
            .collect();
        folder.write("in.csv", format!("time_s,T [N m],M [N m]\n{rows}"));
        let stand = ["diagnose", "--stand", "stand.toml", "--train", "in.csv"];
        folder.run(&[&stand[..], &["--applied", "T", "--measured", "M"]].concat())
    };
    diagnose(-1.0).says(1, &["of the opposite sign", "change the sign"]);
    diagnose(1000.0).says(1, &["is 1000 times", "check the unit"]);
    diagnose(1e-3).says(1, &["is 0.001 times", "check the unit"]);
    assert!(diagnose(1.0).stdout.starts_with("verdict: nothing-missing"));
}

/// A data sheet gives 0.5 % of 12.5 N m/V; 2 % for a damping ratio of 0.02 is ambiguous.
#[test]
fn uncertainties_in_percent_are_of_the_value() {
    let folder = Folder::new();
    let std_of = |std: &str| {
        let more = format!(
            "[calibration]\ntorque_per_volt = {{ value = \"12.5 N m/V\", std = \"{std}\" }}\n"
        );
        folder.write("stand.toml", stand(&more));
        folder.write(
            "in.csv",
            over_time("bridge_V", 1000.0, 2000, |t| (TAU * t).sin()),
        );
        let report = folder.json(&[&COMPENSATE[..], &["--force", "--json"]].concat());
        report["calibration_relative_std"]
            .as_f64()
            .expect("a number")
    };
    assert_close(std_of("0.5 %"), 0.005, 1e-12);
    assert_close(std_of("0.0625 N m/V"), 0.005, 1e-12);
    let ambiguous = "damping_ratio = { value = 0.02, std = \"2 %\" }";
    folder.write(
        "stand.toml",
        stand("").replace("damping_ratio = 0.02", ambiguous),
    );
    folder
        .run(&["table", "--stand", "stand.toml"])
        .says(1, &["line 4", "write \"0.0004\"", "or \"0.02\""]);
}

/// A ripple of 2 mV at 1600 Hz on a stand of 60 Hz would correspond to 710 times the static torque: torque or a
/// converter's interference?
#[test]
fn a_line_that_alone_decides_the_band_is_asked_about() {
    let folder = Folder::new();
    let calibration = "[calibration]\ntorque_per_volt = \"12.5 N m/V\"\n";
    folder.write("stand.toml", stand(calibration));
    let run = |ripple: f64, more: &[&str]| {
        let mut noise = crate::noise::Noise(13);
        let noise: Vec<f64> = (0..15_000).map(|_| 2e-4 * noise.normal()).collect();
        let volts = |t: f64| {
            let slow = 0.8 + 0.2 * (TAU * 7.0 * t).sin() + 0.05 * (TAU * 21.0 * t).cos();
            slow + ripple * (TAU * 1600.0 * t).sin() + noise[(t * 5000.0).round() as usize]
        };
        folder.write("in.csv", over_time("bridge_V", 5000.0, 15_000, volts));
        folder.json(&[&COMPENSATE[..], &["--force", "--json"], more].concat())
    };
    let message = |report: &Value| report["warnings"].to_string();
    let asked = run(2e-3, &[]);
    assert!(codes(&asked).contains(&"lines-decide-band"), "{asked}");
    // 2 mV · 12.5 N m/V/√2 · (1600² / 60² − 1).
    let torque = 2e-3 * 12.5 / 2.0_f64.sqrt() * ((1600.0_f64 / 60.0).powi(2) - 1.0);
    let result = asked["result"]["rms"].as_f64().expect("a number");
    assert_close(result, torque, 0.05);
    let text = message(&asked);
    let (_, band) = text.split_once("give --band ").expect("a band");
    let digits = band.chars().take_while(|c| c.is_ascii_digit() || *c == '.');
    let band: String = digits.collect();
    // As advised: nothing of the ripple remains.
    let without = run(2e-3, &["--band", &band]);
    assert!(codes(&without).is_empty(), "{without}");
    let slow = 12.5 * 0.5_f64.sqrt() * 0.2_f64.hypot(0.05);
    assert_close(
        without["result"]["rms"].as_f64().expect("a number"),
        slow,
        0.02,
    );
    // Far more than that is most likely a mistake.
    assert!(codes(&run(0.1, &[])).contains(&"mostly-amplified"));
    let plain = run(0.0, &[]);
    assert!(codes(&plain).is_empty(), "{plain}");
}

/// Interference with many lines, or with a frequency that varies, far above the torque: a carrier with sidebands, and
/// one that jumps at random.
#[test]
fn interference_of_many_lines_is_asked_about() {
    let folder = Folder::new();
    let calibration = "[calibration]\ntorque_per_volt = \"12.5 N m/V\"\n";
    folder.write("stand.toml", stand(calibration));
    let sidebands = |t: f64| {
        let line = |k: i32| (TAU * (1600.0 + 21.3 * f64::from(k)) * t + f64::from(k * k)).sin();
        (-8..=8).map(line).sum::<f64>()
    };
    let mut noise = crate::noise::Noise(14);
    let (mut phase, mut jumping) = (0.0_f64, Vec::new());
    for i in 0..15_000 {
        if i % 7 == 0 {
            phase += noise.normal();
        }
        phase += TAU * 1600.0 / 5000.0;
        jumping.push(3.0 * phase.sin());
    }
    for interference in 0..2 {
        let noise: Vec<f64> = (0..15_000).map(|_| 2e-4 * noise.normal()).collect();
        let volts = |i: usize| {
            let t = i as f64 / 5000.0;
            let beside = [sidebands(t), jumping[i]][interference];
            0.8 + 0.2 * (TAU * 7.0 * t).sin() + 1e-3 * beside + noise[i]
        };
        folder.write("in.csv", sampled("bridge_V", 5000.0, 15_000, volts));
        let report = folder.json(&[&COMPENSATE[..], &["--force", "--json"]].concat());
        assert!(codes(&report).contains(&"lines-decide-band"), "{report}");
    }
}

/// The zero is that of another record, or mV read as V.
#[test]
fn a_zero_far_from_the_record_is_said() {
    let with = |zero: &str, heading: &str, level: f64, rated: &str| {
        let calibration = format!("[calibration]\ntorque_per_volt = \"12.5 N m/V\"\n{rated}");
        let zero = format!("[recorder]\nzero = \"{zero}\"\n");
        let (_, report) = compensated(&stand(&format!("{calibration}{zero}")), heading, level);
        codes(&report)
            .into_iter()
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    let far = "zero-far-from-record".to_owned();
    assert!(with("5 V", "bridge_V", 0.01, "").contains(&far));
    // A large load with a small zero, and a live zero.
    assert!(!with("0.01 V", "bridge_V", 5.0, "").contains(&far));
    assert!(!with("5 V", "bridge_V", 1.0, "").contains(&far));
    assert!(!with("0 V", "bridge_V", 0.01, "").contains(&far));
    let unusual = "volts-unusual".to_owned();
    assert!(with("0 V", "bridge_V", 450.0, "").contains(&unusual));
    assert!(!with("0 V", "bridge_mV", 450.0, "").contains(&unusual));
    assert!(!with("0 V", "bridge_V", 9.0, "").contains(&unusual));
}

#[test]
fn harmonics_say_a_zero_far_from_the_record() {
    let folder = Folder::new();
    let calibration =
        "[calibration]\ntorque_per_volt = \"12.5 N m/V\"\n[recorder]\nzero = \"5 V\"\n";
    folder.write("stand.toml", stand(calibration));
    let volts = |t: f64| 0.01 + 0.02 * (TAU * 20.0 * t).sin();
    folder.write("in.csv", over_time("bridge_V", 1000.0, 4000, volts));
    let report = folder.json(&[&HARMONICS[..], &["20", "--orders", "1", "--json"]].concat());
    assert!(codes(&report).contains(&"zero-far-from-record"), "{report}");
}

/// Constant speed with a load step; and a fundamental far from the line.
#[test]
fn a_load_step_and_a_far_fundamental_are_said() {
    let folder = Folder::new();
    folder.write("stand.toml", stand(""));
    let mut noise = crate::noise::Noise(21);
    let noise: Vec<f64> = (0..10_000).map(|_| 0.05 * noise.normal()).collect();
    let run = |load: &dyn Fn(f64) -> f64, actual_hz: f64, given: &str| {
        let torque = |t: f64| {
            let order = |n: f64, size: f64| size * (TAU * n * actual_hz * t + n).cos();
            load(t) + order(1.0, 1.0) + order(2.0, 0.5) + noise[(t * 1000.0).round() as usize]
        };
        folder.write("in.csv", over_time("T [N m]", 1000.0, 10_000, torque));
        folder.json(&[&HARMONICS[..], &[given, "--orders", "1,2", "--json"]].concat())
    };
    for at_s in [2.3, 5.0, 8.1] {
        let report = run(&|t| if t < at_s { 2.0 } else { 6.0 }, 30.0, "30");
        assert!(codes(&report).contains(&"load-changes"), "{report}");
    }
    let steady = run(&|_| 5.0, 30.0, "30");
    assert!(!codes(&steady).contains(&"load-changes"), "{steady}");
    // A component below the fundamental is not a change of load.
    let slow = run(&|t| 5.0 + 2.0 * (TAU * 11.3 * t).sin(), 30.0, "30");
    assert!(!codes(&slow).contains(&"load-changes"), "{slow}");
    let far = run(&|_| 5.0, 16.6, "17.6");
    assert!(codes(&far).contains(&"fundamental-off"), "{far}");
    assert!(
        far["warnings"].to_string().contains("--refine-span 15"),
        "{far}"
    );
}

/// A logger wrote each row twice, or repeated a block.
#[test]
fn rows_written_twice_are_named() {
    let folder = Folder::new();
    folder.write("stand.toml", stand(""));
    let row = |i: usize| {
        let t = i as f64 / 1000.0;
        format!("{t:.3},{:.6}\n", 2.0 + (TAU * 5.0 * t).sin())
    };
    let each: String = (0..2000).map(|i| row(i).repeat(2)).collect();
    folder.write("in.csv", format!("time_s,T [N m]\n{each}"));
    let said = "every row was written 2 times";
    folder.run(&COMPENSATE).says(0, &[said]);
    let inspected = folder.json(&["inspect", "in.csv", "--json"]);
    assert!(
        inspected["warnings"].to_string().contains(said),
        "{inspected}"
    );
    let block: String = (0..1500).chain(1000..2000).map(row).collect();
    folder.write("in.csv", format!("time_s,T [N m]\n{block}"));
    folder
        .run(&[&COMPENSATE[..], &["--force"]].concat())
        .says(1, &["line 1502", "rows were written twice"]);
}

/// The applied channel is late or early, or on another clock; a stand of 590 Hz, driven by 200 sines of all
/// frequencies.
#[test]
fn an_applied_channel_of_another_time_is_no_effect() {
    let folder = Folder::new();
    let (natural_hz, ratio, rate_hz, count) = (590.0, 0.01, 10_000.0, 8000_usize);
    folder.write(
        "stand.toml",
        format!("schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"{natural_hz} Hz\"\ndamping_ratio = {ratio}\n"),
    );
    let mut noise = crate::noise::Noise(17);
    let parts: Vec<(f64, f64)> = (1..=200)
        .map(|k| {
            (
                8.5 * (f64::from(k) + 0.6 * noise.uniform()),
                TAU * noise.uniform(),
            )
        })
        .collect();
    let answer = |t: f64| {
        let one = |(hz, phase): &(f64, f64)| {
            let x = hz / natural_hz;
            let (real, imaginary) = (1.0 - x * x, 2.0 * ratio * x);
            (TAU * hz * t + phase - imaginary.atan2(real)).cos() / real.hypot(imaginary)
        };
        parts.iter().map(one).sum::<f64>()
    };
    let measured: Vec<f64> = (0..count)
        .map(|i| answer(i as f64 / rate_hz) + 0.3 * noise.normal())
        .collect();
    let diagnose = |late_s: f64, clock: f64| {
        let row = |i: usize| {
            let t = i as f64 / rate_hz;
            let at = t * clock - late_s;
            let applied: f64 = parts.iter().map(|(hz, p)| (TAU * hz * at + p).cos()).sum();
            format!("{t},{applied:.6},{:.6}\n", measured[i])
        };
        let rows: String = (0..count).map(row).collect();
        folder.write("in.csv", format!("time_s,T [N m],M [N m]\n{rows}"));
        let stand = ["diagnose", "--stand", "stand.toml", "--train", "in.csv"];
        folder.run(&[&stand[..], &["--applied", "T", "--measured", "M"]].concat())
    };
    // Rejected if the error is large, otherwise a warning.
    let says = |ran: crate::util::Ran, words: &[&str]| {
        for word in words {
            assert!(ran.stderr.contains(word), "{word}: {ran:?}");
        }
        assert!(!ran.stdout.contains("verdict: explained"), "{ran:?}");
    };
    for late in [0.5e-4, 3e-4, 1e-3] {
        says(diagnose(late, 1.0), &["the applied channel lags by", "ms"]);
    }
    says(diagnose(0.0, 1.0005), &["different clocks", "ppm"]);
    let early = diagnose(-3e-4, 1.0);
    assert!(early.stdout.contains("time-delay"), "{early:?}");
}

/// The load starts after a second, and clips the record: 5000 samples in.
#[test]
fn what_happens_later_in_a_record_is_seen() {
    let folder = Folder::new();
    folder.write(
        "stand.toml",
        stand("[calibration]\ntorque_per_volt = \"12.5 N m/V\"\n"),
    );
    let load = |t: f64| if t < 1.0 { 0.1 } else { 1.0 };
    let volts = |t: f64| (load(t) * (TAU * 7.0 * t).sin()).min(0.7);
    folder.write("in.csv", over_time("bridge_V", 5000.0, 15_000, volts));
    let report = folder.json(&[&COMPENSATE[..], &["--json"]].concat());
    assert!(codes(&report).contains(&"clipped"), "{report}");
    assert_eq!(report["looked_at"], 15_000);
    folder.write("in.csv", over_time("bridge_V", 5000.0, 70_000, volts));
    let ran = folder.run(&[&COMPENSATE[..], &["--force"]].concat());
    ran.says(0, &["in the first 65536 samples"]);
}

/// A cable that drops out late in a long record, whichever way the record is read.
#[test]
fn a_drop_out_is_found_behind_the_first_samples() {
    let folder = Folder::new();
    folder.write("stand.toml", stand(""));
    let mut noise = crate::noise::Noise(11);
    let mut sample = |i: usize| match i {
        150_000..150_009 => 0.0,
        _ => 5.0 + (TAU * 0.005 * i as f64).sin() + 0.01 * noise.normal(),
    };
    let rows: Vec<f64> = (0..300_000).map(&mut sample).collect();
    folder.write("in.csv", sampled("T [N m]", 1000.0, 300_000, |i| rows[i]));
    for more in [
        &["--threads", "1"][..],
        &["--threads", "2"],
        &["--whole-record"],
    ] {
        let report = folder.json(&[&COMPENSATE[..], more, &["--force", "--json"]].concat());
        let warnings = report["warnings"].to_string();
        let longest = "the longest is 9 samples at 0 N m, starting at 150 s";
        assert!(warnings.contains(longest), "{warnings}");
    }
    let report = folder.json(&[&HARMONICS[..], &["5", "--orders", "1", "--json"]].concat());
    assert!(codes(&report).contains(&"stuck-channel"), "{report}");
}

/// The stand rings at 59 Hz, its file says 45 Hz.
#[test]
fn ringing_at_another_frequency_than_the_declared_one_is_said() {
    let mut noise = crate::noise::Noise(12);
    let omega = TAU * 59.0;
    let ring = |t: f64| (-0.02 * omega * t).exp() * (omega * t).sin();
    let noise: Vec<f64> = (0..40_000).map(|_| 1e-3 * noise.normal()).collect();
    let sample = |i: usize| 2.0 + ring((i as f64 * 1e-3) % 1.7) + noise[i];
    let folder = Folder::new();
    folder.write("in.csv", sampled("T [N m]", 1000.0, 40_000, sample));
    for (declared_hz, is_said) in [(45.0, true), (52.0, true), (58.5, false), (59.0, false)] {
        let stand = stand("").replace("60 Hz", &format!("{declared_hz} Hz"));
        folder.write("stand.toml", stand);
        let report = folder.json(&[&COMPENSATE[..], &["--json", "--force"]].concat());
        let warnings = report["warnings"].to_string();
        assert_eq!(
            warnings.contains("resonance-elsewhere"),
            is_said,
            "{warnings}"
        );
    }
}

/// Half a second with two steps that ring at 590 Hz, and a natural frequency in rad/s, of another decade, or right.
#[test]
fn ringing_far_from_the_declared_frequency_is_said() {
    let mut noise = crate::noise::Noise(31);
    let omega = TAU * 590.0;
    let step = |t: f64| match t < 0.0 {
        true => 0.0,
        false => 1.0 - (-0.02 * omega * t).exp() * (omega * t).cos(),
    };
    let noise: Vec<f64> = (0..5000).map(|_| 2e-3 * noise.normal()).collect();
    let torque =
        |t: f64| 5.0 + 2.0 * step(t - 0.05) - 3.0 * step(t - 0.28) + 0.3 * (TAU * 47.0 * t).sin();
    let folder = Folder::new();
    let sample = |i: usize| torque(i as f64 * 1e-4) + noise[i];
    folder.write("in.csv", sampled("T [N m]", 10_000.0, 5000, sample));
    for (declared, said) in [
        ("3707.1 Hz", Some("2 pi times as high")),
        ("93.9 Hz", Some("2 pi times as low")),
        ("1180 Hz", Some("resonance at 5")),
        ("300 Hz", Some("resonance at 5")),
        ("590 Hz", None),
    ] {
        folder.write("stand.toml", stand("").replace("60 Hz", declared));
        let report = folder.json(&[&COMPENSATE[..], &["--json", "--force"]].concat());
        let warnings = report["warnings"].to_string();
        let is_said = warnings.contains("resonance-elsewhere");
        assert_eq!(is_said, said.is_some(), "{declared}: {warnings}");
        assert!(
            said.is_none_or(|said| warnings.contains(said)),
            "{declared}: {warnings}"
        );
    }
}

/// Two hundred samples far above their noise, shorter than the filter.
#[test]
fn a_short_record_is_called_short() {
    let folder = Folder::new();
    folder.write("stand.toml", stand("").replace("60 Hz", "590 Hz"));
    let torque = |t: f64| 9.0 + 0.5 * (TAU * 120.0 * t).sin();
    folder.write("in.csv", over_time("T [N m]", 10_000.0, 200, torque));
    let ran = folder.run(&COMPENSATE);
    ran.says(0, &["too short to estimate its noise", "short-record"]);
    assert!(!ran.stderr.contains("below the noise"), "{}", ran.stderr);
}

/// The output of a transducer as its data sheet has it.
#[test]
fn ranges_of_data_sheets_are_explained() {
    let folder = Folder::new();
    let init = ["init", "--from", "transducer", "-o", "-", "--rated-torque"];
    for (output, torque, said) in [
        ("4-20 mA", "50 Nm", "\"16 mA\" and --zero \"4 mA\""),
        ("±5 V", "50 Nm", "--sensitivity: "),
        ("5 V", "±50 Nm", "--rated-torque: "),
    ] {
        let ran = folder.run(&[&init[..], &[torque, "--sensitivity", output]].concat());
        ran.says(2, &["is a range", said]);
    }
}

/// A mass of 2 kg under a force of two sines, with the motor current recorded in mA: a factor per A, per mA, and one
/// for another quantity.
#[test]
fn a_torque_factor_is_in_a_unit_of_its_own() {
    let folder = Folder::new();
    let sines = [(20.0, 5.0), (9.0, 12.0)];
    let mut text = String::from("time [s],position [m],current [mA]\n");
    for i in 0..8000 {
        let t = f64::from(i) / 1000.0;
        let force: f64 = sines.iter().map(|(f, w)| f * (w * t).sin()).sum();
        let at: f64 = sines
            .iter()
            .map(|(f, w)| -f * (w * t).sin() / (2.0 * w * w))
            .sum();
        text += &format!("{t:.3},{at:.9},{:.6}\n", 100.0 * force);
    }
    folder.write("run.csv", text);
    let runup = "identify runup run.csv --motion position --torque current --torque-factor";
    let args: Vec<&str> = runup.split(' ').collect();
    for factor in ["10 N/A", "0.01 N/mA"] {
        let report = folder.json(&[&args[..], &[factor, "--json"]].concat());
        assert_close(constant(&report, "mass"), 2.0, 2e-3);
    }
    let ran = folder.run(&[&args[..], &["10 N/V"]].concat());
    ran.says(1, &["10 N/V", "mA"]);
}

/// A stand file from a diagnosis without an explanation.
#[test]
fn an_unexplained_diagnosis_is_said_where_its_file_is_used() {
    for (verdict, count) in [
        ("unexplained", 1),
        ("partly-explained", 1),
        ("explained", 0),
    ] {
        let (_, report) = compensated(
            &stand(&format!("[diagnosed]\nverdict = \"{verdict}\"\n")),
            "torque [N m]",
            1.0,
        );
        let said = codes(&report);
        let found = said.iter().filter(|code| **code == "diagnosis-incomplete");
        assert_eq!(found.count(), count, "{verdict}: {said:?}");
    }
}

/// A missing-value marker, after the samples that are examined more closely.
#[test]
fn a_mark_for_no_value_is_said_wherever_it_is() {
    let folder = Folder::new();
    folder.write("stand.toml", stand(""));
    let mut noise = crate::noise::Noise(13);
    let mut sample = |i: usize| match i {
        196_607 => -9999.0,
        _ => 5.0 + (TAU * 0.005 * i as f64).sin() + 0.01 * noise.normal(),
    };
    let rows: Vec<f64> = (0..300_000).map(&mut sample).collect();
    folder.write("in.csv", sampled("T [N m]", 1000.0, 300_000, |i| rows[i]));
    for more in [&[][..], &["--whole-record"]] {
        let report = folder.json(&[&COMPENSATE[..], more, &["--force", "--json"]].concat());
        let warnings = report["warnings"].to_string();
        assert!(warnings.contains("one isolated sample"), "{warnings}");
        assert!(warnings.contains("196.607 s"), "{warnings}");
    }
}

/// Samples of a stand of 180 Hz with a damping ratio of 0.02, with a static gain of 1.
fn resonator(rate_hz: f64) -> impl FnMut(f64) -> f64 {
    let omega = TAU * 180.0 / rate_hz;
    let (fall, cos) = (
        (-0.02 * omega).exp(),
        (omega * (1.0_f64 - 4e-4).sqrt()).cos(),
    );
    let (a, b) = (2.0 * fall * cos, -fall * fall);
    let mut shown = [0.0; 2];
    move |torque| {
        let next = (1.0 - a - b) * torque + a * shown[0] + b * shown[1];
        shown = [next, shown[0]];
        next
    }
}

/// A torque without order through a stand of 180 Hz, whose file says another natural frequency or damping ratio.
#[test]
fn a_record_of_little_but_another_resonance_is_said() {
    let mut noise = crate::noise::Noise(7);
    let mut respond = resonator(5000.0);
    let motion: Vec<f64> = (0..50_000).map(|_| 3.0 + respond(noise.normal())).collect();
    let folder = Folder::new();
    folder.write("in.csv", sampled("T [N m]", 5000.0, 50_000, |i| motion[i]));
    for (hz, ratio, said) in [
        (
            1131.0,
            0.02,
            Some(("resonance-elsewhere", "2 pi times as high")),
        ),
        (
            28.65,
            0.02,
            Some(("resonance-elsewhere", "2 pi times as low")),
        ),
        (150.0, 0.02, Some(("resonance-elsewhere", "180 Hz"))),
        (180.0, 0.2, Some(("damping-differs", "about 0.02, 0.2 in"))),
        (
            180.0,
            0.002,
            Some(("damping-differs", "about 0.02, 0.002 in")),
        ),
        (180.0, 0.02, None),
        (181.0, 0.025, None),
    ] {
        let stand = stand("").replace("60 Hz", &format!("{hz} Hz"));
        let stand = stand.replace("ratio = 0.02", &format!("ratio = {ratio}"));
        folder.write("stand.toml", stand);
        let report = folder.json(&[&COMPENSATE[..], &["--json", "--force"]].concat());
        let warnings = report["warnings"].to_string();
        match said {
            Some((code, text)) => assert!(
                codes(&report).contains(&code) && warnings.contains(text),
                "{hz} {ratio}: {warnings}"
            ),
            None => assert!(
                !warnings.contains("resonance-elsewhere") && !warnings.contains("damping-differs"),
                "{hz} {ratio}: {warnings}"
            ),
        }
    }
}

/// Amplifiers with an output below zero at no load, or that invert.
#[test]
fn negative_zeros_and_gains_are_taken() {
    let folder = Folder::new();
    let init = ["init", "--from", "transducer", "--sensitivity", "2 mV/V"];
    let more = ["--rated-torque", "50 N m", "--natural-frequency", "590 Hz"];
    let zero = [
        "--damping-ratio",
        "0.02",
        "--zero",
        "-0.05 mV/V",
        "-o",
        "s.toml",
    ];
    let run = folder.run(&[&init[..], &more, &zero].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(folder.read("s.toml").contains("-0.05 mV/V"));
    let gain = [
        &zero[..2],
        &["--gain", "-200", "--excitation", "5 V", "-o", "t.toml"],
    ]
    .concat();
    let run = folder.run(&[&init[..], &more, &gain].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(folder.read("t.toml").contains("gain = \"-200\""));
}

/// Hits that calibrate an amplifier which rests at 0.05 V: that is no torque.
#[test]
fn hits_give_the_zero_with_the_calibration() {
    let mut noise = crate::noise::Noise(19);
    let mut respond = resonator(10_000.0);
    let row = |i: usize| {
        let hit = match (i + 5000) % 10_000 {
            phase @ 0..12 => 20.0 * (0.5 * TAU * phase as f64 / 12.0).sin(),
            _ => 0.0,
        };
        let shown = respond(0.08 * hit);
        let (x, y) = (
            hit + 1e-3 * noise.normal(),
            shown + 0.05 + 1e-4 * noise.normal(),
        );
        format!("{:.4},{x:.5},{y:.6}\n", i as f64 * 1e-4)
    };
    let rows: String = (0..60_000).map(row).collect();
    let folder = Folder::new();
    folder.write(
        "hits.csv",
        format!("time_s,hammer [N m],bridge [V]\n{rows}"),
    );
    let args = [
        "identify",
        "response",
        "hits.csv",
        "--applied",
        "hammer",
        "--measured",
        "bridge",
    ];
    let report = folder.json(&[&args[..], &["-o", "new.toml", "--json"]].concat());
    assert_close(constant(&report, "torque_per_volt"), 12.5, 0.02);
    assert_close(constant(&report, "zero"), 0.05, 1e-3);
    let written = folder.read("new.toml");
    let recorder = written.split("[recorder]").nth(1).expect("a recorder");
    assert!(recorder.contains("zero = { value = \"0.0"), "{written}");
}

/// A decay of one mode recorded at 1 kHz, and stored at 10 kHz by straight lines: its images are no modes.
#[test]
fn a_record_that_was_interpolated_before_has_no_further_modes() {
    let mut noise = crate::noise::Noise(5);
    let omega = TAU * 180.0;
    let ring = |t: f64| (-0.02 * omega * t).exp() * (omega * t).cos();
    let recorded: Vec<f64> = (0..1001)
        .map(|i| ring(f64::from(i) * 1e-3) + 1e-4 * noise.normal())
        .collect();
    let finer = |i: usize| {
        let (at, part) = (i / 10, (i % 10) as f64 / 10.0);
        recorded[at] * (1.0 - part) + recorded[at + 1] * part
    };
    let folder = Folder::new();
    folder.write("in.csv", sampled("T [N m]", 10_000.0, 10_000, finer));
    let report = folder.json(&["identify", "decay", "in.csv", "--json"]);
    assert!(codes(&report).contains(&"interpolated-samples"), "{report}");
    assert_eq!(
        report["modes"].as_array().map_or(1, Vec::len),
        1,
        "{report}"
    );
    assert_close(constant(&report, "natural_frequency"), 180.0, 1e-3);
    folder.write("stand.toml", stand("").replace("60 Hz", "180 Hz"));
    let report = folder.json(&[&COMPENSATE[..], &["--json"]].concat());
    assert!(codes(&report).contains(&"interpolated-samples"), "{report}");
    assert!(
        report["band_hz"].as_f64().expect("a number") < 140.1,
        "{report}"
    );
}

/// Steps of the torque ring at 180 Hz, and two orders of a motor are as strong as they; the declared resonance is another
/// one, or the orders are beside it.
#[test]
fn strong_orders_hide_no_resonance() {
    let folder = Folder::new();
    for size in [0.03, 0.3, 3.0] {
        for motor_hz in [21.7, 29.0] {
            let mut noise = crate::noise::Noise(11);
            let mut respond = resonator(5000.0);
            let torque = |t: f64| {
                let order = |n: f64| size * (TAU * n * motor_hz * t + n).cos();
                let steps = [0.3, 0.75, 1.3, 1.8, 2.45];
                let passed = steps.iter().filter(|at| t > **at).count();
                2.0 + 0.3 * (passed % 2) as f64 + order(1.0) + order(6.0)
            };
            // From a second before the record on, so that the motor runs at its beginning.
            let sample = |i: i32| respond(torque(f64::from(i) / 5000.0)) + 2e-3 * noise.normal();
            let motion: Vec<f64> = (-5000..15_000).map(sample).skip(5000).collect();
            folder.write("in.csv", sampled("T [N m]", 5000.0, 15_000, |i| motion[i]));
            for (hz, ratio, said) in [
                ("162 Hz", "0.02", Some("resonance-elsewhere")),
                ("200 Hz", "0.02", Some("resonance-elsewhere")),
                ("180 Hz", "0.2", Some("damping-differs")),
                ("180 Hz", "0.02", None),
            ] {
                let stand = stand("").replace("60 Hz", hz);
                let stand = stand.replace("ratio = 0.02", &format!("ratio = {ratio}"));
                folder.write("stand.toml", stand);
                let report = folder.json(&[&COMPENSATE[..], &["--json", "--force"]].concat());
                let codes = codes(&report);
                let mut both = ["resonance-elsewhere", "damping-differs"].into_iter();
                let found = both.find(|code| codes.contains(code));
                assert_eq!(found, said, "{size} N m, {motor_hz} Hz: {hz} {ratio}");
            }
        }
    }
}
