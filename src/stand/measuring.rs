//! Reading what measures: the gage, the bridge, the recorder.

use torqcomp_dsp::bridge::{BridgeLayout, Leads, Supply};
use torqcomp_dsp::gage::Gage;
use torqcomp_dsp::recorder::{LowPass, Recorder};
use torqcomp_model::{Estimate, Kind};

use super::section::Section;
use super::{BridgeData, GageData, RecorderData};
use crate::failure::Failure;

pub(super) fn gage(section: &Section) -> Result<GageData, Failure> {
    let value = |key, kind| section.required(key, kind).map(|e: Estimate| e.value());
    let optional = |key, kind| section.quantity(key, kind).map(|e| e.map(|e| e.value()));
    // A metal-foil gage is linear, and temperature does not enter its law.
    let room = 298.15;
    let reference = optional("reference_temperature", Kind::TemperatureAbsolute)?.unwrap_or(room);
    let temperature_k = optional("temperature", Kind::TemperatureAbsolute)?.unwrap_or(reference);
    let bonding = optional("bonding_temperature", Kind::TemperatureAbsolute)?;
    let drift = optional("resistance_drift", Kind::Ratio)?.unwrap_or(0.0);
    let gage = Gage::new(
        value("gage_factor", Kind::Ratio)?,
        optional("quadratic_coefficient", Kind::Ratio)?.unwrap_or(0.0),
        reference,
        section.positive("resistance", Kind::Resistance)?.value(),
    )
    .map_err(|error| section.fail("", error))?;
    let bonded = section.positive_if_any("bonded_resistance", Kind::Resistance)?;
    section.finish()?;
    Ok(GageData {
        gage,
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
    let Some(layout) = section.word("layout", &layouts)? else {
        return Err(section.fail(
            "",
            format_args!("layout is missing; one of {}", layouts.join(", ")),
        ));
    };
    let poisson = || {
        section
            .positive("poisson_ratio", Kind::Ratio)
            .map(|e| e.value())
    };
    let layout = match layout {
        "half" => BridgeLayout::HalfBending,
        "half-opposite" => BridgeLayout::HalfOpposite,
        "half-poisson" => BridgeLayout::HalfPoisson {
            poisson_ratio: poisson()?,
        },
        "full" => BridgeLayout::Full,
        "full-poisson" => BridgeLayout::FullPoisson {
            poisson_ratio: poisson()?,
        },
        _ => BridgeLayout::Quarter,
    };
    let supply = supply(section)?;
    let leads = leads(section)?;
    section.finish()?;
    Ok(BridgeData {
        layout,
        supply,
        leads,
    })
}

fn supply(section: &Section) -> Result<Supply, Failure> {
    let volts = section.positive_if_any("excitation", Kind::Voltage)?;
    let amperes = section.positive_if_any("excitation_current", Kind::Current)?;
    match (volts, amperes) {
        (Some(volts), None) => Ok(Supply::ConstantVoltage {
            volts: volts.value(),
        }),
        (None, Some(amperes)) => Ok(Supply::ConstantCurrent {
            amperes: amperes.value(),
        }),
        _ => Err(section.fail(
            "",
            "give either excitation = \"22.5 V\" or excitation_current = \"2 mA\"",
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
            format_args!(
                "say how the wires run: wiring = one of {}",
                wires.join(", ")
            ),
        )),
    }
}

pub(super) fn recorder(section: Option<&Section>) -> Result<RecorderData, Failure> {
    let Some(section) = section else {
        let recorder = Recorder::new(1.0, None, 0.0).expect("a plain recorder is a recorder");
        return Ok(RecorderData {
            recorder,
            input_resistance_ohm: None,
            zero_v: 0.0,
        });
    };
    let optional = |key, kind| {
        section
            .positive_if_any(key, kind)
            .map(|e| e.map(|e| e.value()))
    };
    // An amplifier may invert.
    let gain = section
        .quantity("gain", Kind::Gain)?
        .map_or(1.0, |gain| gain.value());
    let cutoff = optional("low_pass", Kind::Frequency)?;
    let order = section.whole("low_pass_order")?;
    if order.is_some() && cutoff.is_none() {
        return Err(section.fail(
            "low_pass_order",
            "say where the low-pass is: low_pass = \"5 kHz\"",
        ));
    }
    let order = u32::try_from(order.unwrap_or(1))
        .map_err(|_| section.fail("low_pass_order", "expected a whole number from 1 to 16"))?;
    let delay_s = match section.quantity("delay", Kind::Time)? {
        Some(delay) => delay.value(),
        None => 0.0,
    };
    let low_pass = cutoff.map(|cutoff_hz| LowPass { cutoff_hz, order });
    let recorder =
        Recorder::new(gain, low_pass, delay_s).map_err(|error| section.fail("", error))?;
    let input_resistance_ohm = optional("input_resistance", Kind::Resistance)?;
    let zero_v = section
        .quantity("zero", Kind::Voltage)?
        .map_or(0.0, |zero| zero.value());
    section.finish()?;
    Ok(RecorderData {
        recorder,
        input_resistance_ohm,
        zero_v,
    })
}
