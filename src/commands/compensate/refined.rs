//! The way back through a stand with effects that no filter describes: the whole record in memory.

use torqcomp_dsp::noise::RecordNoise;

use super::deliver::deliver;
use super::sink::Sink;
use super::whole::density;
use super::{Extent, Plan, Run};
use crate::cli::Compensate;
use crate::commands::convert;
use crate::failure::Failure;
use crate::print::rounded;
use crate::quality::excerpt;
use crate::report::compensate::{Effect, Line, LostSpan, Report};
use crate::signal::Record;
use crate::stand::Stand;
use crate::undo::{FoundLine, Undo, Undone, treatment};
use crate::warning::Warning;

/// Most samples of a record: about 100 bytes of memory each are needed.
const MOST_SAMPLES: usize = 1 << 24;
/// Spans that a warning tells the times of.
const SPANS_TOLD: usize = 5;
/// Weight of the filter's taps, relative to all, beyond which a lost sample no longer matters.
const REACH: f64 = 0.01;
/// Share of a line's amplitude below which its phase is not told by the record: from 0.2 rad on.
const SURE: f64 = 0.98;
/// Part of the record in which the direction of the motion is not known, from which it is worth a warning.
const STILL: f64 = 0.02;

/// What was found on the way.
pub struct Found {
    undone: Undone,
    /// Rms of the noise in the result, in printed units.
    noise_rms: Option<f64>,
    /// Time on both sides of a lost sample in which the result leans on it.
    reach_s: f64,
    start_s: f64,
    rate_hz: f64,
    /// Printed units per SI unit of the record.
    scale: f64,
}

/// Reads the record, takes it back and writes what came out.
pub fn run(args: &Compensate, plan: Plan, sink: &mut Sink) -> Result<Run, Failure> {
    let Plan {
        signal,
        stand,
        chain,
        filter,
        undo,
    } = plan;
    let Some(undo) = undo else {
        return Err(Failure::failed("there is no effect to take back"));
    };
    let record = Record::read(signal, |values| convert(&chain, values))?;
    check(&record)?;
    let scale = 1.0 / chain.applied.factor;
    let noise = density(&record, scale).and_then(|d| RecordNoise::of(&filter, &d));
    // From the density in printed units to the deviation of a sample of the record in SI units.
    let noise_std = noise.as_ref().map_or(0.0, |noise| {
        (0.5 * noise.floor_density * record.rate_hz).sqrt() * stand.gain() / scale
    });
    let recorded: Vec<f64> = record.samples.iter().map(|x| x * stand.gain()).collect();
    let mut undone = undo.run(&recorded, record.rate_hz, noise_std)?;
    let torque = std::mem::take(&mut undone.applied);
    let noise_rms = if noise_std > 0.0 {
        Some(scale * spread(&undo, &record, (&recorded, &torque), noise_std)?)
    } else {
        None
    };
    let traces = deliver(args, sink, &record, &torque, scale)?;
    Ok(Run {
        samples: torque.len(),
        start_s: record.start_s,
        extent: Extent::of(&torque).scaled(scale),
        refined: Some(Found {
            undone,
            noise_rms,
            reach_s: reach(filter.taps()) as f64 / record.rate_hz,
            start_s: record.start_s,
            rate_hz: record.rate_hz,
            scale: scale / stand.gain(),
        }),
        resampled: record.resampled,
        noise,
        summary: record.summary,
        excerpt: excerpt::of_memory(record.samples),
        traces,
    })
}

fn check(record: &Record) -> Result<(), Failure> {
    let count = record.samples.len();
    if count < 2 {
        return Err(Failure::failed(
            "the record has fewer than two samples; nothing can be compensated",
        ));
    }
    if count > MOST_SAMPLES {
        return Err(Failure::failed(format_args!(
            "the record has {count} samples, and the effects of this stand are taken back in memory for at most \
             {MOST_SAMPLES}; cut the record into parts of {} s",
            rounded(MOST_SAMPLES as f64 / record.rate_hz, 3)
        )));
    }
    Ok(())
}

/// Rms of what noise of that deviation makes of a result: from a second run with such noise added.
fn spread(
    undo: &Undo,
    record: &Record,
    (recorded, torque): (&[f64], &[f64]),
    noise_std: f64,
) -> Result<f64, Failure> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut uniform = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    // Twelve uniform numbers have a variance of one together.
    let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
    let noisy: Vec<f64> = recorded.iter().map(|y| y + noise_std * normal()).collect();
    let other = undo.run(&noisy, record.rate_hz, noise_std)?;
    let pairs = other.applied.iter().zip(torque);
    let square: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
    Ok((square / torque.len() as f64).sqrt())
}

