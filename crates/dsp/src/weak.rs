//! Derivatives averaged over a smooth window, without finite differences.
//!
//! An equation such as `T = J θ'' + f θ' + C` holds at every moment, so it also holds averaged with a weight φ that is
//! zero at both ends of a window. Integration by parts then moves the derivatives from the record to the weight:
//! `∫φ θ'' dt = ∫φ'' θ dt`. All terms have the same weight, so none is attenuated or shifted relative to another,
//! unlike with filtered differences (modulating functions: M. Shinbrot, On the analysis of linear and nonlinear
//! systems, Trans. ASME 79 (1957), 547).

use crate::Error;

/// Power of the weight `φ(x) = (1 − x²)ᵖ`: its derivatives up to the fifth are zero at the ends.
const POWER: i32 = 6;
/// Minimum half-length of the window in samples.
const LEAST_HALF: usize = 4;

/// A sliding window over a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    half: usize,
    /// φ, φ' and φ'' at the samples, with Σφ = 1 and time in seconds.
    weights: [Vec<f64>; 3],
}

impl Window {
    /// A window of `half` samples on each side.
    ///
    /// # Errors
    /// [`Error::TooShort`] if that is fewer than 4, [`Error::NotPositive`] for the rate.
    ///
    /// ```
    /// // θ = 3t² has θ'' = 6 and, at t = 0, θ' = 0.
    /// let window = torqcomp_dsp::weak::Window::new(20, 100.0)?;
    /// let record: Vec<f64> = (-50..=50).map(|i| 3.0 * (0.01 * f64::from(i)).powi(2)).collect();
    /// assert!((window.at(&record, 50, 2) - 6.0).abs() < 1e-4);
    /// assert!(window.at(&record, 50, 1).abs() < 1e-9);
    /// # Ok::<(), torqcomp_dsp::Error>(())
    /// ```
    pub fn new(half: usize, rate_hz: f64) -> Result<Self, Error> {
        if half < LEAST_HALF {
            return Err(Error::TooShort {
                what: "half a window",
                expected: LEAST_HALF,
                got: half,
            });
        }
        if !(rate_hz > 0.0 && rate_hz.is_finite()) {
            return Err(Error::NotPositive {
                name: "the sampling rate",
                value: rate_hz,
            });
        }
        let width = (half + 1) as f64;
        let places: Vec<f64> = (0..=2 * half)
            .map(|i| (i as f64 - half as f64) / width)
            .collect();
        let p = f64::from(POWER);
        let rest = |x: f64| 1.0 - x * x;
        let mut weights = [
            places
                .iter()
                .map(|x| rest(*x).powi(POWER))
                .collect::<Vec<f64>>(),
            places
                .iter()
                .map(|x| -2.0 * p * x * rest(*x).powi(POWER - 1))
                .collect(),
            places
                .iter()
                .map(|x| {
                    let bend = 4.0 * p * (p - 1.0) * x * x * rest(*x).powi(POWER - 2);
                    bend - 2.0 * p * rest(*x).powi(POWER - 1)
                })
                .collect(),
        ];
        let sum: f64 = weights[0].iter().sum();
        let per_second = rate_hz / width;
        for (order, weights) in weights.iter_mut().enumerate() {
            let factor = per_second.powi(order as i32) / sum;
            weights.iter_mut().for_each(|w| *w *= factor);
        }
        Ok(Self { half, weights })
    }

    /// Half-length in samples.
    #[must_use]
    pub fn half(&self) -> usize {
        self.half
    }

    /// Average of a derivative (order 0, 1 or 2, in 1/s to that power) over the window around a
    /// sample.
    ///
    /// # Panics
    /// If the window extends beyond the record, or the order is higher.
    #[must_use]
    pub fn at(&self, samples: &[f64], centre: usize, order: usize) -> f64 {
        let part = &samples[centre - self.half..=centre + self.half];
        let sum: f64 = part
            .iter()
            .zip(&self.weights[order])
            .map(|(x, w)| x * w)
            .sum();
        if order == 1 { -sum } else { sum }
    }

    /// The averages at every sample with a complete window, from sample [`Window::half`] on.
    #[must_use]
    pub fn slide(&self, samples: &[f64], order: usize) -> Vec<f64> {
        (self.half..samples.len().saturating_sub(self.half))
            .map(|centre| self.at(samples, centre, order))
            .collect()
    }

