//! A signal out of a file of messages.

use super::{Feed, MessageOptions, Origin, RowSource, Signal};
use crate::failure::Failure;
use crate::io::csv::{Column, NamedUnit, Options, Rows, Stamps, TimeAxis, TimeSource};
use crate::io::mcap::{self, SelectedSignal, SignalReader};
use crate::warning::Warning;

/// Nanoseconds that an `f64` holds exactly: 104 days.
const EXACT_NS: i64 = 1 << 53;

impl Signal {
    /// The signal of a topic's messages.
    pub(super) fn of_messages(
        mut source: SignalReader,
        table: &Options,
        wanted: &MessageOptions,
    ) -> Result<Self, Failure> {
        let (name, chosen) = (source.name().to_owned(), source.selected().clone());
        let mut times_ns = Vec::new();
        let mut values = Vec::new();
        source.next(&mut times_ns, &mut values)?;
        let Some(&origin_ns) = times_ns.first() else {
            return Err(nothing_usable(&name, source));
        };
        let unit = unit(&name, &chosen, table)?;
        let log_offset_ns = source.log_offset_ns();
        let messages = Messages {
            source: Some(source),
            origin_ns,
            times_ns,
            values,
        };
        let first = messages.relative()?;
        let time = match table.rate_hz.filter(|_| !table.resample) {
            Some(rate_hz) => TimeAxis {
                source: TimeSource::Given,
                rate_hz,
            },
            None => {
                let stamps = Stamps {
                    heading: describe_time(&chosen.time),
                    unit: "ns".to_owned(),
                    seconds_per_unit: 1e-9,
                    copied: false,
                    origin_ns,
                };
                TimeAxis::of_stamps(stamps, &first, table).map_err(|f| f.at(&name))?
            }
        };
        Ok(Self {
            source: name,
            dialect: format!(
                "MCAP, {} {}, time: {} ({})",
                chosen.encoding,
                chosen.schema,
                describe_time(&chosen.time),
                chosen.time.why
            ),
            channel: Column {
                heading: format!("{}.{}", chosen.topic, chosen.field),
                name: format!("{}.{}", chosen.topic, chosen.field),
                unit,
            },
            first_stamp: time.uses_stamps().then_some(0.0),
            time,
            warnings: Vec::new(),
            any_steps: table.any_steps,
            origin: Some(Origin {
                encoding: mcap::decode::Encoding::of(&chosen.encoding),
                topic: chosen.topic,
                log_offset_ns,
                first_ns: origin_ns,
                time: wanted.time,
            }),
            feed: Feed::Rows(Box::new(messages)),
        })
    }
}

fn nothing_usable(name: &str, source: SignalReader) -> Failure {
    let topic = source.selected().topic.clone();
    let said: Vec<String> = source
        .finish()
        .warnings
        .into_iter()
        .map(|warning| warning.message)
        .collect();
    Failure::failed(format_args!(
        "{name}: no message of {topic} could be used: {}",
        said.join("; ")
    ))
}

fn describe_time(used: &mcap::time::TimeUsed) -> String {
    match &used.field {
        Some(field) => field.clone(),
        None => format!("{} time", used.choice.name()),
    }
}

fn unit(
    name: &str,
    chosen: &SelectedSignal,
    options: &Options,
) -> Result<Option<NamedUnit>, Failure> {
    let (text, is_told) = match (&options.unit, &chosen.unit) {
        (Some(text), _) => (text, true),
        (None, Some(found)) => (&found.unit, false),
        (None, None) => return Ok(None),
    };
    match torqcomp_model::Unit::parse(text) {
        Ok(unit) => Ok(Some(NamedUnit {
            text: text.clone(),
            unit,
        })),
        Err(error) if is_told => Err(Failure::usage(format_args!("--unit {text}: {error}"))),
        Err(error) => Err(Failure::failed(format_args!(
            "{name}: the unit of {}.{}: {error}; give it with --unit",
            chosen.topic, chosen.field
        ))),
    }
}

/// Messages on their way; times are handed on from the first one.
struct Messages {
    source: Option<SignalReader>,
    origin_ns: i64,
    /// What was read and not handed on.
    times_ns: Vec<i64>,
    values: Vec<f64>,
}

impl Messages {
    fn relative(&self) -> Result<Vec<f64>, Failure> {
        let one = |time_ns: &i64| match time_ns.checked_sub(self.origin_ns) {
            Some(ns) if ns.abs() < EXACT_NS => Ok(ns as f64),
            _ => Err(Failure::failed(format_args!(
                "a message at {time_ns} ns is more than 104 days from the first one at {} ns: the \
                 clock jumped; choose another one with --time log, publish or header",
                self.origin_ns
            ))),
        };
        self.times_ns.iter().map(one).collect()
    }
}

impl RowSource for Messages {
    fn next(&mut self, rows: &mut Rows) -> Result<bool, Failure> {
        if self.values.is_empty()
            && let Some(source) = &mut self.source
        {
            source.next(&mut self.times_ns, &mut self.values)?;
        }
        rows.times = self.relative()?;
        rows.values.append(&mut self.values);
        self.times_ns.clear();
        Ok(!rows.values.is_empty())
    }

    fn finish(&mut self) -> (Option<Warning>, Vec<Warning>) {
        let Some(source) = self.source.take() else {
            return (None, Vec::new());
        };
        let summary = source.finish();
        let mut warnings = summary.warnings;
        let lost = summary.is_lossy.then(|| {
            let first = (!warnings.is_empty()).then(|| warnings.remove(0));
            first.unwrap_or_else(|| Warning::new("mcap-lost", "messages were lost"))
        });
        (lost, warnings)
    }

    fn row_name(&self) -> &'static str {
        "message"
    }
}
