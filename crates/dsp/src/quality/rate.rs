//! A stated sampling rate that contradicts the time stamps.

/// Relative tolerance between a recorder's clock and its stated rate: ten times that of quartz, a
/// tenth of what would shift a resonance noticeably.
const TOLERANCE: f64 = 1e-3;
/// Number of digits above which a rate was computed as a reciprocal and rounded.
const DIGITS: usize = 12;

/// Rate stated in the header of a file and rate from its stamps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contradiction {
    /// Rate in the header, Hz.
    pub stated_hz: f64,
    /// Rate from the stamps, Hz.
    pub stamped_hz: f64,
}

/// Compares a stated rate with that of `count` stamps.
///
/// They contradict each other if `|stated/stamped − 1|` exceeds the sum of 0.1 % (clocks), half a
/// unit of the last stated digit of the rate or its reciprocal (0.667 ms is 1499.25 Hz ± 0.075 %),
/// and one step over the length of the record (rounded stamps). Two quartz clocks differ by less
/// than 0.02 %, so clocks alone never raise an alarm.
///
/// ```
/// use torqcomp_dsp::quality::rate::contradiction;
/// assert_eq!(contradiction(1.0 / 0.667e-3, 1500.0, 10_000), None);
/// assert!(contradiction(1000.0, 500.0, 10_000).is_some());
/// assert!(contradiction(1000.0, 997.0, 10_000).is_some());
/// ```
#[must_use]
pub fn contradiction(stated_hz: f64, stamped_hz: f64, count: usize) -> Option<Contradiction> {
    // A whole number of Hz is exact: 5 kHz is not 5000 ± 500 Hz.
    let written = if (stated_hz - stated_hz.round()).abs() < 1e-9 * stated_hz {
        0.0
    } else {
        half_unit(stated_hz).max(half_unit(1.0 / stated_hz))
    };
    let record = 1.0 / count.max(2) as f64;
    let tolerance = TOLERANCE + written + record;
    ((stated_hz / stamped_hz - 1.0).abs() > tolerance).then_some(Contradiction {
        stated_hz,
        stamped_hz,
    })
}

/// Half a unit of the last decimal digit of a number, relative to it; 0 for a number of very many
/// digits.
fn half_unit(value: f64) -> f64 {
    let text = format!("{:.*e}", DIGITS - 1, value);
    let mantissa = text.split('e').next().unwrap_or_default();
    let digits = mantissa.trim_end_matches('0').trim_end_matches('.');
    let count = digits.bytes().filter(u8::is_ascii_digit).count();
    let leading: f64 = mantissa.parse().unwrap_or(1.0);
    match count {
        0 | DIGITS.. => 0.0,
        _ => 0.5 * 10_f64.powi(1 - count as i32) / leading.abs(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_unit_of_the_last_digit() {
        assert_eq!(half_unit(5000.0), 0.1);
        assert!((half_unit(0.667e-3) - 0.0005 / 0.667).abs() < 1e-12);
        assert!((half_unit(610.35) - 0.005 / 610.35).abs() < 1e-12);
        assert_eq!(half_unit(1.0 / 3.0), 0.0);
    }

    #[test]
    fn short_records_are_given_their_rounding() {
        assert_eq!(contradiction(100.0, 95.0, 10), None);
        assert!(contradiction(100.0, 95.0, 1000).is_some());
        assert_eq!(contradiction(5000.0, 5000.2, 1_000_000), None);
        assert!(contradiction(5000.0, 4900.0, 1_000_000).is_some());
        // 0.67 ms is 1493 Hz to within 0.75 %.
        assert_eq!(contradiction(1.0 / 0.67e-3, 1500.0, 1_000_000), None);
    }
}
