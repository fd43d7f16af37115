//! Cells other than plain numbers: other minus signs, words and numbers for missing values.

use crate::util::{COMPENSATE, Folder, assert_close, column};

/// Two thousand samples of 6 N m with 2 N m at 10 Hz around it, at 1 kHz.
fn torque(i: usize) -> f64 {
    6.0 + 2.0 * (std::f64::consts::TAU * 0.01 * i as f64).sin()
}

fn table(cell: impl Fn(usize) -> String) -> String {
    let rows: String = (0..2000)
        .map(|i| format!("{:.3},{}\n", 1e-3 * i as f64, cell(i)))
        .collect();
    format!("Time [s],Torque [Nm]\n{rows}")
}

fn plain(i: usize) -> String {
    format!("{:.6}", torque(i))
}

#[test]
fn a_typeset_minus_is_a_minus() {
    let folder = Folder::new();
    let below = |minus: &'static str| {
        let time = move |i: usize| format!("{:.3}", 1e-3 * (i as f64 - 500.0));
        let rows: String = (0..2000)
            .map(|i| format!("{},{:.6}\n", time(i), torque(i) - 6.5).replace('-', minus))
            .collect();
        format!("Time [s],Torque [Nm]\n{rows}")
    };
    let mut results = Vec::new();
    for minus in ["-", "\u{2212}", "\u{2013}"] {
        folder.write("in.csv", below(minus));
        folder
            .run(&[&COMPENSATE[..], &["--force"]].concat())
            .says(0, &["2000 samples at 1000 Hz", "from -0.5 s"]);
        let out = folder.read("out.csv");
        results.push((
            column(&out, "time_s"),
            column(&out, "compensated_torque_n_m"),
        ));
    }
    assert_eq!(results[0].0.len(), 2000);
    assert!(results.iter().all(|result| *result == results[0]));
}

#[test]
fn stamps_with_exponents_of_fortran_are_written_as_numbers() {
    let folder = Folder::new();
    let rows = |mark: &str| -> String {
        let row = |i: usize| format!("{:.6e},{}\n", 1e-3 * i as f64, plain(i)).replace('e', mark);
        (0..2000).map(row).collect()
    };
    let mut times = Vec::new();
    for mark in ["e", "D", "d"] {
        folder.write("in.csv", format!("Time [s],Torque [Nm]\n{}", rows(mark)));
        folder
            .run(&[&COMPENSATE[..], &["--force"]].concat())
            .says(0, &["2000 samples at 1000 Hz"]);
        times.push(column(&folder.read("out.csv"), "time_s"));
    }
    for found in &times[1..] {
        let apart = |(a, b): (&f64, &f64)| (a - b).abs();
        assert!(found.iter().zip(&times[0]).map(apart).all(|d| d < 1e-9));
    }
}

#[test]
fn words_for_missing_values_neither_begin_nor_end_a_table() {
    let folder = Folder::new();
    for word in ["OL", "OVLD", "----", "Overload", "#N/A", "sensor lost"] {
        for lost in [300..900, 0..150, 1900..1990] {
            let content = table(|i| {
                if lost.contains(&i) {
                    word.to_owned()
                } else {
                    plain(i)
                }
            });
            folder.write("in.csv", content);
            let what = format!("{word} {lost:?}");
            let report = folder.json(&["inspect", "in.csv", "--json"]);
            let channel = &report["channels"][0];
            assert_eq!(
                (channel["name"].as_str(), channel["samples"].as_u64()),
                (Some("Torque"), Some(2000)),
                "{what}"
            );
            assert_eq!(
                channel["non_finite"].as_u64(),
                Some(lost.len() as u64),
                "{what}: {channel}"
            );
            let refused = folder.run(&[&COMPENSATE[..], &["--force"]].concat());
            refused.says(
                1,
                &[&format!("line {}", lost.start + 2), word, "--fill linear"],
            );
        }
        // Every second sample around the peaks is lost; filled in, all are there.
        let content = table(|i| {
            if torque(i) > 7.0 && i % 2 == 1 {
                word.to_owned()
            } else {
                plain(i)
            }
        });
        folder.write("in.csv", content);
        let filled = folder.run(&[&COMPENSATE[..], &["--force", "--fill", "linear"]].concat());
        filled.says(0, &["2000 samples at 1000 Hz"]);
    }
}

