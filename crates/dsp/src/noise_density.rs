//! Density of a recorder's noise at each line of a spectrum: white, or low-pass filtered.
//!
//! A stand amplifies torque at its resonance, but not noise that is added behind it. Where the record shows no
//! resonance in a smooth spectrum around it, that spectrum is noise. If it lies above the white floor at the highest
//! frequencies, the noise went through a low-pass: an amplifier's, or the recorder's anti-alias filter. With the record's
//! density `P`, the largest density of torque around the resonance is `T = ∑P/∑|H|²` over the peak, and the noise there
//! is the lower quartile of `P − T|H|²`. Below the resonance the noise is taken to be the same, which is too little if the
//! corner of the low-pass is below it, too; above, it is no larger than the smooth part of the record.

use crate::compensate::Inverse;
use crate::quality::median;
use crate::spectrum::Density;

/// Smallest `|H|²` of a resonance, relative to that at a quarter of its frequency.
const RESONANT: f64 = 10.0;
/// Half-width of a sharp peak in lines, due to the window.
const LOBE: usize = 8;
/// Points per line at which the response is summed over the peak.
const FINE: usize = 64;
/// Range around the resonance, relative to its frequency.
const AROUND: [f64; 2] = [0.5, 1.5];
/// Upper limit of that range, as a fraction of the spectrum.
const HIGHEST: f64 = 0.9;
/// Largest `|H|²` beside the peak, relative to the peak, and the minimum number of such lines.
const BESIDE: f64 = 0.1;
const FEWEST: usize = 32;
/// Minimum noise, relative to the record beside the peak and to the white floor.
const OF_RECORD: f64 = 0.5;
const OF_WHITE: f64 = 2.0;
/// Minimum noise, relative to the largest density of the record: what is less can be leakage of the window.
const LEAKAGE: f64 = 1e-7;
/// Largest mean density at the peak, relative to the median beside it.
const FLAT: f64 = 3.0;
/// Lines whose quartile is the smooth part of the record.
const SMOOTHED: usize = 16;
/// Lower quartile of the standard normal distribution.
const QUARTILE: f64 = -0.6745;

/// Density of the noise, one-sided.
pub(crate) struct NoiseDensity {
    /// At each line of the spectrum.
    pub values: Vec<f64>,
    /// `None` if it is white.
    pub filtered: Option<FilteredNoise>,
}

/// Low-pass filtered noise.
#[derive(Clone, Copy)]
pub(crate) struct FilteredNoise {
    /// Its density up to the resonance, unit²/Hz.
    pub level: f64,
    /// Range it was estimated in, in Hz.
    pub range_hz: [f64; 2],
    /// Line of the resonance.
    peak: usize,
}

impl NoiseDensity {
    /// Noise of a record with white floor `white`, on a stand with this inverse response.
    pub fn of(density: &Density, white: f64, inverse: &Inverse) -> Self {
        let filtered = filtered(density, white, inverse);
        let values = match &filtered {
            None => vec![white; density.values.len()],
            Some(filtered) => filtered.values(density, white),
        };
        Self { values, filtered }
    }
}

impl FilteredNoise {
    /// The noise at each line.
    fn values(&self, density: &Density, white: f64) -> Vec<f64> {
        let lines = density.values.len();
        let mut values = vec![self.level; self.peak];
        while values.len() < lines {
            // The last part begins earlier, so that all have the same length.
            let first = values.len().min(lines - SMOOTHED);
            let part = density.values[first..first + SMOOTHED].to_vec();
            let smooth = quartile(part) / density.quantile_over_mean(QUARTILE);
            let to = (values.len() + SMOOTHED).min(lines);
            values.resize(to, smooth.clamp(white, self.level));
        }
        values
    }
}

