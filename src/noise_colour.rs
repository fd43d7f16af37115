//! Colour of the residual noise of a fit, and the covariance of the fit for such noise.
//!
//! ```text
//! S(f) = Σ_s |R_s(f)|² / Σ_s n_s (1 − h_s(f)),   h_s(f) = Σ_j |Q_sj(f)|² / n_s
//! e_i = a_1 e_(i−1) + … + a_p e_(i−p) + w_i,     S(f) = v / |1 − Σ a_k e^(−j2πfk)|²
//! Cov = R⁻¹ Qᵀ Ω Q R⁻ᵀ
//! ```
//!
//! R_s: transform of the residual of segment s with n_s samples; Q R = J: the derivatives with respect to all
//! parameters; h_s: fraction of the noise absorbed by the fit at a frequency f in cycles per sample; a_k, v:
//! autoregression of the order that minimises Akaike's criterion, from the autocovariances of S by Levinson's
//! recursion; Ω: covariance of the noise with that spectrum. For white noise, Cov is s² (JᵀJ)⁻¹. (P. Stoica, R. Moses,
//! Spectral Analysis of Signals, 2005, 3.4; W. K. Newey, K. D. West, Econometrica 55 (1987), 703, for covariances of
//! this form.)
//!
//! The spectrum itself is estimated from only n samples, so a variance u = Σ_f w(f) S(f) has as many degrees of freedom
//! as a chi-square of the same relative variance; the standard uncertainty is enlarged by Student's quantile for them,
//! so that ±1.96 of it cover 95 %:
//!
//! ```text
//! ν = 2 u²/var(u),   var(u) = 2 u²/n + (∂u/∂a)ᵀ (v/n) Γ⁻¹ (∂u/∂a),   ∂S/∂a_k = 2 S Re(e^(−j2πfk)/(1 − Σ a_m e^(−j2πfm)))
//! ```
//!
//! An autoregression does not resolve a narrow peak. Where one is expected, the spectrum is multiplied by the ratio
//! of the residuals' power to its expectation around each frequency, `Σ_b |R|² / Σ_b E|R|²` over the bins b within a
//! half-width, and `var(u) = (m/n) Σ_f ū(f)²` with `ū` the contributions to u averaged over the same bins and m the
//! length of the transform.
//!
//! Γ: autocovariances of the noise, p by p. (JCGM 100:2008, G.4; P. J. Brockwell, R. A. Davis, Time Series, 1991, 8.1.)

mod transformed;

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::student::student;
use transformed::{MOST_ABSORBED, Transformed, inverse, transformed};

/// Maximum order of the autoregression, and minimum number of samples per order.
const MOST_ORDERS: usize = 40;
const SAMPLES_PER_ORDER: usize = 10;
/// Number of re-estimates of the colour with the absorption for noise of the last colour.
const REFINEMENTS: usize = 2;
/// Minimum degrees of freedom for a meaningful linear estimate.
const LEAST_FREEDOM: f64 = 2.0;

/// An autoregression of noise, in samples.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseColour {
    coefficients: Vec<f64>,
    /// v, in squared units of the samples.
    innovation: f64,
    /// Autocovariances from lag 0, which is the variance of the noise, to the order.
    covariances: Vec<f64>,
    /// Number of samples that it was estimated from.
    count: usize,
    /// Correction to the spectrum of the autoregression, if it is resolved more finely.
    detail: Option<SpectrumDetail>,
}

/// Factors on a spectrum, averaged over neighbouring bins.
#[derive(Debug, Clone, PartialEq)]
struct SpectrumDetail {
    /// One per bin.
    factors: Vec<f64>,
    /// Half-width of the averages, in bins.
    half_width: usize,
}

/// Minimum half-width for averaging a spectrum, in bins of the record.
const LEAST_HALF_WIDTH: f64 = 4.0;

