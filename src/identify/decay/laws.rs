//! Damping laws of the envelope of a single mode.
//!
//! Slowly varying amplitude of x'' + ω² x = −(damping) (A. H. Nayfeh, D. T. Mook, Nonlinear
//! Oscillations, 1979, 3.3; averaging over a cycle):
//!
//! | law | A(t) |
//! |---|---|
//! | viscous, and structural at one frequency | `A' = −σ A` |
//! | dry friction | `A' = −s` |
//! | quadratic (drag) | `A' = −β A²` |
//! | viscous and dry | `A' = −σ A − s` |
//! | viscous and quadratic | `A' = −σ A − β A²` |
//!
//! Laws with dry friction are fitted half cycle by half cycle instead ([`super::friction`], s = 2Fω/π): few half cycles remain
//! before it stops the stand, and at a displaced zero.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::sort_by_number;
use torqcomp_model::fit::{Fit, FitError, Options, Parameter, WithJacobian, minimize};

use super::friction;
use super::modes::Stretch;
use crate::identify::Pole;

/// A law of damping.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(into = "&'static str")]
#[schemars(from = "&'static str")]
pub enum Law {
    /// Proportional to speed; or structural, with a loss per cycle proportional to the square of the amplitude, which
    /// looks the same at one frequency.
    Viscous,
    /// Of constant magnitude.
    Dry,
    /// Proportional to the square of speed.
    Quadratic,
    /// Viscous and dry.
    ViscousAndDry,
    /// Viscous and quadratic.
    ViscousAndQuadratic,
}

impl Law {
    /// All laws, simplest first.
    const ALL: [Self; 5] = [
        Self::Viscous,
        Self::Dry,
        Self::Quadratic,
        Self::ViscousAndDry,
        Self::ViscousAndQuadratic,
    ];

    /// Name for text and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Viscous => "viscous or structural",
            Self::Dry => "dry friction",
            Self::Quadratic => "quadratic",
            Self::ViscousAndDry => "viscous and dry friction",
            Self::ViscousAndQuadratic => "viscous and quadratic",
        }
    }

    /// Whether it has a dry term.
    fn is_dry(self) -> bool {
        self.parts()[1]
    }

    /// Whether it has a viscous, a dry and a quadratic term.
    fn parts(self) -> [bool; 3] {
        match self {
            Self::Viscous => [true, false, false],
            Self::Dry => [false, true, false],
            Self::Quadratic => [false, false, true],
            Self::ViscousAndDry => [true, true, false],
            Self::ViscousAndQuadratic => [true, false, true],
        }
    }
}

impl From<Law> for &'static str {
    fn from(law: Law) -> Self {
        law.name()
    }
}

/// Amplitude at time t from a start A₀ with rates σ (1/s) and β (1/(unit s)).
///
/// `A = A₀ e^{−σt} / (1 + βA₀ (1 − e^{−σt})/σ)`, with its limit for σ → 0.
///
/// ```
/// use torqcomp::identify::decay::envelope;
/// // Drag alone: 2/(1 + 0.5·2·3) = 0.5.
/// assert_eq!(envelope(2.0, 0.0, 0.5, 3.0), 0.5);
/// ```
pub fn envelope(start: f64, sigma: f64, quadratic: f64, time_s: f64) -> f64 {
    let fall = (-sigma * time_s).exp();
    // (1 − e^{−σt})/σ, which tends to t.
    let reach = if sigma * time_s > 1e-9 {
        -(-sigma * time_s).exp_m1() / sigma
    } else {
        time_s
    };
    start * fall / (1.0 + quadratic * start * reach)
}

