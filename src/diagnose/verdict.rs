//! Verdict: whether something is missing, and which effects are accepted.

use torqcomp_model::effects::Stage;

use super::SearchState;
use super::ladder::Ladder;
use super::noise_floor::{NoiseFloor, NoiseFloorSource};
use super::reason::{Reason, Status};
use super::residual_tests::ResidualTests;
use super::score::ScoredModel;
use super::search::{CandidateFit, reject_all};
use super::spectra::SpectralLine;

/// How a diagnosis ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// What was missing is found, nothing above the noise remains.
    Explained,
    /// An effect helps, and something above the noise remains.
    PartlyExplained,
    /// Something is missing, and no effect of the list explains it.
    Unexplained,
    /// The plain stand explains the records.
    NothingMissing,
}

impl Verdict {
    pub fn name(self) -> &'static str {
        match self {
            Self::Explained => "explained",
            Self::PartlyExplained => "partly-explained",
            Self::Unexplained => "unexplained",
            Self::NothingMissing => "nothing-missing",
        }
    }
}

/// Ratio of the error to the noise floor up to which nothing need be missing.
pub const AT_FLOOR: f64 = 1.1;
/// Ratio of the error to an out-of-band floor above which coloured noise cannot explain it.
const FAR_ABOVE: f64 = 1.5;
/// Ratio up to which it may be coloured noise, if nothing else contradicts that: first-order noise with a correlation
/// of 0.9 between samples is at four times the floor of white noise.
const MOST_COLOURED: f64 = 8.0;
/// Minimum fraction of the excess error power that a named effect must explain.
const NAMED: f64 = 0.5;
/// Ratio of the error to a noise floor from periods above which that fraction is known well enough
/// to require it.
const CLEARLY_ABOVE: f64 = 1.05;
/// Ratio of the error to the noise floor above which a remaining dependence on the input counts.
const ABOVE: f64 = 1.005;
/// Fraction of the records that a model leaves, above which it explains too little, whatever the noise, if the rest is
/// correlated with the input.
const MOST_LEFT: f64 = 0.5;
/// Ratio of a model's error to the noise in the training records, relative to that in the hold-out records, above which
/// something acts in the training records only.
const MORE_IN_TRAINING: f64 = 1.4;
/// 95 % coverage factor for the error due to uncertain constants.
const CERTAIN: f64 = 2.0;
/// Minimum fraction of the initial excess error power that a further named effect must explain.
const SECOND: f64 = 0.02;
/// The same for one that explains more than half of the remainder above the noise.
const SECOND_OF_REST: f64 = 0.01;
const MOST_OF_REST: f64 = 0.5;
/// Error power, relative to the noise, above which a further effect is named however little of the initial excess it
/// explains, if it explains this fraction of the remainder: after an effect that describes its cause exactly, the
/// remainder may be a small part of a large excess.
const FAR_ABOVE_NOISE: f64 = 10.0;
const GREAT_PART_OF_REST: f64 = 1.0 / 3.0;
/// An effect that explains this fraction of a measurable remainder above the noise is named however little of the
/// initial excess it is: one that imitates the remainder of another law leaves more. The noise floor has an error of
/// some per cent.
const NEARLY_ALL_OF_REST: f64 = 0.65;
/// Minimum measurable error power above the noise, relative to the noise.
const MEASURABLE: f64 = 0.1;

/// Excess error of the plain stand, and the noise in it.
#[derive(Clone, Copy)]
pub struct PlainExcess<'a> {
    pub before: &'a ScoredModel,
    pub noise_floor: Option<NoiseFloor>,
}

impl PlainExcess<'_> {
    /// Fraction of the plain stand's excess error power by which one model is better than another.
    fn share(&self, from: &ScoredModel, to: &ScoredModel) -> f64 {
        let excess = self.before.excess_power(noise_rms(self.noise_floor));
        (from.compared_rms().powi(2) - to.compared_rms().powi(2)) / excess.max(1e-300)
    }

    /// Fraction of it explained by a model.
    fn explained(&self, after: &ScoredModel) -> f64 {
        self.share(self.before, after)
    }

    /// Whether a further effect is not named although it passes, as it explains little of the whole and of the
    /// remainder: what no model describes exactly resembles many effects a little.
    pub fn is_too_small(&self, after: &ScoredModel, next: &ScoredModel) -> bool {
        let (left, gain) = self.left_and_gain(after, next);
        let noise = self.noise_floor.map(|floor| floor.rms.powi(2));
        if noise.is_some_and(|noise| gain >= FAR_ABOVE_NOISE * noise)
            && gain >= GREAT_PART_OF_REST * left
        {
            return false;
        }
        !self.is_nearly_taken(after, next) && self.is_little(after, next)
    }

    /// Error power of a model above the noise, and what another one takes of it.
    fn left_and_gain(&self, after: &ScoredModel, next: &ScoredModel) -> (f64, f64) {
        let gain = after.compared_rms().powi(2) - next.compared_rms().powi(2);
        (after.excess_power(noise_rms(self.noise_floor)), gain)
    }

    /// Whether further effects explain little of the whole.
    pub fn is_little(&self, after: &ScoredModel, next: &ScoredModel) -> bool {
        let (left, gain) = self.left_and_gain(after, next);
        let least = match gain < MOST_OF_REST * left {
            true => SECOND,
            false => SECOND_OF_REST,
        };
        self.share(after, next) < least
    }

    /// Whether further effects explain nearly all of the measurable remainder above the noise, or leave white noise only,
    /// which does not depend on the error of the noise floor: all of it, unless they are of stand or gage, as a slow trend
    /// explains a little of everything.
    pub fn is_nearly_taken(&self, after: &ScoredModel, next: &ScoredModel) -> bool {
        let (left, gain) = self.left_and_gain(after, next);
        let present = after.effect_names();
        let added = next.fitted.structure.added().iter();
        let mut further = added.filter(|own| !present.contains(&own.effect.name));
        let is_last = is_noise(next, self.noise_floor);
        let leaves_white =
            || is_last && super::tests(&next.clone().with_samples()).show_noise_only();
        is_above(after, self.noise_floor)
            && (gain > NEARLY_ALL_OF_REST * left || leaves_white())
            && (is_last || further.all(|own| own.form.stage <= Stage::Gage))
    }

    /// The reason for that.
    pub fn too_small() -> Reason {
        Reason::SmallSecond {
            least: SECOND,
            least_of_rest: SECOND_OF_REST,
            rest: MOST_OF_REST,
        }
    }
}

