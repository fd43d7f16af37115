//! Tests whether stand and measuring chain change over a record: constants that differ between segments, and noise that
//! follows the signal. Neither is periodic with the input, so differences between periods count both as noise.

use std::f64::consts::TAU;
use std::ops::{Range, RangeInclusive};

use num_complex::Complex64;
use torqcomp_model::Mode;

use super::columns::Columns;
use super::fit::RecordResidual;
use super::residual_tests::{PowerShare, differences, without_mean};
use super::spectra::spectra;
use torqcomp_dsp::dot;

/// Numbers of segments of a record: few for slow changes, many for fast ones.
const SEGMENTS: [usize; 3] = [12, 36, 108];
/// Minimum number of segments.
const FEWEST: usize = 8;
/// Minimum length of a segment: samples, and time constants of the stand.
const SHORTEST: [f64; 2] = [24.0, 3.0];
/// Circular shifts of the residual against the record, for the chance distribution.
const SHIFTS: usize = 33;
/// Successive shifts differ by the golden ratio of the range, which avoids periods.
const GOLDEN: f64 = 0.618_033_988_749_895;
/// Range of the shifts, as fractions of the record.
const SHIFT_RANGE: [f64; 2] = [0.1, 0.9];
/// Lowest lines of a record's spectrum, where zero drift shows, followed by the lines used to estimate the noise there.
const LOWEST: RangeInclusive<usize> = 1..=12;
const ABOVE: Range<usize> = 13..130;
/// Corner frequencies of first-order noise tried, in lines: the lowest, the ratio of successive ones, and their number.
/// With a lower one, the spectrum of a jump would pass for noise.
const CORNERS: (f64, f64, i32) = (10.0, 1.3, 12);
/// Relative standard deviation of the estimated noise level.
const LEVEL_STD: f64 = 0.3;
/// Ratio of standard deviation to median absolute deviation of the normal distribution.
const STD_PER_MAD: f64 = 1.4826;

/// The power that separate constants in each segment remove from a residual: natural frequency, damping ratio and gain,
/// to first order, `r ≈ Σ_k a_k ∂y/∂p_k` with different `a_k` in each segment. A residual that does not depend on the
/// motion loses as much when shifted in time against the record, whatever its spectrum.
pub fn changing_constants(residuals: &[RecordResidual], mode: &Mode) -> PowerShare {
    const OF: &str = "constants that change over the record";
    let records: Vec<(Vec<f64>, [Vec<f64>; 3])> = residuals
        .iter()
        .map(|residual| {
            let slopes = slopes(&residual.modelled, mode, residual.record.rate_hz());
            let mut rest = residual.samples.clone();
            // What other constants for the whole record remove is not a change over it.
            let whole: Columns = slopes.iter().cloned().collect();
            whole.clear(&mut rest);
            (rest, slopes)
        })
        .collect();
    let rate_hz = residuals.first().map_or(1.0, |r| r.record.rate_hz());
    let decay_samples = rate_hz / (mode.damping_ratio * mode.omega_rad_s).max(1e-12);
    let shortest = SHORTEST[0].max(SHORTEST[1] * decay_samples).ceil() as usize;
    let with_segments = |count: usize| {
        let mut sums = vec![0.0; SHIFTS + 1];
        let mut total = 0.0;
        for (residual, slopes) in &records {
            let length = (residual.len() / count).max(shortest);
            if residual.len() < FEWEST * length {
                return PowerShare::none(OF);
            }
            total += dot(residual, residual);
            let segments = segments(slopes, length);
            for (shift, sum) in sums.iter_mut().enumerate() {
                let shifted = shifted(residual, shift);
                let pieces = shifted.chunks_exact(length).zip(&segments);
                *sum += pieces.map(|(r, slopes)| slopes.explained(r)).sum::<f64>();
            }
        }
        beyond_chance(OF, &sums, total)
    };
    let found = SEGMENTS.into_iter().map(with_segments);
    found
        .max_by(|a, b| a.share.total_cmp(&b.share))
        .unwrap_or(PowerShare::none(OF))
}

/// The power proportional to the square of the modelled record, sample by sample, `r² ≈ a + b y²`: the share
/// `b ⟨y²⟩/⟨r²⟩` is 1 for noise proportional to the signal and 0 for noise independent of it.
pub fn with_signal(residuals: &[RecordResidual]) -> PowerShare {
    const OF: &str = "the magnitude of the signal";
    with_square(OF, residuals, |r| r.modelled.clone())
}

