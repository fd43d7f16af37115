//! The simulator against closed-form solutions and an independent integrator with a far finer step.

use std::f64::consts::TAU;

use super::{Between, Excitation, MotionState};
use crate::chain::{Chain, Link};
use crate::effects::{Action, Effect, Mode, RIVALS, Stage};
use crate::modal::{ModalPart, ModalResponse};

mod kinks;
mod within;

pub(super) const RATE_HZ: f64 = 20_000.0;
const COUNT: usize = 2000;
pub(super) const MODE: Mode = Mode {
    omega_rad_s: TAU * 590.0,
    damping_ratio: 0.07,
};
/// Tones of the input: amplitude, frequency, phase. Their sum and its slope are zero at the start.
const TONES: [(f64, f64); 4] = [(1.0, 80.0), (0.8, 310.0), (0.7, 620.0), (0.4, 1430.0)];

/// An input that starts and ends smoothly, so that it is practically band-limited.
fn input_at(time_s: f64) -> f64 {
    let length_s = COUNT as f64 / RATE_HZ;
    let fade = (0.5 * TAU * (time_s / length_s).clamp(0.0, 1.0))
        .sin()
        .powi(4);
    let tones = TONES.iter().map(|(a, f)| a * (TAU * f * time_s).sin());
    fade * tones.sum::<f64>()
}

fn input(substeps: usize) -> Excitation {
    let samples = (0..COUNT).map(|i| input_at(i as f64 / RATE_HZ)).collect();
    Excitation::new(samples, RATE_HZ, 0.0, substeps)
}

/// A stand with effects: name, form and parameters of each.
pub(super) fn chain(effects: &[(&str, &str, &[f64])]) -> Chain {
    let link = |(effect, form, values): &(&str, &str, &[f64])| {
        let effect = Effect::named(effect).unwrap();
        Link::of(effect, effect.form(Some(form)).unwrap(), values)
    };
    Chain::new(MODE, 1.0).with_links(effects.iter().map(link))
}

fn model(effect: &str, form: &str, values: &[f64]) -> Chain {
    with(Effect::named(effect).unwrap(), form, values)
}

/// A law from outside the list of effects.
fn rival(law: &str, form: &str, values: &[f64]) -> Chain {
    let found = RIVALS.iter().find(|rival| rival.name == law);
    with(found.unwrap(), form, values)
}

fn with(effect: &'static Effect, form: &str, values: &[f64]) -> Chain {
    let form = effect.form(Some(form)).unwrap();
    Chain::new(MODE, 1.0).with_links([Link::of(effect, form, values)])
}

fn plain() -> Chain {
    Chain::new(MODE, 1.0)
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(s, n), v| (s + v * v, n + 1));
    (sum / f64::from(count)).sqrt()
}

