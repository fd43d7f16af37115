//! What a person looks at to judge a diagnosis: records beside both models, and residuals in time, in frequency and
//! against the motion.

use super::dependence::autocorrelations;
use super::record::{Record, dot};
use super::spectra::{Pieces, pieces};

/// A record with what both models leave of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// File it comes from.
    pub source: String,
    /// Time of the first sample.
    pub start_s: f64,
    /// Sampling rate.
    pub rate_hz: f64,
    /// The applied quantity.
    pub applied: Vec<f64>,
    /// The measured one.
    pub measured: Vec<f64>,
    /// Measured less modelled, plain stand.
    pub before: Vec<f64>,
    /// Measured less modelled, with the accepted effects.
    pub after: Vec<f64>,
}

/// Pairs records with the residuals of two models.
#[must_use]
pub fn traces(
    records: &[Record],
    before: &[super::Residual],
    after: &[super::Residual],
) -> Vec<Trace> {
    let each = records.iter().zip(before).zip(after);
    each.map(|((record, before), after)| {
        let rate_hz = record.input.rate_hz();
        Trace {
            source: record.source.clone(),
            start_s: record.input.start_s() + record.range.start as f64 / rate_hz,
            rate_hz,
            applied: record.input.samples()[record.range.clone()].to_vec(),
            measured: record.measured[record.range.clone()].to_vec(),
            before: before.samples.clone(),
            after: after.samples.clone(),
        }
    })
    .collect()
}

impl Trace {
    /// Time of each sample.
    #[must_use]
    pub fn times_s(&self) -> Vec<f64> {
        (0..self.measured.len())
            .map(|i| self.start_s + i as f64 / self.rate_hz)
            .collect()
    }

    /// What a model with this residual says of the record.
    #[must_use]
    pub fn modelled(&self, residual: &[f64]) -> Vec<f64> {
        self.measured
            .iter()
            .zip(residual)
            .map(|(y, r)| y - r)
            .collect()
    }

    /// Rms of the plain stand's residual.
    #[must_use]
    pub fn before_rms(&self) -> f64 {
        (dot(&self.before, &self.before) / self.before.len().max(1) as f64).sqrt()
    }

    /// Samples around the place where the plain stand's residual is largest, that many on the whole.
    #[must_use]
    pub fn around_largest(&self, count: usize) -> std::ops::Range<usize> {
        let all = self.before.len();
        let count = count.min(all);
        // The largest rms over a window a quarter as long: a single bad sample does not choose the picture.
        let window = (count / 4).max(1);
        let mut sum: f64 = self.before[..window].iter().map(|r| r * r).sum();
        let (mut largest, mut place) = (sum, 0);
        for i in window..all {
            sum += self.before[i].powi(2) - self.before[i - window].powi(2);
            if sum > largest {
                (largest, place) = (sum, i + 1 - window);
            }
        }
        let from = (place + window / 2)
            .saturating_sub(count / 2)
            .min(all - count);
        from..from + count
    }
}

/// Length of the pieces that the shortest of the traces is cut into.
fn piece_length(traces: &[Trace]) -> usize {
    let shortest = traces.iter().map(|t| t.measured.len()).min().unwrap_or(0);
    ((shortest / 6).next_power_of_two())
        .clamp(64, 4096)
        .min(shortest.max(2))
}

/// Amplitude density of a series over frequency, all traces averaged: `√S(f)` in the series' unit per `√Hz`.
#[must_use]
pub fn density(traces: &[Trace], of: impl Fn(&Trace) -> Vec<f64>) -> (Vec<f64>, Vec<f64>) {
    let length = piece_length(traces);
    let rate_hz = traces.first().map_or(1.0, |t| t.rate_hz);
    let mut power: Vec<f64> = Vec::new();
    for trace in traces {
        let own = pieces(&of(trace), length).power();
        power.resize(own.len(), 0.0);
        for (sum, p) in power.iter_mut().zip(own) {
            *sum += p / traces.len() as f64;
        }
    }
    let step = rate_hz / length as f64;
    let line = |k: usize| k as f64 * step;
    (1..power.len())
        .map(|k| (line(k), (power[k] / step).sqrt()))
        .unzip()
}

