//! A resonance in a record where none is declared.

use crate::spectrum::{Density, welch};

/// A resonance in the spectrum of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonance {
    /// Frequency of the peak in Hz.
    pub frequency_hz: f64,
    /// Damping ratio from the half-power bandwidth: `Δf/(2 f)`.
    pub damping_ratio: f64,
}

/// Largest damping ratio of a mode that must show a peak.
const SHARP: f64 = 0.15;
/// Frequency range examined, relative to the declared frequency.
const NEAR: [f64; 2] = [0.4, 2.5];
/// Minimum number of averaged blocks, counting half-overlapping ones.
const BLOCKS: usize = 7;
/// Number of block lengths, each half of the previous one; the longest resolves a sixteenth of the declared width.
const RESOLUTIONS: u32 = 4;
/// Minimum half-power bandwidth, in steps of the spectrum: a line with a Hann window has 1.4.
const BROAD: f64 = 4.0;
/// Maximum half-power bandwidth, relative to the frequency.
const WIDEST: f64 = 0.2;
/// Minimum power of a peak relative to the median of the spectrum.
const STRONG: f64 = 30.0;
/// Distances from the peak in bandwidths, and accepted ranges of the relative power; a resonance has 1/5
/// and 1/17.
const SKIRT: [(f64, [f64; 2]); 2] = [(1.0, [0.1, 0.4]), (2.0, [0.02, 0.17])];
/// Largest power at the declared frequency, relative to that some widths to either side, that is not a peak; a mode
/// would have 17 times as much.
const NO_PEAK: f64 = 2.5;
/// Distance from a mode, in declared half-widths, at which its power has fallen to 1/17.
const ASIDE: f64 = 4.0;

/// The resonance of a record near the first of several declared modes (natural frequency in Hz and damping ratio), if
/// the record shows none at that mode.
///
/// The power near a resonance falls as `1/(1 + (2 Δ/w)²)` at a distance `Δ`, with the half-power bandwidth `w = 2 ζ f`.
/// A peak is a resonance if it is at least four steps of the spectrum wide (a steady line is narrower), 30 times as
/// strong as the median of the spectrum, and falls off on both sides by that law (an order swept with the speed ends
/// abruptly). It must be away from all declared modes by its width and 5 %, while the spectrum has no peak at the first
/// of them.
///
/// ```
/// use torqcomp_dsp::quality::resonance::other_resonance;
/// // Hits on a body that rings at 59 Hz with a damping ratio of 0.02.
/// let ring = |t: f64| (-7.4 * t).exp() * (370.7 * t).sin();
/// let record: Vec<f64> = (0..40_000).map(|i| ring((f64::from(i) * 1e-3) % 1.7)).collect();
/// let found = other_resonance(&record, 1000.0, &[(45.0, 0.02)]).unwrap();
/// assert!((found.frequency_hz - 59.0).abs() < 0.5 && (found.damping_ratio - 0.02).abs() < 0.006);
/// assert_eq!(other_resonance(&record, 1000.0, &[(59.5, 0.02)]), None);
/// ```
#[must_use]
pub fn other_resonance(
    samples: &[f64],
    rate_hz: f64,
    declared: &[(f64, f64)],
) -> Option<Resonance> {
    let &(declared_hz, ratio) = declared.first()?;
    let [from_hz, to_hz] = NEAR.map(|part| part * declared_hz);
    let to_hz = to_hz.min(0.45 * rate_hz);
    if ratio > SHARP || to_hz < 1.2 * declared_hz {
        return None;
    }
    let longest = (2 * samples.len() / (BLOCKS + 1)).checked_ilog2()?;
    // Sharp peaks need long blocks; broad ones have less variance with short blocks.
    let finest = (16.0 * rate_hz / (2.0 * ratio * declared_hz)).log2().ceil() as u32;
    let powers = (finest.saturating_sub(RESOLUTIONS - 1)..=finest).rev();
    powers.filter(|power| *power <= longest).find_map(|power| {
        let density = welch(samples, rate_hz, 1 << power).ok()?;
        in_spectrum(&Smooth::of(&density), [from_hz, to_hz], declared)
    })
}

/// The same in a spectrum of one resolution.
fn in_spectrum(
    spectrum: &Smooth,
    [from_hz, to_hz]: [f64; 2],
    declared: &[(f64, f64)],
) -> Option<Resonance> {
    let (declared_hz, ratio) = declared[0];
    let step_hz = spectrum.step_hz;
    let found = spectrum.resonance(from_hz, to_hz)?;
    let width_hz = 2.0 * found.damping_ratio * found.frequency_hz;
    let is_off = |(hz, _): &(f64, f64)| {
        let off_hz = (found.frequency_hz - hz).abs();
        off_hz > width_hz && off_hz > 0.05 * hz
    };
    let is_missing = spectrum.has_no_peak(declared_hz, (ratio * declared_hz).max(step_hz));
    (declared.iter().all(is_off) && is_missing).then_some(found)
}

/// A spectrum averaged over three adjacent frequencies.
struct Smooth {
    step_hz: f64,
    values: Vec<f64>,
    median: f64,
}

