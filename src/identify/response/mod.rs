//! Modes from a known input and a measured output.

mod modal;

use std::f64::consts::TAU;
use std::ops::Range;

use torqcomp_dsp::frf::{self, Block, Estimator, Frf, Window};

use super::decay::Pole;
use super::{Comparison, Found, Outcome, Quality};
use crate::failure::Failure;
use crate::report::chart::{Chart, Series};
use crate::report::{rounded, short};
pub use modal::{Data, Effort, Modal};

/// How the stand was excited.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Excitation {
    /// By hits.
    Impact,
    /// By noise.
    Random,
    /// By one signal again and again.
    Periodic,
}

/// A record of both channels.
#[derive(Debug, Clone, Copy)]
pub struct Driven<'a> {
    /// Name, for messages.
    pub name: &'a str,
    /// Samples a second.
    pub rate_hz: f64,
    /// What acted.
    pub applied: &'a [f64],
    /// What was measured.
    pub measured: &'a [f64],
}

/// How responses are evaluated.
#[derive(Debug, Clone, Copy, Default)]
pub struct Options {
    /// How the stand was excited, if it is known.
    pub excitation: Option<Excitation>,
    /// Frequencies to fit.
    pub band_hz: Option<(f64, f64)>,
    /// Number of modes, if it is known.
    pub modes: Option<usize>,
    /// Samples of a period.
    pub period: Option<usize>,
    /// Samples of a segment.
    pub segment: Option<usize>,
    /// Derivative of displacement that was measured: 0, 1 or 2.
    pub order: i32,
    /// Whether a delay is fitted.
    pub with_delay: bool,
}

/// A response that was evaluated, with what is needed to draw it.
#[derive(Debug, Clone)]
pub struct Evaluated {
    /// The numbers.
    pub outcome: Outcome,
    /// Frequencies of the lines in the band, in Hz.
    pub frequency_hz: Vec<f64>,
    /// H1 over all blocks; its lines are those of the band.
    pub h1: Frf,
    /// H2 and Hv at the same lines.
    pub others: [Vec<num_complex::Complex64>; 2],
    /// The model.
    pub modal: Modal,
    /// Error on data held out for 0, 1, 2, … modes.
    pub held_out: Vec<f64>,
}

/// Most modes tried.
const MOST_MODES: usize = 24;
/// Modes without gain after which no more are tried.
const PATIENCE: usize = 3;
/// Fewer modes are preferred if the error held out is no more than this much larger.
const SLACK: f64 = 1.05;

