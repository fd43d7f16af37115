//! What a diagnosis comes to: whether something is left, which names stand, and the verdict.

use super::Diagnosis;
use super::candidate::Judged;
use super::dependence::Dependence;
use super::floor::Floor;
use super::rivals::Rival;
use super::search::{Status, Tried};

/// How the search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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
    /// Its name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Explained => "explained",
            Self::PartlyExplained => "partly-explained",
            Self::Unexplained => "unexplained",
            Self::NothingMissing => "nothing-missing",
        }
    }
}

/// Error over the noise floor up to which nothing needs to be missing.
const AT_FLOOR: f64 = 1.1;
/// Error over a floor from out of band above which no colour of the noise accounts for it.
const FAR_ABOVE: f64 = 1.5;
/// Part of what is missing that an effect must explain to be named.
const NAMED: f64 = 0.5;
/// Error over a noise floor that was seen, from which on that part is known well enough to ask for it.
const CLEARLY_ABOVE: f64 = 1.05;
/// Error over the noise floor above which what follows the input is left and not by chance.
const ABOVE: f64 = 1.005;
/// Part of what is missing at first that a second effect must explain to be named.
const SECOND: f64 = 0.02;

/// What the records hold at first: how much the plain stand leaves, and the noise in it.
#[derive(Clone, Copy)]
pub(super) struct Missing<'a, 'b> {
    /// The plain stand.
    pub before: &'b Judged<'a>,
    /// The noise.
    pub floor: Option<Floor>,
}

impl Missing<'_, '_> {
    /// Part of what the plain stand leaves above the noise that one model explains more than another.
    fn share(&self, from: &Judged, to: &Judged) -> f64 {
        let noise = self.floor.map_or(0.0, |f| f.rms.powi(2));
        let missing = self.before.hold_rms().powi(2) - noise;
        (from.hold_rms().powi(2) - to.hold_rms().powi(2)) / missing.max(1e-300)
    }

    /// Part that a model explains of it.
    fn explained(&self, after: &Judged) -> f64 {
        self.share(self.before, after)
    }

    /// Whether one more effect explains too little to be named.
    pub fn is_little(&self, after: &Judged, next: &Judged) -> bool {
        self.share(after, next) < SECOND
    }

    /// Whether another effect could be named beside those found: not where little is explained, nor where next to
    /// nothing is left.
    pub fn has_room(&self, after: &Judged) -> bool {
        (NAMED..1.0 - SECOND).contains(&self.explained(after))
    }
}

/// Whether something above the noise is left. Where the noise itself was seen, in the differences of periods, its level
/// decides; a level from out of band may be too low for coloured noise, so that there the residual must also
/// follow from input or motion, or lie far above it.
pub(super) fn remains(judged: &Judged, dependence: &Dependence, floor: Option<Floor>) -> bool {
    if dependence.has_spikes() {
        // Spikes raise a floor that is measured without a model as well.
        return true;
    }
    let structured = dependence.structure().is_some();
    let Some(floor) = floor else {
        return structured;
    };
    let ratio = judged.hold_rms() / floor.rms;
    match floor.from {
        "periods" => ratio > AT_FLOOR,
        _ => ratio > AT_FLOOR && (structured || ratio > FAR_ABOVE && !dependence.white),
    }
}

/// Whether effects leave more than they should of what they are to explain, little as it may be: what is left is above
/// the noise, has a colour, and follows the input.
fn follows_input(judged: &Judged, dependence: &Dependence, floor: Option<Floor>) -> bool {
    let is_above = floor.is_some_and(|floor| judged.hold_rms() > ABOVE * floor.rms);
    is_above && !dependence.white && !dependence.independent_of_input
}

/// A second effect that explains next to nothing of what was missing at first is not named: what no model has
/// exactly looks a little like many effects.
pub(super) fn refuse_second(tried: &mut [Tried]) {
    take_back(tried, |_| {
        format!(
            "it explains less than {:.0} % of what was missing at first: too little to be named beside the first effect",
            100.0 * SECOND
        )
    });
}

/// Effects that a law beside the list explains better are not named.
pub(super) fn stand_back(tried: &mut [Tried], rival: &Rival) {
    take_back(tried, |one| {
        let judged = one.judged.as_ref();
        judged.map_or_else(String::new, |judged| rival.instead(judged))
    });
}

/// Rejects what has not been rejected yet.
fn take_back(tried: &mut [Tried], why: impl Fn(&Tried) -> String) {
    let named = tried.iter_mut().filter(|t| t.status != Status::Rejected);
    for one in named {
        one.why = why(one);
        one.status = Status::Rejected;
    }
}

impl Diagnosis<'_> {
    /// Sets the verdict; takes the names back where they explain too little.
    pub(super) fn conclude(&mut self) {
        // What changes over a record raises a floor that is taken from differences of its periods, too. It is not a
        // reason to look for a second effect: none of the list does that.
        let open = |judged: &Judged, dependence: &Dependence| {
            remains(judged, dependence, self.floor) || dependence.unsteady().is_some()
        };
        let left = !self.settled || self.suspected.is_some() || open(&self.after, &self.dependence);
        if self.effects().is_empty() {
            let missing = self.suspected.is_some() || open(&self.before, &self.dependence_before);
            self.verdict = if missing {
                Verdict::Unexplained
            } else {
                Verdict::NothingMissing
            };
            return;
        }
        let missing = Missing {
            before: &self.before,
            floor: self.floor,
        };
        let explained = missing.explained(&self.after);
        let known = |floor: Floor| {
            floor.from == "periods" && self.before.hold_rms() > CLEARLY_ABOVE * floor.rms
        };
        if explained >= NAMED || !left && !self.floor.is_some_and(known) {
            let follows = follows_input(&self.after, &self.dependence, self.floor);
            self.verdict = if left || follows {
                Verdict::PartlyExplained
            } else {
                Verdict::Explained
            };
            return;
        }
        self.name_none(explained);
    }

    fn name_none(&mut self, explained: f64) {
        self.verdict = Verdict::Unexplained;
        for tried in &mut self.rounds {
            take_back(tried, |one| match one.status {
                Status::Accepted => format!(
                    "it helps, but explains only {:.0} % of what is missing: something else is behind it",
                    100.0 * explained.max(0.0)
                ),
                _ => "no effect is accepted".to_owned(),
            });
        }
        self.after = self.before.clone();
        self.dependence = self.dependence_before.clone();
    }
}
