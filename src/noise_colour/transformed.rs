//! Transforms of residuals and of the orthonormalised derivatives of a fit.

use nalgebra::DMatrix;
use num_complex::Complex64;

/// Largest fraction of the noise that counts as absorbed at a frequency.
pub(super) const MOST_ABSORBED: f64 = 0.8;

/// Residuals of a segment with the transforms of its orthonormalised derivatives.
pub(super) struct Transformed {
    pub count: usize,
    pub residual: Vec<Complex64>,
    pub columns: Vec<Vec<Complex64>>,
}

/// Of each segment, padded to a size; `q`: orthonormalised derivatives over all segments.
pub(super) fn transformed(
    stretches: &[Vec<f64>],
    q: &DMatrix<f64>,
    size: usize,
) -> Vec<Transformed> {
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

/// Inverse transform.
pub(super) fn inverse(spectrum: &mut [Complex64], size: usize) -> Vec<f64> {
    let plan = torqcomp_fourier::inverse(size);
    let mut samples = plan.make_output_vec();
    plan.process(spectrum, &mut samples)
        .expect("buffers were made for this length");
    samples.iter_mut().for_each(|v| *v /= size as f64);
    samples
}

impl Transformed {
    /// Expected |R(f)|² for noise of this density, at least what a fit leaves at most frequencies.
    pub fn left(&self, density: &[f64], size: usize, middle: &DMatrix<f64>) -> Vec<f64> {
        let least = (1.0 - MOST_ABSORBED) * self.count as f64;
        let each = self.expected(density, size, middle);
        let pairs = each.into_iter().zip(density);
        pairs.map(|(e, s)| e.max(least * s)).collect()
    }

    /// Expected |R(f)|² for noise of this density.
    pub fn expected(&self, density: &[f64], size: usize, middle: &DMatrix<f64>) -> Vec<f64> {
        let forward = torqcomp_fourier::forward(size);
        let transform = |mut samples: Vec<f64>| {
            let mut out = forward.make_output_vec();
            forward
                .process(&mut samples, &mut out)
                .expect("buffers were made for this length");
            out
        };
        let mut spectrum: Vec<Complex64> = density.iter().map(|s| (*s).into()).collect();
        let mut lags = inverse(&mut spectrum, size);
        for (lag, covariance) in lags.iter_mut().enumerate() {
            *covariance *= self.count.saturating_sub(lag.min(size - lag)) as f64;
        }
        let mut expected: Vec<f64> = transform(lags).iter().map(|s| s.re).collect();
        for (i, column) in self.columns.iter().enumerate() {
            let mut coloured: Vec<Complex64> =
                column.iter().zip(density).map(|(c, s)| c * s).collect();
            let mut inside = inverse(&mut coloured, size);
            inside[self.count..].fill(0.0);
            let others = self.columns.iter().enumerate();
            let mut both = transform(inside);
            both.iter_mut().for_each(|b| *b *= -2.0);
            for (j, other) in others {
                for (b, o) in both.iter_mut().zip(other) {
                    *b += middle[(i, j)] * o;
                }
            }
            for ((e, c), b) in expected.iter_mut().zip(column).zip(both) {
                *e += c.re * b.re + c.im * b.im;
            }
        }
        expected
    }
}
