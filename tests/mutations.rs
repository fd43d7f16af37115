//! Every command on damaged recordings, stand files and arguments: a run always terminates with a code of its own,
//! within limits of time and memory, and leaves neither a partial file nor a non-finite number.
//!
//! The seeds are the commands of the golden outputs. Short by default; for any duration, with different damage on every
//! run unless the seed of the damage is given too:
//!
//! ```text
//! TORQCOMP_MUTATION_SECONDS=3600 cargo test --test tests mutations -- --nocapture
//! ```
//!
//! A finding is printed with its command, and its files are kept in a named folder.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::golden::{commands, workplace};
use crate::noise::Noise;

/// Maximum duration of a run with mutated files of at most some 100 kB.
const LONGEST: Duration = Duration::from_secs(60);
/// Memory limit of a run, in KiB.
#[cfg(target_os = "linux")]
const MEMORY_KIB: u32 = 2_000_000;
/// Cells and values that are troublesome for programs.
const ODD: [&str; 24] = [
    "",
    "0",
    "-0",
    "-1",
    "1",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-308",
    "4.9e-324",
    "1e400",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "0x10",
    "1.2.3",
    "1e",
    "\"",
    "\u{feff}",
    "\u{202e}",
    "...",
    "1_000",
];

/// An integer from the environment.
fn number_of(variable: &str) -> Option<u64> {
    let text = std::env::var(variable).ok()?;
    Some(
        text.parse()
            .unwrap_or_else(|_| panic!("{variable}={text} is no whole number")),
    )
}

struct Chance(Noise);

impl Chance {
    fn below(&mut self, count: usize) -> usize {
        ((self.0.uniform() * count as f64) as usize).min(count.saturating_sub(1))
    }

    fn one<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.below(of.len())]
    }
}

/// Bytes flipped, overwritten, removed, duplicated, or truncated.
fn damage_bytes(bytes: &mut Vec<u8>, chance: &mut Chance) {
    if bytes.is_empty() {
        return;
    }
    let at = chance.below(bytes.len());
    let length = (1 + chance.below(64)).min(bytes.len() - at);
    match chance.below(6) {
        0 => bytes[at] ^= 1 << chance.below(8),
        1 => bytes.truncate(at),
        2 => drop(bytes.drain(at..at + length)),
        3 => {
            let piece = bytes[at..at + length].to_vec();
            let to = chance.below(bytes.len());
            bytes.splice(to..to, piece);
        }
        4 => {
            // Lengths and times of messages are eight-byte numbers.
            let number = *chance.one(&[0, 1, u64::MAX, 1 << 32, 1 << 40, i64::MAX as u64]);
            let end = (at + 8).min(bytes.len());
            bytes[at..end].copy_from_slice(&number.to_le_bytes()[..end - at]);
        }
        _ => bytes[at] = chance.below(256) as u8,
    }
}

/// A line removed, repeated, moved or truncated, a cell replaced, or the separator changed.
fn damage_lines(text: &str, chance: &mut Chance) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    if lines.is_empty() {
        return (*chance.one(&ODD)).to_owned();
    }
    // Headers are short, and matter as much as rows.
    let at = match chance.below(2) {
        0 => chance.below(lines.len().min(5)),
        _ => chance.below(lines.len()),
    };
    match chance.below(7) {
        0 => drop(lines.remove(at)),
        1 => lines.insert(at, lines[at].clone()),
        2 => {
            let line = lines.remove(at);
            lines.insert(chance.below(lines.len() + 1), line);
        }
        3 => lines[at] = lines[at].chars().take(chance.below(20)).collect(),
        4 => {
            let (from, to) = (
                *chance.one(&[",", ";", "\t", " ", ".", "="]),
                *chance.one(&[",", ";", "\t", " ", ""]),
            );
            match chance.below(2) {
                0 => lines[at] = lines[at].replace(from, to),
                _ => return text.replace(from, to),
            }
        }
        _ => {
            let separator = if lines[at].contains(" = ") {
                " = "
            } else {
                *chance.one(&[",", ";", "\t"])
            };
            let mut cells: Vec<&str> = lines[at].split(separator).collect();
            let cell = chance.below(cells.len());
            cells[cell] = ODD[chance.below(ODD.len())];
            lines[at] = cells.join(separator);
        }
    }
    lines.join("\n") + "\n"
}

fn damage_file(bytes: Vec<u8>, chance: &mut Chance) -> Vec<u8> {
    let mut bytes = bytes;
    for _ in 0..=chance.below(3) {
        bytes = match String::from_utf8(bytes) {
            Ok(text) if chance.below(4) > 0 => damage_lines(&text, chance).into_bytes(),
            Ok(text) => {
                let mut bytes = text.into_bytes();
                damage_bytes(&mut bytes, chance);
                bytes
            }
            Err(binary) => {
                let mut bytes = binary.into_bytes();
                damage_bytes(&mut bytes, chance);
                bytes
            }
        };
    }
    bytes
}