/// Least share of the strongest line of the input that a line must have to tell a response.
const ENOUGH_INPUT: f64 = 1e-2;

/// Magnitude of the response of a series to the applied quantity, `|Σ Y U*| / Σ |U|²` over the pieces of all
/// traces, where the input has power. The same estimate of the measured and of the modelled record can be
/// compared: what the estimator does is in both.
#[must_use]
pub fn response(traces: &[Trace], of: impl Fn(&Trace) -> Vec<f64>) -> (Vec<f64>, Vec<f64>) {
    let length = piece_length(traces);
    let rate_hz = traces.first().map_or(1.0, |t| t.rate_hz);
    let both: Vec<(Pieces, Pieces)> = traces
        .iter()
        .map(|t| (pieces(&t.applied, length), pieces(&of(t), length)))
        .collect();
    let lines = both
        .first()
        .and_then(|(u, _)| u.spectra.first())
        .map_or(0, Vec::len);
    let sums: Vec<(num_complex::Complex64, f64)> = (0..lines)
        .map(|k| {
            let pairs = both
                .iter()
                .flat_map(|(u, y)| u.spectra.iter().zip(&y.spectra));
            pairs.fold(
                (num_complex::Complex64::ZERO, 0.0),
                |(cross, own), (u, y)| (cross + y[k] * u[k].conj(), own + u[k].norm_sqr()),
            )
        })
        .collect();
    let strongest = sums.iter().map(|(_, own)| *own).fold(0.0, f64::max);
    let step = rate_hz / length as f64;
    sums.iter()
        .enumerate()
        .skip(1)
        .filter(|(_, (_, own))| *own > ENOUGH_INPUT * strongest)
        .map(|(k, (cross, own))| (k as f64 * step, cross.norm() / own))
        .unzip()
}

/// Autocorrelation of a residual at lags from 0, all traces together, and its 99 % bound for white noise.
#[must_use]
pub fn autocorrelation(
    traces: &[Trace],
    lags: usize,
    of: impl Fn(&Trace) -> &[f64],
) -> (Vec<f64>, f64) {
    let shortest = traces.iter().map(|t| t.measured.len()).min().unwrap_or(0);
    let lags = lags.min(shortest.saturating_sub(1));
    let total: usize = traces.iter().map(|t| t.measured.len()).sum();
    let sums = autocorrelations(traces.iter().map(of), lags);
    let whole = sums[0].max(f64::MIN_POSITIVE);
    let shares = sums.iter().map(|s| s / whole).collect();
    (shares, 2.576 / (total.max(1) as f64).sqrt())
}

/// Which part of the motion a residual is looked at against.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Against {
    /// The modelled record about its mean.
    Displacement,
    /// Its change a second.
    Speed,
}

/// Bins of a residual over the motion.
const BINS: usize = 40;
/// Fewest samples of a bin that is shown.
const FEWEST: usize = 12;

/// Mean of a residual over displacement or speed: middle of each bin, the mean, and its standard error.
#[must_use]
pub fn binned(traces: &[Trace], against: Against, of: impl Fn(&Trace) -> &[f64]) -> Vec<[f64; 3]> {
    let pairs: Vec<(f64, f64)> = traces
        .iter()
        .flat_map(|t| motion(t, against).into_iter().zip(of(t).iter().copied()))
        .collect();
    let limits = |(low, high): (f64, f64), (x, _): &(f64, f64)| (low.min(*x), high.max(*x));
    let (low, high) = pairs
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), limits);
    let width = (high - low) / BINS as f64;
    if width.is_nan() || width <= 0.0 {
        return Vec::new();
    }
    let mut bins = vec![(0.0, 0.0, 0_usize); BINS];
    for (x, r) in &pairs {
        let bin = &mut bins[(((x - low) / width) as usize).min(BINS - 1)];
        *bin = (bin.0 + r, bin.1 + r * r, bin.2 + 1);
    }
    let shown = bins.iter().enumerate().filter(|(_, bin)| bin.2 >= FEWEST);
    shown
        .map(|(k, (sum, squares, count))| {
            let n = *count as f64;
            let mean = sum / n;
            let variance = (squares / n - mean * mean).max(0.0);
            [low + (k as f64 + 0.5) * width, mean, (variance / n).sqrt()]
        })
        .collect()
}

