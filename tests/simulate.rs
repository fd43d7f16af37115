//! `simulate` and the waveform of an input between samples, through the binary.

use std::f64::consts::TAU;
use std::fmt::Write;

use crate::diagnose::diagnose;
use crate::motion;
use crate::noise::Noise;
use crate::util::{Folder, SIMULATE, table};

const RATE_HZ: f64 = 20_000.0;
const STAND: &str = "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"600 Hz\"\ndamping_ratio = 0.08\n";

/// A sum of sines with a period of 2000 samples.
fn input(seed: u32, count: usize) -> Vec<f64> {
    let line = |k: u32, i: usize| {
        let phase = f64::from(k * k * seed % 97);
        (TAU * f64::from(4 * k) * i as f64 / 2000.0 + phase).cos()
    };
    (0..count)
        .map(|i| (1..=36).map(|k| line(k, i)).sum::<f64>() / 6.0)
        .collect()
}

/// Exact response of the stand to held samples: between samples it moves freely about the equilibrium of the
/// sample.
fn held(input: &[f64]) -> Vec<f64> {
    let (omega, zeta) = (TAU * 600.0, 0.08_f64);
    let (sigma, damped) = (zeta * omega, omega * (1.0 - zeta * zeta).sqrt());
    let step_s = 1.0 / RATE_HZ;
    let (c, s) = ((damped * step_s).cos(), (damped * step_s).sin());
    let fade = (-sigma * step_s).exp();
    let (mut x, mut v) = (0.0, 0.0);
    let mut answer = Vec::new();
    for rest in input {
        answer.push(x);
        let (d, turn) = (x - rest, (v + sigma * (x - rest)) / damped);
        x = rest + fade * (d * c + turn * s);
        v = fade * ((turn * damped - sigma * d) * c - (d * damped + sigma * turn) * s);
    }
    answer
}

fn record(applied: &[f64], measured: &[f64]) -> String {
    let mut text = String::from("time_s,applied_n_m,measured_n_m\n");
    for (i, (u, y)) in applied.iter().zip(measured).enumerate() {
        let _ = writeln!(text, "{:.6},{u:.9},{y:.9}", i as f64 / RATE_HZ);
    }
    text
}

#[test]
fn held_samples_are_simulated_as_they_are() {
    let folder = Folder::new();
    folder.write("stand.toml", STAND);
    let applied = input(5, 6000);
    let truth = held(&applied);
    folder.write("record.csv", record(&applied, &truth));
    let args = [
        &SIMULATE[..],
        &["--between", "held", "-o", "answer.csv", "--json"],
    ]
    .concat();
    let report = folder.json(&args);
    assert_eq!(report["schema"], "torqcomp.simulate/1");
    assert_eq!(report["measured_unit"], "N m");
    assert_eq!(report["input_between_samples"], "held");
    let (_, rows) = table(&folder.read("answer.csv"));
    let settled = 1000..5900;
    let left = settled.clone().map(|i| (rows[i][1] - truth[i]).powi(2));
    let whole = settled.map(|i| truth[i].powi(2));
    let relative = (left.sum::<f64>() / whole.sum::<f64>()).sqrt();
    assert!(relative < 1e-3, "{relative:e}");
}

/// Rms difference of a simulation of held samples from the truth, over that of the truth.
fn off_when_held(effect: &str, applied: &[f64], truth: &[f64]) -> f64 {
    let folder = Folder::new();
    folder.write("stand.toml", format!("{STAND}[[effects]]\n{effect}\n"));
    folder.write("record.csv", record(applied, truth));
    let ran = folder.run(&[&SIMULATE[..], &["--between", "held", "-o", "answer.csv"]].concat());
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let (_, rows) = table(&folder.read("answer.csv"));
    let settled = 1000..truth.len() - 100;
    let left = settled.clone().map(|i| (rows[i][1] - truth[i]).powi(2));
    let whole = settled.map(|i| truth[i].powi(2));
    (left.sum::<f64>() / whole.sum::<f64>()).sqrt()
}

