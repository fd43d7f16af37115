//! The motion of a stand with several modes, node by node.
//!
//! ```text
//! x = Σ (r_k y_k + q_k y_k'/ω_k) + c G u + Σ z_k
//! y_k'' + 2ζ_k ω_k y_k' + ω_k² y_k = ω_k² G u,   z_k'' + 2ζ_k ω_k z_k' + ω_k² z_k = −ω_k² g_k n(x, x')
//! ```
//!
//! `y_k` is driven by the input and `z_k` by the torques `n` at the gage. One state per mode has both:
//! `v_k = r_k y_k + q_k y_k'/ω_k + z_k` and `v_k' − q_k ω_k G u`. With the free motion `e^{Bt}` of `(y_k, y_k')` it is
//! `(r_k + q_k B/ω_k) (y_k, y_k') + (z_k, z_k')`, and that factor commutes with `e^{Bt}`, so that the state moves like
//! both between the nodes, exactly; `q_k ω_k G u` needs no state and is added at the nodes. A torque changes the speed of
//! the gage at a node, and that of each `z_k` by its contribution `ω_k² g_k`. Sharp dry friction is constant over a step:
//! as much as stops the gage at its end, but no more than its magnitude (J. J. Moreau, *Numerical aspects of the sweeping
//! process*, Comput. Methods Appl. Mech. Eng. 177 (1999), 329).

use super::input::Excitation;
use super::integrate::{LinearStep, MotionState, at_gage};
use super::run::{Acting, MotionProgress, kicked, remembered, shown};
use super::side_by_side::{OngoingMotion, Stepped};
use crate::modal::{ModalPart, ModalResponse};

/// Initial states of the modes of a stand: the mode with the largest static contribution has all of the motion. Empty
/// for a stand with one mode.
pub(super) fn begin(stand: &ModalResponse, start: MotionState) -> Vec<MotionState> {
    if stand.only().is_some() {
        return Vec::new();
    }
    let mut modes = vec![MotionState::default(); stand.parts().len()];
    let parts = stand.parts().iter().enumerate();
    let largest = parts.max_by(|a, b| a.1.residue.abs().total_cmp(&b.1.residue.abs()));
    if let Some((place, part)) = largest.filter(|(_, part)| part.residue != 0.0) {
        let driven = MotionState {
            x: start.x / part.residue,
            speed: start.speed / part.residue,
        };
        modes[place] = at_gage(part, driven);
    }
    modes
}

/// A mode with its integration step.
struct SteppedMode {
    step: LinearStep,
    /// The response to a torque at the gage, with residue `g`; 0 where no torque acts.
    of_torque: ModalPart,
    /// Its change when a torque changes the speed of the gage by 1: for the speed, `ω² g/Σ ω² g`.
    pushed_by: MotionState,
    /// `v`, and `v'` without `q ω G u` and without the last change of the gage's speed.
    motion: MotionState,
}

impl SteppedMode {
    /// The motion after the last change of the gage's speed.
    fn pushed(&self, change: f64) -> MotionState {
        MotionState {
            x: self.motion.x + change * self.pushed_by.x,
            speed: self.motion.speed + change * self.pushed_by.speed,
        }
    }

    /// What a torque that is constant over the step adds to the motion.
    fn held(&self, torque: f64) -> MotionState {
        let [x, speed] = self.step.held(torque);
        at_gage(&self.of_torque, MotionState { x, speed })
    }
}

/// Integration state of a stand with several modes.
pub(super) struct ModalIntegrator<'a> {
    modes: Vec<SteppedMode>,
    /// `c G`.
    direct: f64,
    /// `Σ q_k ω_k G`: the gage's speed per input.
    direct_speed: f64,
    shift: f64,
    /// Nodes per second, halved.
    half_rate_hz: f64,
    /// Change of the gage's speed at a node by a unit torque.
    impulse: f64,
    /// Change of the gage's speed at the last node, which the modes take at the next step.
    change: f64,
    acting: Acting<'a>,
    /// Magnitude of the sharp dry friction, and what a unit of it takes off the gage's speed in a step.
    dry: f64,
    stops: f64,
}

