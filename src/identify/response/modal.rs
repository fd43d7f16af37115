//! Rational model of a frequency response: modes, residual terms, a lag and the declared recorder.
//!
//! ```text
//! H(s) = s^m [ Σ R_k/(s − p_k) + R_k*/(s − p_k*) + c_1 + c_2/s² ] e^{−sτ} L(s),   p_k = −σ_k + jω_k
//! ```
//!
//! L is the recorder of the measured channel, if declared; an RC low-pass 1/(1 + sτ) may take the place of the delay.
//! m is 0 for displacement, 1 for speed, 2 for acceleration; c_1 represents modes above the band, c_2 those below and
//! free motion. Residues and c are linear and follow from the poles, so only poles and delay are searched for (variable
//! projection: G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973), 413).
//!
//! An exponential window e^{−at} on both signals moves the whole response: H(s + a) takes the place of H(s), also in the
//! factor of the delay, e^{−(s+a)τ}.
//!
//! With a lag, the modes are normal modes, R_k = −j A_k with a real A_k (D. J. Ewins, Modal Testing, 2nd ed., 2000,
//! 2.4). Complex residues would make the delay unidentifiable: s [R/(s − p) + R*/(s − p*)] = R p/(s − p) + R* p*/(s −
//! p*) + 2 Re R, so the derivative of the model with respect to τ is a sum of its columns, and those of second order in
//! τ are as well while R is imaginary.

use std::sync::Mutex;
use torqcomp_dsp::sort_by_number;

use nalgebra::DMatrix;
use num_complex::Complex64;
use torqcomp_model::fit::{Fit, FitError, Options, Parameter, Residuals, linear, minimize};

use super::foreign::Foreign;
use crate::identify::Pole;
use torqcomp_dsp::recorder::Recorder;

/// A response at lines of a band, with weights.
#[derive(Debug, Clone)]
pub(super) struct Data {
    /// Angular frequency of each line in rad/s.
    pub omega: Vec<f64>,
    /// Response at each line.
    pub response: Vec<Complex64>,
    /// Weight of each line, about 1.
    pub weight: Vec<f64>,
    /// m.
    pub order: i32,
    /// Decay rate in 1/s that the window adds to every mode.
    pub added_rate: f64,
    /// The lag that is fitted, if any.
    pub lag: Option<Lag>,
    /// The recorder of the measured channel, as declared.
    pub recorder: Option<Recorder>,
    /// Whether c₂ is fitted: a stand on its spring has no free motion.
    pub below: bool,
}

/// How the measured channel lags by τ.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Lag {
    /// A delay, e^{−sτ}.
    #[default]
    Delay,
    /// An RC low-pass, 1/(1 + sτ), as of an amplifier.
    LowPass,
}

impl Lag {
    fn factor(self, turn: Complex64) -> Complex64 {
        match self {
            Self::Delay => (-turn).exp(),
            Self::LowPass => 1.0 / (1.0 + turn),
        }
    }

    /// Derivative of the logarithm of the factor with respect to τ, in 1/s.
    pub(super) fn slope(self, s: Complex64, lag_s: f64) -> Complex64 {
        match self {
            Self::Delay => -s,
            Self::LowPass => -s / (1.0 + s * lag_s),
        }
    }
}

/// Longest delay in half periods of the highest frequency.
const DELAY_HALF_PERIODS: f64 = 8.0;

/// Largest frequency of a mode in the search, relative to the highest fitted one.
pub(super) const ABOVE: f64 = 1.3;

/// Precision of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Effort {
    /// Sufficient to choose the number of modes.
    Coarse,
    /// Full.
    Fine,
}

/// A modal model.
#[derive(Debug, Clone)]
pub(super) struct Modal {
    /// Poles without the effect of the window.
    pub poles: Vec<Pole>,
    /// τ in s.
    pub delay_s: f64,
    /// What τ means.
    pub lag: Lag,
    /// Linear parameters: real and imaginary part of each residue, then c₁ and, if it was fitted, c₂.
    linear: Vec<f64>,
    /// Standard uncertainty of τ in s, if it was fitted and is identifiable.
    pub delay_std_s: Option<f64>,
    /// The fit of poles and delay to the averaged response.
    pub fit: Option<Fit>,
    /// Model at each line.
    pub response: Vec<Complex64>,
    /// Why a mode does not belong to the stand; `None` if it does.
    pub foreign: Vec<Option<Foreign>>,
    scale: f64,
    /// Highest fitted frequency in rad/s.
    pub highest_rad_per_s: f64,
    order: i32,
}

