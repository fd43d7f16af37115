//! Channels of one file on one uniform time axis, for the verbs that need records as a whole.

use std::sync::Arc;

use torqcomp_dsp::resample::{Resampled, Resampler};

use crate::failure::Failure;
use crate::io::Input;
use crate::io::csv::{NamedUnit, Options};
use crate::print::{self};
use crate::recording::{self, Recording, Selection};
use crate::warning::Warning;

/// Largest distance of stamps from a uniform grid, or from those of another channel, that is none, in
/// steps.
const JITTER: f64 = 0.05;
/// The same for each step of the record: the rounding of the rate.
const DRIFT: f64 = 1e-6;
/// Distance, in steps, from which a grid is not that of the stamps any more.
const HALF: f64 = 0.5;
/// Largest relative difference of rates that resampling may bridge.
const SIMILAR: f64 = 0.05;
/// Relative difference of rates that is none.
const SAME_RATE: f64 = 1e-6;

/// A channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Its name.
    pub name: String,
    /// Its samples, in the unit of the file.
    pub samples: Vec<f64>,
    /// That unit, if it is known.
    pub unit: Option<NamedUnit>,
}

/// Channels with a sample each at every moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Together {
    /// Name of the file, for people.
    pub source: String,
    /// Samples a second.
    pub rate_hz: f64,
    /// Time of the first sample, in seconds.
    pub start_s: f64,
    /// The channels, in the order in which they were asked for.
    pub tracks: Vec<Track>,
    /// What should be known of the file and of how its channels were brought together.
    pub warnings: Vec<Warning>,
    /// What was lost of the file, if anything.
    pub lost: Option<Warning>,
}

impl Together {
    /// Reads the channels that the options name, out of a file of any format.
    ///
    /// # Errors
    /// If one is not there, has no rate or holds no number somewhere, or if they do not lie on one time
    /// axis and cannot be brought there.
    pub fn read(place: &Input, wanted: &[Options]) -> Result<Self, Failure> {
        let recording = recording::read_channels(place, wanted)?;
        let source = recording.source.clone();
        Self::of(recording, wanted).map_err(|failure| failure.at(&source))
    }

    /// The channels that the options name.
    ///
    /// # Errors
    /// See [`Together::read`].
    pub fn of(mut recording: Recording, wanted: &[Options]) -> Result<Self, Failure> {
        let mut chosen = Vec::new();
        for options in wanted {
            let selection = recording.select(options)?;
            whole(&selection)?;
            chosen.push(selection);
        }
        let Some(first) = chosen.first() else {
            return Err(Failure::usage("no channel was asked for"));
        };
        let is_given = wanted.iter().any(|options| options.rate_hz.is_some());
        let mut together = Self {
            source: recording.source.clone(),
            rate_hz: first.rate_hz,
            start_s: first.start_s,
            tracks: Vec::new(),
            warnings: recording.warnings.clone(),
            lost: recording.lost.clone(),
        };
        let is_text = recording.format != "mcap";
        if is_given || is_one_axis(&chosen, is_text)? {
            if let Some(failure) = axes(&chosen).filter(|_| !is_given).find_map(irregular) {
                return Err(failure);
            }
            let count = chosen.iter().map(|c| c.samples.len()).min().unwrap_or(0);
            let empty: Vec<(usize, Track)> = chosen
                .iter()
                .map(|c| (recording.place_of(c.channel), track(c, Vec::new())))
                .collect();
            together.tracks = filled(&mut recording, empty, count);
        } else {
            together.resample(&chosen)?;
        }
        Ok(together)
    }

