//! Torque from the measured motion: contribution of the stand's restoring and friction torques.
//!
//! The displacement `x` is found from the gage signal `y = x + Σ n_shown(x)`, then every torque `n(x, x', z)` of the
//! stand along it, on a grid several times finer than the samples so that the torques do not alias; their memory
//! starts with the record. The applied quantity is `G u = x''/ω₀² + 2ζ x'/ω₀ + x + n` (the linear part by its
//! response).

use std::f64::consts::TAU;
use std::ops::Range;

use num_complex::Complex64;
use torqcomp_dsp::band::Band;
use torqcomp_dsp::compensate::{Fine, continued};
use torqcomp_model::chain::{GagePath, GageState};
use torqcomp_model::effects::{Memory, Torque};

/// Samples per block, and margin computed on both sides.
pub const BLOCK: usize = 16_384;
const MARGIN: usize = 1024;
/// Minimum block length for a short record.
const SHORTEST: usize = 256;

/// Parameters for the evaluation of the motion.
pub struct View<'a> {
    /// Sampling rate in Hz.
    pub rate_hz: f64,
    /// Steps per sample.
    pub factor: usize,
    /// Displacement under a constant load, as seen by the torques.
    pub shift: f64,
    /// Bandwidth of displacement and speed for the torques.
    pub band: &'a Band,
    /// Standard uncertainty of the speed, per second.
    pub speed_std: f64,
}

/// Where a torque that depends on the sign of the speed is known up to its size only.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct AtRest {
    /// Part of the record.
    pub part: f64,
    /// Mean over the record of the variance of the torque, which takes all values up to its size there: a third of the
    /// size squared.
    pub variance: f64,
}

impl AtRest {
    /// Of two stretches.
    pub fn plus(self, other: Self) -> Self {
        Self {
            part: self.part + other.part,
            variance: self.variance + other.variance,
        }
    }

    /// Over a multiple of the length.
    pub fn times(self, factor: f64) -> Self {
        Self {
            part: self.part * factor,
            variance: self.variance * factor,
        }
    }
}

/// Displacement and torques at the samples.
#[derive(Debug, Default)]
pub struct Motion {
    /// Displacement.
    pub x: Vec<f64>,
    /// Sum of the torques.
    pub torque: Vec<f64>,
    /// Samples at which the gage signal does not determine the displacement.
    pub hidden: Vec<usize>,
    /// Where the speed is within two standard uncertainties of zero.
    pub at_rest: AtRest,
    /// State for the next window, if any.
    pub next: Option<Carried>,
}

/// State at the end of a window's own part, from which the next one, starting a margin earlier,
/// continues.
#[derive(Debug)]
pub(crate) struct Carried {
    /// Displacement and torques over that margin.
    x: Vec<f64>,
    torque: Vec<f64>,
    memories: Vec<Memory>,
    kept: Option<Vec<f64>>,
    gage: GageState,
}

/// Connection of a window of a long record with its neighbours.
#[derive(Debug, Default)]
pub struct Beside {
    /// State from the previous window.
    pub before: Option<Carried>,
    /// End of the window's own part, a whole number of blocks after its start, and number of samples before it at which
    /// the next window starts.
    pub end: Option<(usize, usize)>,
}

/// Displacement and torques for a gage signal.
pub fn motion(
    torques: &[&dyn Torque],
    gage_path: GagePath,
    signal: &[f64],
    view: &View,
    beside: Beside,
) -> Motion {
    let block = signal.len().next_multiple_of(SHORTEST).min(BLOCK);
    let margin = MARGIN.min(4 * block);
    let mut walk = MotionPass {
        torques,
        view,
        margin,
        fine: Fine::new(block + 2 * margin, margin, view.factor, view.rate_hz),
        memories: Vec::new(),
        gage_path,
        kept: None,
        at_rest: AtRest::default(),
        found: Motion::default(),
    };
    if let Some(before) = beside.before {
        walk.memories = before.memories;
        walk.kept = before.kept;
        walk.gage_path = walk.gage_path.from(before.gage);
        (walk.found.x, walk.found.torque) = (before.x, before.torque);
    }
    let first = walk.found.x.len();
    let last = beside.end.map_or(signal.len(), |(end, _)| end);
    for start in (first..signal.len()).step_by(block) {
        let window: Vec<f64> = (0..block + 2 * margin)
            .map(|i| continued(signal, (start + i) as isize - margin as isize))
            .collect();
        walk.block(&window, start, block.min(signal.len() - start));
        if start < last {
            walk.found.at_rest = walk.at_rest;
        }
        if let Some((end, margin)) = beside.end.filter(|(end, _)| *end == start + block) {
            walk.found.next = Some(walk.carried(end - margin..end));
        }
    }
    let steps = ((last - first) * view.factor) as f64;
    walk.found.at_rest = walk.found.at_rest.times(1.0 / steps);
    walk.found
}

struct MotionPass<'a> {
    torques: &'a [&'a dyn Torque],
    view: &'a View<'a>,
    margin: usize,
    fine: Fine,
    memories: Vec<Memory>,
    gage_path: GagePath<'a>,
    /// Torques at the end of the previous block.
    kept: Option<Vec<f64>>,
    /// Summed over the steps.
    at_rest: AtRest,
    found: Motion,
}

