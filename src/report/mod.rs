//! What the verbs report, as plain data: one struct for each, written as text or as JSON.

pub mod compensate;
pub mod diagnose;
pub mod diagnose_page;
pub mod inspect;
