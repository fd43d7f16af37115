//! Checks that the speed is constant and as given; otherwise a fit of fixed frequencies is wrong.

use std::f64::consts::{PI, TAU};

use torqcomp_dsp::harmonics::{Component, Fundamental, Harmonics, fit, refine_fundamental};

use super::mains::is_at_mains;
use super::rotation::Rotation;
use super::{foreign, lowest};
use crate::cli::REFINE_SPAN;
use crate::print::rounded;
use crate::warning::{Warning, WarningCode};

/// Number of parts of the record whose speeds are compared.
const PARTS: usize = 4;
/// Maximum number of samples evaluated in a part.
pub(super) const MOST: usize = 1 << 15;
/// Minimum number of periods of the fundamental in a part.
pub(super) const FEWEST: f64 = 8.0;
/// Relative search ranges around the fundamental; the wider ones apply if it is not found.
pub(super) const SPAN: f64 = 0.05;
const FAR_SPAN: f64 = 0.15;
const WIDE_SPAN: f64 = 0.3;
/// Significant difference of two speeds, in their standard uncertainties.
const SIGNIFICANT: f64 = 5.0;
/// Cycles gained or lost by the highest order over the record, from which a difference of speed is reported.
const TURNS: f64 = 0.2;

/// Maximum number of samples for estimating the speed.
pub(super) const FIRST: usize = 1 << 17;
/// Significant energy lost by a wrong speed, over the residual power per sample at the right one.
const LOST: f64 = 50.0;
/// The same over the power of the components, if the load changes.
const LOST_OF_POWER: f64 = 0.05;
/// Relative change of a component due to another speed, from which it is reported.
const CHANGED: f64 = 0.02;
/// Amplitude over its uncertainty from which a component is significant.
const THERE: f64 = 10.0;

/// A warning if another fundamental near the given one gives a much smaller residual: the speed on the nameplate is
/// not that of the record, and the fitted components are too small.
pub(super) fn off(of: &Rotation, load_changes: bool) -> Option<Warning> {
    let (fundamental_hz, rate_hz) = (of.fundamental_hz, of.record.rate_hz);
    let length = of.count().min(FIRST);
    if (length as f64) * fundamental_hz < FEWEST * rate_hz {
        return None;
    }
    let samples = of.first(length)?;
    let given = of.fitted(&samples, fundamental_hz)?;
    let within = |span: f64| {
        let found =
            foreign::refine(&samples[..], rate_hz, (fundamental_hz, span), of.orders).ok()?;
        let better = of.fitted(&samples, found.frequency_hz)?;
        let is_there = better.components.iter().any(is_sure)
            && !is_attracted(&given, &better, length as f64 / rate_hz);
        let rest = better.residual_rms.powi(2);
        let lost = given.residual_rms.powi(2) - rest;
        let shift_hz = (found.frequency_hz - fundamental_hz).abs();
        let pairs = given.components.iter().zip(&better.components);
        let changes = pairs
            .filter(|(_, better)| is_sure(better))
            .map(|(given, better)| (given.phasor - better.phasor).norm() / better.phasor.norm());
        let changed = changes.fold(0.0, f64::max) > CHANGED;
        let phasors = better.components.iter().map(|c| c.phasor.norm_sqr());
        let power = 0.5 * phasors.sum::<f64>();
        let matters = changed
            && lost * length as f64 > LOST * rest
            && (!load_changes || lost > LOST_OF_POWER * power);
        let is_off = is_there && matters && shift_hz > SIGNIFICANT * found.std_hz?;
        is_off.then_some((found, shift_hz, span))
    };
    // A speed found nearby is not searched for farther away.
    let is_there = given.components.iter().any(is_sure);
    let far = || within(FAR_SPAN).filter(|_| !is_there);
    let found = within(SPAN).or_else(far);
    found.map(|(found, shift_hz, span)| {
        let both_hz = (fundamental_hz, found.frequency_hz);
        if let Some(other) = lowest::instead_of(&samples, rate_hz, both_hz, of.orders) {
            return other;
        }
        let digits = rounded(found.frequency_hz, 7);
        let refine = match shift_hz < 0.01 * REFINE_SPAN * fundamental_hz {
            true => "--refine".to_owned(),
            false => format!("--refine --refine-span {}", 100.0 * span),
        };
        WarningCode::FundamentalOff.warning(format!(
            "a fundamental of {digits} Hz fits the record better than {} Hz, at which components are too small and \
             their phases wrong: add {refine}, or give --fundamental {digits}",
            rounded(fundamental_hz, 7)
        ))
    })
}

