//! The standard uncertainty of the result in words.

use std::fmt::Write;

use super::report::{CompensateReport, NoiseAt};
use crate::inverse::ResultStd;
use crate::print::rounded;
use crate::stand::ConstantStd;

impl CompensateReport {
    /// Standard uncertainty of the result due to stand, calibration and zero.
    pub(super) fn uncertainty_text(&self) -> String {
        let text = self.of_stand_text();
        match self.zero_std {
            Some(std) => format!(
                "{text}; the zero adds {} {}, the same for every sample",
                rounded(std, 2),
                self.unit
            ),
            None => text,
        }
    }

    /// The same without the zero.
    fn of_stand_text(&self) -> String {
        if let Some(found) = &self.result_std {
            return self.result_std_text(found);
        }
        let listed = |std: fn(&NoiseAt) -> Option<f64>| {
            let at = |g: &NoiseAt| {
                let std = rounded(100.0 * std(g)?, 2);
                Some(format!("{std} % at {} Hz", rounded(g.frequency_hz, 4)))
            };
            let known: Vec<&NoiseAt> = self
                .noise
                .gain
                .iter()
                .filter(|g| std(g).is_some())
                .collect();
            let (first, last) = (*known.first()?, *known.last()?);
            // Near the resonance it may be many times larger than at both ends.
            let is_larger = |g: &&NoiseAt| std(g) > std(first) && std(g) > std(last);
            let largest = self.noise.largest_std.as_ref().filter(is_larger);
            let each = [Some(first), largest, Some(last).filter(|_| known.len() > 1)];
            let each: Vec<String> = each.into_iter().flatten().filter_map(at).collect();
            Some(each.join(", "))
        };
        let total = listed(|g| g.relative_std);
        match (total, listed(|g| g.response_relative_std)) {
            (Some(total), _) if self.constant == ConstantStd::NotNeeded => format!(
                "{total} (standard uncertainty of the stand's response; that of the recorded torque is unknown)"
            ),
            (Some(total), _) => {
                format!("{total} (standard uncertainty of stand and calibration)")
            }
            (None, Some(response)) => format!(
                "unknown, since the calibration has no std in the stand file; that of the stand's response alone is {response}"
            ),
            (None, None) => "unknown: the stand file gives no std".to_owned(),
        }
    }

    /// The same for effects that no filter describes.
    fn result_std_text(&self, found: &ResultStd) -> String {
        let unit = &self.unit;
        let over = match found.samples < self.samples {
            true => format!(
                " over the first {} s",
                rounded(found.samples as f64 / self.rate_hz, 3)
            ),
            false => String::new(),
        };
        let mut text = match (found.rms.zip(found.largest), found.of_response_rms) {
            (Some((rms, largest)), _) => format!(
                "{} {unit} rms, at most {} {unit}{over} (standard uncertainty of stand, effects and calibration)",
                rounded(rms, 2),
                rounded(largest, 2)
            ),
            (None, Some(response)) => format!(
                "unknown, since the calibration has no std in the stand file; that of stand and effects alone is {} {unit} rms{over}",
                rounded(response, 2)
            ),
            (None, None) => "unknown".to_owned(),
        };
        if !found.left_out.is_empty() {
            let _ = write!(
                text,
                "; {} cannot be varied by the given std",
                found.left_out.join(", ")
            );
        }
        if !found.bent.is_empty() {
            let _ = write!(
                text,
                "; approximate, since the result is not linear in {} over its std",
                found.bent.join(", ")
            );
        }
        text
    }
}