/// An argument removed, repeated, or replaced by an odd value.
fn damage_arguments(words: &mut Vec<String>, chance: &mut Chance) {
    let at = 1 + chance.below(words.len() - 1);
    match chance.below(4) {
        0 => drop(words.remove(at)),
        1 => words.insert(at, words[at].clone()),
        _ if at + 1 == words.len() || words[at].starts_with('-') => {
            let place = (at + 1).min(words.len() - 1);
            words[place] = (*chance.one(&ODD)).to_owned();
        }
        _ => words[at] = (*chance.one(&ODD)).to_owned(),
    }
}

/// A command with some part of it damaged, ready to run in a folder.
fn mutated(command: &[String], folder: &Path, chance: &mut Chance) -> Vec<String> {
    let is_file = |word: &String| workplace().join(word).is_file();
    let files: Vec<usize> = (1..command.len())
        .filter(|at| is_file(&command[*at]))
        .collect();
    let mut words: Vec<String> = command
        .iter()
        .map(|word| word.replace("OUT/", "out-"))
        .collect();
    let damaged = (!files.is_empty() && chance.below(8) > 0).then(|| *chance.one(&files));
    for at in files {
        let from = workplace().join(&command[at]);
        words[at] = match damaged == Some(at) {
            true => {
                let bytes = damage_file(fs::read(&from).expect("a file"), chance);
                let name = from
                    .file_name()
                    .and_then(|name| name.to_str())
                    .expect("a name");
                fs::write(folder.join(name), bytes).expect("a copy");
                name.to_owned()
            }
            false => from.to_str().expect("a path").to_owned(),
        };
    }
    if damaged.is_none() {
        damage_arguments(&mut words, chance);
    }
    words
}

/// The problem of a run, if any.
fn finding(words: &[String], folder: &Path) -> Option<String> {
    let mut child = bounded(words, folder);
    let start = Instant::now();
    let status = loop {
        match child.try_wait().expect("a state") {
            Some(status) => break status,
            None if start.elapsed() > LONGEST => {
                child.kill().expect("it is there");
                child.wait().expect("it ends");
                return Some(format!("not done after {} s", LONGEST.as_secs()));
            }
            None => std::thread::sleep(Duration::from_millis(1)),
        }
    };
    let read = |name: &str| {
        String::from_utf8_lossy(&fs::read(folder.join(name)).unwrap_or_default()).into_owned()
    };
    let (output, errors) = (read("stdout"), read("stderr"));
    let Some(code @ 0..=3) = status.code() else {
        return Some(format!("ended with {status}: {errors}"));
    };
    let said = errors.contains("panicked");
    let names = || {
        fs::read_dir(folder)
            .expect("the folder")
            .map(|entry| entry.expect("an entry").file_name())
    };
    let part = names().find(|name| name.to_string_lossy().ends_with(".part"));
    let results = names().filter_map(|name| {
        name.into_string()
            .ok()
            .filter(|name| name.starts_with("out-"))
    });
    let texts = results
        .map(|name| (read(&name), name))
        .chain([(output, "standard output".to_owned())]);
    let odd = texts
        .filter(|_| code != 1 && code != 2 && words[0] != "inspect")
        .find(|(text, _)| has_no_number(text));
    match (said, part, odd) {
        (true, ..) => Some(errors),
        (_, Some(part), _) => Some(format!("{} is left", part.display())),
        (_, _, Some((_, name))) => Some(format!("no number in {name}")),
        _ if code == 1 && errors.trim().is_empty() => Some("it failed and said nothing".to_owned()),
        _ => None,
    }
}

/// Whether a cell of a table or a value of a document is not a finite number where one is expected. The headings of a
/// table of results are names: a channel may be called `inf`, and so may a file in a text of a JSON document.
fn has_no_number(text: &str) -> bool {
    let is_json = text.starts_with('{');
    let is_odd = |cell: &str| {
        let cell = cell.trim_matches(|c: char| c.is_whitespace() || !is_json && c == '"');
        ["NaN", "-NaN", "inf", "-inf", "infinity"].contains(&cell)
            || cell.contains("infe")
            || cell.contains("NaNe")
    };
    text.lines()
        .skip(usize::from(text.starts_with("time_s,")))
        .any(|line| line.split([',', ';', ':', '\t', '}']).any(is_odd))
}

