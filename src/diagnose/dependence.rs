//! What a residual still depends on: whiteness, the input, and nonlinear functions of the motion.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};
use torqcomp_model::effects::Mode;

use super::record::dot;
use super::spectra::coherent_share;
use super::steady;

/// Lags of the tests of whiteness and of independence from the input.
const LAGS: usize = 25;
/// Confidence of the tests.
const CONFIDENCE: f64 = 0.99;
/// Share of a residual's power in its largest hundredth of samples that no noise has: 8 % of that of normal noise lies
/// there, 15 % of that of double-exponential noise.
const SPIKES: f64 = 0.5;
/// Share of a residual's power that counts as structure.
const STRUCTURE: f64 = 0.04;
/// Standard deviations above none at which a share counts as found.
const SIGNIFICANT: f64 = 4.0;
/// Share of a residual's power from which on constants count as changing, a zero as wandering, noise as going with the
/// signal or its slope: 0.008, 0.002 and 0.03 are the most that right models left of the blind records.
const CHANGING: f64 = 0.04;
const WANDERING: f64 = 0.03;
const WITH_SIGNAL: f64 = 0.08;
/// Standard deviations above none for that.
const CLEARLY: f64 = 6.0;

/// A share of the residual's power that follows from something.
#[derive(Debug, Clone, Serialize)]
pub struct Share {
    /// What it follows from.
    pub of: &'static str,
    /// Part of the residual's power.
    pub share: f64,
    /// Standard deviations above none.
    pub significance: f64,
}

/// What was found of a residual.
#[derive(Debug, Clone, Serialize)]
pub struct Dependence {
    /// Whether its autocorrelation stays within 99 % bounds.
    pub white: bool,
    /// Sum of its squared autocorrelation over the 99 % bound of that of white noise.
    pub whiteness_ratio: Option<f64>,
    /// Whether its cross-correlation with the input, at positive and negative lags, stays within 99 % bounds.
    pub independent_of_input: bool,
    /// Lag of the largest cross-correlation in samples; negative: the residual comes before the input.
    pub largest_lag: i64,
    /// Part of its power in the largest hundredth of its samples.
    pub in_largest_hundredth: f64,
    /// Shares of its power that follow from the input or the motion.
    pub shares: Vec<Share>,
    /// Share of its power that other constants in each stretch of the record take out.
    pub changing_constants: Share,
    /// Share of its power that goes with the square of the signal from sample to sample.
    pub with_signal: Share,
    /// Share of its power that goes with the square of the signal's slope from sample to sample.
    pub with_slope: Share,
    /// Share of its power that lies at the lowest frequencies, above what noise leaves there.
    pub wandering_zero: Share,
}

/// One record's residual with what it may depend on.
pub struct Sight<'a> {
    /// The residual.
    pub residual: &'a [f64],
    /// The input over the same samples.
    pub input: &'a [f64],
    /// The modelled record.
    pub modelled: &'a [f64],
}

impl Dependence {
    /// The largest share found, if it counts as structure.
    #[must_use]
    pub fn structure(&self) -> Option<&Share> {
        self.shares
            .iter()
            .filter(|s| s.share > STRUCTURE && s.significance > SIGNIFICANT)
            .max_by(|a, b| a.share.total_cmp(&b.share))
    }

    /// Whether a few samples hold most of it, as spikes do.
    #[must_use]
    pub fn has_spikes(&self) -> bool {
        self.in_largest_hundredth > SPIKES
    }

    /// Whether stand, chain or noise change over the record, in a way that differences of periods show as noise.
    #[must_use]
    pub fn unsteady(&self) -> Option<&Share> {
        // The particular first: constants that change also make a residual that goes with the signal.
        let least = [
            (&self.changing_constants, CHANGING),
            (&self.wandering_zero, WANDERING),
            (&self.with_signal, WITH_SIGNAL),
            (&self.with_slope, WITH_SIGNAL),
        ];
        least
            .into_iter()
            .find(|(s, least)| s.share > *least && s.significance > CLEARLY)
            .map(|(s, _)| s)
    }

