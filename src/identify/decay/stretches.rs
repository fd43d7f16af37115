//! Records cut into stretches of free ringing, decimated where they have more samples than needed.

use std::borrow::Cow;
use std::ops::Range;

use torqcomp_dsp::quality::clipping::Clipping;
use torqcomp_dsp::{decimate, onset, peaks};

use super::modes::Stretch;
use super::{DecayOptions, Ringing, present, restart};
use crate::failure::{ErrorCode, Failure};
use crate::identify::Identification;
use crate::identify::hum::{SteadyLine, without_mains};
use crate::print::short;

/// Most samples that are fitted, of all stretches together.
const MOST_SAMPLES: usize = 20_000;

/// Most stretches that are used.
const MOST_STRETCHES: usize = 12;

/// Power of the weakest line that decimation must keep, over that of the strongest.
const WORTH: f64 = 1e-6;

/// Fewest samples of a record.
const LEAST_SAMPLES: usize = 40;

/// Cuts all records into stretches of free ringing and decimates them where nothing is lost; with the lines of the mains that
/// were taken off.
pub(super) fn stretches(
    records: &[Ringing],
    options: &DecayOptions,
    result: &mut Identification,
) -> Result<(Vec<Stretch>, Vec<SteadyLine>), Failure> {
    let mut lines = Vec::new();
    let cut = cut(records, options, (result, &mut lines))?;
    let total: usize = cut.iter().map(|(stretch, _)| stretch.values.len()).sum();
    let mut all = Vec::new();
    for (stretch, rate_hz) in cut {
        let share = MOST_SAMPLES * stretch.values.len() / total;
        let factor = match (rate_hz, options.band_hz) {
            (Some(rate), None) => factor(&stretch.values, rate, share),
            _ => 1,
        };
        if factor > 1 {
            result.method.push(format!(
                "decimated to one sample in {factor}: there are no modes above {} Hz",
                short(decimate::PASS * rate_hz.unwrap_or(0.0) / factor as f64)
            ));
        }
        all.push(decimated(&stretch, factor)?);
    }
    result.method.dedup();
    Ok((all, lines))
}

/// All stretches as recorded, with the sampling rate of their record.
fn cut(
    records: &[Ringing],
    options: &DecayOptions,
    (result, lines): (&mut Identification, &mut Vec<SteadyLine>),
) -> Result<Vec<(Stretch, Option<f64>)>, Failure> {
    let mut cuts = Cuts::default();
    for record in records {
        check(record)?;
        let clipped_s = clipped_times(record);
        let (values, of_mains) = without_mains(record.values, record.rate_hz);
        lines.extend(of_mains);
        let record = &Ringing {
            values: &values,
            ..*record
        };
        let [times, values] = prepared(record, options, result)?;
        for range in onset::decays(&values) {
            cuts.add(&times, &values, range, (&clipped_s, record.rate_hz));
        }
    }
    cuts.describe(result)?;
    Ok(cuts.stretches)
}

/// The stretches that are fitted, and what is left out of the decays.
#[derive(Default)]
struct Cuts {
    /// With the sampling rate of their record.
    stretches: Vec<(Stretch, Option<f64>)>,
    found: usize,
    /// Samples of noise behind the ringing.
    left_out: usize,
    /// Samples up to the last clipped one.
    left_clipped: usize,
    /// Times at which a decay starts again.
    restarts_s: Vec<f64>,
}

impl Cuts {
    /// Adds the stretches of a decay; `clipped_s` are the times of the clipped samples of its record.
    fn add(
        &mut self,
        times: &[f64],
        values: &[f64],
        range: Range<usize>,
        (clipped_s, rate_hz): (&[f64], Option<f64>),
    ) {
        let clipped = clipped_at_start(clipped_s, &times[range.clone()]);
        if clipped > 0 && range.len() < clipped + LEAST_SAMPLES {
            self.left_clipped += range.len();
            return;
        }
        self.left_clipped += clipped;
        let range = range.start + clipped..range.end;
        let rings = ringing(values, &range);
        self.left_out += range.end - rings.end;
        for part in parts(values, &rings, rate_hz.is_some()) {
            if part.start > rings.start {
                self.restarts_s.push(times[part.start]);
            }
            self.found += 1;
            if self.found <= MOST_STRETCHES {
                let stretch = Stretch::new(&times[part.clone()], values[part].to_vec());
                self.stretches.push((stretch, rate_hz));
            }
        }
    }

