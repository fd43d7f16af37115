//! Derivatives of the residuals, from the problem or by differences.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use nalgebra::DMatrix;

use super::problem::Evaluated;
use super::{Differences, FitError, Parameter};

/// Parameters and method of the derivatives.
pub(super) struct Derivatives<'a> {
    pub parameters: &'a [Parameter],
    /// Indices of the parameters that are not fixed.
    pub free: &'a [usize],
    pub differences: Differences,
    pub threads: usize,
}

/// Columns of the free parameters, and the number of evaluations.
pub(super) fn jacobian(
    evaluated: &Evaluated,
    how: &Derivatives,
    values: &[f64],
    at: &[f64],
) -> Result<(DMatrix<f64>, usize), FitError> {
    if evaluated.problem.has_jacobian() {
        let mut all = DMatrix::zeros(at.len(), values.len());
        evaluated.problem.jacobian(values, &mut all)?;
        let mut chosen = all.select_columns(how.free);
        if let Some(weights) = evaluated.weights {
            for mut column in chosen.column_iter_mut() {
                column.iter_mut().zip(weights).for_each(|(d, w)| *d *= w);
            }
        }
        return finite(chosen).map(|matrix| (matrix, 1));
    }
    let columns = columns(evaluated, how, values, at)?;
    let evaluations = columns.iter().map(|(_, count)| count).sum();
    let mut matrix = DMatrix::zeros(at.len(), how.free.len());
    for (j, (column, _)) in columns.into_iter().enumerate() {
        matrix.column_mut(j).copy_from_slice(&column);
    }
    finite(matrix).map(|matrix| (matrix, evaluations))
}

fn finite(matrix: DMatrix<f64>) -> Result<DMatrix<f64>, FitError> {
    match matrix.iter().position(|v| !v.is_finite()) {
        Some(i) => Err(FitError::NotFinite {
            index: i % matrix.nrows(),
            value: matrix.as_slice()[i],
        }),
        None => Ok(matrix),
    }
}

type Column = (Vec<f64>, usize);

/// All columns; each depends only on its index, so the result does not depend on the threads.
fn columns(
    evaluated: &Evaluated,
    how: &Derivatives,
    values: &[f64],
    at: &[f64],
) -> Result<Vec<Column>, FitError> {
    let one = |index: usize| column(evaluated, how, values, at, index);
    let workers = how.threads.clamp(1, how.free.len().max(1));
    if workers == 1 {
        return how.free.iter().map(|index| one(*index)).collect();
    }
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let j = next.fetch_add(1, Ordering::Relaxed);
            match how.free.get(j) {
                Some(index) => done.push((j, one(*index))),
                None => return done,
            }
        }
    };
    let mut found: Vec<(usize, Result<Column, FitError>)> = thread::scope(|scope| {
        let handles: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        handles
            .into_iter()
            .flat_map(|handle| handle.join().expect("a worker does not panic"))
            .collect()
    });
    found.sort_by_key(|(j, _)| *j);
    found.into_iter().map(|(_, column)| column).collect()
}

/// ∂r/∂p of one parameter, by a step that stays within its bounds.
fn column(
    evaluated: &Evaluated,
    how: &Derivatives,
    values: &[f64],
    at: &[f64],
    index: usize,
) -> Result<Column, FitError> {
    let parameter = &how.parameters[index];
    let value = values[index];
    let size = value.abs().max(parameter.scale * 1e-3);
    let relative = match how.differences {
        Differences::Forward => f64::EPSILON.sqrt(),
        Differences::Central => f64::EPSILON.cbrt(),
    };
    let step = relative * size;
    let moved = |to: f64| {
        let mut there = values.to_vec();
        there[index] = to;
        evaluated.residuals(&there)
    };
    let (up, down) = (value + step, value - step);
    let room_up = up <= parameter.upper;
    let room_down = down >= parameter.lower;
    if how.differences == Differences::Central && room_up && room_down {
        let (above, below) = (moved(up)?, moved(down)?);
        let width = up - down;
        let slope = above.iter().zip(&below).map(|(a, b)| (a - b) / width);
        return Ok((slope.collect(), 2));
    }
    // At a bound, or forward differences: one-sided, with a suitable step.
    let step = f64::EPSILON.sqrt() * size;
    let to = if value + step <= parameter.upper {
        value + step
    } else {
        (value - step).max(parameter.lower)
    };
    let width = to - value;
    let there = moved(to)?;
    let slope = there.iter().zip(at).map(|(a, b)| (a - b) / width);
    Ok((slope.collect(), 1))
}
