//! Where the result goes: rows of text, or one channel more in a copy of a file of messages.

use std::collections::BTreeMap;
use std::path::Path;

use super::{Plan, heading};
use crate::cli::{Compensate, Format};
use crate::commands::rows::Rows;
use crate::failure::Failure;
use crate::io::Input;
use crate::io::mcap::Writer;
use crate::io::mcap::writer::Added;
use crate::io::output::Output;
use crate::report::compensate::Report;
use crate::signal::Origin;

/// Topic of the result unless another is named.
const TOPIC: &str = "/torqcomp/torque";

/// An open result.
pub enum Sink {
    /// Text.
    Text(Output),
    /// Messages.
    Messages(Box<Messages>),
}

/// A copy of the input that gets the torque as well.
pub struct Messages {
    writer: Writer<Output>,
    origin: Origin,
    /// Topic of the torque.
    topic: String,
}

impl Sink {
    /// Opens the result and writes what comes before the first sample.
    ///
    /// # Errors
    /// If the output cannot be written, or its format does not fit the input.
    pub fn open(args: &Compensate, plan: &Plan, mut output: Output) -> Result<Self, Failure> {
        if format(args) == Format::Csv {
            output.write(heading(&plan.chain, args.with_recorded).as_bytes())?;
            return Ok(Self::Text(output));
        }
        let origin = origin(args, plan)?;
        let topic = args.output_topic.as_deref().unwrap_or(TOPIC).to_owned();
        let encoding = origin.encoding.ok_or_else(|| {
            Failure::failed("the messages have an encoding that torqcomp does not write")
        })?;
        let added = Added {
            topic: topic.clone(),
            name: plan.signal.channel.name.clone(),
            encoding,
        };
        let name = output.name().to_owned();
        let writer = Writer::copying(&Input::of(&args.record.input), output, &name, &added)?;
        Ok(Self::Messages(Box::new(Messages {
            writer,
            origin,
            topic,
        })))
    }

    /// Whether rows are wanted as text.
    pub fn is_text(&self) -> bool {
        matches!(self, Self::Text(_))
    }

    /// Takes the next part of the result: its text, or its values in SI units and their times.
    pub fn take(&mut self, text: &[u8], rows: &Rows, torque: &[f64]) -> Result<(), Failure> {
        match self {
            Self::Text(output) => output.write(text),
            Self::Messages(messages) => {
                let Messages { writer, origin, .. } = messages.as_mut();
                torque.iter().enumerate().try_for_each(|(i, torque)| {
                    let time_ns = rows.time_ns(i, origin.first_ns);
                    writer.add(
                        time_ns,
                        time_ns.saturating_sub(origin.log_offset_ns),
                        *torque,
                    )
                })
            }
        }
    }

    /// Writes what comes after the last sample and gives the output its name.
    pub fn finish(self, args: &Compensate, report: &Report) -> Result<(), Failure> {
        match self {
            Self::Text(output) => output.finish(),
            Self::Messages(messages) => {
                messages.writer.finish(&provenance(args, report)?)?.finish()
            }
        }
    }

    /// Topic and field of the result, if it is one of messages.
    pub fn describe(&self) -> Option<String> {
        match self {
            Self::Text(_) => None,
            Self::Messages(messages) => {
                Some(format!("{}.{}", messages.topic, messages.writer.field()))
            }
        }
    }
}

/// The format that is asked for, or that the name of the output says.
fn format(args: &Compensate) -> Format {
    let output = args.result.output.as_deref().map(Path::new);
    let is_mcap = output
        .and_then(Path::extension)
        .is_some_and(|end| end.eq_ignore_ascii_case("mcap"));
    args.format
        .unwrap_or(if is_mcap { Format::Mcap } else { Format::Csv })
}

/// Checks that the result can be one of messages.
fn origin(args: &Compensate, plan: &Plan) -> Result<Origin, Failure> {
    let Some(origin) = &plan.signal.origin else {
        return Err(Failure::usage(
            "an MCAP result is a copy of an MCAP input with one channel more, and the input is a \
             text; use --format csv",
        ));
    };
    if args.record.input == "-" {
        return Err(Failure::usage(
            "an MCAP result needs its input twice, which standard input cannot give; name the file",
        ));
    }
    if args.with_recorded {
        return Err(Failure::usage(
            "--with-recorded adds a column of text; an MCAP result keeps the recorded channel anyway",
        ));
    }
    if plan.chain.applied.name != "torque" {
        return Err(Failure::failed(format_args!(
            "an MCAP result holds torques in N m, and this record becomes a {} in {}; use --format csv",
            plan.chain.applied.name, plan.chain.applied.unit
        )));
    }
    Ok(origin.clone())
}

/// How the torque came about, for the file that holds it.
fn provenance(args: &Compensate, report: &Report) -> Result<BTreeMap<String, String>, Failure> {
    let stand = std::fs::read_to_string(&args.stand)
        .map_err(|error| Failure::reading(&args.stand, &error))?;
    let number = |value: f64| crate::io::digits::text(value, 12);
    let pairs = [
        ("tool", format!("torqcomp {}", report.version)),
        ("input", report.input.clone()),
        ("signal", report.channel.clone()),
        ("signal_unit", report.channel_unit.clone()),
        ("time", report.dialect.clone()),
        ("stand", report.stand.clone()),
        ("stand_toml", stand),
        ("calibration", report.calibration.clone()),
        ("band_hz", number(report.band_hz)),
        ("band_end_hz", number(report.band_end_hz)),
        ("rate_hz", number(report.rate_hz)),
        ("samples", report.samples.to_string()),
    ];
    Ok(pairs
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect())
}
