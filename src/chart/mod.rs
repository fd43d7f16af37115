//! Self-contained SVG charts: lines, dots and bands over linear or logarithmic axes, for light and dark screens and
//! paper. [`picture`] makes a file of stacked charts; [`Page`] combines charts with text.

mod axis;
mod envelope;
mod page;
mod panel;

use maud::{Markup, PreEscaped, html};

use crate::print::visible;

pub(crate) use envelope::Envelope;
pub(crate) use page::Page;
use panel::{FOOT, HEADING, LEFT, Panel, Resolution, px};

/// x and y.
pub(crate) type Point = (f64, f64);

/// Width of a picture in a file, in user units.
const FILE_WIDTH: f64 = 960.0;
/// Height of a file's title.
const TITLE: f64 = 30.0;
/// Width of a chart on a page, and height of its panel.
const PAGE_WIDTH: f64 = 720.0;
const PAGE_PANEL: f64 = 224.0;
/// Number of colours for series.
const COLOURS: usize = 5;
/// Number of columns that a dense line may leave empty; more are a gap.
const BRIDGED: f64 = 3.0;

/// Style of all charts. The colours of the series are distinguishable in greyscale and by the colour-blind. Dark
/// screens have their own colours; paper does not.
const STYLE: &str = "\
text{font:12px system-ui,sans-serif;fill:#222}.name{font-weight:600}\
.paper{fill:#fff}.grid{stroke:#ddd}.frame{fill:none;stroke:#888}\
.rail{stroke:#c0392b;stroke-dasharray:6 4}\
.line{fill:none;stroke:currentColor;stroke-width:1.4;stroke-linejoin:round}\
.dot{fill:currentColor}.band{fill:currentColor;opacity:.2}\
.filled{fill:#c0392b;opacity:.45}.smeared{fill:#c0392b;opacity:.15}.inside{fill:#1f5fa8;opacity:.1}\
.s0{color:#b8690a}.s1{color:#1f5fa8}.s2{color:#2b7d3d}.s3{color:#8a3f99}.s4{color:#555}\
@media screen and (prefers-color-scheme:dark){text{fill:#ddd}.paper{fill:#1b1b1b}.grid{stroke:#444}\
.rail{stroke:#ff7b6b}.s0{color:#eda94c}.s1{color:#74b3f5}.s2{color:#7ccb8c}.s3{color:#d294df}.s4{color:#aaa}}";

/// A chart.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Chart {
    pub(crate) title: String,
    /// Quantity along x, with its unit.
    pub(crate) x_label: String,
    /// Quantity along y, with its unit.
    pub(crate) y_label: String,
    pub(crate) x_log: bool,
    pub(crate) y_log: bool,
    pub(crate) series: Vec<Series>,
    /// An area behind the series, in the colour of the first: x, low, high.
    pub(crate) band: Vec<(f64, f64, f64)>,
    /// Levels marked by dashed lines.
    pub(crate) rails: Vec<f64>,
    /// Highlighted intervals along x.
    pub(crate) spans: Vec<MarkedSpan>,
    /// Colour of the first series, so that the same quantity has the same colour on several charts.
    pub(crate) first_colour: usize,
}

/// A highlighted interval along x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MarkedSpan {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) kind: SpanKind,
}

/// Meaning of an interval along x.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SpanKind {
    /// Samples that were filled in.
    Filled,
    /// Results that depend on filled samples.
    Smeared,
    /// Compensated frequencies.
    Band,
}

impl SpanKind {
    /// All kinds, in drawing order.
    const ALL: [Self; 3] = [Self::Band, Self::Smeared, Self::Filled];

    fn class(self) -> &'static str {
        match self {
            Self::Filled => "filled",
            Self::Smeared => "smeared",
            Self::Band => "inside",
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Filled => "filled in",
            Self::Smeared => "affected by filling",
            Self::Band => "compensated band",
        }
    }
}

/// A series of a chart.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Series {
    /// Name in the legend.
    pub(crate) name: String,
    /// Points; the line is interrupted where y is NaN.
    pub(crate) points: Vec<Point>,
    /// Whether to draw dots instead of a line.
    pub(crate) dots: bool,
    /// Longest distance along x that the line bridges.
    pub(crate) bridged: f64,
}

