//! Simulated records whose torque is known in closed form, and the error of an oracle on them.
//!
//! The simulation uses nothing of the code under test: torques are sums of steps, half-sine pulses or lines, the oscillator's answer
//! to each is exact at every instant, and the transforms are a plain radix-2 one of its own.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use num_complex::Complex64;
use torqcomp_dsp::band::{Band, BandSearch};
use torqcomp_dsp::compensate::{Inverse, InverseFilter, whole_record};

/// Natural frequency in Hz and sampling rate in Hz: all pairs of 20, 180, 590 Hz and 1, 5, 20 kHz in which the rate
/// carries the stand.
pub const STANDS: [(f64, f64); 8] = [
    (20.0, 1e3),
    (20.0, 5e3),
    (20.0, 2e4),
    (180.0, 1e3),
    (180.0, 5e3),
    (180.0, 2e4),
    (590.0, 5e3),
    (590.0, 2e4),
];
pub const DAMPINGS: [f64; 4] = [0.005, 0.012, 0.03, 0.07];
/// Noise over the rms of the record.
pub const NOISES: [f64; 3] = [0.001, 0.01, 0.05];

/// What acts on the stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TorqueCourse {
    /// Four sudden steps, back to zero.
    Steps,
    /// All lines up to a frequency, in random phases.
    Multisine,
    /// Three half-sine pulses.
    Impulses,
}

/// A stand, a rate, a noise and a torque.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    pub natural_hz: f64,
    pub damping_ratio: f64,
    pub rate_hz: f64,
    /// Over the rms of the record.
    pub noise: f64,
    pub excitation: TorqueCourse,
    pub seed: u64,
}

/// The 192 cases: each stand, damping and noise with two of the three excitations in turn.
pub fn all(seed: u64) -> Vec<Case> {
    use TorqueCourse::*;
    let mut cases = Vec::new();
    for (i, (natural_hz, rate_hz)) in STANDS.into_iter().enumerate() {
        for (j, damping_ratio) in DAMPINGS.into_iter().enumerate() {
            for (k, noise) in NOISES.into_iter().enumerate() {
                let left_out = (i + j + k) % 3;
                for (l, excitation) in [Steps, Multisine, Impulses].into_iter().enumerate() {
                    if l != left_out {
                        let seed = seed
                            .wrapping_mul(1_000_003)
                            .wrapping_add(cases.len() as u64);
                        cases.push(Case {
                            natural_hz,
                            damping_ratio,
                            rate_hz,
                            noise,
                            excitation,
                            seed,
                        });
                    }
                }
            }
        }
    }
    cases
}

/// A record, the torque behind it, and what an oracle knows.
pub struct Simulated {
    pub recorded: Vec<f64>,
    pub torque: Vec<f64>,
    pub oracle: Vec<f64>,
}

/// A part of a torque that begins at a time in s.
struct Pulse {
    at_s: f64,
    size: f64,
    /// Length of a half-sine pulse; 0 for a step.
    width_s: f64,
}

/// Power density of the torque over the frequency in Hz.
type Density = Box<dyn Fn(f64) -> f64>;

impl Case {
    /// Torque over record at a frequency.
    pub fn inverse(&self, hz: f64) -> (f64, f64) {
        let u = hz / self.natural_hz;
        (1.0 - u * u, 2.0 * self.damping_ratio * u)
    }

    fn count(&self) -> usize {
        let seconds = (120.0 / self.natural_hz).clamp(1.0, 6.0);
        ((seconds * self.rate_hz) as usize).next_power_of_two()
    }

    pub fn simulate(&self) -> Simulated {
        let mut random = Random(self.seed ^ 0x9e37_79b9_7f4a_7c15);
        let count = self.count();
        let mut torque = vec![0.0; count];
        let mut recorded = vec![0.0; count];
        let density = match self.excitation {
            TorqueCourse::Multisine => self.multisine(&mut random, &mut torque, &mut recorded),
            _ => self.pulses(&mut random, &mut torque, &mut recorded),
        };
        let mean = recorded.iter().sum::<f64>() / count as f64;
        let rms = (recorded.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / count as f64).sqrt();
        let std = self.noise * rms;
        recorded
            .iter_mut()
            .for_each(|y| *y += std * random.normal());
        let oracle = self.oracle(&recorded, &density, 2.0 * std * std / self.rate_hz);
        Simulated {
            recorded,
            torque,
            oracle,
        }
    }

