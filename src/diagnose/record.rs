//! A record of applied and measured quantity, ready to be compared with models.

use std::ops::Range;
use std::sync::Arc;

use torqcomp_model::effects::Mode;
use torqcomp_model::simulate::{Excitation, State};

use super::columns::Columns;
use super::structure::Waves;

/// How a record begins.
#[derive(Debug, Clone, Copy, Default)]
pub struct Begin {
    /// Motion at the first sample.
    pub start: State,
    /// Displacement by a constant load that is not in the input.
    pub shift: f64,
}

/// One record, or the part of it that is fitted or held out.
#[derive(Clone)]
pub struct Record {
    /// File it comes from.
    pub source: String,
    /// The applied quantity.
    pub input: Arc<Excitation>,
    /// The measured one, of the same length.
    pub measured: Arc<Vec<f64>>,
    /// The samples that count.
    pub range: Range<usize>,
    /// How the record begins, as far as it is known.
    pub begin: Begin,
}

/// What belongs to a record and not to the stand, and is taken out of its residual.
#[derive(Default)]
pub struct Nuisance {
    columns: Columns,
    /// Place of the columns of the free motion, if they are in it.
    motion: Option<usize>,
    /// Whether enough of the free motion is left in the range to tell how it began.
    sees_start: bool,
    /// Place of the column of a constant load.
    shift: Option<usize>,
    /// Place of the first column of the lines.
    lines: usize,
}

/// Time constants before the range after which nothing is left of the motion at a record's start.
const NOTHING_LEFT: f64 = 12.0;
/// Time constants up to which the range tells that motion: beyond, noise would be multiplied by more than `e³` on its way back to the start.
const START_SEEN: f64 = 3.0;

impl Record {
    /// Samples of the range.
    #[must_use]
    pub fn count(&self) -> usize {
        self.range.len()
    }

    /// What belongs to this record: a constant, the free motion of the plain stand after the record's
    /// start, and lines of the given frequencies.
    ///
    /// `shift` is what a constant load does to the record, where that is more than a constant.
    #[must_use]
    pub fn nuisance(&self, mode: &Mode, waves: &Waves, shift: Option<Vec<f64>>) -> Nuisance {
        let mut nuisance = Nuisance::default();
        nuisance.columns.push(vec![1.0; self.count()]);
        let rate_hz = self.input.rate_hz();
        let decay = mode.damping_ratio * mode.omega_rad_s / rate_hz * self.range.start as f64;
        // After many time constants nothing is left of it.
        if decay < NOTHING_LEFT {
            nuisance.motion = Some(1);
            nuisance.sees_start = decay < START_SEEN;
            let model = torqcomp_model::simulate::Model {
                mode: *mode,
                gain: 1.0,
                recorder: None,
                shift: 0.0,
                actions: Vec::new(),
            };
            for column in model.free_motion(rate_hz, self.range.end) {
                nuisance.columns.push(column[self.range.clone()].to_vec());
            }
        }
        if let Some(column) = shift {
            nuisance.shift = Some(nuisance.columns.count());
            nuisance.columns.push(column);
        }
        let count = self.count() as f64;
        for wave in 1..=waves.course {
            let turn = std::f64::consts::PI * wave as f64 / count;
            nuisance.columns.push(
                (0..self.count())
                    .map(|i| (turn * (i as f64 + 0.5)).cos())
                    .collect(),
            );
        }
        for rate_per_s in &waves.fades_per_s {
            let step = rate_per_s / rate_hz;
            nuisance.columns.push(
                (0..self.count())
                    .map(|i| (-step * i as f64).exp())
                    .collect(),
            );
        }
        nuisance.lines = nuisance.columns.count();
        for frequency_hz in &waves.lines_hz {
            let turn = std::f64::consts::TAU * frequency_hz / rate_hz;
            // A turning phasor, set right now and then.
            let wave =
                |part: fn(f64) -> f64| self.range.clone().map(|i| part(turn * i as f64)).collect();
            nuisance.columns.push(wave(f64::cos));
            nuisance.columns.push(wave(f64::sin));
        }
        nuisance
    }
}

/// Coefficients of what was taken out of a residual.
#[derive(Debug, Clone, Default)]
pub struct Taken {
    /// The constant.
    pub offset: f64,
    /// Displacement, and speed over `ω₀`, at the start of the record, where the range still tells them.
    pub motion: Option<[f64; 2]>,
    /// The constant load's displacement.
    pub shift: Option<f64>,
    /// Cosine and sine part of each line.
    pub lines: Vec<[f64; 2]>,
}

impl Nuisance {
    /// Clears a residual.
    pub fn clear(&self, residual: &mut [f64]) {
        self.columns.clear(residual);
    }

    /// Clears a residual and tells what was in it.
    pub fn fit(&self, residual: &mut [f64]) -> Taken {
        let raw = self.columns.fit(residual);
        Taken {
            offset: raw[0],
            motion: self
                .motion
                .filter(|_| self.sees_start)
                .map(|k| [raw[k], raw[k + 1]]),
            shift: self.shift.map(|k| raw[k]),
            lines: raw[self.lines..]
                .chunks_exact(2)
                .map(|c| [c[0], c[1]])
                .collect(),
        }
    }
}

/// Sum of products.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Eight sums side by side: one would wait for each addition.
    let mut sums = [0.0_f64; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8
        .remainder()
        .iter()
        .zip(b8.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (x, y) in a8.zip(b8) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}
