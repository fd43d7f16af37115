//! The time axis of a table: stamps or a rate, and whether the stamps are uniform.

use torqcomp_model::Unit;

use super::layout::Layout;
use super::scan::Rows;
use super::{NamedUnit, Options};
use crate::failure::Failure;
use crate::io::digits;
use crate::warning::Warning;

/// Largest deviation of a step from the uniform one, as a fraction of it.
const TOLERANCE: f64 = 0.01;

/// Rates, over the recorded one, that stamps may be brought to.
const RESAMPLED_RATES: (f64, f64) = (0.9, 1.4);

/// How the samples of a table lie in time.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeAxis {
    /// Where it comes from.
    pub source: TimeSource,
    /// Samples a second.
    pub rate_hz: f64,
}

/// Where a time axis comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum TimeSource {
    /// From a column of stamps.
    Stamps {
        /// Heading of the column.
        heading: String,
        /// Unit of the stamps as written.
        unit: String,
        /// Seconds per unit of the stamps.
        seconds_per_unit: f64,
        /// Uniform step, in the stamps' unit.
        step: f64,
        /// Whether the stamps need not be uniform, because they are resampled.
        resampled: bool,
        /// Whether the text of a stamp is a number of seconds as the output writes it.
        copied: bool,
        /// Nanoseconds at which the stamps are zero.
        origin_ns: i64,
    },
    /// From a rate that the head of the file gives.
    Header {
        /// The words that gave it.
        words: String,
        /// Time of the first sample.
        start_s: f64,
    },
    /// From a rate that the user gave; the first sample is at time 0.
    Given,
}

/// What is known of stamps before their step.
#[derive(Debug, Clone, PartialEq)]
pub struct Stamps {
    /// Heading of their column, or what they are.
    pub heading: String,
    /// Their unit as written.
    pub unit: String,
    /// Seconds per unit.
    pub seconds_per_unit: f64,
    /// Whether the text of a stamp is a number of seconds as the output writes it.
    pub copied: bool,
    /// Nanoseconds at which they are zero.
    pub origin_ns: i64,
}

/// Where and how stamps stop being uniform.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Break {
    /// Index of the stamp that ends the irregular step, within its piece.
    pub row: usize,
    /// The stamp before it.
    pub before: f64,
    /// The stamp itself.
    pub after: f64,
}

impl TimeAxis {
    /// Finds the time axis out of the first rows and what the user said.
    ///
    /// # Errors
    /// If there is neither a column of stamps in a known unit nor a rate, or the stamps of the
    /// first rows do not rise.
    pub fn find(
        layout: &Layout,
        column: Option<usize>,
        rows: &Rows,
        options: &Options,
    ) -> Result<Self, Failure> {
        let column = match (column, options.rate_hz) {
            (Some(place), None) => &layout.columns[place],
            (Some(place), Some(_)) if options.resample => &layout.columns[place],
            (_, Some(rate_hz)) => {
                return Ok(Self {
                    source: TimeSource::Given,
                    rate_hz,
                });
            }
            (None, None) => return Err(Failure::failed(missing(layout))),
        };
        let NamedUnit { text, unit } = unit(column, options)?;
        let stamps = Stamps {
            heading: column.heading.clone(),
            unit: text,
            seconds_per_unit: unit.factor(),
            copied: unit.factor() == 1.0 && layout.dialect.decimal == b'.',
            origin_ns: 0,
        };
        Self::of_stamps(stamps, &rows.times, options)
    }

