//! Long series reduced to what a picture can show: their extremes.

use super::Point;

/// Columns that a long series is reduced to.
pub(super) const COLUMNS: usize = 900;
/// Most bins of an envelope, an even number.
const MOST_BINS: usize = 4096;

/// The first, lowest, highest and last point of each run of points in the same column.
pub(super) fn thinned(
    points: impl Iterator<Item = Point>,
    column: impl Fn(f64) -> i64,
) -> Vec<Point> {
    let mut out: Vec<Point> = Vec::new();
    let mut open: Option<(i64, [Point; 4])> = None;
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
                out.extend(open.into_iter().flat_map(|(_, points)| points));
                open = Some((here, [point; 4]));
            }
        }
    }
    out.extend(open.into_iter().flat_map(|(_, points)| points));
    out
}

/// The extremes of a series of unknown length, gathered sample by sample in bounded memory.
#[derive(Debug, Clone)]
pub(crate) struct Envelope {
    bins: Vec<Bin>,
    samples_per_bin: usize,
    in_last: usize,
}

#[derive(Debug, Clone, Copy)]
struct Bin {
    x: f64,
    low: f64,
    high: f64,
}

impl Bin {
    fn join(self, later: Self) -> Self {
        Self {
            x: self.x,
            low: self.low.min(later.low),
            high: self.high.max(later.high),
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
        let bin = Bin { x, low: y, high: y };
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
        // Full bins are joined in pairs, so that all stay of one width.
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

    /// The lowest and highest value of each bin, as a line.
    pub(crate) fn points(&self) -> Vec<Point> {
        let ends = |bin: &Bin| {
            let high = (bin.high > bin.low).then_some((bin.x, bin.high));
            std::iter::once((bin.x, bin.low)).chain(high)
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
        assert!(bins.iter().any(|bin| bin.high == 9.0));
        let widths: Vec<f64> = bins.windows(2).map(|w| w[1].x - w[0].x).collect();
        assert!(widths[0] > 0.0);
        assert!(widths.iter().all(|w| *w == widths[0]), "bins of one width");
    }

    #[test]
    fn columns_keep_their_ends_and_extremes() {
        let heights = [0.0, f64::NAN, 5.0, -1.0, 2.0, 7.0];
        let points = heights.iter().enumerate().map(|(i, y)| (i as f64, *y));
        let kept = thinned(points, |x| (x / 5.0) as i64);
        let want = [(0.0, 0.0), (3.0, -1.0), (2.0, 5.0), (4.0, 2.0)];
        assert_eq!(kept[..4], want);
        assert_eq!(kept[4..], [(5.0, 7.0); 4]);
    }
}
