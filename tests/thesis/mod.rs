//! Every number of the thesis, with its equation number, printed beside what follows from its inputs.
//!
//! `cargo test --test tests thesis -- --nocapture` shows them all; `docs/thesis.md` sums them up.

mod appendix_d;
mod gage;
mod mechanics;
