//! What was read of a signal, and what was not.

use super::blocks::Blocks;
use super::clock::Clock;
use super::decode::Damage;
use super::order::{Sorter, WINDOW};
use super::record::frames::Frames;
use super::source::Chosen;
use crate::warning::Warning;

/// What a signal came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Messages of the topic.
    pub messages: u64,
    /// Samples that were given.
    pub samples: u64,
    /// Messages without the item that is wanted.
    pub without_item: u64,
    /// Messages that could not be read.
    pub unreadable: u64,
    /// Samples that came after a later one.
    pub out_of_order: u64,
    /// Whether data were lost: exit code 3.
    pub is_lossy: bool,
    /// Time of the first sample, in ns.
    pub first_ns: Option<i64>,
    /// Time of the last sample, in ns.
    pub last_ns: Option<i64>,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

/// Counts while reading.
#[derive(Debug, Default)]
pub struct Tally {
    /// Messages of the topic.
    pub messages: u64,
    /// Message records that are cut short.
    pub broken: u64,
    /// Messages without a time.
    pub without_time: u64,
    samples: u64,
    without_item: Skipped,
    unreadable: Skipped,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
}

/// Messages left out, and why the first of them was.
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
            self.count
        ))
    }
}

impl Tally {
    /// Counts a message that gives no value.
    pub fn skip(&mut self, damage: Damage, log_time_ns: u64) {
        let skipped = match damage {
            Damage::NoItem { .. } | Damage::NoName { .. } | Damage::Absent => {
                &mut self.without_item
            }
            _ => &mut self.unreadable,
        };
        skipped.add(damage, log_time_ns);
    }

    /// Counts samples that are given.
    pub fn samples(&mut self, times_ns: &[i64]) {
        self.samples += times_ns.len() as u64;
        self.first_ns = self.first_ns.or(times_ns.first().copied());
        self.last_ns = times_ns.last().copied().or(self.last_ns);
    }

    /// Puts everything together.
    #[must_use]
    pub fn summary(
        self,
        chosen: &Chosen,
        frames: &Frames,
        sorter: &Sorter,
        blocks: &Blocks,
        clock: &Clock,
        conflicts: u64,
    ) -> Summary {
        let mut warnings = losses(frames, self.last_ns);
        warnings.extend(self.left_out(chosen, blocks));
        warnings.extend(out_of_order(&chosen.topic, sorter));
        let mut say = |code, message: String| warnings.push(Warning::new(code, message));
        for said in clock.warnings() {
            say("mcap-clock", format!("{}: {said}", chosen.topic));
        }
        if conflicts > 0 {
            let message = format!(
                "{conflicts} schemas or channels are declared again with another content; the \
                 first declaration was used"
            );
            say("mcap-conflict", message);
        }
        Summary {
            is_lossy: frames.loss_count() > 0
                || sorter.too_late > 0
                || self.unreadable.count + self.without_time + self.broken > 0
                || blocks.without_spacing > 0,
            messages: self.messages,
            samples: self.samples,
            without_item: self.without_item.count,
            unreadable: self.unreadable.count,
            out_of_order: sorter.out_of_order,
            first_ns: self.first_ns,
            last_ns: self.last_ns,
            warnings,
        }
    }

    /// What is said of messages that gave no sample.
    fn left_out(&self, chosen: &Chosen, blocks: &Blocks) -> Vec<Warning> {
        let mut warnings = Vec::new();
        let mut say = |code, message: String| warnings.push(Warning::new(code, message));
        let topic = &chosen.topic;
        if let Some(said) = self.unreadable.say("messages could not be read") {
            say("mcap-unreadable", format!("{topic}: {said}"));
        }
        let what = format!("messages have no {}", chosen.field);
        if let Some(said) = self.without_item.say(&what) {
            say("mcap-without-item", format!("{topic}: {said}"));
        }
        if self.without_time + self.broken + blocks.without_spacing > 0 {
            let message = format!(
                "{topic}: {} messages without a usable time, {} without a usable spacing of their \
                 samples and {} cut short were left out",
                self.without_time, blocks.without_spacing, self.broken
            );
            say("mcap-skipped", message);
        }
        warnings
    }
}

/// A warning for each loss of the file.
#[must_use]
pub fn losses(frames: &Frames, last_ns: Option<i64>) -> Vec<Warning> {
    let mut warnings: Vec<_> = frames
        .losses()
        .iter()
        .map(|loss| {
            let last = match (loss.code(), last_ns) {
                ("mcap-truncated", Some(last)) => format!(" (last message at {last} ns)"),
                _ => String::new(),
            };
            Warning::new(loss.code(), format!("{}: {loss}{last}", frames.name()))
        })
        .collect();
    let more = frames.loss_count() - frames.losses().len();
    if more > 0 {
        let message = format!("{}: {more} more losses of this kind", frames.name());
        warnings.push(Warning::new("mcap-more-losses", message));
    }
    warnings
}

/// What is said of samples that came after later ones.
fn out_of_order(topic: &str, sorter: &Sorter) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut say = |code, message: String| warnings.push(Warning::new(code, message));
    if sorter.out_of_order > 0 {
        let message = format!(
            "{topic}: {} samples came after a later one and were put in order",
            sorter.out_of_order - sorter.too_late
        );
        say("mcap-out-of-order", message);
    }
    if sorter.too_late > 0 {
        let message = format!(
            "{topic}: {} samples came more than {WINDOW} samples late and were left out; sort \
                 the file by time first",
            sorter.too_late
        );
        say("mcap-too-late", message);
    }
    warnings
}
