//! One case: two records of a stand with an undeclared effect, and the truth about them.

use serde_json::Value;

use super::catalogue::{Variant, variant_of};
use super::draw::Draw;
use super::plain_fit::{PlainConstants, left_by, rms};
use super::setting::{Setting, setting};
use super::several;
use super::sizing::{Fitted, noise_free, scene};
use super::truth::truth;

/// A record: what was applied and what was measured.
pub struct Record {
    pub applied_n_m: Vec<f64>,
    pub measured_n_m: Vec<f64>,
}

/// Two records and the truth.
pub struct Case {
    pub number: usize,
    pub train: Record,
    pub holdout: Record,
    /// The best plain fit.
    pub plain: PlainConstants,
    pub truth: Value,
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
    let mut case = attempt(master, effect, number, 0)?;
    for again in 1..4 {
        if case.1 {
            break;
        }
        case = attempt(master, effect, number, again)?;
    }
    Some(case.0)
}

/// A case, and whether its held-out record shows each effect, too.
fn attempt(master: u64, effect: &str, number: usize, again: u64) -> Option<(Case, bool)> {
    let seed = seed_of(master, effect, number, again);
    let variants: Vec<&'static Variant> = match variant_of(effect, number) {
        Some(variant) => vec![variant],
        None => several::drawn(effect, seed)?,
    };
    let setting = setting(seed, number, again > 0);
    let scene = scene(&setting);
    let parts = several::parts(&setting, &scene, &variants, seed);
    let shows = effect == "none"
        || several::are_comparable(&parts) && parts.iter().all(|part| shows(&setting, part, seed));
    let sized = several::together(&setting, &variants, parts, seed);
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
        applied_n_m: setting.inputs[index].samples(),
        measured_n_m,
    };
    let case = Case {
        number,
        train: record(0, train),
        holdout: record(1, holdout),
        plain: sized.plain,
        truth,
    };
    Some((case, shows && held_strength.is_finite()))
}

/// Whether the held-out input shows an effect, alone, about as well as the training input does.
fn shows(setting: &Setting, part: &Fitted, seed: u64) -> bool {
    let held = noise_free(&part.built, &setting.inputs[1], 1, seed);
    let left = left_by(part.plain, &setting.inputs[1], &held);
    let size = match setting.noise.absolute {
        true => rms(&part.signal),
        false => rms(&held),
    };
    let strength = left / (setting.noise.share * size);
    strength > 0.4 * part.strength.max(0.5) || strength > 3.0
}
