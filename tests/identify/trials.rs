//! Trials of the stated uncertainties with coloured noise, a noisy input, differing mountings, zero drift or hysteresis
//! of the stand. Short by default; `TORQCOMP_TRIALS=400` sets the number of records per case.

use torqcomp::identify::static_load::{LoadUnits, Point, series_of};
use torqcomp::identify::{decay, response, static_load};

use super::response::{driven, driven_by};
use super::{Coverage, Noise, TAU, of, times};
use crate::util::{assert_close, trials};

/// Between 92 and 97 % of the intervals cover the true value, within three standard deviations of that fraction for the
/// number of records.
fn check(covered: &Coverage, what: &str) {
    let all = covered.all as f64;
    let share = covered.inside as f64 / all;
    println!(
        "{what}: {} of {} ({:.1} %)",
        covered.inside,
        covered.all,
        100.0 * share
    );
    let chance = 3.0 * (0.05 * 0.95 / all).sqrt();
    assert!(
        (0.92 - chance..=0.97 + chance).contains(&share),
        "{what}: {} of {}",
        covered.inside,
        covered.all
    );
}

/// Noise colours.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Colour {
    White,
    /// First order: x_i = a x_(i−1) + e_i.
    FirstOrder(f64),
    /// Two real poles, as of a low-pass.
    LowPassed(f64),
    /// Eight first-order noises of equal power, time constants of 2 to 2⁸ samples.
    Pink,
    /// A pole pair: frequency in cycles per sample, damping per sample.
    Resonant(f64, f64),
    /// The pole pair of the stand, as from another torque on it.
    OfStand,
}

impl Colour {
    /// `count` samples with a standard deviation of about 1, on a stand with that pole pair.
    fn samples(self, count: usize, of_stand: (f64, f64), noise: &mut Noise) -> Vec<f64> {
        let settle = 4000;
        let mut first_order = |a: f64| -> Vec<f64> {
            let mut x = 0.0;
            let step = (1.0 - a * a).sqrt();
            let mut next = || {
                x = a * x + step * noise.normal();
                x
            };
            (0..count + settle).map(|_| next()).skip(settle).collect()
        };
        let mut samples = match self {
            Self::White => first_order(0.0),
            Self::FirstOrder(a) => first_order(a),
            Self::LowPassed(a) => {
                let mut y = 0.0;
                let once = first_order(a);
                let twice = once.iter().map(|x| {
                    y = a * y + x;
                    y
                });
                twice.collect()
            }
            Self::Pink => (1..=8).fold(vec![0.0; count], |sum, k| {
                let part = first_order(1.0 - 0.5_f64.powi(k));
                sum.iter().zip(part).map(|(s, x)| s + x).collect()
            }),
            Self::Resonant(..) | Self::OfStand => {
                let (frequency, damping) = match self {
                    Self::Resonant(frequency, damping) => (frequency, damping),
                    _ => of_stand,
                };
                let (a, b) = (
                    2.0 * (-damping).exp() * (TAU * frequency).cos(),
                    (-2.0 * damping).exp(),
                );
                let (mut x, mut before) = (0.0, 0.0);
                let mut next = || {
                    (x, before) = (a * x - b * before + noise.normal(), x);
                    x
                };
                (0..count + settle).map(|_| next()).skip(settle).collect()
            }
        };
        let power = samples.iter().map(|v| v * v).sum::<f64>() / count as f64;
        samples.iter_mut().for_each(|v| *v /= power.sqrt());
        samples
    }
}

