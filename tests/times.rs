//! Time stamps: the rate that they give, the same in every command, and missing samples among them.

use std::f64::consts::TAU;

use serde_json::Value;

use crate::mcap_file::{Cdr, McapFile};
use crate::util::{COMPENSATE, Folder, Ran, codes};

/// Nanoseconds since 1970 at which the records begin: 2024-03-12T13:26:40Z.
const START_NS: u128 = 1_710_250_000_000_000_000;

/// A stamp of a clock that counts from 1970, rounded to multiples of a unit in ns, as text.
type Spelling = fn(u128) -> String;

fn seconds(ns: u128, decimals: u32) -> String {
    let unit = 10_u128.pow(9 - decimals);
    let stamp = (ns + unit / 2) / unit;
    let per_second = 10_u128.pow(decimals);
    let (whole, part) = (stamp / per_second, stamp % per_second);
    format!("{whole}.{part:0width$}", width = decimals as usize)
}

/// The signal in volts at 1/128 of the rate, so that all commands can use it.
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

/// Rate and start of a record according to each command.
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

/// Stamps since 1970 give the rate of the record to 1e-9, in every command, however they are written: the rates are
/// those of recorders, with 39.0625 µs per step for 25.6 kHz and no round step for 44.1 kHz.
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
        // An f64 as written by numpy.
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
            folder.write("record.csv", record((hz, per), 3000, unit, spell));
            for (verb, found_hz, start_ns) in rates(&folder, "record.csv", rate_hz) {
                let what = format!("{rate_hz} Hz, {}: {verb} {found_hz}", spell(START_NS));
                assert!((found_hz / rate_hz - 1.0).abs() < 1e-9, "{what}");
                assert_eq!(start_ns, START_NS as i64, "{what}");
            }
        }
    }
}

/// A record whose columns suit one command each: torque and response of a resonance at 0.2 rad per sample, an angle and
/// the torque that moves it, a decay of 32 samples per period.
fn record_of_all(hz: (u128, u128), heading: &str, spell: &dyn Fn(u128) -> String) -> String {
    let (mut state, mut before) = (1_u64, [0.0; 2]);
    let turn = std::f64::consts::TAU / 256.0;
    let rows = (0..3000_u128).map(|i| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        let applied = (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        let answer = 0.04 * applied + 1.96 * 0.2_f64.cos() * before[0] - 0.9604 * before[1];
        before = [answer, before[0]];
        let angles = [turn * i as f64, 3.3 * turn * i as f64 + 1.0];
        let angle = angles[0].cos() + 0.4 * angles[1].cos();
        let torque = -0.24 * angles[0].cos()
            - 1.05 * angles[1].cos()
            - 0.1 * angles[0].sin()
            - 0.132 * angles[1].sin()
            + 0.01 * applied;
        let ringing = (-0.003 * i as f64).exp() * (std::f64::consts::TAU * i as f64 / 32.0).cos();
        let ns = START_NS + (i * hz.1 * 1_000_000_000 + hz.0 / 2) / hz.0;
        format!(
            "{},{applied:.6},{answer:.6},{angle:.7},{torque:.6},{:.6}\n",
            spell(ns),
            ringing + 1e-4 * applied
        )
    });
    let names = "applied [N m],answer [N m],angle [rad],torque [N m],ring [V]";
    format!("{heading},{names}\n{}", rows.collect::<String>())
}

/// A stamp in ISO 8601 with this many decimals of a second; the records are shorter than the rest of the
/// month.
fn iso(ns: u128, decimals: u32) -> String {
    let text = seconds(ns, decimals);
    let (whole, part) = text.split_once('.').expect("a part of a second");
    let since: u64 = whole.parse().expect("seconds");
    let since = since - 1_709_251_200;
    let [day, hour] = [since / 86_400 + 1, since / 3600 % 24];
    format!(
        "2024-03-{day:02}T{hour:02}:{:02}:{:02}.{part}Z",
        since / 60 % 60,
        since % 60
    )
}

