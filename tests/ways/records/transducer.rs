//! A torque transducer of 2.0012 mV/V at 50 N m, 5 V supply, amplifier of gain 500: a tap, a run of a servo motor.

use std::f64::consts::TAU;

use super::Way;
use super::stand::{Plant, csv, pulse, recorded, rise};

const STAND: Plant = Plant {
    natural_hz: 642.5,
    damping_ratio: 0.0082,
};
const VOLTS_PER_N_M: f64 = 500.0 * 5.0 * 2.0012e-3 / 50.0;
const ZERO_V: f64 = 0.0131;
const NOISE_V: f64 = 5e-4;
const RATE_HZ: f64 = 20_000.0;

pub(super) fn way() -> Way {
    // Three levels with transitions of 4 ms, with the ripple of slots and of the current's harmonics.
    let run = |t: f64| {
        let level = 5.0 + 15.0 * rise(t - 0.15, 0.004) - 10.0 * rise(t - 0.35, 0.004);
        let ripple = |hz: f64, phase: f64| (TAU * hz * t + phase).cos();
        level
            * (1.0
                + 0.06 * ripple(300.0, 0.0)
                + 0.03 * ripple(600.0, 1.1)
                + 0.01 * ripple(900.0, 2.0))
    };
    let tap = |t: f64| 40.0 * pulse(t - 0.05, 0.0006);
    Way {
        name: "torque-transducer",
        files: vec![
            ("tap.csv", record(&tap, 16_000, 21)),
            ("run.csv", record(&run, 12_000, 22)),
        ],
        rate_hz: RATE_HZ,
        applied_n_m: (0..12_000).map(|i| run(f64::from(i) / RATE_HZ)).collect(),
    }
}

fn record(torque: &dyn Fn(f64) -> f64, count: usize, seed: u64) -> Vec<u8> {
    let shown = STAND.shows(torque, RATE_HZ, count);
    let volts: Vec<f64> = shown.iter().map(|t| ZERO_V + VOLTS_PER_N_M * t).collect();
    csv(
        RATE_HZ,
        &[("torque_V", 4, &recorded(&volts, NOISE_V, 1e-4, seed))],
    )
}
