//! Stated uncertainty of results: from the calibration, the response, nonlinear effects, and none if the stand file
//! gives none. And torques beyond the rating of the transducer.

use std::f64::consts::TAU;

use serde_json::Value;

use crate::reports::highest;
use crate::util::{COMPENSATE, Folder, HARMONICS, assert_close};

const MECHANICS: &str = "schema = \"torqcomp.stand/1\"\n[mechanics]\n\
    natural_frequency = { value = \"590 Hz\", std = \"2 Hz\" }\ndamping_ratio = \"0.02\"\n";

/// `2 + cos` of 20 Hz, 2 s at 2 kHz.
fn record(heading: &str) -> String {
    let row = |i: i32| {
        let t = f64::from(i) / 2000.0;
        format!("{t:.4},{:.9}\n", 2.0 + (TAU * 20.0 * t).cos())
    };
    format!(
        "time_s,{heading}\n{}",
        (0..4000).map(row).collect::<String>()
    )
}

fn folder(heading: &str, more: &str) -> Folder {
    let folder = Folder::new();
    folder.write("in.csv", record(heading));
    folder.write("stand.toml", format!("{MECHANICS}{more}"));
    folder
}

/// The arguments of both commands.
fn verbs() -> [Vec<&'static str>; 2] {
    let harmonics = [&HARMONICS[..], &["20", "--orders", "1"]].concat();
    [COMPENSATE.to_vec(), harmonics]
}

fn both(folder: &Folder) -> [Value; 2] {
    verbs().map(|args| {
        folder.json(
            &[
                &args[..],
                &["--json", "--force"][..1 + usize::from(args.len() == 6)],
            ]
            .concat(),
        )
    })
}

/// `s = f/f_n`: the inverse response is `1 − s²` except for the damping, so that 2 of 590 Hz change it by
/// `2 s² δ/(1 − s²)`.
fn of_response(frequency_hz: f64) -> f64 {
    let square = (frequency_hz / 590.0).powi(2);
    2.0 * square * (2.0 / 590.0) / (1.0 - square)
}

#[test]
fn a_calibration_without_std_makes_the_uncertainty_unknown() {
    let folder = folder("U [V]", "[calibration]\ntorque_per_volt = \"12.5 N m/V\"\n");
    let [compensated, harmonics] = both(&folder);
    let points = compensated["noise"]["gain"].as_array().unwrap();
    assert!(points.iter().all(|p| p["relative_std"].is_null()));
    assert!(points[0]["response_relative_std"].is_null());
    let at = points[1]["frequency_hz"].as_f64().unwrap();
    assert_close(
        points[1]["response_relative_std"].as_f64().unwrap(),
        of_response(at),
        1e-2,
    );
    assert!(compensated["calibration_relative_std"].is_null());
    let first = &harmonics["components"][0];
    assert!(first["std_stand"].is_null() && harmonics["calibration_relative_std"].is_null());
    let relative = first["std_response"].as_f64().unwrap() / first["torque"].as_f64().unwrap();
    assert_close(relative, of_response(20.0), 1e-2);
    for args in verbs() {
        let ran = folder.run(&[&args[..], &["--force"][..usize::from(args.len() == 6)]].concat());
        let said = ran.stdout + &ran.stderr;
        assert!(
            said.contains("unknown") && said.contains("the calibration has no std"),
            "{said}"
        );
        assert!(
            !said.contains("± 0 ") && !said.contains("± stand"),
            "{said}"
        );
    }
}

#[test]
fn calibration_and_response_are_stated_together() {
    let folder = folder(
        "U [V]",
        "[calibration]\ntorque_per_volt = { value = \"12.5 N m/V\", std = \"0.025 N m/V\" }\n",
    );
    let [compensated, harmonics] = both(&folder);
    for point in compensated["noise"]["gain"]
        .as_array()
        .unwrap()
        .iter()
        .take(4)
    {
        let want = 0.002_f64.hypot(of_response(point["frequency_hz"].as_f64().unwrap()));
        assert_close(point["relative_std"].as_f64().unwrap(), want, 1e-2);
    }
    assert_close(
        harmonics["calibration_relative_std"].as_f64().unwrap(),
        0.002,
        1e-9,
    );
}

