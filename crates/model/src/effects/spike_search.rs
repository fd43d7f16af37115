//! Search for a train of spikes in records, and its subtraction.

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector};

use torqcomp_fourier::rms;

use super::lines::FoundLine;
use super::spike_trains::{again, find_trains, settle};
use super::spikes::{LONGEST, SAME, SpikeMoments, SpikeShape, SpikeTrain, TERMS, powers};

/// Shortest period in samples: a spike fills at most half of it.
const SHORTEST_PERIOD: f64 = 8.0;
/// Largest order of the prediction of the signal.
const ORDER: usize = 24;
/// Smallest noise, relative to the power of the record, at which the prediction is computed.
const FLOOR: f64 = 1e-11;
/// Bins of a folded record per sample.
const BINS: usize = 4;
/// Samples at the beginning of a record from which a declared rate is refined, doubled until all are used.
const FIRST_SAMPLES: usize = 4096;
/// Smallest relative change of a sum of squares that counts.
const OPEN: f64 = 1e-9;
/// Least part of a typical spike in the mean one, and of every other one: outliers that happen to be a multiple of a
/// period apart leave most of the places empty.
const TYPICAL: f64 = 0.5;
/// Power of a train, in variances of a sample, that chance reaches at the best of many moments beyond one for each
/// coefficient of its shape.
const CHANCE: f64 = 30.0;
/// Power of a record without its train, relative to its unpredictable part, from which it has a signal.
const SIGNAL: f64 = 4.0;
/// Periods beside that of a train at which the record shows what its signal reaches, in drifts by a spike's length.
const BESIDE: std::ops::RangeInclusive<u32> = 2..=5;
/// Largest plausible size of the spikes of a record, relative to those of the stand.
const MOST: f64 = 2.0;

/// A train found in a record.
#[derive(Debug, Clone)]
pub struct FoundTrain {
    /// Its moments.
    pub moments: SpikeMoments,
    /// Shape of its spikes.
    pub shape: SpikeShape,
    /// Power that it explains, in variances of the unpredictable part of a sample.
    pub power: f64,
    /// Power that chance and the signal reach at other periods.
    pub chance: f64,
    /// Whether the typical spike, and every other one, is like the mean one.
    pub is_steady: bool,
}

impl FoundTrain {
    /// Fraction of the train to rely on: nothing of what chance reaches, nearly all of several times that.
    #[must_use]
    pub fn share(&self) -> f64 {
        match self.is_steady {
            true => (1.0 - (self.chance / self.power).powi(2)).max(0.0),
            false => 0.0,
        }
    }
}

/// A record in which trains are searched for, with the part of each sample that the preceding ones do not predict:
/// spikes are not predictable, a smooth signal is (J. Makhoul, Proc. IEEE 63 (1975), 561).
pub struct SpikeSearch {
    /// The record without its mean.
    samples: Vec<f64>,
    /// Coefficients of the prediction error `e`, the first of which is 1.
    filter: Vec<f64>,
    /// `e`, divided by its standard deviation.
    error: Vec<f64>,
    /// `e` through the time-reversed filter, likewise.
    matched: Vec<f64>,
    std: f64,
}

/// Sums over the spikes of a record.
struct Sums {
    count: f64,
    /// Of the products of the powers of the fractions of a sample.
    products: [[f64; TERMS]; TERMS],
    /// Of the matched record at each sample of a spike, times those powers.
    at: Vec<[f64; TERMS]>,
}

impl SpikeSearch {
    /// Prepares a record for trains of about that period.
    #[must_use]
    pub fn of(samples: &[f64], period: f64) -> Self {
        let length = LONGEST.min((0.5 * period) as usize);
        let order = ORDER.min((period as usize).saturating_sub(length));
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        let samples: Vec<f64> = samples.iter().map(|y| y - mean).collect();
        let filter = prediction_of(samples.iter().copied(), order);
        Self::filtered(samples, filter, None)
    }

    /// The same with the prediction of the record without a train: spikes are in part predictable from each other, which
    /// hides that part. `None` for a record with a signal.
    pub(super) fn beside_train(&self, train: &FoundTrain) -> Option<Self> {
        let own = train.shape.train(train.moments, 0..self.samples.len());
        let rest: Vec<f64> = self.samples.iter().zip(own).map(|(y, s)| y - s).collect();
        let filter = prediction_of(rest.iter().copied(), self.order());
        let std = rms(&errors(&rest, &filter));
        let is_noise = rms(&rest).powi(2) < SIGNAL * std * std;
        is_noise.then(|| Self::filtered(self.samples.clone(), filter, Some(std)))
    }

