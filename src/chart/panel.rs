//! Drawing of one chart into its part of a picture: axes, ticks, bands, lines and dots.

use std::fmt::Write;
use torqcomp_dsp::sort_by_number;

use maud::{Markup, html};

use super::axis::Axis;
use super::envelope::{COLUMNS, thinned};
use super::{Chart, MarkedSpan, Point, Series, SpanKind};
use crate::print::rounded;

/// Margins of a panel, in user units.
pub(super) const LEFT: f64 = 78.0;
pub(super) const RIGHT: f64 = 22.0;
pub(super) const HEADING: f64 = 26.0;
pub(super) const FOOT: f64 = 44.0;
/// Height below which a panel has fewer ticks.
const LOW: f64 = 200.0;
/// Significant digits of a tick label.
const DIGITS: u32 = 9;
/// Gap between spans that is not drawn, and width of the shortest.
const CLOSE: f64 = 0.5;
/// Width of a legend entry.
const ENTRY: f64 = 150.0;

/// Resolution of a picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Resolution {
    /// Number of columns that a long series is reduced to.
    columns: usize,
    /// Steps of a position per user unit.
    steps: f64,
}

impl Resolution {
    /// For a static picture.
    pub(super) const FILE: Self = Self {
        columns: COLUMNS,
        steps: 10.0,
    };
    /// For a chart that can be zoomed.
    pub(super) const PAGE: Self = Self {
        columns: 2048,
        steps: 100.0,
    };
}

/// A chart and its position in the picture.
pub(super) struct Panel<'a> {
    chart: &'a Chart,
    resolution: Resolution,
    x: Axis,
    y: Axis,
    bottom: f64,
    right: f64,
}

impl<'a> Panel<'a> {
    /// `None` if no point can be drawn.
    pub(super) fn new(
        chart: &'a Chart,
        (width, height): (f64, f64),
        resolution: Resolution,
    ) -> Option<Self> {
        let points = || chart.series.iter().flat_map(|s| s.points.iter().copied());
        let bands = chart.band.iter().flat_map(|(_, low, high)| [*low, *high]);
        let heights = points().map(|p| p.1).chain(bands);
        Some(Self {
            chart,
            resolution,
            x: Axis::over(points().map(|p| p.0), chart.x_log, 0.0)?,
            y: Axis::over(heights, chart.y_log, 0.05)?,
            bottom: HEADING + height,
            right: width - RIGHT,
        })
    }

    /// Whether both have the same x axis.
    pub(super) fn shares_x_with(&self, other: &Self) -> bool {
        self.x == other.x && self.chart.x_label == other.chart.x_label
    }

    fn across(&self, x: f64) -> f64 {
        LEFT + self.x.part(x) * (self.right - LEFT)
    }

    fn up(&self, y: f64) -> f64 {
        self.bottom - self.y.part(y) * (self.bottom - HEADING)
    }

    /// The panel; with `labelled` including the tick labels and label of x.
    pub(super) fn markup(&self, labelled: bool) -> Markup {
        let (left, right) = (px(LEFT), px(self.right));
        html! {
            (self.grid(labelled))
            rect.frame x=(left) y=(px(HEADING)) width=(px(self.right - LEFT)) height=(px(self.bottom - HEADING)) {}
            "\n"
            @if labelled {
                text x=(px(0.5 * (LEFT + self.right))) y=(px(self.bottom + 34.0)) text-anchor="middle" {
                    (self.chart.x_label)
                }
                "\n"
            }
            (self.spans())
            @for rail in &self.chart.rails {
                @let y = px(self.up(*rail));
                line.rail x1=(left) y1=(y) x2=(right) y2=(y) {} "\n"
            }
            (self.band())
            @for (k, series) in self.chart.series.iter().enumerate() {
                (self.series(series, self.chart.colour(k)))
            }
        }
    }

    fn grid(&self, labelled: bool) -> Markup {
        let few = self.bottom - HEADING < LOW;
        let (left, right) = (px(LEFT), px(self.right));
        let (top, bottom) = (px(HEADING), px(self.bottom));
        html! {
            @for mark in self.x.marks(6.0) {
                @let x = px(self.across(mark));
                line.grid x1=(x) y1=(top) x2=(x) y2=(bottom) {}
                @if labelled {
                    text x=(x) y=(px(self.bottom + 16.0)) text-anchor="middle" { (rounded(mark, DIGITS)) }
                }
                "\n"
            }
            @for mark in self.y.marks(if few { 4.0 } else { 6.0 }) {
                @let y = self.up(mark);
                line.grid x1=(left) y1=(px(y)) x2=(right) y2=(px(y)) {}
                text x=(px(LEFT - 7.0)) y=(px(y + 4.0)) text-anchor="end" { (rounded(mark, DIGITS)) }
                "\n"
            }
        }
    }

    /// Both axes for the script of a page: the frame in user units, and the values at its ends, or their logarithms.
    pub(super) fn axes(&self) -> String {
        let frame = [LEFT, self.right, HEADING, self.bottom].map(px).join(" ");
        format!("{frame} {} {}", self.x.ends(), self.y.ends())
    }