    /// Says what was left out.
    fn describe(&self, result: &mut Identification) -> Result<(), Failure> {
        let (left_clipped, left_out, found) = (self.left_clipped, self.left_out, self.found);
        present::restarts(result, &self.restarts_s);
        if left_clipped > 0 {
            result.method.push(format!(
                "each decay is fitted from its last clipped sample on; {left_clipped} samples before that are left out"
            ));
        }
        if left_out > 0 {
            result.method.push(format!(
                "each decay is fitted up to twice the time after which its ringing is lost in the noise; {left_out} samples \
                 of noise behind that are left out"
            ));
        }
        if self.stretches.is_empty() {
            return Err(Failure::failed(
                ErrorCode::NotIdentifiable,
                if left_clipped > 0 {
                    "no free decay is left behind the last clipped sample; record with a larger range"
                } else {
                    "no free decay found; try another channel or --range"
                },
            ));
        }
        if found > MOST_STRETCHES {
            result.warn(
                "decays-left-out",
                format!("only the first {MOST_STRETCHES} of {found} decays are used"),
            );
        }
        Ok(())
    }
}

/// A stretch cut where it starts again, if its samples are uniform.
fn parts(values: &[f64], rings: &Range<usize>, is_uniform: bool) -> Vec<Range<usize>> {
    if !is_uniform {
        return std::iter::once(rings.clone()).collect();
    }
    let parts = restart::parts(&values[rings.clone()], LEAST_SAMPLES);
    let within = |part: Range<usize>| rings.start + part.start..rings.start + part.end;
    parts.into_iter().map(within).collect()
}

/// Times of the samples that the recorder cut off.
fn clipped_times(record: &Ringing) -> Vec<f64> {
    let Some(found) = Clipping::of(record.values) else {
        return Vec::new();
    };
    let samples = record.times_s.iter().zip(record.values);
    let clipped = samples.filter(|(_, value)| found.holds(**value));
    clipped.map(|(time_s, _)| *time_s).collect()
}

/// Samples of a decay up to its last one that is cut off.
fn clipped_at_start(clipped_s: &[f64], times_s: &[f64]) -> usize {
    let Some(end_s) = times_s.last() else {
        return 0;
    };
    let last = clipped_s[..clipped_s.partition_point(|t| t <= end_s)].last();
    last.map_or(0, |last| times_s.partition_point(|t| t <= last))
}

/// The part of a long stretch that rings, and as much noise behind it.
fn ringing(values: &[f64], range: &Range<usize>) -> Range<usize> {
    let kept = match range.len() > MOST_SAMPLES {
        true => onset::until_noise(&values[range.clone()]),
        false => range.len(),
    };
    range.start..range.start + kept
}

/// Refuses a record that is too short or has holes.
fn check(record: &Ringing) -> Result<(), Failure> {
    if let Some(i) = record.values.iter().position(|v| !v.is_finite()) {
        return Err(Failure::failed(
            ErrorCode::InvalidSample,
            format_args!(
                "sample {} is not a finite number; exclude it with --range",
                i + 1
            ),
        )
        .at(record.name));
    }
    if record.values.len() < LEAST_SAMPLES {
        return Err(Failure::failed(
            ErrorCode::TooFewSamples,
            format_args!(
                "{} samples are too few for a decay; at least {LEAST_SAMPLES} are needed",
                record.values.len()
            ),
        )
        .at(record.name));
    }
    Ok(())
}

/// Times and samples, low-passed and decimated if a band is given.
fn prepared<'a>(
    record: &Ringing<'a>,
    options: &DecayOptions,
    result: &mut Identification,
) -> Result<[Cow<'a, [f64]>; 2], Failure> {
    let (times, values) = (record.times_s, record.values);
    let (Some((_, highest)), Some(rate_hz)) = (options.band_hz, record.rate_hz) else {
        return Ok([times.into(), values.into()]);
    };
    let factor = band_factor(rate_hz, highest);
    if factor > 1 {
        result.method.push(format!(
            "low-passed at {} Hz and decimated to one sample in {factor}",
            short(highest)
        ));
    }
    let few = decimate::decimate(values, factor)?;
    let times = times[few.first..].iter().step_by(factor);
    let times = times.take(few.samples.len()).copied();
    Ok([times.collect(), few.samples.into()])
}

/// Decimation factor for a band.
fn band_factor(rate_hz: f64, highest_hz: f64) -> usize {
    ((decimate::PASS * rate_hz / highest_hz).floor() as usize).max(1)
}

/// A stretch with one sample in `factor`.
fn decimated(stretch: &Stretch, factor: usize) -> Result<Stretch, Failure> {
    let few = decimate::decimate(&stretch.values, factor)?;
    let later = stretch.times_s[few.first];
    let kept = stretch.times_s[few.first..].iter().step_by(factor);
    Ok(Stretch {
        start_s: stretch.start_s + later,
        times_s: kept.take(few.samples.len()).map(|t| t - later).collect(),
        values: few.samples,
    })
}

/// Decimation factor that the highest significant line allows, for records with many samples.
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
