//! Band of a compensation: as given, or chosen from the record and the stand.

use std::ops::Range;

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::band::{Band, BandSearch, Deciding, DecidingLines, band_of_stand};
use torqcomp_dsp::compensate::Inverse;
use torqcomp_dsp::quality::clipping::Clipping;
use torqcomp_dsp::quality::interpolated::{Interpolated, interpolated};
use torqcomp_dsp::quality::repeats::repeats;
use torqcomp_dsp::quality::stuck::standstills;

use crate::cli::BandOption;
use crate::commands::convert;
use crate::failure::{ErrorCode, Failure};
use crate::print::{rounded, short};
use crate::recording::{ChannelStream, FirstSamples};
use crate::stand::Calibration;
use crate::warning::{Warning, WarningCode};

/// The band of `--band rated`, that of the thesis, as far as the rate allows.
const RATED_BAND_HZ: f64 = 2400.0;
/// Highest frequency over the rate of new values: holding them reduces a sine there by 6 % (sin(πx)/(πx)).
const HELD: f64 = 0.2;
/// The same where straight lines join them: they reduce a sine there by 6 % (its square).
const JOINED: f64 = 0.14;
/// Minimum number of samples for choosing a band, if available.
const FIRST_SAMPLES: usize = 1 << 17;

/// Fraction of the result from which a line is questioned.
const MATTERS: f64 = 0.02;

/// The band of a compensation and where it comes from.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub(super) struct BandReport {
    /// End of the part that is compensated in full.
    pub(super) top_hz: f64,
    /// Frequency above which nothing is passed.
    pub(super) end_hz: f64,
    pub(super) chosen_from: BandSource,
    /// Length of the part of the record that the band was chosen from, in s; `null` if it was not chosen.
    pub(super) seconds: Option<f64>,
    /// Whether the record is too short for a spectrum to choose from.
    #[serde(skip)]
    pub(super) is_too_short: bool,
    /// Lines without which it would end far below.
    #[serde(skip)]
    pub(super) lines: Option<DecidingLines>,
}

/// Where a band comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum BandSource {
    /// The whole record.
    #[default]
    Record,
    /// The first seconds of a longer one.
    FirstSeconds,
    /// The stand alone, since the record does not rise above its noise or is too short to estimate it.
    Stand,
    /// The rate at which new values come, where each is held for several samples.
    HeldSamples,
    /// The rate at which the record was made before it was interpolated by straight lines.
    InterpolatedSamples,
    /// `--band HZ`.
    Option,
    /// `--band rated`.
    Rated,
}

/// Criteria for choosing a band.
pub(super) struct Wanted<'a> {
    pub(super) option: Option<BandOption>,
    pub(super) chain: &'a Calibration,
    pub(super) inverse: &'a Inverse,
}

impl Wanted<'_> {
    /// The band for a stream, chosen from the first samples if no band is given.
    pub(super) fn choose(&self, stream: &mut ChannelStream) -> Result<(Band, BandReport), Failure> {
        let rate_hz = stream.rate_hz;
        let (mut lines, mut is_too_short) = (None, false);
        let (band, chosen_from, seconds) = match self.option {
            Some(BandOption::Hz(top_hz)) => (Band::new(rate_hz, top_hz), BandSource::Option, None),
            Some(BandOption::Rated) => (
                Band::fitting(rate_hz, RATED_BAND_HZ),
                BandSource::Rated,
                None,
            ),
            None => {
                let mut first = stream.first_samples(FIRST_SAMPLES)?;
                // A sample that cannot be converted is rejected during compensation.
                if let Err((index, _)) = convert(self.chain, &mut first.values) {
                    first.values.truncate(index);
                }
                let joined = interpolated(&first.values);
                let search = self.search(&first, joined, rate_hz);
                let seconds = first.values.len() as f64 / rate_hz;
                let from = match first.is_all {
                    true => BandSource::Record,
                    false => BandSource::FirstSeconds,
                };
                let best = search.as_ref().and_then(BandSearch::best);
                let (top_hz, from) = match best {
                    Some(best) => (best.top_hz, from),
                    None => (band_of_stand(rate_hz, self.inverse), BandSource::Stand),
                };
                let (top_hz, from) = match of_recorded(&first.values, joined, rate_hz) {
                    Some(limit) if limit.0 < top_hz => limit,
                    _ => (top_hz, from),
                };
                is_too_short = search.is_none();
                lines = search.and_then(|search| search.deciding_lines(top_hz));
                (Band::new(rate_hz, top_hz), from, Some(seconds))
            }
        };
        let band =
            band.map_err(|error| ErrorCode::UnsuitableRecord.failed(error).at(&stream.source))?;
        let report = BandReport {
            top_hz: band.top_hz(),
            end_hz: band.end_hz(),
            chosen_from,
            seconds,
            is_too_short,
            lines,
        };
        Ok((band, report))
    }
}

