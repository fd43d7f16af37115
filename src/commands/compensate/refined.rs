//! Inverse of a stand with effects that no filter describes.

use torqcomp_dsp::store::SampleStore;
use torqcomp_model::effects::{Action, FoundLine, Unrecovered};

use super::report::{CompensateReport, LostSpan, RemovedLine, UndoneEffect};
use crate::failure::{ErrorCode, Failure};
use crate::inverse::{Carried, ChainInverse, InverseResult, RecordWindow, Spread};
use crate::print::{plural, rounded, some_of};
use crate::recording::UniformRecord;
use crate::stand::{ConstantStd, Stand};
use crate::warning::{Warning, WarningCode};

/// Maximum number of samples of a record inverted as a whole, at about 100 bytes of memory each.
const MOST_SAMPLES: usize = 1 << 24;
/// Maximum number of spans whose times a warning gives.
const SPANS_TOLD: usize = 5;
/// Weight of the filter's taps, relative to all, beyond which a lost sample no longer matters.
const REACH: f64 = 0.01;
/// Fraction of a line's amplitude below which its phase is uncertain by more than 0.2 rad.
const SURE: f64 = 0.98;
/// Fraction of the record with unknown direction of motion from which a warning is given.
const STUCK: f64 = 0.02;

/// The scales of a record whose inverse is reported.
struct Scales {
    start_s: f64,
    rate_hz: f64,
    /// Time on both sides of a lost sample in which the result depends on its value.
    reach_s: f64,
    /// Printed units per SI unit of the record.
    printed: f64,
}

/// Inverts a record window by window and passes on the torque and the recorded samples of each; findings go into the
/// report.
pub(super) fn run(
    undo: &ChainInverse,
    (stand, constant): (&Stand, ConstantStd),
    record: &UniformRecord,
    report: &mut CompensateReport,
    mut deliver: impl FnMut(usize, &[f64], &[f64]) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let count = record.samples.count();
    check(record, undo)?;
    // From the density in printed units to the standard deviation of a recorded sample in SI units.
    let noise_std = report.noise.record.as_ref().map_or(0.0, |noise| {
        let density = noise.floor_per_root_hz.powi(2);
        (0.5 * density * record.rate_hz).sqrt() * stand.gain() / report.scale
    });
    let in_units_of_record =
        |samples: &[f64]| -> Vec<f64> { samples.iter().map(|x| x * stand.gain()).collect() };
    let scales = (record.rate_hz, noise_std);
    let (mut found, mut carried) = (InverseResult::default(), None);
    let mut noise = AddedNoise::default();
    for window in undo.windows(count) {
        let samples = record.samples.part(window.seen.clone())?;
        let recorded = in_units_of_record(&samples);
        let mut undone = undo.window(&recorded, &window, scales, &mut carried)?;
        let torque = std::mem::take(&mut undone.applied);
        if report.noise.record.is_some() && noise_std > 0.0 {
            noise.add(undo, &recorded, &window, scales, &torque)?;
        }
        deliver(window.own.start, &torque, &samples[window.inner()])?;
        found.join(undone, window.own.len() as f64 / count as f64);
    }
    if let (Some(record), true) = (&mut report.noise.record, noise_std > 0.0) {
        record.compensated_rms = report.scale * (noise.square / count as f64).sqrt();
    }
    let first = record.samples.part(0..count.min(Spread::LOOKED_AT))?;
    let spread = Spread {
        stand,
        band: undo.filter().band(),
        record: &in_units_of_record(&first),
        noise_std,
        constant,
    };
    report.result_std = spread.find()?.map(|std| std.scaled(report.scale));
    let scales = Scales {
        start_s: record.start.seconds(),
        rate_hz: record.rate_hz,
        reach_s: reach(undo.filter().taps()) as f64 / record.rate_hz,
        printed: report.scale / stand.gain(),
    };
    describe(report, &found, &scales);
    Ok(())
}

fn check(record: &UniformRecord, undo: &ChainInverse) -> Result<(), Failure> {
    let count = record.samples.count();
    if count < 2 {
        return Err(ErrorCode::TooFewSamples
            .failed("the record has fewer than two samples; nothing can be compensated"));
    }
    if count > MOST_SAMPLES && undo.margin().is_none() {
        return Err(ErrorCode::TooManySamples.failed(format_args!(
            "the record has {count} samples; an effect of this stand needs the whole record in memory, at most \
             {MOST_SAMPLES} samples; cut the record into parts of {} s",
            rounded(MOST_SAMPLES as f64 / record.rate_hz, 3)
        )));
    }
    Ok(())
}

/// Effect of noise on the result, from a second run with such noise added.
struct AddedNoise {
    state: u64,
    carried: Option<Carried>,
    /// Sum of squared differences of the results.
    square: f64,
}

impl Default for AddedNoise {
    fn default() -> Self {
        Self {
            state: 0x9e37_79b9_7f4a_7c15,
            carried: None,
            square: 0.0,
        }
    }
}

