//! Destination of the result: rows of text, or an additional channel in a copy of a message file.

use std::collections::BTreeMap;
use std::path::Path;

use torqcomp_decimal::digits;

use super::Plan;
use super::page::PageData;
use super::plot::Traces;
use super::report::CompensateReport;
use crate::cli::{Compensate, Format};
use crate::commands::rows::ResultRows;
use crate::failure::{ErrorCode, Failure};
use crate::io::mcap::Writer;
use crate::io::mcap::writer::{self, Added};
use crate::io::output::Output;
use crate::io::{COMPENSATED, Input};
use crate::recording::MessageOrigin;
use crate::stand::{self, Calibration};

/// An open result, with chart and page if requested.
pub(super) struct Sink {
    target: Target,
    traces: Option<Traces>,
    page: Option<PageData>,
}

enum Target {
    Text(Output),
    Messages(Box<MessageCopy>),
}

/// A copy of the input with the torque added.
struct MessageCopy {
    writer: Writer<Output>,
    origin: MessageOrigin,
    /// Topic of the torque.
    topic: String,
}

/// The next samples of a result.
pub(super) struct ResultPart<'a> {
    pub(super) rows: ResultRows<'a>,
    /// The rows as text, for a text result.
    pub(super) text: &'a [u8],
    /// Compensated, in SI units.
    pub(super) torque: &'a [f64],
    /// Before compensation, in SI units.
    pub(super) recorded: &'a [f64],
}

impl Sink {
    /// Opens the result and writes everything before the first sample.
    ///
    /// # Errors
    /// If the output cannot be written, or its format does not fit the input.
    pub(super) fn open(
        args: &Compensate,
        plan: &Plan,
        mut output: Output,
    ) -> Result<Self, Failure> {
        let traces = args.plot.as_ref().map(|_| Traces::new(args.plot_range));
        let page = args.html.as_ref().map(|_| PageData::new(args, plan));
        let page = page.transpose()?;
        let target = match format(args) {
            Format::Csv => {
                output.write(heading(&plan.chain, args.with_recorded).as_bytes())?;
                Target::Text(output)
            }
            Format::Mcap => Target::Messages(Box::new(MessageCopy::open(args, plan, output)?)),
        };
        Ok(Self {
            target,
            traces,
            page,
        })
    }

    /// Whether rows are needed as text.
    pub(super) fn is_text(&self) -> bool {
        matches!(self.target, Target::Text(_))
    }

    pub(super) fn traces(&self) -> Option<&Traces> {
        self.traces.as_ref()
    }

    pub(super) fn page(&self) -> Option<&PageData> {
        self.page.as_ref()
    }

    pub(super) fn take(&mut self, part: &ResultPart) -> Result<(), Failure> {
        if let Some(traces) = &mut self.traces {
            traces.take(part);
        }
        if let Some(page) = &mut self.page {
            page.take(part);
        }
        match &mut self.target {
            Target::Text(output) => output.write(part.text),
            Target::Messages(messages) => messages.take(part),
        }
    }

    /// Writes everything after the last sample, which completes the output.
    pub(super) fn finish(
        self,
        args: &Compensate,
        report: &CompensateReport,
    ) -> Result<Output, Failure> {
        match self.target {
            Target::Text(output) => Ok(output),
            Target::Messages(messages) => messages.writer.finish(&provenance(args, report)?),
        }
    }

    /// Topic and field of the result, if it consists of messages.
    pub(super) fn signal(&self) -> Option<String> {
        match &self.target {
            Target::Text(_) => None,
            Target::Messages(messages) => {
                Some(format!("{}.{}", messages.topic, messages.writer.field()))
            }
        }
    }
}

impl MessageCopy {
    fn open(args: &Compensate, plan: &Plan, output: Output) -> Result<Self, Failure> {
        let origin = origin(args, plan)?;
        let topic = args
            .output_topic
            .as_deref()
            .unwrap_or(writer::TOPIC)
            .to_owned();
        let encoding = origin.encoding.ok_or_else(|| {
            ErrorCode::UnsuitableRecord
                .failed("the messages have an encoding that torqcomp does not write")
        })?;
        let added = Added {
            topic: topic.clone(),
            name: plan.stream.channel.name.clone(),
            encoding,
        };
        let name = output.name().to_owned();
        let writer = Writer::copying(&Input::of(args.record.input()), output, &name, &added)?;
        Ok(Self {
            writer,
            origin,
            topic,
        })
    }

    fn take(&mut self, part: &ResultPart) -> Result<(), Failure> {
        let Self { writer, origin, .. } = self;
        part.torque.iter().enumerate().try_for_each(|(i, torque)| {
            let time_ns = part.rows.time_ns(i, origin.first_ns);
            let log_ns = time_ns.saturating_sub(origin.log_offset_ns);
            writer.add(time_ns, log_ns, *torque)
        })
    }
}

/// First line of a text.
fn heading(chain: &Calibration, with_recorded: bool) -> String {
    let applied = chain.applied.heading();
    match with_recorded {
        true => format!("time_s,{COMPENSATED}{applied},recorded_{applied}\n"),
        false => format!("time_s,{COMPENSATED}{applied}\n"),
    }
}

/// The requested format, or that of the output's name.
fn format(args: &Compensate) -> Format {
    let output = args.result.output.as_deref();
    let is_mcap = output
        .and_then(Path::extension)
        .is_some_and(|end| end.eq_ignore_ascii_case("mcap"));
    args.format
        .unwrap_or(if is_mcap { Format::Mcap } else { Format::Csv })
}

/// The source of the input's messages, if the result can be a copy of them.
fn origin(args: &Compensate, plan: &Plan) -> Result<MessageOrigin, Failure> {
    let Some(origin) = &plan.stream.origin else {
        return Err(ErrorCode::ConflictingArguments.usage(
            "an MCAP result is a copy of an MCAP input with an additional channel: the input must be MCAP and its \
             samples unchanged, without --range, --fill or --resample; use --format csv",
        ));
    };
    if args.record.input() == "-" {
        return Err(ErrorCode::ConflictingArguments.usage(
            "an MCAP result reads its input twice, but standard input can be read only once; name the file",
        ));
    }
    if args.with_recorded {
        return Err(ErrorCode::ConflictingArguments.usage(
            "--with-recorded adds a column of text; an MCAP result keeps the recorded channel anyway",
        ));
    }
    if plan.chain.applied.name != "torque" {
        return Err(ErrorCode::UnitUnsuitable.failed(format_args!(
            "an MCAP result contains torque in N m, but this record becomes a {} in {}; use --format csv",
            plan.chain.applied.name, plan.chain.applied.unit
        )));
    }
    Ok(origin.clone())
}

/// Provenance of the torque, written into the file.
fn provenance(
    args: &Compensate,
    report: &CompensateReport,
) -> Result<BTreeMap<String, String>, Failure> {
    let (_, stand) = stand::text(&args.stand)?;
    let number = |value: f64| digits::text(value, 12);
    let pairs = [
        (
            "tool",
            concat!("torqcomp ", env!("CARGO_PKG_VERSION")).to_owned(),
        ),
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
