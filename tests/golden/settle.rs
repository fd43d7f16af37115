//! Normalisation of numbers in texts, so that the same result gives the same text on any machine.

use std::fmt::Write as _;

/// Number of significant digits kept.
const DIGITS: usize = 9;
/// Number of rows written for a table longer than [`LONG`].
const KEPT: usize = 16;
const LONG: usize = 48;
/// Relative difference of numbers that count as equal, unless a golden file says otherwise.
const TOLERANCE: f64 = 1e-6;
/// Magnitude below which a number is zero within rounding.
const ZERO: f64 = 1e-11;

/// A text with its decimal numbers rounded and the middle of its long tables replaced by sums; a page without the
/// hashes of its inputs, whose last digits differ between machines, and without style and script, which are files of
/// their own.
pub fn readable(content: &str) -> String {
    let content = &without(
        "<script>",
        "</script>",
        &without("<style>", "</style>", content),
    );
    let content = &without_sums(content);
    let lines: Vec<&str> = content.split_inclusive('\n').collect();
    let mut text = String::new();
    let mut at = 0;
    while at < lines.len() {
        let columns = row(lines[at]).map(|cells| cells.len());
        let alike = |line: &&&str| row(line).map(|cells| cells.len()) == columns;
        let count = match columns {
            Some(_) => lines[at..].iter().take_while(alike).count(),
            None => 1,
        };
        table(&mut text, &lines[at..at + count]);
        at += count;
    }
    text
}

/// A page without the text between two marks.
fn without(from: &str, to: &str, content: &str) -> String {
    let is_page = content.starts_with("<!DOCTYPE");
    match (content.split_once(from), content.split_once(to)) {
        (Some((before, _)), Some((_, after))) if is_page => format!("{before}{from}…{to}{after}"),
        _ => content.to_owned(),
    }
}

/// A text without hexadecimal SHA-256 sums.
fn without_sums(content: &str) -> String {
    const MARK: &str = "SHA-256 ";
    let mut parts = content.split(MARK);
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let digits = part.bytes().take_while(u8::is_ascii_hexdigit).count();
        text.push_str(MARK);
        text.push_str(if digits == 64 { "(sum)" } else { "" });
        text.push_str(if digits == 64 { &part[64..] } else { part });
    }
    text
}

/// The cells of a line that contains only numbers.
fn row(line: &str) -> Option<Vec<f64>> {
    let cell = |cell: &str| match cell {
        "" => Some(0.0),
        _ => cell.parse().ok(),
    };
    let cells: Option<Vec<f64>> = line.trim_end().split(',').map(cell).collect();
    cells.filter(|cells| cells.len() > 1)
}

/// Lines; if there are many, some of them, with the sums of magnitudes of those between.
fn table(text: &mut String, lines: &[&str]) {
    if lines.len() <= LONG {
        lines.iter().for_each(|line| text.push_str(&rounded(line)));
        return;
    }
    let mut next = 0;
    for kept in 0..KEPT {
        let at = kept * (lines.len() - 1) / (KEPT - 1);
        let between = &lines[next..at];
        if !between.is_empty() {
            let mut sums = Vec::new();
            for line in between {
                let cells = row(line).expect("rows were looked for");
                sums.resize(cells.len(), 0.0);
                sums.iter_mut()
                    .zip(cells)
                    .for_each(|(sum, x): (&mut f64, f64)| *sum += x.abs());
            }
            let sums: Vec<String> = sums.iter().map(|sum| format!("{sum:.8e}")).collect();
            let _ = writeln!(
                text,
                "({} rows with sums of magnitudes {})",
                between.len(),
                sums.join(" ")
            );
        }
        text.push_str(&rounded(lines[at]));
        next = at + 1;
    }
}

/// A line with its decimal numbers rounded.
fn rounded(line: &str) -> String {
    tokens(line)
        .map(|token| match token {
            Token::Number(number) if significant(number) > DIGITS => round(number),
            Token::Number(text) | Token::Text(text) => text.to_owned(),
        })
        .collect()
}

/// Significant digits that a number is written with.
fn significant(number: &str) -> usize {
    let mantissa = number.split(['e', 'E']).next().unwrap_or_default();
    let digits = mantissa.trim_start_matches(['-', '0', '.']);
    digits.bytes().filter(u8::is_ascii_digit).count()
}

fn round(number: &str) -> String {
    let value: f64 = number.parse().expect("tokens are numbers");
    let value: f64 = format!("{value:.*e}", DIGITS - 1)
        .parse()
        .expect("a number");
    if number.contains(['e', 'E']) {
        format!("{value:e}")
    } else {
        format!("{value:?}")
    }
}