/// Evaluates records of one stand.
///
/// # Errors
/// If there is nothing usable in them.
pub fn identify(records: &[Driven], options: &Options) -> Result<Evaluated, Failure> {
    let mut outcome = Outcome::default();
    let set = blocks(records, options, &mut outcome)?;
    let lines = band(&set, options)?;
    let modal = order(&set, &lines, options)?;
    let (best, held_out) = modal;
    let data = data(&set, &lines, options, &|_| true);
    let mut fitted = data.fit(&[], Effort::Coarse)?;
    for _ in 0..best {
        fitted = grow(&data, &fitted, options)?.unwrap_or(fitted);
    }
    fitted = data.fit(&fitted.poles, Effort::Fine)?;
    let count = fitted.poles.len();
    let spread = jackknife(&set, &lines, options, &fitted)?;
    name_modes(&mut outcome, &fitted, &spread);
    let all: f64 = set
        .blocks
        .iter()
        .map(|b| frf::prediction_error(&fitted.response, b, lines.clone()))
        .sum();
    let relative = all / set.blocks.len() as f64;
    outcome.quality = Some(Quality {
        rms: output_rms(&set, &lines) * relative,
        unit: String::new(),
        relative,
    });
    let held = held_out.get(count).copied();
    outcome.method.push(format!(
        "{count} mode(s) through {} lines from {} to {} Hz, H1 over {} blocks, residual terms for modes \
         outside the band{}",
        lines.len(),
        short(lines.start as f64 * set.step_hz),
        short((lines.end - 1) as f64 * set.step_hz),
        set.blocks.len(),
        if options.with_delay { ", a delay" } else { "" }
    ));
    if let Some(held) = held.filter(|h| h.is_finite()) {
        outcome.method.push(format!(
            "on data held out the model leaves {} % of the measured signal",
            rounded(100.0 * held, 3)
        ));
        outcome
            .found
            .push(Found::new("held_out_error", 100.0 * held, None, "%"));
    }
    if options.order == 0 {
        outcome
            .found
            .push(Found::new("static_gain", fitted.at_rest(), None, ""));
    }
    if options.with_delay {
        let std = fitted.fit.as_ref().and_then(|f| f.std[2 * count]);
        outcome
            .found
            .push(Found::new("delay", fitted.delay_s, std, "s"));
    }
    let part = |frf: Frf| frf.response[lines.clone()].to_vec();
    let h1 = Frf::of(set.blocks.iter(), Estimator::H1);
    raw_error(&mut outcome, &set, &lines);
    levels(&mut outcome, &set, &lines);
    draw(&mut outcome, &h1, &lines, set.step_hz, &fitted, &held_out);
    Ok(Evaluated {
        outcome,
        frequency_hz: lines.clone().map(|k| k as f64 * set.step_hz).collect(),
        others: [
            part(Frf::of(set.blocks.iter(), Estimator::H2)),
            part(Frf::of(set.blocks.iter(), Estimator::Hv)),
        ],
        h1: Frf {
            response: h1.response[lines.clone()].to_vec(),
            coherence: h1.coherence[lines.clone()].to_vec(),
            applied_power: h1.applied_power[lines.clone()].to_vec(),
            blocks: h1.blocks,
        },
        modal: fitted,
        held_out,
    })
}

/// Blocks of all records, on one grid of frequencies.
struct Set {
    blocks: Vec<Block>,
    /// Record that each block is from.
    record: Vec<usize>,
    step_hz: f64,
    /// Decay rate that the window adds, 1/s.
    added_rate: f64,
}

fn blocks(records: &[Driven], options: &Options, outcome: &mut Outcome) -> Result<Set, Failure> {
    let first = records
        .first()
        .ok_or_else(|| Failure::failed("there is no record"))?;
    let rate_hz = first.rate_hz;
    for record in records {
        if (record.rate_hz / rate_hz - 1.0).abs() > 1e-6 {
            return Err(Failure::failed(format_args!(
                "{} has {} samples a second and {} has {}; records of one response must have one rate",
                first.name,
                short(rate_hz),
                record.name,
                short(record.rate_hz)
            )));
        }
        let numbers = record.applied.iter().chain(record.measured);
        if record.applied.len() != record.measured.len() || numbers.clone().any(|v| !v.is_finite())
        {
            return Err(Failure::failed(format_args!(
                "{}: both channels need a number in every row",
                record.name
            )));
        }
    }
    let excitation = options.excitation.unwrap_or_else(|| guess(first.applied));
    match excitation {
        Excitation::Impact => impacts(records, outcome),
        Excitation::Random => random(records, options, outcome),
        Excitation::Periodic => periodic(records, options, outcome),
    }
}

/// Part of the samples that a hammer leaves at rest.
const AT_REST: f64 = 0.95;

fn guess(applied: &[f64]) -> Excitation {
    let largest = applied.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let quiet = applied.iter().filter(|v| v.abs() < 0.1 * largest).count();
    if quiet as f64 > AT_REST * applied.len() as f64 {
        Excitation::Impact
    } else if frf::find_period(applied).is_some() {
        Excitation::Periodic
    } else {
        Excitation::Random
    }
}

/// Swing at the end of a hit's record, over the largest, from which on a window is needed.
const RINGING: f64 = 5e-3;
/// The window falls to this at the end.
const WINDOW_END: f64 = 1e-2;

