//! Typical measuring chains of labs: one torque, however its signal is recorded, written and calibrated.

use std::f64::consts::TAU;

use serde_json::Value;

use crate::util::{Folder, HARMONICS, sampled};

/// Sampling rate, and number of samples of a record: 20 periods of 10 Hz.
const RATE_HZ: f64 = 1000.0;
const SAMPLES: usize = 2000;
const TONE_HZ: f64 = 10.0;

/// A beam of which 1 strain is `E b d² R/(6 (L − x)) = 200e9·0.02·0.01²·0.1/(6·0.15) = 44444.4 N m`.
const DRAWING: &str = r#"schema = "torqcomp.stand/1"
[mechanics]
natural_frequency = "590 Hz"
damping_ratio = 0.02
[beam]
width = "20 mm"
depth = "10 mm"
length = "200 mm"
elastic_modulus = "200 GPa"
radius = "100 mm"
gage_position = "50 mm"
[gage]
gage_factor = 2
resistance = "350 ohm"
[recorder]
gain = 1
"#;
const N_M_PER_STRAIN: f64 = 200e9 * 0.02 * 1e-4 * 0.1 / (6.0 * 0.15);

const MECHANICS: &str = "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"590 Hz\"\ndamping_ratio = 0.02\n";

/// `U/E` of each layout at a relative change `d` of a gage's resistance, by Kirchhoff's laws, for equal arms.
fn bridge(layout: &str, d: f64) -> f64 {
    let nu = 0.3;
    match layout {
        "quarter" => d / (2.0 * (2.0 + d)),
        "half" => d / 2.0,
        "half-opposite" => d / (2.0 + d),
        "half-poisson" => (1.0 + nu) * d / (2.0 * (2.0 + (1.0 - nu) * d)),
        "full" => d,
        _ => (1.0 + nu) * d / (2.0 + (1.0 - nu) * d),
    }
}

/// A record of one channel: `signal` of a cosine at 10 Hz.
fn record(heading: &str, unit_row: Option<&str>, signal: impl Fn(f64) -> f64) -> String {
    let cosine = |i| signal((TAU * TONE_HZ * i as f64 / RATE_HZ).cos());
    let text = sampled(heading, RATE_HZ, SAMPLES, cosine);
    match unit_row {
        Some(unit) => text.replacen('\n', &format!("\ns,{unit}\n"), 1),
        None => text,
    }
}

/// Recorded amplitude at 10 Hz in N m, before the stand is divided out, and the whole report.
fn amplitude(folder: &Folder, more: &[&str]) -> (f64, serde_json::Value) {
    let report = folder.json(&[&HARMONICS[..], &["10", "--orders", "1", "--json"], more].concat());
    (
        report["components"][0]["recorded"].as_f64().unwrap(),
        report,
    )
}

fn refusal(folder: &Folder, more: &[&str]) -> String {
    let ran = folder.run(&[&HARMONICS[..], &["10"], more].concat());
    assert!(ran.code != 0, "{}", ran.stdout);
    ran.stderr
}

fn close(got: f64, want: f64, what: &str) {
    assert!(
        (got / want - 1.0).abs() < 1e-3,
        "{what}: {got}, {want} is right"
    );
}

