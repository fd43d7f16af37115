//! A sampled input, extended beyond its ends and interpolated between its samples.

use std::sync::{Arc, OnceLock};

use num_complex::Complex64;
use torqcomp_fourier::{ComplexToReal, RealToComplex};

use super::between::Between;

/// A record of the applied quantity, prepared for simulation.
///
/// An end at which the record is periodic is extended periodically, any other by point reflection; both extensions
/// fade out, so that the transform, which treats it as periodic, sees no step. The difference between the extension
/// and the true history acts as an initial state of the stand.
pub struct Excitation {
    samples: Arc<Vec<f64>>,
    rate_hz: f64,
    start_s: f64,
    lead: usize,
    total: usize,
    periods: [Option<usize>; 2],
    spectrum: Vec<Complex64>,
    forward: Arc<dyn RealToComplex<f64>>,
    backward: Arc<dyn ComplexToReal<f64>>,
    substeps: usize,
    between: Between,
    fine: Vec<f64>,
    finer: OnceLock<Box<Self>>,
}

impl Excitation {
    /// Prepares a band-limited record, with `substeps` integration steps per sample.
    #[must_use]
    pub fn new(samples: Vec<f64>, rate_hz: f64, start_s: f64, substeps: usize) -> Self {
        let count = samples.len();
        // Integration needs one step before the record and two after it, even for a short record.
        let lead = (count / 16)
            .clamp(16, 2048)
            .min(count.saturating_sub(1))
            .max(2);
        let total = quick_length(count + 2 * lead);
        let ends = periods(&samples);
        Self::continued(samples, (rate_hz, start_s), substeps, (lead, total), ends)
    }

    /// Prepares a record that repeats indefinitely, so that no extension is needed.
    #[must_use]
    pub fn periodic(samples: Vec<f64>, rate_hz: f64, start_s: f64, substeps: usize) -> Self {
        let whole = (0, samples.len());
        Self::continued(samples, (rate_hz, start_s), substeps, whole, [None; 2])
    }

    fn continued(
        samples: Vec<f64>,
        (rate_hz, start_s): (f64, f64),
        substeps: usize,
        (lead, total): (usize, usize),
        periods: [Option<usize>; 2],
    ) -> Self {
        let input = Self {
            samples: Arc::new(samples),
            rate_hz,
            start_s,
            lead,
            total,
            periods,
            spectrum: Vec::new(),
            forward: torqcomp_fourier::forward(total),
            backward: torqcomp_fourier::inverse(total),
            substeps,
            between: Between::BandLimited,
            fine: Vec::new(),
            finer: OnceLock::new(),
        };
        input.refined(substeps, Between::BandLimited)
    }

    fn refined(&self, substeps: usize, between: Between) -> Self {
        let mut spectrum = self.transform_with(&self.samples, self.periods);
        for (line, value) in spectrum.iter_mut().enumerate() {
            *value *= between.factor(line as f64 / self.total as f64);
        }
        let fine = match between {
            Between::BandLimited => self.refine(&spectrum, substeps),
            Between::StraightLines | Between::Held => self.polygon(substeps, between),
        };
        Self {
            samples: self.samples.clone(),
            fine,
            spectrum,
            forward: self.forward.clone(),
            backward: self.backward.clone(),
            substeps,
            between,
            finer: OnceLock::new(),
            ..*self
        }
    }

    /// The same input with a sample at each of this many parts of a sample, made once: the steps of integration per sample
    /// are a multiple of it.
    pub(crate) fn finer(&self, parts: usize) -> &Self {
        if parts == 1 {
            return self;
        }
        self.finer.get_or_init(|| {
            let count = match self.lead {
                0 => self.samples.len() * parts,
                _ => (self.samples.len() - 1) * parts + 1,
            };
            let step = self.substeps / parts;
            let samples = self.fine.iter().skip(1).step_by(step).take(count);
            let samples: Vec<f64> = samples.copied().collect();
            let finer = Self::continued(
                samples,
                (self.rate_hz * parts as f64, self.start_s),
                step,
                (self.lead * parts, self.total * parts),
                self.periods.map(|period| Some(period? * parts)),
            );
            Box::new(finer.with_between(self.between))
        })
    }

