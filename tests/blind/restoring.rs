//! Effects in the restoring torque: nonlinear springs, backlash, hysteresis, contacts.

use super::draw::Draw;
use super::integrate::{Dynamics, State};
use super::plant::{Built, Constants, Scene, With};

/// `K θ (1 + s |θ/θ_peak|^(power−1))`, `s` of either sign.
fn curved(scene: &Scene, s: f64, power: i32, in_gage: bool) -> Built {
    let (stiffness, peak) = (scene.constants.stiffness_n_m, scene.peak_rad());
    let coefficient = s * stiffness / peak.powi(power - 1);
    let system = With {
        constants: scene.constants,
        resists: move |_, angle: f64, _| coefficient * angle.powi(power),
        in_gage,
    };
    Built::dynamics(
        system,
        &[
            ("share_at_peak", s),
            ("n_m_per_rad_to_the_power", coefficient),
        ],
    )
}

/// Hardening with the angle.
pub fn cubic_hardening(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    curved(scene, size, 3, false)
}

/// Softening with the angle.
pub fn cubic_softening(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    curved(scene, -size, 3, false)
}

/// The gage shows the whole restoring torque.
pub fn cubic_in_gage(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    curved(scene, size, 3, true)
}

/// Hardening to one side.
pub fn quadratic(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    curved(scene, size * draw.sign(), 2, false)
}

/// The gage shows the whole restoring torque.
pub fn quadratic_in_gage(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    curved(scene, size * draw.sign(), 2, true)
}

/// Fifth power (not listed).
pub fn quintic(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    curved(scene, size * draw.sign(), 5, false)
}

/// Piecewise linear restoring torque: `inner` between two limits, `outer` beyond, relative to the
/// limits, with a damper that acts only beyond.
struct Contact {
    constants: Constants,
    low_rad: f64,
    high_rad: f64,
    inner_n_m: f64,
    outer_n_m: f64,
    outer_damping: f64,
    /// Whether the gage shows the whole restoring torque or `K θ`.
    in_gage: bool,
}

impl Contact {
    fn spring(&self, mode: i8, angle: f64) -> f64 {
        let beyond = match mode {
            1 => angle - self.high_rad,
            -1 => angle - self.low_rad,
            _ => 0.0,
        };
        self.inner_n_m * angle + (self.outer_n_m - self.inner_n_m) * beyond
    }
}

impl Dynamics for Contact {
    fn rates(&self, mode: i8, _: f64, torque: f64, state: &State, rates: &mut State) {
        let damping =
            self.constants.damping_n_m_s + if mode == 0 { 0.0 } else { self.outer_damping };
        rates[0] = state[1];
        rates[1] = (torque - damping * state[1] - self.spring(mode, state[0]))
            / self.constants.inertia_kg_m2;
    }

    fn shown(&self, mode: i8, _: f64, _: f64, state: &State) -> f64 {
        if self.in_gage {
            self.spring(mode, state[0])
        } else {
            self.constants.stiffness_n_m * state[0]
        }
    }

    fn guard(&self, mode: i8, _: f64, state: &State) -> f64 {
        let (below, above) = (state[0] - self.low_rad, state[0] - self.high_rad);
        match mode {
            1 => above,
            -1 => -below,
            _ => below.min(-above),
        }
    }

    fn next_mode(&self, mode: i8, _: f64, state: &mut State) -> i8 {
        match mode {
            0 if state[1] > 0.0 => 1,
            0 => -1,
            _ => 0,
        }
    }
}

/// Backlash between stator and beam: no restoring torque within the gap, and the gage shows none.
pub fn gap(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    partial_gap(scene, size, 0.0, draw)
}

/// Part of the stiffness remains within the gap (one of two paths has backlash).
pub fn soft_gap(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let left = draw.between(0.2, 0.6);
    partial_gap(scene, size, left, draw)
}

