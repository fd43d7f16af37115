//! Help pages: options in groups, rare ones in the long help only, and two examples at the end.

use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Command, CommandFactory, FromArgMatches};

use super::Cli;
use crate::file_name::ShowPath;

/// Headings of the help, with the options below each.
const GROUPS: [(&str, &[&str]); 7] = [
    (
        "Input",
        &[
            "applied",
            "applied-unit",
            "channel",
            "decay",
            "decimal",
            "delimiter",
            "field",
            "fill",
            "full-scale",
            "holdout",
            "holdout-decay",
            "running",
            "static",
            "load",
            "load-unit",
            "longest-metadata",
            "measured",
            "measured-as",
            "measured-unit",
            "motion",
            "motion-unit",
            "position",
            "range",
            "rate",
            "reading",
            "reading-unit",
            "resample",
            "series",
            "signal",
            "spacing",
            "std",
            "time",
            "time-column",
            "time-unit",
            "topic",
            "torque",
            "torque-factor",
            "torque-unit",
            "train",
            "unit",
        ],
    ),
    (
        "Stand",
        &[
            "damping-ratio",
            "depth",
            "elastic-modulus",
            "excitation",
            "gage-factor",
            "gage-position",
            "gage-resistance",
            "gain",
            "inertia",
            "layout",
            "length",
            "name",
            "natural-frequency",
            "radius",
            "rated-torque",
            "sensitivity",
            "stand",
            "stiffness",
            "torque-per-ratio",
            "torque-per-volt",
            "width",
            "zero",
        ],
    ),
    ("Band", &["band"]),
    (
        "Method",
        &[
            "between",
            "by-direction",
            "degree",
            "delay",
            "from",
            "fundamental",
            "gravity",
            "modes",
            "orders",
            "period",
            "periodic",
            "refine",
            "refine-span",
            "segment",
            "step",
            "threads",
            "to",
            "uncertainty",
            "whole-record",
            "window",
        ],
    ),
    (
        "Output",
        &[
            "digits",
            "force",
            "format",
            "no-sync",
            "output",
            "output-topic",
            "units",
            "with-recorded",
        ],
    ),
    (
        "Report",
        &[
            "all",
            "allow",
            "html",
            "json",
            "log",
            "plot",
            "plot-range",
            "progress",
            "quiet",
            "strict",
        ],
    ),
    (
        "Many recordings",
        &[
            "dry-run",
            "fail-fast",
            "files-from",
            "jobs",
            "manifest",
            "max-failures",
            "null",
            "shard",
            "skip-existing",
            "summary",
        ],
    ),
];

/// Options that affect no result, or whose files the manifest identifies by content.
const NOT_IN_RESULTS: &[&str] = &[
    "dry-run",
    "fail-fast",
    "files-from",
    "force",
    "jobs",
    "log",
    "manifest",
    "max-failures",
    "no-sync",
    "null",
    "output",
    "progress",
    "quiet",
    "shard",
    "skip-existing",
    "stand",
    "summary",
    "threads",
];

/// Options omitted from the short help.
const RARE: &[&str] = &[
    "allow",
    "applied-unit",
    "decimal",
    "delay",
    "delimiter",
    "digits",
    "dry-run",
    "fail-fast",
    "files-from",
    "full-scale",
    "jobs",
    "log",
    "longest-metadata",
    "manifest",
    "max-failures",
    "measured-as",
    "measured-unit",
    "no-sync",
    "null",
    "output-topic",
    "period",
    "plot-range",
    "progress",
    "segment",
    "shard",
    "signal",
    "skip-existing",
    "spacing",
    "summary",
    "threads",
    "time",
    "time-column",
    "time-unit",
    "whole-record",
    "with-recorded",
];

/// Maximum length of an example line, without its continuation mark.
const EXAMPLE_WIDTH: usize = 74;

