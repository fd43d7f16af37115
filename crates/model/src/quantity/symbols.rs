//! Table of units: names, factor to SI, dimension.
//!
//! Factors are exact by definition: the international inch (0.0254 m), the avoirdupois pound
//! (0.45359237 kg) and standard gravity (9.80665 m/s²), NIST SP 811 appendix B.

use std::f64::consts::{PI, TAU};

use super::dimension::Dimension;

/// Inch in m.
pub(super) const INCH: f64 = 0.0254;
/// Foot in m.
pub(super) const FOOT: f64 = 0.3048;
/// Pound (mass) in kg.
pub(super) const POUND: f64 = 0.45359237;
/// Pound-force in N: pound times standard gravity.
pub(super) const POUND_FORCE: f64 = 4.4482216152605;
/// Slug in kg: lbf s²/ft.
pub(super) const SLUG: f64 = POUND_FORCE / FOOT;
/// Pound-force per square inch in Pa.
pub(super) const PSI: f64 = POUND_FORCE / (INCH * INCH);
/// Standard acceleration of free fall in m/s².
const GRAVITY: f64 = 9.80665;
/// Kelvin per degree Fahrenheit.
pub(super) const FAHRENHEIT: f64 = 5.0 / 9.0;
/// 0 °C in K.
pub(super) const CELSIUS_ZERO: f64 = 273.15;
/// 0 °F in K.
pub(super) const FAHRENHEIT_ZERO: f64 = 459.67 * FAHRENHEIT;

/// One row of the table.
#[derive(Debug, PartialEq)]
pub(super) struct Symbol {
    /// Spellings that must match exactly, case included.
    pub(super) names: &'static [&'static str],
    /// Spellings of three letters or more that match in any case.
    pub(super) words: &'static [&'static str],
    /// SI units per unit.
    pub(super) factor: f64,
    /// Kelvin at the zero of a temperature scale; 0 for every other unit.
    pub(super) zero: f64,
    pub(super) dimension: Dimension,
}

impl Symbol {
    /// Whether it is a pound or an ounce that may be a mass or a force.
    pub(super) fn is_bare_weight(&self) -> bool {
        self.names.contains(&"lb") || self.names.contains(&"oz")
    }

    /// Whether it is strain or the ratio it stands for.
    pub(super) fn is_of_strain(&self) -> bool {
        self.dimension == LENGTH || self.words.iter().any(|word| word.ends_with("strain"))
    }

    /// Whether it is a unit of voltage.
    pub(super) fn is_voltage(&self) -> bool {
        self.dimension == VOLTAGE
    }

    /// Whether it is hertz, which counts cycles of a signal rather than turns of a shaft.
    pub(super) fn is_hertz(&self) -> bool {
        self.words.iter().any(|word| word.ends_with("hertz"))
    }
}

const NONE: Dimension = Dimension::NONE;
const LENGTH: Dimension = Dimension::new([0, 1, 0, 0, 0, 0]);
const MASS: Dimension = Dimension::MASS;
const TIME: Dimension = Dimension::TIME;
const ANGLE: Dimension = Dimension::new([0, 0, 0, 0, 0, 1]);
const SPEED: Dimension = Dimension::new([0, 0, -1, 0, 0, 1]);
const FORCE: Dimension = Dimension::FORCE;
const TORQUE: Dimension = Dimension::TORQUE;
const ANGULAR_MOMENTUM: Dimension = Dimension::new([1, 2, -1, 0, 0, 0]);
const PRESSURE: Dimension = Dimension::new([1, -1, -2, 0, 0, 0]);
const CURRENT: Dimension = Dimension::CURRENT;
const VOLTAGE: Dimension = Dimension::VOLTAGE;
const RESISTANCE: Dimension = Dimension::new([1, 2, -3, -2, 0, 0]);
const TEMPERATURE: Dimension = Dimension::new([0, 0, 0, 0, 1, 0]);
const ACCELERATION: Dimension = Dimension::new([0, 1, -2, 0, 0, 0]);

type Names = &'static [&'static str];

const fn unit(names: Names, words: Names, factor: f64, dimension: Dimension) -> Symbol {
    Symbol {
        names,
        words,
        factor,
        zero: 0.0,
        dimension,
    }
}

const fn temperature(names: Names, words: Names, factor: f64, zero: f64) -> Symbol {
    Symbol {
        names,
        words,
        factor,
        zero,
        dimension: TEMPERATURE,
    }
}

