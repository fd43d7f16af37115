//! Text formats of recorders, all with the same record.

use crate::util::{COMPENSATE, Folder, column};

/// Twelve hundred samples at 10 kHz in the caller's format.
fn rows(row: impl Fn(f64, f64) -> String) -> String {
    (0..1200)
        .map(|i| {
            let t = f64::from(i) * 1e-4;
            row(t, 1e-3 * (377.0 * t).cos())
        })
        .collect()
}

fn comma(text: &str) -> String {
    text.replace('.', ",")
}

/// Compensates a file and compares with the plain one.
fn same(name: &str, content: impl AsRef<[u8]>, more: &[&str]) {
    let folder = Folder::new();
    folder.write(
        "plain.csv",
        format!(
            "time_s,bridge_V\n{}",
            rows(|t, v| format!("{t:.4},{v:.9}\n"))
        ),
    );
    folder.write("other.txt", content);
    let plain = folder.run(&["compensate", "plain.csv", "--stand", "stand.toml", "-q"]);
    assert_eq!(plain.code, 0, "{}", plain.stderr);
    let args = [
        &["compensate", "other.txt", "--stand", "stand.toml", "-q"][..],
        more,
    ]
    .concat();
    let other = folder.run(&args);
    assert_eq!(other.code, 0, "{name}: {}", other.stderr);
    for heading in ["time_s", "compensated_torque_n_m"] {
        let (a, b) = (
            column(&plain.stdout, heading),
            column(&other.stdout, heading),
        );
        assert_eq!(a.len(), b.len(), "{name}");
        for (x, y) in a.iter().zip(&b) {
            assert!((x - y).abs() < 1e-9, "{name}: {heading} {x} {y}");
        }
    }
}

#[test]
fn separators_and_decimal_marks() {
    same(
        "tabs",
        format!(
            "time_s\tbridge_V\n{}",
            rows(|t, v| format!("{t:.4}\t{v:.9}\n"))
        ),
        &[],
    );
    same(
        "semicolons",
        format!(
            "time_s;bridge_V\n{}",
            rows(|t, v| format!("{t:.4};{v:.9}\n"))
        ),
        &[],
    );
    same(
        "decimal comma",
        format!(
            "Zeit [s];Bruecke [V]\n{}",
            rows(|t, v| comma(&format!("{t:.4};{v:.9}\n")))
        ),
        &[],
    );
    same(
        "tabs and decimal comma",
        format!(
            "time_s\tbridge_V\n{}",
            rows(|t, v| comma(&format!("{t:.4}\t{v:.9}\n")))
        ),
        &[],
    );
    same(
        "spaces",
        format!(
            "time_s bridge_V\n{}",
            rows(|t, v| format!(" {t:8.4}  {v:12.9}\n"))
        ),
        &[],
    );
}

/// Whole numbers and remarks beside the only column of decimal commas: with decimal points, it would be text as well.
#[test]
fn decimal_commas_in_one_column_are_read_beside_whole_numbers_and_remarks() {
    for mark in [";", "\t"] {
        let row = |t: f64, v: f64| {
            let cells = [
                format!("{:.0}", 1e4 * t),
                format!("{:.0}", 1e6 * t),
                "5".to_owned(),
                comma(&format!("{v:.9}")),
                "ok".to_owned(),
            ];
            cells.join(mark) + "\n"
        };
        let headings = ["Nr", "Zeit [us]", "Soll [V]", "Ist [V]", "Status"].join(mark);
        let text = format!("{headings}\n{}", rows(row));
        same("one comma", &text, &["--channel", "Ist"]);
        let folder = Folder::new();
        folder.write("in.csv", text);
        folder
            .run(&COMPENSATE)
            .says(1, &["2 channels", "\"Soll\" or \"Ist\""]);
    }
}

