//! Writing blind records in parallel.

use std::io;
use std::path::PathBuf;

use crate::blind::setting::Asked;
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
    /// Only these effects; "two" and "three" are records with so many of them at once, "mixed" one with an effect that
    /// is not listed beside one that is.
    #[arg(long)]
    only: Vec<String>,
    /// Stands from 0.5 Hz to 5 kHz, hardly to strongly damped, with inputs and recorders of several kinds, instead of the
    /// stand of the thesis.
    #[arg(long)]
    wide: bool,
    /// Least and largest strength, as in 0.3..25.
    #[arg(long, value_parser = range)]
    strength: Option<(f64, f64)>,
    /// Threads.
    #[arg(long, default_value_t = 2)]
    threads: usize,
}

/// Two positive numbers in ascending order.
fn range(text: &str) -> Result<(f64, f64), String> {
    let wrong = || format!("`{text}` is not a range of two positive numbers such as 0.3..25");
    let (least, most) = text.split_once("..").ok_or_else(wrong)?;
    match (least.parse::<f64>(), most.parse::<f64>()) {
        (Ok(least), Ok(most)) if 0.0 < least && least <= most && most.is_finite() => {
            Ok((least, most))
        }
        _ => Err(wrong()),
    }
}

/// Makes the records by number, so that an interrupted set still contains every effect.
pub fn make(arguments: &Make) -> io::Result<()> {
    let asked = (arguments.wide || arguments.strength.is_some()).then_some(Asked {
        wide: arguments.wide,
        strength: arguments.strength,
    });
    // Only on request with the stand of the thesis.
    let with_mixed = arguments.wide || arguments.only.iter().any(|only| only == several::MIXED);
    let several = several::SEVERAL.iter().map(|(name, _)| *name);
    let wanted: Vec<&str> = catalogue::effects()
        .into_iter()
        .chain(several)
        .chain(with_mixed.then_some(several::MIXED))
        .filter(|name| arguments.only.is_empty() || arguments.only.iter().any(|only| only == name))
        .collect();
    let numbers = arguments.first..arguments.first + arguments.per_effect;
    let cases: Vec<(&str, usize)> = numbers
        .flat_map(|number| wanted.iter().map(move |name| (*name, number)))
        .collect();
    let done = each(&cases, arguments.threads, |(effect, number)| {
        let case = match &asked {
            Some(asked) => record::make_as(asked, arguments.seed, effect, *number),
            None => record::make(arguments.seed, effect, *number),
        };
        let case = case.ok_or_else(|| io::Error::other(format!("no effect is called {effect}")))?;
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
