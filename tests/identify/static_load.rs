//! Known loads.

use std::time::Instant;

use torqcomp::identify::static_load::{LoadUnits, Point, identify, series_of};

use super::{Coverage, Noise, of, parameter};
use crate::util::{Folder, assert_close};

#[test]
fn known_loads_give_the_calibration() {
    let folder = Folder::new();
    let rows = "0,0.010\n5,0.511\n10,1.009\n5,0.512\n0,0.011\n0,0.010\n5,0.509\n10,1.011\n5,0.510\n0,0.010\n";
    folder.write("loads.csv", format!("weight (N m),bridge (V)\n{rows}"));
    let args = [
        "identify",
        "static",
        "loads.csv",
        "--load",
        "weight",
        "--reading",
        "bridge",
    ];
    let report = folder.json(&[&args[..], &["--json", "-o", "new.toml"]].concat());
    let (value, std, unit) = parameter(&report, "torque_per_volt");
    assert_close(value, 10.0, 5e-3);
    assert!(std.is_some() && unit == "N m/V");
    let term = |name: &str| {
        let all = report["terms"].as_array().expect("terms");
        all.iter().find(|t| t["name"] == name).expect("the term")["percent"].as_f64()
    };
    // (1.011 − 0.010) − (1.009 − 0.010) over their mean, 1.000: 0.2 %; at 5 N m 0.501 and 0.499: 0.4 %.
    assert!(
        (term("repeatability").unwrap() - 0.4).abs() < 1e-9,
        "{:?}",
        term("repeatability")
    );
    assert_eq!((term("reproducibility"), term("creep")), (None, None));
    let stand = folder.read("new.toml");
    assert!(
        stand.contains("[calibration]\ntorque_per_volt = {")
            && stand.contains("[recorder]\nzero = {")
    );
}

/// A live zero, as of 4 to 20 mA, affects only the zero: readings to 1e-5 V with noise of 1e-4 V.
#[test]
fn a_zero_far_from_nothing_changes_no_uncertainty() {
    let noise = [13, 3, 2, -4, -2, -9, 11, 4, -6, 0, 7];
    let loads = [0.0, 5.0, 10.0, 5.0, 0.0, 0.0, 5.0, 10.0, 5.0, 0.0, 5.0];
    let at_zero = |zero: f64| {
        let folder = Folder::new();
        let reading = |(load, noise): (&f64, &i32)| {
            format!(
                "{load},{:.5}\n",
                zero + 0.16 * load + 1e-5 * f64::from(*noise)
            )
        };
        let rows: String = loads.iter().zip(&noise).map(reading).collect();
        folder.write("loads.csv", format!("torque_Nm,reading_V\n{rows}"));
        let args = "identify static loads.csv --load torque --reading reading --json";
        let report = folder.json(&args.split(' ').collect::<Vec<_>>());
        let [(slope, of_slope, _), (at, of_zero, _)] =
            ["torque_per_volt", "zero"].map(|name| parameter(&report, name));
        [slope, of_slope.unwrap(), at - zero, of_zero.unwrap()]
    };
    let near = at_zero(0.0);
    // The scatter of 7e-5 V over a spread of the loads of 12 N m, with Student's factor.
    assert!(near[1] / near[0] < 2e-4, "{near:?}");
    for zero in [1.0, 2.5, 12.0, 60.0] {
        let far = at_zero(zero);
        for (far, near) in far.iter().zip(near) {
            assert!(
                (far - near).abs() <= 1e-3 * near.abs() + 1e-6,
                "{zero}: {far} is not {near}"
            );
        }
    }
}

/// Loads in N m, readings in V.
fn units() -> LoadUnits {
    LoadUnits {
        load: "N m".to_owned(),
        reading: "V".to_owned(),
    }
}

/// A reading without a known uncertainty, at one mounting.
fn point(load: f64, reading: f64, series: usize) -> Point {
    Point {
        load,
        reading,
        std: None,
        series,
        position: 0,
    }
}

/// Three series of eleven loads up and ten down; readings 0.02 V + 0.1 V/(N m) times the load, with
/// noise `decibel` below the largest, constant or growing with the load (and then known).
fn points(decibel: f64, known: bool, noise: &mut Noise) -> Vec<Point> {
    let up = (0..=10).map(f64::from);
    let loads: Vec<f64> = (0..3)
        .flat_map(|_| up.clone().chain(up.clone().rev().skip(1)))
        .collect();
    let series = series_of(&loads);
    let size = 10_f64.powf(-decibel / 20.0);
    loads
        .iter()
        .zip(series)
        .map(|(load, series)| {
            let std = if known {
                size * (0.2 + 0.08 * load)
            } else {
                size
            };
            Point {
                load: *load,
                reading: 0.02 + 0.1 * load + std * noise.normal(),
                std: known.then_some(std),
                series,
                position: 0,
            }
        })
        .collect()
}

