//! Breaks in time stamps when the user gave the rate: the samples before and after them are joined.

use torqcomp_decimal::digits;
use torqcomp_dsp::quality::broken_line::BrokenLine;

use super::arrival_blocks::ArrivalBlocks;
use super::axis::{SampleStep, rounding, step_of};
use super::stamps::{IrregularStep, StampGrid, first_missing, is_gap};
use super::{Channel, RateFrom, TimeAxis};
use crate::io::Reading;
use crate::print::plural;
use crate::warning::{Warning, WarningCode};

/// Number of typical steps above which a step is a break, whole or not.
const LONG: f64 = 10.0;

/// Breaks in the stamps of streamed samples placed by a given rate.
#[derive(Debug, Default)]
pub(super) struct JoinedBreaks {
    /// Number of steps that leave out samples, and the first of them.
    gaps: usize,
    first_gap: Option<IrregularStep>,
    /// Total missing time, in the unit of the stamps.
    missing: f64,
    /// Number of backward steps, and the first of them.
    backwards: usize,
    first_backwards: Option<IrregularStep>,
    /// Number of stamps that repeat the one before, and the first of them.
    repeats: usize,
    first_repeat: Option<IrregularStep>,
}

impl StampGrid {
    /// The grid of the stamps themselves, for use when a rate is given instead; `None` if they have no typical step,
    /// so that breaks cannot be detected.
    pub(super) fn beside_given_rate(self, stamps: &[f64]) -> Option<Self> {
        let origin = self.origin_ns as f64 * 1e-9 / self.seconds_per_unit;
        let SampleStep { step, .. } = step_of(stamps, origin)?;
        let mut parts = stamps.chunk_by(|a, b| !is_gap((b - a) / step, 0.0) && b >= a);
        let quantum_of = |part: &[f64]| rounding(part, step, origin).map(|line| line.quantum_s);
        let quantum = quantum_of(stamps).or_else(|| parts.find_map(quantum_of));
        let quantum = quantum.unwrap_or(0.0);
        Some(Self {
            step,
            quantum,
            blocks: ArrivalBlocks::of(stamps, quantum),
            ..self
        })
    }

    /// Whether samples arrived in blocks at this rate.
    fn has_blocks_at(&self, rate_hz: f64) -> bool {
        let rate = rate_hz * self.seconds_per_unit;
        self.blocks.is_some_and(|blocks| blocks.are_at(rate))
    }
}

impl JoinedBreaks {
    /// Examines the next stamps; `last` is the one before them.
    pub(super) fn look(&mut self, grid: &StampGrid, last: Option<f64>, stamps: &[f64]) {
        let slack = grid.quantum / grid.step;
        let before = last.into_iter().chain(stamps.iter().copied());
        let behind = stamps.iter().copied().skip(usize::from(last.is_none()));
        for (row, (before, after)) in before.zip(behind).enumerate() {
            let found = IrregularStep { row, before, after };
            let length = (after - before) / grid.step;
            if grid.rolled_over(before, after).is_some() {
                continue;
            }
            if length < 0.0 {
                self.backwards += 1;
                self.first_backwards.get_or_insert(found);
            } else if length == 0.0 && slack < 0.5 {
                self.repeats += 1;
                self.first_repeat.get_or_insert(found);
            } else if is_gap(length, slack) || length > LONG + slack {
                self.gaps += 1;
                self.missing += after - before - grid.step;
                self.first_gap.get_or_insert(found);
            }
        }
    }

    /// Adopts the breaks of stamps too coarse for single steps to show them.
    fn look_at_coarse(&mut self, grid: &StampGrid, broken: &BrokenLine, stamps: &[f64]) {
        self.gaps = broken.breaks.len();
        self.missing = broken.missing() as f64 * grid.step;
        self.first_gap = first_missing(broken, stamps).map(|missing| missing.at);
    }

    /// Warning about the breaks.
    pub(super) fn warning(&self, source: &str, grid: &StampGrid) -> Option<Warning> {
        let time = |stamp: f64| grid.time_text(stamp);
        let gaps = self.first_gap.map(|gap| {
            format!(
                "skip {} s in {} (about {}), first from {} to {}",
                digits::text(self.missing * grid.seconds_per_unit, 4),
                plural(self.gaps, "gap"),
                plural((self.missing / grid.step).round() as usize, "sample"),
                time(gap.before),
                time(gap.after)
            )
        });
        let backwards = self.first_backwards.map(|step| {
            format!(
                "run backwards {}, first from {} to {}",
                plural(self.backwards, "time"),
                time(step.before),
                time(step.after)
            )
        });
        let said: Vec<String> = gaps.into_iter().chain(backwards).collect();
        if said.is_empty() {
            return self.repeated(source, grid);
        }
        let repeats = self.first_repeat.map(|repeat| {
            format!(
                ", and {} the one before, first at {}: --resample drops those",
                plural_verb(self.repeats, "stamp repeats", "stamps repeat"),
                time(repeat.after)
            )
        });
        Some(WarningCode::RateJoinsGaps.warning(format!(
            "{source}: the time stamps {}; --rate joins the samples on both sides, and all later times are wrong by \
             that amount. If the stamps are right, omit --rate, and fill gaps with --fill linear or exclude them \
             with --range{}",
            said.join(" and "),
            repeats.unwrap_or_default()
        )))
    }

    /// Warning about repeated stamps, if there are no other breaks.
    fn repeated(&self, source: &str, grid: &StampGrid) -> Option<Warning> {
        let first = self.first_repeat?;
        Some(WarningCode::RateKeepsRepeats.warning(format!(
            "{source}: {} the one before, first at {}: if those rows were written twice, --rate takes each for a \
             further sample, so that all later times are late and every repeat is a kink; omit --rate, and drop \
             them with --resample",
            plural_verb(self.repeats, "time stamp repeats", "time stamps repeat"),
            grid.time_text(first.after)
        )))
    }
}

/// A number with what fits it.
fn plural_verb(count: usize, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

impl Channel {
    /// Warning about breaks in its stamps if a rate is given instead.
    pub(super) fn joined_breaks(&self, source: &str, reading: &Reading) -> Option<Warning> {
        let rate_hz = reading.rate_hz.filter(|_| !reading.resample)?;
        let stamps_s = self.axis.stamps_s.as_ref()?;
        let grid = StampGrid {
            origin_ns: self.axis.origin_ns,
            ..StampGrid::of_seconds()
        };
        let grid = grid.beside_given_rate(stamps_s)?;
        if grid.has_blocks_at(rate_hz) {
            return None;
        }
        let mut breaks = JoinedBreaks::default();
        match BrokenLine::of(stamps_s) {
            Some(broken) => breaks.look_at_coarse(&grid, &broken, stamps_s),
            None => breaks.look(&grid, None, stamps_s),
        }
        breaks.warning(source, &grid)
    }
}

impl TimeAxis {
    /// Axis of samples at a rate given by the user, with the first at time 0; `beside` is the grid of their additional
    /// stamps.
    pub(super) fn given(rate_hz: f64, beside: Option<StampGrid>) -> Self {
        Self {
            rate_hz: Some(rate_hz),
            rate_from: RateFrom::Given,
            start: Some(super::moment::Moment::default()),
            // Stamps of arrival say nothing about gaps.
            beside: beside.filter(|grid| !grid.has_blocks_at(rate_hz)),
            ..Self::default()
        }
    }
}
