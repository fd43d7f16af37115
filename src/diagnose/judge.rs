//! Hold-out errors. Selection uses the training records only; effects not confirmed by the held-out records are
//! removed.

use super::SearchState;
use super::acceptance::no_gain;
use super::fit::FittedModel;
use super::guard_models::GuardModel;
use super::ladder::Ladder;
use super::noise_floor::NoiseFloor;
use super::plain::set_starts;
use super::reason::Reason;
use super::records::Records;
use super::score::ScoredModel;
use super::search::{CandidateFit, reject_all};
use super::structure::EffectForm;
use crate::failure::{ErrorCode, Failure};
use crate::parallel::parallel;

impl SearchState {
    /// Computes the hold-out errors of all models, and removes the effects that the held-out records do not confirm.
    ///
    /// # Errors
    /// If the plain stand cannot be run on them.
    pub(super) fn judge_on(&mut self, case: &Records, threads: usize) -> Result<(), Failure> {
        let substeps = self.records.substeps();
        self.records = case.with_between(self.records.between());
        self.records.set_substeps(substeps);
        set_starts(&self.before.fitted, &mut self.records.train);
        set_starts(&self.before.fitted, &mut self.records.holdout);
        self.before = match self.held_out(&self.before) {
            Some(before) => before,
            None => self.declared_instead()?,
        };
        self.judge_surface();
        let declared = self.declared.as_ref().and_then(|m| self.held_out(m));
        self.declared = declared.map(ScoredModel::without_samples);
        self.judge_candidates(threads);
        self.weigh_again(threads);
        self.suspected = self.suspected.take().and_then(|mut guard| {
            guard.model = self.held_out(&guard.model)?.without_samples();
            guard.errors = guard.model.errors();
            Some(guard)
        });
        self.noise_floor = NoiseFloor::of(&self.before.compared(), &self.before.fitted.passage());
        self.tests_before = super::tests(&self.before);
        let without = std::mem::take(&mut self.without);
        self.without = parallel(without.len(), threads, |k| {
            Some(self.held_out(without[k].as_ref()?)?.without_samples())
        });
        let finished = self.after.finished(&self.records, threads);
        let judged = match finished {
            Some((last, fine)) => {
                if self.weighted.is_some() {
                    self.records = fine.clone();
                }
                last.compared_on_holdout(&fine)
            }
            None => self.held_out(&self.after),
        };
        match judged {
            Some(after) => self.after = after,
            None => self.drop_all(&Reason::Diverges),
        }
        self.tests = super::tests(&self.after);
        let after_rms = self.after.compared_rms();
        // A guard model with a larger hold-out error is not confirmed.
        let is_borne_out = |guard: &GuardModel| guard.model.compared_rms() < after_rms;
        self.suspected = self.suspected.take().filter(is_borne_out);
        self.lower_noise_floor();
        self.confirm(threads);
        self.drop_weights(threads);
        let compared = self.weighted.as_ref().unwrap_or(&self.records);
        for model in [&mut self.before, &mut self.after] {
            *model = model.clone().with_coloured_std(compared);
        }
        let without = std::mem::take(&mut self.without);
        self.ladder = Ladder::of(&self.after, &self.before, without, &self.records, threads);
        Ok(())
    }

    /// The stand as declared, where the refitted one cannot be simulated on the hold-out records: something is missing that
    /// the fit of the declared effects made up for.
    fn declared_instead(&mut self) -> Result<ScoredModel, Failure> {
        let with_effects = |model: &&ScoredModel| model.fitted.structure.declared > 0;
        let declared = self.declared.as_ref().filter(with_effects);
        self.refit_diverges = true;
        declared.and_then(|model| self.held_out(model)).ok_or_else(|| {
            ErrorCode::NotIdentifiable.failed(
                "the plain stand cannot be simulated on the hold-out records; if the stand file has [[effects]], diagnose \
                 without one or all of them",
            )
        })
    }

    fn held_out(&self, model: &ScoredModel) -> Option<ScoredModel> {
        model.clone().compared_on_holdout(&self.records)
    }

    /// Hold-out errors of all candidates.
    fn judge_candidates(&mut self, threads: usize) {
        let all: Vec<&CandidateFit> = self.rounds.iter().flatten().collect();
        let judged = parallel(all.len(), threads, |k| {
            Some(self.held_out(all[k].model.as_ref()?)?.without_samples())
        });
        for (candidate, model) in self.rounds.iter_mut().flatten().zip(judged) {
            candidate.holdout_rms = model.as_ref().map(|model| model.errors().holdout_rms);
            if model.is_some() {
                candidate.model = model;
            }
        }
    }

    /// Removes the effects that the held-out records do not confirm.
    fn confirm(&mut self, threads: usize) {
        self.eliminate(threads);
        if self.after.effect_names().len() == 1 && no_gain(&self.after, &self.before).is_some() {
            let change = self.after.compared_rms() / self.before.compared_rms() - 1.0;
            self.drop_all(&Reason::NotConfirmed { change });
        }
    }

    /// Whether the compared records themselves show an effect of the model: switched off, with all other values kept, they
    /// have more left. One that acts in the training records only improves the others by the constants.
    pub(super) fn is_shown(&self, place: usize) -> bool {
        let fitted = &self.after.fitted;
        if fitted.structure.effects[place].is_line() {
            return true;
        }
        let (structure, values) = fitted.structure.reduced(&fitted.values, |k| k != place);
        let off = FittedModel {
            free: structure.model(&values).0.free_mode(),
            std: vec![None; values.len()],
            structure,
            values,
            ..fitted.clone()
        };
        let off = ScoredModel::of(off, &self.records);
        off.is_none_or(|off| no_gain(&self.after, &off).is_none())
    }

    /// Reverts to the plain stand.
    fn drop_all(&mut self, reason: &Reason) {
        let names = self.after.effect_names();
        for round in &mut self.rounds {
            reject_all(round, |_| Reason::NoneAccepted);
            for candidate in round.iter_mut().filter(|c| names.contains(&c.effect.name)) {
                candidate.reason = reason.clone();
            }
        }
        // A line or a drift belongs to its record, and correlated noise may look like one: its absence in other records
        // is no contradiction.
        let added = self.after.fitted.structure.added();
        self.is_refuted = !added.iter().all(EffectForm::is_disturbance);
        self.without.clear();
        self.after = self.before.clone();
        self.tests = self.tests_before.clone();
    }
}
