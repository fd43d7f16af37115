//! Nonlinear least squares within bounds.

use nalgebra::{DMatrix, DVector};

use super::covariance::covariance;
use super::jacobian::{Derivatives, jacobian};
use super::problem::Evaluated;
use super::reduce::{Reduced, reduce};
use super::step::{Room, step};
use super::{Differences, Fit, FitError, Parameter, Residuals, StopReason};

/// Options of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Finite-difference scheme for problems without derivatives.
    pub differences: Differences,
    /// Maximum number of successive steps that only update the derivatives, before these are taken anew (C. G. Broyden,
    /// Math. Comput. 19 (1965), 577): one evaluation in place of one per parameter. An end is confirmed by new ones.
    pub most_updates: usize,
    /// Maximum number of steps that reduce the sum of squares.
    pub most_steps: usize,
    /// Maximum number of evaluations of the residuals.
    pub most_evaluations: usize,
    /// Relative reduction of the sum of squares, and relative step, below which the fit has converged.
    pub tolerance: f64,
    /// Weights of the residuals; 1/σ makes them comparable.
    pub weights: Option<Vec<f64>>,
    /// Whether the weighted residuals are known to have variance 1. If not, the variance is estimated from the residuals.
    pub variance_known: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            differences: Differences::Central,
            most_updates: 0,
            most_steps: usize::MAX,
            most_evaluations: 20_000,
            tolerance: 1e-12,
            weights: None,
            variance_known: false,
        }
    }
}

/// Initial damping, relative to the scaling.
const FIRST_DAMPING: f64 = 1e-3;
/// Damping at which steps become zero.
const MOST_DAMPING: f64 = 1e24;
/// Cosine of the angle between residuals and a column below which they are orthogonal.
const RIGHT_ANGLE: f64 = 1e-10;
/// Minimum ratio of the gain of a step to the predicted one for an update of the derivatives.
const WELL_PREDICTED: f64 = 0.25;

/// Finds the parameters that minimise the sum of squares of the residuals.
///
/// # Errors
/// [`FitError`] if a parameter is invalid, none is free, there are too few residuals, or the model cannot be evaluated at
/// the start.
///
/// # Examples
/// See [the module](super).
pub fn minimize(
    problem: &dyn Residuals,
    parameters: &[Parameter],
    options: &Options,
) -> Result<Fit, FitError> {
    parameters.iter().try_for_each(Parameter::check)?;
    let free: Vec<usize> = (0..parameters.len())
        .filter(|i| !parameters[*i].fixed)
        .collect();
    if free.is_empty() {
        return Err(FitError::NothingFree);
    }
    let mut state = State::start(problem, parameters, options, &free)?;
    let stop = state.run()?;
    state.finish(stop)
}

/// State of the search.
struct State<'a> {
    evaluated: Evaluated<'a>,
    how: Derivatives<'a>,
    options: &'a Options,
    values: Vec<f64>,
    residuals: Vec<f64>,
    cost: f64,
    cost_at_start: f64,
    /// Derivatives of the residuals with respect to the free parameters, and the number of updates since they were taken.
    matrix: DMatrix<f64>,
    updates: usize,
    /// Steps that reduced the sum of squares.
    steps: usize,
    reduced: Reduced,
    scaling: Vec<f64>,
    lambda: f64,
    /// Factor of the next increase of the damping.
    rise: f64,
    evaluations: usize,
    /// Evaluations that the derivatives took.
    per_jacobian: usize,
}

/// Outcome of a step.
enum Progress {
    Moved,
    Refused,
    Ended(StopReason),
}

impl<'a> State<'a> {
    fn start(
        problem: &'a dyn Residuals,
        parameters: &'a [Parameter],
        options: &'a Options,
        free: &'a [usize],
    ) -> Result<Self, FitError> {
        let mut evaluated = Evaluated {
            problem,
            weights: options.weights.as_deref(),
            expected: None,
        };
        let values: Vec<f64> = parameters.iter().map(|p| p.start).collect();
        let residuals = evaluated.residuals(&values)?;
        evaluated.expected = Some(residuals.len());
        if residuals.len() < free.len() {
            return Err(FitError::TooFewResiduals {
                residuals: residuals.len(),
                free: free.len(),
            });
        }
        let how = Derivatives {
            parameters,
            free,
            differences: options.differences,
        };
        let (matrix, count) = jacobian(&evaluated, &how, &values, &residuals)?;
        let cost = sum_of_squares(&residuals);
        let mut state = Self {
            reduced: reduce(&matrix, &residuals),
            matrix,
            updates: 0,
            steps: 0,
            cost,
            cost_at_start: cost,
            scaling: vec![0.0; free.len()],
            lambda: FIRST_DAMPING,
            rise: 2.0,
            evaluations: 1 + count,
            per_jacobian: count,
            evaluated,
            how,
            options,
            values,
            residuals,
        };
        state.rescale();
        Ok(state)
    }

