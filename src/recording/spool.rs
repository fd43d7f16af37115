//! Samples of a record that is read several times: the first in memory, all others in a scratch file.

use std::cell::RefCell;
use std::io::Write;
use std::ops::Range;

use torqcomp_dsp::Error;
use torqcomp_dsp::store::SampleStore;

use crate::failure::{ErrorCode, Failure};
use crate::file_name::ShowPath;
use crate::io::storage::Scratch;

/// Number of samples kept in memory.
const HELD: usize = 1 << 16;
/// Number of samples read back at a time.
const PIECE: usize = 1 << 13;
/// Bytes of a sample.
const SIZE: usize = size_of::<f64>();

/// Samples in bounded memory.
#[derive(Debug, Default)]
pub(crate) struct Spool {
    held: Vec<f64>,
    /// The remaining samples, if any.
    file: Option<RefCell<Scratch>>,
    count: usize,
}

impl Spool {
    /// Appends samples.
    ///
    /// # Errors
    /// If there is no room.
    pub(super) fn keep(&mut self, samples: &[f64]) -> Result<(), Failure> {
        let (held, more) = samples.split_at(samples.len().min(HELD - self.held.len()));
        self.held.extend_from_slice(held);
        self.count += samples.len();
        match more.is_empty() {
            true => Ok(()),
            false => self.write(more).map_err(|error| {
                ErrorCode::NotEnoughRoom.failed(format_args!(
                    "the samples do not fit into a scratch file there: {error}; name a folder with room for 8 \
                     bytes a sample in TMPDIR"
                ))
                .at(std::env::temp_dir().shown())
            }),
        }
    }

    fn write(&mut self, samples: &[f64]) -> std::io::Result<()> {
        let file = match &mut self.file {
            Some(file) => file,
            none => none.insert(RefCell::new(Scratch::new()?)),
        };
        let bytes: Vec<u8> = samples.iter().flat_map(|x| x.to_ne_bytes()).collect();
        file.get_mut().write_all(&bytes)
    }

    /// Reads samples back, starting after those in memory.
    fn read(&self, from: usize, piece: &mut [f64]) -> std::io::Result<()> {
        let file = self
            .file
            .as_ref()
            .ok_or(std::io::ErrorKind::UnexpectedEof)?;
        let mut bytes = vec![0; piece.len() * SIZE];
        let offset = ((from - HELD) * SIZE) as u64;
        file.borrow_mut().read_at(offset, &mut bytes)?;
        let (samples, _) = bytes.as_chunks::<SIZE>();
        let pairs = piece.iter_mut().zip(samples);
        pairs.for_each(|(sample, bytes)| *sample = f64::from_ne_bytes(*bytes));
        Ok(())
    }
}

impl SampleStore for Spool {
    fn count(&self) -> usize {
        self.count
    }

    fn pass(&self, part: Range<usize>, visit: &mut dyn FnMut(usize, &[f64])) -> Result<(), Error> {
        let in_memory = part.start.min(HELD)..part.end.min(HELD);
        self.held.as_slice().pass(in_memory, visit)?;
        let mut piece = Vec::new();
        let mut at = part.start.max(HELD);
        while at < part.end {
            let end = (at + PIECE - at % PIECE).min(part.end);
            piece.resize(end - at, 0.0);
            let read = self.read(at, &mut piece);
            read.map_err(|error| Error::Unreadable {
                why: error.to_string(),
            })?;
            visit(at, &piece);
            at = end;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_come_back_in_any_part_and_as_often_as_wanted() {
        let value = |i: usize| i as f64 * 0.1;
        let samples: Vec<f64> = (0..HELD + 3 * PIECE + 7).map(value).collect();
        let mut spool = Spool::default();
        for piece in samples.chunks(5000) {
            spool.keep(piece).unwrap();
        }
        assert_eq!((spool.count(), spool.held.len()), (samples.len(), HELD));
        for part in [
            0..samples.len(),
            HELD - 3..HELD + 3,
            HELD + 5..samples.len() - 1,
            10..20,
            HELD..HELD,
        ] {
            assert_eq!(spool.part(part.clone()).unwrap(), samples[part]);
        }
    }
}
