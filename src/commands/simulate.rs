//! `simulate`: the stand's response to a given input.

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_model::simulate::{Between, Pieces, steady_answer};
use torqcomp_model::{Chain, Unit, UnitSystem};

use super::rows;
use crate::cli;
use crate::failure::{ErrorCode, Failure};
use crate::file_name::ShowPath;
use crate::io::output::Output;
use crate::io::{ChannelChoice, Flags, Input};
use crate::outcome::{Made, RecordFigures};
use crate::print::{Report, enumeration, plural, short};
use crate::recording::moment::Moment;
use crate::recording::{Channel, ChannelStream, UniformStream};
use crate::stand::{self, Calibration, Stand, TransducerSignal};
use crate::unit::{NamedUnit, RecordedChannel};
use crate::warning::{Warning, WarningCode};

/// The simulated response of a stand to a recorded input.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct SimulateReport {
    /// Path of the recording with the input.
    input: String,
    /// Path of the stand file.
    stand: String,
    /// Name of the channel with the input.
    applied: String,
    /// Unit of the input.
    applied_unit: String,
    /// Unit of the simulated record.
    measured_unit: String,
    /// Behaviour of the input between samples.
    input_between_samples: &'static str,
    /// Whether the record is the steady-state response to a periodic input.
    is_steady: bool,
    /// Number of samples.
    samples: usize,
    /// Sampling rate, in Hz.
    rate_hz: f64,
    /// Standard uncertainty of the rate by the time stamps, in Hz; `null` if the rate does not come from stamps.
    rate_std_hz: Option<f64>,
    #[serde(flatten)]
    start: Moment,
    /// Steps of integration from sample to sample.
    steps_per_sample: usize,
    /// Names of the effects of the stand.
    effects: Vec<&'static str>,
    /// Warnings, each with a stable code.
    warnings: Vec<Warning>,
}

/// Simulates the response to one record.
///
/// # Errors
/// If the work cannot be done.
pub fn work(args: &cli::Simulate) -> Result<Made, Failure> {
    let stand = stand::read(&args.stand)?;
    stand.refuse_late_start(&args.reading)?;
    if args.json && args.result.is_stdout() {
        return Err(ErrorCode::ConflictingArguments.usage(
            "the record and the JSON document cannot both go to standard output; give the record a file with -o",
        ));
    }
    let mut applied = AppliedInput::open(args)?;
    let inputs = [args.input(), args.stand.as_path()];
    let mut output = args.result.open(&inputs)?;
    let mut of_channel = Vec::new();
    let units = ChannelUnits::of(&stand, applied.channel.recorded(), &mut of_channel)?;
    let chain = stand.chain()?;
    let between = args.between.into();
    let axis = applied.axis;
    output.write(format!("time_s,measured [{}]\n", units.measured_text).as_bytes())?;
    let mut written = 0;
    let mut deliver = |simulated: &mut Vec<f64>| {
        units.record(simulated, stand.diagnosed.offset)?;
        rows::write_uniform(&mut output, args.digits, axis, written, simulated)?;
        written += simulated.len();
        simulated.clear();
        Ok::<(), Failure>(())
    };
    let steps = match args.periodic {
        true => simulate_steady(&mut applied, units.applied, &chain, between, &mut deliver)?,
        false => {
            let pieces = Pieces::new(&chain, axis.0, between);
            simulate(&mut applied, units.applied, pieces, &mut deliver)?
        }
    };
    if written < 2 {
        return Err(too_short());
    }
    let is_lossy = applied.is_lossy;
    let report = SimulateReport {
        input: args.input().shown().to_string(),
        stand: args.stand.shown().to_string(),
        applied: applied.channel.name,
        applied_unit: units.applied_text,
        measured_unit: units.measured_text,
        input_between_samples: between.name(),
        is_steady: args.periodic,
        samples: written,
        rate_hz: axis.0,
        rate_std_hz: applied.rate_std_hz,
        start: axis.1,
        steps_per_sample: steps,
        effects: stand.effects.iter().map(|e| e.effect.name).collect(),
        warnings: [applied.warnings, stand.warnings.clone(), of_channel].concat(),
    };
    Ok(made(args, report, output, is_lossy))
}

