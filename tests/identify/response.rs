//! Responses: modes from noise, accuracy and coverage of the intervals.

use nalgebra::DMatrix;
use num_complex::Complex64;
use serde_json::Value;
use torqcomp::identify::{Identification, response};

use super::{Coverage, Noise, TAU, of, parameter};
use crate::util::{Folder, assert_close};

/// Noise up to a frequency in Hz and the response of a 60 Hz mode with a damping ratio: a part of a longer period, the
/// response times the spectrum, so that only the truncation at both ends is approximate.
pub(super) fn driven(
    count: usize,
    (top_hz, ratio): (f64, f64),
    noise: &mut Noise,
) -> (Vec<f64>, Vec<f64>) {
    let none = |_: f64| Complex64::ONE;
    driven_behind(count, (top_hz, ratio), [&none, &none], noise)
}

/// The same behind filters of the applied and of the measured channel.
pub(super) fn driven_behind(
    count: usize,
    (top_hz, ratio): (f64, f64),
    [of_applied, of_measured]: [&dyn Fn(f64) -> Complex64; 2],
    noise: &mut Noise,
) -> (Vec<f64>, Vec<f64>) {
    let length = (count * 3 / 2).next_power_of_two();
    let step = RATE_HZ / length as f64;
    let plan = torqcomp_fourier::inverse(length);
    let mut spectrum = vec![Complex64::ZERO; length / 2 + 1];
    for line in &mut spectrum[1..(top_hz / step) as usize] {
        *line = Complex64::new(noise.normal(), noise.normal());
    }
    let signal = |mut lines: Vec<Complex64>| {
        let mut out = vec![0.0; length];
        plan.process(&mut lines, &mut out).expect("lengths match");
        out.truncate(count);
        out
    };
    let all = || spectrum.iter().enumerate();
    let hertz = |k: usize| step * k as f64;
    let applied = all().map(|(k, x)| x * of_applied(hertz(k)));
    let answer = |k: usize| response_at(TAU * hertz(k), NATURAL, ratio) * of_measured(hertz(k));
    let shown = all().map(|(k, x)| x * answer(k));
    (signal(applied.collect()), signal(shown.collect()))
}

#[test]
fn a_mode_is_found_from_noise() {
    let mut noise = Noise(16);
    let (applied, shown) = driven(60_000, (250.0, RATIO), &mut noise);
    let size = 0.01 * (shown.iter().map(|v| v * v).sum::<f64>() / shown.len() as f64).sqrt();
    let measured: Vec<f64> = shown.iter().map(|v| v + size * noise.normal()).collect();
    let record = response::Driven {
        name: "n",
        rate_hz: 1000.0,
        applied: &applied,
        measured: &measured,
    };
    let options = response::ResponseOptions {
        band_hz: Some((20.0, 150.0)),
        ..Default::default()
    };
    let found = response::identify(&[record], &options).unwrap();
    let poles: Vec<_> = found.modes.iter().map(|mode| mode.pole()).collect();
    let first = poles
        .iter()
        .find(|p| (p.omega_rad_per_s / TAU - 60.0).abs() < 0.3);
    let pole = first.unwrap_or_else(|| panic!("{:?}", found.parameters));
    assert_close(pole.rate_per_s, 0.03 * TAU * 60.0, 0.005);
}

/// A stand with one mode at 60 Hz, a damping ratio of 0.03 and a static gain of 1.
const NATURAL: f64 = TAU * 60.0;
const RATIO: f64 = 0.03;
const RATE_HZ: f64 = 1000.0;

/// H(jω) = ω_n²/(ω_n² − ω² + 2jζω_nω).
fn response_at(omega: f64, natural: f64, ratio: f64) -> Complex64 {
    natural * natural
        / Complex64::new(
            natural * natural - omega * omega,
            2.0 * ratio * natural * omega,
        )
}

