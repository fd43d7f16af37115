//! Effect of a compensation on noise.
//!
//! Inverting a response multiplies the recorder's noise by the inverse response, which grows with
//! the square of frequency above the resonance. A filter with taps `g` turns white noise of
//! standard deviation `σ` into `σ √Σg²`, and noise of density `S(f)` into density
//! `S(f) |W(f) H⁻¹(f)|²`.

use schemars::JsonSchema;
use serde::Serialize;

use crate::compensate::InverseFilter;
use crate::noise_density::NoiseDensity;
use crate::spectrum::Density;

/// Sub-bands in which the record is compared with its noise floor.
const SUB_BANDS: usize = 24;
/// Mean density of a sub-band relative to the noise floor below which it contains only noise: 3 dB.
const LOST_RATIO: f64 = 2.0;
/// Minimum number of bins above the band for a noise floor.
const FEWEST_FLOOR_BINS: usize = 16;

/// Noise gain of a compensation, known without a record.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseGain {
    /// Output over input standard deviation for white noise up to the Nyquist frequency: `√Σg²`.
    pub white: f64,
    /// Largest `|W H⁻¹|` and its frequency in Hz.
    pub largest: (f64, f64),
    /// `(frequency_hz, |W H⁻¹|)` at equally spaced frequencies from 0 to the band's top.
    pub curve: Vec<(f64, f64)>,
}

impl NoiseGain {
    /// Noise gain of a filter combined with a real factor over frequency (`|_| 1.0` if there is none), with the curve
    /// at `points` frequencies (at least 2).
    ///
    /// ```
    /// use std::sync::Arc;
    /// use num_complex::Complex64;
    /// use torqcomp_dsp::{band::Band, compensate::InverseFilter, noise::NoiseGain};
    ///
    /// // A gain of 3 over 2000 Hz, with an edge of 400 Hz, of a band of 10 kHz: about 3 √0.22.
    /// let band = Band::new(20_000.0, 2000.0)?;
    /// let filter = InverseFilter::design(Arc::new(|_| Complex64::new(3.0, 0.0)), band)?;
    /// let noise = NoiseGain::of(&filter, |_| 1.0, 5);
    /// assert!((noise.white / (3.0 * 0.22_f64.sqrt()) - 1.0).abs() < 0.02);
    /// assert_eq!(noise.curve[4], (2000.0, 3.0));
    /// // Half of that behind a factor of a half.
    /// let half = NoiseGain::of(&filter, |_| 0.5, 5);
    /// assert!((half.white / (1.5 * 0.22_f64.sqrt()) - 1.0).abs() < 0.02);
    /// assert_eq!(half.curve[4], (2000.0, 1.5));
    /// # Ok::<(), torqcomp_dsp::Error>(())
    /// ```
    #[must_use]
    pub fn of(filter: &InverseFilter, beside: impl Fn(f64) -> f64, points: usize) -> Self {
        let band = filter.band();
        let gains = |frequency_hz: f64| {
            let alone = filter.response(frequency_hz).norm();
            [alone, alone * beside(frequency_hz)]
        };
        let grid =
            |count: usize, end: f64| (0..count).map(move |i| end * i as f64 / (count - 1) as f64);
        let (mut largest, mut powers) = ((0.0, 0.0), [0.0; 2]);
        for frequency_hz in grid(4097, band.end_hz()) {
            let [alone, both] = gains(frequency_hz);
            powers = [powers[0] + alone.powi(2), powers[1] + both.powi(2)];
            if both > largest.0 {
                largest = (both, frequency_hz);
            }
        }
        let of_filter = filter.taps().iter().map(|g| g * g).sum::<f64>();
        Self {
            white: (of_filter * powers[1] / powers[0]).sqrt(),
            largest,
            curve: grid(points.max(2), band.top_hz())
                .map(|f| (f, gains(f)[1]))
                .collect(),
        }
    }
}

/// Noise of one record, before and after compensation.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct RecordNoise {
    /// Root of the recorder's noise density, unit/√Hz, one-sided: the median above the band, or the level around the
    /// resonance of noise that went through a low-pass.
    pub floor_per_root_hz: f64,
    /// Range the floor was taken from, in Hz.
    pub floor_band_hz: [f64; 2],
    /// Noise within the band as recorded, rms: `√(∫S₀ W² df)`.
    pub recorded_rms: f64,
    /// Rms of the noise after compensation: `√(∫S₀ |W H⁻¹|² df)`.
    pub compensated_rms: f64,
    /// Rms of the record's part within the band, without the mean, noise included.
    pub in_band_rms: f64,
    /// Rms of the signal above the band without noise, in the band's edge as far as it is removed:
    /// `√(∫(S − S₀)(1 − W)² df)`.
    pub above_band_rms: f64,
    /// Ranges within the band where the record does not rise 3 dB above the floor, in Hz.
    pub lost_hz: Vec<[f64; 2]>,
}

