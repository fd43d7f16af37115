//! Reading the records of a diagnosis.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use torqcomp_model::simulate::Excitation;
use torqcomp_model::{Dimension, Estimate, UnitSystem};

use super::alike::{make_alike, refuse_same_samples};
use super::declared::{declared, declared_effects, measures, recorder, several, torques_unknown};
use super::{decays, loads, memory, running};
use crate::cli::Diagnose;
use crate::commands::{convert, same};
use crate::diagnose::{
    Case, ChannelUnits, InitialState, KnownLoads, Records, RunningRecord, SourceFiles, StandRecord,
};
use crate::failure::{ErrorCode, Failure};
use crate::file_name::{ShowPath, texts};
use crate::identify::Motion;
use crate::io::{ChannelChoice, Input};
use crate::print::short;
use crate::recording::AlignedChannels;
use crate::stand::{Calibration, Stand, TransducerSignal, si_unit};
use crate::unit::{NamedUnit, RecordedChannel};
use crate::warning::{Warning, WarningCode};

/// Minimum number of samples of a record.
pub(super) const FEWEST: usize = 200;
/// Steps of integration before the natural frequency is known.
const FIRST_STEPS: usize = 2;
/// Samples at the start excluded until the natural frequency is known.
const EXCLUDED: usize = 32;
/// Inverse of the maximum fraction excluded at the start of a decay, where the hit may not be over.
const PART_OF_DECAY: usize = 50;

pub(super) struct Pair {
    pub(super) source: String,
    /// `None` for a free decay.
    pub(super) applied: Option<Vec<f64>>,
    pub(super) measured: Vec<f64>,
    pub(super) rate_hz: f64,
    pub(super) start_s: f64,
    pub(super) applied_unit: Option<NamedUnit>,
    pub(super) measured_unit: Option<NamedUnit>,
    pub(super) warnings: Vec<Warning>,
    pub(super) is_lossy: bool,
}

impl Pair {
    /// The measured channel in the form required by a stand.
    fn measured_channel(&self) -> RecordedChannel<'_> {
        RecordedChannel {
            name: "measured",
            unit: self.measured_unit.as_ref(),
            unit_text: None,
        }
    }

    /// The measured channel in SI units; `calibrated` is the stand that converts it to torque.
    pub(super) fn measured_si(&self, calibrated: Option<&Stand>) -> Result<Vec<f64>, Failure> {
        let Some(stand) = calibrated else {
            let factor = self.measured_unit.as_ref().map_or(1.0, |u| u.unit.factor());
            return Ok(self.measured.iter().map(|y| y * factor).collect());
        };
        let calibration = stand.calibration(self.measured_channel(), UnitSystem::Si)?;
        // The offset of the records is estimated anew, as in records of torque.
        let chain = Calibration {
            zero: 0.0,
            ..calibration
        };
        let mut values = self.measured.clone();
        convert(&chain, &mut values).map_err(|(row, why)| {
            ErrorCode::InvalidSample
                .failed(why)
                .sample(row + 1)
                .at(&self.source)
        })?;
        Ok(values)
    }
}

/// Input data.
pub struct ReadCase {
    pub case: Case,
    /// Loads not used for fitting effects.
    pub loads: Vec<KnownLoads>,
    /// Records with an unknown torque.
    pub running: Vec<RunningRecord>,
    /// Static gain in SI units, as far as given by stand file or units.
    pub declared_gain: Option<Estimate>,
    /// Whether part of a record was lost.
    pub is_lossy: bool,
}

