//! A flexible alternative without a given law: the missing torque of the stand as a surface over displacement and
//! speed, with memory (restoring-force surface; S. F. Masri, T. K. Caughey, J. Appl. Mech. 46 (1979), 433).
//!
//! With the linear stand `H` the record is `y = H G u − H n(x, x', z)`, with `n` a sum of functions ([`basis`]) of the
//! measured motion, so that all coefficients follow from linear least squares ([`regression`]). Corrections of the
//! stand's constants are the columns `H x` and `H x'` among them. If `n` acts on the part that carries the gage, its
//! column is `n − H n`; if the gage itself is nonlinear, `n`.

mod ask;
mod basis;
mod line;
mod motion;
mod regression;
mod report;
mod shape;

use std::sync::Arc;

use num_complex::Complex64;
use schemars::JsonSchema;
use serde::Serialize;
use statrs::statistics::Statistics;
use torqcomp_dsp::{dot, rms};
use torqcomp_model::Chain;
use torqcomp_model::effects::Stage;
use torqcomp_model::simulate::{Excitation, MotionState};

use super::blocks::compare;
use super::fit::RecordResidual;
use super::record::{NuisanceTerms, StandRecord};
use super::score::ScoredModel;
use super::stationarity::in_a_circle;
use super::structure::FitContext;
use crate::parallel::parallel;
use basis::{Grid, SurfacePart};
use line::clear_line;
use motion::{MeasuredMotion, of_torque, through};
use regression::{Regression, Solution};

pub use ask::AskedSurface;
pub use report::{ForceSurface, SurfacePoint};

/// Where the torque that a surface describes sits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SurfacePlace {
    /// In the stand, beside what the gage shows.
    Stand,
    /// In the part that the gage sits on.
    GagePath,
    /// In the gage or its amplifier, behind the motion.
    Gage,
}

const PLACES: [SurfacePlace; 3] = [
    SurfacePlace::Stand,
    SurfacePlace::GagePath,
    SurfacePlace::Gage,
];

/// Number of columns of the plain stand: input, displacement, speed.
const PLAIN: usize = 3;
/// Minimum significance of a surface's improvement over the best laws.
const LEAST_SIGNIFICANCE: f64 = 3.0;
/// Largest fraction of a model's error power that a surface leaves if it shows that the model is incomplete:
/// integration steps or an interpolated input cost a correct law less.
const SHOWN: f64 = 0.95;
/// Number of shifts of the residuals against the motion, and distance of the surface's residual below those of the
/// shifted ones, in units of their scatter.
const SHIFTS: usize = 19;
const LEAST_OVER_SHIFTED: f64 = 4.0;
/// Largest fraction of the laws' excess error power left by a surface that supersedes them.
const LEFT: f64 = 0.5;

/// A surface, fitted to the training records.
pub struct Surface {
    pub place: SurfacePlace,
    grid: Grid,
    solution: Solution,
    /// Cross-validated residual of each training sample.
    unseen: Vec<f64>,
    /// The same with the columns of the plain stand alone: along a measured motion, these absorb some of its
    /// disturbances.
    unseen_by_plain: Vec<f64>,
    /// Increase of the residual without each part, relative to the sum of all four.
    shares: [f64; SurfacePart::ALL.len()],
}

/// Source of the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MotionSource {
    /// The record, for terms that pass through the stand. Terms that do not would include the noise of the record
    /// itself; for them it is the model.
    Record,
    Model,
}

/// A model without the laws that a surface replaces.
struct Background<'a> {
    model: &'a ScoredModel,
    linear: Chain,
    terms: NuisanceTerms,
    place: SurfacePlace,
    source: MotionSource,
}

impl Surface {
    /// The surface that best explains the training records in place of the laws of a model; `None` if none can be
    /// fitted.
    pub fn fit(model: &ScoredModel) -> Option<Self> {
        // One after the other: the columns of each are most of the memory of a diagnosis.
        let fits = PLACES.map(|place| Self::at(place, model));
        let sum = |surface: &Self| dot(&surface.unseen, &surface.unseen);
        let fits = fits.into_iter().flatten();
        fits.min_by(|a, b| sum(a).total_cmp(&sum(b)))
    }

