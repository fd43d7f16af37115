//! Spectrum of the noise in whole records.
//!
//! ```text
//! S(k) = (w + r |H(jω_k)|²) · g(k)
//! ```
//!
//! w: noise of the measured signal; r: noise that enters before the resonance, such as another excitation of the stand,
//! or noise in the recorded input; both by maximum likelihood, |E(k)|² being exponentially distributed about S(k); g:
//! the mean of |E|²/(w + r|H|²) over neighbouring lines. (P. Whittle, J. R. Stat. Soc. B 15 (1953), 125.)

/// Components of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NoiseParts {
    /// w.
    pub white: f64,
    /// r.
    pub shaped: f64,
    /// Standard uncertainty of r.
    pub shaped_std: f64,
}

/// Number of steps of the search.
const STEPS: usize = 50;
/// Minimum white fraction of the mean power.
const LEAST_WHITE: f64 = 1e-9;

impl NoiseParts {
    /// The components of these powers, where `shape` is |H|² at each line.
    ///
    /// Fisher scoring: regression on 1 and |H|² with the weights 1/S².
    pub fn of(power: &[f64], shape: &[f64]) -> Self {
        let count = power.len() as f64;
        let mean = power.iter().sum::<f64>() / count;
        let scale = shape.iter().sum::<f64>() / count;
        let mut parts = Self {
            white: mean,
            shaped: 0.0,
            shaped_std: 0.0,
        };
        if mean <= 0.0 || scale <= 0.0 {
            return parts;
        }
        for _ in 0..STEPS {
            let [a, b, c, d, e] = parts.sums(power, shape);
            let determinant = a * c - b * b;
            if determinant <= 0.0 {
                break;
            }
            let white = ((c * d - b * e) / determinant).max(LEAST_WHITE * mean);
            let shaped = ((a * e - b * d) / determinant).max(0.0);
            // Half steps avoid oscillation.
            parts.white = 0.5 * (parts.white + white);
            parts.shaped = 0.5 * (parts.shaped + shaped);
            parts.shaped_std = (a / determinant).sqrt();
        }
        parts
    }

    /// Power at a line.
    pub fn at(&self, shape: f64) -> f64 {
        self.white + self.shaped * shape
    }

    /// Σ 1/S², Σ x/S², Σ x²/S², Σ P/S², Σ xP/S² with x = |H|².
    fn sums(&self, power: &[f64], shape: &[f64]) -> [f64; 5] {
        power.iter().zip(shape).fold([0.0; 5], |sums, (p, x)| {
            let w = self.at(*x).powi(-2);
            let of = [w, w * x, w * x * x, w * p, w * x * p];
            [0, 1, 2, 3, 4].map(|i| sums[i] + of[i])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_parts_are_found() {
        // Exponential quantiles in an order without pattern, about 2 + 3x.
        let n = 2000;
        let shape: Vec<f64> = (0..n)
            .map(|k| 1.0 / (0.01 + (k as f64 / n as f64 - 0.5).powi(2)))
            .collect();
        let draw = |k: usize| -(1.0 - ((k * 1237) % n) as f64 / n as f64 - 0.5 / n as f64).ln();
        let power: Vec<f64> = (0..n).map(|k| (2.0 + 3.0 * shape[k]) * draw(k)).collect();
        let found = NoiseParts::of(&power, &shape);
        assert!(
            (found.shaped - 3.0).abs() < 3.0 * found.shaped_std,
            "{found:?}"
        );
        assert!(
            (found.shaped - 3.0).abs() < 0.3 && found.shaped_std < 0.2,
            "{found:?}"
        );
        let flat: Vec<f64> = (0..n).map(|k| 2.0 * draw(k)).collect();
        let found = NoiseParts::of(&flat, &shape);
        assert!(found.shaped < 3.0 * found.shaped_std, "{found:?}");
        assert!((found.white - 2.0).abs() < 0.3, "{found:?}");
    }
}
