//! Frequencies and damping from free decays (Appendix C, II).

mod by_hand;
mod laws;
mod modes;

use std::f64::consts::TAU;

use torqcomp_dsp::{decimate, onset, peaks};

use super::{Comparison, Correlated, Found, Outcome, Quality, STRONG, rms};
use crate::failure::Failure;
use crate::report::chart::{Chart, Series};
use crate::report::{rounded, short};

pub use laws::{Law, LawFit, envelope};
use modes::Wanted;
pub use modes::{ModesFit, Pole, Stretch};

/// A record with decays in it.
#[derive(Debug, Clone, Copy)]
pub struct Ringing<'a> {
    /// Name of the record, for messages.
    pub name: &'a str,
    /// Times in seconds, rising; they need not be uniform.
    pub times_s: &'a [f64],
    /// Samples a second, if the times are uniform.
    pub rate_hz: Option<f64>,
    /// Values.
    pub values: &'a [f64],
}

/// How decays are evaluated.
#[derive(Debug, Clone, Copy, Default)]
pub struct Options {
    /// Number of modes; found from the data if not given.
    pub modes: Option<usize>,
    /// Part of the time axis to use, in seconds.
    pub range_s: Option<(f64, f64)>,
    /// Lowest and highest frequency of the modes looked for, in Hz. What lies above is filtered away.
    pub band_hz: Option<(f64, f64)>,
}

/// A decay that was evaluated, with what is needed to draw it.
#[derive(Debug, Clone)]
pub struct Evaluated {
    /// The numbers.
    pub outcome: Outcome,
    /// The stretches that were fitted.
    pub stretches: Vec<Stretch>,
    /// Start of each stretch on its record's time axis, in seconds.
    pub starts_s: Vec<f64>,
    /// The fit.
    pub fit: ModesFit,
    /// The laws of damping in order of what speaks for them; empty for several modes.
    pub laws: Vec<LawFit>,
}

/// Fewest samples of a record.
const LEAST_SAMPLES: usize = 40;
/// Most modes looked for.
const MOST_MODES: usize = 12;
/// Most samples of all stretches together that are fitted at once.
const MOST_SAMPLES: usize = 40_000;
/// Stretches beyond that number are left out.
const MOST_STRETCHES: usize = 12;
/// Power of a line relative to the strongest from which on it counts when the rate is lowered.
const WORTH: f64 = 1e-6;

/// Evaluates one or several records of the same free ringing.
///
/// # Errors
/// If nothing rings, or there is too little of it.
pub fn identify(records: &[Ringing], options: &Options) -> Result<Evaluated, Failure> {
    let mut outcome = Outcome::default();
    let (stretches, starts_s) = stretches(records, options, &mut outcome)?;
    let wanted = Wanted {
        count: options.modes,
        most: MOST_MODES,
        band_hz: options.band_hz.unwrap_or((0.0, f64::INFINITY)),
    };
    let fit = modes::search(&stretches, &wanted)?;
    if let Some(frequency_hz) = fit.close_hz {
        outcome.warn(
            "close-lines",
            format!(
                "what is left holds a line within 3 % of {} Hz: a second mode close by (then give --modes), \
                 or a frequency or damping that changes with amplitude or time",
                rounded(frequency_hz, 4)
            ),
        );
    }
    if fit.poles.is_empty() {
        return Err(Failure::failed(
            "nothing in the record rings: no decaying sine stands out of the noise; check the channel, \
             or cut the record to the decay with --range",
        ));
    }
    for (k, pole) in fit
        .poles
        .iter()
        .enumerate()
        .filter(|(k, _)| fit.fit.at_bound[2 * k])
    {
        outcome.warn(
            "at-bound",
            format!(
                "mode {} at {} Hz does not decay in this record: its damping is not told",
                k + 1,
                rounded(pole.omega_rad_per_s / TAU, 5)
            ),
        );
    }
    let order = fit.by_strength(stretches.len());
    for (place, k) in order.iter().enumerate() {
        name_mode(&mut outcome, &fit, *k, place, order.len());
    }
    let values: Vec<f64> = stretches
        .iter()
        .enumerate()
        .flat_map(|(s, stretch)| {
            let (c, d) = fit.trend(s);
            stretch
                .times_s
                .iter()
                .zip(&stretch.values)
                .map(move |(t, y)| y - c - d * t)
        })
        .collect();
    outcome.quality = Some(Quality {
        rms: fit.fit.rms,
        unit: String::new(),
        relative: fit.fit.rms / rms(&values),
    });
    outcome.method.push(format!(
        "nonlinear least squares over {} stretch(es), {} samples: {} decaying sine(s), with an offset and a \
         drift of each stretch",
        stretches.len(),
        fit.fit.residuals.len(),
        fit.poles.len()
    ));
    correlations(&mut outcome, &fit);
    let main = order[0];
    let laws = damping_law(&mut outcome, &fit, &stretches)?;
    amplitude_dependence(&mut outcome, &fit, &stretches, main);
    by_hand(&mut outcome, &fit, &stretches, main);
    draw(&mut outcome, &fit, &stretches, &starts_s);
    if !fit.fit.stop.converged() {
        outcome.warn(
            "not-converged",
            "the fit stopped before it reached its minimum",
        );
    }
    Ok(Evaluated {
        outcome,
        stretches,
        starts_s,
        fit,
        laws,
    })
}

