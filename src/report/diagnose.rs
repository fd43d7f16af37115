//! What `diagnose` reports.

use serde::Serialize;

use crate::diagnose::Dependence;
use crate::print::{columns, rounded, unit_or_as_recorded};
use crate::warning::Warning;

/// Schema of the document.
pub const SCHEMA: &str = "torqcomp.diagnose/1";

/// The report.
#[derive(Debug, Serialize)]
pub struct Report {
    /// Schema.
    pub schema: &'static str,
    /// Version of torqcomp.
    pub version: &'static str,
    /// Stand file, if one was given.
    pub stand: Option<String>,
    /// Records fitted.
    pub train: Vec<String>,
    /// Records held out; parts of the training records if none were given.
    pub holdout: Vec<String>,
    /// How the search ended.
    pub verdict: &'static str,
    /// The effects that were added.
    pub effects: Vec<&'static str>,
    /// What the input was found to do between its samples: `band-limited`, `straight-lines` or `held`.
    pub input_between_samples: &'static str,
    /// The errors.
    pub error: Error,
    /// Constants of the plain stand: declared, refitted, and refitted with the effects.
    pub constants: Vec<Constant>,
    /// Effects that were tried, in the order of their held-out error.
    pub candidates: Vec<Candidate>,
    /// A law that is not among the effects and leaves less than each of them; it is named and not added.
    pub suspected: Option<Suspected>,
    /// What is left.
    pub residual: Residual,
    /// What to record next.
    pub next_experiment: Option<String>,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

/// The three errors.
#[derive(Debug, Serialize)]
pub struct Error {
    /// Unit of the rms values.
    pub unit: String,
    /// Of the stand file as it is.
    pub declared: Option<Rms>,
    /// Of the same structure, refitted.
    pub before: Rms,
    /// With the accepted effects.
    pub after: Rms,
    /// Relative fall of the held-out rms from before to after, 95 % interval; null if nothing was added.
    pub improvement_ci95: Option<[f64; 2]>,
    /// Rms of the noise of the held-out records, estimated without a model.
    pub noise_floor_rms: Option<f64>,
    /// How: `periods`, `out-of-band`.
    pub noise_floor_from: Option<&'static str>,
}

/// An error on training and on held-out records.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Rms {
    /// Rms on the training records.
    pub train_rms: f64,
    /// Rms on the held-out records.
    pub holdout_rms: f64,
    /// The latter over the rms of the held-out record about its mean.
    pub holdout_relative: f64,
}

/// A constant of the plain stand.
#[derive(Debug, Serialize)]
pub struct Constant {
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: String,
    /// As declared.
    pub declared: Option<f64>,
    /// Refitted.
    pub before: f64,
    /// Its standard uncertainty.
    pub before_std: Option<f64>,
    /// Refitted with the effects.
    pub after: f64,
    /// Its standard uncertainty.
    pub after_std: Option<f64>,
}

/// An effect that was tried.
#[derive(Debug, Serialize)]
pub struct Candidate {
    /// Its name.
    pub effect: &'static str,
    /// Its form that fits best.
    pub form: Option<&'static str>,
    /// The effects that were in the model already.
    pub with: Vec<&'static str>,
    /// Rms on the training records.
    pub train_rms: Option<f64>,
    /// Rms on the held-out records.
    pub holdout_rms: Option<f64>,
    /// Probability of its gain on the held-out records by chance.
    pub p_value: Option<f64>,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// `accepted`, `rejected` or `indistinguishable`.
    pub status: &'static str,
    /// Why.
    pub why: String,
}

/// A law beside the list of effects.
#[derive(Debug, Serialize)]
pub struct Suspected {
    /// Its name.
    pub law: &'static str,
    /// Its equation.
    pub equation: &'static str,
    /// The effects that were in the model already.
    pub with: Vec<&'static str>,
    /// Rms on the training records.
    pub train_rms: f64,
    /// Rms on the held-out records.
    pub holdout_rms: f64,
    /// Unit of both.
    pub unit: String,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
}

impl Suspected {
    /// In words, errors in the unit of the report.
    #[must_use]
    pub fn described(&self) -> String {
        let with = if self.with.is_empty() {
            String::new()
        } else {
            format!(" beside {}", self.with.join(" and "))
        };
        format!(
            "{} ({}){with}, which would leave an error of {} {} on the held-out records; it is not among the effects that \
             are added",
            self.law,
            self.equation,
            rounded(self.holdout_rms, 4),
            unit_or_as_recorded(&self.unit)
        )
    }
}

/// A parameter of an effect.
#[derive(Debug, Serialize)]
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its standard uncertainty.
    pub std: Option<f64>,
    /// Its unit.
    pub unit: String,
}

/// What is left.
#[derive(Debug, Serialize)]
pub struct Residual {
    /// Whether it is white.
    pub white: bool,
    /// Whether it is independent of the input, at positive and negative lags.
    pub independent_of_input: bool,
    /// The tests in full.
    pub tests: Dependence,
    /// Lines in its spectrum.
    pub lines: Vec<Line>,
    /// Relative error of the plain stand on training and on held-out records, and the level of excitation of both.
    pub levels: Levels,
    /// In words.
    pub described: String,
}

