//! Warnings about the gain between bridge and record.

use super::{Stand, TransducerSignal};
use crate::warning::Warning;

impl Stand {
    /// A warning if the gain between bridge and record is not given.
    pub(super) fn assumed_gain(&self) -> Option<Warning> {
        (!self.recorder.has_gain).then(|| {
            Warning::new(
                "gain-assumed",
                format!(
                    "{} does not give the gain between bridge and record: 1 was assumed; add [recorder] gain",
                    self.file
                ),
            )
        })
    }

    /// A warning if a gain is given but unused, as a calibration of recorded volts does not need it.
    pub(super) fn unused_gain(&self, signal: TransducerSignal) -> Option<Warning> {
        let gain = self.recorder.recorder.gain();
        let is_unused = signal == TransducerSignal::Voltage && self.gage.is_none() && gain != 1.0;
        is_unused.then(|| {
            Warning::new(
                "gain-not-used",
                format!(
                    "[calibration] of {} is torque per recorded volt, so [recorder] gain = {gain} was not used; if it \
                     is per volt of the bridge, divide it by the gain, and omit the gain",
                    self.file
                ),
            )
        })
    }
}
