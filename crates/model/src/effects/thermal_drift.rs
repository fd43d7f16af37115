//! Temperature drift of zero or sensitivity.
//!
//! `linear`: `y = x + d t`; `exponential`: `y = x + D (1 − e^{−t/τ})`, a body that warms up; `sensitivity`:
//! `y = (1 + g t) x`. `t` is the time since the record began. `course`: any slow trend of up to eight half waves over
//! the record; like the phase of a line it belongs to the record and is estimated anew in each. Thesis, Appendix B:
//! "temperatures … not large enough" for the gage factor; as a zero shift 2 % of resistance at 85 °F is. **Valid over
//! one warm-up.** Mistaken for `ac-coupled` of `capacitive-coupling`, a slow disturbance.

use std::f64::consts::PI;

use super::{
    Action, Distortion, Effect, EffectParameter, Form, ParameterScale, SampleClock, Stage,
    Treatment, Unrecovered,
};

/// Maximum number of half waves of a trend over a record.
const HALF_WAVES: usize = 8;

pub(super) static EFFECT: Effect = Effect {
    name: "thermal-drift",
    equation: "y = x + d t, or x + D (1 - e^(-t/tau)), or (1 + g t) x",
    meaning: "Zero or sensitivity drifts while gage, bridge or amplifier warm up.",
    remedy: "Let everything warm up before recording, use a full bridge, and record the zero before and after.",
    source: "T. P. Hertel's thesis, Appendix B",
    validity: "during a single warm-up",
    mistaken_for: &["capacitive-coupling"],
    experiment: "a record at constant load, several times as long",
    forms: &[
        Form {
            name: "linear",
            law: "y = x + d t",
            stage: Stage::Chain,
            parameters: &[
                EffectParameter::motion("slope", 1, -1, -100.0, 100.0).by(ParameterScale::Record)
            ],
            starts: &[&[0.01]],
            build: |p| {
                let slope = p[0];
                added(move |time_s| slope * time_s)
            },
        },
        Form {
            name: "exponential",
            law: "y = x + D (1 - e^(-t/tau))",
            stage: Stage::Chain,
            parameters: &[
                EffectParameter::motion("drift", 1, 0, -100.0, 100.0),
                EffectParameter::motion("time_constant", 0, 1, 0.01, 20.0)
                    .by(ParameterScale::Record),
            ],
            starts: &[&[0.01, 0.1], &[0.01, 0.4], &[0.01, 1.5]],
            build: |p| {
                let (drift, constant_s) = (p[0], p[1]);
                added(move |time_s| -drift * (-time_s / constant_s).exp_m1())
            },
        },
        Form {
            name: "sensitivity",
            law: "y = (1 + g t) x",
            stage: Stage::Chain,
            parameters: &[
                EffectParameter::motion("rate", 0, -1, -0.9, 10.0).by(ParameterScale::Record)
            ],
            starts: &[&[0.01]],
            build: |p| Action::Distortion(Box::new(Sensitivity { rate_per_s: p[0] })),
        },
        Form {
            name: "course",
            law: "y = x + any slow drift, of up to eight half waves over the record",
            stage: Stage::Disturbance,
            parameters: &[],
            starts: &[&[]],
            build: |_| Action::Course(HALF_WAVES),
        },
    ],
};

/// `y = x + d(t)`.
struct Drift<F>(F);

fn added(drift: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Action {
    Action::Distortion(Box::new(Drift(drift)))
}

impl<F: Fn(f64) -> f64 + Send + Sync> Distortion for Drift<F> {
    fn forward(&self, clock: SampleClock, samples: &mut [f64]) {
        for (i, sample) in samples.iter_mut().enumerate() {
            *sample += (self.0)(clock.time_s(i));
        }
    }

    fn inverse(&self, clock: SampleClock, _: f64, samples: &mut [f64]) -> Unrecovered {
        for (i, sample) in samples.iter_mut().enumerate() {
            *sample -= (self.0)(clock.time_s(i));
        }
        Unrecovered::default()
    }

    fn treatment(&self) -> Treatment {
        Treatment::Subtracted
    }

    fn is_timed(&self) -> bool {
        true
    }
}

/// `y = (1 + g t) x`.
struct Sensitivity {
    rate_per_s: f64,
}

impl Distortion for Sensitivity {
    fn forward(&self, clock: SampleClock, samples: &mut [f64]) {
        for (i, sample) in samples.iter_mut().enumerate() {
            *sample *= 1.0 + self.rate_per_s * clock.time_s(i);
        }
    }

    fn inverse(&self, clock: SampleClock, _: f64, samples: &mut [f64]) -> Unrecovered {
        for (i, sample) in samples.iter_mut().enumerate() {
            *sample *= (1.0 + self.rate_per_s * clock.time_s(i)).recip();
        }
        Unrecovered::default()
    }

    fn is_timed(&self) -> bool {
        true
    }
}

/// Number of higher half waves, in multiples of those of a trend, from which its signal content is
/// estimated.
const COURSE_BESIDE: usize = 2;

/// Subtracts a slow trend of this many half waves from a record, keeping its mean.
///
/// Each half wave is shrunk by `1 − S/c²`, `S` being the power of the half waves just above, which are
/// signal.
pub fn subtract_course(samples: &mut [f64], half_waves: usize) {
    let count = samples.len() as f64;
    let wave = |k: usize, i: usize| (PI * k as f64 * (i as f64 + 0.5) / count).cos();
    let part = |samples: &[f64], k: usize| {
        let sum: f64 = samples
            .iter()
            .enumerate()
            .map(|(i, x)| x * wave(k, i))
            .sum();
        2.0 * sum / count
    };
    let mut beside: Vec<f64> = (half_waves + 1..=(1 + COURSE_BESIDE) * half_waves)
        .map(|k| part(samples, k).powi(2))
        .collect();
    beside.sort_by(f64::total_cmp);
    // A comb has few lines, so the median is unaffected. The square of a normal variable has a median of 0.455.
    let beside = beside.get(beside.len() / 2).map_or(0.0, |b| b / 0.455);
    for k in 1..=half_waves {
        let own = part(samples, k);
        let share = (1.0 - beside / (own * own)).max(0.0);
        if share.is_nan() {
            continue;
        }
        for (i, sample) in samples.iter_mut().enumerate() {
            *sample -= share * own * wave(k, i);
        }
    }
}
