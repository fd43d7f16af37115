//! A diagnosis as text.

use torqcomp_model::Estimate;
use torqcomp_model::effects::Effect;

use super::checks::{load_sentences, running_sentences};
use crate::diagnose::{
    AT_FLOOR, CandidateFit, ChangedStand, Diagnosis, ForceSurface, GuardModel, NoiseFloorSource,
    ShownSide, Status, SurfacePlace, Verdict,
};
use crate::print::{
    Report, columns, enumeration, plural, relative, rounded, unit_or_as_recorded, with_std,
};

/// Number of candidates listed by default.
const FIRST: usize = 5;

impl Report for Diagnosis {
    const SCHEMA: &'static str = "torqcomp.diagnose/1";

    fn text(&self) -> String {
        let effects = match self.effects.is_empty() {
            true => "none".to_owned(),
            false => self.effects.join(", "),
        };
        let declared = match self.declared_effects.as_slice() {
            [] => String::new(),
            some => format!("declared effects, refitted: {}\n", some.join(", ")),
        };
        let mut text = format!(
            "verdict: {}\neffects: {effects}\n{declared}{}\n\n{}{}\n{}\n{}{}\n",
            self.verdict.name(),
            answer(self).join("\n"),
            columns(&error_rows(self)),
            error_sentences(self).join("\n"),
            [load_sentences(self), running_sentences(self)]
                .concat()
                .iter()
                .fold(String::new(), |text, line| text + line + "\n"),
            several(self),
            columns(&constant_rows(self))
        );
        let (first, others) = candidates(self);
        text.extend(first.into_iter().map(candidate));
        match self.shows_all {
            true => text.extend(others.into_iter().map(candidate)),
            false if others.is_empty() => {}
            false => {
                let more = plural(others.len(), "more candidate");
                text += &format!("{more}; --all lists them\n");
            }
        }
        text += &format!("\nresidual: {}\n", self.residual.described);
        if !self.detection_limits.is_empty() {
            text += &format!("\n{WOULD_SHOW}\n\n");
            for row in &limit_rows(self)[1..] {
                let at = match row[2].as_str() {
                    "" => String::new(),
                    at => format!(", at {at}"),
                };
                text += &format!("{}: {}{at}\n", row[0], row[1]);
            }
        }
        text
    }
}

/// Ratio of the hold-out error to the noise floor above which the floor is doubtful.
const ABOVE_FLOOR: f64 = 1.5;

/// Ratio of a hold-out error to the noise floor; 1 if that is unknown.
fn over_floor(diagnosis: &Diagnosis, holdout_rms: f64) -> f64 {
    let floor = diagnosis.error.noise_floor_rms;
    let floor = floor.filter(|floor| *floor > 0.0);
    floor.map_or(1.0, |floor| holdout_rms / floor)
}

/// The verdict that effects explain the records.
fn all_explained(diagnosis: &Diagnosis, names: &str) -> String {
    let ratio = over_floor(diagnosis, diagnosis.error.after.rms.holdout_rms);
    if ratio <= AT_FLOOR {
        return format!("Explained: with {names}, the hold-out error is at the noise level.");
    }
    format!(
        "Explained: with {names}, the hold-out error is {} times the noise floor, and no test shows a cause of the rest. \
         Record the stand at rest: if that is quieter, something is still missing.",
        rounded(ratio, 3)
    )
}

/// The verdict that nothing is missing. An error above the floor of white noise can be coloured noise, or an effect that
/// no test shows.
fn nothing_missing(diagnosis: &Diagnosis) -> String {
    let ratio = over_floor(diagnosis, diagnosis.error.before.rms.holdout_rms);
    if ratio <= ABOVE_FLOOR {
        return "Nothing missing: the plain stand explains the hold-out records down to the noise."
            .to_owned();
    }
    format!(
        "No missing effect detected, but the hold-out error is {} times the noise floor, as coloured noise or an \
         undetected effect would cause. Record the stand at rest: if that is quieter, something is missing.",
        rounded(ratio, 3)
    )
}

