//! Normal equations over all lines, each record's transient taken out.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixView, DVector, Dyn};
use num_complex::Complex64;

use super::Spectra;
use super::line::{Layout, State};
use crate::identify::response::inverse::invert;
use crate::identify::response::scatter::{OfMode, Spread};
use crate::parallel::{in_parts, threads};

/// Lines that are multiplied at once.
const AT_ONCE: usize = 256;
/// Lines of a part that a thread takes; the parts are added in their order, whoever made them.
pub(super) const PART: usize = 64 * AT_ONCE;

/// Numbers seen as a matrix in any order.
type View<'a> = DMatrixView<'a, f64, Dyn, Dyn>;

/// Products of the columns of a record, what is left being the last one.
pub(super) struct Gram(DMatrix<f64>);

impl Gram {
    /// Those of all records.
    pub fn all(layout: &Layout, all: &[Spectra], state: &State) -> Vec<Self> {
        let one = |(record, spectra)| Self::of(layout, spectra, state, record);
        all.iter().enumerate().map(one).collect()
    }

    fn of(layout: &Layout, spectra: &Spectra, state: &State, record: usize) -> Self {
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
        layout: &Layout,
        spectra: &Spectra,
        state: &State,
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

    /// Sum of the squares of what is left.
    pub fn cost(all: &[Self]) -> f64 {
        all.iter()
            .map(|g| g.0[(g.0.nrows() - 1, g.0.nrows() - 1)])
            .sum()
    }
}

/// A step, and how sure the numbers are.
pub(super) struct Solved {
    /// Step of the numbers of all records.
    pub step: DVector<f64>,
    /// Step of those of each record's transient.
    pub own: Vec<DVector<f64>>,
    /// Covariance of the numbers of all records, for weights that are the noise's.
    pub covariance: DMatrix<f64>,
}

/// Added to the diagonal of a transient's equations, each number being scaled to 1: a broad mode's transient looks
/// nearly like the smooth part, which of the two it is being of no interest.
const TELLS_APART: f64 = 1e-12;

impl Solved {
    /// Solves the normal equations; none if their numbers cannot be told apart.
    pub fn of(layout: &Layout, all: &[Gram]) -> Option<Self> {
        let (own, shared) = (layout.own(), layout.shared());
        let mut rest = DMatrix::zeros(shared, shared + 1);
        let mut made_up = Vec::with_capacity(all.len());
        for Gram(products) in all {
            let cross = products.view((0, own), (own, shared + 1));
            let by_others = invert(&products.view((0, 0), (own, own)).into(), TELLS_APART)? * cross;
            rest += products.view((own, own), (shared, shared + 1));
            rest -= products.view((own, 0), (shared, own)) * &by_others;
            made_up.push(by_others);
        }
        let covariance = invert(&rest.columns(0, shared).into(), 0.0)?;
        let step = &covariance * rest.column(shared);
        let of_record =
            |made_up: &DMatrix<f64>| made_up.column(shared) - made_up.columns(0, shared) * &step;
        Some(Self {
            own: made_up.iter().map(of_record).collect(),
            step,
            covariance,
        })
    }

    /// The largest step of a pole or the delay over its standard uncertainty, for that variance of the weighted
    /// noise.
    pub fn largest_step(&self, layout: &Layout, variance: f64) -> f64 {
        let one = |i: usize| self.step[i].abs() / (variance * self.covariance[(i, i)]).sqrt();
        (0..layout.searched()).map(one).fold(0.0, f64::max)
    }

    /// Covariance of σ, ω and the residue of a single mode.
    pub fn of_mode(&self, layout: &Layout) -> Option<OfMode> {
        let residue = layout.searched();
        let places = [0, 1, residue, residue + 1];
        (layout.modes == 1).then(|| places.map(|i| places.map(|j| self.covariance[(i, j)])))
    }

    /// Covariance of σ and ω of each mode.
    pub fn of_modes(&self, modes: usize) -> Spread {
        let part = |k: usize| {
            let of = |i: usize, j: usize| self.covariance[(2 * k + i, 2 * k + j)];
            Some([[of(0, 0), of(0, 1)], [of(1, 0), of(1, 1)]])
        };
        (0..modes).map(part).collect()
    }
}
