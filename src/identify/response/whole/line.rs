//! The equation of one line, and its derivatives with respect to all parameters.

use num_complex::Complex64;

use super::super::{Data, Modal};
use super::Spectra;
use super::normal::Solved;
use crate::identify::Pole;

/// Degree of the smooth part of the transient.
const DEGREE: usize = 3;

/// Order of the parameters: first those of a record's transient (residues, then the smooth part, with alternating real
/// and imaginary parts), then the shared ones (σ and ω of each mode, the delay, the linear parameters of the response);
/// the residual comes last.
pub(super) struct Parameters<'a> {
    shape: &'a Data,
    /// Number of modes.
    pub modes: usize,
    band_rad_per_s: (f64, f64),
}

/// Values of all parameters.
#[derive(Clone)]
pub(super) struct ParameterValues {
    /// Modes.
    pub poles: Vec<Pole>,
    /// Delay in s.
    pub delay_s: f64,
    /// Residues, c₁ and c₂ of the response.
    pub linear: Vec<f64>,
    /// Parameters of each record's transient.
    pub transients: Vec<Vec<f64>>,
}

impl ParameterValues {
    /// Start values: the averaged response, without transients.
    pub fn start(layout: &Parameters, modal: &Modal, records: usize) -> Self {
        let linear = &modal.linear()[..2 * layout.modes + layout.shape.outside()];
        let start = |(j, value): (usize, &f64)| match layout.shape.is_zero(j, layout.modes) {
            true => 0.0,
            false => *value,
        };
        Self {
            poles: modal.poles.clone(),
            delay_s: modal.delay_s,
            linear: linear.iter().enumerate().map(start).collect(),
            transients: vec![vec![0.0; layout.own()]; records],
        }
    }
}

impl<'a> Parameters<'a> {
    pub fn of(shape: &'a Data, modes: usize) -> Self {
        let band_rad_per_s = shape.band_rad_per_s();
        Self {
            shape,
            modes,
            band_rad_per_s,
        }
    }

    /// Number of parameters of a record's transient.
    pub fn own(&self) -> usize {
        2 * self.modes + 2 * (DEGREE + 1)
    }

    /// Number of poles' parameters and delay.
    pub fn searched(&self) -> usize {
        2 * self.modes + usize::from(self.shape.lag.is_some())
    }

    /// Number of shared parameters.
    pub fn shared(&self) -> usize {
        self.searched() + 2 * self.modes + self.shape.outside()
    }

    /// Indices of the shared parameters that are fitted, and not zero.
    pub fn free(&self) -> Vec<usize> {
        let from = self.searched();
        let is_free = |i: &usize| *i < from || !self.shape.is_zero(*i - from, self.modes);
        (0..self.shared()).filter(is_free).collect()
    }

    /// Number of parameters of a record, including shared ones.
    pub fn columns(&self) -> usize {
        self.own() + self.shared()
    }

    /// Legendre polynomials at a frequency in the band.
    fn smooth(&self, omega: f64) -> [f64; DEGREE + 1] {
        let (low, high) = self.band_rad_per_s;
        let x = (2.0 * omega - low - high) / (high - low);
        let mut all = [1.0; DEGREE + 1];
        all[1] = x;
        for l in 1..DEGREE {
            let n = l as f64;
            all[l + 1] = ((2.0 * n + 1.0) * x * all[l] - n * all[l - 1]) / (n + 1.0);
        }
        all
    }

    /// The residual of a line.
    pub fn left(
        &self,
        spectra: &Spectra,
        state: &ParameterValues,
        record: usize,
        k: usize,
    ) -> Complex64 {
        let omega = spectra.omega[k];
        let own = &state.transients[record];
        let s = Complex64::new(0.0, omega / self.shape.scale());
        let mut transient = self.resonances(s, own, state);
        let far = 2 * self.modes;
        for (l, p) in self.smooth(omega).iter().enumerate() {
            transient += Complex64::new(own[far + 2 * l], own[far + 2 * l + 1]) * p;
        }
        spectra.measured[k] - self.response(omega, state) * spectra.applied[k] - transient
    }