/// Two examples for each verb; a verb and its test are joined by a space.
const EXAMPLES: &[(&str, [&str; 2])] = &[
    (
        "init",
        [
            "torqcomp init -o stand.toml",
            "torqcomp init --from unknown -o stand.toml",
        ],
    ),
    (
        "compensate",
        [
            "torqcomp compensate run.csv --stand stand.toml -o torque.csv",
            "torqcomp compensate run.csv --channel bridge --stand stand.toml --band 800 --plot torque.svg -o torque.csv",
        ],
    ),
    (
        "harmonics",
        [
            "torqcomp harmonics run.csv --stand stand.toml --fundamental 60 --orders 1-20",
            "torqcomp harmonics torque.csv --fundamental 60 --refine --json",
        ],
    ),
    (
        "table",
        [
            "torqcomp table --stand stand.toml --from 0 --to 2500 --step 10 -o table.csv",
            "torqcomp table --stand stand.toml --uncertainty --json",
        ],
    ),
    (
        "predict",
        [
            "torqcomp predict --stand stand.toml",
            "torqcomp predict --stand stand.toml --units us --json",
        ],
    ),
    (
        "extract",
        [
            "torqcomp extract run.mcap --topic /joint_states --field 'effort[0]' -o effort.csv",
            "torqcomp extract run.csv --channel 2 --resample --rate 1000 -o rows.csv",
        ],
    ),
    (
        "inspect",
        [
            "torqcomp inspect run.csv",
            "torqcomp inspect run-*.csv --plot channels.svg --json",
        ],
    ),
    (
        "identify decay",
        [
            "torqcomp identify decay tap.csv --channel bridge -o stand.toml",
            "torqcomp identify decay tap.csv --inertia \"0.0079 kg m^2\" --html decay.html -o stand.toml",
        ],
    ),
    (
        "identify response",
        [
            "torqcomp identify response sweep.csv --applied torque --measured bridge -o stand.toml",
            "torqcomp identify response hits.csv --applied hammer --measured bridge --band 50..2000 --html response.html",
        ],
    ),
    (
        "identify runup",
        [
            "torqcomp identify runup spin.csv --motion speed --torque torque -o stand.toml",
            "torqcomp identify runup spin.csv --motion angle --motion-unit rad --torque current --json",
        ],
    ),
    (
        "identify static",
        [
            "torqcomp identify static loads.csv --load load --reading bridge -o stand.toml",
            "torqcomp identify static weights.csv --load force --radius \"100 mm\" --reading bridge -o stand.toml",
        ],
    ),
    (
        "simulate",
        [
            "torqcomp simulate run.csv --stand stand.toml --applied torque -o response.csv",
            "torqcomp simulate run.csv --stand refined.toml --applied 2 --unit \"N m\" -o response.csv",
        ],
    ),
    (
        "diagnose",
        [
            "torqcomp diagnose --train a.csv --holdout b.csv --applied torque --measured bridge --html report.html",
            "torqcomp diagnose --stand stand.toml --train a.csv --applied 1 --measured 2 -o refined.toml",
        ],
    ),
    (
        "merge",
        [
            "torqcomp merge out/ -o table.csv",
            "torqcomp merge 'out/torqcomp-manifest.*-of-8.jsonl' -o table.csv --json",
        ],
    ),
    (
        "completions",
        [
            "torqcomp completions bash -o ~/.local/share/bash-completion/completions/torqcomp",
            "torqcomp completions powershell",
        ],
    ),
    (
        "man",
        [
            "torqcomp man identify decay -o torqcomp-identify-decay.1",
            "torqcomp man -o ~/.local/share/man/man1/",
        ],
    ),
    (
        "schema",
        [
            "torqcomp schema harmonics",
            "torqcomp schema error -o error.schema.json",
        ],
    ),
];

/// The command line with its help for people.
#[must_use]
pub fn command() -> Command {
    grouped("", Cli::command())
}

/// Reads the command line of the process.
///
/// # Errors
/// For help, version and mistakes.
pub(crate) fn parse() -> Result<Cli, clap::Error> {
    let command = command();
    let matches = command.clone().try_get_matches()?;
    let mut cli = Cli::from_arg_matches(&matches)?;
    cli.options = options(&command, &matches);
    Ok(cli)
}

/// The given options that may affect a result, sorted by name.
fn options(command: &Command, matches: &ArgMatches) -> Vec<String> {
    let Some((name, given)) = matches.subcommand() else {
        return Vec::new();
    };
    let verb = command.find_subcommand(name);
    let mut options = Vec::new();
    for arg in verb.into_iter().flat_map(Command::get_arguments) {
        let (id, long) = (arg.get_id().as_str(), arg.get_long().unwrap_or_default());
        let is_given = given.value_source(id) == Some(ValueSource::CommandLine);
        if long.is_empty() || !is_given || NOT_IN_RESULTS.contains(&long) {
            continue;
        }
        let values = given.get_raw(id).into_iter().flatten();
        options.extend(values.map(|value| format!("--{long}={}", value.shown())));
    }
    options.sort();
    options
}