#[test]
fn intervals_of_known_loads_cover_the_truth() {
    let units = units();
    for known in [false, true] {
        let mut noise = Noise(31);
        let names = [
            ("torque_per_volt", 10.0),
            ("sensitivity", 0.1),
            ("zero", 0.02),
        ];
        let mut covered = [0; 3].map(|_| Coverage::default());
        for k in 0..400 {
            let decibel = [20.0, 30.0, 40.0, 50.0, 60.0][k % 5];
            let points = points(decibel, known, &mut noise);
            let found = identify(&points, 1, &units).unwrap();
            for ((name, truth), coverage) in names.iter().zip(&mut covered) {
                coverage.count(of(&found, name), *truth);
            }
        }
        for ((name, _), coverage) in names.iter().zip(&covered) {
            coverage.check(&format!("{name}, uncertainty known: {known}"));
        }
    }
}

/// Readings of a display with one decimal: 20.49 N m/(mV/V) reads as 20, and the last digit gives the uncertainty.
#[test]
fn the_last_digit_of_a_display_is_part_of_the_uncertainty() {
    let folder = Folder::new();
    let loads = [0.0, 10.0, 20.0, 30.0, 40.0];
    let rows: Vec<String> = loads
        .iter()
        .map(|load| format!("{load},{:.1}", load * 0.0488))
        .collect();
    folder.write(
        "w.csv",
        format!("load (N m),reading (mV/V)\n{}\n", rows.join("\n")),
    );
    let args = ["identify", "static", "w.csv", "--load", "load"];
    let report = folder.json(&[&args[..], &["--reading", "reading", "--json"]].concat());
    let (value, std, _) = parameter(&report, "torque_per_ratio");
    // 0.1/√12 mV/V over √Σ(x − x̄)² = √1000 N m, enlarged by Student's quantile for 3 degrees of freedom, 3.18/1.96,
    // times 20².
    assert_close(
        std.unwrap(),
        0.1 / 12.0_f64.sqrt() / 1000.0_f64.sqrt() * 400.0 * 3.182 / 1.96,
        0.01,
    );
    assert!((value - 1.0 / 0.0488).abs() < 2.0 * std.unwrap(), "{value}");
}

/// Noise of 200 digits over six rows, which can look like a walk of the zero without noise: the digit, which is the
/// noise of the reading at least, may not enlarge the walk.
#[test]
fn the_last_digit_enlarges_no_drift() {
    let units = units();
    let mut noise = Noise(8);
    // 0.2 mV over the root of Σ(x − x̄)² = 70 N² m².
    let plain = 2e-4 / 70.0_f64.sqrt();
    for _ in 0..100 {
        let row = |k: usize| {
            let load = 2.0 * k as f64;
            let reading = 0.01 + 0.1 * load + 2e-4 * noise.normal();
            point(load, (reading * 1e6).round() / 1e6, 0)
        };
        let points: Vec<Point> = (0..6).map(row).collect();
        let found = identify(&points, 1, &units).unwrap();
        let std = of(&found, "sensitivity").std().unwrap();
        assert!(std < 10.0 * plain, "{std} is much more than {plain}");
    }
}

/// 0.05 mV from row to row, beside 8 mV at the largest load; without it, nothing is said.
#[test]
fn a_zero_that_drifts_is_said() {
    for (drift, is_said) in [(5e-5, true), (0.0, false)] {
        let mut noise = Noise(5);
        let loads = [0.0, 5.0, 10.0, 15.0, 20.0, 15.0, 10.0, 5.0, 0.0].repeat(3);
        let mut row = |(i, load): (usize, &f64)| {
            let reading = 1e-4 + 4e-4 * load + drift * i as f64 + 1e-6 * noise.normal();
            format!("{load},{reading:.7}\n")
        };
        let rows: String = loads.iter().enumerate().map(&mut row).collect();
        let folder = Folder::new();
        folder.write("loads.csv", format!("load (N m),reading (V)\n{rows}"));
        let args = "identify static loads.csv --load load --reading reading";
        let ran = folder.run(&args.split(' ').collect::<Vec<_>>());
        assert_eq!(
            ran.stderr
                .contains("[zero-drifts]: the zero reading drifted from 0.00009"),
            is_said,
            "{}",
            ran.stderr
        );
    }
}

/// The square of such a reading overflows, and with it every residual.
#[test]
fn a_reading_beyond_all_instruments_is_refused() {
    let folder = Folder::new();
    folder.write(
        "loads.csv",
        "load (N m),reading (V)\n0,0.01\n2,-1e308\n4,0.4\n6,0.6\n0,0.01\n",
    );
    let args = ["identify", "static", "loads.csv"];
    let columns = ["--load", "load", "--reading", "reading"];
    folder
        .run(&[&args[..], &columns].concat())
        .says(1, &["sample 2", "\"reading\"", "-1e308"]);
}

/// Loads of both signs, readings without sign: nothing correlates, and no stand file is written.
#[test]
fn readings_that_do_not_follow_the_load_are_refused() {
    let folder = Folder::new();
    let loads = [0.0, 10.0, 20.0, 10.0, 0.0, -10.0, -20.0, -10.0, 0.0];
    for (file, without) in [("readings.csv", 0), ("loads.csv", 1)] {
        let rows: Vec<String> = loads
            .iter()
            .enumerate()
            .map(|(i, load)| {
                let reading = 0.04 * load + 1e-4 * (i as f64).sin();
                match without {
                    0 => format!("{load},{:.5}", reading.abs()),
                    _ => format!("{},{reading:.5}", load.abs()),
                }
            })
            .collect();
        folder.write(
            file,
            format!("load (N m),reading (mV/V)\n{}\n", rows.join("\n")),
        );
        let args = [
            "identify",
            "static",
            file,
            "--load",
            "load",
            "--reading",
            "reading",
        ];
        folder
            .run(&[&args[..], &["-o", "new.toml"]].concat())
            .says(1, &["does not follow the load", "minus sign"]);
    }
}

