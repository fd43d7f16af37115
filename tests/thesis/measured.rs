//! The measured constants, section III and equations (C5) to (C25) of the thesis.

use torqcomp_model::inertia::inertia_from_run_up_kg_m2;
use torqcomp_model::{FreeDecay, Kind, calibration, damping};

use super::comparison::{compare, inches, si, stand, us};

#[test]
fn equations_c5_and_c6_inertia_from_run_up() {
    // (0.0360 − 0.0309)/0.88 = 0.0051/0.88 = 5.79545e-3; 5.85e-3 is printed.
    let [t2, t1] = ["0.0360 ft lbf", "0.0309 ft lbf"].map(|text| si(Kind::Torque, text));
    let got = us(
        Kind::Inertia,
        inertia_from_run_up_kg_m2(t2, t1, 0.88).unwrap(),
    );
    compare("(C6) J", (5.85e-3, 5e-6), (5.79545e-3, 5e-9), got).differs();
}

#[test]
fn equations_c7_to_c14_free_decay() {
    // 2π/1.7e-3 = 3695.99 rad/s; ln 4/0.0053 = 261.565 1/s.
    let omega = damping::angular_frequency_rad_per_s(1.7e-3).unwrap();
    compare("(C7) ω_d", (3700.0, 50.0), (3695.99, 5e-3), omega).follows();
    let rate = damping::decay_rate_per_s(2.0, 0.5, 5.3e-3).unwrap();
    compare("(C9) σ", (262.0, 0.5), (261.565, 5e-4), rate).follows();
    // 261.565/√(3695.99² + 261.565²) = 0.0705933, which rounds to 0.0706.
    let decay = FreeDecay::new(rate, omega).unwrap();
    compare(
        "(C13) ζ",
        (0.0705, 5e-5),
        (0.070593, 5e-7),
        decay.damping_ratio(),
    )
    .differs();
    // The rounded inputs 262 and 3700 give 0.0706339, further off.
    let rounded = FreeDecay::new(262.0, 3700.0).unwrap();
    let ratio = rounded.damping_ratio();
    compare(
        "(C13) ζ, rounded inputs",
        (0.0705, 5e-5),
        (0.070634, 5e-7),
        ratio,
    )
    .differs();
    // ω_n = 3705.24 rad/s, f_n = 589.707 Hz. The printed 3720 is 262/0.0705 = 3716.3 rounded to
    // three digits, and 592 is 3720/2π; 3716.3/2π is 591.5.
    let natural = decay.natural_angular_frequency_rad_per_s();
    compare("(C14) ω_n", (3720.0, 5.0), (3705.24, 5e-3), natural).differs();
    let hz = decay.natural_frequency_hz();
    compare("(C14) f_n", (592.0, 0.5), (589.707, 5e-4), hz).differs();
}

#[test]
fn equations_c18_to_c21_damping_and_stiffness() {
    let inertia = si(Kind::Inertia, "5.85e-3 slug ft^2");
    let rounded = FreeDecay::new(262.0, 3700.0).unwrap();
    // 2·262·5.85e-3 = 3.0654.
    let damping = us(
        Kind::AngularDamping,
        rounded.damping_n_m_s_per_rad(inertia).unwrap(),
    );
    compare("(C18) f", (3.07, 5e-3), (3.0654, 5e-5), damping).follows();
    // 5.85e-3·(3700² + 262²) = 5.85e-3·13758644 = 80488.1. By (C20) with f = 3.07, not 3.0654:
    // (1874.02 + 9.42)/23.4e-3 = 80489.3. Printed are 1875.0 for 1874.02, so 80530, and 8.1e4.
    let stiffness = us(
        Kind::AngularStiffness,
        rounded.stiffness_n_m_per_rad(inertia).unwrap(),
    );
    compare("(C21) K", (8.1e4, 500.0), (80488.1, 0.05), stiffness).differs();
    compare(
        "(C21) K, its own quotient",
        (80530.0, 0.5),
        (80488.1, 0.05),
        stiffness,
    )
    .differs();
    // Without intermediate rounding: σ = 261.565, ω_d = 3695.99: f = 3.06031, K = 80313.3.
    let exact = FreeDecay::new(4.0_f64.ln() / 5.3e-3, std::f64::consts::TAU / 1.7e-3).unwrap();
    let damping = us(
        Kind::AngularDamping,
        exact.damping_n_m_s_per_rad(inertia).unwrap(),
    );
    compare(
        "(C18) f, not rounded",
        (3.07, 5e-3),
        (3.06031, 5e-6),
        damping,
    )
    .differs();
    let stiffness = us(
        Kind::AngularStiffness,
        exact.stiffness_n_m_per_rad(inertia).unwrap(),
    );
    compare(
        "(C21) K, not rounded",
        (8.1e4, 500.0),
        (80313.3, 0.05),
        stiffness,
    )
    .differs();
}

#[test]
fn measured_constants_of_section_three() {
    // J = 5.85e-3, f = 3.07, K = 8.1e4: ζ = 3.07/2/√473.85 = 0.0705160, f_n = 592.222 Hz and
    // f_d = 590.748 Hz, where 590 Hz was measured.
    let measured = stand(5.85e-3, 3.07, 8.1e4);
    let ratio = measured.damping_ratio();
    compare("section III ζ", (0.0705, 5e-5), (0.070516, 5e-7), ratio).follows();
    let natural = measured.natural_frequency_hz();
    compare("section III f_n", (592.0, 0.5), (592.222, 5e-4), natural).follows();
    let damped = measured.damped_frequency_hz().unwrap();
    compare("section III f_d", (590.0, 0.5), (590.748, 5e-4), damped).differs();
}

#[test]
fn equations_c22_to_c25_torque_per_volt() {
    // 238e-6·12 = 2.856e-3 V; 2.8·15/12 = 3.5 ft lbf; 3.5/2.856e-3 = 1225.49 ft lbf/V. The
    // rounded 2.86e-3 V gives 1223.8. Both print as 1.22e3 or 1.23e3 to the last digit:
    // 1225.49 rounds up, 1223.8 rounds down.
    let volts = calibration::deflection_voltage_v(238e-6, 12.0).unwrap();
    compare("(C22) E", (2.86e-3, 5e-6), (2.856e-3, 5e-10), volts).follows();
    let force = si(Kind::Force, "15 lbf");
    let got = calibration::torque_per_volt_n_m_per_v(inches(2.8), force, volts).unwrap();
    let got = us(Kind::TorquePerVolt, got);
    compare("(C25) C_T", (1.23e3, 5.0), (1225.49, 5e-3), got).follows();
    let rounded = calibration::torque_per_volt_n_m_per_v(inches(2.8), force, 2.86e-3).unwrap();
    let rounded = us(Kind::TorquePerVolt, rounded);
    compare(
        "(C25) C_T, rounded E",
        (1.23e3, 5.0),
        (1223.78, 5e-3),
        rounded,
    )
    .differs();
}
