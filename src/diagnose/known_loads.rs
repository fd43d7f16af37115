//! Check of a diagnosis against quasi-static known loads: the gain, which a free decay does not show, and the static
//! nonlinearity that the effects imply. No effect is fitted to them.

use schemars::JsonSchema;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use torqcomp_dsp::rms;
use torqcomp_model::fit::{FitError, Options, Parameter, minimize};
use torqcomp_model::{Chain, Estimate};

use super::fit::FittedModel;
use super::result::Diagnosis;
use crate::failure::{ErrorCode, Failure};
use crate::print::rounded;
use crate::stand::gain_differs;
use crate::warning::{Warning, WarningCode};

/// Loads and readings, in SI units, in the order of measurement.
pub struct KnownLoads {
    pub source: String,
    pub applied: Vec<f64>,
    pub measured: Vec<f64>,
}

/// Maximum number of loads of a file that are simulated; of more, adjacent ones are averaged.
const MOST: usize = 256;
/// Minimum number of different loads.
const FEWEST: usize = 3;
/// Significance level of the test that one of two models scatters more.
const BY_CHANCE: f64 = 0.01;

/// The gain that known loads are compared with, and the advice if theirs differs.
const OF_KNOWN: &str =
    "from stand file, units or other records: check the calibration and the lever arm of the loads";

/// What known loads say.
#[derive(Debug, Serialize, JsonSchema)]
pub struct LoadCheck {
    /// The static gain by the loads, with the effects that were found.
    pub gain: f64,
    /// Standard uncertainty of `gain`.
    pub gain_std: Option<f64>,
    /// Unit of the gain.
    pub gain_unit: String,
    /// Unit of the rms errors.
    pub unit: String,
    /// Each file.
    pub files: Vec<CheckedLoads>,
    /// The gain in SI units.
    #[serde(skip)]
    pub gain_si: (f64, Option<f64>),
}

/// The errors of two models under the loads of a file; gain and zero are fitted for both.
#[derive(Debug, Serialize, JsonSchema)]
pub struct CheckedLoads {
    /// Path of the file.
    pub source: String,
    /// Loads that count.
    pub loads: usize,
    /// Rms error of the plain stand, which is a straight line.
    pub before_rms: f64,
    /// Rms error with the accepted effects.
    pub after_rms: f64,
}

impl KnownLoads {
    /// Loads and readings in SI units.
    ///
    /// # Errors
    /// If there are fewer than three different loads.
    pub fn new(source: String, applied: &[f64], measured: &[f64]) -> Result<Self, Failure> {
        let mut different = applied.to_vec();
        different.sort_by(f64::total_cmp);
        different.dedup();
        if different.len() < FEWEST {
            return Err(ErrorCode::TooFewSamples
                .failed(format_args!(
                    "{} different loads are too few; apply at least {FEWEST}, including no load",
                    different.len()
                ))
                .at(&source));
        }
        let together = applied.len().div_ceil(MOST);
        let means = |values: &[f64]| -> Vec<f64> {
            let parts = values.chunks(together);
            parts
                .map(|part| part.iter().sum::<f64>() / part.len() as f64)
                .collect()
        };
        Ok(Self {
            source,
            applied: means(applied),
            measured: means(measured),
        })
    }
}

/// The gain from the loads in all files, and the RMS residual of each.
struct LoadFit {
    gain: (f64, Option<f64>),
    rms: Vec<f64>,
}

impl LoadFit {
    /// Fits the gain and the zero of each file to a chain with a gain of 1.
    fn of(loads: &[KnownLoads], chain: &Chain) -> Result<Self, FitError> {
        let slope = slope(loads);
        let left = |k: usize, values: &[f64]| -> Vec<f64> {
            let pushed: Vec<f64> = loads[k]
                .applied
                .iter()
                .map(|u| u * values[0] * slope)
                .collect();
            let pairs = loads[k]
                .measured
                .iter()
                .zip(chain.under_slow_loads(&pushed));
            pairs.map(|(y, x)| y - x - values[k + 1]).collect()
        };
        let residuals = |values: &[f64], out: &mut Vec<f64>| {
            (0..loads.len()).for_each(|k| out.extend(left(k, values)));
            match out.iter().all(|r| r.is_finite()) {
                true => Ok(()),
                false => Err(FitError::Model("the motion diverges".to_owned())),
            }
        };
        let zero = |loads: &KnownLoads| {
            let size = loads.measured.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
            Parameter::new("zero", loads.measured[0]).scaled(size.max(f64::MIN_POSITIVE))
        };
        let gain = Parameter::new("gain", 1.0);
        let parameters: Vec<Parameter> = std::iter::once(gain)
            .chain(loads.iter().map(zero))
            .collect();
        let found = minimize(&residuals, &parameters, &Options::default())?;
        let rms = (0..loads.len()).map(|k| rms(&left(k, &found.values)));
        Ok(Self {
            rms: rms.collect(),
            gain: (
                found.values[0] * slope,
                found.std[0].map(|std| std * slope.abs()),
            ),
        })
    }

