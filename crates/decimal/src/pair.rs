//! Rows whose two first numbers have the same digits and marks as those of an earlier row.

use crate::Span;
use crate::number::{self, Parts};

/// Maximum number of digits parsed at once.
const LONGEST_RUN: usize = 8;
/// Number of digits up to which every number is exact as an `f64` times a power of ten.
const MOST_DIGITS: usize = 15;

/// Format of two adjacent numbers.
///
/// Where the signs, digits and marks are known, they need not be searched for: they are checked where they are
/// expected, all digits of a run at once.
///
/// ```
/// use torqcomp_decimal::PairFormat;
/// let rows = b"0.00,-1.5\n0.01,12.5\n0.02,1.75e+00\n";
/// let format = PairFormat::of(rows, 0, b',', b'.', None).unwrap();
/// assert_eq!(format.read(rows, 0).unwrap().values, [0.0, -1.5]);
/// // Two digits where one was expected.
/// assert!(format.read(rows, 10).is_none());
/// ```
#[derive(Debug)]
pub struct PairFormat {
    numbers: [NumberFormat; 2],
    separator: u8,
    decimal: u8,
    /// Which of the two is copied as text, so that its last bit does not matter.
    copied: Option<usize>,
}

/// Two numbers read.
#[derive(Debug)]
pub struct NumberPair {
    /// Both numbers: exact, except for the copied one, which may be one unit of its last bit off.
    pub values: [f64; 2],
    /// Where the copied one is.
    pub copied: Span,
    /// Position after the second.
    pub end: usize,
}

/// Format of a number without its sign.
#[derive(Debug, Clone, Copy)]
struct NumberFormat {
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

impl PairFormat {
    /// Format of the two numbers at `text[at..]`; `None` for others than plain numbers of up to 15 digits, 8 of them
    /// before the decimal mark.
    #[cold]
    #[must_use]
    pub fn of(
        text: &[u8],
        at: usize,
        separator: u8,
        decimal: u8,
        copied: Option<usize>,
    ) -> Option<Self> {
        let (first, end) = NumberFormat::of(text, at, decimal)?;
        (text.get(end) == Some(&separator)).then_some(())?;
        let (second, _) = NumberFormat::of(text, end + 1, decimal)?;
        Some(Self {
            numbers: [first, second],
            separator,
            decimal,
            copied,
        })
    }

    /// The numbers at `text[at..]`, if they have this format. What follows the second is not checked.
    #[must_use]
    pub fn read(&self, text: &[u8], at: usize) -> Option<NumberPair> {
        let [first, second] = &self.numbers;
        let (first, first_end) = first.read(text, at, self.decimal)?;
        if *text.get(first_end)? != self.separator {
            return None;
        }
        let second_start = first_end + 1;
        let (second, end) = second.read(text, second_start, self.decimal)?;
        let (values, copied) = match self.copied {
            Some(0) => (
                [first.nearly()?, second.exactly()?],
                Span::new(at, first_end - at),
            ),
            Some(_) => (
                [first.exactly()?, second.nearly()?],
                Span::new(second_start, end - second_start),
            ),
            None => ([first.exactly()?, second.exactly()?], Span::default()),
        };
        Some(NumberPair {
            values,
            copied,
            end,
        })
    }
}

impl NumberFormat {
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
        let format = Self {
            whole,
            fraction,
            runs: [first, fraction - first].map(Run::of),
            exponent,
        };
        Some((format, end))
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
