//! Motion with the torques of the stand, node by node.

use super::input::Excitation;
use super::integrate::{LinearStep, MotionState, free};
use super::modes;
use super::side_by_side::{OngoingMotion, Stepped};
use crate::effects::{Memory, Mode, Torque};
use crate::modal::ModalResponse;

/// Torques in the stand, each with a flag for whether the gage shows it.
pub(crate) type Torques<'a> = Vec<(&'a dyn Torque, bool)>;

/// Integration state of a stand with one mode.
pub(super) struct Integrator<'a> {
    mode: Mode,
    gain: f64,
    step: LinearStep,
    step_s: f64,
    /// Change of speed at a node by a unit torque.
    impulse: f64,
    /// Torques at the nodes except sharp dry friction, with their memory.
    acting: Acting<'a>,
    /// Displacement under a constant load.
    shift: f64,
    /// Sharp dry friction, and the direction of sliding: 0 while it sticks.
    dry: f64,
    direction: f64,
}

/// State of a motion: with the input, it determines all that follows.
#[derive(Debug, Clone)]
pub(crate) struct MotionProgress {
    state: MotionState,
    pub(super) memories: Vec<Memory>,
    direction: f64,
    /// State of each mode, if there are several.
    pub(super) modes: Vec<MotionState>,
}

impl MotionProgress {
    /// The state of a stand with several modes.
    pub(super) fn of_modes(memories: Vec<Memory>, modes: Vec<MotionState>) -> Self {
        Self {
            state: MotionState::default(),
            memories,
            direction: 0.0,
            modes,
        }
    }

    /// Initial state of a motion. A constant load, which is not in the input, shifts the displacement seen by the
    /// torques.
    pub(crate) fn begin(
        torques: &Torques<'_>,
        (stand, start): (&ModalResponse, MotionState),
        shift: f64,
    ) -> Self {
        Self {
            state: start,
            memories: torques
                .iter()
                .map(|(torque, _)| torque.begin(start.x + shift))
                .collect(),
            direction: match start.speed == 0.0 {
                true => 0.0,
                false => start.speed.signum(),
            },
            modes: modes::begin(stand, start),
        }
    }
}

/// The active torques, whether the gage shows them, and their memory.
pub(super) type Acting<'a> = Vec<((&'a dyn Torque, bool), Memory)>;

/// Current memory of the torques.
pub(super) fn remembered(acting: &Acting<'_>) -> Vec<Memory> {
    acting.iter().map(|(_, memory)| *memory).collect()
}

/// State at a node after the torques have acted: each changes the speed by its value times `impulse`; `change` is the
/// change of speed over the step.
#[inline]
pub(super) fn kicked(
    acting: &mut Acting<'_>,
    moved: MotionState,
    shift: f64,
    change: f64,
    impulse: f64,
) -> MotionState {
    let mut speed = moved.speed;
    for ((torque, _), memory) in acting {
        speed = torque.kick(memory, moved.x + shift, speed, change, impulse);
    }
    MotionState { x: moved.x, speed }
}

/// Torques that the gage shows in addition to the displacement.
pub(super) fn shown(acting: &mut Acting<'_>, state: MotionState, shift: f64) -> f64 {
    let shown = acting.iter_mut().filter(|((_, shown), _)| *shown);
    shown
        .map(|((torque, _), memory)| torque.value(memory, state.x + shift, state.speed))
        .sum()
}

impl<'a> Stepped<'a> for Integrator<'a> {
    fn resume(motion: &OngoingMotion<'a>, input: &Excitation, _: &[f64]) -> (Self, MotionState) {
        let mode = motion.stand.first();
        let step_s = input.step_s();
        let memories = motion.progress.memories.iter().copied();
        let run = Self {
            mode,
            gain: motion.gain,
            step: LinearStep::new(&mode, motion.gain, step_s, input.between()),
            step_s,
            impulse: mode.omega_rad_s * mode.omega_rad_s * step_s,
            acting: motion.torques.iter().copied().zip(memories).collect(),
            shift: motion.shift,
            dry: motion.torques.iter().filter_map(|(t, _)| t.dry()).sum(),
            direction: motion.progress.direction,
        };
        (run, motion.progress.state)
    }

    #[inline]
    fn step(&mut self, state: MotionState, window: &[f64]) -> MotionState {
        match (self.dry > 0.0, self.direction == 0.0) {
            (false, _) => self.advance(state, window),
            (true, true) => self.stick(state, window),
            (true, false) => self.slide(state, window),
        }
    }

    #[inline]
    fn shown(&mut self, state: MotionState) -> f64 {
        state.x + shown(&mut self.acting, state, self.shift)
    }

    fn end(self, state: MotionState) -> MotionProgress {
        MotionProgress {
            state,
            memories: remembered(&self.acting),
            direction: self.direction,
            modes: Vec::new(),
        }
    }
}

impl Integrator<'_> {
    /// A step without dry friction.
    #[inline]
    fn advance(&mut self, state: MotionState, window: &[f64]) -> MotionState {
        let moved = self.step.advance(state, window);
        self.kick(moved, moved.speed - state.speed)
    }

    /// Applies the torques at a node.
    #[inline]
    fn kick(&mut self, moved: MotionState, change: f64) -> MotionState {
        kicked(&mut self.acting, moved, self.shift, change, self.impulse)
    }

    /// Sum of the torques at rest, without dry friction.
    fn held(&mut self, x: f64) -> f64 {
        self.acting
            .iter_mut()
            .map(|((torque, _), memory)| torque.value(memory, x + self.shift, 0.0))
            .sum()
    }

    /// A step of a sticking stand, which is released where the rest of the torques exceeds the
    /// friction.
    fn stick(&mut self, state: MotionState, window: &[f64]) -> MotionState {
        let rest = MotionState {
            x: state.x,
            speed: 0.0,
        };
        let force = self.gain * window[2] - rest.x - self.held(rest.x);
        if force.abs() > self.dry {
            self.direction = force.signum();
        }
        rest
    }

    /// A step of a sliding stand: friction is a constant torque until the speed changes sign; there the stand
    /// sticks or slides back.
    fn slide(&mut self, state: MotionState, window: &[f64]) -> MotionState {
        let friction = -self.dry * self.direction;
        let linear = self.step.advance(state, window);
        let [x, speed] = self.step.held(friction);
        let moved = MotionState {
            x: linear.x + x,
            speed: linear.speed + speed,
        };
        let moved = self.kick(moved, moved.speed - state.speed);
        if moved.speed * self.direction > 0.0 {
            return moved;
        }
        let before = (state.speed * self.direction).max(0.0);
        let part = before / (before + moved.speed.abs()).max(f64::MIN_POSITIVE);
        let turned = state.x + 0.5 * part * self.step_s * state.speed;
        let input = self.step.input_at(window, part);
        let force = self.gain * input - turned - self.held(turned);
        let rest = MotionState {
            x: turned,
            speed: 0.0,
        };
        if force.abs() <= self.dry || force * self.direction > 0.0 {
            self.direction = 0.0;
            return rest;
        }
        // For the rest of the step friction has the opposite sign.
        let [a, _, c, _] = free(&self.mode, (1.0 - part) * self.step_s);
        let back = MotionState {
            x: moved.x - 2.0 * friction * (1.0 - a),
            speed: moved.speed + 2.0 * friction * c,
        };
        if back.speed * self.direction >= 0.0 {
            self.direction = 0.0;
            return rest;
        }
        self.direction = -self.direction;
        back
    }
}
