//! Whether one damping ratio describes a decay: the law of its envelope, and its change with amplitude.

use super::laws::{self, Law, LawFit};
use super::modes::{self, ModesFit, Stretch};
use crate::failure::Failure;
use crate::identify::Outcome;
use crate::print::rounded;

/// A law is preferred if its criterion is lower by that much.
const CLEARLY: f64 = 10.0;

/// … and what it leaves is less by this part.
const WORTHWHILE: f64 = 0.01;

pub(super) fn damping_law(
    outcome: &mut Outcome,
    fit: &ModesFit,
    stretches: &[Stretch],
) -> Result<Vec<LawFit>, Failure> {
    let [pole] = fit.poles[..] else {
        return Ok(Vec::new());
    };
    let longest = (0..stretches.len())
        .max_by_key(|s| stretches[*s].values.len())
        .unwrap_or(0);
    let at = 2 + longest * 4;
    let start = [0, 1, 2, 3].map(|i| fit.fit.values[at + i]);
    let laws = laws::compare(&stretches[longest], pole, start)?;
    let viscous = laws.iter().find(|l| l.law == Law::Viscous);
    if let (Some(best), Some(viscous)) = (laws.first(), viscous)
        && best.law != Law::Viscous
        && best.criterion < viscous.criterion - CLEARLY
        && best.rms < (1.0 - WORTHWHILE) * viscous.rms
    {
        outcome.warn(
            "not-viscous",
            format!(
                "the envelope follows {} damping better than viscous damping (what is left falls from {} to \
                 {}): one damping ratio does not describe it",
                best.law.name(),
                rounded(viscous.rms, 3),
                rounded(best.rms, 3)
            ),
        );
    }
    Ok(laws)
}

/// Change of the damping between the halves of a decay that is said.
const NOTABLE: f64 = 0.02;

/// Fits the early and the late half (in amplitude) on their own and compares.
pub(super) fn amplitude_dependence(
    outcome: &mut Outcome,
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
    // Half way down to where the decay drowns in the noise.
    let noise = fit.fit.rms.max(1e-300);
    let amplitude = fit.amplitude(main, 0).max(noise);
    let down = 0.5 * (amplitude / noise).ln().clamp(0.5, 3.0) / pole.rate_per_s.max(1e-12);
    let middle = stretch.times_s.partition_point(|t| *t < down);
    if middle < 30 || stretch.times_s.len() - middle < 30 {
        return;
    }
    let part = |from: usize, to: usize| {
        let start = stretch.times_s[from];
        let half = Stretch {
            times_s: stretch.times_s[from..to]
                .iter()
                .map(|t| t - start)
                .collect(),
            values: stretch.values[from..to].to_vec(),
        };
        modes::fit(&[half], &[pole]).ok()
    };
    let halves = (part(0, middle), part(middle, stretch.times_s.len()));
    let (Some(early), Some(late)) = halves else {
        return;
    };
    compare_halves(outcome, &early, &late);
}

/// Says what differs between the halves by more than their uncertainties.
fn compare_halves(outcome: &mut Outcome, early: &ModesFit, late: &ModesFit) {
    for (i, what, notable) in [(0, "decay rate", NOTABLE), (1, "frequency", 1e-4)] {
        let (Some(a), Some(b)) = (early.fit.std[i], late.fit.std[i]) else {
            continue;
        };
        let (first, second) = (early.fit.values[i], late.fit.values[i]);
        let change = second / first - 1.0;
        if (second - first).abs() > 4.0 * a.hypot(b) && change.abs() > notable {
            outcome.warn(
                "amplitude-dependent",
                format!(
                    "the {what} changes by {} % from large to small amplitudes: one number holds for one \
                     amplitude only",
                    rounded(100.0 * change, 2)
                ),
            );
        }
    }
}
