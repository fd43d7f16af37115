//! Stepwise search for the modes of a decay.

use std::f64::consts::PI;

use torqcomp_dsp::peaks::Peak;
use torqcomp_model::fit::FitError;

use super::attempt::Attempt;
use super::modes::{ModesFit, Stretch, linear_part};
use crate::identify::Pole;
use crate::identify::hum::SteadyLine;

/// Options of the search for modes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ModeSearch {
    /// Number of modes, if known.
    pub count: Option<usize>,
    /// Maximum number otherwise.
    pub most: usize,
    /// Lowest and highest frequency in Hz.
    pub band_hz: (f64, f64),
}

/// Relative frequency difference below which two lines are one mode, unless the number of modes is given or they are
/// clearly two: a frequency or damping that changes with amplitude or time looks similar.
const CLOSE: f64 = 0.03;

/// Power of the residual, relative to that of the decay, below which the search ends: 110 dB, beyond the
/// resolution of a recorder. The residual of computed decays is rounding error of their digits, which decays with
/// them.
pub(super) const RESOLVED: f64 = 1e-11;

/// Number of mains harmonics searched for a steady line.
const HARMONICS: f64 = 10.0;
/// Tolerance of the mains frequency about 50 or 60 Hz.
const OFF_HZ: f64 = 0.3;
/// Decay exponent over a record up to which a line counts as steady.
const STEADY: f64 = 0.3;

/// Remainder of a removed line: distance in cycles over the segment, and relative amplitude, which may be larger if it
/// hardly decays: the line was removed with a wrong frequency, and its phase drifts away.
const LEFT_NEAR: f64 = 2.0;
const LEFT_SHARE: [f64; 2] = [0.3, 1.0];
/// Decay exponent over the segment up to which a remainder hardly decays.
const LEFT_DECAY: f64 = 1.0;

/// Standard uncertainties by which the decay rate of a steady line may differ from zero.
const STEADY_STD: f64 = 3.0;

/// Searches for the modes. Steady mains lines are not modes, nor are other steady lines if something else decays: a
/// stand that hardly decays during the record is a mode, too.
///
/// # Errors
/// [`FitError`] if there are too few samples. Without a significant mode the fit is empty.
pub(super) fn search<'a>(
    stretches: &mut Vec<Stretch>,
    wanted: &ModeSearch,
    taken_off: &'a [SteadyLine],
) -> Result<Attempt<'a>, FitError> {
    let recorded = stretches.clone();
    let found = Attempt::of(stretches, wanted, taken_off, false)?;
    if !found.has_tone {
        return Ok(found);
    }
    let mut without = recorded;
    let other = Attempt::of(&mut without, wanted, taken_off, true)?;
    if !decays_clearly(&other.fit, &without) {
        return Ok(found);
    }
    *stretches = without;
    Ok(other)
}

/// Minimum distance of the decay rates of other modes from zero, in standard uncertainties, and minimum number of their
/// cycles, for a line to count as steady: a stand that rings for longer than the record looks steady too, and a drift
/// next to it is not a mode.
const CLEARLY: (f64, f64) = (5.0, 5.0);

/// Whether there are modes, all with significant decay and oscillation.
fn decays_clearly(found: &ModesFit, stretches: &[Stretch]) -> bool {
    let length = length_s(stretches);
    let one = |(k, pole): (usize, &Pole)| {
        let decays = found.fit.std[2 * k].is_some_and(|std| pole.rate_per_s > CLEARLY.0 * std);
        decays && pole.frequency_hz() * length > CLEARLY.1
    };
    !found.poles.is_empty() && found.poles.iter().enumerate().all(one)
}

/// Amplitude of a mode in the segment where it is largest.
pub(super) fn largest(found: &ModesFit, mode: usize, stretches: &[Stretch]) -> f64 {
    let amplitudes = (0..stretches.len()).map(|s| found.amplitude(mode, s));
    amplitudes.fold(0.0, f64::max)
}

