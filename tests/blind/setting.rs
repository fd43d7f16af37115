//! Random setting of a case: constants, excitations, noise, strength.

use super::anti_alias::AntiAlias;
use super::draw::Draw;
use super::excitation::{Excitation, Input};
use super::plain_fit::rms;
use super::plant::Constants;
use super::span::Span;

/// Random setting of a case.
pub struct Setting {
    pub constants: Constants,
    pub excitations: [Excitation; 2],
    pub inputs: [Input; 2],
    pub noise: Noise,
    pub target: f64,
    pub span: Span,
    /// The declared constants, if not those of the thesis.
    pub declared: Option<Constants>,
    /// The low-pass before the recorder, and the filtered inputs.
    pub filter: Option<AntiAlias>,
    pub filtered: Option<[Input; 2]>,
    pub applied_noise: Option<AppliedNoise>,
}

impl Setting {
    /// The applied torque seen by the recorder, without noise.
    pub fn recorded(&self, record: usize) -> &Input {
        self.filtered
            .as_ref()
            .map_or(&self.inputs[record], |filtered| &filtered[record])
    }

    /// Noise of an RMS on the measured torque, combined with the stand's response to that on the applied one.
    pub fn whole_noise(&self, record: usize, measured_rms_n_m: f64) -> f64 {
        self.applied_noise
            .as_ref()
            .map_or(measured_rms_n_m, |noise| {
                measured_rms_n_m.hypot(noise.through_n_m[record])
            })
    }

    /// Ratio of the residual of a plain fit to a noise-free training record to the noise.
    pub fn strength(&self, left_n_m: f64, signal: &[f64]) -> f64 {
        left_n_m / self.whole_noise(0, self.noise.share * rms(signal))
    }
}

/// Specification in addition to effect and number.
#[derive(Debug, Clone, Copy, Default)]
pub struct Asked {
    /// Stands, inputs and recorders of every kind instead of those of the thesis.
    pub wide: bool,
    /// Minimum and maximum strength.
    pub strength: Option<(f64, f64)>,
}

/// White noise on the recorded applied torque.
pub struct AppliedNoise {
    pub share_of_rms: f64,
    pub samples: [Vec<f64>; 2],
    /// RMS response of the true plain stand to it.
    pub through_n_m: [f64; 2],
}

/// The noise of the recorder.
#[derive(Debug, Clone, Copy)]
pub struct Noise {
    /// Relative to the RMS of the signal.
    pub share: f64,
    /// The same in both records, or the same share of both.
    pub absolute: bool,
    /// Correlation between successive samples.
    pub memory: f64,
    /// Quantisation step of the recorder relative to the noise; 0 for none.
    pub quantum: f64,
}

/// Constants that differ from those of the thesis by 2 to 20 per cent in either direction.
fn constants(draw: &mut Draw) -> Constants {
    let mut off = |value: f64| value * (1.0 + draw.sign() * draw.log_between(0.02, 0.2));
    let thesis = Constants::hertel();
    Constants {
        inertia_kg_m2: off(thesis.inertia_kg_m2),
        damping_n_m_s: off(thesis.damping_n_m_s),
        stiffness_n_m: off(thesis.stiffness_n_m),
    }
}

/// Training and held-out input. `alike` gives both the same level.
fn excitations(draw: &mut Draw, alike: bool) -> [Excitation; 2] {
    let rms = draw.log_between(1.0, 8.0);
    let settled = draw.chance(0.6);
    let kind = draw.one_of(&[0, 0, 1, 1, 2, 3, 4, 5]);
    let drawn = if draw.chance(0.8) {
        draw.between(0.4, 0.8)
    } else {
        draw.between(1.2, 1.5)
    };
    let level = if alike { 1.0 } else { drawn };
    let mut first = match kind {
        3 | 4 => Excitation::sweep(draw, 1.5 * rms),
        _ => Excitation::multisine(draw, rms, settled),
    };
    let second = match kind {
        0 => first.at_level(level),
        2 | 4 => Excitation::sweep(draw, 1.5 * rms * level),
        _ => Excitation::multisine(draw, rms * level, settled),
    };
    if let (5, Excitation::Multisine { second_half, .. }) = (kind, &mut first) {
        *second_half = draw.between(0.3, 0.7);
    }
    [first, second]
}

/// Strengths from marginal to obvious: the plain fit's noise-free residual over the noise.
pub fn target(draw: &mut Draw, number: usize) -> f64 {
    match number % 4 {
        0 => draw.log_between(0.3, 1.0),
        3 => draw.log_between(5.0, 25.0),
        _ => draw.log_between(1.0, 5.0),
    }
}

/// Draws the setting of a case with the stand of the thesis.
pub fn setting(seed: u64, number: usize, alike: bool) -> Setting {
    let mut draw = Draw::new(seed, "setting");
    let constants = constants(&mut draw);
    let noise = Noise::drawn(&mut draw);
    let target = target(&mut draw, number);
    let excitations = excitations(&mut draw, alike);
    let inputs = [excitations[0].input(), excitations[1].input()];
    Setting {
        constants,
        excitations,
        inputs,
        noise,
        target,
        span: Span::THESIS,
        declared: None,
        filter: None,
        filtered: None,
        applied_noise: None,
    }
}

impl Noise {
    /// Mostly white and fine.
    pub fn drawn(draw: &mut Draw) -> Self {
        Self {
            share: draw.log_between(0.001, 0.01),
            absolute: draw.chance(0.7),
            memory: if draw.chance(0.1) {
                draw.between(0.2, 0.5)
            } else {
                0.0
            },
            quantum: if draw.chance(0.1) {
                draw.between(0.3, 1.5)
            } else {
                0.0
            },
        }
    }

    /// Adds noise of an RMS and the quantisation of the recorder; returns the RMS of both together.
    pub fn add(&self, samples: &mut [f64], rms_n_m: f64, draw: &mut Draw) -> f64 {
        let fresh = (1.0 - self.memory * self.memory).sqrt();
        let mut noise = draw.normal();
        let step = self.quantum * rms_n_m;
        let mut square = 0.0;
        for sample in samples.iter_mut() {
            let clean = *sample;
            *sample += rms_n_m * noise;
            if step > 0.0 {
                *sample = (*sample / step).round() * step;
            }
            square += (*sample - clean).powi(2);
            noise = self.memory * noise + fresh * draw.normal();
        }
        (square / samples.len() as f64).sqrt()
    }
}
