//! `inspect` through the binary: its report on records with known faults.

use std::f64::consts::TAU;
use std::fmt::Write;

use serde_json::Value;

use crate::noise::Noise;
use crate::util::{Folder, codes};

/// Seeded white noise of unit variance.
fn noise(seed: u64, count: usize) -> Vec<f64> {
    let mut noise = Noise(seed);
    (0..count).map(|_| noise.normal()).collect()
}

/// A good torque signal: two components and noise.
fn torque(count: usize) -> Vec<f64> {
    let parts = |t: f64| 3.0 * (TAU * 7.3 * t).sin() + (TAU * 31.0 * t).cos();
    noise(11, count)
        .iter()
        .enumerate()
        .map(|(i, n)| parts(1e-3 * i as f64) + 0.2 * n)
        .collect()
}

fn good_times(count: usize) -> Vec<f64> {
    (0..count).map(|i| 1e-3 * i as f64).collect()
}

fn csv(times: &[f64], columns: &[(&str, &[f64])]) -> String {
    let mut text = "time_s".to_owned();
    for (name, _) in columns {
        let _ = write!(text, ",{name}");
    }
    for (i, time) in times.iter().enumerate() {
        let _ = write!(text, "\n{time:.7}");
        for (_, values) in columns {
            let _ = match values[i] {
                value if value.is_nan() => write!(text, ","),
                value => write!(text, ",{value:.5}"),
            };
        }
    }
    text.push('\n');
    text
}

fn inspect(text: &str) -> Value {
    let folder = Folder::new();
    folder.write("in.csv", text);
    folder.json(&["inspect", "in.csv", "--json"])
}

#[test]
fn a_good_record_has_everything_said_and_nothing_wrong() {
    let (times, torque) = (good_times(5000), torque(5000));
    let report = inspect(&csv(&times, &[("torque_n_m", &torque)]));
    assert_eq!(report["schema"], "torqcomp.inspect/1");
    assert_eq!(report["format"], "csv");
    assert!(report["dialect"].as_str().unwrap().contains("comma"));
    assert_eq!(codes(&report), [""; 0]);
    let channel = &report["channels"][0];
    assert_eq!(channel["name"], "torque");
    assert_eq!(channel["unit"], "N m");
    assert_eq!(channel["samples"], 5000);
    assert_eq!(channel["rate_hz"], 1000.0);
    assert_eq!(channel["start"], 0.0);
    assert_eq!(channel["start_unit"], "s");
    assert_eq!(
        (&channel["gaps"], &channel["clipped"]),
        (&0.into(), &0.into())
    );
    assert_eq!(channel["non_finite"], 0);
    assert!(channel["jitter"].as_f64().unwrap() < 1e-6);
    assert!(channel["repeated"].as_f64().unwrap() < 1e-3);
    assert!(channel["rate_from"].as_str().unwrap().contains("time_s"));
}

