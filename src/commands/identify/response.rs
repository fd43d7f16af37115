//! `identify response`.

use torqcomp_model::{Dimension, Estimate};

use super::constants::{Ratios, from_ratios, from_residue};
use super::factor::factor_of;
use super::{Recorded, deliver, entry, radius, stand_text, unit_or};
use super::{modes, rest};
use crate::cli::identify::Response;
use crate::commands::Outcome;
use crate::failure::{ErrorCode, Failure};
use crate::file_name::{self, ShowPath};
use crate::identify::response::{Driven, Lag, RATIO, ResponseOptions, identify};
use crate::identify::{Identification, Motion, NamedEstimate, gravity_hint};
use crate::io::{ChannelChoice, Input};
use crate::quality;
use crate::recording::{AlignedChannels, Channel};
use crate::stand::update::{self, Entry};
use crate::stand::{self, TransducerSignal};
use crate::unit::NamedUnit;
use crate::warning::WarningCode;

/// Runs the test.
pub fn run(args: &Response) -> Result<Outcome, Failure> {
    let mut recorded = Recorded::default();
    let loaded = load(args, &mut recorded)?;
    let names = file_name::texts(&args.inputs);
    let records: Vec<Driven> = loaded
        .iter()
        .zip(&names)
        .map(|(l, name)| Driven {
            name,
            rate_hz: l.rate_hz,
            applied: &l.channels[0].samples,
            measured: &l.channels[1].samples,
        })
        .collect();
    let unit = loaded[0].channels[1].unit.as_ref();
    let motion = motion_of(args, &loaded[0].channels[1].name, unit)?;
    let stand = stand_text(&args.findings)?;
    let mut result = identify(&records, &options(args, motion, stand.as_ref())?)?;
    // A clipped resonance looks like noise before it.
    if recorded.warnings.iter().any(|w| w.code == "clipped") {
        result
            .warnings
            .retain(|w| w.code != "noise-before-resonance");
    }
    if let (Some(fit), Some(unit)) = (&mut result.fit, unit) {
        fit.unit.clone_from(&unit.text);
    }
    name_gain(&mut result, &loaded[0]);
    let units = [1, 0].map(|k| loaded[0].channels[k].unit.as_ref());
    if let [Some(measured), Some(applied)] = units {
        let unit = format!("({})/({})", measured.text, applied.text);
        result.label_charts(RATIO, &unit);
    }
    let source = format!("identify response: {}", file_name::list(&args.inputs));
    let written = modes::WrittenModes {
        source: source.clone(),
        motion,
        units,
    };
    let mut entries = match result.shares.take() {
        Some(shares) => written.entries(&shares, &args.findings)?,
        None => {
            let size = rad_per_n_m(args, &loaded, motion)?;
            entries(args, size, &source, &mut result)?
        }
    };
    entries.extend(recorder(&mut result, &source));
    let converts = calibration(units, stand.as_ref(), &source, &mut result)?;
    if !converts.is_empty() {
        let is_written = args.findings.result.output.is_some();
        entries.extend(zero(
            &loaded,
            (stand.as_ref(), is_written),
            &source,
            &mut result,
        )?);
    }
    entries.extend(converts);
    deliver(result, recorded, &args.findings, &entries)
}

/// The records, all in the units of the first.
fn load(args: &Response, recorded: &mut Recorded) -> Result<Vec<AlignedChannels>, Failure> {
    let choices = ChannelChoice::applied_and_measured(
        [&args.applied, &args.measured],
        [args.applied_unit.as_deref(), args.measured_unit.as_deref()],
    );
    let radius_m = radius(args.radius.as_deref())?;
    let mut loaded: Vec<AlignedChannels> = Vec::new();
    for input in &args.inputs {
        let mut read = AlignedChannels::read(&Input::of(input), &choices, &args.reading)?;
        read.channels[1].must_be_as_recorded(&read.source)?;
        recorded.add(
            input,
            read.channels[0].samples.len(),
            Some((read.rate_hz, read.rate_std_hz)),
        );
        recorded.warn(read.warnings.clone(), read.is_lossy);
        recorded.warn(quality::clipped(&read), false);
        recorded.warn(quality::repeated(&read), false);
        recorded.warn(quality::coarse_of(&read.channels), false);
        if let Some(text) = &args.torque_factor {
            scale(&mut read.channels[0], text)?;
        }
        if let Some(radius_m) = radius_m {
            to_torque(&mut read.channels[0], radius_m)?;
        }
        if let Some(first) = loaded.first() {
            read.convert_to_units_of(first)?;
        }
        loaded.push(read);
    }
    Ok(loaded)
}

/// Motion quantity of the measured channel.
fn motion_of(args: &Response, name: &str, unit: Option<&NamedUnit>) -> Result<Motion, Failure> {
    if let Some(motion) = args.measured_as {
        return Ok(motion);
    }
    if let Some(hint) = unit.and_then(gravity_hint) {
        return Err(ErrorCode::UnitUnsuitable.usage(format_args!(
            "--measured \"{name}\" is in g: {hint} (--measured-unit g0), and for a mass give --measured-as displacement"
        )));
    }
    let by_unit = unit.and_then(|unit| Motion::of(unit.unit.dimension()));
    Ok(by_unit.map_or(Motion::Displacement, |(motion, _)| motion))
}

