//! Fast parsing of rows with the same format as the preceding one.
//!
//! Recorders write every number with the same digits. Once the positions of a row's signs, digits
//! and marks are known, the next row need not be searched for them: they are checked where they are
//! expected, all digits of a run at once. A row that differs is parsed normally and becomes the
//! next template. Both give bitwise equal results.

use super::rows::{ColumnKind, RowPlan, span};
use crate::io::number::{self, Parts};
use crate::recording::text::dialect::Delimiter;

/// Number of consecutive rows after which a changed template is replaced immediately.
const STEADY: usize = 8;
/// Maximum number of rows parsed normally before the next attempt.
const LONGEST_PAUSE: usize = 64;
/// Maximum number of digits parsed at once.
const LONGEST_RUN: usize = 8;
/// Number of digits up to which every number is exact as an `f64` times a power of ten.
const MOST_DIGITS: usize = 15;

/// Format of the two numbers of a row, as far as it is constant.
#[derive(Debug)]
pub(super) struct RowTemplate {
    /// Cell separator, if rows can have a template: two adjacent numbers at their start.
    separator: Option<u8>,
    /// Which of the two is a stamp whose last bit does not matter.
    stamp: Option<usize>,
    shapes: Option<[Shape; 2]>,
    /// Number of rows that matched it.
    followed: usize,
    /// Number of rows until the next attempt.
    pause: usize,
    last_pause: usize,
}

/// A parsed row.
pub(super) struct TemplateRow {
    pub(super) values: [f64; 2],
    pub(super) stamp_text: u64,
    /// Start of the next line.
    pub(super) end: usize,
}

/// Format of a number without its sign.
#[derive(Debug, Clone, Copy)]
struct Shape {
    /// Number of digits before the decimal mark, 1 to 8.
    whole: usize,
    /// Number of digits after it; without a mark if 0.
    fraction: usize,
    /// The digits of the fraction, at most eight each.
    runs: [Run; 2],
    /// Whether `e`, a sign and two digits follow.
    exponent: bool,
}

/// Digits parsed at once.
#[derive(Debug, Clone, Copy)]
struct Run {
    digits: usize,
    /// Ten to the power of the number of digits.
    scale: u64,
}

impl RowTemplate {
    pub(super) fn of(plan: &RowPlan) -> Self {
        let is_pair = plan.kinds == [ColumnKind::Numbers; 2] && plan.items.is_empty();
        Self {
            separator: match plan.dialect.delimiter {
                Delimiter::Byte(mark) if is_pair => Some(mark),
                _ => None,
            },
            stamp: plan.stamps.filter(|_| plan.keeps_stamp_text),
            shapes: None,
            followed: 0,
            pause: 0,
            last_pause: 0,
        }
    }

    /// The row at `at`, if it has the format of the preceding one.
    #[inline(always)]
    pub(super) fn row(&mut self, text: &[u8], at: usize, plan: &RowPlan) -> Option<TemplateRow> {
        let shapes = self.shapes.as_ref()?;
        let decimal = plan.dialect.decimal;
        let (first, first_end) = shapes[0].read(text, at, decimal)?;
        if text.get(first_end).copied() != self.separator {
            return None;
        }
        let second_start = first_end + 1;
        let (second, second_end) = shapes[1].read(text, second_start, decimal)?;
        let end = plan.row_end(text, second_end)?;
        let (values, stamp_text) = match self.stamp {
            Some(0) => (
                [first.nearly()?, second.exactly()?],
                span(at, first_end - at),
            ),
            Some(_) => (
                [first.exactly()?, second.nearly()?],
                span(second_start, second_end - second_start),
            ),
            None => ([first.exactly()?, second.exactly()?], 0),
        };
        self.followed += 1;
        Some(TemplateRow {
            values,
            stamp_text,
            end,
        })
    }

    /// Uses the row at `at`, which was parsed normally, as the next template.
    #[inline]
    pub(super) fn learn(&mut self, text: &[u8], at: usize, plan: &RowPlan) {
        let Some(separator) = self.separator else {
            return;
        };
        if self.pause > 0 {
            self.pause -= 1;
            return;
        }
        self.last_pause = if self.followed >= STEADY || self.shapes.is_none() {
            0
        } else {
            (2 * self.last_pause + 1).min(LONGEST_PAUSE)
        };
        self.followed = 0;
        self.pause = self.last_pause;
        self.shapes = if self.pause == 0 {
            Shape::of_row(text, at, separator, plan.dialect.decimal)
        } else {
            None
        };
    }
}