/// Taps on either side of the middle, beyond which less than a small part of the weight is left.
fn reach(taps: &[f64]) -> usize {
    let half = taps.len() / 2;
    let all: f64 = taps.iter().map(|tap| tap.abs()).sum();
    let mut left = 0.0;
    for lag in (1..=half).rev() {
        left += taps[half - lag].abs() + taps[half + lag].abs();
        if left > REACH * all {
            return lag;
        }
    }
    0
}

/// What is done about each effect of a stand.
pub fn effects(stand: &Stand, undo: Option<&Undo>) -> Vec<Effect> {
    let Some(undo) = undo else {
        let divided = |declared: &crate::stand::DeclaredEffect| Effect {
            effect: declared.effect.name,
            form: declared.form.name,
            done: "divided out",
        };
        return stand.effects.iter().map(divided).collect();
    };
    let links = undo.links().iter().rev();
    links
        .filter(|link| link.action.is_some())
        .map(|link| Effect {
            effect: link.effect,
            form: link.form,
            done: treatment(link),
        })
        .collect()
}

/// Fills in what the way back found.
pub fn complete(report: &mut Report, found: &Found) {
    let undone = &found.undone;
    report.seen_to_hz = undone.seen_to_hz;
    report.lines = undone
        .lines
        .iter()
        .map(|line| line_of(line, found))
        .collect();
    if let (Some(noise), Some(rms)) = (&mut report.noise.record, found.noise_rms) {
        noise.compensated_rms = rms;
    }
    for lost in &undone.lost {
        let spans = spans(&lost.samples, found);
        report.warnings.push(lost_warning(lost, &spans, found));
        report
            .lost
            .extend(spans.iter().map(|[from_s, to_s]| LostSpan {
                effect: lost.effect,
                from_s: *from_s,
                to_s: *to_s,
            }));
    }
    for line in undone.lines.iter().filter(|line| line.share < SURE) {
        report.warnings.push(Warning::new(
            "phase-hidden",
            format!(
                "the record's own signal at {} Hz hides the phase of the line there: {} % of its amplitude was taken \
                 off, and some of it is left; record without excitation at this frequency",
                rounded(line.frequency_hz, 5),
                rounded(100.0 * line.share, 2)
            ),
        ));
    }
    if let Some(still) = undone.still.filter(|still| *still > STILL) {
        report.warnings.push(Warning::new(
            "direction-unknown",
            format!(
                "over {} % of the record the speed cannot be told from zero: there the friction, and with it the torque, \
                 is known to its size only",
                rounded(100.0 * still, 2)
            ),
        ));
    }
}

/// A line in printed units.
fn line_of(line: &FoundLine, found: &Found) -> Line {
    Line {
        frequency_hz: line.frequency_hz,
        amplitude: line.amplitude * found.scale,
        recorded: line.recorded * found.scale,
        phase_rad: line.phase_rad,
        share: line.share,
    }
}

/// Times of the first and last sample of each run of neighbours.
fn spans(samples: &[usize], found: &Found) -> Vec<[f64; 2]> {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for sample in samples {
        match runs.last_mut() {
            Some(run) if *sample <= run[1] + 1 => run[1] = *sample,
            _ => runs.push([*sample; 2]),
        }
    }
    let time_s = |i: usize| found.start_s + i as f64 / found.rate_hz;
    runs.iter().map(|run| run.map(time_s)).collect()
}

fn lost_warning(lost: &crate::undo::Lost, spans: &[[f64; 2]], found: &Found) -> Warning {
    let told: Vec<String> = spans
        .iter()
        .take(SPANS_TOLD)
        .map(|[from, to]| format!("{} to {} s", rounded(*from, 7), rounded(*to, 7)))
        .collect();
    let more = match spans.len().saturating_sub(SPANS_TOLD) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    Warning::new(
        "not-recovered",
        format!(
            "{}: {}; {} samples, from {}{more}: within {} ms of them the torque is not recovered",
            lost.effect,
            lost.why,
            lost.samples.len(),
            told.join(", "),
            rounded(1e3 * found.reach_s, 2)
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::reach;

    #[test]
    fn the_reach_of_taps_is_where_their_weight_is() {
        // 1 % of 1.0 lies beyond a lag of 1, less beyond 2.
        assert_eq!(reach(&[0.004, 0.02, 0.952, 0.02, 0.004]), 1);
        assert_eq!(reach(&[0.02, 0.02, 0.92, 0.02, 0.02]), 2);
    }
}
