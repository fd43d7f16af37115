//! Manifests of several runs merged into the table of one.

use serde_json::Value;

use crate::batch::{log, put, with};
use crate::util::{Folder, HERTEL, Ran};

const RUN: [&str; 6] = ["compensate", "logs", "--stand", "stand.toml", "-o", "out/"];
const MERGE: [&str; 4] = ["merge", "out/", "-o", "merged.csv"];
/// Number of recordings, distributed over three parts.
const COUNT: usize = 9;

fn manifest(part: usize) -> String {
    format!("out/torqcomp-manifest.{part}-of-3.jsonl")
}

/// Some recordings, one of them corrupt.
fn folder() -> Folder {
    let folder = Folder::new();
    for i in 0..COUNT {
        put(&folder, &format!("logs/day {}/{i}.csv", i % 2), log(i));
    }
    let corrupt = log(1).replace("\n0.25,", "\n0.25,x");
    put(&folder, "logs/day 1/corrupt.csv", corrupt);
    folder
}

fn run_part(folder: &Folder, part: usize, more: &[&str]) -> Ran {
    let shard = format!("{part}/3");
    folder.run(&with(&RUN, &with(&["--shard", &shard], more)))
}

/// A folder whose three parts have run.
fn in_parts() -> Folder {
    let folder = folder();
    let codes: Vec<i32> = (1..=3).map(|i| run_part(&folder, i, &[]).code).collect();
    let failed = codes.iter().filter(|code| **code == 1).count();
    assert_eq!((codes.iter().sum::<i32>(), failed), (1, 1), "{codes:?}");
    folder
}

/// The paths of the recordings of a part.
fn files(folder: &Folder, part: usize) -> Vec<String> {
    let text = folder.read(&manifest(part));
    let begin: Value = serde_json::from_str(text.lines().next().unwrap()).unwrap();
    let files = begin["files"].as_array().unwrap().iter();
    files
        .map(|file| file.as_str().unwrap().to_owned())
        .collect()
}

/// Checks that the manifests are rejected and no table exists.
fn refused(folder: &Folder, parts: &[&str]) {
    let ran = folder.run(&MERGE);
    ran.says(1, parts);
    ran.says(1, &["no table was written"]);
    assert!(!folder.path("merged.csv").exists());
}

#[test]
fn parts_merged_are_the_table_of_one_run_byte_for_byte() {
    let folder = in_parts();
    let one = [
        "compensate",
        "logs",
        "--stand",
        "stand.toml",
        "-o",
        "one/",
        "--summary",
        "one.csv",
    ];
    assert_eq!(folder.run(&one).code, 1);
    folder.run(&MERGE).says(
        1,
        &[
            "10 recordings of 3 manifests: 9 done, 1 failed",
            "failed: logs/day 1/corrupt.csv, line 5002",
            "1 of 10 recordings failed; the others are done",
        ],
    );
    let table = folder.read("one.csv");
    assert_eq!(table.lines().count(), 11);
    assert!(folder.read("merged.csv") == table);
    // Named one by one in another order, by a pattern, and on standard output.
    let named: Vec<String> = [3, 1, 2].map(manifest).to_vec();
    let named: Vec<&str> = named.iter().map(String::as_str).collect();
    assert_eq!(folder.run(&with(&["merge"], &named)).stdout, table);
    let pattern = folder.run(&["merge", "out/*-of-3.jsonl", "--quiet"]);
    assert_eq!(pattern.stdout, table);
    assert!(!pattern.stderr.contains("10 recordings of"));
    // The manifest of the single run is complete by itself.
    assert_eq!(folder.run(&["merge", "one"]).stdout, table);
    folder
        .run(&MERGE)
        .says(1, &["merged.csv: the output exists"]);
}

