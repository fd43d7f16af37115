//! Detection of what alone determines a band, far above everything else: a few narrow lines, or all beyond a quiet gap.

use std::ops::Range;

use super::Band;
use super::choice::BandSearch;

/// Ratio of bands below which they count as different.
const APART: f64 = 0.7;
/// Gain `|H⁻¹|`, relative to its static value, below which lines are not examined.
const LARGE_GAIN: f64 = 10.0;
/// Maximum number of removed lines.
const MOST_LINES: usize = 12;
/// Half-width of a steady line in lines of the density, due to the window.
const LOBE: usize = 4;
/// Largest half-width of a line, relative to its frequency, as for a switching frequency that wanders.
const WIDTH: f64 = 0.01;
/// Density, relative to the floor, at which a line ends.
const RISEN: f64 = 4.0;

/// Contribution below a gap, relative to that above, that the gap may have.
const QUIET: f64 = 0.01;

/// What alone decides a band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Deciding {
    /// This many narrow lines.
    Lines(usize),
    /// Everything from a frequency in Hz: wide or many lines, such as a carrier with sidebands, or one whose frequency
    /// varies.
    From(f64),
}

/// Lines without which the band would be much narrower.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecidingLines {
    /// What is counted.
    pub what: Deciding,
    /// Frequency of the strongest of them in the result, in Hz.
    pub frequency_hz: f64,
    /// Their RMS contribution to the compensated record: `√(∑ |H⁻¹|² (P − N) Δf)`.
    pub result_rms: f64,
    /// Upper end of the optimum band without them, in Hz.
    pub without_hz: f64,
}

impl BandSearch {
    /// The narrow lines at the upper end of a band without which the band would be less than 0.7 times as wide, where
    /// the inverse response exceeds 10 times its static value; or everything there above a gap in which there is only
    /// noise, from 0.7 times a frequency to that frequency. It may be torque or interference from a power converter; the
    /// record alone cannot distinguish them.
    ///
    /// A line of 0.02 at 1600 Hz above a torque that ends at 100 Hz, on a stand with `|H⁻¹| = 1 + (f/100)²`:
    /// ```
    /// use std::{f64::consts::TAU, sync::Arc};
    /// use num_complex::Complex64;
    /// use torqcomp_dsp::band::{BandSearch, Deciding};
    /// let mut state = 1_u64;
    /// let mut noise = || {
    ///     state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ///     (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
    /// };
    /// let record: Vec<f64> = (0..60_000)
    ///     .map(|i| (f64::from(i) / 10_000.0, noise()))
    ///     .map(|(t, noise)| (TAU * 90.0 * t).sin() + 0.02 * (TAU * 1600.0 * t).sin() + 1e-4 * noise)
    ///     .collect();
    /// let inverse = Arc::new(|hz: f64| Complex64::new(1.0 + (hz / 100.0).powi(2), 0.0));
    /// let search = BandSearch::of_record(&record, 10_000.0, &(inverse as _)).unwrap();
    /// let lines = search.deciding_lines(search.best().unwrap().top_hz).unwrap();
    /// assert_eq!(lines.what, Deciding::Lines(1));
    /// assert!((lines.frequency_hz - 1600.0).abs() < 1.0 && lines.without_hz < 200.0);
    /// // 0.02/√2 · 257.
    /// assert!((lines.result_rms - 3.63).abs() < 0.05);
    /// ```
    #[must_use]
    pub fn deciding_lines(&self, top_hz: f64) -> Option<DecidingLines> {
        let by_lines = self.few_lines(top_hz);
        by_lines.or_else(|| self.beyond_a_gap(top_hz))
    }

    fn few_lines(&self, top_hz: f64) -> Option<DecidingLines> {
        let mut rest = self.clone();
        let (mut strongest, mut power) = (None, 0.0);
        for count in 1..=MOST_LINES {
            let line = rest.strongest_near(top_hz)?;
            power += rest.take_out(line);
            let frequency_hz = *strongest.get_or_insert(line as f64 * self.step_hz);
            let without_hz = rest.best()?.top_hz;
            if without_hz < APART * top_hz {
                return Some(DecidingLines {
                    what: Deciding::Lines(count),
                    frequency_hz,
                    result_rms: power.sqrt(),
                    without_hz,
                });
            }
        }
        None
    }

    /// Everything above the lowest gap, if the band ends below the gap without it.
    fn beyond_a_gap(&self, top_hz: f64) -> Option<DecidingLines> {
        let end = self.line_of(Band::end_of(self.rate_hz, top_hz));
        // Excess over the noise from each line to the end of the band.
        let mut above = vec![0.0; end + 1];
        for line in (0..end).rev() {
            let excess = self.density[line] - self.noise[line];
            above[line] = above[line + 1] + self.power_gain[line] * excess;
        }
        let is_gap = |line: &usize| {
            let below = (APART * *line as f64) as usize;
            let is_signal = self.is_amplified(*line) && above[*line] > 0.0;
            is_signal && above[below] - above[*line] < QUIET * above[*line]
        };
        let from = (0..end).find(is_gap)?;
        let mut rest = self.clone();
        rest.density[from..].copy_from_slice(&self.noise[from..]);
        rest.sum();
        let without_hz = rest.best()?.top_hz;
        let strongest = self.strongest(from..end)?;
        let from_hz = from as f64 * self.step_hz;
        (without_hz < from_hz).then(|| DecidingLines {
            what: Deciding::From(from_hz),
            frequency_hz: strongest as f64 * self.step_hz,
            result_rms: (above[from] * self.step_hz).sqrt(),
            without_hz,
        })
    }

    /// The line at the upper end of a band with the largest contribution to the result, if it is
    /// amplified.
    fn strongest_near(&self, top_hz: f64) -> Option<usize> {
        let [from, end] =
            [APART * top_hz, Band::end_of(self.rate_hz, top_hz)].map(|hz| self.line_of(hz));
        self.strongest(from..end)
            .filter(|line| self.is_amplified(*line))
    }

    /// Whether the inverse response at a line is much larger than its static value.
    fn is_amplified(&self, line: usize) -> bool {
        self.power_gain[line] > LARGE_GAIN * LARGE_GAIN * self.gain_at_rest()
    }

    fn line_of(&self, hz: f64) -> usize {
        ((hz / self.step_hz) as usize).min(self.power_gain.len())
    }

    fn strongest(&self, lines: Range<usize>) -> Option<usize> {
        let power = |line: &usize| self.power_gain[*line] * self.density[*line];
        lines.max_by(|a, b| power(a).total_cmp(&power(b)))
    }

    /// Replaces a line by noise; returns its power in the result.
    fn take_out(&mut self, line: usize) -> f64 {
        let reach = LOBE.max((WIDTH * line as f64) as usize);
        let risen = |k: &usize| self.density[*k] > RISEN * self.noise[*k];
        let below = (line.saturating_sub(reach)..line).rev();
        let first = line - below.take_while(risen).count();
        let above = line + 1..(line + reach + 1).min(self.power_gain.len());
        let last = line + above.take_while(risen).count();
        let mut power = 0.0;
        for k in first..=last {
            power += self.power_gain[k] * (self.density[k] - self.noise[k]).max(0.0) * self.step_hz;
            self.density[k] = self.noise[k];
        }
        self.sum();
        power
    }
}
