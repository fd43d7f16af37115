//! What an input does between its samples.

use std::f64::consts::PI;

use num_complex::Complex64;

/// Course of the applied quantity from sample to sample.
///
/// A record of what acted, sampled behind an anti-alias filter, is band-limited. Values that were sent to a converter are
/// not: it holds each until the next comes, or something draws straight lines between them. (A. V. Oppenheim,
/// R. W. Schafer, *Discrete-Time Signal Processing*, 3rd ed. (2010), 4.8.3.)
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Between {
    /// Nothing above half the sampling rate.
    #[default]
    BandLimited,
    /// Straight lines.
    StraightLines,
    /// Each sample until the next one.
    Held,
}

impl Between {
    /// Every course, the usual one first.
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

    /// What becomes of a line of the samples' spectrum, by its frequency in cycles a sample, `ν = f/f_s ≤ 1/2`: 1,
    /// `sinc² ν` or `e^{−jπν} sinc ν`, with `sinc ν = sin(πν)/(πν)`. The images above half the sampling rate are
    /// left out; what the stand makes of those of a held input is in its motion, by the exact response to steps.
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
