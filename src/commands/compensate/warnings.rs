//! Warnings about a compensated record.

use torqcomp_dsp::noise::RecordNoise;
use torqcomp_model::Mode;

use super::Seen;
use super::plot::Traces;
use super::report::CompensateReport;
use crate::inverse::ChainInverse;
use crate::print::{rounded, short};
use crate::quality::{excerpt, resonance};
use crate::stand::{Stand, off_rated};
use crate::warning::{Warning, WarningCode};

/// Gain from which a record of unknown noise gets a warning.
const LARGE_GAIN: f64 = 10.0;
/// Rms above the band over that within it, from which a warning is given.
const ABOVE_BAND: f64 = 0.1;
/// Rms of the result over that of the record, from which a warning is given.
const AMPLIFIED: f64 = 10.0;
/// Noise fraction of the result from which a warning is given.
const NOISY_FRACTION: f64 = 0.5;

/// Adds the warnings to an otherwise complete report.
pub(super) fn add(report: &mut CompensateReport, seen: &Seen, traces: Option<&Traces>) {
    let mut more = seen.summary.all_warnings();
    match &report.noise.record {
        Some(noise) => more.extend(of_noise(noise, report)),
        None => more.extend(of_unknown_noise(report)),
    }
    more.extend(
        report
            .band
            .question(&report.unit, report.scale, report.result.rms),
    );
    report.looked_at = seen.excerpt.len();
    more.extend(of_quality(report, seen));
    more.extend(resonance::warning(
        &seen.excerpt,
        report.rate_hz,
        &report.modes,
    ));
    let levels = &report.levels;
    more.extend(levels.warnings(&seen.excerpt, report.scale, &report.unit));
    let peak = report.result.peak();
    more.extend(off_rated(peak, report.rated_torque, &report.unit));
    if traces.is_some_and(Traces::is_empty) {
        more.push(empty_plot(report));
    }
    more.extend(of_length(report));
    report.warnings.extend(more);
}

/// A warning if the stand rings above the Nyquist frequency, and nothing before the recorder filters that out.
pub(super) fn of_ringing(stand: &Stand, rate_hz: f64) -> Option<Warning> {
    let limit_hz = 0.5 * rate_hz;
    let modes = stand.modes().ok()?;
    let above = modes.parts().iter().map(|part| part.mode);
    let above = above.filter(|mode| mode.natural_frequency_hz() > limit_hz);
    let first = |a: &Mode, b: &Mode| a.omega_rad_s.total_cmp(&b.omega_rad_s);
    let mode = above.min_by(first)?;
    let resonance_hz = mode.natural_frequency_hz();
    let low_pass = stand.recorder.low_pass;
    let is_kept_out = low_pass.is_some_and(|low_pass| low_pass.cutoff_hz <= limit_hz);
    (!is_kept_out && mode.damping_ratio < 0.5).then(|| {
        WarningCode::ResonanceAboveNyquist.warning(format!(
            "the stand resonates at {} Hz, above half the sampling rate of {} Hz: after steps and shocks its \
             ringing aliases into the record and cannot be removed; record at {} Hz or more, or through a low-pass \
             (declared as [recorder] low_pass)",
            rounded(resonance_hz, 4),
            short(rate_hz),
            rounded(5.0 * resonance_hz, 2)
        ))
    })
}

/// A warning if the ends of the record affect the result beyond the filter's own ends.
pub(super) fn of_ends(undo: Option<&ChainInverse>, edge_s: f64) -> Option<Warning> {
    let effect = undo?.endless()?;
    Some(WarningCode::EndsFeltFar.warning(format!(
        "the inverse of \"{effect}\" is infinitely long: what happened before and after the record affects more \
         than the first and last {} s, and decreases only in proportion to the distance; discard more at both \
         ends, or record from rest to rest",
        rounded(edge_s, 3)
    )))
}

/// A warning if the record does not contain the mean torque.
pub(super) fn of_mean(undo: Option<&ChainInverse>) -> Option<Warning> {
    let effect = undo?.blocks_constants()?;
    Some(WarningCode::MeanUnknown.warning(format!(
        "\"{effect}\" does not pass a constant, so the mean of the torque and its slope over the record are unknown, \
         and those of the result are arbitrary; record with DC coupling if you need them"
    )))
}

fn of_unknown_noise(report: &CompensateReport) -> Option<Warning> {
    let gain = report.noise.largest_gain;
    (gain > LARGE_GAIN && report.band.is_given()).then(|| {
        WarningCode::NoiseUnknown.warning(format!(
            "the record is amplified up to {} times, and its noise is unknown; choose a lower --band if the result \
             looks noisy",
            rounded(gain, 3)
        ))
    })
}

