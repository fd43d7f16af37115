//! Reading the records of a diagnosis.

use std::sync::Arc;

use torqcomp_model::Dimension;
use torqcomp_model::simulate::{Excitation, substeps};

use crate::cli::Diagnose;
use crate::diagnose::{Begin, Case, Constants, Record, set_substeps};
use crate::failure::Failure;
use crate::io::Input;
use crate::io::csv::NamedUnit;
use crate::print::unit_or_as_recorded;
use crate::signal::Together;
use crate::stand::{Given, Stand};
use crate::warning::Warning;

/// Part of a training record that is fitted where none is held out.
const FITTED: f64 = 0.7;
/// Fewest samples of a record.
const FEWEST: usize = 200;
/// Steps of integration before the natural frequency is known.
const FIRST_STEPS: usize = 2;
/// Samples at both ends that are left out at least, where the continuation beyond them is felt most.
const LEFT_OUT: usize = 32;
/// Part of a record that is left out at its start, and at its end: a second mode, a filter or a joint fades more slowly
/// than the stand, and a complex stiffness answers before its cause.
const PARTS_LEFT_OUT: [f64; 2] = [0.04, 0.01];
/// Time constants of the stand that are left out at the start: what recorder and joints remember of the time before the
/// record has faded then.
const SETTLING: f64 = 3.0;
/// Largest part of a record that is left out.
const MOST_LEFT_OUT: f64 = 0.1;

const TORQUE: Dimension = Dimension::new([1, 2, -2, 0, 0, 0]);
const VOLTAGE: Dimension = Dimension::new([1, 2, -3, -1, 0, 0]);

/// Units of the two channels.
pub struct Units {
    /// Of the applied one, in the files; empty if unknown.
    pub applied: String,
    /// Of the measured one, in the files; empty if unknown.
    pub measured: String,
    /// Of the measured one as it is diagnosed: torque, or the SI unit.
    pub diagnosed: String,
    /// SI units of what is diagnosed per printed unit.
    pub printed: f64,
    /// SI units of each channel per unit of its file, applied and measured.
    factors: [f64; 2],
}

impl Units {
    /// Unit of the static gain as it is printed, and its number per SI unit.
    #[must_use]
    pub fn gain(&self) -> (String, f64) {
        let [applied, measured] = self.factors;
        let unit = match (self.measured.as_str(), self.applied.as_str()) {
            ("", "") => unit_or_as_recorded("").to_owned(),
            (measured, "") => format!("{measured} per applied unit"),
            ("", applied) => format!("measured unit per {applied}"),
            (measured, applied) => format!("{measured}/{applied}"),
        };
        (unit, applied / measured)
    }
}

