//! A record of the applied and the measured quantity, ready for comparison with models.

use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::Arc;

use torqcomp_fourier::phasors;
use torqcomp_model::effects::{SpikeMoments, SpikeSearch, SpikeShape};
use torqcomp_model::simulate::{Excitation, MotionState};
use torqcomp_model::{Chain, Mode, StandRun};

use super::columns::Columns;
use super::whitening::Whitening;

/// State of the stand at the first sample of a record, and of its drive.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct InitialState {
    pub motion: MotionState,
    /// Displacement under a constant load that is not in the input.
    pub preload: f64,
    /// Moments of the spikes of the model's train, in samples from the first; `None` if the record shows no train.
    pub spikes: Option<SpikeMoments>,
}

impl InitialState {
    /// A stand starting from this state.
    pub fn run_of(self, chain: &Chain) -> StandRun<'_> {
        StandRun {
            chain,
            start: self.motion,
            shift: self.preload,
        }
    }
}

/// A record, or the part of it that is fitted or held out.
#[derive(Clone)]
pub struct StandRecord {
    /// Source file.
    pub source: String,
    /// The applied quantity.
    pub input: Arc<Excitation>,
    /// The measured quantity, of the same length.
    pub measured: Arc<Vec<f64>>,
    /// The samples that are compared.
    pub range: Range<usize>,
    pub initial: InitialState,
    /// Whether the applied quantity includes the measured one through a spring that ties a free
    /// body.
    pub is_held: bool,
    /// The filter of its residual, if noise on the applied quantity is weighted.
    pub whitening: Option<Whitening>,
}

/// Terms of a model whose phase or magnitude belongs to the record rather than the stand.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NuisanceTerms {
    /// Frequencies of lines, such as mains pickup.
    pub lines_hz: Vec<f64>,
    /// Rate of a train of spikes.
    pub spikes_hz: Option<f64>,
    /// Half waves of a slow drift.
    pub drift_half_waves: usize,
    /// Rates at which a state from before the record decays, per s.
    pub decays_per_s: Vec<f64>,
    /// Modes that effects add, in which a state from before the record rings.
    pub ringing: Vec<Mode>,
    /// Modes of the stand other than the plain stand's, with free motion from the record's start.
    pub modes: Vec<Mode>,
}

impl NuisanceTerms {
    pub const NONE: Self = Self {
        lines_hz: Vec::new(),
        spikes_hz: None,
        drift_half_waves: 0,
        decays_per_s: Vec::new(),
        ringing: Vec::new(),
        modes: Vec::new(),
    };

    /// The terms that do not depend on the fit parameters.
    pub fn lasting(self) -> Self {
        Self {
            spikes_hz: self.spikes_hz,
            drift_half_waves: self.drift_half_waves,
            modes: self.modes,
            ..Self::NONE
        }
    }
}

/// Derivatives of a record, over its range, with respect to its initial state.
#[derive(Default)]
pub struct StateSlopes {
    /// With respect to displacement, and to speed over `ω₀`, at the first sample; `None` if the free motion has
    /// decayed.
    pub motion: Option<[Vec<f64>; 2]>,
    /// With respect to the displacement under a constant load, if that is more than an offset.
    pub preload: Option<Vec<f64>>,
}

/// Nuisance terms of a record, removed from its residual by least squares.
#[derive(Clone, Default)]
pub struct Nuisance {
    columns: Columns,
    /// Index of the first of the two columns of the free motion.
    motion: Option<usize>,
    /// Whether enough of the free motion remains in the range to determine the initial state.
    sees_start: bool,
    /// Index of the column of a constant load.
    preload: Option<usize>,
    /// Index of the first of the two columns of each further free mode, with its `ω₀`.
    modes: Vec<(usize, f64)>,
    /// Indices of the columns of a train of spikes.
    spikes: Range<usize>,
    /// The moments of those spikes.
    spike_moments: Option<SpikeMoments>,
    /// Index of the first column of the lines.
    lines: usize,
}

/// Time constants after which the free motion from a record's start has decayed.
pub const DECAYED: f64 = 12.0;
/// Time constants up to which the range determines the initial state: beyond, extrapolation to the start would amplify
/// noise by more than `e³`.
const START_SEEN: f64 = 3.0;

impl StandRecord {
    /// Number of samples in the range.
    pub fn count(&self) -> usize {
        self.range.len()
    }

    pub fn rate_hz(&self) -> f64 {
        self.input.rate_hz()
    }

    /// Whether the applied quantity is zero: a free decay.
    pub fn is_free(&self) -> bool {
        self.input.samples().iter().all(|u| *u == 0.0)
    }

    /// The applied quantity over the range.
    pub fn applied_in_range(&self) -> &[f64] {
        &self.input.samples()[self.range.clone()]
    }

