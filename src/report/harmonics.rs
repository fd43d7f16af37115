//! The report of a fit of component torques.

use std::fmt::Write;

use serde::Serialize;

use crate::print::{columns, rounded, short};
use crate::warning::Warning;

/// Schema of the JSON document.
pub const SCHEMA: &str = "torqcomp.harmonics/1";

/// Report of a fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Schema of this document.
    pub schema: &'static str,
    /// Version of torqcomp.
    pub version: &'static str,
    /// File that was read.
    pub input: String,
    /// Channel that was read.
    pub channel: String,
    /// Its unit in the file.
    pub channel_unit: String,
    /// Stand file.
    pub stand: String,
    /// How the record became torque at rest.
    pub calibration: String,
    /// Unit of `mean`, `recorded`, `torque`, `std` and `residual_rms`.
    pub unit: String,
    /// Samples fitted.
    pub samples: usize,
    /// Sampling rate.
    pub rate_hz: f64,
    /// Length of the record.
    pub duration_s: f64,
    /// The fundamental.
    pub fundamental_hz: f64,
    /// Its standard uncertainty, if it was found from the data.
    pub fundamental_std_hz: Option<f64>,
    /// Time that phases refer to, on the time axis of the record.
    pub phase_reference_s: f64,
    /// The constant part of the torque.
    pub mean: f64,
    /// The component torques.
    pub components: Vec<Component>,
    /// What the fit leaves over, rms, as recorded.
    pub residual_rms: f64,
    /// What should be known.
    pub warnings: Vec<Warning>,
}

/// A component torque `A cos(2πft + φ)`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Component {
    /// Frequency over the fundamental.
    pub order: f64,
    /// Frequency.
    pub frequency_hz: f64,
    /// Amplitude as recorded.
    pub recorded: f64,
    /// Phase as recorded.
    pub recorded_phase_deg: f64,
    /// Amplitude that acted over the recorded one.
    pub factor: f64,
    /// Amplitude of the torque that acted.
    pub torque: f64,
    /// Phase of the torque that acted.
    pub phase_deg: f64,
    /// Standard uncertainty of `torque` from the noise of the record.
    pub std: f64,
    /// Standard uncertainty of `phase_deg` from the noise; `null` if the component is lost in it.
    pub phase_std_deg: Option<f64>,
    /// Standard uncertainty of `torque` from the stand's constants; `null` if they have none.
    pub std_stand: Option<f64>,
    /// Standard uncertainty of `phase_deg` from the stand's constants; `null` if they have none.
    pub phase_std_stand_deg: Option<f64>,
}

impl Report {
    /// For people.
    #[must_use]
    pub fn text(&self) -> String {
        let std = self
            .fundamental_std_hz
            .map_or_else(String::new, |std| format!(" ± {}", rounded(std, 2)));
        let mut text = format!(
            "{}, {} in {}: {} samples at {} Hz, {} s\n\
             torque = mean + sum of A cos(2 pi f t + phase), A being the peak, t = 0 at {} s\n\
             fundamental {}{std} Hz, mean {} {}, residual {} {} rms\n\n",
            self.input,
            self.channel,
            self.channel_unit,
            self.samples,
            short(self.rate_hz),
            rounded(self.duration_s, 5),
            short(self.phase_reference_s),
            rounded(self.fundamental_hz, 9),
            rounded(self.mean, 5),
            self.unit,
            rounded(self.residual_rms, 3),
            self.unit
        );
        let with_stand = self.components.iter().any(|c| c.std_stand.is_some());
        let unit = &self.unit;
        let mut head: Vec<String> = ["order", "Hz"].map(str::to_owned).to_vec();
        head.extend([
            format!("recorded {unit}"),
            "factor".to_owned(),
            format!("torque {unit}"),
            "± noise".to_owned(),
        ]);
        if with_stand {
            head.push("± stand".to_owned());
        }
        head.extend(["phase deg".to_owned(), "± noise".to_owned()]);
        if with_stand {
            head.push("± stand".to_owned());
        }
        let mut rows = vec![head];
        rows.extend(self.components.iter().map(|c| c.cells(with_stand)));
        let _ = write!(text, "{}", columns(&rows));
        text
    }
}

impl Component {
    fn cells(&self, with_stand: bool) -> Vec<String> {
        let mut cells = vec![
            short(self.order),
            rounded(self.frequency_hz, 6),
            rounded(self.recorded, 5),
            rounded(self.factor, 5),
            rounded(self.torque, 5),
            rounded(self.std, 2),
        ];
        if with_stand {
            cells.push(self.std_stand.map_or_else(String::new, |s| rounded(s, 2)));
        }
        cells.push(format!("{:.2}", self.phase_deg));
        cells.push(
            self.phase_std_deg
                .map_or_else(|| "lost".to_owned(), |s| rounded(s, 2)),
        );
        if with_stand {
            let std = self.phase_std_stand_deg;
            cells.push(std.map_or_else(String::new, |s| rounded(s, 2)));
        }
        cells
    }
}
