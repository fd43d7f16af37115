//! A diagnosis as a page for a browser: records beside both models, residuals, candidates, what remains.

use super::chart::{Chart, Series};
use super::diagnose::{Candidate, Report, Rms, with_std};
use super::page::Page;
use crate::diagnose::{Against, Trace, autocorrelation, binned, density, response};
use crate::print::{rounded, short, unit_or_as_recorded};

/// What the page shows beside the report.
pub struct Sights {
    /// The training records.
    pub trained: Vec<Trace>,
    /// The held-out records.
    pub held_out: Vec<Trace>,
    /// Unit of the applied quantity.
    pub applied_unit: String,
    /// Natural frequency of the stand.
    pub natural_hz: f64,
}

/// Periods of the stand in the picture over time.
const PERIODS: f64 = 24.0;
/// Lags of the autocorrelation that is drawn.
const LAGS: usize = 60;

impl Report {
    /// A page for a browser, complete in itself.
    #[must_use]
    pub fn page(&self, sights: &Sights) -> String {
        let stand = self
            .stand
            .as_deref()
            .map_or_else(|| "a plain stand".to_owned(), file_name);
        let mut page = Page::new(&format!("Diagnosis of {stand}"));
        page.text(&self.conclusion());
        for warning in &self.warnings {
            page.warning(warning.code, &warning.message);
        }
        self.error_before_and_after(&mut page);
        self.what_was_measured(&mut page, sights);
        self.both_models(&mut page, sights);
        self.residuals(&mut page, sights);
        self.ranked(&mut page);
        self.what_remains(&mut page);
        page.text(&format!("torqcomp {}", self.version));
        page.html()
    }

    fn conclusion(&self) -> String {
        let added = self.effects.join(" and ");
        match self.verdict {
            "explained" => format!(
                "Explained: with {added} nothing above the noise remains on records that the fit never saw."
            ),
            "partly-explained" => format!(
                "Partly explained: {added} helps on records that the fit never saw, and something above the noise remains."
            ),
            "nothing-missing" => {
                "Nothing missing: the plain stand explains the records down to the noise."
                    .to_owned()
            }
            _ => "Unexplained: something is missing, and no effect of the list explains it."
                .to_owned(),
        }
    }

    fn error_before_and_after(&self, page: &mut Page) {
        page.heading("Error before and after");
        let head = format!("rms, {}", self.unit());
        let mut rows = vec![cells(&[
            &head,
            "training",
            "held out",
            "of the held-out record",
        ])];
        let mut row = |name: &str, rms: &Rms| {
            rows.push(vec![
                name.to_owned(),
                rounded(rms.train_rms, 4),
                rounded(rms.holdout_rms, 4),
                format!("{} %", rounded(100.0 * rms.holdout_relative, 3)),
            ]);
        };
        if let Some(declared) = &self.error.declared {
            row("declared: the stand file as it is", declared);
        }
        row("before: the same model, refitted", &self.error.before);
        row("after: with the accepted effects", &self.error.after);
        page.table(&rows);
        if let Some([low, high]) = self.error.improvement_ci95 {
            page.text(&format!(
                "The held-out error falls by {} % to {} % (95 % interval).",
                rounded(100.0 * low, 4),
                rounded(100.0 * high, 4)
            ));
        }
        let floor = self.error.noise_floor_rms;
        page.text(&match (floor, self.error.noise_floor_from) {
            (Some(rms), Some("periods")) => format!(
                "Noise floor {} {}, from the differences between periods of the record.",
                rounded(rms, 4),
                self.unit()
            ),
            (Some(rms), _) => format!(
                "Noise floor {} {}, from the frequencies in which the record has noise alone.",
                rounded(rms, 4),
                self.unit()
            ),
            _ => "The noise floor is not known.".to_owned(),
        });
        if let Some(course) = self.course() {
            page.text(&format!("Input: {course}."));
        }
    }

    fn unit(&self) -> &str {
        unit_or_as_recorded(&self.error.unit)
    }

    fn what_was_measured(&self, page: &mut Page, sights: &Sights) {
        page.heading("What was measured");
        let applied = match sights.applied_unit.as_str() {
            "" => "applied, rms".to_owned(),
            unit => format!("applied, rms {unit}"),
        };
        let measured = format!("measured, rms {}", self.unit());
        let head = cells(&[
            "record", "used for", "samples", "rate, Hz", "from, s", &applied, &measured,
        ]);
        let row = |trace: &Trace, role: &str| {
            vec![
                file_name(&trace.source),
                role.to_owned(),
                trace.measured.len().to_string(),
                short(trace.rate_hz),
                rounded(trace.start_s, 4),
                rounded(spread(&trace.applied), 4),
                rounded(spread(&trace.measured), 4),
            ]
        };
        let trained = sights.trained.iter().map(|t| row(t, "training"));
        let held_out = sights.held_out.iter().map(|t| row(t, "held out"));
        page.table(
            &[head]
                .into_iter()
                .chain(trained)
                .chain(held_out)
                .collect::<Vec<_>>(),
        );
        page.heading("Constants");
        page.table(&self.constant_rows());
    }

