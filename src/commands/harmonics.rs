//! `harmonics`: component torques at a fundamental and its orders.

mod checks;
mod filtered;
mod foreign;
mod level;
mod lowest;
mod mains;
mod multiple;
mod rotation;
mod rounding;
mod speed;
mod text;
mod unexplained;
mod unlisted;

use std::path::Path;

use num_complex::Complex64;
use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::Error;
use torqcomp_dsp::compensate::Inverse;
use torqcomp_dsp::harmonics::{self, Fundamental};
use torqcomp_dsp::quality::streamed::StreamedFaults;
use torqcomp_dsp::store::SampleStore;
use torqcomp_model::{InverseUncertainty, UnitSystem};

use self::rotation::Rotation;
use super::{made, unit_text};
use crate::cli;
use crate::failure::{ErrorCode, Failure};
use crate::io::{COMPENSATED, Input};
use crate::outcome::{Made, RecordFigures};
use crate::print::{Report, enumeration, short};
use crate::quality::{excerpt, resonance};
use crate::recording::moment::Moment;
use crate::recording::{ChannelStream, Spool, UniformRecord};
use crate::stand::{self, Calibration, ConstantStd, Stand, TorqueStd, off_rated};
use crate::unit::NamedUnit;
use crate::warning::{Warning, WarningCode};

/// Distance of the record from time zero, in its own lengths, up to which phases refer to zero.
const FAR_FROM_ZERO: f64 = 10.0;

/// Component torques at a fundamental and its orders.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(super) struct HarmonicsReport {
    /// Path of the recording.
    input: String,
    /// Name of the channel.
    channel: String,
    /// Unit of the channel in the recording.
    channel_unit: String,
    /// `recorded` where the stand's response is divided out, `compensated` where that was done before.
    taken_as: &'static str,
    /// Path of the stand file; `null` for a compensated record.
    stand: Option<String>,
    /// How the record was converted to static torque.
    calibration: String,
    /// Relative standard uncertainty of the constant of the calibration; `null` if unknown, or if there is none.
    calibration_relative_std: Option<f64>,
    /// Unit of `mean`, `recorded`, `torque`, `std` and `residual_rms`.
    unit: String,
    /// Number of samples.
    samples: usize,
    /// Sampling rate, in Hz.
    rate_hz: f64,
    /// Standard uncertainty of the rate by the time stamps, in Hz; `null` if the rate does not come from stamps.
    rate_std_hz: Option<f64>,
    /// Length of the record, in s.
    duration_s: f64,
    /// Fundamental frequency, in Hz.
    fundamental_hz: f64,
    /// Standard uncertainty of the fundamental, in Hz; `null` if it was given.
    fundamental_std_hz: Option<f64>,
    /// Time that phases refer to, on the time axis of the record, in s.
    phase_reference_s: f64,
    /// Time that phases refer to, with all its digits.
    phase_reference: String,
    /// Time of the first sample.
    #[serde(flatten)]
    start: Moment,
    /// Constant part of the torque, in `unit`.
    mean: f64,
    /// The component torques, by order.
    components: Vec<ComponentTorque>,
    /// Rms of the residual, in `unit`.
    residual_rms: f64,
    /// Warnings, each with a stable code.
    warnings: Vec<Warning>,
    #[serde(skip)]
    constant: ConstantStd,
}

/// A component torque `A cos(2πft + φ)`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
struct ComponentTorque {
    /// Frequency over the fundamental.
    order: f64,
    /// Frequency, in Hz.
    frequency_hz: f64,
    /// Recorded amplitude, in `unit`.
    recorded: f64,
    /// Phase of the recorded component, in degrees.
    recorded_phase_deg: f64,
    /// Applied over recorded amplitude.
    factor: f64,
    /// Amplitude of the applied torque, in `unit`.
    torque: f64,
    /// Phase of the applied torque, in degrees.
    phase_deg: f64,
    /// Standard uncertainty of `torque` from the noise of the record, in `unit`.
    std: f64,
    /// Standard uncertainty of `phase_deg` from the noise; `null` if the component is lost in it.
    phase_std_deg: Option<f64>,
    /// Standard uncertainty of `torque` from the stand's constants and the calibration; `null` if that of one of them is
    /// unknown.
    std_stand: Option<f64>,
    /// Part of `std_stand` from the response that is divided out; `null` if its constants have no uncertainties.
    std_response: Option<f64>,
    /// Standard uncertainty of `phase_deg` from the stand's constants; `null` if they have none.
    phase_std_stand_deg: Option<f64>,
}

