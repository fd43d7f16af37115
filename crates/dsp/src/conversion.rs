//! Conversion of recorded samples to the applied quantity.
//!
//! A [`Conversion`] maps recorded samples to torque, or any other unit of the applied quantity,
//! sample by sample, and back.

use crate::bridge::{Bridge, BridgeError};
use crate::curve::CalibrationCurve;

/// An error in a conversion or a sample.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConversionError {
    /// Invalid coefficient.
    #[error("{what} must be {expected}, got {got}; correct the conversion's data")]
    InvalidCoefficient {
        /// Name of the coefficient.
        what: &'static str,
        /// The accepted range.
        expected: &'static str,
        /// The value.
        got: f64,
    },
    /// The value or its conversion is not a finite number.
    #[error(
        "{what} must convert to a finite number, got {got}; \
         remove or interpolate missing samples first"
    )]
    NotFinite {
        /// Which value.
        what: &'static str,
        /// The value.
        got: f64,
    },
    /// The bridge cannot produce the value.
    #[error(transparent)]
    Bridge(#[from] BridgeError),
    /// Points or coefficients that do not define a curve.
    #[error(
        "the calibration must have at least two points and be monotonic; correct its points, or choose a lower degree"
    )]
    NoCurve,
    /// A recorded value far beyond a calibration curve.
    #[error(
        "the calibration runs from {low} to {high} (SI units of its signal) and is continued by 20 % of that, got {got}; \
         calibrate over the whole range of the record"
    )]
    BeyondCurve {
        /// Lower limit of the calibrated range.
        low: f64,
        /// Upper limit of the calibrated range.
        high: f64,
        /// The value.
        got: f64,
    },
    /// An applied value outside the range of a calibration curve.
    #[error(
        "the calibration reaches from {low} to {high} (SI units), got {got}; \
         calibrate over the whole range"
    )]
    NotOnCurve {
        /// Lower limit of the applied values.
        low: f64,
        /// Upper limit of the applied values.
        high: f64,
        /// The value.
        got: f64,
    },
    /// A sample of a slice failed.
    #[error("sample {index} cannot be converted, unlike those before it: {source}")]
    Sample {
        /// Index of the sample in the slice, from 0.
        index: usize,
        /// The error.
        source: Box<ConversionError>,
    },
}

/// Conversion of a recorded value to the applied quantity.
///
/// Made by [`linear`](Self::linear), [`bridge`](Self::bridge) and
/// [`strain`](Self::strain), which check the coefficients. The applied unit is
/// that of the coefficients: lbf in, N m or any other.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Conversion {
    /// `applied = gain × recorded + offset`: a measured constant, which replaces all computed ones.
    #[non_exhaustive]
    Linear {
        /// Applied unit per recorded unit.
        gain: f64,
        /// Applied value at a record of zero.
        offset: f64,
    },
    /// Recorded volts, through amplifier and bridge to strain, to the applied
    /// quantity.
    #[non_exhaustive]
    Bridge {
        /// The bridge.
        bridge: Box<Bridge>,
        /// Recorded volts per bridge volt.
        amplifier_gain: f64,
        /// Recorded value at no load, V.
        recorded_zero_v: f64,
        /// Applied unit per unit strain.
        torque_per_strain: f64,
    },
    /// `applied = curve(scale × recorded + shift)`: a measured curve.
    #[non_exhaustive]
    Curve {
        /// Applied over calibrated quantity.
        curve: Box<CalibrationCurve>,
        /// Calibrated quantity per recorded unit.
        scale: f64,
        /// Calibrated quantity at a record of zero.
        shift: f64,
    },
    /// `applied = torque_per_strain × recorded`: the record is strain.
    #[non_exhaustive]
    Strain {
        /// Applied unit per unit strain.
        torque_per_strain: f64,
    },
}