    /// Sets the number of integration steps per sample.
    #[must_use]
    pub fn with_substeps(&self, substeps: usize) -> Self {
        self.refined(substeps, self.between)
    }

    /// Sets the waveform between samples.
    #[must_use]
    pub fn with_between(&self, between: Between) -> Self {
        self.refined(self.substeps, between)
    }

    /// Waveform between samples.
    #[must_use]
    pub fn between(&self) -> Between {
        self.between
    }

    /// The samples.
    #[must_use]
    pub fn samples(&self) -> &[f64] {
        &self.samples
    }

    /// Sampling rate in Hz.
    #[must_use]
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Time of the first sample in s.
    #[must_use]
    pub fn start_s(&self) -> f64 {
        self.start_s
    }

    /// Step of integration in s.
    pub(super) fn step_s(&self) -> f64 {
        1.0 / (self.rate_hz * self.substeps as f64)
    }

    /// Integration steps per sample.
    #[must_use]
    pub fn substeps(&self) -> usize {
        self.substeps
    }

    /// Spectrum of the continuous input, up to the Nyquist frequency.
    #[must_use]
    pub fn spectrum(&self) -> &[Complex64] {
        &self.spectrum
    }

    /// A line of the samples' own spectrum, without the waveform between them.
    pub(crate) fn line_of_samples(&self, line: usize) -> Complex64 {
        let cycles = self.omega_rad_s(line) / (std::f64::consts::TAU * self.rate_hz);
        self.spectrum[line] / self.between.factor(cycles)
    }

    /// Angular frequency of a line of the spectrum, in rad/s.
    #[must_use]
    pub fn omega_rad_s(&self, line: usize) -> f64 {
        std::f64::consts::TAU * line as f64 * self.rate_hz / self.total as f64
    }

    /// Excitation at the steps of integration, from one step before the first sample to two after the last, or, if
    /// periodic, to two after the first sample recurs.
    pub(super) fn fine(&self) -> &[f64] {
        &self.fine
    }

    /// Spectrum of a record of the same length that is a response to the input: where the input is periodic at its end,
    /// so is the response; the history before the record is unknown.
    #[must_use]
    pub fn transform(&self, samples: &[f64]) -> Vec<Complex64> {
        self.transform_with(samples, [None, self.periods[1]])
    }

    fn transform_with(&self, samples: &[f64], periods: [Option<usize>; 2]) -> Vec<Complex64> {
        let mut extended = extend(samples, self.lead, self.total, periods);
        let mut spectrum = self.forward.make_output_vec();
        // Cannot fail: the lengths match the plan.
        let _ = self.forward.process(&mut extended, &mut spectrum);
        spectrum
    }

    /// The record with this spectrum.
    #[must_use]
    pub fn samples_of(&self, mut spectrum: Vec<Complex64>) -> Vec<f64> {
        let mut extended = self.backward.make_output_vec();
        spectrum[0].im = 0.0;
        if self.total.is_multiple_of(2)
            && let Some(last) = spectrum.last_mut()
        {
            last.im = 0.0;
        }
        let _ = self.backward.process(&mut spectrum, &mut extended);
        let scale = 1.0 / self.total as f64;
        extended[self.lead..self.lead + self.samples.len()]
            .iter()
            .map(|x| x * scale)
            .collect()
    }

    /// The input with each sample held until the next, or joined to it by a straight line.
    fn polygon(&self, substeps: usize, between: Between) -> Vec<f64> {
        let count = self.samples.len();
        let sample = |k: usize| match self.lead {
            0 => self.samples[k % count],
            _ => self.samples[k.min(count - 1)],
        };
        let at = |node: usize| {
            // From one step before the first sample, which repeats if the record is periodic.
            let node = match (node.checked_sub(1), self.lead) {
                (Some(node), _) => node,
                (None, 0) => count * substeps - 1,
                (None, _) => 0,
            };
            let (from, part) = (node / substeps, (node % substeps) as f64 / substeps as f64);
            match between {
                Between::Held => sample(from),
                _ => sample(from) + part * (sample(from + 1) - sample(from)),
            }
        };
        (0..self.nodes(substeps)).map(at).collect()
    }

