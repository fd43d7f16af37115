//! The strongest line of a record, as a start for a fit.

/// A peak of a power spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Its frequency in Hz.
    pub frequency_hz: f64,
    /// Its full width at half its power, in Hz.
    pub width_hz: f64,
    /// Its power over the median power of the spectrum.
    pub prominence: f64,
}

/// Longest transform; longer records are truncated, which is enough for a start.
const LONGEST: usize = 1 << 20;

/// Power at frequencies k·rate/size, with the record padded to at least twice its length.
fn power(samples: &[f64]) -> (Vec<f64>, usize) {
    let used = &samples[..samples.len().min(LONGEST)];
    let size = (2 * used.len()).next_power_of_two().max(16);
    let mut padded = used.to_vec();
    padded.resize(size, 0.0);
    let transform = torqcomp_fourier::forward(size);
    let mut spectrum = transform.make_output_vec();
    transform
        .process(&mut padded, &mut spectrum)
        .expect("buffers were made for this length");
    (spectrum.iter().map(|bin| bin.norm_sqr()).collect(), size)
}

/// The strongest peak between two frequencies; `None` if the record is too short or has no power there.
///
/// ```
/// let sine: Vec<f64> = (0..1000).map(|i| (0.5 * f64::from(i)).sin()).collect();
/// let peak = torqcomp_dsp::peaks::strongest(&sine, 100.0, 1.0, 50.0).unwrap();
/// // 0.5 rad a sample at 100 samples a second: 7.958 Hz.
/// assert!((peak.frequency_hz - 7.958).abs() < 0.05);
/// ```
#[must_use]
pub fn strongest(samples: &[f64], rate_hz: f64, from_hz: f64, to_hz: f64) -> Option<Peak> {
    if samples.len() < 8 {
        return None;
    }
    let (power, size) = power(samples);
    let step = rate_hz / size as f64;
    let first = ((from_hz / step).ceil() as usize).max(1);
    let last = ((to_hz / step).floor() as usize).min(power.len() - 2);
    let best = (first..=last).max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
    let top = power[best];
    if top <= 0.0 {
        return None;
    }
    let below = |k: &usize| power[*k] < 0.5 * top;
    let left = (0..best).rev().find(below).unwrap_or(0);
    let right = (best + 1..power.len())
        .find(below)
        .unwrap_or(power.len() - 1);
    let mut sorted = power[1..].to_vec();
    let middle = sorted.len() / 2;
    let (_, median, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
    Some(Peak {
        frequency_hz: best as f64 * step,
        width_hz: (right - left - 1).max(1) as f64 * step,
        prominence: top / median.max(f64::MIN_POSITIVE),
    })
}

/// Highest frequency with a significant peak: at least `share` times the power of the strongest and 50 times the median.
#[must_use]
pub fn highest(samples: &[f64], rate_hz: f64, share: f64) -> Option<f64> {
    if samples.len() < 8 {
        return None;
    }
    let (power, size) = power(samples);
    let top = power[1..].iter().fold(0.0_f64, |m, p| m.max(*p));
    let mut sorted = power[1..].to_vec();
    let middle = sorted.len() / 2;
    let (_, median, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
    let limit = (50.0 * *median).max(share * top);
    let peak = |k: &usize| {
        power[*k] > limit
            && power[*k] >= power[k - 1]
            && power[*k] >= power[(k + 1).min(power.len() - 1)]
    };
    let found = (1..power.len()).rev().find(peak)?;
    Some(found as f64 * rate_hz / size as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn width_is_that_of_the_decay() {
        // |1/(σ + jΔω)|² halves at Δω = ±σ: σ/π wide.
        let (rate_hz, sigma) = (1000.0, 20.0);
        let record: Vec<f64> = (0..4000)
            .map(|i| f64::from(i) / rate_hz)
            .map(|t| (-sigma * t).exp() * (std::f64::consts::TAU * 100.0 * t).sin())
            .collect();
        let peak = strongest(&record, rate_hz, 10.0, 400.0).unwrap();
        assert!(
            (peak.frequency_hz - 100.0).abs() < 0.5 && (peak.width_hz - 6.37).abs() < 0.6,
            "{peak:?}"
        );
        assert!(highest(&record, rate_hz, 1e-4).unwrap() < 150.0);
        assert_eq!(strongest(&record[..7], rate_hz, 0.0, 1.0), None);
        assert_eq!(strongest(&[0.0; 100], rate_hz, 0.0, 100.0), None);
    }
}