/// Loops of a data logger at every tenth of the load, read five times each: series, mountings and hysteresis.
fn logged(rows: usize, noise: &mut Noise) -> Vec<Point> {
    let point = |i: usize| {
        let series = i / 100;
        let step = (i % 100 / 5) as f64;
        let part = 1.0 - (step - 10.0).abs() / 10.0;
        let hysteresis = 0.01 * part * (1.0 - part) * (10.0 - step).signum();
        let zero = 0.01 * (series % 7) as f64;
        Point {
            load: 100.0 * part,
            reading: 0.1 + zero + 2.0 * part - hysteresis + 1e-3 * noise.normal(),
            std: None,
            series,
            position: series / 2,
        }
    };
    (0..rows).map(point).collect()
}

/// Ten times the rows, with ten times the series, take about ten times as long, not a hundred or a thousand times.
#[test]
fn time_grows_in_proportion_to_the_rows() {
    let units = units();
    let mut noise = Noise(5);
    let tables = [2_000, 20_000].map(|rows| logged(rows, &mut noise));
    let seconds = |points: &[Point], times: usize| {
        let start = Instant::now();
        for _ in 0..times {
            let found = identify(points, 1, &units).unwrap();
            assert_close(of(&found, "sensitivity").value(), 0.02, 1e-3);
        }
        start.elapsed().as_secs_f64()
    };
    // The same number of rows for both, so that other load on the machine affects both alike.
    let (small, large) = (seconds(&tables[0], 10), seconds(&tables[1], 1));
    println!("10 times 2,000 rows {small:.3} s, 20,000 rows {large:.3} s");
    assert!(large < 8.0 * small, "{small} s, {large} s");
}

/// Readings repeated at a load belong to the direction in which it was reached, as does a load that scatters.
#[test]
fn the_hysteresis_of_repeated_readings_is_found() {
    let units = units();
    let mut noise = Noise(6);
    let mut points = logged(200, &mut noise);
    for point in &mut points {
        point.load += 0.01 * noise.normal();
    }
    let found = identify(&points, 1, &units).unwrap();
    let hysteresis = found.terms.iter().find(|t| t.name == "hysteresis");
    // At a tenth of the load: 2 · 0.01 · 0.1 · 0.9 V over 0.2 V; less at the others.
    let percent = hysteresis.unwrap().percent.unwrap();
    assert!((percent - 0.9).abs() < 0.4, "{percent} %");
}

/// 25 N m in five steps and back, 0.02 V/(N m) about 0.1 V, so many rows at each load; what is added to a row by its place
/// among them, as part of the last step.
fn staircase(rows: usize, lag: impl Fn(usize) -> f64, noise: &mut Noise) -> Vec<Point> {
    let loads = [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 20.0, 15.0, 10.0, 5.0, 0.0];
    let mut points = Vec::new();
    for (step, load) in loads.iter().enumerate() {
        let before = if step == 0 { *load } else { loads[step - 1] };
        for row in 0..rows {
            let shown = load + (before - load) * lag(row);
            points.push(point(*load, 0.1 + 0.02 * shown + 5e-4 * noise.normal(), 0));
        }
    }
    points
}

#[test]
fn readings_that_still_settle_are_left_out() {
    let units = units();
    let mut noise = Noise(22);
    let settling = |row: usize| (-0.2 * row as f64).exp();
    for (is_settling, rows) in [(true, 200), (true, 60), (false, 200), (false, 4)] {
        let lag = |row: usize| if is_settling { settling(row) } else { 0.0 };
        let found = identify(&staircase(rows, lag, &mut noise), 1, &units).unwrap();
        let slope = of(&found, "sensitivity");
        let (value, std) = (slope.value(), slope.std().unwrap());
        let codes: Vec<&str> = found.warnings.iter().map(|w| w.code).collect();
        assert_eq!(
            codes.contains(&"unsettled-left-out"),
            is_settling,
            "{rows}: {codes:?}"
        );
        assert!(!codes.contains(&"not-linear"), "{rows}: {codes:?}");
        assert!(
            (value - 0.02).abs() < 4.0 * std && std < 2e-4,
            "{rows}: {value} ± {std}"
        );
    }
}

#[test]
fn a_sorted_table_shows_no_drift() {
    let units = units();
    let mut noise = Noise(23);
    for _ in 0..20 {
        let mut points = staircase(3, |_| 0.0, &mut noise);
        points.sort_by(|a, b| {
            (a.load, a.reading)
                .partial_cmp(&(b.load, b.reading))
                .unwrap()
        });
        let found = identify(&points, 1, &units).unwrap();
        let slope = of(&found, "sensitivity");
        let (value, std) = (slope.value(), slope.std().unwrap());
        let codes: Vec<&str> = found.warnings.iter().map(|w| w.code).collect();
        assert!(
            codes.contains(&"rows-sorted") && !codes.contains(&"not-linear"),
            "{codes:?}"
        );
        // 0.5 mV over √Σ(x − x̄)² = 47 N m.
        assert!(
            (value - 0.02).abs() < 4.0 * std && std < 3e-5,
            "{value} ± {std}"
        );
    }
}

