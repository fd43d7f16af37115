//! Says which commit and target a build is of, for `torqcomp --version`, and packs its long texts.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use flate2::Compression;
use flate2::write::DeflateEncoder;

/// What decides the program; a change in it that is not committed is said.
const SOURCES: [&str; 5] = ["src", "crates", "build.rs", "Cargo.toml", "Cargo.lock"];

/// Letters of a commit that are shown.
const SHOWN: usize = 12;

/// The JSON Schemas of the documents.
const SCHEMAS: &str = "src/commands/schema";

/// Further texts.
const TEXTS: [(&str, &str); 3] = [
    ("page.css", "src/chart/page.css"),
    ("zoom.js", "src/chart/zoom.js"),
    ("vocabulary.txt", "src/recording/text/vocabulary.txt"),
];

fn main() {
    let variable = |name: &str| std::env::var(name).unwrap_or_default();
    pack_texts(Path::new(&variable("OUT_DIR")));
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-env=TORQCOMP_TARGET={}", variable("TARGET"));
    // A commit changes the version, and so all that is built after it. Builds without optimisation are for work in between.
    let origin = match variable("PROFILE") == "release" {
        true => of_package()
            .or_else(of_clone)
            .unwrap_or_else(|| "unknown commit".to_owned()),
        false => "debug build".to_owned(),
    };
    println!("cargo::rustc-env=TORQCOMP_ORIGIN={origin}");
}

/// Compresses the long texts, which would be 3 % of a binary: the schemas together, each after its name and without
/// indentation, and each other text by itself.
fn pack_texts(folder: &Path) {
    let read = |path: &Path| {
        println!("cargo::rerun-if-changed={}", path.display());
        std::fs::read_to_string(path).expect("a readable text")
    };
    let pack = |name: &str, text: &str| {
        let mut packed = DeflateEncoder::new(Vec::new(), Compression::best());
        packed.write_all(text.as_bytes()).expect("memory takes all");
        let packed = packed.finish().expect("memory takes all");
        std::fs::write(folder.join(format!("{name}.z")), packed).expect("a writable folder");
    };
    for (name, path) in TEXTS {
        pack(name, &read(Path::new(path)));
    }
    println!("cargo::rerun-if-changed={SCHEMAS}");
    let entries = std::fs::read_dir(SCHEMAS).expect("the folder of the schemas");
    let paths = entries.map(|entry| entry.expect("a readable folder").path());
    let mut paths: Vec<PathBuf> = paths
        .filter(|path| path.extension().is_some_and(|e| e == "json"))
        .collect();
    paths.sort();
    let mut all = String::new();
    for path in &paths {
        let name = path.file_stem().expect("a file").to_string_lossy();
        all += &format!("{name}\n");
        for line in read(path).lines() {
            all += line.trim_start();
            all.push('\n');
        }
        all.push('\0');
    }
    pack("schemas", &all);
}

/// The commit that `cargo package` wrote down.
fn of_package() -> Option<String> {
    const NOTE: &str = ".cargo_vcs_info.json";
    let note = std::fs::read_to_string(NOTE).ok()?;
    println!("cargo::rerun-if-changed={NOTE}");
    let (_, rest) = note.split_once("\"sha1\"")?;
    let sha = rest.split('"').nth(1)?;
    Some(named(sha, note.contains("\"dirty\": true")))
}

/// The commit of the clone that this folder is the top of.
fn of_clone() -> Option<String> {
    // A package may have been unpacked inside of a clone of something else.
    if !Path::new(".git").exists() {
        return None;
    }
    let sha = git(&["rev-parse", "HEAD"])?;
    // The log of HEAD gets a line with each commit, also where branches are packed.
    for file in ["HEAD", "logs/HEAD", "packed-refs", "refs/heads"] {
        let path = git(&["rev-parse", "--git-path", file])?;
        let is_needed = file != "refs/heads" || !is_logged()?;
        if is_needed && Path::new(&path).exists() {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    for path in SOURCES {
        println!("cargo::rerun-if-changed={path}");
    }
    let mut status = vec!["status", "--porcelain", "--"];
    status.extend(SOURCES);
    Some(named(&sha, !git(&status)?.is_empty()))
}

/// Whether the log of HEAD is kept.
fn is_logged() -> Option<bool> {
    Some(Path::new(&git(&["rev-parse", "--git-path", "logs/HEAD"])?).exists())
}

fn named(sha: &str, is_changed: bool) -> String {
    let shown = sha.get(..SHOWN).unwrap_or(sha);
    match is_changed {
        true => format!("commit {shown} with changes"),
        false => format!("commit {shown}"),
    }
}

/// What git says, without the line end; `None` if there is no git or it fails.
fn git(words: &[&str]) -> Option<String> {
    let output = Command::new("git").args(words).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim_end().to_owned())
}