    /// Moré's scaling: the largest norm of each column so far.
    fn rescale(&mut self) {
        for (j, scale) in self.scaling.iter_mut().enumerate() {
            let norm = self.reduced.r.column(j).norm();
            *scale = scale.max(norm);
        }
        // A parameter without effect needs some damping, too.
        let floor = self.scaling.iter().fold(0.0_f64, |m, s| m.max(*s)) * 1e-30;
        let parameters = self.how.parameters;
        for (scale, index) in self.scaling.iter_mut().zip(self.how.free) {
            if *scale <= floor {
                *scale = 1.0 / parameters[*index].scale;
            }
        }
    }

    fn run(&mut self) -> Result<StopReason, FitError> {
        loop {
            if self.cost == 0.0 {
                return Ok(StopReason::Exact);
            }
            if self.evaluations >= self.options.most_evaluations {
                return Ok(StopReason::Evaluations);
            }
            let progress = match self.at_right_angles() {
                true => Progress::Ended(StopReason::Gradient),
                false => self.advance()?,
            };
            match progress {
                Progress::Moved => {}
                Progress::Ended(StopReason::Evaluations) => return Ok(StopReason::Evaluations),
                // What the updated derivatives say is tried again with new ones.
                Progress::Ended(_) | Progress::Refused if self.updates > 0 => {
                    if !self.renew()? {
                        return Ok(StopReason::Evaluations);
                    }
                }
                Progress::Ended(reason) => return Ok(reason),
                Progress::Refused => {
                    if let Some(reason) = self.damp() {
                        return Ok(reason);
                    }
                }
            }
        }
    }

    /// Whether no direction within the bounds lowers the sum of squares.
    fn at_right_angles(&self) -> bool {
        let gradient = self.reduced.r.tr_mul(&self.reduced.c);
        let size = self.cost.sqrt();
        let room = self.room();
        (0..gradient.len()).all(|j| {
            let held =
                gradient[j] > 0.0 && room[j].down <= 0.0 || gradient[j] < 0.0 && room[j].up <= 0.0;
            let norm = self.reduced.r.column(j).norm();
            held || gradient[j].abs() <= RIGHT_ANGLE * norm * size
        })
    }

    fn room(&self) -> Vec<Room> {
        let one = |index: &usize| {
            let (parameter, value) = (&self.how.parameters[*index], self.values[*index]);
            Room {
                down: value - parameter.lower,
                up: parameter.upper - value,
            }
        };
        self.how.free.iter().map(one).collect()
    }

    /// Tries one step.
    fn advance(&mut self) -> Result<Progress, FitError> {
        let room = self.room();
        let Some(mut step) = step(&self.reduced, &self.scaling, self.lambda, &room) else {
            return Ok(Progress::Refused);
        };
        let after = &self.reduced.c + &self.reduced.r * &step;
        let predicted = self.reduced.c.norm_squared() - after.norm_squared();
        let mut trial = self.values.clone();
        let mut moved = 0.0_f64;
        for (index, d) in self.how.free.iter().zip(step.iter_mut()) {
            let parameter = &self.how.parameters[*index];
            let value = self.values[*index];
            trial[*index] = (value + *d).clamp(parameter.lower, parameter.upper);
            *d = trial[*index] - value;
            moved = moved.max(d.abs() / value.abs().max(1e-3 * parameter.scale));
        }
        if moved == 0.0 {
            return Ok(Progress::Ended(StopReason::NoProgress));
        }
        self.evaluations += 1;
        let Ok(residuals) = self.evaluated.residuals(&trial) else {
            return Ok(Progress::Refused);
        };
        let cost = sum_of_squares(&residuals);
        let gain = self.cost - cost;
        let tolerance = self.options.tolerance;
        if gain <= 0.0 {
            let level = gain.abs() <= tolerance * self.cost && predicted <= tolerance * self.cost;
            return Ok(if level {
                Progress::Ended(StopReason::Reduction)
            } else {
                Progress::Refused
            });
        }
        let small_gain = gain <= tolerance * self.cost && predicted <= tolerance * self.cost;
        let before = std::mem::replace(&mut self.residuals, residuals);
        self.values = trial;
        self.cost = cost;
        match (small_gain, moved <= tolerance) {
            (true, _) => Ok(Progress::Ended(StopReason::Reduction)),
            (_, true) => Ok(Progress::Ended(StopReason::Step)),
            _ => self.go_on(gain / predicted, &step, &before),
        }
    }