/// Reads all records, and the declarations of the stand file about them.
pub fn read(args: &Diagnose, stand: Option<&Stand>) -> Result<ReadCase, Failure> {
    let [train, holdout, loads, running] = all_pairs(args)?;
    memory::must_fit(args, train.iter().chain(&holdout))?;
    let last_is_held_out = args.train.is_empty() && args.held_out_files().is_empty();
    let first = &train[0];
    let (units, is_calibrated) = units(first, stand, first.applied.is_some() || !loads.is_empty());
    let gain = declared_gain(stand, &units);
    let declared = stand
        .map(|stand| declared(stand, gain.unwrap_or(1.0)))
        .transpose()?;
    let all = || train.iter().chain(&holdout).chain(&loads).chain(&running);
    let mut warnings: Vec<Warning> = all().flat_map(|pair| pair.warnings.clone()).collect();
    let is_lossy = all().any(|pair| pair.is_lossy);
    let calibrated = stand.filter(|_| is_calibrated);
    warnings.extend(stand_warnings(stand, calibrated, first)?);
    let loads = loads.into_iter().map(|pair| loads::known(pair, calibrated));
    let loads = loads.collect::<Result<_, _>>()?;
    let running = running.into_iter().map(|p| running::record(p, calibrated));
    let running = running.collect::<Result<_, _>>()?;
    let convert = |pairs: Vec<Pair>| -> Result<Vec<StandRecord>, Failure> {
        let each = pairs.into_iter();
        each.map(|p| record(p, calibrated, &units)).collect()
    };
    let mut records = Records {
        train: convert(train)?,
        holdout: convert(holdout)?,
    };
    warnings.extend(held_out_instead(&mut records, last_is_held_out));
    let several = stand.map(several).transpose()?.flatten();
    let measures = stand.map_or(Ok(Motion::Displacement), measures)?;
    let is_free = StandRecord::is_free;
    let rings = records.train.iter().chain(&records.holdout).any(is_free);
    let torques_unknown = torques_unknown(several.as_ref(), measures, rings);
    let sees_torques = torques_unknown.is_none();
    warnings.extend(torques_unknown);
    let case = Case {
        sources: SourceFiles {
            stand: args.stand.as_ref().map(|p| p.shown().to_string()),
            train: texts(&args.training_files()),
            holdout: texts(&args.held_out_files()),
        },
        records,
        declared,
        several,
        declared_effects: declared_effects(stand),
        // The gain is not identifiable from free decays.
        gain_is_declared: gain.is_some() && static_gain(stand).is_none() || args.train.is_empty(),
        measures,
        sees_torques,
        recorder: stand.and_then(recorder),
        units,
        warnings,
    };
    Ok(ReadCase {
        case,
        loads,
        running,
        declared_gain: gain.map(|gain| with_declared_std(gain, stand)),
        is_lossy,
    })
}

/// Warnings of the stand file, and of the calibration that converts the measured quantity.
fn stand_warnings(
    stand: Option<&Stand>,
    calibrated: Option<&Stand>,
    first: &Pair,
) -> Result<Vec<Warning>, Failure> {
    let mut warnings = stand.map_or_else(Vec::new, |stand| stand.warnings.clone());
    if let Some(stand) = calibrated {
        let calibration = stand.calibration(first.measured_channel(), UnitSystem::Si)?;
        warnings.extend(calibration.warnings);
    }
    Ok(warnings)
}

/// The training and hold-out records, the known loads and the running records, all of one kind.
fn all_pairs(args: &Diagnose) -> Result<[Vec<Pair>; 4], Failure> {
    let (mut train, mut holdout) = pairs(args)?;
    train[0]
        .warnings
        .extend(same::files(&args.training_files()).0);
    let loads = loads::pairs(args)?;
    if let (Some(load), true) = (loads.first(), args.train.is_empty()) {
        // They determine the unit of the gain.
        for pair in train.iter_mut().chain(&mut holdout) {
            pair.applied_unit.clone_from(&load.applied_unit);
        }
    }
    let (first, others) = train.split_first_mut().expect("a training record");
    for other in others.iter_mut().chain(&mut holdout) {
        make_alike(first, other)?;
    }
    let first = &train[0];
    refuse_same_samples(&train, &holdout)?;
    loads::check_units(&loads, first)?;
    let running = running::pairs(args, first)?;
    Ok([train, holdout, loads, running])
}

