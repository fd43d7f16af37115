//! Records with several effects at once, each with its own size, in one stand.

use super::catalogue::{CATALOGUE, Variant};
use super::draw::Draw;
use super::integrate::{Dense, Dynamics, STATES, State};
use super::plain_fit::{PlainConstants, fit};
use super::plant::{Built, Constants, OnDense, Scene};
use super::setting::Setting;
use super::sizing::{Fitted, in_setting, sized};

/// Number of effects in the records of a name.
pub const SEVERAL: [(&str, usize); 2] = [("two", 2), ("three", 3)];

/// Records with an unlisted effect in addition to a listed one.
pub const MIXED: &str = "mixed";

/// Definitions that can be combined, in the order of the chain from motion to record. Excluded: those that stop
/// the motion (sticking) or replace the whole signal (a complex stiffness).
const TOGETHER: &[(&str, &str)] = &[
    ("second-mode", "coupled"),
    ("second-mode", "modal"),
    ("structural-damping", "ladder"),
    ("cubic-stiffness", "hardening"),
    ("cubic-stiffness", "softening"),
    ("quadratic-stiffness", "angle"),
    ("coulomb-friction", "smooth"),
    ("backlash", "gap"),
    ("backlash", "soft gap"),
    ("bouc-wen-hysteresis", "exponent 1"),
    ("bouc-wen-hysteresis", "other exponent"),
    ("quadratic-damping", "drag"),
    ("gage-nonlinearity", "quadratic"),
    ("gage-nonlinearity", "cubic"),
    ("gain-error", "gain"),
    ("recorder-lowpass", "first order"),
    ("time-delay", "delay"),
    ("saturation", "clip"),
    ("capacitive-coupling", "derivative"),
    ("mains-pickup", "one line"),
    ("thermal-drift", "linear"),
    ("rotor-imbalance", "once"),
];
/// Effects that no record distinguishes if both are small, or whose order in the chain matters and is not
/// preserved.
const APART: [[&str; 2]; 2] = [
    ["recorder-lowpass", "time-delay"],
    ["saturation", "capacitive-coupling"],
];
/// Minimum strength of an effect relative to the largest in the record.
const WEAKEST: f64 = 0.2;
/// Strength of an effect relative to the target.
const COMPARABLE: [f64; 2] = [0.6, 1.7];

/// Random definitions of different effects, in the order of the chain.
pub fn drawn(effect: &str, seed: u64) -> Option<Vec<&'static Variant>> {
    if effect == MIXED {
        return Some(mixed(&mut Draw::new(seed, "unlisted beside listed")));
    }
    let (_, count) = SEVERAL.iter().find(|(name, _)| *name == effect)?;
    let mut draw = Draw::new(seed, "effects together");
    let indices: Vec<usize> = (0..TOGETHER.len()).collect();
    let mut chosen: Vec<usize> = Vec::new();
    while chosen.len() < *count {
        let next = draw.one_of(&indices);
        let name = TOGETHER[next].0;
        let goes = |other: &usize| {
            let pair = [TOGETHER[*other].0, name];
            let is_apart = |apart: &[&str; 2]| pair == *apart || pair == [apart[1], apart[0]];
            pair[0] != name && !APART.iter().any(is_apart)
        };
        if chosen.iter().all(goes) {
            chosen.push(next);
        }
    }
    chosen.sort_unstable();
    let found = chosen.iter().map(|k| {
        let (effect, name) = TOGETHER[*k];
        CATALOGUE
            .iter()
            .find(|v| v.effect == effect && v.name == name)
    });
    found.collect()
}

/// A listed and an unlisted one, whose laws can be added.
fn mixed(draw: &mut Draw) -> Vec<&'static Variant> {
    let unlisted: Vec<&Variant> = CATALOGUE
        .iter()
        .filter(|variant| variant.effect == "unlisted")
        .collect();
    let (effect, name) = draw.one_of(TOGETHER);
    let stranger = draw.one_of(&unlisted);
    let listed = CATALOGUE
        .iter()
        .find(|v| v.effect == effect && v.name == name);
    listed.into_iter().chain([stranger]).collect()
}

