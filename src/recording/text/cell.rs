//! Content of a cell: a number (possibly with thousands separators), a date or time, a text,
//! nothing.

use torqcomp_decimal::number;

use super::clock::Clock;
use super::vocabulary::has;

/// Content of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell {
    /// A number.
    Number(f64),
    /// A number with thousands separators.
    Grouped(f64),
    /// A date, a time of day, or both.
    Clock(Clock),
    /// NaN, infinity and the like.
    NonFinite,
    /// Empty.
    Empty,
    /// Anything else.
    Text,
}

impl Cell {
    /// Parses a cell without surrounding quotes and spaces.
    pub fn read(text: &str, decimal: u8) -> Self {
        if text.is_empty() {
            return Self::Empty;
        }
        if let Some(plain) = with_plain_minus(text) {
            return Self::read(&plain, decimal);
        }
        if let Some(clock) = Clock::compact(text) {
            return Self::Clock(clock);
        }
        if let Some(value) = number::cell(text, decimal) {
            return Self::Number(value);
        }
        // + 0.123, as written by Graphtec.
        if let Some(rest) = text
            .strip_prefix(['+', '-'])
            .filter(|rest| rest.starts_with(' '))
            && let Some(value) =
                number::cell(rest, decimal).filter(|value| !value.is_sign_negative())
        {
            return Self::Number(if text.starts_with('-') { -value } else { value });
        }
        if let Some(value) = fortran(text, decimal) {
            return Self::Number(value);
        }
        if let Some(value) = grouped(text, decimal) {
            return Self::Grouped(value);
        }
        if is_non_finite(text) {
            return Self::NonFinite;
        }
        Clock::parse(text).map_or(Self::Text, Self::Clock)
    }

    /// Whether it can be part of a data row.
    pub fn is_datum(self) -> bool {
        !matches!(self, Self::Text | Self::Empty)
    }

    /// Whether it is a finite number.
    pub fn is_number(self) -> bool {
        matches!(self, Self::Number(_) | Self::Grouped(_))
    }
}

/// A number with a typographic minus sign (U+2212) or an en dash: `−0.5`, `1.5e–03`.
fn with_plain_minus(text: &str) -> Option<String> {
    // As in nearly every cell.
    if text.is_ascii() {
        return None;
    }
    let is_long = |c: char| matches!(c, '\u{2212}' | '\u{2013}');
    let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | ',' | '∞');
    let mut plain = String::with_capacity(text.len());
    let mut characters = text.chars().peekable();
    while let Some(c) = characters.next() {
        let is_sign = is_long(c)
            && (plain.is_empty() || plain.ends_with(['e', 'E']))
            && characters.peek().is_some_and(|next| is_number(*next));
        plain.push(if is_sign { '-' } else { c });
    }
    (plain != text).then_some(plain)
}

/// Number format that prevents time stamps from being copied verbatim.
pub fn foreign_spelling(stamps: &[f64], text: &[u8]) -> Option<&'static str> {
    if has_fortran_exponent(text) {
        return Some("its numbers have exponents of Fortran");
    }
    let is_negative = stamps.iter().any(|t| *t < 0.0);
    (is_negative && has_typeset_minus(text)).then_some("its time stamps have a typeset minus")
}

/// Whether some number may have a typographic minus sign, which must not be copied to a result.
fn has_typeset_minus(text: &[u8]) -> bool {
    let spellings = [&b"\xE2\x88\x92"[..], b"\xE2\x80\x93", b"\x96"];
    let mut spellings = spellings.into_iter();
    spellings.any(|minus| memchr::memmem::find(text, minus).is_some())
}

/// Whether some number has a Fortran exponent (`1.5D-03`), which must not be copied to a result.
fn has_fortran_exponent(text: &[u8]) -> bool {
    let is_exponent = |part: &[u8]| {
        matches!(part, [before, b'D' | b'd', b'+' | b'-', after]
            if (before.is_ascii_digit() || *before == b'.') && after.is_ascii_digit())
    };
    text.windows(4).any(is_exponent)
}

/// Whether a cell means not-a-number: NaN, infinity and their Windows spellings.
fn is_not_a_number(cell: &str) -> bool {
    const WORDS: [&str; 6] = ["nan", "inf", "infinity", "1.#qnan", "1.#ind", "1.#inf"];
    let text = cell.trim_start_matches(['+', '-']);
    WORDS.iter().any(|word| text.eq_ignore_ascii_case(word))
}

/// `1.5D-03`, as written by Fortran programs in double precision.
fn fortran(text: &str, decimal: u8) -> Option<f64> {
    let (mantissa, exponent) = text.split_once(['D', 'd'])?;
    let ends_in_digit = mantissa.ends_with(|c: char| c.is_ascii_digit() || c == '.');
    let is_exponent = exponent
        .trim_start_matches(['+', '-'])
        .bytes()
        .all(|b| b.is_ascii_digit());
    if !ends_in_digit || !is_exponent {
        return None;
    }
    number::cell(&format!("{mantissa}e{exponent}"), decimal)
}

/// Texts for missing numbers other than those of floating point: over range, no value.
pub fn is_non_finite(text: &str) -> bool {
    is_not_a_number(text)
        || has_windows_mark(text)
        || has("missing numbers", &text.to_lowercase())
        || exceeds(text)
        || is_instruments_mark(text)
        || is_over_range(text)
}