/// Amplitude and its derivatives by A₀, σ and β: with E = e^{−σt}, r = (1 − E)/σ and D = 1 + βA₀r, `E/D²`,
/// `−tA₀E/D − A₀²Eβr'/D²` and `−A₀²Er/D²`; r' = (tE − r)/σ, tending to −t²/2.
fn envelope_slopes([start, sigma, quadratic]: [f64; 3], time_s: f64) -> (f64, [f64; 3]) {
    let fall = (-sigma * time_s).exp();
    let turn = sigma * time_s;
    let (reach, bend) = if turn > 1e-4 {
        let reach = -(-turn).exp_m1() / sigma;
        (reach, (time_s * fall - reach) / sigma)
    } else {
        let reach = time_s * (1.0 - 0.5 * turn + turn * turn / 6.0);
        (reach, time_s * time_s * (turn / 3.0 - 0.5))
    };
    let below = 1.0 + quadratic * start * reach;
    let square = below * below;
    let slopes = [
        fall / square,
        -time_s * start * fall / below - start * start * fall * quadratic * bend / square,
        -start * start * fall * reach / square,
    ];
    (start * fall / below, slopes)
}

/// A constant of a law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct LawConstant {
    /// Value.
    pub value: f64,
    /// Standard uncertainty for white noise; `null` if unknown.
    pub std: Option<f64>,
}

/// One law fitted to the data.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LawFit {
    /// The law.
    pub law: Law,
    /// Root mean square of the residual.
    pub rms: f64,
    /// Bayesian information criterion, with the samples counted by the power of the noise at the mode: less is better.
    pub criterion: f64,
    /// Damping ratio of the viscous part; `null` for laws without dry friction.
    pub damping_ratio: Option<LawConstant>,
    /// Dry friction, as the static signal that balances it, in the unit of the signal; `null` for laws without it.
    pub dry_friction: Option<LawConstant>,
    /// Whether no part of the law was fitted as zero.
    #[serde(skip)]
    is_complete: bool,
}

/// The viscous fit that provides the start values.
#[derive(Debug, Clone, Copy)]
pub(super) struct ViscousFit {
    /// Its mode.
    pub pole: Pole,
    /// a, b, c and d of the stretch.
    pub linear: [f64; 4],
    /// Noise power at the mode, relative to white noise of the same variance.
    pub relative_density: f64,
}

/// Fits a law to a segment with one mode.
fn fit(law: Law, stretch: &Stretch, viscous: &ViscousFit) -> Result<LawFit, FitError> {
    if law.is_dry() {
        return with_friction(law, stretch, viscous);
    }
    let parameters = parameters(law, stretch, viscous.pole, viscous.linear);
    let residuals = |p: &[f64], out: &mut Vec<f64>| {
        let pairs = stretch.times_s.iter().zip(&stretch.values);
        out.extend(pairs.map(|(t, y)| {
            let size = envelope(p[0], p[5], p[6], *t);
            size * (p[1] * t + p[2]).cos() + p[3] + p[4] * t - y
        }));
        Ok(())
    };
    let jacobian = |p: &[f64], out: &mut DMatrix<f64>| {
        for (row, t) in stretch.times_s.iter().enumerate() {
            let (size, slopes) = envelope_slopes([p[0], p[5], p[6]], *t);
            let (sin, cos) = (p[1] * t + p[2]).sin_cos();
            let [by_start, by_sigma, by_quadratic] = slopes.map(|s| s * cos);
            let all = [
                by_start,
                -size * t * sin,
                -size * sin,
                1.0,
                *t,
                by_sigma,
                by_quadratic,
            ];
            for (column, value) in all.into_iter().enumerate() {
                out[(row, column)] = value;
            }
        }
        Ok(())
    };
    let problem = WithJacobian {
        residuals,
        jacobian,
    };
    let options = Options {
        tolerance: 1e-9,
        most_evaluations: 600,
        ..Options::default()
    };
    let fit = minimize(&problem, &parameters, &options)?;
    let is_complete = !fit.at_bound[5..].iter().any(|b| *b);
    Ok(LawFit {
        is_complete,
        ..summed(law, &fit, viscous.relative_density)
    })
}

