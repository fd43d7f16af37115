//! `identify` through the binary: reports, stand files, pages, rejections.

use super::decay::figure_5;
use super::{Noise, TAU, parameter};
use crate::util::{Folder, assert_close};

fn decay_file(folder: &Folder) {
    let mut noise = Noise(17);
    let (t, y, _) = figure_5(60.0, &mut noise);
    let rows: String = t
        .iter()
        .zip(&y)
        .map(|(t, y)| format!("{t},{y}\n"))
        .collect();
    folder.write("decay.csv", format!("time_s,gage_mV\n{rows}"));
}

/// C7 to C21 from figure 5's numbers and the inertia of the thesis, as in `thesis::mechanics`.
#[test]
fn figure_5_gives_the_constants_of_the_thesis() {
    let folder = Folder::new();
    decay_file(&folder);
    let report = folder.json(&[
        "identify",
        "decay",
        "decay.csv",
        "--inertia",
        "5.85e-3 slug ft^2",
        "--units",
        "us",
        "--json",
        "--stand",
        "stand.toml",
    ]);
    assert_eq!(report["schema"], "torqcomp.identify/1");
    for (name, want, unit) in [
        ("damped_frequency", 588.235, "Hz"),
        ("decay_rate", 261.56, "1/s"),
        ("damping_ratio", 0.070593, ""),
        ("natural_frequency", 589.707, "Hz"),
        ("damping", 3.0603, "ft lbf s/rad"),
        ("stiffness", 80_314.0, "ft lbf/rad"),
    ] {
        let (value, std, got) = parameter(&report, name);
        assert_close(value, want, 1.5e-3);
        assert_eq!(got, unit, "{name}");
        assert!(std.is_some_and(|s| s > 0.0), "{name}");
    }
    assert_eq!(report["fit"]["unit"], "mV");
}

#[test]
fn the_stand_file_is_updated_in_place() {
    let folder = Folder::new();
    decay_file(&folder);
    let before = folder
        .read("stand.toml")
        .replace("[calibration]", "# weighed, not fitted\n[calibration]");
    folder.write("stand.toml", &before);
    folder
        .run(&["identify", "decay", "decay.csv", "-o", "stand.toml"])
        .says(0, &["anchor-without-std"]);
    let after = folder.read("stand.toml");
    assert!(
        after.contains("inertia = \"5.85e-3 slug ft^2\"\n"),
        "{after}"
    );
    assert!(
        after.contains("# weighed, not fitted\n[calibration]"),
        "{after}"
    );
    assert!(
        after.contains("stiffness = { value = \"") && after.contains("std = \""),
        "{after}"
    );
    assert!(
        after.contains("source = \"identify decay: decay.csv\""),
        "{after}"
    );
    // The output is a valid stand file.
    assert_eq!(folder.run(&["table", "--stand", "stand.toml"]).code, 0);
    folder.write("other.toml", "a = 1\n");
    folder
        .run(&["identify", "decay", "decay.csv", "-o", "other.toml"])
        .says(1, &["not a stand file"]);
    assert_eq!(folder.read("other.toml"), "a = 1\n");
}

#[test]
fn without_an_anchor_only_ratios_are_written() {
    let folder = Folder::new();
    decay_file(&folder);
    folder
        .run(&[
            "identify",
            "decay",
            "decay.csv",
            "-o",
            "new.toml",
            "--strict",
        ])
        .says(3, &["not-anchored", "--inertia"]);
    let text = folder.read("new.toml");
    assert!(
        text.contains("natural_frequency") && text.contains("damping_ratio"),
        "{text}"
    );
    assert!(!text.contains("stiffness"), "{text}");
    assert_eq!(folder.run(&["table", "--stand", "new.toml"]).code, 0);
}

