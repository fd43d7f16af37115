//! Resampling of samples with irregular time stamps onto a uniform grid.

use std::collections::VecDeque;

use schemars::JsonSchema;
use serde::Serialize;

use crate::Error;

/// Number of interpolation points where the stamps are close enough.
const POINTS: usize = 8;
/// Largest sum of the magnitudes of a polynomial's weights: more would amplify noise, jitter of the stamps and whatever lies
/// between the samples. Through eight points at equal steps it is at most 2.1 in the middle.
const LARGEST_SUM: f64 = 4.0;
/// Longest step, in grid steps, that is interpolated by a polynomial; anything longer is a gap.
const LONGEST_STEP: f64 = 1.5;
/// Longest gap that is bridged, in grid steps.
const LONGEST_GAP: f64 = 10_000.0;
/// Maximum number of grid samples per recorded one, and maximum in any case, up to which gaps are
/// bridged.
const MOST_PER_SAMPLE: usize = 10;
/// Maximum number of listed gaps.
const MOST_NOTED: usize = 10_000;
/// Distance of a stamp from the grid, in grid steps, attributed to rounding.
const COINCIDENT: f64 = 1e-6;

/// What a resampling did.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Resampled {
    /// Input samples.
    pub samples_in: usize,
    /// Output samples.
    pub samples_out: usize,
    /// Samples dropped because their stamp repeats the previous one.
    pub repeated: usize,
    /// Steps longer than 1.5 grid steps, bridged by a straight line.
    pub gaps: usize,
    /// Grid samples that lie within such gaps.
    pub bridged: usize,
    /// Grid samples next to stamps too close together for a polynomial, interpolated by a straight line.
    pub uneven: usize,
    /// Longest step of the stamps, in seconds.
    pub longest_step_s: f64,
    /// Largest distance of a stamp from the uniform step, as a fraction of the step, gaps aside.
    pub largest_jitter: f64,
    /// The gaps, the first 10 000 of them.
    #[serde(skip)]
    pub bridged_gaps: Vec<BridgedGap>,
}

/// A bridged gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BridgedGap {
    /// Time of the preceding sample, in s from the start of the grid.
    pub from_s: f64,
    /// Time of the following sample.
    pub to_s: f64,
    /// Number of grid samples in the gap.
    pub samples: usize,
}

/// Interpolates stamped samples on the grid `t₀ + k Δt`, `t₀` being the first stamp.
///
/// Between close stamps the polynomial through the eight nearest points is used (four on each side,
/// Lagrange interpolation), across a gap and next to stamps that nearly coincide a straight line. Streaming: results are
/// output as soon as the points after them are available.
#[derive(Debug)]
pub struct Resampler {
    step_s: f64,
    start_s: f64,
    /// Whether the grid begins at the first stamp.
    begins_at_first: bool,
    next: usize,
    points: VecDeque<(f64, f64)>,
    done: Resampled,
}

impl Resampler {
    /// A resampler to a grid step in seconds.
    ///
    /// # Errors
    /// [`Error::NotPositive`] for a step that is not positive.
    ///
    /// ```
    /// use torqcomp_dsp::resample::Resampler;
    /// let mut out = Vec::new();
    /// let mut resampler = Resampler::new(0.5)?;
    /// // x = t² is a polynomial: it comes back exactly, whatever the stamps.
    /// for t in [0.0_f64, 0.45, 1.1, 1.5, 2.0, 2.4, 3.1, 3.5, 4.0] {
    ///     resampler.push(t, t * t, &mut out)?;
    /// }
    /// let done = resampler.finish(&mut out);
    /// assert_eq!(out.len(), 9);
    /// assert!(out.iter().enumerate().all(|(k, x)| (x - (0.5 * k as f64).powi(2)).abs() < 1e-12));
    /// assert_eq!(done.gaps, 0);
    /// # Ok::<(), torqcomp_dsp::Error>(())
    /// ```
    pub fn new(step_s: f64) -> Result<Self, Error> {
        if !(step_s > 0.0 && step_s.is_finite()) {
            return Err(Error::NotPositive {
                name: "grid step",
                value: step_s,
            });
        }
        Ok(Self {
            step_s,
            start_s: 0.0,
            begins_at_first: true,
            next: 0,
            points: VecDeque::new(),
            done: Resampled::default(),
        })
    }

