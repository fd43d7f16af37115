//! Free decays of a record at one frequency, where a resonance far away is declared.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::resonance::Resonance;

/// Frequency range of the search: least number of periods in the record, and largest fraction of the rate.
const PERIODS: f64 = 20.0;
const HIGHEST: f64 = 0.4;
/// Relative width of the bands in which the spectrum is averaged, and number of bands to either side with which a peak is
/// compared.
const BAND: f64 = 0.03;
const SIDES: usize = 14;
/// Bands next to a peak that belong to it.
const OWN: usize = 4;
/// Power of a peak relative to the bands beside it, and number of peaks examined.
const PEAK: f64 = 6.0;
const MOST_PEAKS: usize = 5;
/// Relative standard deviation of the Gaussian filter around a peak.
const WIDTH: f64 = 0.15;
/// Envelope samples per period.
const PER_PERIOD: f64 = 4.0;
/// Periods after the start of a decay that the filter's own response disturbs, and least length of a decay.
const SETTLES: f64 = 2.0;
const LONG: f64 = 5.0;
/// Part of the start to which a decay is followed, and least decay in nepers.
const FOLLOWED: f64 = 0.12;
const FALLS: f64 = 1.2;
/// Start of a decay relative to the largest one.
const LARGE: f64 = 0.2;
/// Largest rms deviation of the logarithm of the envelope and of the phase from straight lines.
const STRAIGHT: [f64; 2] = [0.1, 0.2];
/// Range of the damping ratio.
const DAMPING: [f64; 2] = [1e-3, 0.1];
/// Largest relative difference of the frequencies, and ratio of the dampings, of decays of one resonance.
const SAME: [f64; 2] = [0.02, 1.4];
/// Least number of such decays, and least part of all maxima of the envelope that one could follow.
const DECAYS: usize = 2;
const MOSTLY: f64 = 0.5;
/// Smallest relative distance from a declared frequency.
const APART: f64 = 0.15;

/// The resonance at which a record decays freely again and again, if that is far from all declared modes (natural
/// frequency in Hz and damping ratio), and the record does not ring at those.
///
/// Peaks of the spectrum are filtered out one by one. A decay is a stretch of the filtered signal of at least five
/// periods in which the logarithm of the envelope and the phase are straight lines. Two of them with the same frequency
/// and damping are a resonance: steady lines do not decay, and noise has no straight phase.
///
/// ```
/// use torqcomp_dsp::quality::ringing::ringing_elsewhere;
/// // Hits on a body that rings at 59 Hz with a damping ratio of 0.02.
/// let ring = |t: f64| (-7.4 * t).exp() * (370.7 * t).sin();
/// let record: Vec<f64> = (0..10_000).map(|i| ring((f64::from(i) * 1e-3) % 1.7)).collect();
/// let found = ringing_elsewhere(&record, 1000.0, &[(370.7, 0.02)]).unwrap();
/// assert!((found.frequency_hz - 59.0).abs() < 0.5 && (found.damping_ratio - 0.02).abs() < 0.004);
/// assert_eq!(ringing_elsewhere(&record, 1000.0, &[(59.0, 0.02)]), None);
/// ```
#[must_use]
pub fn ringing_elsewhere(
    samples: &[f64],
    rate_hz: f64,
    declared: &[(f64, f64)],
) -> Option<Resonance> {
    let bands = Bands::of(samples, rate_hz)?;
    let is_declared = |hz: f64| declared.iter().any(|(at, _)| (hz / at - 1.0).abs() < APART);
    let rings = |hz: f64| bands.resonance(hz);
    if declared.iter().any(|(hz, _)| rings(*hz).is_some()) {
        return None;
    }
    let found = bands.peaks().into_iter().find_map(rings)?;
    (!is_declared(found.frequency_hz)).then_some(found)
}

/// The transform of a record, and its power in bands of equal relative width.
struct Bands {
    rate_hz: f64,
    count: usize,
    spectrum: Vec<Complex64>,
    frequency_hz: Vec<f64>,
    log_power: Vec<f64>,
}

