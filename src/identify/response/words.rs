//! Names of what a response tells, its drawings, and what a user should know about it.

use std::f64::consts::TAU;

use num_complex::Complex64;
use torqcomp_dsp::frf::{self, Estimator, Frf};

use super::Modal;
use super::blocks::Set;
use super::lines::Lines;
use super::order::folds;
use super::scatter::Spread;
use crate::identify::{Comparison, Correlated, Found, Outcome, STRONG};
use crate::print::rounded;
use crate::report::chart::{Chart, Series};

/// Frequency and damping of every mode, by rising frequency, and which are hard to tell apart.
pub(super) fn name_modes(outcome: &mut Outcome, fitted: &Modal, spread: &Spread) {
    let mut by_frequency: Vec<usize> = (0..fitted.poles.len()).collect();
    let omega = |k: usize| fitted.poles[k].omega_rad_per_s;
    by_frequency.sort_by(|a, b| omega(*a).total_cmp(&omega(*b)));
    let single = by_frequency.len() == 1;
    for (place, k) in by_frequency.into_iter().enumerate() {
        let name = |text: &str| match single {
            true => text.to_owned(),
            false => format!("mode_{}_{text}", place + 1),
        };
        name_mode(outcome, fitted, spread, k, &name);
    }
}

/// ω_n = √(σ² + ω²), ζ = σ/ω_n: ∂ω_n = (σ, ω)/ω_n, ∂ζ = (ω², −σω)/ω_n³.
fn name_mode(
    outcome: &mut Outcome,
    fitted: &Modal,
    spread: &Spread,
    k: usize,
    name: &dyn Fn(&str) -> String,
) {
    let (sigma, omega) = (fitted.poles[k].rate_per_s, fitted.poles[k].omega_rad_per_s);
    let natural = sigma.hypot(omega);
    if fitted.fit.as_ref().is_some_and(|f| f.at_bound[2 * k]) {
        outcome.warn(
            "at-bound",
            format!(
                "the damping of the mode at {} Hz came out as none at all: the data do not tell it",
                rounded(natural / TAU, 5)
            ),
        );
    }
    let by = |c: &[[f64; 2]; 2], a: [f64; 2], b: [f64; 2]| {
        a[0] * (c[0][0] * b[0] + c[0][1] * b[1]) + a[1] * (c[1][0] * b[0] + c[1][1] * b[1])
    };
    let of_frequency = [sigma / natural / TAU, omega / natural / TAU];
    let cube = natural.powi(3);
    let of_ratio = [omega * omega / cube, -sigma * omega / cube];
    let std = |g: [f64; 2]| spread[k].as_ref().map(|c| by(c, g, g).sqrt());
    let (first, second) = (name("natural_frequency"), name("damping_ratio"));
    let frequency = Found::new(&first, natural / TAU, std(of_frequency), "Hz");
    outcome.found.push(frequency);
    let ratio = Found::new(&second, sigma / natural, std(of_ratio), "");
    outcome.found.push(ratio);
    if let (Some(c), Some(a), Some(b)) = (&spread[k], std(of_frequency), std(of_ratio)) {
        let coefficient = by(c, of_frequency, of_ratio) / (a * b);
        if coefficient.abs() >= STRONG {
            outcome.correlated.push(Correlated {
                first,
                second,
                coefficient,
            });
        }
    }
}

/// Root of the mean square of the measured signal in the band, a block.
pub(super) fn output_rms(set: &Set, lines: &Lines) -> f64 {
    let power: f64 = set
        .blocks
        .iter()
        .map(|b| {
            b.measured[lines.clone()]
                .iter()
                .map(|y| y.norm_sqr())
                .sum::<f64>()
        })
        .sum();
    let length = 2.0 * (set.blocks[0].applied.len() as f64 - 1.0);
    (2.0 * power / set.blocks.len() as f64).sqrt() / length
}

/// What the response itself, without a model, leaves of the blocks it is not from.
pub(super) fn raw_error(outcome: &mut Outcome, set: &Set, lines: &Lines) {
    let folds = folds(set);
    if folds.len() < 2 {
        return;
    }
    let mut sum = 0.0;
    for fold in &folds {
        let others = (0..set.blocks.len())
            .filter(|i| !fold.contains(i))
            .map(|i| &set.blocks[i]);
        let raw = Frf::between(others, Estimator::H1, lines.clone()).response;
        sum += fold
            .iter()
            .map(|i| frf::prediction_error(&raw, &set.blocks[*i], lines.clone()))
            .sum::<f64>();
    }
    let percent = 100.0 * sum / set.blocks.len() as f64;
    outcome.comparisons.push(Comparison {
        method: "the measured response itself, without a model, on data held out".to_owned(),
        found: vec![Found::new("held_out_error", percent, None, "%")],
        quality: None,
    });
}

