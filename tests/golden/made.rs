//! Records for the golden outputs, from closed forms and small recursions, independent of torqcomp.

mod mcap_files;

use std::f64::consts::TAU;
use std::fmt::Write as _;

use crate::blind::record::make;
use crate::blind::write;
use crate::noise::Noise;

/// The files, by name.
pub fn files() -> Vec<(&'static str, Vec<u8>)> {
    let mut files: Vec<(&str, Vec<u8>)> = vec![
        ("decay.csv", decay().into()),
        ("hits.csv", hits().into()),
        ("noise.csv", noise().into()),
        ("periods.csv", periods().into()),
        ("runup.csv", runup().into()),
        ("sweep.csv", sweep().into()),
        ("short.csv", short().into()),
    ];
    // A stand that lacks an effect, and one that lacks nothing.
    for (effect, train, holdout) in [
        ("cubic-stiffness", "cubic_train.csv", "cubic_holdout.csv"),
        ("none", "none_train.csv", "none_holdout.csv"),
    ] {
        let case = make(7, effect, 1).expect("the catalogue has it");
        files.push((
            train,
            first_rows(&write::table(&case.train, false), 4000).into(),
        ));
        files.push((
            holdout,
            first_rows(&write::table(&case.holdout, false), 3000).into(),
        ));
    }
    files.extend(mcap_files::files());
    files
}

fn first_rows(table: &str, count: usize) -> String {
    table.split_inclusive('\n').take(count + 1).collect()
}

/// A table of columns over time; headings with the time's.
fn table(headings: &str, rate_hz: f64, columns: &[Vec<f64>]) -> String {
    let mut text = format!("{headings}\n");
    for row in 0..columns[0].len() {
        let _ = write!(text, "{:.6}", row as f64 / rate_hz);
        for column in columns {
            let _ = write!(text, ",{:.6}", column[row]);
        }
        text.push('\n');
    }
    text
}

/// The stand of figure 5 of the thesis after a blow: 1.7 ms per cycle, from 2 to 0.5 mV in 5.3 ms.
fn decay() -> String {
    let mut noise = Noise(17);
    let sigma = 4.0_f64.ln() / 5.3e-3;
    let value = |i: usize| {
        let t = i as f64 / 40_000.0;
        2.0 * (-sigma * t).exp() * (TAU / 1.7e-3 * t).cos() + 0.1 + 0.002 * noise.normal()
    };
    table(
        "time_s,gage_mV",
        40_000.0,
        &[(0..1200).map(value).collect()],
    )
}

/// Output of a one-mode filter at 60 Hz for 1 kHz, by its recursion.
fn ringing(applied: &[f64]) -> Vec<f64> {
    let (fall, turn) = (0.989_f64, (TAU * 0.06).cos());
    let gain = 1.0 - 2.0 * fall * turn + fall * fall;
    let (mut last, mut before) = (0.0, 0.0);
    let step = |x: &f64| {
        let now = 2.0 * fall * turn * last - fall * fall * before + gain * x;
        before = last;
        last = now;
        now
    };
    applied.iter().map(step).collect()
}

/// Input and output of that filter, with noise on the output.
fn driven(headings: &str, applied: Vec<f64>, seed: u64) -> String {
    let mut noise = Noise(seed);
    let answer = ringing(&applied)
        .iter()
        .map(|y| y + 0.002 * noise.normal())
        .collect();
    table(headings, 1000.0, &[applied, answer])
}

/// Three blows, a second apart.
fn hits() -> String {
    let force = |i: usize| (-0.5 * (((i % 1000) as f64 - 50.0) / 3.0).powi(2)).exp() * 20.0;
    driven("time_s,hammer_N,beam_mm", (0..3000).map(force).collect(), 5)
}

fn noise() -> String {
    let mut noise = Noise(41);
    let mut smooth = 0.0;
    let value = |_| {
        smooth = 0.5 * smooth + noise.normal();
        smooth
    };
    driven(
        "time_s,force_N m,beam_N m",
        (0..6000).map(value).collect(),
        43,
    )
}

/// Six periods of 500 samples with lines to 200 Hz, after one for settling.
fn periods() -> String {
    let mut noise = Noise(23);
    let phases: Vec<f64> = (1..100).map(|_| TAU * noise.uniform()).collect();
    let value = |i: usize| {
        let line =
            |(k, phase): (usize, &f64)| (TAU * ((k + 1) * i % 500) as f64 / 500.0 + phase).sin();
        phases.iter().enumerate().map(line).sum()
    };
    let whole = driven(
        "time_s,force_N m,beam_N m",
        (0..3500).map(value).collect(),
        29,
    );
    let (head, rows) = whole.split_once('\n').expect("headings");
    let settled: String = rows.split_inclusive('\n').skip(500).collect();
    format!("{head}\n{settled}")
}

/// A body of 0.25 kg m² with viscous and dry friction, by steps of 10 µs.
fn runup() -> String {
    let mut noise = Noise(31);
    let torque = |t: f64| 3.0 * (TAU * 0.7 * t).sin() + 1.5 * (TAU * 1.9 * t + 0.4).sin();
    let (mut angle, mut speed) = (0.0_f64, 0.0_f64);
    let mut columns = vec![Vec::new(), Vec::new()];
    for i in 0..4000 {
        columns[0].push(angle);
        columns[1].push(torque(f64::from(i) * 1e-3) + 0.01 * noise.normal());
        for k in 0..100 {
            let t = f64::from(i) * 1e-3 + f64::from(k) * 1e-5;
            let free = torque(t) - 0.15 - 0.4 * speed;
            if speed == 0.0 && free.abs() <= 0.6 {
                continue;
            }
            let way = if speed == 0.0 {
                free.signum()
            } else {
                speed.signum()
            };
            let next = speed + (free - 0.6 * way) / 0.25 * 1e-5;
            speed = if next * way < 0.0 { 0.0 } else { next };
            angle += speed * 1e-5;
        }
    }
    table("time_s,angle_rad,torque_N m", 1000.0, &columns)
}

/// A swept torque for `simulate`.
fn sweep() -> String {
    let value = |i: usize| {
        let t = i as f64 / 20_000.0;
        2.0 * (TAU * (20.0 + 4000.0 * t) * t).sin()
    };
    table(
        "time_s,load_n_m,speed_rpm",
        20_000.0,
        &[(0..2000).map(value).collect(), vec![1100.0; 2000]],
    )
}

/// A few samples with the rate: for `compensate` and `harmonics` in other formats.
fn short() -> String {
    let value = |i: usize| {
        let t = i as f64 / 10_000.0;
        1e-3 * (TAU * 60.0 * t).cos() + 2e-4 * (TAU * 120.0 * t + 1.0).cos() + 1e-4
    };
    let mut text = "time_s,bridge_V,speed_rpm\n".to_owned();
    for i in 0..1200 {
        let _ = writeln!(
            text,
            "{:.4},{:.9},{}",
            i as f64 / 10_000.0,
            value(i),
            1100 + i % 7
        );
    }
    text
}
