//! The band of `compensate`: chosen from the record and the stand, reproducible, or as given.

use std::f64::consts::TAU;

use crate::noise::Noise;
use crate::util::{Folder, column, record, steady};

const RATE: f64 = 20_000.0;
/// The torque ends at 300 Hz, half the natural frequency.
const PARTS: [(f64, f64, f64); 4] = [
    (0.8, 0.0, 0.0),
    (1.0, 60.0, 0.3),
    (0.5, 120.0, 2.0),
    (0.3, 300.0, -1.0),
];

/// A record with uniform noise of 0.01 N m RMS, containing only noise up to a sample.
fn noisy(count: usize, silent: usize) -> (String, Vec<f64>) {
    let (shown, acted) = steady(&PARTS, RATE, count);
    let mut noise = Noise(11);
    let mut noisy = |(i, x): (usize, &f64)| {
        let torque = if i < silent { 0.0 } else { *x };
        torque + 0.01 * 12_f64.sqrt() * (noise.uniform() - 0.5)
    };
    let recorded: Vec<f64> = shown.iter().enumerate().map(&mut noisy).collect();
    (record(&recorded, RATE), acted)
}

fn compensate(file: &str) -> [&str; 8] {
    [
        "compensate",
        file,
        "--stand",
        "stand.toml",
        "--json",
        "-o",
        "out.csv",
        "--force",
    ]
}

fn rms_error(torque: &[f64], acted: &[f64]) -> f64 {
    let inside = acted.len() / 5..acted.len() * 4 / 5;
    let count = inside.len() as f64;
    let square: f64 = inside.map(|i| (torque[i] - acted[i]).powi(2)).sum();
    (square / count).sqrt()
}

#[test]
fn the_band_follows_the_torque_and_is_the_same_when_asked_again() {
    let folder = Folder::new();
    let (text, acted) = noisy(40_000, 0);
    folder.write("in.csv", &text);
    let args = compensate("in.csv");
    let ran = folder.run(&args);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let report: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    let band = &report["band"];
    let top_hz = band["top_hz"].as_f64().unwrap();
    // The last line is at 300 Hz, and the inverse amplifies noise only above 830 Hz (590 √2).
    assert!((290.0..900.0).contains(&top_hz), "{band}");
    assert_eq!(band["chosen_from"], "record");
    assert_eq!(band["seconds"], 2.0);
    assert_eq!(report["band_hz"], band["top_hz"]);
    assert!(
        ran.stderr
            .contains("chosen for the least expected error from the record"),
        "{}",
        ran.stderr
    );
    assert!(!ran.stderr.contains("warning"), "{}", ran.stderr);
    let chosen = folder.read("out.csv");

    // The same band as an option, from a pipe and as a whole, gives the same samples.
    let given = top_hz.to_string();
    let again = folder.run(&[
        "compensate",
        "in.csv",
        "--stand",
        "stand.toml",
        "-q",
        "--band",
        &given,
    ]);
    // Blocks read ahead have other boundaries: equal within rounding.
    let torque = |text: &str| column(text, "compensated_torque_n_m");
    for (a, b) in torque(&again.stdout).iter().zip(torque(&chosen)) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
    assert_eq!(again.stdout.lines().count(), chosen.lines().count());
    let piped = folder.pipe(
        &["compensate", "-", "--stand", "stand.toml", "-q"],
        text.as_bytes(),
    );
    assert_eq!(piped.stdout, chosen);
    let whole = folder.json(&[&args[..], &["--whole-record"]].concat());
    assert_eq!(whole["band"]["top_hz"], band["top_hz"]);

    // The band of the thesis admits noise amplified by up to 15, and a warning says so.
    let rated = folder.run(&[
        "compensate",
        "in.csv",
        "--stand",
        "stand.toml",
        "--band",
        "rated",
    ]);
    rated.says(
        0,
        &["up to 2400 Hz", "the rated band", "band-lost-in-noise"],
    );
    let error = |text: &str| rms_error(&column(text, "compensated_torque_n_m"), &acted);
    assert!(error(&chosen) < 0.01, "{}", error(&chosen));
    assert!(error(&rated.stdout) > 5.0 * error(&chosen));
}