/// 1 mV/V, 10 mV at 10 V and 500 µε of a full bridge with gage factor 2 are the same torque, for every layout.
#[test]
fn one_signal_in_volts_ratio_and_strain_is_one_torque() {
    let layouts = [
        "quarter",
        "half",
        "half-opposite",
        "half-poisson",
        "full",
        "full-poisson",
    ];
    for layout in layouts {
        let poisson = if layout.ends_with("poisson") {
            "poisson_ratio = 0.3\n"
        } else {
            ""
        };
        let folder = Folder::new();
        let stand =
            format!("{DRAWING}[bridge]\nlayout = \"{layout}\"\nexcitation = \"10 V\"\n{poisson}");
        folder.write("stand.toml", stand);
        let want = N_M_PER_STRAIN * 500e-6;
        let ratio = |c: f64| bridge(layout, 2.0 * 500e-6 * c);
        let ways: [(&str, f64, &[&str]); 17] = [
            ("bridge_mV/V", 1e3, &[]),
            ("bridge [mV/V]", 1e3, &[]),
            ("bridge (mV/V)", 1e3, &[]),
            ("bridge mV/V", 1e3, &[]),
            ("bridge_mV_V", 1e3, &[]),
            ("bridge [uV/V]", 1e6, &[]),
            ("bridge [µV/V]", 1e6, &[]),
            ("bridge [V/V]", 1.0, &[]),
            ("bridge in mV/V", 1e3, &[]),
            ("bridge", 1e3, &["--unit", "mV/V"]),
            ("bridge", 1e2, &["--unit", "% V/V"]),
            ("bridge [ppm]", 1e6, &["--unit", "ppm V/V"]),
            ("bridge_V", 10.0, &[]),
            ("bridge [mV]", 1e4, &[]),
            ("bridge [mVolt]", 1e4, &[]),
            ("bridge [uV]", 1e7, &[]),
            ("bridge", 10.0, &["--unit", "V"]),
        ];
        for (heading, factor, more) in ways {
            folder.write("in.csv", record(heading, None, |c| factor * ratio(c)));
            close(
                amplitude(&folder, more).0,
                want,
                &format!("{layout}, {heading}"),
            );
        }
        for (unit, factor) in [("mV/V", 1e3), ("[mV/V]", 1e3), ("mV", 1e4), ("V", 10.0)] {
            folder.write(
                "in.csv",
                record("bridge", Some(unit), |c| factor * ratio(c)),
            );
            close(
                amplitude(&folder, &[]).0,
                want,
                &format!("{layout}, row {unit}"),
            );
        }
        for (heading, factor) in [
            ("eps [µm/m]", 1e6),
            ("eps [ustrain]", 1e6),
            ("eps_µm/m", 1e6),
        ] {
            folder.write("in.csv", record(heading, None, |c| factor * 500e-6 * c));
            close(
                amplitude(&folder, &[]).0,
                want,
                &format!("{layout}, {heading}"),
            );
        }
    }
}

#[test]
fn what_could_be_strain_or_ratio_is_asked() {
    let folder = Folder::new();
    folder.write(
        "stand.toml",
        format!("{DRAWING}[bridge]\nlayout = \"full\"\n"),
    );
    for unit in ["%", "ppm"] {
        folder.write("in.csv", record(&format!("bridge [{unit}]"), None, |c| c));
        let said = refusal(&folder, &["--unit", unit]);
        assert!(
            said.contains(&format!("{unit} V/V")) && said.contains(&format!("{unit} strain")),
            "{said}"
        );
    }
    folder.write("in.csv", record("bridge [blorps]", None, |c| c));
    let said = refusal(&folder, &[]);
    assert!(
        said.contains("\"blorps\"") && said.contains("unknown"),
        "{said}"
    );
    folder.write("in.csv", record("torque [in-lb]", None, |c| c));
    let said = refusal(&folder, &[]);
    assert!(
        said.contains("in-lbf") && said.contains("0.11298"),
        "{said}"
    );
    assert!(said.contains("in-lbm"), "{said}");
}

/// Name, lines of `[calibration]`, heading, amplitude and middle of the record, relative standard
/// uncertainty.
type Form<'a> = (&'a str, String, &'a str, f64, f64, Option<f64>);

