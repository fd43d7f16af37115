//! The result of a diagnosis: its JSON document, the basis of text and HTML reports.

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::sort_by_number;

use super::constants::{StandConstant, constants};
use super::describe;
use super::detection::{DetectionLimit, detection_limits};
use super::fit::RecordResidual;
use super::guard_models::GuardModel;
use super::held::{HeldBody, rms};
use super::known_loads::LoadCheck;
use super::ladder::Ladder;
use super::moment::ChangedStand;
use super::noise_floor::NoiseFloorSource;
use super::reason::Status;
use super::record::StandRecord;
use super::residual_tests::ResidualTests;
use super::running::RunningCheck;
use super::score::{RmsErrors, ScoredModel};
use super::search::CandidateFit;
use super::spectra::SpectralLine;
use super::structure::FitContext;
use super::surface::ForceSurface;
use super::verdict::Verdict;
use super::{Case, SearchState};
use crate::warning::Warning;

/// Files of a diagnosis.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SourceFiles {
    /// Path of the stand file; `null` if a plain stand was fitted.
    pub stand: Option<String>,
    /// Paths of the training records.
    pub train: Vec<String>,
    /// Paths of the hold-out records; empty if parts of the training records are held out.
    pub holdout: Vec<String>,
}

/// What a stand model lacks: candidate effects, the effects added, and the errors before and after.
#[derive(Serialize, JsonSchema)]
pub struct Diagnosis {
    #[serde(flatten)]
    pub sources: SourceFiles,
    /// Whether effects explain what the plain stand leaves.
    pub verdict: Verdict,
    /// Names of the effects that were added.
    pub effects: Vec<&'static str>,
    /// Names of the effects declared in the stand file; they are refitted in all models except the declared one.
    pub declared_effects: Vec<&'static str>,
    /// `band-limited`, `straight-lines` or `held`.
    pub input_between_samples: &'static str,
    /// Errors of the models, over the same samples.
    pub error: ErrorTable,
    /// The held-out error with ever more effects, and what each of them explains.
    #[serde(flatten)]
    pub explained: Ladder,
    /// Constants of the plain stand.
    pub constants: Vec<StandConstant>,
    /// Known loads applied slowly, and the stand's response to them; `null` without any.
    pub known_loads: Option<LoadCheck>,
    /// What running records show of the stand in use.
    pub running: Vec<RunningCheck>,
    /// The effects that were tried: accepted ones first, then by hold-out error.
    pub candidates: Vec<CandidateFit>,
    /// For `nothing-missing`: the smallest amount of each effect detectable in the training records.
    pub detection_limits: Vec<DetectionLimit>,
    /// A law outside the list of effects with a smaller residual than any of them; named, not added. `null` if there is
    /// none.
    pub suspected: Option<GuardModel>,
    /// For `partly-explained` and `unexplained`: the torque as a function of the motion, without an assumed law,
    /// including that of accepted laws. `null` where there is none, or it does not depend on the motion.
    pub force_surface: Option<ForceSurface>,
    /// For `partly-explained` and `unexplained`: the moment at which constants of the stand changed within a record, if
    /// that explains nearly all of its residual; `null` otherwise.
    pub changed_stand: Option<ChangedStand>,
    /// Residual of the last model on the hold-out records.
    pub residual: ResidualReport,
    /// What to record to distinguish the remaining candidates; `null` if nothing is needed.
    pub next_experiment: Option<String>,
    /// Warnings, each with a stable code.
    pub warnings: Vec<Warning>,
    /// Whether the text lists all candidates.
    #[serde(skip)]
    pub shows_all: bool,
    /// The plain stand, fitted.
    #[serde(skip)]
    pub before: ScoredModel,
    /// The same with the accepted effects.
    #[serde(skip)]
    pub after: ScoredModel,
}

/// The three errors.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ErrorTable {
    /// Unit of the rms errors.
    pub unit: String,
    /// Errors of the stand file as it is; `null` without one.
    pub declared: Option<ModelErrors>,
    /// Errors of the plain stand, refitted.
    pub before: ModelErrors,
    /// Errors with the accepted effects.
    pub after: ModelErrors,
    /// Relative reduction of the hold-out rms from before to after, 95 % interval.
    pub improvement_ci95: Option<[f64; 2]>,
    /// Rms of the noise of the hold-out records, estimated without a model, in `unit`; `null` if unknown.
    pub noise_floor_rms: Option<f64>,
    /// How the noise was estimated; `null` if unknown.
    pub noise_floor_from: Option<NoiseFloorSource>,
}

#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct ModelErrors {
    #[serde(flatten)]
    pub rms: RmsErrors,
    /// Hold-out rms over the rms of the hold-out records about their mean; for a free body over that of the applied
    /// quantity.
    pub holdout_relative: f64,
}

/// What the model leaves of the held-out records.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ResidualReport {
    /// Whether the residual is white.
    pub white: bool,
    /// Whether the residual is independent of the input at positive and negative lags.
    pub independent_of_input: bool,
    /// Tests of the residual.
    pub tests: ResidualTests,
    /// Lines in the spectrum of the residual.
    pub lines: Vec<SpectralLine>,
    /// Levels of excitation.
    pub levels: ExcitationLevels,
    /// The residual in words.
    pub described: String,
}

