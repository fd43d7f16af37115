//! The torque recovered by `torqcomp compensate` with the true stand file, compared with the plain stand.

use std::fmt::Write as _;
use std::io;
use std::path::PathBuf;

use crate::blind::declared;
use crate::case::Case;
use crate::parallel::each;
use crate::torque::{Torque, with_stand};

/// What to recover.
#[derive(clap::Args)]
pub struct Recover {
    /// The folder that `make` wrote.
    folder: PathBuf,
    /// The `torqcomp` binary.
    #[arg(long)]
    binary: PathBuf,
    /// Only these effects.
    #[arg(long)]
    only: Vec<String>,
    /// Only cases up to this number.
    #[arg(long, default_value_t = u64::MAX)]
    max_number: u64,
    /// Runs at a time.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// Every record on a line of its own.
    #[arg(long)]
    each: bool,
}

/// Runs everything and prints a table.
pub fn recover(arguments: &Recover) -> io::Result<()> {
    let binary = std::path::absolute(&arguments.binary)?;
    let mut cases = Case::read_all(&arguments.folder)?;
    cases.retain(|case| {
        let wanted = arguments.only.is_empty() || arguments.only.iter().any(|n| n == case.effect());
        wanted && case.number() <= arguments.max_number && declared::stand(&case.truth).is_some()
    });
    let folder = tempfile::tempdir()?;
    let torques = each(&cases, arguments.jobs, |case| {
        let stand = folder
            .path()
            .join(format!("{}-{}.toml", case.effect(), case.number()));
        std::fs::write(&stand, declared::stand(&case.truth).unwrap_or_default())?;
        Ok(with_stand(case, &binary, &stand))
    });
    let torques: Vec<Torque> = torques.into_iter().collect::<io::Result<_>>()?;
    print!("{}", table(&cases, &torques, arguments.each));
    Ok(())
}

fn table(cases: &[Case], torques: &[Torque], each: bool) -> String {
    let mut text = String::from(
        "| effect | as | records | signal: before / after | torque: before / after | after over noise |\n\
         |---|---|---|---|---|---|\n",
    );
    let mut names: Vec<(&str, &str)> = cases.iter().map(|c| (c.effect(), c.variant())).collect();
    names.sort_unstable();
    names.dedup();
    for name in names {
        let of: Vec<(&Case, &Torque)> = cases
            .iter()
            .zip(torques)
            .filter(|(c, _)| (c.effect(), c.variant()) == name)
            .collect();
        let mut columns: [Vec<f64>; 3] = Default::default();
        for (case, torque) in &of {
            let row = figures(case, torque);
            if each {
                let error = torque.refined.as_ref().err().map_or("", String::as_str);
                let _ = writeln!(
                    text,
                    "| {} | {} | {:03} | {:.2} | {:.2} | {:.2} {error}|",
                    name.0,
                    name.1,
                    case.number(),
                    row[0],
                    row[1],
                    row[2]
                );
            }
            for (column, figure) in columns.iter_mut().zip(row) {
                column.push(figure);
            }
        }
        let cells: Vec<String> = columns.iter_mut().map(|c| middle(c)).collect();
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} |",
            name.0,
            name.1,
            of.len(),
            cells.join(" | ")
        );
    }
    text
}

/// Before over after, for signal and torque; torque error over that due to noise.
fn figures(case: &Case, torque: &Torque) -> [f64; 3] {
    let number = |r: &Result<f64, String>| r.as_ref().copied().unwrap_or(f64::NAN);
    let refined = number(&torque.refined);
    [
        case.plain_error() / case.floor(),
        number(&torque.plain) / refined,
        refined / torque.floor,
    ]
}

/// Median, minimum and maximum.
fn middle(values: &mut [f64]) -> String {
    values.sort_by(f64::total_cmp);
    let values = &*values;
    match values {
        [] => "–".to_owned(),
        [one] => format!("{one:.2}"),
        [first, .., last] => format!("{:.2} ({first:.2} to {last:.2})", values[values.len() / 2]),
    }
}