#[test]
fn exit_codes_are_those_of_one_run() {
    let folder = folder();
    std::fs::remove_file(folder.path("logs/day 1/corrupt.csv")).unwrap();
    for part in 1..=3 {
        let warned = [
            "--plot",
            "{stem}.svg",
            "--plot-range",
            "100..101",
            "--strict",
        ];
        assert_eq!(run_part(&folder, part, &warned).code, 3);
    }
    let ran = folder.run(&with(&MERGE, &["--json"]));
    ran.says(3, &["incomplete: logs/day 0/0.csv"]);
    let report: Value = serde_json::from_str(&ran.stdout).expect("one JSON document");
    assert_eq!(report["schema"], "torqcomp.merge/1");
    assert_eq!(report["recordings"], COUNT);
    assert_eq!(report["files"].as_array().unwrap().len(), COUNT);
    assert_eq!(report["problems"], serde_json::json!([]));
    for part in 1..=3 {
        assert_eq!(run_part(&folder, part, &["--force"]).code, 0);
    }
    folder.run(&with(&MERGE, &["--force"])).says(0, &["9 done"]);
    folder.run(&["merge", "out", "--json"]).says(2, &["-o"]);
    folder.run(&["merge", "logs"]).says(1, &["no manifest"]);
    folder
        .run(&["merge", "none.jsonl"])
        .says(1, &["none.jsonl: cannot be read"]);
    let itself = ["merge", &manifest(1), "--force", "-o", &manifest(1)];
    folder
        .run(&itself)
        .says(2, &["is out/torqcomp-manifest.1-of-3.jsonl as well"]);
}

#[test]
fn a_missing_part_is_named() {
    let folder = in_parts();
    let missing = files(&folder, 2).len();
    assert!(missing > 0);
    std::fs::remove_file(folder.path(&manifest(2))).unwrap();
    let said = format!("no manifest of 2/3, with {missing} of 10 recordings");
    refused(&folder, &["[missing-parts]", &said, "--shard 2/3"]);
    let ran = folder.run(&with(&MERGE, &["--json"]));
    assert_eq!(ran.code, 1);
    let report: Value = serde_json::from_str(&ran.stdout).expect("one JSON document");
    assert_eq!(report["problems"][0]["code"], "missing-parts");
    assert_eq!(report["problems"][0]["manifest"], Value::Null);
}

#[test]
fn a_part_that_is_there_twice_counts_once_if_its_results_are_the_same() {
    let folder = in_parts();
    assert_eq!(folder.run(&MERGE).code, 1);
    let table = folder.read("merged.csv");
    let count = files(&folder, 2).len();
    let second = folder.read(&manifest(2));
    folder.write("copy.jsonl", &second);
    let twice = ["merge", "out", "copy.jsonl", "--force", "-o", "twice.csv"];
    let said = format!("{count} recordings in more than one manifest with the same result");
    folder.run(&twice).says(1, &[&said, "corrupt.csv"]);
    assert!(folder.read("twice.csv") == table);
    // The same manifest named twice counts once.
    let same = folder.run(&["merge", "out", &manifest(2)]);
    assert!(same.stdout == table && !same.stderr.contains("more than one"));

    let file = &files(&folder, 2)[0];
    let lines = second.lines().map(
        |line| match line.contains(&format!("\"file\":\"{file}\"")) {
            true => line.replace("\"samples\":6000", "\"samples\":5999"),
            false => line.to_owned(),
        },
    );
    let changed: Vec<String> = lines.collect();
    assert_ne!(changed.join("\n") + "\n", second);
    folder.write("copy.jsonl", changed.join("\n") + "\n");
    let said = format!(": {file} (figures)");
    folder.run(&twice).says(
        1,
        &[
            "[differing-results] copy.jsonl: the results of 1 recording differ from those in",
            &said,
            "no table",
        ],
    );
}

