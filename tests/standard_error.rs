//! Standard error and the log: `--quiet`, `--progress`, `NO_COLOR` and `--log`, for every command.

use std::collections::BTreeMap;
use std::io::Write;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::schema::Printed;
use crate::util::{COMPENSATE, Folder, command, record, sampled, steady};

fn folder() -> Folder {
    let folder = Folder::new();
    let (shown, _) = steady(&[(1.0, 60.0, 0.0)], 20_000.0, 4_000);
    folder.write("in.csv", record(&shown, 20_000.0));
    folder
}

/// The words of every command; a command with several tests is combined with each of them.
fn verbs() -> Vec<Vec<String>> {
    let below = |words: &[String]| -> Vec<String> {
        let mut all = words.to_vec();
        all.push("--help".to_owned());
        let all: Vec<&str> = all.iter().map(String::as_str).collect();
        let help = Folder::new().run(&all).stdout;
        let Some((_, list)) = help.split_once("Commands:\n") else {
            return Vec::new();
        };
        let names = list.lines().take_while(|line| !line.is_empty());
        let names = names.filter_map(|line| line.split_whitespace().next());
        names
            .filter(|name| *name != "help")
            .map(str::to_owned)
            .collect()
    };
    let mut found = Vec::new();
    for verb in below(&[]) {
        let tests = below(std::slice::from_ref(&verb));
        match tests.is_empty() {
            true => found.push(vec![verb]),
            false => found.extend(tests.into_iter().map(|test| vec![verb.clone(), test])),
        }
    }
    found
}

#[test]
fn every_verb_takes_the_options_and_lists_them_in_one_group() {
    let verbs = verbs();
    assert!(verbs.len() > 15, "{verbs:?}");
    for verb in verbs {
        let mut words: Vec<&str> = verb.iter().map(String::as_str).collect();
        words.push("--help");
        let help = Folder::new().run(&words).stdout;
        let (_, group) = help.split_once("\nReport:\n").expect(&help);
        let group = group.split("\n\n\n").next().unwrap();
        for option in ["-q, --quiet", "--progress <WHEN>", "--log <FILE>"] {
            assert!(group.contains(option), "{words:?}: {option}\n{group}");
        }
        let more = ["--quiet", "--progress", "json", "--log", "run.jsonl"];
        words.extend(more);
        let ran = Folder::new().run(&words);
        assert_eq!(ran.code, 0, "{words:?}: {}", ran.stderr);
    }
}

/// Runs in which clap or torqcomp prints something: help, wrong usage, results, warnings, failures.
const SAID: &[&[&str]] = &[
    &["--help"],
    &["-h"],
    &["--version"],
    &[],
    &["compensate", "--help"],
    &["compensate", "--bnad", "3"],
    &["compensat"],
    &["harmonics", "in.csv", "--fundamental", "sixty"],
    &["inspect"],
    &[
        "compensate",
        "in.csv",
        "--stand",
        "stand.toml",
        "-o",
        "out.csv",
        "--force",
    ],
    &[
        "compensate",
        "missing.csv",
        "--stand",
        "stand.toml",
        "--json",
    ],
    &["inspect", "in.csv"],
    &["inspect", "in.csv", "--json"],
    &[
        "harmonics",
        "in.csv",
        "--stand",
        "stand.toml",
        "--fundamental",
        "60",
        "--orders",
        "1",
    ],
    &["table", "--stand", "stand.toml", "--step", "500"],
    &["init", "--from", "unknown"],
    &["man", "compensate"],
    &["extract", "in.csv", "--channel", "bridge"],
    &["extract", "in.csv", "--progress", "json"],
];

#[test]
fn nothing_has_colours_where_they_are_not_wanted() {
    let folder = folder();
    let said = |words: &[&str], no_color: Option<&str>| {
        let mut command = command(&folder.path(""), words);
        command.env("CLICOLOR_FORCE", "1").env_remove("NO_COLOR");
        if let Some(value) = no_color {
            command.env("NO_COLOR", value);
        }
        let output = command.output().expect("the binary starts");
        [output.stdout, output.stderr].concat()
    };
    let is_coloured = |bytes: &[u8]| bytes.contains(&0x1b);
    // Without the variable, clap does use colour: the test can detect it.
    assert!(is_coloured(&said(&["--help"], None)));
    assert!(is_coloured(&said(&["compensat"], None)));
    for words in SAID {
        let text = said(words, Some("1"));
        assert!(!text.is_empty(), "{words:?} says nothing");
        let shown = String::from_utf8_lossy(&text);
        assert!(!is_coloured(&text), "{words:?}: {shown}");
    }
}

