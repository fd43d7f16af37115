//! Weights for noise on the applied quantity: a filter that makes the noise of a correct model's residual white.
//!
//! A model responds to the recorded applied quantity with its noise, so its residual has the density
//! `σ_y² + σ_u² |G H|²`: white noise of the measured quantity, and a peak at the resonance. Divided by that density, the
//! residual is white, and least squares weighs each frequency by what it can tell (L. Ljung, *System Identification*
//! (1999), 7.4). With `A(z) = 1 + a₁ z⁻¹ + a₂ z⁻²`, which has the poles of the stand, the density is
//! `(σ_y² |A|² + b²)/|A|²`, `b²` from the gain at the resonance, and the filter is `A/C` with
//! `|C|² = |A|² + b²/σ_y²` and all zeros inside the unit circle.

use num_complex::Complex64;
use torqcomp_model::Mode;

use super::SearchState;
use super::fit::{FitEffort, RecordResidual};
use super::noise_floor::{NoiseFloor, noise_of_input};
use super::record::StandRecord;
use super::records::Records;
use super::score::ScoredModel;
use super::structure::PlainStand;
use crate::identify::Motion;
use crate::parallel::parallel;

/// Ratio of the density at the resonance to that of white noise, above which the noise is weighted.
const MATTERS: f64 = 1.5;
/// Excess error power, relative to the noise, above which noise does not matter: with weights for it, an error at the
/// resonance would hardly count.
const LARGE: f64 = 100.0;

/// A filter `(1 + a₁ z⁻¹ + a₂ z⁻²)/(c₀ (1 + c₁ z⁻¹ + c₂ z⁻²))`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Whitening {
    zeros: [f64; 2],
    poles: [f64; 2],
    scale: f64,
}

impl Whitening {
    /// For a stand with one mode and a gain, and the standard deviations of the noise on applied and measured quantity;
    /// `None` if the former does not matter. The result passes the white noise of the measured quantity
    /// unchanged where the stand responds little.
    pub fn of(
        (mode, gain): (Mode, f64),
        rate_hz: f64,
        [applied_std, measured_std]: [f64; 2],
    ) -> Option<Self> {
        let damped = (1.0 - mode.damping_ratio.powi(2)).max(0.0).sqrt();
        let step = mode.omega_rad_s / rate_hz;
        let pole = Complex64::new(-mode.damping_ratio * step, damped * step).exp();
        let [a1, a2] = [-2.0 * pole.re, pole.norm_sqr()];
        let turn = Complex64::from_polar(1.0, -damped * step);
        let at_peak = (1.0 + a1 * turn + a2 * turn * turn).norm_sqr();
        let omega = damped * mode.omega_rad_s;
        let response = gain / mode.inverse(omega).norm();
        let excess = (applied_std * response / measured_std).powi(2);
        if !(excess.is_finite() && excess > MATTERS - 1.0 && damped > 0.0) {
            return None;
        }
        let input = excess * at_peak;
        // |C|² = g₀ + g₁ (z + 1/z) + g₂ (z² + 1/z²), a parabola in x = z + 1/z.
        let [g0, g1, g2] = [1.0 + a1 * a1 + a2 * a2 + input, a1 * (1.0 + a2), a2];
        let root = Complex64::from(g1 * g1 - 4.0 * g2 * (g0 - 2.0 * g2)).sqrt();
        let zero = |sign: f64| {
            let x = (-g1 + sign * root) / (2.0 * g2);
            let z = 0.5 * (x + (x * x - 4.0).sqrt());
            if z.norm() > 1.0 { z.inv() } else { z }
        };
        let [one, other] = [zero(1.0), zero(-1.0)];
        let [c1, c2] = [-(one + other).re, (one * other).re];
        let scale = (c2 / g2).sqrt();
        let found = Self {
            zeros: [a1, a2],
            poles: [c1, c2],
            scale,
        };
        scale.is_finite().then_some(found)
    }

    /// The samples before the filter.
    pub fn undo(&self, samples: &mut [f64]) {
        let inverse = Self {
            zeros: self.poles,
            poles: self.zeros,
            scale: self.scale.recip(),
        };
        inverse.apply(samples);
    }

