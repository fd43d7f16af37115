//! Terms that the equation of motion lacks, if they matter.

use super::regression::Corrected;
use super::windows::{FittedRows, WindowRows};
use crate::identify::rms;

/// Minimum significant coefficient in standard uncertainties.
const CLEAR: f64 = 6.0;
/// A term matters if it reduces the residual to less than this fraction, or changes a constant by more than this
/// number of its standard uncertainties.
const MATTERS: (f64, f64) = (0.85, 3.0);

/// A fit with one more term.
pub(super) struct MissingTerm {
    /// Its coefficient.
    pub coefficient: f64,
    /// The parameters fitted together with it.
    pub values: Vec<f64>,
    /// Rms residual.
    left: f64,
}

/// The term that the equation lacks.
pub(super) enum Missing {
    /// A shift between the channels: `T(t + τ) ≈ T + τ T'`. The coefficient is −τ, the delay of the torque in s.
    Delay(MissingTerm),
    /// Drag, `c θ' |θ'|`.
    Drag(MissingTerm),
}

impl FittedRows {
    /// The term that matters and leaves the smallest residual.
    pub fn missing(&self) -> Option<Missing> {
        let delay = self.with("delay", &self.rows.slope);
        let drag = self.rows.drag.as_ref();
        let drag = drag.and_then(|drag| self.with("drag", drag));
        match (delay, drag.filter(|drag| drag.coefficient > 0.0)) {
            (Some(delay), Some(drag)) if drag.left < delay.left => Some(Missing::Drag(drag)),
            (Some(delay), _) => Some(Missing::Delay(delay)),
            (None, drag) => drag.map(Missing::Drag),
        }
    }

    /// The fit with one more term, if it matters.
    fn with(&self, name: &'static str, column: &[f64]) -> Option<MissingTerm> {
        let rows = &self.rows;
        let with = WindowRows {
            columns: [&rows.columns[..], &[column.to_vec()]].concat(),
            orders: [&rows.orders[..], &[None]].concat(),
            names: [&rows.names[..], &[name]].concat(),
            right: rows.right.clone(),
            slope: Vec::new(),
            drag: None,
            moves: Vec::new(),
            clean: Vec::new(),
            window: rows.window.clone(),
            ..*rows
        };
        let found = with.solve(&self.used).ok()?;
        let mut values = found.numbers.values().to_vec();
        let std = |fit: &Corrected, k: usize| fit.numbers.covariance().std(k);
        let std_of_term = std(&found, values.len() - 1)?;
        let coefficient = values.pop()?;
        let left = |fit: &Corrected| rms(&self.used(&fit.residuals));
        let is_less = left(&found) < MATTERS.0 * left(&self.fit);
        let mut changes = values.iter().zip(self.fit.numbers.values()).enumerate();
        let moves = changes.any(|(k, (new, old))| {
            std(&self.fit, k).is_some_and(|std| (new - old).abs() > MATTERS.1 * std)
        });
        let is_clear = coefficient.abs() > CLEAR * std_of_term;
        (is_clear && (is_less || moves)).then(|| MissingTerm {
            coefficient,
            values,
            left: left(&found),
        })
    }
}
