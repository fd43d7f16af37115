//! Decimation of records whose upper frequencies contain only noise.

use std::f64::consts::PI;

use crate::Error;

/// Half-length of the low-pass in samples of the result.
const REACH: usize = 8;
/// Corner relative to the new rate.
const CORNER: f64 = 0.36;
/// Shape parameter of the Kaiser window, for 80 dB.
const BETA: f64 = 7.9;

/// Frequency, relative to the new rate, up to which the response is 1 within 2·10⁻⁴.
pub const PASS: f64 = 0.2;

/// A record at a lower rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Decimated {
    /// Its samples.
    pub samples: Vec<f64>,
    /// Index of the first of them in the record.
    pub first: usize,
    /// Decimation factor.
    pub factor: usize,
}

/// Low-pass filters a record (symmetrical Kaiser-windowed sinc) and keeps every `factor`-th sample, where the filter
/// lies within the record.
///
/// A sum of exponentials keeps its frequencies and decay rates, as a linear filter changes only amplitudes; below
/// [`PASS`] times the new rate it also keeps those.
///
/// # Errors
/// [`Error::TooShort`] if fewer than two samples would remain.
///
/// ```
/// let slow: Vec<f64> = (0..1000).map(|i| (0.01 * f64::from(i)).sin()).collect();
/// let few = torqcomp_dsp::decimate::decimate(&slow, 10)?;
/// assert_eq!((few.first, few.samples.len()), (80, 84));
/// assert!((few.samples[7] - (0.01_f64 * 150.0).sin()).abs() < 2e-4);
/// # Ok::<(), torqcomp_dsp::Error>(())
/// ```
pub fn decimate(samples: &[f64], factor: usize) -> Result<Decimated, Error> {
    let factor = factor.max(1);
    if factor == 1 {
        return Ok(Decimated {
            samples: samples.to_vec(),
            first: 0,
            factor,
        });
    }
    let half = REACH * factor;
    let expected = 2 * half + 1 + factor;
    if samples.len() < expected {
        return Err(Error::TooShort {
            what: "a lower rate",
            expected,
            got: samples.len(),
        });
    }
    let taps = taps(half, CORNER / factor as f64);
    let kept = samples
        .windows(taps.len())
        .step_by(factor)
        .map(|window| window.iter().zip(&taps).map(|(x, h)| x * h).sum())
        .collect();
    Ok(Decimated {
        samples: kept,
        first: half,
        factor,
    })
}

/// A low-pass of 2·half + 1 taps with sum 1; the corner in cycles per sample.
fn taps(half: usize, corner: f64) -> Vec<f64> {
    let mut taps = windowed_sinc(half, corner);
    let sum: f64 = taps.iter().sum();
    taps.iter_mut().for_each(|t| *t /= sum);
    taps
}

/// The same, with a gain of about [`window_gain`].
pub(crate) fn windowed_sinc(half: usize, corner: f64) -> Vec<f64> {
    let tap = |i: usize| {
        let k = i as f64 - half as f64;
        let x = k / (half + 1) as f64;
        let sinc = if k == 0.0 {
            2.0 * corner
        } else {
            (2.0 * PI * corner * k).sin() / (PI * k)
        };
        sinc * bessel_i0(BETA * (1.0 - x * x).sqrt())
    };
    (0..=2 * half).map(tap).collect()
}

/// Centre value of the Kaiser window as computed here.
pub(crate) fn window_gain() -> f64 {
    bessel_i0(BETA)
}

/// Modified Bessel function of order 0, by its series.
fn bessel_i0(x: f64) -> f64 {
    let (mut term, mut sum, mut k) = (1.0, 1.0, 1.0);
    while term > 1e-17 * sum {
        term *= (0.5 * x / k).powi(2);
        sum += term;
        k += 1.0;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decays_keep_their_rates_and_what_is_above_is_gone() {
        let decay = |t: f64| (-0.002 * t).exp() * (0.05 * t).cos();
        let record: Vec<f64> = (0..4000)
            .map(|i| decay(f64::from(i)) + (2.5 * f64::from(i)).sin())
            .collect();
        let few = decimate(&record, 12).unwrap();
        for (k, value) in few.samples.iter().enumerate() {
            let want = decay((few.first + 12 * k) as f64);
            assert!((value - want).abs() < 4e-4, "{k}: {value} {want}");
        }
    }

    #[test]
    fn short_records_are_refused_and_factor_one_changes_nothing() {
        assert!(matches!(
            decimate(&[0.0; 100], 10),
            Err(Error::TooShort { .. })
        ));
        assert_eq!(decimate(&[1.0, 2.0], 1).unwrap().samples, [1.0, 2.0]);
    }
}
