//! Splitting of records into segments of free decay, decimated if oversampled.

use std::borrow::Cow;
use std::ops::Range;

use torqcomp_dsp::peaks::Line;
use torqcomp_dsp::quality::clipping::Clipping;
use torqcomp_dsp::quality::flat_tops::flat_tops;
use torqcomp_dsp::quality::quantisation::quantisation;
use torqcomp_dsp::undersample::Undersampling;
use torqcomp_dsp::{decimate, onset, peaks};

use super::modes::Stretch;
use super::{DecayOptions, Ringing, present, restart};
use crate::failure::{ErrorCode, Failure};
use crate::identify::Identification;
use crate::identify::hum::{SteadyLine, without_mains};
use crate::print::{plural, short};
use crate::warning::WarningCode;

/// Maximum number of fitted samples, over all segments.
const MOST_SAMPLES: usize = 20_000;

/// Number of samples after decimation above which the segments are undersampled.
const MANY_SAMPLES: usize = 65_536;
/// Minimum length of a segment to be undersampled, in filter half-lengths …
const LEAST_LENGTHS: usize = 16;
/// … and minimum number of samples over which the shortest-lived line is visible: samples before the middle of the
/// filter are lost.
const LEAST_RINGING: usize = 32;
/// Filters tried: half-length in samples of the result, and relative bandwidth kept around a line. Longer filters have
/// narrower edges, so that more bands fit at a lower rate.
const FILTERS: [(usize, f64); 4] = [(32, 0.01), (32, 0.003), (128, 0.01), (128, 0.003)];

/// Maximum number of segments used.
const MOST_STRETCHES: usize = 12;

/// Power of the weakest line that decimation must keep, relative to the strongest.
const WORTH: f64 = 1e-6;

/// Minimum number of samples in a record.
const LEAST_SAMPLES: usize = 40;

/// Splits all records into segments of free decay and decimates them without loss; also returns the removed mains
/// lines.
pub(super) fn stretches(
    records: &[Ringing],
    options: &DecayOptions,
    result: &mut Identification,
) -> Result<(Vec<Stretch>, Vec<SteadyLine>), Failure> {
    let mut lines = Vec::new();
    let (prepared, ranges) = cut(records, options, (result, &mut lines))?;
    let part = |(place, range): &(usize, Range<usize>)| prepared[*place].part(range);
    let cut: Vec<Cutout> = ranges.iter().map(part).collect();
    let total: usize = cut.iter().map(|part| part.values.len()).sum();
    let of_one = |part: &Cutout| {
        let share = MOST_SAMPLES * part.values.len() / total;
        match (part.rate_hz, options.band_hz) {
            (Some(rate), None) => factor(part.values, rate, share),
            _ => 1,
        }
    };
    let factors: Vec<usize> = cut.iter().map(of_one).collect();
    if options.band_hz.is_none()
        && let Some((few, rate_hz)) = undersampling(&cut, &factors)
    {
        let bands = few.bands.iter().map(|band| {
            let [start, end] = [band.start, band.end].map(|place| short(place * rate_hz));
            format!("{start} to {end} Hz")
        });
        result.method.push(format!(
            "filtered to {} and decimated to one sample in {}: no decay outside that band",
            bands.collect::<Vec<_>>().join(", "),
            few.factor
        ));
        let all = cut.iter().map(|part| part.undersampled(&few, rate_hz));
        return Ok((all.collect::<Result<_, _>>()?, lines));
    }
    let mut all = Vec::new();
    for (part, factor) in cut.iter().zip(factors) {
        if factor > 1 {
            result.method.push(format!(
                "decimated to one sample in {factor}: there are no modes above {} Hz",
                short(decimate::PASS * part.rate_hz.unwrap_or(0.0) / factor as f64)
            ));
        }
        all.push(part.decimated(factor)?);
    }
    result.method.dedup();
    Ok((all, lines))
}

