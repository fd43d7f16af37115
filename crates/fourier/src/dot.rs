//! Sums of products.

/// Sum of products.
///
/// ```
/// // 1·4 + 2·5 + 3·6
/// assert_eq!(torqcomp_fourier::dot(&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0]), 32.0);
/// ```
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Eight independent sums, so that no addition depends on the one before.
    let mut sums = [0.0_f64; 8];
    let (eights_a, rest_a) = a.as_chunks::<8>();
    let (eights_b, rest_b) = b.as_chunks::<8>();
    for (x, y) in eights_a.iter().zip(eights_b) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(x, y)| x * y).sum();
    sums.iter().sum::<f64>() + rest
}

/// Root of the mean square; 0 for no values.
///
/// ```
/// // (9 + 16)/2 = 12.5
/// assert_eq!(torqcomp_fourier::rms(&[3.0, -4.0]), 12.5_f64.sqrt());
/// ```
#[must_use]
pub fn rms(values: &[f64]) -> f64 {
    (dot(values, values) / values.len().max(1) as f64).sqrt()
}
