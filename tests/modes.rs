//! Stands with several modes, against a chain of three inertias on springs, independent of the solver.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use num_complex::Complex64;

use crate::noise::Noise;
use crate::util::{Folder, SIMULATE, assert_close, column, table};

pub const RATE_HZ: f64 = 20_000.0;
pub const COUNT: usize = 8000;
/// Number of samples over which the torque acts.
const ACTS: usize = 6000;
/// Number of samples at either end that depend on the extension beyond the record.
const ENDS: usize = 1500;
/// `√(K/J)` of one of the equal inertias and springs, in rad/s.
const OMEGA: f64 = TAU * 400.0;
/// Each spring has a damper of `β K`.
const BETA_S: f64 = 2e-5;

/// Angle between neighbouring inertias of the chain in mode `k` from 0: fixed at one end and free at the other (Lord
/// Rayleigh, *The Theory of Sound* I (1894), 120): `φ_k(i) = sin(i α_k)`, `ω_k = 2 √(K/J) sin(α_k/2)`.
fn turn(k: usize) -> f64 {
    (2 * k + 1) as f64 * PI / 7.0
}

pub fn omega(k: usize) -> f64 {
    2.0 * OMEGA * (0.5 * turn(k)).sin()
}

/// The stand file of the chain, with the torque on one of its inertias (1 to 3) and the gage at the grounded spring.
pub fn stand(load: usize) -> String {
    let mut text = "schema = \"torqcomp.stand/1\"\n".to_owned();
    for k in 0..3 {
        let shape = |place: usize| (place as f64 * turn(k)).sin();
        let _ = write!(
            text,
            "[[modes]]\nnatural_frequency = \"{} Hz\"\ndamping_ratio = {}\nshape_at_load = {}\nshape_at_gage = {}\n",
            omega(k) / TAU,
            0.5 * BETA_S * omega(k),
            shape(load),
            shape(1)
        );
    }
    text
}

/// Torque in N m: five tones, two of them near resonances, that start and end smoothly.
fn applied(time_s: f64) -> f64 {
    let tones = [
        (4.0, 90.0),
        (1.0, 171.0),
        (3.0, 310.0),
        (1.0, 505.0),
        (2.0, 690.0),
    ];
    let part = (time_s * RATE_HZ / ACTS as f64).clamp(0.0, 1.0);
    let sum: f64 = tones
        .iter()
        .map(|(a, hz)| a * (TAU * hz * time_s).sin())
        .sum();
    (PI * part).sin().powi(4) * sum
}

/// Gage signal, `T_o = K θ₁`: all angles are times `K`, with torques `n(x, x')` at the gage. Fourth-order Runge–Kutta
/// method.
fn row(load: usize, beside: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    row_in_steps(10, load, beside)
}

/// The same with a number of steps per sample.
fn row_in_steps(fine: usize, load: usize, beside: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    row_under(applied, (fine, load), beside)
}

