//! Anti-alias filter before a recorder, the same on both channels: Butterworth of second or fourth order.

use std::f64::consts::{FRAC_PI_8, SQRT_2, TAU};

use super::excitation::Input;
use super::integrate::Dense;

/// Value and derivative of each section.
type State = [[f64; 2]; 2];

/// Sections `y'' = w² (u − y) − d w y'` in series.
#[derive(Debug, Clone, Copy)]
pub struct AntiAlias {
    /// 2 or 4.
    pub order: usize,
    /// −3 dB corner.
    pub corner_hz: f64,
}

impl AntiAlias {
    /// Twice the damping ratio of each section.
    fn losses(&self) -> [f64; 2] {
        match self.order {
            2 => [SQRT_2, SQRT_2],
            _ => [2.0 * FRAC_PI_8.cos(), 2.0 * FRAC_PI_8.sin()],
        }
    }

    fn rates(&self, torque: f64, state: &State) -> State {
        let w = TAU * self.corner_hz;
        let mut comes = torque;
        let mut rates = [[0.0; 2]; 2];
        for ((rate, [y, slope]), loss) in rates.iter_mut().zip(state).zip(self.losses()) {
            *rate = [*slope, w * (w * (comes - y) - loss * slope)];
            comes = *y;
        }
        rates
    }

    /// One step of the classical Runge–Kutta method, with the input at its start, middle and end.
    fn advance(&self, state: &mut State, h: f64, [u0, u1, u2]: [f64; 3]) {
        let moved = |by: f64, rates: &State| {
            let mut other = *state;
            for (section, rate) in other.iter_mut().zip(rates) {
                section[0] += by * rate[0];
                section[1] += by * rate[1];
            }
            other
        };
        let k1 = self.rates(u0, state);
        let k2 = self.rates(u1, &moved(h / 2.0, &k1));
        let k3 = self.rates(u1, &moved(h / 2.0, &k2));
        let k4 = self.rates(u2, &moved(h, &k3));
        for i in 0..2 {
            for j in 0..2 {
                state[i][j] += h / 6.0 * (k1[i][j] + 2.0 * (k2[i][j] + k3[i][j]) + k4[i][j]);
            }
        }
    }

    /// The section whose output is recorded.
    fn last(&self) -> usize {
        self.order / 2 - 1
    }

    /// Value and two derivatives of the filtered torque at the start and the end of each piece, from rest.
    pub fn nodes(&self, input: &Input, pieces: usize) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
        const STEPS: usize = 4;
        let mut state = State::default();
        let shown = |torque: f64, state: &State| {
            let [value, slope] = state[self.last()];
            [value, slope, self.rates(torque, state)[self.last()][1]]
        };
        let (mut nodes, mut ends) = (Vec::new(), Vec::new());
        let part = 1.0 / STEPS as f64;
        for node in 0..pieces {
            nodes.push(shown(input.between(node, 0.0), &state));
            for step in 0..STEPS {
                let from = step as f64 * part;
                let comes = [from, from + part / 2.0, from + part];
                let comes = comes.map(|at| input.between(node, at));
                self.advance(&mut state, part * input.step_s, comes);
            }
            ends.push(shown(input.between(node, 1.0), &state));
        }
        nodes.extend(ends.last().copied());
        (nodes, ends)
    }

    /// The filtered signal, from rest; between points a polynomial through four of them.
    pub fn signal(&self, mut dense: Dense) -> Dense {
        let comes = dense.values.clone();
        let at = |point: usize| comes[point.min(comes.len() - 1)];
        let mut state = State::default();
        for (point, value) in dense.values.iter_mut().enumerate() {
            *value = state[self.last()][0];
            let (u0, u2) = (at(point), at(point + 1));
            let middle = (9.0 * (u0 + u2) - at(point.saturating_sub(1)) - at(point + 2)) / 16.0;
            self.advance(&mut state, dense.step_s, [u0, middle, u2]);
        }
        dense
    }
}
