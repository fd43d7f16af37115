//! Scoring `torqcomp diagnose` on blind records.

use std::io;
use std::path::PathBuf;

use crate::case::{Answer, Case};
use crate::parallel::each;
use crate::{report, torque};

/// What to score.
#[derive(clap::Args)]
pub struct Score {
    /// The folder that `make` wrote.
    folder: PathBuf,
    /// The `torqcomp` binary.
    #[arg(long)]
    binary: PathBuf,
    /// Where to write the report in Markdown; standard output otherwise.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Where the answers are kept; beside the records, with `-answers` added, otherwise.
    #[arg(long)]
    answers: Option<PathBuf>,
    /// Take answers that are there instead of running again.
    #[arg(long)]
    reuse: bool,
    /// Only these effects.
    #[arg(long)]
    only: Vec<String>,
    /// Only cases from this number on.
    #[arg(long, default_value_t = 0)]
    from_number: u64,
    /// Only cases up to this number.
    #[arg(long, default_value_t = u64::MAX)]
    max_number: u64,
    /// Runs at a time.
    #[arg(long, default_value_t = 1)]
    jobs: usize,
    /// Recover the torque with the plain and the refined stand, too.
    #[arg(long)]
    torque: bool,
    /// List every case that went wrong.
    #[arg(long)]
    failures: bool,
}

/// Runs everything and writes the report.
pub fn score(arguments: &Score) -> io::Result<()> {
    let binary = std::path::absolute(&arguments.binary)?;
    let answers = arguments.answers.clone().unwrap_or_else(|| {
        let mut name = arguments.folder.clone().into_os_string();
        name.push("-answers");
        name.into()
    });
    let answers = std::path::absolute(answers)?;
    let mut cases = Case::read_all(&arguments.folder)?;
    cases.retain(|case| {
        let wanted = arguments.only.is_empty() || arguments.only.iter().any(|n| n == case.effect());
        wanted && (arguments.from_number..=arguments.max_number).contains(&case.number())
    });
    // By number: an interrupted run has covered every effect.
    cases.sort_by_key(Case::number);
    let cells: Vec<_> = cases
        .into_iter()
        .map(|case| std::sync::Mutex::new(Some(case)))
        .collect();
    let done: Vec<io::Result<Answer>> = each(&cells, arguments.jobs, |cell| {
        let case = cell
            .lock()
            .expect("no thread has panicked")
            .take()
            .expect("each case once");
        let answer = case.diagnose(&binary, &answers, arguments.reuse)?;
        eprintln!("{}", report::line(&answer));
        Ok(answer)
    });
    let done: Vec<Answer> = done.into_iter().collect::<io::Result<_>>()?;
    let mut text = report::markdown(&done, arguments.failures);
    if arguments.torque {
        let checks = each(&done, arguments.jobs, |answer| {
            torque::check(answer, &binary)
        });
        text.push_str(&report::torques(&done, &checks));
    }
    match &arguments.out {
        Some(path) => std::fs::write(path, text),
        None => {
            println!("{text}");
            Ok(())
        }
    }
}