/// Periods of a signal with lines up to 200 Hz of equal amplitude and random phases, and the
/// steady-state response.
fn periods(length: usize, count: usize, noise: &mut Noise) -> (Vec<f64>, Vec<f64>) {
    let step = RATE_HZ / length as f64;
    let lines: Vec<(f64, f64)> = (1..(200.0 / step) as usize)
        .map(|k| (TAU * step * k as f64, TAU * noise.uniform()))
        .collect();
    let one = |i: usize, shape: &dyn Fn(f64) -> Complex64| -> f64 {
        let t = i as f64 / RATE_HZ;
        let line = |(w, p): &(f64, f64)| (shape(*w) * Complex64::cis(w * t + p)).re;
        lines.iter().map(line).sum()
    };
    let many = |shape: &dyn Fn(f64) -> Complex64| -> Vec<f64> {
        let first: Vec<f64> = (0..length).map(|i| one(i, shape)).collect();
        first.iter().copied().cycle().take(length * count).collect()
    };
    let applied = many(&|_| Complex64::ONE);
    (applied, many(&|w| response_at(w, NATURAL, RATIO)))
}

/// Displacement of a mode of 60 Hz and damping ratio 0.03 under a force, with a static gain of 1; both at 1 kHz.
pub(super) fn driven_by(force: impl Fn(f64) -> f64, count: usize) -> (Vec<f64>, Vec<f64>) {
    driven_mode(NATURAL, force, count)
}

/// The same for any natural frequency in rad/s, by the Runge–Kutta method in 16 steps per sample.
pub(super) fn driven_mode(
    natural: f64,
    force: impl Fn(f64) -> f64,
    count: usize,
) -> (Vec<f64>, Vec<f64>) {
    let (ratio, steps) = (RATIO, 16);
    let h = 1.0 / RATE_HZ / f64::from(steps);
    let slope =
        |t: f64, x: f64, v: f64| natural * natural * (force(t) - x) - 2.0 * ratio * natural * v;
    let (mut x, mut v) = (0.0, 0.0);
    let (mut applied, mut shown) = (Vec::new(), Vec::new());
    for i in 0..count {
        applied.push(force(i as f64 * 1e-3));
        shown.push(x);
        for k in 0..steps {
            let t = i as f64 * 1e-3 + f64::from(k) * h;
            let a = slope(t, x, v);
            let b = slope(t + h / 2.0, x + h / 2.0 * v, v + h / 2.0 * a);
            let c = slope(
                t + h / 2.0,
                x + h / 2.0 * (v + h / 2.0 * a),
                v + h / 2.0 * b,
            );
            let d = slope(t + h, x + h * (v + h / 2.0 * b), v + h * c);
            x += h * v + h * h / 6.0 * (a + b + c);
            v += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
        }
    }
    (applied, shown)
}

/// Hits a second apart, bell-shaped with 3 ms to both sides, and the response.
fn hits(count: usize) -> (Vec<f64>, Vec<f64>) {
    let (applied, shown) = driven_by(|t| (-0.5 * ((t - 0.05) / 0.003).powi(2)).exp(), 1000);
    let many = |one: &[f64]| one.iter().copied().cycle().take(1000 * count).collect();
    (many(&applied), many(&shown))
}

/// The measured signal with noise `decibel` below it.
fn noisy(shown: &[f64], decibel: f64, noise: &mut Noise) -> (Vec<f64>, f64) {
    let mean = shown.iter().map(|v| v * v).sum::<f64>() / shown.len() as f64;
    let size = 10_f64.powf(-decibel / 20.0) * mean.sqrt();
    (
        shown.iter().map(|v| v + size * noise.normal()).collect(),
        size,
    )
}

fn one_mode(applied: &[f64], measured: &[f64], how: response::Excitation) -> Identification {
    let record = response::Driven {
        name: "simulated",
        rate_hz: RATE_HZ,
        applied,
        measured,
    };
    let options = response::ResponseOptions {
        excitation: Some(how),
        band_hz: Some((20.0, 150.0)),
        modes: Some(1),
        ..Default::default()
    };
    response::identify(&[record], &options).unwrap()
}

