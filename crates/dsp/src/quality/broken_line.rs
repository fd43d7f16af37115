//! Rounded time stamps with missing samples.

use std::ops::Range;

use super::rounding::{FEWEST, FINE, Rounded, quantum, simplest, slopes};

/// Coarsely rounded stamps of a uniform time axis with missing samples.
#[derive(Debug, Clone, PartialEq)]
pub struct BrokenLine {
    /// The axis between the breaks.
    pub line: Rounded,
    /// Locations of missing samples.
    pub breaks: Vec<Break>,
}

/// A break where samples are missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Break {
    /// Index of the first sample after the break.
    pub index: usize,
    /// Number of missing samples, as precisely as the stamps show.
    pub missing: usize,
}

/// Minimum quantum relative to the step; with finer stamps each gap shows by itself.
const COARSE: f64 = 0.25;
/// Minimum average number of samples between breaks; more frequent breaks are jitter.
const BETWEEN_BREAKS: usize = 50;
/// Number of breaks allowed beyond that average.
const AT_ONCE: usize = 3;
/// Relative difference within which steps equal that of the line, whose slope is uncertain for few stamps.
const EQUAL: f64 = 0.05;
/// Largest deviation of the number of missing samples from an integer.
const WHOLE: f64 = 0.3;

impl BrokenLine {
    /// A piecewise straight line of one step `b` through rounded stamps `tᵢ`: within a piece, an `a` exists with
    /// `tᵢ ≤ a + b i ≤ tᵢ + q` for the quantum `q`, and from piece to piece `a` rises by a whole number of steps, the
    /// missing samples. `None` if the stamps are not coarse, decrease, have too many breaks, or miss a non-integer
    /// number of samples.
    ///
    /// ```
    /// use torqcomp_dsp::quality::broken_line::{Break, BrokenLine};
    /// // 2 kHz in whole milliseconds; the samples 400 to 409 are missing.
    /// let stamps: Vec<f64> = (0..1000).filter(|i| !(400..410).contains(i)).map(|i| f64::from(i / 2) * 1e-3).collect();
    /// let found = BrokenLine::of(&stamps).unwrap();
    /// assert!((found.line.step_s - 0.5e-3).abs() < 1e-9);
    /// assert_eq!(found.breaks, [Break { index: 400, missing: 10 }]);
    /// ```
    #[must_use]
    pub fn of(stamps_s: &[f64]) -> Option<Self> {
        let rises = stamps_s.is_sorted() && stamps_s.iter().all(|t| t.is_finite());
        if stamps_s.len() < FEWEST || !rises {
            return None;
        }
        let first = stamps_s[0];
        let span_s = stamps_s[stamps_s.len() - 1] - first;
        let quantum_s = quantum(FINE, span_s, stamps_s.iter().copied())?;
        let in_quanta = |(i, t): (usize, &f64)| (i as f64, ((t - first) / quantum_s).round());
        let points: Vec<(f64, f64)> = stamps_s.iter().enumerate().map(in_quanta).collect();
        let any = [0.0, f64::INFINITY];
        let longest = pieces(&points, any)?.into_iter().max_by_key(Range::len)?;
        let mut steps = within(&points[longest], any)?;
        let pieces = pieces(&points, steps)?;
        for piece in &pieces {
            steps = within(&points[piece.clone()], steps)?;
        }
        let is_coarse = steps[0] > 0.0 && COARSE * steps[1] < 1.0;
        // Where most steps are equal, or there are single steps among equal ones of one quantum, each gap shows
        // by itself.
        let step = simplest(steps.map(|step| step * quantum_s)) / quantum_s;
        let others = |step: f64| {
            let other = |pair: &&[(f64, f64)]| ((pair[1].1 - pair[0].1) / step - 1.0).abs() > EQUAL;
            points.windows(2).filter(other).count()
        };
        let are_equal = 2 * others(step) + 2 < points.len() || others(1.0) < AT_ONCE;
        if !is_coarse || are_equal {
            return None;
        }
        Some(Self {
            line: Rounded {
                step_s: step * quantum_s,
                steps_s: steps.map(|step| step * quantum_s),
                quantum_s,
                farthest_s: 0.5 * quantum_s,
            },
            breaks: breaks(&points, &pieces, step)?,
        })
    }

    /// Index of each sample on the axis, counting missing ones.
    pub fn places(&self, samples: usize) -> impl Iterator<Item = usize> {
        let (mut breaks, mut missing) = (self.breaks.iter().peekable(), 0);
        (0..samples).map(move |index| {
            while let Some(found) = breaks.next_if(|found| found.index <= index) {
                missing += found.missing;
            }
            index + missing
        })
    }

    /// Number of samples missing.
    #[must_use]
    pub fn missing(&self) -> usize {
        self.breaks.iter().map(|found| found.missing).sum()
    }
}

