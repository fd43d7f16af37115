//! Tests of a residual: whiteness, dependence on the input and on nonlinear functions of the motion, stationarity.

use schemars::JsonSchema;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};
use torqcomp_model::Mode;

use super::fit::RecordResidual;
use super::moving_line::MovingLine;
use super::spectra::coherent_share;
use super::spike_train::spike_rate_hz;
use super::stationarity;
use torqcomp_dsp::dot;

/// Number of lags of the tests for whiteness and independence of the input.
const LAGS: usize = 25;
/// Confidence level of these tests.
const CONFIDENCE: f64 = 0.99;
/// Range of the correlation between neighbouring samples of first-order noise.
const FIRST_ORDER: std::ops::Range<f64> = 0.05..0.95;
/// Number of lags over which autocorrelations count, and their largest fraction of a record.
const COLOUR_LAGS: usize = 400;
const COLOUR_PART: usize = 4;
/// Share of a residual's power in the largest 1 % of its samples above which it has spikes: 8 % for normal, 16 % for
/// double-exponential noise.
const SPIKES: f64 = 0.2;
/// Minimum share of a residual's power, and standard deviations from zero, for a dependence.
const DEPENDENT: [f64; 2] = [0.04, 4.0];
/// Shares of a residual's power above which the constants change, the zero drifts, or the noise follows the signal or
/// its slope: correct models leave at most 0.008, 0.002 and 0.03 of the blind records.
const CHANGING: f64 = 0.04;
const DRIFTING: f64 = 0.03;
const FOLLOWING: f64 = 0.08;
/// Standard deviations from zero required for that.
const NONSTATIONARY: f64 = 6.0;

/// A share of the residual's power that a quantity explains.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct PowerShare {
    /// Quantity that the share depends on.
    pub of: &'static str,
    /// Share of the residual's power.
    pub share: f64,
    /// Standard deviations from zero.
    pub significance: f64,
}

/// What the tests found in the residuals of the held-out records.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ResidualTests {
    /// Whether the autocorrelation stays within 99 % bounds.
    pub white: bool,
    /// Sum of the squared autocorrelation over the 99 % bound for white noise; `null` if the record is too short.
    pub whiteness_ratio: Option<f64>,
    /// Correlation of neighbouring samples, if the residual is white once that is removed: first-order noise.
    pub first_order_noise: Option<f64>,
    /// Whether the cross-correlation with the input, at positive and negative lags, stays within 99 % bounds.
    pub independent_of_input: bool,
    /// Lag of the largest cross-correlation in samples; negative: the residual leads the input.
    pub largest_lag: i64,
    /// Part of the power in the largest hundredth of the samples.
    pub in_largest_hundredth: f64,
    /// Rate of spikes at equal intervals, in Hz; `null` if there are none.
    pub spike_rate_hz: Option<f64>,
    /// Shares of the power that follow from the input or the motion.
    pub shares: Vec<PowerShare>,
    /// Share removed by fitting constants to each segment of the record.
    pub changing_constants: PowerShare,
    /// Share proportional to the square of the signal, sample by sample.
    pub with_signal: PowerShare,
    /// Share proportional to the square of the signal's slope, sample by sample.
    pub with_slope: PowerShare,
    /// Share at the lowest frequencies, above the noise at these.
    pub wandering_zero: PowerShare,
    /// A line whose frequency changes over a record; `null` if there is none.
    pub moving_line: Option<MovingLine>,
}

