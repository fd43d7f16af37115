//! A stand integrated in time, and the files of a recorder.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use crate::noise::Noise;

/// `J θ'' + f θ' + K θ = T`, where the gage shows `K θ`; divided by `K`, only two constants remain.
pub struct Plant {
    pub natural_hz: f64,
    pub damping_ratio: f64,
}

impl Plant {
    /// The torque at the gage, N m, from rest under a torque over time.
    ///
    /// Fourth-order Runge–Kutta method, at 40 steps per oscillation or more.
    pub fn shows(&self, torque: impl Fn(f64) -> f64, rate_hz: f64, count: usize) -> Vec<f64> {
        let omega = TAU * self.natural_hz;
        let steps = (40.0 * self.natural_hz / rate_hz).ceil().max(4.0);
        let h = 1.0 / (rate_hz * steps);
        let slope = |t: f64, (y, v): (f64, f64)| {
            let pull = torque(t) - y;
            (
                v,
                omega * omega * pull - 2.0 * self.damping_ratio * omega * v,
            )
        };
        let (mut state, mut shown) = ((torque(0.0), 0.0), Vec::with_capacity(count));
        for i in 0..count {
            shown.push(state.0);
            for step in 0..steps as usize {
                let t = (i as f64 * steps + step as f64) * h;
                let along = |k: (f64, f64), part: f64| (state.0 + part * k.0, state.1 + part * k.1);
                let a = slope(t, state);
                let b = slope(t + h / 2.0, along(a, h / 2.0));
                let c = slope(t + h / 2.0, along(b, h / 2.0));
                let d = slope(t + h, along(c, h));
                state.0 += h / 6.0 * (a.0 + 2.0 * b.0 + 2.0 * c.0 + d.0);
                state.1 += h / 6.0 * (a.1 + 2.0 * b.1 + 2.0 * c.1 + d.1);
            }
        }
        shown
    }
}

/// A hammer pulse: a half-sine with a peak of 1.
pub fn pulse(since_s: f64, length_s: f64) -> f64 {
    if (0.0..length_s).contains(&since_s) {
        (TAU / 2.0 * since_s / length_s).sin()
    } else {
        0.0
    }
}

/// Smooth rise from 0 to 1 within a time.
pub fn rise(since_s: f64, length_s: f64) -> f64 {
    let part = (since_s / length_s).clamp(0.0, 1.0);
    part * part * part * (10.0 + part * (6.0 * part - 15.0))
}

/// Values as stored by a recorder: with noise and quantisation.
pub fn recorded(values: &[f64], noise_rms: f64, step: f64, seed: u64) -> Vec<f64> {
    let mut noise = Noise(seed);
    let mut stored = |value: &f64| ((value + noise_rms * noise.normal()) / step).round() * step;
    values.iter().map(&mut stored).collect()
}

/// A recorder's file: the time in s, then the columns, each with its heading and decimals.
pub fn csv(rate_hz: f64, columns: &[(&str, usize, &[f64])]) -> Vec<u8> {
    let mut text = String::from("time_s");
    for (heading, ..) in columns {
        let _ = write!(text, ",{heading}");
    }
    for i in 0..columns[0].2.len() {
        let _ = write!(text, "\n{:.6}", i as f64 / rate_hz);
        for (_, decimals, values) in columns {
            let _ = write!(text, ",{:.decimals$}", values[i]);
        }
    }
    text.push('\n');
    text.into()
}
