//! Reading a file of any format.

use super::messages;
use super::report::InspectedChannel;
use super::whole::Whole;
use crate::failure::Failure;
use crate::io::mcap::Inventory;
use crate::io::{ChannelChoice, Input, Reading};
use crate::recording::{Recording, refuse_for_messages, refuse_for_text};

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
pub fn read(place: &Input, reading: &Reading) -> Result<Content, Failure> {
    if place.is_mcap()? {
        refuse_for_messages(reading)?;
        return messages::read(place, reading);
    }
    refuse_for_text(&ChannelChoice::default(), reading)?;
    let recording = Recording::of_text(place, reading, MOST_TEXT)?;
    recording.must_not_be_transposed()?;
    Ok(Content {
        recording,
        wholes: Vec::new(),
        listed: Vec::new(),
        inventory: None,
    })
}
