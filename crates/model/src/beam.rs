//! Stiffness of the beam and strain on its surface.
//!
//! The beam is clamped at x = 0 and loaded by the force P at its end x = L. Compliances add:
//! bending, shear, the clamp and every weaker segment.

use crate::check::{finite, positive};
use crate::error::ModelError;
use crate::section::CrossSection;

/// A length of beam with one cross section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    length_m: f64,
    section: CrossSection,
}

impl Segment {
    /// A segment of `length_m` in m with the given section.
    ///
    /// # Errors
    /// [`ModelError`] if the length is not finite or not greater than 0.
    ///
    /// ```
    /// use torqcomp_model::{CrossSection, Segment};
    /// let segment = Segment::new(0.5, CrossSection::circle(0.1)?)?;
    /// assert_eq!(segment.length_m(), 0.5);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn new(length_m: f64, section: CrossSection) -> Result<Self, ModelError> {
        let length_m = positive("segment length", "m", length_m)?;
        Ok(Self { length_m, section })
    }

    /// Length in m.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Cross section.
    pub fn section(&self) -> &CrossSection {
        &self.section
    }
}

/// A beam, clamped at one end and loaded at the other.
///
/// Validity: small deflections, linear elastic material, plane sections, load at the end and
/// across the beam, mass of the beam neglected.
#[derive(Debug, Clone, PartialEq)]
pub struct Beam {
    segments: Vec<Segment>,
    elastic_modulus_pa: f64,
    shear_modulus_pa: Option<f64>,
    clamp_stiffness_n_m_per_rad: Option<f64>,
}

/// Contributions to the tip deflection of a beam, each in m/N; their sum is the tip compliance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compliance {
    /// Bending, as if the whole beam had its stiffest section: L³/(3 E I), (11).
    pub bending_m_per_n: f64,
    /// Shear, as if the whole beam had its stiffest section: L/(κ G A). 0 without a shear modulus,
    /// as in the slender-beam theory of the source.
    pub shear_m_per_n: f64,
    /// Rotation of the clamp: L²/k. 0 without a clamp stiffness, which means rigid.
    pub clamp_m_per_n: f64,
    /// Additional bending and shear of the segments weaker than the stiffest section.
    pub reduced_sections_m_per_n: f64,
}

impl Compliance {
    /// Sum of all parts in m/N.
    ///
    /// ```
    /// let parts = torqcomp_model::Compliance {
    ///     bending_m_per_n: 4.0,
    ///     shear_m_per_n: 0.5,
    ///     clamp_m_per_n: 0.25,
    ///     reduced_sections_m_per_n: 0.25,
    /// };
    /// assert_eq!(parts.total_m_per_n(), 5.0);
    /// ```
    pub fn total_m_per_n(&self) -> f64 {
        self.bending_m_per_n
            + self.shear_m_per_n
            + self.clamp_m_per_n
            + self.reduced_sections_m_per_n
    }
}

