//! Inversion of the stand's response in a record, up to a stated band.
//!
//! With the inverse response `H⁻¹(f)` (torque over recorded torque) and the band `W(f)`, the
//! compensated spectrum is
//!
//! ```text
//! T(f) = W(f) H⁻¹(f) T_o(f)                         (thesis, eq. 32, at every frequency)
//! ```
//!
//! Two implementations give the same result:
//!
//! * [`whole_record`]: one transform over the record, each of its frequencies multiplied by the
//!   exact `W H⁻¹`.
//! * [`Stream`]: overlap-save with the impulse response of `W H⁻¹`, truncated where it has decayed,
//!   in memory that does not grow with the record.
//!
//! Beyond both ends the record is extended by point reflection about its end sample (`2x₀ − x[k]`),
//! which prevents wrap-around and preserves constants and slopes. Within
//! [`InverseFilter::half_length`] samples of an end the result depends on that extension.

mod blocks;
mod extension;
mod fine;
mod whole;
mod windows;

use std::fmt;
use std::sync::Arc;

use num_complex::Complex64;

use crate::Error;
use crate::band::Band;

pub use blocks::BlockConvolver;
pub use extension::{Extension, Spectrum};
pub use fine::Fine;
pub use whole::whole_record;
pub use windows::{Stream, Windows};

/// Part of the impulse response that may be truncated, relative to the static gain. It bounds the
/// difference between the two implementations, relative to the recorded full scale.
const TAIL_TOLERANCE: f64 = 2e-10;
/// The same relative to the largest gain: where a compensation amplifies a thousandfold, truncation
/// is negligible compared with the amplified noise.
const TAIL_OF_LARGEST: f64 = 4e-12;
/// Longest transform used to build a filter.
const LONGEST_DESIGN: usize = 1 << 24;

/// An inverse response as a function of frequency in Hz (`f >= 0`).
pub type Inverse = Arc<dyn Fn(f64) -> Complex64 + Send + Sync>;

/// The filter `W(f) H⁻¹(f)` and its impulse response.
#[derive(Clone)]
pub struct InverseFilter {
    inverse: Inverse,
    band: Band,
    /// Impulse response, index `half_length` being time zero.
    taps: Vec<f64>,
    half_length: usize,
}

impl fmt::Debug for InverseFilter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("InverseFilter")
            .field("band", &self.band)
            .field("half_length", &self.half_length)
            .finish_non_exhaustive()
    }
}

impl InverseFilter {
    /// Builds the filter for an inverse response and a band.
    ///
    /// The impulse response is the inverse transform of `W(f) H⁻¹(f)` on a grid that is refined
    /// until the response decays well inside it. It is truncated where less than 2·10⁻¹⁰ of the
    /// static gain remains (sum of magnitudes), and normalised so that its sum is exactly the
    /// static gain.
    ///
    /// # Errors
    /// [`Error::InverseNotFinite`] if the inverse is infinite inside the band,
    /// [`Error::NotPositive`] if its static value is not a positive number,
    /// [`Error::FilterTooLong`] if it does not decay within 2²² samples.
    ///
    /// ```
    /// use std::sync::Arc;
    /// use num_complex::Complex64;
    /// use torqcomp_dsp::{band::Band, compensate::InverseFilter};
    ///
    /// // An inverse of 2 everywhere: the filter doubles, and its taps add up to 2.
    /// let band = Band::new(20_000.0, 2400.0)?;
    /// let filter = InverseFilter::design(Arc::new(|_| Complex64::new(2.0, 0.0)), band)?;
    /// assert!((filter.taps().iter().sum::<f64>() - 2.0).abs() < 1e-14);
    /// # Ok::<(), torqcomp_dsp::Error>(())
    /// ```
    pub fn design(inverse: Inverse, band: Band) -> Result<Self, Error> {
        let static_gain = inverse(0.0).re;
        if !(static_gain > 0.0 && static_gain.is_finite()) {
            return Err(Error::NotPositive {
                name: "static gain of the inverse response",
                value: static_gain,
            });
        }
        let edge_width = band.end_hz() - band.top_hz();
        // A response resolved by some hundred points over the edge is the shortest that can have
        // decayed.
        let longest = 2.0 * LONGEST_DESIGN as f64;
        let start = (64.0 * band.sample_rate_hz() / edge_width).clamp(1024.0, longest) as usize;
        let mut length = start.next_power_of_two();
        while length <= LONGEST_DESIGN {
            let grid = response_on_grid(&inverse, &band, length)?;
            let largest = grid.iter().map(|g| g.norm()).fold(0.0, f64::max);
            let tolerance = (TAIL_TOLERANCE * static_gain).max(TAIL_OF_LARGEST * largest);
            let circular = impulse_response(grid, length);
            if let Some(half_length) = half_length(&circular, tolerance) {
                let mut taps: Vec<f64> = (0..=2 * half_length)
                    .map(|tap| circular[(length + tap - half_length) % length])
                    .collect();
                let scale = static_gain / taps.iter().sum::<f64>();
                taps.iter_mut().for_each(|tap| *tap *= scale);
                return Ok(Self {
                    inverse,
                    band,
                    taps,
                    half_length,
                });
            }
            length *= 2;
        }
        Err(Error::FilterTooLong {
            samples: LONGEST_DESIGN / 4,
            seconds: (LONGEST_DESIGN / 4) as f64 / band.sample_rate_hz(),
            band_hz: band.top_hz(),
            sample_rate_hz: band.sample_rate_hz(),
        })
    }