    /// Number of integration nodes, from one step before the first sample to two after the last.
    fn nodes(&self, substeps: usize) -> usize {
        match self.lead {
            0 => self.samples.len() * substeps + 3,
            _ => (self.samples.len() - 1) * substeps + 4,
        }
    }

    /// Interpolation of the continuous input.
    fn refine(&self, of: &[Complex64], substeps: usize) -> Vec<f64> {
        match self.total * substeps <= AT_ONCE {
            true => self.refine_at_once(of, substeps),
            false => self.refine_by_phases(of, substeps),
        }
    }

    /// Interpolation by zero-padding the spectrum.
    fn refine_at_once(&self, of: &[Complex64], substeps: usize) -> Vec<f64> {
        let long = self.total * substeps;
        let plan = torqcomp_fourier::inverse(long);
        let mut spectrum = plan.make_input_vec();
        spectrum[..of.len()].copy_from_slice(of);
        if substeps > 1 && self.total.is_multiple_of(2) {
            // The Nyquist line represents both signs of frequency.
            spectrum[of.len() - 1] *= 0.5;
        }
        spectrum[0].im = 0.0;
        let mut fine = plan.make_output_vec();
        let _ = plan.process(&mut spectrum, &mut fine);
        let scale = 1.0 / self.total as f64;
        let first = (self.lead * substeps + long - 1) % long;
        let nodes = fine.iter().cycle().skip(first);
        nodes
            .take(self.nodes(substeps))
            .map(|x| x * scale)
            .collect()
    }

    /// The same by shifting the record by each fraction of a sample, which needs no memory beside the result.
    fn refine_by_phases(&self, of: &[Complex64], substeps: usize) -> Vec<f64> {
        let first = (self.lead + self.total) * substeps - 1;
        let mut fine = vec![0.0; self.nodes(substeps)];
        let mut spectrum = self.backward.make_input_vec();
        let mut shifted = self.backward.make_output_vec();
        let scale = 1.0 / self.total as f64;
        for phase in 0..substeps {
            let part = phase as f64 / substeps as f64;
            let turn = std::f64::consts::TAU * part / self.total as f64;
            for (line, (to, from)) in spectrum.iter_mut().zip(of).enumerate() {
                *to = from * Complex64::cis(turn * line as f64);
            }
            spectrum[0].im = 0.0;
            if self.total.is_multiple_of(2)
                && let Some(last) = spectrum.last_mut()
            {
                // The mean of both signs of frequency.
                last.im = 0.0;
            }
            let _ = self.backward.process(&mut spectrum, &mut shifted);
            let own = (phase + substeps - first % substeps) % substeps;
            for node in (own..fine.len()).step_by(substeps) {
                fine[node] = shifted[(first + node) / substeps % self.total] * scale;
            }
        }
        fine
    }
}

/// Number of nodes up to which a grid is one transform, which takes five times the memory of the grid (0.3 GB). Both
/// ways agree to within rounding, which the steps of a fit amplify.
const AT_ONCE: usize = 1 << 23;

