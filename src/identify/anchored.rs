//! What follows of J, f and K from one ringing mode and one of them that is known otherwise.
//!
//! ```text
//! K/J = σ² + ω²,   f/J = 2σ,   f/K = 2σ/(σ² + ω²),   J/K = 1/(σ² + ω²)      (C12) to (C20)
//! ```
//!
//! σ in 1/s and ω in rad/s are decay rate and damped angular frequency; J in kg m², f in N m s/rad, K in
//! N m/rad. A decay, and torque in over torque out, tell no more than these ratios: every torque may be
//! multiplied by one number without changing them.

use super::{Correlated, Found, STRONG};

/// A mode with the covariance of its σ and ω.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ringer {
    /// σ in 1/s.
    pub rate_per_s: f64,
    /// ω in rad/s.
    pub omega_rad_per_s: f64,
    /// Covariance of the two, if the data tell it.
    pub covariance: Option<[[f64; 2]; 2]>,
}

/// The constant that is known, with its standard uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Known {
    /// J in kg m².
    Inertia(f64, Option<f64>),
    /// K in N m/rad.
    Stiffness(f64, Option<f64>),
}

/// A number that depends on σ, ω and the anchor, with its derivatives.
struct Derived {
    name: &'static str,
    unit: &'static str,
    value: f64,
    slopes: [f64; 3],
}

impl Ringer {
    fn square(&self) -> f64 {
        self.rate_per_s.powi(2) + self.omega_rad_per_s.powi(2)
    }

    /// f/J and K/J.
    ///
    /// ```
    /// use torqcomp::identify::anchored::Ringer;
    /// let mode = Ringer { rate_per_s: 3.0, omega_rad_per_s: 4.0, covariance: None };
    /// // 2·3 and 3² + 4².
    /// let values: Vec<f64> = mode.over_inertia().iter().map(|f| f.value).collect();
    /// assert_eq!(values, [6.0, 25.0]);
    /// ```
    #[must_use]
    pub fn over_inertia(&self) -> Vec<Found> {
        let (s, w) = (self.rate_per_s, self.omega_rad_per_s);
        let ratios = [
            Derived {
                name: "damping_over_inertia",
                unit: "1/s",
                value: 2.0 * s,
                slopes: [2.0, 0.0, 0.0],
            },
            Derived {
                name: "stiffness_over_inertia",
                unit: "1/s^2",
                value: self.square(),
                slopes: [2.0 * s, 2.0 * w, 0.0],
            },
        ];
        self.named(&ratios, 0.0)
    }

    /// f/K and J/K.
    ///
    /// ```
    /// use torqcomp::identify::anchored::Ringer;
    /// let mode = Ringer { rate_per_s: 3.0, omega_rad_per_s: 4.0, covariance: None };
    /// // 6/25 and 1/25.
    /// let values: Vec<f64> = mode.over_stiffness().iter().map(|f| f.value).collect();
    /// assert_eq!(values, [0.24, 0.04]);
    /// ```
    #[must_use]
    pub fn over_stiffness(&self) -> Vec<Found> {
        let (s, w, q) = (self.rate_per_s, self.omega_rad_per_s, self.square());
        let ratios = [
            Derived {
                name: "damping_over_stiffness",
                unit: "s",
                value: 2.0 * s / q,
                slopes: [2.0 / q - 4.0 * s * s / (q * q), -4.0 * s * w / (q * q), 0.0],
            },
            Derived {
                name: "inertia_over_stiffness",
                unit: "s^2",
                value: 1.0 / q,
                slopes: [-2.0 * s / (q * q), -2.0 * w / (q * q), 0.0],
            },
        ];
        self.named(&ratios, 0.0)
    }

    /// The two constants that follow from the one that is known, and which of all three are hard to tell
    /// apart: where the anchor is the least certain number, all move with it.
    ///
    /// ```
    /// use torqcomp::identify::anchored::{Known, Ringer};
    /// let mode = Ringer { rate_per_s: 3.0, omega_rad_per_s: 4.0, covariance: None };
    /// let (found, _) = mode.anchored(Known::Stiffness(50.0, Some(1.0)));
    /// // J = 50/25, f = 2·3·2.
    /// assert_eq!((found[0].value, found[1].value), (2.0, 12.0));
    /// ```
    #[must_use]
    pub fn anchored(&self, known: Known) -> (Vec<Found>, Vec<Correlated>) {
        let (s, w, q) = (self.rate_per_s, self.omega_rad_per_s, self.square());
        let (anchor, others, std) = match known {
            Known::Inertia(j, std) => (
                constant("inertia", j, [0.0, 0.0, 1.0]),
                [
                    constant("stiffness", j * q, [2.0 * s * j, 2.0 * w * j, q]),
                    constant("damping", 2.0 * s * j, [2.0 * j, 0.0, 2.0 * s]),
                ],
                std,
            ),
            Known::Stiffness(k, std) => (
                constant("stiffness", k, [0.0, 0.0, 1.0]),
                [
                    constant(
                        "inertia",
                        k / q,
                        [-2.0 * s * k / (q * q), -2.0 * w * k / (q * q), 1.0 / q],
                    ),
                    constant(
                        "damping",
                        2.0 * s * k / q,
                        [
                            2.0 * k / q - 4.0 * s * s * k / (q * q),
                            -4.0 * s * w * k / (q * q),
                            2.0 * s / q,
                        ],
                    ),
                ],
                std,
            ),
        };
        let anchor_std = std.unwrap_or(0.0);
        let found = self.named(&others, anchor_std);
        let [first, second] = others;
        (found, self.correlated(&[anchor, first, second], anchor_std))
    }

