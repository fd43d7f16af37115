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

/// Estimate, from a free decay, of effects that make its frequency or decay rate depend on
/// amplitude.
#[derive(Debug, Clone)]
pub struct Backbone {
    /// `ω₀` in rad/s.
    pub omega_rad_s: f64,
    /// `δ/ω₀`.
    pub damping_ratio: f64,
    /// Magnitude of each effect, in the record's unit and s.
    pub sizes: Vec<f64>,
    /// State at the first sample.
    pub motion: MotionState,
}

/// What an effect does to an oscillation.
struct Law {
    /// Whether the amplitude falls by it, instead of the frequency rising.
    is_loss: bool,
    /// By what, per unit of its coefficient, at an amplitude.
    at: fn(f64) -> f64,
    /// Its magnitude per unit of the coefficient, at `ω₀`.
    size: fn(f64) -> f64,
}

impl Law {
    fn of(effect: &str) -> Option<Self> {
        let square = |a: f64| a * a;
        Some(match effect {
            "cubic-stiffness" => Self {
                is_loss: false,
                at: square,
                size: |omega| 8.0 / (3.0 * omega),
            },
            "coulomb-friction" => Self {
                is_loss: true,
                at: |_| 1.0,
                size: |omega| PI / (2.0 * omega),
            },
            "quadratic-damping" => Self {
                is_loss: true,
                at: square,
                size: |omega| 0.75 * PI / omega.powi(3),
            },
            _ => return None,
        })
    }
}

/// A half-wave: its start and amplitude.
struct HalfWave {
    start_s: f64,
    amplitude: f64,
}

