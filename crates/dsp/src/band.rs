//! The band covered by a compensation, and its smooth edge.
//!
//! `W(f) = 1` up to the stated band, falls smoothly over the edge, and is `0` beyond it. The edge
//! is the running integral of a Kaiser window, so that the filter's impulse response decays as fast
//! as the edge width allows: to about `e^{-β}` within `√(1+(β/π)²)/edge width` seconds (J. F.
//! Kaiser, "Nonrecursive digital filter design using the I₀-sinh window function", ISCAS 1974).

mod choice;
mod lines;

use std::sync::LazyLock;

use crate::Error;
use crate::spectrum::Density;

pub use choice::{BandChoice, BandSearch, band_of_stand};
pub use lines::{Deciding, DecidingLines};

/// Shape of the Kaiser window for the edge: the filter's tail is down to `e^{-26} ≈ 5·10⁻¹²`.
const EDGE_BETA: f64 = 26.0;
/// Width of the edge as a fraction of the band, where the sampling rate permits.
const EDGE_FRACTION: f64 = 0.2;
/// Highest band as a fraction of the Nyquist frequency: above it the edge would be too steep.
const HIGHEST_FRACTION: f64 = 0.96;
/// Fallback band, as a fraction of the Nyquist frequency, when the default band does not fit below
/// it. Its edge leaves room to see the recorder's noise.
const FALLBACK_FRACTION: f64 = 0.7;
/// Nodes of the table from which the edge is interpolated.
const EDGE_NODES: usize = 1024;

/// The stated band of a compensation at one sampling rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    sample_rate_hz: f64,
    top_hz: f64,
    end_hz: f64,
}

impl Band {
    /// A band from 0 to `top_hz`, with an edge above it.
    ///
    /// The edge is a fifth of the band wide, or as wide as the Nyquist frequency allows.
    ///
    /// # Errors
    /// [`Error::NotPositive`] for a rate or band that is not positive, [`Error::RateTooLow`] if
    /// `top_hz` lies above 0.96 of the Nyquist frequency.
    ///
    /// ```
    /// use torqcomp_dsp::band::Band;
    /// let band = Band::new(20_000.0, 2400.0)?;
    /// assert_eq!(band.end_hz(), 2880.0);       // 2400 + 20 %
    /// assert_eq!(band.gain(2400.0), 1.0);
    /// assert_eq!(band.gain(2880.0), 0.0);
    /// assert!((band.gain(2640.0) - 0.5).abs() < 1e-12);  // the edge is symmetric
    /// # Ok::<(), torqcomp_dsp::Error>(())
    /// ```
    pub fn new(sample_rate_hz: f64, top_hz: f64) -> Result<Self, Error> {
        let positive = |name, value: f64| {
            if value > 0.0 && value.is_finite() {
                Ok(())
            } else {
                Err(Error::NotPositive { name, value })
            }
        };
        positive("sampling rate", sample_rate_hz)?;
        positive("band", top_hz)?;
        let nyquist_hz = 0.5 * sample_rate_hz;
        let highest_band_hz = HIGHEST_FRACTION * nyquist_hz;
        // The tolerance admits a band computed as exactly this fraction.
        if top_hz > highest_band_hz * (1.0 + 1e-12) {
            return Err(Error::RateTooLow {
                sample_rate_hz,
                nyquist_hz,
                band_hz: top_hz,
                highest_band_hz,
            });
        }
        Ok(Self {
            sample_rate_hz,
            top_hz,
            end_hz: Self::end_of(sample_rate_hz, top_hz),
        })
    }

    /// Upper end of the edge for a band up to `top_hz`, in Hz.
    fn end_of(sample_rate_hz: f64, top_hz: f64) -> f64 {
        (top_hz * (1.0 + EDGE_FRACTION)).min(0.5 * sample_rate_hz)
    }

    /// The wanted band if it fits with its full edge at this rate, otherwise 0.7 of the Nyquist
    /// frequency.
    ///
    /// # Errors
    /// As for [`Band::new`].
    ///
    /// ```
    /// use torqcomp_dsp::band::Band;
    /// assert_eq!(Band::fitting(20_000.0, 2400.0)?.top_hz(), 2400.0);
    /// assert_eq!(Band::fitting(1000.0, 2400.0)?.top_hz(), 350.0);
    /// # Ok::<(), torqcomp_dsp::Error>(())
    /// ```
    pub fn fitting(sample_rate_hz: f64, wanted_hz: f64) -> Result<Self, Error> {
        Self::new(
            sample_rate_hz,
            wanted_hz.min(FALLBACK_FRACTION * 0.5 * sample_rate_hz),
        )
    }

    /// Sampling rate in Hz.
    #[must_use]
    pub fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    /// Upper end of the fully compensated range, in Hz.
    #[must_use]
    pub fn top_hz(&self) -> f64 {
        self.top_hz
    }

    /// Upper end of the edge, in Hz; nothing passes above it.
    #[must_use]
    pub fn end_hz(&self) -> f64 {
        self.end_hz
    }

    /// `W(f)`: 1 up to [`Band::top_hz`], 0 from [`Band::end_hz`], falling between.
    #[must_use]
    pub fn gain(&self, frequency_hz: f64) -> f64 {
        let x = (frequency_hz.abs() - self.top_hz) / (self.end_hz - self.top_hz);
        1.0 - EDGE.at(x)
    }