/// The commands that read a whole record, and `extract`, use the same rate, also from dates and from stamps that begin
/// at zero.
#[test]
fn the_rate_is_the_same_in_every_verb_that_takes_a_record() {
    let spellings: [(&str, Spelling); 7] = [
        ("time [s]", |ns| seconds(ns, 6)),
        ("time [s]", |ns| seconds(ns, 9)),
        ("time [us]", |ns| ((ns + 500) / 1000).to_string()),
        ("time [ns]", |ns| ns.to_string()),
        ("time", |ns| iso(ns, 6)),
        ("time", |ns| iso(ns, 9)),
        ("time [s]", |ns| seconds(ns - START_NS, 9)),
    ];
    let folder = Folder::new();
    let rates: [(u128, u128); 9] = [
        (1, 100),
        (1, 10),
        (1, 1),
        (2997, 50),
        (25_600, 1),
        (44_100, 1),
        (51_200, 1),
        (1_000_000, 1),
        (10_000_000, 1),
    ];
    for hz in rates {
        let rate_hz = hz.0 as f64 / hz.1 as f64;
        let band = format!("{}..{}", 0.005 * rate_hz, 0.1 * rate_hz);
        let fundamental = format!("{}", rate_hz / 32.0);
        for (k, (heading, spell)) in spellings.into_iter().enumerate() {
            let has_us = [0, 2, 4].contains(&k);
            if has_us && rate_hz > 1e6 {
                continue;
            }
            folder.write("record.csv", record_of_all(hz, heading, &spell));
            let extract = [
                "extract",
                "record.csv",
                "--channel",
                "ring",
                "-o",
                "one.csv",
                "--force",
            ];
            assert_eq!(folder.run(&extract).code, 0);
            let runs: [&[&str]; 6] = [
                &["inspect", "record.csv"],
                &["inspect", "one.csv"],
                &[
                    "harmonics",
                    "record.csv",
                    "--channel",
                    "ring",
                    "--stand",
                    "stand.toml",
                    "--orders",
                    "1",
                    "--fundamental",
                    &fundamental,
                ],
                &["identify", "decay", "record.csv", "--channel", "ring"],
                &[
                    "identify",
                    "runup",
                    "record.csv",
                    "--motion",
                    "angle",
                    "--torque",
                    "torque",
                ],
                &[
                    "identify",
                    "response",
                    "record.csv",
                    "--applied",
                    "applied",
                    "--measured",
                    "answer",
                    "--excitation",
                    "random",
                    "--modes",
                    "1",
                    "--band",
                    &band,
                ],
            ];
            for run in runs {
                let report = json(&folder.run(&[run, &["--json"]].concat()));
                let found = match run[0] {
                    "inspect" => &report["channels"][0]["rate_hz"],
                    _ => &report["rate_hz"],
                };
                let found_hz = found.as_f64().expect("a rate");
                let what = format!("{rate_hz} Hz, {}: {run:?} {found_hz}", spell(START_NS));
                assert!((found_hz / rate_hz - 1.0).abs() < 1e-9, "{what}");
            }
        }
    }
}

/// 10 MHz needs nanoseconds, which a clock that counts from zero always has.
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

/// Order 10 of a record with stamps since 1970 has the same amplitude as with stamps from zero: 0.5 N m. With a rate
/// off by 0.2 % it would be lost.
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

/// A straight line of 400 samples at 10 kHz, 1 V/s, as rows of time and value.
fn straight(row: impl Fn(usize, String, String) -> Option<String>) -> String {
    let rows = (0..400).filter_map(|i| {
        let time = format!("{:.4}", i as f64 * 1e-4);
        row(i, time.clone(), time)
    });
    format!("time [s],bridge [V]\n{}", rows.collect::<String>())
}

const READERS: [&[&str]; 5] = [
    &["extract", "record.csv"],
    &[
        "compensate",
        "record.csv",
        "--stand",
        "stand.toml",
        "-o",
        "out.csv",
        "--force",
    ],
    &[
        "harmonics",
        "record.csv",
        "--stand",
        "stand.toml",
        "--fundamental",
        "80",
        "--orders",
        "1",
    ],
    &[
        "simulate",
        "record.csv",
        "--unit",
        "N m",
        "--stand",
        "stand.toml",
        "-o",
        "out.csv",
        "--force",
    ],
    &["identify", "decay", "record.csv"],
];

/// An empty time cell, in the middle, at the start, and from some row to the end, and an empty value cell: every
/// command rejects it at the same line with the same remedy, and none prints a non-finite number.
#[test]
fn blank_cells_are_refused_in_every_verb() {
    let folder = Folder::new();
    type Case<'a> = (&'a str, &'a dyn Fn(usize) -> bool, bool);
    let cases: [Case; 4] = [
        ("line 302", &|i| i == 300, true),
        ("line 2", &|i| i == 0, true),
        ("line 302", &|i| i >= 300, true),
        ("line 302", &|i| i == 300, false),
    ];
    for (line, is_blank, is_time) in cases {
        let record = straight(|i, time, value| {
            Some(match (is_blank(i), is_time) {
                (false, _) => format!("{time},{value}\n"),
                (true, true) => format!(",{value}\n"),
                (true, false) => format!("{time},\n"),
            })
        });
        folder.write("record.csv", record);
        for args in READERS {
            let ran = folder.run(args);
            let what = format!("{args:?}: {}", ran.stderr);
            assert_eq!(ran.code, 1, "{what}");
            assert!(
                ran.stderr.contains(line) && ran.stderr.contains("--fill linear"),
                "{what}"
            );
            assert!(
                !ran.stderr.contains("NaN") && !ran.stdout.contains("NaN"),
                "{what}"
            );
        }
    }
}