    /// A resampler to a grid `start_s + k step_s` that begins at or after the first stamp, so that
    /// several channels share one grid.
    ///
    /// # Errors
    /// [`Error::NotPositive`] for a step that is not positive.
    ///
    /// ```
    /// use torqcomp_dsp::resample::Resampler;
    /// let mut out = Vec::new();
    /// let mut resampler = Resampler::on_grid(0.5, 0.75)?;
    /// for t in 0..20 {
    ///     resampler.push(0.5 * f64::from(t), f64::from(t * t), &mut out)?;
    /// }
    /// resampler.finish(&mut out);
    /// // t = 0.75 s lies between the second and the third sample: 1.5².
    /// assert!((out[0] - 2.25).abs() < 1e-12 && out.len() == 18);
    /// # Ok::<(), torqcomp_dsp::Error>(())
    /// ```
    pub fn on_grid(step_s: f64, start_s: f64) -> Result<Self, Error> {
        Ok(Self {
            start_s,
            begins_at_first: false,
            ..Self::new(step_s)?
        })
    }

    /// Takes a stamped sample; finished grid values are appended to `out`.
    ///
    /// # Errors
    /// [`Error::TimeNotIncreasing`] if the stamp lies before the last one, [`Error::GapTooLong`] if
    /// it follows a gap of more than 10 000 steps, or if the grid would have ten times as many
    /// samples as were recorded. A repeated stamp is skipped and counted.
    pub fn push(&mut self, time_s: f64, value: f64, out: &mut Vec<f64>) -> Result<(), Error> {
        let index = self.done.samples_in;
        self.done.samples_in += 1;
        match self.points.back() {
            None if self.begins_at_first => self.start_s = time_s,
            None => {}
            Some(&(last, _)) if time_s == last => {
                self.done.repeated += 1;
                return Ok(());
            }
            Some(&(previous_s, _)) if time_s < previous_s => {
                return Err(Error::TimeNotIncreasing {
                    index,
                    time_s,
                    previous_s,
                });
            }
            Some(&(last, _)) => self.note_step(last, time_s)?,
        }
        self.points.push_back((time_s, value));
        // All values up to the middle of the eight points have all their neighbours.
        while self.points.len() >= POINTS && self.grid_time() < self.points[POINTS / 2].0 {
            self.emit(out);
        }
        while self.points.len() > POINTS && self.grid_time() >= self.points[POINTS / 2].0 {
            self.points.pop_front();
        }
        while self.points.len() >= POINTS && self.grid_time() < self.points[POINTS / 2].0 {
            self.emit(out);
        }
        Ok(())
    }

    /// Outputs the rest up to the last stamp.
    pub fn finish(mut self, out: &mut Vec<f64>) -> Resampled {
        if let Some(&(last, _)) = self.points.back() {
            while self.grid_time() <= last + COINCIDENT * self.step_s {
                self.emit(out);
            }
        }
        self.done
    }

    fn grid_time(&self) -> f64 {
        self.start_s + self.next as f64 * self.step_s
    }

    fn note_step(&mut self, last: f64, time_s: f64) -> Result<(), Error> {
        let step_s = time_s - last;
        let steps = step_s / self.step_s;
        let sparse = (time_s - self.start_s) / self.step_s
            > LONGEST_GAP + (MOST_PER_SAMPLE * self.done.samples_in) as f64;
        if steps > LONGEST_GAP || sparse {
            return Err(Error::GapTooLong {
                time_s,
                gap_s: step_s,
                steps,
            });
        }
        self.done.longest_step_s = self.done.longest_step_s.max(step_s);
        if step_s > LONGEST_STEP * self.step_s {
            self.done.gaps += 1;
            self.note_gap(last - self.start_s, time_s - self.start_s);
        } else {
            let jitter = (step_s / self.step_s - 1.0).abs();
            self.done.largest_jitter = self.done.largest_jitter.max(jitter);
        }
        Ok(())
    }

