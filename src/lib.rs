#![doc = include_str!("../README.md")]

pub mod cli;
pub mod commands;
pub mod diagnose;
pub mod failure;
pub mod io;
pub mod pipeline;
pub mod recording;
pub mod report;
pub mod stand;
