//! The best plain fit: natural frequency, damping ratio, offset and initial state of
//! `ÿ + 2ζω ẏ + ω² y = ω² T`, by Gauss–Newton, to a noise-free signal.

use super::excitation::{FINER, Input, RATE_HZ};

/// Constants of the plain stand.
#[derive(Debug, Clone, Copy)]
pub struct PlainConstants {
    pub omega: f64,
    pub damping_ratio: f64,
}

/// Response of a plain stand to an input, sampled; eight steps per sample.
pub fn answer(constants: PlainConstants, input: &Input) -> Vec<f64> {
    let (square, loss) = (
        constants.omega * constants.omega,
        2.0 * constants.damping_ratio * constants.omega,
    );
    let rate = |y: f64, v: f64, u: f64| square * (u - y) - loss * v;
    let h = input.step_s;
    let (mut y, mut v) = (0.0, 0.0);
    let mut samples = Vec::with_capacity(input.samples);
    for node in 0..input.before + input.samples * FINER {
        if node >= input.before && (node - input.before).is_multiple_of(FINER) {
            samples.push(y);
        }
        let [u0, u1, u2] = input.around(node);
        let (y1, v1) = (v, rate(y, v, u0));
        let (y2, v2) = (
            v + h / 2.0 * v1,
            rate(y + h / 2.0 * y1, v + h / 2.0 * v1, u1),
        );
        let (y3, v3) = (
            v + h / 2.0 * v2,
            rate(y + h / 2.0 * y2, v + h / 2.0 * v2, u1),
        );
        let (y4, v4) = (v + h * v3, rate(y + h * y3, v + h * v3, u2));
        y += h / 6.0 * (y1 + 2.0 * y2 + 2.0 * y3 + y4);
        v += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
    }
    samples
}

/// Root mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Residual of a signal without offset and free decay: the columns are orthogonal enough for the
/// normal equations.
fn without_nuisance(constants: PlainConstants, residual: &[f64], more: &[Vec<f64>]) -> Fit {
    let columns = nuisance(constants, residual.len())
        .into_iter()
        .chain(more.iter().cloned())
        .collect::<Vec<_>>();
    let n = columns.len();
    let mut matrix = vec![vec![0.0; n + 1]; n];
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    for i in 0..n {
        for j in 0..n {
            matrix[i][j] = dot(&columns[i], &columns[j]);
        }
        matrix[i][n] = dot(&columns[i], residual);
        matrix[i][i] *= 1.0 + 1e-12;
    }
    let weights = solve(matrix);
    let mut left = residual.to_vec();
    for (column, weight) in columns.iter().zip(&weights) {
        left.iter_mut()
            .zip(column)
            .for_each(|(value, entry)| *value -= weight * entry);
    }
    Fit {
        steps: weights[3..].to_vec(),
        rms: rms(&left),
    }
}

struct Fit {
    steps: Vec<f64>,
    rms: f64,
}

fn nuisance(constants: PlainConstants, samples: usize) -> Vec<Vec<f64>> {
    let decay = constants.omega * constants.damping_ratio;
    let swing = constants.omega * (1.0 - constants.damping_ratio.powi(2)).max(1e-9).sqrt();
    let column = |value: &dyn Fn(f64) -> f64| {
        (0..samples)
            .map(|i| value(i as f64 / RATE_HZ))
            .collect::<Vec<f64>>()
    };
    vec![
        column(&|_| 1.0),
        column(&|t| (-decay * t).exp() * (swing * t).cos()),
        column(&|t| (-decay * t).exp() * (swing * t).sin()),
    ]
}

/// Gaussian elimination with row exchange; the last column is the right-hand side.
fn solve(mut rows: Vec<Vec<f64>>) -> Vec<f64> {
    let n = rows.len();
    for i in 0..n {
        let pivot = (i..n)
            .max_by(|a, b| rows[*a][i].abs().total_cmp(&rows[*b][i].abs()))
            .expect("a row");
        rows.swap(i, pivot);
        let (above, below) = rows.split_at_mut(i + 1);
        let upper = &above[i];
        for row in below {
            let factor = row[i] / upper[i];
            for (cell, pivot) in row[i..].iter_mut().zip(&upper[i..]) {
                *cell -= factor * pivot;
            }
        }
    }
    let mut solution = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| rows[i][k] * solution[k]).sum();
        solution[i] = (rows[i][n] - known) / rows[i][i];
    }
    solution
}

/// RMS residual for given constants, without offset and initial state.
pub fn left_by(constants: PlainConstants, input: &Input, signal: &[f64]) -> f64 {
    let residual: Vec<f64> = difference(signal, &answer(constants, input));
    without_nuisance(constants, &residual, &[]).rms
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(x, y)| x - y).collect()
}

/// The constants that minimise the residual, and the residual.
pub fn fit(start: PlainConstants, input: &Input, signal: &[f64]) -> (PlainConstants, f64) {
    let mut best = start;
    let mut best_rms = left_by(best, input, signal);
    for _ in 0..12 {
        let model = answer(best, input);
        let residual = difference(signal, &model);
        let small = 1e-5;
        let moved = |omega: f64, ratio: f64| PlainConstants {
            omega: best.omega * (1.0 + omega),
            damping_ratio: best.damping_ratio * (1.0 + ratio),
        };
        let slope = |other: PlainConstants| -> Vec<f64> {
            answer(other, input)
                .iter()
                .zip(&model)
                .map(|(a, b)| (a - b) / small)
                .collect()
        };
        let slopes = [slope(moved(small, 0.0)), slope(moved(0.0, small))];
        let steps = without_nuisance(best, &residual, &slopes).steps;
        let mut factor = 1.0;
        let improved = loop {
            let limited = |step: f64| (factor * step).clamp(-0.5, 0.5);
            let next = moved(limited(steps[0]), limited(steps[1]));
            let next_rms = left_by(next, input, signal);
            if next_rms < best_rms {
                let gain = 1.0 - next_rms / best_rms;
                (best, best_rms) = (next, next_rms);
                break gain;
            }
            factor *= 0.3;
            if factor < 0.01 {
                break 0.0;
            }
        };
        if improved < 5e-3 {
            break;
        }
    }
    (best, best_rms)
}
