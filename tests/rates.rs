//! Rates left open by stamps, and gaps ignored by a given rate.

use crate::util::{COMPENSATE, Folder, HARMONICS, assert_close, column};

/// Volts of sample `i`.
fn volts(i: usize) -> f64 {
    1e-3 * (0.0628 * i as f64).cos()
}

fn record(stamp: impl Fn(usize) -> String, samples: impl Iterator<Item = usize>) -> String {
    let rows: String = samples
        .map(|i| format!("{},{:.9}\n", stamp(i), volts(i)))
        .collect();
    format!("Time [s],bridge [V]\n{rows}")
}

fn compensate(folder: &Folder, more: &[&str]) -> crate::util::Ran {
    folder.run(&[&COMPENSATE[..], &["--force"], more].concat())
}

/// 1 kHz for two seconds, with the milliseconds dropped: two stamps, which any rate above 1999 samples in 3 s
/// explains.
#[test]
fn stamps_in_whole_seconds_do_not_give_a_rate_for_a_resonance() {
    let folder = Folder::new();
    let clock = |i: usize| format!("10:00:0{}", i / 1000);
    folder.write("in.csv", record(clock, 0..2000).replace("Time [s]", "Time"));
    let asks = ["rounded to 1 s", "any rate of", "Hz or more", "--rate HZ"];
    compensate(&folder, &[]).says(1, &asks);
    let response = ["--stand", "stand.toml"];
    let runs: [&[&str]; 3] = [
        &["harmonics", "in.csv", "--fundamental", "10"],
        &[
            "simulate",
            "in.csv",
            "--applied",
            "bridge",
            "--unit",
            "N m",
            "-o",
            "s.csv",
        ],
        &["compensate", "-", "-o", "out.csv", "--force"],
    ];
    for run in runs {
        folder
            .pipe(&[run, &response].concat(), folder.read("in.csv").as_bytes())
            .says(1, &asks);
    }
    compensate(&folder, &["--rate", "1000"]).says(0, &["2000 samples at 1000 Hz"]);
    assert_close(
        *column(&folder.read("out.csv"), "time_s").last().unwrap(),
        1.999,
        1e-9,
    );
    let inspected = folder.run(&["inspect", "in.csv"]);
    assert!(
        inspected.code == 0 && inspected.stdout.contains("any rate of"),
        "{}",
        inspected.stdout
    );
}

/// One row in 100 missing or written twice, or 990 or 1010 Hz in whole milliseconds: the stamps do not tell which.
#[test]
fn regular_losses_that_rounded_stamps_would_hide_are_said() {
    let folder = Folder::new();
    let stamp = |i: usize| format!("{:.3}", i as f64 * 1e-3);
    let rows = (0..10_000).filter(|i| i % 100 != 50);
    folder.write("in.csv", record(stamp, rows));
    let said = ["at 990 Hz", "at 1000 Hz if one row in 100 is missing"];
    compensate(&folder, &[]).says(0, &said);
    let rows = (0..10_000).flat_map(|i| std::iter::repeat_n(i, 1 + usize::from(i % 100 == 50)));
    folder.write("in.csv", record(stamp, rows));
    let said = ["at 1010 Hz", "one row in 100 was written twice"];
    compensate(&folder, &[]).says(0, &said);
    let given = compensate(&folder, &["--rate", "1000"]);
    given.says(0, &["rate-overrides-stamps", "give 1010 Hz"]);
}

/// 800 Hz in whole milliseconds: steps of 1 and 2 ms. Over 12.5 s they determine the rate to better
/// than 0.01 %.
#[test]
fn stamps_rounded_a_little_give_the_rate() {
    let folder = Folder::new();
    let stamp = |i: usize| format!("{:.3}", (i as f64 * 1.25).floor() * 1e-3);
    folder.write("in.csv", record(stamp, 0..10_000));
    compensate(&folder, &[]).says(0, &["at 800 Hz", "rounded-time-stamps"]);
    let given = compensate(&folder, &["--rate", "800"]);
    assert!(
        given.code == 0 && !given.stderr.contains("rate-joins-gaps"),
        "{}",
        given.stderr
    );
}

/// Twenty samples are missing after 0.499 s: a given rate joins the ends, and a warning says so.
#[test]
fn a_given_rate_does_not_hide_a_gap() {
    let folder = Folder::new();
    let stamp = |i: usize| format!("{:.3}", 1e-3 * i as f64);
    folder.write("in.csv", record(stamp, (0..500).chain(520..2000)));
    let refused = compensate(&folder, &[]);
    refused.says(1, &["21 times the usual one", "--fill linear", "--range"]);
    assert!(!refused.stderr.contains("--rate"), "{}", refused.stderr);
    let said = [
        "[rate-joins-gaps]",
        "skip 0.02 s in 1 gap (about 20 samples)",
        "from 0.499 s to 0.52 s",
    ];
    compensate(&folder, &["--rate", "1000"]).says(0, &said);
    compensate(&folder, &["--rate", "1000", "--range", "0.1..1.9"]).says(0, &said);
    compensate(&folder, &["--rate", "1000", "--strict"]).says(3, &said);
    folder
        .run(&[&HARMONICS[..], &["10", "--rate", "1000"]].concat())
        .says(0, &said);
    let decay = |i: usize| {
        let t = 1e-3 * (i as f64 - 100.0);
        f64::from(u8::from(t >= 0.0)) * (-3.0 * t).exp() * (377.0 * t).cos()
    };
    let rows = (0..500)
        .chain(520..3000)
        .map(|i| format!("{:.3},{:.9}\n", 1e-3 * i as f64, decay(i)));
    folder.write(
        "decay.csv",
        format!("Time [s],bridge [V]\n{}", rows.collect::<String>()),
    );
    folder
        .run(&["identify", "decay", "decay.csv", "--rate", "1000"])
        .says(0, &said);
    // Set back by a quarter of a second.
    let back = |i: usize| format!("{:.3}", 1e-3 * i as f64 - if i < 500 { 0.0 } else { 0.25 });
    folder.write("in.csv", record(back, 0..2000));
    let said = [
        "[rate-joins-gaps]",
        "run backwards 1 time, first from 0.499 s to 0.25 s",
    ];
    compensate(&folder, &["--rate", "1000"]).says(0, &said);
    // Uniform stamps, and stamps that are not sample times, cause no warning.
    for stamp in [
        |i: usize| format!("{:.3}", 1e-3 * i as f64),
        |_: usize| "0.5".to_owned(),
    ] {
        folder.write("in.csv", record(stamp, 0..2000));
        let ran = compensate(&folder, &["--rate", "1000", "--time-column", "1"]);
        assert!(!ran.stderr.contains("rate-joins-gaps"), "{}", ran.stderr);
    }
}

