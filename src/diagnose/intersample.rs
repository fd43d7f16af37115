//! Whether the course of the input between its samples looks like an effect: a converter that holds its samples delays by
//! half a sample, straight lines attenuate high frequencies.

use torqcomp_model::simulate::Between;

use super::records::Records;
use super::score::ScoredModel;
use super::search::refusal;
use crate::parallel::parallel;

/// Largest part of a model's excess error power that may remain with another course of the input.
const LEFT: f64 = 0.5;

/// The course of the input, other than band-limited, with which one of the models explains more for its parameters than the
/// last one. A course has no parameter that could adapt it to an effect.
pub fn better_course(
    models: &[&ScoredModel],
    last: &ScoredModel,
    noise_rms: f64,
    records: &Records,
    threads: usize,
) -> Option<Between> {
    let others = &Between::ALL[1..];
    let changed: Vec<Records> = others.iter().map(|b| records.with_between(*b)).collect();
    let found = parallel(others.len() * models.len(), threads, |job| {
        let (course, model) = (job / models.len(), models[job % models.len()]);
        let changed = model.again(&changed[course])?;
        let helps = refusal(&changed, model).is_none()
            && changed.excess_power(noise_rms) <= LEFT * model.excess_power(noise_rms);
        let criterion = changed.criterion();
        (helps && criterion < last.criterion()).then_some((criterion, others[course]))
    });
    let found = found.into_iter().flatten();
    let best = found.min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, between)| between)
}
