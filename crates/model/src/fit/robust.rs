//! Fits that are robust against outliers.

use super::{Fit, FitError, Options, Parameter, Residuals, minimize};

/// Loss as a function of a residual in robust standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loss {
    /// Huber: squares up to `k` (1.345 keeps 95 % efficiency), linear beyond.
    Huber {
        /// Where it becomes linear.
        k: f64,
    },
    /// Tukey's biweight: weight 0 beyond `k` (4.685 keeps 95 % efficiency).
    Biweight {
        /// Where the weight becomes 0.
        k: f64,
    },
}

impl Loss {
    /// Weight of the square of a residual of `u` standard deviations.
    ///
    /// P. J. Huber, E. M. Ronchetti, Robust Statistics, 2nd ed., 4.5 and 4.8.
    ///
    /// ```
    /// use torqcomp_model::fit::Loss;
    /// assert_eq!(Loss::Huber { k: 1.5 }.weight(3.0), 0.5);
    /// // (1 − (2/4)²)² = 0.5625.
    /// assert_eq!(Loss::Biweight { k: 4.0 }.weight(2.0), 0.5625);
    /// ```
    #[must_use]
    pub fn weight(self, u: f64) -> f64 {
        match self {
            Self::Huber { k } if u.abs() <= k => 1.0,
            Self::Huber { k } => k / u.abs(),
            Self::Biweight { k } if u.abs() < k => (1.0 - (u / k).powi(2)).powi(2),
            Self::Biweight { .. } => 0.0,
        }
    }
}

/// A fit with the weights of its residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct Robust {
    /// The fit; its residuals are weighted.
    pub fit: Fit,
    /// Weight of the square of each residual, 0 to 1.
    pub weights: Vec<f64>,
    /// Robust standard deviation of the residuals: 1.4826 times their median size.
    pub scale: f64,
}

/// Most rounds of reweighting.
const ROUNDS: usize = 30;
/// Change of the weights at convergence.
const SETTLED: f64 = 1e-4;

/// Iteratively reweighted least squares. The uncertainties are those of the last weighted fit.
///
/// # Errors
/// As [`minimize`].
pub fn minimize_robust(
    problem: &dyn Residuals,
    parameters: &[Parameter],
    options: &Options,
    loss: Loss,
) -> Result<Robust, FitError> {
    let mut fit = minimize(problem, parameters, options)?;
    let base = options
        .weights
        .clone()
        .unwrap_or_else(|| vec![1.0; fit.residuals.len()]);
    let mut weights = vec![1.0; base.len()];
    let mut scale = 0.0;
    for _ in 0..ROUNDS {
        let plain = unweighted(problem, &fit.values, &base)?;
        scale = 1.4826 * median_size(&plain);
        if scale == 0.0 {
            break;
        }
        let next: Vec<f64> = plain.iter().map(|r| loss.weight(r / scale)).collect();
        let change = next
            .iter()
            .zip(&weights)
            .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        weights = next;
        let start: Vec<Parameter> = parameters
            .iter()
            .zip(&fit.values)
            .map(|(p, v)| Parameter {
                start: *v,
                ..p.clone()
            })
            .collect();
        let factors = base
            .iter()
            .zip(&weights)
            .map(|(b, w)| b * w.sqrt())
            .collect();
        let weighted = Options {
            weights: Some(factors),
            ..options.clone()
        };
        fit = minimize(problem, &start, &weighted)?;
        if change < SETTLED {
            break;
        }
    }
    Ok(Robust {
        fit,
        weights,
        scale,
    })
}

fn unweighted(problem: &dyn Residuals, values: &[f64], base: &[f64]) -> Result<Vec<f64>, FitError> {
    let mut out = Vec::with_capacity(base.len());
    problem.residuals(values, &mut out)?;
    out.iter_mut().zip(base).for_each(|(r, b)| *r *= b);
    Ok(out)
}

fn median_size(residuals: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
    let middle = sizes.len() / 2;
    if sizes.is_empty() {
        return 0.0;
    }
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}
