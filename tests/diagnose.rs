//! `diagnose` and `simulate` through the binary, on blind records made by independent code (see
//! [`crate::blind`]).

use std::f64::consts::TAU;

use crate::blind::record::{Case, make, make_as};
use crate::blind::setting::Asked;
use crate::blind::write;
use crate::util::{Folder, HERTEL, table};

/// Number of samples kept of a record: enough for a diagnosis, few enough for a test.
const KEPT: usize = 8000;
const COLUMNS: [&str; 4] = ["--applied", "applied_n_m", "--measured", "measured_n_m"];

/// A folder with the beginnings of both records of a case and its stand.
fn folder(case: &Case) -> Folder {
    let folder = Folder::new();
    folder.write("stand.toml", HERTEL);
    for (name, record) in [("train.csv", &case.train), ("holdout.csv", &case.holdout)] {
        let whole = write::table(record, false);
        let kept: Vec<&str> = whole.lines().take(KEPT + 1).collect();
        folder.write(name, kept.join("\n") + "\n");
    }
    folder
}

/// Diagnosis of both records in a folder.
pub(crate) fn diagnose<'a>(more: &[&'a str]) -> Vec<&'a str> {
    let files = [
        "--stand",
        "stand.toml",
        "--train",
        "train.csv",
        "--holdout",
        "holdout.csv",
    ];
    [&["diagnose"][..], &files, &COLUMNS, more].concat()
}

/// A case whose effect is 3 to 10 times the noise.
fn strong(effect: &str, number: usize) -> Case {
    let asked = Asked {
        strength: Some((3.0, 10.0)),
        ..Asked::default()
    };
    make_as(&asked, 301, effect, number).expect("the catalogue has it")
}

/// RMS of the noise added to the held-out record.
fn noise_rms(case: &Case) -> f64 {
    case.truth["noise"]["holdout_rms_n_m"]
        .as_f64()
        .expect("the truth says it")
}

#[test]
fn an_effect_is_named_added_and_simulated() {
    let case = make(7, "cubic-stiffness", 1).expect("the catalogue has it");
    let folder = folder(&case);
    let args = diagnose(&["-o", "refined.toml", "--html", "page.html", "--json"]);
    let report = folder.json(&args);
    assert_eq!(report["schema"], "torqcomp.diagnose/1");
    assert_eq!(report["verdict"], "explained");
    assert_eq!(report["effects"], serde_json::json!(["cubic-stiffness"]));
    let rms = |which: &str| {
        report["error"][which]["holdout_rms"]
            .as_f64()
            .expect("a number")
    };
    assert!(rms("declared") > rms("before") && rms("before") > 3.0 * rms("after"));
    assert!(rms("after") < 1.2 * noise_rms(&case), "{}", rms("after"));

    // In a forward simulation, the refined stand predicts the held-out record.
    let simulated = folder.run(&[
        "simulate",
        "holdout.csv",
        "--stand",
        "refined.toml",
        "--applied",
        "applied_n_m",
        "-o",
        "simulated.csv",
    ]);
    assert_eq!(simulated.code, 0, "{}", simulated.stderr);
    let (head, rows) = table(&folder.read("simulated.csv"));
    assert_eq!(head, ["time_s", "measured [N m]"]);
    // The initial motion has decayed after 50 ms.
    let settled = 1000..KEPT - 40;
    let squares = settled
        .clone()
        .map(|i| (rows[i][1] - case.holdout.measured_n_m[i]).powi(2));
    let left = (squares.sum::<f64>() / settled.len() as f64).sqrt();
    assert!(left < 1.2 * noise_rms(&case), "{left}");
    let page = folder.read("page.html");
    page_is_complete(&page);
    // White noise of that RMS at 20 kHz has the one-sided density RMS²/10 kHz.
    let (_, floor) = crate::reports::highest(&page, ">Spectrum<", 2);
    let rms = report["error"]["noise_floor_rms"].as_f64().expect("known");
    let difference = floor - (rms / 1e4_f64.sqrt()).log10();
    assert!(difference.abs() < 0.01, "{floor} {rms}");
}

