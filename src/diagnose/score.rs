//! Models with their errors on the records used for comparison: the training records during selection, the held-out
//! ones in the report.

use std::ops::Range;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_model::effects::Unit;
use torqcomp_model::{Chain, Estimate, StandRun};

use super::blocks::{Comparison, compare};
use super::columns::Columns;
use super::fit::{FitEffort, FittedModel, RecordResidual};
use super::model_residuals::ModelResiduals;
use super::own_of_records::OwnOfRecords;
use super::record::{Nuisance, NuisanceTerms, StandRecord};
use super::records::Records;
use super::several_modes::slopes_of_modes;
use super::structure::EffectForm;
use super::unexplained::{raw_residual, raw_residuals};

/// A fitted model with its residuals.
#[derive(Clone)]
pub struct ScoredModel {
    pub fitted: FittedModel,
    /// Residuals on the training records.
    train: ModelResiduals,
    /// Residuals on the held-out records, if there are any.
    holdout: Option<ModelResiduals>,
    /// RMS uncertainty of these due to the constants; zero during selection.
    pub uncertain_rms: f64,
}

/// A parameter of an effect, as it is reported.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct EffectParameter {
    /// Name of the effect.
    #[serde(skip)]
    pub effect: &'static str,
    /// Name of the parameter.
    pub name: &'static str,
    #[serde(flatten)]
    pub estimate: Estimate,
}

/// Errors on training and held-out records, in the printed unit.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct RmsErrors {
    /// Rms error on the training records.
    pub train_rms: f64,
    /// Rms error on the hold-out records.
    pub holdout_rms: f64,
}

/// Minimum distance of a parameter from zero, in standard uncertainties.
const SIGNIFICANT: f64 = 3.0;
/// Relative distance from an upper bound at which a parameter is at it.
const AT_BOUND: f64 = 1e-3;
/// Ratio to another parameter in the same unit below which it is negligible: without hysteresis, the law of Bouc and Wen
/// is that of a spring.
const NEGLIGIBLE: f64 = 0.01;
/// A refit with a finer integration step or another waveform of the input.
const REPEATED_FIT: FitEffort = FitEffort::full(6);
/// Change of a record with half the integration step, relative to the RMS residual, above which the step is halved.
const STEP_ERROR: f64 = 0.1;
/// Maximum refinement of the step relative to the stand without effects: a listed effect needs one to four times as
/// many steps, while a law that imitates another (a hard stop, say) does not converge.
const FINEST: usize = 8;

impl ScoredModel {
    /// Runs a fitted model on all records; `None` if the motion diverges on one of them.
    pub fn of(fitted: FittedModel, records: &Records) -> Option<Self> {
        let train = fitted.with_initial_states(&records.train);
        let train = train.iter().map(|record| fitted.residual(record));
        let train = ModelResiduals::of(train.collect::<Option<_>>()?);
        let trained = Self {
            fitted,
            train,
            holdout: None,
            uncertain_rms: 0.0,
        };
        match records.holdout.is_empty() {
            true => Some(trained),
            false => trained.compared_on_holdout(records),
        }
    }

    /// The model with its residuals on the held-out records; `None` if the motion diverges on one of them.
    pub fn compared_on_holdout(mut self, records: &Records) -> Option<Self> {
        let residuals = records.holdout.iter().map(|record| {
            // A part of a training record has the initial state of that record.
            let mut whole = records.train.iter();
            match whole.position(|t| Arc::ptr_eq(&t.input, &record.input)) {
                Some(k) => {
                    let initial = self.fitted.initial[k];
                    self.fitted.residual(&record.starting_from(initial))
                }
                None => self.fitted.residual(record),
            }
        });
        self.holdout = Some(ModelResiduals::of(residuals.collect::<Option<_>>()?));
        Some(self)
    }

    /// The training records, with the initial states found for the model.
    pub fn records(&self) -> &[StandRecord] {
        self.train.records()
    }

    /// Residuals on the training records.
    pub fn train(&self) -> Arc<[RecordResidual]> {
        self.train.with_samples(&self.fitted)
    }

    /// Residuals on the records used for comparison: the training records, or the held-out ones if there are any.
    pub fn compared(&self) -> Arc<[RecordResidual]> {
        self.used_for_comparison().with_samples(&self.fitted)
    }

    fn used_for_comparison(&self) -> &ModelResiduals {
        self.holdout.as_ref().unwrap_or(&self.train)
    }