impl Conversion {
    /// A measured constant, `applied = gain × recorded + offset`.
    ///
    /// # Errors
    /// [`ConversionError::InvalidCoefficient`] when the gain is zero or a
    /// coefficient is not finite.
    ///
    /// ```
    /// use torqcomp_dsp::conversion::Conversion;
    /// // Thesis, chapter III: 1.23e3 ft lbf/V measured; 10 mV is 12.3 ft lbf.
    /// let measured = Conversion::linear(1.23e3, 0.0)?;
    /// assert!((measured.convert(10e-3)? - 12.3).abs() < 1e-13);
    /// # Ok::<(), torqcomp_dsp::conversion::ConversionError>(())
    /// ```
    pub fn linear(gain: f64, offset: f64) -> Result<Self, ConversionError> {
        let gain = factor("gain", gain)?;
        Ok(Self::Linear {
            gain,
            offset: finite_coefficient("offset", offset)?,
        })
    }

    /// A bridge read through an amplifier.
    ///
    /// `recorded = recorded_zero_v + amplifier_gain × (E_o(ε) - E_o(0))` and
    /// `applied = torque_per_strain × ε` with E_o (V) of [`Bridge::output_v`];
    /// thesis eqs. (27a) to (29) are its small-signal form.
    /// `recorded_zero_v` is the record at no load: zero for a recorder that was
    /// balanced, `amplifier_gain × zero_output_v` for one that was not.
    ///
    /// # Errors
    /// [`ConversionError::InvalidCoefficient`] when a factor is zero or a
    /// coefficient is not finite.
    ///
    /// ```
    /// use torqcomp_dsp::bridge::{ArmLaw, Bridge, BridgeLayout, Supply};
    /// use torqcomp_dsp::conversion::Conversion;
    /// let supply = Supply::ConstantVoltage { volts: 22.5 };
    /// let law = ArmLaw::foil(157.0).unwrap();
    /// let bridge = Bridge::new(BridgeLayout::HalfBending, law, 5784.0, supply).unwrap();
    /// let computed = Conversion::bridge(bridge, 1.0, 0.0, 3.50e6)?;
    /// // Thesis eq. (30): 7.00e6 / (22.5 * 157) = 1981.6 in lbf/V = 165.1 ft lbf/V.
    /// assert!((computed.small_signal_gain() / 12.0 - 165.1).abs() < 0.05);
    /// # Ok::<(), torqcomp_dsp::conversion::ConversionError>(())
    /// ```
    pub fn bridge(
        bridge: Bridge,
        amplifier_gain: f64,
        recorded_zero_v: f64,
        torque_per_strain: f64,
    ) -> Result<Self, ConversionError> {
        Ok(Self::Bridge {
            bridge: Box::new(bridge),
            amplifier_gain: factor("amplifier gain", amplifier_gain)?,
            recorded_zero_v: finite_coefficient("recorded zero", recorded_zero_v)?,
            torque_per_strain: factor("torque per strain", torque_per_strain)?,
        })
    }

    /// A record of strain, `applied = torque_per_strain × ε` (thesis eq. 27a: 3.50e6 in lbf).
    ///
    /// # Errors
    /// [`ConversionError::InvalidCoefficient`] when the factor is zero or not finite.
    ///
    /// ```
    /// use torqcomp_dsp::conversion::Conversion;
    /// // 50 microstrain times 3.5e6 in lbf is 175 in lbf.
    /// let strain = Conversion::strain(3.5e6)?;
    /// assert!((strain.convert(50e-6)? - 175.0).abs() < 1e-12);
    /// # Ok::<(), torqcomp_dsp::conversion::ConversionError>(())
    /// ```
    pub fn strain(torque_per_strain: f64) -> Result<Self, ConversionError> {
        Ok(Self::Strain {
            torque_per_strain: factor("torque per strain", torque_per_strain)?,
        })
    }

