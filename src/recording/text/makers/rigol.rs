//! Rigol exports with start and increment in the cells after the channels:
//! `X,CH1,CH2,Start,Increment` above `Sequence,Volt,Volt,-3.5e-03,5e-06`; the first column only counts.
//! The other ways of this maker are plain tables.

use super::{Maker, channel};
use crate::failure::Failure;
use crate::io::csv::{Delimiter, Dialect, Options};
use crate::io::number;
use crate::recording::text::FOR_MAKER;
use crate::recording::text::decode::Text;
use crate::recording::text::head::Head;
use crate::recording::text::header::Field;
use crate::recording::text::rows::{self, Wanted};
use crate::recording::text::table::Hints;
use crate::recording::without_rounding;
use crate::recording::{Axis, RateFrom, Recording};

const HINTS: Hints = Hints {
    time_unit: Some("s"),
    unit: None,
};
const DIALECT: Dialect = Dialect {
    delimiter: Delimiter::Byte(b','),
    decimal: b'.',
};

/// The rules.
pub const ALL: &[Maker] = &[
    Maker {
        name: "Rigol, start and increment in the head",
        is: |head| Start::of(head).is_some(),
        hints: HINTS,
        read: Some(read),
    },
    Maker {
        name: "Rigol",
        is: |head| head.any(|line| line.contains("tInc =") || line.starts_with("\"PosOrig (V)")),
        hints: HINTS,
        read: None,
    },
];

/// What the two lines of the head say.
struct Start {
    names: Vec<String>,
    units: Vec<String>,
    /// Columns before Start: the count and the channels.
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

fn read(text: &Text, options: &Options) -> Result<Recording, Failure> {
    let head = Head::of(&text.bytes, 0, 1, FOR_MAKER);
    let (Some(start), Some(first)) = (Start::of(&head), head.lines.get(2)) else {
        return Err(Failure::failed("the file ends before its first sample"));
    };
    let wanted = vec![Wanted::Numbers; start.width];
    let read = rows::read(&text.bytes, first.offset, 3, DIALECT, &wanted, &|_| false)?;
    let mut recording = Recording::empty("csv", String::new());
    recording.dialect = DIALECT.describe();
    let mut axis = Axis::of_header(
        "Increment",
        without_rounding(1.0 / start.step_s),
        Some(start.start_s),
    );
    if let Some(rate_hz) = options.rate_hz {
        axis.rate_hz = Some(rate_hz);
        axis.rate_from = RateFrom::Given;
    }
    // Bare values have no column that counts.
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
            .push(channel(&field, column, axis.clone(), None));
    }
    Ok(recording)
}
