//! A resonance in a record where none is declared.

use crate::dot;
use crate::spectrum::{Density, welch};

/// A resonance in the spectrum of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonance {
    /// Natural frequency in Hz.
    pub frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
}

/// Largest damping ratio of a mode that must show a peak.
const SHARP: f64 = 0.15;
/// Frequency range examined, relative to the declared frequency.
const NEAR: [f64; 2] = [0.4, 2.5];
/// Minimum number of averaged blocks, counting half-overlapping ones.
const BLOCKS: usize = 7;
/// Number of block lengths, each half of the previous one; the longest resolves a sixteenth of the declared width.
const RESOLUTIONS: u32 = 4;
/// Relative width of the bands in which the spectrum is averaged, and minimum number of such bands.
const BAND: f64 = 0.015;
const FEWEST: usize = 24;
/// Minimum power of a band relative to the quietest part of the spectrum, one of so many.
const ABOVE_NOISE: f64 = 10.0;
const PARTS: usize = 16;
/// Number of frequencies, and the damping ratios, from which the best fit is searched.
const PLACES: u32 = 60;
const RATIOS: [f64; 3] = [0.01, 0.03, 0.1];
/// Largest damping ratio of a resonance that is reported, and smallest one of the search.
const WIDEST: f64 = 0.2;
const SHARPEST: f64 = 1e-3;
/// Factors on frequency and damping ratio that are tried at first, and by which they approach 1.
const FIRST: [f64; 2] = [0.03, 0.5];
const STEPS: u32 = 24;
/// Largest rms difference of the logarithm of the power from that of a resonance.
const FITS: f64 = 0.5;
/// How many times as large its square is without the resonance, and with the declared one.
const WORSE: f64 = 4.0;
/// Smallest difference from a declared frequency.
const APART: f64 = 0.04;

/// The resonance of a record near the first of several declared modes (natural frequency in Hz and damping ratio), if
/// the record shows that one instead of the declared ones.
///
/// A machine that hits, steps or makes noise applies a torque whose power is a smooth function of frequency, so that
/// the record's power is that function times `1/((1 − r²)² + (2ζr)²)`, `r = f/f₀`. The logarithm of the power in bands
/// of 1.5 % is fitted by `a + b ln f + c f²` plus the logarithm of the resonance. The resonance is reported if this
/// fits within 0.5 rms, and four times as well (in squares) as no resonance and as the declared one, and if it is at
/// least 4 % away from all declared ones. Lines, orders swept with the speed and bands of noise do not fit.
///
/// ```
/// use torqcomp_dsp::quality::resonance::other_resonance;
/// // Hits on a body that rings at 59 Hz with a damping ratio of 0.02.
/// let ring = |t: f64| (-7.4 * t).exp() * (370.7 * t).sin();
/// let record: Vec<f64> = (0..40_000).map(|i| ring((f64::from(i) * 1e-3) % 1.7)).collect();
/// let found = other_resonance(&record, 1000.0, &[(45.0, 0.02)]).unwrap();
/// assert!((found.frequency_hz - 59.0).abs() < 0.5 && (found.damping_ratio - 0.02).abs() < 0.006);
/// assert_eq!(other_resonance(&record, 1000.0, &[(59.5, 0.02)]), None);
/// ```
#[must_use]
pub fn other_resonance(
    samples: &[f64],
    rate_hz: f64,
    declared: &[(f64, f64)],
) -> Option<Resonance> {
    let &(declared_hz, ratio) = declared.first()?;
    let [from_hz, to_hz] = NEAR.map(|part| part * declared_hz);
    let to_hz = to_hz.min(0.45 * rate_hz);
    if ratio > SHARP || to_hz < 1.2 * declared_hz {
        return None;
    }
    let longest = (2 * samples.len() / (BLOCKS + 1)).checked_ilog2()?;
    // Sharp peaks need long blocks; broad ones have less variance with short blocks.
    let finest = (16.0 * rate_hz / (2.0 * ratio * declared_hz)).log2().ceil() as u32;
    let powers = (finest.saturating_sub(RESOLUTIONS - 1)..=finest).rev();
    powers.filter(|power| *power <= longest).find_map(|power| {
        let density = welch(samples, rate_hz, 1 << power).ok()?;
        let spectrum = LogSpectrum::of(&density, [from_hz, to_hz])?;
        spectrum.other_resonance(declared)
    })
}

/// Logarithm of a spectrum in bands, without the smooth functions that an input may have.
struct LogSpectrum {
    frequency_hz: Vec<f64>,
    log_power: Vec<f64>,
    /// The smooth functions, orthonormal.
    smooth: Vec<Vec<f64>>,
}