/// `T = x + c x³` statically: with `x = 2 + cos` and a std of 1e-5 of `c` that is 1e-5 x³, at most 2.7e-4, and by the
/// moments of the cosine `⟨x⁶⟩ = 64 + 120 + 22.5 + 0.3125`. A calibration of ± 0.2 % adds 0.002 x (1 + 3 c x²).
#[test]
fn an_effect_that_bends_is_part_of_the_uncertainty() {
    let effect = "[[effects]]\nkind = \"cubic-stiffness\"\n\
        coefficient = { value = \"1e-4 1/(N m)^2\", std = \"1e-5 1/(N m)^2\" }\n";
    let stiff = MECHANICS.replace("590 Hz\", std = \"2 Hz", "590 Hz\", std = \"0.001 Hz");
    let folder = folder("T [N m]", "");
    folder.write("stand.toml", format!("{stiff}{effect}"));
    let report = folder.json(&[&COMPENSATE[..], &["--json", "--band", "200"]].concat());
    let found = &report["result_std"];
    assert_close(
        found["rms"].as_f64().unwrap(),
        1e-5 * 206.8125_f64.sqrt(),
        1e-2,
    );
    assert_close(found["largest"].as_f64().unwrap(), 2.7e-4, 1e-2);
    assert_eq!(found["bent"].as_array().unwrap().len(), 0);
    let calibration =
        "[calibration]\ntorque_per_volt = { value = \"1 N m/V\", std = \"0.002 N m/V\" }\n";
    folder.write("stand.toml", format!("{stiff}{calibration}{effect}"));
    folder.write("in.csv", record("U [V]"));
    let report = folder.json(&[&COMPENSATE[..], &["--json", "--band", "200", "--force"]].concat());
    let largest = report["result_std"]["largest"].as_f64().unwrap();
    assert_close(
        largest,
        2.7e-4_f64.hypot(0.002 * 3.0 * (1.0 + 3e-4 * 9.0)),
        1e-2,
    );
    assert_close(
        report["result_std"]["of_response_rms"].as_f64().unwrap(),
        1e-5 * 206.8125_f64.sqrt(),
        1e-2,
    );
}

/// A threshold that may be on the other side of zero is varied away from it only; the negative one had been a crash.
/// The stop: `T = y + 2 (y − g)` beyond `g`, none of it without the stop.
#[test]
fn a_threshold_less_certain_than_its_value_is_varied_to_one_side() {
    let stiff = MECHANICS.replace("590 Hz\", std = \"2 Hz", "590 Hz\", std = \"0.001 Hz");
    for (effect, of) in [
        (
            "end-stop\"\nform = \"both\"\nstiffness_ratio = 2\ngap",
            "gap of end-stop",
        ),
        ("backlash\"\nform = \"gap\"\ngap", "gap of backlash"),
        (
            "backlash\"\nform = \"soft-gap\"\nsoftening = 0.5\ngap",
            "gap of backlash",
        ),
        (
            "saturation\"\nform = \"hard\"\nlimit",
            "limit of saturation",
        ),
    ] {
        let folder = folder("T [N m]", "");
        let value = "{ value = \"2.5 N m\", std = \"4 N m\" }";
        folder.write(
            "stand.toml",
            format!("{stiff}[[effects]]\nkind = \"{effect} = {value}\n"),
        );
        let report = folder.json(&[&COMPENSATE[..], &["--json", "--band", "200"]].concat());
        let found = &report["result_std"];
        let bent = found["bent"].as_array().unwrap();
        let one_sided =
            bent.contains(&of.into()) || found["left_out"].as_array().unwrap().contains(&of.into());
        assert!(one_sided, "{effect}: {found}");
        if effect.contains("both") {
            // At most 2 (3 − 2.5), where the stop is not reached with the larger gap.
            assert_close(found["largest"].as_f64().unwrap(), 1.0, 0.05);
        }
    }
}

