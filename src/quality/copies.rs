//! Channels that are equal to, or multiples of each other, within a file and across files.

use torqcomp_dsp::quality::copies::{Portrait, Relation, relation};

use super::{labels, unit_of, with_unit};
use crate::print::rounded;
use crate::recording::{Channel, Recording};
use crate::warning::{Warning, WarningCode};

/// A channel to be compared.
struct ComparedChannel<'a> {
    label: String,
    channel: &'a Channel,
    portrait: Portrait<'a>,
}

/// A channel from which others follow.
struct Family<'a> {
    first: ComparedChannel<'a>,
    others: Vec<(ComparedChannel<'a>, Relation)>,
}

/// Warnings about channels of one file that follow from each other, each with the names of all of
/// them.
pub fn within(recording: &Recording) -> Vec<(Warning, Vec<String>)> {
    let mut families: Vec<Family> = Vec::new();
    for channel in seen(recording) {
        let found = families.iter_mut().find_map(|family| {
            let relation = relation(&family.first.portrait, &channel.portrait)?;
            Some((family, relation))
        });
        match found {
            Some((family, relation)) => family.others.push((channel, relation)),
            None => families.push(Family {
                first: channel,
                others: Vec::new(),
            }),
        }
    }
    families.iter().flat_map(Family::warnings).collect()
}

impl Family<'_> {
    fn warnings(&self) -> Vec<(Warning, Vec<String>)> {
        let first = &self.first.label;
        let (same, scaled): (Vec<_>, Vec<_>) = self
            .others
            .iter()
            .partition(|(_, relation)| relation.identical);
        let names = |others: &[&(ComparedChannel, Relation)]| -> Vec<String> {
            let others = others.iter().map(|(seen, _)| seen.label.clone());
            std::iter::once(first.clone()).chain(others).collect()
        };
        let mut found = Vec::new();
        if !same.is_empty() {
            let quoted: Vec<String> = same
                .iter()
                .map(|(s, _)| format!("\"{}\"", s.label))
                .collect();
            let hold = if same.len() == 1 { "holds" } else { "hold" };
            let message = format!(
                "{} {hold} the same samples as \"{first}\": the same signal stored several times",
                quoted.join(", ")
            );
            found.push((WarningCode::ChannelCopy.warning(message), names(&same)));
        }
        if !scaled.is_empty() {
            let equations = scaled.iter().map(|(seen, relation)| {
                let right = follows(first, seen.channel, relation);
                format!("\"{}\" = {right}", seen.label)
            });
            let message = format!(
                "to within the rounding of both, {}: the same signal on different scales",
                equations.collect::<Vec<_>>().join("; ")
            );
            found.push((
                WarningCode::ChannelMultiple.warning(message),
                names(&scaled),
            ));
        }
        found
    }
}

/// `2.5 × "a" + 1 V`.
fn follows(first: &str, channel: &Channel, relation: &Relation) -> String {
    let text = format!("{} x \"{first}\"", rounded(relation.factor, 6));
    let extent = channel.samples.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    if relation.offset.abs() < 1e-6 * extent {
        return text;
    }
    let sign = if relation.offset < 0.0 { '-' } else { '+' };
    let offset = with_unit(relation.offset.abs(), unit_of(channel), 6);
    format!("{text} {sign} {offset}")
}

/// Warnings about channels of different files with equal samples.
pub fn across(recordings: &[&Recording]) -> Vec<Warning> {
    let portraits: Vec<Vec<ComparedChannel>> = recordings.iter().map(|r| seen(r)).collect();
    let mut found = Vec::new();
    for (i, first) in portraits.iter().enumerate() {
        for (j, second) in portraits.iter().enumerate().skip(i + 1) {
            let pairs = first
                .iter()
                .flat_map(|a| second.iter().map(move |b| (a, b)));
            for (a, b) in pairs {
                let Some(relation) = relation(&a.portrait, &b.portrait) else {
                    continue;
                };
                let (name, other) = (&a.label, &b.label);
                let (file, second) = (&recordings[i].source, &recordings[j].source);
                let (code, what) = if relation.identical {
                    (
                        WarningCode::ChannelCopy,
                        format!("the same samples as \"{name}\""),
                    )
                } else {
                    (
                        WarningCode::ChannelMultiple,
                        follows(name, b.channel, &relation),
                    )
                };
                found.push(code.warning(format!("\"{other}\" of {second} is {what} of {file}")));
            }
        }
    }
    found
}

/// The channels suitable for comparison.
fn seen(recording: &Recording) -> Vec<ComparedChannel<'_>> {
    let labels = labels(&recording.channels);
    let channels = recording.channels.iter().zip(labels);
    channels
        .filter_map(|(channel, label)| {
            let portrait = Portrait::of(&channel.samples)?;
            Some(ComparedChannel {
                label,
                channel,
                portrait,
            })
        })
        .collect()
}
