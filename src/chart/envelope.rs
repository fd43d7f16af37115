//! Reduction of long series to their extremes, as far as a picture can show.

use super::Point;

/// Number of columns that a long series is reduced to.
pub(super) const COLUMNS: usize = 900;
/// Maximum number of bins of an envelope, even.
const MOST_BINS: usize = 4096;

/// The first, lowest, highest and last point of each run of points in the same column, in their order.
pub(super) fn thinned(
    points: impl Iterator<Item = Point>,
    column: impl Fn(f64) -> i64,
) -> Vec<Point> {
    let mut out: Vec<Point> = Vec::new();
    let mut open: Option<(i64, [Point; 4])> = None;
    let in_order = |(_, [first, low, high, last]): (i64, [Point; 4])| match low.0 <= high.0 {
        true => [first, low, high, last],
        false => [first, high, low, last],
    };
    for point in points {
        let here = column(point.0);
        match &mut open {
            Some((place, [_, low, high, last])) if *place == here => {
                if point.1 < low.1 || low.1.is_nan() {
                    *low = point;
                }
                if point.1 > high.1 || high.1.is_nan() {
                    *high = point;
                }
                *last = point;
            }
            _ => {
                out.extend(open.into_iter().flat_map(in_order));
                open = Some((here, [point; 4]));
            }
        }
    }
    out.extend(open.into_iter().flat_map(in_order));
    out
}

/// Extremes of a series of unknown length, gathered sample by sample in bounded memory.
#[derive(Debug, Clone)]
pub(crate) struct Envelope {
    bins: Vec<Bin>,
    samples_per_bin: usize,
    in_last: usize,
}

/// The lowest and the highest of some points.
#[derive(Debug, Clone, Copy)]
struct Bin {
    low: Point,
    high: Point,
}

impl Bin {
    fn join(self, later: Self) -> Self {
        let is_lower = later.low.1 < self.low.1 || self.low.1.is_nan();
        let is_higher = later.high.1 > self.high.1 || self.high.1.is_nan();
        Self {
            low: if is_lower { later.low } else { self.low },
            high: if is_higher { later.high } else { self.high },
        }
    }
}

impl Envelope {
    pub(crate) fn new() -> Self {
        Self {
            bins: Vec::new(),
            samples_per_bin: 1,
            in_last: 0,
        }
    }

    pub(crate) fn add(&mut self, x: f64, y: f64) {
        let bin = Bin {
            low: (x, y),
            high: (x, y),
        };
        match self.bins.last_mut() {
            Some(last) if self.in_last < self.samples_per_bin => {
                *last = last.join(bin);
                self.in_last += 1;
            }
            _ => {
                self.bins.push(bin);
                self.in_last = 1;
            }
        }
        // Full bins are merged in pairs, so that all keep the same width.
        if self.bins.len() == MOST_BINS && self.in_last == self.samples_per_bin {
            let pairs = self.bins.chunks(2).map(|pair| pair[0].join(pair[1]));
            self.bins = pairs.collect();
            self.samples_per_bin *= 2;
            self.in_last = self.samples_per_bin;
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.bins.is_empty()
    }

    /// The lowest and highest point of each bin in their order, as a line; all points of a short series.
    pub(crate) fn points(&self) -> Vec<Point> {
        let ends = |bin: &Bin| {
            let (first, last) = match bin.low.0 <= bin.high.0 {
                true => (bin.low, bin.high),
                false => (bin.high, bin.low),
            };
            let last = (last.0 > first.0).then_some(last);
            std::iter::once(first).chain(last)
        };
        self.bins.iter().flat_map(ends).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn envelope_keeps_every_extreme_in_bounded_memory() {
        let mut envelope = Envelope::new();
        for i in 0..100_000 {
            let spike = if i == 54_321 { 9.0 } else { 0.0 };
            envelope.add(f64::from(i), spike);
        }
        let bins = &envelope.bins;
        assert!(bins.len() <= MOST_BINS);
        assert!(bins.iter().any(|bin| bin.high == (54_321.0, 9.0)));
        let widths = bins.windows(2).map(|w| w[1].low.0 - w[0].low.0);
        let widths: Vec<f64> = widths.collect();
        assert!(widths[0] > 0.0);
        assert!(widths.iter().all(|w| *w == widths[0]), "bins of one width");
    }

    #[test]
    fn a_short_series_is_kept_as_it_is() {
        let wave = |i: u32| (f64::from(i), f64::from(i * 31 % 97));
        let mut envelope = Envelope::new();
        (0..8000).map(wave).for_each(|(x, y)| envelope.add(x, y));
        assert_eq!(envelope.samples_per_bin, 2);
        assert_eq!(envelope.points(), (0..8000).map(wave).collect::<Vec<_>>());
    }

    #[test]
    fn columns_keep_their_ends_and_extremes() {
        let heights = [0.0, f64::NAN, 5.0, -1.0, 2.0, 7.0];
        let points = heights.iter().enumerate().map(|(i, y)| (i as f64, *y));
        let kept = thinned(points, |x| (x / 5.0) as i64);
        let want = [(0.0, 0.0), (2.0, 5.0), (3.0, -1.0), (4.0, 2.0)];
        assert_eq!(kept[..4], want);
        assert_eq!(kept[4..], [(5.0, 7.0); 4]);
    }
}
