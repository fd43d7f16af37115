//! Responses to torques that come on or off, and to hits that follow each other.

use torqcomp::identify::{Identification, response};

use super::{Noise, TAU, of};

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
