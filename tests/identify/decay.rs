//! Decays: accuracy, coverage of the intervals, modes and damping laws.

use nalgebra::DMatrix;
use torqcomp::identify::{Identification, decay};

use super::{Coverage, Noise, TAU, of, of_decay, times};
use crate::util::assert_close;

fn ring(times_s: &[f64], values: &[f64], rate_hz: f64) -> (Identification, Vec<decay::Stretch>) {
    let record = decay::Ringing {
        name: "simulated",
        times_s,
        rate_hz: Some(rate_hz),
        values,
    };
    decay::identify(&[record], &decay::DecayOptions::default()).unwrap()
}

/// The stand of figure 5: 1.7 ms per cycle, from 2 to 0.5 in 5.3 ms.
const OMEGA: f64 = TAU / 1.7e-3;

fn sigma() -> f64 {
    4.0_f64.ln() / 5.3e-3
}

/// A decay of that stand with an offset and noise `decibel` below its initial amplitude.
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
    let natural = OMEGA.hypot(sigma());
    // As recorded, and at a lower rate.
    for (band_hz, seed) in [(None, 11), (Some((100.0, 2000.0)), 19)] {
        let mut noise = Noise(seed);
        let mut covered = [Coverage::default(), Coverage::default()];
        for k in 0..240 {
            let decibel = [60.0, 50.0, 40.0, 30.0, 20.0][k % 5];
            let (t, y, rate_hz) = figure_5(decibel, &mut noise);
            let record = decay::Ringing {
                name: "simulated",
                times_s: &t,
                rate_hz: Some(rate_hz),
                values: &y,
            };
            let options = decay::DecayOptions {
                band_hz,
                modes: band_hz.map(|_| 1),
            };
            let (found, _) = decay::identify(&[record], &options).unwrap();
            assert_eq!(found.modes.len(), 1, "at {decibel} dB");
            covered[0].count(of(&found, "natural_frequency"), natural / TAU);
            covered[1].count(of(&found, "damping_ratio"), sigma() / natural);
        }
        covered[0].check(&format!("decays, frequency, band {band_hz:?}"));
        covered[1].check(&format!("decays, damping, band {band_hz:?}"));
    }
}

/// Minimum standard deviations of frequency (Hz) and decay rate (1/s) for any unbiased estimator
/// (Cramér–Rao bound), from the sensitivities of Ae^{−σt}cos(ωt + φ) + c + dt to σ, ω, A, φ, c, d.
fn least_std(t: &[f64], (amplitude, sigma, omega): (f64, f64, f64), std: f64) -> (f64, f64) {
    let length = t[t.len() - 1];
    let rows = DMatrix::from_fn(t.len(), 6, |i, j| {
        let fall = amplitude * (-sigma * t[i]).exp();
        let (sin, cos) = (omega * t[i]).sin_cos();
        [
            -t[i] * fall * cos,
            -t[i] * fall * sin,
            fall * cos,
            -fall * sin,
            1.0,
            t[i] / length,
        ][j]
    });
    let bound = rows.tr_mul(&rows).try_inverse().expect("regular") * std * std;
    (bound[(1, 1)].sqrt() / TAU, bound[(0, 0)].sqrt())
}

/// A stand: σ in 1/s, ω in rad/s, sampling rate, duration in s, number of successive decays.
struct Stand {
    sigma: f64,
    omega: f64,
    rate_hz: f64,
    length_s: f64,
    decays: u32,
}

impl Stand {
    /// Decays of amplitude 2 with noise 40 dB below it.
    fn record(&self, noise: &mut Noise) -> (Vec<f64>, Vec<f64>) {
        let each = (self.length_s * self.rate_hz) as usize;
        let t = times(each * self.decays as usize, self.rate_hz);
        let one = |(i, _): (usize, &f64)| {
            let t = (i % each) as f64 / self.rate_hz;
            2.0 * (-self.sigma * t).exp() * (self.omega * t).cos() + 0.1 + 0.02 * noise.normal()
        };
        let y = t.iter().enumerate().map(one).collect();
        (t, y)
    }

