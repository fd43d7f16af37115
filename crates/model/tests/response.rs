//! The transfer function against time stepping, and its uncertainty against sampling.

use std::f64::consts::TAU;

use crate::util::{Random, assert_close, mean_and_std, step};
use num_complex::Complex64;
use torqcomp_model::{FreeDecay, ModelError, ParameterStd, SecondOrder};

/// J, f and K of the measured stand, in the units of the thesis: the response is a ratio.
const STAND: [f64; 3] = [5.85e-3, 3.07, 8.1e4];

fn stand([j, f, k]: [f64; 3]) -> SecondOrder {
    SecondOrder::new(j, f, k).unwrap()
}

/// Response to T = cos ωt by time stepping until the start has died out, then correlation with
/// e^{−jωt} over whole cycles: the Fourier coefficient under the convention e^{+jωt}.
fn stepped_response(parameters: [f64; 3], frequency_hz: f64) -> Complex64 {
    let steps_per_cycle = 400;
    let dt = 1.0 / (frequency_hz * f64::from(steps_per_cycle));
    // The start dies out as e^{−262 t}: after 0.12 s it is e^{−31}, 2e-14.
    let settle = (0.12 * frequency_hz).ceil() as i32 * steps_per_cycle;
    let torque = |t: f64| (TAU * frequency_hz * t).cos();
    let mut state = [0.0, 0.0];
    let mut sum = Complex64::ZERO;
    let cycles = 5;
    for n in 0..settle + cycles * steps_per_cycle {
        let t = f64::from(n) * dt;
        if n >= settle {
            sum += parameters[2] * state[0] * Complex64::cis(-TAU * frequency_hz * t);
        }
        state = step(parameters, torque, t, dt, state);
    }
    2.0 * sum / f64::from(cycles * steps_per_cycle)
}

#[test]
fn forward_matches_time_stepping_in_magnitude_and_sign_of_phase() {
    for frequency_hz in [60.0, 400.0, 590.0, 640.0, 1200.0, 2400.0] {
        let want = stepped_response(STAND, frequency_hz);
        let got = stand(STAND).forward(frequency_hz);
        let error = (got - want).norm() / want.norm();
        // Runge-Kutta with 400 steps a cycle: (2π/400)⁴/120 per radian, here below 1e-6.
        assert!(
            error < 1e-6,
            "{frequency_hz} Hz: got {got}, want {want}, relative {error:e}"
        );
        assert!(got.im < 0.0, "the response lags under e^(+jωt)");
    }
}

#[test]
fn free_decay_constants_match_time_stepping() {
    // Release from an angle at rest; peaks are where the speed changes sign.
    let dt = 1e-7;
    let mut state = [1.0, 0.0];
    let mut peaks = Vec::new();
    for n in 0..60_000 {
        let next = step(STAND, |_| 0.0, 0.0, dt, state);
        if n > 0 && state[1] > 0.0 && next[1] <= 0.0 {
            let fraction = state[1] / (state[1] - next[1]);
            let angle = state[0] + fraction * (next[0] - state[0]);
            peaks.push(((f64::from(n) + fraction) * dt, angle));
        }
        state = next;
    }
    assert_eq!(peaks.len(), 3, "peaks at 1.7, 3.4 and 5.1 ms");
    let (first, last) = (peaks[0], peaks[2]);
    let model = stand(STAND);
    let period = (last.0 - first.0) / 2.0;
    assert_close(1.0 / period, model.damped_frequency_hz().unwrap(), 1e-6);
    let elapsed = last.0 - first.0;
    let rate = torqcomp_model::damping::decay_rate_per_s(first.1, last.1, elapsed).unwrap();
    assert_close(rate, model.decay_rate_per_s(), 1e-6);
    // And back: the decay gives the constants it was made with.
    let omega = torqcomp_model::damping::angular_frequency_rad_per_s(period).unwrap();
    let found = FreeDecay::new(rate, omega)
        .unwrap()
        .stand(STAND[0])
        .unwrap();
    assert_close(found.damping_n_m_s_per_rad(), STAND[1], 1e-6);
    assert_close(found.stiffness_n_m_per_rad(), STAND[2], 1e-6);
}

#[test]
fn static_gain_is_one_and_inverse_undoes_forward() {
    let model = stand(STAND);
    assert_eq!(model.forward(0.0), Complex64::ONE);
    assert_eq!(model.inverse(0.0), Complex64::ONE);
    for frequency_hz in [1.0, 589.0, 592.2, 2400.0] {
        let product = model.forward(frequency_hz) * model.inverse(frequency_hz);
        assert!(
            (product - 1.0).norm() < 1e-14,
            "{frequency_hz} Hz: {product}"
        );
        assert_eq!(
            model.inverse(-frequency_hz),
            model.inverse(frequency_hz).conj()
        );
    }
}

#[test]
fn frequency_and_ratio_describe_the_same_stand() {
    let model = stand(STAND);
    let (hz, ratio) = (model.natural_frequency_hz(), model.damping_ratio());
    let same = SecondOrder::from_natural_frequency(hz, ratio).unwrap();
    assert_eq!(same.stiffness_n_m_per_rad(), 1.0);
    for frequency_hz in [10.0, 590.0, 2000.0] {
        let difference = (same.inverse(frequency_hz) - model.inverse(frequency_hz)).norm();
        assert!(
            difference < 1e-12 * model.inverse(frequency_hz).norm(),
            "{difference:e}"
        );
    }
    assert_close(same.decay_rate_per_s(), model.decay_rate_per_s(), 1e-12);
}

