//! The report of an identification.

use std::fmt::Write;

use serde::Serialize;
use torqcomp_model::{Kind, UnitSystem};

use super::chart::Chart;
use super::page::Page;
use crate::cli::Units;
use crate::identify::{Comparison, Found, Outcome, Quality};
use crate::print::{columns, rounded, short, value_and_std};
use crate::warning::Warning;

/// Schema of the JSON document.
pub const SCHEMA: &str = "torqcomp.identify/1";

/// Report of an identification.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Schema of this document.
    pub schema: &'static str,
    /// Version of torqcomp.
    pub version: &'static str,
    /// `decay`, `response`, `runup` or `static`.
    pub test: &'static str,
    /// Files that were read.
    pub inputs: Vec<String>,
    /// Samples read.
    pub samples: usize,
    /// Sampling rate, if there is one.
    pub rate_hz: Option<f64>,
    /// What was found, the main numbers first.
    pub parameters: Vec<Parameter>,
    /// How well the model follows the data.
    pub fit: Option<Fit>,
    /// What other methods say.
    pub comparisons: Vec<Other>,
    /// Pairs of parameters that the data tell apart only weakly.
    pub correlations: Vec<Correlation>,
    /// Laws of damping, the best first (`decay` with one mode).
    pub laws: Vec<Law>,
    /// Terms of the calibration standards (`static`).
    pub terms: Vec<Term>,
    /// Relative error on data held out for 0, 1, 2, … modes (`response`).
    pub held_out_errors: Vec<Option<f64>>,
    /// How it was done.
    pub method: Vec<String>,
    /// What should be known.
    pub warnings: Vec<Warning>,
    /// Drawings for the page.
    #[serde(skip)]
    pub charts: Vec<Chart>,
}

/// A number with its standard uncertainty.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// Stable name.
    pub name: String,
    /// Value in the unit.
    pub value: f64,
    /// Standard uncertainty in the unit; `null` if the data tell none.
    pub std: Option<f64>,
    /// Unit; empty for a ratio.
    pub unit: String,
}

/// How well the model follows the data.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fit {
    /// Root mean square of what is left.
    pub rms: f64,
    /// Its unit.
    pub unit: String,
    /// The same over the root mean square of the data.
    pub relative: f64,
}

/// What another method says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Other {
    /// The method.
    pub method: String,
    /// Its numbers.
    pub parameters: Vec<Parameter>,
    /// How well it follows the data, if it says.
    pub fit: Option<Fit>,
}

/// Two parameters that are hard to tell apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Correlation {
    /// The one.
    pub first: String,
    /// The other.
    pub second: String,
    /// Correlation coefficient.
    pub coefficient: f64,
}

/// A law of damping.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Law {
    /// Its name.
    pub law: &'static str,
    /// What it leaves, root mean square.
    pub rms: f64,
    /// Bayesian information criterion: less is better.
    pub criterion: f64,
}

/// A term of a calibration standard.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Term {
    /// Its name.
    pub name: &'static str,
    /// Whose formula it is, and the formula.
    pub formula: &'static str,
    /// Largest value in per cent; `null` where the record does not hold what it takes.
    pub percent: Option<f64>,
}

