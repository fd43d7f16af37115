//! `identify decay`.

use std::path::Path;
use std::sync::Arc;
use torqcomp_dsp::sort_by_number;

use torqcomp_dsp::quality::clipping::Clipping;
use torqcomp_dsp::quality::interpolated::{Interpolated, interpolated};
use torqcomp_dsp::quality::repeats::{Repeats, repeats};

use super::arrivals::{self, EvenTimes};
use super::constants::{Ratios, from_ratios};
use super::{Recorded, deliver};
use crate::cli::identify::Decay;
use crate::commands::Outcome;
use crate::failure::Failure;
use crate::file_name::{self, ShowPath};
use crate::identify::decay::{DecayOptions, Ringing, identify};
use crate::identify::{Identification, ModalPole};
use crate::io::{Input, Reading};
use crate::quality::{self, TimeFindings};
use crate::recording::{AlignedChannels, Channel, Recording, check_cells, is_uniform};
use crate::stand::update::Entry;
use crate::warning::{Warning, WarningCode};

/// A recording of decays.
struct Loaded {
    name: String,
    times_s: Vec<f64>,
    rate_hz: Option<f64>,
    values: Vec<f64>,
    unit: String,
    /// Uniform times replacing time stamps with jitter.
    even: Option<EvenTimes>,
}

/// Runs the test.
pub fn run(args: &Decay) -> Result<Outcome, Failure> {
    let mut recorded = Recorded::default();
    let loaded: Vec<Loaded> = args
        .inputs
        .iter()
        .map(|input| load(args, input, &mut recorded))
        .collect::<Result<_, _>>()?;
    let options = DecayOptions {
        modes: args.modes.map(usize::from),
        band_hz: args.band,
    };
    let mut result = identified(&loaded, &options, &mut recorded)?;
    if let Some(fit) = &mut result.fit {
        fit.unit.clone_from(&loaded[0].unit);
    }
    result.label_charts("signal", &loaded[0].unit);
    let entries = entries(args, &mut result)?;
    deliver(result, recorded, &args.findings, &entries)
}

/// Evaluates the records at their time stamps; if these jitter, at uniform times if the residual is clearly smaller.
fn identified(
    loaded: &[Loaded],
    options: &DecayOptions,
    recorded: &mut Recorded,
) -> Result<Identification, Failure> {
    let at = |ringing: &dyn for<'a> Fn(&'a Loaded) -> Ringing<'a>| {
        let records: Vec<Ringing> = loaded.iter().map(ringing).collect();
        identify(&records, options).map(|(found, _)| found)
    };
    let at_stamps = at(&Loaded::at_stamps);
    let Some(even) = loaded.iter().find_map(|l| l.even.as_ref()) else {
        return at_stamps;
    };
    let found = at(&Loaded::at_even_times).ok();
    let Some(mut found) = found.filter(|found| arrivals::are_arrivals(&at_stamps, found)) else {
        return at_stamps;
    };
    recorded
        .warnings
        .retain(|warning| warning.code != "time-jitter");
    if loaded[0].even.is_some() {
        recorded.rate_hz = Some(even.rate_hz);
        recorded.rate_std_hz = Some(even.rate_std_hz);
    }
    found
        .warnings
        .push(arrivals::warning(&at_stamps, even.rate_hz));
    Ok(found)
}

impl Loaded {
    fn at_stamps(&self) -> Ringing<'_> {
        Ringing {
            name: &self.name,
            times_s: &self.times_s,
            rate_hz: self.rate_hz,
            values: &self.values,
        }
    }

    fn at_even_times(&self) -> Ringing<'_> {
        match &self.even {
            Some(even) => Ringing {
                times_s: &even.times_s,
                rate_hz: Some(even.rate_hz),
                ..self.at_stamps()
            },
            None => self.at_stamps(),
        }
    }
}