    /// Lines of one size up to a frequency that chance sets; the density of the torque is that of its lines.
    fn multisine(&self, random: &mut Random, torque: &mut [f64], recorded: &mut [f64]) -> Density {
        let count = torque.len();
        let duration_s = count as f64 / self.rate_hz;
        let top_hz = (self.natural_hz * (0.5 + 2.5 * random.uniform())).min(0.35 * self.rate_hz);
        let step_hz = 1.0 / duration_s;
        let lines = (top_hz / step_hz) as usize;
        let mut of_torque = vec![(0.0, 0.0); count];
        let mut of_record = vec![(0.0, 0.0); count];
        for k in 1..=lines {
            let phase = TAU * random.uniform();
            let x = (0.5 * phase.cos(), 0.5 * phase.sin());
            let y = divide(x, self.inverse(k as f64 * step_hz));
            (of_torque[k], of_torque[count - k]) = (x, (x.0, -x.1));
            (of_record[k], of_record[count - k]) = (y, (y.0, -y.1));
        }
        transform(&mut of_torque, 1.0);
        transform(&mut of_record, 1.0);
        for i in 0..count {
            torque[i] = of_torque[i].0;
            recorded[i] = of_record[i].0;
        }
        Box::new(move |hz| {
            if hz > 0.5 * step_hz && hz < top_hz + 0.5 * step_hz {
                0.5 / step_hz
            } else {
                0.0
            }
        })
    }

    /// Steps or impulses.
    fn pulses(&self, random: &mut Random, torque: &mut [f64], recorded: &mut [f64]) -> Density {
        let count = torque.len();
        let duration_s = count as f64 / self.rate_hz;
        let parts = self.parts(random, duration_s);
        for i in 0..count {
            let t = i as f64 / self.rate_hz;
            for part in &parts {
                if t >= part.at_s {
                    let (x, y) = self.answer(part, t - part.at_s);
                    torque[i] += x;
                    recorded[i] += y;
                }
            }
        }
        Box::new(move |hz| {
            parts
                .iter()
                .map(|part| 2.0 * part.energy(hz) / duration_s)
                .sum()
        })
    }

    fn parts(&self, random: &mut Random, duration_s: f64) -> Vec<Pulse> {
        let mut part = |width_s: f64| Pulse {
            at_s: duration_s * (0.15 + 0.45 * random.uniform()),
            size: (0.5 + random.uniform()) * if random.uniform() < 0.5 { -1.0 } else { 1.0 },
            width_s,
        };
        if self.excitation == TorqueCourse::Steps {
            let mut steps: Vec<Pulse> = (0..4).map(|_| part(0.0)).collect();
            // Back to zero at the end.
            steps[3].size = -steps[..3].iter().map(|s| s.size).sum::<f64>();
            return steps;
        }
        let mut pulses: Vec<Pulse> = (0..3).map(|_| part(0.0)).collect();
        for pulse in &mut pulses {
            pulse.width_s =
                ((0.2 + 0.8 * random.uniform()) / self.natural_hz).max(4.0 / self.rate_hz);
        }
        pulses
    }

    /// Torque and record of a part, a time after its beginning.
    fn answer(&self, part: &Pulse, t: f64) -> (f64, f64) {
        if part.width_s == 0.0 {
            let (z, w) = (self.damping_ratio, TAU * self.natural_hz);
            let root = (1.0 - z * z).sqrt();
            let ring =
                (-z * w * t).exp() * ((root * w * t).cos() + z / root * (root * w * t).sin());
            return (part.size, part.size * (1.0 - ring));
        }
        // A half-sine pulse is a sine from its beginning on and the same sine from its end on.
        let p = PI / part.width_s;
        let y = self.sine(p, t)
            + if t > part.width_s {
                self.sine(p, t - part.width_s)
            } else {
                0.0
            };
        let x = if t < part.width_s { (p * t).sin() } else { 0.0 };
        (part.size * x, part.size * y)
    }

    /// Answer to `sin(pt)` from rest: the steady answer, less the free motion that makes it begin at rest.
    fn sine(&self, p: f64, t: f64) -> f64 {
        let (z, w) = (self.damping_ratio, TAU * self.natural_hz);
        let (re, im) = divide((1.0, 0.0), self.inverse(p / TAU));
        let wd = w * (1.0 - z * z).sqrt();
        let c = -im;
        let d = (z * w * c - p * re) / wd;
        re * (p * t).sin()
            + im * (p * t).cos()
            + (-z * w * t).exp() * (c * (wd * t).cos() + d * (wd * t).sin())
    }

    /// Wiener filter of a record whose spectra of torque and noise are known: `S H* / (S |H|² + N)`.
    fn oracle(&self, recorded: &[f64], density: &dyn Fn(f64) -> f64, noise: f64) -> Vec<f64> {
        self.filter(recorded, |hz| {
            let g = self.inverse(hz);
            let power = g.0 * g.0 + g.1 * g.1;
            let s = density(hz);
            let keep = if s.is_finite() && noise > 0.0 {
                s / (s + noise * power)
            } else {
                1.0
            };
            (g.0 * keep, g.1 * keep)
        })
    }

