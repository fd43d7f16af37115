//! Equation of motion averaged over windows: one row per window, one column per term.

use torqcomp_dsp::weak::Window;

use super::directions::{Directions, chauvenet, chosen};
use super::present::names;
use super::regression::{Corrected, Errors, left_side, not_identifiable, solve};
use super::resolution::shortest_half;
use super::{COLOURED, FreeRun, LEAST_WINDOWS, POOR, SHORTEST_HALF, Terms};
use crate::failure::{ErrorCode, Failure};
use crate::identify::rms;
use crate::print::plural;

/// Rows of the regression.
pub(super) struct WindowRows {
    /// Half-length of the window, in samples.
    pub half: usize,
    /// Distance between windows, in samples.
    pub stride: usize,
    /// Terms of the equation, one value per window.
    pub columns: Vec<Vec<f64>>,
    /// Averaged torque or force.
    pub right: Vec<f64>,
    /// Its derivative, per second.
    pub slope: Vec<f64>,
    /// Averaged `θ' |θ'|`, if the speed is known.
    pub drag: Option<Vec<f64>>,
    /// Whether the body moves throughout a window, reversing or not.
    pub moves: Vec<bool>,
    /// Whether the body moves one way throughout a window.
    pub clean: Vec<bool>,
    /// Derivative order of each column, if its noise is known.
    pub orders: Vec<Option<usize>>,
    /// Name of each column.
    pub names: Vec<&'static str>,
    pub window: Window,
    pub variance: f64,
}

/// A fit of the rows.
pub(super) struct FittedRows {
    /// The parameters.
    pub fit: Corrected,
    /// All rows.
    pub rows: WindowRows,
    /// Fitted rows.
    pub used: Vec<bool>,
}

impl WindowRows {
    /// Averages over windows of this half-length.
    ///
    /// # Errors
    /// If too few windows fit into the record.
    pub fn of(
        run: &FreeRun,
        directions: &Directions,
        half: usize,
        terms: Terms,
    ) -> Result<Self, Failure> {
        let window = Window::new(half, run.rate_hz)?;
        let stride = (half / 2).max(1);
        let count = run.motion.len();
        let centres: Vec<usize> = (half..count.saturating_sub(half)).step_by(stride).collect();
        let none = |of: &[bool], wrong: bool| -> Vec<bool> {
            let free = |c: &usize| !of[c - half..=c + half].contains(&wrong);
            centres.iter().map(free).collect()
        };
        let moves = none(&directions.moves, false);
        let places = moves.iter().filter(|m| **m).count();
        if places < LEAST_WINDOWS {
            return Err(ErrorCode::TooFewSamples.failed(format_args!(
                "as far as the noise of the motion shows, the body moves throughout only {} for windows of \
                 ±{half} samples; choose a shorter --window",
                plural(places, "place")
            )));
        }
        let column = |samples: &[f64], order: usize| -> Vec<f64> {
            let average = |c: &usize| window.at(samples, *c, order);
            centres.iter().map(average).collect()
        };
        let (columns, orders) = columns(run, directions, terms, centres.len(), &column);
        let names = names(run, directions, terms).into_iter();
        let drag = directions.speed.as_ref().map(|speed| {
            let squares = speed.iter().map(|v| v * v.abs());
            column(&squares.collect::<Vec<_>>(), 0)
        });
        Ok(Self {
            half,
            stride,
            columns,
            right: column(run.effort, 0),
            slope: column(run.effort, 1),
            drag,
            clean: none(&directions.unsure, true),
            moves,
            orders,
            names: names.map(|(name, _)| name).collect(),
            window: window.clone(),
            variance: directions.noise_variance,
        })
    }

    /// Whether there are enough windows in which the body moves one way.
    fn enough_clean(&self) -> bool {
        let [clean, moving] =
            [&self.clean, &self.moves].map(|of| of.iter().filter(|w| **w).count());
        clean >= LEAST_WINDOWS && 3 * clean >= moving
    }

    /// The clean windows and, where the residual of the clean ones is more than noise, those others that follow the
    /// same equation as closely, except at rest, where dry friction balances whatever acts. A reversal is located to a
    /// few hundredths of a sample at best, which may be more than the noise: such windows would bias the result by more
    /// than its uncertainty due to noise, but by no more than that uncertainty after its increase for an incomplete
    /// model.
    fn following(&self, fit: &Corrected) -> Vec<bool> {
        if fit.coloured <= COLOURED {
            return self.clean.clone();
        }
        let residual = |k: usize| fit.residuals[k];
        let clean: Vec<f64> = (0..self.clean.len())
            .filter(|k| self.clean[*k])
            .map(residual)
            .collect();
        let most = chauvenet(self.clean.len()) * rms(&clean);
        (0..self.clean.len())
            .map(|k| self.clean[k] || self.moves[k] && residual(k).abs() <= most)
            .collect()
    }

