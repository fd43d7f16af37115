//! Torques in stands whose motion another effect changes: they act on the motion of the whole.

use super::*;

const DRAG: f64 = 2e-8;

/// Drag on the first of two coupled inertias, and dry friction that is smooth enough for the oracle.
#[test]
fn torques_act_on_the_first_of_two_inertias() {
    let w = MODE.omega_rad_s;
    let (second_hz, zeta, ratio) = (830.0, 0.03, 0.15);
    let (loss, spring) = (2.0 * zeta * TAU * second_hz, (TAU * second_hz).powi(2));
    let check = |effect: &str, form: &str, values: &[f64], torque: &dyn Fn(f64) -> f64| {
        let truth = oracle(|t, [x, v, y, u]| {
            let pull = loss * (u - v) + spring * (y - x);
            let own = w * w * (input_at(t) - x - torque(v)) - 2.0 * MODE.damping_ratio * w * v;
            [v, own + ratio * pull, u, -pull]
        });
        let hung: &[f64] = &[second_hz, zeta, ratio];
        let model = chain(&[("second-mode", "coupled", hung), (effect, form, values)]);
        let error = error(&model, &truth, 8);
        assert!(error < 5e-4, "{effect}: {error:e}");
    };
    check("quadratic-damping", "drag", &[DRAG], &|v| {
        DRAG * v * v.abs()
    });
    let friction = |v: f64| 0.1 * (v / 500.0).tanh();
    check("coulomb-friction", "tanh", &[0.1, 500.0], &friction);
}

/// Drag beside a springpot, whose stiffness `(jω/ω₀)^α = sin(πα)/π ∫ p^α jω/(jω + p ω₀) dp/p` is a sum of relaxations (F.
/// Mainardi, *Fractional Calculus and Waves in Linear Viscoelasticity* (2010), 2.4). The model is exact at the resonance.
#[test]
fn drag_beside_a_springpot_acts_on_its_motion() {
    const COUNT: usize = 26;
    let (w, order) = (MODE.omega_rad_s, 0.12);
    let step = 1e6f64.ln() / (COUNT - 2) as f64;
    let pole = |k: f64| 1e-4 * (step * k).exp();
    let scale = (std::f64::consts::PI * order).sin() / std::f64::consts::PI;
    // Slower relaxations act as a spring, ∫ p^(α−1) dp, and faster ones as a damper, ∫ p^(α−2) dp.
    let [first, last] = [-0.5, COUNT as f64 - 2.5].map(pole);
    let slow = scale * first.powf(order) / order;
    let fast = scale * last.powf(order - 1.0) / (1.0 - order);
    let truth = oracle(|t, s: [f64; COUNT]| {
        let (x, v) = (s[0], s[1]);
        let mut rates = [0.0; COUNT];
        let mut spring = slow * x + fast * v / w;
        for k in 2..COUNT {
            let (stretched, own) = (x - s[k], pole(k as f64 - 2.0));
            rates[k] = own * w * stretched;
            spring += scale * step * own.powf(order) * stretched;
        }
        let torque = DRAG * v * v.abs();
        rates[0] = v;
        rates[1] = w * w * (input_at(t) - spring - torque) - 2.0 * MODE.damping_ratio * w * v;
        rates
    });
    let pot: (&str, &str, &[f64]) = ("structural-damping", "springpot", &[order]);
    let without = chain(&[pot]).simulate(&input(8), MotionState::default());
    let late = super::COUNT / 4;
    let off = |found: &[f64]| {
        let left = found[late..].iter().zip(&truth[late..]).map(|(a, b)| a - b);
        rms(left) / rms(truth[late..].iter().copied())
    };
    let model = chain(&[pot, ("quadratic-damping", "drag", &[DRAG])]);
    let found = model.simulate(&input(8), MotionState::default());
    println!("{:e} {:e}", off(&without), off(&found));
    assert!(off(&found) < 0.07 * off(&without), "{:e}", off(&found));
}
