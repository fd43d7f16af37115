//! The report of a compensation.

use std::fmt::Write;

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::noise::RecordNoise;
use torqcomp_dsp::resample::Resampled;

use super::band::BandReport;
use super::statistics::Statistics;
use crate::inverse::ResultStd;
use crate::outcome::RecordFigures;
use crate::print::{Report, plural, rounded, short, some_of};
use crate::recording::FilledSpan;
use crate::recording::moment::Moment;
use crate::stand::{ConstantStd, RecordedLevels};
use crate::warning::Warning;

/// Maximum number of stretches whose times the text gives.
const LISTED: usize = 20;

/// Report of a compensation.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub(in crate::commands) struct CompensateReport {
    /// Path of the recording.
    pub(super) input: String,
    /// How the recording is written.
    pub(super) dialect: String,
    /// Name of the channel.
    pub(super) channel: String,
    /// Unit of the channel in the recording.
    pub(super) channel_unit: String,
    /// `recorded`: the stand's response is in the channel and is divided out.
    pub(super) taken_as: &'static str,
    /// Path of the stand file.
    pub(super) stand: String,
    /// Path of the result.
    pub(super) output: String,
    /// Topic and field of the result in a file of messages.
    pub(super) output_signal: Option<String>,
    /// Unit of the result: of `result`, `noise.record`, `rated_torque`, `zero_std`, `result_std` and `lines`.
    pub(super) unit: String,
    /// How the record was converted to static torque.
    pub(super) calibration: String,
    /// Relative standard uncertainty of the constant of the calibration; `null` if unknown, or if there is none.
    pub(super) calibration_relative_std: Option<f64>,
    /// Standard uncertainty of every value from the given zero, in `unit`; `null` if it has none.
    pub(super) zero_std: Option<f64>,
    /// Rated torque of the transducer, in `unit`; `null` if not in the stand file.
    pub(super) rated_torque: Option<f64>,
    #[serde(skip)]
    pub(super) levels: RecordedLevels,
    /// Natural frequency in Hz and damping ratio of the stand's modes.
    #[serde(skip)]
    pub(super) modes: Vec<(f64, f64)>,
    /// Number of samples.
    pub(super) samples: usize,
    /// Number of samples, from the first on, checked for hum, held samples, coarse resolution and clipping under noise;
    /// all samples are checked for clipping and drop-outs.
    pub(super) looked_at: usize,
    /// Sampling rate, in Hz.
    pub(super) rate_hz: f64,
    /// Standard uncertainty of the rate by the time stamps, in Hz; `null` if the rate does not come from stamps.
    pub(super) rate_std_hz: Option<f64>,
    /// Where the rate comes from.
    pub(super) rate_from: String,
    /// First time of the result.
    #[serde(flatten)]
    pub(super) start: Moment,
    /// Stretches of samples that `--fill` or `--resample` filled in.
    pub(super) filled: Vec<FilledSpan>,
    /// Time on both sides of a sample in which the result depends on it, in s: 99 % of the weight of the filter.
    pub(super) reach_s: f64,
    /// `stream`, `whole-record`, or `refined` for a stand with effects that no filter describes.
    pub(super) method: &'static str,
    /// Effects of the stand that were removed, the last link of the chain first.
    pub(super) effects: Vec<UndoneEffect>,
    /// Highest frequency of the record at which nonlinear curves and torques of the stand were evaluated, in Hz; `null`
    /// if there are none.
    pub(super) seen_to_hz: Option<f64>,
    /// Times at which the torque cannot be recovered from the record.
    pub(super) lost: Vec<LostSpan>,
    /// Lines and trains of spikes removed, in `unit` after static conversion.
    pub(super) lines: Vec<RemovedLine>,
    /// The band, and where it comes from.
    pub(super) band: BandReport,
    /// End of the part of the spectrum that is compensated in full, in Hz.
    pub(super) band_hz: f64,
    /// Frequency above which nothing is passed, in Hz.
    pub(super) band_end_hz: f64,
    /// Time from either end within which the result depends on extrapolation beyond the record, in s.
    pub(super) edge_s: f64,
    /// The result in figures.
    pub(super) result: Statistics,
    /// Standard uncertainty of the result, for a stand with effects that no filter describes.
    pub(super) result_std: Option<ResultStd>,
    /// What `--resample` did; `null` without it.
    pub(super) resampled: Option<Resampled>,
    /// Effect of the compensation on noise.
    pub(super) noise: NoiseReport,
    /// Warnings, each with a stable code.
    pub(super) warnings: Vec<Warning>,
    /// Printed units per SI unit.
    #[serde(skip)]
    pub(super) scale: f64,
    /// Whether a part of the recording was selected with `--range`.
    #[serde(skip)]
    pub(super) is_part: bool,
    /// What the result is, for people.
    #[serde(skip)]
    pub(super) quantity: &'static str,
    /// Uncertainty of the calibration.
    #[serde(skip)]
    pub(super) constant: ConstantStd,
}