/// The noise colour of each group of segments, and the covariance of the parameters; `None` if the derivatives are
/// linearly dependent.
///
/// `stretches`: residuals of each segment; `groups`: segments of one sampling rate; `jacobian`: derivatives with
/// respect to the parameters, over all segments. If `wanted` is not 0, the colour allows for absorption by the fit, and
/// the covariance of the first `wanted` parameters for the uncertainty of the spectrum. With `peaks_rad`, peaks of that
/// half-width in rad per sample are resolved.
pub fn learn(
    stretches: &[Vec<f64>],
    groups: &[Range<usize>],
    jacobian: &DMatrix<f64>,
    wanted: usize,
    peaks_rad: Option<f64>,
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
    let inverse = r.solve_upper_triangular(&DMatrix::identity(sizes.len(), sizes.len()))?;
    let groups: Vec<&[Transformed]> = groups.iter().map(|g| &transformed[g.clone()]).collect();
    let (colours, middle) = colours_of(&groups, size, sizes.len(), wanted > 0, peaks_rad);
    let rows = inverse.rows(0, wanted.min(sizes.len())).into_owned();
    let none = DVector::zeros(rows.nrows());
    let variances = colours.iter().zip(&groups).fold(none, |sum, (c, g)| {
        sum + c.variances_of_variances(g, size, &rows)
    });
    let mut covariance = &inverse * middle * inverse.transpose();
    let enlarged = |i: usize| match i < wanted {
        true => student((2.0 * covariance[(i, i)].powi(2) / variances[i]).max(LEAST_FREEDOM)),
        false => 1.0,
    };
    let factors: Vec<f64> = (0..sizes.len()).map(|i| enlarged(i) / sizes[i]).collect();
    for i in 0..sizes.len() {
        for j in 0..sizes.len() {
            covariance[(i, j)] *= factors[i] * factors[j];
        }
    }
    let is_finite = covariance.iter().all(|v| v.is_finite());
    is_finite.then_some((colours, covariance))
}

/// The noise colour of each group of segments and QᵀΩQ, of as many rows as there are `parameters`; refined for
/// absorption by the fit, and with peaks of that half-width in rad per sample, if requested.
fn colours_of(
    groups: &[&[Transformed]],
    size: usize,
    parameters: usize,
    is_refined: bool,
    peaks_rad: Option<f64>,
) -> (Vec<NoiseColour>, DMatrix<f64>) {
    let gathered = |colours: &[NoiseColour]| {
        let pairs = colours.iter().zip(groups);
        pairs.fold(DMatrix::zeros(parameters, parameters), |sum, (c, g)| {
            sum + c.gathered(g, size, parameters)
        })
    };
    let first = groups.iter().map(|g| NoiseColour::first(g, size));
    let mut colours: Vec<NoiseColour> = first.collect();
    let mut middle = gathered(&colours);
    for _ in 0..if is_refined { REFINEMENTS } else { 0 } {
        let pairs = colours.iter().zip(groups);
        colours = pairs.map(|(c, g)| c.refined(g, size, &middle)).collect();
        middle = gathered(&colours);
    }
    if let Some(width_rad) = peaks_rad {
        let pairs = colours.into_iter().zip(groups);
        colours = pairs
            .map(|(c, g)| c.with_detail(g, size, &middle, width_rad))
            .collect();
        middle = gathered(&colours);
    }
    (colours, middle)
}

/// Power of the residuals and its expectation, per bin.
fn powers(
    stretches: &[Transformed],
    size: usize,
    expected: impl Fn(&Transformed) -> Vec<f64>,
) -> Vec<(f64, f64)> {
    let mut sums = vec![(0.0, 0.0); size / 2 + 1];
    for stretch in stretches {
        let pairs = stretch.residual.iter().zip(expected(stretch));
        for (sum, (residual, expected)) in sums.iter_mut().zip(pairs) {
            sum.0 += residual.norm_sqr();
            sum.1 += expected;
        }
    }
    sums
}

/// Sum and number of the values around each value.
fn around(values: impl Iterator<Item = f64>, half_width: usize) -> Vec<(f64, f64)> {
    let mut sums = vec![0.0];
    for value in values {
        sums.push(sums[sums.len() - 1] + value);
    }
    let count = sums.len() - 1;
    let of = |k: usize| {
        let (from, to) = (
            k.saturating_sub(half_width),
            (k + half_width + 1).min(count),
        );
        (sums[to] - sums[from], (to - from) as f64)
    };
    (0..count).map(of).collect()
}

