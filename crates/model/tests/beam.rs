//! The beam against slow oracles: a time-free march along the beam, and superposition.

use crate::util::assert_close;
use torqcomp_model::{Beam, CrossSection, ModelError, Segment};

const MODULUS: f64 = 2.07e11;
const SHEAR_MODULUS: f64 = 7.93e10;

fn square(side_m: f64, length_m: f64) -> Segment {
    Segment::new(length_m, CrossSection::rectangle(side_m, side_m).unwrap()).unwrap()
}

/// Threaded root, square shank, threaded end.
fn stepped() -> Vec<Segment> {
    vec![
        Segment::new(0.006, CrossSection::circle(0.010).unwrap()).unwrap(),
        square(0.0127, 0.022),
        Segment::new(0.0101, CrossSection::circle(0.0095).unwrap()).unwrap(),
    ]
}

/// Tip deflection per newton by marching the slope and deflection from the clamp:
/// dφ/dx = M/(EI), dy/dx = φ + V/(κGA), φ(0) = M(0)/k, y(0) = 0, V = 1, M = L − x.
/// The midpoint rule with cells that end on the steps between segments.
fn march(segments: &[Segment], shear: Option<f64>, clamp: Option<f64>) -> f64 {
    let length: f64 = segments.iter().map(Segment::length_m).sum();
    let cells = 20_000;
    let (mut x, mut y) = (0.0, 0.0);
    let mut slope = clamp.map_or(0.0, |k| length / k);
    for segment in segments {
        let section = segment.section();
        let dx = segment.length_m() / f64::from(cells);
        let shear_angle = shear.map_or(0.0, |g| {
            1.0 / (section.shear_coefficient() * g * section.area_m2())
        });
        for _ in 0..cells {
            let curvature = (length - x - dx / 2.0) / (MODULUS * section.second_moment_m4());
            y += (slope + curvature * dx / 2.0 + shear_angle) * dx;
            slope += curvature * dx;
            x += dx;
        }
    }
    y
}

#[test]
fn uniform_slender_beam_is_3ei_over_l_cubed() {
    // Hand number: I = b h³/12 = 0.02·0.01³/12, 3·2.07e11·1.666667e-9/0.1³ = 1.035e6 N/m.
    let section = CrossSection::rectangle(0.02, 0.01).unwrap();
    let beam = Beam::new(vec![Segment::new(0.1, section).unwrap()], MODULUS).unwrap();
    assert_close(beam.tip_stiffness_n_per_m(), 1.035e6, 1e-12);
}

#[test]
fn compliance_matches_the_march_along_the_beam() {
    for shear in [None, Some(SHEAR_MODULUS)] {
        for clamp in [None, Some(4.0e4)] {
            let mut beam = Beam::new(stepped(), MODULUS).unwrap();
            if let Some(modulus) = shear {
                beam = beam.with_shear_modulus(modulus).unwrap();
            }
            if let Some(stiffness) = clamp {
                beam = beam.with_clamp_stiffness(stiffness).unwrap();
            }
            let want = march(&stepped(), shear, clamp);
            assert_close(beam.compliance().total_m_per_n(), want, 1e-8);
            assert_close(beam.tip_stiffness_n_per_m(), 1.0 / want, 1e-8);
        }
    }
}

#[test]
fn each_contribution_is_what_its_cause_adds() {
    let slender = Beam::new(stepped(), MODULUS).unwrap();
    let full = slender
        .clone()
        .with_shear_modulus(SHEAR_MODULUS)
        .unwrap()
        .with_clamp_stiffness(4.0e4)
        .unwrap();
    let parts = full.compliance();
    let uniform = [square(0.0127, slender.length_m())];
    let bending = march(&uniform, None, None);
    let shear = march(&uniform, Some(SHEAR_MODULUS), None) - bending;
    let clamp = march(&uniform, None, Some(4.0e4)) - bending;
    let reduced = march(&stepped(), Some(SHEAR_MODULUS), None) - bending - shear;
    assert_close(parts.bending_m_per_n, bending, 1e-8);
    assert_close(parts.shear_m_per_n, shear, 1e-6);
    assert_close(parts.clamp_m_per_n, clamp, 1e-7);
    assert_close(parts.reduced_sections_m_per_n, reduced, 1e-7);
    assert!(
        reduced > 0.5 * bending,
        "the weak segments must matter in this test: {reduced:e}"
    );
    assert_eq!(slender.compliance().shear_m_per_n, 0.0);
    assert_eq!(slender.compliance().clamp_m_per_n, 0.0);
}

