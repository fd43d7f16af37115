//! Numbers of an MCAP file as streamed signals.

use std::io::Read;

use mcap::records::op;

use super::channels::Channels;
use super::index::{self, SignalEnd};
use super::inventory;
use super::record::RawMessage;
use super::record::input::CountedInput;
use super::record::reader::RecordReader;
use super::selection::{FieldChoice, FieldRequest};
use super::signal::{SelectedSignal, TimeOptions, TopicSignal};
use super::summary::SignalSummary;
use crate::failure::{ErrorCode, Failure};
use crate::io::Input;

/// Number of messages read before samples are output.
const BATCH: usize = 1 << 13;

/// An open signal.
pub struct SignalReader {
    pass: FilePass,
    request: FieldRequest,
    signal: TopicSignal,
    /// Number of messages read while opening.
    ahead: usize,
}

impl SignalReader {
    /// Opens a file and finds the number in it.
    ///
    /// # Errors
    /// If the file cannot be read, or does not contain the number; the message lists the available
    /// ones.
    pub fn open(
        input: &Input,
        choice: &FieldChoice,
        options: &TimeOptions,
    ) -> Result<Self, Failure> {
        Self::with_stream(input, input.open()?, choice, options)
    }

    /// The same for an open input.
    ///
    /// # Errors
    /// As for [`Self::open`].
    pub fn with_stream(
        input: &Input,
        stream: Box<dyn Read + Send>,
        choice: &FieldChoice,
        options: &TimeOptions,
    ) -> Result<Self, Failure> {
        let mut pass = FilePass::new(input, stream)?;
        let mut wanted = RequestedSignal::new(input, choice)?;
        let mut ahead = 0;
        loop {
            while !pass.is_at_end && !wanted.is_time_chosen() {
                pass.read(1, |message, channels| {
                    let is_taken = wanted.take(message, channels, options, &input.name())?;
                    ahead += usize::from(is_taken);
                    Ok(is_taken)
                })?;
            }
            if wanted.signal.is_some() || !pass.read_again()? {
                break;
            }
        }
        let Some(mut signal) = wanted.signal else {
            return Err(pass.missed(&wanted.request));
        };
        if pass.is_at_end {
            signal.end()?;
        }
        Ok(Self {
            pass,
            request: wanted.request,
            signal,
            ahead,
        })
    }

    /// Name of the file, for messages.
    pub fn name(&self) -> &str {
        self.pass.records.name()
    }

    /// The selection.
    pub fn selected(&self) -> &SelectedSignal {
        &self.signal.selected
    }

    /// The chosen time of the first message minus its log time, in ns: the offset from the file's
    /// log times.
    pub fn log_offset_ns(&self) -> i64 {
        self.signal.log_offset_ns
    }

    /// The end of the signal, if the file has a summary and is seekable.
    pub fn end(&self) -> Option<SignalEnd> {
        let signal = &self.signal;
        let (selected, options) = (&signal.selected, &signal.options);
        index::signal_end(&self.pass.input, &self.request, selected, options)
    }

    /// Replaces the content of the two lists by the next samples in the order of their times, in ns
    /// from the origin of the clock; `false` at the end.
    ///
    /// # Errors
    /// If the file cannot be read, or channels of the topic have different types.
    pub fn next(
        &mut self,
        times_ns: &mut Vec<i64>,
        values: &mut Vec<f64>,
    ) -> Result<bool, Failure> {
        times_ns.clear();
        values.clear();
        let mut is_first = true;
        // Rates are determined from the first block, which must not be short.
        while values.len() < BATCH && (is_first || !self.pass.is_at_end) {
            is_first = false;
            let signal = &mut self.signal;
            let take = |message: &RawMessage, channels: &Channels| signal.take(message, channels);
            let messages = BATCH - std::mem::take(&mut self.ahead);
            self.pass.read(messages, take)?;
            let is_at_end = self.pass.is_at_end;
            if is_at_end {
                self.signal.end()?;
            }
            self.signal.give(is_at_end, times_ns, values);
        }
        Ok(!values.is_empty())
    }

    /// Summary of what was read; to be called at the end.
    pub fn finish(self) -> SignalSummary {
        self.pass.summary(&self.signal)
    }
}

/// Result of reading a number.
pub type FieldResult = Result<(SelectedSignal, SignalSummary), Failure>;