impl Backbone {
    /// Backbone of a record; `None` if it has too few half-waves or does not decay, or one of the named effects affects
    /// neither frequency nor decay rate.
    pub fn of(record: &StandRecord, effects: &[&str]) -> Option<Self> {
        let laws: Vec<Law> = effects.iter().map(|e| Law::of(e)).collect::<Option<_>>()?;
        let (waves, sign) = half_waves(record)?;
        let found = Swing::of(&waves, &laws)?;
        let [omega, amplitude] = [found.omega_rad_s, found.amplitude];
        if !(omega > 0.0 && found.rate_per_s > 0.0) {
            return None;
        }
        let (sine, cosine) = found.phase.sin_cos();
        let sizes = laws.iter().zip(&found.bends);
        Some(Self {
            omega_rad_s: omega,
            damping_ratio: found.rate_per_s / omega,
            sizes: sizes.map(|(law, bend)| bend * (law.size)(omega)).collect(),
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

/// An oscillation whose frequency and decay rate follow laws of amplitude.
struct Swing {
    omega_rad_s: f64,
    rate_per_s: f64,
    /// Coefficient of each law.
    bends: Vec<f64>,
    /// Amplitude, phase, and their rates of change at the first sample.
    amplitude: f64,
    phase: f64,
    turns_rad_s: f64,
    falls_per_s: f64,
}

impl Swing {
    /// Amplitude that falls by `δ A + Σ b g(A)` and phase that turns by `ω₀ + Σ s g(A)`: both linear in cumulative sums of
    /// the amplitudes up to each half-wave.
    fn of(waves: &[HalfWave], laws: &[Law]) -> Option<Self> {
        let first = waves.first()?;
        let of_kind = |is_loss: bool| laws.iter().filter(move |law| law.is_loss == is_loss);
        let before = of_kind(false).map(|law| first.start_s * (law.at)(first.amplitude));
        let before: Vec<f64> = before.collect();
        let columns = |wave: &HalfWave, turned: &[f64]| -> Vec<f64> {
            let turned = before.iter().zip(turned).map(|(before, sum)| before + sum);
            [1.0, wave.start_s].into_iter().chain(turned).collect()
        };
        let mut turned = vec![0.0; before.len()];
        let mut lost = vec![0.0; 1 + of_kind(true).count()];
        let mut phases = vec![(0.0, columns(first, &turned))];
        let mut levels = vec![(first.amplitude, lost.clone())];
        for pair in waves.windows(2) {
            let step_s = pair[1].start_s - pair[0].start_s;
            for (sum, law) in turned.iter_mut().zip(of_kind(false)) {
                *sum += step_s * (law.at)(pair[0].amplitude);
            }
            phases.push((phases.len() as f64 * PI, columns(&pair[1], &turned)));
            let mean = |of: fn(f64) -> f64| 0.5 * (of(pair[0].amplitude) + of(pair[1].amplitude));
            lost[0] -= step_s * mean(|amplitude| amplitude);
            for (sum, law) in lost[1..].iter_mut().zip(of_kind(true)) {
                *sum -= step_s * mean(law.at);
            }
            levels.push((pair[1].amplitude, lost.clone()));
        }
        let turns = least_squares(phases.into_iter())?;
        let omega = turns[1];
        let falls = decay(&levels, LEAST_RATIO * omega)?;
        let (start, rate) = (falls[0], falls[1]);
        let (mut of_falls, mut of_turns) = (falls[2..].iter(), turns[2..].iter());
        let bends = laws.iter().map(|law| match law.is_loss {
            true => of_falls.next().copied(),
            false => of_turns.next().copied(),
        });
        let bends: Vec<f64> = bends.collect::<Option<_>>()?;
        let at_start = |is_loss: bool| {
            let all = laws.iter().zip(&bends);
            let some = all.filter(|(law, _)| law.is_loss == is_loss);
            some.map(|(law, bend)| bend * (law.at)(start)).sum::<f64>()
        };
        let falls_per_s = rate * start + at_start(true);
        // The amplitude is that at the middle of a half-wave.
        let before_s = first.start_s + 0.5 * PI / omega;
        Some(Self {
            omega_rad_s: omega,
            rate_per_s: rate,
            amplitude: start + falls_per_s * before_s,
            phase: turns[0],
            turns_rad_s: omega + at_start(false),
            falls_per_s,
            bends,
        })
    }
}

/// First amplitude, decay rate (at least a given one), and the coefficients of other losses, from amplitudes with the sums of
/// the losses so far.
fn decay(rows: &[(f64, Vec<f64>)], least_per_s: f64) -> Option<Vec<f64>> {
    let with_first = |sums: &[f64]| [&[1.0], sums].concat();
    let all = least_squares(rows.iter().map(|(a, sums)| (*a, with_first(sums))))?;
    if all[1] >= least_per_s {
        return Some(all);
    }
    let rows = rows.iter();
    let beside = rows.map(|(a, sums)| (a - least_per_s * sums[0], with_first(&sums[1..])));
    let mut all = least_squares(beside)?;
    all.insert(1, least_per_s);
    Some(all)
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

/// Least-squares coefficients of columns that give the first value of each row.
fn least_squares(rows: impl Iterator<Item = (f64, Vec<f64>)>) -> Option<Vec<f64>> {
    let (values, rows): (Vec<f64>, Vec<Vec<f64>>) = rows.unzip();
    let width = rows.first()?.len();
    let matrix = DMatrix::from_row_slice(rows.len(), width, &rows.concat());
    let fit = solve(&matrix, &values, None, false).ok()?;
    fit.undetermined.is_empty().then_some(fit.values)
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

    fn assert_found(effects: &[&str], record: &StandRecord, sizes: &[f64]) {
        let found = Backbone::of(record, effects).expect("a backbone");
        assert!((found.omega_rad_s / OMEGA - 1.0).abs() < 1e-3, "{found:?}");
        assert!(
            (found.damping_ratio / RATIO - 1.0).abs() < 0.05,
            "{found:?}"
        );
        for (found_size, size) in found.sizes.iter().zip(sizes) {
            assert!((found_size / size - 1.0).abs() < 0.05, "{found:?}");
        }
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
        assert_found(&["cubic-stiffness"], &record, &[cubic]);
        assert!(Backbone::of(&record, &["backlash"]).is_none());
    }

    /// `A' = −δ A − b` and `A' = −δ A − b A²` in closed form.
    #[test]
    fn the_decay_over_amplitude_gives_the_friction() {
        let swing = |amplitude: f64, t: f64| amplitude * (0.7 + OMEGA * t).sin();
        let friction = 0.001;
        let lost = 2.0 * OMEGA * friction / PI / RATE;
        let dry = record(|t| swing(((0.8 + lost) * (-RATE * t).exp() - lost).max(0.0), t));
        assert_found(&["coulomb-friction"], &dry, &[friction]);
        let drag = 5e-6;
        let lost = 4.0 * drag * OMEGA.powi(3) / (3.0 * PI);
        let faded = |t: f64| (-RATE * t).exp();
        let amplitude = |t: f64| 0.8 * faded(t) / (1.0 + 0.8 * lost / RATE * (1.0 - faded(t)));
        let dragged = record(|t| swing(amplitude(t), t));
        assert_found(&["quadratic-damping"], &dragged, &[drag]);
        // The phase beside it: ∫ A² dt in steps of 10 µs.
        let cubic = 0.05;
        let bend = 3.0 * cubic * OMEGA / 8.0;
        let mut turned = vec![0.0; 8000];
        for i in 1..8000 {
            let steps = (0..50).map(|k| amplitude((i as f64 - 1.0 + f64::from(k) / 50.0) / 2000.0));
            turned[i] = turned[i - 1] + steps.map(|a| a * a * 1e-5).sum::<f64>();
        }
        let both = record(|t| {
            let phase = 0.7 + OMEGA * t + bend * turned[(2000.0 * t).round() as usize];
            amplitude(t) * phase.sin()
        });
        assert_found(
            &["cubic-stiffness", "quadratic-damping"],
            &both,
            &[cubic, drag],
        );
    }
}
