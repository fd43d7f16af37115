//! From the applied quantity to the record.

use std::ops::Range;

use num_complex::Complex64;

use super::{Chain, Link};
use crate::effects::{Action, SampleClock, Stage, Zero};
use crate::mode::Mode;
use crate::simulate::{
    Excitation, MotionProgress, MotionState, OngoingMotion, Torques, free_motion, integrate,
    sampled_response,
};

/// Maximum number of parts of a sample in which a record is simulated: what the kinks of a signal add below the Nyquist
/// frequency falls with its square.
const MOST_PARTS: usize = 6;

/// A record on its way through the chain, in the domain in which the last link left it.
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

/// A stand to be simulated.
#[derive(Clone, Copy)]
pub struct StandRun<'a> {
    /// The stand.
    pub chain: &'a Chain,
    /// Its motion at the first sample.
    pub start: MotionState,
    /// Displacement under a constant load, instead of [the stand's own](Chain::shift).
    pub shift: f64,
}

impl<'a> StandRun<'a> {
    /// The stand with its own constant load.
    #[must_use]
    pub fn of(chain: &'a Chain, start: MotionState) -> Self {
        Self {
            chain,
            start,
            shift: chain.shift,
        }
    }

    /// The record for an input, see [`Chain::simulate`].
    #[must_use]
    pub fn simulate(self, input: &Excitation) -> Vec<f64> {
        Chain::simulate_all(&[self], input)
            .pop()
            .unwrap_or_default()
    }
}

/// Gage signals of motions integrated in time.
fn integrate_all<'a>(
    runs: impl Iterator<Item = &'a StandRun<'a>>,
    input: &Excitation,
) -> Vec<Vec<f64>> {
    let begun = runs.map(|run| {
        let torques = run.chain.torques();
        let progress = MotionProgress::begin(&torques, (&run.chain.stand, run.start), run.shift);
        (run, torques, progress)
    });
    let mut begun: Vec<_> = begun.collect();
    let motions = begun
        .iter_mut()
        .map(|(run, torques, progress)| OngoingMotion {
            stand: &run.chain.stand,
            gain: run.chain.gain,
            shift: run.shift,
            torques,
            progress,
        });
    let mut motions: Vec<_> = motions.collect();
    integrate(&mut motions, input, 0..input.samples().len())
}

impl Chain {
    /// The record for an input, without lines and spikes: their phase differs from record to record.
    ///
    /// A motion that [is integrated](Self::is_integrated) starts from `start`, any other in the steady state of the
    /// backward extension of the record. Samples are NaN once the motion has diverged.
    #[must_use]
    pub fn simulate(&self, input: &Excitation, start: MotionState) -> Vec<f64> {
        StandRun::of(self, start).simulate(input)
    }