impl Series {
    pub(crate) fn new(name: &str, points: Vec<Point>) -> Self {
        Self {
            name: name.to_owned(),
            points,
            dots: false,
            bridged: f64::INFINITY,
        }
    }

    /// A line.
    pub(crate) fn line(name: &str, x: &[f64], y: &[f64]) -> Self {
        Self::new(name, x.iter().copied().zip(y.iter().copied()).collect())
    }

    /// Dots.
    pub(crate) fn dots(name: &str, x: &[f64], y: &[f64]) -> Self {
        Self {
            dots: true,
            ..Self::line(name, x, y)
        }
    }

    /// A line through the samples of a recording over a range of x; many samples are reduced on the fly to the
    /// extremes in each column of the picture, and gaps interrupt the line.
    pub(crate) fn recorded(points: impl ExactSizeIterator<Item = Point>, range: Point) -> Self {
        let columns = envelope::COLUMNS as f64;
        let width = (range.1 - range.0) / columns;
        if points.len() <= 2 * envelope::COLUMNS || width <= 0.0 {
            return Self::new("", points.collect());
        }
        let points = envelope::thinned(points, |x| ((x - range.0) / width) as i64);
        Self {
            bridged: BRIDGED * width,
            ..Self::new("", points)
        }
    }
}

impl Chart {
    /// A chart with linear axes.
    pub(crate) fn new(title: &str, x_label: &str, y_label: &str, series: Vec<Series>) -> Self {
        Self {
            title: title.to_owned(),
            x_label: x_label.to_owned(),
            y_label: y_label.to_owned(),
            series,
            ..Self::default()
        }
    }

    /// The kinds of spans present.
    fn span_kinds(&self) -> impl Iterator<Item = SpanKind> {
        let has = |kind: &SpanKind| self.spans.iter().any(|s| s.kind == *kind);
        SpanKind::ALL.into_iter().filter(has)
    }

    fn colour(&self, series: usize) -> usize {
        (self.first_colour + series) % COLOURS
    }

    /// Title and y label, above the panel.
    fn heading(&self, drawable: bool) -> Markup {
        html! {
            text x=(LEFT) y=(px(HEADING - 7.0)) {
                @if !self.title.is_empty() { tspan.name { (self.title) } ", " }
                (self.y_label)
                @if !drawable { " (no numbers)" }
            }
            "\n"
        }
    }

    /// The chart for a page, which writes title and legend beside it.
    fn svg(&self) -> Markup {
        let panel = Panel::new(self, (PAGE_WIDTH, PAGE_PANEL), Resolution::PAGE);
        let height = HEADING + PAGE_PANEL + FOOT;
        html! {
            svg xmlns="http://www.w3.org/2000/svg" viewBox={ "0 0 " (PAGE_WIDTH) " " (height) }
                role="img" aria-label=(self.title) data-axes=[panel.as_ref().map(Panel::axes)] {
                "\n"
                text x="8" y=(px(HEADING - 9.0)) { (self.y_label) @if panel.is_none() { " (no numbers)" } }
                "\n"
                @if let Some(panel) = panel { (panel.markup(true)) }
            }
        }
    }
}

