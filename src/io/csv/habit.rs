//! Rows that are written like the one before.
//!
//! Recorders write every number with the same digits. Once the places of a row's signs, digits and
//! marks are known, the next row need not be searched for them: they are checked where they are
//! expected, all digits of a run at once. A row that differs is read the usual way and is the new
//! habit. Both ways give the same bits.

use super::layout::Delimiter;
use super::scan::{QuickRow, RowPlan, end_of_row, span};
use crate::io::number::{self, Parts};

/// Rows in a row that make a habit worth following at once when it changes.
const STEADY: usize = 8;
/// Most rows that are read the usual way before the next attempt.
const LONGEST_PAUSE: usize = 64;

/// Digits that are read at once.
const LONGEST_RUN: usize = 8;
/// Digits up to which every number is an `f64` times a power of ten.
const MOST_DIGITS: usize = 15;

/// How the numbers of a row are written, as far as it is the same from row to row.
#[derive(Debug)]
pub(super) struct Habit {
    /// Whether rows can have one: two numbers beside each other at their start.
    possible: bool,
    shape: Option<[Shape; 2]>,
    /// Rows that followed it.
    followed: usize,
    /// Rows until the next attempt.
    pause: usize,
    last_pause: usize,
}

/// Places within a number, its sign left out, and what does not change with them.
#[derive(Debug, Clone, Copy)]
struct Shape {
    /// Digits before the decimal mark, 1 to 8.
    whole: usize,
    /// Digits after it; with 0 there is no mark.
    fraction: usize,
    /// The digits of the fraction, at most eight each.
    runs: [Run; 2],
    /// Whether `e`, a sign and two digits follow.
    exponent: bool,
}

/// Digits that are read at once.
#[derive(Debug, Clone, Copy)]
struct Run {
    digits: usize,
    /// Ten to the power of their number.
    scale: u64,
}

impl Habit {
    pub(super) fn of(plan: &RowPlan) -> Self {
        let at_start = matches!((plan.time, plan.value), (Some(0), 1) | (Some(1), 0));
        Self {
            possible: at_start && matches!(plan.dialect.delimiter, Delimiter::Byte(_)),
            shape: None,
            followed: 0,
            pause: 0,
            last_pause: 0,
        }
    }

    /// The row at `at`, if it is written like the one before.
    #[inline(always)]
    pub(super) fn row(&mut self, text: &[u8], at: usize, plan: &RowPlan) -> Option<QuickRow> {
        let shape = self.shape.as_ref()?;
        let Delimiter::Byte(separator) = plan.dialect.delimiter else {
            return None;
        };
        let decimal = plan.dialect.decimal;
        let (first, first_end) = shape[0].read(text, at, decimal)?;
        if *text.get(first_end)? != separator {
            return None;
        }
        let second_start = first_end + 1;
        let (second, second_end) = shape[1].read(text, second_start, decimal)?;
        let end = end_of_row(text, second_end, separator)?;
        self.followed += 1;
        let row = if plan.value == 1 {
            QuickRow {
                time: first.nearly()?,
                time_text: span(at, first_end - at),
                value: second.exactly()?,
                end,
            }
        } else {
            QuickRow {
                time: second.nearly()?,
                time_text: span(second_start, second_end - second_start),
                value: first.exactly()?,
                end,
            }
        };
        Some(row)
    }

    /// Takes the row at `at`, which was read the usual way, for the new habit.
    #[inline]
    pub(super) fn learn(&mut self, text: &[u8], at: usize, plan: &RowPlan) {
        if !self.possible {
            return;
        }
        if self.pause > 0 {
            self.pause -= 1;
            return;
        }
        self.last_pause = if self.followed >= STEADY || self.shape.is_none() {
            0
        } else {
            (2 * self.last_pause + 1).min(LONGEST_PAUSE)
        };
        self.followed = 0;
        self.pause = self.last_pause;
        self.shape = if self.pause == 0 {
            Self::shapes(text, at, plan)
        } else {
            None
        };
    }

