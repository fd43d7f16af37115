//! Reading a file of any format.

use std::io::{BufRead, Read};

use super::messages;
use crate::failure::Failure;
use crate::io::csv::{Options, Place};
use crate::io::mcap::Inventory;
use crate::recording::{self, Recording};
use crate::report::inspect::Channel;

/// First bytes of an MCAP file.
const MCAP: &[u8] = b"\x89MCAP";

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
    if is_mcap(place)? {
        return messages::read(place);
    }
    Ok(Content {
        recording: recording::read(place, options)?,
        listed: Vec::new(),
        inventory: None,
    })
}

/// Whether it begins as an MCAP file does; of standard input nothing is taken.
fn is_mcap(place: &Place) -> Result<bool, Failure> {
    if *place == Place::Stdin {
        let mut stdin = std::io::stdin().lock();
        let first = stdin.fill_buf().unwrap_or_default();
        return Ok(first.starts_with(MCAP));
    }
    let mut first = Vec::new();
    let read = place
        .open()?
        .take(MCAP.len() as u64)
        .read_to_end(&mut first);
    Ok(read.is_ok() && first == MCAP)
}
