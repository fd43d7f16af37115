//! `extract`: one channel of a recording as plain rows, for other programs.

use torqcomp_decimal::Text;

use super::made;
use super::rows::{self, ResultRows, Times};
use crate::cli::Extract;
use crate::failure::Failure;
use crate::io::output::Output;
use crate::io::{COMPENSATED, Input, Reading, names_compensated};
use crate::outcome::{Made, RecordFigures};
use crate::print;
use crate::recording::{Block, ChannelStream, StreamSummary, UniformStream};

/// Writes the channel of one record.
///
/// # Errors
/// If the work cannot be done.
pub fn work(args: &Extract) -> Result<Made, Failure> {
    let reading = Reading {
        any_steps: true,
        ..args.record.reading.clone()
    };
    let input = args.record.input();
    let stream = ChannelStream::open(&Input::of(input), &args.record.choice, &reading)?;
    let mut output = args.result.open(&[input])?;
    output.write(&heading(&stream))?;
    let said = format!(
        "{}: {}; {} Hz {}\n",
        stream.source,
        stream.dialect,
        print::rounded(stream.rate_hz, 9),
        stream.channel.axis.rate_sentence()
    );
    let rate_hz = stream.rate_hz;
    let (samples, summary) = if stream.channel.axis.is_resampled() {
        write_resampled(args, stream, &mut output)?
    } else {
        write_as_it_is(args, stream, &mut output)?
    };
    let is_lossy = summary.lost.is_some();
    Ok(Made {
        notes: said,
        figures: RecordFigures::of(samples, rate_hz),
        ..made(
            vec![output],
            summary.all_warnings(),
            is_lossy,
            &args.strictness,
        )
    })
}

/// `time_s`, and the name of the channel with its unit in brackets.
fn heading(stream: &ChannelStream) -> Vec<u8> {
    let mut name = print::visible(stream.channel.name.clone());
    if stream.channel.is_compensated && !names_compensated(&name) {
        name = format!("{COMPENSATED}{name}");
    }
    if let Some(unit) = &stream.channel.unit {
        name = format!("{name} [{}]", unit.text);
    }
    // A spreadsheet would interpret it as a formula.
    if name.starts_with(['=', '+', '-', '@', '\t']) {
        name.insert(0, '\'');
    }
    if name.contains([',', '"', '\n']) {
        name = format!("\"{}\"", name.replace('"', "\"\""));
    }
    format!("time_s,{name}\n").into_bytes()
}

fn write_as_it_is(
    args: &Extract,
    stream: ChannelStream,
    output: &mut Output,
) -> Result<(usize, StreamSummary), Failure> {
    let (grid, rate_hz, start) = (
        stream.channel.axis.grid.clone(),
        stream.rate_hz,
        stream.start,
    );
    let (mut blocks, plan, mut validator) = stream.into_parts(0);
    let mut block = Block::default();
    let mut text = Text::default();
    let mut first = 0;
    while blocks.next(&mut block)? {
        block.read_rows(plan.as_ref(), grid.as_ref());
        validator.accept(&mut block)?;
        let rows = ResultRows {
            digits: args.digits,
            scale: 1.0,
            rate_hz,
            times: Times::of(&block, grid.as_ref(), start, first),
        };
        text.clear();
        rows.write(&mut text, &block.rows.values, &[]);
        output.write(text.as_bytes())?;
        first += block.rows.values.len();
    }
    Ok((first, validator.finish(blocks.as_mut())?))
}

fn write_resampled(
    args: &Extract,
    stream: ChannelStream,
    output: &mut Output,
) -> Result<(usize, StreamSummary), Failure> {
    let mut stream = UniformStream::of(stream)?;
    let axis = (stream.rate_hz, stream.start);
    let (mut samples, mut first) = (Vec::new(), 0);
    while stream.next(&mut samples, |_| Ok(()))? {
        rows::write_uniform(output, args.digits, axis, first, &samples)?;
        first += samples.len();
        samples.clear();
    }
    let (summary, _) = stream.finish(&mut samples)?;
    rows::write_uniform(output, args.digits, axis, first, &samples)?;
    Ok((first + samples.len(), summary))
}
