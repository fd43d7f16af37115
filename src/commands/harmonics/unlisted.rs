//! Orders of the fundamental that a record shows and that were not requested.
//!
//! A strong order that is not fitted leaks into its neighbours, and pulls a fundamental that is fitted to these alone.

use torqcomp_dsp::harmonics::{Component, Fundamental, fit};
use torqcomp_dsp::store::SampleStore;

use super::mains::grids_with_a_line_at;
use super::speed::{FIRST, is_sure};
use crate::recording::UniformRecord;

/// Highest whole order looked for.
const HIGHEST: u32 = 30;

/// The given orders and the others that the record shows at this fundamental, ascending. Lines that may be of the mains are
/// no orders.
pub(super) fn with_unlisted(
    record: &UniformRecord,
    fundamental_hz: f64,
    orders: &[f64],
) -> Vec<f64> {
    let found = unlisted(record, fundamental_hz, orders).unwrap_or_default();
    let mut all = [orders, &found].concat();
    all.sort_by(f64::total_cmp);
    all
}

fn unlisted(record: &UniformRecord, fundamental_hz: f64, orders: &[f64]) -> Option<Vec<f64>> {
    let count = record.samples.count().min(FIRST);
    let duration_s = count as f64 / record.rate_hz;
    let is_listed = |order: f64| orders.iter().any(|own| (own - order).abs() < 0.5);
    let is_seen = |order: &f64| order * fundamental_hz < 0.5 * record.rate_hz;
    let others = (1..=HIGHEST).map(f64::from).filter(is_seen);
    let others: Vec<f64> = others.filter(|order| !is_listed(*order)).collect();
    if others.is_empty() {
        return None;
    }
    let samples = record.samples.part(0..count).ok()?;
    let all = [orders, &others].concat();
    let fundamental = Fundamental::given(fundamental_hz);
    let fitted = fit(&samples[..], record.rate_hz, 0.0, fundamental, &all).ok()?;
    let is_order = |c: &&Component| {
        let mut grids = grids_with_a_line_at(c.frequency_hz, duration_s);
        is_sure(c) && !is_listed(c.order) && grids.next().is_none()
    };
    let found = fitted.components.iter().filter(is_order);
    Some(found.map(|c| c.order).collect())
}