    /// The model without the samples of its residuals, which are simulated again whenever they are needed.
    pub fn without_samples(mut self) -> Self {
        self.train.drop_samples();
        self.holdout
            .iter_mut()
            .for_each(ModelResiduals::drop_samples);
        self
    }

    /// The model with these samples.
    pub fn with_samples(mut self) -> Self {
        self.train.keep_samples(&self.fitted);
        if let Some(holdout) = &mut self.holdout {
            holdout.keep_samples(&self.fitted);
        }
        self
    }

    /// Refits the model with the current step and waveform of the records.
    pub fn again(&self, records: &Records) -> Option<Self> {
        let fitted = self.fitted.refit(&records.train, REPEATED_FIT).ok()?;
        Self::of(fitted, records)
    }

    /// Halves the integration step and refits until the integration error is negligible; returns whether that was
    /// reached. `coarse` is the number of steps for the stand without effects.
    pub fn refine_step(mut self, records: &mut Records, coarse: usize) -> (Self, bool) {
        while self.fitted.integrates() {
            let Some(change) = self.fitted.step_change(&records.train[0]) else {
                return (self, false);
            };
            if change <= STEP_ERROR * self.compared_rms() {
                break;
            }
            let steps = 2 * records.substeps();
            if steps > FINEST * coarse {
                return (self, false);
            }
            records.set_substeps(steps);
            match self.again(records) {
                Some(finer) => self = finer,
                None => return (self, false),
            }
        }
        (self, true)
    }

    pub fn train_rms(&self) -> f64 {
        self.train.rms()
    }

    pub fn compared_rms(&self) -> f64 {
        self.used_for_comparison().rms()
    }

    /// Errors in the printed unit.
    pub fn errors(&self) -> RmsErrors {
        let unit = self.fitted.structure.context.units.per_printed;
        RmsErrors {
            train_rms: self.train_rms() / unit,
            holdout_rms: self.compared_rms() / unit,
        }
    }

    /// Mean square of the compared residuals above the noise.
    pub fn excess_power(&self, noise_rms: f64) -> f64 {
        self.compared_rms().powi(2) - noise_rms.powi(2)
    }

    /// All compared residuals, one after the other.
    pub fn compared_samples(&self) -> Vec<f64> {
        let compared = self.compared();
        let all = compared.iter().map(|r| r.samples.as_slice());
        all.collect::<Vec<_>>().concat()
    }

    /// Number of samples of the training records.
    pub fn train_count(&self) -> usize {
        self.train.count()
    }

    /// Number of compared samples.
    pub fn compared_count(&self) -> usize {
        self.used_for_comparison().count()
    }

    /// Number of parameters, including amplitudes of lines, and on each training record their phases, slow trends, what
    /// remains of its history, and the constant load. Of the amplitudes of decays, which few samples determine, as many
    /// as have the same information: `Σ ln(n_k)/ln(n)` for decays over `n_k` of `n` samples.
    pub fn parameter_count(&self) -> usize {
        let (model, terms) = self.fitted.structure.model(&self.fitted.values);
        let records = self.train.records().len();
        let driven = self.train.records().iter().filter(|r| !r.is_free());
        let of_each = terms.lines_hz.len() + terms.drift_half_waves;
        let decays = self.train.records().iter().map(|record| {
            let samples = |rate_per_s: &f64| record.rate_hz() / rate_per_s;
            let of = |samples: f64| samples.clamp(1.0, record.count() as f64).ln();
            terms.decays_per_s.iter().map(samples).map(of).sum::<f64>()
        });
        let decays = decays.sum::<f64>() / (self.train.count() as f64).ln();
        self.fitted.values.len()
            + OwnOfRecords::preloaded(&model, records).len()
            + self.fitted.amplitudes.len()
            + of_each * records
            + decays.round() as usize
            + 2 * terms.ringing.len() * driven.count()
            + self.parameters_of_spikes()
    }

    /// Number of parameters of the moments and shapes of spikes in the training records.
    fn parameters_of_spikes(&self) -> usize {
        let (_, terms) = self.fitted.structure.model(&self.fitted.values);
        let of_record = |record: &StandRecord| {
            let moments = record.spike_moments(terms.spikes_hz?);
            moments.map(|moments| moments.column_count())
        };
        self.train.records().iter().filter_map(of_record).sum()
    }

