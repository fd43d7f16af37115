//! Whether stand and chain hold still over a record: constants that differ from stretch to stretch, and noise that
//! goes with the signal. Neither repeats with the input, so that both pass for noise where the noise is taken from the
//! differences of periods.

use std::f64::consts::TAU;
use std::ops::{Range, RangeInclusive};

use num_complex::Complex64;
use realfft::RealFftPlanner;
use torqcomp_model::effects::Mode;

use super::columns::Columns;
use super::dependence::Sight;
use super::record::dot;

/// Stretches that a record is cut into: few for what changes slowly, many for what changes fast.
const STRETCHES: [usize; 3] = [12, 36, 108];
/// Fewest stretches.
const FEWEST: usize = 8;
/// Fewest samples and fewest time constants of the stand in a stretch.
const SHORTEST: [f64; 2] = [24.0, 3.0];
/// Turns of the residual against the record, that say what chance does.
const TURNS: usize = 33;
/// Part of a record by which the first turn is off, and each further one: the golden section meets no period.
const TURN: f64 = 0.618_033_988_749_895;
/// Lines of a record's spectrum in which a wandering zero is looked for, and the lines around, for comparison.
const LOWEST: RangeInclusive<usize> = 1..=12;
const AROUND: Range<usize> = 30..130;
/// From a median absolute deviation to a standard deviation of a normal law.
const MAD: f64 = 1.4826;

/// Share of the residual's power beyond what chance explains, and how many standard deviations that is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Beyond {
    /// Part of the power.
    pub share: f64,
    /// Standard deviations above none.
    pub significance: f64,
}

/// The power that constants of their own in each stretch take out of a residual: natural frequency, damping ratio and
/// gain, to first order, `r ≈ Σ_k a_k ∂y/∂p_k` with other `a_k` in each stretch. A residual that does not follow from
/// the motion loses as much when it is turned against the record in time, whatever its colour.
#[must_use]
pub fn changing_constants(sights: &[Sight], mode: &Mode, rate_hz: f64) -> Beyond {
    let records: Vec<(Vec<f64>, [Vec<f64>; 3])> = sights
        .iter()
        .map(|sight| {
            let slopes = slopes(sight.modelled, mode, rate_hz);
            let mut residual = sight.residual.to_vec();
            // What other constants for the whole record take out does not change over it.
            slopes
                .iter()
                .cloned()
                .collect::<Columns>()
                .clear(&mut residual);
            (residual, slopes)
        })
        .collect();
    let decay_samples = rate_hz / (mode.damping_ratio * mode.omega_rad_s).max(1e-12);
    let shortest = SHORTEST[0].max(SHORTEST[1] * decay_samples).ceil() as usize;
    let of = |count: usize| {
        let mut sums = vec![0.0; TURNS + 1];
        let mut total = 0.0;
        for (residual, slopes) in &records {
            let length = (residual.len() / count).max(shortest);
            if residual.len() < FEWEST * length {
                return Beyond::default();
            }
            total += dot(residual, residual);
            let stretches = stretches(slopes, length);
            for (turn, sum) in sums.iter_mut().enumerate() {
                *sum += explained(&stretches, &turned(residual, turn), length);
            }
        }
        beyond(&sums, total)
    };
    let found = STRETCHES.into_iter().map(of);
    found
        .max_by(|a, b| a.share.total_cmp(&b.share))
        .unwrap_or_default()
}

/// The power that goes with the square of the modelled record from sample to sample, `r² ≈ a + b y²`: the share
/// `b ⟨y²⟩/⟨r²⟩` is 1 for noise in proportion to the signal and 0 for noise that does not know it.
#[must_use]
pub fn with_signal(sights: &[Sight]) -> Beyond {
    with_square(sights, |sight| sight.modelled.to_vec())
}

/// The same with the slope of the modelled record, `r² ≈ a + b y'²`: sampling instants that tremble by `τ` leave
/// `r = y' τ`.
#[must_use]
pub fn with_slope(sights: &[Sight]) -> Beyond {
    with_square(sights, |sight| slope(sight.modelled))
}

