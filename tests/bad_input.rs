//! Bad input causes an error that names the place and the remedy, and leaves no files behind.

use crate::util::{COMPENSATE, Folder, HARMONICS, Ran, record, steady};

/// A small good record.
fn good() -> String {
    record(&steady(&[(1.0, 60.0, 0.0)], 20_000.0, 3000).0, 20_000.0)
}

/// Compensates `in.csv` with extra arguments; only the inputs may remain.
fn refused(content: &[u8], more: &[&str], code: i32, parts: &[&str]) -> Ran {
    let folder = Folder::new();
    folder.write("in.csv", content);
    let ran = folder.run(&[&COMPENSATE[..], more].concat());
    ran.says(code, parts);
    assert_eq!(folder.names(), ["in.csv", "stand.toml"], "{content:?}");
    ran
}

#[test]
fn files_that_are_no_records() {
    refused(b"", &[], 1, &["in.csv", "empty"]);
    refused(b"\n\n\n", &[], 1, &["empty"]);
    refused(
        b"hello\nworld\nand more\n",
        &[],
        1,
        &["no table of numbers", "hello"],
    );
    refused(b"\x89MCAP0\r\n\x01\x02", &[], 1, &["no topic"]);
    refused(b"PK\x03\x04abc", &[], 1, &["spreadsheet", "CSV"]);
    refused(b"\x1F\x8Babc", &[], 1, &["gzip", "gunzip"]);
    refused(b"\x00\x01\x02\x03\n", &[], 1, &["binary"]);
    refused(b"time_s,bridge_V\n0,1\n", &[], 1, &["rate", "--rate"]);
    let folder = Folder::new();
    let missing = folder.run(&["compensate", "none.csv", "--stand", "stand.toml"]);
    missing.says(1, &["none.csv", "cannot be read", "check the path"]);
    folder
        .run(&["compensate", ".", "--stand", "stand.toml"])
        .says(1, &["folder"]);
}

#[test]
fn columns() {
    let two = good()
        .replace("bridge_V\n", "bridge_V,load_N\n")
        .replace("e-4\n", "e-4,1\n");
    let two: String = two
        .lines()
        .map(|line| {
            if line.split(',').count() == 2 {
                format!("{line},1\n")
            } else {
                format!("{line}\n")
            }
        })
        .collect();
    refused(
        two.as_bytes(),
        &[],
        1,
        &["could be the signal", "--channel \"bridge\" or \"load\""],
    );
    refused(
        two.as_bytes(),
        &["--channel", "brigde"],
        1,
        &[
            "no channel \"brigde\"",
            "did you mean \"bridge\"",
            "\"load\"",
        ],
    );
    refused(
        two.as_bytes(),
        &["--channel", "load"],
        1,
        &["force", "radius", "lever_arm"],
    );
    refused(
        good().as_bytes(),
        &["--time-column", "tiem"],
        1,
        &["tiem", "did you mean \"time\""],
    );
}

#[test]
fn units() {
    let unknown = good().replace("bridge_V", "bridge");
    refused(
        unknown.as_bytes(),
        &[],
        1,
        &["\"bridge\" has no unit", "--unit V", "--unit \"N m\""],
    );
    refused(
        good().as_bytes(),
        &["--unit", "Vlt"],
        2,
        &["--unit Vlt", "unknown unit"],
    );
    refused(
        good().as_bytes(),
        &["--unit", "kg"],
        1,
        &["\"kg\"", "cannot be converted to torque"],
    );
    let no_time_unit = good().replace("time_s", "time");
    refused(
        no_time_unit.as_bytes(),
        &[],
        1,
        &["\"time\" gives no unit", "--time-unit"],
    );
    refused(
        no_time_unit.as_bytes(),
        &["--time-unit", "V"],
        2,
        &["not a unit of time"],
    );
    let no_headings: String = good().lines().skip(1).map(|l| format!("{l}\n")).collect();
    refused(no_headings.as_bytes(), &[], 1, &["no heading", "--rate"]);
}

