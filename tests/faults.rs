//! Every call of a run that opens, creates, reads, writes, syncs, links or renames a file is made to fail, one per run:
//! only the old files or the new ones remain, with a message and exit code 1. An interrupted call, or one that moves
//! only one byte, changes nothing. After a kill, each file is old or new, and the next run removes the remainder.
//!
//! Short by default: the first and the last call of each kind. All of them:
//!
//! ```text
//! TORQCOMP_FAULTS=all cargo test --test tests faults
//! ```

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use crate::golden::{words, workplace};
use crate::util::{Folder, HERTEL};

/// All commands that write, with as many inputs and outputs as possible; names that begin with `out` are
/// outputs.
const RUNS: [&str; 23] = [
    "compensate made/short.csv --channel bridge --stand stands/declared.toml -o out.csv --plot out.svg --html out.html --json",
    "compensate made/short.csv --channel bridge --stand stands/cubic.toml -o out.csv --no-sync",
    "compensate made/short.csv --channel bridge --stand stands/declared.toml --with-recorded",
    "compensate made/blocks.mcap --topic /bridge --field data[:] --spacing dt --unit V --stand stands/declared.toml -o out.mcap",
    "extract made/short.csv --channel speed -o out.csv",
    "extract made/ros2.mcap --signal /joint_states.effort[0] -o out.csv",
    "extract made/short.csv --channel speed -o out.csv --log run.jsonl --quiet",
    "harmonics made/short.csv --channel bridge --stand stands/declared.toml --fundamental 60 --orders 1,2 -o out.txt",
    "table --stand stands/declared.toml --step 100 -o out.csv",
    "predict --stand stands/drawing.toml -o out.txt --json",
    "inspect made/blocks.mcap -o out.txt --json",
    "inspect made/short.csv -o out.txt --plot out.svg",
    "identify decay made/decay.csv --stand stands/declared.toml -o out.toml --html out.html --json",
    "identify response made/periods.csv --applied force --measured beam --band 20..150 --modes 1 --excitation periodic --period 500 -o out.toml --html out.html",
    "identify runup made/runup.csv --motion angle --torque torque -o out.toml",
    "identify static recordings/loads.csv --load weight --reading bridge -o out.toml --html out.html",
    "simulate made/sweep.csv --applied load --stand stands/cubic.toml -o out.csv --json",
    "diagnose --stand stands/declared.toml --train made/none_train.csv --range 0..0.03 --applied applied_n_m --measured measured_n_m -o out.toml --html out.html",
    "init --from unknown -o out.toml",
    "man compensate -o out.1",
    "completions bash -o out.sh",
    "schema table -o out.json",
    "merge logs/torqcomp-manifest.jsonl -o out.csv",
];
/// Commands that read no file.
const WITHOUT_INPUT: [&str; 4] = ["init", "man", "completions", "schema"];
/// Commands that make the manifest to be merged.
const BEFORE_MERGE: [&str; 6] = [
    "extract",
    "made/short.csv",
    "--channel",
    "speed",
    "-o",
    "logs/",
];

/// Previous content of an output; `identify` updates a stand file.
fn old(name: &str) -> &'static [u8] {
    match name.ends_with(".toml") {
        true => HERTEL.as_bytes(),
        false => b"precious\n",
    }
}

const EIO: &str = "5";
const ENOSPC: &str = "28";
const EINTR: &str = "4";

/// Possible failures of a kind of call.
fn endings(call: &str) -> &'static [&'static str] {
    match call {
        "open" => &[EIO],
        "create" | "unnamed" => &[ENOSPC],
        "read" => &[EIO, EINTR, "short"],
        "write" => &[ENOSPC, EINTR, "short", "abort"],
        "sync" => &[EIO, "abort"],
        "link" | "rename" => &[EIO, "abort"],
        other => panic!("{other} has no fault"),
    }
}

/// A run of one of the commands in its own folder.
struct Run {
    folder: Folder,
    words: Vec<String>,
    outputs: Vec<String>,
}

