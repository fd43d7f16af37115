//! `compensate` recovers the applied torque.

use crate::noise::Noise;
use crate::util::{COMPENSATE, Folder, column, hertel_response, record, sampled, steady, table};

const PARTS: [(f64, f64, f64); 5] = [
    (0.8, 0.0, 0.0),
    (1.0, 120.0, 0.3),
    (0.2, 591.0, 2.0),
    (0.1, 1500.0, -1.0),
    (0.05, 2390.0, 0.7),
];

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(x, y)| (x - y).abs())
        .fold(0.0, f64::max)
}

#[test]
fn the_torque_comes_back_in_both_ways_to_run_it() {
    let rate = 20_000.0;
    let (shown, acted) = steady(&PARTS, rate, 100_000);
    let folder = Folder::new();
    folder.write("in.csv", record(&shown, rate));
    for more in [
        &["--digits", "shortest"][..],
        &["--digits", "shortest", "--whole-record"],
    ] {
        let args = [
            &["compensate", "in.csv", "--stand", "stand.toml", "-q"][..],
            more,
        ]
        .concat();
        let ran = folder.run(&args);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let torque = column(&ran.stdout, "compensated_torque_n_m");
        let inside = 400..100_000 - 400;
        let error = largest_difference(&torque[inside.clone()], &acted[inside]);
        assert!(error < 2e-9, "{more:?}: {error:e}");
    }
    // With the default digits the difference is that of the last digit.
    let ran = folder.run(&["compensate", "in.csv", "--stand", "stand.toml", "-q"]);
    let torque = column(&ran.stdout, "compensated_torque_n_m");
    assert!(largest_difference(&torque[400..99_600], &acted[400..99_600]) < 2e-9);
}

#[test]
fn stream_and_whole_record_agree() {
    let rate = 20_000.0;
    let mut noise = Noise(3);
    let noise: Vec<f64> = (0..70_000).map(|_| noise.uniform()).collect();
    let folder = Folder::new();
    folder.write("in.csv", record(&noise, rate));
    let run = |more: &[&str]| {
        let args = [
            &[
                "compensate",
                "in.csv",
                "--stand",
                "stand.toml",
                "-q",
                "--digits",
                "shortest",
            ][..],
            more,
        ]
        .concat();
        let ran = folder.run(&args);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        column(&ran.stdout, "compensated_torque_n_m")
    };
    let (stream, whole) = (run(&[]), run(&["--whole-record"]));
    let full_scale = whole.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
    assert!(largest_difference(&stream, &whole) < 1e-8 * full_scale);
}

#[test]
fn units_and_headings() {
    let (shown, _) = steady(&[(1.355_817_948_331_400_4, 0.0, 0.0)], 20_000.0, 2000);
    let folder = Folder::new();
    folder.write("in.csv", record(&shown, 20_000.0));
    let si = folder
        .run(&["compensate", "in.csv", "--stand", "stand.toml"])
        .stdout;
    let us = folder
        .run(&[
            "compensate",
            "in.csv",
            "--stand",
            "stand.toml",
            "--units",
            "us",
            "--with-recorded",
        ])
        .stdout;
    assert_eq!(table(&si).0, ["time_s", "compensated_torque_n_m"]);
    assert_eq!(
        table(&us).0,
        [
            "time_s",
            "compensated_torque_ft_lbf",
            "recorded_torque_ft_lbf"
        ]
    );
    // A constant is scaled by the static gain, up to the first and last sample: 1 ft lbf.
    for row in table(&us).1 {
        assert!(
            (row[1] - 1.0).abs() < 1e-10 && (row[2] - 1.0).abs() < 1e-10,
            "{row:?}"
        );
    }
    assert!((table(&si).1[7][1] - 1.355_817_948_331).abs() < 1e-10);
}