impl Wanted<'_> {
    /// The spectrum of what the gage sensed: without samples that were filled in, are stuck or clipped, and only those that
    /// were recorded if straight lines join them.
    fn search(
        &self,
        first: &FirstSamples,
        joined: Option<Interpolated>,
        rate_hz: f64,
    ) -> Option<BandSearch> {
        let without = not_recorded(first);
        let samples = &first.values;
        let Some(found) = joined else {
            return BandSearch::of_parts(samples, &without, rate_hz, self.inverse);
        };
        let kept = samples.iter().skip(found.first).step_by(found.every);
        let kept: Vec<f64> = kept.copied().collect();
        let place = |i: usize| i / found.every;
        let without = without.iter().map(|s| place(s.start)..place(s.end) + 1);
        let without: Vec<Range<usize>> = without.collect();
        BandSearch::of_parts(&kept, &without, rate_hz / found.every as f64, self.inverse)
    }
}

/// Stretches whose samples are not what the gage sensed: filled in, stuck or clipped. Their kinks have high
/// frequencies.
fn not_recorded(first: &FirstSamples) -> Vec<Range<usize>> {
    let samples = &first.values;
    let mut all = first.filled.clone();
    all.extend(standstills(samples).iter().map(|run| run.start..run.end()));
    if let Some(clipping) = Clipping::of(samples) {
        let mut from = 0;
        for part in samples.chunk_by(|a, b| clipping.holds(*a) == clipping.holds(*b)) {
            if clipping.holds(part[0]) {
                all.push(from..from + part.len());
            }
            from += part.len();
        }
    }
    all.retain(|stretch| stretch.start < samples.len());
    all
}

/// Highest frequency resolved by the samples that were recorded, if others between them are held or interpolated.
fn of_recorded(
    samples: &[f64],
    joined: Option<Interpolated>,
    rate_hz: f64,
) -> Option<(f64, BandSource)> {
    if let Some(found) = joined {
        let joined_hz = JOINED * rate_hz / found.every as f64;
        return Some((joined_hz, BandSource::InterpolatedSamples));
    }
    let hold = repeats(samples)?.hold?;
    Some((HELD * rate_hz / hold as f64, BandSource::HeldSamples))
}

impl BandReport {
    /// Where the band comes from, for people.
    pub(super) fn text(&self) -> String {
        let length = |seconds: Option<f64>| rounded(seconds.unwrap_or(0.0), 3);
        match self.chosen_from {
            BandSource::Option => "as given".to_owned(),
            BandSource::Rated => "the rated band".to_owned(),
            BandSource::Stand if self.is_too_short => format!(
                "chosen from the stand alone, up to a gain of 10, because a record of {} s is too short to estimate its \
                 noise",
                length(self.seconds)
            ),
            BandSource::Stand => format!(
                "chosen from the stand alone, up to a gain of 10, because the signal in the first {} s is below the \
                 noise",
                length(self.seconds)
            ),
            BandSource::HeldSamples => {
                "set to a fifth of the update rate, because each value is held for several samples"
                    .to_owned()
            }
            BandSource::InterpolatedSamples => {
                "set to a seventh of the original rate, because the record was interpolated by straight lines"
                    .to_owned()
            }
            BandSource::Record => {
                "chosen for the least expected error from the record and its noise".to_owned()
            }
            BandSource::FirstSeconds => format!(
                "chosen for the least expected error from the first {} s and their noise",
                length(self.seconds)
            ),
        }
    }

    /// A warning if it depends on a few lines alone that may not be torque and matter in a result of this rms. `scale`:
    /// printed units per unit of the lines.
    pub(super) fn question(&self, unit: &str, scale: f64, rms: f64) -> Option<Warning> {
        let lines = self.lines?;
        let of_lines = lines.result_rms * scale.abs();
        if of_lines < MATTERS * rms {
            return None;
        }
        let which = match lines.what {
            Deciding::Lines(1) => "the line".to_owned(),
            Deciding::Lines(count) => format!("{count} lines, the strongest"),
            Deciding::From(from_hz) => format!(
                "what it contains above {} Hz, far above the rest, with its strongest line",
                rounded(from_hz, 3)
            ),
        };
        Some(WarningCode::LinesDecideBand.warning(format!(
            "the band extends to {} Hz only because of {which} at {} Hz: {} {unit} rms of the result. If that is \
             interference (from a switching converter, say) and not torque, give --band {}",
            short(self.top_hz),
            rounded(lines.frequency_hz, 4),
            rounded(of_lines, 3),
            short(lines.without_hz)
        )))
    }

    /// Whether it was given by `--band`.
    pub(super) fn is_given(&self) -> bool {
        matches!(self.chosen_from, BandSource::Option | BandSource::Rated)
    }
}
