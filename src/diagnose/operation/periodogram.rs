//! The periodogram of a running record, with lines of a steady speed left out.

use std::f64::consts::{LN_2, PI, TAU};
use std::ops::Range;

use torqcomp_dsp::quality::median;

use super::density::{DensityParameters, resonant};

/// Mean lines per half-bandwidth `ζ f₀`: wanted, and fewest.
pub const PER_HALF_BANDWIDTH: [f64; 2] = [16.0, 6.0];
/// Power over the density above which a line is that of a steady speed: noise is above once in 100,000.
const UNUSUAL: f64 = 11.5;
/// Fewest lines left out on each side of one, and the largest leakage in the others relative to the median around them.
const BESIDE: usize = 3;
const LEAKING: f64 = 0.1;

/// Power of a record at each frequency.
pub struct Periodogram {
    pub step_hz: f64,
    taper: f64,
    power: Vec<f64>,
    /// Whether each counts: it is no line of a steady speed.
    counts: Vec<bool>,
}

/// Mean power of adjacent lines.
#[derive(Clone, Copy)]
pub struct MeanLine {
    pub frequency_hz: f64,
    pub power: f64,
    /// Number of lines.
    pub weight: f64,
}

pub struct MeanLines(pub Vec<MeanLine>);

impl Periodogram {
    pub fn of(samples: &[f64], rate_hz: f64, taper: f64) -> Self {
        let count = samples.len();
        let mean = samples.iter().sum::<f64>() / count as f64;
        let window = |i: usize| {
            let from_end = (i.min(count - 1 - i) as f64 + 0.5) / (taper * count as f64);
            0.5 - 0.5 * (0.5 * TAU * from_end.min(1.0)).cos()
        };
        let windowed = samples.iter().enumerate();
        let mut windowed: Vec<f64> = windowed.map(|(i, x)| (x - mean) * window(i)).collect();
        let plan = torqcomp_fourier::forward(count);
        let mut spectrum = plan.make_output_vec();
        // Cannot fail: the lengths match the plan.
        let _ = plan.process(&mut windowed, &mut spectrum);
        let power: Vec<f64> = spectrum.iter().map(|line| line.norm_sqr()).collect();
        Self {
            step_hz: rate_hz / count as f64,
            taper,
            counts: vec![true; power.len()],
            power,
        }
    }

    /// Variance of a sum over adjacent lines, relative to that of independent ones: `n ∑w⁴/(∑w²)²`. A cosine taper has
    /// the means 35/128 of `w⁴` and 3/8 of `w²`.
    pub fn correlated(&self) -> f64 {
        let tapered = 2.0 * self.taper;
        (1.0 - tapered * (1.0 - 35.0 / 128.0)) / (1.0 - tapered * (1.0 - 3.0 / 8.0)).powi(2)
    }

    /// Most power that a line has this many lines away, relative to its own: the square of
    /// `sin(πn(1 − t)) cos(πnt)/(πn(1 − (2nt)²))` with the taper `t`.
    fn leakage(&self, lines: usize) -> f64 {
        let lines = lines as f64;
        let tapered = (2.0 * self.taper * lines).powi(2) - 1.0;
        (PI * lines * tapered.max(1.0)).powi(-2)
    }

    pub fn frequency_hz(&self, k: usize) -> f64 {
        k as f64 * self.step_hz
    }

    /// Number of lines in a width in Hz.
    fn lines(&self, width_hz: f64) -> usize {
        ((width_hz / self.step_hz) as usize).max(1)
    }

    /// Median of the power in each block of a width in Hz, and the number of lines in it.
    fn medians(&self, width_hz: f64) -> (Vec<f64>, usize) {
        let length = self.lines(width_hz).max(2 * BESIDE);
        let blocks = self.power.chunks(length);
        let middle = |block: &[f64]| median(&mut block.to_vec()).unwrap_or(0.0);
        (blocks.map(middle).collect(), length)
    }

    /// Whether each line is far above the median of those within a width in Hz.
    pub fn above_median(&self, width_hz: f64) -> Vec<bool> {
        let (medians, length) = self.medians(width_hz);
        let is_above = |k: usize| self.power[k] > UNUSUAL / LN_2 * medians[k / length];
        (0..self.power.len()).map(is_above).collect()
    }

    /// The same for lines far above a density in a range.
    pub fn above(&self, values: &DensityParameters, range_hz: &Range<f64>) -> Vec<bool> {
        let is_above = |k: usize| {
            let frequency_hz = self.frequency_hz(k);
            range_hz.contains(&frequency_hz)
                && self.power[k] > UNUSUAL * resonant(values, frequency_hz).0.exp()
        };
        (0..self.power.len()).map(is_above).collect()
    }

    /// Leaves out lines of a steady speed, and those around each that its leakage reaches, compared with the median
    /// within a width in Hz.
    pub fn leave_out(&mut self, is_line: &[bool], width_hz: f64) {
        let (medians, length) = self.medians(width_hz);
        let count = is_line.len();
        self.counts = vec![true; count];
        // The mean.
        self.counts[..=BESIDE.min(count - 1)].fill(false);
        let mut next = 0;
        while let Some(from) = (next..count).find(|k| is_line[*k]) {
            let to = (from..count).find(|k| !is_line[*k]).unwrap_or(count);
            // Between two lines, a peak is up to twice as high.
            let power = 2.0 * self.power[from..to].iter().sum::<f64>();
            let is_reached = |away: usize, k: usize| {
                away <= BESIDE || power * self.leakage(away) > LEAKING * medians[k / length]
            };
            let below = (1..=from).take_while(|away| is_reached(*away, from - away));
            let above = (1..=count - to).take_while(|away| is_reached(*away, to - 1 + away));
            let (below, above) = (below.count(), above.count());
            self.counts[from - below..to + above].fill(false);
            next = to;
        }
    }

    /// Means of the lines that count in a range, for a resonance with a half-bandwidth.
    pub fn points(&self, range_hz: &Range<f64>, half_hz: f64) -> MeanLines {
        let all = (0..self.power.len()).filter(|k| range_hz.contains(&self.frequency_hz(*k)));
        let all: Vec<usize> = all.collect();
        let together = self.lines(half_hz / PER_HALF_BANDWIDTH[0]);
        let mean = |lines: &[usize]| {
            let counted = lines.iter().filter(|k| self.counts[**k]);
            let (mut weight, mut frequency_hz, mut power) = (0.0, 0.0, 0.0);
            for k in counted {
                weight += 1.0;
                frequency_hz += self.frequency_hz(*k);
                power += self.power[*k];
            }
            (weight > 0.0).then(|| MeanLine {
                frequency_hz: frequency_hz / weight,
                power: power / weight,
                weight,
            })
        };
        MeanLines(all.chunks(together).filter_map(mean).collect())
    }
}