/// Evaluation of the response.
fn options(
    args: &Response,
    motion: Motion,
    stand: Option<&(String, String)>,
) -> Result<ResponseOptions, Failure> {
    let declared = stand.map(|(name, text)| stand::recorder_of(name, text));
    let recorder = declared
        .transpose()?
        .flatten()
        .map(|declared| declared.recorder);
    Ok(ResponseOptions {
        excitation: args.excitation,
        band_hz: args.band,
        modes: args.modes.map(usize::from),
        period: args.period,
        segment: args.segment,
        order: motion.order(),
        lag: args.delay.then_some(Lag::Delay),
        recorder: recorder.filter(|recorder| !recorder.is_ideal()),
        grounded: args.findings.result.output.is_some(),
    })
}

/// Entries of the recorder: the lag of the measured channel.
fn recorder(result: &mut Identification, source: &str) -> Vec<Entry> {
    let mut entries = Vec::new();
    match result.get("delay") {
        Some(delay) if delay.value() > 0.0 => {
            entries.push(entry("recorder", "delay", delay, source));
        }
        Some(_) => result.method.push(
            "the delay is not written to a stand file: it is the applied channel that is late"
                .to_owned(),
        ),
        None => {}
    }
    if let Some(low_pass) = result.get("low_pass") {
        entries.push(entry("recorder", "low_pass", low_pass, source));
        entries.push(Entry::whole("recorder", "low_pass_order", 1));
    }
    entries
}

/// Note if no mode has a static gain.
const NOT_AT_REST: &str = "the static response of these modes is zero, but a stand file scales residues by it; choose \
    another --band";

/// Converts the applied channel to a force or torque by its factor.
fn scale(applied: &mut Channel, text: &str) -> Result<(), Failure> {
    let (factor, dimension) = factor_of(text, (applied.recorded(), "--applied-unit"))?;
    let unit = match dimension {
        Dimension::FORCE => "N",
        Dimension::TORQUE => "N m",
        _ => {
            return Err(ErrorCode::UnitUnsuitable.usage(format_args!(
                "--torque-factor {text} is no torque or force per unit of a channel; expected one such as \
                 \"444.4 N/V\""
            )));
        }
    };
    applied.samples.iter_mut().for_each(|v| *v *= factor);
    applied.unit = NamedUnit::parse(unit);
    Ok(())
}

/// Converts a force at a radius to a torque.
fn to_torque(force: &mut Channel, radius_m: f64) -> Result<(), Failure> {
    let unit = unit_or(force.recorded(), "--applied-unit")?;
    if unit.unit.dimension() != Dimension::FORCE {
        return Err(ErrorCode::ConflictingArguments.usage(format_args!(
            "--radius goes with a force; --applied \"{}\" is in {}{}",
            force.name,
            unit.text,
            match (TransducerSignal::of(&unit.unit), unit.weight_as(Dimension::FORCE)) {
                (Some(_), _) => {
                    ": give the inverse of the sensitivity of the hammer as --torque-factor, such as \"444.4 N/V\" \
                     for 2.25 mV/N, or leave --radius out for natural frequency and damping alone"
                        .to_owned()
                }
                (None, Some(force)) =>
                    format!(", a mass; if it is a force, give --applied-unit {force}"),
                (None, None) => String::new(),
            }
        )));
    }
    let factor = unit.unit.factor() * radius_m;
    force.samples.iter_mut().for_each(|v| *v *= factor);
    force.unit = NamedUnit::parse("N m");
    Ok(())
}

/// Calibration of a signal by a known torque: static torque over signal, for a stand file without calibration.
fn calibration(
    units: [Option<&NamedUnit>; 2],
    stand: Option<&(String, String)>,
    source: &str,
    result: &mut Identification,
) -> Result<Vec<Entry>, Failure> {
    let [Some(measured), Some(applied)] = units else {
        return Ok(Vec::new());
    };
    let is_torque = applied.unit.dimension() == Dimension::TORQUE;
    let gain = result
        .get("static_gain")
        .filter(|gain| is_torque && gain.value() != 0.0);
    let (Some(gain), Some(signal)) = (gain, TransducerSignal::of(&measured.unit)) else {
        return Ok(Vec::new());
    };
    let (key, unit, size) = match signal {
        TransducerSignal::Voltage => ("torque_per_volt", "N m/V", 1.0),
        TransducerSignal::Ratio => ("torque_per_ratio", "N m/(mV/V)", 1e-3),
        _ => return Ok(Vec::new()),
    };
    let value = size * applied.unit.factor() / (gain.value() * measured.unit.factor());
    let std = gain.std().map(|std| (std / gain.value() * value).abs());
    let constant = NamedEstimate {
        name: key.to_owned(),
        estimate: Estimate::of(unit, value, std),
    };
    let written = entry("calibration", key, &constant, source);
    result.parameters.push(constant);
    if let Some((name, text)) = stand {
        let declared = stand::calibration_of(name, text)?;
        result.warnings.extend(declared.and_then(|declared| {
            let declared = declared.constant_of(signal)?;
            let known = (size * declared.value(), declared.std_uncertainty());
            let known = (known.0, known.1.map(|std| size * std));
            stand::gain_differs(
                ("the response gives", key.replace('_', " ").as_str(), unit),
                (value, std),
                known,
                &format!(
                    "that {name} declares, which is kept: check it, and unit and radius of --applied; to write the new \
                     one, remove [calibration]"
                ),
            )
        }));
    }
    // Weights on the stand are more accurate than the static gain from a hammer test, and without a standard uncertainty
    // its error is not identifiable from these records.
    let is_calibrated = stand.is_some_and(|(_, text)| update::is_calibrated(text));
    Ok(match is_calibrated || std.is_none() {
        true => Vec::new(),
        false => vec![written],
    })
}

