//! `compensate`: a recorded signal in, the torque that acted out.

mod deliver;
mod plot;
mod refined;
mod sink;
mod stream;
mod whole;

use std::path::Path;

use torqcomp_dsp::band::Band;
use torqcomp_dsp::compensate::InverseFilter;
use torqcomp_dsp::noise::NoiseGain;
use torqcomp_dsp::resample;

use self::plot::Traces;
use self::sink::Sink;
use super::{Outcome, conclude, open_plot, uncertainty};
use crate::cli::Compensate;
use crate::failure::Failure;
use crate::io::Input;
use crate::io::output::Output;
use crate::print::{self};
use crate::quality::excerpt;
use crate::report::compensate::{Ends, Gain, Noise, RecordNoise, Report, SCHEMA};
use crate::signal::{Signal, Summary};
use crate::stand::{self, Chain, Stand};
use crate::undo::Undo;
use crate::warning::Warning;

/// The band unless another is asked for, as far as the rate allows: that of the thesis.
const DEFAULT_BAND_HZ: f64 = 2400.0;
/// Frequencies at which the report gives the gain, as fractions of the band.
const GAIN_POINTS: usize = 9;
/// Gain from which a record of unknown noise is worth a warning.
const LARGE_GAIN: f64 = 10.0;
/// Rms above the band over that within it, from which it is worth a warning.
const ABOVE_BAND: f64 = 0.1;
/// Part of the result that may be noise before it is worth a warning.
const NOISY_FRACTION: f64 = 0.5;

/// All that is settled before the first sample is read.
struct Plan {
    signal: Signal,
    stand: Stand,
    chain: Chain,
    filter: InverseFilter,
    /// How effects are taken back that no filter describes, if there are any.
    undo: Option<Undo>,
}

/// What a run found out.
struct Run {
    summary: Summary,
    samples: usize,
    start_s: f64,
    extent: Ends,
    resampled: Option<resample::Resampled>,
    noise: Option<torqcomp_dsp::noise::RecordNoise>,
    /// The first samples, converted, as they were recorded.
    excerpt: Vec<f64>,
    traces: Option<Traces>,
    /// What the way back through effects that no filter describes found.
    refined: Option<refined::Found>,
}

/// Sums and ends of a result.
#[derive(Debug, Clone, Copy)]
struct Extent {
    count: f64,
    sum: f64,
    square: f64,
    smallest: f64,
    largest: f64,
}

impl Extent {
    fn of(values: &[f64]) -> Self {
        // Several sums side by side, so that one need not wait for the other.
        const SIDE_BY_SIDE: usize = 8;
        let (groups, rest) = values.as_chunks::<SIDE_BY_SIDE>();
        let mut parts = [Self::NONE; SIDE_BY_SIDE];
        for group in groups {
            for (part, value) in parts.iter_mut().zip(group) {
                part.take(*value);
            }
        }
        let mut extent = Self::NONE;
        for part in &parts {
            extent.join(part);
        }
        rest.iter().for_each(|value| extent.take(*value));
        extent.count = values.len() as f64;
        extent
    }

    /// Of no value.
    const NONE: Self = Self {
        count: 0.0,
        sum: 0.0,
        square: 0.0,
        smallest: f64::INFINITY,
        largest: f64::NEG_INFINITY,
    };

    #[inline(always)]
    fn take(&mut self, value: f64) {
        self.sum += value;
        self.square += value * value;
        self.smallest = self.smallest.min(value);
        self.largest = self.largest.max(value);
    }

    fn join(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.square += other.square;
        self.smallest = self.smallest.min(other.smallest);
        self.largest = self.largest.max(other.largest);
    }

    /// In printed units.
    fn scaled(self, scale: f64) -> Ends {
        let mean = self.sum / self.count;
        Ends {
            mean: mean * scale,
            rms: (self.square / self.count - mean * mean).max(0.0).sqrt() * scale.abs(),
            smallest: self.smallest * scale,
            largest: self.largest * scale,
        }
    }
}