/// A warning if the fundamental differs between parts of the record by more than its uncertainty, and by so much
/// that the highest order loses its phase. It is estimated from differences over a quarter of the shortest period,
/// where a load step is a short pulse.
pub(super) fn warning(of: &Rotation) -> Option<Warning> {
    let (fundamental_hz, rate_hz) = (of.fundamental_hz, of.record.rate_hz);
    let count = of.count();
    let length = (count / PARTS).min(MOST);
    if (length as f64) * fundamental_hz < FEWEST * rate_hz {
        return None;
    }
    let highest = highest(of.orders);
    let lag = rate_hz / (4.0 * highest * fundamental_hz);
    let lag = (lag as usize).clamp(1, length / 4);
    let part = |place: usize, span: f64, length: usize| {
        let samples = of.window((place, PARTS), length)?;
        let pairs = samples.iter().zip(&samples[lag..]);
        let changes: Vec<f64> = pairs.map(|(before, after)| after - before).collect();
        speed_in(of, &changes, span)
    };
    let with = |span, length| -> Option<Vec<(Fundamental, bool)>> {
        let parts = 0..PARTS;
        parts.map(|place| part(place, span, length)).collect()
    };
    // A speed that is not found may change so fast that a line exists over a few periods only.
    let few = (FEWEST * rate_hz / fundamental_hz) as usize;
    let found = with(SPAN, length).or_else(|| with(WIDE_SPAN, few))?;
    let misled = found.iter().filter(|(_, is_of_orders)| !is_of_orders);
    if 2 * misled.count() > PARTS {
        return None;
    }
    let found: Vec<Fundamental> = found.into_iter().map(|(found, _)| found).collect();
    let by_speed = |a: &&Fundamental, b: &&Fundamental| a.frequency_hz.total_cmp(&b.frequency_hz);
    let (slowest, fastest) = (
        found.iter().min_by(by_speed)?,
        found.iter().max_by(by_speed)?,
    );
    let change_hz = fastest.frequency_hz - slowest.frequency_hz;
    let std_hz = slowest.std_hz?.hypot(fastest.std_hz?);
    let duration_s = count as f64 / rate_hz;
    let matters = change_hz > SIGNIFICANT * std_hz && change_hz * highest * duration_s > TURNS;
    matters.then(|| {
        WarningCode::SpeedChanges.warning(format!(
            "the fundamental changes over the record, from {} to {} Hz: the components are averages and too small, \
             increasingly with their order; select a part of constant speed with --range",
            rounded(slowest.frequency_hz, 6),
            rounded(fastest.frequency_hz, 6)
        ))
    })
}

/// The fundamental within a relative range around the given one, and whether it is that of the orders: not where none
/// is significant, nor if it is attracted by another line.
fn speed_in(of: &Rotation, samples: &[f64], span: f64) -> Option<(Fundamental, bool)> {
    let (given_hz, rate_hz, orders) = (of.fundamental_hz, of.record.rate_hz, of.orders);
    // The range ends where the highest order exceeds the spectrum.
    let from_hz = given_hz.min(0.5 * rate_hz / highest(orders) / (1.0 + span));
    let found = refine_fundamental(samples, rate_hz, from_hz, span, orders).ok()?;
    let better = of.fitted(samples, found.frequency_hz);
    let both = of.fitted(samples, given_hz).zip(better);
    let duration_s = samples.len() as f64 / rate_hz;
    let is_of_orders = both.is_none_or(|(given, found)| {
        found.components.iter().any(is_sure) && !is_attracted(&given, &found, duration_s)
    });
    Some((found, is_of_orders))
}

/// Periods of the lowest order in a window for the angle of the shaft: short windows show fast fluctuations, long ones weak
/// components.
const PERIODS: [f64; 2] = [2.0, FEWEST];
/// Maximum and minimum number of windows.
const MOST_WINDOWS: usize = 1024;
const FEWEST_WINDOWS: usize = 8;
/// Variance of the angle over that due to noise, from which the speed fluctuates.
const SWAYS: f64 = 4.0;
/// Reported phase fluctuation of the highest significant order, rms in rad: its amplitude is then 2 % too small.
const SWAY_RAD: f64 = 0.2;

/// A warning if the angle of the shaft fluctuates about that of a steady rotation: the speed is right on average, but
/// the higher orders are smeared. The angle is the common part of the phases of the orders, each divided by its order,
/// per window.
pub(super) fn sways(of: &Rotation) -> Option<Warning> {
    let (samples, rate_hz) = (of.first(FIRST)?, of.record.rate_hz);
    let fundamental = Fundamental::given(of.fundamental_hz);
    let whole = of.fitted(&samples, of.fundamental_hz)?;
    PERIODS.into_iter().find_map(|periods| {
        let shortest = (periods * rate_hz / (of.lowest() * of.fundamental_hz)).ceil() as usize;
        let windows = (samples.len() / shortest).min(MOST_WINDOWS);
        let is_enough = windows >= FEWEST_WINDOWS;
        let shown =
            is_enough.then(|| angles_by_order(&samples, rate_hz, fundamental, &whole, windows));
        sways_by(of.orders, &shown??)
    })
}

