//! The applied torque as a function of continuous time: multisines and sweeps, and the other [kinds](super::kinds).
//!
//! Both are known in closed form with two derivatives. They are evaluated on a grid eight times finer than the
//! samples; between its points a fifth-degree polynomial matches values and both derivatives at the two neighbours,
//! which is exact to 1e-10 of the amplitude at 2.4 kHz.

use std::f64::consts::TAU;

use super::anti_alias::AntiAlias;
use super::draw::Draw;
use super::kinds::{Hits, Random, Steps};
use super::span::Span;

/// Samples per second of a record.
pub const RATE_HZ: f64 = 20_000.0;
/// Samples of a record.
pub const SAMPLES: usize = 32_000;
/// Length of a record.
pub const LENGTH_S: f64 = SAMPLES as f64 / RATE_HZ;
/// Points of the grid per sample.
pub const FINER: usize = 8;
/// A multisine continues for this time after the record and fades over the second half of it.
const AFTER_S: f64 = 0.25;

/// One sine of a multisine.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    pub amplitude: f64,
    pub frequency_hz: f64,
    pub phase_rad: f64,
}

/// The applied torque.
#[derive(Debug, Clone)]
pub enum Excitation {
    /// Sum of sines; the level of the second half of the record relative to the first, and whether the
    /// stand has settled before the record begins or starts from rest with it.
    Multisine {
        lines: Vec<Line>,
        second_half: f64,
        settled: bool,
    },
    /// One sweep over the record, from rest, faded in and out.
    Sweep {
        amplitude: f64,
        from_hz: f64,
        to_hz: f64,
        logarithmic: bool,
        fade_s: f64,
    },
    /// Band-limited noise.
    Random(Random),
    /// Plateaus.
    Steps(Steps),
    /// Single pulses.
    Hits(Hits),
}

impl Excitation {
    /// A multisine of flat spectrum and random phases with the given RMS.
    pub fn multisine(draw: &mut Draw, rms: f64, settled: bool) -> Self {
        let spacing_hz = draw.one_of(&[2.5, 5.0, 10.0]);
        let top_hz = draw.between(1000.0, 2200.0);
        let skip = draw.one_of(&[1, 1, 2]);
        let first = draw.one_of(&[1, 2]);
        let mut lines: Vec<Line> = (first..)
            .step_by(skip)
            .map(|order| f64::from(order) * spacing_hz)
            .take_while(|frequency_hz| *frequency_hz <= top_hz)
            .map(|frequency_hz| Line {
                amplitude: 1.0,
                frequency_hz,
                phase_rad: draw.phase(),
            })
            .collect();
        let amplitude = rms * (2.0 / lines.len() as f64).sqrt();
        for line in &mut lines {
            line.amplitude = amplitude;
        }
        Self::Multisine {
            lines,
            second_half: 1.0,
            settled,
        }
    }

    /// A sweep of the given amplitude.
    pub fn sweep(draw: &mut Draw, amplitude: f64) -> Self {
        let (low, high) = (draw.between(2.0, 20.0), draw.between(1000.0, 2200.0));
        let (from_hz, to_hz) = if draw.chance(0.8) {
            (low, high)
        } else {
            (high, low)
        };
        Self::Sweep {
            amplitude,
            from_hz,
            to_hz,
            logarithmic: draw.chance(0.4),
            fade_s: draw.one_of(&[0.005, 0.02, 0.05]),
        }
    }

    /// The same at another level.
    pub fn at_level(&self, level: f64) -> Self {
        let mut other = self.clone();
        match &mut other {
            Self::Multisine { lines, .. } => {
                lines.iter_mut().for_each(|line| line.amplitude *= level);
            }
            Self::Sweep { amplitude, .. } => *amplitude *= level,
            Self::Random(random) => random.rms *= level,
            Self::Steps(steps) => steps.scale(level),
            Self::Hits(hits) => hits.scale(level),
        }
        other
    }