fn of_quality(report: &CompensateReport, seen: &Seen) -> Vec<Warning> {
    let of = excerpt::Of {
        name: &report.channel,
        unit: &report.unit,
        scale: report.scale,
        rate_hz: report.rate_hz,
        start: report.start,
        samples: report.samples,
        faults: seen.faults,
    };
    excerpt::warnings(&seen.excerpt, of)
}

fn empty_plot(report: &CompensateReport) -> Warning {
    let end = report
        .start
        .later((report.samples - 1) as f64 / report.rate_hz);
    WarningCode::EmptyPlot.warning(format!(
        "--plot-range contains no samples; the record runs from {} to {}",
        report.start.text(),
        end.text()
    ))
}

fn of_length(report: &CompensateReport) -> Option<Warning> {
    // Each end matters up to `edge_s`, most of it up to `reach_s`.
    let needed = (2.0 * report.reach_s).max(report.edge_s) * report.rate_hz;
    ((report.samples as f64) < needed).then(|| {
        WarningCode::ShortRecord.warning(format!(
            "the record has {} samples, and all of the result depends on extrapolation beyond \
             its ends; record at least {} samples for a band of {} Hz",
            report.samples,
            needed as usize,
            short(report.band_hz)
        ))
    })
}

/// A warning if the result is many times larger than the record.
fn of_amplification(noise: &RecordNoise, report: &CompensateReport) -> Option<Warning> {
    let (unit, rms) = (&report.unit, report.result.rms);
    let amplifies = report.noise.largest_gain > 1.0;
    (amplifies && rms > AMPLIFIED * noise.in_band_rms).then(|| {
        WarningCode::MostlyAmplified.warning(format!(
            "the result is {} times the record, {} instead of {} {unit} rms: nearly all of it comes from far above \
             the resonance, amplified up to {} times. Check the mechanics of the stand, the sampling rate of {} \
             Hz, and --band",
            rounded(rms / noise.in_band_rms, 3),
            rounded(rms, 3),
            rounded(noise.in_band_rms, 3),
            rounded(report.noise.largest_gain, 3),
            short(report.rate_hz)
        ))
    })
}

fn of_noise(noise: &RecordNoise, report: &CompensateReport) -> Vec<Warning> {
    let (band_hz, unit, rms) = (report.band_hz, &report.unit, report.result.rms);
    let mut warnings = Vec::new();
    if noise.above_band_rms > ABOVE_BAND * noise.in_band_rms {
        warnings.push(WarningCode::SignalAboveBand.warning(format!(
            "{} {unit} rms of the record lie above the band of {} Hz and are removed; {} {unit} rms \
             lie within it",
            rounded(noise.above_band_rms, 3),
            short(band_hz),
            rounded(noise.in_band_rms, 3)
        )));
    }
    // A chosen band ends at the least expected error, possibly above the frequency where the noise equals the signal.
    let lost_from_hz = noise.lost_from_hz(band_hz);
    let is_amplified = |from_hz: f64| {
        let mut gains = report.noise.gain.iter();
        gains.any(|at| at.frequency_hz >= from_hz && at.gain > 1.0)
    };
    let matters = |hz: &f64| *hz == 0.0 || report.band.is_given() && is_amplified(*hz);
    if let Some(from_hz) = lost_from_hz.filter(matters) {
        let remedy = if from_hz > 0.0 {
            format!("--band {} excludes it", rounded(from_hz, 4))
        } else {
            "the whole band is affected, and only the mean is known: right for a constant load, otherwise check the \
             channel"
                .to_owned()
        };
        warnings.push(WarningCode::BandLostInNoise.warning(format!(
            "from {} to {} Hz the record is no larger than its noise, which the compensation \
             amplifies; {remedy}",
            rounded(from_hz, 4),
            short(band_hz)
        )));
    }
    warnings.extend(of_amplification(noise, report));
    if rms > 0.0 && noise.compensated_rms > NOISY_FRACTION * rms {
        warnings.push(WarningCode::MostlyNoise.warning(format!(
            "noise makes up {} of {} {unit} rms of the result; {}",
            rounded(noise.compensated_rms, 3),
            rounded(rms, 3),
            match report.band.is_given() {
                true => "choose a lower --band",
                false => "record with less noise",
            }
        )));
    }
    warnings
}