#[test]
fn the_page_is_complete_in_itself() {
    let folder = Folder::new();
    decay_file(&folder);
    let args = ["identify", "decay", "decay.csv", "--html", "page.html"];
    assert_eq!(folder.run(&args).code, 0);
    let page = folder.read("page.html");
    for part in [
        "<!DOCTYPE html>",
        "natural frequency",
        "Residual",
        "<svg",
        "prefers-color-scheme:dark",
        "@media print",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // Its only script is inline and fetches nothing.
    for outside in [
        "src=",
        "href=",
        "@import",
        "fetch(",
        "XMLHttpRequest",
        "import(",
        "url(",
    ] {
        assert!(!page.contains(outside), "{outside}");
    }
    folder
        .run(&args)
        .says(1, &["page.html: the output exists", "--force"]);
    let again = folder.run(&[
        "identify",
        "decay",
        "decay.csv",
        "--html",
        "page.html",
        "--force",
    ]);
    assert_eq!(again.code, 0);
    // The header contains the command and the time; the results are the same.
    let found = |page: &str| {
        page.split("<svg")
            .skip(1)
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    assert_eq!(found(&folder.read("page.html")), found(&page));
}

#[test]
fn what_cannot_be_identified_is_said() {
    let folder = Folder::new();
    decay_file(&folder);
    let flat: String = (0..500)
        .map(|i| format!("{},1\n", f64::from(i) * 1e-3))
        .collect();
    folder.write("flat.csv", format!("time_s,gage_V\n{flat}"));
    folder
        .run(&["identify", "decay", "flat.csv"])
        .says(1, &["no free decay found"]);
    folder
        .run(&["identify", "decay", "none.csv"])
        .says(1, &["none.csv", "check the path"]);
    folder.run(&["identify", "decay"]).says(2, &["INPUT"]);
    let args = [
        "identify",
        "runup",
        "decay.csv",
        "--motion",
        "gage",
        "--torque",
        "gage",
    ];
    folder.run(&args).says(1, &["mV", "expected an angle"]);
    let args = ["identify", "decay", "decay.csv", "--inertia", "5"];
    folder.run(&args).says(2, &["--inertia", "unit"]);
}

/// Noise up to the Nyquist frequency and a file of it among others, for records that cannot be
/// evaluated.
fn table(folder: &Folder, name: &str, columns: &[(&str, Vec<f64>)]) {
    let head: Vec<&str> = columns.iter().map(|c| c.0).collect();
    let rows: String = (0..columns[0].1.len())
        .map(|i| {
            let cells: Vec<String> = columns.iter().map(|c| c.1[i].to_string()).collect();
            format!("{},{}\n", f64::from(i as u32) * 1e-3, cells.join(","))
        })
        .collect();
    folder.write(name, format!("time_s,{}\n{rows}", head.join(",")));
}

/// Output of a one-mode filter at 60 Hz, by its recursion.
fn ringing_filter(applied: &[f64]) -> Vec<f64> {
    let (fall, turn) = (0.989_f64, (TAU * 0.06).cos());
    let (mut last, mut before) = (0.0, 0.0);
    applied
        .iter()
        .map(|x| {
            let now = 2.0 * fall * turn * last - fall * fall * before + 0.05 * x;
            before = last;
            last = now;
            now
        })
        .collect()
}

#[test]
fn responses_of_nonsense_are_refused() {
    let folder = Folder::new();
    let mut noise = Noise(41);
    let mut random = || (0..8000).map(|_| noise.normal()).collect::<Vec<f64>>();
    let (x, unrelated) = (random(), random());
    let y = ringing_filter(&x);
    let heads = ["force_N m", "beam_N m"];
    let both = |name: &str, a: &[f64], b: &[f64]| {
        table(
            &folder,
            name,
            &[(heads[0], a.to_vec()), (heads[1], b.to_vec())],
        );
    };
    both("good.csv", &x, &y);
    both("unrelated.csv", &x, &unrelated);
    both("still.csv", &x, &[3.0; 8000]);
    both("silent.csv", &[0.0; 8000], &y);
    both("same.csv", &x, &x);
    let run = |files: &[&str], applied: &str, measured: &str| {
        let channels = [
            "--applied",
            applied,
            "--measured",
            measured,
            "--band",
            "10..300",
        ];
        folder.run(&[&["identify", "response"], files, &channels[..]].concat())
    };
    assert_eq!(run(&["good.csv"], "force", "beam").code, 0);
    run(&["unrelated.csv"], "force", "beam")
        .says(1, &["does not follow the applied one", "--band"]);
    run(&["still.csv"], "force", "beam")
        .says(1, &["still.csv", "measured channel does not change"]);
    run(&["silent.csv"], "force", "beam").says(1, &["applied channel does not change"]);
    run(&["same.csv"], "force", "beam").says(1, &["same numbers"]);
    for (flag, value, says) in [
        ("--band", "5..2", "two frequencies in Hz"),
        ("--band", "-5..100", "two frequencies in Hz"),
        ("--band", "5..inf", "two frequencies in Hz"),
        ("--segment", "0", "16 or more"),
        ("--segment", "3", "16 or more"),
        ("--radius", "-0.1 m", "greater than 0"),
    ] {
        let args = "identify response good.csv --applied force --measured beam";
        let given = format!("{flag}={value}");
        let args: Vec<&str> = args.split(' ').chain([given.as_str()]).collect();
        folder.run(&args).says(2, &[flag, says]);
    }
    // Another rate.
    let slow = folder.read("good.csv").replace("0.001,", "0.0013,");
    folder.write("odd.csv", slow);
    run(&["odd.csv"], "force", "beam").says(1, &["not uniform", "--rate"]);
}

/// A response that gives twice the declared torque per volt was kept without a word.
#[test]
fn a_response_that_contradicts_the_calibration_is_said() {
    let folder = Folder::new();
    let mut noise = Noise(44);
    let x: Vec<f64> = (0..8000).map(|_| noise.normal()).collect();
    let y = ringing_filter(&x);
    table(&folder, "hits.csv", &[("torque [N m]", x), ("beam [V]", y)]);
    let args = "identify response hits.csv --applied torque --measured beam --band 10..300";
    let args: Vec<&str> = args.split(' ').collect();
    let free = folder.json(&[&args[..], &["--json"]].concat());
    let (value, std, _) = parameter(&free, "torque_per_volt");
    assert!(std.is_some());
    for (factor, is_said) in [(1.0, false), (0.5, true)] {
        let declared = format!("torque_per_volt = \"{} N m/V\"", factor * value);
        folder.write(
            "s.toml",
            format!("schema = \"torqcomp.stand/1\"\n[calibration]\n{declared}\n"),
        );
        let ran = folder.run(&[&args[..], &["-o", "s.toml"]].concat());
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let says = "2 times the";
        assert_eq!(
            ran.stderr.contains("[gain-differs]") && ran.stderr.contains(says),
            is_said,
            "{}",
            ran.stderr
        );
        assert!(folder.read("s.toml").contains(&declared));
    }
}

/// The units of later records had been ignored: a gain 99 times too large, or 11 % too small, without a word.
#[test]
fn responses_in_other_units_are_converted() {
    let folder = Folder::new();
    let mut noise = Noise(43);
    let records: Vec<[Vec<f64>; 2]> = (0..2)
        .map(|_| {
            let x: Vec<f64> = (0..8000).map(|_| noise.normal()).collect();
            let y = ringing_filter(&x);
            [x, y]
        })
        .collect();
    let times = |values: &[f64], factor: f64| values.iter().map(|v| v * factor).collect();
    let write = |name: &str, [x, y]: &[Vec<f64>; 2], heads: [&str; 2], factors: [f64; 2]| {
        let columns = [
            (heads[0], times(x, factors[0])),
            (heads[1], times(y, factors[1])),
        ];
        table(&folder, name, &columns);
    };
    write(
        "a.csv",
        &records[0],
        ["torque [N m]", "beam [V]"],
        [1.0, 1.0],
    );
    write(
        "b.csv",
        &records[1],
        ["torque [N m]", "beam [V]"],
        [1.0, 1.0],
    );
    write(
        "other.csv",
        &records[1],
        ["torque [cN m]", "beam [mV]"],
        [100.0, 1000.0],
    );
    write("none.csv", &records[1], ["torque", "beam [V]"], [1.0, 1.0]);
    write(
        "force.csv",
        &records[1],
        ["torque [N]", "beam [V]"],
        [1.0, 1.0],
    );
    let args = |second| {
        let files = ["identify", "response", "a.csv", second, "--json"];
        let channels = [
            "--applied",
            "torque",
            "--measured",
            "beam",
            "--band",
            "10..300",
        ];
        [&files[..], &channels].concat()
    };
    let [one_unit, two_units] = ["b.csv", "other.csv"].map(|second| folder.json(&args(second)));
    for entry in one_unit["parameters"].as_array().unwrap() {
        let name = entry["name"].as_str().unwrap();
        let [(value, _, unit), (converted, _, its_unit)] =
            [&one_unit, &two_units].map(|report| parameter(report, name));
        assert_eq!(unit, its_unit);
        assert_close(converted, value, 1e-6);
    }
    let none = [
        "\"torque\"",
        "no unit in none.csv",
        "N m in a.csv",
        "--applied-unit",
    ];
    folder.run(&args("none.csv")).says(1, &none);
    folder
        .run(&args("force.csv"))
        .says(1, &["\"torque\" has N in force.csv"]);
}

#[test]
fn loads_and_runs_of_nonsense_are_refused() {
    let folder = Folder::new();
    let head = "weight_N m,bridge_V\n";
    folder.write("flat.csv", format!("{head}0,1\n5,1\n10,1\n0,1\n"));
    folder.write("wild.csv", format!("{head}0,1\n5,0.2\n10,7\n5,-3\n0,1\n"));
    let loads = |file: &str, load: &str, reading: &str| {
        folder.run(&[
            "identify",
            "static",
            file,
            "--load",
            load,
            "--reading",
            reading,
        ])
    };
    loads("flat.csv", "weight", "bridge").says(1, &["does not change with load"]);
    loads("wild.csv", "bridge", "weight").says(2, &["swapped"]);
    loads("wild.csv", "weight", "bridge").says(1, &["does not follow the load"]);
    let rough = "0,0\n5,0.4\n10,1.1\n5,0.6\n0,0.1\n5,0.45\n10,0.9\n5,0.5\n0,0\n";
    folder.write("rough.csv", format!("{head}{rough}"));
    loads("rough.csv", "weight", "bridge").says(0, &["poor-fit"]);
    let args = "identify static rough.csv --load weight --load-unit N --reading bridge";
    let args: Vec<&str> = args.split(' ').chain(["--radius=-0.1 m"]).collect();
    folder
        .run(&args)
        .says(2, &["--radius -0.1 m", "greater than 0"]);
    // An angle with the wrong sign.
    let torque: Vec<f64> = (0..4000)
        .map(|i| (TAU * 0.7e-3 * f64::from(i)).sin())
        .collect();
    let omega = TAU * 0.7;
    let angle = torque.iter().map(|t| t / (omega * omega)).collect();
    table(
        &folder,
        "run.csv",
        &[("angle_rad", angle), ("torque_N m", torque)],
    );
    let args = [
        "identify", "runup", "run.csv", "--motion", "angle", "--torque", "torque",
    ];
    folder.run(&args).says(0, &["impossible"]);
    folder
        .run(&[&args[..], &["-o", "new.toml"]].concat())
        .says(1, &["inertia is negative (-", "check the sign"]);
    // The first would have taken all memory, or panicked; the others were 4 samples.
    for window in ["1e9", "inf", "nan", "0", "-1", "0.001"] {
        let given = format!("--window={window}");
        folder
            .run(&[&args[..], &[given.as_str()]].concat())
            .says(2, &["--window", "from 0.004 s, 4 samples, to 1.999 s"]);
    }
    let with_radius = |more: &[&str]| folder.run(&[&args[..], more].concat());
    with_radius(&["--radius", "0.1 m"]).says(
        2,
        &[
            "--radius goes with a force on a rotating body",
            "is a torque",
        ],
    );
    with_radius(&["--radius=-0.1 m", "--torque-unit", "N"])
        .says(2, &["--radius -0.1 m", "greater than 0"]);
    with_radius(&[
        "--radius",
        "0.1 m",
        "--torque-unit",
        "N",
        "--motion-unit",
        "m",
    ])
    .says(
        2,
        &[
            "--radius goes with a force on a rotating body",
            "is a force",
        ],
    );
}