#[test]
fn numbers_that_mark_missing_values_are_none() {
    let folder = Folder::new();
    for mark in ["9.91E+37", "9.9E+37", "-9.900000e+37"] {
        folder.write(
            "in.csv",
            table(|i| if i == 700 { mark.to_owned() } else { plain(i) }),
        );
        let report = folder.run(&["inspect", "in.csv"]);
        assert!(
            report
                .stdout
                .replace("\n      ", " ")
                .contains("instruments write for no value or over range"),
            "{}",
            report.stdout
        );
        let report = folder.json(&["inspect", "in.csv", "--json"]);
        assert_close(
            report["channels"][0]["largest"].as_f64().unwrap(),
            8.0,
            1e-6,
        );
        folder
            .run(&[&COMPENSATE[..], &["--force"]].concat())
            .says(1, &["line 702", mark, "over range"]);
        let run = folder.run(&[&COMPENSATE[..], &["--force", "--fill", "linear"]].concat());
        run.says(0, &["[filled]", "no value or over range"]);
        let out = column(&folder.read("out.csv"), "compensated_torque_n_m");
        assert!(out.iter().all(|torque| torque.abs() < 10.0));
    }
}

#[test]
fn decimal_commas_between_commas_are_asked_about() {
    let folder = Folder::new();
    let comma = |text: String| text.replace('.', ",");
    let rows = |decimals: usize| -> String {
        (0..2000)
            .map(|i| {
                comma(format!("{:.3}_{:.decimals$}\n", 1e-3 * i as f64, torque(i)))
                    .replace('_', ",")
            })
            .collect()
    };
    let asks = [
        "0,000,6,00",
        "2 numbers with decimal commas",
        "decimal points",
        "semicolons",
    ];
    for heading in ["Zeit [s],Moment [Nm]\n", ""] {
        folder.write("in.csv", format!("{heading}{}", rows(6)));
        for more in [
            &[][..],
            &["--channel", "3", "--rate", "1000", "--unit", "N m"],
        ] {
            folder.run(&[&COMPENSATE[..], more].concat()).says(1, &asks);
        }
    }
    // One column decides between two readings.
    let single: String = (0..2000)
        .map(|i| comma(format!("{:.5}\n", torque(i))))
        .collect();
    folder.write("single.csv", format!("M1\nNm\n{single}"));
    let inspect = ["inspect", "single.csv"];
    folder
        .run(&inspect)
        .says(1, &["--decimal ,", "--delimiter ,"]);
    folder
        .run(&[&inspect[..], &["--decimal", ","]].concat())
        .says(0, &[]);
    // Integers under as many headings are integers.
    let counts: String = (0..2000)
        .map(|i| format!("{i},{},{},{}\n", i % 7, i % 10, i % 100))
        .collect();
    folder.write("counts.csv", format!("n,a,b,c\n{counts}"));
    assert_eq!(folder.run(&["inspect", "counts.csv"]).code, 0);
}

#[test]
fn the_heading_of_a_single_column_may_have_spaces() {
    let folder = Folder::new();
    let rows: String = (0..2000).map(|i| plain(i) + "\n").collect();
    for (heading, name) in [
        ("T [Nm]", "T"),
        ("Motor torque (N m)", "Motor torque"),
        ("# Drehmoment Nm", "Drehmoment"),
    ] {
        folder.write("in.csv", format!("{heading}\n{rows}"));
        let run = folder.run(&[&COMPENSATE[..], &["--force", "--rate", "1000"]].concat());
        run.says(0, &[&format!("{name} in N"), "2000 samples"]);
    }
    // A setting above a column is not one of its headings.
    folder.write("in.csv", format!("Sampling rate 1000 Hz\n{rows}"));
    let report = folder.json(&["inspect", "in.csv", "--json"]);
    assert_eq!(report["channels"][0]["name"], "column 1");
}

