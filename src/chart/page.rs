//! A page for a browser: one file, nothing loaded from elsewhere, for screens of any width, in light
//! and dark, and on paper.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{Chart, STYLE as CHART_STYLE, Series};
use crate::print::visible;

/// Style of the page.
const STYLE: &str = "\
:root{--ink:#1c1c1c;--faint:#dcdcdc;--paper:#fff;--mark:#8a4b00}\
@media screen and (prefers-color-scheme:dark){:root{--ink:#e4e4e4;--faint:#3d3d3d;--paper:#171717;--mark:#f0b66a}}\
@media print{section,figure,table{break-inside:avoid}}\
*{box-sizing:border-box}body{margin:0 auto;padding:1.2rem;max-width:60rem;background:var(--paper);\
color:var(--ink);font:15px/1.5 system-ui,sans-serif;overflow-wrap:anywhere}h1{font-size:1.5rem;margin:0 0 .3rem;break-after:avoid}\
h2{font-size:1.1rem;margin:1.8rem 0 .5rem;break-after:avoid}p{margin:.4rem 0}.wide{overflow-x:auto}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums}\
th,td{padding:.25rem .8rem .25rem 0;text-align:right;border-bottom:1px solid var(--faint);white-space:nowrap}\
th:first-child,td:first-child{text-align:left}\
th.prose,td.prose{text-align:left;white-space:normal;min-width:15rem}.warn{border-left:3px solid var(--mark);padding-left:.7rem}\
code{font-size:.9em}figure{margin:1rem 0}figcaption{font-weight:600;font-size:.95rem}\
svg{width:100%;height:auto;display:block}.s1.line{stroke-dasharray:7 3}.s2.line{stroke-dasharray:2 3}\
svg.swatch{display:inline;width:28px;height:8px}.key span{margin-right:1.2rem;white-space:nowrap;font-size:.85em}\
@media(max-width:480px){body{padding:.7rem;font-size:14px}svg text{font-size:16px!important}\
th,td{padding-right:.45rem;font-size:13px;overflow-wrap:normal}\
td:first-child,th:first-child{white-space:normal}th.prose,td.prose{min-width:9rem}}";

/// Letters of the longest cell above which a column holds sentences.
const PROSE: usize = 36;

/// A page under construction.
#[derive(Debug, Clone, Default)]
pub(crate) struct Page {
    title: String,
    body: Vec<Markup>,
}

impl Page {
    /// A page with its heading only.
    pub(crate) fn new(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            body: vec![html! { h1 { (title) } }],
        }
    }

    pub(crate) fn heading(&mut self, text: &str) {
        self.body.push(html! { h2 { (text) } });
    }

    /// A paragraph.
    pub(crate) fn text(&mut self, text: &str) {
        self.body.push(html! { p { (text) } });
    }

    pub(crate) fn warning(&mut self, code: &str, message: &str) {
        self.body
            .push(html! { p.warn { code { (code) } " " (message) } });
    }

    /// A table; the first row is its head. A column of sentences is set as text, one of numbers to the right.
    pub(crate) fn table(&mut self, rows: &[Vec<String>]) {
        let width = rows.iter().map(Vec::len).max().unwrap_or(0);
        let is_prose = |k: usize| {
            let mut cells = rows.iter().filter_map(|row| row.get(k));
            cells.any(|cell| cell.chars().count() > PROSE)
        };
        let class: Vec<Option<&str>> = (0..width).map(|k| is_prose(k).then_some("prose")).collect();
        self.body.push(html! {
            div.wide {
                table {
                    "\n"
                    @for (i, row) in rows.iter().enumerate() {
                        tr {
                            @for (cell, class) in row.iter().zip(&class) {
                                @if i == 0 { th class=[class] { (cell) } }
                                @else { td class=[class] { (cell) } }
                            }
                        }
                        "\n"
                    }
                }
            }
        });
    }

    /// A chart under its title and legend.
    pub(crate) fn chart(&mut self, chart: &Chart) {
        self.body.push(html! {
            figure {
                figcaption { (chart.title) } "\n"
                div.key { (key(chart)) } "\n"
                (chart.svg())
            }
        });
    }

    /// The page as a file.
    pub(crate) fn html(&self) -> String {
        let page = html! {
            (DOCTYPE) "\n"
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    title { (self.title) }
                    style { (PreEscaped(CHART_STYLE)) (PreEscaped(STYLE)) }
                }
                "\n"
                body {
                    "\n"
                    @for part in &self.body { (part) "\n" }
                }
            }
            "\n"
        };
        visible(page.into_string())
    }
}

/// The legend of a chart as text: the page breaks it into lines as wide as the screen.
fn key(chart: &Chart) -> Markup {
    let mark = |series: &Series, k: usize| {
        let colour = format!("s{}", chart.colour(k));
        html! {
            @if series.dots { circle.dot.(colour) cx="14" cy="4" r="3.5" {} }
            @else { path.line.(colour) d="M0 4L28 4" {} }
        }
    };
    html! {
        @for (k, series) in chart.series.iter().enumerate() {
            span {
                svg.swatch viewBox="0 0 28 8" aria-hidden="true" { (mark(series, k)) } " " (series.name)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_needs_nothing_else_and_escapes_what_it_is_given() {
        let mut page = Page::new("a < b");
        page.table(&[vec!["x".to_owned()], vec!["<script>".to_owned()]]);
        page.warning("code", "message");
        page.chart(&Chart::default());
        let html = page.html();
        assert!(html.starts_with("<!DOCTYPE html>") && html.contains("a &lt; b"));
        assert!(!html.contains("<script") && html.contains("&lt;script&gt;"));
        let addresses = html.matches("http").count();
        assert_eq!(
            addresses,
            html.matches("http://www.w3.org/2000/svg").count()
        );
        for external in ["src=", "href=", "url(", "@import"] {
            assert!(!html.contains(external), "{external}");
        }
    }
}
