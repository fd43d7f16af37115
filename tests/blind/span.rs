//! Time scales of a case, and the unit of its seconds.

use super::excitation::{LENGTH_S, RATE_HZ, SAMPLES};

/// Records are made at 20 kHz with a stand of some hundred hertz. In the files, each of their seconds is `slower`
/// seconds, so that the same record is that of a stand of half a hertz or of five kilohertz.
#[derive(Debug, Clone, Copy)]
pub struct Span {
    /// Number of samples per record.
    pub samples: usize,
    /// Duration of the input before the record of a settled stand.
    pub settling_s: f64,
    /// Natural frequency relative to the thesis' stand; frequencies drawn in its band scale with
    /// it.
    pub faster: f64,
    /// Seconds in the file per second.
    pub slower: f64,
}

impl Span {
    /// Records of the thesis' stand. It has settled to 1e-11 after the given time.
    pub const THESIS: Self = Self {
        samples: SAMPLES,
        settling_s: 0.12,
        faster: 1.0,
        slower: 1.0,
    };

    /// Length of a record.
    pub fn length_s(&self) -> f64 {
        self.samples as f64 / RATE_HZ
    }

    /// Length relative to the records of the thesis' stand.
    pub fn longer(&self) -> f64 {
        self.length_s() / LENGTH_S
    }

    /// A frequency as in the files.
    pub fn written_hz(&self, frequency_hz: f64) -> f64 {
        frequency_hz / self.slower
    }

    /// Sampling rate as in the files.
    pub fn written_rate_hz(&self) -> f64 {
        self.written_hz(RATE_HZ)
    }

    /// A parameter as in the files; its name ends with its unit.
    pub fn written(&self, name: &str, value: f64) -> f64 {
        const POWERS: [(&str, i32); 7] = [
            ("_hz", -1),
            ("_per_s", -1),
            ("_rad_s", -1),
            ("_s2", 2),
            ("_s3", 3),
            ("_s", 1),
            ("seconds", 1),
        ];
        let power = POWERS.iter().find(|(unit, _)| name.ends_with(unit));
        value * self.slower.powi(power.map_or(0, |(_, power)| *power))
    }
}