impl Bands {
    fn of(samples: &[f64], rate_hz: f64) -> Option<Self> {
        let count = samples.len();
        let length = count.next_power_of_two();
        let (lowest_hz, highest_hz) = (PERIODS * rate_hz / count as f64, HIGHEST * rate_hz);
        if lowest_hz >= highest_hz {
            return None;
        }
        let (first, last) = (samples[0], samples[count - 1]);
        // Without a step from the end to the beginning.
        let line = |i: usize| first + (last - first) * i as f64 / (count - 1) as f64;
        let mut padded = vec![0.0; length];
        for (i, (to, from)) in padded.iter_mut().zip(samples).enumerate() {
            *to = from - line(i);
        }
        let transform = torqcomp_fourier::forward(length);
        let mut spectrum = transform.make_output_vec();
        transform.process(&mut padded, &mut spectrum).ok()?;
        let step_hz = rate_hz / length as f64;
        let (mut frequency_hz, mut log_power) = (Vec::new(), Vec::new());
        let mut lower_hz = lowest_hz;
        while lower_hz < highest_hz {
            let upper_hz = lower_hz * (1.0 + BAND);
            let [from, to] = [lower_hz, upper_hz].map(|hz| (hz / step_hz).ceil() as usize);
            let part = &spectrum[from..to.max(from + 1)];
            let power = part.iter().map(Complex64::norm_sqr).sum::<f64>() / part.len() as f64;
            // That of steps is the same in all bands.
            frequency_hz.push((lower_hz * upper_hz).sqrt());
            log_power.push((power * lower_hz * lower_hz).ln());
            lower_hz = upper_hz;
        }
        Some(Self {
            rate_hz,
            count,
            spectrum,
            frequency_hz,
            log_power,
        })
    }

    /// Frequencies of the highest peaks, relative to what is beside them.
    fn peaks(&self) -> Vec<f64> {
        let power = &self.log_power;
        let height = |k: usize| {
            let around = k.saturating_sub(SIDES)..(k + SIDES + 1).min(power.len());
            let beside = around.filter(|j| j.abs_diff(k) > OWN).map(|j| power[j]);
            let (sum, count) = beside.fold((0.0, 0.0), |(s, n), p| (s + p, n + 1.0));
            power[k] - sum / count
        };
        let is_peak = |k: &usize| {
            let near = k.saturating_sub(OWN)..(k + OWN + 1).min(power.len());
            near.clone().all(|j| power[j] <= power[*k])
        };
        let all = (0..power.len()).filter(is_peak);
        let mut peaks: Vec<(f64, f64)> = all.map(|k| (height(k), self.frequency_hz[k])).collect();
        peaks.retain(|(height, _)| *height > PEAK.ln());
        peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
        peaks.truncate(MOST_PEAKS);
        peaks.into_iter().map(|(_, hz)| hz).collect()
    }

    /// The resonance near a frequency, if at least two free decays show it.
    fn resonance(&self, near_hz: f64) -> Option<Resonance> {
        if near_hz > HIGHEST * self.rate_hz {
            return None;
        }
        let tried = self.decays(near_hz);
        let decays: Vec<Resonance> = tried.iter().flatten().copied().collect();
        let fewest = (MOSTLY * tried.len() as f64).ceil() as usize;
        let is_same = |a: &Resonance, b: &Resonance| {
            let damping = (a.damping_ratio / b.damping_ratio).ln().abs();
            (a.frequency_hz / b.frequency_hz - 1.0).abs() < SAME[0] && damping < SAME[1].ln()
        };
        let found = decays.iter().find(|a| {
            let same = decays.iter().filter(|b| is_same(a, b));
            same.count() >= fewest.max(DECAYS)
        })?;
        ((found.frequency_hz / near_hz - 1.0).abs() < WIDTH).then_some(*found)
    }

    /// Free decays of the signal around a frequency, one for each maximum of its envelope that leaves room for one;
    /// `None` for what is none.
    fn decays(&self, near_hz: f64) -> Vec<Option<Resonance>> {
        let (log_envelope, phase, step_s) = self.filtered(near_hz);
        let periods = |count: f64| (count * PER_PERIOD) as usize;
        let largest = log_envelope.iter().copied().fold(f64::MIN, f64::max);
        let (settles, long) = (periods(SETTLES), periods(LONG));
        let is_start = |k: &usize| {
            let near = k.saturating_sub(settles)..(k + settles + 1).min(log_envelope.len());
            let level = log_envelope[*k];
            level > largest + LARGE.ln() && log_envelope[near].iter().all(|other| *other <= level)
        };
        let starts: Vec<usize> = (0..log_envelope.len()).filter(is_start).collect();
        let decay = |(i, start): (usize, &usize)| {
            let from = start + settles;
            let next = starts.get(i + 1).copied().unwrap_or(log_envelope.len());
            let until = next.saturating_sub(settles);
            let level = log_envelope[*start] + FOLLOWED.ln();
            let room = log_envelope.get(from..until)?;
            if room.len() < long {
                return None;
            }
            let length = room.iter().take_while(|log| **log > level).count();
            if length < long {
                return Some(None);
            }
            let stretch = from..from + length;
            let (fall, off) = straight(&log_envelope[stretch.clone()]);
            let (turn, wavers) = straight(&phase[stretch]);
            let omega = TAU * near_hz + turn / step_s;
            let damping_ratio = -fall / step_s / omega;
            let is_decay = off < STRAIGHT[0]
                && wavers < STRAIGHT[1]
                && -fall * length as f64 > FALLS
                && (DAMPING[0]..DAMPING[1]).contains(&damping_ratio);
            Some(is_decay.then_some(Resonance {
                frequency_hz: omega / TAU,
                damping_ratio,
            }))
        };
        starts.iter().enumerate().filter_map(decay).collect()
    }

