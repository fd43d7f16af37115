//! The record at no load, from what precedes the first excitation of a response test.

use torqcomp_dsp::quality::median;
use torqcomp_model::Estimate;

use crate::recording::AlignedChannels;
use crate::stand::TransducerSignal;

/// Excitation relative to its largest that begins a response, and part of the samples before it that is used.
const BEGINS: f64 = 0.05;
const BEFORE: f64 = 0.9;
/// Least number of samples at rest, and number of blocks whose means scatter.
const FEWEST: usize = 64;
const BLOCKS: usize = 8;
/// Largest deviation at rest, rms, relative to the largest of the response.
const QUIET: f64 = 0.02;

/// The zero of the measured channel, in the usual unit of its signal: its mean before the first excitation. `None` if the
/// records do not begin at rest.
pub(super) fn zero(records: &[AlignedChannels], signal: TransducerSignal) -> Option<Estimate> {
    let (unit, size) = signal.usual_unit();
    let factor = signal.factor(&records[0].channels[1].unit.as_ref()?.unit) / size;
    let levels: Vec<(f64, f64)> = records
        .iter()
        .map(|record| level(&record.channels[0].samples, &record.channels[1].samples))
        .collect::<Option<_>>()?;
    let count = levels.len() as f64;
    let mean = levels.iter().map(|(level, _)| level).sum::<f64>() / count;
    let within = levels.iter().map(|(_, std)| std * std).sum::<f64>().sqrt() / count;
    let square = |(level, _): &(f64, f64)| (level - mean).powi(2);
    let apart = levels.iter().map(square).sum::<f64>() / (count - 1.0).max(1.0) / count;
    let std = within.max(apart.sqrt());
    Some(Estimate::of(
        unit,
        factor * mean,
        Some((factor * std).abs()),
    ))
}

/// Mean of the measured samples before the first excitation, and its standard uncertainty by the scatter of block means.
fn level(applied: &[f64], measured: &[f64]) -> Option<(f64, f64)> {
    let rest = median(&mut applied.to_vec())?;
    let largest = applied.iter().fold(0.0_f64, |m, x| m.max((x - rest).abs()));
    let begins = |x: &f64| (x - rest).abs() > BEGINS * largest;
    let onset = applied.iter().position(begins)?;
    let quiet = &measured[..(BEFORE * onset as f64) as usize];
    if quiet.len() < FEWEST {
        return None;
    }
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let level = mean(quiet);
    let off = quiet.iter().map(|x| (x - level).powi(2)).sum::<f64>() / quiet.len() as f64;
    let response = measured
        .iter()
        .fold(0.0_f64, |m, x| m.max((x - level).abs()));
    let means = quiet.chunks_exact(quiet.len() / BLOCKS).map(mean);
    let scatter = means.map(|x| (x - level).powi(2)).sum::<f64>() / (BLOCKS - 1) as f64;
    (off.sqrt() < QUIET * response).then(|| (level, (scatter / BLOCKS as f64).sqrt()))
}