    /// The records of several stands for one input, each as from [`simulate`](Self::simulate). Integrated motions are
    /// stepped alternately, which is faster than one after the other.
    #[must_use]
    pub fn simulate_all(runs: &[StandRun<'_>], input: &Excitation) -> Vec<Vec<f64>> {
        let parts = runs
            .iter()
            .map(|run| run.chain.parts_of_sample(input.substeps()));
        let parts = parts.max().unwrap_or(1);
        let integrated = runs.iter().filter(|run| run.chain.is_integrated());
        let mut shown = integrate_all(integrated, input.finer(parts)).into_iter();
        let record = |run: &StandRun| match run.chain.is_integrated() {
            true => {
                let shown = shown.next().unwrap_or_default();
                run.chain.recorded_if_finite(shown, (input, parts))
            }
            false => run.chain.record(run.chain.respond(input), input),
        };
        runs.iter().map(record).collect()
    }

    /// Parts of a sample in which the record is simulated, of which the steps of integration are a multiple: several if
    /// linear links follow a torque that the gage shows. Its kinks have harmonics above the Nyquist frequency, which a
    /// delay or a filter acts on before the signal is sampled.
    pub(crate) fn parts_of_sample(&self, substeps: usize) -> usize {
        let is_shown = |link: &Link| link.torque().is_some_and(|(_, is_shown)| is_shown);
        let is_after = |link: &Link| link.stage >= Stage::Gage && link.is_linear();
        if !self.links.iter().any(is_shown) || !self.links.iter().any(is_after) {
            return 1;
        }
        let mut finest_first = (1..=MOST_PARTS).rev();
        let divides = |parts: &usize| substeps.is_multiple_of(*parts);
        finest_first.find(divides).unwrap_or(1)
    }

    /// The record for an input from the state `start`, by integration in time.
    #[must_use]
    pub fn simulate_from(&self, input: &Excitation, start: MotionState) -> Vec<f64> {
        let parts = self.parts_of_sample(input.substeps());
        let mut shown = integrate_all([StandRun::of(self, start)].iter(), input.finer(parts));
        self.recorded_if_finite(shown.pop().unwrap_or_default(), (input, parts))
    }

    /// The gage signal, at the parts of the samples, passed through the links after the stand, up to where it diverges.
    pub(crate) fn recorded_if_finite(
        &self,
        shown: Vec<f64>,
        (input, parts): (&Excitation, usize),
    ) -> Vec<f64> {
        let shown = match shown.last().is_some_and(|x| x.is_finite()) {
            true => self.record(Signal::Samples(shown), input.finer(parts)),
            false => shown,
        };
        match parts {
            1 => shown,
            _ => shown.into_iter().step_by(parts).collect(),
        }
    }

    /// Free responses to a unit displacement and to a unit of speed over `ω₀`.
    #[must_use]
    pub fn free_motion(&self, rate_hz: f64, count: usize) -> [Vec<f64>; 2] {
        free_motion(&self.stand.first(), rate_hz, count)
    }

    /// Displacement and speed at the first sample, in the steady state of the backward extension of
    /// the record; without torques.
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

    /// Whether the motion is integrated in time.
    #[must_use]
    pub fn is_integrated(&self) -> bool {
        self.begins_at_start || self.has_torques()
    }

    /// Whether a link after the stand distorts samples.
    #[must_use]
    pub fn distorts(&self) -> bool {
        let mut actions = self.links.iter().map(|link| &link.action);
        actions.any(|action| matches!(action, Action::Distortion(_)))
    }

    /// Mode of small free motions, with the relative stiffness `k` that torques and material damping add and the loss
    /// factor `η` of the latter: `ω √(1 + k)` and `ζ/√(1 + k) + η/(2 (1 + k))`; the first mode if there are several.
    ///
    /// ```
    /// use torqcomp_model::{Chain, Link, Mode, effects::Effect};
    /// let effect = Effect::named("bouc-wen-hysteresis").unwrap();
    /// let torque = Link::of(effect, effect.form(Some("exponent")).unwrap(), &[0.21, 1.0, 0.5, 1.0]);
    /// let mode = Mode { omega_rad_s: 100.0, damping_ratio: 0.055 };
    /// // √1.21 = 1.1.
    /// let free = Chain::new(mode, 1.0).with_links([torque]).free_mode();
    /// assert!((free.omega_rad_s - 110.0).abs() < 1e-12);
    /// assert!((free.damping_ratio - 0.05).abs() < 1e-15);
    /// let effect = Effect::named("structural-damping").unwrap();
    /// let loss = Link::of(effect, &effect.forms[0], &[0.03]);
    /// // 0.055 + 0.03/2.
    /// let free = Chain::new(mode, 1.0).with_links([loss]).free_mode();
    /// assert!((free.damping_ratio - 0.07).abs() < 1e-15);
    /// ```
    #[must_use]
    pub fn free_mode(&self) -> Mode {
        let plain = self.stand.first();
        let added = self.added_stiffness() + self.material_stiffness(&plain);
        let stiffer = (1.0 + added.re).max(0.0).sqrt();
        if stiffer == 0.0 {
            return plain;
        }
        Mode {
            omega_rad_s: plain.omega_rad_s * stiffer,
            damping_ratio: plain.damping_ratio / stiffer + 0.5 * added.im / (1.0 + added.re),
        }
    }

    /// Complex stiffness that material damping adds to a mode at its natural frequency, relative to that of the mode.
    fn material_stiffness(&self, mode: &Mode) -> Complex64 {
        let omega = mode.omega_rad_s;
        let plain = mode.inverse(omega);
        let added = self.links.iter().map(|link| match &link.action {
            Action::Stiffness(change) => change(mode, omega, plain) - plain,
            _ => Complex64::ZERO,
        });
        added.sum()
    }

    /// Stiffness that torques add at small displacements, relative to that of the plain stand.
    #[must_use]
    pub fn added_stiffness(&self) -> f64 {
        self.torques()
            .iter()
            .map(|(torque, _)| torque.stiffness())
            .sum()
    }

    /// How its torques depend on the zero of displacement.
    #[must_use]
    pub fn zero(&self) -> Zero {
        let zeros = self.torques().into_iter().map(|(torque, _)| torque.zero());
        let mut depends = zeros.filter(|zero| *zero != Zero::Any);
        match (depends.next(), depends.next()) {
            (None, _) => Zero::Any,
            (Some(only), None) => only,
            // The places of two torques relative to each other do not depend on a constant load.
            (Some(_), Some(_)) => Zero::Fixed,
        }
    }

    /// Initial state of a motion.
    pub(crate) fn begin(&self, start: MotionState) -> MotionProgress {
        MotionProgress::begin(&self.torques(), (&self.stand, start), self.shift)
    }

    /// Gage signal over a range of samples of the input, see [`integrate`].
    pub(crate) fn integrated_over(
        &self,
        input: &Excitation,
        range: Range<usize>,
        progress: &mut MotionProgress,
    ) -> Vec<f64> {
        let motion = OngoingMotion {
            stand: &self.stand,
            gain: self.gain,
            shift: self.shift,
            torques: &self.torques(),
            progress,
        };
        let mut shown = integrate(&mut [motion], input, range);
        shown.pop().unwrap_or_default()
    }

    pub(super) fn torques(&self) -> Torques<'_> {
        self.links.iter().filter_map(Link::torque).collect()
    }

