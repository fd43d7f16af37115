//! Time stamps: the rate that they say, in every verb the same, and what is missing among them.

use serde_json::Value;

use crate::util::{Folder, Ran};

/// Nanoseconds since 1970 at which the records begin: 2024-03-12T13:26:40Z.
const START_NS: u128 = 1_710_250_000_000_000_000;

/// A stamp of a clock that counts from 1970, rounded to whole units of so many ns, as text.
type Spelling = fn(u128) -> String;

fn seconds(ns: u128, decimals: u32) -> String {
    let unit = 10_u128.pow(9 - decimals);
    let stamp = (ns + unit / 2) / unit;
    let per_second = 10_u128.pow(decimals);
    let (whole, part) = (stamp / per_second, stamp % per_second);
    format!("{whole}.{part:0width$}", width = decimals as usize)
}

/// The signal in volts at 1/128 of the rate, so that all verbs can work with it.
fn record(rate_hz: (u128, u128), samples: u128, unit: &str, spell: Spelling) -> String {
    let (hz, per) = rate_hz;
    let rows = (0..samples).map(|i| {
        let ns = START_NS + (i * per * 1_000_000_000 + hz / 2) / hz;
        let volts = 0.1 * (i as f64 * std::f64::consts::TAU / 128.0).cos();
        format!("{},{volts:.6}\n", spell(ns))
    });
    format!("time [{unit}],bridge [V]\n{}", rows.collect::<String>())
}

fn json(ran: &Ran) -> Value {
    assert!(matches!(ran.code, 0 | 3), "{}", ran.stderr);
    serde_json::from_str(&ran.stdout).expect("one JSON document")
}

/// The rate and the start that each verb takes from a record.
fn rates(folder: &Folder, name: &str, hz: f64) -> Vec<(&'static str, f64, i64)> {
    let fundamental = format!("{}", hz / 128.0);
    let band = format!("{}", hz / 16.0);
    let stand = ["--stand", "stand.toml", "--json"];
    let runs: [(&str, &[&str]); 3] = [
        ("compensate", &["--band", &band, "-o", "out.csv", "--force"]),
        (
            "harmonics",
            &["--fundamental", &fundamental, "--orders", "1"],
        ),
        (
            "simulate",
            &[
                "--applied",
                "1",
                "--unit",
                "N m",
                "-o",
                "out.csv",
                "--force",
            ],
        ),
    ];
    let mut found: Vec<(&str, f64, i64)> = runs
        .iter()
        .map(|(verb, more)| {
            let ran = folder.run(&[&[*verb, name], *more, &stand[..]].concat());
            let report = json(&ran);
            (
                *verb,
                report["rate_hz"].as_f64().unwrap(),
                report["start_ns"].as_i64().unwrap(),
            )
        })
        .collect();
    let report = json(&folder.run(&["inspect", name, "--json"]));
    let channel = &report["channels"][0];
    found.push((
        "inspect",
        channel["rate_hz"].as_f64().unwrap(),
        channel["start_ns"].as_i64().unwrap(),
    ));
    found
}

/// Stamps since 1970 say the rate of the record to 1e-9, in every verb, however they are written: the rates are those of
/// recorders, 25.6 kHz being 39.0625 µs a step and 44.1 kHz no whole number of anything.
#[test]
fn the_rate_of_epoch_stamps_is_exact_in_every_verb() {
    let spellings: [(&str, Spelling); 6] = [
        ("s", |ns| seconds(ns, 6)),
        ("s", |ns| seconds(ns, 9)),
        ("ms", |ns| {
            let us = (ns + 500) / 1000;
            format!("{}.{:03}", us / 1000, us % 1000)
        }),
        ("us", |ns| ((ns + 500) / 1000).to_string()),
        ("ns", |ns| ns.to_string()),
        // As numpy writes an f64.
        ("s", |ns| format!("{:.18e}", ns as f64 * 1e-9)),
    ];
    let folder = Folder::new();
    for (hz, per) in [
        (1, 100),
        (1, 3),
        (50, 3),
        (300, 1),
        (1000, 1),
        (25_600, 1),
        (44_100, 1),
        (51_200, 1),
        (1_000_000, 1),
    ] {
        let rate_hz = hz as f64 / per as f64;
        for (unit, spell) in spellings {
            folder.write("record.csv", record((hz, per), 6000, unit, spell));
            for (verb, found_hz, start_ns) in rates(&folder, "record.csv", rate_hz) {
                let what = format!("{rate_hz} Hz, {}: {verb} {found_hz}", spell(START_NS));
                assert!((found_hz / rate_hz - 1.0).abs() < 1e-9, "{what}");
                assert_eq!(start_ns, START_NS as i64, "{what}");
            }
        }
    }
}

/// 10 MHz needs nanoseconds, and a clock that counts from zero has them in any case.
#[test]
fn the_rate_of_fast_records_is_exact() {
    let folder = Folder::new();
    let of_zero: Spelling = |ns| seconds(ns - START_NS, 9);
    for (hz, spell, is_epoch) in [
        (10_000_000, (|ns| seconds(ns, 9)) as Spelling, true),
        (10_000_000, of_zero, false),
        (6_250_000, of_zero, false),
    ] {
        folder.write("record.csv", record((hz, 1), 6000, "s", spell));
        let report = json(&folder.run(&["inspect", "record.csv", "--json"]));
        let channel = &report["channels"][0];
        let found = channel["rate_hz"].as_f64().unwrap();
        assert!((found / hz as f64 - 1.0).abs() < 1e-9, "{found}");
        assert_eq!(channel["start_ns"].is_null(), !is_epoch);
        let fundamental = format!("{}", hz / 128);
        let args = [
            "harmonics",
            "record.csv",
            "--stand",
            "stand.toml",
            "--json",
            "--orders",
            "1",
        ];
        let report = json(&folder.run(&[&args[..], &["--fundamental", &fundamental]].concat()));
        let found = report["rate_hz"].as_f64().unwrap();
        assert!((found / hz as f64 - 1.0).abs() < 1e-9, "{found}");
    }
}

/// Order 10 of a record with stamps since 1970 has the size that it has with stamps from zero: 0.5 N m. With a rate that
/// is off by 0.2 % it would be lost.
#[test]
fn high_orders_keep_their_size_whatever_the_clock() {
    let folder = Folder::new();
    let torque = |i: u32| {
        let phase = std::f64::consts::TAU * 10.0 * f64::from(i) / 25_600.0;
        (2.0 * phase.cos() + 0.5 * (10.0 * phase).cos()) / 1667.65
    };
    let rows = (0..51_200_u32).map(|i| {
        let ns = START_NS + u128::from(i) * 1_000_000_000 / 25_600;
        format!("{},{:.12}\n", seconds(ns, 6), torque(i))
    });
    folder.write(
        "record.csv",
        format!("time [s],bridge [V]\n{}", rows.collect::<String>()),
    );
    let report = json(&folder.run(&[
        "harmonics",
        "record.csv",
        "--stand",
        "stand.toml",
        "--fundamental",
        "10",
        "--orders",
        "1,10",
        "--json",
    ]));
    for (place, expected) in [(0, 2.0), (1, 0.5)] {
        let recorded = report["components"][place]["recorded"].as_f64().unwrap();
        assert!((recorded / expected - 1.0).abs() < 2e-3, "{recorded}");
    }
    let text = folder.run(&["extract", "record.csv"]);
    let second = text.stdout.lines().nth(2).unwrap();
    assert!(second.starts_with("1710250000.000039,"), "{second}");
}