/// A line in the spectrum of the residual.
#[derive(Debug, Serialize)]
pub struct Line {
    /// Its frequency.
    pub frequency_hz: f64,
    /// Its amplitude.
    pub amplitude: f64,
}

/// Levels of excitation, and how well the plain stand does at each.
#[derive(Debug, Serialize)]
pub struct Levels {
    /// Rms of the applied quantity, training.
    pub train_applied_rms: f64,
    /// The same, held out.
    pub holdout_applied_rms: f64,
    /// Relative error of the plain stand, training.
    pub train_relative: f64,
    /// The same, held out.
    pub holdout_relative: f64,
}

/// A value with its standard uncertainty, if that is known.
#[must_use]
pub fn with_std(value: f64, std: Option<f64>) -> String {
    match std {
        Some(std) => crate::print::with_std(value, std),
        None => format!("{} (std unknown)", rounded(value, 6)),
    }
}

impl Report {
    /// What the input does between its samples, where that had to be found out.
    #[must_use]
    pub fn course(&self) -> Option<&'static str> {
        match self.input_between_samples {
            "held" => Some(
                "the applied record acts as if each sample were held until the next one, as a converter does; all errors are with \
                 that",
            ),
            "straight-lines" => Some(
                "the applied record acts as if straight lines ran from sample to sample; all errors are with that",
            ),
            _ => None,
        }
    }

    /// For people.
    #[must_use]
    pub fn text(&self) -> String {
        let effects = if self.effects.is_empty() {
            "none".to_owned()
        } else {
            self.effects.join(", ")
        };
        let mut text = format!("verdict: {}\neffects: {effects}\n\n", self.verdict);
        text.push_str(&self.errors());
        if let Some(course) = self.course() {
            text.push_str(&format!("input: {course}\n"));
        }
        text.push('\n');
        text.push_str(&self.constants());
        text.push('\n');
        text.push_str(&self.candidates());
        if let Some(suspected) = &self.suspected {
            text.push_str(&format!("\nsuspected: {}\n", suspected.described()));
        }
        text.push_str(&format!("\nleft: {}\n", self.residual.described));
        if let Some(next) = &self.next_experiment {
            text.push_str(&format!("next experiment: {next}\n"));
        }
        text
    }

    fn errors(&self) -> String {
        let unit = unit_or_as_recorded(&self.error.unit);
        let mut rows = vec![vec![
            format!("error, {unit}"),
            "training".to_owned(),
            "held out".to_owned(),
            "of the record".to_owned(),
        ]];
        let mut row = |name: &str, rms: &Rms| {
            rows.push(vec![
                name.to_owned(),
                rounded(rms.train_rms, 4),
                rounded(rms.holdout_rms, 4),
                format!("{:.3} %", 100.0 * rms.holdout_relative),
            ]);
        };
        if let Some(declared) = &self.error.declared {
            row("declared", declared);
        }
        row("before", &self.error.before);
        row("after", &self.error.after);
        let mut text = columns(&rows);
        if let Some([low, high]) = self.error.improvement_ci95 {
            text.push_str(&format!(
                "the held-out error falls by {:.1} to {:.1} % (95 %)\n",
                100.0 * low,
                100.0 * high
            ));
        }
        match (self.error.noise_floor_rms, self.error.noise_floor_from) {
            (Some(rms), Some(from)) => {
                text.push_str(&format!("noise floor {} ({from})\n", rounded(rms, 4)));
            }
            _ => text.push_str("noise floor unknown\n"),
        }
        text
    }

    fn constants(&self) -> String {
        let head = ["constant", "declared", "before", "after"]
            .map(str::to_owned)
            .to_vec();
        let rows = self.constants.iter().map(|c| {
            let name = if c.unit.is_empty() {
                c.name.to_owned()
            } else {
                format!("{}, {}", c.name, c.unit)
            };
            vec![
                name,
                c.declared.map_or_else(|| "-".to_owned(), |v| rounded(v, 6)),
                with_std(c.before, c.before_std),
                with_std(c.after, c.after_std),
            ]
        });
        columns(&std::iter::once(head).chain(rows).collect::<Vec<_>>())
    }

    fn candidates(&self) -> String {
        let mut text = String::new();
        for c in &self.candidates {
            let rms = c
                .holdout_rms
                .map_or_else(|| "-".to_owned(), |v| rounded(v, 4));
            let with = if c.with.is_empty() {
                String::new()
            } else {
                format!("{} + ", c.with.join(" + "))
            };
            text.push_str(&format!(
                "{with}{}: {rms}, {}: {}\n",
                c.effect, c.status, c.why
            ));
            if c.status != "rejected" {
                for p in &c.parameters {
                    let value = with_std(p.value, p.std);
                    let text_of = format!("    {} = {value} {}", p.name, p.unit);
                    text.push_str(text_of.trim_end());
                    text.push('\n');
                }
            }
        }
        text
    }
}
