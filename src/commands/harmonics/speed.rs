//! Whether the speed is the one given and stays it, without which a fit of fixed frequencies is wrong.

use torqcomp_dsp::harmonics::{Component, Fundamental, Harmonics, fit, refine_fundamental};
use torqcomp_dsp::store::SampleStore;

use crate::cli::REFINE_SPAN;
use crate::print::rounded;
use crate::recording::{Spool, UniformRecord};
use crate::warning::Warning;

/// Parts of the record whose speeds are compared.
const PARTS: usize = 4;
/// Most samples that are looked at in a part.
const MOST: usize = 1 << 15;
/// Fewest periods of the fundamental in a part.
const FEWEST: f64 = 8.0;
/// How far from the fundamental it is looked for, relative to it, and where it is not there.
const SPAN: f64 = 0.05;
const FAR_SPAN: f64 = 0.15;
const WIDE_SPAN: f64 = 0.3;
/// Difference of two speeds, in their standard uncertainties, that is none by chance.
const SIGNIFICANT: f64 = 5.0;
/// Turns that the highest order gains or loses over the record by a difference of speed that is worth saying.
const TURNS: f64 = 0.2;

/// Most samples from which the speed is found.
const FIRST: usize = 1 << 17;
/// Part of the components' power that a wrong speed loses before it is worth saying.
const LOST: f64 = 0.05;
/// Amplitude over its uncertainty from which a component is surely there.
const THERE: f64 = 10.0;

/// A warning if another fundamental near the given one leaves much less of the record over: the speed on the nameplate is
/// not that of the record, and its components come out too small.
pub(super) fn off(
    record: &UniformRecord<Spool>,
    fundamental_hz: f64,
    orders: &[f64],
) -> Option<Warning> {
    let length = record.samples.count().min(FIRST);
    if (length as f64) * fundamental_hz < FEWEST * record.rate_hz {
        return None;
    }
    let samples = record.samples.part(0..length).ok()?;
    let rate_hz = record.rate_hz;
    let of = |fundamental| fit(&samples[..], rate_hz, 0.0, fundamental, orders).ok();
    let power = |fitted: &Harmonics| {
        let of_each = |c: &Component| 0.5 * c.phasor.norm_sqr();
        fitted.components.iter().map(of_each).sum::<f64>()
    };
    let given: Harmonics = of(Fundamental::given(fundamental_hz))?;
    if given.residual_rms.powi(2) <= LOST * power(&given) {
        return None;
    }
    let is_sure = |c: &Component| c.phasor.norm() > THERE * c.std_amplitude;
    let within = |span: f64| {
        let found = refine_fundamental(&samples[..], rate_hz, fundamental_hz, span, orders).ok()?;
        let better = of(Fundamental::given(found.frequency_hz))?;
        let is_there = better.components.iter().any(is_sure);
        let lost = given.residual_rms.powi(2) - better.residual_rms.powi(2);
        let shift_hz = (found.frequency_hz - fundamental_hz).abs();
        let turns = shift_hz * highest(orders) * length as f64 / rate_hz;
        let matters = lost > LOST * power(&better) && turns > TURNS;
        let is_off = is_there && matters && shift_hz > SIGNIFICANT * found.std_hz?;
        is_off.then_some((found, shift_hz, span))
    };
    // A speed that is there is not looked for farther away.
    let is_there = given.components.iter().any(is_sure);
    let far = || within(FAR_SPAN).filter(|_| !is_there);
    let found = within(SPAN).or_else(far);
    found.map(|(found, shift_hz, span)| {
        let digits = rounded(found.frequency_hz, 7);
        let refine = match shift_hz < 0.01 * REFINE_SPAN * fundamental_hz {
            true => "--refine".to_owned(),
            false => format!("--refine --refine-span {}", 100.0 * span),
        };
        Warning::new(
            "fundamental-off",
            format!(
                "the record fits a fundamental of {digits} Hz better than {} Hz, at which components come out too \
                 small: add {refine}, or give --fundamental {digits}",
                rounded(fundamental_hz, 7)
            ),
        )
    })
}