impl ResidualTests {
    /// Tests the residuals of records of a stand with that mode.
    pub fn of(residuals: &[RecordResidual], mode: &Mode) -> Self {
        let all: Vec<&[f64]> = residuals.iter().map(|r| &r.samples[..]).collect();
        let (white, whiteness_ratio) = whiteness(&all, 0);
        let in_largest_hundredth = in_largest_hundredth(residuals);
        let has_spikes = in_largest_hundredth > SPIKES;
        let (independent_of_input, largest_lag) = input_independence(residuals);
        Self {
            white,
            whiteness_ratio,
            first_order_noise: (!white).then(|| first_order_noise(&all)).flatten(),
            independent_of_input,
            largest_lag,
            in_largest_hundredth,
            spike_rate_hz: has_spikes.then(|| spike_rate_hz(residuals)).flatten(),
            shares: shares(residuals, mode),
            changing_constants: stationarity::changing_constants(residuals, mode),
            with_signal: stationarity::with_signal(residuals),
            with_slope: stationarity::with_slope(residuals),
            wandering_zero: stationarity::wandering_zero(residuals),
            moving_line: MovingLine::of(residuals),
        }
    }

    /// The largest significant share that depends on the input or the motion.
    pub fn dependence(&self) -> Option<&PowerShare> {
        let shares = self.shares.iter().filter(|s| s.exceeds(DEPENDENT));
        shares.max_by(|a, b| a.share.total_cmp(&b.share))
    }

    /// Whether the spectrum is that of white or first-order noise.
    pub fn has_spectrum_of_noise(&self) -> bool {
        self.white || self.first_order_noise.is_some()
    }

    /// Whether they show white noise only.
    pub fn show_noise_only(&self) -> bool {
        self.white && !self.follows_anything()
    }

    /// Whether any test detects a dependence on input, motion or time.
    pub fn follows_anything(&self) -> bool {
        let is_seen = self.dependence().is_some() || self.changes();
        is_seen || self.has_spikes() || !self.independent_of_input
    }

    /// Whether a few samples have most of the power.
    pub fn has_spikes(&self) -> bool {
        self.in_largest_hundredth > SPIKES
    }

    /// Whether stand, measuring chain or noise change over the record; differences between periods count such changes
    /// as noise.
    pub fn nonstationary(&self) -> Option<&PowerShare> {
        // The specific ones first: changing constants also give a residual that follows the signal.
        let least = [CHANGING, DRIFTING, FOLLOWING, FOLLOWING];
        let [changing, signal, slope, zero] = self.stationarity();
        let mut both = [changing, zero, signal, slope].into_iter().zip(least);
        let found = both.find(|(s, least)| s.exceeds([*least, NONSTATIONARY]));
        found.map(|(share, _)| share)
    }

    /// Whether anything changes over a record.
    pub fn changes(&self) -> bool {
        self.nonstationary().is_some() || self.moving_line.is_some()
    }

    /// Whether the zero drifts.
    pub fn drifts(&self) -> bool {
        self.wandering_zero.exceeds([DRIFTING, NONSTATIONARY])
    }

    /// The shares of changes over the record.
    pub fn stationarity(&self) -> [&PowerShare; 4] {
        [
            &self.changing_constants,
            &self.with_signal,
            &self.with_slope,
            &self.wandering_zero,
        ]
    }
}

impl PowerShare {
    fn exceeds(&self, [share, significance]: [f64; 2]) -> bool {
        self.share > share && self.significance > significance
    }
}

fn in_largest_hundredth(residuals: &[RecordResidual]) -> f64 {
    let all = residuals.iter().flat_map(|r| &r.samples);
    let mut squares: Vec<f64> = all.map(|r| r * r).collect();
    let whole: f64 = squares.iter().sum();
    squares.sort_by(|a, b| b.total_cmp(a));
    let largest: f64 = squares.iter().take(squares.len() / 100).sum();
    if whole > 0.0 { largest / whole } else { 0.0 }
}

/// Sums of products at lags from 0.
pub fn autocorrelation(values: &[f64], lags: usize) -> Vec<f64> {
    let sum = |lag: usize| dot(&values[lag..], &values[..values.len() - lag]);
    (0..=lags.min(values.len() - 1)).map(sum).collect()
}

/// Sums of products at lags from 0, over several residuals.
pub fn autocorrelations(residuals: &[&[f64]], lags: usize) -> Vec<f64> {
    let mut sums = vec![0.0; lags + 1];
    for residual in residuals {
        let own = autocorrelation(residual, lags);
        sums.iter_mut().zip(own).for_each(|(sum, r)| *sum += r);
    }
    sums
}

