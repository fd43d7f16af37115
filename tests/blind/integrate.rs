//! Time integration: the classical fourth-order Runge–Kutta method at 32 steps per sample, with
//! switches located inside a step.

use super::excitation::{FINER, Input};

/// Maximum number of states of a system.
pub const STATES: usize = 28;
/// States of a system; the first two are angle (rad) and speed (rad/s) of the stator.
pub type State = [f64; STATES];
/// Steps per node of the input's grid.
const STEPS: usize = 4;
/// Steps per sample.
pub const DENSE: usize = STEPS * FINER;
/// Number of switches within one step after which the remainder is taken without locating further
/// ones.
const SWITCHES: usize = 12;

/// A system of ordinary differential equations, smooth within each of its modes.
pub trait Dynamics {
    /// Number of states used.
    fn states(&self) -> usize {
        2
    }

    /// Derivatives of the states.
    fn rates(&self, mode: i8, time_s: f64, torque: f64, state: &State, rates: &mut State);

    /// Torque shown by the gage.
    fn shown(&self, mode: i8, time_s: f64, torque: f64, state: &State) -> f64;

    /// Mode at the start.
    fn first_mode(&self, _torque: f64) -> i8 {
        0
    }

    /// Negative when the mode has ended.
    fn guard(&self, _mode: i8, _torque: f64, _state: &State) -> f64 {
        1.0
    }

    /// The mode after the guard has reached zero.
    fn next_mode(&self, mode: i8, _torque: f64, _state: &mut State) -> i8 {
        mode
    }
}

/// A signal on the dense grid, 32 points a sample.
#[derive(Debug, Clone)]
pub struct Dense {
    /// Points before the record begins.
    pub before: usize,
    /// Samples of the record.
    pub samples: usize,
    /// Time between points.
    pub step_s: f64,
    pub values: Vec<f64>,
}

impl Dense {
    /// The signal at the samples, `later_s` after their times.
    pub fn samples(&self) -> Vec<f64> {
        (0..self.samples)
            .map(|sample| self.values[self.before + sample * DENSE])
            .collect()
    }

    /// The signal at any time, interpolated through the six surrounding points; constant before the
    /// first.
    pub fn at(&self, time_s: f64) -> f64 {
        let position = time_s / self.step_s + self.before as f64;
        let base = position.floor();
        let part = position - base;
        let mut sum = 0.0;
        for i in -2_i32..=3 {
            let mut weight = 1.0;
            for j in (-2_i32..=3).filter(|j| *j != i) {
                weight *= (part - f64::from(j)) / f64::from(i - j);
            }
            let index = (base + f64::from(i)).clamp(0.0, (self.values.len() - 1) as f64);
            sum += weight * self.values[index as usize];
        }
        sum
    }
}

/// Integrates from rest over the whole input.
pub fn run(system: &dyn Dynamics, input: &Input) -> Dense {
    let nodes = input.before + input.samples * FINER + 4 * FINER;
    let mut values = Vec::with_capacity(nodes * STEPS);
    let mut walk = Walk {
        system,
        input,
        state: [0.0; STATES],
        mode: system.first_mode(input.between(0, 0.0)),
        moved: [0.0; STATES],
        rates: [[0.0; STATES]; 4],
    };
    for node in 0..nodes {
        for step in 0..STEPS {
            let part = step as f64 / STEPS as f64;
            let time_s = input.time_s(node) + part * input.step_s;
            let torque = input.between(node, part);
            values.push(system.shown(walk.mode, time_s, torque, &walk.state));
            walk.step(node, part);
        }
    }
    Dense {
        before: input.before * STEPS,
        samples: input.samples,
        step_s: input.step_s / STEPS as f64,
        values,
    }
}

/// State of the integration.
struct Walk<'a> {
    system: &'a dyn Dynamics,
    input: &'a Input,
    state: State,
    mode: i8,
    /// State and rates at the four stages of a step.
    moved: State,
    rates: [State; 4],
}

impl Walk<'_> {
    /// One step, divided at the switches within it.
    fn step(&mut self, node: usize, part: f64) {
        let (mut from, to) = (part, part + 1.0 / STEPS as f64);
        for _ in 0..SWITCHES {
            let next = self.runge_kutta(node, from, to);
            if self.guard(node, to, &next) >= 0.0 {
                self.state = next;
                return;
            }
            let (at, mut state) = self.switch(node, from, to);
            let torque = self.input.between(node, at);
            self.mode = self.system.next_mode(self.mode, torque, &mut state);
            self.state = state;
            from = at;
        }
        self.state = self.runge_kutta(node, from, to);
    }

    fn guard(&self, node: usize, part: f64, state: &State) -> f64 {
        let torque = self.input.between(node, part);
        self.system.guard(self.mode, torque, state)
    }

    /// Position within the step where the guard turns negative, and the state there, by bisection.
    fn switch(&mut self, node: usize, from: f64, to: f64) -> (f64, State) {
        let (mut low, mut high) = (from, to);
        for _ in 0..44 {
            let middle = 0.5 * (low + high);
            let state = self.runge_kutta(node, from, middle);
            if self.guard(node, middle, &state) >= 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        (high, self.runge_kutta(node, from, high))
    }

    /// Only the states in use are touched: copies of all of them take longer than everything else.
    fn runge_kutta(&mut self, node: usize, from: f64, to: f64) -> State {
        let count = self.system.states();
        let (h, start_s) = ((to - from) * self.input.step_s, self.input.time_s(node));
        let middle = 0.5 * (from + to);
        let [u0, u1, u2] = [from, middle, to].map(|part| self.input.between(node, part));
        let stages = [
            (from, 0.0, u0),
            (middle, 0.5, u1),
            (middle, 0.5, u1),
            (to, 1.0, u2),
        ];
        for (k, (part, share, torque)) in stages.into_iter().enumerate() {
            for i in 0..count {
                let last = if k == 0 { 0.0 } else { self.rates[k - 1][i] };
                self.moved[i] = self.state[i] + share * h * last;
            }
            let rates = &mut self.rates[k];
            rates[..count].fill(0.0);
            let time_s = start_s + part * self.input.step_s;
            self.system
                .rates(self.mode, time_s, torque, &self.moved, rates);
        }
        let [k1, k2, k3, k4] = &self.rates;
        let mut state = self.state;
        for i in 0..count {
            state[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
        state
    }
}
