//! `harmonics` on a record with known components.

use std::f64::consts::TAU;

use crate::noise::Noise;
use crate::util::{Folder, HARMONICS, hertel_response, record, steady};

const PARTS: [(f64, f64, f64); 4] = [
    (0.8, 0.0, 0.0),
    (1.0, 59.87, 0.3),
    (0.4, 119.74, 2.0),
    (0.2, 598.7, -1.0),
];

fn folder() -> Folder {
    let folder = Folder::new();
    let (shown, _) = steady(&PARTS, 20_000.0, 30_000);
    let mut noise = Noise(5);
    let noisy: Vec<f64> = shown
        .iter()
        .map(|x| x + 0.01 * (noise.uniform() - 0.5))
        .collect();
    folder.write("in.csv", record(&noisy, 20_000.0));
    folder
}

#[test]
fn components_come_back_with_factor_and_uncertainty() {
    let report = folder().json(
        &[
            &HARMONICS[..],
            &["60", "--refine", "--orders", "1,2,10", "--json"],
        ]
        .concat(),
    );
    assert_eq!(report["schema"], "torqcomp.harmonics/1");
    let fundamental = report["fundamental_hz"].as_f64().unwrap();
    let std = report["fundamental_std_hz"].as_f64().unwrap();
    assert!(
        (fundamental - 59.87).abs() < 5.0 * std && std < 1e-3,
        "{fundamental} ± {std}"
    );
    assert!((report["mean"].as_f64().unwrap() - 0.8).abs() < 1e-3);
    // Uniform noise of 0.01 has a standard deviation of 0.01/√12.
    assert!((report["residual_rms"].as_f64().unwrap() - 0.01 / 12_f64.sqrt()).abs() < 1e-4);
    let components = report["components"].as_array().unwrap();
    assert_eq!(components.len(), 3);
    for (component, (a, f, phase)) in components.iter().zip(&PARTS[1..]) {
        let number = |key: &str| component[key].as_f64().unwrap();
        let (gain, _) = hertel_response(*f);
        assert!((number("factor") * gain - 1.0).abs() < 1e-4, "{component}");
        assert!((number("recorded") * number("factor") / number("torque") - 1.0).abs() < 1e-12);
        assert!(
            (number("torque") - a).abs() < 5.0 * number("std") + 1e-5,
            "{component}"
        );
        // √(2/N) times the noise, times the factor.
        let expected = (2.0_f64 / 30_000.0).sqrt() * 0.01 / 12_f64.sqrt() * number("factor");
        assert!(
            (number("std") / expected - 1.0).abs() < 0.35,
            "{} {expected}",
            number("std")
        );
        let phase_error = number("phase_deg") - phase.to_degrees();
        assert!(
            phase_error.abs() < 5.0 * number("phase_std_deg") + 0.02,
            "{component}"
        );
        assert!(component["std_stand"].is_null());
    }
}

#[test]
fn a_table_for_people() {
    let ran = folder().run(
        &[
            &HARMONICS[..],
            &["59.87", "--orders", "1-9", "--units", "us"],
        ]
        .concat(),
    );
    ran.says(0, &["components-lost-in-noise"]);
    assert!(
        ran.stdout.contains("torque ft lbf") && ran.stdout.contains("± noise"),
        "{}",
        ran.stdout
    );
    assert!(
        ran.stdout.contains("0.7375"),
        "1 N m are 0.7376 ft lbf: {}",
        ran.stdout
    );
}

#[test]
fn orders_that_cannot_be_seen_are_said() {
    let folder = folder();
    let ran = folder.run(&[&HARMONICS[..], &["4000"]].concat());
    ran.says(0, &["orders-above-nyquist", "orders 3 to 20"]);
    folder
        .run(&[&HARMONICS[..], &["12 kHz"]].concat())
        .says(1, &["half the sampling rate"]);
    folder
        .run(&[&HARMONICS[..], &["0.05"]].concat())
        .says(1, &["in.csv", "cannot be resolved", "record at least"]);
    folder
        .run(&[&HARMONICS[..], &["55", "--refine", "--orders", "1"]].concat())
        .says(1, &["could not be refined"]);
}

