//! The optimum band for a record and a stand.
//!
//! The error of a band `W(f)` consists of the torque that it cuts off and the noise within it, amplified by the inverse
//! response:
//!
//! ```text
//! e²(W) = ∫ |H⁻¹|² [ (1 − W)² (P − N) + W² N ] df
//! ```
//!
//! with the record's density `P` and the density `N` of its noise, so that the torque has `|H⁻¹|² (P − N)`. The band
//! with the smallest `e²` is taken from a grid of rounded frequencies, about 2.4 % apart. `P − N` keeps its sign: where
//! there is only noise it averages to zero, so that extending the band by many lines never pays by chance, and a single
//! line decides only if it exceeds all the noise up to it.
//!
//! `N` is white, unless the record shows that it went through a low-pass (`noise_density`). Its floor is estimated where
//! the record is weakest: the mean of the three smallest medians of 16 equal parts between 2 and 98 % of the Nyquist
//! frequency.
//!
//! Rounding to steps `q` adds `q²/12` (W. R. Bennett, *Bell Syst. Tech. J.* 27 (1948), 446), white if noise dithers it.
//! In a quiet periodic record, it forms lines far above the noise instead. If all lines above a frequency together have
//! no more power than that, they are not signal: `N` is then `q²/(6 f_s)`, and `P` no larger.

use std::ops::Range;

use super::{Band, EDGE, Edge, FALLBACK_FRACTION};
use crate::compensate::Inverse;
use crate::noise_density::NoiseDensity;
use crate::quality::quantisation::quantisation;
use crate::spectrum::{Density, welch_to_the_ends};

/// Grid frequencies per decade.
const PER_DECADE: i32 = 96;
/// Lines of the density below the lowest band.
const LOWEST_LINES: f64 = 4.0;
/// Lines occupied by the mean with the window's main lobe.
const MEAN_LINES: usize = 3;
/// Parts of the spectrum for the noise estimate, and how many of them are used.
const FLOOR_PARTS: usize = 16;
const FLOOR_TAKEN: usize = 3;
/// Range for the noise estimate, as fractions of the Nyquist frequency.
const FLOOR_RANGE: [f64; 2] = [0.02, 0.98];
/// Shortest and longest block of the density.
const BLOCKS: [usize; 2] = [64, 1 << 15];
/// Minimum length of a record, in blocks.
const RECORD_BLOCKS: usize = 4;
/// Powers of two by which blocks may be shorter between stretches that are left out, and least length of what remains, in
/// blocks.
const SHORTER: usize = 2;
const FEWEST_BLOCKS: usize = 3;
/// Largest power of lines, relative to that of rounding, that rounding may explain: an error of a few levels is not
/// spread evenly.
const ROUNDING: f64 = 2.0;
/// Significance threshold of the signal, in standard deviations due to noise alone.
const SIGNIFICANT: f64 = 6.0;
/// Noise gain that limits a band chosen without a record.
const STAND_GAIN: f64 = 10.0;

/// A band and its expected errors, in static units of the record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandChoice {
    /// Upper end of the fully compensated range, in Hz.
    pub top_hz: f64,
    /// Expected RMS noise within the band after compensation.
    pub noise_rms: f64,
    /// Expected RMS torque above the band.
    pub lost_rms: f64,
}

/// Spectrum of a record and the inverse response of a stand.
#[derive(Debug, Clone)]
pub struct BandSearch {
    pub(super) rate_hz: f64,
    pub(super) step_hz: f64,
    /// `|H⁻¹|²` at each line where it is finite; zero for the mean.
    pub(super) power_gain: Vec<f64>,
    pub(super) density: Vec<f64>,
    /// Density of the noise at each line.
    pub(super) noise: Vec<f64>,
    /// Cumulative sums of `|H⁻¹|² N` and of `|H⁻¹|² P` up to each line.
    sums: Vec<[f64; 2]>,
    /// Whether the record contains more than noise.
    has_signal: bool,
    edge: &'static Edge,
}

impl BandSearch {
    /// From a record, in static units of torque. `None` if it has too few samples for a spectrum.
    #[must_use]
    pub fn of_record(samples: &[f64], rate_hz: f64, inverse: &Inverse) -> Option<Self> {
        Self::of_parts(samples, &[], rate_hz, inverse)
    }