    #[cold]
    fn shapes(text: &[u8], at: usize, plan: &RowPlan) -> Option<[Shape; 2]> {
        let Delimiter::Byte(separator) = plan.dialect.delimiter else {
            return None;
        };
        let (first, end) = Shape::of(text, at, plan.dialect.decimal)?;
        (text.get(end) == Some(&separator)).then_some(())?;
        let (second, _) = Shape::of(text, end + 1, plan.dialect.decimal)?;
        Some([first, second])
    }
}

impl Shape {
    /// The shape of the number at `at`, and its end.
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
        let first = fraction.min(LONGEST_RUN);
        let shape = Self {
            whole,
            fraction,
            runs: [first, fraction - first].map(Run::of),
            exponent,
        };
        ((1..=LONGEST_RUN).contains(&whole) && whole + fraction <= MOST_DIGITS)
            .then_some((shape, end))
    }

    /// The number at `at` if it has this shape, and its end. What stands there is not looked at: the
    /// caller expects a separator.
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
    use super::super::layout::Dialect;
    use super::super::scan::Rows;
    use super::*;
    use proptest::prelude::*;

    const COMMA: Dialect = Dialect {
        delimiter: Delimiter::Byte(b','),
        decimal: b'.',
    };

    fn plan(time: usize, value: usize) -> RowPlan {
        RowPlan {
            dialect: COMMA,
            time: Some(time),
            value,
        }
    }

    /// Rows read together, and each on its own, where there is no habit.
    fn both(lines: &[String], plan: RowPlan) -> (Rows, Rows) {
        let (mut together, mut single, mut line) =
            (Rows::default(), Rows::default(), Rows::default());
        together.read(lines.concat().as_bytes(), &plan);
        let mut offset = 0;
        for text in lines {
            line.read(text.as_bytes(), &plan);
            single.times.extend(&line.times);
            single.values.extend(&line.values);
            let moved = line.time_text.iter().map(|s| s + ((offset as u64) << 32));
            single.time_text.extend(moved);
            single.lines += line.lines;
            offset += text.len();
            if line.problem.is_some() {
                single.problem.clone_from(&line.problem);
                break;
            }
        }
        (together, single)
    }

    fn bits(values: &[f64]) -> Vec<u64> {
        values.iter().map(|value| value.to_bits()).collect()
    }

    fn follows(text: &str) -> bool {
        let plan = plan(0, 1);
        let mut habit = Habit::of(&plan);
        habit.learn(text.as_bytes(), 0, &plan);
        let second = text.find('\n').unwrap() + 1;
        habit.row(text.as_bytes(), second, &plan).is_some()
    }

    #[test]
    fn what_makes_a_habit() {
        let padding = " ".repeat(16);
        let follows = |text: &str| follows(&format!("{text}{padding}"));
        assert!(follows("0.00,1.5\n0.01,2.5\n"));
        assert!(follows("0.00,1.5e-03\r\n0.01,-2.5e+04\r\n"));
        assert!(follows("12,-7\n13,8\n"));
        // Another number of digits, another form, another separator, more digits than are exact.
        assert!(!follows("0.00,1.5\n0.01,2.55\n"));
        assert!(!follows("0.00,1.5\n0.01,25\n"));
        assert!(!follows("9.99,1.5\n10.00,1.5\n"));
        assert!(!follows("0.00,1.5e-03\n0.01,1.5e-3\n"));
        assert!(!follows("0.00,1.5\n0.01;1.5\n"));
        assert!(!follows("0,1.000000000000000\n1,1.000000000000000\n"));
        assert!(!follows("0.00,nan\n0.01,nan\n"));
    }

    proptest! {
        #[test]
        fn changes_nothing(
            rows in prop::collection::vec(
                (0_u32..200_000, -1e4..1e4_f64, 0_usize..12, any::<bool>(), 0_usize..40), 1..200),
            swapped: bool,
            crlf: bool,
        ) {
            // The style changes only now and then, as habits need.
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
            let plan = if swapped { plan(1, 0) } else { plan(0, 1) };
            let (together, single) = both(&lines, plan);
            prop_assert_eq!(bits(&together.values), bits(&single.values));
            prop_assert_eq!(bits(&together.times), bits(&single.times));
            prop_assert_eq!(together.time_text, single.time_text);
            prop_assert_eq!(together.lines, single.lines);
            prop_assert_eq!(together.problem.map(|p| p.what), single.problem.map(|p| p.what));
        }
    }
}