#[test]
fn a_record_without_signal_takes_the_band_of_the_stand() {
    let folder = Folder::new();
    let (text, _) = noisy(20_000, 20_000);
    folder.write("in.csv", &text);
    for file in ["in.csv", "short.csv"] {
        folder.write(
            "short.csv",
            text.lines().take(100).collect::<Vec<_>>().join("\n") + "\n",
        );
        let report = folder.json(&compensate(file));
        assert_eq!(report["band"]["chosen_from"], "stand");
        // |1 − (f/592)²| = 10 at 1963 Hz.
        let top_hz = report["band"]["top_hz"].as_f64().unwrap();
        assert!((1900.0..=1963.0).contains(&top_hz), "{top_hz}");
    }
}

#[test]
fn a_quiet_start_of_a_long_record_is_said() {
    let folder = Folder::new();
    // 131,072 samples and slightly more are examined.
    let (text, _) = noisy(300_000, 200_000);
    let ran = folder.pipe(
        &["compensate", "-", "--stand", "stand.toml", "-o", "out.csv"],
        text.as_bytes(),
    );
    ran.says(0, &["chosen from the stand alone", "s is below the noise"]);
}

/// White noise that went through a low-pass, an amplifier's or an anti-alias filter, is as large as the torque in the
/// middle of the spectrum, and far below it at its end.
#[test]
fn noise_behind_a_low_pass_is_no_torque() {
    let (shown, acted) = steady(&PARTS, RATE, 40_000);
    for (corner_hz, order) in [(2000.0, 1), (3000.0, 4), (6000.0, 8)] {
        let mut noise = Noise(12);
        // Poles one after the other, each with the same corner.
        let part = 1.0 - (-TAU * corner_hz / RATE).exp();
        let mut poles = vec![0.0; order];
        let mut filtered = || {
            let white = 0.02 * noise.normal();
            poles.iter_mut().fold(white, |input, pole| {
                *pole += part * (input - *pole);
                *pole
            })
        };
        let recorded: Vec<f64> = shown.iter().map(|x| x + filtered()).collect();
        let folder = Folder::new();
        folder.write("in.csv", record(&recorded, RATE));
        let ran = folder.run(&compensate("in.csv"));
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let report: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
        let top_hz = report["band"]["top_hz"].as_f64().unwrap();
        assert!((290.0..900.0).contains(&top_hz), "{corner_hz}: {top_hz}");
        let stated = report["noise"]["record"]["compensated_rms"]
            .as_f64()
            .unwrap();
        let error = rms_error(
            &column(&folder.read("out.csv"), "compensated_torque_n_m"),
            &acted,
        );
        println!("{corner_hz} Hz: band {top_hz} Hz, error {error}, stated {stated}");
        assert!((0.7..1.5).contains(&(error / stated)), "{error} {stated}");
        // The noise alone is no signal.
        let alone: Vec<f64> = (0..40_000).map(|_| filtered()).collect();
        folder.write("noise.csv", record(&alone, RATE));
        let report = folder.json(&compensate("noise.csv"));
        assert_eq!(report["band"]["chosen_from"], "stand", "{}", report["band"]);
    }
}

/// A slow torque, and long after the samples from which the band is chosen a pulse of 5 ms.
#[test]
fn a_late_pulse_above_the_band_is_said() {
    let mut noise = Noise(13);
    let mut sample = |i: usize| {
        let t = i as f64 / RATE;
        let pulse = match i {
            200_000..200_100 => 2.0,
            _ => 0.0,
        };
        1.0 + 0.5 * (TAU * 10.0 * t).sin() + pulse + 1e-3 * noise.normal()
    };
    let samples: Vec<f64> = (0..260_000).map(&mut sample).collect();
    let compensate = ["compensate", "-", "--stand", "stand.toml", "-o", "out.csv"];
    for more in [&[][..], &["--whole-record"]] {
        let folder = Folder::new();
        let args = [&compensate[..], more].concat();
        let ran = folder.pipe(&args, record(&samples, RATE).as_bytes());
        ran.says(
            0,
            &["signal-above-band", "between", "chosen from the first 6."],
        );
        // Without the pulse there is nothing to say.
        let quiet = record(&samples[..190_000], RATE);
        let ran = folder.pipe(&[&args[..], &["--force"]].concat(), quiet.as_bytes());
        assert!(!ran.stderr.contains("signal-above-band"), "{}", ran.stderr);
    }
}

