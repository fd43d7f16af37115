//! Exact conversion of decimal text to `f64`, for recorder logs.
//!
//! Numbers of up to 19 digits and a power of ten up to ±22 are built from their integer mantissa
//! (W. D. Clinger, PLDI 1990: both factors are exact, so the one operation rounds correctly);
//! everything else goes to `fast_float2`.

/// Powers of ten that an `f64` holds exactly.
const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];
/// Their correctly rounded reciprocals.
const INVERSE_POWERS: [f64; 23] = [
    1e0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14,
    1e-15, 1e-16, 1e-17, 1e-18, 1e-19, 1e-20, 1e-21, 1e-22,
];
/// Number of digits that always fit in a `u64`.
const MOST_DIGITS: usize = 19;
/// Largest integer up to which every integer is an `f64`.
const EXACT_MANTISSA: u64 = 1 << 53;

/// Parses a number at `text[at..]`: its value and the position after it.
///
/// `None` if no finite number begins there, or one that instruments use for a missing value. Anything may follow the
/// number.
///
/// ```
/// use torqcomp_decimal::number::read;
/// assert_eq!(read(b"0.5;-1,25e2;x", 4, b','), Some((-125.0, 11)));
/// assert_eq!(read(b"0.5;x", 4, b'.'), None);
/// ```
#[must_use]
pub fn read(text: &[u8], at: usize, decimal: u8) -> Option<(f64, usize)> {
    read_as::<true>(text, at, decimal)
}

/// The same to within one unit in the last place: it multiplies where [`read`] needs a division.
/// For time stamps, which are compared with a tolerance and copied as text.
#[must_use]
pub fn read_nearly(text: &[u8], at: usize, decimal: u8) -> Option<(f64, usize)> {
    read_as::<false>(text, at, decimal)
}

/// Parses a number at `text[at..]` as its difference from an integer, rounded once: for 1710250000.123456 and
/// 1710250000 it is 0.123456, where the number itself has a resolution of 2.4e-7 as an `f64`. Also returns the position
/// after it.
#[must_use]
pub fn read_after(text: &[u8], at: usize, decimal: u8, origin: i64) -> Option<(f64, usize)> {
    let (parts, count, place) = parts(text, at, decimal)?;
    let exact = || {
        let mantissa = i128::from(parts.mantissa);
        let number = if parts.negative { -mantissa } else { mantissa };
        let power = 10_i128.pow(parts.exponent.unsigned_abs());
        if parts.exponent < 0 {
            (number - i128::from(origin) * power) as f64 / power as f64
        } else {
            (number * power - i128::from(origin)) as f64
        }
    };
    if count > MOST_DIGITS {
        let short = without_last_digits(&text[at..place], decimal)?;
        return read_after(&short, 0, decimal, origin).map(|(value, _)| (value, place));
    }
    if parts.exponent.unsigned_abs() > 18 {
        let (value, place) = read(text, at, decimal)?;
        return Some((value - origin as f64, place));
    }
    Some((exact(), place))
}

/// A number without the decimals after its nineteenth digit; `None` if there are none.
#[cold]
fn without_last_digits(number: &[u8], decimal: u8) -> Option<Vec<u8>> {
    let point = number.iter().position(|byte| *byte == decimal)?;
    let before = number[..point]
        .iter()
        .filter(|byte| byte.is_ascii_digit())
        .count();
    let decimals = number[point + 1..]
        .iter()
        .take_while(|byte| byte.is_ascii_digit())
        .count();
    let kept = MOST_DIGITS.checked_sub(before)?.min(decimals);
    Some([&number[..=point + kept], &number[point + 1 + decimals..]].concat())
}

