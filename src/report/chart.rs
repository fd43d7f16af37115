//! Line charts as SVG, for pages: several series, bands, logarithmic axes, nothing loaded from
//! elsewhere. Colours come from the page's style ([`STYLE`]), so that they suit light, dark and print.

use std::fmt::Write;

use super::svg::mark_step;
use crate::print::rounded;

/// Size of a chart and its margins, in user units.
const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 74.0;
const RIGHT: f64 = 26.0;
const TOP: f64 = 30.0;
const BOTTOM: f64 = 46.0;
/// Columns that a long series is drawn as the envelope of.
const COLUMNS: usize = 900;
/// Decades of a logarithmic axis at most.
const MOST_DECADES: f64 = 12.0;

/// Style of the charts on a page; uses the page's `--ink`, `--faint` and `--paper`.
pub const STYLE: &str = "\
svg{width:100%;height:auto;display:block}\
svg text{font:12px system-ui,sans-serif;fill:var(--ink)}\
svg .grid{stroke:var(--faint)}svg .frame{fill:none;stroke:var(--ink);opacity:.5}\
svg .line{fill:none;stroke-width:1.5;stroke-linejoin:round}\
svg .s0{stroke:#b8690a;fill:#b8690a}svg .s1{stroke:#1f5fa8;fill:#1f5fa8}\
svg .s2{stroke:#2b7d3d;fill:#2b7d3d}svg .s3{stroke:#8a3f99;fill:#8a3f99}\
svg polyline{fill:none!important}svg .s1.line{stroke-dasharray:7 3}svg .s2.line{stroke-dasharray:2 3}\
svg .band{stroke:none;opacity:.2}\
svg.swatch{display:inline;width:28px;height:8px}.key span{margin-right:1.2rem;white-space:nowrap;font-size:.85em}\
@media(prefers-color-scheme:dark){svg .s0{stroke:#eda94c;fill:#eda94c}svg .s1{stroke:#74b3f5;fill:#74b3f5}\
svg .s2{stroke:#7ccb8c;fill:#7ccb8c}svg .s3{stroke:#d294df;fill:#d294df}}";

/// A chart.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Chart {
    /// Heading.
    pub title: String,
    /// What lies along x, with its unit.
    pub x_label: String,
    /// What lies along y, with its unit.
    pub y_label: String,
    /// Whether x is logarithmic.
    pub x_log: bool,
    /// Whether y is logarithmic.
    pub y_log: bool,
    /// What is drawn.
    pub series: Vec<Series>,
    /// Ranges drawn behind the series: x, low, high.
    pub band: Vec<(f64, f64, f64)>,
    /// Colour of the first series: what is the same on several charts has the same colour on all of them.
    pub first_colour: usize,
}

/// A series of a chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points; those that are not finite are left out.
    pub points: Vec<(f64, f64)>,
    /// Dots instead of a line.
    pub dots: bool,
}

impl Series {
    /// A line.
    #[must_use]
    pub fn line(name: &str, x: &[f64], y: &[f64]) -> Self {
        Self {
            name: name.to_owned(),
            points: x.iter().copied().zip(y.iter().copied()).collect(),
            dots: false,
        }
    }

    /// Dots.
    #[must_use]
    pub fn dots(name: &str, x: &[f64], y: &[f64]) -> Self {
        Self {
            dots: true,
            ..Self::line(name, x, y)
        }
    }
}

impl Chart {
    /// A chart with linear axes.
    #[must_use]
    pub fn new(title: &str, x_label: &str, y_label: &str, series: Vec<Series>) -> Self {
        Self {
            title: title.to_owned(),
            x_label: x_label.to_owned(),
            y_label: y_label.to_owned(),
            series,
            ..Self::default()
        }
    }