/// A leak past the stand shows the jumps of a held input from their sample on; half of each had been missing.
#[test]
fn a_leak_follows_the_jumps_of_held_samples() {
    // Plateaus of 7 to 19 samples.
    let mut noise = Noise(3);
    let (mut level, mut left) = (0.0, 0);
    let level_at = |_| {
        if left == 0 {
            (level, left) = (noise.normal(), 7 + (12.0 * noise.uniform()) as usize);
        }
        left -= 1;
        level
    };
    let applied: Vec<f64> = (0..6000).map(level_at).collect();
    // The low-pass of the corner relaxes towards each sample until the next.
    let kept = (-TAU * 300.0 / RATE_HZ).exp();
    let mut low = applied[0];
    let passed = applied.iter().map(|u| {
        let now = low;
        low = u + (low - u) * kept;
        u - now
    });
    let stand = held(&applied);
    let truth: Vec<f64> = stand
        .iter()
        .zip(passed)
        .map(|(x, high)| x + 0.4 * high)
        .collect();
    let leak = "kind = \"capacitive-coupling\"\nform = \"high-pass-leak\"\nshare = 0.4\ncorner = \"300 Hz\"";
    let off = off_when_held(leak, &applied, &truth);
    assert!(off < 3e-3, "{off:e}");
}

/// Play between stator and beam, with the gage on the beam: the beam carries `w`, dragged along within the gap, and the
/// gage shows it.
#[test]
fn a_gage_on_a_beam_with_play_shows_the_beam() {
    const STEPS: usize = 64;
    let gap = 0.05;
    let applied: Vec<f64> = input(5, 6000);
    let omega = TAU * 600.0;
    let h = 1.0 / (RATE_HZ * STEPS as f64);
    let (mut state, mut beam) = ([0.0; 2], 0.0_f64);
    let mut truth = Vec::new();
    for u in &applied {
        truth.push(beam);
        for _ in 0..STEPS {
            let slope = |_: f64, [x, v]: [f64; 2]| {
                let w = beam.clamp(x - gap, x + gap);
                [v, omega * omega * (u - w) - 2.0 * 0.08 * omega * v]
            };
            state = motion::step(state, 0.0, h, slope);
            beam = beam.clamp(state[0] - gap, state[0] + gap);
        }
    }
    let play = "kind = \"backlash\"\nform = \"joint-shown\"\ngap = \"0.05 N m\"";
    let off = off_when_held(play, &applied, &truth);
    assert!(off < 5e-3, "{off:e}");
}

/// One period of a sum of sines starting at phase 0: in the steady-state response, each line has the closed-form
/// response of the stand, from the first sample to the last.
#[test]
fn a_period_that_is_repeated_has_its_steady_answer() {
    let folder = Folder::new();
    folder.write("stand.toml", STAND);
    let applied = input(5, 2000);
    folder.write("record.csv", record(&applied, &applied));
    let args = [&SIMULATE[..], &["--periodic", "-o", "answer.csv", "--json"]].concat();
    let report = folder.json(&args);
    assert_eq!(report["is_steady"], true);
    let (_, rows) = table(&folder.read("answer.csv"));
    assert_eq!(rows.len(), 2000);
    let answer = |i: usize| {
        let line = |k: u32| {
            let turns = f64::from(4 * k) / 2000.0;
            let ratio = turns * RATE_HZ / 600.0;
            let (re, im) = (1.0 - ratio * ratio, 2.0 * 0.08 * ratio);
            let phase = f64::from(k * k * 5 % 97) - im.atan2(re);
            (TAU * turns * i as f64 + phase).cos() / re.hypot(im)
        };
        (1..=36).map(line).sum::<f64>() / 6.0
    };
    for (i, row) in rows.iter().enumerate() {
        assert!(
            (row[1] - answer(i)).abs() < 1e-4,
            "{i}: {} {}",
            row[1],
            answer(i)
        );
    }
}

/// Diagnosis of held inputs whose responses are recorded too large by a factor.
fn diagnosed_as_held(factor: f64) -> serde_json::Value {
    let folder = Folder::new();
    folder.write("stand.toml", STAND);
    let mut noise = Noise(11);
    for (name, seed) in [("train.csv", 5), ("holdout.csv", 8)] {
        let applied = input(seed, 8000);
        let answer = held(&applied);
        let measured = answer.iter().map(|y| factor * y + 0.005 * noise.normal());
        folder.write(name, record(&applied, &measured.collect::<Vec<f64>>()));
    }
    let report = folder.json(&diagnose(&["--json"]));
    assert_eq!(report["input_between_samples"], "held");
    let after = report["error"]["after"]["holdout_rms"].as_f64().unwrap();
    assert!((after / 0.005 - 1.0).abs() < 0.05, "{after}");
    report
}

#[test]
fn an_input_that_is_held_is_no_effect() {
    assert_eq!(diagnosed_as_held(1.0)["verdict"], "nothing-missing");
    // Nor does it hide one: a delay of half a sample would explain the rest.
    let report = diagnosed_as_held(1.1);
    assert_eq!(report["verdict"], "explained");
    assert_eq!(report["effects"], serde_json::json!(["gain-error"]));
}

