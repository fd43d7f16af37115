//! Detection limits: for each effect, the smallest amount that the search would have found in the records.

use schemars::JsonSchema;
use serde::Serialize;
use std::f64::consts::TAU;

use super::SearchState;
use super::acceptance::evidence;
use super::blocks::compare;
use super::record::StandRecord;
use super::score::{BaseModel, EffectParameter, ScoredModel};
use super::search::listed;
use super::starts::change;
use super::structure::EffectForm;
use crate::parallel::parallel;
use torqcomp_model::Estimate;
use torqcomp_model::effects::{SpikeMoments, SpikeShape};

/// The smallest amount of an effect that the training records would have shown with 95 % certainty.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct DetectionLimit {
    /// Name of the effect.
    pub effect: &'static str,
    /// The form of the effect for which this holds.
    pub form: &'static str,
    /// Parameter that measures the size of the effect.
    pub parameter: &'static str,
    /// Magnitude above or below which the effect is detectable; `null` if no physically possible one is.
    pub value: Option<f64>,
    /// Unit of `value`; empty for a ratio.
    pub unit: String,
    /// Whether larger or smaller values are detectable: a corner or a limit changes more the lower it is.
    pub shows: ShownSide,
    /// Values of the effect's other parameters for which this holds.
    pub at: Vec<EffectParameter>,
}

/// Where an effect shows, seen from its detection limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ShownSide {
    /// From the limit on.
    From,
    /// Up to the limit.
    UpTo,
}

/// Relative width of the bracket at which the search for a limit ends.
const WIDTH: f64 = 0.01;
/// Maximum number of evaluations for a limit.
const MOST: usize = 25;
/// Largest change of the amount between evaluations.
const LARGEST_STEP: f64 = 30.0;
/// Default frequency of a line, in natural frequencies.
const LINE: f64 = 0.5;
/// Samples from spike to spike, at least.
const SPARSE: f64 = 64.0;

/// The limits of all effects that are not part of a model.
pub fn detection_limits(found: &SearchState, threads: usize) -> Vec<DetectionLimit> {
    let weighted = found.weighted.as_ref().and_then(|records| {
        let model = ScoredModel::of(found.after.fitted.clone(), &records.training());
        Some((model?, records))
    });
    let (model, records) = weighted.unwrap_or_else(|| (found.after.clone(), &found.records));
    let base = BaseModel::of(model.clone(), records);
    let training = model.fitted.with_initial_states(&records.train);
    let effects: Vec<_> = listed(&model.fitted.structure).collect();
    let limits = parallel(effects.len(), threads, |k| {
        let effect = effects[k];
        let form = effect.forms.first()?;
        Amount::of(&base, EffectForm { effect, form }).map(|a| a.limit(&base, &training))
    });
    limits.into_iter().flatten().collect()
}

/// An effect of variable amount.
struct Amount {
    effect: EffectForm,
    /// Values of its fit parameters.
    values: Vec<f64>,
    /// Index of the parameter that measures its amount.
    size: usize,
    /// Whether the effect grows as that parameter falls.
    falls: bool,
}

/// Moments of spikes of that rate.
fn moments(record: &StandRecord, frequency_hz: f64) -> SpikeMoments {
    SpikeMoments {
        moment: record.range.start as f64,
        period: record.rate_hz() / frequency_hz,
        is_smooth: false,
    }
}

/// Spikes of one sample over the range of a record, with its weights.
fn spikes(record: &StandRecord, frequency_hz: f64, amplitude: f64) -> Vec<f64> {
    let moments = moments(record, frequency_hz);
    let one = SpikeShape::of(moments, &[amplitude]);
    record.weighted(one.train(moments, record.range.clone()).collect())
}

impl Amount {
    fn of(base: &BaseModel, effect: EffectForm) -> Option<Self> {
        let scales = &base.scored.fitted.structure.context.scales;
        let parameters = effect.form.parameters;
        let starts = effect.form.starts;
        let typical = starts.get(starts.len() / 2);
        let mut values = match typical {
            Some(values) => values.to_vec(),
            None => vec![parameters.first()?.moved(LINE * scales.natural_hz, scales)],
        };
        let size = match effect.is_line() {
            true => Some(1),
            false => effect.size(),
        };
        if effect.is_train() {
            let rate_hz = base.scored.records().first()?.rate_hz();
            values[0] = values[0].min(parameters[0].moved(rate_hz / SPARSE, scales));
        }
        values.resize(parameters.len(), 1.0);
        Some(Self {
            effect,
            values,
            size: size.unwrap_or(0),
            falls: size.is_none(),
        })
    }

    /// The parameter values for an amount of the effect.
    fn with(&self, amount: f64) -> Vec<f64> {
        let mut values = self.values.clone();
        values[self.size] = match self.falls {
            true => 1.0 / amount,
            false => amount.copysign(values[self.size]),
        };
        values
    }

