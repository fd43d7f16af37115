//! Comparison of the records read with the file's own statistics, index of chunks, and declared channels.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::{Record, op};

use super::file::{Loss, Losses};
use super::{parse, read_chunk_index};

/// Counts of the records read, and the file's own claims.
#[derive(Debug, Default)]
pub(crate) struct Census {
    declared: BTreeSet<u16>,
    /// Number of messages by channel.
    messages: BTreeMap<u16, u64>,
    /// Number of those whose channel was not declared before them.
    undeclared: u64,
    attachments: u64,
    /// Offsets of chunks.
    chunks: BTreeSet<u64>,
    /// Offsets of chunks from the index at the end of the file.
    indexed: BTreeSet<u64>,
    statistics: Option<Statistics>,
    /// Whether the last record may be followed by its message index.
    is_behind_chunk: bool,
}

/// The file's own statistics.
#[derive(Debug)]
struct Statistics {
    messages: u64,
    chunks: u64,
    attachments: u64,
    channels: BTreeMap<u16, u64>,
}

impl Census {
    /// Records a record of the file, or within a chunk if `chunk` is set.
    pub fn note(&mut self, op: u8, body: &[u8], at: u64, losses: &mut Losses) {
        match op {
            op::MESSAGE => self.message(body),
            op::CHANNEL => match parse(op, body) {
                Some(Record::Channel(channel)) => {
                    self.declared.insert(channel.id);
                }
                _ => losses.add(Loss::Unreadable { at, op }),
            },
            op::SCHEMA if parse(op, body).is_none() => losses.add(Loss::Unreadable { at, op }),
            op::ATTACHMENT => self.attachments += 1,
            op::CHUNK_INDEX => match read_chunk_index(body) {
                Some(index) => drop(self.indexed.insert(index.chunk_start_offset)),
                None => losses.add(Loss::Unreadable { at, op }),
            },
            op::STATISTICS => match mcap::parse_record(op, body) {
                Ok(Record::Statistics(found)) => {
                    self.statistics = Some(Statistics {
                        messages: found.message_count,
                        chunks: u64::from(found.chunk_count),
                        attachments: u64::from(found.attachment_count),
                        channels: found.channel_message_counts,
                    });
                }
                _ => losses.add(Loss::Unreadable { at, op }),
            },
            op::MESSAGE_INDEX if !self.is_behind_chunk => losses.add(Loss::LoneIndex { at }),
            _ => {}
        }
    }

    /// Records a top-level record of the file.
    pub fn note_outer(&mut self, op: u8, at: u64) {
        if op == op::CHUNK {
            self.chunks.insert(at);
        }
        self.is_behind_chunk = op == op::CHUNK || op == op::MESSAGE_INDEX && self.is_behind_chunk;
    }

    fn message(&mut self, body: &[u8]) {
        // The caller counts truncated records.
        let Some(id) = body.first_chunk().map(|id| u16::from_le_bytes(*id)) else {
            return;
        };
        *self.messages.entry(id).or_default() += 1;
        self.undeclared += u64::from(!self.declared.contains(&id));
    }

    /// Compares the counts with the file's claims, once it was read to its end.
    pub fn finish(&mut self, losses: &mut Losses) {
        if self.undeclared > 0 {
            let messages = self.undeclared;
            losses.add(Loss::Undeclared { messages });
        }
        if let Some(at) = self.indexed.difference(&self.chunks).next() {
            let chunks = self.indexed.difference(&self.chunks).count() as u64;
            losses.add(Loss::MissingChunks { at: *at, chunks });
        }
        let Some(statistics) = self.statistics.take() else {
            return;
        };
        let mut compare = |what, told: u64, found: u64| {
            if told != found {
                losses.add(Loss::Count { what, told, found });
            }
        };
        let found: u64 = self.messages.values().sum();
        compare("messages", statistics.messages, found);
        compare("chunks", statistics.chunks, self.chunks.len() as u64);
        compare("attachments", statistics.attachments, self.attachments);
        // Some recorders omit the counts of channels.
        if found == statistics.messages && !statistics.channels.is_empty() {
            let told = |id: &u16| statistics.channels.get(id).copied().unwrap_or(0);
            let differs = self.messages.iter().find(|(id, count)| told(id) != **count);
            if let Some((id, count)) = differs {
                compare("messages of a channel", told(id), *count);
            }
        }
    }
}