    /// With the standard deviation of the unpredictable part, if it is not that of the whole prediction error.
    fn filtered(samples: Vec<f64>, filter: Vec<f64>, std: Option<f64>) -> Self {
        let mut error = errors(&samples, &filter);
        let std = std.unwrap_or_else(|| rms(&error)).max(f64::MIN_POSITIVE);
        error.iter_mut().for_each(|e| *e /= std);
        let next = |i: usize| filter.iter().zip(&error[i..]).map(|(a, e)| a * e).sum();
        let matched = (0..error.len()).map(next).collect();
        Self {
            samples,
            filter,
            error,
            matched,
            std,
        }
    }

    /// Number of samples of the record.
    pub(super) fn len(&self) -> usize {
        self.error.len()
    }

    fn order(&self) -> usize {
        self.filter.len() - 1
    }

    /// The samples whose prediction error and those that depend on them are known.
    fn usable(&self, samples: Range<usize>) -> Range<usize> {
        let order = self.order();
        samples.start.max(order)..samples.end.min(self.error.len().saturating_sub(order))
    }

    /// The moment at which the folded prediction error has the most power in the length of a spike and of the filter.
    pub(super) fn folded(&self, period: f64, samples: Range<usize>) -> (f64, f64) {
        let samples = self.usable(samples);
        let count = ((period * BINS as f64) as usize).max(1);
        let mut bins = vec![(0.0, 0.0_f64); count];
        for i in samples.clone() {
            let turns = i as f64 / period;
            let bin = ((turns - turns.floor()) * count as f64) as usize;
            let (sum, number) = &mut bins[bin.min(count - 1)];
            *sum += self.error[i];
            *number += 1.0;
        }
        let sample = |start: usize| {
            let own = (start..start + BINS).map(|b| bins[b % count]);
            let (sum, number) = own.fold((0.0, 0.0), |(s, n), (a, b)| (s + a, n + b));
            if number > 0.0 {
                sum * sum / number
            } else {
                0.0
            }
        };
        let powers: Vec<f64> = (0..count).map(sample).collect();
        let moments = SpikeMoments {
            moment: 0.0,
            period,
            is_smooth: false,
        };
        let length = (moments.length() + self.order()).min(period as usize);
        let power = |start: usize| {
            let own = (0..length).map(|k| powers[(start + k * BINS) % count]);
            own.sum::<f64>()
        };
        let best = (0..count).map(|start| (start, power(start)));
        let (start, power) = best.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default();
        (start as f64 / count as f64 * period, power)
    }

    fn sums(&self, moments: SpikeMoments, samples: Range<usize>) -> Sums {
        let length = moments.length();
        let mut sums = Sums {
            count: 0.0,
            products: [[0.0; TERMS]; TERMS],
            at: vec![[0.0; TERMS]; length],
        };
        for at in moments.within(&self.usable(samples)) {
            let first = (at - SAME).ceil();
            let powers = powers((first - at).max(0.0));
            sums.count += 1.0;
            for (row, p) in sums.products.iter_mut().zip(powers) {
                row.iter_mut()
                    .zip(powers)
                    .for_each(|(sum, q)| *sum += p * q);
            }
            let own = &self.matched[first as usize..][..length];
            for (sum, w) in sums.at.iter_mut().zip(own) {
                sum.iter_mut()
                    .zip(powers)
                    .for_each(|(sum, p)| *sum += p * w);
            }
        }
        sums
    }

    /// The shape that explains the most of the prediction error, by least squares, and the power explained.
    fn shape(&self, moments: SpikeMoments) -> Option<(SpikeShape, f64)> {
        let sums = self.sums(moments, 0..self.error.len());
        let all: Vec<(usize, usize)> = moments.coefficients().collect();
        let lag = |lag: usize| -> f64 {
            let both = self
                .filter
                .iter()
                .zip(self.filter.get(lag..).unwrap_or(&[]));
            both.map(|(a, b)| a * b).sum()
        };
        let lags: Vec<f64> = (0..sums.at.len()).map(lag).collect();
        let matrix = DMatrix::from_fn(all.len(), all.len(), |i, j| {
            let times = sums.products[all[i].1][all[j].1];
            // Moments at whole samples leave all but the level open.
            let least = if i == j { OPEN } else { 0.0 };
            (times + least * sums.count) * lags[all[i].0.abs_diff(all[j].0)]
        });
        let right = DVector::from_fn(all.len(), |i, _| sums.at[all[i].0][all[i].1]);
        let found = Cholesky::new(matrix)?.solve(&right);
        let power = found.dot(&right);
        Some((SpikeShape::of(moments, found.as_slice()), power))
    }

