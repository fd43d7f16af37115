//! Detection of non-finite samples.

/// Non-finite samples of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NonFinite {
    /// Number of samples.
    pub count: usize,
    /// Index of the first.
    pub first: usize,
    /// Longest run.
    pub longest: usize,
}

/// Counts the samples that are `NaN` or infinite; `None` if all are finite. Exact, so there are no
/// false alarms.
///
/// ```
/// use torqcomp_dsp::quality::finite::non_finite;
/// let found = non_finite(&[1.0, f64::NAN, f64::INFINITY, 2.0]).unwrap();
/// assert_eq!((found.count, found.first, found.longest), (2, 1, 2));
/// assert_eq!(non_finite(&[1.0]), None);
/// ```
#[must_use]
pub fn non_finite(samples: &[f64]) -> Option<NonFinite> {
    let first = samples.iter().position(|x| !x.is_finite())?;
    let (mut count, mut longest, mut row) = (0, 0, 0);
    for sample in &samples[first..] {
        row = if sample.is_finite() { 0 } else { row + 1 };
        count += usize::from(row > 0);
        longest = longest.max(row);
    }
    Some(NonFinite {
        count,
        first,
        longest,
    })
}