/// A mode of a fit, if it is a line that does not decay.
pub(super) fn steady(found: &ModesFit, place: usize, stretches: &[Stretch]) -> Option<SteadyLine> {
    let pole = found.poles[place];
    let frequency_hz = pole.frequency_hz();
    let std = |k: usize| found.fit.std[2 * place + k];
    let of_grid = |grid_hz: f64| {
        let harmonic = (frequency_hz / grid_hz).round();
        let std_hz = std(1).map(|std| std / std::f64::consts::TAU);
        (1.0..=HARMONICS).contains(&harmonic)
            && (frequency_hz / harmonic - grid_hz).abs() < OFF_HZ
            && std_hz.is_some_and(|std| std < OFF_HZ * harmonic)
    };
    let is_of_mains = [50.0, 60.0].into_iter().any(of_grid);
    // Without an uncertainty the rate is at its bound, zero.
    let is_any = std(0).is_none_or(|std| pole.rate_per_s < STEADY_STD * std);
    let is_steady = pole.rate_per_s * length_s(stretches) < STEADY;
    (is_steady && (is_of_mains || is_any)).then(|| SteadyLine {
        frequency_hz,
        amplitude: largest(found, place, stretches),
        is_of_mains,
    })
}

/// Whether a mode of a fit is the remainder of a line removed before: near it and much smaller. A line fitted before
/// the decay next to it is not removed completely.
pub(super) fn is_left_of<'l>(
    mut lines: impl Iterator<Item = &'l SteadyLine>,
    found: &ModesFit,
    mode: usize,
    stretches: &[Stretch],
) -> bool {
    let near_hz = LEFT_NEAR / length_s(stretches);
    let frequency_hz = found.poles[mode].frequency_hz();
    let amplitude = largest(found, mode, stretches);
    let hardly_decays = found.poles[mode].rate_per_s * length_s(stretches) < LEFT_DECAY;
    let share = LEFT_SHARE[usize::from(hardly_decays)];
    lines.any(|line| {
        (line.frequency_hz - frequency_hz).abs() < near_hz && amplitude < share * line.amplitude
    })
}

/// Removes a mode of a fit from the segments.
pub(super) fn take_off(stretches: &mut [Stretch], found: &ModesFit, mode: usize) {
    for s in 0..stretches.len() {
        let line = found.part(stretches, mode, s);
        let values = stretches[s].values.iter_mut();
        values.zip(line).for_each(|(value, line)| *value -= line);
    }
}

/// Duration of the longest segment.
fn length_s(stretches: &[Stretch]) -> f64 {
    let ends = stretches.iter().filter_map(|s| s.times_s.last());
    ends.fold(0.0_f64, |m, t| m.max(*t))
}

/// Minimum gain for one more mode.
pub(super) const LEAST_GAIN: f64 = 20.0;

/// Gain of one more mode, the last of `after`: the reduction of the sum of squares relative to the noise power at the
/// mode's frequency, minus ln n for each parameter (Bayesian information criterion for known noise power). Noise that
/// peaks at the frequency of the first mode counts with its mean power: a stand that rings has a mode.
pub(super) fn gain(before: &ModesFit, after: &ModesFit, stretches: &[Stretch]) -> f64 {
    let Some(pole) = after.poles.last() else {
        return 0.0;
    };
    let squares = |residuals: &[f64]| residuals.iter().map(|r| r * r).sum::<f64>();
    let of_stretch = |s: usize| {
        let colour = &after.colours[s];
        let density = colour.density(pole.omega_rad_per_s * stretches[s].step_s());
        let density = match before.poles.is_empty() {
            true => density.min(colour.variance()),
            false => density,
        };
        (squares(&before.residuals[s]) - squares(&after.residuals[s])) / density
    };
    let n = after.fit.residuals.len() as f64;
    let more = (after.fit.values.len() - before.fit.values.len()) as f64;
    (0..stretches.len()).map(of_stretch).sum::<f64>() - more * n.ln()
}

/// Frequency in Hz of a mode that is too close to the last one, if any.
pub(super) fn close(poles: &[Pole]) -> Option<f64> {
    let (last, others) = poles.split_last()?;
    let found = others.iter().find(|other| is_close(other, last))?;
    Some(found.frequency_hz())
}

pub(super) fn is_close(a: &Pole, b: &Pole) -> bool {
    (a.omega_rad_per_s / b.omega_rad_per_s - 1.0).abs() < CLOSE
}

/// Standard uncertainties by which the decay rate of the first mode and of any other one must differ from zero. A stand
/// that rings has a mode, even if the record is too short to determine its damping.
const DECAYS: [f64; 2] = [1.0, 2.0];

/// Largest relative standard uncertainty of the frequency of any mode but the first.
const KNOWN: f64 = 0.3;

