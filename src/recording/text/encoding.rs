//! Detection of legacy text encodings.
//!
//! Western recorders write Windows-1252, often only for unit signs (°, µ, ²): that is assumed unless a word indicates
//! otherwise. Words are judged by `chardetng`, from letter frequencies in the languages of each encoding; one or two
//! signs are not enough for it.

use chardetng::{EncodingDetector, Iso2022JpDetection, Utf8Detection};
use encoding_rs::{Encoding, SHIFT_JIS, WINDOWS_1252};

/// Number of consecutive non-ASCII bytes in a word of a non-Latin alphabet or script.
const WORD: usize = 4;

/// The encoding of a text from its head; `None` for UTF-8 and Windows-1252.
pub fn told(head: &[u8]) -> Option<&'static Encoding> {
    if is_utf8(head) {
        return None;
    }
    let last_line = head.iter().rposition(|byte| *byte == b'\n');
    let whole = last_line.map_or(head, |end| &head[..end]);
    if is_shift_jis(whole) {
        return Some(SHIFT_JIS);
    }
    let mut detector = EncodingDetector::new(Iso2022JpDetection::Deny);
    detector.feed(whole, true);
    let guess = detector.guess(None, Utf8Detection::Deny);
    let (text, has_faults) = guess.decode_without_bom_handling(whole);
    let is_foreign = |c: char| c.is_alphabetic() && !is_latin(c);
    let has_words = match text.chars().any(is_foreign) {
        true => has_long_run(whole),
        false => whole.windows(3).any(is_letter_in_word),
    };
    (guess != WINDOWS_1252 && !has_faults && has_words).then_some(guess)
}