/// Findings and remedy: the verdict, each effect with its equation, the next record.
pub fn answer(diagnosis: &Diagnosis) -> Vec<String> {
    let names = enumeration(&diagnosis.effects, "and");
    let reduce = match diagnosis.effects.len() {
        1 => "reduces",
        _ => "reduce",
    };
    let verdict = match diagnosis.verdict {
        Verdict::Explained => all_explained(diagnosis, &names),
        Verdict::PartlyExplained => format!(
            "Partly explained: {names} {reduce} the hold-out error, but structure above the noise remains."
        ),
        Verdict::NothingMissing => nothing_missing(diagnosis),
        Verdict::Unexplained => {
            "Unexplained: something is missing, and no effect in the list explains it.".to_owned()
        }
    };
    let effects = diagnosis.after.fitted.structure.effects.iter();
    let added = effects.filter(|own| diagnosis.effects.contains(&own.effect.name));
    let added = added.map(|own| explained(own.effect, own.form.law));
    let guard = diagnosis.suspected.iter().flat_map(|guard| {
        let suspected = format!("Suspected: {}.", suspected(guard));
        [suspected, explained(guard.effect, guard.equation)]
    });
    let change = diagnosis.changed_stand.iter().map(of_change);
    let surface = diagnosis.force_surface.iter();
    let surface = surface.flat_map(|surface| of_surface(surface, &diagnosis.error.unit));
    let next = diagnosis.next_experiment.iter().map(|next| {
        let end = if next.ends_with('?') { "" } else { "." };
        format!("Next experiment: {next}{end}")
    });
    let all = std::iter::once(verdict).chain(added).chain(guard);
    all.chain(change).chain(surface).chain(next).collect()
}

/// The time at which the stand changed.
fn of_change(change: &ChangedStand) -> String {
    let constants = change.constants.iter().filter(|c| c.is_significant());
    let constants: Vec<String> = constants
        .map(|c| {
            let share = relative((c.after - c.before) / c.before, 2);
            let values = [c.before, c.after].map(|value| rounded(value, 5));
            let [before, after] = values;
            let unit = if c.unit.is_empty() { "" } else { " " };
            format!(
                "{} from {before} to {after}{unit}{} ({share})",
                c.name, c.unit
            )
        })
        .collect();
    format!(
        "The stand changed {} s after the first sample of {}: {}. With separate stands before and after it the \
         residual of that record is {} {}, instead of {} with one stand throughout.",
        rounded(change.time_s, 5),
        change.record,
        enumeration(&constants, "and"),
        rounded(change.two_stands_rms, 4),
        unit_or_as_recorded(&change.unit),
        rounded(change.one_stand_rms, 4),
    )
}

/// Text about a surface over the motion.
fn of_surface(surface: &ForceSurface, unit: &str) -> Vec<String> {
    let place = match surface.place {
        SurfacePlace::Stand => "a torque in the stand",
        SurfacePlace::GagePath => "a torque in the part that carries the gage",
        SurfacePlace::Gage => "a change in the gage or its amplifier",
    };
    let named = match surface.outdoes_laws {
        true => " No law is named, as it explains far more than the best of them.",
        false => "",
    };
    let nearest = match surface.nearest.as_slice() {
        [] => String::new(),
        some => format!(" Closest, as hypotheses: {}.", enumeration(some, "and")),
    };
    vec![
        format!(
            "Without an assumed law: {place} as a function of displacement and speed, including the accepted effects, \
             leaves an rms residual of {} {} on the hold-out records (computed along their measured motion).{named}",
            rounded(surface.holdout_rms, 4),
            unit_or_as_recorded(unit)
        ),
        format!(
            "It looks like {}.{nearest}",
            enumeration(&surface.looks_like, "and")
        ),
    ]
}

/// An effect in two sentences with its equation.
fn explained(effect: &Effect, law: &str) -> String {
    format!(
        "{}, {law}. {} {}",
        effect.name, effect.meaning, effect.remedy
    )
}

/// The candidates listed first, including the accepted ones, and the others.
pub fn candidates(diagnosis: &Diagnosis) -> (Vec<&CandidateFit>, Vec<&CandidateFit>) {
    let (mut all, others): (Vec<_>, Vec<_>) = diagnosis
        .candidates
        .iter()
        .partition(|c| c.status() == Status::Accepted);
    let first = FIRST.max(all.len());
    all.extend(others);
    let others = all.split_off(first.min(all.len()));
    (all, others)
}

