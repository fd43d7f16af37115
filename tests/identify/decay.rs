//! Decays: how exact they are, how often the intervals hold the truth, modes and laws of damping.

use nalgebra::DMatrix;
use torqcomp::identify::decay;

use super::{Coverage, Noise, TAU, of, times};
use crate::util::assert_close;

fn ring(times_s: &[f64], values: &[f64], rate_hz: f64) -> decay::Evaluated {
    let record = decay::Ringing {
        name: "simulated",
        times_s,
        rate_hz: Some(rate_hz),
        values,
    };
    decay::identify(&[record], &decay::Options::default()).unwrap()
}

/// The stand of figure 5: 1.7 ms a cycle, from 2 to 0.5 in 5.3 ms.
const OMEGA: f64 = TAU / 1.7e-3;

fn sigma() -> f64 {
    4.0_f64.ln() / 5.3e-3
}

/// A decay of that stand with an offset and noise so many decibels below its first amplitude.
pub fn figure_5(decibel: f64, noise: &mut Noise) -> (Vec<f64>, Vec<f64>, f64) {
    let rate_hz = 40_000.0;
    let t = times(1200, rate_hz);
    let size = 2.0 * 10_f64.powf(-decibel / 20.0);
    let y = t
        .iter()
        .map(|t| 2.0 * (-sigma() * t).exp() * (OMEGA * t).cos() + 0.1 + size * noise.normal())
        .collect();
    (t, y, rate_hz)
}

#[test]
fn intervals_of_decays_cover_the_truth() {
    let mut noise = Noise(11);
    let natural = OMEGA.hypot(sigma());
    let mut covered = Coverage::default();
    for k in 0..240 {
        let decibel = [60.0, 50.0, 40.0, 30.0, 20.0][k % 5];
        let (t, y, rate_hz) = figure_5(decibel, &mut noise);
        let found = ring(&t, &y, rate_hz);
        assert_eq!(found.fit.poles.len(), 1, "at {decibel} dB");
        covered.count(of(&found.outcome, "natural_frequency"), natural / TAU);
        covered.count(of(&found.outcome, "damping_ratio"), sigma() / natural);
    }
    covered.check("decays");
}

/// Least standard deviations of frequency (Hz) and decay rate (1/s) that any unbiased estimator can have
/// (Cramér and Rao), from the sensitivities of 2e^{−σt}cos(ωt + φ) + c + dt to σ, ω, amplitude, φ, c, d.
fn least_std(t: &[f64], std: f64) -> (f64, f64) {
    let rows = DMatrix::from_fn(t.len(), 6, |i, j| {
        let fall = 2.0 * (-sigma() * t[i]).exp();
        let (sin, cos) = (OMEGA * t[i]).sin_cos();
        [
            -t[i] * fall * cos,
            -t[i] * fall * sin,
            fall * cos,
            -fall * sin,
            1.0,
            t[i] * 1e3,
        ][j]
    });
    let bound = rows.tr_mul(&rows).try_inverse().expect("regular") * std * std;
    (bound[(1, 1)].sqrt() / TAU, bound[(0, 0)].sqrt())
}

#[test]
fn decays_are_as_exact_as_the_noise_allows() {
    let mut noise = Noise(12);
    let natural = OMEGA.hypot(sigma());
    let (mut squares, mut rates) = (0.0, 0.0);
    let mut least = (0.0, 0.0);
    let runs = 120;
    for _ in 0..runs {
        let (t, y, rate_hz) = figure_5(40.0, &mut noise);
        let found = ring(&t, &y, rate_hz);
        let frequency = of(&found.outcome, "damped_frequency").value;
        assert_close(
            of(&found.outcome, "natural_frequency").value,
            natural / TAU,
            1e-3,
        );
        squares += (frequency - OMEGA / TAU).powi(2);
        rates += (of(&found.outcome, "decay_rate").value - sigma()).powi(2);
        let start = found.starts_s[0];
        let used: Vec<f64> = t
            .iter()
            .filter(|t| **t >= start)
            .map(|t| t - start)
            .collect();
        // What is left of the amplitude where the fit begins scales both alike.
        let fallen = (-sigma() * start).exp();
        least = least_std(&used, 2.0 * 0.01 / fallen);
    }
    let spread = (
        (squares / f64::from(runs)).sqrt(),
        (rates / f64::from(runs)).sqrt(),
    );
    // 120 runs tell a standard deviation to 6.5 %.
    assert!(
        spread.0 < 1.3 * least.0,
        "frequency: {} against {}",
        spread.0,
        least.0
    );
    assert!(
        spread.1 < 1.3 * least.1,
        "rate: {} against {}",
        spread.1,
        least.1
    );
    // 0.02 % of the frequency, 1 % of the damping ratio.
    assert!(
        spread.0 / (OMEGA / TAU) < 2e-4 * 5.0 && spread.1 / sigma() < 1e-2,
        "{spread:?}"
    );
}

#[test]
fn several_modes_and_hits_are_found() {
    let mut noise = Noise(13);
    let rate_hz = 20_000.0;
    let t = times(12_000, rate_hz);
    let hit = |t: f64, size: f64| {
        if t < 0.0 {
            return 0.0;
        }
        let one = (-80.0 * t).exp() * (TAU * 590.0 * t).sin();
        size * (one + 0.4 * (-120.0 * t).exp() * (TAU * 1480.0 * t).sin())
    };
    let y: Vec<f64> = t
        .iter()
        .map(|t| hit(t - 0.02, 1.0) + hit(t - 0.3, 0.7) + 0.01 * t + 1e-3 * noise.normal())
        .collect();
    let found = ring(&t, &y, rate_hz);
    assert_eq!((found.fit.poles.len(), found.stretches.len()), (2, 2));
    for (name, want, within) in [
        ("mode_1_damped_frequency", 590.0, 2e-4),
        ("mode_1_decay_rate", 80.0, 1e-2),
        ("mode_2_damped_frequency", 1480.0, 2e-4),
        ("mode_2_decay_rate", 120.0, 2e-2),
    ] {
        assert_close(of(&found.outcome, name).value, want, within);
    }
}

#[test]
fn the_law_of_damping_is_told() {
    let mut noise = Noise(14);
    let rate_hz = 10_000.0;
    let t = times(4000, rate_hz);
    let mut law = |envelope: &dyn Fn(f64) -> f64| {
        let y: Vec<f64> = t
            .iter()
            .map(|t| envelope(*t) * (TAU * 120.0 * t).cos() + 2e-3 * noise.normal())
            .collect();
        ring(&t, &y, rate_hz)
    };
    let dry = law(&|t| (1.0 - 3.0 * t).max(0.0));
    assert_eq!(dry.laws[0].law, decay::Law::Dry);
    assert!(dry.outcome.warnings.iter().any(|w| w.code == "not-viscous"));
    let drag = law(&|t| 1.0 / (1.0 + 20.0 * t));
    assert_eq!(drag.laws[0].law, decay::Law::Quadratic);
    let viscous = law(&|t| (-12.0 * t).exp());
    assert!(
        !viscous
            .outcome
            .warnings
            .iter()
            .any(|w| w.code == "not-viscous")
    );
    let both = law(&|t| ((1.0 + 0.1) * (-6.0 * t).exp() - 0.1).max(0.0));
    assert!(
        both.outcome
            .warnings
            .iter()
            .any(|w| w.code == "amplitude-dependent" || w.code == "not-viscous")
    );
}

