//! Table of the kinds of quantity: name, example, accepted dimensions, print units.

use std::f64::consts::TAU;

use super::dimension::Dimension;
use super::kind::Kind;
use super::symbols::{FAHRENHEIT, FAHRENHEIT_ZERO, FOOT, INCH, POUND, POUND_FORCE, PSI, SLUG};

/// A unit for printing results.
#[derive(Debug)]
pub(super) struct PrintUnit {
    pub(super) text: &'static str,
    /// SI units of the kind per print unit.
    pub(super) factor: f64,
    /// SI value at zero of the print unit; 0 except for a temperature scale.
    pub(super) zero: f64,
}

/// Row of the table for one kind.
#[derive(Debug)]
pub(super) struct KindRow {
    pub(super) kind: Kind,
    pub(super) name: &'static str,
    pub(super) example: &'static str,
    /// Accepted dimensions, each with the SI units of the kind per SI unit of the dimension. The
    /// first is that of the SI print unit.
    pub(super) accepts: &'static [(Dimension, f64)],
    pub(super) si: PrintUnit,
    pub(super) us: PrintUnit,
}

const fn dimension(exponents: [i32; 6]) -> Dimension {
    Dimension::new(exponents)
}

const fn print(text: &'static str, factor: f64) -> PrintUnit {
    PrintUnit {
        text,
        factor,
        zero: 0.0,
    }
}

const fn row(
    kind: Kind,
    name: &'static str,
    example: &'static str,
    accepts: &'static [(Dimension, f64)],
    si: &'static str,
    us: PrintUnit,
) -> KindRow {
    KindRow {
        kind,
        name,
        example,
        accepts,
        si: print(si, 1.0),
        us,
    }
}

/// Foot pound-force in N m.
const FOOT_POUND: f64 = FOOT * POUND_FORCE;

// Exponents: kg, m, s, A, K, rad.
const NUMBER: &[(Dimension, f64)] = &[(Dimension::NONE, 1.0)];
const INERTIA: &[(Dimension, f64)] = &[
    (dimension([1, 2, 0, 0, 0, 0]), 1.0),
    // ft lbf s²/rad: torque per angular acceleration.
    (dimension([1, 2, 0, 0, 0, -1]), 1.0),
];
const DAMPING: &[(Dimension, f64)] = &[
    (dimension([1, 2, -1, 0, 0, -1]), 1.0),
    (dimension([1, 2, -1, 0, 0, 0]), 1.0),
];
const STIFFNESS: &[(Dimension, f64)] = &[(dimension([1, 2, -2, 0, 0, -1]), 1.0)];
const TORQUE: &[(Dimension, f64)] = &[(Dimension::TORQUE, 1.0)];
const FORCE: &[(Dimension, f64)] = &[(Dimension::FORCE, 1.0)];
const LENGTH: &[(Dimension, f64)] = &[(dimension([0, 1, 0, 0, 0, 0]), 1.0)];
const AREA: &[(Dimension, f64)] = &[(dimension([0, 2, 0, 0, 0, 0]), 1.0)];
const SECOND_MOMENT: &[(Dimension, f64)] = &[(dimension([0, 4, 0, 0, 0, 0]), 1.0)];
const PRESSURE: &[(Dimension, f64)] = &[(dimension([1, -1, -2, 0, 0, 0]), 1.0)];
const MASS: &[(Dimension, f64)] = &[(Dimension::MASS, 1.0)];
const FREQUENCY: &[(Dimension, f64)] = &[
    // Plain 1/s, as in samples/s, counts events and so hertz.
    (dimension([0, 0, -1, 0, 0, 0]), 1.0),
    (dimension([0, 0, -1, 0, 0, 1]), 1.0 / TAU),
];
const SPEED: &[(Dimension, f64)] = &[(dimension([0, 0, -1, 0, 0, 1]), 1.0)];
const ANGULAR_ACCELERATION: &[(Dimension, f64)] = &[(dimension([0, 0, -2, 0, 0, 1]), 1.0)];
const ANGLE: &[(Dimension, f64)] = &[(dimension([0, 0, 0, 0, 0, 1]), 1.0)];
const TIME: &[(Dimension, f64)] = &[(Dimension::TIME, 1.0)];
const RATE: &[(Dimension, f64)] = &[(dimension([0, 0, -1, 0, 0, 0]), 1.0)];
const VOLTAGE: &[(Dimension, f64)] = &[(Dimension::VOLTAGE, 1.0)];
const CURRENT: &[(Dimension, f64)] = &[(Dimension::CURRENT, 1.0)];
const RESISTANCE: &[(Dimension, f64)] = &[(dimension([1, 2, -3, -2, 0, 0]), 1.0)];
const TORQUE_PER_VOLT: &[(Dimension, f64)] = &[(dimension([0, 0, 1, 1, 0, 0]), 1.0)];
const FORCE_PER_SPEED: &[(Dimension, f64)] = &[
    (dimension([1, 1, -1, 0, 0, -1]), 1.0),
    (dimension([1, 1, -1, 0, 0, 0]), 1.0),
];
const FORCE_PER_LENGTH: &[(Dimension, f64)] = &[(dimension([1, 0, -2, 0, 0, 0]), 1.0)];
const ACCELERATION: &[(Dimension, f64)] = &[(dimension([0, 1, -2, 0, 0, 0]), 1.0)];
const TEMPERATURE: &[(Dimension, f64)] = &[(dimension([0, 0, 0, 0, 1, 0]), 1.0)];
const PER_KELVIN: &[(Dimension, f64)] = &[(dimension([0, 0, 0, 0, -1, 0]), 1.0)];