/// Each cell of the channel with its unit, that of the time as well, with changing units, or next to another channel:
/// never a torque.
#[test]
fn cells_with_units_are_refused_with_their_place() {
    let folder = Folder::new();
    folder.write("in.csv", table(|i| format!("{} N m", plain(i))));
    let remedy = "put that in the heading: \"Torque [N m]\"";
    folder
        .run(&COMPENSATE)
        .says(1, &["line 2", "column 2", "6.000000 N m", remedy]);
    folder.write("in.csv", table(|i| format!("{:.3} mN m", 1e3 * torque(i))));
    folder.run(&COMPENSATE).says(1, &["line 2", "column 2"]);
    folder.write("in.csv", table(|i| format!("{} N m,{i}.5", plain(i))));
    folder
        .run(&COMPENSATE)
        .says(1, &["line 2", "6.000000 N m", "--channel"]);
    let rows: String = (0..2000)
        .map(|i| format!("{i} ms,{} N m\n", plain(i)))
        .collect();
    folder.write("in.csv", format!("Time,Torque\n{rows}"));
    folder
        .run(&COMPENSATE)
        .says(1, &["0 ms,6.000000 N m", "units beside its numbers"]);
    // One cell among plain ones.
    let cell = |i: usize| match i {
        1500 => "6000 mN m".to_owned(),
        _ => plain(i),
    };
    folder.write("in.csv", table(cell));
    folder.run(&COMPENSATE).says(1, &["line 1502", "6000 mN m"]);
}

/// A channel whose first cells are texts, beside a setpoint that is the only other column: never a torque of that.
#[test]
fn a_channel_with_texts_in_most_of_its_first_cells_is_asked_about() {
    let of = |cell: &dyn Fn(usize) -> String, heading: &str| {
        let rows: String = (0..2000).map(|i| format!("{i},5,{}\n", cell(i))).collect();
        format!("time_ms,set [N m],{heading}\n{rows}")
    };
    let not_ready = |i: usize| if i < 1200 { "ERR".to_owned() } else { plain(i) };
    let status = |i: usize| format!("{} OK", plain(i));
    let quoted = |i: usize| format!("'{}", plain(i));
    let folder = Folder::new();
    for (cell, heading, shown) in [
        (
            &not_ready as &dyn Fn(usize) -> String,
            "act [N m]",
            "\"ERR\"",
        ),
        (&status, "act [N m]", "\"6.000000 OK\""),
        (&quoted, "act [N m]", "\"'6.000000\""),
        (&status, "act", "\"6.000000 OK\""),
        (&quoted, "act", "\"'6.000000\""),
    ] {
        folder.write("in.csv", of(cell, heading));
        folder.run(&COMPENSATE).says(
            1,
            &[
                "line 2",
                "column 3",
                shown,
                "or choose \"set\" with --channel",
            ],
        );
        let wanted = [&COMPENSATE[..], &["--channel", "act"]].concat();
        folder.run(&wanted).says(1, &["no channel \"act\"", shown]);
        let chosen = [&COMPENSATE[..], &["--channel", "set", "--force"]].concat();
        folder.run(&chosen).says(0, &["texts-in-channel"]);
        let inspected = folder.run(&["inspect", "in.csv"]);
        assert!(inspected.stdout.contains("texts-in-channel"));
    }
    // Words for missing numbers are none of these texts, and remarks are no channel.
    let missing = |i: usize| match i {
        0..1200 => "#NV".to_owned(),
        _ => plain(i),
    };
    folder.write("in.csv", of(&missing, "act [N m]"));
    let wanted = [&COMPENSATE[..], &["--channel", "act"]].concat();
    folder
        .run(&wanted)
        .says(1, &["line 2", "not a finite number", "--fill"]);
    folder.write("in.csv", of(&|i| format!("part {}", i / 100), "remark"));
    let run = folder.run(&[&COMPENSATE[..], &["--force"]].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(!run.stderr.contains("texts-in-channel"), "{}", run.stderr);
}

/// `ros2 topic echo --csv` writes no headings: seconds and nanoseconds of the stamp, the frame, and the fields of the
/// message.
#[test]
fn rows_of_ros2_topic_echo_have_the_time_of_their_stamps() {
    let folder = Folder::new();
    let row = |i: usize| {
        let ns = 1_710_250_000_000_000_000_u64 + 1_000_000 * i as u64;
        let (s, ns) = (ns / 1_000_000_000, ns % 1_000_000_000);
        format!("{s},{ns},base_link,motor,brake,{i}.5,0.0,{}\n", plain(i))
    };
    folder.write("in.csv", (0..2000).map(row).collect::<String>());
    let channel = ["--channel", "column 8", "--unit", "N m"];
    folder
        .run(&[&COMPENSATE[..], &channel].concat())
        .says(0, &["2000 samples at 1000 Hz", "2024-03-12T13:26:40"]);
    folder.run(&COMPENSATE).says(1, &["--channel", "column 8"]);
}
