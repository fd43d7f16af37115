//! Jumps of the amplitude of a line in a segment, as a second hit causes.
//!
//! Demodulated at the frequency of the line and averaged over a period, the free decay of a mode is `z(t) = A e^{st}`. On both
//! sides of a time, `z` is fitted with a common `s` and separate amplitudes `A`, which differ at a jump.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::modes::Stretch;

/// Number of points of the demodulated signal per period.
const A_PERIOD: usize = 4;
/// Number of points fitted on either side, and of those next to a jump that its average affects.
const SIDE: (usize, usize) = (20, 3);
/// A smaller number, over which a curved envelope does not look like a jump.
const NEAR: usize = 8;
/// Minimum jump relative to the larger amplitude, and in standard deviations.
const JUMP: (f64, f64) = (0.1, 8.0);
/// Maximum number of jumps of a segment.
const MOST: usize = 3;

/// Times in s from the start of a segment at which the amplitude of a line jumps, the most significant first.
pub(super) fn jumps_s(stretch: &Stretch, period_s: f64) -> Vec<f64> {
    let points = demodulated(stretch, period_s);
    let reach = SIDE.0 + SIDE.1;
    let middles = reach..points.len().saturating_sub(reach);
    let jumps: Vec<f64> = middles.map(|i| jump(&points, i)).collect();
    let mut peaks: Vec<(usize, f64)> = Vec::new();
    let mut rises = false;
    for (i, jump) in jumps.into_iter().enumerate() {
        match peaks.last_mut() {
            Some(peak) if rises && jump > peak.1 => *peak = (i, jump),
            Some(_) if rises && jump > 0.0 => {}
            _ if jump > 0.0 => peaks.push((i, jump)),
            _ => {}
        }
        rises = jump > 0.0;
    }
    peaks.sort_by(|a, b| b.1.total_cmp(&a.1));
    peaks.truncate(MOST);
    let time_s = |peak: &(usize, f64)| (peak.0 + reach) as f64 * period_s / A_PERIOD as f64;
    peaks.iter().map(time_s).collect()
}

/// The segment demodulated at a frequency and averaged over a period around each point.
fn demodulated(stretch: &Stretch, period_s: f64) -> Vec<Complex64> {
    let step_s = period_s / A_PERIOD as f64;
    let mean = stretch.values.iter().sum::<f64>() / stretch.values.len() as f64;
    let count = (stretch.times_s.last().unwrap_or(&0.0) / step_s) as usize + 1;
    let mut sums = vec![(Complex64::ZERO, 0.0); count];
    for (time_s, value) in stretch.times_s.iter().zip(&stretch.values) {
        let turn = Complex64::from_polar(1.0, -TAU * time_s / period_s);
        let sum = &mut sums[(time_s / step_s) as usize];
        sum.0 += turn * (value - mean);
        sum.1 += 1.0;
    }
    let half = A_PERIOD / 2;
    let over = |i: usize| {
        let near = &sums[i.saturating_sub(half)..(i + half).min(count)];
        let total = near
            .iter()
            .fold((Complex64::ZERO, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        total.0 / f64::max(total.1, 1.0)
    };
    (0..count).map(over).collect()
}

/// Jump of the amplitude at a point in standard deviations; 0 if it is too small.
fn jump(points: &[Complex64], middle: usize) -> f64 {
    let [far, near] = [SIDE.0, NEAR].map(|side| Jump::at(points, middle, side));
    let is_jump = near.part.min(far.part) > JUMP.0 && far.sure > JUMP.1;
    if is_jump { far.sure } else { 0.0 }
}

/// A change of the amplitude.
struct Jump {
    /// Relative to the larger amplitude.
    part: f64,
    /// In standard deviations.
    sure: f64,
}

impl Jump {
    /// At a point, from this number of points on either side.
    fn at(points: &[Complex64], middle: usize, side: usize) -> Self {
        let before = &points[middle - SIDE.1 - side..=middle - SIDE.1];
        let after = &points[middle + SIDE.1..=middle + SIDE.1 + side];
        let pairs = || before.windows(2).chain(after.windows(2));
        let products: Complex64 = pairs().map(|pair| pair[0].conj() * pair[1]).sum();
        let ratio = products / pairs().map(|pair| pair[0].norm_sqr()).sum::<f64>();
        // Exponents count from the middle.
        let fitted = |first: i32, values: &[Complex64]| {
            let shape = (first..).map(|k| ratio.powi(k)).take(values.len());
            let pairs: Vec<_> = shape.zip(values).collect();
            let weight: f64 = pairs.iter().map(|(s, _)| s.norm_sqr()).sum();
            let product: Complex64 = pairs.iter().map(|(s, z)| s.conj() * *z).sum();
            let amplitude = product / weight;
            let left = pairs.iter().map(|(s, z)| (*z - amplitude * s).norm_sqr());
            (amplitude, weight, left.sum::<f64>())
        };
        let from = fitted(-((side + SIDE.1) as i32), before);
        let to = fitted(SIDE.1 as i32, after);
        // Averages over a period are independent at one in this many points.
        let own = A_PERIOD as f64;
        let freedom = ((before.len() + after.len()) as f64 - 3.0 * own).max(own);
        let variance = (from.2 + to.2) / freedom * own * (1.0 / from.1 + 1.0 / to.1);
        let size = (to.0 - from.0).norm();
        Self {
            part: size / from.0.norm().max(to.0.norm()),
            sure: size / variance.sqrt().max(f64::MIN_POSITIVE),
        }
    }
}