    /// The drawing.
    #[must_use]
    pub fn svg(&self) -> String {
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" \
             aria-label=\"{}\">\n",
            escaped(&self.title)
        );
        let all = || self.series.iter().flat_map(|s| s.points.iter().copied());
        let bands = || {
            self.band
                .iter()
                .flat_map(|(x, low, high)| [(*x, *low), (*x, *high)])
        };
        let x = Scale::over(all().map(|p| p.0), self.x_log, 0.0);
        let y = Scale::over(all().chain(bands()).map(|p| p.1), self.y_log, 0.05);
        let (Some(x), Some(y)) = (x, y) else {
            svg.push_str("<text x=\"40\" y=\"40\">nothing to draw</text>\n</svg>\n");
            return svg;
        };
        self.frame(&mut svg, &x, &y);
        self.draw_band(&mut svg, &x, &y);
        for (k, series) in self.series.iter().enumerate() {
            draw(&mut svg, series, self.colour(k), &x, &y);
        }
        svg.push_str("</svg>\n");
        svg
    }

    fn frame(&self, svg: &mut String, x: &Scale, y: &Scale) {
        let bottom = HEIGHT - BOTTOM;
        for mark in x.marks() {
            let at = across(x, mark);
            let _ = writeln!(
                svg,
                "<line class=\"grid\" x1=\"{at:.1}\" y1=\"{TOP}\" x2=\"{at:.1}\" y2=\"{bottom}\"/>\
                 <text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                bottom + 16.0,
                rounded(mark, 5)
            );
        }
        for mark in y.marks() {
            let at = up(y, mark);
            let _ = writeln!(
                svg,
                "<line class=\"grid\" x1=\"{LEFT}\" y1=\"{at:.1}\" x2=\"{}\" y2=\"{at:.1}\"/>\
                 <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                WIDTH - RIGHT,
                LEFT - 6.0,
                at + 4.0,
                rounded(mark, 5)
            );
        }
        let _ = writeln!(
            svg,
            "<rect class=\"frame\" x=\"{LEFT}\" y=\"{TOP}\" width=\"{}\" height=\"{}\"/>\
             <text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text><text x=\"8\" y=\"18\">{}</text>",
            WIDTH - RIGHT - LEFT,
            bottom - TOP,
            0.5 * (LEFT + WIDTH - RIGHT),
            HEIGHT - 10.0,
            escaped(&self.x_label),
            escaped(&self.y_label)
        );
    }

    fn draw_band(&self, svg: &mut String, x: &Scale, y: &Scale) {
        let edge = |pick: fn(&(f64, f64, f64)) -> f64| {
            move |b: &(f64, f64, f64)| format!("{:.1},{:.1}", across(x, b.0), up(y, pick(b)))
        };
        let whole = |b: &&(f64, f64, f64)| x.has(b.0) && y.has(b.1) && y.has(b.2);
        let inside: Vec<&(f64, f64, f64)> = self.band.iter().filter(whole).collect();
        if inside.len() < 2 {
            return;
        }
        let (high, low) = (edge(|b| b.2), edge(|b| b.1));
        let there = inside.iter().map(|b| high(b));
        let back = inside.iter().rev().map(|b| low(b));
        let points: Vec<String> = there.chain(back).collect();
        let _ = writeln!(
            svg,
            "<polygon class=\"band s{}\" points=\"{}\"/>",
            self.colour(0),
            points.join(" ")
        );
    }

    fn colour(&self, series: usize) -> usize {
        (self.first_colour + series) % 4
    }

    /// Which line is which, as text beside a piece of each: a page sets it in lines as wide as the screen.
    #[must_use]
    pub fn key(&self) -> String {
        let entry = |(k, series): (usize, &Series)| {
            let colour = self.colour(k);
            let mark = match series.dots {
                true => format!("<circle class=\"s{colour}\" cx=\"14\" cy=\"4\" r=\"3.5\"/>"),
                false => format!("<polyline class=\"line s{colour}\" points=\"0,4 28,4\"/>"),
            };
            format!(
                "<span><svg class=\"swatch\" viewBox=\"0 0 28 8\" aria-hidden=\"true\">{mark}</svg> {}</span>",
                escaped(&series.name)
            )
        };
        self.series.iter().enumerate().map(entry).collect()
    }
}

fn across(x: &Scale, value: f64) -> f64 {
    LEFT + x.part(value) * (WIDTH - LEFT - RIGHT)
}

fn up(y: &Scale, value: f64) -> f64 {
    HEIGHT - BOTTOM - y.part(value) * (HEIGHT - TOP - BOTTOM)
}

fn draw(svg: &mut String, series: &Series, colour: usize, x: &Scale, y: &Scale) {
    let inside = series.points.iter().filter(|p| x.has(p.0) && y.has(p.1));
    if series.dots && series.points.len() <= COLUMNS {
        for (px, py) in inside {
            let _ = write!(
                svg,
                "<circle class=\"s{colour}\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"3.5\"/>",
                across(x, *px),
                up(y, *py)
            );
        }
        svg.push('\n');
        return;
    }
    let places: Vec<(f64, f64)> = inside.map(|p| (across(x, p.0), up(y, p.1))).collect();
    let points: String = thinned(&places)
        .iter()
        .map(|(px, py)| format!("{px:.1},{py:.1} "))
        .collect();
    let _ = writeln!(
        svg,
        "<polyline class=\"line s{colour}\" points=\"{}\"/>",
        points.trim_end()
    );
}