/// Whether every mode except the tones decays significantly, has more than one cycle, is below half the sampling rate,
/// and differs from the others.
pub(super) fn physical(found: &ModesFit, stretches: &[Stretch], tones: &[usize]) -> bool {
    let length = length_s(stretches);
    let is_all = stretches.iter().all(|s| s.bands_hz.is_empty());
    let highest = stretches.iter().map(|s| PI * s.rate_hz());
    let highest = highest.fold(f64::INFINITY, f64::min);
    let one = |(k, pole): (usize, &Pole)| {
        let natural = pole.omega_rad_per_s.hypot(pole.rate_per_s);
        let std = found.fit.std[2 * k + 1];
        let is_vague = k > 0 && std.is_some_and(|std| std > KNOWN * pole.omega_rad_per_s);
        let is_seen = (!is_all || natural < highest) && !is_vague;
        let rate_std = found.fit.std[2 * k];
        let turns = pole.frequency_hz() * length;
        let least = match k {
            0 => DECAYS[0],
            _ => DECAYS[1],
        };
        let known = rate_std.is_some_and(|std| pole.rate_per_s > least * std);
        let rings = pole.omega_rad_per_s > pole.rate_per_s && turns > 1.5;
        let apart = found.poles[..k].iter().all(|other| {
            let near = (other.omega_rad_per_s - pole.omega_rad_per_s).abs();
            near > 0.2 * (other.rate_per_s + pole.rate_per_s) || near * length > 3.0
        });
        tones.contains(&k) || known && rings && apart && is_seen
    };
    found.poles.iter().enumerate().all(one)
}

/// Start values for one more mode.
pub(super) fn next_pole(
    stretches: &[Stretch],
    so_far: &ModesFit,
    band_hz: (f64, f64),
) -> Option<Pole> {
    let loudest = (0..stretches.len()).max_by(|a, b| {
        let power = |s: usize| so_far.residuals[s].iter().map(|r| r * r).sum::<f64>();
        power(*a).total_cmp(&power(*b))
    })?;
    let stretch = &stretches[loudest];
    let left: Vec<f64> = so_far.residuals[loudest].iter().map(|r| -r).collect();
    let length = *stretch.times_s.last()?;
    let uniform = on_grid(&stretch.times_s, &left, stretch.rate_hz());
    let (lowest, highest) = (band_hz.0.max(1.5 / length), band_hz.1);
    let within = |from, to| stretch.strongest(&uniform, from..to);
    let peak = within(lowest, highest)?;
    // Coloured noise can have a stronger line than a short-lived mode.
    let below = within(lowest, peak.frequency_hz / APART);
    let above = within(peak.frequency_hz * APART, highest);
    let rest = Stretch::new(&stretch.times_s, left);
    let starts = [Some(peak), below, above];
    let starts = starts.into_iter().flatten().flat_map(starts_at);
    let tried = starts.filter_map(|pole| {
        let (_, residuals) = linear_part(&rest, &[pole]).ok()?;
        Some((residuals.iter().map(|r| r * r).sum::<f64>(), pole))
    });
    let best = tried.min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, pole)| pole)
}

/// Frequency ratio of lines tried in addition to the strongest.
const APART: f64 = 1.5;

/// Candidate poles of a line.
fn starts_at(peak: Peak) -> impl Iterator<Item = Pole> {
    let omega = std::f64::consts::TAU * peak.frequency_hz;
    let wide = PI * peak.width_hz;
    [0.05, 0.15, 0.4, 1.0, 2.0].into_iter().flat_map(move |f| {
        [-0.5, 0.0, 0.5].into_iter().map(move |shift| Pole {
            rate_per_s: f * wide,
            omega_rad_per_s: (omega + shift * wide).max(0.1 * omega),
        })
    })
}

/// Linear interpolation at equal steps, sufficient for start values.
fn on_grid(times_s: &[f64], values: &[f64], rate_hz: f64) -> Vec<f64> {
    let mut out = Vec::with_capacity(values.len());
    let mut k = 0;
    for i in 0..values.len() {
        let t = (i as f64 / rate_hz).min(times_s[times_s.len() - 1]);
        while k + 2 < times_s.len() && times_s[k + 1] < t {
            k += 1;
        }
        let (t0, t1) = (times_s[k], times_s[k + 1]);
        let part = ((t - t0) / (t1 - t0)).clamp(0.0, 1.0);
        out.push(values[k] + part * (values[k + 1] - values[k]));
    }
    out
}
