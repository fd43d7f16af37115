//! Static characteristics of the measuring chain: a law `y = f(x)` for each sample, and its inverse around
//! zero.

use super::{Action, Distortion, SampleClock, Unrecovered};

/// Steepest slope of an inverse curve that is used; beyond it the noise gain is too high.
const STEEPEST: f64 = 10.0;
/// Points on either side of zero at which a curve is evaluated.
const PLACES: usize = 2000;
/// Bisections to find the end of a branch.
const HALVINGS: usize = 40;
/// Largest error of a round trip through a curve, relative to the largest sample.
const BACK_AND_FORTH: f64 = 1e-6;

/// A curve.
struct Curve<F, G> {
    law: F,
    /// Inverse on the branch around zero; arbitrary beyond it.
    inverse: G,
}

/// The law `y = f(x)`, with its inverse on the branch around zero.
pub(super) fn curve(
    law: impl Fn(f64) -> f64 + Send + Sync + 'static,
    inverse: impl Fn(f64) -> f64 + Send + Sync + 'static,
) -> Action {
    Action::Distortion(Box::new(Curve { law, inverse }))
}

impl<F, G> Distortion for Curve<F, G>
where
    F: Fn(f64) -> f64 + Send + Sync,
    G: Fn(f64) -> f64 + Send + Sync,
{
    fn forward(&self, _: SampleClock, samples: &mut [f64]) {
        for sample in samples {
            *sample = (self.law)(*sample);
        }
    }

    fn is_pointwise(&self) -> bool {
        true
    }

    /// Inverts the rising branch around zero; beyond it, extrapolates along a straight line.
    fn inverse(&self, _: SampleClock, _: f64, samples: &mut [f64]) -> Unrecovered {
        let largest = samples.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let ends = [-largest, largest].map(|end| self.branch_end(end));
        let mut beyond = Vec::new();
        for (i, sample) in samples.iter_mut().enumerate() {
            let recorded = *sample;
            let held = recorded.clamp(ends[0], ends[1]);
            *sample = (self.inverse)(held);
            if held != recorded {
                beyond.push(i);
                *sample += STEEPEST * (recorded - held);
            }
        }
        Unrecovered {
            why: format!(
                "the curve cannot be inverted beyond {:.4} to {:.4} of the record in SI units",
                ends[0], ends[1]
            ),
            samples: beyond,
        }
    }
}

impl<F: Fn(f64) -> f64, G: Fn(f64) -> f64> Curve<F, G> {
    /// Distance from zero, in the direction of `end`, up to which the curve can be inverted.
    fn branch_end(&self, end: f64) -> f64 {
        let step = 1e-6 * end.abs();
        let good = |y: f64| {
            let x = [y - step, y + step].map(&self.inverse);
            let slope = (x[1] - x[0]) / (2.0 * step);
            let x = x.map(&self.law);
            let back = (x[0] + step - y).abs().max((x[1] - step - y).abs());
            slope > 0.0 && slope < STEEPEST && back < BACK_AND_FORTH * end.abs()
        };
        if end == 0.0 {
            return end;
        }
        let place = |k: usize| end * k as f64 / PLACES as f64;
        let Some(first) = (1..=PLACES).find(|k| !good(place(*k))) else {
            return end;
        };
        let (mut low, mut high) = (place(first - 1), place(first));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if good(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }
}
