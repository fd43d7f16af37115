//! Diagnosis: the unexplained residual of the model, the effect that causes it, and the error before and after.
//!
//! [`run`] fits the plain stand ([`plain`]), adds effects ([`search`]) while they explain enough of the training
//! records, evaluates the result on the held-out ones ([`judge`]), and summarises it in the [`Diagnosis`]
//! ([`verdict`]), which is the JSON document of `diagnose`.

mod acceptance;
mod alignment;
mod applied_noise;
mod backbone;
mod blocks;
mod coloured;
mod columns;
mod constants;
mod decide;
mod declared;
mod describe;
mod detection;
mod exchange;
mod finish;
mod fit;
mod guard_models;
mod held;
mod intersample;
mod judge;
mod known_loads;
mod ladder;
mod levels;
mod model_residuals;
mod moment;
mod moving_line;
mod noise_floor;
mod operation;
mod own_of_records;
mod pairs;
mod plain;
mod plot_series;
mod reason;
mod record;
mod record_model;
mod records;
mod refuse;
mod residual_tests;
mod result;
mod running;
mod score;
mod search;
mod several;
mod several_modes;
mod shift;
mod special_cases;
mod spectra;
mod spike_train;
mod starts;
mod stationarity;
mod structure;
mod surface;
#[cfg(test)]
mod test_noise;
mod unexplained;
mod units;
mod verdict;
mod whitening;

use torqcomp_dsp::sort_by_number;
use torqcomp_model::effects::{Fixed, RecordScales};
use torqcomp_model::simulate::{Between, substeps};

use crate::failure::{ErrorCode, Failure};
use crate::identify::Motion;
use crate::warning::Warning;
use declared::DeclaredStand;
use ladder::Ladder;
use noise_floor::NoiseFloor;
use spectra::lines_of;
use structure::FitContext;
use surface::AskedSurface;
use verdict::{noise_rms, remains};

pub use declared::DeclaredForm;
pub use detection::ShownSide;
pub use fit::RecordResidual;
pub use guard_models::GuardModel;
pub use held::HeldBody;
pub use known_loads::{CheckedLoads, KnownLoads};
pub use moment::ChangedStand;
pub use noise_floor::NoiseFloorSource;
pub use plot_series::{MotionAxis, autocorrelation, binned, density, response};
pub use reason::Status;
pub use record::{InitialState, StandRecord};
pub use records::Records;
pub use residual_tests::ResidualTests;
pub use result::{Diagnosis, SourceFiles};
pub use running::{RunningCheck, RunningRecord};
pub use score::{EffectParameter, ScoredModel};
pub use search::{CandidateFit, Workers};
pub use several_modes::SeveralModes;
pub use spectra::SpectralLine;
pub use structure::{EffectForm, PlainStand};
pub use surface::{ForceSurface, SurfacePlace, SurfacePoint};
pub use units::ChannelUnits;
pub use verdict::{AT_FLOOR, Verdict};

/// Input of a diagnosis.
pub struct Case {
    pub sources: SourceFiles,
    pub records: Records,
    /// The plain stand that the stand file declares.
    pub declared: Option<PlainStand>,
    /// All modes of a stand that has several.
    pub several: Option<SeveralModes>,
    /// The declared effects.
    pub declared_effects: Vec<DeclaredForm>,
    /// Whether the gain is part of the declaration, not of the fit.
    pub gain_is_declared: bool,
    /// Recorded quantity of the stand's motion.
    pub measures: Motion,
    /// Whether the response of the records to torques in the stand is known.
    pub sees_torques: bool,
    /// The declared recorder.
    pub recorder: Option<Fixed>,
    pub units: ChannelUnits,
    pub warnings: Vec<Warning>,
}