    /// Covariance of averages of orders `i` and `j` over the same window, for white noise of variance 1.
    #[must_use]
    pub fn noise(&self, i: usize, j: usize) -> f64 {
        self.noise_apart(i, j, 0)
    }

    /// The same over two windows, that of order `j` being `samples` later than that of order `i`.
    ///
    /// ```
    /// let window = torqcomp_dsp::weak::Window::new(20, 100.0)?;
    /// // Windows that do not overlap share no noise.
    /// let (alone, touching) = (window.noise(0, 0), window.noise_apart(0, 0, 40));
    /// assert!(touching.abs() < 1e-9 * alone && window.noise_apart(0, 0, 41) == 0.0);
    /// # Ok::<(), torqcomp_dsp::Error>(())
    /// ```
    #[must_use]
    pub fn noise_apart(&self, i: usize, j: usize, samples: usize) -> f64 {
        let early = self.weights[i].iter().skip(samples);
        let sum: f64 = early.zip(&self.weights[j]).map(|(a, b)| a * b).sum();
        // `at` negates the first derivative.
        if (i == 1) != (j == 1) { -sum } else { sum }
    }
}

/// Variance of white noise on a smooth record, from its fourth differences: those of a smooth signal vanish, those of
/// noise have 70 times its variance (1² + 4² + 6² + 4² + 1²).
///
/// `None` for fewer than eight samples. Based on the median, so isolated jumps do not matter.
///
/// ```
/// // A straight line has none.
/// let line: Vec<f64> = (0..100).map(|i| 0.5 * f64::from(i)).collect();
/// assert!(torqcomp_dsp::weak::white_noise_variance(&line).unwrap() < 1e-20);
/// ```
#[must_use]
pub fn white_noise_variance(samples: &[f64]) -> Option<f64> {
    if samples.len() < 8 {
        return None;
    }
    let mut sizes: Vec<f64> = samples
        .windows(5)
        .map(|w| (w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]).abs())
        .collect();
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    // The median magnitude of a normal variable is 0.6745 standard deviations.
    Some((*median / 0.674_489_75).powi(2) / 70.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫φ cos is the real part of the transform of φ: both derivatives of a sine must have the same
    /// factor.
    #[test]
    fn every_order_of_a_sine_is_damped_alike() {
        let rate_hz = 1000.0;
        let window = Window::new(30, rate_hz).unwrap();
        let omega = std::f64::consts::TAU * 13.0;
        let sine: Vec<f64> = (0..400)
            .map(|i| (omega * f64::from(i) / rate_hz + 0.4).sin())
            .collect();
        let cosine: Vec<f64> = (0..400)
            .map(|i| (omega * f64::from(i) / rate_hz + 0.4).cos())
            .collect();
        let value = window.at(&sine, 200, 0);
        let slope = window.at(&sine, 200, 1);
        let bend = window.at(&sine, 200, 2);
        assert!(
            (slope / (omega * window.at(&cosine, 200, 0)) - 1.0).abs() < 1e-8,
            "{slope}"
        );
        assert!(
            (bend / (-omega * omega * value) - 1.0).abs() < 1e-7,
            "{bend}"
        );
    }

    #[test]
    fn noise_is_what_it_is_said_to_be() {
        let mut state = 1_u64;
        let noise: Vec<f64> = (0..200_000)
            .map(|_| (0..12).map(|_| uniform(&mut state)).sum::<f64>() - 6.0)
            .collect();
        let variance = white_noise_variance(&noise).unwrap();
        assert!((variance - 1.0).abs() < 0.03, "{variance}");
        let window = Window::new(10, 10.0).unwrap();
        let (a, b) = (window.slide(&noise, 1), window.slide(&noise, 1));
        let got = a.iter().zip(&b).map(|(a, b)| a * b).sum::<f64>() / a.len() as f64;
        let want = window.noise(1, 1);
        assert!((got / want - 1.0).abs() < 0.03, "{got} {want}");
        assert!(window.noise(0, 1).abs() < 1e-12 && window.noise(0, 2) < 0.0);
    }

    fn uniform(state: &mut u64) -> f64 {
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    }

    #[test]
    fn what_cannot_be_is_refused() {
        assert!(matches!(Window::new(3, 1.0), Err(Error::TooShort { .. })));
        assert!(matches!(
            Window::new(9, 0.0),
            Err(Error::NotPositive { .. })
        ));
        assert_eq!(white_noise_variance(&[0.0; 7]), None);
    }
}
