//! The linear response of a stand as a sum of modes.
//!
//! ```text
//! H(s) = Σ (r_k + q_k s/ω_k) ω_k²/(s² + 2ζ_k ω_k s + ω_k²) + c,   Σ r_k + c = 1
//! ```
//!
//! `H` is recorded over applied quantity, normalised to its static value. `r_k` is the contribution of mode `k` to the
//! static response; `c`, the remainder to 1, is the compliance of all modes above the band. `q_k` is zero where all
//! parts of the stand pass through zero together, as with proportional damping (D. J. Ewins, *Modal Testing*, 2nd ed.
//! (2000), 2.4 to 2.7, 4.4). A stand with `J θ'' + f θ' + K θ = T` has one mode with `r = 1`.
//!
//! With the mode shapes `φ` at the load and at the gage, `r_k = φ_k(load) φ_k(gage)/ω_k²`, normalised by their sum. A
//! torque that acts at the gage moves it by the contributions `g_k = φ_k(gage)²/ω_k²`, normalised by their sum.

use num_complex::Complex64;

use crate::check::{non_negative, positive};
use crate::error::ModelError;
use crate::mode::Mode;

/// Smallest factor on the stiffness with which a stand is simulated.
const LEAST_STIFFNESS: f64 = 0.05;

/// Contribution of one mode to the response of a stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModalPart {
    /// The mode.
    pub mode: Mode,
    /// `r`: its contribution to the static response.
    pub residue: f64,
    /// `q`: the velocity-proportional part of its residue.
    pub quadrature: f64,
    /// `g`: its contribution to the static displacement of the gage by a torque at the gage; `None` if
    /// unknown.
    pub at_gage: Option<f64>,
}

impl ModalPart {
    /// The same for a torque at the gage: without a quadrature, unless that is where the load acts.
    pub(crate) fn of_torque(&self) -> Self {
        Self {
            residue: self.at_gage.unwrap_or(0.0),
            quadrature: match self.at_gage == Some(self.residue) {
                true => self.quadrature,
                false => 0.0,
            },
            ..*self
        }
    }

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
    /// `c`: the remainder of the static response.
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
    /// A sum of modes, in the order given; the remainder of their residues to 1 is the compliance of the modes above
    /// the band.
    ///
    /// # Errors
    /// [`ModelError`] if there is none, or one has an invalid frequency, damping or residue.
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