/// A text truncated anywhere within its last two rows: the remainder is complete, or code 3 says that
/// it is not.
#[test]
fn a_cut_text_is_never_taken_for_a_whole_one() {
    let folder = Folder::new();
    let whole = straight(|_, time, value| Some(format!("{time},{value}\n")));
    for length in whole.len() - 26..=whole.len() {
        let part = &whole[..length];
        folder.write("record.csv", part);
        let rows = part.lines().count() - 1;
        for args in [
            &["inspect", "record.csv"][..],
            READERS[0],
            READERS[1],
            READERS[3],
        ] {
            let ran = folder.run(args);
            let expected = if part.ends_with('\n') { 0 } else { 3 };
            assert_eq!(
                ran.code,
                expected,
                "{args:?}, {rows} rows, {:?}: {}",
                &part[length - 12..],
                ran.stderr
            );
            let code = ["truncated-last-line", "unended-last-line"];
            assert!(
                expected == 0
                    || code
                        .iter()
                        .any(|code| (ran.stderr.clone() + &ran.stdout).contains(code))
            );
        }
    }
}

/// Stamps as written by pandas: with offsets over the end of daylight saving time, and as times since the
/// start.
#[test]
fn offsets_and_durations_of_pandas_are_times() {
    let folder = Folder::new();
    let with = |stamp: &dyn Fn(u32) -> String| {
        let rows = (0..2000_u32).map(|i| {
            let torque = 5.0 + (0.3 * f64::from(i)).sin();
            format!("{},{torque:.6}\n", stamp(i))
        });
        folder.write(
            "in.csv",
            format!("time,torque [N m]\n{}", rows.collect::<String>()),
        );
        let report = json(&folder.run(&["inspect", "in.csv", "--json"]));
        assert_eq!(report["channels"][0]["rate_hz"], 1000.0, "{report}");
        assert_eq!(report["warnings"], Value::Array(Vec::new()));
        folder
            .run(&[&crate::util::COMPENSATE[..], &["--force"]].concat())
            .says(0, &["2000 samples at 1000 Hz"]);
    };
    with(&|i| match i {
        0..1000 => format!("2024-10-27T02:59:59.{i:03}+02:00"),
        _ => format!("2024-10-27T02:00:00.{:03}+01:00", i - 1000),
    });
    with(&|i| format!("0 days 00:00:{:02}.{:03}000", i / 1000, i % 1000));
}

/// 20 kHz with stamps in whole milliseconds, twenty samples per stamp: the rate is that of all of them, nothing is
/// omitted, and the times are those of the samples.
#[test]
fn stamps_that_samples_share_give_the_rate() {
    let folder = Folder::new();
    let rows = (0..20_000_u32).map(|i| {
        let volts = 0.1 * (std::f64::consts::TAU * 50.0 * f64::from(i) / 20_000.0).cos();
        format!("{},{volts:.9}\n", i / 20)
    });
    folder.write(
        "record.csv",
        format!("time [ms],bridge [V]\n{}", rows.collect::<String>()),
    );
    let args = [
        "harmonics",
        "record.csv",
        "--stand",
        "stand.toml",
        "--fundamental",
        "50",
        "--orders",
        "1",
        "--json",
    ];
    let ran = folder.run(&args);
    let report = json(&ran);
    assert!((report["rate_hz"].as_f64().unwrap() / 20_000.0 - 1.0).abs() < 1e-9);
    let recorded = report["components"][0]["recorded"].as_f64().unwrap();
    // 1230 ft lbf/V are 1667.657 N m/V.
    assert!((recorded / 166.765_7 - 1.0).abs() < 1e-6, "{recorded}");
    assert!(
        ran.stderr.contains("rounded-time-stamps") && !ran.stderr.contains("--resample"),
        "{}",
        ran.stderr
    );
    // Interpolating between the stamps would keep one sample in 20.
    folder
        .run(&[&args[..], &["--resample"]].concat())
        .says(1, &["20 samples", "omit it", "20000 Hz"]);
    let extracted = folder.run(&["extract", "record.csv"]);
    assert_eq!(extracted.stdout.lines().count(), 20_001);
    assert!(
        extracted
            .stdout
            .lines()
            .nth(3)
            .unwrap()
            .starts_with("0.0001,"),
        "{}",
        extracted.stdout.lines().nth(3).unwrap()
    );
}

/// The same in the headers of messages: 2 kHz in whole milliseconds.
#[test]
fn header_stamps_that_samples_share_give_the_rate() {
    let definition = format!(
        "std_msgs/Header header\nfloat64 torque\n{}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n",
        "=".repeat(80)
    );
    let mut file = McapFile::new(None, "ros2", "recorder");
    let schema = ("p/msg/M", "ros2msg", definition.as_bytes());
    let channel = file.channel("/ft", "cdr", Some(schema));
    for i in 0..20_000_u64 {
        let at_ns = 1_700_000_000_000_000_000 + i * 500_000;
        let mut data = Cdr::new();
        data.stamp(at_ns / 1_000_000 * 1_000_000);
        data.text("ft");
        data.f64(0.1 * (std::f64::consts::TAU * 50.0 * i as f64 / 2000.0).cos());
        file.message(channel, i as usize, at_ns + i * 7919 % 90_000, &data.0);
    }
    let folder = Folder::new();
    folder.write("record.mcap", file.finish());
    let read = [
        "record.mcap",
        "--topic",
        "/ft",
        "--field",
        "torque",
        "--unit",
        "N m",
    ];
    let verb = [
        "harmonics",
        "--fundamental",
        "50",
        "--orders",
        "1",
        "--json",
    ];
    let args = [&verb[..], &read, &["--stand", "stand.toml"]].concat();
    let ran = folder.run(&args);
    let report = json(&ran);
    assert_eq!(report["rate_hz"].as_f64(), Some(2000.0), "{report}");
    let recorded = report["components"][0]["recorded"].as_f64().unwrap();
    assert!((recorded / 0.1 - 1.0).abs() < 1e-6, "{recorded}");
    assert!(ran.stderr.contains("rounded-time-stamps"), "{}", ran.stderr);
    let extracted = folder.run(&[&["extract"], &read[..]].concat());
    let row = extracted.stdout.lines().nth(4).unwrap().to_owned();
    assert!(row.starts_with("1700000000.0015"), "{row}");
}