/// An effect that was taken out.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(super) struct UndoneEffect {
    /// Name of the effect.
    pub(super) effect: &'static str,
    /// Form of the effect in the stand file.
    pub(super) form: &'static str,
    /// `divided out`, `inverted`, `subtracted`, `integrated` (with memory, along the motion), or `marked` where it
    /// cannot be removed.
    pub(super) done: &'static str,
}

/// A line that was taken off, in the unit of the result as a record at rest has it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(super) struct RemovedLine {
    /// Frequency of the line, or rate of the spikes, in Hz.
    pub(super) frequency_hz: f64,
    /// Amplitude of the line, or peak of the spikes, in the stand file.
    pub(super) amplitude: f64,
    /// Amplitude of the record at this frequency, signal included; peak of the spikes in the record.
    pub(super) recorded: f64,
    /// Phase of the line's sine at the first sample, in rad; that of spikes is 0 at each of them.
    pub(super) phase_rad: f64,
    /// Fraction of the amplitude removed: less than 1 where the signal masks the phase, or the spikes.
    pub(super) share: f64,
}

/// A time in which the torque cannot be recovered from the record.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(super) struct LostSpan {
    /// The effect that hides the torque.
    pub(super) effect: &'static str,
    /// Start of the span, in s.
    pub(super) from_s: f64,
    /// End of the span, in s.
    pub(super) to_s: f64,
}

/// What a compensation does to noise.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub(super) struct NoiseReport {
    /// Rms after compensation over rms before it, for white noise.
    pub(super) white_gain: f64,
    /// Largest gain within the band.
    pub(super) largest_gain: f64,
    /// Frequency of the largest gain, in Hz.
    pub(super) largest_gain_at_hz: f64,
    /// Gain at some frequencies.
    pub(super) gain: Vec<NoiseAt>,
    /// Gain where the response is least certain; `null` if its uncertainty is unknown.
    pub(super) largest_std: Option<NoiseAt>,
    /// Noise of this record, in the unit of the result; `null` if it was not determined.
    pub(super) record: Option<RecordNoise>,
}

/// Gain of the compensation at a frequency.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(super) struct NoiseAt {
    /// Frequency, in Hz.
    pub(super) frequency_hz: f64,
    /// `|torque / recorded torque|`.
    pub(super) gain: f64,
    /// Relative standard uncertainty of the torque, of magnitude and phase together, from the stand's constants and the
    /// calibration; `null` if that of one of them is unknown.
    pub(super) relative_std: Option<f64>,
    /// Part of `relative_std` from the response that is divided out, of magnitude and phase together; `null` if unknown.
    pub(super) response_relative_std: Option<f64>,
}

impl Report for CompensateReport {
    const SCHEMA: &'static str = "torqcomp.compensate/1";

    fn text(&self) -> String {
        let mut text = String::new();
        for [label, value] in self.facts() {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{label:<12} {value}");
        }
        text
    }
}

/// Relative widening of the range of a result by its ends from which both are given.
const WIDER: f64 = 0.01;

impl CompensateReport {
    /// The figures for tables of many records.
    pub(super) fn figures(&self) -> RecordFigures {
        let Statistics {
            rms,
            smallest,
            largest,
            ..
        } = self.result;
        RecordFigures {
            samples: Some(self.samples),
            rate_hz: Some(self.rate_hz),
            band_hz: Some(self.band_hz),
            unit: Some(self.unit.clone()),
            rms: Some(rms),
            peak: Some(largest.max(-smallest)),
            noise_rms: self
                .noise
                .record
                .as_ref()
                .map(|noise| noise.compensated_rms),
        }
    }

    /// Processing and results: names with their values.
    pub(super) fn facts(&self) -> Vec<[String; 2]> {
        let fact = |label: &str, value: String| [label.to_owned(), value];
        let mut facts = vec![
            fact("input", format!("{} ({})", self.input, self.dialect)),
            fact(
                "channel",
                format!(
                    "{} in {}, taken as recorded",
                    self.channel, self.channel_unit
                ),
            ),
            fact("calibration", self.calibration.clone()),
            fact(
                "time",
                format!(
                    "{} samples at {} Hz ({}), from {}",
                    self.samples,
                    rounded(self.rate_hz, 9),
                    self.rate_from,
                    self.start.text()
                ),
            ),
        ];
        let resampled = self.resampled.iter();
        facts.extend(resampled.map(|resampled| fact("resampled", resampled_text(resampled))));
        if !self.filled.is_empty() {
            facts.push(fact("filled in", self.filled_text()));
        }
        facts.push(fact("band", self.band_text()));
        if !self.effects.is_empty() {
            facts.push(fact("effects", self.effects_text()));
        }
        facts.extend([
            fact("gain", self.noise.gain_text()),
            fact("uncertainty", self.uncertainty_text()),
            fact("noise", self.noise.record_text(&self.unit)),
            fact("result", self.result_text()),
        ]);
        if self.looked_at < self.samples {
            let looked_at = format!(
                "clipping and drop-outs were checked throughout, hum and held values in the first {} samples; inspect \
                 checks more",
                self.looked_at
            );
            facts.push(fact("quality", looked_at));
        }
        facts.push(fact("output", self.output.clone()));
        facts
    }

