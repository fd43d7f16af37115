//! Curves of the measuring chain: a law `y = f(x)` that acts sample by sample, and its inverse around zero.

use super::{Action, Distortion, SampleClock, Unrecovered};

/// Steepest part of an inverse curve that is followed: beyond, a sample says more about its noise than about the
/// signal.
const STEEPEST: f64 = 10.0;
/// Places on either side of zero at which a curve is looked at.
const PLACES: usize = 2000;
/// Halvings that find the end of a branch.
const HALVINGS: usize = 40;
/// Part of the largest sample by which a sample may be off after the curve has been gone back and forth.
const BACK_AND_FORTH: f64 = 1e-6;

/// A curve.
struct Curve<F, G> {
    law: F,
    /// Inverse on the branch around zero; anything beyond it.
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

    /// On the rising branch around zero; the samples beyond it go on along a straight line.
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
    /// How far from zero towards an end the curve can be inverted.
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
