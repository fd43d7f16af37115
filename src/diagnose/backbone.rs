//! The backbone of free ringing: frequency over amplitude, and the stiffness that follows from it.
//!
//! Beside `ω₀² (x + c x³)` a swing of amplitude A turns with `ω₀ + s A²`, `s = 3 c ω₀/8` (A. H. Nayfeh, D. T. Mook, Nonlinear
//! Oscillations, 1979, 2.3). With the amplitude `A₀ exp(−δ t)` its phase is `a + ω₀ t + s A₀² (1 − exp(−2 δ t))/(2 δ)`, and a
//! multiple of π where the record crosses its mean. From a plain stand's frequency, a fit does not find the way over a phase
//! that is off by a turn.

use std::f64::consts::PI;

use nalgebra::DMatrix;
use torqcomp_model::fit::linear::solve;
use torqcomp_model::simulate::MotionState;

use super::record::{InitialState, StandRecord};

/// Swing, over the largest, that a half-wave must reach to be one, and amplitude up to which half-waves count.
const REACHES: f64 = 0.05;
const COUNTS: f64 = 0.1;
/// Fewest half-waves.
const FEWEST: usize = 20;

/// What a record of free ringing shows of a cubic stiffness.
#[derive(Debug, Clone, Copy)]
pub struct Backbone {
    /// `ω₀` in rad/s.
    pub omega_rad_s: f64,
    /// `δ/ω₀`.
    pub damping_ratio: f64,
    /// c, per square of the record's unit.
    pub cubic: f64,
    /// State at the first sample.
    pub motion: MotionState,
}

/// A half-wave: when it begins, and its amplitude.
struct HalfWave {
    start_s: f64,
    amplitude: f64,
}

impl Backbone {
    /// That of a record; `None` if it has too few half-waves or does not decay.
    pub fn of(record: &StandRecord) -> Option<Self> {
        let (waves, sign) = half_waves(record)?;
        let levels = waves.iter().map(|w| (w.amplitude.ln(), w.start_s));
        let [level, slope] = least_squares(levels, |t| [1.0, t])?;
        let (start, rate) = (level.exp(), -slope);
        if rate <= 0.0 {
            return None;
        }
        let turned = |t: f64| start * start * (1.0 - (-2.0 * rate * t).exp()) / (2.0 * rate);
        let phases = (0..).map(|k| f64::from(k) * PI);
        let phases = phases.zip(&waves).map(|(phase, w)| (phase, w.start_s));
        let [phase, omega, bend] = least_squares(phases, |t| [1.0, t, turned(t)])?;
        let now = omega + bend * start * start;
        let (sine, cosine) = phase.sin_cos();
        let motion = MotionState {
            x: sign * start * sine,
            speed: sign * start * (now * cosine - rate * sine),
        };
        (omega > 0.0).then_some(Self {
            omega_rad_s: omega,
            damping_ratio: rate / omega,
            cubic: 8.0 * bend / (3.0 * omega),
            motion,
        })
    }

    /// The state that a fit starts from.
    pub fn initial(&self) -> InitialState {
        InitialState {
            motion: self.motion,
            preload: 0.0,
        }
    }
}

/// The half-waves of a record about its mean, and the sign of the first.
fn half_waves(record: &StandRecord) -> Option<(Vec<HalfWave>, f64)> {
    let measured = record.measured_in_range();
    let mean = measured.iter().sum::<f64>() / measured.len() as f64;
    let largest = measured
        .iter()
        .fold(0.0_f64, |m, y| m.max((y - mean).abs()));
    let time_s = |i: f64| (record.range.start as f64 + i) / record.rate_hz();
    let mut waves: Vec<HalfWave> = Vec::new();
    let (mut first_sign, mut sign, mut crossing) = (0.0, 0.0, None);
    for (i, pair) in measured.windows(2).enumerate() {
        let [before, now] = [pair[0] - mean, pair[1] - mean];
        if before * now <= 0.0 && before != now {
            crossing = Some(i as f64 + before / (before - now));
        }
        if now.abs() > REACHES * largest && now.signum() != sign {
            if waves.last().is_some_and(|w| w.amplitude < COUNTS * largest) {
                break;
            }
            sign = now.signum();
            // What precedes the first crossing is part of a half-wave.
            if let Some(at) = crossing {
                first_sign = if waves.is_empty() { sign } else { first_sign };
                let start_s = time_s(at);
                waves.push(HalfWave {
                    start_s,
                    amplitude: 0.0,
                });
            }
        }
        if let Some(wave) = waves.last_mut().filter(|_| now.signum() == sign) {
            wave.amplitude = wave.amplitude.max(now.abs());
        }
    }
    // The last one may be cut off.
    waves.pop();
    (waves.len() >= FEWEST).then_some((waves, first_sign))
}

/// Coefficients of functions of the second number that give the first.
fn least_squares<const N: usize>(
    rows: impl Iterator<Item = (f64, f64)>,
    columns: impl Fn(f64) -> [f64; N],
) -> Option<[f64; N]> {
    let (values, rows): (Vec<f64>, Vec<[f64; N]>) =
        rows.map(|(value, at)| (value, columns(at))).unzip();
    let matrix = DMatrix::from_row_slice(rows.len(), N, rows.as_flattened());
    let fit = solve(&matrix, &values, None, false).ok()?;
    let is_determined = fit.undetermined.is_empty();
    is_determined.then(|| fit.values.try_into().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use torqcomp_model::simulate::Excitation;

    use super::*;

    #[test]
    fn the_frequency_over_amplitude_gives_the_stiffness() {
        let (omega, ratio, cubic) = (126.0, 0.002, 0.05);
        let rate = omega * ratio;
        let bend = 3.0 * cubic * omega / 8.0;
        let swing = |i: usize| {
            let t = i as f64 / 2000.0;
            let turned = 0.64 * (1.0 - (-2.0 * rate * t).exp()) / (2.0 * rate);
            0.2 + 0.8 * (-rate * t).exp() * (0.7 + omega * t + bend * turned).sin()
        };
        let measured: Vec<f64> = (0..8000).map(swing).collect();
        let record = StandRecord {
            source: "a.csv".to_owned(),
            input: Arc::new(Excitation::new(vec![0.0; 8000], 2000.0, 0.0, 1)),
            range: 32..8000,
            measured: Arc::new(measured),
            initial: InitialState::default(),
            is_held: false,
        };
        let found = Backbone::of(&record).expect("a backbone");
        assert!((found.omega_rad_s / omega - 1.0).abs() < 1e-3, "{found:?}");
        assert!(
            (found.damping_ratio / ratio - 1.0).abs() < 0.05,
            "{found:?}"
        );
        assert!((found.cubic / cubic - 1.0).abs() < 0.05, "{found:?}");
        assert!(
            (found.motion.x - 0.8 * 0.7_f64.sin()).abs() < 0.02,
            "{found:?}"
        );
    }
}
