//! Reading a file of any format.

use crate::failure::Failure;
use crate::io::csv::{Options, Place};
use crate::recording::{self, Recording};

/// Reads a file, whatever its format.
pub fn read(place: &Place, options: &Options) -> Result<Recording, Failure> {
    recording::read(place, options)
}
