//! Parameters of a fit and their bounds.

use super::FitError;

/// A parameter of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name in reports.
    pub name: String,
    /// Start value, within the bounds.
    pub start: f64,
    /// Lower bound, or −∞.
    pub lower: f64,
    /// Upper bound, or +∞.
    pub upper: f64,
    /// Size of a relevant change, greater than 0; sets the finite-difference step where the value is
    /// small.
    pub scale: f64,
    /// Whether it is fixed at its start value.
    pub fixed: bool,
}

impl Parameter {
    /// A free parameter without bounds, with the magnitude of its start (or 1) as scale.
    ///
    /// ```
    /// use torqcomp_model::fit::Parameter;
    /// let rate = Parameter::new("rate", 20.0).at_least(0.0);
    /// assert_eq!((rate.scale, rate.lower, rate.upper), (20.0, 0.0, f64::INFINITY));
    /// ```
    #[must_use]
    pub fn new(name: impl Into<String>, start: f64) -> Self {
        let scale = start.abs();
        Self {
            name: name.into(),
            start,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            scale: if scale > 0.0 { scale } else { 1.0 },
            fixed: false,
        }
    }

    /// Sets the lower bound.
    #[must_use]
    pub fn at_least(mut self, lower: f64) -> Self {
        self.lower = lower;
        self
    }

    /// Sets the upper bound.
    #[must_use]
    pub fn at_most(mut self, upper: f64) -> Self {
        self.upper = upper;
        self
    }

    /// Sets the scale.
    #[must_use]
    pub fn scaled(mut self, scale: f64) -> Self {
        self.scale = scale;
        self
    }

    /// Fixes the parameter at its start value.
    #[must_use]
    pub fn fixed(mut self) -> Self {
        self.fixed = true;
        self
    }

    /// Rejects inconsistent start, bounds and scale.
    pub(super) fn check(&self) -> Result<(), FitError> {
        let wrong = |problem: String| {
            Err(FitError::Parameter {
                name: self.name.clone(),
                problem,
            })
        };
        let (start, lower, upper) = (self.start, self.lower, self.upper);
        if !start.is_finite() {
            return wrong(format!("starts at {start}; a finite number is needed"));
        }
        if !(self.scale > 0.0 && self.scale.is_finite()) {
            return wrong(format!(
                "scale is {}; it must be greater than 0",
                self.scale
            ));
        }
        if lower.is_nan() || upper.is_nan() || lower > upper || (lower == upper && !self.fixed) {
            return wrong(format!(
                "its bounds are {lower} and {upper}; the lower one must be less"
            ));
        }
        if start < lower || start > upper {
            return wrong(format!("starts at {start}, outside {lower} to {upper}"));
        }
        Ok(())
    }
}
