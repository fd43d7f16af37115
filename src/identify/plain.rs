//! J, f and K from one mode of the motion that a known torque makes.
//!
//! ```text
//! θ/T = 1/(J s² + f s + K) = R/(s − p) + R*/(s − p*),   p = −σ + jω,   R = −j/(2 ω J)
//! J = 1/g,   f = 2σ/g,   K = (σ² + ω²)/g,   g = −2 ω Im R
//! ```
//!
//! J in kg m², f in N m s/rad, K in N m/rad, σ in 1/s, ω in rad/s, R in rad/(N m s). Unlike torque over torque (see
//! [`super::anchored`]), motion over torque holds a constant with a unit, so that all three follow. In a
//! stand that is plain R is imaginary; a real part says that something lies between the torque and the motion.

use num_complex::Complex64;

use super::{Correlated, Found, STRONG};

/// A mode of the motion that a torque makes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// σ in 1/s.
    pub rate_per_s: f64,
    /// ω in rad/s.
    pub omega_rad_per_s: f64,
    /// R, in the units of the motion over those of the torque, a second.
    pub residue: Complex64,
    /// Covariance of σ, ω, Re R and Im R, if the data tell it.
    pub covariance: Option<[[f64; 4]; 4]>,
}

/// Standard deviations, and part of the whole, from which on a real part of the residue is said.
const TURNED: (f64, f64) = (3.0, 0.03);

impl Answer {
    /// The same with the motion in rad (or per second, …) and the torque in N m, one unit of the response being so
    /// much.
    #[must_use]
    pub fn scaled(&self, rad_per_n_m: f64) -> Self {
        let size = [1.0, 1.0, rad_per_n_m, rad_per_n_m];
        let scaled = |c: [[f64; 4]; 4]| {
            std::array::from_fn(|i| std::array::from_fn(|j| c[i][j] * size[i] * size[j]))
        };
        Self {
            residue: self.residue * rad_per_n_m,
            covariance: self.covariance.map(scaled),
            ..*self
        }
    }

    /// J, f and K, and which of them are hard to tell apart.
    ///
    /// ```
    /// use num_complex::Complex64;
    /// use torqcomp::identify::plain::Answer;
    /// // 2 s² + 12 s + 50 = 2 [(s + 3)² + 4²]: R = −j/(2·4·2).
    /// let residue = Complex64::new(0.0, -1.0 / 16.0);
    /// let mode = Answer { rate_per_s: 3.0, omega_rad_per_s: 4.0, residue, covariance: None };
    /// let values: Vec<f64> = mode.constants().0.iter().map(|f| f.value).collect();
    /// assert_eq!(values, [2.0, 12.0, 50.0]);
    /// ```
    #[must_use]
    pub fn constants(&self) -> (Vec<Found>, Vec<Correlated>) {
        let (s, w) = (self.rate_per_s, self.omega_rad_per_s);
        let inertia = -0.5 / (w * self.residue.im);
        // ∂J/∂ω = −J/ω, ∂J/∂Im R = −J/Im R; f and K are J times numbers of σ and ω.
        let (by_w, by_im) = (-1.0 / w, -1.0 / self.residue.im);
        let times = |factor: f64, by_s: f64, more: f64| {
            let slopes = [by_s, factor * by_w + more, 0.0, factor * by_im];
            (factor * inertia, slopes.map(|slope| slope * inertia))
        };
        let square = s * s + w * w;
        let all = [
            ("inertia", "kg m^2", times(1.0, 0.0, 0.0)),
            ("damping", "N m s/rad", times(2.0 * s, 2.0, 0.0)),
            ("stiffness", "N m/rad", times(square, 2.0 * s, 2.0 * w)),
        ];
        let one = |(name, unit, (value, slopes)): &(&str, &str, (f64, [f64; 4]))| {
            let std = self.between(slopes, slopes).map(f64::sqrt);
            Found::new(*name, *value, std, *unit)
        };
        let pair = |i: usize, j: usize| {
            let (a, b) = (&all[i].2.1, &all[j].2.1);
            let size = (self.between(a, a)? * self.between(b, b)?).sqrt();
            let coefficient = self.between(a, b)? / size;
            (coefficient.abs() >= STRONG).then(|| Correlated {
                first: all[i].0.to_owned(),
                second: all[j].0.to_owned(),
                coefficient,
            })
        };
        let pairs = [(0, 1), (0, 2), (1, 2)];
        let correlated = pairs.into_iter().filter_map(|(i, j)| pair(i, j));
        (all.iter().map(one).collect(), correlated.collect())
    }

    /// Angle in rad by which the answer is turned against that of a plain stand, where it is more than chance.
    ///
    /// ```
    /// use num_complex::Complex64;
    /// use torqcomp::identify::plain::Answer;
    /// let mut covariance = [[0.0; 4]; 4];
    /// covariance[2][2] = 1e-6;
    /// let residue = Complex64::new(0.05, -0.5);
    /// let mode = Answer { rate_per_s: 3.0, omega_rad_per_s: 4.0, residue, covariance: Some(covariance) };
    /// // A tenth, fifty standard deviations.
    /// assert!((mode.turned().unwrap() - 0.1_f64.atan()).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn turned(&self) -> Option<f64> {
        let std = self.covariance?[2][2].sqrt();
        let Complex64 { re, im } = self.residue;
        let much = re.abs() > TURNED.0 * std && re.abs() > TURNED.1 * im.abs();
        much.then(|| (re / -im).atan())
    }

    fn between(&self, a: &[f64; 4], b: &[f64; 4]) -> Option<f64> {
        let c = self.covariance?;
        let pairs = (0..4).flat_map(|i| (0..4).map(move |j| (i, j)));
        Some(pairs.map(|(i, j)| a[i] * c[i][j] * b[j]).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Slopes against differences of the values.
    #[test]
    fn uncertainties_are_those_of_small_changes() {
        let steps = [0.2, 0.3, 1e-6, 2e-6];
        let mut covariance = [[0.0; 4]; 4];
        for i in 0..4 {
            covariance[i][i] = steps[i] * steps[i];
        }
        let mode = Answer {
            rate_per_s: 20.0,
            omega_rad_per_s: 300.0,
            residue: Complex64::new(1e-6, -1e-3),
            covariance: Some(covariance),
        };
        let (found, _) = mode.constants();
        for (k, number) in found.iter().enumerate() {
            let moved = |i: usize, part: f64| {
                let by = |j: usize| if i == j { part * steps[j] } else { 0.0 };
                let next = Answer {
                    rate_per_s: 20.0 + by(0),
                    omega_rad_per_s: 300.0 + by(1),
                    residue: mode.residue + Complex64::new(by(2), by(3)),
                    covariance: None,
                };
                next.constants().0[k].value
            };
            let slope = |i: usize| (moved(i, 1e-4) - moved(i, -1e-4)) / 2e-4;
            let want = (0..4).map(|i| slope(i).powi(2)).sum::<f64>().sqrt();
            let got = number.std.unwrap();
            assert!(
                (got / want - 1.0).abs() < 1e-6,
                "{}: {got} {want}",
                number.name
            );
        }
        // A stand ten times as soft and light.
        let softer = mode.scaled(10.0).constants().0;
        assert!((softer[2].value / found[2].value - 0.1).abs() < 1e-12);
        assert!((softer[2].std.unwrap() / found[2].std.unwrap() - 0.1).abs() < 1e-12);
    }
}