    /// Increases the damping after a step that did not reduce the sum of squares.
    fn damp(&mut self) -> Option<StopReason> {
        self.lambda = self.lambda.max(1e-15) * self.rise;
        self.rise *= 2.0;
        (self.lambda > MOST_DAMPING).then_some(StopReason::NoProgress)
    }

    /// Goes on from a step; the better its gain was predicted, the lower the damping becomes.
    fn go_on(
        &mut self,
        ratio: f64,
        step: &DVector<f64>,
        before: &[f64],
    ) -> Result<Progress, FitError> {
        self.lambda *= (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0);
        self.rise = 2.0;
        self.steps += 1;
        if self.steps >= self.options.most_steps {
            return Ok(Progress::Ended(StopReason::Evaluations));
        }
        if self.updates < self.options.most_updates && ratio >= WELL_PREDICTED {
            self.update(step, before);
            return Ok(Progress::Moved);
        }
        Ok(match self.renew()? {
            true => Progress::Moved,
            false => Progress::Ended(StopReason::Evaluations),
        })
    }

    /// Updates the derivatives so that they predict the residuals of a step: the smallest change of the scaled matrix,
    /// `J ← J + (Δr − J s)(D²s)ᵀ/(sᵀD²s)`.
    fn update(&mut self, step: &DVector<f64>, before: &[f64]) {
        let mut off = -(&self.matrix * step);
        let changes = self
            .residuals
            .iter()
            .zip(before)
            .map(|(after, before)| after - before);
        off.iter_mut()
            .zip(changes)
            .for_each(|(off, change)| *off += change);
        let scaled = DVector::from_iterator(
            step.len(),
            step.iter().zip(&self.scaling).map(|(s, d)| s * d * d),
        );
        let size = scaled.dot(step);
        if size > 0.0 {
            self.matrix.ger(1.0 / size, &off, &scaled, 1.0);
        }
        self.updates += 1;
        self.reduced = reduce(&self.matrix, &self.residuals);
    }

    /// Takes the derivatives anew, if the remaining evaluations allow a step after them. The last ones serve for the
    /// covariance: the step from there was small, or the fit is unfinished.
    fn renew(&mut self) -> Result<bool, FitError> {
        if self.evaluations + self.per_jacobian >= self.options.most_evaluations {
            return Ok(false);
        }
        let (matrix, count) = jacobian(&self.evaluated, &self.how, &self.values, &self.residuals)?;
        self.evaluations += count;
        self.per_jacobian = count;
        self.reduced = reduce(&matrix, &self.residuals);
        self.matrix = matrix;
        self.updates = 0;
        self.rescale();
        Ok(true)
    }

    fn finish(self, stop: StopReason) -> Result<Fit, FitError> {
        let parameters = self.how.parameters;
        let count = parameters.len();
        let at_bound: Vec<bool> = parameters
            .iter()
            .zip(&self.values)
            .map(|(p, v)| !p.fixed && (*v <= p.lower || *v >= p.upper))
            .collect();
        let inside: Vec<usize> = (0..self.how.free.len())
            .filter(|j| !at_bound[self.how.free[*j]])
            .collect();
        let indices: Vec<usize> = inside.iter().map(|j| self.how.free[*j]).collect();
        let sizes: Vec<f64> = indices
            .iter()
            .map(|i| self.values[*i].abs().max(1e-3 * parameters[*i].scale))
            .collect();
        let columns: DMatrix<f64> = self.reduced.r.select_columns(&inside);
        let small = reduce(&columns, self.reduced.c.as_slice());
        let freedom = |rank: usize| self.residuals.len() - rank;
        let variance = |rank: usize| match (self.options.variance_known, freedom(rank)) {
            (true, _) => Some(1.0),
            (false, 0) => None,
            (false, freedom) => Some(self.cost / freedom as f64),
        };
        let (covariance, undetermined) = covariance(&small.r, &indices, &sizes, count, variance);
        let degrees_of_freedom = freedom(indices.len() - undetermined.len());
        Ok(Fit {
            std: (0..count).map(|i| covariance.std(i)).collect(),
            values: self.values,
            covariance,
            undetermined,
            at_bound,
            rms: (self.cost / self.residuals.len() as f64).sqrt(),
            sum_of_squares: self.cost,
            sum_at_start: self.cost_at_start,
            degrees_of_freedom,
            residuals: self.residuals,
            stop,
            evaluations: self.evaluations,
        })
    }
}

fn sum_of_squares(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum()
}