/// Runs the verb.
pub fn run(args: &Compensate) -> Result<Outcome, Failure> {
    if args.json && args.result.is_stdout() {
        return Err(Failure::usage(
            "--json and the samples both want standard output; give the samples a file with -o",
        ));
    }
    let plan = plan(args)?;
    let input = Path::new(&args.record.input);
    let inputs = [input, args.stand.as_path()];
    let output = args.result.open(&inputs)?;
    let plot = open_plot(args.plot.as_deref(), &args.result, &inputs)?;
    let mut report = describe(args, &plan, output.name());
    let mut sink = Sink::open(args, &plan, output)?;
    report.output_signal = sink.describe();
    let unit = plan.chain.applied.unit.clone();
    let scale = 1.0 / plan.chain.applied.factor;
    let run = if plan.undo.is_some() {
        refined::run(args, plan, &mut sink)?
    } else if args.whole_record {
        whole::run(args, plan, &mut sink)?
    } else {
        stream::run(args, plan, &mut sink)?
    };
    complete(&mut report, &run, scale);
    // Whatever can fail comes before the first file takes its name.
    let mut plot = plot;
    if let (Some(plot), Some(traces)) = (&mut plot, &run.traces) {
        plot.write(traces.svg(&unit).as_bytes())?;
    }
    if args.json {
        crate::io::output::write_all(None, false, &[], &print::json(&report))?;
    }
    sink.finish(args, &report)?;
    plot.map_or(Ok(()), Output::finish)?;
    if !args.work.quiet {
        print::say(&report.text());
    }
    Ok(conclude(
        &report.warnings,
        run.summary.lost.is_some(),
        args.strict,
    ))
}

fn plan(args: &Compensate) -> Result<Plan, Failure> {
    let stand = stand::read(&args.stand)?;
    stand.mechanics()?;
    let place = Input::of(&args.record.input);
    let signal = Signal::open(&place, &args.record.options())?;
    let chain = stand.chain(
        &signal.channel.name,
        signal.channel.unit.as_ref(),
        args.units.into(),
    )?;
    let band = match args.band {
        Some(band_hz) => Band::new(signal.time.rate_hz, band_hz),
        None => Band::fitting(signal.time.rate_hz, DEFAULT_BAND_HZ),
    }
    .map_err(|error| Failure::failed(error).at(&signal.source))?;
    let (filter, undo) = if stand.is_a_response() {
        (InverseFilter::design(stand.inverse()?, band)?, None)
    } else {
        let undo = Undo::new(&stand, band)?;
        (undo.filter().clone(), Some(undo))
    };
    Ok(Plan {
        signal,
        stand,
        chain,
        filter,
        undo,
    })
}

/// First line of the result.
fn heading(chain: &Chain, with_recorded: bool) -> String {
    let applied = chain.applied.heading();
    if with_recorded {
        format!("time_s,{applied},recorded_{applied}\n")
    } else {
        format!("time_s,{applied}\n")
    }
}

/// The report as far as it is known before the run.
fn describe(args: &Compensate, plan: &Plan, output: &str) -> Report {
    let Plan {
        signal,
        stand,
        chain,
        filter,
        undo,
    } = plan;
    let band = filter.band();
    let gain = NoiseGain::of(filter, GAIN_POINTS);
    Report {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        input: signal.source.clone(),
        dialect: signal.dialect.clone(),
        channel: signal.channel.name.clone(),
        channel_unit: signal
            .channel
            .unit
            .as_ref()
            .map_or_else(String::new, |u| u.text.clone()),
        stand: stand.file.clone(),
        output: output.to_owned(),
        output_signal: None,
        unit: chain.applied.unit.clone(),
        calibration: chain.described.clone(),
        samples: 0,
        rate_hz: signal.time.rate_hz,
        rate_from: signal.time.rate_from(),
        start_s: 0.0,
        method: match undo {
            Some(_) => "refined",
            None if args.whole_record => "whole-record",
            None => "stream",
        },
        effects: refined::effects(stand, undo.as_ref()),
        seen_to_hz: None,
        lost: Vec::new(),
        lines: Vec::new(),
        band_hz: band.top_hz(),
        band_end_hz: band.end_hz(),
        edge_s: filter.half_length() as f64 / band.sample_rate_hz(),
        resampled: None,
        result: Ends::default(),
        noise: Noise {
            white_gain: gain.white,
            largest_gain: gain.largest.0,
            largest_gain_at_hz: gain.largest.1,
            gain: gain
                .curve
                .iter()
                .map(|&(frequency_hz, gain)| Gain {
                    frequency_hz,
                    gain,
                    relative_std: uncertainty(stand, chain, frequency_hz)
                        .map(|u| u.magnitude_relative),
                })
                .collect(),
            record: None,
        },
        warnings: Vec::new(),
    }
}