impl Data {
    /// Frequency scale in rad/s.
    pub(super) fn scale(&self) -> f64 {
        self.omega[self.omega.len() / 2]
    }

    /// Longest delay that is searched for, of either sign, in s.
    pub(super) fn longest_delay_s(&self) -> f64 {
        DELAY_HALF_PERIODS * std::f64::consts::PI / self.band_rad_per_s().1
    }

    /// First and last frequency, in rad/s.
    pub(super) fn band_rad_per_s(&self) -> (f64, f64) {
        (self.omega[0], self.omega[self.omega.len() - 1])
    }

    /// Number of linear parameters for modes outside the band.
    pub(super) fn outside(&self) -> usize {
        1 + usize::from(self.below)
    }

    /// Whether a linear parameter of a model with this many modes is zero: with a delay, the real part of a residue.
    pub(super) fn is_zero(&self, linear: usize, modes: usize) -> bool {
        self.lag.is_some() && linear < 2 * modes && linear.is_multiple_of(2)
    }

    /// The columns at a frequency, written to `all`; zero for parameters that are zero.
    fn columns(&self, omega: f64, poles: &[Pole], delay_s: f64, all: &mut Vec<Complex64>) {
        let scale = self.scale();
        let (front, s) = self.front(omega, delay_s, scale);
        all.clear();
        for pole in poles {
            let (near, far) = self.fractions(s, *pole, scale);
            all.push(match self.lag.is_some() {
                true => Complex64::ZERO,
                false => front * (near + far),
            });
            all.push(front * Complex64::I * (near - far));
        }
        all.push(front);
        if self.below {
            all.push(front / (s * s));
        }
    }

    /// The factor before the sum, and s, with the window's rate as its real part.
    pub(super) fn front(&self, omega: f64, delay_s: f64, scale: f64) -> (Complex64, Complex64) {
        let s = Complex64::new(self.added_rate, omega) / scale;
        let late = match delay_s == 0.0 {
            true => Complex64::ONE,
            false => self.lag.unwrap_or_default().factor(s * (scale * delay_s)),
        };
        let late = match &self.recorder {
            Some(recorder) => late * recorder.transfer(s * scale),
            None => late,
        };
        let power = match self.order {
            0 => Complex64::ONE,
            1 => s,
            order => s.powi(order),
        };
        (power * late, s)
    }

    /// 1/(s − p) and 1/(s − p*).
    pub(super) fn fractions(&self, s: Complex64, pole: Pole, scale: f64) -> (Complex64, Complex64) {
        let p = Complex64::new(-pole.rate_per_s, pole.omega_rad_per_s) / scale;
        (1.0 / (s - p), 1.0 / (s - p.conj()))
    }

    /// Linear parameters for given poles, and weighted residuals with alternating real and imaginary
    /// parts.
    pub(super) fn solve(
        &self,
        poles: &[Pole],
        delay_s: f64,
    ) -> Result<linear::LinearFit, FitError> {
        let count = 2 * poles.len() + self.outside();
        let lines = self.omega.len();
        let mut design = DMatrix::zeros(2 * lines, count);
        let mut right = vec![0.0; 2 * lines];
        let mut columns = Vec::with_capacity(count);
        for (i, omega) in self.omega.iter().enumerate() {
            let w = self.weight[i];
            self.columns(*omega, poles, delay_s, &mut columns);
            for (j, value) in columns.iter().enumerate() {
                design[(2 * i, j)] = w * value.re;
                design[(2 * i + 1, j)] = w * value.im;
            }
            right[2 * i] = w * self.response[i].re;
            right[2 * i + 1] = w * self.response[i].im;
        }
        linear::solve(&design, &right, None, false)
    }

    /// The model with given poles and delay.
    ///
    /// # Errors
    /// [`FitError`] if there are too few lines.
    pub fn with(&self, poles: &[Pole], delay_s: f64) -> Result<Modal, FitError> {
        let linear = self.solve(poles, delay_s)?.values;
        Ok(self.modal_of(poles, (delay_s, None), &linear))
    }

