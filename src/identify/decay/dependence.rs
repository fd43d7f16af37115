//! Tests whether one damping ratio describes a decay: the law of its envelope, and its change with amplitude.

use super::laws::{self, Law};
use super::modes::{self, ModesFit, Stretch};
use crate::failure::Failure;
use crate::identify::Identification;
use crate::print::rounded;
use crate::warning::WarningCode;

/// Minimum reduction of the criterion for a law other than viscous damping.
const CLEARLY: f64 = 10.0;
/// Residual of a law relative to that of viscous damping, below which that of viscous damping is not noise, whose colour
/// would otherwise count: most of it is damping.
const MUCH_LESS: f64 = 0.5;

/// Minimum relative reduction of the residual, in addition.
const WORTHWHILE: f64 = 0.01;

/// What the damping ratio is if dry friction was fitted with it. A' = −σA − 2Fω/π is the fall of a mode with the rate
/// σ + 2Fω/(πA).
const VISCOUS_PART: &str =
    "; the one given is its viscous part, to which dry friction F adds 2F/(πA) at the amplitude A";

/// Fits the damping laws to the longest segment and warns if viscous damping is clearly not the best.
pub(super) fn damping_law(
    result: &mut Identification,
    fit: &ModesFit,
    stretches: &[Stretch],
) -> Result<(), Failure> {
    let [pole] = fit.poles[..] else {
        return Ok(());
    };
    let longest = (0..stretches.len())
        .max_by_key(|s| stretches[*s].values.len())
        .unwrap_or(0);
    let at = 2 + longest * 4;
    let viscous = match fit.has_friction {
        true => &modes::fit(stretches, &[pole])?,
        false => fit,
    };
    let start = laws::ViscousFit {
        pole: viscous.poles[0],
        linear: [0, 1, 2, 3].map(|i| viscous.fit.values[at + i]),
        relative_density: fit.relative_density(stretches, longest, pole),
    };
    let laws = laws::compare(&stretches[longest], &start)?;
    let viscous = laws.iter().find(|l| l.law == Law::Viscous);
    if let (Some(best), Some(viscous)) = (laws.first(), viscous)
        && best.law != Law::Viscous
        && (best.criterion < viscous.criterion - CLEARLY || best.rms < MUCH_LESS * viscous.rms)
        && best.rms < (1.0 - WORTHWHILE) * viscous.rms
    {
        let part = match fit.has_friction {
            true => VISCOUS_PART,
            false => "",
        };
        result.warn(WarningCode::NotViscous.warning(format!(
            "{} damping fits the envelope better than viscous damping (residual {} instead of {}): no single \
             damping ratio describes this decay{part}",
            best.law.name(),
            rounded(best.rms, 3),
            rounded(viscous.rms, 3)
        )));
    }
    result.laws = laws;
    Ok(())
}

/// Whether a law with dry friction describes a decay clearly better than a sine with viscous damping, and than all others.
pub(super) fn is_dry(fit: &ModesFit, stretches: &[Stretch]) -> Result<bool, Failure> {
    let mut found = Identification::new("decay");
    damping_law(&mut found, fit, stretches)?;
    let best = found.laws.first();
    Ok(!found.warnings.is_empty() && best.is_some_and(|law| law.dry_friction.is_some()))
}

/// Smallest reported relative change of decay rate and of frequency between the halves of a decay.
const NOTABLE: [f64; 2] = [0.02, 1e-4];

/// The same in standard uncertainties.
const CHANGED: f64 = 4.0;

/// Fits the early and the late half (in amplitude) separately and compares them.
pub(super) fn amplitude_dependence(
    result: &mut Identification,
    fit: &ModesFit,
    stretches: &[Stretch],
    main: usize,
) {
    if fit.poles.len() != 1 {
        return;
    }
    let pole = fit.poles[main];
    let Some(stretch) = stretches.iter().max_by_key(|s| s.values.len()) else {
        return;
    };
    // Halfway (in decibels) from the initial amplitude to the noise.
    let noise = fit.fit.rms.max(1e-300);
    let amplitude = fit.amplitude(main, 0).max(noise);
    let down = 0.5 * (amplitude / noise).ln().clamp(0.5, 3.0) / pole.rate_per_s.max(1e-12);
    let middle = stretch.times_s.partition_point(|t| *t < down);
    if middle < 30 || stretch.times_s.len() - middle < 30 {
        return;
    }
    let part = |range| modes::fit(&[stretch.part(range)], &[pole]).ok();
    let halves = (part(0..middle), part(middle..stretch.times_s.len()));
    let (Some(early), Some(late)) = halves else {
        return;
    };
    compare_halves(result, &early, &late);
}

/// Warns about significant differences between the halves.
fn compare_halves(result: &mut Identification, early: &ModesFit, late: &ModesFit) {
    for (i, what) in ["decay rate", "frequency"].into_iter().enumerate() {
        let (Some(a), Some(b)) = (early.fit.std[i], late.fit.std[i]) else {
            continue;
        };
        let (first, second) = (early.fit.values[i], late.fit.values[i]);
        let change = second / first - 1.0;
        if (second - first).abs() > CHANGED * a.hypot(b) && change.abs() > NOTABLE[i] {
            result.warn(WarningCode::AmplitudeDependent.warning(format!(
                "the {what} changes by {} % from large to small amplitudes: state the amplitude with it",
                rounded(100.0 * change, 2)
            )));
        }
    }
}
