//! Several numbers with their covariance, and its propagation.

use nalgebra::DMatrix;

use super::estimate::{Estimate, Measure};

/// Relative step of central differences: the cube root of the machine epsilon, which balances
/// truncation and rounding errors.
const STEP: f64 = 6.055_454_452_393_343e-6;

/// Covariance of several numbers, some of which may have no uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    /// Index of each number in the matrix, if it has an uncertainty.
    pub(crate) places: Vec<Option<usize>>,
    pub(crate) matrix: DMatrix<f64>,
}

impl Covariance {
    /// From a symmetric matrix over all numbers; `None` if none of them has an uncertainty.
    ///
    /// # Panics
    /// If a row is shorter than the matrix.
    #[must_use]
    pub fn new<Row: AsRef<[f64]>>(rows: Option<&[Row]>, count: usize) -> Self {
        match rows {
            Some(rows) => Self {
                places: (0..count).map(Some).collect(),
                matrix: DMatrix::from_fn(count, count, |i, j| rows[i].as_ref()[j]),
            },
            None => Self {
                places: vec![None; count],
                matrix: DMatrix::zeros(0, 0),
            },
        }
    }

    /// From the matrix over all numbers.
    #[must_use]
    pub fn of(matrix: DMatrix<f64>) -> Self {
        let all: Vec<usize> = (0..matrix.nrows()).collect();
        Self::of_some(&all, all.len(), matrix)
    }

    /// From the matrix over some of `count` numbers, those at `indices`; the others have no uncertainty.
    #[must_use]
    pub fn of_some(indices: &[usize], count: usize, matrix: DMatrix<f64>) -> Self {
        let mut places = vec![None; count];
        for (place, index) in indices.iter().enumerate() {
            places[*index] = Some(place);
        }
        Self { places, matrix }
    }

    /// Of uncorrelated numbers; those without an uncertainty have no covariance.
    #[must_use]
    pub fn independent(std: &[Option<f64>]) -> Self {
        let known: Vec<f64> = std.iter().copied().flatten().collect();
        let mut next = 0..known.len();
        Self {
            places: std
                .iter()
                .map(|std| std.and_then(|_| next.next()))
                .collect(),
            matrix: DMatrix::from_fn(known.len(), known.len(), |i, j| {
                if i == j { known[i] * known[i] } else { 0.0 }
            }),
        }
    }

    /// Covariance of two of them; `None` if one has no uncertainty, as a parameter of a fit that is fixed, at a bound
    /// or undetermined.
    #[must_use]
    pub fn get(&self, i: usize, j: usize) -> Option<f64> {
        let (i, j) = (*self.places.get(i)?, *self.places.get(j)?);
        Some(self.matrix[(i?, j?)])
    }

    /// Scales the covariance, for example where the noise is larger than the residuals show.
    #[must_use]
    pub fn times(mut self, factor: f64) -> Self {
        self.matrix *= factor;
        self
    }

    /// With the standard uncertainties of the first numbers multiplied by factors; correlations remain.
    #[must_use]
    pub fn with_factors(mut self, factors: &[f64]) -> Self {
        for (factor, place) in factors.iter().zip(&self.places) {
            if let Some(place) = place {
                self.matrix.row_mut(*place).scale_mut(*factor);
                self.matrix.column_mut(*place).scale_mut(*factor);
            }
        }
        self
    }

    /// Standard uncertainty of one of them.
    #[must_use]
    pub fn std(&self, i: usize) -> Option<f64> {
        self.get(i, i).map(f64::sqrt)
    }

    /// Correlation coefficient of two of them, −1 to 1.
    #[must_use]
    pub fn correlation(&self, i: usize, j: usize) -> Option<f64> {
        let size = self.std(i)? * self.std(j)?;
        self.get(i, j)
            .filter(|_| size > 0.0)
            .map(|c| (c / size).clamp(-1.0, 1.0))
    }

    /// Covariance of a selection, in the given order.
    #[must_use]
    pub fn select(&self, indices: &[usize]) -> Self {
        let mut gradients = vec![vec![0.0; self.places.len()]; indices.len()];
        for (gradient, i) in gradients.iter_mut().zip(indices) {
            gradient[*i] = 1.0;
        }
        self.through(&gradients)
    }

    /// Covariance of functions with these gradients, `S C Sᵀ`. A function that depends on a number without an
    /// uncertainty has none.
    fn through<Row: AsRef<[f64]>>(&self, gradients: &[Row]) -> Self {
        let has_std = |gradient: &&Row| {
            let mut entries = gradient.as_ref().iter().zip(&self.places);
            entries.any(|(g, place)| *g != 0.0 && place.is_some())
                && self.std_of(gradient.as_ref()).is_some()
        };
        let known: Vec<&Row> = gradients.iter().filter(has_std).collect();
        let mut next = 0..known.len();
        Self {
            places: gradients
                .iter()
                .map(|gradient| has_std(&gradient).then(|| next.next()).flatten())
                .collect(),
            matrix: DMatrix::from_fn(known.len(), known.len(), |i, j| {
                self.between(known[i].as_ref(), known[j].as_ref())
            }),
        }
    }