fn grouped(path: &str, command: Command) -> Command {
    let examples = EXAMPLES.iter().find(|(verb, _)| *verb == path);
    let command = command.mut_args(in_group);
    let command = match examples {
        Some((_, lines)) => {
            let lines = lines.map(folded);
            command.after_help(format!("Examples:\n  {}", lines.join("\n  ")))
        }
        None => command,
    };
    command.mut_subcommands(|verb| {
        let path = format!("{path} {}", verb.get_name());
        grouped(path.trim_start(), verb)
    })
}

/// An example on lines of at most 78 characters, broken before options with shell continuations.
fn folded(example: &str) -> String {
    let mut lines = vec![String::new()];
    for piece in example.split(" -") {
        let last = lines.len() - 1;
        let line = &mut lines[last];
        match line.is_empty() {
            true => line.push_str(piece),
            false if line.len() + piece.len() <= EXAMPLE_WIDTH => {
                line.push_str(&format!(" -{piece}"));
            }
            false => lines.push(format!("    -{piece}")),
        }
    }
    lines.join(" \\\n  ")
}

fn in_group(arg: Arg) -> Arg {
    let Some(long) = arg.get_long().map(str::to_owned) else {
        return arg;
    };
    let has_it = |names: &[&str]| names.contains(&long.as_str());
    let arg = arg.hide_short_help(has_it(RARE));
    // --name of a result differs from --name of a stand.
    if arg.get_help_heading().is_some() {
        return arg.hide_short_help(true);
    }
    match GROUPS.iter().find(|(_, names)| has_it(names)) {
        Some((heading, _)) => arg.help_heading(*heading),
        None => arg,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_groups(command: &Command) {
        let options = command.get_arguments().filter_map(Arg::get_long);
        for option in options.filter(|name| !["help", "version"].contains(name)) {
            let groups = GROUPS.iter().filter(|(_, names)| names.contains(&option));
            assert_eq!(groups.count(), 1, "--{option} of {}", command.get_name());
        }
        command.get_subcommands().for_each(check_groups);
    }

    #[test]
    fn every_option_is_in_one_group() {
        check_groups(&command());
    }

    #[test]
    fn long_examples_go_on_as_a_shell_reads_them() {
        assert_eq!(
            folded("torqcomp inspect run.csv"),
            "torqcomp inspect run.csv"
        );
        for (_, lines) in EXAMPLES {
            for line in lines {
                let shown = folded(line);
                assert!(shown.lines().all(|line| line.len() <= 80), "{shown}");
                let joined = shown.replace("\\\n", "");
                let words = |text: &str| text.split_whitespace().map(str::to_owned).collect();
                let (shown, given): (Vec<String>, Vec<String>) = (words(&joined), words(line));
                assert_eq!(shown, given);
            }
        }
    }

    #[test]
    fn every_verb_has_examples_that_it_takes_and_its_short_help_fits_a_screen() {
        let mut verbs = Vec::new();
        for verb in command().get_subcommands() {
            let tests: Vec<&str> = verb.get_subcommands().map(Command::get_name).collect();
            match tests.is_empty() {
                true => verbs.push(verb.get_name().to_owned()),
                false => verbs.extend(
                    tests
                        .iter()
                        .map(|test| format!("{} {test}", verb.get_name())),
                ),
            }
        }
        for (path, lines) in EXAMPLES {
            assert!(verbs.iter().any(|verb| verb == path), "{path}");
            for line in lines {
                let words = line.replace('\'', "").replace("\"", "");
                // Quoted quantities contain spaces.
                let words: Vec<String> = match line.split('"').collect::<Vec<_>>()[..] {
                    [before, inside, after] => before
                        .split_whitespace()
                        .chain([inside])
                        .chain(after.split_whitespace())
                        .map(str::to_owned)
                        .collect(),
                    _ => words.split_whitespace().map(str::to_owned).collect(),
                };
                let read = command().try_get_matches_from(&words);
                assert!(read.is_ok(), "{line}: {}", read.unwrap_err());
            }
            let words = ["torqcomp"]
                .into_iter()
                .chain(path.split(' '))
                .chain(["-h"]);
            let help = command()
                .try_get_matches_from(words)
                .unwrap_err()
                .to_string();
            assert!(help.contains("Examples:"), "{help}");
            assert!(
                help.lines().count() <= 55,
                "{path}: {} lines\n{help}",
                help.lines().count()
            );
        }
    }
}
