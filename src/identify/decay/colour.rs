//! Colour of the noise in decays, and the covariance of a fit in it.
//!
//! ```text
//! S(f) = Σ_s |R_s(f)|² / Σ_s n_s (1 − h_s(f)),   h_s(f) = Σ_j |Q_sj(f)|² / n_s
//! e_i = a_1 e_(i−1) + … + a_p e_(i−p) + w_i,     S(f) = v / |1 − Σ a_k e^(−j2πfk)|²
//! Cov = R⁻¹ Qᵀ Ω Q R⁻ᵀ
//! ```
//!
//! R_s: transform of the residual of stretch s with n_s samples; Q R = J: the derivatives by all parameters; h_s: part of
//! the noise that the fit absorbs at a frequency f in cycles per sample; a_k, v: autoregression of the order that
//! minimises Akaike's criterion, from the autocovariances of S by Levinson's recursion; Ω: covariance of the noise with
//! that spectrum. For white noise, Cov is s² (JᵀJ)⁻¹. (P. Stoica, R. Moses, Spectral Analysis of Signals, 2005, 3.4;
//! W. K. Newey, K. D. West, Econometrica 55 (1987), 703, for covariances of this form.)

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::DMatrix;
use num_complex::Complex64;

/// Highest order of the autoregression, and fewest samples for each order.
const MOST_ORDERS: usize = 40;
const SAMPLES_PER_ORDER: usize = 10;
/// Largest part of the noise that counts as absorbed at a frequency.
const MOST_ABSORBED: f64 = 0.8;

/// An autoregression of noise, in samples.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NoiseColour {
    coefficients: Vec<f64>,
    /// v, in squared units of the samples.
    innovation: f64,
    /// Variance of the noise.
    variance: f64,
}

/// Residuals of a stretch with the transforms of its orthonormal derivatives.
struct Transformed {
    count: usize,
    residual: Vec<Complex64>,
    columns: Vec<Vec<Complex64>>,
}

/// The colour of the noise in each group of stretches, and the covariance of the parameters; `None` if the derivatives are
/// dependent.
///
/// `stretches`: residuals of each stretch; `groups`: stretches of one sampling rate; `jacobian`: derivatives by the
/// parameters, over all stretches.
pub(super) fn learn(
    stretches: &[Vec<f64>],
    groups: &[Range<usize>],
    jacobian: &DMatrix<f64>,
) -> Option<(Vec<NoiseColour>, DMatrix<f64>)> {
    let sizes: Vec<f64> = jacobian.column_iter().map(|c| c.norm()).collect();
    if sizes.contains(&0.0) {
        return None;
    }
    let mut scaled = jacobian.clone();
    for (mut column, size) in scaled.column_iter_mut().zip(&sizes) {
        column.unscale_mut(*size);
    }
    let qr = scaled.qr();
    let (q, r) = (qr.q(), qr.r());
    let longest = stretches.iter().map(Vec::len).max()?;
    let size = (2 * longest).next_power_of_two();
    let transformed = transformed(stretches, &q, size);
    let mut middle = DMatrix::zeros(sizes.len(), sizes.len());
    let mut colours = Vec::with_capacity(groups.len());
    for group in groups {
        let colour = NoiseColour::of(&transformed[group.clone()], size);
        middle += colour.gathered(&transformed[group.clone()], size, sizes.len());
        colours.push(colour);
    }
    let inverse = r.solve_upper_triangular(&DMatrix::identity(sizes.len(), sizes.len()))?;
    let mut covariance = &inverse * middle * inverse.transpose();
    for i in 0..sizes.len() {
        for j in 0..sizes.len() {
            covariance[(i, j)] /= sizes[i] * sizes[j];
        }
    }
    let is_finite = covariance.iter().all(|v| v.is_finite());
    is_finite.then_some((colours, covariance))
}

fn transformed(stretches: &[Vec<f64>], q: &DMatrix<f64>, size: usize) -> Vec<Transformed> {
    let plan = torqcomp_fourier::forward(size);
    let spectrum = |samples: &[f64]| {
        let mut padded = samples.to_vec();
        padded.resize(size, 0.0);
        let mut out = plan.make_output_vec();
        plan.process(&mut padded, &mut out)
            .expect("buffers were made for this length");
        out
    };
    let mut from = 0;
    let mut all = Vec::new();
    for residual in stretches {
        let rows = from..from + residual.len();
        from = rows.end;
        let columns = q.column_iter();
        all.push(Transformed {
            count: residual.len(),
            residual: spectrum(residual),
            columns: columns
                .map(|c| spectrum(&c.as_slice()[rows.clone()]))
                .collect(),
        });
    }
    all
}

impl NoiseColour {
    /// White noise of that variance.
    pub(super) fn white(variance: f64) -> Self {
        Self {
            coefficients: Vec::new(),
            innovation: variance,
            variance,
        }
    }

    fn of(stretches: &[Transformed], size: usize) -> Self {
        let spectrum = (0..=size / 2).map(|k| {
            let mut sums = (0.0, 0.0);
            for stretch in stretches {
                let absorbed: f64 = stretch.columns.iter().map(|c| c[k].norm_sqr()).sum();
                let count = stretch.count as f64;
                sums.0 += stretch.residual[k].norm_sqr();
                sums.1 += (count - absorbed).max((1.0 - MOST_ABSORBED) * count);
            }
            Complex64::new(sums.0 / sums.1, 0.0)
        });
        let mut spectrum: Vec<Complex64> = spectrum.collect();
        let plan = torqcomp_fourier::inverse(size);
        let mut covariances = plan.make_output_vec();
        plan.process(&mut spectrum, &mut covariances)
            .expect("buffers were made for this length");
        covariances.iter_mut().for_each(|c| *c /= size as f64);
        let count: usize = stretches.iter().map(|s| s.count).sum();
        Self::from_autocovariances(&covariances, count)
    }