    fn respond(&self, input: &Excitation) -> Signal {
        let lines = input.spectrum().iter().enumerate();
        let sampled = sampled_response(&self.stand, 1.0 / input.rate_hz(), input.between());
        let motion = |(k, u): (usize, &Complex64)| {
            let omega = input.omega_rad_s(k);
            self.gain
                * match &sampled {
                    Some(response) => input.line_of_samples(k) * response(omega),
                    None => u * self.stand.response(omega),
                }
        };
        let spectrum = lines.map(motion).collect();
        Signal::Spectrum(spectrum)
    }

    /// The motion passed through the links after the stand.
    fn record(&self, mut signal: Signal, input: &Excitation) -> Vec<f64> {
        for link in self.links.iter().filter(|link| link.stage > Stage::Stand) {
            signal = self.apply(&link.action, signal, input);
        }
        signal.into_samples(input)
    }

    fn apply(&self, action: &Action, signal: Signal, input: &Excitation) -> Signal {
        match action {
            Action::Factor(_) | Action::Stiffness(_) | Action::Body { .. } => {
                multiply(signal, input, |omega| {
                    action.factor(&self.stand, omega).unwrap_or(Complex64::ONE)
                })
            }
            Action::Feedthrough(past) => {
                let mut spectrum = signal.into_spectrum(input);
                for (k, (y, u)) in spectrum.iter_mut().zip(input.spectrum()).enumerate() {
                    let omega = input.omega_rad_s(k);
                    let sampled = past.sampled.as_ref();
                    let sampled =
                        sampled.and_then(|of| of(input.between(), omega, 1.0 / input.rate_hz()));
                    *y += self.gain
                        * match sampled {
                            Some(response) => input.line_of_samples(k) * response,
                            None => u * (past.response)(&self.stand, omega),
                        };
                }
                Signal::Spectrum(spectrum)
            }
            Action::Recorder {
                response,
                is_ideal: false,
            } => multiply(signal, input, |omega| {
                response(omega / std::f64::consts::TAU)
            }),
            Action::Distortion(distortion) => {
                let clock = SampleClock {
                    step_s: 1.0 / input.rate_hz(),
                };
                let mut samples = signal.into_samples(input);
                distortion.forward(clock, &mut samples);
                Signal::Samples(samples)
            }
            // The phase of a line, the moments of spikes and a slow trend differ from record to record.
            Action::Recorder { .. }
            | Action::Torque { .. }
            | Action::Lines(_)
            | Action::Spikes(_)
            | Action::Course(_) => signal,
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
