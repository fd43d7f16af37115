//! Action of an effect on the record, and its inverse.

use std::sync::Arc;

use num_complex::Complex64;

use super::lines::SpectralLine;
use super::spikes::SpikeTrain;
use crate::modal::ModalResponse;
use crate::mode::Mode;
use crate::simulate::Between;

/// A function of the plain stand and the angular frequency in rad/s.
pub type Frequency = Box<dyn Fn(&ModalResponse, f64) -> Complex64 + Send + Sync>;

/// The exact response of samples to an input that is held or straight between its own, as a factor of their spectrum: a
/// function of the waveform, the angular frequency in rad/s and the time between samples in s; `None` for another waveform.
pub type Sampled = Box<dyn Fn(Between, f64, f64) -> Option<Complex64> + Send + Sync>;

/// A response past the stand, relative to the gain.
pub struct PastStand {
    /// To a continuous input.
    pub response: Frequency,
    /// To jumps and kinks between the samples, which have no spectrum below the Nyquist frequency alone; none where a jump
    /// has no value, as in a derivative.
    pub sampled: Option<Sampled>,
}

/// A change of the dynamic stiffness of each mode: a function of the mode, the angular frequency in rad/s, and its
/// `1 − (ω/ω₀)² + 2jζ ω/ω₀`.
pub type StiffnessChange = Box<dyn Fn(&Mode, f64, Complex64) -> Complex64 + Send + Sync>;

/// A plain stand with a body coupled to it, as a sum of modes.
pub type CoupledStand = Box<dyn Fn(&ModalResponse) -> Option<ModalResponse> + Send + Sync>;

/// A known response that is not fitted, such as that of the recorder, as a function of frequency in
/// Hz.
pub type Fixed = Arc<dyn Fn(f64) -> Complex64 + Send + Sync>;

/// Times of samples from the start of their record: drift starts anew in each record, whatever its time stamps say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleClock {
    /// Time between samples in s.
    pub step_s: f64,
}

impl SampleClock {
    /// Time of a sample in s from the start of the record.
    #[must_use]
    pub fn time_s(&self, index: usize) -> f64 {
        index as f64 * self.step_s
    }
}

/// How a torque depends on the zero of displacement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Zero {
    /// Not at all.
    Any,
    /// A constant load changes it.
    Fixed,
    /// A constant load changes it as its places do: a record does not tell one from the other.
    Placed,
}

/// What an effect does.
pub enum Action {
    /// A torque in the stand; in the gage's load path, the gage shows it together with `x`.
    Torque {
        /// The torque.
        torque: Box<dyn Torque>,
        /// Whether it strains the part that carries the gage.
        in_gage_path: bool,
    },
    /// A factor of the response.
    Factor(Frequency),
    /// A change of the stiffness, which also changes how the stand rings.
    Stiffness(StiffnessChange),
    /// A body coupled to the stand: a factor of the response, and a part of the motion on which torques act.
    Body {
        /// The factor.
        factor: Frequency,
        /// The stand with the body as a sum of modes; `None` if it does not ring.
        coupled: CoupledStand,
    },
    /// A term of the response past the stand: the applied quantity couples directly into the
    /// record.
    Feedthrough(PastStand),
    /// The known response of the recorder, a factor.
    Recorder {
        /// Its response.
        response: Fixed,
        /// Whether it has no effect.
        is_ideal: bool,
    },
    /// A distortion of the recorded samples.
    Distortion(Box<dyn Distortion>),
    /// Added spectral lines.
    Lines(Vec<SpectralLine>),
    /// Added spikes at equal intervals.
    Spikes(SpikeTrain),
    /// An added slow trend that belongs to the record, with at most this many half waves over its length.
    Course(usize),
}

/// Treatment of an effect in a compensation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Treatment {
    /// The spectrum is divided by its response.
    DividedOut,
    /// It is estimated and subtracted.
    Subtracted,
    /// Its equation is solved.
    Inverted,
    /// Its torque is evaluated along the measured motion.
    Integrated,
    /// The affected samples are marked.
    Marked,
}

impl Treatment {
    /// In words for reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::DividedOut => "divided out",
            Self::Subtracted => "subtracted",
            Self::Inverted => "inverted",
            Self::Integrated => "integrated",
            Self::Marked => "marked",
        }
    }
}

/// Samples whose original value the distorted record does not determine.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Unrecovered {
    /// Reason.
    pub why: String,
    /// Their indices in ascending order.
    pub samples: Vec<usize>,
}

/// A distortion of the recorded samples in place, and its inverse.
pub trait Distortion: Send + Sync {
    /// Applies the distortion.
    fn forward(&self, clock: SampleClock, samples: &mut [f64]);

    /// Inverts the distortion, for noise of standard deviation `noise_std`; returns the samples that cannot be
    /// recovered.
    fn inverse(&self, clock: SampleClock, noise_std: f64, samples: &mut [f64]) -> Unrecovered;

