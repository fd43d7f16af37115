//! The computed constants, equations (14) to (27) and appendix A of the thesis.

use torqcomp_model::inertia::{mass_from_weight_kg, total_inertia_kg_m2};
use torqcomp_model::{Beam, CrossSection, Kind, Part, Segment};
use torqcomp_model::{beam, calibration, damping};

use super::comparison::{compare, inches, si, stand, us};

/// ½ in by ½ in by 1½ in steel beam.
fn thesis_beam() -> Beam {
    let section = CrossSection::rectangle(inches(0.5), inches(0.5)).unwrap();
    let segment = Segment::new(inches(1.5), section).unwrap();
    Beam::new(vec![segment], si(Kind::Pressure, "30e6 psi")).unwrap()
}

fn beam_with_shear() -> Beam {
    thesis_beam()
        .with_shear_modulus(si(Kind::Pressure, "11.5e6 psi"))
        .unwrap()
}

fn stiffness_us(beam: &Beam) -> f64 {
    us(
        Kind::AngularStiffness,
        beam.angular_stiffness_n_m_per_rad(inches(2.8)).unwrap(),
    )
}

/// Mass in kg of a weight in lbf with the g = 32.2 ft/s² of the time.
fn mass_of(weight: &str) -> f64 {
    let gravity = si(Kind::Acceleration, "32.2 ft/s^2");
    mass_from_weight_kg(si(Kind::Force, weight), gravity).unwrap()
}

fn ring() -> Part {
    let radius_m = inches((2.8 + 1.6) / 2.0);
    Part::ThinRing {
        mass_kg: mass_of("5 lbf"),
        radius_m,
    }
}

fn end_bell() -> Part {
    Part::Disc {
        mass_kg: mass_of("0.5 lbf"),
        radius_m: inches(2.8),
    }
}

fn inertia_us(parts: &[Part]) -> f64 {
    us(Kind::Inertia, total_inertia_kg_m2(parts).unwrap())
}

#[test]
fn equation_17_stiffness_of_the_beam() {
    // 3·2.8²·30e6/(192·1.5³) = 7.056e8/648 = 1.088889e6 in lbf/rad; /12 = 9.07407e4. Printed are
    // 10.8e5 in lbf/rad, truncated rather than rounded, and 9.08e4, which is 10.9e5/12 = 9.083e4.
    let got = stiffness_us(&thesis_beam());
    compare(
        "(17) in lbf/rad",
        (10.8e5, 0.05e5),
        (1.088889e6, 0.5),
        12.0 * got,
    )
    .differs();
    compare("(17) ft lbf/rad", (9.08e4, 50.0), (9.07407e4, 0.05), got).differs();
    // With shear: bending 7.2e-6 in/lbf, shear 1.5/(5/6·11.5e6·0.25) = 6.26087e-7 in/lbf,
    // 2.8²/7.826087e-6/12 = 8.34815e4 ft lbf/rad.
    let with_shear = stiffness_us(&beam_with_shear());
    compare(
        "(17) with shear",
        (9.08e4, 50.0),
        (8.34815e4, 0.05),
        with_shear,
    )
    .differs();
}

#[test]
fn equation_14_rotation_is_deflection_over_radius() {
    // (14) prints θ = y/r = L/r. Only y/r leads to (16); L/r = 1.5/2.8 = 0.536 rad for any load.
    let force_n = si(Kind::Force, "100 lbf");
    let deflection = force_n / thesis_beam().tip_stiffness_n_per_m();
    let angle = beam::stator_rotation_rad(deflection, inches(2.8)).unwrap();
    let torque = force_n * inches(2.8);
    compare(
        "(12) with θ = y/r",
        (9.08e4, 50.0),
        (9.07407e4, 0.05),
        us(Kind::AngularStiffness, torque / angle),
    )
    .differs();
    // y = 100·7.2e-6 = 7.2e-4 in, θ = 7.2e-4/2.8 = 2.5714e-4 rad; as printed 0.5357 rad.
    compare(
        "(14) L/r against y/r",
        (1.5 / 2.8, 5e-5),
        (2.5714e-4, 5e-9),
        angle,
    )
    .differs();
}