/// State of a diagnosis with one waveform of the input between its samples. It has no held-out records during the
/// search.
struct SearchState {
    records: Records,
    /// The stand as declared.
    declared: Option<ScoredModel>,
    /// The plain stand, fitted.
    before: ScoredModel,
    /// The plain stand with the accepted effects.
    after: ScoredModel,
    /// The same without each of its effects, once they are settled.
    without: Vec<Option<ScoredModel>>,
    /// The plain stand with each guard model, and the number of integration steps for them.
    rivals: Option<(usize, Vec<ScoredModel>)>,
    /// The candidates; one list per round of the search.
    rounds: Vec<Vec<CandidateFit>>,
    /// Intermediate models with effects.
    path: Vec<ScoredModel>,
    /// Models with an effect exchanged for one that resembles it, until those that are as good are reported.
    alike: Vec<ScoredModel>,
    /// Contribution of each effect.
    ladder: Ladder,
    /// A guard model that explains more than each candidate of the last round.
    suspected: Option<GuardModel>,
    /// A surface over the motion that explains more than the model.
    surface: Option<AskedSurface>,
    noise_floor: Option<NoiseFloor>,
    /// Tests of the residual of the plain stand.
    tests_before: ResidualTests,
    /// Tests of the residual of the final model.
    tests: ResidualTests,
    /// Whether the integration error is below the residual.
    settled: bool,
    /// Whether the held-out records confirm none of the effects found in the training records.
    is_refuted: bool,
    /// Whether the declared stand stands for the refitted one, which diverges on the hold-out records.
    refit_diverges: bool,
    /// The records with the weights with which models were compared, if there were any.
    weighted: Option<Records>,
    /// Whether a shift of the channels explains the records better than the effects.
    is_outdone: bool,
}

/// Minimum power of a reported line of the residual relative to its surroundings, and maximum number of
/// such lines.
const PROMINENT: f64 = 30.0;
const MOST_LINES: usize = 5;

/// Number of single effects with which another waveform of the input is tried.
const MOST_ALONE: usize = 8;

/// Parameter scales of training records, without the natural frequency.
fn scales(train: &[StandRecord]) -> RecordScales {
    let (mut sum, mut count, mut peak) = (0.0, 0_usize, 0.0_f64);
    for record in train {
        let y = record.measured_in_range();
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        for y in y {
            sum += (y - mean).powi(2);
            peak = peak.max((y - mean).abs());
        }
        count += y.len();
    }
    let longest = train.iter().map(StandRecord::count).max().unwrap_or(1);
    RecordScales {
        rms: (sum / count.max(1) as f64).sqrt(),
        peak,
        natural_hz: 1.0,
        duration_s: longest as f64 / train.first().map_or(1.0, StandRecord::rate_hz),
    }
}

/// Runs a diagnosis.
///
/// # Errors
/// If the records cannot be diagnosed or the plain stand cannot be fitted.
pub fn run(mut case: Case, workers: Workers) -> Result<Diagnosis, Failure> {
    let unscaled = FitContext {
        scales: scales(&case.records.train),
        plain: PlainStand {
            natural_hz: 1.0,
            damping_ratio: 0.0,
            gain: case.declared.map_or(1.0, |d| d.gain),
        },
        several: case.several.clone(),
        gain_is_free: !case.gain_is_declared,
        measures: case.measures,
        sees_torques: case.sees_torques,
        recorder: case.recorder.clone(),
        units: case.units.clone(),
        held: None,
        rings_at_start: false,
        late: None,
    };
    let mut context = plain::find_plain(&unscaled, case.declared, &case.records.train)?;
    if !case.records.are_free()
        && context.several.is_none()
        && context.measures == Motion::Displacement
        && refuse::is_short(&case, &context)
        && let Some(held) = held::hold(&case, &unscaled)?
    {
        (case, context) = held;
    }
    let alignment = refuse::check(&case, &context)?;
    context.late = alignment.as_ref().and_then(alignment::Alignment::late);
    case.records
        .prepare_for(&context, !case.declared_effects.is_empty());
    let mode = context.plain.mode();
    context.rings_at_start = case.records.train.iter().any(|r| r.sees_start(&mode));
    let declared = case.declared.map(|plain| DeclaredStand {
        plain,
        several: case.several.as_ref(),
        effects: &case.declared_effects,
    });
    let training = case.records.training();
    let training = training.with_between(intersample::from_inputs(&training.train));
    let look = |records: Records| SearchState::with(records, &context, declared, workers);
    let mut found = look(training.clone())?;
    let between = found.other_course(workers.threads);
    if let Some(between) = between {
        drop(found);
        found = look(training.with_between(between))?;
    }
    let smooth = (found.records.between() != Between::BandLimited)
        .then(|| training.with_between(Between::BandLimited));
    let alignment = alignment.or_else(|| shift::find(&case, &context, &found));
    if let Some(alignment) = &alignment
        && let Some(weighed) = shift::weigh(&found, smooth.as_ref(), alignment, workers.threads)
    {
        found.is_outdone = weighed.outdoes;
        case.warnings.push(weighed.warning);
    }
    found.judge_on(&case.records, workers.threads)?;
    Ok(Diagnosis::of(case, found, workers.threads))
}

