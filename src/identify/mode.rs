//! A mode of vibration identified from records, and the constants of a stand derived from it.
//!
//! ```text
//! ω_n = √(σ² + ω²),   ζ = σ/ω_n                                               (C7) to (C14)
//! K/J = ω_n²,   f/J = 2σ,   f/K = 2σ/ω_n²,   J/K = 1/ω_n²                     (C12) to (C20)
//! ```
//!
//! σ in 1/s and ω in rad/s are decay rate and damped angular frequency; J in kg m², f in N m s/rad, K in N m/rad. A
//! decay, and output torque over input torque, determine only these ratios, as scaling all torques does not change
//! them. Motion over torque determines all three:
//!
//! ```text
//! θ/T = 1/(J s² + f s + K) = R/(s − p) + R*/(s − p*),   p = −σ + jω,   R = −j/(2 ω J)
//! J = 1/g,   f = 2σ/g,   K = ω_n²/g,   g = −2 ω Im R
//! ```
//!
//! R in rad/(N m s) is imaginary for a stand with J θ'' + f θ' + K θ = T; a real part shows additional dynamics
//! between torque and motion.

use std::f64::consts::TAU;

use num_complex::Complex64;
use torqcomp_model::{Covariance, Estimates};

use super::NamedEstimates;

/// Decay rate and damped angular frequency of a mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pole {
    /// σ in 1/s.
    pub rate_per_s: f64,
    /// ω in rad/s.
    pub omega_rad_per_s: f64,
}

impl Pole {
    /// From σ and ω, one pair per mode.
    pub(super) fn all(numbers: &[f64]) -> Vec<Self> {
        let pole = |pair: &[f64]| Self {
            rate_per_s: pair[0],
            omega_rad_per_s: pair[1],
        };
        numbers.chunks_exact(2).map(pole).collect()
    }

    /// Damped frequency in Hz.
    pub(super) fn frequency_hz(&self) -> f64 {
        self.omega_rad_per_s / TAU
    }

    /// Damping ratio ζ.
    pub(super) fn damping_ratio(&self) -> f64 {
        self.rate_per_s / self.rate_per_s.hypot(self.omega_rad_per_s)
    }
}

/// A pole with its covariance and, from the response to a known input, its residue.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalPole {
    /// σ, ω and, with a residue, Re R and Im R.
    numbers: Estimates,
}

/// A known constant with its standard uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KnownConstant {
    /// J in kg m².
    Inertia(f64, Option<f64>),
    /// K in N m/rad.
    Stiffness(f64, Option<f64>),
}

impl KnownConstant {
    fn value(self) -> f64 {
        let (Self::Inertia(value, _) | Self::Stiffness(value, _)) = self;
        value
    }

    /// Its standard uncertainty.
    pub(crate) fn std(self) -> Option<f64> {
        let (Self::Inertia(_, std) | Self::Stiffness(_, std)) = self;
        std
    }
}

/// Minimum significant real part of the residue: in standard deviations, and relative to its
/// imaginary part.
const TURNED: (f64, f64) = (3.0, 0.03);

/// Name and unit of each constant of a stand.
const INERTIA: (&str, &str) = ("inertia", "kg m^2");
const DAMPING: (&str, &str) = ("damping", "N m s/rad");
const STIFFNESS: (&str, &str) = ("stiffness", "N m/rad");

/// Name and unit, value, and gradient with respect to the numbers that it follows from.
type Row<const N: usize> = ((&'static str, &'static str), f64, [f64; N]);

/// The covariance of `count` numbers, or of none if one of them has none.
pub(super) fn all_or_none(covariance: Covariance, count: usize) -> Covariance {
    match (0..count).all(|i| covariance.std(i).is_some()) {
        true => covariance,
        false => Covariance::independent(&vec![None; count]),
    }
}

/// Constants derived from other numbers.
fn derived<const N: usize>(from: &Estimates, rows: &[Row<N>]) -> NamedEstimates {
    let names: Vec<_> = rows.iter().map(|row| row.0).collect();
    let gradients: Vec<_> = rows.iter().map(|row| row.2).collect();
    let values = rows.iter().map(|row| row.1).collect();
    NamedEstimates::new(&names, &from.derive_by(values, &gradients))
}

impl ModalPole {
    /// A mode from the covariance of σ and ω.
    pub fn new(pole: Pole, covariance: Covariance) -> Self {
        let values = vec![pole.rate_per_s, pole.omega_rad_per_s];
        Self {
            numbers: Estimates::new(values, covariance),
        }
    }

