//! `man`: manual pages of the program and its verbs.

use std::path::Path;

use clap::Command;
use clap_mangen::Man as Renderer;
use clap_mangen::roff::{Roff, bold, roman};

use super::Outcome;
use crate::cli::Man;
use crate::failure::{ErrorCode, Failure, did_you_mean};
use crate::file_name::{self, ShowPath};
use crate::io::output::{self, Output};

/// Runs the verb.
pub fn run(args: &Man) -> Result<Outcome, Failure> {
    let program = command();
    let folder = args.result.output.as_deref();
    let folder = folder.filter(|path| names_a_folder(path));
    match (folder, args.verb.is_empty()) {
        (Some(folder), true) => {
            let mut pages = Vec::new();
            collect(&program, &mut pages);
            write_all(args, folder, &pages)?;
        }
        (Some(folder), false) => {
            return Err(ErrorCode::ConflictingArguments.usage(format_args!(
                "{} is a folder, for all pages; leave {} out, or name a file",
                folder.shown(),
                args.verb.join(" ")
            )));
        }
        (None, _) => {
            let mut output = args.result.open(&[])?;
            output.write(&page(find(&program, &args.verb)?))?;
            output.finish()?;
        }
    }
    Ok(Outcome::Done)
}

/// The command line as in the pages, without the commit: the pages are the same for each build of a version.
fn command() -> Command {
    let mut command = crate::cli::command()
        .long_version(env!("CARGO_PKG_VERSION"))
        .disable_help_subcommand(true);
    command.build();
    command
}

fn names_a_folder(path: &Path) -> bool {
    path.is_dir() || file_name::ends_with_separator(path)
}

/// The verb named by these words.
fn find<'a>(program: &'a Command, words: &[String]) -> Result<&'a Command, Failure> {
    let mut found = program;
    for word in words {
        let Some(verb) = found.find_subcommand(word) else {
            let known: Vec<&str> = found.get_subcommands().map(Command::get_name).collect();
            let meant = did_you_mean(word, known.iter().copied());
            let names = match known.is_empty() {
                true => format!("{} has no further verbs", found.get_name()),
                false => format!("expected one of {}", known.join(", ")),
            };
            return Err(ErrorCode::InvalidValue
                .usage(format_args!("no page on \"{word}\"{meant}; {names}")));
        };
        found = verb;
    }
    Ok(found)
}

/// Names and texts of the pages of a verb and of all below it.
fn collect(command: &Command, pages: &mut Vec<(String, Vec<u8>)>) {
    pages.push((Renderer::new(command.clone()).get_filename(), page(command)));
    for verb in command.get_subcommands() {
        collect(verb, pages);
    }
}

fn write_all(args: &Man, folder: &Path, pages: &[(String, Vec<u8>)]) -> Result<(), Failure> {
    output::make_folder(folder)?;
    let mut outputs = Vec::new();
    for (name, text) in pages {
        let mut output = Output::open(Some(&folder.join(name)), args.result.policy(), &[])?;
        output.write(text)?;
        outputs.push(output);
    }
    output::finish_all(outputs)
}

/// A page in roff, for `man`.
fn page(command: &Command) -> Vec<u8> {
    let renderer = Renderer::new(command.clone())
        .source(concat!("torqcomp ", env!("CARGO_PKG_VERSION")))
        .manual("torqcomp");
    let mut text = Vec::new();
    let written = [
        renderer.render_title(&mut text),
        renderer.render_name_section(&mut text),
        renderer.render_synopsis_section(&mut text),
        renderer.render_description_section(&mut text),
        renderer.render_options_section(&mut text),
    ];
    assert!(written.iter().all(Result::is_ok), "memory takes all");
    let mut rest = Roff::new();
    if command.has_subcommands() {
        rest.control("SH", ["VERBS"]);
        for verb in command.get_subcommands() {
            rest.control("TP", []);
            let name = verb.get_display_name().unwrap_or(verb.get_name());
            rest.text([bold(format!("{name}(1)"))]);
            let about = verb.get_about().map(ToString::to_string);
            rest.text([roman(about.unwrap_or_default())]);
        }
    }
    if let Some(examples) = command.get_after_help() {
        rest.control("SH", ["EXAMPLES"]);
        rest.control("nf", []);
        let examples = examples.to_string();
        for line in examples.lines().filter(|line| *line != "Examples:") {
            rest.text([roman(line)]);
        }
        rest.control("fi", []);
    }
    text.extend(rest.to_roff().into_bytes());
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page as plain text, without roff markup.
    fn plain(page: &[u8]) -> String {
        let text = String::from_utf8(page.to_vec()).unwrap();
        let text = text.replace("\\-", "-").replace("\\*(Aq", "'");
        text.replace("\\fR", "").replace("\\fB", "")
    }

    fn check(command: &Command) {
        let text = plain(&page(command));
        let name = command.get_display_name().unwrap_or(command.get_name());
        assert!(text.contains(&format!(".TH {name} 1 ")), "{text}");
        for option in command.get_arguments().filter_map(clap::Arg::get_long) {
            assert!(text.contains(&format!("--{option}")), "{name}: {option}");
        }
        for verb in command.get_subcommands() {
            let about = verb.get_about().unwrap().to_string();
            assert!(text.contains(&about), "{name}: {about}\n{text}");
            assert_eq!(
                find(&super::command(), &words(verb)).unwrap().get_name(),
                verb.get_name()
            );
            check(verb);
        }
    }

    /// The words naming a verb.
    fn words(verb: &Command) -> Vec<String> {
        let path = verb.get_bin_name().unwrap();
        path.split(' ').skip(1).map(str::to_owned).collect()
    }

    #[test]
    fn pages_have_every_verb_and_option() {
        check(&command());
    }

    #[test]
    fn the_lines_of_examples_stay_as_they_are() {
        let program = command();
        let text = plain(&page(program.find_subcommand("compensate").unwrap()));
        let examples = text.split_once(".SH EXAMPLES\n.nf\n").unwrap().1;
        let lines: Vec<&str> = examples.lines().collect();
        assert!(
            lines[0].starts_with("  torqcomp compensate run.csv --stand"),
            "{text}"
        );
        // The backslash at the end of a line is for the shell.
        assert!(lines[1].ends_with("\\\\"), "{text}");
        assert_eq!(lines.last(), Some(&".fi"));
    }
}
