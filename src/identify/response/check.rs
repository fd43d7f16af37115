//! Rejection of records that show no response, and signs of swapped channels and poor fits.

use super::Driven;
use super::blocks::Set;
use super::{FinalFit, Modal};
use crate::failure::{ErrorCode, Failure};
use crate::identify::Identification;
use crate::print::{plural, rounded, short};
use crate::warning::WarningCode;
use torqcomp_dsp::frf::{Estimator, Window};

/// Rejects records that differ in rate, have gaps, or are constant.
pub(super) fn records(records: &[Driven]) -> Result<(), Failure> {
    let first = records
        .first()
        .ok_or_else(|| ErrorCode::MissingArgument.failed("no record given"))?;
    for record in records {
        if (record.rate_hz / first.rate_hz - 1.0).abs() > 1e-6 {
            return Err(ErrorCode::RecordsDiffer.failed(format_args!(
                "{} was sampled at {} Hz and {} at {} Hz; records of one response need the same rate",
                first.name,
                short(first.rate_hz),
                record.name,
                short(record.rate_hz)
            )));
        }
        let mut numbers = record.applied.iter().chain(record.measured);
        if record.applied.len() != record.measured.len() || numbers.any(|v| !v.is_finite()) {
            return Err(ErrorCode::InvalidSample
                .failed("both channels need a number in every row")
                .at(record.name));
        }
        for (what, samples) in [("applied", record.applied), ("measured", record.measured)] {
            if samples.iter().all(|v| *v == samples[0]) {
                return Err(ErrorCode::UnsuitableRecord.failed(format_args!(
                    "the {what} channel does not change; check --{what} and whether the recorder was connected"
                ))
                .at(record.name));
            }
        }
        if record.applied == record.measured {
            return Err(ErrorCode::UnsuitableRecord.failed(
                "the applied and the measured channel are the same numbers; check --applied and --measured",
            )
            .at(record.name));
        }
    }
    Ok(())
}

/// Fraction of the lines with leading phase above which the response leads.
const LEADING: f64 = 0.9;
/// Ratio of imaginary part to magnitude below which a line neither leads nor lags.
const IN_PHASE: f64 = 0.02;

/// Whether the measured signal leads at nearly all lines. A driving-point response lags: the imaginary part of ω^−m
/// j^−m H is negative. Otherwise the channels are swapped or one has the wrong sign.
pub(super) fn leads(set: &Set, order: i32) -> bool {
    let h1 = set.powers.response(Estimator::H1);
    let turn = num_complex::Complex64::I.powi(-order);
    let sides: Vec<bool> = set
        .band
        .clone()
        .filter(|k| h1.coherence[*k] > 0.5)
        .map(|k| h1.response[k] * turn)
        .filter(|h| h.im.abs() > IN_PHASE * h.norm())
        .map(|h| h.im > 0.0)
        .collect();
    let leading = sides.iter().filter(|s| **s).count();
    sides.len() > 10 && leading as f64 > LEADING * sides.len() as f64
}

pub(super) const LEADS: &str = "the measured signal leads the applied one at nearly all frequencies, which is impossible: --applied and --measured \
     are swapped, or one channel has the wrong sign";

/// Whether a mode lies above all frequencies of the record, as with swapped channels.
pub(super) fn is_out_of_reach(set: &Set, fitted: &Modal) -> bool {
    let highest = std::f64::consts::TAU * set.step_hz * (set.lines - 1) as f64;
    let mut poles = fitted.poles.iter();
    poles.any(|pole| pole.rate_per_s.hypot(pole.omega_rad_per_s) > highest)
}

/// Minimum reported relative broadening of a resonance by the Hann window.
const WIDER: f64 = 0.01;

/// Warns if the Hann window broadens a resonance. Smoothing by the squared window multiplies the decay by its
/// autocorrelation, 1 − (2πt/L)²/6 for short times; over a time constant 1/σ the damping grows by about twice
/// that, `(2π/σL)²/3`.
pub(super) fn leakage(result: &mut Identification, set: &Set, fitted: &Modal) {
    if set.window != Window::Hann {
        return;
    }
    let length_s = 1.0 / set.step_hz;
    for pole in &fitted.poles {
        let wider = (std::f64::consts::TAU / (pole.rate_per_s * length_s)).powi(2) / 3.0;
        if wider > WIDER && pole.rate_per_s > 0.0 {
            result.warn(WarningCode::Leakage.warning(format!(
                "the mode at {} Hz is narrow for segments of {} s: its damping is about {} % too large, which its \
                 uncertainty does not include; choose a longer --segment",
                rounded(pole.frequency_hz(), 5),
                short(length_s),
                rounded(100.0 * wider, 1)
            )));
        }
    }
}

