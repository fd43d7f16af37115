//! Spikes at equal intervals: a drive that switches, or a commutator, couples into the gage's cable.

use torqcomp_dsp::quality::median;

use super::fit::RecordResidual;

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