#[test]
fn line_ends_marks_and_remarks() {
    let plain = rows(|t, v| format!("{t:.4},{v:.9}\n"));
    same("BOM", format!("\u{feff}time_s,bridge_V\n{plain}"), &[]);
    same(
        "CR LF",
        format!("time_s,bridge_V\n{plain}").replace('\n', "\r\n"),
        &[],
    );
    same(
        "trailing separators",
        format!("time_s,bridge_V,\n{}", plain.replace('\n', ",\n")),
        &[],
    );
    same(
        "quotes",
        format!(
            "\"time_s\",\"bridge_V\"\n{}",
            rows(|t, v| format!("\"{t:.4}\",\"{v:.9}\"\n"))
        ),
        &[],
    );
    same(
        "comments",
        format!(
            "# stand 3\n# run 7\ntime_s,bridge_V\n{}",
            plain.replace("0.0500,", "# pause\n\n0.0500,")
        ),
        &[],
    );
    same(
        "preamble",
        format!("Recorder 7\nRate;10 kHz\nOperator: nobody, alone\n\ntime_s,bridge_V\n{plain}"),
        &[],
    );
    same("units row", format!("time,bridge\ns,V\n{plain}"), &[]);
    same(
        "units in brackets",
        format!("Time (s),Bridge [V]\n{plain}"),
        &[],
    );
    same(
        "padding",
        format!(
            "time_s,bridge_V\n{}",
            rows(|t, v| format!("  {t:.4} ,   {v:.9} \r\n"))
        ),
        &[],
    );
}

#[test]
fn other_units_columns_and_time_axes() {
    same(
        "ms and mV",
        format!(
            "t (ms);U / mV\n{}",
            rows(|t, v| format!("{:.1};{:.6}\n", t * 1e3, v * 1e3))
        ),
        &[],
    );
    same(
        "days",
        format!(
            "Time [d],bridge_V\n{}",
            rows(|t, v| format!("{:.16},{v:.9}\n", t / 86_400.0))
        ),
        &[],
    );
    same(
        "more columns",
        format!(
            "speed_rpm,bridge_V,note,time_s\n{}",
            rows(|t, v| format!("1100,{v:.9},ok,{t:.4}\n")).replace("ok", "0")
        ),
        &["--channel", "bridge"],
    );
    same(
        "no time",
        format!("bridge_V\n{}", rows(|_, v| format!("{v:.9}\n"))),
        &["--rate", "10 kHz"],
    );
    same(
        "no headings",
        rows(|t, v| format!("{t:.4},{v:.9}\n")),
        &["--time-column", "1", "--time-unit", "s", "--unit", "V"],
    );
    same(
        "wrong stamps",
        format!("time_s,bridge_V\n{}", rows(|_, v| format!("7,{v:.9}\n"))),
        &["--rate", "10000"],
    );
    same(
        "column by number",
        format!("a,b,c\n{}", rows(|t, v| format!("1,{v:.9},{t:.4}\n"))),
        &[
            "--time-column",
            "c",
            "--time-unit",
            "s",
            "--channel",
            "2",
            "--unit",
            "V",
        ],
    );
}

/// Rows in reverse order are not a record of unknown rate.
#[test]
fn rows_in_reverse_order_are_to_be_sorted() {
    let folder = Folder::new();
    let upside_down: Vec<String> = rows(|t, v| format!("{t:.4},{v:.9}\n"))
        .lines()
        .rev()
        .map(str::to_owned)
        .collect();
    folder.write(
        "a.csv",
        format!("time_s,bridge_V\n{}\n", upside_down.join("\n")),
    );
    let says = "the time stamps fall from row to row; sort the rows by time";
    let inspected = folder.run(&["inspect", "a.csv", "--json"]);
    assert!(inspected.stdout.contains(says), "{}", inspected.stdout);
    let run = folder.run(&["compensate", "a.csv", "--stand", "stand.toml"]);
    run.says(1, &[says]);
}

