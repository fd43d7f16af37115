//! Frequencies and damping from free decays (Appendix C, II).

mod anew;
mod attempt;
mod baseline;
mod by_hand;
mod dependence;
mod first_period;
mod friction;
mod jumps;
mod laws;
mod modes;
mod one_mode;
mod present;
mod restart;
mod scatter;
mod search;
mod stretches;
mod turns;

use super::hum::SteadyLine;
use super::{FitQuality, Identification, ModalPole, hum, overtone, rms};
use crate::failure::Failure;
use crate::warning::Warning;

use anew::Beginning;
use attempt::Attempt;
pub use laws::{Law, LawConstant, LawFit, envelope};
use modes::ModesFit;
pub use modes::Stretch;
use search::ModeSearch;

/// A recording that contains decays.
#[derive(Debug, Clone, Copy)]
pub struct Ringing<'a> {
    /// Name of the recording, for messages.
    pub name: &'a str,
    /// Ascending times in seconds, not necessarily uniform.
    pub times_s: &'a [f64],
    /// Sampling rate, if the times are uniform.
    pub rate_hz: Option<f64>,
    /// Samples.
    pub values: &'a [f64],
}

/// Options for the evaluation of decays.
#[derive(Debug, Clone, Copy, Default)]
pub struct DecayOptions {
    /// Number of modes; chosen from the data if not given.
    pub modes: Option<usize>,
    /// Lowest and highest frequency of the modes, in Hz. Higher frequencies are filtered out.
    pub band_hz: Option<(f64, f64)>,
}

/// Maximum number of modes searched for.
const MOST_MODES: usize = 12;

/// Evaluates one or several recordings of free decays of one stand; returns the result and the fitted segments.
///
/// # Errors
/// If there is no decay, or the decays are too short.
pub fn identify(
    records: &[Ringing],
    options: &DecayOptions,
) -> Result<(Identification, Vec<Stretch>), Failure> {
    let (result, stretches, _) = evaluated(records, options)?;
    Ok((result, stretches))
}

/// The result, with the moments at which decays begin anew.
fn evaluated(
    records: &[Ringing],
    options: &DecayOptions,
) -> Result<(Identification, Vec<Stretch>, Vec<Beginning>), Failure> {
    let mut result = Identification::new("decay");
    let (mut stretches, mut lines) = stretches::stretches(records, options, &mut result)?;
    let wanted = ModeSearch {
        count: options.modes,
        most: MOST_MODES,
        band_hz: options.band_hz.unwrap_or((0.0, f64::INFINITY)),
    };
    let recorded = stretches.clone();
    let (found, beginnings) = found(&mut stretches, (&wanted, &lines))?;
    if found.fit.has_friction {
        result.method.extend(present::stops(&recorded, &stretches));
    }
    let consequences = [stretches::OWN_PARTS, LEFT_OUT];
    let told = present::beginnings(&beginnings, consequences);
    result.warnings.extend(told);
    let (fit, has_baseline) = (found.fit, found.has_baseline);
    let more = found.lines;
    lines.extend(more);
    if fit.poles.is_empty() {
        return Err(present::no_mode(&lines));
    }
    hum::taken_off(&mut result, &lines);
    present::fit_warnings(&mut result, &fit);
    let reported = modes::with_honest_std(&fit, &stretches)?;
    let reported = scatter::widened(&mut result, reported, &stretches);
    let order = fit.by_strength(stretches.len());
    tell_modes(&mut result, &fit, &reported, &order);
    result.fit = Some(quality(&fit, &stretches));
    result.method.push(present::method(&fit, stretches.len()));
    if has_baseline {
        result.method.push(present::BASELINE.to_owned());
    }
    present::correlations(&mut result, &reported);
    dependence::damping_law(&mut result, &fit, &stretches)?;
    dependence::amplitude_dependence(&mut result, &fit, &stretches, order[0]);
    present::apart(&mut result, &fit, stretches.len());
    present::crowded(&mut result, &fit, order[0]);
    tell_overtones(&mut result, &fit, order[0], stretches.len());
    present::poor(&mut result, &fit, &stretches, (order[0], has_baseline));
    by_hand::compare(&mut result, &fit, &stretches, order[0]);
    present::draw(&mut result, &fit, &stretches);
    Ok((result, stretches, beginnings))
}

