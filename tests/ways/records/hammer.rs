//! A hammer at an arm of 120 mm, weights, and a run of a compressor.

use std::fmt::Write as _;

use super::Way;
use super::stand::{Plant, csv, pulse, recorded};
use crate::noise::Noise;

const STAND: Plant = Plant {
    natural_hz: 312.0,
    damping_ratio: 0.021,
};
const N_M_PER_VOLT: f64 = 7.46;
const NOISE_V: f64 = 2e-4;
const ARM_M: f64 = 0.12;
/// Squared half-sine: no corners remain after the recorder's low-pass.
const HIT_S: f64 = 0.0016;
const RATE_HZ: f64 = 10_000.0;
/// A hit about every half second, slightly varying.
const HITS: [(f64, f64); 5] = [
    (0.21, 310.0),
    (0.74, 265.0),
    (1.22, 342.0),
    (1.69, 288.0),
    (2.24, 305.0),
];

pub(super) fn way() -> Way {
    // A compression stroke every 25 ms, on top of the torque that drives the compressor.
    let run = |t: f64| {
        let since = (t - 0.1).rem_euclid(0.025);
        let stroke = pulse(since, 0.006);
        2.0 + if t < 0.1 { 0.0 } else { 9.0 * stroke * stroke }
    };
    Way {
        name: "hammer",
        files: vec![
            ("hits.csv", hits()),
            ("weights.csv", weights()),
            ("run.csv", record(&run, 10_000)),
        ],
        rate_hz: RATE_HZ,
        applied_n_m: (0..10_000).map(|i| run(f64::from(i) / RATE_HZ)).collect(),
    }
}

/// Weights of known force at an arm of 200 mm: up and down, twice.
fn weights() -> Vec<u8> {
    let mut text = String::from("force_N,bridge_V\n");
    let mut noise = Noise(34);
    for _series in 0..2 {
        for force in [0.0, 20.0, 40.0, 60.0, 40.0, 20.0, 0.0] {
            let volts = 0.2 * force / N_M_PER_VOLT + NOISE_V * noise.normal();
            let _ = writeln!(text, "{force},{volts:.4}");
        }
    }
    text.into()
}

fn hits() -> Vec<u8> {
    let force = |t: f64| -> f64 {
        let hit = |(at, size): &(f64, f64)| size * pulse(t - at, HIT_S).powi(2);
        HITS.iter().map(hit).sum()
    };
    let shown = STAND.shows(|t| ARM_M * force(t), RATE_HZ, 27_000);
    let volts: Vec<f64> = shown.iter().map(|t| t / N_M_PER_VOLT).collect();
    let newton: Vec<f64> = (0..27_000).map(|i| force(f64::from(i) / RATE_HZ)).collect();
    let newton = recorded(&newton, 0.05, 0.01, 31);
    let volts = recorded(&volts, NOISE_V, 1e-4, 32);
    csv(
        RATE_HZ,
        &[("hammer_N", 2, &newton), ("bridge_V", 4, &volts)],
    )
}

fn record(torque: &dyn Fn(f64) -> f64, count: usize) -> Vec<u8> {
    let shown = STAND.shows(torque, RATE_HZ, count);
    let volts: Vec<f64> = shown.iter().map(|t| t / N_M_PER_VOLT).collect();
    csv(
        RATE_HZ,
        &[("bridge_V", 4, &recorded(&volts, NOISE_V, 1e-4, 33))],
    )
}