    /// Adds the gaps bridged in resampling to the filled-in stretches.
    pub(super) fn note_bridged(&mut self) {
        let start_s = self.start.seconds();
        let gaps = self
            .resampled
            .iter()
            .flat_map(|resampled| &resampled.bridged_gaps);
        self.filled.extend(gaps.map(|gap| FilledSpan {
            from_s: start_s + gap.from_s,
            to_s: start_s + gap.to_s,
            samples: gap.samples,
        }));
    }

    fn band_text(&self) -> String {
        format!(
            "compensated up to {} Hz, zero from {} Hz, {}; the first and last {} depend on extrapolation beyond the record{}",
            short(self.band_hz),
            short(self.band_end_hz),
            self.band.text(),
            match self.edge_s < 1.0 {
                true => format!("{} ms", rounded(1e3 * self.edge_s, 3)),
                false => format!("{} s", rounded(self.edge_s, 3)),
            },
            match self.is_part {
                true =>
                    " (to avoid this in the part you need, extend --range by that at both ends)",
                false => "",
            }
        )
    }

    /// Mean, rms and range of the result.
    pub(super) fn result_text(&self) -> String {
        let result = &self.result;
        format!(
            "mean {}, rms about the mean {}, range {} to {} {}",
            rounded(result.mean, 4),
            rounded(result.rms, 4),
            rounded(result.smallest, 4),
            rounded(result.largest, 4),
            self.unit
        ) + &self.inside_text()
    }

    /// The range away from the ends, if it differs from that of all samples.
    fn inside_text(&self) -> String {
        let Statistics {
            smallest, largest, ..
        } = self.result;
        let inside = self.result.inside.filter(|inside| {
            let wider = largest - smallest - (inside.largest - inside.smallest);
            wider > WIDER * (inside.largest - inside.smallest)
        });
        inside.map_or_else(String::new, |inside| {
            format!(
                "; {} to {} {} without the ends, which depend on extrapolation",
                rounded(inside.smallest, 4),
                rounded(inside.largest, 4),
                self.unit
            )
        })
    }

    /// Amount filled in, and its range of influence.
    pub(super) fn filled_summary(&self) -> String {
        self.filled_with("")
    }

    /// The same with a list of the places after the amount.
    fn filled_with(&self, places: &str) -> String {
        let samples: usize = self.filled.iter().map(|span| span.samples).sum();
        format!(
            "{} at {}{places}; the result within {} ms of {} is affected",
            plural(samples, "sample"),
            plural(self.filled.len(), "place"),
            rounded(1e3 * self.reach_s, 3),
            if samples == 1 { "it" } else { "them" }
        )
    }

    /// A time on the record's axis, for people.
    pub(super) fn time_text(&self, time_s: f64) -> String {
        match self.start.origin_ns {
            0 => format!("{} s", rounded(time_s, 12)),
            // Seconds since 1970 have a resolution of 0.24 µs in an f64.
            _ => {
                let after_s = ((time_s - self.start.seconds()) * 1e6).round() * 1e-6;
                self.start.later(after_s).short()
            }
        }
    }

    fn filled_text(&self) -> String {
        let each = self.filled.iter().map(|span| {
            let [from, to] = [span.from_s, span.to_s].map(|s| self.time_text(s));
            format!("{from} to {to} ({})", span.samples)
        });
        let listed = match self.filled.len() > LISTED {
            true => ", which --json lists",
            false => "",
        };
        let some = some_of(each, self.filled.len(), LISTED);
        self.filled_with(&format!(": {some}{listed}"))
    }

    fn effects_text(&self) -> String {
        let each = |e: &UndoneEffect| format!("{} ({}) {}", e.effect, e.form, e.done);
        let list: Vec<String> = self.effects.iter().map(each).collect();
        list.join(", ")
    }
}

fn resampled_text(resampled: &Resampled) -> String {
    format!(
        "{} samples interpolated to {}; {} filled by linear interpolation ({}, longest step {} s), {} dropped, jitter \
         up to {} % of a step",
        resampled.samples_in,
        resampled.samples_out,
        plural(resampled.gaps, "gap"),
        plural(resampled.bridged, "sample"),
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
            .map(|g| format!("{} at {} Hz", rounded(g.gain, 3), short(g.frequency_hz)))
            .collect();
        points.join(", ")
    }

    pub(super) fn record_text(&self, unit: &str) -> String {
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