impl LogSpectrum {
    /// `None` if too few bands are above the noise.
    fn of(density: &Density, [from_hz, to_hz]: [f64; 2]) -> Option<Self> {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let parts = density
            .values
            .chunks_exact((density.values.len() / PARTS).max(1));
        let least = ABOVE_NOISE * parts.map(mean).fold(f64::INFINITY, f64::min);
        let (mut frequency_hz, mut log_power) = (Vec::new(), Vec::new());
        let mut lower_hz = from_hz;
        while lower_hz < to_hz {
            let upper_hz = (lower_hz * (1.0 + BAND)).max(lower_hz + 0.999 * density.step_hz);
            let band: Vec<f64> = density
                .between(lower_hz, upper_hz)
                .map(|(_, p)| p)
                .collect();
            if !band.is_empty() && mean(&band) > least {
                frequency_hz.push(0.5 * (lower_hz + upper_hz));
                log_power.push(mean(&band).ln());
            }
            lower_hz = upper_hz;
        }
        (log_power.len() >= FEWEST).then(|| Self::new(frequency_hz, log_power))
    }

    fn new(frequency_hz: Vec<f64>, log_power: Vec<f64>) -> Self {
        let scale_hz = frequency_hz[frequency_hz.len() / 2];
        let functions: [fn(f64) -> f64; 3] = [|_| 1.0, f64::ln, |r| r * r];
        let mut spectrum = Self {
            frequency_hz,
            log_power,
            smooth: Vec::new(),
        };
        for function in functions {
            let mut column: Vec<f64> = spectrum
                .frequency_hz
                .iter()
                .map(|hz| function(hz / scale_hz))
                .collect();
            spectrum.clear(&mut column);
            let size = dot(&column, &column).sqrt();
            column.iter_mut().for_each(|x| *x /= size);
            spectrum.smooth.push(column);
        }
        spectrum
    }

    /// Removes the smooth functions.
    fn clear(&self, values: &mut [f64]) {
        for column in &self.smooth {
            let part = dot(values, column);
            values
                .iter_mut()
                .zip(column)
                .for_each(|(x, c)| *x -= part * c);
        }
    }

    /// Mean square of what is left without the power of a resonance.
    fn misfit(&self, resonance: Option<&Resonance>) -> f64 {
        let log_gain = |hz: f64| {
            resonance.map_or(0.0, |found| {
                let r = hz / found.frequency_hz;
                -((1.0 - r * r).powi(2) + (2.0 * found.damping_ratio * r).powi(2)).ln()
            })
        };
        let both = self.frequency_hz.iter().zip(&self.log_power);
        let mut left: Vec<f64> = both.map(|(hz, power)| power - log_gain(*hz)).collect();
        self.clear(&mut left);
        dot(&left, &left) / left.len() as f64
    }

