//! Kinds of quantity: which units are accepted, and which are printed.

use std::f64::consts::LN_10;

use super::dimension::Dimension;
use super::error::QuantityError;
use super::grammar;
use super::kind_table::{KindRow, PrintUnit, ROWS};
use super::unit::{RatioOf, Unit};

/// Unit system of printed results. All computation is in SI.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum UnitSystem {
    /// SI units.
    #[default]
    Si,
    /// US customary units: lbf, ft, in, slug, psi, °F.
    Us,
}

/// A physical kind of quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Kind {
    /// Mass moment of inertia, kg m² (or N m s²/rad).
    Inertia,
    /// Viscous torque per angular speed, N m s/rad (or N m s).
    AngularDamping,
    /// Torque per angle, N m/rad.
    AngularStiffness,
    /// Torque, N m.
    Torque,
    /// Force, N.
    Force,
    /// Length, m.
    Length,
    /// Area, m².
    Area,
    /// Second moment of area, m⁴.
    SecondMoment,
    /// Pressure, stress or modulus, Pa.
    Pressure,
    /// Mass, kg. The only kind that accepts `lb`.
    Mass,
    /// Cycles or samples per second, Hz. `rad/s` converts by 1/2π, `rpm` by 1/60.
    Frequency,
    /// Angle per time, rad/s. `Hz` converts by 2π, `rpm` by 2π/60.
    AngularSpeed,
    /// Angular speed per time, rad/s².
    AngularAcceleration,
    /// Angle, rad.
    Angle,
    /// Time, s.
    Time,
    /// Rate of an exponential decay, 1/s.
    DecayRate,
    /// Voltage, V.
    Voltage,
    /// Current, A.
    Current,
    /// Resistance, Ω.
    Resistance,
    /// Torque per output voltage, N m/V.
    TorquePerVolt,
    /// Torque per bridge output over excitation, N m/(V/V).
    TorquePerRatio,
    /// Friction force per angular speed, N s/rad (or N s).
    ForcePerAngularSpeed,
    /// Force per deflection, N/m.
    LinearStiffness,
    /// Acceleration, m/s².
    Acceleration,
    /// Strain, m/m. A bare number is rejected, as it could mean strain or microstrain.
    Strain,
    /// Output of a bridge over its excitation, V/V.
    VoltageRatio,
    /// Pure number, such as a damping ratio. The unit may be omitted.
    Ratio,
    /// Output per input of the same kind, such as V/V. The unit may be omitted.
    Gain,
    /// Temperature on an absolute scale, K; °C and °F are converted with their zero.
    TemperatureAbsolute,
    /// Difference of temperatures, K; °C and °F are converted by the size of the degree.
    TemperatureDifference,
    /// Strain per temperature difference, 1/K.
    ThermalExpansion,
    /// Relative change per temperature difference, 1/K.
    TemperatureCoefficient,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; ROWS.len()] = {
        let mut all = [Self::Inertia; ROWS.len()];
        let mut i = 0;
        while i < all.len() {
            all[i] = ROWS[i].kind;
            i += 1;
        }
        all
    };

    fn row(self) -> &'static KindRow {
        const TABLE: &[KindRow] = &ROWS;
        &TABLE[self as usize]
    }

    fn print_unit(self, system: UnitSystem) -> &'static PrintUnit {
        match system {
            UnitSystem::Si => &self.row().si,
            UnitSystem::Us => &self.row().us,
        }
    }

    /// Name for messages, such as `angular stiffness`.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// A text that [`Kind::parse`] accepts, for messages.
    pub fn example(self) -> &'static str {
        self.row().example
    }

    /// Unit of printed results of this kind.
    ///
    /// ```
    /// use torqcomp_model::{Kind, UnitSystem};
    /// assert_eq!(Kind::Inertia.unit(UnitSystem::Us), "slug ft^2");
    /// ```
    pub fn unit(self, system: UnitSystem) -> &'static str {
        self.print_unit(system).text
    }

    /// A value in SI units as a number in the unit of [`Kind::unit`].
    ///
    /// ```
    /// use torqcomp_model::{Kind, UnitSystem};
    /// // 300 K = 26.85 °C = 80.33 °F.
    /// let got = Kind::TemperatureAbsolute.to(UnitSystem::Us, 300.0);
    /// assert!((got - 80.33).abs() < 1e-9);
    /// ```
    pub fn to(self, system: UnitSystem, si_value: f64) -> f64 {
        let unit = self.print_unit(system);
        (si_value - unit.zero) / unit.factor
    }

    /// A difference or uncertainty in SI units as a number in the unit of [`Kind::unit`].
    ///
    /// Differs from [`Kind::to`] for an absolute temperature, where the zero of the scale cancels
    /// in a difference.
    ///
    /// ```
    /// use torqcomp_model::{Kind, UnitSystem};
    /// // 5 K are 9 °F.
    /// let got = Kind::TemperatureAbsolute.difference_to(UnitSystem::Us, 5.0);
    /// assert!((got - 9.0).abs() < 1e-12);
    /// ```
    pub fn difference_to(self, system: UnitSystem, si_difference: f64) -> f64 {
        si_difference / self.print_unit(system).factor
    }

    /// Parses a number with its unit into the SI unit of this kind.
    ///
    /// # Errors
    /// [`QuantityError`] if the number cannot be read or is not finite, its unit is missing,
    /// unknown or of another kind, or a temperature is below absolute zero.
    ///
    /// ```
    /// use torqcomp_model::Kind;
    /// // 12 in lbf = 1 ft lbf = 1.355817948 N m.
    /// assert!((Kind::Torque.parse("12 in lbf")? - 1.355817948).abs() < 1e-9);
    /// // 1 N m over one turn a minute: 60/2π = 9.5493 N m s/rad.
    /// assert!((Kind::AngularDamping.parse("1 N m/(1/min)")? - 9.549297).abs() < 1e-6);
    /// assert!(Kind::AngularDamping.parse("1 N m min").is_err());
    /// // 3700 rad/s are 3700/2π = 588.873 Hz.
    /// assert!((Kind::Frequency.parse("3700 rad/s")? - 588.873).abs() < 1e-3);
    /// assert!(Kind::AngularStiffness.parse("8.1e4").is_err());
    /// // A gain of 40 dB is 10^(40/20) = 100.
    /// assert_eq!(Kind::Gain.parse("40 dB")?, 100.0);
    /// # Ok::<(), torqcomp_model::QuantityError>(())
    /// ```
    pub fn parse(self, text: &str) -> Result<f64, QuantityError> {
        let (number, unit) = self.split(text)?;
        if self.is_decibel(unit) {
            return finite(text, 10_f64.powf(number / 20.0));
        }
        let scale = match self.scale(text, unit) {
            Err(QuantityError::WrongDimension { .. })
                if CONSTANTS.contains(&self) && self.is_inverse(number, unit) =>
            {
                return Err(self.inverted(text, number, unit));
            }
            scale => scale?,
        };
        let value = finite(text, number * scale.factor + scale.zero)?;
        if self == Self::TemperatureAbsolute && value < 0.0 {
            return Err(QuantityError::BelowAbsoluteZero {
                text: text.to_owned(),
                kelvin: value,
            });
        }
        Ok(value)
    }

    /// Parses a standard uncertainty of a quantity of this kind into the SI unit of this kind.
    ///
    /// Like [`Kind::parse`], but rejects a negative number and treats a degree as a difference. Percent means percent
    /// of the value, `of`; for a ratio, which may itself be given in percent, percent is accepted only if the value is
    /// in percent, too.
    ///
    /// # Errors
    /// As for [`Kind::parse`], [`QuantityError::NegativeUncertainty`] and [`QuantityError::AmbiguousPercent`].
    ///
    /// ```
    /// use torqcomp_model::Kind;
    /// // ± 9 °F are ± 5 K.
    /// assert!((Kind::TemperatureAbsolute.parse_std("9 degF", "80 degF")? - 5.0).abs() < 1e-12);
    /// // 0.5 % of 12 kN are 60 N.
    /// assert!((Kind::Force.parse_std("0.5 %", "12 kN")? - 60.0).abs() < 1e-9);
    /// // Of a damping ratio of 0.07: 0.0014 or 0.02?
    /// assert!(Kind::Ratio.parse_std("2 %", "0.07").is_err());
    /// assert!((Kind::Ratio.parse_std("2 %", "7 %")? - 0.02).abs() < 1e-15);
    /// // 0.1 dB of a gain of 100 are 100·0.1·ln 10/20 = 1.1513.
    /// assert!((Kind::Gain.parse_std("0.1 dB", "40 dB")? - 1.1513).abs() < 1e-4);
    /// # Ok::<(), torqcomp_model::QuantityError>(())
    /// ```
    pub fn parse_std(self, text: &str, of: &str) -> Result<f64, QuantityError> {
        let (number, unit) = self.split(text)?;
        if number < 0.0 {
            return Err(QuantityError::NegativeUncertainty {
                got: text.trim().to_owned(),
            });
        }
        if self.is_decibel(unit) {
            return finite(text, self.parse(of)?.abs() * number * LN_10 / 20.0);
        }
        let is_ratio = self.scale(text, "%").is_ok();
        if unit != "%" || is_ratio && of.contains('%') || self == Self::TemperatureAbsolute {
            return finite(text, number * self.scale(text, unit)?.factor);
        }
        let relative = number / 100.0;
        let std = relative * self.parse(of)?.abs();
        if is_ratio {
            return Err(QuantityError::AmbiguousPercent {
                text: text.trim().to_owned(),
                of: of.trim().to_owned(),
                relative: std,
                absolute: relative,
            });
        }
        finite(text, std)
    }

    /// SI units of this kind per unit of the text, for whole columns of numbers.
    ///
    /// For a temperature scale this is the size of its degree.
    ///
    /// # Errors
    /// [`QuantityError`] if the unit is unknown, malformed or of another kind.
    ///
    /// ```
    /// use torqcomp_model::Kind;
    /// assert_eq!(Kind::Voltage.si_factor("mV")?, 1e-3);
    /// assert!(Kind::Voltage.si_factor("N m").is_err());
    /// # Ok::<(), torqcomp_model::QuantityError>(())
    /// ```
    pub fn si_factor(self, unit: &str) -> Result<f64, QuantityError> {
        Ok(self.scale(unit, unit.trim())?.factor)
    }

    /// Whether the unit is the decibel, 20 times the decimal logarithm of a gain.
    fn is_decibel(self, unit_text: &str) -> bool {
        self == Self::Gain && unit_text.eq_ignore_ascii_case("dB")
    }

    /// Splits text into number and unit.
    fn split(self, text: &str) -> Result<(f64, &str), QuantityError> {
        let trimmed = text.trim();
        if trimmed.is_empty() {
            return Err(QuantityError::Empty {
                expected: self.name(),
                example: self.example(),
            });
        }
        let bad = || QuantityError::NotANumber {
            text: text.to_owned(),
            example: self.example(),
        };
        let (number, unit) = trimmed.split_at(number_length(trimmed));
        if names_non_finite(trimmed) {
            return Err(QuantityError::NotFinite {
                text: text.to_owned(),
            });
        }
        let number: f64 = number.parse().map_err(|_| bad())?;
        if unit.starts_with([',', '\'', '_', '.']) {
            return Err(bad());
        }
        Ok((finite(text, number)?, unit.trim_start()))
    }

    /// Rejects a minute in a damping that may count turns or radians.
    fn refuse_bare_minute(self, unit_text: &str) -> Result<(), QuantityError> {
        if self != Self::AngularDamping || !grammar::has_bare_minute(unit_text) {
            return Ok(());
        }
        Err(QuantityError::UnitSyntax {
            unit: unit_text.to_owned(),
            problem: "a minute may count turns or radians; write \"N m/rpm\" for a torque over turns a minute, or \
                      \"N m s/rad\"",
        })
    }

    /// Factor and zero offset from a unit to the SI unit of this kind.
    fn scale(self, text: &str, unit_text: &str) -> Result<Scale, QuantityError> {
        if unit_text.is_empty() && !matches!(self, Self::Ratio | Self::Gain) {
            return Err(QuantityError::MissingUnit {
                text: text.trim().to_owned(),
                expected: self.name(),
                example: self.example(),
            });
        }
        let unit = Unit::parse(unit_text)?;
        self.refuse_bare_minute(unit_text)?;
        let accepts = self.row().accepts;
        let fits = |unit: &Unit| accepts.iter().find(|(d, _)| *d == unit.dimension());
        if self != Self::Mass
            && let Some([force, mass]) = grammar::readings_of_weight(unit_text)
            && (unit.has_bare_weight() || Unit::parse(&force).is_ok_and(|u| fits(&u).is_some()))
            && fits(&unit).is_none_or(|_| unit.has_bare_weight())
        {
            return Err(QuantityError::AmbiguousWeight {
                unit: unit_text.to_owned(),
                force,
                mass,
            });
        }
        let Some((_, factor)) = fits(&unit) else {
            return Err(QuantityError::WrongDimension {
                unit: unit_text.to_owned(),
                got: unit.dimension(),
                expected: self.name(),
                wanted: accepts[0].0,
                example: self.example(),
            });
        };
        let is_other_ratio = match self {
            Self::Strain => unit.ratio_of() == Some(RatioOf::Voltages),
            // A ratio of voltages cancels: only its symbols distinguish it from a torque.
            Self::TorquePerRatio | Self::VoltageRatio => !unit.has_voltage(),
            Self::Torque => unit.has_voltage(),
            _ => false,
        };
        if is_other_ratio {
            return Err(QuantityError::WrongRatio {
                unit: unit_text.to_owned(),
                expected: self.name(),
                example: self.example(),
            });
        }
        let zero = if self == Self::TemperatureAbsolute {
            unit.zero()
        } else {
            0.0
        };
        Ok(Scale {
            factor: unit.factor() * factor,
            zero,
        })
    }
}

