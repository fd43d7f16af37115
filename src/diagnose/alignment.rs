//! Channels sampled at different instants: one is delayed, or each has its own clock.
//!
//! The measured channel is compared with the response of a plain stand to the applied one: the lag of their
//! cross-correlation is the shift of the channels, and its growth along the record the difference of their clocks.

use std::f64::consts::PI;
use std::sync::Arc;

use super::Case;
use super::fit::{FitEffort, fit};
use super::plain::starts;
use super::record::StandRecord;
use super::records::Records;
use super::refuse::relative_error;
use super::residual_tests::without_mean;
use super::score::ScoredModel;
use super::structure::{FitContext, LateStand, PlainStand, Structure};
use torqcomp_dsp::dot;
use torqcomp_dsp::peaks::vertex;

/// Number of parts of a record with a separate estimate of the shift.
const PARTS: usize = 8;
/// Minimum length of such a part, in samples.
const SHORTEST_PART: usize = 256;
/// Rounds of alternating fits of stand and shift.
const ROUNDS: usize = 4;
/// Correlation with the plain stand's response below which the lag of a part is unreliable.
const SEEN: f64 = 0.5;
/// Shift, and drift over a record, in samples, below which the channels count as aligned.
const LEAST_SHIFT: f64 = 0.05;
const LEAST_DRIFT: f64 = 0.3;
/// Ratio of the error with a shift to that without, above which the channels count as aligned.
const NO_BETTER: f64 = 0.9;
/// Ratio of the error with two clocks to that with a shift alone, above which they count as one.
const ONE_CLOCK: f64 = 0.7;
/// Interpolation points on each side of a value between samples.
const POINTS: i64 = 24;

/// Final step sizes, in samples, for trial shifts in both directions.
const FINER: [f64; 4] = [0.2, 0.1, 0.05, 0.02];

const FIT: FitEffort = FitEffort::full(15);
const FINE_FIT: FitEffort = FitEffort::full(5);

/// Delay of the measured channel relative to the applied one.
#[derive(Clone, Copy, Default)]
pub struct Shift {
    /// At the first sample, in s; negative if it is early.
    pub late_s: f64,
    /// Its growth, in s per s, due to different clocks.
    pub per_s: f64,
}

/// A shift of the channels, and the plain stand fitted with it.
pub struct Alignment {
    pub shift: Shift,
    /// The plain stand of the aligned records.
    pub context: FitContext,
    /// Relative RMS error of the plain stand on the training records, without and with the shift.
    pub errors: [f64; 2],
}

impl Alignment {
    /// The shift that reduces the error of the plain stand on the training records, if any.
    pub fn find(case: &Case, context: &FitContext, as_given: f64) -> Option<Self> {
        if context.held.is_some() {
            return None;
        }
        let train = &case.records.train;
        let longest = train.iter().max_by_key(|record| record.count())?;
        let count = longest.measured.len();
        let whole = longest.part(0..count);
        let one_clock = best_start(case, context, &whole)
            .and_then(|stand| follow(context, stand, train, &whole, 1));
        let first = longest.part(0..(count / PARTS).max(SHORTEST_PART).min(count));
        let two_clocks = (count >= PARTS * SHORTEST_PART)
            .then(|| best_start(case, context, &first))
            .flatten()
            .and_then(|stand| follow(context, stand, train, &whole, PARTS));
        let rate_hz = longest.rate_hz();
        let drift = |shift: Shift| (shift.per_s * count as f64).abs();
        let shifted = match (one_clock, two_clocks) {
            (Some((_, _, one)), Some((shift, context, two)))
                if two < ONE_CLOCK * one && drift(shift) >= LEAST_DRIFT =>
            {
                (shift, context, two)
            }
            (Some(one), _) => one,
            (None, two) => two.filter(|(shift, ..)| drift(*shift) >= LEAST_DRIFT)?,
        };
        let (shift, context, error) = shifted;
        let is_shifted = (shift.late_s * rate_hz).abs() >= LEAST_SHIFT || shift.per_s != 0.0;
        (is_shifted && error < NO_BETTER * as_given).then_some(Self {
            shift,
            context,
            errors: [as_given, error],
        })
    }

    /// The stand and its delay, if the measured channel is late by a constant time.
    pub fn late(&self) -> Option<LateStand> {
        let is_late = self.shift.late_s > 0.0 && self.shift.per_s == 0.0;
        is_late.then_some(LateStand {
            stand: self.context.plain,
            delay_s: self.shift.late_s,
        })
    }