    /// An essential parameter of the last effect that does not differ significantly from zero, or its size if that is
    /// nearer to zero than its uncertainty: what such an effect explains, a better fit without it would.
    pub fn insignificant_parameter(&self) -> Option<&'static str> {
        self.insignificant_of(self.fitted.structure.effects.len().checked_sub(1)?)
    }

    /// The same of an effect. One that the fit does not determine is not significant, except at its upper bound.
    pub fn insignificant_of(&self, effect: usize) -> Option<&'static str> {
        let fitted = &self.fitted;
        let structure = &fitted.structure;
        let before = structure.effects[..effect].iter().map(EffectForm::moved);
        let first = structure.context.plain_count() + before.sum::<usize>();
        let own_effect = &structure.effects[effect];
        let parameters = &own_effect.form.parameters[..own_effect.moved()];
        let own = || parameters.iter().enumerate();
        let is_zero = |k: usize| {
            let value = fitted.values[first + k];
            let is_at_bound = value >= (1.0 - AT_BOUND) * parameters[k].upper;
            let unknown = if is_at_bound { 0.0 } else { f64::INFINITY };
            let std = fitted.std[first + k].unwrap_or(unknown);
            let unit = parameters[k].unit;
            let beside = own().filter(|(j, p)| *j != k && unit != Unit::Number && p.unit == unit);
            let largest = beside.map(|(j, _)| fitted.values[first + j].abs());
            value <= SIGNIFICANT * std || largest.fold(0.0, f64::max) * NEGLIGIBLE > value
        };
        let is_no_size = |k: usize| {
            let std = fitted.std[first + k].filter(|_| own_effect.size() == Some(k));
            std.is_some_and(|std| fitted.values[first + k].abs() < std)
        };
        own()
            .find(|(k, p)| p.essential && is_zero(*k) || is_no_size(*k))
            .map(|(_, p)| p.name)
    }

    /// Comparison with another model.
    pub fn against(&self, before: &Self) -> Comparison {
        compare(&before.compared_samples(), &self.compared_samples())
    }

    /// Bayesian information criterion on the training records, up to a constant; smaller is better
    /// (G. Schwarz, Ann. Stat. 6 (1978), 461).
    pub fn criterion(&self) -> f64 {
        let n = self.train.count() as f64;
        2.0 * n * self.train_rms().ln() + self.parameter_count() as f64 * n.ln()
    }

    /// Names of the effects added to those of the stand file.
    pub fn effect_names(&self) -> Vec<&'static str> {
        let effects = self.fitted.structure.added().iter();
        effects.map(|e| e.effect.name).collect()
    }

    /// Natural frequency in Hz, damping ratio and static gain of the model's plain stand.
    pub fn constants(&self) -> [Estimate; 3] {
        let fitted = &self.fitted;
        let plain = fitted.stand();
        let values = [plain.natural_hz, plain.damping_ratio, plain.gain];
        let count = fitted.structure.context.constant_count();
        std::array::from_fn(|k| {
            // The fit parameters are multiples of the constants.
            let moved = fitted.values[..count].get(k).zip(fitted.std.get(k));
            let std = moved.and_then(|(v, std)| std.map(|std| std * (values[k] / v).abs()));
            Estimate::of(["Hz", "", ""][k], values[k], std)
        })
    }

    /// Parameters of each effect of the model.
    pub fn parameters(&self) -> Vec<Vec<EffectParameter>> {
        let fitted = &self.fitted;
        let context = &fitted.structure.context;
        let mut amplitudes = fitted.amplitudes.iter();
        let effects = fitted.structure.placed();
        let values = fitted.structure.effect_values(&fitted.values);
        let of_effect =
            |((effect, places), mut values): ((&EffectForm, Range<usize>), Vec<f64>)| {
                let (from, moved) = (places.start, places.len());
                for (value, amplitude) in values[moved..].iter_mut().zip(&mut amplitudes) {
                    *value = *amplitude;
                }
                let own = effect.form.parameters.iter().zip(values).enumerate();
                let own = own.map(|(k, (parameter, value))| {
                    let std = fitted.std.get(from + k).copied().flatten();
                    let std = std.filter(|_| k < moved);
                    let std =
                        std.map(|s| parameter.std(fitted.values[from + k], s, &context.scales));
                    let unit = parameter.unit.text(&context.units.diagnosed);
                    EffectParameter {
                        effect: effect.effect.name,
                        name: parameter.name,
                        estimate: Estimate::of(unit, value, std),
                    }
                });
                own.collect()
            };
        effects.zip(values).map(of_effect).collect()
    }

    /// Parameters of the last effect.
    pub fn last_parameters(&self) -> Vec<EffectParameter> {
        self.parameters().pop().unwrap_or_default()
    }
}