/// Coverage of the true frequency, damping ratio and static gain in 240 records, 20 to 60 dB.
fn coverage_of(how: response::Excitation, seed: u64) -> [Coverage; 3] {
    let mut noise = Noise(seed);
    let mut covered = [0; 3].map(|_| Coverage::default());
    let struck = hits(6);
    for k in 0..240 {
        let (applied, shown) = match how {
            response::Excitation::Impact | response::Excitation::Transient => struck.clone(),
            response::Excitation::Periodic => periods(500, 7, &mut noise),
            response::Excitation::Random => driven(20_000, (250.0, RATIO), &mut noise),
        };
        let (measured, _) = noisy(&shown, [20.0, 30.0, 40.0, 50.0, 60.0][k % 5], &mut noise);
        let found = one_mode(&applied, &measured, how);
        let codes: Vec<&str> = found.warnings.iter().map(|w| w.code).collect();
        assert!(!codes.contains(&"leakage"), "{how:?}: {codes:?}");
        let truth = [NATURAL / TAU, RATIO, 1.0];
        for ((name, truth), coverage) in ["natural_frequency", "damping_ratio", "static_gain"]
            .iter()
            .zip(truth)
            .zip(&mut covered)
        {
            coverage.count(of(&found, name), truth);
        }
    }
    covered
}

#[test]
fn intervals_of_responses_cover_the_truth() {
    use response::Excitation::{Impact, Periodic, Random};
    let all = std::thread::scope(|scope| {
        let one = |(how, seed)| scope.spawn(move || coverage_of(how, seed));
        let handles = [(Impact, 21), (Periodic, 22), (Random, 23)].map(one);
        handles.map(|h| h.join().expect("the records are evaluated"))
    });
    for (covered, how) in all.iter().zip([Impact, Periodic, Random]) {
        covered[0].check(&format!("{how:?}, frequency"));
        covered[1].check(&format!("{how:?}, damping"));
        covered[2].check(&format!("{how:?}, static gain"));
    }
}

/// Minimum relative standard deviations of ω_n and ζ, from lines of one block with applied spectrum
/// `applied`, noise of that power per line and `blocks` blocks. Also unknown: gain and phase of the mode,
/// a constant, and a term 1/ω² for modes outside the band, as in the fitted model.
fn least_std(lines: &[(f64, f64)], noise_power: f64, blocks: f64) -> [f64; 2] {
    let columns = |omega: f64| {
        let h = response_at(omega, NATURAL, RATIO);
        let small = 1e-6;
        let by_natural = (response_at(omega, NATURAL * (1.0 + small), RATIO) - h) / small;
        let by_ratio = (response_at(omega, NATURAL, RATIO * (1.0 + small)) - h) / small;
        // The residue's real and imaginary part: a gain, and a gain in quadrature proportional to
        // ω.
        let turned = h * Complex64::new(0.0, omega / NATURAL);
        let far = Complex64::new((NATURAL / omega).powi(2), 0.0);
        [by_natural, by_ratio, h, turned, Complex64::ONE, far]
    };
    let mut information = DMatrix::<f64>::zeros(6, 6);
    for (omega, applied_power) in lines {
        let row = columns(*omega);
        for i in 0..6 {
            for j in 0..6 {
                // Real and imaginary part each have half the noise power.
                let both = (row[i].conj() * row[j]).re;
                information[(i, j)] += 2.0 * blocks * applied_power * both / noise_power;
            }
        }
    }
    let bound = information.try_inverse().expect("regular");
    [bound[(0, 0)].sqrt(), bound[(1, 1)].sqrt()]
}

/// Errors of the frequency and damping ratio of 120 records, with 40 dB noise added to the measured signal:
/// each within 0.02 % and 1 %. Returns relative mean squares, and the noise's standard deviation.
fn squares_at_40_decibels(
    how: response::Excitation,
    applied: &[f64],
    shown: &[f64],
    noise: &mut Noise,
) -> ([f64; 2], f64) {
    const RUNS: usize = 120;
    let (mut squares, mut std) = ([0.0; 2], 0.0);
    for _ in 0..RUNS {
        let measured;
        (measured, std) = noisy(shown, 40.0, noise);
        let found = one_mode(applied, &measured, how);
        let frequency = of(&found, "natural_frequency").value() * TAU / NATURAL - 1.0;
        let ratio = of(&found, "damping_ratio").value() / RATIO - 1.0;
        assert!(
            frequency.abs() < 2e-4 && ratio.abs() < 1e-2,
            "{how:?}: {frequency} {ratio}"
        );
        squares[0] += frequency.powi(2) / RUNS as f64;
        squares[1] += ratio.powi(2) / RUNS as f64;
    }
    (squares, std)
}