/// Consecutive pieces, each as long as a line with a slope in the range explains.
fn pieces(points: &[(f64, f64)], range: [f64; 2]) -> Option<Vec<Range<usize>>> {
    let (mut found, mut start) = (Vec::new(), 0);
    while start < points.len() {
        let rest = &points[start..];
        let fits = |length: usize| within(&rest[..length], range).is_some();
        let mut good = 1;
        let mut bad = rest.len() + 1;
        while good + 1 < bad {
            // Doubled until too long, then bisected.
            let next = if bad > rest.len() {
                (2 * good).min(rest.len())
            } else {
                usize::midpoint(good, bad)
            };
            if fits(next) { good = next } else { bad = next }
        }
        found.push(start..start + good);
        start += good;
        if found.len() > AT_ONCE + start / BETWEEN_BREAKS {
            return None;
        }
    }
    Some(found)
}

/// The range of slopes that explain a piece; a single point allows all.
fn within(piece: &[(f64, f64)], range: [f64; 2]) -> Option<[f64; 2]> {
    match piece.len() {
        ..2 => Some(range),
        _ => slopes(piece, range),
    }
}

/// Number of missing samples between pieces.
fn breaks(points: &[(f64, f64)], pieces: &[Range<usize>], step: f64) -> Option<Vec<Break>> {
    // The middle of the offsets that explain a piece.
    let offset = |piece: &Range<usize>| {
        let over = points[piece.clone()]
            .iter()
            .map(|(i, stamp)| stamp - step * i);
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = over.fold(ends, |(low, high), at| (low.min(at), high.max(at)));
        0.5 * (low + high + 1.0)
    };
    let between = |pair: &[Range<usize>]| {
        let steps = (offset(&pair[1]) - offset(&pair[0])) / step;
        let missing = steps.round();
        let is_whole = missing >= 1.0 && (steps - missing).abs() <= WHOLE.max(0.5 / step);
        is_whole.then_some(Break {
            index: pair[1].start,
            missing: missing as usize,
        })
    };
    pieces.windows(2).map(between).collect()
}

#[cfg(test)]
mod tests {
    use super::super::testing::noise;
    use super::*;

    /// Time stamps at a rate, with this many decimals, without the samples of a range.
    fn stamps(rate_hz: f64, decimals: i32, count: usize, lost: Range<usize>) -> Vec<f64> {
        let scale = 10_f64.powi(decimals);
        let kept = (0..count).filter(|i| !lost.contains(i));
        kept.map(|i| (i as f64 / rate_hz * scale).round() / scale)
            .collect()
    }

    #[test]
    fn lost_samples_are_found_where_the_digits_allow_it() {
        for (rate_hz, decimals, count, lost) in [
            (2000.0, 3, 8000, 4000..4040),
            (2000.0, 3, 8000, 3..43),
            (5000.0, 3, 20_000, 9000..9100),
            (1500.0, 3, 8000, 4000..4004),
            (2000.0, 0, 60_000, 20_003..24_003),
            // Within one second's stamp.
            (2000.0, 0, 60_000, 20_003..21_003),
            (300.0, 2, 9000, 8000..8007),
        ] {
            let found = BrokenLine::of(&stamps(rate_hz, decimals, count, lost.clone())).unwrap();
            let what = format!("{rate_hz} {decimals} {lost:?}: {found:?}");
            assert!((found.line.step_s * rate_hz - 1.0).abs() < 1e-6, "{what}");
            let [gap] = found.breaks[..] else {
                panic!("{what}");
            };
            let off = gap.missing.abs_diff(lost.len());
            assert!(off <= 1 + lost.len() / 100, "{what}");
            // The next stamp that reveals it lies within a quantum.
            let within = 1.5 * rate_hz / 10_f64.powi(decimals) + 2.0;
            assert!(
                (gap.index as f64 - lost.start as f64).abs() <= within,
                "{what}"
            );
        }
    }

    #[test]
    fn one_gap_among_equal_steps_is_no_rounding() {
        // Eleven of twelve stamps at 10 Hz: a rate of 9.1 Hz in tenths of a second gives the same
        // ones.
        let lost = stamps(10.0, 1, 12, 5..6);
        assert_eq!(BrokenLine::of(&lost), None);
    }

    #[test]
    fn jitter_is_no_gap() {
        for (size, decimals) in [(0.3e-3, 3), (1e-3, 3), (2e-4, 4), (0.8e-3, 3)] {
            for seed in 1..20 {
                let jitter = noise(seed, 4000);
                let scale = 10_f64.powi(decimals);
                let stamps = jitter
                    .iter()
                    .enumerate()
                    .map(|(i, noise)| ((i as f64 * 1.7e-3 + size * noise) * scale).round() / scale);
                let mut stamps: Vec<f64> = stamps.collect();
                stamps.sort_by(f64::total_cmp);
                let found = BrokenLine::of(&stamps);
                let breaks = found.map_or(0, |found| found.breaks.len());
                assert_eq!(breaks, 0, "{size} {decimals} {seed}");
            }
        }
    }
}
