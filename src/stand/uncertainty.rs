//! Standard uncertainty of what a compensation multiplies by, from all constants of the stand file.

use std::f64::consts::TAU;

use num_complex::Complex64;
use torqcomp_model::{InverseUncertainty, SecondOrder};

use super::{Mechanics, Stand};

impl Stand {
    /// Standard uncertainty of the inverse response at a frequency: of inertia, damping and stiffness with their
    /// correlations, of the effects' parameters, of the recorder's low-pass and delay, and of the static gain, whose
    /// relative uncertainty is given. Constants without a `std` count as exact. `None` if no uncertainty is known, or if
    /// an effect that is no response over frequency has one.
    #[must_use]
    pub fn inverse_uncertainty(
        &self,
        frequency_hz: f64,
        static_gain_relative: Option<f64>,
    ) -> Option<InverseUncertainty> {
        let of_stand = match self.effects.is_empty() {
            true => self.of_mechanics(frequency_hz),
            false => self.of_mechanics_and_effects(frequency_hz)?,
        };
        let of_recorder = self.of_recorder(frequency_hz);
        let of_gain = static_gain_relative.map(|std| InverseUncertainty {
            magnitude_relative: std,
            phase_rad: 0.0,
        });
        let known = [of_stand, of_recorder, of_gain];
        known
            .into_iter()
            .flatten()
            .reduce(|a, b| InverseUncertainty {
                magnitude_relative: a.magnitude_relative.hypot(b.magnitude_relative),
                phase_rad: a.phase_rad.hypot(b.phase_rad),
            })
    }

    fn of_mechanics(&self, frequency_hz: f64) -> Option<InverseUncertainty> {
        let mechanics = self.mechanics.as_ref()?;
        let found = mechanics
            .response
            .inverse_uncertainty(frequency_hz, &mechanics.std);
        found.ok().flatten()
    }

    /// By the slopes over each parameter, from central differences; `None` if the stand with its effects has
    /// no inverse response.
    fn of_mechanics_and_effects(&self, frequency_hz: f64) -> Option<Option<InverseUncertainty>> {
        let has_std = |effect: &super::DeclaredEffect| effect.stds.iter().any(Option::is_some);
        if self.inverse().is_err() {
            let is_exact = !self.effects.iter().any(has_std);
            return is_exact.then(|| self.of_mechanics(frequency_hz));
        }
        let mechanics = self.mechanics.as_ref()?;
        let mut terms: Vec<Complex64> = Vec::new();
        for place in 0..3 {
            let with = |side: f64| -> Option<Self> {
                let mechanics = mechanics.moved(place, side)?;
                Some(Self {
                    mechanics: Some(mechanics),
                    ..self.clone()
                })
            };
            terms.push(change(&with, frequency_hz).unwrap_or(Complex64::ZERO));
        }
        for (i, effect) in self.effects.iter().enumerate() {
            for (k, std) in effect.stds.iter().enumerate() {
                let Some(std) = std else { continue };
                let with = |side: f64| {
                    let mut stand = self.clone();
                    stand.effects[i].values[k] += side * std;
                    Some(stand)
                };
                terms.push(change(&with, frequency_hz)?);
            }
        }
        let std = &mechanics.std;
        let of_constants = [
            std.inertia_kg_m2,
            std.damping_n_m_s_per_rad,
            std.stiffness_n_m_per_rad,
        ];
        let is_known = of_constants.iter().any(Option::is_some) || self.effects.iter().any(has_std);
        let [jf, jk, fk] = std.correlations;
        let correlated = [(0, 1, jf), (0, 2, jk), (1, 2, fk)];
        let size = |part: fn(&Complex64) -> f64| -> f64 {
            let own: f64 = terms.iter().map(|z| part(z) * part(z)).sum();
            let mixed = correlated
                .iter()
                .map(|(i, j, c)| part(&terms[*i]) * part(&terms[*j]) * c);
            (own + 2.0 * mixed.sum::<f64>()).max(0.0).sqrt()
        };
        Some(is_known.then(|| InverseUncertainty {
            magnitude_relative: size(|z| z.re),
            phase_rad: size(|z| z.im),
        }))
    }

    /// Of low-pass and delay, which the inverse divides out: `1/L(f) e^{j2πfτ}`.
    fn of_recorder(&self, frequency_hz: f64) -> Option<InverseUncertainty> {
        let cutoff = self.recorder.low_pass.zip(self.recorder.cutoff_std_hz);
        let of_cutoff = cutoff.map(|(filter, std)| {
            let at = |side: f64| {
                let cutoff_hz = (filter.cutoff_hz + side * std).max(f64::MIN_POSITIVE);
                torqcomp_dsp::recorder::LowPass {
                    cutoff_hz,
                    ..filter
                }
                .response(frequency_hz)
            };
            (at(1.0) / at(-1.0)).ln() / 2.0
        });
        let of_delay = self.recorder.delay_std_s;
        if of_cutoff.is_none() && of_delay.is_none() {
            return None;
        }
        let of_cutoff = of_cutoff.unwrap_or(Complex64::ZERO);
        Some(InverseUncertainty {
            magnitude_relative: of_cutoff.re.abs(),
            phase_rad: of_cutoff
                .im
                .hypot(TAU * frequency_hz * of_delay.unwrap_or(0.0)),
        })
    }
}

impl Mechanics {
    /// The mechanics with one constant moved by its standard uncertainty; `None` if it has none.
    fn moved(&self, place: usize, side: f64) -> Option<Self> {
        let of = &self.response;
        let mut values = [
            of.inertia_kg_m2(),
            of.damping_n_m_s_per_rad(),
            of.stiffness_n_m_per_rad(),
        ];
        let stds = [
            self.std.inertia_kg_m2,
            self.std.damping_n_m_s_per_rad,
            self.std.stiffness_n_m_per_rad,
        ];
        values[place] += side * stds[place]?;
        let response = SecondOrder::new(values[0], values[1].max(0.0), values[2]).ok()?;
        Some(Self {
            response,
            ..self.clone()
        })
    }
}

/// Part of a standard uncertainty over which a slope is taken: far above rounding, far below where the response bends.
const STEP: f64 = 1e-3;

/// Change of the logarithm of the inverse response for one standard uncertainty of a parameter, by its slope.
fn change(with: &dyn Fn(f64) -> Option<Stand>, frequency_hz: f64) -> Option<Complex64> {
    let at = |side: f64| Some(with(side * STEP)?.inverse().ok()?(frequency_hz));
    let half = (at(1.0)? / at(-1.0)?).ln() / (2.0 * STEP);
    half.is_finite().then_some(half)
}
