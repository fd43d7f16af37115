//! Mass moments of inertia about the axis of the machine: of simple bodies, and from a run-up.
//!
//! The stator is the sum of its parts, (19). The value printed there, 6.95e-3 slug ft², does not
//! follow from the numbers beside it: they give 6.064e-3. Leaving out the ½ of the end bells
//! gives 6.91e-3.

use crate::check::{non_negative, positive};
use crate::error::ModelError;

/// Thin ring about its axis: J = m r², in kg m².
///
/// `mass_kg` is m in kg, `radius_m` the mean radius r in m. Valid for a wall much thinner than r;
/// the relative error is about (wall/2r)². Source: first term of (19).
///
/// # Errors
/// [`ModelError`] if a number is not finite or not greater than 0.
///
/// ```
/// // 2 kg at 3 m: 18 kg m².
/// assert_eq!(torqcomp_model::inertia::thin_ring_kg_m2(2.0, 3.0)?, 18.0);
/// # Ok::<(), torqcomp_model::ModelError>(())
/// ```
pub fn thin_ring_kg_m2(mass_kg: f64, radius_m: f64) -> Result<f64, ModelError> {
    let mass = positive("mass of the ring", "kg", mass_kg)?;
    Ok(mass * positive("mean radius of the ring", "m", radius_m)?.powi(2))
}

/// Solid disc or cylinder about its axis: J = ½ m r², in kg m².
///
/// `mass_kg` is m in kg, `radius_m` the outer radius r in m. Valid for uniform mass per area.
/// Source: second term of (19), there for one end bell.
///
/// # Errors
/// [`ModelError`] if a number is not finite or not greater than 0.
///
/// ```
/// // 2 kg at 3 m: 9 kg m².
/// assert_eq!(torqcomp_model::inertia::disc_kg_m2(2.0, 3.0)?, 9.0);
/// # Ok::<(), torqcomp_model::ModelError>(())
/// ```
pub fn disc_kg_m2(mass_kg: f64, radius_m: f64) -> Result<f64, ModelError> {
    let mass = positive("mass of the disc", "kg", mass_kg)?;
    Ok(0.5 * mass * positive("radius of the disc", "m", radius_m)?.powi(2))
}

/// Hollow cylinder about its axis: J = ½ m (r_o² + r_i²), in kg m².
///
/// `mass_kg` is m in kg, `outer_radius_m` is r_o and `inner_radius_m` is r_i, both in m. Valid for
/// uniform density. Source: any textbook of dynamics, for example Meriam and Kraige, *Dynamics*,
/// table D/4.
///
/// # Errors
/// [`ModelError`] if a number is not greater than 0 or the inner radius is not the smaller.
///
/// ```
/// // 2 kg, 3 m and 1 m: ½·2·(9 + 1) = 10 kg m².
/// assert_eq!(torqcomp_model::inertia::hollow_cylinder_kg_m2(2.0, 3.0, 1.0)?, 10.0);
/// # Ok::<(), torqcomp_model::ModelError>(())
/// ```
pub fn hollow_cylinder_kg_m2(
    mass_kg: f64,
    outer_radius_m: f64,
    inner_radius_m: f64,
) -> Result<f64, ModelError> {
    let mass = positive("mass of the cylinder", "kg", mass_kg)?;
    let outer = positive("outer radius of the cylinder", "m", outer_radius_m)?;
    let inner = positive("inner radius of the cylinder", "m", inner_radius_m)?;
    if inner >= outer {
        return Err(ModelError::NotSmaller {
            smaller: "inner radius of the cylinder",
            smaller_m: inner,
            larger: "outer radius of the cylinder",
            larger_m: outer,
        });
    }
    Ok(0.5 * mass * (outer.powi(2) + inner.powi(2)))
}

/// Point mass: J = m r², in kg m².
///
/// `mass_kg` is m in kg, `radius_m` its distance r from the axis in m. Valid for a body much
/// smaller than r.
///
/// # Errors
/// [`ModelError`] if a number is not finite or not greater than 0.
///
/// ```
/// // 0.5 kg at 2 m: 2 kg m².
/// assert_eq!(torqcomp_model::inertia::point_mass_kg_m2(0.5, 2.0)?, 2.0);
/// # Ok::<(), torqcomp_model::ModelError>(())
/// ```
pub fn point_mass_kg_m2(mass_kg: f64, radius_m: f64) -> Result<f64, ModelError> {
    let mass = positive("point mass", "kg", mass_kg)?;
    Ok(mass * positive("radius of the point mass", "m", radius_m)?.powi(2))
}

