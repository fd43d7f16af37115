//! Non-UTF-8 file names, in every command, for inputs and outputs.

use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

use serde_json::Value;

use crate::util::{Folder, Ran, command, sampled};

/// A name with `@` replaced by "Messung ä" in Latin-1.
fn name(text: &str) -> OsString {
    let parts: Vec<&[u8]> = text.as_bytes().split(|byte| *byte == b'@').collect();
    OsStr::from_bytes(&parts.join(b"Messung \xe4".as_slice())).to_owned()
}

fn named(behind: &str) -> OsString {
    name(&format!("@{behind}"))
}

/// Runs with names as arguments.
fn run(folder: &Folder, args: &[&str]) -> Ran {
    let given = args.iter().map(|arg| name(arg));
    let output = command(&folder.path("."), &[]).args(given).output();
    let output = output.expect("the binary runs");
    Ran {
        code: output.status.code().expect("an exit code"),
        stdout: String::from_utf8(output.stdout).expect("UTF-8"),
        stderr: String::from_utf8(output.stderr).expect("UTF-8"),
    }
}

fn done(folder: &Folder, args: &[&str]) -> Ran {
    let ran = run(folder, args);
    assert_eq!(ran.code, 0, "{args:?}: {}", ran.stderr);
    ran
}

fn bytes(folder: &Folder, behind: &str) -> Vec<u8> {
    let path = folder.path(".").join(named(behind));
    std::fs::read(&path).unwrap_or_else(|error| panic!("{behind}: {error}"))
}

fn rows(count: usize) -> String {
    sampled("bridge_V", 20_000.0, count, |i| {
        (i as f64 * 60.0 * std::f64::consts::TAU / 20_000.0).sin()
    })
}

/// A folder with a record and a stand file, each under a plain name and a non-UTF-8 one.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("plain.csv", rows(4000));
    let here = folder.path(".");
    std::fs::copy(here.join("plain.csv"), here.join(named(".csv"))).expect("a copy");
    std::fs::copy(here.join("stand.toml"), here.join(named(".toml"))).expect("a copy");
    folder
}

#[test]
fn every_verb_reads_and_writes_names_that_are_no_utf8() {
    let folder = folder();
    done(&folder, &["init", "--from", "unknown", "-o", "@.init.toml"]);
    assert!(bytes(&folder, ".init.toml").starts_with(b"schema"));
    done(
        &folder,
        &[
            "compensate",
            "@.csv",
            "--stand",
            "@.toml",
            "-o",
            "@.torque.csv",
            "--html",
            "@.html",
            "--plot",
            "@.svg",
            "--log",
            "@.log",
        ],
    );
    done(
        &folder,
        &[
            "compensate",
            "plain.csv",
            "--stand",
            "stand.toml",
            "-o",
            "plain.torque.csv",
        ],
    );
    assert_eq!(
        bytes(&folder, ".torque.csv"),
        folder.read("plain.torque.csv").into_bytes()
    );
    for (behind, part) in [
        (".html", r"Messung \xE4.csv"),
        (".svg", "<svg"),
        (".log", r"Messung \\xE4.csv"),
    ] {
        let text = String::from_utf8(bytes(&folder, behind)).expect("UTF-8");
        assert!(text.contains(part), "{behind}");
    }
    done(&folder, &["extract", "@.csv", "-o", "@.rows.csv"]);
    done(
        &folder,
        &[
            "harmonics",
            "@.csv",
            "--stand",
            "@.toml",
            "--fundamental",
            "60",
            "-o",
            "@.txt",
        ],
    );
    done(
        &folder,
        &["table", "--stand", "@.toml", "-o", "@.table.csv"],
    );
    let drawing = run(&folder, &["predict", "--stand", "@.toml"]);
    drawing.says(1, &[r"Messung \xE4.toml: there is no drawing"]);
    done(&folder, &["man", "-o", "@.1"]);
    let simulated = done(
        &folder,
        &[
            "simulate",
            "@.rows.csv",
            "--stand",
            "@.toml",
            "--unit",
            "N m",
            "--applied",
            "bridge",
            "-o",
            "@.simulated.csv",
            "--json",
        ],
    );
    let simulated: Value = serde_json::from_str(&simulated.stdout).expect("JSON");
    assert_eq!(simulated["input"], r"Messung \xE4.rows.csv");
    for behind in [".rows.csv", ".txt", ".table.csv", ".1", ".simulated.csv"] {
        assert!(!bytes(&folder, behind).is_empty());
    }
    let inspected = done(&folder, &["inspect", "@.csv", "plain.csv", "--json"]);
    let inspected: Value = serde_json::from_str(&inspected.stdout).expect("JSON");
    assert_eq!(inspected["files"][0]["file"], r"Messung \xE4.csv");
    assert_eq!(inspected["warnings"][0]["code"], "identical-files");
}

