//! `f64` to decimal text with a fixed number of significant digits.

/// Significant digits that are written unless asked otherwise.
///
/// A rounding of 5·10⁻¹² relative is far below any recorder's resolution, and below the 10⁻⁹ to
/// which a compensation is exact.
pub const DEFAULT_DIGITS: Digits = Digits::Significant(12);

/// How many digits are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Digits {
    /// That many significant digits, 1 to 15, trailing zeros left out.
    Significant(u32),
    /// As few as bring back the same `f64`.
    Shortest,
}

/// Decimal exponents that the quick way covers; the rest is rare and takes the library's way.
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

/// Largest plain notation: above it, and below `1e-5`, the text has an exponent.
const LARGEST_PLAIN: i32 = 15;
const SMALLEST_PLAIN: i32 = -5;

/// Appends a finite number.
///
/// With [`Digits::Significant`] the last digit is rounded to within 0.51 of a unit: one product of
/// two correctly rounded factors stands between the value and its digits.
#[inline]
pub fn write(out: &mut Vec<u8>, value: f64, digits: Digits) {
    match digits {
        Digits::Significant(count) => write_significant(out, value, count),
        Digits::Shortest => out.extend_from_slice(zmij::Buffer::new().format(value).as_bytes()),
    }
}

#[inline]
fn write_significant(out: &mut Vec<u8>, value: f64, count: u32) {
    if value == 0.0 {
        out.push(b'0');
        return;
    }
    let magnitude = value.abs();
    let Some((mantissa, exponent)) = decompose(magnitude, count as i32) else {
        return write_rare(out, value, count);
    };
    // The text is put together in a fixed buffer: sign, zeros or digits, point, digits.
    let mut text = [b'0'; 48];
    let mut length = 0;
    if value < 0.0 {
        text[0] = b'-';
        length = 1;
    }
    let mut digits = [b'0'; 16];
    sixteen_digits(mantissa, &mut digits);
    let digits = &digits[16 - count as usize..];
    let significant = count as usize - trailing_zeros(digits);
    let digits = &digits[..significant];
    if (SMALLEST_PLAIN..LARGEST_PLAIN).contains(&exponent) {
        length = place_plain(&mut text, length, digits, exponent);
    } else {
        length = place_scientific(&mut text, length, digits, exponent);
    }
    out.extend_from_slice(&text[..length]);
}

/// Integer of `count` digits and decimal exponent with `value ≈ d.ddd × 10^exponent`.
#[inline]
fn decompose(magnitude: f64, count: i32) -> Option<(u64, i32)> {
    // log10(2) times the binary exponent is at most one too low.
    let binary = ((magnitude.to_bits() >> 52) & 0x7FF) as i32 - 1023;
    let mut exponent = (binary * 1233) >> 12;
    if !(SMALLEST_EXPONENT..LARGEST_EXPONENT).contains(&exponent) {
        return None;
    }
    if magnitude >= scale(exponent + 1) {
        exponent += 1;
    }
    let limit = scale(count) as u64;
    let mut mantissa = (magnitude * scale(count - 1 - exponent) + 0.5) as u64;
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

/// Writes a number below 10^16 with leading zeros.
#[inline]
fn sixteen_digits(value: u64, out: &mut [u8; 16]) {
    let high = eight_digits(value / 100_000_000);
    let low = eight_digits(value % 100_000_000);
    out[..8].copy_from_slice(&high.to_le_bytes());
    out[8..].copy_from_slice(&low.to_le_bytes());
}

/// Eight ASCII digits of a number below 10^8, the first in the lowest byte: fours, pairs, digits,
/// each split for all parts at once by multiplying with a rounded reciprocal.
#[inline]
fn eight_digits(value: u64) -> u64 {
    let high = value / 10_000;
    let fours = high | ((value - high * 10_000) << 32);
    let hundreds = ((fours * 10_486) >> 20) & 0x0000_007F_0000_007F;
    let pairs = hundreds | ((fours - hundreds * 100) << 16);
    let tens = ((pairs * 103) >> 10) & 0x000F_000F_000F_000F;
    let digits = tens | ((pairs - tens * 10) << 8);
    digits | 0x3030_3030_3030_3030
}

#[inline]
fn trailing_zeros(digits: &[u8]) -> usize {
    let zeros = digits.iter().rev().take_while(|d| **d == b'0').count();
    zeros.min(digits.len() - 1)
}

#[inline]
fn place_plain(text: &mut [u8; 48], start: usize, digits: &[u8], exponent: i32) -> usize {
    if exponent < 0 {
        // "0." and zeros are there already but for the point.
        let first = start + 1 + exponent.unsigned_abs() as usize;
        text[start + 1] = b'.';
        text[first..first + digits.len()].copy_from_slice(digits);
        return first + digits.len();
    }
    let whole = exponent as usize + 1;
    if digits.len() <= whole {
        text[start..start + digits.len()].copy_from_slice(digits);
        return start + whole;
    }
    text[start..start + whole].copy_from_slice(&digits[..whole]);
    text[start + whole] = b'.';
    let end = start + digits.len() + 1;
    text[start + whole + 1..end].copy_from_slice(&digits[whole..]);
    end
}

fn place_scientific(text: &mut [u8; 48], start: usize, digits: &[u8], exponent: i32) -> usize {
    let mut end = place_plain(text, start, digits, 0);
    text[end] = b'e';
    end += 1;
    if exponent < 0 {
        text[end] = b'-';
        end += 1;
    }
    let magnitude = exponent.unsigned_abs() as u8;
    if magnitude >= 10 {
        text[end] = b'0' + magnitude / 10;
        end += 1;
    }
    text[end] = b'0' + magnitude % 10;
    end + 1
}

/// Numbers far outside a recorder's range.
#[cold]
fn write_rare(out: &mut Vec<u8>, value: f64, count: u32) {
    let text = format!("{value:.*e}", count as usize - 1);
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let digits = if digits.contains('.') {
        digits.trim_end_matches('0').trim_end_matches('.')
    } else {
        digits
    };
    out.extend_from_slice(digits.as_bytes());
    out.push(b'e');
    out.extend_from_slice(exponent.as_bytes());
}

/// Text of a finite number with that many significant digits.
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
            // The comparison itself is good to a few units of the f64.
            prop_assert!((back - value).abs() <= 0.51 * unit + 4.0 * f64::EPSILON * value.abs());
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
