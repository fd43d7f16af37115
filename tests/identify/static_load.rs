//! Known loads.

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

/// Three series of eleven loads up and ten down; readings 0.02 V + 0.1 V/(N m) times the load, noise so
/// many decibels below the largest, of one size or growing with the load (and then known).
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
    let units = LoadUnits {
        load: "N m".to_owned(),
        reading: "V".to_owned(),
    };
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