fn impacts(records: &[Driven], outcome: &mut Outcome) -> Result<Set, Failure> {
    let rate_hz = records[0].rate_hz;
    let mut good = Vec::new();
    for (r, record) in records.iter().enumerate() {
        let apart = (0.05 * rate_hz) as usize;
        for (k, hit) in frf::find_hits(record.applied, record.measured, apart)
            .into_iter()
            .enumerate()
        {
            if hit.faults.is_empty() {
                good.push((r, hit.range));
                continue;
            }
            let why: Vec<String> = hit.faults.iter().map(ToString::to_string).collect();
            outcome.warn(
                "hit-left-out",
                format!(
                    "{}, hit {} at {} s was left out: {}",
                    record.name,
                    k + 1,
                    short(hit.peak as f64 / rate_hz),
                    why.join(" and ")
                ),
            );
        }
    }
    let length = good
        .iter()
        .map(|(_, range)| range.len())
        .min()
        .ok_or_else(|| {
            Failure::failed(
                "no usable hit is in the records; hit again, once, without overdriving the inputs",
            )
        })?;
    let still_rings = good.iter().any(|(r, range)| {
        let part = &records[*r].measured[range.start..range.start + length];
        let top = part.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        super::rms(&part[length - length / 20..]) > RINGING * top
    });
    let tau = length as f64 / -WINDOW_END.ln();
    let window = if still_rings {
        Window::Exponential(tau)
    } else {
        Window::None
    };
    if still_rings {
        outcome.method.push(format!(
            "exponential window with a time constant of {} s on both channels, taken out of the damping",
            short(tau / rate_hz)
        ));
    }
    Ok(Set {
        blocks: good
            .iter()
            .map(|(r, range)| {
                let range = range.start..range.start + length;
                let (applied, measured) = (
                    &records[*r].applied[range.clone()],
                    &records[*r].measured[range],
                );
                // What stands before the hit is offset.
                let level = |v: &[f64]| v[..8].iter().sum::<f64>() / 8.0;
                let without = |v: &[f64]| v.iter().map(|x| x - level(v)).collect::<Vec<f64>>();
                frf::transform(&without(applied), &without(measured), window)
            })
            .collect(),
        record: good.iter().map(|(r, _)| *r).collect(),
        step_hz: rate_hz / length as f64,
        added_rate: if still_rings { rate_hz / tau } else { 0.0 },
    })
}

fn random(records: &[Driven], options: &Options, outcome: &mut Outcome) -> Result<Set, Failure> {
    let rate_hz = records[0].rate_hz;
    let total: usize = records.iter().map(|r| r.applied.len()).sum();
    // Some thirty segments: enough to average, long enough to resolve.
    let length = options
        .segment
        .unwrap_or_else(|| (total / 16).clamp(64, 1 << 14) & !1);
    let mut blocks = Vec::new();
    let mut of = Vec::new();
    for (r, record) in records.iter().enumerate() {
        let cut = frf::segments(record.applied, record.measured, length);
        of.extend(std::iter::repeat_n(r, cut.len()));
        blocks.extend(cut);
    }
    if blocks.len() < 4 {
        return Err(Failure::failed(format_args!(
            "segments of {length} samples fit only {} times into the records; make them shorter with \
             --segment, or record longer",
            blocks.len()
        )));
    }
    outcome.method.push(format!(
        "Hann-weighted segments of {length} samples, half overlapping"
    ));
    Ok(Set {
        blocks,
        record: of,
        step_hz: rate_hz / length as f64,
        added_rate: 0.0,
    })
}

