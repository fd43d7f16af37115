//! Check that the fundamental is not a multiple of the speed.

use torqcomp_dsp::harmonics::{Component, Fundamental, fit, refine_fundamental};

use super::rotation::Rotation;
use super::speed::{FEWEST, FIRST, SPAN, highest, is_sure};
use crate::print::{enumeration, rounded};
use crate::warning::{Warning, WarningCode};

/// Parts of the fundamental that may be the speed.
const PARTS: [u32; 2] = [2, 3];
/// Number of multiples of the speed that are searched, at most.
const MULTIPLES: u32 = 8;
/// Amplitude of a line between the orders, as torque, relative to the largest of all.
const STRONG: f64 = 0.2;

/// A warning if lines between the orders are multiples of half or a third of the fundamental; `inverse` is the torque per
/// recorded amplitude at a frequency, so that the resonance does not hide them.
pub(super) fn warning(of: &Rotation, inverse: impl Fn(f64) -> f64) -> Option<Warning> {
    let is_whole = |order: &f64| (order - order.round()).abs() < 1e-6;
    let length = of.count().min(FIRST);
    let periods = length as f64 * of.fundamental_hz / of.record.rate_hz;
    if !of.orders.iter().all(is_whole) || periods < FEWEST * f64::from(PARTS[1]) {
        return None;
    }
    let samples = of.first(length)?;
    let mut parts = PARTS.into_iter();
    parts.find_map(|part| of_part(of, &samples, part, &inverse))
}

/// Hertz per unit in which a speed may have been given as the number of hertz.
const UNITS: [(&str, f64); 2] = [("rpm", 1.0 / 60.0), ("rad/s", 1.0 / std::f64::consts::TAU)];

/// A warning if the record has no order of the given fundamental, but those of the same number in another unit.
pub(super) fn other_unit(of: &Rotation) -> Option<Warning> {
    let (samples, given_hz) = (of.first(FIRST)?, of.fundamental_hz);
    let has_any = |hz: f64| {
        let fitted = of.fitted(&samples, hz);
        fitted.is_some_and(|fitted| fitted.components.iter().any(is_sure))
    };
    let of_unit = |(unit, hz): &(&str, f64)| {
        let start_hz = given_hz * hz;
        let rate_hz = of.record.rate_hz;
        let found = refine_fundamental(&samples, rate_hz, start_hz, SPAN, &[1.0]).ok()?;
        has_any(found.frequency_hz).then(|| {
            WarningCode::FundamentalOff.warning(format!(
                "no order of {given} Hz stands out, but a line at {} Hz does: if the speed is {given} {unit}, give \
                 --fundamental \"{given} {unit}\"",
                rounded(found.frequency_hz, 5),
                given = rounded(given_hz, 7),
            ))
        })
    };
    match has_any(given_hz) {
        true => None,
        false => UNITS.iter().find_map(of_unit),
    }
}

/// The warning about multiples of one part of the fundamental.
fn of_part(
    of: &Rotation,
    samples: &[f64],
    part: u32,
    inverse: &impl Fn(f64) -> f64,
) -> Option<Warning> {
    let (rate_hz, fundamental_hz) = (of.record.rate_hz, of.fundamental_hz);
    let start_hz = fundamental_hz / f64::from(part);
    let is_seen = |k: &u32| f64::from(*k) * start_hz * (1.0 + SPAN) < 0.5 * rate_hz;
    let seen = (1..=MULTIPLES).filter(is_seen);
    let (whole, between): (Vec<u32>, Vec<u32>) = seen.partition(|k| k % part == 0);
    let between: Vec<f64> = between.into_iter().map(f64::from).collect();
    let found = refine_fundamental(samples, rate_hz, start_hz, SPAN, &between).ok()?;
    let all: Vec<f64> = whole.into_iter().map(f64::from).chain(between).collect();
    let speed = Fundamental::given(found.frequency_hz);
    let fitted = fit(samples, rate_hz, 0.0, speed, &all).ok()?;
    let size = |c: &Component| c.phasor.norm() * inverse(c.frequency_hz);
    let sure = || fitted.components.iter().filter(|c| is_sure(c));
    let largest = sure().map(size).fold(0.0, f64::max);
    let is_between = |c: &&Component| c.order % f64::from(part) != 0.0;
    let strong = sure().filter(is_between);
    let strong = strong.filter(|c| size(c) > STRONG * largest);
    let strong: Vec<f64> = strong.map(|c| c.order).collect();
    // A single line is a multiple by chance if it is not at the speed itself, or near it and the orders are there.
    let resolution_hz = rate_hz / samples.len() as f64;
    let is_exact = (found.frequency_hz - start_hz).abs() * highest(&strong) < resolution_hz;
    let orders_are_there = || {
        let given = of.fitted(samples, fundamental_hz);
        given.is_some_and(|given| given.components.iter().any(is_sure))
    };
    let is_part = match strong.len() {
        0 => false,
        1 => strong[0] == 1.0 && (is_exact || !orders_are_there()),
        _ => true,
    };
    is_part.then(|| said(&strong, (fundamental_hz, part), found.frequency_hz))
}

/// The warning about multiples of the speed.
fn said(strong: &[f64], (fundamental_hz, part): (f64, u32), speed_hz: f64) -> Warning {
    let list = |of: &dyn Fn(f64) -> String| {
        let texts: Vec<String> = strong.iter().map(|k| of(*k)).collect();
        enumeration(&texts, "and")
    };
    let (lines, order) = match strong.len() {
        1 => ("a strong line lies", "order"),
        _ => ("strong lines lie", "orders"),
    };
    WarningCode::LinesBetweenOrders.warning(format!(
        "{lines} between the orders of {} Hz, at {} Hz: if the speed is {speed} Hz, give --fundamental {speed}; \
         otherwise add {order} {} to --orders",
        rounded(fundamental_hz, 7),
        list(&|k| rounded(k * speed_hz, 5)),
        list(&|k| rounded(k / f64::from(part), 4)),
        speed = rounded(speed_hz, 7),
    ))
}
