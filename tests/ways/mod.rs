//! The worked examples in `docs/ways`: every command of a page is run on recordings of known torque, its output
//! compared with the page, and the final torque with the truth.
//!
//! In a ```` ```console ```` block, a line `$ torqcomp …` (continued by `\`) is run, and `$ cat FILE` prints a file;
//! the lines below are the output, standard output first. A ```` ```toml ```` block whose first line is `# FILE` is
//! written to that file. `SNAPSHOTS=overwrite cargo test --test tests ways` updates the pages with the current output.

mod records;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use snapbox::Data;
use snapbox::assert::DEFAULT_ACTION_ENV;

use self::records::{Way, ways};
use crate::golden::settle::settle;
use crate::golden::words;
use crate::util::{Folder, column};

/// Stated accuracy of the torque in `torque.csv` on a page.
struct Promise {
    /// Length of either end excluded from the comparison, ms.
    ends_ms: f64,
    /// Minimum error of the torque as recorded, N m RMS.
    recorded_n_m: f64,
    /// Maximum error of the compensated torque, N m RMS.
    compensated_n_m: f64,
}

impl Promise {
    /// The stated accuracy of a page, parsed from its sentence.
    fn of(page: &str) -> Self {
        // Line ends within a paragraph are irrelevant.
        let words = page.split_whitespace().collect::<Vec<_>>().join(" ");
        let (_, mut rest) = words
            .split_once("Without the first and last ")
            .expect("the page says how good its torque is");
        let mut number = |behind: &str| {
            let (number, behind) = rest.split_once(behind).expect("the usual sentence");
            rest = behind;
            number.parse().expect("a number")
        };
        Self {
            ends_ms: number(" ms, the torque as recorded is wrong by more than "),
            recorded_n_m: number(" N m rms, the compensated one by less than "),
            compensated_n_m: number(" N m rms."),
        }
    }
}

/// Runs the page of an example.
fn check(number: usize) {
    let way = &ways()[number];
    let page = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("docs/ways")
        .join(way.name)
        .with_extension("md");
    let expected = fs::read_to_string(&page).expect("the page of the way");
    let folder = Folder::new();
    fs::remove_file(folder.path("stand.toml")).expect("the stand of the thesis");
    for (name, content) in &way.files {
        folder.write(name, content);
    }
    let actual = settle(&expected, &run(&expected, &folder));
    let expected_data = Data::read_from(&page, Some(snapbox::data::DataFormat::Text)).raw();
    snapbox::Assert::new()
        .action_env(DEFAULT_ACTION_ENV)
        .eq(actual, expected_data);
    keeps(&Promise::of(&expected), way, &folder);
}

/// Compares the torque with the truth.
fn keeps(promise: &Promise, way: &Way, folder: &Folder) {
    let text = folder.read("torque.csv");
    let end = (promise.ends_ms * 1e-3 * way.rate_hz) as usize;
    let inside = end..way.applied_n_m.len() - end;
    let error = |name: &str| {
        let torque = column(&text, name);
        assert_eq!(torque.len(), way.applied_n_m.len());
        let squares = inside
            .clone()
            .map(|i| (torque[i] - way.applied_n_m[i]).powi(2));
        (squares.sum::<f64>() / inside.len() as f64).sqrt()
    };
    let (recorded, compensated) = (
        error("recorded_torque_n_m"),
        error("compensated_torque_n_m"),
    );
    println!("{}: {recorded:.4} and {compensated:.4} N m rms", way.name);
    assert!(recorded > promise.recorded_n_m, "recorded: {recorded}");
    assert!(
        compensated < promise.compensated_n_m,
        "compensated: {compensated}"
    );
}

/// The page with the present output of its commands.
fn run(page: &str, folder: &Folder) -> String {
    let mut text = String::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        let _ = writeln!(text, "{line}");
        if !line.starts_with("```") {
            continue;
        }
        let block: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
        match line {
            "```console" => console(&block, folder, &mut text),
            _ => block.iter().for_each(|line| {
                let _ = writeln!(text, "{line}");
            }),
        }
        let file = block.first().and_then(|line| line.strip_prefix("# "));
        if let (Some(file), "```toml") = (file, line) {
            folder.write(file, block[1..].join("\n") + "\n");
        }
        text.push_str("```\n");
    }
    text
}

/// Runs the commands of a block.
fn console(block: &[&str], folder: &Folder, text: &mut String) {
    let mut lines = block.iter();
    while let Some(line) = lines.next() {
        let Some(first) = line.strip_prefix("$ ") else {
            continue;
        };
        let _ = writeln!(text, "{line}");
        let mut command = first.to_owned();
        while let Some(front) = command.strip_suffix('\\') {
            let more = lines.next().expect("the command goes on");
            let _ = writeln!(text, "{more}");
            command = format!("{front}{}", more.trim_start());
        }
        for line in output(&words(&command), folder).lines() {
            let _ = writeln!(text, "{}", line.trim_end());
        }
    }
}

/// What a command prints.
fn output(words: &[String], folder: &Folder) -> String {
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["cat", file] => folder.read(file),
        ["torqcomp", ref args @ ..] => {
            let ran = folder.run(args);
            let code = match ran.code {
                0 => String::new(),
                code => format!("exit code {code}\n"),
            };
            format!("{}{}{code}", ran.stdout, ran.stderr)
        }
        _ => panic!("no such command here: {words:?}"),
    }
}

#[test]
fn bridge_amplifier() {
    check(0);
}

#[test]
fn torque_transducer() {
    check(1);
}

#[test]
fn hammer() {
    check(2);
}

#[test]
fn gage_alone() {
    check(3);
}

#[test]
fn ros2_bag() {
    check(4);
}