/// The modes of the segments, or one with dry friction, and the moments at which decays begin anew; the segments are left
/// as they were fitted.
///
/// # Errors
/// If there are too few samples.
fn found<'a>(
    stretches: &mut Vec<Stretch>,
    (wanted, lines): (&ModeSearch, &'a [SteadyLine]),
) -> Result<(Attempt<'a>, Vec<Beginning>), Failure> {
    let recorded = stretches.clone();
    // A fit of many modes takes long, and dry friction looks like many.
    let few = ModeSearch {
        most: one_mode::SEVERAL,
        ..*wanted
    };
    let with_friction = |(one, moving): (ModesFit, Vec<Stretch>), stretches: &mut Vec<Stretch>| {
        let two = match wanted.count {
            None => one_mode::two_instead((&one, &moving), &recorded, (&few, lines))?,
            Some(_) => None,
        };
        let (found, kept) = two.unwrap_or_else(|| (Attempt::with_friction(one, wanted), moving));
        *stretches = kept;
        Ok((found, Vec::new()))
    };
    let mut found = search::search(stretches, &few, lines)?;
    if wanted.count.is_none() && found.fit.poles.len() >= few.most {
        if let Some(moving) = one_mode::at_once((&found.fit, stretches), &recorded, &few)? {
            return with_friction(moving, stretches);
        }
        // A decay that restarts looks like many modes, too.
        let (cut, beginnings) = anew::cut(found, stretches, (&few, lines))?;
        let is_restart = beginnings.iter().all(|beginning| beginning.rings_before);
        if !beginnings.is_empty() && is_restart && cut.fit.poles.len() < few.most {
            return Ok((cut, beginnings));
        }
        stretches.clone_from(&recorded);
        found = search::search(stretches, wanted, lines)?;
    }
    // What is driven at first looks like a baseline that moves.
    let with_baseline = found.has_baseline.then(|| suffixes(&recorded, stretches));
    let (mut found, mut beginnings) = anew::cut(found, stretches, (wanted, lines))?;
    if let Some(mut whole) = with_baseline.filter(|_| beginnings.is_empty()) {
        (found, beginnings) = anew::cut(found, &mut whole, (wanted, lines))?;
        if !beginnings.is_empty() {
            *stretches = whole;
        }
    }
    let is_split = found.fit.poles.len() > 1 || !beginnings.is_empty();
    if wanted.count.is_none_or(|modes| modes == 1)
        && (is_split || dependence::is_dry(&found.fit, stretches)?)
        && let Some(moving) = one_mode::instead((&found.fit, stretches), &recorded, wanted)?
    {
        return with_friction(moving, stretches);
    }
    Ok((found, beginnings))
}

/// The segments as recorded, without the first samples that fitted ones lack.
fn suffixes(recorded: &[Stretch], fitted: &[Stretch]) -> Vec<Stretch> {
    let pairs = recorded.iter().zip(fitted);
    let suffix = |(whole, fitted): (&Stretch, &Stretch)| {
        whole.later(whole.values.len() - fitted.values.len())
    };
    pairs.map(suffix).collect()
}

/// Adds the modes, the strongest first, with their constants.
fn tell_modes(result: &mut Identification, fit: &ModesFit, reported: &ModesFit, order: &[usize]) {
    for (place, k) in order.iter().enumerate() {
        let mode = ModalPole::new(
            fit.poles[*k],
            reported.fit.covariance.select(&[2 * k, 2 * k + 1]),
        );
        let names = [
            "damped_frequency",
            "decay_rate",
            "damping_ratio",
            "natural_frequency",
        ];
        let constants = mode.modal_constants().of_mode((place, order.len()), &names);
        result.parameters.extend(constants.list);
        result.modes.push(mode);
    }
}

/// Warns about a record that is not a single free decay after each hit.
///
/// # Errors
/// If there is no decay.
pub fn check(record: &Ringing) -> Result<Vec<Warning>, Failure> {
    let options = DecayOptions::default();
    let (found, _, beginnings) = evaluated(std::slice::from_ref(record), &options)?;
    let mut doubts: Vec<Warning> = found.warnings;
    doubts.retain(|doubt| doubt.code == "poor-fit");
    let again = |time_s: f64| Beginning {
        time_s,
        rings_before: true,
    };
    let restarts = stretches::restarts_s(record).into_iter().map(again);
    let all: Vec<Beginning> = restarts.chain(beginnings).collect();
    doubts.extend(present::beginnings(&all, [NOT_ONE, CUT_THERE]));
    Ok(doubts)
}

/// Consequence of a driven start where it is left out, and where a decay is fitted as a whole.
const LEFT_OUT: &str = "this part is left out; hit briefly, or give the free decay with --range";
const CUT_THERE: &str = "cut the record there with --range";

/// Consequence of a restart where a decay is fitted as a whole.
const NOT_ONE: &str = "a hand or a brake applied to the stand would look the same, and no single initial state \
    describes the decay; cut the record there with --range";

/// The residual, relative to the oscillation about offset and drift.
fn quality(fit: &ModesFit, stretches: &[Stretch]) -> FitQuality {
    let swing: Vec<f64> = (0..stretches.len())
        .flat_map(|s| fit.swing(stretches, s))
        .collect();
    FitQuality {
        rms: fit.fit.rms,
        unit: String::new(),
        relative: fit.fit.rms / rms(&swing),
    }
}

/// Warns about modes that are distortion of the strongest.
fn tell_overtones(result: &mut Identification, fit: &ModesFit, main: usize, stretches: usize) {
    let share = |k: usize| {
        let of = |s: usize| fit.amplitude(k, s) / fit.amplitude(main, s);
        (0..stretches).map(of).fold(0.0, f64::max)
    };
    let shares: Vec<f64> = (0..fit.poles.len()).map(share).collect();
    let advice = "hit more softly, or use a later part with --range";
    overtone::warn(result, &fit.poles, main, &shares, advice);
}
