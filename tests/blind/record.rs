//! One case: two records of a stand with an undeclared effect, and the truth about them.

use serde_json::Value;

use super::catalogue::{Variant, variant_of};
use super::draw::Draw;
use super::plain_fit::{PlainConstants, left_by, rms};
use super::plant::Constants;
use super::setting::{Asked, Setting, setting};
use super::sizing::{Fitted, in_setting, scene};
use super::span::Span;
use super::truth::truth;
use super::{several, wide};

/// A record: applied and measured torque.
pub struct Record {
    pub applied_n_m: Vec<f64>,
    pub measured_n_m: Vec<f64>,
    pub span: Span,
}

/// Two records and the truth.
pub struct Case {
    pub number: usize,
    pub train: Record,
    pub holdout: Record,
    /// The best plain fit.
    pub plain: PlainConstants,
    pub truth: Value,
    /// The declared constants, if not those of the thesis.
    pub declared: Option<Constants>,
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

/// Makes a case; `None` if the effect is in no list.
///
/// If the held-out record would hardly show the effect (a clip that its level never reaches), the case is
/// drawn again with both records at one level.
pub fn make(master: u64, effect: &str, number: usize) -> Option<Case> {
    make_as(&Asked::default(), master, effect, number)
}

/// Makes a case to specification.
pub fn make_as(asked: &Asked, master: u64, effect: &str, number: usize) -> Option<Case> {
    let attempts = if asked.wide { 12 } else { 4 };
    let mut case = attempt(asked, master, effect, number, 0)?;
    for again in 1..attempts {
        if case.1 {
            break;
        }
        case = attempt(asked, master, effect, number, again)?;
    }
    Some(case.0)
}

/// Compatible seed, definitions and setting.
fn drawn(
    asked: &Asked,
    master: u64,
    effect: &str,
    number: usize,
    again: u64,
) -> Option<(u64, Vec<&'static Variant>, Setting)> {
    for redrawn in 0.. {
        let seed = seed_of(master, effect, number, again + (redrawn << 8));
        let variants: Vec<&'static Variant> = match variant_of(effect, number) {
            Some(variant) => vec![variant],
            None => several::drawn(effect, seed)?,
        };
        let alike = again > 0;
        let mut setting = match asked.wide {
            true => wide::setting(seed, number, alike, wide::takes_plateaus(&variants)),
            false => setting(seed, number, alike),
        };
        if let Some((least, most)) = asked.strength {
            setting.target = Draw::new(seed, "strength").log_between(least, most);
        }
        if !asked.wide || wide::suits(&setting, &variants) {
            return Some((seed, variants, setting));
        }
    }
    None
}

/// A case, and whether its held-out record shows each effect, too.
fn attempt(
    asked: &Asked,
    master: u64,
    effect: &str,
    number: usize,
    again: u64,
) -> Option<(Case, bool)> {
    let (seed, variants, setting) = drawn(asked, master, effect, number, again)?;
    let scene = scene(&setting);
    let parts = several::parts(&setting, &scene, &variants, seed);
    let shows = effect == "none"
        || several::are_comparable(&parts)
            && parts.iter().all(|part| {
                shows(&setting, part, seed) && (!asked.wide || part.strength > 0.5 * setting.target)
            });
    let sized = several::together(&setting, &variants, parts, seed);
    let held = in_setting(&setting, &sized.built, 1, seed);
    let held_left = left_by(sized.plain, setting.recorded(1), &held);
    let mut noise_rms = [setting.noise.share * rms(&sized.signal); 2];
    if !setting.noise.absolute {
        noise_rms[1] = setting.noise.share * rms(&held);
    }
    let held_strength = held_left / setting.whole_noise(1, noise_rms[1]);
    let mut records = [sized.signal.clone(), held];
    for (index, record) in records.iter_mut().enumerate() {
        let mut draw = Draw::new(seed, ["noise of train", "noise of holdout"][index]);
        let measured = setting.noise.add(record, noise_rms[index], &mut draw);
        noise_rms[index] = setting.whole_noise(index, measured);
    }
    let truth = truth(
        effect,
        &variants,
        number,
        seed,
        &setting,
        &sized,
        (held_left, noise_rms),
    );
    let [train, holdout] = records;
    let record = |index: usize, measured_n_m: Vec<f64>| Record {
        applied_n_m: applied(&setting, index),
        measured_n_m,
        span: setting.span,
    };
    let case = Case {
        number,
        train: record(0, train),
        holdout: record(1, holdout),
        plain: sized.plain,
        truth,
        declared: setting.declared,
    };
    Some((case, shows && held_strength.is_finite()))
}

/// The applied torque as recorded.
fn applied(setting: &Setting, index: usize) -> Vec<f64> {
    let mut samples = setting.recorded(index).samples();
    if let Some(noise) = &setting.applied_noise {
        let pairs = samples.iter_mut().zip(&noise.samples[index]);
        pairs.for_each(|(sample, noise)| *sample += noise);
    }
    samples
}

/// Whether the held-out input shows an effect alone about as well as the training input does.
fn shows(setting: &Setting, part: &Fitted, seed: u64) -> bool {
    let held = in_setting(setting, &part.built, 1, seed);
    let left = left_by(part.plain, setting.recorded(1), &held);
    let size = match setting.noise.absolute {
        true => rms(&part.signal),
        false => rms(&held),
    };
    let strength = left / setting.whole_noise(1, setting.noise.share * size);
    strength > 0.4 * part.strength.max(0.5) || strength > 3.0
}