    /// A mode with its residue, from the covariance of σ, ω, Re R and Im R.
    pub fn with_residue(pole: Pole, residue: Complex64, covariance: Covariance) -> Self {
        let values = vec![
            pole.rate_per_s,
            pole.omega_rad_per_s,
            residue.re,
            residue.im,
        ];
        Self {
            numbers: Estimates::new(values, covariance),
        }
    }

    /// σ and ω without their uncertainties.
    pub fn pole(&self) -> Pole {
        Pole::all(self.numbers.values())[0]
    }

    /// σ and ω with their covariance.
    fn pole_numbers(&self) -> Estimates {
        let values = self.numbers.values()[..2].to_vec();
        Estimates::new(values, self.numbers.covariance().select(&[0, 1]))
    }

    /// The same for constants that depend on both; without covariance if one is unknown.
    fn known_pole(&self) -> Estimates {
        let pole = self.pole_numbers();
        let covariance = all_or_none(pole.covariance().clone(), 2);
        Estimates::new(pole.values().to_vec(), covariance)
    }

    /// Damped frequency, decay rate, damping ratio and natural frequency.
    pub fn modal_constants(&self) -> NamedEstimates {
        let pole = self.pole();
        let (s, w) = (pole.rate_per_s, pole.omega_rad_per_s);
        let natural = s.hypot(w);
        let cube = natural.powi(3);
        let rows = [
            (("damped_frequency", "Hz"), w / TAU, [0.0, 1.0 / TAU]),
            (("decay_rate", "1/s"), s, [1.0, 0.0]),
            (
                ("damping_ratio", ""),
                s / natural,
                [w * w / cube, -s * w / cube],
            ),
            (
                ("natural_frequency", "Hz"),
                natural / TAU,
                [s / natural / TAU, w / natural / TAU],
            ),
        ];
        derived(&self.pole_numbers(), &rows)
    }

    /// f/J and K/J.
    ///
    /// ```
    /// use torqcomp::identify::{ModalPole, Pole};
    /// use torqcomp_model::Covariance;
    /// let pole = Pole { rate_per_s: 3.0, omega_rad_per_s: 4.0 };
    /// let mode = ModalPole::new(pole, Covariance::independent(&[None; 2]));
    /// // 2·3 and 3² + 4².
    /// let ratios = mode.over_inertia();
    /// assert_eq!((ratios.list[0].value(), ratios.list[1].value()), (6.0, 25.0));
    /// // 6/25 and 1/25.
    /// let ratios = mode.over_stiffness();
    /// assert_eq!((ratios.list[0].value(), ratios.list[1].value()), (0.24, 0.04));
    /// ```
    pub fn over_inertia(&self) -> NamedEstimates {
        let (s, w, q) = self.squares();
        let rows = [
            (("damping_over_inertia", "1/s"), 2.0 * s, [2.0, 0.0]),
            (("stiffness_over_inertia", "1/s^2"), q, [2.0 * s, 2.0 * w]),
        ];
        derived(&self.known_pole(), &rows)
    }

    /// f/K and J/K.
    pub fn over_stiffness(&self) -> NamedEstimates {
        let (s, w, q) = self.squares();
        let by_s = 2.0 / q - 4.0 * s * s / (q * q);
        let by_w = -4.0 * s * w / (q * q);
        let rows = [
            (("damping_over_stiffness", "s"), 2.0 * s / q, [by_s, by_w]),
            (
                ("inertia_over_stiffness", "s^2"),
                1.0 / q,
                [-2.0 * s / (q * q), -2.0 * w / (q * q)],
            ),
        ];
        derived(&self.known_pole(), &rows)
    }

    /// σ, ω and ω_n².
    fn squares(&self) -> (f64, f64, f64) {
        let pole = self.pole();
        let (s, w) = (pole.rate_per_s, pole.omega_rad_per_s);
        (s, w, s.powi(2) + w.powi(2))
    }