/// Torque at three orders of a shaft whose angle oscillates by so many rad at a rate, at an exact mean speed.
fn swaying(frequency_hz: f64, (sway_rad, sway_hz): (f64, f64), hum: f64) -> String {
    let mut noise = Noise(9);
    let samples: Vec<f64> = (0..40_000)
        .map(|i| {
            let t = f64::from(i) / 10_000.0;
            let turn = std::f64::consts::TAU * t;
            let angle = frequency_hz * turn + sway_rad * (sway_hz * turn).sin();
            let orders = [(1.0, 1.0), (2.0, 0.5), (7.0, 0.1)];
            let torque: f64 = orders.iter().map(|(k, a)| a * (k * angle).cos()).sum();
            torque + hum * (50.0 * turn).cos() + 0.02 * (noise.uniform() - 0.5)
        })
        .collect();
    record(&samples, 10_000.0)
}

/// A faulty speed is reported where it changes a component, and only there.
#[test]
fn a_speed_that_sways_or_is_off_is_said() {
    let folder = Folder::new();
    let codes = |text: String, fundamental: &str| -> Vec<String> {
        folder.write("in.csv", text);
        let report = folder.json(
            &[
                &HARMONICS[..],
                &[fundamental, "--orders", "1,2,7", "--json"],
            ]
            .concat(),
        );
        let warnings = report["warnings"].as_array().expect("a list");
        let of_speed = ["speed-changes", "fundamental-off", "order-or-mains"];
        let codes = warnings.iter().filter_map(|w| w["code"].as_str());
        codes
            .filter(|code| of_speed.contains(code))
            .map(str::to_owned)
            .collect()
    };
    assert!(codes(swaying(47.3, (0.0, 2.0), 0.0), "47.3").is_empty());
    // The seventh order is too small by 12 %, J0(0.7); for 0.01 rad by 0.1 %.
    assert_eq!(
        codes(swaying(47.3, (0.1, 2.0), 0.0), "47.3"),
        ["speed-changes"]
    );
    assert!(codes(swaying(47.3, (0.01, 2.0), 0.0), "47.3").is_empty());
    // Faster than eight turns, and so far that the seventh order turns several times and no order is significant.
    for sway in [(0.09, 5.0), (0.9, 1.0)] {
        assert_eq!(codes(swaying(47.3, sway, 0.0), "47.3"), ["speed-changes"]);
    }
    // In 4 s the seventh order turns by 0.14 of a turn relative to 47.305 Hz.
    assert_eq!(
        codes(swaying(47.3, (0.0, 2.0), 0.0), "47.305"),
        ["fundamental-off"]
    );
    assert_eq!(
        codes(swaying(50.0, (0.0, 2.0), 0.2), "50"),
        ["order-or-mains"]
    );
    // 1500 rpm, given as hertz.
    assert_eq!(
        codes(swaying(25.0, (0.0, 2.0), 0.0), "1500"),
        ["fundamental-off"]
    );
    // A line at 50 Hz that is three times as strong as the order beside it says nothing about the speed.
    assert!(codes(swaying(24.8, (0.0, 2.0), 1.5), "24.8").is_empty());
}