#[test]
fn equation_18_viscous_friction() {
    // 2.8·(0.101 − 0.085)/(12·41.9) = 0.0448/502.8 = 8.9101e-5.
    let slope = si(Kind::ForcePerAngularSpeed, "0.016 lbf s/rad") / 41.9;
    let got = damping::viscous_from_friction_slope_n_m_s_per_rad(slope, inches(2.8)).unwrap();
    let got = us(Kind::AngularDamping, got);
    compare("(18)", (8.9e-5, 0.05e-5), (8.9101e-5, 5e-10), got).follows();
}

#[test]
fn equation_19_inertia_of_the_stator() {
    // Ring (2.2/12)²·5/32.2 = 0.03361111·0.1552795 = 5.21912e-3.
    let ring_only = inertia_us(&[ring()]);
    compare(
        "(19) ring alone",
        (6.95e-3, 5e-6),
        (5.21912e-3, 5e-9),
        ring_only,
    )
    .differs();
    // End bells 2·½·(2.8/12)²·0.5/32.2 = 0.05444444·0.01552795 = 8.45411e-4.
    let bells = inertia_us(&[end_bell(), end_bell()]);
    compare(
        "(19) end bells alone",
        (6.95e-3, 5e-6),
        (8.45411e-4, 5e-10),
        bells,
    )
    .differs();
    let total = inertia_us(&[ring(), end_bell(), end_bell()]);
    compare(
        "(19) as the formula says",
        (6.95e-3, 5e-6),
        (6.06453e-3, 5e-9),
        total,
    )
    .differs();
    // Without the ½: 5.21912e-3 + 2·8.45411e-4 = 6.90994e-3, near but still not 6.95e-3.
    let bell_as_ring = Part::ThinRing {
        mass_kg: mass_of("0.5 lbf"),
        radius_m: inches(2.8),
    };
    let without_half = inertia_us(&[ring(), bell_as_ring, bell_as_ring]);
    compare(
        "(19) without the ½",
        (6.95e-3, 5e-6),
        (6.90994e-3, 5e-9),
        without_half,
    )
    .differs();
}

#[test]
fn equation_21_natural_frequency() {
    // √(9.08e4/6.95e-3) = 3614.52 rad/s, /2π = 575.27 Hz.
    let printed = stand(6.95e-3, 8.9e-5, 9.08e4);
    let got = printed.natural_frequency_hz();
    compare("(21) f_n", (575.0, 0.5), (575.27, 5e-3), got).follows();
    let omega = got * std::f64::consts::TAU;
    compare("(21) ω_n", (3610.0, 5.0), (3614.52, 5e-3), omega).follows();
    // The real part 8.9e-5/(2·6.95e-3) = 6.4029e-3 is right except for its sign: the root of a
    // damped stand is −0.0064 ± j3610.
    compare(
        "(21) |σ|",
        (0.0064, 5e-5),
        (6.4029e-3, 5e-8),
        printed.decay_rate_per_s(),
    )
    .follows();
}

#[test]
fn equation_21_with_the_inertia_that_follows() {
    let inertia = inertia_us(&[ring(), end_bell(), end_bell()]);
    // √(9.08e4/6.064527e-3)/2π = 615.84 Hz with the K printed …
    let with_printed_k = stand(inertia, 8.9e-5, 9.08e4).natural_frequency_hz();
    compare(
        "(21) J of (19), K printed",
        (575.0, 0.5),
        (615.84, 5e-3),
        with_printed_k,
    )
    .differs();
    // … and √(9.07407e4/6.064527e-3)/2π = 615.63 Hz with the K that follows.
    let with_own_k = stand(inertia, 8.9e-5, stiffness_us(&thesis_beam())).natural_frequency_hz();
    compare(
        "(21) J of (19), K of (17)",
        (575.0, 0.5),
        (615.63, 5e-3),
        with_own_k,
    )
    .differs();
    // With shear in K: √(8.348148e4/6.064527e-3) = √1.376554e7 = 3710.194 rad/s, /2π = 590.496 Hz.
    // Rounded: 590.5. Intermediate rounding raises it (K = 8.35e4 gives 590.56, J = 6.064e-3 gives
    // 590.52), and standard gravity 32.174 ft/s² instead of 32.2 lowers it to 590.26. So 590.4 is
    // 590.496 truncated, not rounded. Measured: 590 Hz.
    let with_shear = stand(inertia, 8.9e-5, stiffness_us(&beam_with_shear()));
    let got = with_shear.natural_frequency_hz();
    compare(
        "measured 590, K with shear",
        (590.0, 0.5),
        (590.496, 5e-4),
        got,
    )
    .follows();
}

