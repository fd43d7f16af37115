//! Provenance of a page: date, command line, version, the files read with their SHA-256, and the stand file.

use std::io;
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::chart::Page;
use crate::failure::{ErrorCode, Failure};
use crate::file_name::ShowPath;
use crate::io::{Input, sum};
use crate::recording::moment::utc;

/// Last second of the year 9999.
const LAST_SECOND: u64 = 253_402_300_799;

/// Provenance that a page gives.
pub(crate) struct Provenance {
    /// Date and time in UTC.
    date: String,
    command: String,
    /// Each input with its SHA-256, or the reason for not having one.
    inputs: Vec<[String; 2]>,
    /// Name, SHA-256 and text of the stand file.
    stand: Option<[String; 3]>,
}

impl Provenance {
    /// Provenance of this run, with its inputs and optional stand file.
    ///
    /// # Errors
    /// If one of them cannot be read, or `SOURCE_DATE_EPOCH` is set but not a time.
    pub(crate) fn of(inputs: &[PathBuf], stand: Option<(&str, &str)>) -> Result<Self, Failure> {
        let each = inputs.iter().map(|input| {
            let input = Input::of(input);
            Ok([input.name(), hash(&input)?])
        });
        Ok(Self {
            date: date()?,
            command: command(std::env::args_os().map(|word| word.shown().to_string())),
            inputs: each.collect::<Result<_, Failure>>()?,
            stand: stand.map(|(name, text)| {
                [
                    name.to_owned(),
                    sum::of_bytes(text.as_bytes()),
                    text.to_owned(),
                ]
            }),
        })
    }

    /// Writes it to a page.
    pub(crate) fn add_to(&self, page: &mut Page) {
        let fact = |name: &str, value: &str| [name.to_owned(), value.to_owned()];
        let mut facts = vec![
            fact("date", &self.date),
            fact("command", &self.command),
            fact("version", concat!("torqcomp ", env!("CARGO_PKG_VERSION"))),
        ];
        let named = |[name, sum]: &[String; 2]| match sum.as_str() {
            "" => fact("input", name),
            sum => fact("input", &format!("{name}, {sum}")),
        };
        facts.extend(self.inputs.iter().map(named));
        facts.push(match &self.stand {
            Some([name, sum, _]) => fact("stand file", &format!("{name}, SHA-256 {sum}")),
            None => fact("stand file", "none"),
        });
        page.facts(&facts);
        if let Some([name, _, text]) = &self.stand {
            page.folded(name, |page| page.preformatted(text));
        }
    }
}

/// Date and time in UTC (ISO 8601): now, or from `SOURCE_DATE_EPOCH` for reproducible files.
fn date() -> Result<String, Failure> {
    let seconds = match std::env::var("SOURCE_DATE_EPOCH") {
        Ok(text) => text.trim().parse().ok().filter(|s| *s <= LAST_SECOND),
        Err(std::env::VarError::NotPresent) => {
            let now = SystemTime::now().duration_since(UNIX_EPOCH);
            Some(now.map_or(0, |since| since.as_secs()))
        }
        Err(_) => None,
    };
    let seconds = seconds.ok_or_else(|| {
        ErrorCode::InvalidValue.usage(
            "the environment variable SOURCE_DATE_EPOCH is not a time; expected whole seconds since 1970",
        )
    })?;
    Ok(format!("{}Z", utc(seconds)))
}

/// The command line quoted for a shell, with the program without its path.
fn command(words: impl Iterator<Item = String>) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./=:,+%@^".contains(c);
    let quoted = |word: String| match !word.is_empty() && word.chars().all(is_plain) {
        true => word,
        false => format!("'{}'", word.replace('\'', r"'\''")),
    };
    let rest: Vec<String> = words.skip(1).map(quoted).collect();
    format!("torqcomp {}", rest.join(" "))
}

/// SHA-256 of an input; none if it can be read only once.
fn hash(input: &Input) -> Result<String, Failure> {
    let path = match input {
        Input::Stdin => return Ok(String::new()),
        Input::File(path) => path.as_path(),
    };
    let unreadable = |error: &io::Error| Failure::reading(path, error);
    if !path.metadata().map_err(|e| unreadable(&e))?.is_file() {
        return Ok("not a regular file, so without SHA-256".to_owned());
    }
    let sum = sum::of_file(path).map_err(|e| unreadable(&e))?;
    Ok(format!("SHA-256 {sum}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_the_hash_of_the_standard() {
        // FIPS 180-2, B.1: "abc".
        let mut file = tempfile::NamedTempFile::new().unwrap();
        io::Write::write_all(&mut file, b"abc").unwrap();
        assert_eq!(
            hash(&Input::File(file.path().to_owned())).unwrap(),
            "SHA-256 ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
        assert_eq!(hash(&Input::Stdin), Ok(String::new()));
        let folder = Input::File(std::env::temp_dir());
        assert!(hash(&folder).unwrap().contains("without SHA-256"));
    }

    #[test]
    fn a_command_can_be_given_to_a_shell_again() {
        let words = ["/usr/bin/torqcomp", "table", "--unit", "N m", "it's", ""];
        let line = command(words.into_iter().map(str::to_owned));
        assert_eq!(line, r"torqcomp table --unit 'N m' 'it'\''s' ''");
    }
}
