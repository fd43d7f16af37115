//! Channels drawn one above the other, as an SVG file that needs nothing else.

use std::fmt::Write;

use super::svg::{Axis, escaped};
use crate::print::rounded;

/// Size of the picture, its margins, and of a panel, in user units.
const WIDTH: f64 = 960.0;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 18.0;
const PANEL: f64 = 120.0;
const TITLE: f64 = 24.0;
const FOOT: f64 = 40.0;
const TOP: f64 = 34.0;
/// Columns that a trace is gathered in, as its smallest and largest sample in each.
const COLUMNS: usize = 858;
/// Times farther from zero than this many lengths of the record are counted from its start.
const FAR: f64 = 1e4;
/// Columns that a trace may leave empty where it goes on; more are a gap.
const BRIDGED: usize = 2;

/// Colours for light and dark surroundings and for paper.
const STYLE: &str = "\
text{font:12px system-ui,sans-serif;fill:#222}.name{font-weight:600}\
.grid{stroke:#ddd}.frame{fill:none;stroke:#888}\
.trace{fill:none;stroke:#1f5fa8;stroke-width:1.2;stroke-linejoin:round}\
.rail{stroke:#c0392b;stroke-dasharray:6 4}.page{fill:#fff}\
@media(prefers-color-scheme:dark){text{fill:#ddd}.grid{stroke:#444}\
.trace{stroke:#6fb0f5}.rail{stroke:#ff7b6b}.page{fill:#1b1b1b}}\
@media print{text{fill:#000}.page{fill:#fff}.grid{stroke:#ddd}.trace{stroke:#1f5fa8}}";

/// A channel to be drawn.
#[derive(Debug, Clone)]
pub struct Panel<'a> {
    /// Title: its name.
    pub name: String,
    /// Its unit; empty if there is none.
    pub unit: String,
    /// Its samples; `NaN` is left out.
    pub samples: &'a [f64],
    /// Their times.
    pub times: Times<'a>,
    /// Values that the channel is cut off at.
    pub rails: Vec<f64>,
}

/// Where samples lie on the horizontal axis.
#[derive(Debug, Clone, Copy)]
pub enum Times<'a> {
    /// At stamps in seconds.
    Stamps(&'a [f64]),
    /// Uniformly, from a start in seconds at a rate in Hz.
    Uniform {
        /// Time of the first sample.
        start_s: f64,
        /// Samples a second.
        rate_hz: f64,
    },
    /// The time is unknown: by their number.
    Numbers,
}

impl Times<'_> {
    fn at(&self, index: usize) -> f64 {
        match self {
            Self::Stamps(stamps) => stamps.get(index).copied().unwrap_or(f64::NAN),
            Self::Uniform { start_s, rate_hz } => start_s + index as f64 / rate_hz,
            Self::Numbers => (index + 1) as f64,
        }
    }

    fn unit(&self) -> &'static str {
        match self {
            Self::Numbers => "sample",
            _ => "s",
        }
    }
}

/// The picture of all panels. Those with the same horizontal range share its labels.
#[must_use]
pub fn svg(title: &str, panels: &[Panel]) -> String {
    let ranges: Vec<Option<(f64, f64)>> = panels.iter().map(horizontal).collect();
    let is_last = |i: usize| {
        let same =
            |j: usize| ranges[j] == ranges[i] && panels[j].times.unit() == panels[i].times.unit();
        i + 1 == panels.len() || !same(i + 1)
    };
    let heights = (0..panels.len()).map(|i| TITLE + PANEL + if is_last(i) { FOOT } else { 0.0 });
    let height = TOP + heights.sum::<f64>() + 8.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" \
         aria-label=\"channels over time\">\n<style>{STYLE}</style>\n\
         <rect class=\"page\" width=\"{WIDTH}\" height=\"{height}\"/>\n\
         <text x=\"{LEFT}\" y=\"20\" class=\"name\">{}</text>\n",
        escaped(title)
    );
    let mut top = TOP;
    for (i, panel) in panels.iter().enumerate() {
        top += TITLE;
        draw(&mut svg, panel, ranges[i], top, is_last(i));
        top += PANEL + if is_last(i) { FOOT } else { 0.0 };
    }
    svg.push_str("</svg>\n");
    svg
}