    fn constant_rows(&self) -> Vec<Vec<String>> {
        let head = cells(&["", "unit", "declared", "before", "after"]);
        let rows = self.constants.iter().map(|c| {
            vec![
                c.name.to_owned(),
                c.unit.clone(),
                c.declared
                    .map_or_else(|| "not declared".to_owned(), |v| rounded(v, 6)),
                with_std(c.before, c.before_std),
                with_std(c.after, c.after_std),
            ]
        });
        std::iter::once(head).chain(rows).collect()
    }

    fn both_models(&self, page: &mut Page, sights: &Sights) {
        let by = |a: &&Trace, b: &&Trace| a.before_rms().total_cmp(&b.before_rms());
        let Some(worst) = sights.held_out.iter().max_by(by) else {
            return;
        };
        page.heading("Measured and modelled, held out");
        page.chart(&self.over_time(worst, sights.natural_hz));
        let label = format!(
            "measured per applied, {}/{}",
            self.unit(),
            sights.applied_unit
        );
        let series = [
            ("measured", None),
            ("before", Some(false)),
            ("after", Some(true)),
        ]
        .into_iter()
        .filter(|(name, _)| self.shows(name))
        .map(|(name, refined)| {
            let (x, y) = response(&sights.held_out, |t| match refined {
                None => t.measured.clone(),
                Some(false) => t.modelled(&t.before),
                Some(true) => t.modelled(&t.after),
            });
            Series::line(name, &x, &y)
        });
        page.chart(&logarithmic(Chart::new(
            "Response, the same estimate of each",
            "frequency, Hz",
            label.trim_end_matches('/'),
            series.collect(),
        )));
    }

    /// Whether a model is drawn: without an accepted effect, after is before.
    fn shows(&self, name: &str) -> bool {
        name != "after" || !self.effects.is_empty()
    }

    fn over_time(&self, trace: &Trace, natural_hz: f64) -> Chart {
        let count = (PERIODS * trace.rate_hz / natural_hz.max(1e-9)) as usize;
        let range = trace.around_largest(count.clamp(50, 4000));
        let times = trace.times_s();
        let part = |values: &[f64]| values[range.clone()].to_vec();
        let of = |name: &str, values: Vec<f64>| Series::line(name, &times[range.clone()], &values);
        let mut series = vec![
            of("measured", part(&trace.measured)),
            of("before", part(&trace.modelled(&trace.before))),
        ];
        if self.shows("after") {
            series.push(of("after", part(&trace.modelled(&trace.after))));
        }
        let title = format!(
            "{}, where the plain stand is furthest off",
            file_name(&trace.source)
        );
        Chart::new(&title, "time, s", self.unit(), series)
    }

    fn residuals(&self, page: &mut Page, sights: &Sights) {
        let traces = &sights.held_out;
        if traces.is_empty() {
            return;
        }
        page.heading("Residual, held out");
        for trace in traces {
            let times = trace.times_s();
            let series = self.each(|after| Series::line(name(after), &times, left(trace, after)));
            let title = file_name(&trace.source);
            page.chart(&of_residuals(&title, "time, s", self.unit(), series));
        }
        let series = self.each(|after| {
            let (x, y) = density(traces, |t| left(t, after).to_vec());
            Series::line(name(after), &x, &y)
        });
        let label = format!("{}/√Hz", self.unit());
        let spectrum = of_residuals("Spectrum", "frequency, Hz", &label, series);
        page.chart(&logarithmic(spectrum));
        page.chart(&self.autocorrelation(traces));
        let displacement = format!("displacement as the model has it, {}", self.unit());
        page.chart(&self.against(traces, Against::Displacement, &displacement));
        let speed = format!("speed as the model has it, {}/s", self.unit());
        page.chart(&self.against(traces, Against::Speed, &speed));
    }

    /// A series for each model that is drawn.
    fn each(&self, series: impl Fn(bool) -> Series) -> Vec<Series> {
        [false, true]
            .into_iter()
            .filter(|after| self.shows(name(*after)))
            .map(series)
            .collect()
    }

    fn autocorrelation(&self, traces: &[Trace]) -> Chart {
        let of = |after: bool| autocorrelation(traces, LAGS, |t| left(t, after));
        let (shares, bound) = of(false);
        let lags: Vec<f64> = (0..shares.len()).map(|lag| lag as f64).collect();
        let series = self.each(|after| Series::line(name(after), &lags, &of(after).0));
        Chart {
            band: lags.iter().map(|lag| (*lag, -bound, bound)).collect(),
            ..of_residuals(
                "Autocorrelation; within the band: white at 99 %",
                "lag, samples",
                "of the mean square",
                series,
            )
        }
    }

