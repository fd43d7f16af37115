//! Propagation of uncertainty against closed forms and sampling, and the text of estimates.

use crate::util::{Random, assert_close, mean_and_std};
use torqcomp_model::{Estimate, Kind, QuantityError, UnitSystem};

fn estimate(kind: Kind, value: f64, std: Option<f64>) -> Estimate {
    Estimate::new(kind, value, std, "test").unwrap()
}

/// K = 3 r² E I/L³ with I = b h³/12.
fn stiffness(x: &[f64]) -> f64 {
    3.0 * x[0].powi(2) * x[1] * (x[2] * x[3].powi(3) / 12.0) / x[4].powi(3)
}

const INPUTS: [(Kind, f64, f64); 5] = [
    (Kind::Length, 0.07112, 1e-4),
    (Kind::Pressure, 2.07e11, 3e9),
    (Kind::Length, 0.0127, 2e-5),
    (Kind::Length, 0.0127, 2e-5),
    (Kind::Length, 0.0381, 1e-4),
];

fn beam_estimate() -> Estimate {
    let inputs = INPUTS.map(|(kind, value, std)| estimate(kind, value, Some(std)));
    let inputs: Vec<&Estimate> = inputs.iter().collect();
    Estimate::derive(Kind::AngularStiffness, "drawing", &inputs, stiffness).unwrap()
}

#[test]
fn product_of_powers_adds_relative_variances() {
    // u²(K)/K² = Σ (power · u(x)/x)², powers 2, 1, 1, 3, −3 (JCGM 100:2008, 5.1.6).
    let powers = [2.0, 1.0, 1.0, 3.0, -3.0];
    let relative: f64 = INPUTS
        .iter()
        .zip(powers)
        .map(|((_, x, u), p)| (p * u / x).powi(2))
        .sum::<f64>()
        .sqrt();
    let got = beam_estimate();
    assert_close(got.std_uncertainty().unwrap() / got.value(), relative, 1e-8);
    assert_eq!((got.unit(), got.source()), ("N m/rad", "drawing"));
}

#[test]
fn propagation_matches_monte_carlo() {
    let mut random = Random::new(7);
    let draws: Vec<f64> = (0..40_000)
        .map(|_| stiffness(&INPUTS.map(|(_, value, std)| value + std * random.normal())))
        .collect();
    let (mean, std) = mean_and_std(&draws);
    let got = beam_estimate();
    assert_close(got.value(), mean, 1e-3);
    // 40,000 draws know a standard deviation to 0.35 %; the rest is curvature.
    assert_close(got.std_uncertainty().unwrap(), std, 0.015);
}

#[test]
fn differences_work_at_zero_and_beside_huge_offsets() {
    let zero = estimate(Kind::Voltage, 0.0, Some(0.5));
    let sine = Estimate::derive(Kind::Voltage, "s", &[&zero], |x| x[0].sin()).unwrap();
    assert_close(sine.std_uncertainty().unwrap(), 0.5, 1e-9);
    let huge = estimate(Kind::Voltage, 1e12, Some(1e-3));
    let line = Estimate::derive(Kind::Voltage, "s", &[&huge], |x| 2.0 * x[0]).unwrap();
    assert_close(line.std_uncertainty().unwrap(), 2e-3, 1e-9);
}

#[test]
fn unknown_and_zero_uncertainty_are_not_the_same() {
    let unknown = estimate(Kind::Length, 2.0, None);
    let exact = estimate(Kind::Length, 2.0, Some(0.0));
    let rough = estimate(Kind::Length, 2.0, Some(0.1));
    let area = |a: &Estimate, b: &Estimate| {
        Estimate::derive(Kind::Area, "a b", &[a, b], |x| x[0] * x[1])
            .unwrap()
            .std_uncertainty()
    };
    assert_eq!(area(&unknown, &unknown), None);
    assert_eq!(area(&unknown, &exact), Some(0.0));
    assert_close(area(&unknown, &rough).unwrap(), 0.2, 1e-9);
}