    /// The best model of aligned training records that is simpler than a model of the records as given: the plain
    /// stand, or that model without one of its effects.
    pub fn instead_of(
        &self,
        after: &ScoredModel,
        records: &Records,
        threads: usize,
    ) -> Option<ScoredModel> {
        let train = records.train.iter().map(|r| r.aligned(self.shift));
        let aligned = Records {
            train: train.collect(),
            holdout: Vec::new(),
        };
        let structure = Structure::plain(Arc::new(self.context.clone()));
        let values = self.context.plain_values(&self.context.plain);
        let plain = fit(structure, &values, &aligned.train, FIT).ok();
        let plain = plain.and_then(|plain| ScoredModel::of(plain, &aligned));
        let fewer = after.without_each(&aligned, threads);
        let models = fewer.into_iter().flatten().chain(plain);
        models.min_by(|a, b| a.criterion().total_cmp(&b.criterion()))
    }
}

/// The plain stand whose response correlates best with a record at any lag.
fn best_start(case: &Case, context: &FitContext, record: &StandRecord) -> Option<PlainStand> {
    let y = without_mean(record.measured_in_range());
    let left = |start: &PlainStand| {
        let mut start = *start;
        let free = context.gain_is_free;
        start.gain = if free { 1.0 } else { start.gain };
        let x = without_mean(&answer(context, &start, record));
        let (_, product) = peak(&x, &y, free)?;
        let xx = dot(&x, &x);
        if free {
            start.gain = product / xx;
            return Some((-product * product / xx, start));
        }
        Some((xx - 2.0 * product, start))
    };
    let all = starts(context, case.declared, record);
    let all = all
        .iter()
        .filter_map(left)
        .filter(|(left, _)| left.is_finite());
    Some(all.min_by(|a, b| a.0.total_cmp(&b.0))?.1)
}

/// A shift, the plain stand fitted with it, and the resulting error.
type Found = (Shift, FitContext, f64);

/// Fits stand and shift alternately, with the mean shift of each part of the longest record.
fn follow(
    context: &FitContext,
    start: PlainStand,
    train: &[StandRecord],
    longest: &StandRecord,
    parts: usize,
) -> Option<Found> {
    let (mut shift, mut stand) = (Shift::default(), start);
    let rate_hz = longest.rate_hz();
    let mut best: Option<Found> = None;
    for _ in 0..ROUNDS {
        let modelled = answer(context, &stand, longest);
        let aligned = longest.aligned(shift);
        let measured = &aligned.measured[longest.range.clone()];
        let Some(more) = line(&lags(&modelled, measured, parts, context.gain_is_free)) else {
            break;
        };
        shift.late_s += more[0] / rate_hz;
        shift.per_s += more[1];
        let Some(found) = with_shift(context, stand, train, shift, FIT) else {
            break;
        };
        stand = found.1.plain;
        if best.as_ref().is_none_or(|(_, _, least)| found.2 < *least) {
            best = Some(found);
        }
    }
    let mut best = best?;
    // A lightly damped response correlates nearly as well at a wrong lag.
    for step in FINER {
        let late_s = step / rate_hz;
        let per_s = step / longest.measured.len() as f64;
        let mut steps = vec![(late_s, 0.0), (-late_s, 0.0)];
        if parts > 1 {
            // Rotates about the middle of the record.
            steps.extend([(late_s, -2.0 * per_s), (-late_s, 2.0 * per_s)]);
        }
        for (late_s, per_s) in steps {
            let shift = Shift {
                late_s: best.0.late_s + late_s,
                per_s: best.0.per_s + per_s,
            };
            let found = with_shift(context, best.1.plain, train, shift, FINE_FIT);
            best = found.filter(|found| found.2 < best.2).unwrap_or(best);
        }
    }
    Some(best)
}

/// The plain stand fitted from a start to training records aligned by a shift.
fn with_shift(
    context: &FitContext,
    start: PlainStand,
    train: &[StandRecord],
    shift: Shift,
    effort: FitEffort,
) -> Option<Found> {
    let aligned: Vec<StandRecord> = train.iter().map(|r| r.aligned(shift)).collect();
    let here = context.at(start);
    let values = here.plain_values(&start);
    let structure = Structure::plain(Arc::new(here));
    let found = fit(structure, &values, &aligned, effort).ok()?;
    let here = context.at(found.stand());
    let error = relative_error(&here, &aligned);
    Some((shift, here, error))
}

/// Response of a plain stand to the applied quantity over a record's range.
fn answer(context: &FitContext, stand: &PlainStand, record: &StandRecord) -> Vec<f64> {
    let modelled = context
        .chain(stand)
        .simulate(&record.input, Default::default());
    modelled[record.range.clone()].to_vec()
}