/// A drift begins with the record, even if its stamps are seconds since 1970.
#[test]
fn stamps_far_from_zero_do_not_move_a_drift() {
    let folder = Folder::new();
    let drift = "[[effects]]\nkind = \"thermal-drift\"\nform = \"exponential\"\ndrift = \"2 N m\"\ntime_constant = \"0.05 s\"\n";
    folder.write("stand.toml", format!("{STAND}{drift}"));
    let rest = vec![0.0; 3000];
    let text = record(&rest, &rest);
    folder.write("record.csv", &text);
    folder.write("later.csv", text.replace("\n0.", "\n1700000000."));
    let answer = |file: &str| {
        let args = [
            "simulate",
            file,
            "--stand",
            "stand.toml",
            "--applied",
            "applied_n_m",
        ];
        let (_, rows) = table(&folder.run(&args).stdout);
        rows.iter().map(|row| row[1]).collect::<Vec<f64>>()
    };
    let (first, later) = (answer("record.csv"), answer("later.csv"));
    assert_eq!(first.len(), 3000);
    // 2 (1 - 1/e) after one time constant: 1.26424.
    assert!((first[1000] - 1.264_24).abs() < 1e-5, "{}", first[1000]);
    for (a, b) in first.iter().zip(&later) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
    // The beginning of the record is where the drift begins.
    let part = |range: &'static str| {
        let input = ["record.csv", "--stand", "stand.toml", "--range", range];
        let simulated = [&["simulate"][..], &input, &["--applied", "applied_n_m"]].concat();
        let output = ["--channel", "2", "-o", "part.csv"];
        let compensated = [&["compensate"][..], &input, &output].concat();
        [simulated, compensated].map(|args| folder.run(&args))
    };
    let said = ["thermal-drift", "leaves out its beginning", "as ..2"];
    for ran in part("0.05..") {
        ran.says(1, &said);
    }
    for ran in part("..0.05") {
        ran.says(0, &[]);
    }
}

#[test]
fn columns_that_the_stand_does_not_take_are_refused() {
    let folder = Folder::new();
    folder.write("stand.toml", STAND);
    let applied = input(5, 600);
    let text = record(&applied, &applied);
    folder.write("record.csv", &text);
    let simulate = |file: &'static str, more: &[&'static str]| {
        let first = ["simulate", file, "--stand", "stand.toml", "--applied"];
        folder.run(&[&first[..], more].concat())
    };
    simulate("record.csv", &["applied_n_m", "--unit", "kg"]).says(
        1,
        &[
            "\"applied\" is in kg",
            "acts on this stand is in N m",
            "--unit",
        ],
    );
    folder.write("inch.csv", text.replace("applied_n_m", "applied [oz-in]"));
    simulate("inch.csv", &["applied"]).says(1, &["--unit \"ozf-in\" (1 ozf-in = 0.0070616 N m)"]);
    folder.write("bare.csv", text.replace("applied_n_m", "load"));
    simulate("bare.csv", &["load"]).says(
        0,
        &[
            "[unit-assumed]",
            "N m, which the stand expects, was assumed",
        ],
    );
    simulate("bare.csv", &["load", "--strict"]).says(3, &["[unit-assumed]"]);
    simulate("record.csv", &["applied_n_m", "--json"]).says(2, &["give the record a file with -o"]);
    let kept: Vec<&str> = text
        .lines()
        .enumerate()
        .filter(|(i, _)| !(200..260).contains(i))
        .map(|(_, l)| l)
        .collect();
    folder.write("gap.csv", kept.join("\n"));
    simulate("gap.csv", &["applied_n_m"]).says(1, &["not uniform", "line 201", "61 times"]);
    folder.write("again.csv", &text);
    let twice = [
        "diagnose",
        "--train",
        "record.csv",
        "--holdout",
        "again.csv",
    ];
    let columns = ["--applied", "applied_n_m", "--measured", "measured_n_m"];
    folder
        .run(&[&twice[..], &columns].concat())
        .says(1, &["same samples as the training record record.csv"]);
}

