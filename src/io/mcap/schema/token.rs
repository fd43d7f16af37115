//! Tokens of an IDL definition.

use super::SchemaError;

/// A word, a sign, a number or a quoted text, and its line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SchemaToken<'a> {
    /// As written; quoted text without its quotes.
    pub text: &'a str,
    /// Whether it was quoted.
    pub is_quoted: bool,
    /// Line, from 1.
    pub line: usize,
}

/// Splits a definition into tokens. Comments, preprocessor lines and lines of `=` are skipped.
///
/// # Errors
/// [`SchemaError`] if a quote or a comment is not closed.
pub fn tokens(text: &str) -> Result<Vec<SchemaToken<'_>>, SchemaError> {
    let mut tokens = Vec::new();
    let mut line = 1;
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = match first {
            '\n' => {
                line += 1;
                1
            }
            _ if first.is_whitespace() => first.len_utf8(),
            '/' if rest.starts_with("//") => to_line_end(rest),
            '/' if rest.starts_with("/*") => closed(rest, "*/", line)?,
            '#' => to_line_end(rest),
            '=' if rest.starts_with("====") => to_line_end(rest),
            '"' => {
                let length = quoted(rest, line)?;
                tokens.push(SchemaToken {
                    text: &rest[1..length - 1],
                    is_quoted: true,
                    line,
                });
                length
            }
            _ => {
                let length = word(rest);
                tokens.push(SchemaToken {
                    text: &rest[..length],
                    is_quoted: false,
                    line,
                });
                length
            }
        };
        if length > 1 {
            line += rest[..length].bytes().filter(|b| *b == b'\n').count();
        }
        rest = &rest[length..];
    }
    Ok(tokens)
}

fn to_line_end(text: &str) -> usize {
    text.find('\n').unwrap_or(text.len())
}

fn closed(text: &str, end: &str, line: usize) -> Result<usize, SchemaError> {
    text[2..]
        .find(end)
        .map(|at| at + 2 + end.len())
        .ok_or_else(|| SchemaError::at(line, "a comment is not closed"))
}

/// Length of a quoted text, including both quotes.
fn quoted(text: &str, line: usize) -> Result<usize, SchemaError> {
    let mut is_escaped = false;
    for (at, byte) in text.bytes().enumerate().skip(1) {
        match byte {
            _ if is_escaped => is_escaped = false,
            b'\\' => is_escaped = true,
            b'"' => return Ok(at + 1),
            _ => {}
        }
    }
    Err(SchemaError::at(line, "a quote is not closed"))
}

/// Length of a word including `::` and `.`, or of one sign.
fn word(text: &str) -> usize {
    let mut length = 0;
    while let Some(next) = text[length..].chars().next() {
        if next.is_alphanumeric() || next == '_' || next == '.' {
            length += next.len_utf8();
        } else if text[length..].starts_with("::") {
            length += 2;
        } else {
            break;
        }
    }
    match length {
        0 => text.chars().next().map_or(1, char::len_utf8),
        length => length,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_signs_quotes_and_comments() {
        let text = "#include \"x\"\nmodule a::b { /* no\n */ @unit(value=\"N \\\" m\") // no\n};";
        let found = tokens(text).unwrap();
        let words: Vec<_> = found.iter().map(|t| (t.text, t.line)).collect();
        assert_eq!(
            words,
            [
                ("module", 2),
                ("a::b", 2),
                ("{", 2),
                ("@", 3),
                ("unit", 3),
                ("(", 3),
                ("value", 3),
                ("=", 3),
                ("N \\\" m", 3),
                (")", 3),
                ("}", 4),
                (";", 4)
            ]
        );
    }

    #[test]
    fn what_is_open_is_said() {
        assert_eq!(tokens("a\n\"b").unwrap_err().line, Some(2));
        assert_eq!(tokens("/* b").unwrap_err().line, Some(1));
    }
}
