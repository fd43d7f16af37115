//! Parsing of the measuring chain: gage, bridge, recorder.

use torqcomp_dsp::bridge::{BridgeLayout, Leads, Supply};
use torqcomp_dsp::gage::Gage;
use torqcomp_dsp::recorder::{LowPass, Recorder};
use torqcomp_model::{Estimate, Kind};

use super::section::Section;
use super::signal::TransducerSignal;
use super::{BridgeData, GageData, RecorderData};
use crate::failure::Failure;
use crate::print::short;
use crate::warning::{Warning, WarningCode};

/// Smallest plausible gain of an amplifier; a smaller value is another quantity.
const LEAST_GAIN: f64 = 0.01;

/// Typical magnitudes of gage factors: metal foil (2, platinum up to 6), and semiconductors.
const GAGE_FACTORS: [std::ops::RangeInclusive<f64>; 2] = [1.0..=6.5, 30.0..=190.0];

/// A warning about an unusual gage factor.
pub(super) fn unusual_gage_factor(gage: &GageData) -> Option<Warning> {
    let factor = gage.gage.gage_factor();
    let is_usual = GAGE_FACTORS
        .iter()
        .any(|range| range.contains(&factor.abs()));
    (!is_usual).then(|| {
        WarningCode::GageFactorUnusual.warning(format!(
            "[gage] gage_factor is {}, unlike any common gage: metal foil has about 2, semiconductors 50 to 180; \
             the torque is wrong by the same factor",
            short(factor)
        ))
    })
}

pub(super) fn gage(section: &Section) -> Result<GageData, Failure> {
    let optional = |key, kind| section.quantity(key, kind).map(|e| e.map(|e| e.value()));
    // A metal-foil gage is linear, and its law does not depend on temperature.
    let room = 298.15;
    let reference = optional("reference_temperature", Kind::TemperatureAbsolute)?.unwrap_or(room);
    let temperature_k = optional("temperature", Kind::TemperatureAbsolute)?.unwrap_or(reference);
    let bonding = optional("bonding_temperature", Kind::TemperatureAbsolute)?;
    let drift = optional("resistance_drift", Kind::Ratio)?.unwrap_or(0.0);
    let factor = section.required("gage_factor", Kind::Ratio)?;
    let gage = Gage::new(
        factor.value(),
        optional("quadratic_coefficient", Kind::Ratio)?.unwrap_or(0.0),
        reference,
        section.positive("resistance", Kind::Resistance)?.value(),
    )
    .map_err(|error| section.fail("", error))?;
    let bonded = section.positive_if_any("bonded_resistance", Kind::Resistance)?;
    section.finish()?;
    Ok(GageData {
        gage,
        factor_relative_std: factor.relative_std(),
        bonded_resistance_ohm: bonded.map(|e| e.value()),
        bonding_temperature_k: bonding.unwrap_or(temperature_k),
        temperature_k,
        resistance_drift: drift,
    })
}

pub(super) fn bridge(section: &Section) -> Result<BridgeData, Failure> {
    let layouts = [
        "quarter",
        "half",
        "half-opposite",
        "half-poisson",
        "full",
        "full-poisson",
    ];
    let word = section.word("layout", &layouts)?;
    let poisson = || {
        section
            .positive("poisson_ratio", Kind::Ratio)
            .map(|e| e.value())
    };
    let layout = match word {
        None => None,
        Some("half") => Some(BridgeLayout::HalfBending),
        Some("half-opposite") => Some(BridgeLayout::HalfOpposite),
        Some("half-poisson") => Some(BridgeLayout::HalfPoisson {
            poisson_ratio: poisson()?,
        }),
        Some("full") => Some(BridgeLayout::Full),
        Some("full-poisson") => Some(BridgeLayout::FullPoisson {
            poisson_ratio: poisson()?,
        }),
        Some(_) => Some(BridgeLayout::Quarter),
    };
    let (supply, supply_relative_std) = supply(section)?;
    let leads = leads(section)?;
    section.finish()?;
    Ok(BridgeData {
        layout,
        supply,
        supply_relative_std,
        leads,
    })
}

