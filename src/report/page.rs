//! A page for a browser: one file, nothing loaded from elsewhere, for screens of any width, in light
//! and dark, and on paper.

use std::fmt::Write;

use super::chart::{self, Chart, escaped};

/// Style of the page.
const STYLE: &str = "\
:root{--ink:#1c1c1c;--faint:#dcdcdc;--paper:#fff;--mark:#8a4b00}\
@media(prefers-color-scheme:dark){:root{--ink:#e4e4e4;--faint:#3d3d3d;--paper:#171717;--mark:#f0b66a}}\
@media print{:root{--ink:#000;--faint:#ccc;--paper:#fff;--mark:#000}section,figure,table{break-inside:avoid}}\
*{box-sizing:border-box}body{margin:0 auto;padding:1.2rem;max-width:60rem;background:var(--paper);\
color:var(--ink);font:15px/1.5 system-ui,sans-serif;overflow-wrap:anywhere}h1{font-size:1.5rem;margin:0 0 .3rem;break-after:avoid}\
h2{font-size:1.1rem;margin:1.8rem 0 .5rem;break-after:avoid}p{margin:.4rem 0}.wide{overflow-x:auto}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums}\
th,td{padding:.25rem .8rem .25rem 0;text-align:right;border-bottom:1px solid var(--faint);white-space:nowrap}\
th:first-child,td:first-child{text-align:left}\
th.prose,td.prose{text-align:left;white-space:normal;min-width:15rem}.warn{border-left:3px solid var(--mark);padding-left:.7rem}\
code{font-size:.9em}figure{margin:1rem 0}figcaption{font-weight:600;font-size:.95rem}\
@media(max-width:480px){body{padding:.7rem;font-size:14px}svg text{font-size:16px!important}\
th,td{padding-right:.45rem;font-size:13px;overflow-wrap:normal}\
td:first-child,th:first-child{white-space:normal}th.prose,td.prose{min-width:9rem}}";

/// Letters of the longest cell above which a column holds sentences.
const PROSE: usize = 36;

/// A page under construction.
#[derive(Debug, Clone, Default)]
pub struct Page {
    title: String,
    body: String,
}

impl Page {
    /// An empty page with its heading.
    #[must_use]
    pub fn new(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            body: format!("<h1>{}</h1>\n", escaped(title)),
        }
    }

    /// A heading.
    pub fn heading(&mut self, text: &str) {
        let _ = writeln!(self.body, "<h2>{}</h2>", escaped(text));
    }

    /// A paragraph.
    pub fn text(&mut self, text: &str) {
        let _ = writeln!(self.body, "<p>{}</p>", escaped(text));
    }

    /// A warning with its code.
    pub fn warning(&mut self, code: &str, message: &str) {
        let (code, message) = (escaped(code), escaped(message));
        let _ = writeln!(
            self.body,
            "<p class=\"warn\"><code>{code}</code> {message}</p>"
        );
    }

    /// A table; the first row is its head. A column of sentences is set as text, one of numbers to the right.
    pub fn table(&mut self, rows: &[Vec<String>]) {
        let width = rows.iter().map(Vec::len).max().unwrap_or(0);
        let is_prose = |k: usize| {
            let cells = rows.iter().filter_map(|row| row.get(k));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0) > PROSE
        };
        let prose: Vec<bool> = (0..width).map(is_prose).collect();
        self.body.push_str("<div class=\"wide\"><table>\n");
        for (i, row) in rows.iter().enumerate() {
            let tag = if i == 0 { "th" } else { "td" };
            let cells: String = row
                .iter()
                .enumerate()
                .map(|(k, cell)| {
                    let class = if prose[k] { " class=\"prose\"" } else { "" };
                    format!("<{tag}{class}>{}</{tag}>", escaped(cell))
                })
                .collect();
            let _ = writeln!(self.body, "<tr>{cells}</tr>");
        }
        self.body.push_str("</table></div>\n");
    }

    /// A chart under its heading.
    pub fn chart(&mut self, chart: &Chart) {
        let caption = escaped(&chart.title);
        let (svg, key) = (chart.svg(), chart.key());
        let _ = writeln!(
            self.body,
            "<figure><figcaption>{caption}</figcaption>\n<div class=\"key\">{key}</div>\n{svg}</figure>"
        );
    }

    /// The page as a file.
    #[must_use]
    pub fn html(&self) -> String {
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<title>{}</title>\n\
             <style>{STYLE}{}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
            escaped(&self.title),
            chart::STYLE,
            self.body
        )
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
