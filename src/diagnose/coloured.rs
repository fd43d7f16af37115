//! Standard uncertainties of fitted parameters for noise with the spectrum of the training residuals.

use nalgebra::DMatrix;

use super::fit::FittedModel;
use super::records::Records;
use super::score::{ScoredModel, derivatives};
use crate::noise_colour;
use torqcomp_dsp::dot;

/// Half-width over which the spectrum of the residual is averaged, in units of the stand's decay rate `ζω₀`: noise on
/// the applied quantity peaks at its resonance.
const WIDTH: f64 = 0.5;

impl ScoredModel {
    /// Replaces the standard uncertainties by ones that allow for the colour of the training residuals, which noise on
    /// the applied quantity acquires from the stand; `records` have the weights of the fit. Those for white noise
    /// remain where the derivatives are unavailable.
    pub fn with_coloured_std(mut self, records: &Records) -> Self {
        if let Some((free, covariance)) = coloured_covariance(&self, records) {
            for (i, k) in free.iter().enumerate() {
                self.fitted.std[*k] = Some(covariance[(i, i)].sqrt());
            }
            self.uncertain_rms = uncertain_rms(&self, &free, &covariance).unwrap_or(0.0);
        }
        self
    }
}

/// RMS uncertainty of the compared records due to parameters with this covariance: with `J` their derivatives,
/// `√(tr(C JᵀJ)/n)`.
fn uncertain_rms(model: &ScoredModel, free: &[usize], covariance: &DMatrix<f64>) -> Option<f64> {
    let fitted = &model.fitted;
    let (_, terms) = fitted.structure.model(&fitted.values);
    let (mut sum, mut count) = (0.0, 0);
    for residual in model.compared().iter() {
        let nuisance = fitted.nuisance_under_load(&residual.record, &terms);
        let columns = derivatives(fitted, &residual.record, &terms, &nuisance)?;
        for (i, one) in free.iter().enumerate() {
            for (j, other) in free.iter().enumerate() {
                sum += covariance[(i, j)] * dot(&columns[*one], &columns[*other]);
            }
        }
        count += residual.samples.len();
    }
    Some((sum.max(0.0) / count.max(1) as f64).sqrt())
}

/// Indices and covariance of the parameters determined by the training records.
fn coloured_covariance(
    model: &ScoredModel,
    records: &Records,
) -> Option<(Vec<usize>, DMatrix<f64>)> {
    let fitted: &FittedModel = &model.fitted;
    let (_, terms) = fitted.structure.model(&fitted.values);
    let training = fitted.with_initial_states(&records.train);
    let each = training.iter().enumerate().map(|(k, record)| {
        let nuisance = fitted.nuisance_of_training(k, &training);
        derivatives(fitted, record, &terms, &nuisance)
    });
    let each: Vec<Vec<Vec<f64>>> = each.collect::<Option<_>>()?;
    // The frequency of a line is fitted together with its phases in each record, so it has no
    // column here.
    let moves = |k: usize| {
        each.iter()
            .any(|columns| columns[k].iter().any(|d| *d != 0.0))
    };
    let free: Vec<usize> = (0..fitted.values.len())
        .filter(|k| fitted.std[*k].is_some() && moves(*k))
        .collect();
    let rows = model.train_count();
    let mut jacobian = DMatrix::zeros(rows, free.len());
    for (mut column, k) in jacobian.column_iter_mut().zip(&free) {
        let whole = each.iter().flat_map(|columns| &columns[*k]);
        column
            .iter_mut()
            .zip(whole)
            .for_each(|(to, from)| *to = *from);
    }
    let is_weighted = training.iter().any(|record| record.whitening.is_some());
    let residuals: Option<Vec<Vec<f64>>> = match is_weighted {
        true => training
            .iter()
            .map(|r| Some(fitted.residual(r)?.samples))
            .collect(),
        false => Some(model.train().iter().map(|r| r.samples.clone()).collect()),
    };
    let residuals = residuals?;
    let all = 0..residuals.len();
    let mode = fitted.mode();
    let width_rad = WIDTH * mode.damping_ratio * mode.omega_rad_s / records.rate_hz();
    let wanted = free.len();
    let learnt = noise_colour::learn(
        &residuals,
        std::slice::from_ref(&all),
        &jacobian,
        wanted,
        Some(width_rad),
    );
    let (_, covariance) = learnt?;
    Some((free, covariance))
}
