//! Drop-outs, standstills, spikes and clipping of a streamed record, piece by piece.

use super::Run;
use super::clipping::{Clipping, Rail, clipping};
use super::spikes::{EVEN, Spike, Spikes, spikes};
use super::stuck::SHORTEST;
use super::stuck::standstills;

/// Number of samples per piece; the last one has up to twice as many.
const PIECE: usize = 1 << 16;
/// Number of samples at the end of a piece that are judged again with the next one.
const OVERLAP: usize = 1 << 10;

/// Faults of a record of any length, in bounded memory. Each piece is judged by itself, as by
/// [`standstills`], [`spikes`] and [`clipping`] on a record of its length.
///
/// ```
/// use torqcomp_dsp::quality::streamed::StreamedFaults;
/// let mut samples: Vec<f64> = (0..300_000).map(|i| 5.0 + (0.1 * f64::from(i)).sin()).collect();
/// samples[200_000..200_008].fill(0.0);
/// let mut faults = StreamedFaults::default();
/// samples.chunks(1000).for_each(|piece| faults.push(piece));
/// let found = faults.finish().standstills.unwrap();
/// assert_eq!((found.count, found.longest.start, found.samples), (1, 200_000, 8));
/// ```
#[derive(Debug, Clone, Default)]
pub struct StreamedFaults {
    /// Samples not judged yet, preceded by those to be judged again.
    kept: Vec<f64>,
    /// Index of the first of them in the record.
    first: usize,
    /// How many of these were already judged.
    judged: usize,
    last: Option<Run>,
    /// Index after the last spike.
    behind_spike: usize,
    found: Faults,
    low: Option<f64>,
    high: Option<f64>,
}

/// Faults of a stream.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Faults {
    /// Intervals in which the channel is stuck.
    pub standstills: Option<Standstills>,
    /// Clipping.
    pub clipping: Option<Clipping>,
    /// Isolated outliers.
    pub spikes: Option<Spikes>,
}

/// Intervals in which a channel is stuck.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standstills {
    /// Number of intervals.
    pub count: usize,
    /// Total number of samples.
    pub samples: usize,
    /// The longest interval.
    pub longest: Run,
}

impl Faults {
    /// For samples scaled by a positive factor.
    #[must_use]
    pub fn scaled(mut self, scale: f64) -> Self {
        if let Some(found) = &mut self.standstills {
            found.longest.value *= scale;
        }
        if let Some(Spikes { first, .. }) = &mut self.spikes {
            first.value *= scale;
            first.before *= scale;
        }
        if let Some(found) = &mut self.clipping {
            for rail in [&mut found.low, &mut found.high].into_iter().flatten() {
                rail.value *= scale;
                rail.spread *= scale;
            }
        }
        self
    }
}

impl Standstills {
    /// Summary of several runs.
    #[must_use]
    pub fn of(runs: &[Run]) -> Option<Self> {
        let one = |run: &Run| Self {
            count: 1,
            samples: run.length,
            longest: *run,
        };
        runs.iter().map(one).reduce(Self::and)
    }

    fn and(self, other: Self) -> Self {
        let is_longer = other.longest.length > self.longest.length;
        Self {
            count: self.count + other.count,
            samples: self.samples + other.samples,
            longest: if is_longer {
                other.longest
            } else {
                self.longest
            },
        }
    }
}

impl StreamedFaults {
    /// Takes the next samples, which must be finite.
    pub fn push(&mut self, samples: &[f64]) {
        self.kept.extend_from_slice(samples);
        while self.kept.len() >= 2 * PIECE + OVERLAP {
            self.judge(PIECE + OVERLAP);
            self.kept.drain(..PIECE);
            self.first += PIECE;
            self.judged = OVERLAP;
        }
    }

    /// Ends the record.
    #[must_use]
    pub fn finish(mut self) -> Faults {
        self.judge(self.kept.len());
        self.close();
        // With samples beyond a rail, the record was not clipped there.
        let is_end = |rail: &Rail, end: Option<f64>| Some(rail.value) == end;
        let clipping = self.found.clipping.map(|clipping| Clipping {
            low: clipping.low.filter(|rail| is_end(rail, self.low)),
            high: clipping.high.filter(|rail| is_end(rail, self.high)),
        });
        Faults {
            clipping: clipping.filter(|clipping| clipping.samples() > 0),
            ..self.found
        }
    }

    fn judge(&mut self, count: usize) {
        let kept = std::mem::take(&mut self.kept);
        let piece = &kept[..count];
        self.lengthen(&piece[self.judged..]);
        if piece.len() > 1 {
            let extremes = Extremes::of(piece);
            let Extremes {
                low, high, step, ..
            } = extremes;
            self.low = Some(self.low.map_or(low, |least| least.min(low)));
            self.high = Some(self.high.map_or(high, |largest| largest.max(high)));
            self.look_at_ends(piece, [low, high]);
            if may_stand_still(piece, step) {
                self.look_for_standstills(piece);
            }
            if step > EVEN * extremes.mean_step {
                self.look_for_spikes(piece);
            }
        }
        self.kept = kept;
    }

