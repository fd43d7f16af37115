//! Standard uncertainty of an inverted record, from those of the constants in the stand file.
//!
//! Such a stand has no frequency response, so each constant is varied by its standard uncertainty in both directions
//! and the record is inverted with both: half the difference is the contribution of this constant, sample by sample.

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::band::Band;
use torqcomp_dsp::rms;

use super::ChainInverse;
use crate::failure::Failure;
use crate::stand::{ConstantStd, Stand, VariedConstant, combined};

/// Allowed nonlinearity of the result over a constant's standard uncertainty, relative to its
/// contribution.
const STRAIGHT: f64 = 0.3;

/// Standard uncertainty of a result, in its unit.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub(crate) struct ResultStd {
    /// Standard uncertainty from stand, effects and calibration together, rms over the record; `null` if one of them is
    /// unknown.
    pub rms: Option<f64>,
    /// Largest standard uncertainty in the record; `null` if unknown.
    pub largest: Option<f64>,
    /// Standard uncertainty from mechanics and effects alone, rms; `null` if none of them has a `std`.
    pub of_response_rms: Option<f64>,
    /// Samples from the start of the record over which the uncertainties were determined.
    pub samples: usize,
    /// Constants in which the result is nonlinear over their standard uncertainty: their contribution is only an
    /// estimate.
    pub bent: Vec<String>,
    /// Constants that cannot be varied by their standard uncertainty; they are excluded.
    pub left_out: Vec<String>,
}

impl ResultStd {
    /// Converted to another unit, `scale` of it per SI unit.
    pub(crate) fn scaled(mut self, scale: f64) -> Self {
        for std in [&mut self.rms, &mut self.largest, &mut self.of_response_rms] {
            *std = std.map(|std| std * scale);
        }
        self
    }
}

/// Inversion of a record with varied constants.
pub(crate) struct Spread<'a> {
    pub stand: &'a Stand,
    pub band: &'a Band,
    /// In SI units of the record, its first samples at least.
    pub record: &'a [f64],
    pub noise_std: f64,
    /// Of the calibration constant.
    pub constant: ConstantStd,
}

