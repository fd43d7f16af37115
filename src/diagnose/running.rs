//! Check of a diagnosis against running records, in which the torque is unknown: the stand's resonance in use, and the
//! lines of a steady speed. Nothing is fitted to them but frequency and damping ratio of that resonance.

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::rms;
use torqcomp_model::{Estimate, Mode};

use super::fit::FittedModel;
use super::operation::{OperatingResonance, resonance};
use super::residual_tests::without_mean;
use super::result::Diagnosis;
use super::spectra::{SpectralLine, prominent_lines};
use crate::failure::{ErrorCode, Failure};
use crate::print::{relative, rounded, with_std};
use crate::warning::Warning;

/// A record of the measured quantity alone, in the unit of the diagnosis.
pub struct RunningRecord {
    pub source: String,
    pub measured: Vec<f64>,
    pub rate_hz: f64,
}

/// Maximum number of lines reported, and of samples in which they are searched for.
const MOST_LINES: usize = 12;
const LINES_OVER: usize = 1 << 18;
/// Reported difference of natural frequency or damping ratio: in standard uncertainties, and the largest error of a
/// torque it causes.
const DIFFER: (f64, f64) = (3.0, 0.02);
/// Frequencies at which that error is looked for, up to this multiple of the natural frequency.
const LOOKED_AT: usize = 1000;
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
    /// The plain stand compared with the stand in use.
    pub before: Option<ModeDifference>,
    /// The stand with the accepted effects, at small motions, compared with the stand in use.
    pub after: Option<ModeDifference>,
    /// The strongest steady lines.
    pub lines: Vec<SpectralLine>,
}

/// A model's resonance compared with that in use.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct ModeDifference {
    /// Natural frequency of the model over that in use, minus 1.
    pub natural_frequency: f64,
    /// Damping ratio of the model over that in use, minus 1.
    pub damping_ratio: f64,
    /// Largest relative error of a torque compensated with the model, up to 1.5 times the natural frequency.
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
    ///
    /// # Errors
    /// If the body has no resonance.
    pub fn check_running(&mut self, records: &[RunningRecord]) -> Result<(), Failure> {
        if records.is_empty() {
            return Ok(());
        }
        if self.context().held.is_some() {
            return Err(Failure::failed(
                ErrorCode::UnsuitableRecord,
                "--running does not apply: the body moves freely and has no resonance to look for",
            ));
        }
        for record in records {
            let (check, warning) = self.checked(record);
            self.running.push(check);
            self.warnings.extend(warning);
        }
        Ok(())
    }

    fn checked(&self, record: &RunningRecord) -> (RunningCheck, Option<Warning>) {
        let fitted: &FittedModel = &self.after.fitted;
        let expected = fitted.free;
        let others = self.context().terms().modes;
        let others: Vec<f64> = others.iter().map(Mode::natural_frequency_hz).collect();
        let found = resonance(&record.measured, record.rate_hz, &expected, &others);
        let warning = match &found {
            Ok(found) => self.differs(record, found),
            Err(hidden) => Some(Warning::new(
                "resonance-hidden",
                format!(
                    "{} does not show the resonance of the stand in use: {}",
                    record.source,
                    hidden.text()
                ),
            )),
        };
        let unit = self.context().units.per_printed;
        let looked_at = &record.measured[..record.measured.len().min(LINES_OVER)];
        let highest_hz = 0.49 * record.rate_hz;
        let lines = prominent_lines(&[looked_at], record.rate_hz, highest_hz, MOST_LINES);
        let hidden = found.as_ref().err().map(|hidden| hidden.text());
        let found = found.ok();
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
            lines: lines.into_iter().map(|line| line.over(unit)).collect(),
            range_hz: found.as_ref().map(|found| found.range_hz),
            natural_frequency: found.as_ref().map(|f| f.natural_frequency.clone()),
            damping_ratio: found.map(|f| f.damping_ratio),
        };
        (check, warning)
    }

    /// Warns that the stand in use is another one.
    fn differs(&self, record: &RunningRecord, found: &OperatingResonance) -> Option<Warning> {
        let free = self.after.fitted.free;
        let [frequency, ratio, _] = self.after.constants();
        let apart = |model: f64, of_model: &Estimate, in_use: &Estimate| {
            let std = [of_model, in_use].map(|e| e.std_uncertainty().unwrap_or(0.0));
            (model - in_use.value()).abs() > DIFFER.0 * std[0].hypot(std[1])
        };
        let natural_hz = free.natural_frequency_hz();
        let difference = ModeDifference::of(&free, &found.mode());
        let is_apart = apart(natural_hz, &frequency, &found.natural_frequency)
            || apart(free.damping_ratio, &ratio, &found.damping_ratio);
        let shown = |estimate: &Estimate| {
            with_std(estimate.value(), estimate.std_uncertainty().unwrap_or(0.0))
        };
        (is_apart && difference.torque > DIFFER.1).then(|| {
            Warning::new(
                "running-differs",
                format!(
                    "{}: in use, the stand has a natural frequency of {} Hz and a damping ratio of {}, the stand found {} \
                     Hz and {}. A torque compensated with the latter is off by up to {} near the resonance: clamping, \
                     temperature, what is mounted or the size of the motion differs; fit records taken as it is used",
                    record.source,
                    shown(&found.natural_frequency),
                    shown(&found.damping_ratio),
                    rounded(natural_hz, 6),
                    rounded(free.damping_ratio, 4),
                    relative(difference.torque, 2),
                ),
            )
        })
    }
}
