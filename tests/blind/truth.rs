//! The truth about a case, written next to the records.

use serde_json::{Value, json};

use super::catalogue::Variant;
use super::excitation::Excitation;
use super::plain_fit::rms;
use super::setting::Setting;
use super::sizing::Fitted;

/// Effect, size, strength, noise, constants and records; `held_left` is the residual of the plain fit to
/// the held-out signal.
pub fn truth(
    effect: &str,
    variants: &[&Variant],
    number: usize,
    seed: u64,
    setting: &Setting,
    sized: &Fitted,
    (held_left, noise_rms): (f64, [f64; 2]),
) -> Value {
    let span = &setting.span;
    let parameters: serde_json::Map<String, Value> = sized
        .built
        .parameters
        .iter()
        .map(|(name, value)| ((*name).to_owned(), json!(span.written(name, *value))))
        .collect();
    let names = variants.iter().map(|v| v.effect);
    let names: Vec<&str> = names
        .filter(|name| !["none", "unlisted"].contains(name))
        .collect();
    let hz = |omega: f64| span.written_hz(omega / std::f64::consts::TAU);
    let constants = setting.constants.written(span);
    let mut truth = json!({
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
            "natural_frequency_hz": hz(sized.plain.omega),
            "damping_ratio": sized.plain.damping_ratio,
            "holdout_rms_with_noise_n_m": held_left.hypot(noise_rms[1]),
        },
        "true_constants": {
            "inertia_kg_m2": constants.inertia_kg_m2,
            "damping_n_m_s_per_rad": constants.damping_n_m_s,
            "stiffness_n_m_per_rad": constants.stiffness_n_m,
            "natural_frequency_hz": hz(setting.constants.omega()),
            "damping_ratio": setting.constants.damping_ratio(),
        },
        "records": {
            "rate_hz": span.written_rate_hz(),
            "train": setting.excitations[0].describe(span),
            "holdout": setting.excitations[1].describe(span),
            "train_rms_n_m": rms(&sized.signal),
            "top_hz": span.written_hz(setting.excitations.iter().map(Excitation::top_hz).fold(0.0, f64::max)),
        },
    });
    if setting.declared.is_some() {
        truth["wide"] = wide(setting);
    }
    truth
}

/// Entries of records of stands other than that of the thesis.
fn wide(setting: &Setting) -> Value {
    let span = &setting.span;
    let noise = setting.applied_noise.as_ref();
    json!({
        "samples": span.samples,
        "periods": span.length_s() * setting.constants.omega() / std::f64::consts::TAU,
        "train": setting.excitations[0].kind(),
        "holdout": setting.excitations[1].kind(),
        "filter": setting.filter.map(|filter| json!({
            "order": filter.order,
            "corner_hz": span.written_hz(filter.corner_hz),
        })),
        "applied_noise": noise.map(|noise| json!({
            "share_of_rms": noise.share_of_rms,
            "through_the_stand_n_m": noise.through_n_m,
        })),
    })
}

/// The definitions of a case.
fn described(variants: &[&Variant]) -> String {
    match variants {
        [one] => one.name.to_owned(),
        several => {
            let each = several.iter().map(|v| format!("{} ({})", v.effect, v.name));
            each.collect::<Vec<_>>().join(" + ")
        }
    }
}
