//! `diagnose --static`: known loads in addition to free decays. The static response of the stand is solved here by
//! bisection, and in closed form for dry friction.

use serde_json::{Value, json};

use crate::decays::{NOISE, PLAIN, Stand, parameter};
use crate::noise::Noise;
use crate::util::{Folder, codes, number};

/// Recorded per load, in V/(N m).
const GAIN: f64 = 0.08;
/// Loads on the way up, down, and back to none, in N m.
const LOADS: [f64; 17] = [
    0.0, 4.0, 8.0, 12.0, 16.0, 12.0, 8.0, 4.0, 0.0, -4.0, -8.0, -12.0, -16.0, -12.0, -8.0, -4.0,
    0.0,
];
const DIAGNOSE: [&str; 9] = [
    "diagnose",
    "--decay",
    "first.csv",
    "--holdout-decay",
    "second.csv",
    "--measured",
    "gage",
    "--static",
    "loads.csv",
];
const APPLIED: [&str; 2] = ["--applied", "load"];

/// A folder with two hits and a table of loads, with the readings in mV.
fn folder(stand: &Stand, shown: impl Fn(f64) -> f64) -> Folder {
    let mut noise = Noise(7);
    let rows = LOADS.iter().map(|load| {
        let reading = shown(GAIN * load) + 0.3 + NOISE * noise.normal();
        format!("{load},{:.5}\n", 1e3 * reading)
    });
    let folder = Folder::new();
    folder.write("first.csv", stand.hit(1.0, 1));
    folder.write("second.csv", stand.hit(0.6, 2));
    folder.write(
        "loads.csv",
        format!("load_Nm,gage_mV\n{}", rows.collect::<String>()),
    );
    folder
}

/// Solution of `x + c x³ = pushed`.
fn bent(cubic: f64, pushed: f64) -> f64 {
    let (mut low, mut high) = (-10.0, 10.0);
    for _ in 0..100 {
        let x: f64 = 0.5 * (low + high);
        match x + cubic * x.powi(3) > pushed {
            true => high = x,
            false => low = x,
        }
    }
    low
}

/// The error under the loads over the noise of the gage, before and after.
fn errors(report: &Value) -> [f64; 2] {
    let file = &report["known_loads"]["files"][0];
    ["before_rms", "after_rms"].map(|key| number(&file[key]) / NOISE)
}

#[test]
fn loads_give_the_gain_and_bear_out_a_spring_that_stiffens() {
    let stand = Stand {
        cubic: 0.05,
        ..PLAIN
    };
    let folder = folder(&stand, |pushed| bent(0.05, pushed));
    let args = [&DIAGNOSE[..], &APPLIED, &["-o", "refined.toml", "--json"]].concat();
    let report = folder.json(&args);
    assert_eq!(report["effects"], json!(["cubic-stiffness"]));
    let loads = &report["known_loads"];
    let [before, after] = errors(&report);
    let [gain, std] = ["gain", "gain_std"].map(|key| number(&loads[key]));
    println!("{loads}: {before} -> {after}");
    assert!(
        before > 10.0 && (0.5..1.4).contains(&after),
        "{before} -> {after}"
    );
    assert!(
        (gain - GAIN).abs() < 3.0 * std && std < 1e-3 * GAIN,
        "{gain} ± {std}"
    );
    assert_eq!(loads["gain_unit"], "V/(N m)");
    assert_eq!(codes(&report), [""; 0]);
    // The stand file has the gain with its uncertainty, and gives the load of a slow reading.
    let refined = folder.read("refined.toml");
    assert!(
        refined.contains("static_gain = { value = \"0.0"),
        "{refined}"
    );
    assert!(refined.contains("first.csv, loads.csv"), "{refined}");
    // Notes on the time axis of the hits do not apply to the table.
    let text = [&DIAGNOSE[..], &APPLIED, &["--time-column", "1"]].concat();
    let text = folder.run(&text).stdout;
    let said = [
        "The known loads give a static gain",
        "loads.csv, 17 loads",
        "not fitted to them",
    ];
    assert!(said.iter().all(|part| text.contains(part)), "{text}");
}