/// Name of an encoding for messages.
pub fn name(encoding: &'static Encoding) -> &'static str {
    match encoding.name() {
        "Shift_JIS" => "Shift-JIS",
        "UTF-16LE" => "UTF-16 LE",
        "UTF-16BE" => "UTF-16 BE",
        name => name,
    }
}

/// Whether it is UTF-8 apart from faults: most non-ASCII bytes are in lines without faults.
fn is_utf8(head: &[u8]) -> bool {
    let (mut good, mut bad) = (0, 0);
    for line in head.split(|byte| *byte == b'\n') {
        let beyond = line.iter().filter(|byte| !byte.is_ascii()).count();
        match std::str::from_utf8(line) {
            Ok(_) => good += beyond,
            Err(_) => bad += beyond,
        }
    }
    good >= bad
}

fn is_latin(c: char) -> bool {
    matches!(c, '\0'..='\u{24F}' | '\u{1E00}'..='\u{1EFF}')
}

/// Whether non-ASCII bytes form a word somewhere.
fn has_long_run(text: &[u8]) -> bool {
    text.split(u8::is_ascii).any(|run| run.len() >= WORD)
}

/// Whether a non-ASCII byte is a letter between two letters rather than a unit sign between them, as in `N·m`,
/// `m²K`, `Temp°C` and `xµm`.
fn is_letter_in_word(bytes: &[u8]) -> bool {
    const SIGNS: [u8; 4] = [0xB0, 0xB2, 0xB5, 0xB7];
    let &[before, byte, after] = bytes else {
        return false;
    };
    let is_letter = byte >= 0x80 && !SIGNS.contains(&byte);
    is_letter && before.is_ascii_alphabetic() && after.is_ascii_alphabetic()
}

/// Whether it is Japanese text in Shift-JIS: it decodes without errors, most non-ASCII characters have two bytes
/// starting with one unused in Latin-1, and two of them form a word somewhere.
fn is_shift_jis(whole: &[u8]) -> bool {
    let (_, has_faults) = SHIFT_JIS.decode_without_bom_handling(whole);
    let (mut doubles, mut others, mut words) = (0_usize, 0_usize, 0_usize);
    let (mut at, mut was_double) = (0, false);
    while let Some(byte) = whole.get(at) {
        let is_double = matches!(byte, 0x81..=0x9F);
        doubles += usize::from(is_double);
        others += usize::from(!is_double && *byte >= 0x80);
        words += usize::from(is_double && was_double);
        was_double = is_double;
        at += if is_double || *byte >= 0xE0 { 2 } else { 1 };
    }
    !has_faults && words > 0 && doubles > others
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::text::decode::Decoding;
    use std::io::Read;

    /// The decoded text of bytes, and its unusual properties.
    fn decoded(bytes: &[u8]) -> (Vec<u8>, Vec<&'static str>) {
        let decoding = Decoding::of(bytes).unwrap();
        let mut text = Vec::new();
        let mut reader = decoding.reader(bytes.to_vec(), Box::new(std::io::empty()));
        reader.read_to_end(&mut text).unwrap();
        (text, decoding.oddities)
    }

    #[test]
    fn words_of_other_scripts_tell_the_encoding() {
        for (words, encoding) in [
            ("时间(s),扭矩(Nm),转速(rpm)\n0,1,2\n", encoding_rs::GBK),
            ("시간(s),토크(Nm)\n0,1\n", encoding_rs::EUC_KR),
            ("時間,扭矩,轉速\n0,1,2\n", encoding_rs::BIG5),
            ("時間(s),トルク(Nm)\n0,1\n", encoding_rs::EUC_JP),
            ("Время, с;Момент, Нм\n0;1\n", encoding_rs::WINDOWS_1251),
            ("Prędkość;Siła [N]\n0;1\n", encoding_rs::WINDOWS_1250),
        ] {
            let (bytes, _, _) = encoding.encode(words);
            let (text, oddities) = decoded(&bytes);
            assert_eq!(String::from_utf8(text).unwrap(), words);
            assert_eq!(oddities, [encoding.name()]);
        }
    }

    #[test]
    fn a_stray_byte_takes_no_utf8_away() {
        let bytes = ["时间,扭矩\n# 20 ".as_bytes(), b"\xB0C\n0,1\n"].concat();
        assert_eq!(told(&bytes), None);
        // 转 is D7 AA in GBK, which is also a letter in UTF-8.
        let (bytes, _, _) = encoding_rs::GBK.encode("转\n时间,扭矩\n0,1\n");
        assert_eq!(told(&bytes), Some(encoding_rs::GBK));
    }

    #[test]
    fn signs_of_units_tell_nothing() {
        for western in [
            "Dehnung µm/m",
            "Ø [mm]",
            "Kraft ± 5 %",
            "µ",
            "m³/h",
            "x·s²",
            "N·m;m²K;Temp°C",
            "§ 3;¼",
            "Nm/° ½",
            "KRÄFTE;ÄÖÜ;Größe",
        ] {
            let (bytes, _, _) = WINDOWS_1252.encode(western);
            assert_eq!(told(&bytes), None, "{western}");
        }
    }

    #[test]
    fn japanese_is_told_from_western_letters() {
        let japanese = "時間,トルク[N・m],回転数\n0,1.5,60\n";
        let (bytes, _, _) = SHIFT_JIS.encode(japanese);
        let (text, oddities) = decoded(&bytes);
        assert_eq!(String::from_utf8(text).unwrap(), japanese);
        assert_eq!(oddities, ["Shift-JIS"]);
        // Latin-1 and Windows-1252, with quotation marks and a dash.
        for western in [
            &b"Kr\xE4nge [\xB5m/m];Temperatur [\xB0C]\n1;2\n"[..],
            b"\xDCberh\xF6hung;Gr\xF6\xDFe;\xC4\xD6\xDC\xE4\xF6\xFC\n1;2\n",
            b"it\x92s \x93good\x94 \x96 it\x92s;b\n1;2\n",
            b"Acc\xE9l\xE9ration [m/s\xB2];d\xE9bit\n1;2\n",
        ] {
            let (text, oddities) = decoded(western);
            assert_eq!((text.as_slice(), oddities.len()), (western, 0));
        }
    }
}