/// Reads one recording, without missing samples, as the fit needs no uniform steps.
fn load(args: &Decay, input: &Path, recorded: &mut Recorded) -> Result<Loaded, Failure> {
    let Reading {
        rate_hz, resample, ..
    } = args.reading;
    let choices = std::slice::from_ref(&args.choice);
    let mut recording = Recording::read(&Input::of(input), choices, &args.reading)?;
    let place = recording
        .place(&args.choice)
        .map_err(|f| f.at(input.shown()))?;
    recording.channels[place].must_be_as_recorded(&input.shown().to_string())?;
    if resample {
        let aligned = AlignedChannels::of(recording, choices, &args.reading);
        return Ok(resampled(
            input,
            aligned.map_err(|f| f.at(input.shown()))?,
            recorded,
        ));
    }
    let filled = recording.fill(place, &args.reading);
    filled.map_err(|failure| failure.at(input.shown()))?;
    let selection = recording
        .select(&args.choice, &args.reading)
        .map_err(|failure| failure.at(input.shown()))?;
    check_cells(selection.channel, &args.reading).map_err(|failure| failure.at(input.shown()))?;
    let clock = (selection.start.after_s, selection.rate_hz);
    let rate_std_hz = selection.rate_std_hz;
    let chosen = selection.channel;
    let unit = selection.unit.map_or_else(String::new, |u| u.text);
    let repeats = repeats(&chosen.samples);
    let lines = interpolated(&chosen.samples);
    let faults = faults(chosen, &unit, (repeats, lines));
    let jitter = jitter(chosen, &args.reading);
    let jitters = !jitter.is_empty();
    let warnings = [
        recording.all_warnings(),
        selection.warnings,
        faults,
        quality::coarse_of(std::slice::from_ref(chosen)),
        jitter,
    ];
    let warnings = warnings.concat();
    recorded.warn(warnings, recording.lost.is_some());
    // Frees the other channels before the fit.
    let channel = recording.channels.swap_remove(place);
    drop(recording);
    let record = ringing(channel, clock, rate_hz.is_some());
    let hold = repeats.and_then(|found| found.hold);
    let (times_s, values, rate_hz) = match lines {
        Some(found) => one_in(record, found.every, found.first),
        None => new_values(record, hold),
    };
    recorded.add(input, values.len(), rate_hz.map(|hz| (hz, rate_std_hz)));
    Ok(Loaded {
        name: input.shown().to_string(),
        even: jitters.then(|| EvenTimes::of(&times_s)).flatten(),
        times_s,
        rate_hz,
        values,
        unit,
    })
}

/// Warnings about clipping, and about samples that were held or interpolated.
fn faults(
    channel: &Channel,
    unit: &str,
    (repeats, lines): (Option<Repeats>, Option<Interpolated>),
) -> Vec<Warning> {
    let (name, axis) = (&channel.name, &channel.axis);
    let clipped = Clipping::of(&channel.samples);
    let clipped = clipped.map(|found| quality::clipped_ends(name, unit, &found, axis));
    let held = repeats.and_then(|found| quality::repeats_of(name, &found, axis));
    let lines = lines.map(|found| quality::interpolated_by(name, &found, axis));
    let others = held.into_iter().chain(lines);
    clipped
        .unwrap_or_default()
        .into_iter()
        .chain(others)
        .collect()
}

/// Times and samples of a decay, and its rate if the times are uniform.
type Uniform = (Vec<f64>, Vec<f64>, Option<f64>);

/// The samples that are new, where every value is held for the same number of samples: the images of the staircase look
/// like modes.
fn new_values((times_s, values, rate_hz): Uniform, hold: Option<usize>) -> Uniform {
    let (Some(of_record_hz), Some(hold)) = (rate_hz, hold) else {
        return (times_s, values, rate_hz);
    };
    let mut changes = vec![0_usize; hold];
    for i in (1..values.len()).filter(|i| values[*i] != values[i - 1]) {
        changes[i % hold] += 1;
    }
    let first = (0..hold).max_by_key(|phase| changes[*phase]).unwrap_or(0);
    one_in((times_s, values, Some(of_record_hz)), hold, first)
}

/// Every so many samples from the first of them on: those that were recorded, if the others were interpolated, which makes
/// images of each mode.
fn one_in((times_s, values, rate_hz): Uniform, every: usize, first: usize) -> Uniform {
    let kept = |all: &[f64]| all.iter().skip(first).step_by(every).copied().collect();
    let rate_hz = rate_hz.map(|rate_hz| rate_hz / every as f64);
    (kept(&times_s), kept(&values), rate_hz)
}