/// Strong lines at whole multiples of 1 Hz in a record of 1 s leak nothing into each other's neighbours, but much into
/// orders between them.
#[test]
fn lines_that_are_no_orders_are_in_the_uncertainty() {
    let orders = [1.0, 0.5, 0.2];
    for fundamental_hz in [24.5, 33.5, 41.5] {
        let mut noise = Noise(9);
        let mut row = |i: i32| {
            let t = f64::from(i) / 10_000.0;
            let line = |hz: f64, size: f64| size * (TAU * hz * t + 0.4).cos();
            let own = (1..).zip(orders);
            let own: f64 = own
                .map(|(k, size)| line(f64::from(k) * fundamental_hz, size))
                .sum();
            let torque = own + line(50.0, 0.3) + line(600.0, 0.2) + 0.01 * noise.normal();
            format!("{t:.4},{torque:.9}\n")
        };
        let rows: String = (0..10_000).map(&mut row).collect();
        let folder = Folder::new();
        folder.write("in.csv", format!("time_s,compensated_torque_n_m\n{rows}"));
        let hz = fundamental_hz.to_string();
        let report = folder.json(&[
            "harmonics",
            "in.csv",
            "--fundamental",
            &hz,
            "--orders",
            "1-8",
            "--json",
        ]);
        for (k, component) in report["components"].as_array().unwrap().iter().enumerate() {
            let [torque, std] = ["torque", "std"].map(|key| component[key].as_f64().unwrap());
            let truth = orders.get(k).copied().unwrap_or(0.0);
            assert!(
                (torque - truth).abs() < 4.0 * std,
                "{hz} Hz, order {}: {torque} ± {std}",
                k + 1
            );
        }
    }
}

/// An oscilloscope of 8 bits and no noise, and a speed that divides its sampling rate: the rounding repeats with each
/// turn, so that nothing of it is between the orders.
#[test]
fn repeated_rounding_is_in_the_uncertainty() {
    let folder = Folder::new();
    let (mut squares, mut count) = (0.0, 0);
    for case in 0..6 {
        let size = 0.9 + 0.013 * f64::from(case);
        let row = |i: i32| {
            let t = f64::from(i) / 10_000.0;
            let torque = size * (TAU * 50.0 * t + 0.7 * f64::from(case)).cos();
            format!("{t:.4},{:.2}\n", 0.02 * (torque / 0.02).round())
        };
        let rows: String = (0..20_000).map(row).collect();
        folder.write("in.csv", format!("time_s,compensated_torque_n_m\n{rows}"));
        let words = [
            "harmonics",
            "in.csv",
            "--fundamental",
            "50",
            "--orders",
            "1-9",
            "--json",
        ];
        let report = folder.json(&words);
        for (k, component) in report["components"].as_array().unwrap().iter().enumerate() {
            let [torque, std] = ["torque", "std"].map(|key| component[key].as_f64().unwrap());
            let truth = if k == 0 { size } else { 0.0 };
            squares += ((torque - truth) / std).powi(2);
            count += 1;
        }
        let lost = report["warnings"].to_string();
        assert!(lost.contains("components-lost-in-noise"), "{lost}");
    }
    let off = (squares / f64::from(count)).sqrt();
    assert!((0.2..2.0).contains(&off), "{off} standard uncertainties");
}

/// 4 s of orders 1, 2 and 3 of a frequency that rises evenly by a fraction, with a second order that grows evenly by a
/// factor.
fn changing(frequency_hz: f64, rise: f64, growth: f64) -> String {
    let mut noise = Noise(31);
    let samples: Vec<f64> = (0..8000)
        .map(|i| {
            let (t, part) = (f64::from(i) / 2000.0, f64::from(i) / 8000.0);
            let angle = TAU * frequency_hz * t * (1.0 + 0.5 * rise * part);
            let second = 0.5 * (1.0 + (growth - 1.0) * part);
            let orders = [(1.0, 1.0), (2.0, second), (3.0, 0.4)];
            let torque: f64 = orders.iter().map(|(k, a)| a * (k * angle).cos()).sum();
            torque + 0.02 * (noise.uniform() - 0.5)
        })
        .collect();
    record(&samples, 2000.0)
}

