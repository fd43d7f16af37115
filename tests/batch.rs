//! Batch runs of the commands that read one recording.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Stdio;

use serde_json::Value;

use crate::golden::workplace;
use crate::util::{Folder, HERTEL, command, record, signal, steady};

/// Recordings in a tree, with spaces and umlauts in their names.
const LOGS: [&str; 4] = [
    "logs/a.csv",
    "logs/mon day/c.csv",
    "logs/mon day/ü b.csv",
    "logs/tue/deep/d.csv",
];

/// Their results below `out`.
const RESULTS: [&str; 4] = [
    "a.torque.csv",
    "mon day/c.torque.csv",
    "mon day/ü b.torque.csv",
    "tue/deep/d.torque.csv",
];

const MANY: [&str; 6] = ["compensate", "logs", "--stand", "stand.toml", "-o", "out/"];

pub fn log(i: usize) -> String {
    let (shown, _) = steady(
        &[(1.0 + i as f64, 60.0, 0.0), (0.3, 1200.0, 1.0)],
        20_000.0,
        6_000,
    );
    record(&shown, 20_000.0)
}

fn folder() -> Folder {
    let folder = Folder::new();
    for (i, name) in LOGS.iter().enumerate() {
        put(&folder, name, log(i));
    }
    folder
}

/// Writes a file, creating its folders.
pub fn put(folder: &Folder, name: &str, content: impl AsRef<[u8]>) {
    let path = folder.path(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, content).unwrap();
}

/// All files below a folder with their bytes, by path; empty if the folder does not exist.
fn files(root: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => folders.push(path),
                false => {
                    let name = path.strip_prefix(root).unwrap().to_str().unwrap();
                    // A temporary file may have been removed meanwhile.
                    if let Ok(bytes) = std::fs::read(&path) {
                        found.insert(name.to_owned(), bytes);
                    }
                }
            }
        }
    }
    found
}

/// The results below `out`, without the manifest.
fn results(folder: &Folder) -> BTreeMap<String, Vec<u8>> {
    let mut found = files(&folder.path("out"));
    found.remove("torqcomp-manifest.jsonl");
    found
}

/// The lines of the manifest about recordings.
fn manifest(folder: &Folder) -> Vec<Value> {
    let text = folder.read("out/torqcomp-manifest.jsonl");
    let line = |line: &str| serde_json::from_str::<Value>(line).expect("a JSON line");
    let lines = text.lines().map(line);
    lines.filter(|line| line.get("exit").is_some()).collect()
}

pub fn with<'a>(args: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
    [args, more].concat()
}

#[test]
fn results_mirror_the_tree_and_have_the_bytes_of_single_runs() {
    let folder = folder();
    folder
        .run(&MANY)
        .says(0, &["4 recordings into out/: 4 done", "rms"]);
    let found = results(&folder);
    assert_eq!(found.keys().collect::<Vec<_>>(), RESULTS);
    for (log, result) in LOGS.iter().zip(RESULTS) {
        let single = ["compensate", log, "--stand", "stand.toml", "--threads", "2"];
        let ran = folder.run(&single);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        assert!(ran.stdout.as_bytes() == found[result], "{result} differs");
    }
}

#[test]
fn the_number_of_workers_changes_nothing() {
    let folder = folder();
    let mut runs = Vec::new();
    for jobs in ["1", "2", "7"] {
        let out = format!("out{jobs}/");
        let table = format!("table{jobs}.csv");
        let args = [
            "compensate",
            "logs",
            "--stand",
            "stand.toml",
            "--jobs",
            jobs,
            "-o",
            &out,
            "--summary",
            &table,
            "--plot",
            "{stem}.svg",
        ];
        assert_eq!(folder.run(&args).code, 0);
        let mut found = files(&folder.path(&out));
        found.remove("torqcomp-manifest.jsonl");
        assert_eq!(found.len(), 8);
        runs.push((found, folder.read(&table)));
    }
    assert!(runs[0] == runs[1] && runs[0] == runs[2]);
    let rows: Vec<&str> = runs[0].1.lines().collect();
    assert_eq!(rows.len(), 5);
    assert!(rows[0].starts_with("file,exit,samples,rate_hz,band_hz,unit,rms,peak,noise_rms,"));
    assert!(rows[1].starts_with("a.csv,0,6000,20000,"), "{}", rows[1]);
}

