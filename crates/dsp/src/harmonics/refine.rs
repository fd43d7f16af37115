//! Estimation of the fundamental from the data.

use num_complex::Complex64;
use std::f64::consts::TAU;
use std::ops::Range;

use super::leftover::Leftover;
use super::{Fundamental, Projections, SineFit, fit, rotate};
use crate::Error;
use crate::store::SampleStore;

/// Longest piece used in the spectral search.
const LONGEST_SEARCH: usize = 1 << 17;
/// Maximum number of refinement steps at one record length.
const STEPS: usize = 30;
/// Uncertainty of the phase at the ends of a record, in turns, required before the record length is doubled.
const KEPT_TURNS: f64 = 1e-3;
/// The same for the whole record, limited by rounding of the phase at its ends.
const LAST_TURNS: f64 = 1e-10;

/// Power of orders in a window, relative to that of a fit without, below which they are side lobes.
const WINDOWED: f64 = 0.25;

/// Finds the fundamental near `start_hz`, within the fraction `span` of it (0.01 is 1 %).
///
/// The frequency with the most power at all its orders is found in a zero-padded spectrum; the sum
/// of squares of the sine fit is then minimised by Gauss–Newton steps, with the record length
/// doubled at each stage to avoid slipping by a period. The standard uncertainty follows from the
/// residual's density at the orders, each weighted by its influence on the frequency.
///
/// # Errors
/// Those of [`super::fit`], and [`Error::NotRefined`] if the best frequency lies at the end of the
/// span or the steps do not converge.
///
/// ```
/// use torqcomp_dsp::harmonics::refine_fundamental;
/// let x: Vec<f64> = (0..20_000)
///     .map(|i| (std::f64::consts::TAU * 59.873 * i as f64 / 10_000.0).cos())
///     .collect();
/// let found = refine_fundamental(&x, 10_000.0, 60.0, 0.01, &[1.0])?;
/// assert!((found.frequency_hz - 59.873).abs() < 1e-9);
/// # Ok::<(), torqcomp_dsp::Error>(())
/// ```
pub fn refine_fundamental(
    samples: &(impl SampleStore + ?Sized),
    sample_rate_hz: f64,
    start_hz: f64,
    span: f64,
    orders: &[f64],
) -> Result<Fundamental, Error> {
    let count = samples.count();
    let mut length = count.min(LONGEST_SEARCH);
    // Reports input errors before the search begins.
    SineFit::solve(samples, count, sample_rate_hz, start_hz, orders)?;
    let first = samples.part(0..length)?;
    let windowed = Windowed::of(&first, sample_rate_hz);
    let mut frequency_hz = windowed.strongest(start_hz, span, orders);
    loop {
        let turns = match length == count {
            true => LAST_TURNS,
            false => KEPT_TURNS,
        };
        let settled = Settled::of(samples, length, sample_rate_hz, frequency_hz, orders, turns);
        let settled = settled.map_err(|error| match error {
            // Of the frequency that was asked for, not of the start of these steps.
            Error::NotRefined { why, .. } => Error::NotRefined { start_hz, why },
            other => other,
        })?;
        frequency_hz = settled.frequency_hz;
        if (frequency_hz / start_hz - 1.0).abs() > span {
            return Err(Error::NotRefined {
                start_hz,
                why: "no clear maximum within the search span",
            });
        }
        if length == first.len() {
            // A side lobe of a stronger line elsewhere is a maximum without a window only.
            let fundamental = Fundamental::given(frequency_hz);
            let fitted = fit(&first[..], sample_rate_hz, 0.0, fundamental, orders)?;
            let power = fitted.components.iter().map(|c| c.phasor.norm_sqr());
            if windowed.power(frequency_hz, orders) < WINDOWED * power.sum::<f64>() {
                return Err(Error::NotRefined {
                    start_hz,
                    why: "only side lobes of a line elsewhere within the search span",
                });
            }
        }
        if length == count {
            let std_hz = settled.std_hz(samples, orders)?;
            return Ok(Fundamental {
                frequency_hz,
                std_hz: Some(std_hz),
            });
        }
        length = count.min(2 * length);
    }
}

/// Spectrum of samples about their mean in a Hann window, zero-padded.
struct Windowed {
    lines: Vec<Complex64>,
    /// Lines per Hz.
    per_hz: f64,
    /// Size of a line over the amplitude of a sine: a quarter of the number of samples.
    size: f64,
}

impl Windowed {
    fn of(samples: &[f64], rate_hz: f64) -> Self {
        let length = (4 * samples.len()).next_power_of_two();
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        let mut padded = vec![0.0; length];
        for (i, (slot, x)) in padded.iter_mut().zip(samples).enumerate() {
            let turn = TAU * (i as f64 + 0.5) / samples.len() as f64;
            *slot = (x - mean) * (0.5 - 0.5 * turn.cos());
        }
        let transform = torqcomp_fourier::forward(length);
        let mut lines: Vec<Complex64> = transform.make_output_vec();
        transform
            .process(&mut padded, &mut lines)
            .expect("buffers were made for this length");
        Self {
            lines,
            per_hz: length as f64 / rate_hz,
            size: 0.25 * samples.len() as f64,
        }
    }

