//! `harmonics`: component torques at a fundamental and its orders.

use num_complex::Complex64;
use torqcomp_dsp::harmonics::{self, Fundamental, refine_fundamental};

use super::{Outcome, conclude};
use crate::cli::Harmonics;
use crate::failure::Failure;
use crate::io::Input;
use crate::io::output::Output;
use crate::print::{self};
use crate::quality::excerpt;
use crate::report::harmonics::{Component, Report, SCHEMA};
use crate::signal::{Record, Signal};
use crate::stand::{self, Chain, Stand};
use crate::warning::Warning;

/// Distance of the record from time zero, in its own lengths, up to which phases refer to zero.
const FAR_FROM_ZERO: f64 = 10.0;

/// Orders of the mains that are looked at.
const MAINS_LINES: f64 = 5.0;

/// Runs the verb.
pub fn run(args: &Harmonics) -> Result<Outcome, Failure> {
    let stand = stand::read(&args.stand)?;
    stand.mechanics()?;
    let signal = Signal::open(&Input::of(&args.record.input), &args.record.options())?;
    let chain = stand.chain(
        &signal.channel.name,
        signal.channel.unit.as_ref(),
        args.units.into(),
    )?;
    let inputs = [args.record.input.as_ref(), args.stand.as_path()];
    let mut output = Output::open(args.result.output.as_deref(), args.result.force, &inputs)?;
    let mut report = describe(&signal, &stand, &chain);
    let source = signal.source.clone();
    let record = Record::read(signal, |values| super::convert(&chain, values))?;
    let fitted = fit(args, &stand, &chain, &record, &mut report);
    fitted.map_err(|failure| failure.at(&source))?;
    let text = if args.json {
        print::json(&report)
    } else {
        report.text()
    };
    output.write(text.as_bytes())?;
    output.finish()?;
    Ok(conclude(
        &report.warnings,
        record.summary.lost.is_some(),
        args.strict,
    ))
}

/// The report as far as it is known before the record is read.
fn describe(signal: &Signal, stand: &Stand, chain: &Chain) -> Report {
    Report {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        input: signal.source.clone(),
        channel: signal.channel.name.clone(),
        channel_unit: signal
            .channel
            .unit
            .as_ref()
            .map_or_else(String::new, |u| u.text.clone()),
        stand: stand.file.clone(),
        calibration: chain.described.clone(),
        unit: chain.applied.unit.clone(),
        samples: 0,
        rate_hz: signal.time.rate_hz,
        duration_s: 0.0,
        fundamental_hz: 0.0,
        fundamental_std_hz: None,
        phase_reference_s: 0.0,
        mean: 0.0,
        components: Vec::new(),
        residual_rms: 0.0,
        warnings: Vec::new(),
    }
}

fn fit(
    args: &Harmonics,
    stand: &Stand,
    chain: &Chain,
    record: &Record,
    report: &mut Report,
) -> Result<(), Failure> {
    let samples = &record.samples;
    let duration_s = samples.len() as f64 / record.rate_hz;
    report.warnings.extend(record.summary.lost.clone());
    report.warnings.extend(record.summary.warnings.clone());
    let orders = visible_orders(args, record.rate_hz, &mut report.warnings)?;
    let fundamental = if args.refine {
        let span = 0.01 * args.refine_span;
        refine_fundamental(samples, record.rate_hz, args.fundamental, span, &orders)?
    } else {
        Fundamental::given(args.fundamental)
    };
    // Far from zero, a phase there would be an extrapolation over many periods.
    let reference_s = if record.start_s.abs() > FAR_FROM_ZERO * duration_s {
        record.start_s
    } else {
        0.0
    };
    let start_s = record.start_s - reference_s;
    let found = harmonics::fit(samples, record.rate_hz, start_s, fundamental, &orders)?;

    let inverse = stand.inverse()?;
    let printed = 1.0 / chain.applied.factor;
    report.samples = samples.len();
    report.duration_s = duration_s;
    report.fundamental_hz = fundamental.frequency_hz;
    report.fundamental_std_hz = fundamental.std_hz;
    report.phase_reference_s = reference_s;
    report.mean = found.mean * inverse(0.0).re * printed;
    report.residual_rms = found.residual_rms * printed;
    report.components = found
        .components
        .iter()
        .map(|c| component(c, inverse(c.frequency_hz), printed, stand, chain))
        .collect();
    report.warnings.extend(lost_warning(&report.components));
    report
        .warnings
        .extend(mains_warning(&report.components, duration_s));
    let wrong = wrong(record, printed, report);
    report.warnings.extend(wrong);
    Ok(())
}