/// Decays of the stand of figure 5 (590 Hz) and of a lightly damped one in coloured noise, 20 to 50 dB below the
/// initial amplitude.
fn decays(colour: Colour, count: usize) -> ([Coverage; 2], usize) {
    let mut noise = Noise(41);
    let mut covered = [Coverage::default(), Coverage::default()];
    let mut spurious = 0;
    for k in 0..count {
        let (sigma, omega, rate_hz, length) = match k % 2 {
            0 => (4.0_f64.ln() / 5.3e-3, TAU / 1.7e-3, 40_000.0, 1200),
            _ => (20.0, TAU * 180.0, 5000.0, 1500),
        };
        let size = 2.0 * 10_f64.powf(-[20.0, 30.0, 40.0, 50.0][(k / 2) % 4] / 20.0);
        let t = times(length, rate_hz);
        let free = |t: &f64| 2.0 * (-sigma * t).exp() * (omega * t).cos() + 0.1;
        let of_stand = (omega / TAU / rate_hz, sigma / rate_hz);
        let drawn = colour.samples(length, of_stand, &mut noise);
        let values: Vec<f64> = t
            .iter()
            .zip(drawn)
            .map(|(t, e)| free(t) + size * e)
            .collect();
        let record = decay::Ringing {
            name: "simulated",
            times_s: &t,
            rate_hz: Some(rate_hz),
            values: &values,
        };
        let (found, _) = decay::identify(&[record], &decay::DecayOptions::default()).unwrap();
        spurious += found.modes.len() - 1;
        let natural = omega.hypot(sigma);
        let name = |what: &str| match found.modes.len() {
            1 => what.to_owned(),
            _ => format!("mode_1_{what}"),
        };
        let z = |e: &torqcomp::identify::NamedEstimate, t: f64| (e.value() - t) / e.std().unwrap();
        eprintln!(
            "Z {} {} {}",
            k % 2,
            z(of(&found, &name("natural_frequency")), natural / TAU),
            z(of(&found, &name("damping_ratio")), sigma / natural)
        );
        covered[0].count(of(&found, &name("natural_frequency")), natural / TAU);
        covered[1].count(of(&found, &name("damping_ratio")), sigma / natural);
    }
    (covered, spurious)
}

