//! Conversion of a transducer's or bridge's signal to torque: by the measured calibration, or by beam, gage and
//! bridge.

use torqcomp_decimal::digits;
use torqcomp_dsp::bridge::{ArmLaw, Bridge, Supply};
use torqcomp_dsp::conversion::{Conversion, ConversionError};
use torqcomp_model::{Estimate, Kind, UnitSystem};

use super::{CalibrationLaw, ConstantStd, MeasuredCalibration, Stand, TransducerSignal};
use crate::failure::{ErrorCode, Failure};
use crate::unit::NamedUnit;
use crate::warning::{Warning, WarningCode};

/// Static conversion from a record in SI units to torque in N m.
pub(super) struct StaticLaw {
    pub(super) conversion: Conversion,
    /// Origin of the conversion, as text.
    pub(super) described: String,
    /// Uncertainty of the static constant.
    pub(super) std: ConstantStd,
    /// Assumptions made.
    pub(super) warnings: Vec<Warning>,
}

/// Relative standard uncertainty of a product from those of its factors.
pub(super) fn together(stds: &[Option<f64>]) -> Option<f64> {
    let known = stds.iter().copied().flatten();
    known.reduce(f64::hypot)
}

impl StaticLaw {
    pub(super) fn of(conversion: Result<Conversion, ConversionError>) -> Result<Self, Failure> {
        Ok(Self {
            conversion: conversion.map_err(Failure::of(ErrorCode::InvalidStand))?,
            described: String::new(),
            std: ConstantStd::Unknown,
            warnings: Vec::new(),
        })
    }
}

impl Stand {
    /// Conversion of the signal of a transducer or bridge to torque: by the measured calibration, otherwise by
    /// the drawing.
    pub(super) fn by_signal(
        &self,
        signal: TransducerSignal,
        channel: &str,
        named: &NamedUnit,
        units: UnitSystem,
    ) -> Result<StaticLaw, Failure> {
        let zero = self.zero_of(signal)?;
        let Some(measured) = &self.calibration else {
            return self.by_drawing(signal, zero.unwrap_or(0.0), units);
        };
        if let Some(scale) = self.per_signal(signal, measured.signal)? {
            return self.by_measured(measured, signal, scale, zero, units);
        }
        let is_of_beam = matches!(signal, TransducerSignal::Strain | TransducerSignal::Force);
        if is_of_beam && self.beam.is_some() {
            let mut law = self.by_drawing(signal, zero.unwrap_or(0.0), units)?;
            law.warnings.push(WarningCode::CalibrationNotUsed.warning(format!(
                "the channel \"{channel}\" is in {}, and [calibration] of {} is in {}: the record was converted \
                 with the beam's dimensions; record in {} to use the calibration",
                named.text,
                self.file,
                measured.signal.usual_unit().0,
                measured.signal.usual_unit().0
            )));
            return Ok(law);
        }
        let remedy = match signal {
            TransducerSignal::Force => {
                "give the radius at which this force acts as [beam] radius, or as lever_arm in place of that calibration"
                    .to_owned()
            }
            _ => format!("give the calibration in {}", signal.usual_unit().0),
        };
        Err(ErrorCode::UnitUnsuitable.failed(format_args!(
            "the channel \"{channel}\" is a {} in \"{}\", and [calibration] of {} is in {}; choose another \
             channel, say the unit with --unit, or {remedy}",
            signal.kind().name(),
            named.text,
            self.file,
            measured.signal.usual_unit().0
        )))
    }

    /// The record at no load, if given for such a signal.
    fn zero_of(&self, signal: TransducerSignal) -> Result<Option<f64>, Failure> {
        use TransducerSignal::{Ratio, Voltage};
        let given = self.recorder.zero.as_ref();
        match given.map(|(of, zero)| (*of, zero.value())) {
            Some((of, zero)) if of == signal => Ok(Some(zero)),
            // The same signal in two forms.
            Some((of @ (Voltage | Ratio), zero))
                if matches!(signal, Voltage | Ratio) && zero != 0.0 =>
            {
                Err(self.failed(
                    ErrorCode::InvalidStand,
                    format_args!(
                        "[recorder] zero is in {} and the record in {}; give the zero as the record has it, as in \
                         zero = \"0.01 {}\"",
                        of.usual_unit().0,
                        signal.usual_unit().0,
                        signal.usual_unit().0
                    ),
                ))
            }
            _ => Ok(None),
        }
    }