    /// The autoregression of the order with the least criterion, by Levinson's recursion.
    fn from_autocovariances(covariances: &[f64], count: usize) -> Self {
        let known = covariances.len() - 1;
        let most = MOST_ORDERS.min(count / SAMPLES_PER_ORDER).min(known);
        let mut innovation = covariances[0];
        let mut coefficients: Vec<f64> = Vec::new();
        let mut best = Self::white(innovation);
        let criterion =
            |innovation: f64, order: usize| count as f64 * innovation.ln() + 2.0 * order as f64;
        let mut least = criterion(innovation, 0);
        for order in 1..=most {
            let predicted = coefficients.iter().enumerate();
            let predicted: f64 = predicted.map(|(k, a)| a * covariances[order - 1 - k]).sum();
            let reflection = (covariances[order] - predicted) / innovation;
            if reflection.is_nan() || reflection.abs() >= 1.0 {
                break;
            }
            let before = coefficients.clone();
            for (k, a) in coefficients.iter_mut().enumerate() {
                *a -= reflection * before[before.len() - 1 - k];
            }
            coefficients.push(reflection);
            innovation *= 1.0 - reflection * reflection;
            if criterion(innovation, order) < least {
                least = criterion(innovation, order);
                best = Self {
                    coefficients: coefficients.clone(),
                    innovation,
                    variance: covariances[0],
                };
            }
        }
        best
    }

    /// S at an angular frequency in rad per sample: the variance of white noise with as much power there.
    pub(super) fn density(&self, rad_per_sample: f64) -> f64 {
        let turned = |(k, a): (usize, &f64)| *a * Complex64::cis(-rad_per_sample * (k + 1) as f64);
        let sum: Complex64 = self.coefficients.iter().enumerate().map(turned).sum();
        self.innovation / (Complex64::ONE - sum).norm_sqr()
    }

    /// Variance of the noise.
    pub(super) fn variance(&self) -> f64 {
        self.variance
    }

    /// S at an angular frequency in rad per sample over the variance of the noise; 1 for white noise.
    pub(super) fn relative_density(&self, rad_per_sample: f64) -> f64 {
        match self.variance > 0.0 {
            true => self.density(rad_per_sample) / self.variance,
            false => 1.0,
        }
    }

    /// Qᵀ Ω Q.
    fn gathered(&self, stretches: &[Transformed], size: usize, columns: usize) -> DMatrix<f64> {
        let density: Vec<f64> = (0..=size / 2)
            .map(|k| {
                // Every bin but the first and the last stands for its mirror image too.
                let sides = if k == 0 || k == size / 2 { 1.0 } else { 2.0 };
                sides * self.density(TAU * k as f64 / size as f64) / size as f64
            })
            .collect();
        let mut sum = DMatrix::zeros(columns, columns);
        for stretch in stretches {
            for i in 0..columns {
                for j in 0..=i {
                    let pairs = stretch.columns[i].iter().zip(&stretch.columns[j]);
                    let weighted = pairs.zip(&density);
                    sum[(i, j)] += weighted
                        .map(|((a, b), s)| s * (a.re * b.re + a.im * b.im))
                        .sum::<f64>();
                }
            }
        }
        sum.fill_upper_triangle_with_lower_triangle();
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_autoregression_is_found_from_its_autocovariances() {
        // x = 0.8 x' + w with variance 1 of w: γ_k = 0.8^k/(1 − 0.64).
        let covariances: Vec<f64> = (0..30).map(|k| 0.8_f64.powi(k) / 0.36).collect();
        let found = NoiseColour::from_autocovariances(&covariances, 300);
        assert_eq!(found.coefficients.len(), 1);
        assert!((found.coefficients[0] - 0.8).abs() < 1e-12);
        // 1/(1 − 0.8)² at rest, 1/(1 + 0.8)² at half the rate.
        assert!((found.density(0.0) - 25.0).abs() < 1e-9);
        assert!((found.density(std::f64::consts::PI) - 1.0 / 3.24).abs() < 1e-9);
        assert!((found.relative_density(0.0) - 9.0).abs() < 1e-9);
    }

    /// The mean of n samples of first-order noise has the variance Σ γ_(i−j)/n².
    #[test]
    fn the_mean_of_coloured_noise_is_as_uncertain_as_it_is() {
        let n = 200;
        let colour = NoiseColour {
            coefficients: vec![0.8],
            innovation: 1.0,
            variance: 1.0 / 0.36,
        };
        let q = DMatrix::from_element(n, 1, 1.0 / (n as f64).sqrt());
        let size = 512;
        let all = transformed(&[vec![0.0; n]], &q, size);
        let got = colour.gathered(&all, size, 1)[(0, 0)] / n as f64;
        let want: f64 = (0..n * n)
            .map(|k| 0.8_f64.powi((k / n).abs_diff(k % n) as i32) / 0.36)
            .sum::<f64>()
            / (n * n) as f64;
        assert!((got / want - 1.0).abs() < 1e-9, "{got} {want}");
    }
}
