//! A plot of the recorded and the compensated signal, as an SVG file that needs nothing else.

use std::fmt::Write;

use crate::print::rounded;

/// Most points of a trace, an even number; a longer one is drawn as its envelope.
const MOST_BINS: usize = 4096;
/// Size of the picture and its margins, in user units.
const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 420.0;
const LEFT: f64 = 78.0;
const RIGHT: f64 = 18.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 52.0;

/// Colours for light and dark surroundings; readable in grey and by the colour-blind.
const STYLE: &str = "\
text{font:13px system-ui,sans-serif;fill:#222}\
.grid{stroke:#ddd}.frame{fill:none;stroke:#888}\
.recorded{stroke:#d08a20}.compensated{stroke:#1f5fa8}\
.trace{fill:none;stroke-width:1.4;stroke-linejoin:round}\
.page{fill:#fff}\
@media(prefers-color-scheme:dark){text{fill:#ddd}.grid{stroke:#444}.frame{stroke:#888}\
.recorded{stroke:#e8a94a}.compensated{stroke:#6fb0f5}.page{fill:#1b1b1b}}";

/// The two traces of a compensation, gathered sample by sample in bounded memory.
#[derive(Debug, Clone)]
pub struct Traces {
    range: Option<(f64, f64)>,
    bins: Vec<Bin>,
    samples_per_bin: usize,
    in_last: usize,
}

#[derive(Debug, Clone, Copy)]
struct Bin {
    time_s: f64,
    recorded: Span,
    compensated: Span,
}

/// Smallest and largest value.
#[derive(Debug, Clone, Copy)]
struct Span(f64, f64);

impl Span {
    fn of(value: f64) -> Self {
        Self(value, value)
    }

    fn join(self, other: Self) -> Self {
        Self(self.0.min(other.0), self.1.max(other.1))
    }
}

impl Bin {
    fn join(self, other: Self) -> Self {
        Self {
            time_s: self.time_s,
            recorded: self.recorded.join(other.recorded),
            compensated: self.compensated.join(other.compensated),
        }
    }
}

impl Traces {
    /// No samples yet; only those within the range will be drawn.
    #[must_use]
    pub fn new(range: Option<(f64, f64)>) -> Self {
        Self {
            range,
            bins: Vec::new(),
            samples_per_bin: 1,
            in_last: 0,
        }
    }

    /// Takes the next sample.
    pub fn add(&mut self, time_s: f64, recorded: f64, compensated: f64) {
        if self
            .range
            .is_some_and(|(from, to)| time_s < from || time_s > to)
        {
            return;
        }
        let bin = Bin {
            time_s,
            recorded: Span::of(recorded),
            compensated: Span::of(compensated),
        };
        match self.bins.last_mut() {
            Some(last) if self.in_last < self.samples_per_bin => {
                *last = last.join(bin);
                self.in_last += 1;
            }
            _ => {
                self.bins.push(bin);
                self.in_last = 1;
            }
        }
        // Full bins are joined in pairs, so that all stay of one width.
        if self.bins.len() == MOST_BINS && self.in_last == self.samples_per_bin {
            self.bins = self
                .bins
                .chunks(2)
                .map(|pair| pair[0].join(pair[1]))
                .collect();
            self.samples_per_bin *= 2;
            self.in_last = self.samples_per_bin;
        }
    }

    /// Whether no sample lay within the range.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.bins.is_empty()
    }

    /// The picture.
    #[must_use]
    pub fn svg(&self, unit: &str) -> String {
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
             role=\"img\" aria-label=\"recorded and compensated signal over time\">\n\
             <style>{STYLE}</style>\n<rect class=\"page\" width=\"{WIDTH}\" height=\"{HEIGHT}\"/>\n"
        );
        let (Some(first), Some(last)) = (self.bins.first(), self.bins.last()) else {
            svg.push_str("<text x=\"40\" y=\"40\">no samples in this range</text>\n</svg>\n");
            return svg;
        };
        let time = Axis::around(first.time_s, last.time_s);
        let values = self
            .bins
            .iter()
            .map(|bin| bin.recorded.join(bin.compensated))
            .fold(first.recorded, Span::join);
        let room = 0.04 * (values.1 - values.0);
        let value = Axis::around(values.0 - room, values.1 + room);
        frame(&mut svg, &time, &value, unit);
        for (class, span) in [
            ("recorded", (|b: &Bin| b.recorded) as fn(&Bin) -> Span),
            ("compensated", |b: &Bin| b.compensated),
        ] {
            let points = self.points(&time, &value, span);
            let _ = writeln!(
                svg,
                "<polyline class=\"trace {class}\" points=\"{points}\"/>"
            );
        }
        legend(&mut svg);
        svg.push_str("</svg>\n");
        svg
    }

    fn points(&self, time: &Axis, value: &Axis, span: fn(&Bin) -> Span) -> String {
        let mut points = String::new();
        for bin in &self.bins {
            let x = LEFT + time.part(bin.time_s) * (WIDTH - LEFT - RIGHT);
            let Span(low, high) = span(bin);
            let mut point = |v: f64| {
                let y = HEIGHT - BOTTOM - value.part(v) * (HEIGHT - TOP - BOTTOM);
                let _ = write!(points, "{x:.2},{y:.2} ");
            };
            point(low);
            if high > low {
                point(high);
            }
        }
        points
    }
}

