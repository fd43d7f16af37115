//! Several modes of a response in the form of a stand file.

use torqcomp_model::{Dimension, Estimate};

use super::stand_text;
use crate::cli::identify::Findings;
use crate::failure::Failure;
use crate::identify::{MODE_NUMBERS, ModalShares, Motion, NamedEstimates};
use crate::stand::update::{self, Entry};
use crate::stand::{MODE_CORRELATIONS, TransducerSignal};
use crate::unit::NamedUnit;

/// Minimum correlation written.
const WORTH_WRITING: f64 = 0.01;

/// Known properties of the records besides the modes.
pub(super) struct WrittenModes<'a> {
    pub source: String,
    pub motion: Motion,
    /// Units of the measured and of the applied channel.
    pub units: [Option<&'a NamedUnit>; 2],
}

impl WrittenModes<'_> {
    /// Entries of the stand file.
    ///
    /// # Errors
    /// If the stand file to be updated cannot be read.
    pub(super) fn entries(
        &self,
        shares: &ModalShares,
        findings: &Findings,
    ) -> Result<Vec<Entry>, Failure> {
        let mut all = Vec::new();
        if self.motion != Motion::Displacement {
            all.push(Entry::text("mechanics", "measures", self.motion.name()));
        }
        let stand = stand_text(findings)?;
        let is_torque = self.is_torque() || stand.is_some_and(|(_, text)| update::converts(&text));
        if !is_torque {
            all.push(Entry::quantity(
                "mechanics",
                "static_gain",
                &self.gain(&shares.gain),
                &self.source,
            ));
        }
        let mode = |mode: &NamedEstimates| self.mode(mode);
        all.push(Entry::modes(shares.modes.iter().map(mode).collect()));
        Ok(all)
    }

    /// Whether the input is a torque, and the record is one or can be converted to one by a calibration.
    fn is_torque(&self) -> bool {
        let [Some(measured), Some(applied)] = self.units else {
            return false;
        };
        let is_signal = TransducerSignal::of(&measured.unit).is_some();
        applied.unit.dimension() == Dimension::TORQUE
            && (measured.unit.dimension() == Dimension::TORQUE || is_signal)
    }

    /// Static response in the units of the channels; 1 if unknown.
    fn gain(&self, gain: &Estimate) -> Estimate {
        let texts = self
            .units
            .map(|unit| unit.map_or("1", |unit| unit.text.as_str()));
        let [measured, applied] = texts.map(|text| match text.contains([' ', '/']) {
            true => format!("({text})"),
            false => text.to_owned(),
        });
        Estimate::of(
            format!("{measured}/{applied}"),
            gain.value(),
            gain.std_uncertainty(),
        )
    }

    fn mode(&self, mode: &NamedEstimates) -> Vec<Entry> {
        let numbers = MODE_NUMBERS.into_iter().zip(&mode.list);
        let mut all: Vec<Entry> = numbers
            .map(|(key, number)| Entry::measured("modes", key, &number.estimate))
            .collect();
        for (key, [i, k]) in MODE_CORRELATIONS {
            let found = mode.correlation(i, k).filter(|c| c.abs() >= WORTH_WRITING);
            all.extend(found.map(|c| Entry::number("modes", key, c)));
        }
        all.push(Entry::text("modes", "source", &self.source));
        all
    }
}