impl SearchState {
    /// Fits the plain stand and adds effects to it.
    fn with(
        mut records: Records,
        context: &FitContext,
        declared: Option<DeclaredStand>,
        workers: Workers,
    ) -> Result<Self, Failure> {
        let mut plain = plain::refine_plain(context.clone(), declared, &records.train)?;
        plain::set_starts(&plain, &mut records.train);
        plain.initial = records.train.iter().map(|r| r.initial).collect();
        let declared =
            declared.and_then(|declared| ScoredModel::of(declared.model(&plain), &records));
        let declared = declared.map(ScoredModel::without_samples);
        let before = ScoredModel::of(plain, &records).ok_or_else(|| {
            ErrorCode::NotIdentifiable
                .failed("the plain stand cannot be simulated on the training records")
        })?;
        let tests = tests(&before);
        let mut found = Self {
            records,
            declared,
            noise_floor: NoiseFloor::of(&before.compared(), &before.fitted.passage()),
            after: before.clone(),
            before,
            without: Vec::new(),
            rivals: None,
            rounds: Vec::new(),
            path: Vec::new(),
            alike: Vec::new(),
            ladder: Ladder::default(),
            suspected: None,
            surface: None,
            tests_before: tests.clone(),
            tests,
            settled: true,
            is_refuted: false,
            refit_diverges: false,
            weighted: None,
            is_outdone: false,
        };
        let coarse = substeps(context.highest_hz(), found.records.rate_hz());
        found.weigh();
        found.build(coarse, workers);
        found.end_search(workers.threads);
        found.lower_noise_floor();
        found.ask_surface(workers.threads);
        Ok(found)
    }

    /// Re-estimates the noise without what the model explains and what is not periodic with the input.
    fn lower_noise_floor(&mut self) {
        let is_lower = |new: &NoiseFloor| {
            let old = self.noise_floor;
            old.is_some_and(|old| old.from == NoiseFloorSource::Periods && new.rms < old.rms)
        };
        let passage = self.after.fitted.passage();
        let new = NoiseFloor::of_residuals(&self.after.compared(), &passage);
        if let Some(new) = new.filter(is_lower) {
            self.noise_floor = Some(new);
        }
    }

    /// A waveform of the input between its samples that explains the residual better than the current
    /// model.
    fn other_course(&self, threads: usize) -> Option<Between> {
        let floor = self.noise_floor;
        let has_effects = !self.after.effect_names().is_empty();
        let is_noise = !has_effects && !remains(&self.before, &self.tests_before, floor);
        if is_noise || self.records.are_free() {
            return None;
        }
        let mut alone: Vec<&ScoredModel> = self
            .rounds
            .first()
            .into_iter()
            .flatten()
            .filter_map(|c| c.model.as_ref())
            .collect();
        sort_by_number(&mut alone, |model| model.criterion());
        // If nothing is left, only a waveform in place of effects could explain more.
        let is_left = remains(&self.after, &self.tests, floor);
        let count = self.after.effect_names().len();
        let on_the_way = self.path.iter().chain(self.without.iter().flatten());
        let on_the_way = on_the_way.chain(alone.into_iter().take(MOST_ALONE));
        let mut models = vec![&self.before];
        for model in on_the_way.filter(|model| is_left || model.effect_names().len() < count) {
            let structure = &model.fitted.structure;
            if !models
                .iter()
                .any(|m| m.fitted.structure.has_effects_of(structure))
            {
                models.push(model);
            }
        }
        let noise_rms = noise_rms(floor);
        intersample::better_course(&models, &self.after, noise_rms, &self.records, threads)
    }

    /// Significant lines in the residual of a model.
    fn lines_of(&self, model: &ScoredModel) -> Vec<SpectralLine> {
        let to_hz = 0.49 * self.records.rate_hz();
        let mut lines = lines_of(&model.compared(), to_hz, MOST_LINES);
        lines.retain(|line| line.prominence > PROMINENT);
        lines
    }
}

fn tests(model: &ScoredModel) -> ResidualTests {
    ResidualTests::of(&model.compared(), &model.fitted.mode())
}