#[test]
fn intervals_of_decays_cover_the_truth_in_coloured_noise() {
    let number = trials(24);
    let (mut found, mut all) = (0, 0);
    for colour in [
        Colour::OfStand,
        Colour::White,
        Colour::FirstOrder(0.9),
        Colour::FirstOrder(0.99),
        Colour::LowPassed(0.8),
        Colour::Pink,
        Colour::Resonant(0.1, 0.05),
        Colour::OfStand,
    ] {
        let (covered, spurious) = decays(colour, number);
        println!("{colour:?}: {spurious} modes that are not there in {number} records");
        (found, all) = (found + spurious, all + number);
        for (covered, what) in covered.iter().zip(["frequency", "damping"]) {
            check(covered, &format!("decay, {what}, {colour:?}"));
        }
    }
    assert!(
        50 * found <= all,
        "{found} modes that are not there in {all} records"
    );
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Origin of the noise of a response.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Disturbance {
    /// White, in the measured signal.
    Output,
    /// Another torque on the stand, so that the noise has the shape of the resonance; and a little white noise.
    Torque,
    /// White, in the recorded input.
    Input,
}

/// Responses to noise: natural frequency, damping ratio, stiffness.
fn responses(disturbance: Disturbance, count: usize) -> [Coverage; 3] {
    let mut noise = Noise(43);
    let mut covered = [0; 3].map(|_| Coverage::default());
    let (natural, stiffness) = (TAU * 60.0, 2800.0);
    for k in 0..count {
        let ratio = [0.03, 0.01][k % 2];
        let size = [0.1, 0.03, 0.01][(k / 2) % 3];
        let samples = 12_000;
        let (mut applied, mut shown) = driven(samples, (200.0, ratio), &mut noise);
        let add = |to: &mut [f64], other: &[f64], factor: f64| {
            let factor = factor * rms(to) / rms(other);
            to.iter_mut().zip(other).for_each(|(v, e)| *v += factor * e);
        };
        let white: Vec<f64> = (0..samples).map(|_| noise.normal()).collect();
        match disturbance {
            Disturbance::Output => add(&mut shown, &white, size),
            Disturbance::Torque => {
                let (_, other) = driven(samples, (200.0, ratio), &mut noise);
                add(&mut shown, &other, size);
                add(&mut shown, &white, 1e-3);
            }
            Disturbance::Input => {
                add(&mut applied, &white, size);
                let more: Vec<f64> = (0..samples).map(|_| noise.normal()).collect();
                add(&mut shown, &more, 1e-3);
            }
        }
        shown.iter_mut().for_each(|v| *v /= stiffness);
        let record = response::Driven {
            name: "simulated",
            rate_hz: 1000.0,
            applied: &applied,
            measured: &shown,
        };
        let options = response::ResponseOptions {
            excitation: Some(response::Excitation::Random),
            band_hz: Some((20.0, 150.0)),
            modes: Some(1),
            ..Default::default()
        };
        let found = response::identify(&[record], &options).unwrap();
        covered[0].count(of(&found, "natural_frequency"), natural / TAU);
        covered[1].count(of(&found, "damping_ratio"), ratio);
        let constants = found.modes[0].stand_constants().expect("constants");
        let found = constants.list.iter().find(|c| c.name == "stiffness");
        covered[2].count(found.expect("a stiffness"), stiffness);
    }
    covered
}

#[test]
fn intervals_of_responses_cover_the_truth_whatever_the_noise() {
    let number = trials(60);
    for disturbance in [Disturbance::Output, Disturbance::Torque, Disturbance::Input] {
        let covered = responses(disturbance, number);
        for (covered, what) in covered.iter().zip(["frequency", "damping", "stiffness"]) {
            check(
                covered,
                &format!("response, {what}, noise of {disturbance:?}"),
            );
        }
    }
}

#[test]
fn transients_are_taken_as_they_are() {
    let smooth = |t: f64| 0.5 * (1.0 + (t / 0.002).tanh());
    let bell = |t: f64| (-0.5 * (t / 0.003).powi(2)).exp();
    let step = |t: f64| 5.0 * smooth(t - 0.2);
    let drop = |t: f64| bell(t - 0.2) + 0.6 * bell(t - 0.23) + 0.4 * bell(t - 0.27);
    let trapezoid = |t: f64| smooth(t - 0.2) - smooth(t - 0.212);
    type Force<'a> = (
        &'a str,
        &'a dyn Fn(f64) -> f64,
        Option<response::Excitation>,
    );
    let forces: [Force; 3] = [
        ("step", &step, None),
        ("drop", &drop, None),
        (
            "trapezoid",
            &trapezoid,
            Some(response::Excitation::Transient),
        ),
    ];
    let mut noise = Noise(53);
    for (name, force, excitation) in forces {
        let (applied, shown) = driven_by(force, 2000);
        let size = 1e-3 * shown.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let measured: Vec<Vec<f64>> = (0..4)
            .map(|_| shown.iter().map(|v| v + size * noise.normal()).collect())
            .collect();
        let driven = |measured| response::Driven {
            name,
            rate_hz: 1000.0,
            applied: &applied,
            measured,
        };
        let all: Vec<_> = measured.iter().map(|m| driven(m)).collect();
        let options = response::ResponseOptions {
            excitation,
            band_hz: Some((10.0, 120.0)),
            ..Default::default()
        };
        let found = response::identify(&all, &options).unwrap();
        assert_eq!(found.modes.len(), 1, "{name}");
        assert_close(of(&found, "natural_frequency").value(), 60.0, 1e-3);
        assert_close(of(&found, "damping_ratio").value(), 0.03, 2e-2);
    }
}

/// A band with too many lines is rejected with a suggestion that works.
#[test]
fn a_band_with_few_enough_lines_is_suggested() {
    let bell = |t: f64| (-0.5 * ((t - 0.2) / 0.0005).powi(2)).exp();
    let (applied, shown) = driven_by(bell, 40_000);
    let record = response::Driven {
        name: "long",
        rate_hz: 1000.0,
        applied: &applied,
        measured: &shown,
    };
    let options = |band_hz| response::ResponseOptions {
        band_hz,
        modes: Some(1),
        ..Default::default()
    };
    let refused = response::identify(&[record], &options(Some((1.0, 400.0)))).unwrap_err();
    let message = refused.to_string();
    let (_, band) = message.rsplit_once("--band ").expect("a band");
    let (from, to) = band.split_once("..").expect("two numbers");
    let band = (
        from.parse().expect("a number"),
        to.parse().expect("a number"),
    );
    assert!(band.0 < 55.0 && band.1 > 65.0, "{message}");
    let found = response::identify(&[record], &options(Some(band))).unwrap();
    assert_close(of(&found, "natural_frequency").value(), 60.0, 1e-3);
}

