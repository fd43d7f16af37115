//! Verbal description of a diagnosis: the residual, the next experiment, warnings.

use super::SearchState;
use super::guard_models::GuardModel;
use super::moment::ChangedStand;
use super::noise_floor::NoiseFloorSource;
use super::reason::Status;
use super::refuse::plain_stands_apart;
use super::residual_tests::{FROM_INPUT, ResidualTests};
use super::result::ExcitationLevels;
use super::score::ScoredModel;
use super::search::CandidateFit;
use super::spectra::SpectralLine;
use super::structure::PlainStand;
use super::surface::ForceSurface;
use super::verdict::{Verdict, is_noise};
use crate::print::{self, relative, rounded};
use crate::warning::{Warning, WarningCode};

/// Ratio between levels of excitation above which errors are compared.
const LEVELS_DIFFER: f64 = 1.2;
/// Ratio between relative errors at two levels above which it is reported.
const ERRORS_DIFFER: f64 = 1.3;
/// Relative standard uncertainty of natural frequency and damping ratio above which the hold-out error is
/// inconclusive.
const MOST_UNCERTAIN: [f64; 2] = [0.005, 0.1];

/// Description of the residual after the diagnosis.
pub fn residual(
    found: &SearchState,
    verdict: Verdict,
    lines: &[SpectralLine],
    levels: &ExcitationLevels,
) -> String {
    let tests = &found.tests;
    let mut parts = Vec::new();
    if let Some(floor) = found.noise_floor {
        let ratio = found.after.compared_rms() / floor.rms;
        let ratio = match ratio < 10.0 {
            true => format!("{ratio:.2}"),
            false => rounded(ratio, 3),
        };
        parts.push(format!("{ratio} times the noise floor"));
    }
    parts.push(colour(tests));
    if found.is_coloured_noise(&found.after, tests) && !tests.white {
        parts.push(
            "coloured noise: the floor is that of white noise, and no effect explains a significant part of the rest"
                .to_owned(),
        );
    }
    parts.extend(in_training(found));
    if found.after.grows_with_level() {
        parts.push("larger in the records with larger motion, unlike noise".to_owned());
    }
    parts.extend(dependence(tests));
    parts.extend(spikes(tests));
    if let Some(share) = tests.nonstationary() {
        let is_hidden = |source| source == NoiseFloorSource::Periods;
        let is_hidden = found.noise_floor.is_some_and(|f| is_hidden(f.from));
        parts.push(format!(
            "{:.0} % of its power is explained by {}{}",
            100.0 * share.share.min(1.0),
            share.of,
            match is_hidden {
                true => " (the noise floor, from differences between periods, includes that)",
                false => "",
            }
        ));
    }
    parts.extend(moving_line(tests));
    if !found.settled && !found.after.effect_names().is_empty() {
        parts.push(
            "the effect found switches so fast that the integration step adds to the error; no second effect was tried"
                .to_owned(),
        );
    }
    let is_open = matches!(verdict, Verdict::Unexplained | Verdict::PartlyExplained);
    if is_open && !is_noise(&found.before, found.noise_floor) {
        parts.extend(level_dependence(levels));
    }
    let line = |line: &SpectralLine| format!("a line at {} Hz", rounded(line.frequency_hz, 5));
    parts.extend(lines.iter().map(line));
    parts.join("; ")
}

/// The spectrum of the residual in a word, if there is one.
fn colour(tests: &ResidualTests) -> String {
    match tests.first_order_noise {
        Some(correlation) => format!(
            "coloured as first-order noise, with a correlation of {correlation:.2} between neighbouring samples"
        ),
        None if tests.white => "white".to_owned(),
        None => "not white".to_owned(),
    }
}

/// An error that only the training records show.
fn in_training(found: &SearchState) -> Option<String> {
    let ratio = found.left_in_training(&found.after)?;
    Some(format!(
        "{} times the noise in the training records: something acts there that the hold-out records do not show",
        rounded(ratio, 3)
    ))
}

/// Spikes of the residual.
fn spikes(tests: &ResidualTests) -> Option<String> {
    let at = tests.spike_rate_hz.map_or_else(String::new, |rate_hz| {
        let rate_hz = rounded(rate_hz, 4);
        format!(", {rate_hz} per second, as from a switching drive or a commutator")
    });
    tests.has_spikes().then(|| {
        format!(
            "{:.0} % of its power is in 1 % of its samples: spikes{at}",
            100.0 * tests.in_largest_hundredth
        )
    })
}