    /// Logarithm of the envelope and phase relative to `near_hz` of the signal around it, and their time step in s.
    fn filtered(&self, near_hz: f64) -> (Vec<f64>, Vec<f64>, f64) {
        let length = 2 * (self.spectrum.len() - 1);
        let step_hz = self.rate_hz / length as f64;
        let inverse = torqcomp_fourier::inverse(length);
        let [real, imaginary] = [Complex64::ONE, -Complex64::I].map(|turn| {
            let mut part = inverse.make_input_vec();
            let reach = (4.0 * WIDTH * near_hz / step_hz) as usize;
            let middle = (near_hz / step_hz) as usize;
            let lines = middle.saturating_sub(reach).max(1)..(middle + reach).min(length / 2);
            for k in lines {
                let off = (k as f64 * step_hz / near_hz - 1.0) / WIDTH;
                part[k] = turn * self.spectrum[k] * (-0.5 * off * off).exp();
            }
            let mut signal = inverse.make_output_vec();
            let done = inverse.process(&mut part, &mut signal);
            done.expect("lengths match, and neither end of the spectrum is set");
            signal
        });
        let stride = ((self.rate_hz / near_hz / PER_PERIOD) as usize).max(1);
        let step_s = stride as f64 / self.rate_hz;
        let (mut log_envelope, mut phase) = (Vec::new(), Vec::new());
        let mut last = 0.0;
        for i in (0..self.count).step_by(stride) {
            let turned = TAU * near_hz * i as f64 / self.rate_hz;
            let value = Complex64::new(real[i], imaginary[i]) * Complex64::cis(-turned);
            let change = (value.arg() - last + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
            last += change;
            log_envelope.push(value.norm().max(f64::MIN_POSITIVE).ln());
            phase.push(last);
        }
        (log_envelope, phase, step_s)
    }
}

/// Slope per sample of the line through values, and their rms deviation from it.
fn straight(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let mean = values.iter().sum::<f64>() / count;
    let at = |k: usize| k as f64 - middle;
    let products: f64 = values.iter().enumerate().map(|(k, v)| at(k) * v).sum();
    let squares: f64 = (0..values.len()).map(|k| at(k) * at(k)).sum();
    let slope = products / squares;
    let off = values.iter().enumerate();
    let off = off.map(|(k, v)| (v - mean - slope * at(k)).powi(2));
    (slope, (off.sum::<f64>() / count).sqrt())
}

#[cfg(test)]
mod tests {
    use super::super::testing::{noise, sine, sum};
    use super::*;

    /// The response of a resonance to an input held between samples, by the recursion of its free motion.
    fn rung(input: &[f64], rate_hz: f64, hz: f64, ratio: f64) -> Vec<f64> {
        let omega = TAU * hz / rate_hz;
        let (decay, cos) = (
            (-ratio * omega).exp(),
            (omega * (1.0 - ratio * ratio).sqrt()).cos(),
        );
        let (a, b) = (2.0 * decay * cos, -decay * decay);
        let mut before = [0.0; 2];
        let next = |x: &f64| {
            let y = (1.0 - a - b) * x + a * before[0] + b * before[1];
            before = [y, before[0]];
            y
        };
        input.iter().map(next).collect()
    }

