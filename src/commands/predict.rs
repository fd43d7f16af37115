//! `predict`: constants from the drawing compared with the measured ones.

mod calibration;
mod report;

use torqcomp_dsp::bridge::BridgeLayout;
use torqcomp_dsp::conversion::Conversion;
use torqcomp_model::damping::viscous_from_friction_slope_n_m_s_per_rad;
use torqcomp_model::{Estimate, Kind, SecondOrder, UnitSystem};

pub(super) use self::report::PredictReport;
use self::report::{PredictedConstant, Refinement, residual_percent};
use super::{Outcome, conclude, publish};
use crate::cli::{Predict, Strictness};
use crate::failure::{ErrorCode, Failure};
use crate::print::{enumeration, rounded};
use crate::stand::{self, BeamDrawing, BridgeData, Given, Stand, TransducerSignal};

/// Maximum remaining fraction of a residual for an effect to explain it.
const EXPLAINED: f64 = 0.5;
/// Predicted over measured damping below which the drawing does not account for the loss at all.
const FAR_TOO_SMALL: f64 = 0.1;
/// Factor between measured and predicted torque per volt from which a remark is given.
const LARGE_FACTOR: f64 = 1.5;

/// Runs the verb.
pub fn run(args: &Predict) -> Result<Outcome, Failure> {
    let stand = stand::read(&args.stand)?;
    let drawing = Drawing::of(&stand)?;
    let constants = drawing.constants(args.units.into())?;
    if constants.iter().all(|c| c.predicted.is_none()) {
        return Err(stand.failed(
            ErrorCode::IncompleteStand,
            "there is no drawing to calculate constants from; add [beam], [[parts]], \
             [friction], or [gage] and [bridge]",
        ));
    }
    let output = args.result.open(&[args.stand.as_path()])?;
    let report = PredictReport {
        stand: stand.file.clone(),
        constants,
    };
    publish(&report, args.json, output)?;
    Ok(conclude(&stand.warnings, false, &Strictness::default()))
}

/// Constants that follow from the drawing, in SI units, and the measured ones.
struct Drawing<'a> {
    stand: &'a Stand,
    /// Stiffness of the slender beam, then with each effect added.
    stiffness: Option<Stiffness>,
    inertia: Option<Estimate>,
    damping: Option<Estimate>,
    measured: Measured,
}

/// The measured constants.
#[derive(Default)]
struct Measured {
    inertia: Option<Estimate>,
    damping: Option<Estimate>,
    stiffness: Option<Estimate>,
    natural_frequency: Option<Estimate>,
    damping_ratio: Option<Estimate>,
}

struct Stiffness {
    slender: Estimate,
    refined: Vec<(&'static str, f64)>,
}

impl<'a> Drawing<'a> {
    fn of(stand: &'a Stand) -> Result<Self, Failure> {
        let parts: Vec<Option<&Estimate>> = stand.parts.iter().map(Some).collect();
        let sum = derive(stand, Kind::Inertia, &parts, |x| x.iter().sum())?;
        let friction = stand.friction.as_ref();
        let inputs = [
            friction.map(|f| &f.force_change),
            friction.map(|f| &f.speed_change),
            friction.map(|f| &f.radius),
        ];
        let slope = |x: &[f64]| {
            viscous_from_friction_slope_n_m_s_per_rad(x[0] / x[1], x[2]).unwrap_or(f64::NAN)
        };
        Ok(Self {
            stiffness: stand.beam.as_ref().map(Stiffness::of),
            inertia: sum.filter(|_| !parts.is_empty()),
            damping: derive(stand, Kind::AngularDamping, &inputs, slope)?,
            measured: Measured::of(stand)?,
            stand,
        })
    }

    fn constants(&self, units: UnitSystem) -> Result<Vec<PredictedConstant>, Failure> {
        let measured = &self.measured;
        let slender = self.stiffness.as_ref().map(|s| &s.slender);
        let (inertia, damping) = (self.inertia.as_ref(), self.damping.as_ref());
        let given = |name, predicted, measured, by, kind| PredictedConstant {
            by,
            ..constant(name, predicted, measured, kind, units)
        };

        let mut stiffness = given(
            "stiffness",
            slender,
            &measured.stiffness,
            "slender beam (Euler-Bernoulli) in a rigid clamp",
            Kind::AngularStiffness,
        );
        self.refine(&mut stiffness, |k| {
            Some(Kind::AngularStiffness.to(units, k))
        });
        let ring = given(
            "inertia",
            inertia,
            &measured.inertia,
            "sum of the parts",
            Kind::Inertia,
        );
        let mut loss = given(
            "damping",
            damping,
            &measured.damping,
            "slope of friction over speed, times radius",
            Kind::AngularDamping,
        );
        loss.note = damping_note(&loss);
        let [natural, damping_ratio] = self.modal(units)?;
        let per_volt = self.torque_per_volt(units)?;
        let mut all = vec![stiffness, ring, loss, natural, damping_ratio, per_volt];
        all.extend(self.calibration(units));
        Ok(all)
    }