    /// Mean square that the band removes from a record up to a frequency, without its noise: `∫(S − N) (1 − W)² df`.
    ///
    /// ```
    /// use torqcomp_dsp::{band::Band, spectrum::Density};
    /// let band = Band::new(1000.0, 100.0)?;
    /// let mut density = Density { step_hz: 1.0, values: vec![0.0; 501], blocks: 1 };
    /// // In the middle of the edge, where W is a half, and above its end at 120 Hz.
    /// (density.values[110], density.values[125]) = (5.0, 3.0);
    /// let noise = |hz: f64| if hz == 110.0 { 1.0 } else { 0.0 };
    /// // (5 − 1)/4 + 3.
    /// assert!((band.cut_off(&density, 500.0, noise) - 4.0).abs() < 1e-12);
    /// # Ok::<(), torqcomp_dsp::Error>(())
    /// ```
    pub fn cut_off(&self, density: &Density, to_hz: f64, noise: impl Fn(f64) -> f64) -> f64 {
        density
            .between(self.top_hz, to_hz)
            .map(|(f, v)| (v - noise(f)) * (1.0 - self.gain(f)).powi(2) * density.step_hz)
            .sum()
    }
}

/// The edge, common to all bands.
static EDGE: LazyLock<Edge> = LazyLock::new(Edge::new);

/// Smooth step from 0 at `x = 0` to 1 at `x = 1`: the running integral of a Kaiser window.
#[derive(Debug, Clone, PartialEq)]
struct Edge {
    /// Integral up to each of `EDGE_NODES + 1` equally spaced nodes, normalised to end at 1.
    cumulative: Vec<f64>,
    total: f64,
}

impl Edge {
    fn new() -> Self {
        let width = 1.0 / EDGE_NODES as f64;
        let mut cumulative = vec![0.0];
        let mut sum = 0.0;
        for node in 0..EDGE_NODES {
            let from = node as f64 * width;
            sum += gauss3(from, from + width);
            cumulative.push(sum);
        }
        for value in &mut cumulative {
            *value /= sum;
        }
        Self {
            cumulative,
            total: sum,
        }
    }

    fn at(&self, x: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        if x >= 1.0 {
            return 1.0;
        }
        let node = ((x * EDGE_NODES as f64) as usize).min(EDGE_NODES - 1);
        let from = node as f64 / EDGE_NODES as f64;
        self.cumulative[node] + gauss3(from, x) / self.total
    }
}

/// Three-point Gauss-Legendre integral of the Kaiser window over `[a, b]` within `[0, 1]`.
fn gauss3(a: f64, b: f64) -> f64 {
    let (mid, half) = (0.5 * (a + b), 0.5 * (b - a));
    let offset = half * 0.6_f64.sqrt();
    half * (5.0 * kaiser(mid - offset) + 8.0 * kaiser(mid) + 5.0 * kaiser(mid + offset)) / 9.0
}

/// Kaiser window on `[0, 1]`, normalised to 1 in the middle.
fn kaiser(x: f64) -> f64 {
    let u = 2.0 * x - 1.0;
    static MIDDLE: LazyLock<f64> = LazyLock::new(|| bessel_i0(EDGE_BETA));
    bessel_i0(EDGE_BETA * (1.0 - u * u).max(0.0).sqrt()) / *MIDDLE
}

/// Modified Bessel function `I₀(x) = Σ ((x/2)^k / k!)²` (DLMF 10.25.2).
fn bessel_i0(x: f64) -> f64 {
    let quarter_square = 0.25 * x * x;
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..200 {
        let k = f64::from(k);
        term *= quarter_square / (k * k);
        sum += term;
        if term < 1e-17 * sum {
            break;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessel_matches_tabulated_values() {
        // Abramowitz & Stegun, table 9.8: I0(1) = 1.2660658778, e^-10 I0(10) = 0.1278333372.
        assert!((bessel_i0(1.0) - 1.266_065_877_8).abs() < 1e-10);
        assert!((bessel_i0(10.0) * (-10.0_f64).exp() - 0.127_833_337_2).abs() < 1e-10);
    }

    #[test]
    fn edge_falls_monotonically_and_symmetrically() {
        let band = Band::new(1000.0, 100.0).unwrap();
        let gains: Vec<f64> = (0..=400)
            .map(|i| band.gain(100.0 + 20.0 * f64::from(i) / 400.0))
            .collect();
        assert!(gains.windows(2).all(|w| w[1] <= w[0]));
        for i in 0..=400 {
            assert!((gains[i] + gains[400 - i] - 1.0).abs() < 1e-13);
        }
        assert!(gains[100] < 1.0 && gains[100] > 0.99);
    }

    #[test]
    fn edge_agrees_with_a_plain_trapezoid() {
        let edge = Edge::new();
        let steps = 200_000;
        let mut sum = 0.0;
        let mut at_third = 0.0;
        for i in 0..steps {
            let x = (f64::from(i) + 0.5) / f64::from(steps);
            sum += kaiser(x);
            if x < 1.0 / 3.0 {
                at_third = sum;
            }
        }
        assert!((edge.at(1.0 / 3.0) - at_third / sum).abs() < 1e-4);
    }

    #[test]
    fn rates_that_cannot_carry_the_band_are_refused() {
        let error = Band::new(4000.0, 2400.0).unwrap_err();
        assert!(matches!(error, Error::RateTooLow { .. }));
        assert!(error.to_string().contains("at most 1920 Hz"), "{error}");
        assert!(Band::new(0.0, 1.0).is_err());
        assert!(Band::new(1000.0, f64::NAN).is_err());
        // A steep edge is accepted as long as it fits below the Nyquist frequency.
        assert_eq!(Band::new(1000.0, 480.0).unwrap().end_hz(), 500.0);
    }
}