/// One transducer of 25 N m per mV/V in every form that data sheets use, recorded in every way.
#[test]
fn every_form_of_a_calibration_gives_one_torque_and_its_uncertainty() {
    let table = "points = [\n{ reading = \"-2 mV/V\", torque = \"-50 N m\", std = \"0.1 N m\" },\n\
        { reading = \"0 mV/V\", torque = \"0 N m\" },\n\
        { reading = \"1 mV/V\", torque = \"25 N m\" },\n\
        { reading = \"2 mV/V\", torque = { value = \"50 N m\", std = \"0.1 N m\" } },\n]\n";
    let fifth = |line: &str| format!("{line}\n[recorder]\nzero = \"2.5 V\"\n");
    let cases: Vec<Form> = vec![
        ("per volt", "torque_per_volt = { value = \"12.5 N m/V\", std = \"0.025 N m/V\" }".into(), "U [V]", 2.0, 0.0, Some(0.002)),
        ("per ratio", "torque_per_ratio = { value = \"25 N m/(mV/V)\", std = \"0.05 N m/(mV/V)\" }".into(), "U [mV/V]", 1.0, 0.0, Some(0.002)),
        ("sensitivity", "sensitivity = { value = \"2 mV/V\", std = \"0.004 mV/V\" }\nrated_torque = \"50 N m\"".into(), "U [mV/V]", 1.0, 0.0, Some(0.002)),
        ("sensitivity with sign", "sensitivity = \"-2 mV/V\"\nrated_torque = \"50 N m\"".into(), "U [mV/V]", -1.0, 0.0, None),
        ("both std", "sensitivity = { value = \"2 mV/V\", std = \"0.003 mV/V\" }\nrated_torque = { value = \"50 N m\", std = \"0.1 N m\" }".into(), "U [mV/V]", 1.0, 0.0, Some(0.0025)),
        ("live zero", fifth("sensitivity = \"2.5 V\"\nrated_torque = \"50 N m\""), "U [V]", 1.25, 2.5, None),
        ("4 to 20 mA", "sensitivity = { value = \"8 mA\", std = \"0.016 mA\" }\nrated_torque = \"50 N m\"\n[recorder]\nzero = \"12 mA\"\n".into(), "I [mA]", 4.0, 12.0, Some(0.002)),
        ("frequency", "zero_frequency = \"60 kHz\"\nfrequency_at_rated = { value = \"90 kHz\", std = \"60 Hz\" }\nrated_torque = \"50 N m\"".into(), "f [Hz]", 15e3, 60e3, Some(0.002)),
        ("frequency in kHz", "zero_frequency = \"10 kHz\"\nfrequency_at_rated = \"15 khz\"\nrated_torque = \"50 N m\"".into(), "f [kHz]", 2.5, 10.0, None),
                (
            "lever",
            "lever_arm = { value = \"0.5 m\", std = \"1 mm\" }".into(),
            "F [N]",
            50.0,
            0.0,
            Some(0.002),
        ),
("points", table.into(), "U [mV/V]", 1.0, 0.0, Some(0.002)),
        ("line through points", format!("degree = 1\n{}", table.replace(", std = \"0.1 N m\"", "")), "U [mV/V]", 1.0, 0.0, Some(0.0)),
        ("cubic through points", format!("degree = 3\n{}", table.replace(", std = \"0.1 N m\"", "")), "U [mV/V]", 1.0, 0.0, None),
    ];
    for (what, lines, heading, swing, middle, std) in cases {
        let folder = Folder::new();
        folder.write("stand.toml", format!("{MECHANICS}[calibration]\n{lines}"));
        folder.write("in.csv", record(heading, None, |c| middle + swing * c));
        let (got, report) = amplitude(&folder, &[]);
        close(got, 25.0, what);
        assert!(
            report["mean"].as_f64().unwrap().abs() < 1e-6,
            "{what}: {}",
            report["mean"]
        );
        let part = &report["components"][0];
        match std {
            None => {}
            Some(std) => {
                let stated = part["std_stand"].as_f64().unwrap() / part["torque"].as_f64().unwrap();
                assert!(
                    (stated - std).abs() < 1e-6,
                    "{what}: {stated}, {std} is right"
                );
            }
        }
    }
}

/// A calibration in mV/V applies to a record in volts, and vice versa, through supply and gain: 5 V and 200 make 1 V
/// of 1 mV/V.
#[test]
fn volts_and_ratios_meet_at_the_supply() {
    let folder = Folder::new();
    let per_ratio = format!("{MECHANICS}[calibration]\ntorque_per_ratio = \"25 N m/(mV/V)\"\n");
    let per_volt = format!("{MECHANICS}[calibration]\ntorque_per_volt = \"25 N m/V\"\n");
    let bridge = "[bridge]\nexcitation = \"5 V\"\n[recorder]\ngain = 200\n";
    folder.write("in.csv", record("U [V]", None, |c| c));
    folder.write("stand.toml", format!("{per_ratio}{bridge}"));
    close(amplitude(&folder, &[]).0, 25.0, "volts");
    folder.write("stand.toml", &per_ratio);
    let said = refusal(&folder, &[]);
    assert!(said.contains("excitation = \"5 V\""), "{said}");

    folder.write("in.csv", record("U [mV/V]", None, |c| c));
    folder.write("stand.toml", format!("{per_volt}{bridge}"));
    close(amplitude(&folder, &[]).0, 25.0, "ratio");
    folder.write("stand.toml", &per_volt);
    let said = refusal(&folder, &[]);
    assert!(said.contains("excitation = \"5 V\""), "{said}");
    folder.write(
        "stand.toml",
        format!("{per_volt}{bridge}zero = \"0.1 V\"\n"),
    );
    let said = refusal(&folder, &[]);
    assert!(
        said.contains("zero is in V and the record in mV/V"),
        "{said}"
    );
}

