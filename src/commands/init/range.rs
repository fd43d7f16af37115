//! Ranges of an output as data sheets write them: `±5 V`, `0-10 V`, `4...20 mA`, `60 kHz ± 30 kHz`.

use torqcomp_decimal::digits;

/// Signs between the ends of a range.
const BETWEEN: [&str; 6] = ["...", "…", "..", "–", " to ", "-"];

/// What to write in place of a range; `None` if a text is not one.
pub(super) fn advice(text: &str) -> Option<String> {
    let text = text.trim();
    let found = about_middle(text).or_else(|| from_to(text))?;
    Some(format!("\"{text}\" is a range; write {found}"))
}

/// For `±5 V` and `60 kHz ± 30 kHz`.
fn about_middle(text: &str) -> Option<String> {
    let (middle, change) = text.split_once('±').or_else(|| text.split_once("+/-"))?;
    let (middle, change) = (middle.trim(), change.trim());
    let zero = match middle.is_empty() {
        true => String::new(),
        false => format!(", and --zero \"{middle}\""),
    };
    Some(format!(
        "\"{change}\", that from no load in one direction{zero}"
    ))
}

/// For `4-20 mA`.
fn from_to(text: &str) -> Option<String> {
    let one = |sign: &&str| {
        // A first minus is a sign.
        let at = text.char_indices().nth(1)?.0;
        let at = at + text[at..].find(*sign)?;
        let (from, to) = (&text[..at], text[at + sign.len()..].trim());
        let unit_at = to.find(|c: char| c.is_alphabetic() || c == '%')?;
        let (to, unit) = (to[..unit_at].trim(), &to[unit_at..]);
        let from = from.trim().trim_end_matches(unit).trim();
        Some((from.parse::<f64>().ok()?, to.parse::<f64>().ok()?, unit))
    };
    let (from, to, unit) = BETWEEN.iter().find_map(one)?;
    let write = |value: f64| format!("\"{} {unit}\"", digits::text(value, 9));
    let (change, half, middle) = (to - from, 0.5 * (to - from), 0.5 * (to + from));
    if middle == 0.0 {
        return Some(format!(
            "{}, the change from no load in one direction",
            write(half)
        ));
    }
    let zero = match from == 0.0 {
        true => String::new(),
        false => format!(" and --zero {}", write(from)),
    };
    Some(format!(
        "the change from no load to rated torque, {}{zero}, or {} and --zero {} if the range covers both directions",
        write(change),
        write(half),
        write(middle)
    ))
}

#[cfg(test)]
mod tests {
    use super::advice;

    #[test]
    fn ranges_of_data_sheets_get_their_change_and_zero() {
        for (text, parts) in [
            ("±5 V", &["\"5 V\""][..]),
            ("-10...10 V", &["\"10 V\""]),
            ("60 kHz ± 30 kHz", &["\"30 kHz\"", "--zero \"60 kHz\""]),
            (
                "4-20 mA",
                &[
                    "\"16 mA\" and --zero \"4 mA\"",
                    "\"8 mA\" and --zero \"12 mA\"",
                ],
            ),
            ("4 mA to 20 mA", &["\"16 mA\""]),
            ("0–10 V", &["\"10 V\", or"]),
        ] {
            let said = advice(text).unwrap_or_else(|| panic!("{text}"));
            assert!(parts.iter().all(|part| said.contains(part)), "{said}");
        }
        for text in [
            "2 mV/V",
            "-5 V",
            "1e-3 V",
            "half-poisson",
            "5 V",
            "12.5 N m",
        ] {
            assert_eq!(advice(text), None, "{text}");
        }
    }
}
