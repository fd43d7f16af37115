//! Fits of models to data: nonlinear and linear least squares, with undetermined directions.
//!
//! ```text
//! Parameter(start, bounds) + Residuals ──► minimize ──► Fit: values, std, covariance, StopReason
//! design matrix + right side           ──► linear::solve ──► the same, and undetermined directions
//! ```
//!
//! [`minimize`] is Levenberg's and Marquardt's method with Moré's scaling (J. J. Moré, The
//! Levenberg-Marquardt algorithm: implementation and theory, Lecture Notes in Mathematics 630, 1978)
//! and Nielsen's rule for the damping (H. B. Nielsen, IMM-REP-1999-05), on a problem reduced by
//! orthogonal transformations. Bounds are kept by an active set.
//!
//! ```
//! use torqcomp_model::fit::{Options, Parameter, minimize};
//! // A decay 2 e^(−3t) through five points without noise.
//! let data: Vec<(f64, f64)> = (0..5).map(|i| 0.1 * f64::from(i)).map(|t| (t, 2.0 * (-3.0 * t).exp())).collect();
//! let residuals = |p: &[f64], out: &mut Vec<f64>| {
//!     out.extend(data.iter().map(|(t, y)| p[0] * (-p[1] * t).exp() - y));
//!     Ok(())
//! };
//! let start = [Parameter::new("amplitude", 1.0), Parameter::new("rate", 1.0).at_least(0.0)];
//! let fit = minimize(&residuals, &start, &Options::default())?;
//! assert!((fit.values[0] - 2.0).abs() < 1e-9 && (fit.values[1] - 3.0).abs() < 1e-9);
//! # Ok::<(), torqcomp_model::fit::FitError>(())
//! ```

mod covariance;
mod error;
mod jacobian;
pub mod linear;
mod minimize;
mod parameter;
mod problem;
mod reduce;
mod result;
mod step;

pub use covariance::Undetermined;
pub use error::FitError;
pub use jacobian::derivatives;
pub use minimize::{Options, minimize};
pub use parameter::Parameter;
pub use problem::{Differences, Residuals, WithJacobian};
pub use result::{Fit, StopReason};
