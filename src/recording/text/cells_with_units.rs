//! Cells that contain a unit after the number: `0.53 V`, `12 mV`.

use super::cell::Cell;
use super::units;

/// The unit after the number in a cell.
///
/// Only known units count: `12 pieces` and `B12` are texts.
pub fn unit_of_cell(cell: &str, decimal: u8) -> Option<&str> {
    let cell = cell.trim();
    let is_digit = |c: char| c.is_ascii_digit() || c == '.';
    let ends = cell
        .match_indices(is_digit)
        .map(|(at, digit)| at + digit.len());
    // The exponent belongs to the number, so the longest match counts.
    let end = ends
        .rev()
        .find(|end| Cell::read(cell[..*end].trim(), decimal).is_number())?;
    let unit = cell[end..].trim();
    (!unit.is_empty() && units::read(unit).is_some()).then_some(unit)
}

#[cfg(test)]
mod tests {
    use super::unit_of_cell;

    #[test]
    fn a_unit_behind_a_number_is_found() {
        for (cell, unit) in [
            ("0.53 V", "V"),
            ("12mV", "mV"),
            ("-1.2e-3 N m", "N m"),
            ("1.2 kHz", "kHz"),
            ("60.5 °C", "°C"),
        ] {
            assert_eq!(unit_of_cell(cell, b'.'), Some(unit), "{cell}");
        }
        assert_eq!(unit_of_cell("0,53 V", b','), Some("V"));
        for cell in [
            "0.53",
            "B12",
            "12 pieces",
            "V",
            "",
            "3 of 4",
            "2024-03-12 13:26",
        ] {
            assert_eq!(unit_of_cell(cell, b'.'), None, "{cell}");
        }
    }
}
