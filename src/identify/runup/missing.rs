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
        let delay = self.with(&[("delay", &self.rows.slope)]);
        let drag = self.rows.drag.as_ref();
        let drag = drag.and_then(|drag| self.with(&[("drag", drag)]));
        match (delay, drag.filter(|drag| drag.coefficient > 0.0)) {
            (Some(delay), Some(drag)) if drag.left < delay.left => Some(Missing::Drag(drag)),
            (Some(delay), _) => Some(Missing::Delay(delay)),
            (None, drag) => drag.map(Missing::Drag),
        }
    }

    /// Whether a torque that varies with the angle matters, by its part in the columns of other rows, and leaves a
    /// smaller residual than other terms.
    pub fn lacks(&self, gravity: [(&'static str, &Vec<f64>); 2]) -> bool {
        let of_other = self.missing().map_or(f64::INFINITY, |found| match found {
            Missing::Delay(term) | Missing::Drag(term) => term.left,
        });
        self.with(&gravity).is_some_and(|term| term.left < of_other)
    }

    /// The fit with more terms, if one of them matters; the coefficient is that of the last.
    fn with(&self, terms: &[(&'static str, &Vec<f64>)]) -> Option<MissingTerm> {
        let rows = &self.rows;
        let columns: Vec<Vec<f64>> = terms.iter().map(|(_, column)| column.to_vec()).collect();
        let names: Vec<&str> = terms.iter().map(|(name, _)| *name).collect();
        let with = WindowRows {
            columns: [&rows.columns[..], &columns].concat(),
            orders: [&rows.orders[..], &vec![None; terms.len()]].concat(),
            names: [&rows.names[..], &names].concat(),
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
        let added = values.split_off(rows.columns.len());
        let mut each = (rows.columns.len()..).zip(&added);
        let is_clear =
            each.any(|(k, value)| std(&found, k).is_some_and(|s| value.abs() > CLEAR * s));
        let left = |fit: &Corrected| rms(&self.used(&fit.residuals));
        let is_less = left(&found) < MATTERS.0 * left(&self.fit);
        let mut changes = values.iter().zip(self.fit.numbers.values()).enumerate();
        let moves = changes.any(|(k, (new, old))| {
            std(&self.fit, k).is_some_and(|std| (new - old).abs() > MATTERS.1 * std)
        });
        (is_clear && (is_less || moves)).then(|| MissingTerm {
            coefficient: added[added.len() - 1],
            values,
            left: left(&found),
        })
    }
}