/// Times and samples of a channel with a start time and rate, and the rate if the times are uniform; a given rate
/// replaces the time stamps.
fn ringing(channel: Channel, (start_s, rate_hz): (f64, f64), is_given: bool) -> Uniform {
    let samples = channel.samples;
    let stamps = channel.axis.stamps_s.filter(|_| !is_given);
    let is_grid = stamps
        .as_ref()
        .is_none_or(|stamps| is_uniform(stamps, rate_hz));
    // Uniform time stamps are a grid apart from rounding.
    let times_s = match stamps {
        Some(stamps) if !is_grid => Arc::unwrap_or_clone(stamps),
        _ => (0..samples.len())
            .map(|i| start_s + i as f64 / rate_hz)
            .collect(),
    };
    let is_uniform = is_grid && channel.holes.is_empty();
    let (times_s, values) = rising(times_s, samples);
    (times_s, values, is_uniform.then_some(rate_hz))
}

/// A warning about jittering time stamps used as they are: if they are only arrival times of the samples, a single-mode
/// decay appears to have several modes.
fn jitter(channel: &Channel, reading: &Reading) -> Vec<Warning> {
    let axis = &channel.axis;
    let mut found = match reading.rate_hz {
        None => TimeFindings::of(axis).warnings(&channel.name, axis),
        Some(_) => Vec::new(),
    };
    found.retain(|warning| warning.code == "time-jitter");
    found
}

/// The samples that are numbers and later than all previous ones, with their times.
fn rising(stamps: Vec<f64>, samples: Vec<f64>) -> (Vec<f64>, Vec<f64>) {
    let is_rising = stamps.windows(2).all(|pair| pair[0] < pair[1]);
    if is_rising && stamps.len() == samples.len() && samples.iter().all(|v| v.is_finite()) {
        return (stamps, samples);
    }
    let mut last = f64::NEG_INFINITY;
    let pairs = stamps.into_iter().zip(samples);
    let later = pairs.filter(|(t, v)| {
        let later = *t > last && v.is_finite();
        last = if later { *t } else { last };
        later
    });
    later.unzip()
}

/// A recording interpolated to a uniform step.
fn resampled(input: &Path, mut aligned: AlignedChannels, recorded: &mut Recorded) -> Loaded {
    let clipped = [aligned.warnings.clone(), quality::clipped(&aligned)].concat();
    let channel = aligned.channels.swap_remove(0);
    let (start_s, rate_hz) = (aligned.start.after_s, aligned.rate_hz);
    let time_s = |i: usize| start_s + i as f64 / rate_hz;
    recorded.add(
        input,
        channel.samples.len(),
        Some((rate_hz, aligned.rate_std_hz)),
    );
    recorded.warn(clipped, aligned.is_lossy);
    Loaded {
        name: input.shown().to_string(),
        times_s: (0..channel.samples.len()).map(time_s).collect(),
        rate_hz: Some(rate_hz),
        values: channel.samples,
        unit: channel.unit.map_or_else(String::new, |u| u.text),
        even: None,
    }
}

/// Adds the constants from the strongest mode; returns the entries of the stand file.
fn entries(args: &Decay, result: &mut Identification) -> Result<Vec<Entry>, Failure> {
    let several = result.modes.len() > 1 && args.findings.result.output.is_some();
    let mode = (&result.modes[0].clone(), Ratios::OverInertia);
    let source = format!("identify decay: {}", file_name::list(&args.inputs));
    let of_one = from_ratios(&args.anchors, &args.findings, mode, &source, result)?;
    match several {
        true => Ok(vec![modes(result, &source)]),
        false => Ok(of_one),
    }
}

/// Frequency and damping of several modes, by ascending frequency, for a stand file.
fn modes(result: &mut Identification, source: &str) -> Entry {
    result.warn(WarningCode::ResiduesUnknown.warning(NO_RESIDUES));
    let mut all = result.modes.clone();
    sort_by_number(&mut all, |mode| mode.pole().omega_rad_per_s);
    let entries = |mode: &ModalPole| {
        let names = ["natural_frequency", "damping_ratio"];
        let constants = mode.modal_constants().of_mode((0, 1), &names);
        let both = names.into_iter().zip(&constants.list);
        let numbers = both.map(|(key, constant)| Entry::measured("modes", key, &constant.estimate));
        numbers
            .chain([Entry::text("modes", "source", source)])
            .collect()
    };
    Entry::modes(all.iter().map(entries).collect())
}

/// Note on several modes of a decay.
const NO_RESIDUES: &str = "a decay gives frequency and damping of each mode, but not its residue in the response to a \
    torque; residues in the stand file are kept if the number of modes is the same; otherwise add residue to each of \
    [[modes]], or use identify response with a known torque or force. If only the strongest mode is the stand's, and the \
    others belong to a suspension or a hanging weight, say, write it alone: repeat with --modes 1, or with a --band around it";
