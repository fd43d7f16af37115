//! The motion of a stand with several modes, node by node.
//!
//! ```text
//! x = Σ (r_k y_k + q_k y_k'/ω_k) + c G u + Σ z_k
//! y_k'' + 2ζ_k ω_k y_k' + ω_k² y_k = ω_k² G u,   z_k'' + 2ζ_k ω_k z_k' + ω_k² z_k = −ω_k² g_k n(x, x')
//! ```
//!
//! `y_k` is driven by the input and `z_k` by the torques `n` at the gage; both are exact from node to node. A torque
//! changes the speed of the gage at a node, and that of each `z_k` by its contribution `ω_k² g_k`. Sharp dry friction
//! is constant over a step: as much as stops the gage at its end, but no more than its magnitude (J. J. Moreau,
//! *Numerical aspects of the sweeping process*, Comput. Methods Appl. Mech. Eng. 177 (1999), 329).

use super::input::Excitation;
use super::integrate::{LinearStep, MotionState, free};
use super::run::{Acting, MotionProgress, kicked, remembered, shown};
use super::side_by_side::{OngoingMotion, Stepped};
use crate::modal::{ModalPart, ModalResponse};

/// State of a mode.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ModeMotion {
    /// `y`.
    driven: MotionState,
    /// `z`.
    pushed: MotionState,
}

/// Initial states of the modes of a stand: the mode with the largest static contribution has all of the motion. Empty
/// for a stand with one mode.
pub(super) fn begin(stand: &ModalResponse, start: MotionState) -> Vec<ModeMotion> {
    if stand.only().is_some() {
        return Vec::new();
    }
    let mut modes = vec![ModeMotion::default(); stand.parts().len()];
    let parts = stand.parts().iter().enumerate();
    let largest = parts.max_by(|a, b| a.1.residue.abs().total_cmp(&b.1.residue.abs()));
    if let Some((place, part)) = largest.filter(|(_, part)| part.residue != 0.0) {
        modes[place].driven = MotionState {
            x: start.x / part.residue,
            speed: start.speed / part.residue,
        };
    }
    modes
}

/// A mode with its integration step.
struct SteppedMode {
    part: ModalPart,
    step: LinearStep,
    free: [f64; 4],
    /// `g`; 0 where no torque acts.
    at_gage: f64,
    motion: ModeMotion,
}

impl SteppedMode {
    /// Advances by a step; returns its contribution to displacement and speed of the gage, with `driving`
    /// being `G u` at the end.
    fn advance(&mut self, window: &[f64], driving: f64) -> MotionState {
        self.motion.driven = self.step.advance(self.motion.driven, window);
        let MotionState { x, speed } = self.motion.pushed;
        let [a, b, c, d] = self.free;
        self.motion.pushed = MotionState {
            x: a * x + b * speed,
            speed: c * x + d * speed,
        };
        self.at(driving)
    }

    /// Its contribution to displacement and speed of the gage.
    fn at(&self, driving: f64) -> MotionState {
        let ModeMotion { driven, pushed } = self.motion;
        let (omega, ratio) = (self.part.mode.omega_rad_s, self.part.mode.damping_ratio);
        let turned = self.part.quadrature / omega;
        let rate = omega * omega * (driving - driven.x) - 2.0 * ratio * omega * driven.speed;
        MotionState {
            x: self.part.residue * driven.x + turned * driven.speed + pushed.x,
            speed: self.part.residue * driven.speed + turned * rate + pushed.speed,
        }
    }

    /// `ω² g`: acceleration by a unit torque at the gage.
    fn pushed_by(&self) -> f64 {
        self.part.mode.omega_rad_s * self.part.mode.omega_rad_s * self.at_gage
    }
}

/// Integration state of a stand with several modes.
pub(super) struct ModalIntegrator<'a> {
    modes: Vec<SteppedMode>,
    /// `c G`.
    direct: f64,
    gain: f64,
    shift: f64,
    step_s: f64,
    /// Change of the gage's speed at a node by a unit torque.
    impulse: f64,
    acting: Acting<'a>,
    /// Magnitude of the sharp dry friction.
    dry: f64,
}