fn page_is_complete(page: &str) {
    let parts = [
        "Explained: with cubic-stiffness",
        "Error before and after",
        "Records",
        "holdout.csv",
        "Autocorrelation",
        "Spectrum",
        "Residual over displacement",
        "Candidates",
        "coulomb-friction",
        "n = c x^3; the gage shows x. The stiffness changes with the square",
        "Stay at levels where the term is small",
        "more candidates</summary>",
        "noise floor",
    ];
    for part in parts {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("NaN") && !page.contains("src=") && !page.contains("href="));
}

#[test]
fn a_complete_stand_lacks_nothing() {
    let case = make(7, "none", 1).expect("the catalogue has it");
    let folder = folder(&case);
    let report = folder.json(&diagnose(&["--json"]));
    assert_eq!(report["verdict"], "nothing-missing");
    assert_eq!(report["effects"], serde_json::json!([]));
    assert_eq!(report["error"]["before"], report["error"]["after"]);
}

#[test]
fn training_that_does_not_excite_the_resonance_is_reported() {
    // A quarter of a logarithmic sweep ends at 19 Hz, far below the resonance.
    let case = make(7, "none", 3).expect("the catalogue has it");
    let folder = folder(&case);
    let report = folder.json(&diagnose(&["--json"]));
    let warnings = report["warnings"].as_array().expect("a list");
    let open = warnings
        .iter()
        .find(|w| w["code"] == "training-leaves-constants-open");
    let message = open.expect("a warning")["message"]
        .as_str()
        .expect("a text");
    assert!(message.contains("the natural frequency to ±"), "{message}");
    assert_eq!(report["effects"], serde_json::json!([]));
}

#[test]
fn threads_do_not_change_a_byte() {
    let case = make(7, "gain-error", 3).expect("the catalogue has it");
    let folder = folder(&case);
    let one = folder.run(&diagnose(&["--json", "--threads", "1"]));
    let three = folder.run(&diagnose(&["--json", "--threads", "3"]));
    assert_eq!(one.code, 0, "{}", one.stderr);
    assert_eq!(one.stdout, three.stdout);
    assert!(one.stdout.contains("\"gain-error\""));
}

/// Diagnosis of a case whose measured samples are modified as a function of the applied record, the row and the
/// sample.
fn changed(case: &Case, change: impl Fn(&[f64], usize, f64) -> f64) -> serde_json::Value {
    with_change(case, change).json(&diagnose(&["--json"]))
}

/// Its folder.
fn with_change(case: &Case, change: impl Fn(&[f64], usize, f64) -> f64) -> Folder {
    let folder = folder(case);
    for (name, record) in [("train.csv", &case.train), ("holdout.csv", &case.holdout)] {
        let text = folder.read(name);
        let rows = text.lines().enumerate().map(|(row, line)| {
            let (head, measured) = line.rsplit_once(',').expect("three columns");
            match measured.parse() {
                Ok(measured) => {
                    let measured = change(&record.applied_n_m, row, measured);
                    format!("{head},{measured:.8}\n")
                }
                Err(_) => line.to_owned() + "\n",
            }
        });
        folder.write(name, rows.collect::<String>());
    }
    folder
}

/// Checks that a diagnosis names no effect and describes the residual.
fn is_unexplained(report: &serde_json::Value, says: &str) {
    assert_eq!(report["verdict"], "unexplained");
    assert_eq!(report["effects"], serde_json::json!([]));
    let described = report["residual"]["described"].as_str().expect("a text");
    assert!(described.contains(says), "{described}");
}

#[test]
fn spikes_are_an_effect_only_at_equal_intervals() {
    let case = make(7, "none", 1).expect("the catalogue has it");
    // The last are weak, and so many that a line at their rate explains some of them.
    for (spacing, height) in [(613, 40.0), (83, 7.0)] {
        let height = height * noise_rms(&case);
        let with_spikes = |place: fn(usize) -> usize| {
            changed(&case, |_, row, y| {
                let is_spike = row % spacing == place(row / spacing) % spacing;
                y + if is_spike { height } else { 0.0 }
            })
        };
        let report = with_spikes(|_| 30);
        println!("{}: {}", report["verdict"], report["residual"]["described"]);
        assert_eq!(report["effects"], serde_json::json!(["commutation-spikes"]));
        // One at any place of each interval.
        let report = with_spikes(|interval| 7919 * interval * interval);
        is_unexplained(&report, "spikes");
    }
}