/// Middle and lag, in samples, of each part of a record with a reliable lag behind the model.
fn lags(modelled: &[f64], measured: &[f64], parts: usize, any_sign: bool) -> Vec<[f64; 2]> {
    let length = measured.len() / parts;
    let of_part = |part: usize| {
        let range = part * length..(part + 1) * length;
        let [x, y] = [modelled, measured].map(|all| without_mean(&all[range.clone()]));
        let (lag, product) = peak(&x, &y, any_sign)?;
        let is_seen = product.abs() >= SEEN * (dot(&x, &x) * dot(&y, &y)).sqrt();
        is_seen.then_some([range.start as f64 + 0.5 * length as f64, lag])
    };
    (0..parts).filter_map(of_part).collect()
}

/// The straight line through lags over time: its value at the first sample and its slope; a constant for a single lag.
fn line(lags: &[[f64; 2]]) -> Option<[f64; 2]> {
    let count = lags.len() as f64;
    let mean = |k: usize| lags.iter().map(|lag| lag[k]).sum::<f64>() / count;
    let (at, lag) = (mean(0), mean(1));
    let spread: f64 = lags.iter().map(|l| (l[0] - at).powi(2)).sum();
    let product: f64 = lags.iter().map(|l| (l[0] - at) * (l[1] - lag)).sum();
    match lags.len() {
        0 => None,
        1 => Some([lag, 0.0]),
        _ => Some([lag - product / spread * at, product / spread]),
    }
}

/// Lag of `y` behind `x` with the largest correlation (in magnitude, with any sign), and the sum of products there.
fn peak(x: &[f64], y: &[f64], any_sign: bool) -> Option<(f64, f64)> {
    let products = correlation(x, y);
    let size = |k: usize| {
        if any_sign {
            products[k].abs()
        } else {
            products[k]
        }
    };
    let count = products.len();
    let best = (0..count).max_by(|a, b| size(*a).total_cmp(&size(*b)))?;
    let (part, top) = vertex([count - 1, 0, 1].map(|step| size((best + step) % count)));
    let whole = if best > count / 2 {
        best as f64 - count as f64
    } else {
        best as f64
    };
    let sign = products[best].signum();
    Some((whole + part, sign * top))
}

/// Sums of products `x(i) y(i + k)` for lags `k`, with negative lags at the end.
fn correlation(x: &[f64], y: &[f64]) -> Vec<f64> {
    let length = (2 * x.len()).next_power_of_two();
    let (forward, inverse) = (
        torqcomp_fourier::forward(length),
        torqcomp_fourier::inverse(length),
    );
    let [of_x, of_y] = [x, y].map(|samples| {
        let mut padded = samples.to_vec();
        padded.resize(length, 0.0);
        let mut spectrum = forward.make_output_vec();
        // Cannot fail: the lengths match the plan.
        let _ = forward.process(&mut padded, &mut spectrum);
        spectrum
    });
    let mut cross: Vec<_> = of_x.iter().zip(&of_y).map(|(x, y)| x.conj() * y).collect();
    let mut products = inverse.make_output_vec();
    let _ = inverse.process(&mut cross, &mut products);
    products.iter_mut().for_each(|p| *p /= length as f64);
    products
}

impl StandRecord {
    /// The record with its measured channel resampled at the instants of the applied one; samples from beyond the
    /// record are excluded.
    fn aligned(&self, shift: Shift) -> Self {
        let rate_hz = self.rate_hz();
        let count = self.measured.len();
        let place = |i: usize| {
            let i = i as f64;
            i + shift.late_s * rate_hz + shift.per_s * i
        };
        let measured = (0..count)
            .map(|i| between(&self.measured, place(i)))
            .collect();
        let is_inside = |i: &usize| (0.0..=(count - 1) as f64).contains(&place(*i));
        let first = (0..count).find(is_inside).unwrap_or(0);
        let last = (0..count).rev().find(is_inside).unwrap_or(count - 1);
        let range = self.range.start.max(first)..self.range.end.min(last + 1);
        Self {
            measured: Arc::new(measured),
            range: if range.len() > count / 4 {
                range
            } else {
                self.range.clone()
            },
            ..self.clone()
        }
    }
}

/// Value of a record between its samples: sinc interpolation with a Hann window.
fn between(samples: &[f64], place: f64) -> f64 {
    let nearest = place.round();
    let last = samples.len() as i64 - 1;
    let part = place - nearest;
    let at = |k: i64| samples[(nearest as i64 + k).clamp(0, last) as usize];
    if part == 0.0 {
        return at(0);
    }
    let weight = |k: i64| {
        let u = part - k as f64;
        let window = 0.5 + 0.5 * (PI * u / (POINTS + 1) as f64).cos();
        window * (PI * u).sin() / (PI * u)
    };
    (-POINTS..=POINTS).map(|k| weight(k) * at(k)).sum()
}
