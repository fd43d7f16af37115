//! Backlash between stator and beam.
//!
//! `gap`: within `±g` of the centre the beam is not touched, `n = −clamp(x, −g, g)`, and the gage shows nothing
//! (`gap-beside`: the gage still follows the displacement). `soft-gap`: a softer contact carries within it,
//! `n = −r clamp(x, −g, g)`; with a large `g` this would be an end stop, so `g` is bounded. `joint`: the beam follows
//! the stator with backlash, `n = w − x` with `w` dragged along at a distance of at most `g` (the play operator of M.
//! A. Krasnoselskii, A. V. Pokrovskii, *Systems with Hysteresis* (1989)), and the gage shows `x`; `joint-shown`: the
//! gage is on the beam and shows `w`. `recorded`: the same backlash, but only in what drives the gage. M. Nordin, P.-O.
//! Gutman, *Controlling mechanical systems with backlash*, Automatica 38 (2002), 1633. **Valid for stiff flanks without impact losses.** Mistaken for `coulomb-friction`, `bouc-wen-hysteresis`, and
//! at one level for `cubic-stiffness`.

use super::{
    Action, Distortion, Effect, EffectParameter, Form, Memory, SampleClock, Stage, Torque,
    Unrecovered, Zero,
};

const GAP: EffectParameter = EffectParameter::motion("gap", 1, 0, 0.0, 3.0);
/// A larger gap would be an end stop beside the beam.
const SMALL_GAP: EffectParameter = EffectParameter::motion("gap", 1, 0, 0.0, 0.8);
const SOFTENING: EffectParameter = EffectParameter::number("softening", 0.0, 1.0);
const GAPS: &[&[f64]] = &[&[0.005], &[0.02], &[0.1], &[0.4]];
const SOFT_GAPS: &[&[f64]] = &[&[0.01, 0.4], &[0.05, 0.4], &[0.3, 0.4]];

pub(super) static EFFECT: Effect = Effect {
    name: "backlash",
    equation: "n = -clamp(x, -g, g)",
    meaning: "The stator moves within a gap without loading the beam, so the record misses what happens there.",
    remedy: "Tighten or preload the joint between stator and beam, or keep it closed with a steady torque.",
    source: "M. Nordin, P.-O. Gutman, Automatica 38 (2002), 1633",
    validity: "for stiff flanks without impact losses",
    mistaken_for: &["coulomb-friction", "bouc-wen-hysteresis", "cubic-stiffness"],
    experiment: "slow loading and unloading through zero, and the response with a preload",
    forms: &[
        Form {
            name: "gap",
            law: "n = -clamp(x, -g, g): between -g and g the beam is not loaded, and the gage reads zero",
            stage: Stage::Stand,
            parameters: &[GAP],
            starts: GAPS,
            build: |p| Action::in_gage_path(Gap::of(p)),
        },
        Form {
            name: "gap-beside",
            law: "n = -clamp(x, -g, g), but the gage follows the displacement",
            stage: Stage::Stand,
            parameters: &[GAP],
            starts: GAPS,
            build: |p| Action::beside(Gap::of(p)),
        },
        Form {
            name: "soft-gap",
            law: "n = -r clamp(x, -g, g): a softer spring acts within the gap",
            stage: Stage::Stand,
            parameters: &[SMALL_GAP, SOFTENING],
            starts: SOFT_GAPS,
            build: |p| Action::in_gage_path(Gap::of(p)),
        },
        Form {
            name: "soft-gap-beside",
            law: "n = -r clamp(x, -g, g), but the gage follows the displacement",
            stage: Stage::Stand,
            parameters: &[SMALL_GAP, SOFTENING],
            starts: SOFT_GAPS,
            build: |p| Action::beside(Gap::of(p)),
        },
        Form {
            name: "joint",
            law: "n = w - x, w dragged along within g of x: the beam follows the stator with play",
            stage: Stage::Stand,
            parameters: &[GAP],
            starts: &[&[0.02], &[0.1]],
            build: |p| Action::beside(Joint { gap: p[0] }),
        },
        Form {
            name: "joint-shown",
            law: "n = w - x, w dragged along within g of x, and the gage, on the beam, shows w",
            stage: Stage::Stand,
            parameters: &[GAP],
            starts: &[&[0.02], &[0.1]],
            build: |p| Action::in_gage_path(Joint { gap: p[0] }),
        },
        Form {
            name: "recorded",
            law: "y = w, w dragged along within g of x: play only in the drive of the gage",
            stage: Stage::Gage,
            parameters: &[GAP],
            starts: &[&[0.02], &[0.1]],
            build: |p| Action::Distortion(Box::new(Play { gap: p[0] })),
        },
    ],
};