/// Displacement or speed of each sample, as the refined model has it.
fn motion(trace: &Trace, against: Against) -> Vec<f64> {
    let modelled = trace.modelled(&trace.after);
    let count = modelled.len();
    let mean = modelled.iter().sum::<f64>() / count.max(1) as f64;
    match against {
        Against::Displacement => modelled.iter().map(|y| y - mean).collect(),
        Against::Speed => (0..count)
            .map(|i| {
                let (from, to) = (i.saturating_sub(1), (i + 1).min(count - 1));
                (modelled[to] - modelled[from]) * trace.rate_hz / (to - from).max(1) as f64
            })
            .collect(),
    }
}

impl super::Diagnosis<'_> {
    /// The held-out records with what both models leave of them.
    #[must_use]
    pub fn held_out(&self) -> Vec<Trace> {
        traces(&self.records.hold, &self.before.hold, &self.after.hold)
    }

    /// The training records with what both models leave of them.
    #[must_use]
    pub fn trained(&self) -> Vec<Trace> {
        traces(&self.records.train, &self.before.train, &self.after.train)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trace(count: usize, before: impl Fn(usize) -> f64) -> Trace {
        let applied: Vec<f64> = (0..count).map(|i| (0.013 * (i * i) as f64).sin()).collect();
        Trace {
            source: "a.csv".to_owned(),
            start_s: 1.0,
            rate_hz: 1000.0,
            measured: applied.iter().map(|u| 3.0 * u).collect(),
            applied,
            before: (0..count).map(before).collect(),
            after: vec![0.0; count],
        }
    }

    #[test]
    fn a_gain_of_three_is_a_response_of_three() {
        let one = [trace(8000, |_| 0.0)];
        let (lines_hz, magnitude) = response(&one, |t| t.measured.clone());
        assert!(lines_hz.len() > 100);
        assert!(magnitude.iter().all(|h| (h - 3.0).abs() < 1e-9));
    }

    #[test]
    fn a_density_integrates_to_the_mean_square() {
        // A sine of amplitude 2 has the mean square 2.
        let one = [trace(8192, |i| 2.0 * (0.7 * i as f64).sin())];
        let (lines_hz, density) = density(&one, |t| t.before.clone());
        let step = lines_hz[1] - lines_hz[0];
        let square: f64 = density.iter().map(|d| d * d * step).sum();
        assert!((square - 2.0).abs() < 0.01, "{square}");
    }

    #[test]
    fn the_picture_is_taken_where_the_residual_is() {
        let one = trace(5000, |i| f64::from(u8::from((3000..3100).contains(&i))));
        let range = one.around_largest(400);
        assert!(range.contains(&3000) && range.contains(&3099) && range.len() == 400);
        assert_eq!(one.around_largest(9000), 0..5000);
    }

    #[test]
    fn bins_show_what_a_residual_follows_from() {
        let mut one = trace(4000, |_| 0.0);
        // Whole periods, so that the mean is zero.
        let turn = std::f64::consts::TAU * 6.0 / 4000.0;
        one.measured = (0..4000).map(|i| (turn * f64::from(i)).sin()).collect();
        one.before = one.measured.iter().map(|y| y * y * y).collect();
        one.measured = one.measured.iter().map(|y| 1.0 + y).collect();
        one.after = vec![0.0; 4000];
        for [x, mean, _] in binned(&[one], Against::Displacement, |t| &t.before) {
            assert!((mean - x.powi(3)).abs() < 0.04, "{x}: {mean}");
        }
    }

    #[test]
    fn autocorrelation_of_a_sine_is_a_cosine() {
        let one = [trace(20_000, |i| (0.3 * i as f64).sin())];
        let (shares, bound) = autocorrelation(&one, 40, |t| &t.before);
        assert!((bound - 2.576 / 20_000_f64.sqrt()).abs() < 1e-12);
        for (lag, share) in shares.iter().enumerate() {
            assert!((share - (0.3 * lag as f64).cos()).abs() < 0.01, "{lag}");
        }
    }
}
