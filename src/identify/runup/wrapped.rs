//! Positions that wrap, as from an absolute encoder that begins again after each turn, or a counter after its largest
//! number.

use std::borrow::Cow;
use std::f64::consts::{PI, TAU};

use super::{Body, FreeRun, Motion};
use crate::failure::{ErrorCode, Failure};
use crate::print::{plural, rounded};

/// Maximum share of steps that are wraps; a body that turns by more than half a turn per sample is not one that wraps.
const SHARE: f64 = 1.0 / 3.0;
/// Largest step of a continuous angle in rad, of which the sign is certain.
const CONTINUOUS: f64 = 0.5 * PI;
/// Maximum deviation of a wrap from whole turns: in rad, and relative to the usual step.
const WHOLE: (f64, f64) = (0.1, 0.5);
/// Minimum step of a wrap of any span, relative to the range of the positions.
const OF_RANGE: f64 = 0.5;
/// Maximum relative difference between the spans of a position that wraps.
const SAME: f64 = 0.02;
/// Minimum number of wraps that show a span.
const WRAPS: usize = 2;
/// Number of steps on either side of a wrap that show the motion there.
const BESIDE: usize = 5;

/// A step much larger than the others.
struct WrapJump {
    /// Index of the sample before it.
    at: usize,
    step: f64,
    /// Mean of the steps around it.
    usual: f64,
}

impl WrapJump {
    /// What makes the position continuous.
    fn span(&self) -> f64 {
        self.usual - self.step
    }

    /// Whether it is against the motion, as a wrap is.
    fn is_against(&self) -> bool {
        self.usual * self.step < 0.0
    }

    /// The nearest whole turns in rad, if it is that.
    fn whole_turns(&self) -> Option<f64> {
        let whole = TAU * (self.span() / TAU).round();
        let allowed = WHOLE.0 + WHOLE.1 * self.usual.abs();
        ((self.span() - whole).abs() < allowed.min(CONTINUOUS)).then_some(whole)
    }
}

/// Steps beyond a size, unless there are too many.
fn jumps(motion: &[f64], least: f64) -> Vec<WrapJump> {
    let steps: Vec<f64> = motion.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let usual = |at: usize| {
        let around = &steps[at.saturating_sub(BESIDE)..(at + BESIDE + 1).min(steps.len())];
        let around = around.iter().filter(|step| step.abs() <= least);
        around.clone().sum::<f64>() / around.count().max(1) as f64
    };
    let beyond = (0..steps.len()).filter(|at| steps[*at].abs() > least);
    let all = beyond.map(|at| WrapJump {
        at,
        step: steps[at],
        usual: usual(at),
    });
    let all: Vec<WrapJump> = all.collect();
    match all.len() as f64 > SHARE * motion.len() as f64 {
        true => Vec::new(),
        false => all,
    }
}

/// The constant span of all jumps, if it is the range of the positions, as of a counter that begins again.
fn constant_span(jumps: &[WrapJump], range: f64) -> Option<f64> {
    let spans = || jumps.iter().map(|jump| jump.span().abs());
    let mean = spans().sum::<f64>() / jumps.len() as f64;
    let step = jumps.iter().map(|jump| jump.usual.abs());
    let is_range = (mean - range).abs() < SAME * mean + 2.0 * step.fold(0.0, f64::max);
    let is_same = spans().all(|span| (span - mean).abs() < SAME * mean);
    let against = jumps.iter().filter(|jump| jump.is_against());
    (is_same && is_range && against.count() >= WRAPS).then_some(mean)
}

/// A continuous position, and how it was made so; other motions are unchanged.
///
/// # Errors
/// If it jumps by neither whole turns nor another constant span.
pub(super) fn continuous<'a>(
    run: &FreeRun<'a>,
) -> Result<(Cow<'a, [f64]>, Option<String>), Failure> {
    if run.kind != Motion::Displacement {
        return Ok((run.motion.into(), None));
    }
    let is_turning = run.body == Body::Turning;
    let turns = match is_turning {
        true => jumps(run.motion, CONTINUOUS),
        false => Vec::new(),
    };
    let whole: Option<Vec<f64>> = turns.iter().map(WrapJump::whole_turns).collect();
    if let Some(whole) = whole.filter(|whole| !whole.is_empty()) {
        let count = plural(whole.len(), "time");
        let method = format!(
            "the angle wraps {count}: whole turns were added there, so that it is continuous"
        );
        return Ok((joined(run.motion, &turns, &whole).into(), Some(method)));
    }
    let ends = |of: fn(f64, f64) -> f64, from: f64| run.motion.iter().copied().fold(from, of);
    let range = ends(f64::max, f64::NEG_INFINITY) - ends(f64::min, f64::INFINITY);
    let any = jumps(run.motion, OF_RANGE * range);
    if let Some(span) = constant_span(&any, range) {
        let spans: Vec<f64> = any.iter().map(|jump| span.copysign(jump.span())).collect();
        let size = match is_turning {
            true => format!(
                "{} rad ({} turns)",
                rounded(span, 4),
                rounded(span / TAU, 4)
            ),
            false => format!("{} m", rounded(span, 4)),
        };
        let method = format!(
            "the position wraps {}, each time by {size}: this was added there, so that it is continuous",
            plural(any.len(), "time")
        );
        return Ok((joined(run.motion, &any, &spans).into(), Some(method)));
    }
    let mut turns = turns.iter().filter(|jump| jump.whole_turns().is_none());
    match turns.next().or(any.iter().find(|jump| jump.is_against())) {
        None => Ok((run.motion.into(), None)),
        Some(jump) => Err(ErrorCode::UnsuitableRecord.failed(format_args!(
            "the position jumps by {} {} between samples {} and {}: it wraps and cannot be made continuous; \
             record it continuously or at a higher rate, and without interpolation over the wraps",
            rounded(jump.step, 4),
            if is_turning { "rad" } else { "m" },
            jump.at + 1,
            jump.at + 2
        ))),
    }
}

/// Positions with spans added from each jump on.
fn joined(motion: &[f64], jumps: &[WrapJump], spans: &[f64]) -> Vec<f64> {
    let mut wraps = jumps.iter().zip(spans).peekable();
    let mut added = 0.0;
    let position = |(i, position): (usize, &f64)| {
        if let Some((_, span)) = wraps.next_if(|(jump, _)| jump.at + 1 == i) {
            added += span;
        }
        position + added
    };
    motion.iter().enumerate().map(position).collect()
}
