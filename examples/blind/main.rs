//! Makes blind records and scores `torqcomp diagnose` on them.
//!
//! ```text
//! cargo run --release --example blind -- make DIR [--per-effect 20] [--seed 1] [--only EFFECT]
//! cargo run --release --example blind -- score DIR --binary PATH [--out docs/blind-records.md]
//! ```

#[path = "../../tests/blind/mod.rs"]
mod blind;

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use blind::{catalogue, record, write};
use clap::{Parser, Subcommand};

/// Blind records for `torqcomp diagnose`.
#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Make records: one folder per case, `DIR/EFFECT/NUMBER`.
    Make(Make),
}

#[derive(clap::Args)]
struct Make {
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
    /// Only these effects.
    #[arg(long)]
    only: Vec<String>,
    /// Threads.
    #[arg(long, default_value_t = 2)]
    threads: usize,
}

fn main() -> std::io::Result<()> {
    match Arguments::parse().task {
        Task::Make(arguments) => make(&arguments),
    }
}

fn make(arguments: &Make) -> std::io::Result<()> {
    let wanted: Vec<&str> = catalogue::effects()
        .into_iter()
        .filter(|name| arguments.only.is_empty() || arguments.only.iter().any(|only| only == name))
        .collect();
    // Number by number, so that a set that is cut short still has every effect in it.
    let numbers = arguments.first..arguments.first + arguments.per_effect;
    let cases: Vec<(&str, usize)> =
        numbers.flat_map(|number| wanted.iter().map(move |name| (*name, number))).collect();
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        let work = || -> std::io::Result<()> {
            while let Some((effect, number)) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                let case = record::make(arguments.seed, effect, *number).expect("a listed effect");
                let folder = arguments.folder.join(effect).join(format!("{number:03}"));
                write::write(&case, &folder)?;
                eprintln!(
                    "{effect} {number:03} {}: strength {:.2} and {:.2}, size {:.4}",
                    case.truth["variant"].as_str().unwrap_or_default(),
                    case.truth["strength"]["train"].as_f64().unwrap_or(f64::NAN),
                    case.truth["strength"]["holdout"].as_f64().unwrap_or(f64::NAN),
                    case.truth["size"].as_f64().unwrap_or(f64::NAN),
                );
            }
            Ok(())
        };
        let workers: Vec<_> = (0..arguments.threads).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| worker.join().expect("a worker ends"))
    })
}