#[test]
fn a_run_that_was_cut_off_is_named_and_goes_on() {
    let folder = in_parts();
    assert_eq!(folder.run(&MERGE).code, 1);
    let table = folder.read("merged.csv");
    std::fs::remove_file(folder.path("merged.csv")).unwrap();
    // As after a kill: the last result without its line, and a truncated line.
    let whole = folder.read(&manifest(2));
    let lines: Vec<&str> = whole.lines().collect();
    let (end, last) = (lines.len() - 1, lines[lines.len() - 2]);
    let cut = format!(
        "{}\n{}",
        lines[..end - 1].join("\n"),
        &last[..last.len() / 2]
    );
    folder.write(&manifest(2), cut);
    let entry: Value = serde_json::from_str(last).unwrap();
    let file = entry["file"].as_str().unwrap();
    let said = format!(
        "2-of-3.jsonl: its run was cut off, 1 of {} recordings not done ({file})",
        files(&folder, 2).len()
    );
    refused(&folder, &["[cut-off]", &said, "--skip-existing"]);
    let result = entry["outputs"][0]["file"].as_str();
    if let Some(result) = result {
        std::fs::remove_file(folder.path(&format!("out/{result}"))).unwrap();
    }
    let code = run_part(&folder, 2, &["--skip-existing"]).code;
    assert!(code < 2);
    assert_eq!(folder.run(&MERGE).code, 1);
    assert!(folder.read("merged.csv") == table);
    std::fs::remove_file(folder.path("merged.csv")).unwrap();
    // A run that only skips lists its recordings, so that those that it did not reach are known.
    assert_eq!(run_part(&folder, 2, &["--skip-existing"]).code, code);
    let whole = folder.read(&manifest(2));
    let before = whole.trim_end().rfind('\n').unwrap();
    folder.write(&manifest(2), &whole[..before + 1]);
    refused(&folder, &["its run was cut off"]);
    folder.write(&manifest(2), "");
    refused(
        &folder,
        &[
            "[no-run] out/torqcomp-manifest.2-of-3.jsonl",
            "run that part again",
        ],
    );
}

#[test]
fn recordings_that_were_not_begun_are_named() {
    let folder = folder();
    for i in 0..3 {
        put(&folder, &format!("logs/a{i}.csv"), "x\n");
    }
    let fast = with(&RUN, &["--fail-fast", "--jobs", "1"]);
    assert_eq!(folder.run(&fast).code, 1);
    refused(
        &folder,
        &["[not-begun]", "not started after failures", "--fail-fast"],
    );
}

#[test]
fn runs_of_different_jobs_are_refused() {
    let folder = in_parts();
    let second = folder.read(&manifest(2));
    let again = |more: &[&str]| {
        std::fs::remove_file(folder.path(&manifest(2))).unwrap();
        assert!(run_part(&folder, 2, &with(&["--force"], more)).code < 2);
    };
    folder.write("stand.toml", HERTEL.replace("3.07", "3.08"));
    again(&[]);
    refused(
        &folder,
        &[
            "[other-stand] out/torqcomp-manifest.2-of-3.jsonl",
            "(stand.toml, SHA-256 ",
        ],
    );
    folder.write("stand.toml", HERTEL);
    again(&["--band", "800"]);
    refused(
        &folder,
        &[
            "[other-options]",
            "2-of-3.jsonl: the set of options",
            "--band=800 instead of none",
        ],
    );
    let version = concat!("\"version\":\"", env!("CARGO_PKG_VERSION"), "\"");
    folder.write(
        &manifest(2),
        second.replace(version, "\"version\":\"9.9.9\""),
    );
    refused(
        &folder,
        &[
            "[other-version]",
            "9.9.9 instead of",
            env!("CARGO_PKG_VERSION"),
        ],
    );
    folder.write(
        &manifest(2),
        second.replace("\"verb\":\"compensate\"", "\"verb\":\"extract\""),
    );
    refused(&folder, &["[other-verb]", "extract instead of compensate"]);
    folder.write(
        &manifest(2),
        second.replace("\"shard\":\"2/3\"", "\"shard\":\"2/4\""),
    );
    refused(&folder, &["[other-parts]", "part 2/4 instead of part 1/3"]);
    // An additional recording of another part is detected by the total number.
    put(&folder, "logs/new.csv", log(3));
    folder.write(&manifest(2), &second);
    again(&[]);
    refused(
        &folder,
        &[
            "[other-recordings]",
            "(11 instead of 10)",
            "run all parts again",
        ],
    );
}
