//! Whether what looks like an effect is the course of the input between its samples: a converter that holds them lags by
//! half a sample, straight lines weaken what is fast.

use torqcomp_model::simulate::Between;

use super::candidate::{Judged, Records, again};
use super::floor::Floor;
use super::search::refusal;
use crate::parallel::parallel;

/// Part of what a model leaves above the noise that it may leave with another course of the input.
const LEFT: f64 = 0.5;

/// The course of the input, other than band-limited, with which one of the models found on the way explains more for its
/// parameters than the last one. A course has no parameter that could bend itself to an effect.
#[must_use]
pub fn better<'a>(
    models: &[&Judged<'a>],
    last: &Judged,
    floor: Option<Floor>,
    records: &Records,
    threads: usize,
) -> Option<Between> {
    let noise = floor.map_or(0.0, |f| f.rms.powi(2));
    let above = |judged: &Judged| judged.hold_rms().powi(2) - noise;
    let others = &Between::ALL[1..];
    let changed: Vec<Records> = others.iter().map(|b| records.with_between(*b)).collect();
    let jobs = others.len() * models.len();
    let found = parallel(jobs, threads, |job| {
        let (course, model) = (job / models.len(), models[job % models.len()]);
        let judged = again(model, &changed[course])?;
        let helps = refusal(&judged, model).is_none() && above(&judged) <= LEFT * above(model);
        let criterion = judged.pooled_criterion();
        (helps && criterion < last.pooled_criterion()).then_some((criterion, others[course]))
    });
    let best = found
        .into_iter()
        .flatten()
        .min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, between)| between)
}
