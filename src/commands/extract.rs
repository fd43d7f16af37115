//! `extract`: one channel of a recording as plain rows, for other programs.

use super::rows::{self, Rows, Times};
use super::{Outcome, conclude};
use crate::cli::Extract;
use crate::failure::Failure;
use crate::io::Input;
use crate::io::output::Output;
use crate::io::text::Text;
use crate::print;
use crate::signal::{Batch, Record, Signal, Summary};

/// Runs the verb.
pub fn run(args: &Extract) -> Result<Outcome, Failure> {
    let mut options = args.record.options();
    options.table.any_steps = true;
    let signal = Signal::open(&Input::of(&args.record.input), &options)?;
    let inputs = [args.record.input.as_ref()];
    let mut output = args.result.open(&inputs)?;
    output.write(&heading(&signal))?;
    let said = format!(
        "{}: {}; {} Hz {}\n",
        signal.source,
        signal.dialect,
        print::rounded(signal.time.rate_hz, 9),
        signal.time.rate_from()
    );
    let summary = if signal.time.is_resampled() {
        write_resampled(args, signal, &mut output)?
    } else {
        write_as_it_is(args, signal, &mut output)?
    };
    output.finish()?;
    if !args.quiet {
        print::say(&said);
    }
    let mut warnings: Vec<_> = summary.lost.iter().cloned().collect();
    warnings.extend(summary.warnings);
    Ok(conclude(&warnings, summary.lost.is_some(), args.strict))
}

/// `time_s`, and the name of the channel with its unit in brackets.
fn heading(signal: &Signal) -> Vec<u8> {
    let mut name = signal.channel.name.clone();
    if let Some(unit) = &signal.channel.unit {
        name = format!("{name} [{}]", unit.text);
    }
    if name.contains([',', '"', '\n']) {
        name = format!("\"{}\"", name.replace('"', "\"\""));
    }
    format!("time_s,{name}\n").into_bytes()
}

fn write_as_it_is(args: &Extract, signal: Signal, output: &mut Output) -> Result<Summary, Failure> {
    let (time, start_s) = (signal.time.clone(), signal.first_time_s());
    let (mut fetch, plan, mut sequence) = signal.into_stream(0);
    let mut batch = Batch::default();
    let mut text = Text::default();
    let mut first = 0;
    while fetch.next(&mut batch)? {
        batch.read_rows(plan.as_ref(), &time);
        sequence.accept(&mut batch)?;
        let rows = Rows {
            digits: args.digits,
            scale: 1.0,
            rate_hz: time.rate_hz,
            times: Times::of(&batch, &time, start_s, first),
        };
        text.clear();
        rows.write(&mut text, &batch.rows.values, &[]);
        output.write(text.as_bytes())?;
        first += batch.rows.values.len();
    }
    sequence.finish(&mut fetch)
}

fn write_resampled(
    args: &Extract,
    signal: Signal,
    output: &mut Output,
) -> Result<Summary, Failure> {
    let record = Record::read(signal, |_| Ok(()))?;
    let axis = (record.rate_hz, record.start_s);
    rows::write_uniform(output, args.digits, axis, &record.samples)?;
    Ok(record.summary)
}