fn periodic(records: &[Driven], options: &Options, outcome: &mut Outcome) -> Result<Set, Failure> {
    let rate_hz = records[0].rate_hz;
    let period = options.period.or_else(|| frf::find_period(records[0].applied)).ok_or_else(|| {
        Failure::failed("no period is found in the applied signal; give it with --period, or --excitation random")
    })?;
    let mut blocks = Vec::new();
    let mut of = Vec::new();
    for (r, record) in records.iter().enumerate() {
        let cut: Vec<Block> = (0..record.applied.len() / period)
            .map(|k| k * period..(k + 1) * period)
            .map(|p| {
                frf::transform(
                    &record.applied[p.clone()],
                    &record.measured[p],
                    Window::None,
                )
            })
            .collect();
        // The first period still holds what went before.
        let steady = if cut.len() > 2 { &cut[1..] } else { &cut[..] };
        if let Some(found) = frf::average_periods(steady) {
            say_noise(outcome, record.name, &found);
        }
        of.extend(std::iter::repeat_n(r, steady.len()));
        blocks.extend_from_slice(steady);
    }
    if blocks.is_empty() {
        return Err(Failure::failed(format_args!(
            "no period of {period} samples fits into the records"
        )));
    }
    outcome.method.push(format!(
        "periods of {period} samples, the first one left out"
    ));
    Ok(Set {
        blocks,
        record: of,
        step_hz: rate_hz / period as f64,
        added_rate: 0.0,
    })
}

fn say_noise(outcome: &mut Outcome, name: &str, found: &frf::Periodic) {
    let lines = found.excited.len();
    let sum = |keep: &dyn Fn(usize) -> bool, of: &dyn Fn(usize) -> f64| -> f64 {
        (1..lines).filter(|k| keep(*k)).map(of).sum()
    };
    let signal = sum(&|k| found.excited[k], &|k| {
        found.mean.measured[k].norm_sqr()
    });
    let noise = sum(&|_| true, &|k| found.noise_power[k]);
    let others = sum(&|k| !found.excited[k], &|k| {
        found.mean.measured[k].norm_sqr() - found.noise_power[k]
    });
    let decibel = |power: f64| rounded(10.0 * (power.max(1e-300) / signal).log10(), 3);
    outcome.method.push(format!(
        "{name}: noise {} dB below the response, distortion at lines that are not excited {}",
        decibel(noise),
        if others > 0.0 {
            format!("{} dB", decibel(others))
        } else {
            "none".to_owned()
        }
    ));
    if others > 4.0 * noise && others > 1e-4 * signal {
        outcome.warn(
            "nonlinear",
            format!(
                "{name}: the response has power at frequencies that were not applied, more than noise explains \
                 ({} dB): the stand is not linear at this level",
                decibel(others)
            ),
        );
    }
}

/// Power of the applied signal, over its largest, that excites.
const EXCITES: f64 = 1e-3;

fn band(set: &Set, options: &Options) -> Result<Range<usize>, Failure> {
    let lines = set.blocks[0].applied.len();
    let frf = Frf::of(set.blocks.iter(), Estimator::H1);
    let (from, to) = match options.band_hz {
        Some((from, to)) => (
            (from / set.step_hz).ceil() as usize,
            (to / set.step_hz).floor() as usize + 1,
        ),
        None => {
            let top = frf.applied_power[1..]
                .iter()
                .fold(0.0_f64, |m, p| m.max(*p));
            let on = |k: &usize| frf.applied_power[*k] > EXCITES * top;
            (
                (1..lines).find(on).unwrap_or(1),
                (1..lines).rev().find(on).unwrap_or(1) + 1,
            )
        }
    };
    let range = from.max(1)..to.min(lines - 1);
    if range.len() < 12 {
        return Err(Failure::failed(format_args!(
            "the band holds {} lines {} Hz apart, too few to fit modes; widen --band or record longer",
            range.len(),
            short(set.step_hz)
        )));
    }
    Ok(range)
}

/// Most lines that are fitted; more are thinned out evenly.
const MOST_LINES: usize = 6000;

fn data(set: &Set, lines: &Range<usize>, options: &Options, keep: &dyn Fn(usize) -> bool) -> Data {
    let chosen = set
        .blocks
        .iter()
        .enumerate()
        .filter(|(i, _)| keep(*i))
        .map(|(_, b)| b);
    let frf = Frf::of(chosen, Estimator::H1);
    let powers = &frf.applied_power[lines.clone()];
    let mean = powers.iter().sum::<f64>() / powers.len() as f64;
    Data {
        omega: lines
            .clone()
            .map(|k| TAU * k as f64 * set.step_hz)
            .collect(),
        response: frf.response[lines.clone()].to_vec(),
        weight: powers.iter().map(|p| (p / mean).sqrt()).collect(),
        order: options.order,
        added_rate: set.added_rate,
        with_delay: options.with_delay,
    }
}