/// Mass from weight: m = W/g, in kg.
///
/// `weight_n` is W in N, `gravity_m_per_s2` the local acceleration of free fall g in m/s². A
/// weight in lbf needs this step; a mass in kg or lbm does not.
///
/// # Errors
/// [`ModelError`] if a number is not finite or not greater than 0.
///
/// ```
/// // 19.62 N at 9.81 m/s²: 2 kg.
/// assert!((torqcomp_model::inertia::mass_from_weight_kg(19.62, 9.81)? - 2.0).abs() < 1e-12);
/// # Ok::<(), torqcomp_model::ModelError>(())
/// ```
pub fn mass_from_weight_kg(weight_n: f64, gravity_m_per_s2: f64) -> Result<f64, ModelError> {
    let weight = positive("weight", "N", weight_n)?;
    Ok(weight / positive("acceleration of free fall", "m/s^2", gravity_m_per_s2)?)
}

/// A part of the stator, centred on the axis of the machine.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Part {
    /// See [`thin_ring_kg_m2`].
    ThinRing {
        /// Mass in kg.
        mass_kg: f64,
        /// Mean radius in m.
        radius_m: f64,
    },
    /// See [`disc_kg_m2`].
    Disc {
        /// Mass in kg.
        mass_kg: f64,
        /// Outer radius in m.
        radius_m: f64,
    },
    /// See [`hollow_cylinder_kg_m2`].
    HollowCylinder {
        /// Mass in kg.
        mass_kg: f64,
        /// Outer radius in m.
        outer_radius_m: f64,
        /// Inner radius in m.
        inner_radius_m: f64,
    },
    /// See [`point_mass_kg_m2`].
    PointMass {
        /// Mass in kg.
        mass_kg: f64,
        /// Distance from the axis in m.
        radius_m: f64,
    },
}

impl Part {
    /// Mass moment of inertia of this part in kg m².
    ///
    /// # Errors
    /// [`ModelError`] if a dimension or the mass is invalid.
    ///
    /// ```
    /// use torqcomp_model::Part;
    /// assert_eq!(Part::Disc { mass_kg: 2.0, radius_m: 3.0 }.inertia_kg_m2()?, 9.0);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn inertia_kg_m2(&self) -> Result<f64, ModelError> {
        match *self {
            Self::ThinRing { mass_kg, radius_m } => thin_ring_kg_m2(mass_kg, radius_m),
            Self::Disc { mass_kg, radius_m } => disc_kg_m2(mass_kg, radius_m),
            Self::HollowCylinder {
                mass_kg,
                outer_radius_m,
                inner_radius_m,
            } => hollow_cylinder_kg_m2(mass_kg, outer_radius_m, inner_radius_m),
            Self::PointMass { mass_kg, radius_m } => point_mass_kg_m2(mass_kg, radius_m),
        }
    }
}

/// Inertia of the stator: the sum over its parts, (19), in kg m².
///
/// # Errors
/// [`ModelError`] if there is no part or a part is invalid.
///
/// ```
/// use torqcomp_model::{Part, inertia::total_inertia_kg_m2};
/// // Ring 2·3² = 18 and two discs ½·2·3² = 9 each: 36 kg m².
/// let ring = Part::ThinRing { mass_kg: 2.0, radius_m: 3.0 };
/// let bell = Part::Disc { mass_kg: 2.0, radius_m: 3.0 };
/// assert_eq!(total_inertia_kg_m2(&[ring, bell, bell])?, 36.0);
/// # Ok::<(), torqcomp_model::ModelError>(())
/// ```
pub fn total_inertia_kg_m2(parts: &[Part]) -> Result<f64, ModelError> {
    if parts.is_empty() {
        return Err(ModelError::Empty {
            what: "stator",
            entries: "parts",
        });
    }
    let mut total = 0.0;
    for part in parts {
        total += part.inertia_kg_m2()?;
    }
    Ok(total)
}