    fn spans(&self) -> Markup {
        let places = |kind: SpanKind| {
            let is_drawn = move |s: &&MarkedSpan| {
                s.kind == kind && self.x.part(s.from) <= 1.0 && self.x.part(s.to) >= 0.0
            };
            let place = |s: &MarkedSpan| {
                let part = |x: f64| self.x.part(x).clamp(0.0, 1.0);
                let [from, to] = [s.from, s.to].map(|x| LEFT + part(x) * (self.right - LEFT));
                (from, to)
            };
            let mut all: Vec<Point> = self
                .chart
                .spans
                .iter()
                .filter(is_drawn)
                .map(place)
                .collect();
            sort_by_number(&mut all, |(start, _)| *start);
            // Spans that (nearly) overlap are merged.
            all.dedup_by(|later, first| {
                let joins = later.0 <= first.1 + CLOSE;
                if joins {
                    first.1 = first.1.max(later.1);
                }
                joins
            });
            all
        };
        html! {
            @for kind in SpanKind::ALL {
                @for (from, to) in places(kind) {
                    // A short one remains visible.
                    rect.(kind.class()) x=(px(from)) y=(px(HEADING)) width=(px((to - from).max(CLOSE))) height=(px(self.bottom - HEADING)) {}
                    "\n"
                }
            }
        }
    }

    fn band(&self) -> Markup {
        let drawable = |(x, low, high): &&(f64, f64, f64)| {
            self.x.contains(*x) && self.y.contains(*low) && self.y.contains(*high)
        };
        let inside: Vec<_> = self.chart.band.iter().filter(drawable).collect();
        let upper = inside.iter().map(|(x, _, high)| (*x, *high));
        let lower = inside.iter().rev().map(|(x, low, _)| (*x, *low));
        let outline = upper
            .chain(lower)
            .map(|(x, y)| (self.across(x), self.up(y)));
        html! {
            @if inside.len() > 1 {
                path.band.{ "s" (self.chart.colour(0)) } d=(path(outline, f64::INFINITY, self.resolution.steps)) {} "\n"
            }
        }
    }

    fn series(&self, series: &Series, colour: usize) -> Markup {
        let inside = |p: &&Point| self.x.contains(p.0) && (self.y.contains(p.1) || p.1.is_nan());
        let place = |p: &Point| (self.across(p.0), self.up(p.1));
        let places = series.points.iter().filter(inside).map(place);
        let class = format!("s{colour}");
        let Resolution { columns, steps } = self.resolution;
        if series.dots && series.points.len() <= columns {
            return html! {
                @for (x, y) in places.filter(|p| p.1.is_finite()) {
                    circle.dot.(class) cx=(px(x)) cy=(px(y)) r="3.5" {}
                }
                "\n"
            };
        }
        let bridged = series.bridged * (self.across(1.0) - self.across(0.0));
        let line = if series.points.len() <= 4 * columns {
            path(places, bridged, steps)
        } else {
            let per_column = (self.right - LEFT) / columns as f64;
            let places = thinned(places, |x| (x / per_column) as i64);
            path(places.into_iter(), bridged, steps)
        };
        html! { path.line.(class) d=(line) {} "\n" }
    }

    /// Names of several series and of spans with a sample of each, above the panel to the right.
    pub(super) fn legend(&self) -> Markup {
        let (series, kinds) = (&self.chart.series, self.chart.span_kinds());
        let kinds: Vec<SpanKind> = kinds.collect();
        let count = match series.len() {
            0 | 1 => 0,
            several => several,
        };
        let entry = |k: usize| self.right - ENTRY * (count + kinds.len() - k) as f64;
        html! {
            @for (k, series) in series.iter().take(count).enumerate() {
                line.line.{ "s" (self.chart.colour(k)) }
                    x1=(px(entry(k))) y1=(px(HEADING - 11.0)) x2=(px(entry(k) + 26.0)) y2=(px(HEADING - 11.0)) {}
                text x=(px(entry(k) + 34.0)) y=(px(HEADING - 7.0)) { (series.name) }
                "\n"
            }
            @for (k, kind) in kinds.iter().enumerate() {
                rect.(kind.class()) x=(px(entry(count + k))) y=(px(HEADING - 16.0)) width="26" height="10" {}
                text x=(px(entry(count + k) + 34.0)) y=(px(HEADING - 7.0)) { (kind.name()) }
                "\n"
            }
        }
    }
}

/// A length or position with one decimal.
pub(super) fn px(value: f64) -> String {
    format!("{value:.1}")
}

/// A line through points rounded to 1/`steps` of a unit; the pen is lifted where one is not finite and over distances
/// above `bridged`.
fn path(places: impl Iterator<Item = Point>, bridged: f64, steps: f64) -> String {
    let mut text = String::new();
    let mut last: Option<Point> = None;
    for (x, y) in places {
        if !(x.is_finite() && y.is_finite()) {
            last = None;
            continue;
        }
        let place = ((steps * x).round() / steps, (steps * y).round() / steps);
        if last == Some(place) {
            continue;
        }
        let drawn = last.is_some_and(|last| place.0 - last.0 <= bridged);
        let command = if drawn { 'L' } else { 'M' };
        let _ = write!(text, "{command}{} {}", place.0, place.1);
        last = Some(place);
    }
    text
}