/// The digits of a number at `text[at..]`, their count, and the position after it.
#[inline(always)]
fn parts(text: &[u8], at: usize, decimal: u8) -> Option<(Parts, usize, usize)> {
    let mut place = at;
    let negative = text.get(place) == Some(&b'-');
    if negative || text.get(place) == Some(&b'+') {
        place += 1;
    }
    let whole_start = place;
    let (mut mantissa, whole_end) = few_digits(text, place, 0);
    place = whole_end;
    let mut count = whole_end - whole_start;
    let mut exponent = 0_i32;
    if text.get(place) == Some(&decimal) {
        let fraction_start = place + 1;
        let (more, fraction_end) = many_digits(text, fraction_start, mantissa);
        mantissa = more;
        exponent = -((fraction_end - fraction_start) as i32);
        count += fraction_end - fraction_start;
        place = fraction_end;
    }
    if count == 0 {
        return None;
    }
    if matches!(text.get(place), Some(b'e' | b'E')) {
        let (more, end) = exponent_part(text, place)?;
        exponent = exponent.saturating_add(more);
        place = end;
    }
    Some((
        Parts {
            negative,
            mantissa,
            exponent,
        },
        count,
        place,
    ))
}

#[inline(always)]
fn read_as<const EXACT: bool>(text: &[u8], at: usize, decimal: u8) -> Option<(f64, usize)> {
    let (parts, count, place) = parts(text, at, decimal)?;
    if count > MOST_DIGITS || parts.mantissa > EXACT_MANTISSA || parts.exponent.unsigned_abs() > 22
    {
        return slow(&text[at..place], decimal).map(|value| (value, place));
    }
    let value = if EXACT {
        parts.exactly()?
    } else {
        parts.nearly()?
    };
    Some((value, place))
}

/// A decomposed decimal number: `±mantissa · 10^exponent`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parts {
    pub(crate) negative: bool,
    pub(crate) mantissa: u64,
    pub(crate) exponent: i32,
}

impl Parts {
    /// The nearest `f64`; `None` if that would need more than one rounding.
    #[inline(always)]
    pub(crate) fn exactly(self) -> Option<f64> {
        let power = *EXACT_POWERS.get(self.exponent.unsigned_abs() as usize)?;
        self.made(if self.exponent < 0 {
            self.mantissa as i64 as f64 / power
        } else {
            self.mantissa as i64 as f64 * power
        })
    }

    /// The same to within one unit in the last place, without a division.
    #[inline(always)]
    pub(crate) fn nearly(self) -> Option<f64> {
        let place = self.exponent.unsigned_abs() as usize;
        self.made(if self.exponent < 0 {
            self.mantissa as i64 as f64 * *INVERSE_POWERS.get(place)?
        } else {
            self.mantissa as i64 as f64 * *EXACT_POWERS.get(place)?
        })
    }

    #[inline(always)]
    fn made(self, magnitude: f64) -> Option<f64> {
        let value = if self.negative { -magnitude } else { magnitude };
        (self.mantissa <= EXACT_MANTISSA).then_some(value)
    }
}

/// Value of the `count` digits (1 to 8) at `text[at..]`; `None` if they are not all digits. Eight bytes
/// must be available.
#[inline(always)]
pub(crate) fn run(text: &[u8], at: usize, count: usize) -> Option<u64> {
    let eight = text.get(at..at + 8)?;
    let chunk = u64::from_le_bytes(eight.try_into().expect("eight bytes")) ^ ASCII_ZEROS;
    // Shifts out what follows the digits; zeros precede them.
    let chunk = chunk << (8 * (8 - count));
    are_digits(chunk).then(|| eight_digits(chunk))
}

/// Value of one digit at `text[at]`.
#[inline(always)]
pub(crate) fn digit(text: &[u8], at: usize) -> Option<u64> {
    let digit = text.get(at)?.wrapping_sub(b'0');
    (digit < 10).then_some(u64::from(digit))
}

/// Exponent of the form `e-05` at `text[at..]`.
#[inline(always)]
pub(crate) fn two_digit_exponent(text: &[u8], at: usize) -> Option<i32> {
    let &[mark, sign, tens, ones] = text.get(at..at + 4)? else {
        return None;
    };
    let (tens, ones) = (tens.wrapping_sub(b'0'), ones.wrapping_sub(b'0'));
    if mark | 0x20 != b'e' || tens > 9 || ones > 9 || (sign != b'-' && sign != b'+') {
        return None;
    }
    let value = 10 * i32::from(tens) + i32::from(ones);
    Some(if sign == b'-' { -value } else { value })
}