/// The written record and its report.
fn made(args: &cli::Simulate, report: SimulateReport, output: Output, is_lossy: bool) -> Made {
    Made {
        document: args.json.then(|| report.document(true)),
        notes: match args.json {
            true => String::new(),
            false => report.text(),
        },
        figures: RecordFigures::of(report.samples, report.rate_hz),
        ..super::made(vec![output], report.warnings, is_lossy, &args.strictness)
    }
}

/// Computes the steady-state response to the repeated applied quantity; returns integration steps per sample.
fn simulate_steady(
    applied: &mut AppliedInput,
    factor: f64,
    chain: &Chain,
    between: Between,
    deliver: &mut dyn FnMut(&mut Vec<f64>) -> Result<(), Failure>,
) -> Result<usize, Failure> {
    let mut samples = Vec::new();
    while applied.next(&mut samples)? {}
    if samples.len() < 2 {
        return Err(too_short());
    }
    samples.iter_mut().for_each(|u| *u *= factor);
    let steady = steady_answer(chain, samples, applied.axis.0, between);
    let (mut record, steps) = steady.map_err(Failure::of(ErrorCode::InvalidStand))?;
    deliver(&mut record)?;
    Ok(steps)
}

/// Passes the applied quantity through the stand piece by piece; returns integration steps per sample.
fn simulate(
    applied: &mut AppliedInput,
    factor: f64,
    mut pieces: Pieces,
    deliver: &mut dyn FnMut(&mut Vec<f64>) -> Result<(), Failure>,
) -> Result<usize, Failure> {
    let (mut samples, mut simulated) = (Vec::new(), Vec::new());
    loop {
        let is_end = !applied.next(&mut samples)?;
        samples.iter_mut().for_each(|u| *u *= factor);
        pieces
            .push(&samples, &mut simulated)
            .map_err(Failure::of(ErrorCode::InvalidStand))?;
        deliver(&mut simulated)?;
        samples.clear();
        if is_end {
            break;
        }
    }
    let steps = pieces
        .finish(&mut simulated)
        .map_err(Failure::of(ErrorCode::InvalidStand))?;
    deliver(&mut simulated)?;
    Ok(steps)
}

/// The applied quantity as read, in the unit of the file.
struct AppliedInput {
    channel: Channel,
    /// Samples per second, and the time of the first sample.
    axis: (f64, Moment),
    /// Standard uncertainty of the rate, if it comes from stamps.
    rate_std_hz: Option<f64>,
    /// Until its end.
    stream: Option<Box<UniformStream>>,
    /// Warnings about the file after reading all of it; losses come first.
    warnings: Vec<Warning>,
    is_lossy: bool,
}

impl AppliedInput {
    fn open(args: &cli::Simulate) -> Result<Self, Failure> {
        let flags = Flags {
            channel: "--applied",
            unit: Some("--unit"),
        };
        let choice = ChannelChoice::of(flags, args.applied.as_deref(), args.unit.as_deref());
        let stream = ChannelStream::open(&Input::of(args.input()), &choice, &args.reading)?;
        let channel = stream.channel.clone();
        let stream = UniformStream::of(stream)?;
        Ok(Self {
            axis: (stream.rate_hz, stream.start),
            rate_std_hz: stream.rate_std_hz,
            channel,
            stream: Some(Box::new(stream)),
            warnings: Vec::new(),
            is_lossy: false,
        })
    }

    /// Appends the next samples; `false` with the last of them.
    fn next(&mut self, samples: &mut Vec<f64>) -> Result<bool, Failure> {
        if let Some(stream) = &mut self.stream
            && stream.next(samples, |_| Ok(()))?
        {
            return Ok(true);
        }
        if let Some(ended) = self.stream.take() {
            let (summary, _) = ended.finish(samples)?;
            self.is_lossy = summary.lost.is_some();
            self.warnings = summary.all_warnings();
        }
        Ok(false)
    }
}

fn too_short() -> Failure {
    ErrorCode::TooFewSamples
        .failed("the record has fewer than two samples; nothing can be simulated")
}

impl Report for SimulateReport {
    const SCHEMA: &'static str = "torqcomp.simulate/1";