impl RecordNoise {
    /// Noise of a record with this density, and this rms about its mean; `None` if there is too little room between the
    /// band and the Nyquist frequency to see the floor, or the density there is zero.
    ///
    /// The noise is white, the same inside the band as above it, unless the record shows that it went through a low-pass
    /// (`noise_density`).
    #[must_use]
    pub fn of(filter: &InverseFilter, density: &Density, rms: f64) -> Option<Self> {
        let band = filter.band();
        let nyquist_hz = 0.5 * band.sample_rate_hz();
        // Avoids the window's leakage at the edge and the recorder's own filter at the far end.
        let from_hz = band.end_hz() + 4.0 * density.step_hz;
        let to_hz = 0.98 * nyquist_hz;
        let mut above: Vec<f64> = density.between(from_hz, to_hz).map(|(_, v)| v).collect();
        if above.len() < FEWEST_FLOOR_BINS {
            return None;
        }
        above.sort_by(f64::total_cmp);
        let median = above[above.len() / 2];
        let white = median / density.median_over_mean();
        if white <= 0.0 {
            return None;
        }
        let NoiseDensity { values, filtered } = NoiseDensity::of(density, white, filter.inverse());
        let noise = |f: f64| values[(f / density.step_hz).round() as usize];
        let power = |weight: &dyn Fn(f64, f64) -> f64| -> f64 {
            density
                .between(0.0, band.end_hz())
                .map(|(f, v)| weight(f, v) * density.step_hz)
                .sum::<f64>()
                .sqrt()
        };
        let (floor, floor_band_hz) = match filtered {
            Some(filtered) => (filtered.level, filtered.range_hz),
            None => (white, [from_hz, to_hz]),
        };
        // The first bins contain the mean, spread by the window. What is slower than a block, such as a ramp or a late
        // step, is in the rms alone.
        let of_band = |f: f64, v: f64| match f < 2.0 * density.step_hz {
            true => 0.0,
            false => v * band.gain(f).powi(2),
        };
        let outside: f64 = density
            .between(band.top_hz(), nyquist_hz)
            .map(|(f, v)| v * (1.0 - band.gain(f).powi(2)) * density.step_hz)
            .sum();
        Some(Self {
            floor_per_root_hz: floor.sqrt(),
            floor_band_hz,
            recorded_rms: power(&|f, _| noise(f) * band.gain(f).powi(2)),
            compensated_rms: power(&|f, _| noise(f) * filter.response(f).norm_sqr()),
            in_band_rms: power(&of_band).max((rms * rms - outside).max(0.0).sqrt()),
            above_band_rms: band.cut_off(density, to_hz, noise).max(0.0).sqrt(),
            lost_hz: lost_ranges(density, band.top_hz(), &noise),
        })
    }

    /// Lowest frequency of the topmost range in which the record is lost in noise.
    #[must_use]
    pub fn lost_from_hz(&self, band_top_hz: f64) -> Option<f64> {
        self.lost_hz
            .last()
            .filter(|[_, to]| *to >= band_top_hz * (1.0 - 1e-9))
            .map(|[from, _]| *from)
    }

    /// The noise of the record times `factor`.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            floor_per_root_hz: self.floor_per_root_hz * factor.abs(),
            recorded_rms: self.recorded_rms * factor.abs(),
            compensated_rms: self.compensated_rms * factor.abs(),
            in_band_rms: self.in_band_rms * factor.abs(),
            above_band_rms: self.above_band_rms * factor.abs(),
            ..self
        }
    }
}

