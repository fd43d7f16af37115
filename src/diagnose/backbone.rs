//! Backbone of a free decay: frequency and decay rate over amplitude, and the stiffness or friction that follows from
//! it.
//!
//! With `ω₀² (x + c x³)` an oscillation of amplitude A has the frequency `ω₀ + s A²`, `s = 3 c ω₀/8` (A. H. Nayfeh, D.
//! T. Mook, Nonlinear Oscillations, 1979, 2.3). With the amplitude `A₀ exp(−δ t)` its phase is
//! `a + ω₀ t + s A₀² (1 − exp(−2 δ t))/(2 δ)`, a multiple of π where the record crosses its mean. A fit from a plain
//! stand's frequency does not converge once the phase is off by a turn.
//!
//! Dry friction F reduces the amplitude by `2 ω₀ F/π` per second, drag `d x' |x'|` by `4 d ω₀³ A²/(3 π)` (same source,
//! chapter 3), in addition to `δ A`.

use std::f64::consts::PI;

use nalgebra::DMatrix;
use torqcomp_model::fit::linear::solve;
use torqcomp_model::simulate::MotionState;

use super::record::{InitialState, StandRecord};

/// Minimum excursion of a half-wave, and minimum amplitude of those used, relative to the largest.
const REACHES: f64 = 0.05;
const COUNTS: f64 = 0.1;
/// Minimum damping ratio that a few half-waves can separate from the nonlinearity of the decay.
const LEAST_RATIO: f64 = 1e-3;
/// Minimum number of half-waves.
const FEWEST: usize = 5;

/// Estimate, from a free decay, of an effect that makes its frequency or decay rate depend on
/// amplitude.
#[derive(Debug, Clone, Copy)]
pub struct Backbone {
    /// `ω₀` in rad/s.
    pub omega_rad_s: f64,
    /// `δ/ω₀`.
    pub damping_ratio: f64,
    /// Magnitude of the effect, in the record's unit and s.
    pub size: f64,
    /// State at the first sample.
    pub motion: MotionState,
}

/// A half-wave: its start and amplitude.
struct HalfWave {
    start_s: f64,
    amplitude: f64,
}

impl Backbone {
    /// Backbone of a record; `None` if it has too few half-waves or does not decay, or the named effect affects neither
    /// frequency nor decay rate.
    pub fn of(record: &StandRecord, effect: &str) -> Option<Self> {
        let (waves, sign) = half_waves(record)?;
        // The oscillation, and the effect's magnitude per coefficient of the nonlinearity.
        let (found, over_bend): (_, fn(f64) -> f64) = match effect {
            "cubic-stiffness" => (Swing::that_turns_faster(&waves)?, |omega| {
                8.0 / (3.0 * omega)
            }),
            "coulomb-friction" => (Swing::that_loses(&waves, |_| 1.0)?, |omega| {
                PI / (2.0 * omega)
            }),
            "quadratic-damping" => (Swing::that_loses(&waves, |a| a * a)?, |omega| {
                0.75 * PI / omega.powi(3)
            }),
            _ => return None,
        };
        let [omega, amplitude] = [found.omega_rad_s, found.amplitude];
        if !(omega > 0.0 && found.rate_per_s > 0.0) {
            return None;
        }
        let (sine, cosine) = found.phase.sin_cos();
        Some(Self {
            omega_rad_s: omega,
            damping_ratio: found.rate_per_s / omega,
            size: found.bend * over_bend(omega),
            motion: MotionState {
                x: sign * amplitude * sine,
                speed: sign * (amplitude * found.turns_rad_s * cosine - found.falls_per_s * sine),
            },
        })
    }

    /// Initial state for a fit.
    pub fn initial(&self) -> InitialState {
        InitialState {
            motion: self.motion,
            ..InitialState::default()
        }
    }
}

/// An oscillation whose frequency or decay rate follows one law of amplitude.
struct Swing {
    omega_rad_s: f64,
    rate_per_s: f64,
    bend: f64,
    /// Amplitude, phase, and their rates of change at the first sample.
    amplitude: f64,
    phase: f64,
    turns_rad_s: f64,
    falls_per_s: f64,
}

impl Swing {
    /// Frequency that rises by `s A²`.
    fn that_turns_faster(waves: &[HalfWave]) -> Option<Self> {
        let levels = waves.iter().map(|w| (w.amplitude.ln(), w.start_s));
        let [level, slope] = least_squares(levels, |t| [1.0, t])?;
        let (start, rate) = (level.exp(), -slope);
        let turned = |t: f64| start * start * (1.0 - (-2.0 * rate * t).exp()) / (2.0 * rate);
        let [phase, omega, bend] = least_squares(phases(waves), |t| [1.0, t, turned(t)])?;
        Some(Self {
            omega_rad_s: omega,
            rate_per_s: rate,
            bend,
            amplitude: start,
            phase,
            turns_rad_s: omega + bend * start * start,
            falls_per_s: rate * start,
        })
    }