/// Appends the digits at `text[at..]` to `mantissa` (wrapping: the caller counts the digits): eight at
/// a time while there are as many, then one by one. Short runs are fastest one by one.
#[inline(always)]
fn many_digits(text: &[u8], mut at: usize, mut mantissa: u64) -> (u64, usize) {
    while let Some(eight) = text.get(at..at + 8) {
        let chunk = u64::from_le_bytes(eight.try_into().expect("eight bytes")) ^ ASCII_ZEROS;
        if !are_digits(chunk) {
            break;
        }
        mantissa = mantissa
            .wrapping_mul(100_000_000)
            .wrapping_add(eight_digits(chunk));
        at += 8;
    }
    few_digits(text, at, mantissa)
}

/// The same, one by one.
#[inline(always)]
fn few_digits(text: &[u8], mut at: usize, mut mantissa: u64) -> (u64, usize) {
    while let Some(digit) = text.get(at).map(|byte| byte.wrapping_sub(b'0'))
        && digit < 10
    {
        mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
        at += 1;
    }
    (mantissa, at)
}

/// Eight times the byte of the digit 0.
const ASCII_ZEROS: u64 = 0x3030_3030_3030_3030;

/// Whether all eight bytes are 0 to 9, as for ASCII digits minus [`ASCII_ZEROS`]. Adding 0x76 sets
/// the high bit of anything larger.
#[inline(always)]
fn are_digits(chunk: u64) -> bool {
    (chunk.wrapping_add(0x7676_7676_7676_7676) | chunk) & 0x8080_8080_8080_8080 == 0
}

/// Value of eight digits, one per byte, the first in the lowest: pairs, then fours, then eight.
#[inline]
fn eight_digits(chunk: u64) -> u64 {
    let pairs = (chunk.wrapping_mul(10).wrapping_add(chunk >> 8)) & 0x00FF_00FF_00FF_00FF;
    let fours = (pairs.wrapping_mul(100).wrapping_add(pairs >> 16)) & 0x0000_FFFF_0000_FFFF;
    fours.wrapping_mul(10_000).wrapping_add(fours >> 32) & 0xFFFF_FFFF
}

#[inline]
fn exponent_part(text: &[u8], at: usize) -> Option<(i32, usize)> {
    let mut place = at + 1;
    let negative = text.get(place) == Some(&b'-');
    if negative || text.get(place) == Some(&b'+') {
        place += 1;
    }
    let start = place;
    let mut value = 0_i32;
    while let Some(digit) = text.get(place).map(|byte| byte.wrapping_sub(b'0'))
        && digit < 10
    {
        // Far beyond any f64 the digits no longer matter.
        value = if value < 100_000 {
            10 * value + i32::from(digit)
        } else {
            value
        };
        place += 1;
    }
    (place > start).then_some((if negative { -value } else { value }, place))
}

#[cold]
fn slow(text: &[u8], decimal: u8) -> Option<f64> {
    let value: f64 = if decimal == b'.' {
        fast_float2::parse(text).ok()?
    } else {
        let text: Vec<u8> = text
            .iter()
            .map(|byte| if *byte == decimal { b'.' } else { *byte })
            .collect();
        fast_float2::parse(&text).ok()?
    };
    (value.is_finite() && !is_instruments_mark(value)).then_some(value)
}

/// Numbers that instruments use for missing values: 9.91e37 is not a number, ±9.9e37 is over the range
/// (SCPI-1999, volume 1, 7.2.1.4 and 7.2.1.5).
const INSTRUMENTS_MARKS: [f64; 2] = [9.9e37, 9.91e37];
/// Relative deviation of such a mark after conversion to an `f32` or rounding to few digits.
const OF_MARKS: f64 = 1e-5;

