//! Samples of every dialect, written from what is known of the formats.

mod exports;
mod layouts;
mod makers;
mod names_of_time;
mod others;
mod plain;
mod variants;
mod wrong;

use crate::io::csv::Options;
use crate::recording::Recording;

fn read(text: &str) -> Recording {
    read_bytes(text.as_bytes(), &Options::default())
}

fn read_bytes(bytes: &[u8], options: &Options) -> Recording {
    match super::read("sample", bytes.to_vec(), options) {
        Ok(recording) => recording,
        Err(failure) => panic!("{failure}\n{}", String::from_utf8_lossy(bytes)),
    }
}

fn failure(text: &str) -> String {
    let failure = super::read("sample", text.as_bytes().to_vec(), &Options::default());
    failure.expect_err(text).to_string()
}

/// What a recording is to hold: for each channel its name, unit and number of samples.
fn check(recording: &Recording, channels: &[(&str, &str, usize)], rate_hz: Option<f64>) {
    let found: Vec<(&str, &str, usize)> = recording
        .channels
        .iter()
        .map(|channel| {
            let unit = channel.unit_text.as_deref().unwrap_or("");
            (channel.name.as_str(), unit, channel.samples.len())
        })
        .collect();
    assert_eq!(found, channels, "{recording:#?}");
    for channel in &recording.channels {
        let axis = &channel.axis;
        let same = match (axis.rate_hz, rate_hz) {
            (Some(found), Some(wanted)) => (found / wanted - 1.0).abs() < 1e-6,
            (found, wanted) => found == wanted,
        };
        assert!(
            same,
            "{}: {:?}, expected {rate_hz:?}",
            channel.name, axis.rate_hz
        );
    }
}

/// Rows of numbers out of a formula for each column.
fn rows(count: usize, separator: &str, columns: &[&dyn Fn(f64) -> String]) -> String {
    (0..count)
        .map(|row| {
            let cells: Vec<String> = columns.iter().map(|column| column(row as f64)).collect();
            cells.join(separator) + "\n"
        })
        .collect()
}

/// A step of so much for each row, with so many decimals.
fn step(size: f64, decimals: usize) -> impl Fn(f64) -> String {
    move |row| format!("{:.decimals$}", row * size)
}

/// A wave with the sizes of a signal.
fn wave(row: f64) -> String {
    format!("{:.5}", (row * 0.7).sin() * 3.25 - 0.5)
}

/// The same with a decimal comma.
fn comma(of: impl Fn(f64) -> String) -> impl Fn(f64) -> String {
    move |row| of(row).replace('.', ",")
}