#[test]
fn what_identifies_and_diagnoses_reads_and_writes_names_that_are_no_utf8() {
    let folder = Folder::new();
    let here = folder.path(".");
    // A free decay of a mode at 40 Hz with 2 % damping.
    let decay = sampled("torque [N m]", 2000.0, 4000, |i| {
        let t = i as f64 / 2000.0;
        (-0.02 * 251.3 * t).exp() * (251.2 * t).cos()
    });
    std::fs::write(here.join(named(".decay.csv")), decay).expect("written");
    let identify = [
        "identify",
        "decay",
        "@.decay.csv",
        "--inertia",
        "0.5 kg m^2",
        "-o",
        "@.id.toml",
        "--html",
        "@.id.html",
    ];
    let ran = run(&folder, &identify);
    assert!(matches!(ran.code, 0), "{}", ran.stderr);
    assert!(String::from_utf8_lossy(&bytes(&folder, ".id.toml")).contains(r"\xE4.decay.csv"));
    assert!(!bytes(&folder, ".id.html").is_empty());

    for verb in [
        "diagnose --train @.none.csv --applied a --measured b -o @.r.toml",
        "identify static @.none.csv --load a --reading b",
        "identify runup @.none.csv --motion a --torque b",
    ] {
        let missing = run(&folder, &verb.split(' ').collect::<Vec<_>>());
        missing.says(1, &[r"Messung \xE4.none.csv: cannot be read"]);
    }
}

/// All results of a tree with such names, by a folder, a pattern and a list, resume where a previous run
/// ended.
#[test]
fn many_recordings_may_have_names_that_are_no_utf8() {
    let folder = folder();
    let here = folder.path(".");
    let logs = here.join("logs").join(named(" run"));
    std::fs::create_dir_all(&logs).expect("a folder");
    for (name, count) in [("1.csv", 3000), ("2.csv", 3500)] {
        std::fs::write(logs.join(named(name)), rows(count)).expect("written");
    }
    // The same letters as the text of another name.
    std::fs::write(logs.join(r"Messung \xE41.csv"), rows(3200)).expect("written");
    let mut list = Vec::new();
    for name in [
        named("1.csv"),
        named("2.csv"),
        OsString::from(r"Messung \xE41.csv"),
    ] {
        list.extend_from_slice(
            Path::new("logs")
                .join(named(" run"))
                .join(name)
                .as_os_str()
                .as_bytes(),
        );
        list.push(b'\n');
    }
    std::fs::write(here.join(named(".list")), list).expect("written");
    let ways: [(&str, &[&str]); 3] = [
        ("out@1", &["logs"]),
        ("out@2", &["logs/**/M*[0-9].c?v"]),
        ("out@3", &["--files-from", "@.list"]),
    ];
    for (out, input) in ways {
        let rest = ["-o", out, "--summary", "@.summary.csv", "--force"];
        let args: Vec<&str> = ["extract"]
            .iter()
            .chain(input)
            .chain(&rest)
            .copied()
            .collect();
        let ran = done(&folder, &args);
        assert!(ran.stderr.contains("3 done"), "{out}: {}", ran.stderr);
        let results = here.join(name(out));
        let below = if out.ends_with('3') {
            results.join("logs").join(named(" run"))
        } else {
            results.join(named(" run"))
        };
        for name in [
            named("1.rows.csv"),
            named("2.rows.csv"),
            OsString::from(r"Messung \xE41.rows.csv"),
        ] {
            assert!(below.join(&name).is_file(), "{out}: {name:?}");
        }
        let again: Vec<&str> = args
            .iter()
            .map(|arg| {
                if *arg == "--force" {
                    "--skip-existing"
                } else {
                    *arg
                }
            })
            .collect();
        let ran = done(&folder, &again);
        assert!(
            ran.stderr.contains("3 skipped (unchanged)"),
            "{out}: {}",
            ran.stderr
        );
        // Changed recordings are processed again, replacing the old result.
        std::fs::write(
            logs.join(named("2.csv")),
            rows(3600 + usize::from(out.as_bytes()[out.len() - 1])),
        )
        .expect("written");
        let ran = done(&folder, &again);
        assert!(
            ran.stderr.contains("1 done, 2 skipped"),
            "{out}: {}",
            ran.stderr
        );
    }
    let summary = String::from_utf8(bytes(&folder, ".summary.csv")).expect("UTF-8");
    assert!(
        summary.contains(r"Messung \xE42.csv") && summary.contains(r"Messung \x5CxE41.csv"),
        "{summary}"
    );
    let merged = done(&folder, &["merge", "out@1", "-o", "@.merged.csv"]);
    assert!(merged.stderr.contains('3'), "{}", merged.stderr);
    // A result that would replace a recording is rejected.
    let ran = run(
        &folder,
        &[
            "extract", "logs", "-o", "logs", "--name", "{name}", "--force",
        ],
    );
    ran.says(2, &["would overwrite the recording"]);
}

#[test]
fn what_is_no_name_of_a_file_must_be_utf8() {
    let folder = folder();
    let ran = run(&folder, &["extract", "plain.csv", "--channel", "@"]);
    ran.says(2, &[r"Messung \xE4", "UTF-8"]);
}

/// The output is the input, whatever the name.
#[test]
fn an_input_that_is_no_utf8_is_not_replaced() {
    let folder = folder();
    let ran = run(&folder, &["extract", "@.csv", "-o", "./@.csv", "--force"]);
    ran.says(2, &[r"Messung \xE4.csv"]);
    assert_eq!(
        bytes(&folder, ".csv"),
        folder.read("plain.csv").into_bytes()
    );
}