#[test]
fn texts_beside_the_numbers() {
    same(
        "status",
        format!(
            "time_s,bridge_V,status\n{}",
            rows(|t, v| format!("{t:.4},{v:.9},OK\n"))
        ),
        &["--channel", "bridge"],
    );
    same(
        "more headings than cells",
        format!(
            "time_s;bridge_V;Comment\n{}",
            rows(|t, v| format!("{t:.4};{v:.9}\n"))
        ),
        &[],
    );
    same(
        "BOM and no headings",
        format!("\u{feff}{}", rows(|t, v| format!("{t:.4},{v:.9}\n"))),
        &["--time-column", "1", "--time-unit", "s", "--unit", "V"],
    );
    same(
        "quoted decimal commas",
        format!(
            "\"time_s\",\"bridge_V\"\n{}",
            rows(|t, v| format!(
                "\"{}\",\"{}\"\n",
                comma(&format!("{t:.4}")),
                comma(&format!("{v:.9}"))
            ))
        ),
        &[],
    );
}

/// 1.040 N mm between 789 and 1.012 is a thousand and forty; 1.040 between 0.789 and 1.012 is not.
#[test]
fn a_point_that_may_stand_between_thousands_is_asked_for() {
    let folder = Folder::new();
    let table = |row: &dyn Fn(i32) -> String| {
        let rows: String = (0..400).map(|i| format!("{i};{}\n", row(i))).collect();
        format!("Zeit [ms];Moment [N mm]\n{rows}")
    };
    let torque = |i: i32| 1000 + 3 * (i % 200) - 300;
    let in_thousands = |i: i32| match torque(i) {
        small @ ..1000 => small.to_string(),
        large => format!("{}.{:03}", large / 1000, large % 1000),
    };
    folder.write("thousands.csv", table(&in_thousands));
    let ran = folder.run(&["inspect", "thousands.csv"]);
    ran.says(
        1,
        &[
            "line 102",
            "between thousands",
            "--decimal , or --decimal .",
        ],
    );
    let mean = |arguments: &[&str]| {
        let document = folder.json(&[&["inspect", "--json"], arguments].concat());
        document["channels"][0]["mean"].as_f64().unwrap()
    };
    let expected = f64::from((0..400).map(torque).sum::<i32>()) / 400.0;
    let read = mean(&["thousands.csv", "--decimal", ","]);
    assert!((read - expected).abs() < 1e-9, "{read}");
    folder.write(
        "points.csv",
        table(&|i| format!("{:.3}", f64::from(torque(i)) / 1e3)),
    );
    folder.write(
        "shortest.csv",
        table(&|i| format!("{}", f64::from(torque(i)) / 1e3)),
    );
    for name in ["points.csv", "shortest.csv"] {
        let read = mean(&[name]);
        assert!((read - expected / 1e3).abs() < 1e-9, "{name}: {read}");
    }
}

/// 4,026 mV next to 1.500 1/min: one of the two marks is a thousands separator.
#[test]
fn commas_and_points_that_both_read_both_ways_are_asked_for() {
    let folder = Folder::new();
    let rows = |speed: &str| -> String {
        let row = |i: i32| format!("{i};4,{:03};{speed}\n", 26 + i % 200);
        (0..400).map(row).collect()
    };
    let table = |speed: &str| format!("Zeit [ms];Spannung [mV];n [1/min]\n{}", rows(speed));
    folder.write("both.csv", table("1.500"));
    let ran = folder.run(&["inspect", "both.csv"]);
    ran.says(1, &["line 2", "the comma in", "between thousands"]);
    folder.write("comma.csv", table("1.500,5"));
    let document = folder.json(&["inspect", "--json", "comma.csv"]);
    let smallest = |k: usize| document["channels"][k]["smallest"].as_f64();
    assert_eq!([smallest(0), smallest(1)], [Some(4.026), Some(1500.5)]);
}