/// Extends a record at its ends, fading to zero over `lead` samples: periodically at an end with a period, by point
/// reflection otherwise.
fn extend(samples: &[f64], lead: usize, total: usize, periods: [Option<usize>; 2]) -> Vec<f64> {
    let mut extended = vec![0.0; total];
    let count = samples.len();
    extended[lead..lead + count].copy_from_slice(samples);
    let (first, last) = (samples[0], samples[count - 1]);
    for k in 1..=lead.min(count - 1) {
        let fade = 0.5 + 0.5 * (std::f64::consts::PI * k as f64 / (lead + 1) as f64).cos();
        // The last of a whole number of periods before sample −k or after sample count − 1 + k.
        let before = match periods[0] {
            Some(period) => samples[(period - k % period) % period],
            None => 2.0 * first - samples[k],
        };
        let after = match periods[1] {
            Some(period) => samples[count - period + (k - 1) % period],
            None => 2.0 * last - samples[count - 1 - k],
        };
        extended[lead - k] = fade * before;
        extended[lead + count - 1 + k] = fade * after;
    }
    extended
}

/// Number of samples that must repeat.
const REPEATED: usize = 512;
/// Shortest period.
const SHORTEST: usize = 64;
/// Mean-square difference allowed between repetitions, relative to that of the record.
const DIFFERS: f64 = 1e-4;

/// Periods at the start and end of a record, if any.
fn periods(samples: &[f64]) -> [Option<usize>; 2] {
    let reversed: Vec<f64> = samples.iter().rev().copied().collect();
    [period(samples), period(&reversed)]
}

/// Period at the start of a record.
fn period(samples: &[f64]) -> Option<usize> {
    let size = samples.iter().map(|x| x * x).sum::<f64>() / samples.len() as f64;
    let piece = &samples[..REPEATED.min(samples.len() / 4)];
    // A quiet start would match anything quiet.
    let energy = piece.iter().map(|x| x * x).sum::<f64>();
    if energy < 0.1 * size * piece.len() as f64 {
        return None;
    }
    let most = DIFFERS * energy;
    let repeats = |lag: &usize| {
        let mut sum = 0.0;
        let there = &samples[*lag..];
        piece.iter().zip(there).all(|(a, b)| {
            sum += (a - b) * (a - b);
            sum <= most
        })
    };
    (SHORTEST..samples.len().saturating_sub(piece.len())).find(repeats)
}

/// The smallest even length of at least `least` that is a product of 2, 3 and 5.
fn quick_length(least: usize) -> usize {
    let mut length = least + least % 2;
    loop {
        let mut rest = length;
        for prime in [2, 3, 5] {
            while rest.is_multiple_of(prime) {
                rest /= prime;
            }
        }
        if rest == 1 {
            return length;
        }
        length += 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nodes of a periodic sum of lines against the lines themselves; the line at half the rate is a cosine.
    #[test]
    fn every_node_is_on_the_lines_through_the_samples() {
        let turn = |samples: f64| std::f64::consts::TAU * samples / 60.0;
        let line = |t: f64| {
            0.3 + turn(7.0 * t).cos() - 0.5 * turn(23.0 * t).sin() + 0.2 * turn(30.0 * t).cos()
        };
        let samples: Vec<f64> = (0..60).map(|i| line(f64::from(i))).collect();
        for substeps in [1, 3, 8, 24] {
            let input = Excitation::periodic(samples.clone(), 100.0, 0.0, substeps);
            let by_phases = input.refine_by_phases(&input.spectrum, substeps);
            assert_eq!(by_phases.len(), 60 * substeps + 3);
            let both = input.fine().iter().zip(&by_phases).enumerate();
            for (node, (value, by_phases)) in both {
                let there = line((node as f64 - 1.0) / substeps as f64);
                let error = (value - there).abs().max((by_phases - there).abs());
                assert!(error < 1e-12, "{substeps}, {node}: {error}");
            }
        }
    }

    /// The same with continued ends.
    #[test]
    fn both_ways_to_refine_agree() {
        let samples: Vec<f64> = (0..501).map(|i| f64::from(i * i % 97) - 48.0).collect();
        let input = Excitation::new(samples, 100.0, 0.0, 12);
        let by_phases = input.refine_by_phases(&input.spectrum, 12);
        assert_eq!(input.fine().len(), by_phases.len());
        for (one, other) in input.fine().iter().zip(&by_phases) {
            assert!((one - other).abs() < 1e-11, "{one} {other}");
        }
    }
}