/// Readings of two decimals repeat exactly; their rounding is no curve.
#[test]
fn rounding_is_no_curve() {
    let units = units();
    let mut points = staircase(3, |_| 0.0, &mut Noise(24));
    for point in &mut points {
        point.reading = ((0.1 + 0.0196 * point.load) * 100.0).round() / 100.0;
    }
    let found = identify(&points, 1, &units).unwrap();
    assert!(
        found.warnings.iter().all(|w| w.code != "not-linear"),
        "{:?}",
        found.warnings
    );
}

/// A lens of 1 % between loading and unloading, closed at both ends.
#[test]
fn a_zero_that_the_curve_misses_is_uncertain_by_that() {
    let units = units();
    let mut noise = Noise(25);
    for lens in [0.0, 5e-4, 5e-3] {
        let (mut points, mut outside) = (Vec::new(), 0);
        for trial in 0..10 {
            points.clear();
            for series in 0..3 {
                let shape = |k: usize| {
                    let load = 5.0 * if k < 6 { k as f64 } else { 10.0 - k as f64 };
                    let part = load / 25.0;
                    let side = if k < 6 { 0.0 } else { 1.0 };
                    (load, 0.5 * lens * side * 4.0 * part * (1.0 - part))
                };
                points.extend((0..11).map(shape).map(|(load, more)| {
                    let reading = 0.1 + 0.02 * load + more + 1e-4 * noise.normal();
                    point(load, reading, series)
                }));
            }
            let found = identify(&points, 1, &units).unwrap();
            let zero = of(&found, "zero");
            let is_outside = (zero.value() - 0.1).abs() > 3.0 * zero.std().unwrap();
            outside += usize::from(is_outside);
            assert!(
                outside <= 1,
                "{lens}, {trial}: {} ± {:?}",
                zero.value(),
                zero.std()
            );
        }
    }
}