#[test]
fn impossible_estimates_are_refused() {
    let refuse = |value, std| Estimate::new(Kind::Force, value, std, "scale").unwrap_err();
    assert_eq!(
        refuse(f64::NAN, None).to_string(),
        "the value of the force from scale is NaN; check the numbers it comes from"
    );
    assert!(matches!(
        refuse(1.0, Some(f64::INFINITY)),
        QuantityError::EstimateNotFinite {
            part: "standard uncertainty",
            ..
        }
    ));
    assert!(matches!(
        refuse(1.0, Some(-0.1)),
        QuantityError::NegativeUncertainty { .. }
    ));
    // A root whose argument goes negative beside the value.
    let small = estimate(Kind::Ratio, 0.0, Some(0.1));
    let root = Estimate::derive(Kind::Ratio, "root", &[&small], |x| x[0].sqrt());
    assert!(matches!(root, Err(QuantityError::EstimateNotFinite { .. })));
}

#[test]
fn text_ends_where_the_uncertainty_does() {
    let text = |kind, value, std| estimate(kind, value, std).text(UnitSystem::Si);
    assert_eq!(
        text(Kind::Frequency, 590.4957, Some(1.234)),
        "(590.5 ± 1.2) Hz"
    );
    assert_eq!(
        text(Kind::AngularStiffness, 109_821.4, Some(2711.6)),
        "(109800 ± 2700) N m/rad"
    );
    assert_eq!(
        text(Kind::Inertia, 7.931_5e-3, Some(9.96e-5)),
        "(7.93 ± 0.10)e-3 kg m^2"
    );
    assert_eq!(
        text(Kind::Pressure, 2.0684e11, Some(3e9)),
        "(2.068 ± 0.030)e11 Pa"
    );
    assert_eq!(
        text(Kind::AngularDamping, 1.208_03e-4, Some(2e-7)),
        "(1.2080 ± 0.0020)e-4 N m s/rad"
    );
    assert_eq!(text(Kind::Force, -12.5, None), "-12.5 N");
    assert_eq!(text(Kind::Pressure, 2.0684e11, None), "2.0684e11 Pa");
    assert_eq!(text(Kind::Ratio, 0.0705, None), "0.0705");
    assert_eq!(text(Kind::Voltage, 0.0, None), "0 V");
    assert_eq!(text(Kind::Voltage, 0.0, Some(0.012)), "(0.000 ± 0.012) V");
    assert_eq!(text(Kind::Length, 0.5, Some(0.0)), "(0.5 ± 0) m");
    assert_eq!(text(Kind::Length, 1.0, Some(25.0)), "(1 ± 25) m");
    assert_eq!(text(Kind::Strain, 2e-9, Some(3e-6)), "(0.0 ± 3.0)e-6 m/m");
    assert_eq!(text(Kind::Force, 1e300, None), "1e300 N");
    assert_eq!(text(Kind::Force, 2.5e-310, None), "2.5e-310 N");
    assert_eq!(text(Kind::Force, 0.0, Some(1e-300)), "(0.0 ± 1.0)e-300 N");
    assert_eq!(text(Kind::Force, 999_999.7, None), "1e6 N");
}

#[test]
fn text_in_us_units_converts_value_and_uncertainty() {
    let temperature = estimate(Kind::TemperatureAbsolute, 300.0, Some(5.0));
    assert_eq!(temperature.text(UnitSystem::Us), "(80.3 ± 9.0) degF");
    let stiffness = Kind::AngularStiffness.parse("8.1e4 ft lbf/rad").unwrap();
    let std = Kind::AngularStiffness
        .parse_std("0.2e4 ft lbf/rad", "8.1e4 ft lbf/rad")
        .unwrap();
    let stiffness = estimate(Kind::AngularStiffness, stiffness, Some(std));
    assert_eq!(stiffness.text(UnitSystem::Us), "(81000 ± 2000) ft lbf/rad");
}