/// Undersampling where decimation leaves too many samples, and the rate of the segments. `None` for segments of several
/// rates or too wide bands.
fn undersampling(cut: &[Cutout], factors: &[usize]) -> Option<(Undersampling, f64)> {
    let rate_hz = cut.first()?.rate_hz?;
    let lengths = cut.iter().map(|part| part.values.len());
    let left = lengths
        .clone()
        .zip(factors)
        .map(|(length, factor)| length / factor);
    let is_one = cut.iter().all(|part| part.rate_hz == Some(rate_hz));
    if !is_one || left.sum::<usize>() <= MANY_SAMPLES {
        return None;
    }
    let lines: Vec<Vec<Line>> = cut
        .iter()
        .map(|part| peaks::lines(part.values, WORTH))
        .collect();
    let briefest = lines.iter().filter_map(|lines| peaks::briefest(lines));
    let longest_half =
        (lengths.clone().min()? / LEAST_LENGTHS).min(briefest.min()? / LEAST_RINGING);
    let total: usize = lengths.sum();
    let least = factors.iter().max()? + 1;
    let mut best: Option<Undersampling> = None;
    for (reach, beside) in FILTERS {
        let bands = lines.iter().flatten().map(|line| line.band(beside));
        let most = (total / MOST_SAMPLES).min(longest_half / reach);
        let least = best.as_ref().map_or(least, |best| best.factor + 1);
        best = Undersampling::of(&bands.collect::<Vec<_>>(), least..=most, reach).or(best);
        if best
            .as_ref()
            .is_some_and(|best| total / best.factor <= MANY_SAMPLES)
        {
            break;
        }
    }
    Some((best?, rate_hz))
}

/// A record, low-pass filtered and decimated if a band is given.
struct Prepared<'a> {
    times_s: Cow<'a, [f64]>,
    values: Cow<'a, [f64]>,
    /// Sampling rate of the record.
    rate_hz: Option<f64>,
}

/// A segment of it.
struct Cutout<'a> {
    times_s: &'a [f64],
    values: &'a [f64],
    rate_hz: Option<f64>,
}

impl Prepared<'_> {
    fn part(&self, range: &Range<usize>) -> Cutout<'_> {
        Cutout {
            times_s: &self.times_s[range.clone()],
            values: &self.values[range.clone()],
            rate_hz: self.rate_hz,
        }
    }
}

impl Cutout<'_> {
    /// Every `factor`-th sample.
    fn decimated(&self, factor: usize) -> Result<Stretch, Failure> {
        let few = decimate::decimate(self.values, factor)?;
        let kept = self.times_s[few.first..].iter().step_by(factor).copied();
        let kept: Vec<f64> = kept.take(few.samples.len()).collect();
        Ok(Stretch::new(&kept, few.samples))
    }

    /// Undersampled: fewer than two samples per period.
    fn undersampled(&self, few: &Undersampling, rate_hz: f64) -> Result<Stretch, Failure> {
        let kept = few.apply(self.values)?;
        let time_s = |k: usize| (k * few.factor) as f64 / rate_hz;
        let bands = few.bands.iter();
        Ok(Stretch {
            start_s: self.times_s[kept.first],
            times_s: (0..kept.samples.len()).map(time_s).collect(),
            values: kept.samples,
            bands_hz: bands
                .map(|band| rate_hz * band.start..rate_hz * band.end)
                .collect(),
        })
    }
}

/// The records, and the segments of free decay in them, each with the index of its record.
type Cut<'a> = (Vec<Prepared<'a>>, Vec<(usize, Range<usize>)>);

/// Splits all records.
fn cut<'a>(
    records: &[Ringing<'a>],
    options: &DecayOptions,
    (result, lines): (&mut Identification, &mut Vec<SteadyLine>),
) -> Result<Cut<'a>, Failure> {
    let (mut all, mut cuts) = (Vec::new(), Cuts::default());
    for record in records {
        check(record)?;
        let clipped_s = clipped_times(record, result);
        let (values, of_mains) = without_mains(record.values, record.rate_hz);
        lines.extend(of_mains);
        let prepared = prepared(record, values, options, result)?;
        let step = quantisation(record.values).map_or(0.0, |found| found.step);
        for range in onset::decays(&prepared.values) {
            let range = above_steps(&prepared.values, range, step);
            cuts.add(&prepared, range, (&clipped_s, all.len()));
        }
        all.push(prepared);
    }
    cuts.describe(result)?;
    Ok((all, cuts.stretches))
}

/// The fitted segments, and what is excluded from the decays.
#[derive(Default)]
struct Cuts {
    /// With the index of their record.
    stretches: Vec<(usize, Range<usize>)>,
    found: usize,
    /// Number of samples of noise after the decay.
    left_out: usize,
    /// Number of samples up to the last clipped one.
    left_clipped: usize,
    /// Times at which a decay restarts.
    restarts_s: Vec<f64>,
}