#[test]
fn nothing_is_assumed_silently() {
    let folder = Folder::new();
    folder.write("in.csv", record("U [V]", None, |c| 1e-3 * c));
    let drawing = DRAWING.replace(
        "[recorder]\ngain = 1\n",
        "[bridge]\nlayout = \"full\"\nexcitation = \"10 V\"\n",
    );
    let codes = |stand: &str| -> Vec<String> {
        folder.write("stand.toml", stand);
        let report = amplitude(&folder, &[]).1;
        let warnings = report["warnings"].as_array().unwrap().clone();
        warnings
            .iter()
            .map(|w| w["code"].as_str().unwrap().to_owned())
            .collect()
    };
    assert!(codes(&drawing).contains(&"gain-assumed".to_owned()));
    assert!(
        !codes(&format!("{drawing}[recorder]\ngain = 1\n")).contains(&"gain-assumed".to_owned())
    );
    let percent = drawing.replace("damping_ratio = 0.02", "damping_ratio = 2");
    assert!(codes(&percent).contains(&"damping-above-one".to_owned()));
    let soft = drawing.replace("200 GPa", "200 MPa");
    assert!(codes(&soft).contains(&"modulus-unusual".to_owned()));
    folder.write("stand.toml", drawing.replace("200 GPa", "200000 GPa"));
    let said = refusal(&folder, &[]);
    assert!(
        said.contains("elastic_modulus") && said.contains("impossible modulus"),
        "{said}"
    );

    folder.write("in.csv", record("I [mA]", None, |c| 12.0 + c));
    folder.write(
        "stand.toml",
        format!("{MECHANICS}[calibration]\nsensitivity = \"8 mA\"\nrated_torque = \"50 N m\"\n"),
    );
    let said = refusal(&folder, &[]);
    assert!(said.contains("zero = \"4 mA\""), "{said}");
    folder.write(
        "stand.toml",
        format!("{MECHANICS}[calibration]\nsensitivity = \"2 %\"\nrated_torque = \"50 N m\"\n"),
    );
    let said = refusal(&folder, &[]);
    assert!(said.contains("% V/V"), "{said}");
    folder.write(
        "stand.toml",
        format!("{MECHANICS}[calibration]\ntorque_per_volt = \"80 mV/(N m)\"\n"),
    );
    let said = refusal(&folder, &[]);
    assert!(said.contains("\"12.5 N m/V\""), "{said}");
    // Turns are not cycles of a signal.
    folder.write("in.csv", record("n [rpm]", None, |c| 1500.0 + c));
    let frequency =
        "zero_frequency = \"60 kHz\"\nfrequency_at_rated = \"90 kHz\"\nrated_torque = \"50 N m\"\n";
    folder.write(
        "stand.toml",
        format!("{MECHANICS}[calibration]\n{frequency}"),
    );
    let said = refusal(&folder, &[]);
    assert!(said.contains("rpm"), "{said}");
}

