//! Reading a file of any format.

use super::messages;
use super::report::InspectedChannel;
use super::whole::Whole;
use crate::failure::Failure;
use crate::io::Input;
use crate::io::csv::Options;
use crate::io::mcap::Inventory;
use crate::recording::{self, Recording};

/// Bytes of a text that are read at most.
const MOST_TEXT: u64 = 1 << 27;

/// What is in a file.
#[derive(Debug, Clone)]
pub struct Content {
    /// The channels whose samples were read.
    pub recording: Recording,
    /// What all samples of a channel come to, where only the first were kept; of a text, nothing.
    pub wholes: Vec<Option<Whole>>,
    /// Channels that are only listed: their samples cannot be read, or are too many.
    pub listed: Vec<InspectedChannel>,
    /// Everything in an MCAP file.
    pub inventory: Option<Inventory>,
}

/// Reads a file, whatever its format.
pub fn read(place: &Input, options: &Options) -> Result<Content, Failure> {
    if place.is_mcap()? {
        return messages::read(place);
    }
    Ok(Content {
        recording: recording::read_first(place, options, MOST_TEXT)?,
        wholes: Vec::new(),
        listed: Vec::new(),
        inventory: None,
    })
}
