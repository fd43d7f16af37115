//! The resonance of a stand in a running record, of which only the measured quantity is known.
//!
//! Where the torque has a smooth density around the resonance, as that of noise, or of an order whose speed rises through
//! it, the record has the density
//!
//! `S(f) = e^b u^p / ((1 − u²)² + 4 ζ² u²) + e^c`, `u = f/f₀`,
//!
//! with the noise `e^c` of the recorder. The lines `P` of a periodogram are exponentially distributed about it, so that
//! `ln f₀`, `ln ζ`, `b`, `p` and `c` minimise `∑ ln S + P/S` (P. Whittle, Ark. Mat. 2 (1953), 423). Lines of a steady speed
//! are left out. The spectrum of an order whose speed rises is smooth itself, so that it scatters less than that, and the
//! uncertainties are rather too large. Nothing follows about the level of the torque.

mod density;
mod periodogram;

use std::f64::consts::TAU;
use std::ops::Range;

use torqcomp_model::{Estimate, Mode};

use crate::print::rounded;
use density::{DensityFit, DensityInRange, DensityParameters, MOST_DAMPED, resonant, smooth};
use periodogram::{MeanLines, PER_HALF_BANDWIDTH, Periodogram};

/// Maximum number of samples; of more, the first count.
const LONGEST: usize = 1 << 22;
/// Fractions of the record over which each end is tapered. With the first, a speed that rises evenly has a flat spectrum;
/// the second, a Hann window, lets less of a line of a steady speed into the lines around it.
const TAPERS: [f64; 2] = [0.1, 0.5];
/// Range around the expected frequency in which the resonance is searched for, relative to it.
const SEARCHED: [f64; 2] = [0.6, 1.5];
/// Half-widths of the final range in half-bandwidths: the widest in which the law holds counts.
const REACHES: [f64; 3] = [15.0, 8.0, 5.0];
/// Range around the found frequency that is not left, relative to it.
const WIDEST: [f64; 2] = [0.4, 1.8];
/// Highest frequency, relative to the sampling rate.
const HIGHEST: f64 = 0.45;
/// Least width of a resonance relative to that expected, in a record too short for it.
const NARROWEST: f64 = 0.3;
/// Least damping ratio with which a record is searched.
const LEAST_DAMPED: f64 = 1e-4;
/// Maximum number of lines reported.
const MOST_LINES: usize = 12;
/// Amplitude relative to the largest sample up to which a line may be due to rounding.
const ROUNDING: f64 = 1e-12;
/// Factor that keeps a rounded minimum sufficient.
const ROUNDED_UP: f64 = 1.05;
/// Repetitions of fit and search for lines of a steady speed.
const ROUNDS: usize = 4;
/// Least gain in log-likelihood over a density without a resonance.
const CLEAR: f64 = 15.0;
/// Least damping ratio relative to that expected, and the standard uncertainties by which it must be less: in use, a stand
/// is hardly damped less, so that a narrower peak is that of a torque.
const SHARPEST: (f64, f64) = (0.7, 3.0);
/// Largest relative rms deviation of the density from the law beyond chance.
const DEVIATES: f64 = 0.2;

/// A resonance, as a running record shows it.
#[derive(Debug, Clone)]
pub struct OperatingResonance {
    pub natural_frequency: Estimate,
    pub damping_ratio: Estimate,
    /// The range in Hz from which it follows.
    pub range_hz: [f64; 2],
    /// The density of the record there.
    density: DensityInRange,
}

impl OperatingResonance {
    /// Whether it is too sharp for this mode.
    fn is_sharper_than(&self, mode: &Mode) -> bool {
        let (part, times) = SHARPEST;
        let less = part * mode.damping_ratio - self.damping_ratio.value();
        let std = self.damping_ratio.std_uncertainty().unwrap_or(0.0);
        less > times * std
    }

    pub fn mode(&self) -> Mode {
        Mode {
            omega_rad_s: TAU * self.natural_frequency.value(),
            damping_ratio: self.damping_ratio.value(),
        }
    }
}

/// Why a record does not show the resonance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hidden {
    /// The stand has none: the body is free, or damped too much.
    None,
    /// The record is shorter than this time.
    TooShort { least_s: f64 },
    /// Its rate is less than this.
    TooSlow { least_hz: f64 },
    /// Its density has no peak there.
    NotExcited,
    /// Its density there is not that of a linear stand under a smooth torque.
    NotSmooth,
}

