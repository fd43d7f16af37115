//! HTML report of a diagnosis: records and both models, residuals, candidates, remaining error.

use std::path::Path;
use std::sync::Arc;

use super::checks::{load_sentences, running_sentences};
use super::text::{
    SHARES_OVERLAP, WOULD_SHOW, answer, candidates, cells, constant_rows, error_rows,
    error_sentences, ladder_rows, limit_rows, share_rows,
};
use crate::chart::{Chart, Page, Series};
use crate::diagnose::{
    CandidateFit, Diagnosis, MotionAxis, RecordResidual, Status, SurfacePoint, autocorrelation,
    binned, density, response,
};
use crate::print::{plural, rounded, short, unit_or_as_recorded};
use crate::provenance::Provenance;
use crate::stand::si_unit;

/// Number of periods of the stand in the chart over time.
const PERIODS: f64 = 24.0;
/// Minimum and maximum number of samples in that chart.
const PICTURED: [usize; 2] = [50, 4000];
/// Number of lags of the autocorrelation drawn.
const LAGS: usize = 60;

/// A self-contained HTML page.
pub fn page(diagnosis: &Diagnosis, provenance: &Provenance) -> String {
    let stand = diagnosis.sources.stand.as_deref();
    let stand = stand.map_or_else(|| "a plain stand".to_owned(), file_name);
    let units = &diagnosis.context().units;
    let mut page = Draft {
        page: Page::new(&format!("Diagnosis of {stand}")),
        diagnosis,
        unit: unit_or_as_recorded(&diagnosis.error.unit),
        applied_unit: si_unit(&units.applied),
        per_printed: units.per_printed,
    };
    provenance.add_to(&mut page.page);
    page.conclusion();
    page.errors();
    page.records();
    page.constants();
    page.models_over_time();
    page.responses();
    page.residuals();
    page.candidates();
    page.remaining();
    page.surface();
    page.page.html()
}

/// The page being written.
struct Draft<'a> {
    page: Page,
    diagnosis: &'a Diagnosis,
    /// Unit of the errors.
    unit: &'a str,
    /// SI unit of the applied quantity.
    applied_unit: String,
    /// Diagnosed units per unit of the errors.
    per_printed: f64,
}