impl Run {
    fn of(command: &str) -> Self {
        let mut words = words(command);
        let folder = Folder::new();
        if words[0] == "merge" {
            let mut before = BEFORE_MERGE.map(str::to_owned);
            before[1] = workplace()
                .join(&before[1])
                .to_str()
                .expect("a path")
                .to_owned();
            let ran = folder.run(&before.each_ref().map(String::as_str));
            assert_eq!(ran.code, 0, "{}", ran.stderr);
        }
        let is_input = |word: &String| workplace().join(word).is_file();
        let outputs = words.iter().filter(|word| word.starts_with("out"));
        let outputs: Vec<String> = outputs.cloned().collect();
        if !outputs.is_empty() && !words.iter().any(|word| word == "--force") {
            words.push("--force".to_owned());
        }
        for word in words.iter_mut().filter(|word| is_input(word)) {
            *word = workplace().join(&word).to_str().expect("a path").to_owned();
        }
        Self {
            folder,
            words,
            outputs,
        }
    }

    fn command(&self) -> Command {
        for name in &self.outputs {
            self.folder.write(name, old(name));
        }
        let mut command = Command::new(env!("CARGO_BIN_EXE_torqcomp"));
        command
            .args(&self.words)
            .current_dir(self.folder.path(""))
            .env("SOURCE_DATE_EPOCH", "1700000000")
            .stdin(Stdio::null());
        command
    }

    fn with_fault(&self, fault: &str) -> Output {
        let output = self.command().env("TORQCOMP_FAULT", fault).output();
        output.expect("the binary starts")
    }

    /// Which of the outputs are unchanged.
    fn is_old(&self, files: &[Vec<u8>]) -> impl Iterator<Item = bool> {
        let pairs = self.outputs.iter().zip(files);
        pairs.map(|(name, file)| file == old(name))
    }

    fn files(&self) -> Vec<Vec<u8>> {
        let read = |name: &String| fs::read(self.folder.path(name)).unwrap_or_default();
        self.outputs.iter().map(read).collect()
    }
}

/// Number of calls of each kind in a run, and its results.
fn undisturbed(run: &Run) -> (BTreeMap<String, usize>, Output, Vec<Vec<u8>>) {
    let log: PathBuf = run.folder.path("calls");
    let output = run.command().env("TORQCOMP_FAULT_LOG", &log).output();
    let output = output.expect("the binary starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{:?}: {said}", run.words);
    let mut calls = BTreeMap::new();
    for call in fs::read_to_string(&log).expect("the calls").lines() {
        *calls.entry(call.to_owned()).or_default() += 1;
    }
    fs::remove_file(&log).expect("the calls");
    let files = run.files();
    assert!(run.is_old(&files).all(|is_old| !is_old), "{:?}", run.words);
    assert!(files.iter().all(|file| !file.is_empty()), "{:?}", run.words);
    (calls, output, files)
}