/// The portmanteau test over the first lags (G. E. P. Box, D. A. Pierce, J. Am. Stat. Assoc. 65 (1970), 1509), for
/// residuals of a model of the noise with a number of parameters.
fn whiteness(residuals: &[&[f64]], parameters: usize) -> (bool, Option<f64>) {
    let sums = autocorrelations(residuals, LAGS);
    if sums[0] <= 0.0 {
        return (true, None);
    }
    let count = residuals.iter().map(|r| r.len()).sum::<usize>() as f64;
    let q = count * sums[1..].iter().map(|r| (r / sums[0]).powi(2)).sum::<f64>();
    let law = ChiSquared::new((LAGS - parameters) as f64);
    let bound = law.map_or(f64::INFINITY, |law| law.inverse_cdf(CONFIDENCE));
    (q <= bound, Some(q / bound))
}

/// The correlation `ρ` of neighbouring samples, if `r[n] − ρ r[n−1]` is white.
fn first_order_noise(residuals: &[&[f64]]) -> Option<f64> {
    let sums = autocorrelations(residuals, 1);
    let correlation = sums[1] / sums[0].max(1e-300);
    if !FIRST_ORDER.contains(&correlation) {
        return None;
    }
    let without = |r: &&[f64]| r.windows(2).map(|w| w[1] - correlation * w[0]).collect();
    let left: Vec<Vec<f64>> = residuals.iter().map(without).collect();
    let left: Vec<&[f64]> = left.iter().map(Vec::as_slice).collect();
    whiteness(&left, 1).0.then_some(correlation)
}

/// Largest cross-correlation with the input against its bound, allowing for the autocorrelation of both
/// (M. S. Bartlett, J. R. Stat. Soc. Suppl. 8 (1946), 27).
fn input_independence(residuals: &[RecordResidual]) -> (bool, i64) {
    let mut variance = 0.0;
    let mut cross = vec![0.0; 2 * LAGS + 1];
    for residual in residuals {
        let r = &residual.samples;
        let u = without_mean(&residual.record.acting_in_range());
        let reach = COLOUR_LAGS.min(r.len() / COLOUR_PART);
        let (rr, uu) = (autocorrelation(r, reach), autocorrelation(&u, reach));
        let white = rr[0] * uu[0];
        let colour = white + 2.0 * dot(&rr[1..], &uu[1..]);
        // The products of different records are independent, so their variances add.
        variance += colour.max(white * 1e-6) / r.len() as f64;
        for (k, sum) in cross.iter_mut().enumerate() {
            *sum += match k.checked_sub(LAGS) {
                Some(lag) => dot(&r[lag..], &u[..u.len() - lag]),
                None => dot(&r[..r.len() - (LAGS - k)], &u[LAGS - k..]),
            };
        }
    }
    let largest = (0..cross.len())
        .max_by(|a, b| cross[*a].abs().total_cmp(&cross[*b].abs()))
        .unwrap_or(LAGS);
    let count = cross.len() as f64;
    let quantile = Normal::standard().inverse_cdf(1.0 - 0.5 * (1.0 - CONFIDENCE) / count);
    let within = cross[largest].abs() <= quantile * variance.sqrt();
    (within || variance == 0.0, largest as i64 - LAGS as i64)
}