    /// Records a gap between two times relative to the start of the grid.
    fn note_gap(&mut self, from_s: f64, to_s: f64) {
        let first = (from_s / self.step_s + COINCIDENT).floor() + 1.0;
        let end = (to_s / self.step_s - COINCIDENT).ceil();
        let samples = (end - first.max(0.0)).max(0.0) as usize;
        if samples > 0 && self.done.bridged_gaps.len() < MOST_NOTED {
            self.done.bridged_gaps.push(BridgedGap {
                from_s,
                to_s,
                samples,
            });
        }
    }

    fn emit(&mut self, out: &mut Vec<f64>) {
        let time_s = self.grid_time();
        let after = self
            .points
            .iter()
            .position(|(t, _)| *t >= time_s)
            .unwrap_or(self.points.len() - 1)
            .max(1)
            .min(self.points.len() - 1);
        let value = if let Some(value) = self.stamped(after, time_s) {
            value
        } else if self.is_gap(after) {
            self.done.bridged += 1;
            self.line(after, time_s)
        } else if let Some(value) = self.polynomial(after, time_s) {
            value
        } else {
            self.done.uneven += 1;
            self.line(after, time_s)
        };
        out.push(value);
        self.next += 1;
        self.done.samples_out += 1;
    }

    /// The sample whose stamp equals the grid time within rounding.
    fn stamped(&self, after: usize, time_s: f64) -> Option<f64> {
        let first = after.saturating_sub(1);
        let near = |point: &&(f64, f64)| (point.0 - time_s).abs() <= COINCIDENT * self.step_s;
        self.points.range(first..=after).find(near).map(|(_, x)| *x)
    }

    fn is_gap(&self, after: usize) -> bool {
        self.points[after].0 - self.points[after - 1].0 > LONGEST_STEP * self.step_s
    }

    fn line(&self, after: usize, time_s: f64) -> f64 {
        let ((t0, x0), (t1, x1)) = (self.points[after - 1], self.points[after]);
        x0 + (x1 - x0) * (time_s - t0) / (t1 - t0)
    }