#[test]
fn a_slowly_or_rapidly_varying_gain_is_neither_noise_nor_an_effect() {
    let case = make(7, "none", 1).expect("the catalogue has it");
    // 1 % at 7 Hz.
    let slow = |row: usize| 0.01 * (0.0022 * row as f64).sin();
    let report = changed(&case, |_, row, y| y * (1.0 + slow(row)));
    is_unexplained(&report, "constants that change over the record");
    // 1 % from sample to sample: multiples of the golden ratio modulo 1 are uniformly distributed.
    let fast = |row: usize| 0.035 * ((row as f64 * 0.618_033_988_75).fract() - 0.5);
    let report = changed(&case, |_, row, y| y * (1.0 + fast(row)));
    is_unexplained(&report, "the magnitude of the signal");
}

/// An echo of the load after 10 samples, at 0.4 of the noise: the right effect is accepted, but not as a full
/// explanation.
#[test]
fn an_effect_that_leaves_an_echo_explains_a_part() {
    let case = make(7, "cubic-stiffness", 1).expect("the catalogue has it");
    let applied = &case.holdout.applied_n_m;
    let squares: f64 = applied.iter().map(|u| u * u).sum();
    let gain = 0.4 * noise_rms(&case) / (squares / applied.len() as f64).sqrt();
    let report = changed(&case, |applied, row, y| {
        y + gain * if row > 10 { applied[row - 11] } else { 0.0 }
    });
    assert_eq!(report["verdict"], "partly-explained", "{report}");
    assert_eq!(report["effects"][0], "cubic-stiffness");
    assert_eq!(report["residual"]["independent_of_input"], false);
    assert_eq!(report["candidates"][0]["effect"], "cubic-stiffness");
}

/// An unlisted law is suspected, and no effect that resembles it is named.
#[test]
fn laws_beside_the_list_are_suspected_and_not_added() {
    for (number, law) in [(0, "quintic-stiffness"), (1, "cubic-damping")] {
        let case = strong("unlisted", number);
        let folder = folder(&case);
        let report = folder.json(&diagnose(&["-o", "refined.toml", "--json"]));
        assert_eq!(report["verdict"], "unexplained", "{law}");
        assert_eq!(report["effects"], serde_json::json!([]), "{law}");
        let suspected = &report["suspected"];
        assert_eq!(suspected["law"], law, "{report}");
        let rms = |of: &serde_json::Value| of["holdout_rms"].as_f64().expect("a number");
        let (left, before) = (rms(suspected), rms(&report["error"]["before"]));
        let most = (1.2 * noise_rms(&case)).max(before / 3.0);
        assert!(left < most && left < before, "{law}: {left} of {before}");
        assert!(
            !folder.read("refined.toml").contains("[[effects]]"),
            "{law}"
        );
    }
}

/// Friction that falls with speed, position-dependent friction, a stop and creep are distinguished from
/// similar effects.
#[test]
fn effects_that_resemble_others_are_named() {
    for (effect, number) in [
        ("stribeck-friction", 0),
        ("position-dependent-friction", 0),
        ("end-stop", 0),
        ("gage-creep", 0),
    ] {
        let case = strong(effect, number);
        let folder = folder(&case);
        let report = folder.json(&diagnose(&["--json"]));
        assert_eq!(report["verdict"], "explained", "{effect}: {report}");
        assert_eq!(report["effects"], serde_json::json!([effect]), "{report}");
        let after = report["error"]["after"]["holdout_rms"].as_f64();
        let after = after.expect("a number");
        assert!(after < 1.1 * noise_rms(&case), "{effect}: {after}");
    }
}

/// A channel with the wrong sign is not a delayed one, though a delay of half a period is nearly
/// the same.
#[test]
fn a_wrong_sign_is_refused_as_one() {
    let case = make(7, "none", 0).expect("the catalogue has it");
    let folder = folder(&case);
    for name in ["train.csv", "holdout.csv"] {
        let text = folder.read(name);
        let turned = text.lines().enumerate().map(|(row, line)| {
            let (rest, value) = line.rsplit_once(',').expect("columns");
            match value.parse::<f64>() {
                Ok(value) if row > 0 => format!("{rest},{}\n", -value),
                _ => format!("{line}\n"),
            }
        });
        folder.write(name, turned.collect::<String>());
    }
    let run = folder.run(&diagnose(&[]));
    run.says(1, &["of the opposite sign", "change the sign"]);
}

