//! Makes blind records and scores `torqcomp diagnose` on them.
//!
//! ```text
//! cargo run --release --example blind -- make DIR [--wide] [--per-effect 20] [--seed 1] [--only EFFECT]
//! cargo run --release --example blind -- score DIR --binary PATH [--out docs/blind-records.md]
//! cargo run --release --example blind -- recover DIR --binary PATH
//! ```

#[path = "../../tests/blind/mod.rs"]
mod blind;
mod case;
mod conditions;
mod make;
mod parallel;
mod recover;
mod report;
mod score;
mod torque;

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
    Make(make::Make),
    /// Run `torqcomp diagnose` on them and compare its answers with the truth.
    Score(score::Score),
    /// Run `torqcomp compensate` on them with the truth in the stand file.
    Recover(recover::Recover),
}

fn main() -> std::io::Result<()> {
    match Arguments::parse().task {
        Task::Make(arguments) => make::make(&arguments),
        Task::Score(arguments) => score::score(&arguments),
        Task::Recover(arguments) => recover::recover(&arguments),
    }
}