/// The problem after a fault, if any.
fn wrong(run: &Run, fault: &str, new: &(Output, Vec<Vec<u8>>)) -> Option<String> {
    let ending = fault.rsplit(' ').next().expect("an ending");
    let output = run.with_fault(fault);
    let said = String::from_utf8_lossy(&output.stderr);
    let files = run.files();
    let is_old = run.is_old(&files).all(|is_old| is_old);
    let is_new = files == new.1;
    let mut pairs = files.iter().zip(&new.1).zip(run.is_old(&files));
    let is_either = pairs.all(|((file, new), is_old)| is_old || file == new);
    let is_tidy = |run: &Run| {
        !run.folder
            .names()
            .iter()
            .any(|name| name.ends_with(".part"))
    };
    if ending == "abort" {
        let next = run.command().output().expect("the binary starts");
        return match (
            output.status.code(),
            is_either,
            run.files() == new.1,
            is_tidy(run),
        ) {
            (Some(code), ..) => Some(format!("ended with {code}, not by a signal")),
            (_, false, ..) => Some("a file is neither old nor new".to_owned()),
            (.., false, _) => Some(format!("the next run ended with {}", next.status)),
            // The creator of a temporary file, and whether that process has ended, is known only on
            // Linux.
            (.., false) if cfg!(target_os = "linux") => Some(format!("{:?}", run.folder.names())),
            _ => None,
        };
    }
    match output.status.code() {
        _ if !is_tidy(run) => Some(format!("left {:?}", run.folder.names())),
        Some(0) if !is_new => {
            Some("code 0, and the files are not those of an undisturbed run".to_owned())
        }
        Some(0) if output.stdout != new.0.stdout => {
            Some("code 0, and standard output differs".to_owned())
        }
        Some(0) if has_failed(&said) => Some(format!("code 0, but {said}")),
        Some(0) => None,
        _ if ending == EINTR || ending == "short" => Some(format!("not repeated: {said}")),
        Some(1) if !is_old && !is_new => Some("neither the old files nor the new ones".to_owned()),
        Some(1) if !said.starts_with("torqcomp: ") => Some(format!("said {said:?}")),
        Some(1) => None,
        code => Some(format!("exit code {code:?}: {said}")),
    }
}

/// Whether something could not be done, by what was said beside warnings.
fn has_failed(said: &str) -> bool {
    let mut lines = said.lines();
    lines.any(|line| line.contains("cannot") && !line.starts_with("torqcomp: warning"))
}

/// The indices of the calls that are made to fail, out of `count`.
fn chosen(count: usize) -> Vec<usize> {
    match std::env::var("TORQCOMP_FAULTS").is_ok_and(|all| all == "all") || count <= 2 {
        true => (0..count).collect(),
        false => vec![0, count - 1],
    }
}

fn attack(command: &str) -> Vec<String> {
    let run = Run::of(command);
    let (calls, output, files) = undisturbed(&run);
    let writes = calls.get("write").is_some_and(|count| *count > 0);
    let reads = calls.contains_key("read");
    let may_read = !WITHOUT_INPUT.contains(&run.words[0].as_str());
    assert!(writes && reads == may_read, "{command}: {calls:?}");
    let new = (output, files);
    let mut found = Vec::new();
    for (call, count) in &calls {
        for number in chosen(*count) {
            for ending in endings(call) {
                let fault = format!("{call} {number} {ending}");
                if let Some(what) = wrong(&run, &fault, &new) {
                    found.push(format!(
                        "TORQCOMP_FAULT=\"{fault}\" torqcomp {command}: {what}"
                    ));
                }
            }
        }
    }
    found
}

#[test]
fn whatever_call_fails_the_old_files_or_the_new_ones_are_there() {
    let found: Vec<String> = std::thread::scope(|scope| {
        let (even, odd): (Vec<_>, Vec<_>) = RUNS.iter().enumerate().partition(|(i, _)| i % 2 == 0);
        let threads = [even, odd].map(|half| {
            scope.spawn(move || -> Vec<String> {
                half.into_iter()
                    .flat_map(|(_, command)| attack(command))
                    .collect()
            })
        });
        threads
            .into_iter()
            .flat_map(|thread| thread.join().expect("it ends"))
            .collect()
    });
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// Every command that writes is among those tested.
#[test]
fn every_verb_is_attacked() {
    let help = Command::new(env!("CARGO_BIN_EXE_torqcomp"))
        .arg("--help")
        .output();
    let help = String::from_utf8(help.expect("the help").stdout).expect("UTF-8");
    let verbs = help.split("Commands:").nth(1).expect("the verbs");
    for line in verbs.lines().skip(1).take_while(|line| !line.is_empty()) {
        let verb = line.split_whitespace().next().expect("a verb");
        let is_here = RUNS.iter().any(|run| run.starts_with(verb));
        assert!(
            is_here || verb == "help",
            "{verb} is not attacked: add a run of it"
        );
    }
}