/// The same with the slope of the modelled record, `r² ≈ a + b y'²`: sampling jitter `τ` causes `r = y' τ`.
pub fn with_slope(residuals: &[RecordResidual]) -> PowerShare {
    const OF: &str = "the slope of the signal, as sampling jitter would cause";
    with_square(OF, residuals, |r| slope(&r.modelled))
}

/// Change from sample to sample.
fn slope(y: &[f64]) -> Vec<f64> {
    let differences = differences(y).into_iter();
    differences.map(|difference| 0.5 * difference).collect()
}

/// The power of the residuals proportional to the square of a series, sample by sample.
fn with_square(
    of: &'static str,
    residuals: &[RecordResidual],
    signal: impl Fn(&RecordResidual) -> Vec<f64>,
) -> PowerShare {
    let mut slopes = vec![0.0; SHIFTS + 1];
    let (mut residual_power, mut signal_power, mut spread) = (0.0, 0.0, 0.0);
    for residual in residuals {
        let count = residual.samples.len() as f64;
        let mut signal = without_mean(&signal(residual));
        signal.iter_mut().for_each(|y| *y = y.powi(2));
        let level = signal.iter().sum::<f64>() / count;
        signal.iter_mut().for_each(|s| *s -= level);
        let squares: Vec<f64> = residual.samples.iter().map(|r| r * r).collect();
        residual_power += squares.iter().sum::<f64>();
        signal_power += level * count;
        spread += dot(&signal, &signal);
        for (shift, sum) in slopes.iter_mut().enumerate() {
            *sum += dot(&signal, &shifted(&squares, shift));
        }
    }
    if spread <= 0.0 {
        return PowerShare::none(of);
    }
    let shares: Vec<f64> = slopes.iter().map(|s| s / spread * signal_power).collect();
    beyond_chance(of, &shares, residual_power)
}

/// The power at the lowest frequencies above that of the neighbouring noise: a zero that drifts or jumps. The mean is
/// excluded. The noise may rise towards them like first-order noise.
pub fn wandering_zero(residuals: &[RecordResidual]) -> PowerShare {
    const OF: &str = "a drifting or jumping zero";
    let (mut excess, mut total, mut variance) = (0.0, 0.0, 0.0);
    for residual in residuals {
        let spectrum = spectra(&residual.samples, residual.samples.len()).power();
        total += spectrum.iter().sum::<f64>();
        let Some(level) = level_at_zero(&spectrum) else {
            continue;
        };
        let lowest = &spectrum[LOWEST];
        let count = lowest.len() as f64;
        excess += lowest.iter().sum::<f64>() - level * count;
        variance += level * level * (count + (LEVEL_STD * count).powi(2));
    }
    if total <= 0.0 || variance <= 0.0 {
        return PowerShare::none(OF);
    }
    PowerShare {
        of: OF,
        share: excess / total,
        significance: excess / variance.sqrt(),
    }
}

/// Noise power at the lowest lines of a spectrum: `S = a/(1 + (f/f_c)²)`, by maximum likelihood for the lines above (P.
/// Whittle, Ark. Mat. 2 (1953), 423).
fn level_at_zero(spectrum: &[f64]) -> Option<f64> {
    let above = spectrum.get(ABOVE)?;
    let (lowest, ratio, count) = CORNERS;
    let corners = (0..count).map(|k| lowest * ratio.powi(k));
    let fits = corners.chain([f64::INFINITY]).map(|corner| {
        let falls = ABOVE.map(|k| 1.0 + (k as f64 / corner).powi(2));
        let (mut sum, mut logarithms) = (0.0, 0.0);
        for (power, fall) in above.iter().zip(falls) {
            sum += power * fall;
            logarithms += fall.ln();
        }
        let level = sum / above.len() as f64;
        (above.len() as f64 * level.ln() - logarithms, level)
    });
    let best = fits.min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, level)| level)
}

