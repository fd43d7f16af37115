//! Conversion of a recorded channel to the applied quantity: unit, calibration, response.

use torqcomp_dsp::conversion::Conversion;
use torqcomp_model::{Dimension, Estimate, Kind, RatioOf, Unit, UnitSystem};

use super::gain_unit;
use super::static_law::StaticLaw;
use super::{ConstantStd, Stand, TransducerSignal, heading_scale};
use crate::failure::{ErrorCode, Failure};
use crate::print::rounded;
use crate::unit::{NamedUnit, OF_FULL_SCALE, RecordedChannel};
use crate::warning::{Warning, WarningCode};

/// The applied quantity: its name and printed unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Applied {
    /// `torque`, `force`, or `applied` for anything else.
    pub name: &'static str,
    /// Printed unit.
    pub unit: String,
    /// SI units per printed unit.
    pub factor: f64,
}

/// Conversion of one channel of a record to the applied quantity.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// SI units per unit of the record.
    pub recorded_factor: f64,
    /// The recorded signal; `None` for torque and for a record covered only by a static gain.
    pub signal: Option<TransducerSignal>,
    /// Static conversion from the record to the applied quantity, both in SI units.
    pub conversion: Conversion,
    /// Constant found in the records by a diagnosis, as static applied quantity in SI units.
    pub zero: f64,
    /// Standard uncertainty due to the given record at no load, in SI units of the applied quantity.
    pub zero_std: Option<f64>,
    /// Result of the conversion.
    pub applied: Applied,
    /// Origin of the static constant, as text.
    pub described: String,
    /// Uncertainty of the static constant.
    pub std: ConstantStd,
    /// The record at no load from the stand file, with its signal, in SI units.
    pub given_zero: Option<(TransducerSignal, f64)>,
    /// Rated torque of the transducer in N m, if given.
    pub rated_n_m: Option<f64>,
    /// Assumptions made.
    pub warnings: Vec<Warning>,
}

/// Largest magnitude, relative to the given record at no load, of a record to which that does not
/// belong.
const NEAR_NOTHING: f64 = 0.1;
/// Torque relative to the rated one up to which a full load in the opposite direction explains such
/// a record.
const FULL_LOAD: f64 = 1.2;
/// Maximum output voltage of a bridge amplifier in V.
const MOST_VOLTS: f64 = 30.0;

/// Checks of a record against its calibration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RecordedLevels {
    /// The given record at no load, as text; empty if none.
    zero: String,
    /// The applied quantity for a record of zero, in SI units.
    of_nothing: f64,
    /// The applied quantity per volt, in SI units, for a record in V.
    per_volt: Option<f64>,
    rated_n_m: Option<f64>,
}

impl Calibration {
    /// Checks of a record against this calibration.
    pub fn levels(&self) -> RecordedLevels {
        let of = |recorded: f64| self.conversion.convert(recorded).ok();
        let of_nothing = of(0.0).unwrap_or(0.0);
        let is_in_volts =
            self.signal == Some(TransducerSignal::Voltage) && self.recorded_factor == 1.0;
        let slope = of(1.0).map(|one| one - of_nothing);
        RecordedLevels {
            zero: self
                .given_zero
                .filter(|(_, zero)| *zero != 0.0)
                .map_or_else(String::new, |(signal, zero)| signal.text(zero)),
            of_nothing,
            per_volt: slope.filter(|slope| is_in_volts && *slope != 0.0),
            rated_n_m: self.rated_n_m,
        }
    }
}

impl RecordedLevels {
    /// Warnings about recorded samples in SI units of the applied quantity; `scale` converts them to the printed unit.
    pub fn warnings(&self, samples: &[f64], scale: f64, unit: &str) -> Vec<Warning> {
        let far = self.zero_far(samples, scale, unit);
        far.into_iter().chain(self.volts(samples)).collect()
    }

    /// A warning if the record is negligible compared with the given record at no load, so that the result is little
    /// more than an offset.
    fn zero_far(&self, samples: &[f64], scale: f64, unit: &str) -> Option<Warning> {
        let offset = self.of_nothing;
        let is_near = |t: &f64| (t - offset).abs() <= NEAR_NOTHING * offset.abs();
        let is_full_load = self
            .rated_n_m
            .is_some_and(|rated| offset.abs() <= FULL_LOAD * rated);
        if self.zero.is_empty()
            || is_full_load
            || samples.is_empty()
            || !samples.iter().all(is_near)
        {
            return None;
        }
        Some(WarningCode::ZeroFarFromRecord.warning(format!(
            "[recorder] zero = \"{}\" is more than {} times any sample of the record: the result is little more \
             than an offset of about {} {unit}; check the value of the zero and its unit",
            self.zero,
            rounded(1.0 / NEAR_NOTHING, 2),
            rounded(offset * scale, 3)
        )))
    }

