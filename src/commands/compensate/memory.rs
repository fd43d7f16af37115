//! Records processed in memory: in one transform of the whole record, or by inverting effects that no filter
//! describes.

use torqcomp_decimal::Text;
use torqcomp_dsp::band::Band;
use torqcomp_dsp::compensate::{InverseFilter, whole_record};
use torqcomp_dsp::noise::RecordNoise;
use torqcomp_dsp::quality::streamed::StreamedFaults;
use torqcomp_dsp::quality::sums::SampleSums;
use torqcomp_dsp::spectrum::{PowerSum, StreamedPower};
use torqcomp_dsp::store::SampleStore;

use super::above::{AboveBand, power_above};
use super::report::CompensateReport;
use super::sink::{ResultPart, Sink};
use super::statistics::ResultSums;
use super::{Plan, Seen, refined};
use crate::cli::Compensate;
use crate::commands::convert;
use crate::commands::rows::uniform_parts;
use crate::failure::Failure;
use crate::quality::excerpt;
use crate::recording::UniformRecord;
use crate::recording::moment::Moment;

/// Maximum block length of the noise estimate.
const LONGEST_BLOCK: usize = 1 << 12;

/// Reads, compensates and writes the record.
pub(super) fn run(
    args: &Compensate,
    plan: Plan,
    sink: &mut Sink,
    report: &mut CompensateReport,
) -> Result<Seen, Failure> {
    let Plan {
        stream,
        stand,
        chain,
        filter,
        undo,
        ..
    } = plan;
    let record = UniformRecord::read(stream, |values| convert(&chain, values))?;
    let count = record.samples.count();
    let scale = 1.0 / chain.applied.factor;
    report.scale = scale;
    report.start = record.start;
    report.noise.record = noise(&record, &filter, scale)?;
    let mut sums = ResultSums::new(filter.half_length());
    let mut deliver = |first: usize, torque: &[f64], recorded: &[f64]| {
        sums.push(torque, &SampleSums::of(torque));
        let axis = (record.rate_hz, record.start);
        deliver(args, sink, axis, (first, scale), [torque, recorded])
    };
    match &undo {
        None => {
            let samples = record.samples.part(0..count)?;
            deliver(0, &whole_record(&filter, &samples)?, &samples)?;
        }
        Some(undo) => refined::run(undo, (&stand, chain.std), &record, report, deliver)?,
    }
    let mut above = AboveBand::of(&report.band, record.rate_hz);
    let faults = look_through(&record, filter.band(), &mut above)?;
    report.warnings.extend(above.warning(report));
    report.samples = count;
    report.result = sums.statistics(scale);
    report.resampled = record.resampled;
    Ok(Seen {
        summary: record.summary,
        excerpt: record.samples.part(0..count.min(excerpt::OF_PASSES))?,
        faults: faults.finish(),
    })
}

/// Faults of the samples; takes the power above the band.
fn look_through(
    record: &UniformRecord,
    band: &Band,
    above: &mut AboveBand,
) -> Result<StreamedFaults, Failure> {
    let mut faults = StreamedFaults::default();
    let mut before: Vec<f64> = Vec::new();
    let all = 0..record.samples.count();
    record.samples.pass(all, &mut |first, piece| {
        faults.push(piece);
        if !above.is_open() {
            return;
        }
        let mut power = PowerSum::new(LONGEST_BLOCK);
        // Blocks across the border of two pieces belong to the later one.
        let joined = [&before[..], piece].concat();
        power.add_samples(&joined);
        before = joined[joined.len().saturating_sub(LONGEST_BLOCK / 2)..].to_vec();
        if let Some(power) = power_above(&power, band) {
            above.take(power, [first, first + piece.len()]);
        }
    })?;
    Ok(faults)
}

/// Noise of a record in printed units, if it is long enough.
fn noise(
    record: &UniformRecord,
    filter: &InverseFilter,
    scale: f64,
) -> Result<Option<RecordNoise>, Failure> {
    let count = record.samples.count();
    let block = ((count / 2).next_power_of_two() / 2).min(LONGEST_BLOCK);
    if block < 4 {
        return Ok(None);
    }
    let mut power = StreamedPower::new(block);
    let mut sums = SampleSums::default();
    record.samples.pass(0..count, &mut |_, piece| {
        let printed: Vec<f64> = piece.iter().map(|x| x * scale).collect();
        power.push(&printed);
        sums.join(&SampleSums::of(piece));
    })?;
    let density = power.density(record.rate_hz);
    let rms = sums.std().unwrap_or_default() * scale.abs();
    Ok(density.and_then(|density| RecordNoise::of(filter, &density, rms)))
}

/// Writes samples of the result from a given index on, with the recorded ones.
fn deliver(
    args: &Compensate,
    sink: &mut Sink,
    axis: (f64, Moment),
    (first, scale): (usize, f64),
    [torque, recorded]: [&[f64]; 2],
) -> Result<(), Failure> {
    let mut text = Text::default();
    for (rows, range) in uniform_parts((args.digits, scale), axis, first..first + torque.len()) {
        let range = range.start - first..range.end - first;
        let (torque, recorded) = (&torque[range.clone()], &recorded[range]);
        text.clear();
        if sink.is_text() {
            let beside = if args.with_recorded { recorded } else { &[] };
            rows.write(&mut text, torque, beside);
        }
        sink.take(&ResultPart {
            rows,
            text: text.as_bytes(),
            torque,
            recorded,
        })?;
    }
    Ok(())
}
