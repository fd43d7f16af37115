//! Invalid command lines.

use std::path::PathBuf;

use clap::Error;
use clap::error::ErrorKind;

use crate::failure::{ErrorCode, Failure};
use crate::file_name::path_of_bytes;

/// Whether `--json` is among the arguments of the process, even if others are wrong.
pub(crate) fn is_json_asked() -> bool {
    let mut options = std::env::args_os().skip(1).take_while(|arg| arg != "--");
    options.any(|arg| arg == "--json")
}

/// The file of `--log` among the arguments of the process, even if others are wrong.
pub(crate) fn log_asked() -> Option<PathBuf> {
    let mut words = std::env::args_os().skip(1).take_while(|arg| arg != "--");
    while let Some(word) = words.next() {
        if word == "--log" {
            return words.next().map(PathBuf::from);
        }
        let path = word.as_encoded_bytes().strip_prefix(b"--log=");
        if let Some(path) = path {
            return path_of_bytes(path);
        }
    }
    None
}

/// A rejection by clap as a failure; `None` for a request for help or the version.
pub(crate) fn wrong_usage(error: &Error) -> Option<Failure> {
    if error.kind() == ErrorKind::InvalidUtf8 {
        return Some(not_utf8());
    }
    let text = error.render().to_string();
    error
        .use_stderr()
        .then(|| code(error.kind()).usage(message(&text)))
}

/// The first argument of the process that is not UTF-8.
fn not_utf8() -> Failure {
    let mut all = std::env::args_os().skip(1);
    let wrong = all.find(|arg| arg.to_str().is_none());
    ErrorCode::InvalidValue.usage(format_args!(
        "the argument {:?} is not UTF-8; only file names may be in another encoding",
        wrong.unwrap_or_default()
    ))
}

fn code(kind: ErrorKind) -> ErrorCode {
    match kind {
        ErrorKind::UnknownArgument | ErrorKind::InvalidSubcommand => ErrorCode::UnknownArgument,
        ErrorKind::ArgumentConflict => ErrorCode::ConflictingArguments,
        ErrorKind::MissingRequiredArgument
        | ErrorKind::MissingSubcommand
        | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => ErrorCode::MissingArgument,
        _ => ErrorCode::InvalidValue,
    }
}

/// The first paragraph of clap's text, and after a semicolon its tip or, without one, the usage.
fn message(text: &str) -> String {
    let mut paragraphs = text.split("\n\n").map(|paragraph| {
        let words: Vec<&str> = paragraph.split_whitespace().collect();
        words.join(" ")
    });
    let first = paragraphs.next().unwrap_or_default();
    let what = first.strip_prefix("error: ").unwrap_or(&first);
    match paragraphs.find(|text| text.starts_with("tip: ") || text.starts_with("Usage: ")) {
        Some(hint) => format!("{what}; {}", hint.strip_prefix("tip: ").unwrap_or(&hint)),
        None => what.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_is_what_is_wrong_and_the_tip_what_to_do() {
        let refused = |words: &[&str]| {
            let error = crate::cli::command()
                .try_get_matches_from(words)
                .unwrap_err();
            let failure = wrong_usage(&error)?;
            let document = serde_json::to_value(failure.document()).unwrap();
            Some(document["error"].clone())
        };
        let wrong = refused(&["torqcomp", "inspect", "a.csv", "--jsn"]).unwrap();
        assert_eq!(wrong["code"], "unknown-argument");
        assert_eq!(wrong["message"], "unexpected argument '--jsn' found");
        assert_eq!(wrong["hint"], "a similar argument exists: '--json'");
        let missing = refused(&["torqcomp", "table"]).unwrap();
        assert_eq!(missing["code"], "missing-argument");
        assert!(missing["hint"].as_str().unwrap().starts_with("Usage: "));
        assert!(refused(&["torqcomp", "--help"]).is_none());
    }
}
