//! A model run on records, and the optimum initial states.

use std::f64::consts::PI;

use nalgebra::DMatrix;
use torqcomp_model::effects::Zero;
use torqcomp_model::fit::linear::solve;
use torqcomp_model::simulate::MotionState;
use torqcomp_model::{Chain, Mode, StandRun};

use super::fit::{MOST_STARTS, RecordResidual, START_SETTLED};
use super::own_of_records::OwnOfRecords;
use super::record::{InitialState, NuisanceTerms, StandRecord, StateSlopes};
use super::structure::Structure;
use super::unexplained::{raw_residual, raw_residuals};

/// Finite-difference step of the initial state, relative to the RMS of the record.
const STATE_STEP: f64 = 1e-4;
/// Minimum number of samples that determine a state.
const FEWEST: usize = 6;
/// Correction of an initial state, relative to the RMS residual, below which its residual, from which the correction is
/// taken off linearly, is that of the optimum.
const STATE_FOUND: f64 = 1e-3;
/// Fractions tried of a step to a better initial state.
const STEPS: [f64; 3] = [1.0, 0.3, 0.1];

/// A model run on records, each with its own initial state.
pub(super) struct RecordModel {
    pub chain: Chain,
    pub terms: NuisanceTerms,
    /// Mode of the free motion from a record's start.
    free: Mode,
    /// Rms of the training records.
    rms: f64,
}

impl RecordModel {
    pub fn of(structure: &Structure, values: &[f64], free: Mode) -> Self {
        let (chain, terms) = structure.model(values);
        Self {
            chain,
            terms,
            free,
            rms: structure.context.scales.rms,
        }
    }

    /// The raw residual of a record, and its finite-difference derivatives with respect to the initial state; `None` if
    /// the motion diverges.
    pub fn residual_and_slopes(&self, record: &StandRecord) -> Option<(Vec<f64>, StateSlopes)> {
        let step = STATE_STEP * self.rms;
        let moves = record.has_free_motion(&self.free);
        let depends = self.chain.zero() != Zero::Any;
        let motions = [[step, 0.0], [0.0, step]].into_iter().filter(|_| moves);
        let moved = motions.map(|motion| {
            let mut initial = record.initial;
            initial.correct(motion, &self.free);
            initial
        });
        let mut initial: Vec<InitialState> = std::iter::once(record.initial).chain(moved).collect();
        if depends {
            initial.push(InitialState {
                preload: record.initial.preload + step,
                ..record.initial
            });
        }
        let run = |initial: &InitialState| initial.run_of(&self.chain);
        let runs: Vec<StandRun> = initial.iter().map(run).collect();
        let mut residuals = raw_residuals(&runs, record).into_iter();
        let residual = residuals.next()?.ok()?;
        let mut slope = || {
            let moved = residuals.next()?.ok()?;
            let pairs = residual.iter().zip(&moved);
            Some(pairs.map(|(a, b)| (a - b) / step).collect::<Vec<_>>())
        };
        let motion = match moves {
            true => Some([slope()?, slope()?]),
            false => None,
        };
        let preload = match depends {
            true => Some(slope()?),
            false => None,
        };
        Some((residual, StateSlopes { motion, preload }))
    }

    /// Derivatives of a record with respect to its initial state, if the motion is integrated: far from those of the
    /// linear stand where an effect changes its frequency.
    pub fn slopes(&self, record: &StandRecord) -> Option<StateSlopes> {
        let is_integrated = self.chain.is_integrated();
        let found = is_integrated.then(|| self.residual_and_slopes(record));
        Some(found??.1)
    }

    /// The same without the constant load, if the motion from the record's start lasts.
    pub fn slopes_of_motion(&self, record: &StandRecord) -> Option<StateSlopes> {
        let lasts = record.has_free_motion(&self.free);
        let slopes = lasts.then(|| self.slopes(record)).flatten()?;
        Some(StateSlopes {
            preload: None,
            ..slopes
        })
    }

    /// The residual of a record with its present initial state; `None` if the motion diverges.
    pub fn residual(&self, record: StandRecord) -> Option<RecordResidual> {
        let (mut samples, slopes) = match self.chain.is_integrated() {
            true => {
                let (samples, slopes) = self.residual_and_slopes(&record)?;
                (samples, Some(slopes))
            }
            false => (raw_residual(&self.chain, &record).ok()?, None),
        };
        let raw = record.without_weights(samples.clone());
        let record = record.with_spikes(&self.terms, &samples);
        let nuisance = record.nuisance(&self.free, &self.terms, slopes);
        let nuisance = nuisance.fit(&mut samples);
        // For a free decay, all motion follows from the initial state.
        let left = if record.is_free() { &samples } else { &raw };
        let pairs = record.measured_in_range().iter().zip(left);
        let modelled = pairs.map(|(y, r)| y - r).collect();
        Some(RecordResidual {
            record,
            samples,
            modelled,
            nuisance,
        })
    }