/// The same under another torque over time.
pub fn row_under(
    applied: impl Fn(f64) -> f64,
    (fine, load): (usize, usize),
    beside: impl Fn(f64, f64) -> f64,
) -> Vec<f64> {
    let rates = |t: f64, s: [f64; 6]| -> [f64; 6] {
        let twist = |i: usize| match i {
            0 => s[0] + BETA_S * s[3],
            i => s[i] - s[i - 1] + BETA_S * (s[i + 3] - s[i + 2]),
        };
        let mut rates = [s[3], s[4], s[5], 0.0, 0.0, 0.0];
        for i in 0..3 {
            let mut torque = -twist(i);
            if i < 2 {
                torque += twist(i + 1);
            }
            if i + 1 == load {
                torque += applied(t);
            }
            if i == 0 {
                torque -= beside(s[0], s[3]);
            }
            rates[i + 3] = OMEGA * OMEGA * torque;
        }
        rates
    };
    let h = 1.0 / (RATE_HZ * fine as f64);
    let mut s = [0.0; 6];
    let mut shown = Vec::new();
    for step in 0..COUNT * fine {
        if step % fine == 0 {
            shown.push(s[0]);
        }
        let t = step as f64 * h;
        let moved = |k: [f64; 6], h: f64| std::array::from_fn(|i| s[i] + h * k[i]);
        let a = rates(t, s);
        let b = rates(t + 0.5 * h, moved(a, 0.5 * h));
        let c = rates(t + 0.5 * h, moved(b, 0.5 * h));
        let d = rates(t + h, moved(c, h));
        s = std::array::from_fn(|i| s[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
    }
    shown
}

/// `T_o/T` of the chain at a frequency, by elimination.
fn response(load: usize, frequency_hz: f64) -> Complex64 {
    let s = Complex64::new(0.0, TAU * frequency_hz);
    let spring = 1.0 + BETA_S * s;
    let inertia = s * s / (OMEGA * OMEGA);
    // Angles times K, for 1 of the last: from the free end to the fixed one.
    let third = Complex64::ONE;
    let unloaded = |above: Complex64, here: Complex64| {
        here + (inertia * here + spring * (here - above)) / spring
    };
    match load {
        // Beyond the load the chain is free: θ₃ = 1, θ₂ from its inertia, and θ₁ from that of θ₂.
        1 => {
            let second = third * (inertia + spring) / spring;
            let first = unloaded(third, second);
            first / (inertia * first + spring * first + spring * (first - second))
        }
        _ => {
            // The fixed end: θ₁ = 1, and outwards to the load.
            let first = Complex64::ONE;
            let second = unloaded(Complex64::ZERO, first);
            let last = unloaded(first, second);
            first / (inertia * last + spring * (last - second))
        }
    }
}

fn folder(load: usize, effects: &str, measured: &[f64]) -> Folder {
    let folder = Folder::new();
    folder.write("stand.toml", stand(load) + effects);
    let mut text = String::from("time_s,applied_n_m,measured_n_m\n");
    for (i, y) in measured.iter().enumerate() {
        let time_s = i as f64 / RATE_HZ;
        let _ = writeln!(text, "{time_s:.6},{:.9},{y:.9}", applied(time_s));
    }
    folder.write("record.csv", text);
    folder
}

/// The table of `stand.toml` over a frequency range.
fn table_of([from, to, step]: [&str; 3]) -> [&str; 9] {
    let stand = "stand.toml";
    [
        "table", "--stand", stand, "--from", from, "--to", to, "--step", step,
    ]
}

/// RMS of a difference relative to that of the whole, without the ends.
fn relative(got: &[f64], want: &[f64]) -> f64 {
    assert_eq!(got.len(), want.len());
    let inner = ENDS..want.len() - ENDS;
    let left: f64 = inner.clone().map(|i| (got[i] - want[i]).powi(2)).sum();
    (left / inner.map(|i| want[i].powi(2)).sum::<f64>()).sqrt()
}

/// Output of `simulate` for the applied torque, and of `compensate` for the record; each with its relative
/// error.
fn both_ways(folder: &Folder, measured: &[f64], more: &[&str]) -> [f64; 2] {
    let simulate = [&SIMULATE[..], &["-o", "answer.csv", "--force"]].concat();
    folder.run(&simulate).says(0, &[]);
    let compensate = [
        &[
            "compensate",
            "record.csv",
            "--stand",
            "stand.toml",
            "--channel",
            "measured_n_m",
        ][..],
        &["--band", "900", "-o", "torque.csv", "--force"],
        more,
    ];
    folder.run(&compensate.concat()).says(0, &[]);
    let truth: Vec<f64> = (0..COUNT).map(|i| applied(i as f64 / RATE_HZ)).collect();
    [
        relative(&column(&folder.read("answer.csv"), "measured"), measured),
        relative(
            &column(&folder.read("torque.csv"), "compensated_torque_n_m"),
            &truth,
        ),
    ]
}

#[test]
fn three_modes_are_simulated_and_taken_back() {
    for load in [1, 3] {
        let measured = row(load, |_, _| 0.0);
        let folder = folder(load, "", &measured);
        for whole in [&[][..], &["--whole-record"]] {
            let [forwards, backwards] = both_ways(&folder, &measured, whole);
            println!("load {load} {whole:?}: {forwards:e} {backwards:e}");
            assert!(forwards < 2e-4, "{load}: {forwards:e}");
            assert!(backwards < 2e-4, "{load} {whole:?}: {backwards:e}");
        }
    }
}

/// A hardening spring and dry friction, both at the gage, with the torque on another inertia.
#[test]
fn torques_at_the_gage_push_every_mode() {
    let effects = "[[effects]]\nkind = \"cubic-stiffness\"\nform = \"beside\"\ncoefficient = \"2e-4 N m/(N m)^3\"\n\
                   [[effects]]\nkind = \"coulomb-friction\"\nform = \"tanh\"\ntorque = \"0.5 N m\"\n\
                   transition_speed = \"300 N m/s\"\n";
    for load in [1, 3] {
        let law = |x: f64, speed: f64| 2e-4 * x.powi(3) + 0.5 * (speed / 300.0).tanh();
        let measured = row(load, law);
        let plain = relative(&row(load, |_, _| 0.0), &measured);
        assert!(plain > 0.05, "the torques hardly matter: {plain}");
        let folder = folder(load, effects, &measured);
        let [forwards, backwards] = both_ways(&folder, &measured, &[]);
        println!("load {load}: {forwards:e} {backwards:e} of {plain:e}");
        assert!(forwards < 1e-4, "{load}: {forwards:e}");
        // Harmonics beyond the band are excluded; where load and gage are apart, H falls with the sixth power there.
        assert!(backwards < 2e-2, "{load}: {backwards:e}");
    }
}

/// Sharp dry friction against the limit of the smooth one, which the reference can integrate.
#[test]
fn sharp_friction_holds_the_gage_while_other_parts_move() {
    let effect =
        "[[effects]]\nkind = \"coulomb-friction\"\nform = \"sharp\"\ntorque = \"1.5 N m\"\n";
    let measured = row_in_steps(200, 3, |_, speed| 1.5 * (speed / 2.0).tanh());
    let folder = folder(3, effect, &measured);
    let args = SIMULATE;
    let ran = folder.run(&args);
    let found = column(&ran.stdout, "measured");
    let error = relative(&found, &measured);
    println!("{error:e}");
    assert!(error < 5e-3, "{error:e}");
}

#[test]
fn a_table_is_that_of_the_row() {
    for load in [1, 3] {
        let folder = folder(load, "", &[0.0; 2]);
        let args = table_of(["0", "900", "37"]);
        let (_, rows) = table(&folder.run(&args).stdout);
        assert_eq!(rows.len(), 25);
        for row in rows {
            let want = response(load, row[0]).inv();
            assert_close(row[1], want.norm(), 1e-6);
            let turn = (row[2].to_radians() - want.arg()).rem_euclid(TAU);
            assert!(turn.min(TAU - turn) < 1e-6, "{row:?} {want}");
        }
    }
}

/// For two modes and a remainder, `∂ ln H⁻¹/∂r₁ = (1 − H₁)/H`: a residue gains what the modes above the band
/// lose.
#[test]
fn an_uncertain_residue_is_propagated() {
    let folder = Folder::new();
    let mode = |hz: f64, residue: &str| {
        format!(
            "[[modes]]\nnatural_frequency = \"{hz} Hz\"\ndamping_ratio = 0.02\nresidue = {residue}\n"
        )
    };
    let text = "schema = \"torqcomp.stand/1\"\n".to_owned()
        + &mode(100.0, "{ value = \"0.8\", std = \"0.01\" }")
        + &mode(300.0, "0.15");
    folder.write("stand.toml", text);
    let args = [&table_of(["80", "400", "80"])[..], &["--uncertainty"]].concat();
    let (heads, rows) = table(&folder.run(&args).stdout);
    assert_eq!(heads[3], "magnitude_relative_std");
    for row in &rows {
        let one = |hz: f64| {
            let w = row[0] / hz;
            Complex64::new(1.0 - w * w, 0.04 * w).inv()
        };
        let whole = 0.8 * one(100.0) + 0.15 * one(300.0) + 0.05;
        let slope = (1.0 - one(100.0)) / whole;
        assert_close(row[3], 0.01 * slope.re.abs(), 1e-3);
        assert_close(row[4], (0.01 * slope.im.abs()).to_degrees(), 1e-3);
    }
}

#[test]
fn harmonics_divide_by_the_response_of_the_sum() {
    let rate_hz = 20_000.0;
    let sent = [50.0, 150.0, 450.0].map(|hz| (hz, response(3, hz)));
    let wave = |i: usize| -> f64 {
        let t = i as f64 / rate_hz;
        sent.iter()
            .map(|(hz, h)| 2.0 * h.norm() * (TAU * hz * t + h.arg()).cos())
            .sum()
    };
    let folder = folder(3, "", &[]);
    let mut text = String::from("time_s,measured_n_m\n");
    for i in 0..20_000 {
        let _ = writeln!(text, "{:.6},{:.9}", i as f64 / rate_hz, wave(i));
    }
    folder.write("steady.csv", text);
    let args = [
        "harmonics",
        "steady.csv",
        "--stand",
        "stand.toml",
        "--fundamental",
        "50",
        "--orders",
        "1-9",
        "--json",
    ];
    let report = folder.json(&args);
    for order in [1, 3, 9] {
        let found = &report["components"][order - 1]["torque"];
        assert_close(found.as_f64().unwrap(), 2.0, 1e-5);
    }
}

#[test]
fn what_several_modes_cannot_do_is_said() {
    let folder = folder(1, "", &row(1, |_, _| 0.0));
    let text = stand(1).replacen('\n', "\n[mechanics]\nmeasures = \"acceleration\"\n", 1);
    folder.write("faster.toml", text);
    let args = [
        "compensate",
        "record.csv",
        "--stand",
        "faster.toml",
        "--channel",
        "measured_n_m",
    ];
    folder.run(&args).says(1, &["acceleration", "harmonics"]);
}

/// Periods of tones every 2.5 Hz through the chain, with noise, and the modes found by `identify response`.
#[test]
fn modes_of_a_response_are_written_and_used() {
    const PERIOD: usize = 8000;
    let step_hz = RATE_HZ / PERIOD as f64;
    let mut noise = Noise(5);
    let lines = 24..360;
    let phases: Vec<f64> = lines.clone().map(|_| TAU * noise.normal()).collect();
    let periodic = |part: &dyn Fn(f64) -> Complex64| -> Vec<f64> {
        let tones: Vec<(f64, Complex64)> = lines
            .clone()
            .zip(&phases)
            .map(|(k, phase)| {
                let hz = k as f64 * step_hz;
                (TAU * hz / RATE_HZ, part(hz) * Complex64::cis(*phase))
            })
            .collect();
        let at = |i: usize| {
            tones
                .iter()
                .map(|(turn, z)| (z * Complex64::cis(turn * i as f64)).re)
                .sum()
        };
        (0..PERIOD).map(at).collect()
    };
    let load = 3;
    let (applied, answer) = (
        periodic(&|_| Complex64::ONE),
        periodic(&|hz| response(load, hz)),
    );
    let mut text = String::from("time_s,applied_n_m,measured_n_m\n");
    for i in 0..4 * PERIOD {
        let y = answer[i % PERIOD] + 0.02 * noise.normal();
        let _ = writeln!(
            text,
            "{:.6},{:.6},{y:.6}",
            i as f64 / RATE_HZ,
            applied[i % PERIOD]
        );
    }
    let folder = Folder::new();
    folder.write("periods.csv", text);
    let command = "identify response periods.csv --applied applied_n_m --measured measured_n_m --excitation periodic --period 8000 \
                   --band 60..900 --modes 3 -o found.toml --json";
    let report = folder.json(
        &command
            .split(' ')
            .filter(|word| !word.is_empty())
            .collect::<Vec<_>>(),
    );
    let sum: f64 = (0..3).map(|k| share(k, load)).sum();
    for k in 0..3 {
        let found = |what: &str| {
            let name = format!("mode_{}_{what}", k + 1);
            let all = report["parameters"].as_array().unwrap();
            let one = all.iter().find(|p| p["name"] == *name).unwrap();
            [&one["value"], &one["std"]].map(|number| number.as_f64().unwrap())
        };
        let wanted = [
            ("natural_frequency", omega(k) / TAU),
            ("damping_ratio", 0.5 * BETA_S * omega(k)),
            ("residue", share(k, load) / sum),
            ("quadrature", 0.0),
        ];
        for (what, want) in wanted {
            let [value, std] = found(what);
            println!("{k} {what}: {value} ± {std}, {want}");
            assert!(
                (value - want).abs() < 5.0 * std && std < 0.02 * want.abs().max(0.1),
                "{k} {what}: {value} ± {std}, {want}"
            );
        }
    }
    let written = folder.read("found.toml");
    for part in [
        "[[modes]]",
        "residue = { value",
        "std = ",
        "correlation_",
        "source = \"identify response: periods.csv\"",
    ] {
        assert!(written.contains(part), "{part}: {written}");
    }
    let args = [
        "table",
        "--stand",
        "found.toml",
        "--from",
        "60",
        "--to",
        "800",
        "--step",
        "74",
        "--uncertainty",
    ];
    let (_, rows) = table(&folder.run(&args).stdout);
    for row in rows {
        let want = response(load, row[0]).inv().norm();
        assert!(
            (row[1] / want - 1.0).abs() < 6.0 * row[3] && row[3] < 0.05,
            "{row:?} {want}"
        );
    }
}

/// `φ_k(load) φ_k(gage)/ω_k²`.
fn share(k: usize, load: usize) -> f64 {
    (load as f64 * turn(k)).sin() * turn(k).sin() / omega(k).powi(2)
}

#[test]
fn a_decay_tells_modes_but_not_their_residues() {
    let folder = Folder::new();
    let mut text = String::from("time_s,measured_n_m\n");
    let mut noise = Noise(8);
    for i in 0..12_000 {
        let t = i as f64 / RATE_HZ;
        let mode = |k: usize| (-0.5 * BETA_S * omega(k).powi(2) * t).exp() * (omega(k) * t).cos();
        let _ = writeln!(
            text,
            "{t:.6},{:.7}",
            mode(0) + 0.5 * mode(1) + 1e-3 * noise.normal()
        );
    }
    folder.write("tap.csv", text);
    let args = [
        "identify",
        "decay",
        "tap.csv",
        "--channel",
        "measured_n_m",
        "--modes",
        "2",
        "-o",
        "tap.toml",
    ];
    folder.run(&args).says(
        0,
        &["residues-unknown", "a known torque or force", "--modes 1"],
    );
    let table = ["table", "--stand", "tap.toml"];
    folder.run(&table).says(
        1,
        &[
            "tap.toml",
            "line",
            "residue is missing",
            "identify response",
        ],
    );
    // A file with its own residues keeps them, by frequency.
    let mode = |hz: u32, residue: f64| {
        format!(
            "[[modes]]\nnatural_frequency = \"{hz} Hz\"\ndamping_ratio = 0.5\nresidue = {residue}\n"
        )
    };
    folder.write(
        "tap.toml",
        "schema = \"torqcomp.stand/1\"\n".to_owned() + &mode(480, 0.125) + &mode(180, 0.875),
    );
    folder.run(&args).says(0, &[]);
    let written = folder.read("tap.toml");
    let first = written.find("residue = 0.875").unwrap();
    assert!(
        first < written.find("residue = 0.125").unwrap(),
        "{written}"
    );
    folder.run(&table).says(0, &[]);
}

/// One mode with recorded acceleration: the second derivative of the displacement, in every command that accepts
/// it.
#[test]
fn a_record_of_acceleration_is_the_second_derivative() {
    let folder = Folder::new();
    let stand = "schema = \"torqcomp.stand/1\"\n[mechanics]\nmeasures = \"acceleration\"\n\
                 static_gain = \"2e-6 (m/s^2)/N\"\n[[modes]]\nnatural_frequency = \"400 Hz\"\ndamping_ratio = 0.5\nresidue = 1\n";
    folder.write("stand.toml", stand);
    let args = table_of(["0", "400", "200"]);
    let ran = folder.run(&args);
    let lines: Vec<&str> = ran.stdout.lines().collect();
    assert_eq!(lines[1], "0,,", "no acceleration shows a constant force");
    let (_, rows) = table(&[lines[0], lines[2], lines[3]].join("\n"));
    for row in rows {
        let w = row[0] / 400.0;
        // 1 − w² + jw, over −ω².
        let want = Complex64::new(1.0 - w * w, w) / -(TAU * row[0]).powi(2);
        assert_close(row[1], want.norm(), 1e-9);
        assert!((Complex64::cis(row[2].to_radians()) - want / want.norm()).norm() < 1e-8);
    }
    let (hz, count) = (200.0, 8000);
    let mut text = String::from("time_s,force_n\n");
    for i in 0..count {
        let time_s = i as f64 / RATE_HZ;
        let _ = writeln!(text, "{time_s:.6},{:.9}", (TAU * hz * time_s).sin());
    }
    folder.write("force.csv", text);
    let args = [
        "simulate",
        "force.csv",
        "--stand",
        "stand.toml",
        "--applied",
        "force_n",
        "--unit",
        "N",
        "-o",
        "-",
    ];
    let found = column(&folder.run(&args).stdout, "measured");
    let turn = TAU * hz;
    let response = 2e-6 * -turn * turn / Complex64::new(0.75, 0.5);
    let want: Vec<f64> = (0..count)
        .map(|i| (response * Complex64::cis(turn * i as f64 / RATE_HZ)).im)
        .collect();
    let error = relative(&found, &want);
    assert!(error < 1e-4, "{error:e}");
}