    /// SI units of a signal per SI unit of another one; `None` if they are not two forms of the same.
    fn per_signal(
        &self,
        recorded: TransducerSignal,
        wanted: TransducerSignal,
    ) -> Result<Option<f64>, Failure> {
        let volts_per_ratio =
            || -> Result<f64, Failure> { Ok(self.recorder.recorder.gain() * self.excitation_v()?) };
        Ok(match (recorded, wanted) {
            (a, b) if a == b => Some(1.0),
            (TransducerSignal::Voltage, TransducerSignal::Ratio) => Some(1.0 / volts_per_ratio()?),
            (TransducerSignal::Ratio, TransducerSignal::Voltage) => Some(volts_per_ratio()?),
            _ => None,
        })
    }

    /// Supply voltage of the bridge in V.
    fn excitation_v(&self) -> Result<f64, Failure> {
        match self.bridge.as_ref().and_then(|bridge| bridge.supply) {
            Some(Supply::ConstantVoltage { volts }) => Ok(volts),
            _ => Err(self.failed(
                ErrorCode::IncompleteStand,
                "converting between volts and mV/V needs the voltage of the bridge's supply, which is not given; add \
                 [bridge] excitation = \"5 V\"",
            )),
        }
    }

    /// By a measured constant or curve; `scale` converts the recorded signal to the calibrated one.
    fn by_measured(
        &self,
        measured: &MeasuredCalibration,
        signal: TransducerSignal,
        scale: f64,
        zero: Option<f64>,
        units: UnitSystem,
    ) -> Result<StaticLaw, Failure> {
        let conversion = match &measured.law {
            CalibrationLaw::Constant(constant) => {
                let zero = match zero.or(measured.zero.as_ref().map(Estimate::value)) {
                    Some(zero) => zero,
                    None if matches!(
                        signal,
                        TransducerSignal::Current | TransducerSignal::Frequency
                    ) =>
                    {
                        return Err(self.without_live_zero(signal));
                    }
                    None => 0.0,
                };
                let slope = constant.value() * scale;
                Conversion::linear(slope, -slope * zero)
            }
            CalibrationLaw::Curve(curve) => {
                // A present zero shifts the curve.
                let shift = match zero {
                    Some(zero) => {
                        curve
                            .recorded(0.0)
                            .map_err(Failure::of(ErrorCode::InvalidStand))?
                            - scale * zero
                    }
                    None => 0.0,
                };
                Conversion::curve(curve.clone(), scale, shift)
            }
        };
        let is_other = signal != measured.signal;
        Ok(StaticLaw {
            described: measured.described(units),
            std: ConstantStd::of(match is_other {
                true => together(&[
                    measured.relative_std,
                    self.of_supply(),
                    self.recorder.gain_relative_std,
                ]),
                false => measured.relative_std,
            }),
            warnings: match is_other {
                true => self.assumed_gain(),
                false => self.unused_gain(signal),
            }
            .into_iter()
            .collect(),
            ..StaticLaw::of(conversion)?
        })
    }

    fn without_live_zero(&self, signal: TransducerSignal) -> Failure {
        let example = match signal {
            TransducerSignal::Current => {
                "[recorder] zero = \"4 mA\" (or \"12 mA\" for 4 to 20 mA in both directions)"
            }
            _ => {
                "[recorder] zero = \"60 kHz\", or [calibration] with zero_frequency and frequency_at_rated"
            }
        };
        self.failed(
            ErrorCode::IncompleteStand,
            format_args!(
                "a current or a frequency is seldom zero at no load, and the output there is not given; add \
                 {example}"
            ),
        )
    }