/// Each effect alone, with the size for about the wanted strength.
pub fn parts(
    setting: &Setting,
    scene: &Scene,
    variants: &[&'static Variant],
    seed: u64,
) -> Vec<Fitted> {
    let mut draw = Draw::new(seed, "strengths");
    let parts = variants.iter().enumerate().map(|(k, variant)| {
        let factor = match variants.len() {
            1 => 1.0,
            _ => draw.log_between(COMPARABLE[0], COMPARABLE[1]),
        };
        let target = factor * setting.target;
        sized(setting, scene, variant, target, seed + k as u64)
    });
    parts.collect()
}

/// Whether no effect is so much weaker than another that it is negligible: some are bounded by physical limits.
pub fn are_comparable(parts: &[Fitted]) -> bool {
    let strengths = parts.iter().map(|part| part.strength);
    let largest = strengths.clone().fold(0.0, f64::max);
    strengths.fold(f64::INFINITY, f64::min) >= WEAKEST * largest
}

/// All effects in one stand; a single one is unchanged.
pub fn together(
    setting: &Setting,
    variants: &[&'static Variant],
    mut parts: Vec<Fitted>,
    seed: u64,
) -> Fitted {
    if parts.len() == 1 {
        return parts.remove(0);
    }
    let parts = parts.into_iter().map(|part| part.built);
    let built = joined(setting.constants, variants, parts);
    let signal = in_setting(setting, &built, 0, seed);
    let start = PlainConstants {
        omega: setting.constants.omega(),
        damping_ratio: setting.constants.damping_ratio(),
    };
    let (plain, left) = match signal.iter().all(|value| value.is_finite()) {
        true => fit(start, setting.recorded(0), &signal),
        false => (start, f64::INFINITY),
    };
    let strength = setting.strength(left, &signal);
    Fitted {
        size: f64::NAN,
        built,
        signal,
        plain,
        strength,
    }
}

/// One stand with all effects: contributions to the motion are added, operations on the signal follow in order.
pub fn joined(
    constants: Constants,
    variants: &[&Variant],
    parts: impl IntoIterator<Item = Built>,
) -> Built {
    let mut motions = Vec::new();
    let (mut on_dense, mut on_samples) = (Vec::new(), Vec::new());
    let mut parameters = Vec::new();
    for (variant, part) in variants.iter().zip(parts) {
        let Built {
            dynamics,
            on_dense: dense,
            on_samples: samples,
            parameters: own,
        } = part;
        match (variant.effect, own.first()) {
            // A filter applies to the motion with all other effects, not to that of the plain
            // stand.
            ("recorder-lowpass", Some((_, corner_hz))) => on_dense.push(low_pass(*corner_hz)),
            _ => motions.push(dynamics),
        }
        on_dense.extend(dense);
        on_samples.extend(samples);
        parameters.extend(own);
    }
    Built {
        dynamics: Box::new(Together { constants, motions }),
        on_dense: Some(Box::new(move |dense| {
            on_dense.iter().fold(dense, |dense, change| change(dense))
        })),
        on_samples: Some(Box::new(move |place, samples| {
            on_samples.iter().for_each(|change| change(place, samples));
        })),
        parameters,
    }
}

/// `y' = w (u − y)`, exact for linear interpolation between the points of the dense grid.
fn low_pass(corner_hz: f64) -> OnDense {
    Box::new(move |mut dense: Dense| {
        let step = std::f64::consts::TAU * corner_hz * dense.step_s;
        let keep = (-step).exp();
        let mean = (1.0 - keep) / step;
        let (mut passed, mut before) = (dense.values[0], dense.values[0]);
        for value in &mut dense.values {
            let now = *value;
            passed = keep * passed + (mean - keep) * before + (1.0 - mean) * now;
            (before, *value) = (now, passed);
        }
        dense
    })
}

/// Motions that each add a term to that of the plain stand; at most one of them switches.
struct Together {
    constants: Constants,
    motions: Vec<Box<dyn Dynamics>>,
}

impl Together {
    /// Each motion with the state that it sees, and the index of its own states.
    fn each<'a>(
        &'a self,
        state: &'a State,
    ) -> impl Iterator<Item = (&'a dyn Dynamics, State, usize)> {
        let mut next = 2;
        self.motions.iter().map(move |motion| {
            let (first, own) = (next, motion.states() - 2);
            next += own;
            let mut seen = [0.0; STATES];
            seen[..2].copy_from_slice(&state[..2]);
            seen[2..2 + own].copy_from_slice(&state[first..first + own]);
            (motion.as_ref(), seen, first)
        })
    }
}

impl Dynamics for Together {
    fn states(&self) -> usize {
        let own: usize = self.motions.iter().map(|motion| motion.states() - 2).sum();
        2 + own
    }

    fn rates(&self, mode: i8, time_s: f64, torque: f64, state: &State, rates: &mut State) {
        let plain = self.constants.acceleration(torque, state);
        rates[0] = state[1];
        rates[1] = plain;
        for (motion, seen, first) in self.each(state) {
            let mut own = [0.0; STATES];
            motion.rates(mode, time_s, torque, &seen, &mut own);
            rates[1] += own[1] - plain;
            let count = motion.states() - 2;
            rates[first..first + count].copy_from_slice(&own[2..2 + count]);
        }
    }

    fn shown(&self, mode: i8, time_s: f64, torque: f64, state: &State) -> f64 {
        let plain = self.constants.stiffness_n_m * state[0];
        let added = self
            .each(state)
            .map(|(motion, seen, _)| motion.shown(mode, time_s, torque, &seen) - plain);
        plain + added.sum::<f64>()
    }

    fn guard(&self, mode: i8, torque: f64, state: &State) -> f64 {
        let guards = self
            .each(state)
            .map(|(motion, seen, _)| motion.guard(mode, torque, &seen));
        guards.fold(1.0, f64::min)
    }

    fn next_mode(&self, mode: i8, torque: f64, state: &mut State) -> i8 {
        let before = *state;
        self.each(&before)
            .fold(mode, |mode, (motion, mut seen, _)| {
                motion.next_mode(mode, torque, &mut seen)
            })
    }
}
