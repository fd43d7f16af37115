//! Selection of one channel of a recording, the same for every format and command.

use torqcomp_decimal::digits;
use torqcomp_dsp::quality::rate::{Contradiction, contradiction};
use torqcomp_model::{Dimension, Unit};

use super::axis::step_of;
use super::moment::Moment;
use super::shared_stamps::refuse_shared_stamps;
use super::stamps::TOLERABLE;
use super::text::is_of_skipped_column;
use super::uneven::{advice_for_uneven, without_rate};
use super::{Channel, RateFrom, Recording, formats};
use crate::failure::{ErrorCode, Failure, did_you_mean};
use crate::io::{ChannelChoice, Reading, already_compensated};
use crate::print::{enumeration, list, plural, some_of};
use crate::unit::{NamedUnit, RecordedChannel};
use crate::warning::{Warning, WarningCode};

/// Identification of a channel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Label<'a> {
    pub(crate) heading: &'a str,
    pub(crate) name: &'a str,
    /// Its segment, from 0, if there are several.
    pub(crate) segment: Option<usize>,
}

/// Minimum number of channels of a possibly transposed table, with fewer rows than a tenth of that.
const WIDE: usize = 300;
/// Maximum number of channels listed in a message.
const NAMED: usize = 20;

/// Question whether a table is transposed, if it looks like that.
pub(in crate::recording) fn transposed(columns: usize, rows: Option<usize>) -> Option<Failure> {
    let is_short = rows.is_none_or(|rows| 10 * rows < columns);
    (columns >= WIDE && is_short).then(|| {
        let rows = rows.map_or_else(String::new, |rows| format!("{} and ", plural(rows, "row")));
        ErrorCode::NotARecording.failed(format_args!(
            "the table has {rows}{columns} columns: are the samples of a channel in one row? Each channel must \
             be a column; transpose the table (in a spreadsheet: paste special, transpose), or choose a column \
             with --channel if each is a channel"
        ))
    })
}

/// Index of the requested channel: by its heading, its name without the unit, either of them ignoring case, its number
/// from 1, or an unambiguous part of the heading ignoring case; the only channel if none is named. `flag` is the
/// option that names it.
pub(crate) fn choose(
    channels: &[Label],
    wanted: Option<&str>,
    flag: &str,
) -> Result<usize, Failure> {
    let Some(wanted) = wanted else {
        return match channels {
            [_] => Ok(0),
            [] => Err(ErrorCode::NotARecording.failed("there is no channel with numbers in it")),
            several => Err(transposed(several.len(), None).unwrap_or_else(|| {
                ErrorCode::ChannelUnclear.failed(format_args!(
                    "{} channels could be the signal; choose one with {flag} {}",
                    several.len(),
                    names(channels, "or")
                ))
            })),
        };
    };
    if let Some(place) = by_name(channels, wanted, flag)? {
        return Ok(place);
    }
    if let Ok(number) = wanted.parse::<usize>()
        && (1..=channels.len()).contains(&number)
    {
        return Ok(number - 1);
    }
    if let Some(place) = by_part(channels, wanted)? {
        return Ok(place);
    }
    let known = channels.iter().map(|c| c.name);
    let there_are = match channels {
        [_] => "the only channel is",
        _ => "the channels are",
    };
    Err(ErrorCode::ChannelNotFound.failed(format_args!(
        "there is no channel \"{wanted}\"{}; {there_are} {}",
        did_you_mean(wanted, known),
        names(channels, "and")
    )))
}

/// Index of the channel with this heading or name, ignoring case.
pub(super) fn by_name(
    channels: &[Label],
    wanted: &str,
    flag: &str,
) -> Result<Option<usize>, Failure> {
    let ways: [&dyn Fn(&Label) -> bool; 3] =
        [&|c| c.heading == wanted, &|c| c.name == wanted, &|c| {
            c.name.eq_ignore_ascii_case(wanted) || c.heading.eq_ignore_ascii_case(wanted)
        }];
    for is in ways {
        let found: Vec<usize> = (0..channels.len()).filter(|i| is(&channels[*i])).collect();
        match found.as_slice() {
            [] => {}
            [one] => return Ok(Some(*one)),
            several => {
                return Err(ErrorCode::ChannelUnclear.failed(format_args!(
                    "{} channels are called \"{wanted}\"; give the number of the one you mean, {flag} {}",
                    several.len(),
                    list(several.iter().map(|i| (i + 1).to_string()))
                )));
            }
        }
    }
    Ok(None)
}