/// The actual text, with lines replaced by those of the golden file if they differ by no more than
/// rounding.
pub fn settle(expected: &str, actual: &str) -> String {
    let told = expected.lines().take_while(|line| line.starts_with("# "));
    let tolerance = told
        .filter_map(|line| line.strip_prefix("# tolerance "))
        .find_map(|number| number.parse().ok())
        .unwrap_or(TOLERANCE);
    let mut golden = expected.split_inclusive('\n');
    actual
        .split_inclusive('\n')
        .map(|line| match golden.next() {
            Some(golden) if equal(golden, line, tolerance) => golden,
            _ => line,
        })
        .collect()
}

fn equal(a: &str, b: &str, tolerance: f64) -> bool {
    let (mut a, mut b) = (tokens(a), tokens(b));
    loop {
        match (a.next(), b.next()) {
            (None, None) => return true,
            (Some(Token::Text(a)), Some(Token::Text(b))) if a == b => {}
            (Some(Token::Number(a)), Some(Token::Number(b))) if a == b || near(a, b, tolerance) => {
            }
            _ => return false,
        }
    }
}

fn near(a: &str, b: &str, tolerance: f64) -> bool {
    // A number with nine digits before the point is a time stamp or a count.
    let exact = |number: &str| number.find('.').is_some_and(|point| point >= 9);
    match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(x), Ok(y)) if !exact(a) && !exact(b) => {
            let size = x.abs().max(y.abs());
            (x - y).abs() <= tolerance * size || size <= ZERO
        }
        _ => false,
    }
}

/// Pieces of a line.
#[derive(Clone, Copy)]
enum Token<'a> {
    Text(&'a str),
    /// A decimal number: with a point or an exponent.
    Number(&'a str),
}

/// The pieces of a line. Integers are text: a changed count is a different result.
fn tokens(line: &str) -> impl Iterator<Item = Token<'_>> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let rest = &line[at..];
        if rest.is_empty() {
            return None;
        }
        let mut begin = 0;
        while begin < rest.len() {
            let before = line[..at + begin].bytes().last();
            let length = number(&rest[begin..], before);
            if length > 0 {
                break;
            }
            begin += rest[begin..].chars().next().map_or(1, char::len_utf8);
        }
        if begin > 0 {
            at += begin;
            return Some(Token::Text(&rest[..begin]));
        }
        let length = number(rest, line[..at].bytes().last());
        at += length;
        Some(Token::Number(&rest[..length]))
    })
}

/// Length of the decimal number at the start of a text, 0 if there is none.
fn number(text: &str, before: Option<u8>) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| {
        bytes[from..]
            .iter()
            .take_while(|b| b.is_ascii_digit())
            .count()
    };
    let sign = usize::from(bytes[0] == b'-' && !before.is_some_and(|b| b.is_ascii_alphanumeric()));
    let inside = sign == 0 && before.is_some_and(|b| b.is_ascii_digit() || b == b'.' || b == b'#');
    let whole = digits(sign);
    if whole == 0 || inside {
        return 0;
    }
    let mut end = sign + whole;
    let mut decimal = false;
    if bytes.get(end) == Some(&b'.') && digits(end + 1) > 0 {
        end += 1 + digits(end + 1);
        decimal = true;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'-' | b'+')));
        if end + 1 + sign < bytes.len() && digits(end + 1 + sign) > 0 {
            end += 1 + sign + digits(end + 1 + sign);
            decimal = true;
        }
    }
    if decimal { end } else { 0 }
}

#[test]
fn rounding_is_settled_and_everything_else_is_not() {
    let golden = "a 1.00000000 b 12\nx -3e-15,2\n";
    assert_eq!(settle(golden, "a 1.00000001 b 12\nx 1.5e-16,2\n"), golden);
    for other in [
        "a 1.00001 b 12\n",
        "a 1.00000000 b 13\n",
        "a 1.00000000 c 12\n",
    ] {
        assert_eq!(settle(golden, other), other);
    }
    assert_eq!(
        settle("# tolerance 1e-2\n1.0\n", "# tolerance 1e-2\n1.001\n"),
        "# tolerance 1e-2\n1.0\n"
    );
    assert_eq!(settle("1700000000.5\n", "1700000000.6\n"), "1700000000.6\n");
    assert_eq!(
        readable("M1.23456789012,4e5 #4e5 2024-01-02 0.1\n"),
        "M1.23456789,4e5 #4e5 2024-01-02 0.1\n"
    );
    let rows: String = (0..100).map(|i| format!("{i},0.5\n")).collect();
    let short = readable(&rows);
    assert!(
        short.starts_with(
            "0,0.5\n(5 rows with sums of magnitudes 1.50000000e1 2.50000000e0)\n6,0.5\n"
        ),
        "{short}"
    );
    assert!(short.ends_with("99,0.5\n"));
}
