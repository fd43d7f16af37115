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
/// Ratio of two damping ratios from which they contradict each other, that of the resolution to what the declared one
/// needs, and least width of a broader peak in lines.
const OTHER_DAMPING: f64 = 3.0;
const FINER: f64 = 0.25;
const RESOLVED: f64 = 4.0;
/// Least part of the power of a record within so many widths of a resonance that makes up most of it, its rms difference
/// as above, and how many times as large the squares are without the declared resonance where that shows as well.
const MOST: f64 = 0.5;
const WIDTHS: f64 = 3.0;
const FITS_DOMINANT: f64 = 0.8;
const SHOWN: f64 = 1.5;
/// Lines occupied by the mean, and shortest block, as a power of two.
const MEAN_LINES: f64 = 3.0;
const SHORTEST: u32 = 8;

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
    let &first = declared.first()?;
    if first.1 > SHARP {
        return None;
    }
    let is_off = |found: &Resonance| is_off(found, declared);
    near_declared(samples, rate_hz, first, |spectrum, _| {
        spectrum.instead_of(first, FITS).filter(is_off)
    })
}

/// The resonance of a record at the declared natural frequency (in Hz, with the declared damping ratio) if its damping is
/// another one by a factor of three or more.
///
/// The fit is that of [`other_resonance`]. Blocks of finite length broaden a peak, so that a larger damping counts only
/// if it is far wider than their resolution.
///
/// ```
/// use torqcomp_dsp::quality::resonance::other_damping;
/// // Hits on a body that rings at 59 Hz with a damping ratio of 0.02.
/// let ring = |t: f64| (-7.4 * t).exp() * (370.7 * t).sin();
/// let record: Vec<f64> = (0..40_000).map(|i| ring((f64::from(i) * 1e-3) % 1.7)).collect();
/// let found = other_damping(&record, 1000.0, (59.0, 0.2)).unwrap();
/// assert!((found.damping_ratio - 0.02).abs() < 0.01);
/// assert_eq!(other_damping(&record, 1000.0, (59.0, 0.02)), None);
/// ```
#[must_use]
pub fn other_damping(samples: &[f64], rate_hz: f64, declared: (f64, f64)) -> Option<Resonance> {
    let (declared_hz, ratio) = declared;
    // A record may be too short for the blocks of the declared width.
    let finest = 16.0 * (BLOCKS + 1) as f64 * rate_hz / (2.0 * declared_hz * samples.len() as f64);
    let resolved = finest.max(FINER * ratio);
    let range = (declared_hz, resolved);
    near_declared(samples, rate_hz, range, |spectrum, step_hz| {
        let found = spectrum.instead_of(declared, FITS)?;
        let times = found.damping_ratio / ratio;
        let is_resolved = 2.0 * found.damping_ratio * declared_hz > RESOLVED * step_hz;
        let is_other = times < 1.0 / OTHER_DAMPING || times > OTHER_DAMPING && is_resolved;
        let is_there = (found.frequency_hz - declared_hz).abs() < APART * declared_hz;
        (is_there && is_other).then_some(found)
    })
}

/// What is found in spectra around a frequency, the longest blocks first; also gives their frequency step. The blocks
/// resolve a resonance there of this damping ratio.
fn near_declared(
    samples: &[f64],
    rate_hz: f64,
    (near_hz, ratio): (f64, f64),
    find: impl Fn(&LogSpectrum, f64) -> Option<Resonance>,
) -> Option<Resonance> {
    let [from_hz, to_hz] = around(near_hz, rate_hz)?;
    let longest = (2 * samples.len() / (BLOCKS + 1)).checked_ilog2()?;
    // Sharp peaks need long blocks; broad ones have less variance with short blocks.
    let finest = (16.0 * rate_hz / (2.0 * ratio * near_hz)).log2().ceil() as u32;
    let powers = (finest.saturating_sub(RESOLUTIONS - 1)..=finest).rev();
    powers.filter(|power| *power <= longest).find_map(|power| {
        let density = welch(samples, rate_hz, 1 << power).ok()?;
        let spectrum = LogSpectrum::of(&density, [from_hz, to_hz])?;
        find(&spectrum, density.step_hz)
    })
}

/// The range examined around a frequency; `None` if too little of it is in the spectrum.
fn around(hz: f64, rate_hz: f64) -> Option<[f64; 2]> {
    let [from_hz, to_hz] = NEAR.map(|part| part * hz);
    let to_hz = to_hz.min(0.45 * rate_hz);
    (to_hz > 1.2 * hz).then_some([from_hz, to_hz])
}

/// Whether a resonance is none of the declared modes.
fn is_off(found: &Resonance, declared: &[(f64, f64)]) -> bool {
    let mut all = declared.iter();
    all.all(|(hz, _)| (found.frequency_hz - hz).abs() > APART * hz)
}

