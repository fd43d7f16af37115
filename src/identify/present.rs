//! The result of an identification as text and as an HTML page.

use std::fmt::Write;

use super::{Correlation, FitQuality, Identification, NamedEstimate, decay};
use crate::chart::Page;
use crate::print::{Report, columns, relative, rounded, short, value_and_std};
use crate::provenance::Provenance;

/// A table with its heading, and a note below it.
struct ResultTable {
    heading: String,
    rows: Vec<Vec<String>>,
    note: Option<String>,
}

impl Report for Identification {
    const SCHEMA: &'static str = "torqcomp.identify/1";

    fn text(&self) -> String {
        let mut text = format!("{}, {}\n", self.title(), self.recording());
        for line in &self.method {
            let _ = writeln!(text, "{line}");
        }
        text.push('\n');
        text.push_str(&columns(&constant_rows(&self.parameters)));
        if let Some(fit) = &self.fit {
            let _ = writeln!(text, "\n{}", fit.text());
        }
        for section in self.sections() {
            let table = columns(&section.rows);
            let _ = write!(text, "\n{}:\n\n{table}", section.heading);
            if let Some(note) = section.note {
                let _ = writeln!(text, "{note}");
            }
        }
        if !self.terms.is_empty() {
            let _ = writeln!(text, "\n{TERMS}:\n");
        }
        for term in &self.terms {
            let value = percent(term.percent);
            let _ = writeln!(text, "{:<20} {value:>10}  {}", term.name, term.formula);
        }
        for pair in &self.correlations {
            let _ = writeln!(text, "\n{}", pair.text());
        }
        text
    }
}

impl Identification {
    /// The result as a self-contained HTML page.
    pub(crate) fn page(&self, provenance: &Provenance) -> String {
        let mut page = Page::new(&self.title());
        provenance.add_to(&mut page);
        page.text(&self.recording());
        page.heading("Constants");
        page.table(&constant_rows(&self.parameters));
        if let Some(fit) = &self.fit {
            page.text(&fit.text());
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
        for pair in &self.correlations {
            page.text(&pair.text());
        }
        for section in self.sections() {
            page.heading(&section.heading);
            page.table(&section.rows);
            if let Some(note) = section.note {
                page.text(&note);
            }
        }
        if !self.terms.is_empty() {
            page.heading(TERMS);
            let rows = self
                .terms
                .iter()
                .map(|t| vec![t.name.to_owned(), percent(t.percent), t.formula.to_owned()]);
            page.table(&with_head(&["term", "value", "formula"], rows));
        }
        page.heading("Method");
        for line in &self.method {
            page.text(line);
        }
        page.html()
    }

    fn title(&self) -> String {
        let (first, rest) = self.test.split_at(1);
        format!("{}{rest} test", first.to_uppercase())
    }

    fn recording(&self) -> String {
        let rate = self
            .rate_hz
            .map_or_else(String::new, |r| format!(" at {} Hz", short(r)));
        format!("{}: {} samples{rate}", self.inputs.join(", "), self.samples)
    }

    /// The constants of the best damping law, if it has dry friction.
    fn friction(&self) -> Option<String> {
        let best = self.laws.first()?;
        let friction = best.dry_friction?;
        let unit = self.fit.as_ref().map_or("", |fit| fit.unit.as_str());
        let stated = |constant: decay::LawConstant| {
            let [value, std] = match constant.std {
                Some(std) => value_and_std(constant.value, std),
                None => [short(constant.value), "unknown".to_owned()],
            };
            format!("{value} ± {std}")
        };
        let ratio = best
            .damping_ratio
            .map(|ratio| format!("damping ratio {}, ", stated(ratio)));
        Some(format!(
            "{}: {}friction {} {unit}",
            best.law.name(),
            ratio.unwrap_or_default(),
            stated(friction)
        ))
    }

    /// Results of other methods, and the damping laws.
    fn sections(&self) -> Vec<ResultTable> {
        let compared = self.comparisons.iter().map(|other| ResultTable {
            heading: format!("For comparison, {}", other.method),
            rows: constant_rows(&other.parameters),
            note: other.fit.as_ref().map(FitQuality::text),
        });
        let rows = self.laws.iter().map(|l| {
            let law = l.law.name().to_owned();
            vec![law, rounded(l.rms, 4), rounded(l.criterion, 7)]
        });
        let laws = (!self.laws.is_empty()).then(|| ResultTable {
            heading: "Damping laws, the best first".to_owned(),
            rows: with_head(&["law", "residual rms", "BIC"], rows),
            note: self.friction(),
        });
        compared.chain(laws).collect()
    }
}

/// Value relative to its standard uncertainty below which it is zero.
const ZERO: f64 = 1e-6;
const TERMS: &str = "Terms of the calibration standards, largest over the loads";

impl FitQuality {
    fn text(&self) -> String {
        format!(
            "residual: {} {} rms, {} of the data",
            rounded(self.rms, 4),
            self.unit,
            relative(self.relative, 3)
        )
    }
}

impl Correlation {
    fn text(&self) -> String {
        format!(
            "{} and {} are strongly correlated ({}): these data hardly separate them",
            self.first,
            self.second,
            rounded(self.coefficient, 4)
        )
    }
}

fn constant_rows(constants: &[NamedEstimate]) -> Vec<Vec<String>> {
    let row = |constant: &NamedEstimate| {
        let value = constant.value();
        let [text, std] = match constant.std() {
            Some(std) => value_and_std(value, std),
            None => [short(value), "unknown".to_owned()],
        };
        let part = match constant.std() {
            // Of a value that is zero but for rounding, it would be astronomical.
            Some(std) if value.abs() > ZERO * std => relative((std / value).abs(), 2),
            _ => String::new(),
        };
        let unit = constant.estimate.unit().to_owned();
        let name = constant.name.replace("held_out", "hold-out");
        vec![name.replace('_', " "), text, std, unit, part]
    };
    let head = ["", "value", "std", "unit", "relative"];
    with_head(&head, constants.iter().map(row))
}

fn with_head(head: &[&str], rows: impl Iterator<Item = Vec<String>>) -> Vec<Vec<String>> {
    let head = head.iter().map(|cell| (*cell).to_owned()).collect();
    std::iter::once(head).chain(rows).collect()
}

fn percent(value: Option<f64>) -> String {
    value.map_or_else(|| "unknown".to_owned(), |p| format!("{} %", rounded(p, 3)))
}