    /// Relative errors of frequency and damping ratio, and the bounds of both.
    fn errors(&self, noise: &mut Noise) -> ([f64; 2], [f64; 2]) {
        let (t, y) = self.record(noise);
        let (found, stretches) = ring(&t, &y, self.rate_hz);
        assert_eq!(stretches.len(), self.decays as usize);
        let natural = self.omega.hypot(self.sigma);
        let frequency = of(&found, "damped_frequency").value() * TAU / self.omega - 1.0;
        let ratio = of(&found, "damping_ratio").value() * natural / self.sigma - 1.0;
        // Each segment begins where the fit starts; decays add their information.
        let (mut of_frequency, mut of_rate) = (0.0, 0.0);
        for stretch in &stretches {
            let late = stretch.start_s % self.length_s;
            let amplitude = 2.0 * (-self.sigma * late).exp();
            let truth = (amplitude, self.sigma, self.omega);
            let (frequency, rate) = least_std(&stretch.times_s, truth, 0.02);
            of_frequency += frequency.powi(-2);
            of_rate += rate.powi(-2);
        }
        let bounds = [
            of_frequency.powf(-0.5) * TAU / self.omega,
            of_rate.powf(-0.5) / self.sigma,
        ];
        ([frequency, ratio], bounds)
    }
}

/// Nineteen records in twenty within 0.02 % of the frequency and 1 % of the damping ratio, and the spread no more
/// than 1.3 times the bound. One decay of the stand of figure 5 at 40 kHz cannot reach 0.02 %: its bound is 0.016
/// %, so that one record in five would miss it whatever the method; six hits at 50 kHz can.
#[test]
fn decays_are_as_exact_as_the_noise_allows() {
    let of_thesis = Stand {
        sigma: sigma(),
        omega: OMEGA,
        rate_hz: 50_000.0,
        length_s: 0.016,
        decays: 6,
    };
    let light = Stand {
        sigma: 20.0,
        omega: TAU * 590.0,
        rate_hz: 20_000.0,
        length_s: 0.12,
        decays: 1,
    };
    for (stand, seed) in [(of_thesis, 12), (light, 18)] {
        let mut noise = Noise(seed);
        let mut squares = [0.0; 2];
        let mut bounds = [0.0; 2];
        let runs = 40;
        let mut within = 0;
        for _ in 0..runs {
            let (errors, least) = stand.errors(&mut noise);
            within += u32::from(errors[0].abs() < 2e-4 && errors[1].abs() < 1e-2);
            for i in 0..2 {
                squares[i] += errors[i].powi(2) / f64::from(runs);
                bounds[i] += least[i] / f64::from(runs);
            }
        }
        println!("{within} of {runs} within 0.02 % and 1 %");
        assert!(within >= runs - runs / 20, "{within} of {runs}");
        for i in 0..2 {
            let ratio = squares[i].sqrt() / bounds[i];
            println!("std {:.2e}, over the bound {ratio:.3}", squares[i].sqrt());
            // 40 runs determine a standard deviation to 11 %.
            assert!(ratio < 1.3, "{i}: {ratio} times the bound");
        }
    }
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
    let (found, stretches) = ring(&t, &y, rate_hz);
    assert_eq!((found.modes.len(), stretches.len()), (2, 2));
    for (name, want, within) in [
        ("mode_1_damped_frequency", 590.0, 2e-4),
        ("mode_1_decay_rate", 80.0, 1e-2),
        ("mode_2_damped_frequency", 1480.0, 2e-4),
        ("mode_2_decay_rate", 120.0, 2e-2),
    ] {
        assert_close(of(&found, name).value(), want, within);
    }
}