    /// From a record without the stretches that are not of it, as far as what remains between them is long
    /// enough for a spectrum.
    #[must_use]
    pub fn of_parts(
        samples: &[f64],
        without: &[Range<usize>],
        rate_hz: f64,
        inverse: &Inverse,
    ) -> Option<Self> {
        let [shortest, longest] = BLOCKS;
        let longest_here = samples.len() / RECORD_BLOCKS;
        if longest_here < shortest {
            return None;
        }
        let block = (longest_here / 2 + 1).next_power_of_two().min(longest);
        let (block, parts) = parts(samples, without, block);
        let density = welch_to_the_ends(&parts, rate_hz, block).ok()?;
        let mut search = Self::of_density(&density, rate_hz, inverse)?;
        if let Some(found) = quantisation(samples) {
            search.count_rounding(found.step.powi(2) / 12.0);
        }
        Some(search)
    }

    /// Treats lines that rounding may explain as noise.
    fn count_rounding(&mut self, rounding_power: f64) {
        let lines = self.density.len();
        let spread = rounding_power / (lines as f64 * self.step_hz);
        let noise = self.noise.iter().sum::<f64>();
        let mut power = ROUNDING * (spread * lines as f64 - noise);
        if power <= 0.0 {
            return;
        }
        for (value, noise) in self.density.iter_mut().zip(&self.noise).rev() {
            power -= (*value - noise).max(0.0);
            if power < 0.0 {
                break;
            }
            *value = spread.max(*noise);
        }
        self.noise
            .iter_mut()
            .for_each(|noise| *noise = noise.max(spread));
        self.sum();
    }

    /// From the density of a record. `None` if it has too few lines or no noise.
    #[must_use]
    pub fn of_density(density: &Density, rate_hz: f64, inverse: &Inverse) -> Option<Self> {
        let floor = white_floor(density)?;
        let gain = |line: usize| inverse(line as f64 * density.step_hz).norm_sqr();
        let mut power_gain: Vec<f64> = (0..density.values.len())
            .map(gain)
            .take_while(|gain| gain.is_finite())
            .collect();
        let mean_lines = power_gain.len().min(MEAN_LINES);
        power_gain[..mean_lines].fill(0.0);
        let noise = NoiseDensity::of(density, floor, inverse).values;
        let mut search = Self {
            rate_hz,
            step_hz: density.step_hz,
            has_signal: has_signal(density, &noise),
            density: density.values.clone(),
            power_gain,
            noise,
            sums: Vec::new(),
            edge: &EDGE,
        };
        search.sum();
        Some(search)
    }

    /// Computes the cumulative sums.
    pub(super) fn sum(&mut self) {
        let mut sums = [0.0; 2];
        self.sums = vec![sums];
        let lines = self.noise.iter().zip(&self.density);
        for (gain, (noise, record)) in self.power_gain.iter().zip(lines) {
            sums = [sums[0] + gain * noise, sums[1] + gain * record];
            self.sums.push(sums);
        }
    }

    /// `|H⁻¹|²` at the lowest frequency above the mean.
    pub(super) fn gain_at_rest(&self) -> f64 {
        let first = self.power_gain.iter().find(|gain| **gain > 0.0);
        first.copied().unwrap_or(f64::INFINITY)
    }

    /// The band with the smallest expected error; `None` if the record contains only noise.
    #[must_use]
    pub fn best(&self) -> Option<BandChoice> {
        if !self.has_signal {
            return None;
        }
        let known_hz = self.power_gain.len() as f64 * self.step_hz;
        let least_hz = LOWEST_LINES * self.step_hz;
        grid(least_hz, FALLBACK_FRACTION * 0.5 * self.rate_hz)
            .filter(|top_hz| Band::end_of(self.rate_hz, *top_hz) <= known_hz)
            .map(|top_hz| (top_hz, self.squares(top_hz)))
            .min_by(|(_, a), (_, b)| (a[0] + a[1]).total_cmp(&(b[0] + b[1])))
            .map(|(top_hz, squares)| choice(top_hz, squares))
    }