    /// Tests residuals of records of a stand with that mode.
    #[must_use]
    pub fn of(sights: &[Sight], mode: &Mode, rate_hz: f64) -> Self {
        let total: usize = sights.iter().map(|s| s.residual.len()).sum();
        let (white, whiteness_ratio) = whiteness(sights, total);
        let (independent_of_input, largest_lag) = input_independence(sights, total);
        Self {
            white,
            whiteness_ratio,
            independent_of_input,
            largest_lag,
            in_largest_hundredth: in_largest_hundredth(sights),
            shares: shares(sights),
            changing_constants: share_of(
                "constants that change over the record",
                steady::changing_constants(sights, mode, rate_hz),
            ),
            with_signal: share_of(
                "the size of the signal from moment to moment",
                steady::with_signal(sights),
            ),
            with_slope: share_of(
                "the slope of the signal from moment to moment, as sampling instants that tremble do",
                steady::with_slope(sights),
            ),
            wandering_zero: share_of(
                "a zero that wanders or jumps",
                steady::wandering_zero(sights),
            ),
        }
    }
}

fn share_of(of: &'static str, found: steady::Beyond) -> Share {
    Share {
        of,
        share: found.share,
        significance: found.significance,
    }
}

fn in_largest_hundredth(sights: &[Sight]) -> f64 {
    let all = sights.iter().flat_map(|s| s.residual);
    let mut squares: Vec<f64> = all.map(|r| r * r).collect();
    let whole: f64 = squares.iter().sum();
    squares.sort_by(|a, b| b.total_cmp(a));
    let largest: f64 = squares.iter().take(squares.len() / 100).sum();
    if whole > 0.0 { largest / whole } else { 0.0 }
}

fn autocorrelation(values: &[f64], lags: usize) -> Vec<f64> {
    (0..=lags.min(values.len() - 1))
        .map(|lag| dot(&values[lag..], &values[..values.len() - lag]))
        .collect()
}

/// Sums of products at lags from 0, of several residuals together.
pub(super) fn autocorrelations<'a>(
    residuals: impl Iterator<Item = &'a [f64]>,
    lags: usize,
) -> Vec<f64> {
    let mut sums = vec![0.0; lags + 1];
    for residual in residuals {
        for (sum, r) in sums.iter_mut().zip(autocorrelation(residual, lags)) {
            *sum += r;
        }
    }
    sums
}

/// The portmanteau of Box and Pierce over the first lags.
fn whiteness(sights: &[Sight], total: usize) -> (bool, Option<f64>) {
    let sums = autocorrelations(sights.iter().map(|s| s.residual), LAGS);
    if sums[0] <= 0.0 {
        return (true, None);
    }
    let q = total as f64 * sums[1..].iter().map(|r| (r / sums[0]).powi(2)).sum::<f64>();
    let bound =
        ChiSquared::new(LAGS as f64).map_or(f64::INFINITY, |law| law.inverse_cdf(CONFIDENCE));
    (q <= bound, Some(q / bound))
}