/// Index of the only channel whose heading contains a part, ignoring case.
pub(super) fn by_part(channels: &[Label], wanted: &str) -> Result<Option<usize>, Failure> {
    let part = wanted.to_lowercase();
    let has_part = |place: &usize| channels[*place].heading.to_lowercase().contains(&part);
    match *(0..channels.len()).filter(has_part).collect::<Vec<_>>() {
        [] => Ok(None),
        [one] => Ok(Some(one)),
        ref several => Err(ErrorCode::ChannelUnclear.failed(format_args!(
            "\"{wanted}\" is a part of the names of {} channels: {}; give more of it",
            several.len(),
            named(
                several
                    .iter()
                    .map(|place| format!("\"{}\"", channels[*place].name)),
                "and"
            )
        ))),
    }
}

/// The names, with a word before the last one; of many, the first and the number of further ones.
fn named(names: impl ExactSizeIterator<Item = String>, word: &str) -> String {
    let count = names.len();
    match count > NAMED {
        false => enumeration(&names.collect::<Vec<_>>(), word),
        true => some_of(names, count, NAMED),
    }
}

/// The channels as they can be selected: by name, or by number if a name is used twice.
fn names(channels: &[Label], word: &str) -> String {
    let one = |(place, channel): (usize, &Label)| {
        let same = channels.iter().filter(|c| c.name == channel.name);
        match (same.count(), channel.segment) {
            (1, _) => format!("\"{}\"", channel.name),
            (_, None) => format!("{} (\"{}\")", place + 1, channel.name),
            (_, Some(segment)) => {
                format!(
                    "{} (\"{}\" of segment {})",
                    place + 1,
                    channel.name,
                    segment + 1
                )
            }
        }
    };
    named(channels.iter().enumerate().map(one), word)
}

/// Unit of a channel: the given one, or that of the file; with a warning if both differ.
pub(crate) fn unit_of(
    choice: &ChannelChoice,
    heading: &str,
    of_file: Option<&NamedUnit>,
) -> Result<(Option<NamedUnit>, Option<Warning>), Failure> {
    let (Some(text), Some(flag)) = (&choice.unit, choice.flags.unit) else {
        let read = of_file.zip(choice.flags.unit);
        let slip = read.and_then(|(named, flag)| meganewton_metres(heading, named, flag));
        return Ok((of_file.cloned(), slip));
    };
    let given = NamedUnit::given(flag, text)?;
    // Answering whether a pound is a force, or an M a milli, does not override the unit.
    let answers = |named: &NamedUnit| {
        let readings = Unit::readings_of_weight(&named.text).into_iter().flatten();
        let mut units = readings.filter_map(|text| Unit::parse(&text).ok());
        units.any(|unit| {
            unit.dimension() == given.unit.dimension()
                && (unit.factor() / given.unit.factor() - 1.0).abs() < 1e-12
        })
    };
    let is_slip = |named: &NamedUnit| meganewton_metres(heading, named, flag).is_some();
    let other = of_file.filter(|named| named.unit != given.unit);
    let other = other.filter(|named| !answers(named) && !is_slip(named));
    let warning = other.map(|named| {
        WarningCode::UnitOverridesHeading.warning(format!(
            "\"{heading}\" says {}, {flag} says {text}; {text} was used",
            named.text
        ))
    });
    Ok((Some(given), warning))
}