    /// A measured curve, `applied = curve(scale × recorded + shift)`.
    ///
    /// # Errors
    /// [`ConversionError::InvalidCoefficient`] when the scale is zero or a
    /// coefficient is not finite.
    ///
    /// ```
    /// use torqcomp_dsp::{conversion::Conversion, curve::CalibrationCurve};
    /// // 10 V are 2 mV/V of a bridge at 5 V behind a gain of 1000: 50 N m.
    /// let curve = CalibrationCurve::through(&[(0.0, 0.0), (2e-3, 50.0)])?;
    /// let conversion = Conversion::curve(curve, 1.0 / (1000.0 * 5.0), 0.0)?;
    /// assert!((conversion.convert(10.0)? - 50.0).abs() < 1e-12);
    /// # Ok::<(), torqcomp_dsp::conversion::ConversionError>(())
    /// ```
    pub fn curve(curve: CalibrationCurve, scale: f64, shift: f64) -> Result<Self, ConversionError> {
        Ok(Self::Curve {
            curve: Box::new(curve),
            scale: factor("scale", scale)?,
            shift: finite_coefficient("shift", shift)?,
        })
    }

    /// Applied value from a recorded value.
    ///
    /// # Errors
    /// [`ConversionError::NotFinite`] when the value or the result is not finite;
    /// [`ConversionError::Bridge`] when the bridge cannot produce it.
    pub fn convert(&self, recorded: f64) -> Result<f64, ConversionError> {
        let applied = match self {
            Self::Linear { gain, offset } => gain * recorded + offset,
            Self::Strain { torque_per_strain } => torque_per_strain * recorded,
            Self::Curve {
                curve,
                scale,
                shift,
            } => {
                finite("recorded sample", recorded, recorded)?;
                curve.applied(scale * recorded + shift)?
            }
            Self::Bridge {
                bridge,
                amplifier_gain,
                recorded_zero_v,
                torque_per_strain,
            } => {
                finite("recorded sample", recorded, recorded)?;
                let rise_v = (recorded - recorded_zero_v) / amplifier_gain;
                torque_per_strain * bridge.strain(rise_v + bridge.zero_output_v())?
            }
        };
        finite("recorded sample", applied, recorded)
    }

    /// Recorded value from an applied value, the inverse of [`convert`](Self::convert).
    ///
    /// # Errors
    /// As for [`convert`](Self::convert).
    ///
    /// ```
    /// use torqcomp_dsp::conversion::Conversion;
    /// // (13 - 1) / 4 = 3.
    /// assert_eq!(Conversion::linear(4.0, 1.0)?.record(13.0)?, 3.0);
    /// # Ok::<(), torqcomp_dsp::conversion::ConversionError>(())
    /// ```
    pub fn record(&self, applied: f64) -> Result<f64, ConversionError> {
        let recorded = match self {
            Self::Linear { gain, offset } => (applied - offset) / gain,
            Self::Strain { torque_per_strain } => applied / torque_per_strain,
            Self::Curve {
                curve,
                scale,
                shift,
            } => (curve.recorded(applied)? - shift) / scale,
            Self::Bridge {
                bridge,
                amplifier_gain,
                recorded_zero_v,
                torque_per_strain,
            } => {
                finite("applied value", applied, applied)?;
                let rise_v = bridge.output_v(applied / torque_per_strain)? - bridge.zero_output_v();
                recorded_zero_v + amplifier_gain * rise_v
            }
        };
        finite("applied value", recorded, applied)
    }

