//! What an effect does, ready to be applied.

use num_complex::Complex64;

use crate::mode::Mode;

/// A function of the plain mode and the angular frequency.
pub type Frequency = Box<dyn Fn(&Mode, f64) -> Complex64 + Send + Sync>;

/// A change of recorded samples in place.
pub type Transform = Box<dyn Fn(Clock, &mut [f64]) + Send + Sync>;

/// Times of samples since their record began: what drifts begins anew with each record, whatever its time stamps say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// Time between samples in s.
    pub step_s: f64,
}

impl Clock {
    /// Time of a sample in s.
    #[must_use]
    pub fn time_s(&self, index: usize) -> f64 {
        index as f64 * self.step_s
    }
}

/// A steady line, independent of what is applied; its phase belongs to the record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Frequency in Hz.
    pub frequency_hz: f64,
    /// Amplitude in units of the record.
    pub amplitude: f64,
}

impl Line {
    /// A frequency in Hz, then the amplitudes of it and of its orders 2, 3, …
    #[must_use]
    pub fn orders(p: &[f64]) -> Vec<Self> {
        let line = |order: usize| Self {
            frequency_hz: order as f64 * p[0],
            amplitude: p[order],
        };
        (1..p.len()).map(line).collect()
    }
}

/// What an effect does.
pub enum Action {
    /// A torque in the stand; if `shown`, the gage shows it together with `x`.
    Torque {
        /// The torque.
        torque: Box<dyn Torque>,
        /// Whether the gage shows it: it then bends the part that the gage sits on.
        shown: bool,
    },
    /// A factor of the response.
    Factor(Frequency),
    /// A term of the response, past the stand: recorded at once what is applied.
    Feedthrough(Frequency),
    /// A change of the recorded samples.
    Transform {
        /// The change.
        apply: Transform,
        /// What takes it back, if it can be.
        undo: Option<Transform>,
    },
    /// Lines added.
    Lines(Vec<Line>),
    /// A slow course added, that belongs to the record: as many half waves over its length as it may have.
    Course(usize),
}

/// What a torque remembers from node to node.
pub type Memory = [f64; 2];

/// A torque `n(x, x', z)` in units of the record, in `x'' + 2ζω₀ x' + ω₀² (x + n) = ω₀² G u`.
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

    /// The size of a sharp dry friction: the integration then looks for the moments in which it switches and does not
    /// call [`Torque::kick`].
    fn dry(&self) -> Option<f64> {
        None
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
            shown: false,
        }
    }

    /// A torque that the gage shows.
    #[must_use]
    pub fn shown(torque: impl Torque + 'static) -> Self {
        Self::Torque {
            torque: Box::new(torque),
            shown: true,
        }
    }
}

impl std::fmt::Debug for Action {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Torque { .. } => "Torque",
            Self::Factor(_) => "Factor",
            Self::Feedthrough(_) => "Feedthrough",
            Self::Transform { .. } => "Transform",
            Self::Lines(_) => "Lines",
            Self::Course(_) => "Course",
        })
    }
}