impl Hidden {
    /// The more telling one of two reasons.
    fn or(self, other: Self) -> Self {
        match self {
            Self::NotExcited => other,
            _ => self,
        }
    }

    /// The reason in words, with a remedy.
    pub fn text(self) -> String {
        match self {
            Self::None => "the fitted stand has no resonance".to_owned(),
            Self::TooShort { least_s } => format!(
                "the record is too short to resolve it; record at least {} s",
                rounded(ROUNDED_UP * least_s, 2)
            ),
            Self::TooSlow { least_hz } => format!(
                "the sampling rate is too low; record at {} Hz or more",
                rounded(ROUNDED_UP * least_hz, 2)
            ),
            Self::NotExcited => {
                "apart from lines and noise, the record shows no resonance near that of the stand; record while the speed \
                 rises through it, or with a rougher torque"
                    .to_owned()
            }
            Self::NotSmooth => {
                "around it, the record does not look like that of a linear stand under a smooth torque: an order whose \
                 speed varies, impacts, another peak of the torque, or an effect that depends on the size of the motion; \
                 record at another speed, with less torque, or while the speed rises evenly"
                    .to_owned()
            }
        }
    }
}

/// The resonance of a running record near an expected mode, clear of other modes.
///
/// # Errors
/// If the record does not show it.
pub fn resonance(
    samples: &[f64],
    rate_hz: f64,
    expected: &Mode,
    others_hz: &[f64],
) -> Result<OperatingResonance, Hidden> {
    let natural_hz = expected.natural_frequency_hz();
    if expected.damping_ratio > MOST_DAMPED || natural_hz <= 0.0 {
        return Err(Hidden::None);
    }
    let half_hz = half_bandwidth_hz(expected);
    let least_hz = (natural_hz + half_hz) / HIGHEST;
    if rate_hz < least_hz {
        return Err(Hidden::TooSlow { least_hz });
    }
    let samples = &samples[..samples.len().min(LONGEST)];
    let least_s = PER_HALF_BANDWIDTH[1] / half_hz;
    if (samples.len() as f64) < least_s * rate_hz {
        return Err(Hidden::TooShort { least_s });
    }
    let clear = clear_of(others_hz, natural_hz, HIGHEST * rate_hz);
    let found = |taper| {
        let found = found_with(samples, rate_hz, taper, &clear, expected)?;
        match found.is_sharper_than(expected) {
            true => Err(Hidden::NotSmooth),
            false => Ok(found),
        }
    };
    found(TAPERS[0]).or_else(|first| found(TAPERS[1]).map_err(|other| first.or(other)))
}

/// The strongest lines of a steady speed in a running record: frequency in Hz and amplitude.
pub fn steady_lines(
    samples: &[f64],
    rate_hz: f64,
    expected: &Mode,
    found: Option<&OperatingResonance>,
) -> Vec<[f64; 2]> {
    let samples = &samples[..samples.len().min(LONGEST)];
    let all = Periodogram::of(samples, rate_hz, TAPERS[1], half_bandwidth_hz(expected));
    let density = found.map(|found| &found.density);
    let lines = all.steady_lines(density, MOST_LINES);
    let largest = samples.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let amplitudes = lines
        .into_iter()
        .map(|[hz, power]| [hz, 2.0 * power.sqrt()]);
    amplitudes
        .filter(|line| line[1] > ROUNDING * largest)
        .collect()
}

/// Half-bandwidth `ζ f₀` with which a record is searched.
fn half_bandwidth_hz(mode: &Mode) -> f64 {
    mode.damping_ratio.max(LEAST_DAMPED) * mode.natural_frequency_hz()
}

/// The same with a taper of the ends, in a range clear of other modes.
fn found_with(
    samples: &[f64],
    rate_hz: f64,
    taper: f64,
    clear: &Range<f64>,
    expected: &Mode,
) -> Result<OperatingResonance, Hidden> {
    let natural_hz = expected.natural_frequency_hz();
    let half_hz = half_bandwidth_hz(expected);
    let mut all = Periodogram::of(samples, rate_hz, taper, half_hz);
    all.leave_out_lines(None);
    let [from, to] = SEARCHED.map(|part| part * natural_hz);
    let searched = all.points(&within(from..to, clear), half_hz);
    let first = searched.search(half_hz).ok_or(Hidden::NotExcited)?;
    let mut hidden = Hidden::NotExcited;
    for reach in REACHES {
        match all.confirmed(first.clone(), reach, clear, half_hz) {
            Ok(found) => return Ok(found),
            Err(why) => hidden = hidden.or(why),
        }
    }
    Err(hidden)
}