/// The message of each warning with this code.
fn messages(report: &serde_json::Value, code: &str) -> Vec<String> {
    let all = report["warnings"].as_array().expect("a list").iter();
    let of_code = all.filter(|w| w["code"] == code);
    of_code
        .filter_map(|w| w["message"].as_str().map(str::to_owned))
        .collect()
}

#[test]
fn a_component_that_grows_is_said() {
    let folder = Folder::new();
    for (growth, is_said) in [(1.0, false), (1.1, false), (3.0, true), (0.5, true)] {
        folder.write("in.csv", changing(47.3, 0.0, growth));
        let more = ["47.3", "--orders", "1-3", "--json"];
        let report = folder.json(&[&HARMONICS[..], &more].concat());
        let told = messages(&report, "amplitude-changes");
        assert_eq!(told.len(), usize::from(is_said), "{growth}: {told:?}");
        assert!(
            told.iter().all(|text| text.contains("order 2 ")),
            "{told:?}"
        );
        assert!(messages(&report, "speed-changes").is_empty(), "{growth}");
    }
}

/// The number after the first --fundamental in a message.
fn advised(message: &str) -> f64 {
    let (_, after) = message.split_once("--fundamental ").expect("advice");
    let (number, _) = after.split_once(';').expect("an end");
    number.parse().expect("a number")
}

/// The speed is a half or a third of the fundamental; an order that is asked for is not between the orders.
#[test]
fn a_multiple_of_the_speed_is_said() {
    let folder = Folder::new();
    folder.write("in.csv", changing(47.3, 0.0, 1.0));
    for (fundamental, orders, speed) in [
        ("47.3", "1-3", None),
        ("94.6", "1-4", Some(47.3)),
        ("95", "1-2", Some(47.3)),
        ("141.9", "1-2", Some(47.3)),
        ("94.6", "0.5,1,1.5", None),
    ] {
        let more = [fundamental, "--orders", orders, "--json"];
        let report = folder.json(&[&HARMONICS[..], &more].concat());
        let told = messages(&report, "lines-between-orders");
        let is_right = match speed {
            Some(speed) => told.len() == 1 && (advised(&told[0]) / speed - 1.0).abs() < 1e-5,
            None => told.is_empty(),
        };
        assert!(is_right, "{fundamental}, {orders}: {told:?}");
        assert!(
            messages(&report, "speed-changes").is_empty(),
            "{fundamental}"
        );
    }
}

/// The stand's resonance amplifies one order more than ten times: as torque, it is not the largest line.
#[test]
fn a_resonance_does_not_hide_lines_between_orders() {
    let folder = Folder::new();
    let parts = [
        (0.0, 0.0, 0.0),
        (0.4, 98.3, 0.3),
        (0.8, 294.9, 2.0),
        (0.5, 589.8, -1.0),
    ];
    let (mut shown, _) = steady(&parts, 20_000.0, 30_000);
    let mut noise = Noise(5);
    shown
        .iter_mut()
        .for_each(|x| *x += 0.01 * (noise.uniform() - 0.5));
    folder.write("in.csv", record(&shown, 20_000.0));
    let more = ["196.6", "--orders", "1-3", "--json"];
    let report = folder.json(&[&HARMONICS[..], &more].concat());
    let told = messages(&report, "lines-between-orders");
    assert_eq!(told.len(), 1, "{report}");
    assert!((advised(&told[0]) / 98.3 - 1.0).abs() < 1e-5, "{told:?}");
}

/// Where no line between the orders shows the multiple, such as a single one elsewhere, nothing says that the speed
/// changes: no order is there.
#[test]
fn orders_that_are_absent_are_no_changing_speed() {
    let folder = Folder::new();
    let mut noise = Noise(32);
    let samples: Vec<f64> = (0..10_000)
        .map(|i| (TAU * 25.3 * f64::from(i) / 1000.0).cos() + 0.02 * (noise.uniform() - 0.5))
        .collect();
    folder.write("in.csv", record(&samples, 1000.0));
    for fundamental in ["50.6", "51"] {
        let more = [fundamental, "--orders", "1-4", "--json"];
        let report = folder.json(&[&HARMONICS[..], &more].concat());
        assert!(
            messages(&report, "speed-changes").is_empty(),
            "{fundamental}"
        );
    }
}

