//! From the plain stand to one with effects: singles, pairs, one after the other; unnecessary effects are removed, and
//! guard models may contradict the remainder.

use super::SearchState;
use super::acceptance::{is_confirmed, no_gain, refusal};
use super::applied_noise::AppliedNoise;
use super::exchange::MANY;
use super::guard_models::GuardModel;
use super::noise_floor::{NoiseFloor, NoiseFloorSource};
use super::pairs::best_pairs;
use super::reason::{Reason, Status};
use super::records::Records;
use super::residual_tests::ResidualTests;
use super::score::{BaseModel, ScoredModel};
use super::search::{self, CandidateFit, Round, SAME, Workers, reject_all};
use super::verdict::{PlainExcess, is_above, noise_rms, remains};

/// Maximum number of added effects.
const MOST_EFFECTS: usize = 5;

/// Number of search paths followed: the second if the first leaves more than noise, or if it starts with a smaller
/// residual.
const WAYS: usize = 2;

/// Excess error power of the start of the next path, relative to that of the present one, below which it is followed
/// instead.
const BEHIND: f64 = 0.5;

/// Excess error power of a guard model, relative to that of the best effect, below which the search ends.
const FAR_LESS: f64 = 0.1;

/// Ratio of the error to the noise from differences between periods up to which only noise is left.
const ALL_NOISE: f64 = 1.005;

/// End of a search path.
struct Way {
    after: ScoredModel,
    tests: ResidualTests,
    settled: bool,
    rounds: Vec<Vec<CandidateFit>>,
    path: Vec<ScoredModel>,
}

impl SearchState {
    /// Adds effects to the plain stand. `coarse` is the number of integration steps of a simulation without effects.
    pub(super) fn build(&mut self, coarse: usize, workers: Workers) {
        let (plain, records) = (self.before.clone(), self.records.clone());
        let base = BaseModel::of(plain.clone(), &records);
        let mut round = search::try_all(&base, &self.records, workers);
        let is_rounding = self.noise_floor.is_some_and(NoiseFloor::is_rounding);
        if is_rounding && !self.is_worthwhile(&plain, &self.tests_before) {
            reject_all(&mut round.tried, |_| Reason::BelowResolution);
            self.rounds.push(round.tried);
            return;
        }
        self.rounds.push(round.tried.clone());
        if let Some(guard) = self.only_law(&base, round.accepted(), workers) {
            return self.withdraw(guard, self.before.clone());
        }
        let mut starts = self.starts(&base, &round, workers);
        starts.truncate(WAYS);
        drop((base, round));
        let mut best: Option<Way> = None;
        for (k, start) in starts.iter().enumerate() {
            let beats = |best: &Way| {
                let is_open = remains(&best.after, &best.tests, self.noise_floor);
                is_open || start.criterion() < best.after.criterion()
            };
            if !best.as_ref().is_none_or(beats) {
                continue;
            }
            let way = self.follow((start, starts.get(k + 1)), coarse, workers);
            let criterion = way.after.criterion();
            if best
                .as_ref()
                .is_none_or(|best| criterion < best.after.criterion())
            {
                best = Some(way);
            }
        }
        if let Some(way) = best {
            self.arrive(way);
            self.weigh();
        }
        // Once an effect that only resembled another is gone, what it hid may appear, and be exchanged
        // in turn.
        while self.restart(coarse, workers)
            | self.exchange(coarse, workers)
            | self.exchange_with_gain(coarse, workers)
        {
            let count = self.after.effect_names().len();
            while self.has_room() && self.add_another(coarse, workers) {}
            if self.after.effect_names().len() == count {
                break;
            }
        }
        self.eliminate(workers.threads);
        self.judge_ties(workers);
        self.report_exchanged();
        self.ask_guards((&plain, &records), workers);
    }

    /// A guard model that leaves only noise, or far less than the best effect: several effects in its place would only
    /// imitate it.
    fn only_law(
        &mut self,
        base: &BaseModel,
        best: Option<&ScoredModel>,
        workers: Workers,
    ) -> Option<GuardModel> {
        let rival = best.unwrap_or(&self.before).clone().with_samples();
        if !self.is_worthwhile(&rival, &super::tests(&rival)) {
            return None;
        }
        let noise_rms = noise_rms(self.noise_floor);
        let fits = self.rivals(base, workers);
        let guard = GuardModel::best(fits, &base.scored, best, noise_rms);
        guard.filter(|guard| {
            let left = guard.model.excess_power(noise_rms);
            left <= FAR_LESS * rival.excess_power(noise_rms)
                || !self.is_worthwhile(&guard.model, &super::tests(&guard.model))
        })
    }

