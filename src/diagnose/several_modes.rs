//! A stand with several modes.
//!
//! A fit moves the first mode, as for a single-mode stand. The parameters of the further ones are fitted in full once,
//! before the search for effects. With effects they change little: a fit then includes them linearly, as columns shared
//! by the residuals of all records, and corrects them at its end.

use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

use torqcomp_dsp::dot;
use torqcomp_model::fit::FitError;
use torqcomp_model::{Chain, Estimate, ModalPart, ModalResponse, Mode, StandRun};

use super::columns::Columns;
use super::fit::{FitEffort, FittedModel, START_SETTLED, fit};
use super::record::{Nuisance, StandRecord};
use super::records::Records;
use super::score::ScoredModel;
use super::structure::{FitContext, Structure};
use super::unexplained::raw_residuals;

/// All modes of a stand.
#[derive(Debug, Clone)]
pub struct SeveralModes {
    /// The first is that of the plain stand except for its contribution to the response.
    pub parts: Vec<ModalPart>,
    /// Standard uncertainties of frequency in Hz, damping ratio, residue and quadrature of each, if fitted.
    pub stds: Vec<[Option<f64>; 4]>,
    /// Whether the contributions follow from fixed mode shapes at load and gage.
    pub has_shapes: bool,
    /// Whether they are fit parameters.
    pub are_free: bool,
}

/// A fit of all modes together with the effects found.
const IN_FULL: FitEffort = FitEffort::full(30);

/// Ratio of the error after such a fit to that before, up to which it is accepted.
const AS_GOOD: f64 = 1.001;

/// Bounds of a natural frequency relative to its previous value, of a damping ratio, and of the two parts of
/// a residue.
const BOUNDS: [[f64; 2]; 4] = [[0.8, 1.25], [0.0, 1.0], [-1e3, 1e3], [-1e3, 1e3]];

/// Units of the parameters of a mode.
const UNITS: [&str; 4] = ["Hz", "", "", ""];

impl SeveralModes {
    /// The modes of a stand that has more than one.
    pub fn of(response: &ModalResponse, has_shapes: bool) -> Option<Self> {
        let parts = response.parts().to_vec();
        response.only().is_none().then(|| Self {
            stds: vec![[None; 4]; parts.len()],
            parts,
            has_shapes,
            are_free: false,
        })
    }

    /// Whether the response of the gage to a torque at the gage is known.
    pub fn show_torques(&self) -> bool {
        self.parts.iter().all(|part| part.at_gage.is_some())
    }

    /// The modes other than the first.
    pub fn further(&self) -> impl Iterator<Item = Mode> {
        self.parts[1..].iter().map(|part| part.mode)
    }

    /// Fit parameters, as mode and index among frequency, damping ratio, residue and quadrature. Frequency and damping
    /// of the first mode are the plain stand's; residues follow from mode shapes.
    fn moved(&self) -> Vec<(usize, usize)> {
        let is_moved = |(mode, number): &(usize, usize)| match number {
            0 | 1 => *mode > 0,
            2 => !self.has_shapes,
            _ => true,
        };
        let of_mode = |mode| (0..4).map(move |number| (mode, number));
        let all = (0..self.parts.len()).filter(|_| self.are_free);
        all.flat_map(of_mode).filter(is_moved).collect()
    }

    /// Number of fit parameters.
    pub fn count(&self) -> usize {
        self.moved().len()
    }

    /// Values of the fit parameters.
    pub fn values(&self) -> Vec<f64> {
        let value = |(mode, number): (usize, usize)| {
            let part = &self.parts[mode];
            [1.0, part.mode.damping_ratio, part.residue, part.quadrature][number]
        };
        self.moved().into_iter().map(value).collect()
    }

    /// Lower and upper bound of each fit parameter. Contributions that all have one sign keep it: for these, the
    /// response to torques at the gage is known.
    pub fn bounds(&self) -> Vec<[f64; 2]> {
        let keeps_sign = self.show_torques();
        let bounds = |(_, number): (usize, usize)| match number {
            2 if keeps_sign => [0.0, BOUNDS[2][1]],
            _ => BOUNDS[number],
        };
        self.moved().into_iter().map(bounds).collect()
    }

    /// All modes, from values of a fit and its first mode.
    fn with(&self, first: Mode, values: &[f64]) -> Vec<ModalPart> {
        let mut parts = self.parts.clone();
        for ((mode, number), value) in self.moved().into_iter().zip(values) {
            let part = &mut parts[mode];
            match number {
                0 => part.mode.omega_rad_s *= value,
                1 => part.mode.damping_ratio = *value,
                2 => part.residue = *value,
                _ => part.quadrature = *value,
            }
        }
        parts[0].mode = first;
        match self.has_shapes {
            true => self.follow_shapes(&mut parts),
            false => follow_residues(&mut parts),
        }
        parts
    }