/// All units. The grammar replaces special characters before the lookup, so the micro sign is `u`,
/// the ohm sign `ohm`, the degree sign `deg` and ε `strain`.
pub(super) const SYMBOLS: &[Symbol] = &[
    // Pure numbers.
    unit(&["%"], &["percent"], 1e-2, NONE),
    unit(&[], &["ppm"], 1e-6, NONE),
    unit(&[], &["strain"], 1.0, NONE),
    unit(&["mstrain"], &["millistrain"], 1e-3, NONE),
    unit(&["ustrain"], &["microstrain"], 1e-6, NONE),
    unit(&["div"], &["division", "divisions"], 1.0, NONE),
    unit(&[], &["sample", "samples"], 1.0, NONE),
    // Length.
    unit(&["m"], &["meter", "meters", "metre", "metres"], 1.0, LENGTH),
    unit(
        &["mm"],
        &["millimeter", "millimeters", "millimetre", "millimetres"],
        1e-3,
        LENGTH,
    ),
    unit(
        &["cm"],
        &["centimeter", "centimeters", "centimetre", "centimetres"],
        1e-2,
        LENGTH,
    ),
    unit(
        &["um"],
        &["micrometer", "micrometers", "micrometre", "micrometres"],
        1e-6,
        LENGTH,
    ),
    unit(&["in"], &["inch", "inches"], INCH, LENGTH),
    unit(&["ft"], &["foot", "feet"], FOOT, LENGTH),
    // Mass.
    unit(&["kg"], &["kilogram", "kilograms"], 1.0, MASS),
    unit(&["g"], &["gram", "grams"], 1e-3, MASS),
    unit(&["mg"], &["milligram", "milligrams"], 1e-6, MASS),
    unit(&[], &["lbm", "pound-mass", "pounds-mass"], POUND, MASS),
    unit(&["lb", "lbs"], &["pound", "pounds"], POUND, MASS),
    unit(&["oz"], &["ounce", "ounces"], POUND / 16.0, MASS),
    unit(
        &[],
        &["ozm", "ounce-mass", "ounces-mass"],
        POUND / 16.0,
        MASS,
    ),
    unit(&[], &["slug", "slugs"], SLUG, MASS),
    // Force.
    unit(&["N"], &["newton", "newtons"], 1.0, FORCE),
    unit(&["uN"], &[], 1e-6, FORCE),
    unit(&["mN"], &["millinewton", "millinewtons"], 1e-3, FORCE),
    unit(&["kN"], &["kilonewton", "kilonewtons"], 1e3, FORCE),
    unit(&["MN"], &["meganewton", "meganewtons"], 1e6, FORCE),
    unit(
        &[],
        &["lbf", "pound-force", "pounds-force"],
        POUND_FORCE,
        FORCE,
    ),
    unit(
        &[],
        &["ozf", "ounce-force", "ounces-force"],
        POUND_FORCE / 16.0,
        FORCE,
    ),
    unit(&[], &["kip", "kips"], 1e3 * POUND_FORCE, FORCE),
    unit(
        &[],
        &["kgf", "kilogram-force", "kilograms-force", "kilopond"],
        GRAVITY,
        FORCE,
    ),
    unit(&["kp"], &[], GRAVITY, FORCE),
    unit(
        &["gf"],
        &["gram-force", "grams-force", "pond"],
        1e-3 * GRAVITY,
        FORCE,
    ),
    unit(&["cN"], &["centinewton", "centinewtons"], 1e-2, FORCE),
    unit(&["daN"], &["decanewton", "decanewtons"], 10.0, FORCE),
    unit(&["dyn"], &["dyne", "dynes"], 1e-5, FORCE),
    // Torque, written as one word.
    unit(&["Nm"], &[], 1.0, TORQUE),
    unit(&["uNm"], &[], 1e-6, TORQUE),
    unit(&["mNm", "Nmm"], &[], 1e-3, TORQUE),
    unit(&["Ncm", "cNm"], &[], 1e-2, TORQUE),
    unit(&["daNm"], &[], 10.0, TORQUE),
    unit(&["kgfm", "kpm"], &[], GRAVITY, TORQUE),
    unit(&["kgfcm", "kpcm"], &[], 1e-2 * GRAVITY, TORQUE),
    unit(&["gfcm"], &[], 1e-5 * GRAVITY, TORQUE),
    unit(&["dyncm"], &[], 1e-7, TORQUE),
    unit(&[], &["ftlbf", "lbfft"], FOOT * POUND_FORCE, TORQUE),
    unit(&[], &["inlbf", "lbfin"], INCH * POUND_FORCE, TORQUE),
    unit(&[], &["inozf", "ozfin"], INCH * POUND_FORCE / 16.0, TORQUE),
    unit(&["kNm"], &[], 1e3, TORQUE),
    unit(&["MNm"], &[], 1e6, TORQUE),
    // A torque times a time, for the damping.
    unit(&["Nms"], &[], 1.0, ANGULAR_MOMENTUM),
    unit(&["mNms", "Nmms"], &[], 1e-3, ANGULAR_MOMENTUM),
    // Time.
    unit(&["s"], &["sec", "second", "seconds"], 1.0, TIME),
    unit(
        &["ms"],
        &["msec", "millisecond", "milliseconds"],
        1e-3,
        TIME,
    ),
    unit(
        &["us"],
        &["usec", "microsecond", "microseconds"],
        1e-6,
        TIME,
    ),
    unit(&["ns"], &["nsec", "nanosecond", "nanoseconds"], 1e-9, TIME),
    unit(&[], &["min", "minute", "minutes"], 60.0, TIME),
    unit(&["h", "hr"], &["hour", "hours"], 3600.0, TIME),
    unit(&["d"], &["day", "days"], 86_400.0, TIME),
    // Angle and cycles: one cycle is 2π rad.
    unit(&[], &["rad", "radian", "radians"], 1.0, ANGLE),
    unit(&["mrad"], &["milliradian", "milliradians"], 1e-3, ANGLE),
    unit(&["urad"], &["microradian", "microradians"], 1e-6, ANGLE),
    unit(&[], &["deg", "degree", "degrees"], PI / 180.0, ANGLE),
    unit(
        &["mdeg"],
        &["millidegree", "millidegrees"],
        1e-3 * PI / 180.0,
        ANGLE,
    ),
    unit(&[], &["gon", "gradian", "gradians"], PI / 200.0, ANGLE),
    unit(
        &[],
        &["rev", "revolution", "revolutions", "cycle", "cycles"],
        TAU,
        ANGLE,
    ),
    unit(&["Hz", "hz", "HZ"], &["hertz"], TAU, SPEED),
    unit(&["mHz"], &["millihertz"], 1e-3 * TAU, SPEED),
    unit(
        &["kHz", "khz", "KHz", "KHZ", "Khz"],
        &["kilohertz"],
        1e3 * TAU,
        SPEED,
    ),
    unit(&["MHz"], &["megahertz"], 1e6 * TAU, SPEED),
    unit(&[], &["rpm"], TAU / 60.0, SPEED),
    unit(&[], &["krpm"], 1e3 * TAU / 60.0, SPEED),
    // Electricity.
    unit(&["V"], &["volt", "volts"], 1.0, VOLTAGE),
    unit(&["nV"], &["nanovolt", "nanovolts"], 1e-9, VOLTAGE),
    unit(
        &["uV", "uVolt", "uVolts"],
        &["microvolt", "microvolts"],
        1e-6,
        VOLTAGE,
    ),
    unit(
        &["mV", "mVolt", "mVolts"],
        &["millivolt", "millivolts"],
        1e-3,
        VOLTAGE,
    ),
    unit(
        &["kV", "kVolt", "kVolts"],
        &["kilovolt", "kilovolts"],
        1e3,
        VOLTAGE,
    ),
    unit(&["A"], &["amp", "amps", "ampere", "amperes"], 1.0, CURRENT),
    unit(
        &["uA"],
        &["microamp", "microamps", "microampere", "microamperes"],
        1e-6,
        CURRENT,
    ),
    unit(
        &["mA"],
        &["milliamp", "milliamps", "milliampere", "milliamperes"],
        1e-3,
        CURRENT,
    ),
    unit(&[], &["ohm", "ohms"], 1.0, RESISTANCE),
    unit(&["mohm"], &["milliohm", "milliohms"], 1e-3, RESISTANCE),
    unit(
        &["kohm"],
        &["kiloohm", "kiloohms", "kilohm", "kilohms"],
        1e3,
        RESISTANCE,
    ),
    unit(
        &["Mohm"],
        &["megaohm", "megaohms", "megohm", "megohms"],
        1e6,
        RESISTANCE,
    ),
    // Pressure and modulus.
    unit(&["Pa"], &["pascal", "pascals"], 1.0, PRESSURE),
    unit(&["kPa"], &["kilopascal", "kilopascals"], 1e3, PRESSURE),
    unit(&["MPa"], &["megapascal", "megapascals"], 1e6, PRESSURE),
    unit(&["GPa"], &["gigapascal", "gigapascals"], 1e9, PRESSURE),
    unit(&[], &["psi"], PSI, PRESSURE),
    unit(&[], &["ksi"], 1e3 * PSI, PRESSURE),
    unit(&["Mpsi"], &[], 1e6 * PSI, PRESSURE),
    // Temperature.
    temperature(&["K"], &["kelvin", "kelvins"], 1.0, 0.0),
    temperature(&[], &["degC", "celsius"], 1.0, CELSIUS_ZERO),
    temperature(&[], &["degF", "fahrenheit"], FAHRENHEIT, FAHRENHEIT_ZERO),
    // Acceleration.
    unit(&["g0", "gn"], &[], GRAVITY, ACCELERATION),
];