impl<'a> Stepped<'a> for ModalIntegrator<'a> {
    fn resume(
        motion: &OngoingMotion<'a>,
        input: &Excitation,
        window: &[f64],
    ) -> (Self, MotionState) {
        let (gain, step_s) = (motion.gain, input.step_s());
        let stepped = |(part, at): (&ModalPart, &ModeMotion)| SteppedMode {
            part: *part,
            step: LinearStep::new(&part.mode, gain, step_s, input.between()),
            free: free(&part.mode, step_s),
            at_gage: part.at_gage.unwrap_or(0.0),
            motion: *at,
        };
        let parts = motion.stand.parts().iter();
        let modes: Vec<SteppedMode> = parts.zip(&motion.progress.modes).map(stepped).collect();
        let memories = motion.progress.memories.iter().copied();
        let run = Self {
            impulse: step_s * modes.iter().map(SteppedMode::pushed_by).sum::<f64>(),
            modes,
            direct: motion.stand.residual() * gain,
            gain,
            shift: motion.shift,
            step_s,
            acting: motion.torques.iter().copied().zip(memories).collect(),
            dry: motion.torques.iter().filter_map(|(t, _)| t.dry()).sum(),
        };
        let state = run.begin(window);
        (run, state)
    }

    /// Advances by a step and applies the torques at its end.
    fn step(&mut self, state: MotionState, window: &[f64]) -> MotionState {
        let driving = self.gain * window[2];
        let mut parts = std::mem::take(&mut self.modes);
        let advanced = parts.iter_mut().map(|mode| mode.advance(window, driving));
        let moved = self.whole(
            advanced,
            window[2],
            (window[3] - window[1]) / (2.0 * self.step_s),
        );
        self.modes = parts;
        let kicked = self.kick(moved, moved.speed - state.speed);
        self.rub(kicked)
    }

    fn shown(&mut self, state: MotionState) -> f64 {
        state.x + shown(&mut self.acting, state, self.shift)
    }

    fn end(self, _: MotionState) -> MotionProgress {
        MotionProgress::of_modes(
            remembered(&self.acting),
            self.modes.iter().map(|mode| mode.motion).collect(),
        )
    }
}

impl ModalIntegrator<'_> {
    /// Displacement and speed of the gage at the initial node.
    fn begin(&self, window: &[f64]) -> MotionState {
        let parts = self.modes.iter().map(|mode| mode.at(self.gain * window[1]));
        self.whole(
            parts,
            window[1],
            (window[2] - window[0]) / (2.0 * self.step_s),
        )
    }

    /// Sum over all modes and the compliance above the band.
    fn whole(&self, parts: impl Iterator<Item = MotionState>, u: f64, slope: f64) -> MotionState {
        let direct = MotionState {
            x: self.direct * u,
            speed: self.direct * slope,
        };
        parts.fold(direct, |sum, part| MotionState {
            x: sum.x + part.x,
            speed: sum.speed + part.speed,
        })
    }

    fn kick(&mut self, moved: MotionState, change: f64) -> MotionState {
        let kicked = kicked(&mut self.acting, moved, self.shift, change, self.impulse);
        if kicked.speed != moved.speed {
            let each = (kicked.speed - moved.speed) * self.step_s / self.impulse;
            for mode in &mut self.modes {
                mode.motion.pushed.speed += each * mode.pushed_by();
            }
        }
        kicked
    }

    /// Applies dry friction over the step.
    fn rub(&mut self, mut moved: MotionState) -> MotionState {
        if self.dry == 0.0 {
            return moved;
        }
        let stops: f64 = self
            .modes
            .iter()
            .map(|mode| -mode.at_gage * mode.free[2])
            .sum();
        let friction = (moved.speed / stops).clamp(-self.dry, self.dry);
        for mode in &mut self.modes {
            let [a, _, c, _] = mode.free;
            let (x, speed) = (
                -mode.at_gage * friction * (1.0 - a),
                mode.at_gage * friction * c,
            );
            mode.motion.pushed.x += x;
            mode.motion.pushed.speed += speed;
            moved.x += x;
            moved.speed += speed;
        }
        moved
    }
}
