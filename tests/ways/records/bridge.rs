//! A bridge amplifier in mV/V: weights, a tap, a run of a single-phase motor.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use super::Way;
use super::stand::{Plant, csv, pulse, recorded, rise};
use crate::noise::Noise;

const STAND: Plant = Plant {
    natural_hz: 181.4,
    damping_ratio: 0.0135,
};
const TORQUE_PER_MV_PER_V: f64 = 24.83;
const ZERO_MV_PER_V: f64 = 0.0312;
const NOISE_MV_PER_V: f64 = 1e-4;
const RATE_HZ: f64 = 5000.0;

pub(super) fn way() -> Way {
    let run = |t: f64| {
        let (line, slots) = ((TAU * 100.0 * t).cos(), (TAU * 250.0 * t + 0.7).cos());
        rise(t - 0.3, 0.05) * (8.0 + 3.0 * line + 0.8 * slots)
    };
    let tap = |t: f64| 60.0 * pulse(t - 0.2, 0.002);
    Way {
        name: "bridge-amplifier",
        files: vec![
            ("weights.csv", weights()),
            ("tap.csv", record(&tap, 7500, 11)),
            ("run.csv", record(&run, 10_000, 12)),
        ],
        rate_hz: RATE_HZ,
        applied_n_m: (0..10_000).map(|i| run(f64::from(i) / RATE_HZ)).collect(),
    }
}

/// Readings at an arm of 250 mm, where gravity is 9.811 m/s²: up and down, three times.
fn weights() -> Vec<u8> {
    let mut text = String::from("mass_kg,bridge_mV/V\n");
    let mut noise = Noise(13);
    for _series in 0..3 {
        for mass in [0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 8.0, 6.0, 4.0, 2.0, 0.0] {
            let torque = mass * 9.811 * 0.25;
            let reading =
                ZERO_MV_PER_V + torque / TORQUE_PER_MV_PER_V + NOISE_MV_PER_V * noise.normal();
            let _ = writeln!(text, "{mass},{reading:.4}");
        }
    }
    text.into()
}

fn record(torque: &dyn Fn(f64) -> f64, count: usize, seed: u64) -> Vec<u8> {
    let shown = STAND.shows(torque, RATE_HZ, count);
    let readings: Vec<f64> = shown
        .iter()
        .map(|t| ZERO_MV_PER_V + t / TORQUE_PER_MV_PER_V)
        .collect();
    let stored = recorded(&readings, NOISE_MV_PER_V, 1e-5, seed);
    csv(RATE_HZ, &[("bridge_mV/V", 5, &stored)])
}
