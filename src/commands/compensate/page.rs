//! HTML report of a compensation: both signals over time, their spectra, the gain, the band, filled-in samples.

use torqcomp_dsp::band::Band;
use torqcomp_dsp::compensate::InverseFilter;
use torqcomp_dsp::spectrum::{Density, StreamedPower};

use super::Plan;
use super::plot::Traces;
use super::report::CompensateReport;
use super::sink::ResultPart;
use crate::chart::{Chart, MarkedSpan, Page, Series, SpanKind};
use crate::cli::Compensate;
use crate::failure::Failure;
use crate::print::{plural, short};
use crate::provenance::Provenance;
use crate::stand;

/// Samples per block of the spectra.
const BLOCK: usize = 1 << 12;
/// Number of frequencies at which the gain is drawn.
const GAINS: usize = 400;
/// Maximum number of stretches whose times the page lists.
const LISTED: usize = 200;

/// Content of the page, collected sample by sample in bounded memory.
pub(super) struct PageData {
    provenance: Provenance,
    traces: Traces,
    recorded: StreamedPower,
    compensated: StreamedPower,
    filter: InverseFilter,
    gain: Vec<GainPoint>,
}

/// Gain of the compensation at a frequency.
struct GainPoint {
    frequency_hz: f64,
    gain: f64,
    /// Of the gain alone, without the phase.
    gain_relative_std: Option<f64>,
}

impl PageData {
    /// The page of a run, before the first sample.
    ///
    /// # Errors
    /// If an input cannot be read for its hash.
    pub(super) fn new(args: &Compensate, plan: &Plan) -> Result<Self, Failure> {
        let (name, text) = stand::text(&args.stand)?;
        let point = |i: usize| {
            let frequency_hz = plan.filter.band().end_hz() * i as f64 / GAINS as f64;
            let std = plan.std(frequency_hz);
            let beside = plan.gain_beside_filter(frequency_hz);
            GainPoint {
                frequency_hz,
                gain: plan.filter.response(frequency_hz).norm() * beside,
                gain_relative_std: std.total.or(std.response).map(|u| u.magnitude()),
            }
        };
        Ok(Self {
            provenance: Provenance::of(&args.record.inputs, Some((&name, &text)))?,
            traces: Traces::new(None),
            recorded: StreamedPower::new(BLOCK),
            compensated: StreamedPower::new(BLOCK),
            filter: plan.filter.clone(),
            gain: (0..=GAINS).map(point).collect(),
        })
    }

    pub(super) fn take(&mut self, part: &ResultPart) {
        self.traces.take(part);
        self.recorded.push(part.recorded);
        self.compensated.push(part.torque);
    }

    /// The page as a file.
    pub(super) fn html(&self, report: &CompensateReport) -> String {
        let mut page = Page::new(&format!("Compensated: {}", report.channel));
        self.provenance.add_to(&mut page);
        answer(&mut page, report);
        page.heading("Recorded and compensated");
        page.chart(&self.traces.chart(report));
        self.spectra(&mut page, report);
        self.gain(&mut page, report);
        filled(&mut page, report);
        page.heading("Method");
        page.facts(&report.facts());
        page.html()
    }

    fn spectra(&self, page: &mut Page, report: &CompensateReport) {
        page.heading("Spectra and noise");
        page.text(&format!(
            "Noise: {}.",
            report.noise.record_text(&report.unit)
        ));
        let density = |power: &StreamedPower| power.density(report.rate_hz);
        let (Some(recorded), Some(compensated)) =
            (density(&self.recorded), density(&self.compensated))
        else {
            page.text("The record is too short for a spectrum.");
            return;
        };
        let root = |density: &Density| {
            let points = density.between(0.5 * density.step_hz, f64::INFINITY);
            points
                .map(|(f, v)| (f, v.sqrt() * report.scale.abs()))
                .collect()
        };
        let recorded = Series::new("recorded", root(&recorded));
        let compensated = Series::new("compensated", root(&compensated));
        let mut floors = Vec::new();
        if let Some(noise) = &report.noise.record {
            let floor = noise.floor_per_root_hz;
            let ends = recorded.points.iter().map(|p| p.0);
            floors.push(Series::new(
                "noise floor",
                ends.map(|f| (f, floor)).collect(),
            ));
            let is_inside = |p: &&GainPoint| (0.0..=report.band_hz).contains(&p.frequency_hz);
            let inside = self.gain.iter().skip(1).filter(is_inside);
            let after = inside.map(|p| (p.frequency_hz, floor * p.gain)).collect();
            floors.push(Series::new("noise floor, compensated", after));
        }
        let series = [recorded, compensated].into_iter().chain(floors);
        let label = format!("{}, {}/√Hz", report.quantity, report.unit);
        page.chart(&Chart {
            x_log: true,
            y_log: true,
            spans: vec![band_span(self.filter.band())],
            ..Chart::new(
                "Amplitude spectral density",
                "frequency, Hz",
                &label,
                series.collect(),
            )
        });
    }

    fn gain(&self, page: &mut Page, report: &CompensateReport) {
        page.heading("Gain of the compensation");
        page.text(&format!(
            "Compensated up to {} Hz, zero from {} Hz: {}.",
            short(report.band_hz),
            short(report.band_end_hz),
            report.band.text()
        ));
        let uncertainty = report.uncertainty_text();
        page.text(&format!("Uncertainty: {uncertainty}."));
        let points = |p: &GainPoint| (p.frequency_hz, p.gain);
        let gain = Series::new("gain", self.gain.iter().map(points).collect());
        let bounds = |p: &GainPoint| {
            let spread = 2.0 * p.gain_relative_std? * p.gain;
            Some((p.frequency_hz, p.gain - spread, p.gain + spread))
        };
        let band: Vec<_> = self.gain.iter().filter_map(bounds).collect();
        let is_whole = report.noise.gain.iter().any(|g| g.relative_std.is_some());
        let title = match (band.is_empty(), is_whole) {
            (true, _) => "Torque per recorded torque",
            (_, true) => "Torque per recorded torque; around it: ± two standard uncertainties",
            (_, false) => {
                "Torque per recorded torque; around it: ± two standard uncertainties of the response alone"
            }
        };
        page.chart(&Chart {
            band,
            spans: vec![band_span(self.filter.band())],
            ..Chart::new(title, "frequency, Hz", "gain, no unit", vec![gain])
        });
    }
}

fn band_span(band: &Band) -> MarkedSpan {
    MarkedSpan {
        from: 0.0,
        to: band.top_hz(),
        kind: SpanKind::Band,
    }
}

/// The result in figures, and the warnings.
fn answer(page: &mut Page, report: &CompensateReport) {
    page.text(&format!("Result: {}.", report.result_text()));
    for warning in &report.warnings {
        page.warning(warning.code, &warning.message);
    }
}

/// The times of filled-in stretches.
fn filled(page: &mut Page, report: &CompensateReport) {
    if report.filled.is_empty() {
        return;
    }
    page.heading("Filled in");
    page.text(&format!("Filled in: {}.", report.filled_summary()));
    let mut rows = vec![["from", "to", "samples"].map(str::to_owned).to_vec()];
    rows.extend(report.filled.iter().take(LISTED).map(|span| {
        let [from, to] = [span.from_s, span.to_s].map(|s| report.time_text(s));
        vec![from, to, span.samples.to_string()]
    }));
    page.table(&rows);
    if let Some(more) = report.filled.len().checked_sub(LISTED).filter(|n| *n > 0) {
        page.text(&format!("{} more.", plural(more, "place")));
    }
}