/// Residual relative to the measured signal above which the fit is poor.
pub(super) const POOR: f64 = 0.3;

/// Warns about reasons to doubt the fit.
pub(super) fn doubts(result: &mut Identification, found: &FinalFit, leads: bool) {
    if leads {
        result.warn(WarningCode::Leads.warning(LEADS));
    }
    if found.relative > POOR {
        result.warn(WarningCode::PoorFit.warning(format!(
            "the residual of {} is {} % of the measured signal: there are more modes, or the applied signal does \
             not explain it; omit or raise --modes, check the coherence (--html), and choose another --band",
            plural(found.modal.poles.len(), "mode"),
            rounded(100.0 * found.relative, 2)
        )));
    }
    noise_before_resonance(result, found.gain_error);
}

/// Minimum reported spectrum of the force near the Nyquist frequency, relative to DC.
const FOLDED: f64 = 0.01;
/// Resulting error of the gain, as a fraction of that. Spectra of pulses fall at least with the square of the
/// frequency, and at the Nyquist frequency twice the level is seen: a quarter of it aliases from both sides of the
/// sampling rate to DC, a third of the remainder of sharp edges.
const OF_GAIN: f64 = 1.0 / 3.0;

/// Warns about pulses so short that frequencies above the Nyquist frequency alias into their
/// spectrum.
pub(super) fn short_pulses(result: &mut Identification, part: f64) {
    if part > FOLDED {
        result.warn(WarningCode::ShortPulse.warning(format!(
            "the hammer pulses last only a few samples, so frequencies above half the rate alias into their \
             spectrum: gains may be wrong by about {} %, which their uncertainties do not include, unless the \
             recorder has an anti-aliasing filter; record at a higher rate, or use a softer tip",
            rounded(100.0 * OF_GAIN * part, 1)
        )));
    }
}

/// Minimum reported amplitude of a response when the next hit follows, relative to its largest.
const OVERLAPS: f64 = 0.01;

/// Warns about hits that follow before the response to the previous one has decayed.
pub(super) fn overlapping_hits(result: &mut Identification, left: f64) {
    if left > OVERLAPS {
        result.warn(WarningCode::HitsOverlap.warning(format!(
            "a response still rings at {} % of its maximum when the next hit follows, which then counts as an effect of \
             that hit: constants, and static gain most of all, may be wrong by about as much; wait longer between hits, \
             or give --excitation transient with --modes, which evaluates all hits of a record together",
            rounded(100.0 * left, 2)
        )));
    }
}

/// Minimum reported error of the gain due to noise in the applied signal.
const GAIN_ERROR: f64 = 1e-3;

/// Warns about noise on the force of hits that could not be separated from what follows the stroke.
pub(super) fn noise_on_force(result: &mut Identification, part: f64) {
    if part > GAIN_ERROR {
        result.warn(WarningCode::NoiseOnForce.warning(format!(
            "a slow signal follows the hammer strokes (AC coupling, a drifting zero), so the noise outside them \
             cannot be subtracted: the response is about {} % too small, which its uncertainties do not include; \
             use DC coupling for the hammer, or reduce its noise",
            rounded(100.0 * part, 2)
        )));
    }
}

/// Warns about noise that enters before the resonance.
fn noise_before_resonance(result: &mut Identification, gain_error: f64) {
    if gain_error > GAIN_ERROR {
        result.warn(WarningCode::NoiseBeforeResonance.warning(format!(
            "the residual follows the resonance: something else drives the stand, or the applied signal is noisy, \
             which makes the gain up to {} % too small (and J, f and K as much too large); their uncertainties \
             allow for it; reduce the noise of --applied or excite more",
            rounded(100.0 * gain_error, 2)
        )));
    }
}