#[test]
fn every_fault_is_found_with_its_size() {
    let (times, good) = (good_times(6000), torque(6000));

    let clipped: Vec<f64> = good.iter().map(|x| x.clamp(-3.2, 3.0)).collect();
    let report = inspect(&csv(&times, &[("a_V", &clipped)]));
    assert_eq!(codes(&report), ["clipped", "clipped"]);
    let at_rail = clipped.iter().filter(|x| **x == 3.0 || **x == -3.2).count();
    assert_eq!(report["channels"][0]["clipped"], at_rail);
    assert_eq!(report["channels"][0]["clipped_low"], -3.2);

    let mut stuck = good.clone();
    stuck[2000..2300].fill(0.75);
    let report = inspect(&csv(&times, &[("a_V", &stuck)]));
    assert_eq!(codes(&report), ["stuck-channel"]);
    assert_eq!(report["channels"][0]["stuck"], 300);

    let mut dropped: Vec<f64> = good.iter().map(|x| x + 50.0).collect();
    dropped[2000..2012].fill(0.0);
    let report = inspect(&csv(&times, &[("a_V", &dropped)]));
    assert_eq!(codes(&report), ["stuck-channel"]);
    assert_eq!(report["channels"][0]["stuck"], 12);

    let mut marked: Vec<f64> = good.iter().map(|x| x + 50.0).collect();
    marked[1500] = -9999.0;
    marked[4000] = 0.0;
    let report = inspect(&csv(&times, &[("a_V", &marked)]));
    assert_eq!(codes(&report), ["spikes"]);
    let message = report["warnings"][0]["message"].as_str().unwrap();
    assert!(
        message.contains("2 places") && message.contains("-9999"),
        "{message}"
    );

    let chance = noise(3, 6000);
    let mut repeated = good.clone();
    for i in 1..6000 {
        if chance[i] < -0.524 {
            repeated[i] = repeated[i - 1];
        }
    }
    let report = inspect(&csv(&times, &[("a_V", &repeated)]));
    assert_eq!(codes(&report), ["repeated-samples"]);
    let fraction = report["channels"][0]["repeated"].as_f64().unwrap();
    assert!((fraction - 0.3).abs() < 0.02, "{fraction}");

    let coarse: Vec<f64> = good.iter().map(|x| (x / 0.25).round() * 0.25).collect();
    let report = inspect(&csv(&times, &[("a_V", &coarse)]));
    assert_eq!(codes(&report), ["coarse-quantisation"]);
    let step = report["channels"][0]["resolution"].as_f64().unwrap();
    assert!((step - 0.25).abs() < 1e-9, "{step}");

    let mut holes = good.clone();
    holes[100] = f64::NAN;
    holes[101] = f64::NAN;
    let report = inspect(&csv(&times, &[("a_V", &holes)]));
    assert_eq!(codes(&report), ["non-finite"]);
    assert_eq!(report["channels"][0]["non_finite"], 2);
    let message = report["warnings"][0]["message"].as_str().unwrap();
    assert!(message.contains("line 102"), "{message}");

    let hum: Vec<f64> = good
        .iter()
        .zip(&times)
        .map(|(x, t)| x + 0.3 * (TAU * 50.02 * t).cos())
        .collect();
    let report = inspect(&csv(&times, &[("a_V", &hum)]));
    assert_eq!(codes(&report), ["mains-lines"]);
    let line = &report["channels"][0]["mains"][0];
    assert_eq!(line["frequency_hz"], 50.0);
    assert!(
        (line["amplitude"].as_f64().unwrap() - 0.3).abs() < 0.02,
        "{line}"
    );

    let doubled: Vec<f64> = good.iter().map(|x| 2.0 * x - 0.5).collect();
    let dead = vec![1.5; 6000];
    let columns: [(&str, &[f64]); 4] = [
        ("a_V", &good),
        ("b_V", &doubled),
        ("c_V", &good),
        ("d_V", &dead),
    ];
    let report = inspect(&csv(&times, &columns));
    assert_eq!(
        codes(&report),
        ["constant-channel", "channel-copy", "channel-multiple"]
    );
    assert_eq!(report["channels"][3]["constant"], true);
    assert_eq!(report["channels"][3]["repeated"], 1.0);
}

#[test]
fn every_fault_of_the_time_axis_is_found_where_it_is() {
    let good = torque(6000);
    let with = |change: &dyn Fn(usize, f64) -> f64| {
        let times: Vec<f64> = good_times(6000)
            .into_iter()
            .enumerate()
            .map(|(i, t)| change(i, t))
            .collect();
        inspect(&csv(&times, &[("a_V", &good)]))
    };
    let report = with(&|i, t| if i < 4000 { t } else { t + 0.02 });
    assert_eq!(codes(&report), ["time-gaps"]);
    let channel = &report["channels"][0];
    assert_eq!(channel["gaps"], 1);
    assert_eq!(channel["missing_samples"], 20.0);
    let gap = &channel["gap_list"][0];
    assert!(
        (gap["after_s"].as_f64().unwrap() - 3.999).abs() < 1e-9,
        "{gap}"
    );
    assert!(
        (gap["length_s"].as_f64().unwrap() - 0.021).abs() < 1e-9,
        "{gap}"
    );

    let jitter = noise(5, 6000);
    let report = with(&|i, t| t + 5e-5 * jitter[i]);
    assert_eq!(codes(&report), ["time-jitter"]);
    let std = report["channels"][0]["jitter"].as_f64().unwrap();
    assert!((std / (0.05 * 2.0_f64.sqrt()) - 1.0).abs() < 0.05, "{std}");

    let report = with(&|i, t| if i < 4000 { t } else { t - 1.5 });
    assert_eq!(codes(&report), ["time-backwards"]);
    assert_eq!(report["channels"][0]["backwards"], 1);

    let report = with(&|i, t| if i < 1000 { t } else { t + 1e5 });
    assert_eq!(codes(&report), ["clock-jump"]);
}

