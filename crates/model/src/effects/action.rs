//! What an effect does, forwards to the record and back to what was applied.

use std::sync::Arc;

use num_complex::Complex64;

use super::lines::SpectralLine;
use crate::modal::ModalResponse;

/// A function of the plain stand and the angular frequency in rad/s.
pub type Frequency = Box<dyn Fn(&ModalResponse, f64) -> Complex64 + Send + Sync>;

/// A response that is known and not fitted, such as that of the recorder: of the frequency in Hz.
pub type Fixed = Arc<dyn Fn(f64) -> Complex64 + Send + Sync>;

/// Times of samples since their record began: what drifts begins anew with each record, whatever its time stamps say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleClock {
    /// Time between samples in s.
    pub step_s: f64,
}

impl SampleClock {
    /// Time of a sample in s.
    #[must_use]
    pub fn time_s(&self, index: usize) -> f64 {
        index as f64 * self.step_s
    }
}

/// What an effect does.
pub enum Action {
    /// A torque in the stand; in the gage's path, the gage shows it together with `x`.
    Torque {
        /// The torque.
        torque: Box<dyn Torque>,
        /// Whether it bends the part that the gage sits on.
        in_gage_path: bool,
    },
    /// A factor of the response.
    Factor(Frequency),
    /// A term of the response, past the stand: recorded at once what is applied.
    Feedthrough(Frequency),
    /// The recorder as far as it is known, a factor of the response.
    Recorder {
        /// Its response.
        response: Fixed,
        /// Whether it changes nothing.
        is_ideal: bool,
    },
    /// A change of the recorded samples.
    Distortion(Box<dyn Distortion>),
    /// Lines added.
    Lines(Vec<SpectralLine>),
    /// A slow course added, that belongs to the record: as many half waves over its length as it may have.
    Course(usize),
}

/// What a compensation does about an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Treatment {
    /// The spectrum is divided by its response.
    DividedOut,
    /// It is estimated and subtracted.
    Subtracted,
    /// Its equation is solved.
    Inverted,
    /// Its torque is integrated along the measured motion.
    Integrated,
    /// The samples that it spoils are marked.
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

/// Samples that do not determine what was there before a distortion.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Unrecovered {
    /// What it is about them.
    pub why: String,
    /// Their indices, in order.
    pub samples: Vec<usize>,
}

/// A change of the recorded samples in place, both ways.
pub trait Distortion: Send + Sync {
    /// Applies it.
    fn forward(&self, clock: SampleClock, samples: &mut [f64]);

    /// Takes it back, in the presence of noise of that standard deviation; the samples of which the record does not
    /// tell enough.
    fn inverse(&self, clock: SampleClock, noise_std: f64, samples: &mut [f64]) -> Unrecovered;

    /// What its inverse is.
    fn treatment(&self) -> Treatment {
        Treatment::Inverted
    }

    /// Whether it takes each sample by itself, without memory of others and whatever the time.
    fn is_pointwise(&self) -> bool {
        false
    }
}

/// What a torque remembers from node to node.
pub type Memory = [f64; 2];

/// A torque `n(x, x', z)` in units of the record, in `x'' + 2ζω₀ x' + ω₀² (x + n) = ω₀² G u`.
///
/// The way back evaluates it along the measured motion: [`Torque::blurred`], and in the gage's path
/// [`Torque::hidden`].
pub trait Torque: Send + Sync {
    /// The torque at a state; what is remembered moves on to it.
    fn value(&self, memory: &mut Memory, x: f64, speed: f64) -> f64;

    /// The mean torque where the speed is known up to a standard uncertainty only: what switches with the sign of
    /// the speed does so gradually.
    fn blurred(&self, memory: &mut Memory, x: f64, speed: f64, speed_std: f64) -> f64 {
        let _ = speed_std;
        self.value(memory, x, speed)
    }

    /// Half the range of `x` about zero in which a gage that shows `x + n` shows nothing.
    fn hidden(&self) -> f64 {
        0.0
    }

    /// The speed after the torque has acted for a short time, in which `x` stays:
    /// `impulse = ω₀² h`. `change` is what the speed changed by since the last node: a torque that
    /// switches with the sign of the speed does so somewhere in between.
    fn kick(&self, memory: &mut Memory, x: f64, speed: f64, change: f64, impulse: f64) -> f64 {
        let _ = change;
        speed - impulse * self.value(memory, x, speed)
    }

    /// Its stiffness at small displacements, relative to that of the plain stand, where it has one: a fit that begins
    /// with it takes it off the plain stand.
    fn stiffness(&self) -> f64 {
        0.0
    }

    /// The size of a sharp dry friction in it: the integration looks for the moments in which that switches. [`Torque::kick`]
    /// is then what the rest of the torque does, which is smooth and zero at rest.
    fn dry(&self) -> Option<f64> {
        None
    }

    /// Whether it switches with the direction of the motion: where that is unknown, so is the torque.
    fn switches(&self) -> bool {
        false
    }

    /// Whether the torque depends on where zero is: a constant load then matters.
    fn has_zero(&self) -> bool {
        false
    }

    /// What is remembered at the start.
    fn begin(&self, x: f64) -> Memory {
        let _ = x;
        [0.0; 2]
    }
}

impl Action {
    /// A torque beside what the gage shows.
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

    /// What a compensation does about it.
    #[must_use]
    pub fn treatment(&self) -> Treatment {
        match self {
            Self::Factor(_) | Self::Feedthrough(_) | Self::Recorder { .. } => Treatment::DividedOut,
            Self::Lines(_) | Self::Course(_) => Treatment::Subtracted,
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
            Self::Feedthrough(_) => "Feedthrough",
            Self::Recorder { .. } => "Recorder",
            Self::Distortion(_) => "Distortion",
            Self::Lines(_) => "Lines",
            Self::Course(_) => "Course",
        })
    }
}
