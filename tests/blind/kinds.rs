//! Inputs besides multisines and sweeps: band-limited noise, plateaus, single hits.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::draw::Draw;
use super::excitation::FINER;

/// Value and two derivatives.
type Node = [f64; 3];

/// Noise up to a frequency: lines with random amplitudes, closer than a record could resolve.
#[derive(Debug, Clone)]
pub struct Random {
    pub rms: f64,
    pub top_hz: f64,
    pub settled: bool,
    /// Seed of its lines.
    pub seed: u64,
}

impl Random {
    /// The torque at nodes. Its period is longer than all of them.
    pub fn nodes(&self, points: usize, step_s: f64) -> Vec<Node> {
        let length = (points + points / 2).next_multiple_of(10_000);
        let transform = torqcomp_fourier::inverse(length);
        let spacing_hz = 1.0 / (length as f64 * step_s);
        let count = (self.top_hz / spacing_hz) as usize;
        let mut draw = Draw::new(self.seed, "random lines");
        let mut lines: Vec<Complex64> = (0..count)
            .map(|_| Complex64::new(draw.normal(), draw.normal()))
            .collect();
        // Each of the two frequencies of a line has half of its amplitude.
        let power: f64 = lines.iter().map(|line| 2.0 * line.norm_sqr()).sum();
        for line in &mut lines {
            *line *= self.rms / power.sqrt();
        }
        let derivatives = [0, 1, 2].map(|derivative| {
            let mut spectrum = transform.make_input_vec();
            for (bin, line) in lines.iter().enumerate() {
                let rate = Complex64::new(0.0, TAU * spacing_hz * (bin + 1) as f64);
                spectrum[bin + 1] = line * rate.powi(derivative);
            }
            let mut values = transform.make_output_vec();
            transform
                .process(&mut spectrum, &mut values)
                .expect("lengths agree");
            values
        });
        (0..points)
            .map(|point| [0, 1, 2].map(|k: usize| derivatives[k][point]))
            .collect()
    }
}

/// Plateaus of random levels and lengths; a level applies from its sample on.
#[derive(Debug, Clone)]
pub struct Steps {
    /// Samples and level of each, starting before the record if the stand has settled.
    pub plateaus: Vec<(usize, f64)>,
    pub settled: bool,
    /// Nominal upper end of its spectrum, which falls with frequency.
    pub top_hz: f64,
}

impl Steps {
    /// Plateaus over a number of samples, each about `each` long.
    pub fn drawn(draw: &mut Draw, rms: f64, samples: usize, each: f64) -> Vec<(usize, f64)> {
        let mut plateaus = Vec::new();
        let mut left = samples;
        while left > 0 {
            let length = (each * draw.log_between(0.4, 2.5)).round() as usize;
            let length = length.clamp(4, left.max(4));
            plateaus.push((length, rms * draw.normal()));
            left = left.saturating_sub(length);
        }
        plateaus
    }

    pub fn scale(&mut self, level: f64) {
        self.plateaus
            .iter_mut()
            .for_each(|(_, torque)| *torque *= level);
    }

    pub fn nodes(&self, points: usize) -> Vec<Node> {
        let mut nodes = Vec::with_capacity(points);
        for (samples, torque) in &self.plateaus {
            nodes.extend(std::iter::repeat_n([*torque, 0.0, 0.0], samples * FINER));
        }
        nodes.resize(points, nodes.last().copied().unwrap_or_default());
        nodes
    }

    pub fn describe(&self) -> String {
        let square: f64 = self.plateaus.iter().map(|(_, level)| level * level).sum();
        format!(
            "steps, {} plateaus, rms of their levels {:.3} N m, {}",
            self.plateaus.len(),
            (square / self.plateaus.len() as f64).sqrt(),
            if self.settled { "settled" } else { "from rest" }
        )
    }
}

/// A pulse that begins and ends at nodes.
#[derive(Debug, Clone, Copy)]
pub struct Pulse {
    pub node: usize,
    pub nodes: usize,
    pub height: f64,
    /// `sin⁴` instead of a half-sine.
    pub smooth: bool,
}

impl Pulse {
    /// Value and two derivatives at a fraction of its length.
    fn at(&self, part: f64, length_s: f64) -> Node {
        let (sin, cos) = (PI * part).sin_cos();
        let rate = PI / length_s;
        let [value, slope, curve] = if self.smooth {
            let square = sin * sin;
            [
                square * square,
                4.0 * square * sin * cos,
                12.0 * square * cos * cos - 4.0 * square * square,
            ]
        } else {
            [sin, cos, -sin]
        };
        [
            self.height * value,
            self.height * rate * slope,
            self.height * rate * rate * curve,
        ]
    }
}

/// Pulses some periods apart.
#[derive(Debug, Clone)]
pub struct Hits {
    pub pulses: Vec<Pulse>,
    /// Upper end of their spectrum.
    pub top_hz: f64,
}

impl Hits {
    pub fn scale(&mut self, level: f64) {
        self.pulses
            .iter_mut()
            .for_each(|pulse| pulse.height *= level);
    }

    /// The torque at the start and at the end of each piece.
    pub fn nodes(&self, points: usize, step_s: f64) -> (Vec<Node>, Vec<Node>) {
        let mut nodes = vec![[0.0; 3]; points];
        let mut ends = nodes.clone();
        for pulse in &self.pulses {
            let length_s = pulse.nodes as f64 * step_s;
            for k in 0..pulse.nodes {
                let part = |k: usize| k as f64 / pulse.nodes as f64;
                nodes[pulse.node + k] = pulse.at(part(k), length_s);
                ends[pulse.node + k] = pulse.at(part(k + 1), length_s);
            }
        }
        (nodes, ends)
    }

    pub fn describe(&self) -> String {
        let height = |pulse: &Pulse| pulse.height.abs();
        let highest = self.pulses.iter().map(height).fold(0.0, f64::max);
        let smooth = self.pulses.iter().all(|pulse| pulse.smooth);
        format!(
            "hits, {} {}, up to {highest:.3} N m",
            self.pulses.len(),
            if smooth {
                "smooth pulses"
            } else {
                "half sines"
            }
        )
    }
}
