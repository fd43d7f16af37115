//! Kind of motion recorded by a channel.

use clap::ValueEnum;
use torqcomp_model::Dimension;

use crate::unit::NamedUnit;

/// What a motion channel measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Motion {
    /// Displacement, angle, strain, or torque of the beam
    Displacement,
    /// Speed
    Speed,
    /// Acceleration
    Acceleration,
}

/// Hint for a channel in `g`, if the unit is that.
pub(crate) fn gravity_hint(unit: &NamedUnit) -> Option<&'static str> {
    const HINT: &str = "g is gram here; for an acceleration in units of standard gravity write g0";
    (unit.text == "g").then_some(HINT)
}

impl Motion {
    /// All kinds of motion.
    pub(crate) const ALL: [Self; 3] = [Self::Displacement, Self::Speed, Self::Acceleration];

    /// Name in stand files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::Speed => "speed",
            Self::Acceleration => "acceleration",
        }
    }

    /// Order of the derivative of displacement.
    pub(crate) fn order(self) -> i32 {
        match self {
            Self::Displacement => 0,
            Self::Speed => 1,
            Self::Acceleration => 2,
        }
    }

    /// The motion with a unit of this dimension, and whether it is a rotation.
    pub(crate) fn of(dimension: Dimension) -> Option<(Self, bool)> {
        let found = Self::ALL
            .into_iter()
            .flat_map(|motion| [(motion, true), (motion, false)]);
        found.into_iter().find(|(motion, is_rotation)| {
            let (length, angle) = if *is_rotation { (0, 1) } else { (1, 0) };
            dimension == Dimension::new([0, length, -motion.order(), 0, 0, angle])
        })
    }
}