    /// Mean squares of the noise within a band and of the torque above it; without torque the latter scatters about
    /// zero.
    fn squares(&self, top_hz: f64) -> [f64; 2] {
        let end_hz = Band::end_of(self.rate_hz, top_hz);
        let lines = self.power_gain.len();
        let line = |hz: f64| ((hz / self.step_hz) as usize + 1).min(lines);
        let (top, end) = (line(top_hz), line(end_hz));
        let above = |[noise, record]: [f64; 2]| record - noise;
        let mut noise = self.sums[top][0];
        let mut lost = above(self.sums[lines]) - above(self.sums[end]);
        for k in top..end {
            let hz = k as f64 * self.step_hz;
            let kept = 1.0 - self.edge.at((hz - top_hz) / (end_hz - top_hz));
            noise += self.power_gain[k] * kept * kept * self.noise[k];
            lost += self.power_gain[k] * (1.0 - kept).powi(2) * (self.density[k] - self.noise[k]);
        }
        [noise * self.step_hz, lost * self.step_hz]
    }
}

/// The parts of a record between stretches that are at least one block long, with a block of this length or somewhat
/// shorter. The shortest stretches remain in the record if without them the parts would be too short.
fn parts<'a>(
    samples: &'a [f64],
    without: &[Range<usize>],
    block: usize,
) -> (usize, Vec<&'a [f64]>) {
    let mut longest: Vec<&Range<usize>> = without.iter().collect();
    longest.sort_by_key(|stretch| std::cmp::Reverse(stretch.len()));
    while !longest.is_empty() {
        let parts = between(samples, &longest);
        for shorter in (0..=SHORTER).map(|power| block >> power) {
            let long = parts.iter().copied().filter(|part| part.len() >= shorter);
            let long: Vec<&[f64]> = long.collect();
            let count: usize = long.iter().map(|part| part.len()).sum();
            if count >= FEWEST_BLOCKS * shorter && 2 * count >= samples.len() {
                return (shorter, long);
            }
        }
        longest.truncate(longest.len() - longest.len().div_ceil(8));
    }
    (block, vec![samples])
}

/// The parts of a record between stretches.
fn between<'a>(samples: &'a [f64], stretches: &[&Range<usize>]) -> Vec<&'a [f64]> {
    let mut stretches = stretches.to_vec();
    stretches.sort_by_key(|stretch| stretch.start);
    let (mut parts, mut from) = (Vec::new(), 0);
    for stretch in stretches {
        parts.extend(samples.get(from..stretch.start));
        from = from.max(stretch.end);
    }
    parts.extend(samples.get(from..));
    parts
}

/// The band for a stand alone: up to where `|H⁻¹|` reaches 10, at most 0.7 of the Nyquist
/// frequency.
///
/// ```
/// use std::sync::Arc;
/// use num_complex::Complex64;
/// use torqcomp_dsp::band::band_of_stand;
/// // |1 − (f/100)²| = 10 at 331.7 Hz; the next lower frequency of the grid.
/// let stand = Arc::new(|f: f64| Complex64::new(1.0 - (f / 100.0).powi(2), 0.0));
/// assert_eq!(band_of_stand(20_000.0, &(stand as _)), 324.0);
/// ```
#[must_use]
pub fn band_of_stand(rate_hz: f64, inverse: &Inverse) -> f64 {
    let highest_hz = FALLBACK_FRACTION * 0.5 * rate_hz;
    let least_hz = 1e-6 * rate_hz;
    grid(least_hz, highest_hz)
        .take_while(|top_hz| inverse(*top_hz).norm() <= STAND_GAIN * inverse(0.0).norm())
        .last()
        .unwrap_or(highest_hz)
}

fn choice(top_hz: f64, [noise, lost]: [f64; 2]) -> BandChoice {
    BandChoice {
        top_hz,
        noise_rms: noise.max(0.0).sqrt(),
        lost_rms: lost.max(0.0).sqrt(),
    }
}

