//! Every number of the thesis, with its equation number, printed beside what follows from its inputs.
//!
//! Every expected value was worked outside this crate with pencil arithmetic on the printed inputs in US units; the
//! crate computes in SI. `cargo test --test tests thesis -- --nocapture` shows them all; `docs/thesis.md` sums them up.

mod appendix_d;
mod comparison;
mod gage;
mod measured;
mod mechanics;