    /// Filters samples, as if zero before.
    pub fn apply(&self, samples: &mut [f64]) {
        let ([a1, a2], [c1, c2]) = (self.zeros, self.poles);
        let (mut before, mut filtered) = ([0.0; 2], [0.0; 2]);
        for sample in samples {
            let x = *sample;
            let y = x + a1 * before[0] + a2 * before[1] - c1 * filtered[0] - c2 * filtered[1];
            before = [x, before[0]];
            filtered = [y, filtered[0]];
            *sample = self.scale * y;
        }
    }
}

/// The model fitted again with weights.
const AGAIN: FitEffort = FitEffort::full(8);

/// Weights records for the noise on their applied quantity; `compared` are residuals of a model without effects on the same
/// records.
fn weigh(records: &mut [StandRecord], stand: &PlainStand, compared: &[RecordResidual]) {
    let Some(floor) = NoiseFloor::measured(compared, &stand.mode()) else {
        return;
    };
    for record in records {
        let applied_std = noise_of_input(record.input.samples()).sqrt();
        let stds = [applied_std, floor.rms];
        record.whitening = Whitening::of((stand.mode(), stand.gain), record.rate_hz(), stds);
    }
}

impl Records {
    fn are_weighted(&self) -> bool {
        let all = self.train.iter().chain(&self.holdout);
        all.into_iter().any(|record| record.whitening.is_some())
    }

    fn drop_weights(&mut self) {
        let all = self.train.iter_mut().chain(&mut self.holdout);
        all.for_each(|record| record.whitening = None);
    }
}

impl SearchState {
    /// Weights the records for the noise on their applied quantity, unless the error is so large that the noise does not
    /// matter yet.
    pub(super) fn weigh(&mut self) {
        let fitted = &self.after.fitted;
        let context = &fitted.structure.context;
        let is_plain = context.several.is_none()
            && context.held.is_none()
            && context.measures == Motion::Displacement;
        let stand = fitted.stand();
        let floor = NoiseFloor::measured(&self.before.train(), &stand.mode());
        let is_small =
            |floor: NoiseFloor| self.after.excess_power(floor.rms) <= LARGE * floor.rms.powi(2);
        if !is_plain || self.records.are_weighted() || !floor.is_some_and(is_small) {
            return;
        }
        weigh(&mut self.records.train, &stand, &self.before.train());
        if !self.records.are_weighted() {
            return;
        }
        let has_effects = !self.after.effect_names().is_empty();
        let again = fitted.refit(&self.records.train, AGAIN).ok();
        let after = again.and_then(|fitted| ScoredModel::of(fitted, &self.records));
        let before = match has_effects {
            true => ScoredModel::of(self.before.fitted.clone(), &self.records),
            false => after.clone(),
        };
        match (before, after) {
            (Some(before), Some(after)) => (self.before, self.after) = (before, after),
            _ => self.records.drop_weights(),
        }
        self.compare_anew();
    }

    /// Weights training and held-out records as in the search.
    pub(super) fn weigh_again(&mut self, threads: usize) {
        if self.weighted.is_none() {
            return;
        }
        let stand = self.after.fitted.stand();
        weigh(&mut self.records.train, &stand, &self.before.train());
        weigh(&mut self.records.holdout, &stand, &self.before.compared());
        self.score_again(threads);
    }

    /// Drops the weights of the records and of the models' residuals. The tests remain those of the weighted residuals:
    /// without weights, the response to the noise on the applied quantity looks like a residual that depends on the motion.
    pub(super) fn drop_weights(&mut self, threads: usize) {
        if !self.records.are_weighted() {
            return;
        }
        self.weighted = Some(self.records.clone());
        self.records.drop_weights();
        let tests = (self.tests_before.clone(), self.tests.clone());
        self.score_again(threads);
        (self.tests_before, self.tests) = tests;
    }

    /// The same with the residuals of all candidates and of the models on the way to the result.
    pub(super) fn end_search(&mut self, threads: usize) {
        if !self.records.are_weighted() {
            return;
        }
        self.drop_weights(threads);
        let candidates = self.rounds.iter_mut().flatten();
        let models = candidates.filter_map(|c| c.model.as_mut());
        score(
            models.chain(&mut self.path).collect(),
            &self.records,
            threads,
        );
        for candidate in self.rounds.iter_mut().flatten() {
            let errors = candidate.model.as_ref().map(ScoredModel::errors);
            candidate.train_rms = errors.map(|errors| errors.train_rms);
        }
    }

