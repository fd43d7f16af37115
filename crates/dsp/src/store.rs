//! Samples that can be read several times, wherever they are stored.

use std::ops::Range;

use crate::Error;

/// Samples read in pieces, as often as needed.
pub trait SampleStore {
    /// Number of samples.
    fn count(&self) -> usize;

    /// Calls `visit` with the pieces of a part in order: index of the first sample, and the samples.
    ///
    /// # Errors
    /// [`Error::Unreadable`] if they can no longer be read.
    fn pass(&self, part: Range<usize>, visit: &mut dyn FnMut(usize, &[f64])) -> Result<(), Error>;

    /// The samples of a part.
    ///
    /// # Errors
    /// Those of [`SampleStore::pass`].
    fn part(&self, part: Range<usize>) -> Result<Vec<f64>, Error> {
        let mut samples = Vec::with_capacity(part.len());
        self.pass(part, &mut |_, piece| samples.extend_from_slice(piece))?;
        Ok(samples)
    }
}

/// Samples per piece.
const PIECE: usize = 1 << 14;

impl SampleStore for [f64] {
    fn count(&self) -> usize {
        self.len()
    }

    fn pass(&self, part: Range<usize>, visit: &mut dyn FnMut(usize, &[f64])) -> Result<(), Error> {
        let first = part.start;
        let pieces = self[part].chunks(PIECE).enumerate();
        pieces.for_each(|(place, piece)| visit(first + place * PIECE, piece));
        Ok(())
    }
}

impl SampleStore for Vec<f64> {
    fn count(&self) -> usize {
        self.len()
    }

    fn pass(&self, part: Range<usize>, visit: &mut dyn FnMut(usize, &[f64])) -> Result<(), Error> {
        self.as_slice().pass(part, visit)
    }
}
