//! The periodogram of a running record, with lines of a steady speed left out.

use std::f64::consts::{LN_2, PI, TAU};
use std::ops::Range;

use torqcomp_dsp::quality::median;
use torqcomp_dsp::sort_by_number;

use super::density::{DensityInRange, resonant};
use crate::diagnose::residual_tests::without_mean;

/// Mean lines per half-bandwidth `ζ f₀`: wanted, and fewest.
pub const PER_HALF_BANDWIDTH: [f64; 2] = [16.0, 6.0];
/// Power over the density above which a line is that of a steady speed: noise is above once in 100,000, and once in 10,000
/// if the density is the median of as few lines as a block has at least.
const UNUSUAL: f64 = 11.5;
const FEWEST: usize = 24;
/// The same for lines that are reported, and the lines on each side with the power of one.
const REPORTED: f64 = 25.0;
const LOBE: usize = 2;
/// Power of a reported line over what a stronger one leaks at most.
const OF_LEAKAGE: f64 = 10.0;
/// Fewest lines left out on each side of one, and the largest leakage in the others relative to the median around them.
const BESIDE: usize = 3;
const LEAKING: f64 = 0.1;

/// Power of a record at each frequency, in units of which `a²/4` is a sine of amplitude `a`.
pub struct Periodogram {
    pub step_hz: f64,
    taper: f64,
    power: Vec<f64>,
    /// Whether each counts: it is no line of a steady speed.
    counts: Vec<bool>,
    /// Lines in a block, and the median power in each.
    block: usize,
    medians: Vec<f64>,
}

/// A line of a steady speed that leaks into those around it.
struct Leaking {
    power: f64,
    taper: f64,
}

impl Leaking {
    /// Most power this many lines away, from the square of `sin(πn(1 − t)) cos(πnt)/(πn(1 − (2nt)²))` with the taper `t`; the
    /// line itself has `(1 − t)²`.
    fn power(&self, lines: usize) -> f64 {
        let lines = lines as f64;
        let tapered = (2.0 * self.taper * lines).powi(2) - 1.0;
        self.power * (PI * lines * tapered.max(1.0)).powi(-2)
    }

    /// Number of lines, up to `most`, in which it is more than the rest may have. `block` gives for a line this far away
    /// the median around it, and the last line for which that holds.
    fn reach(&self, most: usize, block: impl Fn(usize) -> (f64, usize)) -> usize {
        let mut reach = BESIDE.min(most);
        while reach < most {
            let (median, last) = block(reach + 1);
            let last = last.min(most);
            let is_less = |away: usize| self.power(away) <= LEAKING * median;
            if is_less(reach + 1) {
                break;
            }
            reach = match is_less(last) {
                true => (reach + 1..last)
                    .take_while(|away| !is_less(*away))
                    .last()
                    .unwrap_or(reach),
                false => last,
            };
        }
        reach
    }
}

/// Ranges of adjacent lines that are far above the noise.
fn runs(over_noise: &[f64]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for k in (0..over_noise.len()).filter(|k| over_noise[*k] > UNUSUAL) {
        match runs.last_mut() {
            Some(run) if run.end == k => run.end += 1,
            _ => runs.push(k..k + 1),
        }
    }
    runs
}

/// Mean power of adjacent lines.
#[derive(Clone, Copy)]
pub struct MeanLine {
    pub frequency_hz: f64,
    pub power: f64,
    /// Number of lines.
    pub weight: f64,
}

pub struct MeanLines(pub Vec<MeanLine>);

impl Periodogram {
    /// Of a record with tapered ends; lines are compared with the median within blocks of a width in Hz.
    pub fn of(samples: &[f64], rate_hz: f64, taper: f64, width_hz: f64) -> Self {
        let count = samples.len();
        let window = |i: usize| {
            let from_end = (i.min(count - 1 - i) as f64 + 0.5) / (taper * count as f64);
            0.5 - 0.5 * (0.5 * TAU * from_end.min(1.0)).cos()
        };
        let mut windowed = without_mean(samples);
        for (i, x) in windowed.iter_mut().enumerate() {
            *x *= window(i);
        }
        let plan = torqcomp_fourier::forward(count);
        let mut spectrum = plan.make_output_vec();
        // Cannot fail: the lengths match the plan.
        let _ = plan.process(&mut windowed, &mut spectrum);
        let windows = 1.0 - 2.0 * taper * (1.0 - 3.0 / 8.0);
        let scale = 1.0 / (windows * (count as f64).powi(2));
        let power: Vec<f64> = spectrum.iter().map(|x| scale * x.norm_sqr()).collect();
        let step_hz = rate_hz / count as f64;
        let block = ((width_hz / step_hz) as usize).max(FEWEST);
        let middle = |block: &[f64]| median(&mut block.to_vec()).unwrap_or(0.0);
        Self {
            step_hz,
            taper,
            counts: vec![true; power.len()],
            block,
            medians: power.chunks(block).map(middle).collect(),
            power,
        }
    }