/// A decay of so many periods that it is filtered to bands around its lines and undersampled: as accurate as all
/// samples allow, var σ = var ω = 16 σ³ s² Δt/A² (Cramér–Rao, for a decay recorded to its end), for the mode that rings
/// for long and for the one that has decayed after a thirtieth of the record.
#[test]
fn a_decay_of_very_many_periods_is_as_exact_with_fewer_samples() {
    let mut noise = Noise(31);
    let (rate_hz, size) = (20_000.0, 0.02);
    let t = times(1_000_000, rate_hz);
    let modes = [(1.0, 0.15, 3100.0), (0.3, 3.0, 3300.0)];
    let one =
        |t: f64, (a, sigma, hz): (f64, f64, f64)| a * (-sigma * t).exp() * (TAU * hz * t).cos();
    let y: Vec<f64> = t
        .iter()
        .map(|t| modes.iter().map(|mode| one(*t, *mode)).sum::<f64>() + 0.1 + size * noise.normal())
        .collect();
    let (found, stretches) = ring(&t, &y, rate_hz);
    assert!(
        found.method.iter().any(|m| m.starts_with("filtered to ")),
        "{:?}",
        found.method
    );
    assert!(
        stretches[0].values.len() < 70_000,
        "{}",
        stretches[0].values.len()
    );
    assert_eq!(found.modes.len(), 2);
    for (k, (a, sigma, hz)) in modes.into_iter().enumerate() {
        let least = (16.0 * sigma * sigma * sigma * size * size / rate_hz).sqrt() / a;
        for (name, want, least) in [
            ("decay_rate", sigma, least),
            ("damped_frequency", hz, least / TAU),
        ] {
            let got = of(&found, &format!("mode_{}_{name}", k + 1));
            let std = got.std().unwrap();
            let off = (got.value() - want).abs();
            assert!(
                off < 4.0 * std && (0.8..1.6).contains(&(std / least)),
                "{name} {k}: {off}, {std}, {least}"
            );
        }
    }
}

#[test]
fn the_law_of_damping_is_told() {
    let mut noise = Noise(14);
    let rate_hz = 10_000.0;
    let t = times(4000, rate_hz);
    let mut of_motion = |motion: &dyn Fn(f64) -> f64| {
        let y = t.iter().map(|t| motion(*t) + 2e-3 * noise.normal());
        ring(&t, &y.collect::<Vec<_>>(), rate_hz).0
    };
    // Half cycles about ±F, each 2F smaller than the one before, until the stand sticks: a fall of 3/s.
    let friction: f64 = 3.0 / (4.0 * 130.0);
    let stop = ((1.0 - friction) / (2.0 * friction)).ceil();
    let dry = of_motion(&|t| {
        let half = (2.0 * 130.0 * t).floor().min(stop);
        let side = if half % 2.0 == 0.0 { 1.0 } else { -1.0 };
        match half < stop {
            true => {
                (1.0 - (2.0 * half + 1.0) * friction) * (TAU * 130.0 * t).cos() + side * friction
            }
            false => side * (1.0 - 2.0 * stop * friction),
        }
    });
    let mut law =
        |envelope: &dyn Fn(f64) -> f64| of_motion(&|t| envelope(t) * (TAU * 130.0 * t).cos());
    assert_eq!(dry.laws[0].law, decay::Law::Dry);
    assert!(dry.warnings.iter().any(|w| w.code == "not-viscous"));
    let drag = law(&|t| 1.0 / (1.0 + 20.0 * t));
    assert_eq!(drag.laws[0].law, decay::Law::Quadratic);
    let viscous = law(&|t| (-12.0 * t).exp());
    assert!(!viscous.warnings.iter().any(|w| w.code == "not-viscous"));
    let both = law(&|t| ((1.0 + 0.1) * (-6.0 * t).exp() - 0.1).max(0.0));
    assert!(
        both.warnings
            .iter()
            .any(|w| w.code == "amplitude-dependent" || w.code == "not-viscous"),
        "{both:?}"
    );
}