#[test]
fn blank_lines_between_series_are_no_rows() {
    let folder = Folder::new();
    let series = "0,0.1000\n5,0.2001\n10,0.2999\n5,0.2002\n0,0.1001\n";
    let heading = "load (N m),reading (V)\n";
    folder.write("plain.csv", format!("{heading}{series}{series}"));
    folder.write("blank.csv", format!("{heading}{series}\n{series}"));
    folder.write("ol.csv", format!("{heading}{series}5,OL\n{series}"));
    let of = |name: &str| {
        let args = ["identify", "static", name, "--load", "load", "--reading"];
        folder.run(&[&args[..], &["reading"]].concat())
    };
    let [plain, blank] = ["plain.csv", "blank.csv"].map(of);
    assert_eq!(plain.code, 0, "{}", plain.stderr);
    let constants = |text: &str| {
        text.lines()
            .skip(1)
            .take(9)
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    assert_eq!(
        constants(&plain.stdout),
        constants(&blank.stdout),
        "{}",
        blank.stderr
    );
    of("ol.csv").says(1, &["line 7", "correct or delete the row"]);
}

/// Readings at 10 Hz behind a first-order lag of a time constant in s, as loads are put on one after the other for 8 s, with
/// noise of 1e-3 V.
fn lagging(loads: &[f64], time_constant_s: f64, noise: &mut Noise) -> Vec<Point> {
    let mut shown = 0.3;
    let mut points = Vec::new();
    for load in loads {
        for _ in 0..80 {
            let settled = 0.3 + 0.1 * load;
            shown = settled + (shown - settled) * (-0.1 / time_constant_s).exp();
            points.push(point(*load, shown + 1e-3 * noise.normal(), 0));
        }
    }
    points
}

/// The lag is neither in the sensitivity nor a curve, and the uncertainty allows for the extrapolation: after 8 s, 7 % of a
/// change are missing with 3 s.
#[test]
fn readings_that_never_settle_give_the_settled_sensitivity() {
    let units = units();
    let mut noise = Noise(51);
    let loads = [
        0.0, 20.0, 40.0, 60.0, 80.0, 100.0, 80.0, 60.0, 40.0, 20.0, 0.0,
    ];
    for (time_constant_s, is_short) in [(1.0, false), (3.0, true)] {
        let mut coverage = Coverage::default();
        for _ in 0..100 {
            let points = lagging(&loads, time_constant_s, &mut noise);
            let found = identify(&points, 1, &units).unwrap();
            let slope = of(&found, "sensitivity");
            coverage.count(slope, 0.1);
            assert!((slope.value() / 0.1 - 1.0).abs() < 2e-4, "{slope:?}");
            let codes: Vec<&str> = found.warnings.iter().map(|w| w.code).collect();
            assert!(codes.contains(&"unsettled-left-out"), "{codes:?}");
            assert_eq!(codes.contains(&"still-settling"), is_short, "{codes:?}");
            assert!(!codes.contains(&"not-linear"), "{codes:?}");
        }
        // More than 95 %, as the rows of eleven loads determine one time constant.
        coverage.at_least(92, "sensitivities");
    }
}

/// With two time constants, 1 and 4 s, one exponential fits the late rows only: the uncertainty includes the rest.
#[test]
fn readings_that_settle_twice_are_uncertain() {
    let units = units();
    let mut noise = Noise(52);
    let loads = [
        0.0, 20.0, 40.0, 60.0, 80.0, 100.0, 80.0, 60.0, 40.0, 20.0, 0.0,
    ];
    let [fast, slow] = [1.0, 4.0].map(|time_s| lagging(&loads, time_s, &mut noise));
    let both = fast.iter().zip(&slow).map(|(fast, slow)| {
        let reading = 0.6 * fast.reading + 0.4 * slow.reading;
        point(fast.load, reading, 0)
    });
    let found = identify(&both.collect::<Vec<_>>(), 1, &units).unwrap();
    let slope = of(&found, "sensitivity");
    let (value, std) = (slope.value(), slope.std().unwrap());
    assert!(
        (value - 0.1).abs() < 3.0 * std && std < 1e-3,
        "{value} ± {std}"
    );
    assert!(found.warnings.iter().any(|w| w.code == "still-settling"));
}

/// A slow ramp up and down: the stand's friction of 0.2 % of the range, built up over 4 % of it after each reversal (a
/// spring in series with a slider), or a lens of 1 % that closes at both ends.
#[test]
fn hysteresis_of_a_ramp_does_not_bias_the_sensitivity() {
    let units = units();
    let mut noise = Noise(53);
    for is_lens in [false, true] {
        for (rows, cycles) in [(200, 1), (2000, 1), (2000, 3)] {
            let (mut points, mut slider, mut before) = (Vec::new(), 0.0_f64, 0.0);
            for i in 0..=rows * cycles {
                let phase = (i % rows) as f64 / rows as f64;
                let part = 1.0 - (2.0 * phase - 1.0).abs();
                slider = (slider + 0.05 * (part - before)).clamp(-0.002, 0.002);
                before = part;
                let lens = 0.04 * part * (1.0 - part) * (0.5 - phase).signum();
                let lag = if is_lens { lens } else { slider };
                let reading = 0.3 + 10.0 * (part - lag) + 1e-3 * noise.normal();
                points.push(point(100.0 * part, reading, 0));
            }
            let loads: Vec<f64> = points.iter().map(|p| p.load).collect();
            for (point, series) in points.iter_mut().zip(series_of(&loads)) {
                point.series = series;
            }
            let found = identify(&points, 1, &units).unwrap();
            let slope = of(&found, "sensitivity");
            let (value, std) = (slope.value(), slope.std().unwrap());
            let what = format!("{is_lens}, {rows} rows, {cycles} cycles: {value} ± {std}");
            // The slider takes up 0.4 % of the reading at its ends, which a straight line through all rows shares out.
            assert!((value / 0.1 - 1.0).abs() < 1.5e-3, "{what}");
            assert!((value - 0.1).abs() < 2.5 * std, "{what}");
        }
    }
}

/// Seven loads of a hundred rows each, applied over three rows, with a reference cell whose noise is 0.07 to 5 % of the
/// largest. With the rows taken singly, the sensitivity had been half of what it is.
#[test]
fn noise_of_a_measured_load_does_not_bias_the_sensitivity() {
    let units = units();
    let mut noise = Noise(54);
    let steps = [0.0, 10.0, 20.0, 30.0, 20.0, 10.0, 0.0];
    for cell in [0.02, 0.1, 1.0, 1.5] {
        let mut coverage = Coverage::default();
        for table in 0..100 {
            // In every second table the reading settles within five rows.
            let time_constant = if table % 2 == 0 { 0.1 } else { 5.0 };
            let (mut points, mut load, mut reading) = (Vec::new(), 0.0, 0.0);
            for step in steps {
                let change = step - load;
                for row in 0..103 {
                    load = step - change * (0.75 - 0.25 * f64::from(row)).max(0.0);
                    reading += (0.1 * load - reading) * (1.0 - f64::exp(-1.0 / time_constant));
                    let measured = load + cell * noise.normal();
                    points.push(point(measured, 0.02 + reading + 1e-3 * noise.normal(), 0));
                }
            }
            let loads: Vec<f64> = points.iter().map(|p| p.load).collect();
            for (point, series) in points.iter_mut().zip(series_of(&loads)) {
                point.series = series;
            }
            let found = identify(&points, 1, &units).unwrap();
            assert!(
                !found
                    .warnings
                    .iter()
                    .any(|w| w.code == "not-linear" || w.code == "poor-fit"),
                "{cell}: {:?}",
                found.warnings
            );
            coverage.count(of(&found, "sensitivity"), 0.1);
        }
        coverage.at_least(92, &format!("noise of {cell} N m"));
    }
}

/// Loads entered up to 4 s late, of 10 s: the readings of most rows are right, and had been refused from 17 % on.
#[test]
fn loads_entered_late_are_left_out() {
    let units = units();
    let loads = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.0];
    for late in [75, 100, 150, 200] {
        let mut noise = Noise(late as u64);
        let row = |i: usize| {
            let entered = loads[i.saturating_sub(late) / 500];
            point(
                entered,
                0.013 + 0.08 * loads[i / 500] + 3e-4 * noise.normal(),
                0,
            )
        };
        let points: Vec<Point> = (0..5500).map(row).collect();
        let found = identify(&points, 1, &units).unwrap();
        let slope = of(&found, "sensitivity");
        let off = (slope.value() - 0.08).abs() / slope.std().unwrap();
        let codes: Vec<&str> = found.warnings.iter().map(|w| w.code).collect();
        assert!(codes.contains(&"unsettled-left-out"), "{late}: {codes:?}");
        assert!(off < 4.0, "{late}: {} ± {:?}", slope.value(), slope.std());
    }
}

