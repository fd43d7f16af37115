//! Waveform of an input between its samples.

use std::f64::consts::PI;

use num_complex::Complex64;

/// Waveform of the applied quantity between samples.
///
/// A record sampled behind an anti-alias filter is band-limited. Values sent to a converter are not: it either holds
/// each until the next (zero-order hold) or is followed by linear interpolation. (A. V. Oppenheim, R. W. Schafer,
/// *Discrete-Time Signal Processing*, 3rd ed. (2010), 4.8.3.)
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Between {
    /// Nothing above the Nyquist frequency.
    #[default]
    BandLimited,
    /// Linear interpolation.
    StraightLines,
    /// Zero-order hold.
    Held,
}

impl Between {
    /// All waveforms, the most common first.
    pub const ALL: [Self; 3] = [Self::BandLimited, Self::StraightLines, Self::Held];

    /// Its name in reports and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::BandLimited => "band-limited",
            Self::StraightLines => "straight-lines",
            Self::Held => "held",
        }
    }

    /// Factor of a line of the samples' spectrum, by its frequency in cycles per sample, `ν = f/f_s ≤ 1/2`: 1,
    /// `sinc² ν` or `e^{−jπν} sinc ν`, with `sinc ν = sin(πν)/(πν)`. The images above the Nyquist frequency are
    /// left out; the stand's response to them is included in its motion, which is exact for steps and straight lines.
    ///
    /// ```
    /// use torqcomp_model::simulate::Between;
    /// // At half the sampling rate sinc is 2/π = 0.63662, and a held input lags by a quarter of a turn.
    /// let held = Between::Held.factor(0.5);
    /// assert!(held.re.abs() < 1e-15 && (held.im + 0.63662).abs() < 1e-5);
    /// assert!((Between::StraightLines.factor(0.5).re - 0.405285).abs() < 1e-6);
    /// assert_eq!(Between::BandLimited.factor(0.5).re, 1.0);
    /// ```
    #[must_use]
    pub fn factor(self, cycles_per_sample: f64) -> Complex64 {
        let turn = PI * cycles_per_sample;
        let sinc = if turn == 0.0 { 1.0 } else { turn.sin() / turn };
        match self {
            Self::BandLimited => Complex64::ONE,
            Self::StraightLines => Complex64::new(sinc * sinc, 0.0),
            Self::Held => Complex64::from_polar(sinc, -turn),
        }
    }
}