    /// The time axis of stamps, told from the first of them.
    ///
    /// # Errors
    /// If they do not rise, or are to be resampled to a rate far from theirs.
    pub fn of_stamps(stamps: Stamps, first: &[f64], options: &Options) -> Result<Self, Failure> {
        let typical =
            typical_step(first).ok_or_else(|| Failure::failed(no_step(&stamps.heading, first)))?;
        let seconds_per_unit = stamps.seconds_per_unit;
        let step = match options.rate_hz {
            None => typical,
            Some(rate_hz) => {
                check_resampled(rate_hz, 1.0 / (typical * seconds_per_unit))?;
                1.0 / rate_hz / seconds_per_unit
            }
        };
        Ok(Self {
            source: TimeSource::Stamps {
                heading: stamps.heading,
                unit: stamps.unit,
                seconds_per_unit,
                step,
                resampled: options.resample,
                copied: stamps.copied,
                origin_ns: stamps.origin_ns,
            },
            rate_hz: without_rounding(1.0 / (step * seconds_per_unit)),
        })
    }

    /// Where the rate comes from, for people.
    #[must_use]
    pub fn rate_from(&self) -> String {
        match &self.source {
            TimeSource::Given => "given with --rate".to_owned(),
            TimeSource::Header { words, .. } => format!("from the head of the file: {words}"),
            TimeSource::Stamps {
                heading, resampled, ..
            } if *resampled => {
                format!("from the stamps in \"{heading}\", interpolated")
            }
            TimeSource::Stamps { heading, .. } => {
                format!("from the uniform stamps in \"{heading}\"")
            }
        }
    }

    /// Whether stamps are read.
    #[must_use]
    pub fn uses_stamps(&self) -> bool {
        matches!(self.source, TimeSource::Stamps { .. })
    }

    /// Whether stamps are brought onto a grid.
    #[must_use]
    pub fn is_resampled(&self) -> bool {
        matches!(
            self.source,
            TimeSource::Stamps {
                resampled: true,
                ..
            }
        )
    }

    /// First stamp that does not follow the one before it by the uniform step. `last` is the stamp
    /// before the first of them. Of stamps that are resampled, the first that runs backwards.
    #[must_use]
    pub fn first_break(&self, last: Option<f64>, times: &[f64]) -> Option<Break> {
        let TimeSource::Stamps {
            step, resampled, ..
        } = &self.source
        else {
            return None;
        };
        let (&first, &end) = (times.first()?, times.last()?);
        // A stamp cannot be more exact than its own last bit.
        let rounding = 2.0 * f64::EPSILON * first.abs().max(end.abs());
        let (low, high) = if *resampled {
            (0.0, f64::INFINITY)
        } else {
            (
                step * (1.0 - TOLERANCE) - rounding,
                step * (1.0 + TOLERANCE) + rounding,
            )
        };
        let good = |before: f64, after: f64| (low..=high).contains(&(after - before));
        if let Some(before) = last
            && !good(before, first)
        {
            return Some(Break {
                row: 0,
                before,
                after: first,
            });
        }
        let row = first_step(times, &good)? + 1;
        Some(Break {
            row,
            before: times[row - 1],
            after: times[row],
        })
    }

    /// Says what is wrong at a break and what to do.
    #[must_use]
    pub fn explain(&self, found: &Break) -> String {
        let TimeSource::Stamps { unit, step, .. } = &self.source else {
            return String::new();
        };
        let (before, after) = (
            digits::text(found.before, 12),
            digits::text(found.after, 12),
        );
        if found.after < found.before {
            return format!(
                "time runs backwards, from {before} {unit} to {after} {unit}: the clock was set \
                 back or two recordings were joined; split the file there"
            );
        }
        let what = if found.after == found.before {
            format!("the time stamp {after} {unit} repeats the one before it")
        } else {
            let length = (found.after - found.before) / step;
            format!(
                "the time stamps are not uniform: the step from {before} {unit} to {after} {unit} \
                 is {} times the usual one of {} {unit}",
                digits::text(length, 4),
                digits::text(*step, 6)
            )
        };
        format!("{what}; use --resample to interpolate, or --rate HZ if the stamps are wrong")
    }
}