/// The records.
pub struct Read {
    /// What is diagnosed.
    pub case: Case,
    /// Units.
    pub units: Units,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

struct Pair {
    source: String,
    applied: Vec<f64>,
    measured: Vec<f64>,
    rate_hz: f64,
    start_s: f64,
    applied_unit: Option<NamedUnit>,
    measured_unit: Option<NamedUnit>,
    /// What should be known of the file.
    warnings: Vec<Warning>,
}

/// Reads all records and says what is declared of them.
pub fn read(args: &Diagnose, stand: Option<&Stand>) -> Result<Read, Failure> {
    let train: Vec<Pair> = args
        .train
        .iter()
        .map(|f| pair(args, f))
        .collect::<Result<_, _>>()?;
    let hold: Vec<Pair> = args
        .holdout
        .iter()
        .map(|f| pair(args, f))
        .collect::<Result<_, _>>()?;
    let first = &train[0];
    for other in train.iter().chain(&hold) {
        same(first, other)?;
    }
    refuse_same_samples(&train, &hold)?;
    let (units, gain, scale) = units(first, stand)?;
    let declared = stand
        .map(|stand| declared(stand, gain.unwrap_or(1.0)))
        .transpose()?;
    let recorder = stand
        .map(|stand| stand.recorder.recorder.clone())
        .filter(|recorder| !recorder.is_ideal())
        .map(|recorder| {
            let fixed: torqcomp_model::simulate::Fixed = Arc::new(move |hz| recorder.response(hz));
            fixed
        });
    let gain_is_declared = gain.is_some() && !has_static_gain(stand);
    let mut warnings: Vec<Warning> = train
        .iter()
        .chain(&hold)
        .flat_map(|pair| pair.warnings.iter().cloned())
        .collect();
    let convert = |pairs: Vec<Pair>| -> Result<Vec<Record>, Failure> {
        pairs.into_iter().map(|p| record(p, stand, scale)).collect()
    };
    let mut train = convert(train)?;
    let mut hold = convert(hold)?;
    if hold.is_empty() {
        for record in &mut train {
            let cut = (FITTED * record.measured.len() as f64) as usize;
            let mut rest = record.clone();
            rest.range = cut..record.measured.len();
            record.range.end = cut;
            hold.push(rest);
        }
        warnings.push(Warning::new(
            "no-record-held-out",
            "no record was held out: the last 30 % of each training record stand in for one",
        ));
    }
    let case = Case {
        train,
        hold,
        declared,
        gain_is_declared,
        recorder,
        threads: args.work.thread_count(),
    };
    Ok(Read {
        case,
        units,
        warnings,
    })
}

fn pair(args: &Diagnose, file: &str) -> Result<Pair, Failure> {
    if args.applied == args.measured {
        return Err(Failure::usage(
            "--applied and --measured name the same column",
        ));
    }
    let wanted = [
        (&args.applied, &args.applied_unit),
        (&args.measured, &args.measured_unit),
    ]
    .map(|(channel, unit)| args.axis.options(Some(channel), unit.as_deref()));
    let read = Together::read(&Input::of(file), &wanted)?;
    let mut tracks = read.tracks.into_iter();
    let (Some(applied), Some(measured)) = (tracks.next(), tracks.next()) else {
        return Err(Failure::failed(format_args!(
            "{}: two channels are needed",
            read.source
        )));
    };
    let count = applied.samples.len();
    if count < FEWEST {
        return Err(Failure::failed(format_args!(
            "{}: {count} samples are too few; a diagnosis needs at least {FEWEST}, and ten periods of the stand",
            read.source
        )));
    }
    Ok(Pair {
        source: read.source,
        applied: applied.samples,
        measured: measured.samples,
        rate_hz: read.rate_hz,
        start_s: read.start_s,
        applied_unit: applied.unit,
        measured_unit: measured.unit,
        warnings: read.lost.into_iter().chain(read.warnings).collect(),
    })
}

/// Records of one diagnosis must be of one stand, at one rate, in the same units.
fn same(first: &Pair, other: &Pair) -> Result<(), Failure> {
    if (first.rate_hz / other.rate_hz - 1.0).abs() > 1e-4 {
        return Err(Failure::failed(format_args!(
            "{} has {} Hz, {} has {} Hz; the records of a diagnosis must have one sampling rate",
            first.source, first.rate_hz, other.source, other.rate_hz
        )));
    }
    let differ = |a: &Option<NamedUnit>, b: &Option<NamedUnit>| {
        a.as_ref().map(|u| u.unit.factor()) != b.as_ref().map(|u| u.unit.factor())
    };
    if differ(&first.applied_unit, &other.applied_unit)
        || differ(&first.measured_unit, &other.measured_unit)
    {
        return Err(Failure::failed(format_args!(
            "{} and {} have their channels in different units; give --applied-unit and --measured-unit, or convert one",
            first.source, other.source
        )));
    }
    Ok(())
}

/// A held-out record that is fitted as well holds nothing out.
fn refuse_same_samples(train: &[Pair], hold: &[Pair]) -> Result<(), Failure> {
    let is_same = |a: &Pair, b: &Pair| a.measured == b.measured && a.applied == b.applied;
    let pairs = hold.iter().flat_map(|h| train.iter().map(move |t| (h, t)));
    match pairs.into_iter().find(|(h, t)| is_same(h, t)) {
        None => Ok(()),
        Some((h, t)) => Err(Failure::failed(format_args!(
            "{} holds the same samples as the training record {}: nothing would be held out; give another record, or leave \
             --holdout out to keep the last 30 % of each training record back",
            h.source, t.source
        ))),
    }
}

fn has_static_gain(stand: Option<&Stand>) -> bool {
    matches!(
        stand.and_then(|s| s.mechanics.as_ref()).map(|m| &m.given),
        Some(Given::Modal {
            static_gain: Some(_),
            ..
        })
    )
}

/// How the samples of the files become what is diagnosed.
#[derive(Clone, Copy)]
struct Scale {
    applied: f64,
    measured: f64,
    /// Whether the stand's calibration makes torque of the record.
    calibrated: bool,
}

/// Units, the declared gain if there is one, and the scales.
fn units(pair: &Pair, stand: Option<&Stand>) -> Result<(Units, Option<f64>, Scale), Failure> {
    let text =
        |unit: &Option<NamedUnit>| unit.as_ref().map_or_else(String::new, |u| u.text.clone());
    let dimension = |unit: &Option<NamedUnit>| unit.as_ref().map(|u| u.unit.dimension());
    let (applied, measured) = (
        dimension(&pair.applied_unit),
        dimension(&pair.measured_unit),
    );
    let factor = |unit: &Option<NamedUnit>| unit.as_ref().map_or(1.0, |u| u.unit.factor());
    let mut scale = Scale {
        applied: factor(&pair.applied_unit),
        measured: factor(&pair.measured_unit),
        calibrated: false,
    };
    let torque_stand = stand.is_some_and(|s| s.mechanics.is_some()) && !has_static_gain(stand);
    let calibrated = torque_stand
        && measured == Some(VOLTAGE)
        && stand.is_some_and(|s| s.torque_per_volt.is_some() || s.bridge.is_some());
    let torque = applied == Some(TORQUE) && (measured == Some(TORQUE) || calibrated);
    scale.calibrated = torque && calibrated;
    let declared = match stand.and_then(|s| s.mechanics.as_ref()).map(|m| &m.given) {
        Some(Given::Modal {
            static_gain: Some(gain),
            ..
        }) => Some(gain.value),
        _ if torque => Some(1.0),
        _ => None,
    };
    let diagnosed = if torque {
        "N m".to_owned()
    } else {
        crate::stand::si_unit(&text(&pair.measured_unit))
    };
    let printed = if torque || diagnosed.is_empty() {
        1.0
    } else {
        factor(&pair.measured_unit)
    };
    let units = Units {
        applied: text(&pair.applied_unit),
        measured: text(&pair.measured_unit),
        diagnosed,
        printed,
        factors: [scale.applied, scale.measured],
    };
    Ok((units, declared, scale))
}

fn declared(stand: &Stand, gain: f64) -> Result<Constants, Failure> {
    let mode = stand.mode()?;
    Ok(Constants {
        natural_hz: mode.omega_rad_s / std::f64::consts::TAU,
        damping_ratio: mode.damping_ratio,
        gain,
    })
}

fn record(pair: Pair, stand: Option<&Stand>, scale: Scale) -> Result<Record, Failure> {
    let applied: Vec<f64> = pair.applied.iter().map(|u| u * scale.applied).collect();
    let measured: Vec<f64> = match stand.filter(|_| scale.calibrated) {
        None => pair.measured.iter().map(|y| y * scale.measured).collect(),
        Some(stand) => {
            let chain = stand.chain(
                "measured",
                pair.measured_unit.as_ref(),
                torqcomp_model::UnitSystem::Si,
            )?;
            let mut values = pair.measured.clone();
            crate::commands::convert(&chain, &mut values).map_err(|(row, why)| {
                Failure::failed(format_args!("{}: sample {}: {why}", pair.source, row + 1))
            })?;
            values
        }
    };
    refuse_silence(&pair.source, "applied", &applied)?;
    refuse_silence(&pair.source, "measured", &measured)?;
    let count = measured.len();
    Ok(Record {
        source: pair.source,
        input: Arc::new(Excitation::new(
            applied,
            pair.rate_hz,
            pair.start_s,
            FIRST_STEPS,
        )),
        measured: Arc::new(measured),
        range: LEFT_OUT.min(count / 10)..count,
        begin: Begin::default(),
    })
}

fn refuse_silence(source: &str, which: &str, values: &[f64]) -> Result<(), Failure> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let spread = values.iter().fold(0.0_f64, |m, v| m.max((v - mean).abs()));
    if spread > 1e-12 * mean.abs() {
        return Ok(());
    }
    Err(Failure::failed(format_args!(
        "{source}: the {which} channel is constant at {mean}: without excitation nothing can be told; check the column"
    )))
}