impl Shape {
    /// Formats of the two numbers of a row.
    #[cold]
    fn of_row(text: &[u8], at: usize, separator: u8, decimal: u8) -> Option<[Self; 2]> {
        let (first, end) = Self::of(text, at, decimal)?;
        (text.get(end) == Some(&separator)).then_some(())?;
        let (second, _) = Self::of(text, end + 1, decimal)?;
        Some([first, second])
    }

    /// Format of the number at `at`, and its end.
    fn of(text: &[u8], at: usize, decimal: u8) -> Option<(Self, usize)> {
        let digits = |from: usize| {
            let rest = text.get(from..).unwrap_or(&[]);
            rest.iter().take_while(|byte| byte.is_ascii_digit()).count()
        };
        let start = at + usize::from(text.get(at) == Some(&b'-'));
        let whole = digits(start);
        let mut end = start + whole;
        let mut fraction = 0;
        if text.get(end) == Some(&decimal) {
            fraction = digits(end + 1);
            end += 1 + fraction;
            if fraction == 0 {
                return None;
            }
        }
        let exponent = matches!(text.get(end), Some(b'e' | b'E'));
        if exponent {
            let signed = matches!(text.get(end + 1), Some(b'+' | b'-'));
            if !signed || digits(end + 2) != 2 {
                return None;
            }
            end += 4;
        }
        if !(1..=LONGEST_RUN).contains(&whole) || whole + fraction > MOST_DIGITS {
            return None;
        }
        let first = fraction.min(LONGEST_RUN);
        let shape = Self {
            whole,
            fraction,
            runs: [first, fraction - first].map(Run::of),
            exponent,
        };
        Some((shape, end))
    }

    /// The number at `at` if it has this format, and its end. The character there is not checked, as
    /// the caller expects a separator.
    #[inline(always)]
    fn read(&self, text: &[u8], at: usize, decimal: u8) -> Option<(Parts, usize)> {
        let negative = *text.get(at)? == b'-';
        let start = at + usize::from(negative);
        let mut end = start + self.whole;
        let mut mantissa = match self.whole {
            1 => number::digit(text, start)?,
            count => number::run(text, start, count)?,
        };
        if self.fraction > 0 {
            if *text.get(end)? != decimal {
                return None;
            }
            let [first, second] = &self.runs;
            mantissa = mantissa * first.scale + number::run(text, end + 1, first.digits)?;
            if second.digits > 0 {
                let more = number::run(text, end + 1 + LONGEST_RUN, second.digits)?;
                mantissa = mantissa * second.scale + more;
            }
            end += 1 + self.fraction;
        }
        let mut exponent = -(self.fraction as i32);
        if self.exponent {
            exponent += number::two_digit_exponent(text, end)?;
            end += 4;
        }
        let parts = Parts {
            negative,
            mantissa,
            exponent,
        };
        Some((parts, end))
    }
}

