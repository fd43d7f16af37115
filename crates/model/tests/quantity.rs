//! Units and kinds: good and bad text.

use std::f64::consts::{PI, TAU};

use crate::util::{Random, assert_close};
use torqcomp_model::{Kind, QuantityError, Unit, UnitSystem};

/// (kind, text, SI value worked from the definitions of the units)
const GOOD: &[(Kind, &str, f64)] = &[
    // NIST SP 811 appendix B prints these factors to seven digits.
    (Kind::Torque, "1 ft lbf", 1.355_818),
    (Kind::Torque, "1 lbf in", 0.112_984_8),
    (Kind::Torque, "1 ozf in", 7.061_552e-3),
    (Kind::Inertia, "1 lbm ft^2", 4.214_011e-2),
    (Kind::Inertia, "1 lbm in^2", 2.926_397e-4),
    (Kind::Force, "1 lbf", 4.448_222),
    (Kind::Force, "1 kip", 4.448_222e3),
    (Kind::Force, "1 kgf", 9.806_65),
    (Kind::Mass, "1 slug", 14.593_90),
    (Kind::Mass, "1 lbm", 0.453_592_4),
    (Kind::Pressure, "1 psi", 6.894_757e3),
    (Kind::Pressure, "1 ksi", 6.894_757e6),
    (Kind::LinearStiffness, "1 lbf/in", 175.126_8),
    // Worked by hand.
    (
        Kind::AngularStiffness,
        "8.1e4 ft lbf/rad",
        8.1e4 * 1.355_817_948_331_4,
    ),
    (Kind::AngularStiffness, "2 N m/deg", 360.0 / PI),
    (
        Kind::AngularDamping,
        "3.07 ft lbf s/rad",
        3.07 * 1.355_817_948_331_4,
    ),
    (Kind::AngularDamping, "3 N·m·s", 3.0),
    (Kind::AngularDamping, "1 N m/rpm", 60.0 / TAU),
    (Kind::Inertia, "1 slug ft^2", 1.355_817_948_331_4),
    (Kind::Inertia, "1 ft lbf s²/rad", 1.355_817_948_331_4),
    (Kind::Frequency, "3700 rad/s", 588.873_2),
    (Kind::Frequency, "1725 rpm", 28.75),
    (Kind::Frequency, "10 kHz", 1e4),
    (Kind::Frequency, "48000 samples/s", 48_000.0),
    (Kind::AngularSpeed, "60 Hz", 376.991_1),
    (Kind::AngularSpeed, "400 RPM", 41.887_90),
    (Kind::AngularSpeed, "1 rev/min", 0.104_719_8),
    (Kind::AngularAcceleration, "0.88 rad/s^2", 0.88),
    (Kind::Angle, "90°", PI / 2.0),
    (Kind::TorquePerVolt, "1.23e3 ft lbf/V", 1667.656),
    (Kind::TorquePerVolt, "2 mN m/mV", 2.0),
    (Kind::ForcePerAngularSpeed, "1 lbf/(rad/s)", 4.448_222),
    (Kind::ForcePerAngularSpeed, "1 N per rpm", 60.0 / TAU),
    (Kind::Strain, "50 µε", 5e-5),
    (Kind::Strain, "50 μstrain", 5e-5),
    (Kind::Strain, "50 um/m", 5e-5),
    (Kind::Strain, "0.1 %", 1e-3),
    (Kind::Strain, "3 in/in", 3.0),
    (Kind::Gain, "200", 200.0),
    (Kind::Gain, "5 mV/V", 5e-3),
    (Kind::Ratio, "7 %", 0.07),
    (Kind::Ratio, "0.07", 0.07),
    (Kind::Voltage, "22.5V", 22.5),
    (Kind::Voltage, "238 µV/div", 238e-6),
    (Kind::Voltage, "5 Millivolts", 5e-3),
    (Kind::Resistance, "5.9 kΩ", 5900.0),
    (Kind::Resistance, "5.9 k\u{2126}", 5900.0),
    (Kind::Time, "1.7 ms", 1.7e-3),
    (Kind::Time, "2 Seconds", 2.0),
    (Kind::Length, ".5 in", 0.0127),
    (Kind::Length, "5. mm", 5e-3),
    (Kind::Length, "+1.5e+0 inches", 0.0381),
    (Kind::SecondMoment, "1 in4", 4.162_314e-7),
    (Kind::Mass, "5 lb", 2.267_962),
    (Kind::Mass, "5 pounds", 2.267_962),
    (Kind::Force, "5 pound-force", 22.241_108),
    (Kind::Acceleration, "1 g0", 9.806_65),
    (Kind::Acceleration, "2 m s-2", 2.0),
    (Kind::Acceleration, "2 m·s⁻²", 2.0),
    (Kind::TemperatureAbsolute, "80 °F", 299.816_7),
    (Kind::TemperatureAbsolute, "80 deg F", 299.816_7),
    (Kind::TemperatureAbsolute, "-40 degF", 233.15),
    (Kind::TemperatureAbsolute, "-40 degC", 233.15),
    (Kind::TemperatureAbsolute, "298.15 K", 298.15),
    (Kind::TemperatureDifference, "18 degF", 10.0),
    (Kind::ThermalExpansion, "6.5e-6 /degF", 11.7e-6),
    (Kind::ThermalExpansion, "6.5 ppm/°F", 11.7e-6),
    (Kind::ThermalExpansion, "11.7e-6 1/K", 11.7e-6),
    (Kind::ThermalExpansion, "6.5 uin/in/degF", f64::NAN),
    (Kind::TemperatureCoefficient, "0.2 %/degC", 2e-3),
    (Kind::DecayRate, "262 s^-1", 262.0),
];