    /// Covariance `aᵀ C b` of two functions with these gradients.
    fn between(&self, a: &[f64], b: &[f64]) -> f64 {
        let known = || (0..self.places.len()).filter_map(|i| Some((i, self.places[i]?)));
        known()
            .flat_map(|(i, p)| known().map(move |(j, q)| a[i] * self.matrix[(p, q)] * b[j]))
            .sum()
    }

    /// Standard uncertainty of a function with this gradient (one entry for each number): √(gᵀ C g), JCGM 100:2008
    /// (13). `None` if it depends on a number without an uncertainty.
    #[must_use]
    pub fn std_of(&self, gradient: &[f64]) -> Option<f64> {
        let mut sum = 0.0;
        for (i, gi) in gradient.iter().enumerate().filter(|(_, g)| **g != 0.0) {
            for (j, gj) in gradient.iter().enumerate().filter(|(_, g)| **g != 0.0) {
                sum += gi * gj * self.get(i, j)?;
            }
        }
        Some(sum.max(0.0).sqrt())
    }
}

/// Several numbers with their covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimates {
    values: Vec<f64>,
    covariance: Covariance,
}

impl Estimates {
    /// Numbers in units known to the caller, with their covariance.
    #[must_use]
    pub fn new(values: Vec<f64>, covariance: Covariance) -> Self {
        Self { values, covariance }
    }

    /// Uncorrelated estimates.
    #[must_use]
    pub fn independent(estimates: &[&Estimate]) -> Self {
        let std: Vec<_> = estimates.iter().map(|e| e.std_uncertainty()).collect();
        Self {
            values: estimates.iter().map(|e| e.value()).collect(),
            covariance: Covariance::independent(&std),
        }
    }

    /// Appends an uncorrelated number.
    #[must_use]
    pub fn and(mut self, value: f64, std: Option<f64>) -> Self {
        let place = self.covariance.matrix.nrows();
        self.values.push(value);
        self.covariance.places.push(std.map(|_| place));
        if let Some(std) = std {
            let grown = self.covariance.matrix.resize(place + 1, place + 1, 0.0);
            self.covariance.matrix = grown;
            self.covariance.matrix[(place, place)] = std * std;
        }
        self
    }

    /// The numbers.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Their covariance.
    #[must_use]
    pub fn covariance(&self) -> &Covariance {
        &self.covariance
    }

    /// One of them.
    #[must_use]
    pub fn get(&self, i: usize, measure: impl Into<Measure>) -> Estimate {
        Estimate::of(measure, self.values[i], self.covariance.std(i))
    }

    /// Functions y = f(x) of the numbers, with their covariance `S C Sᵀ`, `S = ∂f/∂x` by central differences (JCGM
    /// 102:2011, 6.2.1.3). Numbers without an uncertainty count as exact, and a function of only such numbers has no
    /// uncertainty. Valid while f is nearly linear over x ± u(x).
    ///
    /// ```
    /// use torqcomp_model::{Covariance, Estimates};
    /// // σ = 3, ω = 4 with u = 0.1 each and r = 0.5: K/J = σ² + ω² = 25 with the slopes 6 and 8:
    /// // u² = 0.36 + 0.64 + 2·6·8·0.005 = 1.48.
    /// let covariance = Covariance::new(Some(&[[0.01, 0.005], [0.005, 0.01]]), 2);
    /// let pole = Estimates::new(vec![3.0, 4.0], covariance);
    /// let ratio = pole.derive(|x| [x[0] * x[0] + x[1] * x[1]]).get(0, "1/s^2");
    /// assert_eq!(ratio.value(), 25.0);
    /// assert!((ratio.std_uncertainty().unwrap() - 1.48_f64.sqrt()).abs() < 1e-9);
    /// ```
    #[must_use]
    pub fn derive<const M: usize>(&self, f: impl Fn(&[f64]) -> [f64; M]) -> Self {
        let mut x = self.values.clone();
        let values = f(&x);
        let slopes: Vec<Vec<f64>> = (0..M)
            .map(|k| {
                let slope_of = |i: usize| match self.covariance.std(i) {
                    Some(std) if std > 0.0 => slope(|x| f(x)[k], &mut x, i, std),
                    _ => 0.0,
                };
                (0..self.values.len()).map(slope_of).collect()
            })
            .collect();
        self.derive_by(values.to_vec(), &slopes)
    }

    /// Functions of the numbers, given by their values and gradients (one row per function, one entry per
    /// number). One that depends on a number without an uncertainty, or on none with one, has none itself.
    #[must_use]
    pub fn derive_by<Row: AsRef<[f64]>>(&self, values: Vec<f64>, gradients: &[Row]) -> Self {
        let covariance = self.covariance.through(gradients);
        Self { values, covariance }
    }
}

/// ∂f/∂x_i by central differences; `x` is restored.
pub(super) fn slope(f: impl Fn(&[f64]) -> f64, x: &mut [f64], i: usize, std: f64) -> f64 {
    let centre = x[i];
    let step = STEP * centre.abs().max(std);
    x[i] = centre + step;
    let (upper, above) = (x[i], f(x));
    x[i] = centre - step;
    let (lower, below) = (x[i], f(x));
    x[i] = centre;
    // The steps after rounding, not as requested.
    (above - below) / (upper - lower)
}