/// Fills in what the run found.
fn complete(report: &mut Report, run: &Run, scale: f64) {
    report.samples = run.samples;
    report.result = run.extent.clone();
    report.start_s = run.start_s;
    report.resampled.clone_from(&run.resampled);
    report.noise.record = run.noise.as_ref().map(|noise| RecordNoise {
        floor_per_root_hz: noise.floor_density.sqrt(),
        floor_band_hz: [noise.floor_from_hz, noise.floor_to_hz],
        recorded_rms: noise.recorded_rms,
        compensated_rms: noise.compensated_rms,
        in_band_rms: noise.in_band_rms,
        above_band_rms: noise.above_band_rms,
        lost_hz: noise.lost.iter().map(|(from, to)| [*from, *to]).collect(),
    });
    if let Some(found) = &run.refined {
        refined::complete(report, found);
    }
    let mut warnings = Vec::new();
    warnings.extend(run.summary.lost.clone());
    warnings.extend(run.summary.warnings.clone());
    if let Some(noise) = &run.noise {
        warnings.extend(noise_warnings(noise, report));
    } else if report.noise.largest_gain > LARGE_GAIN {
        warnings.push(Warning::new(
            "noise-unknown",
            format!(
                "the record is multiplied by up to {} and how much noise it has cannot be told; \
                 choose a lower --band if the result looks noisy",
                print::rounded(report.noise.largest_gain, 3)
            ),
        ));
    }
    report.warnings.extend(warnings);
    let wrong = wrong(report, run, scale);
    report.warnings.extend(wrong);
    if run.traces.as_ref().is_some_and(Traces::is_empty) {
        let end_s = run.start_s + (run.samples - 1) as f64 / report.rate_hz;
        report.warnings.push(Warning::new(
            "empty-plot",
            format!(
                "no sample lies within --plot-range; the record runs from {} to {} s",
                print::short(run.start_s),
                print::short(end_s)
            ),
        ));
    }
    report
        .warnings
        .extend(run.resampled.as_ref().and_then(gap_warning));
    let reach_s = 2.0 * report.edge_s * report.rate_hz;
    if (run.samples as f64) < reach_s {
        report.warnings.push(Warning::new(
            "short-record",
            format!(
                "the record has {} samples, and every one leans on the continuation beyond its \
                 ends; record at least {} for a band of {} Hz",
                run.samples,
                reach_s as usize,
                print::short(report.band_hz)
            ),
        ));
    }
}

/// What is wrong with the record.
fn wrong(report: &Report, run: &Run, scale: f64) -> Vec<Warning> {
    let of = excerpt::Of {
        name: &report.channel,
        unit: &report.unit,
        scale,
        rate_hz: report.rate_hz,
        start_s: run.start_s,
        samples: run.samples,
    };
    let seen = match report.method {
        "stream" => excerpt::of_stream(&run.excerpt, run.samples),
        _ => &run.excerpt,
    };
    excerpt::warnings(seen, of)
}

fn noise_warnings(noise: &torqcomp_dsp::noise::RecordNoise, report: &Report) -> Vec<Warning> {
    let (band_hz, unit, rms) = (report.band_hz, &report.unit, report.result.rms);
    let mut warnings = Vec::new();
    if noise.above_band_rms > ABOVE_BAND * noise.in_band_rms {
        warnings.push(Warning::new(
            "signal-above-band",
            format!(
                "{} {unit} rms of the record lie above the band of {} Hz and are left out, {} {unit} \
                 rms lie within it",
                print::rounded(noise.above_band_rms, 3),
                print::short(band_hz),
                print::rounded(noise.in_band_rms, 3)
            ),
        ));
    }
    if let Some(from_hz) = noise.lost_from_hz(band_hz) {
        let remedy = if from_hz > 0.0 {
            format!("--band {} keeps it out", print::rounded(from_hz, 4))
        } else {
            "the whole band is affected: check the channel".to_owned()
        };
        warnings.push(Warning::new(
            "band-lost-in-noise",
            format!(
                "from {} to {} Hz the record does not rise above its noise, which the compensation \
                 multiplies there; {remedy}",
                print::rounded(from_hz, 4),
                print::short(band_hz)
            ),
        ));
    }
    if rms > 0.0 && noise.compensated_rms > NOISY_FRACTION * rms {
        warnings.push(Warning::new(
            "mostly-noise",
            format!(
                "noise makes up {} of {} {unit} rms of the result; choose a lower --band",
                print::rounded(noise.compensated_rms, 3),
                print::rounded(rms, 3)
            ),
        ));
    }
    warnings
}

fn gap_warning(resampled: &resample::Resampled) -> Option<Warning> {
    (resampled.gaps > 0 || resampled.repeated > 0).then(|| {
        Warning::new(
            "resampled-gaps",
            format!(
                "{} gap(s) in the time stamps were bridged by straight lines ({} samples, the \
                 longest {} s), {} repeated stamp(s) left out",
                resampled.gaps,
                resampled.bridged,
                print::rounded(resampled.longest_step_s, 4),
                resampled.repeated
            ),
        )
    })
}