/// Half the difference of both neighbours; of one neighbour and itself at the ends.
fn slope(y: &[f64]) -> Vec<f64> {
    let at = |i: usize| y[i.min(y.len() - 1)];
    (0..y.len())
        .map(|i| 0.5 * (at(i + 1) - at(i.saturating_sub(1))))
        .collect()
}

/// The power of the residuals that goes with the square of something from sample to sample.
fn with_square(sights: &[Sight], of: impl Fn(&Sight) -> Vec<f64>) -> Beyond {
    let mut slopes = vec![0.0; TURNS + 1];
    let (mut residual_power, mut signal_power, mut spread) = (0.0, 0.0, 0.0);
    for sight in sights {
        let count = sight.residual.len() as f64;
        let mut signal = of(sight);
        let mean = signal.iter().sum::<f64>() / count;
        signal.iter_mut().for_each(|y| *y = (*y - mean).powi(2));
        let level = signal.iter().sum::<f64>() / count;
        signal.iter_mut().for_each(|s| *s -= level);
        let squares: Vec<f64> = sight.residual.iter().map(|r| r * r).collect();
        residual_power += squares.iter().sum::<f64>();
        signal_power += level * count;
        spread += dot(&signal, &signal);
        for (turn, sum) in slopes.iter_mut().enumerate() {
            *sum += dot(&signal, &turned(&squares, turn));
        }
    }
    if spread <= 0.0 {
        return Beyond::default();
    }
    let shares: Vec<f64> = slopes.iter().map(|s| s / spread * signal_power).collect();
    beyond(&shares, residual_power)
}

/// The power at the lowest frequencies above that of the noise next to them: a zero that wanders or jumps. The mean is
/// not part of it.
#[must_use]
pub fn wandering_zero(sights: &[Sight]) -> Beyond {
    let (mut excess, mut total, mut variance) = (0.0, 0.0, 0.0);
    for sight in sights {
        let count = sight.residual.len();
        let spectrum = super::spectra::pieces(sight.residual, count).power();
        total += spectrum.iter().sum::<f64>();
        let Some(around) = spectrum.get(AROUND) else {
            continue;
        };
        let mut around = around.to_vec();
        around.sort_by(f64::total_cmp);
        // The median of what is distributed exponentially is ln 2 of its mean.
        let level = around[around.len() / 2] / std::f64::consts::LN_2;
        let lowest = &spectrum[LOWEST];
        excess += lowest.iter().sum::<f64>() - level * lowest.len() as f64;
        variance += level * level * lowest.len() as f64;
    }
    if total <= 0.0 || variance <= 0.0 {
        return Beyond::default();
    }
    Beyond {
        share: excess / total,
        significance: excess / variance.sqrt(),
    }
}

/// The first of several sums against the others, which chance has made.
fn beyond(sums: &[f64], total: f64) -> Beyond {
    if total <= 0.0 {
        return Beyond::default();
    }
    let middle = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let by_chance = middle(&mut sums[1..].to_vec());
    let mut off: Vec<f64> = sums[1..].iter().map(|s| (s - by_chance).abs()).collect();
    let deviation = MAD * middle(&mut off);
    let excess = sums[0] - by_chance;
    Beyond {
        share: excess / total,
        significance: if deviation > 0.0 {
            excess / deviation
        } else {
            0.0
        },
    }
}

/// A residual turned against the record; not at all for turn 0.
fn turned(values: &[f64], turn: usize) -> Vec<f64> {
    // Between a tenth and nine tenths of the record.
    let part = 0.1 + 0.8 * (turn as f64 * TURN).fract();
    let by = if turn == 0 {
        0
    } else {
        (part * values.len() as f64) as usize
    };
    [&values[by..], &values[..by]].concat()
}