/// Kinds whose units are translated, by their SI text.
const KINDS: [Kind; 9] = [
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

impl Parameter {
    fn of(found: &Found, units: UnitSystem) -> Self {
        let kind = KINDS
            .iter()
            .find(|kind| kind.unit(UnitSystem::Si) == found.unit);
        let (factor, unit) = match kind {
            Some(kind) => (kind.difference_to(units, 1.0), kind.unit(units).to_owned()),
            None => (1.0, found.unit.clone()),
        };
        Self {
            name: found.name.clone(),
            value: found.value * factor,
            std: found.std.map(|s| s * factor),
            unit,
        }
    }

    fn row(&self) -> Vec<String> {
        let [value, std] = match self.std {
            Some(std) => value_and_std(self.value, std),
            None => [short(self.value), "unknown".to_owned()],
        };
        let relative = self
            .std
            .filter(|_| self.value != 0.0)
            .map_or_else(String::new, |std| {
                format!("{} %", rounded(100.0 * (std / self.value).abs(), 2))
            });
        vec![
            self.name.replace('_', " "),
            value,
            std,
            self.unit.clone(),
            relative,
        ]
    }
}

impl Fit {
    fn of(quality: &Quality) -> Self {
        Self {
            rms: quality.rms,
            unit: quality.unit.clone(),
            relative: quality.relative,
        }
    }
}

impl Report {
    /// A report of an outcome, in the units to be printed.
    #[must_use]
    pub fn new(test: &'static str, inputs: &[&str], outcome: &Outcome, units: Units) -> Self {
        let system = UnitSystem::from(units);
        let all = |found: &[Found]| found.iter().map(|f| Parameter::of(f, system)).collect();
        let other = |c: &Comparison| Other {
            method: c.method.clone(),
            parameters: all(&c.found),
            fit: c.quality.as_ref().map(Fit::of),
        };
        Self {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            test,
            inputs: inputs.iter().map(|i| (*i).to_owned()).collect(),
            samples: 0,
            rate_hz: None,
            parameters: all(&outcome.found),
            fit: outcome.quality.as_ref().map(Fit::of),
            comparisons: outcome.comparisons.iter().map(other).collect(),
            correlations: outcome
                .correlated
                .iter()
                .map(|c| Correlation {
                    first: c.first.clone(),
                    second: c.second.clone(),
                    coefficient: c.coefficient,
                })
                .collect(),
            laws: Vec::new(),
            terms: Vec::new(),
            held_out_errors: Vec::new(),
            method: outcome.method.clone(),
            warnings: outcome.warnings.clone(),
            charts: outcome.charts.clone(),
        }
    }

    /// For people.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = String::new();
        let rate = self
            .rate_hz
            .map_or_else(String::new, |r| format!(" at {} Hz", short(r)));
        let _ = writeln!(
            text,
            "{} test, {}: {} samples{rate}",
            capitalised(self.test),
            self.inputs.join(", "),
            self.samples
        );
        for line in &self.method {
            let _ = writeln!(text, "{line}");
        }
        text.push('\n');
        text.push_str(&table(&self.parameters));
        if let Some(fit) = &self.fit {
            let _ = writeln!(text, "\n{}", left(fit));
        }
        self.say_others(&mut text);
        for pair in &self.correlations {
            let _ = writeln!(text, "\n{}", correlated(pair));
        }
        text
    }

    fn say_others(&self, text: &mut String) {
        for other in &self.comparisons {
            let _ = writeln!(text, "\nFor comparison, {}:\n", other.method);
            text.push_str(&table(&other.parameters));
            if let Some(fit) = &other.fit {
                let _ = writeln!(text, "{}", left(fit));
            }
        }
        if !self.laws.is_empty() {
            let _ = writeln!(text, "\nDamping laws, the best first:\n");
            text.push_str(&columns(&self.law_rows()));
        }
        if !self.terms.is_empty() {
            let _ = writeln!(
                text,
                "\nIn the terms of the standards, largest over the loads:\n"
            );
            for term in &self.terms {
                let value = percent(term.percent);
                let _ = writeln!(text, "{:<20} {value:>10}  {}", term.name, term.formula);
            }
        }
    }

    /// A page for a browser, complete in itself.
    #[must_use]
    pub fn page(&self) -> String {
        let mut page = Page::new(&format!("{} test", capitalised(self.test)));
        let rate = self
            .rate_hz
            .map_or_else(String::new, |r| format!(" at {} Hz", short(r)));
        page.text(&format!(
            "{}: {} samples{rate}",
            self.inputs.join(", "),
            self.samples
        ));
        page.heading("Constants");
        page.table(&rows(&self.parameters));
        if let Some(fit) = &self.fit {
            page.text(&left(fit));
        }
        for warning in &self.warnings {
            page.warning(warning.code, &warning.message);
        }
        if !self.charts.is_empty() {
            page.heading("Data and fit");
        }
        for chart in &self.charts {
            page.chart(chart);
        }
        self.page_of_others(&mut page);
        page.heading("Method");
        for line in &self.method {
            page.text(line);
        }
        page.text(&format!("torqcomp {}", self.version));
        page.html()
    }

    fn page_of_others(&self, page: &mut Page) {
        for other in &self.comparisons {
            page.heading(&format!("For comparison, {}", other.method));
            page.table(&rows(&other.parameters));
            if let Some(fit) = &other.fit {
                page.text(&left(fit));
            }
        }
        for pair in &self.correlations {
            page.text(&correlated(pair));
        }
        if !self.laws.is_empty() {
            page.heading("Damping laws, the best first");
            page.table(&self.law_rows());
        }
        if !self.terms.is_empty() {
            page.heading("In the terms of the standards, largest over the loads");
            let head = ["term", "value", "formula"].map(str::to_owned).to_vec();
            let row = |t: &Term| vec![t.name.to_owned(), percent(t.percent), t.formula.to_owned()];
            let rows: Vec<Vec<String>> = [head]
                .into_iter()
                .chain(self.terms.iter().map(row))
                .collect();
            page.table(&rows);
        }
    }

    fn law_rows(&self) -> Vec<Vec<String>> {
        let head = ["law", "left, rms", "criterion"]
            .map(str::to_owned)
            .to_vec();
        let row = |l: &Law| vec![l.law.to_owned(), rounded(l.rms, 4), rounded(l.criterion, 7)];
        [head]
            .into_iter()
            .chain(self.laws.iter().map(row))
            .collect()
    }
}

fn percent(value: Option<f64>) -> String {
    value.map_or_else(
        || "not known".to_owned(),
        |p| format!("{} %", rounded(p, 3)),
    )
}

fn correlated(pair: &Correlation) -> String {
    format!(
        "{} and {} are hard to tell apart: correlation {}",
        pair.first,
        pair.second,
        rounded(pair.coefficient, 4)
    )
}

fn rows(parameters: &[Parameter]) -> Vec<Vec<String>> {
    let head = ["", "value", "std", "unit", "relative"]
        .map(str::to_owned)
        .to_vec();
    [head]
        .into_iter()
        .chain(parameters.iter().map(Parameter::row))
        .collect()
}

fn table(parameters: &[Parameter]) -> String {
    columns(&rows(parameters))
}

fn left(fit: &Fit) -> String {
    format!(
        "left unexplained: {} {} rms, {} % of the data",
        rounded(fit.rms, 4),
        fit.unit,
        rounded(100.0 * fit.relative, 3)
    )
}

fn capitalised(word: &str) -> String {
    let mut letters = word.chars();
    letters
        .next()
        .map_or_else(String::new, |c| c.to_uppercase().chain(letters).collect())
}