/// Beside a line of the stand file every effect is fitted as in a record without a line, from a start of the right size.
#[test]
fn effects_are_fitted_beside_a_line() {
    let case = strong("gage-creep", 0);
    let amplitude = 20.0 * noise_rms(&case);
    let folder = with_change(&case, |_, row, y| {
        y + amplitude * (TAU * 60.0 * row as f64 / 20_000.0).sin()
    });
    let declared = format!(
        "{HERTEL}\n[[effects]]\nkind = \"mains-pickup\"\nform = \"60-Hz\"\nfrequency = \"60 Hz\"\n\
         amplitude = \"{amplitude} N m\"\n"
    );
    folder.write("stand.toml", declared);
    let report = folder.json(&diagnose(&["--json"]));
    assert_eq!(report["effects"], serde_json::json!(["gage-creep"]));
    let candidates = report["candidates"].as_array().expect("a list");
    for name in ["cubic-stiffness", "quadratic-damping", "end-stop"] {
        let candidate = candidates.iter().find(|c| c["effect"] == name);
        assert!(candidate.expect(name)["train_rms"].is_number(), "{name}");
    }
}

/// The square of such a sample overflows, and with it every error.
#[test]
fn a_sample_beyond_all_instruments_is_refused() {
    let folder = folder(&make(7, "none", 1).expect("the catalogue has it"));
    let whole = folder.read("holdout.csv");
    let mut lines: Vec<&str> = whole.lines().collect();
    lines[1767] = "0.08825,-1.13780982,-1e308";
    folder.write("holdout.csv", lines.join("\n") + "\n");
    folder
        .run(&diagnose(&["--json"]))
        .says(1, &["holdout.csv", "sample 1767", "-1e308"]);
}

/// An effect in the training record that the held-out one, of another stand, lacks is not named, and the verdict is not
/// that nothing is missing.
#[test]
fn an_effect_that_the_held_out_record_lacks_is_not_named() {
    let case = make(7, "cubic-stiffness", 1).expect("the catalogue has it");
    let other = make(7, "none", 1).expect("the catalogue has it");
    let folder = folder(&case);
    let whole = write::table(&other.holdout, false);
    let kept: Vec<&str> = whole.lines().take(KEPT + 1).collect();
    folder.write("holdout.csv", kept.join("\n") + "\n");
    let report = folder.json(&diagnose(&["--json"]));
    assert_eq!(report["verdict"], "unexplained", "{report}");
    assert_eq!(report["effects"], serde_json::json!([]));
    let candidates = report["candidates"].as_array().expect("a list");
    assert!(candidates.iter().all(|c| c["status"] == "rejected"));
}

/// Two effects of the generator in one stand are both found, and no third; the ladder of errors falls from step to
/// step. Slow excitation of a lightly damped stand, recorded from the middle on: the initial motion is not that of the
/// plain stand whose stiffness compensates for the wrong scale.
#[test]
fn a_wrong_scale_in_the_middle_of_a_run_is_a_gain_error() {
    let (natural_hz, damping_ratio) = (60.0, 0.02);
    for (scale, seed) in [(1.0 / 0.9, 3), (1.0 / 1.1, 3), (1.0 / 1.1, 11)] {
        let mut noise = crate::noise::Noise(seed);
        let lines: Vec<(f64, f64)> = (0..40)
            .map(|k| (2.0 + 0.7 * f64::from(k), TAU * noise.uniform()))
            .collect();
        let sum = |t: f64, answers: bool| {
            let line = |(hz, phase): &(f64, f64)| {
                let r = hz / natural_hz;
                let (re, im) = (1.0 - r * r, 2.0 * damping_ratio * r);
                let (gain, lag) = match answers {
                    true => (scale / re.hypot(im), im.atan2(re)),
                    false => (1.0, 0.0),
                };
                0.2 * gain * (TAU * hz * t + phase - lag).cos()
            };
            lines.iter().map(line).sum::<f64>()
        };
        let row = |i: u32| {
            let t = f64::from(i) * 1e-3;
            let measured = sum(t, true) + 0.005 * noise.normal();
            format!("{t:.3},{:.9},{measured:.9}\n", sum(t, false))
        };
        let rows: String = (0..4000).map(row).collect();
        let folder = Folder::new();
        folder.write(
            "run.csv",
            format!("time_s,applied_n_m,measured_n_m\n{rows}"),
        );
        let args = [
            &["diagnose", "--train", "run.csv"],
            &COLUMNS[..],
            &["--json"],
        ]
        .concat();
        let report = folder.json(&args);
        assert_eq!(report["verdict"], "explained", "{scale} {seed}");
        assert_eq!(report["effects"], serde_json::json!(["gain-error"]));
        let error = report["candidates"][0]["parameters"][0]["value"].as_f64();
        assert!(
            (error.expect("a number") + 1.0 - scale).abs() < 2e-3,
            "{report}"
        );
    }
}

