//! Complete outputs of every command: text, JSON, exit code, standard error and the files written, including SVG and
//! HTML.
//!
//! `cases/VERB/NAME.txt` contains commands (lines that begin with `$ `) and their outputs. To add a case, write its
//! commands only and accept the output. To accept a deliberate change, with the reason in the commit:
//!
//! ```text
//! SNAPSHOTS=overwrite cargo test --test tests golden
//! git diff tests/golden
//! ```
//!
//! Commands run in a folder with `examples/`, `recordings/` (from `tests/recordings`), `stands/` (from
//! `tests/golden/stands`) and `made/` (the files of [`made`]); `OUT` is a folder of the case. `< FILE` feeds standard
//! input. Machines differ in the last bits of a number, so decimal numbers are rounded to nine digits, and count as
//! equal within a relative difference of 1e-6, or of the tolerance in a line `# tolerance 1e-3` above the commands.

mod made;
pub mod settle;

use std::fmt::Write as _;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use snapbox::Data;
use snapbox::assert::DEFAULT_ACTION_ENV;

/// The folder of the project.
const PROJECT: &str = env!("CARGO_MANIFEST_DIR");

macro_rules! verbs {
    ($($verb:ident),*) => {
        $(#[test]
        fn $verb() {
            check(stringify!($verb));
        })*
        const VERBS: &[&str] = &[$(stringify!($verb)),*];
    };
}

verbs!(
    compensate, diagnose, dialects, extract, failures, general, harmonics, identify, inspect,
    predict, simulate, table
);

/// A folder of cases without a test would go unnoticed.
#[test]
fn every_folder_of_cases_is_run() {
    let mut found: Vec<String> = fs::read_dir(Path::new(PROJECT).join("tests/golden/cases"))
        .expect("the folder of cases")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .into_string()
                .expect("a name")
        })
        .collect();
    found.sort();
    assert_eq!(found, VERBS);
}

/// Runs all cases of a command, and fails with the difference of each that changed.
fn check(verb: &str) {
    let folder = Path::new(PROJECT).join("tests/golden/cases").join(verb);
    let mut cases: Vec<PathBuf> = fs::read_dir(&folder)
        .expect("the cases of the verb")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    cases.sort();
    let assert = snapbox::Assert::new().action_env(DEFAULT_ACTION_ENV);
    let mut wrong = String::new();
    for case in &cases {
        let expected = fs::read_to_string(case).expect("a text");
        let actual = settle::settle(&expected, &run(verb, case, &expected));
        let expected = Data::read_from(case, Some(snapbox::data::DataFormat::Text)).raw();
        if let Err(difference) = assert.try_eq(Some(&"this run"), actual.into(), expected) {
            let _ = writeln!(wrong, "{difference}");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// The folder that the commands run in.
pub fn workplace() -> &'static Path {
    static PLACE: OnceLock<PathBuf> = OnceLock::new();
    PLACE.get_or_init(|| {
        let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("golden");
        let _ = fs::remove_dir_all(&place);
        let project = Path::new(PROJECT);
        for (from, to) in [
            ("examples/hertel", "examples/hertel"),
            ("tests/recordings", "recordings"),
            ("tests/golden/stands", "stands"),
        ] {
            copy(&project.join(from), &place.join(to));
        }
        let made = place.join("made");
        fs::create_dir_all(&made).expect("a folder");
        for (name, content) in made::files() {
            fs::write(made.join(name), content).expect("the folder can be written");
        }
        place
    })
}

/// Copies the files of a folder.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("the folder is there") {
        let path = entry.expect("an entry").path();
        if path.is_file() {
            fs::copy(&path, to.join(path.file_name().expect("a name"))).expect("a copy");
        }
    }
}