/// Frequencies `10^(k/96)` rounded to three significant digits, within limits.
fn grid(from_hz: f64, to_hz: f64) -> impl Iterator<Item = f64> {
    let place = |hz: f64| (f64::from(PER_DECADE) * hz.log10()).round() as i32;
    let rounded = |k: i32| {
        let hz = 10_f64.powf(f64::from(k) / f64::from(PER_DECADE));
        let digits = 2 - hz.log10().floor() as i32;
        // Dividing by a power of ten gives the double nearest to the decimal number.
        match digits {
            0.. => (hz * 10_f64.powi(digits)).round() / 10_f64.powi(digits),
            _ => (hz / 10_f64.powi(-digits)).round() * 10_f64.powi(-digits),
        }
    };
    (place(from_hz)..=place(to_hz) + 1)
        .map(rounded)
        .filter(move |hz| (from_hz..=to_hz * (1.0 + 1e-12)).contains(hz))
}

/// Density of white noise in a record; `None` if there is none.
fn white_floor(density: &Density) -> Option<f64> {
    let lines = density.values.len() as f64;
    let [from, to] = FLOOR_RANGE.map(|part| (part * lines) as usize);
    let width = (to - from) / FLOOR_PARTS;
    if width == 0 {
        return None;
    }
    let mut medians: Vec<f64> = density.values[from..to]
        .chunks_exact(width)
        .map(|part| {
            let mut part = part.to_vec();
            part.sort_by(f64::total_cmp);
            part[part.len() / 2]
        })
        .collect();
    medians.sort_by(f64::total_cmp);
    let least = medians[..FLOOR_TAKEN].iter().sum::<f64>() / FLOOR_TAKEN as f64;
    let floor = least / density.median_over_mean();
    (floor > 0.0).then_some(floor)
}

