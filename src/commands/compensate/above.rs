//! Signal above the band in a part of the record that was not used to choose it.

use torqcomp_dsp::band::Band;
use torqcomp_dsp::spectrum::PowerSum;

use super::band::{BandReport, BandSource};
use super::report::CompensateReport;
use crate::print::{rounded, short};
use crate::warning::{Warning, WarningCode};

/// Power above the band relative to that in the part from which the band was chosen.
const OF_CHOSEN: f64 = 2.0;
/// Rms above the band relative to the noise of the result.
const OF_NOISE: f64 = 3.0;

/// Largest power above the band in the pieces of a record.
#[derive(Debug, Clone, Copy)]
pub(super) struct AboveBand {
    /// Number of samples from which the band was chosen.
    chosen_from: usize,
    /// Largest power in the pieces with some of these samples.
    chosen: f64,
    /// Largest power in a later piece, and the range of its samples.
    later: Option<(f64, [usize; 2])>,
}

impl AboveBand {
    pub(super) fn of(band: &BandReport, rate_hz: f64) -> Self {
        let is_of_signal = band.chosen_from == BandSource::FirstSeconds;
        let seconds = band.seconds.filter(|_| is_of_signal).unwrap_or(0.0);
        Self {
            chosen_from: (seconds * rate_hz).round() as usize,
            chosen: 0.0,
            later: None,
        }
    }

    /// Whether the band was chosen from a part of the record, so that the rest is worth a look.
    pub(super) fn is_open(&self) -> bool {
        self.chosen_from > 0
    }

    /// Takes the power above the band in a piece with this range of samples.
    pub(super) fn take(&mut self, power: f64, range: [usize; 2]) {
        if range[0] < self.chosen_from {
            self.chosen = self.chosen.max(power);
        } else if self.later.is_none_or(|(largest, _)| power > largest) {
            self.later = Some((power, range));
        }
    }

    /// A warning if a later piece has much more above the band than those from which it was chosen; `report` has the
    /// noise already.
    pub(super) fn warning(&self, report: &CompensateReport) -> Option<Warning> {
        let (power, range) = self.later?;
        let rms = (power - self.chosen).max(0.0).sqrt() * report.scale.abs();
        let noise = report.noise.record.as_ref()?.compensated_rms;
        if power <= OF_CHOSEN * self.chosen || rms <= OF_NOISE * noise {
            return None;
        }
        let [from, to] = range.map(|sample| {
            report.time_text(report.start.seconds() + sample as f64 / report.rate_hz)
        });
        Some(WarningCode::SignalAboveBand.warning(format!(
            "between {from} and {to}, {} {} rms of the record lie above the band of {} Hz and are removed; the band \
             was chosen from the first {} s, where there is less: give a higher --band",
            rounded(rms, 3),
            report.unit,
            short(report.band_hz),
            rounded(self.chosen_from as f64 / report.rate_hz, 3)
        )))
    }
}

/// Mean square of the samples above a band.
pub(super) fn power_above(power: &PowerSum, band: &Band) -> Option<f64> {
    let density = power.density(band.sample_rate_hz())?;
    Some(band.cut_off(&density, 0.5 * band.sample_rate_hz(), |_| 0.0))
}