/// A function of the motion that may explain a residual, of displacement and speed in units of their RMS.
type MotionFunction = (&'static str, fn(f64, f64) -> f64);

const MOTION_FUNCTIONS: [MotionFunction; 6] = [
    ("the square of the displacement", |x, _| x * x),
    ("the cube of the displacement", |x, _| x * x * x),
    ("the magnitude of the displacement", |x, _| x.abs()),
    ("large displacements", |x, _| x - x.clamp(-1.5, 1.5)),
    ("the direction of motion", |_, v| (20.0 * v).tanh()),
    ("the square of the speed", |_, v| v * v.abs()),
];

/// Name of the share linear in the input.
pub const FROM_INPUT: &str = "the input";

/// A function of the input that reaches the record without the stand, as cross-talk does; of the input in units of its RMS.
type InputFunction = (&'static str, fn(f64) -> f64);

const INPUT_FUNCTIONS: [InputFunction; 2] = [
    ("the square of the input", |u| u * u),
    ("the cube of the input", |u| u * u * u),
];

fn shares(residuals: &[RecordResidual], mode: &Mode) -> Vec<PowerShare> {
    let shortest = residuals.iter().map(|r| r.samples.len()).min();
    let length = (shortest.unwrap_or(0) / 24).next_power_of_two();
    let length = length.clamp(32, 2048);
    let input = |r: &RecordResidual| r.record.acting_in_range();
    let pooled = |of, from: &dyn Fn(&RecordResidual) -> Vec<f64>| {
        pooled_share(of, residuals, length, mode, from)
    };
    let mut found = vec![pooled(FROM_INPUT, &input)];
    for (of, function) in MOTION_FUNCTIONS {
        found.push(pooled(of, &|r| {
            let x = without_mean(&r.modelled);
            let (x, v) = (over_rms(&x), over_rms(&differences(&x)));
            x.iter().zip(&v).map(|(x, v)| function(*x, *v)).collect()
        }));
    }
    for (of, function) in INPUT_FUNCTIONS {
        found.push(pooled(of, &|r| {
            let u = over_rms(&without_mean(&input(r)));
            u.into_iter().map(function).collect()
        }));
    }
    found
}

pub fn without_mean(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|x| x - mean).collect()
}

/// Central differences; one-sided at the ends.
pub fn differences(x: &[f64]) -> Vec<f64> {
    let last = x.len().saturating_sub(1);
    let difference = |i: usize| x[(i + 1).min(last)] - x[i.saturating_sub(1)];
    (0..x.len()).map(difference).collect()
}

fn over_rms(values: &[f64]) -> Vec<f64> {
    let rms = (dot(values, values) / values.len() as f64).sqrt();
    values.iter().map(|x| x / rms.max(1e-300)).collect()
}

/// Pooled share of all records, each weighted with its residual's power.
fn pooled_share(
    of: &'static str,
    residuals: &[RecordResidual],
    length: usize,
    mode: &Mode,
    from: impl Fn(&RecordResidual) -> Vec<f64>,
) -> PowerShare {
    let (mut share, mut variance, mut total) = (0.0, 0.0, 0.0_f64);
    for residual in residuals {
        let power = dot(&residual.samples, &residual.samples);
        let decay_s = 1.0 / (mode.damping_ratio * mode.omega_rad_s);
        let memory = decay_s * residual.record.rate_hz();
        let samples = &residual.samples;
        let (own, significance) = coherent_share(&from(residual), samples, length, memory);
        share += power * own;
        total += power;
        if significance != 0.0 {
            variance += (power * own / significance).powi(2);
        }
    }
    let over = |size: f64| if size > 0.0 { share / size } else { 0.0 };
    PowerShare {
        of,
        share: over(total),
        significance: over(variance.sqrt()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::test_noise::noise;

    /// Of 400 sets of records whose residual is noise, 1 % appear to depend on the input: 4, and hardly ever more than
    /// 11.
    #[test]
    fn noise_depends_on_the_input_as_often_as_the_level_says() {
        let mut random = noise(1);
        for records in [1, 2, 4] {
            let set = |_| {
                let mut one = || {
                    let mut colour = 0.0;
                    let input: Vec<f64> = (0..800)
                        .map(|_| {
                            colour = 0.7 * colour + random();
                            colour
                        })
                        .collect();
                    let residual: Vec<f64> = (0..800).map(|_| random()).collect();
                    RecordResidual::made(input, residual.clone(), residual)
                };
                let all: Vec<RecordResidual> = (0..records).map(|_| one()).collect();
                input_independence(&all).0
            };
            let alarms = (0..400).map(set).filter(|independent| !independent).count();
            assert!(alarms <= 11, "{records} records: {alarms} of 400");
        }
    }
}