impl Cuts {
    /// Adds the segments of a decay; `clipped_s` are the times of the clipped samples of its record.
    fn add(&mut self, record: &Prepared, range: Range<usize>, (clipped_s, place): (&[f64], usize)) {
        let (times, values) = (&record.times_s, &record.values);
        let clipped = clipped_at_start(clipped_s, &times[range.clone()]);
        if clipped > 0 && range.len() < clipped + LEAST_SAMPLES {
            self.left_clipped += range.len();
            return;
        }
        self.left_clipped += clipped;
        let range = range.start + clipped..range.end;
        let rings = ringing(values, &range, record.rate_hz.is_some());
        self.left_out += range.end - rings.end;
        for part in parts(values, &rings, record.rate_hz.is_some()) {
            if part.start > rings.start {
                self.restarts_s.push(times[part.start]);
            }
            self.found += 1;
            if self.found <= MOST_STRETCHES {
                self.stretches.push((place, part));
            }
        }
    }

    /// Reports what was excluded.
    fn describe(&self, result: &mut Identification) -> Result<(), Failure> {
        let (left_clipped, left_out, found) = (self.left_clipped, self.left_out, self.found);
        result
            .warnings
            .extend(present::restart(&self.restarts_s, OWN_PARTS));
        if left_clipped > 0 {
            result.method.push(format!(
                "each decay is fitted from its last clipped sample on, which excludes {}",
                plural(left_clipped, "sample")
            ));
        }
        if left_out > 0 {
            result.method.push(format!(
                "each decay is fitted up to twice the time at which it falls below the noise, which excludes {} of \
                 noise",
                plural(left_out, "later sample")
            ));
        }
        if self.stretches.is_empty() {
            return Err(ErrorCode::NotIdentifiable.failed(if left_clipped > 0 {
                "no free decay is left after the last clipped sample; record with a larger range"
            } else {
                "no free decay found; try another channel or --range"
            }));
        }
        if found > MOST_STRETCHES {
            result.warn(WarningCode::DecaysLeftOut.warning(format!(
                "only the first {MOST_STRETCHES} of {found} decays are used"
            )));
        }
        Ok(())
    }
}

/// Consequence of a restart where its parts are separate decays.
pub(super) const OWN_PARTS: &str = "the parts before and after are fitted as separate decays; hit once, and keep your hands off \
    the stand";

/// Times at which a decay of a record restarts.
pub(super) fn restarts_s(record: &Ringing) -> Vec<f64> {
    let mut found = Vec::new();
    for range in onset::decays(record.values) {
        let rings = ringing(record.values, &range, record.rate_hz.is_some());
        let parts = parts(record.values, &rings, record.rate_hz.is_some());
        let later = parts.iter().filter(|part| part.start > rings.start);
        found.extend(later.map(|part| record.times_s[part.start]));
    }
    found
}

/// Minimum oscillation in steps of the recorder. Below it, rounding is no longer like noise: values below half a step
/// read as rest, which looks like friction.
const LEAST_STEPS: f64 = 2.0;