/// Stamps with a decimal comma beside values with a decimal point had been a thousand times too large.
#[test]
fn other_marks_in_some_columns_are_asked_about() {
    let folder = Folder::new();
    let rows = |value: fn(i32) -> String| -> String {
        let row = |i: i32| format!("0,{i:03};{}\n", value(i));
        (0..400).map(row).collect()
    };
    type Cell = fn(i32) -> String;
    let cases: [(Cell, Option<f64>); 4] = [
        (|i| format!("{}.{:03}", 7 + i % 6, 271 + i), None),
        // Nine hundred is too small for a separator, and millions have two.
        (
            |i| {
                if i == 0 {
                    "900".to_owned()
                } else {
                    format!("1.{:03}", 271 + i)
                }
            },
            Some(1670.0),
        ),
        (|i| format!("1.{:03}.250", 271 + i), Some(1_670_250.0)),
        (|i| format!("7.{:03},5", 271 + i), Some(7670.5)),
    ];
    for (value, largest) in cases {
        folder.write("in.csv", format!("Zeit [s];M [N m]\n{}", rows(value)));
        let Some(largest) = largest else {
            let says = ["line 2", "7.271", "--decimal ,", "same decimal mark"];
            folder.run(&["inspect", "in.csv"]).says(1, &says);
            let decided = folder.json(&["inspect", "in.csv", "--json", "--decimal", ","]);
            assert_eq!(decided["channels"][0]["largest"], 12_666.0);
            continue;
        };
        let report = folder.json(&["inspect", "in.csv", "--json"]);
        assert_eq!(report["channels"][0]["largest"], largest);
    }
}

#[test]
fn a_comma_that_could_be_either_is_asked_for() {
    let folder = Folder::new();
    folder.write("in.csv", rows(|_, v| comma(&format!("{:.6}\n", v + 1.0))));
    let ran = folder.run(&[
        "compensate",
        "in.csv",
        "--stand",
        "stand.toml",
        "--rate",
        "10000",
        "--unit",
        "V",
    ]);
    ran.says(1, &["--delimiter ,", "--decimal ,"]);
    let args = [
        "compensate",
        "in.csv",
        "--stand",
        "stand.toml",
        "--rate",
        "10000",
        "--unit",
        "V",
        "--decimal",
        ",",
    ];
    assert_eq!(folder.run(&args).code, 0);
}

#[test]
fn a_number_means_the_same_channel_in_every_verb() {
    let folder = Folder::new();
    let mut text = String::from("time_s,load_n_m,answer_n_m\n");
    for i in 0..300 {
        let t = f64::from(i) * 1e-4;
        text += &format!("{t:.4},{:.6},{:.6}\n", (400.0 * t).sin(), (700.0 * t).cos());
    }
    folder.write("record.csv", &text);
    let report = folder.json(&["inspect", "record.csv", "--json"]);
    assert_eq!(report["channels"][1]["name"], "answer");
    let extracted = |channel| {
        let ran = folder.run(&["extract", "record.csv", "--channel", channel]);
        ran.says(0, &[]).stdout.clone()
    };
    assert_eq!(extracted("2"), extracted("answer_n_m"));
    let simulated = |channel| {
        let args = [
            "simulate",
            "record.csv",
            "--stand",
            "stand.toml",
            "--applied",
        ];
        let ran = folder.run(&[&args[..], &[channel]].concat());
        ran.says(0, &[]).stdout.clone()
    };
    assert_eq!(simulated("2"), simulated("answer_n_m"));
}

