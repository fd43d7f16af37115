//! Start values of the fit of an effect, near the magnitude suggested by the residual.

use std::borrow::Cow;
use std::f64::consts::TAU;

use torqcomp_model::Chain;
use torqcomp_model::effects::RecordScales;

use super::backbone::Backbone;
use super::record::{InitialState, StandRecord};
use super::score::BaseModel;
use super::spectra::SpectralLine;
use super::spike_train::train_rate_hz;
use super::structure::{EffectForm, Structure};
use super::unexplained::raw_residual;
use torqcomp_dsp::{dot, sort_by_number};

/// Number of starts whose magnitude is adjusted.
const SIZED: usize = 4;
/// Limits of the factor on the magnitude of a start.
const FACTORS: [f64; 2] = [1e-3, 4.0];

/// A start with its training residual, apart from what a change of the base's own parameters removes.
#[derive(Clone)]
pub struct Start {
    /// Values of all parameters.
    pub values: Vec<f64>,
    /// Initial state of each training record, if it differs from that of the base.
    pub initial: Option<Vec<InitialState>>,
    /// Sum of squares of the residual.
    pub left: f64,
    /// Reduction of the sum of squares with the optimum magnitude of the added effect, to first
    /// order.
    reduction: f64,
    /// That magnitude, as a factor.
    factor: f64,
}

impl Start {
    /// A start whose residual is not known.
    pub fn untried(values: Vec<f64>, initial: Option<Vec<InitialState>>) -> Self {
        Self {
            values,
            initial,
            left: f64::INFINITY,
            reduction: 0.0,
            factor: 0.0,
        }
    }

    /// The start from the amplitude dependence of frequency and decay rate of free decays. It replaces the magnitudes of
    /// all effects: beside a missing one, those of the others may be turns away.
    pub fn from_backbone(
        structure: &Structure,
        mut values: Vec<f64>,
        training: &[StandRecord],
    ) -> Option<Self> {
        if !training.iter().all(StandRecord::is_free) {
            return None;
        }
        let names: Vec<&str> = structure.names().collect();
        let each = training.iter().map(|r| Backbone::of(r, &names));
        let each: Vec<Backbone> = each.collect::<Option<_>>()?;
        let first = each.first()?;
        let scales = &structure.context.scales;
        values[0] = first.omega_rad_s / TAU / scales.natural_hz;
        values[1] = first.damping_ratio;
        for ((effect, own), size) in structure.placed().zip(&first.sizes) {
            let bounds = &effect.form.parameters[0];
            values[own.start] = (size / bounds.size(scales)).clamp(bounds.lower, bounds.upper);
        }
        let initial = each.iter().map(Backbone::initial).collect();
        Some(Self::untried(values, Some(initial)))
    }

    /// The training records with the initial states of the start.
    pub fn in_records<'r>(&self, training: &'r [StandRecord]) -> Cow<'r, [StandRecord]> {
        let Some(initial) = &self.initial else {
            return training.into();
        };
        let both = training.iter().zip(initial);
        both.map(|(record, initial)| record.starting_from(*initial))
            .collect()
    }
}

/// The starts with the smallest residuals, at most `most`, each as given and with the magnitude suggested by the residual;
/// and those from the backbone of free decays or a shift.
pub fn best_starts(
    base: &BaseModel,
    structure: &Structure,
    lines: &[SpectralLine],
    training: &[StandRecord],
    most: usize,
) -> Vec<Start> {
    let Some(effect) = structure.effects.last() else {
        return Vec::new();
    };
    let plain = &base.scored.fitted.values;
    let of_base = base.scored.fitted.structure.model(plain).0;
    let present = of_base.added_stiffness();
    let evaluated = |own: &[f64]| {
        let values = [plain.as_slice(), &own[..effect.moved()]].concat();
        let values = with_shared_stiffness(structure, present, values);
        evaluate(base, structure, values, training)
    };
    let scales = &structure.context.scales;
    let mut starts: Vec<(Vec<f64>, Start)> = own_values(effect, base, lines, scales)
        .into_iter()
        .filter_map(|own| evaluated(&own).map(|start| (own, start)))
        .collect();
    sort_by_number(&mut starts, |(_, start)| -start.reduction);
    let mut found: Vec<Start> = starts.iter().map(|(_, start)| start.clone()).collect();
    if let Some(size) = effect.size() {
        let bounds = &effect.form.parameters[size];
        found.extend(starts.iter().take(SIZED).filter_map(|(own, start)| {
            let mut own = own.clone();
            let factor = start.factor.abs().clamp(FACTORS[0], FACTORS[1]);
            let signed = factor.copysign(start.factor) * own[size];
            own[size] = match (bounds.lower..=bounds.upper).contains(&signed) {
                true => signed,
                false => FACTORS[0] * own[size],
            };
            evaluated(&own)
        }));
    }
    sort_by_number(&mut found, |start| start.left);
    found.truncate(most);
    let first = effect.form.starts.first();
    let own = first.map_or(&[][..], |own| &own[..effect.moved()]);
    let values = [plain.as_slice(), own].concat();
    found.extend(Start::from_backbone(structure, values, training));
    found.extend(from_shift(structure));
    found
}

