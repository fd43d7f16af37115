//! Splitting records into blocks, and their spectra.

use num_complex::Complex64;

use super::Block;

/// Window applied to a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Window {
    /// None: whole periods, or transients that decay within the block.
    None,
    /// Hann window, for noise.
    Hann,
    /// e^{−i/τ} over samples i, on both signals, for transients that do not decay within the block. It adds
    /// exactly 1/τ to every decay rate.
    Exponential(f64),
}

impl Window {
    /// Weight of a sample in a block of `count` samples.
    #[must_use]
    pub fn weight(self, i: usize, count: usize) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Hann => 0.5 - 0.5 * (std::f64::consts::TAU * i as f64 / count as f64).cos(),
            Self::Exponential(tau) => (-(i as f64) / tau).exp(),
        }
    }
}

/// Spectra of an applied and a measured block of the same length.
#[must_use]
pub fn transform(applied: &[f64], measured: &[f64], window: Window) -> Block {
    let transform = Transform::new(applied.len(), window);
    let (applied, measured) = of_both(applied, measured, |samples| transform.spectrum(samples));
    Block { applied, measured }
}

/// Spectrum of a signal at a range of lines only.
#[must_use]
pub fn lines_of(samples: &[f64], lines: std::ops::Range<usize>) -> Vec<Complex64> {
    Transform::new(samples.len(), Window::None).spectrum(samples)[lines].to_vec()
}

/// Minimum number of samples for processing both channels in parallel.
const WORTH_A_THREAD: usize = 1 << 17;

/// Applies a function to both channels.
fn of_both<T: Send>(
    applied: &[f64],
    measured: &[f64],
    work: impl Fn(&[f64]) -> T + Sync,
) -> (T, T) {
    if applied.len() < WORTH_A_THREAD {
        return (work(applied), work(measured));
    }
    std::thread::scope(|scope| {
        let beside = scope.spawn(|| work(measured));
        let first = work(applied);
        (first, beside.join().expect("a transform does not panic"))
    })
}

/// A transform for blocks of one length, with its plan and weights.
struct Transform {
    plan: std::sync::Arc<dyn torqcomp_fourier::RealToComplex<f64>>,
    /// Empty without a window.
    weights: Vec<f64>,
    without_mean: bool,
}

impl Transform {
    fn new(count: usize, window: Window) -> Self {
        Self {
            plan: torqcomp_fourier::forward(count),
            weights: match window {
                Window::None => Vec::new(),
                _ => (0..count).map(|i| window.weight(i, count)).collect(),
            },
            without_mean: window == Window::Hann,
        }
    }

    fn spectrum(&self, samples: &[f64]) -> Vec<Complex64> {
        let mean = match self.without_mean {
            true => samples.iter().sum::<f64>() / samples.len().max(1) as f64,
            false => 0.0,
        };
        let pairs = samples.iter().zip(&self.weights);
        let mut weighted: Vec<f64> = match self.weights.is_empty() {
            true => samples.to_vec(),
            false => pairs.map(|(v, w)| (v - mean) * w).collect(),
        };
        let mut out = self.plan.make_output_vec();
        self.plan
            .process(&mut weighted, &mut out)
            .expect("buffers were made for this length");
        out
    }
}

/// Hann-weighted segments of this length with 50 % overlap.
#[must_use]
pub fn segments(applied: &[f64], measured: &[f64], length: usize) -> Vec<Block> {
    let count = applied.len().min(measured.len());
    let transform = Transform::new(length, Window::Hann);
    let step = (length / 2).max(1);
    let spectra = |samples: &[f64]| -> Vec<Vec<Complex64>> {
        (0..(count + step).saturating_sub(length) / step)
            .map(|k| transform.spectrum(&samples[k * step..k * step + length]))
            .collect()
    };
    let (applied, measured) = of_both(applied, measured, spectra);
    let pairs = applied.into_iter().zip(measured);
    pairs
        .map(|(applied, measured)| Block { applied, measured })
        .collect()
}

/// Noise and distortion of the response to a periodic signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Periodic {
    /// Mean spectrum of a period.
    pub mean: Block,
    /// Noise power of the measured mean at each line: the variance between periods over their number.
    pub noise_power: Vec<f64>,
    /// Lines that the applied signal excites.
    pub excited: Vec<bool>,
}

/// Minimum power of an excited line relative to that of its noise: by chance once in 10^11 lines.
const EXCITED: f64 = 25.0;
/// Minimum amplitude of an excited line, relative to the strongest, below which distortion of the source may explain it.
const LEAST: f64 = 1e-4;

