//! Blind records of stands far from the thesis': their inputs, filter and noise against closed-form
//! solutions.

use std::f64::consts::{PI, SQRT_2, TAU};

use num_complex::Complex64;

use crate::blind::anti_alias::AntiAlias;
use crate::blind::draw::Draw;
use crate::blind::excitation::{Excitation, FINER, Input, Line, RATE_HZ};
use crate::blind::integrate::run;
use crate::blind::kinds::{Hits, Pulse, Random, Steps};
use crate::blind::plain_fit::{PlainConstants, answer, rms};
use crate::blind::plant::{Constants, Plain};
use crate::blind::record;
use crate::blind::setting::Asked;
use crate::blind::span::Span;
use crate::blind::wide::{NATURAL_HZ, answered};

const WIDE: Asked = Asked {
    wide: true,
    strength: None,
};

/// A lightly damped stand of 500 Hz.
fn stand() -> Constants {
    let (omega, ratio, stiffness_n_m) = (TAU * 500.0, 0.01, 1e5);
    Constants {
        inertia_kg_m2: stiffness_n_m / (omega * omega),
        damping_n_m_s: 2.0 * ratio * stiffness_n_m / omega,
        stiffness_n_m,
    }
}

fn span(samples: usize) -> Span {
    Span {
        samples,
        ..Span::THESIS
    }
}

/// Responses of the integrator and of the plain fit's model to an input.
fn answers(input: &Input) -> [Vec<f64>; 2] {
    let plain = PlainConstants {
        omega: stand().omega(),
        damping_ratio: stand().damping_ratio(),
    };
    let dense = run(&Plain(stand()), input);
    [dense.samples(), answer(plain, input)]
}

fn largest_difference(signal: &[f64], closed_form: impl Fn(f64) -> f64) -> f64 {
    let at = |(index, value): (usize, &f64)| (value - closed_form(index as f64 / RATE_HZ)).abs();
    signal.iter().enumerate().map(at).fold(0.0, f64::max)
}

/// Response to a unit ramp of torque, after a time.
fn impulse(time_s: f64) -> f64 {
    let (omega, ratio) = (stand().omega(), stand().damping_ratio());
    let swing = omega * (1.0 - ratio * ratio).sqrt();
    omega * omega / swing * (-ratio * omega * time_s).exp() * (swing * time_s).sin()
}

/// Response to a unit step, after a time.
fn step(time_s: f64) -> f64 {
    if time_s <= 0.0 {
        return 0.0;
    }
    let (omega, ratio) = (stand().omega(), stand().damping_ratio());
    let root = (1.0 - ratio * ratio).sqrt();
    let (sin, cos) = (omega * root * time_s).sin_cos();
    1.0 - (-ratio * omega * time_s).exp() * (cos + ratio / root * sin)
}

#[test]
fn a_hit_leaves_the_free_decay_of_its_impulses() {
    for smooth in [true, false] {
        let (node, nodes) = (803, 273);
        let pulses = vec![Pulse {
            node,
            nodes,
            height: 2.0,
            smooth,
        }];
        let top_hz = 1500.0;
        let input = Excitation::Hits(Hits { pulses, top_hz }).input_over(&span(2000));
        // Simpson's rule over the pulse.
        let (from_s, step_s, parts) = (node as f64 * input.step_s, input.step_s, 4000);
        let length_s = nodes as f64 * step_s;
        let decay = |time_s: f64| {
            if time_s < from_s + length_s {
                return f64::NAN;
            }
            let pulse = |part: f64| match smooth {
                true => 2.0 * (PI * part).sin().powi(4),
                false => 2.0 * (PI * part).sin(),
            };
            let at = |k: usize| {
                let part = k as f64 / parts as f64;
                pulse(part) * impulse(time_s - from_s - part * length_s)
            };
            let weight = |k: usize| [2.0, 4.0][k % 2];
            let inner: f64 = (1..parts).map(|k| weight(k) * at(k)).sum();
            (at(0) + inner + at(parts)) * length_s / parts as f64 / 3.0
        };
        for (signal, bound) in answers(&input).iter().zip([1e-7, 2e-4]) {
            let peak = signal.iter().copied().fold(0.0, f64::max);
            let off = largest_difference(signal, |t| match decay(t).is_nan() {
                true => signal[(t * RATE_HZ).round() as usize],
                false => decay(t),
            });
            assert!(peak > 1.0 && off < bound, "smooth {smooth}: {off:e}");
            // The record itself is still zero before the hit.
            assert!(signal[..node / FINER].iter().all(|shown| *shown == 0.0));
        }
    }
}