/// The zero that belongs to a calibration of a signal: without it, the output of an amplifier at no load would become a
/// torque. Not if the stand file gives one.
fn zero(
    loaded: &[AlignedChannels],
    (stand, is_written): (Option<&(String, String)>, bool),
    source: &str,
    result: &mut Identification,
) -> Result<Option<Entry>, Failure> {
    let declared = stand.map(|(name, text)| stand::recorder_of(name, text));
    let declared = declared.transpose()?.flatten();
    if declared.is_some_and(|recorder| recorder.zero.is_some()) {
        return Ok(None);
    }
    let unit = loaded[0].channels[1].unit.as_ref();
    let signal = unit.and_then(|unit| TransducerSignal::of(&unit.unit));
    let Some(estimate) = signal.and_then(|signal| rest::zero(loaded, signal)) else {
        if is_written {
            result.warn(WarningCode::ZeroUnknown.warning(
                "the records do not begin at rest, so the output at no load is unknown, and the stand file takes it as \
                 0: record it without load, and give it as [recorder] zero",
            ));
        }
        return Ok(None);
    };
    let zero = NamedEstimate {
        name: "zero".to_owned(),
        estimate,
    };
    let written = entry("recorder", "zero", &zero, source);
    result.parameters.push(zero);
    result
        .method
        .push("zero from the mean of the measured channel before the first excitation".to_owned());
    Ok(Some(written))
}

/// Sets the unit of the static gain: measured channel over applied channel.
fn name_gain(result: &mut Identification, record: &AlignedChannels) {
    let unit = |k: usize| record.channels[k].unit.as_ref().map(|unit| &unit.text);
    let gain = result
        .parameters
        .iter_mut()
        .find(|p| p.name == "static_gain");
    if let (Some(gain), Some(applied), Some(measured)) = (gain, unit(0), unit(1))
        && applied != measured
    {
        let unit = match applied.contains([' ', '/']) {
            true => format!("{measured}/({applied})"),
            false => format!("{measured}/{applied}"),
        };
        gain.estimate = Estimate::of(unit, gain.value(), gain.std());
    }
}

/// Rad (or rad/s, rad/s²) per N m for one measured unit per applied unit; `None` unless the former is a motion and the
/// latter a torque.
fn rad_per_n_m(
    args: &Response,
    loaded: &[AlignedChannels],
    motion: Motion,
) -> Result<Option<f64>, Failure> {
    let of = |record: &AlignedChannels| {
        let unit = |k: usize| record.channels[k].unit.as_ref().map(|u| u.unit);
        let (applied, measured) = (unit(0)?, unit(1)?);
        let is_rotation = Motion::of(measured.dimension()) == Some((motion, true));
        let is_known = is_rotation && applied.dimension() == Dimension::TORQUE;
        is_known.then(|| measured.factor() / applied.factor())
    };
    let first = of(&loaded[0]);
    match loaded.iter().position(|l| of(l) != first) {
        None => Ok(first),
        Some(other) => Err(ErrorCode::RecordsDiffer.failed(format_args!(
            "{} and {} have different units; records of one response need the same",
            args.inputs[0].shown(),
            args.inputs[other].shown()
        ))),
    }
}

/// Adds the constants from a single mode; returns the entries of the stand file.
fn entries(
    args: &Response,
    rad_per_n_m: Option<f64>,
    source: &str,
    result: &mut Identification,
) -> Result<Vec<Entry>, Failure> {
    let mode = match &result.modes[..] {
        [mode] => mode.clone(),
        _ if args.findings.result.output.is_some() => {
            return Err(ErrorCode::UnsuitableRecord.failed(NOT_AT_REST));
        }
        _ => return Ok(Vec::new()),
    };
    match rad_per_n_m {
        Some(size) => {
            let mode = mode.scaled(size);
            from_residue(&args.anchors, &args.findings, &mode, source, result)
        }
        None => {
            let mode = (&mode, Ratios::OverStiffness);
            from_ratios(&args.anchors, &args.findings, mode, source, result)
        }
    }
}
