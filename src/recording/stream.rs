//! One channel of a recording, read block by block, whatever the format of the file.

use std::io::{Cursor, Read};

use super::block::{BlockSource, TextBlocks};
use super::choice::Selection;
use super::memory_stream::used_stamps;
use super::message_stream::MessageOrigin;
use super::moment::Moment;
use super::stamps::{StampGrid, is_uniform};
use super::text::{ChannelPlan, StampColumn, StampUse, TextFile, TextStream};
use super::validator::{StreamValidator, TextLines};
use super::{Channel, RateFrom, Recording, TimeAxis, checkpoints, formats, progress};
use crate::failure::Failure;
use crate::io::{ChannelChoice, HEAD, Input, Reading};
use crate::warning::Warning;

/// A selected channel of a recording, open for reading.
pub(crate) struct ChannelStream {
    /// Name of the file, for messages.
    pub(crate) source: String,
    /// Description of the file's encoding, for messages.
    pub(crate) dialect: String,
    /// The channel on its time axis, without the samples; its unit is that of the file or the given one.
    pub(crate) channel: Channel,
    /// Sampling rate in Hz.
    pub(crate) rate_hz: f64,
    /// Time of the first sample: its stamp, or the start given by the file or the user.
    pub(crate) start: Moment,
    /// For messages, data needed to copy their file.
    pub(crate) origin: Option<MessageOrigin>,
    /// Whether irregular stamps only cause a warning.
    pub(super) any_steps: bool,
    /// Warnings known before reading.
    pub(super) warnings: Vec<Warning>,
    pub(super) blocks: Box<dyn BlockSource>,
    /// Format of the rows, for text.
    pub(super) text: Option<TextLines>,
}

impl ChannelStream {
    /// Opens a file and finds the channel and its time axis.
    ///
    /// # Errors
    /// If the file cannot be read, is not a recording, or the channel is ambiguous.
    pub(crate) fn open(
        input: &Input,
        choice: &ChannelChoice,
        reading: &Reading,
    ) -> Result<Self, Failure> {
        let mut stream = Self::of_content(input, choice, reading)?;
        stream.dialect = input.dialect(&stream.dialect);
        Ok(stream)
    }

    fn of_content(
        input: &Input,
        choice: &ChannelChoice,
        reading: &Reading,
    ) -> Result<Self, Failure> {
        let name = input.name();
        if reading.is_partial() {
            let recording = Recording::read(input, std::slice::from_ref(choice), reading)?;
            return Self::of_recording(recording, choice, reading).map_err(|f| f.at(&name));
        }
        let mut bytes = progress::open(input)?;
        let unreadable = |error| Failure::unreadable(&error).at(&name);
        let mut head = Vec::new();
        let start = (&mut bytes).take(HEAD as u64).read_to_end(&mut head);
        start.map_err(unreadable)?;
        let is_mcap = head.starts_with(::mcap::MAGIC);
        let format = formats::of(&head);
        let bytes = Box::new(Cursor::new(head).chain(bytes));
        if is_mcap {
            super::refuse_for_messages(reading)?;
            return Self::of_messages(input, bytes, choice, reading);
        }
        super::refuse_for_text(choice, reading)?;
        if let Some(format) = format {
            let recording = format.read(&name, bytes, reading)?;
            return Self::of_recording(recording, choice, reading).map_err(|f| f.at(&name));
        }
        super::refuse_for_tables(reading)?;
        let file = TextFile::open(&name, bytes, reading).map_err(|f| f.at(&name))?;
        if file.held_whole.is_some() {
            let recording = file.read().map_err(|f| f.at(&name))?;
            return Self::of_recording(recording, choice, reading).map_err(|f| f.at(&name));
        }
        Self::of_text(input, file, choice, reading).map_err(|f| f.at(&name))
    }

