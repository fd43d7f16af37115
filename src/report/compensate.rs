//! The report of a compensation.

use std::fmt::Write;

use serde::Serialize;
use torqcomp_dsp::resample::Resampled;

use crate::print::{rounded, short};
use crate::warning::Warning;

/// Schema of the JSON document.
pub const SCHEMA: &str = "torqcomp.compensate/1";

/// Report of a compensation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Schema of this document.
    pub schema: &'static str,
    /// Version of torqcomp.
    pub version: &'static str,
    /// File that was read.
    pub input: String,
    /// How it is written.
    pub dialect: String,
    /// Channel that was read.
    pub channel: String,
    /// Its unit in the file.
    pub channel_unit: String,
    /// Stand file.
    pub stand: String,
    /// File that was written.
    pub output: String,
    /// Topic and field of the result in a file of messages.
    pub output_signal: Option<String>,
    /// Unit of the result.
    pub unit: String,
    /// How the record became torque at rest.
    pub calibration: String,
    /// Samples written.
    pub samples: usize,
    /// Sampling rate.
    pub rate_hz: f64,
    /// Where the rate comes from.
    pub rate_from: String,
    /// First time of the result.
    pub start_s: f64,
    /// `stream`, `whole-record`, or `refined` for a stand with effects that no filter describes.
    pub method: &'static str,
    /// Effects of the stand that were taken out, the last link of the chain first.
    pub effects: Vec<Effect>,
    /// Highest frequency of the record that curves and torques of the stand were evaluated with.
    pub seen_to_hz: Option<f64>,
    /// Times in which the record does not tell the torque.
    pub lost: Vec<LostSpan>,
    /// Lines that were taken off.
    pub lines: Vec<Line>,
    /// End of the part that is compensated in full.
    pub band_hz: f64,
    /// Frequency from which on nothing is passed.
    pub band_end_hz: f64,
    /// Time from either end within which the result leans on the record's continuation.
    pub edge_s: f64,
    /// The result in figures.
    pub result: Ends,
    /// What was interpolated.
    pub resampled: Option<Resampled>,
    /// What the compensation does to noise.
    pub noise: Noise,
    /// What should be known.
    pub warnings: Vec<Warning>,
}

/// An effect that was taken out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Effect {
    /// Its name.
    pub effect: &'static str,
    /// Its form.
    pub form: &'static str,
    /// `divided out`, `inverted`, `subtracted`, `integrated` (with memory, along the motion), or `marked` where it
    /// cannot be taken out.
    pub done: &'static str,
}

/// A line that was taken off, in the unit of the result as a record at rest has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// Its frequency.
    pub frequency_hz: f64,
    /// Its amplitude in the stand file.
    pub amplitude: f64,
    /// What the record has at this frequency, signal included.
    pub recorded: f64,
    /// Phase of its sine at the first sample.
    pub phase_rad: f64,
    /// Part of the amplitude that was taken off: less than 1 where the signal hides the phase.
    pub share: f64,
}

/// A time in which the record does not tell the torque.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LostSpan {
    /// The effect that took it away.
    pub effect: &'static str,
    /// First sample.
    pub from_s: f64,
    /// Last sample.
    pub to_s: f64,
}

/// A result in figures, in its unit.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Ends {
    /// Mean.
    pub mean: f64,
    /// Root mean square about the mean.
    pub rms: f64,
    /// Smallest value.
    pub smallest: f64,
    /// Largest value.
    pub largest: f64,
}

/// What a compensation does to noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Noise {
    /// Rms out over rms in for white noise.
    pub white_gain: f64,
    /// Largest gain.
    pub largest_gain: f64,
    /// Frequency of the largest gain.
    pub largest_gain_at_hz: f64,
    /// Gain over frequency.
    pub gain: Vec<Gain>,
    /// Noise of this record, in the unit of the result.
    pub record: Option<RecordNoise>,
}

/// Gain of the compensation at a frequency.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gain {
    /// Frequency.
    pub frequency_hz: f64,
    /// `|torque / recorded torque|`.
    pub gain: f64,
    /// Its relative standard uncertainty, from the stand's constants; `null` if unknown.
    pub relative_std: Option<f64>,
}

/// Noise of a record.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordNoise {
    /// Noise density of the record above the band, in unit/√Hz.
    pub floor_per_root_hz: f64,
    /// Where it was taken.
    pub floor_band_hz: [f64; 2],
    /// Noise within the band before compensation, rms.
    pub recorded_rms: f64,
    /// The same after compensation, rms.
    pub compensated_rms: f64,
    /// What the record holds within the band, rms without its mean, noise included.
    pub in_band_rms: f64,
    /// What the record holds above the band beside its noise, rms: it is left out.
    pub above_band_rms: f64,
    /// Ranges in which the record does not rise above its noise.
    pub lost_hz: Vec<[f64; 2]>,
}

impl Report {
    /// For people.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = String::new();
        let mut line = |label: &str, value: String| {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{label:<12} {value}");
        };
        line("input", format!("{} ({})", self.input, self.dialect));
        line(
            "channel",
            format!("{} in {}", self.channel, self.channel_unit),
        );
        line("calibration", self.calibration.clone());
        line(
            "time",
            format!(
                "{} samples at {} Hz ({}), from {} s",
                self.samples,
                rounded(self.rate_hz, 9),
                self.rate_from,
                short(self.start_s)
            ),
        );
        if let Some(resampled) = &self.resampled {
            line("resampled", resampled_text(resampled));
        }
        line(
            "band",
            format!(
                "compensated to {} Hz, nothing passed from {} Hz; within {} ms of either end the \
                 result leans on the record's continuation",
                short(self.band_hz),
                short(self.band_end_hz),
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
                "mean {}, {} rms about it, from {} to {} {}",
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

impl Report {
    fn effects_text(&self) -> String {
        let each = |e: &Effect| format!("{} ({}) {}", e.effect, e.form, e.done);
        let list: Vec<String> = self.effects.iter().map(each).collect();
        list.join(", ")
    }
}

fn resampled_text(resampled: &Resampled) -> String {
    format!(
        "{} samples interpolated to {}; {} gap(s) bridged by straight lines ({} samples, longest \
         step {} s), {} repeated stamp(s) left out, steps off by up to {} %",
        resampled.samples_in,
        resampled.samples_out,
        resampled.gaps,
        resampled.bridged,
        rounded(resampled.longest_step_s, 4),
        resampled.repeated,
        rounded(100.0 * resampled.largest_jitter, 3)
    )
}

impl Noise {
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
                "white noise grows {} times; how much this record has cannot be told (too few \
                 samples, or no noise above the band)",
                rounded(self.white_gain, 3)
            ),
            Some(noise) => format!(
                "{} {unit} rms in the band become {} {unit} rms",
                rounded(noise.recorded_rms, 3),
                rounded(noise.compensated_rms, 3)
            ),
        }
    }
}
