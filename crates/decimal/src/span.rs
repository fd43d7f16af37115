//! Places in a text.

/// A piece of a text below 4 GiB. Half the size of a range, as one is kept for every row.
///
/// ```
/// let number = torqcomp_decimal::Span::new(5, 3);
/// assert_eq!((number.offset(), number.length()), (5, 3));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Span {
    offset: u32,
    length: u32,
}

impl Span {
    /// A piece of `length` bytes from `offset` on.
    #[inline]
    #[must_use]
    pub fn new(offset: usize, length: usize) -> Self {
        Self {
            offset: offset as u32,
            length: length as u32,
        }
    }

    /// Its first byte.
    #[inline]
    #[must_use]
    pub fn offset(self) -> usize {
        self.offset as usize
    }

    /// Its number of bytes.
    #[inline]
    #[must_use]
    pub fn length(self) -> usize {
        self.length as usize
    }
}