#[test]
fn the_manifest_names_content_by_its_sha_256() {
    let folder = folder();
    // FIPS 180-2 has no sums of these files: the system's own program does.
    assert_eq!(folder.run(&with(&MANY, &["--band", "800"])).code, 0);
    for line in manifest(&folder) {
        let input = line["input"].as_str().unwrap();
        let output = &line["outputs"][0];
        let result = format!("out/{}", output["file"].as_str().unwrap());
        for (path, sum) in [
            (input, &line["input_sha256"]),
            ("stand.toml", &line["stand_sha256"]),
            (&result, &output["sha256"]),
        ] {
            let ran = std::process::Command::new("sha256sum")
                .arg(folder.path(path))
                .output()
                .expect("sha256sum");
            let said = String::from_utf8_lossy(&ran.stdout);
            let said = said.trim_start_matches('\\');
            assert_eq!(said.split(' ').next(), sum.as_str(), "{path}");
        }
        assert_eq!(line["options"], serde_json::json!(["--band=800"]));
        assert_eq!(line["exit"], 0);
        assert_eq!(line["version"], env!("CARGO_PKG_VERSION"));
    }
}

#[test]
fn a_bad_recording_stops_no_other() {
    let folder = folder();
    put(&folder, "logs/b.csv", log(1).replace("\n0.25,", "\n0.25,x"));
    put(&folder, "logs/empty.csv", "");
    put(&folder, "logs/README.md", "# What was done\n\nNothing.\n");
    let table = with(&MANY, &["--summary", "table.csv"]);
    folder.run(&table).says(
        1,
        &[
            "failed: logs/b.csv, line 5002",
            "failed: logs/empty.csv",
            "2 of 6 recordings failed; the others are done",
            "skipped, not recordings judging by their content: logs/README.md",
        ],
    );
    assert_eq!(results(&folder).keys().collect::<Vec<_>>(), RESULTS);
    let failed = manifest(&folder)
        .into_iter()
        .filter(|line| line["exit"] == 1);
    assert_eq!(failed.count(), 2);
    let table = folder.read("table.csv");
    assert!(
        table.lines().any(|row| row.starts_with("b.csv,1,,,")),
        "{table}"
    );
}

#[test]
fn lost_data_are_code_3() {
    let folder = folder();
    let whole = std::fs::read(workplace().join("made/ros2.mcap")).unwrap();
    put(&folder, "runs/cut.mcap", &whole[..whole.len() / 2]);
    put(&folder, "runs/whole.mcap", &whole);
    let args = [
        "extract",
        "runs",
        "--signal",
        "/joint_states.effort[0]",
        "-o",
        "out/",
    ];
    folder.run(&args).says(
        3,
        &[
            "incomplete: runs/cut.mcap: data were lost",
            "2 recordings into out/: 2 done",
        ],
    );
    // No sample lies within --plot-range.
    let warned = [
        "--plot",
        "{stem}.svg",
        "--plot-range",
        "100..101",
        "--strict",
    ];
    folder
        .run(&with(&MANY, &warned))
        .says(3, &["empty-plot in 4", "incomplete: logs/a.csv"]);
}

