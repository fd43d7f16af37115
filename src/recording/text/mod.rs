//! Recordings in text: decoding the bytes, telling the dialect, reading every column.

mod decode;

use std::sync::Arc;

use super::{Axis, Channel, Hole, HoleKind, Recording};
use crate::failure::Failure;
use crate::io::csv::{self, Options};
use crate::io::number;

/// Reads a text file of any dialect; `source` is its name for people.
///
/// # Errors
/// If it is no recording, or leaves open how it is to be read.
pub fn read(source: &str, bytes: Vec<u8>, options: &Options) -> Result<Recording, Failure> {
    let text = decode::decode(bytes)?;
    let layout = csv::find_layout_of(&text.bytes, &options.told)?;
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); layout.columns.len()];
    let mut holes: Vec<Vec<Hole>> = vec![Vec::new(); layout.columns.len()];
    let data = &text.bytes[layout.data_offset..];
    for (row, line) in data.split(|byte| *byte == b'\n').enumerate() {
        let line_text = String::from_utf8_lossy(line);
        if csv::is_skipped(&line_text) {
            continue;
        }
        let cells = layout.dialect.cells(&line_text);
        for (place, column) in columns.iter_mut().enumerate() {
            let cell = cells.get(place).map(String::as_str);
            let value = cell.and_then(|cell| number::cell(cell, layout.dialect.decimal));
            if value.is_none() {
                holes[place].push(Hole {
                    index: column.len(),
                    line: layout.data_line + row,
                    what: match cell {
                        None => HoleKind::Missing,
                        Some("") => HoleKind::Empty,
                        Some(_) => HoleKind::Text,
                    },
                });
            }
            column.push(value.unwrap_or(f64::NAN));
        }
    }
    let time = csv::time_column(&layout.columns, options)?;
    let axis = time.map_or_else(Axis::default, |place| {
        let factor = layout.columns[place]
            .unit
            .as_ref()
            .map_or(1.0, |u| u.unit.factor());
        let stamps = columns[place].iter().map(|t| t * factor).collect();
        Axis::of_stamps(&layout.columns[place].heading, Arc::new(stamps))
    });
    let channels = layout
        .columns
        .iter()
        .zip(columns.into_iter().zip(holes))
        .enumerate()
        .filter(|(place, _)| Some(*place) != time)
        .map(|(_, (column, (samples, holes)))| Channel {
            name: column.name.clone(),
            heading: column.heading.clone(),
            unit: column.unit.clone(),
            unit_text: column.unit.as_ref().map(|u| u.text.clone()),
            samples,
            holes,
            axis: axis.clone(),
            segment: None,
        })
        .collect();
    Ok(Recording {
        source: source.to_owned(),
        format: "csv",
        dialect: layout.dialect.describe(),
        details: Vec::new(),
        channels,
        segments: Vec::new(),
        warnings: text.warnings,
        lost: None,
    })
}
