//! Torque components at a fundamental and its orders, by least-squares sine fit.
//!
//! The record is modelled as
//!
//! ```text
//! x(t) = c + Σ_k A_k cos(2π n_k f₁ t + φ_k)
//! ```
//!
//! with all components fitted at once, so neither whole periods nor a window are needed (IEEE Std
//! 1057, sine fit with known frequency, for several frequencies). With time counted from the middle
//! of the record, the sums over products of cosines have closed forms and the cosine and sine parts
//! decouple, so only the right-hand side needs a pass over the data.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

use crate::Error;
use crate::store::SampleStore;

mod leftover;
mod refine;

use leftover::Leftover;

pub use refine::refine_fundamental;

/// Steps after which a rotating phasor is reset, to limit the accumulation of rounding errors.
const RESET_STEPS: usize = 512;
/// Number of phasors that rotate in parallel.
const TURNS: usize = 4;
/// Variance of an amplitude, relative to that of a well-separated one, above which components are
/// rejected.
const LARGEST_INFLATION: f64 = 1e4;

/// One component of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Component {
    /// Frequency relative to the fundamental.
    pub order: f64,
    /// Frequency in Hz.
    pub frequency_hz: f64,
    /// Complex amplitude `A e^{jφ}` of `A cos(2πft + φ)`, with `t` relative to the reference time.
    pub phasor: Complex64,
    /// Standard uncertainty of the amplitude, from the residual near the component.
    pub std_amplitude: f64,
    /// Standard uncertainty of the phase in rad, including that of a refined fundamental; `None` if
    /// the amplitude does not exceed its own uncertainty.
    pub std_phase_rad: Option<f64>,
}

impl Component {
    /// Adds an independent standard uncertainty of the amplitude.
    pub fn add_std(&mut self, std: f64) {
        self.std_amplitude = self.std_amplitude.hypot(std);
        let amplitude = self.phasor.norm();
        self.std_phase_rad = self
            .std_phase_rad
            .filter(|_| amplitude > self.std_amplitude)
            .map(|phase| phase.hypot(std / amplitude));
    }
}

/// Components of a record and the residual of the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Harmonics {
    /// The constant component.
    pub mean: f64,
    /// The components, in the order requested.
    pub components: Vec<Component>,
    /// RMS residual of the fit.
    pub residual_rms: f64,
}

/// A fundamental frequency and its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fundamental {
    /// Frequency in Hz.
    pub frequency_hz: f64,
    /// Standard uncertainty in Hz if it was found from the data, `None` if it was given.
    pub std_hz: Option<f64>,
}

impl Fundamental {
    /// A known fundamental.
    #[must_use]
    pub fn given(frequency_hz: f64) -> Self {
        Self {
            frequency_hz,
            std_hz: None,
        }
    }
}