    fn at(place: SurfacePlace, model: &ScoredModel) -> Option<Self> {
        let (grid, regression) = regression(MotionSource::Record, place, model)?;
        let (solution, unseen) = regression.solve()?;
        let parts = Grid::parts();
        let whole = regression.left_with(&solution, |_| true)?;
        let mut shares = [0.0; SurfacePart::ALL.len()];
        for (share, part) in shares.iter_mut().zip(SurfacePart::ALL) {
            let others = |k: usize| k < PLAIN || parts[k - PLAIN] != part;
            *share = (regression.left_with(&solution, others)? - whole).max(0.0);
        }
        let sum = shares.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        Some(Self {
            place,
            grid,
            solution,
            unseen,
            unseen_by_plain: regression.unseen_by_free_columns()?,
            shares: shares.map(|share| share / sum),
        })
    }

    /// Cross-validated RMS residual of the training samples.
    pub fn unseen_rms(&self) -> f64 {
        rms(&self.unseen)
    }

    /// Whether its cross-validated residual on the training records is significantly smaller than that of a model.
    pub fn improves_on(&self, model: &ScoredModel) -> bool {
        [&seen(&model.train()), &self.unseen_by_plain]
            .iter()
            .all(|before| compare(before, &self.unseen).significance() >= LEAST_SIGNIFICANCE)
    }

    /// Whether the cross-validated residual of a surface shows that a model is incomplete on the training records.
    ///
    /// It uses the motion of the model, which excludes the stand's response to noise. Its residual must be far smaller
    /// than with the same residuals shifted against the motion, as a lightly damped oscillation can be predicted from
    /// its neighbourhood.
    pub fn shows_lack(&self, model: &ScoredModel, threads: usize) -> bool {
        let along_model = regression(MotionSource::Model, self.place, model);
        let Some((_, regression)) = along_model else {
            return false;
        };
        let left = |regression: &Regression| Some(regression.solve()?.1);
        let Some((unseen, plain)) = left(&regression).zip(regression.unseen_by_free_columns())
        else {
            return false;
        };
        let is_shown = [&seen(&model.train()), &plain]
            .iter()
            .all(|before| shows(before, &unseen));
        is_shown && {
            let shifted = parallel(SHIFTS, threads, |k| {
                let part = (k + 1) as f64 / (SHIFTS + 1) as f64;
                left(&regression.of_others(shifted(&regression, model, part)))
            });
            let sum = |left: Vec<f64>| dot(&left, &left);
            let shifted: Vec<f64> = shifted.into_iter().flatten().map(sum).collect();
            let (mean, std) = (shifted.iter().mean(), shifted.iter().std_dev());
            mean - sum(unseen) > LEAST_OVER_SHIFTED * std
        }
    }

    /// Whether it explains so much more than a model that none of the model's laws is to be named: not where a law
    /// leaves little but noise.
    pub fn outdoes(&self, model: &ScoredModel, noise_rms: f64) -> bool {
        let excess = |rms: f64| rms.powi(2) - noise_rms.powi(2);
        let left = excess(rms(&seen(&model.train())));
        let is_much = left >= noise_rms.powi(2);
        let least = left.min(excess(rms(&self.unseen_by_plain)));
        is_much && self.improves_on(model) && excess(self.unseen_rms()) <= LEFT * least
    }

    /// Its residual on the records used for comparison, along the motion measured there.
    pub fn left_of_compared(&self, model: &ScoredModel) -> Option<Vec<f64>> {
        let background = Background::of(model, self.place, MotionSource::Record);
        let compared = model.compared();
        let left = compared.iter().map(|residual| {
            let record = cut(&residual.record);
            let motion = background.motion(&record)?;
            let (columns, mut left) = background.columns(&record, &motion, &self.grid);
            self.solution.subtract(&columns, 0..left.len(), &mut left);
            Some(left)
        });
        Some(left.collect::<Option<Vec<_>>>()?.concat())
    }
}

/// The columns of a surface, and the training records as their target.
fn regression(
    source: MotionSource,
    place: SurfacePlace,
    model: &ScoredModel,
) -> Option<(Grid, Regression)> {
    let background = Background::of(model, place, source);
    let train = model.train();
    let records = train.iter().map(|residual| cut(&residual.record));
    let records: Vec<StandRecord> = records.collect();
    let motions = records.iter().map(|record| background.motion(record));
    let motions: Vec<MeasuredMotion> = motions.collect::<Option<_>>()?;
    let grid = Grid::of(&motions);
    let both = records.iter().zip(&motions);
    let columns = both.map(|(record, motion)| background.columns(record, motion, &grid));
    let regression = Regression::of(columns.collect(), PLAIN, model.train_rms().powi(2));
    Some((grid, regression))
}

