//! Conversion of `f64` to decimal text with a fixed number of significant digits.

/// Default number of significant digits.
///
/// A relative rounding of 5·10⁻¹² is far below any recorder's resolution, and below the 10⁻⁹
/// accuracy of a compensation.
pub const DEFAULT_COUNT: u32 = 12;

/// The default as [`Digits`].
pub const DEFAULT_DIGITS: Digits = Digits::Significant(DEFAULT_COUNT);

/// Number of digits written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Digits {
    /// This many significant digits, 1 to 15, without trailing zeros.
    Significant(u32),
    /// As few as reproduce the same `f64`.
    Shortest,
}

/// Decimal exponents of the fast method; the rest is rare and uses the standard library.
const SMALLEST_EXPONENT: i32 = -20;
const LARGEST_EXPONENT: i32 = 21;

/// `10^(i + SCALE_START)`, correctly rounded.
const SCALES: [f64; 57] = [
    1e-21, 1e-20, 1e-19, 1e-18, 1e-17, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8,
    1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9,
    1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22, 1e23, 1e24, 1e25,
    1e26, 1e27, 1e28, 1e29, 1e30, 1e31, 1e32, 1e33, 1e34, 1e35,
];
const SCALE_START: i32 = -21;

/// Largest exponent of plain notation: above it, and below `1e-5`, the text has an exponent.
const LARGEST_PLAIN: i32 = 15;
const SMALLEST_PLAIN: i32 = -5;

/// Buffer size for one number: 17 digits, sign, point, leading zeros or exponent, and the slack for
/// copies of fixed length.
pub(crate) const ROOM: usize = 48;

/// Appends a finite number.
///
/// With [`Digits::Significant`] the digits come from one product of two correctly rounded factors:
/// the last of 12 is rounded to within 0.501 of a unit, that of 15 to within 0.8.
pub fn write(out: &mut Vec<u8>, value: f64, digits: Digits) {
    let mut text = [0; ROOM];
    let length = put(&mut text, value, digits);
    out.extend_from_slice(&text[..length]);
}

/// Writes a finite number to the start of `text` and returns its length; the bytes after it are
/// arbitrary.
pub(crate) fn put(text: &mut [u8; ROOM], value: f64, digits: Digits) -> usize {
    match digits {
        Digits::Significant(count) => Decimal::of(value, count).put(text),
        Digits::Shortest => put_text(text, zmij::Buffer::new().format(value)),
    }
}

fn put_text(text: &mut [u8; ROOM], number: &str) -> usize {
    text[..number.len()].copy_from_slice(number.as_bytes());
    number.len()
}

/// A number decomposed into its digits, before conversion to text.
///
/// It is faster to decompose several first and convert them afterwards: the steps for one number
/// depend on each other, those for several do not.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Decimal {
    value: f64,
    /// Sixteen ASCII digits, the first in the lowest byte, zeros after the last significant one.
    digits: u128,
    /// Decimal exponent of the first digit; `RARE` for a value written by the other method.
    exponent: i32,
    count: u32,
}

/// Exponent of a number far outside a recorder's range, and of zero.
const RARE: i32 = i32::MAX;

impl Decimal {
    /// Decomposes a finite number, to this many significant digits (1 to 15).
    #[inline(always)]
    #[must_use]
    pub(crate) fn of(value: f64, count: u32) -> Self {
        let (mantissa, exponent) = decompose(value.abs(), count).unwrap_or((0, RARE));
        Self {
            value,
            digits: sixteen_digits(mantissa * WHOLE_POWERS[16 - count as usize]),
            exponent,
            count,
        }
    }

    /// Writes it to the start of `text` and returns its length.
    #[inline(always)]
    pub(crate) fn put(&self, text: &mut [u8; ROOM]) -> usize {
        if (SMALLEST_PLAIN..LARGEST_PLAIN).contains(&self.exponent) {
            // The sign is overwritten if there is none.
            text[0] = b'-';
            let start = usize::from(self.value < 0.0);
            put_plain(text, start, self.digits, self.significant(), self.exponent)
        } else {
            self.put_unusual(text)
        }
    }

    /// Number of digits without trailing zeros.
    #[inline(always)]
    fn significant(&self) -> usize {
        16 - ((self.digits ^ ASCII_ZEROS).leading_zeros() / 8) as usize
    }

