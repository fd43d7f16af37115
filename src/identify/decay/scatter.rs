//! Scatter of frequency and damping between decays, beyond the noise of each.
//!
//! ```text
//! u² = (u_0² + τ² Σ w_s²/(Σ w_s)²) t²,   τ² = (Q − n + 1)/(Σ w_s − Σ w_s²/Σ w_s),   Q = Σ w_s (p_s − p̄)²
//! ```
//!
//! p_s: constant fitted to decay s of n alone, w_s: reciprocal of its variance, u_0: uncertainty of the common fit, from
//! noise, t: Student's factor with the degrees of freedom of Welch and Satterthwaite. (R. DerSimonian, N. Laird,
//! Controlled Clinical Trials 7 (1986), 177.) As in a response test, only scatter that is significant counts.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::modes::{self, ModesFit, Stretch};
use super::present::ABSENT;
use crate::identify::Identification;
use crate::print::rounded;
use crate::student::student;

/// Significance level of the test for scatter between decays.
const CHANCE: f64 = 0.05;

/// A fit with uncertainties that include the scatter between its decays, which is reported.
pub(super) fn widened(
    result: &mut Identification,
    mut fit: ModesFit,
    stretches: &[Stretch],
) -> ModesFit {
    if stretches.len() < 2 || fit.has_friction {
        return fit;
    }
    let alone = |s: usize| {
        let own = &stretches[s..=s];
        let found = modes::fit(own, &fit.poles).ok()?;
        Some((s, modes::with_honest_std(&found, own).ok()?))
    };
    let each: Vec<(usize, ModesFit)> = (0..stretches.len()).filter_map(alone).collect();
    let mut factors = vec![1.0; 2 * fit.poles.len()];
    for (i, factor) in factors.iter_mut().enumerate() {
        let amplitude = |s: usize| fit.amplitude(i / 2, s);
        let largest = (0..stretches.len()).map(amplitude).fold(0.0, f64::max);
        let rings = each
            .iter()
            .filter(|(s, _)| amplitude(*s) > ABSENT * largest);
        let constants = rings.filter_map(|(_, own)| Some((own.fit.values[i], own.fit.std[i]?)));
        let scatter = BetweenDecays::of(&constants.collect::<Vec<_>>());
        if let Some((scatter, std)) = scatter.zip(fit.fit.covariance.std(i)) {
            *factor = scatter.factor(std);
            result.method.push(format!(
                "the {} of the mode at {} Hz differs from decay to decay by {} % (standard deviation), more than noise \
                 explains; its uncertainty allows for that",
                ["decay rate", "frequency"][i % 2],
                rounded(fit.poles[i / 2].frequency_hz(), 5),
                rounded(100.0 * scatter.std / fit.fit.values[i].abs(), 2)
            ));
        }
    }
    fit.fit.covariance = fit.fit.covariance.with_factors(&factors);
    fit
}

/// Significant scatter of a constant.
#[derive(Debug, Clone, Copy, PartialEq)]
struct BetweenDecays {
    /// Its standard deviation between decays.
    std: f64,
    /// Number of decays of equal weight.
    decays: f64,
}

impl BetweenDecays {
    /// Of estimates and their standard uncertainties; `None` if noise explains it.
    fn of(estimates: &[(f64, f64)]) -> Option<Self> {
        let freedom = estimates.len().checked_sub(1).filter(|n| *n > 0)? as f64;
        let weights: Vec<f64> = estimates.iter().map(|(_, std)| std.powi(-2)).collect();
        let pairs = || estimates.iter().zip(&weights);
        let (sum, squares) = weights
            .iter()
            .fold((0.0, 0.0), |s, w| (s.0 + w, s.1 + w * w));
        let mean = pairs().map(|((value, _), w)| value * w).sum::<f64>() / sum;
        let off: f64 = pairs()
            .map(|((value, _), w)| w * (value - mean).powi(2))
            .sum();
        let by_chance = ChiSquared::new(freedom).ok()?.inverse_cdf(1.0 - CHANCE);
        let decays = sum * sum / squares;
        (off > by_chance).then(|| Self {
            std: ((off - freedom) / (sum - sum / decays)).sqrt(),
            decays,
        })
    }

    /// Factor of a standard uncertainty that comes from noise alone.
    fn factor(&self, std: f64) -> f64 {
        let (own, between) = (std * std, self.std.powi(2) / self.decays);
        let share = between / (own + between);
        let freedom = (self.decays - 1.0).max(1.0) / (share * share);
        (1.0 + between / own).sqrt() * student(freedom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scatter_far_beyond_noise_is_that_of_the_mean_with_students_factor() {
        // Standard deviation 1, so 1/√3 of the mean; Student's factor is 4.303/1.960.
        let found = BetweenDecays::of(&[(9.0, 1e-3), (10.0, 1e-3), (11.0, 1e-3)]).unwrap();
        let std = 1e-3 / 3.0_f64.sqrt() * found.factor(1e-3 / 3.0_f64.sqrt());
        assert!((std / (2.195 / 3.0_f64.sqrt()) - 1.0).abs() < 1e-3, "{std}");
        assert_eq!(
            BetweenDecays::of(&[(9.0, 1.0), (10.0, 1.0), (11.0, 1.0)]),
            None
        );
        assert_eq!(BetweenDecays::of(&[(9.0, 1.0)]), None);
    }
}