    /// Treatment in a compensation.
    fn treatment(&self) -> Treatment {
        Treatment::Inverted
    }

    /// Whether it acts on each sample alone, without memory or dependence on time.
    fn is_pointwise(&self) -> bool {
        false
    }

    /// Whether it depends on the time since the record began.
    fn is_timed(&self) -> bool {
        false
    }
}

/// Memory of a torque, carried from node to node.
pub type Memory = [f64; 2];

/// A torque `n(x, x', z)` in units of the record, in `x'' + 2ζω₀ x' + ω₀² (x + n) = ω₀² G u`.
///
/// The inverse evaluates it along the measured motion: [`Torque::blurred`], and in the gage's load
/// path [`Torque::hidden`].
pub trait Torque: Send + Sync {
    /// The torque at a state; advances the memory.
    fn value(&self, memory: &mut Memory, x: f64, speed: f64) -> f64;

    /// Mean torque for a speed with a standard uncertainty: switching with the sign of the speed becomes gradual.
    fn blurred(&self, memory: &mut Memory, x: f64, speed: f64, speed_std: f64) -> f64 {
        let _ = speed_std;
        self.value(memory, x, speed)
    }

    /// Half-width of the range of `x` about zero in which a gage that shows `x + n` reads zero.
    fn hidden(&self) -> f64 {
        0.0
    }

    /// The speed after the torque has acted for a short time with `x` constant: `impulse = ω₀² h`.
    /// `change` is the change of speed since the last node: a torque that switches with the sign of
    /// the speed does so somewhere in between.
    fn kick(&self, memory: &mut Memory, x: f64, speed: f64, change: f64, impulse: f64) -> f64 {
        let _ = change;
        speed - impulse * self.value(memory, x, speed)
    }

    /// Its stiffness at small displacements, relative to that of the plain stand; a fit that adds the torque starts
    /// with the plain stand's stiffness reduced by it.
    fn stiffness(&self) -> f64 {
        0.0
    }

    /// Magnitude of its sharp dry friction, if any: the integration locates the moments at which that switches.
    /// [`Torque::kick`] then covers only the rest of the torque, which is smooth and zero at rest.
    fn dry(&self) -> Option<f64> {
        None
    }

    /// Whether it switches with the direction of motion: where the direction is unknown, so is the
    /// torque.
    fn switches(&self) -> bool {
        false
    }

    /// How it depends on the zero of displacement.
    fn zero(&self) -> Zero {
        Zero::Any
    }

    /// Initial memory.
    fn begin(&self, x: f64) -> Memory {
        let _ = x;
        [0.0; 2]
    }
}

impl Action {
    /// A torque that the gage does not show.
    #[must_use]
    pub fn beside(torque: impl Torque + 'static) -> Self {
        Self::Torque {
            torque: Box::new(torque),
            in_gage_path: false,
        }
    }

    /// A torque that the gage shows.
    #[must_use]
    pub fn in_gage_path(torque: impl Torque + 'static) -> Self {
        Self::Torque {
            torque: Box::new(torque),
            in_gage_path: true,
        }
    }

    /// Its factor of the response of a stand at an angular frequency in rad/s, if it is one.
    #[must_use]
    pub fn factor(&self, stand: &ModalResponse, omega_rad_s: f64) -> Option<Complex64> {
        match self {
            Self::Factor(factor) | Self::Body { factor, .. } => Some(factor(stand, omega_rad_s)),
            Self::Stiffness(change) => {
                let changed = |mode: &Mode, plain| change(mode, omega_rad_s, plain);
                Some(stand.inverse(omega_rad_s) / stand.inverse_with(omega_rad_s, changed))
            }
            _ => None,
        }
    }

    /// Treatment in a compensation.
    #[must_use]
    pub fn treatment(&self) -> Treatment {
        match self {
            Self::Factor(_)
            | Self::Stiffness(_)
            | Self::Body { .. }
            | Self::Feedthrough(_)
            | Self::Recorder { .. } => Treatment::DividedOut,
            Self::Lines(_) | Self::Spikes(_) | Self::Course(_) => Treatment::Subtracted,
            Self::Distortion(distortion) => distortion.treatment(),
            Self::Torque { torque, .. } if torque.begin(1.0) == [0.0; 2] => Treatment::Inverted,
            Self::Torque { .. } => Treatment::Integrated,
        }
    }
}

impl std::fmt::Debug for Action {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Torque { .. } => "Torque",
            Self::Factor(_) => "Factor",
            Self::Stiffness(_) => "Stiffness",
            Self::Body { .. } => "Body",
            Self::Feedthrough(_) => "Feedthrough",
            Self::Recorder { .. } => "Recorder",
            Self::Distortion(_) => "Distortion",
            Self::Lines(_) => "Lines",
            Self::Spikes(_) => "Spikes",
            Self::Course(_) => "Course",
        })
    }
}