/// Finds a symbol: exact names first, then words in any case.
pub(super) fn find(symbol: &str) -> Option<&'static Symbol> {
    let exact = SYMBOLS.iter().find(|row| row.names.contains(&symbol));
    exact.or_else(|| {
        SYMBOLS.iter().find(|row| {
            row.words
                .iter()
                .any(|word| word.eq_ignore_ascii_case(symbol))
        })
    })
}

/// Torques written as one word with a possible mass, and the same with a force.
const OF_WEIGHTS: [(&str, &str); 9] = [
    ("kgm", "kgf m"),
    ("kgcm", "kgf cm"),
    ("gcm", "gf cm"),
    ("lbin", "lbf in"),
    ("inlb", "in lbf"),
    ("lbft", "lbf ft"),
    ("ftlb", "ft lbf"),
    ("ozin", "ozf in"),
    ("inoz", "in ozf"),
];

/// Known spelling nearest to an unknown one, if it is plausible.
pub(super) fn nearest(symbol: &str) -> Option<&'static str> {
    let is_it = |(word, _): &&(&str, &str)| symbol.eq_ignore_ascii_case(word);
    if let Some((_, with_force)) = OF_WEIGHTS.iter().find(is_it) {
        return Some(with_force);
    }
    // Two wrong letters of three are no match; a difference in case alone always is one.
    let limit = 1 + symbol.chars().count() / 4;
    let lower = symbol.to_lowercase();
    SYMBOLS
        .iter()
        .flat_map(|row| row.names.iter().chain(row.words))
        .map(|known| {
            let folded = strsim::damerau_levenshtein(&lower, &known.to_lowercase());
            (folded, *known)
        })
        .filter(|(folded, known)| *folded == 0 || (*folded <= limit && known.len() > 1))
        .min_by_key(|(folded, known)| (*folded, strsim::damerau_levenshtein(symbol, known)))
        .map(|(_, known)| known)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_spelling_is_given_twice() {
        let mut seen = std::collections::BTreeSet::new();
        for row in SYMBOLS {
            for name in row.names {
                assert!(seen.insert((*name).to_owned()), "{name} is given twice");
            }
            for word in row.words {
                assert!(word.len() >= 3, "{word} is too short to match in any case");
                assert!(seen.insert(word.to_lowercase()), "{word} is given twice");
            }
        }
        // A lower-case word must not shadow an exact name of another unit either.
        for row in SYMBOLS {
            for name in row.names {
                assert_eq!(find(name), Some(row), "{name} finds another row");
            }
        }
    }

    #[test]
    fn derived_factors_agree_with_their_definitions() {
        assert!((POUND_FORCE / (POUND * GRAVITY) - 1.0).abs() < 1e-15);
        // NIST SP 811 appendix B.8 prints 14.59390 kg and 6894.757 Pa.
        assert!((SLUG - 14.593_90).abs() < 5e-6);
        assert!((PSI - 6_894.757).abs() < 5e-4);
        assert!((FAHRENHEIT_ZERO - 255.372_222_222).abs() < 1e-9);
    }

    #[test]
    fn a_wrong_case_or_letter_finds_the_unit_meant() {
        assert_eq!(nearest("KPA"), Some("kPa"));
        assert_eq!(nearest("lbff"), Some("lbf"));
        assert_eq!(nearest("newtns"), Some("newtons"));
        assert_eq!(nearest("xyzzy"), None);
        // By spelling alone, "kgcm" is nearest to "kgfm", which is a hundred times larger.
        assert_eq!(nearest("kgcm"), Some("kgf cm"));
        assert_eq!(nearest("OzIn"), Some("ozf in"));
    }
}