/// Part of a record by seconds, by seconds since 1970, by seconds after its start, and by time of day.
#[test]
fn a_range_is_taken_by_any_clock() {
    let folder = Folder::new();
    folder.write(
        "zero.csv",
        straight(|_, time, value| Some(format!("{time},{value}\n"))),
    );
    folder.write(
        "epoch.csv",
        record((10_000, 1), 400, "s", |ns| seconds(ns, 6)),
    );
    let clock = (0..400).map(|i| format!("2024-03-12 13:26:{:02}.{:04},{i}\n", 40 + i / 10_000, i));
    folder.write(
        "clock.csv",
        format!("time,bridge [V]\n{}", clock.collect::<String>()),
    );
    let clock = (0..400).map(|i| format!("2024-03-12T13:26:40.{i:04}+02:00,{i}\n"));
    folder.write(
        "zone.csv",
        format!("time,bridge [V]\n{}", clock.collect::<String>()),
    );
    for (name, range, first, rows) in [
        ("zero.csv", "0.01..0.0199", "0.0100", 100),
        ("zero.csv", "..0.0099", "0.0000", 100),
        ("zero.csv", "0.03..", "0.0300", 100),
        (
            "epoch.csv",
            "1710250000.01..1710250000.0199",
            "1710250000.01",
            100,
        ),
        ("epoch.csv", "0.01..0.0199", "1710250000.01", 100),
        (
            "epoch.csv",
            "13:26:40.01..13:26:40.0199",
            "1710250000.01",
            100,
        ),
        (
            "epoch.csv",
            "2024-03-12T13:26:40.01..2024-03-12T13:26:40.0199",
            "1710250000.01",
            100,
        ),
        ("clock.csv", "13:26:40.01..13:26:40.0199", "0.01", 100),
        // With a zone, whatever the record's: epoch stamps are in UTC.
        (
            "epoch.csv",
            "2024-03-12T15:26:40.01+02:00..09:26:40.0199-04:00",
            "1710250000.01",
            100,
        ),
        (
            "zone.csv",
            "2024-03-12T11:26:40.01Z..13:26:40.0199+02:00",
            "0.01",
            100,
        ),
        ("zone.csv", "13:26:40.01..13:26:40.0199", "0.01", 100),
    ] {
        let ran = folder.run(&["extract", name, "--range", range]);
        assert_eq!(ran.code, 0, "{name} {range}: {}", ran.stderr);
        let lines: Vec<&str> = ran.stdout.lines().collect();
        assert_eq!(lines.len(), rows + 1, "{name} {range}");
        let found: f64 = lines[1].split(',').next().unwrap().parse().unwrap();
        assert_eq!(
            found,
            first.parse::<f64>().unwrap(),
            "{name} {range}: {}",
            lines[1]
        );
    }
    let values: String = (0..400).map(|i| format!("{i}\n")).collect();
    folder.write("values.csv", format!("bridge [V]\n{values}"));
    let part = ["extract", "values.csv", "--range", "0.01..0.0199"];
    let ran = folder.run(&[&part[..], &["--rate", "10000"]].concat());
    assert_eq!(
        ran.stdout.lines().nth(1),
        Some("0.01,100.0"),
        "{}",
        ran.stderr
    );
    folder
        .run(&["extract", "clock.csv", "--range", "13:26:40Z.."])
        .says(1, &["time zone", "without a zone"]);
    folder
        .run(&["extract", "zero.csv", "--range", "5..6"])
        .says(1, &["no sample", "0.0399"]);
    folder
        .run(&["extract", "zero.csv", "--range", "x..6"])
        .says(2, &["--range"]);
}

