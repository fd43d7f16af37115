//! The linear response of a stand as a sum of modes.
//!
//! ```text
//! H(s) = Σ (r_k + q_k s/ω_k) ω_k²/(s² + 2ζ_k ω_k s + ω_k²) + c,   Σ r_k + c = 1
//! ```
//!
//! `H` is recorded over applied quantity, relative to that at rest. `r_k` is the part that mode `k` has in the response at
//! rest; `c`, what they leave of 1, is the compliance of all modes above the band. `q_k` is zero where all parts of the
//! stand pass through zero together, as with damping in proportion to stiffness and inertia (D. J. Ewins, *Modal Testing*,
//! 2nd ed. (2000), 2.4 to 2.7, 4.4). A stand with `J θ'' + f θ' + K θ = T` has one mode with `r = 1`.
//!
//! With the shapes `φ` of the modes at the load and at the gage `r_k = φ_k(load) φ_k(gage)/ω_k²`, over the sum of them. A
//! torque that acts beside the gage moves it by the parts `g_k = φ_k(gage)²/ω_k²`, over their sum.

use num_complex::Complex64;

use crate::check::{non_negative, positive};
use crate::error::ModelError;
use crate::mode::Mode;

/// What one mode has in the response of a stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModalPart {
    /// The mode.
    pub mode: Mode,
    /// `r`: its fraction of the static response.
    pub residue: f64,
    /// `q`: the part of its residue that goes with the speed.
    pub quadrature: f64,
    /// `g`: its part in what a torque at the gage moves the gage by, at rest; `None` if that is not known.
    pub at_gage: Option<f64>,
}

impl ModalPart {
    /// `(r + q jω/ω_k)/(1 − (ω/ω_k)² + 2jζ ω/ω_k)`, where `inverse` is the denominator.
    fn over(&self, omega_rad_s: f64, inverse: Complex64) -> Complex64 {
        let w = omega_rad_s / self.mode.omega_rad_s;
        Complex64::new(self.residue, self.quadrature * w) / inverse
    }
}

/// The linear response of a stand: a sum of modes, often of one.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalResponse {
    parts: Vec<ModalPart>,
    /// `c`: what is left of the response at rest.
    residual: f64,
}

impl From<Mode> for ModalResponse {
    /// A stand with one mode.
    fn from(mode: Mode) -> Self {
        Self {
            parts: vec![ModalPart {
                mode,
                residue: 1.0,
                quadrature: 0.0,
                at_gage: Some(1.0),
            }],
            residual: 0.0,
        }
    }
}

impl ModalResponse {
    /// A sum of modes, in the order given; what their residues leave of 1 is the compliance of those above the band.
    ///
    /// # Errors
    /// [`ModelError`] if there is none, or one has a frequency, damping or residue that no mode has.
    ///
    /// ```
    /// use torqcomp_model::{ModalPart, ModalResponse, Mode};
    /// let part = |omega_rad_s, residue| ModalPart {
    ///     mode: Mode { omega_rad_s, damping_ratio: 0.5 },
    ///     residue,
    ///     quadrature: 0.0,
    ///     at_gage: None,
    /// };
    /// let stand = ModalResponse::new(vec![part(1.0, 0.75), part(2.0, 0.125)])?;
    /// // At ω = 1: 0.75/(j 1) + 0.125/(1 − 1/4 + j/2) + 0.125, where 1/(3/4 + j/2) = (12 − 8j)/13.
    /// let response = stand.response(1.0);
    /// assert!((response.re - (0.125 * 12.0 / 13.0 + 0.125)).abs() < 1e-15);
    /// assert!((response.im + 0.75 + 1.0 / 13.0).abs() < 1e-15);
    /// assert_eq!(stand.response(0.0).re, 1.0);
    /// # Ok::<(), torqcomp_model::ModelError>(())
    /// ```
    pub fn new(parts: Vec<ModalPart>) -> Result<Self, ModelError> {
        positive("number of modes", "", parts.len() as f64)?;
        for part in &parts {
            positive("natural angular frequency", "rad/s", part.mode.omega_rad_s)?;
            non_negative("damping ratio", "(ratio)", part.mode.damping_ratio)?;
            // Of either sign, but finite.
            non_negative("size of the residue", "(ratio)", part.residue.abs())?;
            non_negative("size of the quadrature", "(ratio)", part.quadrature.abs())?;
        }
        Ok(Self {
            residual: 1.0 - parts.iter().map(|part| part.residue).sum::<f64>(),
            parts,
        })
    }

    /// The modes with their parts.
    #[must_use]
    pub fn parts(&self) -> &[ModalPart] {
        &self.parts
    }

    /// `c`: the part of the response at rest that comes from modes above the band.
    #[must_use]
    pub fn residual(&self) -> f64 {
        self.residual
    }

    /// The first mode, which the others are measured by.
    #[must_use]
    pub fn first(&self) -> Mode {
        self.parts[0].mode
    }

