//! Fast parsing of rows with the same format as the preceding one.
//!
//! Recorders write every number with the same digits. Once the positions of a row's signs, digits
//! and marks are known, the next row need not be searched for them: they are checked where they are
//! expected, all digits of a run at once. A row that differs is parsed normally and becomes the
//! next template. Both give bitwise equal results.

use torqcomp_decimal::{NumberPair, PairFormat};

use super::rows::{ColumnKind, RowPlan};
use crate::recording::text::dialect::Delimiter;

/// Number of consecutive rows after which a changed template is replaced immediately.
const STEADY: usize = 8;
/// Maximum number of rows parsed normally before the next attempt.
const LONGEST_PAUSE: usize = 64;

/// Format of the two numbers of a row, as far as it is constant.
#[derive(Debug)]
pub(super) struct RowTemplate {
    /// Cell separator, if rows can have a template: two adjacent numbers at their start.
    separator: Option<u8>,
    /// Which of the two is a stamp whose text is copied.
    copied: Option<usize>,
    format: Option<PairFormat>,
    /// Number of rows that matched it.
    followed: usize,
    /// Number of rows until the next attempt.
    pause: usize,
    last_pause: usize,
}

impl RowTemplate {
    pub(super) fn of(plan: &RowPlan) -> Self {
        let is_pair = plan.kinds == [ColumnKind::Numbers; 2] && plan.items.is_empty();
        Self {
            separator: match plan.dialect.delimiter {
                Delimiter::Byte(mark) if is_pair => Some(mark),
                _ => None,
            },
            copied: plan.stamps.filter(|_| plan.keeps_stamp_text),
            format: None,
            followed: 0,
            pause: 0,
            last_pause: 0,
        }
    }

    /// The row at `at`, if it has the format of the preceding one, and the start of the next line.
    #[inline]
    pub(super) fn row(
        &mut self,
        text: &[u8],
        at: usize,
        plan: &RowPlan,
    ) -> Option<(NumberPair, usize)> {
        let pair = self.format.as_ref()?.read(text, at)?;
        let end = plan.row_end(text, pair.end)?;
        self.followed += 1;
        Some((pair, end))
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
        self.last_pause = if self.followed >= STEADY || self.format.is_none() {
            0
        } else {
            (2 * self.last_pause + 1).min(LONGEST_PAUSE)
        };
        self.followed = 0;
        self.pause = self.last_pause;
        self.format = if self.pause == 0 {
            PairFormat::of(text, at, separator, plan.dialect.decimal, self.copied)
        } else {
            None
        };
    }
}

#[cfg(test)]
mod tests {
    use super::super::blocks::TableEnd;
    use super::super::rows::Rows;
    use super::*;
    use crate::recording::text::dialect::Dialect;
    use proptest::prelude::*;
    use torqcomp_decimal::Span;

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
            let stamps = line.stamp_text.iter();
            let moved = stamps.map(|span| Span::new(offset + span.offset(), span.length()));
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