/// A guard model in words.
pub fn suspected(guard: &GuardModel) -> String {
    let with = match guard.with.is_empty() {
        true => String::new(),
        false => format!(" beside {}", guard.with.join(" and ")),
    };
    format!(
        "{} ({}){with}, with a hold-out error of {} {}; it is not in the list of effects and is not added",
        guard.effect.name,
        guard.equation,
        rounded(guard.errors.holdout_rms, 4),
        unit_or_as_recorded(&guard.unit)
    )
}

/// The error with an increasing number of effects, and the contribution of each, if there are several.
fn several(diagnosis: &Diagnosis) -> String {
    if diagnosis.effects.len() < 2 {
        return String::new();
    }
    let mut text = columns(&ladder_rows(diagnosis)) + "\n" + &columns(&share_rows(diagnosis));
    text += SHARES_OVERLAP;
    text.push('\n');
    for pair in &diagnosis.explained.correlations {
        let [one, other] = pair.effects;
        text += &format!(
            "Correlation of the separate contributions of {one} and {other}: {}.\n",
            rounded(pair.correlation, 2)
        );
    }
    text + "\n"
}

/// The hold-out error with an increasing number of effects, with a heading.
pub fn ladder_rows(diagnosis: &Diagnosis) -> Vec<Vec<String>> {
    let head = format!("rms error, {}", unit_or_as_recorded(&diagnosis.error.unit));
    let mut rows = vec![cells([&head, "training", "hold-out"])];
    rows.extend(diagnosis.explained.ladder.iter().map(|step| {
        let effects = match step.effects.as_slice() {
            [] => "with none".to_owned(),
            some => format!("with {}", some.join(" + ")),
        };
        let [train, holdout] = [step.errors.train_rms, step.errors.holdout_rms];
        cells([&effects, &rounded(train, 4), &rounded(holdout, 4)])
    }));
    rows
}

/// Explanation of the contributions of several effects.
pub const SHARES_OVERLAP: &str =
    "These can add up to more or less than 100 %, as effects explain parts of the same error.";

/// The contribution of each effect, with a heading.
pub fn share_rows(diagnosis: &Diagnosis) -> Vec<Vec<String>> {
    let mut rows = vec![cells(["effect", "explained power lost without it"])];
    let shares = diagnosis.explained.shares.iter();
    rows.extend(shares.map(|s| {
        let share = format!("{} %", rounded(100.0 * s.share, 2));
        cells([s.effect, &share])
    }));
    rows
}

/// A number with its standard uncertainty, for people.
pub fn estimate(value: f64, std: Option<f64>) -> String {
    match std {
        Some(std) => with_std(value, std),
        None => format!("{} (std unknown)", rounded(value, 6)),
    }
}

/// The three errors, with a heading.
pub fn error_rows(diagnosis: &Diagnosis) -> Vec<Vec<String>> {
    let error = &diagnosis.error;
    let head = format!("rms error, {}", unit_or_as_recorded(&error.unit));
    let mut rows = vec![cells([&head, "training", "hold-out", "relative"])];
    let declared = error.declared.iter();
    let declared = declared.map(|errors| ("declared: the stand file as it is", errors));
    let fitted = [
        ("before: the plain stand, refitted", &error.before),
        ("after: with the accepted effects", &error.after),
    ];
    rows.extend(declared.chain(fitted).map(|(model, errors)| {
        cells([
            model,
            &rounded(errors.rms.train_rms, 4),
            &rounded(errors.rms.holdout_rms, 4),
            &relative(errors.holdout_relative, 3),
        ])
    }));
    rows
}

/// A change of the error with one decimal, or as a factor if large.
fn change(part: f64) -> String {
    match part.abs() < 10.0 {
        true => format!("{:.1} %", 100.0 * part),
        false => relative(part, 2),
    }
}

