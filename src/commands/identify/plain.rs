//! J, f and K from torque in and motion out, and their entries of a stand file.

use super::anchor::entry;
use crate::cli::identify::{Anchors, Findings};
use crate::failure::Failure;
use crate::identify::Outcome;
use crate::identify::plain::Answer;
use crate::print::{rounded, short};
use crate::stand::update::Entry;

/// Adds all three constants; entries of the stand file.
pub(super) fn follow(
    anchors: &Anchors,
    findings: &Findings,
    answer: &Answer,
    source: &str,
    outcome: &mut Outcome,
) -> Result<Vec<Entry>, Failure> {
    let (found, correlated) = answer.constants();
    if found[0].value <= 0.0 {
        return impossible(found[0].value, findings, outcome);
    }
    if anchors.inertia.is_some() || anchors.stiffness.is_some() {
        outcome.warn(
            "anchor-not-needed",
            "a torque and the motion that it makes tell inertia, damping and stiffness: --inertia or --stiffness was \
             not used; leave it out, or compare",
        );
    }
    if let Some(angle) = answer.turned() {
        outcome.warn(
            "turned",
            format!(
                "the mode answers {} degrees off what J θ'' + f θ' + K θ = T does, so that its constants hold only \
                 nearly: look for a delay (--delay), another mode close by, or a motion measured elsewhere than the \
                 torque acts",
                rounded(angle.to_degrees(), 2)
            ),
        );
    }
    outcome.method.push(
        "inertia, damping and stiffness from the size of the motion that the torque makes: nothing had to be declared"
            .to_owned(),
    );
    let entries = found.iter().filter_map(|f| entry(f, source)).collect();
    outcome.found.extend(found);
    outcome.correlated.extend(correlated);
    Ok(entries)
}

/// A motion against the torque.
fn impossible(
    inertia_kg_m2: f64,
    findings: &Findings,
    outcome: &mut Outcome,
) -> Result<Vec<Entry>, Failure> {
    let text = format!(
        "the inertia comes out as {} kg m^2, which no stand has: one of the channels has the wrong sign",
        short(inertia_kg_m2)
    );
    match findings.result.output {
        Some(_) => Err(Failure::failed(text)),
        None => {
            outcome.warn("impossible", text);
            Ok(Vec::new())
        }
    }
}