    /// The same for the stand of a model; the uncertainty of the gain includes that of the effects' parameters.
    fn of_model(loads: &[KnownLoads], fitted: &FittedModel) -> Result<Self, FitError> {
        let with = |values: &[f64]| {
            let (mut chain, _) = fitted.structure.model(values);
            chain.gain = 1.0;
            Self::of(loads, &chain)
        };
        let mut found = with(&fitted.values)?;
        let (gain, own) = found.gain;
        let own = own.ok_or_else(|| FitError::Model("any gain fits".to_owned()))?;
        let mut variance = own * own;
        for k in fitted.structure.context.plain_count()..fitted.values.len() {
            if let Some(std) = fitted.std[k] {
                let mut moved = fitted.values.clone();
                moved[k] += std;
                variance += (with(&moved)?.gain.0 - gain).powi(2);
            }
        }
        found.gain.1 = Some(variance.sqrt());
        Ok(found)
    }

    /// Sum of squares over all files.
    fn sum(&self, loads: &[KnownLoads]) -> f64 {
        let each = self.rms.iter().zip(loads);
        each.map(|(rms, loads)| rms * rms * loads.applied.len() as f64)
            .sum()
    }
}

/// Common slope of the straight lines through the loads of all files.
fn slope(loads: &[KnownLoads]) -> f64 {
    let (mut products, mut squares) = (0.0, 0.0);
    for file in loads {
        let count = file.applied.len() as f64;
        let [u0, y0] = [&file.applied, &file.measured].map(|v| v.iter().sum::<f64>() / count);
        for (u, y) in file.applied.iter().zip(&file.measured) {
            products += (u - u0) * (y - y0);
            squares += (u - u0).powi(2);
        }
    }
    products / squares
}

impl Diagnosis {
    /// Checks known loads against the stand that was found; `declared_gain` is that of the stand file or of the units,
    /// in SI.
    ///
    /// # Errors
    /// If the stand has no static reading, or does not follow the loads.
    pub fn check_loads(
        &mut self,
        loads: &[KnownLoads],
        declared_gain: Option<Estimate>,
    ) -> Result<(), Failure> {
        if loads.is_empty() {
            return Ok(());
        }
        if self.context().held.is_some() {
            return Err(ErrorCode::UnsuitableRecord.failed(
                "--static does not apply: the body moves freely and does not come to rest under a constant load",
            ));
        }
        let follow = |fitted: &FittedModel| {
            LoadFit::of_model(loads, fitted).map_err(|error| {
                ErrorCode::NotIdentifiable.failed(format_args!(
                    "the loads of --static do not determine a gain ({error}): the reading does not follow them, or \
                     the recorded quantity does not show constant loads"
                ))
                .at(&loads[0].source)
            })
        };
        let (before, after) = (follow(&self.before.fitted)?, follow(&self.after.fitted)?);
        let context = self.context();
        let (gain_unit, per_si) = context.units.gain();
        let printed = |(gain, std): (f64, Option<f64>)| (gain * per_si, std.map(|s| s * per_si));
        let (gain, gain_std) = printed(after.gain);
        let known = match context.gain_is_free {
            true => Some(self.after.constants()[2].clone()),
            false => declared_gain,
        };
        let known = known.map(|known| printed((known.value(), known.std_uncertainty())));
        let found = ("the known loads give", "static gain", gain_unit.as_str());
        let differ = known.and_then(|known| gain_differs(found, (gain, gain_std), known, OF_KNOWN));
        let contradicted = (!self.effects.is_empty())
            .then(|| contradicted(loads, &before, &after, &self.effects))
            .flatten();
        let unit = context.units.per_printed;
        let files = loads.iter().zip(before.rms.iter().zip(&after.rms));
        let files = files.map(|(file, (before, after))| CheckedLoads {
            source: file.source.clone(),
            loads: file.applied.len(),
            before_rms: before / unit,
            after_rms: after / unit,
        });
        self.known_loads = Some(LoadCheck {
            files: files.collect(),
            gain,
            gain_std,
            unit: context.units.printed(),
            gain_unit,
            gain_si: after.gain,
        });
        self.warnings.extend(differ.into_iter().chain(contradicted));
        Ok(())
    }
}

/// Warns that the loads contradict the effects.
fn contradicted(
    loads: &[KnownLoads],
    before: &LoadFit,
    after: &LoadFit,
    effects: &[&str],
) -> Option<Warning> {
    let count: usize = loads.iter().map(|file| file.applied.len()).sum();
    let freedom = count.checked_sub(loads.len() + 1).filter(|n| *n > 0)? as f64;
    let ratio = after.sum(loads) / before.sum(loads);
    let law = FisherSnedecor::new(freedom, freedom).ok()?;
    (ratio.is_finite() && law.sf(ratio) < BY_CHANCE).then(|| {
        WarningCode::LoadsContradictEffects.warning(format!(
            "the known loads do not confirm {}: the error under the loads is {} times that of a straight line",
            effects.join(" and "),
            rounded(ratio.sqrt(), 3)
        ))
    })
}
