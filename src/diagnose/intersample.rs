//! Tests whether the waveform of the input between its samples is mistaken for an effect: a converter's hold delays by
//! half a sample, linear interpolation attenuates high frequencies.

use torqcomp_model::simulate::Between;

use super::acceptance::refusal;
use super::record::StandRecord;
use super::records::Records;
use super::score::ScoredModel;
use crate::parallel::parallel;
use torqcomp_dsp::dot;

/// Largest fraction of a model's excess error power that may remain with another waveform.
const LEFT: f64 = 0.5;

/// Change next to a jump, relative to the jump, up to which there are plateaus on both sides of it.
const LEVEL: f64 = 0.15;
/// Fraction of the squared changes of a plateau input that are jumps.
const MOSTLY_JUMPS: f64 = 0.9;
/// RMS of the jumps relative to the input, below which they are quantisation steps of a slow
/// signal.
const SMALL: f64 = 0.1;

/// Waveform evident from the inputs themselves. Plateaus with jumps between samples have unlimited bandwidth and are
/// held; anything else is taken to be band-limited unless the records show otherwise.
pub fn from_inputs(records: &[StandRecord]) -> Between {
    let mut driven = records.iter().filter(|r| !r.is_free()).peekable();
    let are_driven = driven.peek().is_some();
    match are_driven && driven.all(|r| noise_on_plateaus(r.input.samples()).is_some()) {
        true => Between::Held,
        false => Between::BandLimited,
    }
}

/// Mean square of the noise on a plateau input: half that of the changes on the plateaus. `None` without plateaus.
pub fn noise_on_plateaus(input: &[f64]) -> Option<f64> {
    let changes: Vec<f64> = input.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let is_jump = |near: &&[f64]| near[0].abs().max(near[2].abs()) <= LEVEL * near[1].abs();
    let jumps = changes.windows(3).filter(is_jump).map(|near| near[1]);
    let squares: Vec<f64> = jumps.map(|jump| jump * jump).filter(|s| *s > 0.0).collect();
    let (jumps, all) = (squares.iter().sum::<f64>(), dot(&changes, &changes));
    let mean = input.iter().sum::<f64>() / input.len() as f64;
    let power = input.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / input.len() as f64;
    let is_seen = jumps > 0.0
        && jumps >= MOSTLY_JUMPS * all
        && jumps >= SMALL * SMALL * power * squares.len() as f64;
    // Some noise changes on plateaus look like jumps, but not by their size.
    is_seen.then(|| {
        let mut small: Vec<f64> = changes.iter().map(|c| c * c).collect();
        small.sort_by(f64::total_cmp);
        small.truncate(small.len().saturating_sub(squares.len()));
        0.5 * small.iter().sum::<f64>() / small.len().max(1) as f64
    })
}

/// The waveform other than the present one with which one of the models explains more for its parameters than the last
/// one. A waveform has no parameter that could adapt it to an effect.
pub fn better_course(
    models: &[&ScoredModel],
    last: &ScoredModel,
    noise_rms: f64,
    records: &Records,
    threads: usize,
) -> Option<Between> {
    let others: Vec<Between> = Between::ALL
        .into_iter()
        .filter(|between| *between != records.between())
        .collect();
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

#[cfg(test)]
mod tests {
    use super::*;

    fn has_plateaus(input: &[f64]) -> bool {
        noise_on_plateaus(input).is_some()
    }

    #[test]
    fn plateaus_are_seen_in_noise_and_not_in_smooth_or_slow_signals() {
        let level = |i: usize| ((i / 9 * 7) % 11) as f64 - 5.0;
        let noise = |i: usize| ((i * 7919) % 1009) as f64 / 1009.0 - 0.5;
        let made = |value: &dyn Fn(usize) -> f64| (0..4000).map(value).collect::<Vec<_>>();
        assert!(has_plateaus(&made(&|i| level(i) + 0.05 * noise(i))));
        assert!(!has_plateaus(&made(&|i| (0.3 * i as f64).sin())));
        assert!(!has_plateaus(&made(&|i| level(7 * i))));
        // A slow quantised sine, and isolated outliers.
        assert!(!has_plateaus(&made(&|i| (100.0
            * (0.001 * i as f64).sin())
        .round())));
        assert!(!has_plateaus(&made(&|i| f64::from(u8::from(i % 40 == 0)))));
        assert!(!has_plateaus(&[1.0; 50]));
    }
}