#[test]
fn a_speed_that_changes_cannot_be_refined() {
    let folder = Folder::new();
    folder.write("in.csv", changing(47.3, 0.05, 1.0));
    let more = ["47.3", "--orders", "1-3", "--refine"];
    let ran = folder.run(&[&HARMONICS[..], &more].concat());
    assert_eq!(ran.code, 1);
    assert!(
        ran.stderr
            .contains("the fundamental changes over the record, from 47."),
        "{}",
        ran.stderr
    );
}

/// An induction motor at 29.2 Hz on 60 Hz mains, whose nameplate says 29.5 Hz: the line at twice the mains is near its
/// fourth order.
#[test]
fn a_line_of_the_mains_does_not_decide_the_speed() {
    let parts = [(6.0, 0.0, 0.0), (0.3, 29.2, 1.0), (1.5, 120.0, 0.4)];
    let (shown, _) = steady(&parts, 5000.0, 10_000);
    let mut noise = Noise(17);
    let shown: Vec<f64> = shown.iter().map(|x| x + 5e-3 * noise.normal()).collect();
    let folder = Folder::new();
    folder.write("in.csv", record(&shown, 5000.0));
    for given in ["29.5", "29.3"] {
        let args = [
            &HARMONICS[..],
            &[given, "--refine", "--orders", "1-4", "--json"],
        ]
        .concat();
        let report = folder.json(&args);
        let found = report["fundamental_hz"].as_f64().unwrap();
        assert!((found - 29.2).abs() < 0.01, "{given}: {found}");
    }
    let args = [&HARMONICS[..], &["29.5", "--orders", "1-4"]].concat();
    folder
        .run(&args)
        .says(0, &["fundamental-off", "a fundamental of 29.2"]);
    // In step with the mains, a shaft keeps the orders that coincide with them.
    let parts = [(6.0, 0.0, 0.0), (0.3, 30.0, 1.0), (1.5, 120.0, 0.4)];
    let (shown, _) = steady(&parts, 5000.0, 10_000);
    folder.write("in.csv", record(&shown, 5000.0));
    let more = ["29.8", "--refine", "--orders", "1-4", "--json"];
    let report = folder.json(&[&HARMONICS[..], &more].concat());
    assert!((report["fundamental_hz"].as_f64().unwrap() - 30.0).abs() < 1e-3);
}

/// Order 6, which is not listed, is that near a line of the mains.
#[test]
fn a_strong_order_beside_the_mains_is_no_changing_speed() {
    let folder = Folder::new();
    let mut noise = Noise(12);
    let line = |size: f64, order: f64| (size, 33.37 * order, order);
    let parts = [
        (2.0, 0.0, 0.0),
        line(0.3, 1.0),
        line(0.2, 2.0),
        line(0.5, 6.0),
        line(0.05, 12.0),
    ];
    let (shown, _) = steady(&parts, 5000.0, 5000);
    let shown: Vec<f64> = shown.iter().map(|x| x + 2e-3 * noise.normal()).collect();
    folder.write("in.csv", record(&shown, 5000.0));
    let report = folder.json(&[&HARMONICS[..], &["33.37", "--orders", "1,2", "--json"]].concat());
    assert!(messages(&report, "speed-changes").is_empty(), "{report}");
}