    /// Steps to levels without order, an order of the machine, and the noise of the recorder.
    fn record(seed: u64, rate_hz: f64, hz: f64, ratio: f64) -> Vec<f64> {
        let count = (2.0 * rate_hz) as usize;
        let levels = noise(seed, 8);
        let steps: Vec<f64> = (0..count)
            .map(|i| 5.0 + 3.0 * levels[i * 8 / count])
            .collect();
        let torque = sum(&steps, &sine(0.5, rate_hz / 37.0, count));
        let quiet: Vec<f64> = noise(seed + 50, count).iter().map(|x| 2e-3 * x).collect();
        sum(&rung(&torque, rate_hz, hz, ratio), &quiet)
    }

    #[test]
    fn a_resonance_is_found_wherever_another_one_is_declared() {
        for (seed, rate_hz, hz, ratio) in [
            (1, 10_000.0, 590.0, 0.02),
            (2, 50_000.0, 590.0, 0.02),
            (3, 5000.0, 200.0, 0.01),
            (4, 20_000.0, 90.0, 0.04),
            (5, 20_000.0, 3100.0, 0.005),
        ] {
            let record = record(seed, rate_hz, hz, ratio);
            for part in [TAU, 1.0 / TAU, 2.0, 0.5, 10.0, 0.1] {
                let found = ringing_elsewhere(&record, rate_hz, &[(part * hz, ratio)]);
                let found = found.unwrap_or_else(|| panic!("{hz} {part}"));
                assert!((found.frequency_hz / hz - 1.0).abs() < 0.01, "{found:?}");
                assert!((found.damping_ratio / ratio - 1.0).abs() < 0.2, "{found:?}");
            }
        }
    }

    #[test]
    fn a_declared_resonance_rings_nowhere_else() {
        for seed in 0..20 {
            for (rate_hz, hz, ratio) in [
                (10_000.0, 590.0, 0.02),
                (10_000.0, 590.0, 0.07),
                (5000.0, 200.0, 0.01),
                (20_000.0, 90.0, 0.04),
                (20_000.0, 1500.0, 0.003),
            ] {
                let record = record(seed, rate_hz, hz, ratio);
                for declared in [0.9 * hz, hz, 1.1 * hz] {
                    let found = ringing_elsewhere(&record, rate_hz, &[(declared, ratio)]);
                    assert_eq!(found, None, "{seed} {hz} {declared}");
                }
            }
        }
    }

    /// The resonance of a machine beside that of the stand, in steps of its torque.
    #[test]
    fn a_machine_that_rings_beside_the_stand_is_not_taken_for_it() {
        for seed in 0..10 {
            let (rate_hz, count) = (10_000.0, 20_000);
            let torque = record(seed, rate_hz, 80.0 + 15.0 * seed as f64, 0.02);
            let hits: Vec<f64> = (0..count)
                .map(|i| if i % 5000 == 1100 { 40.0 } else { 0.0 })
                .collect();
            let record = rung(&sum(&torque, &hits), rate_hz, 590.0, 0.02);
            assert_eq!(ringing_elsewhere(&record, rate_hz, &[(590.0, 0.02)]), None);
        }
    }

    #[test]
    fn what_does_not_decay_freely_does_not_ring() {
        let (rate_hz, count) = (10_000.0, 40_000);
        let at = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
            (0..count).map(|i| of(i as f64 / rate_hz)).collect()
        };
        for seed in 0..20 {
            let white = noise(seed, count);
            let quiet: Vec<f64> = white.iter().map(|x| 1e-2 * x).collect();
            let hz = 60.0 + 20.0 * seed as f64;
            let orders = at(&|t| (1..9).map(|k| (TAU * hz * f64::from(k) * t).sin()).sum());
            let wavering = at(&|t| (TAU * (hz * t + 0.5 * (TAU * 0.7 * t).sin())).sin());
            let beating = at(&|t| (TAU * hz * t).sin() + 0.9 * (TAU * (hz + 1.3) * t).sin());
            let bursts = at(&|t| {
                if t % 0.5 < 0.2 {
                    (TAU * hz * t).sin()
                } else {
                    0.0
                }
            });
            let rising = at(&|t| (TAU * (20.0 * t + 0.5 * hz * t * t)).sin());
            let steps = at(&|t| (t * 3.0).floor());
            let driven = rung(&white, rate_hz, hz, 0.01);
            let records = [
                orders, wavering, beating, bursts, rising, steps, driven, white,
            ];
            for (kind, record) in records.iter().enumerate() {
                let record = sum(record, &quiet);
                let found = ringing_elsewhere(&record, rate_hz, &[(3000.0, 0.02)]);
                assert_eq!(found, None, "{seed} {kind}");
            }
        }
    }
}