/// Cuts all records into stretches of free ringing and lowers their rate where nothing is lost.
fn stretches(
    records: &[Ringing],
    options: &Options,
    outcome: &mut Outcome,
) -> Result<(Vec<Stretch>, Vec<f64>), Failure> {
    let mut cut = Vec::new();
    for record in records {
        let (times, values) = prepared(record, options, outcome)?;
        for range in onset::decays(&values) {
            let start = times[range.start];
            cut.push((
                start,
                Stretch {
                    times_s: times[range.clone()].iter().map(|t| t - start).collect(),
                    values: values[range].to_vec(),
                },
                record.rate_hz,
            ));
        }
    }
    if cut.is_empty() {
        return Err(Failure::failed(
            "the record does not swing; choose another channel or range",
        ));
    }
    if cut.len() > MOST_STRETCHES {
        outcome.warn(
            "decays-left-out",
            format!(
                "{} decays were found; the first {MOST_STRETCHES} are used",
                cut.len()
            ),
        );
        cut.truncate(MOST_STRETCHES);
    }
    let total: usize = cut.iter().map(|(_, stretch, _)| stretch.values.len()).sum();
    let mut all = Vec::new();
    let mut starts = Vec::new();
    for (start, stretch, rate_hz) in cut {
        let share = MOST_SAMPLES * stretch.values.len() / total;
        let factor = match (rate_hz, options.band_hz) {
            (Some(rate), None) => factor(&stretch.values, rate, share),
            _ => 1,
        };
        let (later, stretch) = slower(&stretch, factor)?;
        if factor > 1 {
            outcome.method.push(format!(
                "the rate was lowered to one sample in {factor}: nothing rings above {} Hz",
                short(decimate::PASS * rate_hz.unwrap_or(0.0) / factor as f64)
            ));
        }
        starts.push(start + later);
        all.push(stretch);
    }
    outcome.method.dedup();
    Ok((all, starts))
}

/// The part of a record that is asked for, low-passed and slower if a band is given.
fn prepared(
    record: &Ringing,
    options: &Options,
    outcome: &mut Outcome,
) -> Result<(Vec<f64>, Vec<f64>), Failure> {
    if let Some(i) = record.values.iter().position(|v| !v.is_finite()) {
        return Err(Failure::failed(format_args!(
            "{}: sample {} is not a number; cut the record there with --range",
            record.name,
            i + 1
        )));
    }
    let (from, to) = options
        .range_s
        .unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
    let first = record.times_s.partition_point(|t| *t < from);
    let last = record.times_s.partition_point(|t| *t <= to);
    if last < first + LEAST_SAMPLES {
        return Err(Failure::failed(format_args!(
            "{}: {} samples are too few for a decay; {LEAST_SAMPLES} are needed",
            record.name,
            last.saturating_sub(first)
        )));
    }
    let whole = Stretch {
        times_s: record.times_s[first..last].to_vec(),
        values: record.values[first..last].to_vec(),
    };
    let (Some((_, highest)), Some(rate_hz)) = (options.band_hz, record.rate_hz) else {
        return Ok((whole.times_s, whole.values));
    };
    let factor = ((decimate::PASS * rate_hz / highest).floor() as usize).max(1);
    if factor > 1 {
        outcome.method.push(format!(
            "low-passed above {} Hz, one sample in {factor} kept",
            short(highest)
        ));
    }
    let few = decimate::decimate(&whole.values, factor)?;
    let times = whole.times_s[few.first..].iter().step_by(factor);
    Ok((
        times.take(few.samples.len()).copied().collect(),
        few.samples,
    ))
}

/// A stretch at a lower rate, and how much later it starts.
fn slower(stretch: &Stretch, factor: usize) -> Result<(f64, Stretch), Failure> {
    let few = decimate::decimate(&stretch.values, factor)?;
    let later = stretch.times_s[few.first];
    let kept = stretch.times_s[few.first..]
        .iter()
        .step_by(factor)
        .take(few.samples.len());
    Ok((
        later,
        Stretch {
            times_s: kept.map(|t| t - later).collect(),
            values: few.samples,
        },
    ))
}

/// How many samples can become one: as far as the highest line allows, and only where there are many.
fn factor(values: &[f64], rate_hz: f64, enough: usize) -> usize {
    if values.len() <= enough.max(1000) {
        return 1;
    }
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let centred: Vec<f64> = values.iter().map(|v| v - mean).collect();
    let Some(highest) = peaks::highest(&centred, rate_hz, WORTH) else {
        return 1;
    };
    let allowed = (decimate::PASS * rate_hz / highest.max(1e-12)).floor() as usize;
    let needed = values.len().div_ceil(enough.max(1000));
    allowed.min(needed).clamp(1, values.len() / 200)
}