    /// Its highest frequency.
    pub fn top_hz(&self) -> f64 {
        match self {
            Self::Multisine { lines, .. } => lines.last().map_or(0.0, |line| line.frequency_hz),
            Self::Sweep { from_hz, to_hz, .. } => from_hz.max(*to_hz),
            Self::Random(random) => random.top_hz,
            Self::Steps(steps) => steps.top_hz,
            Self::Hits(hits) => hits.top_hz,
        }
    }

    /// Its kind, as a word.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Multisine { .. } => "multisine",
            Self::Sweep { .. } => "sweep",
            Self::Random(_) => "random",
            Self::Steps(_) => "steps",
            Self::Hits(_) => "hits",
        }
    }

    /// Whether the stand has settled before the record begins.
    fn is_settled(&self) -> bool {
        match self {
            Self::Multisine { settled, .. } => *settled,
            Self::Random(random) => random.settled,
            Self::Steps(steps) => steps.settled,
            Self::Sweep { .. } | Self::Hits(_) => false,
        }
    }

    /// Its description; frequencies and times as written in the files.
    pub fn describe(&self, span: &Span) -> String {
        // A stand of half a hertz needs more digits.
        let hz = |frequency_hz: f64| match span.slower == 1.0 {
            true => format!("{frequency_hz:.0}"),
            false => format!("{:.3}", span.written_hz(frequency_hz)),
        };
        match self {
            Self::Multisine {
                lines,
                second_half,
                settled,
            } => format!(
                "multisine, {} lines to {} Hz, rms {:.3} N m, second half times {second_half}, {}",
                lines.len(),
                hz(self.top_hz()),
                (lines.iter().map(|line| line.amplitude.powi(2)).sum::<f64>() / 2.0).sqrt(),
                if *settled { "settled" } else { "from rest" }
            ),
            Self::Sweep {
                amplitude,
                from_hz,
                to_hz,
                logarithmic,
                fade_s,
            } => format!(
                "{} sweep {} to {} Hz, amplitude {amplitude:.3} N m, fade {} s",
                if *logarithmic {
                    "logarithmic"
                } else {
                    "linear"
                },
                hz(*from_hz),
                hz(*to_hz),
                fade_s * span.slower
            ),
            Self::Random(random) => format!(
                "random to {} Hz, rms {:.3} N m, {}",
                hz(random.top_hz),
                random.rms,
                if random.settled {
                    "settled"
                } else {
                    "from rest"
                }
            ),
            Self::Steps(steps) => steps.describe(),
            Self::Hits(hits) => hits.describe(),
        }
    }

    /// The torque on the fine grid over a record of the thesis' stand.
    pub fn input(&self) -> Input {
        self.input_over(&Span::THESIS)
    }

    /// The torque on the fine grid.
    pub fn input_over(&self, span: &Span) -> Input {
        let length_s = span.length_s();
        let before = if self.is_settled() {
            (span.settling_s * RATE_HZ) as usize * FINER
        } else {
            0
        };
        let goes_on = matches!(self, Self::Multisine { .. } | Self::Random(_));
        let after_s = if goes_on { AFTER_S } else { 0.0 };
        let points = before + (span.samples + (after_s * RATE_HZ) as usize + 8) * FINER;
        let mut input = Input {
            before,
            samples: span.samples,
            step_s: 1.0 / (RATE_HZ * FINER as f64),
            nodes: vec![[0.0; 3]; points],
            ends: None,
        };
        match self {
            Self::Multisine {
                lines, second_half, ..
            } => {
                add_lines(lines, &mut input);
                input.shape(|time_s| step(1.0, *second_half, time_s - length_s / 2.0, 0.01));
                input.fade_around(length_s, self.is_settled());
            }
            Self::Random(random) => {
                input.nodes = random.nodes(points, input.step_s);
                input.fade_around(length_s, random.settled);
            }
            Self::Steps(steps) => {
                input.nodes = steps.nodes(points);
                input.ends = Some(input.nodes.clone());
            }
            Self::Hits(hits) => {
                let (nodes, ends) = hits.nodes(points, input.step_s);
                (input.nodes, input.ends) = (nodes, Some(ends));
            }
            Self::Sweep { fade_s, .. } => {
                for index in 0..points {
                    input.nodes[index] = self.sweep_at(input.time_s(index), length_s);
                }
                input.shape(|time_s| step(0.0, 1.0, time_s - fade_s / 2.0, fade_s / 2.0));
                input
                    .shape(|time_s| step(1.0, 0.0, time_s - length_s + fade_s / 2.0, fade_s / 2.0));
            }
        }
        input
    }

    /// Value and two derivatives of a sweep, without its fades.
    fn sweep_at(&self, time_s: f64, length_s: f64) -> [f64; 3] {
        let Self::Sweep {
            amplitude,
            from_hz,
            to_hz,
            logarithmic,
            ..
        } = self
        else {
            return [0.0; 3];
        };
        let (phase, rate, change) = if *logarithmic {
            let scale_s = length_s / (to_hz / from_hz).ln();
            let rate = TAU * from_hz * (time_s / scale_s).exp();
            (
                TAU * from_hz * scale_s * ((time_s / scale_s).exp() - 1.0),
                rate,
                rate / scale_s,
            )
        } else {
            let change = TAU * (to_hz - from_hz) / length_s;
            (
                TAU * from_hz * time_s + change * time_s * time_s / 2.0,
                TAU * from_hz + change * time_s,
                change,
            )
        };
        let (sin, cos) = phase.sin_cos();
        [
            amplitude * sin,
            amplitude * rate * cos,
            amplitude * (change * cos - rate * rate * sin),
        ]
    }
}