fn within(range: Range<f64>, clear: &Range<f64>) -> Range<f64> {
    range.start.max(clear.start)..range.end.min(clear.end)
}

/// The range around a mode up to the middle between it and its neighbours.
fn clear_of(others_hz: &[f64], natural_hz: f64, highest_hz: f64) -> Range<f64> {
    let mut clear = 0.0..highest_hz;
    for other in others_hz {
        let middle = (other * natural_hz).sqrt();
        match middle < natural_hz {
            true => clear.start = clear.start.max(middle),
            false => clear.end = clear.end.min(middle),
        }
    }
    clear
}

impl Periodogram {
    /// The resonance fitted in a range about itself, if the density follows the law there and has a peak; `expected_hz` is
    /// the half-bandwidth that is expected.
    fn confirmed(
        &mut self,
        mut fit: DensityFit,
        reach: f64,
        clear: &Range<f64>,
        expected_hz: f64,
    ) -> Result<OperatingResonance, Hidden> {
        let mut points = MeanLines(Vec::new());
        let mut density = None;
        for _ in 0..ROUNDS {
            let (natural_hz, half_hz) = (fit.values[0].exp(), fit.half_hz());
            let from = (natural_hz - reach * half_hz).max(WIDEST[0] * natural_hz);
            let to = (natural_hz + reach * half_hz).min(WIDEST[1] * natural_hz);
            let present = density.insert(DensityInRange {
                values: fit.values,
                range_hz: within(from..to, clear),
            });
            self.leave_out_lines(Some(present));
            points = self.points(&present.range_hz, half_hz);
            let next = points.fit(resonant, fit.values);
            let next = next.filter(DensityFit::is_resonance);
            fit = next.ok_or(Hidden::NotExcited)?;
            let least_s = PER_HALF_BANDWIDTH[1] / fit.half_hz();
            if least_s * self.step_hz > 1.0 {
                // What is much narrower than the resonance expected is a chance peak.
                let is_near = fit.half_hz() > NARROWEST * expected_hz;
                return Err(match is_near {
                    true => Hidden::TooShort { least_s },
                    false => Hidden::NotExcited,
                });
            }
        }
        let correlated = self.correlated();
        let level = points.mean_power().ln();
        let start = DensityParameters::from([fit.values[0], 0.0, level, 0.0, 0.0]);
        let plain = points.fit(smooth, start).ok_or(Hidden::NotExcited)?;
        if plain.objective - fit.objective < CLEAR * correlated {
            return Err(Hidden::NotExcited);
        }
        let deviation = points.deviation(&fit.values, correlated);
        if deviation.rms > DEVIATES && !deviation.is_by_chance {
            return Err(Hidden::NotSmooth);
        }
        let factors = fit.information.cholesky().ok_or(Hidden::NotExcited)?;
        let covariance = factors.inverse() * (correlated * deviation.variance);
        let estimate = |unit: &'static str, k: usize| {
            let value = fit.values[k].exp();
            Estimate::of(unit, value, Some(value * covariance[(k, k)].sqrt()))
        };
        let ends = [points.0.first(), points.0.last()];
        Ok(OperatingResonance {
            natural_frequency: estimate("Hz", 0),
            damping_ratio: estimate("", 1),
            range_hz: ends.map(|point| point.map_or(0.0, |point| point.frequency_hz)),
            density: density.ok_or(Hidden::NotExcited)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::test_noise::noise;

    const RATE_HZ: f64 = 5000.0;
    const NATURAL_HZ: f64 = 590.0;

    /// Answer of a stand to samples of a torque: a recursion with the poles of the stand.
    fn answer(torque: impl Iterator<Item = f64>, natural_hz: f64, ratio: f64) -> Vec<f64> {
        let decay = (-TAU * natural_hz * ratio / RATE_HZ).exp();
        let turn = (TAU * natural_hz * (1.0 - ratio * ratio).sqrt() / RATE_HZ).cos();
        let scale = 1.0 - 2.0 * decay * turn + decay * decay;
        let mut last = [0.0; 2];
        let next = |torque: f64| {
            let x = 2.0 * decay * turn * last[0] - decay * decay * last[1] + scale * torque;
            last = [x, last[0]];
            x
        };
        torque.map(next).collect()
    }

    fn expected(ratio: f64) -> Mode {
        Mode {
            omega_rad_s: TAU * NATURAL_HZ,
            damping_ratio: ratio,
        }
    }

    /// Deviations of frequency and damping ratio from the truth, in standard uncertainties.
    fn deviations(found: &OperatingResonance, natural_hz: f64, ratio: f64) -> [f64; 2] {
        let of = |estimate: &Estimate, truth: f64| {
            let std = estimate.std_uncertainty().expect("an uncertainty");
            (estimate.value() - truth) / std
        };
        [
            of(&found.natural_frequency, natural_hz),
            of(&found.damping_ratio, ratio),
        ]
    }

    /// Noise as torque beside the lines of a steady speed, and noise of the recorder; the stand is 4 % softer than
    /// expected.
    #[test]
    fn uncertainties_cover_the_truth() {
        for ratio in [0.005, 0.02, 0.07] {
            let mut squares = [0.0; 2];
            let seeds = 40;
            for seed in 0..seeds {
                let (mut torque, mut recorder) = (noise(2 * seed + 1), noise(7919 * (seed + 1)));
                let speed_hz = 47.0 + 0.1 * seed as f64;
                let lines = |i: usize| {
                    let line = |k: u32| (TAU * f64::from(k) * speed_hz * i as f64 / RATE_HZ).sin();
                    (1..40).map(line).sum::<f64>()
                };
                let torques = (0..45_000).map(|i| torque() + 0.3 * lines(i));
                let mut record = answer(torques, 566.4, ratio);
                record.iter_mut().for_each(|x| *x += 0.2 * recorder());
                let found = resonance(&record[5000..], RATE_HZ, &expected(ratio), &[]);
                let found = found.unwrap_or_else(|why| panic!("{ratio}, {seed}: {why:?}"));
                let off = deviations(&found, 566.4, ratio);
                for (sum, off) in squares.iter_mut().zip(off) {
                    *sum += off * off / seeds as f64;
                }
            }
            for square in squares {
                assert!((0.4..2.4).contains(&square), "{ratio}: {squares:?}");
            }
        }
    }

    /// An order whose speed rises through the resonance, as its only torque.
    #[test]
    fn an_order_that_rises_through_the_resonance_shows_it() {
        let chirp = |i: usize| {
            let t = i as f64 / RATE_HZ;
            (TAU * (100.0 + 45.0 * t) * t).sin()
        };
        let mut recorder = noise(5);
        let mut record = answer((0..60_000).map(chirp), 610.0, 0.01);
        record.iter_mut().for_each(|x| *x += 0.01 * recorder());
        let found = resonance(&record, RATE_HZ, &expected(0.012), &[]).expect("a resonance");
        // A peak that is much sharper than that of the stand is no resonance of it.
        let sharp = resonance(&record, RATE_HZ, &expected(0.05), &[]);
        assert_eq!(sharp.err(), Some(Hidden::NotSmooth));
        let [frequency, ratio] = [found.natural_frequency.value(), found.damping_ratio.value()];
        assert!((frequency / 610.0 - 1.0).abs() < 5e-4, "{frequency}");
        assert!((ratio / 0.01 - 1.0).abs() < 0.03, "{ratio}");
    }

    #[test]
    fn a_record_without_the_resonance_says_why() {
        let mut recorder = noise(11);
        let lines = |i: usize| -> f64 {
            let line = |k: u32| (TAU * f64::from(k) * 47.0 * i as f64 / RATE_HZ).sin();
            (1..40).map(line).sum()
        };
        let mut record = answer((0..60_000).map(lines), NATURAL_HZ, 0.02);
        record.iter_mut().for_each(|x| *x += 0.01 * recorder());
        let found = resonance(&record[20_000..], RATE_HZ, &expected(0.02), &[]);
        assert_eq!(found.err(), Some(Hidden::NotExcited));
        let found = resonance(&record[..1000], RATE_HZ, &expected(0.02), &[]);
        assert!(matches!(found.err(), Some(Hidden::TooShort { .. })));
        let found = resonance(&record, 1200.0, &expected(0.02), &[]);
        assert!(matches!(found.err(), Some(Hidden::TooSlow { .. })));
    }
}