/// Transposed tables, as in some exports: a question in a few lines, whatever the command.
#[test]
fn a_table_on_its_side_is_asked_about() {
    let folder = Folder::new();
    let row = |name: &str, value: &dyn Fn(usize) -> f64| {
        let cells: Vec<String> = (0..5000).map(|i| format!("{:.6}", value(i))).collect();
        format!("{name},{}\n", cells.join(","))
    };
    let time = row("time_s", &|i| i as f64 * 1e-4);
    let torque = row("torque [N m]", &|i| (i as f64 * 0.01).sin());
    folder.write("side.csv", format!("{time}{torque}"));
    let bare = |text: &str| text.split_once(',').unwrap().1.to_owned();
    folder.write("bare.csv", bare(&time) + &bare(&torque));
    for name in ["side.csv", "bare.csv"] {
        for args in [
            &["inspect", name][..],
            &["extract", name],
            &["compensate", name, "--stand", "stand.toml"],
            &["identify", "decay", name],
        ] {
            let ran = folder.run(args);
            ran.says(1, &["columns", "transpose"]);
            assert!(
                ran.stdout.is_empty() && ran.stderr.len() < 1000,
                "{args:?}: {}",
                ran.stderr.len()
            );
        }
    }
    // Many channels are not suspicious with enough rows.
    let head: Vec<String> = (0..400).map(|i| format!("c{i} [V]")).collect();
    let rows: String = (0..60)
        .map(|r| format!("{},{}\n", r as f64 * 0.001, vec!["1.5"; 400].join(",")))
        .collect();
    folder.write("many.csv", format!("time_s,{}\n{rows}", head.join(",")));
    let report = folder.json(&["inspect", "many.csv", "--json"]);
    assert_eq!(report["channels"].as_array().unwrap().len(), 400);
    folder
        .run(&["extract", "many.csv", "--channel", "x"])
        .says(1, &["and 380 more"]);
}

/// Rows longer than the part examined of a usual table: every command reads the requested column.
#[test]
fn tables_with_very_many_columns_are_read() {
    const COLUMNS: usize = 40_000;
    let folder = Folder::new();
    let names: String = (0..COLUMNS).map(|c| format!(",c{c}_V")).collect();
    let cell = |row: usize, column: usize| ((7 * row + 13 * column) % 1000) as f64 / 1000.0;
    let rows: String = (0..64)
        .map(|row| {
            let cells: String = (0..COLUMNS)
                .map(|column| format!(",{:.3}", cell(row, column)))
                .collect();
            format!("{:.3}{cells}\n", row as f64 * 1e-3)
        })
        .collect();
    folder.write("wide.csv", format!("time_s{names}\n{rows}"));
    let ran = folder.run(&[
        "extract",
        "wide.csv",
        "--channel",
        "c31234",
        "-o",
        "one.csv",
    ]);
    ran.says(0, &["1000 Hz from the uniform stamps"]);
    let found = column(&folder.read("one.csv"), "c31234 [V]");
    let want: Vec<f64> = (0..64).map(|row| cell(row, 31_234)).collect();
    assert_eq!(found, want);
    let stand = ["--stand", "stand.toml", "--band", "100", "-o", "out.csv"];
    let of = ["compensate", "wide.csv", "--channel", "c31234"];
    let ran = folder.run(&[&of[..], &stand].concat());
    ran.says(0, &["64 samples at 1000 Hz"]);
    let asked = folder.run(&["inspect", "wide.csv"]);
    asked.says(1, &["64 rows and 40000 columns", "transpose"]);
}

/// 6 N m with 1 N m at 10 Hz around it, at 1 kHz.
fn torque(i: usize) -> f64 {
    6.0 + (std::f64::consts::TAU * 0.01 * i as f64).sin()
}

