//! The stand file with the truth of a case: the true constants and the effect with its true parameters.

use serde_json::Value;

/// An effect in the stand file.
struct Effect {
    form: &'static str,
    lines: Vec<(&'static str, f64, &'static str)>,
    stiffness_n_m: f64,
    /// Displacement under a constant load, in N m.
    shift_n_m: f64,
}

/// A stand file with the truth; `None` if the law of the case has no form.
pub fn stand(truth: &Value) -> Option<String> {
    let constant = |key: &str| truth["true_constants"][key].as_f64();
    let inertia = constant("inertia_kg_m2")?;
    let damping = constant("damping_n_m_s_per_rad")?;
    let effect = effect(truth, constant("stiffness_n_m_per_rad")?)?;
    let mut text = format!(
        "schema = \"torqcomp.stand/1\"\nname = \"the truth\"\n\n[mechanics]\n\
         inertia = \"{inertia:.15e} kg m^2\"\ndamping = \"{damping:.15e} N m s/rad\"\n\
         stiffness = \"{:.15e} N m/rad\"\n\n[calibration]\ntorque_per_volt = \"1.23e3 ft lbf/V\"\n\n",
        effect.stiffness_n_m
    );
    if truth["effect"] != "none" {
        let kind = truth["effect"].as_str()?;
        text += &format!(
            "[[effects]]\nkind = \"{kind}\"\nform = \"{}\"\n",
            effect.form
        );
        for (name, value, unit) in &effect.lines {
            text += &format!("{name} = \"{}\"\n", format!("{value:.15e} {unit}").trim());
        }
    }
    if effect.shift_n_m != 0.0 {
        text += &format!(
            "\n[diagnosed]\nverdict = \"explained\"\nmeasured_unit = \"N m\"\noffset = \"0 N m\"\n\
             shift = \"{:.15e} N m\"\n",
            effect.shift_n_m
        );
    }
    Some(text)
}

fn effect(truth: &Value, stiffness: f64) -> Option<Effect> {
    let parameters = &truth["parameters"];
    let p = |key: &str| parameters[key].as_f64();
    let made = |form, lines: &[(&'static str, f64, &'static str)]| {
        Some(Effect {
            form,
            lines: lines.to_vec(),
            stiffness_n_m: stiffness,
            shift_n_m: 0.0,
        })
    };
    match (truth["effect"].as_str()?, truth["variant"].as_str()?) {
        ("none", _) => made("", &[]),
        ("second-mode", variant) => {
            let shared = [
                ("frequency", p("frequency_hz")?, "Hz"),
                ("damping_ratio", p("damping_ratio")?, ""),
            ];
            let (form, last) = match variant {
                "coupled" => ("coupled", ("inertia_ratio", p("inertia_ratio")?, "")),
                "modal" => ("shared", ("share", p("share")?, "")),
                _ => ("added", ("share", p("share")?, "")),
            };
            made(form, &[shared[0], shared[1], last])
        }
        ("structural-damping", "complex") => {
            made("loss-factor", &[("loss_factor", p("loss_factor")?, "")])
        }
        ("recorder-lowpass", variant) => {
            let corner = ("cutoff", p("corner_hz")?, "Hz");
            match variant {
                "first order" => made("order-1", &[corner]),
                "second order" => made("order-2", &[corner]),
                _ => made("second-order", &[corner, ("damping_ratio", 1.0, "")]),
            }
        }
        ("time-delay", _) => made("lag", &[("delay", p("delay_s")?, "s")]),
        ("capacitive-coupling", "derivative") => {
            made("slope-of-load", &[("time", p("seconds")?, "s")])
        }
        ("capacitive-coupling", "through RC") => made(
            "high-pass-leak",
            &[
                ("share", p("share")?, ""),
                ("corner", p("corner_hz")?, "Hz"),
            ],
        ),
        ("capacitive-coupling", _) => made("ac-coupled", &[("corner", p("corner_hz")?, "Hz")]),
        ("gain-error", _) => made("factor", &[("error", p("gain")? - 1.0, "")]),
        ("mains-pickup", _) => {
            let (base, size) = (p("frequency_hz")?, p("amplitude_n_m")?);
            let form = if base > 55.0 {
                "60-Hz-orders"
            } else {
                "50-Hz-orders"
            };
            made(
                form,
                &[
                    ("frequency", base, "Hz"),
                    ("amplitude", size, "N m"),
                    ("amplitude_2", size * p("second")?, "N m"),
                    ("amplitude_3", size * p("third")?, "N m"),
                    ("amplitude_5", size * p("fifth")?, "N m"),
                ],
            )
        }
        ("thermal-drift", "linear") => made("linear", &[("slope", p("n_m_per_s")?, "N m/s")]),
        ("thermal-drift", "exponential") => made(
            "exponential",
            &[
                ("drift", p("range_n_m")?, "N m"),
                ("time_constant", p("time_constant_s")?, "s"),
            ],
        ),
        ("thermal-drift", _) => made("course", &[]),
        ("commutation-spikes", _) => made(
            "train",
            &[
                ("frequency", p("frequency_hz")?, "Hz"),
                ("amplitude", p("amplitude_n_m")?, "N m"),
            ],
        ),
        ("rotor-imbalance", _) => rotor(truth).and_then(|lines| made("twice", &lines)),
        ("cubic-stiffness", variant) => {
            let coefficient = p("n_m_per_rad_to_the_power")? / stiffness.powi(3);
            let form = if variant == "in gage" {
                "shown"
            } else {
                "beside"
            };
            made(form, &[("coefficient", coefficient, "1/(N m)^2")])
        }
        ("quadratic-stiffness", variant) => {
            let coefficient = p("n_m_per_rad_to_the_power")? / stiffness.powi(2);
            let form = if variant == "in gage" {
                "even-shown"
            } else {
                "even"
            };
            made(form, &[("coefficient", coefficient, "1/(N m)")])
        }
        ("coulomb-friction", "sticking") => made("sharp", &[("torque", p("friction_n_m")?, "N m")]),
        ("coulomb-friction", _) => made(
            "tanh",
            &[
                ("torque", p("friction_n_m")?, "N m"),
                (
                    "transition_speed",
                    p("over_speed_rad_s")? * stiffness,
                    "N m/s",
                ),
            ],
        ),
        ("backlash", "play") => made("recorded", &[("gap", p("half_width_n_m")?, "N m")]),
        ("backlash", _) => gap(&p, stiffness),
        ("bouc-wen-hysteresis", variant) => hysteresis(&p, stiffness, variant == "in gage"),
        ("quadratic-damping", _) => {
            let coefficient = p("coefficient_n_m_s2")? / stiffness.powi(2);
            made("drag", &[("coefficient", coefficient, "s^2/(N m)")])
        }
        ("gage-nonlinearity", "quadratic") => {
            made("square", &[("square", p("per_n_m")?, "1/(N m)")])
        }
        ("gage-nonlinearity", "cubic") => made("cube", &[("cube", p("per_n_m2")?, "1/(N m)^2")]),
        ("saturation", variant) => {
            let limit = ("limit", p("limit_n_m").or(p("high_n_m"))?, "N m");
            match variant {
                "clip" => made("hard", &[limit]),
                "uneven clip" => made("uneven", &[limit, ("lower_limit", p("low_n_m")?, "N m")]),
                "knee" => made("knee", &[limit, ("sharpness", p("power")?, "")]),
                _ => made("soft", &[limit]),
            }
        }
        _ => None,
    }
}