impl NoiseColour {
    /// White noise of this variance, from `count` samples.
    pub fn white(variance: f64, count: usize) -> Self {
        Self {
            coefficients: Vec::new(),
            innovation: variance,
            covariances: vec![variance],
            count,
            detail: None,
        }
    }

    /// Noise colour of residuals, given their expectation for noise of a known density.
    fn of(
        stretches: &[Transformed],
        size: usize,
        expected: impl Fn(&Transformed) -> Vec<f64>,
        density: impl Fn(usize) -> f64,
    ) -> Self {
        let sums = powers(stretches, size, expected);
        let bins = sums.iter().enumerate();
        let mut spectrum: Vec<Complex64> = bins
            .map(|(k, sum)| Complex64::new(density(k) * sum.0 / sum.1, 0.0))
            .collect();
        let covariances = inverse(&mut spectrum, size);
        let count: usize = stretches.iter().map(|s| s.count).sum();
        Self::from_autocovariances(&covariances, count)
    }

    /// Initial estimate, as if the noise were white.
    fn first(stretches: &[Transformed], size: usize) -> Self {
        let expected = |stretch: &Transformed| {
            let count = stretch.count as f64;
            let absorbed = |k: usize| stretch.columns.iter().map(|c| c[k].norm_sqr()).sum::<f64>();
            let left = (0..=size / 2).map(|k| count - absorbed(k));
            left.map(|left| left.max((1.0 - MOST_ABSORBED) * count))
                .collect()
        };
        Self::of(stretches, size, expected, |_| 1.0)
    }

    /// Noise colour of the residuals, assuming that the fit absorbs noise of the present colour;
    /// `middle`: QᵀΩQ.
    fn refined(&self, stretches: &[Transformed], size: usize, middle: &DMatrix<f64>) -> Self {
        let density = self.of_bins(size);
        let expected = |stretch: &Transformed| stretch.left(&density, size, middle);
        Self::of(stretches, size, expected, |k| density[k])
    }

    /// The same with the peaks of the residuals resolved, with a half-width in rad per sample.
    fn with_detail(
        self,
        stretches: &[Transformed],
        size: usize,
        middle: &DMatrix<f64>,
        width_rad: f64,
    ) -> Self {
        let density = self.of_bins(size);
        let sums = powers(stretches, size, |s| s.left(&density, size, middle));
        let bins = size as f64 / TAU * width_rad;
        let longest = stretches.iter().map(|s| s.count).max().unwrap_or(size);
        let least = LEAST_HALF_WIDTH * size as f64 / longest as f64;
        let half_width = bins.max(least) as usize;
        let found = around(sums.iter().map(|sum| sum.0), half_width);
        let expected = around(sums.iter().map(|sum| sum.1), half_width);
        let pairs = found.iter().zip(&expected);
        let factors = pairs
            .map(|(f, e)| if e.0 > 0.0 { f.0 / e.0 } else { 1.0 })
            .collect();
        Self {
            detail: Some(SpectrumDetail {
                factors,
                half_width,
            }),
            ..self
        }
    }

    /// S in each bin of a transform.
    fn of_bins(&self, size: usize) -> Vec<f64> {
        let of_bin = |k: usize| {
            let factor = self.detail.as_ref().map_or(1.0, |detail| detail.factors[k]);
            factor * self.density(TAU * k as f64 / size as f64)
        };
        (0..=size / 2).map(of_bin).collect()
    }

