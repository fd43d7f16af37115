//! Size of an effect for a given strength, by iteration.

use super::catalogue::Variant;
use super::draw::Draw;
use super::excitation::Input;
use super::integrate::{Dense, run};
use super::plain_fit::{PlainConstants, fit, rms};
use super::plant::{Built, Place, Plain, Scene};
use super::setting::Setting;

/// Response of the plain stand to the training input.
pub fn scene(setting: &Setting) -> Scene {
    let constants = setting.constants;
    let dense = run(&Plain(constants), &setting.inputs[0]);
    let speeds: Vec<f64> = dense.values[dense.before..]
        .windows(2)
        .map(|pair| (pair[1] - pair[0]) / dense.step_s / constants.stiffness_n_m)
        .collect();
    let shown = dense.samples();
    Scene {
        constants,
        shown_peak: shown.iter().fold(0.0, |peak: f64, y| peak.max(y.abs())),
        shown_rms: rms(&shown),
        speed_rms: rms(&speeds),
        applied_rms: rms(&setting.inputs[0].samples()),
        top_hz: setting.excitations[0]
            .top_hz()
            .min(setting.excitations[1].top_hz()),
        span: setting.span,
        filtered: setting.filter.is_some(),
    }
}

/// The noise-free record of a stand with the effect.
pub fn noise_free(built: &Built, input: &Input, record: usize, seed: u64) -> Vec<f64> {
    sampled(built, input, shown(built, input), (record, seed))
}

/// The noise-free record of a setting's stand with the effect.
pub fn in_setting(setting: &Setting, built: &Built, record: usize, seed: u64) -> Vec<f64> {
    let acts = &setting.inputs[record];
    let Some(filter) = &setting.filter else {
        return noise_free(built, acts, record, seed);
    };
    // The filter is on both channels.
    let dense = filter.signal(shown(built, acts));
    sampled(built, setting.recorded(record), dense, (record, seed))
}

/// Input of the recorder.
fn shown(built: &Built, input: &Input) -> Dense {
    let dense = run(built.dynamics.as_ref(), input);
    match &built.on_dense {
        Some(change) => change(dense),
        None => dense,
    }
}

fn sampled(built: &Built, input: &Input, dense: Dense, (record, seed): (usize, u64)) -> Vec<f64> {
    let mut samples = dense.samples();
    if let Some(change) = &built.on_samples {
        let draw = Draw::new(seed, if record == 0 { "train" } else { "holdout" });
        change(&mut Place { input, draw }, &mut samples);
    }
    samples
}

/// An effect with its final size.
pub struct Fitted {
    pub size: f64,
    pub built: Built,
    pub signal: Vec<f64>,
    pub plain: PlainConstants,
    pub strength: f64,
}

/// One trial of a size.
fn try_size(
    setting: &Setting,
    scene: &Scene,
    variant: &Variant,
    seed: u64,
    (size, start): (f64, PlainConstants),
) -> Fitted {
    let built = (variant.build)(scene, size, &mut Draw::new(seed, "effect"));
    let signal = in_setting(setting, &built, 0, seed);
    let (plain, left) = if signal.iter().all(|value| value.is_finite()) {
        fit(start, setting.recorded(0), &signal)
    } else {
        (start, f64::INFINITY)
    };
    let strength = setting.strength(left, &signal);
    Fitted {
        size,
        built,
        signal,
        plain,
        strength,
    }
}

/// The size at which the effect has about the target strength, within physical limits.
pub fn sized(
    setting: &Setting,
    scene: &Scene,
    variant: &Variant,
    target: f64,
    seed: u64,
) -> Fitted {
    let (least, first, most) = variant.sizes;
    let mut size = first.max(least);
    let (mut too_small, mut too_large) = (least * 0.999, most * 1.001);
    let truth = PlainConstants {
        omega: setting.constants.omega(),
        damping_ratio: setting.constants.damping_ratio(),
    };
    let (mut power, mut start) = (1.0, truth);
    let mut last: Option<(f64, f64)> = None;
    for tries in 0..9 {
        let tried = try_size(setting, scene, variant, seed, (size, start));
        if !tried.strength.is_finite() {
            (size, start, last) = (size * 0.4, truth, None);
            continue;
        }
        let off = (target / tried.strength).ln();
        let at_limit = (size >= most && off > 0.0) || (size <= least && off < 0.0);
        if variant.effect == "none" || off.abs() < 0.3 || at_limit || tries == 8 {
            return tried;
        }
        let log = (size.ln(), tried.strength.max(1e-9).ln());
        if let Some(before) = last.filter(|before| (before.0 - log.0).abs() > 1e-6) {
            power = ((log.1 - before.1) / (log.0 - before.0)).clamp(0.4, 6.0);
        }
        last = Some(log);
        start = tried.plain;
        let side = if off > 0.0 {
            &mut too_small
        } else {
            &mut too_large
        };
        *side = size;
        size = (size * (off / power).clamp(-3.0, 3.0).exp()).clamp(least, most);
        if size <= too_small || size >= too_large {
            // An effect with a threshold: between the last sizes below and above it.
            size = (too_small.max(too_large * 1e-3) * too_large).sqrt();
        }
    }
    try_size(setting, scene, variant, seed, (size, start))
}
