//! A gage alone: a hit, a load, and the same motor at two speeds.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use super::Way;
use super::stand::{Plant, csv, pulse, recorded};
use crate::noise::Noise;

const STAND: Plant = Plant {
    natural_hz: 231.0,
    damping_ratio: 0.017,
};
const N_M_PER_VOLT: f64 = 3.17;
const ZERO_V: f64 = -0.412;
const NOISE_V: f64 = 3e-4;
const RATE_HZ: f64 = 4000.0;
/// Torque of the motor: order, amplitude in N m, phase in rad.
const ORDERS: [(f64, f64, f64); 4] = [
    (0.0, 1.8, 0.0),
    (1.0, 0.12, 0.3),
    (2.0, 0.30, -1.0),
    (6.0, 0.50, 2.1),
];
const SLOW_HZ: f64 = 21.0;
const FAST_HZ: f64 = 31.0;
/// Number of samples until the motor runs steadily.
const BEFORE: usize = 4000;

pub(super) fn way() -> Way {
    let hit = |t: f64| 18.0 * pulse(t - 0.1, 0.0015);
    let fast = |t| run(FAST_HZ, t);
    Way {
        name: "gage-alone",
        files: vec![
            ("hit.csv", record(&hit, 0, 6000, 41)),
            ("load.csv", load()),
            ("slow.csv", record(&|t| run(SLOW_HZ, t), BEFORE, 12_000, 42)),
            ("fast.csv", record(&fast, BEFORE, 12_000, 43)),
        ],
        rate_hz: RATE_HZ,
        applied_n_m: (0..12_000).map(|i| fast(f64::from(i) / RATE_HZ)).collect(),
    }
}

fn run(speed_hz: f64, t: f64) -> f64 {
    let part =
        |(order, size, phase): &(f64, f64, f64)| size * (TAU * order * speed_hz * t + phase).cos();
    ORDERS.iter().map(part).sum()
}

/// A canister of 2.04 kg at an arm of 150 mm, on and off.
fn load() -> Vec<u8> {
    let mut text = String::from("mass_kg,bridge_V\n");
    let mut noise = Noise(44);
    for mass in [0.0, 2.04, 0.0, 2.04, 0.0, 2.04, 0.0] {
        let torque = mass * 9.81 * 0.15;
        let volts = ZERO_V + torque / N_M_PER_VOLT + NOISE_V * noise.normal();
        let _ = writeln!(text, "{mass},{volts:.4}");
    }
    text.into()
}

/// Volts for a torque that has acted for `before` samples when the record begins.
fn record(torque: &dyn Fn(f64) -> f64, before: usize, count: usize, seed: u64) -> Vec<u8> {
    let earlier = before as f64 / RATE_HZ;
    let shown = STAND.shows(|t| torque(t - earlier), RATE_HZ, before + count);
    let volts: Vec<f64> = shown[before..]
        .iter()
        .map(|t| ZERO_V + t / N_M_PER_VOLT)
        .collect();
    csv(
        RATE_HZ,
        &[("bridge_V", 4, &recorded(&volts, NOISE_V, 1e-4, seed))],
    )
}