struct Gap {
    gap: f64,
    share: f64,
}

impl Gap {
    fn of(p: &[f64]) -> Self {
        Self {
            gap: p[0],
            share: p.get(1).copied().unwrap_or(1.0),
        }
    }
}

impl Torque for Gap {
    fn value(&self, _: &mut Memory, x: f64, _: f64) -> f64 {
        -self.share * x.clamp(-self.gap, self.gap)
    }

    fn hidden(&self) -> f64 {
        // Within a soft gap the gage still shows a weak signal.
        if self.share < 1.0 { 0.0 } else { self.gap }
    }

    fn zero(&self) -> Zero {
        Zero::Fixed
    }
}

/// A follower dragged to within `gap` of `x`. `x` may be NaN when trial parameters make the motion diverge, and `clamp`
/// would panic then.
fn within(follower: f64, x: f64, gap: f64) -> f64 {
    follower.max(x - gap).min(x + gap)
}

struct Joint {
    gap: f64,
}

impl Torque for Joint {
    fn value(&self, memory: &mut Memory, x: f64, _: f64) -> f64 {
        memory[0] = within(memory[0], x, self.gap);
        memory[0] - x
    }

    fn begin(&self, x: f64) -> Memory {
        [x, 0.0]
    }
}

/// Backlash in what drives the gage.
struct Play {
    gap: f64,
}

impl Distortion for Play {
    fn forward(&self, _: SampleClock, samples: &mut [f64]) {
        let mut follower = samples.first().copied().unwrap_or(0.0);
        for sample in samples {
            follower = within(follower, *sample, self.gap);
            *sample = follower;
        }
    }

    fn inverse(&self, _: SampleClock, noise_std: f64, samples: &mut [f64]) -> Unrecovered {
        Unrecovered {
            why: "the gage does not move while the play is taken up".to_owned(),
            samples: without_play(samples, self.gap, noise_std),
        }
    }
}

/// Least turning point, in standard deviations of the noise.
const TURN: f64 = 4.0;
/// Least turning point, relative to the backlash.
const SMALLEST: f64 = 1e-3;

/// Inverts backlash of half-width `gap`: `x = y ± g` while the gage moves and, from one flank to the other, a
/// parabola, as a motion is near its turning point. Returns the samples at which the gage stood still.
fn without_play(samples: &mut [f64], gap: f64, noise_std: f64) -> Vec<usize> {
    let width = (TURN * noise_std).max(SMALLEST * gap);
    let turns = turns(samples, width);
    let mut bridged = Vec::new();
    let Some(first) = turns.first() else {
        return bridged;
    };
    let mut direction = first.before;
    let mut next = turns.iter().peekable();
    for (i, sample) in samples.iter_mut().enumerate() {
        while next.peek().is_some_and(|turn| i > turn.to) {
            direction = -next.next().map_or(direction, |turn| turn.before);
        }
        match next.peek() {
            Some(turn) if i >= turn.from => {
                let part = (i - turn.from) as f64 / (turn.to - turn.from).max(1) as f64;
                *sample = turn.at + turn.before * gap * (1.0 - 2.0 * part * part);
                bridged.push(i);
            }
            _ => *sample += direction * gap,
        }
    }
    bridged
}

/// An interval in which the gage stood still while the gap was crossed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TurningPoint {
    /// First sample at rest.
    from: usize,
    to: usize,
    /// Direction before it: 1 or −1.
    before: f64,
    /// Gage reading at rest.
    at: f64,
}