/// A line of the residual that moves.
fn moving_line(tests: &ResidualTests) -> Option<String> {
    tests.moving_line.as_ref().map(|line| {
        format!(
            "a line that moves from {} to {} Hz, with {:.0} % of the power: an order of a speed that changes",
            rounded(line.from_hz, 3),
            rounded(line.to_hz, 3),
            100.0 * line.share
        )
    })
}

/// Dependence of the residual.
fn dependence(tests: &ResidualTests) -> Option<String> {
    match tests.dependence() {
        Some(share) => Some(format!(
            "{:.0} % of its power is explained by {}",
            100.0 * share.share,
            share.of
        )),
        // Changes over a record also make the residual depend on the motion in each part of it.
        None if tests.nonstationary().is_some() => None,
        None if !tests.independent_of_input => Some(format!(
            "correlated with the input (significant at 99 %), strongest at lag {}",
            tests.largest_lag
        )),
        None => Some("no dependence on input or motion detected".to_owned()),
    }
}

/// Whether the plain stand performs worse on records with another level of excitation.
fn level_dependence(levels: &ExcitationLevels) -> Option<String> {
    let applied = [levels.holdout_applied_rms, levels.train_applied_rms];
    if applied.contains(&0.0) {
        // A free decay has no level of excitation.
        return None;
    }
    let level = applied[0] / applied[1];
    let error = levels.holdout_relative / levels.train_relative;
    let differ = |ratio: f64, factor: f64| ratio.ln().abs() > factor.ln();
    (differ(level, LEVELS_DIFFER) && differ(error, ERRORS_DIFFER)).then(|| {
        format!(
            "the plain stand has an error of {} on the training records and {} on the hold-out records, at {} times \
             the excitation: the missing effect depends on amplitude",
            relative(levels.train_relative, 3),
            relative(levels.holdout_relative, 3),
            rounded(level, 3)
        )
    })
}

/// The next record to take.
pub fn next_experiment(
    found: &SearchState,
    suspected: Option<&GuardModel>,
    (change, surface): (Option<&ChangedStand>, Option<&ForceSurface>),
    verdict: Verdict,
) -> Option<String> {
    if change.is_some() {
        return Some(AFTER_A_CHANGE.to_owned());
    }
    if let Some(guard) = suspected {
        return Some(guard.effect.experiment.to_owned());
    }
    let all = found.rounds.iter().flatten();
    let tied = all.filter(|c| c.status() == Status::Indistinguishable);
    let mut tied: Vec<&str> = tied.map(|c| c.effect.experiment).collect();
    tied.dedup();
    if !tied.is_empty() {
        return Some(tied.join("; "));
    }
    if matches!(verdict, Verdict::Explained | Verdict::NothingMissing) {
        return None;
    }
    if let Some(surface) = surface {
        return Some(surface.experiment().to_owned());
    }
    if found.tests.spike_rate_hz.is_some() {
        return Some(
            "the same record with the motor's supply off, or with its cables away from those of the gage: are the spikes \
             still there?"
                .to_owned(),
        );
    }
    if found.tests.moving_line.is_some() {
        return Some("the same record at a constant speed, or with the motor off".to_owned());
    }
    if found.tests.nonstationary().is_some() {
        return Some(
            "the same record twice, cold and after an hour of running, and once at half the level: do the constants or the \
             noise differ?"
                .to_owned(),
        );
    }
    if found.left_in_training(&found.after).is_some() {
        return Some(
            "a held-out record at the level of the training records, as only these show the rest"
                .to_owned(),
        );
    }
    let follows = found.tests.dependence().map(|share| share.of);
    if let Some(of) = follows.filter(|of| *of != FROM_INPUT) {
        return Some(match of.contains("input") {
            true => PICKED_UP.to_owned(),
            false => shows_torque(of.contains("displacement")).to_owned(),
        });
    }
    let fitted = found.rounds.last()?.iter().filter(|c| c.model.is_some());
    let error = |c: &CandidateFit| c.train_rms.unwrap_or(f64::INFINITY);
    let closest = fitted.min_by(|a, b| error(a).total_cmp(&error(b)));
    closest.map(|c| c.effect.experiment.to_owned())
}

/// The next record after the stand has changed.
const AFTER_A_CHANGE: &str = "check clamps, bolts and anything else that may have moved at that moment, then repeat the record";

/// A record without the stand's response.
const PICKED_UP: &str = "the same input at half the level, and with the bridge unexcited or the stand decoupled: what is left then \
     does not come from the motion";

/// Records that show a torque as a function of displacement, or of speed.
pub fn shows_torque(over_displacement: bool) -> &'static str {
    match over_displacement {
        true => {
            "slow loading and unloading over the whole range, and the response at two more levels"
        }
        false => "free decays from several amplitudes, and the response at two more levels",
    }
}