    /// Sum of the squared amplitudes at the orders of a frequency.
    fn power(&self, frequency_hz: f64, orders: &[f64]) -> f64 {
        let at = |order: &f64| {
            let place = order * frequency_hz * self.per_hz;
            let bin = (place as usize).min(self.lines.len() - 2);
            let part = place - bin as f64;
            self.lines[bin].norm_sqr() * (1.0 - part) + self.lines[bin + 1].norm_sqr() * part
        };
        orders.iter().map(at).sum::<f64>() / (self.size * self.size)
    }

    /// Frequency with the largest power summed over its orders.
    fn strongest(&self, start_hz: f64, span: f64, orders: &[f64]) -> f64 {
        let highest = orders.iter().copied().fold(0.0, f64::max);
        let step_hz = 1.0 / self.per_hz / highest.max(1.0);
        let count = (span * start_hz / step_hz).ceil() as i64;
        (-count..=count)
            .map(|i| start_hz + i as f64 * step_hz)
            .map(|f| (f, self.power(f, orders)))
            .fold((start_hz, 0.0), |a, b| if b.1 > a.1 { b } else { a })
            .0
    }
}

/// A frequency whose last step was small enough.
struct Settled {
    frequency_hz: f64,
    /// The fit before the last step.
    fit: SineFit,
    /// Sum of squares of the derivative with respect to frequency, minus the part explained by the
    /// amplitudes.
    weight: f64,
}

impl Settled {
    /// Gauss–Newton on the frequency, with the amplitudes refitted at each step, until a step changes the phase at the
    /// ends of the first `length` samples by less than `turns`.
    fn of(
        samples: &(impl SampleStore + ?Sized),
        length: usize,
        rate_hz: f64,
        mut frequency_hz: f64,
        orders: &[f64],
        turns: f64,
    ) -> Result<Self, Error> {
        let start_hz = frequency_hz;
        let duration_s = length as f64 / rate_hz;
        for _ in 0..STEPS {
            let fit = SineFit::solve(samples, length, rate_hz, frequency_hz, orders)?;
            let (pull, weight) = fit.pull_and_weight(samples, orders, rate_hz)?;
            if weight <= 0.0 {
                break;
            }
            let step_hz = pull / weight;
            frequency_hz += step_hz;
            if !(frequency_hz > 0.0 && frequency_hz.is_finite()) {
                break;
            }
            if step_hz.abs() < turns / duration_s {
                return Ok(Self {
                    frequency_hz,
                    fit,
                    weight,
                });
            }
        }
        Err(Error::NotRefined {
            start_hz,
            why: "the fit does not converge",
        })
    }

    /// `σ²_f = Σ_k w_k S(f_k)(f_s/2) / (Σ w_k)²`, `w_k` being the contribution of order `k` to the
    /// squared derivative.
    fn std_hz(&self, samples: &(impl SampleStore + ?Sized), orders: &[f64]) -> Result<f64, Error> {
        let leftover = Leftover::of(samples, &self.fit, self.fit.unknowns() + 1)?;
        let pulls: Vec<f64> = orders
            .iter()
            .enumerate()
            .map(|(k, n)| (n * self.fit.phasor(k).norm()).powi(2))
            .collect();
        let total: f64 = pulls.iter().sum();
        let parts = pulls.iter().zip(&leftover.near);
        let variance: f64 = parts.map(|(pull, near)| pull / total * near).sum();
        Ok((variance / self.weight).sqrt())
    }
}

impl SineFit {
    /// Inner product of the residual and the model's derivative with respect to the fundamental, and the sum of
    /// squares of the part of that derivative orthogonal to mean and amplitudes, `Σ d² − bᵀ G⁻¹ b`. The residual is
    /// orthogonal to mean and amplitudes.
    fn pull_and_weight(
        &self,
        samples: &(impl SampleStore + ?Sized),
        orders: &[f64],
        rate_hz: f64,
    ) -> Result<(f64, f64), Error> {
        let (mut pull, mut square) = (0.0, 0.0);
        let mut sums = Projections::new(&self.steps, self.length);
        samples.pass(0..self.length, &mut |start, piece| {
            let residual = self.residual(start, piece);
            let slope = self.slope(start..start + piece.len(), orders, rate_hz);
            for (d, r) in slope.iter().zip(&residual) {
                pull += d * r;
                square += d * d;
            }
            sums.add(start, &slope);
        })?;
        let (even, odd) = sums.even_and_odd();
        let taken_up = even.dot(&self.even_gram.solve(&even)) + odd.dot(&self.odd_gram.solve(&odd));
        Ok((pull, square - taken_up))
    }

    /// Derivative of the model with respect to the fundamental, at the samples of a part.
    fn slope(&self, part: Range<usize>, orders: &[f64], rate_hz: f64) -> Vec<f64> {
        let middle = 0.5 * (self.length - 1) as f64;
        let mut slope = vec![0.0; part.len()];
        for (k, (&step, order)) in self.steps.iter().zip(orders).enumerate() {
            let phasor = self.phasor(k) * (TAU * order / rate_hz);
            rotate(part.clone(), self.length, step, |i, turn| {
                // d/df of Re[P e^{jωm}] = Re[j (2π n m / f_s) P e^{jωm}].
                slope[i - part.start] -= (i as f64 - middle) * (phasor * turn).im;
            });
        }
        slope
    }
}