/// Fits a law with dry friction.
fn with_friction(law: Law, stretch: &Stretch, viscous: &ViscousFit) -> Result<LawFit, FitError> {
    let [is_viscous, ..] = law.parts();
    let sine = (viscous.pole, &viscous.linear[..]);
    let fit = friction::fit(std::slice::from_ref(stretch), sine, is_viscous)?;
    let last = fit.values.len() - 1;
    let natural = fit.values[0].hypot(fit.values[1]);
    let constant = |i: usize, unit: f64| LawConstant {
        value: fit.values[i] / unit,
        std: fit.std[i].map(|std| std / unit),
    };
    Ok(LawFit {
        damping_ratio: is_viscous.then(|| constant(0, natural)),
        dry_friction: Some(constant(last, 1.0)),
        is_complete: !(fit.at_bound[last] || is_viscous && fit.at_bound[0]),
        ..summed(law, &fit, viscous.relative_density)
    })
}

/// Amplitude, ω, phase, offset, drift, σ and β with their start values and bounds, for a law without dry friction.
fn parameters(law: Law, stretch: &Stretch, pole: Pole, start: [f64; 4]) -> [Parameter; 7] {
    let [a, b, offset, drift] = start;
    let amplitude = a.hypot(b).max(f64::MIN_POSITIVE);
    let phase = (-b).atan2(a);
    let parts = law.parts();
    let rate = pole.rate_per_s.max(1e-6 * pole.omega_rad_per_s);
    let length = stretch.times_s.last().copied().unwrap_or(1.0);
    let share = match parts.iter().filter(|has| **has).count() {
        1 => 1.0,
        _ => 0.5,
    };
    let part = |has: bool, name: &str, value: f64, scale: f64| {
        let start = if has { value } else { 0.0 };
        let parameter = Parameter::new(name, start).at_least(0.0).scaled(scale);
        if has { parameter } else { parameter.fixed() }
    };
    let quadratic = share * rate / amplitude;
    [
        Parameter::new("amplitude", amplitude).at_least(0.0),
        Parameter::new("omega", pole.omega_rad_per_s),
        Parameter::new("phase", phase).scaled(1.0),
        Parameter::new("offset", offset).scaled(amplitude),
        Parameter::new("drift", drift).scaled(amplitude / length),
        part(parts[0], "viscous", share * rate, rate),
        part(parts[2], "quadratic", quadratic, rate / amplitude),
    ]
}

/// Number of parameters of a law other than damping: amplitude, frequency, phase, offset and drift.
const WITHOUT_DAMPING: usize = 5;

/// The criterion of a law.
fn summed(law: Law, fit: &Fit, relative_density: f64) -> LawFit {
    let n = fit.residuals.len() as f64;
    let parts = law.parts().iter().filter(|has| **has).count();
    let free = (WITHOUT_DAMPING + parts) as f64;
    LawFit {
        law,
        rms: fit.rms,
        criterion: n / relative_density * fit.rms.powi(2).max(f64::MIN_POSITIVE).ln()
            + free * n.ln(),
        damping_ratio: None,
        dry_friction: None,
        is_complete: true,
    }
}

/// The laws in ascending order of the criterion, without those of which a term vanishes, as a
/// simpler law is equivalent.
///
/// # Errors
/// [`FitError`] if a law cannot be fitted.
pub(super) fn compare(stretch: &Stretch, viscous: &ViscousFit) -> Result<Vec<LawFit>, FitError> {
    let mut all = Vec::new();
    for law in Law::ALL {
        let fitted = fit(law, stretch, viscous)?;
        if fitted.is_complete {
            all.push(fitted);
        }
    }
    sort_by_number(&mut all, |law| law.criterion);
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_small_changes() {
        for p in [[2.0, 30.0, 3.0], [2.0, 0.0, 3.0], [1.0, 1e-3, 0.0]] {
            let (size, slopes) = envelope_slopes(p, 0.04);
            assert!((size - envelope(p[0], p[1], p[2], 0.04)).abs() < 1e-9);
            for k in 0..3 {
                let h = 1e-6;
                let mut there = p;
                there[k] += h;
                let change = envelope(there[0], there[1], there[2], 0.04) - size;
                let error = (change / h - slopes[k]).abs();
                assert!(error < 1e-5 * (1.0 + slopes[k].abs()), "{p:?} {k}: {error}");
            }
        }
    }
}
