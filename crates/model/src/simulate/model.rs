//! A stand with its effects, from input to record.

use std::sync::Arc;

use num_complex::Complex64;

use super::input::Excitation;
use super::integrate::{State, free_motion};
use super::run::{self, Link};
use crate::effects::{Action, Clock, Mode, Stage};

/// A response that is known and not fitted, such as that of the recorder: of the frequency in Hz.
pub type Fixed = Arc<dyn Fn(f64) -> Complex64 + Send + Sync>;

/// A stand with its effects.
pub struct Model {
    /// The linear mode.
    pub mode: Mode,
    /// Recorded per applied quantity, at rest.
    pub gain: f64,
    /// The recorder, as far as it is known.
    pub recorder: Option<Fixed>,
    /// Displacement, in units of the record, by a load that does not change and is not in the input: torques of
    /// the stand see it; what the gage shows of it is left to the record's own constant.
    pub shift: f64,
    /// The effects.
    pub actions: Vec<(Stage, Action)>,
}

/// A record on its way through the chain, in the domain that the last link left it in.
enum Signal {
    Spectrum(Vec<Complex64>),
    Samples(Vec<f64>),
}

impl Signal {
    fn into_spectrum(self, input: &Excitation) -> Vec<Complex64> {
        match self {
            Self::Spectrum(spectrum) => spectrum,
            Self::Samples(samples) => input.transform(&samples),
        }
    }

    fn into_samples(self, input: &Excitation) -> Vec<f64> {
        match self {
            Self::Spectrum(spectrum) => input.samples_of(spectrum),
            Self::Samples(samples) => samples,
        }
    }
}

impl Model {
    /// The record for an input. Lines are not in it: their phase belongs to a record.
    ///
    /// With torques in the stand the motion starts from `start`; without, from the steady state of what
    /// continues the record backwards. Samples after the motion has left all bounds are NaN.
    #[must_use]
    pub fn simulate(&self, input: &Excitation, start: State) -> Vec<f64> {
        let torques = self.torques();
        let moved = if torques.is_empty() {
            self.respond(input)
        } else {
            let samples = run::run(&self.mode, self.gain, &torques, input, start, self.shift);
            if samples.last().is_none_or(|x| !x.is_finite()) {
                return samples;
            }
            Signal::Samples(samples)
        };
        self.record(moved, input)
    }

    /// The record for an input when the stand is at rest before it, by integration in time.
    #[must_use]
    pub fn simulate_from(&self, input: &Excitation, start: State) -> Vec<f64> {
        let samples = run::run(
            &self.mode,
            self.gain,
            &self.torques(),
            input,
            start,
            self.shift,
        );
        if samples.last().is_none_or(|x| !x.is_finite()) {
            return samples;
        }
        self.record(Signal::Samples(samples), input)
    }

    /// Records of the free motion from a unit displacement and from a unit speed over `ω₀`.
    #[must_use]
    pub fn free_motion(&self, rate_hz: f64, count: usize) -> [Vec<f64>; 2] {
        free_motion(&self.mode, rate_hz, count)
    }

    /// Displacement and speed at the first sample, in the steady state of what continues the record
    /// backwards; torques left out.
    #[must_use]
    pub fn state_at_start(&self, input: &Excitation) -> [f64; 2] {
        let Signal::Spectrum(x) = self.respond(input) else {
            return [0.0; 2];
        };
        let speed = x
            .iter()
            .enumerate()
            .map(|(k, x)| x * Complex64::new(0.0, input.omega_rad_s(k)))
            .collect();
        [input.samples_of(x)[0], input.samples_of(speed)[0]]
    }

    /// Whether the motion has to be integrated in time.
    #[must_use]
    pub fn has_torques(&self) -> bool {
        !self.torques().is_empty()
    }

    /// Stiffness that the torques add at small displacements, relative to that of the plain stand.
    #[must_use]
    pub fn added_stiffness(&self) -> f64 {
        self.torques()
            .iter()
            .map(|(torque, _)| torque.stiffness())
            .sum()
    }

    /// Whether a constant load matters beyond a constant in the record.
    #[must_use]
    pub fn has_zero(&self) -> bool {
        self.torques().iter().any(|(torque, _)| torque.has_zero())
    }

    fn torques(&self) -> Vec<Link<'_>> {
        self.actions
            .iter()
            .filter_map(|(_, action)| match action {
                Action::Torque { torque, shown } => Some((torque.as_ref(), *shown)),
                _ => None,
            })
            .collect()
    }

    fn respond(&self, input: &Excitation) -> Signal {
        let line =
            |(k, u): (usize, &Complex64)| u * self.gain * self.mode.response(input.omega_rad_s(k));
        Signal::Spectrum(input.spectrum().iter().enumerate().map(line).collect())
    }

    /// What the chain makes of the motion, place by place.
    fn record(&self, mut signal: Signal, input: &Excitation) -> Vec<f64> {
        const ALONG: [Stage; 5] = [
            Stage::Dynamics,
            Stage::Gage,
            Stage::Chain,
            Stage::Limit,
            Stage::Disturbance,
        ];
        let clock = Clock {
            step_s: 1.0 / input.rate_hz(),
        };
        for place in ALONG {
            if place == Stage::Chain
                && let Some(recorder) = &self.recorder
            {
                signal = multiply(signal, input, |omega| {
                    recorder(omega / std::f64::consts::TAU)
                });
            }
            for (_, action) in self.actions.iter().filter(|(p, _)| *p == place) {
                signal = self.apply(action, signal, input, clock);
            }
        }
        signal.into_samples(input)
    }

    fn apply(&self, action: &Action, signal: Signal, input: &Excitation, clock: Clock) -> Signal {
        match action {
            Action::Factor(factor) => multiply(signal, input, |omega| factor(&self.mode, omega)),
            Action::Feedthrough(term) => {
                let mut spectrum = signal.into_spectrum(input);
                for (k, (y, u)) in spectrum.iter_mut().zip(input.spectrum()).enumerate() {
                    *y += u * self.gain * term(&self.mode, input.omega_rad_s(k));
                }
                Signal::Spectrum(spectrum)
            }
            Action::Transform { apply, .. } => {
                let mut samples = signal.into_samples(input);
                apply(clock, &mut samples);
                Signal::Samples(samples)
            }
            Action::Torque { .. } | Action::Lines(_) | Action::Course(_) => signal,
        }
    }
}

fn multiply(signal: Signal, input: &Excitation, factor: impl Fn(f64) -> Complex64) -> Signal {
    let mut spectrum = signal.into_spectrum(input);
    for (k, y) in spectrum.iter_mut().enumerate() {
        *y *= factor(input.omega_rad_s(k));
    }
    Signal::Spectrum(spectrum)
}
