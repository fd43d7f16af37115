//! What the verbs report, as plain data: one struct for each, written as text or as JSON.

pub mod chart;
pub mod compensate;
pub mod diagnose;
pub mod diagnose_page;
pub mod harmonics;
pub mod inspect;
pub mod page;
pub mod panels;
pub mod predict;
pub mod simulate;
pub mod svg;
