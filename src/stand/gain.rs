//! Warnings about the gain between bridge and record.

use super::{Stand, TransducerSignal};
use crate::print::{rounded, with_std};
use crate::warning::{Warning, WarningCode};

/// Minimum difference of two gains, in standard uncertainties and relative to the gain.
const GAINS_DIFFER: (f64, f64) = (3.0, 1e-3);

/// A warning if a test gives a gain other than the known one, both with their standard uncertainties.
pub(crate) fn gain_differs(
    (source, name, unit): (&str, &str, &str),
    (gain, gain_std): (f64, Option<f64>),
    (known, known_std): (f64, Option<f64>),
    of_known: &str,
) -> Option<Warning> {
    let std = gain_std.unwrap_or(0.0).hypot(known_std.unwrap_or(0.0));
    let apart = (gain - known).abs();
    let (times, part) = GAINS_DIFFER;
    (apart > times * std && apart > part * known.abs()).then(|| {
        let found = match gain_std {
            Some(std) => with_std(gain, std),
            None => rounded(gain, 6),
        };
        WarningCode::GainDiffers.warning(format!(
            "{source} a {name} of {found} {unit}, {} times the {} {unit} {of_known}",
            rounded(gain / known, 4),
            rounded(known, 6)
        ))
    })
}

impl Stand {
    /// A warning if the gain between bridge and record is not given.
    pub(super) fn assumed_gain(&self) -> Option<Warning> {
        (!self.recorder.has_gain).then(|| {
            WarningCode::GainAssumed.warning(format!(
                "{} does not give the gain between bridge and record: 1 was assumed; add [recorder] gain",
                self.file
            ))
        })
    }

    /// A warning if a gain is given but unused, as a calibration of recorded volts does not need it.
    pub(super) fn unused_gain(&self, signal: TransducerSignal) -> Option<Warning> {
        let gain = self.recorder.recorder.gain();
        let is_unused = signal == TransducerSignal::Voltage && self.gage.is_none() && gain != 1.0;
        is_unused.then(|| {
            WarningCode::GainNotUsed.warning(format!(
                "[calibration] of {} is torque per recorded volt, so [recorder] gain = {gain} was not used; if it \
                 is per volt of the bridge, divide it by the gain, and omit the gain",
                self.file
            ))
        })
    }
}