/// Fits the components of one record.
///
/// # Errors
/// If the work cannot be done.
pub fn work(args: &cli::Harmonics) -> Result<Made, Failure> {
    let stand = args.stand.as_deref().map(stand::read).transpose()?;
    let (taken, input) = (&args.record, args.record.input());
    let stream = ChannelStream::open(&Input::of(input), &taken.choice, &taken.reading)?;
    let way = WayBack::new(&stream, stand, args.units.into())?;
    let inputs = [Some(input), args.stand.as_deref()];
    let inputs: Vec<&Path> = inputs.into_iter().flatten().collect();
    let mut output = args.result.open(&inputs)?;
    let source = stream.source.clone();
    let (name, unit) = (stream.channel.name.clone(), stream.channel.unit.clone());
    let record = UniformRecord::read(stream, |values| super::convert(&way.chain, values))?;
    let channel = (name.as_str(), unit.as_ref());
    let report = fit(args, &way, &record, &source, channel);
    let report = report.map_err(|failure| failure.at(&source))?;
    output.write(report.document(args.json).as_bytes())?;
    let is_lossy = record.summary.lost.is_some();
    Ok(Made {
        figures: RecordFigures::of(report.samples, report.rate_hz),
        ..made(vec![output], report.warnings, is_lossy, &args.strictness)
    })
}

/// Conversion of the record to the applied torque.
struct WayBack {
    chain: Calibration,
    /// The stand and its inverse response; none for a compensated record.
    stand: Option<(Stand, Inverse)>,
}

impl WayBack {
    fn new(
        stream: &ChannelStream,
        stand: Option<Stand>,
        units: UnitSystem,
    ) -> Result<Self, Failure> {
        if stream.channel.is_compensated {
            let chain = Calibration::of_compensated(stream.channel.recorded(), units)?;
            return Ok(Self { chain, stand: None });
        }
        let stand = stand.ok_or_else(|| {
            ErrorCode::MissingArgument.usage(format_args!(
                "\"{}\" is taken as recorded, with the stand's response in it; give --stand FILE (only a channel \
                 marked \"{COMPENSATED}\", a result of compensate, needs none)",
                stream.channel.name
            ))
            .at(&stream.source)
        })?;
        stand.mechanics()?;
        let chain = stand.calibration(stream.channel.recorded(), units)?;
        let inverse = stand.inverse()?;
        Ok(Self {
            chain,
            stand: Some((stand, inverse)),
        })
    }

    /// Applied over recorded torque.
    fn inverse(&self, frequency_hz: f64) -> Complex64 {
        match &self.stand {
            Some((_, inverse)) => inverse(frequency_hz),
            None => Complex64::ONE,
        }
    }

    fn taken_as(&self) -> &'static str {
        match &self.stand {
            Some(_) => "recorded",
            None => "compensated",
        }
    }
}

/// Warnings, first about losses, then about the record, its stand and its channel.
fn of_inputs(way: &WayBack, record: &UniformRecord) -> Vec<Warning> {
    let of_stand = way.stand.iter().flat_map(|(stand, _)| &stand.warnings);
    let further = of_stand.chain(&way.chain.warnings).cloned();
    let said = record.summary.all_warnings().into_iter();
    said.chain(further).collect()
}

/// The reference time of the phases, and the time of the first sample after it in s. Far from zero, phases at zero
/// would be extrapolated over many periods.
fn phase_reference(start: Moment, duration_s: f64) -> (Moment, f64) {
    match start.seconds().abs() > FAR_FROM_ZERO * duration_s {
        true => (start, 0.0),
        false => (Moment::default(), start.seconds()),
    }
}