/// Frequency, damping and natural frequency of a mode with their uncertainties, (C7) to (C14).
fn name_mode(outcome: &mut Outcome, fit: &ModesFit, k: usize, place: usize, count: usize) {
    let pole = fit.poles[k];
    let (sigma, omega) = (pole.rate_per_s, pole.omega_rad_per_s);
    let natural = sigma.hypot(omega);
    let covariance = &fit.fit.covariance;
    let std = |by_sigma: f64, by_omega: f64| {
        let mut gradient = vec![0.0; fit.fit.values.len()];
        gradient[2 * k] = by_sigma;
        gradient[2 * k + 1] = by_omega;
        covariance.std_of(&gradient)
    };
    let name = |text: &str| match count {
        1 => text.to_owned(),
        _ => format!("mode_{}_{text}", place + 1),
    };
    // ζ = σ/ω_n: ∂ζ/∂σ = ω²/ω_n³, ∂ζ/∂ω = −σω/ω_n³.
    let cube = natural.powi(3);
    let rows = [
        ("damped_frequency", omega / TAU, std(0.0, 1.0 / TAU), "Hz"),
        ("decay_rate", sigma, std(1.0, 0.0), "1/s"),
        (
            "damping_ratio",
            sigma / natural,
            std(omega * omega / cube, -sigma * omega / cube),
            "",
        ),
        (
            "natural_frequency",
            natural / TAU,
            std(sigma / natural / TAU, omega / natural / TAU),
            "Hz",
        ),
    ];
    for (text, value, std, unit) in rows {
        outcome.found.push(Found::new(name(text), value, std, unit));
    }
}

fn correlations(outcome: &mut Outcome, fit: &ModesFit) {
    let count = 2 * fit.poles.len();
    let name = |i: usize| {
        let what = if i.is_multiple_of(2) {
            "decay rate"
        } else {
            "frequency"
        };
        format!(
            "{what} at {} Hz",
            rounded(fit.poles[i / 2].omega_rad_per_s / TAU, 5)
        )
    };
    for i in 0..count {
        for j in i + 1..count {
            if let Some(coefficient) = fit.fit.correlation(i, j).filter(|c| c.abs() >= STRONG) {
                outcome.correlated.push(Correlated {
                    first: name(i),
                    second: name(j),
                    coefficient,
                });
            }
        }
    }
}

/// A law is preferred if its criterion is lower by that much.
const CLEARLY: f64 = 10.0;
/// … and what it leaves is less by this part.
const WORTHWHILE: f64 = 0.01;

fn damping_law(
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
fn amplitude_dependence(outcome: &mut Outcome, fit: &ModesFit, stretches: &[Stretch], main: usize) {
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

fn by_hand(outcome: &mut Outcome, fit: &ModesFit, stretches: &[Stretch], main: usize) {
    let pole = fit.poles[main];
    let (offset, _) = fit.trend(0);
    if let Some((frequency_hz, rate)) =
        by_hand::log_decrement(&stretches[0], offset, pole.omega_rad_per_s)
    {
        let natural = rate.hypot(TAU * frequency_hz);
        outcome.comparisons.push(Comparison {
            method: "logarithmic decrement of successive peaks".to_owned(),
            found: vec![
                Found::new("damped_frequency", frequency_hz, None, "Hz"),
                Found::new("decay_rate", rate, None, "1/s"),
                Found::new("damping_ratio", rate / natural, None, ""),
            ],
            quality: None,
        });
    }
    if let Some((frequency_hz, ratio)) =
        by_hand::half_power(&stretches[0], offset, pole.omega_rad_per_s)
    {
        outcome.comparisons.push(Comparison {
            method: "half-power width of the spectrum".to_owned(),
            found: vec![
                Found::new("natural_frequency", frequency_hz, None, "Hz"),
                Found::new("damping_ratio", ratio, None, ""),
            ],
            quality: None,
        });
    }
}

/// The longest stretch with its fit, and what is left.
fn draw(outcome: &mut Outcome, fit: &ModesFit, stretches: &[Stretch], starts_s: &[f64]) {
    let Some(s) = (0..stretches.len()).max_by_key(|s| stretches[*s].values.len()) else {
        return;
    };
    let times: Vec<f64> = stretches[s]
        .times_s
        .iter()
        .map(|t| t + starts_s[s])
        .collect();
    let left: Vec<f64> = fit.residuals[s].iter().map(|r| -r).collect();
    let both = vec![
        Series::line("data", &times, &stretches[s].values),
        Series::line("fit", &times, &fit.curve(stretches, s)),
    ];
    outcome
        .charts
        .push(Chart::new("Decay and fit", "time, s", "signal", both));
    let rest = vec![Series::line("data less fit", &times, &left)];
    outcome
        .charts
        .push(Chart::new("Residual", "time, s", "signal", rest));
}
