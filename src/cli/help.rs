//! Help pages with two examples at the end, and the options that a result may depend on.

use clap::builder::UnknownArgumentValueParser;
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Command, CommandFactory, FromArgMatches};

use super::Cli;
use crate::file_name::ShowPath;

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

/// Maximum length of an example line, without its continuation mark.
const EXAMPLE_WIDTH: usize = 74;

/// Two examples for each verb, and for each test of a verb.
const EXAMPLES: &[&str] = &[
    "torqcomp init -o stand.toml",
    "torqcomp init --from unknown -o stand.toml",
    "torqcomp compensate run.csv --stand stand.toml -o torque.csv",
    "torqcomp compensate run.csv --channel bridge --stand stand.toml --band 800 --plot torque.svg -o torque.csv",
    "torqcomp harmonics run.csv --stand stand.toml --fundamental 60 --orders 1-20",
    "torqcomp harmonics torque.csv --fundamental 60 --refine --json",
    "torqcomp table --stand stand.toml --from 0 --to 2500 --step 10 -o table.csv",
    "torqcomp table --stand stand.toml --uncertainty --json",
    "torqcomp predict --stand stand.toml",
    "torqcomp predict --stand stand.toml --units us --json",
    "torqcomp extract run.mcap --topic /joint_states --field 'effort[0]' -o effort.csv",
    "torqcomp extract run.csv --channel 2 --resample --rate 1000 -o rows.csv",
    "torqcomp inspect run.csv",
    "torqcomp inspect run-*.csv --plot channels.svg --json",
    "torqcomp identify decay tap.csv --channel bridge -o stand.toml",
    "torqcomp identify decay tap.csv --inertia \"0.0079 kg m^2\" --html decay.html -o stand.toml",
    "torqcomp identify response sweep.csv --applied torque --measured bridge -o stand.toml",
    "torqcomp identify response hits.csv --applied hammer --measured bridge --band 50..2000 --html response.html",
    "torqcomp identify runup spin.csv --motion speed --torque torque -o stand.toml",
    "torqcomp identify runup spin.csv --motion angle --motion-unit rad --torque current --json",
    "torqcomp identify static loads.csv --load load --reading bridge -o stand.toml",
    "torqcomp identify static weights.csv --load force --radius \"100 mm\" --reading bridge -o stand.toml",
    "torqcomp simulate run.csv --stand stand.toml --applied torque -o response.csv",
    "torqcomp simulate run.csv --stand refined.toml --applied 2 --unit \"N m\" -o response.csv",
    "torqcomp diagnose --train a.csv --holdout b.csv --applied torque --measured bridge --html report.html",
    "torqcomp diagnose --stand stand.toml --train a.csv --applied 1 --measured 2 -o refined.toml",
    "torqcomp merge out/ -o table.csv",
    "torqcomp merge 'out/torqcomp-manifest.*-of-8.jsonl' -o table.csv --json",
    "torqcomp completions bash -o ~/.local/share/bash-completion/completions/torqcomp",
    "torqcomp completions powershell",
    "torqcomp man identify decay -o torqcomp-identify-decay.1",
    "torqcomp man -o ~/.local/share/man/man1/",
    "torqcomp schema harmonics",
    "torqcomp schema error -o error.schema.json",
];

/// The command line with its help for people.
pub fn command() -> Command {
    with_examples("torqcomp", Cli::command())
}

/// Reads the command line of the process.
///
/// # Errors
/// For help, version and mistakes.
pub(crate) fn parse() -> Result<Cli, clap::Error> {
    let command = command();
    let matches = with_other_names(command.clone()).try_get_matches()?;
    let mut cli = Cli::from_arg_matches(&matches)?;
    cli.options = options(&command, &matches);
    Ok(cli)
}

/// Names of other programs for options: the answer to them names ours, where the nearest in spelling is another one.
const OTHER_NAMES: &[(&str, &[&str])] = &[(
    "--rate",
    &["fs", "sample-rate", "samplerate", "sampling-rate"],
)];

/// A command that answers such names.
fn with_other_names(command: Command) -> Command {
    if command.has_subcommands() {
        return command.mut_subcommands(with_other_names);
    }
    OTHER_NAMES.iter().fold(command, |command, (own, others)| {
        let long = own.trim_start_matches('-');
        let has_own = command
            .get_arguments()
            .any(|arg| arg.get_long() == Some(long));
        let other = Arg::new(others[0])
            .long(others[0])
            .aliases(others[1..].iter().copied())
            .hide(true)
            .value_parser(UnknownArgumentValueParser::suggest_arg(*own));
        if has_own { command.arg(other) } else { command }
    })
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

/// A command with the examples that call it.
fn with_examples(call: &str, command: Command) -> Command {
    if command.has_subcommands() {
        return command
            .mut_subcommands(|verb| with_examples(&format!("{call} {}", verb.get_name()), verb));
    }
    let lines: Vec<String> = examples_of(call).map(folded).collect();
    command.after_help(format!("Examples:\n  {}", lines.join("\n  ")))
}

/// The examples that begin with these words.
fn examples_of(call: &str) -> impl Iterator<Item = &'static str> {
    let is_of = move |example: &&str| {
        let rest = example.strip_prefix(call);
        rest.is_some_and(|rest| rest.starts_with(' '))
    };
    EXAMPLES.iter().copied().filter(is_of)
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

#[cfg(test)]
mod tests {
    use super::*;

    const GROUPS: [&str; 7] = [
        "Input",
        "Stand",
        "Band",
        "Method",
        "Output",
        "Report",
        "Many recordings",
    ];

    fn check_groups(command: &Command) {
        let has_long = |arg: &&clap::Arg| arg.get_long().is_some();
        for option in command.get_arguments().filter(has_long) {
            let heading = option.get_help_heading();
            let is_known = heading.is_some_and(|heading| GROUPS.contains(&heading));
            let is_of_clap = ["help", "version"].contains(&option.get_id().as_str());
            assert!(
                is_known || is_of_clap,
                "--{} of {}: {heading:?}",
                option.get_id(),
                command.get_name()
            );
        }
        command.get_subcommands().for_each(check_groups);
    }

    #[test]
    fn every_option_is_in_a_group() {
        check_groups(&command());
    }

    #[test]
    fn long_examples_go_on_as_a_shell_reads_them() {
        assert_eq!(
            folded("torqcomp inspect run.csv"),
            "torqcomp inspect run.csv"
        );
        for line in EXAMPLES {
            let shown = folded(line);
            assert!(shown.lines().all(|line| line.len() <= 80), "{shown}");
            let joined = shown.replace("\\\n", "");
            let words = |text: &str| text.split_whitespace().map(str::to_owned).collect();
            let (shown, given): (Vec<String>, Vec<String>) = (words(&joined), words(line));
            assert_eq!(shown, given);
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
        let of_verbs = verbs
            .iter()
            .map(|path| examples_of(&format!("torqcomp {path}")).count());
        assert_eq!(of_verbs.sum::<usize>(), EXAMPLES.len());
        for path in &verbs {
            let lines: Vec<&str> = examples_of(&format!("torqcomp {path}")).collect();
            assert_eq!(lines.len(), 2, "{path}");
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