    /// Interpolates all channels on a grid with the step of the first one, over the time that all have.
    fn resample(&mut self, chosen: &[Selection]) -> Result<(), Failure> {
        let stamps: Vec<Arc<Vec<f64>>> = chosen
            .iter()
            .filter_map(|c| c.channel.axis.stamps_s.clone())
            .filter(|stamps| !stamps.is_empty())
            .collect();
        if stamps.len() < chosen.len() {
            return Err(differ(chosen));
        }
        let start_s = stamps
            .iter()
            .map(|t| t[0])
            .fold(f64::NEG_INFINITY, f64::max);
        let end_s = stamps
            .iter()
            .map(|t| t[t.len() - 1])
            .fold(f64::INFINITY, f64::min);
        let count = ((end_s - start_s) * self.rate_hz + 1e-6).floor() + 1.0;
        if count.is_nan() || count < 2.0 {
            return Err(Failure::failed(format_args!(
                "{} were not recorded at the same time; choose channels of one record",
                names(chosen)
            )));
        }
        let mut worst = Resampled::default();
        for (c, stamps) in chosen.iter().zip(&stamps) {
            let mut resampler = Resampler::on_grid(1.0 / self.rate_hz, start_s)?;
            let mut samples = Vec::new();
            for (stamp, value) in stamps.iter().zip(c.samples) {
                resampler.push(*stamp, *value, &mut samples)?;
            }
            note_worst(&mut worst, &resampler.finish(&mut samples));
            samples.truncate(count as usize);
            self.tracks.push(track(c, samples));
        }
        let shortest = self
            .tracks
            .iter()
            .map(|t| t.samples.len())
            .min()
            .unwrap_or(0);
        self.tracks
            .iter_mut()
            .for_each(|t| t.samples.truncate(shortest));
        self.start_s = start_s;
        self.warnings.push(self.resampled(chosen, &worst));
        Ok(())
    }

    fn resampled(&self, chosen: &[Selection], done: &Resampled) -> Warning {
        let several = chosen.len() > 1;
        let mut message = format!(
            "{} {} interpolated to {} Hz from {} s on, because the time stamps {} (jitter up to {} % of a \
             step)",
            names(chosen),
            if several { "were" } else { "was" },
            print::short(self.rate_hz),
            print::short(self.start_s),
            if several {
                "are not uniform or not the same"
            } else {
                "are not uniform"
            },
            print::rounded(100.0 * done.largest_jitter, 2),
        );
        if done.gaps > 0 {
            message += &format!(
                "; {} gap(s), the longest of {} s, were bridged by straight lines: do not trust what is \
                 found from them",
                done.gaps,
                print::rounded(done.longest_step_s, 4)
            );
        }
        if done.repeated > 0 {
            message += &format!("; {} repeated stamp(s) were left out", done.repeated);
        }
        Warning::new("resampled", message)
    }
}

/// Keeps the worst of what resampling met with.
fn note_worst(worst: &mut Resampled, done: &Resampled) {
    worst.gaps = worst.gaps.max(done.gaps);
    worst.repeated = worst.repeated.max(done.repeated);
    worst.longest_step_s = worst.longest_step_s.max(done.longest_step_s);
    worst.largest_jitter = worst.largest_jitter.max(done.largest_jitter);
}

fn track(selection: &Selection, samples: Vec<f64>) -> Track {
    Track {
        name: selection.channel.name.clone(),
        samples,
        unit: selection.unit.clone(),
    }
}

/// Tracks with the first samples of their channels, which are taken out of the recording: they may be most of what
/// it holds.
fn filled(recording: &mut Recording, empty: Vec<(usize, Track)>, count: usize) -> Vec<Track> {
    let places: Vec<usize> = empty.iter().map(|(place, _)| *place).collect();
    let fill = |(i, (place, track)): (usize, (usize, Track))| {
        let samples = &mut recording.channels[place].samples;
        let mut samples = match places[i + 1..].contains(&place) {
            true => samples.clone(),
            false => std::mem::take(samples),
        };
        samples.truncate(count);
        Track { samples, ..track }
    };
    empty.into_iter().enumerate().map(fill).collect()
}

/// Refuses samples that are not there.
fn whole(selection: &Selection) -> Result<(), Failure> {
    let name = &selection.channel.name;
    if let Some(hole) = selection.channel.holes.first() {
        return Err(Failure::failed(format_args!(
            "line {}: the channel \"{name}\" has no number there; remove the line or repair it",
            hole.line
        )));
    }
    match selection.samples.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(place) => Err(Failure::failed(format_args!(
            "sample {} of \"{name}\" is no finite number; repair it or cut the record there",
            place + 1
        ))),
    }
}

