//! `compensate` with effects in the stand: the input of `simulate` is recovered, and on records of the
//! independent generator the error of the torque falls with the error of the model.

use std::f64::consts::TAU;

use torqcomp_model::effects::{EFFECTS, Effect, Form, RecordScales};

use crate::blind::draw::Draw;
use crate::blind::excitation::RATE_HZ;
use crate::blind::plain_fit::{PlainConstants, fit};
use crate::blind::setting::setting;
use crate::blind::sizing::{noise_free, scene};
use crate::blind::{catalogue, declared, plant};
use crate::noise::Noise;
use crate::util::{Folder, HERTEL, column, sampled};

/// Number of samples of a record of the round trip.
const COUNT: usize = 12_000;
/// Band of the round trip in Hz.
const BAND_HZ: f64 = 1500.0;

/// A torque from rest to rest with lines from 30 to 1400 Hz.
fn torque(i: usize) -> f64 {
    let part = i as f64 / COUNT as f64;
    let fade = (part.min(1.0 - part) / 0.1).min(1.0);
    let fade = 0.5 - 0.5 * (std::f64::consts::PI * fade).cos();
    let time_s = i as f64 / RATE_HZ;
    let lines = (0..12).map(|k| {
        let k = f64::from(k);
        (TAU * (30.0 + 124.0 * k) * time_s + k * k).sin()
    });
    fade * lines.sum::<f64>()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = values.map(|x| x * x).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// A stand file with one form of an effect, with the start values of a fit.
fn stand(effect: &Effect, form: &Form) -> String {
    let scales = RecordScales {
        rms: 5.0,
        peak: 16.0,
        natural_hz: 592.0,
        duration_s: COUNT as f64 / RATE_HZ,
    };
    let mut text = format!(
        "{HERTEL}[[effects]]\nkind = \"{}\"\nform = \"{}\"\n",
        effect.name, form.name
    );
    let start = form.starts.first().copied().unwrap_or(&[43.7, 0.1, 0.05]);
    for (i, parameter) in form.parameters.iter().enumerate() {
        // The amplitude of a line is left to the record by the start values.
        let value = match start.get(i) {
            Some(start) => parameter.value(*start, &scales),
            None => 0.3 / i as f64,
        };
        let value = if form.starts.is_empty() {
            start[i]
        } else {
            value
        };
        let unit = parameter.unit.text("N m");
        text += &format!(
            "{} = \"{}\"\n",
            parameter.name,
            format!("{value:e} {unit}").trim()
        );
    }
    text
}

/// Relative RMS error of the recovered torque: in the middle of the record, and at its ends.
fn round_trip(effect: &Effect, form: &Form) -> (f64, f64, String) {
    let folder = Folder::new();
    folder.write("stand.toml", stand(effect, form));
    let mut table = String::from("time_s,applied_n_m\n");
    for i in 0..COUNT {
        table += &format!("{:.5},{:.12}\n", i as f64 / RATE_HZ, torque(i));
    }
    folder.write("applied.csv", table);
    let args = [
        "simulate",
        "applied.csv",
        "--stand",
        "stand.toml",
        "--applied",
        "applied_n_m",
    ];
    let ran = folder.run(&[&args[..], &["-o", "record.csv", "--digits", "15", "-q"]].concat());
    assert_eq!(ran.code, 0, "{} {}: {}", effect.name, form.name, ran.stderr);
    add_lines(&folder, form);
    let band = BAND_HZ.to_string();
    let args = [
        "compensate",
        "record.csv",
        "--stand",
        "stand.toml",
        "--band",
        &band,
        "--channel",
        "measured",
    ];
    let ran = folder.run(
        &[
            &args[..],
            &["--unit", "N m", "-o", "torque.csv", "--json", "-q"],
        ]
        .concat(),
    );
    assert_eq!(ran.code, 0, "{} {}: {}", effect.name, form.name, ran.stderr);
    let back = column(&folder.read("torque.csv"), "compensated_torque_n_m");
    let size = rms((0..COUNT).map(torque));
    let error = |range: std::ops::Range<usize>| rms(range.map(|i| back[i] - torque(i))) / size;
    let ends = error(0..COUNT / 20).max(error(COUNT - COUNT / 20..COUNT));
    (error(COUNT / 10..COUNT - COUNT / 10), ends, ran.stdout)
}

/// The phases of lines and the moments of spikes belong to the record, so `simulate` omits them.
fn add_lines(folder: &Folder, form: &Form) {
    use torqcomp_model::effects::Action;
    let start = form.starts.first().copied().unwrap_or(&[43.7, 0.1, 0.05]);
    let mut values: Vec<f64> = start.to_vec();
    values.extend((values.len()..form.parameters.len()).map(|i| 0.3 / i as f64));
    let table = folder.read("record.csv");
    let add = |time_s: f64| -> f64 {
        match (form.build)(&values) {
            Action::Lines(lines) => lines
                .iter()
                .enumerate()
                .map(|(k, l)| l.amplitude * (TAU * l.frequency_hz * time_s + 0.7 * k as f64).sin())
                .sum(),
            // In one sample each, from 3 ms on.
            Action::Spikes(train) => {
                let turns = train.frequency_hz * (time_s - 3e-3);
                let is_first = turns.rem_euclid(1.0) < train.frequency_hz / RATE_HZ;
                if is_first { train.amplitude } else { 0.0 }
            }
            // Minus its mean over 0.6 s, as a trend has none.
            Action::Course(_) => (2.0 * time_s).sin() - 0.531_4,
            _ => 0.0,
        }
    };
    let mut text = String::from("time_s,measured\n");
    for line in table.lines().skip(1) {
        let (time, value) = line.split_once(',').expect("two columns");
        let (time_s, value): (f64, f64) = (time.parse().unwrap(), value.parse().unwrap());
        text += &format!("{time},{:.15e}\n", value + add(time_s));
    }
    folder.write("record.csv", text);
}

/// Allowed error of a torque with a form: most of them lose nothing.
fn allowed(effect: &str, form: &str) -> f64 {
    match (effect, form) {
        // Clipped irrecoverably, at the scales of a fit.
        ("saturation", "hard" | "uneven") => 0.3,
        ("saturation", _) => 0.05,
        // Nothing is shown within the gap.
        ("backlash", "gap" | "recorded") => 0.1,
        // The signal's own component at the line remains.
        ("mains-pickup" | "rotor-imbalance", _) | ("thermal-drift", "course") => 0.03,
        _ => 0.01,
    }
}

#[test]
fn what_simulate_made_comes_back() {
    let mut wrong = Vec::new();
    for effect in EFFECTS {
        for form in effect.forms {
            let (error, ends, report) = round_trip(effect, form);
            println!(
                "{} {}: {error:.1e} in the middle, {ends:.1e} at the ends",
                effect.name, form.name
            );
            if error.is_nan() || error >= allowed(effect.name, form.name) {
                wrong.push(format!("{} {}: {error:.2e}", effect.name, form.name));
            }
            assert!(
                report.contains(&format!("\"effect\": \"{}\"", effect.name)),
                "{report}"
            );
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A record of the independent generator with an effect, as files: the torque error with the best plain stand, with
/// the truth in the stand file, and due to noise.
struct Recovered {
    plain: f64,
    refined: f64,
    noise: f64,
    stderr: String,
}

fn recovered(effect: &'static str, number: usize) -> Option<Recovered> {
    let variant = catalogue::variant_of(effect, number)?;
    let seed = 71 + number as u64;
    let setting = setting(seed, number, true);
    let scene = scene(&setting);
    let (least, first, most) = variant.sizes;
    let size = (first.max(least) * most).sqrt().min(4.0 * first);
    let built = (variant.build)(&scene, size, &mut Draw::new(seed, "effect"));
    let clean = noise_free(&built, &setting.inputs[0], 0, seed);
    let true_plain = PlainConstants {
        omega: setting.constants.omega(),
        damping_ratio: setting.constants.damping_ratio(),
    };
    let (plain, _) = fit(true_plain, &setting.inputs[0], &clean);
    let mut record = clean.clone();
    let noise_rms = 1e-3 * rms(clean.iter().copied());
    let mut draw = Draw::new(seed, "noise of train");
    record
        .iter_mut()
        .for_each(|y| *y += noise_rms * draw.normal());
    let folder = Folder::new();
    folder.write("plain.toml", plain_stand(plain));
    folder.write(
        "truth.toml",
        declared::stand(&truth(variant, &built, &setting.constants))?,
    );
    let rows = record.iter().enumerate();
    let rows = rows.map(|(i, y)| format!("{:.5},{y:.10}\n", i as f64 / RATE_HZ));
    folder.write(
        "record.csv",
        format!("time_s,measured_n_m\n{}", rows.collect::<String>()),
    );
    let top_hz = setting.excitations[0].top_hz();
    let acted = setting.inputs[0].samples();
    let run = |stand: &str| {
        let band = format!("{top_hz}");
        let args = [
            "compensate",
            "record.csv",
            "--stand",
            stand,
            "--band",
            &band,
        ];
        let ran = folder.run(&args);
        assert_eq!(ran.code, 0, "{effect} {}: {}", variant.name, ran.stderr);
        let back = column(&ran.stdout, "compensated_torque_n_m");
        let inner = acted.len() / 20..acted.len() * 19 / 20;
        let mean = inner.clone().map(|i| back[i] - acted[i]).sum::<f64>() / inner.len() as f64;
        (rms(inner.map(|i| back[i] - acted[i] - mean)), ran.stderr)
    };
    let (refined, stderr) = run("truth.toml");
    Some(Recovered {
        plain: run("plain.toml").0,
        refined,
        noise: noise_rms * noise_gain(true_plain, top_hz),
        stderr,
    })
}

fn plain_stand(plain: PlainConstants) -> String {
    format!(
        "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"{:e} Hz\"\ndamping_ratio = {}\n",
        plain.omega / TAU,
        plain.damping_ratio
    )
}

fn truth(
    variant: &catalogue::Variant,
    built: &plant::Built,
    constants: &plant::Constants,
) -> serde_json::Value {
    let parameters: serde_json::Map<String, serde_json::Value> = built
        .parameters
        .iter()
        .map(|(name, value)| ((*name).to_owned(), (*value).into()))
        .collect();
    serde_json::json!({
        "effect": variant.effect,
        "variant": variant.name,
        "parameters": parameters,
        "true_constants": {
            "inertia_kg_m2": constants.inertia_kg_m2,
            "damping_n_m_s_per_rad": constants.damping_n_m_s,
            "stiffness_n_m_per_rad": constants.stiffness_n_m,
            "natural_frequency_hz": constants.omega() / TAU,
            "damping_ratio": constants.damping_ratio(),
        },
    })
}

/// White-noise gain (output over input RMS) of the inverse of the plain stand, in a band with half its
/// edge.
fn noise_gain(plain: PlainConstants, top_hz: f64) -> f64 {
    let steps = 2000;
    let sum: f64 = (0..steps)
        .map(|k| {
            let hz = 1.1 * top_hz * (f64::from(k) + 0.5) / f64::from(steps);
            let r = TAU * hz / plain.omega;
            (1.0 - r * r).powi(2) + (2.0 * plain.damping_ratio * r).powi(2)
        })
        .sum();
    (sum / f64::from(steps) * 1.1 * top_hz / (0.5 * RATE_HZ)).sqrt()
}

/// Allowed ratio of the torque's error to that from noise alone, with the truth in the stand file.
fn left(effect: &str) -> f64 {
    match effect {
        // Its inverse amplifies the noise of the recorder.
        "recorder-lowpass" | "capacitive-coupling" => 6.0,
        _ => 3.0,
    }
}

#[test]
fn the_torque_improves_as_the_model_does() {
    let mut wrong = Vec::new();
    // A record of each effect, and laws with a different inverse: backlash of the gage, a soft range, AC
    // coupling.
    let more = [
        ("backlash", 3),
        ("saturation", 5),
        ("capacitive-coupling", 4),
    ];
    for effect in catalogue::effects() {
        let numbers = more.iter().filter(|m| m.0 == effect).map(|m| m.1);
        for number in numbers.chain([0]) {
            let Some(found) = (effect != "unlisted")
                .then(|| recovered(effect, number))
                .flatten()
            else {
                continue;
            };
            println!(
                "{effect} {number}: plain {:.4}, truth {:.4}, noise {:.4} N m {}",
                found.plain,
                found.refined,
                found.noise,
                found
                    .stderr
                    .lines()
                    .filter(|l| l.contains("warning"))
                    .collect::<Vec<_>>()
                    .join("; ")
            );
            let improved =
                found.refined < left(effect) * found.noise || found.refined < 0.1 * found.plain;
            let said = found.stderr.contains("[not-recovered]")
                || found.stderr.contains("[direction-unknown]")
                || found.stderr.contains("[phase-hidden]");
            if !(improved || said) {
                wrong.push(format!("{effect} {number}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Record at 50 kHz of a stand with dry friction of 0.3 N m under lines of some 2 N m, 10 N m/V, and the torque: speeds by
/// steps of 1 µs, where friction stops the body within a step.
fn sticking() -> (Vec<f64>, Vec<f64>) {
    let (omega, damping_ratio, friction, step_s) = (TAU * 590.0, 0.02, 0.3, 1e-6);
    let lines = [
        (30.0, 0.5),
        (60.0, 1.0),
        (120.0, 1.0),
        (180.0, 0.5),
        (300.0, 0.3),
    ];
    let mut noise = Noise(7);
    let (mut x, mut speed) = (0.0, 0.0_f64);
    let (mut record, mut torque) = (Vec::new(), Vec::new());
    for k in 0..500_000 {
        let phase = |hz: f64| TAU * hz * f64::from(k) * step_s + hz;
        let applied: f64 = lines.iter().map(|(hz, a)| a * phase(*hz).sin()).sum();
        if k >= 100_000 && k % 20 == 0 {
            record.push(x / 10.0 + 1e-5 * noise.normal());
            torque.push(applied);
        }
        let free = omega * omega * (applied - x) - 2.0 * damping_ratio * omega * speed;
        let moved = speed + step_s * free;
        let stopped = moved.abs() - step_s * omega * omega * friction;
        speed = moved.signum() * stopped.max(0.0);
        x += step_s * speed;
    }
    (record, torque)
}

/// Where the body rests, dry friction takes any value up to its size: however narrow the band, this is said, with what it
/// leaves uncertain.
#[test]
fn friction_at_rest_is_uncertain_by_its_size() {
    let (record, torque) = sticking();
    let folder = Folder::new();
    folder.write(
        "record.csv",
        sampled("volts (V)", 50_000.0, record.len(), |k| record[k]),
    );
    folder.write(
        "stand.toml",
        "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"590 Hz\"\ndamping_ratio = 0.02\n\
         [calibration]\ntorque_per_volt = \"10 N m/V\"\n[[effects]]\nkind = \"coulomb-friction\"\ntorque = \"0.3 N m\"\n",
    );
    for band in ["900", "2500", "6000"] {
        let args = "compensate record.csv --stand stand.toml -o out.csv --force --json --band";
        let args: Vec<&str> = args.split(' ').chain([band]).collect();
        let report = folder.json(&args);
        let warnings = report["warnings"].as_array().unwrap().iter();
        let text = warnings
            .filter(|w| w["code"] == "direction-unknown")
            .map(|w| w["message"].as_str().unwrap())
            .next()
            .unwrap_or_else(|| panic!("{band} Hz: {report}"));
        let said: f64 = text.split(' ').rev().nth(6).unwrap().parse().unwrap();
        let found = column(&folder.read("out.csv"), "compensated_torque_n_m");
        let error = rms((4000..16_000).map(|k| found[k] - torque[k]));
        assert!(
            (0.5..1.5).contains(&(error / said)),
            "{band} Hz: {error} N m beside {said}: {text}"
        );
    }
}
