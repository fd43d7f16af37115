//! A record of the applied and the measured quantity, ready for comparison with models.

use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::Arc;

use torqcomp_model::simulate::{Excitation, MotionState};
use torqcomp_model::{Chain, Mode, StandRun};

use super::columns::Columns;
use super::records::EXCLUDED;

/// State of the stand at the first sample of a record.
#[derive(Debug, Clone, Copy, Default)]
pub struct InitialState {
    pub motion: MotionState,
    /// Displacement by a constant load that is not in the input.
    pub preload: f64,
}

impl InitialState {
    /// A stand on its way from there.
    pub fn run_of(self, chain: &Chain) -> StandRun<'_> {
        StandRun {
            chain,
            start: self.motion,
            shift: self.preload,
        }
    }
}

/// One record, or the part of it that is fitted or held out.
#[derive(Clone)]
pub struct StandRecord {
    /// File it comes from.
    pub source: String,
    /// The applied quantity.
    pub input: Arc<Excitation>,
    /// The measured quantity, of the same length.
    pub measured: Arc<Vec<f64>>,
    /// The samples that count.
    pub range: Range<usize>,
    pub initial: InitialState,
    /// Whether the applied quantity contains the measured one, by a spring that holds a free body.
    pub is_held: bool,
}

/// What a model adds to a record whose phase or size belongs to the record, not to the stand.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NuisanceTerms {
    /// Frequencies of lines, such as mains pickup.
    pub lines_hz: Vec<f64>,
    /// Half waves of a slow drift.
    pub drift_half_waves: usize,
    /// Rates at which a state from before the record decays, per s.
    pub decays_per_s: Vec<f64>,
    /// Modes of the stand beside the plain stand's, which swing freely from the record's start.
    pub modes: Vec<Mode>,
}

impl NuisanceTerms {
    pub const NONE: Self = Self {
        lines_hz: Vec::new(),
        drift_half_waves: 0,
        decays_per_s: Vec::new(),
        modes: Vec::new(),
    };

    /// Those that stay as they are while parameters move.
    pub fn lasting(self) -> Self {
        Self {
            drift_half_waves: self.drift_half_waves,
            modes: self.modes,
            ..Self::NONE
        }
    }

    /// Whether something is added that the applied quantity does not cause.
    pub fn disturb(&self) -> bool {
        !self.lines_hz.is_empty() || self.drift_half_waves > 0
    }
}

/// Change of a record, over its range, with its own initial state.
pub struct StateSlopes {
    /// With the displacement, and with the speed over `ω₀`, at the first sample; none if the motion from there is gone.
    pub motion: Option<[Vec<f64>; 2]>,
    /// With the displacement by a constant load, where that is more than a constant.
    pub preload: Option<Vec<f64>>,
}

/// What belongs to a record and not to the stand: it is removed from the record's residual by least squares.
#[derive(Clone, Default)]
pub struct Nuisance {
    columns: Columns,
    /// Index of the first of the two columns of the free motion.
    motion: Option<usize>,
    /// Whether enough of the free motion is left in the range to determine the motion at the first sample.
    sees_start: bool,
    /// Index of the column of a constant load.
    preload: Option<usize>,
    /// Index of the first of the two columns of each further mode that swings freely, with its `ω₀`.
    modes: Vec<(usize, f64)>,
    /// Index of the first column of the lines.
    lines: usize,
}

/// Fewest samples of a record's beginning: modes and what belongs to the record must not fit all of it.
const SHORTEST: usize = 200;
/// Time constants after which the free motion from a record's start is gone.
pub const DECAYED: f64 = 12.0;
/// Time constants up to which the range determines that motion: beyond, noise would be amplified by more than `e³` on its
/// way back to the start.
const START_SEEN: f64 = 3.0;

impl StandRecord {
    /// Samples of the range.
    pub fn count(&self) -> usize {
        self.range.len()
    }

    pub fn rate_hz(&self) -> f64 {
        self.input.rate_hz()
    }

    /// Whether nothing acts: the stand rings freely.
    pub fn is_free(&self) -> bool {
        self.input.samples().iter().all(|u| *u == 0.0)
    }

    /// The applied quantity over the range.
    pub fn applied_in_range(&self) -> &[f64] {
        &self.input.samples()[self.range.clone()]
    }

    /// What acts over the range, without a spring that holds a free body.
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

