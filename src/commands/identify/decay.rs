//! `identify decay`.

use super::anchor::{Ratios, Told, follow};
use super::{ONE_MODE, deliver, read, said, uniform};
use crate::cli::identify::Decay;
use crate::commands::Outcome;
use crate::failure::Failure;
use crate::identify::anchored::Ringer;
use crate::identify::decay::{Evaluated, Options, Ringing, identify};
use crate::report::identify::{Law, Report};
use crate::stand::update::Entry;
use crate::warning::Warning;

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
    let stamps = match (&selection.channel.axis.stamps_s, args.reading.axis.rate) {
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

/// Constants that follow from the strongest mode and the anchor, and the entries of the stand file.
fn entries(args: &Decay, evaluated: &mut Evaluated) -> Result<Vec<Entry>, Failure> {
    let outcome = &evaluated.outcome;
    let main = |name: &str| {
        let found = outcome.get(name);
        found
            .or_else(|| outcome.get(&format!("mode_1_{name}")))
            .cloned()
    };
    let both = (main("natural_frequency"), main("damping_ratio"));
    let (Some(frequency), Some(ratio)) = both else {
        return Ok(Vec::new());
    };
    if evaluated.fit.poles.len() > 1 && args.findings.result.output.is_some() {
        return Err(Failure::failed(ONE_MODE));
    }
    let told = Told {
        mode: strongest(evaluated),
        ratios: Ratios::OverInertia,
        modal: [&frequency, &ratio],
        source: format!("identify decay: {}", args.inputs.join(", ")),
    };
    follow(&args.anchors, &args.findings, &told, &mut evaluated.outcome)
}

/// The strongest mode with the covariance of its poles.
fn strongest(evaluated: &Evaluated) -> Ringer {
    let fit = &evaluated.fit;
    let main = fit.by_strength(evaluated.stretches.len())[0];
    let covariance = |i: usize, j: usize| fit.fit.covariance.get(2 * main + i, 2 * main + j);
    let all = || {
        Some([
            [covariance(0, 0)?, covariance(0, 1)?],
            [covariance(1, 0)?, covariance(1, 1)?],
        ])
    };
    Ringer {
        rate_per_s: fit.poles[main].rate_per_s,
        omega_rad_per_s: fit.poles[main].omega_rad_per_s,
        covariance: all(),
    }
}
