//! Response of a stand to loads applied slowly.

use num_complex::Complex64;

use super::Chain;
use crate::effects::{Action, SampleClock, Stage};
use crate::modal::{ModalPart, ModalResponse};
use crate::mode::Mode;
use crate::simulate::{Excitation, MotionProgress, MotionState, OngoingMotion, integrate};

/// Duration of the change from one load to the next, in periods of the slowest mode.
const CHANGES: f64 = 2.0;
/// Dwell at each load, in the same periods; a step with critical damping has decayed to `e^(−6π)` = 6e-9.
const RESTS: f64 = 3.0;
/// Samples per period of the fastest mode.
const PER_PERIOD: f64 = 40.0;
/// Integration steps per sample: where a torque has a kink, the error of the equilibrium goes with the square of the
/// step, 1e-4 of it with two and 2e-6 with sixteen.
const SUBSTEPS: usize = 16;

impl Chain {
    /// The record under each of several loads, applied one after the other starting from no load, quasi-statically: dry
    /// friction and backlash depend on the preceding loads. Linear links act with their static gain; lines and drifts
    /// are omitted.
    ///
    /// Same equations as [`simulate`](Self::simulate), with critical damping, which does not affect the equilibrium,
    /// and a smooth transition `10 s³ − 15 s⁴ + 6 s⁵` from load to load. NaN if the motion diverges.
    ///
    /// ```
    /// use torqcomp_model::{Chain, Link, Mode, effects::Effect};
    /// let effect = Effect::named("cubic-stiffness").unwrap();
    /// let torque = Link::of(effect, &effect.forms[0], &[0.25]);
    /// let mode = Mode { omega_rad_s: 100.0, damping_ratio: 0.01 };
    /// let chain = Chain::new(mode, 2.0).with_links([torque]);
    /// // x + x³/4 = 2 u: 2 + 8/4 = 4 and 1 + 1/4 = 5/4.
    /// let shown = chain.under_slow_loads(&[2.0, 0.625, 0.0]);
    /// for (shown, by_hand) in shown.iter().zip([2.0, 1.0, 0.0]) {
    ///     assert!((shown - by_hand).abs() < 1e-5, "{shown}");
    /// }
    /// ```
    #[must_use]
    pub fn under_slow_loads(&self, loads: &[f64]) -> Vec<f64> {
        let mut record = match self.has_torques() {
            true => self.settled(loads),
            false => loads.iter().map(|load| self.gain * load).collect(),
        };
        // No time passes, so drifts have no effect.
        let clock = SampleClock { step_s: 0.0 };
        for link in self.links.iter().filter(|link| link.stage > Stage::Stand) {
            match &link.action {
                Action::Recorder { response, .. } => scale(&mut record, response(0.0)),
                Action::Feedthrough(past) => {
                    let past = self.gain * (past.response)(&self.stand, 0.0).re;
                    for (sample, load) in record.iter_mut().zip(loads) {
                        *sample += past * load;
                    }
                }
                Action::Distortion(distortion) => distortion.forward(clock, &mut record),
                action => {
                    if let Some(factor) = action.factor(&self.stand, 0.0) {
                        scale(&mut record, factor);
                    }
                }
            }
        }
        record
    }

    /// Gage signal at the end of each load.
    fn settled(&self, loads: &[f64]) -> Vec<f64> {
        let damped = |part: &ModalPart| ModalPart {
            mode: Mode {
                damping_ratio: 1.0,
                ..part.mode
            },
            quadrature: 0.0,
            ..*part
        };
        let parts = self.stand.parts();
        let Ok(stand) = ModalResponse::new(parts.iter().map(damped).collect()) else {
            return vec![f64::NAN; loads.len()];
        };
        let frequencies = parts.iter().map(|part| part.mode.natural_frequency_hz());
        let slowest_hz = frequencies.fold(f64::INFINITY, f64::min);
        let rate_hz = PER_PERIOD * stand.highest_hz();
        let [changes, rests] =
            [CHANGES, RESTS].map(|periods| (periods * rate_hz / slowest_hz).ceil() as usize);
        let input = Excitation::new(course(loads, changes, rests), rate_hz, 0.0, SUBSTEPS);
        let torques = self.torques();
        let mut progress =
            MotionProgress::begin(&torques, (&stand, MotionState::default()), self.shift);
        let motion = OngoingMotion {
            stand: &stand,
            gain: self.gain,
            shift: self.shift,
            torques: &torques,
            progress: &mut progress,
        };
        let shown = integrate(&mut [motion], &input, 0..input.samples().len());
        let ends = shown.iter().flat_map(|shown| shown.chunks(changes + rests));
        ends.filter_map(|of_load| of_load.last().copied()).collect()
    }
}

