//! Finding the fundamental from the data.

use num_complex::Complex64;
use std::f64::consts::TAU;
use std::ops::Range;

use super::leftover::Leftover;
use super::{Fundamental, Projections, SineFit, rotate};
use crate::Error;
use crate::store::SampleStore;

/// Longest piece that the search by spectrum looks at.
const LONGEST_SEARCH: usize = 1 << 17;
/// Steps of the refinement at one length of record.
const STEPS: usize = 30;
/// Turns at the ends of a record within which its frequency must be known before a record of twice the length is looked at.
const KEPT_TURNS: f64 = 1e-3;
/// The same for the whole record: rounding in the phase at its ends is the floor.
const LAST_TURNS: f64 = 1e-10;

/// Finds the fundamental near `start_hz`, within `span` of it (0.01 is one per cent).
///
/// First the frequency with the most power at all its orders is looked up in a zero-padded
/// spectrum, then the sum of squares of the sine fit is made least by Gauss-Newton steps, over
/// twice the length of record at each stage so that no stage can slip by a period. The standard
/// uncertainty comes from the residual's density at the orders, each weighed by its pull on the
/// frequency.
///
/// # Errors
/// Those of [`super::fit`], and [`Error::NotRefined`] if the best frequency lies at the end of the
/// span or the steps do not settle.
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
    // Errors of the input are told before the search begins.
    SineFit::solve(samples, count, sample_rate_hz, start_hz, orders)?;
    let first = samples.part(0..length)?;
    let mut frequency_hz = search(&first, sample_rate_hz, start_hz, span, orders);
    loop {
        let turns = match length == count {
            true => LAST_TURNS,
            false => KEPT_TURNS,
        };
        let settled = Settled::of(samples, length, sample_rate_hz, frequency_hz, orders, turns)?;
        frequency_hz = settled.frequency_hz;
        if (frequency_hz / start_hz - 1.0).abs() > span {
            return Err(Error::NotRefined {
                start_hz,
                why: "no clear maximum within the search span",
            });
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

/// Frequency with the largest power summed over its orders.
fn search(samples: &[f64], rate_hz: f64, start_hz: f64, span: f64, orders: &[f64]) -> f64 {
    let length = (4 * samples.len()).next_power_of_two();
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    let mut padded = vec![0.0; length];
    for (i, (slot, x)) in padded.iter_mut().zip(samples).enumerate() {
        let turn = TAU * (i as f64 + 0.5) / samples.len() as f64;
        *slot = (x - mean) * (0.5 - 0.5 * turn.cos());
    }
    let transform = torqcomp_fourier::forward(length);
    let mut spectrum: Vec<Complex64> = transform.make_output_vec();
    transform
        .process(&mut padded, &mut spectrum)
        .expect("buffers were made for this length");
    let power_at = |frequency_hz: f64| {
        let place = frequency_hz / rate_hz * length as f64;
        let bin = (place as usize).min(spectrum.len() - 2);
        let part = place - bin as f64;
        spectrum[bin].norm_sqr() * (1.0 - part) + spectrum[bin + 1].norm_sqr() * part
    };
    let highest = orders.iter().copied().fold(0.0, f64::max);
    let step_hz = rate_hz / length as f64 / highest.max(1.0);
    let count = (span * start_hz / step_hz).ceil() as i64;
    (-count..=count)
        .map(|i| start_hz + i as f64 * step_hz)
        .map(|f| (f, orders.iter().map(|o| power_at(o * f)).sum::<f64>()))
        .fold((start_hz, 0.0), |a, b| if b.1 > a.1 { b } else { a })
        .0
}

/// A frequency of which the last step was small enough.
struct Settled {
    frequency_hz: f64,
    /// The fit before the last step.
    fit: SineFit,
    /// Sum of squares of the derivative by the frequency, less what the amplitudes take up.
    weight: f64,
}

impl Settled {
    /// Gauss-Newton on the frequency, the amplitudes being fitted anew at each step, until a step turns the ends of the
    /// first `length` samples by less than `turns`.
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

    /// `σ²_f = Σ_k w_k S(f_k)(f_s/2) / (Σ w_k)²`, `w_k` being the part of the slope's square that
    /// order `k` brings.
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
    /// Product of the residual and the model's derivative by the fundamental, and the sum of squares of what of that
    /// derivative mean and amplitudes cannot take up, `Σ d² − bᵀ G⁻¹ b`. The residual has nothing in common with what
    /// they can.
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

    /// Derivative of the model by the fundamental, at the samples of a part.
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
