//! Friction effects: dry friction with sticking, its smooth form, drag with the square of speed.

use super::draw::Draw;
use super::integrate::{Dynamics, State};
use super::plant::{Built, Constants, Scene, With};

/// Dry friction with true sticking; `falls_by` and `over_speed` make it fall from its static value
/// (Stribeck).
struct Dry {
    constants: Constants,
    sliding_n_m: f64,
    /// Static over sliding friction, minus one.
    more_at_rest: f64,
    over_speed: f64,
}

impl Dry {
    fn friction(&self, speed: f64) -> f64 {
        let fall = (-(speed / self.over_speed).powi(2)).exp();
        self.sliding_n_m * (1.0 + self.more_at_rest * fall)
    }

    fn pull(&self, torque: f64, state: &State) -> f64 {
        torque - self.constants.stiffness_n_m * state[0]
    }

    fn at_rest(&self, torque: f64, state: &State) -> i8 {
        let pull = self.pull(torque, state);
        if pull.abs() <= self.friction(0.0) {
            0
        } else {
            pull.signum() as i8
        }
    }
}

impl Dynamics for Dry {
    fn rates(&self, mode: i8, _: f64, torque: f64, state: &State, rates: &mut State) {
        if mode == 0 {
            return;
        }
        rates[0] = state[1];
        let net = torque - f64::from(mode) * self.friction(state[1]);
        rates[1] = self.constants.acceleration(net, state);
    }

    fn shown(&self, _: i8, _: f64, _: f64, state: &State) -> f64 {
        self.constants.stiffness_n_m * state[0]
    }

    fn first_mode(&self, torque: f64) -> i8 {
        self.at_rest(torque, &[0.0; super::integrate::STATES])
    }

    fn guard(&self, mode: i8, torque: f64, state: &State) -> f64 {
        if mode == 0 {
            self.friction(0.0) - self.pull(torque, state).abs()
        } else {
            f64::from(mode) * state[1]
        }
    }

    fn next_mode(&self, mode: i8, torque: f64, state: &mut State) -> i8 {
        state[1] = 0.0;
        if mode == 0 {
            // The guard is zero to rounding: the resultant torque decides the direction.
            self.pull(torque, state).signum() as i8
        } else {
            self.at_rest(torque, state)
        }
    }
}

/// Dry friction that sticks.
pub fn coulomb(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    let sliding_n_m = size * scene.applied_rms;
    let dry = Dry {
        constants: scene.constants,
        sliding_n_m,
        more_at_rest: 0.0,
        over_speed: 1.0,
    };
    Built::dynamics(dry, &[("friction_n_m", sliding_n_m)])
}

/// `T_c tanh(θ̇/v)` with `v` a few per cent of the typical speed.
pub fn coulomb_smooth(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let friction = size * scene.applied_rms;
    let speed = scene.speed_rms * draw.log_between(0.003, 0.05);
    let system = With {
        constants: scene.constants,
        resists: move |_, _, v: f64| friction * (v / speed).tanh(),
        in_gage: false,
    };
    Built::dynamics(
        system,
        &[("friction_n_m", friction), ("over_speed_rad_s", speed)],
    )
}

/// Friction that is larger at rest, with sticking.
pub fn stribeck(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let sliding_n_m = size * scene.applied_rms;
    let dry = Dry {
        constants: scene.constants,
        sliding_n_m,
        more_at_rest: draw.between(0.8, 2.0),
        over_speed: scene.speed_rms * draw.between(0.1, 0.5),
    };
    let parameters = [
        ("sliding_n_m", sliding_n_m),
        ("more_at_rest", dry.more_at_rest),
        ("over_speed_rad_s", dry.over_speed),
    ];
    Built::dynamics(dry, &parameters)
}

/// A rubbing spot: dry friction, smoothed at low speed, around one angle.
pub fn spot(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let friction = size * scene.applied_rms;
    let speed = scene.speed_rms * draw.log_between(0.01, 0.05);
    let at = scene.peak_rad() * draw.between(-0.5, 0.5);
    let width = scene.peak_rad() * draw.between(0.1, 0.4);
    let system = With {
        constants: scene.constants,
        resists: move |_, angle: f64, v: f64| {
            friction * (-((angle - at) / width).powi(2)).exp() * (v / speed).tanh()
        },
        in_gage: false,
    };
    let parameters = [
        ("friction_n_m", friction),
        ("at_rad", at),
        ("width_rad", width),
        ("over_speed_rad_s", speed),
    ];
    Built::dynamics(system, &parameters)
}

/// A wedge: friction proportional to the angle.
pub fn wedge(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let coefficient = size * scene.constants.stiffness_n_m;
    let speed = scene.speed_rms * draw.log_between(0.01, 0.05);
    let system = With {
        constants: scene.constants,
        resists: move |_, angle: f64, v: f64| coefficient * angle.abs() * (v / speed).tanh(),
        in_gage: false,
    };
    let parameters = [
        ("coefficient_n_m_rad", coefficient),
        ("over_speed_rad_s", speed),
    ];
    Built::dynamics(system, &parameters)
}

/// `c |θ̇| θ̇`.
pub fn quadratic(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    let coefficient = size * scene.constants.damping_n_m_s / scene.speed_rms;
    let system = With {
        constants: scene.constants,
        resists: move |_, _, v: f64| coefficient * v.abs() * v,
        in_gage: false,
    };
    Built::dynamics(system, &[("coefficient_n_m_s2", coefficient)])
}

/// `c θ̇³` (not listed).
pub fn cubic(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    let coefficient = size * scene.constants.damping_n_m_s / scene.speed_rms.powi(2);
    let system = With {
        constants: scene.constants,
        resists: move |_, _, v: f64| coefficient * v * v * v,
        in_gage: false,
    };
    Built::dynamics(system, &[("coefficient_n_m_s3", coefficient)])
}
