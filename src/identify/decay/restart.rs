//! Restarts within a decay: a second hit that does not raise the amplitude, missing samples, the end of an overload.
//!
//! A sum of decaying sines with an offset obeys a linear recursion, `x_i = c + Σ a_k x_{i−k}`, whatever its modes. It
//! is fitted by least squares to the whole segment; the residual is noise plus nonlinearity of the stand, and falls
//! with the amplitude. A jump of the residual marks a restart. Samples are first averaged to about [`A_PERIOD`] per
//! period of the strongest line: means of decaying sines are decaying sines.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use torqcomp_dsp::{peaks, quality};

/// Order of the recursion.
const ORDER: usize = 16;
/// Averaged samples per period of the strongest line.
const A_PERIOD: f64 = 20.0;
/// Number of averaged samples before a moment used for comparison.
const BEFORE: usize = 160;
/// Averaged samples at the start of a segment, including the order, that are searched for samples preceding the
/// decay.
const LEAD: usize = 4 * ORDER;
/// Oscillation amplitude of such a start, relative to the whole, below which it is at rest.
const AT_REST: f64 = 0.3;
/// Residual at a restart, relative to the largest before it …
const JUMP: f64 = 5.0;
/// … in standard deviations of the whole residual …
const NOISE: f64 = 10.0;
/// … and relative to the largest amplitude.
const SIZE: f64 = 0.01;
/// Amplitude of a part, relative to the whole, below which it does not ring.
const STILL: f64 = 0.01;
/// Relative ridge term of the normal equations, for noise-free samples of lower order.
const RIDGE: f64 = 1e-12;

/// The parts of a segment, in samples: the whole, or those before and after each restart that ring and have at least
/// `least` samples.
pub(super) fn parts(values: &[f64], least: usize) -> Vec<Range<usize>> {
    let (factor, few) = peaks::averaged(values, A_PERIOD);
    let mut all = Vec::new();
    let mut from = 0;
    for gap in restarts(&few) {
        all.push(from..gap.start * factor);
        from = gap.end * factor;
    }
    all.push(from..values.len());
    if all.len() > 1 {
        let whole = swing(values);
        all.retain(|part| part.len() >= least && swing(&values[part.clone()]) > STILL * whole);
    }
    all
}

/// Number of samples at the start of a segment before the decay begins, as with a preload released a little later: the
/// recursion fails until the last of them has passed, and holds from then on.
pub(super) fn lead(values: &[f64]) -> usize {
    let (factor, few) = peaks::averaged(values, A_PERIOD);
    let Some((left, noise)) = unpredicted(&few, LEAD).map(with_noise) else {
        return 0;
    };
    let settled = LEAD.min(left.len())..(LEAD + BEFORE).min(left.len());
    let later = left[settled].iter().copied().fold(0.0, f64::max);
    // One sample too many costs little.
    let least = (0.5 * NOISE * noise).max(1.5 * later);
    let mut at_start = ORDER..LEAD.min(left.len());
    let last = at_start.rfind(|i| left[*i] > least);
    let lead = last.map_or(0, |last| factor * (last + 1 - ORDER));
    match swing(&values[..lead]) < AT_REST * swing(values) {
        true => lead,
        false => 0,
    }
}

/// With the standard deviation of most of the residual.
fn with_noise(left: Vec<f64>) -> (Vec<f64>, f64) {
    let noise = quality::median(&mut left[ORDER..].to_vec()).unwrap_or(0.0) / 0.674_489_75;
    (left, noise)
}

/// Half the peak-to-peak value.
fn swing(values: &[f64]) -> f64 {
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    0.5 * (high - low).max(0.0)
}

/// Ranges from each restart to where the recursion holds again.
fn restarts(values: &[f64]) -> Vec<Range<usize>> {
    let Some((left, noise)) = unpredicted(values, 0).map(with_noise) else {
        return Vec::new();
    };
    let least = (NOISE * noise).max(SIZE * swing(values));
    let largest = |range: Range<usize>| left[range].iter().copied().fold(0.0, f64::max);
    let mut found = Vec::new();
    let mut from = ORDER;
    let mut at = from + ORDER;
    while at < left.len() {
        let before = largest(at.saturating_sub(BEFORE).max(from)..at);
        if left[at] <= least.max(JUMP * before) {
            at += 1;
            continue;
        }
        // The recursion spans the restart for this many samples.
        let near = at..(at + 2 * ORDER).min(left.len());
        let last = near.rev().find(|i| left[*i] > least.max(JUMP * before));
        let end = last.unwrap_or(at) + 1;
        found.push(at..end);
        from = (end + ORDER).min(left.len());
        at = from + ORDER;
    }
    found
}