/// The same, from the angles by each of the orders in each window.
fn sways_by(orders: &[f64], shown: &[Vec<Option<[f64; 2]>>]) -> Option<Warning> {
    let mean_angle = |angles: &Vec<Option<[f64; 2]>>| {
        let sure = angles.iter().flatten();
        let sums = sure.fold([0.0; 2], |[sum, weights], [angle, variance]| {
            [sum + angle / variance, weights + 1.0 / variance]
        });
        (sums[1] > 0.0).then(|| [sums[0] / sums[1], 1.0 / sums[1]])
    };
    let angles: Vec<[f64; 2]> = shown.iter().map(mean_angle).collect::<Option<_>>()?;
    let (variance, noise) = (
        StraightLine::through(&angles).variance,
        mean_variance(&angles),
    );
    // A line beside one order moves only the angle by that one.
    let contradicts = |k: usize| {
        let own: Option<Vec<[f64; 2]>> = shown.iter().map(|angles| angles[k]).collect();
        own.is_some_and(|own| {
            let noise = SWAYS * mean_variance(&own);
            StraightLine::through(&own).variance < noise && noise < variance
        })
    };
    if (0..orders.len()).any(contradicts) {
        return None;
    }
    let sways_rad = (variance - noise).max(0.0).sqrt();
    // In the windows: smeared over the whole record, none may be significant.
    let is_there = |k: &usize| shown.iter().any(|angles| angles[*k].is_some());
    let there = (0..orders.len()).filter(is_there).map(|k| orders[k]);
    let highest = there.fold(0.0, f64::max);
    (variance > SWAYS * noise && highest * sways_rad > SWAY_RAD).then(|| {
        let loss = -(-0.5 * (highest * sways_rad).powi(2)).exp_m1();
        WarningCode::SpeedChanges.warning(format!(
            "the speed is not constant: the shaft angle deviates by {} degrees rms from uniform rotation, so \
             components are averages and too small, order {} by about {} %; select a shorter part with --range",
            rounded(sways_rad.to_degrees(), 2),
            rounded(highest, 4),
            rounded(100.0 * loss, 2)
        ))
    })
}

/// Whether an order that is significant at the given speed is not at the one found: a strong line that is no order has
/// attracted another. An order at the mains may be their line, which a wrong speed hits by chance.
fn is_attracted(given: &Harmonics, found: &Harmonics, duration_s: f64) -> bool {
    let mut both = given.components.iter().zip(&found.components);
    both.any(|(given, found)| {
        is_sure(given) && !is_sure(found) && !is_at_mains(given.frequency_hz, duration_s)
    })
}

/// Whether a component is significant.
pub(super) fn is_sure(component: &Component) -> bool {
    component.phasor.norm() > THERE * component.std_amplitude
}

/// The orders that are significant at a fundamental; a record too short to separate them shows none.
pub(super) fn sure_orders(samples: &[f64], rate_hz: f64, hz: f64, orders: &[f64]) -> Vec<f64> {
    let fitted = fit(samples, rate_hz, 0.0, Fundamental::given(hz), orders);
    let components = fitted.map_or_else(|_| Vec::new(), |found| found.components);
    let sure = components.iter().filter(|c| is_sure(c));
    sure.map(|c| c.order).collect()
}

