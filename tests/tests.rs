//! Tests through the `torqcomp` binary, and every number of the thesis.

mod untrusted;
mod util;

mod agreement;
mod applied_noise;
mod at_resonance;
mod bad_input;
mod band;
mod batch;
#[allow(dead_code)] // the example writes and scores what the tests only examine
mod blind;
mod blind_generator;
mod blind_wide;
mod changes;
mod clean;
mod commutation_spikes;
mod compensate;
mod decays;
mod detection;
mod diagnose;
#[cfg(debug_assertions)] // optimised builds have no faults on purpose
mod faults;
mod first_moves;
mod first_moves_files;
mod foreign_lines;
mod formats;
mod free_body;
mod golden;
mod harmonics;
mod identify;
mod in_motion;
mod inspect;
mod known_loads;
mod mcap_file;
mod measuring_chains;
#[cfg(target_os = "linux")] // peak memory of a process is available there
mod memory;
mod merge;
mod messages;
mod modes;
mod modes_diagnosed;
#[cfg(all(unix, not(target_os = "macos")))] // file systems of macOS reject other names
mod motion;
mod mutations;
mod names;
mod noise;
mod once;
mod one_mode;
mod output;
mod own_clocks;
mod packed;
mod pages;
mod predict;
mod rates;
mod recordings;
mod refined;
mod reports;
mod rows_in_turn;
mod running;
mod schema;
mod simulate;
mod small_beside_large;
mod standard_error;
mod stated_std;
mod surface;
mod table;
mod tdms;
mod text_tables;
mod text_values;
mod thesis;
mod times;
mod ways;