/// A warning if the fundamental differs between the parts of a record by more than its uncertainty there, and by so much
/// that the highest order loses its phase. It is found from differences over a quarter of the shortest period, in which a
/// load step is a short pulse.
pub(super) fn warning(
    record: &UniformRecord<Spool>,
    fundamental_hz: f64,
    orders: &[f64],
) -> Option<Warning> {
    let count = record.samples.count();
    let length = (count / PARTS).min(MOST);
    if (length as f64) * fundamental_hz < FEWEST * record.rate_hz {
        return None;
    }
    let highest = highest(orders);
    let lag = record.rate_hz / (4.0 * highest * fundamental_hz);
    let lag = (lag as usize).clamp(1, length / 4);
    let part = |place: usize, span: f64, length: usize| {
        let start = place * (count - length) / (PARTS - 1);
        let samples = record.samples.part(start..start + length).ok()?;
        let pairs = samples.iter().zip(&samples[lag..]);
        let changes: Vec<f64> = pairs.map(|(before, after)| after - before).collect();
        // The span ends where the highest order leaves the spectrum.
        let fundamental_hz = fundamental_hz.min(0.5 * record.rate_hz / highest / (1.0 + span));
        refine_fundamental(&changes, record.rate_hz, fundamental_hz, span, orders).ok()
    };
    let with = |span, length| -> Option<Vec<Fundamental>> {
        let parts = 0..PARTS;
        parts.map(|place| part(place, span, length)).collect()
    };
    // A speed that is not there may change so fast that a line is one over a few periods only.
    let few = (FEWEST * record.rate_hz / fundamental_hz) as usize;
    let found = with(SPAN, length).or_else(|| with(WIDE_SPAN, few))?;
    let by_speed = |a: &&Fundamental, b: &&Fundamental| a.frequency_hz.total_cmp(&b.frequency_hz);
    let (slowest, fastest) = (
        found.iter().min_by(by_speed)?,
        found.iter().max_by(by_speed)?,
    );
    let change_hz = fastest.frequency_hz - slowest.frequency_hz;
    let std_hz = slowest.std_hz?.hypot(fastest.std_hz?);
    let duration_s = count as f64 / record.rate_hz;
    let matters = change_hz > SIGNIFICANT * std_hz && change_hz * highest * duration_s > TURNS;
    matters.then(|| {
        Warning::new(
            "speed-changes",
            format!(
                "the fundamental changes over the record, from {} to {} Hz: the components are averages that come \
                 out too small, the more the higher their order; take a part of constant speed with --range",
                rounded(slowest.frequency_hz, 6),
                rounded(fastest.frequency_hz, 6)
            ),
        )
    })
}

/// Pieces of the record whose mean torques are compared.
const PIECES: usize = 16;
/// Change of the mean torque, over the largest of it and of the components, and over its scatter, that is worth saying.
const LOAD_STEP: f64 = 0.2;
const OVER_SCATTER: f64 = 8.0;

/// A warning if the mean torque changes over the record, as at a load step: components of one load are not those of another.
/// It is compared over whole periods, in which the components cancel.
pub(super) fn load_changes(
    record: &UniformRecord<Spool>,
    fundamental_hz: f64,
    orders: &[f64],
) -> Option<Warning> {
    let count = record.samples.count();
    let period = record.rate_hz / fundamental_hz;
    let periods = (count as f64 / PIECES as f64 / period).floor();
    if periods < 1.0 {
        return None;
    }
    let length = (periods * period).round() as usize;
    let means = (0..PIECES).map(|piece| {
        let start = piece * (count - length) / (PIECES - 1);
        let samples = record.samples.part(start..start + length).ok()?;
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
    let fundamental = Fundamental::given(fundamental_hz);
    let fitted = fit(&record.samples, record.rate_hz, 0.0, fundamental, orders).ok()?;
    let largest = fitted.components.iter().map(|c| c.phasor.norm());
    let largest = largest.fold(low.abs().max(high.abs()), f64::max);
    let change = high - low;
    (change > LOAD_STEP * largest && change > OVER_SCATTER * scatter).then(|| {
        // The largest step, in the middle between the pieces.
        let at = (1..PIECES).max_by(|a, b| {
            let step = |k: &usize| (means[*k] - means[k - 1]).abs();
            step(a).total_cmp(&step(b))
        });
        let duration_s = count as f64 / record.rate_hz;
        let at = at.unwrap_or(1) as f64 / PIECES as f64 * duration_s;
        Warning::new(
            "load-changes",
            format!(
                "the mean torque changes over the record by {} % of its largest value, most about {} s after its start: the components \
                 are averages over different loads; take a part of constant load with --range",
                rounded(100.0 * change / largest, 2),
                rounded(at, 2)
            ),
        )
    })
}

pub(super) fn highest(orders: &[f64]) -> f64 {
    orders.iter().copied().fold(0.0, f64::max)
}