    /// Relative standard uncertainty of the bridge's supply.
    fn of_supply(&self) -> Option<f64> {
        self.bridge.as_ref()?.supply_relative_std
    }

    /// Torque per signal about no load from the drawing, in SI units, with its relative standard uncertainty; `None` if
    /// the drawing is insufficient.
    pub(crate) fn drawn_slope(&self, signal: TransducerSignal) -> Option<(f64, Option<f64>)> {
        let law = self.by_drawing(signal, 0.0, UnitSystem::Si).ok()?;
        Some((law.conversion.small_signal_gain(), law.std.known()))
    }

    /// Torque per signal about no load from the calibration, in SI units, with its relative standard uncertainty; volts
    /// and ratios are converted by gain and supply. `None` if it is for another signal.
    pub(crate) fn measured_slope(&self, signal: TransducerSignal) -> Option<(f64, Option<f64>)> {
        let measured = self.calibration.as_ref()?;
        let scale = self.per_signal(signal, measured.signal).ok()??;
        // The zero does not affect the slope.
        let law = self
            .by_measured(measured, signal, scale, Some(0.0), UnitSystem::Si)
            .ok()?;
        Some((law.conversion.small_signal_gain(), law.std.known()))
    }

    /// By beam, gage and bridge.
    fn by_drawing(
        &self,
        signal: TransducerSignal,
        zero: f64,
        units: UnitSystem,
    ) -> Result<StaticLaw, Failure> {
        let per_bridge_volt = match signal {
            TransducerSignal::Strain => {
                let described = "strain through the beam's dimensions".to_owned();
                return self.of_slope(signal, self.torque_per_strain()?, zero, described);
            }
            TransducerSignal::Force => {
                let radius = self.radius()?;
                let described = format!("force times the radius of {radius} m");
                return self.of_slope(signal, radius, zero, described);
            }
            TransducerSignal::Voltage => self.recorder.recorder.gain(),
            TransducerSignal::Ratio => 1.0 / self.ratio_excitation_v()?,
            TransducerSignal::Current | TransducerSignal::Frequency => {
                let unit = signal.usual_unit().0;
                return Err(self.failed(
                    ErrorCode::IncompleteStand,
                    format_args!(
                        "a record in {unit} cannot be converted to torque; add [calibration] with sensitivity = \"8 \
                         {unit}\" and rated_torque = \"50 N m\""
                    ),
                ));
            }
        };
        let bridge = self.bridge_fed_by(match signal {
            TransducerSignal::Ratio => Some(Supply::ConstantVoltage {
                volts: self.ratio_excitation_v()?,
            }),
            _ => None,
        })?;
        let torque_per_strain = self.torque_per_strain()?;
        let law = Conversion::bridge(bridge, per_bridge_volt, zero, torque_per_strain);
        let law = StaticLaw::of(law)?;
        let gain = law.conversion.small_signal_gain();
        let (of_signal, factor) = match signal {
            TransducerSignal::Ratio => ("/(mV/V)", 1e-3),
            _ => ("/V", 1.0),
        };
        let small = Kind::Torque.to(units, gain) * factor;
        Ok(StaticLaw {
            described: format!(
                "from drawing, gage and bridge: {} {}{of_signal} for small signals",
                digits::text(small, 5),
                Kind::Torque.unit(units)
            ),
            std: ConstantStd::of(self.of_drawing(signal)),
            warnings: match signal {
                TransducerSignal::Voltage => self.assumed_gain().into_iter().collect(),
                _ => Vec::new(),
            },
            ..law
        })
    }

    /// A straight line through the record at no load.
    fn of_slope(
        &self,
        signal: TransducerSignal,
        slope: f64,
        zero: f64,
        described: String,
    ) -> Result<StaticLaw, Failure> {
        Ok(StaticLaw {
            described,
            std: ConstantStd::of(self.of_drawing(signal)),
            ..StaticLaw::of(Conversion::linear(slope, -slope * zero))?
        })
    }

