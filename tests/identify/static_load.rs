//! Known loads.

use super::parameter;
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