/// The given fundamental, or the best-fitting one near it, by the requested orders and those that the record shows as well.
fn fundamental(
    args: &cli::Harmonics,
    record: &UniformRecord,
    orders: &[f64],
) -> Result<Fundamental, Failure> {
    if !args.refine {
        return Ok(Fundamental::given(args.fundamental));
    }
    let (given_hz, span) = (args.fundamental, 0.01 * args.refine_span);
    let by =
        |orders: &[f64]| foreign::refine(&record.samples, record.rate_hz, (given_hz, span), orders);
    let at = |fundamental_hz: f64| Rotation {
        record,
        fundamental_hz,
        orders,
    };
    let found = by(orders).and_then(|found| {
        let all = unlisted::for_refinement(&at(found.frequency_hz));
        if all.len() > orders.len() {
            by(&all)
        } else {
            Ok(found)
        }
    });
    found.map_err(|error| match error {
        Error::NotRefined { .. } => {
            ErrorCode::NotIdentifiable.failed(match speed::warning(&at(given_hz)) {
                Some(changes) => changes.message,
                None => format!(
                    "{error}; --refine-span searches beyond {} % around it",
                    short(args.refine_span)
                ),
            })
        }
        other => other.into(),
    })
}

fn fit(
    args: &cli::Harmonics,
    way: &WayBack,
    record: &UniformRecord,
    source: &str,
    (channel, channel_unit): (&str, Option<&NamedUnit>),
) -> Result<HarmonicsReport, Failure> {
    let samples = &record.samples;
    let duration_s = samples.count() as f64 / record.rate_hz;
    let mut warnings = of_inputs(way, record);
    let orders = visible_orders(args, record.rate_hz, &mut warnings)?;
    let fundamental = fundamental(args, record, &orders)?;
    let (reference, start_s) = phase_reference(record.start, duration_s);
    let mut found = harmonics::fit(samples, record.rate_hz, start_s, fundamental, &orders)?;
    let seen = samples.part(0..samples.count().min(excerpt::OF_PASSES))?;
    rounding::add_rounding(&mut found, &seen, record);

    let chain = &way.chain;
    let printed = 1.0 / chain.applied.factor;
    let components: Vec<ComponentTorque> = found
        .components
        .iter()
        .map(|c| component(c, printed, way))
        .collect();
    let rated = chain.rated_n_m.map(|rated| rated * printed);
    let largest = largest(samples, &components, printed)?;
    warnings.extend(off_rated(largest, rated, &chain.applied.unit));
    warnings.extend(checks::warnings(
        way,
        record,
        (&fundamental, &orders),
        (&found, &components),
    ));
    warnings.extend(mains::warning(&components, duration_s));
    warnings.extend(of_quality(record, &seen, channel, way)?);
    Ok(HarmonicsReport {
        input: source.to_owned(),
        channel: channel.to_owned(),
        channel_unit: unit_text(channel_unit).to_owned(),
        taken_as: way.taken_as(),
        stand: way.stand.as_ref().map(|(stand, _)| stand.file.clone()),
        calibration: chain.described.clone(),
        calibration_relative_std: chain.std.known(),
        constant: chain.std,
        unit: chain.applied.unit.clone(),
        samples: samples.count(),
        rate_hz: record.rate_hz,
        rate_std_hz: record.rate_std_hz,
        duration_s,
        fundamental_hz: fundamental.frequency_hz,
        fundamental_std_hz: fundamental.std_hz,
        phase_reference_s: reference.seconds(),
        phase_reference: reference.text(),
        start: record.start,
        mean: found.mean * way.inverse(0.0).re * printed,
        components,
        residual_rms: found.residual_rms * printed,
        warnings,
    })
}

