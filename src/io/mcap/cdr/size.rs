//! Sizes of data of fixed size, depending on their start.

/// Number of bytes from start to end of data of fixed size, for each start modulo 8.
///
/// Data are aligned to multiples of their own size, so the layout after a field depends on its
/// start, but only modulo the largest alignment, which is 8.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PaddedSize([u64; 8]);

impl PaddedSize {
    /// Empty.
    pub const NONE: Self = Self([0; 8]);

    /// A number of `size` bytes aligned to `align`, a power of two up to 8.
    pub fn of(size: u8, align: u8) -> Self {
        let align = u64::from(align.clamp(1, 8));
        let size = u64::from(size);
        Self(std::array::from_fn(|start| {
            let start = start as u64;
            start.next_multiple_of(align) - start + size
        }))
    }

    /// Size from a start.
    pub fn length_from(&self, start: usize) -> usize {
        usize::try_from(self.0[start & 7]).unwrap_or(usize::MAX)
    }

    /// Concatenation.
    pub fn then(&self, next: &Self) -> Self {
        Self(std::array::from_fn(|start| {
            let length = self.0[start];
            let middle = (start as u64).wrapping_add(length) & 7;
            length.saturating_add(next.0[middle as usize])
        }))
    }

    /// Repetition.
    pub fn repeat(&self, count: u32) -> Self {
        let (mut power, mut result, mut left) = (*self, Self::NONE, count);
        while left > 0 {
            if left & 1 == 1 {
                result = result.then(&power);
            }
            power = power.then(&power);
            left >>= 1;
        }
        result
    }

    /// Length of all repetitions except the first, if constant.
    pub fn stride(&self) -> Option<u64> {
        let mut strides = (0..8_usize).flat_map(|start| {
            let mut at = start as u64 + self.0[start];
            std::array::from_fn::<_, 8, _>(|_| {
                let length = self.0[(at & 7) as usize];
                at = at.wrapping_add(length);
                length
            })
        });
        let first = strides.next()?;
        strides.all(|stride| stride == first).then_some(first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_padded_to_its_own_size() {
        let double = PaddedSize::of(8, 8);
        assert_eq!(
            [0, 1, 4, 8].map(|start| double.length_from(start)),
            [8, 15, 12, 8]
        );
        let short = PaddedSize::of(8, 4);
        assert_eq!([0, 1, 4].map(|start| short.length_from(start)), [8, 11, 8]);
    }

    #[test]
    fn repetition_is_the_same_as_one_after_the_other() {
        // A byte and a double, 1 + 7 + 8 bytes from 0, then 1 + 7 + 8 again.
        let pair = PaddedSize::of(1, 1).then(&PaddedSize::of(8, 8));
        assert_eq!(pair.length_from(0), 16);
        for odd in [
            pair,
            PaddedSize::of(4, 4).then(&PaddedSize::of(1, 1)),
            PaddedSize::of(2, 2),
        ] {
            let mut slow = PaddedSize::NONE;
            for count in 0..20 {
                assert_eq!(odd.repeat(count), slow);
                slow = slow.then(&odd);
            }
        }
        assert_eq!(
            PaddedSize::of(8, 8).repeat(u32::MAX).length_from(0),
            8 * u32::MAX as usize
        );
        assert_eq!(PaddedSize::of(8, 8).stride(), Some(8));
        assert_eq!(
            PaddedSize::of(4, 4).then(&PaddedSize::of(1, 1)).stride(),
            Some(8)
        );
        // 12 bytes from 0, then 4 of padding and 12.
        assert_eq!(
            PaddedSize::of(8, 8).then(&PaddedSize::of(4, 4)).stride(),
            Some(16)
        );
    }
}
