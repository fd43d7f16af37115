//! Tektronix exports of the older kind: keys and values in the first columns, time and volts beside
//! them from the first line on (`Record Length,2500,,-0.0005,0.02`), perhaps several times side by side.
//! The newer ones, with a head above `TIME,CH1`, are plain tables.

use std::sync::Arc;

use super::{Maker, channel};
use crate::failure::Failure;
use crate::io::csv::{Delimiter, Dialect, Options};
use crate::recording::text::decode::Text;
use crate::recording::text::head::Head;
use crate::recording::text::header::Field;
use crate::recording::text::keys::{self, Entry, Topic};
use crate::recording::text::rows::{self, Wanted};
use crate::recording::text::table::Hints;
use crate::recording::text::{FOR_MAKER, details, units};
use crate::recording::{Axis, RateFrom, Recording};
use crate::warning::Warning;

const HINTS: Hints = Hints {
    time_unit: Some("s"),
    unit: None,
};

/// The rules.
pub const ALL: &[Maker] = &[
    Maker {
        name: "Tektronix, keys beside the samples",
        is: |head| side_by_side(head).is_some(),
        hints: HINTS,
        read: Some(read),
    },
    Maker {
        name: "Tektronix",
        is: |head| {
            let is_model = |line: &str| {
                [
                    "Model,MSO",
                    "Model,DPO",
                    "Model,MDO",
                    "Model,TDS",
                    "Model,TBS",
                    "Model,TPS",
                    "Model,DSA",
                    "Model,LPD",
                ]
                .iter()
                .any(|start| line.starts_with(start))
            };
            head.any(is_model) && head.any(|line| line.starts_with("TIME,"))
        },
        hints: HINTS,
        read: None,
    },
];

/// The dialect and the columns at which keys begin, if the first line is so.
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
                .is_some_and(|cell| crate::io::number::cell(cell, decimal).is_some())
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

fn read(text: &Text, options: &Options) -> Result<Recording, Failure> {
    let head = Head::of(&text.bytes, 0, 1, FOR_MAKER);
    let Some((dialect, blocks, width)) = side_by_side(&head) else {
        return Err(Failure::failed(
            "the first line has no time and value beside its key",
        ));
    };
    let mut wanted = vec![Wanted::Nothing; width];
    for place in &blocks {
        wanted[place + 3] = Wanted::Numbers;
        wanted[place + 4] = Wanted::Numbers;
    }
    let read = rows::read(&text.bytes, 0, 1, dialect, &wanted, &|_| false)?;
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
        let axis = axis(&entries, read.columns[place + 3].values.clone(), options);
        let said = entries
            .iter()
            .find(|entry| entry.topic() == Some(Topic::Count));
        let said = said.and_then(|entry| keys::quantity(entry.value()?, b'.'));
        if let Some((said, _)) = said
            && said > column.values.len() as f64
        {
            recording.lost = Some(Warning::new(
                "samples-missing",
                format!(
                    "the head announces {said} samples, but there are {}",
                    column.values.len()
                ),
            ));
        }
        recording.details.extend(details(&entries));
        recording.channels.push(channel(&field, column, axis, None));
    }
    Ok(recording)
}

fn entries(head: &Head, dialect: Dialect, place: usize) -> Vec<Entry> {
    head.lines
        .iter()
        .enumerate()
        .filter_map(|(line, content)| {
            let cells = dialect.cells(&content.text);
            let key = cells.get(place).filter(|key| !key.is_empty())?;
            Some(Entry {
                line: head.number(line),
                key: key.clone(),
                values: cells.get(place + 1..(place + 3).min(cells.len()))?.to_vec(),
            })
        })
        .collect()
}

fn axis(entries: &[Entry], stamps: Vec<f64>, options: &Options) -> Axis {
    let unit = entries
        .iter()
        .find(|entry| entry.topic() == Some(Topic::AxisUnit));
    let factor = unit
        .and_then(Entry::value)
        .and_then(units::read)
        .filter(units::is_time)
        .map_or(1.0, |unit| unit.unit.factor());
    let stamps = stamps.into_iter().map(|stamp| stamp * factor).collect();
    let mut axis = Axis::of_stamps("time", Arc::new(stamps));
    axis.header_rate_hz = entries
        .iter()
        .find_map(|entry| keys::rate_hz(entry, None, b'.'));
    axis.start_text = keys::date_text(entries);
    if let Some(rate_hz) = options.rate_hz {
        axis.rate_hz = Some(rate_hz);
        axis.rate_from = RateFrom::Given;
    }
    axis
}