fn partial_gap(scene: &Scene, size: f64, left: f64, draw: &mut Draw) -> Built {
    let half_rad = size * scene.peak_rad();
    let shift = if draw.chance(0.3) {
        draw.between(-0.8, 0.8)
    } else {
        0.0
    };
    let stiffness = scene.constants.stiffness_n_m;
    let contact = Contact {
        constants: scene.constants,
        low_rad: (shift - 1.0) * half_rad,
        high_rad: (shift + 1.0) * half_rad,
        inner_n_m: left * stiffness,
        outer_n_m: stiffness,
        outer_damping: 0.0,
        in_gage: true,
    };
    Built::dynamics(
        contact,
        &[
            ("half_gap_rad", half_rad),
            ("shift_of_half_gap", shift),
            ("stiffness_left", left),
        ],
    )
}

/// Stops that the beam hits on both sides.
pub fn end_stop(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    stop(scene, size, draw.between(5.0, 40.0), true, draw)
}

/// A stop on one side only.
pub fn one_sided_stop(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    stop(scene, size, draw.between(5.0, 40.0), false, draw)
}

fn stop(scene: &Scene, size: f64, harder: f64, both: bool, draw: &mut Draw) -> Built {
    let at_rad = scene.peak_rad() * (1.0 - size);
    let constants = scene.constants;
    let bounce = draw.between(0.5, 5.0);
    let contact = Contact {
        constants,
        low_rad: if both {
            -at_rad * draw.between(1.0, 1.1)
        } else {
            -1e3
        },
        high_rad: at_rad,
        inner_n_m: constants.stiffness_n_m,
        outer_n_m: harder * constants.stiffness_n_m,
        outer_damping: bounce * constants.damping_n_m_s,
        in_gage: false,
    };
    Built::dynamics(
        contact,
        &[
            ("at_share_of_peak", 1.0 - size),
            ("harder", harder),
            ("damping_ratio_of_stop", bounce),
        ],
    )
}

/// `ż = α θ̇ − β |θ̇| |z|^(n−1) z − γ θ̇ |z|^n` (Wen, 1976), `z` parallel to spring and damper.
struct BoucWen {
    constants: Constants,
    alpha: f64,
    beta: f64,
    gamma: f64,
    exponent: f64,
    in_gage: bool,
}

impl Dynamics for BoucWen {
    fn states(&self) -> usize {
        3
    }

    fn rates(&self, _: i8, _: f64, torque: f64, state: &State, rates: &mut State) {
        let (speed, z) = (state[1], state[2]);
        rates[0] = speed;
        rates[1] = self.constants.acceleration(torque - z, state);
        let power = z.abs().powf(self.exponent);
        rates[2] = self.alpha * speed
            - self.beta * speed.abs() * power * z.signum()
            - self.gamma * speed * power;
    }

    fn shown(&self, _: i8, _: f64, _: f64, state: &State) -> f64 {
        let linear = self.constants.stiffness_n_m * state[0];
        if self.in_gage {
            linear + state[2]
        } else {
            linear
        }
    }
}

fn bouc_wen(scene: &Scene, size: f64, exponent: f64, in_gage: bool, draw: &mut Draw) -> Built {
    let mut constants = scene.constants;
    let alpha = size * constants.stiffness_n_m;
    if in_gage {
        // The beam's stiffness for small angles remains that of the scene.
        constants.stiffness_n_m -= alpha.min(0.9 * constants.stiffness_n_m);
    }
    // Yield at a fraction of the largest torque that the hysteretic path would carry.
    let limit = draw.between(0.15, 0.6) * alpha * scene.peak_rad();
    let split = draw.between(0.5, 0.9);
    let per = alpha / limit.powf(exponent);
    let system = BoucWen {
        constants,
        alpha,
        beta: split * per,
        gamma: (1.0 - split) * per,
        exponent,
        in_gage,
    };
    Built::dynamics(
        system,
        &[
            ("alpha_n_m_per_rad", alpha),
            ("limit_n_m", limit),
            ("beta_share", split),
            ("exponent", exponent),
        ],
    )
}

/// Exponent 1.
pub fn bouc_wen_1(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    bouc_wen(scene, size, 1.0, false, draw)
}

/// Other exponents, up to 2.
pub fn bouc_wen_n(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let exponent = draw.one_of(&[1.5, 2.0, 2.0]);
    bouc_wen(scene, size, exponent, false, draw)
}

/// The gage shows the whole restoring torque.
pub fn bouc_wen_in_gage(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let exponent = draw.one_of(&[1.0, 2.0]);
    bouc_wen(scene, size, exponent, true, draw)
}