/// Levels of excitation, and the relative error of the plain stand at each.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ExcitationLevels {
    /// Rms of the applied quantity in SI units, training records.
    pub train_applied_rms: f64,
    /// Rms of the applied quantity in SI units, hold-out records.
    pub holdout_applied_rms: f64,
    /// Relative error of the plain stand on the training records.
    pub train_relative: f64,
    /// Relative error of the plain stand on the hold-out records.
    pub holdout_relative: f64,
}

impl Diagnosis {
    pub(super) fn of(case: Case, mut found: SearchState, threads: usize) -> Self {
        let lines = found.lines_of(&found.after);
        let unit = case.units.per_printed;
        let verdict = found.conclude();
        found.settle_candidates();
        let effects = found.after.effect_names();
        let declared = case.declared_effects.iter();
        let declared_effects = declared.map(|e| e.effect.effect.name).collect();
        let detection_limits = match verdict {
            Verdict::NothingMissing => detection_limits(&found, threads),
            _ => Vec::new(),
        };
        let is_open = matches!(verdict, Verdict::PartlyExplained | Verdict::Unexplained);
        let changed_stand = is_open.then(|| found.settle_change()).flatten();
        let force_surface = (is_open && changed_stand.is_none())
            .then(|| found.force_surface())
            .flatten();
        let error = ErrorTable::of(&found);
        let levels = ExcitationLevels::of(&found, &error.before);
        let residual = ResidualReport {
            white: found.tests.white,
            independent_of_input: found.tests.independent_of_input,
            described: describe::residual(&found, verdict, &lines, &levels),
            tests: found.tests.clone(),
            lines: lines.into_iter().map(|line| line.over(unit)).collect(),
            levels,
        };
        let suspected = found.suspected.take();
        Self {
            verdict,
            effects,
            declared_effects,
            input_between_samples: found.records.between().name(),
            error,
            explained: std::mem::take(&mut found.ladder),
            constants: constants(&case, &found),
            known_loads: None,
            running: Vec::new(),
            sources: case.sources,
            next_experiment: describe::next_experiment(
                &found,
                suspected.as_ref(),
                (changed_stand.as_ref(), force_surface.as_ref()),
                verdict,
            ),
            warnings: [case.warnings, describe::warnings(&found, verdict)].concat(),
            candidates: found.candidates(),
            detection_limits,
            suspected,
            force_surface,
            changed_stand,
            residual,
            shows_all: false,
            before: found.before,
            after: found.after,
        }
    }

    /// The context shared by all models.
    pub fn context(&self) -> &FitContext {
        &self.after.fitted.structure.context
    }
}

impl SearchState {
    /// All candidates in the order of the report.
    fn candidates(&mut self) -> Vec<CandidateFit> {
        let mut all = Vec::new();
        for mut round in std::mem::take(&mut self.rounds) {
            sort_by_number(&mut round, CandidateFit::holdout_error);
            let (accepted, others): (Vec<_>, Vec<_>) = round
                .into_iter()
                .partition(|c| c.status() == Status::Accepted);
            all.extend(accepted.into_iter().chain(others));
        }
        all
    }
}

impl ErrorTable {
    fn of(found: &SearchState) -> Self {
        let (before, after) = (&found.before, &found.after);
        let units = &after.fitted.structure.context.units;
        let size = before.explainable_rms();
        let errors = |model: &ScoredModel| ModelErrors {
            rms: model.errors(),
            holdout_relative: model.compared_rms() / size,
        };
        let has_effects = !after.effect_names().is_empty();
        Self {
            unit: units.printed(),
            declared: found.declared.as_ref().map(errors),
            before: errors(before),
            after: errors(after),
            improvement_ci95: has_effects.then(|| after.against(before).improvement_ci95()),
            noise_floor_rms: found.noise_floor.map(|f| f.rms / units.per_printed),
            noise_floor_from: found.noise_floor.map(|f| f.from),
        }
    }
}

impl ScoredModel {
    /// RMS of what the model is to explain, in the compared records: the measured quantity about its means, without nuisance
    /// terms, or what acts on a body tied to the measured motion.
    pub(super) fn explainable_rms(&self) -> f64 {
        if self.fitted.structure.context.held.is_some() {
            return HeldBody::acting_rms(self.compared().iter().map(|r| &r.record));
        }
        let measured = |residual: &RecordResidual| -> Vec<f64> {
            let pairs = residual.modelled.iter().zip(&residual.samples);
            pairs.map(|(m, r)| m + r).collect()
        };
        let all: Vec<Vec<f64>> = self.compared().iter().map(measured).collect();
        rms(all.iter().map(Vec::as_slice))
    }
}

impl ExcitationLevels {
    fn of(found: &SearchState, before: &ModelErrors) -> Self {
        let context = &found.before.fitted.structure.context;
        let rms = match &context.held {
            Some(_) => HeldBody::acting_rms(found.records.train.iter()),
            None => context.scales.rms,
        };
        let train_size = rms / context.units.per_printed;
        Self {
            train_applied_rms: applied_rms(&found.records.train),
            holdout_applied_rms: applied_rms(&found.records.holdout),
            train_relative: before.rms.train_rms / train_size,
            holdout_relative: before.holdout_relative,
        }
    }
}

fn applied_rms(records: &[StandRecord]) -> f64 {
    let count: usize = records.iter().map(StandRecord::count).sum();
    let all = records.iter().flat_map(StandRecord::acting_in_range);
    (all.map(|u| u * u).sum::<f64>() / count as f64).sqrt()
}
