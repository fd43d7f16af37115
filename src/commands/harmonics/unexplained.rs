//! Check that the orders explain the record.

use torqcomp_dsp::harmonics::{Harmonics, without};
use torqcomp_dsp::quality::median;
use torqcomp_dsp::spectrum::welch;

use super::rotation::Rotation;
use super::speed::FIRST;
use crate::print::rounded;
use crate::warning::{Warning, WarningCode};

/// Part of the power of a record, without its mean, that the orders must explain.
const EXPLAINED: f64 = 0.5;
/// Part below which the figure does not matter.
const LITTLE: f64 = 1e-3;
/// Power of the residual over that of its noise between lines, above which it is not noise.
const FAR: f64 = 100.0;
/// Blocks of the spectrum of the residual.
const BLOCKS: usize = 8;

/// A warning if most of the record is neither orders of the fundamental nor noise: the uncertainties, which are those of
/// noise near each order, do not allow for that. `shown` has the requested orders and others that the record shows.
pub(super) fn warning(shown: &Rotation, found: &Harmonics) -> Option<Warning> {
    let (samples, rate_hz) = (shown.first(FIRST)?, shown.record.rate_hz);
    let frequencies_hz = shown
        .orders
        .iter()
        .map(|order| order * shown.fundamental_hz);
    let frequencies_hz: Vec<f64> = frequencies_hz.collect();
    let residual = without(&samples, rate_hz, &frequencies_hz).ok()?;
    let power = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
    let (all, rest) = (
        power(&without(&samples, rate_hz, &[]).ok()?),
        power(&residual),
    );
    let block = 1 << (residual.len() / BLOCKS).checked_ilog2()?;
    let mut density = welch(&residual, rate_hz, block).ok()?.values;
    let noise = 0.5 * rate_hz * median(&mut density)?;
    let explained = 1.0 - rest / all;
    let percent = match explained < LITTLE {
        true => "hardly anything".to_owned(),
        false => format!("only {} %", rounded(100.0 * explained, 2)),
    };
    (explained < EXPLAINED && rest > FAR * noise).then(|| {
        let largest = found.components.iter().map(|c| c.phasor.norm());
        let largest = largest.fold(0.0, f64::max);
        WarningCode::OrdersExplainLittle.warning(format!(
            "the orders of {} Hz explain {percent} of the variation of the record; the residual is {} times the largest \
             component (rms) and is not noise: the speed changes within the range, or is another one, or other torques act. \
             Components may be far too small, and their uncertainties do not allow for that: select a shorter part \
             with --range, or give the speed there",
            rounded(shown.fundamental_hz, 7),
            rounded(rest.sqrt() / largest, 2)
        ))
    })
}
