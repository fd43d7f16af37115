//! The components as a table for people.

use std::fmt::Write;

use super::{ComponentTorque, HarmonicsReport};
use crate::print::{Report, columns, rounded, short};
use crate::stand::ConstantStd;

impl Report for HarmonicsReport {
    const SCHEMA: &'static str = "torqcomp.harmonics/1";

    fn text(&self) -> String {
        let std = self
            .fundamental_std_hz
            .map_or_else(String::new, |std| format!(" ± {}", rounded(std, 2)));
        let mut text = format!(
            "{}, {} in {}, taken as {}: {} samples at {} Hz, {} s\n\
             torque = mean + sum of A cos(2 pi f t + phase), A being the peak, t = 0 at {}\n\
             fundamental {}{std} Hz, mean {} {}, residual {} {} rms\n\
             uncertainty of stand and calibration: {}\n\n",
            self.input,
            self.channel,
            self.channel_unit,
            self.taken_as_text(),
            self.samples,
            short(self.rate_hz),
            rounded(self.duration_s, 5),
            self.phase_reference,
            rounded(self.fundamental_hz, 9),
            rounded(self.mean, 5),
            self.unit,
            rounded(self.residual_rms, 3),
            self.unit,
            self.uncertainty_text()
        );
        let of_stand = self.std_column();
        let unit = &self.unit;
        let mut head: Vec<String> = ["order", "Hz"].map(str::to_owned).to_vec();
        head.extend([
            format!("recorded {unit}"),
            "factor".to_owned(),
            format!("torque {unit}"),
            "± noise".to_owned(),
        ]);
        head.extend(of_stand.map(str::to_owned));
        head.extend(["phase deg".to_owned(), "± noise".to_owned()]);
        head.extend(of_stand.map(str::to_owned));
        let mut rows = vec![head];
        rows.extend(self.components.iter().map(|c| c.cells(of_stand.is_some())));
        let _ = write!(text, "{}", columns(&rows));
        text
    }
}

impl HarmonicsReport {
    /// Heading of the column of uncertainties due to the stand, if any.
    fn std_column(&self) -> Option<&'static str> {
        if self.components.iter().any(|c| c.std_stand.is_some()) {
            return Some("± stand");
        }
        let has_response = self.components.iter().any(|c| c.std_response.is_some());
        has_response.then_some("± response")
    }

    fn uncertainty_text(&self) -> String {
        let constant = match (self.constant, self.std_column()) {
            (_, None) => return "unknown (no std is given)".to_owned(),
            (ConstantStd::Relative(std), _) => format!("{} %", rounded(100.0 * std, 2)),
            (ConstantStd::NotNeeded, _) => {
                return "unknown for the recorded torque; columns \"± stand\": response alone"
                    .to_owned();
            }
            (ConstantStd::Unknown, _) => {
                return "unknown: the calibration has no std; columns \"± response\": response alone".to_owned();
            }
        };
        format!(
            "static constant {constant}; columns \"± stand\": static constant and response together"
        )
    }

    fn taken_as_text(&self) -> String {
        match &self.stand {
            Some(stand) => format!("{} (the response of {stand} is divided out)", self.taken_as),
            None => format!("{} (no stand is divided out)", self.taken_as),
        }
    }
}

impl ComponentTorque {
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
            let std = self.std_stand.or(self.std_response);
            cells.push(std.map_or_else(|| "unknown".to_owned(), |s| rounded(s, 2)));
        }
        cells.push(format!("{:.2}", self.phase_deg));
        cells.push(
            self.phase_std_deg
                .map_or_else(|| "lost".to_owned(), |s| rounded(s, 2)),
        );
        if with_stand {
            let std = self.phase_std_stand_deg;
            cells.push(std.map_or_else(|| "unknown".to_owned(), |s| rounded(s, 2)));
        }
        cells
    }
}