/// Modes closer than this part of their frequency are not looked for unless their number is given: a
/// mode that is not quite linear leaves something beside its line.
const APART: f64 = 0.03;

fn grow(data: &Data, so_far: &Modal, options: &Options) -> Result<Option<Modal>, Failure> {
    let apart = if options.modes.is_some() { 0.0 } else { APART };
    let Some(pole) = data.next_pole(so_far, apart) else {
        return Ok(None);
    };
    let mut starts = so_far.poles.clone();
    starts.push(pole);
    Ok(Some(data.fit(&starts, Effort::Coarse)?))
}

/// Folds of the blocks: each is held out once.
fn folds(set: &Set) -> Vec<Vec<usize>> {
    let count = set.blocks.len();
    let folds = count.min(3);
    // Neighbours in one fold, since segments overlap.
    (0..folds)
        .map(|f| (count * f / folds..count * (f + 1) / folds).collect())
        .collect()
}

/// Number of modes by the error on held-out blocks, and that error for each number.
fn order(set: &Set, lines: &Range<usize>, options: &Options) -> Result<(usize, Vec<f64>), Failure> {
    let folds = folds(set);
    if lines.len() > MOST_LINES {
        return Err(Failure::failed(format_args!(
            "{} lines lie in the band, more than {MOST_LINES}; narrow it with --band",
            lines.len()
        )));
    }
    if folds.len() < 2 {
        return match options.modes {
            Some(modes) => Ok((modes, vec![f64::NAN; modes + 1])),
            None => Err(Failure::failed(
                "a single block leaves nothing to try the number of modes on; give it with --modes, or record \
                 more",
            )),
        };
    }
    let most = options.modes.unwrap_or(MOST_MODES).min(lines.len() / 6);
    let training: Vec<Data> = folds
        .iter()
        .map(|fold| data(set, lines, options, &|i| !fold.contains(&i)))
        .collect();
    let mut models: Vec<Modal> = training
        .iter()
        .map(|d| d.fit(&[], Effort::Coarse))
        .collect::<Result<_, _>>()?;
    let error = |models: &[Modal]| -> f64 {
        let each = models.iter().zip(&folds).flat_map(|(model, fold)| {
            fold.iter()
                .map(|i| frf::prediction_error(&model.response, &set.blocks[*i], lines.clone()))
        });
        each.sum::<f64>() / set.blocks.len() as f64
    };
    let mut errors = vec![error(&models)];
    let mut since = 0;
    while errors.len() <= most && (since < PATIENCE || options.modes.is_some()) {
        for (model, data) in models.iter_mut().zip(&training) {
            if let Some(next) = grow(data, model, options)? {
                *model = next;
            }
        }
        let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
        let now = error(&models);
        since = if now < 0.99 * least { 0 } else { since + 1 };
        errors.push(now);
    }
    let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let best = errors.iter().position(|e| *e <= SLACK * least).unwrap_or(0);
    match options.modes {
        Some(modes) => Ok((modes, errors)),
        None if best == 0 => Err(Failure::failed(
            "no mode explains data that were held out; check the channels and the band",
        )),
        None => Ok((best, errors)),
    }
}

/// Groups that are left out in turn.
const MOST_GROUPS: usize = 8;

