//! The stand's response is divided out only once: results of `compensate` are marked, rejected by `compensate`, and
//! used unchanged by `harmonics`.

use crate::noise::Noise;
use crate::util::{Folder, assert_close, record, steady};

/// 0.30 N m at 590 Hz, where the stand of the thesis amplifies 7 times.
const PARTS: [(f64, f64, f64); 2] = [(0.5, 0.0, 0.0), (0.30, 590.0, 0.4)];

/// Orders of 100 Hz in a record with noise: those above the band of the compensation are reported as filtered, and no
/// others.
#[test]
fn orders_above_the_band_of_a_compensated_record_are_said() {
    let parts: Vec<(f64, f64, f64)> = (1..=9).map(|n| (0.3, 100.0 * f64::from(n), 0.4)).collect();
    let (mut shown, _) = steady(&parts, 20_000.0, 40_000);
    let mut noise = Noise(7);
    shown.iter_mut().for_each(|v| *v += 0.01 * noise.normal());
    let folder = Folder::new();
    folder.write("in.csv", record(&shown, 20_000.0));
    for (band, said) in [
        (
            "300",
            Some("removes part or all of orders 4, 5, 6, 7, 8 and 9"),
        ),
        ("510", Some("removes part or all of orders 6, 7, 8 and 9")),
        ("560", Some("removes part or all of orders 6, 7, 8 and 9")),
        ("587", Some("removes part or all of orders 7, 8 and 9")),
        ("600", Some("removes part or all of orders 7, 8 and 9")),
        ("1000", None),
    ] {
        let compensate = ["compensate", "in.csv", "--stand", "stand.toml", "-q"];
        let torque = folder.run(&[&compensate[..], &["--band", band]].concat());
        let orders = ["harmonics", "-", "--fundamental", "100", "--orders", "1-9"];
        let ran = folder.pipe(&orders, torque.stdout.as_bytes());
        ran.says(0, said.as_slice());
        let is_said = ran.stderr.contains("orders-beyond-band");
        assert_eq!(is_said, said.is_some(), "{band}: {}", ran.stderr);
        // An odd number of samples within the record.
        let inside = [&orders[..], &["--range", "0.3..1.3"]].concat();
        let ran = folder.pipe(&inside, torque.stdout.as_bytes());
        ran.says(0, said.as_slice());
    }
}

const HARMONICS: [&str; 7] = [
    "--fundamental",
    "590",
    "--orders",
    "1",
    "--json",
    "--channel",
    "1",
];

fn folder() -> Folder {
    let folder = Folder::new();
    let (shown, _) = steady(&PARTS, 20_000.0, 20_000);
    folder.write("in.csv", record(&shown, 20_000.0));
    folder
}

#[test]
fn harmonics_of_a_compensated_record_are_the_torque_without_a_stand() {
    let folder = folder();
    let torque = folder.run(&["compensate", "in.csv", "--stand", "stand.toml", "-q"]);
    assert_eq!(torque.code, 0, "{}", torque.stderr);
    assert!(torque.stdout.starts_with("time_s,compensated_torque_n_m\n"));
    for stand in [&[][..], &["--stand", "stand.toml"]] {
        let args = [&["harmonics", "-"], &HARMONICS[..], stand].concat();
        let ran = folder.pipe(&args, torque.stdout.as_bytes());
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let report: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
        let first = &report["components"][0];
        let number = |key: &str| first[key].as_f64().unwrap();
        // The ends of the record depend on its extension: 34 ms of 1 s.
        assert_close(number("torque"), 0.30, 5e-3);
        assert_eq!(number("factor"), 1.0);
        assert_eq!(number("recorded"), number("torque"));
        assert_eq!(report["taken_as"], "compensated");
        assert!(report["stand"].is_null() && first["std_stand"].is_null());
    }
    // The same with the stand divided out here, with a text that says which was done.
    let direct = folder.run(&[
        "harmonics",
        "in.csv",
        "--stand",
        "stand.toml",
        "--fundamental",
        "590",
        "--orders",
        "1",
    ]);
    let said = "taken as recorded (the response of stand.toml is divided out)";
    assert!(direct.stdout.contains(said), "{}", direct.stdout);
    let args = [
        &["harmonics", "in.csv", "--stand", "stand.toml"],
        &HARMONICS[..],
    ]
    .concat();
    let report = folder.json(&args);
    assert_close(
        report["components"][0]["torque"].as_f64().unwrap(),
        0.30,
        1e-9,
    );
    assert_eq!(report["taken_as"], "recorded");
}

#[test]
fn a_compensated_record_is_not_compensated_again() {
    let folder = folder();
    for units in ["si", "us"] {
        let args = [
            "compensate",
            "in.csv",
            "--stand",
            "stand.toml",
            "--units",
            units,
            "--force",
            "-qo",
            "out.csv",
        ];
        assert_eq!(folder.run(&args).code, 0);
        let again = folder.run(&["compensate", "out.csv", "--stand", "stand.toml"]);
        again.says(
            1,
            &[
                "out.csv",
                "\"compensated_torque\" is marked as compensated",
                "rename it",
            ],
        );
        assert!(again.stdout.is_empty());
    }
    // Another column of the same file is independent.
    let both = [
        "compensate",
        "in.csv",
        "--stand",
        "stand.toml",
        "--with-recorded",
        "-qo",
        "both.csv",
    ];
    assert_eq!(folder.run(&both).code, 0);
    let of = |channel| {
        [
            "compensate",
            "both.csv",
            "--stand",
            "stand.toml",
            "--channel",
            channel,
        ]
    };
    assert_eq!(folder.run(&of("recorded_torque")).code, 0);
    folder
        .run(&of("compensated_torque"))
        .says(1, &["marked as compensated"]);
}

#[test]
fn a_recorded_channel_needs_the_stand() {
    let folder = folder();
    let ran = folder.run(&["harmonics", "in.csv", "--fundamental", "590"]);
    ran.says(2, &["\"bridge\" is taken as recorded", "--stand FILE"]);
}

/// No stand is identified or diagnosed from a torque without its response.
#[test]
fn a_compensated_record_is_no_answer_of_a_stand() {
    let folder = Folder::new();
    let row = |i: usize| {
        let wave = (i as f64 * 0.05).sin();
        format!("{},{wave},{wave}\n", i as f64 * 5e-5)
    };
    let rows: String = (0..20_000).map(row).collect();
    folder.write(
        "in.csv",
        format!("time_s,applied_n_m,compensated_torque_n_m\n{rows}"),
    );
    let pair = ["--applied", "applied", "--measured", "compensated_torque"];
    let runs: [&[&str]; 4] = [
        &["identify", "decay", "in.csv", "--channel", "compensated"],
        &[&["identify", "response", "in.csv"], &pair[..]].concat(),
        &[
            &["diagnose", "--stand", "stand.toml", "--train", "in.csv"],
            &pair[..],
        ]
        .concat(),
        &[
            "compensate",
            "in.csv",
            "--stand",
            "stand.toml",
            "--channel",
            "compensated",
        ],
    ];
    for args in runs {
        folder
            .run(args)
            .says(1, &["marked as compensated", "take the recorded channel"]);
    }
}