/// Rows of a load and its reading, up and down twice.
fn up_and_down(heading: &str, reading: impl Fn(f64) -> f64, mistyped: Option<usize>) -> Folder {
    let mut noise = Noise(29);
    let series = [
        0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 40.0, 30.0, 20.0, 10.0, 0.0,
    ];
    let loads: Vec<f64> = [series, series].concat();
    let row = |(i, load): (usize, &f64)| {
        let written = if mistyped == Some(i) {
            load - 10.0
        } else {
            *load
        };
        format!("{written},{:.6}\n", reading(*load) + 3e-4 * noise.normal())
    };
    let rows: String = loads.iter().enumerate().map(row).collect();
    let folder = Folder::new();
    folder.write("loads.csv", format!("{heading}\n{rows}"));
    folder
}

const STATIC: [&str; 7] = [
    "identify",
    "static",
    "loads.csv",
    "--load",
    "1",
    "--reading",
    "2",
];

#[test]
fn a_mistyped_load_is_named_by_its_row() {
    for (mistyped, said) in [
        (Some(3), Some("row 4, load 20 N m")),
        (Some(15), Some("row 16, ")),
        (None, None),
    ] {
        let folder = up_and_down(
            "torque [N m],bridge [V]",
            |load| 0.05 + 0.08 * load,
            mistyped,
        );
        let report = folder.json(&[&STATIC[..], &["--json"]].concat());
        let warnings = report["warnings"].to_string();
        assert_eq!(
            warnings.contains("row-off-line"),
            said.is_some(),
            "{warnings}"
        );
        assert!(
            said.is_none_or(|said| warnings.contains(said)),
            "{warnings}"
        );
        assert!(!warnings.contains("degree 3"), "{warnings}");
    }
}

/// A curved characteristic has no single row that is off.
#[test]
fn no_row_of_a_curve_is_off() {
    let curve = |load: f64| 0.08 * load + 1e-5 * load.powi(3);
    let folder = up_and_down("torque [N m],bridge [V]", curve, None);
    let report = folder.json(&[&STATIC[..], &["--json"]].concat());
    assert!(
        !report["warnings"].to_string().contains("row-off-line"),
        "{report}"
    );
}

/// A load cell of 12.5 N/V: what `identify static` writes is what `compensate` takes, and the inverse is named.
#[test]
fn a_load_cell_gets_its_static_gain() {
    let folder = up_and_down("force [N],cell [V]", |load| 0.05 + 0.08 * load, None);
    let mechanics = "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"60 Hz\"\n\
        damping_ratio = 0.02\n";
    folder.write("stand.toml", mechanics);
    folder
        .run(&[&STATIC[..], &["-o", "stand.toml"]].concat())
        .says(0, &[]);
    let written = folder.read("stand.toml");
    assert!(
        written.contains("static_gain = { value = \"0.0"),
        "{written}"
    );
    let volts = |i: usize| 0.05 + 0.08 * (7.0 + (i as f64 * 0.05).sin());
    folder.write(
        "in.csv",
        crate::util::sampled("cell [V]", 1000.0, 2000, volts),
    );
    let report = folder.json(&[&crate::util::COMPENSATE[..], &["--json"]].concat());
    assert_close(
        report["result"]["mean"].as_f64().expect("a number"),
        7.0,
        1e-2,
    );
    folder.write(
        "stand.toml",
        format!("{mechanics}static_gain = \"12.5 N/V\"\n"),
    );
    let ran = folder.run(&[&crate::util::COMPENSATE[..], &["--force"]].concat());
    ran.says(1, &["static_gain = \"0.08 V/N\""]);
    // A curve, and a stand that converts to torque, have no static gain.
    let curve = ["--degree", "3", "-o", "new.toml"];
    folder
        .run(&[&STATIC[..], &curve].concat())
        .says(1, &["static_gain"]);
    let calibrated = format!("{mechanics}[calibration]\ntorque_per_volt = \"12.5 N m/V\"\n");
    folder.write("stand.toml", calibrated);
    folder
        .run(&[&STATIC[..], &["-o", "stand.toml"]].concat())
        .says(1, &["calibration"]);
}

/// Counts of a converter are calibrated as volts.
#[test]
fn counts_are_no_unit_and_no_pounds() {
    let counts = |load: f64| (84_213.0 + 4e3 * load).round();
    let folder = up_and_down("torque [N m],raw", counts, None);
    for unit in ["counts", "count", "LSB", "digits", "bits", "ADC"] {
        let ran = folder.run(&[&STATIC[..], &["--reading-unit", unit]].concat());
        assert!(!ran.stderr.contains("did you mean"), "{}", ran.stderr);
        ran.says(2, &["one count 1 V"]);
    }
}

