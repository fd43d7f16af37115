//! A body without a spring. Its displacement cannot be predicted from the applied quantity, as the smallest force error
//! accumulates without limit.
//!
//! So body and model are both tied to the measured motion `y` by a spring of known stiffness `k`: with
//! `J x'' + f x' + n = u`, also `J x'' + f x' + n + k x = u + k y`. The right-hand side is known, and the equation is
//! that of a stand of known gain, to which everything else applies. In units of the applied quantity, `k x` is the
//! record; its residual is the missing force below the frequency `√(k/J)`.

use std::f64::consts::TAU;
use std::sync::Arc;

use torqcomp_model::Estimate;
use torqcomp_model::effects::{Action, Memory};
use torqcomp_model::simulate::Excitation;

use super::plain::find_plain;
use super::record::StandRecord;
use super::residual_tests::without_mean;
use super::structure::{EffectForm, FitContext};
use super::units::ChannelUnits;
use super::{Case, scales};
use crate::failure::Failure;
use crate::identify::Motion;
use crate::print::{rounded, unit_or_as_recorded};
use crate::warning::{Warning, WarningCode};

/// RMS force of the tying spring relative to the applied quantity. The resulting natural frequency is four times the
/// frequency at which the inertia balances the applied quantity.
const HOLD: f64 = 16.0;
/// RMS force of the body's own spring, relative to the applied quantity, up to which the body
/// counts as free.
const SMALL_SPRING: f64 = 0.1;
/// Ratio of the natural frequency with the tying spring to that with the weak spring of a stand file for a free
/// body: that spring carries a millionth of the tying one.
const WEAKER: f64 = 1e3;

/// A body without a spring, tied to its measured motion.
#[derive(Debug, Clone)]
pub struct HeldBody {
    /// Stiffness of the tying spring, in SI units of applied quantity and motion.
    pub stiffness: f64,
    /// Units of the channels as they were recorded.
    pub recorded: ChannelUnits,
}

/// A case with the tied body, and its context; `None` unless the records are of a body without a spring.
///
/// # Errors
/// If the plain stand cannot be fitted to the tied body.
pub fn hold(case: &Case, unscaled: &FitContext) -> Result<Option<(Case, FitContext)>, Failure> {
    if case.declared.is_some() || case.gain_is_declared || case.recorder.is_some() {
        return Ok(None);
    }
    let train = &case.records.train;
    let acting = rms(train.iter().map(StandRecord::applied_in_range));
    let moving = rms(train.iter().map(StandRecord::measured_in_range));
    let stiffness = HOLD * acting / moving;
    let mut records = case.records.clone();
    let mean = train[0].measured.iter().sum::<f64>() / train[0].measured.len() as f64;
    records.change_records(|record| record.held(stiffness, mean));
    let recorded = case.units.clone();
    let units = ChannelUnits {
        measured: recorded.applied.clone(),
        diagnosed: crate::stand::si_unit(&recorded.applied),
        per_printed: recorded.factors[0],
        factors: [recorded.factors[0]; 2],
        ..recorded.clone()
    };
    let mut context = FitContext {
        scales: scales(&records.train),
        units: units.clone(),
        held: Some(HeldBody {
            stiffness,
            recorded,
        }),
        ..unscaled.clone()
    };
    // A spring of its own makes the total stiffer than the tying spring, so the gain is less than 1.
    let Ok(with_spring) = find_plain(&context, None, &records.train) else {
        return Ok(None);
    };
    let spring = HOLD * (1.0 / with_spring.plain.gain - 1.0);
    if spring.abs() > SMALL_SPRING {
        return Ok(None);
    }
    context.gain_is_free = false;
    context.plain.gain = 1.0;
    let context = find_plain(&context, None, &records.train)?;
    let held = Case {
        records,
        units,
        gain_is_declared: true,
        sources: case.sources.clone(),
        declared: None,
        several: None,
        declared_effects: Vec::new(),
        measures: Motion::Displacement,
        sees_torques: true,
        recorder: None,
        warnings: [case.warnings.clone(), vec![warning(&context, stiffness)]].concat(),
    };
    Ok(Some((held, context)))
}

fn warning(context: &FitContext, stiffness: f64) -> Warning {
    let natural_hz = context.plain.natural_hz;
    let units = context.held.as_ref().map(|held| &held.recorded);
    let [acting, moved] = units.map_or(["", ""], |u| [u.applied.as_str(), u.measured.as_str()]);
    let factors = units.map_or([1.0; 2], |u| u.factors);
    WarningCode::FreeBody.warning(format!(
        "the body moves freely: a spring of its own would take less than {} % of what is applied. To keep model \
         and motion together, a spring of {} {} per {} ({} Hz) ties both to the measured motion: errors and noise \
         are those of the applied quantity below that frequency",
        rounded(100.0 * SMALL_SPRING, 2),
        rounded(stiffness * factors[1] / factors[0], 4),
        unit_or_as_recorded(acting),
        unit_or_as_recorded(moved),
        rounded(natural_hz, 3),
    ))
}

