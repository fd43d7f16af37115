//! Cross sections of the beam.

use std::f64::consts::PI;

use crate::check::positive;
use crate::error::ModelError;

/// Poisson's ratio for the default shear coefficient of a tube.
const POISSON_RATIO_STEEL: f64 = 0.3;

/// A cross section, symmetric about the neutral axis of bending.
///
/// Valid for bending about one principal axis; the depth is measured in the direction of the
/// load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrossSection {
    area_m2: f64,
    second_moment_m4: f64,
    shear_coefficient: f64,
    half_depth_m: f64,
}

impl CrossSection {
    /// Solid rectangle: A = b h, I = b h³/12, κ = 5/6, c = h/2.
    ///
    /// `width_m` is b in m, across the load; `depth_m` is h in m, along the load. A is in m²,
    /// I in m⁴. κ = 5/6 is the strain-energy value for a parabolic shear stress (Timoshenko,
    /// *Strength of Materials*, part I); it is too high for b much greater than h.
    ///
    /// # Errors
    /// [`ModelError`] if a dimension is not finite or not greater than 0.
    ///
    /// ```
    /// // b = 2 m, h = 3 m: I = 2·27/12 = 4.5 m⁴.
    /// let section = torqcomp_model::CrossSection::rectangle(2.0, 3.0)?;
    /// assert_eq!(section.second_moment_m4(), 4.5);
    /// assert_eq!(section.half_depth_m(), 1.5);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn rectangle(width_m: f64, depth_m: f64) -> Result<Self, ModelError> {
        let b = positive("section width", "m", width_m)?;
        let h = positive("section depth", "m", depth_m)?;
        Self::checked(b * h, b * h.powi(3) / 12.0, 5.0 / 6.0, h / 2.0)
    }

    /// Solid circle: A = π d²/4, I = π d⁴/64, κ = 0.9, c = d/2.
    ///
    /// `diameter_m` is d in m. κ = 9/10 is the strain-energy value with the shear stress constant
    /// across the width (Timoshenko, *Strength of Materials*, part I).
    ///
    /// # Errors
    /// [`ModelError`] if the diameter is not finite or not greater than 0.
    ///
    /// ```
    /// // d = 2 m: I = π·16/64 = π/4 m⁴.
    /// let section = torqcomp_model::CrossSection::circle(2.0)?;
    /// assert!((section.second_moment_m4() - 0.785398).abs() < 1e-6);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn circle(diameter_m: f64) -> Result<Self, ModelError> {
        let d = positive("section diameter", "m", diameter_m)?;
        let area = PI * d.powi(2) / 4.0;
        Self::checked(area, PI * d.powi(4) / 64.0, 0.9, d / 2.0)
    }

    /// Hollow circle: A = π (D² − d²)/4, I = π (D⁴ − d⁴)/64, κ of Cowper for ν = 0.3, c = D/2.
    ///
    /// `outer_diameter_m` is D and `inner_diameter_m` is d, both in m. With m = d/D,
    ///
    /// κ = 6 (1+ν)(1+m²)² / ((7+6ν)(1+m²)² + (20+12ν) m²)
    ///
    /// (G. R. Cowper, *Journal of Applied Mechanics* 33 (1966) 335). It falls from 0.886 for a
    /// small bore to 0.531 for a thin wall. For another material use
    /// [`CrossSection::with_shear_coefficient`].
    ///
    /// # Errors
    /// [`ModelError`] if a diameter is not greater than 0 or the inner one is not the smaller.
    ///
    /// ```
    /// // D = 2 m, d = 1 m: I = π (16 − 1)/64 = 0.736311 m⁴.
    /// let section = torqcomp_model::CrossSection::tube(2.0, 1.0)?;
    /// assert!((section.second_moment_m4() - 0.736311).abs() < 1e-6);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn tube(outer_diameter_m: f64, inner_diameter_m: f64) -> Result<Self, ModelError> {
        let outer = positive("tube outer diameter", "m", outer_diameter_m)?;
        let inner = positive("tube inner diameter", "m", inner_diameter_m)?;
        if inner >= outer {
            return Err(ModelError::NotSmaller {
                smaller: "tube inner diameter",
                smaller_m: inner,
                larger: "tube outer diameter",
                larger_m: outer,
            });
        }
        let area = PI * (outer.powi(2) - inner.powi(2)) / 4.0;
        let second_moment = PI * (outer.powi(4) - inner.powi(4)) / 64.0;
        let shear = cowper_tube(inner / outer, POISSON_RATIO_STEEL);
        Self::checked(area, second_moment, shear, outer / 2.0)
    }

    /// The same section with another shear coefficient κ (dimensionless).
    ///
    /// # Errors
    /// [`ModelError`] if `shear_coefficient` is not finite or not greater than 0.
    ///
    /// ```
    /// let section = torqcomp_model::CrossSection::circle(2.0)?.with_shear_coefficient(0.886)?;
    /// assert_eq!(section.shear_coefficient(), 0.886);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn with_shear_coefficient(self, shear_coefficient: f64) -> Result<Self, ModelError> {
        Ok(Self {
            shear_coefficient: positive("shear coefficient", "(ratio)", shear_coefficient)?,
            ..self
        })
    }

    /// Area A in m².
    pub fn area_m2(&self) -> f64 {
        self.area_m2
    }

    /// Second moment of area I about the neutral axis in m⁴.
    pub fn second_moment_m4(&self) -> f64 {
        self.second_moment_m4
    }

    /// Shear coefficient κ, a ratio: effective shear area over area.
    pub fn shear_coefficient(&self) -> f64 {
        self.shear_coefficient
    }

    /// Distance c in m from the neutral axis to the surface that carries the gage.
    pub fn half_depth_m(&self) -> f64 {
        self.half_depth_m
    }

    /// Rejects dimensions so small or large that a power of them underflows or overflows.
    fn checked(
        area_m2: f64,
        second_moment_m4: f64,
        shear_coefficient: f64,
        half_depth_m: f64,
    ) -> Result<Self, ModelError> {
        Ok(Self {
            area_m2: positive("section area", "m^2", area_m2)?,
            second_moment_m4: positive("second moment of area", "m^4", second_moment_m4)?,
            shear_coefficient,
            half_depth_m,
        })
    }
}

