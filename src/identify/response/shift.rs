//! Time shift between the channels.

use std::f64::consts::{FRAC_PI_2, PI};

use torqcomp_dsp::frf::Window;

use super::blocks::Set;
use super::foreign;
use super::order::{best_of_whole, grow};
use super::whole::Whole;
use super::{Data, Effort, FinalFit, Lag, Modal, ResponseOptions, scatter};
use crate::failure::Failure;
use crate::identify::Identification;
use crate::print::rounded;
use crate::warning::WarningCode;

/// Maximum number of modes tried together with a delay.
const MOST_MODES: usize = 3;
/// Ratio of the residual of whole records with a delay to that without, up to which there is a
/// delay.
const CLEARLY_LESS: f64 = 0.97;
/// Sine of the phase of the strongest mode's residue above which a delay is considered.
const TURNED: f64 = 0.05;
/// Spacings of trial delays, as phase of the strongest mode.
const STEPS_RAD: [f64; 3] = [0.4, 0.1, 0.02];
/// Ratio of the residual with a fitted delay to that with the best trial delay, up to which the
/// fits are equal.
const AS_GOOD: f64 = 1.001;

/// Ratio of the error with a delay and fewer modes to that without, up to which the former is preferred to a pole above
/// the band that does not ring.
const AS_FEW: f64 = 1.02;
/// Minimum delay in standard uncertainties.
const SIGNIFICANT: f64 = 3.0;

/// The fit with a delay, if that explains the response with fewer modes about as well as `coarse` does without: a
/// delay is not a sum of modes, so many modes are needed to imitate one. Its residual may be larger by what the fewer
/// parameters explain, `ln N/N` of its power each for N real numbers (Bayesian information criterion, see
/// [`FinalFit::criterion`]).
///
/// # Errors
/// If there are too few lines.
pub(super) fn of(
    set: &Set,
    options: &ResponseOptions,
    (data, coarse): (&Data, &Modal),
) -> Result<Option<Modal>, Failure> {
    // Leakage hides a delay; in whole records it is part of the model.
    if data.lag.is_some() || options.modes.is_some() || set.window == Window::Hann {
        return Ok(None);
    }
    let data = Data {
        lag: Some(Lag::Delay),
        ..data.clone()
    };
    let has_stand_in = foreign::has_out_of_band(coarse);
    let least = set.error(&coarse.response);
    let numbers = 2.0 * set.band.len() as f64;
    for late in with_fewer_modes(&data, coarse.poles.len(), options) {
        let late = late?;
        let std_s = scatter::of_poles(set, &data, &late)?.std(2 * late.poles.len());
        let is_known = std_s.is_some_and(|std_s| late.delay_s.abs() > SIGNIFICANT * std_s);
        // Three parameters with a normal mode, and the delay.
        let fewer = 4 * coarse.poles.len() - 3 * late.poles.len() - 1;
        let slack = match has_stand_in {
            true => AS_FEW,
            false => (0.5 * fewer as f64 * numbers.ln() / numbers).exp(),
        };
        if (is_known || has_stand_in) && set.error(&late.response) <= slack * least {
            return Ok(Some(late));
        }
    }
    Ok(None)
}

/// The fit of whole records with a delay, if its residual is clearly smaller than that of `fitted` without, or its
/// [criterion](FinalFit::criterion) no larger with fewer modes, and it turns the residue of the strongest mode to its
/// phase for a torque: `R = ∓j/(2 J ω_d)`.
///
/// # Errors
/// If there are too few lines.
pub(super) fn of_whole(
    whole: &mut Whole,
    set: &Set,
    options: &ResponseOptions,
    (data, fitted): (&Data, &FinalFit),
) -> Result<Option<FinalFit>, Failure> {
    if data.lag.is_some() {
        return Ok(None);
    }
    let data = Data {
        lag: Some(Lag::Delay),
        ..data.clone()
    };
    let most = match options.modes {
        Some(_) => 0,
        None => MOST_MODES.min(fitted.modal.poles.len() - 1),
    };
    let found = best_of_whole(whole, set, options, &data, most)?;
    let is_better = |found: &FinalFit| found.criterion <= fitted.criterion;
    if let Some(found) = found.filter(is_better) {
        return Ok(Some(found));
    }
    if turned_by(&fitted.modal) < TURNED {
        return Ok(None);
    }
    let poles = &fitted.modal.poles;
    let start_s = likeliest_delay(&data, &fitted.modal)?;
    let start = data.fit(poles, start_s, Effort::Coarse)?;
    let found = refined(whole, set, &data, &start)?;
    let is_better = |found: &FinalFit| {
        found.relative < CLEARLY_LESS * fitted.relative
            && turned_by(&found.modal) < turned_by(&fitted.modal)
    };
    Ok(found.filter(is_better))
}