    /// A warning if most of a record in V exceeds the output of a bridge amplifier.
    fn volts(&self, samples: &[f64]) -> Option<Warning> {
        let per_volt = self.per_volt?;
        let volts = samples
            .iter()
            .map(|t| ((t - self.of_nothing) / per_volt).abs());
        let beyond = volts.clone().filter(|v| *v > MOST_VOLTS).count();
        (2 * beyond > samples.len()).then(|| {
            WarningCode::VoltsUnusual.warning(format!(
                "the record reaches {} V, more than bridge amplifiers and recorders output; if it is in mV, give \
                 --unit mV",
                rounded(volts.fold(0.0, f64::max), 3)
            ))
        })
    }
}

impl Applied {
    /// Column heading: `torque_n_m`, `torque_ft_lbf`, `applied_v`.
    pub fn heading(&self) -> String {
        let unit: String = self
            .unit
            .to_lowercase()
            .chars()
            .map(|c| if c.is_alphanumeric() { c } else { '_' })
            .collect();
        if unit.is_empty() {
            self.name.to_owned()
        } else {
            format!("{}_{unit}", self.name)
        }
    }

    fn of(kind: Kind, name: &'static str, units: UnitSystem) -> Self {
        Self {
            name,
            unit: kind.unit(units).to_owned(),
            factor: 1.0 / kind.to(units, 1.0),
        }
    }
}

/// The applied quantity for its unit, in the requested unit system.
///
/// # Errors
/// If the unit is not known.
pub fn applied_by_unit(text: &str, units: UnitSystem) -> Result<Applied, Failure> {
    let unit = Unit::parse(text).map_err(Failure::of(ErrorCode::UnitUnclear))?;
    Ok(match unit.dimension() {
        Dimension::TORQUE => Applied::of(Kind::Torque, "torque", units),
        Dimension::FORCE => Applied::of(Kind::Force, "force", units),
        _ => Applied {
            name: "applied",
            unit: if unit.dimension() == Dimension::NONE {
                String::new()
            } else {
                text.to_owned()
            },
            factor: unit.factor(),
        },
    })
}

impl Calibration {
    /// Calibration of an already compensated channel: it is the applied quantity in its unit.
    ///
    /// # Errors
    /// If the unit is not known.
    pub fn of_compensated(channel: RecordedChannel, units: UnitSystem) -> Result<Self, Failure> {
        let named = channel.unit.ok_or_else(|| {
            let name = channel.name;
            ErrorCode::UnitUnclear.failed(format_args!(
                "the channel \"{name}\" has no unit; give it with --unit \"N m\" (or \"ft lbf\", N)"
            ))
        })?;
        Ok(Self {
            recorded_factor: named.unit.factor(),
            signal: None,
            conversion: Conversion::linear(1.0, 0.0)
                .map_err(Failure::of(ErrorCode::InvalidStand))?,
            zero: 0.0,
            zero_std: None,
            applied: applied_by_unit(&named.text, units)?,
            described: "compensated already; used without change".to_owned(),
            std: ConstantStd::NotNeeded,
            given_zero: None,
            rated_n_m: None,
            warnings: Vec::new(),
        })
    }
}

impl Stand {
    /// The calibration of a channel.
    ///
    /// # Errors
    /// If its unit is unknown, or the stand file does not define its conversion to torque.
    pub fn calibration(
        &self,
        channel: RecordedChannel,
        units: UnitSystem,
    ) -> Result<Calibration, Failure> {
        let named = channel.unit.ok_or_else(|| without_unit(channel))?;
        if let Some(gain) = self.static_gain() {
            return self.by_static_gain(channel.name, named, gain, units);
        }
        let signal = TransducerSignal::of(&named.unit);
        let law = match (named.unit.dimension(), signal) {
            (_, Some(signal)) => self.by_signal(signal, channel.name, named, units)?,
            (Dimension::TORQUE, _) => StaticLaw {
                described: format!("the record is torque in {}", named.text),
                std: ConstantStd::NotNeeded,
                ..StaticLaw::of(Conversion::linear(1.0, 0.0))?
            },
            _ => return Err(no_torque(channel, named)),
        };
        Ok(Calibration {
            recorded_factor: signal.map_or(named.unit.factor(), |s| s.factor(&named.unit)),
            signal,
            zero_std: self.zero_std(signal, &law.conversion),
            conversion: law.conversion,
            zero: self.diagnosed.offset,
            applied: Applied::of(Kind::Torque, "torque", units),
            described: law.described,
            std: law.std,
            given_zero: self
                .zero_as(signal)
                .zip(signal)
                .map(|(z, of)| (of, z.value())),
            rated_n_m: self.rated_n_m(),
            warnings: law
                .warnings
                .into_iter()
                .chain(heading_scale::unapplied(channel))
                .chain(self.unused_zero(signal, named))
                .collect(),
        })
    }

    /// The given record at no load, if it is of that signal.
    fn zero_as(&self, signal: Option<TransducerSignal>) -> Option<&Estimate> {
        let (of, zero) = self.recorder.zero.as_ref()?;
        (Some(*of) == signal).then_some(zero)
    }

