//! Names, method, charts and warnings of a response.

use num_complex::Complex64;
use torqcomp_dsp::frf::{self, Estimator, Frf, Window};

use super::blocks::Set;
use super::order::folds;
use super::{FinalFit, Lag, Modal, ResponseOptions, foreign, shift};
use crate::chart::{Chart, Series};
use crate::identify::{Comparison, FitQuality, Identification, NamedEstimate};
use crate::print::{plural, relative, rounded, short};
use crate::warning::WarningCode;

/// Adds natural frequency and damping ratio of every mode of the stand, in ascending order of
/// frequency.
pub(super) fn add_modes(result: &mut Identification, fitted: &FinalFit) {
    let modal = &fitted.modal;
    let order = modal.of_stand();
    for (place, k) in order.iter().enumerate() {
        let mode = fitted.mode(*k);
        let names = ["natural_frequency", "damping_ratio"];
        let constants = mode.modal_constants().of_mode((place, order.len()), &names);
        if modal.fit.as_ref().is_some_and(|f| f.at_bound[2 * k]) {
            result.warn(WarningCode::AtBound.warning(format!(
                "the damping of the mode at {} Hz is not identifiable from these data (fitted: 0)",
                rounded(constants.list[0].value(), 5)
            )));
        }
        result.add(constants);
        result.modes.push(mode);
    }
}

/// Adds the contribution of each mode to the response.
pub(super) fn add_shares(result: &mut Identification) {
    let Some(shares) = result.shares.clone() else {
        return;
    };
    let count = shares.modes.len();
    for (place, mode) in shares.modes.into_iter().enumerate() {
        result.add(mode.of_mode((place, count), &["residue", "quadrature"]));
    }
}

/// Describes the fit.
pub(super) fn method(
    result: &mut Identification,
    set: &Set,
    options: &ResponseOptions,
    fitted: &Modal,
) {
    result.method.push(format!(
        "{} fitted to {} lines from {} to {} Hz, H1 over {}, {}{}",
        plural(fitted.poles.len(), "mode"),
        set.band.len(),
        short(set.band.start as f64 * set.step_hz),
        short((set.band.end - 1) as f64 * set.step_hz),
        plural(set.blocks.len(), "block"),
        match fitted.linear().len() > 2 * fitted.poles.len() + 1 {
            true => "residual terms for modes outside the band",
            false => "a residual compliance for modes above the band",
        },
        match options.lag {
            Some(Lag::Delay) => ", a delay",
            Some(Lag::LowPass) => ", an RC low-pass of the measured channel",
            None => "",
        }
    ));
}

/// Adds hold-out error, static gain and lag.
pub(super) fn other_constants(
    result: &mut Identification,
    set: &Set,
    options: &ResponseOptions,
    found: &FinalFit,
) {
    let fitted = &found.modal;
    let held_out = result.held_out_errors.get(fitted.poles.len()).copied();
    if let Some(error) = held_out.filter(|e| e.is_finite()) {
        let leakage = match set.window {
            Window::Hann => ", leakage of the segments included",
            _ => "",
        };
        result.method.push(format!(
            "hold-out error: {} of the measured signal{leakage}",
            relative(error, 3)
        ));
        let error = NamedEstimate::new("held_out_error", "%", 100.0 * error, None);
        result.parameters.push(error);
    }
    if options.order == 0 && foreign::has_rest(fitted) {
        let gain = NamedEstimate::new("static_gain", "", fitted.at_rest(), found.static_gain_std);
        result.parameters.push(gain);
    }
    let (lag_s, std_s) = (fitted.delay_s, fitted.delay_std_s);
    result.parameters.extend(options.lag.map(|lag| match lag {
        Lag::Delay => NamedEstimate::new("delay", "s", lag_s, std_s),
        Lag::LowPass => {
            let hz = shift::low_pass_hz(lag_s);
            NamedEstimate::new("low_pass", "Hz", hz, std_s.map(|std_s| std_s / lag_s * hz))
        }
    }));
}

/// How well a model follows the measured signal in the band, in the rms over all blocks.
pub(super) fn quality(set: &Set, fitted: &FinalFit) -> FitQuality {
    let power: f64 = set
        .blocks
        .iter()
        .map(|b| {
            b.measured[set.band.clone()]
                .iter()
                .map(|y| y.norm_sqr())
                .sum::<f64>()
        })
        .sum();
    let length = 2.0 * (set.lines as f64 - 1.0);
    let rms = (2.0 * power / set.blocks.len() as f64).sqrt() / length;
    FitQuality {
        rms: rms * fitted.relative,
        unit: String::new(),
        relative: fitted.relative,
    }
}

/// Adds results of the response itself: its error, its levels, its plots.
pub(super) fn spectra(result: &mut Identification, set: &Set, fitted: &Modal) {
    raw_error(result, set);
    levels(result, set);
    draw(result, set, fitted);
}