    /// Natural frequency and damping ratio.
    fn modal(&self, units: UnitSystem) -> Result<[PredictedConstant; 2], Failure> {
        let measured = &self.measured;
        let slender = self.stiffness.as_ref().map(|s| &s.slender);
        let (inertia, damping) = (self.inertia.as_ref(), self.damping.as_ref());
        let frequency = |x: &[f64]| {
            SecondOrder::new(x[0], 0.0, x[1]).map_or(f64::NAN, |stand| stand.natural_frequency_hz())
        };
        let predicted = derive(self.stand, Kind::Frequency, &[inertia, slender], frequency)?;
        let mut natural = constant(
            "natural_frequency",
            predicted.as_ref(),
            &measured.natural_frequency,
            Kind::Frequency,
            units,
        );
        natural.by = "stiffness and inertia above";
        self.refine(&mut natural, |k| Some(frequency(&[inertia?.value(), k])));

        let ratio = |x: &[f64]| {
            SecondOrder::new(x[0], x[1], x[2]).map_or(f64::NAN, |stand| stand.damping_ratio())
        };
        let predicted = derive(self.stand, Kind::Ratio, &[inertia, damping, slender], ratio)?;
        let damping_ratio = PredictedConstant {
            by: "stiffness, inertia and damping above",
            ..constant(
                "damping_ratio",
                predicted.as_ref(),
                &measured.damping_ratio,
                Kind::Ratio,
                units,
            )
        };
        Ok([natural, damping_ratio])
    }

    /// Adds the contribution of each effect of the drawing to a constant derived from the stiffness.
    fn refine(&self, constant: &mut PredictedConstant, by_stiffness: impl Fn(f64) -> Option<f64>) {
        let refined = self.stiffness.as_ref().map_or(&[][..], |s| &s.refined);
        for (effect, stiffness) in refined {
            let Some(predicted) = by_stiffness(*stiffness) else {
                continue;
            };
            constant.refinements.push(Refinement {
                effect,
                predicted,
                residual_percent: residual_percent(Some(predicted), constant.measured),
            });
        }
        let (Some(before), Some(last)) = (constant.residual_percent, constant.refinements.last())
        else {
            return;
        };
        let Some(after) = last.residual_percent else {
            return;
        };
        if after.abs() <= EXPLAINED * before.abs() {
            let effects: Vec<&str> = constant.refinements.iter().map(|r| r.effect).collect();
            constant.explained_by = Some(format!(
                "{} (residual {after:+.1} %)",
                effects.join(" and ")
            ));
        }
    }

    fn torque_per_volt(&self, units: UnitSystem) -> Result<PredictedConstant, Failure> {
        let stand = self.stand;
        let is_whole = |bridge: &BridgeData| bridge.layout.is_some() && bridge.supply.is_some();
        let given = stand.gage.is_some() && stand.bridge.as_ref().is_some_and(is_whole);
        let placed = stand
            .beam
            .as_ref()
            .is_some_and(|b| b.gage_position.is_some());
        let mut note = None;
        let mut predicted = None;
        if given && placed {
            let bridge = stand.bridge()?;
            let torque_per_strain = stand.torque_per_strain()?;
            let loading = bridge.loading_factor();
            let layout = bridge.layout();
            let gain = stand.recorder.recorder.gain();
            let conversion = Conversion::bridge(bridge, gain, 0.0, torque_per_strain)
                .map_err(Failure::of(ErrorCode::InvalidStand))?;
            let gain = conversion.small_signal_gain();
            note = self.torque_per_volt_note(gain, layout, loading);
            let made = Estimate::new(Kind::TorquePerVolt, gain, None, "drawing");
            predicted = Some(made.map_err(Failure::of(ErrorCode::InvalidStand))?);
        }
        // From a calibration in mV/V with gain and supply.
        let by_ratio = || {
            let (slope, relative) = stand.measured_slope(TransducerSignal::Voltage)?;
            let std = relative.map(|relative| (relative * slope).abs());
            Some(
                Estimate::of(Kind::TorquePerVolt, slope, std)
                    .with_source("calibration, gain and supply"),
            )
        };
        let of_volts = stand.calibration.as_ref().and_then(|c| c.torque_per_volt());
        let measured = of_volts.cloned().or_else(by_ratio);
        let mut made = constant(
            "torque_per_volt",
            predicted.as_ref(),
            &measured,
            Kind::TorquePerVolt,
            units,
        );
        made.by = "strain at the gage, gage factor and bridge";
        made.note = note;
        Ok(made)
    }