/// Fits the components of a uniformly sampled record.
///
/// `start_s` is the time of the first sample; phases refer to time 0. The standard uncertainty of
/// an amplitude is `√(S(f)/T)` for a residual of one-sided density `S(f)` near the component and a
/// record of length `T`, times the variance inflation due to closely spaced components. A residual
/// line that is not fitted contributes through its leakage.
///
/// # Errors
/// [`Error::AboveNyquist`], [`Error::NotSeparable`] if the record is too short to resolve two
/// components (or one from the constant), [`Error::TooShort`] for fewer samples than unknowns,
/// [`Error::NotPositive`], [`Error::NonFinite`].
///
/// ```
/// use torqcomp_dsp::harmonics::{fit, Fundamental};
/// // 2.6 periods of 0.7 + 3 cos(2π 60 t + 30°): no whole number of periods, and yet exact.
/// let rate = 5000.0;
/// let x: Vec<f64> = (0..217)
///     .map(|i| 0.7 + 3.0 * (std::f64::consts::TAU * 60.0 * i as f64 / rate + 0.5236).cos())
///     .collect();
/// let h = fit(&x, rate, 0.0, Fundamental::given(60.0), &[1.0])?;
/// assert!((h.mean - 0.7).abs() < 1e-12);
/// assert!((h.components[0].phasor.norm() - 3.0).abs() < 1e-12);
/// assert!((h.components[0].phasor.arg() - 0.5236).abs() < 1e-12);
/// # Ok::<(), torqcomp_dsp::Error>(())
/// ```
pub fn fit(
    samples: &(impl SampleStore + ?Sized),
    sample_rate_hz: f64,
    start_s: f64,
    fundamental: Fundamental,
    orders: &[f64],
) -> Result<Harmonics, Error> {
    let count = samples.count();
    let solution = SineFit::solve(
        samples,
        count,
        sample_rate_hz,
        fundamental.frequency_hz,
        orders,
    )?;
    let leftover = Leftover::of(samples, &solution, solution.unknowns())?;
    let middle_s = start_s + 0.5 * (count - 1) as f64 / sample_rate_hz;
    let components = orders
        .iter()
        .enumerate()
        .map(|(k, &order)| {
            let frequency_hz = order * fundamental.frequency_hz;
            let std_amplitude = (leftover.near[k] * solution.variance_factor(k)).sqrt();
            let centred = solution.phasor(k);
            let turn = -TAU * frequency_hz * middle_s;
            let drift = fundamental
                .std_hz
                .map_or(0.0, |s| TAU * order * s * middle_s);
            let std_phase_rad = (centred.norm() > std_amplitude)
                .then(|| (std_amplitude / centred.norm()).hypot(drift));
            Component {
                order,
                frequency_hz,
                phasor: centred * Complex64::from_polar(1.0, turn),
                std_amplitude,
                std_phase_rad,
            }
        })
        .collect();
    Ok(Harmonics {
        mean: solution.mean(),
        components,
        residual_rms: (leftover.sum_squares / count as f64).sqrt(),
    })
}

/// A record without its mean and its best-fitting sines of these frequencies in Hz.
///
/// # Errors
/// As [`fit`].
pub fn without(
    samples: &[f64],
    sample_rate_hz: f64,
    frequencies_hz: &[f64],
) -> Result<Vec<f64>, Error> {
    let fit = SineFit::solve(samples, samples.len(), sample_rate_hz, 1.0, frequencies_hz)?;
    Ok(fit.residual(0, samples))
}

/// The linear fit about the middle of a record at given frequencies.
struct SineFit {
    /// Angular steps `2πf/f_s`, rad per sample.
    steps: Vec<f64>,
    length: usize,
    /// Constant and cosine amplitudes.
    even: DVector<f64>,
    /// Sine amplitudes.
    odd: DVector<f64>,
    even_gram: Cholesky<f64, Dyn>,
    odd_gram: Cholesky<f64, Dyn>,
}

impl SineFit {
    /// The fit to the first `length` samples of a record.
    fn solve(
        samples: &(impl SampleStore + ?Sized),
        length: usize,
        sample_rate_hz: f64,
        fundamental_hz: f64,
        orders: &[f64],
    ) -> Result<Self, Error> {
        check(length, sample_rate_hz, fundamental_hz, orders)?;
        let steps: Vec<f64> = orders
            .iter()
            .map(|order| TAU * order * fundamental_hz / sample_rate_hz)
            .collect();
        let mut sums = Projections::new(&steps, length);
        samples.pass(0..length, &mut |start, piece| sums.add(start, piece))?;
        let (even, odd) = sums.even_and_odd();
        if !even[0].is_finite() {
            all_finite(samples, length)?;
        }
        let (even_gram, odd_gram) = gram(&steps, length);
        let inseparable = || not_separable(orders, fundamental_hz, length as f64 / sample_rate_hz);
        let even_gram = Cholesky::new(even_gram).ok_or_else(inseparable)?;
        let odd_gram = Cholesky::new(odd_gram).ok_or_else(inseparable)?;
        let fit = Self {
            even: even_gram.solve(&even),
            odd: odd_gram.solve(&odd),
            steps,
            length,
            even_gram,
            odd_gram,
        };
        let inflated = (0..orders.len())
            .any(|k| fit.variance_factor(k) * 0.5 * length as f64 > LARGEST_INFLATION);
        if inflated {
            Err(inseparable())
        } else {
            Ok(fit)
        }
    }

