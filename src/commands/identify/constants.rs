//! Constants of the stand that follow from a mode, and their entries in a stand file.

use torqcomp_model::{Estimate, Kind};

use super::{declared, entry, positive, stand_text};
use crate::cli::identify::{Anchors, Findings};
use crate::failure::{ErrorCode, Failure};
use crate::identify::{Identification, KnownConstant, ModalPole, NamedEstimate};
use crate::print::{rounded, short};
use crate::stand::update::{COMMON, CORRELATIONS, Entry};
use crate::warning::WarningCode;

/// Ratios determined by a test.
#[derive(Clone, Copy)]
pub(super) enum Ratios {
    /// f/J and K/J, from a free decay.
    OverInertia,
    /// f/K and J/K, from torque in, torque out.
    OverStiffness,
}

/// Keys of `[mechanics]` for constants of the same name.
const KEYS: [&str; 5] = [
    "inertia",
    "damping",
    "stiffness",
    "natural_frequency",
    "damping_ratio",
];

/// Entries of `[mechanics]` for the constants that have one.
fn entries(constants: &[NamedEstimate], source: &str) -> Vec<Entry> {
    let one = |constant: &NamedEstimate| {
        let key = KEYS.into_iter().find(|key| *key == constant.name)?;
        Some(entry("mechanics", key, constant, source))
    };
    constants.iter().filter_map(one).collect()
}

/// Adds the ratios from the mode and, if one constant is known, the two others; returns the entries of the stand file.
pub(super) fn from_ratios(
    anchors: &Anchors,
    findings: &Findings,
    (mode, ratios): (&ModalPole, Ratios),
    source: &str,
    result: &mut Identification,
) -> Result<Vec<Entry>, Failure> {
    let found = match ratios {
        Ratios::OverInertia => mode.over_inertia(),
        Ratios::OverStiffness => mode.over_stiffness(),
    };
    result.parameters.extend(found.list);
    let Some((known, is_given)) = known(anchors, findings, ratios)? else {
        result.warn(WarningCode::NotAnchored.warning(ONLY_RATIOS));
        let names = ["natural_frequency", "damping_ratio"];
        let modal = mode.modal_constants().of_mode((0, 1), &names);
        return Ok(entries(&modal.list, source));
    };
    let all = mode.scaled_by_known_constant(known);
    result.correlations.extend(all.correlations());
    let (scale, others) = (&all.list[0], &all.list[1..]);
    result.parameters.extend_from_slice(others);
    result.method.push(format!(
        "scaled with the declared {}; this test alone gives only ratios",
        scale.name
    ));
    let exact = NamedEstimate {
        name: scale.name.clone(),
        estimate: Estimate::of(scale.estimate.unit().to_owned(), scale.value(), None),
    };
    let declared = entries(&[exact], "declared").remove(0);
    let mut all = entries(others, source);
    if is_given {
        all.insert(0, declared);
    }
    match known.std() {
        None => result.warn(WarningCode::AnchorWithoutStd.warning(format!(
            "the {} has no standard uncertainty, so those of the constants scaled with it are too small; declare it \
             as {{ value = \"…\", std = \"…\" }} in a stand file",
            scale.name
        ))),
        // All three constants share the relative uncertainty of the known one.
        Some(std) => all.push(Entry::quantity(
            "mechanics",
            COMMON,
            &Estimate::of("", std / scale.value(), None),
            &format!("of the declared {}", scale.name),
        )),
    }
    Ok(all)
}

/// Note if no constant is known to scale the ratios.
const ONLY_RATIOS: &str = "the test gives natural frequency and damping ratio, which is all that compensate needs; of \
    inertia, damping and stiffness it gives only ratios. For the constants themselves, give --inertia or --stiffness, \
    or a stand file that declares one";

/// The known constant, and whether it comes from the command line.
fn known(
    anchors: &Anchors,
    findings: &Findings,
    ratios: Ratios,
) -> Result<Option<(KnownConstant, bool)>, Failure> {
    if let Some(text) = &anchors.inertia {
        let inertia = positive("--inertia", text, Kind::Inertia)?;
        return Ok(Some((KnownConstant::Inertia(inertia, None), true)));
    }
    if let Some(text) = &anchors.stiffness {
        let stiffness = positive("--stiffness", text, Kind::AngularStiffness)?;
        return Ok(Some((KnownConstant::Stiffness(stiffness, None), true)));
    }
    let stand = stand_text(findings)?;
    let inertia = declared(stand.as_ref(), "inertia", Kind::Inertia)?
        .map(|(value, std)| KnownConstant::Inertia(value, std));
    let stiffness = declared(stand.as_ref(), "stiffness", Kind::AngularStiffness)?
        .map(|(value, std)| KnownConstant::Stiffness(value, std));
    let first = match ratios {
        Ratios::OverInertia => inertia.or(stiffness),
        Ratios::OverStiffness => stiffness.or(inertia),
    };
    Ok(first.map(|known| (known, false)))
}

/// Adds inertia, damping and stiffness from the residue for torque in, motion out; returns the stand-file entries.
pub(super) fn from_residue(
    anchors: &Anchors,
    findings: &Findings,
    mode: &ModalPole,
    source: &str,
    result: &mut Identification,
) -> Result<Vec<Entry>, Failure> {
    let Some(constants) = mode.stand_constants() else {
        return Ok(Vec::new());
    };
    let inertia_kg_m2 = constants.list[0].value();
    if inertia_kg_m2 <= 0.0 {
        let text = format!(
            "the fitted inertia is negative ({} kg m²): one channel has the wrong sign",
            short(inertia_kg_m2)
        );
        if findings.result.output.is_some() {
            return Err(ErrorCode::NotIdentifiable.failed(text));
        }
        result.warn(WarningCode::Impossible.warning(text));
        return Ok(Vec::new());
    }
    if anchors.inertia.is_some() || anchors.stiffness.is_some() {
        result.warn(WarningCode::AnchorNotNeeded.warning(
            "--inertia or --stiffness is not used: torque and motion determine inertia, damping and stiffness",
        ));
    }
    if let Some(angle) = mode.residue_phase() {
        result.warn(WarningCode::Turned.warning(format!(
            "the phase of the mode differs by {} degrees from J θ'' + f θ' + K θ = T, so its constants are \
             approximate: check for a delay (--delay), another mode close by, or a motion not measured where the \
             torque acts",
            rounded(angle.to_degrees(), 2)
        )));
    }
    result.method.push(
        "inertia, damping and stiffness from the ratio of motion to torque, without a declared constant"
            .to_owned(),
    );
    let mut entries = entries(&constants.list, source);
    // The pairs of inertia, damping and stiffness, in this order.
    for (key, (i, j)) in CORRELATIONS.into_iter().zip([(0, 1), (0, 2), (1, 2)]) {
        let coefficient = constants.correlation(i, j);
        entries.extend(
            coefficient
                .map(|c| Entry::quantity("mechanics", key, &Estimate::of("", c, None), source)),
        );
    }
    result.add(constants);
    Ok(entries)
}
