//! Makes the example record: the signal that Hertel's recorder would have shown, and the torque that causes it.
//!
//! `cargo run --example hertel` writes `record.csv` and `torque_applied.csv` beside this file.
//!
//! The record is simulated, not measured. Constants: thesis, eq. (31) and (C25). The torque is a sum
//! of exponentials `Σ c e^{pτ}`, so the answer of `J θ'' + f θ' + K θ = T` from rest is known in
//! closed form, computed without any part of torqcomp:
//!
//! ```text
//! y(τ) = H(p) [ e^{pτ} − (p − s₂)/(s₁ − s₂) e^{s₁τ} + (p − s₁)/(s₁ − s₂) e^{s₂τ} ],
//! H(p) = K / (J p² + f p + K),   s₁,₂ the roots of its denominator.
//! ```

use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

use num_complex::Complex64;

const INERTIA_SLUG_FT2: f64 = 5.85e-3;
const DAMPING_FT_LBF_S: f64 = 3.07;
const STIFFNESS_FT_LBF: f64 = 8.1e4;
const TORQUE_PER_VOLT_FT_LBF: f64 = 1.23e3;
const RATE_HZ: f64 = 20_000.0;
const SAMPLES: usize = 6000;
/// Time at which the load is removed.
const LOAD_OFF_S: f64 = 0.15;
/// Time constant of the resulting change.
const CHANGE_S: f64 = 0.004;
/// Noise of the recorder, rms, and its quantisation step.
const NOISE_V: f64 = 1e-6;
const STEP_V: f64 = 1e-7;

/// Component torques under load: amplitude in ft lbf, frequency in Hz, phase in rad. The double
/// line frequency dominates, as in any single-phase motor; 18.3 Hz is the rotor imbalance.
const LOADED: [(f64, f64, f64); 8] = [
    (0.80, 0.0, 0.0),
    (0.06, 18.3, 1.0),
    (0.95, 120.0, 0.4),
    (0.10, 240.0, -1.1),
    (0.05, 360.0, 2.2),
    (0.04, 600.0, 0.3),
    (0.03, 1080.0, -2.0),
    (0.02, 1920.0, 1.3),
];

/// Components added by removing the load, rising as `1 − e^{−τ/CHANGE_S}`.
const CHANGE: [(f64, f64, f64); 2] = [(-0.70, 0.0, 0.0), (0.35, 120.0, 1.9)];

/// A term `Re(c e^{p (t − start)})` of the torque, from `start` (or always).
struct Term {
    amplitude: Complex64,
    rate: Complex64,
    start_s: Option<f64>,
}

fn terms() -> Vec<Term> {
    let phasor = |(a, _, phase): (f64, f64, f64)| Complex64::from_polar(a, phase);
    let mut terms: Vec<Term> = LOADED
        .iter()
        .map(|part| Term {
            amplitude: phasor(*part),
            rate: Complex64::new(0.0, TAU * part.1),
            start_s: None,
        })
        .collect();
    for part in CHANGE {
        for (sign, decay) in [(1.0, 0.0), (-1.0, 1.0 / CHANGE_S)] {
            terms.push(Term {
                amplitude: sign * phasor(part),
                rate: Complex64::new(-decay, TAU * part.1),
                start_s: Some(LOAD_OFF_S),
            });
        }
    }
    terms
}

/// Applied torque at a time, in ft lbf.
fn torque(terms: &[Term], time_s: f64) -> f64 {
    terms
        .iter()
        .filter_map(|term| {
            let since = time_s - term.start_s.unwrap_or(0.0);
            let acts = term.start_s.is_none() || since >= 0.0;
            acts.then(|| (term.amplitude * (term.rate * since).exp()).re)
        })
        .sum()
}

/// Torque in the beam at a time, in ft lbf.
fn shown(terms: &[Term], time_s: f64) -> f64 {
    let (j, f, k) = (INERTIA_SLUG_FT2, DAMPING_FT_LBF_S, STIFFNESS_FT_LBF);
    let root = Complex64::new(f * f - 4.0 * j * k, 0.0).sqrt();
    let (s1, s2) = ((-f + root) / (2.0 * j), (-f - root) / (2.0 * j));
    terms
        .iter()
        .map(|term| {
            let p = term.rate;
            let response = k / (j * p * p + f * p + k);
            let since = time_s - term.start_s.unwrap_or(0.0);
            let steady = (p * since).exp();
            let answer = match term.start_s {
                None => steady,
                Some(_) if since < 0.0 => Complex64::ZERO,
                Some(_) => {
                    let first = (p - s2) / (s1 - s2) * (s1 * since).exp();
                    let second = (p - s1) / (s1 - s2) * (s2 * since).exp();
                    steady - first + second
                }
            };
            (term.amplitude * response * answer).re
        })
        .sum()
}

/// Reproducible normally distributed numbers (Box and Muller, 1958).
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}

fn main() -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/hertel");
    let terms = terms();
    let mut noise = Noise(0x2545_F491_4F6C_DD1D);
    let mut record =
        "# simulated from the constants of the thesis, not measured\ntime_s,bridge_V\n".to_owned();
    let mut applied = "# the torque behind record.csv\ntime_s,torque_ft_lbf\n".to_owned();
    for i in 0..SAMPLES {
        let time_s = i as f64 / RATE_HZ;
        let volts = shown(&terms, time_s) / TORQUE_PER_VOLT_FT_LBF + NOISE_V * noise.next();
        let volts = (volts / STEP_V).round() * STEP_V;
        // Writing to a String cannot fail.
        let _ = writeln!(record, "{time_s:.5},{volts:.7}");
        let _ = writeln!(applied, "{time_s:.5},{:.9}", torque(&terms, time_s));
    }
    std::fs::write(folder.join("record.csv"), record)?;
    std::fs::write(folder.join("torque_applied.csv"), applied)?;
    println!(
        "wrote {SAMPLES} samples of record.csv and torque_applied.csv to {}",
        folder.display()
    );
    Ok(())
}