/// A file of stacked charts with panels of equal height. Consecutive charts with the same range of x share its labels.
pub(crate) fn picture(title: &str, panel_height: f64, charts: &[Chart]) -> String {
    let panel = |chart| Panel::new(chart, (FILE_WIDTH, panel_height), Resolution::FILE);
    let panels: Vec<Option<Panel>> = charts.iter().map(panel).collect();
    let labelled = |i: usize| match (&panels[i], panels.get(i + 1)) {
        (Some(this), Some(Some(next))) => !this.shares_x_with(next),
        _ => true,
    };
    let mut top = TITLE;
    let parts: Vec<Markup> = (0..charts.len())
        .map(|i| {
            let at = top;
            top += match &panels[i] {
                Some(_) if labelled(i) => HEADING + panel_height + FOOT,
                Some(_) => HEADING + panel_height,
                None => HEADING,
            };
            html! {
                g transform={ "translate(0 " (at) ")" } {
                    (charts[i].heading(panels[i].is_some()))
                    @if let Some(panel) = &panels[i] { (panel.legend()) (panel.markup(labelled(i))) }
                }
                "\n"
            }
        })
        .collect();
    let file = html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox={ "0 0 " (FILE_WIDTH) " " (top) } role="img" aria-label=(title) {
            "\n"
            style { (PreEscaped(STYLE)) } "\n"
            rect.paper width=(FILE_WIDTH) height=(top) {} "\n"
            text.name x=(LEFT) y="20" { (title) } "\n"
            @for part in &parts { (part) }
        }
        "\n"
    };
    visible(file.into_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The path of the only line.
    fn path(svg: &str) -> &str {
        let line = svg.split("class=\"line").nth(1).unwrap();
        line.split("d=\"")
            .nth(1)
            .unwrap()
            .split('"')
            .next()
            .unwrap()
    }

    fn heights(svg: &str) -> Vec<f64> {
        let points = path(svg).split(['M', 'L']).filter(|p| !p.is_empty());
        points
            .map(|p| p.split(' ').nth(1).unwrap().parse().unwrap())
            .collect()
    }

    #[test]
    fn extremes_are_drawn_and_everything_is_inside() {
        let x: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut y: Vec<f64> = x.iter().map(|v| (v * 0.01).sin()).collect();
        y[54_321] = 9.0;
        let chart = Chart::new("a <b>", "t, s", "V", vec![Series::line("data", &x, &y)]);
        let svg = chart.svg().into_string();
        assert!(svg.contains("a &lt;b&gt;") && svg.len() < 160_000 && !svg.contains("NaN"));
        // The highest point lies 5 % of the range below the top of the frame.
        let top = heights(&svg).into_iter().fold(f64::INFINITY, f64::min);
        let want = HEADING + 0.05 / 1.1 * PAGE_PANEL;
        assert!((top - want).abs() < 0.2, "{top} {want}");
    }

    #[test]
    fn logarithmic_axes_leave_out_what_has_no_logarithm() {
        let series = Series::line("h", &[1.0, 10.0, 100.0], &[0.0, 1e-3, 1e3]);
        let chart = Chart {
            x_log: true,
            y_log: true,
            ..Chart::new("h", "Hz", "1", vec![series])
        };
        let svg = chart.svg().into_string();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        assert!(svg.contains(">100</text>"), "{svg}");
    }

    #[test]
    fn no_points_one_point_and_a_constant_can_be_drawn() {
        let nothing = Chart::default().svg().into_string();
        assert!(nothing.contains("no numbers"));
        let dot = Chart::new("c", "", "", vec![Series::dots("p", &[1.0], &[2.0])]);
        assert!(!dot.svg().into_string().contains("NaN"));
        let level = Chart::new(
            "c",
            "",
            "",
            vec![Series::line("p", &[0.0, 1.0], &[2.0, 2.0])],
        );
        let svg = picture("level & title", 120.0, &[level, Chart::default()]);
        assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
        assert!(svg.contains("level &amp; title") && !svg.contains("NaN"));
        assert_eq!(svg.matches("no numbers").count(), 1);
    }

    #[test]
    fn a_spike_among_a_million_samples_is_drawn() {
        let sample = |i: u32| (f64::from(i), f64::from(u32::from(i == 543_210)));
        let series = Series::recorded((0..1_000_000).map(sample), (0.0, 1e6));
        let svg = picture("f", 120.0, &[Chart::new("", "", "", vec![series])]);
        assert!(svg.len() < 40_000, "{}", svg.len());
        let heights = heights(&svg);
        let highest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        assert_eq!(heights.iter().filter(|y| **y == highest).count(), 1);
    }

    #[test]
    fn holes_and_gaps_lift_the_pen() {
        let drawn = |series: Series| {
            let svg = picture("f", 120.0, &[Chart::new("", "", "", vec![series])]);
            path(&svg).matches('M').count()
        };
        let holes = [0.0, 1.0, f64::NAN, 1.0, 0.0];
        let numbered = holes.iter().enumerate().map(|(i, y)| (i as f64, *y));
        assert_eq!(drawn(Series::recorded(numbered, (0.0, 4.0))), 2);
        let gap = |i: i32| (f64::from(i) + f64::from(i / 2000) * 900.0, 1.0);
        assert_eq!(
            drawn(Series::recorded((0..4000).map(gap), (0.0, 4899.0))),
            2
        );
    }
}