    /// Radius in m at which a recorded force acts.
    fn radius(&self) -> Result<f64, Failure> {
        match &self.beam {
            Some(beam) => Ok(beam.radius.value()),
            None => Err(self.failed(
                ErrorCode::IncompleteStand,
                "the radius at which the recorded force acts is not given; add [calibration] lever_arm = \"0.5 m\", \
                 or, to compensate the force itself, give [mechanics] as natural_frequency and damping_ratio with \
                 static_gain = \"1 N/N\"",
            )),
        }
    }

    /// Relative standard uncertainty of the torque from beam, gage and bridge.
    fn of_drawing(&self, signal: TransducerSignal) -> Option<f64> {
        let of_beam = self.beam.as_ref().and_then(|b| b.strain_relative_std);
        let of_gage = self.gage.as_ref().and_then(|g| g.factor_relative_std);
        let of_gain = self.recorder.gain_relative_std;
        match signal {
            TransducerSignal::Strain => of_beam,
            TransducerSignal::Force => self.beam.as_ref().and_then(|b| b.radius.relative_std()),
            TransducerSignal::Voltage => together(&[of_beam, of_gage, self.of_supply(), of_gain]),
            _ => together(&[of_beam, of_gage]),
        }
    }

    /// The reference voltage of a recorded ratio; arbitrary for a voltage supply.
    fn ratio_excitation_v(&self) -> Result<f64, Failure> {
        match self.bridge.as_ref().and_then(|bridge| bridge.supply) {
            None => Ok(1.0),
            Some(Supply::ConstantVoltage { volts }) => Ok(volts),
            Some(_) => Err(self.failed(
                ErrorCode::InvalidStand,
                "a ratio of voltages refers to a supply of constant voltage, and [bridge] has excitation_current; \
                 give excitation = \"5 V\", or record in volts",
            )),
        }
    }

    /// The bridge with its gage, leads and load.
    ///
    /// # Errors
    /// If the stand file does not give the gage and the bridge, or they are incompatible.
    pub fn bridge(&self) -> Result<Bridge, Failure> {
        self.bridge_fed_by(None)
    }

    /// The same with a supply other than that of the file.
    fn bridge_fed_by(&self, supply: Option<Supply>) -> Result<Bridge, Failure> {
        let (Some(gage), Some(bridge)) = (&self.gage, &self.bridge) else {
            return Err(self.failed(
                ErrorCode::IncompleteStand,
                "the record cannot be converted to torque; add [calibration], as torque_per_volt = \"12.5 N m/V\" or \
                 torque_per_ratio = \"25 N m/(mV/V)\", or the sections [beam], [gage] and [bridge]; for a record of force, \
                 give static_gain = \"0.08 V/N\" in [mechanics]",
            ));
        };
        let lacks = |what: &str| {
            self.failed(
                ErrorCode::IncompleteStand,
                format_args!("[bridge] lacks {what}"),
            )
        };
        let layout = bridge.layout.ok_or_else(|| {
            lacks("its layout; write layout = \"quarter\", \"half\", \"half-opposite\", \"half-poisson\", \"full\" or \"full-poisson\"")
        })?;
        let supply = supply.or(bridge.supply).ok_or_else(|| {
            lacks("its supply; write excitation = \"5 V\" or excitation_current = \"2 mA\"")
        })?;
        let wrong = |error: &dyn std::fmt::Display| self.failed(ErrorCode::InvalidStand, error);
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
        let made = Bridge::new(layout, law, resistance, supply)
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
    /// If the stand file does not give the position of the gage on the beam.
    pub fn torque_per_strain(&self) -> Result<f64, Failure> {
        let beam = self.beam.as_ref();
        let placed = beam.and_then(|b| b.gage_position.as_ref().map(|p| (b, p)));
        let Some((beam, position)) = placed else {
            return Err(self.failed(
                ErrorCode::IncompleteStand,
                "strain cannot be converted to torque; add [beam] with gage_position, or \
                 [calibration] with torque_per_volt or torque_per_ratio",
            ));
        };
        beam.full
            .torque_per_strain_n_m(beam.radius.value(), position.value())
            .map_err(|error| self.failed(ErrorCode::InvalidStand, error))
    }
}