/// Two modes 2 to 3 % apart beat. They had been one mode, with two and a half times the damping.
#[test]
fn two_modes_that_beat_are_two() {
    let mut coverage = Coverage::default();
    for seed in 0..20 {
        let mut noise = Noise(70 + seed);
        let [phase, other] = [0; 2].map(|_| TAU * noise.uniform());
        let (ratio, apart) = [(0.01, 1.03), (0.004, 1.02)][seed as usize % 2];
        let sine = |t: f64, hz: f64, phase: f64| {
            let omega = TAU * hz;
            (-ratio * omega * t).exp() * (omega * f64::sqrt(1.0 - ratio * ratio) * t + phase).cos()
        };
        let record: Vec<f64> = times(4000, 2000.0)
            .iter()
            .map(|t| {
                sine(*t, 100.0, phase)
                    + 0.8 * sine(*t, 100.0 * apart, other)
                    + 1e-3 * noise.normal()
            })
            .collect();
        let found = of_decay(&record, 2000.0);
        assert_eq!(found.modes.len(), 2, "{seed}: {:?}", found.parameters);
        assert!(
            found.warnings.iter().all(|w| w.code == "not-anchored"),
            "{:?}",
            found.warnings
        );
        for k in ["mode_1", "mode_2"] {
            coverage.count(of(&found, &format!("{k}_damping_ratio")), ratio);
        }
    }
    coverage.at_least(36, "damping ratios");
}

/// A spring that stiffens is no pair of modes: its frequency changes with the amplitude.
#[test]
fn a_frequency_that_changes_is_no_second_mode() {
    for (seed, cube) in (0..).zip([0.01, 0.03, 0.1, 0.3, 1.0]) {
        let mut noise = Noise(90 + seed);
        let omega = TAU * 100.0;
        let slope = |x: f64, v: f64| -omega * omega * (x + cube * x.powi(3)) - 0.02 * omega * v;
        let (mut x, mut v, h) = (1.0, 0.0, 1.0 / 2000.0 / 40.0);
        let mut record = Vec::new();
        for i in 0..4000 * 40 {
            if i % 40 == 0 {
                record.push(x + 1e-3 * noise.normal());
            }
            let middle = (x + 0.5 * h * v, v + 0.5 * h * slope(x, v));
            (x, v) = (x + h * middle.1, v + h * slope(middle.0, middle.1));
        }
        let found = of_decay(&record, 2000.0);
        let hz = found
            .parameters
            .iter()
            .filter(|p| p.name.ends_with("damped_frequency"));
        let hz: Vec<f64> = hz.map(|p| p.value()).collect();
        let near = hz
            .iter()
            .filter(|hz| (**hz / 100.0 - 1.0).abs() < 0.5)
            .count();
        let is_said = found.warnings.iter().any(|w| w.code == "close-lines");
        assert!(near == 1 || is_said, "{cube}: {hz:?}");
    }
}

/// Five taps whose frequency and damping scatter by many times what noise explains.
#[test]
fn decays_that_differ_widen_the_uncertainty() {
    let mut noise = Noise(43);
    let t = times(500, 1000.0);
    let mut covered = [0; 2].map(|_| Coverage::default());
    for _ in 0..6 {
        let taps: Vec<Vec<f64>> = (0..5)
            .map(|_| {
                let omega = TAU * 81.4 * (1.0 + 2e-4 * noise.normal());
                let rate = 0.0135 * (1.0 + 0.05 * noise.normal()) * omega;
                let swing = |t: &f64| (-rate * t).exp() * (omega * t).sin() + 2e-3 * noise.normal();
                t.iter().map(swing).collect()
            })
            .collect();
        let record = |values| decay::Ringing {
            name: "tap",
            times_s: &t,
            rate_hz: Some(1000.0),
            values,
        };
        let records: Vec<_> = taps.iter().map(|values| record(values)).collect();
        let (found, _) = decay::identify(&records, &decay::DecayOptions::default()).unwrap();
        covered[0].count(of(&found, "damped_frequency"), 81.4);
        covered[1].count(of(&found, "damping_ratio"), 0.0135);
    }
    covered[0].at_least(5, "frequency between taps");
    covered[1].at_least(5, "damping between taps");
}