/// The spread is no more than 1.3 times the bound.
fn check_against(least: [f64; 2], squares: [f64; 2]) {
    for i in 0..2 {
        let ratio = squares[i].sqrt() / least[i];
        println!("std {:.2e}, over the bound {ratio:.3}", squares[i].sqrt());
        assert!(ratio < 1.3, "{i}: {ratio} times the bound");
    }
}

#[test]
fn responses_are_as_exact_as_the_noise_allows() {
    let mut noise = Noise(24);
    let (length, used) = (1000, 8);
    let (applied, shown) = periods(length, used + 1, &mut noise);
    let how = response::Excitation::Periodic;
    let (squares, std) = squares_at_40_decibels(how, &applied, &shown, &mut noise);
    // A line of size 1 has the spectrum n/2, white noise n·s².
    let n = length as f64;
    let lines: Vec<(f64, f64)> = (20..=150)
        .map(|k| (TAU * f64::from(k) * RATE_HZ / n, (n / 2.0).powi(2)))
        .collect();
    check_against(least_std(&lines, n * std * std, used as f64), squares);
}

/// A mode 4 lines of a segment wide, from noise: the bound is that of all lines of the whole record with
/// known ends.
#[test]
fn responses_to_noise_are_as_exact_as_the_noise_allows() {
    let mut noise = Noise(26);
    let count = 20_000;
    let (applied, shown) = driven(count, (250.0, RATIO), &mut noise);
    let how = response::Excitation::Random;
    let (squares, std) = squares_at_40_decibels(how, &applied, &shown, &mut noise);
    let mut spectrum = vec![Complex64::ZERO; count / 2 + 1];
    let plan = torqcomp_fourier::forward(count);
    plan.process(&mut applied.clone(), &mut spectrum)
        .expect("lengths match");
    let step = RATE_HZ / count as f64;
    let lines: Vec<(f64, f64)> = ((20.0 / step) as usize..=(150.0 / step) as usize)
        .map(|k| (TAU * step * k as f64, spectrum[k].norm_sqr()))
        .collect();
    check_against(least_std(&lines, count as f64 * std * std, 1.0), squares);
}

/// Torque in, torque out gives f/K and J/K; the stiffness of the stand file converts them to
/// constants.
#[test]
fn constants_follow_from_a_declared_stiffness_with_its_uncertainty() {
    let folder = Folder::new();
    let mut noise = Noise(25);
    let (applied, shown) = periods(500, 7, &mut noise);
    let (measured, _) = noisy(&shown, 40.0, &mut noise);
    let rows: String = (0..applied.len())
        .map(|i| format!("{},{},{}\n", i as f64 / RATE_HZ, applied[i], measured[i]))
        .collect();
    folder.write("sweep.csv", format!("time_s,applied_N m,beam_N m\n{rows}"));
    let stand = "schema = \"torqcomp.stand/1\"\n[mechanics]\n\
                 stiffness = { value = \"5000 N m/rad\", std = \"50 N m/rad\" }\n";
    folder.write("declared.toml", stand);
    let args = [
        "identify",
        "response",
        "sweep.csv",
        "--applied",
        "applied",
        "--measured",
        "beam",
        "--modes",
        "1",
        "--band",
        "20..150",
        "--json",
    ];
    let bare = folder.json(&args);
    let codes = |report: &Value| report["warnings"].to_string();
    assert!(codes(&bare).contains("not-anchored"), "{}", codes(&bare));
    let names = bare["parameters"].to_string();
    assert!(
        !names.contains("\"stiffness\"") && !names.contains("\"inertia\""),
        "{names}"
    );
    let (ratio, ratio_std, unit) = parameter(&bare, "inertia_over_stiffness");
    assert_close(ratio, NATURAL.powi(-2), 1e-3);
    assert!(unit == "s^2" && ratio_std.is_some_and(|s| s < 1e-3 * ratio));
    assert_close(
        parameter(&bare, "damping_over_stiffness").0,
        2.0 * RATIO / NATURAL,
        1e-2,
    );
    let report = folder.json(&[&args[..], &["--stand", "declared.toml"]].concat());
    let (inertia, std, _) = parameter(&report, "inertia");
    assert_close(inertia, 5000.0 / NATURAL.powi(2), 1e-3);
    // The 1 % of the declared stiffness and the record's own contribution.
    assert!(
        (0.0099..0.0102).contains(&(std.unwrap() / inertia)),
        "{std:?}"
    );
    let (damping, std, _) = parameter(&report, "damping");
    assert_close(damping, 5000.0 * 2.0 * RATIO / NATURAL, 1e-2);
    assert!(std.unwrap() / damping > 0.0099);
    let pairs = report["correlations"].to_string();
    assert!(
        pairs.contains("inertia") && pairs.contains("stiffness"),
        "{pairs}"
    );
}

