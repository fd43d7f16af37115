//! Detection of a few narrow lines that alone determine a band.

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

/// Lines without which the band would be much narrower.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecidingLines {
    /// Number of lines.
    pub count: usize,
    /// Frequency of the strongest of them in the result, in Hz.
    pub frequency_hz: f64,
    /// Their RMS contribution to the compensated record: `√(∑ |H⁻¹|² (P − N) Δf)`.
    pub result_rms: f64,
    /// Upper end of the optimum band without them, in Hz.
    pub without_hz: f64,
}

impl BandSearch {
    /// The narrow lines at the upper end of a band without which the band would be less than 0.7 times as wide, where
    /// the inverse response exceeds 10 times its static value. Such lines may be torque or interference from a power
    /// converter; the record alone cannot distinguish them.
    ///
    /// A line of 0.02 at 1600 Hz above a torque that ends at 100 Hz, on a stand with `|H⁻¹| = 1 + (f/100)²`:
    /// ```
    /// use std::{f64::consts::TAU, sync::Arc};
    /// use num_complex::Complex64;
    /// use torqcomp_dsp::band::BandSearch;
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
    /// assert_eq!(lines.count, 1);
    /// assert!((lines.frequency_hz - 1600.0).abs() < 1.0 && lines.without_hz < 200.0);
    /// // 0.02/√2 · 257.
    /// assert!((lines.result_rms - 3.63).abs() < 0.05);
    /// ```
    #[must_use]
    pub fn deciding_lines(&self, top_hz: f64) -> Option<DecidingLines> {
        let mut rest = self.clone();
        let (mut strongest, mut power) = (None, 0.0);
        for count in 1..=MOST_LINES {
            let line = rest.strongest_near(top_hz)?;
            power += rest.take_out(line);
            let frequency_hz = *strongest.get_or_insert(line as f64 * self.step_hz);
            let without_hz = rest.best()?.top_hz;
            if without_hz < APART * top_hz {
                return Some(DecidingLines {
                    count,
                    frequency_hz,
                    result_rms: power.sqrt(),
                    without_hz,
                });
            }
        }
        None
    }

    /// The line at the upper end of a band with the largest contribution to the result, if it is
    /// amplified.
    fn strongest_near(&self, top_hz: f64) -> Option<usize> {
        let least = LARGE_GAIN * LARGE_GAIN * self.gain_at_rest();
        let [from, end] = [APART * top_hz, Band::end_of(self.rate_hz, top_hz)]
            .map(|hz| ((hz / self.step_hz) as usize).min(self.power_gain.len()));
        let power = |line: &usize| self.power_gain[*line] * self.density[*line];
        let strongest = (from..end).max_by(|a, b| power(a).total_cmp(&power(b)))?;
        (self.power_gain[strongest] > least).then_some(strongest)
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
