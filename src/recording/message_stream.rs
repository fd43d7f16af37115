//! Streaming of a number in the messages of an MCAP file.

use std::io::Read;

use super::block::{Block, BlockSource};
use super::stamps::StampGrid;
use super::stream::ChannelStream;
use super::{Channel, TimeAxis, choice, messages};
use crate::failure::{ErrorCode, Failure, RowKind};
use crate::io::mcap::SignalReader;
use crate::io::mcap::decode::Encoding;
use crate::io::{ChannelChoice, Input, Reading};
use crate::warning::Warning;

/// Range in nanoseconds that an `f64` represents exactly: 104 days.
const EXACT_NS: i64 = 1 << 53;

/// Origin of messages.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MessageOrigin {
    /// Their encoding, if known.
    pub(crate) encoding: Option<Encoding>,
    /// Time of the first sample, in ns.
    pub(crate) first_ns: i64,
    /// Offset of a sample's time from the file's log time, in ns.
    pub(crate) log_offset_ns: i64,
}

impl ChannelStream {
    /// A number in the messages of a file with the content `bytes`.
    pub(super) fn of_messages(
        input: &Input,
        bytes: Box<dyn Read + Send>,
        choice: &ChannelChoice,
        reading: &Reading,
    ) -> Result<Self, Failure> {
        let (field, times) = (messages::field(choice, reading), messages::times(reading));
        let source = SignalReader::with_stream(input, bytes, &field, &times);
        let mut source = match source {
            Ok(source) => source,
            Err(missed) => match messages::by_part(input, &field, choice.flags.channel)? {
                Some(found) => SignalReader::open(input, &found, &times)?,
                None => return Err(missed),
            },
        };
        let (name, chosen) = (source.name().to_owned(), source.selected().clone());
        let mut times_ns = Vec::new();
        let mut values = Vec::new();
        source.next(&mut times_ns, &mut values)?;
        let Some(&origin_ns) = times_ns.first() else {
            return Err(nothing_usable(&name, source));
        };
        let of_file = messages::unit(&chosen);
        let (unit, warning) = choice::unit_of(choice, &messages::name(&chosen), of_file.as_ref())?;
        let log_offset_ns = source.log_offset_ns();
        let later = later(&source, origin_ns);
        let blocks = MessageBlocks {
            source: Some(source),
            origin_ns,
            times_ns,
            values,
        };
        let heading = messages::clock(&chosen.time);
        let time = blocks.axis(&heading, &later, reading);
        let time = time.map_err(|failure| failure.at(&name))?;
        let overridden = blocks.overridden(&heading, reading)?;
        Ok(Self {
            source: name,
            dialect: format!("MCAP, {}", messages::describe(&chosen)),
            rate_hz: time.rate_hz.unwrap_or(f64::NAN),
            start: time.start.unwrap_or_default(),
            channel: Channel {
                unit,
                ..messages::channel(choice, &chosen, time)
            },
            warnings: warning.into_iter().chain(overridden).collect(),
            any_steps: reading.any_steps,
            origin: Some(MessageOrigin {
                encoding: Encoding::of(&chosen.encoding),
                log_offset_ns,
                first_ns: origin_ns,
            }),
            blocks: Box::new(blocks),
            text: None,
        })
    }
}

/// Stamps at doubling distances of a uniform record with the same number of messages and the same end; empty if the
/// end of the file does not give that.
fn later(source: &SignalReader, origin_ns: i64) -> Vec<f64> {
    let Some(end) = source.end().filter(|end| end.messages > 1) else {
        return Vec::new();
    };
    let steps = end.messages - 1;
    let step_ns = end.last_ns.saturating_sub(origin_ns) as f64 / steps as f64;
    let places = (6..63).map(|power| 1_u64 << power);
    let places = places.take_while(|place| *place < steps).chain([steps]);
    places.map(|place| step_ns * place as f64).collect()
}

fn nothing_usable(name: &str, source: SignalReader) -> Failure {
    let topic = source.selected().topic.clone();
    let said: Vec<String> = source
        .finish()
        .warnings
        .into_iter()
        .map(|warning| warning.message)
        .collect();
    ErrorCode::DamagedFile
        .failed(format_args!(
            "no message of {topic} could be used: {}",
            said.join("; ")
        ))
        .at(name)
}

/// Streamed messages; times are relative to the first one.
struct MessageBlocks {
    source: Option<SignalReader>,
    origin_ns: i64,
    /// Read but not yet output.
    times_ns: Vec<i64>,
    values: Vec<f64>,
}

impl MessageBlocks {
    /// Time axis from the first messages and the stamps `later`; `heading` names the clock.
    fn axis(&self, heading: &str, later: &[f64], reading: &Reading) -> Result<TimeAxis, Failure> {
        let grid = StampGrid {
            unit: "ns".to_owned(),
            seconds_per_unit: 1e-9,
            origin_ns: self.origin_ns,
            ..StampGrid::of_seconds()
        };
        if let Some(rate_hz) = reading.rate_hz.filter(|_| !reading.resample) {
            let beside = grid.beside_given_rate(&self.relative()?);
            return Ok(TimeAxis::given(rate_hz, beside));
        }
        let axis = TimeAxis::of_stream(heading, grid, &self.relative()?, later, reading)?;
        if !reading.any_steps {
            axis.check_rounding()?;
        }
        Ok(axis)
    }

    /// A warning if a given rate contradicts the first messages.
    fn overridden(&self, heading: &str, reading: &Reading) -> Result<Option<Warning>, Failure> {
        if reading.rate_hz.is_none() {
            return Ok(None);
        }
        let stamps_s: Vec<f64> = self.relative()?.iter().map(|ns| 1e-9 * ns).collect();
        Ok(choice::overridden(reading, heading, &stamps_s))
    }

    fn relative(&self) -> Result<Vec<f64>, Failure> {
        let one = |time_ns: &i64| match time_ns.checked_sub(self.origin_ns) {
            Some(ns) if ns.abs() < EXACT_NS => Ok(ns as f64),
            _ => Err(ErrorCode::IrregularTime.failed(format_args!(
                "a message at {time_ns} ns is more than 104 days from the first one at {} ns: the \
                 clock jumped; choose another one with --time log, publish or header",
                self.origin_ns
            ))),
        };
        self.times_ns.iter().map(one).collect()
    }
}

impl BlockSource for MessageBlocks {
    fn next(&mut self, block: &mut Block) -> Result<bool, Failure> {
        if self.values.is_empty()
            && let Some(source) = &mut self.source
        {
            source.next(&mut self.times_ns, &mut self.values)?;
        }
        let rows = &mut block.rows;
        rows.clear();
        rows.times = self.relative()?;
        rows.values.append(&mut self.values);
        self.times_ns.clear();
        Ok(!rows.values.is_empty())
    }

    fn finish(&mut self) -> (Option<Warning>, Vec<Warning>) {
        let Some(source) = self.source.take() else {
            return (None, Vec::new());
        };
        messages::losses(source.finish())
    }

    fn row_kind(&self) -> RowKind {
        RowKind::Message
    }
}
