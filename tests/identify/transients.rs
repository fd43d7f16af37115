//! Responses to torques that come on or off, and to hits that follow each other.

use torqcomp::identify::{Identification, response};

use super::{Noise, TAU, of, ramped};

/// One mode, whatever the excitation.
fn one_mode(applied: &[f64], measured: &[f64], rate_hz: f64) -> Identification {
    let record = response::Driven {
        name: "simulated",
        rate_hz,
        applied,
        measured,
    };
    let options = response::ResponseOptions {
        modes: Some(1),
        ..response::ResponseOptions::default()
    };
    response::identify(&[record], &options).unwrap()
}

/// A torque that is put on or taken off, early or late in a record, with noise or without, shows the resonance without a
/// word on the kind of excitation.
#[test]
fn a_torque_that_comes_on_or_off_is_a_transient() {
    let mut noise = Noise(21);
    let (omega, damping_ratio) = (TAU * 180.0, 0.015);
    for (size, early) in [(0.0, true), (0.01, true), (1e-3, false)] {
        for is_off in [false, true] {
            let from = if early { 800 } else { 6000 };
            let (decay, damped) = (damping_ratio * omega, omega * (1.0_f64 - 2.25e-4).sqrt());
            let step = |k: usize| {
                let t = (k as f64 - from as f64 + 0.5) / 4000.0;
                let ringing = (damped * t).cos() + decay / damped * (damped * t).sin();
                let risen = (1.0 - (-decay * t).exp() * ringing) * f64::from(u8::from(k >= from));
                if is_off { 1.0 - risen } else { risen }
            };
            let on = |k: usize| f64::from(u8::from((k >= from) != is_off));
            let applied: Vec<f64> = (0..16_000).map(|k| on(k) + size * noise.normal()).collect();
            let measured: Vec<f64> = (0..16_000)
                .map(|k| step(k) + 2e-3 * noise.normal())
                .collect();
            let found = one_mode(&applied, &measured, 4000.0);
            let what = format!("noise {size}, from {from}, off {is_off}");
            let (hz, ratio) = (
                of(&found, "natural_frequency").value(),
                of(&found, "damping_ratio").value(),
            );
            assert!((hz - 180.0).abs() < 0.5, "{what}: {hz} Hz");
            assert!((ratio - damping_ratio).abs() < 0.002, "{what}: {ratio}");
        }
    }
}

/// Twelve hits of 5 ms, 0.25 s or 1 s apart, on a stand that still rings at 1.4 % after 0.25 s.
#[test]
fn hits_that_follow_soon_are_used_and_named() {
    let (omega, damping_ratio, rate_hz) = (TAU * 180.0, 0.015, 10_000.0);
    for (apart_s, overlaps) in [(0.25, true), (1.0, false)] {
        let mut noise = Noise(26);
        let hits = 12;
        let (mut x, mut speed, step_s) = (0.0, 0.0, 1e-6);
        let (mut applied, mut measured) = (Vec::new(), Vec::new());
        let length_s = f64::from(hits) * apart_s + 0.9;
        for k in 0..(length_s / step_s) as usize {
            let t = k as f64 * step_s - 0.1;
            let since = t - apart_s * (t / apart_s).floor().clamp(0.0, f64::from(hits - 1));
            let force = match (0.0..5e-3).contains(&since) {
                true => (0.5 * TAU * since / 5e-3).sin(),
                false => 0.0,
            };
            if k % 100 == 0 {
                applied.push(force);
                measured.push(x + 1e-4 * noise.normal());
            }
            speed += step_s * (omega * omega * (force - x) - 2.0 * damping_ratio * omega * speed);
            x += step_s * speed;
        }
        let found = one_mode(&applied, &measured, rate_hz);
        let codes: Vec<&str> = found.warnings.iter().map(|w| w.code).collect();
        assert_eq!(
            codes.contains(&"hits-overlap"),
            overlaps,
            "{apart_s} s: {codes:?}"
        );
        assert!(!codes.contains(&"hit-left-out"), "{apart_s} s: {codes:?}");
        let hz = of(&found, "natural_frequency").value();
        assert!((hz - 180.0).abs() < 0.1, "{apart_s} s: {hz} Hz");
    }
}

/// A torque of 10 N m switched on at each even time and off at each odd one, over 2 ms, and the signal in V of a stand of
/// 180 Hz with a damping ratio of 0.02 and 0.134 V/(N m), in closed form.
fn switched(times_s: &[f64], length_s: f64, seed: u64) -> (Vec<f64>, Vec<f64>) {
    const RISE_S: f64 = 2e-3;
    // Response to a torque that grows by 1 N m per s.
    let ramp = |t: f64| ramped(180.0, 0.02, t);
    let sum = |of: &dyn Fn(f64) -> f64| -> f64 {
        let signs = times_s.iter().zip([1.0, -1.0].into_iter().cycle());
        signs.map(|(at_s, sign)| sign * of(*at_s)).sum()
    };
    let mut noise = Noise(seed);
    (0..(5000.0 * length_s) as usize)
        .map(|i| {
            let t = i as f64 / 5000.0;
            let torque = sum(&|at_s| 10.0 * ((t - at_s) / RISE_S).clamp(0.0, 1.0));
            let shown = sum(&|at_s| 10.0 / RISE_S * (ramp(t - at_s) - ramp(t - at_s - RISE_S)));
            let torque = torque + 2e-3 * noise.normal();
            (torque, 0.134 * shown + 2e-4 * noise.normal())
        })
        .unzip()
}

/// Checks the constants of that stand, the gain to within a relative tolerance.
fn has_the_constants(found: &Identification, tolerance: f64) {
    let [gain, hz, ratio] =
        ["static_gain", "natural_frequency", "damping_ratio"].map(|name| of(found, name).value());
    let off = [gain / 0.134 - 1.0, hz - 180.0, ratio - 0.02].map(f64::abs);
    let is_right = off[0] < tolerance && off[1] < 0.1 && off[2] < 1e-3;
    assert!(is_right, "{gain}, {hz}, {ratio}");
}

/// A square wave is the same half a period later with the other sign: it shows no delay of half a period, and no
/// distortion.
#[test]
fn a_square_wave_has_the_sign_and_the_time_of_its_response() {
    for seed in 1..4 {
        let edges: Vec<f64> = (0..20).map(|k| 0.3 + 0.5 * f64::from(k)).collect();
        let (applied, measured) = switched(&edges, 10.2, seed);
        let record = response::Driven {
            name: "square",
            rate_hz: 5000.0,
            applied: &applied,
            measured: &measured,
        };
        let found = response::identify(&[record], &response::ResponseOptions::default()).unwrap();
        has_the_constants(&found, 1e-3);
        let all: Vec<&str> = found.warnings.iter().map(|warning| warning.code).collect();
        assert!(
            !all.contains(&"nonlinear") && !all.contains(&"channels-shifted"),
            "{all:?}"
        );
    }
}

/// So does a torque that is switched on and off a few times, which is neither noise nor periodic.
#[test]
fn a_torque_that_comes_on_and_off_is_a_transient() {
    for edges in [&[0.3, 1.1][..], &[0.3, 0.9, 1.9], &[0.3, 0.9, 1.7, 2.9]] {
        let (applied, measured) = switched(edges, edges[edges.len() - 1] + 0.8, 5);
        let found = one_mode(&applied, &measured, 5000.0);
        has_the_constants(&found, 2e-3);
    }
}
