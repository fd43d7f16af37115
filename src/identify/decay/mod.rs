//! Frequencies and damping from free decays (Appendix C, II).

mod by_hand;
mod dependence;
mod laws;
mod modes;
mod stretches;
mod words;

use torqcomp_dsp::decimate;

use super::{Outcome, Quality, rms};
use crate::failure::Failure;

pub use laws::{Law, LawFit, envelope};
use modes::Wanted;
pub use modes::{ModesFit, Pole, Stretch};

/// A record with decays in it.
#[derive(Debug, Clone, Copy)]
pub struct Ringing<'a> {
    /// Name of the record, for messages.
    pub name: &'a str,
    /// Times in seconds, rising; they need not be uniform.
    pub times_s: &'a [f64],
    /// Samples a second, if the times are uniform.
    pub rate_hz: Option<f64>,
    /// Values.
    pub values: &'a [f64],
}

/// How decays are evaluated.
#[derive(Debug, Clone, Copy, Default)]
pub struct Options {
    /// Number of modes; found from the data if not given.
    pub modes: Option<usize>,
    /// Part of the time axis to use, in seconds.
    pub range_s: Option<(f64, f64)>,
    /// Lowest and highest frequency of the modes looked for, in Hz. What lies above is filtered away.
    pub band_hz: Option<(f64, f64)>,
}

/// A decay that was evaluated, with what is needed to draw it.
#[derive(Debug, Clone)]
pub struct Evaluated {
    /// The numbers.
    pub outcome: Outcome,
    /// The stretches that were fitted.
    pub stretches: Vec<Stretch>,
    /// Start of each stretch on its record's time axis, in seconds.
    pub starts_s: Vec<f64>,
    /// The fit.
    pub fit: ModesFit,
    /// The laws of damping in order of what speaks for them; empty for several modes.
    pub laws: Vec<LawFit>,
}

/// Most modes looked for.
const MOST_MODES: usize = 12;

/// Evaluates one or several records of the same free ringing.
///
/// # Errors
/// If nothing rings, or there is too little of it.
pub fn identify(records: &[Ringing], options: &Options) -> Result<Evaluated, Failure> {
    let mut outcome = Outcome::default();
    let (stretches, starts_s, slowed) = stretches::stretches(records, options, &mut outcome)?;
    let wanted = Wanted {
        count: options.modes,
        most: MOST_MODES,
        band_hz: options.band_hz.unwrap_or((0.0, f64::INFINITY)),
        worth: if slowed { decimate::NOISE } else { 1.0 },
    };
    let mut fit = modes::search(&stretches, &wanted)?;
    if slowed {
        fit.allow_for(decimate::NOISE);
    }
    if fit.poles.is_empty() {
        return Err(Failure::failed(
            "nothing in the record rings: no decaying sine stands out of the noise; check the channel, \
             or cut the record to the decay with --range",
        ));
    }
    words::doubts(&mut outcome, &fit);
    let order = fit.by_strength(stretches.len());
    for (place, k) in order.iter().enumerate() {
        words::name_mode(&mut outcome, &fit, *k, place, order.len());
    }
    let quality = quality(&fit, &stretches);
    words::poor(&mut outcome, quality.relative);
    outcome.quality = Some(quality);
    outcome.method.push(format!(
        "nonlinear least squares over {} stretch(es), {} samples: {} decaying sine(s), with an offset and a \
         drift of each stretch",
        stretches.len(),
        fit.fit.residuals.len(),
        fit.poles.len()
    ));
    words::correlations(&mut outcome, &fit);
    let main = order[0];
    let laws = dependence::damping_law(&mut outcome, &fit, &stretches)?;
    dependence::amplitude_dependence(&mut outcome, &fit, &stretches, main);
    by_hand::compare(&mut outcome, &fit, &stretches, main);
    words::draw(&mut outcome, &fit, &stretches, &starts_s);
    Ok(Evaluated {
        outcome,
        stretches,
        starts_s,
        fit,
        laws,
    })
}

/// What the fit leaves of the swing about offset and drift.
fn quality(fit: &ModesFit, stretches: &[Stretch]) -> Quality {
    let mut swing = Vec::new();
    for (s, stretch) in stretches.iter().enumerate() {
        let (c, d) = fit.trend(s);
        let pairs = stretch.times_s.iter().zip(&stretch.values);
        swing.extend(pairs.map(|(t, y)| y - c - d * t));
    }
    Quality {
        rms: fit.fit.rms,
        unit: String::new(),
        relative: fit.fit.rms / rms(&swing),
    }
}