    /// The autoregression of the order that minimises the criterion, by Levinson's recursion.
    fn from_autocovariances(covariances: &[f64], count: usize) -> Self {
        let known = covariances.len() - 1;
        let most = MOST_ORDERS.min(count / SAMPLES_PER_ORDER).min(known);
        let mut innovation = covariances[0];
        let mut coefficients: Vec<f64> = Vec::new();
        let mut best = Self::white(innovation, count);
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
                    covariances: covariances[..=order].to_vec(),
                    count,
                    detail: None,
                };
            }
        }
        best
    }

    /// S at an angular frequency in rad per sample: the variance of white noise with the same power
    /// there.
    pub fn density(&self, rad_per_sample: f64) -> f64 {
        self.innovation / self.whitener(rad_per_sample).norm_sqr()
    }

    /// 1 − Σ a_k e^(−jωk).
    fn whitener(&self, rad_per_sample: f64) -> Complex64 {
        let turn = Complex64::cis(-rad_per_sample);
        let powers = self.coefficients.iter().rev();
        // Horner's rule.
        let sum = powers.fold(Complex64::ZERO, |sum, a| (sum + a) * turn);
        Complex64::ONE - sum
    }

    /// Variance of the noise.
    pub fn variance(&self) -> f64 {
        self.covariances[0]
    }

    /// S at an angular frequency in rad per sample relative to the variance of the noise; 1 for white
    /// noise.
    pub fn relative_density(&self, rad_per_sample: f64) -> f64 {
        match self.variance() > 0.0 {
            true => self.density(rad_per_sample) / self.variance(),
            false => 1.0,
        }
    }

    /// Noise power in each bin of a transform, including its mirror image.
    fn densities(&self, size: usize) -> Vec<f64> {
        let bins = self.of_bins(size).into_iter().enumerate();
        let of_bin = |(k, density): (usize, f64)| {
            let sides = if k == 0 || k == size / 2 { 1.0 } else { 2.0 };
            sides * density / size as f64
        };
        bins.map(of_bin).collect()
    }

    /// var(u) of the noise variances u of the sums of the columns times the factors in each of these rows.
    fn variances_of_variances(
        &self,
        stretches: &[Transformed],
        size: usize,
        rows: &DMatrix<f64>,
    ) -> DVector<f64> {
        let of_row = |factors: &[f64], k: usize| {
            let of_stretch = |stretch: &Transformed| {
                let parts = stretch.columns.iter().zip(factors);
                parts.map(|(c, f)| c[k] * f).sum::<Complex64>().norm_sqr()
            };
            stretches.iter().map(of_stretch).sum::<f64>()
        };
        let factors: Vec<Vec<f64>> = rows
            .row_iter()
            .map(|row| row.iter().copied().collect())
            .collect();
        if let Some(detail) = &self.detail {
            let density = self.densities(size);
            let each = factors.iter().map(|factors| {
                let parts = density.iter().enumerate();
                let parts = parts.map(|(k, density)| density * of_row(factors, k));
                let means = around(parts, detail.half_width).into_iter();
                let squares: f64 = means.map(|(sum, count)| (sum / count).powi(2)).sum();
                size as f64 / self.count as f64 * squares
            });
            return DVector::from_vec(each.collect());
        }
        let order = self.coefficients.len();
        let mut variances = DVector::zeros(rows.nrows());
        let mut slopes = DMatrix::zeros(order, rows.nrows());
        for (k, density) in self.densities(size).into_iter().enumerate() {
            let angle = TAU * k as f64 / size as f64;
            let whitener = self.whitener(angle);
            let turn = Complex64::cis(-angle);
            let first = 2.0 * turn / whitener;
            let along = std::iter::successors(Some(first), |last| Some(last * turn));
            let along = DVector::from_iterator(order, along.map(|along| along.re).take(order));
            for (i, factors) in factors.iter().enumerate() {
                let part = density * of_row(factors, k);
                variances[i] += part;
                slopes.column_mut(i).axpy(part, &along, 1.0);
            }
        }
        let lags = DMatrix::from_fn(order, order, |i, j| self.covariances[i.abs_diff(j)]);
        let inverse = lags.cholesky();
        let of_row = |i: usize, variance: f64| {
            let slope = slopes.column(i);
            let along = inverse
                .as_ref()
                .map_or(0.0, |c| slope.dot(&c.solve(&slope)));
            (2.0 * variance * variance + self.innovation * along) / self.count as f64
        };
        DVector::from_fn(rows.nrows(), |i, _| of_row(i, variances[i]))
    }

    /// Qᵀ Ω Q.
    fn gathered(&self, stretches: &[Transformed], size: usize, columns: usize) -> DMatrix<f64> {
        let density = self.densities(size);
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
        // 1/(1 − 0.8)² at DC, 1/(1 + 0.8)² at the Nyquist frequency.
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
            covariances: vec![1.0 / 0.36, 0.8 / 0.36],
            count: n,
            detail: None,
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