impl Spread<'_> {
    /// Number of samples from the start of the record that are used.
    pub(crate) const LOOKED_AT: usize = 1 << 16;

    /// The standard uncertainty; `None` if no constant has one.
    ///
    /// # Errors
    /// If the record cannot be inverted.
    pub(crate) fn find(&self) -> Result<Option<ResultStd>, Failure> {
        let varied = self.stand.varied();
        if varied.is_empty() && self.constant.known().is_none() {
            return Ok(None);
        }
        let middle = self.back(self.stand, 1.0)?;
        let mut found = ResultStd {
            samples: middle.len(),
            ..ResultStd::default()
        };
        let mut terms = Vec::new();
        let mut kept = Vec::new();
        for constant in varied {
            let name = self.name(constant);
            match self.sides(constant, &middle) {
                Some((sides, are_both)) => {
                    let term = half_difference(&sides);
                    if !are_both || bend(&sides, &middle) > STRAIGHT * rms(&term) {
                        found.bent.push(name);
                    }
                    terms.push(term);
                    kept.push(constant);
                }
                None => found.left_out.push(name),
            }
        }
        let recorder = &self.stand.recorder;
        let of_recorder = [
            ("low_pass of the recorder", recorder.cutoff_std_hz),
            ("delay of the recorder", recorder.delay_std_s),
        ];
        let uncertain = of_recorder.into_iter().filter(|(_, std)| std.is_some());
        found
            .left_out
            .extend(uncertain.map(|(name, _)| name.to_owned()));
        let correlations = self.stand.correlations(&kept);
        let response = per_sample(&correlations, &terms, middle.len());
        let is_whole = found.left_out.is_empty();
        found.of_response_rms = (!kept.is_empty() && is_whole).then(|| rms(&response));
        let total = match self.constant {
            ConstantStd::Unknown => None,
            ConstantStd::NotNeeded => found.of_response_rms.map(|_| response),
            ConstantStd::Relative(std) => {
                let of_constant = self.of_constant(std, &middle)?;
                let pairs = response.iter().zip(&of_constant);
                is_whole.then(|| pairs.map(|(a, b)| a.hypot(*b)).collect())
            }
        };
        if let Some(total) = total {
            found.rms = Some(rms(&total));
            found.largest = Some(total.iter().copied().fold(0.0, f64::max));
        }
        Ok(Some(found))
    }

    /// Applied quantity on a stand for the record times a factor.
    fn back(&self, stand: &Stand, factor: f64) -> Result<Vec<f64>, Failure> {
        let inverse = ChainInverse::new(stand, self.band.clone())?;
        let count = self.record.len().min(Self::LOOKED_AT);
        let record: Vec<f64> = self.record[..count].iter().map(|y| y * factor).collect();
        let undone = inverse.run(&record, self.band.sample_rate_hz(), self.noise_std)?;
        Ok(undone.applied)
    }

    /// The record inverted with a constant varied in both directions, and whether both exist: a constant less certain
    /// than its distance from its bound is varied away from that only.
    fn sides(&self, constant: VariedConstant, middle: &[f64]) -> Option<([Vec<f64>; 2], bool)> {
        let side = |by: f64| {
            let side = self.back(&self.stand.moved(constant, by)?, 1.0).ok()?;
            side.iter().all(|v| v.is_finite()).then_some(side)
        };
        let opposite = |side: &[f64]| -> Vec<f64> {
            let pairs = side.iter().zip(middle);
            pairs.map(|(side, middle)| 2.0 * middle - side).collect()
        };
        match [side(-1.0), side(1.0)] {
            [Some(low), Some(high)] => Some(([low, high], true)),
            [Some(low), None] => {
                let high = opposite(&low);
                Some(([low, high], false))
            }
            [None, Some(high)] => Some(([opposite(&high), high], false)),
            [None, None] => None,
        }
    }

    /// Contribution of the calibration constant: a static gain divides the result, a calibration scales the record.
    fn of_constant(&self, std: f64, middle: &[f64]) -> Result<Vec<f64>, Failure> {
        if self.stand.static_gain().is_some() {
            return Ok(middle.iter().map(|v| std * v).collect());
        }
        let sides = [
            self.back(self.stand, 1.0 - std)?,
            self.back(self.stand, 1.0 + std)?,
        ];
        Ok(half_difference(&sides))
    }

    fn name(&self, constant: VariedConstant) -> String {
        match constant {
            VariedConstant::OfMechanics(place) => {
                let mechanics = self.stand.mechanics.as_ref();
                mechanics.map_or_else(String::new, |mechanics| mechanics.name(place))
            }
            VariedConstant::OfEffect(place, k) => {
                let effect = &self.stand.effects[place];
                format!(
                    "{} of {}",
                    effect.form.parameters[k].name, effect.effect.name
                )
            }
        }
    }
}

fn half_difference([low, high]: &[Vec<f64>; 2]) -> Vec<f64> {
    low.iter().zip(high).map(|(a, b)| (b - a) / 2.0).collect()
}

/// RMS distance of the middle from the mean of both sides.
fn bend([low, high]: &[Vec<f64>; 2], middle: &[f64]) -> f64 {
    let sides = low.iter().zip(high).zip(middle);
    let off: Vec<f64> = sides.map(|((a, b), m)| (a + b) / 2.0 - m).collect();
    rms(&off)
}

/// Standard uncertainty of each sample.
fn per_sample(correlations: &[Vec<f64>], terms: &[Vec<f64>], count: usize) -> Vec<f64> {
    let at = |i: usize| {
        let each: Vec<f64> = terms.iter().map(|term| term[i]).collect();
        combined(correlations, &each)
    };
    (0..count).map(at).collect()
}