/// The part of a decay before the oscillation falls below two steps of the recorder.
fn above_steps(values: &[f64], range: Range<usize>, step: f64) -> Range<usize> {
    let mut sorted = values[range.clone()].to_vec();
    let middle = sorted.len() / 2;
    let (_, zero, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
    let swings = |value: &f64| (value - *zero).abs() > (LEAST_STEPS - 0.5) * step;
    let last = values[range.clone()].iter().rposition(swings);
    match last {
        Some(last) if last + 1 >= LEAST_SAMPLES => range.start..range.start + last + 1,
        _ => range,
    }
}

/// A segment split at its restarts, if its samples are uniform.
fn parts(values: &[f64], rings: &Range<usize>, is_uniform: bool) -> Vec<Range<usize>> {
    if !is_uniform {
        return std::iter::once(rings.clone()).collect();
    }
    let parts = restart::parts(&values[rings.clone()], LEAST_SAMPLES);
    let within = |part: Range<usize>| rings.start + part.start..rings.start + part.end;
    parts.into_iter().map(within).collect()
}

/// Times of the samples clipped by the recorder, or an amplifier before it.
fn clipped_times(record: &Ringing, result: &mut Identification) -> Vec<f64> {
    let of_amplifier = || {
        let found = flat_tops(record.values)?;
        result.warn(WarningCode::Clipped.warning(format!(
            "{}: the first peaks of the decay are flat, as from an amplifier overdriven before its filter: the \
             decay is fitted after them; tap more gently, or use a smaller gain",
            record.name
        )));
        Some(found)
    };
    let Some(found) = Clipping::of(record.values).or_else(of_amplifier) else {
        return Vec::new();
    };
    let samples = record.times_s.iter().zip(record.values);
    let clipped = samples.filter(|(_, value)| found.holds(**value));
    clipped.map(|(time_s, _)| *time_s).collect()
}

/// Number of samples of a decay up to its last clipped one.
fn clipped_at_start(clipped_s: &[f64], times_s: &[f64]) -> usize {
    let Some(end_s) = times_s.last() else {
        return 0;
    };
    let last = clipped_s[..clipped_s.partition_point(|t| t <= end_s)].last();
    last.map_or(0, |last| times_s.partition_point(|t| t <= last))
}

/// The ringing part of a segment; for a long one followed by an equal length of noise.
fn ringing(values: &[f64], range: &Range<usize>, is_uniform: bool) -> Range<usize> {
    let kept = match range.len() > MOST_SAMPLES {
        true => onset::until_noise(&values[range.clone()]),
        false => range.len(),
    };
    let rings = range.start..range.start + kept;
    let lead = match is_uniform {
        true => restart::lead(&values[rings.clone()]),
        false => 0,
    };
    rings.start + lead..rings.end
}

/// Rejects a record that is too short or has gaps.
fn check(record: &Ringing) -> Result<(), Failure> {
    if let Some(i) = record.values.iter().position(|v| !v.is_finite()) {
        return Err(ErrorCode::InvalidSample
            .failed(format_args!(
                "sample {} is not a finite number; exclude it with --range",
                i + 1
            ))
            .at(record.name));
    }
    if record.values.len() < LEAST_SAMPLES {
        return Err(ErrorCode::TooFewSamples
            .failed(format_args!(
                "{} samples are too few for a decay; at least {LEAST_SAMPLES} are needed",
                record.values.len()
            ))
            .at(record.name));
    }
    Ok(())
}

/// A record with these values, low-pass filtered and decimated if a band is given.
fn prepared<'a>(
    record: &Ringing<'a>,
    values: Cow<'a, [f64]>,
    options: &DecayOptions,
    result: &mut Identification,
) -> Result<Prepared<'a>, Failure> {
    let (times, rate_hz) = (record.times_s, record.rate_hz);
    let (Some((_, highest)), Some(rate)) = (options.band_hz, rate_hz) else {
        return Ok(Prepared {
            times_s: times.into(),
            values,
            rate_hz,
        });
    };
    let factor = band_factor(rate, highest);
    if factor > 1 {
        result.method.push(format!(
            "low-passed at {} Hz and decimated to one sample in {factor}",
            short(highest)
        ));
    }
    let few = decimate::decimate(&values, factor)?;
    let times = times[few.first..].iter().step_by(factor);
    let times = times.take(few.samples.len()).copied();
    Ok(Prepared {
        times_s: times.collect(),
        values: few.samples.into(),
        rate_hz,
    })
}

/// Decimation factor for a band.
fn band_factor(rate_hz: f64, highest_hz: f64) -> usize {
    ((decimate::PASS * rate_hz / highest_hz).floor() as usize).max(1)
}

/// Decimation factor permitted by the highest significant line, for records with many samples.
fn factor(values: &[f64], rate_hz: f64, enough: usize) -> usize {
    if values.len() <= enough.max(1000) {
        return 1;
    }
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let centred = peaks::looked_at(values).iter().map(|v| v - mean);
    let centred: Vec<f64> = centred.collect();
    let Some(highest) = peaks::highest(&centred, rate_hz, WORTH) else {
        return 1;
    };
    let allowed = (decimate::PASS * rate_hz / highest.max(1e-12)).floor() as usize;
    let needed = values.len().div_ceil(enough.max(1000));
    allowed.min(needed).clamp(1, values.len() / 200)
}