#[test]
fn failures_end_the_run_where_asked() {
    let folder = Folder::new();
    for i in 0..6 {
        put(
            &folder,
            &format!("logs/{i}.csv"),
            if i < 3 { "x\n".to_owned() } else { log(i) },
        );
    }
    let fast = folder.run(&with(&MANY, &["--jobs", "1", "--fail-fast"]));
    fast.says(1, &["1 of 6 recordings failed, 5 were not started"]);
    let two = folder.run(&with(&MANY, &["--jobs", "1", "--max-failures", "2"]));
    two.says(1, &["2 of 6 recordings failed, 4 were not started"]);
    // The report says which failed: an additional JSON failure would make the output unparsable.
    let report = folder.run(&with(&MANY, &["--jobs", "1", "--fail-fast", "--json"]));
    let report: Value = serde_json::from_str(&report.stdout).expect("one JSON document");
    assert_eq!(report["schema"], "torqcomp.batch/1");
    let all = folder.run(&with(&MANY, &["--jobs", "1", "--max-failures", "4"]));
    all.says(1, &["3 of 6 recordings failed; the others are done"]);
    assert_eq!(results(&folder).len(), 3);
    let bad = ["compensate", "logs/0.csv", "logs/1.csv"];
    let none = folder.run(&with(&bad, &MANY[2..]));
    none.says(1, &["2 of 2 recordings failed\n"]);
}

/// Number of recordings that a run with `--skip-existing` made and skipped.
fn made_and_skipped(folder: &Folder, args: &[&str]) -> (u64, u64) {
    let ran = folder.run(&with(args, &["--skip-existing", "--json"]));
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let report: Value = serde_json::from_str(&ran.stdout).expect("one JSON document");
    assert_eq!(report["schema"], "torqcomp.batch/1");
    let count = |name: &str| report[name].as_u64().expect("a count");
    (count("made"), count("skipped"))
}

#[test]
fn results_are_skipped_only_if_they_were_made_from_the_same() {
    let folder = folder();
    assert_eq!(made_and_skipped(&folder, &MANY), (4, 0));
    assert_eq!(made_and_skipped(&folder, &MANY), (0, 4));
    // A touched file has the same content.
    folder.write("stand.toml", HERTEL);
    folder.write(LOGS[0], log(0));
    assert_eq!(made_and_skipped(&folder, &MANY), (0, 4));
    folder.write(LOGS[1], log(9));
    assert_eq!(made_and_skipped(&folder, &MANY), (1, 3));
    folder.write(&format!("out/{}", RESULTS[2]), "touched\n");
    assert_eq!(made_and_skipped(&folder, &MANY), (1, 3));
    std::fs::remove_file(folder.path(&format!("out/{}", RESULTS[3]))).unwrap();
    assert_eq!(made_and_skipped(&folder, &MANY), (1, 3));
    folder.write("stand.toml", HERTEL.replace("3.07", "3.08"));
    assert_eq!(made_and_skipped(&folder, &MANY), (4, 0));
    let band = with(&MANY, &["--band", "800"]);
    assert_eq!(made_and_skipped(&folder, &band), (4, 0));
    // Options spelled differently, and other numbers of workers.
    let same = with(&MANY, &["--band=800", "--jobs", "1", "--threads", "1"]);
    assert_eq!(made_and_skipped(&folder, &same), (0, 4));
    let found = results(&folder);
    std::fs::remove_dir_all(folder.path("out")).unwrap();
    assert_eq!(made_and_skipped(&folder, &band), (4, 0));
    assert!(results(&folder) == found);
}

#[test]
fn files_that_no_manifest_knows_are_kept() {
    let folder = folder();
    put(&folder, "out/a.torque.csv", "precious\n");
    for more in [&[][..], &["--skip-existing"]] {
        let ran = folder.run(&with(&MANY, more));
        ran.says(
            1,
            &[
                "failed: logs/a.csv",
                "out/a.torque.csv: the output exists",
                "--force",
            ],
        );
        assert_eq!(folder.read("out/a.torque.csv"), "precious\n");
    }
    assert_eq!(folder.run(&with(&MANY, &["--force"])).code, 0);
    assert_eq!(folder.read("out/a.torque.csv").lines().count(), 6_001);
    // Another tree with the same names.
    put(&folder, "other/a.csv", log(5));
    let other = [
        "compensate",
        "other",
        "--stand",
        "stand.toml",
        "-o",
        "out/",
        "--skip-existing",
    ];
    folder
        .run(&other)
        .says(1, &["out/a.torque.csv: the output exists"]);
}