/// Limitations of the diagnosis.
pub fn warnings(found: &SearchState, verdict: Verdict) -> Vec<Warning> {
    let before = &found.before;
    if found.refit_diverges {
        let diverges = WarningCode::DeclaredNotRefitted.warning(
            "with only the declared effects, the refitted stand diverges on the hold-out records; \"before\" is the stand \
             file as it is",
        );
        return vec![diverges];
    }
    let is_open = matches!(verdict, Verdict::PartlyExplained | Verdict::Unexplained);
    let apart = is_open.then(|| records_apart(before)).flatten();
    apart
        .into_iter()
        .chain(uncertain_constants(found))
        .collect()
}

/// Training and held-out records that no single stand fits.
fn records_apart(before: &ScoredModel) -> Option<Warning> {
    let stands = plain_stands_apart(before)?;
    Some(WarningCode::RecordsApart.warning(apart(&stands)))
}

/// Largest relative difference of natural frequency and damping ratio of one stand, and least one of two gains.
const ONE_STAND: [f64; 2] = [1e-3, 0.03];
const TWO_GAINS: f64 = 0.02;

/// Text about the plain stands of training and of held-out records.
fn apart([train, holdout]: &[PlainStand; 2]) -> String {
    let is_near = |a: f64, b: f64, most: f64| (a / b - 1.0).abs() < most;
    let times = holdout.gain / train.gain;
    let is_one = is_near(train.natural_hz, holdout.natural_hz, ONE_STAND[0])
        && is_near(train.damping_ratio, holdout.damping_ratio, ONE_STAND[1]);
    let cause = match is_one && !is_near(times, 1.0, TWO_GAINS) {
        true => format!(
            "Their natural frequencies and damping ratios agree, but the static gain of the hold-out records is {} times \
             that of the training records: {}",
            print::rounded(times, 4),
            match times < 0.0 {
                true => "a channel of one of them has the other sign",
                false => "they were recorded with other gains, or are in other units",
            }
        ),
        false => {
            "They are of two stands or settings, or the stand changes with the level".to_owned()
        }
    };
    format!(
        "no single plain stand fits both training and hold-out records: fitted separately, the training records give \
         {:.5} Hz and damping ratio {:.4}, the hold-out records {:.5} Hz and {:.4}. {cause}",
        train.natural_hz, train.damping_ratio, holdout.natural_hz, holdout.damping_ratio
    )
}

/// Constants too uncertain from the training records for the hold-out error to reveal a missing effect, or uncertain beside
/// effects that may stand in for them.
fn uncertain_constants(found: &SearchState) -> Option<Warning> {
    if let Some(open) = open_constants(&found.before) {
        return Some(WarningCode::TrainingLeavesConstantsOpen.warning(format!(
            "the training records determine {open}: that, and not a missing effect, may cause the hold-out error; \
             train on records that excite the resonance"
        )));
    }
    let open = open_constants(&found.after)?;
    Some(WarningCode::EffectsLeaveConstantsOpen.warning(format!(
        "with {}, the training records determine {open}: the effects make up for wrong constants, and their parameters \
         are as uncertain; keep the constants from a record without them, or train on more levels",
        found.after.effect_names().join(" and ")
    )))
}

/// The constants that a fit leaves open, as text.
fn open_constants(model: &ScoredModel) -> Option<String> {
    let constants = ["natural frequency", "damping ratio"];
    let constants = constants.into_iter().zip(MOST_UNCERTAIN).enumerate();
    let uncertain = constants.filter_map(|(k, (name, most))| {
        let fitted = &model.fitted;
        match fitted.std[k].map(|s| s / fitted.values[k].abs()) {
            Some(relative) if relative <= most => None,
            Some(relative) => Some(format!("the {name} to ± {}", print::relative(relative, 2))),
            None => Some(format!("the {name} not at all")),
        }
    });
    let uncertain: Vec<String> = uncertain.collect();
    (!uncertain.is_empty()).then(|| uncertain.join(" and "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_of_records_that_agree_otherwise_are_named() {
        let stand = |natural_hz, gain| PlainStand {
            natural_hz,
            damping_ratio: 0.02,
            gain,
        };
        for (natural_hz, gain, said) in [
            (
                179.9994,
                -0.08,
                "-1 times that of the training records: a channel of one",
            ),
            (
                180.0,
                0.16,
                "2 times that of the training records: they were recorded",
            ),
            (180.0, 0.08, "two stands or settings"),
            (171.0, -0.08, "two stands or settings"),
        ] {
            let text = apart(&[stand(180.0, 0.08), stand(natural_hz, gain)]);
            assert!(text.contains(said), "{text}");
        }
    }
}
