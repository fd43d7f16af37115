//! Final fit of the model found: with integration errors below the statistical uncertainty, and in the simplest
//! equivalent form.

use torqcomp_model::effects::Form;

use super::fit::{FitEffort, FittedModel};
use super::records::Records;
use super::score::ScoredModel;
use super::several_modes::fit_with_modes;
use super::structure::Structure;
use crate::parallel::parallel;

/// Starts where another fit ended.
const LAST_FIT: FitEffort = FitEffort::full(8);
/// Largest refinement of the integration step relative to that of the model selection: where switching instants slow
/// convergence, still finer steps cost more than they gain.
const FINEST: usize = 8;

impl ScoredModel {
    /// The model refitted to the training records, with all parameters of all modes, and the records with the required
    /// steps; `None` if the steps are fine enough already and there is one mode. While effects are compared, the
    /// integration error may be a tenth of the residual. For long records and few parameters, that exceeds the
    /// statistical uncertainty and would bias them.
    pub fn finished(&self, records: &Records, threads: usize) -> Option<(Self, Records)> {
        let fine = self.fine_enough(records)?;
        let last = |structure: Structure, values: &[f64]| {
            let train = self.fitted.with_initial_states(&fine.train);
            let fitted = fit_with_modes(structure, values, &train, LAST_FIT).ok()?;
            Self::of(fitted, &fine.training())
        };
        let mut forms = vec![(self.fitted.structure.clone(), self.fitted.values.clone())];
        forms.extend(self.fitted.plainer_forms());
        // With coarse steps, what happens within a step has no minimum.
        forms.extend(self.fitted.off_bounds());
        let models = parallel(forms.len(), threads, |k| {
            last(forms[k].0.clone(), &forms[k].1)
        });
        let models = models.into_iter().flatten();
        let best = models.min_by(|a, b| a.criterion().total_cmp(&b.criterion()))?;
        Some((best, fine))
    }

    /// The records with steps fine enough that the integration error is below the standard uncertainty of the
    /// modelled record, `σ √(p/n)`; `None` if they already are, and no further modes are left to be fitted in full.
    fn fine_enough(&self, records: &Records) -> Option<Records> {
        let count = self.train_count() as f64;
        let uncertain = self.train_rms() * (self.parameter_count() as f64 / count).sqrt();
        let present = records.substeps();
        let mut fine = records.clone();
        while self.fitted.integrates() && fine.substeps() < FINEST * present {
            if self.fitted.step_change(&fine.train[0])? <= uncertain {
                break;
            }
            fine.set_substeps(2 * fine.substeps());
        }
        let has_several = self.fitted.structure.context.several.is_some();
        (has_several || fine.substeps() > present).then_some(fine)
    }
}

impl FittedModel {
    /// The model with one of its effects in a form with a subset of its parameters.
    fn plainer_forms(&self) -> Vec<(Structure, Vec<f64>)> {
        let mut found = Vec::new();
        for (k, (present, own)) in self.structure.placed().enumerate() {
            let value = |name: &str| {
                let mut parameters = present.form.parameters[..own.len()].iter();
                let place = parameters.position(|p| p.name == name)?;
                Some(self.values[own.start + place])
            };
            let in_form = |form: &'static Form| {
                let values: Option<Vec<f64>> =
                    form.parameters.iter().map(|p| value(p.name)).collect();
                let values = values.filter(|values| values.len() < own.len())?;
                let mut structure = self.structure.clone();
                structure.effects[k].form = form;
                let (before, after) = (&self.values[..own.start], &self.values[own.end..]);
                Some((structure, [before, &values, after].concat()))
            };
            found.extend(present.effect.forms.iter().filter_map(in_form));
        }
        found
    }
}
