//! Check of a diagnosis against running records, in which the torque is unknown: the stand's resonance in use, and the
//! lines of a steady speed. Nothing is fitted to them but frequency and damping ratio of that resonance.

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::rms;
use torqcomp_model::{Estimate, Mode};

use super::fit::FittedModel;
use super::operation::{Hidden, OperatingResonance, resonance, steady_lines};
use super::residual_tests::without_mean;
use super::result::Diagnosis;
use crate::print::{relative, with_std};
use crate::warning::{Warning, WarningCode};

/// A record of the measured quantity alone, in the unit of the diagnosis.
pub struct RunningRecord {
    pub source: String,
    pub measured: Vec<f64>,
    pub rate_hz: f64,
}

/// Reported difference of natural frequency or damping ratio: in standard uncertainties, and the largest error of a
/// torque it causes.
const DIFFER: (f64, f64) = (3.0, 0.02);
/// Frequencies at which that error is looked for, up to this multiple of the natural frequency, which is one of them.
const LOOKED_AT: usize = 1500;
const UP_TO: f64 = 1.5;

/// What a running record shows.
#[derive(Debug, Serialize, JsonSchema)]
pub struct RunningCheck {
    /// Path of the file.
    pub source: String,
    /// Duration in s.
    pub duration_s: f64,
    /// Rms about the mean, in the unit of `error`.
    pub rms: f64,
    /// Natural frequency of the stand in use; `null` if the record does not show it.
    pub natural_frequency: Option<Estimate>,
    /// Damping ratio of the stand in use; `null` if the record does not show it.
    pub damping_ratio: Option<Estimate>,
    /// Range in Hz from which both follow.
    pub range_hz: Option<[f64; 2]>,
    /// Why the record does not show the resonance; `null` if it does.
    pub hidden: Option<String>,
    /// The plain stand compared with the stand in use; `null` if the record does not show the resonance.
    pub before: Option<ModeDifference>,
    /// The stand with the accepted effects, at small motions, compared with the stand in use; `null` if the record does
    /// not show the resonance.
    pub after: Option<ModeDifference>,
    /// The 12 strongest lines of a steady speed.
    pub lines: Vec<RunningLine>,
}

/// A line of a steady speed.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct RunningLine {
    /// Frequency in Hz.
    pub frequency_hz: f64,
    /// Amplitude in the unit of `error`.
    pub amplitude: f64,
}

/// A model's resonance compared with that in use.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct ModeDifference {
    /// Natural frequency of the model over that in use, minus 1.
    pub natural_frequency: f64,
    /// Damping ratio of the model over that in use, minus 1.
    pub damping_ratio: f64,
    /// Largest relative error of a torque compensated with this resonance, up to 1.5 times the natural frequency; of a
    /// stand with several modes, that of the first alone.
    pub torque: f64,
}

impl ModeDifference {
    fn of(model: &Mode, in_use: &Mode) -> Self {
        let step = UP_TO * in_use.omega_rad_s / LOOKED_AT as f64;
        let omega = (1..=LOOKED_AT).map(|k| k as f64 * step);
        let error = omega.map(|omega| (model.inverse(omega) / in_use.inverse(omega) - 1.0).norm());
        Self {
            natural_frequency: model.omega_rad_s / in_use.omega_rad_s - 1.0,
            damping_ratio: model.damping_ratio / in_use.damping_ratio - 1.0,
            torque: error.fold(0.0, f64::max),
        }
    }
}

impl Diagnosis {
    /// Compares the stand that was found with running records.
    pub fn check_running(&mut self, records: &[RunningRecord]) {
        for record in records {
            let (check, warning) = self.checked(record);
            self.running.push(check);
            self.warnings.extend(warning);
        }
    }

    fn checked(&self, record: &RunningRecord) -> (RunningCheck, Option<Warning>) {
        let fitted: &FittedModel = &self.after.fitted;
        let expected = fitted.free;
        let others = self.context().terms().modes;
        let others: Vec<f64> = others.iter().map(Mode::natural_frequency_hz).collect();
        let found = match self.context().held {
            Some(_) => Err(Hidden::None),
            None => resonance(&record.measured, record.rate_hz, &expected, &others),
        };
        let found = found.map_err(Hidden::text);
        let warning = match &found {
            Ok(found) => self.differs(record, found),
            Err(hidden) => Some(WarningCode::ResonanceHidden.warning(format!(
                "{} does not show the resonance of the stand in use: {hidden}",
                record.source
            ))),
        };
        let unit = self.context().units.per_printed;
        let hidden = found.as_ref().err().cloned();
        let found = found.ok();
        let lines = steady_lines(&record.measured, record.rate_hz, &expected, found.as_ref());
        let lines = lines
            .into_iter()
            .map(|[frequency_hz, amplitude]| RunningLine {
                frequency_hz,
                amplitude: amplitude / unit,
            });
        let against = |model: &FittedModel| {
            let in_use = found.as_ref()?.mode();
            Some(ModeDifference::of(&model.free, &in_use))
        };
        let check = RunningCheck {
            source: record.source.clone(),
            duration_s: record.measured.len() as f64 / record.rate_hz,
            rms: rms(&without_mean(&record.measured)) / unit,
            hidden,
            before: against(&self.before.fitted),
            after: against(fitted),
            lines: lines.collect(),
            range_hz: found.as_ref().map(|found| found.range_hz),
            natural_frequency: found.as_ref().map(|f| f.natural_frequency.clone()),
            damping_ratio: found.map(|f| f.damping_ratio),
        };
        (check, warning)
    }

    /// Warns that the stand in use is another one. Effects may change frequency and damping with the size of the motion,
    /// so that a stand with effects is not compared.
    fn differs(&self, record: &RunningRecord, found: &OperatingResonance) -> Option<Warning> {
        let fitted = &self.after.fitted;
        if !fitted.structure.effects.is_empty() {
            return None;
        }
        let [frequency, ratio, _] = self.after.constants();
        let is_apart = |of_model: &Estimate, in_use: &Estimate| {
            let stds = of_model.std_uncertainty().zip(in_use.std_uncertainty());
            let apart = (of_model.value() - in_use.value()).abs();
            stds.is_some_and(|(one, other)| apart > DIFFER.0 * one.hypot(other))
        };
        // Only what is known to differ counts.
        let mut known = found.mode();
        if is_apart(&frequency, &found.natural_frequency) {
            known.omega_rad_s = fitted.free.omega_rad_s;
        }
        if is_apart(&ratio, &found.damping_ratio) {
            known.damping_ratio = fitted.free.damping_ratio;
        }
        let error = ModeDifference::of(&known, &found.mode()).torque;
        let shown = |estimate: &Estimate| {
            with_std(estimate.value(), estimate.std_uncertainty().unwrap_or(0.0))
        };
        (error > DIFFER.1).then(|| {
            WarningCode::RunningDiffers.warning(format!(
                "{}: in use, the stand has a natural frequency of {} Hz and a damping ratio of {}; the fitted \
                 stand has {} Hz and {}. A torque compensated with the fitted stand is off by up to {} near the \
                 resonance. Possible causes: clamping, temperature, mounted parts or size of the motion differ \
                 (fit records taken under the conditions of use), or an order or another peak of the torque lies \
                 there (compare with a record at another speed)",
                record.source,
                shown(&found.natural_frequency),
                shown(&found.damping_ratio),
                shown(&frequency),
                shown(&ratio),
                relative(error, 2),
            ))
        })
    }
}
