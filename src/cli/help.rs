//! Help pages: options by groups, the rare ones in the long help only, and two examples at the end.

use clap::{Arg, Command, CommandFactory, FromArgMatches};

use super::Cli;

/// Headings of the help, with the options below each; those of one verb alone stay under "Options".
const GROUPS: [(&str, &[&str]); 5] = [
    (
        "Input",
        &[
            "applied",
            "applied-unit",
            "channel",
            "decimal",
            "delimiter",
            "field",
            "measured",
            "measured-unit",
            "motion",
            "motion-unit",
            "range",
            "rate",
            "resample",
            "signal",
            "spacing",
            "time",
            "time-column",
            "time-unit",
            "topic",
            "unit",
        ],
    ),
    ("Stand", &["stand", "inertia", "stiffness"]),
    ("Band", &["band"]),
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
            "allow",
            "html",
            "json",
            "plot",
            "plot-range",
            "quiet",
            "strict",
        ],
    ),
];

/// Options that the short help leaves out.
const RARE: &[&str] = &[
    "decimal",
    "delimiter",
    "digits",
    "no-sync",
    "output-topic",
    "signal",
    "spacing",
    "threads",
    "time",
    "time-column",
    "time-unit",
    "whole-record",
];

/// Two examples for each verb, the words of a verb and its test joined by a space.
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
            "torqcomp simulate run.csv --stand stand.toml --applied torque -o answer.csv",
            "torqcomp simulate run.csv --stand refined.toml --applied 2 --unit \"N m\" -o answer.csv",
        ],
    ),
    (
        "diagnose",
        [
            "torqcomp diagnose --train a.csv --holdout b.csv --applied torque --measured bridge --html report.html",
            "torqcomp diagnose --stand stand.toml --train a.csv --applied 1 --measured 2 -o refined.toml",
        ],
    ),
];

/// The command line with its help as people read it.
#[must_use]
pub fn command() -> Command {
    grouped("", Cli::command())
}

/// Reads the command line of the process; help, version and mistakes end it.
#[must_use]
pub fn parse() -> Cli {
    let matches = command().get_matches();
    Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
}

fn grouped(path: &str, command: Command) -> Command {
    let examples = EXAMPLES.iter().find(|(verb, _)| *verb == path);
    let command = command.mut_args(in_group);
    let command = match examples {
        Some((_, lines)) => command.after_help(format!("Examples:\n  {}", lines.join("\n  "))),
        None => command,
    };
    command.mut_subcommands(|verb| {
        let path = format!("{path} {}", verb.get_name());
        grouped(path.trim_start(), verb)
    })
}

fn in_group(arg: Arg) -> Arg {
    let Some(long) = arg.get_long().map(str::to_owned) else {
        return arg;
    };
    let has_it = |names: &[&str]| names.contains(&long.as_str());
    let arg = arg.hide_short_help(has_it(RARE));
    match GROUPS.iter().find(|(_, names)| has_it(names)) {
        Some((heading, _)) => arg.help_heading(*heading),
        None => arg,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
                // Quantities in quotes hold spaces.
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