    /// The mode of a stand that has no other part.
    #[must_use]
    pub fn only(&self) -> Option<Mode> {
        match &self.parts[..] {
            [part] if part.residue == 1.0 && part.quadrature == 0.0 => Some(part.mode),
            _ => None,
        }
    }

    /// Highest natural frequency of its modes, in Hz.
    #[must_use]
    pub fn highest_hz(&self) -> f64 {
        let all = self
            .parts
            .iter()
            .map(|part| part.mode.natural_frequency_hz());
        all.fold(0.0, f64::max)
    }

    /// The response `H` at `s = jω`.
    #[must_use]
    pub fn response(&self, omega_rad_s: f64) -> Complex64 {
        match self.only() {
            Some(mode) => mode.response(omega_rad_s),
            None => self.sum(omega_rad_s, |_, inverse| inverse),
        }
    }

    /// Its inverse: applied per recorded quantity, relative to that at rest.
    #[must_use]
    pub fn inverse(&self, omega_rad_s: f64) -> Complex64 {
        self.inverse_with(omega_rad_s, |_, inverse| inverse)
    }

    /// The inverse response with a change of each mode's own, as by a loss in the material: `change` takes a mode and its
    /// `1 − (ω/ω_k)² + 2jζ ω/ω_k`.
    #[must_use]
    pub fn inverse_with(
        &self,
        omega_rad_s: f64,
        change: impl Fn(&Mode, Complex64) -> Complex64,
    ) -> Complex64 {
        match self.only() {
            Some(mode) => change(&mode, mode.inverse(omega_rad_s)),
            None => self.sum(omega_rad_s, change).inv(),
        }
    }

    fn sum(&self, omega: f64, change: impl Fn(&Mode, Complex64) -> Complex64) -> Complex64 {
        let parts = self.parts.iter().map(|part| {
            let inverse = change(&part.mode, part.mode.inverse(omega));
            part.over(omega, inverse)
        });
        parts.sum::<Complex64>() + self.residual
    }

    /// What a torque that acts beside the gage moves it by, at `s = jω`, relative to that at rest; `None` if the parts of
    /// the modes in it are not known. A stand with one mode has its response there.
    #[must_use]
    pub fn at_gage(&self) -> Option<Self> {
        let part = |part: &ModalPart| {
            Some(ModalPart {
                residue: part.at_gage?,
                quadrature: 0.0,
                ..*part
            })
        };
        let parts: Option<Vec<ModalPart>> = self.parts.iter().map(part).collect();
        Self::new(parts?).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(omega_rad_s: f64, damping_ratio: f64) -> Mode {
        Mode {
            omega_rad_s,
            damping_ratio,
        }
    }

    #[test]
    fn one_mode_is_the_plain_stand_bit_by_bit() {
        let mode = mode(3707.1, 0.07);
        let stand = ModalResponse::from(mode);
        for k in 0..500 {
            let omega = 37.3 * f64::from(k);
            assert_eq!(stand.inverse(omega), mode.inverse(omega));
            assert_eq!(stand.response(omega), mode.response(omega));
        }
    }

    /// Two inertias in a row: `J₁ = J₂ = 1`, `K₁ = K₂ = 1`, torque on the second, twist of the first spring recorded. Its
    /// poles are at `ω² = (3 ∓ √5)/2`, and `θ₁/T = 1/((s² + 2)(s² + 1) − 1)` by Cramer's rule.
    #[test]
    fn two_inertias_are_a_sum_of_two_modes() {
        let squares = [0.5 * (3.0 - 5.0_f64.sqrt()), 0.5 * (3.0 + 5.0_f64.sqrt())];
        // 1/((λ₁ − w)(λ₂ − w)), w = ω², in partial fractions: ± 1/(λ₂ − λ₁)/(λ − w).
        let apart = squares[1] - squares[0];
        let parts = [1.0, -1.0]
            .iter()
            .zip(squares)
            .map(|(sign, square)| ModalPart {
                mode: mode(square.sqrt(), 0.0),
                residue: sign / apart / square,
                quadrature: 0.0,
                at_gage: None,
            });
        let stand = ModalResponse::new(parts.collect()).unwrap();
        assert!(stand.residual().abs() < 1e-15);
        for omega in [0.0, 0.3, 1.1, 2.7] {
            let s2 = -omega * omega;
            let want = 1.0 / ((s2 + 2.0) * (s2 + 1.0) - 1.0);
            assert!((stand.response(omega).re - want).abs() < 1e-12 * want.abs());
        }
    }

    #[test]
    fn impossible_modes_are_refused() {
        let part = |omega, ratio, residue| ModalPart {
            mode: mode(omega, ratio),
            residue,
            quadrature: 0.0,
            at_gage: None,
        };
        assert!(ModalResponse::new(Vec::new()).is_err());
        for wrong in [
            part(0.0, 0.1, 1.0),
            part(1.0, -0.1, 1.0),
            part(1.0, 0.1, f64::NAN),
        ] {
            assert!(ModalResponse::new(vec![wrong]).is_err(), "{wrong:?}");
        }
        assert!(ModalResponse::new(vec![part(1.0, 0.1, -1.0)]).is_ok());
    }
}