/// Torque in, motion out gives J, f and K, whatever the units and the excitation; they are written to the
/// stand file.
#[test]
fn all_constants_follow_from_a_torque_and_the_motion_it_makes() {
    let folder = Folder::new();
    let (inertia, stiffness) = (0.02, 0.02 * NATURAL * NATURAL);
    let damping = 2.0 * RATIO * NATURAL * inertia;
    let mut noise = Noise(27);
    let (applied, shown) = driven(20_000, (250.0, RATIO), &mut noise);
    let (measured, _) = noisy(&shown, 40.0, &mut noise);
    // Angles in degrees and torques in pound feet; a static gain of 1 is one rad for K.
    let rows: String = (0..applied.len())
        .map(|i| {
            let degrees = (measured[i] / stiffness).to_degrees();
            let pound_feet = applied[i] / 1.355_817_948_331_400_4;
            format!("{},{pound_feet},{degrees}\n", i as f64 / RATE_HZ)
        })
        .collect();
    folder.write(
        "noise.csv",
        format!("time_s,motor_ft lbf,shaft_deg\n{rows}"),
    );
    let stand = "schema = \"torqcomp.stand/1\"\n# kept\n[mechanics]\nstiffness = \"1 N m/rad\"\n";
    folder.write("stand.toml", stand);
    let args = [
        "identify",
        "response",
        "noise.csv",
        "--applied",
        "motor",
        "--measured",
        "shaft",
        "--modes",
        "1",
        "--band",
        "20..150",
        "--json",
        "-o",
        "stand.toml",
    ];
    let report = folder.json(&args);
    let warnings = report["warnings"].to_string();
    assert!(
        !warnings.contains("anchor") && !warnings.contains("turned"),
        "{warnings}"
    );
    for (name, truth) in [
        ("inertia", inertia),
        ("damping", damping),
        ("stiffness", stiffness),
    ] {
        let (value, std, _) = parameter(&report, name);
        let std = std.expect("the data tell it");
        assert_close(value, truth, 2e-3);
        assert!(
            (value - truth).abs() < 3.5 * std && std < 2e-3 * truth,
            "{name}: {value} ± {std}"
        );
    }
    let written = folder.read("stand.toml");
    assert!(
        written.contains("# kept") && written.contains("inertia"),
        "{written}"
    );
    assert!(!written.contains("\"1 N m/rad\""), "{written}");
    // The errors of J and K are correlated: below the resonance the inverse is 1 − r², which only the frequency
    // changes, by 2 r²/(1 − r²) of its relative error.
    let (frequency, std, _) = parameter(&report, "natural_frequency");
    let table = [
        "table",
        "--stand",
        "stand.toml",
        "--from",
        "42",
        "--to",
        "42",
        "--uncertainty",
        "--json",
    ];
    let stated = folder.json(&table)["rows"][0]["magnitude_relative_std"].as_f64();
    let square = (42.0 / frequency) * (42.0 / frequency);
    let expected = 2.0 * square / (1.0 - square) * std.expect("the data tell it") / frequency;
    assert_close(stated.expect("an uncertainty"), expected, 0.05);
    // A motion opposite to the torque is rejected.
    let turned: String = rows
        .lines()
        .map(|row| {
            let (front, angle) = row.rsplit_once(',').expect("three columns");
            match angle.strip_prefix('-') {
                Some(angle) => format!("{front},{angle}\n"),
                None => format!("{front},-{angle}\n"),
            }
        })
        .collect();
    folder.write(
        "against.csv",
        format!("time_s,motor_ft lbf,shaft_deg\n{turned}"),
    );
    let mut args = args;
    args[2] = "against.csv";
    folder.run(&args).says(1, &["wrong sign"]);
}

