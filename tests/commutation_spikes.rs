//! Spikes of the drive in the record: `diagnose` names the train, `compensate` removes it. The records follow from
//! closed forms.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::noise::Noise;
use crate::util::{Folder, codes, column};

const RATE_HZ: f64 = 20_000.0;
const COUNT: usize = 12_000;
const NATURAL_HZ: f64 = 592.0;
const DAMPING_RATIO: f64 = 0.07;
const NOISE_N_M: f64 = 0.003;

/// A train `a e^(−(t − t_j)/d)`, `t` in samples; of single samples without a decay.
struct Train {
    /// Peak in N m.
    size: f64,
    decay: Option<f64>,
    period: f64,
}

impl Train {
    fn samples(&self, first: f64) -> Vec<f64> {
        let mut samples = vec![0.0; COUNT];
        let mut at = first;
        while at < (COUNT - 1) as f64 {
            let from = at.ceil() as usize;
            for (i, y) in samples.iter_mut().enumerate().skip(from).take(80) {
                *y += match self.decay {
                    Some(decay) => self.size * (-(i as f64 - at) / decay).exp(),
                    None if i == from => self.size,
                    None => 0.0,
                };
            }
            at += self.period;
        }
        samples
    }
}

/// The applied quantity, 24 sines up to 1.2 kHz of a level, and the steady response of a stand.
fn stand(noise: &mut Noise, level: f64) -> Vec<[f64; 2]> {
    let sines: Vec<_> = (0..24)
        .map(|k| {
            let hz = 20.0 + 51.25 * f64::from(k);
            let w = hz / NATURAL_HZ;
            let response = Complex64::new(1.0 - w * w, 2.0 * DAMPING_RATIO * w).inv();
            (hz, TAU * noise.uniform(), response)
        })
        .collect();
    let row = |i: usize| {
        let parts = sines.iter().map(|(hz, phase, response)| {
            let turned = Complex64::from_polar(level, TAU * hz * i as f64 / RATE_HZ + phase);
            [turned.re, (turned * response).re]
        });
        parts.fold([0.0; 2], |sum, part| [sum[0] + part[0], sum[1] + part[1]])
    };
    (0..COUNT).map(row).collect()
}

/// Train and hold-out record with something added to each, and the noisy hold-out record without it.
fn folder(seed: u64, added: impl Fn(usize, &mut Noise) -> Vec<f64>) -> (Folder, Vec<f64>) {
    let folder = Folder::new();
    folder.write(
        "stand.toml",
        "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"580 Hz\"\ndamping_ratio = 0.06\n",
    );
    let mut noise = Noise(seed);
    let mut clean = Vec::new();
    for (k, (name, level)) in [("train.csv", 0.3), ("holdout.csv", 0.2)]
        .into_iter()
        .enumerate()
    {
        let rows = stand(&mut noise, level);
        clean = rows
            .iter()
            .map(|row| row[1] + NOISE_N_M * noise.normal())
            .collect();
        let added = added(k, &mut noise);
        let mut text = String::from("time_s,applied_n_m,measured_n_m\n");
        for (i, (row, (y, s))) in rows.iter().zip(clean.iter().zip(added)).enumerate() {
            text += &format!("{:.5},{:.8},{:.8}\n", i as f64 / RATE_HZ, row[0], y + s);
        }
        folder.write(name, text);
    }
    (folder, clean)
}

