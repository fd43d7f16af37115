//! One case: two records of a stand with an undeclared effect, and the truth about them.

use serde_json::{Value, json};

use super::catalogue::{Variant, variant_of};
use super::draw::Draw;
use super::excitation::{Excitation, Input, RATE_HZ};
use super::integrate::run;
use super::plain_fit::{PlainConstants, fit, left_by, rms};
use super::plant::{Built, Constants, Place, Plain, Scene};

/// A record: what was applied and what was measured.
pub struct Record {
    pub applied_n_m: Vec<f64>,
    pub measured_n_m: Vec<f64>,
    /// The noise in it.
    pub noise_rms: f64,
}

/// Two records and the truth.
pub struct Case {
    pub effect: &'static str,
    pub number: usize,
    pub train: Record,
    pub holdout: Record,
    pub top_hz: f64,
    /// The best plain fit.
    pub plain: PlainConstants,
    pub truth: Value,
}

/// What a case is drawn from.
struct Setting {
    constants: Constants,
    excitations: [Excitation; 2],
    inputs: [Input; 2],
    noise: Noise,
    target: f64,
}

/// The noise of the recorder.
#[derive(Debug, Clone, Copy)]
struct Noise {
    /// Relative to the rms of the signal.
    share: f64,
    /// The same in both records, or the same share of both.
    absolute: bool,
    /// Correlation from one sample to the next.
    memory: f64,
    /// Smallest step of the recorder over the noise; 0 for none.
    quantum: f64,
}

/// Constants that differ from those of the thesis by 2 to 20 per cent, either way.
fn constants(draw: &mut Draw) -> Constants {
    let mut off = |value: f64| value * (1.0 + draw.sign() * draw.log_between(0.02, 0.2));
    let thesis = Constants::hertel();
    Constants {
        inertia_kg_m2: off(thesis.inertia_kg_m2),
        damping_n_m_s: off(thesis.damping_n_m_s),
        stiffness_n_m: off(thesis.stiffness_n_m),
    }
}

/// Training and held-out input. `alike` keeps the held-out one at the level of the training.
fn excitations(draw: &mut Draw, alike: bool) -> [Excitation; 2] {
    let rms = draw.log_between(1.0, 8.0);
    let settled = draw.chance(0.6);
    let kind = draw.one_of(&[0, 0, 1, 1, 2, 3, 4, 5]);
    let drawn = if draw.chance(0.8) {
        draw.between(0.4, 0.8)
    } else {
        draw.between(1.2, 1.5)
    };
    let level = if alike { 1.0 } else { drawn };
    let mut first = match kind {
        3 | 4 => Excitation::sweep(draw, 1.5 * rms),
        _ => Excitation::multisine(draw, rms, settled),
    };
    let second = match kind {
        0 => first.at_level(level),
        2 | 4 => Excitation::sweep(draw, 1.5 * rms * level),
        _ => Excitation::multisine(draw, rms * level, settled),
    };
    if let (5, Excitation::Multisine { second_half, .. }) = (kind, &mut first) {
        *second_half = draw.between(0.3, 0.7);
    }
    [first, second]
}

/// Strengths from marginal to plain to see: the plain fit's noise-free residual over the noise.
fn target(draw: &mut Draw, number: usize) -> f64 {
    match number % 4 {
        0 => draw.log_between(0.3, 1.0),
        3 => draw.log_between(5.0, 25.0),
        _ => draw.log_between(1.0, 5.0),
    }
}

fn setting(seed: u64, number: usize, alike: bool) -> Setting {
    let mut draw = Draw::new(seed, "setting");
    let constants = constants(&mut draw);
    let noise = Noise {
        share: draw.log_between(0.001, 0.01),
        absolute: draw.chance(0.7),
        memory: if draw.chance(0.1) {
            draw.between(0.2, 0.5)
        } else {
            0.0
        },
        quantum: if draw.chance(0.1) {
            draw.between(0.3, 1.5)
        } else {
            0.0
        },
    };
    let target = target(&mut draw, number);
    let excitations = excitations(&mut draw, alike);
    let inputs = [excitations[0].input(), excitations[1].input()];
    Setting {
        constants,
        excitations,
        inputs,
        noise,
        target,
    }
}

fn scene(setting: &Setting) -> Scene {
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
    }
}

/// The noise-free record of a stand with the effect.
fn noise_free(built: &Built, input: &Input, record: usize, seed: u64) -> Vec<f64> {
    let mut dense = run(built.dynamics.as_ref(), input);
    if let Some(change) = &built.on_dense {
        dense = change(dense);
    }
    let mut samples = dense.samples();
    if let Some(change) = &built.on_samples {
        let draw = Draw::new(seed, if record == 0 { "train" } else { "holdout" });
        change(&mut Place { input, draw }, &mut samples);
    }
    samples
}

impl Noise {
    fn add(&self, samples: &mut [f64], rms_n_m: f64, draw: &mut Draw) -> f64 {
        let fresh = (1.0 - self.memory * self.memory).sqrt();
        let mut noise = draw.normal();
        let step = self.quantum * rms_n_m;
        let mut square = 0.0;
        for sample in samples.iter_mut() {
            let clean = *sample;
            *sample += rms_n_m * noise;
            if step > 0.0 {
                *sample = (*sample / step).round() * step;
            }
            square += (*sample - clean).powi(2);
            noise = self.memory * noise + fresh * draw.normal();
        }
        (square / samples.len() as f64).sqrt()
    }
}

/// An effect in its final size.
struct Sized {
    size: f64,
    built: Built,
    signal: Vec<f64>,
    plain: PlainConstants,
    strength: f64,
}