    /// The plain stand with each guard model, refitted only for a different number of integration steps.
    fn rivals(&mut self, base: &BaseModel, workers: Workers) -> Vec<ScoredModel> {
        let steps = self.records.substeps();
        if self.rivals.as_ref().is_none_or(|(of, _)| *of != steps) {
            self.rivals = Some((steps, GuardModel::fits(base, &self.records, workers)));
        }
        self.rivals
            .iter()
            .flat_map(|(_, fits)| fits)
            .cloned()
            .collect()
    }

    /// Starts of the search paths: the best effect, and the best pair if that explains more; the pair comes first if it
    /// does not contain the best effect.
    fn starts(&self, base: &BaseModel, round: &Round, workers: Workers) -> Vec<ScoredModel> {
        let single = round.accepted();
        let tests = single.map(super::tests);
        let best = single.zip(tests.as_ref());
        let (model, tests) = best.unwrap_or((&self.before, &self.tests_before));
        // An effect with many parameters may imitate two others.
        let is_simple = single.is_none_or(|m| m.fitted.structure.added()[0].moved() < MANY);
        if is_simple && !self.is_worthwhile(model, tests) {
            return single.cloned().into_iter().collect();
        }
        let mut starts = best_pairs(base, &round.fits, &self.records, workers);
        let noise = AppliedNoise::of(&self.records);
        // Of two equivalent descriptions, the one with fewer parameters: a pair may replace an effect with many.
        let is_simpler = |pair: &ScoredModel| {
            pair.parameter_count() < model.parameter_count()
                && pair.criterion() < model.criterion() + SAME
                && refusal(pair, &self.before).is_none()
        };
        starts.retain(|pair| {
            is_simpler(pair) || refusal(pair, model).is_none() && noise.bears_out(model, pair)
        });
        if let Some(single) = single {
            // With the best effect all others are compared, including ties.
            let name = single.effect_names()[0];
            let is_part = |pair: &ScoredModel| pair.effect_names().contains(&name);
            let place = usize::from(!starts.is_empty() && !starts.iter().any(is_part));
            starts.insert(place, single.clone());
        }
        starts
    }

    /// Follows a search path from its start to further effects, unless the start of the next path explains far more with
    /// no more effects.
    fn follow(
        &mut self,
        (start, other): (&ScoredModel, Option<&ScoredModel>),
        coarse: usize,
        workers: Workers,
    ) -> Way {
        let rounds = self.rounds.clone();
        self.path.clear();
        self.take(start, coarse);
        let noise_rms = noise_rms(self.noise_floor);
        let is_behind = |after: &ScoredModel| {
            let far_more = |other: &ScoredModel| {
                other.effect_names().len() <= after.effect_names().len()
                    && other.excess_power(noise_rms) < BEHIND * after.excess_power(noise_rms)
            };
            other.is_some_and(far_more)
        };
        while self.has_room() && !is_behind(&self.after) && self.add_another(coarse, workers) {}
        Way {
            after: self.after.clone(),
            tests: self.tests.clone(),
            settled: self.settled,
            rounds: std::mem::replace(&mut self.rounds, rounds),
            path: std::mem::take(&mut self.path),
        }
    }

    /// Adopts the end of a search path.
    fn arrive(&mut self, way: Way) {
        self.after = way.after;
        self.tests = way.tests;
        self.settled = way.settled;
        self.rounds = way.rounds;
        self.path = way.path;
    }

    /// Adds one more effect; returns whether there was one.
    fn add_another(&mut self, coarse: usize, workers: Workers) -> bool {
        let base = BaseModel::of(self.after.clone(), &self.records);
        let round = search::try_all(&base, &self.records, workers);
        let accepted = round.accepted();
        // If little is left, the effect must explain nearly all of it.
        let is_little = !self.is_worthwhile(&self.after, &self.tests);
        let excess = self.excess();
        let next = accepted.filter(|next| match is_little {
            true => excess.is_nearly_taken(&self.after, next),
            false => !excess.is_too_small(&self.after, next),
        });
        let next = next.cloned();
        let mut tried = round.tried;
        if next.is_none() {
            reject_all(&mut tried, |_| PlainExcess::too_small());
        }
        self.rounds.push(tried);
        if let Some(next) = &next {
            self.take(next, coarse);
        }
        next.is_some()
    }