/// A load ten times too large hides the line, but not from the other rows.
#[test]
fn a_load_mistyped_by_a_decade_is_named_by_its_row() {
    let loads = [
        0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0,
    ];
    let mut noise = Noise(3);
    let row = |(i, load): (usize, &i32)| {
        let written = if i == 4 { 40 } else { *load };
        let reading = 0.05 + 0.2 * f64::from(*load) + 1e-4 * noise.normal();
        format!("{written},{reading:.6}\n")
    };
    let rows: String = loads.iter().enumerate().map(row).collect();
    let folder = Folder::new();
    folder.write("loads.csv", format!("torque [N m],bridge [V]\n{rows}"));
    let run = folder.run(&STATIC);
    assert!(run.stderr.contains("row 5, load 40 N m"), "{}", run.stderr);
    assert!(!run.stderr.contains("the right ones"), "{}", run.stderr);
}

/// A slip in the arm, seen from the calibration in the stand file and its rated torque.
#[test]
fn a_calibration_far_from_that_of_the_stand_file_is_said() {
    let reading = |load: f64| 0.05 + 0.08 * load;
    let folder = up_and_down("force [N],bridge [V]", reading, None);
    let stand = "schema = \"torqcomp.stand/1\"\n[calibration]\ntorque_per_volt = \"3.125 N m/V\"\n\
                 rated_torque = \"10 N m\"\n";
    for (radius, codes) in [
        ("250 mm", &[][..]),
        ("250 cm", &["calibration-differs", "beyond-rated-torque"]),
    ] {
        folder.write("stand.toml", stand);
        let more = ["--radius", radius, "-o", "stand.toml", "--json"];
        let report = folder.json(&[&STATIC[..], &more, &["--force"]].concat());
        for code in ["calibration-differs", "beyond-rated-torque"] {
            let is_said = crate::util::codes(&report).contains(&code);
            assert_eq!(is_said, codes.contains(&code), "{radius}: {report}");
        }
    }
}

/// Units of torque with a mass, as on data sheets of small motors.
#[test]
fn torques_in_masses_are_asked_about() {
    let reading = |load: f64| 0.05 + 0.08 * load;
    for (unit, said) in [
        ("kg cm", "--load-unit \"kgf cm\""),
        ("kgcm", "kgf cm"),
        ("counts", "scale those of an encoder to an angle"),
    ] {
        let folder = up_and_down(&format!("torque [{unit}],bridge [V]"), reading, None);
        let run = folder.run(&STATIC);
        assert_ne!(run.code, 0, "{unit}");
        assert!(run.stderr.contains(said), "{unit}: {}", run.stderr);
    }
}

/// Three series of eleven rows, of which each has its sensitivity; readings in mV/V with noise.
fn three_series(noise: &mut Noise, scatter: f64, at_largest: f64) -> Vec<Point> {
    let mut points = Vec::new();
    for series in 0..3 {
        let sensitivity = 0.04 * (1.0 + scatter * noise.normal());
        points.extend((0..11_i32).map(|k| {
            let load = 10.0 * f64::from(5 - (k - 5).abs());
            let off = if k == 5 { at_largest } else { 0.0 };
            point(
                load,
                0.01 + sensitivity * load + off + 1e-4 * noise.normal(),
                series,
            )
        }));
    }
    points
}

#[test]
fn series_that_differ_in_sensitivity_widen_its_uncertainty() {
    let units = units();
    let mut noise = Noise(41);
    let mut covered = [Coverage::default(), Coverage::default()];
    for (scatter, coverage) in [0.0, 1e-3].into_iter().zip(&mut covered) {
        for _ in 0..60 {
            let found = identify(&three_series(&mut noise, scatter, 0.0), 1, &units).unwrap();
            coverage.count(of(&found, "sensitivity"), 0.04);
        }
    }
    covered[0].at_least(55, "series alike");
    covered[1].at_least(52, "series apart");
}

/// The amplifier is at its limit at the largest load: 0.25 % of the deflection are missing there.
#[test]
fn one_load_off_the_line_is_said() {
    let warned = |off: f64| {
        let points = three_series(&mut Noise(42), 0.0, off);
        let found = identify(&points, 1, &units()).unwrap();
        found.warnings.iter().any(|w| w.code == "not-linear")
    };
    assert!(warned(-0.005) && !warned(0.0));
}

/// Loads in kg, up and down in each series, read to a last digit.
fn displayed(series: usize, digit: f64, (gain, zero): (f64, f64)) -> Vec<Point> {
    let loads = [0.0, 0.2, 0.5, 1.0, 2.0, 1.0, 0.5, 0.2];
    let rows = loads.iter().cycle().take(series * loads.len() + 1);
    let read = |load: &f64| ((zero + gain * load) / digit).round() * digit;
    let points = rows.enumerate();
    let points = points.map(|(i, load)| point(*load, read(load), i.saturating_sub(1) / 8));
    points.collect()
}

