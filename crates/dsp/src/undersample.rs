//! Undersampling of a record whose lines lie in a few narrow bands.
//!
//! When every D-th sample is kept, a line of f cycles per sample aliases to `|f − k/D|` below `1/(2D)`. If everything
//! outside the bands is filtered out first, and the images of the bands do not overlap, nothing else is mixed with the
//! lines: the samples still represent the lines at their own frequencies and decay rates, only fewer of them. (R. G.
//! Vaughan, N. L. Scott, D. R. White, IEEE Trans. Signal Process. 39 (1991), 1973.)

use std::ops::{Range, RangeInclusive};

use crate::decimate::{Decimated, window_gain, windowed_sinc};
use crate::{Error, dot, sort_by_number};

/// Transition width of the filter (to 80 dB), times the factor and twice the reach (J. F. Kaiser, in Kuo, Kaiser
/// (eds.), System Analysis by Digital Computer, 1966).
const EDGE: f64 = 5.0;

/// Bands, in cycles per sample, and a factor for which their images do not overlap.
#[derive(Debug, Clone, PartialEq)]
pub struct Undersampling {
    /// Decimation factor.
    pub factor: usize,
    /// Half-length of the filter in samples of the result.
    pub reach: usize,
    /// Bands kept, in ascending order.
    pub bands: Vec<Range<f64>>,
}

impl Undersampling {
    /// The largest of some factors for which the images of bands, in cycles per sample, do not overlap, with a filter
    /// that reaches `reach` samples of the result to either side: a longer filter has narrower edges, so that more
    /// bands fit. `None` if there is none.
    ///
    /// ```
    /// use torqcomp_dsp::undersample::Undersampling;
    /// // With 5/64/100 for the edges of the filter, the band is 0.20022..0.20478: between 40/200 and 41/200.
    /// assert_eq!(Undersampling::of(&[0.201..0.204], 2..=100, 32).unwrap().factor, 100);
    /// assert_eq!(Undersampling::of(&[0.0..0.4], 2..=100, 32), None);
    /// ```
    #[must_use]
    pub fn of(bands: &[Range<f64>], factors: RangeInclusive<usize>, reach: usize) -> Option<Self> {
        let candidates = (*factors.start().max(&2)..=*factors.end()).rev();
        candidates
            .map(|factor| {
                let mut of = Self {
                    factor,
                    reach,
                    bands: Vec::new(),
                };
                of.bands = joined(bands, 2.0 * of.edge());
                of
            })
            .find(Self::is_apart)
    }

    /// Half-length of the filter in samples.
    #[must_use]
    pub fn half(&self) -> usize {
        self.reach * self.factor
    }

    /// Transition width of the filter.
    fn edge(&self) -> f64 {
        EDGE / (2 * self.half()) as f64
    }

    /// Whether the images of all bands, including the filter edges, do not overlap.
    fn is_apart(&self) -> bool {
        let edge = self.edge();
        let images = self.bands.iter().map(|band| {
            let wide = (band.start - edge).max(0.0)..band.end + edge;
            let zone = zone(wide.start, self.factor);
            let is_within = wide.end * 2.0 * self.factor as f64 <= (zone + 1) as f64;
            let rate = self.factor as f64;
            is_within.then(|| folded(&(rate * wide.start..rate * wide.end)).0)
        });
        let Some(mut images) = images.collect::<Option<Vec<_>>>() else {
            return false;
        };
        sort_by_number(&mut images, |image| image.start);
        !images.is_empty() && images.windows(2).all(|pair| pair[0].end <= pair[1].start)
    }

    /// The samples through a symmetrical filter, where it lies within the record.
    ///
    /// # Errors
    /// [`Error::TooShort`] if fewer than two samples would remain.
    pub fn apply(&self, samples: &[f64]) -> Result<Decimated, Error> {
        let half = self.half();
        let expected = 2 * half + 1 + self.factor;
        if samples.len() < expected {
            return Err(Error::TooShort {
                what: "a lower rate",
                expected,
                got: samples.len(),
            });
        }
        let taps = self.taps(half);
        let windows = samples.windows(taps.len()).step_by(self.factor);
        Ok(Decimated {
            samples: windows.map(|window| dot(window, &taps)).collect(),
            first: half,
            factor: self.factor,
        })
    }