/// Whether the sum of all lines differs from noise, or a single one does.
fn has_signal(density: &Density, noise: &[f64]) -> bool {
    let from = MEAN_LINES.min(density.values.len());
    let (values, noise) = (&density.values[from..], &noise[from..]);
    let scatter = 1.0 / (density.blocks as f64).sqrt();
    let excess: f64 = values.iter().zip(noise).map(|(v, n)| v - n).sum();
    let of_sum = noise.iter().map(|n| n * n).sum::<f64>().sqrt();
    // The largest of n exponential values is about ln n times their mean.
    let of_noise = (values.len() as f64).ln();
    let most = 1.0 + (SIGNIFICANT + of_noise) * scatter;
    let mut lines = values.iter().zip(noise);
    excess > SIGNIFICANT * scatter * of_sum && lines.any(|(v, n)| *v > most * n)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use num_complex::Complex64;

    use super::*;
    use crate::test_noise::noise;

    const RATE: f64 = 10_000.0;

    /// A stand whose inverse grows as `1 + (f/100)²`.
    fn inverse() -> Inverse {
        Arc::new(|hz| Complex64::new(1.0 + (hz / 100.0).powi(2), 0.0))
    }

    /// Density of white noise 1 plus a torque band of 100 up to a frequency, with 5 Hz resolution.
    fn flat(to_hz: f64, at: impl Fn(f64) -> f64) -> Density {
        let value = |line: usize| {
            let hz = 5.0 * line as f64;
            1.0 + if hz <= to_hz { 100.0 } else { 0.0 } + at(hz)
        };
        Density {
            step_hz: 5.0,
            values: (0..=1000).map(value).collect(),
            blocks: 10_000,
        }
    }

    fn best(density: &Density) -> Option<BandChoice> {
        BandSearch::of_density(density, RATE, &inverse())?.best()
    }

    /// A sine of 900 Hz that begins in the last fortieth of a record, beside one of 20 Hz.
    #[test]
    fn what_begins_shortly_before_the_end_counts() {
        let mut noise = noise(5);
        let wave = |hz: f64, i: usize| (std::f64::consts::TAU * hz * i as f64 / RATE).sin();
        let sample = |i: usize| {
            let late = if i < 39_000 { 0.0 } else { wave(900.0, i) };
            wave(20.0, i) + late + 0.01 * noise()
        };
        let mut record: Vec<f64> = (0..40_000).map(sample).collect();
        for _ in 0..2 {
            let found = BandSearch::of_record(&record, RATE, &inverse()).unwrap();
            let found = found.best().unwrap();
            assert!((880.0..2000.0).contains(&found.top_hz), "{found:?}");
            record.reverse();
        }
    }

    #[test]
    fn the_band_ends_where_the_signal_does() {
        let found = best(&flat(400.0, |_| 0.0)).unwrap();
        // Within the edge little of the signal is lost; above it there would be only more noise.
        assert!((360.0..=410.0).contains(&found.top_hz), "{found:?}");
        // ∫ (1 + (f/100)²)² df = f + 2f³/3e4 + f⁵/5e8 = 23 747 up to 400 Hz; the edge adds to it.
        assert!(
            (23_000_f64.sqrt()..30_000_f64.sqrt()).contains(&found.noise_rms),
            "{found:?}"
        );
    }

    #[test]
    fn a_chance_line_does_not_decide_and_a_strong_one_does() {
        // Noise up to 3000 Hz costs about 3000⁵/5e8 = 4.9e8; a 5 Hz line there gains 5 · 901² = 4.1e6 per unit.
        let line = |size: f64| flat(400.0, move |hz| if hz == 3000.0 { size } else { 0.0 });
        assert!(best(&line(60.0)).unwrap().top_hz < 420.0);
        assert!(best(&line(600.0)).unwrap().top_hz > 2500.0);
    }

    #[test]
    fn noise_alone_is_no_reason_for_a_band() {
        assert_eq!(best(&flat(-1.0, |_| 0.0)), None);
        assert!(BandSearch::of_record(&[1.0; 10], RATE, &inverse()).is_none());
        assert!(BandSearch::of_record(&[1.0; 10_000], RATE, &inverse()).is_none());
    }

    /// Two sines of 3 and 1.5 steps at 50 and 150 Hz, rounded without dither: lines at all multiples of 50 Hz.
    #[test]
    fn lines_of_rounding_are_no_signal() {
        let angle = |i: usize| std::f64::consts::TAU * 50.0 * i as f64 / RATE;
        let sample = |i: usize| {
            0.003 * (i as f64).sin() + 3.0 * angle(i).sin() + 1.5 * (3.0 * angle(i)).sin()
        };
        let record: Vec<f64> = (0..20_000).map(|i| sample(i).floor()).collect();
        let found = BandSearch::of_record(&record, RATE, &inverse()).unwrap();
        let found = found.best().unwrap();
        assert!((130.0..500.0).contains(&found.top_hz), "{found:?}");
        // Spread evenly: ∫ (1 + (f/100)²)² df / (6 f_s).
        let f = found.top_hz;
        let noise = (f + 2.0 * f.powi(3) / 3e4 + f.powi(5) / 5e8) / (6.0 * RATE);
        let edge = found.noise_rms / noise.sqrt();
        assert!((1.0..1.4).contains(&edge), "{found:?} {edge}");
    }

    #[test]
    fn frequencies_of_the_grid_have_three_digits_and_steps_of_a_few_per_cent() {
        let all: Vec<f64> = grid(0.5, 7000.0).collect();
        assert!(
            all.windows(2)
                .all(|w| w[1] / w[0] > 1.01 && w[1] / w[0] < 1.04),
            "{all:?}"
        );
        assert!(
            all.iter().all(|hz| format!("{hz}")
                .trim_start_matches("0.")
                .replace('.', "")
                .trim_end_matches('0')
                .len()
                <= 3),
            "{all:?}"
        );
        assert!(all.contains(&1.0) && all.contains(&100.0) && all.contains(&1000.0));
    }

    #[test]
    fn an_unknown_inverse_ends_the_band() {
        let inverse: Inverse = Arc::new(|hz| match hz < 200.0 {
            true => Complex64::ONE,
            false => Complex64::new(f64::INFINITY, 0.0),
        });
        let search = BandSearch::of_density(&flat(400.0, |_| 0.0), RATE, &inverse).unwrap();
        let end_hz = 1.2 * search.best().unwrap().top_hz;
        assert!((190.0..=200.0).contains(&end_hz), "{end_hz}");
        assert!((150.0..200.0).contains(&band_of_stand(RATE, &inverse)));
    }
}
