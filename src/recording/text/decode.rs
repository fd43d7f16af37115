//! Conversion of any encoding and line end to UTF-8 lines with line feeds, piece by piece. Windows-1252 and
//! UTF-8 are unchanged: [`crate::recording::text::dialect::decode_line`] reads both.

use std::io::{self, Read};

use encoding_rs::{Decoder, Encoding, UTF_16BE, UTF_16LE};

use super::encoding;
use crate::failure::{ErrorCode, Failure};
use crate::warning::{Warning, WarningCode};

/// Number of bytes decoded at a time.
const PIECE: usize = 1 << 16;
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Decoding of the bytes of a text.
#[derive(Debug)]
pub struct Decoding {
    encoding: Option<&'static Encoding>,
    line_ends: LineEnds,
    /// Unusual properties, for the description of the dialect: `UTF-16 LE`, `lines end with CR`.
    pub oddities: Vec<&'static str>,
    /// Warnings about the head.
    pub warnings: Vec<Warning>,
}

/// Line ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LineEnds {
    /// LF, or CR LF, which is treated like it.
    Lf,
    Cr,
    CrCrLf,
}

impl Decoding {
    /// Detects the decoding from the first bytes of a file.
    ///
    /// # Errors
    /// If it is another format commonly supplied instead of text, or binary.
    pub fn of(head: &[u8]) -> Result<Self, Failure> {
        let (mut oddities, mut warnings) = (Vec::new(), Vec::new());
        refuse_binary(head)?;
        let encoding = utf16(head).or_else(|| encoding::told(head));
        let mut text = head.to_vec();
        if let Some(encoding) = encoding {
            oddities.push(encoding::name(encoding));
            let last_line = head.iter().rposition(|byte| *byte == b'\n');
            let whole = last_line.map_or(head, |end| &head[..end]);
            let (decoded, has_faults) = encoding.decode_with_bom_removal(whole);
            if has_faults && !is_wide(encoding) {
                warnings.push(WarningCode::UnreadableCharacters.warning(format!(
                    "some bytes are not valid {}; they were replaced by \u{FFFD}",
                    encoding::name(encoding)
                )));
            }
            text = decoded.into_owned().into_bytes();
            refuse_other_formats(&text)?;
        }
        let line_ends = LineEnds::of(&text);
        oddities.extend(match line_ends {
            LineEnds::Lf => None,
            LineEnds::Cr => Some("lines end with CR"),
            LineEnds::CrCrLf => Some("lines end with CR CR LF"),
        });
        Ok(Self {
            encoding,
            line_ends,
            oddities,
            warnings,
        })
    }

    /// The text of an input whose first bytes were already read.
    pub fn reader(&self, mut head: Vec<u8>, input: Box<dyn Read + Send>) -> Box<dyn Read + Send> {
        if head.starts_with(BYTE_ORDER_MARK) {
            head.drain(..BYTE_ORDER_MARK.len());
        }
        let input = Box::new(io::Cursor::new(head).chain(input));
        if self.encoding.is_none() && self.line_ends == LineEnds::Lf {
            return input;
        }
        Box::new(Decoded {
            input,
            decoder: self.encoding.map(Encoding::new_decoder_with_bom_removal),
            line_ends: self.line_ends,
            raw: vec![0; PIECE],
            text: Vec::new(),
            at: 0,
            at_end: false,
        })
    }
}

/// An input converted to UTF-8 with LF line ends.
struct Decoded {
    input: Box<dyn Read + Send>,
    decoder: Option<Decoder>,
    line_ends: LineEnds,
    raw: Vec<u8>,
    /// Decoded text, and how much of it was output.
    text: Vec<u8>,
    at: usize,
    at_end: bool,
}

impl Read for Decoded {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        while self.at == self.text.len() && !self.at_end {
            self.refill()?;
        }
        let count = out.len().min(self.text.len() - self.at);
        out[..count].copy_from_slice(&self.text[self.at..self.at + count]);
        self.at += count;
        Ok(count)
    }
}

impl Decoded {
    fn refill(&mut self) -> io::Result<()> {
        let count = self.input.read(&mut self.raw)?;
        self.at_end = count == 0;
        let raw = &self.raw[..count];
        let mut text = match &mut self.decoder {
            None => raw.to_vec(),
            Some(decoder) => {
                let most = decoder.max_utf8_buffer_length(count).unwrap_or(4 * count);
                let mut text = String::with_capacity(most);
                let (_, _, has_faults) = decoder.decode_to_string(raw, &mut text, self.at_end);
                // An incomplete character at the end of a truncated file.
                if self.at_end && has_faults && is_wide(decoder.encoding()) {
                    text.truncate(text.trim_end_matches('\u{FFFD}').len());
                }
                text.into_bytes()
            }
        };
        match self.line_ends {
            LineEnds::Lf => {}
            LineEnds::CrCrLf => text.retain(|byte| *byte != b'\r'),
            LineEnds::Cr => text
                .iter_mut()
                .filter(|byte| **byte == b'\r')
                .for_each(|byte| *byte = b'\n'),
        }
        (self.text, self.at) = (text, 0);
        Ok(())
    }
}