/// The start of a delay from the shift between the channels, as the first effect: while a delay is missing, the plain stand may
/// have any frequency.
fn from_shift(structure: &Structure) -> Option<Start> {
    let [effect] = structure.effects.as_slice() else {
        return None;
    };
    let context = &structure.context;
    let late = context
        .late
        .filter(|_| effect.effect.name == "time-delay")?;
    let delay = &effect.form.parameters[0];
    let near = late.delay_s / delay.size(&context.scales);
    let mut values = context.plain_values(&late.stand);
    values.push(near.clamp(delay.lower, delay.upper));
    Some(Start::untried(values, None))
}

/// Start values of an effect's own parameters; for a line also the significant frequencies of the residual, for a train
/// of spikes its rate.
fn own_values(
    effect: &EffectForm,
    base: &BaseModel,
    lines: &[SpectralLine],
    scales: &RecordScales,
) -> Vec<Vec<f64>> {
    let mut all: Vec<Vec<f64>> = effect.form.starts.iter().map(|s| s.to_vec()).collect();
    if effect.is_line() {
        let frequency = &effect.form.parameters[0];
        let bounds = frequency.lower..=frequency.upper;
        let size = frequency.size(scales);
        let found_hz: Vec<f64> = match effect.is_train() {
            true => train_rate_hz(&base.scored.train()).into_iter().collect(),
            false => lines.iter().map(|line| line.frequency_hz).collect(),
        };
        let near = found_hz.iter().map(|hz| hz / size);
        all.extend(near.filter(|f| bounds.contains(f)).map(|f| vec![f]));
    }
    all
}

/// Reduces the stiffness of the plain stand by that of the effect, so that the total is unchanged; `present` is the
/// added stiffness of the existing effects.
pub fn with_shared_stiffness(
    structure: &Structure,
    present: f64,
    mut values: Vec<f64>,
) -> Vec<f64> {
    let factor = (1.0 + structure.model(&values).0.added_stiffness()) / (1.0 + present);
    values[0] /= factor.sqrt();
    if structure.context.gain_is_free {
        values[2] *= factor;
    }
    values
}

/// Change of the training records by an effect with these own values, the last of a structure, that the base's own
/// parameters cannot absorb; one record after the other. `None` if the motion diverges.
pub fn change(
    base: &BaseModel,
    structure: &Structure,
    own: &[f64],
    training: &[StandRecord],
) -> Option<Vec<f64>> {
    let plain = &base.scored.fitted.values;
    let present = base
        .scored
        .fitted
        .structure
        .model(plain)
        .0
        .added_stiffness();
    let values = [plain.as_slice(), own].concat();
    let values = with_shared_stiffness(structure, present, values);
    let (model, _) = structure.model(&values);
    let records = training.iter().enumerate();
    let changes = records.map(|(k, record)| change_of(base, &model, record, k));
    Some(changes.collect::<Option<Vec<_>>>()?.concat())
}

/// Change of training record `k` by a model.
fn change_of(base: &BaseModel, model: &Chain, record: &StandRecord, k: usize) -> Option<Vec<f64>> {
    // The constant load of the record is left to the fit.
    let unloaded = InitialState {
        preload: 0.0,
        ..record.initial
    };
    let mut moved = raw_residual(model, &record.starting_from(unloaded)).ok()?;
    base.nuisance[k].clear(&mut moved);
    let before = base.scored.train();
    let pairs = before[k].samples.iter().zip(&moved);
    let mut change: Vec<f64> = pairs.map(|(b, m)| b - m).collect();
    base.slopes[k].clear(&mut change);
    Some(change)
}

fn evaluate(
    base: &BaseModel,
    structure: &Structure,
    values: Vec<f64>,
    training: &[StandRecord],
) -> Option<Start> {
    let (model, terms) = structure.model(&values);
    let last = structure.effects.last();
    let disturbs = last.is_some_and(EffectForm::is_disturbance);
    let (mut left, mut along, mut size) = (0.0, 0.0, 0.0);
    let residuals = base.scored.train();
    let residuals = training.iter().zip(residuals.iter());
    for (k, (record, before)) in residuals.enumerate() {
        if disturbs {
            let mut residual = before.samples.clone();
            let record = record.clone().with_spikes(&terms, &residual);
            let nuisance = record.nuisance(&base.scored.fitted.free, &terms, None);
            nuisance.clear(&mut residual);
            left += dot(&residual, &residual);
            continue;
        }
        let change = change_of(base, &model, record, k)?;
        let pairs = before.samples.iter().zip(&change);
        let rest: Vec<f64> = pairs.map(|(b, c)| b - c).collect();
        left += dot(&rest, &rest);
        along += dot(&change, &before.samples);
        size += dot(&change, &change);
    }
    let factor = if size > 0.0 { along / size } else { 0.0 };
    let reduction = match disturbs {
        true => -left,
        false => along * factor,
    };
    Some(Start {
        values,
        initial: None,
        left,
        reduction,
        factor,
    })
}