/// `identify static -o` writes the calibration in the form of its readings, and a record of the same transducer then
/// reads 25 N m: 25 N m are 1 mV/V, 4 mA above 12 mA, 15 kHz above 60 kHz, or 2 V.
#[test]
fn known_loads_calibrate_every_kind_of_reading() {
    let forms = [
        ("mV/V", 1.0, 0.02, "torque_per_ratio"),
        ("uV/V", 1000.0, 20.0, "torque_per_ratio"),
        ("V", 2.0, 0.1, "torque_per_volt"),
        ("mA", 4.0, 12.0, "at_torque = { value = \"50 N m\""),
        ("kHz", 15.0, 60.0, "at_torque = { value = \"50 N m\""),
    ];
    for (unit, swing, zero, key) in forms {
        let folder = Folder::new();
        let rated = "rated_torque = \"200 N m\"";
        let sheet = format!("{MECHANICS}[calibration]\nsensitivity = \"1 V\"\n{rated}\n");
        folder.write("new.toml", sheet);
        let mut rows = format!("load [N m],reading [{unit}]\n");
        for load in [
            0.0, -10.0, -25.0, -50.0, -25.0, 0.0, 10.0, 25.0, 40.0, 50.0, 25.0, 0.0,
        ] {
            rows += &format!("{load},{}\n", zero + swing * load / 25.0);
        }
        folder.write("loads.csv", rows);
        for degree in ["1", "3"] {
            let ran = folder.run(&[
                "identify",
                "static",
                "loads.csv",
                "--load",
                "load",
                "--reading",
                "reading",
                "--degree",
                degree,
                "-o",
                "new.toml",
            ]);
            assert_eq!(ran.code, 0, "{unit}: {}", ran.stderr);
            let written = folder.read("new.toml");
            let expected = if degree == "1" { key } else { "points" };
            assert!(written.contains(expected), "{unit}: {written}");
            // It had become the largest load, or was lost.
            assert!(written.contains(rated), "{unit}: {written}");
            folder.write("stand.toml", written);
            folder.write(
                "in.csv",
                record(&format!("U [{unit}]"), None, |c| zero + swing * c),
            );
            let (got, report) = amplitude(&folder, &[]);
            close(got, 25.0, unit);
            assert!(
                report["mean"].as_f64().unwrap().abs() < 1e-6,
                "{unit}: {}",
                report["mean"]
            );
        }
    }
}

/// 10 kg at 0.5 m and 9.81 m/s² are 49.05 N m.
#[test]
fn loads_in_kilograms_take_the_local_gravity() {
    let folder = Folder::new();
    folder.write(
        "loads.csv",
        "mass [kg],reading [V]\n0,0\n5,1\n10,2\n5,1\n0,0\n",
    );
    let args = [
        "identify",
        "static",
        "loads.csv",
        "--load",
        "mass",
        "--reading",
        "reading",
        "--radius",
        "0.5 m",
    ];
    let ran = folder.run(&args);
    assert!(
        ran.code == 2 && ran.stderr.contains("--gravity \"9.81 m/s^2\""),
        "{}",
        ran.stderr
    );
    let report = folder.json(&[&args[..], &["--gravity", "9.81 m/s^2", "--json"]].concat());
    let found = report["parameters"].as_array().unwrap();
    let constant = found
        .iter()
        .find(|p| p["name"] == "torque_per_volt")
        .unwrap();
    close(constant["value"].as_f64().unwrap(), 49.05 / 2.0, "N m/V");
}