    /// Extends a standstill that reached the end of the samples judged before.
    fn lengthen(&mut self, more: &[f64]) {
        let end = self.first + self.judged;
        if let Some(last) = self.last.as_mut().filter(|last| last.end() == end) {
            last.length += more.iter().take_while(|x| **x == last.value).count();
        }
    }

    fn look_for_standstills(&mut self, piece: &[f64]) {
        let rails = self
            .found
            .clipping
            .map(|c| [c.low, c.high])
            .unwrap_or_default();
        for run in standstills(piece) {
            let run = Run {
                start: self.first + run.start,
                ..run
            };
            let is_at_rail = rails.iter().flatten().any(|rail| rail.value == run.value);
            let is_known = self.last.is_some_and(|last| run.end() <= last.end());
            if is_at_rail || is_known {
                continue;
            }
            self.close();
            self.last = Some(run);
        }
    }

    fn look_for_spikes(&mut self, piece: &[f64]) {
        for spike in spikes(piece) {
            let index = self.first + spike.index;
            if index < self.behind_spike {
                continue;
            }
            self.behind_spike = index + 1;
            let first = Spike { index, ..spike };
            let all = self.found.spikes.get_or_insert(Spikes { count: 0, first });
            all.count += 1;
        }
    }

    /// Counts the last standstill.
    fn close(&mut self) {
        if let Some(last) = self.last.and_then(|run| Standstills::of(&[run])) {
            let all = &mut self.found.standstills;
            *all = Some(all.map_or(last, |all| all.and(last)));
        }
    }

    /// Tests for clipping at the ends of a piece's range.
    fn look_at_ends(&mut self, piece: &[f64], ends: [f64; 2]) {
        // A clipped peak has at least three equal samples.
        if !has_three_at(piece, ends) {
            return;
        }
        let Some(more) = clipping(piece) else { return };
        let first = self.first;
        let moved = |rail: Rail| Rail {
            first: first + rail.first,
            ..rail
        };
        let all = self.found.clipping.get_or_insert(Clipping {
            low: None,
            high: None,
        });
        all.low = outermost(all.low, more.low.map(moved), -1.0);
        all.high = outermost(all.high, more.high.map(moved), 1.0);
    }
}

/// The outer one of two rails, or both merged if they are equal; samples in the overlap count twice.
fn outermost(a: Option<Rail>, b: Option<Rail>, sign: f64) -> Option<Rail> {
    let (Some(one), Some(other)) = (a, b) else {
        return a.or(b);
    };
    Some(match (one.value * sign).total_cmp(&(other.value * sign)) {
        std::cmp::Ordering::Greater => one,
        std::cmp::Ordering::Less => other,
        std::cmp::Ordering::Equal => Rail {
            samples: one.samples + other.samples,
            runs: one.runs + other.runs,
            longest: one.longest.max(other.longest),
            ..one
        },
    })
}

/// Number of samples per inner loop, which then needs no branch.
const AT_ONCE: usize = 1 << 8;

/// Parts of a piece with some overlap.
fn parts(piece: &[f64], overlap: usize) -> impl Iterator<Item = &[f64]> {
    let starts = (0..piece.len().saturating_sub(overlap)).step_by(AT_ONCE);
    starts.map(move |start| &piece[start..(start + AT_ONCE + overlap).min(piece.len())])
}

/// Result of one pass over a piece.
struct Extremes {
    low: f64,
    high: f64,
    /// Largest step from sample to sample.
    step: f64,
    /// Mean step.
    mean_step: f64,
}

impl Extremes {
    /// For finite samples.
    fn of(piece: &[f64]) -> Self {
        // In lanes, for SIMD.
        const LANES: usize = 8;
        let lesser = |a: f64, b: f64| if a < b { a } else { b };
        let greater = |a: f64, b: f64| if a > b { a } else { b };
        let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        let (mut step, mut sum) = ([0.0; LANES], [0.0; LANES]);
        let (before, behind) = (piece.chunks_exact(LANES), piece[1..].chunks_exact(LANES));
        for (a, b) in before.zip(behind) {
            for lane in 0..LANES {
                low[lane] = lesser(a[lane], low[lane]);
                high[lane] = greater(a[lane], high[lane]);
                let size = (b[lane] - a[lane]).abs();
                step[lane] = greater(size, step[lane]);
                sum[lane] += size;
            }
        }
        let rest = &piece[(piece.len() - 1) / LANES * LANES..];
        let ends = |of: [f64; LANES], rest: f64, better: fn(f64, f64) -> f64| {
            of.into_iter().fold(rest, better)
        };
        let steps = rest.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        Self {
            low: ends(
                low,
                rest.iter().copied().fold(f64::INFINITY, f64::min),
                f64::min,
            ),
            high: ends(
                high,
                rest.iter().copied().fold(f64::NEG_INFINITY, f64::max),
                f64::max,
            ),
            mean_step: (sum.iter().sum::<f64>() + steps.clone().sum::<f64>())
                / (piece.len() - 1) as f64,
            step: ends(step, steps.fold(0.0, f64::max), f64::max),
        }
    }
}

