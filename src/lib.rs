#![doc = include_str!("../README.md")]

mod chart;
pub mod cli;
pub mod commands;
mod diagnose;
#[cfg(test)]
mod docs_tests;
pub mod failure;
pub mod identify;
pub mod inverse;
pub mod io;
mod parallel;
pub mod pipeline;
pub mod print;
pub mod quality;
pub mod recording;
pub mod stand;
pub mod unit;
pub mod warning;