    /// Fits from start values of the poles and of the delay, which is fitted only together with modes.
    ///
    /// # Errors
    /// [`FitError`] if there are too few lines.
    pub fn fit(&self, starts: &[Pole], start_s: f64, effort: Effort) -> Result<Modal, FitError> {
        let parameters = match starts.is_empty() {
            true => Vec::new(),
            false => self.parameters(starts, start_s),
        };
        let problem = PoleSearch {
            data: self,
            modes: starts.len(),
            solved: Mutex::default(),
        };
        let fit = if parameters.is_empty() {
            None
        } else {
            let (tolerance, rounds) = match effort {
                Effort::Coarse => (1e-4, 12),
                Effort::Fine => (1e-10, 100),
            };
            let options = Options {
                tolerance,
                most_evaluations: 2 * rounds,
                ..Options::default()
            };
            Some(minimize(&problem, &parameters, &options)?)
        };
        let (poles, delay_s) = fit.as_ref().map_or_else(
            || (Vec::new(), 0.0),
            |f| (problem.poles(&f.values), problem.delay(&f.values)),
        );
        let linear = self.solve(&poles, delay_s)?.values;
        let delay_std_s = fit.as_ref().filter(|_| self.lag.is_some());
        let delay_std_s = delay_std_s.and_then(|f| f.std[2 * poles.len()]);
        let modal = self.modal_of(&poles, (delay_s, delay_std_s), &linear);
        Ok(Modal { fit, ..modal })
    }

    /// The model with these poles, delay (with its standard uncertainty) and linear parameters.
    pub(super) fn modal_of(
        &self,
        poles: &[Pole],
        delay_s: (f64, Option<f64>),
        linear: &[f64],
    ) -> Modal {
        let mut columns = Vec::new();
        let model = |omega: &f64| -> Complex64 {
            self.columns(*omega, poles, delay_s.0, &mut columns);
            columns.iter().zip(linear).map(|(c, v)| c * v).sum()
        };
        Modal {
            response: self.omega.iter().map(model).collect(),
            poles: poles.to_vec(),
            delay_s: delay_s.0,
            lag: self.lag.unwrap_or_default(),
            delay_std_s: delay_s.1,
            linear: linear.to_vec(),
            fit: None,
            foreign: vec![None; poles.len()],
            scale: self.scale(),
            highest_rad_per_s: self.band_rad_per_s().1,
            order: self.order,
        }
    }

    /// Poles and delay with their start values and bounds.
    fn parameters(&self, starts: &[Pole], start_s: f64) -> Vec<Parameter> {
        let (low, high) = (self.omega[0], self.omega[self.omega.len() - 1]);
        let mut parameters = Vec::new();
        for (k, pole) in starts.iter().enumerate() {
            let rate = pole.rate_per_s.max(1e-9 * high);
            parameters.push(Parameter::new(format!("rate {}", k + 1), rate).at_least(0.0));
            let omega = pole.omega_rad_per_s.clamp(0.5 * low, 1.2 * high);
            let omega = Parameter::new(format!("omega {}", k + 1), omega);
            parameters.push(omega.at_least(0.4 * low).at_most(ABOVE * high));
        }
        if self.lag.is_some() {
            let most_s = self.longest_delay_s();
            let start_s = start_s.clamp(-most_s, most_s);
            let delay = Parameter::new("delay", start_s).scaled(most_s / DELAY_HALF_PERIODS);
            let least_s = match self.lag {
                Some(Lag::LowPass) => 0.0,
                _ => -most_s,
            };
            parameters.push(delay.at_least(least_s).at_most(most_s));
        }
        parameters
    }

    /// Derivatives of the weighted model at a fit with respect to poles and delay, then to the first `linear` linear
    /// parameters, with alternating real and imaginary parts, projected off the other linear parameters.
    ///
    /// # Errors
    /// [`FitError`] if there are too few lines.
    pub fn slopes_at(&self, fitted: &Modal, linear: usize) -> Result<DMatrix<f64>, FitError> {
        let problem = PoleSearch {
            data: self,
            modes: fitted.poles.len(),
            solved: Mutex::default(),
        };
        let values = fitted.fit.as_ref().map_or(&[][..], |f| &f.values);
        let mut slopes = DMatrix::zeros(2 * self.omega.len(), values.len() + linear);
        problem.tangent(values, linear, &mut slopes)?;
        Ok(slopes)
    }
}

/// The search for poles and delay, from which the linear parameters follow.
struct PoleSearch<'a> {
    data: &'a Data,
    modes: usize,
    /// Poles and delay of the last solution, and its linear parameters, for the derivatives.
    solved: Mutex<(Vec<f64>, Vec<f64>)>,
}

