//! The report for people.

use super::report::{ChannelWarning, InspectReport, Inspected, InspectedChannel, InspectedFile};
use crate::print::{Report, columns, plural, rounded, short};

/// Maximum number of header lines shown, and of characters of each.
const MOST_DETAILS: usize = 12;
const LINE_WIDTH: usize = 100;
/// Maximum number of characters of a unit in the table.
const UNIT_WIDTH: usize = 24;
/// Maximum number of characters of a name in the table.
const NAME_WIDTH: usize = 44;

impl Report for InspectReport {
    const SCHEMA: &'static str = "torqcomp.inspect/1";

    fn text(&self) -> String {
        let files = self.files.iter().filter_map(|entry| match entry {
            Inspected::Read(file) => Some(file.text()),
            Inspected::Failed { .. } => None,
        });
        let mut text = files.collect::<Vec<_>>().join("\n");
        if self.files.len() > 1 && !text.is_empty() {
            text.push_str("\nbetween the files: ");
            text.push_str(&listed(&self.warnings, "no duplicates"));
        }
        text
    }
}

fn listed(warnings: &[ChannelWarning], none: &str) -> String {
    if warnings.is_empty() {
        return format!("{none}\n");
    }
    let mut text = plural(warnings.len(), "warning") + "\n";
    for warning in warnings {
        let message = wrapped(&format!(
            "[{}] {}",
            warning.warning.code, warning.warning.message
        ));
        text.push_str(&message);
    }
    text
}

/// Lines of at most 100 characters, the first indented by two, the others by six.
fn wrapped(text: &str) -> String {
    let mut out = String::from(" ");
    let mut column = 1;
    for word in text.split(' ') {
        let length = word.chars().count();
        if column + 1 + length > LINE_WIDTH && column > 6 {
            out.push_str("\n     ");
            column = 5;
        }
        out.push(' ');
        out.push_str(word);
        column += 1 + length;
    }
    out.push('\n');
    out
}

impl InspectedFile {
    fn text(&self) -> String {
        let mut text = format!("{}\n{}: {}\n", self.file, self.format, self.dialect);
        for detail in self.details.iter().take(MOST_DETAILS) {
            let line = format!("  {}: {}", detail.key, detail.value);
            text.push_str(&shortened(&line, LINE_WIDTH));
            text.push('\n');
        }
        if self.details.len() > MOST_DETAILS {
            let more = self.details.len() - MOST_DETAILS;
            text.push_str(&format!(
                "  … and {more} more in the header (--json has all)\n"
            ));
        }
        for segment in &self.segments {
            let start = segment
                .start_s
                .map_or_else(String::new, |s| format!(", {} s after the first", short(s)));
            let time = segment
                .start_text
                .as_ref()
                .map_or_else(String::new, |t| format!(", {t}"));
            text.push_str(&format!("  {}{start}{time}\n", segment.name));
        }
        text.push('\n');
        let head = [
            "channel", "unit", "samples", "rate Hz", "start s", "length s", "smallest", "largest",
            "mean", "rms",
        ];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        rows.extend(
            self.channels
                .iter()
                .enumerate()
                .map(|(i, c)| c.cells(i + 1)),
        );
        text.push_str(&columns(&rows));
        text.push_str(&self.time());
        text.push('\n');
        text.push_str(&listed(&self.warnings, "no problems found"));
        text
    }

    /// Origin of the rates: one line for each time axis.
    fn time(&self) -> String {
        let mut axes: Vec<(String, Vec<usize>)> = Vec::new();
        for (i, channel) in self.channels.iter().enumerate() {
            let axis = channel.axis();
            match axes.iter_mut().find(|(other, _)| *other == axis) {
                Some((_, numbers)) => numbers.push(i + 1),
                None => axes.push((axis, vec![i + 1])),
            }
        }
        let several = axes.len() > 1;
        axes.iter()
            .map(|(axis, numbers)| {
                let of = if several {
                    format!(" of {}", ranges(numbers))
                } else {
                    String::new()
                };
                format!("time axis{of}: {axis}\n")
            })
            .collect()
    }
}

/// A text, truncated if too long.
fn shortened(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let mut short: String = text.chars().take(most - 1).collect();
    short.push('…');
    short
}

/// A name, without its middle if too long, as both ends are more informative.
fn middle_left_out(name: &str) -> String {
    let count = name.chars().count();
    if count <= NAME_WIDTH {
        return name.to_owned();
    }
    let half = NAME_WIDTH / 2;
    let head: String = name.chars().take(half - 1).collect();
    let tail: String = name.chars().skip(count - half).collect();
    format!("{head}…{tail}")
}

/// `1-3, 5`.
fn ranges(numbers: &[usize]) -> String {
    let mut parts: Vec<(usize, usize)> = Vec::new();
    for &number in numbers {
        match parts.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => parts.push((number, number)),
        }
    }
    let part = |&(first, last): &(usize, usize)| match last - first {
        0 => first.to_string(),
        1 => format!("{first}, {last}"),
        _ => format!("{first}-{last}"),
    };
    parts.iter().map(part).collect::<Vec<_>>().join(", ")
}

impl InspectedChannel {
    fn cells(&self, number: usize) -> Vec<String> {
        let value =
            |value: Option<f64>, digits| value.map_or_else(String::new, |v| rounded(v, digits));
        let mut name = self.name.clone();
        if let Some(segment) = self.segment {
            name.push_str(&format!(" (segment {segment})"));
        }
        vec![
            format!("{number:>2}  {}", middle_left_out(&name)),
            shortened(self.unit.as_deref().unwrap_or("not given"), UNIT_WIDTH),
            self.samples.to_string(),
            self.rate_hz
                .map_or_else(|| "unknown".to_owned(), |rate_hz| rounded(rate_hz, 7)),
            // Seconds since 1970 have ten digits before the point.
            value(
                self.start,
                if self.start.is_some_and(|s| s.abs() > 1e6) {
                    13
                } else {
                    6
                },
            ),
            value(self.duration_s, 6),
            value(self.smallest, 5),
            value(self.largest, 5),
            value(self.mean, 5),
            value(self.rms, 4),
        ]
    }

    /// The time axis in words.
    fn axis(&self) -> String {
        let mut text = match self.rate_hz {
            Some(rate_hz) => format!("{} Hz, {}", rounded(rate_hz, 7), self.rate_from),
            None => "none; the rate is unknown".to_owned(),
        };
        if let Some(start_time) = &self.start_time {
            text.push_str(&format!("; starts {start_time}"));
        }
        if let Some(jitter) = self.jitter.filter(|j| *j > 1e-6) {
            text.push_str(&format!(
                "; steps scatter by {} %",
                rounded(100.0 * jitter, 2)
            ));
        }
        if let Some(assumed) = &self.assumed {
            text.push_str(&format!("; assumed: {assumed}"));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_channels_are_put_together() {
        assert_eq!(ranges(&[1, 2, 3, 5, 7, 8]), "1-3, 5, 7, 8");
    }

    #[test]
    fn long_messages_are_wrapped_and_keep_every_word() {
        let text = "word ".repeat(60);
        let out = wrapped(text.trim());
        assert!(out.lines().all(|line| line.chars().count() <= 100));
        assert_eq!(out.split_whitespace().count(), 60);
        assert!(
            out.lines()
                .nth(1)
                .is_some_and(|line| line.starts_with("      word"))
        );
    }
}