/// Holds out the ends of the training records if there is no hold-out record; reports what is held out in place of a
/// given hold-out record.
fn held_out_instead(records: &mut Records, last_is_held_out: bool) -> Option<Warning> {
    let instead = match (last_is_held_out, records.holdout.is_empty()) {
        (true, _) => "the last decay is",
        (false, true) => {
            records.hold_out_ends();
            "the last 30 % of each training record are"
        }
        (false, false) => return None,
    };
    Some(WarningCode::NoRecordHeldOut.warning(format!(
        "no hold-out record was given; {instead} held out instead"
    )))
}

/// The training and hold-out records.
fn pairs(args: &Diagnose) -> Result<(Vec<Pair>, Vec<Pair>), Failure> {
    let all = |files: &[PathBuf], of_decays: &[PathBuf]| -> Result<Vec<Pair>, Failure> {
        let mut all = Vec::new();
        for file in files {
            all.push(pair(args, file)?);
        }
        for file in of_decays {
            all.extend(decays::decays(args, file)?);
        }
        Ok(all)
    };
    let mut train = all(&args.train, &args.decay)?;
    let mut holdout = all(&args.holdout, &args.holdout_decay)?;
    if holdout.is_empty() && args.train.is_empty() {
        holdout.extend(decays::last(&mut train)?);
    }
    Ok((train, holdout))
}

/// The columns of applied and measured quantity; `without`: message if the first is not named.
pub(super) fn two_columns(args: &Diagnose, without: &str) -> Result<[ChannelChoice; 2], Failure> {
    let applied = args.applied.as_deref();
    let applied = applied.ok_or_else(|| ErrorCode::MissingArgument.usage(without))?;
    if applied == args.measured {
        return Err(
            ErrorCode::ConflictingArguments.usage("--applied and --measured name the same column")
        );
    }
    Ok(ChannelChoice::applied_and_measured(
        [applied, &args.measured],
        [args.applied_unit.as_deref(), args.measured_unit.as_deref()],
    ))
}

fn pair(args: &Diagnose, file: &Path) -> Result<Pair, Failure> {
    let choices = two_columns(
        args,
        "--train and --holdout need --applied COL, the channel with the applied quantity; give free decays, which have \
         none, with --decay and --holdout-decay",
    )?;
    let mut read = AlignedChannels::read(&Input::of(file), &choices, &args.reading)?;
    let measured = read.channels.swap_remove(1);
    let applied = read.channels.swap_remove(0);
    measured.must_be_as_recorded(&read.source)?;
    let count = applied.samples.len();
    if count < FEWEST {
        return Err(ErrorCode::TooFewSamples.failed(format_args!(
            "{count} samples are too few; a diagnosis needs at least {FEWEST}, and ten periods of the stand"
        ))
        .at(&read.source));
    }
    Ok(Pair {
        source: read.source,
        applied: Some(applied.samples),
        measured: measured.samples,
        rate_hz: read.rate_hz,
        start_s: read.start.after_s,
        applied_unit: applied.unit,
        measured_unit: measured.unit,
        warnings: read.warnings,
        is_lossy: read.is_lossy,
    })
}

/// The static gain given by a stand file in place of constants in units of torque.
fn static_gain(stand: Option<&Stand>) -> Option<f64> {
    stand?.static_gain().map(|gain| gain.value)
}