/// By each significant order in each window: the angle of the shaft relative to its mean, and the variance of that.
pub(super) fn angles_by_order(
    samples: &[f64],
    rate_hz: f64,
    fundamental: Fundamental,
    whole: &Harmonics,
    windows: usize,
) -> Option<Vec<Vec<Option<[f64; 2]>>>> {
    let orders: Vec<f64> = whole.components.iter().map(|c| c.order).collect();
    let length = samples.len() / windows;
    // A phase continues from the window before: it may move by turns.
    let mut phases_rad = vec![0.0; orders.len()];
    let shown = (0..windows).map(|window| {
        let start = window * length;
        let part = &samples[start..start + length];
        let time_s = start as f64 / rate_hz;
        let here = fit(part, rate_hz, time_s, fundamental, &orders).ok()?;
        let pairs = whole.components.iter().zip(&here.components);
        let by_order = pairs.zip(&mut phases_rad).map(|((mean, here), phase_rad)| {
            let turned = (here.phasor * mean.phasor.conj()).arg();
            let std_rad = here.std_amplitude / here.phasor.norm();
            is_sure(here).then(|| {
                *phase_rad += (turned - *phase_rad + PI).rem_euclid(TAU) - PI;
                [*phase_rad / here.order, (std_rad / here.order).powi(2)]
            })
        });
        Some(by_order.collect())
    });
    let mut shown: Vec<Vec<Option<[f64; 2]>>> = shown.collect::<Option<_>>()?;
    for k in 0..orders.len() {
        let own = shown.iter().filter_map(|angles| angles[k]);
        let (sum, count) = own.fold((0.0, 0.0), |(sum, n), [angle, _]| (sum + angle, n + 1.0));
        for [angle, _] in shown.iter_mut().filter_map(|angles| angles[k].as_mut()) {
            *angle -= sum / count;
        }
    }
    Some(shown)
}

/// Mean of the variances of values.
pub(super) fn mean_variance(values: &[[f64; 2]]) -> f64 {
    values.iter().map(|[_, variance]| variance).sum::<f64>() / values.len() as f64
}

/// A straight line through values of uncertain size, over their places.
pub(super) struct StraightLine {
    pub slope: f64,
    /// Sum of the squares of the places about their mean.
    pub squares: f64,
    /// Variance of the values about the line.
    pub variance: f64,
}

impl StraightLine {
    pub fn through(values: &[[f64; 2]]) -> Self {
        let count = values.len() as f64;
        let middle = 0.5 * (count - 1.0);
        let mean = values.iter().map(|[y, _]| y).sum::<f64>() / count;
        let (mut products, mut squares) = (0.0, 0.0);
        for (i, [y, _]) in values.iter().enumerate() {
            let x = i as f64 - middle;
            products += x * (y - mean);
            squares += x * x;
        }
        let slope = products / squares;
        let left = values.iter().enumerate();
        let left = left.map(|(i, [y, _])| (y - mean - slope * (i as f64 - middle)).powi(2));
        Self {
            slope,
            squares,
            variance: left.sum::<f64>() / (count - 2.0),
        }
    }
}

/// Number of pieces of the record whose mean torques are compared.
const PIECES: usize = 16;
/// Reported change of the mean torque, relative to the largest of mean and components, and relative to its scatter.
const LOAD_STEP: f64 = 0.2;
const OVER_SCATTER: f64 = 8.0;

/// A warning if the mean torque changes over the record, as at a load step: the components depend on the load.
/// Means are taken over whole periods, in which the components cancel.
pub(super) fn load_changes(of: &Rotation) -> Option<Warning> {
    let (record, count) = (of.record, of.count());
    let period = record.rate_hz / of.fundamental_hz;
    let periods = (count as f64 / PIECES as f64 / period).floor();
    if periods < 1.0 {
        return None;
    }
    let length = (periods * period).round() as usize;
    let means = (0..PIECES).map(|piece| {
        let samples = of.window((piece, PIECES), length)?;
        Some(samples.iter().sum::<f64>() / length as f64)
    });
    let means: Vec<f64> = means.collect::<Option<_>>()?;
    let mut steps: Vec<f64> = means.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    steps.sort_by(f64::total_cmp);
    let scatter = steps[steps.len() / 2];
    let (low, high) = means
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), m| {
            (low.min(*m), high.max(*m))
        });
    let fundamental = Fundamental::given(of.fundamental_hz);
    let fitted = fit(&record.samples, record.rate_hz, 0.0, fundamental, of.orders).ok()?;
    let largest = fitted.components.iter().map(|c| c.phasor.norm());
    let largest = largest.fold(low.abs().max(high.abs()), f64::max);
    let change = high - low;
    (change > LOAD_STEP * largest && change > OVER_SCATTER * scatter).then(|| {
        // The largest step, midway between the pieces.
        let at = (1..PIECES).max_by(|a, b| {
            let step = |k: &usize| (means[*k] - means[k - 1]).abs();
            step(a).total_cmp(&step(b))
        });
        let duration_s = count as f64 / record.rate_hz;
        let at = at.unwrap_or(1) as f64 / PIECES as f64 * duration_s;
        WarningCode::LoadChanges.warning(format!(
            "the mean torque changes over the record by {} % of its largest value, most at about {} s after the \
             start: the components are averages over different loads; select a part of constant load with --range",
            rounded(100.0 * change / largest, 2),
            rounded(at, 2)
        ))
    })
}

pub(super) fn highest(orders: &[f64]) -> f64 {
    orders.iter().copied().fold(0.0, f64::max)
}
