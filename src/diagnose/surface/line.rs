//! Removal of the straight line in a curve, which belongs to the stand's constants.

/// Subtracts the weighted least-squares line from values at some positions.
pub fn clear_line(values: &mut [f64], at: &[f64], weight: impl Fn(usize) -> f64) {
    let sum = |of: &dyn Fn(usize) -> f64| -> f64 {
        let all = 0..at.len();
        all.map(|k| weight(k) * of(k)).sum()
    };
    let count = sum(&|_| 1.0);
    let (mean_x, mean_y) = (sum(&|k| at[k]) / count, sum(&|k| values[k]) / count);
    let square = sum(&|k| (at[k] - mean_x).powi(2)).max(1e-300);
    let slope = sum(&|k| (at[k] - mean_x) * (values[k] - mean_y)) / square;
    for (y, x) in values.iter_mut().zip(at) {
        *y -= mean_y + slope * (x - mean_x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_bent() {
        // With equal weights, x² over −1, 0, 1 leaves 1/3, −2/3, 1/3; a value of zero weight is
        // ignored.
        let mut values = [1.0 + 2.0 - 5.0, 2.0, 1.0 + 2.0 + 5.0, 1e6];
        let weights = [1.0, 1.0, 1.0, 0.0];
        clear_line(&mut values, &[-1.0, 0.0, 1.0, 3.0], |k| weights[k]);
        for (got, want) in values.iter().zip([1.0 / 3.0, -2.0 / 3.0, 1.0 / 3.0]) {
            assert!((got - want).abs() < 1e-12, "{values:?}");
        }
    }
}