/// The fit of whole records, starting from that of the averaged response; if delay and modes do not converge together,
/// with the best delay. `None` if none converges.
///
/// # Errors
/// If there are too few lines.
pub(super) fn refined(
    whole: &mut Whole,
    set: &Set,
    data: &Data,
    coarse: &Modal,
) -> Result<Option<FinalFit>, Failure> {
    match whole.refine(data, coarse, set) {
        None if data.lag.is_some() => best_delay(whole, set, data, coarse),
        found => Ok(found),
    }
}

/// The fit with the delay that minimises the residual. A delay and the phase of a mode are nearly equivalent near the
/// resonance, so that joint steps may diverge: trial delays come first, then the parabola through three of them.
/// Finally both are fitted together, if that converges.
fn best_delay(
    whole: &mut Whole,
    set: &Set,
    data: &Data,
    modal: &Modal,
) -> Result<Option<FinalFit>, Failure> {
    let fixed = Data {
        lag: None,
        ..data.clone()
    };
    let mut best: Option<FinalFit> = None;
    let mut try_one = |delay_s: f64, best: &mut Option<FinalFit>| -> Result<f64, Failure> {
        let poles = best.as_ref().map_or(&modal.poles, |best| &best.modal.poles);
        let Some(found) = whole.refine(&fixed, &fixed.with(poles, delay_s)?, set) else {
            return Ok(f64::INFINITY);
        };
        let left = found.relative.powi(2);
        if best
            .as_ref()
            .is_none_or(|best| found.relative < best.relative)
        {
            *best = Some(found);
        }
        Ok(left)
    };
    for delay_s in [modal.delay_s].into_iter().chain(delays_of(modal)) {
        try_one(delay_s, &mut best)?;
    }
    let Some((_, omega)) = modal.strongest_turn() else {
        return Ok(best);
    };
    for turn in STEPS_RAD {
        let Some(middle) = &best else { break };
        let (middle_s, middle, step_s) =
            (middle.modal.delay_s, middle.relative.powi(2), turn / omega);
        let before = try_one(middle_s - step_s, &mut best)?;
        let after = try_one(middle_s + step_s, &mut best)?;
        let bend = before - 2.0 * middle + after;
        if bend > 0.0 && bend.is_finite() {
            try_one(middle_s + 0.5 * step_s * (before - after) / bend, &mut best)?;
        }
    }
    let Some(fixed) = best else { return Ok(None) };
    let together = whole.refine(data, &fixed.modal, set);
    let is_as_good = |found: &FinalFit| found.relative < AS_GOOD * fixed.relative;
    Ok(Some(together.filter(is_as_good).unwrap_or(fixed)))
}

/// Fits with a delay and 1, 2, … modes, fewer than a limit, each starting from the previous one.
fn with_fewer_modes(
    data: &Data,
    count: usize,
    options: &ResponseOptions,
) -> impl Iterator<Item = Result<Modal, Failure>> {
    let next = |last: Option<&Modal>| match last {
        Some(last) => grow(data, last, options),
        None => grow(data, &data.fit(&[], 0.0, Effort::Coarse)?, options),
    };
    let mut last: Option<Modal> = None;
    let most = MOST_MODES.min(count.saturating_sub(1));
    (0..most).map_while(move |_| {
        let found = next(last.as_ref()).transpose()?;
        last = found.as_ref().ok().cloned();
        Some(found)
    })
}

/// The delays that explain the phase of a model's strongest mode, for a response of either sign.
fn delays_of(modal: &Modal) -> Vec<f64> {
    let Some((turn, omega)) = modal.strongest_turn() else {
        return Vec::new();
    };
    let delay = |of: f64| {
        let late = of - turn;
        modal.delay_s + late.sin().atan2(late.cos()) / omega
    };
    [-FRAC_PI_2, FRAC_PI_2].map(delay).into()
}

/// Of the delays that explain the phase of a model's strongest mode, whole half periods apart, the one with which
/// normal modes at the same poles have the smallest residual.
///
/// # Errors
/// If there are too few lines.
pub(super) fn likeliest_delay(data: &Data, modal: &Modal) -> Result<f64, Failure> {
    let Some((_, omega)) = modal.strongest_turn() else {
        return Ok(0.0);
    };
    let most_s = data.longest_delay_s();
    let halves = (most_s * omega / PI) as i32;
    let first_s = delays_of(modal).first().copied().unwrap_or(0.0);
    let mut best = (f64::INFINITY, 0.0);
    for delay_s in (-halves..=halves).map(|k| first_s + f64::from(k) * PI / omega) {
        let left = data.solve(&modal.poles, delay_s)?.sum_of_squares;
        if left < best.0 {
            best = (left, delay_s);
        }
    }
    Ok(best.1)
}