#[test]
fn cells() {
    let with = |line: usize, text: &str| -> Vec<u8> {
        good()
            .lines()
            .enumerate()
            .map(|(i, l)| format!("{}\n", if i + 1 == line { text } else { l }))
            .collect::<String>()
            .into_bytes()
    };
    refused(
        &with(1500, "0.0749,nan"),
        &[],
        1,
        &[
            "line 1500",
            "column 2 (\"bridge_V\")",
            "\"nan\"",
            "not a finite number",
        ],
    );
    refused(
        &with(1500, "0.0749,1.#INF"),
        &[],
        1,
        &["line 1500", "1.#INF"],
    );
    refused(&with(2, "0,-inf"), &[], 1, &["line 2", "-inf"]);
    let clipped = [
        "line 1500",
        "\"\u{221e}\"",
        "exceeds its range",
        "larger range",
    ];
    refused(&with(1500, "0.0749,\u{221e}"), &[], 1, &clipped);
    refused(
        &with(1500, "0.0749,12x3"),
        &[],
        1,
        &["line 1500", "\"12x3\"", "expected a number"],
    );
    refused(
        &with(1500, "0.0749,"),
        &[],
        1,
        &["line 1500", "column 2", "empty"],
    );
    refused(
        &with(1500, "0.0749"),
        &[],
        1,
        &["line 1500", "too few cells"],
    );
    refused(
        &with(1500, "zero,1"),
        &[],
        1,
        &["line 1500", "column 1 (\"time_s\")", "zero"],
    );
    refused(&with(1500, "0.0749;0.5"), &[], 1, &["line 1500"]);
}

#[test]
fn bad_rows_near_the_start_are_errors_and_not_passed_over() {
    let rows: Vec<String> = good().lines().map(str::to_owned).collect();
    for line in [2, 3, 4, 21, 2001] {
        for (cell, says) in [
            ("0.0,abc", "abc"),
            ("0.0", "too few cells"),
            ("0.0,", "empty"),
        ] {
            let text: String = rows
                .iter()
                .enumerate()
                .map(|(i, row)| format!("{}\n", if i + 1 == line { cell } else { row }))
                .collect();
            refused(text.as_bytes(), &[], 1, &[&format!("line {line}"), says]);
        }
    }
}

#[test]
fn missing_samples_are_not_skipped_without_stamps() {
    let rows = |odd: &str| -> Vec<u8> {
        (0..100_000)
            .map(|i| {
                if i == 70_000 {
                    format!("{odd}\n")
                } else {
                    format!("{i},0.5\n")
                }
            })
            .collect::<String>()
            .into_bytes()
    };
    let args = ["--rate", "1000", "--channel", "2", "--unit", "V"];
    refused(&rows(","), &args, 1, &["line 70001", "empty"]);
    refused(&rows(""), &args, 1, &["line 70001", "empty"]);
    // Neither a remark nor an empty line at the end is a lost sample.
    let folder = Folder::new();
    folder.write("in.csv", [rows("# pause"), b"\n\n".to_vec()].concat());
    let ran = folder.run(
        &[
            &["compensate", "in.csv", "--stand", "stand.toml", "-q"][..],
            &args,
        ]
        .concat(),
    );
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert_eq!(ran.stdout.lines().count(), 100_000);
}

