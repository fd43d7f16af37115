//! Rounding of a periodic record to whole steps of the recorder.

use std::f64::consts::SQRT_2;

use torqcomp_dsp::harmonics::Harmonics;
use torqcomp_dsp::quality::quantisation::quantisation;
use torqcomp_dsp::store::SampleStore;

use crate::recording::UniformRecord;

/// Uncertainty of an amplitude by its surroundings, relative to that of rounding spread like noise, below which the
/// rounding is not in the surroundings.
const MISSING: f64 = 0.5;

/// Adds what rounding contributes where the surroundings of the components do not show it. With noise of half a step or
/// more, the errors of rounding are spread like noise, `q √(2/12N)` in each amplitude (B. Widrow and I. Kollár,
/// *Quantization Noise*, Cambridge 2008). In a quieter record that repeats after the `P` samples of a period,
/// they repeat as well and are all in the orders: up to `q √(2/12P)`, however long the record.
pub(super) fn add_rounding(fitted: &mut Harmonics, seen: &[f64], record: &UniformRecord) {
    let Some(found) = quantisation(seen) else {
        return;
    };
    // Of a number rounded to whole steps.
    let std = found.step / 12.0_f64.sqrt();
    let count = record.samples.count() as f64;
    for component in &mut fitted.components {
        let spread = std * SQRT_2 / count.sqrt();
        if component.std_amplitude >= MISSING * spread {
            continue;
        }
        let period = (record.rate_hz * component.order / component.frequency_hz).min(count);
        component.add_std(std * SQRT_2 / period.sqrt());
    }
}
