//! Comparison of a calibration with the drawing for the same signal.

use torqcomp_model::{Estimate, UnitSystem};

use super::Drawing;
use super::report::PredictedConstant;
use crate::stand::TransducerSignal;

impl Drawing<'_> {
    /// The calibration in its own signal, if not a voltage; without calibration, that of the bridge in V/V.
    pub(super) fn calibration(&self, units: UnitSystem) -> Option<PredictedConstant> {
        let measured = self.stand.calibration.as_ref();
        let signal = measured.map_or(TransducerSignal::Ratio, |measured| measured.signal);
        let (name, by) = match signal {
            TransducerSignal::Voltage => return None,
            TransducerSignal::Ratio => (
                "torque_per_ratio",
                "strain at the gage, gage factor and bridge",
            ),
            TransducerSignal::Strain => ("torque_per_strain", "strain at the gage"),
            TransducerSignal::Force => ("torque_per_force", "radius of the beam"),
            TransducerSignal::Current => ("torque_per_current", "not available from a drawing"),
            TransducerSignal::Frequency => ("torque_per_frequency", "not available from a drawing"),
        };
        let (unit, factor) = signal.slope_unit(units);
        let estimate = |(slope, relative): (f64, Option<f64>), source: &'static str| {
            let value = slope / factor;
            let std = relative.map(|relative| (relative * value).abs());
            Estimate::of(unit.clone(), value, std).with_source(source)
        };
        let predicted = self
            .stand
            .drawn_slope(signal)
            .map(|slope| estimate(slope, "drawing"));
        let found = self
            .stand
            .measured_slope(signal)
            .map(|slope| estimate(slope, "calibration"));
        if measured.is_none() && predicted.is_none() {
            return None;
        }
        Some(PredictedConstant {
            by,
            ..PredictedConstant::between(name, predicted.as_ref(), found.as_ref(), &unit)
        })
    }
}
