//! Where a compensated record ends: what lies above its band was filtered out of it.

use torqcomp_dsp::quality::median;
use torqcomp_dsp::spectrum::{Density, welch_steep};
use torqcomp_dsp::store::SampleStore;

use super::speed::highest;
use crate::print::{rounded, short};
use crate::recording::{Spool, UniformRecord};
use crate::warning::Warning;

/// Most samples that are looked at, and samples of a block.
const MOST: usize = 1 << 18;
const BLOCK: usize = 4096;
/// Fewest blocks, and bins of a part of the spectrum that is compared.
const BLOCKS: usize = 8;
const BINS: usize = 5;
/// The end of a band over its top: the edge between them is a fifth of the band wide.
const EDGE: f64 = 1.2;
/// Ratio of the frequencies that are tried.
const STEP: f64 = 1.02;
/// Frequencies over the top that was found up to which an order counts as within the band: the edge begins gently.
const NEAR: f64 = 1.04;
/// Density behind the end over that before the edge: no recorder's low-pass falls so far within one edge.
const FALL: f64 = 1e-4;

/// A warning if orders lie where the spectrum of the record has been cut off.
pub(super) fn warning(
    record: &UniformRecord<Spool>,
    fundamental_hz: f64,
    orders: &[f64],
) -> Option<Warning> {
    let count = record.samples.count().min(MOST);
    let block = BLOCK.min(count / BLOCKS / 2 * 2);
    let samples = record.samples.part(0..count).ok()?;
    let density = welch_steep(&samples, record.rate_hz, block).ok()?;
    let top_hz = top(&density, 0.5 * record.rate_hz)?;
    let is_beyond = |order: &&f64| *order * fundamental_hz > NEAR * top_hz;
    let beyond = orders.iter().filter(is_beyond);
    let beyond: Vec<f64> = beyond.copied().collect();
    let names: Vec<String> = beyond.iter().map(|order| short(*order)).collect();
    let highest_hz = fundamental_hz * highest(&beyond);
    (!names.is_empty()).then(|| {
        Warning::new(
            "orders-beyond-band",
            format!(
                "above about {} Hz the record was filtered, so that little or nothing is left of {}; compensate again with \
                 --band {} or more, or give harmonics the recorded channel and --stand",
                rounded(top_hz, 2),
                super::named(&names),
                rounded(1.05 * highest_hz, 3)
            ),
        )
    })
}

/// The top of the band, if the spectrum ends somewhere as if cut off.
fn top(density: &Density, nyquist_hz: f64) -> Option<f64> {
    let level = |from_hz: f64, to_hz: f64| {
        let mut values: Vec<f64> = density.between(from_hz, to_hz).map(|(_, v)| v).collect();
        median(&mut values).filter(|_| values.len() >= BINS)
    };
    let count = ((nyquist_hz / density.step_hz).ln() / STEP.ln()) as i32;
    let mut ends = (0..=count).map(|k| density.step_hz * STEP.powi(k));
    let is_end = |end_hz: &f64| {
        let top_hz = end_hz / EDGE;
        let before = level(top_hz / EDGE, top_hz);
        let behind = density.between(*end_hz, (EDGE * end_hz).min(nyquist_hz));
        let behind: Vec<f64> = behind.map(|(_, v)| v).collect();
        let is_low = |before: f64| behind.iter().all(|v| *v < FALL * before);
        behind.len() >= BINS && before.is_some_and(is_low)
    };
    Some(ends.find(is_end)? * STEP / EDGE)
}
