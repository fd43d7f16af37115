//! Spectral lines added to a record: the amplitude is a property of the stand, the phase is found
//! in the record.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use torqcomp_fourier::phasors;

/// Distances from a line, in bins of the record's spectrum, at which the neighbouring signal is estimated:
/// beyond the main lobe of the window, and over more than the spacing of a typical comb.
const BESIDE: std::ops::RangeInclusive<u32> = 3..=20;
/// Largest plausible variance of the signal at a line, over the squared difference of the record's amplitude
/// from that of the stand.
const AGREEMENT: f64 = 8.0;

/// A steady line, independent of the input; its phase differs from record to record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectralLine {
    /// Frequency in Hz.
    pub frequency_hz: f64,
    /// Amplitude in units of the record.
    pub amplitude: f64,
}

impl SpectralLine {
    /// A frequency in Hz, followed by the amplitudes of its orders 1, 2, 3, …
    #[must_use]
    pub fn orders(p: &[f64]) -> Vec<Self> {
        let line = |order: usize| Self {
            frequency_hz: order as f64 * p[0],
            amplitude: p[order],
        };
        (1..p.len()).map(line).collect()
    }
}

/// A line found in a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoundLine {
    /// Frequency in Hz.
    pub frequency_hz: f64,
    /// Amplitude of the stand, in units of the record.
    pub amplitude: f64,
    /// Amplitude at that frequency in the record, signal included.
    pub recorded: f64,
    /// Phase of the sine at the record's first sample, in rad.
    pub phase_rad: f64,
    /// Fraction of the amplitude that was subtracted: 1 where the phase is certain, 0 where the signal
    /// hides it.
    pub share: f64,
}

/// Subtracts lines from a record, with the amplitude of the stand and the phase of the record.
///
/// With a phasor `P = A e^{jφ} + S`, known amplitude `A`, unknown phase, and a signal `S` of variance `σ²`, the mean of
/// `A e^{jφ}` is `A I₁(κ)/I₀(κ) e^{j arg P}`, `κ = 2 A |P|/σ²`. `σ²` is the largest power at the neighbouring
/// frequencies, since a comb may have one of its lines there, or less if `|P|` agrees with `A` more closely than that.
pub fn subtract_lines(
    samples: &mut [f64],
    rate_hz: f64,
    lines: &[SpectralLine],
    noise_std: f64,
) -> Vec<FoundLine> {
    let lines: Vec<SpectralLine> = lines
        .iter()
        .copied()
        .filter(|line| line.amplitude > 0.0 && line.frequency_hz < 0.5 * rate_hz)
        .collect();
    let step_hz = rate_hz / samples.len() as f64;
    let noise = 4.0 * noise_std * noise_std / samples.len() as f64;
    let found: Vec<FoundLine> = lines
        .iter()
        .map(|line| {
            let at = |hz: f64| phasor(samples, hz / rate_hz);
            let others = |hz: f64| {
                lines
                    .iter()
                    .any(|other| (other.frequency_hz - hz).abs() < 2.5 * step_hz)
            };
            let signal = BESIDE
                .flat_map(|d| {
                    [-1.0, 1.0].map(|side| line.frequency_hz + side * f64::from(d) * step_hz)
                })
                .filter(|hz| *hz > 2.0 * step_hz && !others(*hz))
                .map(|hz| at(hz).norm_sqr())
                .fold(0.0, f64::max);
            let phasor = at(line.frequency_hz);
            let off = phasor.norm() - line.amplitude;
            let variance = signal.min(AGREEMENT * off * off + noise).max(noise);
            let share = if variance > 0.0 {
                bessel_ratio(2.0 * line.amplitude * phasor.norm() / variance)
            } else {
                1.0
            };
            FoundLine {
                frequency_hz: line.frequency_hz,
                amplitude: line.amplitude,
                recorded: phasor.norm(),
                phase_rad: phasor.arg() + 0.5 * PI,
                share,
            }
        })
        .collect();
    for line in &found {
        let turn = TAU * line.frequency_hz / rate_hz;
        for (i, sample) in samples.iter_mut().enumerate() {
            *sample -= line.share * line.amplitude * (turn * i as f64 + line.phase_rad).sin();
        }
    }
    found
}