impl PowerShare {
    fn none(of: &'static str) -> Self {
        Self {
            of,
            share: 0.0,
            significance: 0.0,
        }
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The excess of the first of several sums over the others, which are due to chance.
fn beyond_chance(of: &'static str, sums: &[f64], total: f64) -> PowerShare {
    if total <= 0.0 {
        return PowerShare::none(of);
    }
    let by_chance = median(sums[1..].to_vec());
    let deviations = sums[1..].iter().map(|s| (s - by_chance).abs());
    let std = STD_PER_MAD * median(deviations.collect());
    let excess = sums[0] - by_chance;
    PowerShare {
        of,
        share: excess / total,
        significance: if std > 0.0 { excess / std } else { 0.0 },
    }
}

/// A residual shifted circularly against the record; unchanged for shift 0.
fn shifted(values: &[f64], shift: usize) -> Vec<f64> {
    let [from, to] = SHIFT_RANGE;
    let part = from + (to - from) * (shift as f64 * GOLDEN).fract();
    let by = match shift {
        0 => 0,
        _ => (part * values.len() as f64) as usize,
    };
    in_a_circle(values, by)
}

/// Values shifted circularly by `by`.
pub(super) fn in_a_circle(values: &[f64], by: usize) -> Vec<f64> {
    [&values[by..], &values[..by]].concat()
}

/// `∂y/∂p` of a record `y = H u` for the relative natural frequency, the damping ratio and the relative gain, from `y`
/// itself: `∂ln H/∂ln ω₀ = 2 − 2(1 + jζw)/D`, `∂ln H/∂ζ = −2jw/D`, with `D = 1 − w² + 2jζw` and `w = ω/ω₀`.
fn slopes(modelled: &[f64], mode: &Mode, rate_hz: f64) -> [Vec<f64>; 3] {
    let count = modelled.len();
    let own = without_mean(modelled);
    let (forward, back) = (
        torqcomp_fourier::forward(count),
        torqcomp_fourier::inverse(count),
    );
    let mut spectrum = forward.make_output_vec();
    let _ = forward.process(&mut own.clone(), &mut spectrum);
    let through = |factor: &dyn Fn(f64) -> Complex64| {
        let mut changed: Vec<Complex64> = spectrum
            .iter()
            .enumerate()
            .map(|(k, s)| s * factor(TAU * k as f64 * rate_hz / count as f64 / mode.omega_rad_s))
            .collect();
        changed[0].im = 0.0;
        if count.is_multiple_of(2) {
            changed[count / 2].im = 0.0;
        }
        let mut samples = back.make_output_vec();
        let _ = back.process(&mut changed, &mut samples);
        samples.iter_mut().for_each(|x| *x /= count as f64);
        samples
    };
    let zeta = mode.damping_ratio;
    let d = |w: f64| Complex64::new(1.0 - w * w, 2.0 * zeta * w);
    let frequency = through(&|w| 2.0 - 2.0 * Complex64::new(1.0, zeta * w) / d(w));
    let damping = through(&|w| Complex64::new(0.0, -2.0 * w) / d(w));
    [own, frequency, damping]
}

/// The slopes in each segment.
fn segments(slopes: &[Vec<f64>; 3], length: usize) -> Vec<Columns> {
    let of = |k: usize| {
        let part = |slope: &Vec<f64>| slope[k * length..(k + 1) * length].to_vec();
        slopes.iter().map(part).collect()
    };
    (0..slopes[0].len() / length).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::test_noise::noise;

    const RATE_HZ: f64 = 1000.0;
    const COUNT: usize = 12_000;

    fn mode() -> Mode {
        Mode {
            omega_rad_s: TAU * 60.0,
            damping_ratio: 0.05,
        }
    }

    /// A record of 40 sines about the resonance, with a period of 2000 samples.
    fn record() -> Vec<f64> {
        let mut random = noise(5);
        let phases: Vec<f64> = (0..40).map(|_| TAU * random()).collect();
        (0..COUNT)
            .map(|i| {
                let line = |(k, phase): (usize, &f64)| {
                    let w = (80 + 2 * k) as f64 * 0.5 / 60.0;
                    let size = (1.0 - w * w).hypot(0.1 * w).recip();
                    size * (TAU * (80 + 2 * k) as f64 * i as f64 / 2000.0 + phase).cos()
                };
                phases.iter().enumerate().map(line).sum()
            })
            .collect()
    }

    fn of(residual: &[f64], modelled: &[f64]) -> [RecordResidual; 1] {
        let y = modelled.to_vec();
        [RecordResidual::made(y.clone(), y, residual.to_vec())]
    }

    #[test]
    fn a_changing_gain_is_detected_and_white_or_coloured_noise_is_not() {
        let y = record();
        let mut random = noise(9);
        let white: Vec<f64> = (0..COUNT).map(|_| random()).collect();
        let mut coloured = white.clone();
        for i in 2..COUNT {
            // Noise that rings at 60 Hz like the stand.
            coloured[i] += 1.84 * coloured[i - 1] - 0.98 * coloured[i - 2];
        }
        let swings: Vec<f64> = (0..COUNT)
            .map(|i| 0.01 * (TAU * 0.5 * i as f64 / RATE_HZ).sin() * y[i])
            .collect();
        let changing = |r: &[f64]| changing_constants(&of(r, &y), &mode());
        for quiet in [&white, &coloured] {
            let found = changing(quiet);
            assert!(found.share < 0.05, "{found:?}");
            assert!(found.significance < 5.0, "{found:?}");
        }
        let found = changing(&swings);
        assert!(found.share > 0.7 && found.significance > 10.0, "{found:?}");
    }

    #[test]
    fn noise_proportional_to_the_signal_has_a_share_of_one() {
        let y = record();
        let mut random = noise(3);
        let proportional: Vec<f64> = y.iter().map(|y| y * random()).collect();
        let stationary: Vec<f64> = y.iter().map(|_| random()).collect();
        let found = with_signal(&of(&proportional, &y));
        assert!((found.share - 1.0).abs() < 0.2, "{found:?}");
        assert!(found.significance > 8.0, "{found:?}");
        let found = with_signal(&of(&stationary, &y));
        assert!(found.share.abs() < 0.1, "{found:?}");
    }

    #[test]
    fn sampling_jitter_follows_the_slope_and_stationary_noise_does_not() {
        let y = record();
        let mut random = noise(7);
        let jitter: Vec<f64> = slope(&y).iter().map(|s| s * random()).collect();
        let stationary: Vec<f64> = y.iter().map(|_| random()).collect();
        let found = with_slope(&of(&jitter, &y));
        assert!((found.share - 1.0).abs() < 0.2, "{found:?}");
        assert!(found.significance > 8.0, "{found:?}");
        assert!(with_signal(&of(&jitter, &y)).share < 0.5 * found.share);
        assert!(with_slope(&of(&stationary, &y)).share.abs() < 0.1);
    }

    #[test]
    fn a_jumping_zero_is_detected_in_noise() {
        let mut random = noise(4);
        let quiet: Vec<f64> = (0..COUNT).map(|_| random()).collect();
        let jumps: Vec<f64> = quiet
            .iter()
            .enumerate()
            .map(|(i, r)| r + if (3000..7000).contains(&i) { 0.5 } else { 0.0 })
            .collect();
        assert!(wandering_zero(&of(&quiet, &quiet)).share.abs() < 0.01);
        // A variance of 1/12 in addition to 0.25 · (1/3 · 2/3).
        let found = wandering_zero(&of(&jumps, &jumps));
        assert!(
            (found.share - 0.4).abs() < 0.1 && found.significance > 10.0,
            "{found:?}"
        );
    }

    /// Threshold of zero drift in [`ResidualTests`](super::super::residual_tests::ResidualTests).
    const NONE: f64 = 6.0;

    #[test]
    fn noise_of_first_order_is_no_drifting_zero() {
        let mut random = noise(6);
        let mut colour = 0.0;
        for _ in 0..20 {
            let coloured: Vec<f64> = (0..1000)
                .map(|_| {
                    colour = 0.9 * colour + random();
                    colour
                })
                .collect();
            let found = wandering_zero(&of(&coloured, &coloured));
            assert!(found.significance < NONE, "{found:?}");
        }
    }

    #[test]
    fn slopes_match_differences_of_two_records() {
        // One line at 66 Hz, w = 1.1: H = 1/(1 − w² + 0.1 j w), with frequency or ζ changed by one part in 10⁵.
        let at = |natural_hz: f64, zeta: f64| {
            let w = 66.0 / natural_hz;
            Complex64::new(1.0 - w * w, 2.0 * zeta * w).inv()
        };
        let wave = |h: Complex64| -> Vec<f64> {
            let turn = |i: usize| Complex64::from_polar(1.0, TAU * 66.0 * i as f64 / RATE_HZ);
            (0..COUNT).map(|i| (h * turn(i)).re).collect()
        };
        let (here, step) = (at(60.0, 0.05), 1e-5);
        let own = slopes(&wave(here), &mode(), RATE_HZ);
        let moved = [
            here,
            (at(60.0 * (1.0 + step), 0.05) - at(60.0 * (1.0 - step), 0.05)) / (2.0 * step),
            (at(60.0, 0.05 + step) - at(60.0, 0.05 - step)) / (2.0 * step),
        ];
        for (found, expected) in own.iter().zip(moved) {
            let expected = wave(expected);
            let size = dot(&expected, &expected);
            let off: f64 = found
                .iter()
                .zip(&expected)
                .map(|(a, b)| (a - b).powi(2))
                .sum();
            assert!(off < 1e-6 * size, "{off} of {size}");
        }
    }
}
