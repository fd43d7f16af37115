//! Records that no response can be read from, and channels that look swapped.

use super::Driven;
use super::Modal;
use super::blocks::Set;
use super::lines::Lines;
use crate::failure::Failure;
use crate::identify::Outcome;
use crate::print::{rounded, short};
use torqcomp_dsp::frf::{Estimator, Window};

/// Refuses records that differ in rate, have holes, or do not move.
pub(super) fn records(records: &[Driven]) -> Result<(), Failure> {
    let first = records
        .first()
        .ok_or_else(|| Failure::failed("there is no record"))?;
    for record in records {
        if (record.rate_hz / first.rate_hz - 1.0).abs() > 1e-6 {
            return Err(Failure::failed(format_args!(
                "{} has {} samples a second and {} has {}; records of one response must have one rate",
                first.name,
                short(first.rate_hz),
                record.name,
                short(record.rate_hz)
            )));
        }
        let mut numbers = record.applied.iter().chain(record.measured);
        if record.applied.len() != record.measured.len() || numbers.any(|v| !v.is_finite()) {
            return Err(Failure::failed(format_args!(
                "{}: both channels need a number in every row",
                record.name
            )));
        }
        for (what, samples) in [("applied", record.applied), ("measured", record.measured)] {
            if samples.iter().all(|v| *v == samples[0]) {
                return Err(Failure::failed(format_args!(
                    "{}: the {what} channel does not change, so that there is no response; check --{what} and \
                     whether the recorder was connected",
                    record.name
                )));
            }
        }
        if record.applied == record.measured {
            return Err(Failure::failed(format_args!(
                "{}: the applied and the measured channel hold the same numbers; check --applied and --measured",
                record.name
            )));
        }
    }
    Ok(())
}

/// Part of the lines whose phase leads that is said.
const LEADING: f64 = 0.9;
/// Imaginary part over the magnitude below which a line tells no side.
const IN_PHASE: f64 = 0.02;

/// What is measured lags what is applied: ω^−m j^−m H has its imaginary part below zero where one point is
/// driven and measured. Where it leads nearly throughout, the channels are swapped or one has the
/// wrong sign.
pub(super) fn leads(set: &Set, lines: &Lines, order: i32) -> bool {
    let h1 = set.powers.response(Estimator::H1);
    let turn = num_complex::Complex64::I.powi(-order);
    let sides: Vec<bool> = lines
        .clone()
        .filter(|k| h1.coherence[*k] > 0.5)
        .map(|k| h1.response[k] * turn)
        .filter(|h| h.im.abs() > IN_PHASE * h.norm())
        .map(|h| h.im > 0.0)
        .collect();
    let leading = sides.iter().filter(|s| **s).count();
    sides.len() > 10 && leading as f64 > LEADING * sides.len() as f64
}

/// Text for a response that leads.
pub(super) const LEADS: &str = "the measured signal leads the applied one at nearly all frequencies, which no driven stand does: the \
     channels may be swapped (--applied is what acts, --measured what answers), or one has the wrong sign";

/// Whether a mode lies above all frequencies of the record: swapped channels have none to show below.
pub(super) fn is_out_of_reach(set: &Set, fitted: &Modal) -> bool {
    let highest = std::f64::consts::TAU * set.step_hz * (set.blocks[0].applied.len() - 1) as f64;
    let natural = |pole: &crate::identify::decay::Pole| pole.rate_per_s.hypot(pole.omega_rad_per_s);
    fitted.poles.iter().any(|pole| natural(pole) > highest)
}

/// Widening of a resonance by Hann's window, over its width, that is said.
const WIDER: f64 = 0.01;

/// Says where Hann's window widens a resonance. Smoothing by the squared window is multiplying what rings by its
/// autocorrelation, 1 − (2πt/L)²/6 for short times; over a decay time 1/σ the damping grows by about twice
/// that, `(2π/σL)²/3`.
pub(super) fn leakage(outcome: &mut Outcome, set: &Set, fitted: &Modal) {
    if set.window != Window::Hann {
        return;
    }
    let length_s = 1.0 / set.step_hz;
    for pole in &fitted.poles {
        let wider = (std::f64::consts::TAU / (pole.rate_per_s * length_s)).powi(2) / 3.0;
        if wider > WIDER {
            outcome.warn(
                "leakage",
                format!(
                    "the mode at {} Hz is narrow for segments of {} s: its damping comes out too large by some {} %, \
                     which its uncertainty does not hold; make segments longer with --segment",
                    rounded(pole.omega_rad_per_s / std::f64::consts::TAU, 5),
                    short(length_s),
                    rounded(100.0 * wider, 1)
                ),
            );
        }
    }
}

/// Part of the measured signal that may be left.
const POOR: f64 = 0.5;

/// Says what makes the fit doubtful.
pub(super) fn doubts(outcome: &mut Outcome, relative: f64, leads: bool, fitted: &Modal) {
    if leads {
        outcome.warn("leads", LEADS);
    }
    if relative > POOR {
        outcome.warn(
            "poor-fit",
            format!(
                "{} mode(s) leave {} % of the measured signal: what was applied does not explain it; look at the \
                 coherence, and choose another --band",
                fitted.poles.len(),
                rounded(100.0 * relative, 2)
            ),
        );
    }
}
