//! Channels of one file on a common uniform time axis, for commands that need whole records.

use std::sync::Arc;

use torqcomp_dsp::resample::{Resampled, Resampler};

use super::memory_stream::{check_cells, check_size};
use super::moment::Moment;
use super::stamps::check_resampled;
use super::{Channel, Recording, Selection, TimeAxis, typical_step};
use crate::failure::{ErrorCode, Failure};
use crate::io::{ChannelChoice, Input, Reading};
use crate::print;
use crate::unit::NamedUnit;
use crate::warning::{Warning, WarningCode};

/// Largest difference of the stamps of two channels that count as equal, in steps.
const SAME_STAMP: f64 = 0.05;
/// Largest relative difference of rates that can be resampled.
const SIMILAR: f64 = 0.05;
/// Relative difference of rates that count as equal.
const SAME_RATE: f64 = 1e-6;

/// Channels sampled at the same moments.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AlignedChannels {
    /// Name of the file, for messages.
    pub(crate) source: String,
    /// Sampling rate in Hz.
    pub(crate) rate_hz: f64,
    /// Its standard uncertainty, if it comes from stamps.
    pub(crate) rate_std_hz: Option<f64>,
    /// Time of the first sample.
    pub(crate) start: Moment,
    /// The channels on that axis, in the order requested, in the unit of the file or the given one.
    pub(crate) channels: Vec<Channel>,
    /// Warnings about the file and the alignment of its channels; losses come first.
    pub(crate) warnings: Vec<Warning>,
    /// Whether something in the file was lost.
    pub(crate) is_lossy: bool,
}

impl AlignedChannels {
    /// Reads the selected channels of a file of any format.
    ///
    /// # Errors
    /// If one is missing, has no rate or contains a non-numeric sample, or if they have different time
    /// axes and cannot be aligned.
    pub(crate) fn read(
        input: &Input,
        choices: &[ChannelChoice],
        reading: &Reading,
    ) -> Result<Self, Failure> {
        let recording = Recording::read(input, choices, reading)?;
        let source = recording.source.clone();
        Self::of(recording, choices, reading).map_err(|failure| failure.at(&source))
    }

    /// Converts the channels to the units of the same channels of another record.
    ///
    /// # Errors
    /// If only one of two has a unit, or that of the other is no multiple of it.
    pub(crate) fn convert_to_units_of(&mut self, other: &Self) -> Result<(), Failure> {
        for (channel, other_channel) in self.channels.iter_mut().zip(&other.channels) {
            let units = [&channel.unit, &other_channel.unit];
            let [from, to] = units.map(Option::as_ref);
            let Some(factor) = NamedUnit::factor_between(from, to) else {
                let [unit, other_unit] = [from, to].map(|unit| unit.map_or("no unit", |u| &u.text));
                return Err(ErrorCode::RecordsDiffer.failed(format_args!(
                    "the channel \"{}\" has {unit} in {} and {other_unit} in {}; give its unit with \
                     --applied-unit or --measured-unit, or take the records one by one",
                    channel.name, self.source, other.source
                )));
            };
            if factor != 1.0 {
                channel
                    .samples
                    .iter_mut()
                    .for_each(|value| *value *= factor);
            }
            channel.unit.clone_from(&other_channel.unit);
        }
        Ok(())
    }

    /// The selected channels. Messages are interpolated where their stamps are not uniform or differ; so are the
    /// samples of a text with `--resample`.
    ///
    /// # Errors
    /// See [`AlignedChannels::read`].
    pub(crate) fn of(
        mut recording: Recording,
        choices: &[ChannelChoice],
        reading: &Reading,
    ) -> Result<Self, Failure> {
        let is_text = recording.format != "mcap";
        for (i, choice) in choices.iter().enumerate() {
            let place = if is_text { recording.place(choice)? } else { i };
            recording.fill(place, reading)?;
        }
        let mut warnings = recording.all_warnings();
        let mut chosen = Vec::new();
        for (i, choice) in choices.iter().enumerate() {
            // Only the selected messages were read.
            let place = if is_text { recording.place(choice)? } else { i };
            let selection = recording.select_at(place, choice, reading)?;
            check_cells(selection.channel, reading)?;
            check_finite(&selection)?;
            let of_channel = selection.warnings.iter();
            let more = of_channel.filter(|w| !warnings.contains(w)).cloned();
            warnings.extend(more.collect::<Vec<Warning>>());
            chosen.push((place, selection));
        }
        let (places, chosen): (Vec<usize>, Vec<Selection>) = chosen.into_iter().unzip();
        let Some(first) = chosen.first() else {
            return Err(ErrorCode::MissingArgument.usage("no channel was asked for"));
        };
        let mut aligned = Self {
            source: recording.source.clone(),
            rate_hz: first.rate_hz,
            rate_std_hz: first.rate_std_hz,
            start: first.start,
            channels: Vec::new(),
            warnings,
            is_lossy: recording.lost.is_some(),
        };
        let is_given = reading.rate_hz.is_some() && !reading.resample;
        if is_given || !reading.resample && is_one_axis(&chosen, is_text)? {
            let count = chosen.iter().map(|c| c.channel.samples.len()).min();
            if !is_given {
                chosen[0].channel.check_rounding(chosen[0].rate_hz)?;
                let rounded = chosen[0]
                    .channel
                    .rounded_stamps(&aligned.source, chosen[0].rate_hz);
                aligned.warnings.extend(rounded);
            }
            let empty = chosen
                .iter()
                .map(|c| c.on_axis(TimeAxis::default(), Vec::new()));
            let empty = places.into_iter().zip(empty).collect();
            aligned.channels = filled(&mut recording, empty, count.unwrap_or(0));
        } else {
            aligned.resample(&chosen)?;
        }
        Ok(aligned)
    }

