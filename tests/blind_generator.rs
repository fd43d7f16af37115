//! Validation of the blind records: their integrator against closed-form solutions.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::blind::draw::Draw;
use crate::blind::excitation::{Excitation, Input, Line, RATE_HZ};
use crate::blind::integrate::run;
use crate::blind::plain_fit::{PlainConstants, answer, rms};
use crate::blind::plant::{Built, Constants, Plain, Scene};
use crate::blind::span::Span;
use crate::blind::{catalogue, friction, linear, record, several, sizing};

fn sines(lines: &[(f64, f64, f64)]) -> Excitation {
    Excitation::Multisine {
        lines: lines
            .iter()
            .map(|(amplitude, frequency_hz, phase_rad)| Line {
                amplitude: *amplitude,
                frequency_hz: *frequency_hz,
                phase_rad: *phase_rad,
            })
            .collect(),
        second_half: 1.0,
        settled: true,
    }
}

fn scene() -> Scene {
    Scene {
        constants: Constants::hertel(),
        shown_peak: 4.0,
        shown_rms: 2.0,
        speed_rms: 0.1,
        applied_rms: 2.0,
        top_hz: 1500.0,
        span: Span::THESIS,
        filtered: false,
    }
}

/// `K / (K − Jω² + jωf)`
fn response(frequency_hz: f64) -> Complex64 {
    let stand = Constants::hertel();
    let omega = TAU * frequency_hz;
    let rest = Complex64::new(
        stand.stiffness_n_m - stand.inertia_kg_m2 * omega * omega,
        stand.damping_n_m_s * omega,
    );
    stand.stiffness_n_m / rest
}

fn largest_difference(signal: &[f64], closed_form: impl Fn(f64) -> f64) -> f64 {
    let at = |(index, value): (usize, &f64)| (value - closed_form(index as f64 / RATE_HZ)).abs();
    signal.iter().enumerate().map(at).fold(0.0, f64::max)
}

const LINES: [(f64, f64, f64); 3] = [(1.0, 35.0, 0.3), (0.5, 590.0, -1.0), (0.8, 2150.0, 2.0)];

fn steady(time_s: f64, factor: impl Fn(f64) -> Complex64) -> f64 {
    LINES
        .iter()
        .map(|(amplitude, frequency_hz, phase)| {
            let turned = Complex64::from_polar(*amplitude, TAU * frequency_hz * time_s + phase);
            (turned * factor(*frequency_hz)).re
        })
        .sum()
}

#[test]
fn plain_stand_answers_a_multisine_as_its_response_says() {
    let input = sines(&LINES).input();
    let dense = run(&Plain(Constants::hertel()), &input);
    let off = largest_difference(&dense.samples(), |time_s| steady(time_s, response));
    assert!(off < 1e-7, "{off:e}");
    let stand = Constants::hertel();
    let plain = PlainConstants {
        omega: stand.omega(),
        damping_ratio: stand.damping_ratio(),
    };
    let off = largest_difference(&answer(plain, &input), |time_s| steady(time_s, response));
    assert!(off < 1e-4, "{off:e}");
}

#[test]
fn delay_and_low_pass_are_those_of_their_responses() {
    let input = sines(&LINES).input();
    let mut draw = Draw::new(0, "");
    let shown = |built: &Built| {
        let dense = run(built.dynamics.as_ref(), &input);
        built
            .on_dense
            .as_ref()
            .map_or(dense.clone(), |change| change(dense.clone()))
            .samples()
    };
    let delayed = shown(&linear::delay(&scene(), 3.7, &mut draw));
    let late = |f: f64| response(f) * Complex64::from_polar(1.0, -TAU * f * 3.7 / RATE_HZ);
    let off = largest_difference(&delayed, |time_s| steady(time_s, late));
    assert!(off < 1e-7, "delay {off:e}");
    let passed = shown(&linear::low_pass_1(&scene(), 1.5, &mut draw));
    let low = |f: f64| response(f) / Complex64::new(1.0, f / 400.0);
    let off = largest_difference(&passed, |time_s| steady(time_s, low));
    assert!(off < 1e-7, "low-pass {off:e}");
}

/// The definition of a name in the catalogue.
fn variant(effect: &str, name: &str) -> &'static catalogue::Variant {
    let mut all = catalogue::CATALOGUE.iter();
    all.find(|v| v.effect == effect && v.name == name)
        .expect("the catalogue has it")
}

/// Record of a multisine with effects of these sizes in one stand.
fn together(effects: &[(&str, &str, f64)], input: &Input) -> (Built, Vec<f64>) {
    let variants: Vec<_> = effects
        .iter()
        .map(|(e, name, _)| variant(e, name))
        .collect();
    let parts = variants.iter().zip(effects).enumerate();
    let parts = parts
        .map(|(k, (v, (_, _, size)))| (v.build)(&scene(), *size, &mut Draw::new(k as u64, "")));
    let built = several::joined(Constants::hertel(), &variants, parts.collect::<Vec<_>>());
    let signal = sizing::noise_free(&built, input, 0, 1);
    (built, signal)
}