/// Rows missing from a straight line, and empty cells in it, are restored on the line.
#[test]
fn missing_samples_are_filled_when_that_is_asked_for() {
    let folder = Folder::new();
    let record = straight(|i, time, value| match i {
        100..110 => None,
        200 => Some(format!("{time},\n")),
        300 => Some(format!(",{value}\n")),
        _ => Some(format!("{time},{value}\n")),
    });
    folder.write("record.csv", record);
    folder.run(&["extract", "record.csv"]).says(1, &["line"]);
    let ran = folder.run(&["extract", "record.csv", "--fill", "linear"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let rows: Vec<&str> = ran.stdout.lines().skip(1).collect();
    assert_eq!(rows.len(), 400);
    for row in rows {
        let (time, value) = row.split_once(',').unwrap();
        let (time, value): (f64, f64) = (time.parse().unwrap(), value.parse().unwrap());
        assert!((time - value).abs() < 1e-12, "{row}");
    }
    for said in [
        "[filled]",
        "12 missing samples at 3 places",
        "0.0099 s to 0.011 s",
    ] {
        assert!(ran.stderr.contains(said), "{}", ran.stderr);
    }
    let ran = folder.run(&["extract", "record.csv", "--fill", "hold"]);
    let held = ran.stdout.lines().nth(1 + 105).unwrap();
    assert!(held.ends_with(",0.0099"), "{held}");
    let args = [
        "compensate",
        "record.csv",
        "--stand",
        "stand.toml",
        "-o",
        "out.csv",
        "--json",
        "--fill",
        "linear",
    ];
    let report = json(&folder.run(&args));
    assert_eq!(report["filled"][0]["samples"], 10);
    assert!((report["filled"][0]["from_s"].as_f64().unwrap() - 0.0099).abs() < 1e-12);
}

/// Two samples are a record: no command crashes on them.
#[test]
fn a_record_of_two_samples_is_simulated_or_refused() {
    let folder = Folder::new();
    folder.write(
        "record.csv",
        "time [s],bridge [V]\n0.0000,0.1\n0.0001,0.2\n",
    );
    for args in READERS {
        for between in ["band-limited", "straight-lines", "held"] {
            let more = if args[0] == "simulate" {
                vec!["--between", between]
            } else {
                Vec::new()
            };
            let ran = folder.run(&[args, &more[..]].concat());
            assert!(matches!(ran.code, 0 | 1), "{args:?}: {}", ran.stderr);
            assert!(!ran.stderr.contains("panicked"), "{}", ran.stderr);
        }
    }
}

/// One record as a table and as messages, with a clock that starts with the machine or in 1970: a range is the same
/// instant in both and in every command, and phases refer to the same moment.
#[test]
fn a_range_is_the_same_instant_in_a_table_and_in_messages() {
    for (first_ns, range) in [
        (0_u64, ["0.25..0.75", "0.25..0.75"]),
        (5_000_000_000, ["5.25..5.75", "5.25..5.75"]),
        (
            1_710_250_000_000_000_000,
            ["0.25..0.75", "1710250000.25..1710250000.75"],
        ),
    ] {
        let folder = Folder::new();
        let mut text = "time_s,torque [N m]\n".to_owned();
        let mut file = McapFile::new(None, "", "");
        let schema = r#"{"type":"object","properties":{"Torque":{"type":"number"},"speed":{"type":"number"}}}"#;
        let channel = file.channel(
            "/stand",
            "json",
            Some(("s", "jsonschema", schema.as_bytes())),
        );
        for i in 0..1000_u64 {
            let ns = first_ns + i * 1_000_000;
            let value = (std::f64::consts::TAU * 40.0 * i as f64 * 1e-3).cos();
            text += &format!(
                "{}.{:09},{value:.9}\n",
                ns / 1_000_000_000,
                ns % 1_000_000_000
            );
            let message = format!("{{\"Torque\":{value:.9},\"speed\":1}}");
            file.message(channel, i as usize, ns, message.as_bytes());
        }
        folder.write("in.csv", text).write("in.mcap", file.finish());
        // Part of a name in any case selects a number of messages like a column.
        let mcap = ["--time", "publish", "--unit", "N m", "--channel", "torque"];
        for range in range {
            let both = |args: &[&'static str]| {
                let csv = [args, &["in.csv", "--range", range]].concat();
                let messages = [args, &["in.mcap", "--range", range], &mcap].concat();
                [csv, messages]
            };
            let rows = both(&["extract", "-q"]).map(|args| {
                let ran = folder.run(&args);
                assert_eq!(ran.code, 0, "{args:?}: {}", ran.stderr);
                ran.stdout
                    .lines()
                    .skip(1)
                    .map(str::to_owned)
                    .collect::<Vec<_>>()
            });
            assert_eq!(rows[0].len(), 501, "{range}");
            // Messages have stamps in ns, and their rows nine decimals.
            let plain = |row: &String| {
                let (time, value) = row.split_once(',').unwrap();
                let time = time.trim_end_matches('0').trim_end_matches('.');
                format!("{time},{value}")
            };
            let [table, messages] = rows.map(|rows| rows.iter().map(plain).collect::<Vec<_>>());
            assert_eq!(table, messages, "{range}");
            let harmonics = both(&[
                "harmonics",
                "--stand",
                "stand.toml",
                "--fundamental",
                "40",
                "--orders",
                "1",
                "--json",
            ]);
            let [table, messages] = harmonics.map(|args| folder.json(&args));
            for key in ["phase_reference", "start_s", "samples", "rate_hz"] {
                assert_eq!(table[key], messages[key], "{key} of {range}");
            }
            let phase =
                |report: &serde_json::Value| report["components"][0]["phase_deg"].as_f64().unwrap();
            assert!((phase(&table) - phase(&messages)).abs() < 1e-6, "{range}");
        }
    }
}

/// Stamps of 1999 Hz in µs over 1 s: the relative uncertainty of the rate is at worst 1e-6/√3. Stamps whose last digits
/// are zero except 0.1 ms may be rounded to that. With jitter: from the scatter of both ends.
#[test]
fn a_rate_from_stamps_has_an_uncertainty() {
    let folder = Folder::new();
    let mut noise = crate::noise::Noise(3);
    let mut table = |rate_hz: f64, jitter_s: f64| {
        let row = |i: usize| {
            let t = i as f64 / rate_hz + jitter_s * (noise.uniform() - 0.5);
            format!("{t:.6},{}\n", (i as f64 * 0.1).sin())
        };
        let rows: String = (0..2001).map(row).collect();
        format!("time_s,torque [N m]\n{rows}")
    };
    folder.write("rounded.csv", table(1999.0, 0.0));
    folder.write("even.csv", table(2000.0, 0.0));
    folder.write("uneven.csv", table(2000.0, 1e-4));
    let harmonics = |name: &'static str| {
        let args = [
            "harmonics",
            name,
            "--stand",
            "stand.toml",
            "--fundamental",
            "40",
            "--orders",
            "1",
            "--json",
        ];
        args.to_vec()
    };
    let found = folder.json(&harmonics("rounded.csv"));
    let [rate, std] = ["rate_hz", "rate_std_hz"].map(|key| found[key].as_f64().unwrap());
    assert!(
        std > 0.0 && std < 1.05 * 1999.0 * 1e-6 / 3.0_f64.sqrt(),
        "{std}"
    );
    assert!((rate - 1999.0).abs() < 4.0 * std, "{rate}");
    let stated = folder.json(&harmonics("even.csv"))["rate_std_hz"]
        .as_f64()
        .unwrap();
    assert!(
        (stated / (2000.0 * 1e-4 / 3.0_f64.sqrt()) - 1.0).abs() < 0.05,
        "{stated}"
    );
    let compensate = [
        "compensate",
        "even.csv",
        "--stand",
        "stand.toml",
        "--json",
        "-o",
        "out.csv",
    ];
    assert_eq!(
        folder.json(&compensate)["rate_std_hz"].as_f64(),
        Some(stated)
    );
    let given = [&harmonics("even.csv")[..], &["--rate", "2000"]].concat();
    assert!(folder.json(&given)["rate_std_hz"].is_null());
    // A rate from header or user has no uncertainty by the stamps.
    folder.write(
        "header.csv",
        format!("Sample rate;2000 Hz\n{}", table(2000.0, 0.0)),
    );
    for more in [&["header.csv"][..], &["even.csv", "--rate", "2000"]] {
        let inspected = folder.json(&[&["inspect", "--json"], more].concat());
        let channel = &inspected["channels"][0];
        assert!(channel["rate_std_hz"].is_null(), "{channel}");
        assert_eq!(channel["rate_hz"], 2000.0);
    }
    let inspected = folder.json(&["inspect", "uneven.csv", "--json"]);
    let stated = inspected["channels"][0]["rate_std_hz"].as_f64().unwrap();
    // A uniform jitter of ± 50 µs has a standard deviation of 29 µs: √2 of it over 1 s, of 2000 Hz.
    let want = 2000.0 * 2.0_f64.sqrt() * 1e-4 / 12.0_f64.sqrt();
    assert!((stated / want - 1.0).abs() < 0.1, "{stated} {want}");
}

/// Samples lost between stamps rounded to the millisecond, or to the second, several of which share one.
#[test]
fn lost_samples_between_rounded_stamps_are_named_with_their_place() {
    let folder = Folder::new();
    // Rate, decimals, first lost sample, lost samples, and the stamps around them.
    for (rate_hz, decimals, from, lost, between) in [
        (2000.0, 3, 4000, 40, "between 2 s and 2.02 s"),
        (5000.0, 3, 9000, 3, "between 1.8 s and 1.801 s"),
        (1500.0, 3, 4000, 4, "between 2.666 s and 2.669 s"),
        // No stamp of a second is missing.
        (2000.0, 0, 20_003, 1000, "between 10 s and 11 s"),
    ] {
        let torque = |i: usize| (std::f64::consts::TAU * 5.0 * i as f64 / rate_hz).sin();
        let row = |i: usize| {
            let scale = 10_f64.powi(decimals as i32);
            let stamp = (i as f64 / rate_hz * scale).round() / scale;
            format!("{stamp:.decimals$},{:.6}\n", torque(i))
        };
        let kept = (0..3 * from).filter(|i| !(from..from + lost).contains(i));
        let rows: String = kept.map(row).collect();
        folder.write("in.csv", format!("time_s,torque_N m\n{rows}"));
        let run = |more: &[&str]| folder.run(&[&COMPENSATE[..], more].concat());
        let about = format!("about {lost} samples are missing {between}");
        run(&[]).says(1, &[&about, "--fill linear"]);
        let applied = ["--applied", "1", "-o", "out.csv"];
        let simulate = ["simulate", "in.csv", "--stand", "stand.toml"];
        folder
            .run(&[&simulate[..], &applied].concat())
            .says(1, &[&about]);
        let rate = rate_hz.to_string();
        run(&["--rate", &rate, "--force"]).says(
            0,
            &[
                "rate-joins-gaps",
                "in 1 gap",
                &format!("(about {lost} samples)"),
            ],
        );
        run(&["--fill", "linear", "--force"])
            .says(0, &[&format!("{lost} missing samples at 1 place")]);
        folder.run(&["inspect", "in.csv"]).says(0, &[]);
        let inspected = json(&folder.run(&["inspect", "in.csv", "--json"]));
        assert_eq!(inspected["channels"][0]["rate_hz"].as_f64(), Some(rate_hz));
        let text = inspected["warnings"].to_string();
        assert!(
            text.contains("time-gaps") && text.contains(&format!("about {lost} ")),
            "{text}"
        );
    }
}

/// Whole seconds and nanoseconds in two columns, from 0.82 s of a second on, so short that the seconds change once or never,
/// and with one or two channels after them.
#[test]
fn seconds_and_nanoseconds_of_short_records_are_exact() {
    let start_ns = 1_710_238_532_823_456_789_u128;
    for (step_ns, count) in [
        (100_000, 900),
        (100_000, 5000),
        (1_000_000, 120),
        (1_000_000, 800),
    ] {
        for headings in [
            "header.stamp.sec,header.stamp.nanosec,frame_id,name[0],torque [N m]",
            "header.stamp.sec,header.stamp.nanosec,torque [N m]",
            "secs,nsecs,torque [N m],force [N]",
            "sec,nanosec,torque [N m]",
        ] {
            let row = |i: u128| {
                let ns = start_ns + i * step_ns;
                let (whole, part) = (ns / 1_000_000_000, ns % 1_000_000_000);
                let torque = 5.0 + (i as f64 * 0.03).sin();
                match headings {
                    _ if headings.contains("name") => {
                        format!("{whole},{part},base,motor,{torque:.6}\n")
                    }
                    _ if headings.contains("force") => format!("{whole},{part},{torque:.6},1.5\n"),
                    _ => format!("{whole},{part},{torque:.6}\n"),
                }
            };
            let folder = Folder::new();
            folder.write(
                "in.csv",
                format!("{headings}\n{}", (0..count).map(row).collect::<String>()),
            );
            let ran =
                folder.run(&[&COMPENSATE[..], &["--channel", "torque", "--band", "100"]].concat());
            assert_eq!(ran.code, 0, "{headings}: {}", ran.stderr);
            let out = folder.read("out.csv");
            let stamp = |line: usize| out.lines().nth(line).and_then(|l| l.split(',').next());
            for i in [0, 1, count - 1] {
                let want = seconds(start_ns + i * step_ns, 9);
                assert_eq!(
                    stamp(i as usize + 1),
                    Some(&want[..]),
                    "{headings} {step_ns} {i}"
                );
            }
        }
    }
}

/// Steps of 0.05 to 0.5 ms without order, as of a variable-step solver: the rate alone puts the samples elsewhere, which is
/// said, and interpolation keeps their times.
#[test]
fn stamps_without_a_usual_step_are_interpolated() {
    let mut noise = crate::noise::Noise(5);
    let mut at = 0.0;
    let mut rows = String::from("time_s,torque [N m]\n");
    while at < 0.5 {
        rows += &format!("{at:.8},{:.6}\n", 7.0 + (TAU * 40.0 * at).sin());
        at += 5e-5 * 10.0_f64.powf(noise.uniform());
    }
    let folder = Folder::new();
    folder.write("in.csv", rows);
    let run = |more: &[&str]| {
        folder.run(&[&COMPENSATE[..], &["--band", "100", "--force"], more].concat())
    };
    run(&[]).says(1, &["--resample --rate HZ", "mean rate"]);
    run(&["--rate", "5000"]).says(0, &["rate-overrides-stamps", "--resample --rate HZ"]);
    for rate in ["5500", "6000"] {
        run(&["--resample", "--rate", rate]).says(0, &["resampled"]);
        let times = crate::util::column(&folder.read("out.csv"), "time_s");
        assert!((times.last().expect("rows") - 0.5).abs() < 1e-3, "{rate}");
    }
    let inspected = folder.run(&["inspect", "in.csv"]);
    assert!(
        inspected.stdout.contains("--resample --rate HZ"),
        "{}",
        inspected.stdout
    );
}

/// A microsecond counter of 32 bits and a millisecond counter of 16 that start again.
#[test]
fn a_counter_that_rolls_over_is_named() {
    for (heading, bits, step, hz) in [
        ("tick_us", 32, 100_u64, "10000"),
        ("tick_ms", 16, 1, "1000"),
    ] {
        let first = (1_u64 << bits) - 1000 * step;
        let row = |i: u64| {
            let tick = (first + i * step) % (1 << bits);
            format!("{tick},{:.6}\n", 5.0 + (i as f64 * 0.05).sin())
        };
        let folder = Folder::new();
        let rows: String = (0..3000).map(row).collect();
        folder.write("in.csv", format!("{heading},torque [N m]\n{rows}"));
        let run = |more: &[&str]| folder.run(&[&COMPENSATE[..], &["--band", "100"], more].concat());
        run(&[]).says(
            1,
            &[
                &format!("counter of {bits} bits rolled over"),
                &format!("--rate {hz}"),
            ],
        );
        let ran = run(&["--rate", hz]);
        ran.says(0, &[]);
        assert!(!ran.stderr.contains("rate-joins-gaps"), "{}", ran.stderr);
    }
}

/// Four seconds at 5 kHz with stamps of four significant digits, in steps of a millisecond from 1 s on.
#[test]
fn stamps_of_four_significant_digits_are_rounded_ones() {
    let stamp = |i: usize| {
        let s = i as f64 * 2e-4;
        if s < 1.0 {
            format!("{s:.4}")
        } else {
            format!("{s:.3}")
        }
    };
    let rows: String = (0..20_000)
        .map(|i| format!("{},{:.6}\n", stamp(i), (i as f64 * 0.01).sin()))
        .collect();
    let folder = Folder::new();
    folder.write("in.csv", format!("time_s,T [N m]\n{rows}"));
    let compensate = [&COMPENSATE[..], &["--json", "--force"]].concat();
    let report = folder.json(&compensate);
    assert_eq!(
        (&report["samples"], &report["rate_hz"]),
        (&20_000.into(), &5000.0.into())
    );
    assert!(codes(&report).contains(&"rounded-time-stamps"), "{report}");
    let report = folder.json(&[&compensate[..], &["--rate", "5000"]].concat());
    assert!(!codes(&report).contains(&"rate-joins-gaps"), "{report}");
    let resample = [&compensate[..], &["--resample"]].concat();
    folder.run(&resample).says(1, &["omit it", "5000 Hz"]);
}

/// Every 500th row is written twice.
#[test]
fn a_rate_beside_repeated_stamps_is_questioned() {
    let row = |i: usize| format!("{:.4},{:.6}\n", i as f64 * 2e-4, (i as f64 * 0.01).sin());
    let rows: String = (0..10_000)
        .map(|i| row(i).repeat(if i % 500 == 17 { 2 } else { 1 }))
        .collect();
    let folder = Folder::new();
    folder.write("in.csv", format!("time_s,T [N m]\n{rows}"));
    let given = [&COMPENSATE[..], &["--rate", "5000"]].concat();
    let said = "20 time stamps repeat the one before, first at 0.0034 s";
    folder
        .run(&given)
        .says(0, &["rate-keeps-repeats", said, "--resample"]);
}

/// Minutes and seconds, as a spreadsheet exports them, past one full hour or more, in memory and as a stream.
#[test]
fn a_clock_without_hours_goes_on_past_the_hour() {
    let row = |i: usize| {
        let tenths = (34_700 + i) % 36_000;
        let (minute, tenths) = (tenths / 600, tenths % 600);
        let volts = 0.1 * (i as f64 * 0.02).cos();
        format!(
            "{minute:02}:{:02}.{},{volts:.6}\n",
            tenths / 10,
            tenths % 10
        )
    };
    let folder = Folder::new();
    for rows in [3000, 80_000] {
        let text: String = (0..rows).map(row).collect();
        folder.write("in.csv", format!("Time,bridge_V\n{text}"));
        let inspected = folder.json(&["inspect", "in.csv", "--json"]);
        assert_eq!(
            inspected["warnings"],
            Value::Array(Vec::new()),
            "{inspected}"
        );
        let report = folder.json(&[&COMPENSATE[..], &["--json", "--force"]].concat());
        assert_eq!(report["samples"], rows, "{report}");
        let text = folder.read("out.csv");
        let last = text.lines().last().expect("a row");
        assert!(last.starts_with(&format!("{}.9,", rows / 10 - 1)), "{last}");
        let part = ["--range", "59:50.0..00:30.5", "--json", "--force"];
        let report = folder.json(&[&COMPENSATE[..], &part].concat());
        assert_eq!(report["samples"], 406, "{report}");
    }
    // Half an hour back is no full hour.
    let text: String = (0..3000)
        .map(|i| row(if i < 2000 { i + 5000 } else { i }))
        .collect();
    folder.write("in.csv", format!("Time,bridge_V\n{text}"));
    let args = [&COMPENSATE[..], &["--force"]].concat();
    folder.run(&args).says(1, &["time runs backwards"]);
}
