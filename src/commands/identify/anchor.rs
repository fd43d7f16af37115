//! The constant that is declared, the others that follow from it, and their entries of a stand file.

use torqcomp_model::Kind;

use super::{declared, quantity, stand_text};
use crate::cli::identify::{Anchors, Findings};
use crate::failure::Failure;
use crate::identify::anchored::{Known, Ringer};
use crate::identify::{Found, Outcome};
use crate::stand::update::{COMMON, Entry};

/// Which of the ratios a test tells.
pub(super) enum Ratios {
    /// f/J and K/J: a free decay.
    OverInertia,
    /// f/K and J/K: torque in, torque out.
    OverStiffness,
}

/// What a mode tells of the stand.
pub(super) struct Told<'a> {
    /// The mode.
    pub mode: Ringer,
    /// Its ratios.
    pub ratios: Ratios,
    /// Natural frequency and damping ratio as found.
    pub modal: [&'a Found; 2],
    /// Where it comes from.
    pub source: String,
}

/// Adds the ratios and, if a constant is declared, the two others; entries of the stand file.
pub(super) fn follow(
    anchors: &Anchors,
    findings: &Findings,
    told: &Told,
    outcome: &mut Outcome,
) -> Result<Vec<Entry>, Failure> {
    let modal: Vec<Entry> = told
        .modal
        .iter()
        .filter_map(|found| entry(found, &told.source))
        .collect();
    outcome.found.extend(match told.ratios {
        Ratios::OverInertia => told.mode.over_inertia(),
        Ratios::OverStiffness => told.mode.over_stiffness(),
    });
    let Some((known, given)) = known(anchors, findings, &told.ratios)? else {
        outcome.warn("not-anchored", not_anchored(&told.ratios));
        return Ok(modal);
    };
    let anchor = match known {
        Known::Inertia(value, std) => Found::new("inertia", value, std, "kg m^2"),
        Known::Stiffness(value, std) => Found::new("stiffness", value, std, "N m/rad"),
    };
    if anchor.std.is_none() {
        outcome.warn(
            "anchor-without-std",
            format!(
                "the {} has no standard uncertainty, so that those of the constants that follow leave it \
                 out; declare it as {{ value = \"…\", std = \"…\" }} in a stand file",
                anchor.name
            ),
        );
    }
    let (mut found, correlated) = told.mode.anchored(known);
    let declared = given.then(|| entry(&anchor, "declared")).flatten();
    // All three are as uncertain as the anchor, together.
    let common = anchor.std.map(|std| Entry {
        section: "mechanics",
        key: COMMON,
        value: std / anchor.value,
        std: None,
        unit: String::new(),
        source: format!("of the declared {}", anchor.name),
    });
    let entries = declared
        .into_iter()
        .chain(found.iter().filter_map(|f| entry(f, &told.source)))
        .chain(common)
        .collect();
    outcome.method.push(format!(
        "anchored by the declared {}, which the test itself does not tell",
        anchor.name
    ));
    outcome.found.append(&mut found);
    outcome.correlated.extend(correlated);
    Ok(entries)
}

/// Entry of `[mechanics]` for a number that has a place there.
pub(super) fn entry(found: &Found, source: &str) -> Option<Entry> {
    let key = match found.name.as_str() {
        "inertia" => "inertia",
        "damping" => "damping",
        "stiffness" => "stiffness",
        name if name.ends_with("natural_frequency") => "natural_frequency",
        name if name.ends_with("damping_ratio") => "damping_ratio",
        _ => return None,
    };
    Some(Entry {
        section: "mechanics",
        key,
        value: found.value,
        std: found.std,
        unit: found.unit.clone(),
        source: source.to_owned(),
    })
}

fn not_anchored(ratios: &Ratios) -> &'static str {
    match ratios {
        Ratios::OverInertia => {
            "a decay tells only ratios such as stiffness over inertia: give --inertia or --stiffness, or a stand \
             file that declares one, to have all three constants"
        }
        Ratios::OverStiffness => {
            "torque in and torque out tell only damping and inertia over stiffness: give --stiffness or \
             --inertia, or a stand file that declares one, to have all three constants"
        }
    }
}

/// The anchor, and whether it comes from the command line.
fn known(
    anchors: &Anchors,
    findings: &Findings,
    ratios: &Ratios,
) -> Result<Option<(Known, bool)>, Failure> {
    if let Some(text) = &anchors.inertia {
        let inertia = positive("--inertia", text, Kind::Inertia)?;
        return Ok(Some((Known::Inertia(inertia, None), true)));
    }
    if let Some(text) = &anchors.stiffness {
        let stiffness = positive("--stiffness", text, Kind::AngularStiffness)?;
        return Ok(Some((Known::Stiffness(stiffness, None), true)));
    }
    let stand = stand_text(findings)?;
    let inertia = declared(stand.as_ref(), "inertia", Kind::Inertia)?
        .map(|(value, std)| Known::Inertia(value, std));
    let stiffness = declared(stand.as_ref(), "stiffness", Kind::AngularStiffness)?
        .map(|(value, std)| Known::Stiffness(value, std));
    let first = match ratios {
        Ratios::OverInertia => inertia.or(stiffness),
        Ratios::OverStiffness => stiffness.or(inertia),
    };
    Ok(first.map(|known| (known, false)))
}

fn positive(flag: &str, text: &str, kind: Kind) -> Result<f64, Failure> {
    let value = quantity(flag, text, kind)?;
    if value > 0.0 {
        Ok(value)
    } else {
        Err(Failure::usage(format_args!(
            "{flag} {text}: it must be greater than 0"
        )))
    }
}