impl Smooth {
    fn of(density: &Density) -> Self {
        let values: Vec<f64> = density
            .values
            .windows(3)
            .map(|three| three.iter().sum::<f64>() / 3.0)
            .collect();
        let mut sorted = values.clone();
        let middle = sorted.len() / 2;
        let (_, median, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
        Self {
            step_hz: density.step_hz,
            median: *median,
            values,
        }
    }

    /// Index of a frequency; the first average is centred on the second one.
    fn place(&self, hz: f64) -> usize {
        ((hz / self.step_hz).round() as usize).saturating_sub(1)
    }

    /// Mean power between two frequencies.
    fn mean(&self, from_hz: f64, to_hz: f64) -> Option<f64> {
        let part = self.values.get(self.place(from_hz)..=self.place(to_hz))?;
        Some(part.iter().sum::<f64>() / part.len() as f64)
    }

    /// The strongest peak in a range, if it is a resonance.
    fn resonance(&self, from_hz: f64, to_hz: f64) -> Option<Resonance> {
        let range = self.place(from_hz)..=self.place(to_hz);
        let best = range.max_by(|a, b| self.values[*a].total_cmp(&self.values[*b]))?;
        let top = self.values[best];
        let is_below = |place: &usize| self.values[*place] < 0.5 * top;
        let left = (0..best).rev().find(is_below)?;
        let right = (best..self.values.len()).find(is_below)?;
        // Averaging three adds little to a width of four.
        let width_hz = (right - left - 1) as f64 * self.step_hz;
        let frequency_hz = (0.5 * (left + right) as f64 + 1.0) * self.step_hz;
        let is_peak = best > self.place(from_hz) && best < self.place(to_hz);
        let is_broad = width_hz >= BROAD * self.step_hz && width_hz <= WIDEST * frequency_hz;
        let falls = |(widths, [least, most]): (f64, [f64; 2])| {
            let near_hz = 0.25 * width_hz;
            [-widths, widths].into_iter().all(|side| {
                let at_hz = frequency_hz + side * width_hz;
                let mean = self.mean(at_hz - near_hz, at_hz + near_hz);
                mean.is_some_and(|power| (least..=most).contains(&(power / top)))
            })
        };
        let is_resonance = is_peak && is_broad && top > STRONG * self.median;
        (is_resonance && SKIRT.into_iter().all(falls)).then_some(Resonance {
            frequency_hz,
            damping_ratio: 0.5 * width_hz / frequency_hz,
        })
    }

    /// Whether there is no peak of a given half-width at a frequency.
    fn has_no_peak(&self, hz: f64, half_hz: f64) -> bool {
        let aside_hz = ASIDE * half_hz;
        let sides = [-1.0, 1.0].map(|side| {
            let at_hz = hz + side * aside_hz;
            self.mean(at_hz - half_hz, at_hz + half_hz)
        });
        let ([Some(below), Some(above)], Some(at)) = (sides, self.mean(hz - half_hz, hz + half_hz))
        else {
            return false;
        };
        at < NO_PEAK * (below * above).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::testing::{noise, sine, sum};
    use super::*;

    /// The response of a resonance to an input, by the exact recursion of its free motion.
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

    #[test]
    fn a_wrong_natural_frequency_is_found_from_noise_and_hits() {
        let mut hits = vec![0.0; 65_536];
        hits.iter_mut()
            .skip(900)
            .step_by(9000)
            .for_each(|x| *x = 200.0);
        for input in [noise(3, 65_536), sum(&hits, &noise(5, 65_536))] {
            for (hz, ratio) in [(590.0, 0.041), (590.0, 0.01), (1500.0, 0.02)] {
                let record = rung(&input, 20_000.0, hz, ratio);
                for declared in [0.75, 0.85, 1.2] {
                    let found = other_resonance(&record, 20_000.0, &[(declared * hz, ratio)]);
                    let found = found.unwrap_or_else(|| panic!("{hz} {ratio} {declared}"));
                    assert!((found.frequency_hz / hz - 1.0).abs() < 0.02, "{found:?}");
                }
                for declared in [0.97, 1.0, 1.03] {
                    let found = other_resonance(&record, 20_000.0, &[(declared * hz, ratio)]);
                    assert_eq!(found, None);
                }
            }
        }
    }

    #[test]
    fn lines_sweeps_and_bands_of_noise_are_no_resonances() {
        let count = 65_536;
        let white = noise(7, count);
        let modes = [(450.0, 0.02)];
        let line = sum(&sine(40.0, 20_000.0 / 590.0, count), &white);
        // A fluctuating speed, and a rising one.
        let phase = |i: usize| {
            let t = i as f64 / 20_000.0;
            (
                TAU * (590.0 * t + 2.0 * (TAU * 0.7 * t).sin()),
                TAU * (560.0 * t + 10.0 * t * t),
            )
        };
        let wavering = sum(
            &(0..count)
                .map(|i| 40.0 * phase(i).0.sin())
                .collect::<Vec<_>>(),
            &white,
        );
        let rising = sum(
            &(0..count)
                .map(|i| 40.0 * phase(i).1.sin())
                .collect::<Vec<_>>(),
            &white,
        );
        let multisine = (0..60).fold(white.clone(), |all, k| {
            sum(
                &all,
                &sine(10.0, 20_000.0 / (500.0 + 3.0 * f64::from(k)), count),
            )
        });
        for (what, record) in [
            ("line", line),
            ("wavering", wavering),
            ("rising", rising),
            ("multisine", multisine),
            ("noise", white),
        ] {
            assert_eq!(other_resonance(&record, 20_000.0, &modes), None, "{what}");
        }
    }
}