/// The level of the noise around the resonance, if it is above the white floor, and the range that shows it.
fn filtered(density: &Density, white: f64, inverse: &Inverse) -> Option<FilteredNoise> {
    let record = &density.values;
    let power = |place: f64| {
        let power = 1.0 / inverse(place * density.step_hz).norm_sqr();
        if power.is_finite() { power } else { 0.0 }
    };
    let response: Vec<f64> = (0..record.len()).map(|line| power(line as f64)).collect();
    let peak = (1..record.len()).max_by(|a, b| response[*a].total_cmp(&response[*b]))?;
    let broad = response[peak..]
        .iter()
        .take_while(|r| **r > 0.5 * response[peak]);
    let reach = broad.count().max(LOBE);
    let is_sharp = response[peak] >= RESONANT * response[peak / 4];
    if !is_sharp || peak < 3 * reach || peak + reach >= record.len() {
        return None;
    }
    let fine = (0..(2 * reach + 1) * FINE).map(|k| (k as f64 + 0.5) / FINE as f64);
    let first = (peak - reach) as f64 - 0.5;
    let of_response = fine.map(|place| power(first + place)).sum::<f64>() / FINE as f64;
    let at_peak: f64 = record[peak - reach..=peak + reach].iter().sum();
    let torque = at_peak / of_response;

    let [from, to] = AROUND.map(|part| (part * peak as f64) as usize);
    let to = to.min((HIGHEST * record.len() as f64) as usize);
    let beside = (from..to)
        .filter(|line| line.abs_diff(peak) > reach && response[*line] <= BESIDE * response[peak]);
    let beside: Vec<usize> = beside.collect();
    if beside.len() < FEWEST {
        return None;
    }
    let mut all: Vec<f64> = beside.iter().map(|line| record[*line]).collect();
    let low = quartile(all.clone());
    let middle = median(&mut all)?;
    let rest = beside
        .iter()
        .map(|line| record[*line] - torque * response[*line]);
    let noise = quartile(rest.collect());
    let level = noise / density.quantile_over_mean(QUARTILE);
    let is_flat = at_peak <= FLAT * middle * (2 * reach + 1) as f64;
    let largest = record.iter().copied().fold(0.0, f64::max);
    let least = (OF_WHITE * white).max(LEAKAGE * largest);
    let is_noise = is_flat && noise > OF_RECORD * low && level > least;
    let range_hz = [from, to].map(|line| line as f64 * density.step_hz);
    is_noise.then_some(FilteredNoise {
        level,
        range_hz,
        peak,
    })
}

/// Lower quartile of some values.
fn quartile(mut values: Vec<f64>) -> f64 {
    let place = (values.len() - 1) / 4;
    *values.select_nth_unstable_by(place, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use num_complex::Complex64;

    use super::*;

    /// A stand at 590 Hz with a damping ratio.
    fn stand(ratio: f64) -> Inverse {
        Arc::new(move |f: f64| {
            let u = f / 590.0;
            Complex64::new(1.0 - u * u, 2.0 * ratio * u)
        })
    }

    /// A density with lines every 5 Hz that hardly scatters.
    fn density(at: impl Fn(f64) -> f64) -> Density {
        Density {
            step_hz: 5.0,
            values: (0..2000).map(|line| at(5.0 * line as f64)).collect(),
            blocks: 1_000_000,
        }
    }

    #[test]
    fn low_pass_filtered_noise_is_distinguished_from_torque() {
        // Noise of 1 through a fourth-order low-pass at 1 kHz above a floor of 1e-4, and lines below 400 Hz.
        let low_pass = |f: f64| 1.0 / (1.0 + (f / 1000.0).powi(8));
        let lines = |f: f64| {
            if f < 400.0 && f as i64 % 60 == 0 {
                1e6
            } else {
                0.0
            }
        };
        let seen = density(|f| low_pass(f) + 1e-4 + lines(f));
        let found = NoiseDensity::of(&seen, 1e-4, &stand(0.02));
        let level = found.filtered.expect("filtered noise").level;
        assert!((0.8..1.05).contains(&level), "{level}");
        for (hz, tolerance) in [(100.0, 0.2), (900.0, 0.1), (2000.0, 0.2), (9000.0, 0.01)] {
            let (got, want) = (found.values[(hz / 5.0) as usize], low_pass(hz) + 1e-4);
            assert!(
                (got / want - 1.0).abs() < tolerance,
                "{hz} Hz: {got} {want}"
            );
        }
        // White noise, a torque of any density above it, and a torque that falls with the frequency are not filtered noise.
        for ratio in [0.002, 0.02, 0.1] {
            let inverse = stand(ratio);
            let torque = |f: f64, size: f64| density_of(size, f, &inverse);
            for seen in [
                density(|_| 1.0),
                density(|f| 1.0 + torque(f, 100.0)),
                density(|f| 1.0 + torque(f, 0.3)),
                density(|f| 1.0 + torque(f, 1e8 / (1.0 + f * f))),
            ] {
                let found = NoiseDensity::of(&seen, 1.0, &inverse);
                assert!(
                    found.filtered.is_none() && found.values[30] == 1.0,
                    "{ratio}"
                );
            }
        }
    }

    /// Density of a torque in the record, averaged over a line.
    fn density_of(size: f64, f: f64, inverse: &Inverse) -> f64 {
        let fine = (0..100).map(|k| f + 5.0 * (f64::from(k) / 100.0 - 0.495));
        size * fine.map(|f| 1.0 / inverse(f).norm_sqr()).sum::<f64>() / 100.0
    }
}