#[test]
fn two_effects_are_found_together() {
    let case = make(1, "two", 2).expect("the catalogue has it");
    let folder = folder(&case);
    let report = folder.json(&diagnose(&["-o", "refined.toml", "--json"]));
    let names = |list: &serde_json::Value| -> Vec<String> {
        let names = list.as_array().expect("a list").iter();
        let mut names: Vec<String> = names.map(|n| n.as_str().unwrap_or("").to_owned()).collect();
        names.sort();
        names
    };
    assert_eq!(names(&report["effects"]), names(&case.truth["effects"]));
    assert_eq!(report["verdict"], "explained");
    let ladder = report["ladder"].as_array().expect("a list");
    let errors = ladder
        .iter()
        .map(|step| step["holdout_rms"].as_f64().expect("a number"));
    let errors: Vec<f64> = errors.collect();
    assert_eq!(errors.len(), 3);
    assert!(errors[0] > errors[1] && errors[1] > errors[2], "{errors:?}");
    assert!(errors[2] < 1.1 * noise_rms(&case), "{errors:?}");
    for share in report["shares"].as_array().expect("a list") {
        assert!(share["share"].as_f64().expect("a number") > 0.02, "{share}");
    }
    let correlation = report["correlations"][0]["correlation"].as_f64();
    assert!(correlation.expect("a number").abs() < 1.0);

    // The refined stand lacks nothing; without its last effect it lacks that one, and keeps the other.
    let refined = folder.read("refined.toml");
    let again = |stand: &str| {
        folder.write("stand.toml", stand);
        let report = folder.json(&diagnose(&["-o", "again.toml", "--json", "--force"]));
        (report, folder.read("again.toml"))
    };
    let (complete, kept) = again(&refined);
    assert_eq!(complete["verdict"], "nothing-missing", "{complete}");
    assert_eq!(complete["declared_effects"], report["effects"]);
    assert_eq!(kept.matches("[[effects]]").count(), 2);
    let last = refined.rfind("[[effects]]").expect("an effect");
    let rest = refined[last..]
        .find("\n[diagnosed]")
        .expect("the last section");
    let less = refined[..last].to_owned() + &refined[last + rest..];
    let (more, both) = again(&less);
    assert_eq!(more["effects"][0], report["effects"][1], "{more}");
    assert_eq!(more["declared_effects"][0], report["effects"][0]);
    assert_eq!(both.matches("[[effects]]").count(), 2);
}

/// A record in volts with an offset of 2 N m: included in the stand file after the first diagnosis, and after a second.
#[test]
fn a_declared_constant_is_taken_off_once() {
    let case = make(7, "none", 1).expect("the catalogue has it");
    let folder = folder(&case);
    for (name, record) in [("train.csv", &case.train), ("holdout.csv", &case.holdout)] {
        let mut table = String::from("time_s,applied_n_m,measured_V\n");
        let rows = record.applied_n_m.iter().zip(&record.measured_n_m);
        for (i, (applied, measured)) in rows.take(KEPT).enumerate() {
            // 1.23e3 ft lbf per volt.
            let volts = (measured + 2.0) / (1.23e3 * 1.355_817_948_331_400_4);
            table += &format!("{:.5},{applied:.8},{volts:.12}\n", i as f64 / 20_000.0);
        }
        folder.write(name, table);
    }
    let offset = |stand: &str| {
        let found = folder.run(&[
            "diagnose",
            "--stand",
            stand,
            "--train",
            "train.csv",
            "--holdout",
            "holdout.csv",
            "--applied",
            "applied_n_m",
            "--measured",
            "measured_V",
            "-o",
            "refined.toml",
            "--force",
        ]);
        assert_eq!(found.code, 0, "{}", found.stderr);
        let refined = folder.read("refined.toml");
        let line = refined.lines().find(|l| l.starts_with("offset = "));
        let text = line.and_then(|l| l.split('"').nth(1)).expect("an offset");
        text.trim_end_matches(" N m")
            .parse::<f64>()
            .expect("a number")
    };
    let first = offset("stand.toml");
    folder.write("once.toml", folder.read("refined.toml"));
    let second = offset("once.toml");
    assert!(
        (first - 2.0).abs() < 0.05 && (second - first).abs() < 0.01,
        "{first} {second}"
    );
}