impl PoleSearch<'_> {
    fn poles(&self, p: &[f64]) -> Vec<Pole> {
        Pole::all(&p[..2 * self.modes])
    }

    fn delay(&self, p: &[f64]) -> f64 {
        if self.data.lag.is_some() {
            p[2 * self.modes]
        } else {
            0.0
        }
    }

    /// Derivatives of the model with respect to σ and ω of each mode and the delay, at constant linear
    /// parameters, written to `all`.
    fn slopes(
        &self,
        omega: f64,
        (poles, delay_s): (&[Pole], f64),
        (columns, linear): (&[Complex64], &[f64]),
        all: &mut Vec<Complex64>,
    ) {
        let scale = self.data.scale();
        let (front, s) = self.data.front(omega, delay_s, scale);
        all.clear();
        for (k, pole) in poles.iter().enumerate() {
            let (near, far) = self.data.fractions(s, *pole, scale);
            let residue = Complex64::new(linear[2 * k], linear[2 * k + 1]);
            let (a, b) = (
                residue * near * near / scale,
                residue.conj() * far * far / scale,
            );
            all.push(-front * (a + b));
            all.push(front * Complex64::I * (a - b));
        }
        if let Some(lag) = self.data.lag {
            let model: Complex64 = columns.iter().zip(linear).map(|(c, v)| c * v).sum();
            all.push(lag.slope(s * scale, delay_s) * model);
        }
    }
}

impl Residuals for PoleSearch<'_> {
    fn residuals(&self, p: &[f64], out: &mut Vec<f64>) -> Result<(), FitError> {
        let solved = self.data.solve(&self.poles(p), self.delay(p))?;
        if let Ok(mut last) = self.solved.lock() {
            *last = (p.to_vec(), solved.values);
        }
        out.extend(solved.residuals);
        Ok(())
    }

    fn has_jacobian(&self) -> bool {
        true
    }

    fn jacobian(&self, p: &[f64], out: &mut DMatrix<f64>) -> Result<(), FitError> {
        self.tangent(p, 0, out)
    }
}

impl PoleSearch<'_> {
    /// The linear parameters for these poles and this delay.
    fn linear(&self, p: &[f64]) -> Result<Vec<f64>, FitError> {
        match self.solved.lock() {
            Ok(last) if last.0 == p => Ok(last.1.clone()),
            _ => Ok(self.data.solve(&self.poles(p), self.delay(p))?.values),
        }
    }

    /// The slopes and the columns of the first `kept` linear parameters, projected off the columns of the others
    /// (L. Kaufman, BIT 15 (1975), 49).
    fn tangent(&self, p: &[f64], kept: usize, out: &mut DMatrix<f64>) -> Result<(), FitError> {
        let (poles, delay_s) = (self.poles(p), self.delay(p));
        let linear = self.linear(p)?;
        let lines = self.data.omega.len();
        let mut design = DMatrix::zeros(2 * lines, linear.len() - kept);
        let (mut columns, mut slopes) = (Vec::new(), Vec::new());
        for (i, omega) in self.data.omega.iter().enumerate() {
            let w = self.data.weight[i];
            let put = |to: &mut DMatrix<f64>, j: usize, value: &Complex64| {
                to[(2 * i, j)] = w * value.re;
                to[(2 * i + 1, j)] = w * value.im;
            };
            self.data.columns(*omega, &poles, delay_s, &mut columns);
            for (j, value) in columns.iter().enumerate() {
                match j.checked_sub(kept) {
                    Some(j) => put(&mut design, j, value),
                    None => put(out, p.len() + j, value),
                }
            }
            let (at, of) = ((&poles[..], delay_s), (&columns[..], &linear[..]));
            self.slopes(*omega, at, of, &mut slopes);
            for (j, value) in slopes.iter().enumerate() {
                put(out, j, value);
            }
        }
        for mut column in design.column_iter_mut() {
            let size = column.norm();
            if size > 0.0 {
                column.unscale_mut(size);
            }
        }
        // A column of zeros would give an arbitrary one of Q.
        let modes = poles.len();
        let free = (0..design.ncols()).filter(|j| !self.data.is_zero(j + kept, modes));
        let design = design.select_columns(&free.collect::<Vec<usize>>());
        if design.ncols() > 0 {
            let q = design.qr().q();
            let made_up = &q * q.tr_mul(out);
            *out -= made_up;
        }
        Ok(())
    }
}

