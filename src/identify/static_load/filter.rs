//! Whitening of rows with shared levels in their errors: square-root form of the Kalman filter with a triangular root.
//!
//! A level is the drift of the zero, the zero of a series or the sensitivity of a mounting; each row depends on it with
//! a factor. The root S of the covariance S Sᵀ of the levels is updated by Givens rotations, so the time per row grows
//! with the square of the number of open levels. (N. A. Carlson, AIAA Journal 11 (1973), 1259; P. Kaminski, A. Bryson,
//! S. Schmidt, IEEE Trans. Automatic Control 16 (1971), 727.)

/// State of the levels given the rows so far.
pub(super) struct LevelFilter {
    /// Row k of the root, up to the diagonal.
    root: Vec<Vec<f64>>,
    /// Estimate of each level, for each column.
    levels: Vec<Vec<f64>>,
    columns: usize,
    /// Buffer for the rotations.
    scratch: Vec<f64>,
}

/// Rotates two numbers by an angle with this cosine and sine.
fn rotate((c, s): (f64, f64), a: &mut f64, b: &mut f64) {
    (*a, *b) = (c * *a + s * *b, c * *b - s * *a);
}

/// Cosine and sine of the angle that rotates (a, b) into (r, 0), and r; `None` if b is 0.
fn rotation(a: f64, b: f64) -> Option<((f64, f64), f64)> {
    let r = (a * a + b * b).sqrt();
    (b != 0.0 && r > 0.0).then(|| ((a / r, b / r), r))
}

impl LevelFilter {
    /// A filter for rows of `columns` values, without levels.
    pub fn new(columns: usize) -> Self {
        Self {
            root: Vec::new(),
            levels: Vec::new(),
            columns,
            scratch: Vec::new(),
        }
    }

    /// Adds a level with mean 0 and this standard deviation.
    pub fn open(&mut self, std: f64) {
        let mut row = vec![0.0; self.root.len()];
        row.push(std);
        self.root.push(row);
        self.levels.push(vec![0.0; self.columns]);
    }

    /// Removes a level.
    pub fn close(&mut self, place: usize) {
        self.levels.remove(place);
        self.root.remove(place);
        // The rows below now extend one beyond the diagonal.
        for k in place..self.root.len() {
            if let Some((angle, _)) = rotation(self.root[k][k], self.root[k][k + 1]) {
                for row in &mut self.root[k..] {
                    let (left, right) = row.split_at_mut(k + 1);
                    rotate(angle, &mut left[k], &mut right[0]);
                }
            }
            self.root[k].truncate(k + 1);
        }
    }

    /// Adds an independent random step with this standard deviation to the first level.
    pub fn step(&mut self, std: f64) {
        let more = &mut self.scratch;
        more.clear();
        more.resize(self.root.len(), 0.0);
        more[0] = std;
        for j in 0..self.root.len() {
            let Some((angle, _)) = rotation(self.root[j][j], more[j]) else {
                continue;
            };
            for (row, value) in self.root[j..].iter_mut().zip(&mut more[j..]) {
                rotate(angle, &mut row[j], value);
            }
        }
    }

    /// Replaces the values of a row, which depends on the levels with these factors, by their innovations over their
    /// standard deviation; returns that deviation.
    pub fn whiten(&mut self, factors: &[f64], own_std: f64, values: &mut [f64]) -> f64 {
        let gains = &mut self.scratch;
        gains.clear();
        gains.resize(self.root.len(), 0.0);
        let mut total = own_std;
        for j in (0..self.root.len()).rev() {
            let rows = self.root[j..].iter().zip(&factors[j..]);
            let seen: f64 = rows.map(|(row, factor)| row[j] * factor).sum();
            if let Some((angle, r)) = rotation(total, seen) {
                for (row, gain) in self.root[j..].iter_mut().zip(&mut gains[j..]) {
                    rotate(angle, gain, &mut row[j]);
                }
                total = r;
            }
        }
        for (level, factor) in self.levels.iter().zip(factors) {
            for (value, level) in values.iter_mut().zip(level) {
                *value -= factor * level;
            }
        }
        values.iter_mut().for_each(|value| *value /= total);
        for (level, gain) in self.levels.iter_mut().zip(gains) {
            for (level, value) in level.iter_mut().zip(values.iter()) {
                *level += *gain * value;
            }
        }
        total
    }
}