#[test]
fn good_text_gives_the_si_number() {
    for (kind, text, want) in GOOD {
        let got = kind.parse(text);
        if want.is_nan() {
            // Micro-inch is not a unit of the table: an error, not a guess.
            assert!(
                matches!(got, Err(QuantityError::UnknownUnit { .. })),
                "{text}: {got:?}"
            );
            continue;
        }
        let got = got.unwrap_or_else(|error| panic!("{text}: {error}"));
        // Half a unit of the seventh digit, the last one printed by the standard.
        assert!(
            (got / want - 1.0).abs() < 5e-7,
            "{text}: got {got:e}, want {want:e}"
        );
    }
}

#[test]
fn factors_are_exact_definitions() {
    assert_eq!(Kind::Length.si_factor("in"), Ok(0.0254));
    assert_eq!(Kind::Length.si_factor("ft"), Ok(0.3048));
    assert_eq!(Kind::Force.si_factor("lbf"), Ok(4.4482216152605));
    assert_eq!(Kind::Mass.si_factor("lbm"), Ok(0.45359237));
    // One slug is the mass that one lbf gives one ft/s².
    assert_close(
        Kind::Mass.si_factor("lbf s^2/ft").unwrap(),
        4.4482216152605 / 0.3048,
        1e-15,
    );
    assert_close(
        Kind::Mass.si_factor("slug").unwrap(),
        Kind::Mass.si_factor("lbf s^2/ft").unwrap(),
        1e-15,
    );
}

#[test]
fn case_tells_milli_from_mega() {
    for (kind, small, large) in [
        (Kind::Force, "mN", "MN"),
        (Kind::Torque, "mNm", "MNm"),
        (Kind::Frequency, "mHz", "MHz"),
        (Kind::Resistance, "mohm", "Mohm"),
    ] {
        let ratio = kind.si_factor(large).unwrap() / kind.si_factor(small).unwrap();
        assert_close(ratio, 1e9, 1e-12);
    }
    for wrong in ["mPa", "MS", "KN", "mV/v", "NM", "KG"] {
        let got = Unit::parse(wrong);
        assert!(
            matches!(got, Err(QuantityError::UnknownUnit { .. })),
            "{wrong}: {got:?}"
        );
    }
}