impl Modal {
    /// Real and imaginary part of each residue, then c₁ and, if it was fitted, c₂.
    pub(super) fn linear(&self) -> &[f64] {
        &self.linear
    }

    /// R of a mode, in the units of the response times s^(m−1), and the scale of its linear parameters.
    pub fn residue(&self, k: usize) -> (Complex64, f64) {
        let unit = self.scale.powi(1 - self.order);
        let residue = Complex64::new(self.linear[2 * k], self.linear[2 * k + 1]);
        (residue * unit, unit)
    }

    /// A pole and its residue, in the units of the linear parameters.
    pub(super) fn pole_and_residue(&self, k: usize) -> (Complex64, Complex64) {
        let pole = self.poles[k];
        let p = Complex64::new(-pole.rate_per_s, pole.omega_rad_per_s) / self.scale;
        (
            p,
            Complex64::new(self.linear[2 * k], self.linear[2 * k + 1]),
        )
    }

    /// Phase of the strongest mode's residue, in rad, and its ω.
    pub(super) fn strongest_turn(&self) -> Option<(f64, f64)> {
        let size = |k: &usize| self.pole_and_residue(*k).1.norm() / self.poles[*k].rate_per_s;
        let strongest = (0..self.poles.len()).max_by(|a, b| size(a).total_cmp(&size(b)))?;
        let turn = self.pole_and_residue(strongest).1.arg();
        Some((turn, self.poles[strongest].omega_rad_per_s))
    }

    /// Indices of the modes of the stand, in ascending order of frequency.
    pub(super) fn of_stand(&self) -> Vec<usize> {
        let mut places: Vec<usize> = (0..self.poles.len())
            .filter(|k| self.foreign[*k].is_none())
            .collect();
        sort_by_number(&mut places, |k| self.poles[*k].omega_rad_per_s);
        places
    }

    /// Derivatives of the static response `Σ 2 Re(−R/p) + c₁` of the stand with respect to σ and ω of each mode, and
    /// to the linear parameters.
    pub(super) fn slopes_at_rest(&self) -> (Vec<f64>, Vec<f64>) {
        let mut of_poles = Vec::new();
        let mut of_linear = Vec::new();
        for k in 0..self.poles.len() {
            let (p, residue) = self.pole_and_residue(k);
            let of_pole = residue / (p * p * self.scale);
            of_poles.extend([-2.0 * of_pole.re, -2.0 * of_pole.im]);
            of_linear.extend([-2.0 * p.inv().re, 2.0 * p.inv().im]);
            if self.foreign[k].is_some() {
                of_poles[2 * k..].fill(0.0);
                of_linear[2 * k..].fill(0.0);
            }
        }
        of_linear.push(1.0);
        of_linear.resize(self.linear.len(), 0.0);
        (of_poles, of_linear)
    }

    /// Scale of s in the linear parameters, in rad/s.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    /// Static response per applied unit, from the modes of the stand and c₁; for displacement without free motion.
    pub fn at_rest(&self) -> f64 {
        let one = |k: usize| {
            let (p, residue) = self.pole_and_residue(k);
            2.0 * (-residue / p).re
        };
        let modes: f64 = self.of_stand().into_iter().map(one).sum();
        modes + self.linear[2 * self.poles.len()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1/(2 (s + 3)² + 2·500²) and its derivatives: R = −j/(2·500·2).
    #[test]
    fn a_residue_does_not_depend_on_what_is_measured() {
        let omega: Vec<f64> = (300..700).map(f64::from).collect();
        let pole = Pole {
            rate_per_s: 3.0,
            omega_rad_per_s: 500.0,
        };
        let square = pole.rate_per_s.powi(2) + pole.omega_rad_per_s.powi(2);
        for order in 0..3 {
            let response = |w: &f64| {
                let s = Complex64::new(0.0, *w);
                s.powi(order) / (2.0 * (s * s + 6.0 * s + square))
            };
            let data = Data {
                response: omega.iter().map(response).collect(),
                weight: vec![1.0; omega.len()],
                omega: omega.clone(),
                order,
                added_rate: 0.0,
                lag: None,
                recorder: None,
                below: true,
            };
            let fitted = data.fit(&[pole], 0.0, Effort::Fine).unwrap();
            let (residue, _) = fitted.residue(0);
            let want = Complex64::new(0.0, -0.25 / pole.omega_rad_per_s);
            assert!((residue - want).norm() < 1e-6 * want.norm(), "{residue}");
        }
    }
}