/// Intervals of J, f and K, for every type of excitation.
#[test]
fn intervals_of_constants_cover_the_truth() {
    use response::Excitation::{Impact, Periodic, Random};
    let mut covered = [0; 3].map(|_| Coverage::default());
    let mut noise = Noise(28);
    let struck = hits(6);
    for k in 0..240 {
        let how = [Impact, Periodic, Random][k % 3];
        let (applied, shown) = match how {
            Periodic => periods(500, 7, &mut noise),
            Random => driven(8_000, (250.0, RATIO), &mut noise),
            _ => struck.clone(),
        };
        let decibel = [20.0, 30.0, 40.0, 50.0, 60.0][k / 3 % 5];
        let (measured, _) = noisy(&shown, decibel, &mut noise);
        let found = one_mode(&applied, &measured, how);
        // A static gain of 1: K = 1.
        let truth = [NATURAL.powi(-2), 2.0 * RATIO / NATURAL, 1.0];
        let found = found.modes[0].stand_constants().expect("a residue");
        for ((found, truth), coverage) in found.list.iter().zip(truth).zip(&mut covered) {
            coverage.count(found, truth);
        }
    }
    for (coverage, name) in covered.iter().zip(["inertia", "damping", "stiffness"]) {
        coverage.check(name);
    }
}

/// A hammer in N at an arm of 0.12 m and a bridge that gives 0.5 V per N m: 2 N m/V, written if the stand file has no
/// calibration, and not if weights have determined it.
#[test]
fn a_hammer_at_an_arm_gives_the_torque_of_a_volt() {
    let folder = Folder::new();
    let (torque, shown) = hits(5);
    let mut noise = Noise(31);
    let (shown, _) = noisy(&shown, 50.0, &mut noise);
    let mut text = "time_s,hammer [N],bridge [V]\n".to_owned();
    for (i, (torque, shown)) in torque.iter().zip(&shown).enumerate() {
        text += &format!(
            "{},{:.9},{:.9}\n",
            i as f64 / RATE_HZ,
            torque / 0.12,
            0.5 * shown
        );
    }
    folder.write("hits.csv", text);
    let args = [
        "identify",
        "response",
        "hits.csv",
        "--applied",
        "hammer",
        "--measured",
        "bridge",
        "--band",
        "20..150",
        "--radius",
        "120 mm",
        "--json",
        "-o",
        "hammer.toml",
    ];
    let report = folder.json(&args);
    let named = |name: &str| {
        let all = report["parameters"].as_array().unwrap();
        all.iter().find(|p| p["name"] == name).unwrap().clone()
    };
    let gain = named("static_gain");
    assert_eq!(gain["unit"], "V/(N m)");
    let constant = named("torque_per_volt");
    let (value, std) = (
        constant["value"].as_f64().unwrap(),
        constant["std"].as_f64().unwrap(),
    );
    assert!(
        (value - 2.0).abs() < 4.0 * std && std < 0.02,
        "{value} {std}"
    );
    let relative = gain["std"].as_f64().unwrap() / gain["value"].as_f64().unwrap();
    assert_close(std / value, relative, 1e-9);
    let stand = folder.read("hammer.toml");
    assert!(
        stand.contains("[calibration]\ntorque_per_volt = {"),
        "{stand}"
    );
    folder.write(
        "run.csv",
        "time_s,bridge [V]\n0,1\n0.001,1\n0.002,1\n0.003,1\n",
    );
    let ran = folder.run(&[
        "compensate",
        "run.csv",
        "--stand",
        "hammer.toml",
        "--band",
        "100",
        "-q",
    ]);
    assert!(
        ran.code == 0 && ran.stdout.contains(",2.0") | ran.stdout.contains(",1.9"),
        "{ran:?}"
    );
    // The stand of the thesis has a calibration, which is kept.
    folder.write(
        "by-weights.toml",
        "schema = \"torqcomp.stand/1\"\n[calibration]\ntorque_per_volt = \"2.01 N m/V\"\n",
    );
    folder.json(&[&args[..13], &["by-weights.toml"]].concat());
    let stand = folder.read("by-weights.toml");
    assert!(
        stand.contains("\"2.01 N m/V\"") && stand.contains("natural_frequency"),
        "{stand}"
    );
    // A radius converts only a force to a torque.
    let mut wrong = args.to_vec();
    wrong[4] = "bridge";
    wrong[6] = "hammer";
    folder
        .run(&wrong)
        .says(2, &["--radius goes with a force", "in V"]);
}
