//! `compensate`: a recorded signal in, the applied torque out.

mod above;
mod band;
mod memory;
mod page;
mod plot;
mod refined;
mod report;
mod sink;
mod statistics;
mod stream;
mod uncertainty;
mod warnings;

use std::path::Path;

use torqcomp_dsp::compensate::InverseFilter;
use torqcomp_dsp::noise::NoiseGain;
use torqcomp_dsp::quality::streamed::Faults;

use self::band::{BandReport, Wanted};
pub(super) use self::report::CompensateReport;
use self::report::{NoiseAt, NoiseReport};
use self::sink::Sink;
use super::{made, unit_text};
use crate::cli;
use crate::failure::{ErrorCode, Failure};
use crate::identify::Motion;
use crate::inverse::ChainInverse;
use crate::io::{Input, already_compensated};
use crate::outcome::Made;
use crate::print::Report;
use crate::recording::{ChannelStream, StreamSummary};
use crate::stand::{self, Calibration, Stand, TorqueStd};

/// Frequencies at which the report gives the gain, as fractions of the band.
const GAIN_POINTS: usize = 9;
/// Number of frequencies at which the uncertainty is evaluated to find its largest value.
const UNCERTAIN_POINTS: usize = 400;

/// Inputs read before anything is written.
struct Opened {
    stand: Stand,
    stream: ChannelStream,
    chain: Calibration,
}

/// Settings fixed before the first sample is compensated.
struct Plan {
    stream: ChannelStream,
    stand: Stand,
    chain: Calibration,
    filter: InverseFilter,
    /// Its band and the origin of the band.
    band: BandReport,
    /// The inverse of effects that no filter describes, if any.
    undo: Option<ChainInverse>,
}

/// Findings of the reader, and the samples for judging the quality of the record.
struct Seen {
    summary: StreamSummary,
    /// The first samples, converted, as they were recorded.
    excerpt: Vec<f64>,
    /// Results of the checks of all samples.
    faults: Faults,
}

/// Compensates one record.
///
/// # Errors
/// If the work cannot be done.
pub fn work(args: &cli::Compensate) -> Result<Made, Failure> {
    if args.json && args.result.is_stdout() {
        return Err(ErrorCode::ConflictingArguments.usage(
            "--json and the samples both go to standard output; give the samples a file with -o",
        ));
    }
    let opened = Opened::new(args)?;
    let inputs = [args.record.input(), args.stand.as_path()];
    let output = args.result.open(&inputs)?;
    let mut plot = args.result.open_beside(args.plot.as_deref(), &inputs)?;
    let taken: Vec<&Path> = inputs.into_iter().chain(args.plot.as_deref()).collect();
    let mut html = args.result.open_beside(args.html.as_deref(), &taken)?;
    let plan = Plan::new(args, opened)?;
    let mut report = plan.describe(args, output.name());
    let mut sink = Sink::open(args, &plan, output)?;
    report.output_signal = sink.signal();
    let seen = match report.method {
        "stream" => stream::run(args, plan, &mut sink, &mut report)?,
        _ => memory::run(args, plan, &mut sink, &mut report)?,
    };
    report.note_bridged();
    warnings::add(&mut report, &seen, sink.traces());
    if let (Some(plot), Some(traces)) = (&mut plot, sink.traces()) {
        plot.write(traces.svg(&report).as_bytes())?;
    }
    if let (Some(html), Some(page)) = (&mut html, sink.page()) {
        html.write(page.html(&report).as_bytes())?;
    }
    let beside = plot.into_iter().chain(html);
    let outputs = beside.chain([sink.finish(args, &report)?]).collect();
    let is_lossy = seen.summary.lost.is_some();
    Ok(Made {
        document: args.json.then(|| report.document(true)),
        notes: report.text(),
        figures: report.figures(),
        ..made(outputs, report.warnings, is_lossy, &args.strictness)
    })
}

/// A record of speed or acceleration contains no constant torque, and its drift masks slow changes.
fn refuse_derivative(stand: &Stand) -> Result<(), Failure> {
    match stand.mechanics()?.measures {
        Motion::Displacement => Ok(()),
        other => Err(stand.failed(
            ErrorCode::NotInvertible,
            format_args!(
                "[mechanics] measures is {}, which does not show a constant torque, so torque over time cannot be \
                 recovered; use harmonics for the torques at single frequencies, or record displacement, strain or \
                 torque",
                other.name()
            ),
        )),
    }
}

impl Opened {
    fn new(args: &cli::Compensate) -> Result<Self, Failure> {
        let stand = stand::read(&args.stand)?;
        refuse_derivative(&stand)?;
        let record = &args.record;
        stand.refuse_late_start(&record.reading)?;
        let input = Input::of(record.input());
        let stream = ChannelStream::open(&input, &record.choice, &record.reading)?;
        if stream.channel.is_compensated {
            return Err(already_compensated(&stream.source, &stream.channel.name));
        }
        let chain = stand.calibration(stream.channel.recorded(), args.units.into())?;
        Ok(Self {
            stand,
            stream,
            chain,
        })
    }
}