#[test]
fn plateaus_hold_from_their_sample_on() {
    let plateaus = vec![(100, 0.0), (37, 2.0), (4, -1.0), (900, 0.5), (967, 1.5)];
    let steps = Steps {
        plateaus: plateaus.clone(),
        settled: false,
        top_hz: 1500.0,
    };
    let input = Excitation::Steps(steps).input_over(&span(2000));
    let applied = input.samples();
    assert_eq!(
        [applied[99], applied[100], applied[136], applied[137]],
        [0.0, 2.0, 2.0, -1.0]
    );
    let closed_form = |time_s: f64| {
        let (mut begins, mut before, mut sum) = (0, 0.0, 0.0);
        for (samples, torque) in &plateaus {
            sum += (torque - before) * step(time_s - begins as f64 / RATE_HZ);
            (begins, before) = (begins + samples, *torque);
        }
        sum
    };
    for (signal, bound) in answers(&input).iter().zip([1e-7, 2e-4]) {
        let off = largest_difference(signal, closed_form);
        assert!(off < bound, "{off:e}");
    }
}

/// Butterworth's low-pass, from its poles.
fn butterworth(filter: &AntiAlias, frequency_hz: f64) -> Complex64 {
    let s = Complex64::new(0.0, frequency_hz / filter.corner_hz);
    let pole = |k: usize| {
        let turns = (2 * k + 1 + filter.order) as f64 / (4 * filter.order) as f64;
        Complex64::from_polar(1.0, TAU * turns)
    };
    (0..filter.order).map(|k| (s - pole(k)).inv()).product()
}

#[test]
fn the_filter_is_on_both_channels_as_its_response_says() {
    let parts = [(1.0, 35.0, 0.3), (0.5, 500.0, -1.0), (0.8, 4000.0, 2.0)];
    let line = |(amplitude, frequency_hz, phase_rad)| Line {
        amplitude,
        frequency_hz,
        phase_rad,
    };
    let lines = Excitation::Multisine {
        lines: parts.map(line).to_vec(),
        second_half: 1.0,
        settled: true,
    };
    let settling_s = 1.0;
    let input = lines.input_over(&Span {
        settling_s,
        ..span(2000)
    });
    let dense = run(&Plain(stand()), &input);
    let plain = |frequency_hz: f64| {
        let (r, ratio) = (
            TAU * frequency_hz / stand().omega(),
            stand().damping_ratio(),
        );
        Complex64::new(1.0 - r * r, 2.0 * ratio * r).inv()
    };
    for filter in [2, 4].map(|order| AntiAlias {
        order,
        corner_hz: 5300.0,
    }) {
        let half_power = butterworth(&filter, filter.corner_hz).norm() * SQRT_2;
        assert!((half_power - 1.0).abs() < 1e-12);
        let steady = |time_s: f64, through: &dyn Fn(f64) -> Complex64| -> f64 {
            let turned = parts.iter().map(|(amplitude, frequency_hz, phase)| {
                let turn = TAU * frequency_hz * time_s + phase;
                let both = through(*frequency_hz) * butterworth(&filter, *frequency_hz);
                (Complex64::from_polar(*amplitude, turn) * both).re
            });
            turned.sum()
        };
        let recorded = input.filtered(&filter);
        let off = largest_difference(&recorded.samples(), |t| steady(t, &|_| 1.0.into()));
        assert!(off < 1e-5, "applied, order {}: {off:e}", filter.order);
        let measured = filter.signal(dense.clone()).samples();
        let off = largest_difference(&measured, |t| steady(t, &plain));
        assert!(off < 1e-5, "measured, order {}: {off:e}", filter.order);
        // The plain fit uses the recorded torque: its response is the filtered response of the stand.
        let fitted = &answers(&recorded)[1];
        let off = largest_difference(&measured, |t| fitted[(t * RATE_HZ).round() as usize]);
        assert!(off < 1e-3, "fit, order {}: {off:e}", filter.order);
    }
}