#[test]
fn torque_strain_force_and_volts_are_understood() {
    let folder = Folder::new();
    let stand = format!(
        "{}[beam]\nwidth = \"0.5 in\"\ndepth = \"0.5 in\"\nlength = \"1.5 in\"\nelastic_modulus = \"30e6 psi\"\n\
         radius = \"2.8 in\"\ngage_position = \"1 in\"\n",
        crate::util::HERTEL
    );
    folder.write("stand.toml", &stand);
    let constant = |heading: &str, value: f64, more: &[&str]| -> f64 {
        folder.write("in.csv", sampled(heading, 1e4, 500, |_| value));
        let args = [
            &[
                "compensate",
                "in.csv",
                "--stand",
                "stand.toml",
                "--units",
                "us",
                "-q",
            ][..],
            more,
        ]
        .concat();
        let ran = folder.run(&args);
        assert_eq!(ran.code, 0, "{heading}: {}", ran.stderr);
        column(&ran.stdout, "compensated_torque_ft_lbf")[250]
    };
    assert!((constant("bridge_mV", 2.0, &[]) - 2.46).abs() < 1e-9);
    assert!((constant("Torque [ft lbf]", 3.0, &[]) - 3.0).abs() < 1e-9);
    // 2.8 in times 12 lbf are 2.8 ft lbf.
    assert!((constant("Load (lbf)", 12.0, &[]) - 2.8).abs() < 1e-9);
    // (27a): 3.50e6 times 12 microstrain are 42 in lbf, or 3.5 ft lbf.
    assert!((constant("gage (ustrain)", 12.0, &[]) - 3.5).abs() < 1e-9);
    assert!((constant("something", 2.0, &["--unit", "mV"]) - 2.46).abs() < 1e-9);
}