/// Sub-bands of `0..top_hz` whose mean density is within 3 dB of the floor, adjacent ones merged.
fn lost_ranges(density: &Density, top_hz: f64, noise: &dyn Fn(f64) -> f64) -> Vec<[f64; 2]> {
    let width = top_hz / SUB_BANDS as f64;
    let mut ranges: Vec<[f64; 2]> = Vec::new();
    for i in 0..SUB_BANDS {
        let (from, to) = (width * i as f64, width * (i + 1) as f64);
        let inside: Vec<(f64, f64)> = density.between(from, to).collect();
        let record: f64 = inside.iter().map(|(_, v)| v).sum();
        let floor: f64 = inside.iter().map(|(f, _)| noise(*f)).sum();
        if inside.is_empty() || record >= LOST_RATIO * floor {
            continue;
        }
        match ranges.last_mut() {
            Some(last) if last[1] == from => last[1] = to,
            _ => ranges.push([from, to]),
        }
    }
    ranges
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use num_complex::Complex64;

    use super::*;
    use crate::band::Band;
    use crate::compensate::whole_record;
    use crate::rms;
    use crate::spectrum::welch;

    const RATE: f64 = 20_000.0;

    /// A stand at 590 Hz with a damping ratio of 0.07.
    fn filter(band_hz: f64) -> InverseFilter {
        let inverse = |f: f64| {
            let u = f / 590.0;
            Complex64::new(1.0 - u * u, 0.14 * u)
        };
        InverseFilter::design(Arc::new(inverse), Band::new(RATE, band_hz).unwrap()).unwrap()
    }

    /// White noise of standard deviation `std`, seeded (sum of twelve uniform numbers).
    fn white(std: f64, count: usize) -> Vec<f64> {
        let mut state = 99_u64;
        let mut uniform = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..count)
            .map(|_| std * (0..12).map(|_| uniform()).sum::<f64>())
            .collect()
    }

    #[test]
    fn stated_noise_is_what_noise_becomes() {
        let filter = filter(2400.0);
        let noise = white(0.3, 200_000);
        let out = whole_record(&filter, &noise).unwrap();
        // 200 000 samples in a quarter of the Nyquist range give an RMS to about half a per cent.
        let measured = rms(&out[1000..199_000]);
        let gain = NoiseGain::of(&filter, |_| 1.0, 2);
        assert!(
            (gain.white * 0.3 / measured - 1.0).abs() < 0.03,
            "{} {measured}",
            gain.white * 0.3
        );

        // With a signal present, the floor above the band gives the same result.
        let record: Vec<f64> = noise
            .iter()
            .enumerate()
            .map(|(i, n)| n + 50.0 * (std::f64::consts::TAU * 120.0 * i as f64 / RATE).cos())
            .collect();
        let density = welch(&record, RATE, 4096).unwrap();
        let stated = RecordNoise::of(&filter, &density, rms(&record)).unwrap();
        assert!((stated.floor_per_root_hz.powi(2) / (2.0 * 0.09 / RATE) - 1.0).abs() < 0.05);
        assert!(
            (stated.compensated_rms / measured - 1.0).abs() < 0.05,
            "{stated:?} {measured}"
        );
        let expected = (0.5 * 50.0 * 50.0 + stated.recorded_rms.powi(2)).sqrt();
        assert!(
            (stated.in_band_rms / expected - 1.0).abs() < 0.01,
            "{stated:?} {expected}"
        );
    }

    #[test]
    fn the_range_without_signal_is_called_lost() {
        let filter = filter(2400.0);
        let record = white(0.01, 200_000);
        let density = welch(&record, RATE, 4096).unwrap();
        let lost = RecordNoise::of(&filter, &density, rms(&record)).unwrap();
        assert_eq!(
            lost.lost_from_hz(2400.0),
            Some(0.0),
            "nothing but noise: {:?}",
            lost.lost_hz
        );
        // A line in the lowest twenty-fourth of the band: everything above it is lost.
        let with_signal: Vec<f64> = record
            .iter()
            .enumerate()
            .map(|(i, n)| n + (std::f64::consts::TAU * 50.0 * i as f64 / RATE).cos())
            .collect();
        let density = welch(&with_signal, RATE, 4096).unwrap();
        let found = RecordNoise::of(&filter, &density, rms(&with_signal)).unwrap();
        assert_eq!(
            found.lost_from_hz(2400.0),
            Some(100.0),
            "{:?}",
            found.lost_hz
        );
    }

    #[test]
    fn a_signal_above_the_band_is_seen() {
        // The edge reaches from 2400 to 2880 Hz, with an amplitude of one half in its middle.
        for (frequency_hz, expected) in [(5000.0, 2.0_f64.sqrt()), (2640.0, 0.5_f64.sqrt())] {
            let angle = |i: usize| std::f64::consts::TAU * frequency_hz * i as f64 / RATE;
            let noise = white(0.1, 100_000);
            let record = noise.iter().enumerate();
            let record: Vec<f64> = record.map(|(i, n)| n + 2.0 * angle(i).cos()).collect();
            let density = welch(&record, RATE, 4096).unwrap();
            let found = RecordNoise::of(&filter(2400.0), &density, rms(&record)).unwrap();
            assert!(
                (found.above_band_rms / expected - 1.0).abs() < 0.02,
                "{found:?}"
            );
        }
    }

    #[test]
    fn no_room_above_the_band_is_no_estimate() {
        let filter = filter(9000.0);
        let density = welch(&white(1.0, 20_000), RATE, 4096).unwrap();
        assert_eq!(RecordNoise::of(&filter, &density, 1.0), None);
    }
}