impl Run {
    fn of(digits: usize) -> Self {
        Self {
            digits,
            scale: 10_u64.pow(digits as u32),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::blocks::TableEnd;
    use super::super::rows::Rows;
    use super::*;
    use crate::recording::text::dialect::Dialect;
    use proptest::prelude::*;

    const COMMA: Dialect = Dialect {
        delimiter: Delimiter::Byte(b','),
        decimal: b'.',
    };

    fn plan(time: usize) -> RowPlan {
        RowPlan {
            dialect: COMMA,
            kinds: vec![ColumnKind::Numbers; 2],
            width: 2,
            stamps: Some(time),
            keeps_stamp_text: true,
            end: TableEnd::of_marks(&[], COMMA),
            items: Vec::new(),
        }
    }

    /// Rows parsed together, and each on its own, without a template.
    fn both(lines: &[String], plan: &RowPlan) -> (Rows, Rows) {
        let (mut together, mut single, mut line) =
            (Rows::default(), Rows::default(), Rows::default());
        for rows in [&mut together, &mut single] {
            rows.begin(0, 2);
        }
        together.read(lines.concat().as_bytes(), plan).unwrap();
        let mut offset = 0;
        for text in lines {
            line.begin(single.line, 2);
            line.read(text.as_bytes(), plan).unwrap();
            line.fill_together(&[0, 1]);
            for (all, more) in single.columns.iter_mut().zip(&line.columns) {
                all.values.extend(&more.values);
            }
            let moved = line.stamp_text.iter().map(|s| s + ((offset as u64) << 32));
            single.stamp_text.extend(moved);
            single.line = line.line;
            single.count += line.count;
            offset += text.len();
        }
        (together, single)
    }

    fn bits(values: &[f64]) -> Vec<u64> {
        values.iter().map(|value| value.to_bits()).collect()
    }

    fn follows(text: &str) -> bool {
        let plan = RowPlan {
            width: 3,
            ..plan(0)
        };
        let mut template = RowTemplate::of(&plan);
        template.learn(text.as_bytes(), 0, &plan);
        let second = text.find('\n').unwrap() + 1;
        template.row(text.as_bytes(), second, &plan).is_some()
    }

    #[test]
    fn what_makes_a_template() {
        let padding = " ".repeat(16);
        let follows = |text: &str| follows(&format!("{text}{padding}"));
        assert!(follows("0.00,1.5\n0.01,2.5\n"));
        assert!(follows("0.00,1.5e-03\r\n0.01,-2.5e+04\r\n"));
        assert!(follows("12,-7\n13,8\n"));
        // A different number of digits, another format, another separator, more digits than are
        // exact.
        assert!(!follows("0.00,1.5\n0.01,2.55\n"));
        assert!(!follows("0.00,1.5\n0.01,25\n"));
        assert!(!follows("9.99,1.5\n10.00,1.5\n"));
        assert!(!follows("0.00,1.5e-03\n0.01,1.5e-3\n"));
        assert!(!follows("0.00,1.5\n0.01;1.5\n"));
        assert!(!follows("0,1.000000000000000\n1,1.000000000000000\n"));
        // Ten to the power of their number is no integer of 64 bits.
        let long = format!("0,0.{:030}\n", 1);
        assert!(!follows(&long.repeat(2)));
        assert!(!follows("0.00,nan\n0.01,nan\n"));
        // A number continues before an unwanted column.
        assert!(!follows("0.00,1.5,7\n0.01,2.55,7\n"));
    }

    proptest! {
        #[test]
        fn changes_nothing(
            rows in prop::collection::vec(
                (0_u32..200_000, -1e4..1e4_f64, 0_usize..12, any::<bool>(), 0_usize..40), 1..200),
            swapped: bool,
            crlf: bool,
        ) {
            // The format changes only occasionally, as templates need.
            let (mut digits, mut scientific) = (5, false);
            let lines: Vec<String> = rows.iter().map(|(i, value, new_digits, new_form, change)| {
                if *change == 0 {
                    (digits, scientific) = (*new_digits, *new_form);
                }
                let time = format!("{:.5}", f64::from(*i) * 5e-5);
                let value = match (change, scientific) {
                    (1, _) => "oops".to_owned(),
                    (2, _) => String::new(),
                    (_, true) => {
                        let text = format!("{value:.digits$e}");
                        let (mantissa, exponent) = text.split_once('e').unwrap();
                        let exponent: i32 = exponent.parse().unwrap();
                        format!("{mantissa}e{exponent:+03}")
                    }
                    _ => format!("{value:.digits$}"),
                };
                let end = if crlf { "\r\n" } else { "\n" };
                if swapped { format!("{value},{time}{end}") } else { format!("{time},{value}{end}") }
            }).collect();
            let plan = plan(usize::from(swapped));
            let (mut together, single) = both(&lines, &plan);
            together.fill_together(&[0, 1]);
            for (a, b) in together.columns.iter().zip(&single.columns) {
                prop_assert_eq!(bits(&a.values), bits(&b.values));
            }
            prop_assert_eq!(together.stamp_text, single.stamp_text);
            prop_assert_eq!((together.line, together.count), (single.line, single.count));
        }
    }
}