impl Draft<'_> {
    fn conclusion(&mut self) {
        for sentence in answer(self.diagnosis) {
            self.page.text(&sentence);
        }
        for warning in &self.diagnosis.warnings {
            self.page.warning(warning.code, &warning.message);
        }
    }

    fn errors(&mut self) {
        self.page.heading("Error before and after");
        self.page.table(&error_rows(self.diagnosis));
        let sentences = error_sentences(self.diagnosis).into_iter();
        for sentence in sentences
            .chain(load_sentences(self.diagnosis))
            .chain(running_sentences(self.diagnosis))
        {
            self.page.text(&sentence);
        }
        if self.diagnosis.effects.len() > 1 {
            self.page.table(&ladder_rows(self.diagnosis));
            self.page.table(&share_rows(self.diagnosis));
            self.page.text(SHARES_OVERLAP);
        }
    }

    fn records(&mut self) {
        self.page.heading("Records");
        let applied = match self.applied_unit.as_str() {
            "" => "applied, rms".to_owned(),
            unit => format!("applied, rms {unit}"),
        };
        let measured = format!("measured, rms {}", self.unit);
        let mut rows = vec![cells([
            "record", "used for", "samples", "rate, Hz", "from, s", &applied, &measured,
        ])];
        let row = |residual: &RecordResidual, role: &str| {
            let record = &residual.record;
            cells([
                &file_name(&record.source),
                role,
                &record.count().to_string(),
                &short(record.rate_hz()),
                &rounded(residual.start_s(), 4),
                &rounded(rms_about_mean(record.applied_in_range()), 4),
                &rounded(
                    rms_about_mean(record.measured_in_range()) / self.per_printed,
                    4,
                ),
            ])
        };
        let before = &self.diagnosis.before;
        rows.extend(before.train().iter().map(|r| row(r, "training")));
        rows.extend(before.compared().iter().map(|r| row(r, "hold-out")));
        self.page.table(&rows);
    }

    fn constants(&mut self) {
        self.page.heading("Constants");
        self.page.table(&constant_rows(self.diagnosis));
    }

    /// The models drawn, with their residuals on the hold-out records; without an accepted effect, only that before.
    fn models(&self) -> Vec<(&'static str, Arc<[RecordResidual]>)> {
        let mut models = vec![("before", self.diagnosis.before.compared())];
        if !self.diagnosis.effects.is_empty() {
            models.push(("after", self.diagnosis.after.compared()));
        }
        models
    }

    /// A line in the unit of the errors.
    fn line(&self, name: &str, x: &[f64], y: &[f64]) -> Series {
        let y: Vec<f64> = y.iter().map(|y| y / self.per_printed).collect();
        Series::line(name, x, &y)
    }

    fn models_over_time(&mut self) {
        self.page.heading("Measured and modelled, hold-out records");
        let before = self.diagnosis.before.compared();
        let worst = (0..before.len()).max_by(|a, b| before[*a].rms().total_cmp(&before[*b].rms()));
        let Some((k, worst)) = worst.map(|k| (k, &before[k])) else {
            return;
        };
        let natural_hz = self.diagnosis.after.fitted.stand().natural_hz;
        let count = (PERIODS * worst.record.rate_hz() / natural_hz.max(1e-9)) as usize;
        let range = worst.around_largest(count.clamp(PICTURED[0], PICTURED[1]));
        let times_s = &worst.times_s()[range.clone()];
        let measured = &worst.record.measured_in_range()[range.clone()];
        let mut series = vec![self.line("measured", times_s, measured)];
        series.extend(self.models().into_iter().map(|(name, residuals)| {
            self.line(name, times_s, &residuals[k].prediction()[range.clone()])
        }));
        let title = format!(
            "{}, where the plain stand has its largest error",
            file_name(&worst.record.source)
        );
        self.page.chart(&Chart::new(
            &title,
            "time, s",
            &self.label("measured"),
            series,
        ));
    }

    fn responses(&mut self) {
        let measured = |r: &RecordResidual| r.record.measured_in_range().to_vec();
        let (x, y) = response(&self.diagnosis.before.compared(), measured);
        let mut series = vec![self.line("measured", &x, &y)];
        series.extend(self.models().into_iter().map(|(name, residuals)| {
            let (x, y) = response(&residuals, RecordResidual::prediction);
            self.line(name, &x, &y)
        }));
        let label = format!("measured per applied, {}/{}", self.unit, self.applied_unit);
        self.page.chart(&logarithmic(Chart::new(
            "Response, with the same estimator for record and models",
            "frequency, Hz",
            label.trim_end_matches('/'),
            series,
        )));
    }

    fn residuals(&mut self) {
        self.page.heading("Residual, hold-out records");
        for (k, first) in self.diagnosis.before.compared().iter().enumerate() {
            let times_s = first.times_s();
            let chart = self.of_residuals(
                &file_name(&first.record.source),
                ["time, s", &self.label("residual")],
                |name, residuals| self.line(name, &times_s, &residuals[k].samples),
            );
            self.page.chart(&chart);
        }
        let label = self.label("residual") + "/√Hz";
        let mut spectrum =
            self.of_residuals("Spectrum", ["frequency, Hz", &label], |name, residuals| {
                let (x, y) = density(residuals);
                self.line(name, &x, &y)
            });
        spectrum.series.extend(self.noise_floor());
        self.page.chart(&logarithmic(spectrum));
        let chart = self.autocorrelation();
        self.page.chart(&chart);
        for (axis, name, unit) in [
            (MotionAxis::Displacement, "displacement", ""),
            (MotionAxis::Speed, "speed", "/s"),
        ] {
            let chart = self.over_motion(axis, name, unit);
            self.page.chart(&chart);
        }
    }

    /// Axis label of such a quantity.
    fn label(&self, quantity: &str) -> String {
        format!("{quantity}, {}", unit_or_as_recorded(self.unit))
    }

    /// A chart with a series for each model, in the same colours as with the measured record.
    fn of_residuals(
        &self,
        title: &str,
        [x_label, y_label]: [&str; 2],
        series: impl Fn(&str, &[RecordResidual]) -> Series,
    ) -> Chart {
        let models = self.models().into_iter();
        let series = models.map(|(name, residuals)| series(name, &residuals));
        Chart {
            first_colour: 1,
            ..Chart::new(title, x_label, y_label, series.collect())
        }
    }

    /// Density of white noise with the power of the noise floor.
    fn noise_floor(&self) -> Option<Series> {
        let rms = self.diagnosis.error.noise_floor_rms?;
        let holdout = &self.diagnosis.before.compared();
        let rate_hz = holdout.first()?.record.rate_hz();
        let (x, _) = density(holdout);
        let level = rms * (2.0 / rate_hz).sqrt();
        let ends = [*x.first()?, *x.last()?];
        Some(Series::line("noise floor", &ends, &[level; 2]))
    }

    fn autocorrelation(&self) -> Chart {
        let title = "Autocorrelation (shaded: 99 % limits for white noise)";
        let labels = ["lag, samples", "autocorrelation, no unit"];
        let (shares, bound) = autocorrelation(&self.diagnosis.before.compared(), LAGS);
        let lags: Vec<f64> = (0..shares.len()).map(|lag| lag as f64).collect();
        Chart {
            band: lags.iter().map(|lag| (*lag, -bound, bound)).collect(),
            ..self.of_residuals(title, labels, |name, residuals| {
                Series::line(name, &lags, &autocorrelation(residuals, LAGS).0)
            })
        }
    }

    /// Residuals over the displacement or speed in the model.
    fn over_motion(&self, axis: MotionAxis, name: &str, per: &str) -> Chart {
        let bins = |residuals: &[RecordResidual]| {
            let mut bins = binned(residuals, &self.diagnosis.after.compared(), axis);
            for bin in &mut bins {
                for number in [&mut bin.motion, &mut bin.mean, &mut bin.std] {
                    *number /= self.per_printed;
                }
            }
            bins
        };
        let title = format!(
            "Residual over {name}, averaged in bins (shaded: before, ± two standard errors)"
        );
        let x_label = format!("modelled {name}, {}{per}", self.unit);
        let band = bins(&self.diagnosis.before.compared()).into_iter();
        let band = band.map(|b| (b.motion, b.mean - 2.0 * b.std, b.mean + 2.0 * b.std));
        Chart {
            band: band.collect(),
            ..self.of_residuals(
                &title,
                [&x_label, &self.label("residual")],
                |name, residuals| {
                    let points = bins(residuals).into_iter().map(|b| (b.motion, b.mean));
                    let (x, y): (Vec<f64>, Vec<f64>) = points.unzip();
                    Series::line(name, &x, &y)
                },
            )
        }
    }

    fn candidates(&mut self) {
        self.page
            .heading("Candidates, the accepted first, then by hold-out error");
        let (first, others) = candidates(self.diagnosis);
        self.page.table(&self.candidate_rows(&first));
        if !others.is_empty() {
            let summary = plural(others.len(), "more candidate");
            let rows = self.candidate_rows(&others);
            self.page.folded(&summary, |page| page.table(&rows));
        }
        let shown = self.diagnosis.candidates.iter();
        let shown = shown.filter(|c| c.status() != Status::Rejected);
        let mut rows = vec![cells(["effect", "parameter", "value", "std", "unit"])];
        rows.extend(shown.flat_map(|c| &c.parameters).map(|parameter| {
            let fitted = &parameter.estimate;
            let std = fitted.std_uncertainty();
            cells([
                parameter.effect,
                parameter.name,
                &rounded(fitted.value(), 6),
                &std.map_or_else(|| "unknown".to_owned(), |s| rounded(s, 2)),
                fitted.unit(),
            ])
        }));
        if rows.len() > 1 {
            self.page.heading("Parameters of the effects");
            self.page.table(&rows);
        }
    }

    fn candidate_rows(&self, candidates: &[&CandidateFit]) -> Vec<Vec<String>> {
        let number = |value: Option<f64>, digits: u32| {
            value.map_or_else(|| "–".to_owned(), |v| rounded(v, digits))
        };
        let [held_out, training] =
            ["hold-out", "training"].map(|part| format!("{part}, {}", self.unit));
        let mut rows = vec![cells([
            "effect", "status", &held_out, &training, "p", "reason",
        ])];
        rows.extend(candidates.iter().map(|candidate| {
            cells([
                &candidate.names().join(" + "),
                candidate.status().name(),
                &number(candidate.holdout_rms, 4),
                &number(candidate.train_rms, 4),
                &number(candidate.p_value, 2),
                &candidate.reason.text(),
            ])
        }));
        rows
    }

    fn remaining(&mut self) {
        self.page.heading("What remains");
        let residual = &self.diagnosis.residual;
        self.page
            .text(&format!("Hold-out residual: {}.", residual.described));
        let mut rows = vec![cells([
            "explained by",
            "share of its power",
            "significance (standard deviations)",
        ])];
        let shares = residual
            .tests
            .shares
            .iter()
            .chain(residual.tests.stationarity());
        rows.extend(shares.map(|share| {
            cells([
                share.of,
                &format!("{} %", rounded(100.0 * share.share.max(0.0), 2)),
                &rounded(share.significance, 2),
            ])
        }));
        self.page.table(&rows);
        if !self.diagnosis.detection_limits.is_empty() {
            self.page.text(WOULD_SHOW);
            self.page.table(&limit_rows(self.diagnosis));
        }
    }
}