    /// The applied quantity over the range, without the spring that ties a free body.
    pub fn acting_in_range(&self) -> Vec<f64> {
        let applied = self.applied_in_range();
        if !self.is_held {
            return applied.to_vec();
        }
        let both = applied.iter().zip(self.measured_in_range());
        both.map(|(whole, spring)| whole - spring).collect()
    }

    /// The measured quantity over the range.
    pub fn measured_in_range(&self) -> &[f64] {
        &self.measured[self.range.clone()]
    }

    /// A stand run over the record.
    pub fn run_of<'a>(&self, chain: &'a Chain) -> StandRun<'a> {
        self.initial.run_of(chain)
    }

    pub fn starting_from(&self, initial: InitialState) -> Self {
        Self {
            initial,
            ..self.clone()
        }
    }

    /// Part of a record as a separate record.
    pub fn part(&self, samples: Range<usize>) -> Self {
        let input = &self.input;
        let applied = input.samples()[samples.clone()].to_vec();
        let (rate_hz, start_s) = (input.rate_hz(), input.start_s());
        let input = Excitation::new(applied, rate_hz, start_s, input.substeps())
            .with_between(input.between());
        Self {
            input: Arc::new(input),
            range: 0..samples.len(),
            initial: match samples.start {
                0 => self.initial,
                _ => InitialState::default(),
            },
            measured: Arc::new(self.measured[samples].to_vec()),
            ..self.clone()
        }
    }

    /// Whether free motion of a mode from before the range remains in it.
    pub fn has_free_motion(&self, mode: &Mode) -> bool {
        self.decay_to_range(mode) < DECAYED
    }

    /// Whether enough of that motion remains to determine the initial state.
    pub fn sees_start(&self, mode: &Mode) -> bool {
        self.decay_to_range(mode) < START_SEEN
    }

    /// Time from the first sample to the range, in time constants of a mode.
    fn decay_to_range(&self, mode: &Mode) -> f64 {
        mode.damping_ratio * mode.omega_rad_s / self.rate_hz() * self.range.start as f64
    }

    /// A residual, or a part of it, weighted for the noise on the applied quantity.
    pub fn weighted(&self, mut samples: Vec<f64>) -> Vec<f64> {
        if let Some(whitening) = &self.whitening {
            whitening.apply(&mut samples);
        }
        samples
    }

    /// The record with the moments of the spikes that its weighted residual shows.
    pub fn with_spikes(mut self, terms: &NuisanceTerms, residual: &[f64]) -> Self {
        self.initial.spikes = terms.spikes_hz.and_then(|spikes_hz| {
            let period = self.rate_hz() / spikes_hz;
            let residual = self.without_weights(residual.to_vec());
            let found = SpikeSearch::of(&residual, period).found(period)?;
            let first = self.range.start as f64;
            (found.share() > 0.0).then_some(SpikeMoments {
                moment: first + found.moments.moment,
                ..found.moments
            })
        });
        self
    }

    /// The moments of the spikes of a train at that rate, in samples from the first.
    pub fn spike_moments(&self, spikes_hz: f64) -> Option<SpikeMoments> {
        let period = self.rate_hz() / spikes_hz;
        let of = |own| SpikeMoments { period, ..own };
        self.initial.spikes.map(of)
    }

    /// A weighted residual without its weights.
    pub fn without_weights(&self, mut samples: Vec<f64>) -> Vec<f64> {
        if let Some(whitening) = &self.whitening {
            whitening.undo(&mut samples);
        }
        samples
    }

    /// Motion of a mode over the range from a unit initial displacement, and from a unit initial speed over `ω₀`.
    fn free_motion(&self, mode: &Mode) -> [Vec<f64>; 2] {
        let free = Chain::new(*mode, 1.0).free_motion(self.rate_hz(), self.range.end);
        free.map(|column| self.weighted(column[self.range.clone()].to_vec()))
    }

    /// Nuisance terms of this record: a constant, the free motion of the plain stand after the record's start, and
    /// the given terms. `slopes` replace that motion where the stand's effects change it.
    pub fn nuisance(
        &self,
        mode: &Mode,
        terms: &NuisanceTerms,
        slopes: Option<StateSlopes>,
    ) -> Nuisance {
        let StateSlopes { motion, preload } = slopes.unwrap_or_default();
        let mut nuisance = Nuisance::default();
        let columns = &mut nuisance.columns;
        columns.push(self.weighted(vec![1.0; self.count()]));
        if self.has_free_motion(mode) {
            nuisance.motion = Some(1);
            nuisance.sees_start = self.sees_start(mode);
            for column in motion.unwrap_or_else(|| self.free_motion(mode)) {
                columns.push(column);
            }
        }
        if let Some(column) = preload {
            nuisance.preload = Some(columns.count());
            columns.push(column);
        }
        self.with_lasting_terms(&mut nuisance, terms);
        self.with_moved_terms(nuisance, terms)
    }

    /// Nuisance terms of this record except the motion: a constant and the given terms.
    pub fn nuisance_beside_motion(&self, terms: &NuisanceTerms) -> Nuisance {
        let mut nuisance = Nuisance::default();
        nuisance
            .columns
            .push(self.weighted(vec![1.0; self.count()]));
        self.with_lasting_terms(&mut nuisance, terms);
        self.with_moved_terms(nuisance, terms)
    }

    /// Adds the terms that do not depend on the fit parameters.
    fn with_lasting_terms(&self, nuisance: &mut Nuisance, terms: &NuisanceTerms) {
        let columns = &mut nuisance.columns;
        let count = self.count();
        for wave in 1..=terms.drift_half_waves {
            let turn = PI * wave as f64 / count as f64;
            let cosine = |i| (turn * (i as f64 + 0.5)).cos();
            columns.push(self.weighted((0..count).map(cosine).collect()));
        }
        for mode in terms.modes.iter().filter(|m| self.has_free_motion(m)) {
            if self.sees_start(mode) {
                nuisance.modes.push((columns.count(), mode.omega_rad_s));
            }
            for column in self.free_motion(mode) {
                columns.push(column);
            }
        }
        let first = columns.count();
        let moments = terms.spikes_hz.and_then(|hz| self.spike_moments(hz));
        for column in moments.iter().flat_map(|m| m.columns(self.range.clone())) {
            columns.push(self.weighted(column));
        }
        nuisance.spikes = first..columns.count();
        nuisance.spike_moments = moments;
        nuisance.lines = columns.count();
    }

    /// Adds the terms that depend on the fit parameters.
    pub fn with_moved_terms(&self, mut nuisance: Nuisance, terms: &NuisanceTerms) -> Nuisance {
        let columns = &mut nuisance.columns;
        let (rate_hz, count) = (self.rate_hz(), self.count());
        for rate_per_s in &terms.decays_per_s {
            let step = rate_per_s / rate_hz;
            let decay = (0..count).map(|i| (-step * i as f64).exp());
            columns.push(self.weighted(decay.collect()));
        }
        // A free decay shows no response to which a mode could be added, only its own modes.
        let ringing = terms.ringing.iter().filter(|_| !self.is_free());
        for mode in ringing.filter(|m| self.has_free_motion(m)) {
            for column in self.free_motion(mode) {
                columns.push(column);
            }
        }
        nuisance.lines = columns.count();
        for frequency_hz in &terms.lines_hz {
            let turning = phasors(TAU * frequency_hz / rate_hz, self.range.start);
            let (cosine, sine) = turning.take(count).map(|z| (z.re, z.im)).unzip();
            columns.push(self.weighted(cosine));
            columns.push(self.weighted(sine));
        }
        nuisance
    }
}

