//! The resonance of a stand in a running record, of which only the measured quantity is known.
//!
//! Where the torque has a smooth density around the resonance, as that of noise, or of an order whose speed rises through
//! it, the record has the density
//!
//! `S(f) = e^b u^p / ((1 − u²)² + 4 ζ² u²) + e^c`, `u = f/f₀`,
//!
//! with the noise `e^c` of the recorder. The lines `P` of a periodogram are exponentially distributed about it, so that
//! `ln f₀`, `ln ζ`, `b`, `p` and `c` minimise `∑ ln S + P/S` (P. Whittle, Ark. Mat. 2 (1953), 423). Lines of a steady speed
//! are left out. Nothing follows about the level of the torque.

mod density;
mod periodogram;

use std::f64::consts::TAU;
use std::ops::Range;

use torqcomp_model::{Estimate, Mode};

use crate::print::rounded;
use density::{DensityFit, DensityParameters, resonant, smooth};
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
/// Repetitions of fit and search for such lines.
const ROUNDS: usize = 4;
/// Least gain in log-likelihood over a density without a resonance.
const CLEAR: f64 = 15.0;
/// Largest relative rms deviation of the density from the law beyond chance.
const DEVIATES: f64 = 0.2;

/// A resonance, as a running record shows it.
#[derive(Debug, Clone)]
pub struct OperatingResonance {
    pub natural_frequency: Estimate,
    pub damping_ratio: Estimate,
    /// The range in Hz from which it follows.
    pub range_hz: [f64; 2],
}

impl OperatingResonance {
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
    /// It is shorter than this time.
    TooShort { least_s: f64 },
    /// Half the sampling rate is too close to the resonance, or below it.
    TooSlow { natural_hz: f64 },
    /// Its density has no peak there.
    NotExcited,
    /// Its density there is not that of a linear stand under a smooth torque.
    NotSmooth,
}

impl Hidden {
    /// The reason in words, with a remedy.
    pub fn text(self) -> String {
        match self {
            Self::TooShort { least_s } => format!(
                "the record is too short to resolve the resonance; record at least {} s",
                rounded(least_s, 2)
            ),
            Self::TooSlow { natural_hz } => format!(
                "the sampling rate is too low for a resonance at {} Hz",
                rounded(natural_hz, 4)
            ),
            Self::NotExcited => {
                "besides lines and noise nothing shows a resonance near that of the stand; record while the speed rises \
                 through it, or with a rougher torque"
                    .to_owned()
            }
            Self::NotSmooth => {
                "around the resonance the record is not that of a linear stand under a smooth torque: lines, a rough \
                 torque, or an effect that depends on the size of the motion; record at another speed, with less torque, \
                 or while the speed rises evenly"
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
    let half_hz = expected.damping_ratio * natural_hz;
    if natural_hz + half_hz > HIGHEST * rate_hz {
        return Err(Hidden::TooSlow { natural_hz });
    }
    let samples = &samples[..samples.len().min(LONGEST)];
    let least_s = PER_HALF_BANDWIDTH[1] / half_hz;
    if (samples.len() as f64) < least_s * rate_hz {
        return Err(Hidden::TooShort { least_s });
    }
    let clear = clear_of(others_hz, natural_hz, HIGHEST * rate_hz);
    let found = |taper| found_with(samples, rate_hz, taper, &clear, expected);
    found(TAPERS[0]).or_else(|first| found(TAPERS[1]).map_err(|_| first))
}

/// The same with a taper of the ends, in a range clear of other modes.
fn found_with(
    samples: &[f64],
    rate_hz: f64,
    taper: f64,
    clear: &Range<f64>,
    expected: &Mode,
) -> Result<OperatingResonance, Hidden> {
    let mut all = Periodogram::of(samples, rate_hz, taper);
    let natural_hz = expected.natural_frequency_hz();
    let half_hz = expected.damping_ratio * natural_hz;
    let lines = all.above_median(half_hz);
    all.leave_out(&lines, half_hz);
    let [from, to] = SEARCHED.map(|part| part * natural_hz);
    let searched = all.points(&within(from..to, clear), half_hz);
    let first = searched.search(half_hz).ok_or(Hidden::NotExcited)?;
    let by_reach = REACHES.map(|reach| all.confirmed(first.clone(), reach, clear, half_hz));
    let widest = by_reach
        .into_iter()
        .reduce(|wider, narrower| wider.or(narrower));
    widest.unwrap_or(Err(Hidden::NotExcited))
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
    /// The resonance fitted in a range about itself, if the density follows the law there and has a peak; `width_hz` is the
    /// width of the blocks with which lines are compared.
    fn confirmed(
        &mut self,
        mut fit: DensityFit,
        reach: f64,
        clear: &Range<f64>,
        width_hz: f64,
    ) -> Result<OperatingResonance, Hidden> {
        let steady = self.above_median(width_hz);
        let mut points = MeanLines(Vec::new());
        for _ in 0..ROUNDS {
            let (natural_hz, half_hz) = (fit.values[0].exp(), fit.half_hz());
            let from = (natural_hz - reach * half_hz).max(WIDEST[0] * natural_hz);
            let to = (natural_hz + reach * half_hz).min(WIDEST[1] * natural_hz);
            let range = within(from..to, clear);
            let both = steady.iter().zip(self.above(&fit.values, &range));
            let lines: Vec<bool> = both.map(|(one, other)| *one || other).collect();
            self.leave_out(&lines, width_hz);
            points = self.points(&range, half_hz);
            let next = points.fit(resonant, fit.values);
            let least_hz = PER_HALF_BANDWIDTH[1] * self.step_hz;
            let next = next.filter(|fit| fit.is_resonance() && fit.half_hz() > least_hz);
            fit = next.ok_or(Hidden::NotExcited)?;
        }
        let correlated = self.correlated();
        let start =
            DensityParameters::from([fit.values[0], 0.0, points.mean_power().ln(), 0.0, 0.0]);
        let plain = points.fit(smooth, start).ok_or(Hidden::NotExcited)?;
        if plain.objective - fit.objective < CLEAR * correlated {
            return Err(Hidden::NotExcited);
        }
        let (deviation, excess) = points.deviation(&fit.values, correlated);
        if deviation > DEVIATES {
            return Err(Hidden::NotSmooth);
        }
        let covariance = fit.information.try_inverse().ok_or(Hidden::NotExcited)?;
        let estimate = |unit: &'static str, k: usize| {
            let value = fit.values[k].exp();
            let std = (correlated * excess * covariance[(k, k)]).sqrt();
            Estimate::of(unit, value, Some(value * std))
        };
        let ends = [points.0.first(), points.0.last()];
        Ok(OperatingResonance {
            natural_frequency: estimate("Hz", 0),
            damping_ratio: estimate("", 1),
            range_hz: ends.map(|point| point.map_or(0.0, |point| point.frequency_hz)),
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
                let found = resonance(&record[5000..], RATE_HZ, &expected(0.02), &[]);
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
        let found = resonance(&record, RATE_HZ, &expected(0.02), &[]).expect("a resonance");
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