/// Kinds that data sheets also give as reciprocals.
const CONSTANTS: [Kind; 4] = [
    Kind::TorquePerVolt,
    Kind::TorquePerRatio,
    Kind::AngularStiffness,
    Kind::LinearStiffness,
];

impl Kind {
    /// Whether a number in this unit is the reciprocal of a quantity of this kind.
    fn is_inverse(self, number: f64, unit_text: &str) -> bool {
        let wanted = self.row().accepts[0].0;
        let is = |unit: Unit| unit.dimension() == wanted.power(-1);
        number != 0.0 && wanted != Dimension::NONE && Unit::parse(unit_text).is_ok_and(is)
    }

    /// The error for a number in the reciprocal unit, with the corrected number.
    fn inverted(self, text: &str, number: f64, unit_text: &str) -> QuantityError {
        let factor = Unit::parse(unit_text).map_or(1.0, |unit| unit.factor());
        let value = self.to(UnitSystem::Si, 1.0 / (number * factor));
        // Six digits, without trailing zeros.
        let short: f64 = format!("{value:.5e}").parse().unwrap_or(value);
        QuantityError::Inverted {
            text: text.trim().to_owned(),
            expected: self.name(),
            right: format!("{short} {}", self.unit(UnitSystem::Si)),
        }
    }
}

struct Scale {
    factor: f64,
    zero: f64,
}

fn finite(text: &str, value: f64) -> Result<f64, QuantityError> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(QuantityError::NotFinite {
            text: text.trim().to_owned(),
        })
    }
}

/// Length of the leading decimal number: `[+-] digits [. digits] [e [+-] digits]`.
pub(super) fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits_from = |start: usize| {
        start
            + bytes[start..]
                .iter()
                .take_while(|byte| byte.is_ascii_digit())
                .count()
    };
    let mut end = digits_from(usize::from(text.starts_with(['+', '-'])));
    if bytes.get(end) == Some(&b'.') {
        end = digits_from(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits_from((end + 1 + sign).min(bytes.len()));
        // An `e` without digits belongs to the unit.
        if exponent > end + 1 + sign {
            end = exponent;
        }
    }
    end
}

/// Whether a text is a float spelling of infinity or NaN.
fn names_non_finite(text: &str) -> bool {
    let first = text.split_whitespace().next().unwrap_or_default();
    first.parse::<f64>().is_ok_and(|number| !number.is_finite())
}