/// Ten samples are missing, and one stamp is 20 % of a step late.
#[test]
fn resampling_says_what_it_bridged() {
    let folder = Folder::new();
    folder.write("stand.toml", STAND);
    let applied = input(5, 3000);
    let text = record(&applied, &applied);
    let kept = text.lines().enumerate();
    let kept = kept.filter(|(row, _)| !(1000..1010).contains(row));
    let rows: Vec<String> = kept
        .map(|(row, line)| match row {
            500 => line.replacen("0.024950", "0.024960", 1),
            _ => line.to_owned(),
        })
        .collect();
    folder.write("record.csv", rows.join("\n") + "\n");
    let args = [&SIMULATE[..], &["--resample", "-o", "out.csv", "--json"]].concat();
    let report = folder.json(&args);
    let warnings = report["warnings"].as_array().expect("a list");
    let told = |w: &&serde_json::Value| w["message"].as_str().unwrap().contains("gap");
    let told: Vec<_> = warnings.iter().filter(told).collect();
    assert_eq!(told.len(), 1, "{warnings:?}");
    assert_eq!(told[0]["code"], "resampled-gaps");
    // From the preceding sample to the following one: 11 steps of 50 us.
    let message = told[0]["message"].as_str().expect("text");
    let gap = "1 gap in the time stamps filled by linear interpolation (10 samples, longest step 0.00055 s)";
    assert!(message.contains(gap), "{message}");
    assert_eq!(report["samples"], 3000);
}

/// The heading of the result has its unit, so that compensate reads it without --unit.
#[test]
fn the_record_can_be_compensated_as_it_is() {
    let applied = input(7, 4000);
    let rows = |heading: &str| {
        let mut text = format!("time [s],{heading}\n");
        for (i, u) in applied.iter().enumerate() {
            let _ = writeln!(text, "{:.6},{u:.9}", i as f64 / RATE_HZ);
        }
        text
    };
    for (heading, more, unit) in [
        ("torque [N m]", &[][..], "N m"),
        ("torque_mNm", &["--applied", "torque"], "mN m"),
        ("torque", &["--unit", "N m"], "N m"),
    ] {
        let folder = Folder::new();
        folder.write("stand.toml", STAND);
        folder.write("in.csv", rows(heading));
        let simulate = [
            "simulate",
            "in.csv",
            "--stand",
            "stand.toml",
            "-o",
            "out.csv",
        ];
        let ran = folder.run(&[&simulate[..], more].concat());
        assert_eq!(ran.code, 0, "{heading}: {}", ran.stderr);
        let (head, simulated) = table(&folder.read("out.csv"));
        assert_eq!(head[1], format!("measured [{unit}]"));
        let compensate = [
            "compensate",
            "out.csv",
            "--stand",
            "stand.toml",
            "-o",
            "back.csv",
        ];
        let ran = folder.run(&compensate);
        assert_eq!(ran.code, 0, "{heading}: {}", ran.stderr);
        let (_, back) = table(&folder.read("back.csv"));
        assert_eq!(back.len(), simulated.len());
        let scale = if unit == "mN m" { 1e-3 } else { 1.0 };
        for i in 1500..2500 {
            let error = back[i][1] - scale * applied[i];
            assert!(error.abs() < 0.02 * scale, "{heading} {i}: {error}");
        }
    }
}

/// Friction acts on the first of two inertias, or beside a springpot, in both directions.
#[test]
fn torques_within_the_whole_stand_are_inverted() {
    let hung = "kind = \"second-mode\"\nform = \"coupled\"\nfrequency = \"900 Hz\"\ndamping_ratio = 0.03\n\
        inertia_ratio = 0.1\n";
    let pot = "kind = \"structural-damping\"\nform = \"springpot\"\norder = 0.1\n";
    let friction = "kind = \"coulomb-friction\"\nform = \"tanh\"\ntorque = \"0.1 N m\"\n\
        transition_speed = \"300 N m/s\"\n";
    let ramp = |i: usize| (std::f64::consts::PI * i as f64 / 6000.0).sin().powi(2);
    let applied: Vec<f64> = input(11, 6000)
        .iter()
        .enumerate()
        .map(|(i, u)| u * ramp(i))
        .collect();
    for effect in [hung, pot] {
        let folder = Folder::new();
        let stand = format!("{STAND}[[effects]]\n{effect}[[effects]]\n{friction}");
        folder.write("stand.toml", stand);
        folder.write("in.csv", record(&applied, &applied));
        let ran = folder.run(&[
            "simulate",
            "in.csv",
            "--stand",
            "stand.toml",
            "--applied",
            "applied",
            "-o",
            "out.csv",
        ]);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let ran = folder.run(&[
            "compensate",
            "out.csv",
            "--stand",
            "stand.toml",
            "--band",
            "2000",
            "-o",
            "back.csv",
        ]);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let (_, back) = table(&folder.read("back.csv"));
        let (mut left, mut whole) = (0.0, 0.0);
        for (row, u) in back.iter().zip(&applied).skip(1500).take(3000) {
            left += (row[1] - u).powi(2);
            whole += u * u;
        }
        assert!(left < 1e-4 * whole, "{effect}: {}", (left / whole).sqrt());
    }
}
