//! What the command line says about a signal.

use crate::failure::Failure;
use crate::io::csv;
use crate::io::mcap::{FieldChoice, TimeChoice};

/// What the command line says about a signal.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// About tables, and about rate and unit of any signal.
    pub table: csv::Options,
    /// About files of messages.
    pub messages: MessageOptions,
}

/// What is said about files of messages.
#[derive(Debug, Clone, Default)]
pub struct MessageOptions {
    /// Topic and field.
    pub selection: FieldChoice,
    /// The time that counts; told from the messages if not given.
    pub time: Option<TimeChoice>,
    /// Field with the spacing of samples, for messages with many of them.
    pub spacing: Option<String>,
}

impl Options {
    /// Refuses what only tables have.
    pub(super) fn check_for_messages(&self) -> Result<(), Failure> {
        let table = &self.table;
        let told = [
            ("--channel", table.channel.is_some()),
            ("--time-column", table.time_column.is_some()),
            ("--time-unit", table.time_unit.is_some()),
            ("--delimiter", table.told.delimiter.is_some()),
            ("--decimal", table.told.decimal.is_some()),
        ];
        refuse(
            &told,
            "the input is an MCAP file; choose with --topic /joint_states --field effort[0]",
        )
    }

    /// Refuses what only files of messages have.
    pub(super) fn check_for_text(&self) -> Result<(), Failure> {
        let MessageOptions {
            selection,
            time,
            spacing,
        } = &self.messages;
        let told = [
            ("--topic", selection.topic.is_some()),
            ("--field", selection.field.is_some()),
            ("--signal", selection.signal.is_some()),
            ("--time", time.is_some()),
            ("--spacing", spacing.is_some()),
        ];
        refuse(&told, "the input is a text; choose with --channel NAME")
    }
}

fn refuse(told: &[(&str, bool)], why: &str) -> Result<(), Failure> {
    match told.iter().find(|(_, is_told)| *is_told) {
        Some((flag, _)) => Err(Failure::usage(format_args!("{flag} does not apply: {why}"))),
        None => Ok(()),
    }
}