    /// The residuals of the models that are compared in the end, with the present weights.
    fn score_again(&mut self, threads: usize) {
        let mut models = vec![&mut self.before, &mut self.after];
        models.extend(self.without.iter_mut().flatten());
        models.extend(self.suspected.iter_mut().map(|guard| &mut guard.model));
        score(models, &self.records, threads);
        for model in [&mut self.before, &mut self.after] {
            *model = model.clone().with_samples();
        }
        if let Some(guard) = &mut self.suspected {
            guard.errors = guard.model.errors();
        }
        self.compare_anew();
    }

    /// Noise and tests with other weights of the records.
    fn compare_anew(&mut self) {
        self.rivals = None;
        self.noise_floor = NoiseFloor::of(&self.before.compared(), &self.before.fitted.passage());
        self.tests_before = super::tests(&self.before);
        self.tests = super::tests(&self.after);
    }
}

/// The residuals of models on records.
fn score(models: Vec<&mut ScoredModel>, records: &Records, threads: usize) {
    let scored = parallel(models.len(), threads, |k| {
        ScoredModel::of(models[k].fitted.clone(), records)
    });
    for (model, scored) in models.into_iter().zip(scored) {
        if let Some(scored) = scored {
            *model = scored.without_samples();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::diagnose::test_noise::noise;

    const RATE_HZ: f64 = 1000.0;
    const COUNT: usize = 100_000;

    /// A residual of a stand of 60 Hz with a damping ratio of 0.01: the response to noise on the applied quantity of
    /// this standard deviation, from its recursion for held samples, and noise of standard deviation 1.
    fn residual(mode: Mode, applied_std: f64) -> Vec<f64> {
        let mut random = noise(11);
        let mut normal = || 12_f64.sqrt() * random();
        let (omega, ratio) = (mode.omega_rad_s, mode.damping_ratio);
        let swing = omega * (1.0 - ratio * ratio).sqrt();
        let (fade, turn) = ((-ratio * omega / RATE_HZ).exp(), swing / RATE_HZ);
        let (sin, cos) = turn.sin_cos();
        let lean = ratio * omega / swing * sin;
        let [first, second] = [1.0 - fade * (cos + lean), fade * fade + fade * (lean - cos)];
        let (mut u, mut x) = ([0.0; 2], [0.0; 2]);
        let response = |_| {
            let next = 2.0 * fade * cos * x[0] - fade * fade * x[1] + first * u[0] + second * u[1];
            u = [applied_std * normal(), u[0]];
            x = [next, x[0]];
            next + normal()
        };
        (0..COUNT).map(response).collect()
    }

    #[test]
    fn the_noise_of_both_quantities_becomes_white() {
        let mode = Mode {
            omega_rad_s: TAU * 60.0,
            damping_ratio: 0.01,
        };
        let raw = residual(mode, 0.8);
        let whitening = Whitening::of((mode, 1.0), RATE_HZ, [0.8, 1.0]).expect("it matters");
        let mut white = raw.clone();
        whitening.apply(&mut white);
        let correlation = |samples: &[f64], lag: usize| {
            let products = samples.iter().zip(&samples[lag..]).map(|(a, b)| a * b);
            products.sum::<f64>() / samples.len() as f64
        };
        // The white noise of the measured quantity remains; π f₀/(2 ζ f_s) 0.8² = 6 is the power of the rest, of which
        // there are 200 independent values.
        assert!((correlation(&raw, 0) - 7.0).abs() < 1.0);
        assert!((correlation(&white, 0) - 1.0).abs() < 0.02);
        for lag in 1..40 {
            let left = correlation(&white, lag);
            assert!(left.abs() < 0.02, "{lag}: {left}");
        }
        whitening.undo(&mut white);
        let differences = white.iter().zip(&raw).map(|(a, b)| (a - b).abs());
        assert!(differences.fold(0.0, f64::max) < 1e-9);
    }

    #[test]
    fn little_noise_is_not_weighted() {
        let mode = Mode {
            omega_rad_s: TAU * 60.0,
            damping_ratio: 0.01,
        };
        // At the resonance 50 times 0.01 is half of the noise, a quarter of its power.
        assert_eq!(Whitening::of((mode, 1.0), RATE_HZ, [0.01, 1.0]), None);
    }
}