/// A warning about meganewton metres, which few stands have and which are easily written for mN m.
fn meganewton_metres(heading: &str, named: &NamedUnit, flag: &str) -> Option<Warning> {
    let is_it = named.unit.dimension() == Dimension::TORQUE && named.unit.factor() == 1e6;
    is_it.then(|| {
        WarningCode::MeganewtonMetres.warning(format!(
            "\"{heading}\" is in {}, meganewton metres (1 MN m = 1000000 N m), and was read as such; for millinewton metres \
             (0.001 N m) give {flag} \"mN m\", otherwise confirm it with {flag} \"MN m\"",
            named.text
        ))
    })
}

/// A warning if a given rate contradicts the stamps.
pub(crate) fn overridden(reading: &Reading, stamps_in: &str, stamps_s: &[f64]) -> Option<Warning> {
    let rate_hz = reading.rate_hz.filter(|_| !reading.resample)?;
    let given = digits::text(rate_hz, 7);
    let Some(stamped) = step_of(stamps_s, 0.0) else {
        let advice = advice_for_uneven(stamps_s)?;
        return Some(WarningCode::RateOverridesStamps.warning(format!(
            "the stamps in \"{stamps_in}\" have no usual step, and --rate places the samples at equal steps of \
             {given} Hz, which gives other times and frequencies: {advice}"
        )));
    };
    let stamped_hz = 1.0 / stamped.step;
    let uncertain = 3.0 * stamped.rate_std_hz(stamped_hz).unwrap_or(0.0) / stamped_hz;
    if (rate_hz / stamped_hz - 1.0).abs() <= uncertain.max(TOLERABLE) {
        return None;
    }
    Some(WarningCode::RateOverridesStamps.warning(format!(
        "the stamps in \"{stamps_in}\" give {} Hz, --rate says {given} Hz; {given} Hz was used",
        digits::text(stamped_hz, 7)
    )))
}

/// Warning about contradictory rates in the file header and its stamps; `whose` names the channels.
pub(crate) fn contradicted(whose: &str, found: &Contradiction) -> Warning {
    WarningCode::RateContradictsStamps.warning(format!(
        "{whose}: the header gives {} Hz, the time stamps give {} Hz; find out which is right, and give it with \
         --rate if it is not the stamps",
        digits::text(found.stated_hz, 6),
        digits::text(found.stamped_hz, 6)
    ))
}

/// A selected channel, including the user's settings for it.
#[derive(Debug, Clone)]
pub(crate) struct Selection<'a> {
    pub(crate) channel: &'a Channel,
    /// Sampling rate in Hz.
    pub(crate) rate_hz: f64,
    /// Its standard uncertainty, if it comes from stamps.
    pub(crate) rate_std_hz: Option<f64>,
    /// Time of the first sample: 0 if unknown, or if the rate was given and the record is complete.
    pub(crate) start: Moment,
    /// Unit of the samples, if known.
    pub(crate) unit: Option<NamedUnit>,
    /// Contradictions between command line and file.
    pub(crate) warnings: Vec<Warning>,
}

