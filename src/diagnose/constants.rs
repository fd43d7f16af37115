//! Constants of the stand reported by a diagnosis.

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_model::Estimate;

use super::held::HeldBody;
use super::score::ScoredModel;
use super::several_modes::SeveralModes;
use super::{Case, SearchState};
use crate::identify::MODE_NUMBERS;

/// A constant of the plain stand.
#[derive(Debug, Serialize, JsonSchema)]
pub struct StandConstant {
    /// Name of the constant.
    pub name: &'static str,
    /// Number of the mode, from 1, of a stand with several; `null` for what belongs to all of it.
    pub mode: Option<usize>,
    /// Unit of the values.
    pub unit: String,
    /// Value in the stand file; `null` if not given.
    pub declared: Option<f64>,
    /// Value in the plain stand, refitted.
    pub before: f64,
    /// Standard uncertainty of `before`; `null` if unknown.
    pub before_std: Option<f64>,
    /// Value with the accepted effects.
    pub after: f64,
    /// Standard uncertainty of `after`; `null` if unknown.
    pub after_std: Option<f64>,
}

impl StandConstant {
    fn of(
        (name, mode): (&'static str, Option<usize>),
        declared: Option<f64>,
        [before, after]: [&Estimate; 2],
    ) -> Self {
        Self {
            name,
            mode,
            unit: after.unit().to_owned(),
            declared,
            before: before.value(),
            before_std: before.std_uncertainty(),
            after: after.value(),
            after_std: after.std_uncertainty(),
        }
    }
}

/// The constants of the stand: declared, refitted, and refitted with the effects.
pub fn constants(case: &Case, found: &SearchState) -> Vec<StandConstant> {
    let context = &found.before.fitted.structure.context;
    if let Some(held) = &context.held {
        return of_held(held, found);
    }
    let declared = case
        .declared
        .map(|d| [d.natural_hz, d.damping_ratio, d.gain]);
    let (gain_unit, gain_scale) = context.units.gain();
    let [before, after] = [&found.before, &found.after].map(|model| {
        let [frequency, ratio, gain] = model.constants();
        let std = gain.std_uncertainty().map(|std| std * gain_scale);
        let gain = Estimate::of(gain_unit.clone(), gain.value() * gain_scale, std);
        [frequency, ratio, gain]
    });
    let one = |k: usize, name| {
        let scale = if k == 2 { gain_scale } else { 1.0 };
        let declared = declared.map(|d| d[k] * scale);
        StandConstant::of((name, None), declared, [&before[k], &after[k]])
    };
    let gain = context.gain_is_free.then(|| one(2, "static_gain"));
    let mut all = match &case.several {
        Some(declared) => of_modes(declared, found),
        None => vec![one(0, "natural_frequency"), one(1, "damping_ratio")],
    };
    all.extend(gain);
    all
}

/// Constants of each mode of a stand with several.
fn of_modes(declared: &SeveralModes, found: &SearchState) -> Vec<StandConstant> {
    let (before, after) = (found.before.modes(), found.after.modes());
    let both = before.iter().zip(&after).zip(declared.numbers());
    let of_mode = |(mode, ((before, after), declared)): (usize, ((_, _), [f64; 4]))| {
        let (before, after): (&[Estimate; 4], &[Estimate; 4]) = (before, after);
        let of = move |(k, name): (usize, &&'static str)| {
            let both = [&before[k], &after[k]];
            StandConstant::of((name, Some(mode + 1)), Some(declared[k]), both)
        };
        let all = MODE_NUMBERS.iter().enumerate().map(of);
        all.collect::<Vec<_>>()
    };
    both.enumerate().flat_map(of_mode).collect()
}

/// Inertia and damping of a body without a spring.
fn of_held(held: &HeldBody, found: &SearchState) -> Vec<StandConstant> {
    let [before, after] = [&found.before, &found.after].map(|model| {
        let [hz, ratio, _] = model.constants();
        held.constants([&hz, &ratio])
    });
    let names = ["inertia", "damping"].into_iter();
    let all = names.zip(before.iter().zip(&after));
    all.map(|(name, (before, after))| StandConstant::of((name, None), None, [before, after]))
        .collect()
}

impl ScoredModel {
    /// Frequency in Hz, damping ratio, residue and quadrature of each mode of a stand with several; empty otherwise.
    pub fn modes(&self) -> Vec<[Estimate; 4]> {
        let several = &self.fitted.structure.context.several;
        let Some(several) = several else {
            return Vec::new();
        };
        let [frequency, ratio, _] = self.constants();
        let mut all = several.with_first(self.fitted.mode()).estimates();
        [all[0][0], all[0][1]] = [frequency, ratio];
        all
    }
}