    pub(super) fn power(&self, moments: SpikeMoments) -> f64 {
        self.shape(moments).map_or(0.0, |(_, power)| power)
    }

    /// The moments of a train of that period, as far as the folded record gives them.
    pub(super) fn coarse(&self, period: f64) -> SpikeMoments {
        let (start, _) = self.folded(period, 0..self.error.len());
        // The window of the folded record is longer than a spike.
        let steps = 0..=2 * self.order() + 2;
        let candidates = steps.map(|k| SpikeMoments {
            moment: start + 0.5 * (k as f64 - 1.0),
            period,
            is_smooth: false,
        });
        let with_power = candidates.map(|moments| (moments, self.power(moments)));
        let best = with_power.max_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or(
            SpikeMoments {
                moment: start,
                period,
                is_smooth: false,
            },
            |(m, _)| m,
        )
    }

    /// The train of a known period.
    #[must_use]
    pub fn found(&self, period: f64) -> Option<FoundTrain> {
        let mut moments = vec![self.coarse(period)];
        settle(std::slice::from_ref(self), &mut moments, false);
        let found = again(std::slice::from_ref(self), &mut moments, false)?;
        found.into_iter().next()
    }

    /// Largest power at periods beside that of a train.
    fn beside(&self, moments: SpikeMoments) -> f64 {
        let all = 0..self.error.len();
        let drift = 2.0 * moments.length() as f64 / all.len() as f64;
        let periods = BESIDE.flat_map(|k| [-1.0, 1.0].map(|side| side * f64::from(k)));
        let powers = periods.map(|k| {
            self.folded(moments.period * (1.0 + k * drift), all.clone())
                .1
        });
        powers.fold(0.0, f64::max)
    }

    pub(super) fn train(&self, moments: SpikeMoments) -> Option<FoundTrain> {
        let all = 0..self.error.len();
        let (shape, power) = self.shape(moments)?;
        let mut parts: Vec<f64> = moments
            .within(&self.usable(all))
            .map(|at| {
                let first = (at - SAME).ceil();
                let own = self.matched[first as usize..].iter().take(moments.length());
                let powers = powers((first - at).max(0.0));
                own.enumerate()
                    .map(|(k, w)| w * shape.value(k, powers))
                    .sum()
            })
            .collect();
        let mean = |first: usize, step: usize| {
            let some = parts.iter().skip(first).step_by(step);
            some.sum::<f64>() / parts.len().saturating_sub(first).div_ceil(step) as f64
        };
        // At twice the rate of a train, every other place is empty.
        let (mean, alternate) = (mean(0, 1), mean(0, 2).min(mean(1, 2)));
        parts.sort_by(f64::total_cmp);
        let typical = parts.get(parts.len() / 2).copied().unwrap_or(0.0);
        let in_units = |own: [f64; TERMS]| own.map(|c| c * self.std);
        let chance = CHANCE + moments.column_count() as f64;
        Some(FoundTrain {
            moments,
            shape: SpikeShape {
                samples: shape.samples.into_iter().map(in_units).collect(),
            },
            power,
            chance: self.beside(moments).max(chance),
            is_steady: mean > 0.0 && typical.min(alternate) >= TYPICAL * mean,
        })
    }
}

/// Subtracts trains from a record, each with the moments and the mean shape of its spikes in the record; of a train
/// that the signal hides, a part.
pub fn subtract_spikes(samples: &mut [f64], rate_hz: f64, trains: &[SpikeTrain]) -> Vec<FoundLine> {
    let mut all = Vec::new();
    for train in trains {
        let period = rate_hz / train.frequency_hz;
        let is_seen = (SHORTEST_PERIOD..0.5 * samples.len() as f64).contains(&period);
        if !is_seen || train.amplitude <= 0.0 {
            continue;
        }
        let search = SpikeSearch::of(samples, period);
        let Some(found) = find_trains(&[search], period, FIRST_SAMPLES).and_then(|mut f| f.pop())
        else {
            continue;
        };
        let whole = 0..samples.len();
        let recorded = found.shape.peak(found.moments, whole.clone());
        let share = found.share() * (MOST * train.amplitude / recorded).min(1.0);
        let own = found.shape.train(found.moments, whole);
        samples
            .iter_mut()
            .zip(own)
            .for_each(|(y, s)| *y -= share * s);
        all.push(FoundLine {
            frequency_hz: rate_hz / found.moments.period,
            amplitude: train.amplitude,
            recorded,
            phase_rad: -TAU * (found.moments.moment / found.moments.period).fract(),
            share,
        });
    }
    all
}

