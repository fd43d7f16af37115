//! Motion along a record: that of the model, corrected by the low-frequency part of its residual.

use num_complex::Complex64;

use crate::diagnose::record::{NuisanceTerms, StandRecord};
use crate::diagnose::score::ScoredModel;
use torqcomp_model::Chain;
use torqcomp_model::effects::Stage;

/// Frequency, relative to the natural one, up to which the residual is attributed to motion: above it there is little
/// but noise, which differentiation to a speed would amplify.
const CORRECTED: f64 = 5.0;

/// Displacement and speed at each sample of a record.
pub struct MeasuredMotion {
    pub x: Vec<f64>,
    /// Over the natural angular frequency, so that it is comparable with the displacement.
    pub speed: Vec<f64>,
}

impl MeasuredMotion {
    /// The motion along a record with the model's initial state, optionally corrected by its residual; `None` if it
    /// diverges.
    pub fn along(model: &ScoredModel, record: &StandRecord, is_corrected: bool) -> Option<Self> {
        let fitted = &model.fitted;
        let mut x = up_to_the_gage(model, record)?;
        if is_corrected {
            let (whole, terms) = fitted.structure.model(&fitted.values);
            let recorded = record.run_of(&whole).simulate(&record.input);
            let correction = slow_part(record, &recorded, &terms, whole.stand.highest_hz())?;
            x.iter_mut().zip(correction).for_each(|(x, c)| *x += c);
        }
        let omega = fitted.mode().omega_rad_s;
        let speed = through(record, &x, |at| Complex64::new(0.0, at / omega));
        Some(Self { x, speed })
    }
}

/// Gage signal of the model, before the recorder.
fn up_to_the_gage(model: &ScoredModel, record: &StandRecord) -> Option<Vec<f64>> {
    let (chain, _) = super::reduced(model, |stage| stage <= Stage::Gage);
    let shown = record.run_of(&chain).simulate(&record.input);
    shown.last().is_some_and(|x| x.is_finite()).then_some(shown)
}

/// Residual of a model on a record, without nuisance terms other than the motion, and without the high-frequency noise.
fn slow_part(
    record: &StandRecord,
    recorded: &[f64],
    terms: &NuisanceTerms,
    natural_hz: f64,
) -> Option<Vec<f64>> {
    let pairs = record.measured.iter().zip(recorded);
    let mut left: Vec<f64> = pairs.map(|(y, x)| y - x).collect();
    if left.last().is_none_or(|r| !r.is_finite()) {
        return None;
    }
    // The nuisance terms are unknown outside the range.
    let inside = &mut left[record.range.clone()];
    record.nuisance_beside_motion(terms).clear(inside);
    left[..record.range.start].fill(0.0);
    left[record.range.end..].fill(0.0);
    let corner = std::f64::consts::TAU * CORRECTED * natural_hz;
    Some(through(record, &left, |at| {
        Complex64::from(1.0 / (1.0 + (at / corner).powi(8)))
    }))
}

/// Samples along a record, filtered by a response over angular frequency.
pub fn through(
    record: &StandRecord,
    samples: &[f64],
    response: impl Fn(f64) -> Complex64,
) -> Vec<f64> {
    let mut spectrum = record.input.transform(samples);
    for (line, value) in spectrum.iter_mut().enumerate() {
        *value *= response(record.input.omega_rad_s(line));
    }
    record.input.samples_of(spectrum)
}

/// Contribution to the record of a unit torque at the gage, by angular frequency.
pub fn of_torque(chain: &Chain) -> impl Fn(f64) -> Complex64 + '_ {
    let at_gage = chain.stand.at_gage();
    move |omega| {
        let hz = omega / std::f64::consts::TAU;
        at_gage.as_ref().unwrap_or(&chain.stand).response(omega) * chain.response_of(hz, |_| true)
    }
}
