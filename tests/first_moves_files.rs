//! Lab files with their own headings, headers and columns, as new users bring them.

use serde_json::Value;

use crate::util::{COMPENSATE, Folder, assert_close};

/// A stand that accepts torque and volts.
const STAND: &str = "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"60 Hz\"\ndamping_ratio = 0.02\n";

fn torque(row: usize) -> f64 {
    (row as f64 / 50.0).sin()
}

/// A file with a header, and rows of some cells before the torque.
fn file(head: &str, cells: impl Fn(usize) -> String) -> String {
    let rows = (0..3000).map(|row| format!("{},{:.5}\n", cells(row), torque(row)));
    format!("{head}\n{}", rows.collect::<String>())
}

fn channel_of(folder: &Folder, text: &str) -> Value {
    folder.write("in.csv", text);
    let report = folder.json(&["inspect", "in.csv", "--json"]);
    report["channels"][0].clone()
}

#[test]
fn units_behind_an_underscore_are_read() {
    let folder = Folder::new();
    folder.write("stand.toml", STAND);
    for (heading, rms) in [
        ("torque_N mm", 1e-3),
        ("torque_Nmm", 1e-3),
        ("torque_mNm", 1e-3),
        ("torque_ft-lbf", 1.355_817_948_331_4),
    ] {
        let head = format!("time_s,{heading}");
        folder.write(
            "in.csv",
            file(&head, |row| format!("{}", row as f64 / 1000.0)),
        );
        let report = folder.json(&[&COMPENSATE[..], &["--force", "--json"]].concat());
        let found = report["result"]["rms"].as_f64().expect("a number");
        assert_close(found, rms * 0.5_f64.sqrt(), 0.02);
    }
    for heading in ["torque_lbft", "mass_g", "force_lb"] {
        let head = format!("time_s,{heading}");
        folder.write(
            "in.csv",
            file(&head, |row| format!("{}", row as f64 / 1000.0)),
        );
        let run = folder.run(&[&COMPENSATE[..], &["--force"]].concat());
        run.says(1, &["with a force or with a mass"]);
    }
    // The answer to the question is not a contradiction.
    folder.write(
        "in.csv",
        file("time_s,torque_lbft", |row| {
            format!("{}", row as f64 / 1000.0)
        }),
    );
    for (unit, code) in [("ft lbf", 0), ("lbf ft", 0), ("N m", 3)] {
        let answer = ["--unit", unit, "--strict", "--force"];
        let run = folder.run(&[&COMPENSATE[..], &answer].concat());
        assert_eq!(run.code, code, "{unit}: {}", run.stderr);
    }
}

/// The two outputs of a carrier-frequency amplifier, which are named by their angle.
#[test]
fn a_channel_named_by_its_angle_is_read() {
    let folder = Folder::new();
    for head in [
        "Time (s),0° (mV/V)",
        "Time (s),0 deg (mV/V)",
        "Zeit,0°\ns,mV/V",
    ] {
        let channel = channel_of(
            &folder,
            &file(head, |row| format!("{}", row as f64 / 1000.0)),
        );
        assert!(
            channel["name"].as_str().is_some_and(|n| n.starts_with('0')),
            "{channel}"
        );
        assert_eq!(channel["unit"], "mV/V", "{head}");
    }
}

/// Units below the names of some columns, or beside the formats of date and time.
#[test]
fn units_beside_a_clock_are_read() {
    let folder = Folder::new();
    for units in [
        ",,V,1/min",
        ",,1/min,V",
        "TT.MM.JJJJ,hh:mm:ss,V,1/min",
        "yyyy-MM-dd,HH:mm:ss.fff,V,1/min",
        "s,,V,1/min",
    ] {
        let clock = |row: usize| {
            format!(
                "2024-02-01,10:00:{:06.3},{}",
                row as f64 / 100.0,
                torque(row)
            )
        };
        let rows = (0..3000).map(|row| format!("{},{}\n", clock(row), 1000 + row));
        let head = format!("Datum,Zeit,Spannung,Drehzahl\n{units}\n");
        folder.write("in.csv", format!("{head}{}", rows.collect::<String>()));
        let report = folder.json(&["inspect", "in.csv", "--json"]);
        let said = |place: usize, key: &str| report["channels"][place][key].clone();
        let found = [said(0, "name"), said(0, "unit"), said(1, "unit")];
        let want = match units.ends_with('V') {
            true => ["Spannung", "1/min", "V"],
            false => ["Spannung", "V", "1/min"],
        };
        assert_eq!(found, want.map(Value::from), "{units}");
    }
}

/// Torques in MN m are read as such, with a remark that names both readings.
#[test]
fn meganewton_metres_are_questioned() {
    let folder = Folder::new();
    folder.write("stand.toml", STAND);
    for (heading, answer, is_said) in [
        ("M [MNm]", None, true),
        ("T [MN m]", None, true),
        ("M [MNm]", Some("mN m"), false),
        ("M [MNm]", Some("MN m"), false),
        ("M [mNm]", None, false),
    ] {
        let head = format!("time_s,{heading}");
        folder.write(
            "in.csv",
            file(&head, |row| format!("{}", row as f64 / 1000.0)),
        );
        let answer = answer.map_or(Vec::new(), |unit| vec!["--unit", unit]);
        let run = folder.run(&[&COMPENSATE[..], &["--force"], &answer].concat());
        run.says(0, &[]);
        let said = run.stderr.contains("[meganewton-metres]") && run.stderr.contains("0.001 N m");
        assert_eq!(said, is_said, "{heading} {answer:?}: {}", run.stderr);
        assert!(!run.stderr.contains("unit-overrides"), "{}", run.stderr);
    }
}