#[test]
fn what_is_behind_the_filter_jumps_no_more() {
    let plateaus = vec![(100, 0.0), (1900, 1.0)];
    let steps = Steps {
        plateaus,
        settled: false,
        top_hz: 1500.0,
    };
    let input = Excitation::Steps(steps).input_over(&span(2000));
    let corner_hz = 6000.0;
    let filter = AntiAlias {
        order: 2,
        corner_hz,
    };
    let w = TAU * corner_hz / SQRT_2;
    let after = |time_s: f64| {
        let x = w * (time_s - 100.0 / RATE_HZ).max(0.0);
        1.0 - (-x).exp() * (x.cos() + x.sin())
    };
    let off = largest_difference(&input.filtered(&filter).samples(), after);
    assert!(off < 1e-6, "{off:e}");
}

#[test]
fn random_torque_has_its_rms_and_no_period() {
    let random = Random {
        rms: 3.0,
        top_hz: 400.0,
        settled: false,
        seed: 5,
    };
    let step_s = 1.0 / (RATE_HZ * FINER as f64);
    let points = 8 * 8000;
    let nodes = random.nodes(points, step_s);
    let values: Vec<f64> = nodes.iter().map(|node| node[0]).collect();
    assert!((rms(&values) / 3.0 - 1.0).abs() < 0.15, "{}", rms(&values));
    // Derivatives against Simpson's rule.
    for derivative in [0, 1] {
        let largest = nodes
            .iter()
            .map(|node| node[derivative + 1].abs())
            .fold(0.0, f64::max);
        let off = nodes.windows(3).map(|three| {
            let [a, b, c] = [0, 1, 2].map(|k: usize| three[k][derivative + 1]);
            let rise = three[2][derivative] - three[0][derivative];
            (rise - step_s / 3.0 * (a + 4.0 * b + c)).abs() / step_s
        });
        let off = off.fold(0.0, f64::max) / largest;
        assert!(off < 1e-6, "derivative {derivative}: {off:e}");
    }
    // Nothing wraps around into the record.
    let half = points / 2;
    for lag in (500..half).step_by(500) {
        let moved = (0..half).map(|k| values[k] * values[k + lag]).sum::<f64>() / half as f64;
        assert!(moved.abs() < 0.6 * 9.0, "lag {lag}: {moved}");
    }
}

#[test]
fn noise_on_the_applied_torque_rings_in_the_stand() {
    let mut draw = Draw::new(1, "noise");
    let noise: Vec<f64> = (0..32_000).map(|_| 0.1 * draw.normal()).collect();
    // White up to the Nyquist frequency, through a resonance of bandwidth π f/(4 ζ) at a gain of 1.
    let natural_hz = stand().omega() / TAU;
    let bandwidth_hz = PI * natural_hz / (4.0 * stand().damping_ratio());
    let expected = 0.1 * (bandwidth_hz / (RATE_HZ / 2.0)).sqrt();
    let through = rms(&answered(stand(), &noise));
    assert!(
        (through / expected - 1.0).abs() < 0.1,
        "{through} {expected}"
    );
}

