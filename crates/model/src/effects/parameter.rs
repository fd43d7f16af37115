//! Parameters of effects: units, physical bounds, and the scales that make them dimensionless.

use std::f64::consts::TAU;

use crate::mode::Mode;

/// A parameter of an effect.
#[derive(Debug)]
pub struct EffectParameter {
    /// Its name in stand files and reports.
    pub name: &'static str,
    /// Its unit.
    pub unit: Unit,
    /// Its scale in a fit.
    pub scale: ParameterScale,
    /// Physical lower bound, in scales.
    pub lower: f64,
    /// Physical upper bound, in scales.
    pub upper: f64,
    /// Whether a fit uses the reciprocal, so that zero means no effect.
    pub reciprocal: bool,
    /// What it says of the history before a record.
    pub history: History,
    /// Whether the effect degenerates to another one where this is zero.
    pub essential: bool,
}

/// What an effect shows of the history before a record: an unknown part of the record, which belongs to it rather than the
/// stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum History {
    /// Nothing that lasts.
    Unseen,
    /// It decays, at a corner in Hz.
    Fades,
    /// It relaxes at all rates, far more slowly than the stand rings.
    Lingers,
    /// It rings, with a natural frequency in Hz and the damping ratio that is the next parameter.
    Rings,
    /// It rings in both modes of the stand coupled to an inertia, with that inertia's frequency in Hz, the damping ratio
    /// that is the next parameter, and the inertia ratio that is the third.
    RingsCoupled,
}

/// Unit of a parameter: recorded unit to a power, seconds to a power; or hertz.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Dimensionless.
    Number,
    /// Hertz.
    Hertz,
    /// Powers of the recorded unit and of the second.
    Powers {
        /// Power of the recorded unit.
        recorded: i32,
        /// Power of the second.
        second: i32,
    },
}

/// How a parameter is made dimensionless, with values near one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterScale {
    /// Recorded units by the rms of the record, times by `1/ω₀`, frequencies by `f₀`.
    Motion,
    /// Recorded units by the largest recorded magnitude, times by `1/ω₀`.
    Peak,
    /// Recorded units by the rms of the record, times by the length of the record.
    Record,
    /// Unscaled.
    Absolute,
}

/// The scales of a set of records; fixed before any effect is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordScales {
    /// RMS of the record about its mean.
    pub rms: f64,
    /// Largest distance of the record from its mean.
    pub peak: f64,
    /// Natural frequency of the stand in Hz.
    pub natural_hz: f64,
    /// Length of a record in s.
    pub duration_s: f64,
}

impl EffectParameter {
    /// Whether a value has a sign that its bounds allow: a gap or a limit is not negative.
    #[must_use]
    pub fn allows_sign_of(&self, value: f64) -> bool {
        (self.lower < 0.0 || value >= 0.0) && (self.upper > 0.0 || value <= 0.0)
    }

    /// A dimensionless parameter.
    #[must_use]
    pub const fn number(name: &'static str, lower: f64, upper: f64) -> Self {
        Self {
            name,
            unit: Unit::Number,
            scale: ParameterScale::Absolute,
            lower,
            upper,
            reciprocal: false,
            history: History::Unseen,
            essential: false,
        }
    }

    /// A frequency, in units of the natural frequency.
    #[must_use]
    pub const fn frequency(name: &'static str, lower: f64, upper: f64) -> Self {
        Self {
            unit: Unit::Hertz,
            scale: ParameterScale::Motion,
            ..Self::number(name, lower, upper)
        }
    }

    /// Recorded unit to a power times second to a power, scaled with the motion.
    #[must_use]
    pub const fn motion(
        name: &'static str,
        recorded: i32,
        second: i32,
        lower: f64,
        upper: f64,
    ) -> Self {
        Self {
            unit: Unit::Powers { recorded, second },
            scale: ParameterScale::Motion,
            ..Self::number(name, lower, upper)
        }
    }

    /// A frequency that a fit varies as its reciprocal, in periods of the natural frequency, so that infinite
    /// frequencies are within reach.
    #[must_use]
    pub const fn corner(name: &'static str, lower: f64, upper: f64) -> Self {
        Self {
            reciprocal: true,
            ..Self::frequency(name, lower, upper)
        }
    }

    /// Sets what it says of the history before a record.
    #[must_use]
    pub const fn showing(self, history: History) -> Self {
        Self { history, ..self }
    }

    /// Modes in which the history before a record rings, from the stand's first mode and the values from this parameter
    /// on.
    #[must_use]
    pub fn ringing(&self, first: &Mode, values: &[f64]) -> Vec<Mode> {
        let own = || Mode {
            omega_rad_s: TAU * values[0],
            damping_ratio: values[1],
        };
        match self.history {
            History::Unseen | History::Fades | History::Lingers => Vec::new(),
            History::Rings => vec![own()],
            History::RingsCoupled => first.coupled_to(&own(), values[2]),
        }
    }

    /// Marks it as essential to the effect.
    #[must_use]
    pub const fn essential(self) -> Self {
        Self {
            essential: true,
            ..self
        }
    }