impl FittedModel {
    /// RMS change of a training record with half the integration step.
    pub fn step_change(&self, first: &StandRecord) -> Option<f64> {
        let (model, _) = self.structure.model(&self.values);
        let mut record = first.starting_from(*self.initial.first()?);
        let coarse = raw_residual(&model, &record).ok()?;
        record.input = Arc::new(record.input.with_substeps(2 * record.input.substeps()));
        let fine = raw_residual(&model, &record).ok()?;
        let sum: f64 = coarse.iter().zip(&fine).map(|(a, b)| (a - b).powi(2)).sum();
        Some((sum / coarse.len() as f64).sqrt())
    }
}

/// A model to which effects are added, with the derivatives of its residuals.
pub struct BaseModel {
    pub scored: ScoredModel,
    /// For each training record, the derivatives of the residual with respect to the parameters.
    pub slopes: Vec<Columns>,
    /// Nuisance terms of each training record.
    pub nuisance: Vec<Nuisance>,
}

/// Relative finite-difference step.
const STEP: f64 = 1e-6;

impl BaseModel {
    pub fn of(scored: ScoredModel, records: &Records) -> Self {
        let scored = scored.with_samples();
        let fitted = &scored.fitted;
        let training = fitted.with_initial_states(&records.train);
        let (slopes, nuisance) = training.iter().map(|r| slopes(fitted, r)).unzip();
        Self {
            scored,
            slopes,
            nuisance,
        }
    }

    /// A series per training record, by its index, without what the base's own parameters and nuisance terms can
    /// absorb; one record after the other.
    pub fn cleared(&self, of: impl Fn(usize) -> Vec<f64>) -> Vec<f64> {
        let clear = |(k, slopes): (usize, &Columns)| {
            let mut samples = of(k);
            slopes.clear(&mut samples);
            samples
        };
        let records = self.slopes.iter().enumerate();
        records.flat_map(clear).collect()
    }
}

/// Derivatives of a record's residual with respect to the parameters, without its nuisance terms, and these
/// terms.
fn slopes(fitted: &FittedModel, record: &StandRecord) -> (Columns, Nuisance) {
    let (_, terms) = fitted.structure.model(&fitted.values);
    let nuisance = fitted.nuisance(record, &terms);
    let derivatives = derivatives(fitted, record, &terms, &nuisance);
    let mut slopes = Columns::default();
    for derivative in derivatives.into_iter().flatten() {
        slopes.push(derivative);
    }
    let of_modes = slopes_of_modes(&fitted.structure, &fitted.values, record);
    for mut slope in of_modes.into_iter().flatten() {
        nuisance.clear(&mut slope);
        slopes.push(slope);
    }
    (slopes, nuisance)
}

/// Derivative of a record's residual with respect to each parameter, without nuisance terms; `None` if the motion
/// diverges.
pub fn derivatives(
    fitted: &FittedModel,
    record: &StandRecord,
    terms: &NuisanceTerms,
    nuisance: &Nuisance,
) -> Option<Vec<Vec<f64>>> {
    let rings = record.is_free() && !fitted.integrates();
    let step = |k: usize| STEP * fitted.values[k].abs().max(1e-3);
    let mut points = vec![fitted.values.clone(); fitted.values.len() + 1];
    for (k, point) in points[1..].iter_mut().enumerate() {
        point[k] += step(k);
    }
    let chains: Vec<Chain> = points.iter().map(|p| fitted.structure.model(p).0).collect();
    let runs: Vec<StandRun> = chains.iter().map(|chain| record.run_of(chain)).collect();
    let residuals = raw_residuals(&runs, record).into_iter().zip(&chains);
    let cleared = residuals.map(|(residual, chain)| {
        let mut residual = residual.ok()?;
        match rings {
            true => record
                .nuisance(&chain.free_mode(), terms, None)
                .clear(&mut residual),
            false => nuisance.clear(&mut residual),
        }
        Some(residual)
    });
    let residuals = cleared.collect::<Option<Vec<_>>>()?;
    let along = |(k, there): (usize, &Vec<f64>)| {
        let pairs = there.iter().zip(&residuals[0]);
        pairs.map(|(a, b)| (a - b) / step(k)).collect()
    };
    Some(residuals[1..].iter().enumerate().map(along).collect())
}
