//! End of the band of a compensated record; everything above it was filtered out.

use torqcomp_dsp::quality::median;
use torqcomp_dsp::spectrum::{Density, welch_steep};

use super::rotation::Rotation;
use super::speed::highest;
use crate::print::{rounded, short};
use crate::warning::{Warning, WarningCode};

/// Maximum number of samples evaluated, in one block: an edge between two lines is narrow.
const MOST: usize = 1 << 16;
/// Minimum number of bins of a compared part of the spectrum.
const BINS: usize = 5;
/// End of a band over its top: the edge between them is a fifth of the band wide.
const EDGE: f64 = 1.2;
/// Ratio of successive trial frequencies.
const STEP: f64 = 1.005;
/// Density above the end over that below the edge: no recorder's low-pass falls so far within one edge.
const FALL: f64 = 1e-4;
/// Frequency of this fall, over the top: the gain is `√FALL` at 0.72 of the edge's width (`torqcomp_dsp::Band::gain`).
const FALLEN: f64 = 1.144;
/// Frequency over the detected top up to which an order counts as within the band: the edge reduces it by 1 % at 1.056.
const NEAR: f64 = 1.05;

/// A warning if orders lie where the spectrum of the record is cut off.
pub(super) fn warning(of: &Rotation) -> Option<Warning> {
    // A block of the spectrum has an even length.
    let samples = of.first(of.count().min(MOST) & !1)?;
    let density = welch_steep(&samples, of.record.rate_hz, samples.len()).ok()?;
    let top_hz = top(&density, 0.5 * of.record.rate_hz)?;
    let is_beyond = |order: &&f64| *order * of.fundamental_hz > NEAR * top_hz;
    let beyond = of.orders.iter().filter(is_beyond);
    let beyond: Vec<f64> = beyond.copied().collect();
    let names: Vec<String> = beyond.iter().map(|order| short(*order)).collect();
    let highest_hz = of.fundamental_hz * highest(&beyond);
    (!names.is_empty()).then(|| {
        WarningCode::OrdersBeyondBand.warning(format!(
            "the record was filtered above about {} Hz, which removes part or all of {}; compensate again with \
             --band {} or more, or give harmonics the recorded channel and --stand",
            rounded(top_hz, 2),
            super::named(&names),
            rounded(1.05 * highest_hz, 3)
        ))
    })
}

/// The top of the band, if the spectrum is cut off somewhere with nothing above.
fn top(density: &Density, nyquist_hz: f64) -> Option<f64> {
    let level = |from_hz: f64, to_hz: f64| {
        let mut values: Vec<f64> = density.between(from_hz, to_hz).map(|(_, v)| v).collect();
        median(&mut values).filter(|_| values.len() >= BINS)
    };
    // Maximum density of each bin and all above.
    let mut largest = density.values.clone();
    for bin in (1..largest.len()).rev() {
        largest[bin - 1] = largest[bin - 1].max(largest[bin]);
    }
    let count = ((nyquist_hz / density.step_hz).ln() / STEP.ln()) as i32;
    let mut ends = (0..=count).map(|k| density.step_hz * STEP.powi(k));
    let is_end = |end_hz: &f64| {
        let bin = (end_hz / density.step_hz).ceil() as usize;
        let behind = largest.get(bin).filter(|_| bin + BINS <= largest.len());
        let top_hz = end_hz / FALLEN;
        behind.is_some_and(|behind| {
            level(top_hz / EDGE, top_hz).is_some_and(|before| *behind < FALL * before)
        })
    };
    Some(ends.find(is_end)? / FALLEN)
}