    /// Converts every sample in place.
    ///
    /// # Errors
    /// [`ConversionError::Sample`] with the index of the first sample that fails; those before it
    /// are converted, it and the rest are unchanged.
    ///
    /// ```
    /// use torqcomp_dsp::conversion::Conversion;
    /// let mut record = [0.0, 1.0, -2.0];
    /// Conversion::linear(2.0, 1.0)?.convert_slice(&mut record)?;
    /// assert_eq!(record, [1.0, 3.0, -3.0]);
    /// # Ok::<(), torqcomp_dsp::conversion::ConversionError>(())
    /// ```
    pub fn convert_slice(&self, samples: &mut [f64]) -> Result<(), ConversionError> {
        match *self {
            Self::Linear { gain, offset } => self.convert_lines(samples, |v| gain * v + offset),
            Self::Strain { torque_per_strain } => {
                self.convert_lines(samples, |v| torque_per_strain * v)
            }
            Self::Bridge { .. } | Self::Curve { .. } => self.convert_each(samples, 0),
        }
    }

    /// Applied unit per recorded unit about no load; for a curve, at the middle of its range.
    pub fn small_signal_gain(&self) -> f64 {
        match self {
            Self::Curve { curve, scale, .. } => {
                let (low, high) = curve.range();
                scale * curve.slope(0.5 * (low + high))
            }
            Self::Linear { gain, .. } => *gain,
            Self::Strain { torque_per_strain } => *torque_per_strain,
            Self::Bridge {
                bridge,
                amplifier_gain,
                torque_per_strain,
                ..
            } => torque_per_strain / (amplifier_gain * bridge.small_signal_sensitivity()),
        }
    }

    /// Linear conversion in blocks: both passes over a block stay in the L1 cache and are
    /// branch-free.
    fn convert_lines(
        &self,
        samples: &mut [f64],
        line: impl Fn(f64) -> f64,
    ) -> Result<(), ConversionError> {
        const BLOCK: usize = 512;
        for (number, block) in samples.chunks_mut(BLOCK).enumerate() {
            if !block
                .iter()
                .fold(true, |good, &v| good & line(v).is_finite())
            {
                return self.convert_each(block, number * BLOCK);
            }
            block.iter_mut().for_each(|v| *v = line(*v));
        }
        Ok(())
    }

    /// Converts sample by sample; `start` is the index of the first one.
    fn convert_each(&self, samples: &mut [f64], start: usize) -> Result<(), ConversionError> {
        for (index, value) in samples.iter_mut().enumerate() {
            *value = self
                .convert(*value)
                .map_err(|source| ConversionError::Sample {
                    index: start + index,
                    source: Box::new(source),
                })?;
        }
        Ok(())
    }
}

/// `result` when finite; the error names the value it came from.
fn finite(what: &'static str, result: f64, got: f64) -> Result<f64, ConversionError> {
    match result.is_finite() {
        true => Ok(result),
        false => Err(ConversionError::NotFinite { what, got }),
    }
}

fn finite_coefficient(what: &'static str, got: f64) -> Result<f64, ConversionError> {
    let expected = "a finite number";
    match got.is_finite() {
        true => Ok(got),
        false => Err(ConversionError::InvalidCoefficient {
            what,
            expected,
            got,
        }),
    }
}