    /// The known constant and the two others derived from it and the mode. If it is the least certain number, all
    /// three are correlated.
    ///
    /// ```
    /// use torqcomp::identify::{KnownConstant, ModalPole, Pole};
    /// use torqcomp_model::Covariance;
    /// let pole = Pole { rate_per_s: 3.0, omega_rad_per_s: 4.0 };
    /// let mode = ModalPole::new(pole, Covariance::independent(&[None; 2]));
    /// let constants = mode.scaled_by_known_constant(KnownConstant::Stiffness(50.0, Some(1.0)));
    /// // J = 50/25, f = 2·3·2.
    /// assert_eq!((constants.list[1].value(), constants.list[2].value()), (2.0, 12.0));
    /// ```
    pub fn scaled_by_known_constant(&self, known: KnownConstant) -> NamedEstimates {
        let (s, w, q) = self.squares();
        let rows = match known {
            KnownConstant::Inertia(j, _) => [
                (INERTIA, j, [0.0, 0.0, 1.0]),
                (STIFFNESS, j * q, [2.0 * s * j, 2.0 * w * j, q]),
                (DAMPING, 2.0 * s * j, [2.0 * j, 0.0, 2.0 * s]),
            ],
            KnownConstant::Stiffness(k, _) => {
                let by_s = 2.0 * k / q - 4.0 * s * s * k / (q * q);
                let by_w = -4.0 * s * w * k / (q * q);
                let inertia = [-2.0 * s * k / (q * q), -2.0 * w * k / (q * q), 1.0 / q];
                [
                    (STIFFNESS, k, [0.0, 0.0, 1.0]),
                    (INERTIA, k / q, inertia),
                    (DAMPING, 2.0 * s * k / q, [by_s, by_w, 2.0 * s / q]),
                ]
            }
        };
        // Without an uncertainty the known constant counts as exact.
        let std = known.std().unwrap_or(0.0);
        let all = self.known_pole().and(known.value(), Some(std));
        derived(&all, &rows)
    }

    /// The same with the motion in rad (or rad/s, …) and the torque in N m; `rad_per_n_m` is the unit
    /// of the response.
    pub fn scaled(&self, rad_per_n_m: f64) -> Self {
        let values = self.numbers.values();
        let size = |i: usize| if i < 2 { 1.0 } else { rad_per_n_m };
        let row = |i: usize| {
            let mut row = vec![0.0; values.len()];
            row[i] = size(i);
            row
        };
        let scaled = (0..values.len()).map(|i| values[i] * size(i)).collect();
        let gradients: Vec<Vec<f64>> = (0..values.len()).map(row).collect();
        Self {
            numbers: self.numbers.derive_by(scaled, &gradients),
        }
    }

    /// J, f and K from the residue; `None` without one.
    ///
    /// ```
    /// use num_complex::Complex64;
    /// use torqcomp::identify::{ModalPole, Pole};
    /// use torqcomp_model::Covariance;
    /// // 2 s² + 12 s + 50 = 2 [(s + 3)² + 4²]: R = −j/(2·4·2).
    /// let residue = Complex64::new(0.0, -1.0 / 16.0);
    /// let pole = Pole { rate_per_s: 3.0, omega_rad_per_s: 4.0 };
    /// let mode = ModalPole::with_residue(pole, residue, Covariance::independent(&[None; 4]));
    /// let values: Vec<f64> = mode.stand_constants().unwrap().list.iter().map(|c| c.value()).collect();
    /// assert_eq!(values, [2.0, 12.0, 50.0]);
    /// ```
    pub fn stand_constants(&self) -> Option<NamedEstimates> {
        let [s, w, _, im] = *self.numbers.values() else {
            return None;
        };
        let inertia = -0.5 / (w * im);
        // ∂J/∂ω = −J/ω, ∂J/∂Im R = −J/Im R; f and K are J times functions of σ and ω.
        let (by_w, by_im) = (-1.0 / w, -1.0 / im);
        let row = |name, factor: f64, by_s: f64, more: f64| {
            let slopes = [by_s, factor * by_w + more, 0.0, factor * by_im];
            (name, factor * inertia, slopes.map(|slope| slope * inertia))
        };
        let rows = [
            row(INERTIA, 1.0, 0.0, 0.0),
            row(DAMPING, 2.0 * s, 2.0, 0.0),
            row(STIFFNESS, s * s + w * w, 2.0 * s, 2.0 * w),
        ];
        Some(derived(&self.numbers, &rows))
    }

