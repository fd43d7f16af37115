//! Spikes at equal intervals: a drive that switches, or a commutator, couples into the gage's cable.

use std::f64::consts::TAU;

use torqcomp_dsp::quality::median;
use torqcomp_model::effects::{FoundTrain, SpikeSearch, find_trains};

use super::fit::RecordResidual;
use super::record::StandRecord;

/// A train has at least one spike in so many samples, and at least so many spikes.
const ONE_IN: usize = 2000;
const FEWEST: usize = 12;
/// Magnitude of a spike relative to those, and to the median magnitude.
const AS_LARGE: f64 = 0.5;
const ABOVE: f64 = 8.0;
/// Samples from the largest one of a spike in which it dies out.
const LONG: usize = 8;
/// Largest deviation of an interval from whole periods, in samples and in periods, for a share of all.
const OFF_SAMPLES: f64 = 1.5;
const OFF_PERIODS: f64 = 0.05;
const SHARE: f64 = 0.9;

/// Samples of a record in whose spectrum a rate is searched for.
const SEARCHED: usize = 1 << 14;
/// Shortest period of a train in samples, of which a spike takes at most half.
const SHORTEST: usize = 32;
/// Frequencies over which the median power is that of the noise; largest power of a line relative to it that counts, so
/// that a single line is no train; largest number of orders.
const BLOCK: usize = 64;
const MOST_POWER: f64 = 30.0;
const MOST_ORDERS: usize = 256;
/// Mean power of the orders of a rate above that of the noise, in standard deviations.
const PROMINENT: f64 = 7.0;
/// Mean square difference of a signal from itself a period before, relative to that at fractions of the period, below
/// which it is periodic; whether in one of so many periods.
const PERIODIC: f64 = 0.1;
const FRACTIONS: [f64; 3] = [0.31, 0.5, 0.71];
const PERIODS: i32 = 4;

/// Rate in Hz of a train of spikes in all residuals, the moments of which are independent of the input: nothing can be
/// told from what an input of the same period causes.
pub fn train_rate_hz(residuals: &[RecordResidual]) -> Option<f64> {
    let rate_hz = residuals.first()?.record.rate_hz();
    let plain = residuals
        .iter()
        .map(|r| r.record.without_weights(r.samples.clone()));
    let plain: Vec<Vec<f64>> = plain.collect();
    let known = plain.iter().map(Vec::len).min()?.min(SEARCHED);
    let by_spectrum = period_of_comb(&plain, known).map(|period| (period, known));
    let longest = plain.iter().map(Vec::len).max()?;
    let by_intervals = spike_rate_hz(residuals).map(|hz| (rate_hz / hz, longest));
    let trains = [by_spectrum, by_intervals].into_iter().flatten();
    let found = trains.filter_map(|(period, known)| {
        let near = |period: f64| {
            let search = plain.iter().map(|samples| SpikeSearch::of(samples, period));
            find_trains(&search.collect::<Vec<_>>(), period, known)
        };
        let mut found = near(period)?;
        let all: usize = plain.iter().map(Vec::len).sum();
        let is_enough = 2.0 * period * FEWEST as f64 <= all as f64;
        if is_enough && found.iter().any(|train| !train.is_steady) {
            // Every other place may be empty.
            found = near(2.0 * period)?;
        }
        let is_everywhere = found.iter().all(|train| train.share() > 0.0);
        let period = found.first()?.moments.period;
        let of_input = residuals.iter().any(|r| is_periodic(&r.record, period));
        let power: f64 = found.iter().map(|train: &FoundTrain| train.power).sum();
        (is_everywhere && !of_input).then_some((period, power))
    });
    let best = found.max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(rate_hz / best.0)
}

/// Period in samples of the train whose orders stand out most in the spectra of the first samples.
fn period_of_comb(records: &[Vec<f64>], count: usize) -> Option<f64> {
    if count < FEWEST * SHORTEST {
        return None;
    }
    let plan = torqcomp_fourier::forward(count);
    let mut power = vec![0.0; count / 2 + 1];
    for samples in records {
        let window = |i: usize| 1.0 - (TAU * (i as f64 + 0.5) / count as f64).cos();
        let part = samples[..count].iter().enumerate();
        let mut part: Vec<f64> = part.map(|(i, r)| r * window(i)).collect();
        let mut spectrum = plan.make_output_vec();
        plan.process(&mut part, &mut spectrum).ok()?;
        let both = power.iter_mut().zip(&spectrum);
        both.for_each(|(p, s)| *p += s.norm_sqr());
    }
    for block in power.chunks_mut(BLOCK) {
        let noise = median(&mut block.to_vec())?.max(f64::MIN_POSITIVE) / std::f64::consts::LN_2;
        block
            .iter_mut()
            .for_each(|p| *p = (*p / noise).min(MOST_POWER));
    }
    let mut best = (PROMINENT, None);
    let mut turns = FEWEST as f64;
    while turns * SHORTEST as f64 <= count as f64 {
        let orders = ((0.5 * count as f64 / turns) as usize).min(MOST_ORDERS);
        let at = |order: usize| power[(order as f64 * turns).round() as usize] - 1.0;
        let sum: f64 = (1..=orders).map(at).sum();
        let prominence = sum / (orders as f64).sqrt();
        if prominence > best.0 {
            best = (prominence, Some(count as f64 / turns));
        }
        // The highest order moves by one frequency.
        turns += 1.0 / orders as f64;
    }
    best.1
}