fn bounded(words: &[String], folder: &Path) -> std::process::Child {
    let binary = env!("CARGO_BIN_EXE_torqcomp");
    #[cfg(target_os = "linux")]
    let mut command = {
        let mut command = Command::new("sh");
        let limited = format!("ulimit -v {MEMORY_KIB}; exec \"$0\" \"$@\"");
        command.args(["-c", &limited, binary]);
        command
    };
    #[cfg(not(target_os = "linux"))]
    let mut command = Command::new(binary);
    let stream = |name: &str| fs::File::create(folder.join(name)).expect("a file");
    let input = words.iter().position(|word| word == "<");
    let stdin = input.and_then(|at| fs::File::open(folder.join(words.get(at + 1)?)).ok());
    command
        .args(&words[..input.unwrap_or(words.len())])
        .current_dir(folder)
        .stdin(stdin.map_or_else(Stdio::null, Stdio::from))
        .stdout(stream("stdout"))
        .stderr(stream("stderr"))
        .spawn()
        .expect("the binary starts")
}

/// Runs mutated commands until a number of runs or a moment is reached; returns the number of runs and
/// the findings.
fn hunt(seeds: &[Vec<String>], seed: u64, (most, end): (usize, Instant)) -> (usize, Vec<String>) {
    let mut chance = Chance(Noise(seed));
    let mut found = Vec::new();
    let mut runs = 0;
    while runs < most && Instant::now() < end && found.len() < 20 {
        let folder = tempfile::tempdir().expect("a folder");
        let command = chance.one(seeds).clone();
        let words = mutated(&command, folder.path(), &mut chance);
        if let Some(what) = finding(&words, folder.path()) {
            let kept: PathBuf = folder.keep();
            let line = format!(
                "{}: {what}\n  cd {}; torqcomp {}",
                found.len(),
                kept.display(),
                words.join(" ")
            );
            println!("{line}");
            found.push(line);
        }
        runs += 1;
    }
    (runs, found)
}

#[test]
fn a_number_that_is_none_is_seen() {
    for text in [
        "1,NaN,2",
        "time_s,a\n0,inf",
        "x: -inf",
        "0,infe0",
        "{\"a\": NaN}",
    ] {
        assert!(has_no_number(text), "{text}");
    }
    for text in [
        "info,1",
        "time_s,inf\n0,1",
        "2,3",
        "channel nan-1: 5",
        "{\"output\": \"inf\"}",
        "banana",
    ] {
        assert!(!has_no_number(text), "{text}");
    }
}

/// Every four bytes of the records of a summary, replaced by a text length of 4 GiB.
#[cfg(target_os = "linux")]
#[test]
fn a_length_that_a_summary_claims_takes_no_memory() {
    let whole = fs::read(workplace().join("made/ros2.mcap")).expect("a recording");
    let end = whole.len() - mcap::MAGIC.len();
    // The end record: opcode and length, then the offset of the summary.
    let footer = &whole[end - 20..end];
    let start = u64::from_le_bytes(footer[..8].try_into().expect("eight bytes")) as usize;
    assert!(start > 0 && start < end, "no summary");
    let folder = tempfile::tempdir().expect("a folder");
    let words = ["extract", "broken.mcap", "--topic", "/temperature"];
    let words: Vec<String> = words.into_iter().map(str::to_owned).collect();
    let mut found = Vec::new();
    for at in (start..end - 29).step_by(2) {
        let mut broken = whole.clone();
        broken[at..at + 4].copy_from_slice(&0xfff0_0000_u32.to_le_bytes());
        fs::write(folder.path().join("broken.mcap"), broken).expect("a file");
        found.extend(finding(&words, folder.path()).map(|what| format!("byte {at}: {what}")));
    }
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn damage_of_any_kind_ends_in_a_result_or_a_message() {
    let seeds: Vec<Vec<String>> = commands()
        .into_iter()
        .filter(|words| words.len() > 1)
        .collect();
    assert!(seeds.len() > 100, "{} seeds", seeds.len());
    let (most, length, first) = match number_of("TORQCOMP_MUTATION_SECONDS") {
        Some(seconds) => {
            let now = std::time::SystemTime::now()
                .duration_since(std::time::UNIX_EPOCH)
                .expect("after 1970");
            let seed = number_of("TORQCOMP_MUTATION_SEED").unwrap_or(now.as_nanos() as u64 | 1);
            (usize::MAX, Duration::from_secs(seconds), seed)
        }
        None => (150, Duration::from_secs(600), 1),
    };
    let end = Instant::now() + length;
    let threads = std::thread::available_parallelism().map_or(1, usize::from) as u64;
    let all: Vec<(usize, Vec<String>)> = std::thread::scope(|scope| {
        let seeds = &seeds;
        let running: Vec<_> = (0..threads)
            .map(|k| {
                scope.spawn(move || hunt(seeds, first.wrapping_add(k * 0x9e37_79b9), (most, end)))
            })
            .collect();
        running
            .into_iter()
            .map(|thread| thread.join().expect("the thread ends"))
            .collect()
    });
    let runs: usize = all.iter().map(|(runs, _)| runs).sum();
    let found: Vec<&String> = all.iter().flat_map(|(_, found)| found).collect();
    println!("{runs} runs from seed {first}, {} findings", found.len());
    assert!(found.is_empty(), "{found:#?}");
}
