//! Laws beside the list: an effect is not named where one of them explains what it leaves.

use torqcomp_model::effects::{Effect, RIVALS};

use super::candidate::{Base, Judged, Records, choices};
use super::floor::Floor;
use super::search::{fit_all, refusal};
use super::structure::Choice;

/// A law that is not offered as an effect, fitted.
pub struct Rival<'a> {
    /// The law.
    pub law: &'static Effect,
    /// The model with it.
    pub judged: Judged<'a>,
}

/// Least significance with which a rival leaves less than an effect on the held-out records.
const LEAST_SIGNIFICANCE: f64 = 3.0;
/// Least fall of the criterion on all records from an effect to its rival.
const LEAST_FALL: f64 = 20.0;
/// Part of what an effect leaves above the noise that its rival may leave: half explained is not what is behind it.
const LEFT: f64 = 0.5;

/// The law that explains most, if it passes as an effect would and leaves less than the accepted one, if any, by
/// more than chance.
#[must_use]
pub fn best<'a>(
    base: &Base<'a>,
    accepted: Option<&Judged<'a>>,
    floor: Option<Floor>,
    records: &Records,
    threads: usize,
) -> Option<Rival<'a>> {
    let jobs: Vec<Choice> = RIVALS.iter().flat_map(|law| choices(law)).collect();
    let fits = fit_all(base, &jobs, &[], records, threads, &|_, _| {});
    let passing = jobs.iter().zip(fits).filter_map(|(choice, judged)| {
        let judged = judged.filter(|j| refusal(j, &base.judged).is_none())?;
        Some(Rival {
            law: choice.effect,
            judged,
        })
    });
    let best = passing.min_by(|a, b| {
        let left = |r: &Rival| r.judged.pooled_criterion();
        left(a).total_cmp(&left(b))
    })?;
    accepted
        .is_none_or(|accepted| outdoes(&best.judged, accepted, floor))
        .then_some(best)
}

fn outdoes(rival: &Judged, accepted: &Judged, floor: Option<Floor>) -> bool {
    let noise = floor.map_or(0.0, |f| f.rms.powi(2));
    let above = |judged: &Judged| judged.hold_rms().powi(2) - noise;
    rival.against(accepted).significance() >= LEAST_SIGNIFICANCE
        && rival.pooled_criterion() + LEAST_FALL <= accepted.pooled_criterion()
        && above(rival) <= LEFT * above(accepted)
}

impl Rival<'_> {
    /// Why an effect is not accepted beside this law.
    #[must_use]
    pub fn instead(&self, effect: &Judged) -> String {
        format!(
            "it helps, but leaves {:.3} times the held-out error of a law that is not among the effects: {} ({})",
            effect.hold_rms() / self.judged.hold_rms(),
            self.law.name,
            self.law.equation
        )
    }
}
