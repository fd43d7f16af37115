//! A line whose frequency changes over a record: an order of a shaft that speeds up or slows down. Nothing of it repeats
//! with the input, so that differences between periods count it as noise, and it is no line of the whole record either.

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::quality::median;

use super::fit::RecordResidual;
use super::spectra::spectra;

/// Numbers of segments of a record that are tried: a line must stay within a few bins of a segment's spectrum.
const SEGMENTS: [usize; 4] = [8, 16, 32, 64];
/// Minimum number of samples of a segment.
const SHORTEST: usize = 64;
/// Half-width in bins of a line under the Hann window, and the lowest bin of one.
const LOBE: usize = 2;
/// Median share of a segment's power that is in its strongest line. Of white noise it is a few per cent.
const MOSTLY: f64 = 0.5;
/// Minimum change of frequency over the record, of an input that may cause it, and maximum change from a segment to the
/// next, in bins.
const MOVED: f64 = 4.0;
const MOVED_INPUT: f64 = 1.0;
const JUMP: f64 = 2.0;

/// A line that moves.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct MovingLine {
    /// Frequency at the beginning, in Hz.
    pub from_hz: f64,
    /// Frequency at the end, in Hz.
    pub to_hz: f64,
    /// Share of the residual's power that it has in a typical segment of the record.
    pub share: f64,
}

impl MovingLine {
    /// The first one in the residuals of some records. That of a free decay, or of a swept input, which moves by several
    /// times as much, follows from the stand.
    pub fn of(residuals: &[RecordResidual]) -> Option<Self> {
        let is_swept = |r: &RecordResidual| {
            let input = r.record.applied_in_range();
            Self::in_any(input, r.record.rate_hz(), MOVED_INPUT).is_some()
        };
        let mut found = residuals.iter().filter_map(|r| {
            let line = Self::in_any(&r.samples, r.record.rate_hz(), MOVED)?;
            (!r.record.is_free() && !is_swept(r)).then_some(line)
        });
        found.next()
    }

    /// The clearest one for any number of segments.
    fn in_any(samples: &[f64], rate_hz: f64, moved: f64) -> Option<Self> {
        let found = SEGMENTS.into_iter().filter_map(|count| {
            // They overlap by half.
            let length = 2 * (samples.len() / (count + 1));
            (length >= SHORTEST).then(|| Self::in_segments(samples, length, rate_hz, moved))?
        });
        found.max_by(|a, b| a.share.total_cmp(&b.share))
    }

    fn in_segments(samples: &[f64], length: usize, rate_hz: f64, moved: f64) -> Option<Self> {
        let strongest = |segment: &Vec<_>| {
            let power: Vec<f64> = segment
                .iter()
                .map(num_complex::Complex64::norm_sqr)
                .collect();
            let last = power.len() - 1;
            let lobe = |k: usize| {
                power[(k - LOBE).max(1)..=(k + LOBE).min(last)]
                    .iter()
                    .sum::<f64>()
            };
            let peak = (LOBE..=last).max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
            // Whatever is slower is a drift.
            let whole: f64 = power[1..].iter().sum();
            Some((peak as f64, lobe(peak) / whole))
        };
        let segments = spectra(samples, length).segments;
        let found: Vec<(f64, f64)> = segments.iter().map(strongest).collect::<Option<_>>()?;
        let (bins, mut shares): (Vec<f64>, Vec<f64>) = found.into_iter().unzip();
        let share = median(&mut shares)?;
        let (first, last) = (*bins.first()?, *bins.last()?);
        let direction = (last - first).signum();
        let mut steps = bins.windows(2).map(|pair| direction * (pair[1] - pair[0]));
        let is_steady = steps.all(|step| (-1.0..=JUMP).contains(&step));
        let to_hz = rate_hz / length as f64;
        (share > MOSTLY && is_steady && (last - first).abs() >= moved).then_some(Self {
            from_hz: first * to_hz,
            to_hz: last * to_hz,
            share,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::diagnose::test_noise::noise;

    const RATE_HZ: f64 = 2000.0;

    fn record(signal: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut random = noise(3);
        let sample = |i| signal(f64::from(i) / RATE_HZ) + 0.3 * random();
        (0..8000).map(sample).collect()
    }

    #[test]
    fn a_run_up_is_seen_and_steady_lines_and_noise_are_not() {
        // From 20 Hz to 20 + 2·12·4 = 116 Hz.
        let run_up = record(|t| (TAU * (20.0 + 12.0 * t) * t).sin());
        let found = MovingLine::in_any(&run_up, RATE_HZ, MOVED).unwrap();
        let far = |found: f64, hz: f64| (found - hz).abs() > 8.0;
        assert!(
            !far(found.from_hz, 20.0) && !far(found.to_hz, 116.0),
            "{found:?}"
        );
        let down = run_up.iter().rev().copied().collect::<Vec<_>>();
        assert!(MovingLine::in_any(&down, RATE_HZ, MOVED).unwrap().to_hz < 30.0);
        assert!(MovingLine::in_any(&record(|t| (TAU * 70.0 * t).sin()), RATE_HZ, MOVED).is_none());
        for seed in 0..200 {
            let mut random = noise(seed);
            // White, and ringing with a bandwidth of a few Hz.
            let white: Vec<f64> = (0..8000).map(|_| random()).collect();
            let (mut last, mut before) = (0.0, 0.0);
            let ring = |x: &f64| {
                let now = x + 1.992 * 0.2_f64.cos() * last - 0.992 * before;
                (before, last) = (last, now);
                now
            };
            let ringing: Vec<f64> = white.iter().map(ring).collect();
            for samples in [white, ringing] {
                assert!(
                    MovingLine::in_any(&samples, RATE_HZ, MOVED).is_none(),
                    "{seed}"
                );
            }
        }
    }
}