#[test]
fn quiet_leaves_out_notes_and_keeps_warnings_and_errors() {
    let folder = folder();
    let noted = folder.run(&COMPENSATE);
    noted.says(0, &["calibration"]);
    let quiet = [&COMPENSATE[..], &["--force", "--quiet"]].concat();
    assert_eq!(folder.run(&quiet).stderr, "");
    // Before the command, too.
    let before = [&["-q"], &COMPENSATE[..], &["--force"]].concat();
    assert_eq!(folder.run(&before).stderr, "");
    let warned = folder.run(&[&quiet[..], &["--band", "9000"]].concat());
    assert!(warned.stderr.starts_with("torqcomp: warning ["));
    assert!(
        warned
            .stderr
            .lines()
            .all(|line| line.starts_with("torqcomp: ")),
        "{}",
        warned.stderr
    );
    folder
        .run(&["-q", "inspect", "missing.csv"])
        .says(1, &["torqcomp: missing.csv: cannot be read"]);
    folder.run(&["-q", "inspect", "--jsn"]).says(2, &["--jsn"]);
    // Results are still printed.
    assert!(
        folder
            .run(&["inspect", "in.csv", "-q"])
            .stdout
            .contains("bridge")
    );
}

/// The progress lines on standard error.
fn progress(stderr: &str) -> Vec<Value> {
    let lines = stderr
        .lines()
        .filter(|line| line.starts_with("{\"progress\":"));
    lines
        .map(|line| serde_json::from_str(line).expect("a JSON line"))
        .collect()
}

#[test]
fn progress_is_for_terminals_unless_a_program_asks() {
    let folder = folder();
    for mode in ["auto", "never"] {
        let words = ["extract", "in.csv", "-o", "-", "-q", "--progress", mode];
        assert_eq!(folder.run(&words).stderr, "");
    }
    let printed = Printed::new();
    let many = ["in.csv", "-o", "out/", "--progress", "json", "--quiet"];
    for (words, task) in [
        (
            vec!["extract", "in.csv", "--progress", "json", "--quiet"],
            "read",
        ),
        ([&["extract"], &many[..]].concat(), "recordings"),
    ] {
        let ran = folder.run(&words);
        let lines = progress(&ran.stderr);
        assert_eq!(ran.stderr.lines().count(), lines.len(), "{}", ran.stderr);
        assert_eq!(lines[0]["task"], task);
        for line in &lines {
            assert_eq!(printed.fault(line), None);
        }
    }
    let wrong = folder.run(&["extract", "in.csv", "--progress", "sometimes"]);
    wrong.says(2, &["auto, never, json"]);
}