    fn unknowns(&self) -> usize {
        1 + 2 * self.steps.len()
    }

    fn mean(&self) -> f64 {
        self.even[0]
    }

    /// `a cos + b sin = Re[(a − jb) e^{jωt}]`, about the middle of the record.
    fn phasor(&self, k: usize) -> Complex64 {
        Complex64::new(self.even[k + 1], -self.odd[k])
    }

    /// Variance of an amplitude per variance of white noise; `2/N` for well-separated components.
    fn variance_factor(&self, k: usize) -> f64 {
        let diagonal = |gram: &Cholesky<f64, Dyn>, index: usize, size: usize| {
            let mut unit = DVector::zeros(size);
            unit[index] = 1.0;
            gram.solve(&unit)[index]
        };
        let n = self.steps.len();
        diagonal(&self.even_gram, k + 1, n + 1).max(diagonal(&self.odd_gram, k, n))
    }

    /// Residuals of the samples from index `start`.
    fn residual(&self, start: usize, samples: &[f64]) -> Vec<f64> {
        let mut residual: Vec<f64> = samples.iter().map(|x| x - self.mean()).collect();
        for (k, &step) in self.steps.iter().enumerate() {
            let phasor = self.phasor(k);
            rotate(
                start..start + samples.len(),
                self.length,
                step,
                |i, turn| {
                    residual[i - start] -= phasor.re * turn.re - phasor.im * turn.im;
                },
            );
        }
        residual
    }
}

fn check(
    length: usize,
    sample_rate_hz: f64,
    fundamental_hz: f64,
    orders: &[f64],
) -> Result<(), Error> {
    for (name, value) in [
        ("sampling rate", sample_rate_hz),
        ("fundamental", fundamental_hz),
    ] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(Error::NotPositive { name, value });
        }
    }
    for &order in orders {
        if !(order > 0.0 && order.is_finite()) {
            return Err(Error::NotPositive {
                name: "order",
                value: order,
            });
        }
        if order * fundamental_hz >= 0.5 * sample_rate_hz {
            return Err(Error::AboveNyquist {
                frequency_hz: order * fundamental_hz,
                sample_rate_hz,
                nyquist_hz: 0.5 * sample_rate_hz,
            });
        }
    }
    let unknowns = 2 * orders.len() + 1;
    match length <= unknowns {
        true => Err(Error::TooShort {
            what: "a fit of that many components",
            expected: unknowns + 1,
            got: length,
        }),
        false => Ok(()),
    }
}

/// Reports the first non-finite value among the first samples.
fn all_finite(samples: &(impl SampleStore + ?Sized), length: usize) -> Result<(), Error> {
    let mut found = None;
    samples.pass(0..length, &mut |start, piece| {
        let place = piece.iter().position(|x| !x.is_finite());
        let here = place.map(|i| (start + i, piece[i]));
        found = found.or(here);
    })?;
    match found {
        Some((index, value)) => Err(Error::NonFinite { index, value }),
        None => Ok(()),
    }
}

/// The two closest frequencies, zero included.
fn not_separable(orders: &[f64], fundamental_hz: f64, seconds: f64) -> Error {
    let mut sorted: Vec<f64> = orders.iter().map(|o| o * fundamental_hz).collect();
    sorted.push(0.0);
    sorted.sort_by(f64::total_cmp);
    let closest = sorted
        .windows(2)
        .min_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))
        .expect("zero and at least one order");
    Error::NotSeparable {
        first_hz: closest[0],
        second_hz: closest[1],
        seconds,
        needed_s: 1.0 / (closest[1] - closest[0]),
    }
}