/// Largest cross-correlation with the input against its bound, the colour of both taken into account
/// (M. S. Bartlett, J. R. Stat. Soc. Suppl. 8 (1946), 27).
fn input_independence(sights: &[Sight], total: usize) -> (bool, i64) {
    let mut colour = 0.0;
    let (mut rr0, mut uu0) = (0.0, 0.0);
    let mut cross = vec![0.0; 2 * LAGS + 1];
    for sight in sights {
        let (r, u) = (sight.residual, sight.input);
        let mean = u.iter().sum::<f64>() / u.len() as f64;
        let u: Vec<f64> = u.iter().map(|u| u - mean).collect();
        let reach = 400.min(r.len() / 4);
        let (rr, uu) = (autocorrelation(r, reach), autocorrelation(&u, reach));
        colour += rr[0] * uu[0] + 2.0 * dot(&rr[1..], &uu[1..]);
        rr0 += rr[0];
        uu0 += uu[0];
        for (k, sum) in cross.iter_mut().enumerate() {
            let lag = k as i64 - LAGS as i64;
            let (a, b) = if lag >= 0 {
                (&r[lag as usize..], &u[..u.len() - lag as usize])
            } else {
                (&r[..r.len() - (-lag) as usize], &u[(-lag) as usize..])
            };
            *sum += dot(a, b);
        }
    }
    let largest = (0..cross.len())
        .max_by(|a, b| cross[*a].abs().total_cmp(&cross[*b].abs()))
        .unwrap_or(LAGS);
    let count = cross.len() as f64;
    let quantile = Normal::standard().inverse_cdf(1.0 - 0.5 * (1.0 - CONFIDENCE) / count);
    let variance = colour.max(rr0 * uu0 * 1e-6) / total as f64;
    let within = cross[largest].abs() <= quantile * variance.sqrt();
    (within || rr0 * uu0 == 0.0, largest as i64 - LAGS as i64)
}

/// A function of the motion that a residual may follow from: its name, and its value at a displacement and a
/// speed, both in units of their rms.
type Follows = (&'static str, fn(f64, f64) -> f64);

const FOLLOWS: [Follows; 6] = [
    ("the square of the displacement", |x, _| x * x),
    ("the cube of the displacement", |x, _| x * x * x),
    ("the size of the displacement", |x, _| x.abs()),
    ("large displacements", |x, _| x - x.clamp(-1.5, 1.5)),
    ("the direction of motion", |_, v| (20.0 * v).tanh()),
    ("the square of the speed", |_, v| v * v.abs()),
];

fn shares(sights: &[Sight]) -> Vec<Share> {
    let shortest = sights.iter().map(|s| s.residual.len()).min().unwrap_or(0);
    let length = (shortest / 24).next_power_of_two().clamp(32, 2048);
    let mut found = vec![joined("the input", sights, length, |s| s.input.to_vec())];
    for (of, function) in FOLLOWS {
        found.push(joined(of, sights, length, |s| {
            let (x, v) = motion(s.modelled);
            x.iter().zip(&v).map(|(x, v)| function(*x, *v)).collect()
        }));
    }
    found
}

/// Displacement and speed in units of their rms.
fn motion(modelled: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let count = modelled.len();
    let mean = modelled.iter().sum::<f64>() / count as f64;
    let x: Vec<f64> = modelled.iter().map(|x| x - mean).collect();
    let v: Vec<f64> = (0..count)
        .map(|i| x[(i + 1).min(count - 1)] - x[i.saturating_sub(1)])
        .collect();
    let scaled = |values: Vec<f64>| {
        let rms = (dot(&values, &values) / count as f64).sqrt().max(1e-300);
        values.into_iter().map(|x| x / rms).collect()
    };
    (scaled(x), scaled(v))
}

/// The share over all records, each weighted with its residual's power.
fn joined(
    of: &'static str,
    sights: &[Sight],
    length: usize,
    from: impl Fn(&Sight) -> Vec<f64>,
) -> Share {
    let (mut share, mut squares, mut total) = (0.0, 0.0, 0.0);
    for sight in sights {
        let power = dot(sight.residual, sight.residual);
        let (own, sigma) = coherent_share(&from(sight), sight.residual, length);
        share += power * own;
        total += power;
        if sigma != 0.0 {
            squares += (power * own / sigma).powi(2);
        }
    }
    let share_std = if squares > 0.0 {
        share / squares.sqrt()
    } else {
        0.0
    };
    Share {
        of,
        share: if total > 0.0 { share / total } else { 0.0 },
        significance: share_std,
    }
}
