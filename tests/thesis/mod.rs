//! Every number of the thesis, with its equation number, printed next to the result of its inputs.
//!
//! Every expected value was computed by hand, independently of this crate, from the printed inputs in US units; the
//! crate computes in SI. `cargo test --test tests thesis -- --nocapture` shows them all; `docs/thesis.md` summarises
//! them.

mod appendix_d;
mod comparison;
mod gage;
mod measured;
mod mechanics;