/// The resonance that makes up most of a record, wherever it is, unless it is a declared mode or the record shows the first
/// of those as well. The fit is that of [`other_resonance`], around the strongest peak.
///
/// ```
/// use torqcomp_dsp::quality::resonance::dominant_resonance;
/// // Hits on a body that rings at 59 Hz with a damping ratio of 0.02, declared in rad/s.
/// let ring = |t: f64| (-7.4 * t).exp() * (370.7 * t).sin();
/// let record: Vec<f64> = (0..40_000).map(|i| ring((f64::from(i) * 1e-3) % 1.7)).collect();
/// let found = dominant_resonance(&record, 1000.0, &[(370.7, 0.02)]).unwrap();
/// assert!((found.frequency_hz - 59.0).abs() < 0.5);
/// assert_eq!(dominant_resonance(&record, 1000.0, &[(59.5, 0.02)]), None);
/// ```
#[must_use]
pub fn dominant_resonance(
    samples: &[f64],
    rate_hz: f64,
    declared: &[(f64, f64)],
) -> Option<Resonance> {
    let &first = declared.first()?;
    dominant(samples, rate_hz, first).filter(|found| is_off(found, declared))
}

fn dominant(samples: &[f64], rate_hz: f64, declared: (f64, f64)) -> Option<Resonance> {
    let longest = (2 * samples.len() / (BLOCKS + 1)).checked_ilog2()?;
    let powers = (longest.saturating_sub(RESOLUTIONS)..=longest).rev();
    powers.filter(|power| *power >= SHORTEST).find_map(|power| {
        let density = welch(samples, rate_hz, 1 << power).ok()?;
        let least_hz = MEAN_LINES * density.step_hz;
        // Power per relative bandwidth: a drift has large densities at the lowest frequencies.
        let (peak_hz, _) = density
            .between(least_hz, 0.5 * rate_hz)
            .max_by(|a, b| (a.0 * a.1).total_cmp(&(b.0 * b.1)))?;
        let spectrum = LogSpectrum::of(&density, around(peak_hz, rate_hz)?)?;
        let found = spectrum.instead_of(declared, FITS_DOMINANT)?;
        let power = |from_hz, to_hz| density.between(from_hz, to_hz).map(|(_, p)| p).sum::<f64>();
        let reach_hz = WIDTHS * 2.0 * found.damping_ratio * found.frequency_hz;
        let own = power(found.frequency_hz - reach_hz, found.frequency_hz + reach_hz);
        let is_dominant = own > MOST * power(least_hz, 0.5 * rate_hz);
        (is_dominant && !shows(&density, rate_hz, declared)).then_some(found)
    })
}

/// Whether a spectrum has a peak at the declared resonance.
fn shows(density: &Density, rate_hz: f64, (frequency_hz, damping_ratio): (f64, f64)) -> bool {
    let range = around(frequency_hz, rate_hz);
    let spectrum = range.and_then(|range| LogSpectrum::of(density, range));
    let declared = Resonance {
        frequency_hz,
        damping_ratio,
    };
    spectrum.is_some_and(|s| SHOWN * s.misfit(Some(&declared)) < s.misfit(None))
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

    /// The resonance that fits, within this rms difference, far better than none and than the declared one.
    fn instead_of(
        &self,
        (frequency_hz, damping_ratio): (f64, f64),
        most: f64,
    ) -> Option<Resonance> {
        let (found, misfit) = self.best();
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
        let fits = misfit < most * most
            && WORSE * misfit < self.misfit(None)
            && WORSE * misfit < self.misfit(Some(&as_declared));
        let is_resonance = found.damping_ratio < WIDEST && shows(-1.0) && shows(1.0);
        (fits && is_resonance).then_some(found)
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
    fn a_resonance_that_makes_up_the_record_is_found_far_from_the_declared_one() {
        for seed in 0..10 {
            let record = rung(&noise(seed, 65_536), 20_000.0, 590.0, 0.02);
            for declared in [590.0 * TAU, 590.0 / TAU, 59.0, 5900.0] {
                let found = dominant_resonance(&record, 20_000.0, &[(declared, 0.02)]);
                let found = found.unwrap_or_else(|| panic!("{seed} {declared}"));
                assert!((found.frequency_hz / 590.0 - 1.0).abs() < 0.02, "{found:?}");
            }
        }
    }

    #[test]
    fn a_wrong_damping_ratio_is_found() {
        for seed in 0..10 {
            for ratio in [0.02, 0.03] {
                let record = rung(&noise(seed, 65_536), 20_000.0, 590.0, ratio);
                for (times, is_found) in [(0.1, true), (0.7, false), (1.0, false), (1.4, false)] {
                    let found = other_damping(&record, 20_000.0, (590.0, times * ratio));
                    assert_eq!(found.is_some(), is_found, "{seed} {ratio} {times}");
                }
                let found = other_damping(&record, 20_000.0, (590.0, 10.0 * ratio)).unwrap();
                assert!((found.damping_ratio / ratio - 1.0).abs() < 0.4, "{found:?}");
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
