//! Tables with several columns of time.

use std::f64::consts::TAU;

use crate::util::Folder;

/// Rows of four cells in any order: the time of a slow channel, that channel, and the time of a torque at 5 kHz, that torque.
fn rows(order: [usize; 4], slow_hz: f64, start: f64) -> String {
    let row = |i: usize| {
        let t = i as f64;
        let torque = 3.0 + (TAU * 20.0 * t / 5000.0).cos();
        let cells = [
            format!("{:.4}", t / slow_hz),
            format!("{:.1}", 1500.0 + (t / 9.0).sin()),
            format!("{:.4}", start + t / 5000.0),
            format!("{torque:.6}"),
        ];
        order.map(|place| cells[place].clone()).join(";") + "\n"
    };
    (0..4000).map(row).collect()
}

/// Number of channels that `inspect` finds below a heading.
fn count(folder: &Folder, heading: &str, rows: &str) -> usize {
    folder.write("in.csv", format!("{heading}\n{rows}"));
    let report = folder.json(&["inspect", "in.csv", "--json"]);
    report["channels"].as_array().unwrap().len()
}

/// Every verb reads the torque, the second channel, on its own clock.
fn check(folder: &Folder, heading: &str, rows: &str, start: f64) {
    assert_eq!(count(folder, heading, rows), 2, "{heading}");
    let report = folder.json(&["inspect", "in.csv", "--json"]);
    let found = |key: &str| report["channels"][1][key].as_f64().unwrap_or(0.0);
    let axis = (found("rate_hz"), found("start"));
    assert_eq!(axis, (5000.0, start), "{heading}");
    let compensate = ["compensate", "in.csv", "-o", "out.csv", "--force"];
    let harmonics = ["harmonics", "in.csv", "--fundamental", "20", "--orders=1"];
    for args in [compensate, harmonics] {
        let more = ["--channel", "2", "--stand", "stand.toml", "--json"];
        let report = folder.json(&[&args[..], &more].concat());
        let rate_hz = report["rate_hz"].as_f64();
        assert_eq!(rate_hz, Some(5000.0), "{heading} {args:?}");
    }
}

/// Two channels at different rates, or from different starts, each behind its own time: whatever the times are called,
/// every verb takes the one beside the channel.
#[test]
fn each_channel_has_the_time_beside_it() {
    let folder = Folder::new();
    for heading in [
        "Speed_Time [s];Speed;Torque_Time [s]",
        "Time [s];Speed;Torque Time [s]",
        "Vib x [s];Vib y;Torque x [s]",
        "Speed.time [s];Speed.value;Torque.time [s]",
        "A - Time [s];A_Speed;Torque - Time [s]",
        "X [s];Y;X2 [s]",
        "Speed (s);Speed (rpm);Torque (s)",
        "s;rpm;s",
        "Time [s];Speed;t_Torque [s]",
        "t [s];Speed;x [s]",
        "Speed/Time [s];Speed;Torque/Time [s]",
        "Time [s];Speed;Time [s]",
    ] {
        let torque = match heading.starts_with("s;") {
            true => "Nm",
            false => "Torque [Nm]",
        };
        for (slow_hz, start) in [(1000.0, 0.0), (5000.0, 0.5), (1000.0, 0.5)] {
            let rows = rows([0, 1, 2, 3], slow_hz, start);
            check(&folder, &format!("{heading};{torque}"), &rows, start);
        }
    }
    // The slower channel ends before.
    let shorter = |(i, row): (usize, &str)| {
        let fast = row.splitn(3, ';').last().unwrap();
        match i < 800 {
            true => format!("{row}\n"),
            false => format!(";;{fast}\n"),
        }
    };
    let both = rows([0, 1, 2, 3], 1000.0, 0.0);
    let both: String = both.lines().enumerate().map(shorter).collect();
    let heading = "Speed_Time [s];Speed;Torque_Time [s];Torque [Nm]";
    check(&folder, heading, &both, 0.0);
}

/// Where the places of the times do not show which is whose, it is asked for.
#[test]
fn a_time_that_may_be_of_either_channel_is_asked_for() {
    let folder = Folder::new();
    let slow_and_fast = "Time 1 - slow;Time 2 - fast;Speed;Torque [Nm]";
    for (heading, order) in [
        (slow_and_fast, [0, 2, 1, 3]),
        ("Time [s];Torque_Time [s];Speed;Torque [Nm]", [0, 2, 1, 3]),
        ("Time [s];Speed;Torque [Nm];Torque_Time [s]", [0, 1, 3, 2]),
        ("Time [s];Torque [Nm];Torque_Time [s];Speed", [0, 3, 2, 1]),
        ("Speed;Time [s];Torque [Nm];Time2 [s]", [1, 0, 3, 2]),
    ] {
        folder.write("in.csv", format!("{heading}\n{}", rows(order, 1000.0, 0.0)));
        let run = |more: &[&str]| {
            let input = ["compensate", "in.csv", "--channel", "Torque"];
            let output = ["--stand", "stand.toml", "-o", "out.csv", "--force"];
            folder.run(&[&input[..], &output, more].concat())
        };
        run(&[]).says(1, &["at different rates", "--time-column"]);
        let place = (order.iter().position(|cell| *cell == 2).unwrap() + 1).to_string();
        let given = ["--time-column", &place, "--time-unit", "s"];
        run(&given).says(0, &["4000 samples at 5000 Hz"]);
    }
}

/// A running channel of the same rate, and hours of operation.
#[test]
fn a_channel_that_rises_like_time_is_no_clock() {
    let folder = Folder::new();
    let hours = |i: i32| {
        let (time, hours) = (f64::from(i) / 1e3, 1234.5 + f64::from(i) / 3.6e6);
        format!("{time};0;{hours:.4};0\n")
    };
    let hours: String = (0..4000).map(hours).collect();
    let heading = "Time [s];Torque [Nm];Operating time [h];Speed";
    assert_eq!(count(&folder, heading, &hours), 3);
    let same = rows([0, 1, 0, 3], 5000.0, 0.0);
    let heading = "Time [s];Speed;Runtime [s];Torque [Nm]";
    assert_eq!(count(&folder, heading, &same), 3);
}