    /// Adopts a model as the current one with effects.
    pub(super) fn take(&mut self, next: &ScoredModel, coarse: usize) {
        let next = next.with_modes_fitted(&self.records);
        let after;
        (after, self.settled) = next.refine_step(&mut self.records, coarse);
        self.after = after.with_samples();
        self.tests = super::tests(&self.after);
        self.path.push(self.after.clone().without_samples());
    }

    /// Whether to look for another effect: not with a law for which the integration does not converge.
    pub(super) fn has_room(&self) -> bool {
        let count = self.after.effect_names().len();
        let is_open = (1..MOST_EFFECTS).contains(&count) && self.settled;
        let (after, floor) = (&self.after, self.noise_floor);
        is_open && (self.is_worthwhile(after, &self.tests) || is_above(after, floor))
    }

    /// Whether a model leaves enough for another effect: something above the noise, more of it in the training records, or
    /// a residual that is not just noise and exceeds the differences between periods. A rounding error is neither white nor
    /// independent of the input.
    pub(super) fn is_worthwhile(&self, model: &ScoredModel, tests: &ResidualTests) -> bool {
        let floor = self.noise_floor;
        if floor.is_some_and(NoiseFloor::is_rounding) {
            return remains(model, tests, floor);
        }
        let is_noise = tests.has_spectrum_of_noise() && tests.independent_of_input;
        let of_periods = floor.filter(|floor| floor.from == NoiseFloorSource::Periods);
        let is_at_floor =
            of_periods.is_some_and(|floor| model.compared_rms() <= ALL_NOISE * floor.rms);
        // Anything not periodic with the input is part of that floor.
        let is_at_floor = is_at_floor && !tests.drifts() && self.lines_of(model).is_empty();
        remains(model, tests, floor)
            || !is_noise && !is_at_floor
            || self.left_in_training(model).is_some()
    }

    /// Removes unnecessary effects. Known fits of the model without each of its effects are reused.
    pub(super) fn eliminate(&mut self, threads: usize) {
        while self.after.effect_names().len() > 1 {
            if self.without.is_empty() {
                self.without = self.after.without_each(&self.records, threads);
            }
            let Some(k) = self.needless(&self.without) else {
                return;
            };
            let names = self.after.effect_names();
            let without = std::mem::take(&mut self.without).into_iter().nth(k);
            let Some(less) = without.flatten() else {
                break;
            };
            let less = less.simplified(&self.records, threads);
            let others = less.effect_names().join(" + ");
            for tried in self.rounds.iter_mut().flatten() {
                if tried.effect.name == names[k] && tried.status() == Status::Accepted {
                    tried.reason = Reason::Needless {
                        others: others.clone(),
                    };
                }
            }
            self.after = less.with_samples();
            self.tests = super::tests(&self.after);
        }
    }

    /// The least needed effect, if its removal is not significant. How much an effect must explain is decided by the training
    /// records: held-out ones, fewer or of another kind, may show less of it, but must show it.
    fn needless(&self, without: &[Option<ScoredModel>]) -> Option<usize> {
        let (after, excess) = (&self.after, self.excess());
        let noise = AppliedNoise::of(&self.records);
        let declared = after.fitted.structure.declared;
        let is_training = self.records.holdout.is_empty();
        let has_no_gain = |less: &ScoredModel| match is_training {
            true => no_gain(after, less).is_some(),
            false => !is_confirmed(after, less),
        };
        let is_needless = |k: usize, less: &ScoredModel| {
            has_no_gain(less)
                || after.insignificant_of(declared + k).is_some()
                || after.criterion() >= less.criterion()
                || is_training && excess.is_too_small(less, after)
                || !is_training && excess.is_little(less, after) && !self.is_shown(declared + k)
                || !noise.bears_out(less, after)
        };
        let all = without.iter().enumerate();
        let models = all.filter_map(|(k, less)| Some((k, less.as_ref()?)));
        let needless = models.filter(|(k, less)| is_needless(*k, less));
        let least = needless.min_by(|(_, a), (_, b)| a.criterion().total_cmp(&b.criterion()));
        least.map(|(k, _)| k)
    }

