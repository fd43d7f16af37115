//! Rigol exports with start and increment in the cells after the channels: `X,CH1,CH2,Start,Increment`
//! above `Sequence,Volt,Volt,-3.5e-03,5e-06`; the first column is an index. Other formats of this maker
//! are plain tables.

use torqcomp_decimal::number;

use super::{Maker, Rule};
use crate::failure::{ErrorCode, Failure};
use crate::io::Reading;
use crate::recording::text::FOR_MAKER;
use crate::recording::text::chunks::Chunks;
use crate::recording::text::dialect::{Delimiter, Dialect};
use crate::recording::text::head::Head;
use crate::recording::text::header::Field;
use crate::recording::text::rows;
use crate::recording::text::table::channel;
use crate::recording::without_rounding;
use crate::recording::{Recording, TimeAxis};

const DIALECT: Dialect = Dialect {
    delimiter: Delimiter::Byte(b','),
    decimal: b'.',
};

/// The rules.
pub const ALL: &[Rule] = &[
    (
        Maker::of_seconds("Rigol, start and increment in the header").with_reader(read),
        |head| Start::of(head).is_some(),
    ),
    (Maker::of_seconds("Rigol"), |head| {
        head.any(|line| line.contains("tInc =") || line.starts_with("\"PosOrig (V)"))
    }),
];

/// Content of the two header lines.
struct Start {
    names: Vec<String>,
    units: Vec<String>,
    /// Number of columns before Start: the index and the channels.
    width: usize,
    start_s: f64,
    step_s: f64,
}

impl Start {
    fn of(head: &Head) -> Option<Self> {
        let names = DIALECT.cells(&head.lines.first()?.text);
        let units = DIALECT.cells(&head.lines.get(1)?.text);
        let place = |word: &str| {
            names
                .iter()
                .position(|name| name.eq_ignore_ascii_case(word))
        };
        let (start, step) = (place("Start")?, place("Increment")?);
        let value = |place: usize| units.get(place).and_then(|cell| number::cell(cell, b'.'));
        let step_s = value(step).filter(|step| *step > 0.0)?;
        Some(Self {
            start_s: value(start)?,
            step_s,
            width: start.min(step),
            names,
            units,
        })
    }
}

fn read(chunks: &mut Chunks, reading: &Reading) -> Result<Recording, Failure> {
    let (text, complete) = chunks.peek(FOR_MAKER)?;
    let head = Head::of(text, complete, 1);
    let (Some(start), Some(first)) = (Start::of(&head), head.lines.get(2)) else {
        return Err(ErrorCode::DamagedFile.failed("the file ends before its first sample"));
    };
    chunks.skip(first.offset);
    let text = chunks.take_all()?;
    let (read, _) = rows::of_numbers(&text, 3, DIALECT, 0..start.width, &[])?;
    let mut recording = Recording::empty("csv", String::new());
    recording.dialect = DIALECT.describe();
    let mut axis = TimeAxis::of_header(
        "Increment",
        without_rounding(1.0 / start.step_s),
        Some(start.start_s),
    );
    axis.prefer_given(reading.rate_hz);
    // Bare values have no index column.
    let counts = start
        .names
        .first()
        .is_some_and(|name| !name.to_uppercase().starts_with("CH"));
    for (place, column) in read
        .columns
        .into_iter()
        .enumerate()
        .skip(usize::from(counts))
    {
        if column.values.is_empty() {
            continue;
        }
        let unit = start.units.get(place).map(String::as_str);
        let field = Field::new(&start.names[place], unit);
        recording
            .channels
            .push(channel(&field, column, axis.clone()));
    }
    Ok(recording)
}