/// A range of values and the steps of its marks.
pub(super) struct Axis {
    low: f64,
    high: f64,
    step: f64,
}

impl Axis {
    /// An axis over a range, its marks at 1, 2 or 5 times a power of ten.
    pub(super) fn around(low: f64, high: f64) -> Self {
        Self::with_marks(low, high, 6.0)
    }

    /// An axis with few marks, for a low picture.
    pub(super) fn coarse(low: f64, high: f64) -> Self {
        Self::with_marks(low, high, 4.0)
    }

    fn with_marks(low: f64, high: f64, count: f64) -> Self {
        let (low, high) = if high > low {
            (low, high)
        } else {
            let half = 0.5_f64.max(1e-6 * low.abs());
            (low - half, low + half)
        };
        let step = mark_step(high - low, count);
        Self { low, high, step }
    }

    pub(super) fn part(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    pub(super) fn marks(&self) -> impl Iterator<Item = f64> {
        let (first, last) = (
            (self.low / self.step).ceil(),
            (self.high / self.step).floor(),
        );
        let step = self.step;
        (0..=(last - first).max(0.0) as usize).map(move |i| (first + i as f64) * step)
    }
}

/// Distance of the marks of an axis, at most about as many as `count`: 1, 2 or 5 times a power of ten.
pub(super) fn mark_step(range: f64, count: f64) -> f64 {
    let rough = range / count;
    let power = 10_f64.powf(rough.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|f| f * power)
        .find(|step| *step >= rough)
        .unwrap_or(10.0 * power)
}

fn frame(svg: &mut String, time: &Axis, value: &Axis, unit: &str) {
    let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
    for mark in time.marks() {
        let x = LEFT + time.part(mark) * (right - LEFT);
        let _ = writeln!(
            svg,
            "<line class=\"grid\" x1=\"{x:.2}\" y1=\"{TOP}\" x2=\"{x:.2}\" y2=\"{bottom}\"/>\
             <text x=\"{x:.2}\" y=\"{:.2}\" text-anchor=\"middle\">{}</text>",
            bottom + 18.0,
            rounded(mark, 6)
        );
    }
    for mark in value.marks() {
        let y = bottom - value.part(mark) * (bottom - TOP);
        let _ = writeln!(
            svg,
            "<line class=\"grid\" x1=\"{LEFT}\" y1=\"{y:.2}\" x2=\"{right}\" y2=\"{y:.2}\"/>\
             <text x=\"{:.2}\" y=\"{:.2}\" text-anchor=\"end\">{}</text>",
            LEFT - 8.0,
            y + 4.5,
            rounded(mark, 6)
        );
    }
    let _ = writeln!(
        svg,
        "<rect class=\"frame\" x=\"{LEFT}\" y=\"{TOP}\" width=\"{}\" height=\"{}\"/>\n\
         <text x=\"{}\" y=\"{}\" text-anchor=\"middle\">time, s</text>\n\
         <text x=\"14\" y=\"22\">{}</text>",
        right - LEFT,
        bottom - TOP,
        0.5 * (LEFT + right),
        HEIGHT - 12.0,
        escaped(unit)
    );
}

fn legend(svg: &mut String) {
    for (x, class, label) in [
        (WIDTH - 300.0, "recorded", "recorded"),
        (WIDTH - 160.0, "compensated", "compensated"),
    ] {
        let _ = writeln!(
            svg,
            "<line class=\"trace {class}\" x1=\"{x}\" y1=\"18\" x2=\"{}\" y2=\"18\"/>\
             <text x=\"{}\" y=\"22\">{label}</text>",
            x + 26.0,
            x + 34.0
        );
    }
}

pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn envelope_keeps_every_extreme_in_bounded_memory() {
        let mut traces = Traces::new(None);
        for i in 0..100_000 {
            let spike = if i == 54_321 { 9.0 } else { 0.0 };
            traces.add(f64::from(i), (f64::from(i) * 0.01).sin(), spike);
        }
        assert!(traces.bins.len() <= MOST_BINS);
        assert!(traces.bins.iter().any(|bin| bin.compensated.1 == 9.0));
        assert!(traces.bins.windows(2).all(|w| w[1].time_s > w[0].time_s));
        let widths: Vec<f64> = traces
            .bins
            .windows(2)
            .map(|w| w[1].time_s - w[0].time_s)
            .collect();
        assert!(widths.iter().all(|w| *w == widths[0]), "bins of one width");
    }

    #[test]
    fn picture_is_well_formed_and_within_its_frame() {
        let mut traces = Traces::new(Some((1.0, 2.0)));
        for i in 0..300 {
            traces.add(0.01 * f64::from(i), 1.0, -1.0 + f64::from(i % 7));
        }
        assert_eq!(traces.bins.len(), 101);
        let svg = traces.svg("N m & <x>");
        assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
        assert!(svg.contains("N m &amp; &lt;x>") && !svg.contains("NaN"));
        assert_eq!(svg.matches("<polyline").count(), 2);
    }

    #[test]
    fn empty_and_constant_traces_are_drawn() {
        assert!(Traces::new(None).svg("V").contains("no samples"));
        let mut traces = Traces::new(None);
        traces.add(0.0, 2.0, 2.0);
        traces.add(1.0, 2.0, 2.0);
        assert!(!traces.svg("V").contains("NaN"));
    }
}