#[cfg(unix)]
#[test]
fn a_killed_run_goes_on_where_it_was() {
    let folder = Folder::new();
    for i in 0..30 {
        put(&folder, &format!("logs/{i}.csv"), log(i));
    }
    let args = with(&MANY, &["--jobs", "2"]);
    let mut child = command(&folder.path(""), &args)
        .stdin(Stdio::null())
        .spawn()
        .expect("the binary starts");
    let lines = || {
        let text = std::fs::read(folder.path("out/torqcomp-manifest.jsonl")).unwrap_or_default();
        text.iter().filter(|byte| **byte == b'\n').count()
    };
    while lines() < 6 && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let before = lines();
    let before = before - 1;
    assert!((5..30).contains(&before), "{before} lines");
    // As if killed in the middle of a line.
    let mut cut = std::fs::read(folder.path("out/torqcomp-manifest.jsonl")).unwrap();
    cut.extend_from_slice(b"{\"schema\":\"torqcomp.manifest/1\",\"vers");
    folder.write("out/torqcomp-manifest.jsonl", cut);
    let (made, skipped) = made_and_skipped(&folder, &MANY);
    assert_eq!(made + skipped, 30);
    // Each worker had at most one synced line whose result was not yet renamed.
    assert!(skipped as usize >= before - 2, "{skipped} of {before}");
    let found = results(&folder);
    assert_eq!(found.len(), 30, "{:?}", found.keys());
    std::fs::remove_dir_all(folder.path("out")).unwrap();
    assert_eq!(folder.run(&MANY).code, 0);
    assert!(results(&folder) == found);
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_no_temporary_file() {
    let folder = Folder::new();
    for i in 0..30 {
        put(&folder, &format!("logs/{i}.csv"), log(i));
    }
    let mut child = command(&folder.path(""), &MANY)
        .stdin(Stdio::null())
        .spawn()
        .expect("the binary starts");
    while results(&folder).len() < 3 {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    signal("TERM", &child);
    assert_eq!(child.wait().expect("the binary ends").code(), Some(143));
    let left = results(&folder);
    assert!(
        left.keys().all(|name| name.ends_with(".torque.csv")),
        "{:?}",
        left.keys()
    );
}

#[test]
fn a_dry_run_writes_nothing() {
    let folder = folder();
    let before = files(&folder.path(""));
    let args = with(&MANY, &["--dry-run", "--summary", "table.csv"]);
    let ran = folder.run(&args);
    ran.says(0, &[]);
    assert!(
        ran.stdout
            .contains("make: logs/mon day/ü b.csv -> out/mon day/ü b.torque.csv\n"),
        "{}",
        ran.stdout
    );
    assert_eq!(ran.stdout.lines().count(), 4);
    assert!(files(&folder.path("")) == before);
    assert!(!folder.path("out").exists());
    assert_eq!(folder.run(&MANY).code, 0);
    folder.write(LOGS[0], log(7));
    let ran = folder.run(&with(&MANY, &["--dry-run", "--skip-existing"]));
    let words: Vec<&str> = ran
        .stdout
        .lines()
        .filter_map(|l| l.split(':').next())
        .collect();
    assert_eq!(words, ["replace", "skip", "skip", "skip"]);
    let ran = folder.run(&with(&MANY, &["--dry-run"]));
    assert!(
        ran.stdout.lines().all(|l| l.starts_with("fail (exists): ")),
        "{}",
        ran.stdout
    );
}

#[test]
fn patterns_are_expanded_without_a_shell() {
    let folder = folder();
    put(&folder, "logs/star*.csv", log(5));
    let run = |pattern: &str| {
        let _ = std::fs::remove_dir_all(folder.path("out"));
        let args = ["compensate", pattern, "--stand", "stand.toml", "-o", "out/"];
        let ran = folder.run(&args);
        assert_eq!(ran.code, 0, "{pattern}: {}", ran.stderr);
        results(&folder).into_keys().collect::<Vec<_>>()
    };
    assert_eq!(run("logs/m*/[a-c].csv"), ["mon day/c.torque.csv"]);
    assert_eq!(run("logs/?.csv"), ["a.torque.csv"]);
    assert_eq!(
        run("logs/**/*.csv"),
        [
            "a.torque.csv",
            "mon day/c.torque.csv",
            "mon day/ü b.torque.csv",
            "star*.torque.csv",
            "tue/deep/d.torque.csv"
        ]
    );
    // A file with that literal name takes precedence.
    assert_eq!(run("logs/star*.csv"), ["star*.torque.csv"]);
    let none = [
        "compensate",
        "logs/*.dat",
        "--stand",
        "stand.toml",
        "-o",
        "out/",
    ];
    folder.run(&none).says(1, &["logs/*.dat: matches no file"]);
}

#[test]
fn a_list_of_paths_keeps_their_folders() {
    let folder = folder();
    put(&folder, "logs/line\nend.csv", log(5));
    let args = [
        "extract",
        "--files-from",
        "-",
        "-0",
        "-o",
        "out/",
        "--name",
        "{name}.rows",
    ];
    let ran = folder.pipe(
        &args,
        "logs/mon day/ü b.csv\0logs/line\nend.csv\0".as_bytes(),
    );
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let found: Vec<String> = results(&folder).into_keys().collect();
    assert_eq!(
        found,
        ["logs/line\nend.csv.rows", "logs/mon day/ü b.csv.rows"]
    );
    folder.write("list.txt", "logs/a.csv\r\nlogs/none.csv\r\n");
    let args = ["extract", "--files-from", "list.txt", "-o", "listed/"];
    folder
        .run(&args)
        .says(1, &["failed: logs/none.csv", "1 of 2 recordings failed"]);
    assert!(folder.path("listed/logs/a.rows.csv").exists());
    let empty = folder.pipe(&["extract", "--files-from", "-", "-o", "out/"], b"");
    empty.says(0, &["0 recordings into out/"]);
}

#[test]
fn results_never_take_the_place_of_each_other_or_of_a_recording() {
    let folder = folder();
    put(&folder, "logs/a.dat", log(3));
    folder.run(&MANY).says(
        2,
        &[
            "logs/a.csv and logs/a.dat would both become a.torque.csv",
            "--name",
        ],
    );
    assert_eq!(
        folder
            .run(&with(&MANY, &["--name", "{name}.torque.csv"]))
            .code,
        0
    );
    std::fs::remove_file(folder.path("logs/a.dat")).unwrap();
    let over = [
        "compensate",
        "logs",
        "--stand",
        "stand.toml",
        "-o",
        "logs/",
        "--name",
        "{name}",
        "--force",
    ];
    folder
        .run(&over)
        .says(2, &["would overwrite the recording"]);
    assert_eq!(folder.read("logs/a.csv"), log(0));
    // Results next to the recordings are not recordings for the next run, nor are stand file and
    // summary.
    folder.write("logs/stand.toml", HERTEL);
    let beside = [
        "compensate",
        "logs",
        "--stand",
        "logs/stand.toml",
        "-o",
        "logs/",
        "--summary",
        "logs/table.csv",
    ];
    for (made, skipped) in [(4, 0), (0, 4)] {
        assert_eq!(made_and_skipped(&folder, &beside), (made, skipped));
    }
}

#[test]
fn what_needs_a_folder_says_so() {
    let folder = folder();
    let two = ["compensate", LOGS[0], LOGS[1], "--stand", "stand.toml"];
    folder.run(&two).says(2, &["-o FOLDER/"]);
    let tree = ["compensate", "logs", "--stand", "stand.toml"];
    folder.run(&tree).says(1, &["logs: ", "-o FOLDER/"]);
    folder
        .run(&with(&two, &["-o", "all.csv"]))
        .says(2, &["all.csv names a file"]);
    folder
        .run(&with(&two, &["-o", "stand.toml"]))
        .says(2, &["names a file"]);
    folder
        .run(&with(&two, &["-o", "out", "--html", "a.html"]))
        .says(2, &["--html a.html", "{stem}"]);
    folder
        .run(&with(&MANY, &["-"]))
        .says(2, &["standard input"]);
    folder
        .run(&with(&MANY, &["--name", "x.csv"]))
        .says(2, &["{stem}"]);
    let broken = ["compensate", "logs", "--stand", "logs/a.csv", "-o", "out/"];
    assert_eq!(folder.run(&broken).code, 1);
    assert!(!folder.path("out").exists());
    std::fs::create_dir(folder.path("none")).unwrap();
    folder.write("none/notes.txt", "nothing\n");
    let none = ["extract", "none", "-o", "out/"];
    folder
        .run(&none)
        .says(1, &["none: no recordings found", "none of its files (1)"]);
}

#[test]
fn every_verb_that_reads_one_record_takes_many() {
    let folder = folder();
    for (args, ending) in [
        (&["extract"][..], "rows.csv"),
        (
            &[
                "harmonics",
                "--stand",
                "stand.toml",
                "--fundamental",
                "60",
                "--orders",
                "1",
            ],
            "harmonics.txt",
        ),
        (&["inspect", "--json"], "inspect.json"),
        (
            &["simulate", "--stand", "stand.toml", "--unit", "N m"],
            "simulated.csv",
        ),
    ] {
        let _ = std::fs::remove_dir_all(folder.path("out"));
        let ran = folder.run(&with(args, &["logs", "-o", "out/"]));
        assert_eq!(ran.code, 0, "{args:?}: {}", ran.stderr);
        let found = results(&folder);
        assert_eq!(found.len(), 4);
        for (log, (name, bytes)) in LOGS.iter().zip(&found) {
            assert!(name.ends_with(ending), "{name}");
            let single = folder.run(&with(args, &[log]));
            assert!(
                single.stdout.as_bytes() == bytes,
                "{args:?}: {name} differs"
            );
        }
    }
    // Without a folder for the reports, inspect compares the files.
    let both = folder.json(&["inspect", "logs/mon day", "--json"]);
    assert_eq!(both["files"].as_array().unwrap().len(), 2);
}

/// Whichever call of a run fails, each existing result has a line in the manifest.
#[cfg(debug_assertions)]
#[test]
fn a_manifest_that_cannot_be_written_leaves_no_result_unexplained() {
    let folder = folder();
    for fault in [
        "write 1 28",
        "sync 0 5",
        "sync 2 5",
        "rename 1 5",
        "rename 2 abort",
        "write 3 abort",
    ] {
        let _ = std::fs::remove_dir_all(folder.path("out"));
        let ran = command(&folder.path(""), &with(&MANY, &["--jobs", "1"]))
            .env("TORQCOMP_FAULT", fault)
            .output()
            .expect("it ends");
        assert_ne!(ran.status.code(), Some(0), "{fault}");
        let known: Vec<String> = manifest(&folder)
            .iter()
            .flat_map(|line| line["outputs"].as_array().unwrap().clone())
            .map(|output| output["file"].as_str().unwrap().to_owned())
            .collect();
        let found = results(&folder);
        let found = found.keys().filter(|name| !name.ends_with(".part"));
        for name in found {
            assert!(known.contains(name), "{fault}: {name} is not in {known:?}");
        }
        assert!(made_and_skipped(&folder, &MANY).0 > 0, "{fault}");
        assert_eq!(results(&folder).len(), 4, "{fault}");
    }
}

#[test]
fn each_recording_is_in_one_part() {
    let folder = folder();
    let mut listed = Vec::new();
    for shard in ["1/3", "2/3", "3/3"] {
        let dry = folder.run(&with(&MANY, &["--dry-run", "--shard", shard]));
        listed.extend(dry.stdout.lines().map(str::to_owned));
        assert_eq!(folder.run(&with(&MANY, &["--shard", shard])).code, 0);
    }
    listed.sort();
    listed.dedup();
    assert_eq!(listed.len(), 4);
    assert!(folder.path("out/torqcomp-manifest.3-of-3.jsonl").exists());
}
