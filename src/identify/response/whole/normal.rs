//! Normal equations over all lines, with the transient of each record eliminated.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixView, DVector, Dyn};
use num_complex::Complex64;

use super::Spectra;
use super::line::{ParameterValues, Parameters};
use crate::identify::response::inverse::invert;
use crate::parallel::{in_parts, threads};

/// Number of lines multiplied at once.
const AT_ONCE: usize = 256;
/// Lines per job; the parts are added in order, so the result does not depend on the threads.
pub(super) const PART: usize = 64 * AT_ONCE;

/// A slice of numbers as a matrix with arbitrary strides.
type View<'a> = DMatrixView<'a, f64, Dyn, Dyn>;

/// Products of the columns of a record; the residual is the last column.
pub(super) struct Gram(DMatrix<f64>);

impl Gram {
    /// Gram matrices of all records.
    pub fn all(layout: &Parameters, all: &[Spectra], state: &ParameterValues) -> Vec<Self> {
        let one = |(record, spectra)| Self::of(layout, spectra, state, record);
        all.iter().enumerate().map(one).collect()
    }

    fn of(layout: &Parameters, spectra: &Spectra, state: &ParameterValues, record: usize) -> Self {
        let parts = in_parts(spectra.omega.len(), PART, threads(), |lines| {
            Self::of_lines(layout, spectra, state, record, lines)
        });
        let rows = layout.columns() + 1;
        Self(
            parts
                .iter()
                .fold(DMatrix::zeros(rows, rows), |sum, p| sum + p),
        )
    }

    fn of_lines(
        layout: &Parameters,
        spectra: &Spectra,
        state: &ParameterValues,
        record: usize,
        lines: Range<usize>,
    ) -> DMatrix<f64> {
        let rows = layout.columns() + 1;
        let mut sum = DMatrix::zeros(rows, rows);
        let mut line = vec![Complex64::ZERO; rows];
        let mut values = vec![0.0; 2 * AT_ONCE * rows];
        for first in lines.clone().step_by(AT_ONCE) {
            let last = (first + AT_ONCE).min(lines.end);
            for k in first..last {
                layout.fill(spectra, state, record, k, &mut line);
                let at = 2 * (k - first) * rows;
                let (real, imaginary) = values[at..at + 2 * rows].split_at_mut(rows);
                let weight = spectra.weight[k];
                for ((value, re), im) in line.iter().zip(real).zip(imaginary) {
                    (*re, *im) = (weight * value.re, weight * value.im);
                }
            }
            let count = 2 * (last - first);
            let part = DMatrixView::from_slice(&values, rows, count);
            let across = View::from_slice_with_strides(&values, count, rows, rows, 1);
            sum.gemm(1.0, &part, &across, 1.0);
        }
        sum
    }

    /// Sum of squares of the residual.
    pub fn cost(all: &[Self]) -> f64 {
        all.iter()
            .map(|g| g.0[(g.0.nrows() - 1, g.0.nrows() - 1)])
            .sum()
    }
}

/// A step, and the covariance of the parameters.
pub(super) struct Solved {
    /// Step of the shared parameters.
    pub step: DVector<f64>,
    /// Step of the parameters of each record's transient.
    pub own: Vec<DVector<f64>>,
    /// Covariance of the shared parameters, if the weights are those of the noise.
    pub covariance: DMatrix<f64>,
}

/// Regularisation of a transient's equations with a diagonal scaled to 1: the transient of a broad mode is nearly the
/// same as the smooth part, and separating them is unnecessary.
const REGULARISATION: f64 = 1e-12;

impl Solved {
    /// Solves the normal equations; `None` if they are singular.
    pub fn of(layout: &Parameters, all: &[Gram]) -> Option<Self> {
        let (own, shared) = (layout.own(), layout.shared());
        let mut rest = DMatrix::zeros(shared, shared + 1);
        let mut made_up = Vec::with_capacity(all.len());
        for Gram(products) in all {
            let cross = products.view((0, own), (own, shared + 1));
            let by_others =
                invert(&products.view((0, 0), (own, own)).into(), REGULARISATION)? * cross;
            rest += products.view((own, own), (shared, shared + 1));
            rest -= products.view((own, 0), (shared, own)) * &by_others;
            made_up.push(by_others);
        }
        let free = layout.free();
        let of_free = invert(&rest.select_columns(&free).select_rows(&free), 0.0)?;
        let mut covariance = DMatrix::zeros(shared, shared);
        for (i, a) in free.iter().enumerate() {
            for (j, b) in free.iter().enumerate() {
                covariance[(*a, *b)] = of_free[(i, j)];
            }
        }
        let step = &covariance * rest.column(shared);
        let of_record =
            |made_up: &DMatrix<f64>| made_up.column(shared) - made_up.columns(0, shared) * &step;
        Some(Self {
            own: made_up.iter().map(of_record).collect(),
            step,
            covariance,
        })
    }

    /// The largest step of a pole or the delay relative to its standard uncertainty, for this variance of the weighted
    /// noise.
    pub fn largest_step(&self, layout: &Parameters, variance: f64) -> f64 {
        let one = |i: usize| self.step[i].abs() / (variance * self.covariance[(i, i)]).sqrt();
        (0..layout.searched()).map(one).fold(0.0, f64::max)
    }
}
