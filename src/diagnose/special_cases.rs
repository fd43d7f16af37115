//! Special cases, fitted from the result of the general case: dry friction is Stribeck friction without a drop, and a
//! fit that gets stuck with one parameter may converge with three.

use torqcomp_model::effects::{EffectParameter, Form};

use super::fit::{FitEffort, fit};
use super::records::Records;
use super::score::ScoredModel;
use super::search::{SAME, Workers, listed};
use super::structure::EffectForm;
use crate::parallel::parallel;

/// Fit of a special case, which starts near its minimum.
const SPECIAL_CASE: FitEffort = FitEffort::full(15);
/// Ratio of the sum of squares of a general case to that of the special one, above which the special one needs no
/// refit.
const LESS: f64 = 0.99;

/// Refits the forms whose residual is larger than that of the best general case, if that gains at least the given
/// amount.
pub fn fit_special_cases(
    forms: &[EffectForm],
    fits: &mut [Option<ScoredModel>],
    (without, least_gain): (f64, f64),
    records: &Records,
    workers: Workers,
) {
    let sum = |k: usize| {
        let fit: &Option<ScoredModel> = &fits[k];
        fit.as_ref().map_or(without, |m| m.fitted.train_sum)
    };
    let general = |k: usize| {
        let others = (0..forms.len()).filter(|g| forms[k].is_special_case_of(&forms[*g]));
        let promising = others.filter(|g| without - sum(*g) >= least_gain);
        let best = promising.min_by(|a, b| sum(*a).total_cmp(&sum(*b)))?;
        (sum(best) < LESS * sum(k)).then_some(best)
    };
    let anew: Vec<(usize, usize)> = (0..forms.len())
        .filter_map(|k| Some((k, general(k)?)))
        .collect();
    let found = parallel(anew.len(), workers.threads, |i| {
        let (k, general) = anew[i];
        let fit = fits[general].as_ref()?.in_special_case(forms[k], records)?;
        (fit.fitted.train_sum < sum(k)).then_some(fit)
    });
    for ((k, _), fit) in anew.into_iter().zip(found) {
        if fit.is_some() {
            fits[k] = fit;
        }
    }
}

impl EffectForm {
    /// Whether its parameters are a subset of those of a form of the same effect, or of one that resembles it.
    fn is_special_case_of(&self, other: &Self) -> bool {
        let (own, others) = (self.form.parameters, other.form.parameters);
        let has = |p: &EffectParameter| others.iter().any(|o| o.name == p.name);
        let is_alike = self.effect.name == other.effect.name || self.effect.resembles(other.effect);
        let is_like = is_alike && self.form.stage == other.form.stage && !self.is_line();
        is_like && own.len() < others.len() && own.iter().all(has)
    }
}

impl ScoredModel {
    /// The model with the best special case of its last effect, if a parameter that distinguishes the general case is
    /// zero.
    pub fn simplified(self, records: &Records, threads: usize) -> Self {
        let structure = &self.fitted.structure;
        let Some(last) = structure.effects.last().copied() else {
            return self;
        };
        if self.insignificant_parameter().is_none() {
            return self;
        }
        let listed = listed(structure).chain([last.effect]);
        let mut forms = EffectForm::all(listed);
        forms.retain(|form| form.is_special_case_of(&last) && structure.context.allows(form));
        let fits = parallel(forms.len(), threads, |k| {
            self.in_special_case(forms[k], records)
        });
        let fits = fits.into_iter().flatten();
        let best = fits.min_by(|a, b| a.criterion().total_cmp(&b.criterion()));
        best.filter(|best| best.criterion() < self.criterion() + SAME)
            .unwrap_or(self)
    }

    /// The last effect's special case, fitted from its present values.
    fn in_special_case(&self, special: EffectForm, records: &Records) -> Option<Self> {
        let mut structure = self.fitted.structure.clone();
        let general = structure.effects.pop()?;
        let first = self.fitted.values.len() - general.moved();
        let (others, own) = self.fitted.values.split_at(first);
        let own = own_in_form(special.form, general.form, own);
        let training = self.fitted.with_initial_states(&records.train);
        let values = [others, &own].concat();
        let fitted = fit(structure.with(special), &values, &training, SPECIAL_CASE).ok()?;
        Some(Self::of(fitted, records)?.without_samples())
    }
}

/// Values of an effect in another form: those of the same name or, if both have as many, of the same index; otherwise
/// the form's start values.
pub fn own_in_form(form: &Form, present: &Form, own: &[f64]) -> Vec<f64> {
    let (names, have) = (form.parameters, present.parameters);
    let value = |(i, parameter): (usize, &EffectParameter)| {
        let same = have.iter().position(|p| p.name == parameter.name);
        let place = same.or((names.len() == have.len()).then_some(i));
        let start = || form.starts.first().and_then(|start| start.get(i));
        let found = place.and_then(|place| own.get(place)).or_else(start);
        let value = found.copied().unwrap_or(parameter.lower);
        // A parameter of either sign in one form may be one-sided in another.
        value.clamp(parameter.lower, parameter.upper)
    };
    names.iter().enumerate().map(value).collect()
}

#[cfg(test)]
mod tests {
    use torqcomp_model::effects::EFFECTS;

    use super::*;

    #[test]
    fn values_are_within_the_bounds_of_the_other_form() {
        for present in EffectForm::all(EFFECTS.iter().copied()) {
            let own: Vec<f64> = present.form.parameters.iter().map(|p| p.lower).collect();
            for form in present.effect.forms {
                let moved = own_in_form(form, present.form, &own);
                let mut both = moved.iter().zip(form.parameters);
                assert!(both.all(|(value, p)| (p.lower..=p.upper).contains(value)));
            }
        }
    }

    #[test]
    fn dry_friction_is_a_special_case() {
        let all = EffectForm::all(EFFECTS.iter().copied());
        let form = |effect: &str| all.iter().find(|f| f.effect.name == effect).expect("one");
        let [dry, general] = ["coulomb-friction", "stribeck-friction"].map(form);
        assert!(dry.is_special_case_of(general) && !general.is_special_case_of(dry));
        assert!(!form("backlash").is_special_case_of(general));
    }
}