    fn covariance_of(&self, a: &[f64; 3], b: &[f64; 3], anchor_std: f64) -> Option<f64> {
        let c = self.covariance?;
        let of_fit: f64 = (0..2)
            .flat_map(|i| (0..2).map(move |j| (i, j)))
            .map(|(i, j)| a[i] * c[i][j] * b[j])
            .sum();
        Some(of_fit + a[2] * b[2] * anchor_std * anchor_std)
    }

    fn named(&self, all: &[Derived], anchor_std: f64) -> Vec<Found> {
        let one = |d: &Derived| {
            let variance = self.covariance_of(&d.slopes, &d.slopes, anchor_std);
            Found::new(d.name, d.value, variance.map(f64::sqrt), d.unit)
        };
        all.iter().map(one).collect()
    }

    fn correlated(&self, all: &[Derived], anchor_std: f64) -> Vec<Correlated> {
        let mut pairs = Vec::new();
        let of = |a: &Derived, b: &Derived| self.covariance_of(&a.slopes, &b.slopes, anchor_std);
        for (i, a) in all.iter().enumerate() {
            for b in &all[i + 1..] {
                let (Some(both), Some(one), Some(other)) = (of(a, b), of(a, a), of(b, b)) else {
                    continue;
                };
                let coefficient = both / (one * other).sqrt();
                if coefficient.abs() >= STRONG {
                    pairs.push(Correlated {
                        first: a.name.to_owned(),
                        second: b.name.to_owned(),
                        coefficient,
                    });
                }
            }
        }
        pairs
    }
}

fn constant(name: &'static str, value: f64, slopes: [f64; 3]) -> Derived {
    let unit = match name {
        "inertia" => "kg m^2",
        "stiffness" => "N m/rad",
        _ => "N m s/rad",
    };
    Derived {
        name,
        unit,
        value,
        slopes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODE: Ringer = Ringer {
        rate_per_s: 20.0,
        omega_rad_per_s: 300.0,
        covariance: Some([[0.04, 0.01], [0.01, 0.09]]),
    };

    /// Slopes against differences of the values.
    #[test]
    fn uncertainties_are_those_of_small_changes() {
        for known in [
            Known::Inertia(0.5, Some(0.01)),
            Known::Stiffness(4e4, Some(900.0)),
        ] {
            let (found, _) = MODE.anchored(known);
            for (k, number) in found.iter().enumerate() {
                let moved = |ds: f64, dw: f64, da: f64| {
                    let mode = Ringer {
                        rate_per_s: MODE.rate_per_s + ds,
                        omega_rad_per_s: MODE.omega_rad_per_s + dw,
                        ..MODE
                    };
                    let known = match known {
                        Known::Inertia(v, s) => Known::Inertia(v + da, s),
                        Known::Stiffness(v, s) => Known::Stiffness(v + da, s),
                    };
                    mode.anchored(known).0[k].value - number.value
                };
                let size = match known {
                    Known::Inertia(..) => 0.01,
                    Known::Stiffness(..) => 900.0,
                };
                let h = 1e-6;
                let (a, b) = (moved(h, 0.0, 0.0) / h, moved(0.0, h, 0.0) / h);
                let c = moved(0.0, 0.0, h * size) / h;
                let want = (0.04 * a * a + 0.02 * a * b + 0.09 * b * b + c * c).sqrt();
                let got = number.std.unwrap();
                assert!(
                    (got / want - 1.0).abs() < 1e-4,
                    "{}: {got} {want}",
                    number.name
                );
            }
        }
    }

    #[test]
    fn constants_that_move_with_their_anchor_are_said() {
        // 2 % of the anchor against 0.1 % of the square of ω.
        let (_, pairs) = MODE.anchored(Known::Inertia(0.5, Some(0.01)));
        let has = |a: &str, b: &str| pairs.iter().any(|p| p.first == a && p.second == b);
        assert!(has("inertia", "stiffness"), "{pairs:?}");
        let (_, pairs) = MODE.anchored(Known::Inertia(0.5, None));
        assert!(pairs.iter().all(|p| p.first != "inertia"), "{pairs:?}");
    }
}
