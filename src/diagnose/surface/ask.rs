//! When to fit a surface without a given law: a residual is left, and possibly none of the laws
//! causes it.

use torqcomp_dsp::rms;

use super::{Surface, is_law, seen};
use crate::diagnose::reason::Reason;
use crate::diagnose::record::StandRecord;
use crate::diagnose::score::ScoredModel;
use crate::diagnose::search::reject_all;
use crate::diagnose::structure::EffectForm;
use crate::diagnose::verdict::noise_rms;
use crate::diagnose::{ForceSurface, SearchState};

/// A surface that explains more than the laws in addition to which it was fitted.
pub struct AskedSurface {
    surface: Surface,
    /// The model with these laws.
    model: ScoredModel,
    /// Whether they are withdrawn for it.
    pub outdoes_laws: bool,
    /// Whether it shows that they are incomplete.
    pub shows_lack: bool,
    /// Its report on the held-out records, if these confirm it.
    report: Option<ForceSurface>,
}

impl SearchState {
    /// Fits a surface if the model leaves a residual, keeps it if it explains more, and withdraws the laws of the model
    /// if it explains far more than they do.
    pub fn ask_surface(&mut self, threads: usize) {
        let model = self.after.clone();
        let is_open = !self.is_at_noise() || self.suspected.is_some();
        if !is_open || !self.can_ask(&model) {
            return;
        }
        let Some(surface) = Surface::fit(&model).filter(|s| s.improves_on(&model)) else {
            return;
        };
        let added = model.fitted.structure.added();
        let has_laws = added.iter().any(|effect| is_law(effect.form.stage));
        let outdoes_laws = has_laws && surface.outdoes(&model, noise_rms(self.noise_floor));
        if outdoes_laws {
            self.withdraw_laws(&surface);
        }
        self.surface = Some(AskedSurface {
            shows_lack: surface.shows_lack(&model, threads),
            surface,
            model,
            outdoes_laws,
            report: None,
        });
    }

    /// Reverts to a model without the laws of the motion.
    fn withdraw_laws(&mut self, surface: &Surface) {
        let ratio = rms(&seen(&self.after.train())) / surface.unseen_rms();
        let fitted = &self.after.fitted;
        let is_withdrawn = |effect: &EffectForm| is_law(effect.form.stage);
        let added = fitted.structure.added();
        let withdrawn = added.iter().filter(|effect| is_withdrawn(effect));
        let names: Vec<&str> = withdrawn.map(|effect| effect.effect.name).collect();
        for round in &mut self.rounds {
            for candidate in round.iter_mut().filter(|c| names.contains(&c.effect.name)) {
                reject_all(std::slice::from_mut(candidate), |_| Reason::Surface {
                    ratio,
                });
            }
        }
        let kept = (names.len() < added.len())
            .then(|| fitted.with_only(|k| !is_withdrawn(&added[k]), &self.records))
            .flatten();
        let kept = kept.and_then(|fitted| ScoredModel::of(fitted, &self.records));
        self.after = kept.unwrap_or_else(|| self.before.clone());
        self.tests = crate::diagnose::tests(&self.after);
        self.without.clear();
    }

    /// Tests the surface on the held-out records, and restores the withdrawn laws if these do not confirm it.
    pub fn judge_surface(&mut self) {
        let Some(mut asked) = self.surface.take() else {
            return;
        };
        let model = asked.model.clone().compared_on_holdout(&self.records);
        asked.report = model.and_then(|m| asked.surface.report(&m, asked.outdoes_laws));
        if asked.outdoes_laws && asked.report.is_none() {
            asked.outdoes_laws = false;
            self.after = asked.model.clone();
            self.tests = crate::diagnose::tests(&self.after);
            self.without.clear();
        }
        self.surface = Some(asked);
    }

    /// The surface confirmed by the held-out records; if no effect is named in the end, one in place of all.
    pub fn force_surface(&self) -> Option<ForceSurface> {
        if let Some(asked) = &self.surface {
            return asked.report.clone();
        }
        let model = &self.before;
        if !self.after.effect_names().is_empty() || !self.can_ask(model) {
            return None;
        }
        let surface = Surface::fit(model).filter(|s| s.improves_on(model))?;
        surface.report(model, false)
    }

    /// Whether the records may show a surface: there is a spring, and the torque is applied.
    fn can_ask(&self, model: &ScoredModel) -> bool {
        let context = &model.fitted.structure.context;
        let is_held = context.held.is_some();
        let mut records = self.records.train.iter().chain(&self.records.holdout);
        !is_held && context.sees_torques && !records.any(StandRecord::is_free)
    }
}
