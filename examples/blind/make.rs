//! Writing blind records, several at a time.

use std::io;
use std::path::PathBuf;

use crate::blind::{catalogue, record, several, write};
use crate::parallel::each;

/// What to make.
#[derive(clap::Args)]
pub struct Make {
    /// Where to.
    folder: PathBuf,
    /// Cases per effect.
    #[arg(long, default_value_t = 20)]
    per_effect: usize,
    /// Number of the first case.
    #[arg(long, default_value_t = 0)]
    first: usize,
    /// Another seed gives other records.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only these effects; "two" and "three" are records with so many of them at once.
    #[arg(long)]
    only: Vec<String>,
    /// Threads.
    #[arg(long, default_value_t = 2)]
    threads: usize,
}

/// Makes the records, number by number, so that a set that is cut short still has every effect in it.
pub fn make(arguments: &Make) -> io::Result<()> {
    let several = several::SEVERAL.iter().map(|(name, _)| *name);
    let wanted: Vec<&str> = catalogue::effects()
        .into_iter()
        .chain(several)
        .filter(|name| arguments.only.is_empty() || arguments.only.iter().any(|only| only == name))
        .collect();
    let numbers = arguments.first..arguments.first + arguments.per_effect;
    let cases: Vec<(&str, usize)> = numbers
        .flat_map(|number| wanted.iter().map(move |name| (*name, number)))
        .collect();
    let done = each(&cases, arguments.threads, |(effect, number)| {
        let case = record::make(arguments.seed, effect, *number)
            .ok_or_else(|| io::Error::other(format!("no effect is called {effect}")))?;
        let folder = arguments.folder.join(effect).join(format!("{number:03}"));
        write::write(&case, &folder)?;
        let number_of = |section: &str, key: &str| case.truth[section][key].as_f64();
        eprintln!(
            "{effect} {number:03} {}: strength {:.2?} and {:.2?}",
            case.truth["variant"].as_str().unwrap_or_default(),
            number_of("strength", "train"),
            number_of("strength", "holdout"),
        );
        Ok(())
    });
    done.into_iter().collect()
}