/// One try of a size.
fn try_size(
    setting: &Setting,
    scene: &Scene,
    variant: &Variant,
    seed: u64,
    (size, start): (f64, PlainConstants),
) -> Sized {
    let built = (variant.build)(scene, size, &mut Draw::new(seed, "effect"));
    let signal = noise_free(&built, &setting.inputs[0], 0, seed);
    let (plain, left) = if signal.iter().all(|value| value.is_finite()) {
        fit(start, &setting.inputs[0], &signal)
    } else {
        (start, f64::INFINITY)
    };
    let strength = left / (setting.noise.share * rms(&signal));
    Sized {
        size,
        built,
        signal,
        plain,
        strength,
    }
}

/// The size at which the effect has about the strength wanted, within what is physical.
fn sized(setting: &Setting, scene: &Scene, variant: &Variant, seed: u64) -> Sized {
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
        let off = (setting.target / tried.strength).ln();
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
            // An effect with a threshold: between what was too little and what was too much.
            size = (too_small.max(too_large * 1e-3) * too_large).sqrt();
        }
    }
    try_size(setting, scene, variant, seed, (size, start))
}

/// The seed of a case.
fn seed_of(master: u64, effect: &str, number: usize, attempt: u64) -> u64 {
    let mut draw = Draw::new(master.wrapping_add(attempt << 40), effect);
    let mut seed = 0;
    for _ in 0..=number {
        seed = (draw.unit() * 9e15) as u64;
    }
    seed
}

/// Makes a case; `None` if no list has the effect.
///
/// Where the held-out record would hardly show the effect (a clip that its level never reaches), the case
/// is drawn again with both records at one level.
pub fn make(master: u64, effect: &str, number: usize) -> Option<Case> {
    let variant = variant_of(effect, number)?;
    let mut case = attempt(master, variant, number, 0);
    for again in 1..4 {
        if case.1 {
            break;
        }
        case = attempt(master, variant, number, again);
    }
    Some(case.0)
}

/// A case, and whether its held-out record shows the effect, too.
fn attempt(master: u64, variant: &'static Variant, number: usize, again: u64) -> (Case, bool) {
    let seed = seed_of(master, variant.effect, number, again);
    let setting = setting(seed, number, again > 0);
    let scene = scene(&setting);
    let sized = sized(&setting, &scene, variant, seed);
    let held = noise_free(&sized.built, &setting.inputs[1], 1, seed);
    let held_left = left_by(sized.plain, &setting.inputs[1], &held);
    let mut noise_rms = [setting.noise.share * rms(&sized.signal); 2];
    if !setting.noise.absolute {
        noise_rms[1] = setting.noise.share * rms(&held);
    }
    let held_strength = held_left / noise_rms[1];
    let mut records = [sized.signal.clone(), held];
    for (index, record) in records.iter_mut().enumerate() {
        let mut draw = Draw::new(seed, ["noise of train", "noise of holdout"][index]);
        noise_rms[index] = setting.noise.add(record, noise_rms[index], &mut draw);
    }
    let shows = variant.effect == "none"
        || held_strength > 0.4 * sized.strength.max(0.5)
        || held_strength > 3.0;
    let truth = truth(
        variant,
        number,
        seed,
        &setting,
        &sized,
        (held_left, noise_rms),
    );
    let [train, holdout] = records;
    let record = |index: usize, measured_n_m: Vec<f64>| Record {
        applied_n_m: setting.inputs[index].samples(),
        measured_n_m,
        noise_rms: noise_rms[index],
    };
    let case = Case {
        effect: variant.effect,
        number,
        train: record(0, train),
        holdout: record(1, holdout),
        top_hz: setting
            .excitations
            .iter()
            .map(Excitation::top_hz)
            .fold(0.0, f64::max),
        plain: sized.plain,
        truth,
    };
    (case, shows && held_strength.is_finite())
}

fn truth(
    variant: &Variant,
    number: usize,
    seed: u64,
    setting: &Setting,
    sized: &Sized,
    (held_left, noise_rms): (f64, [f64; 2]),
) -> Value {
    let parameters: serde_json::Map<String, Value> = sized
        .built
        .parameters
        .iter()
        .map(|(name, value)| ((*name).to_owned(), json!(value)))
        .collect();
    let per_hz = std::f64::consts::TAU;
    json!({
        "effect": variant.effect,
        "variant": variant.name,
        "number": number,
        "seed": seed,
        "size": sized.size,
        "parameters": parameters,
        "strength": {
            "what": "rms that the best plain fit leaves of the noise-free record, over the noise",
            "train": sized.strength,
            "holdout": held_left / noise_rms[1],
        },
        "noise": {
            "share_of_rms": setting.noise.share,
            "train_rms_n_m": noise_rms[0],
            "holdout_rms_n_m": noise_rms[1],
            "correlation_of_neighbours": setting.noise.memory,
            "quantum_over_rms": setting.noise.quantum,
        },
        "plain_fit": {
            "natural_frequency_hz": sized.plain.omega / per_hz,
            "damping_ratio": sized.plain.damping_ratio,
            "holdout_rms_with_noise_n_m": held_left.hypot(noise_rms[1]),
        },
        "true_constants": {
            "inertia_kg_m2": setting.constants.inertia_kg_m2,
            "damping_n_m_s_per_rad": setting.constants.damping_n_m_s,
            "stiffness_n_m_per_rad": setting.constants.stiffness_n_m,
            "natural_frequency_hz": setting.constants.omega() / per_hz,
            "damping_ratio": setting.constants.damping_ratio(),
        },
        "records": {
            "rate_hz": RATE_HZ,
            "train": setting.excitations[0].describe(),
            "holdout": setting.excitations[1].describe(),
            "train_rms_n_m": rms(&sized.signal),
            "top_hz": setting.excitations.iter().map(Excitation::top_hz).fold(0.0, f64::max),
        },
    })
}
