//! Older Tektronix exports: keys and values in the first columns, time and volts next to them from the
//! first line on (`Record Length,2500,,-0.0005,0.02`), possibly several times side by side. The newer
//! ones, with a header above `TIME,CH1`, are plain tables.

use std::sync::Arc;

use torqcomp_decimal::number;

use super::{Maker, Rule};
use crate::failure::{ErrorCode, Failure};
use crate::io::Reading;
use crate::recording::text::chunks::Chunks;
use crate::recording::text::dialect::{Delimiter, Dialect};
use crate::recording::text::head::Head;
use crate::recording::text::header::Field;
use crate::recording::text::keys::{self, HeaderEntry, Topic};
use crate::recording::text::rows;
use crate::recording::text::table::channel;
use crate::recording::text::{FOR_MAKER, details, units};
use crate::recording::{Recording, TimeAxis};
use crate::unit::NamedUnit;
use crate::warning::WarningCode;

/// The rules.
pub const ALL: &[Rule] = &[
    (
        Maker::of_seconds("Tektronix, keys beside the samples").with_reader(read),
        |head| side_by_side(head).is_some(),
    ),
    (Maker::of_seconds("Tektronix"), |head| {
        const MODELS: [&str; 8] = ["MSO", "DPO", "MDO", "TDS", "TBS", "TPS", "DSA", "LPD"];
        let is_model = |line: &str| {
            let model = line.strip_prefix("Model,").unwrap_or_default();
            MODELS.iter().any(|start| model.starts_with(start))
        };
        head.any(is_model) && head.any(|line| line.starts_with("TIME,"))
    }),
];

/// The dialect and the columns at which keys begin, if the first line matches.
fn side_by_side(head: &Head) -> Option<(Dialect, Vec<usize>, usize)> {
    let line = &head.lines.first()?.text;
    for (delimiter, decimal) in [
        (b',', b'.'),
        (b';', b','),
        (b';', b'.'),
        (b'\t', b'.'),
        (b'\t', b','),
    ] {
        let dialect = Dialect {
            delimiter: Delimiter::Byte(delimiter),
            decimal,
        };
        let cells = dialect.cells(line);
        let number = |place: usize| {
            cells
                .get(place)
                .is_some_and(|cell| number::cell(cell, decimal).is_some())
        };
        let blocks: Vec<usize> = (0..cells.len())
            .filter(|place| cells[*place].eq_ignore_ascii_case("Record Length"))
            .filter(|place| number(place + 3) && number(place + 4))
            .collect();
        if !blocks.is_empty() {
            return Some((dialect, blocks, cells.len()));
        }
    }
    None
}

fn read(chunks: &mut Chunks, reading: &Reading) -> Result<Recording, Failure> {
    let text = chunks.take_all()?;
    let head = Head::of(
        &text[..text.len().min(FOR_MAKER)],
        text.len() <= FOR_MAKER,
        1,
    );
    let Some((dialect, blocks, _)) = side_by_side(&head) else {
        return Err(
            ErrorCode::DamagedFile.failed("the first line has no time and value beside its key")
        );
    };
    let numbers = blocks.iter().flat_map(|place| [place + 3, place + 4]);
    let (read, _) = rows::of_numbers(&text, 1, dialect, numbers, &[])?;
    let mut recording = Recording::empty("csv", String::new());
    recording.dialect = dialect.describe();
    for place in blocks {
        let entries = entries(&head, dialect, place);
        let column = read.columns[place + 4].clone();
        let value = |key: &str| {
            let entry = entries
                .iter()
                .find(|entry| entry.key.eq_ignore_ascii_case(key))?;
            entry.value().map(str::to_owned)
        };
        let name = value("Source").unwrap_or_else(|| "voltage".to_owned());
        let field = Field::new(&name, value("Vertical Units").as_deref());
        let axis = axis(&entries, read.columns[place + 3].values.clone(), reading);
        let said = entries
            .iter()
            .find(|entry| entry.topic() == Some(Topic::Count));
        let said = said.and_then(|entry| keys::quantity(entry.value()?, b'.'));
        if let Some((said, _)) = said
            && said > column.values.len() as f64
        {
            recording.lost = Some(WarningCode::SamplesMissing.warning(format!(
                "the header gives {said} samples, but there are {}",
                column.values.len()
            )));
        }
        recording.details.extend(details(&entries));
        recording.channels.push(channel(&field, column, axis));
    }
    Ok(recording)
}

fn entries(head: &Head, dialect: Dialect, place: usize) -> Vec<HeaderEntry> {
    head.lines
        .iter()
        .enumerate()
        .filter_map(|(line, content)| {
            let cells = dialect.cells(&content.text);
            let key = cells.get(place).filter(|key| !key.is_empty())?;
            Some(HeaderEntry {
                line: head.number(line),
                key: key.clone(),
                values: cells.get(place + 1..(place + 3).min(cells.len()))?.to_vec(),
                is_number_split: false,
            })
        })
        .collect()
}

fn axis(entries: &[HeaderEntry], stamps: Vec<f64>, reading: &Reading) -> TimeAxis {
    let unit = entries
        .iter()
        .find(|entry| entry.topic() == Some(Topic::AxisUnit));
    let factor = unit
        .and_then(HeaderEntry::value)
        .and_then(units::read)
        .filter(NamedUnit::is_time)
        .map_or(1.0, |unit| unit.unit.factor());
    let stamps = stamps.into_iter().map(|stamp| stamp * factor).collect();
    let mut axis = TimeAxis::of_stamps("time", Arc::new(stamps));
    axis.header_rate_hz = entries
        .iter()
        .find_map(|entry| keys::rate_hz(entry, None, b'.'));
    axis.start_text = keys::date_text(entries);
    axis.prefer_given(reading.rate_hz);
    axis
}