#[test]
fn over_damped_stand_does_not_ring() {
    let critical = stand([1.0, 2.0, 1.0]);
    assert_eq!(critical.damping_ratio(), 1.0);
    assert_eq!(critical.damped_frequency_hz(), None);
    assert_eq!(stand([1.0, 5.0, 1.0]).damped_frequency_hz(), None);
    assert!(stand([1.0, 1.9, 1.0]).damped_frequency_hz().is_some());
}

#[test]
fn impossible_stands_are_refused() {
    for [j, f, k] in [[0.0, 1.0, 1.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 1.0]] {
        assert!(matches!(
            SecondOrder::new(j, f, k),
            Err(ModelError::NotPositive { .. })
        ));
    }
    assert!(matches!(
        SecondOrder::new(1.0, -1.0, 1.0),
        Err(ModelError::Negative { .. })
    ));
    assert!(matches!(
        SecondOrder::new(1.0, f64::NAN, 1.0),
        Err(ModelError::NotFinite { .. })
    ));
    let zero = SecondOrder::from_natural_frequency(0.0, 0.1);
    assert!(matches!(zero, Err(ModelError::NotPositive { .. })));
    let negative = SecondOrder::from_natural_frequency(1.0, -0.1);
    assert!(matches!(negative, Err(ModelError::Negative { .. })));
}

#[test]
fn gradient_matches_finite_differences() {
    for frequency_hz in [5.0, 300.0, 560.0, 592.2, 640.0, 2400.0] {
        let gradient = stand(STAND).inverse_gradient(frequency_hz).unwrap();
        for i in 0..3 {
            let h = 1e-6 * STAND[i];
            let at = |sign: f64| {
                let mut moved = STAND;
                moved[i] += sign * h;
                stand(moved).inverse(frequency_hz)
            };
            let ratio = (at(1.0) / at(-1.0)).ln();
            let (magnitude, phase) = (ratio.re / (2.0 * h), ratio.im / (2.0 * h));
            // Differences lose digits to rounding: 1e-16/1e-6 of the scale of one parameter.
            let scale = 1e-8 / STAND[i];
            assert!(
                (gradient.ln_magnitude[i] - magnitude).abs() < 1e-6 * magnitude.abs() + scale,
                "{frequency_hz} Hz, parameter {i}: {} against {magnitude}",
                gradient.ln_magnitude[i]
            );
            assert!(
                (gradient.phase_rad[i] - phase).abs() < 1e-6 * phase.abs() + scale,
                "{frequency_hz} Hz, parameter {i}: {} against {phase}",
                gradient.phase_rad[i]
            );
        }
    }
}

#[test]
fn uncertainty_matches_monte_carlo() {
    let relative = [0.004, 0.03, 0.003];
    let gain = 0.005;
    let std = ParameterStd {
        inertia_kg_m2: Some(relative[0] * STAND[0]),
        damping_n_m_s_per_rad: Some(relative[1] * STAND[1]),
        stiffness_n_m_per_rad: Some(relative[2] * STAND[2]),
        static_gain_relative: Some(gain),
        ..ParameterStd::default()
    };
    let mut random = Random::new(20_240_229);
    for frequency_hz in [100.0, 450.0, 592.0, 700.0, 2400.0] {
        let centre = stand(STAND).inverse(frequency_hz);
        let draws: Vec<Complex64> = (0..40_000)
            .map(|_| {
                let moved =
                    std::array::from_fn(|i| STAND[i] * (1.0 + relative[i] * random.normal()));
                let scale = 1.0 + gain * random.normal();
                (scale * stand(moved).inverse(frequency_hz) / centre).ln()
            })
            .collect();
        let (_, magnitude) = mean_and_std(&draws.iter().map(|d| d.re).collect::<Vec<_>>());
        let (_, phase) = mean_and_std(&draws.iter().map(|d| d.im).collect::<Vec<_>>());
        let got = stand(STAND)
            .inverse_uncertainty(frequency_hz, &std)
            .unwrap()
            .unwrap();
        // 40,000 draws know a standard deviation to 0.35 %; the rest is curvature.
        assert_close(got.magnitude_relative, magnitude, 0.02);
        assert_close(got.phase_rad, phase, 0.02);
    }
}

#[test]
fn unknown_uncertainty_stays_unknown() {
    let model = stand(STAND);
    let unknown = ParameterStd::default();
    assert_eq!(model.inverse_uncertainty(100.0, &unknown), Ok(None));
    let exact = ParameterStd {
        stiffness_n_m_per_rad: Some(0.0),
        ..unknown
    };
    let got = model.inverse_uncertainty(100.0, &exact).unwrap().unwrap();
    assert_eq!((got.magnitude_relative, got.phase_rad), (0.0, 0.0));
    let gain = ParameterStd {
        static_gain_relative: Some(0.01),
        ..unknown
    };
    let got = model.inverse_uncertainty(592.0, &gain).unwrap().unwrap();
    assert_eq!((got.magnitude_relative, got.phase_rad), (0.01, 0.0));
    let negative = ParameterStd {
        inertia_kg_m2: Some(-1.0),
        ..unknown
    };
    assert!(matches!(
        model.inverse_uncertainty(100.0, &negative),
        Err(ModelError::Negative { .. })
    ));
}

#[test]
fn undamped_resonance_has_no_gradient() {
    // K is ω² as the code rounds it, so K − Jω² is exactly 0.
    let model = stand([1.0, 0.0, (TAU * 0.25) * (TAU * 0.25)]);
    assert!(matches!(
        model.inverse_gradient(0.25),
        Err(ModelError::UndampedResonance { frequency_hz: 0.25 })
    ));
    assert!(!model.forward(0.25).is_finite());
}