    /// Interpolates all channels on a grid with the step of the first one, over their common time
    /// range.
    fn resample(&mut self, chosen: &[Selection]) -> Result<(), Failure> {
        let stamps: Vec<Arc<Vec<f64>>> = chosen
            .iter()
            .filter_map(|c| {
                c.channel
                    .axis
                    .stamps_after(chosen[0].channel.axis.origin_ns)
            })
            .filter(|stamps| !stamps.is_empty())
            .collect();
        if stamps.len() < chosen.len() {
            return Err(differ(chosen));
        }
        let starts = stamps.iter().map(|t| t[0]);
        let start_s = starts.fold(f64::NEG_INFINITY, f64::max);
        let ends = stamps.iter().map(|t| t[t.len() - 1]);
        let end_s = ends.fold(f64::INFINITY, f64::min);
        let count = ((end_s - start_s) * self.rate_hz + 1e-6).floor() + 1.0;
        if count.is_nan() || count < 2.0 {
            return Err(ErrorCode::RecordsDiffer.failed(format_args!(
                "{} were not recorded at the same time; choose channels of one record",
                names(chosen)
            )));
        }
        let recorded = typical_step(&stamps[0]).map(|step| 1.0 / step);
        check_resampled(self.rate_hz, recorded.unwrap_or(self.rate_hz))?;
        let mut worst = Resampled::default();
        for (c, stamps) in chosen.iter().zip(&stamps) {
            let mut resampler = Resampler::on_grid(1.0 / self.rate_hz, start_s)?;
            let mut samples = Vec::new();
            for (stamp, value) in stamps.iter().zip(&c.channel.samples) {
                resampler.push(*stamp, *value, &mut samples)?;
            }
            note_worst(&mut worst, &resampler.finish(&mut samples));
            samples.truncate(count as usize);
            self.channels.push(c.on_axis(TimeAxis::default(), samples));
        }
        let lengths = self.channels.iter().map(|t| t.samples.len());
        let shortest = lengths.min().unwrap_or(0);
        let channels = self.channels.iter_mut();
        channels.for_each(|t| t.samples.truncate(shortest));
        self.start = chosen[0].channel.axis.moment(start_s);
        let whats = match chosen.len() > 1 {
            true => ["were", "are not uniform or not the same"],
            false => ["was", "are not uniform"],
        };
        let axis = (self.rate_hz, self.start);
        let warning = resampled(&names(chosen), whats, axis, &worst);
        self.warnings.push(warning);
        Ok(())
    }
}

/// Reports that channels were interpolated, with the reason, the rate, the start and any problems.
pub(crate) fn resampled(
    names: &str,
    [were, stamps_are]: [&str; 2],
    (rate_hz, start): (f64, Moment),
    done: &Resampled,
) -> Warning {
    let mut message = format!(
        "{names} {were} interpolated to {} Hz from {} on, because the time stamps {stamps_are} (jitter up to {} % of a step)",
        print::short(rate_hz),
        start.short(),
        print::rounded(100.0 * done.largest_jitter, 2),
    );
    if done.gaps > 0 {
        message += &format!(
            "; filled by linear interpolation: {}, the longest of {} s; do not trust results there",
            print::plural(done.gaps, "gap"),
            print::rounded(done.longest_step_s, 4)
        );
    }
    if done.uneven > 0 {
        message += &format!(
            "; interpolated by straight lines, as the stamps there nearly coincide: {}",
            print::plural(done.uneven, "sample")
        );
    }
    if done.repeated > 0 {
        message += &format!(
            "; left out: {}",
            print::plural(done.repeated, "repeated stamp")
        );
    }
    WarningCode::Resampled.warning(message)
}

