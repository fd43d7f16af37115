//! Orders of the fundamental that a record shows and that were not requested.
//!
//! A strong order that is not fitted leaks into its neighbours, and pulls a fundamental that is fitted to these alone.

use torqcomp_dsp::store::SampleStore;

use super::mains::is_at_mains;
use super::speed::{FIRST, sure_orders};
use crate::recording::UniformRecord;

/// Highest whole order looked for.
const HIGHEST: u32 = 30;

/// The given orders and the others that the record shows at this fundamental.
pub(super) fn shown(record: &UniformRecord, fundamental_hz: f64, orders: &[f64]) -> Vec<f64> {
    joined(orders, unlisted(record, fundamental_hz, orders))
}

/// The same without others that may be lines of the mains, which would decide the speed.
pub(super) fn for_refinement(
    record: &UniformRecord,
    fundamental_hz: f64,
    orders: &[f64],
) -> Vec<f64> {
    let duration_s = record.samples.count() as f64 / record.rate_hz;
    let mut others = unlisted(record, fundamental_hz, orders);
    others.retain(|order| !is_at_mains(order * fundamental_hz, duration_s));
    joined(orders, others)
}

fn joined(orders: &[f64], others: Vec<f64>) -> Vec<f64> {
    let mut all = [orders, &others].concat();
    all.sort_by(f64::total_cmp);
    all
}

/// Whole orders that the record shows and that are not among the given ones.
fn unlisted(record: &UniformRecord, fundamental_hz: f64, orders: &[f64]) -> Vec<f64> {
    let is_listed = |order: f64| orders.iter().any(|own| (own - order).abs() < 0.5);
    let is_seen = |order: &f64| order * fundamental_hz < 0.5 * record.rate_hz;
    let others = (1..=HIGHEST).map(f64::from).filter(is_seen);
    let others: Vec<f64> = others.filter(|order| !is_listed(*order)).collect();
    if others.is_empty() {
        return others;
    }
    let all = [orders, &others].concat();
    let first = 0..record.samples.count().min(FIRST);
    let Ok(samples) = record.samples.part(first) else {
        return Vec::new();
    };
    let mut sure = sure_orders(&samples, record.rate_hz, fundamental_hz, &all);
    sure.retain(|order| !is_listed(*order));
    sure
}