    fn against(&self, traces: &[Trace], against: Against, x_label: &str) -> Chart {
        let of = |after: bool| binned(traces, against, |t| left(t, after));
        let series = self.each(|after| {
            let (x, y): (Vec<f64>, Vec<f64>) =
                of(after).iter().map(|[x, mean, _]| (*x, *mean)).unzip();
            Series::line(name(after), &x, &y)
        });
        let band = of(false);
        let title = match against {
            Against::Displacement => {
                "Against displacement: mean in each bin, two standard errors about before"
            }
            Against::Speed => "Against speed: mean in each bin, two standard errors about before",
        };
        Chart {
            band: band
                .iter()
                .map(|[x, mean, std]| (*x, mean - 2.0 * std, mean + 2.0 * std))
                .collect(),
            ..of_residuals(title, x_label, self.unit(), series)
        }
    }

    fn ranked(&self, page: &mut Page) {
        page.heading("Candidates, the accepted first, then by held-out error");
        let head = cells(&["effect", "status", "held out", "training", "p", "why"]);
        let rows = self.candidates.iter().map(candidate_row);
        page.table(&std::iter::once(head).chain(rows).collect::<Vec<_>>());
        let shown = self.candidates.iter().filter(|c| c.status != "rejected");
        let mut rows = vec![cells(&["effect", "parameter", "value", "std", "unit"])];
        for candidate in shown {
            rows.extend(candidate.parameters.iter().map(|p| {
                vec![
                    candidate.effect.to_owned(),
                    p.name.to_owned(),
                    rounded(p.value, 6),
                    p.std
                        .map_or_else(|| "not known".to_owned(), |s| rounded(s, 2)),
                    p.unit.clone(),
                ]
            }));
        }
        if rows.len() > 1 {
            page.heading("Parameters of the effects");
            page.table(&rows);
        }
    }

    fn what_remains(&self, page: &mut Page) {
        page.heading("What remains");
        if let Some(suspected) = &self.suspected {
            page.text(&format!("Suspected: {}.", suspected.described()));
        }
        page.text(&format!(
            "Of the held-out residual: {}.",
            self.residual.described
        ));
        let share = |s: &crate::diagnose::Share| {
            vec![
                s.of.to_owned(),
                format!("{} %", rounded(100.0 * s.share.max(0.0), 2)),
                rounded(s.significance, 2),
            ]
        };
        let head = cells(&[
            "follows from",
            "share of its power",
            "standard deviations above none",
        ]);
        let tests = &self.residual.tests;
        let unsteady = [
            &tests.changing_constants,
            &tests.with_signal,
            &tests.with_slope,
            &tests.wandering_zero,
        ];
        let rows = tests.shares.iter().chain(unsteady).map(share);
        page.table(&std::iter::once(head).chain(rows).collect::<Vec<_>>());
        page.heading("Next experiment");
        page.text(
            self.next_experiment
                .as_deref()
                .unwrap_or("None is needed to tell candidates apart."),
        );
    }
}

fn cells(texts: &[&str]) -> Vec<String> {
    texts.iter().map(|t| (*t).to_owned()).collect()
}

fn name(after: bool) -> &'static str {
    if after { "after" } else { "before" }
}

fn left(trace: &Trace, after: bool) -> &[f64] {
    if after { &trace.after } else { &trace.before }
}

/// A chart of both models, in the colours that they have beside the measured record.
fn of_residuals(title: &str, x_label: &str, y_label: &str, series: Vec<Series>) -> Chart {
    Chart {
        first_colour: 1,
        ..Chart::new(title, x_label, y_label, series)
    }
}

fn logarithmic(chart: Chart) -> Chart {
    Chart {
        x_log: true,
        y_log: true,
        ..chart
    }
}

/// The last part of a path.
fn file_name(path: &str) -> String {
    let name = std::path::Path::new(path).file_name();
    name.map_or_else(|| path.to_owned(), |n| n.to_string_lossy().into_owned())
}

/// Rms about the mean.
fn spread(values: &[f64]) -> f64 {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt()
}

fn candidate_row(c: &Candidate) -> Vec<String> {
    let number = |value: Option<f64>, digits: u32| {
        value.map_or_else(|| "–".to_owned(), |v| rounded(v, digits))
    };
    let effect = c
        .with
        .iter()
        .copied()
        .chain([c.effect])
        .collect::<Vec<_>>()
        .join(" + ");
    vec![
        effect,
        c.status.to_owned(),
        number(c.holdout_rms, 4),
        number(c.train_rms, 4),
        number(c.p_value, 2),
        c.why.clone(),
    ]
}
