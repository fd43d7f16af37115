//! Residuals of a model as the objective of a fit.

use torqcomp_model::fit::{FitError, Residuals};
use torqcomp_model::{Chain, Mode, StandRun};

use super::own_of_records::OwnOfRecords;
use super::record::{Nuisance, NuisanceTerms, StandRecord, StateSlopes};
use super::record_model::RecordModel;
use super::several_modes::{ModeSlopes, SeveralModes};
use super::structure::Structure;

/// Residuals of a structure on the records, without nuisance terms.
pub struct Unexplained<'a> {
    structure: &'a Structure,
    records: &'a [StandRecord],
    of_records: &'a OwnOfRecords,
    /// The nuisance terms of each record in the fixed mode of its free motion, if not in that of the parameters.
    fixed: Option<Vec<Nuisance>>,
    /// Derivatives of all residuals with respect to modes that the fit does not move.
    modes: Option<ModeSlopes>,
}

impl<'a> Unexplained<'a> {
    pub fn of(
        (structure, start): (&'a Structure, &[f64]),
        records: &'a [StandRecord],
        of_records: &'a OwnOfRecords,
        free: Option<&'a Mode>,
    ) -> Self {
        let mut problem = Self {
            structure,
            records,
            of_records,
            fixed: None,
            modes: None,
        };
        // Except for lines, drift and decays, the nuisance terms depend on the parameters through their mode
        // alone.
        problem.fixed = free.map(|free| {
            let model = RecordModel::of(structure, start, *free);
            let terms = model.terms.clone().lasting();
            let of = |(k, record): (usize, &StandRecord)| {
                let slopes = || model.slopes_of_motion(record);
                problem.nuisance((k, record), free, &terms, slopes)
            };
            records.iter().enumerate().map(of).collect()
        });
        let fixed = problem.fixed.as_deref().unwrap_or_default();
        problem.modes = ModeSlopes::of(structure, start, records, fixed);
        problem
    }

    fn nuisance(
        &self,
        (k, record): (usize, &StandRecord),
        free: &Mode,
        terms: &NuisanceTerms,
        slopes: impl FnOnce() -> Option<StateSlopes>,
    ) -> Nuisance {
        match self.of_records.is_ringing(k) {
            true => record.nuisance_beside_motion(terms),
            false => record.nuisance(free, terms, slopes()),
        }
    }
}

impl Residuals for Unexplained<'_> {
    fn residuals(&self, values: &[f64], out: &mut Vec<f64>) -> Result<(), FitError> {
        let one = self.residuals_of_each(&[values.to_vec()]).into_iter();
        out.append(&mut one.last().expect("one for the point")?);
        Ok(())
    }

    fn residuals_of_each(&self, points: &[Vec<f64>]) -> Vec<Result<Vec<f64>, FitError>> {
        self.of_all_records(points, true)
    }
}

impl Unexplained<'_> {
    /// The modes that minimise the residuals, and whether the improvement is worth another fit; `None` if all modes are
    /// moved by the fit, or the motion diverges.
    pub fn corrected_modes(&self, values: &[f64]) -> Option<(SeveralModes, bool)> {
        let modes = self.modes.as_ref()?;
        let residuals = self.of_all_records(&[values.to_vec()], false).pop()?;
        Some(modes.modes(&mut residuals.ok()?))
    }

    /// The residuals of all records, with or without removing what a change of other modes would
    /// explain.
    fn of_all_records(
        &self,
        points: &[Vec<f64>],
        clears_modes: bool,
    ) -> Vec<Result<Vec<f64>, FitError>> {
        let own = self.structure.bounds().len();
        let split = points.iter().map(|values| values.split_at(own));
        let models = split.map(|(values, others)| (self.structure.model(values), others));
        let models: Vec<_> = models.collect();
        let of_record = |k: usize| self.of_record(k, &models).into_iter();
        let mut records: Vec<_> = (0..self.records.len()).map(of_record).collect();
        let each = points.iter().map(|_| {
            let of_records = records.iter_mut().filter_map(Iterator::next);
            let mut parts = of_records.collect::<Result<Vec<_>, _>>()?;
            let mut whole = match parts.len() {
                1 => parts.pop().unwrap_or_default(),
                _ => parts.concat(),
            };
            if let Some(modes) = self.modes.as_ref().filter(|_| clears_modes) {
                modes.clear(&mut whole);
            }
            Ok(whole)
        });
        each.collect()
    }

    /// Residuals of models on record `k`, each with its own values of the record's parameters.
    fn of_record(
        &self,
        k: usize,
        models: &[((Chain, NuisanceTerms), &[f64])],
    ) -> Vec<Result<Vec<f64>, FitError>> {
        let set = models
            .iter()
            .map(|(_, others)| self.of_records.set(k, &self.records[k], others));
        let records: Vec<StandRecord> = set.collect();
        let both = || models.iter().zip(&records);
        let runs: Vec<StandRun> = both()
            .map(|(((chain, _), _), record)| record.run_of(chain))
            .collect();
        let mut residuals = raw_residuals(&runs, &self.records[k]);
        // Most of the models do not differ in the parameters that affect these.
        let mut last: Option<(&NuisanceTerms, Nuisance)> = None;
        for (residual, (((chain, terms), _), record)) in residuals.iter_mut().zip(both()) {
            let Ok(residual) = residual else { continue };
            let Some(fixed) = &self.fixed else {
                let free = chain.free_mode();
                let nuisance = self.nuisance((k, record), &free, terms, || None);
                nuisance.clear(residual);
                continue;
            };
            let known = last.take().filter(|(of, _)| *of == terms);
            let moved = || record.with_moved_terms(fixed[k].clone(), terms);
            let (_, nuisance) = last.insert(known.unwrap_or_else(|| (terms, moved())));
            nuisance.clear(residual);
        }
        residuals
    }
}

/// Measured minus modelled record over its range, including nuisance terms.
pub fn raw_residual(model: &Chain, record: &StandRecord) -> Result<Vec<f64>, FitError> {
    let residual = raw_residuals(&[record.run_of(model)], record).into_iter();
    residual.last().expect("one for the model")
}

/// The same for several models.
pub fn raw_residuals(runs: &[StandRun], record: &StandRecord) -> Vec<Result<Vec<f64>, FitError>> {
    let residual = |modelled: Vec<f64>| {
        let pairs = record.measured_in_range().iter();
        let pairs = pairs.zip(&modelled[record.range.clone()]);
        let residual: Vec<f64> = pairs.map(|(y, x)| y - x).collect();
        match residual.last().is_some_and(|r| r.is_finite()) {
            true => Ok(record.weighted(residual)),
            false => Err(FitError::Model("the motion diverges".to_owned())),
        }
    };
    let modelled = Chain::simulate_all(runs, &record.input).into_iter();
    modelled.map(residual).collect()
}