/// The factors had been ignored, or taken the other way: frequencies 1000 times too low.
#[test]
fn a_factor_beside_the_time_that_could_be_either_is_asked_for() {
    let folder = Folder::new();
    let stamp = |i: usize| format!("{:.1}", 0.5 * i as f64);
    for heading in [
        "Time x1000 [s]",
        "Time*1000 (s)",
        "1000 x time [s]",
        "Time [s] x 1000",
    ] {
        folder.write(
            "in.csv",
            record(stamp, 0..2000).replace("Time [s]", heading),
        );
        compensate(&folder, &[]).says(1, &[heading, "scale factor", "--time-unit ms"]);
        compensate(&folder, &["--time-unit", "ms"]).says(0, &["2000 samples at 2000 Hz"]);
    }
    folder.write(
        "in.csv",
        record(stamp, 0..2000).replace("Time [s]", "Zeit in 1/1000 s"),
    );
    compensate(&folder, &[]).says(0, &["2000 samples at 2000 Hz"]);
}

/// It may be the frequency of the signal; of two rates, either may be that of the samples; an interval of 5 may be one
/// of 5 ms.
#[test]
fn a_doubtful_rate_above_a_table_is_an_assumption() {
    let folder = Folder::new();
    let rows: String = (0..2000).map(|i| format!("{:.9}\n", volts(i))).collect();
    for (header, is_assumed) in [
        ("Frequency: 2000 Hz", true),
        ("Sampling frequency: 2000 Hz", false),
        ("SampleRate: 2000\nSampleRate: 1000", true),
        ("Sample rate: 2000 Hz\nSample interval: 1 ms", true),
        ("Sample rate: 2000 Hz\nSample interval: 0.5 ms", false),
        ("Sample rate: 2000 Hz\nMax. sample rate: 100 kHz", false),
        ("Interval: 5", true),
        ("Interval: 5 ms", false),
        ("Interval: 0.0005", false),
        ("Total sample rate: 4 kHz", true),
        ("ADC sample rate: 10 kHz\nStorage rate: 2 kHz", true),
        ("Sample rate: 10 kHz\nDecimation: 5", true),
        ("Sample rate: 2 kHz\nDecimation: 1", false),
        ("Sample rate,12,500", true),
        ("Sample rate,12,500 Hz", false),
        ("Sample rate,500,500", false),
    ] {
        folder.write("in.csv", format!("{header}\nbridge [V]\n{rows}"));
        let report = folder.json(&["inspect", "in.csv", "--json"]);
        let is_said = crate::util::codes(&report).contains(&"time-assumed");
        assert_eq!(is_said, is_assumed, "{header}: {report}");
    }
    // Without a colon, the comma is the decimal mark of the interval and not the end of its name.
    let rows: String = (0..2000)
        .map(|i| format!("{:.9};0\n", volts(i)).replace('.', ","))
        .collect();
    for (header, rate_hz) in [
        ("Abtastintervall 0,5 ms", None),
        ("Abtastintervall: 0,5 ms", Some(2000.0)),
        ("Abtastintervall,0.5 ms", Some(2000.0)),
    ] {
        folder.write("in.csv", format!("{header}\nbridge [V];n [rpm]\n{rows}"));
        let report = folder.json(&["inspect", "in.csv", "--json"]);
        let found = report["channels"][0]["rate_hz"].as_f64();
        assert_eq!(found, rate_hz, "{header}");
    }
}

/// 1 kHz in blocks of 50 samples, each stamped on arrival: nothing is missing.
#[test]
fn stamps_of_blocks_on_arrival_are_named() {
    let folder = Folder::new();
    let late = |block: usize| 4e-3 * ((7 * block) % 10) as f64 / 10.0;
    let apart = |i: usize| {
        format!(
            "{:.6}",
            0.05 * (i / 50) as f64 + late(i / 50) + 1e-5 * (i % 50) as f64
        )
    };
    let shared = |i: usize| format!("{:.2}", 0.05 * (1 + i / 50) as f64);
    let stamps: [&dyn Fn(usize) -> String; 2] = [&apart, &shared];
    for stamp in stamps {
        folder.write("in.csv", record(stamp, 0..2000));
        let said = ["in blocks of 50", "--rate HZ"];
        let refused = compensate(&folder, &[]);
        refused.says(1, &said);
        assert!(!refused.stderr.contains("--fill"), "{}", refused.stderr);
        let report = folder.json(&["inspect", "in.csv", "--json"]);
        assert!(report["warnings"].to_string().contains(said[0]), "{report}");
        let given = compensate(&folder, &["--rate", "1000"]);
        given.says(0, &["2000 samples at 1000 Hz"]);
        assert!(!given.stderr.contains("rate-joins"), "{}", given.stderr);
    }
}
