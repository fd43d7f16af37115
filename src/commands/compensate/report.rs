//! The report of a compensation.

use std::fmt::Write;

use serde::Serialize;
use torqcomp_dsp::noise::RecordNoise;
use torqcomp_dsp::resample::Resampled;

use super::band::BandReport;
use super::statistics::Statistics;
use crate::print::{Report, plural, rounded, short};
use crate::recording::FilledSpan;
use crate::recording::moment::Moment;
use crate::warning::Warning;

/// Report of a compensation.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(super) struct CompensateReport {
    pub(super) input: String,
    pub(super) dialect: String,
    pub(super) channel: String,
    pub(super) channel_unit: String,
    /// `recorded`: the stand's response is in the channel and is divided out.
    pub(super) taken_as: &'static str,
    pub(super) stand: String,
    pub(super) output: String,
    /// Topic and field of the result in a file of messages.
    pub(super) output_signal: Option<String>,
    pub(super) unit: String,
    /// How the record became torque at rest.
    pub(super) calibration: String,
    pub(super) samples: usize,
    pub(super) rate_hz: f64,
    pub(super) rate_from: String,
    /// First time of the result.
    #[serde(flatten)]
    pub(super) start: Moment,
    /// Stretches of samples that `--fill` filled in.
    pub(super) filled: Vec<FilledSpan>,
    /// `stream`, `whole-record`, or `refined` for a stand with effects that no filter describes.
    pub(super) method: &'static str,
    /// Effects of the stand that were taken out, the last link of the chain first.
    pub(super) effects: Vec<UndoneEffect>,
    /// Highest frequency of the record at which nonlinear curves and torques of the stand were evaluated.
    pub(super) seen_to_hz: Option<f64>,
    /// Times at which the torque cannot be recovered from the record.
    pub(super) lost: Vec<LostSpan>,
    pub(super) lines: Vec<RemovedLine>,
    pub(super) band: BandReport,
    /// End of the part that is compensated in full.
    pub(super) band_hz: f64,
    /// Frequency from which on nothing is passed.
    pub(super) band_end_hz: f64,
    /// Time from either end within which the result depends on extrapolation beyond the record.
    pub(super) edge_s: f64,
    pub(super) result: Statistics,
    pub(super) resampled: Option<Resampled>,
    pub(super) noise: NoiseReport,
    pub(super) warnings: Vec<Warning>,
    /// Printed units per SI unit.
    #[serde(skip)]
    pub(super) scale: f64,
}

/// An effect that was taken out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct UndoneEffect {
    pub(super) effect: &'static str,
    pub(super) form: &'static str,
    /// `divided out`, `inverted`, `subtracted`, `integrated` (with memory, along the motion), or `marked` where it
    /// cannot be taken out.
    pub(super) done: &'static str,
}

/// A line that was taken off, in the unit of the result as a record at rest has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct RemovedLine {
    pub(super) frequency_hz: f64,
    /// Its amplitude in the stand file.
    pub(super) amplitude: f64,
    /// What the record has at this frequency, signal included.
    pub(super) recorded: f64,
    /// Phase of its sine at the first sample.
    pub(super) phase_rad: f64,
    /// Part of the amplitude that was taken off: less than 1 where the signal hides the phase.
    pub(super) share: f64,
}

/// A time in which the torque cannot be recovered from the record.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct LostSpan {
    /// The effect that hides it.
    pub(super) effect: &'static str,
    pub(super) from_s: f64,
    pub(super) to_s: f64,
}

/// What a compensation does to noise.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(super) struct NoiseReport {
    /// Rms out over rms in for white noise.
    pub(super) white_gain: f64,
    pub(super) largest_gain: f64,
    /// Frequency of the largest gain.
    pub(super) largest_gain_at_hz: f64,
    pub(super) gain: Vec<NoiseAt>,
    /// Noise of this record, in the unit of the result.
    pub(super) record: Option<RecordNoise>,
}

/// Gain of the compensation at a frequency.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct NoiseAt {
    pub(super) frequency_hz: f64,
    /// `|torque / recorded torque|`.
    pub(super) gain: f64,
    /// Its relative standard uncertainty, from the stand's constants; `null` if unknown.
    pub(super) relative_std: Option<f64>,
}

impl Report for CompensateReport {
    const SCHEMA: &'static str = "torqcomp.compensate/1";

    fn text(&self) -> String {
        let mut text = String::new();
        let mut line = |label: &str, value: String| {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{label:<12} {value}");
        };
        line("input", format!("{} ({})", self.input, self.dialect));
        line(
            "channel",
            format!(
                "{} in {}, taken as recorded",
                self.channel, self.channel_unit
            ),
        );
        line("calibration", self.calibration.clone());
        line(
            "time",
            format!(
                "{} samples at {} Hz ({}), from {}",
                self.samples,
                rounded(self.rate_hz, 9),
                self.rate_from,
                self.start.text()
            ),
        );
        if let Some(resampled) = &self.resampled {
            line("resampled", resampled_text(resampled));
        }
        line(
            "band",
            format!(
                "compensated up to {} Hz, zero from {} Hz, {}; the first and last {} ms depend on extrapolation beyond \
                 the record",
                short(self.band_hz),
                short(self.band_end_hz),
                self.band.text(),
                rounded(1e3 * self.edge_s, 3)
            ),
        );
        if !self.effects.is_empty() {
            line("effects", self.effects_text());
        }
        line("gain", self.noise.gain_text());
        line("noise", self.noise.record_text(&self.unit));
        let result = &self.result;
        line(
            "result",
            format!(
                "mean {}, rms about the mean {}, range {} to {} {}",
                rounded(result.mean, 4),
                rounded(result.rms, 4),
                rounded(result.smallest, 4),
                rounded(result.largest, 4),
                self.unit
            ),
        );
        line("output", self.output.clone());
        text
    }
}

impl CompensateReport {
    fn effects_text(&self) -> String {
        let each = |e: &UndoneEffect| format!("{} ({}) {}", e.effect, e.form, e.done);
        let list: Vec<String> = self.effects.iter().map(each).collect();
        list.join(", ")
    }
}

fn resampled_text(resampled: &Resampled) -> String {
    format!(
        "{} samples interpolated to {}; {} filled by straight lines ({} samples, longest step \
         {} s), {} dropped, jitter up to {} % of a step",
        resampled.samples_in,
        resampled.samples_out,
        plural(resampled.gaps, "gap"),
        resampled.bridged,
        rounded(resampled.longest_step_s, 4),
        plural(resampled.repeated, "repeated time stamp"),
        rounded(100.0 * resampled.largest_jitter, 2)
    )
}

impl NoiseReport {
    fn gain_text(&self) -> String {
        let points: Vec<String> = self
            .gain
            .iter()
            .map(|g| {
                let std = g.relative_std.map_or_else(String::new, |std| {
                    format!(" ± {} %", rounded(100.0 * std, 2))
                });
                format!(
                    "{}{std} at {} Hz",
                    rounded(g.gain, 3),
                    short(g.frequency_hz)
                )
            })
            .collect();
        points.join(", ")
    }

    fn record_text(&self, unit: &str) -> String {
        match &self.record {
            None => format!(
                "white noise is multiplied by {}; the noise of this record is unknown (too few \
                 samples, or no noise above the band)",
                rounded(self.white_gain, 3)
            ),
            Some(noise) => format!(
                "{} {unit} rms in the band before, {} {unit} rms after",
                rounded(noise.recorded_rms, 3),
                rounded(noise.compensated_rms, 3)
            ),
        }
    }
}