/// Cowper's shear coefficient of a hollow circle with diameter ratio m and Poisson's ratio ν.
fn cowper_tube(m: f64, nu: f64) -> f64 {
    let q = (1.0 + m * m).powi(2);
    6.0 * (1.0 + nu) * q / ((7.0 + 6.0 * nu) * q + (20.0 + 12.0 * nu) * m * m)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ y² b(y) dy by the midpoint rule, a slow reference for second moments.
    fn integrate(half_depth: f64, width: impl Fn(f64) -> f64) -> (f64, f64) {
        let n = 400_000;
        let dy = 2.0 * half_depth / f64::from(n);
        let (mut area, mut second) = (0.0, 0.0);
        for i in 0..n {
            let y = -half_depth + (f64::from(i) + 0.5) * dy;
            area += width(y) * dy;
            second += y * y * width(y) * dy;
        }
        (area, second)
    }

    fn chord(radius: f64, y: f64) -> f64 {
        2.0 * (radius * radius - y * y).max(0.0).sqrt()
    }

    #[track_caller]
    fn close(got: f64, want: f64, relative: f64) {
        assert!(
            (got / want - 1.0).abs() < relative,
            "got {got}, want {want}"
        );
    }

    #[test]
    fn areas_and_second_moments_match_quadrature() {
        let cases = [
            (
                CrossSection::rectangle(0.02, 0.03).unwrap(),
                integrate(0.015, |_| 0.02),
            ),
            (
                CrossSection::circle(0.03).unwrap(),
                integrate(0.015, |y| chord(0.015, y)),
            ),
            (
                CrossSection::tube(0.03, 0.02).unwrap(),
                integrate(0.015, |y| chord(0.015, y) - chord(0.010, y)),
            ),
        ];
        for (section, (area, second)) in cases {
            // Midpoint rule on a square-root edge: error of order n^-1.5, here 4e-9.
            close(section.area_m2(), area, 1e-7);
            close(section.second_moment_m4(), second, 1e-7);
            assert_eq!(section.half_depth_m(), 0.015);
        }
    }

    /// 1/κ = (A/I²) ∫ Q²/b dy with Q the first moment beyond y: the strain-energy definition.
    fn energy_shear_coefficient(half_depth: f64, width: impl Fn(f64) -> f64) -> f64 {
        let n = 200_000;
        let dy = 2.0 * half_depth / f64::from(n);
        let (area, second) = integrate(half_depth, &width);
        let (mut first_moment, mut energy) = (0.0, 0.0);
        for i in 0..n {
            let y = -half_depth + (f64::from(i) + 0.5) * dy;
            let strip = -y * width(y) * dy;
            energy += (first_moment + strip / 2.0).powi(2) / width(y) * dy;
            first_moment += strip;
        }
        second * second / (area * energy)
    }

    #[test]
    fn solid_shear_coefficients_match_strain_energy() {
        let rectangle = CrossSection::rectangle(0.02, 0.03).unwrap();
        close(
            rectangle.shear_coefficient(),
            energy_shear_coefficient(0.015, |_| 0.02),
            1e-5,
        );
        let circle = CrossSection::circle(0.03).unwrap();
        let energy = energy_shear_coefficient(0.015, |y| chord(0.015, y));
        close(circle.shear_coefficient(), energy, 1e-5);
    }

    #[test]
    fn tube_shear_coefficient_reaches_cowpers_limits() {
        // Cowper 1966 lists the limits as separate entries: solid 6(1+ν)/(7+6ν), thin wall
        // 2(1+ν)/(4+3ν).
        let nearly_solid = CrossSection::tube(1.0, 1e-6).unwrap();
        close(nearly_solid.shear_coefficient(), 7.8 / 8.8, 1e-9);
        let thin = CrossSection::tube(1.0, 1.0 - 1e-9).unwrap();
        close(thin.shear_coefficient(), 2.6 / 4.9, 1e-9);
    }

    #[test]
    fn impossible_dimensions_are_refused() {
        assert!(matches!(
            CrossSection::rectangle(0.0, 1.0),
            Err(ModelError::NotPositive { .. })
        ));
        assert!(matches!(
            CrossSection::rectangle(1.0, -1.0),
            Err(ModelError::NotPositive { .. })
        ));
        assert!(matches!(
            CrossSection::circle(f64::NAN),
            Err(ModelError::NotFinite { .. })
        ));
        assert!(matches!(
            CrossSection::tube(1.0, 1.0),
            Err(ModelError::NotSmaller { .. })
        ));
        assert!(matches!(
            CrossSection::circle(1e-120),
            Err(ModelError::NotPositive { .. })
        ));
        let circle = CrossSection::circle(1.0).unwrap();
        assert!(matches!(
            circle.with_shear_coefficient(0.0),
            Err(ModelError::NotPositive { .. })
        ));
    }
}