impl Beam {
    /// A slender beam in a rigid clamp; `segments` run from the clamped to the loaded end.
    ///
    /// `elastic_modulus_pa` is E in Pa. A threaded root or end is a segment of smaller section.
    ///
    /// # Errors
    /// [`ModelError`] if there is no segment or E is not finite or not greater than 0.
    ///
    /// ```
    /// use torqcomp_model::{Beam, CrossSection, Segment};
    /// // I = 12·1³/12 = 1 m⁴, L = 3 m, E = 9 Pa: 3EI/L³ = 27/27 = 1 N/m.
    /// let segment = Segment::new(3.0, CrossSection::rectangle(12.0, 1.0)?)?;
    /// let beam = Beam::new(vec![segment], 9.0)?;
    /// assert!((beam.tip_stiffness_n_per_m() - 1.0).abs() < 1e-12);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn new(segments: Vec<Segment>, elastic_modulus_pa: f64) -> Result<Self, ModelError> {
        if segments.is_empty() {
            return Err(ModelError::Empty {
                what: "beam",
                entries: "segments",
            });
        }
        let elastic_modulus_pa = positive("elastic modulus", "Pa", elastic_modulus_pa)?;
        Ok(Self {
            segments,
            elastic_modulus_pa,
            shear_modulus_pa: None,
            clamp_stiffness_n_m_per_rad: None,
        })
    }

    /// The same beam with shear deflection (Timoshenko); `shear_modulus_pa` is G in Pa.
    ///
    /// # Errors
    /// [`ModelError`] if G is not finite or not greater than 0.
    ///
    /// ```
    /// use torqcomp_model::{Beam, CrossSection, Segment};
    /// // A = 12 m², κ = 5/6, G = 0.3 Pa, L = 3 m: L/(κGA) = 3/3 = 1 m/N.
    /// let segment = Segment::new(3.0, CrossSection::rectangle(12.0, 1.0)?)?;
    /// let beam = Beam::new(vec![segment], 9.0)?.with_shear_modulus(0.3)?;
    /// assert!((beam.compliance().shear_m_per_n - 1.0).abs() < 1e-12);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn with_shear_modulus(self, shear_modulus_pa: f64) -> Result<Self, ModelError> {
        let modulus = positive("shear modulus", "Pa", shear_modulus_pa)?;
        Ok(Self {
            shear_modulus_pa: Some(modulus),
            ..self
        })
    }

    /// The same beam in a compliant clamp of moment per rotation k in N m/rad.
    ///
    /// # Errors
    /// [`ModelError`] if the stiffness is not finite or not greater than 0.
    ///
    /// ```
    /// use torqcomp_model::{Beam, CrossSection, Segment};
    /// // L = 3 m, k = 9 N m/rad: L²/k = 1 m/N.
    /// let segment = Segment::new(3.0, CrossSection::rectangle(12.0, 1.0)?)?;
    /// let beam = Beam::new(vec![segment], 9.0)?.with_clamp_stiffness(9.0)?;
    /// assert_eq!(beam.compliance().clamp_m_per_n, 1.0);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn with_clamp_stiffness(self, stiffness_n_m_per_rad: f64) -> Result<Self, ModelError> {
        let stiffness = positive("clamp stiffness", "N m/rad", stiffness_n_m_per_rad)?;
        Ok(Self {
            clamp_stiffness_n_m_per_rad: Some(stiffness),
            ..self
        })
    }

    /// Length L in m from the clamp to the load.
    pub fn length_m(&self) -> f64 {
        self.segments.iter().map(Segment::length_m).sum()
    }

    /// Segments from the clamped to the loaded end.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Contributions to the tip compliance y/P in m/N:
    ///
    /// y/P = ∫ (L−x)²/(E I(x)) dx + ∫ dx/(κ G A(x)) + L²/k
    ///
    /// x in m from the clamp, E and G in Pa, I in m⁴, A in m², k in N m/rad. Source: (8)–(11)
    /// for the uniform slender beam, Timoshenko's beam theory for the shear term.
    ///
    /// ```
    /// use torqcomp_model::{Beam, CrossSection, Segment};
    /// // EI = 1 N m² over 0..1 m, 2 N m² over 1..2 m, so bending if stiff all over: 8/3/2 = 4/3.
    /// // The weak root adds (8−1)/3·(1/1 − 1/2) = 7/6.
    /// let root = Segment::new(1.0, CrossSection::rectangle(12.0, 1.0)?)?;
    /// let free = Segment::new(1.0, CrossSection::rectangle(24.0, 1.0)?)?;
    /// let parts = Beam::new(vec![root, free], 1.0)?.compliance();
    /// assert!((parts.bending_m_per_n - 4.0 / 3.0).abs() < 1e-12);
    /// assert!((parts.reduced_sections_m_per_n - 7.0 / 6.0).abs() < 1e-12);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn compliance(&self) -> Compliance {
        let length = self.length_m();
        let stiffest = self.stiffest_section();
        let bending_m_per_n = self.bending(&stiffest, 0.0, length);
        let shear_m_per_n = self.shear(&stiffest, length);
        let mut start = 0.0;
        let mut reduced = 0.0;
        for segment in &self.segments {
            let end = start + segment.length_m;
            if segment.section != stiffest {
                reduced += self.bending(&segment.section, start, end)
                    - self.bending(&stiffest, start, end)
                    + self.shear(&segment.section, segment.length_m)
                    - self.shear(&stiffest, segment.length_m);
            }
            start = end;
        }
        Compliance {
            bending_m_per_n,
            shear_m_per_n,
            clamp_m_per_n: self
                .clamp_stiffness_n_m_per_rad
                .map_or(0.0, |k| length.powi(2) / k),
            reduced_sections_m_per_n: reduced,
        }
    }

    /// Tip stiffness, force per deflection at the loaded end, P/y in N/m: the reciprocal of the
    /// total compliance.
    ///
    /// For one uniform slender segment this is 3 E I/L³, (11).
    ///
    /// ```
    /// use torqcomp_model::{Beam, CrossSection, Segment};
    /// // 3EI/L³ = 1 N/m and k/L² = 1 N/m in series give 0.5 N/m.
    /// let segment = Segment::new(3.0, CrossSection::rectangle(12.0, 1.0)?)?;
    /// let beam = Beam::new(vec![segment], 9.0)?.with_clamp_stiffness(9.0)?;
    /// assert!((beam.tip_stiffness_n_per_m() - 0.5).abs() < 1e-12);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn tip_stiffness_n_per_m(&self) -> f64 {
        1.0 / self.compliance().total_m_per_n()
    }

    /// Torsional-spring constant of the stand K = r² P/y in N m/rad, (12)–(16).
    ///
    /// `radius_m` is r in m, the distance from the axis of the machine to the loaded end. For one
    /// uniform slender segment K = 3 r² E I/L³. Source: (15), (16).
    ///
    /// # Errors
    /// [`ModelError`] if the radius is not finite or not greater than 0.
    ///
    /// ```
    /// use torqcomp_model::{Beam, CrossSection, Segment};
    /// // 1 N/m at a radius of 2 m: 4 N m/rad.
    /// let segment = Segment::new(3.0, CrossSection::rectangle(12.0, 1.0)?)?;
    /// let beam = Beam::new(vec![segment], 9.0)?;
    /// assert!((beam.angular_stiffness_n_m_per_rad(2.0)? - 4.0).abs() < 1e-12);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn angular_stiffness_n_m_per_rad(&self, radius_m: f64) -> Result<f64, ModelError> {
        let radius = positive("radius of the machine", "m", radius_m)?;
        Ok(radius.powi(2) * self.tip_stiffness_n_per_m()) // (15)
    }

    /// Strain at the surface, ε = P (L − x) c/(E I), (24)–(26).
    ///
    /// `force_n` is P in N, of either sign, `position_m` is x in m from the clamp, c the half depth
    /// in m and I the second moment in m⁴ of the section at x; the result is in m/m. Where two
    /// segments meet, the one nearer the load counts. A gage of finite length on one segment reads
    /// the strain at its middle, as the strain is linear in x. Not valid within about one depth of
    /// the clamp or a step, where plane sections do not remain plane.
    ///
    /// # Errors
    /// [`ModelError`] if x is not on the beam or a number is not finite.
    ///
    /// ```
    /// use torqcomp_model::{Beam, CrossSection, Segment};
    /// // P = 18 N, L − x = 2 m, c = 0.5 m, EI = 9 N m²: ε = 18·2·0.5/9 = 2.
    /// let segment = Segment::new(3.0, CrossSection::rectangle(12.0, 1.0)?)?;
    /// let beam = Beam::new(vec![segment], 9.0)?;
    /// assert!((beam.surface_strain(18.0, 1.0)? - 2.0).abs() < 1e-12);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn surface_strain(&self, force_n: f64, position_m: f64) -> Result<f64, ModelError> {
        let force = finite("force on the beam", "N", force_n)?;
        let section = self.section_at(position_m)?;
        let moment = force * (self.length_m() - position_m); // (25)
        Ok(
            moment * section.half_depth_m()
                / (self.elastic_modulus_pa * section.second_moment_m4()),
        )
    }

    /// Torque per surface strain, T/ε = E I r/((L − x) c) in N m, (27).
    ///
    /// `radius_m` is r in m; the other symbols and limits are those of [`Beam::surface_strain`].
    ///
    /// # Errors
    /// [`ModelError`] if x is not on the beam or at its loaded end, or the radius is not greater
    /// than 0.
    ///
    /// ```
    /// use torqcomp_model::{Beam, CrossSection, Segment};
    /// // EI = 9 N m², r = 2 m, L − x = 2 m, c = 0.5 m: 9·2/(2·0.5) = 18 N m.
    /// let segment = Segment::new(3.0, CrossSection::rectangle(12.0, 1.0)?)?;
    /// let beam = Beam::new(vec![segment], 9.0)?;
    /// assert!((beam.torque_per_strain_n_m(2.0, 1.0)? - 18.0).abs() < 1e-12);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn torque_per_strain_n_m(&self, radius_m: f64, position_m: f64) -> Result<f64, ModelError> {
        let radius = positive("radius of the machine", "m", radius_m)?;
        let strain_per_newton = self.surface_strain(1.0, position_m)?;
        if strain_per_newton == 0.0 {
            return Err(ModelError::NoMoment { position_m });
        }
        Ok(radius / strain_per_newton) // P = T/r, (10)
    }

    /// Bending compliance of one section over a ≤ x ≤ b: ((L−a)³ − (L−b)³)/(3 E I).
    fn bending(&self, section: &CrossSection, start_m: f64, end_m: f64) -> f64 {
        let length = self.length_m();
        let cubes = (length - start_m).powi(3) - (length - end_m).powi(3);
        cubes / (3.0 * self.elastic_modulus_pa * section.second_moment_m4())
    }

    /// Shear compliance of one section over a length: l/(κ G A).
    fn shear(&self, section: &CrossSection, length_m: f64) -> f64 {
        self.shear_modulus_pa.map_or(0.0, |modulus| {
            length_m / (section.shear_coefficient() * modulus * section.area_m2())
        })
    }

    fn stiffest_section(&self) -> CrossSection {
        let mut stiffest = self.segments[0].section;
        for segment in &self.segments[1..] {
            if segment.section.second_moment_m4() > stiffest.second_moment_m4() {
                stiffest = segment.section;
            }
        }
        stiffest
    }

    fn section_at(&self, position_m: f64) -> Result<CrossSection, ModelError> {
        let length_m = self.length_m();
        if !(0.0..=length_m).contains(&position_m) {
            return Err(ModelError::OffBeam {
                position_m,
                length_m,
            });
        }
        let mut end = 0.0;
        let mut found = self.segments[0].section;
        for segment in &self.segments {
            found = segment.section;
            end += segment.length_m;
            if position_m < end {
                break;
            }
        }
        Ok(found)
    }
}

/// Rotation of the stator θ = y/r in rad, (14).
///
/// `tip_deflection_m` is y in m, the deflection of the loaded end; `radius_m` is r in m. The
/// source also prints θ = L/r in (14), a slip: with L the result would not depend on the load.
/// Valid for y much less than r.
///
/// # Errors
/// [`ModelError`] if the deflection is not finite or the radius is not greater than 0.
///
/// ```
/// // 0.001 m at a radius of 0.5 m: 0.002 rad.
/// assert_eq!(torqcomp_model::beam::stator_rotation_rad(0.001, 0.5)?, 0.002);
/// # Ok::<(), torqcomp_model::ModelError>(())
/// ```
pub fn stator_rotation_rad(tip_deflection_m: f64, radius_m: f64) -> Result<f64, ModelError> {
    let deflection = finite("tip deflection", "m", tip_deflection_m)?;
    Ok(deflection / positive("radius of the machine", "m", radius_m)?)
}