    #[cold]
    fn put_unusual(&self, text: &mut [u8; ROOM]) -> usize {
        if self.exponent != RARE {
            text[0] = b'-';
            let start = usize::from(self.value < 0.0);
            put_scientific(text, start, self.digits, self.significant(), self.exponent)
        } else if self.value == 0.0 {
            put_text(text, "0")
        } else {
            put_text(text, &rare(self.value, self.count))
        }
    }
}

/// Powers of ten that scale a number to sixteen digits.
const WHOLE_POWERS: [u64; 16] = {
    let mut powers = [1; 16];
    let mut i = 1;
    while i < 16 {
        powers[i] = 10 * powers[i - 1];
        i += 1;
    }
    powers
};
/// Sixteen times the byte of the digit 0.
const ASCII_ZEROS: u128 = 0x3030_3030_3030_3030_3030_3030_3030_3030;

/// Integer of `count` digits and decimal exponent with `value ≈ d.ddd × 10^exponent`.
#[inline(always)]
fn decompose(magnitude: f64, count: u32) -> Option<(u64, i32)> {
    // log10(2) times the binary exponent is too low by at most one.
    let binary = ((magnitude.to_bits() >> 52) & 0x7FF) as i32 - 1023;
    let mut exponent = (binary * 1233) >> 12;
    if !(SMALLEST_EXPONENT..LARGEST_EXPONENT).contains(&exponent) {
        return None;
    }
    exponent += i32::from(magnitude >= scale(exponent + 1));
    let limit = WHOLE_POWERS[count as usize];
    let scaled = magnitude * scale(count as i32 - 1 - exponent);
    let mut mantissa = (scaled + 0.5) as i64 as u64;
    if mantissa >= limit {
        mantissa /= 10;
        exponent += 1;
    }
    Some((mantissa, exponent))
}

#[inline]
fn scale(power: i32) -> f64 {
    SCALES[(power - SCALE_START) as usize]
}

/// Sixteen ASCII digits of a number below 10^16, the first in the lowest byte.
#[inline(always)]
fn sixteen_digits(value: u64) -> u128 {
    let (high, low) = (value / 100_000_000, value % 100_000_000);
    u128::from(eight_digits(high)) | u128::from(eight_digits(low)) << 64
}

/// Eight ASCII digits of a number below 10^8, the first in the lowest byte.
#[inline(always)]
fn eight_digits(value: u64) -> u64 {
    // Four digits in each 32 bits, then two in each 16, then one in each 8; 10486/2^20 and 103/2^10 are 1/100 and 1/10 for
    // numbers of four and two digits (P. Khuong, *How to print integers really fast* (2017)).
    let fours = (value / 10_000) | ((value % 10_000) << 32);
    let hundreds = ((fours * 10_486) >> 20) & 0x7f_0000_007f;
    let twos = hundreds | ((fours - 100 * hundreds) << 16);
    let tens = ((twos * 103) >> 10) & 0x000f_000f_000f_000f;
    0x3030_3030_3030_3030 | tens | ((twos - 10 * tens) << 8)
}

/// A fixed number of bytes of a text from `at` on, to be set at once: a copy between slices is a call of memmove where
/// it is not inlined.
///
/// # Panics
/// If the text is shorter.
#[inline(always)]
pub(crate) fn chunk_at<const N: usize>(text: &mut [u8], at: usize) -> &mut [u8; N] {
    text[at..].first_chunk_mut().expect("room for a piece")
}

/// `0.00ddd`, `dd.ddd` or `dddd`. Bytes after the returned length are arbitrary.
///
/// Branch-free, as whether a number is below one is unpredictable.
#[inline(always)]
fn put_plain(
    text: &mut [u8; ROOM],
    start: usize,
    digits: u128,
    significant: usize,
    exponent: i32,
) -> usize {
    let below_one = exponent < 0;
    // Digits before the point, and zeros between the point and the first digit.
    let whole = (exponent + 1).max(0) as usize;
    let zeros = (-1 - exponent).max(0) as usize;
    let before = if below_one { ASCII_ZEROS } else { digits };
    let point = start + if below_one { 1 } else { whole };
    let after = point + 1 + zeros;
    *chunk_at(text, start) = before.to_le_bytes();
    *chunk_at(text, after) = (digits >> (8 * whole)).to_le_bytes();
    text[point] = b'.';
    if significant <= whole {
        return start + whole;
    }
    after + significant - whole
}