    /// Possible contributions to a large factor, indistinguishable in the record.
    fn torque_per_volt_note(
        &self,
        predicted: f64,
        layout: BridgeLayout,
        loading: f64,
    ) -> Option<String> {
        let factor = self.stand.calibration.as_ref()?.torque_per_volt()?.value() / predicted;
        if factor.abs() < LARGE_FACTOR {
            return None;
        }
        let mut causes = Vec::new();
        if !matches!(layout, BridgeLayout::Quarter) {
            let times = layout.bridge_factor();
            causes.push(format!(
                "a quarter bridge instead of the one given ({} times)",
                rounded(times, 3)
            ));
        }
        if self.stand.recorder.input_resistance_ohm.is_none() {
            causes.push("a recorder whose input resistance loads the bridge".to_owned());
        } else {
            causes.push(format!(
                "more load on the bridge than the {} times accounted for",
                rounded(1.0 / loading, 4)
            ));
        }
        causes.push("an end of the beam that is restrained against rotation".to_owned());
        Some(format!(
            "measured is {} times predicted; possible causes, alone or together: {}; the constants cannot distinguish \
             them",
            rounded(factor, 3),
            enumeration(&causes, "or")
        ))
    }
}

/// An estimate derived from others of the drawing, if all of them are available.
fn derive(
    stand: &Stand,
    kind: Kind,
    inputs: &[Option<&Estimate>],
    f: impl Fn(&[f64]) -> f64,
) -> Result<Option<Estimate>, Failure> {
    let Some(inputs) = inputs.iter().copied().collect::<Option<Vec<_>>>() else {
        return Ok(None);
    };
    let derived = Estimate::derive(kind, "drawing", &inputs, f);
    let derived = derived.map_err(|error| stand.failed(ErrorCode::InvalidStand, error))?;
    Ok(Some(derived))
}

impl Stiffness {
    fn of(beam: &BeamDrawing) -> Self {
        let radius = beam.radius.value();
        let parts = beam.full.compliance();
        let mut total = parts.bending_m_per_n;
        let mut refined = Vec::new();
        for (effect, more) in [
            ("shear of the beam", parts.shear_m_per_n),
            (
                "the smaller section of its thread",
                parts.reduced_sections_m_per_n,
            ),
            ("rotation of its clamp", parts.clamp_m_per_n),
        ] {
            if more > 0.0 {
                total += more;
                refined.push((effect, radius * radius / total));
            }
        }
        Self {
            slender: beam.slender_stiffness.clone(),
            refined,
        }
    }
}

impl Measured {
    fn of(stand: &Stand) -> Result<Self, Failure> {
        let Some(mechanics) = &stand.mechanics else {
            return Ok(Self::default());
        };
        match &mechanics.given {
            Given::Constants {
                inertia,
                damping,
                stiffness,
            } => {
                let inputs = [inertia, damping, stiffness];
                let derived = |kind, f: fn(&SecondOrder) -> f64| {
                    Estimate::derive(kind, "inertia, damping and stiffness", &inputs, |x| {
                        SecondOrder::new(x[0], x[1], x[2]).map_or(f64::NAN, |stand| f(&stand))
                    })
                    .map_err(|error| stand.failed(ErrorCode::InvalidStand, error))
                };
                Ok(Self {
                    inertia: Some(inertia.clone()),
                    damping: Some(damping.clone()),
                    stiffness: Some(stiffness.clone()),
                    natural_frequency: Some(derived(
                        Kind::Frequency,
                        SecondOrder::natural_frequency_hz,
                    )?),
                    damping_ratio: Some(derived(Kind::Ratio, SecondOrder::damping_ratio)?),
                })
            }
            Given::Modal {
                natural_frequency,
                damping_ratio,
            } => Ok(Self {
                natural_frequency: Some(natural_frequency.clone()),
                damping_ratio: Some(damping_ratio.clone()),
                ..Self::default()
            }),
            // Constants of one inertia on one spring have no counterpart with several modes.
            Given::Modes(_) => Ok(Self::default()),
        }
    }
}

fn constant(
    name: &'static str,
    predicted: Option<&Estimate>,
    measured: &Option<Estimate>,
    kind: Kind,
    units: UnitSystem,
) -> PredictedConstant {
    let printed = |e: &Estimate| {
        let std = e
            .std_uncertainty()
            .map(|std| kind.difference_to(units, std));
        Estimate::of(kind.unit(units), kind.to(units, e.value()), std)
            .with_source(e.source().to_owned())
    };
    let (predicted, measured) = (predicted.map(printed), measured.as_ref().map(printed));
    PredictedConstant::between(
        name,
        predicted.as_ref(),
        measured.as_ref(),
        kind.unit(units),
    )
}

fn damping_note(damping: &PredictedConstant) -> Option<String> {
    let ratio = damping.predicted? / damping.measured?;
    (ratio < FAR_TOO_SMALL).then(|| {
        format!(
            "the friction slope explains only {} % of the measured damping; the rest is not in the drawing and is most \
             likely dissipated in the beam and its joints",
            rounded(100.0 * ratio, 2)
        )
    })
}
