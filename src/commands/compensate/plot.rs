//! Chart of the recorded and the compensated signal over time.

use super::report::CompensateReport;
use super::sink::ResultPart;
use crate::chart::{Chart, Envelope, MarkedSpan, Series, SpanKind, picture};

/// Height of the panel, in user units.
const HEIGHT: f64 = 330.0;

/// Both signals, collected sample by sample in bounded memory.
#[derive(Debug, Clone)]
pub struct Traces {
    range: Option<(f64, f64)>,
    recorded: Envelope,
    compensated: Envelope,
}

impl Traces {
    /// No samples yet; only those within the range, in seconds, will be drawn.
    pub fn new(range: Option<(f64, f64)>) -> Self {
        Self {
            range,
            recorded: Envelope::new(),
            compensated: Envelope::new(),
        }
    }

    pub(super) fn take(&mut self, part: &ResultPart) {
        let scale = part.rows.scale;
        for (i, (torque, recorded)) in part.torque.iter().zip(part.recorded).enumerate() {
            self.add(part.rows.time_s(i), recorded * scale, torque * scale);
        }
    }

    fn add(&mut self, time_s: f64, recorded: f64, compensated: f64) {
        let within = |(from, to): (f64, f64)| (from..=to).contains(&time_s);
        if self.range.is_none_or(within) {
            self.recorded.add(time_s, recorded);
            self.compensated.add(time_s, compensated);
        }
    }

    /// Whether no sample was within the range.
    pub fn is_empty(&self) -> bool {
        self.recorded.is_empty()
    }

    /// Both signals, with filled-in samples and the results that depend on them marked.
    pub(super) fn chart(&self, report: &CompensateReport) -> Chart {
        // Seconds since 1970 would give identical tick labels.
        let (zero_s, label) = match report.start.date() {
            None => (0.0, "time, s".to_owned()),
            Some(date) => (report.start.seconds(), format!("time after {date}, s")),
        };
        let points = |signal: &Envelope| {
            let points = signal.points().into_iter();
            points.map(|(x, y)| (x - zero_s, y)).collect()
        };
        let series = vec![
            Series::new("recorded", points(&self.recorded)),
            Series::new("compensated", points(&self.compensated)),
        ];
        let marked = report.filled.iter().flat_map(|span| {
            let around = |reach_s: f64, kind| MarkedSpan {
                from: span.from_s - zero_s - reach_s,
                to: span.to_s - zero_s + reach_s,
                kind,
            };
            [
                around(0.0, SpanKind::Filled),
                around(report.reach_s, SpanKind::Smeared),
            ]
        });
        let y_label = format!("{}, {}", report.quantity, report.unit);
        Chart {
            spans: marked.collect(),
            ..Chart::new("", &label, &y_label, series)
        }
    }

    pub(super) fn svg(&self, report: &CompensateReport) -> String {
        picture(
            "Recorded and compensated signal",
            HEIGHT,
            &[self.chart(report)],
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::FilledSpan;

    #[test]
    fn only_the_range_is_drawn() {
        let mut traces = Traces::new(Some((1.0, 2.0)));
        for i in 0..300 {
            traces.add(0.01 * f64::from(i), 1.0, -1.0 + f64::from(i % 7));
        }
        assert_eq!(traces.recorded.points().len(), 101);
        let report = CompensateReport {
            unit: "N m & <x>".to_owned(),
            filled: vec![FilledSpan {
                from_s: 1.2,
                to_s: 1.3,
                samples: 9,
            }],
            reach_s: 0.1,
            ..CompensateReport::default()
        };
        let svg = traces.svg(&report);
        assert!(svg.contains("N m &amp; &lt;x&gt;") && !svg.contains("NaN"));
        assert_eq!(svg.matches("<path").count(), 2);
        // The panel is 860 wide from 78 on, and 1 s long: 1.2 s is at 250, 1.1 s at 164.
        assert!(
            svg.contains("class=\"filled\" x=\"250.0\" y=\"26.0\" width=\"86.0\""),
            "{svg}"
        );
        assert!(
            svg.contains("class=\"smeared\" x=\"164.0\" y=\"26.0\" width=\"258.0\""),
            "{svg}"
        );
        assert!(Traces::new(None).is_empty());
    }
}