#[test]
fn bad_text_is_refused_with_what_to_write() {
    let cases: &[(Kind, &str, &str)] = &[
        (
            Kind::Inertia,
            "0.35",
            "\"0.35\" has no unit; expected mass moment of inertia with its unit, for example \
             \"0.008 kg m^2\"",
        ),
        (
            Kind::Torque,
            "3 Nm/rad",
            "the unit \"Nm/rad\" has the dimension kg m^2 s^-2 rad^-1; expected torque (kg m^2 \
             s^-2), for example \"50 N m\"",
        ),
        (
            Kind::Voltage,
            "5 mvolt",
            "unknown unit \"mvolt\" in \"mvolt\"; did you mean \"mVolt\"?",
        ),
        (
            Kind::Torque,
            "3 ft-lb",
            "\"ft-lb\" can be read with a force or with a mass; write \"ft-lbf\" for the force, or \
             \"ft-lbm\" if the mass is meant",
        ),
        (
            Kind::Force,
            "1,000 N",
            "\"1,000 N\" does not start with a number; write the number with a decimal point and \
             without thousands marks, for example \"70 N\"",
        ),
        (
            Kind::Force,
            "inf N",
            "\"inf N\" is not a finite number; check the input",
        ),
        (
            Kind::Force,
            "1e999 N",
            "\"1e999 N\" is not a finite number; check the input",
        ),
        (
            Kind::Force,
            "1e308 MN",
            "\"1e308 MN\" is not a finite number; check the input",
        ),
        (
            Kind::Force,
            "  ",
            "the text is empty; expected force, for example \"70 N\"",
        ),
        (
            Kind::TemperatureAbsolute,
            "-500 degF",
            "\"-500 degF\" is -22.405555555555537 K, below absolute zero; check the number and \
             its unit",
        ),
    ];
    for (kind, text, want) in cases {
        let got = kind.parse(text).unwrap_err().to_string();
        assert_eq!(&got, want);
    }
}

#[test]
fn numbers_that_are_none_are_refused() {
    for text in [
        "N", "abc", "- 5 N", "--5 N", ".", ". N", "+", "1.2.3 N", "1'000 N", "1_000 N",
    ] {
        let got = Kind::Force.parse(text);
        assert!(
            matches!(got, Err(QuantityError::NotANumber { .. })),
            "{text}: {got:?}"
        );
    }
    for text in ["nan N", "NaN", "-inf", "infinity N"] {
        let got = Kind::Force.parse(text);
        assert!(
            matches!(got, Err(QuantityError::NotFinite { .. })),
            "{text}: {got:?}"
        );
    }
    assert!(matches!(
        Kind::Strain.parse("800"),
        Err(QuantityError::MissingUnit { .. })
    ));
}

#[test]
fn radians_and_dimensions_are_not_mixed_up() {
    let refused = [
        (Kind::AngularStiffness, "8.1e4 ft lbf"),
        (Kind::AngularDamping, "3.07 ft lbf/rad"),
        (Kind::AngularSpeed, "10 1/s"),
        (Kind::DecayRate, "10 Hz"),
        (Kind::DecayRate, "262 rad/s"),
        (Kind::Time, "1 /Hz"),
        (Kind::Strain, "1 rad"),
        (Kind::Gain, "1 N m/V"),
        (Kind::Mass, "5 lbf"),
        (Kind::Length, "1 degF"),
        (Kind::TemperatureAbsolute, "1 1/K"),
    ];
    for (kind, text) in refused {
        let got = kind.parse(text);
        assert!(
            matches!(got, Err(QuantityError::WrongDimension { .. })),
            "{text}: {got:?}"
        );
    }
}

#[test]
fn pound_is_a_mass_and_only_a_mass() {
    for (kind, text) in [
        (Kind::Force, "5 lb"),
        (Kind::Torque, "5 ft lbs"),
        (Kind::Torque, "5 foot-pounds"),
        (Kind::Inertia, "5 lb ft^2"),
        (Kind::Pressure, "5 lb/in^2"),
        (Kind::Torque, "16 oz-in"),
        (Kind::Torque, "3 in-lb"),
        (Kind::Torque, "100 g cm"),
    ] {
        let got = kind.parse(text);
        assert!(
            matches!(got, Err(QuantityError::AmbiguousWeight { .. })),
            "{text}: {got:?}"
        );
    }
}