#[test]
fn gage_and_bridge_stand_in_for_a_measured_constant() {
    // A half bridge in constant voltage with a linear gage: E_o = E_s/2 GF ε (28), so that
    // 1 mV is 2·10⁻³/(22.5·157) of strain and 3.50e6 in lbf times that is 1.98 in lbf (29).
    let folder = Folder::new();
    let stand = crate::util::HERTEL
        .split("[calibration]")
        .next()
        .unwrap()
        .to_owned()
        + "[beam]\nwidth = \"0.5 in\"\ndepth = \"0.5 in\"\nlength = \"1.5 in\"\nelastic_modulus = \"30e6 psi\"\n\
           radius = \"2.8 in\"\ngage_position = \"1 in\"\n[gage]\ngage_factor = 157\nresistance = \"5784 ohm\"\n\
           [bridge]\nlayout = \"half\"\nexcitation = \"22.5 V\"\n";
    folder.write("stand.toml", stand);
    folder.write("in.csv", sampled("bridge_mV", 1e4, 500, |_| 1.0));
    let ran = folder.run(&[
        "compensate",
        "in.csv",
        "--stand",
        "stand.toml",
        "--units",
        "us",
        "-q",
    ]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let torque = column(&ran.stdout, "compensated_torque_ft_lbf")[100];
    assert!(
        (torque - 7.0e3 / (22.5 * 157.0) / 12.0).abs() < 1e-6,
        "{torque}"
    );
}

#[test]
fn a_stand_in_other_units_is_compensated_in_them() {
    let folder = Folder::new();
    folder.write(
        "stand.toml",
        "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"590 Hz\"\ndamping_ratio = 0.07\nstatic_gain = \"2 V/V\"\n",
    );
    // 300 Hz of 1 V in: 2 V out times the response.
    let u: f64 = 300.0 / 590.0;
    let (re, im) = (1.0 - u * u, 2.0 * 0.07 * u);
    let turn = |i| std::f64::consts::TAU * 300.0 * i as f64 / 20_000.0 - im.atan2(re);
    let shown = |i| 2.0 / re.hypot(im) * turn(i).cos();
    folder.write("in.csv", sampled("v_out_V", 20_000.0, 4000, shown));
    let ran = folder.run(&["compensate", "in.csv", "--stand", "stand.toml", "-q"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let applied = column(&ran.stdout, "compensated_applied_v");
    for (i, y) in applied.iter().enumerate().skip(500).take(3000) {
        let want = (std::f64::consts::TAU * 300.0 * i as f64 / 20_000.0).cos();
        assert!((y - want).abs() < 1e-8, "{i}");
    }
    folder.write("in.csv", "time_s,force_N\n0,1\n0.1,1\n");
    let ran = folder.run(&["compensate", "in.csv", "--stand", "stand.toml"]);
    ran.says(1, &["static_gain", "\"V\"", "\"N\""]);
}

#[test]
fn recorder_low_pass_and_delay_are_divided_out() {
    let folder = Folder::new();
    folder.write(
        "stand.toml",
        format!(
            "{}[recorder]\nlow_pass = \"1 kHz\"\ndelay = \"0.5 ms\"\n",
            crate::util::HERTEL
        ),
    );
    let rate = 20_000.0;
    let (_, acted) = steady(&PARTS, rate, 20_000);
    let shown: Vec<f64> = (0..20_000)
        .map(|i| {
            let t = f64::from(i) / rate;
            PARTS
                .iter()
                .map(|(a, f, phase)| {
                    let (gain, lag) = hertel_response(*f);
                    // An RC low-pass by hand: 1/√(1 + (f/fc)²), −atan(f/fc).
                    let (low, turned) = (1.0 / (f / 1000.0).hypot(1.0), -(f / 1000.0).atan());
                    let turn = std::f64::consts::TAU * f * (t - 0.5e-3) + phase + lag + turned;
                    a * gain * low * turn.cos()
                })
                .sum()
        })
        .collect();
    folder.write("in.csv", record(&shown, rate));
    let ran = folder.run(&["compensate", "in.csv", "--stand", "stand.toml", "-q"]);
    // The stand file does not give the order of the low-pass.
    ran.says(0, &["[low-pass-order-assumed]"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let torque = column(&ran.stdout, "compensated_torque_n_m");
    assert!(largest_difference(&torque[600..19_400], &acted[600..19_400]) < 1e-8);
}

#[test]
fn the_zero_of_the_recorder_counts_on_every_way_to_torque() {
    let folder = Folder::new();
    folder.write("in.csv", sampled("bridge_V", 1e4, 500, |_| 2.6));
    let modal = "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"590 Hz\"\ndamping_ratio = 0.07\n";
    for (stand, heading, expected) in [
        (
            "[calibration]\ntorque_per_volt = \"100 N m/V\"\n",
            "compensated_torque_n_m",
            10.0,
        ),
        ("static_gain = \"2 V/N\"\n", "compensated_force_n", 0.05),
    ] {
        folder.write(
            "stand.toml",
            format!("{modal}{stand}[recorder]\nzero = \"2.5 V\"\n"),
        );
        let ran = folder.run(&["compensate", "in.csv", "--stand", "stand.toml", "-q"]);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        assert!(
            (column(&ran.stdout, heading)[250] - expected).abs() < 1e-9,
            "{stand}"
        );
    }
}

#[test]
fn clock_stamps_keep_their_resolution() {
    // Milliseconds since 1970, whose text cannot be copied.
    let folder = Folder::new();
    let stamp = |i: u32| 1.7e12 + 0.5 * f64::from(i);
    let rows: String = (0..2000)
        .map(|i| format!("{:.1},0.001\n", stamp(i)))
        .collect();
    folder.write("in.csv", format!("time_ms,bridge_V\n{rows}"));
    for more in [&[][..], &["--resample"], &["--whole-record"]] {
        let args = [
            &["compensate", "in.csv", "--stand", "stand.toml", "-q"][..],
            more,
        ]
        .concat();
        let ran = folder.run(&args);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let times = column(&ran.stdout, "time_s");
        let steps = times.windows(2).map(|w| w[1] - w[0]);
        assert!(
            steps.into_iter().all(|s| (s - 0.5e-3).abs() < 1e-6),
            "{more:?}"
        );
    }
}

#[test]
fn what_the_command_line_overrides_is_said() {
    let (shown, _) = steady(&PARTS[..2], 20_000.0, 3000);
    let folder = Folder::new();
    folder.write("in.csv", record(&shown, 20_000.0));
    let run = |more: &[&str]| {
        folder.run(&[&["compensate", "in.csv", "--stand", "stand.toml"][..], more].concat())
    };
    run(&["--unit", "mV"]).says(0, &["unit-overrides-heading", "says V"]);
    run(&["--rate", "10000"]).says(0, &["rate-overrides-stamps", "20000 Hz"]);
    run(&["--resample", "--rate", "1000"]).says(1, &["20000 Hz", "alias"]);
    assert!(
        !run(&["--unit", "V", "--rate", "20000"])
            .stderr
            .contains("overrides")
    );
}

#[test]
fn a_signal_above_the_band_and_an_unknown_noise_are_said() {
    let (shown, _) = steady(&[(1.0, 100.0, 0.0), (1.0, 600.0, 0.0)], 20_000.0, 40_000);
    let folder = Folder::new();
    folder.write("in.csv", record(&shown, 20_000.0));
    let ran = folder.run(&[
        "compensate",
        "in.csv",
        "--stand",
        "stand.toml",
        "--band",
        "300",
    ]);
    ran.says(0, &["signal-above-band", "300 Hz"]);
    // The edge of this band extends to 630 Hz, and removes nearly all of the second line.
    let edge = [
        "compensate",
        "in.csv",
        "--stand",
        "stand.toml",
        "--band",
        "525",
    ];
    folder.run(&edge).says(0, &["signal-above-band", "525 Hz"]);
    let ran = folder.run(&[
        "compensate",
        "in.csv",
        "--stand",
        "stand.toml",
        "--band",
        "9600",
    ]);
    ran.says(0, &["noise-unknown", "--band"]);
}

#[test]
fn values_that_no_recorder_measures_are_refused() {
    let folder = Folder::new();
    folder.write("in.csv", sampled("bridge_V", 1e4, 500, |_| 1e305));
    for more in [&[][..], &["--whole-record"]] {
        folder
            .run(&[&COMPENSATE[..], more].concat())
            .says(1, &["line 2", "no recorder measures"]);
    }
    assert_eq!(folder.names(), ["in.csv", "stand.toml"]);
}

#[test]
fn resampling_says_what_it_did() {
    let rate = 20_000.0;
    let (shown, acted) = steady(&PARTS[..2], rate, 20_000);
    let volts = 1.23e3 * 1.355_817_948_331_400_4;
    // Five samples are missing.
    let rows: String = (0..20_000)
        .filter(|i| !(9000..9005).contains(i))
        .map(|i| {
            format!(
                "{:.6},{:e}\n",
                f64::from(i) / rate,
                shown[i as usize] / volts
            )
        })
        .collect();
    let folder = Folder::new();
    folder.write("in.csv", format!("time_s,bridge_V\n{rows}"));
    folder
        .run(&["compensate", "in.csv", "--stand", "stand.toml"])
        .says(1, &["line 9002", "--fill linear"]);
    let args = [
        "compensate",
        "in.csv",
        "--stand",
        "stand.toml",
        "--resample",
        "-o",
        "out.csv",
        "--json",
    ];
    let report = folder.json(&args);
    assert_eq!(report["resampled"]["gaps"], 1);
    assert_eq!(report["resampled"]["bridged"], 5);
    assert_eq!(report["resampled"]["samples_in"], 19_995);
    assert_eq!(report["resampled"]["samples_out"], 20_000);
    assert_eq!(report["warnings"][0]["code"], "resampled-gaps");
    let torque = column(&folder.read("out.csv"), "compensated_torque_n_m");
    assert_eq!(torque.len(), 20_000);
    assert!(largest_difference(&torque[500..8500], &acted[500..8500]) < 1e-4);
    assert_eq!(report["resampled"]["repeated"], 0);
    // Both implementations resample alike.
    let whole = [&args[..5], &["-o", "whole.csv", "--whole-record"]].concat();
    assert_eq!(folder.run(&whole).code, 0);
    let whole = column(&folder.read("whole.csv"), "compensated_torque_n_m");
    assert!(largest_difference(&torque, &whole) < 1e-8);
}

#[test]
fn the_example_gives_back_the_torque_that_went_in() {
    let example = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/hertel");
    let path = |name: &str| example.join(name).to_str().unwrap().to_owned();
    let folder = Folder::new();
    let ran = folder.run(&[
        "compensate",
        &path("record.csv"),
        "--stand",
        &path("stand.toml"),
        "--units",
        "us",
        "-o",
        "torque.csv",
        "--json",
    ]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let report: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    let torque = column(&folder.read("torque.csv"), "compensated_torque_ft_lbf");
    let truth = std::fs::read_to_string(path("torque_applied.csv")).unwrap();
    let truth = column(truth.split_once('\n').unwrap().1, "torque_ft_lbf");
    let error: Vec<f64> = torque.iter().zip(&truth).map(|(a, b)| a - b).collect();
    let rms = (error[400..5600].iter().map(|e| e * e).sum::<f64>() / 5200.0).sqrt();
    // The remainder is the recorder's noise and the torque above the band, as large as reported.
    let stated = report["noise"]["record"]["compensated_rms"]
        .as_f64()
        .unwrap();
    assert!((rms / stated - 1.0).abs() < 0.15, "{rms} stated {stated}");
    // In the record itself, the stand's ringing is forty times that.
    let recorded = folder.run(&[
        "compensate",
        &path("record.csv"),
        "--stand",
        &path("stand.toml"),
        "--units",
        "us",
        "--with-recorded",
    ]);
    let recorded = column(&recorded.stdout, "recorded_torque_ft_lbf");
    let ringing: f64 = recorded
        .iter()
        .zip(&truth)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        / 6000.0;
    assert!(ringing.sqrt() > 40.0 * rms, "{}", ringing.sqrt() / rms);
}

/// Divided by a stand whose frequency is one standard uncertainty off, a sine at the resonance keeps its amplitude and
/// changes its phase: |δG/G| = 2 u(f)/f / (2 ζ) = 2/590/0.02.
#[test]
fn a_wrong_phase_is_part_of_the_uncertainty() {
    let folder = Folder::new();
    let stand = |hz: f64, std: &str| {
        format!(
            "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = {{ value = \"{hz} Hz\"{std} }}\n\
             damping_ratio = 0.02\n"
        )
    };
    folder.write("stand.toml", stand(590.0, ", std = \"2 Hz\""));
    folder.write("other.toml", stand(592.0, ""));
    let sine = |i: usize| (std::f64::consts::TAU * 590.0 * i as f64 / 20_000.0).sin();
    folder.write("in.csv", sampled("torque_n_m", 20_000.0, 40_000, sine));
    let torque = |name: &str, more: &[&str]| {
        let args = ["compensate", "in.csv", "--stand", name, "--band", "900"];
        let ran = folder.run(&[&args[..], more].concat());
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        ran.stdout
    };
    let [one, other] = ["stand.toml", "other.toml"]
        .map(|name| column(&torque(name, &["-q"]), "compensated_torque_n_m"));
    let inside = 10_000..30_000;
    let square = |value: fn(f64, f64) -> f64| -> f64 {
        inside
            .clone()
            .map(|i| value(one[i], other[i]).powi(2))
            .sum()
    };
    let relative = (square(|a, b| a - b) / square(|a, _| a)).sqrt();
    let report = torque("stand.toml", &["--json", "-o", "out.csv"]);
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let stated = report["noise"]["largest_std"]["relative_std"]
        .as_f64()
        .unwrap();
    assert!(
        (stated / (2.0 / 590.0 / 0.02) - 1.0).abs() < 0.01,
        "{stated}"
    );
    assert!(
        (stated / relative - 1.0).abs() < 0.05,
        "{stated} {relative}"
    );
}

/// A record in newtons beside a gain in volts per newton needs no gain; a gain in newtons per volt is written the wrong way
/// round.
#[test]
fn a_record_of_the_applied_quantity_needs_no_gain() {
    let folder = Folder::new();
    for (unit, gain, said) in [
        ("N", "0.0008 V/N", "static_gain = \"1 N/N\""),
        ("kgf", "0.0008 V/N", "static_gain = \"1 N/N\""),
        ("lb", "0.0008 V/N", "--unit lbf"),
        ("V", "1250 N/V", "\"0.0008 V/N\""),
    ] {
        let stand = "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"60 Hz\"\ndamping_ratio = 0.03\n";
        folder.write("stand.toml", format!("{stand}static_gain = \"{gain}\"\n"));
        folder.write(
            "in.csv",
            format!("time_s,x [{unit}]\n0,1\n0.001,1\n0.002,1\n"),
        );
        let ran = folder.run(&["compensate", "in.csv", "--stand", "stand.toml"]);
        ran.says(1, &[said]);
    }
}
