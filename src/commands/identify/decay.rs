//! `identify decay`.

use torqcomp_model::Kind;

use super::{declared, deliver, quantity, read, said, stand_text, uniform};
use crate::cli::identify::Decay;
use crate::commands::Outcome;
use crate::failure::Failure;
use crate::identify::Found;
use crate::identify::decay::{Evaluated, Options, Ringing, identify};
use crate::report::Warning;
use crate::report::identify::{Law, Report};
use crate::stand::update::Entry;

/// A record as it is evaluated.
struct Loaded {
    name: String,
    times_s: Vec<f64>,
    rate_hz: Option<f64>,
    values: Vec<f64>,
    unit: String,
    warnings: Vec<Warning>,
    is_lossy: bool,
}

/// Runs the test.
pub fn run(args: &Decay) -> Result<Outcome, Failure> {
    let loaded: Vec<Loaded> = args
        .inputs
        .iter()
        .map(|input| load(args, input))
        .collect::<Result<_, _>>()?;
    let records: Vec<Ringing> = loaded
        .iter()
        .map(|l| Ringing {
            name: &l.name,
            times_s: &l.times_s,
            rate_hz: l.rate_hz,
            values: &l.values,
        })
        .collect();
    let options = Options {
        modes: args.modes.map(usize::from),
        range_s: args.range,
        band_hz: args.band,
    };
    let mut evaluated = identify(&records, &options)?;
    if let Some(quality) = &mut evaluated.outcome.quality {
        quality.unit.clone_from(&loaded[0].unit);
    }
    let entries = entries(args, &mut evaluated)?;
    let inputs: Vec<&str> = args.inputs.iter().map(String::as_str).collect();
    let mut report = Report::new("decay", &inputs, &evaluated.outcome, args.findings.units);
    report.samples = loaded.iter().map(|l| l.values.len()).sum();
    report.rate_hz = loaded[0].rate_hz;
    report.laws = evaluated
        .laws
        .iter()
        .map(|l| Law {
            law: l.law.name(),
            rms: l.rms,
            criterion: l.criterion,
        })
        .collect();
    let warnings = loaded.iter().flat_map(|l| l.warnings.iter().cloned());
    report.warnings.extend(warnings);
    let is_lossy = loaded.iter().any(|l| l.is_lossy);
    deliver(&report, &args.findings, &inputs, &entries, is_lossy)
}

/// Reads one record; samples that are not there are left out, as the fit needs no uniform steps.
fn load(args: &Decay, input: &str) -> Result<Loaded, Failure> {
    let options = args.reading.options(args.channel.as_deref(), None);
    let recording = read(input, std::slice::from_ref(&options))?;
    let selection = recording.select(&options)?;
    let count = selection.samples.len();
    let stamps = match (&selection.channel.axis.stamps_s, args.reading.rate) {
        (Some(stamps), None) => stamps.to_vec(),
        _ => {
            let (start, rate) = (selection.start_s, selection.rate_hz);
            (0..count).map(|i| start + i as f64 / rate).collect()
        }
    };
    let is_whole = selection.channel.holes.is_empty();
    let rate_hz = (is_whole && uniform(&stamps, selection.rate_hz)).then_some(selection.rate_hz);
    let mut last = f64::NEG_INFINITY;
    let (times_s, values) = stamps
        .into_iter()
        .zip(selection.samples.iter().copied())
        .filter(|(t, v)| {
            let later = *t > last && v.is_finite();
            last = if later { *t } else { last };
            later
        })
        .unzip();
    Ok(Loaded {
        name: input.to_owned(),
        times_s,
        rate_hz,
        values,
        unit: selection.unit.map_or_else(String::new, |u| u.text),
        warnings: said(&recording.warnings, recording.lost.as_ref()),
        is_lossy: recording.lost.is_some(),
    })
}

/// What is anchored by a declared value.
enum Anchor {
    Inertia(f64, Option<f64>),
    Stiffness(f64, Option<f64>),
    Nothing,
}

fn anchor(args: &Decay) -> Result<(Anchor, bool), Failure> {
    if let Some(text) = &args.inertia {
        return Ok((
            Anchor::Inertia(quantity("--inertia", text, Kind::Inertia)?, None),
            true,
        ));
    }
    if let Some(text) = &args.stiffness {
        let stiffness = quantity("--stiffness", text, Kind::AngularStiffness)?;
        return Ok((Anchor::Stiffness(stiffness, None), true));
    }
    let stand = stand_text(&args.findings)?;
    if let Some((value, std)) = declared(stand.as_ref(), "inertia", Kind::Inertia)? {
        return Ok((Anchor::Inertia(value, std), false));
    }
    if let Some((value, std)) = declared(stand.as_ref(), "stiffness", Kind::AngularStiffness)? {
        return Ok((Anchor::Stiffness(value, std), false));
    }
    Ok((Anchor::Nothing, false))
}

