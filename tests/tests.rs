//! Tests through the `torqcomp` binary, and every number of the thesis.

mod util;

mod bad_input;
mod compensate;
mod harmonics;
mod identify;
mod inspect;
mod output;
mod predict;
mod table;
mod text_tables;
mod thesis;