/// Training records with the residuals of a model shifted circularly by a fraction of their length.
fn shifted(regression: &Regression, model: &ScoredModel, part: f64) -> Vec<Vec<f64>> {
    let train = model.train();
    let both = regression.targets().iter().zip(train.iter());
    let with_shifted = |(target, residual): (&Vec<f64>, &RecordResidual)| {
        let left = &residual.samples[..target.len()];
        let others = in_a_circle(left, (part * left.len() as f64) as usize);
        let samples = target.iter().zip(left).zip(others);
        samples.map(|((y, r), other)| y - r + other).collect()
    };
    both.map(with_shifted).collect()
}

/// Whether the residual of a surface is so much smaller that the model is incomplete.
fn shows(before: &[f64], left: &[f64]) -> bool {
    let compared = compare(before, left);
    let [power, left] = compared.sums();
    left <= SHOWN * power && compared.significance() >= LEAST_SIGNIFICANCE
}

/// Maximum number of samples of a record used for a surface: more would take memory and add little.
const MOST_SAMPLES: usize = 1 << 17;

/// The part of the residuals of a model used for a surface.
pub fn seen(residuals: &[RecordResidual]) -> Vec<f64> {
    let first = |r: &RecordResidual| r.samples[..r.samples.len().min(MOST_SAMPLES)].to_vec();
    residuals.iter().flat_map(first).collect()
}

/// The beginning of a record, as used for a surface.
fn cut(record: &StandRecord) -> StandRecord {
    let end = record.range.end.min(record.range.start + MOST_SAMPLES);
    if end == record.range.end {
        return record.clone();
    }
    let input = &record.input;
    let samples = input.samples()[..end].to_vec();
    let short = Excitation::new(samples, input.rate_hz(), input.start_s(), input.substeps());
    StandRecord {
        input: Arc::new(short.with_between(input.between())),
        measured: Arc::new(record.measured[..end].to_vec()),
        range: record.range.start..end,
        ..record.clone()
    }
}

/// Whether an effect is a law of the motion, which a surface replaces.
pub fn is_law(stage: Stage) -> bool {
    matches!(stage, Stage::Stand | Stage::Gage | Stage::Limit)
}

impl<'a> Background<'a> {
    fn of(model: &'a ScoredModel, place: SurfacePlace, source: MotionSource) -> Self {
        let (linear, terms) = reduced(model, |stage| !is_law(stage));
        Self {
            model,
            linear,
            terms,
            place,
            source,
        }
    }

    /// The motion along a record.
    fn motion(&self, record: &StandRecord) -> Option<MeasuredMotion> {
        let is_corrected = self.source == MotionSource::Record && self.place == SurfacePlace::Stand;
        MeasuredMotion::along(self.model, record, is_corrected)
    }

    /// The columns of a record, and the record, both without its nuisance terms.
    fn columns(
        &self,
        record: &StandRecord,
        motion: &MeasuredMotion,
        grid: &Grid,
    ) -> (Vec<Vec<f64>>, Vec<f64>) {
        let nuisance = record.nuisance(&self.linear.free_mode(), &self.terms, None);
        let cleared = |whole: &[f64]| {
            let mut part = whole[record.range.clone()].to_vec();
            nuisance.clear(&mut part);
            part
        };
        let torque = of_torque(&self.linear);
        let input = self.linear.simulate(&record.input, MotionState::default());
        let mut columns = vec![cleared(&input)];
        for linear in [&motion.x, &motion.speed] {
            columns.push(cleared(&through(record, linear, |omega| -torque(omega))));
        }
        let step = self.model.fitted.mode().omega_rad_s / record.rate_hz();
        columns.extend(grid.functions(motion, step).map(|mut samples| {
            if self.place != SurfacePlace::Stand {
                // A straight line would be the record itself.
                clear_line(&mut samples, &motion.x, |_| 1.0);
            }
            cleared(&through(record, &samples, |omega| match self.place {
                SurfacePlace::Stand => -torque(omega),
                SurfacePlace::GagePath => Complex64::ONE - torque(omega),
                SurfacePlace::Gage => Complex64::ONE,
            }))
        }));
        (columns, cleared(&record.measured))
    }
}

/// A model with the effects of some stages only, with the recorder if the chain is among them.
fn reduced(model: &ScoredModel, keeps: impl Fn(Stage) -> bool) -> (Chain, NuisanceTerms) {
    let structure = &model.fitted.structure;
    let is_kept = |k: usize| keeps(structure.effects[k].form.stage);
    let (mut reduced, values) = structure.reduced(&model.fitted.values, is_kept);
    let recorder = structure.context.recorder.clone();
    reduced.context = Arc::new(FitContext {
        recorder: recorder.filter(|_| keeps(Stage::Chain)),
        ..(*structure.context).clone()
    });
    reduced.model(&values)
}