#[test]
fn malformed_units_are_refused() {
    let malformed = [
        "N m/rad s",
        "N/m*s",
        "N//m",
        "N**m",
        "*N",
        "N*",
        "N/",
        "(N m",
        "N m)",
        "()",
        "^2",
        "N^",
        "N^0",
        "m^10",
        "m12",
        "m^x",
        "10 N",
        "2 m",
        "N^2^2",
        "((((((m))))))",
        "m^1.5",
        "m^-",
        "/",
    ];
    for text in malformed {
        let got = Unit::parse(text);
        assert!(
            matches!(got, Err(QuantityError::UnitSyntax { .. })),
            "{text}: {got:?}"
        );
    }
    assert!(matches!(
        Unit::parse(&"m ".repeat(300)),
        Err(QuantityError::UnitSyntax { .. })
    ));
    assert!(matches!(
        Unit::parse("(MN^9)^9"),
        Err(QuantityError::UnitSyntax { .. })
    ));
}

#[test]
fn spellings_of_one_unit_agree() {
    for group in [
        &[
            "N m/rad",
            "N*m/rad",
            "N·m/rad",
            "N.m/rad",
            "N-m/rad",
            "Nm/rad",
            "N m rad^-1",
        ][..],
        &[
            "kg m^2", "kg m²", "kg m2", "kg*m*m", "kg m·m", "kg (m)^2", "kg/m^-2",
        ][..],
        &["", "1", " ", "V/V", "(1)"][..],
        &[
            "N m/(rad/s)",
            "N m s/rad",
            "N m per (rad per s)",
            "N m s⋅rad⁻¹",
        ][..],
    ] {
        let first = Unit::parse(group[0]).unwrap();
        for text in group {
            let unit = Unit::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!(unit.dimension(), first.dimension(), "{text}");
            assert_close(unit.factor(), first.factor(), 1e-15);
        }
    }
}

#[test]
fn print_units_read_back_as_themselves() {
    for kind in Kind::ALL {
        for system in [UnitSystem::Si, UnitSystem::Us] {
            let text = format!("350.5 {}", kind.unit(system));
            let si = kind
                .parse(&text)
                .unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_close(kind.to(system, si), 350.5, 1e-14);
            let difference = kind.parse_std(&text, &text).unwrap();
            assert_close(kind.difference_to(system, difference), 350.5, 1e-14);
        }
        // SI print units are the unit of the number inside.
        assert_eq!(kind.to(UnitSystem::Si, 350.5), 350.5);
        assert_close(
            kind.parse(&format!("2 {}", kind.unit(UnitSystem::Si)))
                .unwrap(),
            2.0,
            1e-15,
        );
        assert!(kind.parse(kind.example()).is_ok(), "{}", kind.example());
        assert!(!kind.name().is_empty());
    }
}

#[test]
fn uncertainties_are_not_negative() {
    let got = Kind::Force.parse_std("-1 N", "5 N");
    assert!(matches!(
        got,
        Err(QuantityError::NegativeUncertainty { .. })
    ));
    assert_eq!(Kind::Force.parse_std("0 N", "5 N"), Ok(0.0));
    assert_close(
        Kind::TemperatureAbsolute
            .parse_std("1.8 degF", "80 degF")
            .unwrap(),
        1.0,
        1e-15,
    );
}

#[test]
fn no_text_makes_the_reader_panic() {
    let pieces = [
        "1", "-", "^", "²", "⁻", "(", ")", "/", "*", ".", " ", "m", "lb", "deg", "°", "C", "F",
        "µ", "Ω", "ε", "per", "force", "e", "E5", "9", "g", "0", "g0", "é", "😀", "%", "pound",
        "\u{a0}",
    ];
    let mut random = Random::new(11);
    let mut read = 0;
    for _ in 0..12_000 {
        let length = 1 + (random.uniform() * 8.0) as usize;
        let text: String = (0..length)
            .map(|_| pieces[(random.uniform() * pieces.len() as f64) as usize])
            .collect();
        read += usize::from(Unit::parse(&text).is_ok());
        for kind in [Kind::Ratio, Kind::TemperatureAbsolute, Kind::Mass] {
            read += usize::from(kind.parse(&text).is_ok());
        }
    }
    assert!(
        read > 100,
        "the pieces must form readable text now and then: {read}"
    );
}