/// Index of the first step that is not good. Looks at many at once, since there rarely is one.
fn first_step(times: &[f64], good: &impl Fn(f64, f64) -> bool) -> Option<usize> {
    const TOGETHER: usize = 64;
    let steps = times.len().saturating_sub(1);
    let is_good = |i: usize| good(times[i], times[i + 1]);
    let start = (0..steps).step_by(TOGETHER).find(|&start| {
        let part = &times[start..(start + TOGETHER + 1).min(times.len())];
        let pairs = part.iter().zip(&part[1..]);
        !pairs.fold(true, |all, (a, b)| all & good(*a, *b))
    })?;
    (start..steps).find(|i| !is_good(*i))
}

/// The unit of a column of stamps: from the user, or from the heading.
fn unit(column: &super::Column, options: &Options) -> Result<NamedUnit, Failure> {
    let named = match (&options.time_unit, &column.unit) {
        (Some(text), _) => NamedUnit {
            text: text.clone(),
            unit: Unit::parse(text)
                .map_err(|error| Failure::usage(format_args!("--time-unit {text}: {error}")))?,
        },
        (None, Some(named)) => named.clone(),
        (None, None) => {
            return Err(Failure::failed(format_args!(
                "the time column \"{}\" does not say its unit; give it with --time-unit s (or ms, \
                 us, min)",
                column.heading
            )));
        }
    };
    if named.is_time() {
        Ok(named)
    } else {
        Err(Failure::failed(format_args!(
            "the time column \"{}\" is in \"{}\", which is no unit of time; give it with \
             --time-unit s (or ms, us, min), or another column with --time-column",
            column.heading, named.text
        )))
    }
}

/// What to do about a table without a time axis.
#[must_use]
pub fn missing(layout: &Layout) -> String {
    if layout.heading_line.is_none() && layout.columns.len() > 1 {
        return "the columns have no headings, so none is known to be the time; give --rate HZ, or \
                --time-column 1 --time-unit s if the first column is the time in seconds"
            .to_owned();
    }
    "there is no time column, so the sampling rate is unknown; give it with --rate HZ, or name the \
     column with --time-column"
        .to_owned()
}

/// A warning if a rate that was given is not that of the stamps.
pub fn overridden(
    layout: &Layout,
    column: Option<usize>,
    rows: &Rows,
    options: &Options,
) -> Option<Warning> {
    let rate_hz = options.rate_hz.filter(|_| !options.resample)?;
    let column = &layout.columns[column?];
    let unit = unit(column, options).ok()?.unit;
    let stamped_hz = 1.0 / (typical_step(&rows.times)? * unit.factor());
    if (rate_hz / stamped_hz - 1.0).abs() <= TOLERANCE {
        return None;
    }
    Some(Warning::new(
        "rate-overrides-stamps",
        format!(
            "the stamps in \"{}\" come at {} Hz, --rate says {} Hz; {} Hz was taken",
            column.heading,
            digits::text(stamped_hz, 7),
            digits::text(rate_hz, 7),
            digits::text(rate_hz, 7)
        ),
    ))
}

/// Refuses to bring stamps to a rate far from the recorded one.
fn check_resampled(rate_hz: f64, recorded_hz: f64) -> Result<(), Failure> {
    let (low, high) = RESAMPLED_RATES;
    if (low * recorded_hz..=high * recorded_hz).contains(&rate_hz) {
        return Ok(());
    }
    Err(Failure::failed(format_args!(
        "the stamps come at {} Hz; --resample with --rate {} would fold high frequencies down or \
         invent samples. Resample near the recorded rate, and limit the band with --band",
        digits::text(recorded_hz, 6),
        digits::text(rate_hz, 6)
    )))
}

/// A rate without the rounding of the stamps it was found from: nine digits, if they say the same.
pub(crate) fn without_rounding(rate_hz: f64) -> f64 {
    let short: f64 = digits::text(rate_hz, 9).parse().unwrap_or(rate_hz);
    if (short / rate_hz - 1.0).abs() < 1e-10 {
        short
    } else {
        rate_hz
    }
}