/// `1.#QNAN` and `-1,#IND`, as written by older C libraries on Windows, with the decimal mark of the system.
fn has_windows_mark(text: &str) -> bool {
    let number = text.strip_prefix('-').unwrap_or(text);
    ["1.#", "1,#"].iter().any(|mark| number.starts_with(mark))
}

/// Whether a cell contains a number that instruments use for a missing value.
pub fn is_instruments_mark(text: &str) -> bool {
    let plain = text.replace(',', ".");
    text.contains(|c: char| c.is_ascii_digit())
        && plain.parse().is_ok_and(number::is_instruments_mark)
}

/// Whether a cell says that the input exceeded the range of the recorder: `∞`, `OVLD`, and Graphtec's `+++++++` and
/// `-------`.
pub fn is_over_range(text: &str) -> bool {
    let all = |sign: u8| text.len() > 3 && text.bytes().all(|byte| byte == sign);
    all(b'+') || all(b'-') || has("over range", &text.to_lowercase())
}

/// A number that overflows an `f64`, such as 1e999.
fn exceeds(text: &str) -> bool {
    text.as_bytes()
        .iter()
        .all(|b| b.is_ascii_digit() || b"+-.,eE".contains(b))
        && text
            .replace(',', ".")
            .parse::<f64>()
            .is_ok_and(f64::is_infinite)
}

/// A number with thousands separators: `1,234.5`, `1.234,5`, `1'234`, `1 234`. The first group does
/// not begin with zero and has up to three digits, the others have three, and all separators are the
/// same.
fn grouped(text: &str, decimal: u8) -> Option<f64> {
    let body = text.trim_start_matches(['+', '-']);
    let end = body
        .find(|c: char| c == char::from(decimal) || c == 'e' || c == 'E')
        .unwrap_or(body.len());
    let whole = &body[..end];
    let mark = whole.chars().find(|c| !c.is_ascii_digit())?;
    let is_mark = match mark {
        '.' | ',' => mark != char::from(decimal),
        '\'' | '’' | ' ' | '\u{a0}' | '\u{202f}' => true,
        _ => false,
    };
    let mut groups = whole.split(mark);
    let first = groups.next()?;
    let digits = |group: &str| group.bytes().all(|b| b.is_ascii_digit());
    let good = is_mark
        && (1..=3).contains(&first.len())
        && digits(first)
        && !first.starts_with('0')
        && groups.all(|group| group.len() == 3 && digits(group));
    if !good {
        return None;
    }
    let sign = &text[..text.len() - body.len()];
    let digits: String = whole.chars().filter(|c| *c != mark).collect();
    number::cell(&format!("{sign}{digits}{}", &body[end..]), decimal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands() {
        for (text, decimal, value) in [
            ("1,234.5", b'.', 1234.5),
            ("-12,345,678", b'.', -12_345_678.0),
            ("1.234,5", b',', 1234.5),
            ("1'234.25", b'.', 1234.25),
            ("1 234,5", b',', 1234.5),
            ("1\u{a0}234", b'.', 1234.0),
        ] {
            assert_eq!(Cell::read(text, decimal), Cell::Grouped(value), "{text}");
        }
        for text in [
            "0,981",
            "12,34",
            "1,2345",
            "1,234,56",
            "1,234.567,8",
            "a,123",
        ] {
            assert_eq!(Cell::read(text, b'.'), Cell::Text, "{text}");
        }
    }

    #[test]
    fn other_cells() {
        assert_eq!(Cell::read("1.5", b'.'), Cell::Number(1.5));
        assert_eq!(Cell::read("", b'.'), Cell::Empty);
        assert_eq!(Cell::read("-1.5D-03", b'.'), Cell::Number(-0.0015));
        assert_eq!(Cell::read("15D", b'.'), Cell::Text);
        for (text, value) in [
            ("\u{2212}0.25", -0.25),
            ("\u{2013}.5", -0.5),
            ("\u{2212}1.5e\u{2212}03", -0.0015),
            ("9.8e37", 9.8e37),
        ] {
            assert_eq!(Cell::read(text, b'.'), Cell::Number(value), "{text}");
        }
        for text in ["10\u{2013}20", "\u{2212}", "\u{2013}", "a\u{2212}1"] {
            assert_eq!(Cell::read(text, b'.'), Cell::Text, "{text}");
        }
        for text in [
            "NaN",
            "-∞",
            "\u{2212}∞",
            "-1.#IND",
            "1e999",
            "N/A",
            "BURNOUT",
            "+++++++",
            "-------",
            "----",
            "OL",
            "OVLD",
            "Overload",
            "#N/A",
            "9.91E+37",
            "+9.900000E+37",
            "-9.9e37",
            "9.90999998e37",
            "99000000000000000000000000000000000000",
        ] {
            assert_eq!(Cell::read(text, b'.'), Cell::NonFinite, "{text}");
        }
        assert!(matches!(Cell::read("12:00:01", b'.'), Cell::Clock(_)));
        assert_eq!(Cell::read("LOST COMMUNICATION", b'.'), Cell::Text);
    }
}