    /// The response of an inertia `J₁` on a spring to a torque on it, with a second inertia `J₂ = μ J₁` attached to it by
    /// a spring and a damper; `None` if one of the modes does not ring. With `x₂` for the second inertia,
    ///
    /// ```text
    /// x₁'' + 2ζ₁ω₁ x₁' + ω₁² x₁ = ω₁² u + μ a,   x₂'' = −a,   a = 2ζ₂ω₂ (x₂' − x₁') + ω₂² (x₂ − x₁)
    /// ```
    ///
    /// has [two modes](Mode::coupled_to), with residues `ω₁² (p² + 2ζ₂ω₂ p + ω₂²)/D'(p)` at the roots `p` of `D(s) = (s² +
    /// 2ζ₁ω₁ s + ω₁²)(s² + 2ζ₂ω₂ s + ω₂²) + μ s² (2ζ₂ω₂ s + ω₂²)`. The part with the larger residue comes first.
    ///
    /// ```
    /// use torqcomp_model::{ModalResponse, Mode};
    /// let mode = |omega_rad_s| Mode { omega_rad_s, damping_ratio: 0.0 };
    /// // s⁴ + (1 + 4 + μ 4) s² + 4 with μ = 2.25 has the roots s² = −7 ± √45.
    /// let stand = ModalResponse::of_two_inertias(mode(1.0), mode(2.0), 2.25).unwrap();
    /// let slow = stand.parts()[0];
    /// assert!((slow.mode.omega_rad_s.powi(2) - (7.0 - 45f64.sqrt())).abs() < 1e-12);
    /// // r = (4 − ω²)/(ω² (ω₂² − ω²)).
    /// let own = 7.0 - 45f64.sqrt();
    /// assert!((slow.residue - (4.0 - own) / (own * 2.0 * 45f64.sqrt())).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn of_two_inertias(first: Mode, second: Mode, ratio: f64) -> Option<Self> {
        // In units of ω₁.
        let rho = second.omega_rad_s / first.omega_rad_s;
        let (loss, spring) = (2.0 * second.damping_ratio * rho, rho * rho);
        let own_loss = 2.0 * first.damping_ratio;
        let part = |mode: Mode| {
            let size = mode.omega_rad_s / first.omega_rad_s;
            let swing = (1.0 - mode.damping_ratio.powi(2)).sqrt();
            let p = size * Complex64::new(-mode.damping_ratio, swing);
            let own = p * p + own_loss * p + 1.0;
            let hung = p * p + loss * p + spring;
            let slope = (2.0 * p + own_loss) * hung
                + own * (2.0 * p + loss)
                + ratio * p * (3.0 * loss * p + 2.0 * spring);
            let share = hung / slope;
            // R/(s − p) and its conjugate: (2 Re R s − 2 Re(R p*))/(s² − 2 Re p s + |p|²).
            let residue = -2.0 * (share * p.conj()).re / (size * size);
            ModalPart {
                mode,
                residue,
                quadrature: 2.0 * share.re / size,
                at_gage: Some(residue),
            }
        };
        let modes = first.coupled_to(&second, ratio);
        if modes.len() != 2 || modes.iter().any(|mode| mode.damping_ratio >= 1.0) {
            return None;
        }
        let mut parts: Vec<ModalPart> = modes.into_iter().map(part).collect();
        parts.sort_by(|a, b| b.residue.total_cmp(&a.residue));
        let stand = Self::new(parts).ok()?;
        Some(Self {
            residual: 0.0,
            ..stand
        })
    }

    /// The modes with their parts.
    #[must_use]
    pub fn parts(&self) -> &[ModalPart] {
        &self.parts
    }

    /// `c`: the contribution of modes above the band to the static response.
    #[must_use]
    pub fn residual(&self) -> f64 {
        self.residual
    }

    /// The first mode, the reference for the others.
    #[must_use]
    pub fn first(&self) -> Mode {
        self.parts[0].mode
    }

    /// The mode of a single-mode stand.
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

    /// The inverse response: applied per recorded quantity, normalised to its static value.
    #[must_use]
    pub fn inverse(&self, omega_rad_s: f64) -> Complex64 {
        self.inverse_with(omega_rad_s, |_, inverse| inverse)
    }

    /// The inverse response with a modification of each mode, as by material damping: `change` gets a mode and its
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

    /// Response of the gage to a torque at the gage, at `s = jω`, normalised to its static value; `None` if the
    /// contributions of the modes to it are unknown. It is the stand's response if the torque acts where the load does.
    #[must_use]
    pub fn at_gage(&self) -> Option<Self> {
        let acts_there = |part: &ModalPart| part.at_gage == Some(part.residue);
        if self.parts.iter().all(acts_there) {
            return Some(self.clone());
        }
        let part = |part: &ModalPart| part.at_gage.map(|_| part.of_torque());
        let parts: Option<Vec<ModalPart>> = self.parts.iter().map(part).collect();
        Self::new(parts?).ok()
    }

    /// The stand with another dynamic stiffness `κ K` in each mode, as it is at the natural frequency: `ω √Re κ`,
    /// `ζ/√Re κ + Im κ/(2 Re κ)`, and a displacement of `1/Re κ` times that under the same torque. `None` if a mode would
    /// not be stable.
    pub(crate) fn stiffened(
        &self,
        change: impl Fn(&Mode, f64, Complex64) -> Complex64,
    ) -> Option<Self> {
        let part = |part: &ModalPart| {
            let omega = part.mode.omega_rad_s;
            let plain = part.mode.inverse(omega);
            let factor = 1.0 + change(&part.mode, omega, plain) - plain;
            let damping_ratio =
                part.mode.damping_ratio / factor.re.sqrt() + 0.5 * factor.im / factor.re;
            (factor.re > LEAST_STIFFNESS && damping_ratio >= 0.0).then(|| ModalPart {
                mode: Mode {
                    omega_rad_s: omega * factor.re.sqrt(),
                    damping_ratio,
                },
                residue: part.residue / factor.re,
                quadrature: part.quadrature / factor.re,
                at_gage: part.at_gage.map(|at_gage| at_gage / factor.re),
            })
        };
        let parts: Option<Vec<ModalPart>> = self.parts.iter().map(part).collect();
        Some(Self {
            parts: parts?,
            residual: self.residual,
        })
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

    /// Two inertias in series: `J₁ = J₂ = 1`, `K₁ = K₂ = 1`, torque on the second, twist of the first spring recorded.
    /// Its poles are at `ω² = (3 ∓ √5)/2`, and `θ₁/T = 1/((s² + 2)(s² + 1) − 1)` by Cramer's rule.
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