/// Scales samples by a static response, which is real.
fn scale(samples: &mut [f64], response: Complex64) {
    for sample in samples {
        *sample *= response.re;
    }
}

/// Load history: starting from no load, each load is approached smoothly within `changes` samples and kept for `rests`
/// samples.
fn course(loads: &[f64], changes: usize, rests: usize) -> Vec<f64> {
    let before = std::iter::once(&0.0).chain(loads);
    let to_next = before.zip(loads).flat_map(|(from, to)| {
        let part = move |k: usize| {
            let s = k as f64 / changes as f64;
            s.powi(3) * (10.0 + s * (6.0 * s - 15.0))
        };
        let changing = (1..=changes).map(move |k| from + (to - from) * part(k));
        changing.chain(std::iter::repeat_n(*to, rests))
    });
    to_next.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::Link;
    use crate::effects::Effect;

    const MODE: Mode = Mode {
        omega_rad_s: 3700.0,
        damping_ratio: 0.02,
    };

    fn stand(effect: &str, values: &[f64]) -> Chain {
        let effect = Effect::named(effect).expect("an effect");
        Chain::new(MODE, 1.0).with_links([Link::of(effect, &effect.forms[0], values)])
    }

    fn assert_near(shown: &[f64], want: &[f64]) {
        for (shown, want) in shown.iter().zip(want) {
            assert!((shown - want).abs() < 1e-5, "{shown} for {want}");
        }
        assert_eq!(shown.len(), want.len());
    }

    #[test]
    fn dry_friction_holds_back_whichever_way_it_goes() {
        // Friction of 0.5 opposes the motion: the spring carries 0.5 less on the way up and 0.5 more on the way down;
        // the stand does not move for a change of less than twice that.
        let shown = stand("coulomb-friction", &[0.5])
            .under_slow_loads(&[0.4, 1.0, 3.0, 2.5, 2.0, 1.0, 0.0, -1.0]);
        assert_near(&shown, &[0.0, 0.5, 2.5, 2.5, 2.5, 1.5, 0.5, -0.5]);
    }

    #[test]
    fn a_gain_and_a_coupling_are_what_they_are_at_rest() {
        let effect = Effect::named("gain-error").expect("an effect");
        let gain = || Link::of(effect, &effect.forms[0], &[0.1]);
        let plain = Chain::new(MODE, 2.0).with_links([gain()]);
        assert_near(&plain.under_slow_loads(&[1.0, -2.0]), &[2.2, -4.4]);
        // An AC-coupled amplifier does not show a static load.
        let effect = Effect::named("capacitive-coupling").expect("an effect");
        let form = effect.form(Some("ac-coupled")).expect("a form");
        let coupled = Chain::new(MODE, 2.0).with_links([Link::of(effect, form, &[1.0])]);
        assert_near(&coupled.under_slow_loads(&[1.0, -2.0]), &[0.0, 0.0]);
    }

    #[test]
    fn modes_that_bend_together() {
        // Under 1 N m at the gage the first mode contributes 0.75 and the second 0.25 of the displacement; with the
        // torque x³/4 the equilibrium is x + x³/4 = u, however the modes share it.
        let part = |omega_rad_s: f64, residue| ModalPart {
            mode: Mode {
                omega_rad_s,
                damping_ratio: 0.01,
            },
            residue,
            quadrature: 0.0,
            at_gage: Some(residue),
        };
        let stand = ModalResponse::new(vec![part(3700.0, 0.75), part(9000.0, 0.25)]);
        let effect = Effect::named("cubic-stiffness").expect("an effect");
        let torque = Link::of(effect, &effect.forms[0], &[0.25]);
        let chain = Chain::new(stand.expect("modes"), 1.0).with_links([torque]);
        assert_near(
            &chain.under_slow_loads(&[1.25, 4.0, -4.0]),
            &[1.0, 2.0, -2.0],
        );
    }
}
