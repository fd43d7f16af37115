//! Time integration of `x'' + 2ζω₀ x' + ω₀² (x + n(x, x', z)) = ω₀² G u`.
//!
//! The linear part is exact: from node to node by the matrix exponential, with the input between nodes constant, straight,
//! or as a cubic through four of them. The torques `n` act at the nodes (`run`; `modes` for several modes), each for a
//! whole step (Strang splitting, SIAM J. Numer. Anal. 5 (1968), 506): second order in the step, stable for linear terms
//! of any size, and a switching torque follows its own exact flow.

use num_complex::Complex64;

use super::between::Between;
use crate::effects::Mode;
use crate::modal::{ModalPart, ModalResponse};

/// Displacement and speed, in units of the record.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotionState {
    /// Displacement.
    pub x: f64,
    /// Its rate of change, per second.
    pub speed: f64,
}

/// Largest `ω₀ h` of a step; the splitting error is about `(ω₀ h)²/24` of the torques.
const LARGEST_STEP: f64 = 0.1;
/// Minimum number of steps per sample: the cubic is then within 6e-4 of an input at an eighth of the sampling
/// rate.
const FEWEST_SUBSTEPS: usize = 2;
/// Maximum number of steps per sample.
const MOST_SUBSTEPS: usize = 64;

/// Integration steps per sample for a stand of this natural frequency.
///
/// ```
/// // 590 Hz at 20 kHz: ω₀/f_s = 0.185, two steps of 0.093.
/// assert_eq!(torqcomp_model::simulate::substeps(590.0, 20_000.0), 2);
/// ```
#[must_use]
pub fn substeps(natural_hz: f64, rate_hz: f64) -> usize {
    let step = std::f64::consts::TAU * natural_hz / rate_hz;
    ((step / LARGEST_STEP).ceil() as usize).clamp(FEWEST_SUBSTEPS, MOST_SUBSTEPS)
}

/// One step of the linear part.
pub(super) struct LinearStep {
    /// What a unit of `x` and one of `x'` become in `x` and `x'`.
    of_x: [f64; 2],
    of_speed: [f64; 2],
    /// Whether the input is constant from a node to the next.
    is_held: bool,
    /// What a unit of the input at each of the nodes −1, 0, 1, 2 adds to `x` and `x'`.
    of_input: [[f64; 2]; 4],
}

/// Free motion over a time: the matrix exponential of the linear part.
pub(super) fn free(mode: &Mode, time_s: f64) -> [f64; 4] {
    let omega = mode.omega_rad_s;
    let sigma = mode.damping_ratio * omega;
    let square = omega * omega - sigma * sigma;
    let root = square.abs().sqrt();
    let small = root * time_s < 1e-6;
    let (cosine, sine) = match (small, square > 0.0) {
        (true, _) => (1.0, time_s),
        (false, true) => ((root * time_s).cos(), (root * time_s).sin() / root),
        (false, false) => ((root * time_s).cosh(), (root * time_s).sinh() / root),
    };
    let decay = (-sigma * time_s).exp();
    [
        decay * (cosine + sigma * sine),
        decay * sine,
        -decay * omega * omega * sine,
        decay * (cosine - sigma * sine),
    ]
}

/// Displacement of the free motion from a unit displacement and from a unit speed, over `count` samples.
#[must_use]
pub(crate) fn free_motion(mode: &Mode, rate_hz: f64, count: usize) -> [Vec<f64>; 2] {
    let [a, b, c, d] = free(mode, 1.0 / rate_hz);
    let run = |mut x: f64, mut speed: f64| {
        (0..count)
            .map(|_| {
                let now = x;
                (x, speed) = (a * x + b * speed, c * x + d * speed);
                now
            })
            .collect()
    };
    [run(1.0, 0.0), run(0.0, mode.omega_rad_s)]
}

/// Contribution of a mode's own motion to displacement and speed of the gage, without that of the present input.
pub(super) fn at_gage(part: &ModalPart, driven: MotionState) -> MotionState {
    let ModalPart {
        mode,
        residue,
        quadrature,
        ..
    } = *part;
    let omega = mode.omega_rad_s;
    MotionState {
        x: residue * driven.x + quadrature / omega * driven.speed,
        speed: (residue - 2.0 * mode.damping_ratio * quadrature) * driven.speed
            - quadrature * omega * driven.x,
    }
}

/// Gauss–Legendre nodes and weights on 0 to 1, exact to degree 11.
const GAUSS: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_3, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_17),
];