#[test]
fn lines_for_programs_come_at_most_every_half_second() {
    let folder = folder();
    let text = sampled("bridge_V", 1000.0, 40_000, |i| (i as f64 * 0.01).sin());
    let words = ["extract", "-", "-o", "out.csv", "--progress", "json"];
    let mut child = command(&folder.path(""), &words)
        .stdin(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    let mut pipe = child.stdin.take().expect("a pipe");
    for piece in text.as_bytes().chunks(text.len() / 20) {
        pipe.write_all(piece).expect("it reads");
        std::thread::sleep(Duration::from_millis(80));
    }
    drop(pipe);
    let output = child.wait_with_output().expect("it ends");
    let lines = progress(&String::from_utf8(output.stderr).expect("UTF-8"));
    // 20 pieces within at least 1.6 s: a line at once, and at most one per half second.
    let times: Vec<f64> = lines
        .iter()
        .map(|line| line["seconds"].as_f64().unwrap())
        .collect();
    assert!(times.len() >= 2, "{times:?}");
    assert!(
        times.windows(2).all(|pair| pair[1] - pair[0] >= 0.499),
        "{times:?}"
    );
    for line in &lines {
        // The length of a pipe is unknown.
        assert!(line["progress"].is_null() && line["bytes_total"].is_null());
        assert_eq!(line["file"], "standard input");
    }
}

/// The lines of a log.
fn log(folder: &Folder) -> Vec<Value> {
    let text = folder.read("run.jsonl");
    assert!(text.ends_with('\n'), "{text}");
    let lines = text.lines();
    lines
        .map(|line| serde_json::from_str(line).expect("a JSON line"))
        .collect()
}

fn events(lines: &[Value]) -> Vec<&str> {
    lines
        .iter()
        .map(|line| line["event"].as_str().unwrap())
        .collect()
}

#[test]
fn the_log_has_the_start_each_warning_each_failure_and_the_end() {
    let folder = folder();
    let printed = Printed::new();
    let warned = [
        &COMPENSATE[..],
        &["--band", "9000", "--json", "--log", "run.jsonl"],
    ]
    .concat();
    let ran = folder.run(&warned);
    let report: Value = serde_json::from_str(&ran.stdout).expect("a report");
    let reported = report["warnings"].as_array().unwrap();
    assert!(!reported.is_empty());
    let lines = log(&folder);
    let command = lines[0]["command"].as_array().unwrap();
    assert_eq!(command[1..], warned);
    let noted: Vec<Value> = lines
        .iter()
        .filter(|line| line["event"] == "warning")
        .map(|line| serde_json::json!({"code": line["code"], "message": line["message"]}))
        .collect();
    assert_eq!(&noted, reported);
    let end = lines.last().unwrap();
    assert_eq!((&end["event"], &end["exit"]), (&"end".into(), &0.into()));
    assert!(end["seconds"].as_f64().unwrap() > 0.0);

    // Failures of the work and of the command line are appended.
    let before = folder.read("run.jsonl");
    let failed = folder.run(&["inspect", "missing.csv", "--log", "run.jsonl"]);
    assert_eq!(failed.code, 1);
    let wrong = folder.run(&["inspect", "in.csv", "--jsn", "--log=run.jsonl"]);
    assert_eq!(wrong.code, 2);
    assert!(folder.read("run.jsonl").starts_with(&before));
    let lines = log(&folder);
    let new = &lines[before.lines().count()..];
    let three = ["start", "failure", "end"];
    assert_eq!(events(new), [three, three].concat());
    assert_eq!(new[1]["code"], "not-found");
    assert_eq!(new[1]["where"]["file"], "missing.csv");
    assert_eq!(new[2]["exit"], 1);
    assert_eq!(new[4]["code"], "unknown-argument");
    assert_eq!(new[5]["exit"], 2);
    for line in &lines {
        assert_eq!(printed.fault(line), None, "{line}");
    }
}

#[test]
fn warnings_and_failures_of_many_recordings_name_them() {
    let folder = folder();
    folder.write("bad.csv", "time_s,bridge_V\n0,1\n1,x\n2,3\n");
    let words = [
        "extract",
        "in.csv",
        "bad.csv",
        "-o",
        "out/",
        "--log",
        "run.jsonl",
    ];
    assert_eq!(folder.run(&words).code, 1);
    let lines = log(&folder);
    let failures: Vec<&Value> = lines
        .iter()
        .filter(|line| line["event"] == "failure")
        .collect();
    assert_eq!(failures.len(), 2, "{lines:?}");
    assert_eq!(failures[0]["where"]["file"], "bad.csv");
    assert_eq!(failures[1]["code"], "recordings-failed");
}

#[test]
fn lines_of_processes_that_run_at_once_are_not_mixed() {
    let folder = folder();
    const RUNS: usize = 24;
    let start = |_| {
        let words = ["inspect", "missing.csv", "--log", "run.jsonl"];
        let mut command: Command = command(&folder.path(""), &words);
        command.spawn().expect("the binary starts")
    };
    let children: Vec<_> = (0..RUNS).map(start).collect();
    for child in children {
        let ended = child.wait_with_output().expect("it ends");
        assert_eq!(ended.status.code(), Some(1));
    }
    let mut runs: BTreeMap<String, Vec<Value>> = BTreeMap::new();
    for line in log(&folder) {
        let run = line["run"].as_str().unwrap().to_owned();
        runs.entry(run).or_default().push(line);
    }
    assert_eq!(runs.len(), RUNS);
    for lines in runs.values() {
        assert_eq!(events(lines), ["start", "failure", "end"]);
    }
    // A line truncated by a kill remains separate.
    let text = folder.read("run.jsonl");
    folder.write("run.jsonl", &text[..text.len() - 9]);
    folder.run(&["schema", "--log", "run.jsonl"]);
    let text = folder.read("run.jsonl");
    let last: Vec<&str> = text.lines().rev().take(2).collect();
    assert!(last.iter().all(|line| line.ends_with('}')), "{text}");
}

#[test]
fn a_log_is_no_other_file_of_the_run() {
    let folder = folder();
    let before = folder.read("in.csv");
    folder
        .run(&["inspect", "in.csv", "--log", "in.csv"])
        .says(2, &["in.csv", "nothing is appended"]);
    assert_eq!(folder.read("in.csv"), before);
    let words = ["extract", "in.csv", "--log", "x", "-o", "x", "--force"];
    folder.run(&words).says(2, &["x as well"]);
    assert_eq!(folder.read("x").lines().count(), 3);
    folder
        .run(&["inspect", "in.csv", "--log", "no/folder.jsonl"])
        .says(1, &["no/folder.jsonl"]);
    // A result without its log does not count as success.
    if cfg!(target_os = "linux") {
        folder
            .run(&["inspect", "in.csv", "--log", "/dev/full"])
            .says(1, &["/dev/full: no space left"]);
    }
}
