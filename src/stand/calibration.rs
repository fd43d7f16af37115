//! From the recorded channel to the applied quantity: unit, calibration, response.

use torqcomp_dsp::bridge::{ArmLaw, Bridge};
use torqcomp_dsp::conversion::Conversion;
use torqcomp_model::{Dimension, Kind, Unit, UnitSystem};

use super::{Given, Stand};
use crate::failure::Failure;
use crate::unit::NamedUnit;

/// What acts on the stand: its name, and the unit it is printed in.
#[derive(Debug, Clone, PartialEq)]
pub struct Applied {
    /// `torque`, `force`, or `applied` for anything else.
    pub name: &'static str,
    /// Unit it is printed in.
    pub unit: String,
    /// SI units per printed unit.
    pub factor: f64,
}

/// How one channel of a record becomes the applied quantity.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// SI units per unit of the record.
    pub recorded_factor: f64,
    /// From the record in SI units to the applied quantity in SI units, at rest.
    pub conversion: Conversion,
    /// Constant that a diagnosis found in the records, as the applied quantity at rest in SI units.
    pub zero: f64,
    /// What comes out.
    pub applied: Applied,
    /// How the static constant came about, for people.
    pub described: String,
    /// Relative standard uncertainty of the static constant, if known.
    pub relative_std: Option<f64>,
}

const VOLTAGE: Dimension = Dimension::new([1, 2, -3, -1, 0, 0]);
const TORQUE: Dimension = Dimension::new([1, 2, -2, 0, 0, 0]);
const FORCE: Dimension = Dimension::new([1, 1, -2, 0, 0, 0]);