/// Whether a number means a missing or out-of-range value of an instrument.
#[must_use]
pub fn is_instruments_mark(value: f64) -> bool {
    INSTRUMENTS_MARKS
        .iter()
        .any(|mark| (value.abs() / mark - 1.0).abs() < OF_MARKS)
}

/// Parses a whole cell, with optional spaces around it.
#[must_use]
pub fn cell(text: &str, decimal: u8) -> Option<f64> {
    let text = text.trim().as_bytes();
    read(text, 0, decimal)
        .filter(|(_, end)| *end == text.len())
        .map(|(value, _)| value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn large_stamps_keep_every_digit_as_differences() {
        let origin = 1_710_250_000;
        for (text, expected) in [
            ("1710250000.000020", 2e-5),
            ("1710249999.5", -0.5),
            ("1710250000", 0.0),
            ("1.710250000123456789e+09", 0.123_456_789),
            ("1710250000.123456789012345", 0.123_456_789),
            ("1710250000.123456789012345e0", 0.123_456_789),
        ] {
            let found = read_after(text.as_bytes(), 0, b'.', origin);
            assert_eq!(found, Some((expected, text.len())), "{text}");
        }
        let ns = read_after(b"1710250000000000001", 0, b'.', 1_710_250_000_000_000_000);
        assert_eq!(ns, Some((1.0, 19)));
        assert_eq!(read_after(b"x", 0, b'.', origin), None);
    }

    #[test]
    fn usual_cells() {
        let value = |text: &str| cell(text, b'.');
        assert_eq!(value("0.00005"), Some(5e-5));
        assert_eq!(
            value("-1.234567890123456789"),
            Some(-1.234_567_890_123_456_7)
        );
        assert_eq!(value(" +7. "), Some(7.0));
        assert_eq!(value(".5"), Some(0.5));
        assert_eq!(value("1e5"), Some(1e5));
        assert_eq!(value("2.5E-308"), Some(2.5e-308));
        assert_eq!(
            value("123456789012345678901234"),
            Some(123_456_789_012_345_678_901_234.0)
        );
        assert_eq!(cell("-0,25", b','), Some(-0.25));
        assert_eq!(
            cell("1,23456789012345678901e3", b','),
            Some(1_234.567_890_123_457)
        );
        for text in [
            "", "-", ".", "1e", "e5", "abc", "1.2.3", "nan", "inf", "1e999", "0x10", "1 2",
        ] {
            assert_eq!(value(text), None, "{text:?}");
        }
    }

    #[test]
    fn reading_stops_after_the_number() {
        assert_eq!(read(b"x1.5;2", 1, b'.'), Some((1.5, 4)));
        assert_eq!(read(b"12345678901,", 0, b'.'), Some((12_345_678_901.0, 11)));
    }

    proptest! {
        #[test]
        fn nearly_is_within_one_unit_of_the_last_bit(whole in 0_u32..2_000_000_000, part in 0_u64..1_000_000) {
            let text = format!("{whole}.{part:06},x");
            let (exact, end) = read(text.as_bytes(), 0, b'.').unwrap();
            let (near, same_end) = read_nearly(text.as_bytes(), 0, b'.').unwrap();
            prop_assert_eq!(end, same_end);
            prop_assert!((near.to_bits() as i64 - exact.to_bits() as i64).abs() <= 1);
        }

        #[test]
        fn agrees_with_the_standard_library(value in any::<f64>(), digits in 0_usize..20) {
            prop_assume!(value.is_finite());
            for text in [format!("{value}"), format!("{value:e}"), format!("{value:.digits$e}")] {
                prop_assert_eq!(cell(&text, b'.'), text.parse().ok(), "{}", text);
            }
        }

        #[test]
        fn agrees_on_short_decimals(whole in 0_u32..100_000, part in 0_u64..10_000_000_000, minus: bool) {
            let text = format!("{}{whole}.{part}", if minus { "-" } else { "" });
            prop_assert_eq!(cell(&text, b'.'), text.parse().ok());
        }
    }
}