    /// H at an angular frequency.
    pub fn response(&self, omega: f64, state: &ParameterValues) -> Complex64 {
        let (front, s) = self.shape.front(omega, state.delay_s, self.shape.scale());
        let far = 2 * self.modes;
        let below = state.linear.get(far + 1).map(|c| c / (s * s));
        let outside = state.linear[far] + below.unwrap_or_default();
        front * (self.resonances(s, &state.linear, state) + outside)
    }

    /// Σ R/(s − p) + R̄/(s − p̄) for residues R.
    fn resonances(&self, s: Complex64, residues: &[f64], state: &ParameterValues) -> Complex64 {
        let of = |(j, pole): (usize, &Pole)| {
            let (near, mirrored) = self.shape.fractions(s, *pole, self.shape.scale());
            let residue = Complex64::new(residues[2 * j], residues[2 * j + 1]);
            residue * near + residue.conj() * mirrored
        };
        state.poles.iter().enumerate().map(of).sum()
    }

    /// Derivatives of the model at a line, then the residual.
    pub fn fill(
        &self,
        spectra: &Spectra,
        state: &ParameterValues,
        record: usize,
        k: usize,
        out: &mut [Complex64],
    ) {
        let omega = spectra.omega[k];
        let scale = self.shape.scale();
        let (front, s) = self.shape.front(omega, state.delay_s, scale);
        let front = front * spectra.applied[k];
        let (linear, own) = (&state.linear, &state.transients[record]);
        let (n, searched) = (2 * self.modes, self.own());
        let from = searched + self.searched();
        let far = front / (s * s);
        let mut driven = front * linear[n];
        if let Some(below) = linear.get(n + 1) {
            driven += far * below;
        }
        let mut transient = Complex64::ZERO;
        for (j, pole) in state.poles.iter().enumerate() {
            let (near, mirrored) = self.shape.fractions(s, *pole, scale);
            let (even, odd) = (near + mirrored, Complex64::I * (near - mirrored));
            let (a, b) = (2 * j, 2 * j + 1);
            (out[a], out[b]) = (even, odd);
            (out[from + a], out[from + b]) = (front * even, front * odd);
            driven += out[from + a] * linear[a] + out[from + b] * linear[b];
            transient += even * own[a] + odd * own[b];
            // Both the response and the transient depend on the pole: dp = (−dσ + j dω)/scale.
            let residue = |v: &[f64]| Complex64::new(v[a], v[b]);
            let (r, t) = (residue(linear), residue(own));
            let of_near = (front * r + t) * (near * near) / scale;
            let of_mirrored = (front * r.conj() + t.conj()) * (mirrored * mirrored) / scale;
            out[searched + a] = -(of_near + of_mirrored);
            out[searched + b] = Complex64::I * (of_near - of_mirrored);
        }
        for (l, p) in self.smooth(omega).iter().enumerate() {
            let (a, b) = (n + 2 * l, n + 2 * l + 1);
            (out[a], out[b]) = (Complex64::new(*p, 0.0), Complex64::new(0.0, *p));
            transient += Complex64::new(own[a], own[b]) * p;
        }
        if let Some(lag) = self.shape.lag {
            out[searched + n] = lag.slope(s * scale, state.delay_s) * driven;
        }
        out[from + n] = front;
        if self.shape.below {
            out[from + n + 1] = far;
        }
        out[self.columns()] = spectra.measured[k] - driven - transient;
    }
}