/// Difference of responses between records that is said.
const DIFFERENT: f64 = 0.1;

/// Compares the responses of records at different levels: a linear stand has one.
pub(super) fn levels(outcome: &mut Outcome, set: &Set, lines: &Lines) {
    let records: Vec<usize> = {
        let mut all = set.record.clone();
        all.dedup();
        all
    };
    if records.len() < 2 {
        return;
    }
    let of = |r: usize| {
        Frf::of(
            set.blocks
                .iter()
                .zip(&set.record)
                .filter(|(_, q)| **q == r)
                .map(|(b, _)| b),
            Estimator::H1,
        )
    };
    let Some(first) = records.first().map(|r| of(*r)) else {
        return;
    };
    for r in &records[1..] {
        let other = of(*r);
        let level = |f: &Frf| f.applied_power[lines.clone()].iter().sum::<f64>().sqrt();
        let ratio = level(&other) / level(&first);
        if (0.7..1.4).contains(&ratio) {
            continue;
        }
        let (mut change, mut all) = (0.0, 0.0);
        for k in lines.clone() {
            change += (other.response[k] - first.response[k]).norm_sqr() * first.applied_power[k];
            all += first.response[k].norm_sqr() * first.applied_power[k];
        }
        let change = (change / all).sqrt();
        if change > DIFFERENT {
            outcome.warn(
                "level-dependent",
                format!(
                    "at {} times the level of the first record the response differs by {} %: the stand is not \
                     linear, or the noise is large",
                    rounded(ratio, 3),
                    rounded(100.0 * change, 2)
                ),
            );
        }
    }
}

/// Response with its bounds and the model, phase, coherence, and the error against the number of modes where that was
/// looked for.
pub(super) fn draw(
    outcome: &mut Outcome,
    h1: &Frf,
    lines: &Lines,
    step_hz: f64,
    fitted: &Modal,
    held_out: &[f64],
) {
    let hz: Vec<f64> = lines.clone().map(|k| k as f64 * step_hz).collect();
    let part = &h1.response[lines.clone()];
    let sizes = |values: &[Complex64]| values.iter().map(|c| c.norm()).collect::<Vec<f64>>();
    let mut magnitude = Chart::new(
        "Response",
        "frequency, Hz",
        "measured over applied",
        vec![
            Series::line("H1", &hz, &sizes(part)),
            Series::line("model", &hz, &sizes(&fitted.response)),
        ],
    );
    magnitude.y_log = true;
    magnitude.band = bounds(h1, lines, step_hz);
    outcome.charts.push(magnitude);
    outcome.charts.push(phase(&hz, part, &fitted.response));
    let coherence = vec![Series::line("coherence", &hz, &h1.coherence[lines.clone()])];
    outcome
        .charts
        .push(Chart::new("Coherence", "frequency, Hz", "", coherence));
    if held_out.iter().filter(|e| e.is_finite()).count() < 2 {
        return;
    }
    let counts: Vec<f64> = (0..held_out.len()).map(|n| n as f64).collect();
    let percent: Vec<f64> = held_out.iter().map(|e| 100.0 * e).collect();
    let error = vec![Series::dots("on data held out", &counts, &percent)];
    outcome.charts.push(Chart::new(
        "Error and number of modes",
        "modes",
        "per cent",
        error,
    ));
}

/// Phase of the model without jumps, and of H1 beside it.
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
    Chart::new("Phase", "frequency, Hz", "degrees", both)
}

/// Twice the standard uncertainty to both sides of the magnitude: x, low, high.
fn bounds(h1: &Frf, lines: &Lines, step_hz: f64) -> Vec<(f64, f64, f64)> {
    let one = |k: usize| {
        let (middle, std) = (h1.response[k].norm(), 2.0 * h1.relative_std(k)?);
        let place = k as f64 * step_hz;
        (std < 1.0).then_some((place, middle * (1.0 - std), middle * (1.0 + std)))
    };
    lines.clone().filter_map(one).collect()
}

/// Phase in degrees without jumps of a turn, from the angle between neighbours.
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