#[test]
fn equations_22_and_23_damping() {
    // 8.9e-5/2/√(9.08e4·6.95e-3) = 4.45e-5/25.1209 = 1.77143e-6.
    let printed = stand(6.95e-3, 8.9e-5, 9.08e4);
    compare(
        "(22a) ζ",
        (1.77e-6, 5e-9),
        (1.77143e-6, 5e-12),
        printed.damping_ratio(),
    )
    .follows();
    // √(1 − ζ²) differs from 1 by 1.6e-12, so f_d is f_n.
    let damped = printed.damped_frequency_hz().unwrap();
    compare("(23) f_d", (575.0, 0.5), (575.27, 5e-3), damped).follows();
}

#[test]
fn equations_26_and_27_strain() {
    // 0.5·0.25/(30e6/192) = 0.125/156250 = 8.0e-7 per lbf; T/ε = 2.8/8.0e-7 = 3.5e6 in lbf.
    let strain = thesis_beam()
        .surface_strain(si(Kind::Force, "1 lbf"), inches(1.0))
        .unwrap();
    compare("(26a) ε/P", (0.8e-6, 0.05e-6), (8.0e-7, 5e-13), strain).follows();
    let torque = thesis_beam()
        .torque_per_strain_n_m(inches(2.8), inches(1.0))
        .unwrap();
    let got = 12.0 * us(Kind::Torque, torque);
    compare("(27a) T/ε in lbf", (3.50e6, 0.005e6), (3.5e6, 0.5), got).follows();
}

#[test]
fn appendix_a_diameters_are_used_as_radii() {
    // Appendix A lists 1.6 in and 2.8 in as diameters of the stator, (17) to (19) and (C24) use
    // 2.8 in as its radius. With 1.4 in and 0.8 in, J and K fall to a quarter and C_T to a half:
    // 6.06453e-3/4 = 1.51613e-3, 9.07407e4/4 = 2.26852e4, 1225.49/2 = 612.745.
    let radius = inches(1.4);
    let ring = Part::ThinRing {
        mass_kg: mass_of("5 lbf"),
        radius_m: inches((1.4 + 0.8) / 2.0),
    };
    let bell = Part::Disc {
        mass_kg: mass_of("0.5 lbf"),
        radius_m: radius,
    };
    let inertia = inertia_us(&[ring, bell, bell]);
    // The J measured in the run-up, 5.85e-3, is near the value for 2.8 in as the radius.
    compare(
        "(C6) J, radius 1.4 in",
        (5.85e-3, 5e-6),
        (1.51613e-3, 5e-9),
        inertia,
    )
    .differs();
    let stiffness = thesis_beam().angular_stiffness_n_m_per_rad(radius).unwrap();
    let stiffness = us(Kind::AngularStiffness, stiffness);
    compare(
        "(17) K, radius 1.4 in",
        (9.08e4, 50.0),
        (2.26852e4, 0.05),
        stiffness,
    )
    .differs();
    let volts = calibration::deflection_voltage_v(238e-6, 12.0).unwrap();
    let force = si(Kind::Force, "15 lbf");
    let got = calibration::torque_per_volt_n_m_per_v(radius, force, volts).unwrap();
    let got = us(Kind::TorquePerVolt, got);
    compare(
        "(C25) C_T, radius 1.4 in",
        (1.23e3, 5.0),
        (612.745, 5e-4),
        got,
    )
    .differs();
    // J and K share r², so the natural frequency cannot distinguish the two readings.
    let narrow = stand(inertia, 8.9e-5, stiffness).natural_frequency_hz();
    crate::util::assert_close(narrow, 615.634, 1e-5);
}
