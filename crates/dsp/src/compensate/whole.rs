//! Compensation of a whole record with one transform.

use super::{InverseFilter, continued, response_on_grid};
use crate::Error;

/// Compensates a record with one transform over all of it.
///
/// Every frequency of the transform is multiplied by the exact `W(f) H⁻¹(f)`; the record's
/// extension keeps its ends from affecting each other. Takes about 40 bytes of memory per sample.
///
/// # Errors
/// [`Error::TooShort`] for fewer than 2 samples, [`Error::NonFinite`] for a sample that is not a
/// number.
///
/// ```
/// use std::sync::Arc;
/// use num_complex::Complex64;
/// use torqcomp_dsp::{band::Band, compensate::{InverseFilter, whole_record}};
///
/// // A constant comes back times the static gain, to the ends of the record.
/// let filter = InverseFilter::design(
///     Arc::new(|f| Complex64::new(3.0 - f * f * 1e-6, 0.0)),
///     Band::new(20_000.0, 1000.0)?,
/// )?;
/// let out = whole_record(&filter, &[2.0; 100])?;
/// assert!(out.iter().all(|y| (y - 6.0).abs() < 1e-9));
/// # Ok::<(), torqcomp_dsp::Error>(())
/// ```
pub fn whole_record(filter: &InverseFilter, samples: &[f64]) -> Result<Vec<f64>, Error> {
    if samples.len() < 2 {
        return Err(Error::TooShort {
            what: "a compensation",
            expected: 2,
            got: samples.len(),
        });
    }
    if let Some(index) = samples.iter().position(|x| !x.is_finite()) {
        return Err(Error::NonFinite {
            index,
            value: samples[index],
        });
    }
    let margin = filter.half_length();
    let length = fast_length(samples.len() + 2 * margin);
    // The extensions of the two ends meet in the padding.
    let after = margin + (length - samples.len() - 2 * margin) / 2;
    let mut padded: Vec<f64> = (0..length)
        .map(|i| {
            let index = if i < samples.len() + after {
                i as isize
            } else {
                i as isize - length as isize
            };
            continued(samples, index)
        })
        .collect();

    let forward = torqcomp_fourier::forward(length);
    let mut spectrum = forward.make_output_vec();
    forward
        .process(&mut padded, &mut spectrum)
        .expect("buffers were made for this length");
    let scale = 1.0 / length as f64;
    for (bin, gain) in
        spectrum
            .iter_mut()
            .zip(response_on_grid(&filter.inverse, &filter.band, length)?)
    {
        *bin *= gain * scale;
    }
    torqcomp_fourier::inverse(length)
        .process(&mut spectrum, &mut padded)
        .expect("buffers were made for this length and the ends are real");
    padded.truncate(samples.len());
    Ok(padded)
}

/// Smallest even length of at least `least` samples with no prime factor above 5.
pub(super) fn fast_length(least: usize) -> usize {
    let mut best = least.next_power_of_two().max(2);
    let mut fives = 1;
    while fives <= best {
        let mut threes = fives;
        while threes <= best {
            let twos = least.div_ceil(threes).next_power_of_two().max(2);
            best = best.min(threes * twos);
            threes *= 3;
        }
        fives *= 5;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::fast_length;

    #[test]
    fn fast_lengths_are_the_smallest_smooth_ones() {
        let smooth = |mut n: usize| {
            for p in [2, 3, 5] {
                while n.is_multiple_of(p) {
                    n /= p;
                }
            }
            n == 1
        };
        for least in 1..3000 {
            let expected = (least.max(2)..).find(|n| n % 2 == 0 && smooth(*n)).unwrap();
            assert_eq!(fast_length(least), expected, "least {least}");
        }
    }
}