    /// Replaces the scale.
    #[must_use]
    pub const fn by(self, scale: ParameterScale) -> Self {
        Self { scale, ..self }
    }

    /// The value in its unit, from the scaled fit variable.
    #[must_use]
    pub fn value(&self, moved: f64, scales: &RecordScales) -> f64 {
        let size = self.size(scales);
        if self.reciprocal {
            size / moved
        } else {
            size * moved
        }
    }

    /// The scaled fit variable, from the value in its unit.
    ///
    /// ```
    /// use torqcomp_model::effects::{EffectParameter, RecordScales};
    /// let scales = RecordScales { rms: 2.0, peak: 5.0, natural_hz: 10.0, duration_s: 1.0 };
    /// // A corner at 40 Hz is moved as its reciprocal: 10 Hz / 40 Hz.
    /// assert_eq!(EffectParameter::corner("corner", 0.0, 1.0).moved(40.0, &scales), 0.25);
    /// assert_eq!(EffectParameter::frequency("line", 0.0, 9.0).moved(40.0, &scales), 4.0);
    /// ```
    #[must_use]
    pub fn moved(&self, value: f64, scales: &RecordScales) -> f64 {
        let size = self.size(scales);
        if self.reciprocal {
            size / value
        } else {
            value / size
        }
    }

    /// The standard uncertainty in its unit, from that of the fit variable.
    #[must_use]
    pub fn std(&self, moved: f64, std: f64, scales: &RecordScales) -> f64 {
        let size = self.size(scales);
        if self.reciprocal {
            size * std / (moved * moved)
        } else {
            size * std
        }
    }

    /// The parameter's scale in the parameter's unit.
    ///
    /// ```
    /// use torqcomp_model::effects::{EffectParameter, RecordScales};
    /// let scales = RecordScales { rms: 2.0, peak: 5.0, natural_hz: 10.0, duration_s: 1.0 };
    /// // A cubic coefficient, in 1/unit²: 1/2².
    /// assert_eq!(EffectParameter::motion("coefficient", -2, 0, 0.0, 1.0).size(&scales), 0.25);
    /// // A corner frequency: 10 Hz.
    /// assert_eq!(EffectParameter::frequency("corner", 0.0, 1.0).size(&scales), 10.0);
    /// ```
    #[must_use]
    pub fn size(&self, scales: &RecordScales) -> f64 {
        let natural_s = 1.0 / (std::f64::consts::TAU * scales.natural_hz);
        let (length, time_s, frequency_hz) = match self.scale {
            ParameterScale::Motion => (scales.rms, natural_s, scales.natural_hz),
            ParameterScale::Peak => (scales.peak, natural_s, scales.natural_hz),
            ParameterScale::Record => (scales.rms, scales.duration_s, 1.0 / scales.duration_s),
            ParameterScale::Absolute => (1.0, 1.0, 1.0),
        };
        match self.unit {
            Unit::Number => 1.0,
            Unit::Hertz => frequency_hz,
            Unit::Powers { recorded, second } => length.powi(recorded) * time_s.powi(second),
        }
    }
}

impl Unit {
    /// The unit as text, for a record in a given unit (empty if dimensionless).
    ///
    /// ```
    /// use torqcomp_model::effects::Unit;
    /// assert_eq!(Unit::Powers { recorded: -2, second: 0 }.text("N m"), "1/(N m)^2");
    /// assert_eq!(Unit::Powers { recorded: -1, second: 2 }.text("V"), "s^2/V");
    /// ```
    #[must_use]
    pub fn text(&self, recorded_unit: &str) -> String {
        let (recorded, second) = match self {
            Self::Number => return String::new(),
            Self::Hertz => return "Hz".to_owned(),
            Self::Powers { recorded, second } => (*recorded, *second),
        };
        let bracketed = if recorded_unit.contains([' ', '/', '*', '^']) {
            format!("({recorded_unit})")
        } else {
            recorded_unit.to_owned()
        };
        let part = |unit: &str, power: i32| match (unit.is_empty(), power) {
            (true, _) | (_, 0) => String::new(),
            (_, 1) => unit.to_owned(),
            _ => format!("{unit}^{power}"),
        };
        let join = |a: String, b: String| match (a.is_empty(), b.is_empty()) {
            (false, false) => format!("{a} {b}"),
            _ => a + &b,
        };
        let above = join(part(&bracketed, recorded.max(0)), part("s", second.max(0)));
        let below_recorded = part(&bracketed, (-recorded).max(0));
        let below_second = part("s", (-second).max(0));
        let both = !below_recorded.is_empty() && !below_second.is_empty();
        let below = join(below_recorded, below_second);
        match (above.is_empty(), below.is_empty()) {
            (_, true) => above,
            (true, false) if both => format!("1/({below})"),
            (true, false) => format!("1/{below}"),
            (false, false) if both => format!("{above}/({below})"),
            (false, false) => format!("{above}/{below}"),
        }
    }
}
