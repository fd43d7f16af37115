//! `simulate`: the stand's answer to a given input.

use serde::Serialize;
use torqcomp_model::simulate::{Excitation, MotionState, substeps};
use torqcomp_model::{Chain, Unit, UnitSystem};

use super::{Outcome, conclude, report_beside, rows};
use crate::cli;
use crate::failure::Failure;
use crate::io::{ChannelChoice, Flags, Input};
use crate::print::{Report, short};
use crate::recording::moment::Moment;
use crate::recording::{AlignedChannel, AlignedChannels};
use crate::stand::{self, Calibration, Stand, TransducerSignal};
use crate::unit::{NamedUnit, RecordedChannel};
use crate::warning::Warning;

/// Relative change of the result at which the step of integration is fine enough.
const FINE: f64 = 1e-5;
/// Most steps from sample to sample.
const MOST_SUBSTEPS: usize = 256;

/// A simulated record.
#[derive(Debug, Serialize)]
struct SimulateReport {
    input: String,
    stand: String,
    applied: String,
    applied_unit: String,
    measured_unit: String,
    /// Course of the input between its samples.
    input_between_samples: &'static str,
    samples: usize,
    rate_hz: f64,
    #[serde(flatten)]
    start: Moment,
    /// Steps of integration from sample to sample.
    steps_per_sample: usize,
    effects: Vec<&'static str>,
    warnings: Vec<Warning>,
}

/// Runs the verb.
pub fn run(args: &cli::Simulate) -> Result<Outcome, Failure> {
    let stand = stand::read(&args.stand)?;
    let flags = Flags {
        channel: "--applied",
        unit: Some("--unit"),
    };
    let choice = ChannelChoice::of(flags, args.applied.as_deref(), args.unit.as_deref());
    let read = AlignedChannels::read(&Input::of(&args.input), &[choice], &args.reading)?;
    let chosen = &read.channels[0];
    if args.json && args.result.is_stdout() {
        return Err(Failure::usage(
            "the record and the JSON document cannot both go to standard output; give the record a file with -o",
        ));
    }
    if chosen.samples.len() < 2 {
        return Err(Failure::failed(
            "the record has fewer than two samples; nothing can be simulated",
        ));
    }
    let inputs = [args.input.as_ref(), args.stand.as_path()];
    let mut output = args.result.open(&inputs)?;
    let mut warnings = [read.warnings.as_slice(), &stand.warnings].concat();
    let units = ChannelUnits::of(&stand, chosen, &mut warnings)?;
    let applied: Vec<f64> = chosen.samples.iter().map(|u| u * units.applied).collect();
    let chain = stand.chain()?;
    let between = args.between.into();
    let input = Excitation::new(applied, read.rate_hz, read.start.after_s, 1).with_between(between);
    let (mut simulated, steps) = refined(&chain, &input)?;
    for value in &mut simulated {
        let torque = *value + stand.diagnosed.offset;
        let recorded = match &units.calibration {
            Some(calibration) => calibration
                .conversion
                .record(torque)
                .map_err(Failure::failed)?,
            None => torque,
        };
        *value = recorded / units.measured;
    }
    output.write(b"time_s,measured\n")?;
    let axis = (read.rate_hz, read.start);
    rows::write_uniform(&mut output, args.digits, axis, &simulated)?;
    output.finish()?;
    let report = SimulateReport {
        input: args.input.clone(),
        stand: args.stand.display().to_string(),
        applied: chosen.name.clone(),
        applied_unit: units.applied_text,
        measured_unit: units.measured_text,
        input_between_samples: between.name(),
        samples: simulated.len(),
        rate_hz: read.rate_hz,
        start: read.start,
        steps_per_sample: steps,
        effects: stand.effects.iter().map(|e| e.effect.name).collect(),
        warnings,
    };
    report_beside(&report, args.json, args.quiet || args.json)?;
    Ok(conclude(&report.warnings, read.is_lossy, &args.strictness))
}

impl Report for SimulateReport {
    const SCHEMA: &'static str = "torqcomp.simulate/1";

    fn text(&self) -> String {
        let effects = match self.effects.as_slice() {
            [] => "no effects".to_owned(),
            some => some.join(", "),
        };
        format!(
            "simulated {} samples at {} Hz, {} steps a sample, with {effects}; applied {} in {}, {} between samples; \
             measured in {}\n",
            self.samples,
            short(self.rate_hz),
            self.steps_per_sample,
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
    /// What makes torque of the result, if it is in another unit.
    calibration: Option<Calibration>,
    measured_text: String,
}

impl ChannelUnits {
    fn of(
        stand: &Stand,
        chosen: &AlignedChannel,
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
        let unit = Unit::parse(&text).map_err(Failure::failed)?;
        // A record of another unit than torque is what the calibration makes torque of.
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
}

/// The unit of the applied column, which must be one that the stand takes.
fn applied_unit(
    chosen: &AlignedChannel,
    expected: &str,
    warnings: &mut Vec<Warning>,
) -> Result<NamedUnit, Failure> {
    let wanted = NamedUnit {
        text: expected.to_owned(),
        unit: Unit::parse(expected).map_err(Failure::failed)?,
    };
    match &chosen.unit {
        Some(given) if given.unit.dimension() == wanted.unit.dimension() => Ok(given.clone()),
        Some(given) => Err(Failure::failed(format_args!(
            "the channel \"{}\" is in {}, and what acts on this stand is in {expected}; choose another column with \
             --applied, or give the right unit with --unit",
            chosen.name, given.text
        ))),
        None if chosen.unit_text.is_some() => Err(Failure::failed(format_args!(
            "the unit \"{}\" of the channel \"{}\" is unknown; this stand takes {expected}; give the right unit with --unit",
            chosen.unit_text.as_deref().unwrap_or_default(),
            chosen.name
        ))),
        None => {
            warnings.push(Warning::new(
                "unit-assumed",
                format!(
                    "the channel \"{}\" gives no unit: {expected} was assumed, as the stand takes it; give another with --unit",
                    chosen.name
                ),
            ));
            Ok(wanted)
        }
    }
}

/// The record from rest, its step halved until that changes nothing that matters; and the steps a sample.
fn refined(chain: &Chain, input: &Excitation) -> Result<(Vec<f64>, usize), Failure> {
    let run =
        |steps: usize| chain.simulate_from(&input.with_substeps(steps), MotionState::default());
    let rate_hz = input.rate_hz();
    let mut steps = substeps(chain.mode.natural_frequency_hz(), rate_hz);
    let mut last = run(steps);
    loop {
        let finer = run(2 * steps);
        steps *= 2;
        let rms = |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>().sqrt();
        let change = rms(&mut finer.iter().zip(&last).map(|(a, b)| a - b));
        let size = rms(&mut finer.iter().copied());
        if !size.is_finite() {
            return Err(Failure::failed(
                "the simulated motion diverges: with these effects the stand is unstable for this input",
            ));
        }
        if change <= FINE * size || steps >= MOST_SUBSTEPS {
            return Ok((finer, steps));
        }
        last = finer;
    }
}