/// Two exports in one file, the second in other units under the same name of the time: not rows of one
/// table.
#[test]
fn headings_in_other_units_among_the_rows_begin_another_table() {
    let folder = Folder::new();
    let rows = |range: std::ops::Range<usize>, scale: f64| -> String {
        let row = |i: usize| format!("{:.3},{:.4}\n", 1e-3 * i as f64, scale * torque(i));
        range.map(row).collect()
    };
    // Within the first rows that are examined, and after them.
    for (count, said) in [
        (2000, "of segment 2"),
        (20_000, "line 20002: another table"),
    ] {
        let (first, second) = (rows(0..count, 1.0), rows(count..2 * count, 1e3));
        for heading in ["time_s,torque (mNm)", "\"time_s\",\"torque (mNm)\""] {
            folder.write(
                "in.csv",
                format!("time_s,torque (Nm)\n{first}{heading}\n{second}"),
            );
            let ran = folder.run(&[&COMPENSATE[..], &["--force"]].concat());
            ran.says(1, &[said]);
        }
    }
    // Another text line among the rows is reported.
    folder.write(
        "in.csv",
        format!(
            "time_s,torque (Nm)\n{}operator: lab\n{}",
            rows(0..5000, 1.0),
            rows(5000..9000, 1.0)
        ),
    );
    let ran = folder.run(&[&COMPENSATE[..], &["--force"]].concat());
    ran.says(0, &["lines-skipped", "operator: lab"]);
}

/// A clock of whole seconds with a column of milliseconds, at a rate at which the first rows are within one
/// second.
#[test]
fn milliseconds_beside_a_clock_of_seconds_are_their_parts() {
    let folder = Folder::new();
    let row = |i: usize| {
        let (s, ms) = (40 + i / 5000, (i % 5000) as f64 / 5.0);
        format!(
            "{},2024-03-12 13:26:{s:02},{ms:.1},{:.4}\n",
            i + 1,
            torque(i)
        )
    };
    let rows: String = (0..12_000).map(row).collect();
    folder.write(
        "in.csv",
        format!("Number,Date&Time,ms,CH1\nNO.,Time,ms,N m\n{rows}"),
    );
    folder
        .run(&COMPENSATE)
        .says(0, &["12000 samples at 5000 Hz"]);
    // At the rate of a PLC they restart so rarely that they seem to rise.
    let row = |i: usize| format!("10:11:{:02},{},{:.4}\n", 12 + i / 1000, i % 1000, torque(i));
    let rows: String = (0..3000).map(row).collect();
    folder.write("in.csv", format!("Time,ms,Torque [Nm]\n{rows}"));
    folder
        .run(&[&COMPENSATE[..], &["--force"]].concat())
        .says(0, &["3000 samples at 1000 Hz"]);
    // Microseconds as well, but not milliseconds since the start, which are the time alone.
    for (heading, first) in [("us", 0.0), ("Elapsed [ms]", 0.0), ("Time (ms)", 0.2)] {
        let part = |i: usize| match heading {
            "us" => format!("{}", i % 5000 * 200),
            _ => format!("{:.1}", first + 0.2 * i as f64),
        };
        let row = |i: usize| {
            let (s, part) = (12 + i / 5000, part(i));
            format!("2024/03/12 10:11:{s},{part},{:.4}\n", torque(i))
        };
        let rows: String = (0..12_000).map(row).collect();
        folder.write("in.csv", format!("Date&Time,{heading},Torque [Nm]\n{rows}"));
        folder
            .run(&[&COMPENSATE[..], &["--force"]].concat())
            .says(0, &["12000 samples at 5000 Hz"]);
    }
}

/// One row per value, whose signal another column names or numbers, in turn or by chance.
#[test]
fn rows_of_several_signals_are_refused() {
    let folder = Folder::new();
    let rows = |name: &dyn Fn(usize) -> &'static str| -> String {
        let row = |i: usize| format!("{:.4},{},{:.4}\n", 1e-3 * i as f64, name(i), torque(i));
        (0..1000).map(row).collect()
    };
    let in_turn = rows(&|i| ["torque", "speed"][i % 2]);
    let by_chance = rows(&|i| ["torque", "speed", "temperature"][i * i % 7 % 3]);
    let numbers = rows(&|i| ["1", "2"][i % 2]);
    for (heading, rows, is_refused) in [
        ("Signal", &in_turn, true),
        ("Signal", &by_chance, true),
        ("ID", &numbers, true),
        ("Speed [rpm]", &numbers, false),
        ("State", &rows(&|i| ["on", "off"][i / 100 % 2]), false),
    ] {
        folder.write("in.csv", format!("Time [s],{heading},Torque [Nm]\n{rows}"));
        let ran = folder.run(&[&COMPENSATE[..], &["--force", "--channel", "Torque"]].concat());
        match is_refused {
            true => ran.says(
                1,
                &["variables in turn", "keep only the rows of one variable"],
            ),
            false => ran.says(0, &["1000 samples at 1000 Hz"]),
        };
    }
}

