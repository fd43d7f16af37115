//! Taking one channel out of a recording, as the verbs need it.

use torqcomp_model::Unit;

use super::{Channel, Recording};
use crate::failure::{Failure, did_you_mean};
use crate::io::csv::{NamedUnit, Options};

/// A channel that was chosen, with what the user said of it taken in.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection<'a> {
    /// The channel.
    pub channel: &'a Channel,
    /// Its samples, as written.
    pub samples: &'a [f64],
    /// Samples a second.
    pub rate_hz: f64,
    /// Time of the first sample, in seconds: 0 if the file does not say, or the rate was given.
    pub start_s: f64,
    /// Unit of the samples, if it is known.
    pub unit: Option<NamedUnit>,
}

impl Recording {
    /// The channel that the options name, or the only one, with its rate.
    ///
    /// # Errors
    /// If no channel or several have the name, its rate is unknown or only assumed, or a cell of it
    /// holds no number.
    pub fn select(&self, options: &Options) -> Result<Selection<'_>, Failure> {
        let channel = self.channel(options.channel.as_deref())?;
        let unit = match &options.unit {
            Some(text) => Some(NamedUnit {
                text: text.clone(),
                unit: Unit::parse(text)
                    .map_err(|error| Failure::usage(format_args!("--unit {text}: {error}")))?,
            }),
            None => channel.unit.clone(),
        };
        let axis = &channel.axis;
        let (rate_hz, start_s) = match (options.rate_hz, axis.rate_hz) {
            (Some(rate_hz), _) => (rate_hz, 0.0),
            (None, Some(rate_hz)) => (rate_hz, axis.start_s.unwrap_or(0.0)),
            (None, None) => return Err(self.without_rate(channel)),
        };
        if let (Some(assumed), None) = (&axis.assumed, options.rate_hz) {
            return Err(Failure::failed(format_args!(
                "{assumed}; confirm it with --time-column and --time-unit, or give --rate HZ"
            )));
        }
        Ok(Selection {
            channel,
            samples: &channel.samples,
            rate_hz,
            start_s,
            unit,
        })
    }

    /// A channel by its name, its heading or its number from 1; the only one if none is named.
    ///
    /// # Errors
    /// If there is none, or several are meant.
    pub fn channel(&self, wanted: Option<&str>) -> Result<&Channel, Failure> {
        let Some(wanted) = wanted else {
            return match self.channels.as_slice() {
                [one] => Ok(one),
                [] => Err(Failure::failed("there is no channel with numbers in it")),
                several => Err(Failure::failed(format_args!(
                    "{} channels could be the signal; choose one with --channel {}",
                    several.len(),
                    self.names()
                ))),
            };
        };
        let ways: [&dyn Fn(&Channel) -> bool; 3] =
            [&|c| c.heading == wanted, &|c| c.name == wanted, &|c| {
                c.name.eq_ignore_ascii_case(wanted) || c.heading.eq_ignore_ascii_case(wanted)
            }];
        for is in ways {
            let found: Vec<&Channel> = self.channels.iter().filter(|c| is(c)).collect();
            match found.as_slice() {
                [] => {}
                [one] => return Ok(one),
                several => {
                    return Err(Failure::failed(format_args!(
                        "{} channels are called \"{wanted}\"; give the number of the one you mean, \
                         --channel {}",
                        several.len(),
                        self.numbers(is)
                    )));
                }
            }
        }
        if let Ok(number) = wanted.parse::<usize>()
            && (1..=self.channels.len()).contains(&number)
        {
            return Ok(&self.channels[number - 1]);
        }
        let names = self.channels.iter().map(|c| c.name.as_str());
        Err(Failure::failed(format_args!(
            "there is no channel \"{wanted}\"{}; the channels are {}",
            did_you_mean(wanted, names),
            self.names()
        )))
    }

    /// Which of the channels that is, one of this recording.
    pub(crate) fn place_of(&self, channel: &Channel) -> usize {
        let is = |c: &Channel| std::ptr::eq(c, channel);
        self.channels
            .iter()
            .position(is)
            .expect("channels are chosen from their own recording")
    }

    /// The channels as they can be chosen: by name, or by number where a name is used twice.
    fn names(&self) -> String {
        let one = |(place, channel): (usize, &Channel)| {
            let same = self.channels.iter().filter(|c| c.name == channel.name);
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
        crate::io::csv::list(self.channels.iter().enumerate().map(one))
    }

    fn numbers(&self, is: &dyn Fn(&Channel) -> bool) -> String {
        let found = (0..self.channels.len()).filter(|i| is(&self.channels[*i]));
        crate::io::csv::list(found.map(|i| (i + 1).to_string()))
    }

    fn without_rate(&self, channel: &Channel) -> Failure {
        let why = match &channel.axis.stamps_s {
            Some(_) => "its time stamps have no usual step",
            None => "the file has neither time stamps nor a rate",
        };
        Failure::failed(format_args!(
            "the sampling rate of \"{}\" is unknown, because {why}; give it with --rate HZ, or \
             name the column of stamps with --time-column",
            channel.name
        ))
    }
}