fn diagnose(folder: &Folder) -> serde_json::Value {
    let args = "diagnose --stand stand.toml --train train.csv --holdout holdout.csv --applied applied_n_m \
                --measured measured_n_m --json -o refined.toml";
    folder.json(&args.split_whitespace().collect::<Vec<_>>())
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = values.map(|v| v * v).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// Torque of a record by a stand file.
fn compensated(folder: &Folder, record: &str, stand: &str) -> Vec<f64> {
    let args = format!(
        "compensate {record} --stand {stand} --channel measured_n_m --band 3000 -o torque.csv --force --json"
    );
    let report = folder.json(&args.split(' ').collect::<Vec<_>>());
    assert!(!codes(&report).contains(&"phase-hidden"), "{report}");
    column(&folder.read("torque.csv"), "compensated_torque_n_m")
}

#[test]
fn a_train_is_named_and_removed() {
    let trains = [
        (20.0, Some(3.0), 205.55),
        (20.0, Some(1.0), 133.217),
        (20.0, None, 77.31),
        (20.0, Some(5.0), 707.37),
    ];
    for (seed, (size, decay, period)) in trains.into_iter().enumerate() {
        let size = size * NOISE_N_M;
        let train = Train {
            size,
            decay,
            period,
        };
        let own = [37.3, 113.9].map(|first| train.samples(first));
        let (folder, clean) = folder(seed as u64 + 1, |k, _| own[k].clone());
        let report = diagnose(&folder);
        assert_eq!(report["verdict"], "explained", "{seed}: {report}");
        let names = serde_json::json!(["commutation-spikes"]);
        assert_eq!(report["effects"], names, "{seed}: {report}");
        let parameters = &report["candidates"][0]["parameters"];
        let value = |k: usize| parameters[k]["value"].as_f64().expect("a number");
        let off = value(0) * period / RATE_HZ - 1.0;
        assert!(off.abs() < 1e-4, "{seed}: {off}");
        let std = parameters[0]["std"].as_f64().expect("a number") / value(0);
        assert!(off.abs() < 2.0 * std && std < 1e-4, "{seed}: {off} {std}");
        assert!((value(1) / size - 1.0).abs() < 0.1, "{seed}: {parameters}");

        let rows = clean.iter().enumerate();
        let rows = rows.map(|(i, y)| format!("{:.5},{y:.8}\n", i as f64 / RATE_HZ));
        let table = format!("time_s,measured_n_m\n{}", rows.collect::<String>());
        folder.write("clean.csv", table);
        let refined = folder.read("refined.toml");
        let (before, _) = refined.split_once("[[effects]]").expect("an effect");
        folder.write("plain.toml", before);
        let want = compensated(&folder, "clean.csv", "plain.toml");
        let error = |stand: &str| {
            let found = compensated(&folder, "holdout.csv", stand);
            rms(found.iter().zip(&want).map(|(a, b)| a - b))
        };
        let (with, without) = (error("refined.toml"), error("plain.toml"));
        assert!(with < 0.1 * without, "{seed}: {with} of {without} N m");
    }
}

/// Twice the noise, for five samples each.
#[test]
fn a_train_of_twice_the_noise_is_named() {
    let train = Train {
        size: 2.0 * NOISE_N_M,
        decay: Some(5.0),
        period: 60.7,
    };
    let own = [37.3, 13.9].map(|first| train.samples(first));
    let (folder, _) = folder(11, |k, _| own[k].clone());
    let report = diagnose(&folder);
    assert_eq!(report["verdict"], "explained", "{report}");
    assert_eq!(report["effects"], serde_json::json!(["commutation-spikes"]));
}

#[test]
fn single_spikes_and_lines_are_no_train() {
    let sines = |lines: &[(f64, f64)], noise: &mut Noise| -> Vec<f64> {
        let phases: Vec<f64> = lines.iter().map(|_| TAU * noise.uniform()).collect();
        let at = |i: usize| {
            let both = lines.iter().zip(&phases);
            both.map(|((hz, a), phase)| a * (TAU * hz * i as f64 / RATE_HZ + phase).sin())
                .sum()
        };
        (0..COUNT).map(at).collect()
    };
    let outliers = |noise: &mut Noise| {
        let mut samples = vec![0.0; COUNT];
        for _ in 0..40 {
            let at = (noise.uniform() * COUNT as f64) as usize;
            samples[at] += if noise.uniform() < 0.5 { -0.2 } else { 0.2 };
        }
        samples
    };
    type Added<'a> = &'a dyn Fn(&mut Noise) -> Vec<f64>;
    let cases: [(&str, &[&str], Added); 4] = [
        ("nothing-missing", &[], &|_| vec![0.0; COUNT]),
        ("unexplained", &[], &outliers),
        ("explained", &["rotor-imbalance"], &|n| {
            sines(&[(87.3, 0.05), (174.6, 0.02)], n)
        }),
        ("explained", &["mains-pickup"], &|n| {
            sines(&[(50.03, 0.05), (150.09, 0.02)], n)
        }),
    ];
    for (seed, (verdict, names, added)) in cases.into_iter().enumerate() {
        let (folder, _) = folder(seed as u64 + 21, |_, noise| added(noise));
        let report = diagnose(&folder);
        assert_eq!(report["verdict"], verdict, "{seed}: {report}");
        assert_eq!(
            report["effects"],
            serde_json::json!(names),
            "{seed}: {report}"
        );
    }
}
