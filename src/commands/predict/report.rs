//! Printed comparison of the constants from a drawing with the measured ones.

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_model::Estimate;

use crate::print::{Report, columns, rounded, with_std};

/// Constants of a stand that follow from its drawing.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(in crate::commands) struct PredictReport {
    /// Path of the stand file.
    pub(super) stand: String,
    /// The constants, beside the measured ones.
    pub(super) constants: Vec<PredictedConstant>,
}

/// A constant from the drawing, beside the measured one.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(super) struct PredictedConstant {
    /// Name of the constant.
    pub(super) name: &'static str,
    /// Unit of the values.
    pub(super) unit: String,
    /// From the drawing, by the basic theory; `null` if not available from it.
    pub(super) predicted: Option<f64>,
    /// Standard uncertainty of `predicted`, from the uncertainties of the drawing; `null` if unknown.
    pub(super) predicted_std: Option<f64>,
    /// As measured; `null` if the stand file does not give it.
    pub(super) measured: Option<f64>,
    /// Standard uncertainty of `measured`; `null` if unknown.
    pub(super) measured_std: Option<f64>,
    /// Where the measured value comes from, as the stand file says.
    pub(super) measured_source: Option<String>,
    /// `100 (predicted − measured) / measured`.
    pub(super) residual_percent: Option<f64>,
    /// Part of the model that explains at least half of the residual; `null` if none does.
    pub(super) explained_by: Option<String>,
    /// Theory by which `predicted` follows.
    pub(super) by: &'static str,
    /// The prediction as each effect of the drawing is added in turn.
    pub(super) refinements: Vec<Refinement>,
    /// Further remarks on the residual.
    pub(super) note: Option<String>,
}

/// The prediction with one more effect.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(super) struct Refinement {
    /// The effect.
    pub(super) effect: &'static str,
    /// The prediction with this effect and the ones before it.
    pub(super) predicted: f64,
    /// The residual that is left.
    pub(super) residual_percent: Option<f64>,
}

/// `100 (predicted − measured) / measured`.
pub(super) fn residual_percent(predicted: Option<f64>, measured: Option<f64>) -> Option<f64> {
    Some(100.0 * (predicted? - measured?) / measured?).filter(|r| r.is_finite())
}

impl Report for PredictReport {
    const SCHEMA: &'static str = "torqcomp.predict/1";

    fn text(&self) -> String {
        let mut rows = vec![
            [
                "constant",
                "unit",
                "predicted",
                "measured",
                "residual %",
                "explained by",
            ]
            .map(str::to_owned)
            .to_vec(),
        ];
        let mut notes = String::new();
        for constant in &self.constants {
            rows.push(constant.cells());
            rows.extend(constant.refinements.iter().map(|r| r.cells(constant)));
            if let Some(note) = &constant.note {
                notes.push_str(&format!("{}: {note}\n", constant.name));
            }
        }
        let table = columns(&rows);
        if notes.is_empty() {
            table
        } else {
            format!("{table}\n{notes}")
        }
    }
}

fn cell(value: Option<f64>, std: Option<f64>) -> String {
    match (value, std) {
        (None, _) => "-".to_owned(),
        (Some(value), None) => rounded(value, 4),
        (Some(value), Some(std)) => with_std(value, std),
    }
}

fn percent(value: Option<f64>) -> String {
    // A prediction that misses nearly everything must not be rounded to zero.
    match value {
        None => "-".to_owned(),
        Some(v) if (v.abs() - 100.0).abs() < 0.05 => format!("{v:+.4}"),
        Some(v) => format!("{v:+.1}"),
    }
}

impl PredictedConstant {
    /// A predicted and a measured number, both in the printed unit.
    pub(super) fn between(
        name: &'static str,
        predicted: Option<&Estimate>,
        measured: Option<&Estimate>,
        unit: &str,
    ) -> Self {
        let (value, std) = (Estimate::value, Estimate::std_uncertainty);
        let residual = residual_percent(predicted.map(value), measured.map(value));
        Self {
            name,
            unit: unit.to_owned(),
            predicted: predicted.map(value),
            predicted_std: predicted.and_then(std),
            measured: measured.map(value),
            measured_std: measured.and_then(std),
            measured_source: measured.map(|m| m.source().to_owned()),
            residual_percent: residual,
            explained_by: None,
            by: "",
            refinements: Vec::new(),
            note: None,
        }
    }

    fn cells(&self) -> Vec<String> {
        vec![
            self.name.to_owned(),
            self.unit.clone(),
            cell(self.predicted, self.predicted_std),
            cell(self.measured, self.measured_std),
            percent(self.residual_percent),
            self.explained_by.clone().unwrap_or_else(|| "-".to_owned()),
        ]
    }
}

impl Refinement {
    fn cells(&self, constant: &PredictedConstant) -> Vec<String> {
        vec![
            format!("  with {}", self.effect),
            constant.unit.clone(),
            cell(Some(self.predicted), None),
            String::new(),
            percent(self.residual_percent),
            String::new(),
        ]
    }
}
