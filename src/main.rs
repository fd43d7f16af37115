//! The `torqcomp` command.
fn main() {}