    /// With fixed mode shapes, a mode's contributions go with `1/ω²`, normalised by their sums.
    fn follow_shapes(&self, parts: &mut [ModalPart]) {
        let was = self.parts.iter().map(|part| part.mode.omega_rad_s);
        let softer = was.zip(&*parts);
        let softer: Vec<f64> = softer
            .map(|(was, part)| (was / part.mode.omega_rad_s).powi(2))
            .collect();
        let sum = |of: fn(&ModalPart) -> f64| -> f64 {
            let both = parts.iter().zip(&softer);
            both.map(|(part, softer)| softer * of(part)).sum()
        };
        let sums = [sum(|p| p.residue), sum(|p| p.at_gage.unwrap_or(0.0))];
        for (part, softer) in parts.iter_mut().zip(&softer) {
            part.residue *= softer / sums[0];
            part.at_gage = part.at_gage.map(|at_gage| at_gage * softer / sums[1]);
        }
    }

    /// The response, from values of a fit and its first mode.
    pub fn response(&self, first: Mode, values: &[f64]) -> ModalResponse {
        ModalResponse::new(self.with(first, values))
            .expect("modes within the bounds of a fit are modes")
    }

    /// The same with another first mode.
    pub fn with_first(&self, first: Mode) -> Self {
        Self {
            parts: self.with(first, &self.values()),
            ..self.clone()
        }
    }

    /// Frequency in Hz, damping ratio, residue and quadrature of each mode.
    pub fn numbers(&self) -> impl Iterator<Item = [f64; 4]> {
        self.parts.iter().map(|part| {
            let hz = part.mode.natural_frequency_hz();
            [hz, part.mode.damping_ratio, part.residue, part.quadrature]
        })
    }

    /// The same with standard uncertainties.
    pub fn estimates(&self) -> Vec<[Estimate; 4]> {
        let both = self.numbers().zip(&self.stds);
        let of_mode = |(numbers, stds): ([f64; 4], &[Option<f64>; 4])| {
            std::array::from_fn(|k| Estimate::of(UNITS[k], numbers[k], stds[k]))
        };
        both.map(of_mode).collect()
    }

    /// The same with changed parameters, clamped to the bounds.
    fn changed(&self, changes: &[f64]) -> Self {
        let free = Self {
            are_free: true,
            ..self.clone()
        };
        let both = free.values().into_iter().zip(changes).zip(free.bounds());
        let values =
            both.map(|((value, change), [lower, upper])| (value + change).clamp(lower, upper));
        let values: Vec<f64> = values.collect();
        Self {
            parts: free.with(self.parts[0].mode, &values),
            ..self.clone()
        }
    }

    /// The fitted modes, which are fixed from here on.
    fn found(&self, fitted: &FittedModel, of_modes: Range<usize>) -> Self {
        let mut stds = self.stds.clone();
        let places = self.moved().into_iter().zip(&fitted.std[of_modes.clone()]);
        for ((mode, number), std) in places {
            let scale = match number {
                0 => self.parts[mode].mode.omega_rad_s / TAU,
                _ => 1.0,
            };
            stds[mode][number] = std.map(|std| std * scale);
        }
        Self {
            parts: self.with(fitted.mode(), &fitted.values[of_modes]),
            stds,
            has_shapes: self.has_shapes,
            are_free: false,
        }
    }
}

/// If load and gage count as one place, each mode's contribution there is its residue.
fn follow_residues(parts: &mut [ModalPart]) {
    let sum: f64 = parts.iter().map(|part| part.residue).sum();
    for part in parts.iter_mut().filter(|part| part.at_gage.is_some()) {
        part.at_gage = (sum > 0.0).then(|| part.residue / sum);
    }
}

/// Derivatives of the residuals with respect to modes that a fit does not move.
pub struct ModeSlopes {
    columns: Columns,
    several: SeveralModes,
}

/// Finite-difference step of the mode parameters.
const STEP: f64 = 1e-6;

impl ModeSlopes {
    /// For records with their nuisance terms, at values of the other parameters; `None` for a single-mode stand, or if
    /// a fit moves all modes.
    pub fn of(
        structure: &Structure,
        values: &[f64],
        records: &[StandRecord],
        nuisance: &[Nuisance],
    ) -> Option<Self> {
        let several = structure
            .context
            .several
            .as_ref()
            .filter(|all| !all.are_free)?;
        let of_record = |(record, nuisance): (&StandRecord, &Nuisance)| {
            let mut slopes = slopes_of_modes(structure, values, record)?;
            slopes.iter_mut().for_each(|slope| nuisance.clear(slope));
            Some(slopes)
        };
        let both = records.iter().zip(nuisance);
        let of_records = both.map(of_record).collect::<Option<Vec<_>>>()?;
        let count = of_records.first()?.len();
        let along = |k: usize| -> Vec<f64> {
            let parts = of_records.iter().map(|slopes| slopes[k].as_slice());
            parts.collect::<Vec<_>>().concat()
        };
        Some(Self {
            columns: (0..count).map(along).collect(),
            several: several.clone(),
        })
    }