#[test]
fn written_seconds_are_longer_by_one_factor() {
    let span = Span {
        slower: 10.0,
        ..span(2000)
    };
    let names = [
        ("frequency_hz", 0.1),
        ("delay_s", 10.0),
        ("seconds", 10.0),
        ("n_m_per_s", 0.1),
        ("over_speed_rad_s", 0.1),
        ("coefficient_n_m_s2", 100.0),
        ("coefficient_n_m_s3", 1000.0),
        ("limit_n_m", 1.0),
        ("beta_share", 1.0),
    ];
    for (name, factor) in names {
        let off = span.written(name, 1.0) / factor - 1.0;
        assert!(off.abs() < 1e-12, "{name}");
    }
    let written = stand().written(&span);
    assert!((written.omega() * 10.0 / stand().omega() - 1.0).abs() < 1e-12);
    assert!((written.damping_ratio() / stand().damping_ratio() - 1.0).abs() < 1e-12);
}

#[test]
fn a_wide_case_is_what_its_truth_says() {
    for number in 0..6 {
        let case = record::make_as(&WIDE, 2, "none", number).expect("a listed effect");
        let figure =
            |section: &str, key: &str| case.truth[section][key].as_f64().expect("a number");
        let natural_hz = figure("true_constants", "natural_frequency_hz");
        let near = |hz: &f64| (0.79..1.21).contains(&(natural_hz / hz));
        assert!(NATURAL_HZ.iter().any(near), "{natural_hz} Hz");
        let period = figure("records", "rate_hz") / natural_hz;
        assert!((12.0..61.0).contains(&period), "{period} samples a period");
        let ratio = figure("true_constants", "damping_ratio");
        assert!((0.003..0.3).contains(&ratio), "{ratio}");
        // A plain stand is a plain stand.
        assert!(figure("strength", "train") < 1e-3 && figure("strength", "holdout") < 1e-3);
        let samples = figure("wide", "samples") as usize;
        assert_eq!(
            [
                case.train.applied_n_m.len(),
                case.holdout.measured_n_m.len()
            ],
            [samples; 2]
        );
        let declared = case
            .declared
            .expect("a stand of its own")
            .written(&case.train.span);
        for (declared, key) in [
            (declared.inertia_kg_m2, "inertia_kg_m2"),
            (declared.damping_n_m_s, "damping_n_m_s_per_rad"),
            (declared.stiffness_n_m, "stiffness_n_m_per_rad"),
        ] {
            let off = (figure("true_constants", key) / declared - 1.0).abs();
            assert!((0.019..0.201).contains(&off), "{key} {off}");
        }
        let again = record::make_as(&WIDE, 2, "none", number).expect("a listed effect");
        assert_eq!(case.train.measured_n_m, again.train.measured_n_m);
    }
}

#[test]
fn what_cannot_be_seen_is_not_made() {
    let asked = Asked {
        strength: Some((2.0, 4.0)),
        ..WIDE
    };
    let case = record::make_as(&asked, 1, "mains-pickup", 0).expect("a listed effect");
    let figure = |section: &str, key: &str| case.truth[section][key].as_f64().expect("a number");
    let hz = figure("parameters", "frequency_hz");
    assert!(
        (hz - 50.0).abs() < 0.03 || (hz - 60.0).abs() < 0.03,
        "{hz} Hz"
    );
    let rate_hz = figure("records", "rate_hz");
    assert!(hz < 0.31 * rate_hz && hz * figure("wide", "samples") / rate_hz > 4.0);
    assert!((1.4..5.5).contains(&figure("strength", "train")));
    let mixed = record::make_as(&asked, 1, "mixed", 0).expect("one of each");
    assert_eq!(mixed.truth["effects"].as_array().map(Vec::len), Some(1));
    assert!(
        mixed.truth["variant"]
            .as_str()
            .is_some_and(|v| v.contains(" + unlisted ("))
    );
}