/// Coefficients of the nuisance terms in a residual.
#[derive(Debug, Clone, Default)]
pub struct NuisanceFit {
    pub offset: f64,
    /// Initial displacement, and speed over `ω₀`, of the record, where the range determines them.
    pub motion: Option<[f64; 2]>,
    /// Initial displacement and speed of further modes.
    pub of_modes: MotionState,
    /// Displacement under the constant load.
    pub preload: Option<f64>,
    /// Cosine and sine part of each line.
    pub lines: Vec<[f64; 2]>,
    pub spikes: SpikeShape,
}

impl Nuisance {
    /// Removes the nuisance terms from a residual.
    pub fn clear(&self, residual: &mut [f64]) {
        self.columns.clear(residual);
    }

    /// Removes the nuisance terms from a residual and returns their coefficients.
    pub fn fit(&self, residual: &mut [f64]) -> NuisanceFit {
        let raw = self.columns.fit(residual);
        let motion = self.motion.filter(|_| self.sees_start);
        NuisanceFit {
            offset: raw[0],
            motion: motion.map(|k| [raw[k], raw[k + 1]]),
            of_modes: self
                .modes
                .iter()
                .fold(MotionState::default(), |sum, (k, omega)| MotionState {
                    x: sum.x + raw[*k],
                    speed: sum.speed + omega * raw[k + 1],
                }),
            preload: self.preload.map(|k| raw[k]),
            lines: raw[self.lines..]
                .chunks_exact(2)
                .map(|c| [c[0], c[1]])
                .collect(),
            spikes: self
                .spike_moments
                .map_or_else(SpikeShape::default, |moments| {
                    SpikeShape::of(moments, &raw[self.spikes.clone()])
                }),
        }
    }
}