#[test]
fn splitting_a_segment_changes_nothing() {
    let whole = Beam::new(vec![square(0.0127, 0.0381)], MODULUS).unwrap();
    let split = vec![
        square(0.0127, 0.0100),
        square(0.0127, 0.0200),
        square(0.0127, 0.0081),
    ];
    let split = Beam::new(split, MODULUS).unwrap();
    assert_close(
        split.tip_stiffness_n_per_m(),
        whole.tip_stiffness_n_per_m(),
        1e-12,
    );
    assert_eq!(split.compliance().reduced_sections_m_per_n, 0.0);
}

#[test]
fn strain_is_curvature_times_half_depth() {
    // Curvature from second differences of the deflection of a uniform cantilever, (9) and (11)
    // with the sign of P: y = P (L x²/2 − x³/6)/(EI).
    let segment = square(0.0127, 0.0381);
    let beam = Beam::new(vec![segment], MODULUS).unwrap();
    let rigidity = MODULUS * segment.section().second_moment_m4();
    let deflection = |x: f64| 100.0 * (0.0381 * x * x / 2.0 - x.powi(3) / 6.0) / rigidity;
    for x in [0.005, 0.0254, 0.035] {
        let h = 1e-4;
        let curvature = (deflection(x + h) - 2.0 * deflection(x) + deflection(x - h)) / (h * h);
        assert_close(
            beam.surface_strain(100.0, x).unwrap(),
            curvature * 0.00635,
            1e-7,
        );
    }
}

#[test]
fn torque_per_strain_inverts_the_strain_of_a_torque() {
    let beam = Beam::new(stepped(), MODULUS).unwrap();
    for x in [0.0, 0.003, 0.02, 0.035] {
        let strain = beam.surface_strain(12.0 / 0.0711, x).unwrap();
        assert_close(
            strain * beam.torque_per_strain_n_m(0.0711, x).unwrap(),
            12.0,
            1e-12,
        );
    }
}

#[test]
fn strain_uses_the_section_under_the_gage() {
    let beam = Beam::new(stepped(), MODULUS).unwrap();
    let ratio = |x: f64, section: CrossSection| {
        beam.surface_strain(1.0, x).unwrap()
            / ((beam.length_m() - x) * section.half_depth_m()
                / (MODULUS * section.second_moment_m4()))
    };
    assert_close(
        ratio(0.0059, CrossSection::circle(0.010).unwrap()),
        1.0,
        1e-12,
    );
    assert_close(
        ratio(0.006, CrossSection::rectangle(0.0127, 0.0127).unwrap()),
        1.0,
        1e-12,
    );
    assert_close(
        ratio(0.037, CrossSection::circle(0.0095).unwrap()),
        1.0,
        1e-12,
    );
}

#[test]
fn impossible_beams_and_positions_are_refused() {
    assert!(matches!(
        Beam::new(vec![], MODULUS),
        Err(ModelError::Empty { .. })
    ));
    let beam = Beam::new(vec![square(0.01, 0.1)], MODULUS).unwrap();
    assert!(matches!(
        Beam::new(vec![square(0.01, 0.1)], 0.0),
        Err(ModelError::NotPositive { .. })
    ));
    assert!(matches!(
        beam.surface_strain(1.0, -1e-9),
        Err(ModelError::OffBeam { .. })
    ));
    assert!(matches!(
        beam.surface_strain(1.0, 0.1001),
        Err(ModelError::OffBeam { .. })
    ));
    assert!(matches!(
        beam.surface_strain(1.0, f64::NAN),
        Err(ModelError::OffBeam { .. })
    ));
    assert!(matches!(
        beam.torque_per_strain_n_m(0.07, 0.1),
        Err(ModelError::NoMoment { .. })
    ));
    assert!(matches!(
        beam.angular_stiffness_n_m_per_rad(-0.07),
        Err(ModelError::NotPositive { .. })
    ));
    assert!(matches!(
        beam.clone().with_shear_modulus(f64::INFINITY),
        Err(ModelError::NotFinite { .. })
    ));
    assert!(matches!(
        beam.with_clamp_stiffness(0.0),
        Err(ModelError::NotPositive { .. })
    ));
    let section = CrossSection::circle(0.01).unwrap();
    assert!(matches!(
        Segment::new(0.0, section),
        Err(ModelError::NotPositive { .. })
    ));
}