/// First and last time of the samples.
fn horizontal(panel: &Panel) -> Option<(f64, f64)> {
    let ends = match panel.times {
        Times::Stamps(stamps) => torqcomp_dsp::quality::range(stamps),
        _ => Some((
            panel.times.at(0),
            panel.times.at(panel.samples.len().saturating_sub(1)),
        )),
    };
    ends.filter(|_| torqcomp_dsp::quality::range(panel.samples).is_some())
}

fn draw(svg: &mut String, panel: &Panel, ends: Option<(f64, f64)>, top: f64, is_last: bool) {
    let (Some((from, to)), Some((low, high))) = (ends, torqcomp_dsp::quality::range(panel.samples))
    else {
        heading(svg, panel, top, " (no numbers)");
        return;
    };
    let zero = if from.abs() > FAR * (to - from) {
        from
    } else {
        0.0
    };
    let time = Axis::around(from - zero, to - zero);
    let room = 0.06 * (high - low);
    let value = Axis::coarse(low - room, high + room);
    heading(svg, panel, top, "");
    let title = match panel.times {
        Times::Numbers => "sample".to_owned(),
        _ if zero != 0.0 => format!("time after {} s, s", rounded(zero, 12)),
        _ => "time, s".to_owned(),
    };
    frame(svg, &time, &value, top, is_last.then_some(title.as_str()));
    for rail in &panel.rails {
        let y = top + PANEL * (1.0 - value.part(*rail));
        let _ = writeln!(
            svg,
            "<line class=\"rail\" x1=\"{LEFT}\" y1=\"{y:.1}\" x2=\"{:.1}\" y2=\"{y:.1}\"/>",
            WIDTH - RIGHT
        );
    }
    let path = trace(panel, |i| time.part(panel.times.at(i) - zero), &value, top);
    let _ = writeln!(svg, "<path class=\"trace\" d=\"{path}\"/>");
}

fn heading(svg: &mut String, panel: &Panel, top: f64, note: &str) {
    let unit = if panel.unit.is_empty() {
        "unit not given".to_owned()
    } else {
        escaped(&panel.unit)
    };
    let _ = writeln!(
        svg,
        "<text x=\"{LEFT}\" y=\"{:.1}\"><tspan class=\"name\">{}</tspan>, {unit}{note}</text>",
        top - 6.0,
        escaped(&panel.name)
    );
}

fn frame(svg: &mut String, time: &Axis, value: &Axis, top: f64, title: Option<&str>) {
    let (right, bottom) = (WIDTH - RIGHT, top + PANEL);
    for mark in time.marks() {
        let x = LEFT + time.part(mark) * (right - LEFT);
        let _ = writeln!(
            svg,
            "<line class=\"grid\" x1=\"{x:.1}\" y1=\"{top:.1}\" x2=\"{x:.1}\" y2=\"{bottom:.1}\"/>"
        );
        if title.is_some() {
            let _ = writeln!(
                svg,
                "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                bottom + 15.0,
                rounded(mark, 9)
            );
        }
    }
    for mark in value.marks() {
        let y = bottom - value.part(mark) * PANEL;
        let _ = writeln!(
            svg,
            "<line class=\"grid\" x1=\"{LEFT}\" y1=\"{y:.1}\" x2=\"{right}\" y2=\"{y:.1}\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            LEFT - 7.0,
            y + 4.0,
            rounded(mark, 9)
        );
    }
    let _ = writeln!(
        svg,
        "<rect class=\"frame\" x=\"{LEFT}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{PANEL}\"/>",
        right - LEFT
    );
    if let Some(title) = title {
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{title}</text>",
            0.5 * (LEFT + right),
            bottom + 31.0
        );
    }
}

/// A column of the picture: the first, smallest, largest and last sample in it.
#[derive(Clone, Copy)]
struct Column {
    first: f64,
    low: f64,
    high: f64,
    last: f64,
}