    /// The resonance that fits best, and its misfit.
    fn best(&self) -> (Resonance, f64) {
        let (first, last) = (
            self.frequency_hz[0],
            self.frequency_hz[self.frequency_hz.len() - 1],
        );
        let place = |k: u32| first * (last / first).powf(f64::from(k) / f64::from(PLACES));
        let at = |frequency_hz, damping_ratio| {
            let resonance = Resonance {
                frequency_hz,
                damping_ratio,
            };
            (resonance, self.misfit(Some(&resonance)))
        };
        let grid = (1..PLACES).flat_map(|k| RATIOS.map(|ratio| at(place(k), ratio)));
        let better = |a: &(Resonance, f64), b: &(Resonance, f64)| a.1.total_cmp(&b.1);
        let mut best = grid.min_by(better).expect("the grid has places");
        let mut steps = FIRST;
        for _ in 0..STEPS {
            let around = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)].map(|(hz, ratio)| {
                let ratio = best.0.damping_ratio * (1.0 + steps[1]).powf(ratio);
                let hz = best.0.frequency_hz * (1.0 + steps[0]).powf(hz);
                at(hz.clamp(first, last), ratio.clamp(SHARPEST, 2.0 * WIDEST))
            });
            let next = around.into_iter().min_by(better).expect("there are four");
            if next.1 < best.1 {
                best = next;
            } else {
                steps = steps.map(|step| 0.5 * step);
            }
        }
        best
    }

    fn other_resonance(&self, declared: &[(f64, f64)]) -> Option<Resonance> {
        let (found, misfit) = self.best();
        let (frequency_hz, damping_ratio) = declared[0];
        let as_declared = Resonance {
            frequency_hz,
            damping_ratio,
        };
        let width_hz = 2.0 * found.damping_ratio * found.frequency_hz;
        let shows = |side: f64| {
            let hz = found.frequency_hz + side * width_hz;
            self.frequency_hz
                .iter()
                .any(|at| (at - hz).abs() < 0.5 * width_hz)
        };
        let is_off = |(hz, _): &(f64, f64)| (found.frequency_hz - hz).abs() > APART * hz;
        let fits = misfit < FITS * FITS
            && WORSE * misfit < self.misfit(None)
            && WORSE * misfit < self.misfit(Some(&as_declared));
        let is_resonance = found.damping_ratio < WIDEST && shows(-1.0) && shows(1.0);
        (fits && is_resonance && declared.iter().all(is_off)).then_some(found)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::testing::{noise, sine, sum};
    use super::*;

    /// The response of a resonance to an input, by the exact recursion of its free motion.
    fn rung(input: &[f64], rate_hz: f64, hz: f64, ratio: f64) -> Vec<f64> {
        let omega = TAU * hz / rate_hz;
        let (decay, cos) = (
            (-ratio * omega).exp(),
            (omega * (1.0 - ratio * ratio).sqrt()).cos(),
        );
        let (a, b) = (2.0 * decay * cos, -decay * decay);
        let mut before = [0.0; 2];
        let next = |x: &f64| {
            let y = (1.0 - a - b) * x + a * before[0] + b * before[1];
            before = [y, before[0]];
            y
        };
        input.iter().map(next).collect()
    }

    #[test]
    fn a_wrong_natural_frequency_is_found_from_noise_and_hits() {
        let mut hits = vec![0.0; 65_536];
        hits.iter_mut()
            .skip(900)
            .step_by(9000)
            .for_each(|x| *x = 200.0);
        for input in [noise(3, 65_536), sum(&hits, &noise(5, 65_536))] {
            for (hz, ratio) in [(590.0, 0.041), (590.0, 0.01), (1500.0, 0.02)] {
                let record = rung(&input, 20_000.0, hz, ratio);
                for declared in [0.75, 0.85, 1.2] {
                    let found = other_resonance(&record, 20_000.0, &[(declared * hz, ratio)]);
                    let found = found.unwrap_or_else(|| panic!("{hz} {ratio} {declared}"));
                    assert!((found.frequency_hz / hz - 1.0).abs() < 0.02, "{found:?}");
                }
                for declared in [0.97, 1.0, 1.03] {
                    let found = other_resonance(&record, 20_000.0, &[(declared * hz, ratio)]);
                    assert_eq!(found, None);
                }
            }
        }
    }

    #[test]
    fn a_wrong_natural_frequency_of_a_damped_stand_is_found_from_steps_and_hits() {
        let count = 20_000;
        // Steps to levels without order every quarter of a second, and short hits.
        let levels = noise(11, 16);
        let steps: Vec<f64> = (0..count).map(|i| levels[i / 1250]).collect();
        let mut hits = vec![0.0; count];
        for at in [550, 2600, 5350, 7750, 13_000] {
            hits[at..at + 4].copy_from_slice(&[3.0, 7.0, 7.0, 3.0]);
        }
        let quiet: Vec<f64> = noise(5, count).iter().map(|x| 0.003 * x).collect();
        for input in [steps, hits] {
            for (hz, ratio) in [(590.0, 0.07), (590.0, 0.02), (300.0, 0.1)] {
                let record = sum(&rung(&input, 5000.0, hz, ratio), &quiet);
                for declared in [0.85, 0.94, 1.0, 1.06, 1.2] {
                    let found = other_resonance(&record, 5000.0, &[(declared * hz, ratio)]);
                    let found_hz = found.map(|f| f.frequency_hz);
                    let is_found = found_hz.is_some_and(|found| (found / hz - 1.0).abs() < 0.02);
                    assert_eq!(
                        is_found,
                        declared != 1.0,
                        "{hz} {ratio} {declared} {found_hz:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_resonance_of_the_machine_beside_that_of_the_stand_is_not_taken_for_it() {
        for seed in 0..40 {
            let torque = rung(
                &noise(seed, 65_536),
                20_000.0,
                400.0 + 20.0 * seed as f64,
                0.05,
            );
            let torque = sum(&torque, &noise(seed + 100, 65_536));
            let record = rung(&torque, 20_000.0, 590.0, 0.041);
            assert_eq!(
                other_resonance(&record, 20_000.0, &[(590.0, 0.041)]),
                None,
                "{seed}"
            );
        }
    }

    #[test]
    fn lines_sweeps_and_bands_of_noise_are_no_resonances() {
        let count = 65_536;
        let white = noise(7, count);
        let modes = [(450.0, 0.02)];
        let line = sum(&sine(40.0, 20_000.0 / 590.0, count), &white);
        // A fluctuating speed, and a rising one.
        let phase = |i: usize| {
            let t = i as f64 / 20_000.0;
            (
                TAU * (590.0 * t + 2.0 * (TAU * 0.7 * t).sin()),
                TAU * (560.0 * t + 10.0 * t * t),
            )
        };
        let wavering = sum(
            &(0..count)
                .map(|i| 40.0 * phase(i).0.sin())
                .collect::<Vec<_>>(),
            &white,
        );
        let rising = sum(
            &(0..count)
                .map(|i| 40.0 * phase(i).1.sin())
                .collect::<Vec<_>>(),
            &white,
        );
        let multisine = (0..60).fold(white.clone(), |all, k| {
            sum(
                &all,
                &sine(10.0, 20_000.0 / (500.0 + 3.0 * f64::from(k)), count),
            )
        });
        for (what, record) in [
            ("line", line),
            ("wavering", wavering),
            ("rising", rising),
            ("multisine", multisine),
            ("noise", white),
        ] {
            assert_eq!(other_resonance(&record, 20_000.0, &modes), None, "{what}");
        }
    }
}