/// Averages whole periods (J. Schoukens, R. Pintelon, Y. Rolain, Mastering System Identification in 100 Exercises,
/// 2012, 5.2): differences between periods are noise, power of the mean at lines that are not excited is
/// distortion. `None` for fewer than two blocks.
#[must_use]
pub fn average_periods(periods: &[Block]) -> Option<Periodic> {
    let count = periods.len();
    let first = periods.first().filter(|_| count > 1)?;
    let lines = first.applied.len();
    let mean_of = |pick: fn(&Block) -> &Vec<Complex64>| -> Vec<Complex64> {
        (0..lines)
            .map(|k| periods.iter().map(|b| pick(b)[k]).sum::<Complex64>() / count as f64)
            .collect()
    };
    let mean = Block {
        applied: mean_of(|b| &b.applied),
        measured: mean_of(|b| &b.measured),
    };
    let noise_of = |pick: fn(&Block) -> &Vec<Complex64>, k: usize| -> f64 {
        let of = |b| (pick(b)[k] - pick(&mean)[k]).norm_sqr();
        periods.iter().map(of).sum::<f64>() / (count * (count - 1)) as f64
    };
    let noise_power = (0..lines).map(|k| noise_of(|b| &b.measured, k)).collect();
    let top = mean.applied[1..]
        .iter()
        .fold(0.0_f64, |m, x| m.max(x.norm()));
    let applied_noise: f64 = (1..lines).map(|k| noise_of(|b| &b.applied, k)).sum();
    let typical = EXCITED * applied_noise / (lines - 1).max(1) as f64;
    let is_excited = |x: &Complex64| x.norm() >= LEAST * top && x.norm_sqr() > typical;
    let excited = mean.applied.iter().map(is_excited).collect();
    Some(Periodic {
        mean,
        noise_power,
        excited,
    })
}

/// Minimum autocorrelation at the lag of a period.
const ALIKE: f64 = 0.98;

/// Period of a signal in samples; `None` for fewer than two periods.
#[must_use]
pub fn find_period(samples: &[f64]) -> Option<usize> {
    let count = samples.len();
    if count < 16 {
        return None;
    }
    let mean = samples.iter().sum::<f64>() / count as f64;
    let size = (2 * count).next_power_of_two();
    let mut padded: Vec<f64> = samples.iter().map(|v| v - mean).collect();
    let squares: Vec<f64> = std::iter::once(0.0)
        .chain(padded.iter().scan(0.0, |sum, v| {
            *sum += v * v;
            Some(*sum)
        }))
        .collect();
    padded.resize(size, 0.0);
    let forward = torqcomp_fourier::forward(size);
    let mut bins = forward.make_output_vec();
    forward
        .process(&mut padded, &mut bins)
        .expect("buffers were made for this length");
    bins.iter_mut()
        .for_each(|b| *b = Complex64::new(b.norm_sqr() / size as f64, 0.0));
    let inverse = torqcomp_fourier::inverse(size);
    inverse
        .process(&mut bins, &mut padded)
        .expect("buffers were made for this length");
    let alike = |lag: usize| {
        let power = (squares[count - lag] * (squares[count] - squares[lag])).sqrt();
        if power > 0.0 {
            padded[lag] / power
        } else {
            0.0
        }
    };
    // Skip the peak at lag 0.
    let fallen = (1..count / 2).find(|lag| alike(*lag) < 0.5)?;
    let peak = |lag: &usize| {
        alike(*lag) > ALIKE && alike(*lag) >= alike(lag - 1) && alike(*lag) >= alike(lag + 1)
    };
    (fallen..=count / 2)
        .filter(|lag| lag + 1 < count)
        .find(peak)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_and_distortion_are_told_apart() {
        // Lines 3 and 5 excited, the square of the signal in the output, a little noise.
        let wave = |i: usize| {
            let turn = std::f64::consts::TAU * i as f64 / 64.0;
            (3.0 * turn).cos() + (5.0 * turn).sin()
        };
        let applied: Vec<f64> = (0..640).map(wave).collect();
        let measured: Vec<f64> = applied
            .iter()
            .enumerate()
            .map(|(i, x)| x + 0.1 * x * x + 1e-4 * ((i * i) as f64).sin())
            .collect();
        assert_eq!(find_period(&applied), Some(64));
        let periods: Vec<Block> = (0..10)
            .map(|p| p * 64..(p + 1) * 64)
            .map(|r| transform(&applied[r.clone()], &measured[r], Window::None))
            .collect();
        let found = average_periods(&periods).unwrap();
        assert!(found.excited[3] && found.excited[5] && !found.excited[6]);
        // 0.1·cos² has 0.05 at twice the frequency: 0.05·64/2.
        assert!((found.mean.measured[6].norm() - 1.6).abs() < 0.01);
        assert!(found.noise_power[6] < 1e-4);
        assert_eq!(average_periods(&periods[..1]), None);
    }

    #[test]
    fn noise_has_no_period() {
        let mut state = 5_u64;
        let noise: Vec<f64> = (0..1000)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (state >> 33) as f64 - 1e9
            })
            .collect();
        assert_eq!(find_period(&noise), None);
    }

    #[test]
    fn an_exponential_window_moves_decay_rates_by_its_own() {
        let decay: Vec<f64> = (0..4096)
            .map(|i| (-0.002 * f64::from(i)).exp() * (0.3 * f64::from(i)).cos())
            .collect();
        let pulse: Vec<f64> = (0..4096).map(|i| if i == 0 { 1.0 } else { 0.0 }).collect();
        let block = transform(&pulse, &decay, Window::Exponential(500.0));
        let quicker: Vec<f64> = (0..4096)
            .map(|i| (-0.004 * f64::from(i)).exp() * (0.3 * f64::from(i)).cos())
            .collect();
        let plain = transform(&pulse, &quicker, Window::None);
        assert!(
            block
                .measured
                .iter()
                .zip(&plain.measured)
                .all(|(a, b)| (a - b).norm() < 1e-9)
        );
    }
}
