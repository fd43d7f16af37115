//! Unlisted effects, in addition to those marked as such in the other files.

use std::f64::consts::TAU;

use super::draw::Draw;
use super::excitation::RATE_HZ;
use super::integrate::{Dynamics, State};
use super::plant::{Built, Place, Plain, Scene, With};

/// Stiffness that changes linearly over the record.
pub fn softening_in_time(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let share = size * draw.sign();
    let (stiffness, length_s) = (scene.constants.stiffness_n_m, scene.span.length_s());
    let system = With {
        constants: scene.constants,
        resists: move |t: f64, angle, _| share * stiffness * (t / length_s) * angle,
        in_gage: false,
    };
    Built::dynamics(system, &[("share_at_end", share)])
}

/// Stiffness that oscillates at its own frequency.
pub fn swinging_stiffness(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    // Some periods per record, slow compared with the stand.
    let low_hz = 1.5 / scene.span.longer();
    let high_hz = (40.0 / scene.span.longer()).min(118.0 * scene.span.faster);
    let frequency_hz = draw.log_between(low_hz, high_hz.max(1.2 * low_hz));
    let phase = draw.phase();
    let stiffness = scene.constants.stiffness_n_m;
    let system = With {
        constants: scene.constants,
        resists: move |t: f64, angle, _| {
            size * stiffness * (TAU * frequency_hz * t + phase).sin() * angle
        },
        in_gage: false,
    };
    Built::dynamics(system, &[("share", size), ("frequency_hz", frequency_hz)])
}

/// The amplifier that drives the stand has a dead zone.
struct DeadZone {
    plain: Plain,
    half: f64,
}

impl Dynamics for DeadZone {
    fn rates(&self, mode: i8, time_s: f64, torque: f64, state: &State, rates: &mut State) {
        let passed = torque - torque.clamp(-self.half, self.half);
        self.plain.rates(mode, time_s, passed, state, rates);
    }

    fn shown(&self, mode: i8, time_s: f64, torque: f64, state: &State) -> f64 {
        self.plain.shown(mode, time_s, torque, state)
    }
}

/// Small torques have no effect.
pub fn dead_zone(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    let half = size * scene.applied_rms;
    let plain = Plain(scene.constants);
    Built::dynamics(DeadZone { plain, half }, &[("half_width_n_m", half)])
}

/// Single outliers.
pub fn spikes(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let count = (draw.between(10.0, 80.0) * scene.span.longer().sqrt()).floor();
    let height = size * scene.shown_rms * 10.0;
    let change = move |place: &mut Place, samples: &mut [f64]| {
        for _ in 0..count as usize {
            let at = (place.draw.unit() * samples.len() as f64) as usize;
            samples[at] += height * place.draw.sign() * place.draw.between(0.3, 1.0);
        }
    };
    Built::samples(scene, change, &[("count", count), ("height_n_m", height)])
}

/// The recorder occasionally holds its last value.
pub fn dropouts(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let length = draw.between(10.0, 60.0).floor();
    let length = length.min((scene.span.samples / 40) as f64);
    let count = (size * 1000.0).clamp(3.0, 60.0).floor();
    let change = move |place: &mut Place, samples: &mut [f64]| {
        for _ in 0..count as usize {
            let from = (place.draw.unit() * (samples.len() as f64 - length - 1.0)) as usize;
            let held = samples[from];
            samples[from..from + length as usize].fill(held);
        }
    };
    Built::samples(scene, change, &[("count", count), ("samples_each", length)])
}

/// Noise that grows with the signal: a slowly fluctuating gain.
pub fn trembling_gain(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let corner_hz = draw.log_between(2.0, 100.0) * scene.span.faster;
    let change = move |place: &mut Place, samples: &mut [f64]| {
        let keep = (-TAU * corner_hz / RATE_HZ).exp();
        let mut gain = 0.0;
        for sample in samples {
            gain = keep * gain + (1.0 - keep * keep).sqrt() * place.draw.normal();
            *sample *= 1.0 + size * gain;
        }
    };
    Built::samples(scene, change, &[("share", size), ("corner_hz", corner_hz)])
}

/// White noise proportional to the signal.
pub fn multiplicative_noise(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    let change = move |place: &mut Place, samples: &mut [f64]| {
        for sample in samples {
            *sample *= 1.0 + size * place.draw.normal();
        }
    };
    Built::samples(scene, change, &[("share", size)])
}

/// The gain of the chain changes over the record.
pub fn fading_gain(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let share = size * draw.sign();
    let length_s = scene.span.length_s();
    let change = move |_: &mut Place, samples: &mut [f64]| {
        for (index, sample) in samples.iter_mut().enumerate() {
            *sample *= 1.0 + share * (index as f64 / RATE_HZ / length_s - 0.5);
        }
    };
    Built::samples(scene, change, &[("share", share)])
}

/// Steps of the zero, as from a loose connector.
pub fn zero_steps(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let count = draw.between(2.0, 6.0).floor();
    let height = size * scene.shown_rms;
    let change = move |place: &mut Place, samples: &mut [f64]| {
        for _ in 0..count as usize {
            let from = (place.draw.unit() * samples.len() as f64) as usize;
            let step = height * place.draw.sign() * place.draw.between(0.5, 1.0);
            samples[from..]
                .iter_mut()
                .for_each(|sample| *sample += step);
        }
    };
    Built::samples(scene, change, &[("count", count), ("height_n_m", height)])
}