impl MotionPass<'_> {
    /// The present state, with the results over a range.
    fn carried(&self, range: Range<usize>) -> Carried {
        Carried {
            x: self.found.x[range.clone()].to_vec(),
            torque: self.found.torque[range].to_vec(),
            memories: self.memories.clone(),
            kept: self.kept.clone(),
            gage: self.gage_path.state(),
        }
    }

    fn block(&mut self, window: &[f64], start: usize, count: usize) {
        let (margin, factor) = (self.margin, self.view.factor);
        let inner = margin..margin + count;
        let mut lines = self.fine.spectrum(window);
        if !self.gage_path.is_empty() {
            let signal = self.fine.refined(&lines, |_| Complex64::ONE);
            let part = margin * factor..(margin + count) * factor;
            let (x, hidden) = self.gage_path.displacement(&signal, part);
            lines = self.fine.spectrum_of_fine(&x);
            let base = self.fine.samples(&lines);
            self.found.x.extend_from_slice(&base[inner.clone()]);
            let mut hidden: Vec<usize> =
                hidden.iter().map(|i| start + i / factor - margin).collect();
            hidden.dedup();
            self.found.hidden.extend(hidden);
        } else {
            self.found.x.extend_from_slice(&window[inner.clone()]);
        }
        let torque = self.torques(&lines, count);
        let base = self.fine.samples(&self.fine.spectrum_of_fine(&torque));
        self.found.torque.extend_from_slice(&base[inner]);
    }

    /// The torques over a window.
    fn torques(&mut self, lines: &[Complex64], count: usize) -> Vec<f64> {
        let (band, factor) = (self.view.band, self.view.factor);
        let x = self.fine.refined(lines, |f| Complex64::from(band.gain(f)));
        let speed = self
            .fine
            .refined(lines, |f| Complex64::new(0.0, TAU * f * band.gain(f)));
        let (first, last) = (self.margin * factor, (self.margin + count) * factor);
        let rest = 2.0
            * self
                .view
                .speed_std
                .hypot(self.speed_beyond(lines, first..last));
        if self.memories.is_empty() {
            let begin = |torque: &&dyn Torque| torque.begin(x[first] + self.view.shift);
            self.memories = self.torques.iter().map(begin).collect();
        }
        let mut torque = vec![0.0; x.len()];
        let mut memories = std::mem::take(&mut self.memories);
        let mut after = Vec::new();
        for i in first..x.len() {
            if i == last {
                // The rest is computed again in the next block.
                after = memories.clone();
            }
            let change = 0.5 * (speed[(i + 1).min(x.len() - 1)] - speed[i - 1]);
            torque[i] = self.sum(&mut memories, x[i], speed[i], change);
            if i < last && speed[i].abs() < rest {
                self.at_rest = self.at_rest.plus(self.unknown(&memories, x[i], rest));
            }
        }
        self.memories = after;
        match &self.kept {
            Some(kept) => torque[..first].copy_from_slice(kept),
            None => {
                let start = torque[first];
                torque[..first].fill(start);
            }
        }
        self.kept = Some(torque[last - first..last].to_vec());
        torque
    }

    /// What is unknown of the torques at a step at rest.
    fn unknown(&self, memories: &[Memory], x: f64, rest: f64) -> AtRest {
        let x = x + self.view.shift;
        let half = |(torque, memory): (&&dyn Torque, &Memory)| {
            let towards = |speed: f64| torque.value(&mut memory.clone(), x, speed);
            0.5 * (towards(rest) - towards(-rest))
        };
        let pairs = self.torques.iter().zip(memories);
        let switching = pairs.filter(|(torque, _)| torque.switches());
        let size: f64 = switching.map(half).sum();
        AtRest {
            part: 1.0,
            variance: size * size / 3.0,
        }
    }

    /// Rms of the speed beyond the band, if a torque switches with its sign. Where the speed changes its slope, as at a
    /// body that comes to rest, its spectrum falls with the square of the frequency: beyond a band there is 1/√7 of what is
    /// in its last octave.
    fn speed_beyond(&self, lines: &[Complex64], part: Range<usize>) -> f64 {
        if !self.torques.iter().any(|torque| torque.switches()) {
            return 0.0;
        }
        let band = self.view.band;
        let octave = self
            .fine
            .refined(lines, |hz| match hz > 0.5 * band.top_hz() {
                true => Complex64::new(0.0, TAU * hz * band.gain(hz)),
                false => Complex64::ZERO,
            });
        let square: f64 = octave[part.clone()].iter().map(|v| v * v).sum();
        (square / part.len() as f64 / 7.0).sqrt()
    }

    fn sum(&self, memories: &mut [Memory], x: f64, speed: f64, change: f64) -> f64 {
        // The speed varies uniformly within a step.
        let std = self.view.speed_std.hypot(change / 12.0_f64.sqrt());
        let pairs = self.torques.iter().zip(memories);
        pairs
            .map(|(torque, memory)| torque.blurred(memory, x + self.view.shift, speed, std))
            .sum()
    }
}