/// Standard uncertainties of σ and ω of each mode by leaving out groups of blocks in turn (B. Efron, The
/// Jackknife, 1982, 3): errors of neighbouring lines need not be independent. From the fit where there
/// are fewer than three blocks.
fn jackknife(
    set: &Set,
    lines: &Range<usize>,
    options: &Options,
    fitted: &Modal,
) -> Result<Vec<[Option<f64>; 2]>, Failure> {
    let from_fit = |k: usize| {
        let std = |i: usize| fitted.fit.as_ref().and_then(|f| f.std[i]);
        [std(2 * k), std(2 * k + 1)]
    };
    let count = set.blocks.len();
    let groups = count.min(MOST_GROUPS);
    if groups < 3 {
        return Ok((0..fitted.poles.len()).map(from_fit).collect());
    }
    let mut each: Vec<Vec<Pole>> = Vec::new();
    for g in 0..groups {
        let out = count * g / groups..count * (g + 1) / groups;
        let part = data(set, lines, options, &|i| !out.contains(&i));
        each.push(part.fit(&fitted.poles, Effort::Coarse)?.poles);
    }
    let spread = |pick: &dyn Fn(&Pole) -> f64, k: usize| {
        let n = groups as f64;
        let mean = each.iter().map(|p| pick(&p[k])).sum::<f64>() / n;
        let sum: f64 = each.iter().map(|p| (pick(&p[k]) - mean).powi(2)).sum();
        Some(((n - 1.0) / n * sum).sqrt())
    };
    Ok((0..fitted.poles.len())
        .map(|k| {
            [
                spread(&|p| p.rate_per_s, k),
                spread(&|p| p.omega_rad_per_s, k),
            ]
        })
        .collect())
}

fn name_modes(outcome: &mut Outcome, fitted: &Modal, spread: &[[Option<f64>; 2]]) {
    let mut by_frequency: Vec<usize> = (0..fitted.poles.len()).collect();
    by_frequency.sort_by(|a, b| {
        fitted.poles[*a]
            .omega_rad_per_s
            .total_cmp(&fitted.poles[*b].omega_rad_per_s)
    });
    let single = by_frequency.len() == 1;
    for (place, k) in by_frequency.into_iter().enumerate() {
        let pole = fitted.poles[k];
        let natural = pole.rate_per_s.hypot(pole.omega_rad_per_s);
        let name = |text: &str| match single {
            true => text.to_owned(),
            false => format!("mode_{}_{text}", place + 1),
        };
        let [rate, omega] = spread[k];
        let at_bound = fitted.fit.as_ref().is_some_and(|f| f.at_bound[2 * k]);
        if at_bound {
            outcome.warn(
                "at-bound",
                format!(
                    "the damping of the mode at {} Hz came out as none at all: the data do not tell it",
                    rounded(natural / TAU, 5)
                ),
            );
        }
        let ratio_std = rate.filter(|_| !at_bound).map(|r| r / natural);
        outcome.found.push(Found::new(
            name("natural_frequency"),
            natural / TAU,
            omega.map(|o| o / TAU),
            "Hz",
        ));
        outcome.found.push(Found::new(
            name("damping_ratio"),
            pole.rate_per_s / natural,
            ratio_std,
            "",
        ));
    }
}

fn output_rms(set: &Set, lines: &Range<usize>) -> f64 {
    let power: f64 = set
        .blocks
        .iter()
        .map(|b| {
            b.measured[lines.clone()]
                .iter()
                .map(|y| y.norm_sqr())
                .sum::<f64>()
        })
        .sum();
    let length = 2.0 * (set.blocks[0].applied.len() as f64 - 1.0);
    (2.0 * power / set.blocks.len() as f64).sqrt() / length
}

/// What the response itself, without a model, leaves of the blocks it is not from.
fn raw_error(outcome: &mut Outcome, set: &Set, lines: &Range<usize>) {
    let folds = folds(set);
    if folds.len() < 2 {
        return;
    }
    let mut sum = 0.0;
    for fold in &folds {
        let others = (0..set.blocks.len())
            .filter(|i| !fold.contains(i))
            .map(|i| &set.blocks[i]);
        let raw = Frf::of(others, Estimator::H1).response[lines.clone()].to_vec();
        sum += fold
            .iter()
            .map(|i| frf::prediction_error(&raw, &set.blocks[*i], lines.clone()))
            .sum::<f64>();
    }
    let percent = 100.0 * sum / set.blocks.len() as f64;
    outcome.comparisons.push(Comparison {
        method: "the measured response itself, without a model, on data held out".to_owned(),
        found: vec![Found::new("held_out_error", percent, None, "%")],
        quality: None,
    });
}