/// Warnings from the samples themselves.
fn of_quality(
    record: &UniformRecord,
    seen: &[f64],
    channel: &str,
    way: &WayBack,
) -> Result<Vec<Warning>, Failure> {
    let chain = &way.chain;
    let count = record.samples.count();
    let mut faults = StreamedFaults::default();
    record
        .samples
        .pass(0..count, &mut |_, piece| faults.push(piece))?;
    let of = excerpt::Of {
        name: channel,
        unit: &chain.applied.unit,
        scale: 1.0 / chain.applied.factor,
        rate_hz: record.rate_hz,
        start: record.start,
        samples: count,
        faults: faults.finish(),
    };
    let levels = chain.levels().warnings(seen, of.scale, of.unit);
    let mut found = excerpt::warnings(seen, of);
    found.extend(levels);
    if let Some((stand, _)) = &way.stand {
        let first = &seen[..seen.len().min(excerpt::OF_STREAM)];
        let modes = stand.resonances();
        found.extend(resonance::warning(first, record.rate_hz, &modes));
    }
    Ok(found)
}

/// The largest torque of the record or one of its components, in the printed unit.
fn largest(samples: &Spool, components: &[ComponentTorque], printed: f64) -> Result<f64, Failure> {
    let mut largest = components.iter().map(|c| c.torque).fold(0.0, f64::max);
    samples.pass(0..samples.count(), &mut |_, piece| {
        let recorded = piece.iter().map(|v| v.abs() * printed);
        largest = recorded.fold(largest, f64::max);
    })?;
    Ok(largest)
}

/// Orders below the Nyquist frequency; those above are reported.
fn visible_orders(
    args: &cli::Harmonics,
    rate_hz: f64,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<f64>, Failure> {
    let limit = 0.5 * rate_hz / args.fundamental;
    let (seen, unseen): (Vec<f64>, Vec<f64>) = args
        .orders
        .0
        .iter()
        .partition(|order| **order < limit * (1.0 - 1e-9));
    if seen.is_empty() {
        return Err(ErrorCode::UnsuitableRecord.failed(format_args!(
            "no order of {} Hz is below half the sampling rate of {} Hz; request lower orders or record at a \
             higher rate",
            short(args.fundamental),
            short(rate_hz)
        )));
    }
    if let (Some(first), Some(last)) = (unseen.first(), unseen.last()) {
        warnings.push(WarningCode::OrdersAboveNyquist.warning(format!(
            "omitted, as above half the sampling rate of {} Hz: {}",
            short(rate_hz),
            match first == last {
                true => format!("order {}", short(*first)),
                false => format!("orders {} to {}", short(*first), short(*last)),
            }
        )));
    }
    Ok(seen)
}

fn component(fitted: &harmonics::Component, printed: f64, way: &WayBack) -> ComponentTorque {
    let inverse = way.inverse(fitted.frequency_hz);
    let factor = inverse.norm();
    let recorded = fitted.phasor.norm() * printed;
    let torque = recorded * factor;
    let std = way
        .stand
        .as_ref()
        .map_or_else(TorqueStd::default, |(stand, _)| {
            stand.torque_std(fitted.frequency_hz, way.chain.std)
        });
    let of_torque = |std: &InverseUncertainty| std.magnitude() * torque;
    ComponentTorque {
        order: fitted.order,
        frequency_hz: fitted.frequency_hz,
        recorded,
        recorded_phase_deg: fitted.phasor.arg().to_degrees(),
        factor,
        torque,
        phase_deg: (fitted.phasor * inverse).arg().to_degrees(),
        std: fitted.std_amplitude * printed * factor,
        phase_std_deg: fitted.std_phase_rad.map(f64::to_degrees),
        std_stand: std.total.as_ref().map(of_torque),
        std_response: std.response.as_ref().map(of_torque),
        phase_std_stand_deg: std.response.map(|u| u.phase_rad.to_degrees()),
    }
}

/// `order 3` or `orders 2, 3 and 5`.
fn named(orders: &[String]) -> String {
    let word = if orders.len() == 1 { "order" } else { "orders" };
    format!("{word} {}", enumeration(orders, "and"))
}