    fn text(&self) -> String {
        let effects = match self.effects.as_slice() {
            [] => "no effects".to_owned(),
            some => enumeration(some, "and"),
        };
        let answer = match self.is_steady {
            true => ", the steady-state response to their repetition",
            false => "",
        };
        format!(
            "simulated {} samples at {} Hz ({} per sample) with {effects}{answer}; input \"{}\" in {}, {} between \
             samples; output in {}\n",
            self.samples,
            short(self.rate_hz),
            plural(self.steps_per_sample, "integration step"),
            self.applied,
            self.applied_unit,
            self.input_between_samples,
            self.measured_unit,
        )
    }
}

/// Units of both quantities.
struct ChannelUnits {
    /// SI units per unit of the file.
    applied: f64,
    applied_text: String,
    /// SI units per unit of the result.
    measured: f64,
    /// Conversion of the result to torque, if it is in another unit.
    calibration: Option<Calibration>,
    measured_text: String,
}

impl ChannelUnits {
    fn of(
        stand: &Stand,
        chosen: RecordedChannel<'_>,
        warnings: &mut Vec<Warning>,
    ) -> Result<Self, Failure> {
        stand.mechanics()?;
        let gain = stand.static_gain();
        let expected = gain.map_or("N m", |gain| gain.applied_unit.as_str());
        let applied = applied_unit(chosen, expected, warnings)?;
        let text = match (&stand.diagnosed.measured_unit, gain) {
            (Some(unit), _) => unit.clone(),
            (None, Some(gain)) => gain.recorded_unit.clone(),
            (None, None) => applied.text.clone(),
        };
        let unit = Unit::parse(&text).map_err(Failure::of(ErrorCode::UnitUnclear))?;
        // A record in another unit than torque is converted to torque by the calibration.
        let is_signal = gain.is_none() && TransducerSignal::of(&unit).is_some();
        let named = NamedUnit {
            text: text.clone(),
            unit,
        };
        let channel = RecordedChannel {
            name: "measured",
            unit: Some(&named),
            unit_text: None,
        };
        let calibration = is_signal.then(|| stand.calibration(channel, UnitSystem::Si));
        let calibration = calibration.transpose()?;
        Ok(Self {
            applied: applied.unit.factor(),
            applied_text: applied.text,
            measured: calibration
                .as_ref()
                .map_or(unit.factor(), |c| c.recorded_factor),
            calibration,
            measured_text: text,
        })
    }

    /// Converts simulated torques to their record, in the unit of the result.
    fn record(&self, simulated: &mut [f64], offset: f64) -> Result<(), Failure> {
        for value in simulated {
            let torque = *value + offset;
            let recorded = match &self.calibration {
                Some(calibration) => calibration
                    .conversion
                    .record(torque)
                    .map_err(Failure::of(ErrorCode::InvalidStand))?,
                None => torque,
            };
            *value = recorded / self.measured;
        }
        Ok(())
    }
}

/// The unit of the applied column, which must suit the stand.
fn applied_unit(
    chosen: RecordedChannel<'_>,
    expected: &str,
    warnings: &mut Vec<Warning>,
) -> Result<NamedUnit, Failure> {
    let wanted = NamedUnit {
        text: expected.to_owned(),
        unit: Unit::parse(expected).map_err(Failure::of(ErrorCode::UnitUnclear))?,
    };
    match (chosen.unit, chosen.unit_text) {
        (Some(given), _) if given.unit.dimension() == wanted.unit.dimension() => Ok(given.clone()),
        (Some(given), _) => {
            let is_weight = given.weight_as(wanted.unit.dimension()).is_some();
            let unclear = is_weight.then(|| chosen.unclear_weight(given)).flatten();
            Err(unclear.unwrap_or_else(|| {
                ErrorCode::UnitUnsuitable.failed(format_args!(
                    "the channel \"{}\" is in {}, and what acts on this stand is in {expected}; choose another \
                     column with --applied, or give the right unit with --unit",
                    chosen.name, given.text
                ))
            }))
        }
        (None, Some(text)) => Err(chosen.unknown_unit(
            text,
            &format!("this stand takes {expected}; give the right unit with --unit"),
        )),
        (None, None) => {
            warnings.push(WarningCode::UnitAssumed.warning(format!(
                "the channel \"{}\" has no unit: {expected}, which the stand expects, was assumed; give another \
                 with --unit",
                chosen.name
            )));
            Ok(wanted)
        }
    }
}