    /// Amplitude that falls by `δ A + b g(A)`: linear in the cumulative sums of both up to each half-wave.
    fn that_loses(waves: &[HalfWave], law: impl Fn(f64) -> f64) -> Option<Self> {
        let [phase, omega] = least_squares(phases(waves), |t| [1.0, t])?;
        let first = waves.first()?;
        let mut sums = [0.0; 2];
        let mut rows = vec![(first.amplitude, sums)];
        for pair in waves.windows(2) {
            let step_s = pair[1].start_s - pair[0].start_s;
            let mean =
                |of: &dyn Fn(f64) -> f64| 0.5 * (of(pair[0].amplitude) + of(pair[1].amplitude));
            sums[0] -= step_s * mean(&|amplitude| amplitude);
            sums[1] -= step_s * mean(&law);
            rows.push((pair[1].amplitude, sums));
        }
        let mut all = least_squares(rows.iter().copied(), |[a, b]| [1.0, a, b])?;
        let least = LEAST_RATIO * omega;
        if all[1] < least {
            let beside = rows
                .iter()
                .map(|(level, sums)| (level - least * sums[0], sums[1]));
            let [start, bend] = least_squares(beside, |b| [1.0, b])?;
            all = [start, least, bend];
        }
        let [start, rate, bend] = all;
        let falls_per_s = rate * start + bend * law(start);
        // The amplitude is that at the middle of a half-wave.
        let before_s = first.start_s + 0.5 * PI / omega;
        Some(Self {
            omega_rad_s: omega,
            rate_per_s: rate,
            bend,
            amplitude: start + falls_per_s * before_s,
            phase,
            turns_rad_s: omega,
            falls_per_s,
        })
    }
}

/// Phase at the start of each half-wave.
fn phases(waves: &[HalfWave]) -> impl Iterator<Item = (f64, f64)> {
    let phases = (0..).map(|k| f64::from(k) * PI);
    phases.zip(waves).map(|(phase, w)| (phase, w.start_s))
}

/// Half-waves of a record about its mean, and the sign of the first.
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
            // The part before the first crossing is an incomplete half-wave.
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
    // The last one may be incomplete.
    waves.pop();
    (waves.len() >= FEWEST).then_some((waves, first_sign))
}

/// Least-squares coefficients of functions of the second value of each pair that give the first.
fn least_squares<T, const N: usize>(
    rows: impl Iterator<Item = (f64, T)>,
    columns: impl Fn(T) -> [f64; N],
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

    /// A record of 4 s at 2 kHz, about a mean.
    fn record(swing: impl Fn(f64) -> f64) -> StandRecord {
        let measured = (0..8000).map(|i| 0.2 + swing(f64::from(i) / 2000.0));
        StandRecord {
            source: "a.csv".to_owned(),
            input: Arc::new(Excitation::new(vec![0.0; 8000], 2000.0, 0.0, 1)),
            range: 32..8000,
            measured: Arc::new(measured.collect()),
            initial: InitialState::default(),
            is_held: false,
            whitening: None,
        }
    }

    const OMEGA: f64 = 126.0;
    const RATIO: f64 = 0.002;
    const RATE: f64 = OMEGA * RATIO;

    fn assert_found(effect: &str, record: &StandRecord, size: f64) {
        let found = Backbone::of(record, effect).expect("a backbone");
        assert!((found.omega_rad_s / OMEGA - 1.0).abs() < 1e-3, "{found:?}");
        let [ratio, size] = [found.damping_ratio / RATIO, found.size / size];
        assert!((ratio - 1.0).abs() < 0.05, "{found:?}");
        assert!((size - 1.0).abs() < 0.05, "{found:?}");
        let x = 0.8 * 0.7_f64.sin();
        assert!((found.motion.x - x).abs() < 0.02, "{found:?}");
    }

    #[test]
    fn the_frequency_over_amplitude_gives_the_stiffness() {
        let cubic = 0.05;
        let bend = 3.0 * cubic * OMEGA / 8.0;
        let record = record(|t| {
            let turned = 0.64 * (1.0 - (-2.0 * RATE * t).exp()) / (2.0 * RATE);
            0.8 * (-RATE * t).exp() * (0.7 + OMEGA * t + bend * turned).sin()
        });
        assert_found("cubic-stiffness", &record, cubic);
        assert!(Backbone::of(&record, "backlash").is_none());
    }

    /// `A' = −δ A − b` and `A' = −δ A − b A²` in closed form.
    #[test]
    fn the_decay_over_amplitude_gives_the_friction() {
        let swing = |amplitude: f64, t: f64| amplitude * (0.7 + OMEGA * t).sin();
        let friction = 0.001;
        let lost = 2.0 * OMEGA * friction / PI / RATE;
        let dry = record(|t| swing(((0.8 + lost) * (-RATE * t).exp() - lost).max(0.0), t));
        assert_found("coulomb-friction", &dry, friction);
        let drag = 5e-6;
        let lost = 4.0 * drag * OMEGA.powi(3) / (3.0 * PI);
        let faded = |t: f64| (-RATE * t).exp();
        let dragged = record(|t| {
            let amplitude = 0.8 * faded(t) / (1.0 + 0.8 * lost / RATE * (1.0 - faded(t)));
            swing(amplitude, t)
        });
        assert_found("quadratic-damping", &dragged, drag);
    }
}