/// Whether all channels have their samples at the same moments, a uniform step apart. Stamps in a text
/// are rounded: interpolating between them would make noise out of that, so that of a text only the
/// moments must be the same.
///
/// # Errors
/// If their rates are too different to be brought together, or nothing says how they lie.
fn is_one_axis(chosen: &[Selection], is_text: bool) -> Result<bool, Failure> {
    let first = &chosen[0];
    let stamps = |c: &Selection| c.channel.axis.stamps_s.clone();
    let is_uniform = || stamps(first).is_none_or(|stamps| uniform(&stamps, first.rate_hz));
    let mut same = is_text || is_uniform();
    for other in &chosen[1..] {
        let rates = other.rate_hz / first.rate_hz - 1.0;
        if rates.abs() > SIMILAR {
            return Err(differ(chosen));
        }
        same &= match (stamps(first), stamps(other)) {
            (Some(a), Some(b)) => Arc::ptr_eq(&a, &b) || is_same(&a, &b, first.rate_hz),
            (None, None) => {
                let apart_s = (other.start_s - first.start_s).abs();
                if rates.abs() > SAME_RATE || apart_s * first.rate_hz > JITTER {
                    return Err(differ(chosen));
                }
                true
            }
            _ => return Err(differ(chosen)),
        };
    }
    Ok(same)
}

/// The first channel on each time axis.
pub fn axes<'a, 'b>(chosen: &'b [Selection<'a>]) -> impl Iterator<Item = &'b Selection<'a>> {
    let stamps = |c: &'b Selection<'a>| c.channel.axis.stamps_s.as_ref();
    let is_same = move |a: &'b Selection<'a>, b: &'b Selection<'a>| {
        a.rate_hz == b.rate_hz
            && stamps(a)
                .zip(stamps(b))
                .is_some_and(|(a, b)| Arc::ptr_eq(a, b))
    };
    let is_first = move |(i, c): &(usize, &'b Selection<'a>)| {
        !chosen[..*i].iter().any(|other| is_same(other, c))
    };
    chosen.iter().enumerate().filter(is_first).map(|(_, c)| c)
}

/// Refuses stamps that lie more than half a step from the grid of their rate.
fn irregular(selection: &Selection) -> Option<Failure> {
    let stamps = selection.channel.axis.stamps_s.as_ref()?;
    let first = *stamps.first()?;
    let off = |(i, t): (usize, &f64)| (t - first) * selection.rate_hz - i as f64;
    let is_off = |i: &usize| off((*i, &stamps[*i])).abs() > HALF + DRIFT * *i as f64;
    let place = (0..stamps.len()).find(is_off)?;
    Some(Failure::failed(format_args!(
        "the time stamps of \"{}\" are not uniform: the one at {} s (sample {}) lies {} steps from a grid of {} Hz; cut the \
         record there, give --rate HZ if the stamps are wrong, or bring each channel onto a grid with torqcomp extract \
         --resample",
        selection.channel.name,
        print::short(stamps[place]),
        place + 1,
        print::rounded(off((place, &stamps[place])), 3),
        print::short(selection.rate_hz)
    )))
}

/// Whether stamps are as good as uniform.
#[must_use]
pub fn uniform(stamps_s: &[f64], rate_hz: f64) -> bool {
    let first = stamps_s.first().copied().unwrap_or(0.0);
    stamps_s
        .iter()
        .enumerate()
        // Every stamp is looked at whatever the others were, which several at a time can be.
        .fold(true, |uniform, (i, t)| {
            uniform & (((t - first) * rate_hz - i as f64).abs() < JITTER + DRIFT * i as f64)
        })
}

/// Whether stamps are as good as the same, as far as both go.
fn is_same(a: &[f64], b: &[f64], rate_hz: f64) -> bool {
    a.iter()
        .zip(b)
        .all(|(a, b)| ((a - b) * rate_hz).abs() < JITTER)
}

fn names(chosen: &[Selection]) -> String {
    let names = chosen.iter().map(|c| format!("\"{}\"", c.channel.name));
    crate::io::csv::list(names)
}

fn differ(chosen: &[Selection]) -> Failure {
    let one = |c: &Selection| {
        format!(
            "\"{}\" has {} Hz from {} s on",
            c.channel.name,
            print::short(c.rate_hz),
            print::short(c.start_s)
        )
    };
    let all: Vec<String> = chosen.iter().map(one).collect();
    Failure::failed(format_args!(
        "the channels do not lie on one time axis: {}; record them at one rate, or bring one to the rate \
         of the other with torqcomp extract --resample --rate HZ first",
        all.join(", ")
    ))
}

#[cfg(test)]
#[path = "together_tests.rs"]
mod tests;
