//! Findings about the samples of a channel.

use torqcomp_dsp::quality::clipping::{Clipping, Rail};
use torqcomp_dsp::quality::finite::{NonFinite, non_finite};
use torqcomp_dsp::quality::interleaved::interleaved;
use torqcomp_dsp::quality::interpolated::{Interpolated, interpolated};
use torqcomp_dsp::quality::mains::{Mains, mains};
use torqcomp_dsp::quality::quantisation::{Quantisation, quantisation};
use torqcomp_dsp::quality::repeats::{Repeats, repeats};
use torqcomp_dsp::quality::spikes::{Spikes, spikes};
use torqcomp_dsp::quality::streamed::{Faults, Standstills};
use torqcomp_dsp::quality::stuck::{constant, standstills};
use torqcomp_dsp::quality::{Run, is_straight, range};

use super::{place, with_unit};
use crate::print::{plural, rounded, short};
use crate::recording::{Hole, HoleKind, TimeAxis};
use crate::warning::{Warning, WarningCode};

/// Number of levels below which a resolution is coarse: 8 bits.
const COARSE: f64 = 256.0;
/// Number of levels up to which a channel is a state rather than a measurement.
const STATES: usize = 4;

/// Minimum number of samples for a statement about resolution; fewer are a table of readings.
const FEWEST: usize = 100;

/// Number of samples below which a constant channel is not conspicuous.
const FEW: usize = 10;

/// Whether a measurement has fewer levels than that.
pub(super) fn is_coarse(found: &Quantisation, levels: f64) -> bool {
    found.levels < levels && found.seen > STATES
}

/// Findings about the samples of a channel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Findings {
    /// Number of samples.
    pub samples: usize,
    /// Smallest and largest finite sample.
    pub range: Option<(f64, f64)>,
    /// Mean of the finite samples.
    pub mean: Option<f64>,
    /// Their standard deviation: rms without the mean.
    pub std: Option<f64>,
    /// Non-finite samples.
    pub non_finite: Option<NonFinite>,
    /// Whether it is a straight line, such as a counter or time axis.
    pub is_straight: bool,
    /// Value of a constant channel.
    pub constant: Option<f64>,
    /// Clipping.
    pub clipping: Option<Clipping>,
    /// Intervals in which it is stuck.
    pub standstills: Option<Standstills>,
    /// Isolated outliers.
    pub spikes: Option<Spikes>,
    /// Mean difference of two signals that take turns.
    pub interleaved: Option<f64>,
    /// Straight lines between samples.
    pub interpolated: Option<Interpolated>,
    /// Repeated samples.
    pub repeats: Option<Repeats>,
    /// Resolution.
    pub quantisation: Option<Quantisation>,
    /// Mains lines; `None` also if they cannot be searched for.
    pub mains: Option<Mains>,
}

impl Findings {
    /// Analyses the samples of a channel.
    pub fn of(samples: &[f64], rate_hz: Option<f64>) -> Self {
        let (mean, std) = mean_and_std(samples).unzip();
        let clipping = Clipping::of(samples);
        let rails = clipping.map(|c| [c.low, c.high]).unwrap_or_default();
        let at_rail = |run: &Run| rails.iter().flatten().any(|rail| rail.value == run.value);
        let mut standstills = standstills(samples);
        standstills.retain(|run| !at_rail(run));
        Self {
            samples: samples.len(),
            range: range(samples),
            mean,
            std,
            non_finite: non_finite(samples),
            is_straight: is_straight(samples),
            constant: constant(samples),
            clipping,
            standstills: Standstills::of(&standstills),
            spikes: Spikes::of(&spikes(samples)),
            interleaved: interleaved(samples),
            interpolated: interpolated(samples),
            repeats: repeats(samples),
            quantisation: quantisation(samples),
            mains: rate_hz.and_then(|rate_hz| mains(samples, rate_hz)),
        }
    }

    /// The same with clipping, standstills and spikes from the whole record.
    #[must_use]
    pub fn with(mut self, faults: &Faults) -> Self {
        // A level under noise is only searched for at the beginning.
        let is_noisy = |c: &Clipping| {
            [c.low, c.high]
                .iter()
                .flatten()
                .any(|rail| rail.spread > 0.0)
        };
        self.clipping = faults.clipping.or(self.clipping.filter(is_noisy));
        self.standstills = faults.standstills;
        self.spikes = faults.spikes;
        self
    }

    /// Value of a constant channel with enough samples to be conspicuous.
    pub fn dead(&self) -> Option<f64> {
        self.constant.filter(|_| self.samples >= FEW)
    }

