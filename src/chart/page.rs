//! A self-contained HTML page for screens of any width, in light and dark, and for paper.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{Chart, STYLE as CHART_STYLE, Series};
use crate::packed_text::{packed, unpack};
use crate::print::visible;

/// Style of the page.
const STYLE: &[u8] = packed!("page.css");
/// Zoom and values under the cursor; without it the charts are static.
const SCRIPT: &[u8] = packed!("zoom.js");

/// Length of the longest cell above which a column contains prose.
const PROSE: usize = 36;

/// A page under construction.
#[derive(Debug, Clone, Default)]
pub(crate) struct Page {
    title: String,
    body: Vec<Markup>,
}

impl Page {
    /// A page with a heading only.
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

    /// A list of names with values.
    pub(crate) fn facts(&mut self, facts: &[[String; 2]]) {
        self.body.push(html! {
            dl {
                @for [name, value] in facts { dt { (name) } dd { (value) } "\n" }
            }
        });
    }

    /// Preformatted text.
    pub(crate) fn preformatted(&mut self, text: &str) {
        self.body.push(html! { pre { (text) } });
    }

    /// A collapsible section, expanded in print.
    pub(crate) fn folded(&mut self, summary: &str, build: impl FnOnce(&mut Self)) {
        let mut inside = Self::default();
        build(&mut inside);
        self.body.push(html! {
            details {
                summary { (summary) } "\n"
                @for part in &inside.body { (part) "\n" }
            }
        });
    }

    /// A table with a header row. A column of prose is set as text, one of numbers right-aligned; on a narrow screen a
    /// table with prose has its cells stacked.
    pub(crate) fn table(&mut self, rows: &[Vec<String>]) {
        let Some((head, rows)) = rows.split_first() else {
            return;
        };
        let is_prose = |k: usize| {
            let mut cells = rows.iter().filter_map(|row| row.get(k));
            cells.any(|cell| cell.chars().count() > PROSE)
        };
        let class: Vec<Option<&str>> = (0..head.len())
            .map(|k| is_prose(k).then_some("prose"))
            .collect();
        let has_prose = class.iter().any(Option::is_some);
        self.body.push(html! {
            div.wide {
                table class=[has_prose.then_some("cards")] {
                    "\n"
                    thead { tr { @for (cell, class) in head.iter().zip(&class) { th class=[class] { (cell) } } } }
                    "\n"
                    @for row in rows {
                        tr {
                            @for ((cell, class), name) in row.iter().zip(&class).zip(head) {
                                td class=[class] data-name=[has_prose.then_some(name)] { (cell) }
                            }
                        }
                        "\n"
                    }
                }
            }
        });
    }

    /// A chart with title and legend.
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
                    style { (PreEscaped(CHART_STYLE)) (PreEscaped(unpack(STYLE))) }
                }
                "\n"
                body {
                    "\n"
                    @for part in &self.body { (part) "\n" }
                    script { (PreEscaped(unpack(SCRIPT))) }
                }
            }
            "\n"
        };
        visible(page.into_string())
    }
}

/// The legend of a chart as text, so that the page can wrap it.
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
        @for kind in chart.span_kinds() {
            span {
                svg.swatch viewBox="0 0 28 8" aria-hidden="true" { rect.(kind.class()) width="28" height="8" {} }
                " " (kind.name())
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
        assert!(html.contains("&lt;script&gt;"));
        assert_eq!(html.matches("<script").count(), 1, "our own");
        assert_eq!(html.matches("</script").count(), 1, "nothing ends it early");
        let addresses = html.matches("http").count();
        assert_eq!(
            addresses,
            html.matches("http://www.w3.org/2000/svg").count()
        );
        for external in ["src=", "href=", "url(", "@import", "fetch(", "eval("] {
            assert!(!html.contains(external), "{external}");
        }
    }
}
