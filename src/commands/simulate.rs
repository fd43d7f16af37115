//! `simulate`: the stand's answer to a given input.

use torqcomp_model::effects::Action;
use torqcomp_model::simulate::{Fixed, Input, Model, State, substeps};

use super::{Outcome, conclude};
use crate::cli::Simulate;
use crate::failure::Failure;
use crate::io::csv::Place;
use crate::io::digits;
use crate::io::output::Output;
use crate::report;
use crate::signal::Together;
use crate::stand::{self, Given, Stand};

/// Relative change of the result at which the step of integration is fine enough.
const FINE: f64 = 1e-5;
/// Most steps from sample to sample.
const MOST_SUBSTEPS: usize = 256;

/// Runs the verb.
pub fn run(args: &Simulate) -> Result<Outcome, Failure> {
    let stand = stand::read(&args.stand)?;
    let options = args
        .axis
        .options(args.applied.as_deref(), args.unit.as_deref());
    let read = Together::read(&Place::of(&args.input), &[options])?;
    let chosen = &read.tracks[0];
    let inputs = [args.input.as_ref(), args.stand.as_path()];
    let mut output = Output::open(args.result.output.as_deref(), args.result.force, &inputs)?;
    let (gain, factor) = scales(&stand, chosen.unit.as_ref().map(|u| u.unit.factor()))?;
    let applied: Vec<f64> = chosen.samples.iter().map(|u| u * factor.applied).collect();
    let model = model(&stand, gain)?;
    let (simulated, steps) = refined(&model, &applied, read.rate_hz, read.start_s)?;
    let mut text = String::from("time_s,measured\n");
    for (i, value) in simulated.iter().enumerate() {
        let time_s = read.start_s + i as f64 / read.rate_hz;
        text.push_str(&digits::text(time_s, 12));
        text.push(',');
        let mut cell = Vec::new();
        digits::write(
            &mut cell,
            (value + stand.diagnosed.offset) / factor.measured,
            args.digits,
        );
        text.push_str(&String::from_utf8_lossy(&cell));
        text.push('\n');
    }
    output.write(text.as_bytes())?;
    output.finish()?;
    if !args.quiet {
        report::say(&format!(
            "simulated {} samples at {} Hz from rest, {steps} steps a sample, with {}\n",
            simulated.len(),
            report::short(read.rate_hz),
            if stand.effects.is_empty() {
                "no effects".to_owned()
            } else {
                names(&stand)
            }
        ));
    }
    let warnings: Vec<_> = read.lost.iter().chain(&read.warnings).cloned().collect();
    Ok(conclude(&warnings, read.lost.is_some(), false))
}

fn names(stand: &Stand) -> String {
    let names: Vec<&str> = stand.effects.iter().map(|e| e.effect.name).collect();
    names.join(", ")
}

/// SI units per unit of the files.
struct Scales {
    applied: f64,
    measured: f64,
}

/// Gain in SI units, and the units of the files.
fn scales(stand: &Stand, applied: Option<f64>) -> Result<(f64, Scales), Failure> {
    let factor = |text: &str| {
        torqcomp_model::Unit::parse(text)
            .map(|unit| unit.factor())
            .map_err(Failure::failed)
    };
    let gain = match &stand.mechanics()?.given {
        Given::Modal {
            static_gain: Some(gain),
            ..
        } => Some(gain),
        _ => None,
    };
    let applied = match (applied, gain) {
        (Some(factor), _) => factor,
        (None, Some(gain)) => factor(&gain.applied_unit)?,
        (None, None) => 1.0,
    };
    let measured = match (&stand.diagnosed.measured_unit, gain) {
        (Some(unit), _) => factor(unit)?,
        (None, Some(gain)) => factor(&gain.recorded_unit)?,
        (None, None) => applied,
    };
    // A record in volts of a stand with a calibration is torque over that constant.
    let volts = stand
        .diagnosed
        .measured_unit
        .as_deref()
        .is_some_and(|unit| {
            torqcomp_model::Kind::Voltage
                .parse(&format!("1 {unit}"))
                .is_ok()
        });
    let per_volt = stand
        .torque_per_volt
        .as_ref()
        .map(torqcomp_model::Estimate::value);
    let measured = match (volts && gain.is_none(), per_volt) {
        (true, Some(constant)) => measured * constant,
        _ => measured,
    };
    Ok((gain.map_or(1.0, |g| g.value), Scales { applied, measured }))
}

/// The stand with its effects.
fn model(stand: &Stand, gain: f64) -> Result<Model, Failure> {
    let recorder = stand.recorder.recorder.clone();
    let actions = stand.effects.iter().map(stand::DeclaredEffect::action);
    Ok(Model {
        mode: stand.mode()?,
        gain,
        shift: stand.diagnosed.shift,
        recorder: (!recorder.is_ideal()).then(|| -> Fixed {
            std::sync::Arc::new(move |frequency_hz| recorder.response(frequency_hz))
        }),
        actions: actions
            .filter(|(_, a)| !matches!(a, Action::Lines(_)))
            .collect(),
    })
}

/// The record from rest, its step halved until that changes nothing that matters; and the steps a sample.
fn refined(
    model: &Model,
    applied: &[f64],
    rate_hz: f64,
    start_s: f64,
) -> Result<(Vec<f64>, usize), Failure> {
    if applied.len() < 2 {
        return Err(Failure::failed(
            "the record has fewer than two samples; nothing can be simulated",
        ));
    }
    let run = |steps: usize| {
        let input = Input::new(applied.to_vec(), rate_hz, start_s, steps);
        model.simulate_from(&input, State::default())
    };
    let mut steps = substeps(model.mode.omega_rad_s / std::f64::consts::TAU, rate_hz);
    let mut last = run(steps);
    loop {
        let finer = run(2 * steps);
        steps *= 2;
        let rms = |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>().sqrt();
        let change = rms(&mut finer.iter().zip(&last).map(|(a, b)| a - b));
        let size = rms(&mut finer.iter().copied());
        if !size.is_finite() {
            return Err(Failure::failed(
                "the simulated motion leaves all bounds: with these effects the stand is not stable for this input",
            ));
        }
        if change <= FINE * size || steps >= MOST_SUBSTEPS {
            return Ok((finer, steps));
        }
        last = finer;
    }
}
