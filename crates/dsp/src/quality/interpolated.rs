//! Samples on straight lines between every k-th one: a record interpolated to a higher rate before.

/// Largest ratio of the rates searched for.
const MOST: usize = 64;
/// Least number of bends.
const FEWEST: usize = 50;
/// Largest rms of the bends elsewhere, relative to that at the knots.
const STRAIGHT: f64 = 0.05;
/// Bend relative to the rms of all at the knots from which it counts as one, and least variation of their magnitudes,
/// relative to the mean: those of a triangular wave are all the same.
const BENT: f64 = 0.05;
const VARIES: f64 = 0.2;

/// An interpolation by straight lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interpolated {
    /// Samples from one knot to the next.
    pub every: usize,
    /// Index of the first knot.
    pub first: usize,
}

/// Detects samples that lie on straight lines between every `k`-th of them, `k` up to 64, apart from rounding and noise.
///
/// The second differences of such a record are zero but at the knots. `k` is the largest number for which their rms at one
/// of its `k` phases is at least 20 times that at all others. At least 50 knots must bend the line, by magnitudes that
/// differ: a triangular wave bends at regular times as well, always by the same angle.
///
/// ```
/// use torqcomp_dsp::quality::interpolated::interpolated;
/// let recorded: Vec<f64> = (0..500).map(|i| (0.7 * f64::from(i)).sin()).collect();
/// let finer = |i: usize| {
///     let (at, part) = (i / 4, (i % 4) as f64 / 4.0);
///     recorded[at] * (1.0 - part) + recorded[at + 1] * part
/// };
/// let finer: Vec<f64> = (0..1990).map(finer).collect();
/// assert_eq!(interpolated(&finer[1..]).map(|found| (found.every, found.first)), Some((4, 3)));
/// assert_eq!(interpolated(&recorded), None);
/// ```
#[must_use]
pub fn interpolated(samples: &[f64]) -> Option<Interpolated> {
    let bends: Vec<f64> = samples
        .windows(3)
        .map(|w| w[0] - 2.0 * w[1] + w[2])
        .collect();
    if bends.iter().any(|bend| !bend.is_finite()) {
        return None;
    }
    let squared: Vec<f64> = bends.iter().map(|bend| bend * bend).collect();
    let most = MOST.min(bends.len() / FEWEST);
    (2..=most).rev().find_map(|every| {
        let mut squares = vec![0.0; every];
        for line in squared.chunks(every) {
            for (sum, square) in squares.iter_mut().zip(line) {
                *sum += square;
            }
        }
        let knot = (0..every).max_by(|a, b| squares[*a].total_cmp(&squares[*b]))?;
        let rest = squares.iter().sum::<f64>() - squares[knot];
        let is_straight = rest < STRAIGHT * STRAIGHT * squares[knot] * (every - 1) as f64;
        (is_straight && are_irregular(&bends, knot, every)).then_some(Interpolated {
            every,
            // The bend of a sample is that with its neighbours.
            first: (knot + 1) % every,
        })
    })
}

/// Whether many knots bend the line, by different magnitudes.
fn are_irregular(bends: &[f64], knot: usize, every: usize) -> bool {
    let all = bends.iter().skip(knot).step_by(every).map(|b| b.abs());
    let all: Vec<f64> = all.collect();
    let rms = (all.iter().map(|b| b * b).sum::<f64>() / all.len() as f64).sqrt();
    let bent: Vec<f64> = all.into_iter().filter(|b| *b > BENT * rms).collect();
    let count = bent.len() as f64;
    let mean = bent.iter().sum::<f64>() / count;
    let variance = bent.iter().map(|b| (b - mean).powi(2)).sum::<f64>() / count;
    bent.len() >= FEWEST && variance.sqrt() > VARIES * mean
}

#[cfg(test)]
mod tests {
    use super::super::testing::{noise, sine, sum};
    use super::*;

    fn finer(recorded: &[f64], every: usize) -> Vec<f64> {
        let at = |i: usize| {
            let (k, part) = (i / every, (i % every) as f64 / every as f64);
            recorded[k] * (1.0 - part) + recorded[k + 1] * part
        };
        (0..(recorded.len() - 1) * every).map(at).collect()
    }

    #[test]
    fn straight_lines_are_found_below_rounding() {
        for seed in 0..10 {
            let wave = sine(3.0, 37.3, 4000);
            let quiet: Vec<f64> = noise(seed, 4000).iter().map(|x| 0.01 * x).collect();
            let recorded = sum(&wave, &quiet);
            assert_eq!(interpolated(&recorded), None);
            for every in [2, 3, 4, 10, 20] {
                let finer = finer(&recorded, every);
                let rounded: Vec<f64> = finer.iter().map(|x| (x * 1e5).round() / 1e5).collect();
                let found = interpolated(&rounded[1..]).map(|found| (found.every, found.first));
                assert_eq!(found, Some((every, every - 1)), "{seed} {every}");
            }
        }
    }

    #[test]
    fn what_bends_elsewhere_is_not_interpolated() {
        let count = 20_000;
        let held: Vec<f64> = noise(3, count / 5).iter().flat_map(|x| [*x; 5]).collect();
        let triangle = (0..count).map(|i| (i % 40).abs_diff(20) as f64).collect();
        let spikes = (0..count).map(|i| {
            if i % 50 == 7 {
                1.0 + (i as f64).sin()
            } else {
                0.0
            }
        });
        let steps = (0..count).map(|i| f64::from(i as u32 / 1000 % 2)).collect();
        for record in [
            held,
            triangle,
            spikes.collect(),
            steps,
            noise(4, count),
            vec![1.0; count],
        ] {
            assert_eq!(interpolated(&record), None);
        }
    }
}