/// Units of the channels, and whether the stand's calibration converts the measured one to torque; `acts`: whether
/// there is an applied quantity or known loads.
fn units(pair: &Pair, stand: Option<&Stand>, acts: bool) -> (ChannelUnits, bool) {
    let channels = [&pair.applied_unit, &pair.measured_unit];
    let [applied_text, measured_text] =
        channels.map(|unit| unit.as_ref().map_or_else(String::new, |u| u.text.clone()));
    let [applied, measured] = channels.map(|unit| unit.as_ref().map(|u| u.unit.dimension()));
    // Without an applied quantity, its unit is arbitrary.
    let applied = if acts {
        applied
    } else {
        Some(Dimension::TORQUE)
    };
    let factors = channels.map(|unit| unit.as_ref().map_or(1.0, |u| u.unit.factor()));
    let is_torque_stand = static_gain(stand).is_none();
    let signal = pair
        .measured_unit
        .as_ref()
        .and_then(|named| TransducerSignal::of(&named.unit));
    let has_calibration = stand.is_some_and(|s| {
        let of = s.calibration.as_ref().map(|c| c.signal);
        let is_of_bridge = matches!(
            signal,
            Some(TransducerSignal::Voltage | TransducerSignal::Ratio)
        );
        is_torque_stand
            && s.mechanics.is_some()
            && (is_of_bridge && (of.is_some() || s.bridge.is_some())
                || signal.is_some() && of == signal)
    });
    let is_calibrated = applied == Some(Dimension::TORQUE) && has_calibration;
    let is_torque =
        applied == Some(Dimension::TORQUE) && measured == Some(Dimension::TORQUE) || is_calibrated;
    let diagnosed = match is_torque {
        true => "N m".to_owned(),
        false => si_unit(&measured_text),
    };
    let units = ChannelUnits {
        applied: applied_text,
        measured: measured_text,
        per_printed: match is_torque || diagnosed.is_empty() {
            true => 1.0,
            false => factors[1],
        },
        is_torque,
        diagnosed,
        factors,
    };
    (units, is_calibrated)
}

/// A declared gain with its standard uncertainty from the stand file.
fn with_declared_std(gain: f64, stand: Option<&Stand>) -> Estimate {
    let given = stand.and_then(Stand::static_gain);
    let relative = given.and_then(|given| given.relative_std);
    Estimate::of("", gain, relative.map(|std| std * gain.abs()))
}

/// The static gain as far as declared: 1 from torque to torque.
fn declared_gain(stand: Option<&Stand>, units: &ChannelUnits) -> Option<f64> {
    static_gain(stand).or(units.is_torque.then_some(1.0))
}

/// The record of two channels in SI units; `calibrated` is the stand that converts the measured one to torque.
fn record(
    pair: Pair,
    calibrated: Option<&Stand>,
    units: &ChannelUnits,
) -> Result<StandRecord, Failure> {
    let applied_factor = units.factors[0];
    let is_free = pair.applied.is_none();
    let applied: Vec<f64> = match &pair.applied {
        Some(applied) => applied.iter().map(|u| u * applied_factor).collect(),
        None => vec![0.0; pair.measured.len()],
    };
    let measured = pair.measured_si(calibrated)?;
    if !is_free {
        refuse_constant(&pair.source, "applied", &applied)?;
    }
    refuse_constant(&pair.source, "measured", &measured)?;
    let count = measured.len();
    let (rate_hz, start_s) = (pair.rate_hz, pair.start_s);
    Ok(StandRecord {
        source: pair.source,
        input: Arc::new(Excitation::new(applied, rate_hz, start_s, FIRST_STEPS)),
        measured: Arc::new(measured),
        range: match is_free {
            true => EXCLUDED.min(count / PART_OF_DECAY)..count,
            false => EXCLUDED.min(count / 10)..count,
        },
        initial: InitialState::default(),
        is_held: false,
        whitening: None,
    })
}

fn refuse_constant(source: &str, which: &str, values: &[f64]) -> Result<(), Failure> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let spread = values.iter().fold(0.0_f64, |m, v| m.max((v - mean).abs()));
    if spread > 1e-12 * mean.abs() {
        return Ok(());
    }
    Err(ErrorCode::UnsuitableRecord
        .failed(format_args!(
            "the {which} channel is constant ({}): a diagnosis needs excitation; check the column",
            short(mean)
        ))
        .at(source))
}