    /// The impulse response, an odd number of taps with time zero in the middle.
    #[must_use]
    pub fn taps(&self) -> &[f64] {
        &self.taps
    }

    /// Number of samples before and after a sample that affect its result.
    #[must_use]
    pub fn half_length(&self) -> usize {
        self.half_length
    }

    /// The inverse response without the band.
    #[must_use]
    pub fn inverse(&self) -> &Inverse {
        &self.inverse
    }

    /// The band that the filter covers.
    #[must_use]
    pub fn band(&self) -> &Band {
        &self.band
    }

    /// `W(f) H⁻¹(f)`; zero at and above the band's end.
    #[must_use]
    pub fn response(&self, frequency_hz: f64) -> Complex64 {
        response(&self.inverse, &self.band, frequency_hz)
    }
}

fn response(inverse: &Inverse, band: &Band, frequency_hz: f64) -> Complex64 {
    let gain = band.gain(frequency_hz);
    // Above the band the inverse may be infinite, so it is not evaluated.
    if gain == 0.0 {
        Complex64::ZERO
    } else {
        inverse(frequency_hz) * gain
    }
}

/// `W(f) H⁻¹(f)` at the `length / 2 + 1` frequencies of a real transform of that length.
fn response_on_grid(
    inverse: &Inverse,
    band: &Band,
    length: usize,
) -> Result<Vec<Complex64>, Error> {
    let step_hz = band.sample_rate_hz() / length as f64;
    let mut grid = Vec::with_capacity(length / 2 + 1);
    for bin in 0..=length / 2 {
        let frequency_hz = bin as f64 * step_hz;
        let value = response(inverse, band, frequency_hz);
        if !(value.re.is_finite() && value.im.is_finite()) {
            return Err(Error::InverseNotFinite { frequency_hz });
        }
        grid.push(value);
    }
    // The DC and Nyquist values of a real signal are real.
    grid[0].im = 0.0;
    if length.is_multiple_of(2) {
        grid[length / 2].im = 0.0;
    }
    Ok(grid)
}

/// Circular impulse response of `length` samples, time zero at index 0.
fn impulse_response(mut spectrum: Vec<Complex64>, length: usize) -> Vec<f64> {
    let mut response = vec![0.0; length];
    torqcomp_fourier::inverse(length)
        .process(&mut spectrum, &mut response)
        .expect("lengths come from one number and the ends are real");
    let scale = 1.0 / length as f64;
    response.iter_mut().for_each(|tap| *tap *= scale);
    response
}

/// Half-length beyond which at most `tolerance` remains; `None` if it exceeds a quarter of the
/// circle, where the two ends would start to overlap.
fn half_length(circular: &[f64], tolerance: f64) -> Option<usize> {
    let length = circular.len();
    let mut left = 0.0;
    for lag in (1..=length / 2).rev() {
        left += circular[lag].abs() + circular[length - lag].abs();
        if left > tolerance {
            return (lag <= length / 4).then_some(lag);
        }
    }
    Some(0)
}

/// Sample `index` of a record extended by point reflection about its end samples, and held constant
/// where the record is too short for that.
///
/// ```
/// use torqcomp_dsp::compensate::continued;
/// // 2·1 − 4 = −2 before the start, 2·9 − 4 = 14 after the end.
/// let record = [1.0, 4.0, 9.0];
/// assert_eq!([continued(&record, -1), continued(&record, 3)], [-2.0, 14.0]);
/// ```
///
/// # Panics
/// If the record is empty.
#[must_use]
pub fn continued(samples: &[f64], index: isize) -> f64 {
    let last = samples.len() - 1;
    if index < 0 {
        2.0 * samples[0] - samples[index.unsigned_abs().min(last)]
    } else if index as usize > last {
        let beyond = index as usize - last;
        2.0 * samples[last] - samples[last.saturating_sub(beyond)]
    } else {
        samples[index as usize]
    }
}

#[cfg(test)]
mod tests;