/// The path of a trace: every sample if they are few, else what each column holds.
fn trace(panel: &Panel, part: impl Fn(usize) -> f64, value: &Axis, top: f64) -> String {
    let x = |part: f64| LEFT + part * (WIDTH - LEFT - RIGHT);
    let y = |v: f64| top + PANEL * (1.0 - value.part(v));
    let points = panel.samples.iter().enumerate();
    let points = points.map(|(i, v)| (part(i), *v));
    let mut path = Path::default();
    if panel.samples.len() <= 2 * COLUMNS {
        for (part, v) in points {
            path.point(x(part), y(v));
        }
        return path.text;
    }
    let mut columns: Vec<Option<Column>> = vec![None; COLUMNS + 1];
    for (part, v) in points.filter(|(part, v)| part.is_finite() && v.is_finite()) {
        let column = &mut columns[(part.clamp(0.0, 1.0) * COLUMNS as f64) as usize];
        *column = Some(column.map_or(
            Column {
                first: v,
                low: v,
                high: v,
                last: v,
            },
            |c| Column {
                low: c.low.min(v),
                high: c.high.max(v),
                last: v,
                ..c
            },
        ));
    }
    let mut empty = 0;
    for (i, column) in columns.iter().enumerate() {
        let Some(c) = column else {
            empty += 1;
            continue;
        };
        if empty > BRIDGED {
            path.lift();
        }
        empty = 0;
        let at = x(i as f64 / COLUMNS as f64);
        for v in [c.first, c.low, c.high, c.last] {
            path.point(at, y(v));
        }
    }
    path.text
}

/// Text of an SVG path under way.
#[derive(Default)]
struct Path {
    text: String,
    is_down: bool,
    last: (f64, f64),
}

impl Path {
    fn lift(&mut self) {
        self.is_down = false;
    }

    fn point(&mut self, x: f64, y: f64) {
        if !(x.is_finite() && y.is_finite()) {
            self.lift();
            return;
        }
        let (x, y) = ((10.0 * x).round() / 10.0, (10.0 * y).round() / 10.0);
        if self.is_down && (x, y) == self.last {
            return;
        }
        let command = if self.is_down { 'L' } else { 'M' };
        let _ = write!(self.text, "{command}{x} {y}");
        self.is_down = true;
        self.last = (x, y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel<'a>(samples: &'a [f64], times: Times<'a>) -> Panel<'a> {
        Panel {
            name: "a & b".to_owned(),
            unit: String::new(),
            samples,
            times,
            rails: vec![],
        }
    }

    /// Vertical positions in a path.
    fn heights(svg: &str) -> Vec<f64> {
        let path = svg.split("d=\"").nth(1).unwrap().split('"').next().unwrap();
        let points = path.split(['M', 'L']).filter(|p| !p.is_empty());
        points
            .map(|p| p.split(' ').nth(1).unwrap().parse().unwrap())
            .collect()
    }

    #[test]
    fn a_spike_among_a_million_samples_is_drawn() {
        let mut samples = vec![0.0; 1_000_000];
        samples[543_210] = 1.0;
        let times = Times::Uniform {
            start_s: 0.0,
            rate_hz: 1000.0,
        };
        let text = svg("f", &[panel(&samples, times)]);
        assert!(text.len() < 40_000, "{}", text.len());
        let heights = heights(&text);
        let highest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        assert_eq!(heights.iter().filter(|y| **y == highest).count(), 1);
        assert!(text.contains("a &amp; b") && !text.contains("NaN"));
    }

    #[test]
    fn holes_and_gaps_lift_the_pen() {
        let samples = [0.0, 1.0, f64::NAN, 1.0, 0.0];
        let text = svg("f", &[panel(&samples, Times::Numbers)]);
        let path = text
            .split("d=\"")
            .nth(1)
            .unwrap()
            .split('"')
            .next()
            .unwrap();
        assert_eq!(path.matches('M').count(), 2);
        let nothing = svg(
            "f",
            &[
                panel(&[f64::NAN], Times::Numbers),
                panel(&[], Times::Numbers),
            ],
        );
        assert_eq!(nothing.matches("no numbers").count(), 2);
        let stamps: Vec<f64> = (0..4000)
            .map(|i| f64::from(i) + f64::from(i / 2000) * 900.0)
            .collect();
        let values = vec![1.0; 4000];
        let text = svg("f", &[panel(&values, Times::Stamps(&stamps))]);
        let path = text
            .split("d=\"")
            .nth(1)
            .unwrap()
            .split('"')
            .next()
            .unwrap();
        assert_eq!(path.matches('M').count(), 2);
    }
}