impl LineEnds {
    fn of(text: &[u8]) -> Self {
        if memchr::memmem::find(text, b"\r\r\n").is_some() {
            Self::CrCrLf
        } else if !text.contains(&b'\n') && text.contains(&b'\r') {
            Self::Cr
        } else {
            Self::Lf
        }
    }
}

fn is_wide(encoding: &'static Encoding) -> bool {
    encoding == UTF_16LE || encoding == UTF_16BE
}

/// UTF-16, by its byte order mark or by every second byte of the head being zero.
fn utf16(head: &[u8]) -> Option<&'static Encoding> {
    if head.starts_with(b"\xFF\xFE") {
        return Some(UTF_16LE);
    }
    if head.starts_with(b"\xFE\xFF") {
        return Some(UTF_16BE);
    }
    let pairs = head.chunks_exact(2);
    let most = pairs.len() * 9 / 10;
    let [even, odd] = [0, 1].map(|place| pairs.clone().filter(|pair| pair[place] == 0).count());
    match head.len() {
        ..8 => None,
        _ if odd > most && even == 0 => Some(UTF_16LE),
        _ if even > most && odd == 0 => Some(UTF_16BE),
        _ => None,
    }
}

/// Rejects a non-text file by its first bytes.
///
/// # Errors
/// If it is another format commonly supplied instead of text, or binary.
pub fn refuse_binary(head: &[u8]) -> Result<(), Failure> {
    match utf16(head) {
        Some(_) => Ok(()),
        None => refuse_other_formats(head),
    }
}

/// Rejects formats commonly supplied instead of text, by name.
fn refuse_other_formats(head: &[u8]) -> Result<(), Failure> {
    let known: [(&[u8], &str); 3] = [
        (
            b"PK\x03\x04",
            "a zip archive or a spreadsheet; export the sheet as CSV",
        ),
        (
            b"\x1F\x8B",
            "compressed with gzip; pipe it: gunzip -c FILE | torqcomp … -",
        ),
        (
            b"\x28\xB5\x2F\xFD",
            "compressed with zstd; pipe it: zstdcat FILE | torqcomp … -",
        ),
    ];
    match known.iter().find(|(magic, _)| head.starts_with(magic)) {
        Some((_, what)) => Err(ErrorCode::NotARecording.failed(format_args!("the file is {what}"))),
        None if is_binary(head) => Err(ErrorCode::NotARecording
            .failed("the file is binary; expected a text table (CSV, TSV or a recorder's export)")),
        None => Ok(()),
    }
}

/// Whether there are more zero bytes than a fault in a text would leave, or more other non-text characters. They make
/// up a tenth of random bytes.
fn is_binary(head: &[u8]) -> bool {
    let is_of_text = |byte: u8| matches!(byte, 0 | b'\t'..=b'\r' | 0x1a | 0x1b | b' '..);
    let most = head.len() / 100;
    let zeros = head.iter().filter(|byte| **byte == 0).count();
    let others = head.iter().filter(|byte| !is_of_text(**byte)).count();
    zeros > most || others > most
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(bytes: &[u8]) -> String {
        let decoding = Decoding::of(bytes).unwrap();
        let mut text = String::new();
        let mut reader = decoding.reader(bytes.to_vec(), Box::new(io::empty()));
        reader.read_to_string(&mut text).unwrap();
        text
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
        // Truncated within its last character, of which nothing is kept.
        assert_eq!(
            text(&[b"\xFF\xFE", &wide(false)[..19]].concat()),
            "Zeit;\u{b5}m\n1"
        );
    }

    #[test]
    fn line_ends() {
        assert_eq!(text(b"a\r\r\n1\r\r\n"), "a\n1\n");
        assert_eq!(text(b"a\r1\r2\r"), "a\n1\n2\n");
        assert_eq!(text(b"a\r\n1\r\n"), "a\r\n1\r\n");
    }

    #[test]
    fn a_character_between_two_pieces_is_whole() {
        let words = "Zeit;\u{b5}m\n".repeat(PIECE / 8);
        let bytes: Vec<u8> = words.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let (head, rest) = bytes.split_at(999);
        let decoding = Decoding::of(&bytes[..PIECE]).unwrap();
        let mut text = String::new();
        let input = Box::new(io::Cursor::new(rest.to_vec()));
        let mut reader = decoding.reader(head.to_vec(), input);
        reader.read_to_string(&mut text).unwrap();
        assert_eq!(text, words);
    }

    #[test]
    fn other_formats_are_named() {
        let error = Decoding::of(b"PK\x03\x04......").unwrap_err();
        assert!(error.to_string().contains("zip"), "{error}");
    }
}
