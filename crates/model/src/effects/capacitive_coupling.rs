//! A stray or series capacitance in the measuring chain.
//!
//! `slope-of-load`: `y = x + G τ u'`, the derivative of the load couples into the record; at a load step it is the
//! spike that the thesis attributes to "capacitive coupling within the recorder". `slope-of-record`: `y = x + τ x'`.
//! `high-pass-leak`: `y = x + c s τ/(1 + s τ) G u`. `ac-coupled`: `y = s/(s + ω_c) x`, a series capacitor. **Valid far
//! below the corner of the stray path** for the first two. Mistaken for `second-mode` below the excitation,
//! `time-delay` of the other channel.

use super::action::PastStand;
use super::{Action, Effect, EffectParameter, Form, History, Stage};
use crate::simulate::Between;
use num_complex::Complex64;
use std::f64::consts::TAU;

pub(super) static EFFECT: Effect = Effect {
    name: "capacitive-coupling",
    equation: "y = x + G tau u'",
    meaning: "A stray capacitance couples the slope of the load into the record, or a series capacitor blocks low \
        frequencies.",
    remedy: "Shield the gage's cable, keep it away from the motor supply, and set the recorder's input to DC.",
    source: "T. P. Hertel's thesis, section III",
    validity: "far below the corner of the stray path",
    mistaken_for: &["second-mode", "time-delay"],
    experiment: "the same excitation with the gage's supply off: any remaining signal is coupled",
    forms: &[
        Form {
            name: "slope-of-load",
            law: "y = x + G tau u'",
            stage: Stage::Chain,
            parameters: &[EffectParameter::motion("time", 0, 1, -5.0, 5.0)],
            starts: &[&[0.005]],
            build: |p| {
                let time_s = p[0];
                Action::Feedthrough(PastStand {
                    response: Box::new(move |_, omega| Complex64::new(0.0, omega * time_s)),
                    sampled: None,
                })
            },
        },
        Form {
            name: "slope-of-record",
            law: "y = x + tau x'",
            stage: Stage::Chain,
            parameters: &[EffectParameter::motion("time", 0, 1, -5.0, 5.0)],
            starts: &[&[0.005]],
            build: |p| {
                let time_s = p[0];
                Action::Factor(Box::new(move |_, omega| {
                    Complex64::new(1.0, omega * time_s)
                }))
            },
        },
        Form {
            name: "high-pass-leak",
            law: "y = x + c s tau/(1 + s tau) G u, tau = 1/(2 pi corner)",
            stage: Stage::Chain,
            parameters: &[
                // A small capacitor has its corner far above the band, so the share may be large.
                EffectParameter::number("share", -100.0, 100.0),
                EffectParameter::frequency("corner", 0.01, 300.0),
            ],
            starts: &[&[0.01, 0.3], &[0.01, 1.0], &[0.01, 4.0], &[0.1, 40.0]],
            build: |p| {
                let (share, corner) = (p[0], TAU * p[1]);
                Action::Feedthrough(PastStand {
                    response: Box::new(move |_, omega| {
                        let s = Complex64::new(0.0, omega / corner);
                        share * s / (1.0 + s)
                    }),
                    sampled: Some(Box::new(move |between, omega, step_s| {
                        Some(share * (1.0 - sampled_low_pass(between, corner, omega, step_s)?))
                    })),
                })
            },
        },
        Form {
            name: "ac-coupled",
            law: "y = s/(s + 2 pi corner) x",
            stage: Stage::Chain,
            // Below this bound, a record of a thousand periods shows a slope instead of a corner,
            // which is a drift.
            parameters: &[EffectParameter::frequency("corner", 1e-4, 3.0).showing(History::Fades)],
            starts: &[&[0.003], &[0.05], &[0.3]],
            build: |p| {
                let corner = TAU * p[0];
                Action::Factor(Box::new(move |_, omega| {
                    let s = Complex64::new(0.0, omega / corner);
                    s / (1.0 + s)
                }))
            },
        },
    ],
};

/// Response of the samples of a first-order low-pass to samples that are held, or straight between: `y_k = a y_(k−1) + b₀
/// u_k + b₁ u_(k−1)` with `a = e^(−ω_c T)`, and `b₀ = 0`, `b₁ = 1 − a` for held ones, `b₀ = 1 − m`, `b₁ = m − a` with `m = (1
/// − a)/(ω_c T)` for straight ones (G. F. Franklin, J. D. Powell, M. Workman, *Digital Control of Dynamic Systems*, 3rd ed.,
/// 1998, 6.3).
fn sampled_low_pass(
    between: Between,
    corner_rad_s: f64,
    omega_rad_s: f64,
    step_s: f64,
) -> Option<Complex64> {
    let steps = corner_rad_s * step_s;
    let a = (-steps).exp();
    let mean = -(-steps).exp_m1() / steps;
    let [now, before] = match between {
        Between::BandLimited => return None,
        Between::Held => [0.0, 1.0 - a],
        Between::StraightLines => [1.0 - mean, mean - a],
    };
    let back = Complex64::cis(-omega_rad_s * step_s);
    Some((now + before * back) / (1.0 - a * back))
}

/// Removes the slope introduced by dividing out a link that blocks constants: what it blocked is known except for a
/// constant at either end.
pub fn level(before: &[f64], after: &mut [f64]) {
    if after.len() < 2 {
        return;
    }
    let middle = 0.5 * (after.len() - 1) as f64;
    let (mut sum, mut squares) = (0.0, 0.0);
    for (i, (a, b)) in after.iter().zip(before).enumerate() {
        sum += (i as f64 - middle) * (a - b);
        squares += (i as f64 - middle).powi(2);
    }
    let slope = sum / squares;
    for (i, a) in after.iter_mut().enumerate() {
        *a -= slope * (i as f64 - middle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A jump from 0 to 1 that is held, and a ramp of one per sample, against the closed forms `1 − e^(−ω_c t)` and `t − (1 −
    /// e^(−ω_c t))/ω_c`, by the recursion whose response this is.
    #[test]
    fn samples_of_a_low_pass_are_those_of_its_motion() {
        let (corner, step_s, count) = (0.7, 1.0, 4096);
        let run = |between, input: &dyn Fn(usize) -> f64| -> Vec<f64> {
            // The response to one sample, from the spectrum.
            let omega = |k: usize| TAU * k as f64 / count as f64;
            let lines: Vec<Complex64> = (0..count)
                .map(|k| sampled_low_pass(between, corner, omega(k), step_s).unwrap())
                .collect();
            let pulse = |n: usize| -> f64 {
                let turn = |k: usize| Complex64::cis(omega(k * n % count));
                let all = lines.iter().enumerate().map(|(k, line)| line * turn(k));
                all.sum::<Complex64>().re / count as f64
            };
            let pulse: Vec<f64> = (0..12).map(pulse).collect();
            (0..12)
                .map(|n| (0..=n).map(|k| pulse[k] * input(n - k)).sum())
                .collect()
        };
        let held = run(Between::Held, &|_| 1.0);
        let straight = run(Between::StraightLines, &|n| n as f64);
        for n in 0..12 {
            let t = n as f64;
            let risen = 1.0 - (-corner * t).exp();
            assert!((held[n] - risen).abs() < 1e-9, "{n}: {}", held[n]);
            assert!(
                (straight[n] - (t - risen / corner)).abs() < 1e-9,
                "{n}: {}",
                straight[n]
            );
        }
        assert_eq!(sampled_low_pass(Between::BandLimited, 1.0, 1.0, 1.0), None);
    }
}