/// Disturbances of a calibration besides white noise of the readings.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Calibration {
    Plain,
    /// Each mounting has its own sensitivity and zero; number of mountings.
    Mountings(usize),
    /// Declared mountings without differences.
    SameMountings,
    /// The zero follows a random walk.
    Walk,
    /// The zero drifts linearly.
    EvenDrift,
    /// Half an ellipse of hysteresis, closed at both ends.
    Hysteresis,
    /// A constant hysteresis.
    Friction,
    /// Loading only, with a random walk of the zero.
    WalkUp,
}

fn calibrations(case: Calibration, count: usize) -> Coverage {
    let mut noise = Noise(47);
    let mut covered = Coverage::default();
    let units = LoadUnits {
        load: "N m".to_owned(),
        reading: "V".to_owned(),
    };
    for k in 0..count {
        let size = [0.01, 0.003, 0.001][k % 3];
        let mountings = match case {
            Calibration::Mountings(count) => count,
            _ => 3,
        };
        let up: Vec<f64> = (0..=10).map(f64::from).collect();
        let down: Vec<f64> = up.iter().rev().skip(1).copied().collect();
        let one = match case {
            Calibration::WalkUp => [&up[..], &[0.0]].concat(),
            _ => [&up[..], &down[..]].concat(),
        };
        let loads: Vec<f64> = one
            .iter()
            .copied()
            .cycle()
            .take(one.len() * mountings)
            .collect();
        let series = series_of(&loads);
        let own: Vec<(f64, f64)> = (0..mountings)
            .map(|_| (5.0 * size * noise.normal(), 0.3 * size * noise.normal()))
            .collect();
        let mut drift = 0.0;
        let is_declared = matches!(case, Calibration::Mountings(_) | Calibration::SameMountings);
        let point = |(i, load): (usize, &f64)| {
            let s = series[i];
            let side = if i % one.len() <= 10 { 1.0 } else { -1.0 };
            let other = match case {
                Calibration::Mountings(_) => own[s].0 + own[s].1 * load,
                Calibration::Walk | Calibration::WalkUp => {
                    drift += 0.5 * size * noise.normal();
                    drift
                }
                Calibration::EvenDrift => 0.3 * size * i as f64,
                Calibration::Hysteresis => 0.4 * size * side * load * (10.0 - load) / 2.5,
                Calibration::Friction if *load > 0.0 && *load < 10.0 => 3.0 * size * side,
                _ => 0.0,
            };
            Point {
                load: *load,
                reading: 0.02 + 0.1 * load + other + size * noise.normal(),
                std: None,
                series: s,
                position: if is_declared { s } else { 0 },
            }
        };
        let points: Vec<Point> = loads.iter().enumerate().map(point).collect();
        let found = static_load::identify(&points, 1, &units).unwrap();
        covered.count(of(&found, "sensitivity"), 0.1);
    }
    covered
}

#[test]
fn intervals_of_calibrations_cover_the_truth_whatever_disturbs_them() {
    use Calibration::{
        EvenDrift, Friction, Hysteresis, Mountings, Plain, SameMountings, Walk, WalkUp,
    };
    let number = trials(100);
    for case in [
        Plain,
        Mountings(3),
        Mountings(4),
        Mountings(8),
        SameMountings,
        Walk,
        WalkUp,
        EvenDrift,
        Hysteresis,
        Friction,
    ] {
        check(&calibrations(case, number), &format!("static, {case:?}"));
    }
}