/// A simulated record in mV/V reads the applied torque.
#[test]
fn a_simulated_record_is_in_the_unit_of_the_calibration() {
    let folder = Folder::new();
    let measured = "[diagnosed]\nmeasured_unit = \"mV/V\"\n";
    let stand =
        format!("{MECHANICS}[calibration]\ntorque_per_ratio = \"25 N m/(mV/V)\"\n{measured}");
    folder.write("stand.toml", stand);
    folder.write("torque.csv", record("torque [N m]", None, |c| 25.0 * c));
    let ran = folder.run(&[
        "simulate",
        "torque.csv",
        "--stand",
        "stand.toml",
        "-o",
        "out.csv",
    ]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let last = folder.read("out.csv");
    let largest = last.lines().skip(1500).fold(0.0_f64, |m, line| {
        m.max(
            line.split(',')
                .nth(1)
                .unwrap()
                .parse::<f64>()
                .unwrap()
                .abs(),
        )
    });
    // 1 mV/V, minus the 0.03 % by which the response at 10 Hz exceeds the static one.
    close(largest, 1.0, "mV/V");
}

/// `std` of the recorder, correlations of the constants, parameters of effects and the static gain: all contribute to
/// the stated uncertainty.
#[test]
fn every_std_of_the_stand_file_is_stated() {
    let folder = Folder::new();
    let table = |stand: &str| -> (f64, f64) {
        folder.write("stand.toml", stand);
        let args = [
            "table",
            "--stand",
            "stand.toml",
            "--from",
            "100",
            "--to",
            "100",
            "--uncertainty",
            "--json",
        ];
        let row = folder.json(&args)["rows"][0].clone();
        let of = |key: &str| row[key].as_f64().unwrap_or(f64::NAN);
        (of("magnitude_relative_std"), of("phase_std_deg"))
    };
    // A delay known to 10 µs turns 100 Hz by 360·100·1e-5 = 0.36 degrees.
    let delay = "[recorder]\ndelay = { value = \"1 ms\", std = \"10 us\" }\n";
    let (magnitude, phase) = table(&format!("{MECHANICS}{delay}"));
    assert!(
        magnitude.abs() < 1e-12 && (phase - 0.36).abs() < 1e-9,
        "{magnitude} {phase}"
    );
    // An RC low-pass at its corner: d ln|L|/d ln fc = 1/2, d arg L/d ln fc = 1/2 rad.
    let low_pass = "[recorder]\nlow_pass = { value = \"100 Hz\", std = \"1 Hz\" }\n";
    let (magnitude, phase) = table(&format!("{MECHANICS}{low_pass}"));
    assert!(
        (magnitude - 0.005).abs() < 1e-6 && (phase.to_radians() - 0.005).abs() < 1e-6,
        "{magnitude} {phase}"
    );
    // J, f and K with one common relative error, on which the response does not depend.
    let constants = "schema = \"torqcomp.stand/1\"\n[mechanics]\n\
        inertia = { value = \"2 kg m^2\", std = \"0.1 kg m^2\" }\n\
        damping = { value = \"12 N m s/rad\", std = \"0.6 N m s/rad\" }\n\
        stiffness = { value = \"50 N m/rad\", std = \"2.5 N m/rad\" }\n";
    let correlated = "correlation_inertia_damping = 1\ncorrelation_inertia_stiffness = 1\n\
        correlation_damping_stiffness = 1\n";
    assert!(table(constants).0 > 0.05);
    assert!(table(&format!("{constants}{correlated}")).0 < 1e-9);
    // A gain error of 0.10 ± 0.011: 1 % of the torque.
    let effect =
        "[[effects]]\nkind = \"gain-error\"\nerror = { value = \"0.1\", std = \"0.011\" }\n";
    let (magnitude, _) = table(&format!("{MECHANICS}{effect}"));
    assert!((magnitude - 0.01).abs() < 1e-4, "{magnitude}");
    // A width of ± 1 %, a gage factor of ± 1 %, and for volts a supply of ± 0.5 % and a gain of ± 0.2 %.
    let drawing = DRAWING
        .replace(
            "width = \"20 mm\"",
            "width = { value = \"20 mm\", std = \"0.2 mm\" }",
        )
        .replace(
            "gage_factor = 2",
            "gage_factor = { value = \"2\", std = \"0.02\" }",
        )
        .replace("gain = 1", "gain = { value = \"1\", std = \"0.002\" }");
    let supply =
        "[bridge]\nlayout = \"full\"\nexcitation = { value = \"10 V\", std = \"0.05 V\" }\n";
    folder.write("stand.toml", format!("{drawing}{supply}"));
    for (heading, want) in [("U [mV/V]", 2e-4), ("U [mV]", 2e-4 + 25e-6 + 4e-6)] {
        folder.write("in.csv", record(heading, None, |c| c));
        let part = amplitude(&folder, &[]).1["components"][0].clone();
        let stated = part["std_stand"].as_f64().unwrap() / part["torque"].as_f64().unwrap();
        close(stated * stated, want, heading);
    }
    // A static gain of 2 mV/N ± 1 %.
    let gain = MECHANICS.to_owned() + "static_gain = { value = \"2 mV/N\", std = \"0.02 mV/N\" }\n";
    folder.write("stand.toml", gain);
    folder.write("in.csv", record("U [mV]", None, |c| 2.0 * c));
    let part = amplitude(&folder, &[]).1["components"][0].clone();
    let stated = part["std_stand"].as_f64().unwrap() / part["torque"].as_f64().unwrap();
    assert!((stated - 0.01).abs() < 1e-9, "{stated}");
}

/// Every example of `docs/stand-file.md`, on a recording in its unit: "`1 mV/V` corresponds to 25 N m".
#[test]
fn the_examples_of_the_stand_file_read_what_they_say() {
    let page = include_str!("../docs/stand-file.md");
    let mut examples = 0;
    for part in page.split("\n### ").skip(1) {
        let Some((_, toml)) = part.split_once("```toml\n") else {
            continue;
        };
        let (toml, _) = toml.split_once("```").unwrap();
        let (_, said) = part.split_once("`1 ").expect(part);
        let (unit, said) = said.split_once("` corresponds to ").unwrap();
        let want: f64 = said.split_once(' ').unwrap().0.parse().unwrap();
        let folder = Folder::new();
        folder.write("stand.toml", toml);
        folder.write(
            "in.csv",
            record(
                "signal",
                None,
                |c| if unit == "V" { 0.013 } else { 0.0 } + 0.5 * c,
            ),
        );
        let (got, report) = amplitude(&folder, &["--unit", unit]);
        close(got, 0.5 * want, &format!("{toml}{report}"));
        let warnings = report["warnings"].as_array().unwrap();
        let of_stand = ["gain-assumed", "calibration-not-used"];
        assert!(
            !warnings
                .iter()
                .any(|w| of_stand.contains(&w["code"].as_str().unwrap())),
            "{report}"
        );
        examples += 1;
    }
    assert_eq!(examples, 12);
}

/// The output of `init` is a stand file that converts a record: 25 N m at 1 mV/V from data sheets and weights, 22.2 N m
/// from the drawing.
#[test]
fn init_writes_a_stand_file_that_converts() {
    let mechanics = [
        "--natural-frequency",
        "590 Hz",
        "--damping-ratio",
        "0.02",
        "-o",
        "stand.toml",
        "--force",
    ];
    let transducer = ["--sensitivity", "2 mV/V", "--rated-torque", "50 N m"];
    let bridge = ["--torque-per-ratio", "25 N m/(mV/V)"];
    let drawing = [
        "--width",
        "20 mm",
        "--depth",
        "10 mm",
        "--length",
        "200 mm",
        "--elastic-modulus",
        "200 GPa",
        "--radius",
        "100 mm",
        "--gage-position",
        "50 mm",
        "--gage-factor",
        "2",
        "--gage-resistance",
        "350 ohm",
        "--layout",
        "full",
    ];
    let ways: [(&str, &[&str], &str, f64); 4] = [
        ("transducer", &transducer, "U [mV/V]", 25.0),
        ("bridge", &bridge, "U [mV/V]", 25.0),
        ("drawing", &drawing, "U [mV/V]", N_M_PER_STRAIN * 500e-6),
        ("unknown", &[], "T [N m]", 1.0),
    ];
    for (from, flags, heading, want) in ways {
        let folder = Folder::new();
        let ran = folder.run(&[&["init", "--from", from], flags, &mechanics].concat());
        assert_eq!(ran.code, 0, "{from}: {}", ran.stderr);
        folder.write("in.csv", record(heading, None, |c| c));
        close(amplitude(&folder, &[]).0, want, from);
    }
    let folder = Folder::new();
    let ran = folder.run(&["init", "--from", "transducer", "--sensitivity", "2 mV/V"]);
    assert!(
        ran.code == 2 && ran.stderr.contains("--rated-torque \"50 N m\""),
        "{}",
        ran.stderr
    );
    let ran = folder.run(&["init", "--from", "bridge", "--layout", "full"]);
    assert!(
        ran.code == 2 && ran.stderr.contains("--layout does not apply"),
        "{}",
        ran.stderr
    );
    let ran = folder.run(&["init"]);
    assert!(
        ran.code == 2 && ran.stderr.contains("--from"),
        "{}",
        ran.stderr
    );
    // Without mechanics it says how to get them.
    let ran = folder.run(&["init", "--from", "unknown"]);
    assert!(
        ran.code == 0 && ran.stdout.contains("identify decay tap.csv -o FILE"),
        "{}",
        ran.stdout
    );
    folder.run(&["init", "--from", "unknown", "-o", "fan.toml"]);
    let named = "identify decay tap.csv -o fan.toml";
    assert!(folder.read("fan.toml").contains(named));
}

/// The file states the given uncertainties, and no others.
#[test]
fn init_takes_the_uncertainties_that_are_given() {
    let folder = Folder::new();
    let args = [
        "init",
        "--from",
        "transducer",
        "--sensitivity",
        "2 mV/V",
        "--rated-torque",
        "50 N m",
        "--natural-frequency",
        "590 Hz",
        "--damping-ratio",
        "0.02",
        "-o",
        "stand.toml",
        "--force",
    ];
    folder.write("in.csv", record("U [mV/V]", None, |c| c));
    for sensitivity in ["sensitivity=0.004 mV/V", "sensitivity=0.2 %"] {
        let stds = ["--std", sensitivity, "--std", "natural_frequency=2 Hz"];
        let ran = folder.run(&[&args[..], &stds].concat());
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let part = amplitude(&folder, &[]).1["components"][0].clone();
        let relative = |of: &str| part[of].as_f64().unwrap() / part["torque"].as_f64().unwrap();
        let (stated, response) = (relative("std_stand"), relative("std_response"));
        assert!(
            (stated - 0.002_f64.hypot(response)).abs() < 1e-9 && response > 0.0,
            "{sensitivity}: {stated} {response}"
        );
    }
    folder.run(&args);
    let text = folder.read("stand.toml");
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    assert!(lines.clone().all(|line| !line.contains("std =")), "{text}");
    let part = amplitude(&folder, &[]).1["components"][0].clone();
    assert!(part["std_stand"].is_null() && part["std_response"].is_null());
    for (std, said) in [
        ("sensitivty=1 mV/V", "--sensitivty is not given"),
        ("gain=1", "--gain is not given"),
        ("rated-torque=1 V", "torque"),
        ("sensitivity=0.1 V", "ratio"),
        ("sensitivity", "FLAG=QUANTITY"),
    ] {
        let ran = folder.run(&[&args[..], &["--std", std]].concat());
        assert!(
            ran.code == 2 && ran.stderr.contains(said),
            "{std}: {}",
            ran.stderr
        );
    }
}

/// Possible silent errors of the torque are asked about or reported: a rate in 1/s, a gain with a calibration of
/// recorded volts, a scale after the unit.
#[test]
fn doubtful_numbers_are_asked_or_said() {
    let folder = Folder::new();
    folder.write("in.csv", record("U [V]", None, |c| c));
    let volts = "[calibration]\ntorque_per_volt = \"12.5 N m/V\"\n";
    let angular = MECHANICS.replace("590 Hz", "3707 1/s");
    assert_ne!(angular, MECHANICS);
    folder.write("stand.toml", format!("{angular}{volts}"));
    let said = refusal(&folder, &[]);
    assert!(
        said.contains("\"3707 Hz\"") && said.contains("\"3707 rad/s\""),
        "{said}"
    );
    let codes = |report: &Value| -> Vec<String> {
        let all = report["warnings"].as_array().unwrap().iter();
        all.map(|w| w["code"].as_str().unwrap().to_owned())
            .collect()
    };
    folder.write(
        "stand.toml",
        format!("{MECHANICS}{volts}[recorder]\ngain = 100\n"),
    );
    let (_, report) = amplitude(&folder, &[]);
    assert!(
        codes(&report).contains(&"gain-not-used".to_owned()),
        "{report}"
    );
    folder.write("stand.toml", format!("{MECHANICS}{volts}"));
    for (heading, is_doubtful) in [
        ("U [V] x10", true),
        ("U *1000 [V]", true),
        ("U [V]", false),
        ("Ux1 [V]", false),
        ("U [V] x 0.1", true),
        ("U × 10 [V]", true),
        ("U (x1000) [V]", true),
        ("0.1 x U [V]", true),
        ("10*U [V]", true),
        ("U*100 [V]", true),
        ("U 1e-3 [V]", true),
        ("U /10 [V]", true),
        ("U 10^-3 [V]", true),
        ("box10 U [V]", false),
        ("motor/10 [V]", false),
        ("U 100 [V]", false),
        ("U*2 [V]", false),
    ] {
        folder.write("in.csv", record(heading, None, |c| c));
        let (_, report) = amplitude(&folder, &[]);
        let is_said = codes(&report).contains(&"scale-in-heading".to_owned());
        assert_eq!(is_said, is_doubtful, "{heading}");
    }
    // In the brackets of the unit it is asked about, and said if the unit is given.
    for unit in [
        "[x0.1 N m]",
        "(10^-1 Nm)",
        "(1/10 Nm)",
        "(Nm/10)",
        "(0.1Nm)",
    ] {
        folder.write("in.csv", record(&format!("T {unit}"), None, |c| c));
        let said = refusal(&folder, &[]);
        assert!(said.contains("contains a scale factor"), "{unit}: {said}");
        let (_, report) = amplitude(&folder, &["--unit", "N m"]);
        assert_eq!(codes(&report), ["scale-in-heading"], "{unit}");
    }
    // The unit of the heading in other words is no contradiction.
    folder.write("in.csv", record("T [Nm]", None, |c| c));
    let (_, report) = amplitude(&folder, &["--unit", "N m"]);
    assert!(codes(&report).is_empty(), "{report}");
}
