//! Fits from many starts, to avoid local minima.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use super::{Fit, FitError, Options, Parameter, Residuals, minimize};

/// Result of fits from many starts.
#[derive(Debug, Clone, PartialEq)]
pub struct MultiStart {
    /// The fit with the least sum of squares.
    pub best: Fit,
    /// Sum of squares of each start in order, `None` where there was no fit.
    pub sums_of_squares: Vec<Option<f64>>,
}

/// Bases of Halton's sequence, one per parameter.
const PRIMES: [usize; 16] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53];

/// Fits from the given start and `more` others, spread evenly (Halton's sequence) over the bounds, or
/// over ± three scales where there are none. The starts are shared among `options.threads`.
///
/// # Errors
/// The error of the given start if no start leads to a fit.
pub fn multi_start(
    problem: &dyn Residuals,
    parameters: &[Parameter],
    options: &Options,
    more: usize,
) -> Result<MultiStart, FitError> {
    let single = Options {
        threads: 1,
        ..options.clone()
    };
    let one = |k: usize| minimize(problem, &spread(parameters, k), &single);
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            if k > more {
                return done;
            }
            done.push((k, one(k)));
        }
    };
    let mut found: Vec<(usize, Result<Fit, FitError>)> = thread::scope(|scope| {
        let workers = options.threads.clamp(1, more + 1);
        let handles: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        handles
            .into_iter()
            .flat_map(|handle| handle.join().expect("a worker does not panic"))
            .collect()
    });
    found.sort_by_key(|(k, _)| *k);
    let sum = |fit: &Result<Fit, FitError>| fit.as_ref().ok().map(|f| f.sum_of_squares);
    let sums_of_squares: Vec<Option<f64>> = found.iter().map(|(_, fit)| sum(fit)).collect();
    let best = (0..found.len())
        .filter(|k| sums_of_squares[*k].is_some())
        .min_by(|a, b| {
            let (a, b) = (sums_of_squares[*a], sums_of_squares[*b]);
            a.unwrap_or(f64::INFINITY)
                .total_cmp(&b.unwrap_or(f64::INFINITY))
        })
        .unwrap_or(0);
    Ok(MultiStart {
        best: found.swap_remove(best).1?,
        sums_of_squares,
    })
}

/// The parameters with the k-th start; the 0-th is the given one.
fn spread(parameters: &[Parameter], k: usize) -> Vec<Parameter> {
    let mut all = parameters.to_vec();
    if k == 0 {
        return all;
    }
    for (i, parameter) in all.iter_mut().enumerate().filter(|(_, p)| !p.fixed) {
        let reach = 3.0 * parameter.scale;
        let low = parameter.lower.max(parameter.start - reach).max(f64::MIN);
        let low = if parameter.lower.is_finite() && parameter.upper.is_finite() {
            parameter.lower
        } else {
            low
        };
        let high = if parameter.lower.is_finite() && parameter.upper.is_finite() {
            parameter.upper
        } else {
            parameter.upper.min(parameter.start + reach)
        };
        // Past the sixteenth parameter the bases repeat, shifted so that starts still differ.
        let base = PRIMES[i % PRIMES.len()];
        let part = radical_inverse(k + i / PRIMES.len() * 409, base);
        parameter.start = (low + part * (high - low)).clamp(parameter.lower, parameter.upper);
    }
    all
}

/// The digits of k in a base, mirrored at the point: 0 < result < 1 for k > 0.
fn radical_inverse(mut k: usize, base: usize) -> f64 {
    let (mut result, mut place) = (0.0, 1.0 / base as f64);
    while k > 0 {
        result += (k % base) as f64 * place;
        k /= base;
        place /= base as f64;
    }
    result
}