#[test]
fn bytes_that_are_no_utf_8_do_no_harm() {
    let mut text = b"note,time_s,bridge_V\n".to_vec();
    for i in 0..3000 {
        let note: &[u8] = if i % 7 == 3 { b"\"\xB0\xB0\xB0\"" } else { b"" };
        text.extend_from_slice(note);
        text.extend_from_slice(format!(",{:.3},{}\n", f64::from(i) * 1e-3, i % 2).as_bytes());
    }
    let folder = Folder::new();
    folder.write("in.csv", text);
    let ran = folder.run(&[
        "compensate",
        "in.csv",
        "--stand",
        "stand.toml",
        "--channel",
        "bridge",
        "-q",
    ]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let times = crate::util::column(&ran.stdout, "time_s");
    assert!(
        times
            .iter()
            .enumerate()
            .all(|(i, t)| (t - 1e-3 * i as f64).abs() < 1e-9)
    );
}

#[test]
fn time() {
    let step = |from: usize, shift: f64| -> Vec<u8> {
        let mut text = "time_s,bridge_V\n".to_owned();
        for i in 0..3000 {
            let t = i as f64 * 5e-5 + if i >= from { shift } else { 0.0 };
            text.push_str(&format!("{t:.7},0.5\n"));
        }
        text.into_bytes()
    };
    refused(
        &step(2000, 1e-4),
        &[],
        1,
        &["line 2002", "not uniform", "3 times", "--fill linear"],
    );
    refused(
        &step(2000, -0.05),
        &[],
        1,
        &["line 2002", "backwards", "split the file"],
    );
    refused(
        &step(2000, -0.05),
        &["--resample"],
        1,
        &["line 2002", "backwards"],
    );
    refused(&step(2000, -5e-5), &[], 1, &["line 2002", "repeats"]);
    refused(&step(5, 1e-4), &[], 1, &["line 7", "not uniform"]);
    // 2 % of a step is rejected, half a per cent is not.
    refused(&step(2000, 1e-6), &[], 1, &["line 2002", "1.02 times"]);
    // A gap that --fill would refuse.
    let too_long = ["too long to fill", "--range"];
    refused(&step(2000, 2.0), &[], 1, &too_long);
    let folder = Folder::new();
    folder.write("in.csv", step(2000, 2.5e-7));
    let ran = folder.run(&["compensate", "in.csv", "--stand", "stand.toml", "-q"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
}

#[test]
fn a_break_is_found_in_any_piece_of_a_long_file() {
    // Far beyond the first piece, with any number of threads.
    let mut text = "time_s,bridge_V\n".to_owned();
    for i in 0..200_000 {
        let t = f64::from(i) * 5e-5 + if i >= 150_000 { 1.0 } else { 0.0 };
        text.push_str(&format!("{t:.6},0.5\n"));
        if i == 160_000 {
            text.push_str("8.9,broken\n");
        }
    }
    for threads in ["1", "2", "5"] {
        refused(
            text.as_bytes(),
            &["--threads", threads],
            1,
            &["line 150002", "not uniform"],
        );
    }
}

#[test]
fn bands_that_the_rate_does_not_carry() {
    refused(
        good().as_bytes(),
        &["--band", "9800"],
        1,
        &["20000 Hz", "below 10000 Hz", "at most 9600 Hz"],
    );
    refused(
        good().as_bytes(),
        &["--band", "0"],
        2,
        &["greater than zero"],
    );
    refused(good().as_bytes(), &["--band", "2.4 V"], 2, &["--band"]);
    for option in ["--band", "--rate"] {
        let args = [option, "4.9e-324"];
        refused(good().as_bytes(), &args, 2, &["between 1e-12 and 1e15 Hz"]);
    }
}

#[test]
fn stand_files() {
    let with = |from: &str, to: &str, parts: &[&str]| {
        let folder = Folder::new();
        folder.write("in.csv", good());
        folder.write("stand.toml", crate::util::HERTEL.replace(from, to));
        let ran = folder.run(&COMPENSATE);
        ran.says(1, parts);
        assert_eq!(folder.names(), ["in.csv", "stand.toml"]);
    };
    with(
        "damping",
        "dampnig",
        &["stand.toml, line 4", "dampnig", "did you mean \"damping\""],
    );
    with(
        "[calibration]\n",
        "[calibration]\nsensitivty = 3\n",
        &["line 7", "unknown key", "torque_per_volt"],
    );
    with(
        "\"8.1e4 ft lbf/rad\"",
        "8.1e4",
        &["line 5", "no unit", "N m/rad"],
    );
    with(
        "\"8.1e4",
        "\"-8.1e4",
        &["line 5", "stiffness", "greater than zero"],
    );
    with(
        "\"8.1e4 ft lbf/rad\"",
        "\"8.1e4 ft lbf\"",
        &["line 5", "dimension"],
    );
    with(
        "[calibration]\n",
        "[[effects]]\nkind = \"cubic-stiffness\"\ncoefficient = \"0.3 1/V^2\"\n[calibration]\n",
        &["powers of N m, the unit of the torque", "0.01 1/(N m)^2"],
    );
    with("[mechanics]", "[mechanics", &["line 2"]);
    with(
        "torque_per_volt = \"1.23e3 ft lbf/V\"\n",
        "",
        &["write one of torque_per_volt"],
    );
    let folder = Folder::new();
    folder.write("in.csv", good());
    folder.write("stand.toml", "schema = \"torqcomp.stand/1\"\n");
    folder
        .run(&["compensate", "in.csv", "--stand", "stand.toml"])
        .says(1, &["[mechanics]"]);
    folder
        .run(&["compensate", "in.csv", "--stand", "nix.toml"])
        .says(1, &["nix.toml", "cannot be read"]);
}

#[test]
fn wrong_usage_ends_with_2() {
    let folder = Folder::new();
    for args in [
        &["compensate"][..],
        &["compensate", "in.csv"],
        &["compensat", "in.csv"],
        &["compensate", "in.csv", "--stand", "stand.toml", "--json"],
        &["harmonics", "in.csv", "--stand", "stand.toml"],
        &[&HARMONICS[..], &["60", "--orders", "5-1"]].concat(),
        &[
            "table",
            "--stand",
            "stand.toml",
            "--from",
            "100",
            "--to",
            "10",
        ],
        &["table", "--stand", "stand.toml", "--step", "1e-9"],
    ] {
        let ran = folder.run(args);
        assert_eq!(ran.code, 2, "{args:?}: {}", ran.stderr);
        assert!(!ran.stderr.is_empty());
        match args.contains(&"--json") {
            true => assert!(ran.stdout.contains("\"torqcomp.error/1\""), "{args:?}"),
            false => assert!(ran.stdout.is_empty(), "{args:?}"),
        }
    }
    let negative = "compensate in.csv --stand stand.toml --band -5".split(' ');
    let ran = folder.run(&negative.collect::<Vec<_>>());
    ran.says(2, &["'-5'", "expected a frequency in Hz"]);
    for (args, said) in [
        (["--band", "1k"], "write \"1 kHz\""),
        (["--rate", "10K"], "write \"10 kHz\""),
        (["--fs", "5000"], "'--rate'"),
        (["--sample-rate", "5000"], "'--rate'"),
    ] {
        let ran = folder.run(&[&COMPENSATE[..], &args].concat());
        ran.says(2, &[said]);
    }
}

#[test]
fn a_record_cut_in_its_last_line_is_used_up_to_there() {
    let whole = good();
    let folder = Folder::new();
    for keep in ["0.1499", "0.1499,", "0.14995,-1.2e-", "0.14995,-"] {
        let end = whole.rfind("0.14995,").unwrap();
        folder.write("in.csv", format!("{}{keep}", &whole[..end]));
        let ran = folder.run(&[&COMPENSATE[..], &["--force"]].concat());
        ran.says(3, &["truncated-last-line", "line 3001", "skipped"]);
        assert_eq!(folder.read("out.csv").lines().count(), 3000);
    }
    // The same with the time as the last column and the cut within it.
    let swapped: String = (0..3000)
        .map(|i| format!("0.5,{:.5}\n", f64::from(i) * 5e-5))
        .collect();
    folder.write(
        "in.csv",
        format!("bridge_V,time_s\n{}", &swapped[..swapped.len() - 4]),
    );
    let args = [
        "compensate",
        "in.csv",
        "--stand",
        "stand.toml",
        "-o",
        "out.csv",
        "--force",
    ];
    folder
        .run(&args)
        .says(3, &["truncated-last-line", "line 3001"]);
    // A last line that only lacks its line feed is used with a warning: its last number may be
    // truncated.
    folder.write("in.csv", whole.trim_end());
    let ran = folder.run(&[
        "compensate",
        "in.csv",
        "--stand",
        "stand.toml",
        "-o",
        "out.csv",
        "--force",
    ]);
    ran.says(3, &["unended-last-line", "line 3001"]);
    assert_eq!(folder.read("out.csv").lines().count(), 3001);
}

#[test]
fn a_table_over_frequency_is_no_record() {
    let folder = Folder::new();
    for heading in [
        "Frequency (Hz),Magnitude (dB),Phase (deg)",
        "freq,Re,Im",
        "frequency_hz,magnitude,phase_deg",
    ] {
        let rows = (1..200).map(|k| format!("{},{},{}\n", 5 * k, 0.01 * f64::from(k), -k));
        folder.write("in.csv", format!("{heading}\n{}", rows.collect::<String>()));
        let more = ["--channel", "2", "--unit", "N m"];
        let said = ["looks like a frequency response", "identify response"];
        folder
            .run(&[&COMPENSATE[..], &more].concat())
            .says(1, &said);
        let report = folder.json(&["inspect", "in.csv", "--json"]).to_string();
        assert!(report.contains(said[0]), "{heading}: {report}");
    }
}