/// Lines of the rotor in the record: its torque through the stand.
fn rotor(truth: &Value) -> Option<[(&'static str, f64, &'static str); 3]> {
    let p = |key: &str| truth["parameters"][key].as_f64();
    let constant = |key: &str| truth["true_constants"][key].as_f64();
    let (natural_hz, ratio) = (
        constant("natural_frequency_hz")?,
        constant("damping_ratio")?,
    );
    let factor = |hz: f64| {
        let r = hz / natural_hz;
        (1.0 - r * r).hypot(2.0 * ratio * r).recip()
    };
    let (rate_hz, torque) = (p("frequency_hz")?, p("torque_n_m")?);
    let second = p("second")? * torque * factor(2.0 * rate_hz);
    Some([
        ("frequency", rate_hz, "Hz"),
        ("amplitude", torque * factor(rate_hz), "N m"),
        ("amplitude_2", second, "N m"),
    ])
}

/// A gap whose centre is offset by a fraction of it: with `r` the stiffness missing within, the gage shows
/// `X − r clamp(X, −g, g) + s g (1 − r)`, `X = K θ − s g`.
fn gap(p: &impl Fn(&str) -> Option<f64>, stiffness: f64) -> Option<Effect> {
    let half = p("half_gap_rad")? * stiffness;
    let missing = 1.0 - p("stiffness_left")?;
    let gap = ("gap", half, "N m");
    let (form, lines) = if missing == 1.0 {
        ("gap", vec![gap])
    } else {
        ("soft-gap", vec![gap, ("softening", missing, "")])
    };
    Some(Effect {
        form,
        lines,
        stiffness_n_m: stiffness,
        shift_n_m: -p("shift_of_half_gap")? * half * (1.0 - missing),
    })
}

/// `ż = α θ̇ − β |θ̇| |z|^(m−1) z − γ θ̇ |z|^m` in units of the record: `z → k z`, `k = α/K`, `x = K θ`.
fn hysteresis(p: &impl Fn(&str) -> Option<f64>, stiffness: f64, shown: bool) -> Option<Effect> {
    let (alpha, exponent) = (p("alpha_n_m_per_rad")?, p("exponent")?);
    let left = if shown {
        stiffness - alpha.min(0.9 * stiffness)
    } else {
        stiffness
    };
    let ratio = alpha / left;
    let per = alpha / p("limit_n_m")?.powf(exponent);
    let scale = (per * ratio.powf(exponent - 1.0) / left).powf(1.0 / exponent);
    let split = p("beta_share")?;
    let mut lines = vec![
        ("stiffness_ratio", ratio, ""),
        ("loss", split * scale, "1/(N m)"),
        ("shape", (1.0 - split) * scale, "1/(N m)"),
    ];
    let form = match (shown, exponent == 1.0) {
        (false, true) => "linear",
        (true, true) => "shown",
        (false, false) => {
            lines.push(("exponent", exponent, ""));
            "exponent"
        }
        // No form shows a hysteresis with another exponent.
        (true, false) => return None,
    };
    Some(Effect {
        form,
        lines,
        stiffness_n_m: left,
        shift_n_m: 0.0,
    })
}