/// Prediction errors of samples, by the coefficients of a prediction error.
fn errors(samples: &[f64], filter: &[f64]) -> Vec<f64> {
    let order = filter.len() - 1;
    let mut errors = vec![0.0; samples.len()];
    for (i, e) in errors.iter_mut().enumerate().skip(order) {
        let past = samples[i - order..=i].iter().rev();
        *e = filter.iter().zip(past).map(|(a, y)| a * y).sum();
    }
    errors
}

/// Coefficients of the prediction error of a record, tapered, as its ends would count as signal of all frequencies.
fn prediction_of(samples: impl ExactSizeIterator<Item = f64>, order: usize) -> Vec<f64> {
    let turn = TAU / samples.len() as f64;
    let tapered = samples.enumerate();
    let tapered = tapered.map(|(i, y)| y * (0.5 - 0.5 * (turn * (i as f64 + 0.5)).cos()));
    prediction_error(&tapered.collect::<Vec<_>>(), order)
}

/// Coefficients of the prediction error of a signal, by Levinson's recursion.
fn prediction_error(samples: &[f64], order: usize) -> Vec<f64> {
    let covariance = |lag: usize| -> f64 {
        let later = samples.get(lag..).unwrap_or(&[]);
        samples.iter().zip(later).map(|(a, b)| a * b).sum()
    };
    let mut covariances: Vec<f64> = (0..=order).map(covariance).collect();
    covariances[0] *= 1.0 + FLOOR;
    let mut filter = vec![1.0];
    let mut left = covariances[0];
    for step in 1..=order {
        if left <= 0.0 {
            break;
        }
        let known = filter.iter().zip(covariances[1..=step].iter().rev());
        let reflection = -known.map(|(a, r)| a * r).sum::<f64>() / left;
        filter.push(0.0);
        let reversed: Vec<f64> = filter.iter().rev().copied().collect();
        let both = filter.iter_mut().zip(reversed);
        both.for_each(|(a, b)| *a += reflection * b);
        left *= 1.0 - reflection * reflection;
    }
    filter.resize(order + 1, 0.0);
    filter
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reproducible numbers of unit variance (sum of twelve uniform ones).
    fn noise(mut state: u64) -> impl FnMut() -> f64 {
        move || {
            let mut uniform = || {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                (state >> 11) as f64 / (1_u64 << 53) as f64
            };
            (0..12).map(|_| uniform()).sum::<f64>() - 6.0
        }
    }

    /// Spikes `a e^(−(t − t_j)/d)` in samples.
    fn train(count: usize, (first, period): (f64, f64), (size, decay): (f64, f64)) -> Vec<f64> {
        let mut train = vec![0.0; count];
        let mut at = first;
        while at < count as f64 {
            for (i, y) in train
                .iter_mut()
                .enumerate()
                .skip(at.ceil() as usize)
                .take(60)
            {
                *y += size * (-(i as f64 - at) / decay).exp();
            }
            at += period;
        }
        train
    }

    fn rms(values: impl Iterator<Item = f64>) -> f64 {
        let squares: Vec<f64> = values.map(|v| v * v).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    #[test]
    fn a_train_in_noise_is_found() {
        for (decay, size, most) in [(1.0, 20.0, 0.1), (3.0, 5.0, 0.12), (5.0, 20.0, 0.1)] {
            let mut random = noise(3);
            let own = train(16_000, (91.37, 205.55), (size, decay));
            let samples: Vec<f64> = own.iter().map(|s| s + random()).collect();
            let search = SpikeSearch::of(&samples, 205.5);
            let found = find_trains(&[search], 205.5, 4096).unwrap().pop().unwrap();
            let period = found.moments.period;
            assert!(
                (period / 205.55 - 1.0).abs() < 2e-5,
                "{decay} {size}: {period}"
            );
            let left = found.shape.train(found.moments, 0..16_000);
            let left = rms(left.zip(&own).map(|(a, b)| a - b)) / rms(own.iter().copied());
            assert!(left < most && found.is_steady, "{decay} {size}: {left}");
        }
    }

    /// In records of 12.6 spikes, 25 places at twice the rate: the typical one, the median, is full or empty by chance.
    #[test]
    fn at_twice_the_rate_every_other_place_is_empty() {
        let mut random = noise(4);
        let own = train(2500, (40.3, 198.15), (20.0, 5.0));
        let samples: Vec<f64> = own.iter().map(|s| s + random()).collect();
        for (period, is_train) in [(198.15, true), (99.075, false)] {
            let search = SpikeSearch::of(&samples, period);
            let found = find_trains(&[search], period, 2500).unwrap().pop().unwrap();
            assert_eq!(found.share() > 0.0, is_train, "{period}");
        }
    }

    #[test]
    fn spikes_are_subtracted_and_the_signal_stays() {
        // Lines up to 1.5 kHz at 20 kHz that are 100 times the noise.
        let signal: Vec<f64> = (0..30_000)
            .map(|i| {
                let line = |k: i32| {
                    let k = f64::from(k);
                    (TAU * (30.0 + 61.3 * k) / 20_000.0 * f64::from(i) + k * k).sin()
                };
                40.0 + 20.0 * (0..24).map(line).sum::<f64>()
            })
            .collect();
        let mut random = noise(5);
        let noise: Vec<f64> = (0..30_000).map(|_| random()).collect();
        let spikes = train(30_000, (17.8, 133.21), (20.0, 3.0));
        let declared = SpikeTrain {
            frequency_hz: 20_000.0 / 133.2,
            amplitude: 20.0,
        };
        let run = |spikes: &[f64]| {
            let parts = signal.iter().zip(&noise).zip(spikes);
            let mut samples: Vec<f64> = parts.map(|((y, n), s)| y + n + s).collect();
            let found = subtract_spikes(&mut samples, 20_000.0, &[declared]);
            let parts = signal.iter().zip(&noise).zip(samples);
            let left = rms(parts.map(|((y, n), s)| s - y - n));
            (found[0], left)
        };
        let (found, left) = run(&spikes);
        let share = left / rms(spikes.iter().copied());
        assert!(share < 0.1 && found.share > 0.95, "{share} {found:?}");
        // Without a train, nothing is subtracted.
        let (found, left) = run(&vec![0.0; 30_000]);
        assert!(left < 0.02, "{left} {found:?}");
    }

    #[test]
    fn outliers_are_no_train() {
        let mut random = noise(9);
        let mut samples: Vec<f64> = (0..16_000).map(|_| random()).collect();
        for k in 1..60 {
            samples[k * k * 7919 % 16_000] += if k % 2 == 0 { 40.0 } else { -25.0 };
        }
        for period in [61.3, 205.55, 1000.0] {
            let search = SpikeSearch::of(&samples, period);
            let found = find_trains(&[search], period, 4096).unwrap().pop().unwrap();
            assert_eq!(found.share(), 0.0, "{period}: {found:?}");
        }
    }

    /// Pulses that change over all of their length, at whole and other periods.
    #[test]
    fn smooth_spikes_are_found() {
        for period in [160.0, 154.78, 205.55] {
            let mut random = noise(3);
            let pulse = |q: f64| (-((q - 6.0) / 1.8).powi(2)).exp() * (0.5 * (q - 6.0)).cos();
            let own = (0..8000).map(|i| 110.0 * pulse((f64::from(i) - 37.3).rem_euclid(period)));
            let own: Vec<f64> = own.collect();
            let samples: Vec<f64> = own.iter().map(|s| s + random()).collect();
            let search = SpikeSearch::of(&samples, 1.0001 * period);
            let found = find_trains(&[search], 1.0001 * period, 4096).unwrap();
            let found = &found[0];
            let drift = 8000.0 * (found.moments.period / period - 1.0).abs();
            assert!(drift < 0.02, "{period}: {drift}");
            let left = found.shape.train(found.moments, 0..8000);
            let left = rms(left.zip(&own).map(|(a, b)| a - b)) / rms(own.iter().copied());
            assert!(left < 0.012, "{period}: {left}");
        }
    }
}