    /// Covariance of white motion noise between two columns of one row.
    fn noise(&self, i: usize, j: usize) -> f64 {
        match (self.orders[i], self.orders[j]) {
            (Some(a), Some(b)) => self.variance * self.window.noise(a, b),
            _ => 0.0,
        }
    }

    /// Covariance of the errors of two rows `lag` windows apart, for white torque noise of variance 1.
    fn torque_errors(&self, lag: usize) -> f64 {
        self.window.noise_apart(0, 0, lag * self.stride)
    }

    /// The same for motion noise, with its terms multiplied by `factors`.
    fn motion_errors(&self, lag: usize, factors: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (i, a) in self.orders.iter().enumerate() {
            for (j, b) in self.orders.iter().enumerate() {
                if let (Some(a), Some(b)) = (a, b) {
                    let both = self.window.noise_apart(*a, *b, lag * self.stride);
                    sum += factors[i] * factors[j] * self.variance * both;
                }
            }
        }
        sum
    }

    /// Fits the rows.
    ///
    /// # Errors
    /// If the terms are not separately identifiable, or no term of the motion has a part in the torque.
    pub fn fit(self) -> Result<FittedRows, Failure> {
        let mut used = self.moves.clone();
        if self.enough_clean() && self.clean != self.moves {
            // The clean windows alone may not determine all terms.
            if let Ok(fit) = self.solve(&self.clean) {
                used = self.following(&fit);
            }
        }
        let fit = self.solve(&used)?;
        let is_clear = |(k, value): (usize, &f64)| {
            let std = fit.numbers.covariance().std(k);
            std.is_some_and(|std| value.abs() > CLEAR * std)
        };
        // The last term is the offset: alone, it is any constant torque.
        let moving = &fit.numbers.values()[..self.columns.len() - 1];
        let is_told = moving.iter().enumerate().any(is_clear);
        let fitted = FittedRows {
            fit,
            rows: self,
            used,
        };
        if is_told || fitted.is_contradicted() {
            Ok(fitted)
        } else {
            Err(not_identifiable())
        }
    }

    pub fn solve(&self, used: &[bool]) -> Result<Corrected, Failure> {
        let errors = Errors {
            noise: &|i, j| self.noise(i, j),
            torque: &|lag| self.torque_errors(lag),
            motion: &|lag, factors| self.motion_errors(lag, factors),
            overlap: 2 * self.half / self.stride,
        };
        solve(&self.names, &self.columns, &self.right, used, &errors)
    }
}

/// Minimum size of a significant constant in standard uncertainties.
const CLEAR: f64 = 4.0;

impl FittedRows {
    /// Residual of the used windows relative to the variation of the torque in them.
    fn unexplained(&self) -> f64 {
        let mut torque = self.used(&self.rows.right);
        let mean = torque.iter().sum::<f64>() / torque.len() as f64;
        torque.iter_mut().for_each(|v| *v -= mean);
        rms(&self.used(&self.fit.residuals)) / rms(&torque)
    }

    /// Whether the torque varies, by more than noise, which would vary as fast as the windows let through, and the
    /// motion does not follow it.
    fn is_contradicted(&self) -> bool {
        let rows = &self.rows;
        let [slope, torque] = [&rows.slope, &rows.right].map(|values| rms(&self.used(values)));
        let left = rms(&self.used(&self.fit.residuals));
        let of_noise = rows.window.noise(1, 1) / rows.window.noise(0, 0);
        left > POOR * torque && slope.powi(2) < 0.25 * of_noise * left.powi(2)
    }

    /// The values of the used windows.
    pub fn used(&self, values: &[f64]) -> Vec<f64> {
        chosen(values, &self.used)
    }

    /// The values of the windows without rest.
    pub fn moving(&self, values: &[f64]) -> Vec<f64> {
        chosen(values, &self.rows.moves)
    }
}