/// Whether the input of a record, or a free motion, has that period or a multiple of it.
fn is_periodic(record: &StandRecord, period: f64) -> bool {
    let samples = match record.is_free() {
        true => record.measured_in_range(),
        false => record.applied_in_range(),
    };
    let apart = |lag: f64| -> f64 {
        let later = samples.get(lag.round() as usize..).unwrap_or(&[]);
        let both = samples.iter().zip(later).map(|(a, b)| (a - b).powi(2));
        both.sum::<f64>() / later.len().max(1) as f64
    };
    (1..=PERIODS).any(|periods| {
        let lag = f64::from(periods) * period;
        let between = FRACTIONS.map(|part| apart(part * lag));
        let between = between.into_iter().fold(0.0, f64::max);
        lag < 0.5 * samples.len() as f64 && apart(lag) < PERIODIC * between
    })
}

/// Rate of the spikes, in Hz; `None` if the residual of any of the records has none at equal intervals.
pub fn spike_rate_hz(residuals: &[RecordResidual]) -> Option<f64> {
    let rates: Option<Vec<f64>> = residuals
        .iter()
        .map(|r| Some(r.record.rate_hz() / period_samples(&r.samples)?))
        .collect();
    median(&mut rates?)
}

fn period_samples(samples: &[f64]) -> Option<f64> {
    let mut sizes: Vec<f64> = samples.iter().map(|r| r.abs()).collect();
    let typical = median(&mut sizes)?;
    sizes.sort_by(|a, b| b.total_cmp(a));
    let large = *sizes.get((samples.len() / ONE_IN).max(FEWEST))?;
    let least = (AS_LARGE * large).max(ABOVE * typical);
    if least == 0.0 {
        return None;
    }
    let mut places: Vec<usize> = Vec::new();
    for (i, r) in samples.iter().enumerate().filter(|(_, r)| r.abs() >= least) {
        match places.last_mut().filter(|last| i - **last <= LONG) {
            Some(last) if samples[*last].abs() < r.abs() => *last = i,
            Some(_) => {}
            None => places.push(i),
        }
    }
    let intervals = places.windows(2).map(|pair| (pair[1] - pair[0]) as f64);
    let intervals: Vec<f64> = intervals.collect();
    let period = median(&mut intervals.clone())?;
    let is_whole = |interval: &&f64| {
        let periods = (**interval / period).round();
        let off = (**interval - periods * period).abs();
        periods >= 1.0 && off <= OFF_SAMPLES.max(OFF_PERIODS * period)
    };
    let whole = intervals.iter().filter(is_whole).count() as f64;
    if places.len() < FEWEST || whole < SHARE * intervals.len() as f64 {
        return None;
    }
    let periods: f64 = intervals.iter().map(|i| (i / period).round()).sum();
    Some((places[places.len() - 1] - places[0]) as f64 / periods)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::test_noise::noise;

    /// Two records of 12 spikes each.
    #[test]
    fn a_train_of_few_spikes_has_its_own_rate() {
        let mut random = noise(5);
        let mut with = |first: f64| -> Vec<f64> {
            let since = |i: usize| (i as f64 - first).rem_euclid(198.15);
            (0..2460)
                .map(|i| 6.0 * (-since(i) / 5.0).exp() + random())
                .collect()
        };
        let residuals = [40.3, 117.8].map(|first| {
            let mut input = noise(first as u64);
            let input = (0..2460).map(|_| input()).collect();
            RecordResidual::made(input, vec![0.0; 2460], with(first))
        });
        let rate_hz = train_rate_hz(&residuals).expect("a train");
        assert!((rate_hz * 198.15e-3 - 1.0).abs() < 1e-3, "{rate_hz}");
    }

    #[test]
    fn a_train_is_told_from_single_spikes() {
        let mut random = noise(5);
        let mut with = |spike: &dyn Fn(usize) -> bool| -> Vec<f64> {
            let size = |i| if spike(i) { 6.0 } else { 0.0 };
            (0..16_000).map(|i| size(i) + random()).collect()
        };
        // Every 205.55 samples.
        let is_next = |i: usize| (i as f64 / 205.55).floor() != ((i + 1) as f64 / 205.55).floor();
        let period = period_samples(&with(&is_next)).unwrap();
        assert!((period - 205.55).abs() < 0.1, "{period}");
        assert_eq!(period_samples(&with(&|_| false)), None);
        // At places without order: multiples of a prime, squared.
        let places: Vec<usize> = (1..80).map(|k| k * k * 7919 % 16_000).collect();
        assert_eq!(period_samples(&with(&|i| places.contains(&i))), None);
    }
}