#[test]
fn a_record_without_a_rate_is_told_and_verbs_refuse_it() {
    let folder = Folder::new();
    let values: String = torque(500).iter().map(|x| format!("{x:.4}\n")).collect();
    folder.write("in.csv", format!("bridge_V\n{values}"));
    let report = folder.json(&["inspect", "in.csv", "--json"]);
    assert_eq!(codes(&report), ["missing-rate"]);
    let channel = &report["channels"][0];
    for unknown in ["rate_hz", "start", "duration_s", "jitter", "gaps"] {
        assert!(channel[unknown].is_null(), "{unknown}: {channel}");
    }
    for verb in [
        &["compensate", "in.csv"][..],
        &["harmonics", "in.csv", "--fundamental", "20"],
    ] {
        let ran = folder.run(&[verb, &["--stand", "stand.toml"]].concat());
        assert_eq!(ran.code, 1, "{}", ran.stderr);
        assert!(ran.stderr.contains("--rate"), "{}", ran.stderr);
    }
    let report = folder.json(&["inspect", "in.csv", "--rate", "1 kHz", "--json"]);
    assert_eq!(report["channels"][0]["rate_hz"], 1000.0);
    assert_eq!(report["channels"][0]["rate_from"], "given");
}

#[test]
fn files_are_compared() {
    let folder = Folder::new();
    let (times, good) = (good_times(3000), torque(3000));
    let scaled: Vec<f64> = good.iter().map(|x| -4.0 * x).collect();
    let one = csv(&times, &[("a_V", &good)]);
    folder.write("one.csv", &one).write("same.csv", &one);
    folder.write(
        "other.csv",
        csv(&times, &[("b_V", &scaled), ("c_V", &good)]),
    );
    let report = folder.json(&["inspect", "one.csv", "same.csv", "other.csv", "--json"]);
    assert_eq!(report["files"].as_array().unwrap().len(), 3);
    assert_eq!(
        codes(&report),
        ["identical-files", "channel-multiple", "channel-copy"]
    );
    // One of several cannot be read: the others are reported, and the run fails.
    let ran = folder.run(&["inspect", "one.csv", "missing.csv", "--json"]);
    assert_eq!(ran.code, 1);
    assert!(ran.stderr.contains("missing.csv"), "{}", ran.stderr);
    let report: Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(report["files"][0]["channels"][0]["samples"], 3000);
    assert!(
        report["files"][1]["error"]
            .as_str()
            .unwrap()
            .contains("missing.csv")
    );
}

#[test]
fn text_plot_and_exit_codes() {
    let folder = Folder::new();
    let (times, good) = (good_times(3000), torque(3000));
    let clipped: Vec<f64> = good.iter().map(|x| x.min(2.0)).collect();
    folder.write("in.csv", csv(&times, &[("a_V", &good), ("b", &clipped)]));
    let ran = folder.run(&["inspect", "in.csv", "--plot", "out.svg"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    for said in [
        "not given",
        "1000 Hz, stamps: time_s",
        "1 warning",
        "[clipped] \"b\"",
    ] {
        assert!(ran.stdout.contains(said), "{said} in {}", ran.stdout);
    }
    let svg = folder.read("out.svg");
    assert_eq!(svg.matches("class=\"line ").count(), 2);
    assert_eq!(svg.matches("class=\"rail\"").count(), 1);
    let again = folder.run(&["inspect", "in.csv", "--plot", "out.svg"]);
    assert_eq!(again.code, 1, "an existing file is kept: {}", again.stderr);
    assert_eq!(folder.run(&["inspect", "in.csv", "--strict"]).code, 3);
    assert_eq!(folder.run(&["inspect"]).code, 2);
    assert_eq!(folder.run(&["inspect", "-", "-"]).code, 2);
    let ran = folder.run(&["inspect", "in.csv", "-o", "in.csv", "--force"]);
    assert_eq!(ran.code, 2, "an input is not overwritten: {}", ran.stderr);
}