/// A ramp, and a quiet record that ends with a step: slower than the blocks of a density.
#[test]
fn a_slow_torque_is_part_of_the_record() {
    let count = 200_000;
    let shapes: [fn(f64) -> f64; 2] =
        [|part| 5.0 * part, |part| if part < 0.9 { 0.0 } else { 3.0 }];
    for (shape, rms) in shapes
        .into_iter()
        .zip([5.0 / 12_f64.sqrt(), 3.0 * 0.09_f64.sqrt()])
    {
        let mut noise = Noise(17);
        let mut sample = |i: usize| shape(i as f64 / count as f64) + 1e-3 * noise.normal();
        let samples: Vec<f64> = (0..count).map(&mut sample).collect();
        let folder = Folder::new();
        folder.write("in.csv", record(&samples, RATE));
        let ran = folder.run(&compensate("in.csv"));
        for code in ["mostly-amplified", "signal-above-band"] {
            assert!(!ran.stderr.contains(code), "{}", ran.stderr);
        }
        let report: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
        let found = report["noise"]["record"]["in_band_rms"].as_f64().unwrap();
        assert!((found / rms - 1.0).abs() < 0.01, "{found} {rms}");
    }
}

/// Rows of `time_s,bridge_V`, in their order.
fn rows_of(text: &str) -> Vec<&str> {
    text.lines().skip(1).collect()
}

fn table(rows: &[&str]) -> String {
    format!("time_s,bridge_V\n{}\n", rows.join("\n"))
}

/// Rows written twice or missing, which --resample puts right, and a gap, a standstill and a tail of zeros: their kinks are
/// no torque.
#[test]
fn the_band_is_chosen_from_what_the_gage_sensed() {
    let folder = Folder::new();
    let (text, _) = noisy(20_000, 0);
    let all = rows_of(&text);
    let band_hz = |text: &str, more: &[&str]| {
        folder.write("in.csv", text);
        let report = folder.json(&[&compensate("in.csv")[..], more].concat());
        report["band_hz"].as_f64().unwrap()
    };
    let clean_hz = band_hz(&text, &[]);
    let is_odd = |i: usize| i % 997 == 400;
    let twice = all.iter().enumerate().flat_map(|(i, row)| {
        let copies = if is_odd(i) { 2 } else { 1 };
        std::iter::repeat_n(*row, copies)
    });
    let twice: Vec<&str> = twice.collect();
    let missing = |is_missing: &dyn Fn(usize) -> bool| {
        let rows = all.iter().enumerate().filter(|(i, _)| !is_missing(*i));
        table(&rows.map(|(_, row)| *row).collect::<Vec<_>>())
    };
    let held = |from: usize, to: usize, value: Option<&str>| -> String {
        let at = |(i, row): (usize, &&str)| {
            let (time, own) = row.split_once(',').unwrap();
            let stuck = value.unwrap_or_else(|| all[from].split_once(',').unwrap().1);
            let shown = if (from..to).contains(&i) { stuck } else { own };
            format!("{time},{shown}")
        };
        let rows: Vec<String> = all.iter().enumerate().map(at).collect();
        table(&rows.iter().map(String::as_str).collect::<Vec<_>>())
    };
    for (what, text, more) in [
        ("twice", table(&twice), &["--resample"][..]),
        ("missing", missing(&is_odd), &["--resample"]),
        (
            "gap",
            missing(&|i| (8000..8400).contains(&i)),
            &["--fill", "linear"],
        ),
        ("standstill", held(6000, 6400, None), &[]),
        ("tail", held(15_000, 20_000, Some("0")), &[]),
    ] {
        let found_hz = band_hz(&text, more);
        assert!(
            (found_hz / clean_hz - 1.0).abs() < 0.25,
            "{what}: {found_hz} instead of {clean_hz}"
        );
    }
}