impl Draft<'_> {
    /// The missing torque, regardless of its law, over displacement and over speed.
    fn surface(&mut self) {
        let Some(surface) = &self.diagnosis.force_surface else {
            return;
        };
        self.page
            .heading("The missing torque, without an assumed law");
        let shares = &surface.shares;
        let mut rows = vec![cells(["explained by", "share"])];
        rows.extend(
            [
                ("the displacement", shares.displacement),
                ("the speed", shares.speed),
                ("both together", shares.both),
                ("the history of the motion", shares.history),
            ]
            .map(|(of, share)| cells([of, &format!("{} %", rounded(100.0 * share, 2))])),
        );
        self.page.table(&rows);
        for (name, per, points) in [
            ("displacement", "", &surface.over_displacement),
            ("speed", "/s", &surface.over_speed),
        ] {
            let band = |p: &SurfacePoint| (p.at, p.torque - 2.0 * p.std, p.torque + 2.0 * p.std);
            let (x, y): (Vec<f64>, Vec<f64>) = points.iter().map(|p| (p.at, p.torque)).unzip();
            let chart = Chart::new(
                &format!(
                    "Torque over {name}, without its straight line (shaded: ± two standard uncertainties)"
                ),
                &format!("{name}, {}{per}", self.unit),
                &self.label("torque"),
                vec![Series::line("torque", &x, &y)],
            );
            self.page.chart(&Chart {
                band: points.iter().map(band).collect(),
                ..chart
            });
        }
    }
}

fn logarithmic(chart: Chart) -> Chart {
    Chart {
        x_log: true,
        y_log: true,
        ..chart
    }
}

/// The last component of a path.
fn file_name(path: &str) -> String {
    let name = Path::new(path).file_name();
    name.map_or_else(|| path.to_owned(), |n| n.to_string_lossy().into_owned())
}

fn rms_about_mean(values: &[f64]) -> f64 {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt()
}