/// Classical fourth-order Runge–Kutta on `(x, x', …)` with steps of a 200th of a sample.
fn oracle<const N: usize>(rates: impl Fn(f64, [f64; N]) -> [f64; N]) -> Vec<f64> {
    const FINE: usize = 200;
    let h = 1.0 / (RATE_HZ * FINE as f64);
    let mut state = [0.0; N];
    let mut samples = Vec::new();
    let moved = |s: [f64; N], k: [f64; N], h: f64| std::array::from_fn(|i| s[i] + h * k[i]);
    for step in 0..(COUNT - 1) * FINE + 1 {
        if step % FINE == 0 {
            samples.push(state[0]);
        }
        let t = step as f64 * h;
        let a = rates(t, state);
        let b = rates(t + 0.5 * h, moved(state, a, 0.5 * h));
        let c = rates(t + 0.5 * h, moved(state, b, 0.5 * h));
        let d = rates(t + h, moved(state, c, h));
        for i in 0..N {
            state[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
        }
    }
    samples
}

/// `x''` without the torques.
fn linear(t: f64, s: [f64; 3]) -> f64 {
    let w = MODE.omega_rad_s;
    w * w * (input_at(t) - s[0]) - 2.0 * MODE.damping_ratio * w * s[1]
}

fn error(model: &Chain, truth: &[f64], substeps: usize) -> f64 {
    let found = model.simulate_from(&input(substeps), MotionState::default());
    rms(found.iter().zip(truth).map(|(a, b)| a - b)) / rms(truth.iter().copied())
}

#[test]
fn both_ways_of_the_linear_stand_agree_with_the_oracle() {
    let truth = oracle(|t, s| [s[1], linear(t, s), 0.0]);
    let in_time = error(&plain(), &truth, 4);
    assert!(in_time < 4e-5, "{in_time:e}");
    // By the second half, the effect of the backward extension has decayed.
    let through_spectrum = plain().simulate(&input(4), MotionState::default());
    let late = COUNT / 2;
    let difference = through_spectrum[late..]
        .iter()
        .zip(&truth[late..])
        .map(|(a, b)| a - b);
    let error = rms(difference) / rms(truth[late..].iter().copied());
    assert!(error < 1e-6, "{error:e}");
}

/// Two modes with complex residues, and compliance above them: time domain against frequency domain.
#[test]
fn several_modes_in_time_are_their_response() {
    let part = |hz: f64, residue, quadrature| ModalPart {
        mode: Mode {
            omega_rad_s: TAU * hz,
            damping_ratio: 0.05,
        },
        residue,
        quadrature,
        at_gage: None,
    };
    let modes = ModalResponse::new(vec![part(590.0, 1.1, 0.05), part(1300.0, -0.2, 0.1)]);
    let chain = Chain::new(modes.unwrap(), 1.3);
    assert!((chain.stand.residual() - 0.1).abs() < 1e-12);
    let in_time = chain.simulate_from(&input(4), MotionState::default());
    let through_spectrum = chain.simulate(&input(4), MotionState::default());
    let late = COUNT / 2..COUNT - 1;
    let pairs = in_time[late.clone()]
        .iter()
        .zip(&through_spectrum[late.clone()]);
    let error = rms(pairs.map(|(a, b)| a - b)) / rms(in_time[late].iter().copied());
    println!("{error:e}");
    assert!(error < 1e-4, "{error:e}");
}

/// Other input waveforms between samples; the reference integrates the waveform directly.
#[test]
fn held_samples_and_straight_lines_agree_with_the_oracle() {
    let sample = |i: f64| input_at(i.clamp(0.0, (COUNT - 1) as f64) / RATE_HZ);
    // The midpoint of a step of the reference determines the sample that it lies in.
    let held = |place: f64| sample((place + 1e-9).floor());
    let line = |place: f64| {
        let part = place - place.floor();
        (1.0 - part) * sample(place.floor()) + part * sample(place.floor() + 1.0)
    };
    let ways: [(Between, &dyn Fn(f64) -> f64); 2] =
        [(Between::Held, &held), (Between::StraightLines, &line)];
    let w = MODE.omega_rad_s;
    for (between, at) in ways {
        let damped = |s: [f64; 3]| -w * w * s[0] - 2.0 * MODE.damping_ratio * w * s[1];
        let truth = oracle(|t, s| [s[1], w * w * at(t * RATE_HZ) + damped(s), 0.0]);
        let found = plain().simulate_from(&input(4).with_between(between), MotionState::default());
        let error = |found: &[f64]| {
            let left = found.iter().zip(&truth).map(|(a, b)| a - b);
            rms(left) / rms(truth.iter().copied())
        };
        let (with, without) = (
            error(&found),
            error(&plain().simulate_from(&input(4), MotionState::default())),
        );
        println!("{}: {with:e} instead of {without:e}", between.name());
        assert!(with < 3e-4 && with < 0.1 * without, "{with:e} {without:e}");
    }
}

/// From rest under a constant input: `1 − e^{−ζω₀t} (cos ω_d t + ζω₀/ω_d sin ω_d t)`.
#[test]
fn free_motion_is_the_closed_form() {
    let [from_one, from_speed] = plain().free_motion(RATE_HZ, 100);
    let sigma = MODE.damping_ratio * MODE.omega_rad_s;
    let damped = MODE.omega_rad_s * (1.0 - MODE.damping_ratio.powi(2)).sqrt();
    for i in 0..100 {
        let t = i as f64 / RATE_HZ;
        let decay = (-sigma * t).exp();
        let expected = decay * ((damped * t).cos() + sigma / damped * (damped * t).sin());
        assert!((from_one[i] - expected).abs() < 1e-12);
        let expected = decay * MODE.omega_rad_s / damped * (damped * t).sin();
        assert!((from_speed[i] - expected).abs() < 1e-12);
    }
}

/// The errors at two step sizes show the order of convergence.
fn converges(model: &Chain, truth: &[f64], at_four: f64, at_sixteen: f64) {
    let (coarse, fine) = (error(model, truth, 4), error(model, truth, 16));
    println!("{coarse:e} {fine:e}");
    assert!(coarse < at_four, "{coarse:e}");
    assert!(fine < at_sixteen, "{fine:e}");
}

#[test]
fn cubic_stiffness() {
    let w2 = MODE.omega_rad_s.powi(2);
    let truth = oracle(|t, s| [s[1], linear(t, s) - w2 * 0.02 * s[0].powi(3), 0.0]);
    converges(
        &model("cubic-stiffness", "beside", &[0.02]),
        &truth,
        1e-4,
        6e-6,
    );
}

#[test]
fn quadratic_damping() {
    let w2 = MODE.omega_rad_s.powi(2);
    let d = 1e-8;
    let truth = oracle(|t, s| [s[1], linear(t, s) - w2 * d * s[1] * s[1].abs(), 0.0]);
    converges(
        &model("quadratic-damping", "drag", &[d]),
        &truth,
        1e-4,
        6e-6,
    );
}

#[test]
fn laws_beside_the_list() {
    let w2 = MODE.omega_rad_s.powi(2);
    let against = |model: &Chain, torque: fn([f64; 3]) -> f64, at_four: f64, at_sixteen: f64| {
        let truth = oracle(|t, s| [s[1], linear(t, s) - w2 * torque(s), 0.0]);
        converges(model, &truth, at_four, at_sixteen);
    };
    let model = rival("quintic-stiffness", "beside", &[2e-3]);
    against(&model, |s| 2e-3 * s[0].powi(5), 2e-4, 1e-5);
    let model = rival("cubic-damping", "cube", &[1e-12]);
    against(&model, |s| 1e-12 * s[1].powi(3), 2e-4, 1e-5);
    let model = rival("squeezed-damping", "square", &[2e-5]);
    against(&model, |s| 2e-5 * s[0] * s[0] * s[1], 2e-4, 1e-5);
    let model = self::model("end-stop", "both", &[0.8, 1.5]);
    let stop = |s: [f64; 3]| 0.8 * (s[0] - s[0].clamp(-1.5, 1.5));
    against(&model, stop, 2e-3, 3e-4);
    let model = self::model("end-stop", "above", &[0.5, 1.2]);
    against(&model, |s| 0.5 * (s[0] - 1.2).max(0.0), 2e-3, 3e-4);
    let model = self::model("end-stop", "below", &[0.5, 1.2]);
    against(&model, |s| 0.5 * (s[0] + 1.2).min(0.0), 2e-3, 3e-4);
}

#[test]
fn smooth_friction() {
    let w2 = MODE.omega_rad_s.powi(2);
    let truth = oracle(|t, s| [s[1], linear(t, s) - w2 * 0.2 * (s[1] / 200.0).tanh(), 0.0]);
    converges(
        &model("coulomb-friction", "tanh", &[0.2, 200.0]),
        &truth,
        4e-4,
        3e-5,
    );
}

#[test]
fn gap() {
    let w2 = MODE.omega_rad_s.powi(2);
    let truth = oracle(|t, s| [s[1], linear(t, s) + w2 * s[0].clamp(-0.2, 0.2), 0.0]);
    converges(&model("backlash", "gap-beside", &[0.2]), &truth, 2e-3, 3e-4);
}

#[test]
fn hysteresis() {
    let w2 = MODE.omega_rad_s.powi(2);
    let truth = oracle(|t, s| {
        let z = s[2];
        let rate = s[1] - 0.5 * s[1].abs() * z - 0.2 * s[1] * z.abs();
        [s[1], linear(t, s) - w2 * 0.4 * z, rate]
    });
    converges(
        &model("bouc-wen-hysteresis", "linear", &[0.4, 0.5, 0.2]),
        &truth,
        4e-4,
        3e-5,
    );
}

/// Sharp friction by Heun's method at a 400th of a sample: a constant torque between sign changes. A step in which the
/// speed would change sign ends where it is zero; there the stand stays unless the rest of the torques exceeds the
/// friction.
fn dry_oracle(friction: f64) -> Vec<f64> {
    let step = 1.0 / (RATE_HZ * 400.0);
    let limit = MODE.omega_rad_s.powi(2) * friction;
    let (mut t, mut x, mut v) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut samples = vec![0.0];
    for sample in 1..COUNT {
        let end = sample as f64 / RATE_HZ;
        while end - t > 1e-15 {
            let mut h = step.min(end - t);
            let free = linear(t, [x, v, 0.0]);
            let sign = if v == 0.0 { free.signum() } else { v.signum() };
            if v == 0.0 && free.abs() <= limit {
                t += h;
                continue;
            }
            let first = free - limit * sign;
            let second = linear(t + h, [x + h * v, v + h * first, 0.0]) - limit * sign;
            let mut next = v + 0.5 * h * (first + second);
            if next * sign < 0.0 {
                h *= v / (v - next);
                next = 0.0;
            }
            x += 0.5 * h * (v + next);
            v = next;
            t += h;
        }
        samples.push(x);
    }
    samples
}

#[test]
fn sharp_friction() {
    for friction in [0.05, 0.4] {
        let truth = dry_oracle(friction);
        converges(
            &model("coulomb-friction", "sharp", &[friction]),
            &truth,
            3e-4,
            5e-5,
        );
    }
}

/// A stand held by friction does not creep or chatter.
#[test]
fn a_stand_that_sticks_stays() {
    let held = model("coulomb-friction", "sharp", &[100.0]);
    let found = held.simulate_from(&input(4), MotionState::default());
    assert!(
        found.iter().all(|x| *x == 0.0),
        "{:?}",
        found.iter().fold(0.0_f64, |m, x| m.max(x.abs()))
    );
}

#[test]
fn a_delay_of_whole_samples_shifts_the_record() {
    let late = model("time-delay", "lag", &[5.0 / RATE_HZ]);
    let (now, then) = (
        plain().simulate(&input(1), MotionState::default()),
        late.simulate(&input(1), MotionState::default()),
    );
    for i in 100..COUNT - 100 {
        assert!((then[i] - now[i - 5]).abs() < 1e-6);
    }
}

#[test]
fn effects_of_no_size_change_nothing() {
    let base = plain().simulate_from(&input(4), MotionState::default());
    for (effect, form, values) in [
        ("cubic-stiffness", "beside", vec![0.0]),
        ("quadratic-stiffness", "even", vec![0.0]),
        ("coulomb-friction", "sharp", vec![0.0]),
        ("quadratic-damping", "drag", vec![0.0]),
        ("backlash", "gap", vec![0.0]),
        ("bouc-wen-hysteresis", "linear", vec![0.0, 1.0, 1.0]),
        ("structural-damping", "loss-factor", vec![0.0]),
        ("time-delay", "lag", vec![0.0]),
        ("gain-error", "factor", vec![0.0]),
        ("recorder-lowpass", "order-2", vec![f64::INFINITY]),
        ("gage-nonlinearity", "both", vec![0.0, 0.0]),
        ("saturation", "hard", vec![1e9]),
        ("thermal-drift", "linear", vec![0.0]),
        ("capacitive-coupling", "slope-of-load", vec![0.0]),
    ] {
        let with = model(effect, form, &values).simulate_from(&input(4), MotionState::default());
        let change = rms(with.iter().zip(&base).map(|(a, b)| a - b));
        assert!(change < 1e-9, "{effect}: {change:e}");
    }
}

#[test]
fn distortions_are_inverted() {
    for (effect, form, values) in [
        ("gage-nonlinearity", "both", vec![0.02, 0.003]),
        ("saturation", "soft", vec![9.0]),
        ("saturation", "knee", vec![9.0, 3.0]),
        ("thermal-drift", "exponential", vec![0.5, 0.02]),
        ("thermal-drift", "sensitivity", vec![2.0]),
    ] {
        let model = model(effect, form, &values);
        let Action::Distortion(distortion) = &model.links()[0].action else {
            panic!("{effect} is not a distortion");
        };
        let clock = crate::effects::SampleClock {
            step_s: 1.0 / RATE_HZ,
        };
        let before: Vec<f64> = (0..200).map(|i| 3.0 * (0.1 * f64::from(i)).sin()).collect();
        let mut samples = before.clone();
        distortion.forward(clock, &mut samples);
        assert!(samples != before);
        let lost = distortion.inverse(clock, 0.0, &mut samples);
        assert!(lost.samples.is_empty(), "{effect}: {lost:?}");
        for (a, b) in samples.iter().zip(&before) {
            assert!((a - b).abs() < 1e-9, "{effect}: {a} {b}");
        }
    }
    assert!(Stage::Stand < Stage::Dynamics && Stage::Gage < Stage::Chain);
}

/// With held levels and three samples per turn, the stand's response equals the closed-form step response, whichever
/// way it is computed.
#[test]
fn held_levels_give_the_closed_form() {
    let (rate_hz, damping_ratio) = (100.0, 0.2);
    let omega = TAU * 33.0;
    let mode = Mode {
        omega_rad_s: omega,
        damping_ratio,
    };
    let levels: Vec<f64> = (0..600).map(|i| ((i * i) % 7) as f64 - 3.0).collect();
    // Each change of level adds Δ (1 − e^{−σt} (cos ω_d t + σ/ω_d sin ω_d t)).
    let (sigma, turning) = (
        damping_ratio * omega,
        omega * (1.0 - damping_ratio.powi(2)).sqrt(),
    );
    let step = |t: f64| {
        let (sine, cosine) = (turning * t).sin_cos();
        1.0 - (-sigma * t).exp() * (cosine + sigma / turning * sine)
    };
    let exact = |i: usize| -> f64 {
        let jump = |k: usize| levels[k] - if k == 0 { 0.0 } else { levels[k - 1] };
        (0..i)
            .map(|k| jump(k) * step((i - k) as f64 / rate_hz))
            .sum()
    };
    let input = Excitation::new(levels.clone(), rate_hz, 0.0, 4).with_between(Between::Held);
    let chain = Chain::new(mode, 1.0);
    let integrated = chain.simulate_from(&input, MotionState::default());
    let responded = chain.simulate(&input, MotionState::default());
    // The frequency-domain result includes the backward extension, which has decayed after ten
    // turns.
    for i in 60..560 {
        let exact = exact(i);
        assert!((integrated[i] - exact).abs() < 1e-11, "{i}");
        assert!(
            (responded[i] - exact).abs() < 1e-9,
            "{i}: {} {exact}",
            responded[i]
        );
    }
}