    /// Lagrange polynomial through up to four points on either side not separated by a gap; `None` if they are too uneven.
    fn polynomial(&self, after: usize, time_s: f64) -> Option<f64> {
        let mut first = after - 1;
        while first > 0 && after - first < POINTS / 2 && !self.is_gap(first) {
            first -= 1;
        }
        let mut last = after;
        while last + 1 < self.points.len()
            && last - after + 1 < POINTS / 2
            && !self.is_gap(last + 1)
        {
            last += 1;
        }
        let nodes: Vec<(f64, f64)> = self.points.range(first..=last).copied().collect();
        let (mut value, mut sum) = (0.0, 0.0);
        for (i, (ti, xi)) in nodes.iter().enumerate() {
            let others = nodes.iter().enumerate().filter(|(j, _)| *j != i);
            let weight: f64 = others
                .map(|(_, (tj, _))| (time_s - tj) / (ti - tj))
                .product();
            value += xi * weight;
            sum += weight.abs();
        }
        (sum <= LARGEST_SUM).then_some(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resample(stamps: &[f64], signal: impl Fn(f64) -> f64, step: f64) -> (Vec<f64>, Resampled) {
        let mut out = Vec::new();
        let mut resampler = Resampler::new(step).unwrap();
        for t in stamps {
            resampler.push(*t, signal(*t), &mut out).unwrap();
        }
        let done = resampler.finish(&mut out);
        (out, done)
    }

    #[test]
    fn jittered_sine_comes_back() {
        let stamps: Vec<f64> = (0..2000)
            .map(|i| 1e-3 * (f64::from(i) + 0.2 * (f64::from(i) * 1.7).sin()))
            .collect();
        let signal = |t: f64| (std::f64::consts::TAU * 60.0 * t).sin();
        let (out, done) = resample(&stamps, signal, 1e-3);
        assert_eq!(done.gaps, 0);
        assert!(done.largest_jitter > 0.2 && done.largest_jitter < 0.45);
        for (k, x) in out.iter().enumerate() {
            // One-sided interpolation only within four samples of an end.
            let bound = if (4..out.len() - 4).contains(&k) {
                5e-6
            } else {
                2e-2
            };
            let want = signal(stamps[0] + 1e-3 * k as f64);
            assert!((x - want).abs() < bound, "{k}: {x} {want}");
        }
    }

    #[test]
    fn stamps_that_nearly_coincide_amplify_nothing() {
        let stamps: Vec<f64> = (0..400)
            .map(|i| f64::from(i) + [0.0, 0.0, 0.0, 0.49, -0.49, 0.0, 0.0][i as usize % 7])
            .collect();
        let (out, done) = resample(&stamps, |t| (0.9 * t).sin(), 1.0);
        assert!(out.iter().all(|x| x.abs() <= 1.2), "{out:?}");
        assert!(done.uneven > 50 && done.gaps == 0, "{done:?}");
    }

    #[test]
    fn gaps_are_bridged_and_repeats_left_out() {
        let stamps = [0.0, 1.0, 2.0, 2.0, 3.0, 7.0, 8.0, 9.0];
        let (out, done) = resample(&stamps, |t| 2.0 * t, 1.0);
        assert_eq!(out.len(), 10);
        assert!(
            out.iter()
                .enumerate()
                .all(|(k, x)| (x - 2.0 * k as f64).abs() < 1e-12)
        );
        assert_eq!((done.gaps, done.repeated, done.bridged), (1, 1, 3));
        assert_eq!((done.samples_in, done.samples_out), (8, 10));
        assert_eq!(done.longest_step_s, 4.0);
        let gap = |from_s, to_s, samples| BridgedGap {
            from_s,
            to_s,
            samples,
        };
        assert_eq!(done.bridged_gaps, [gap(3.0, 7.0, 3)]);
        // Relative to the first stamp, and between stamps off the grid.
        let stamps = [10.0, 11.1, 13.9, 15.0, 18.0];
        let (_, done) = resample(&stamps, |t| t, 1.0);
        let [first, second] = done.bridged_gaps[..] else {
            panic!("{done:?}");
        };
        assert!((first.from_s - 1.1).abs() < 1e-12 && (first.to_s - 3.9).abs() < 1e-12);
        assert_eq!((first.samples, second), (2, gap(5.0, 8.0, 2)));
        assert_eq!(done.bridged, 4);
    }

    #[test]
    fn clock_jumps_are_not_bridged() {
        let mut out = Vec::new();
        let mut resampler = Resampler::new(1e-3).unwrap();
        resampler.push(0.0, 0.0, &mut out).unwrap();
        let refused = resampler.push(1e6, 0.0, &mut out);
        assert!(
            matches!(refused, Err(Error::GapTooLong { .. })),
            "{refused:?}"
        );
        // Nor are many gaps, each of them acceptable.
        let mut resampler = Resampler::new(1e-3).unwrap();
        let refused =
            (0..1000).find_map(|i| resampler.push(5.0 * f64::from(i), 0.0, &mut out).err());
        assert!(matches!(refused, Some(Error::GapTooLong { .. })));
        assert!(out.len() < 30_000);
    }

    #[test]
    fn backward_time_is_refused() {
        let mut out = Vec::new();
        let mut resampler = Resampler::new(1.0).unwrap();
        resampler.push(0.0, 0.0, &mut out).unwrap();
        resampler.push(1.0, 0.0, &mut out).unwrap();
        let error = resampler.push(0.5, 0.0, &mut out).unwrap_err();
        assert!(matches!(error, Error::TimeNotIncreasing { index: 2, .. }));
    }

    #[test]
    fn one_sample_is_kept() {
        assert_eq!(resample(&[3.0], |t| t, 1.0).0, vec![3.0]);
    }
}