/// `Σ cos(ωm)` over `m = −(N−1)/2 … (N−1)/2` (Dirichlet kernel).
fn cosine_sum(step: f64, length: usize) -> f64 {
    let half = 0.5 * step;
    // At a multiple of a full turn every term is 1 (or alternates, for half-integer m).
    if (half / PI - (half / PI).round()).abs() < 1e-13 {
        let turns = (half / PI).round();
        let sign = if turns as i64 % 2 != 0 && length.is_multiple_of(2) {
            -1.0
        } else {
            1.0
        };
        return sign * length as f64;
    }
    (length as f64 * half).sin() / half.sin()
}

/// Gram matrices of the even part (constant, cosines) and the odd part (sines).
fn gram(steps: &[f64], length: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let n = steps.len();
    let with_zero = |i: usize| if i == 0 { 0.0 } else { steps[i - 1] };
    let even = DMatrix::from_fn(n + 1, n + 1, |i, j| {
        let (a, b) = (with_zero(i), with_zero(j));
        0.5 * (cosine_sum(a - b, length) + cosine_sum(a + b, length))
    });
    let odd = DMatrix::from_fn(n, n, |i, j| {
        let (a, b) = (steps[i], steps[j]);
        0.5 * (cosine_sum(a - b, length) - cosine_sum(a + b, length))
    });
    (even, odd)
}

/// Running projections of a stream of samples onto constant, cosines and sines about the middle.
struct Projections<'a> {
    steps: &'a [f64],
    length: usize,
    sum: f64,
    turned: Vec<Complex64>,
}

impl<'a> Projections<'a> {
    fn new(steps: &'a [f64], length: usize) -> Self {
        Self {
            steps,
            length,
            sum: 0.0,
            turned: vec![Complex64::ZERO; steps.len()],
        }
    }

    fn add(&mut self, start: usize, samples: &[f64]) {
        self.sum = samples.iter().fold(self.sum, |sum, x| sum + x);
        for (all, &step) in self.turned.iter_mut().zip(self.steps) {
            let mut sum = *all;
            rotate(
                start..start + samples.len(),
                self.length,
                step,
                |i, turn| {
                    sum += turn * samples[i - start];
                },
            );
            *all = sum;
        }
    }

    fn even_and_odd(&self) -> (DVector<f64>, DVector<f64>) {
        let even = std::iter::once(self.sum).chain(self.turned.iter().map(|sum| sum.re));
        let odd = self.turned.iter().map(|sum| sum.im);
        let count = self.steps.len();
        (
            DVector::from_iterator(count + 1, even),
            DVector::from_iterator(count, odd),
        )
    }
}

/// Calls `visit(i, e^{jω(i − (N−1)/2)})` for the samples of a part.
fn rotate(part: Range<usize>, length: usize, step: f64, mut visit: impl FnMut(usize, Complex64)) {
    let middle = 0.5 * (length - 1) as f64;
    // Each rotation depends on the previous one, so several run in parallel.
    let ahead: [Complex64; TURNS] =
        std::array::from_fn(|k| Complex64::from_polar(1.0, step * k as f64));
    let advance = Complex64::from_polar(1.0, step * TURNS as f64);
    let mut start = part.start;
    while start < part.end {
        let first = Complex64::from_polar(1.0, step * (start as f64 - middle));
        let mut turns = ahead.map(|turn| first * turn);
        let end = (start + RESET_STEPS - start % RESET_STEPS).min(part.end);
        let whole = end - (end - start) % TURNS;
        for i in (start..whole).step_by(TURNS) {
            for (k, turn) in turns.iter_mut().enumerate() {
                visit(i + k, *turn);
                *turn *= advance;
            }
        }
        for (i, turn) in (whole..end).zip(turns) {
            visit(i, turn);
        }
        start = end;
    }
}

#[cfg(test)]
mod tests;