/// 1 kg cm² = 10⁻⁴ kg m², 1 g cm² = 10⁻⁷ kg m². A kilogram-metre that is not squared is a torque to some.
#[test]
fn inertias_that_data_sheets_write_as_one_word() {
    for (text, want) in [
        ("0.3 kgm²", 0.3),
        ("0.3 kgm^2", 0.3),
        ("12 kgcm2", 12e-4),
        ("5 gcm²", 5e-7),
        ("7 kgmm²", 7e-6),
        ("0.3 kg m²", 0.3),
    ] {
        let got = Kind::Inertia.parse(text).unwrap();
        assert!((got / want - 1.0).abs() < 1e-12, "{text}: {got} {want}");
    }
    assert!(Kind::Inertia.parse("0.3 kgm").is_err());
    assert!(Kind::Inertia.parse("0.3 kgm^3").is_err());
}

/// Worked by hand: 1 lbf in = 4.4482216152605 N × 0.0254 m, 1 ozf = 1/16 lbf, 1 kp = 9.80665 N.
#[test]
fn units_of_torque_that_motors_and_screws_are_sold_with() {
    for (text, want) in [
        ("1 cN m", 0.01),
        ("1 cNm", 0.01),
        ("1 dyn cm", 1e-7),
        ("1 gf cm", 9.80665e-5),
        ("1 gf-cm", 9.80665e-5),
        ("1 ozf in", 4.448_221_615_260_5 / 16.0 * 0.0254),
        ("1 in-lbf", 4.448_221_615_260_5 * 0.0254),
        ("1 kp m", 9.80665),
        ("1 kgfm", 9.80665),
        ("1 kgf cm", 0.098_066_5),
    ] {
        let got = Kind::Torque.parse(text).unwrap();
        assert!((got / want - 1.0).abs() < 1e-12, "{text}: {got} {want}");
    }
}

#[test]
fn speeds_angles_and_frequencies_in_other_spellings() {
    let speed = |text| Kind::AngularSpeed.parse(text).unwrap();
    assert!((speed("1500 1/min") / (50.0 * std::f64::consts::PI) - 1.0).abs() < 1e-12);
    assert!((speed("1.5 krpm") / (50.0 * std::f64::consts::PI) - 1.0).abs() < 1e-12);
    assert!((Kind::Frequency.parse("1500 min^-1").unwrap() - 25.0).abs() < 1e-12);
    let angle = |text| Kind::Angle.parse(text).unwrap();
    assert!((angle("180000 mdeg") - std::f64::consts::PI).abs() < 1e-12);
    assert!((angle("200 gon") - std::f64::consts::PI).abs() < 1e-12);
    let asked = Kind::Angle.parse("200 grad").unwrap_err().to_string();
    assert!(asked.contains("write deg or gon"), "{asked}");
    for text in ["60 khz", "60 KHz", "60000 hz", "60000 HZ"] {
        assert!(
            (Kind::Frequency.parse(text).unwrap() - 6e4).abs() < 1e-6,
            "{text}"
        );
    }
    assert_eq!(Kind::Voltage.parse("5 mVolt").unwrap(), 5e-3);
}

#[test]
fn an_inverted_unit_is_answered_with_the_right_number() {
    let message = |kind: Kind, text| kind.parse(text).unwrap_err().to_string();
    // 80 mV per N m are 1/0.08 = 12.5 N m per V.
    let got = message(Kind::TorquePerVolt, "80 mV/(N m)");
    assert!(got.contains("write \"12.5 N m/V\""), "{got}");
    // 0.04 mV/V per N m are 25 N m per mV/V.
    let got = message(Kind::TorquePerRatio, "0.04 (mV/V)/(N m)");
    assert!(got.contains("write \"25000 N m/(V/V)\""), "{got}");
}

#[test]
fn ratios_of_voltages_are_neither_strain_nor_torque() {
    assert_eq!(Kind::TorquePerRatio.parse("25 N m/(mV/V)").unwrap(), 25e3);
    let wrong = |kind: Kind, text| {
        let got = kind.parse(text);
        assert!(
            matches!(got, Err(QuantityError::WrongRatio { .. })),
            "{text}: {got:?}"
        );
    };
    wrong(Kind::TorquePerRatio, "25 N m");
    wrong(Kind::Torque, "25 N m/(mV/V)");
    wrong(Kind::Strain, "1 mV/V");
}
