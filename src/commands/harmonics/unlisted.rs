//! Orders of the fundamental that a record shows and that were not requested.
//!
//! A strong order that is not fitted leaks into its neighbours, and pulls a fundamental that is fitted to these alone.

use super::mains::is_at_mains;
use super::rotation::Rotation;
use super::speed::{FIRST, sure_orders};

/// Highest whole order looked for.
const HIGHEST: u32 = 30;

/// The given orders and the others that the record shows at this fundamental.
pub(super) fn shown(of: &Rotation) -> Vec<f64> {
    joined(of.orders, unlisted(of))
}

/// The same without others that may be lines of the mains, which would decide the speed.
pub(super) fn for_refinement(of: &Rotation) -> Vec<f64> {
    let duration_s = of.count() as f64 / of.record.rate_hz;
    let mut others = unlisted(of);
    others.retain(|order| !is_at_mains(order * of.fundamental_hz, duration_s));
    joined(of.orders, others)
}

fn joined(orders: &[f64], others: Vec<f64>) -> Vec<f64> {
    let mut all = [orders, &others].concat();
    all.sort_by(f64::total_cmp);
    all
}

/// Whole orders that the record shows and that are not among the given ones.
fn unlisted(of: &Rotation) -> Vec<f64> {
    let is_listed = |order: f64| of.orders.iter().any(|own| (own - order).abs() < 0.5);
    let rate_hz = of.record.rate_hz;
    let is_seen = |order: &f64| order * of.fundamental_hz < 0.5 * rate_hz;
    let others = (1..=HIGHEST).map(f64::from).filter(is_seen);
    let others: Vec<f64> = others.filter(|order| !is_listed(*order)).collect();
    if others.is_empty() {
        return others;
    }
    let all = [of.orders, &others].concat();
    let Some(samples) = of.first(FIRST) else {
        return Vec::new();
    };
    let mut sure = sure_orders(&samples, rate_hz, of.fundamental_hz, &all);
    sure.retain(|order| !is_listed(*order));
    sure
}
