//! What `diagnose` reports, as text and as a page.

pub mod diagnose;
pub mod diagnose_page;