/// Transition from one level to another around time 0, over twice the half-width, with two
/// derivatives: the polynomial 10 x³ − 15 x⁴ + 6 x⁵.
fn step(from: f64, to: f64, time_s: f64, half_width_s: f64) -> [f64; 3] {
    let width_s = 2.0 * half_width_s;
    let x = (time_s / width_s + 0.5).clamp(0.0, 1.0);
    let rise = to - from;
    [
        from + rise * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x),
        rise * 30.0 * x * x * (1.0 - x) * (1.0 - x) / width_s,
        rise * 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / (width_s * width_s),
    ]
}

/// Adds lines to every node, by rotating phasors that are reset every 1024 nodes. Each rotation depends on the previous
/// one, so eight lines are processed in parallel.
fn add_lines(lines: &[Line], input: &mut Input) {
    let (first_s, step_s) = (input.time_s(0), input.step_s);
    for some in lines.chunks(8) {
        let of_each = |of: fn(&Line) -> f64| -> [f64; 8] {
            std::array::from_fn(|k| some.get(k).map_or(0.0, of))
        };
        let size = of_each(|line| line.amplitude);
        let phase = of_each(|line| line.phase_rad);
        let omega = of_each(|line| TAU * line.frequency_hz);
        let turn = omega.map(|omega| (omega * step_s).sin_cos());
        for (block, nodes) in input.nodes.chunks_mut(1024).enumerate() {
            let time_s = first_s + (block * 1024) as f64 * step_s;
            let at = |k: usize| omega[k] * time_s + phase[k];
            let mut sin: [f64; 8] = std::array::from_fn(|k| at(k).sin());
            let mut cos: [f64; 8] = std::array::from_fn(|k| at(k).cos());
            for node in nodes {
                // Not `array::from_fn`, which becomes a call per number here.
                let mut parts = [[0.0; 8]; 3];
                for k in 0..8 {
                    parts[0][k] = size[k] * cos[k];
                    parts[1][k] = -size[k] * omega[k] * sin[k];
                    parts[2][k] = -size[k] * omega[k] * omega[k] * cos[k];
                    let (turn_sin, turn_cos) = turn[k];
                    (sin[k], cos[k]) = (
                        sin[k] * turn_cos + cos[k] * turn_sin,
                        cos[k] * turn_cos - sin[k] * turn_sin,
                    );
                }
                for (sum, [a, b, c, d, e, f, g, h]) in node.iter_mut().zip(parts) {
                    *sum += ((a + b) + (c + d)) + ((e + f) + (g + h));
                }
            }
        }
    }
}