/// Constants that follow from the strongest mode and the anchor, (C18) and (C20), and the entries of
/// the stand file.
fn entries(args: &Decay, evaluated: &mut Evaluated) -> Result<Vec<Entry>, Failure> {
    let source = format!("identify decay: {}", args.inputs.join(", "));
    let entry = |key: &'static str, found: &Found| Entry {
        section: "mechanics",
        key,
        value: found.value,
        std: found.std,
        unit: found.unit.clone(),
        source: source.clone(),
    };
    let (anchor, given) = anchor(args)?;
    let (known, mut found) = match anchor {
        Anchor::Nothing => {
            evaluated.outcome.warn(
                "not-anchored",
                "a decay tells only ratios such as stiffness over inertia: give --inertia or --stiffness, or \
                 a stand file that declares one, to have all three constants",
            );
            let outcome = &evaluated.outcome;
            let main = |name: &str| {
                outcome
                    .get(name)
                    .or_else(|| outcome.get(&format!("mode_1_{name}")))
                    .cloned()
            };
            let both = (main("natural_frequency"), main("damping_ratio"));
            let (Some(frequency), Some(ratio)) = both else {
                return Ok(Vec::new());
            };
            return Ok(vec![
                entry("natural_frequency", &frequency),
                entry("damping_ratio", &ratio),
            ]);
        }
        Anchor::Inertia(value, std) => (
            Found::new("inertia", value, std, "kg m^2"),
            from_inertia(evaluated, value, std),
        ),
        Anchor::Stiffness(value, std) => (
            Found::new("stiffness", value, std, "N m/rad"),
            from_stiffness(evaluated, value, std),
        ),
    };
    if known.std.is_none() {
        evaluated.outcome.warn(
            "anchor-without-std",
            format!(
                "the {} has no standard uncertainty, so that those of the constants that follow leave it \
                 out",
                known.name
            ),
        );
    }
    let mut entries = Vec::new();
    if given {
        let key = if known.name == "inertia" {
            "inertia"
        } else {
            "stiffness"
        };
        let mut anchor = entry(key, &known);
        anchor.source = "declared".to_owned();
        entries.push(anchor);
    }
    for new in &found {
        let key = match new.name.as_str() {
            "inertia" => "inertia",
            "damping" => "damping",
            _ => "stiffness",
        };
        entries.push(entry(key, new));
    }
    evaluated.outcome.found.append(&mut found);
    Ok(entries)
}

/// K = J (ω² + σ²), f = 2σJ.
fn from_inertia(evaluated: &Evaluated, inertia: f64, std: Option<f64>) -> Vec<Found> {
    let (sigma, omega) = strongest(evaluated);
    let square = sigma * sigma + omega * omega;
    let relative = std.map_or(0.0, |s| s / inertia);
    let stiffness = inertia * square;
    let damping = 2.0 * sigma * inertia;
    let of_k = uncertainty(evaluated, 2.0 * sigma * inertia, 2.0 * omega * inertia);
    let of_f = uncertainty(evaluated, 2.0 * inertia, 0.0);
    vec![
        Found::new(
            "stiffness",
            stiffness,
            of_k.map(|u| u.hypot(relative * stiffness)),
            "N m/rad",
        ),
        Found::new(
            "damping",
            damping,
            of_f.map(|u| u.hypot(relative * damping)),
            "N m s/rad",
        ),
    ]
}

/// J = K/(ω² + σ²), f = 2σJ.
fn from_stiffness(evaluated: &Evaluated, stiffness: f64, std: Option<f64>) -> Vec<Found> {
    let (sigma, omega) = strongest(evaluated);
    let square = sigma * sigma + omega * omega;
    let relative = std.map_or(0.0, |s| s / stiffness);
    let inertia = stiffness / square;
    let damping = 2.0 * sigma * inertia;
    let by = -2.0 * inertia / square;
    let of_j = uncertainty(evaluated, by * sigma, by * omega);
    let of_f = uncertainty(
        evaluated,
        2.0 * inertia + 2.0 * sigma * by * sigma,
        2.0 * sigma * by * omega,
    );
    vec![
        Found::new(
            "inertia",
            inertia,
            of_j.map(|u| u.hypot(relative * inertia)),
            "kg m^2",
        ),
        Found::new(
            "damping",
            damping,
            of_f.map(|u| u.hypot(relative * damping)),
            "N m s/rad",
        ),
    ]
}

fn strongest(evaluated: &Evaluated) -> (f64, f64) {
    let main = evaluated.fit.by_strength(evaluated.stretches.len())[0];
    let pole = evaluated.fit.poles[main];
    (pole.rate_per_s, pole.omega_rad_per_s)
}

/// Standard uncertainty of what depends so on σ and ω of the strongest mode.
fn uncertainty(evaluated: &Evaluated, by_sigma: f64, by_omega: f64) -> Option<f64> {
    let main = evaluated.fit.by_strength(evaluated.stretches.len())[0];
    let fit = &evaluated.fit.fit;
    let mut gradient = vec![0.0; fit.values.len()];
    gradient[2 * main] = by_sigma;
    gradient[2 * main + 1] = by_omega;
    fit.covariance.std_of(&gradient)
}