    /// The largest physical amount.
    fn most(&self) -> f64 {
        let parameter = &self.effect.form.parameters[self.size];
        match (self.falls, self.values[self.size] < 0.0) {
            (true, _) => 1.0 / parameter.lower,
            (false, true) => -parameter.lower,
            (false, false) => parameter.upper,
        }
    }

    fn limit(&self, base: &BaseModel, training: &[StandRecord]) -> DetectionLimit {
        let scales = &base.scored.fitted.structure.context.scales;
        let diagnosed = &base.scored.fitted.structure.context.units.diagnosed;
        let found = self.smallest(|amount| {
            let change = self.change(base, training, amount)?;
            Some(self.evidence(base, &change))
        });
        let values = self.with(found.unwrap_or_else(|| self.most()));
        let all = self.effect.form.parameters.iter().zip(&values);
        let mut all: Vec<EffectParameter> = all
            .map(|(parameter, value)| EffectParameter {
                effect: self.effect.effect.name,
                name: parameter.name,
                estimate: Estimate::of(
                    parameter.unit.text(diagnosed),
                    parameter.value(*value, scales),
                    None,
                ),
            })
            .collect();
        let own = all.remove(self.size);
        let parameter = &self.effect.form.parameters[self.size];
        DetectionLimit {
            effect: own.effect,
            form: self.effect.form.name,
            parameter: own.name,
            value: found.map(|_| own.estimate.value().abs()),
            unit: own.estimate.unit().to_owned(),
            shows: match self.falls != parameter.reciprocal {
                true => ShownSide::UpTo,
                false => ShownSide::From,
            },
            // Further lines belong to other forms.
            at: all,
        }
    }

    /// Change of the training records by an amount of the effect that the model's own parameters cannot absorb; one
    /// record after the other.
    fn change(&self, base: &BaseModel, training: &[StandRecord], amount: f64) -> Option<Vec<f64>> {
        let context = &base.scored.fitted.structure.context;
        if !self.effect.is_line() {
            let structure = base.scored.fitted.structure.with(self.effect);
            let own = &self.with(amount)[..self.effect.moved()];
            return change(base, &structure, own, training);
        }
        let [frequency, size] = [0, 1].map(|k| &self.effect.form.parameters[k]);
        let frequency_hz = frequency.value(self.values[0], &context.scales);
        let amplitude = size.value(amount, &context.scales);
        Some(base.cleared(|k| {
            let record = &training[k];
            if self.effect.is_train() {
                let mut spikes = spikes(record, frequency_hz, amplitude);
                base.nuisance[k].clear(&mut spikes);
                return spikes;
            }
            let turn = TAU * frequency_hz / record.rate_hz();
            let line = record.range.clone().map(|i| turn * i as f64);
            let mut line: Vec<f64> = line.map(|phase| amplitude * phase.cos()).collect();
            line = record.weighted(line);
            base.nuisance[k].clear(&mut line);
            line
        }))
    }

    /// Ratio of the change of the records to what the search requires of an effect.
    fn evidence(&self, base: &BaseModel, change: &[f64]) -> f64 {
        let train = base.scored.train();
        let left = train.iter().map(|r| r.samples.as_slice());
        let left = left.collect::<Vec<_>>().concat();
        let with: Vec<f64> = left.iter().zip(change).map(|(r, c)| r + c).collect();
        let mut parameters = self.effect.form.parameters.len();
        if self.effect.is_train() {
            // The shape of the spikes of each record.
            let records = base.scored.records().iter();
            let of_record = |record: &StandRecord| {
                let frequency = &self.effect.form.parameters[0];
                let scales = &base.scored.fitted.structure.context.scales;
                moments(record, frequency.value(self.values[0], scales)).column_count()
            };
            parameters += records.map(of_record).sum::<usize>();
        }
        evidence(&compare(&with, &left), left.len(), parameters)
    }

    /// The smallest amount with an evidence of 1; the evidence grows roughly with the square of the
    /// amount.
    fn smallest(&self, evidence: impl Fn(f64) -> Option<f64>) -> Option<f64> {
        let most = self.most();
        let start = self.values[self.size].abs();
        let mut amount = if self.falls { 1.0 / start } else { start }.min(most);
        let (mut low, mut high) = (0.0_f64, f64::INFINITY);
        for _ in 0..MOST {
            // If the motion diverges, the amount is too large.
            let found = evidence(amount).unwrap_or(f64::INFINITY);
            match found >= 1.0 {
                true => high = amount,
                false => low = amount,
            }
            if low >= most || high <= low * (1.0 + WIDTH) {
                break;
            }
            let step = (1.0 / found.max(1e-12)).sqrt();
            let next = amount * step.clamp(1.0 / LARGEST_STEP, LARGEST_STEP);
            amount = match low * (1.0 + 0.5 * WIDTH) < next && next < high * (1.0 - 0.5 * WIDTH) {
                true => next,
                false if high.is_infinite() => amount * (1.0 + WIDTH),
                false if low == 0.0 => high / LARGEST_STEP,
                false => (low * high).sqrt(),
            };
            amount = amount.min(most);
        }
        high.is_finite().then_some(high)
    }
}
