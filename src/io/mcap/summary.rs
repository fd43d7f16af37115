//! Summary of the reading of a signal.

use super::decode::Damage;
use super::order::{Sorter, WINDOW};
use super::record::reader::RecordReader;
use super::signal::{SelectedSignal, TopicSignal};
use crate::print::plural;
use crate::warning::{Warning, WarningCode};

/// Summary of a signal.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalSummary {
    /// Number of messages of the topic.
    pub messages: u64,
    /// Number of samples output.
    pub samples: u64,
    /// Number of messages without the wanted item.
    pub without_item: u64,
    /// Number of unreadable messages.
    pub unreadable: u64,
    /// Number of samples that came after a later one.
    pub out_of_order: u64,
    /// Whether data were lost: exit code 3.
    pub is_lossy: bool,
    /// Warnings.
    pub warnings: Vec<Warning>,
}

/// Counts while reading.
#[derive(Debug, Default)]
pub(super) struct Tally {
    /// Number of messages of the topic.
    pub messages: u64,
    /// Number of messages without a time.
    pub without_time: u64,
    samples: u64,
    without_item: Skipped,
    /// Number of messages without the item, where the list or field is optional.
    unset: u64,
    unreadable: Skipped,
    last_ns: Option<i64>,
    /// Index of the item in the first message, if it is read by its name.
    first_place: Option<usize>,
    /// Number of messages with another index.
    moved: u64,
}

/// Number of skipped messages, and why the first of them was.
#[derive(Debug, Default)]
struct Skipped {
    count: u64,
    first: Option<(u64, Damage)>,
}

impl Skipped {
    fn add(&mut self, damage: Damage, log_time_ns: u64) {
        self.count += 1;
        self.first.get_or_insert((log_time_ns, damage));
    }

    fn say(&self, what: &str) -> Option<String> {
        let (log_time_ns, damage) = self.first.as_ref()?;
        Some(format!(
            "{} {what}; the first, logged at {log_time_ns} ns: {damage}",
            plural(self.count, "message")
        ))
    }
}

impl Tally {
    /// Counts a message without a value.
    pub fn skip(&mut self, damage: Damage, log_time_ns: u64) {
        self.unset += u64::from(!matches!(damage, Damage::NoName { .. }));
        let skipped = match damage {
            Damage::NoItem { .. } | Damage::NoName { .. } | Damage::Absent => {
                &mut self.without_item
            }
            _ => &mut self.unreadable,
        };
        skipped.add(damage, log_time_ns);
    }

    /// Checks the index of the item in a message, if it is read by its name.
    pub fn place(&mut self, place: Option<usize>) {
        if let Some(place) = place {
            let first = *self.first_place.get_or_insert(place);
            self.moved += u64::from(place != first);
        }
    }

    /// Counts output samples.
    pub fn samples(&mut self, times_ns: &[i64]) {
        self.samples += times_ns.len() as u64;
        self.last_ns = times_ns.last().copied().or(self.last_ns);
    }

    /// Warnings about messages without a sample.
    fn left_out(&self, signal: &TopicSignal, broken: u64) -> Vec<Warning> {
        let SelectedSignal { topic, field, .. } = &signal.selected;
        let mut warnings = Vec::new();
        let mut say = |code: WarningCode, message: String| warnings.push(code.warning(message));
        if let Some(said) = self.unreadable.say("could not be read") {
            say(WarningCode::McapUnreadable, format!("{topic}: {said}"));
        }
        let what = format!("without {field}");
        if let Some(said) = self.without_item.say(&what) {
            say(WarningCode::McapWithoutItem, format!("{topic}: {said}"));
        }
        if let (Some(by_name), 1..) = (&signal.by_name, self.moved) {
            let message = format!(
                "{topic}: the item that {field} is in the first message changes its index in {}; it was tracked by its \
                 name, as {by_name} does",
                plural(self.moved, "later message")
            );
            say(WarningCode::McapItemsMove, message);
        }
        let without_spacing = signal.blocks.without_spacing;
        if self.without_time + broken + without_spacing > 0 {
            let message = format!(
                "{topic}: messages skipped: {} without a usable time, {without_spacing} without a usable sample \
                 spacing, {broken} truncated",
                self.without_time
            );
            say(WarningCode::McapSkipped, message);
        }
        warnings
    }
}

impl SignalSummary {
    /// Summary of a signal, with `broken` truncated message records in the file and `conflicts`
    /// contradictory declarations.
    pub(super) fn of(
        signal: &TopicSignal,
        records: &RecordReader,
        broken: u64,
        conflicts: u64,
    ) -> Self {
        let (tally, sorter) = (&signal.tally, &signal.sorter);
        let topic = &signal.selected.topic;
        let mut warnings = losses(records, tally.last_ns);
        warnings.extend(tally.left_out(signal, broken));
        warnings.extend(out_of_order(topic, sorter));
        let clock = signal.clock.warnings().into_iter();
        warnings
            .extend(clock.map(|said| WarningCode::McapClock.warning(format!("{topic}: {said}"))));
        warnings.extend(conflict(conflicts));
        // A number in no message does not exist in the file.
        let unset = if tally.samples > 0 { tally.unset } else { 0 };
        let skipped = tally.unreadable.count + tally.without_time + broken + unset;
        Self {
            is_lossy: records.losses().count > 0
                || sorter.too_late > 0
                || skipped + signal.blocks.without_spacing > 0,
            messages: tally.messages,
            samples: tally.samples,
            without_item: tally.without_item.count,
            unreadable: tally.unreadable.count,
            out_of_order: sorter.out_of_order,
            warnings,
        }
    }
}

/// Warning about declarations that contradict an earlier one.
pub(super) fn conflict(conflicts: u64) -> Option<Warning> {
    let message = format!(
        "schemas or channels declared again with different content: {conflicts}; the first declaration was used"
    );
    (conflicts > 0).then(|| WarningCode::McapConflict.warning(message))
}

/// A warning for each loss of the file.
pub(super) fn losses(records: &RecordReader, last_ns: Option<i64>) -> Vec<Warning> {
    let (name, losses) = (records.name(), records.losses());
    let mut warnings: Vec<_> = losses
        .first
        .iter()
        .map(|loss| {
            let last = match (loss.code(), last_ns) {
                (WarningCode::McapTruncated, Some(last)) => format!(" (last message at {last} ns)"),
                _ => String::new(),
            };
            loss.code().warning(format!("{name}: {loss}{last}"))
        })
        .collect();
    let more = losses.count - losses.first.len();
    if more > 0 {
        let message = format!("{name}: further losses of this kind: {more}");
        warnings.push(WarningCode::McapMoreLosses.warning(message));
    }
    warnings
}

/// Warning about samples that came after later ones.
fn out_of_order(topic: &str, sorter: &Sorter) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut say = |code: WarningCode, message: String| warnings.push(code.warning(message));
    if sorter.out_of_order > 0 {
        let message = format!(
            "{topic}: sorted {} that arrived after a later one",
            plural(sorter.out_of_order - sorter.too_late, "sample")
        );
        say(WarningCode::McapOutOfOrder, message);
    }
    if sorter.too_late > 0 {
        let message = format!(
            "{topic}: dropped {} that arrived more than {WINDOW} samples late; sort the file by time first",
            plural(sorter.too_late, "sample")
        );
        say(WarningCode::McapTooLate, message);
    }
    warnings
}
