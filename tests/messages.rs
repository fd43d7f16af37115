//! Commands that need whole records, with signals of an MCAP file.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::io::Cursor;

use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};

use crate::util::{Folder, codes, column, sampled, table};

/// Time of the first message.
const BEGIN_NS: u64 = 1_700_000_000_000_000_000;
const RATE_HZ: f64 = 1000.0;
const SAMPLES: usize = 4000;

/// A stand without units: 40 Hz, 5 % damping.
const STAND: &str = r#"schema = "torqcomp.stand/1"
[mechanics]
natural_frequency = "40 Hz"
damping_ratio = 0.05
static_gain = "1 V/V"
"#;

/// Topics with their messages: log time and JSON.
type Topics<'a> = [(&'a str, Vec<(u64, String)>)];

/// A file of JSON messages.
fn file(topics: &Topics) -> Vec<u8> {
    let options = WriteOptions::new().compression(None);
    let mut writer: Writer<Cursor<Vec<u8>>> = options.create(Cursor::new(Vec::new())).unwrap();
    for (topic, messages) in topics {
        let channel_id = writer
            .add_channel(0, topic, "json", &BTreeMap::new())
            .unwrap();
        for (log_time, text) in messages {
            let header = MessageHeader {
                channel_id,
                sequence: 0,
                log_time: *log_time,
                publish_time: *log_time,
            };
            writer
                .write_to_known_channel(&header, text.as_bytes())
                .unwrap();
        }
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// A sweep that excites the stand.
fn applied(time_s: f64) -> f64 {
    (TAU * (5.0 * time_s + 9.0 * time_s * time_s)).sin()
}

fn stamp(i: usize) -> u64 {
    BEGIN_NS + (i as u64) * 1_000_000
}

/// The folder with the stand, the applied signal as a table, and the stand's response to it.
fn folder() -> (Folder, Vec<f64>) {
    let folder = Folder::new();
    folder.write("modal.toml", STAND);
    let wave = |i| applied(i as f64 / RATE_HZ);
    folder.write("in.csv", sampled("applied_V", RATE_HZ, SAMPLES, wave));
    let ran = folder.run(&[
        "simulate",
        "in.csv",
        "--stand",
        "modal.toml",
        "--applied",
        "applied",
    ]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let answer = column(&ran.stdout, "measured");
    (folder, answer)
}

/// Both signals in messages of one topic.
fn one_topic(answer: &[f64]) -> Vec<u8> {
    let message = |(i, y): (usize, &f64)| {
        let u = applied(i as f64 / RATE_HZ);
        (
            stamp(i),
            format!("{{\"in\":{{\"u\":{u:e}}},\"y\":[{y:e},0]}}"),
        )
    };
    file(&[("/stand", answer.iter().enumerate().map(message).collect())])
}

#[test]
fn simulate_takes_a_signal() {
    let (folder, answer) = folder();
    folder.write("in.mcap", one_topic(&answer));
    let ran = folder.run(&[
        "simulate",
        "in.mcap",
        "--stand",
        "modal.toml",
        "--applied",
        "/stand.in.u",
        "--unit",
        "V",
    ]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let (_, rows) = table(&ran.stdout);
    assert_eq!(rows.len(), SAMPLES);
    for (row, want) in rows.iter().zip(&answer) {
        assert!((row[1] - want).abs() < 1e-9, "{row:?} {want}");
    }
    // An f64 represents times since 1970 to a quarter of a microsecond.
    assert!(rows[0][0] > 1e9 && (rows[1][0] - rows[0][0] - 1e-3).abs() < 1e-6);
    folder
        .run(&[
            "simulate",
            "in.mcap",
            "--stand",
            "modal.toml",
            "--applied",
            "/stand.in.v",
        ])
        .says(1, &["in.u"]);
    folder
        .run(&[
            "simulate",
            "in.mcap",
            "--stand",
            "modal.toml",
            "--applied",
            "/stnd.in.u",
        ])
        .says(1, &["did you mean \"/stand\""]);
    folder
        .run(&[
            "simulate",
            "in.mcap",
            "--stand",
            "modal.toml",
            "--applied",
            "/stand.in.u",
            "--time-column",
            "t",
        ])
        .says(2, &["--time-column does not apply"]);
}

#[test]
fn response_and_decay_take_signals() {
    let (folder, answer) = folder();
    folder.write("in.mcap", one_topic(&answer));
    let found = folder.json(&[
        "identify",
        "response",
        "in.mcap",
        "--applied",
        "/stand.in.u",
        "--measured",
        "/stand.y[0]",
        "--modes",
        "1",
        "--json",
    ]);
    let parameters = found["parameters"].as_array().unwrap();
    let value = |name: &str| {
        let found = parameters.iter().find(|p| p["name"] == name);
        found.unwrap_or_else(|| panic!("{name} in {parameters:?}"))["value"]
            .as_f64()
            .unwrap()
    };
    assert!(
        (value("natural_frequency") - 40.0).abs() < 0.2,
        "{parameters:?}"
    );
    let ringing = |i: usize| {
        let t = i as f64 / RATE_HZ;
        (-TAU * 40.0 * 0.02 * t).exp() * (TAU * 40.0 * t).cos()
    };
    let messages = (0..1500).map(|i| (stamp(i), format!("{{\"y\":{:e}}}", ringing(i))));
    folder.write("decay.mcap", file(&[("/y", messages.collect())]));
    let found = folder.json(&["identify", "decay", "decay.mcap", "--json"]);
    let text = found["parameters"].to_string();
    assert!(
        text.contains("natural_frequency") && text.contains("damping_ratio"),
        "{text}"
    );
}

#[test]
fn diagnose_brings_topics_with_other_stamps_together_and_says_so() {
    let (folder, answer) = folder();
    let u = (0..SAMPLES).map(|i| {
        (
            stamp(i),
            format!("{{\"v\":{:e}}}", applied(i as f64 / RATE_HZ)),
        )
    });
    // The response has arrival stamps: up to a fifth of a step late.
    let late = |i: usize| (i as u64 * 7919) % 200_000;
    let between = |i: usize, late_ns: u64| {
        let next = answer.get(i + 1).copied().unwrap_or(answer[i]);
        answer[i] + (next - answer[i]) * late_ns as f64 * 1e-6
    };
    let y = (0..SAMPLES).map(|i| {
        (
            stamp(i) + late(i),
            format!("{{\"v\":{:e}}}", between(i, late(i))),
        )
    });
    folder.write(
        "two.mcap",
        file(&[("/u", u.collect()), ("/y", y.collect())]),
    );
    let found = folder.json(&[
        "diagnose",
        "--train",
        "two.mcap",
        "--applied",
        "/u.v",
        "--measured",
        "/y.v",
        "--applied-unit",
        "V",
        "--measured-unit",
        "V",
        "--json",
    ]);
    assert_eq!(found["schema"], "torqcomp.diagnose/1");
    let codes: Vec<&str> = found["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|w| w["code"].as_str())
        .collect();
    assert!(codes.contains(&"resampled"), "{codes:?}");
    let slow = (0..500).map(|i| (stamp(8 * i), "{\"v\":0.5}".to_owned()));
    let fast = (0..SAMPLES).map(|i| (stamp(i), format!("{{\"v\":{}}}", i % 7)));
    folder.write(
        "rates.mcap",
        file(&[("/u", fast.collect()), ("/y", slow.collect())]),
    );
    folder
        .run(&[
            "diagnose",
            "--train",
            "rates.mcap",
            "--applied",
            "/u.v",
            "--measured",
            "/y.v",
        ])
        .says(1, &["\"/y.v\" is sampled at 125 Hz", "one time axis"]);
}

#[test]
fn a_file_that_is_cut_off_is_used_and_the_loss_is_said() {
    let (folder, answer) = folder();
    let mut bytes = one_topic(&answer);
    bytes.truncate(bytes.len() * 2 / 3);
    folder.write("cut.mcap", bytes);
    let args = [
        "simulate",
        "cut.mcap",
        "--stand",
        "modal.toml",
        "--applied",
        "/stand.in.u",
        "--unit",
        "V",
    ];
    let ran = folder.run(&args);
    ran.says(3, &["warning ["]);
    let (_, rows) = table(&ran.stdout);
    assert!(rows.len() > SAMPLES / 3 && rows.len() < SAMPLES);
}

/// A folder with messages of a number at these milliseconds.
fn logged(at_ms: impl Iterator<Item = usize>, value: impl Fn(usize) -> f64) -> Folder {
    let folder = Folder::new();
    let message = |i: usize| (stamp(i), format!("{{\"y\":{:e}}}", value(i)));
    folder.write("in.mcap", file(&[("/y", at_ms.map(message).collect())]));
    folder
}

/// A signal at a time in milliseconds.
fn slow(i: usize) -> f64 {
    2.0 + (TAU * 0.04 * i as f64).sin()
}

#[test]
fn regular_losses_and_copies_are_named() {
    let twice = (0..600).flat_map(|i| vec![i; if i % 10 == 0 { 2 } else { 1 }]);
    let cases: [(Folder, &str); 3] = [
        (
            logged((0..600).filter(|i| i % 10 > 0), slow),
            "at 1000 Hz if one row in 10 is missing",
        ),
        (
            logged((0..600).filter(|i| i % 3 > 0), slow),
            "at 1000 Hz if one row in 3 is missing",
        ),
        (
            logged(twice, slow),
            "at 1000 Hz if one row in 10 was written twice",
        ),
    ];
    for (folder, said) in cases {
        folder
            .run(&["extract", "in.mcap", "--topic", "/y", "--field", "y"])
            .says(0, &[said]);
        let rate = [
            "extract",
            "in.mcap",
            "--topic",
            "/y",
            "--field",
            "y",
            "--resample",
            "--rate",
            "1000",
        ];
        folder.run(&rate).says(0, &["1000 Hz", "interpolated"]);
        let report = folder.json(&["inspect", "in.mcap", "--json"]);
        assert!(report["warnings"].to_string().contains(said), "{report}");
        assert!(!codes(&report).contains(&"time-gaps"), "{report}");
    }
}

#[test]
fn two_nodes_on_one_topic_are_two_signals() {
    let folder = logged(0..600, |i| slow(i) + if i % 2 == 0 { 0.0 } else { 4.0 });
    let report = folder.json(&["inspect", "in.mcap", "--json"]);
    assert!(codes(&report).contains(&"two-signals"), "{report}");
}

#[test]
fn stamps_that_start_again_are_refused() {
    let folder = Folder::new();
    let message = |i: usize| {
        let (sec, nanosec) = (1 + i % 300 / 200, i % 300 % 200 * 5_000_000);
        let text = format!(
            "{{\"stamp\":{{\"sec\":{sec},\"nanosec\":{nanosec}}},\"y\":{:e}}}",
            slow(i)
        );
        (stamp(5 * i), text)
    };
    folder.write("in.mcap", file(&[("/y", (0..600).map(message).collect())]));
    let run = |more: &[&str]| {
        folder.run(
            &[
                &["extract", "in.mcap", "--topic", "/y", "--field", "y"],
                more,
            ]
            .concat(),
        )
    };
    run(&[]).says(
        1,
        &[
            "starts again, after 2495000000 ns at 1000000000 ns",
            "--time log",
        ],
    );
    run(&["--time", "log"]).says(0, &[]);
}
