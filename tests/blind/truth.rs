//! The truth about a case, as it is written beside the records.

use serde_json::{Value, json};

use super::catalogue::Variant;
use super::excitation::{Excitation, RATE_HZ};
use super::plain_fit::rms;
use super::setting::Setting;
use super::sizing::Fitted;

/// Effect, size, strength, noise, constants and records; `held_left` is what the plain fit leaves of the
/// held-out signal.
pub fn truth(
    effect: &str,
    variants: &[&Variant],
    number: usize,
    seed: u64,
    setting: &Setting,
    sized: &Fitted,
    (held_left, noise_rms): (f64, [f64; 2]),
) -> Value {
    let parameters: serde_json::Map<String, Value> = sized
        .built
        .parameters
        .iter()
        .map(|(name, value)| ((*name).to_owned(), json!(value)))
        .collect();
    let names = variants.iter().map(|v| v.effect);
    let names: Vec<&str> = names
        .filter(|name| !["none", "unlisted"].contains(name))
        .collect();
    let per_hz = std::f64::consts::TAU;
    json!({
        "effect": effect,
        "variant": described(variants),
        "effects": names,
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

/// The definitions that a case was made with.
fn described(variants: &[&Variant]) -> String {
    match variants {
        [one] => one.name.to_owned(),
        several => {
            let each = several.iter().map(|v| format!("{} ({})", v.effect, v.name));
            each.collect::<Vec<_>>().join(" + ")
        }
    }
}