impl Solved {
    /// The parameters after a fraction of the step.
    pub fn moved(
        &self,
        layout: &Parameters,
        state: &ParameterValues,
        part: f64,
    ) -> ParameterValues {
        let mut next = state.clone();
        let n = 2 * layout.modes;
        for (j, pole) in next.poles.iter_mut().enumerate() {
            pole.rate_per_s += part * self.step[2 * j];
            pole.omega_rad_per_s += part * self.step[2 * j + 1];
        }
        if layout.shape.lag.is_some() {
            next.delay_s += part * self.step[n];
        }
        let from = layout.searched();
        for (number, step) in next.linear.iter_mut().zip(&self.step.as_slice()[from..]) {
            *number += part * step;
        }
        for (own, steps) in next.transients.iter_mut().zip(&self.own) {
            for (number, step) in own.iter_mut().zip(steps.iter()) {
                *number += part * step;
            }
        }
        next
    }

    /// Standard uncertainty of the delay, if there is one.
    pub fn delay_std(&self, layout: &Parameters) -> Option<f64> {
        let at = 2 * layout.modes;
        layout.shape.lag.map(|_| self.covariance[(at, at)].sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::modal::Lag;
    use super::*;
    use torqcomp_dsp::recorder::Recorder;

    fn shape(order: i32) -> Data {
        Data {
            omega: vec![100.0, 150.0, 200.0],
            response: vec![Complex64::ONE; 3],
            weight: vec![1.0; 3],
            order,
            added_rate: 0.0,
            lag: Some(Lag::Delay),
            recorder: None,
            below: true,
        }
    }

    fn pole(rate_per_s: f64, omega_rad_per_s: f64) -> Pole {
        Pole {
            rate_per_s,
            omega_rad_per_s,
        }
    }

    /// Every derivative against a finite difference of the residual.
    #[test]
    fn derivatives_are_those_of_the_equation() {
        let spectra = Spectra {
            omega: vec![137.0],
            applied: vec![Complex64::new(0.7, -1.9)],
            measured: vec![Complex64::new(2.0, 0.4)],
            weight: vec![1.0],
        };
        for order in 0..3 {
            let shape = Data {
                lag: Some([Lag::Delay, Lag::LowPass, Lag::Delay][order as usize]),
                recorder: Recorder::new(1.0, None, 1e-3).ok().filter(|_| order == 2),
                ..shape(order)
            };
            let layout = Parameters::of(&shape, 2);
            let number = |i: usize| ((i * i + 3) as f64 * 0.7).sin();
            let state = ParameterValues {
                poles: vec![pole(4.0, 130.0), pole(9.0, 180.0)],
                delay_s: 2e-3,
                linear: (0..6).map(number).collect(),
                transients: vec![(9..9 + layout.own()).map(number).collect()],
            };
            let mut filled = vec![Complex64::ZERO; layout.columns() + 1];
            layout.fill(&spectra, &state, 0, 0, &mut filled);
            let left = layout.left(&spectra, &state, 0, 0);
            assert!((filled[layout.columns()] - left).norm() < 1e-12);
            for (i, slope) in filled[..layout.columns()].iter().enumerate() {
                let h = if i == layout.own() + 4 { 1e-8 } else { 1e-5 };
                let at = |h: f64| layout.left(&spectra, &stepped(&layout, &state, i, h), 0, 0);
                let want = -(at(h) - at(-h)) / (2.0 * h);
                let off = (slope - want).norm() / want.norm();
                assert!(off < 1e-6, "order {order}, number {i}: {slope} {want}");
            }
        }
    }

    /// The parameters after a step of one of them.
    fn stepped(layout: &Parameters, state: &ParameterValues, i: usize, by: f64) -> ParameterValues {
        let (own, shared) = (layout.own(), layout.shared());
        let mut solved = Solved {
            step: nalgebra::DVector::zeros(shared),
            own: vec![nalgebra::DVector::zeros(own)],
            covariance: nalgebra::DMatrix::zeros(shared, shared),
        };
        match i < own {
            true => solved.own[0][i] = by,
            false => solved.step[i - own] = by,
        }
        solved.moved(layout, state, 1.0)
    }
}