impl AddedNoise {
    fn uniform(&mut self) -> f64 {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 7;
        self.state ^= self.state << 17;
        (self.state >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// The sum of twelve uniform numbers has unit variance.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    /// Inverts a window with added noise of the given standard deviation.
    fn add(
        &mut self,
        undo: &ChainInverse,
        recorded: &[f64],
        window: &RecordWindow,
        scales: (f64, f64),
        torque: &[f64],
    ) -> Result<(), Failure> {
        let noisy: Vec<f64> = recorded
            .iter()
            .map(|y| y + scales.1 * self.normal())
            .collect();
        let other = undo.window(&noisy, window, scales, &mut self.carried)?;
        let pairs = other.applied.iter().zip(torque);
        self.square = pairs.fold(self.square, |sum, (a, b)| sum + (a - b).powi(2));
        Ok(())
    }
}

/// Number of taps on either side of the middle that contain all but a small part of the weight.
pub(super) fn reach(taps: &[f64]) -> usize {
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

/// Treatment of each effect of a stand.
pub(super) fn effects(stand: &Stand, undo: Option<&ChainInverse>) -> Vec<UndoneEffect> {
    let Some(undo) = undo else {
        let divided = |declared: &crate::stand::DeclaredEffect| UndoneEffect {
            effect: declared.effect.name,
            form: declared.form.name,
            done: "divided out",
        };
        return stand.effects.iter().map(divided).collect();
    };
    let links = undo.links().iter().rev();
    links
        .filter(|link| !matches!(link.action, Action::Recorder { .. }))
        .map(|link| UndoneEffect {
            effect: link.effect,
            form: link.form,
            done: link.action.treatment().name(),
        })
        .collect()
}

/// Adds the findings of the inverse to the report.
fn describe(report: &mut CompensateReport, undone: &InverseResult, scales: &Scales) {
    report.seen_to_hz = undone.seen_to_hz;
    report.lines = undone.lines.iter().map(|l| removed(l, scales)).collect();
    for (effect, lost) in &undone.lost {
        let spans = spans(&lost.samples, scales);
        report
            .warnings
            .push(lost_warning(effect, lost, &spans, scales));
        let span = |[from_s, to_s]: &[f64; 2]| LostSpan {
            effect,
            from_s: *from_s,
            to_s: *to_s,
        };
        report.lost.extend(spans.iter().map(span));
    }
    for line in undone.lines.iter().filter(|line| line.share < SURE) {
        report.warnings.push(WarningCode::PhaseHidden.warning(format!(
            "the signal masks the phase of the line or of the spikes at {} Hz: only {} % of the amplitude was \
             removed; record without excitation at this frequency",
            rounded(line.frequency_hz, 5),
            rounded(100.0 * line.share, 2)
        )));
    }
    if let Some(rest) = undone.at_rest.filter(|rest| rest.part > STUCK) {
        report.warnings.push(WarningCode::DirectionUnknown.warning(format!(
            "over {} % of the record the speed is not significantly different from zero: the direction of the \
             friction is unknown there, and its part of the torque uncertain by {} {} (rms over the record)",
            rounded(100.0 * rest.part, 2),
            rounded(rest.variance.sqrt() * scales.printed.abs(), 2),
            report.unit
        )));
    }
}

/// A line in printed units.
fn removed(line: &FoundLine, scales: &Scales) -> RemovedLine {
    RemovedLine {
        frequency_hz: line.frequency_hz,
        amplitude: line.amplitude * scales.printed,
        recorded: line.recorded * scales.printed,
        phase_rad: line.phase_rad,
        share: line.share,
    }
}

/// Times of the first and last sample of each run of neighbours.
fn spans(samples: &[usize], scales: &Scales) -> Vec<[f64; 2]> {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for sample in samples {
        match runs.last_mut() {
            Some(run) if *sample <= run[1] + 1 => run[1] = *sample,
            _ => runs.push([*sample; 2]),
        }
    }
    let time_s = |i: usize| scales.start_s + i as f64 / scales.rate_hz;
    runs.iter().map(|run| run.map(time_s)).collect()
}

fn lost_warning(effect: &str, lost: &Unrecovered, spans: &[[f64; 2]], scales: &Scales) -> Warning {
    let told = spans.iter();
    let told = told.map(|[from, to]| format!("{} to {} s", rounded(*from, 7), rounded(*to, 7)));
    WarningCode::NotRecovered.warning(format!(
        "{}: {}; {}, from {}: within {} ms of {} the torque is not recovered",
        effect,
        lost.why,
        plural(lost.samples.len(), "sample"),
        some_of(told, spans.len(), SPANS_TOLD),
        rounded(1e3 * scales.reach_s, 2),
        if lost.samples.len() == 1 {
            "it"
        } else {
            "them"
        }
    ))
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
