//! Reading a file of any format.

use super::messages;
use crate::failure::Failure;
use crate::io::csv::{Options, Place};
use crate::io::mcap::Inventory;
use crate::recording::{self, Recording};
use crate::report::inspect::Channel;

/// What is in a file.
#[derive(Debug, Clone)]
pub struct Content {
    /// The channels whose samples were read.
    pub recording: Recording,
    /// Channels that are only listed: their samples cannot be read, or are too many.
    pub listed: Vec<Channel>,
    /// Everything in an MCAP file.
    pub inventory: Option<Inventory>,
}

/// Reads a file, whatever its format.
pub fn read(place: &Place, options: &Options) -> Result<Content, Failure> {
    if place.is_mcap()? {
        return messages::read(place);
    }
    Ok(Content {
        recording: recording::read(place, options)?,
        listed: Vec::new(),
        inventory: None,
    })
}
