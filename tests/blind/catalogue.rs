//! Every variant of every effect: definitions used in literature and practice.

use super::draw::Draw;
use super::plant::{Built, Plain, Scene};
use super::{chain, disturbance, friction, linear, restoring, unlisted};

/// One definition of an effect.
pub struct Variant {
    /// Name in the contract, `none`, or `unlisted`.
    pub effect: &'static str,
    pub name: &'static str,
    /// Relative frequency of this definition among the records of the effect.
    pub share: u32,
    /// Builds a stand with it; the size is a positive dimensionless number.
    pub build: fn(&Scene, f64, &mut Draw) -> Built,
    /// The smallest meaningful size (a low-pass far above the band is a delay, a clip that nothing
    /// reaches is no effect), a start value, and the largest physical one.
    pub sizes: (f64, f64, f64),
}

const fn variant(
    effect: &'static str,
    name: &'static str,
    share: u32,
    build: fn(&Scene, f64, &mut Draw) -> Built,
    sizes: (f64, f64, f64),
) -> Variant {
    Variant {
        effect,
        name,
        share,
        build,
        sizes,
    }
}

fn nothing(scene: &Scene, _: f64, _: &mut Draw) -> Built {
    Built::dynamics(Plain(scene.constants), &[])
}

/// All variants.
pub const CATALOGUE: &[Variant] = &[
    variant("none", "plain", 1, nothing, (1.0, 1.0, 1.0)),
    variant(
        "second-mode",
        "coupled",
        2,
        linear::second_mode_coupled,
        (0.0, 0.01, 0.5),
    ),
    variant(
        "second-mode",
        "modal",
        1,
        linear::second_mode_modal,
        (0.0, 0.005, 0.3),
    ),
    variant(
        "second-mode",
        "added",
        1,
        linear::second_mode_added,
        (0.0, 0.005, 0.3),
    ),
    variant(
        "structural-damping",
        "complex",
        3,
        linear::structural_complex,
        (0.0, 0.01, 0.3),
    ),
    variant(
        "structural-damping",
        "ladder",
        1,
        linear::structural_ladder,
        (0.0, 0.01, 0.3),
    ),
    variant(
        "recorder-lowpass",
        "first order",
        2,
        linear::low_pass_1,
        (0.08, 0.05, 2.0),
    ),
    variant(
        "recorder-lowpass",
        "second order",
        2,
        linear::low_pass_2,
        (0.08, 0.1, 1.0),
    ),
    variant(
        "recorder-lowpass",
        "two in a row",
        1,
        linear::low_pass_twice,
        (0.06, 0.05, 1.0),
    ),
    variant("time-delay", "delay", 1, linear::delay, (0.1, 0.3, 20.0)),
    variant(
        "capacitive-coupling",
        "derivative",
        3,
        linear::feedthrough,
        (0.0, 0.01, 0.4),
    ),
    variant(
        "capacitive-coupling",
        "through RC",
        1,
        linear::feedthrough_rc,
        (0.0, 0.01, 0.5),
    ),
    variant(
        "capacitive-coupling",
        "AC coupling",
        1,
        linear::ac_coupling,
        (0.02, 0.05, 2.0),
    ),
    variant("gain-error", "gain", 1, chain::gain, (0.0, 0.01, 0.25)),
    variant(
        "mains-pickup",
        "one line",
        1,
        disturbance::mains,
        (0.0, 0.01, 0.5),
    ),
    variant(
        "mains-pickup",
        "harmonics",
        1,
        disturbance::mains_harmonics,
        (0.0, 0.01, 0.5),
    ),
    variant(
        "thermal-drift",
        "linear",
        3,
        disturbance::drift_linear,
        (0.0, 0.01, 2.0),
    ),
    variant(
        "thermal-drift",
        "exponential",
        2,
        disturbance::drift_exponential,
        (0.0, 0.01, 2.0),
    ),
    variant(
        "thermal-drift",
        "random",
        1,
        disturbance::drift_random,
        (0.0, 0.01, 2.0),
    ),
    variant(
        "rotor-imbalance",
        "once",
        1,
        disturbance::rotor,
        (0.0, 0.01, 0.5),
    ),
    variant(
        "rotor-imbalance",
        "once and twice",
        1,
        disturbance::rotor_twice,
        (0.0, 0.01, 0.5),
    ),
    variant(
        "commutation-spikes",
        "decaying",
        2,
        disturbance::decaying_spikes,
        (0.0, 0.01, 3.0),
    ),
    variant(
        "commutation-spikes",
        "one sample",
        1,
        disturbance::short_spikes,
        (0.0, 0.01, 3.0),
    ),
    variant(
        "cubic-stiffness",
        "hardening",
        3,
        restoring::cubic_hardening,
        (0.0, 0.02, 0.6),
    ),
    variant(
        "cubic-stiffness",
        "softening",
        1,
        restoring::cubic_softening,
        (0.0, 0.02, 0.2),
    ),
    variant(
        "cubic-stiffness",
        "in gage",
        1,
        restoring::cubic_in_gage,
        (0.0, 0.02, 0.6),
    ),
    variant(
        "quadratic-stiffness",
        "angle",
        4,
        restoring::quadratic,
        (0.0, 0.02, 0.3),
    ),
    variant(
        "quadratic-stiffness",
        "in gage",
        1,
        restoring::quadratic_in_gage,
        (0.0, 0.02, 0.3),
    ),
    variant(
        "coulomb-friction",
        "sticking",
        3,
        friction::coulomb,
        (0.0, 0.005, 0.4),
    ),
    variant(
        "coulomb-friction",
        "smooth",
        2,
        friction::coulomb_smooth,
        (0.0, 0.005, 0.4),
    ),
    variant("backlash", "gap", 2, restoring::gap, (0.0, 0.001, 0.3)),
    variant(
        "backlash",
        "soft gap",
        1,
        restoring::soft_gap,
        (0.0, 0.003, 0.4),
    ),
    variant("backlash", "play", 2, chain::play, (0.0, 0.005, 0.4)),
    variant(
        "bouc-wen-hysteresis",
        "exponent 1",
        2,
        restoring::bouc_wen_1,
        (0.0, 0.03, 0.8),
    ),
    variant(
        "bouc-wen-hysteresis",
        "other exponent",
        2,
        restoring::bouc_wen_n,
        (0.0, 0.03, 0.8),
    ),
    variant(
        "bouc-wen-hysteresis",
        "in gage",
        1,
        restoring::bouc_wen_in_gage,
        (0.0, 0.03, 0.6),
    ),
    variant(
        "quadratic-damping",
        "drag",
        1,
        friction::quadratic,
        (0.0, 0.02, 2.0),
    ),
    variant(
        "gage-nonlinearity",
        "quadratic",
        2,
        chain::gage_quadratic,
        (0.0, 0.01, 0.3),
    ),
    variant(
        "gage-nonlinearity",
        "cubic",
        2,
        chain::gage_cubic,
        (0.0, 0.01, 0.3),
    ),
    variant(
        "gage-nonlinearity",
        "bridge",
        1,
        chain::gage_bridge,
        (0.0, 0.01, 0.3),
    ),
    variant("saturation", "clip", 3, chain::clip, (0.03, 0.1, 0.7)),
    variant(
        "saturation",
        "uneven clip",
        1,
        chain::clip_uneven,
        (0.03, 0.1, 0.7),
    ),
    variant(
        "saturation",
        "knee",
        1,
        chain::saturate_knee,
        (0.3, 0.5, 2.0),
    ),
    variant(
        "saturation",
        "soft",
        1,
        chain::saturate_soft,
        (0.1, 0.2, 2.0),
    ),
    variant("end-stop", "both", 2, restoring::end_stop, (0.02, 0.1, 0.6)),
    variant(
        "end-stop",
        "one-sided",
        2,
        restoring::one_sided_stop,
        (0.02, 0.1, 0.6),
    ),
    variant(
        "stribeck-friction",
        "sticking",
        1,
        friction::stribeck,
        (0.0, 0.005, 0.3),
    ),
    variant(
        "position-dependent-friction",
        "spot",
        1,
        friction::spot,
        (0.0, 0.01, 0.5),
    ),
    variant(
        "position-dependent-friction",
        "wedge",
        1,
        friction::wedge,
        (0.0, 0.01, 0.5),
    ),
    variant("gage-creep", "lag", 1, linear::creep, (0.0, 0.01, 0.3)),
    variant(
        "unlisted",
        "quintic stiffness",
        1,
        restoring::quintic,
        (0.0, 0.02, 0.2),
    ),
    variant(
        "unlisted",
        "cubic damping",
        1,
        friction::cubic,
        (0.0, 0.01, 0.5),
    ),
    variant(
        "unlisted",
        "rubbing resonance",
        1,
        linear::rubbing_resonance,
        (0.0, 0.02, 0.4),
    ),
    variant(
        "unlisted",
        "softening in time",
        1,
        unlisted::softening_in_time,
        (0.0, 0.01, 0.3),
    ),
    variant(
        "unlisted",
        "swinging stiffness",
        1,
        unlisted::swinging_stiffness,
        (0.0, 0.005, 0.2),
    ),
    variant(
        "unlisted",
        "dead zone of the drive",
        1,
        unlisted::dead_zone,
        (0.0, 0.01, 0.4),
    ),
    variant("unlisted", "spikes", 1, unlisted::spikes, (0.0, 0.01, 3.0)),
    variant(
        "unlisted",
        "dropouts",
        1,
        unlisted::dropouts,
        (0.0, 0.003, 0.06),
    ),
    variant(
        "unlisted",
        "trembling gain",
        1,
        unlisted::trembling_gain,
        (0.0, 0.001, 0.1),
    ),
    variant(
        "unlisted",
        "multiplicative noise",
        1,
        unlisted::multiplicative_noise,
        (0.0, 0.001, 0.1),
    ),
    variant(
        "unlisted",
        "fading gain",
        1,
        unlisted::fading_gain,
        (0.0, 0.01, 0.3),
    ),
    variant(
        "unlisted",
        "zero in steps",
        1,
        unlisted::zero_steps,
        (0.0, 0.01, 0.5),
    ),
    variant(
        "unlisted",
        "clock drift",
        1,
        linear::clock_drift,
        (0.2, 0.3, 20.0),
    ),
];

/// Names of all effects, without duplicates, in the order of the catalogue.
pub fn effects() -> Vec<&'static str> {
    let mut names: Vec<&str> = CATALOGUE.iter().map(|variant| variant.effect).collect();
    names.dedup();
    names
}

/// The definition for the record of a number: cyclic, in proportion to the shares.
pub fn variant_of(effect: &str, number: usize) -> Option<&'static Variant> {
    let turn: Vec<&Variant> = CATALOGUE
        .iter()
        .filter(|variant| variant.effect == effect)
        .flat_map(|variant| std::iter::repeat_n(variant, variant.share as usize))
        .collect();
    (!turn.is_empty()).then(|| turn[number % turn.len()])
}