/// A line at order 6 is also order 5 or 7 of other speeds.
#[test]
fn a_speed_that_explains_all_lines_is_proposed() {
    let folder = Folder::new();
    let mut noise = Noise(9);
    let line = |size: f64, order: f64| (size, 48.3 * order, order);
    let parts = [
        (2.0, 0.0, 0.0),
        line(0.1, 1.0),
        line(0.2, 2.0),
        line(0.5, 6.0),
        line(0.3, 12.0),
    ];
    let (shown, _) = steady(&parts, 10_000.0, 20_000);
    let shown: Vec<f64> = shown.iter().map(|x| x + 2e-3 * noise.normal()).collect();
    folder.write("in.csv", record(&shown, 10_000.0));
    for given in ["30", "40", "42", "60"] {
        let report = folder.json(&[&HARMONICS[..], &[given, "--json"]].concat());
        let told = messages(&report, "fundamental-off");
        let is_right = told.len() == 1 && told[0].ends_with("--fundamental 48.3");
        assert!(is_right, "{given}: {report}");
    }
}

/// An order that is not asked for is the strongest: neither the refined speed nor the check of a constant one may suffer.
#[test]
fn a_strong_order_that_is_not_listed_biases_nothing() {
    let folder = Folder::new();
    for seed in 0..8 {
        let mut noise = Noise(100 + seed);
        let speed_hz = 30.0 + 15.0 * noise.uniform();
        let line = |size, order: f64, phase| (size, order * speed_hz, phase);
        let parts = [
            (2.0, 0.0, 0.0),
            line(0.3, 1.0, 6.0 * noise.uniform()),
            line(0.2, 2.0, 6.0 * noise.uniform()),
            line(0.5, 6.0, 6.0 * noise.uniform()),
        ];
        let (shown, _) = steady(&parts, 5000.0, 5000);
        let shown: Vec<f64> = shown.iter().map(|x| x + 2e-3 * noise.normal()).collect();
        folder.write("in.csv", record(&shown, 5000.0));
        let given = format!("{:.3}", 1.005 * speed_hz);
        let more = [given.as_str(), "--orders", "1,2", "--refine", "--json"];
        let report = folder.json(&[&HARMONICS[..], &more].concat());
        let number = |key: &str| report[key].as_f64().unwrap();
        let (found, std) = (number("fundamental_hz"), number("fundamental_std_hz"));
        assert!((found - speed_hz).abs() < 4.0 * std, "{speed_hz}: {report}");
        assert_eq!(report["components"].as_array().unwrap().len(), 2);
        assert!(messages(&report, "speed-changes").is_empty(), "{report}");
    }
}

/// A run-up from 25 to 100 Hz in 3 s, in part and as a whole, and a weak order in noise.
#[test]
fn orders_that_do_not_explain_the_record_are_said() {
    let folder = Folder::new();
    let mut noise = Noise(3);
    let angle = |t: f64| TAU * (25.0 * t + 12.5 * t * t);
    let sample = |i: usize| {
        let angle = angle(i as f64 * 1e-4);
        let order = |n: f64, size: f64| size * (n * angle + n).cos();
        2.0 + order(1.0, 0.1) + order(6.0, 0.4) + order(12.0, 0.2) + 2e-3 * noise.normal()
    };
    let shown: Vec<f64> = (0..30_000).map(sample).collect();
    folder.write("in.csv", record(&shown, 10_000.0));
    for range in [&["--range", "1.1..1.3"][..], &[]] {
        let report = folder.json(&[&HARMONICS[..], &["55", "--json"], range].concat());
        let told = messages(&report, "orders-explain-little");
        assert_eq!(told.len(), 1, "{range:?}: {report}");
        let lost = messages(&report, "components-lost-in-noise");
        assert!(lost.is_empty(), "{range:?}: {report}");
    }
    let weak = |i: i32| 0.01 * (TAU * 55.0 * f64::from(i) * 1e-4).cos() + noise.normal();
    let weak: Vec<f64> = (0..30_000).map(weak).collect();
    folder.write("in.csv", record(&weak, 10_000.0));
    let report = folder.json(&[&HARMONICS[..], &["55", "--json"]].concat());
    let told = messages(&report, "orders-explain-little");
    assert!(told.is_empty(), "{report}");
}