/// Whether three consecutive samples lie at one of the ends.
fn has_three_at(piece: &[f64], [low, high]: [f64; 2]) -> bool {
    parts(piece, 2).any(|part| {
        let three = part.iter().zip(&part[1..]).zip(&part[2..]);
        let count = three.fold(0_u64, |count, ((a, b), c)| {
            count + u64::from((*a == *b) & (*b == *c) & ((*a == low) | (*a == high)))
        });
        count > 0
    })
}

/// Whether [`standstills`] may find something: a long run of equal samples, or a short one next to the largest step of
/// all, as a drop-out has the largest steps.
fn may_stand_still(piece: &[f64], largest: f64) -> bool {
    let are_equal = |run: &[f64]| run.iter().all(|x| *x == run[0]);
    // In a run of twenty, samples ten apart are equal, and so are those between.
    let apart = SHORTEST / 2;
    let mut some = (0..piece.len().saturating_sub(apart)).step_by(apart);
    if some.any(|at| piece[at] == piece[at + apart] && are_equal(&piece[at..=at + apart])) {
        return true;
    }
    let is_largest = |pair: &[f64]| (pair[1] - pair[0]).abs() == largest;
    let has_largest = |part: &[f64]| {
        let steps = part.iter().zip(&part[1..]);
        steps.fold(false, |any, (a, b)| any | ((b - a).abs() == largest))
    };
    let mut with_it = parts(piece, 1)
        .enumerate()
        .filter(|(_, part)| has_largest(part));
    with_it.any(|(number, part)| {
        let steps = part.windows(2).enumerate();
        let mut these = steps.filter(|(_, pair)| is_largest(pair));
        these.any(|(place, _)| {
            let behind = number * AT_ONCE + place + 1;
            piece.get(behind..behind + 3).is_some_and(are_equal)
                || behind >= 3 && are_equal(&piece[behind - 3..behind])
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::testing::{noise, rounded, sine, sum};
    use super::*;

    fn of(samples: &[f64], piece: usize) -> Faults {
        let mut faults = StreamedFaults::default();
        samples.chunks(piece).for_each(|part| faults.push(part));
        faults.finish()
    }

    #[test]
    fn faults_anywhere_are_found_once_and_good_records_left_alone() {
        let count = 400_000;
        let good = sum(&sine(2.0, 97.0, count), &noise(4, count));
        let good: Vec<f64> = rounded(&good, 1e-4).iter().map(|x| x + 50.0).collect();
        assert_eq!(of(&good, 8192), Faults::default());
        // In the first piece, across the ends of pieces, in the overlap, and at the end.
        for start in [
            3000,
            PIECE - 5,
            PIECE + OVERLAP - 6,
            2 * PIECE + 3,
            count - 40,
        ] {
            for piece in [777, 8192, count] {
                let mut dropped = good.clone();
                dropped[start..start + 12].fill(0.0);
                let found = of(&dropped, piece).standstills.unwrap();
                let all = (found.count, found.longest.start, found.samples);
                assert_eq!(all, (1, start, 12), "{piece}");
            }
        }
        // Longer than a piece.
        let mut stuck = good.clone();
        stuck[70_000..290_000].fill(50.5);
        let found = of(&stuck, 8192).standstills.unwrap();
        let all = (found.count, found.longest.start, found.samples);
        assert_eq!(all, (1, 70_000, 220_000));
    }

    #[test]
    fn clipping_is_that_of_the_whole_record() {
        let count = 400_000;
        let whole = sine(2.0, 97.3, count);
        let mut cut = whole.clone();
        cut[300_000..].iter_mut().for_each(|x| *x = x.min(1.5));
        // The signal exceeds the level elsewhere, so the recorder did not clip it.
        assert_eq!(of(&cut, 8192).clipping, None);
        let small = cut.iter().enumerate();
        let small: Vec<f64> = small
            .map(|(i, x)| if i < 300_000 { 0.5 * x } else { *x })
            .collect();
        let found = of(&small, 8192).clipping.unwrap().high.unwrap();
        assert_eq!(found.value, 1.5);
        assert!(found.first.abs_diff(300_000) < 100, "{found:?}");
        let cut_everywhere: Vec<f64> = whole.iter().map(|x| x.clamp(-1.5, 1.5)).collect();
        let found = of(&cut_everywhere, 8192).clipping.unwrap();
        let all = clipping(&cut_everywhere).unwrap();
        assert_eq!(found.low.unwrap().value, all.low.unwrap().value);
        let (found, all) = (found.high.unwrap(), all.high.unwrap());
        assert_eq!((found.first, found.longest), (all.first, all.longest));
        assert!(found.samples.abs_diff(all.samples) < all.samples / 50);
    }
}
