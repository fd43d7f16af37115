//! Splitting a stream into windows for compensation one by one.

use std::collections::VecDeque;

use super::{BlockConvolver, InverseFilter, continued};
use crate::Error;

/// Splits a stream of segments into windows: each segment with `half_length` samples before and
/// after it, from its neighbours, or from the record's extension at its two ends.
///
/// Memory: the segments waiting for the samples after them.
#[derive(Debug)]
pub struct Windows {
    half_length: usize,
    /// `half_length` samples before the oldest waiting segment (once started), then the waiting
    /// segments.
    buffer: Vec<f64>,
    /// Lengths of the waiting segments, oldest first.
    waiting: VecDeque<usize>,
    started: bool,
    /// Samples of the record before the oldest waiting segment.
    passed: usize,
}

impl Windows {
    /// Windows for a filter of this half-length.
    #[must_use]
    pub fn new(half_length: usize) -> Self {
        Self {
            half_length,
            buffer: Vec::new(),
            waiting: VecDeque::new(),
            started: false,
            passed: 0,
        }
    }

    /// Samples of the record before the oldest waiting segment.
    #[must_use]
    pub fn passed(&self) -> usize {
        self.passed
    }

    /// Takes the next segment of the record, of any length, including zero.
    pub fn push(&mut self, segment: &[f64]) {
        self.buffer.extend_from_slice(segment);
        self.waiting.push_back(segment.len());
    }

    /// Moves the window of the oldest waiting segment into `window` and returns `true`, if enough
    /// samples follow that segment.
    pub fn pop(&mut self, window: &mut Vec<f64>) -> bool {
        let Some(&length) = self.waiting.front() else {
            return false;
        };
        let before = if self.started { self.half_length } else { 0 };
        let following = self.buffer.len() - before - length;
        // The very first window also needs samples to reflect.
        let too_short_to_start = !self.started && self.buffer.len() <= self.half_length;
        if following < self.half_length || too_short_to_start {
            return false;
        }
        self.start();
        self.cut(length, window);
        true
    }

    /// Marks the end of the record: it is extended so that [`Windows::pop`] returns the remaining
    /// windows.
    pub fn finish(&mut self) {
        if self.buffer.is_empty() {
            return;
        }
        self.start();
        let recorded = &self.buffer[self.half_length - self.passed.min(self.half_length)..];
        let end = recorded.len();
        let reflected: Vec<f64> = (end..end + self.half_length)
            .map(|i| continued(recorded, i as isize))
            .collect();
        self.buffer.extend(reflected);
    }

    /// Prepends the extension before the first sample.
    fn start(&mut self) {
        if self.started {
            return;
        }
        let half = self.half_length as isize;
        let reflected: Vec<f64> = (-half..0).map(|i| continued(&self.buffer, i)).collect();
        self.buffer.splice(0..0, reflected);
        self.started = true;
    }

    fn cut(&mut self, length: usize, window: &mut Vec<f64>) {
        window.clear();
        window.extend_from_slice(&self.buffer[..length + 2 * self.half_length]);
        self.buffer.drain(..length);
        self.waiting.pop_front();
        self.passed += length;
    }
}

/// Compensation of a record that arrives piece by piece.
///
/// ```
/// use std::sync::Arc;
/// use num_complex::Complex64;
/// use torqcomp_dsp::{band::Band, compensate::{InverseFilter, Stream, whole_record}};
///
/// let band = Band::new(20_000.0, 2400.0)?;
/// let inverse = Arc::new(|f: f64| Complex64::new(1.0 - (f / 590.0).powi(2), 0.1 * f / 590.0));
/// let filter = InverseFilter::design(inverse, band)?;
/// let record: Vec<f64> = (0..9000).map(|i| (i as f64 * 0.03).sin()).collect();
///
/// let mut stream = Stream::new(&filter);
/// let mut out = Vec::new();
/// for piece in record.chunks(700) {
///     stream.push(piece, &mut out)?;
/// }
/// stream.finish(&mut out);
///
/// assert_eq!(out.len(), record.len());
/// let whole = whole_record(&filter, &record)?;
/// assert!(out.iter().zip(&whole).all(|(a, b)| (a - b).abs() < 1e-8));
/// # Ok::<(), torqcomp_dsp::Error>(())
/// ```
pub struct Stream {
    windows: Windows,
    convolver: BlockConvolver,
    /// Samples that do not yet fill a block.
    held: Vec<f64>,
    window: Vec<f64>,
    taken: usize,
}

impl Stream {
    /// Starts a stream.
    #[must_use]
    pub fn new(filter: &InverseFilter) -> Self {
        Self {
            windows: Windows::new(filter.half_length()),
            convolver: BlockConvolver::new(filter),
            held: Vec::new(),
            window: Vec::new(),
            taken: 0,
        }
    }

    /// Takes the next samples and appends the results that they complete to `out`.
    ///
    /// # Errors
    /// [`Error::NonFinite`] for a sample that is not a number, counted from the record's start;
    /// none of this piece is then taken.
    pub fn push(&mut self, samples: &[f64], out: &mut Vec<f64>) -> Result<(), Error> {
        if let Some(index) = samples.iter().position(|x| !x.is_finite()) {
            return Err(Error::NonFinite {
                index: self.taken + index,
                value: samples[index],
            });
        }
        self.taken += samples.len();
        self.held.extend_from_slice(samples);
        let step = self.convolver.step();
        let full = self.held.len() / step * step;
        self.held[..full]
            .chunks(step)
            .for_each(|block| self.windows.push(block));
        self.held.drain(..full);
        self.drain(out);
        Ok(())
    }

    /// Ends the record and appends the rest to `out`.
    pub fn finish(mut self, out: &mut Vec<f64>) {
        self.windows.push(&self.held);
        self.windows.finish();
        self.drain(out);
    }

    fn drain(&mut self, out: &mut Vec<f64>) {
        while self.windows.pop(&mut self.window) {
            let start = out.len();
            let length = self.window.len() - 2 * self.windows.half_length;
            out.resize(start + length, 0.0);
            self.convolver
                .convolve(&self.window, &mut out[start..], None);
        }
    }
}