/// Magnitude of the prediction error of the recursion, fitted from a sample on, at each sample from the first predicted
/// one; `None` if there are too few.
fn unpredicted(values: &[f64], fitted_from: usize) -> Option<Vec<f64>> {
    let rows = values.len().checked_sub(fitted_from + ORDER)?;
    if rows < 4 * ORDER {
        return None;
    }
    let (mut equations, right) = equations(&values[fitted_from..]);
    for i in 0..=ORDER {
        equations[(i, i)] *= 1.0 + RIDGE;
    }
    let solved = equations.cholesky()?.solve(&right);
    let (weights, offset) = (&solved.as_slice()[..ORDER], solved[ORDER]);
    let none = std::iter::repeat_n(0.0, ORDER);
    let left = values.windows(ORDER + 1).map(|window| {
        let before = window[..ORDER].iter().rev();
        let predicted: f64 = before.zip(weights).map(|(x, a)| x * a).sum();
        (window[ORDER] - predicted - offset).abs()
    });
    Some(none.chain(left).collect())
}

/// Normal equations of the recursion, without forming its rows: a lagged product sum differs from that with both lags
/// one less by its first and last term.
fn equations(values: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
    let rows = values.len() - ORDER;
    // Column k of the rows, k samples before the predicted one; the last is 1. Lag 0 is the right-hand side.
    let at = |lag: usize| &values[ORDER - lag..][..rows];
    let mut products = DMatrix::zeros(ORDER + 1, ORDER + 1);
    for lag in 0..=ORDER {
        products[(0, lag)] = at(0).iter().zip(at(lag)).map(|(x, y)| x * y).sum::<f64>();
    }
    for i in 1..=ORDER {
        for j in i..=ORDER {
            let [first, last] = [0, rows].map(|k| values[ORDER - i + k] * values[ORDER - j + k]);
            products[(i, j)] = products[(i - 1, j - 1)] + first - last;
        }
    }
    let total: f64 = at(0).iter().sum();
    let mut sums = vec![total];
    for lag in 1..=ORDER {
        let [first, last] = [0, rows].map(|k| values[ORDER - lag + k]);
        sums.push(sums[lag - 1] + first - last);
    }
    let matrix = DMatrix::from_fn(ORDER + 1, ORDER + 1, |i, j| match (i.min(j), i.max(j)) {
        (ORDER, ORDER) => rows as f64,
        (k, ORDER) => sums[k + 1],
        (i, j) => products[(i + 1, j + 1)],
    });
    let right = DVector::from_fn(ORDER + 1, |k, _| match k {
        ORDER => total,
        _ => products[(0, k + 1)],
    });
    (matrix, right)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Closed-form decays of a stand, each from a sample on with its amplitude.
    fn decays(hits: &[(usize, f64)], noise: f64, count: usize) -> Vec<f64> {
        let mut state = 1_u64;
        let one = |i: usize| {
            let from = |(at, size): &(usize, f64)| {
                let t = i.checked_sub(*at).map_or(0.0, |t| t as f64);
                size * (-0.003 * t).exp() * (0.2 * t).sin()
            };
            hits.iter().map(from).sum::<f64>()
        };
        let noise = |_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            noise * ((state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5)
        };
        let noise: Vec<f64> = (0..count).map(noise).collect();
        (0..count).map(|i| one(i) + noise[i]).collect()
    }

    #[test]
    fn a_second_hit_is_found_and_a_decay_is_one_part() {
        for noise in [0.0, 1e-3, 1e-2, 0.1] {
            let one = decays(&[(0, 1.0)], noise, 3000);
            let found = parts(&one, 40);
            assert_eq!((found.len(), &found[0]), (1, &(0..3000)), "noise {noise}");
        }
        for (at, size) in [(200, -0.4), (500, 0.3), (1000, 0.1)] {
            let two = decays(&[(0, 1.0), (at, size)], 1e-3, 3000);
            let found = parts(&two, 40);
            assert_eq!(found.len(), 2, "at {at}: {found:?}");
            // The sine is still zero at the hit.
            assert!(found[0].end.abs_diff(at) < 3, "{found:?}");
            assert!((at..at + 40).contains(&found[1].start), "{found:?}");
        }
    }

    #[test]
    fn a_preload_before_its_release_is_no_decay() {
        for noise in [1e-4, 1e-3] {
            for before in [0, 4, 20] {
                let mut released = decays(&[(0, 1.0)], noise, 3000);
                // cos instead of sin: a quarter of a period later.
                released.drain(..8);
                let first = released[0];
                let held = decays(&[(0, 0.0)], noise, before);
                released.splice(0..0, held.iter().map(|x| x + first));
                let found = lead(&released);
                assert!(found.abs_diff(before) < 3, "{noise} {before}: {found}");
            }
        }
    }

    #[test]
    fn lost_samples_and_an_overload_are_found() {
        let mut joined = decays(&[(0, 1.0)], 1e-3, 3000);
        joined.drain(300..315);
        let found = parts(&joined, 40);
        assert_eq!(found.len(), 2);
        assert!(found[0].end.abs_diff(300) < 3, "{found:?}");
        let mut over = decays(&[(0, 1.0)], 1e-3, 3000);
        over[..100].fill(1.0);
        let found = parts(&over, 40);
        // The overload does not ring.
        assert_eq!(found.len(), 1);
        assert!((100..140).contains(&found[0].start), "{found:?}");
    }
}