/// One row per kind, in the order of [`Kind`].
#[rustfmt::skip]
pub(super) const ROWS: [KindRow; 32] = [
    row(Kind::Inertia, "mass moment of inertia", "0.008 kg m^2", INERTIA,
        "kg m^2", print("slug ft^2", SLUG * FOOT * FOOT)),
    row(Kind::AngularDamping, "angular damping", "4.2 N m s/rad", DAMPING,
        "N m s/rad", print("ft lbf s/rad", FOOT_POUND)),
    row(Kind::AngularStiffness, "angular stiffness", "1.1e5 N m/rad", STIFFNESS,
        "N m/rad", print("ft lbf/rad", FOOT_POUND)),
    row(Kind::Torque, "torque", "50 N m", TORQUE,
        "N m", print("ft lbf", FOOT_POUND)),
    row(Kind::Force, "force", "70 N", FORCE,
        "N", print("lbf", POUND_FORCE)),
    row(Kind::Length, "length", "12 mm", LENGTH,
        "m", print("in", INCH)),
    row(Kind::Area, "area", "160 mm^2", AREA,
        "m^2", print("in^2", INCH * INCH)),
    row(Kind::SecondMoment, "second moment of area", "2000 mm^4", SECOND_MOMENT,
        "m^4", print("in^4", INCH * INCH * INCH * INCH)),
    row(Kind::Pressure, "pressure or elastic modulus", "200 GPa", PRESSURE,
        "Pa", print("psi", PSI)),
    row(Kind::Mass, "mass", "2 kg", MASS,
        "kg", print("lbm", POUND)),
    row(Kind::Frequency, "frequency", "590 Hz", FREQUENCY,
        "Hz", print("Hz", 1.0)),
    row(Kind::AngularSpeed, "angular speed", "3700 rad/s", SPEED,
        "rad/s", print("rad/s", 1.0)),
    row(Kind::AngularAcceleration, "angular acceleration", "0.88 rad/s^2", ANGULAR_ACCELERATION,
        "rad/s^2", print("rad/s^2", 1.0)),
    row(Kind::Angle, "angle", "90 deg", ANGLE,
        "rad", print("rad", 1.0)),
    row(Kind::Time, "time", "1.7 ms", TIME,
        "s", print("s", 1.0)),
    row(Kind::DecayRate, "decay rate", "262 1/s", RATE,
        "1/s", print("1/s", 1.0)),
    row(Kind::Voltage, "voltage", "22.5 V", VOLTAGE,
        "V", print("V", 1.0)),
    row(Kind::Current, "current", "5 mA", CURRENT,
        "A", print("A", 1.0)),
    row(Kind::Resistance, "resistance", "350 ohm", RESISTANCE,
        "ohm", print("ohm", 1.0)),
    row(Kind::TorquePerVolt, "torque per volt", "12.5 N m/V", TORQUE_PER_VOLT,
        "N m/V", print("ft lbf/V", FOOT_POUND)),
    row(Kind::TorquePerRatio, "torque per ratio of voltages", "25 N m/(mV/V)", TORQUE,
        "N m/(V/V)", print("ft lbf/(V/V)", FOOT_POUND)),
    row(Kind::ForcePerAngularSpeed, "force per angular speed", "1.7e-3 N s/rad", FORCE_PER_SPEED,
        "N s/rad", print("lbf s/rad", POUND_FORCE)),
    row(Kind::LinearStiffness, "linear stiffness", "2.5e7 N/m", FORCE_PER_LENGTH,
        "N/m", print("lbf/in", POUND_FORCE / INCH)),
    row(Kind::Acceleration, "acceleration", "9.81 m/s^2", ACCELERATION,
        "m/s^2", print("ft/s^2", FOOT)),
    row(Kind::Strain, "strain", "50 ustrain", NUMBER,
        "m/m", print("in/in", 1.0)),
    row(Kind::VoltageRatio, "ratio of voltages", "2 mV/V", NUMBER,
        "V/V", print("V/V", 1.0)),
    row(Kind::Ratio, "ratio", "0.07", NUMBER,
        "1", print("1", 1.0)),
    row(Kind::Gain, "gain", "1 V/V", NUMBER,
        "1", print("1", 1.0)),
    KindRow {
        us: PrintUnit { text: "degF", factor: FAHRENHEIT, zero: FAHRENHEIT_ZERO },
        ..row(Kind::TemperatureAbsolute, "temperature", "25 degC", TEMPERATURE,
            "K", print("degF", FAHRENHEIT))
    },
    row(Kind::TemperatureDifference, "temperature difference", "5 K", TEMPERATURE,
        "K", print("degF", FAHRENHEIT)),
    row(Kind::ThermalExpansion, "thermal expansion", "12 ppm/K", PER_KELVIN,
        "1/K", print("1/degF", 1.0 / FAHRENHEIT)),
    row(Kind::TemperatureCoefficient, "temperature coefficient", "0.4 %/K", PER_KELVIN,
        "1/K", print("1/degF", 1.0 / FAHRENHEIT)),
];

// `Kind as usize` is the table index; a misplaced row does not compile.
const _: () = {
    let mut i = 0;
    while i < ROWS.len() {
        assert!(ROWS[i].kind as usize == i);
        i += 1;
    }
};