/// Keeps the worst problems of resampling.
fn note_worst(worst: &mut Resampled, done: &Resampled) {
    worst.gaps = worst.gaps.max(done.gaps);
    worst.uneven = worst.uneven.max(done.uneven);
    worst.repeated = worst.repeated.max(done.repeated);
    worst.longest_step_s = worst.longest_step_s.max(done.longest_step_s);
    worst.largest_jitter = worst.largest_jitter.max(done.largest_jitter);
}

impl Selection<'_> {
    /// The channel with these samples on another axis, in the unit of the selection.
    pub(super) fn on_axis(&self, axis: TimeAxis, samples: Vec<f64>) -> Channel {
        Channel {
            name: self.channel.name.clone(),
            heading: self.channel.heading.clone(),
            samples,
            unit: self.unit.clone(),
            unit_text: self.channel.unit_text.clone(),
            is_compensated: self.channel.is_compensated,
            axis,
            ..Channel::default()
        }
    }
}

/// The channels with their first samples, which are moved out of the recording, as they may be most of
/// it.
fn filled(recording: &mut Recording, empty: Vec<(usize, Channel)>, count: usize) -> Vec<Channel> {
    let places: Vec<usize> = empty.iter().map(|(place, _)| *place).collect();
    let fill = |(i, (place, channel)): (usize, (usize, Channel))| {
        let samples = &mut recording.channels[place].samples;
        let mut samples = match places[i + 1..].contains(&place) {
            true => samples.clone(),
            false => std::mem::take(samples),
        };
        samples.truncate(count);
        Channel { samples, ..channel }
    };
    empty.into_iter().enumerate().map(fill).collect()
}

/// Rejects non-finite samples.
fn check_finite(selection: &Selection) -> Result<(), Failure> {
    let channel = selection.channel;
    match channel.samples.iter().position(|v| !v.is_finite()) {
        None => check_size(channel),
        Some(place) => Err(ErrorCode::InvalidSample.failed(format_args!(
            "sample {} of \"{}\" is not a finite number; repair it or cut the record there",
            place + 1,
            channel.name
        ))),
    }
}

/// Whether all channels are sampled at the same, uniformly spaced moments. Common stamps of a text must be
/// uniform, and so must those of a single message channel.
///
/// # Errors
/// If their rates differ too much to be aligned, or their time axis is unknown.
fn is_one_axis(chosen: &[Selection], is_text: bool) -> Result<bool, Failure> {
    let first = &chosen[0];
    let stamps = |c: &Selection| c.channel.axis.stamps_after(first.channel.axis.origin_ns);
    let mut same = true;
    for other in &chosen[1..] {
        let rates = other.rate_hz / first.rate_hz - 1.0;
        if rates.abs() > SIMILAR {
            return Err(differ(chosen));
        }
        same &= match (stamps(first), stamps(other)) {
            (Some(a), Some(b)) => Arc::ptr_eq(&a, &b) || is_same(&a, &b, first.rate_hz),
            (None, None) => {
                let apart_s = (other.start.seconds() - first.start.seconds()).abs();
                if rates.abs() > SAME_RATE || apart_s * first.rate_hz > SAME_STAMP {
                    return Err(differ(chosen));
                }
                true
            }
            _ => return Err(differ(chosen)),
        };
    }
    let irregular = first.channel.irregular(first.rate_hz);
    match irregular.filter(|_| same && (is_text || chosen.len() == 1)) {
        Some(why) => Err(why),
        None => Ok(same && first.channel.irregular(first.rate_hz).is_none()),
    }
}

/// Whether stamps are practically equal over their common length.
fn is_same(a: &[f64], b: &[f64], rate_hz: f64) -> bool {
    a.iter()
        .zip(b)
        .all(|(a, b)| ((a - b) * rate_hz).abs() < SAME_STAMP)
}

fn names(chosen: &[Selection]) -> String {
    let names = chosen.iter().map(|c| format!("\"{}\"", c.channel.name));
    print::list(names)
}

fn differ(chosen: &[Selection]) -> Failure {
    let one = |c: &Selection| {
        format!(
            "\"{}\" is sampled at {} Hz, starting at {}",
            c.channel.name,
            print::short(c.rate_hz),
            c.start.short()
        )
    };
    let all: Vec<String> = chosen.iter().map(one).collect();
    ErrorCode::RecordsDiffer.failed(format_args!(
        "the channels do not lie on one time axis: {}; record them at one rate, or bring one to the rate \
         of the other with torqcomp extract --resample --rate HZ first",
        all.join(", ")
    ))
}

#[cfg(test)]
#[path = "aligned_tests.rs"]
mod tests;
