//! Every recording is read with the channels, units, rates and samples of `expected.tsv`.

use std::collections::BTreeMap;
use std::path::Path;

use libtest_mimic::Failed;
use torqcomp::io::Input;
use torqcomp::io::Reading as Options;
use torqcomp::recording::{self, Recording};

use crate::check;

const EXPECTED: &str = include_str!("expected.tsv");

/// Largest relative difference of a rate determined from stamps with jitter.
const RATE: f64 = 2e-4;

/// A line of the list, without path and dialect.
struct Line<'a> {
    name: &'a str,
    unit: &'a str,
    samples: usize,
    rate_hz: Option<f64>,
    start_s: Option<f64>,
    sum: f64,
}

fn expected() -> BTreeMap<(&'static str, &'static str), Vec<Line<'static>>> {
    let mut files: BTreeMap<_, Vec<Line>> = BTreeMap::new();
    let lines = EXPECTED.lines().filter(|line| !line.starts_with('#'));
    for line in lines.skip(1) {
        let cells: Vec<&str> = line.split('\t').collect();
        files.entry((cells[0], cells[1])).or_default().push(Line {
            name: cells[2],
            unit: cells[3],
            samples: cells[4].parse().expect("a count"),
            rate_hz: cells[5].parse().ok(),
            start_s: cells[6].parse().ok(),
            sum: cells[7].parse().expect("a sum"),
        });
    }
    files
}

fn read(folder: &Path, path: &str) -> Result<Recording, Failed> {
    let place = Input::File(folder.join(path));
    recording::read(&place, &Options::default()).map_err(|failure| failure.to_string().into())
}

/// All files except the one with segments and the non-recording.
pub fn all(folder: &Path) -> Result<(), Failed> {
    let files = expected();
    check(files.len() == 35, files.len())?;
    for ((path, dialect), lines) in files {
        let found = read(folder, path)?;
        let starts = found.dialect.starts_with(dialect);
        check(starts, format!("{path}: {}", found.dialect))?;
        let same_count = found.channels.len() == lines.len();
        check(
            same_count,
            format!("{path}: {} channels", found.channels.len()),
        )?;
        for (channel, line) in found.channels.iter().zip(&lines) {
            let what = format!("{path}, {}: {:?}", channel.name, channel.axis);
            check(channel.name == line.name, &what)?;
            check(
                channel.unit_text.as_deref().unwrap_or("") == line.unit,
                &what,
            )?;
            check(channel.samples.len() == line.samples, &what)?;
            let rate = close(channel.axis.rate_hz, line.rate_hz, RATE);
            let start = close(
                channel.axis.start.map(|start| start.seconds()),
                line.start_s,
                1e-12,
            );
            check(rate && start, &what)?;
            let sum: f64 = channel.samples.iter().sum();
            let size: f64 = channel.samples.iter().map(|value| value.abs()).sum();
            check(
                (sum - line.sum).abs() <= 1e-9 * size.max(1e-12),
                format!("{what}: {sum}"),
            )?;
        }
    }
    Ok(())
}

fn close(found: Option<f64>, wanted: Option<f64>, part: f64) -> bool {
    match (found, wanted) {
        (Some(found), Some(wanted)) => (found - wanted).abs() <= part * wanted.abs().max(1e-12),
        (found, wanted) => found == wanted,
    }
}

/// 2504 rows are two segments of 1252.
pub fn segments(folder: &Path) -> Result<(), Failed> {
    let found = read(folder, "dialects/lecroy_WS4054HD.csv")?;
    check(
        found.dialect.starts_with("LeCroy") && found.segments.len() == 2,
        &found.dialect,
    )?;
    let counts: Vec<usize> = found.channels.iter().map(|c| c.samples.len()).collect();
    check(counts == [1252, 1252], format!("{counts:?}"))?;
    check(
        found.segments[1].start_s == Some(0.000_999_964),
        "start of the second segment",
    )?;
    let sum: f64 = found.channels.iter().flat_map(|c| &c.samples).sum();
    check((sum + 6.855_004_984).abs() < 1e-8, sum)?;
    let rates = found
        .channels
        .iter()
        .all(|c| close(c.axis.rate_hz, Some(125e6), 1e-6));
    check(rates && found.lost.is_none(), "rates")
}

/// A list of settings is not a recording.
pub fn settings(folder: &Path) -> Result<(), Failed> {
    let place = Input::File(folder.join("dialects/precision_filters_settings.csv"));
    match recording::read(&place, &Options::default()) {
        Ok(found) => Err(format!("read as {}", found.dialect).into()),
        Err(failure) => check(failure.to_string().contains("not a recording"), failure),
    }
}

/// Assumptions are reported, certain facts are not.
pub fn assumptions(folder: &Path) -> Result<(), Failed> {
    for (path, is_assumed) in [
        ("thrust_balance/data1.txt", true),
        ("silverbox/estimation.csv", false),
        ("dialects/twincat_scope_decimalcomma.csv", false),
        ("dialects/phyprakit_Cassy.txt", false),
    ] {
        let found = read(folder, path)?;
        let codes: Vec<&str> = found.warnings.iter().map(|warning| warning.code).collect();
        check(
            codes.contains(&"time-assumed") == is_assumed,
            format!("{path}: {codes:?}"),
        )?;
    }
    Ok(())
}