    /// The selected channel of a text, row by row.
    fn of_text(
        input: &Input,
        file: TextFile,
        choice: &ChannelChoice,
        reading: &Reading,
    ) -> Result<Self, Failure> {
        let first_rows = file.recording.clone();
        let place = first_rows.place(choice)?;
        let selection = first_rows.select_at(place, choice, reading)?;
        // If several samples share a stamp, the index of a sample farther on is unknown.
        let is_coarse = selection.channel.has_coarse_stamps();
        if is_coarse {
            return Self::of_recording(file.read()?, choice, reading);
        }
        let of_first_rows = &selection.channel.axis;
        let TextStream {
            chunks,
            plan,
            layout,
            stamps,
            row_bytes,
            behind_first_rows,
        } = file.stream(place, stamp_use(&selection, reading));
        let later = checkpoints::of_text(input, behind_first_rows, &plan)?;
        if become_coarse(&later, stamps.as_ref(), of_first_rows.rate_hz) {
            return Self::of_whole_text(input, choice, reading);
        }
        let later: Vec<f64> = later.iter().map(|at| at.stamp).collect();
        let given_hz = reading.rate_hz.filter(|_| !reading.resample);
        let time = match (stamps, given_hz) {
            (stamps, Some(rate_hz)) => TimeAxis::given(rate_hz, stamps.and_then(beside_given_rate)),
            (Some(stamps), None) => axis_of_stamps(of_first_rows, &stamps, &later, reading)?,
            (None, None) => TimeAxis {
                stamps_s: None,
                start: Some(selection.start),
                ..of_first_rows.clone()
            },
        };
        Ok(Self {
            dialect: first_rows.dialect.clone(),
            rate_hz: time.rate_hz.unwrap_or(selection.rate_hz),
            start: time.start.unwrap_or_default(),
            channel: selection.on_axis(time, Vec::new()),
            origin: None,
            any_steps: reading.any_steps,
            warnings: [first_rows.warnings.clone(), selection.warnings].concat(),
            blocks: Box::new(TextBlocks {
                source: first_rows.source.clone(),
                chunks,
                row_bytes,
                table: layout.plan.clone(),
                is_first: layout.line == 1,
            }),
            text: Some(TextLines::new(plan, layout)),
            source: first_rows.source,
        })
    }

    /// The selected channel of a text whose stamps become coarse behind its first rows, so that only all of them together
    /// give the places of the samples.
    fn of_whole_text(
        input: &Input,
        choice: &ChannelChoice,
        reading: &Reading,
    ) -> Result<Self, Failure> {
        let bytes = progress::open(input)?;
        let recording = TextFile::open(&input.name(), Box::new(bytes), reading)?.read()?;
        Self::of_recording(recording, choice, reading)
    }

    /// Splits the stream into parts that run in parallel: reading blocks of at least `fewest`
    /// samples, parsing their text, and examining them in order.
    pub(crate) fn into_parts(
        mut self,
        fewest: usize,
    ) -> (Box<dyn BlockSource>, Option<ChannelPlan>, StreamValidator) {
        self.blocks.set_fewest(fewest);
        let plan = self.text.as_ref().map(|text| text.plan.clone());
        let (blocks, validator) = StreamValidator::of(self);
        (blocks, plan, validator)
    }
}

/// Whether the stamps of a text are read in addition to its samples: a header rate is better than that of rounded
/// stamps, but only stamps show a gap.
fn stamp_use(selection: &Selection, reading: &Reading) -> StampUse {
    let stamps_s = selection.channel.axis.stamps_s.as_ref();
    let are_checked = reading.rate_hz.is_none()
        && stamps_s.is_some_and(|stamps_s| is_uniform(stamps_s, selection.rate_hz));
    if are_checked || used_stamps(selection.channel, reading).is_some() {
        StampUse::Placing
    } else if reading.rate_hz.is_some() && stamps_s.is_some() {
        StampUse::Watched
    } else {
        StampUse::Unread
    }
}

/// Whether stamps are rounded more coarsely farther on.
fn become_coarse(
    later: &[checkpoints::Checkpoint],
    stamps: Option<&StampColumn>,
    rate_hz: Option<f64>,
) -> bool {
    let grid = stamps.zip(rate_hz).map(|(stamps, rate_hz)| StampGrid {
        step: 1.0 / (rate_hz * stamps.seconds_per_unit),
        ..grid_of(stamps)
    });
    grid.is_some_and(|grid| later.iter().any(|at| grid.are_coarse(&at.around)))
}

/// Format of stamps, with a step to be determined.
fn grid_of(stamps: &StampColumn) -> StampGrid {
    StampGrid {
        unit: stamps.unit.to_owned(),
        seconds_per_unit: stamps.seconds_per_unit,
        copied: stamps.copied,
        origin_ns: stamps.origin_ns,
        ..StampGrid::of_seconds()
    }
}

/// The grid of the stamps themselves.
fn beside_given_rate(stamps: StampColumn) -> Option<StampGrid> {
    grid_of(&stamps).beside_given_rate(&stamps.first)
}

/// Axis of a partly read column of stamps; a header rate is better than that of rounded stamps.
fn axis_of_stamps(
    of_first_rows: &TimeAxis,
    stamps: &StampColumn,
    later: &[f64],
    reading: &Reading,
) -> Result<TimeAxis, Failure> {
    let mut axis = TimeAxis::of_stream(
        &stamps.heading,
        grid_of(stamps),
        &stamps.first,
        later,
        reading,
    )?;
    if let (from @ RateFrom::Header(_), Some(rate_hz), false) = (
        &of_first_rows.rate_from,
        of_first_rows.rate_hz,
        reading.resample,
    ) {
        axis.set_rate(rate_hz, from.clone());
    }
    Ok(axis)
}
