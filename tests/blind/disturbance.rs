//! Disturbances added to the signal: mains, drift, the rotor, the drive.

use std::f64::consts::TAU;

use super::draw::Draw;
use super::excitation::RATE_HZ;
use super::plant::{Built, Place, Scene};

/// A sum of sines with random phases in each record.
fn lines(scene: &Scene, lines: Vec<(f64, f64)>, parameters: &[(&'static str, f64)]) -> Built {
    let change = move |place: &mut Place, samples: &mut [f64]| {
        for (frequency_hz, amplitude) in &lines {
            let phase = place.draw.phase();
            for (index, sample) in samples.iter_mut().enumerate() {
                let time_s = index as f64 / RATE_HZ;
                *sample += amplitude * (TAU * frequency_hz * time_s + phase).sin();
            }
        }
    };
    Built::samples(scene, change, parameters)
}

/// The mains alone.
pub fn mains(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    hum(scene, size, [0.0, 0.0, 0.0], draw)
}

/// The mains with harmonics.
pub fn mains_harmonics(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let shares = [
        if draw.chance(0.4) {
            draw.between(0.1, 0.5)
        } else {
            0.0
        },
        draw.between(0.1, 0.6),
        draw.between(0.0, 0.4),
    ];
    hum(scene, size, shares, draw)
}

fn hum(scene: &Scene, size: f64, shares: [f64; 3], draw: &mut Draw) -> Built {
    let written_hz = draw.one_of(&[50.0, 60.0]) + draw.between(-0.02, 0.02);
    let base_hz = written_hz * scene.span.slower;
    // Frequencies above the Nyquist frequency do not reach a recorder.
    let reach = |order: f64, share: f64| {
        if order * base_hz < 0.45 * RATE_HZ {
            share
        } else {
            0.0
        }
    };
    let shares = [
        reach(2.0, shares[0]),
        reach(3.0, shares[1]),
        reach(5.0, shares[2]),
    ];
    let amplitude = size * scene.shown_rms;
    let parts = vec![
        (base_hz, amplitude),
        (2.0 * base_hz, shares[0] * amplitude),
        (3.0 * base_hz, shares[1] * amplitude),
        (5.0 * base_hz, shares[2] * amplitude),
    ];
    lines(
        scene,
        parts,
        &[
            ("frequency_hz", base_hz),
            ("amplitude_n_m", amplitude),
            ("second", shares[0]),
            ("third", shares[1]),
            ("fifth", shares[2]),
        ],
    )
}

/// The rotor once per turn, as a torque on the stand.
pub fn rotor(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    rotor_with(scene, size, 0.0, draw)
}

/// Once and twice per turn.
pub fn rotor_twice(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let second = draw.between(0.1, 0.6);
    rotor_with(scene, size, second, draw)
}

fn rotor_with(scene: &Scene, size: f64, second: f64, draw: &mut Draw) -> Built {
    let span = &scene.span;
    let apart_hz = (1.2 / (span.length_s() * span.slower)).max(0.8);
    // Away from the mains, its half and its harmonics, which would make both names right.
    let near = |f: f64| {
        [25.0, 30.0, 50.0, 60.0, 100.0, 120.0]
            .iter()
            .any(|mains| (f / span.slower - mains).abs() < apart_hz)
    };
    // At least four turns per record.
    let low_hz = (10.0 * span.faster).max(4.0 / span.length_s());
    let high_hz = (58.0 * span.faster).max(3.0 * low_hz);
    let frequency_hz = loop {
        let frequency_hz = draw.between(low_hz, high_hz);
        if !near(frequency_hz) {
            break frequency_hz;
        }
    };
    let torque = size * scene.shown_rms;
    let factor = |f: f64| {
        let (ratio, damping) = (
            TAU * f / scene.constants.omega(),
            scene.constants.damping_ratio(),
        );
        ((1.0 - ratio * ratio).powi(2) + (2.0 * damping * ratio).powi(2))
            .sqrt()
            .recip()
    };
    lines(
        scene,
        vec![
            (frequency_hz, torque * factor(frequency_hz)),
            (
                2.0 * frequency_hz,
                second * torque * factor(2.0 * frequency_hz),
            ),
        ],
        &[
            ("frequency_hz", frequency_hz),
            ("torque_n_m", torque),
            ("second", second),
        ],
    )
}

/// Adds a function of the time since the start of the record, the same in every record.
fn course(
    scene: &Scene,
    course: impl Fn(f64) -> f64 + 'static,
    parameters: &[(&'static str, f64)],
) -> Built {
    let change = move |_: &mut Place, samples: &mut [f64]| {
        for (index, sample) in samples.iter_mut().enumerate() {
            *sample += course(index as f64 / RATE_HZ);
        }
    };
    Built::samples(scene, change, parameters)
}

/// A linearly drifting zero; the zero at the start of a record is part of it.
pub fn drift_linear(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let rate = size * scene.shown_rms * draw.sign() / scene.span.length_s();
    course(scene, move |t| rate * t, &[("n_m_per_s", rate)])
}

/// A zero that approaches another value exponentially.
pub fn drift_exponential(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let range = size * scene.shown_rms * draw.sign();
    let time_s = draw.log_between(0.2, 3.0) * scene.span.longer();
    course(
        scene,
        move |t| range * (1.0 - (-t / time_s).exp()),
        &[("range_n_m", range), ("time_constant_s", time_s)],
    )
}

/// A wandering zero: random steps through two low-passes of 0.25 s, different in each record.
pub fn drift_random(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    let range = size * scene.shown_rms;
    let (longer, length_s) = (scene.span.longer(), scene.span.length_s());
    let change = move |place: &mut Place, samples: &mut [f64]| {
        let keep = (-1.0 / (0.25 * longer * RATE_HZ)).exp();
        let (mut walk, mut first, mut second) = (0.0, 0.0, 0.0);
        for sample in samples {
            walk += place.draw.normal() / (length_s * RATE_HZ).sqrt();
            first = keep * first + (1.0 - keep) * walk;
            second = keep * second + (1.0 - keep) * first;
            *sample += range * 2.0 * second;
        }
    };
    Built::samples(scene, change, &[("range_n_m", range)])
}

/// Spikes of a drive that decay within some samples.
pub fn decaying_spikes(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let decay = draw.between(1.0, 5.0);
    spikes(scene, size, draw, move |after: f64| (-after / decay).exp())
}

/// Spikes of a drive in one sample each.
pub fn short_spikes(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    spikes(scene, size, draw, |after: f64| f64::from(after < 1.0))
}

/// Spikes at equal intervals of 40 samples to a thirtieth of the record, from a random moment on.
fn spikes(
    scene: &Scene,
    size: f64,
    draw: &mut Draw,
    shape: impl Fn(f64) -> f64 + 'static,
) -> Built {
    let longest = (scene.span.samples as f64 / 30.0).clamp(45.0, 1000.0);
    let period = draw.log_between(40.0, longest);
    let height = size * scene.shown_rms * draw.sign();
    let change = move |place: &mut Place, samples: &mut [f64]| {
        let mut at = period * place.draw.unit();
        while at < samples.len() as f64 {
            let from = at.ceil() as usize;
            for (i, sample) in samples.iter_mut().enumerate().skip(from).take(60) {
                *sample += height * shape(i as f64 - at);
            }
            at += period;
        }
    };
    let rate_hz = RATE_HZ / period;
    Built::samples(
        scene,
        change,
        &[("frequency_hz", rate_hz), ("amplitude_n_m", height.abs())],
    )
}
