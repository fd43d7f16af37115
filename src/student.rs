//! Student's factor for coverage intervals.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// 97.5 % quantile of the normal distribution.
const NORMAL: f64 = 1.959_963_984_540_054;
/// Degrees of freedom from which the expansion about the normal quantile is exact to rounding. The iteration of
/// `statrs` does not terminate for some values above 10⁷.
const MANY: f64 = 1e4;

/// Ratio of Student's 97.5 % quantile to the normal one.
pub fn student(freedom: f64) -> f64 {
    if freedom.is_infinite() {
        return 1.0;
    }
    if freedom >= MANY {
        return expansion(freedom);
    }
    let quantile = StudentsT::new(0.0, 1.0, freedom).map(|d| d.inverse_cdf(0.975));
    quantile.map_or(1.0, |q| q / NORMAL)
}

/// The expansion in powers of 1/freedom (M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions, 26.7.5).
fn expansion(freedom: f64) -> f64 {
    let square = NORMAL * NORMAL;
    let polynomials = [
        (square + 1.0) / 4.0,
        ((5.0 * square + 16.0) * square + 3.0) / 96.0,
        (((3.0 * square + 19.0) * square + 17.0) * square - 15.0) / 384.0,
    ];
    let terms = polynomials.iter().rev();
    1.0 + terms.fold(0.0, |sum, p| (sum + p) / freedom)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_expansion_meets_the_exact_quantile() {
        let exact = StudentsT::new(0.0, 1.0, MANY).unwrap().inverse_cdf(0.975) / NORMAL;
        assert!((student(MANY) - exact).abs() < 1e-12);
        // Tables: 1.96234 for 1000 degrees of freedom.
        assert!((student(1000.0) * NORMAL - 1.962_34).abs() < 1e-5);
    }

    /// Degrees of freedom for which the iteration of the quantile did not terminate.
    #[test]
    fn very_many_degrees_of_freedom_end() {
        for freedom in [1.45e7, 1.48e7, 1.62e7, 1e12, 1e34] {
            let factor = student(freedom);
            assert!((factor - 1.0).abs() < 1e-6 && factor >= 1.0, "{freedom}");
        }
    }
}