    /// Removes from the residuals of all records what a change of the modes would explain.
    pub fn clear(&self, residuals: &mut [f64]) {
        self.columns.clear(residuals);
    }

    /// The modes that minimise the residuals, and whether the improvement is worth another fit.
    pub fn modes(&self, residuals: &mut [f64]) -> (SeveralModes, bool) {
        let before = dot(residuals, residuals);
        let changes = self.columns.fit(residuals);
        let changes: Vec<f64> = changes.iter().map(|change| -change).collect();
        let matters = dot(residuals, residuals) < (1.0 - START_SETTLED) * before;
        (self.several.changed(&changes), matters)
    }
}

/// Derivatives of the raw residual of a record with respect to each parameter of the modes that a fit
/// does not move; empty for a single-mode stand.
pub fn slopes_of_modes(
    structure: &Structure,
    values: &[f64],
    record: &StandRecord,
) -> Option<Vec<Vec<f64>>> {
    let context = Arc::new(structure.context.with_modes_free());
    let several = context.several.as_ref()?;
    let count = context.constant_count();
    let start = [&values[..count], &several.values(), &values[count..]].concat();
    let mut points = vec![start; several.count() + 1];
    for (k, point) in points[1..].iter_mut().enumerate() {
        point[count + k] += STEP;
    }
    let structure = structure.clone().in_context(context.clone());
    let chains: Vec<Chain> = points.iter().map(|p| structure.model(p).0).collect();
    let runs: Vec<StandRun> = chains.iter().map(|chain| record.run_of(chain)).collect();
    let residuals = raw_residuals(&runs, record).into_iter();
    let residuals = residuals.collect::<Result<Vec<_>, _>>().ok()?;
    let along = |there: &Vec<f64>| {
        let pairs = there.iter().zip(&residuals[0]);
        pairs.map(|(a, b)| (a - b) / STEP).collect()
    };
    Some(residuals[1..].iter().map(along).collect())
}

impl Structure {
    /// The same with other modes.
    pub fn with_modes(self, several: SeveralModes) -> Self {
        let context = FitContext {
            several: Some(several),
            ..(*self.context).clone()
        };
        self.in_context(Arc::new(context))
    }

    /// The same in another context.
    pub fn in_context(self, context: Arc<FitContext>) -> Self {
        Self { context, ..self }
    }
}

/// Fits a model with all parameters of all modes; those of the further modes are fixed from then
/// on.
///
/// # Errors
/// If the model cannot be evaluated at the start.
pub fn fit_with_modes(
    structure: Structure,
    start: &[f64],
    records: &[StandRecord],
    effort: FitEffort,
) -> Result<FittedModel, FitError> {
    let context = &structure.context;
    let Some(several) = &context.several else {
        return fit(structure, start, records, effort);
    };
    let count = context.constant_count();
    let free = Arc::new(context.with_modes_free());
    let values = free.several.iter().flat_map(SeveralModes::values);
    let values: Vec<f64> = values.collect();
    let mut found = fit(
        structure.clone().in_context(free.clone()),
        &[&start[..count], &values, &start[count..]].concat(),
        records,
        effort,
    )?;
    let freed = count..count + values.len();
    let found_modes = SeveralModes {
        are_free: true,
        ..several.clone()
    };
    let found_modes = found_modes.found(&found, freed.clone());
    found.values.drain(freed.clone());
    found.std.drain(freed);
    found.structure = structure.with_modes(found_modes);
    Ok(found)
}

impl ScoredModel {
    /// The model refitted with all parameters of all modes, which gives their uncertainties, unless the residual
    /// increases; unchanged for a single-mode stand.
    pub fn with_modes_fitted(&self, records: &Records) -> Self {
        let fitted = &self.fitted;
        if fitted.structure.context.several.is_none() {
            return self.clone();
        }
        let train = fitted.with_initial_states(&records.train);
        let found = fit_with_modes(fitted.structure.clone(), &fitted.values, &train, IN_FULL).ok();
        let found = found.and_then(|found| Self::of(found, records));
        let is_as_good = |found: &Self| found.train_rms() <= AS_GOOD * self.train_rms();
        found.filter(is_as_good).unwrap_or_else(|| self.clone())
    }
}