    /// A stand on its way through the record.
    pub fn run_of<'a>(&self, chain: &'a Chain) -> StandRun<'a> {
        self.initial.run_of(chain)
    }

    pub fn starting_from(&self, initial: InitialState) -> Self {
        Self {
            initial,
            ..self.clone()
        }
    }

    /// A part of a record as a record of its own.
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

    /// The beginning of what counts, as a record of its own with the samples that its end needs.
    pub fn beginning(&self, part: f64) -> Self {
        let count = ((part * self.count() as f64) as usize).max(SHORTEST);
        let end = self.range.start + count.min(self.count());
        let whole = (end + EXCLUDED).min(self.measured.len());
        Self {
            range: self.range.start..end,
            ..self.part(0..whole)
        }
    }

    /// Whether free motion of a mode from before the range is left in it.
    pub fn has_free_motion(&self, mode: &Mode) -> bool {
        self.decay_to_range(mode) < DECAYED
    }

    /// Whether enough of that motion is left to determine the state at the first sample.
    pub fn sees_start(&self, mode: &Mode) -> bool {
        self.decay_to_range(mode) < START_SEEN
    }

    /// Time constants of a mode from the first sample to the range.
    fn decay_to_range(&self, mode: &Mode) -> f64 {
        mode.damping_ratio * mode.omega_rad_s / self.rate_hz() * self.range.start as f64
    }

    /// The motion of a mode over the range from a unit displacement at the first sample, and from a unit speed over `ω₀`.
    fn free_motion(&self, mode: &Mode) -> [Vec<f64>; 2] {
        let free = Chain::new(*mode, 1.0).free_motion(self.rate_hz(), self.range.end);
        free.map(|column| column[self.range.clone()].to_vec())
    }

    /// What belongs to this record: a constant, the free motion of the plain stand after the record's start, and the
    /// given terms. `slopes` replace that motion where the stand's effects change it.
    pub fn nuisance(
        &self,
        mode: &Mode,
        terms: &NuisanceTerms,
        slopes: Option<StateSlopes>,
    ) -> Nuisance {
        let mut nuisance = Nuisance::default();
        let columns = &mut nuisance.columns;
        columns.push(vec![1.0; self.count()]);
        if self.has_free_motion(mode) {
            nuisance.motion = Some(1);
            nuisance.sees_start = self.sees_start(mode);
            let slopes = slopes.as_ref().and_then(|slopes| slopes.motion.clone());
            for column in slopes.unwrap_or_else(|| self.free_motion(mode)) {
                columns.push(column);
            }
        }
        if let Some(column) = slopes.and_then(|slopes| slopes.preload) {
            nuisance.preload = Some(columns.count());
            columns.push(column);
        }
        self.with_lasting_terms(&mut nuisance, terms);
        self.with_moved_terms(nuisance, terms)
    }

    /// What belongs to this record beside its motion: a constant and the given terms.
    pub fn nuisance_beside_motion(&self, terms: &NuisanceTerms) -> Nuisance {
        let mut nuisance = Nuisance::default();
        nuisance.columns.push(vec![1.0; self.count()]);
        self.with_lasting_terms(&mut nuisance, terms);
        self.with_moved_terms(nuisance, terms)
    }

    /// The terms that stay as they are while parameters move.
    fn with_lasting_terms(&self, nuisance: &mut Nuisance, terms: &NuisanceTerms) {
        let columns = &mut nuisance.columns;
        let count = self.count();
        for wave in 1..=terms.drift_half_waves {
            let turn = PI * wave as f64 / count as f64;
            let cosine = |i| (turn * (i as f64 + 0.5)).cos();
            columns.push((0..count).map(cosine).collect());
        }
        for mode in terms.modes.iter().filter(|m| self.has_free_motion(m)) {
            nuisance.modes.push((columns.count(), mode.omega_rad_s));
            for column in self.free_motion(mode) {
                columns.push(column);
            }
        }
        nuisance.lines = columns.count();
    }

    /// What belongs to this record, and the terms that parameters move.
    pub fn with_moved_terms(&self, mut nuisance: Nuisance, terms: &NuisanceTerms) -> Nuisance {
        let columns = &mut nuisance.columns;
        let (rate_hz, count) = (self.rate_hz(), self.count());
        for rate_per_s in &terms.decays_per_s {
            let step = rate_per_s / rate_hz;
            columns.push((0..count).map(|i| (-step * i as f64).exp()).collect());
        }
        nuisance.lines = columns.count();
        for frequency_hz in &terms.lines_hz {
            let turn = TAU * frequency_hz / rate_hz;
            let wave =
                |part: fn(f64) -> f64| self.range.clone().map(|i| part(turn * i as f64)).collect();
            columns.push(wave(f64::cos));
            columns.push(wave(f64::sin));
        }
        nuisance
    }
}

/// Coefficients of the nuisance terms in a residual.
#[derive(Debug, Clone, Default)]
pub struct NuisanceFit {
    pub offset: f64,
    /// Displacement, and speed over `ω₀`, at the start of the record, where the range determines them.
    pub motion: Option<[f64; 2]>,
    /// Displacement and speed there of further modes.
    pub of_modes: MotionState,
    /// Displacement by the constant load.
    pub preload: Option<f64>,
    /// Cosine and sine part of each line.
    pub lines: Vec<[f64; 2]>,
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
        }
    }
}
