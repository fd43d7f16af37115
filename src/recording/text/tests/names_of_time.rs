//! Columns whose names are those of time, and what their values say.

use super::*;

/// Values about a level that rise and fall.
fn level(row: f64) -> String {
    format!("{:.4}", 53.0 + (row * 2.3).sin())
}

fn headed(heading: &str, columns: &[&dyn Fn(f64) -> String]) -> Recording {
    read(&format!("{heading}\n{}", rows(40, ",", columns)))
}

fn codes(recording: &Recording) -> Vec<&str> {
    recording.warnings.iter().map(|w| w.code).collect()
}

#[test]
fn temperatures_are_no_time() {
    let (half, rising) = (step(0.5, 1), |row: f64| format!("{:.2}", 20.0 + 0.05 * row));
    let found = headed("X_Value,T5,T_Ambient,T6", &[&half, &level, &level, &rising]);
    let all = [("T5", "", 40), ("T_Ambient", "", 40), ("T6", "", 40)];
    check(&found, &all, Some(2.0));
    let found = headed("Time,T1,T2,P", &[&half, &level, &rising, &wave]);
    check(
        &found,
        &[("T1", "", 40), ("T2", "", 40), ("P", "", 40)],
        Some(2.0),
    );
    let found = headed("T1,T2,P", &[&level, &rising, &wave]);
    check(
        &found,
        &[("T1", "", 40), ("T2", "", 40), ("P", "", 40)],
        None,
    );
    let number = |row: f64| format!("{}", row + 1.0);
    let found = headed("Nr,T,M", &[&number, &rising, &wave]);
    check(&found, &[("T", "", 40), ("M", "", 40)], None);
}

#[test]
fn a_first_column_that_rises_is_time() {
    let half = step(0.5, 1);
    check(&headed("T,M", &[&half, &wave]), &[("M", "", 40)], Some(2.0));
    let pairs = headed("t1,a,t2,b", &[&half, &wave, &half, &level]);
    check(&pairs, &[("a", "", 40), ("b", "", 40)], Some(2.0));
    for heading in ["Time,CH1,Time,CH2", "Time1,CH1,Time2,CH2"] {
        let pairs = headed(heading, &[&half, &wave, &half, &level]);
        check(&pairs, &[("CH1", "", 40), ("CH2", "", 40)], Some(2.0));
    }
}

#[test]
fn durations_and_speeds_are_channels() {
    let half = step(0.5, 1);
    let found = headed("Time,CycleTime,Us,M", &[&half, &level, &level, &wave]);
    let all = [("CycleTime", "", 40), ("Us", "", 40), ("M", "", 40)];
    check(&found, &all, Some(2.0));
    let found = headed("Zeit [s],M,Zykluszeit [ms]", &[&half, &wave, &level]);
    check(
        &found,
        &[("M", "", 40), ("Zykluszeit", "ms", 40)],
        Some(2.0),
    );
    // It rises, but is not named as the first.
    let found = headed("Time,M,Runtime,n", &[&half, &wave, &half, &level]);
    check(
        &found,
        &[("M", "", 40), ("Runtime", "", 40), ("n", "", 40)],
        Some(2.0),
    );
    check(
        &headed("x,F", &[&level, &wave]),
        &[("x", "", 40), ("F", "", 40)],
        None,
    );
}

#[test]
fn what_is_left_out_is_said() {
    let square = |row: f64| format!("{}", row * row);
    let found = headed("Time,Runtime,M", &[&step(0.5, 1), &square, &wave]);
    check(&found, &[("M", "", 40)], Some(2.0));
    assert_eq!(codes(&found), ["time-assumed", "time-left-out"]);
    let found = headed("Time,M", &[&level, &wave]);
    check(&found, &[("Time", "", 40), ("M", "", 40)], None);
    assert_eq!(codes(&found), ["time-falls"]);
    // Set back three times, it is the time still.
    let back = |row: f64| format!("{:.1}", row * 0.5 - 2.0 * (row / 10.0).floor());
    let found = headed("Time,M", &[&back, &wave]);
    check(&found, &[("M", "", 40)], Some(2.0));
}

#[test]
fn an_axis_in_seconds_is_time_again_and_again() {
    let (fast, slow) = (step(0.5, 1), |row: f64| match row < 10.0 {
        true => format!("{row:.1}"),
        false => String::new(),
    });
    let short = |row: f64| match row < 10.0 {
        true => wave(row),
        false => String::new(),
    };
    let columns: [&dyn Fn(f64) -> String; 4] = [&fast, &wave, &slow, &short];
    let found = headed("X[s],EMG 1,X[s],ACC 1", &columns);
    let told: Vec<_> = found
        .channels
        .iter()
        .map(|c| (c.name.as_str(), c.samples.len(), c.axis.rate_hz))
        .collect();
    assert_eq!(told, [("EMG 1", 40, Some(2.0)), ("ACC 1", 10, Some(1.0))]);
}

#[test]
fn dates_as_numbers() {
    // A twentieth of a second is 1/1728000 of a day.
    let days = |first: f64| move |row: f64| format!("{:.10}", first + row / 1_728_000.0);
    for first in [44_259.25, 738_219.25] {
        let found = headed("Timestamp,M", &[&days(first), &wave]);
        let rate_hz = found.channels[0].axis.rate_hz.unwrap();
        assert!((rate_hz / 20.0 - 1.0).abs() < 1e-4, "{rate_hz}");
        assert_eq!(codes(&found), ["time-assumed"]);
    }
    // Seconds of the day.
    let seconds = |row: f64| format!("{:.3}", 36_000.0 + row * 0.005);
    check(
        &headed("Time,M", &[&seconds, &wave]),
        &[("M", "", 40)],
        Some(200.0),
    );
    // Over midnight.
    let digits = |row: f64| match row < 20.0 {
        true => format!("20210304235959.{:02}", row * 5.0),
        false => format!("20210305000000.{:02}", (row - 20.0) * 5.0),
    };
    check(
        &headed("Timestamp,M", &[&digits, &wave]),
        &[("M", "", 40)],
        Some(20.0),
    );
}