/// At most the first, lowest, highest and last point of each column.
fn thinned(places: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if places.len() <= 4 * COLUMNS {
        return places.to_vec();
    }
    let column = |p: &(f64, f64)| ((p.0 - LEFT) / (WIDTH - LEFT - RIGHT) * COLUMNS as f64) as i64;
    let mut out = Vec::new();
    for chunk in places.chunk_by(|a, b| column(a) == column(b)) {
        let by = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let ends = [chunk.iter().min_by(by), chunk.iter().max_by(by)];
        out.push(chunk[0]);
        out.extend(ends.into_iter().flatten());
        out.push(chunk[chunk.len() - 1]);
    }
    out
}

/// A range of an axis.
struct Scale {
    low: f64,
    high: f64,
    log: bool,
}

impl Scale {
    fn over(values: impl Iterator<Item = f64>, log: bool, room: f64) -> Option<Self> {
        let usable = |v: &f64| v.is_finite() && (!log || *v > 0.0);
        let place = |v: f64| if log { v.log10() } else { v };
        let (low, high) = values
            .filter(usable)
            .map(place)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
                (l.min(v), h.max(v))
            });
        if low > high {
            return None;
        }
        let low = if log {
            low.max(high - MOST_DECADES)
        } else {
            low
        };
        let spare = match high > low {
            true => room * (high - low),
            false => 0.5,
        };
        Some(Self {
            low: low - spare,
            high: high + spare,
            log,
        })
    }

    fn has(&self, value: f64) -> bool {
        value.is_finite() && (!self.log || value.log10() >= self.low)
    }

    fn part(&self, value: f64) -> f64 {
        let place = if self.log { value.log10() } else { value };
        (place - self.low) / (self.high - self.low)
    }

    /// Values to mark: 1, 2 or 5 times powers of ten; on a long logarithmic axis the powers alone.
    fn marks(&self) -> Vec<f64> {
        if self.log && self.high - self.low > 1.2 {
            let every = ((self.high - self.low) / 6.0).ceil().max(1.0) as i32;
            let (from, to) = (self.low.ceil() as i32, self.high.floor() as i32);
            let powers = (from..=to)
                .filter(|d| d % every == 0)
                .map(|d| 10_f64.powi(d));
            if to - from >= 3 {
                return powers.collect();
            }
            // Few powers are too few to read from: 2 and 5 times them as well.
            return (from - 1..=to)
                .flat_map(|d| [1.0, 2.0, 5.0].map(|f| f * 10_f64.powi(d)))
                .filter(|v| (self.low..=self.high).contains(&v.log10()))
                .collect();
        }
        let value = |place: f64| if self.log { 10_f64.powf(place) } else { place };
        let (low, high) = (value(self.low), value(self.high));
        let step = mark_step(high - low, 6.0);
        let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
        (first..=last).map(|i| i as f64 * step).collect()
    }
}

/// Text for a page.
#[must_use]
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_are_drawn_and_everything_is_inside() {
        let x: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut y: Vec<f64> = x.iter().map(|v| (v * 0.01).sin()).collect();
        y[54_321] = 9.0;
        let svg = Chart::new("a <b>", "t, s", "V", vec![Series::line("data", &x, &y)]).svg();
        assert!(svg.contains("a &lt;b&gt;") && svg.len() < 80_000 && !svg.contains("NaN"));
        let points = svg
            .split("points=\"")
            .nth(1)
            .unwrap()
            .split('"')
            .next()
            .unwrap();
        let heights: Vec<f64> = points
            .split(' ')
            .map(|p| p.split(',').nth(1).unwrap().parse().unwrap())
            .collect();
        // The highest point lies 5 % of the range below the top of the frame.
        let top = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let want = TOP + 0.05 / 1.1 * (HEIGHT - TOP - BOTTOM);
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
        let svg = chart.svg();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        assert!(svg.contains(">100</text>"), "{svg}");
        assert!(Chart::default().svg().contains("nothing to draw"));
        assert!(
            !Chart::new("c", "", "", vec![Series::dots("p", &[1.0], &[2.0])])
                .svg()
                .contains("NaN")
        );
    }
}