    /// Variance of a sum over adjacent lines, relative to that of independent ones: `n ∑w⁴/(∑w²)²`. A cosine taper has
    /// the means 35/128 of `w⁴` and 3/8 of `w²`.
    pub fn correlated(&self) -> f64 {
        let tapered = 2.0 * self.taper;
        (1.0 - tapered * (1.0 - 35.0 / 128.0)) / (1.0 - tapered * (1.0 - 3.0 / 8.0)).powi(2)
    }

    pub fn frequency_hz(&self, k: usize) -> f64 {
        k as f64 * self.step_hz
    }

    /// Number of lines in a width in Hz.
    fn lines(&self, width_hz: f64) -> usize {
        ((width_hz / self.step_hz) as usize).max(1)
    }

    /// Power of each line over that of noise: over a density in a range, elsewhere over the median of its block.
    fn over_noise(&self, density: Option<&DensityInRange>) -> Vec<f64> {
        let over = |k: usize| {
            let frequency_hz = self.frequency_hz(k);
            let inside = density.filter(|density| density.range_hz.contains(&frequency_hz));
            self.power[k]
                / match inside {
                    Some(density) => resonant(&density.values, frequency_hz).0.exp(),
                    None => self.medians[k / self.block] / LN_2,
                }
        };
        (0..self.power.len()).map(over).collect()
    }

    /// The strongest lines of a steady speed, up to `most`: frequency and power of each.
    pub fn steady_lines(&self, density: Option<&DensityInRange>, most: usize) -> Vec<[f64; 2]> {
        let over = self.over_noise(density);
        let runs = runs(&over).into_iter().filter(|run| {
            let most = over[run.clone()].iter().copied().fold(0.0, f64::max);
            run.start >= FEWEST && most > REPORTED
        });
        let line = |run: Range<usize>| {
            let whole = run.start - LOBE..(run.end + LOBE).min(over.len());
            let power: f64 = self.power[whole.clone()].iter().sum();
            let moment = whole.map(|k| self.frequency_hz(k) * self.power[k]);
            [moment.sum::<f64>() / power, power]
        };
        let mut lines: Vec<[f64; 2]> = runs.map(line).collect();
        sort_by_number(&mut lines, |[_, power]| -power);
        let mut found: Vec<[f64; 2]> = Vec::new();
        for [hz, power] in lines {
            let is_leaked = |[other_hz, power_there]: &[f64; 2]| {
                let other = Leaking {
                    power: OF_LEAKAGE * power_there,
                    taper: self.taper,
                };
                power < other.power(self.lines((hz - other_hz).abs()))
            };
            if found.len() < most && !found.iter().any(is_leaked) {
                found.push([hz, power]);
            }
        }
        found
    }

    /// Leaves out the lines of a steady speed, and those around each that its leakage reaches, compared with the median of
    /// their block.
    pub fn leave_out_lines(&mut self, density: Option<&DensityInRange>) {
        let count = self.power.len();
        self.counts = vec![true; count];
        // The mean.
        self.counts[..=BESIDE.min(count - 1)].fill(false);
        for Range {
            start: from,
            end: to,
        } in runs(&self.over_noise(density))
        {
            // Between two lines, a peak is up to twice as high.
            let power = 2.0 * self.power[from..to].iter().sum::<f64>();
            let line = Leaking {
                power,
                taper: self.taper,
            };
            let block = |k: usize| (self.medians[k / self.block], k % self.block);
            let below = line.reach(from, |away| {
                let (median, place) = block(from - away);
                (median, away + place)
            });
            let above = line.reach(count - to, |away| {
                let (median, place) = block(to - 1 + away);
                (median, away + self.block - 1 - place)
            });
            self.counts[from - below..to + above].fill(false);
        }
    }

    /// Means of the lines that count in a range, for a resonance with a half-bandwidth.
    pub fn points(&self, range_hz: &Range<f64>, half_hz: f64) -> MeanLines {
        let all = (0..self.power.len()).filter(|k| range_hz.contains(&self.frequency_hz(*k)));
        let all: Vec<usize> = all.collect();
        let together = self.lines(half_hz / PER_HALF_BANDWIDTH[0]);
        let mean = |lines: &[usize]| {
            let counted = lines.iter().filter(|k| self.counts[**k]);
            let (mut weight, mut frequency_hz, mut power) = (0.0, 0.0, 0.0);
            for k in counted {
                weight += 1.0;
                frequency_hz += self.frequency_hz(*k);
                power += self.power[*k];
            }
            (weight > 0.0).then(|| MeanLine {
                frequency_hz: frequency_hz / weight,
                power: power / weight,
                weight,
            })
        };
        MeanLines(all.chunks(together).filter_map(mean).collect())
    }
}
