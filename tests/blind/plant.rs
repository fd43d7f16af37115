//! The stand `J θ'' + f θ' + K θ = T` with a variant of an effect.

use super::draw::Draw;
use super::excitation::Input;
use super::integrate::{Dense, Dynamics, State};
use super::span::Span;

/// Constants of a stand in SI units.
#[derive(Debug, Clone, Copy)]
pub struct Constants {
    pub inertia_kg_m2: f64,
    pub damping_n_m_s: f64,
    pub stiffness_n_m: f64,
}

/// One pound-foot in N m (and one slug ft² in kg m²).
pub const FT_LBF: f64 = 1.355_817_948_331_400_4;

impl Constants {
    /// The constants of the thesis, equation (31).
    pub fn hertel() -> Self {
        Self {
            inertia_kg_m2: 5.85e-3 * FT_LBF,
            damping_n_m_s: 3.07 * FT_LBF,
            stiffness_n_m: 8.1e4 * FT_LBF,
        }
    }

    /// Angular acceleration under a net torque in addition to spring and damper.
    pub fn acceleration(&self, torque: f64, state: &State) -> f64 {
        (torque - self.damping_n_m_s * state[1] - self.stiffness_n_m * state[0])
            / self.inertia_kg_m2
    }

    /// The same in seconds as written in the files.
    pub fn written(&self, span: &Span) -> Self {
        Self {
            inertia_kg_m2: self.inertia_kg_m2 * span.slower * span.slower,
            damping_n_m_s: self.damping_n_m_s * span.slower,
            ..*self
        }
    }

    /// Undamped angular frequency in rad/s.
    pub fn omega(&self) -> f64 {
        (self.stiffness_n_m / self.inertia_kg_m2).sqrt()
    }

    /// Damping ratio.
    pub fn damping_ratio(&self) -> f64 {
        self.damping_n_m_s / (2.0 * (self.stiffness_n_m * self.inertia_kg_m2).sqrt())
    }
}

/// The plain stand.
pub struct Plain(pub Constants);

impl Dynamics for Plain {
    fn rates(&self, _: i8, _: f64, torque: f64, state: &State, rates: &mut State) {
        rates[0] = state[1];
        rates[1] = self.0.acceleration(torque, state);
    }

    fn shown(&self, _: i8, _: f64, _: f64, state: &State) -> f64 {
        self.0.stiffness_n_m * state[0]
    }
}

/// A stand with a torque that depends on angle, speed and time in addition to spring and damper.
pub struct With<F> {
    pub constants: Constants,
    /// The resisting torque, from time, angle and speed.
    pub resists: F,
    /// Whether the gage also shows the part of it carried by the beam.
    pub in_gage: bool,
}

impl<F: Fn(f64, f64, f64) -> f64> Dynamics for With<F> {
    fn rates(&self, _: i8, time_s: f64, torque: f64, state: &State, rates: &mut State) {
        let net = torque - (self.resists)(time_s, state[0], state[1]);
        rates[0] = state[1];
        rates[1] = self.constants.acceleration(net, state);
    }

    fn shown(&self, _: i8, time_s: f64, _: f64, state: &State) -> f64 {
        let linear = self.constants.stiffness_n_m * state[0];
        if self.in_gage {
            linear + (self.resists)(time_s, state[0], 0.0)
        } else {
            linear
        }
    }
}

/// The stand without the effect: constants and magnitudes of its response.
pub struct Scene {
    pub constants: Constants,
    /// Largest torque shown by the plain stand.
    pub shown_peak: f64,
    /// RMS torque shown by the plain stand.
    pub shown_rms: f64,
    /// RMS speed.
    pub speed_rms: f64,
    /// RMS applied torque.
    pub applied_rms: f64,
    /// Highest applied frequency.
    pub top_hz: f64,
    pub span: Span,
    /// Whether a filter follows, which also uses the signal between the samples.
    pub filtered: bool,
}

impl Scene {
    /// Largest angle of the plain stand.
    pub fn peak_rad(&self) -> f64 {
        self.shown_peak / self.constants.stiffness_n_m
    }
}

/// The record processed by a step of the measuring chain.
pub struct Place<'a> {
    pub input: &'a Input,
    /// Random numbers that differ between records.
    pub draw: Draw,
}

/// An operation on the dense signal.
pub type OnDense = Box<dyn Fn(Dense) -> Dense>;
/// An operation on the samples.
pub type OnSamples = Box<dyn Fn(&mut Place, &mut [f64])>;

/// A stand with an effect in it.
pub struct Built {
    pub dynamics: Box<dyn Dynamics>,
    pub on_dense: Option<OnDense>,
    pub on_samples: Option<OnSamples>,
    /// The true parameters, for the truth file.
    pub parameters: Vec<(&'static str, f64)>,
}

impl Built {
    /// An effect in the stand itself.
    pub fn dynamics(dynamics: impl Dynamics + 'static, parameters: &[(&'static str, f64)]) -> Self {
        Self {
            dynamics: Box::new(dynamics),
            on_dense: None,
            on_samples: None,
            parameters: parameters.to_vec(),
        }
    }

    /// An effect on the gage signal.
    pub fn dense(
        scene: &Scene,
        change: impl Fn(Dense) -> Dense + 'static,
        parameters: &[(&'static str, f64)],
    ) -> Self {
        let mut built = Self::dynamics(Plain(scene.constants), parameters);
        built.on_dense = Some(Box::new(change));
        built
    }

    /// A static characteristic of the measuring chain.
    pub fn curve(
        scene: &Scene,
        curve: impl Fn(f64) -> f64 + 'static,
        parameters: &[(&'static str, f64)],
    ) -> Self {
        let change = move |mut dense: Dense| {
            dense
                .values
                .iter_mut()
                .for_each(|value| *value = curve(*value));
            dense
        };
        Self::dense(scene, change, parameters)
    }

    /// An effect on the samples.
    pub fn samples(
        scene: &Scene,
        change: impl Fn(&mut Place, &mut [f64]) + 'static,
        parameters: &[(&'static str, f64)],
    ) -> Self {
        let mut built = Self::dynamics(Plain(scene.constants), parameters);
        built.on_samples = Some(Box::new(change));
        built
    }
}