impl LinearStep {
    pub(super) fn new(mode: &Mode, gain: f64, step_s: f64, between: Between) -> Self {
        let [a, b, c, d] = free(mode, step_s);
        let mut step = Self {
            of_x: [a, c],
            of_speed: [b, d],
            is_held: between == Between::Held,
            of_input: [[0.0; 2]; 4],
        };
        let weights = match between {
            Between::BandLimited => cubic,
            Between::StraightLines => straight,
            Between::Held => {
                step.of_input[1] = step.held(gain);
                return step;
            }
        };
        // Beyond that the quadrature is not exact; for shorter steps the closed form loses digits.
        if between == Between::StraightLines && mode.omega_rad_s * step_s > LARGEST_STEP {
            let (held, ramp) = (step.held(gain), step.ramp(mode, gain, step_s));
            step.of_input[1] = [held[0] - ramp[0], held[1] - ramp[1]];
            step.of_input[2] = ramp;
            return step;
        }
        for (place, weight) in GAUSS {
            let [_, x, _, speed] = free(mode, (1.0 - place) * step_s);
            let force = weight * step_s * gain * mode.omega_rad_s * mode.omega_rad_s;
            for ([to_x, to_speed], share) in step.of_input.iter_mut().zip(weights(place)) {
                *to_x += force * x * share;
                *to_speed += force * speed * share;
            }
        }
        step
    }

    /// The step of a mode's contribution to the motion of the gage.
    pub(super) fn at_gage(mut self, part: &ModalPart) -> Self {
        self.of_input = self.of_input.map(|[x, speed]| {
            let at_gage = at_gage(part, MotionState { x, speed });
            [at_gage.x, at_gage.speed]
        });
        self
    }

    /// What a force that is constant over the step adds to `x` and `x'`: the distance to its equilibrium decays like the
    /// free motion.
    pub(super) fn held(&self, force: f64) -> [f64; 2] {
        let [a, c] = self.of_x;
        [force * (1.0 - a), -force * c]
    }

    /// What a force that rises from zero over the step adds to `x` and `x'`: the distance to the steady ramp `t/h −
    /// 2ζ/(ω₀h)` decays like the free motion.
    fn ramp(&self, mode: &Mode, force: f64, step_s: f64) -> [f64; 2] {
        let (late, speed) = (
            2.0 * mode.damping_ratio / (mode.omega_rad_s * step_s),
            1.0 / step_s,
        );
        let [[a, c], [b, d]] = [self.of_x, self.of_speed];
        let x = 1.0 - late + a * late - b * speed;
        [force * x, force * (speed + c * late - d * speed)]
    }

    /// The state at the next node; both numbers in the same operations, which a processor does at once.
    #[inline]
    pub(super) fn advance(&self, state: MotionState, input: &[f64]) -> MotionState {
        let [u, v, w, z] = *input.first_chunk().expect("four nodes");
        let [to_u, to_v, to_w, to_z] = self.of_input;
        // Not `array::from_fn`, which becomes a call per number here.
        let mut next = [0.0; 2];
        for k in 0..2 {
            let force = to_u[k] * u + to_v[k] * v + to_w[k] * w + to_z[k] * z;
            next[k] = self.of_x[k] * state.x + (self.of_speed[k] * state.speed + force);
        }
        let [x, speed] = next;
        MotionState { x, speed }
    }
}

impl LinearStep {
    /// The input at a fraction of the step.
    pub(super) fn input_at(&self, input: &[f64], part: f64) -> f64 {
        match self.is_held {
            true => input[1],
            false => input[1] + part * (input[2] - input[1]),
        }
    }
}

/// Response of the sampled motion to an input that is held or straight between its samples, at an angular frequency in
/// rad/s up to the Nyquist frequency, including the images above it; `None` for a band-limited one. With the free motion
/// `A` over a sample, and the motion `B₀` and `B₁` due to a unit sample at its start and its end, that of each mode is
/// `(z − A)⁻¹ (B₀ + z B₁)` at `z = e^{jωT}`.
pub(crate) fn sampled_response(
    stand: &ModalResponse,
    step_s: f64,
    between: Between,
) -> Option<impl Fn(f64) -> Complex64> {
    let step = |part: &ModalPart| (*part, LinearStep::new(&part.mode, 1.0, step_s, between));
    let steps: Vec<_> = stand.parts().iter().map(step).collect();
    let residual = stand.residual();
    let response = move |omega| {
        let z = Complex64::from_polar(1.0, omega * step_s);
        let of_part = |(part, step): &(ModalPart, LinearStep)| {
            let [[a, c], [b, d]] = [step.of_x, step.of_speed];
            let [_, now, next, _] = step.of_input;
            let [to_x, to_speed] = [0, 1].map(|k| now[k] + z * next[k]);
            let determinant = (z - a) * (z - d) - b * c;
            let x = (z - d) * to_x + b * to_speed;
            let speed = c * to_x + (z - a) * to_speed;
            (part.residue * x + part.quadrature / part.mode.omega_rad_s * speed) / determinant
        };
        steps.iter().map(of_part).sum::<Complex64>() + residual
    };
    (between != Between::BandLimited).then_some(response)
}

/// Weights of the nodes −1, 0, 1, 2 in a straight line between the middle ones.
fn straight(t: f64) -> [f64; 4] {
    [0.0, 1.0 - t, t, 0.0]
}

/// Weights of the nodes −1, 0, 1, 2 in their interpolating cubic, at a position between 0 and 1.
fn cubic(t: f64) -> [f64; 4] {
    [
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    ]
}