    /// The residual of a record with the optimum initial state. An integrated motion depends on it nonlinearly: the
    /// search starts from the record's own state, from rest, and from the one that its beginning shows, and continues
    /// with Gauss–Newton steps while they help. `None` if the motion diverges.
    pub fn settled(&self, record: &StandRecord) -> Option<RecordResidual> {
        if !self.chain.is_integrated() {
            return self.residual(record.clone());
        }
        let from = |initial: InitialState| self.residual(record.starting_from(initial));
        let own = from(record.initial);
        let shown = match record.is_free() {
            true => self.shown_at_start(record),
            false => self.shown_at_first(record, own.as_ref()),
        };
        let others = [Some(InitialState::default()), shown].into_iter().flatten();
        let others = others.filter(|initial| *initial != record.initial);
        let others = others.filter_map(from);
        let found = own
            .into_iter()
            .chain(others)
            .min_by(|a, b| a.sum_of_squares().total_cmp(&b.sum_of_squares()));
        let mut found = found?;
        for _ in 0..MOST_STARTS {
            let sum = found.sum_of_squares();
            if found.has_its_state() {
                break;
            }
            let better = STEPS.into_iter().find_map(|part| {
                let next = self.residual(self.stepped(&found, part))?;
                (next.sum_of_squares() < sum).then_some(next)
            });
            let Some(next) = better else { break };
            found = next;
            if found.sum_of_squares() > (1.0 - START_SETTLED) * sum {
                break;
            }
        }
        Some(found)
    }

    /// Initial state estimated from the first half period of a free decay: an oscillation about any centre, on the side
    /// of the record's mean on which it lies.
    fn shown_at_start(&self, record: &StandRecord) -> Option<InitialState> {
        let measured = record.measured_in_range();
        let turn = self.turn(record);
        let count = (PI / turn).ceil() as usize;
        let row = |i| [1.0, (turn * i as f64).cos(), (turn * i as f64).sin()];
        let swing = beginning(record, count, row)?;
        let mean = measured.iter().sum::<f64>() / measured.len() as f64;
        Some(InitialState {
            motion: MotionState {
                x: swing[0] + swing[1] - mean,
                speed: self.free.omega_rad_s * swing[2],
            },
            ..record.initial
        })
    }

    /// Initial state of a driven record whose first samples follow a parabola, without the offset of a residual.
    fn shown_at_first(
        &self,
        record: &StandRecord,
        found: Option<&RecordResidual>,
    ) -> Option<InitialState> {
        let count = (0.25 * PI / self.turn(record)).ceil() as usize;
        let parabola = beginning(record, count, |i| [1.0, i as f64, (i * i) as f64])?;
        Some(InitialState {
            motion: MotionState {
                x: parabola[0] - found.map_or(0.0, |found| found.nuisance.offset),
                speed: parabola[1] * record.rate_hz(),
            },
            ..record.initial
        })
    }

    /// Angle by which the free motion turns in a sample.
    fn turn(&self, record: &StandRecord) -> f64 {
        self.free.omega_rad_s / record.rate_hz()
    }

    /// A record with part of the correction of its initial state suggested by its residual.
    fn stepped(&self, found: &RecordResidual, part: f64) -> StandRecord {
        let mut record = found.record.clone();
        let motion = found.nuisance.motion.unwrap_or_default();
        record.initial.correct(motion.map(|x| part * x), &self.free);
        let limit = OwnOfRecords::LARGEST_PRELOAD * self.rms;
        let preload = record.initial.preload + part * found.nuisance.preload.unwrap_or(0.0);
        record.initial.preload = preload.clamp(-limit, limit);
        record
    }
}

impl RecordResidual {
    /// Whether another step would not change its initial state.
    fn has_its_state(&self) -> bool {
        let [x, speed] = self.nuisance.motion.unwrap_or_default();
        let correction = x.hypot(speed).hypot(self.nuisance.preload.unwrap_or(0.0));
        let mean_square = self.sum_of_squares() / self.samples.len() as f64;
        correction <= STATE_FOUND * mean_square.sqrt()
    }
}

/// Coefficients of three functions of the number of the sample, fitted to the first samples of a record.
fn beginning(
    record: &StandRecord,
    count: usize,
    row: impl Fn(usize) -> [f64; 3],
) -> Option<Vec<f64>> {
    let count = count.max(FEWEST);
    let seen = record.measured.get(..count)?;
    let rows: Vec<[f64; 3]> = (0..count).map(row).collect();
    let matrix = DMatrix::from_row_slice(count, 3, rows.as_flattened());
    Some(solve(&matrix, seen, None, false).ok()?.values)
}
