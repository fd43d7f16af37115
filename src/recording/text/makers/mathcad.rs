//! Tektronix oscilloscope exports for MathCad: four numbers, one per line, then the samples: their count, the time
//! between them in s, and the trigger position, in whole samples and a fraction (TDS Family programmer manual,
//! SAVe:WAVEform:FILEFormat).

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
use crate::recording::{Recording, TimeAxis};
use crate::warning::WarningCode;

const DIALECT: Dialect = Dialect {
    delimiter: Delimiter::Spaces,
    decimal: b'.',
};
/// Number of lines before the first sample.
const HEAD: usize = 4;

/// The rule.
pub const ALL: &[Rule] = &[(
    Maker::of_seconds("Tektronix, for MathCad").with_reader(read),
    |head| MathcadHead::of(head).is_some(),
)];

/// Content of the four numbers.
struct MathcadHead {
    count: f64,
    step_s: f64,
    /// Number of samples before the trigger.
    trigger: f64,
}

impl MathcadHead {
    /// The count is an integer as large as the number of lines, the step is far below a second, the trigger is within
    /// the samples, and its fraction is below one sample.
    fn of(head: &Head) -> Option<Self> {
        let value = |line: usize| number::cell(head.lines.get(line)?.text.trim(), b'.');
        let [count, step_s, whole, part] = [value(0)?, value(1)?, value(2)?, value(3)?];
        let lines = head
            .lines
            .iter()
            .filter(|line| !line.text.trim().is_empty())
            .count() as f64;
        let is_count = count.fract() == 0.0 && count >= 2.0 && lines - HEAD as f64 <= count;
        let is_whole = !head.complete || lines - HEAD as f64 == count;
        let is_trigger =
            whole.fract() == 0.0 && (0.0..=count).contains(&whole) && part.abs() <= 1.0;
        let is_step = step_s > 0.0 && step_s < 0.1;
        (is_count && is_whole && is_trigger && is_step).then_some(Self {
            count,
            step_s,
            trigger: whole + part,
        })
    }
}

fn read(chunks: &mut Chunks, reading: &Reading) -> Result<Recording, Failure> {
    let text = chunks.take_all()?;
    let head = Head::of(
        &text[..text.len().min(FOR_MAKER)],
        text.len() <= FOR_MAKER,
        1,
    );
    let start = MathcadHead::of(&head)
        .ok_or_else(|| ErrorCode::DamagedFile.failed("the first four lines are not a header"))?;
    let mut lines = text.split_inclusive(|byte| *byte == b'\n');
    let skipped: usize = lines.by_ref().take(HEAD).map(<[u8]>::len).sum();
    let (read, _) = rows::of_numbers(&text[skipped..], 1 + HEAD, DIALECT, [0], &[])?;
    let column = read.columns[0].clone();
    let mut recording = Recording::empty("csv", String::new());
    recording.dialect = DIALECT.describe();
    let found = column.values.len() as f64;
    recording.lost = (found < start.count).then(|| {
        WarningCode::SamplesMissing.warning(format!(
            "the header gives {} samples, but there are {found}",
            start.count
        ))
    });
    let mut axis = TimeAxis::of_header(
        "second line",
        1.0 / start.step_s,
        Some(-start.trigger * start.step_s),
    );
    axis.prefer_given(reading.rate_hz);
    recording
        .channels
        .push(channel(&Field::new("signal", None), column, axis));
    Ok(recording)
}
