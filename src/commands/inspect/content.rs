//! Reading a file of any format.

use super::messages;
use super::report::InspectedChannel;
use super::whole;
use crate::failure::Failure;
use crate::io::mcap::Inventory;
use crate::io::{ChannelChoice, Input, Reading};
use crate::recording::{self, AllSamples, Recording, refuse_for_messages, refuse_for_text};

/// Maximum number of values kept of a text: eight bytes each.
const MOST_NUMBERS: usize = 1 << 22;

/// Content of a file.
#[derive(Debug, Clone)]
pub struct Content {
    /// Channels whose samples were read.
    pub recording: Recording,
    /// Statistics of all samples of a channel if only the first were kept.
    pub wholes: Vec<Option<AllSamples>>,
    /// Channels only listed, as their samples cannot be read or are too many.
    pub listed: Vec<InspectedChannel>,
    /// Everything in an MCAP file.
    pub inventory: Option<Inventory>,
}

/// Reads a file of any format.
pub fn read(place: &Input, reading: &Reading) -> Result<Content, Failure> {
    let mut content = unpacked(place, reading)?;
    content.recording.dialect = place.dialect(&content.recording.dialect);
    Ok(content)
}

fn unpacked(place: &Input, reading: &Reading) -> Result<Content, Failure> {
    if place.is_mcap()? {
        refuse_for_messages(reading)?;
        return messages::read(place, reading);
    }
    refuse_for_text(&ChannelChoice::default(), reading)?;
    let (mut recording, wholes) = match reading.range.is_some() {
        // The required samples are known only after reading all of them.
        true => (recording::read(place, reading)?, Vec::new()),
        false => Recording::of_text(place, reading, MOST_NUMBERS)?,
    };
    recording.must_not_be_transposed()?;
    let said = whole::warning(&recording.channels, &wholes);
    recording.warnings.extend(said);
    Ok(Content {
        recording,
        wholes,
        listed: Vec::new(),
        inventory: None,
    })
}