    /// Phase in rad by which the residue differs from that of a plain stand, if the difference is significant.
    ///
    /// ```
    /// use num_complex::Complex64;
    /// use torqcomp::identify::{ModalPole, Pole};
    /// use torqcomp_model::Covariance;
    /// let covariance = Covariance::independent(&[Some(0.0), Some(0.0), Some(1e-3), Some(0.0)]);
    /// let pole = Pole { rate_per_s: 3.0, omega_rad_per_s: 4.0 };
    /// let mode = ModalPole::with_residue(pole, Complex64::new(0.05, -0.5), covariance);
    /// // A tenth, fifty standard deviations.
    /// assert!((mode.residue_phase().unwrap() - 0.1_f64.atan()).abs() < 1e-12);
    /// ```
    pub fn residue_phase(&self) -> Option<f64> {
        let [_, _, re, im] = *self.numbers.values() else {
            return None;
        };
        let std = self.numbers.covariance().std(2)?;
        let is_significant = re.abs() > TURNED.0 * std && re.abs() > TURNED.1 * im.abs();
        is_significant.then(|| (re / -im).atan())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POLE: Pole = Pole {
        rate_per_s: 20.0,
        omega_rad_per_s: 300.0,
    };
    const COVARIANCE: [[f64; 2]; 2] = [[0.04, 0.01], [0.01, 0.09]];

    fn mode(pole: Pole) -> ModalPole {
        ModalPole::new(pole, Covariance::new(Some(&COVARIANCE), 2))
    }

    /// Gradients against finite differences of the values.
    #[test]
    fn uncertainties_are_those_of_small_changes() {
        for known in [
            KnownConstant::Inertia(0.5, Some(0.01)),
            KnownConstant::Stiffness(4e4, Some(900.0)),
        ] {
            let found = mode(POLE).scaled_by_known_constant(known);
            for (k, number) in found.list.iter().enumerate() {
                let moved = |ds: f64, dw: f64, da: f64| {
                    let pole = Pole {
                        rate_per_s: POLE.rate_per_s + ds,
                        omega_rad_per_s: POLE.omega_rad_per_s + dw,
                    };
                    let known = match known {
                        KnownConstant::Inertia(v, s) => KnownConstant::Inertia(v + da, s),
                        KnownConstant::Stiffness(v, s) => KnownConstant::Stiffness(v + da, s),
                    };
                    mode(pole).scaled_by_known_constant(known).list[k].value() - number.value()
                };
                let size = match known {
                    KnownConstant::Inertia(..) => 0.01,
                    KnownConstant::Stiffness(..) => 900.0,
                };
                let h = 1e-6;
                let (a, b) = (moved(h, 0.0, 0.0) / h, moved(0.0, h, 0.0) / h);
                let c = moved(0.0, 0.0, h * size) / h;
                let want = (0.04 * a * a + 0.02 * a * b + 0.09 * b * b + c * c).sqrt();
                let got = number.std().unwrap();
                let name = &number.name;
                assert!((got / want - 1.0).abs() < 1e-4, "{name}: {got} {want}");
            }
        }
    }

    #[test]
    fn constants_are_correlated_with_an_uncertain_known_one() {
        // 2 % of the known constant against 0.1 % of ω².
        let pairs = |std| {
            let known = KnownConstant::Inertia(0.5, std);
            mode(POLE).scaled_by_known_constant(known).correlations()
        };
        let has = |a: &str, b: &str| {
            let found = pairs(Some(0.01));
            found.iter().any(|p| p.first == a && p.second == b)
        };
        assert!(has("inertia", "stiffness"));
        assert!(pairs(None).iter().all(|p| p.first != "inertia"));
    }

    #[test]
    fn uncertainties_with_a_residue_are_those_of_small_changes() {
        let steps = [0.2, 0.3, 1e-6, 2e-6];
        let covariance = Covariance::independent(&steps.map(Some));
        let residue = Complex64::new(1e-6, -1e-3);
        let mode = ModalPole::with_residue(POLE, residue, covariance.clone());
        let found = mode.stand_constants().unwrap().list;
        for (k, number) in found.iter().enumerate() {
            let moved = |i: usize, part: f64| {
                let by = |j: usize| if i == j { part * steps[j] } else { 0.0 };
                let pole = Pole {
                    rate_per_s: POLE.rate_per_s + by(0),
                    omega_rad_per_s: POLE.omega_rad_per_s + by(1),
                };
                let residue = residue + Complex64::new(by(2), by(3));
                let next = ModalPole::with_residue(pole, residue, covariance.clone());
                next.stand_constants().unwrap().list[k].value()
            };
            let slope = |i: usize| (moved(i, 1e-4) - moved(i, -1e-4)) / 2e-4;
            let want = (0..4).map(|i| slope(i).powi(2)).sum::<f64>().sqrt();
            let got = number.std().unwrap();
            let name = &number.name;
            assert!((got / want - 1.0).abs() < 1e-6, "{name}: {got} {want}");
        }
        // A stand with a tenth of the stiffness and inertia.
        let softer = mode.scaled(10.0).stand_constants().unwrap().list;
        assert!((softer[2].value() / found[2].value() - 0.1).abs() < 1e-12);
        assert!((softer[2].std().unwrap() / found[2].std().unwrap() - 0.1).abs() < 1e-12);
    }
}
