//! Responses: modes from noise, how exact they are and how often the intervals hold the truth.

use torqcomp::identify::response;

use super::{Noise, TAU};
use crate::util::assert_close;

/// Response of a second-order stand to noise, by its exact step between samples held constant.
fn driven(rate_hz: f64, count: usize, noise: &mut Noise) -> (Vec<f64>, Vec<f64>) {
    let (omega, zeta) = (TAU * 60.0, 0.03);
    let parts = 20;
    let step = 1.0 / rate_hz / f64::from(parts);
    let (mut x, mut v) = (0.0_f64, 0.0_f64);
    let (mut force, mut before, mut smooth) = (0.0, 0.0, 0.0);
    let (mut applied, mut shown) = (Vec::new(), Vec::new());
    for _ in 0..count {
        // Noise with little left near half the rate, so that straight lines between samples are close.
        force = 0.7 * force + noise.normal();
        smooth = 0.7 * smooth + 0.3 * force;
        applied.push(before);
        shown.push(x);
        for k in 0..parts {
            let u = before + (smooth - before) * (f64::from(k) + 0.5) / f64::from(parts);
            let half = v + 0.5 * step * (omega * omega * (u - x) - 2.0 * zeta * omega * v);
            x += step * half;
            v = (half + 0.5 * step * omega * omega * (u - x)) / (1.0 + zeta * omega * step);
        }
        before = smooth;
    }
    (applied, shown)
}

#[test]
fn a_mode_is_found_from_noise() {
    let mut noise = Noise(16);
    let (applied, shown) = driven(1000.0, 60_000, &mut noise);
    let size = 0.01 * (shown.iter().map(|v| v * v).sum::<f64>() / shown.len() as f64).sqrt();
    let measured: Vec<f64> = shown.iter().map(|v| v + size * noise.normal()).collect();
    let record = response::Driven {
        name: "n",
        rate_hz: 1000.0,
        applied: &applied,
        measured: &measured,
    };
    let options = response::Options {
        band_hz: Some((20.0, 150.0)),
        ..Default::default()
    };
    let found = response::identify(&[record], &options).unwrap();
    let outcome = &found.outcome;
    let first = found
        .modal
        .poles
        .iter()
        .find(|p| (p.omega_rad_per_s / TAU - 60.0).abs() < 0.3);
    let pole = first.unwrap_or_else(|| panic!("{:?}", outcome.found));
    assert_close(pole.rate_per_s, 0.03 * TAU * 60.0, 0.05);
}