impl Plan {
    fn new(args: &cli::Compensate, opened: Opened) -> Result<Self, Failure> {
        let Opened {
            stand,
            mut stream,
            chain,
        } = opened;
        let is_a_response = stand.chain()?.is_a_response();
        let inverse = match is_a_response {
            true => stand.inverse()?,
            false => ChainInverse::linear(&stand)?,
        };
        let wanted = Wanted {
            option: args.band,
            chain: &chain,
            inverse: &inverse,
        };
        let (band, chosen) = wanted.choose(&mut stream)?;
        let (filter, undo) = if is_a_response {
            (InverseFilter::design(inverse, band)?, None)
        } else {
            let undo = ChainInverse::new(&stand, band)?;
            (undo.filter().clone(), Some(undo))
        };
        Ok(Self {
            stream,
            stand,
            chain,
            filter,
            band: chosen,
            undo,
        })
    }

    /// The report as far as known before the run.
    fn describe(&self, args: &cli::Compensate, output: &str) -> CompensateReport {
        let (stream, chain, band) = (&self.stream, &self.chain, self.filter.band());
        let edge_s = self.filter.half_length() as f64 / band.sample_rate_hz();
        CompensateReport {
            input: stream.source.clone(),
            dialect: stream.dialect.clone(),
            channel: stream.channel.name.clone(),
            channel_unit: unit_text(stream.channel.unit.as_ref()).to_owned(),
            taken_as: "recorded",
            is_part: args.record.reading.range.is_some(),
            stand: self.stand.file.clone(),
            output: output.to_owned(),
            unit: chain.applied.unit.clone(),
            calibration: chain.described.clone(),
            calibration_relative_std: chain.std.known(),
            constant: chain.std,
            zero_std: chain.zero_std.map(|std| std / chain.applied.factor),
            quantity: chain.applied.name,
            rated_torque: chain.rated_n_m.map(|rated| rated / chain.applied.factor),
            levels: chain.levels(),
            modes: self.stand.resonances(),
            rate_hz: stream.rate_hz,
            rate_std_hz: stream.channel.axis.rate_std_hz,
            filled: stream.channel.filled.clone(),
            rate_from: stream.channel.axis.rate_sentence(),
            method: match self.undo {
                Some(_) => "refined",
                None if args.whole_record => "whole-record",
                None => "stream",
            },
            reach_s: refined::reach(self.filter.taps()) as f64 / band.sample_rate_hz(),
            effects: refined::effects(&self.stand, self.undo.as_ref()),
            band: self.band.clone(),
            band_hz: band.top_hz(),
            band_end_hz: band.end_hz(),
            edge_s,
            noise: self.noise(),
            warnings: [
                self.stand.warnings.as_slice(),
                &chain.warnings,
                warnings::of_ringing(&self.stand, self.stream.rate_hz).as_slice(),
                warnings::of_ends(self.undo.as_ref(), edge_s).as_slice(),
                warnings::of_mean(self.undo.as_ref()).as_slice(),
            ]
            .concat(),
            ..CompensateReport::default()
        }
    }

    /// Standard uncertainty at a frequency; none if no filter describes the stand.
    fn std(&self, frequency_hz: f64) -> TorqueStd {
        match self.undo {
            None => self.stand.torque_std(frequency_hz, self.chain.std),
            Some(_) => TorqueStd::default(),
        }
    }

    /// Gain of what the filter does not divide out.
    fn gain_beside_filter(&self, frequency_hz: f64) -> f64 {
        let undo = self.undo.as_ref();
        undo.map_or(1.0, |undo| undo.gain_beside_filter(frequency_hz))
    }

    fn noise(&self) -> NoiseReport {
        let beside = |frequency_hz| self.gain_beside_filter(frequency_hz);
        let gain = NoiseGain::of(&self.filter, beside, GAIN_POINTS);
        let at = |&(frequency_hz, gain): &(f64, f64)| {
            let std = self.std(frequency_hz);
            NoiseAt {
                frequency_hz,
                gain,
                relative_std: std.total.map(|u| u.complex_relative()),
                response_relative_std: std.response.map(|u| u.complex_relative()),
            }
        };
        let top_hz = self.filter.band().top_hz();
        let resonances = self.stand.resonances().into_iter();
        let resonances = resonances.map(|(natural_hz, _)| natural_hz);
        let fine = (1..=UNCERTAIN_POINTS).map(|k| top_hz * k as f64 / UNCERTAIN_POINTS as f64);
        let everywhere = fine.chain(resonances).filter(|hz| *hz <= top_hz);
        let largest_std = everywhere
            .map(|hz| at(&(hz, self.filter.response(hz).norm() * beside(hz))))
            .filter(|at| at.response_relative_std.is_some())
            .max_by(|a, b| {
                a.response_relative_std
                    .partial_cmp(&b.response_relative_std)
                    .unwrap_or(std::cmp::Ordering::Equal)
            });
        NoiseReport {
            white_gain: gain.white,
            largest_gain: gain.largest.0,
            largest_gain_at_hz: gain.largest.1,
            gain: gain.curve.iter().map(at).collect(),
            largest_std,
            record: None,
        }
    }
}