/// What is wrong with the record.
fn wrong(record: &Record, printed: f64, report: &Report) -> Vec<Warning> {
    let samples = &record.samples;
    let of = excerpt::Of {
        name: &report.channel,
        unit: &report.unit,
        scale: printed,
        rate_hz: record.rate_hz,
        start_s: record.start_s,
        samples: samples.len(),
    };
    excerpt::warnings(&samples[..samples.len().min(excerpt::OF_MEMORY)], of)
}

/// Orders below half the sampling rate; those above are said.
fn visible_orders(
    args: &Harmonics,
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
        return Err(Failure::failed(format_args!(
            "no order of {} Hz lies below half the sampling rate of {} Hz; ask for lower orders or \
             record faster",
            print::short(args.fundamental),
            print::short(rate_hz)
        )));
    }
    if let (Some(first), Some(last)) = (unseen.first(), unseen.last()) {
        warnings.push(Warning::new(
            "orders-above-nyquist",
            format!(
                "orders {} to {} were left out: they lie above half the sampling rate of {} Hz",
                print::short(*first),
                print::short(*last),
                print::short(rate_hz)
            ),
        ));
    }
    Ok(seen)
}

fn component(
    fitted: &harmonics::Component,
    inverse: Complex64,
    printed: f64,
    stand: &Stand,
    chain: &Chain,
) -> Component {
    let factor = inverse.norm();
    let recorded = fitted.phasor.norm() * printed;
    let torque = recorded * factor;
    let of_stand = super::uncertainty(stand, chain, fitted.frequency_hz);
    Component {
        order: fitted.order,
        frequency_hz: fitted.frequency_hz,
        recorded,
        recorded_phase_deg: fitted.phasor.arg().to_degrees(),
        factor,
        torque,
        phase_deg: (fitted.phasor * inverse).arg().to_degrees(),
        std: fitted.std_amplitude * printed * factor,
        phase_std_deg: fitted.std_phase_rad.map(f64::to_degrees),
        std_stand: of_stand.as_ref().map(|u| u.magnitude_relative * torque),
        phase_std_stand_deg: of_stand.as_ref().map(|u| u.phase_rad.to_degrees()),
    }
}

/// Orders of a slower shaft that lie where lines of the mains lie: one record cannot tell them apart.
fn mains_warning(components: &[Component], duration_s: f64) -> Option<Warning> {
    let doubtful: Vec<String> = components
        .iter()
        .filter(|c| c.order > 1.0 && c.torque > 5.0 * c.std)
        .filter(|c| {
            [50.0, 60.0].iter().any(|grid_hz| {
                let line = (c.frequency_hz / grid_hz).round().clamp(1.0, MAINS_LINES) * grid_hz;
                let slower = c.frequency_hz / c.order < 0.9 * grid_hz;
                slower && (c.frequency_hz - line).abs() < 1.0 / duration_s
            })
        })
        .map(|c| format!("{} ({:.2} Hz)", print::short(c.order), c.frequency_hz))
        .collect();
    (!doubtful.is_empty()).then(|| {
        Warning::new(
            "order-or-mains",
            format!(
                "orders {} lie where lines of the mains lie; at one speed order and mains cannot be told apart: record at \
                 another speed, where an order moves and the mains stay",
                doubtful.join(", ")
            ),
        )
    })
}

fn lost_warning(components: &[Component]) -> Option<Warning> {
    let lost: Vec<String> = components
        .iter()
        .filter(|c| c.torque < 2.0 * c.std)
        .map(|c| print::short(c.order))
        .collect();
    (!lost.is_empty()).then(|| {
        Warning::new(
            "components-lost-in-noise",
            format!(
                "orders {} do not exceed twice their own uncertainty: they may be zero",
                lost.join(", ")
            ),
        )
    })
}