impl<'a> Stepped<'a> for ModalIntegrator<'a> {
    fn resume(
        motion: &OngoingMotion<'a>,
        input: &Excitation,
        window: &[f64],
    ) -> (Self, MotionState) {
        let (gain, step_s) = (motion.gain, input.step_s());
        let stepped = |(part, at): (&ModalPart, &MotionState)| {
            let of_torque = part.of_torque();
            let blow = MotionState {
                x: 0.0,
                speed: part.mode.omega_rad_s.powi(2),
            };
            SteppedMode {
                step: LinearStep::new(&part.mode, gain, step_s, input.between()).at_gage(part),
                of_torque,
                pushed_by: at_gage(&of_torque, blow),
                motion: *at,
            }
        };
        let parts = motion.stand.parts().iter();
        let mut modes: Vec<SteppedMode> = parts.zip(&motion.progress.modes).map(stepped).collect();
        let acceleration: f64 = modes.iter().map(|mode| mode.pushed_by.speed).sum();
        // Without a shape at the gage no torque acts.
        if acceleration != 0.0 {
            for mode in &mut modes {
                mode.pushed_by.x /= acceleration;
                mode.pushed_by.speed /= acceleration;
            }
        }
        let turned = |part: &ModalPart| part.quadrature * part.mode.omega_rad_s;
        let memories = motion.progress.memories.iter().copied();
        let run = Self {
            impulse: step_s * acceleration,
            stops: modes.iter().map(|mode| mode.held(1.0).speed).sum(),
            modes,
            direct: motion.stand.residual() * gain,
            direct_speed: gain * motion.stand.parts().iter().map(turned).sum::<f64>(),
            shift: motion.shift,
            half_rate_hz: 0.5 / step_s,
            change: 0.0,
            acting: motion.torques.iter().copied().zip(memories).collect(),
            dry: motion.torques.iter().filter_map(|(t, _)| t.dry()).sum(),
        };
        let state = run
            .modes
            .iter()
            .fold(run.direct(&window[..3]), |sum, mode| MotionState {
                x: sum.x + mode.motion.x,
                speed: sum.speed + mode.motion.speed,
            });
        (run, state)
    }

    /// Advances by a step and applies the torques at its end.
    fn step(&mut self, state: MotionState, window: &[f64]) -> MotionState {
        let mut moved = self.direct(&window[1..]);
        for mode in &mut self.modes {
            mode.motion = mode.step.advance(mode.pushed(self.change), window);
            moved.x += mode.motion.x;
            moved.speed += mode.motion.speed;
        }
        let kicked = self.kick(moved, moved.speed - state.speed);
        self.rub(kicked)
    }

    fn shown(&mut self, state: MotionState) -> f64 {
        state.x + shown(&mut self.acting, state, self.shift)
    }

    fn end(self, _: MotionState) -> MotionProgress {
        MotionProgress::of_modes(
            remembered(&self.acting),
            self.modes
                .iter()
                .map(|mode| mode.pushed(self.change))
                .collect(),
        )
    }
}

impl ModalIntegrator<'_> {
    /// Displacement and speed of the gage at the middle one of three nodes without the motion of the modes: the compliance
    /// above the band, and `q ω G u`.
    fn direct(&self, nodes: &[f64]) -> MotionState {
        let slope = (nodes[2] - nodes[0]) * self.half_rate_hz;
        MotionState {
            x: self.direct * nodes[1],
            speed: self.direct * slope + self.direct_speed * nodes[1],
        }
    }

    fn kick(&mut self, moved: MotionState, change: f64) -> MotionState {
        let kicked = kicked(&mut self.acting, moved, self.shift, change, self.impulse);
        self.change = kicked.speed - moved.speed;
        kicked
    }

    /// Applies dry friction over the step.
    fn rub(&mut self, mut moved: MotionState) -> MotionState {
        if self.dry == 0.0 {
            return moved;
        }
        let friction = (moved.speed / self.stops).clamp(-self.dry, self.dry);
        for mode in &mut self.modes {
            let held = mode.held(-friction);
            mode.motion.x += held.x;
            mode.motion.speed += held.speed;
            moved.x += held.x;
            moved.speed += held.speed;
        }
        moved
    }
}