fn put_scientific(
    text: &mut [u8; ROOM],
    start: usize,
    digits: u128,
    significant: usize,
    exponent: i32,
) -> usize {
    let end = put_plain(text, start, digits, significant, 0);
    let exponent = format!("e{exponent}");
    text[end..end + exponent.len()].copy_from_slice(exponent.as_bytes());
    end + exponent.len()
}

/// Numbers far outside a recorder's range.
#[cold]
fn rare(value: f64, count: u32) -> String {
    let text = format!("{value:.*e}", count as usize - 1);
    // Infinity and NaN have no exponent.
    let Some((digits, exponent)) = text.split_once('e') else {
        return text;
    };
    let digits = if digits.contains('.') {
        digits.trim_end_matches('0').trim_end_matches('.')
    } else {
        digits
    };
    format!("{digits}e{exponent}")
}

/// Text of a finite number with this many significant digits.
///
/// ```
/// use torqcomp_decimal::digits::text;
/// assert_eq!((text(2.0 / 3.0, 4), text(1.5e-7, 12)), ("0.6667".to_owned(), "1.5e-7".to_owned()));
/// assert_eq!((text(1e300, 4), text(f64::INFINITY, 4)), ("1e300".to_owned(), "inf".to_owned()));
/// ```
#[must_use]
pub fn text(value: f64, significant: u32) -> String {
    let mut out = Vec::new();
    write(&mut out, value, Digits::Significant(significant));
    String::from_utf8(out).expect("digits are ASCII")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn usual_numbers() {
        for (value, digits, expected) in [
            (0.0, 12, "0"),
            (-0.0, 12, "0"),
            (1.0, 12, "1"),
            (-2.5, 12, "-2.5"),
            (100.0, 3, "100"),
            (123_456.0, 3, "123000"),
            (0.000_05, 12, "0.00005"),
            (1.0 / 3.0, 12, "0.333333333333"),
            (2.0 / 3.0, 12, "0.666666666667"),
            (0.999_999_999_999_9, 12, "1"),
            (9.996, 3, "10"),
            (1e15, 12, "1e15"),
            (1.5e-7, 12, "1.5e-7"),
            (-1.25e-12, 12, "-1.25e-12"),
            (123_456_789_012_345.0, 15, "123456789012345"),
            (1e300, 12, "1e300"),
            (-1.5e-300, 12, "-1.5e-300"),
            (5e-324, 3, "4.94e-324"),
        ] {
            assert_eq!(text(value, digits), expected, "{value} to {digits}");
        }
    }

    #[test]
    fn every_split_of_eight_digits() {
        for value in (0..100_000_000_u64).step_by(9973).chain([0, 9, 99_999_999]) {
            let digits = eight_digits(value).to_le_bytes();
            assert_eq!(std::str::from_utf8(&digits).unwrap(), format!("{value:08}"));
        }
    }

    proptest! {
        #[test]
        fn text_is_within_half_a_unit_of_the_last_digit(
            mantissa in 1.0..10.0_f64, exponent in -40..40_i32, minus: bool, count in 1_u32..=15,
        ) {
            let value = if minus { -1.0 } else { 1.0 } * mantissa * 10_f64.powi(exponent);
            let back: f64 = text(value, count).parse().unwrap();
            let unit = 10_f64.powi(value.abs().log10().floor() as i32 + 1 - count as i32);
            // Rounding of the product and of its factor: 1.5 ε of at most ten units of the first digit.
            let product = 1.5 * f64::EPSILON * 10_f64.powi(count as i32);
            // The comparison itself is accurate to a unit of the f64.
            prop_assert!((back - value).abs() <= (0.5 + product) * unit + f64::EPSILON * value.abs());
        }

        #[test]
        fn shortest_text_comes_back_exactly(value in any::<f64>()) {
            prop_assume!(value.is_finite());
            let mut out = Vec::new();
            write(&mut out, value, Digits::Shortest);
            let back: f64 = std::str::from_utf8(&out).unwrap().parse().unwrap();
            prop_assert_eq!(back.to_bits(), value.to_bits());
        }
    }
}
