use super::*;
use crate::io::Flags;
use crate::recording::{Channel, TimeAxis};

fn channel(name: &str, axis: TimeAxis, of: impl Fn(f64) -> f64) -> Channel {
    let times: Vec<f64> = match &axis.stamps_s {
        Some(stamps) => stamps.to_vec(),
        None => (0..400)
            .map(|i| f64::from(i) / axis.rate_hz.unwrap())
            .collect(),
    };
    Channel {
        name: name.to_owned(),
        heading: name.to_owned(),
        unit: None,
        unit_text: None,
        samples: times.into_iter().map(of).collect(),
        holes: Vec::new(),
        axis,
        segment: None,
        filled: Vec::new(),
        is_compensated: false,
    }
}

fn recording(format: &'static str, channels: Vec<Channel>) -> Recording {
    Recording {
        source: "record".to_owned(),
        format,
        dialect: String::new(),
        details: Vec::new(),
        channels,
        segments: Vec::new(),
        warnings: Vec::new(),
        lost: None,
    }
}

fn named(name: &str) -> ChannelChoice {
    ChannelChoice::of(Flags::default(), Some(name), None)
}

fn both(recording: &Recording) -> Result<AlignedChannels, Failure> {
    AlignedChannels::of(
        recording.clone(),
        &[named("a"), named("b")],
        &Reading::default(),
    )
}

/// Stamps a millisecond apart, with jitter up to a fraction of that.
fn stamps(first_s: f64, jitter: f64) -> TimeAxis {
    let off = |i: u32| jitter * (f64::from(i) * 2.4).sin();
    let all = (0..400)
        .map(|i| first_s + 1e-3 * (f64::from(i) + off(i)))
        .collect();
    TimeAxis::of_stamps("t", Arc::new(all))
}

fn wave(time_s: f64) -> f64 {
    (std::f64::consts::TAU * 12.0 * time_s).sin()
}

#[test]
fn the_same_stamps_are_taken_as_they_are() {
    let record = recording(
        "mcap",
        vec![
            channel("a", stamps(5.0, 0.0), wave),
            channel("b", stamps(5.0, 0.0), |t| t),
        ],
    );
    let found = both(&record).unwrap();
    assert_eq!(found.channels[0].samples, record.channels[0].samples);
    assert_eq!(found.channels[1].samples, record.channels[1].samples);
    assert!(found.warnings.is_empty());
    assert!((found.start.seconds() - 5.0).abs() < 1e-12 && (found.rate_hz - 1000.0).abs() < 1e-6);
}

#[test]
fn messages_at_other_moments_are_interpolated_and_that_is_said() {
    let record = recording(
        "mcap",
        vec![
            channel("a", stamps(5.0, 0.08), wave),
            channel("b", stamps(5.0103, 0.08), wave),
        ],
    );
    let found = both(&record).unwrap();
    assert_eq!(found.warnings[0].code, "resampled");
    let [a, b] = [&found.channels[0].samples, &found.channels[1].samples];
    assert!(a.len() == b.len() && a.len() > 380);
    // Both channels contain the same wave, so they must agree where they overlap.
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        let truth = wave(found.start.seconds() + i as f64 / found.rate_hz);
        assert!(
            (a - truth).abs() < 2e-6 && (b - truth).abs() < 2e-6,
            "{i}: {a} {b} {truth}"
        );
    }
}

#[test]
fn rates_that_differ_are_refused() {
    let slow = TimeAxis::of_stamps(
        "t",
        Arc::new((0..100).map(|i| f64::from(i) * 4e-3).collect()),
    );
    for format in ["mcap", "csv"] {
        let record = recording(
            format,
            vec![
                channel("a", stamps(0.0, 0.0), wave),
                channel("b", slow.clone(), wave),
            ],
        );
        let said = both(&record).unwrap_err().to_string();
        assert!(said.contains("\"b\" is sampled at 250 Hz"), "{said}");
    }
    let late = TimeAxis::of_header("dt", 1000.0, Some(0.25));
    let first = TimeAxis::of_header("dt", 1000.0, Some(0.0));
    let record = recording(
        "csv",
        vec![channel("a", first, wave), channel("b", late, wave)],
    );
    assert!(
        both(&record)
            .unwrap_err()
            .to_string()
            .contains("starting at 0.25 s")
    );
}

#[test]
fn records_of_different_times_are_refused() {
    let record = recording(
        "mcap",
        vec![
            channel("a", stamps(0.0, 0.0), wave),
            channel("b", stamps(90.0, 0.0), wave),
        ],
    );
    let said = both(&record).unwrap_err().to_string();
    assert!(said.contains("same time"), "{said}");
}

#[test]
fn rounded_stamps_of_a_text_are_not_interpolated() {
    let rounded = TimeAxis::of_stamps(
        "t",
        Arc::new(
            (0..400)
                .map(|i| (f64::from(i) * 3.3).round() * 1e-3)
                .collect(),
        ),
    );
    let record = recording(
        "csv",
        vec![
            channel("a", rounded.clone(), wave),
            channel("b", rounded, wave),
        ],
    );
    let found = both(&record).unwrap();
    assert_eq!(found.channels[0].samples, record.channels[0].samples);
    let codes: Vec<&str> = found.warnings.iter().map(|w| w.code).collect();
    assert_eq!(codes, ["rounded-time-stamps"]);
    // A gap is treated differently.
    let mut gap: Vec<f64> = (0..400).map(|i| f64::from(i) * 1e-3).collect();
    gap[200..].iter_mut().for_each(|t| *t += 0.02);
    let gap = TimeAxis::of_stamps("t", Arc::new(gap));
    let record = recording(
        "csv",
        vec![channel("a", gap.clone(), wave), channel("b", gap, wave)],
    );
    let refused = both(&record).unwrap_err().to_string();
    assert!(
        refused.contains("sample 201: \"a\"") && refused.contains("21 times the usual one"),
        "{refused}"
    );
}

#[test]
fn samples_that_are_no_numbers_are_refused() {
    let record = recording(
        "mcap",
        vec![
            channel("a", stamps(0.0, 0.0), wave),
            channel("b", stamps(0.0, 0.0), |_| f64::NAN),
        ],
    );
    assert!(
        both(&record)
            .unwrap_err()
            .to_string()
            .contains("sample 1 of \"b\"")
    );
}