#[test]
fn linear_effects_together_are_the_product_of_their_responses() {
    let input = sines(&LINES).input();
    let effects = [
        ("second-mode", "modal", 0.1),
        ("gain-error", "gain", 0.05),
        ("recorder-lowpass", "first order", 1.5),
        ("time-delay", "delay", 3.7),
    ];
    let (built, signal) = together(&effects, &input);
    let p = |key: &str| {
        let mut all = built.parameters.iter();
        all.find(|(name, _)| *name == key).expect("a parameter").1
    };
    let (second, ratio, share) = (p("frequency_hz"), p("damping_ratio"), p("share"));
    let closed_form = |f: f64| {
        let r = f / second;
        let mode = Complex64::new(1.0 - r * r, 2.0 * ratio * r).inv();
        let sum = (1.0 - share) * response(f) + share * mode;
        let delay = Complex64::from_polar(1.0, -TAU * f * 3.7 / RATE_HZ);
        p("gain") * sum * delay / Complex64::new(1.0, f / 400.0)
    };
    let off = largest_difference(&signal, |time_s| steady(time_s, closed_form));
    assert!(off < 1e-4, "{off:e}");
}

#[test]
fn torques_together_add_up() {
    let input = sines(&LINES).input();
    let cubic = |size: f64| ("cubic-stiffness", "hardening", size);
    let (_, both) = together(&[cubic(0.05), cubic(0.1)], &input);
    let (_, one) = together(&[cubic(0.15)], &input);
    let (_, less) = together(&[cubic(0.1)], &input);
    let apart =
        |other: &[f64]| largest_difference(&both, |t| other[(t * RATE_HZ).round() as usize]);
    assert!(apart(&one) < 1e-9 && apart(&less) > 1e-3);
}

#[test]
fn dry_friction_holds_and_then_takes_its_part() {
    let built = friction::coulomb(&scene(), 0.5, &mut Draw::new(0, ""));
    // 1 N m of friction: a slow sine of 0.99 N m moves nothing, one of 3 N m shows 2 N m at most and
    // holds that while the torque falls by 2 N m.
    let still = run(built.dynamics.as_ref(), &sines(&[(0.99, 2.5, 0.0)]).input()).samples();
    assert!(still.iter().all(|shown| *shown == 0.0));
    let moved = run(built.dynamics.as_ref(), &sines(&[(3.0, 2.5, 0.0)]).input()).samples();
    let peak = moved.iter().copied().fold(f64::MIN, f64::max);
    assert!((peak - 2.0).abs() < 2e-3, "{peak}");
    // From the peak at 0.4 s to where 3 cos has fallen to 1: arccos(1/3) / (2π 2.5 Hz) = 78.4 ms.
    let kept = &moved[8_010..9_550];
    assert!(kept.iter().all(|shown| (shown - kept[0]).abs() < 1e-9));
    assert!((moved[9_650] - kept[0]).abs() > 1e-3);
}

#[test]
fn every_effect_is_neutral_when_small_and_not_when_large() {
    let excitation = Excitation::multisine(&mut Draw::new(3, "excitation"), 2.0, false);
    let input = excitation.input();
    let plain = run(&Plain(Constants::hertel()), &input);
    // One of each kind of equation, as all variants would take a minute.
    let some = ["coupled", "cubic", "hardening", "gap", "exponent 1"];
    for variant in catalogue::CATALOGUE
        .iter()
        .filter(|variant| some.contains(&variant.name))
    {
        let apart = |size: f64| {
            let built = (variant.build)(&scene(), size, &mut Draw::new(1, "effect"));
            let mut dense = run(built.dynamics.as_ref(), &input);
            if let Some(change) = &built.on_dense {
                dense = change(dense);
            }
            let difference: Vec<f64> = dense
                .samples()
                .iter()
                .zip(plain.samples())
                .map(|(a, b)| a - b)
                .collect();
            rms(&difference) / rms(&plain.samples())
        };
        let (small, large) = (apart(1e-6), apart(variant.sizes.1));
        assert!(
            small < 1e-3 && large > 3.0 * small,
            "{}: {small:e}, {large:e}",
            variant.name
        );
    }
}

#[test]
fn the_same_seed_gives_the_same_records() {
    let make = |seed| record::make(seed, "none", 0).expect("a listed effect");
    let (first, again, other) = (make(5), make(5), make(6));
    assert_eq!(first.train.measured_n_m, again.train.measured_n_m);
    assert_eq!(first.truth, again.truth);
    assert_ne!(first.train.measured_n_m, other.train.measured_n_m);
    assert!(record::make(5, "no such effect", 0).is_none());
}