    /// Standard uncertainty of the record at no load as torque, in N m.
    fn zero_std(&self, signal: Option<TransducerSignal>, conversion: &Conversion) -> Option<f64> {
        let of_calibration = || {
            let measured = self.calibration.as_ref()?;
            let is_its_own = Some(measured.signal) == signal;
            is_its_own.then_some(measured.zero.as_ref()).flatten()
        };
        let zero = self.zero_as(signal).or_else(of_calibration)?;
        let std = zero.std_uncertainty()?;
        let torque = |side: f64| conversion.convert(zero.value() + side * std).ok();
        Some(0.5 * (torque(1.0)? - torque(-1.0)?).abs())
    }

    /// A warning if the file gives the record at no load in a quantity other than the record's.
    fn unused_zero(&self, signal: Option<TransducerSignal>, named: &NamedUnit) -> Option<Warning> {
        let (of, zero) = self.recorder.zero.as_ref()?;
        (zero.value() != 0.0 && Some(*of) != signal).then(|| {
            WarningCode::ZeroNotUsed.warning(format!(
                "[recorder] zero of {} is in {}, but the record is in {}: the zero was not subtracted",
                self.file,
                of.usual_unit().0,
                named.text
            ))
        })
    }

    /// Rated torque of the transducer in N m, if given in `[calibration]`.
    fn rated_n_m(&self) -> Option<f64> {
        self.calibration.as_ref()?.rated_n_m
    }

    /// Static gain, recorded over applied quantity, if the stand file gives it.
    pub(crate) fn static_gain(&self) -> Option<&super::StaticGain> {
        self.mechanics.as_ref()?.static_gain.as_ref()
    }

    fn by_static_gain(
        &self,
        channel: &str,
        named: &NamedUnit,
        gain: &super::StaticGain,
        units: UnitSystem,
    ) -> Result<Calibration, Failure> {
        gain_unit::check(&self.file, channel, named, gain)?;
        // A zero in volts belongs to a record in volts.
        let zero = self.zero_as(TransducerSignal::of(&named.unit));
        let at_rest = zero.map_or(0.0, Estimate::value);
        let slope = 1.0 / gain.value;
        Ok(Calibration {
            recorded_factor: named.unit.factor(),
            signal: None,
            conversion: Conversion::linear(slope, -slope * at_rest)
                .map_err(Failure::of(ErrorCode::InvalidStand))?,
            zero_std: zero
                .and_then(Estimate::std_uncertainty)
                .map(|std| (slope * std).abs()),
            zero: slope * self.diagnosed.offset,
            applied: applied_by_unit(&gain.applied_unit, units)?,
            described: "static gain of the stand file".to_owned(),
            std: ConstantStd::of(gain.relative_std),
            given_zero: zero
                .zip(TransducerSignal::of(&named.unit))
                .map(|(z, of)| (of, z.value())),
            rated_n_m: None,
            warnings: Vec::new(),
        })
    }
}

/// Failure that asks for a unit.
fn without_unit(channel: RecordedChannel) -> Failure {
    let name = channel.name;
    if let Some(scaled) = heading_scale::scaled_unit(channel) {
        return ErrorCode::UnitUnclear.failed(format_args!(
            "the unit of the channel \"{name}\" contains a scale factor, \"{scaled}\"; scale the numbers to a plain unit \
             and rename the column, or give their unit with --unit if they are not scaled"
        ));
    }
    match channel.unit_text {
        None => ErrorCode::UnitUnclear.failed(format_args!(
            "the channel \"{name}\" has no unit; give it: --unit V for the output of an amplifier or recorder \
             (likewise mV/V, mA, Hz, ustrain), --unit \"N m\" (or N) for a torque (or force), as from simulate"
        )),
        Some(OF_FULL_SCALE) => ErrorCode::UnitUnclear.failed(format_args!(
            "the samples of the channel \"{name}\" are fractions of full scale, which the file does not state; \
             give it with its unit, as --full-scale \"10 V\""
        )),
        Some(text) => channel.unknown_unit(
            text,
            "give a known one with --unit, such as V, mV/V, \"N m\"",
        ),
    }
}

/// Failure for a unit that gives no torque, with the question that resolves it.
fn no_torque(channel: RecordedChannel, named: &NamedUnit) -> Failure {
    let (name, text) = (channel.name, &named.text);
    if named.unit.ratio_of() == Some(RatioOf::Anything) {
        return ErrorCode::UnitUnclear.failed(format_args!(
            "the channel \"{name}\" is in \"{text}\", which could be bridge output over excitation, a strain, \
             or a fraction of full scale; give --unit \"{text} V/V\" for the first or \"{text} strain\" for the \
             second"
        ));
    }
    if let Some(unclear) = channel.unclear_weight(named) {
        return unclear;
    }
    ErrorCode::UnitUnsuitable.failed(format_args!(
        "the channel \"{name}\" is in \"{text}\" ({}), which cannot be converted to torque; expected volts, \
         mV/V, mA, Hz, strain, torque or force",
        named.unit.dimension()
    ))
}
