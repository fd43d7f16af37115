//! Parallel integration of several motions for one input.
//!
//! Each step of a motion depends on the previous one. Stepping several motions alternately, as for the finite
//! differences of a fit, keeps the processor busy meanwhile; each gives the same numbers as alone.

use std::ops::Range;

use super::input::Excitation;
use super::integrate::MotionState;
use super::modes::ModalIntegrator;
use super::run::{Integrator, MotionProgress, Torques};
use crate::modal::ModalResponse;

/// A stand and the state of its motion.
pub(crate) struct OngoingMotion<'a> {
    pub(crate) stand: &'a ModalResponse,
    pub(crate) gain: f64,
    /// Displacement under a constant load.
    pub(crate) shift: f64,
    pub(crate) torques: &'a Torques<'a>,
    pub(crate) progress: &'a mut MotionProgress,
}

/// A motion stepped from node to node.
pub(super) trait Stepped<'a>: Sized {
    /// Resumes from a motion's progress, at the second node of the window; also returns the state there.
    fn resume(
        motion: &OngoingMotion<'a>,
        input: &Excitation,
        window: &[f64],
    ) -> (Self, MotionState);

    /// The state at the next node.
    fn step(&mut self, state: MotionState, window: &[f64]) -> MotionState;

    /// Gage signal.
    fn shown(&mut self, state: MotionState) -> f64;

    /// Progress at the end.
    fn end(self, state: MotionState) -> MotionProgress;
}

/// Gage signal of each motion at some samples of the input; `progress` is that at the first of them, and on return that
/// at the sample after the last. Once a motion is not finite, the rest of it is NaN.
pub(crate) fn integrate(
    motions: &mut [OngoingMotion<'_>],
    input: &Excitation,
    range: Range<usize>,
) -> Vec<Vec<f64>> {
    if range.is_empty() {
        return vec![Vec::new(); motions.len()];
    }
    let is_single = |motion: &OngoingMotion| motion.stand.only().is_some();
    let alike = motions.chunk_by_mut(|a, b| is_single(a) == is_single(b));
    let shown = alike.flat_map(|some| match is_single(&some[0]) {
        true => in_turn::<Integrator>(some, input, &range),
        false => in_turn::<ModalIntegrator>(some, input, &range),
    });
    shown.collect()
}

/// Integrates motions of one kind, four at a time while there are that many.
fn in_turn<'a, S: Stepped<'a>>(
    motions: &mut [OngoingMotion<'a>],
    input: &Excitation,
    range: &Range<usize>,
) -> Vec<Vec<f64>> {
    let (fours, rest) = motions.as_chunks_mut();
    let (twos, ones) = rest.as_chunks_mut();
    let fours = fours
        .iter_mut()
        .flat_map(|some| together::<S, 4>(some, input, range));
    let twos = twos
        .iter_mut()
        .flat_map(|some| together::<S, 2>(some, input, range));
    let ones = ones.iter_mut().map(std::array::from_mut);
    let ones = ones.flat_map(|one| together::<S, 1>(one, input, range));
    fours.chain(twos).chain(ones).collect()
}

/// Integrates `N` motions together.
fn together<'a, S: Stepped<'a>, const N: usize>(
    motions: &mut [OngoingMotion<'a>; N],
    input: &Excitation,
    range: &Range<usize>,
) -> [Vec<f64>; N] {
    let substeps = input.substeps();
    let nodes = &input.fine()[range.start * substeps..];
    let both = motions.each_ref().map(|m| S::resume(m, input, nodes));
    let mut states = both.each_ref().map(|(_, state)| *state);
    let mut stepped = both.map(|(stepped, _)| stepped);
    let mut samples = [(); N].map(|()| Vec::with_capacity(range.len()));
    for sample in 0..range.len() {
        let mut is_finite = false;
        for k in 0..N {
            if states[k].x.is_finite() {
                is_finite = true;
                samples[k].push(stepped[k].shown(states[k]));
            }
        }
        if !is_finite {
            break;
        }
        let last = ((sample + 1) * substeps + 3).min(nodes.len());
        for window in nodes[sample * substeps..last].windows(4) {
            for k in 0..N {
                // A diverged motion is not stepped further.
                if samples[k].len() > sample {
                    states[k] = stepped[k].step(states[k], window);
                }
            }
        }
    }
    let ends = stepped.into_iter().zip(states);
    for (motion, (stepped, state)) in motions.iter_mut().zip(ends) {
        *motion.progress = stepped.end(state);
    }
    samples.map(|mut samples| {
        samples.resize(range.len(), f64::NAN);
        samples
    })
}

#[cfg(test)]
mod tests {
    use super::super::MotionState;
    use super::super::tests::{MODE, RATE_HZ, chain};
    use crate::chain::{Chain, StandRun};
    use crate::effects::Mode;
    use crate::modal::{ModalPart, ModalResponse};
    use crate::simulate::Excitation;

    /// With one mode, with two, without torques, and one that diverges.
    #[test]
    fn motions_together_are_what_each_is_alone() {
        let part = |times: f64, share| ModalPart {
            mode: Mode {
                omega_rad_s: times * MODE.omega_rad_s,
                ..MODE
            },
            residue: share,
            quadrature: 0.0,
            at_gage: Some(share),
        };
        let two = ModalResponse::new(vec![part(1.0, 0.8), part(1.7, 0.2)]).unwrap();
        fn cubic(size: &[f64]) -> (&str, &str, &[f64]) {
            ("cubic-stiffness", "beside", size)
        }
        let torques: [&[(&str, &str, &[f64])]; 6] = [
            &[cubic(&[0.05])],
            &[cubic(&[0.06]), ("coulomb-friction", "sharp", &[0.2])],
            &[],
            &[cubic(&[-3.0])],
            &[("bouc-wen-hysteresis", "linear", &[0.4, 0.5, 0.2])],
            &[cubic(&[0.07]), ("recorder-lowpass", "order-2", &[900.0])],
        ];
        let mut chains: Vec<Chain> = torques.iter().map(|t| chain(t)).collect();
        for k in [2, 0, 3] {
            let mut of_two = chain(torques[k]);
            of_two.stand = two.clone();
            chains.insert(k, of_two);
        }
        let sines = |i: usize| (0.11 * i as f64).sin() + (0.19 * i as f64).sin();
        let input = Excitation::new((0..3000).map(sines).collect(), RATE_HZ, 0.0, 2);
        let start = MotionState {
            x: 0.3,
            speed: 20.0,
        };
        let runs: Vec<StandRun> = chains
            .iter()
            .map(|chain| StandRun::of(chain, start))
            .collect();
        let together = Chain::simulate_all(&runs, &input);
        let bits = |record: &[f64]| record.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        for (run, record) in runs.iter().zip(&together) {
            assert_eq!(bits(record), bits(&run.simulate(&input)));
        }
        let diverges = |record: &&Vec<f64>| record.iter().any(|x| x.is_nan());
        assert_eq!(together.iter().filter(diverges).count(), 2);
    }
}