/// The same records on stands of another speed and size give the same result: no constant of the search is in seconds,
/// hertz or newton metres.
#[test]
fn answers_do_not_depend_on_the_scale_of_time_and_torque() {
    let case = make(7, "rotor-imbalance", 1).expect("the catalogue has it");
    let rate = case.truth["parameters"]["frequency_hz"].as_f64();
    let rate_hz = rate.expect("the truth says it");
    for (stretch, size) in [(1.0, 1.0), (1.0 / 1200.0, 1.0), (30.0, 1e-4), (0.1, 1.0)] {
        let folder = Folder::new();
        let natural_hz = 592.0 / stretch;
        folder.write(
            "stand.toml",
            format!(
                "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"{natural_hz} Hz\"\ndamping_ratio = 0.07\n"
            ),
        );
        for (name, record) in [("train.csv", &case.train), ("holdout.csv", &case.holdout)] {
            let mut table = String::from("time_s,applied_n_m,measured_n_m\n");
            let rows = record.applied_n_m.iter().zip(&record.measured_n_m);
            for (i, (applied, measured)) in rows.take(KEPT).enumerate() {
                let time_s = i as f64 * stretch / 20_000.0;
                let [applied, measured] = [applied, measured].map(|torque| torque * size);
                table += &format!("{time_s:.12e},{applied:.12e},{measured:.12e}\n");
            }
            folder.write(name, table);
        }
        let report = folder.json(&diagnose(&["--json"]));
        let names = serde_json::json!(["rotor-imbalance"]);
        assert_eq!(report["effects"], names, "{stretch} {size}");
        assert_eq!(report["verdict"], "explained", "{stretch} {size}");
        let found_hz = report["candidates"][0]["parameters"][0]["value"].as_f64();
        let ratio = found_hz.expect("a number") * stretch / rate_hz;
        assert!((ratio - 1.0).abs() < 0.01, "{stretch} {size}: {ratio}");
    }
}

/// An amplifier whose slew rate is limited follows the motion of the hold-out record. The plain stand explains that to
/// the noise, and "nothing-missing" had been the verdict, with several times the noise in the training record.
#[test]
fn what_acts_in_the_training_record_only_is_missing() {
    let case = make(7, "none", 0).expect("the catalogue has it");
    for (part, verdict) in [(f64::INFINITY, "nothing-missing"), (0.7, "unexplained")] {
        let folder = folder(&case);
        let text = folder.read("train.csv");
        let (head, rows) = table(&text);
        let place = head.iter().position(|h| h.starts_with("measured")).unwrap();
        let steps = rows.windows(2).map(|w| (w[1][place] - w[0][place]).abs());
        let most = part * steps.fold(0.0, f64::max);
        let mut shown = rows[0][place];
        let limited = rows.iter().map(|row| {
            shown += (row[place] - shown).clamp(-most, most);
            let mut row = row.clone();
            row[place] = shown;
            let cells: Vec<String> = row.iter().map(f64::to_string).collect();
            cells.join(",") + "\n"
        });
        folder.write(
            "train.csv",
            head.join(",") + "\n" + &limited.collect::<String>(),
        );
        let report = folder.json(&diagnose(&["--json"]));
        assert_eq!(
            report["verdict"], verdict,
            "{}",
            report["residual"]["described"]
        );
        let said = report["residual"]["described"].as_str().unwrap();
        assert_eq!(
            said.contains("noise in the training records"),
            part < 1.0,
            "{said}"
        );
    }
}