/// Adds the hold-out error of the measured response itself, without a model.
fn raw_error(result: &mut Identification, set: &Set) {
    let folds = folds(set);
    if folds.len() < 2 {
        return;
    }
    let mut sum = 0.0;
    for fold in &folds {
        let others = (0..set.blocks.len())
            .filter(|i| !fold.contains(i))
            .map(|i| &set.blocks[i]);
        let raw = Frf::between(others, Estimator::H1, set.band.clone()).response;
        sum += fold
            .iter()
            .map(|i| frf::prediction_error(&raw, &set.blocks[*i], set.band.clone()))
            .sum::<f64>();
    }
    let percent = 100.0 * sum / set.blocks.len() as f64;
    // Lines at which all other blocks have no force are inconclusive.
    if !percent.is_finite() {
        return;
    }
    result.comparisons.push(Comparison {
        method: "the measured response itself, without a model, on hold-out data".to_owned(),
        parameters: vec![NamedEstimate::new("held_out_error", "%", percent, None)],
        fit: None,
    });
}

/// Minimum reported relative difference between the responses of records.
const DIFFERENT: f64 = 0.1;

/// Compares the responses of records at different levels, which are equal for a linear stand.
fn levels(result: &mut Identification, set: &Set) {
    let mut records = set.record.clone();
    records.dedup();
    let of = |r: usize| {
        let pairs = set.blocks.iter().zip(&set.record);
        let blocks = pairs.filter(|(_, record)| **record == r).map(|(b, _)| b);
        Frf::of(blocks, Estimator::H1)
    };
    let [first, others @ ..] = &records[..] else {
        return;
    };
    let first = of(*first);
    for r in others {
        let other = of(*r);
        let level = |f: &Frf| f.applied_power[set.band.clone()].iter().sum::<f64>().sqrt();
        let ratio = level(&other) / level(&first);
        if (0.7..1.4).contains(&ratio) {
            continue;
        }
        let (mut change, mut all) = (0.0, 0.0);
        for k in set.band.clone() {
            change += (other.response[k] - first.response[k]).norm_sqr() * first.applied_power[k];
            all += first.response[k].norm_sqr() * first.applied_power[k];
        }
        let change = (change / all).sqrt();
        if change > DIFFERENT {
            result.warn(WarningCode::LevelDependent.warning(format!(
                "at {} times the level of the first record the response differs by {} %: the stand is nonlinear, or \
                 the noise is large",
                rounded(ratio, 3),
                rounded(100.0 * change, 2)
            )));
        }
    }
}

/// Label of the magnitude, with the unit of the channels.
pub(crate) const RATIO: &str = "measured per applied";

/// Magnitude with its bounds, phase and coherence, the model, and the error over the number of modes if that was
/// chosen.
fn draw(result: &mut Identification, set: &Set, fitted: &Modal) {
    let h1 = set.powers.response(Estimator::H1);
    let hz: Vec<f64> = set.band.clone().map(|k| k as f64 * set.step_hz).collect();
    let part = &h1.response[set.band.clone()];
    let sizes = |values: &[Complex64]| values.iter().map(|c| c.norm()).collect::<Vec<f64>>();
    let both = vec![
        Series::line("H1", &hz, &sizes(part)),
        Series::line("model", &hz, &sizes(&fitted.response)),
    ];
    let frequency = "frequency, Hz";
    let mut magnitude = Chart::new("Response", frequency, RATIO, both);
    magnitude.y_log = true;
    magnitude.band = bounds(&h1, set);
    let coherence = vec![Series::line(
        "coherence",
        &hz,
        &h1.coherence[set.band.clone()],
    )];
    result.charts.extend([
        magnitude,
        phase(&hz, part, &fitted.response),
        Chart::new("Coherence", frequency, "coherence, no unit", coherence),
    ]);
    let errors = &result.held_out_errors;
    if errors.iter().filter(|e| e.is_finite()).count() < 2 {
        return;
    }
    let counts: Vec<f64> = (0..errors.len()).map(|n| n as f64).collect();
    let percent: Vec<f64> = errors.iter().map(|e| 100.0 * e).collect();
    let error = vec![Series::dots("hold-out error", &counts, &percent)];
    let chart = Chart::new(
        "Error and number of modes",
        "number of modes, no unit",
        "hold-out error, %",
        error,
    );
    result.charts.push(chart);
}

/// Unwrapped phase of the model, and of H1.
fn phase(hz: &[f64], h1: &[Complex64], model: &[Complex64]) -> Chart {
    let turns = unwrapped(model);
    let measured: Vec<f64> = h1
        .iter()
        .zip(model)
        .zip(&turns)
        .map(|((h, m), turn)| turn + (h * m.conj()).arg().to_degrees())
        .collect();
    let both = vec![
        Series::line("H1", hz, &measured),
        Series::line("model", hz, &turns),
    ];
    Chart::new("Phase", "frequency, Hz", "phase, degrees", both)
}

/// The magnitude ± twice its standard uncertainty: x, low, high.
fn bounds(h1: &Frf, set: &Set) -> Vec<(f64, f64, f64)> {
    let one = |k: usize| {
        let (middle, std) = (h1.response[k].norm(), 2.0 * h1.relative_std(k)?);
        let place = k as f64 * set.step_hz;
        (std < 1.0).then_some((place, middle * (1.0 - std), middle * (1.0 + std)))
    };
    set.band.clone().filter_map(one).collect()
}

/// Unwrapped phase in degrees.
fn unwrapped(response: &[Complex64]) -> Vec<f64> {
    let mut turn = response.first().map_or(0.0, |c| c.arg().to_degrees());
    let mut last = response.first().copied().unwrap_or_default();
    response
        .iter()
        .map(|c| {
            turn += (c * last.conj()).arg().to_degrees();
            last = *c;
            turn
        })
        .collect()
}