    /// A record through a response, on a circle.
    fn filter(&self, recorded: &[f64], response: impl Fn(f64) -> (f64, f64)) -> Vec<f64> {
        let count = recorded.len();
        let mut lines: Vec<(f64, f64)> = recorded.iter().map(|y| (*y, 0.0)).collect();
        transform(&mut lines, -1.0);
        for k in 0..=count / 2 {
            let r = response(k as f64 * self.rate_hz / count as f64);
            lines[k] = times(lines[k], r);
            if k > 0 && k < count / 2 {
                lines[count - k] = (lines[k].0, -lines[k].1);
            }
        }
        lines[count / 2].1 = 0.0;
        transform(&mut lines, 1.0);
        lines.iter().map(|x| x.0 / count as f64).collect()
    }
}

impl Pulse {
    /// `|X(f)|²`: `(a/ω)²` of a step, `(2aw/π cos(πfw)/(1 − (2fw)²))²` of a half-sine pulse.
    fn energy(&self, hz: f64) -> f64 {
        if self.width_s == 0.0 {
            return (self.size / (TAU * hz)).powi(2);
        }
        let u = 2.0 * hz * self.width_s;
        let shape = if (u - 1.0).abs() < 1e-6 {
            PI / 4.0
        } else {
            (0.5 * PI * u).cos() / (1.0 - u * u)
        };
        (self.size * 2.0 * self.width_s / PI * shape).powi(2)
    }
}

/// Rms difference within the middle four fifths.
pub fn error(got: &[f64], want: &[f64]) -> f64 {
    let inside = want.len() / 10..want.len() - want.len() / 10;
    let count = inside.len() as f64;
    (inside.map(|i| (got[i] - want[i]).powi(2)).sum::<f64>() / count).sqrt()
}

fn times(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}
fn divide(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    let power = b.0 * b.0 + b.1 * b.1;
    (
        (a.0 * b.0 + a.1 * b.1) / power,
        (a.1 * b.0 - a.0 * b.1) / power,
    )
}

/// Radix-2 transform in place, `e^{sign j 2π k i / n}`, without scaling.
fn transform(x: &mut [(f64, f64)], sign: f64) {
    let n = x.len();
    let bits = n.trailing_zeros();
    for i in 0..n {
        let j = i.reverse_bits() >> (usize::BITS - bits);
        if i < j {
            x.swap(i, j);
        }
    }
    let mut half = 1;
    while half < n {
        let turns: Vec<(f64, f64)> = (0..half)
            .map(|k| {
                let a = sign * PI * k as f64 / half as f64;
                (a.cos(), a.sin())
            })
            .collect();
        for block in x.chunks_exact_mut(2 * half) {
            let (low, high) = block.split_at_mut(half);
            for k in 0..half {
                let turned = times(high[k], turns[k]);
                high[k] = (low[k].0 - turned.0, low[k].1 - turned.1);
                low[k] = (low[k].0 + turned.0, low[k].1 + turned.1);
            }
        }
        half *= 2;
    }
}

/// SplitMix64.
struct Random(u64);
impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
    /// Box and Muller.
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }
}

/// Median, ninth decile and largest of some ratios.
pub fn summary(mut ratios: Vec<f64>) -> [f64; 3] {
    ratios.sort_by(f64::total_cmp);
    let at = |part: f64| ratios[(part * (ratios.len() - 1) as f64).round() as usize];
    [at(0.5), at(0.9), at(1.0)]
}

/// Errors of one case over that of the oracle.
#[derive(Debug, Clone, Copy)]
pub struct Outcome {
    pub chosen_hz: f64,
    /// Compensated in the chosen band.
    pub chosen: f64,
    /// As recorded.
    pub raw: f64,
    /// Compensated up to 2400 Hz, or 0.7 of half the rate.
    pub rated: f64,
}

/// Compensates a case in the band that is chosen for it, and in that of the thesis.
pub fn run(case: &Case) -> Outcome {
    let simulated = case.simulate();
    let of_case = *case;
    let inverse: Inverse = Arc::new(move |hz| {
        let (re, im) = of_case.inverse(hz);
        Complex64::new(re, im)
    });
    let search = BandSearch::of_record(&simulated.recorded, case.rate_hz, &inverse).unwrap();
    let chosen_hz = search.best().unwrap().top_hz;
    let oracle = error(&simulated.oracle, &simulated.torque);
    let compensated = |band: Band| {
        let filter = InverseFilter::design(inverse.clone(), band).unwrap();
        let torque = whole_record(&filter, &simulated.recorded).unwrap();
        error(&torque, &simulated.torque) / oracle
    };
    Outcome {
        chosen_hz,
        chosen: compensated(Band::new(case.rate_hz, chosen_hz).unwrap()),
        raw: error(&simulated.recorded, &simulated.torque) / oracle,
        rated: compensated(Band::fitting(case.rate_hz, 2400.0).unwrap()),
    }
}