/// Reads several numbers of any topics in one pass and calls `each` with the index of the selection, times
/// in ns and values. Samples of one selection are in order of time; selections alternate. Returns one
/// result per selection: an error for one that is not in the file.
///
/// # Errors
/// If the file cannot be read.
pub fn read_fields(
    input: &Input,
    choices: &[FieldChoice],
    options: &TimeOptions,
    mut each: impl FnMut(usize, &[i64], &[f64]),
) -> Result<Vec<FieldResult>, Failure> {
    let wanted = choices
        .iter()
        .map(|choice| RequestedSignal::new(input, choice));
    let mut wanted = wanted.collect::<Result<Vec<_>, _>>()?;
    let mut pass = FilePass::new(input, input.open()?)?;
    let name = input.name();
    let (mut times_ns, mut values) = (Vec::new(), Vec::new());
    loop {
        while !pass.is_at_end {
            pass.read(BATCH, |message, channels| {
                let mut is_taken = false;
                for wanted in wanted.iter_mut().filter(|wanted| !wanted.is_done) {
                    match wanted.take(message, channels, options, &name) {
                        Ok(is_its) => is_taken |= is_its,
                        Err(failure) => wanted.fail(failure),
                    }
                }
                Ok(is_taken)
            })?;
            for (place, wanted) in wanted.iter_mut().enumerate() {
                wanted.give(pass.is_at_end, &mut times_ns, &mut values);
                each(place, &times_ns, &values);
            }
        }
        if wanted.iter().all(|wanted| wanted.is_done) || !pass.read_again()? {
            break;
        }
    }
    let result = |wanted: RequestedSignal| match (wanted.failure, wanted.signal) {
        (Some(failure), _) => Err(failure),
        (None, Some(signal)) => {
            let summary = pass.summary(&signal);
            Ok((signal.selected, summary))
        }
        (None, None) => Err(pass.missed(&wanted.request)),
    };
    Ok(wanted.into_iter().map(result).collect())
}

/// A requested signal.
struct RequestedSignal {
    request: FieldRequest,
    /// The signal, once a message of its topic has been seen.
    signal: Option<TopicSignal>,
    failure: Option<Failure>,
    /// Whether it takes no more messages.
    is_done: bool,
}

impl RequestedSignal {
    fn new(input: &Input, choice: &FieldChoice) -> Result<Self, Failure> {
        Ok(Self {
            request: match choice.check()? {
                FieldRequest::Only => inventory::only_topic(input)?,
                request => request,
            },
            signal: None,
            failure: None,
            is_done: false,
        })
    }

    fn take(
        &mut self,
        message: &RawMessage,
        channels: &Channels,
        options: &TimeOptions,
        name: &str,
    ) -> Result<bool, Failure> {
        if self.signal.is_none() {
            let found = TopicSignal::find(&self.request, message, channels, options, name);
            self.signal = found.transpose()?;
        }
        match &mut self.signal {
            Some(signal) => signal.take(message, channels),
            None => Ok(false),
        }
    }

    fn is_time_chosen(&self) -> bool {
        let signal = self.signal.as_ref();
        signal.is_some_and(|signal| signal.is_time_chosen)
    }

    fn fail(&mut self, failure: Failure) {
        self.failure = Some(failure);
        self.is_done = true;
    }

    /// Outputs the samples that need not be held back or, at the end of the file, all.
    fn give(&mut self, all: bool, times_ns: &mut Vec<i64>, values: &mut Vec<f64>) {
        times_ns.clear();
        values.clear();
        let Some(signal) = self.signal.as_mut().filter(|_| !self.is_done) else {
            return;
        };
        if all && let Err(failure) = signal.end() {
            return self.fail(failure);
        }
        signal.give(all, times_ns, values);
        self.is_done = all;
    }
}

/// A pass through a file.
struct FilePass {
    input: Input,
    records: RecordReader,
    channels: Channels,
    /// Number of truncated message records.
    broken: u64,
    is_second: bool,
    is_at_end: bool,
}

impl FilePass {
    fn new(input: &Input, stream: Box<dyn Read + Send>) -> Result<Self, Failure> {
        Ok(Self {
            input: input.clone(),
            records: RecordReader::new(input.name(), CountedInput::new(stream))?,
            channels: Channels::default(),
            broken: 0,
            is_second: false,
            is_at_end: false,
        })
    }

    /// Reads until a number of messages have been taken, or to the end.
    fn read(
        &mut self,
        messages: usize,
        mut take: impl FnMut(&RawMessage, &Channels) -> Result<bool, Failure>,
    ) -> Result<(), Failure> {
        let mut taken = 0;
        while taken < messages && !self.is_at_end {
            let Some((op, body)) = self.records.next()? else {
                self.is_at_end = true;
                break;
            };
            if op != op::MESSAGE {
                self.channels.note(op, body);
            } else if let Some(message) = RawMessage::read(body) {
                taken += usize::from(take(&message, &self.channels)?);
            } else {
                self.broken += 1;
            }
        }
        Ok(())
    }

    /// Restarts from the beginning if that may help to find a topic: if the chunk that declares a channel
    /// is damaged, the end of the file may have declared it again.
    fn read_again(&mut self) -> Result<bool, Failure> {
        if self.is_second || self.records.losses().count == 0 || self.input == Input::Stdin {
            return Ok(false);
        }
        self.records = RecordReader::open(&self.input)?;
        (self.broken, self.is_second, self.is_at_end) = (0, true, false);
        Ok(true)
    }

    /// Failure for a missing topic, with the available ones and the losses.
    fn missed(&self, request: &FieldRequest) -> Failure {
        let mut message = format!("{}: {}", self.records.name(), request.miss(&self.channels));
        for loss in &self.records.losses().first {
            message.push_str(&format!("; {loss}"));
        }
        ErrorCode::ChannelNotFound.failed(message)
    }

    fn summary(&self, signal: &TopicSignal) -> SignalSummary {
        SignalSummary::of(signal, &self.records, self.broken, self.channels.conflicts)
    }
}

#[cfg(test)]
#[path = "source_tests.rs"]
mod tests;