fn factor(what: &'static str, got: f64) -> Result<f64, ConversionError> {
    let expected = "finite and not zero";
    match got.is_finite() && got != 0.0 {
        true => Ok(got),
        false => Err(ConversionError::InvalidCoefficient {
            what,
            expected,
            got,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bridge::{ArmLaw, BridgeLayout, Leads, Supply};
    use proptest::prelude::*;

    /// A quarter bridge unbalanced by its two-wire leads, recorded through an inverting amplifier
    /// with an offset.
    fn unbalanced() -> Conversion {
        let law = ArmLaw::new(0.0, 157.0, 2800.0).unwrap();
        let supply = Supply::ConstantVoltage { volts: 22.5 };
        let bridge = Bridge::new(BridgeLayout::Quarter, law, 5784.0, supply)
            .and_then(|bridge| bridge.with_leads(Leads::TwoWire { lead_ohm: 20.0 }))
            .and_then(|bridge| bridge.with_input_resistance_ohm(1e4))
            .unwrap();
        Conversion::bridge(bridge, -10.0, 0.25, 3.5e6).unwrap()
    }

    fn all() -> [Conversion; 4] {
        let linear = Conversion::linear(-1230.0, 0.5).unwrap();
        let cubic = CalibrationCurve::polynomial(vec![1.0, 2500.0, 0.3, 40.0], -1.0, 1.0).unwrap();
        let cubic = Conversion::curve(cubic, 1.0, 0.0).unwrap();
        [
            linear,
            Conversion::strain(3.5e6).unwrap(),
            cubic,
            unbalanced(),
        ]
    }

    proptest! {
        #[test]
        fn record_inverts_convert(torque in -2000.0..2000.0_f64) {
            for conversion in all() {
                let back = conversion.convert(conversion.record(torque).unwrap()).unwrap();
                prop_assert!((back - torque).abs() < 1e-9, "{conversion:?} {back}");
            }
        }

        #[test]
        fn slice_equals_sample_by_sample(
            samples in prop::collection::vec(-0.2..0.2_f64, 0..1500),
        ) {
            for conversion in all() {
                let mut slice = samples.clone();
                conversion.convert_slice(&mut slice).unwrap();
                for (&sample, &applied) in samples.iter().zip(&slice) {
                    prop_assert_eq!(conversion.convert(sample).unwrap(), applied);
                }
            }
        }

        #[test]
        fn first_bad_sample_is_named(
            bad in 0..1500_usize, value in prop_oneof![Just(f64::NAN), Just(f64::INFINITY)],
        ) {
            for conversion in all() {
                let mut slice = vec![0.01; 1500];
                slice[bad] = value;
                let error = conversion.convert_slice(&mut slice).unwrap_err();
                let named = matches!(error, ConversionError::Sample { index, .. } if index == bad);
                prop_assert!(named, "{error:?}");
                let applied = conversion.convert(0.01).unwrap();
                prop_assert!(slice[..bad].iter().all(|&v| v == applied));
                prop_assert!(slice[bad + 1..].iter().all(|&v| v == 0.01));
            }
        }
    }

    #[test]
    fn gain_is_the_slope_at_no_load() {
        for conversion in all() {
            let record = |torque| conversion.record(torque).unwrap();
            let slope = 2.0 / (record(1.0) - record(-1.0));
            let gain = conversion.small_signal_gain();
            assert!(
                (slope / gain - 1.0).abs() < 1e-6,
                "{conversion:?} {slope} {gain}"
            );
        }
    }

    #[test]
    fn no_load_records_the_zero() {
        assert!(unbalanced().convert(0.25).unwrap().abs() < 1e-9);
        assert_eq!(unbalanced().record(0.0).unwrap(), 0.25);
    }

    #[test]
    fn a_voltage_past_the_bridge_is_refused() {
        let error = unbalanced().convert(1e3).unwrap_err();
        assert!(matches!(
            error,
            ConversionError::Bridge(BridgeError::VoltageOutOfRange { .. })
        ));
        let overflow = Conversion::linear(1e300, 0.0).unwrap();
        assert!(matches!(
            overflow.convert(1e10),
            Err(ConversionError::NotFinite { .. })
        ));
        let mut slice = [1.0, 1e10];
        assert!(overflow.convert_slice(&mut slice).is_err());
    }

    #[test]
    fn useless_coefficients_are_refused() {
        for bad in [0.0, f64::NAN, f64::INFINITY] {
            assert!(Conversion::linear(bad, 0.0).is_err());
            assert!(Conversion::strain(bad).is_err());
            let Conversion::Bridge { bridge, .. } = unbalanced() else {
                unreachable!()
            };
            assert!(Conversion::bridge(*bridge, bad, 0.0, 1.0).is_err());
            assert!(Conversion::bridge(*bridge, 1.0, 0.0, bad).is_err());
        }
        assert!(Conversion::linear(1.0, f64::NAN).is_err());
    }
}
