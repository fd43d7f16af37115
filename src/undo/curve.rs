//! Curves, ranges and courses of the measuring chain, taken back sample by sample.

use torqcomp_model::effects::{Clock, Transform};

/// Steepest part of an inverse curve that is followed: beyond, a sample says more about its noise than about the
/// signal.
const STEEPEST: f64 = 10.0;
/// Places on either side of zero at which a curve is looked at.
const PLACES: usize = 2000;
/// Halvings that find the end of a branch.
const HALVINGS: usize = 40;
/// Part of the largest sample by which a sample may be off after the curve has been gone back and forth.
const BACK_AND_FORTH: f64 = 1e-6;
/// Standard deviations of the noise within which a sample counts as at the limit.
const AT_LIMIT: f64 = 3.0;
/// Part of the limit within which a sample counts as at it.
const RELATIVE: f64 = 1e-9;

/// Part of a curve's range that is inverted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Branch {
    /// Its ends, as recorded.
    pub ends: [f64; 2],
}

/// Takes a curve back on the rising branch around zero; the samples beyond it, which go on along a straight line.
pub fn invert(
    apply: &Transform,
    undo: &Transform,
    clock: Clock,
    samples: &mut [f64],
) -> (Branch, Vec<usize>) {
    let largest = samples.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let ends = [-largest, largest].map(|end| branch_end(apply, undo, end));
    let mut beyond = Vec::new();
    let recorded = samples.to_vec();
    for (i, sample) in samples.iter_mut().enumerate() {
        let held = sample.clamp(ends[0], ends[1]);
        if held != *sample {
            beyond.push(i);
            *sample = held;
        }
    }
    undo(clock, samples);
    for i in &beyond {
        let end = recorded[*i].clamp(ends[0], ends[1]);
        samples[*i] += STEEPEST * (recorded[*i] - end);
    }
    (Branch { ends }, beyond)
}

/// How far from zero towards an end a curve can be inverted.
fn branch_end(apply: &Transform, undo: &Transform, end: f64) -> f64 {
    let now = Clock { step_s: 0.0 };
    let step = 1e-6 * end.abs();
    let good = |y: f64| {
        let mut x = [y - step, y + step];
        undo(now, &mut x);
        let slope = (x[1] - x[0]) / (2.0 * step);
        apply(now, &mut x);
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

/// Samples at the limits of a range: nothing is known of them but that they lie there or beyond.
pub fn at_limit(apply: &Transform, samples: &[f64], noise_std: f64) -> ([f64; 2], Vec<usize>) {
    let largest = samples
        .iter()
        .fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
    let mut limits = [-1e3 * largest, 1e3 * largest];
    let now = Clock { step_s: 0.0 };
    apply(now, &mut limits);
    let near = |limit: f64| AT_LIMIT * noise_std + RELATIVE * limit.abs();
    let lost = |y: &f64| *y <= limits[0] + near(limits[0]) || *y >= limits[1] - near(limits[1]);
    let places = samples.iter().enumerate().filter(|(_, y)| lost(y));
    (limits, places.map(|(i, _)| i).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use torqcomp_model::effects::{Action, Effect};

    const CLOCK: Clock = Clock { step_s: 1e-3 };

    fn curve(effect: &str, form: &str, values: &[f64]) -> (Transform, Option<Transform>) {
        let form = Effect::named(effect).unwrap().form(Some(form)).unwrap();
        match (form.build)(values) {
            Action::Transform { apply, undo } => (apply, undo),
            _ => panic!("not a curve"),
        }
    }

    #[test]
    fn a_fold_ends_the_branch_and_is_told() {
        // x + x²/10 has its least value −2.5 at −5; its inverse has slope 10 where 1 + x/5 = 1/10.
        let (apply, undo) = curve("gage-nonlinearity", "square", &[0.1]);
        let mut samples = [1.0, 2.0, -2.4, -2.6, -4.0];
        let (branch, beyond) = invert(&apply, &undo.unwrap(), CLOCK, &mut samples);
        assert!((branch.ends[0] + 2.475).abs() < 1e-3, "{branch:?}");
        assert_eq!(beyond, [3, 4]);
        assert!((samples[0] + 0.1 * samples[0] * samples[0] - 1.0).abs() < 1e-12);
        assert!(samples[4] < samples[3] && samples[3] < -4.5, "{samples:?}");
    }

    #[test]
    fn a_clipped_sample_is_told() {
        let (apply, undo) = curve("saturation", "uneven", &[2.0, -1.0]);
        assert!(undo.is_none());
        let (limits, lost) = at_limit(&apply, &[0.0, 2.0, 1.9, -1.0, 1.99], 0.01);
        assert_eq!((limits, lost), ([-1.0, 2.0], vec![1, 3, 4]));
    }
}