#[test]
fn loads_show_the_loop_of_dry_friction_that_ringing_tells_of() {
    let friction = 0.01;
    let stand = Stand { friction, ..PLAIN };
    // On the way up the spring carries less by this amount, on the way down more.
    let mut before = 0.0;
    let mut shown = Vec::new();
    for pushed in LOADS.map(|load| GAIN * load) {
        before = f64::clamp(before, pushed - friction, pushed + friction);
        shown.push(before);
    }
    let next = std::cell::RefCell::new(shown.into_iter());
    let folder = folder(&stand, |_| next.borrow_mut().next().expect("a reading"));
    let report = folder.json(&[&DIAGNOSE[..], &APPLIED, &["--json"]].concat());
    assert_eq!(report["effects"], json!(["coulomb-friction"]));
    let [value, std] = parameter(&report, "coulomb-friction", "torque");
    assert!((value - friction).abs() < 4.0 * std, "{value} ± {std}");
    // Declared 1 % too small, it is fitted and nothing is missing.
    folder.write(
        "stand.toml",
        "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"20 Hz\"\ndamping_ratio = 0.01\n\
         [calibration]\ntorque_per_volt = \"12.5 N m/V\"\n[[effects]]\nkind = \"coulomb-friction\"\nform = \"sharp\"\n\
         torque = \"0.12375 N m\"\n",
    );
    let decays = [
        "diagnose",
        "--stand",
        "stand.toml",
        "--decay",
        "first.csv",
        "--json",
    ];
    let more = ["--holdout-decay", "second.csv", "--measured", "gage"];
    let declared = folder.json(&[&decays[..], &more].concat());
    assert_eq!(declared["verdict"], "nothing-missing", "{declared}");
    let [before, after] = errors(&report);
    assert!(
        before > 5.0 && (0.5..1.4).contains(&after),
        "{before} -> {after}"
    );
}

#[test]
fn loads_that_contradict_are_said() {
    // The loads are on a straight line although the decay is nonlinear; and the stand file has
    // another gain.
    let stand = Stand {
        cubic: 0.05,
        ..PLAIN
    };
    let folder = folder(&stand, |pushed| pushed);
    let mechanics =
        "natural_frequency = \"20 Hz\"\ndamping_ratio = 0.01\nstatic_gain = \"0.082 V/(N m)\"";
    folder.write(
        "stand.toml",
        format!("schema = \"torqcomp.stand/1\"\n[mechanics]\n{mechanics}\n"),
    );
    let args = [
        &DIAGNOSE[..],
        &APPLIED,
        &["--stand", "stand.toml", "--json"],
    ]
    .concat();
    let report = folder.json(&args);
    let [before, after] = errors(&report);
    assert!(before < 1.4 && after > 5.0, "{before} -> {after}");
    assert!(
        codes(&report).contains(&"loads-contradict-effects"),
        "{report}"
    );
    assert!(codes(&report).contains(&"gain-differs"), "{report}");
}

#[test]
fn loads_that_say_nothing_are_refused() {
    let folder = folder(&PLAIN, |pushed| pushed);
    let run = |more: &[&str]| folder.run(&[&DIAGNOSE[..], more].concat());
    run(&[]).says(2, &["--static needs --applied"]);
    folder.write("loads.csv", "load_Nm,gage_mV\n0,1\n5,3\n0,1\n");
    run(&APPLIED).says(1, &["loads.csv", "2 different loads"]);
    folder.write("loads.csv", "load_Nm,gage_mV\n0,1\n5,1\n10,1\n");
    run(&APPLIED).says(1, &["loads.csv", "do not determine a gain"]);
    folder.write("loads.csv", "load_Nm,gage_um\n0,1\n5,3\n10,5\n");
    run(&APPLIED).says(1, &["loads.csv", "different kinds"]);
}