/// `∂y/∂p` of a record `y = H u` for the relative natural frequency, the damping ratio and the relative gain, from `y`
/// itself: `∂ln H/∂ln ω₀ = 2 − 2(1 + jζw)/D`, `∂ln H/∂ζ = −2jw/D`, with `D = 1 − w² + 2jζw` and `w = ω/ω₀`.
fn slopes(modelled: &[f64], mode: &Mode, rate_hz: f64) -> [Vec<f64>; 3] {
    let count = modelled.len();
    let mean = modelled.iter().sum::<f64>() / count as f64;
    let own: Vec<f64> = modelled.iter().map(|y| y - mean).collect();
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, back) = (
        planner.plan_fft_forward(count),
        planner.plan_fft_inverse(count),
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

/// The slopes in each stretch.
fn stretches(slopes: &[Vec<f64>; 3], length: usize) -> Vec<Columns> {
    let of = |k: usize| {
        let part = |slope: &Vec<f64>| slope[k * length..(k + 1) * length].to_vec();
        slopes.iter().map(part).collect()
    };
    (0..slopes[0].len() / length).map(of).collect()
}

fn explained(stretches: &[Columns], residual: &[f64], length: usize) -> f64 {
    let pieces = residual.chunks_exact(length).zip(stretches);
    pieces.map(|(piece, slopes)| slopes.explained(piece)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 1000.0;
    const COUNT: usize = 12_000;

    fn mode() -> Mode {
        Mode {
            omega_rad_s: TAU * 60.0,
            damping_ratio: 0.05,
        }
    }

    /// Numbers between −0.5 and 0.5 that repeat on every run (a linear congruence).
    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        }
    }

    /// A record of 40 sines about the resonance that repeats every 2000 samples.
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

    fn sight<'a>(residual: &'a [f64], modelled: &'a [f64]) -> Sight<'a> {
        Sight {
            residual,
            input: modelled,
            modelled,
        }
    }

    #[test]
    fn a_gain_that_swings_is_seen_and_white_or_coloured_noise_is_not() {
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
        let of = |r: &[f64]| changing_constants(&[sight(r, &y)], &mode(), RATE_HZ);
        for quiet in [&white, &coloured] {
            let found = of(quiet);
            assert!(found.share < 0.05, "{found:?}");
            assert!(found.significance < 5.0, "{found:?}");
        }
        let found = of(&swings);
        assert!(found.share > 0.7 && found.significance > 10.0, "{found:?}");
    }

    #[test]
    fn noise_in_proportion_to_the_signal_has_a_share_of_one() {
        let y = record();
        let mut random = noise(3);
        let proportional: Vec<f64> = y.iter().map(|y| y * random()).collect();
        let steady: Vec<f64> = y.iter().map(|_| random()).collect();
        let found = with_signal(&[sight(&proportional, &y)]);
        assert!((found.share - 1.0).abs() < 0.2, "{found:?}");
        assert!(found.significance > 8.0, "{found:?}");
        let found = with_signal(&[sight(&steady, &y)]);
        assert!(found.share.abs() < 0.1, "{found:?}");
    }

    #[test]
    fn sampling_instants_that_tremble_go_with_the_slope_and_steady_noise_does_not() {
        let y = record();
        let mut random = noise(7);
        let tremble: Vec<f64> = slope(&y).iter().map(|s| s * random()).collect();
        let steady: Vec<f64> = y.iter().map(|_| random()).collect();
        let found = with_slope(&[sight(&tremble, &y)]);
        assert!((found.share - 1.0).abs() < 0.2, "{found:?}");
        assert!(found.significance > 8.0, "{found:?}");
        assert!(with_signal(&[sight(&tremble, &y)]).share < 0.5 * found.share);
        assert!(with_slope(&[sight(&steady, &y)]).share.abs() < 0.1);
    }

    #[test]
    fn a_zero_that_jumps_is_seen_beside_noise() {
        let mut random = noise(4);
        let quiet: Vec<f64> = (0..COUNT).map(|_| random()).collect();
        let jumps: Vec<f64> = quiet
            .iter()
            .enumerate()
            .map(|(i, r)| r + if (3000..7000).contains(&i) { 0.5 } else { 0.0 })
            .collect();
        assert!(wandering_zero(&[sight(&quiet, &quiet)]).share.abs() < 0.01);
        // A variance of 1/12 beside 0.25 · (1/3 · 2/3).
        let found = wandering_zero(&[sight(&jumps, &jumps)]);
        assert!(
            (found.share - 0.4).abs() < 0.1 && found.significance > 10.0,
            "{found:?}"
        );
    }

    #[test]
    fn slopes_are_the_differences_of_two_records() {
        // One line of 66 Hz, w = 1.1: H = 1/(1 − w² + 0.1 j w), changed by one part in 10⁵ of frequency or of ζ.
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
