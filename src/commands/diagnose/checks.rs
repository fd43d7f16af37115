//! Sentences on records that check the stand that was found: known loads, and running records.

use torqcomp_model::Estimate;

use super::text::estimate;
use crate::diagnose::{CheckedLoads, Diagnosis, RunningCheck};
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

/// What running records show, some sentences each.
pub fn running_sentences(diagnosis: &Diagnosis) -> Vec<String> {
    let unit = unit_or_as_recorded(&diagnosis.error.unit);
    let of_record = |check: &RunningCheck| {
        let lines = check.lines.iter().map(|line| {
            let [frequency, amplitude] = [line.frequency_hz, line.amplitude].map(|v| rounded(v, 4));
            format!("{frequency} Hz ({amplitude} {unit})")
        });
        let lines = match lines.collect::<Vec<_>>().as_slice() {
            [] => "No steady lines are found.".to_owned(),
            some => format!("Steady lines: {}.", some.join(", ")),
        };
        let duration = rounded(check.duration_s, 3);
        format!(
            "{}, {duration} s: {} {lines}",
            check.source,
            in_use(check, diagnosis)
        )
    };
    let mut all: Vec<String> = diagnosis.running.iter().map(of_record).collect();
    if !all.is_empty() {
        all.push(
            "A record of the running machine does not show the size of the torque, so it gives neither the gain nor \
             effects that depend on amplitude."
                .to_owned(),
        );
    }
    all
}

/// The resonance that a running record shows beside that of the fitted stand.
fn in_use(check: &RunningCheck, diagnosis: &Diagnosis) -> String {
    if let Some(hidden) = &check.hidden {
        return format!("the resonance is not visible: {hidden}.");
    }
    let shown = |c: &Estimate| estimate(c.value(), c.std_uncertainty());
    let in_use = [&check.natural_frequency, &check.damping_ratio];
    let [frequency, ratio] = in_use.map(|c| c.as_ref().map_or_else(String::new, shown));
    let [of_stand, ratio_of_stand, _] = diagnosis.after.constants();
    let at_small = match diagnosis.after.fitted.structure.effects.is_empty() {
        true => "",
        false => ", with effects that may change both with the size of the motion",
    };
    format!(
        "in use, the natural frequency is {frequency} Hz and the damping ratio {ratio}; the fitted stand has {} Hz and \
         {}{at_small}.",
        shown(&of_stand),
        shown(&ratio_of_stand)
    )
}