/// The same rounding error in every series does not average out.
#[test]
fn rounding_that_repeats_stays_in_the_uncertainty() {
    let units = units();
    let mut noise = Noise(41);
    for series in [1, 3, 5] {
        let mut coverage = Coverage::default();
        for _ in 0..100 {
            let (gain, zero) = (0.2 + 0.05 * noise.uniform(), 0.05 * noise.uniform());
            let found = identify(&displayed(series, 1e-3, (gain, zero)), 1, &units).unwrap();
            let codes: Vec<&str> = found.warnings.iter().map(|w| w.code).collect();
            assert!(!codes.contains(&"row-off-line"), "{series}: {codes:?}");
            coverage.count(of(&found, "sensitivity"), gain);
        }
        coverage.at_least(88, &format!("{series} series"));
    }
}

/// Two digits after the point: deviations of up to one last digit are no second range of an amplifier.
#[test]
fn one_last_digit_is_no_jump_of_the_sensitivity() {
    let mut noise = Noise(42);
    for _ in 0..200 {
        let truth = (0.16 + 0.08 * noise.uniform(), 0.05 * noise.uniform());
        let found = identify(&displayed(1, 1e-2, truth), 1, &units());
        assert!(found.is_ok(), "{truth:?}: {found:?}");
    }
}

/// Every row of a logger shows the same digits at each load.
#[test]
fn constant_readings_are_steady() {
    let loads = [0.0, 0.5, 1.0, 2.0, 1.0, 0.5, 0.0];
    let rows = loads.iter().flat_map(|load| [*load; 200]);
    let reading = |load: f64| (13.0 + 196.0 * load).round() / 1e3;
    let points: Vec<Point> = rows.map(|load| point(load, reading(load), 0)).collect();
    let found = identify(&points, 1, &units()).unwrap();
    let codes: Vec<&str> = found.warnings.iter().map(|w| w.code).collect();
    assert!(!codes.contains(&"unsettled-left-out"), "{codes:?}");
}

/// A load that is written in the first row of its step only, at equal or other distances, with a column of time or not.
#[test]
fn a_load_written_once_for_each_step_is_held() {
    let folder = Folder::new();
    let command = "identify static in.csv --load load --reading bridge";
    let command: Vec<&str> = command.split(' ').collect();
    for (uneven, is_timed) in [(0, false), (0, true), (1, false), (1, true)] {
        let mut text = if is_timed { "time_s," } else { "" }.to_owned() + "load_Nm,bridge_V\n";
        let mut row = 0;
        for (step, load) in [0, 5, 10, 15, 20, 10, 0].into_iter().enumerate() {
            for k in 0..5 + uneven * (step % 3) {
                let written = if k == 0 {
                    load.to_string()
                } else {
                    String::new()
                };
                let time = if is_timed {
                    format!("{row},")
                } else {
                    String::new()
                };
                let noise = 1e-4 * f64::from(row * 7 % 5 - 2);
                let reading = 0.1 + 0.05 * f64::from(load) + noise;
                text += &format!("{time}{written},{reading:.4}\n");
                row += 1;
            }
        }
        folder.write("in.csv", &text);
        let rows = format!(
            "\"load\" is empty in {} of {row} rows, first in line 3",
            row - 7
        );
        folder.run(&command).says(1, &[&rows, "--fill hold"]);
        let report = folder.json(&[&command[..], &["--fill", "hold", "--json"]].concat());
        assert_eq!(report["samples"], row);
        let (value, std, _) = parameter(&report, "torque_per_volt");
        assert!((value - 20.0).abs() < 3.0 * std.unwrap() + 1e-9, "{value}");
        assert!(report.to_string().contains("filled"), "{report}");
    }
    folder.write("in.csv", "load_Nm,bridge_V\n0,0\n5,1\n10,\n5,1\n0,\n");
    folder
        .run(&command)
        .says(1, &["\"bridge\" ends after 4 rows"]);
}

/// The gain of the amplifier was changed between two series.
#[test]
fn series_of_different_gain_are_refused_with_both() {
    let folder = Folder::new();
    let series = |gain: f64, zero: f64| {
        let row = |(k, load): (i32, &i32)| {
            let noise = 1e-4 * f64::from(k * 7 % 5 - 2);
            format!("{load},{:.4}\n", zero + gain * f64::from(*load) + noise)
        };
        let loads = [0, 5, 10, 15, 20, 15, 10, 5, 0];
        (0..).zip(&loads).map(row).collect::<String>()
    };
    let run = |rows: &[String]| {
        folder.write("in.csv", format!("load_Nm,bridge_V\n{}", rows.concat()));
        let command = "identify static in.csv --load load --reading bridge";
        folder.run(&command.split(' ').collect::<Vec<_>>())
    };
    let first = series(0.05, 0.1);
    run(&[first.clone(), series(0.1, 0.1)]).says(
        1,
        &["0.04999 V/(N m) in series 1", "0.09999 V/(N m) in series 2"],
    );
    let third = series(0.1, 0.2);
    run(&[first.clone(), first.clone(), third])
        .says(1, &["changes from one series to another", "in series 3"]);
    run(&[first.clone(), series(0.0502, 0.1)]).says(0, &[]);
    run(&[first.clone(), first]).says(0, &[]);
}