/// Phasor `P` of the component `Re(P e^{jωt})`, with a Hann window; the frequency in cycles per
/// sample.
fn phasor(samples: &[f64], cycles: f64) -> Complex64 {
    let count = samples.len() as f64;
    let mean = samples.iter().sum::<f64>() / count;
    let mut sum = Complex64::ZERO;
    let mut weights = 0.0;
    let half = Complex64::from_polar(1.0, 0.5 * TAU / count);
    let turning = phasors(-TAU * cycles, 0).zip(phasors(TAU / count, 0));
    for (sample, (phase, window)) in samples.iter().zip(turning) {
        let weight = 0.5 - 0.5 * (half * window).re;
        weights += weight;
        sum += weight * (sample - mean) * phase;
    }
    2.0 * sum / weights
}

/// `I₁(κ)/I₀(κ)`: series up to 12, asymptotic expansion above (Abramowitz and Stegun, 9.6.10 and 9.7.1).
fn bessel_ratio(kappa: f64) -> f64 {
    if kappa > 30.0 {
        let x = 8.0 * kappa;
        let zero = 1.0 + 1.0 / x + 9.0 / (2.0 * x * x) + 225.0 / (6.0 * x * x * x);
        let one = 1.0 - 3.0 / x - 15.0 / (2.0 * x * x) - 315.0 / (6.0 * x * x * x);
        return one / zero;
    }
    let quarter = 0.25 * kappa * kappa;
    let (mut zero, mut one) = (1.0, 1.0);
    let (mut term_zero, mut term_one) = (1.0, 1.0);
    for k in 1..60 {
        let k = f64::from(k);
        term_zero *= quarter / (k * k);
        term_one *= quarter / (k * (k + 1.0));
        zero += term_zero;
        one += term_one;
    }
    0.5 * kappa * one / zero
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ratio_of_bessel_functions_is_that_of_tables() {
        // I₁/I₀ at 1 (0.565159/1.266066), at 10 (2670.988/2815.717), and near 30 from both sides.
        assert!((bessel_ratio(1.0) - 0.446_390).abs() < 1e-6);
        assert!((bessel_ratio(10.0) - 0.948_600).abs() < 1e-6);
        assert!((bessel_ratio(30.0) - bessel_ratio(30.000_001)).abs() < 1e-6);
    }

    #[test]
    fn a_line_beside_a_strong_signal_is_taken_off() {
        let rate_hz = 1000.0;
        let clean: Vec<f64> = (0..2000)
            .map(|i| 5.0 * (TAU * 31.3 * f64::from(i) / rate_hz).sin() + 2.0)
            .collect();
        let line = SpectralLine {
            frequency_hz: 60.1,
            amplitude: 0.3,
        };
        let mut samples: Vec<f64> = clean
            .iter()
            .enumerate()
            .map(|(i, x)| x + 0.3 * (TAU * 60.1 * i as f64 / rate_hz + 1.1).sin())
            .collect();
        let found = subtract_lines(&mut samples, rate_hz, &[line], 0.0);
        assert!((found[0].phase_rad - 1.1).abs() < 1e-3, "{found:?}");
        let left = samples.iter().zip(&clean).map(|(a, b)| (a - b).abs());
        assert!(left.fold(0.0, f64::max) < 1e-3, "{found:?}");
    }

    #[test]
    fn a_signal_on_the_line_keeps_what_cannot_be_told_from_it() {
        // A comb of equal amplitudes with one line at 60 Hz; a tenth of that line is declared to be
        // hum.
        let rate_hz = 1000.0;
        let mut samples: Vec<f64> = (0..2000)
            .map(|i| {
                (1..100)
                    .map(|k| (TAU * 2.0 * f64::from(k * i) / rate_hz + f64::from(k * k)).sin())
                    .sum()
            })
            .collect();
        let line = SpectralLine {
            frequency_hz: 60.0,
            amplitude: 0.1,
        };
        let found = subtract_lines(&mut samples, rate_hz, &[line], 0.0);
        assert!(found[0].share < 0.3, "{found:?}");
    }
}
