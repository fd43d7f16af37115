//! Units of the two channels.

use crate::print::{unit_of_quotient, unit_or_as_recorded};

#[derive(Debug, Clone)]
pub struct ChannelUnits {
    /// Of the applied quantity, in the files; empty if unknown.
    pub applied: String,
    /// Of the measured quantity, in the files; empty if unknown.
    pub measured: String,
    /// Of the measured quantity in the diagnosis: torque, or the SI unit.
    pub diagnosed: String,
    /// Whether applied and measured quantity are torques, the latter after calibration.
    pub is_torque: bool,
    /// Diagnosed units per printed unit.
    pub per_printed: f64,
    /// SI units per file unit, applied and measured.
    pub factors: [f64; 2],
}

impl ChannelUnits {
    /// Unit of the printed errors.
    pub fn printed(&self) -> String {
        match self.diagnosed.as_str() {
            "N m" => self.diagnosed.clone(),
            _ => self.measured.clone(),
        }
    }

    /// Unit of the printed static gain, and printed units per SI unit.
    pub fn gain(&self) -> (String, f64) {
        let [applied, measured] = self.factors;
        let unit = match (self.measured.as_str(), self.applied.as_str()) {
            ("", "") => unit_or_as_recorded("").to_owned(),
            (measured, "") => format!("{measured} per applied unit"),
            ("", applied) => format!("measured unit per {applied}"),
            both => unit_of_quotient(both),
        };
        (unit, applied / measured)
    }
}