    /// The resolution, if it is coarse for a measurement.
    pub fn coarse(&self) -> Option<Quantisation> {
        self.quantisation
            .filter(|q| is_coarse(q, COARSE))
            .filter(|_| self.samples >= FEWEST && !self.is_straight)
    }

    /// Warnings about this channel, except those combined for several channels ([`super::constant`],
    /// [`super::coarse`]). `holes` are the non-numeric cells, as far as they are known.
    pub fn warnings(
        &self,
        name: &str,
        unit: &str,
        axis: &TimeAxis,
        holes: &[Hole],
    ) -> Vec<Warning> {
        let mut found = Vec::new();
        found.extend(
            self.non_finite
                .map(|f| non_finite_cells(name, &f, axis, holes)),
        );
        let clipping = self.clipping.iter();
        found.extend(clipping.flat_map(|c| clipped_ends(name, unit, c, axis)));
        found.extend(self.standstills.map(|s| stuck(name, unit, &s, axis)));
        found.extend(self.spikes.map(|s| spiked(name, unit, &s, axis)));
        found.extend(self.interleaved.map(|by| two_signals(name, unit, by)));
        let lines = self.interpolated.iter();
        found.extend(lines.map(|found| interpolated_by(name, found, axis)));
        found.extend(self.repeats.and_then(|r| repeats_of(name, &r, axis)));
        // Lines that may be shaft orders are listed, but cause no warning.
        let hum_of = self.mains.as_ref().filter(|mains| mains.shaft_hz.is_none());
        found.extend(hum_of.map(|mains| hum(name, unit, mains)));
        found
    }
}

fn mean_and_std(samples: &[f64]) -> Option<(f64, f64)> {
    let finite = || samples.iter().filter(|x| x.is_finite());
    let count = finite().count() as f64;
    let mean = finite().sum::<f64>() / count;
    let square = finite().map(|x| (x - mean) * (x - mean)).sum::<f64>();
    (count > 0.0).then(|| (mean, (square / count).sqrt()))
}

fn non_finite_cells(name: &str, found: &NonFinite, axis: &TimeAxis, holes: &[Hole]) -> Warning {
    let kinds = [
        (HoleKind::Empty, "empty"),
        (HoleKind::Missing, "beyond the end of their line"),
        (HoleKind::NonFinite, "NaN or infinite"),
        (
            HoleKind::InstrumentsMark,
            "with 9.91e37 or \u{b1}9.9e37, which instruments write for no value or over range",
        ),
        (
            HoleKind::OverRange,
            "over range: the input was clipped there",
        ),
        (HoleKind::Text, "text"),
    ];
    let counts: Vec<String> = kinds
        .iter()
        .map(|(kind, word)| (holes.iter().filter(|hole| hole.what == *kind).count(), word))
        .filter(|(count, _)| *count > 0)
        .map(|(count, word)| format!("{count} {word}"))
        .collect();
    let counts = match counts.as_slice() {
        [] => String::new(),
        some => format!(" ({})", some.join(", ")),
    };
    let line = match holes.first() {
        Some(hole) if hole.line > 0 => format!(", line {}", hole.line),
        _ => String::new(),
    };
    WarningCode::NonFinite.warning(format!(
        "\"{name}\": {} without a finite number{counts}, the first at {}{line}, at most {} in a row; \
         remove or repair them before processing",
        plural(found.count, "sample"),
        place(axis, found.first),
        found.longest
    ))
}

/// Warnings about clipping of a channel.
pub fn clipped_ends(name: &str, unit: &str, found: &Clipping, axis: &TimeAxis) -> Vec<Warning> {
    let ends = [(found.low, "lowest"), (found.high, "highest")].into_iter();
    let warning = |(rail, end): (Option<Rail>, _)| Some(clipped(name, unit, end, &rail?, axis));
    ends.filter_map(warning).collect()
}

fn clipped(name: &str, unit: &str, end: &str, rail: &Rail, axis: &TimeAxis) -> Warning {
    let samples = plural(rail.samples, "sample");
    let (level, there) = match rail.spread > 0.0 {
        false => ("value", "exactly there".to_owned()),
        true => (
            "level",
            format!("within {} there", with_unit(rail.spread, unit, 2)),
        ),
    };
    WarningCode::Clipped.warning(format!(
        "\"{name}\" is clipped at its {end} {level} of {}: {samples} are {there}, in {} of up to {} samples that \
         the signal enters or leaves at full slope, the first at {}; use a larger input range, unless the signal \
         itself is limited there",
        with_unit(rail.value, unit, 6),
        plural(rail.runs, "run"),
        rail.longest,
        place(axis, rail.first)
    ))
}