#[test]
fn stamps_of_ros_are_exact_in_one_column_and_in_two() {
    let folder = Folder::new();
    folder.write("stand.toml", STAND);
    let first_ns = 1_700_000_000_900_000_001_u64;
    let stamp = |row: usize| first_ns + 1_000_000 * row as u64;
    for (sec, part, digits) in [
        ("sec", "nanosec", 1),
        ("header.stamp.sec", "header.stamp.nanosec", 1),
        ("secs", "nsecs", 1),
        (
            "/joint_states/header/stamp/sec",
            "/joint_states/header/stamp/nanosec",
            1,
        ),
        ("stamp_sec", "stamp_nsec", 1),
        ("sec", "usec", 1000),
    ] {
        let parts = |row: usize| {
            (
                stamp(row) / 1_000_000_000,
                stamp(row) % 1_000_000_000 / digits,
            )
        };
        let pair = |row: usize| format!("{},{}", parts(row).0, parts(row).1);
        let text = file(&format!("{sec},{part},T [N m]"), pair);
        let channel = channel_of(&folder, &text);
        assert_eq!(
            channel["start_ns"],
            first_ns / digits * digits,
            "{sec}: {channel}"
        );
        assert_close(channel["rate_hz"].as_f64().expect("a rate"), 1000.0, 1e-9);
        for more in [&[][..], &["--time-column", sec]] {
            let report = folder.json(&[&COMPENSATE[..], &["--force", "--json"], more].concat());
            assert_eq!(report["warnings"], Value::Array(Vec::new()), "{sec}");
            assert_eq!(
                report["start_ns"],
                first_ns / digits * digits,
                "{sec}: {report}"
            );
        }
    }
    for heading in ["stamp", "header.stamp", "field.header.stamp"] {
        let text = file(&format!("{heading},T [N m]"), |row| stamp(row).to_string());
        assert_eq!(
            channel_of(&folder, &text)["start_ns"],
            first_ns,
            "{heading}"
        );
    }
}

#[test]
fn dates_in_the_head_are_of_iso_8601_where_they_can_be_read_in_one_way() {
    let folder = Folder::new();
    for (head, want) in [
        ("Date,2025-03-14\nTime,10:11:12", "2025-03-14T10:11:12"),
        ("# Start: 14.03.2025 10:11:12.5", "2025-03-14T10:11:12.5"),
        (
            "# Start: 2025-03-14 10:11:12+01:00",
            "2025-03-14T10:11:12+01:00",
        ),
        (
            "Trigger Date,03/14/2025\nTrigger Time,10:11:12 PM",
            "2025-03-14T22:11:12",
        ),
        ("Recorded on,14 Mar 2025 10:11:12", "2025-03-14T10:11:12"),
        ("Date,03/04/2025\nTime,10:11:12", "03/04/2025 10:11:12"),
    ] {
        let text = file(&format!("{head}\ntime_s,T [N m]"), |row| {
            format!("{}", row as f64 / 1000.0)
        });
        assert_eq!(channel_of(&folder, &text)["start_time"], want, "{head}");
    }
}

/// Joints change places between rows, as written by nodes that list them from a map.
#[test]
fn an_item_of_a_list_is_followed_by_its_name() {
    let folder = Folder::new();
    folder.write("stand.toml", STAND);
    let rows = |moves: bool| {
        let row = |row: usize| {
            let (torque, other) = (torque(row), 40.0);
            let seconds = row as f64 / 1000.0;
            match moves && row % 3 == 1 {
                true => format!("{seconds},b,a,{other},{torque:.5}\n"),
                false => format!("{seconds},a,b,{torque:.5},{other}\n"),
            }
        };
        let head = "time_s,name[0],name[1],effort[0],effort[1]\n";
        format!("{head}{}", (0..3000).map(row).collect::<String>())
    };
    let result = |moves: bool| {
        folder.write("in.csv", rows(moves));
        let choice = ["--channel", "effort[0]", "--unit", "N m", "--force"];
        let run = folder.run(&[&COMPENSATE[..], &choice].concat());
        run.says(0, &[]);
        assert_eq!(run.stderr.contains("items-move"), moves, "{}", run.stderr);
        folder.read("out.csv")
    };
    assert_eq!(result(true), result(false));
    folder.write("in.csv", rows(true).replace("b,a", "b,c"));
    let choice = ["--channel", "effort[0]", "--unit", "N m", "--force"];
    folder
        .run(&[&COMPENSATE[..], &choice].concat())
        .says(1, &["line 3"]);
}

/// Advice for a WAV file that works.
#[test]
fn full_scale_is_what_a_wav_file_lacks() {
    let folder = Folder::new();
    folder.write(
        "stand.toml",
        format!("{STAND}[calibration]\ntorque_per_volt = \"2 N m/V\"\n"),
    );
    let samples: Vec<u8> = (0..2000)
        .flat_map(|row| ((1e4 * torque(row)) as i16).to_le_bytes())
        .collect();
    let mut wav = b"RIFF".to_vec();
    wav.extend((36 + samples.len() as u32).to_le_bytes());
    wav.extend(b"WAVEfmt \x10\0\0\0\x01\0\x01\0");
    wav.extend([1000_u32, 2000].iter().flat_map(|n| n.to_le_bytes()));
    wav.extend(b"\x02\0\x10\0data");
    wav.extend((samples.len() as u32).to_le_bytes());
    wav.extend(samples);
    folder.write("in.wav", wav);
    let args = [
        "compensate",
        "in.wav",
        "--stand",
        "stand.toml",
        "-o",
        "out.csv",
    ];
    folder.run(&args).says(1, &["--full-scale \"10 V\""]);
    folder
        .run(&[&args[..], &["--full-scale", "10 V"]].concat())
        .says(0, &[]);
}
