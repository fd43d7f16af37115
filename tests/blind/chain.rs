//! Effects in the measuring chain without dynamics: gain, static characteristics, clipping,
//! backlash.

use super::draw::Draw;
use super::integrate::Dense;
use super::plant::{Built, Scene};

/// A wrong gain.
pub fn gain(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let gain = 1.0 + size * draw.sign();
    Built::curve(scene, move |y| gain * y, &[("gain", gain)])
}

/// `y (1 + s y/peak)`.
pub fn gage_quadratic(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let share = size * draw.sign();
    let per = share / scene.shown_peak;
    Built::curve(
        scene,
        move |y| y * (1.0 + per * y),
        &[("share_at_peak", share), ("per_n_m", per)],
    )
}

/// `y (1 + s (y/peak)²)`.
pub fn gage_cubic(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let share = size * draw.sign();
    let per = share / scene.shown_peak.powi(2);
    Built::curve(
        scene,
        move |y| y * (1.0 + per * y * y),
        &[("share_at_peak", share), ("per_n_m2", per)],
    )
}

/// A bridge with one active arm: `y / (1 + s y/peak)`.
pub fn gage_bridge(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let share = size.min(0.6) * draw.sign();
    // Beyond twice the peak the characteristic is constant, far from its pole.
    let per = share / scene.shown_peak;
    let limit = 0.8 / share.abs();
    let peak = scene.shown_peak;
    Built::curve(
        scene,
        move |y| y / (1.0 + share * (y / peak).clamp(-limit, limit)),
        &[("share_at_peak", share), ("per_n_m", per)],
    )
}

/// Clipping on both sides.
pub fn clip(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    let limit = scene.shown_peak * (1.0 - size);
    Built::curve(
        scene,
        move |y| y.clamp(-limit, limit),
        &[("limit_n_m", limit)],
    )
}

/// Clipping on both sides at different limits.
pub fn clip_uneven(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let high = scene.shown_peak * (1.0 - size);
    let low = -high * draw.between(0.85, 1.15);
    Built::curve(
        scene,
        move |y| y.clamp(low, high),
        &[("high_n_m", high), ("low_n_m", low)],
    )
}

/// `L tanh(y/L)`.
pub fn saturate_soft(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    let limit = scene.shown_peak / size;
    Built::curve(
        scene,
        move |y| limit * (y / limit).tanh(),
        &[("limit_n_m", limit)],
    )
}

/// `y / (1 + |y/L|^p)^(1/p)`, a knee between soft and hard.
pub fn saturate_knee(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let limit = scene.shown_peak / size;
    let power = draw.between(4.0, 12.0);
    Built::curve(
        scene,
        move |y| y / (1.0 + (y / limit).abs().powf(power)).powf(1.0 / power),
        &[("limit_n_m", limit), ("power", power)],
    )
}

/// Hysteretic backlash between the motion of the beam and the gage.
pub fn play(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    let half = size * scene.shown_rms;
    let change = move |mut dense: Dense| {
        let mut follower = 0.0_f64;
        for value in &mut dense.values {
            follower = follower.clamp(*value - half, *value + half);
            *value = follower;
        }
        dense
    };
    Built::dense(scene, change, &[("half_width_n_m", half)])
}
