//! Records cut into stretches of free ringing, at the rate they need.

use torqcomp_dsp::{decimate, onset, peaks};

use super::modes::Stretch;
use super::{Options, Ringing};
use crate::failure::Failure;
use crate::identify::Outcome;
use crate::print::short;

/// Most samples of all stretches together that are fitted at once.
const MOST_SAMPLES: usize = 20_000;

/// Stretches beyond that number are left out.
const MOST_STRETCHES: usize = 12;

/// Power of a line relative to the strongest from which on it counts when the rate is lowered.
const WORTH: f64 = 1e-6;

/// Fewest samples of a record.
const LEAST_SAMPLES: usize = 40;

/// Cuts all records into stretches of free ringing and lowers their rate where nothing is lost; their starts,
/// and whether a rate was lowered.
pub(super) fn stretches(
    records: &[Ringing],
    options: &Options,
    outcome: &mut Outcome,
) -> Result<(Vec<Stretch>, Vec<f64>, bool), Failure> {
    let cut = cut(records, options, outcome)?;
    let total: usize = cut.iter().map(|(_, stretch, _)| stretch.values.len()).sum();
    let mut all = Vec::new();
    let mut starts = Vec::new();
    let mut slowed = is_low_passed(records, options);
    for (start, stretch, rate_hz) in cut {
        let share = MOST_SAMPLES * stretch.values.len() / total;
        let factor = match (rate_hz, options.band_hz) {
            (Some(rate), None) => factor(&stretch.values, rate, share),
            _ => 1,
        };
        let (later, stretch) = slower(&stretch, factor)?;
        slowed |= factor > 1;
        if factor > 1 {
            outcome.method.push(format!(
                "the rate was lowered to one sample in {factor}: nothing rings above {} Hz",
                short(decimate::PASS * rate_hz.unwrap_or(0.0) / factor as f64)
            ));
        }
        starts.push(start + later);
        all.push(stretch);
    }
    outcome.method.dedup();
    Ok((all, starts, slowed))
}

/// A stretch, its start in s on the record's axis, and the record's rate.
type Cut = (f64, Stretch, Option<f64>);

/// All stretches at the rate they were recorded with.
fn cut(records: &[Ringing], options: &Options, outcome: &mut Outcome) -> Result<Vec<Cut>, Failure> {
    let mut cut = Vec::new();
    for record in records {
        let (times, values) = prepared(record, options, outcome)?;
        for range in onset::decays(&values) {
            let start = times[range.start];
            cut.push((
                start,
                Stretch {
                    times_s: times[range.clone()].iter().map(|t| t - start).collect(),
                    values: values[range].to_vec(),
                },
                record.rate_hz,
            ));
        }
    }
    if cut.is_empty() {
        return Err(Failure::failed(
            "the record does not swing; choose another channel or range",
        ));
    }
    if cut.len() > MOST_STRETCHES {
        outcome.warn(
            "decays-left-out",
            format!(
                "{} decays were found; the first {MOST_STRETCHES} are used",
                cut.len()
            ),
        );
        cut.truncate(MOST_STRETCHES);
    }
    Ok(cut)
}

/// The part of a record that is asked for, low-passed and slower if a band is given.
fn prepared(
    record: &Ringing,
    options: &Options,
    outcome: &mut Outcome,
) -> Result<(Vec<f64>, Vec<f64>), Failure> {
    if let Some(i) = record.values.iter().position(|v| !v.is_finite()) {
        return Err(Failure::failed(format_args!(
            "{}: sample {} is not a number; cut the record there with --range",
            record.name,
            i + 1
        )));
    }
    let (from, to) = options
        .range_s
        .unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
    let first = record.times_s.partition_point(|t| *t < from);
    let last = record.times_s.partition_point(|t| *t <= to);
    if last < first + LEAST_SAMPLES {
        return Err(Failure::failed(format_args!(
            "{}: {} samples are too few for a decay; {LEAST_SAMPLES} are needed",
            record.name,
            last.saturating_sub(first)
        )));
    }
    let whole = Stretch {
        times_s: record.times_s[first..last].to_vec(),
        values: record.values[first..last].to_vec(),
    };
    let (Some((_, highest)), Some(rate_hz)) = (options.band_hz, record.rate_hz) else {
        return Ok((whole.times_s, whole.values));
    };
    let factor = band_factor(rate_hz, highest);
    if factor > 1 {
        outcome.method.push(format!(
            "low-passed above {} Hz, one sample in {factor} kept",
            short(highest)
        ));
    }
    let few = decimate::decimate(&whole.values, factor)?;
    let times = whole.times_s[few.first..].iter().step_by(factor);
    Ok((
        times.take(few.samples.len()).copied().collect(),
        few.samples,
    ))
}

/// How many samples become one for a band.
fn band_factor(rate_hz: f64, highest_hz: f64) -> usize {
    ((decimate::PASS * rate_hz / highest_hz).floor() as usize).max(1)
}

/// Whether the band that is asked for takes a lower rate.
fn is_low_passed(records: &[Ringing], options: &Options) -> bool {
    let Some((_, highest_hz)) = options.band_hz else {
        return false;
    };
    let mut rates = records.iter().filter_map(|r| r.rate_hz);
    rates.any(|rate_hz| band_factor(rate_hz, highest_hz) > 1)
}

/// A stretch at a lower rate, and how much later it starts.
fn slower(stretch: &Stretch, factor: usize) -> Result<(f64, Stretch), Failure> {
    let few = decimate::decimate(&stretch.values, factor)?;
    let later = stretch.times_s[few.first];
    let kept = stretch.times_s[few.first..]
        .iter()
        .step_by(factor)
        .take(few.samples.len());
    Ok((
        later,
        Stretch {
            times_s: kept.map(|t| t - later).collect(),
            values: few.samples,
        },
    ))
}

/// How many samples can become one: as far as the highest line allows, and only where there are many.
fn factor(values: &[f64], rate_hz: f64, enough: usize) -> usize {
    if values.len() <= enough.max(1000) {
        return 1;
    }
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let centred: Vec<f64> = values.iter().map(|v| v - mean).collect();
    let Some(highest) = peaks::highest(&centred, rate_hz, WORTH) else {
        return 1;
    };
    let allowed = (decimate::PASS * rate_hz / highest.max(1e-12)).floor() as usize;
    let needed = values.len().div_ceil(enough.max(1000));
    allowed.min(needed).clamp(1, values.len() / 200)
}