/// Half-width of the resonance, in half-bandwidths, within which noise has lines.
const RESONANCE: f64 = 10.0;

/// Whether the error is measurably above a noise floor.
pub fn is_above(model: &ScoredModel, floor: Option<NoiseFloor>) -> bool {
    floor.is_some_and(|floor| model.excess_power(floor.rms) > MEASURABLE * floor.rms.powi(2))
}

/// Whether a model leaves no more than the noise.
pub fn is_noise(model: &ScoredModel, floor: Option<NoiseFloor>) -> bool {
    floor.is_some_and(|floor| model.compared_rms() <= AT_FLOOR * floor.rms)
}

impl ScoredModel {
    /// A noise floor combined with the 95 % uncertainty due to the constants, which is limited to the noise, as otherwise
    /// unknown constants would excuse everything. They excuse nothing if the records to which they were fitted have more
    /// than noise left as well.
    fn with_uncertain(&self, floor: NoiseFloor) -> f64 {
        let is_fitted = self
            .over_noise_in_training(floor)
            .is_none_or(|ratio| ratio < AT_FLOOR);
        match is_fitted {
            true => floor
                .rms
                .hypot((CERTAIN * self.uncertain_rms).min(floor.rms)),
            false => floor.rms,
        }
    }

    /// The error in the training records over their noise floor, if that is of the same kind as another.
    fn over_noise_in_training(&self, floor: NoiseFloor) -> Option<f64> {
        let own = NoiseFloor::of(&self.train(), &self.fitted.passage())?;
        // Coloured noise is above one floor, but not above the other.
        (own.from == floor.from).then(|| self.train_rms() / own.rms)
    }
}

/// The known noise.
pub fn noise_rms(floor: Option<NoiseFloor>) -> f64 {
    floor.map_or(0.0, |f| f.rms)
}

/// Whether something above the noise is left. A noise level from differences between periods decides alone; one from
/// out of band may be too low for coloured noise, so the residual must also depend on input or motion, or be far above
/// it with another spectrum than first-order noise.
pub fn remains(model: &ScoredModel, tests: &ResidualTests, floor: Option<NoiseFloor>) -> bool {
    if tests.has_spikes() {
        // Spikes also raise a floor measured without a model.
        return true;
    }
    let is_dependent = tests.dependence().is_some();
    let Some(floor) = floor else {
        let explains_little = model.compared_rms() > MOST_LEFT * model.explainable_rms();
        return is_dependent || explains_little && !tests.independent_of_input;
    };
    let ratio = model.compared_rms() / model.with_uncertain(floor);
    let is_enough = match floor.from {
        NoiseFloorSource::Periods | NoiseFloorSource::Resolution => true,
        NoiseFloorSource::OutOfBand => {
            is_dependent || ratio > FAR_ABOVE && !tests.has_spectrum_of_noise()
        }
    };
    ratio > AT_FLOOR && is_enough
}

impl SearchState {
    /// Whether something is left, above the noise or hidden in it. Changes over a record also raise a floor from
    /// differences between its periods, while a rounding error changes with the signal by itself. They are no reason to
    /// look for a second effect, as no effect of the list causes them.
    fn leaves(&self, model: &ScoredModel, tests: &ResidualTests) -> bool {
        let is_above = remains(model, tests, self.noise_floor);
        let is_rounding = self.noise_floor.is_some_and(NoiseFloor::is_rounding);
        is_above && !self.is_coloured_noise(model, tests) || tests.changes() && !is_rounding
    }