/// Turning points of a signal that exceed `width`.
fn turns(samples: &[f64], width: f64) -> Vec<TurningPoint> {
    let mut turns = Vec::new();
    let mut direction = 0.0;
    let (mut high, mut low) = (0, 0);
    for (i, y) in samples.iter().enumerate() {
        if *y > samples[high] {
            high = i;
        }
        if *y < samples[low] {
            low = i;
        }
        let turned = if direction >= 0.0 && samples[high] - y > width {
            Some((1.0, high))
        } else if direction <= 0.0 && y - samples[low] > width {
            Some((-1.0, low))
        } else {
            None
        };
        if let Some((before, extreme)) = turned {
            turns.push(rest(samples, before, extreme, width));
            direction = -before;
            (high, low) = (i, i);
        }
    }
    turns
}

/// The interval around an extreme in which the signal stays within `width` of it.
fn rest(samples: &[f64], before: f64, extreme: usize, width: f64) -> TurningPoint {
    let end = samples[extreme];
    let still = |i: &usize| (end - samples[*i]) * before <= width;
    let from = (0..=extreme)
        .rev()
        .take_while(still)
        .last()
        .unwrap_or(extreme);
    let to = (extreme..samples.len())
        .take_while(still)
        .last()
        .unwrap_or(extreme);
    // In noise the extreme is the largest of many samples, so the mean estimates the resting value.
    let at = samples[from..=to].iter().sum::<f64>() / (to + 1 - from) as f64;
    TurningPoint {
        from,
        to,
        before,
        at,
    }
}

/// Bridges the intervals where the gage shows nothing, `|y| ≤ nothing`, by a cubic that matches the slopes at both
/// ends, and marks the samples as unknown.
pub(crate) fn bridge(x: &mut [f64], unknown: &mut [bool], signal: &[f64], nothing: f64) {
    let inside = |y: &f64| y.abs() <= nothing;
    let mut i = 0;
    while i < x.len() {
        if !inside(&signal[i]) {
            i += 1;
            continue;
        }
        let first = i;
        let end = (first..x.len())
            .find(|k| !inside(&signal[*k]))
            .unwrap_or(x.len());
        unknown[first..end].fill(true);
        if first >= 2 && end + 1 < x.len() {
            cubic(x, first - 1, end);
        }
        i = end;
    }
}

/// Cubic interpolation between two samples, matching the slopes at both.
fn cubic(x: &mut [f64], from: usize, to: usize) {
    let length = (to - from) as f64;
    let (a, b) = (x[from], x[to]);
    let (slope_a, slope_b) = (
        (a - x[from - 1]) * length,
        (x[(to + 1).min(x.len() - 1)] - b) * length,
    );
    for (i, x) in x[from + 1..to].iter_mut().enumerate() {
        let t = (i + 1) as f64 / length;
        let (u, t2) = (1.0 - t, t * t);
        *x = u * u * ((1.0 + 2.0 * t) * a + t * slope_a) + t2 * ((3.0 - 2.0 * t) * b - u * slope_b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_that_diverged_is_no_panic() {
        let joint = Joint { gap: 0.2 };
        assert!(joint.value(&mut [0.0, 0.0], f64::NAN, 0.0).is_nan());
        assert_eq!(within(1.0, 0.5, 0.2), 0.7);
        assert_eq!(within(-1.0, 0.5, 0.2), 0.3);
        assert_eq!(within(0.6, 0.5, 0.2), 0.6);
    }

    #[test]
    fn a_sine_comes_back_through_play() {
        let gap = 0.2;
        let clean: Vec<f64> = (0..4000).map(|i| (f64::from(i) * 0.01).sin()).collect();
        let mut samples = clean.clone();
        Play { gap }.forward(SampleClock { step_s: 0.01 }, &mut samples);
        let _ = without_play(&mut samples, gap, 0.0);
        let worst = |range: std::ops::Range<usize>| {
            range
                .map(|i| (samples[i] - clean[i]).abs())
                .fold(0.0, f64::max)
        };
        assert!(worst(200..3900) < 0.02, "{}", worst(200..3900));
    }
}