#[test]
fn a_torque_far_off_the_rated_one_is_warned_about() {
    let with_code = |code: &str, more: &str| -> Vec<bool> {
        let folder = folder("U [V]", more);
        let has = |report: &Value| {
            let all = report["warnings"].as_array().unwrap();
            all.iter().any(|w| w["code"] == code)
        };
        both(&folder).iter().map(has).collect()
    };
    let codes = |more: &str| with_code("beyond-rated-torque", more);
    // The record reaches 3 V: 37.5 N m.
    let of = |rated: &str| {
        format!("[calibration]\ntorque_per_volt = \"12.5 N m/V\"\nrated_torque = \"{rated}\"\n")
    };
    assert_eq!(codes(&of("24 N m")), [true, true]);
    assert_eq!(codes(&of("-26 N m")), [false, false]);
    let sheet = "[calibration]\nsensitivity = \"2 V\"\nrated_torque = \"20 N m\"\n";
    assert_eq!(codes(sheet), [false, false]);
    assert_eq!(codes(&sheet.replace("2 V", "200 mV")), [true, true]);
    // As for a record before the amplifier: 0.15 % of the rated torque.
    let below = |text: &str| with_code("below-rated-torque", &sheet.replace("2 V", text));
    assert_eq!(below("2000 V"), [true, true]);
    assert_eq!(below("400 V"), [false, false]);
}

/// Material damping is included in the stated gain, `|1 − s² + j (2 ζ s + η)|`, and so is the long range of its end
/// effects.
#[test]
fn a_loss_in_the_material_is_part_of_the_gain() {
    for loss_factor in [0.05, 0.5] {
        let effect =
            format!("[[effects]]\nkind = \"structural-damping\"\nloss_factor = {loss_factor}\n");
        let folder = folder("T [N m]", &effect);
        let more = ["--band", "600", "--json", "--force", "--html", "page.html"];
        let report = folder.json(&[&COMPENSATE[..], &more].concat());
        let points = report["noise"]["gain"].as_array().unwrap();
        assert!(points.len() > 2);
        let gain = |frequency_hz: f64| {
            let s = frequency_hz / 590.0;
            let loss = if s > 0.0 { loss_factor } else { 0.0 };
            (1.0 - s * s).hypot(2.0 * 0.02 * s + loss)
        };
        for point in points {
            let frequency_hz = point["frequency_hz"].as_f64().unwrap();
            assert_close(point["gain"].as_f64().unwrap(), gain(frequency_hz), 1e-6);
        }
        assert!(
            report["warnings"].to_string().contains("ends-felt-far"),
            "{report}"
        );
        let (x, shown) = highest(&folder.read("page.html"), "Torque per recorded", 0);
        assert_close(shown, gain(x), 2e-3);
    }
}

/// A series capacitor does not pass the mean of 2 N m.
#[test]
fn an_unknown_mean_is_said() {
    let coupled = "[calibration]\ntorque_per_volt = \"1 N m/V\"\n\
        [[effects]]\nkind = \"capacitive-coupling\"\nform = \"ac-coupled\"\ncorner = \"1 Hz\"\n";
    let folder = folder("U [V]", coupled);
    let ran = folder.run(&[&COMPENSATE[..], &["--band", "50"]].concat());
    ran.says(0, &["mean-unknown", "capacitive-coupling", "DC coupling"]);
    let part = ["--band", "50", "--force", "--range", "0.5..1.5"];
    let ran = folder.run(&[&COMPENSATE[..], &part].concat());
    ran.says(0, &["extend --range by that"]);
}
