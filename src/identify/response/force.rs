//! Force of hammer hits, and its noise.

use std::ops::Range;

use torqcomp_dsp::frf;

use super::blocks::without_offset;

/// White noise of the force within a stroke; outside, the force is set to zero.
pub(super) struct StrokeNoise {
    /// Samples of the stroke in its block.
    pub samples: Range<usize>,
    /// Variance of the noise, from the samples outside the stroke.
    pub variance: f64,
}

/// The force of a hit.
pub(super) struct HitForce {
    pub samples: Vec<f64>,
    /// Noise within the stroke, if the noise outside was removed.
    pub stroke: Option<StrokeNoise>,
    /// Relative bias of the response due to noise that could not be removed.
    pub bias: f64,
}

/// The force of a hit, set to zero outside the hit if there is only noise.
pub(super) fn force_of_hit(signal: &[f64]) -> HitForce {
    let Some(stroke) = frf::stroke_of(signal) else {
        return HitForce {
            samples: without_offset(signal),
            stroke: None,
            bias: frf::noise_share(signal),
        };
    };
    let mut samples = vec![0.0; signal.len()];
    for i in stroke.range.clone() {
        samples[i] = signal[i] - stroke.rest;
    }
    let after = signal[stroke.range.end..].iter();
    let squares: f64 = after.map(|v| (v - stroke.rest).powi(2)).sum();
    let count = signal.len() - stroke.range.end;
    HitForce {
        samples,
        stroke: Some(StrokeNoise {
            samples: stroke.range,
            variance: squares / count.max(1) as f64,
        }),
        bias: 0.0,
    }
}