    /// The filter: a windowed difference of two low-passes for each band.
    fn taps(&self, half: usize) -> Vec<f64> {
        let middle = 0.5 * self.edge();
        let mut taps = vec![0.0; 2 * half + 1];
        let mut add = |corner: f64, share: f64| {
            let low_pass = windowed_sinc(half, corner);
            let pairs = taps.iter_mut().zip(low_pass);
            pairs.for_each(|(sum, tap)| *sum += share * tap);
        };
        let share = 1.0 / window_gain();
        for band in &self.bands {
            add(band.end + middle, share);
            add((band.start - middle).max(0.0), -share);
        }
        taps
    }
}

/// Nyquist zone of a frequency at the lower rate, from 0.
fn zone(frequency: f64, factor: usize) -> usize {
    (2.0 * factor as f64 * frequency).floor() as usize
}

/// Image of a band in the decimated samples, if it lies within one Nyquist zone, and the map back to the original
/// frequency; all in cycles per sample.
pub fn folded(band: &Range<f64>) -> (Range<f64>, impl Fn(f64) -> f64 + use<>) {
    let zone = zone(band.start, 1);
    // The same in both directions except for the sign.
    let turn = move |frequency: f64, sign: f64| match zone.is_multiple_of(2) {
        true => frequency - sign * 0.5 * zone as f64,
        false => 0.5 * (zone + 1) as f64 - frequency,
    };
    let (start, end) = (turn(band.start, 1.0), turn(band.end, 1.0));
    let back = move |frequency: f64| turn(frequency, -1.0);
    (start.min(end)..start.max(end), back)
}

/// Bands in ascending order, with those closer than `closest` merged.
fn joined(bands: &[Range<f64>], closest: f64) -> Vec<Range<f64>> {
    let mut sorted = bands.to_vec();
    sort_by_number(&mut sorted, |band| band.start);
    let mut out: Vec<Range<f64>> = Vec::new();
    for band in sorted {
        match out.last_mut() {
            Some(last) if band.start - last.end < closest => last.end = last.end.max(band.end),
            _ => out.push(band),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn samples_are_those_of_the_lines_and_what_lies_beside_is_gone() {
        let bands = [0.0995..0.1005, 0.3055..0.3065];
        let low = |t: f64| (-2e-5 * t).exp() * (2.0 * PI * 0.1 * t).cos();
        let high = |t: f64| 0.3 * (-3e-5 * t).exp() * (2.0 * PI * 0.306 * t + 1.0).cos();
        let beside = |t: f64| 0.1 + (2.0 * PI * 0.2 * t).cos() + (2.0 * PI * 0.45 * t).sin();
        let record: Vec<f64> = (0..60_000)
            .map(f64::from)
            .map(|t| low(t) + high(t) + beside(t))
            .collect();
        for (reach, least) in [(32, 25), (128, 60)] {
            let found = Undersampling::of(&bands, 2..=200, reach).unwrap();
            assert!(found.factor > least && found.bands == bands, "{found:?}");
            let few = found.apply(&record).unwrap();
            for (k, value) in few.samples.iter().enumerate() {
                let t = (few.first + k * found.factor) as f64;
                let want = low(t) + high(t);
                assert!((value - want).abs() < 5e-4, "{k}: {value} {want}");
            }
        }
    }

    #[test]
    fn an_image_leads_back_to_its_band() {
        for (band, want) in [
            (0.1..0.2, 0.1..0.2),
            (0.6..0.7, 0.3..0.4),
            (3.1..3.2, 0.1..0.2),
        ] {
            let (image, back) = folded(&band);
            assert!(
                (image.start - want.start).abs() < 1e-12 && (image.end - want.end).abs() < 1e-12
            );
            let (a, b) = (back(image.start), back(image.end));
            assert!((a.min(b) - band.start).abs() < 1e-12 && (a.max(b) - band.end).abs() < 1e-12);
        }
    }

    #[test]
    fn short_records_are_refused() {
        let found = Undersampling::of(&[0.1..0.101], 2..=30, 32).unwrap();
        assert!(matches!(
            found.apply(&[0.0; 100]),
            Err(Error::TooShort { .. })
        ));
    }
}
