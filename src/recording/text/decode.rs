//! Bytes of any encoding and with any line ends to text with line feeds.

use super::encoding;
use crate::failure::Failure;
use crate::warning::Warning;

/// Bytes whose lines end with a line feed: UTF-8, or a superset of ASCII with one byte a character.
#[derive(Debug, Clone, PartialEq)]
pub struct Text {
    /// The bytes.
    pub bytes: Vec<u8>,
    /// What was unusual, for the name of the dialect: `UTF-16`, `lines end with CR`.
    pub oddities: Vec<&'static str>,
    /// What was wrong and passed over.
    pub warnings: Vec<Warning>,
}

/// Bytes that the encoding and the line ends are told from.
const HEAD: usize = 1 << 16;

/// Decodes a file.
///
/// # Errors
/// If it is another format that is often handed over in place of text, or binary.
pub fn decode(bytes: Vec<u8>) -> Result<Text, Failure> {
    let mut oddities = Vec::new();
    let mut warnings = Vec::new();
    let mut bytes = match utf16(&bytes) {
        Some(is_big) => {
            oddities.push(if is_big { "UTF-16 BE" } else { "UTF-16 LE" });
            from_utf16(&bytes, is_big)
        }
        None => bytes,
    };
    crate::io::csv::refuse_other_formats(&bytes[..bytes.len().min(HEAD)])?;
    if bytes.starts_with(b"\xEF\xBB\xBF") {
        bytes.drain(..3);
    }
    let zeros = memchr::memchr_iter(0, &bytes).count();
    if zeros > 0 {
        bytes.retain(|byte| *byte != 0);
        warnings.push(Warning::new(
            "zero-bytes",
            format!("{zeros} zero byte(s) stand in the text; they were left out"),
        ));
    }
    if let Some(encoding) = encoding::told(&bytes[..bytes.len().min(HEAD)]) {
        oddities.push(encoding::name(encoding));
        let (text, has_faults) = encoding.decode_without_bom_handling(&bytes);
        if has_faults {
            warnings.push(Warning::new(
                "unreadable-characters",
                format!(
                    "some bytes are no characters of {}; they were replaced by \u{FFFD}",
                    encoding::name(encoding)
                ),
            ));
        }
        bytes = text.into_owned().into_bytes();
    }
    while bytes.last() == Some(&0x1A) {
        bytes.pop();
    }
    if let Some(oddity) = line_ends(&mut bytes) {
        oddities.push(oddity);
    }
    Ok(Text {
        bytes,
        oddities,
        warnings,
    })
}

/// Whether it is UTF-16, and then whether the high byte comes first: by its mark, or by every second
/// byte of the head being zero.
fn utf16(bytes: &[u8]) -> Option<bool> {
    if bytes.starts_with(b"\xFF\xFE") {
        return Some(false);
    }
    if bytes.starts_with(b"\xFE\xFF") {
        return Some(true);
    }
    let head = &bytes[..bytes.len().min(HEAD) & !1];
    let zeros = |first: usize| {
        head.iter()
            .skip(first)
            .step_by(2)
            .filter(|byte| **byte == 0)
            .count()
    };
    let (even, odd) = (zeros(0), zeros(1));
    let most = head.len() / 2 * 9 / 10;
    if head.len() < 8 {
        None
    } else if odd > most && even == 0 {
        Some(false)
    } else if even > most && odd == 0 {
        Some(true)
    } else {
        None
    }
}

fn from_utf16(bytes: &[u8], is_big: bool) -> Vec<u8> {
    let units = bytes.chunks_exact(2).map(|pair| {
        let pair = [pair[0], pair[1]];
        if is_big {
            u16::from_be_bytes(pair)
        } else {
            u16::from_le_bytes(pair)
        }
    });
    let mut text = String::with_capacity(bytes.len() / 2);
    text.extend(char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)));
    let text = text.into_bytes();
    match text.strip_prefix(b"\xEF\xBB\xBF") {
        Some(rest) => rest.to_vec(),
        None => text,
    }
}

/// Brings line ends of CR alone and of CR CR LF to LF. CR LF stays: the readers take it.
fn line_ends(bytes: &mut Vec<u8>) -> Option<&'static str> {
    let head = &bytes[..bytes.len().min(HEAD)];
    if memchr::memmem::find(head, b"\r\r\n").is_some() {
        let mut out = Vec::with_capacity(bytes.len());
        let mut rest = bytes.as_slice();
        while let Some(at) = memchr::memmem::find(rest, b"\r\r\n") {
            out.extend_from_slice(&rest[..at]);
            out.push(b'\n');
            rest = &rest[at + 3..];
        }
        out.extend_from_slice(rest);
        *bytes = out;
        return Some("lines end with CR CR LF");
    }
    if !head.contains(&b'\n') && head.contains(&b'\r') {
        for byte in bytes.iter_mut().filter(|byte| **byte == b'\r') {
            *byte = b'\n';
        }
        return Some("lines end with CR");
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(bytes: &[u8]) -> String {
        String::from_utf8(decode(bytes.to_vec()).unwrap().bytes).unwrap()
    }

    #[test]
    fn encodings_and_marks() {
        assert_eq!(text(b"\xEF\xBB\xBFa,b\n"), "a,b\n");
        let wide = |big: bool| -> Vec<u8> {
            "Zeit;\u{b5}m\n1;2\n"
                .encode_utf16()
                .flat_map(|u| {
                    if big {
                        u.to_be_bytes()
                    } else {
                        u.to_le_bytes()
                    }
                })
                .collect()
        };
        for (mark, big) in [(&b"\xFF\xFE"[..], false), (b"\xFE\xFF", true), (b"", false)] {
            let bytes = [mark, &wide(big)].concat();
            assert_eq!(text(&bytes), "Zeit;\u{b5}m\n1;2\n", "{mark:?} {big}");
        }
    }

    #[test]
    fn line_ends_and_stray_bytes() {
        assert_eq!(text(b"a\r\r\n1\r\r\n"), "a\n1\n");
        assert_eq!(text(b"a\r1\r2\r"), "a\n1\n2\n");
        assert_eq!(text(b"a\r\n1\r\n\x1A"), "a\r\n1\r\n");
        let mut long = b"a,b\n".repeat(100);
        long[4] = 0;
        let found = decode(long).unwrap();
        assert_eq!(found.warnings[0].code, "zero-bytes");
    }

    #[test]
    fn other_formats_are_named() {
        let error = decode(b"PK\x03\x04......".to_vec()).unwrap_err();
        assert!(error.to_string().contains("zip"), "{error}");
    }
}