/// Terms of the equation of motion, with the order of the derivative of the motion in each.
fn columns(
    run: &FreeRun,
    directions: &Directions,
    terms: Terms,
    rows: usize,
    column: &dyn Fn(&[f64], usize) -> Vec<f64>,
) -> (Vec<Vec<f64>>, Vec<Option<usize>>) {
    let top = 2 - run.kind.order() as usize;
    let mut columns = vec![column(run.motion, top)];
    let mut orders = vec![Some(top)];
    match (&directions.speed, terms.is_split) {
        (Some(speed), true) => {
            for keep in [|v: f64| v.max(0.0), |v: f64| v.min(0.0)] {
                let part: Vec<f64> = speed.iter().map(|v| keep(*v)).collect();
                columns.push(column(&part, 0));
                orders.push(None);
            }
        }
        (Some(_), false) => {
            columns.push(column(run.motion, top - 1));
            orders.push(Some(top - 1));
        }
        (None, _) => {
            // Speed up to a constant, which becomes part of the offset.
            columns.push(column(&integral(run.motion, run.rate_hz), 0));
            orders.push(None);
        }
    }
    if let Some(angle) = terms.angle {
        for part in [f64::sin, f64::cos] {
            let of_angle: Vec<f64> = angle.iter().map(|angle| part(*angle)).collect();
            columns.push(column(&of_angle, 0));
            orders.push(None);
        }
    }
    if directions.both() {
        columns.push(column(&directions.sign, 0));
        orders.push(None);
    }
    columns.push(vec![1.0; rows]);
    orders.push(None);
    (columns, orders)
}

pub(super) fn integral(samples: &[f64], rate_hz: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let mut last = samples[0];
    samples
        .iter()
        .map(|v| {
            sum += 0.5 * (v + last) / rate_hz;
            last = *v;
            sum
        })
        .collect()
}

/// Half-length of the window to use, with these terms. Always determined with one viscous friction.
///
/// Noise, ripple or hum of the motion may outweigh its acceleration in short windows, and the constants are then near
/// zero in all of them. So if the motion does not explain the torque in the window found, one is taken in which it
/// explains it at least twice as well, if there is any.
pub(super) fn plateau(run: &FreeRun, directions: &Directions, terms: Terms) -> usize {
    let terms = Terms {
        is_split: false,
        ..terms
    };
    let moving = directions.moving(run.motion);
    let longest = moving.len() / (LEAST_WINDOWS / 2 + 2);
    let mut shortest = shortest_half(&moving, run.effort).min(longest.max(SHORTEST_HALF));
    // As large as a channel.
    drop(moving);
    // Between rests, there may be no room for it.
    while shortest > SHORTEST_HALF && WindowRows::of(run, directions, shortest, terms).is_err() {
        shortest = SHORTEST_HALF.max(shortest * 2 / 3);
    }
    let found = |most: f64| steadiest(run, (directions, terms), [shortest, longest], most);
    match found(f64::INFINITY) {
        Some((half, left)) if left > POOR => {
            found(POOR.min(0.5 * left)).map_or(half, |(half, _)| half)
        }
        Some((half, _)) => half,
        None => shortest,
    }
}

/// Half-length, in a range, of the first window at which the result changes least, of those that leave at most that
/// much unexplained, and what it leaves: shorter ones are noisy, longer ones average over deviations from the equation.
fn steadiest(
    run: &FreeRun,
    (directions, terms): (&Directions, Terms),
    [shortest, longest]: [usize; 2],
    most: f64,
) -> Option<(usize, f64)> {
    let mut halves = Vec::new();
    let mut changes: Vec<f64> = Vec::new();
    let mut last: Option<Tried> = None;
    let mut half = shortest;
    while half <= longest {
        let fitted = WindowRows::of(run, directions, half, terms).and_then(WindowRows::fit);
        let fitted = fitted.ok().map(|fitted| (fitted.unexplained(), fitted));
        if let Some((left, fitted)) = fitted.filter(|(left, _)| *left <= most) {
            let tried = Tried::of(fitted);
            halves.push((half, left));
            changes.extend(last.map(|last| last.change_to(&tried)));
            last = Some(tried);
            if let [.., before, change] = changes[..]
                && before < change
            {
                return Some(halves[changes.len() - 2]);
            }
        }
        half = half * 3 / 2;
    }
    halves.get(changes.len().saturating_sub(1)).copied()
}

/// The part of a fit needed for comparison with the next one.
struct Tried {
    columns: Vec<Vec<f64>>,
    values: Vec<f64>,
    /// Norm of the right-hand side.
    right: f64,
}

impl Tried {
    fn of(fitted: FittedRows) -> Self {
        let squares = fitted.rows.right.iter().map(|v| v * v);
        Self {
            right: squares.sum::<f64>().sqrt(),
            values: fitted.fit.numbers.values().to_vec(),
            columns: fitted.rows.columns,
        }
    }

    /// Change of the left-hand side from these parameters to those of another fit, relative to the
    /// right-hand side.
    fn change_to(&self, other: &Self) -> f64 {
        let pairs = other.values.iter().zip(&self.values);
        let change: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
        let left = left_side(&self.columns, &change);
        left.iter().map(|v| v * v).sum::<f64>().sqrt() / self.right
    }
}