/// Channels without times below each other are not one channel, nor does --fill make them one.
#[test]
fn a_heading_among_the_values_of_one_channel_begins_another() {
    let folder = Folder::new();
    let values: String = (0..6000).map(|i| format!("{:.4}\n", torque(i))).collect();
    folder.write(
        "in.csv",
        format!("# Sample rate: 1000 Hz\nM (Nm)\n{values}\nn (V)\n{values}"),
    );
    for more in [&[][..], &["--fill", "linear"]] {
        let ran = folder.run(&[&COMPENSATE[..], more].concat());
        assert_eq!(ran.code, 1, "{}", ran.stderr);
    }
}

/// A factor above whole numbers may be theirs; numbers with decimals were scaled, and 1 changes nothing.
#[test]
fn a_factor_above_whole_numbers_is_said() {
    let folder = Folder::new();
    let rows = |decimals: usize| -> String {
        let row = |i: usize| format!("{:.4};{:.decimals$}\n", 1e-3 * i as f64, 100.0 * torque(i));
        (0..3000).map(row).collect()
    };
    for (factor, decimals, is_said) in [
        ("ScaleFactor;1;0.01", 0, true),
        ("Skalierung;1;0.01", 0, true),
        ("ScaleFactor;1;1", 0, false),
        ("ScaleFactor;1;0.01", 3, false),
        ("Vertical Scale;1;0.01", 0, false),
    ] {
        let rows = rows(decimals);
        folder.write(
            "in.csv",
            format!("Channel;Time;Torque\nUnit;s;Nm\n{factor}\n\n{rows}"),
        );
        let report = folder.json(&["inspect", "in.csv", "--json"]);
        let codes = crate::util::codes(&report);
        assert_eq!(
            codes.contains(&"scale-in-heading"),
            is_said,
            "{factor}: {codes:?}"
        );
    }
}