fn stuck(name: &str, unit: &str, found: &Standstills, axis: &TimeAxis) -> Warning {
    let (samples, longest) = (found.samples, found.longest);
    WarningCode::StuckChannel.warning(format!(
        "\"{name}\" is constant in {}, {samples} samples in all; the longest is {} samples at {}, starting at {}: \
         at rest, or a drop-out of a cable, a transmitter or the recorder",
        plural(found.count, "stretch"),
        longest.length,
        with_unit(longest.value, unit, 6),
        place(axis, longest.start)
    ))
}

pub(super) fn spiked(name: &str, unit: &str, found: &Spikes, axis: &TimeAxis) -> Warning {
    let first = found.first;
    let (places, is_first) = match found.count {
        1 => ("one isolated sample".to_owned(), ""),
        count => (format!("isolated samples in {count} places"), ", the first"),
    };
    WarningCode::Spikes.warning(format!(
        "\"{name}\": {places}, far from the neighbours{is_first} at {}: {} after {}; a mark for a missing value, a \
         drop-out or a glitch, unless the signal has such pulses; repair them, or exclude that part",
        place(axis, first.index),
        with_unit(first.value, unit, 6),
        with_unit(first.before, unit, 6)
    ))
}

fn two_signals(name: &str, unit: &str, difference: f64) -> Warning {
    WarningCode::TwoSignals.warning(format!(
        "\"{name}\": every other sample belongs to another signal, {} apart (rms): two sources are mixed row by row, as \
         two sensors of one logger, or two nodes that publish on one topic; give each a column or topic of its own, or \
         every second row (if it is one signal, it has a line near half the sampling rate)",
        with_unit(difference, unit, 3)
    ))
}

/// Warning about a record that was interpolated to a higher rate.
pub fn interpolated_by(name: &str, found: &Interpolated, axis: &TimeAxis) -> Warning {
    let rates = axis.rate_hz.map_or_else(String::new, |rate_hz| {
        let recorded_hz = rate_hz / found.every as f64;
        format!(
            ", from {} to {} Hz: what lies above {} Hz are images of the signal",
            short(recorded_hz),
            short(rate_hz),
            short(0.5 * recorded_hz)
        )
    });
    WarningCode::InterpolatedSamples.warning(format!(
        "\"{name}\": the samples lie on straight lines between every {} of them: the record was interpolated{rates}; \
         use it as it was recorded, or keep one row in {}, beginning with row {}",
        ordinal(found.every),
        found.every,
        found.first + 1
    ))
}

/// `2nd`, `3rd`, `4th`.
fn ordinal(number: usize) -> String {
    let end = match (number % 10, number % 100) {
        (_, 11..=13) => "th",
        (1, _) => "st",
        (2, _) => "nd",
        (3, _) => "rd",
        _ => "th",
    };
    format!("{number}{end}")
}

/// Warning about samples that repeat more often than the resolution explains.
pub fn repeats_of(name: &str, found: &Repeats, axis: &TimeAxis) -> Option<Warning> {
    (found.unexplained == Some(true)).then(|| repeated(name, found, axis))
}

fn repeated(name: &str, found: &Repeats, axis: &TimeAxis) -> Warning {
    let percent = rounded(100.0 * found.fraction, 3);
    let rate = axis.rate_hz.map_or_else(String::new, |rate_hz| {
        let late = found.hold.map_or_else(String::new, |hold| {
            let late_s = 0.5 * (hold as f64 - 1.0) / rate_hz;
            format!(
                ", so that the record is late by {} s on average",
                rounded(late_s, 3)
            )
        });
        format!(
            "; new values come at about {} Hz, not {} Hz{late}",
            rounded(found.fresh * rate_hz, 3),
            short(rate_hz)
        )
    });
    let how = match found.hold {
        Some(hold) => format!("every value is held for {hold} samples"),
        None => "more than its resolution explains".to_owned(),
    };
    WarningCode::RepeatedSamples.warning(format!(
        "\"{name}\": {percent} % of the samples repeat the previous one, {how}{rate}"
    ))
}

fn hum(name: &str, unit: &str, found: &Mains) -> Warning {
    let lines: Vec<String> = found
        .lines
        .iter()
        .map(|line| {
            format!(
                "{} at {} Hz",
                with_unit(line.amplitude, unit, 3),
                rounded(line.frequency_hz, 5)
            )
        })
        .collect();
    WarningCode::MainsLines.warning(format!(
        "\"{name}\" has lines at multiples of {} Hz, as from mains hum: {} (peak; lines closer than {} Hz are not \
         resolved); a machine running in step with the mains causes such lines as well",
        short(found.nominal_hz),
        lines.join(", "),
        rounded(found.resolution_hz, 2)
    ))
}