    /// Whether the residual of the plain stand exceeds the noise floor only because that assumes white noise: no test
    /// detects a dependence on input or motion, no effect explains a significant part of the training residual, and it is
    /// not larger in the records with the larger motion. With an effect, its own remainder would look the same, and so would torques that were not looked for.
    pub(super) fn is_coloured_noise(&self, model: &ScoredModel, tests: &ResidualTests) -> bool {
        let error = model.compared_rms();
        let may_be = |floor: NoiseFloor| {
            floor.from == NoiseFloorSource::OutOfBand && error <= MOST_COLOURED * floor.rms
        };
        let is_plain = model.effect_names().is_empty();
        let sees_torques = model.fitted.structure.context.sees_torques;
        if !is_plain
            || !sees_torques
            || !self.noise_floor.is_some_and(may_be)
            || tests.follows_anything()
            || model.grows_with_level()
        {
            return false;
        }
        let round = self.rounds.first();
        round.is_some_and(|round| !round.iter().any(CandidateFit::is_confirmed))
    }

    /// A model's error in the training records in terms of their noise, if it is far larger than in the hold-out
    /// records: an effect of large motion, which smaller motion does not show.
    pub(super) fn left_in_training(&self, model: &ScoredModel) -> Option<f64> {
        let holdout = self.noise_floor?;
        let ratio = model.over_noise_in_training(holdout)?;
        let of_holdout = model.compared_rms() / holdout.rms;
        (ratio > MORE_IN_TRAINING * of_holdout.max(1.0)).then_some(ratio)
    }

    /// Whether a line is left besides the effects, above the noise and away from the resonance, in which noise has
    /// lines of its own.
    fn leaves_line(&self) -> bool {
        if !is_above(&self.after, self.noise_floor) {
            return false;
        }
        let mode = self.after.fitted.mode();
        let natural_hz = mode.natural_frequency_hz();
        let reach_hz = RESONANCE * mode.damping_ratio * natural_hz;
        let lines = self.lines_of(&self.after);
        let is_away = |line: &SpectralLine| (line.frequency_hz - natural_hz).abs() > reach_hz;
        lines.iter().any(is_away)
    }

    /// Whether only white noise is left.
    pub(super) fn is_at_noise(&self) -> bool {
        self.tests.show_noise_only() && is_noise(&self.after, self.noise_floor)
    }

    /// Whether only white noise is left, and no more than noise in the training records either.
    fn is_at_noise_everywhere(&self) -> bool {
        let ratio = self
            .noise_floor
            .and_then(|floor| self.after.over_noise_in_training(floor));
        self.is_at_noise() && ratio.is_some_and(|ratio| ratio <= AT_FLOOR)
    }

    /// Whether the final residual is above the noise, autocorrelated, and depends on the input, however
    /// little.
    fn follows_input(&self) -> bool {
        let error = self.after.compared_rms();
        let is_above = |f: NoiseFloor| error > ABOVE * self.after.with_uncertain(f);
        let is_above = self.noise_floor.is_some_and(is_above);
        is_above && !self.tests.white && !self.tests.independent_of_input
    }

    /// Whether the records do not determine the size of an effect, and more than noise is left: it imitates another cause.
    fn imitates(&self) -> bool {
        let structure = &self.after.fitted.structure;
        let mut added = structure.declared..structure.effects.len();
        !self.is_at_noise() && added.any(|k| self.after.insignificant_of(k).is_some())
    }

    /// The verdict; rejects the effects where they explain too little.
    pub fn conclude(&mut self) -> Verdict {
        let is_suspected = self.suspected.is_some();
        let is_unsettled = !self.settled && !self.is_at_noise();
        let surface = self.surface.as_ref();
        let is_outdone =
            self.is_outdone || surface.is_some_and(|asked| asked.outdoes_laws || asked.shows_lack);
        let is_known_left = is_unsettled || is_suspected || is_outdone;
        let is_left = is_known_left || self.leaves(&self.after, &self.tests);
        if self.after.effect_names().is_empty() {
            let is_left = self.leaves(&self.before, &self.tests_before);
            let is_left = is_left || self.left_in_training(&self.before).is_some();
            // What fits noise is not confirmed either.
            let is_refuted = self.is_refuted && !self.is_at_noise_everywhere();
            let is_missing = is_suspected || is_left || is_refuted || is_outdone;
            return match is_missing {
                true => Verdict::Unexplained,
                false => Verdict::NothingMissing,
            };
        }
        let explained = self.excess().explained(&self.after);
        let is_known = self.noise_floor.is_some_and(|floor| {
            floor.from == NoiseFloorSource::Periods
                && self.before.compared_rms() > CLEARLY_ABOVE * floor.rms
        });
        if explained >= NAMED || !is_left && !is_known {
            let is_left = is_left
                || self.follows_input()
                || self.leaves_line()
                || self.left_in_training(&self.after).is_some();
            return match is_left || self.imitates() {
                true => Verdict::PartlyExplained,
                false => Verdict::Explained,
            };
        }
        for tried in &mut self.rounds {
            reject_all(tried, |candidate| match candidate.status() {
                Status::Accepted => Reason::SmallPart { explained },
                _ => Reason::NoneAccepted,
            });
        }
        self.after = self.before.clone();
        self.tests = self.tests_before.clone();
        self.ladder = Ladder::default();
        Verdict::Unexplained
    }
}