/// Headings of words between spaces: the unit in brackets belongs to the word before it, and more words than columns name
/// none of them, instead of the wrong ones.
#[test]
fn words_above_columns_between_spaces_name_their_own() {
    let folder = Folder::new();
    let rows: String = (0..200)
        .map(|i| {
            format!(
                "{:.3} {} {} {}\n",
                f64::from(i) * 1e-3,
                100 + i % 7,
                5 + i % 3,
                1500
            )
        })
        .collect();
    let mean = |headings: &str, channel: &str, more: &[&str]| {
        folder.write("in.txt", format!("{headings}\n{rows}"));
        let args = [
            "extract",
            "in.txt",
            "--channel",
            channel,
            "-o",
            "out.csv",
            "--force",
        ];
        let ran = folder.run(&[&args[..], more].concat());
        let written = folder.read("out.csv");
        let last = written
            .lines()
            .next()
            .and_then(|line| line.split(',').nth(1).map(str::to_owned));
        let heading = last.unwrap_or_default();
        let values = column(&written, &heading);
        (
            ran,
            heading,
            values.iter().sum::<f64>() / values.len() as f64,
        )
    };
    for headings in [
        "Time [s] Force [N] Torque [N m] Speed [rpm]",
        "# Time (s) Force (N) Torque (N m) Speed (rpm)",
        "time_s Force[N] Torque [N m] Speed [rpm]",
    ] {
        let (ran, heading, mean) = mean(headings, "Torque", &[]);
        ran.says(0, &["1000 Hz"]);
        assert_eq!(heading, "Torque [N m]", "{headings}");
        assert!((mean - 6.0).abs() < 0.01, "{headings}: {mean}");
    }
    let (ran, heading, mean) = mean(
        "Time Motor Torque Input Speed",
        "3",
        &["--time-column", "1", "--time-unit", "s"],
    );
    ran.says(
        0,
        &[
            "unassigned-headings",
            "line 1 has more words than the 4 columns",
        ],
    );
    assert!(heading.contains("column 4"), "{heading}");
    assert!((mean - 1500.0).abs() < 0.01, "{mean}");
    // A unit of time that contradicts the heading is said, as for a channel.
    folder.write(
        "in.txt",
        format!("time_s,a_V,b_V,c_V\n{}", rows.replace(' ', ",")),
    );
    let args = ["extract", "in.txt", "--channel", "a", "--time-unit", "ms"];
    folder
        .run(&args)
        .says(0, &["unit-overrides-heading", "--time-unit says ms"]);
    // Stamps that nearly coincide, as of arrivals, make no values beyond the record's.
    let rows: String = (0..400)
        .map(|i| {
            let late = [0.0, 0.0, 0.0, 0.49, -0.49, 0.0, 0.0][i % 7];
            format!(
                "{:.6},{:.6}\n",
                1e-3 * (i as f64 + late),
                (0.9 * i as f64).sin()
            )
        })
        .collect();
    folder.write("in.txt", format!("time_s,a_V\n{rows}"));
    let args = [
        "extract",
        "in.txt",
        "--channel",
        "a",
        "--resample",
        "-o",
        "out.csv",
        "--force",
    ];
    folder.run(&args).says(
        0,
        &["resampled-uneven", "give --rate HZ instead of --resample"],
    );
    let largest = column(&folder.read("out.csv"), "a [V]")
        .iter()
        .fold(0.0_f64, |m, v| m.max(v.abs()));
    assert!(largest < 1.5, "{largest}");
}

/// The common factor of a matrix displayed by MATLAB multiplies every column.
#[test]
fn a_displayed_matrix_with_a_common_factor_is_refused() {
    let rows = rows(|t, v| format!("    {:.6}    {v:.6}\n", 1e-3 * t));
    for (factor, is_refused) in [
        ("\n    1.0e+03 *\n\n", true),
        ("y =\n\n   1.0e-03  *\n", true),
        ("\n    1.0e+00 *\n", false),
        ("\n", false),
    ] {
        let folder = Folder::new();
        folder.write("in.csv", format!("{factor}{rows}"));
        let more = ["--channel", "2", "--unit", "V", "--rate", "10000"];
        let ran = folder.run(&[&COMPENSATE[..], &more].concat());
        match is_refused {
            true => ran.says(1, &["common factor", "writematrix"]),
            false => ran.says(0, &[]),
        };
    }
}

/// Logs that are no tables: the message names what they are and how to convert them.
#[test]
fn logs_that_are_no_tables_are_named() {
    let lines = rows(|t, v| format!("{{\"ts\":{t:.4},\"torque\":{v:.6}}}\n"));
    let array = rows(|t, v| format!("{{\"ts\":{t:.4},\"torque\":{v:.6}}},\n"));
    let labels = rows(|t, v| format!("t:{t:.4},torque:{v:.6}\n"));
    for (text, said) in [
        (
            lines,
            &["one object in each line", "jq -r '[", ".\"torque\""][..],
        ),
        (format!("[\n{array}{{}}]\n"), &["JSON", "jq -r '.[] | ["]),
        (labels, &["label and value", "sed"]),
    ] {
        let folder = Folder::new();
        folder.write("in.csv", text);
        let ran = folder.run(&["inspect", "in.csv"]);
        assert!(!ran.stderr.contains("--delimiter"), "{}", ran.stderr);
        ran.says(1, said);
    }
}
