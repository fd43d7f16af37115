//! Zero-phase low-pass for whole records.

use crate::Error;

/// Applies a Butterworth low-pass of this order forwards and backwards: gain `1/(1 + (f/f_c)²ⁿ)` at
/// every frequency, zero phase, −6 dB at f_c.
///
/// The ends are extended by reflection about the first and last sample, so that a trend does not ring
/// there.
///
/// # Errors
/// [`Error::TooShort`] for fewer than two samples, [`Error::NotPositive`] for a rate or corner that
/// is not positive.
///
/// ```
/// // A constant passes as it is.
/// let out = torqcomp_dsp::zero_phase::low_pass(&[2.0; 50], 100.0, 10.0, 4)?;
/// assert!(out.iter().all(|v| (v - 2.0).abs() < 1e-12));
/// # Ok::<(), torqcomp_dsp::Error>(())
/// ```
pub fn low_pass(
    samples: &[f64],
    rate_hz: f64,
    corner_hz: f64,
    order: u32,
) -> Result<Vec<f64>, Error> {
    for (name, value) in [("the sampling rate", rate_hz), ("the corner", corner_hz)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(Error::NotPositive { name, value });
        }
    }
    let count = samples.len();
    if count < 2 {
        return Err(Error::TooShort {
            what: "a low-pass",
            expected: 2,
            got: count,
        });
    }
    let pad = (count - 1).min((10.0 * rate_hz / corner_hz) as usize + 1);
    let mut padded = Vec::with_capacity(count + 2 * pad);
    let (first, last) = (samples[0], samples[count - 1]);
    padded.extend((1..=pad).rev().map(|i| 2.0 * first - samples[i]));
    padded.extend_from_slice(samples);
    padded.extend((1..=pad).map(|i| 2.0 * last - samples[count - 1 - i]));
    // The remaining step between both ends is removed as a straight line, which is not transformed.
    let (from, to) = (padded[0], padded[padded.len() - 1]);
    let line = |i: usize, length: usize| from + (to - from) * i as f64 / (length - 1) as f64;
    let length = padded.len();
    padded
        .iter_mut()
        .enumerate()
        .for_each(|(i, v)| *v -= line(i, length));
    let size = length.next_power_of_two();
    padded.resize(size, 0.0);
    let forward = torqcomp_fourier::forward(size);
    let mut spectrum = forward.make_output_vec();
    forward
        .process(&mut padded, &mut spectrum)
        .expect("buffers were made for this length");
    drop(forward);
    for (k, bin) in spectrum.iter_mut().enumerate() {
        let ratio = k as f64 * rate_hz / size as f64 / corner_hz;
        *bin *= 1.0 / (1.0 + ratio.powi(2 * order as i32)) / size as f64;
    }
    torqcomp_fourier::inverse(size)
        .process(&mut spectrum, &mut padded)
        .expect("buffers were made for this length");
    Ok((0..count)
        .map(|i| padded[pad + i] + line(pad + i, length))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_is_damped_by_the_square_of_the_filter_and_not_shifted() {
        let wave = |i: usize| (std::f64::consts::TAU * 20.0 * i as f64 / 1000.0).sin();
        let sine: Vec<f64> = (0..2000).map(wave).collect();
        let out = low_pass(&sine, 1000.0, 20.0, 4).unwrap();
        for (i, value) in out.iter().enumerate().take(1200).skip(800) {
            assert!(
                (value - 0.5 * wave(i)).abs() < 1e-3,
                "{i}: {value} {}",
                wave(i)
            );
        }
    }

    #[test]
    fn a_ramp_stays_a_ramp_to_its_ends() {
        let ramp: Vec<f64> = (0..300).map(|i| 3.0 - 0.5 * f64::from(i)).collect();
        let out = low_pass(&ramp, 100.0, 5.0, 2).unwrap();
        assert!(out.iter().zip(&ramp).all(|(a, b)| (a - b).abs() < 1e-9));
        assert!(low_pass(&[1.0], 1.0, 0.1, 2).is_err() && low_pass(&ramp, 100.0, 0.0, 2).is_err());
    }
}