    /// Tests whether guard models explain more: than all effects, than each of several, and in addition to all.
    fn ask_guards(&mut self, (plain, of): (&ScoredModel, &Records), workers: Workers) {
        let noise_rms = noise_rms(self.noise_floor);
        let count = self.after.effect_names().len();
        let is_left = remains(&self.after, &self.tests, self.noise_floor);
        if count == 0 && !is_left {
            return;
        }
        let against = (count > 0).then_some(self.after.clone());
        let fits = self.rivals(&BaseModel::of(plain.clone(), of), workers);
        if let Some(guard) = GuardModel::best(fits, plain, against.as_ref(), noise_rms) {
            self.withdraw(guard, self.before.clone());
            return;
        }
        // An effect with many parameters may imitate such a law down to the noise.
        let added = self.after.fitted.structure.added();
        let is_asked = |k: usize| is_left || added[k].moved() >= MANY;
        if !(0..count).any(is_asked) {
            return;
        }
        let records = &self.records;
        let beside = |model: &ScoredModel, against: Option<&ScoredModel>| {
            let base = BaseModel::of(model.clone(), records);
            let fits = GuardModel::fits(&base, records, workers);
            GuardModel::best(fits, model, against, noise_rms)
        };
        let each = self.without.iter().enumerate();
        let instead = each
            .filter(|(k, _)| is_asked(*k))
            .filter_map(|(_, less)| less.as_ref())
            .find_map(|less| Some((beside(less, against.as_ref())?, less.clone())));
        match instead {
            Some((guard, less)) => self.withdraw(guard, less),
            None if is_left => self.suspected = beside(&self.after, None),
            None => {}
        }
    }

    /// Reverts to a model with fewer effects, as a guard model explains more than the others.
    fn withdraw(&mut self, guard: GuardModel, less: ScoredModel) {
        let kept = less.effect_names();
        for round in &mut self.rounds {
            let is_named = |name: &str| kept.contains(&name);
            for candidate in round.iter_mut().filter(|c| !is_named(c.effect.name)) {
                reject_all(std::slice::from_mut(candidate), |c| guard.instead_of(c));
            }
        }
        self.after = less.with_samples();
        self.tests = super::tests(&self.after);
        self.without.clear();
        self.suspected = Some(guard);
    }

    /// Residual of the plain stand, and the noise in it.
    pub(super) fn excess(&self) -> PlainExcess<'_> {
        PlainExcess {
            before: &self.before,
            noise_floor: self.noise_floor,
        }
    }

    /// Updates the candidates to the finally accepted effects.
    pub(super) fn settle_candidates(&mut self) {
        let names = self.after.effect_names();
        let left = self.after.train_rms();
        let all = names.join(" + ");
        for candidate in self.rounds.iter_mut().flatten() {
            let is_stale = match &candidate.reason {
                Reason::Best => !names.is_empty(),
                Reason::Tied { best, .. } | Reason::MoreParameters { best } => {
                    !names.is_empty() && !names.contains(best)
                }
                _ => false,
            };
            if let Some(model) = candidate.model.as_ref().filter(|_| is_stale) {
                candidate.reason = Reason::Worse {
                    ratio: model.train_rms() / left,
                    best: all.clone(),
                };
            }
        }
        let declared = self.after.fitted.structure.declared;
        let parameters = self.after.parameters().split_off(declared);
        let (added, errors) = (self.after.fitted.structure.added(), self.after.errors());
        for (k, (effect, own)) in added.iter().zip(parameters).enumerate() {
            let entries = self.rounds.iter_mut().flatten();
            let named = entries.filter(|c| c.effect.name == effect.effect.name);
            let Some(entry) = named.filter(|c| c.model.is_some()).last() else {
                continue;
            };
            entry.reason = Reason::Best;
            entry.form = Some(effect.form.name);
            entry.with = names[..k].to_vec();
            entry.parameters = own;
            if k + 1 == names.len() {
                entry.train_rms = Some(errors.train_rms);
                entry.holdout_rms = Some(errors.holdout_rms);
            }
        }
    }
}
