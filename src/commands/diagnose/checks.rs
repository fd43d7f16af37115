//! Sentences on records that check the stand that was found: known loads, and running records.

use torqcomp_model::Estimate;

use super::text::estimate;
use crate::diagnose::{CheckedLoads, Diagnosis, ModeDifference, RunningCheck};
use crate::print::{plural, rounded, unit_or_as_recorded};

/// Results from known loads, one sentence each.
pub fn load_sentences(diagnosis: &Diagnosis) -> Vec<String> {
    let Some(loads) = &diagnosis.known_loads else {
        return Vec::new();
    };
    let unit = unit_or_as_recorded(&loads.unit);
    let gain = format!(
        "The known loads give a static gain of {} {}.",
        estimate(loads.gain, loads.gain_std),
        loads.gain_unit
    );
    let of_file = |file: &CheckedLoads| {
        let count = plural(file.loads, "load");
        let before = rounded(file.before_rms, 4);
        match diagnosis.effects.is_empty() {
            true => format!("{}, {count}: the error is {before} {unit}.", file.source),
            false => format!(
                "{}, {count}: the error is {before} {unit} for a straight line, and {} {unit} with the effects, which were not \
                 fitted to them.",
                file.source,
                rounded(file.after_rms, 4)
            ),
        }
    };
    let files = loads.files.iter().map(of_file);
    std::iter::once(gain).chain(files).collect()
}

/// What running records show, one sentence each.
pub fn running_sentences(diagnosis: &Diagnosis) -> Vec<String> {
    let unit = unit_or_as_recorded(&diagnosis.error.unit);
    let of_record = |check: &RunningCheck| {
        let found = in_use(check, !diagnosis.effects.is_empty());
        let lines = check.lines.iter().map(|line| {
            let [frequency, amplitude] = [line.frequency_hz, line.amplitude].map(|v| rounded(v, 4));
            format!("{frequency} Hz ({amplitude} {unit})")
        });
        let lines = match lines.collect::<Vec<_>>().as_slice() {
            [] => "No steady lines are found.".to_owned(),
            some => format!("Steady lines: {}.", some.join(", ")),
        };
        format!(
            "{}, {} s: {found} {lines}",
            check.source,
            rounded(check.duration_s, 3)
        )
    };
    let mut all: Vec<String> = diagnosis.running.iter().map(of_record).collect();
    if !all.is_empty() {
        all.push(
            "A running record does not show how large the torque is, so neither the gain nor what depends on the size of \
             the motion follows from it."
                .to_owned(),
        );
    }
    all
}

/// The resonance that a running record shows, and how the models differ from it.
fn in_use(check: &RunningCheck, has_effects: bool) -> String {
    if let Some(hidden) = &check.hidden {
        return format!("the resonance does not show: {hidden}.");
    }
    let constants = [&check.natural_frequency, &check.damping_ratio];
    let [frequency, ratio] = constants.map(|constant| {
        let shown = |c: &Estimate| estimate(c.value(), c.std_uncertainty());
        constant.as_ref().map_or_else(String::new, shown)
    });
    let std = constants.map(|constant| {
        let relative = constant.as_ref().and_then(Estimate::relative_std);
        rounded(100.0 * relative.unwrap_or(0.0), 2)
    });
    let of_model = |(name, difference): (&str, Option<ModeDifference>)| {
        let difference = difference?;
        let percent = [difference.natural_frequency, difference.damping_ratio];
        let [by_frequency, by_ratio] = percent.map(|part| format!("{:+.2}", 100.0 * part));
        Some(format!(
            " {name} differs by {by_frequency} ± {} % in frequency and {by_ratio} ± {} % in damping.",
            std[0], std[1]
        ))
    };
    let models = match has_effects {
        true => vec![
            ("The plain stand", check.before),
            ("With the effects, at small motions, it", check.after),
        ],
        false => vec![("The stand found", check.before)],
    };
    let models: String = models.into_iter().filter_map(of_model).collect();
    format!(
        "in use, the natural frequency is {frequency} Hz and the damping ratio {ratio}.{models}"
    )
}
