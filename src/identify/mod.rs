//! Constants of a stand from its records, with signal processing from `dsp` and fits from `model`.

pub mod decay;
mod hum;
mod mode;
mod motion;
mod overtone;
mod present;
pub mod response;
pub mod runup;
pub mod static_load;

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::rms;
use torqcomp_model::{Covariance, Estimate, Estimates, Kind, Measure, UnitSystem};

use crate::chart::Chart;
use crate::warning::Warning;
pub use mode::{KnownConstant, ModalPole, Pole};
pub use motion::Motion;
pub(crate) use motion::gravity_hint;

/// A number with a stable name, such as `inertia`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct NamedEstimate {
    /// Name of the parameter.
    pub name: String,
    /// Value, standard uncertainty and unit.
    #[serde(flatten)]
    pub estimate: Estimate,
}

/// Kinds whose unit depends on the unit system.
const CONVERTED: [Kind; 9] = [
    Kind::Inertia,
    Kind::AngularDamping,
    Kind::AngularStiffness,
    Kind::Torque,
    Kind::Force,
    Kind::Mass,
    Kind::TorquePerVolt,
    Kind::Length,
    Kind::Frequency,
];

impl NamedEstimate {
    fn new(
        name: impl Into<String>,
        unit: impl Into<Measure>,
        value: f64,
        std: Option<f64>,
    ) -> Self {
        Self {
            name: name.into(),
            estimate: Estimate::of(unit, value, std.filter(|std| std.is_finite())),
        }
    }

    /// Value in the constant's unit.
    pub fn value(&self) -> f64 {
        self.estimate.value()
    }

    /// Standard uncertainty; `None` if not identifiable from the data.
    pub fn std(&self) -> Option<f64> {
        self.estimate.std_uncertainty()
    }

    /// Converts from SI units.
    fn convert(&mut self, units: UnitSystem) {
        let is_of = |kind: &&Kind| kind.unit(UnitSystem::Si) == self.estimate.unit();
        if let Some(kind) = CONVERTED.iter().find(is_of) {
            let factor = kind.difference_to(units, 1.0);
            let std = self.std().map(|std| std * factor);
            self.estimate = Estimate::of(kind.unit(units), self.value() * factor, std);
        }
    }
}

/// Named estimates with the covariance of their errors.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedEstimates {
    /// The constants.
    pub list: Vec<NamedEstimate>,
    covariance: Covariance,
}

impl NamedEstimates {
    /// The numbers with their names and units.
    fn new(names: &[(&str, &'static str)], numbers: &Estimates) -> Self {
        let constant = |(i, (name, unit)): (usize, &(&str, &'static str))| {
            NamedEstimate::new(
                *name,
                *unit,
                numbers.values()[i],
                numbers.covariance().std(i),
            )
        };
        Self {
            list: names.iter().enumerate().map(constant).collect(),
            covariance: numbers.covariance().clone(),
        }
    }

    /// Those with these names, in this order, for mode `place` of `count`; the names are numbered if there are several
    /// modes.
    pub(crate) fn of_mode(mut self, (place, count): (usize, usize), names: &[&str]) -> Self {
        let prefix = match count {
            1 => String::new(),
            _ => format!("mode_{}_", place + 1),
        };
        let index = |name: &&str| self.list.iter().position(|c| c.name == **name);
        let places: Vec<usize> = names.iter().filter_map(index).collect();
        let renamed = |i: &usize| NamedEstimate {
            name: format!("{prefix}{}", self.list[*i].name),
            ..self.list[*i].clone()
        };
        self.list = places.iter().map(renamed).collect();
        self.covariance = self.covariance.select(&places);
        self
    }

    /// Correlation coefficient of two of them, by index.
    pub(crate) fn correlation(&self, i: usize, j: usize) -> Option<f64> {
        self.covariance.correlation(i, j)
    }

    /// Pairs with a correlation of at least [`STRONG`].
    pub(crate) fn correlations(&self) -> Vec<Correlation> {
        let names: Vec<&str> = self.list.iter().map(|c| c.name.as_str()).collect();
        correlations(&names, &self.covariance)
    }
}

/// How well a model follows the data.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FitQuality {
    /// Root mean square of the residual, in `unit`.
    pub rms: f64,
    /// Unit of `rms`.
    pub unit: String,
    /// `rms` over the root mean square of the data.
    pub relative: f64,
}

/// Result of another method on the same record.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Comparison {
    /// Name of the method.
    pub method: String,
    /// Parameters by this method.
    pub parameters: Vec<NamedEstimate>,
    /// How well this method follows the data; `null` if it does not predict them.
    pub fit: Option<FitQuality>,
}

/// Two parameters that these data hardly separate.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Correlation {
    /// Name of one parameter.
    pub first: String,
    /// Name of the other parameter.
    pub second: String,
    /// Correlation coefficient.
    pub coefficient: f64,
}