/// Usual step of the first stamps: the mean of those within the tolerance of their median.
fn typical_step(times: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = times
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .filter(|step| *step > 0.0)
        .collect();
    if steps.is_empty() {
        return None;
    }
    steps.sort_by(f64::total_cmp);
    let median = steps[steps.len() / 2];
    let usual: Vec<f64> = steps
        .into_iter()
        .filter(|step| (step / median - 1.0).abs() <= TOLERANCE)
        .collect();
    Some(usual.iter().sum::<f64>() / usual.len() as f64)
}

fn no_step(heading: &str, times: &[f64]) -> String {
    if times.len() < 2 {
        return format!(
            "the time column \"{heading}\" has {} stamp(s), so the sampling rate is unknown; give \
             it with --rate HZ",
            times.len()
        );
    }
    format!(
        "the stamps of the time column \"{heading}\" do not rise; give the rate with --rate HZ, or \
         another column with --time-column"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(step: f64, resampled: bool) -> TimeAxis {
        TimeAxis {
            source: TimeSource::Stamps {
                heading: "t".to_owned(),
                unit: "s".to_owned(),
                seconds_per_unit: 1.0,
                step,
                resampled,
                copied: true,
                origin_ns: 0,
            },
            rate_hz: 1.0 / step,
        }
    }

    #[test]
    fn one_per_cent_of_a_step_is_uniform_and_more_is_not() {
        let axis = axis(0.001, false);
        assert_eq!(
            axis.first_break(None, &[0.0, 0.001, 0.002_009, 0.003_001]),
            None
        );
        let found = axis
            .first_break(None, &[0.0, 0.001, 0.002_011, 0.003])
            .unwrap();
        assert_eq!((found.row, found.after), (2, 0.002_011));
        let found = axis.first_break(Some(-0.002), &[0.0, 0.001]).unwrap();
        assert_eq!((found.row, found.before), (0, -0.002));
    }

    #[test]
    fn large_stamps_are_allowed_their_rounding() {
        let start = 1.7e9;
        let times: Vec<f64> = (0..1000).map(|i| start + 20e-6 * f64::from(i)).collect();
        assert_eq!(axis(20e-6, false).first_break(None, &times), None);
    }

    #[test]
    fn resampled_stamps_may_do_anything_but_run_backwards() {
        let axis = axis(1.0, true);
        assert_eq!(axis.first_break(None, &[0.0, 0.5, 0.5, 7.0]), None);
        assert_eq!(axis.first_break(None, &[0.0, 0.5, 0.4]).unwrap().row, 2);
    }

    #[test]
    fn messages_say_what_and_what_to_do() {
        let axis = axis(0.5, false);
        let explain = |before, after| {
            axis.explain(&Break {
                row: 1,
                before,
                after,
            })
        };
        assert!(explain(1.0, 0.5).contains("backwards, from 1 s to 0.5 s"));
        assert!(explain(1.0, 1.0).contains("repeats"));
        let gap = explain(1.0, 2.5);
        assert!(
            gap.contains("3 times") && gap.contains("--resample"),
            "{gap}"
        );
    }

    #[test]
    fn rates_lose_rounding_but_not_digits() {
        assert_eq!(without_rounding(20_000.000_000_000_735), 20_000.0);
        assert_eq!(without_rounding(20_000.001), 20_000.001);
        assert_eq!(without_rounding(610.351_562_5), 610.351_562_5);
        assert_eq!(without_rounding(1000.0 / 3.0), 1000.0 / 3.0);
    }

    #[test]
    fn usual_step_is_not_moved_by_a_gap() {
        let mut times: Vec<f64> = (0..100).map(|i| 0.002 * f64::from(i)).collect();
        times.push(5.0);
        assert!((typical_step(&times).unwrap() - 0.002).abs() < 1e-12);
        assert_eq!(typical_step(&[1.0, 1.0]), None);
    }
}