impl Read {
    /// Sets the steps of integration and the samples that count for the plain stand that was found.
    pub fn refine(&mut self, found: &Constants) {
        self.leave_out(found);
        self.refine_steps(found.natural_hz);
    }

    fn leave_out(&mut self, found: &Constants) {
        let rate_hz = self.case.train[0].input.rate_hz();
        let decay = found.damping_ratio * std::f64::consts::TAU * found.natural_hz / rate_hz;
        for record in self.case.train.iter_mut().chain(&mut self.case.hold) {
            let count = record.measured.len();
            let most = (MOST_LEFT_OUT * count as f64) as usize;
            let [first, last] =
                PARTS_LEFT_OUT.map(|part| LEFT_OUT.max((part * count as f64) as usize).min(most));
            let settled = ((SETTLING / decay.max(1e-9)) as usize).clamp(first, most);
            record.range.start = record.range.start.max(settled);
            if record.range.end == count {
                record.range.end = count - last;
            }
        }
    }

    fn refine_steps(&mut self, natural_hz: f64) {
        let steps = substeps(natural_hz, self.case.train[0].input.rate_hz());
        if steps != FIRST_STEPS {
            set_substeps(self.case.train.iter_mut().chain(&mut self.case.hold), steps);
        }
    }

    /// Rms of the applied quantity on training and held-out records.
    #[must_use]
    pub fn levels(&self) -> [f64; 2] {
        [&self.case.train, &self.case.hold].map(|records| {
            let count: usize = records.iter().map(Record::count).sum();
            let sum: f64 = records
                .iter()
                .flat_map(|r| &r.input.samples()[r.range.clone()])
                .map(|u| u * u)
                .sum();
            (sum / count as f64).sqrt()
        })
    }
}