/// Difference of responses between records that is said.
const DIFFERENT: f64 = 0.1;

/// Compares the responses of records at different levels: a linear stand has one.
fn levels(outcome: &mut Outcome, set: &Set, lines: &Range<usize>) {
    let records: Vec<usize> = {
        let mut all = set.record.clone();
        all.dedup();
        all
    };
    let of = |r: usize| {
        Frf::of(
            set.blocks
                .iter()
                .zip(&set.record)
                .filter(|(_, q)| **q == r)
                .map(|(b, _)| b),
            Estimator::H1,
        )
    };
    let Some(first) = records.first().map(|r| of(*r)) else {
        return;
    };
    for r in &records[1..] {
        let other = of(*r);
        let level = |f: &Frf| f.applied_power[lines.clone()].iter().sum::<f64>().sqrt();
        let ratio = level(&other) / level(&first);
        if (0.7..1.4).contains(&ratio) {
            continue;
        }
        let (mut change, mut all) = (0.0, 0.0);
        for k in lines.clone() {
            change += (other.response[k] - first.response[k]).norm_sqr() * first.applied_power[k];
            all += first.response[k].norm_sqr() * first.applied_power[k];
        }
        let change = (change / all).sqrt();
        if change > DIFFERENT {
            outcome.warn(
                "level-dependent",
                format!(
                    "at {} times the level of the first record the response differs by {} %: the stand is not \
                     linear, or the noise is large",
                    rounded(ratio, 3),
                    rounded(100.0 * change, 2)
                ),
            );
        }
    }
}

/// Response with its bounds and the model, phase, coherence, and the error against the number of modes.
fn draw(
    outcome: &mut Outcome,
    h1: &Frf,
    lines: &Range<usize>,
    step_hz: f64,
    fitted: &Modal,
    held_out: &[f64],
) {
    let hz: Vec<f64> = lines.clone().map(|k| k as f64 * step_hz).collect();
    let of = |values: &[num_complex::Complex64], f: fn(&num_complex::Complex64) -> f64| {
        values.iter().map(f).collect::<Vec<f64>>()
    };
    let part = &h1.response[lines.clone()];
    let size = |c: &num_complex::Complex64| c.norm();
    let turn = |c: &num_complex::Complex64| c.arg().to_degrees();
    let pair = |f: fn(&num_complex::Complex64) -> f64| {
        vec![
            Series::line("H1", &hz, &of(part, f)),
            Series::line("model", &hz, &of(&fitted.response, f)),
        ]
    };
    let mut magnitude = Chart::new(
        "Response",
        "frequency, Hz",
        "measured over applied",
        pair(size),
    );
    magnitude.y_log = true;
    // Twice the standard uncertainty to both sides.
    magnitude.band = lines
        .clone()
        .filter_map(|k| {
            let (middle, std) = (h1.response[k].norm(), 2.0 * h1.relative_std(k)?);
            (std < 1.0).then_some({
                (
                    k as f64 * step_hz,
                    middle * (1.0 - std),
                    middle * (1.0 + std),
                )
            })
        })
        .collect();
    outcome.charts.push(magnitude);
    outcome
        .charts
        .push(Chart::new("Phase", "frequency, Hz", "degrees", pair(turn)));
    let coherence = vec![Series::line("coherence", &hz, &h1.coherence[lines.clone()])];
    outcome
        .charts
        .push(Chart::new("Coherence", "frequency, Hz", "", coherence));
    let counts: Vec<f64> = (0..held_out.len()).map(|n| n as f64).collect();
    let percent: Vec<f64> = held_out.iter().map(|e| 100.0 * e).collect();
    let error = vec![Series::dots("on data held out", &counts, &percent)];
    outcome.charts.push(Chart::new(
        "Error and number of modes",
        "modes",
        "per cent",
        error,
    ));
}
