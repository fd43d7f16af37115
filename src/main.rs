//! The `torqcomp` command.

use std::process::ExitCode;

/// The musl allocator has a single lock for all threads.
#[cfg(target_env = "musl")]
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    torqcomp::run()
}