/// Inertia from a run-up, J = (T₂ − T₁)/θ'' in kg m², (C5).
///
/// `friction_torque_n_m` is T₁ in N m, which just keeps the free stator turning; `torque_n_m` is T₂
/// in N m, which accelerates it at θ'' = `acceleration_rad_per_s2` in rad/s². Valid while f θ' is
/// much less than T₂ − T₁.
///
/// # Errors
/// [`ModelError`] if T₂ − T₁ or θ'' is not greater than 0, or T₁ is negative.
///
/// ```
/// // (5 − 1) N m giving 2 rad/s²: 2 kg m².
/// assert_eq!(torqcomp_model::inertia::inertia_from_run_up_kg_m2(5.0, 1.0, 2.0)?, 2.0);
/// # Ok::<(), torqcomp_model::ModelError>(())
/// ```
pub fn inertia_from_run_up_kg_m2(
    torque_n_m: f64,
    friction_torque_n_m: f64,
    acceleration_rad_per_s2: f64,
) -> Result<f64, ModelError> {
    let friction = non_negative("friction torque T1", "N m", friction_torque_n_m)?;
    let excess = positive(
        "torque above friction T2 - T1",
        "N m",
        torque_n_m - friction,
    )?;
    Ok(excess / positive("angular acceleration", "rad/s^2", acceleration_rad_per_s2)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ r² dm of a body of uniform density between two radii, by the midpoint rule.
    fn quadrature(mass: f64, inner: f64, outer: f64) -> f64 {
        let n = 100_000;
        let dr = (outer - inner) / f64::from(n);
        let (mut area, mut moment) = (0.0, 0.0);
        for i in 0..n {
            let r = inner + (f64::from(i) + 0.5) * dr;
            area += r * dr;
            moment += r.powi(3) * dr;
        }
        mass * moment / area
    }

    #[test]
    fn bodies_match_quadrature() {
        let cases = [
            (disc_kg_m2(2.3, 0.07).unwrap(), quadrature(2.3, 0.0, 0.07)),
            (
                hollow_cylinder_kg_m2(2.3, 0.07, 0.04).unwrap(),
                quadrature(2.3, 0.04, 0.07),
            ),
            // With a wall of r/1000 the thin-ring formula has an error of (1/2000)² = 2.5e-7.
            (
                thin_ring_kg_m2(2.3, 0.07).unwrap(),
                quadrature(2.3, 0.069965, 0.070035),
            ),
            (
                point_mass_kg_m2(2.3, 0.07).unwrap(),
                quadrature(2.3, 0.0699999, 0.0700001),
            ),
        ];
        for (got, want) in cases {
            assert!((got / want - 1.0).abs() < 1e-6, "got {got}, want {want}");
        }
    }

    #[test]
    fn thin_ring_understates_a_thick_stator() {
        // The mean-radius ring against the hollow cylinder: ½(ro²+ri²) = r̄² + (wall/2)².
        let ring = thin_ring_kg_m2(1.0, 2.2).unwrap();
        let thick = hollow_cylinder_kg_m2(1.0, 2.8, 1.6).unwrap();
        assert!((thick - ring - 0.36).abs() < 1e-12);
    }

    #[test]
    fn impossible_parts_are_refused() {
        assert!(matches!(
            thin_ring_kg_m2(0.0, 1.0),
            Err(ModelError::NotPositive { .. })
        ));
        assert!(matches!(
            disc_kg_m2(1.0, -1.0),
            Err(ModelError::NotPositive { .. })
        ));
        assert!(matches!(
            hollow_cylinder_kg_m2(1.0, 1.0, 1.0),
            Err(ModelError::NotSmaller { .. })
        ));
        assert!(matches!(
            point_mass_kg_m2(f64::NAN, 1.0),
            Err(ModelError::NotFinite { .. })
        ));
        assert!(matches!(
            mass_from_weight_kg(1.0, 0.0),
            Err(ModelError::NotPositive { .. })
        ));
        assert!(matches!(
            total_inertia_kg_m2(&[]),
            Err(ModelError::Empty { .. })
        ));
    }
}