impl Applied {
    /// Column heading: `torque_n_m`, `torque_ft_lbf`, `applied_v`.
    #[must_use]
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

/// What a unit of the applied quantity stands for, in the units wanted.
///
/// # Errors
/// If the unit is not known.
pub fn applied_by_unit(text: &str, units: UnitSystem) -> Result<Applied, Failure> {
    let unit = Unit::parse(text).map_err(Failure::failed)?;
    Ok(match unit.dimension() {
        TORQUE => Applied::of(Kind::Torque, "torque", units),
        FORCE => Applied::of(Kind::Force, "force", units),
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

impl Stand {
    /// The calibration of a channel in that unit.
    ///
    /// # Errors
    /// If the unit is not known, or the stand does not say how it becomes torque.
    pub fn calibration(
        &self,
        channel: &str,
        unit: Option<&NamedUnit>,
        units: UnitSystem,
    ) -> Result<Calibration, Failure> {
        let Some(named) = unit else {
            return Err(Failure::failed(format_args!(
                "the channel \"{channel}\" does not say its unit; give it with --unit V (or mV, \
                 \"N m\", \"ft lbf\", ustrain)"
            )));
        };
        let torque = || Applied::of(Kind::Torque, "torque", units);
        if let Some(gain) = self.static_gain() {
            return self.by_static_gain(channel, named, &gain.clone(), units);
        }
        let described;
        let mut relative_std = None;
        let conversion = match named.unit.dimension() {
            TORQUE => {
                described = format!("the record is torque in {}", named.text);
                Conversion::linear(1.0, 0.0)
            }
            VOLTAGE => {
                let (conversion, text, std) = self.volts_to_torque(units)?;
                described = text;
                relative_std = std;
                Ok(conversion)
            }
            FORCE => {
                let radius = self.radius(channel, &named.text)?;
                described = format!("force times the radius of {radius} m");
                Conversion::linear(radius, 0.0)
            }
            Dimension::NONE => {
                described = "strain through the beam's drawing".to_owned();
                Conversion::strain(self.torque_per_strain()?)
            }
            other => {
                return Err(Failure::failed(format_args!(
                    "the channel \"{channel}\" is in \"{}\" ({other}), which does not become \
                     torque; expected volts, torque, force or strain",
                    named.text
                )));
            }
        };
        Ok(Calibration {
            recorded_factor: named.unit.factor(),
            conversion: conversion.map_err(Failure::failed)?,
            zero: self.diagnosed.offset,
            applied: torque(),
            described,
            relative_std,
        })
    }

    /// Recorded over applied quantity at rest, if the stand file gives it.
    pub(crate) fn static_gain(&self) -> Option<&super::StaticGain> {
        match &self.mechanics.as_ref()?.given {
            Given::Modal { static_gain, .. } => static_gain.as_ref(),
            Given::Constants { .. } => None,
        }
    }

    fn by_static_gain(
        &self,
        channel: &str,
        named: &NamedUnit,
        gain: &super::StaticGain,
        units: UnitSystem,
    ) -> Result<Calibration, Failure> {
        let expected = Unit::parse(&gain.recorded_unit).map_err(Failure::failed)?;
        if expected.dimension() != named.unit.dimension() {
            return Err(Failure::failed(format_args!(
                "the channel \"{channel}\" is in \"{}\", but the static_gain of {} expects \"{}\"; \
                 choose another channel, or say the unit with --unit",
                named.text, self.file, gain.recorded_unit
            )));
        }
        // A zero is given in volts: it belongs to a record in volts.
        let zero = if named.unit.dimension() == VOLTAGE {
            self.recorder.zero_v
        } else {
            0.0
        };
        let slope = 1.0 / gain.value;
        Ok(Calibration {
            recorded_factor: named.unit.factor(),
            conversion: Conversion::linear(slope, -slope * zero).map_err(Failure::failed)?,
            zero: slope * self.diagnosed.offset,
            applied: applied_by_unit(&gain.applied_unit, units)?,
            described: "static gain of the stand file".to_owned(),
            relative_std: None,
        })
    }

    /// Conversion of recorded volts: the measured constant, or else gage and bridge.
    fn volts_to_torque(
        &self,
        units: UnitSystem,
    ) -> Result<(Conversion, String, Option<f64>), Failure> {
        if let Some(constant) = &self.torque_per_volt {
            let offset = -constant.value() * self.recorder.zero_v;
            let conversion =
                Conversion::linear(constant.value(), offset).map_err(Failure::failed)?;
            let std = constant
                .std_uncertainty()
                .map(|std| std / constant.value().abs());
            let text = format!("measured constant of {}", constant.text(units));
            return Ok((conversion, text, std));
        }
        let bridge = self.bridge()?;
        let conversion = Conversion::bridge(
            bridge,
            self.recorder.recorder.gain(),
            self.recorder.zero_v,
            self.torque_per_strain()?,
        )
        .map_err(Failure::failed)?;
        let small = Kind::TorquePerVolt.to(units, conversion.small_signal_gain());
        let text = format!(
            "from drawing, gage and bridge: {} {} for small signals",
            crate::io::digits::text(small, 5),
            Kind::TorquePerVolt.unit(units)
        );
        Ok((conversion, text, None))
    }

    /// The bridge with its gage, leads and load.
    ///
    /// # Errors
    /// If the stand file does not give the gage and the bridge, or they do not fit.
    pub fn bridge(&self) -> Result<Bridge, Failure> {
        let (Some(gage), Some(bridge)) = (&self.gage, &self.bridge) else {
            return Err(Failure::failed(format_args!(
                "{}: volts cannot be turned into torque; add [calibration] torque_per_volt = \
                 \"1.23e3 ft lbf/V\", or the sections [beam], [gage] and [bridge]",
                self.file
            )));
        };
        let wrong =
            |error: &dyn std::fmt::Display| Failure::failed(format_args!("{}: {error}", self.file));
        let unbonded = gage.gage.unbonded_resistance_ohm();
        let bonded = gage
            .gage
            .bond(
                gage.bonded_resistance_ohm.unwrap_or(unbonded),
                gage.bonding_temperature_k,
            )
            .map_err(|e| wrong(&e))?;
        let law = ArmLaw::from_gage(&bonded, gage.temperature_k, gage.resistance_drift)
            .map_err(|e| wrong(&e))?;
        let resistance = bonded.bonded_resistance_ohm();
        let made = Bridge::new(bridge.layout, law, resistance, bridge.supply)
            .and_then(|b| b.with_leads(bridge.leads))
            .and_then(|b| match self.recorder.input_resistance_ohm {
                Some(ohm) => b.with_input_resistance_ohm(ohm),
                None => Ok(b),
            });
        made.map_err(|e| wrong(&e))
    }

    /// Torque per strain at the gage, in N m.
    ///
    /// # Errors
    /// If the stand file does not say where the gage sits on the beam.
    pub fn torque_per_strain(&self) -> Result<f64, Failure> {
        let beam = self.beam.as_ref();
        let placed = beam.and_then(|b| b.gage_position.as_ref().map(|p| (b, p)));
        let Some((beam, position)) = placed else {
            return Err(Failure::failed(format_args!(
                "{}: strain cannot be turned into torque; add [beam] with gage_position, or \
                 [calibration] torque_per_volt",
                self.file
            )));
        };
        beam.full
            .torque_per_strain_n_m(beam.radius.value(), position.value())
            .map_err(|error| Failure::failed(format_args!("{}: {error}", self.file)))
    }

    fn radius(&self, channel: &str, unit: &str) -> Result<f64, Failure> {
        match &self.beam {
            Some(beam) => Ok(beam.radius.value()),
            None => Err(Failure::failed(format_args!(
                "the channel \"{channel}\" is a force in \"{unit}\", and {} does not say at which \
                 radius it acts; add [beam] with its radius, or, to compensate the force itself, \
                 give [mechanics] as natural_frequency and damping_ratio with static_gain = \"1 N/N\"",
                self.file
            ))),
        }
    }
}