/// The improvement and the noise floor, one sentence each.
pub fn error_sentences(diagnosis: &Diagnosis) -> Vec<String> {
    let error = &diagnosis.error;
    let unit = unit_or_as_recorded(&error.unit);
    let improvement = error.improvement_ci95.map(|[low, high]| {
        let [low, high] = [low, high].map(change);
        match low == high {
            true => format!("The hold-out error decreases by {low} (95 % interval)."),
            false => format!("The hold-out error decreases by {low} to {high} (95 % interval)."),
        }
    });
    let from = match error.noise_floor_from {
        Some(NoiseFloorSource::Periods) => "differences between periods of the record",
        Some(NoiseFloorSource::Resolution) => {
            "the resolution of the record, whose rounding error exceeds the noise"
        }
        _ => "the frequencies without signal",
    };
    let floor = match error.noise_floor_rms {
        Some(rms) => format!("Noise floor: {} {unit}, from {from}.", rounded(rms, 4)),
        None => "The noise floor is unknown.".to_owned(),
    };
    let course = match diagnosis.input_between_samples {
        "held" => Some("each sample were held until the next one, as a converter does"),
        "straight-lines" => Some("its samples were joined by straight lines"),
        _ => None,
    };
    let course = course.map(|course| {
        format!(
            "The applied quantity behaves as if {course}; all errors assume this: run \"simulate\" with --between {}.",
            diagnosis.input_between_samples
        )
    });
    let all = improvement.into_iter().chain([floor]).chain(course);
    all.collect()
}

/// Explanation of the detection limits.
pub const WOULD_SHOW: &str = "Detection limits: an effect at or beyond these values would have been detected in the \
    training records (95 % certainty).";

/// The detection limits, with a heading.
pub fn limit_rows(diagnosis: &Diagnosis) -> Vec<Vec<String>> {
    let mut rows = vec![cells(["effect", "detectable at", "other parameters"])];
    rows.extend(diagnosis.detection_limits.iter().map(|limit| {
        let side = match limit.shows {
            ShownSide::From => ">=",
            ShownSide::UpTo => "<=",
        };
        let shown = match limit.value {
            Some(value) => format!(
                "{} {side} {} {}",
                limit.parameter,
                rounded(value, 3),
                limit.unit
            ),
            None => "no physically possible amount".to_owned(),
        };
        let at = limit.at.iter().map(|p| {
            let value = rounded(p.estimate.value(), 3);
            format!("{} {value} {}", p.name, p.estimate.unit())
                .trim_end()
                .to_owned()
        });
        let at: Vec<String> = at.collect();
        cells([limit.effect, shown.trim_end(), &at.join(", ")])
    }));
    rows
}

/// The constants of the plain stand, with a heading.
pub fn constant_rows(diagnosis: &Diagnosis) -> Vec<Vec<String>> {
    let mut rows = vec![cells(["constant", "declared", "before", "after"])];
    rows.extend(diagnosis.constants.iter().map(|c| {
        let mut name = c.name.to_owned();
        if let Some(mode) = c.mode {
            name = format!("mode {mode} {name}");
        }
        if !c.unit.is_empty() {
            name = format!("{name}, {}", c.unit);
        }
        let declared = c.declared.map(|v| rounded(v, 6));
        cells([
            &name,
            declared.as_deref().unwrap_or("-"),
            &estimate(c.before, c.before_std),
            &estimate(c.after, c.after_std),
        ])
    }));
    rows
}

pub fn cells<const N: usize>(texts: [&str; N]) -> Vec<String> {
    texts.map(str::to_owned).to_vec()
}

fn candidate(candidate: &CandidateFit) -> String {
    let error = candidate.holdout_rms.map(|v| rounded(v, 4));
    let error = error.map_or_else(String::new, |v| format!(", hold-out error {v}"));
    let mut text = format!(
        "{}{error}: {}; {}\n",
        candidate.names().join(" + "),
        candidate.status().name(),
        candidate.reason.text()
    );
    if candidate.status() != Status::Rejected {
        for parameter in &candidate.parameters {
            let fitted: &Estimate = &parameter.estimate;
            let value = estimate(fitted.value(), fitted.std_uncertainty());
            let line = format!("    {} = {value} {}", parameter.name, fitted.unit());
            text += line.trim_end();
            text.push('\n');
        }
    }
    text
}