impl Recording {
    /// The selected channel, or the only one, with its rate.
    ///
    /// # Errors
    /// If no channel or several have the name, or its rate is unknown or only assumed.
    pub(crate) fn select(
        &self,
        choice: &ChannelChoice,
        reading: &Reading,
    ) -> Result<Selection<'_>, Failure> {
        let selection = self.select_at(self.place(choice)?, choice, reading)?;
        if reading.rate_hz.is_none() && !reading.resample && !reading.any_steps {
            selection.channel.check_rounding(selection.rate_hz)?;
        }
        Ok(selection)
    }

    /// The same for a known index of the channel.
    pub(super) fn select_at(
        &self,
        place: usize,
        choice: &ChannelChoice,
        reading: &Reading,
    ) -> Result<Selection<'_>, Failure> {
        let channel = &self.channels[place];
        formats::refuse_unit_of_fraction(channel, choice)?;
        let (unit, warning) = unit_of(choice, &channel.heading, channel.unit.as_ref())?;
        let mut warnings: Vec<Warning> = warning.into_iter().collect();
        let axis = &channel.axis;
        let (rate_hz, start) = match (reading.rate_hz, axis.rate_hz) {
            // A part of the record keeps its position.
            (Some(rate_hz), _) if reading.starts_later() => {
                (rate_hz, axis.start.unwrap_or_default())
            }
            (Some(rate_hz), _) => (rate_hz, Moment::default()),
            (None, Some(rate_hz)) => (rate_hz, axis.start.unwrap_or_default()),
            (None, None) => return Err(without_rate(channel)),
        };
        if let (Some(assumed), None) = (&axis.assumed, reading.rate_hz) {
            // A column without a heading is identified by its number.
            let heading = axis.stamps_in.as_deref().unwrap_or_default();
            let number = heading
                .strip_prefix("column ")
                .map_or_else(String::new, |number| format!(" {number}"));
            return Err(ErrorCode::TimeUnknown.failed(format_args!(
                "{assumed}; confirm it with --time-column{number} and --time-unit, or give --rate HZ"
            )));
        }
        let stamps = axis.stamps_s.as_ref();
        if let (Some(stamps_s), Some(rate_hz), true) = (stamps, axis.rate_hz, reading.resample) {
            let origin_s = axis.origin_ns as f64 * 1e-9;
            refuse_shared_stamps(stamps_s, 1.0 / rate_hz, origin_s, 1.0)?;
        }
        let name = axis.stamps_in.as_deref().unwrap_or("time");
        warnings.extend(stamps.and_then(|stamps_s| overridden(reading, name, stamps_s)));
        let is_of_stamps =
            matches!(axis.rate_from, RateFrom::Stamps(_)) && reading.rate_hz.is_none();
        let rates = axis
            .header_rate_hz
            .zip(axis.rate_hz)
            .filter(|_| is_of_stamps);
        let count = stamps.map_or(0, |stamps_s| stamps_s.len());
        let found = rates.and_then(|(stated, stamped)| contradiction(stated, stamped, count));
        warnings.extend(found.map(|found| contradicted(&format!("\"{}\"", channel.name), &found)));
        Ok(Selection {
            channel,
            rate_hz,
            rate_std_hz: axis.rate_std_hz.filter(|_| reading.rate_hz.is_none()),
            start,
            unit,
            warnings,
        })
    }

    /// The selected channel, whatever its rate.
    pub(crate) fn channel(&self, choice: &ChannelChoice) -> Result<&Channel, Failure> {
        Ok(&self.channels[self.place(choice)?])
    }

    /// Index of the selected channel.
    pub(crate) fn place(&self, choice: &ChannelChoice) -> Result<usize, Failure> {
        let label = |channel| Channel::label(channel);
        let labels: Vec<Label> = self.channels.iter().map(label).collect();
        let skipped = self.warnings.iter().find(|w| is_of_skipped_column(w));
        let place = choose(&labels, choice.channel.as_deref(), choice.flags.channel);
        let place = place.map_err(|failure| match (failure.code(), skipped) {
            (Some(code @ ErrorCode::ChannelNotFound), Some(warning)) => {
                code.failed(format_args!("{failure}. {}", warning.message))
            }
            _ => failure,
        })?;
        // The requested channel may be in a column that was skipped.
        match skipped.filter(|_| choice.channel.is_none()) {
            Some(warning) => Err(ErrorCode::ChannelUnclear.failed(format_args!(
                "{}; or choose \"{}\" with {}",
                warning.message, self.channels[place].name, choice.flags.channel
            ))),
            None => Ok(place),
        }
    }
}

impl Channel {
    /// The channel in the form required by a stand.
    pub(crate) fn recorded(&self) -> RecordedChannel<'_> {
        RecordedChannel {
            name: &self.name,
            unit: self.unit.as_ref(),
            unit_text: self.unit_text.as_deref(),
        }
    }

    /// Rejects a result of `compensate` where the response of a stand is required.
    ///
    /// # Errors
    /// If it is marked as one.
    pub(crate) fn must_be_as_recorded(&self, source: &str) -> Result<(), Failure> {
        match self.is_compensated {
            true => Err(already_compensated(source, &self.name)),
            false => Ok(()),
        }
    }

    fn label(&self) -> Label<'_> {
        Label {
            heading: &self.heading,
            name: &self.name,
            segment: self.segment,
        }
    }
}