/// Smallest correlation that is reported.
const STRONG: f64 = 0.95;

/// Pairs with a correlation of at least [`STRONG`].
fn correlations(names: &[&str], covariance: &Covariance) -> Vec<Correlation> {
    let pairs = (0..names.len()).flat_map(|i| (i + 1..names.len()).map(move |j| (i, j)));
    let strong = |(i, j)| {
        let coefficient = covariance.correlation(i, j)?;
        (coefficient.abs() >= STRONG).then(|| Correlation {
            first: names[i].to_owned(),
            second: names[j].to_owned(),
            coefficient,
        })
    };
    pairs.filter_map(strong).collect()
}

/// Names of the numbers of one of several modes, in stand files and reports.
pub(crate) const MODE_NUMBERS: [&str; 4] = [
    "natural_frequency",
    "damping_ratio",
    "residue",
    "quadrature",
];

/// Contribution of each mode to the response of a stand, in the form of a stand file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ModalShares {
    /// [`MODE_NUMBERS`] of each mode.
    pub modes: Vec<NamedEstimates>,
    /// Static gain, measured per applied quantity; that of the displacement, if a derivative was
    /// measured.
    pub gain: Estimate,
}

/// Stand constants identified from records.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Identification {
    /// `decay`, `response`, `runup` or `static`.
    pub test: &'static str,
    /// Files that were read.
    pub inputs: Vec<String>,
    /// Samples read.
    pub samples: usize,
    /// Sampling rate, in Hz; `null` for a table of loads.
    pub rate_hz: Option<f64>,
    /// Standard uncertainty of the rate by the time stamps, in Hz; `null` if the rate does not come from stamps.
    pub rate_std_hz: Option<f64>,
    /// The identified constants, the main ones first.
    pub parameters: Vec<NamedEstimate>,
    /// How well the model follows the data; `null` if it does not predict them.
    pub fit: Option<FitQuality>,
    /// Results of other methods.
    pub comparisons: Vec<Comparison>,
    /// Parameters that these data hardly separate.
    pub correlations: Vec<Correlation>,
    /// Laws of damping, the best first (`decay` with one mode).
    pub laws: Vec<decay::LawFit>,
    /// Terms of the calibration standards (`static`).
    pub terms: Vec<static_load::Term>,
    /// Mean readings at each load (`static`), for a calibration curve.
    #[serde(skip)]
    pub steps: Vec<static_load::CalibrationStep>,
    /// Relative hold-out error with 0, 1, 2, … modes (`response`); `null` where it was not tried.
    #[schemars(with = "Vec<Option<f64>>")]
    pub held_out_errors: Vec<f64>,
    /// The method, a sentence each.
    pub method: Vec<String>,
    /// Warnings, each with a stable code.
    pub warnings: Vec<Warning>,
    /// Data, fit and residual, for the HTML page.
    #[serde(skip)]
    pub(crate) charts: Vec<Chart>,
    /// The modes (`decay`: by falling energy; `response`: by rising frequency).
    #[serde(skip)]
    pub modes: Vec<ModalPole>,
    /// What each mode has in the response, by rising frequency (`response` with several modes for a stand file).
    #[serde(skip)]
    pub(crate) shares: Option<ModalShares>,
}

impl Identification {
    fn new(test: &'static str) -> Self {
        Self {
            test,
            ..Self::default()
        }
    }

    /// A parameter by its name.
    pub fn get(&self, name: &str) -> Option<&NamedEstimate> {
        self.parameters.iter().find(|c| c.name == name)
    }

    /// Adds a warning.
    pub(crate) fn warn(&mut self, warning: Warning) {
        self.warnings.push(warning);
    }

    /// Adds constants and their strong correlations.
    pub(crate) fn add(&mut self, constants: NamedEstimates) {
        self.correlations.extend(constants.correlations());
        self.parameters.extend(constants.list);
    }

    /// Adds a unit to the axes of charts with this label.
    pub(crate) fn label_charts(&mut self, label: &str, unit: &str) {
        let unit = match unit {
            "" => "unit not given",
            unit => unit,
        };
        for chart in self.charts.iter_mut().filter(|c| c.y_label == label) {
            chart.y_label = format!("{label}, {unit}");
        }
    }

    /// Converts all parameters from SI units.
    pub(crate) fn convert(&mut self, units: UnitSystem) {
        let compared = self.comparisons.iter_mut().flat_map(|c| &mut c.parameters);
        let all = self.parameters.iter_mut().chain(compared);
        all.for_each(|constant| constant.convert(units));
    }
}