/// A torque on the fine grid: value and two derivatives at each node.
#[derive(Debug, Clone)]
pub struct Input {
    /// Number of nodes before the record begins.
    pub before: usize,
    /// Samples of the record.
    pub samples: usize,
    /// Time between nodes.
    pub step_s: f64,
    nodes: Vec<[f64; 3]>,
    /// If values or derivatives jump: those at the end of each piece between nodes. `None` without jumps; each piece
    /// then ends with the values of the next node.
    ends: Option<Vec<[f64; 3]>>,
}

impl Input {
    /// Time of a node; the record begins at 0.
    pub fn time_s(&self, node: usize) -> f64 {
        (node as f64 - self.before as f64) * self.step_s
    }

    /// Values at the end of the piece that begins at a node.
    fn end(&self, node: usize) -> [f64; 3] {
        match &self.ends {
            Some(ends) => ends[node],
            None => self.nodes[node + 1],
        }
    }

    /// The same through a filter.
    pub fn filtered(&self, filter: &AntiAlias) -> Self {
        let (nodes, ends) = filter.nodes(self, self.nodes.len() - 1);
        Self {
            nodes,
            ends: self.ends.as_ref().map(|_| ends),
            ..*self
        }
    }

    /// The torque at a fraction (0 to 1) of the distance between a node and the next.
    pub fn between(&self, node: usize, part: f64) -> f64 {
        let ([p0, v0, a0], [p1, v1, a1]) = (self.nodes[node], self.end(node));
        let h = self.step_s;
        let (d0, d1, c0, c1) = (h * v0, h * v1, h * h * a0 / 2.0, h * h * a1 / 2.0);
        // Coefficients of the fifth-degree polynomial that matches both ends.
        let (rise, slope, curve) = (p1 - p0 - d0 - c0, d1 - d0 - 2.0 * c0, c1 - c0);
        let third = 10.0 * rise - 4.0 * slope + curve;
        let fourth = -15.0 * rise + 7.0 * slope - 2.0 * curve;
        let fifth = 6.0 * rise - 3.0 * slope + curve;
        p0 + part * (d0 + part * (c0 + part * (third + part * (fourth + part * fifth))))
    }

    /// The torque at a node, halfway to the next, and at the next.
    pub fn around(&self, node: usize) -> [f64; 3] {
        let ([p0, v0, a0], [p1, v1, a1]) = (self.nodes[node], self.end(node));
        let h = self.step_s;
        let middle = (p0 + p1) / 2.0 + h * (5.0 * (v0 - v1) + h / 2.0 * (a0 + a1)) / 32.0;
        [p0, middle, p1]
    }

    /// Values at the samples.
    pub fn samples(&self) -> Vec<f64> {
        self.at_samples(0)
    }

    /// Values at samples from the start of the input, before the record begins, to its end.
    pub fn all_samples(&self) -> Vec<f64> {
        self.nodes
            .iter()
            .step_by(FINER)
            .map(|node| node[0])
            .collect()
    }

    /// Time derivative at the samples.
    pub fn rates(&self) -> Vec<f64> {
        self.at_samples(1)
    }

    fn at_samples(&self, derivative: usize) -> Vec<f64> {
        (0..self.samples)
            .map(|sample| self.nodes[self.before + sample * FINER][derivative])
            .collect()
    }

    /// Fades it out after the record and, before the record of a settled stand, in, within some time.
    fn fade_around(&mut self, length_s: f64, settled: bool) {
        let fade_s = AFTER_S / 4.0;
        self.shape(|time_s| step(1.0, 0.0, time_s - length_s - 3.0 * fade_s, fade_s));
        if settled {
            let start_s = self.time_s(0);
            self.shape(|time_s| step(0.0, 1.0, time_s - start_s - 0.01, 0.01));
        }
    }

    /// Multiplies by an envelope given with two derivatives.
    fn shape(&mut self, envelope: impl Fn(f64) -> [f64; 3]) {
        for index in 0..self.nodes.len() {
            let [e, e1, e2] = envelope(self.time_s(index));
            let [u, u1, u2] = self.nodes[index];
            self.nodes[index] = [e * u, e * u1 + e1 * u, e * u2 + 2.0 * e1 * u1 + e2 * u];
        }
    }
}
