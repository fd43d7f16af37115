//! A calibration curve: applied over recorded quantity, from points or as a polynomial.

use crate::conversion::ConversionError;
use crate::sort_by_number;

/// Part of the calibrated range by which a curve is extrapolated beyond either end, along its tangent
/// there.
pub const CONTINUED: f64 = 0.2;

/// Points at which a polynomial is checked for monotonicity.
const CHECKED: u32 = 1000;
/// Bisections that give an inverse to the last digit.
const HALVINGS: u32 = 200;

/// A monotonic curve.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationCurve {
    shape: CurveShape,
    low: f64,
    high: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum CurveShape {
    /// Recorded and applied values, in ascending order of the recorded one.
    Points(Vec<(f64, f64)>),
    /// Coefficients in ascending powers of the recorded value.
    Polynomial(Vec<f64>),
}

impl CalibrationCurve {
    /// Linear interpolation between points of recorded and applied value, in any order.
    ///
    /// # Errors
    /// [`ConversionError::NoCurve`] for fewer than two points, two at one recorded value, or applied values that are
    /// not monotonic.
    ///
    /// ```
    /// use torqcomp_dsp::curve::CalibrationCurve;
    /// // Between (0, 0) and (2, 50): 25 per unit; from there to (3, 80): 30 per unit.
    /// let curve = CalibrationCurve::through(&[(2.0, 50.0), (0.0, 0.0), (3.0, 80.0)])?;
    /// assert_eq!(curve.applied(1.0)?, 25.0);
    /// assert_eq!(curve.applied(2.5)?, 65.0);
    /// assert!((curve.recorded(65.0)? - 2.5).abs() < 1e-12);
    /// // 20 % of the range are continued, no more.
    /// assert!(curve.applied(3.6).is_ok() && curve.applied(3.7).is_err());
    /// # Ok::<(), torqcomp_dsp::conversion::ConversionError>(())
    /// ```
    pub fn through(points: &[(f64, f64)]) -> Result<Self, ConversionError> {
        let mut points = points.to_vec();
        sort_by_number(&mut points, |(x, _)| *x);
        let steps = || {
            points
                .windows(2)
                .map(|p| (p[1].0 - p[0].0, p[1].1 - p[0].1))
        };
        let is_one_way = |sign: f64| steps().all(|(x, y)| x > 0.0 && sign * y > 0.0);
        if points.len() < 2 || !(is_one_way(1.0) || is_one_way(-1.0)) {
            return Err(ConversionError::NoCurve);
        }
        let (low, high) = (points[0].0, points[points.len() - 1].0);
        Ok(Self {
            shape: CurveShape::Points(points),
            low,
            high,
        })
    }

    /// `applied = c₀ + c₁ x + c₂ x² + …` over the recorded values x from `low` to `high`.
    ///
    /// # Errors
    /// [`ConversionError::NoCurve`] if it is not monotonic over that range.
    ///
    /// ```
    /// use torqcomp_dsp::curve::CalibrationCurve;
    /// // 25·2 + 0.5·2³ = 54.
    /// let curve = CalibrationCurve::polynomial(vec![0.0, 25.0, 0.0, 0.5], -2.0, 2.0)?;
    /// assert_eq!(curve.applied(2.0)?, 54.0);
    /// assert!((curve.recorded(54.0)? - 2.0).abs() < 1e-12);
    /// // 3 x − x³ turns back at x = 1.
    /// assert!(CalibrationCurve::polynomial(vec![0.0, 3.0, 0.0, -1.0], 0.0, 2.0).is_err());
    /// # Ok::<(), torqcomp_dsp::conversion::ConversionError>(())
    /// ```
    pub fn polynomial(
        coefficients: Vec<f64>,
        low: f64,
        high: f64,
    ) -> Result<Self, ConversionError> {
        let curve = Self {
            shape: CurveShape::Polynomial(coefficients),
            low,
            high,
        };
        let slope = |k: u32| curve.slope(low + (high - low) * f64::from(k) / f64::from(CHECKED));
        let sign = slope(0).signum();
        let is_one_way = (0..=CHECKED).all(|k| sign * slope(k) > 0.0);
        match is_one_way && low < high && high - low < f64::INFINITY {
            true => Ok(curve),
            false => Err(ConversionError::NoCurve),
        }
    }

    /// Lower and upper limit of the calibrated range.
    #[must_use]
    pub fn range(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    /// Applied value at a recorded value.
    ///
    /// # Errors
    /// [`ConversionError::BeyondCurve`] if it lies beyond the calibrated range by more than [`CONTINUED`] of it.
    pub fn applied(&self, recorded: f64) -> Result<f64, ConversionError> {
        let (low, high) = self.continued();
        if !(low..=high).contains(&recorded) {
            return Err(ConversionError::BeyondCurve {
                low: self.low,
                high: self.high,
                got: recorded,
            });
        }
        let end = recorded.clamp(self.low, self.high);
        Ok(self.within(end) + self.slope(end) * (recorded - end))
    }

    /// Recorded value for an applied value, by bisection.
    ///
    /// # Errors
    /// [`ConversionError::NotOnCurve`] if no recorded value within the extrapolated range gives it.
    pub fn recorded(&self, applied: f64) -> Result<f64, ConversionError> {
        let (mut low, mut high) = self.continued();
        let ends = [self.applied(low)?, self.applied(high)?];
        let is_between = (ends[0].min(ends[1])..=ends[0].max(ends[1])).contains(&applied);
        if !is_between {
            return Err(ConversionError::NotOnCurve {
                low: ends[0].min(ends[1]),
                high: ends[0].max(ends[1]),
                got: applied,
            });
        }
        let rises = ends[1] > ends[0];
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            match (self.applied(middle)? < applied) == rises {
                true => low = middle,
                false => high = middle,
            }
        }
        Ok(0.5 * (low + high))
    }

    /// Applied per recorded unit at a recorded value within the range.
    #[must_use]
    pub fn slope(&self, recorded: f64) -> f64 {
        match &self.shape {
            CurveShape::Points(points) => {
                let [a, b] = around(points, recorded);
                (b.1 - a.1) / (b.0 - a.0)
            }
            CurveShape::Polynomial(c) => (1..c.len())
                .rev()
                .fold(0.0, |sum, k| sum * recorded + k as f64 * c[k]),
        }
    }

    fn within(&self, recorded: f64) -> f64 {
        match &self.shape {
            CurveShape::Points(points) => {
                let [a, b] = around(points, recorded);
                a.1 + (b.1 - a.1) * (recorded - a.0) / (b.0 - a.0)
            }
            CurveShape::Polynomial(c) => c.iter().rev().fold(0.0, |sum, c| sum * recorded + c),
        }
    }

    /// The calibrated range with its extrapolation.
    fn continued(&self) -> (f64, f64) {
        // Slightly more, so that the ends themselves are on the curve.
        let more = CONTINUED * (1.0 + 1e-12) * (self.high - self.low);
        (self.low - more, self.high + more)
    }
}

/// The two points that bracket a recorded value, or the nearest two.
fn around(points: &[(f64, f64)], recorded: f64) -> [(f64, f64); 2] {
    let after = points.partition_point(|p| p.0 < recorded);
    let last = after.clamp(1, points.len() - 1);
    [points[last - 1], points[last]]
}