/// Output of the commands of a case, in the form of the golden file.
fn run(verb: &str, case: &Path, expected: &str) -> String {
    let name = case.file_stem().and_then(|s| s.to_str()).expect("a name");
    let out = format!("out/{verb}-{name}");
    fs::create_dir_all(workplace().join(&out)).expect("a folder");
    let mut text: String = expected
        .lines()
        .take_while(|line| line.starts_with("# "))
        .map(|line| format!("{line}\n"))
        .collect();
    let mut known = Vec::new();
    for command in expected.lines().filter_map(|line| line.strip_prefix("$ ")) {
        let _ = writeln!(text, "$ {command}");
        let output = execute(&command.replace("OUT", &out));
        let _ = writeln!(
            text,
            "exit code {}",
            output.status.code().expect("an exit code")
        );
        section(&mut text, "standard output", &output.stdout);
        section(&mut text, "standard error", &output.stderr);
        for file in files(&workplace().join(&out)) {
            let content = fs::read(&file).expect("the file can be read");
            if !known.contains(&(file.clone(), content.clone())) {
                let name = file.file_name().and_then(|n| n.to_str()).expect("a name");
                section(&mut text, name, &content);
                known.push((file, content));
            }
        }
    }
    text
}

/// Words of the commands of all cases, without the name of the program; `OUT/` is a folder.
pub fn commands() -> Vec<Vec<String>> {
    let folders = files(&Path::new(PROJECT).join("tests/golden/cases"));
    let cases = folders.iter().flat_map(|folder| files(folder));
    let text = |case: PathBuf| fs::read_to_string(case).expect("a text");
    let lines = |text: String| -> Vec<String> {
        let commands = text
            .lines()
            .filter_map(|line| line.strip_prefix("$ torqcomp "));
        commands.map(str::to_owned).collect()
    };
    cases
        .flat_map(|case| lines(text(case)))
        .map(|line| words(&line))
        .collect()
}

/// Runs a command line.
fn execute(command: &str) -> std::process::Output {
    let mut words = words(command);
    assert_eq!(words.remove(0), "torqcomp", "{command}");
    let input = match words.iter().position(|word| word == "<") {
        Some(place) => {
            let file = File::open(workplace().join(&words[place + 1])).expect("the file is there");
            words.truncate(place);
            Stdio::from(file)
        }
        None => Stdio::null(),
    };
    Command::new(env!("CARGO_BIN_EXE_torqcomp"))
        .args(words)
        .current_dir(workplace())
        .env("SOURCE_DATE_EPOCH", "1700000000")
        .env_remove("COLUMNS")
        .stdin(input)
        .output()
        .expect("the binary starts")
}

/// Results of a run of the binary in the folder of the golden outputs.
pub struct Ran {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Ran {
    pub fn of(args: &[&str]) -> Self {
        let output = Command::new(env!("CARGO_BIN_EXE_torqcomp"))
            .args(args)
            .current_dir(workplace())
            .stdin(Stdio::null())
            .output()
            .expect("the binary starts");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
        Self {
            code: output.status.code().expect("an exit code"),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        }
    }
}

/// Words of a command line; quotes keep spaces.
pub fn words(command: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    for c in command.chars() {
        match (quote, c) {
            (Some(mark), c) if c == mark => quote = None,
            (None, '"' | '\'') => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            (None, ' ') => words.extend(word.take()),
            _ => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    words
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .expect("the folder is there")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    files.sort();
    files
}

/// A section of a golden file, if not empty.
fn section(text: &mut String, name: &str, content: &[u8]) {
    if content.is_empty() {
        return;
    }
    let _ = writeln!(text, "--- {name}");
    match std::str::from_utf8(content) {
        // Its content is compared by commands that read it.
        _ if content.starts_with(b"\x89MCAP0") => text.push_str("(an MCAP file)\n"),
        Ok(content) => text.push_str(&settle::readable(content)),
        Err(_) => text.push_str("(not UTF-8)\n"),
    }
    if !text.ends_with('\n') {
        text.push_str("\n(no line end)\n");
    }
}