/// The supply and its relative standard uncertainty.
fn supply(section: &Section) -> Result<(Option<Supply>, Option<f64>), Failure> {
    let volts = section.positive_if_any("excitation", Kind::Voltage)?;
    let amperes = section.positive_if_any("excitation_current", Kind::Current)?;
    match (volts, amperes) {
        (None, None) => Ok((None, None)),
        (Some(volts), None) => {
            let std = volts.relative_std();
            let volts = volts.value();
            Ok((Some(Supply::ConstantVoltage { volts }), std))
        }
        (None, Some(amperes)) => {
            let std = amperes.relative_std();
            let amperes = amperes.value();
            Ok((Some(Supply::ConstantCurrent { amperes }), std))
        }
        (Some(_), Some(_)) => Err(section.fail(
            "excitation_current",
            "give either excitation = \"5 V\" or excitation_current = \"2 mA\"",
        )),
    }
}

fn leads(section: &Section) -> Result<Leads, Failure> {
    let wires = ["two-wire", "three-wire", "four-wire"];
    let wiring = section.word("wiring", &wires)?;
    let lead_ohm = section
        .quantity("lead_resistance", Kind::Resistance)?
        .map(|e| e.value());
    match (wiring, lead_ohm) {
        (_, None) => Ok(Leads::None),
        (Some("two-wire"), Some(lead_ohm)) => Ok(Leads::TwoWire { lead_ohm }),
        (Some("three-wire"), Some(lead_ohm)) => Ok(Leads::ThreeWire { lead_ohm }),
        (Some(_), Some(lead_ohm)) => Ok(Leads::FourWire { lead_ohm }),
        (None, Some(_)) => Err(section.fail(
            "lead_resistance",
            format_args!("give the wiring: wiring = one of {}", wires.join(", ")),
        )),
    }
}

pub(super) fn recorder(section: &Section) -> Result<RecorderData, Failure> {
    let given = gain(section)?;
    let cutoff = section.positive_if_any("low_pass", Kind::Frequency)?;
    let order = section.whole("low_pass_order")?;
    if order.is_some() && cutoff.is_none() {
        return Err(section.fail("low_pass_order", "give the cut-off: low_pass = \"5 kHz\""));
    }
    let poles = u32::try_from(order.unwrap_or(1))
        .map_err(|_| section.fail("low_pass_order", "expected a whole number from 1 to 16"))?;
    let delay = section.quantity("delay", Kind::Time)?;
    let delay_s = delay.as_ref().map_or(0.0, Estimate::value);
    let low_pass = cutoff.as_ref().map(|cutoff| LowPass {
        cutoff_hz: cutoff.value(),
        order: poles,
    });
    let recorder = Recorder::new(
        given.as_ref().map_or(1.0, Estimate::value),
        low_pass,
        delay_s,
    )
    .map_err(|error| section.fail("", error))?;
    let input_resistance = section.positive_if_any("input_resistance", Kind::Resistance)?;
    let zero = TransducerSignal::read(section, "zero")?;
    section.finish()?;
    Ok(RecorderData {
        recorder,
        low_pass,
        cutoff_std_hz: cutoff.and_then(|cutoff| cutoff.std_uncertainty()),
        delay_std_s: delay.and_then(|delay| delay.std_uncertainty()),
        has_gain: given.is_some(),
        is_order_assumed: low_pass.is_some() && order.is_none(),
        gain_relative_std: given.and_then(|gain| gain.relative_std()),
        input_resistance_ohm: input_resistance.map(|ohm| ohm.value()),
        zero,
    })
}

/// Gain of the amplifier, negative if it inverts.
fn gain(section: &Section) -> Result<Option<Estimate>, Failure> {
    let given = section.quantity("gain", Kind::Gain)?;
    match &given {
        Some(gain) if gain.value().abs() < LEAST_GAIN => Err(section.fail(
            "gain",
            "an amplifier between bridge and record has a gain of 10 to 10000, and this one is below 0.01; the gain is recorded \
             volts per volt of the bridge: an amplifier that gives 10 V at 2 mV/V with a supply of 5 V has 10 V/(2 mV/V x 5 V) \
             = 1000",
        )),
        _ => Ok(given),
    }
}
