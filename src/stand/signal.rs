//! Signals of a recorder before calibration: volts, a ratio of voltages, a current, a frequency, a strain, a force.

use std::f64::consts::TAU;

use torqcomp_decimal::digits;
use torqcomp_model::{Dimension, Estimate, Kind, RatioOf, Unit, UnitSystem};

use super::section::Section;
use crate::failure::Failure;
use crate::print::rounded;

/// Output quantity of a transducer or its amplifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TransducerSignal {
    /// V.
    Voltage,
    /// Output of a bridge over its excitation, V/V.
    Ratio,
    /// A.
    Current,
    /// Hz.
    Frequency,
    /// Strain, m/m.
    Strain,
    /// N, from a load cell at a lever.
    Force,
}

impl TransducerSignal {
    /// All signals.
    pub const ALL: [Self; 6] = [
        Self::Voltage,
        Self::Ratio,
        Self::Current,
        Self::Frequency,
        Self::Strain,
        Self::Force,
    ];

    /// Signal with this unit; `None` for torque, plain ratios and anything else.
    pub fn of(unit: &Unit) -> Option<Self> {
        match (unit.dimension(), unit.ratio_of()) {
            (Dimension::VOLTAGE, _) => Some(Self::Voltage),
            (Dimension::CURRENT, _) => Some(Self::Current),
            (Dimension::FORCE, _) => Some(Self::Force),
            (_, Some(RatioOf::Voltages)) => Some(Self::Ratio),
            (_, Some(RatioOf::Lengths)) => Some(Self::Strain),
            _ if unit.is_hertz() => Some(Self::Frequency),
            _ => None,
        }
    }

    /// Largest magnitude of such a signal in SI units, and the reason; `None` if unlimited.
    pub fn largest(self) -> Option<(f64, &'static str)> {
        match self {
            Self::Strain => Some((
                0.1,
                "a strain of more than 10 %, beyond any gage: check the unit of the channel (microstrain is --unit \
                 ustrain)",
            )),
            Self::Ratio => Some((
                1.0,
                "more than the supply of the bridge, which is impossible: check the unit of the channel (mV/V, not \
                 V/V)",
            )),
            _ => None,
        }
    }

    /// Kind of the quantity.
    pub fn kind(self) -> Kind {
        match self {
            Self::Voltage => Kind::Voltage,
            Self::Ratio => Kind::VoltageRatio,
            Self::Current => Kind::Current,
            Self::Frequency => Kind::Frequency,
            Self::Strain => Kind::Strain,
            Self::Force => Kind::Force,
        }
    }

    /// SI units of its kind per unit of a record.
    pub fn factor(self, unit: &Unit) -> f64 {
        match self {
            // One hertz is a cycle of 2π rad.
            Self::Frequency => unit.factor() / TAU,
            _ => unit.factor(),
        }
    }

    /// Customary unit, and SI units per that unit.
    pub fn usual_unit(self) -> (&'static str, f64) {
        match self {
            Self::Voltage => ("V", 1.0),
            Self::Ratio => ("mV/V", 1e-3),
            Self::Current => ("mA", 1e-3),
            Self::Frequency => ("Hz", 1.0),
            Self::Strain => ("ustrain", 1e-6),
            Self::Force => ("N", 1.0),
        }
    }

    /// Why a change of the output from no load to rated torque contradicts an output at no load, if it would exceed the
    /// range of such outputs; both in SI units.
    pub fn beyond_loop(self, change: f64, zero: f64) -> Option<String> {
        let (name, largest) = match self {
            Self::Current => ("4 to 20 mA", 0.021),
            Self::Voltage => ("0 to 10 V", 10.5),
            _ => return None,
        };
        let is_beyond = change.abs() <= largest && (zero + change).abs() > largest;
        (zero != 0.0 && is_beyond).then(|| {
            let (unit, factor) = self.usual_unit();
            let [at_rated, right, change] =
                [change + zero, change - zero, change].map(|v| rounded(v / factor, 6));
            format!(
                "at rated torque the output would be {at_rated} {unit}, beyond the range of {name}; the sensitivity is \
                 the change from no load to rated torque: write \"{right} {unit}\" if {change} {unit} is the output at \
                 rated torque"
            )
        })
    }

    /// The unit of torque per signal, and SI units of torque per signal in it.
    pub fn slope_unit(self, units: UnitSystem) -> (String, f64) {
        let (unit, factor) = self.usual_unit();
        let per = match unit.contains('/') {
            true => format!("({unit})"),
            false => unit.to_owned(),
        };
        let torque = Kind::Torque.unit(units);
        (
            format!("{torque}/{per}"),
            1.0 / (Kind::Torque.to(units, 1.0) * factor),
        )
    }

    /// A value in SI units as text in the customary unit.
    pub fn text(self, value: f64) -> String {
        let (unit, factor) = self.usual_unit();
        format!("{} {unit}", digits::text(value / factor, 9))
    }

    /// A quantity of a stand file whose unit determines its signal.
    ///
    /// # Errors
    /// If it cannot be read, or its unit is not that of a signal.
    pub(super) fn read(
        section: &Section,
        key: &'static str,
    ) -> Result<Option<(Self, Estimate)>, Failure> {
        let Some(text) = section.raw(key)? else {
            return Ok(None);
        };
        if text.trim().parse::<f64>().is_ok() {
            return Err(section.fail(
                key,
                format_args!("\"{text}\" has no unit; expected V, mV/V, mA, Hz, ustrain or N, as in \"{text} mV/V\""),
            ));
        }
        let unit = Unit::of_quantity(&text).map_err(|error| section.fail(key, error))?;
        let Some(signal) = Self::of(&unit) else {
            return Err(section.fail(key, unknown(&text, &unit)));
        };
        let estimate = section.quantity_of(key, signal.kind())?;
        Ok(estimate.map(|estimate| (signal, estimate)))
    }
}

/// Message for a text that is not a signal.
fn unknown(text: &str, unit: &Unit) -> String {
    match unit.ratio_of() {
        Some(_) => format!(
            "\"{text}\" could be a ratio of voltages or a strain; write it in mV/V (or \"% V/V\"), or in ustrain (or \
             \"% strain\")"
        ),
        None => format!(
            "\"{text}\" is not a transducer output; expected V, mV/V, mA, Hz, ustrain or N, as in \"2.0012 mV/V\""
        ),
    }
}