/// Sine of the phase of the strongest mode's residue.
fn turned_by(modal: &Modal) -> f64 {
    let turn = modal.strongest_turn();
    turn.map_or(0.0, |(turn, _)| turn.cos().abs())
}

/// The same data with an RC low-pass of the measured channel in place of a fitted delay, which it resembles; `None` if the
/// channel leads or a low-pass is declared.
fn with_low_pass(data: &Data, delayed: &Modal) -> Option<Data> {
    let is_possible = delayed.delay_s > 0.0
        && delayed.lag == Lag::Delay
        && !data
            .recorder
            .is_some_and(|recorder| recorder.has_low_pass());
    is_possible.then(|| Data {
        lag: Some(Lag::LowPass),
        ..data.clone()
    })
}

/// The fit of whole records with a low-pass in place of the delay of `fitted`, if its residual is clearly smaller.
///
/// # Errors
/// If there are too few lines.
pub(super) fn filtered_whole(
    whole: &mut Whole,
    set: &Set,
    data: &Data,
    fitted: FinalFit,
) -> Result<FinalFit, Failure> {
    let Some(data) = with_low_pass(data, &fitted.modal) else {
        return Ok(fitted);
    };
    let start = data.fit(&fitted.modal.poles, fitted.modal.delay_s, Effort::Coarse)?;
    let is_better = |found: &FinalFit| {
        found.modal.delay_s > 0.0 && found.relative < CLEARLY_LESS * fitted.relative
    };
    let found = whole.refine(&data, &start, set).filter(is_better);
    Ok(found.unwrap_or(fitted))
}

/// The fit of the averaged response, with a low-pass in place of a delay if its error is clearly smaller, and its data.
///
/// # Errors
/// If there are too few lines.
pub(super) fn filtered(set: &Set, data: &Data, coarse: &Modal) -> Result<(Data, Modal), Failure> {
    let fitted = data.fit(&coarse.poles, coarse.delay_s, Effort::Fine)?;
    if let Some(data) = with_low_pass(data, &fitted) {
        let found = data.fit(&fitted.poles, fitted.delay_s, Effort::Fine)?;
        let error = |modal: &Modal| set.error(&modal.response);
        if found.delay_s > 0.0 && error(&found) < CLEARLY_LESS * error(&fitted) {
            return Ok((data, found));
        }
    }
    Ok((data.clone(), fitted))
}

/// Reports a lag that was not asked for.
pub(super) fn warn(result: &mut Identification, modal: &Modal, asked: Option<Lag>) {
    match modal.lag {
        _ if modal.delay_s == 0.0 => {}
        Lag::Delay if asked == Some(Lag::Delay) => {}
        Lag::Delay => shifted(result, modal.delay_s),
        Lag::LowPass => result.warn(WarningCode::LowPassFitted.warning(format!(
            "the measured channel lags as behind an RC low-pass of {} Hz, which was fitted and explains more than a \
             delay; check the filter of the amplifier, or record both channels with the same filters",
            rounded(low_pass_hz(modal.delay_s), 3)
        ))),
    }
}

/// Cut-off in Hz of an RC low-pass with this time constant.
pub(super) fn low_pass_hz(time_constant_s: f64) -> f64 {
    1.0 / (2.0 * PI * time_constant_s)
}

/// Reports which channel is late.
pub(super) fn shifted(result: &mut Identification, delay_s: f64) {
    let (which, or) = match delay_s < 0.0 {
        true => ("applied", ""),
        false => (
            "measured",
            ", or declare the low-pass of the measured channel as [recorder] low_pass",
        ),
    };
    let falls = result
        .get("natural_frequency")
        .map(|hz| averaged(hz.value(), delay_s.abs()));
    result.warn(WarningCode::ChannelsShifted.warning(format!(
        "the {which} channel lags the other by about {} ms: a delay was fitted, as with --delay, which explains \
         more than modes alone; check that one recorder takes both channels, with the same filters{or}{}",
        rounded(1e3 * delay_s.abs(), 3),
        falls.unwrap_or_default()
    )));
}

/// Note on a channel that is late because it averages, over twice its delay: a sine of frequency `f` is reduced to
/// `sin(x)/x`, `x = 2π f τ` with the delay `τ`.
fn averaged(hz: f64, delay_s: f64) -> String {
    let x = std::f64::consts::TAU * hz * delay_s;
    // A mean over half a period or more hardly passes the resonance.
    if x > std::f64::consts::FRAC_PI_2 {
        return String::new();
    }
    format!(
        ". If it is late because it averages (the gate of a frequency counter), its gain falls too, by {} % at {} Hz: that is \
         neither corrected nor in the uncertainties",
        rounded(100.0 * (1.0 - x.sin() / x), 2),
        rounded(hz, 4)
    )
}