/// RMS of several series together, each about its mean.
pub fn rms<'a>(series: impl Iterator<Item = &'a [f64]>) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for values in series {
        sum += without_mean(values).iter().map(|v| v * v).sum::<f64>();
        count += values.len();
    }
    (sum / count as f64).sqrt()
}

impl StandRecord {
    /// The record of the body tied by a spring to the measured motion, about a mean.
    fn held(&self, stiffness: f64, mean: f64) -> Self {
        let input = &self.input;
        let spring: Vec<f64> = self
            .measured
            .iter()
            .map(|y| stiffness * (y - mean))
            .collect();
        let acting = input.samples().iter().zip(&spring);
        let acting = acting.map(|(u, spring)| u + spring).collect();
        let (rate_hz, start_s) = (input.rate_hz(), input.start_s());
        let input = Excitation::new(acting, rate_hz, start_s, input.substeps());
        Self {
            input: Arc::new(input),
            measured: Arc::new(spring),
            is_held: true,
            ..self.clone()
        }
    }
}

impl HeldBody {
    /// RMS of the applied quantity on the body itself, without the spring, over some records.
    pub fn acting_rms<'a>(records: impl Iterator<Item = &'a StandRecord>) -> f64 {
        let all: Vec<Vec<f64>> = records.map(StandRecord::acting_in_range).collect();
        rms(all.iter().map(Vec::as_slice))
    }

    /// Inertia `k/ω²` and damping `2ζk/ω` of the body, in the units of the files, from natural frequency and damping
    /// ratio of the tied body.
    pub fn constants(&self, [natural_hz, ratio]: [&Estimate; 2]) -> [Estimate; 2] {
        let units = &self.recorded;
        let omega = TAU * natural_hz.value();
        let stiffness = self.stiffness * units.factors[1] / units.factors[0];
        let inertia = stiffness / (omega * omega);
        let damping = 2.0 * ratio.value() * stiffness / omega;
        let relative = natural_hz.relative_std();
        let both = relative.zip(ratio.relative_std());
        let [applied, measured] = [&units.applied, &units.measured].map(|u| unit_or_as_recorded(u));
        [
            Estimate::of(
                format!("{applied} s^2/{measured}"),
                inertia,
                relative.map(|r| 2.0 * r * inertia),
            ),
            Estimate::of(
                format!("{applied} s/{measured}"),
                damping,
                both.map(|(w, z)| damping * w.hypot(z)),
            ),
        ]
    }

    /// Natural frequency, damping ratio and gain of the body with the weak spring of a stand file.
    pub fn weakly_held(&self, [natural_hz, ratio, _]: [Estimate; 3]) -> [Estimate; 3] {
        let times = |estimate: &Estimate, factor: f64| {
            let std = estimate.std_uncertainty().map(|std| std * factor);
            Estimate::of(estimate.unit().to_owned(), estimate.value() * factor, std)
        };
        [
            times(&natural_hz, 1.0 / WEAKER),
            times(&ratio, WEAKER),
            Estimate::of("", WEAKER * WEAKER / self.stiffness, None),
        ]
    }

    /// Conversion factor of an effect's parameter with a power of the record unit, from the tied body (units of the
    /// applied quantity) to the weak spring (units of the motion).
    pub fn weakly(&self, power_of_recorded: i32, is_size: bool) -> f64 {
        let size = if is_size { WEAKER * WEAKER } else { 1.0 };
        size * self.stiffness.powi(-power_of_recorded)
    }
}

impl EffectForm {
    /// Whether it is a torque in addition to the record and proportional to its first parameter: it then means the same
    /// with any spring, and without one.
    pub fn needs_no_spring(&self) -> bool {
        let Some(start) = self.form.starts.first().filter(|start| !start.is_empty()) else {
            return false;
        };
        let torque = |factor: f64, size: f64| {
            let mut values = start.to_vec();
            values[0] *= factor;
            let Action::Torque {
                torque,
                in_gage_path: false,
            } = (self.form.build)(&values)
            else {
                return None;
            };
            let mut memory: Memory = torque.begin(0.0);
            Some(torque.value(&mut memory, 0.3 * size, 0.7 * size))
        };
        // For small and for large motions.
        [1e-3, 1.0].into_iter().all(|size| {
            let both = torque(1.0, size).zip(torque(2.0, size));
            both.is_some_and(|(once, twice)| {
                once != 0.0 && (twice - 2.0 * once).abs() <= 1e-9 * once.abs()
            })
        })
    }
}
