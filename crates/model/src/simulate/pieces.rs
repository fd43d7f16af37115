//! Simulation of an input of any length, piece by piece.

use std::fmt;

use super::run::MotionProgress;
use super::{Between, Excitation, MotionState, substeps};
use crate::chain::Chain;
use crate::effects::{Action, Stage};

/// Samples per piece.
const PIECE: usize = 1 << 17;
/// Samples on either side of a piece that the links after the stand see.
const SIDE: usize = 1 << 14;
/// Fraction of an impulse response beyond the reach of the sides that may be neglected.
const LEFT_OUT: f64 = 1e-4;
/// Relative change of the result below which the integration step is fine enough.
pub(super) const FINE: f64 = 1e-5;
/// Maximum number of steps per sample.
pub(super) const MOST_SUBSTEPS: usize = 256;

/// The motion diverges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Diverges;

impl fmt::Display for Diverges {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the simulated motion diverges: with these effects the stand is unstable for this input")
    }
}

impl std::error::Error for Diverges {}

/// The record of a stand at rest before its input, in memory that does not grow with the input: the motion continues
/// from piece to piece with its full state, and linear links see 2^14 samples on either side of a piece.
///
/// The integration step is halved until that changes a piece by less than 1e-5 of its RMS.
///
/// A chain whose links after the stand reach farther (drift, backlash, a slow filter) needs the whole record, which is
/// then stored until the end.
///
/// ```
/// use torqcomp_model::simulate::{Between, Pieces};
/// use torqcomp_model::{Chain, Mode};
/// // A constant input of 2 for 0.1 s: 2 after the motion has died out, ζω₀t = 6.3 with 10 Hz and ζ = 1.
/// let mode = Mode { omega_rad_s: 62.83, damping_ratio: 1.0 };
/// let chain = Chain::new(mode, 1.0);
/// let mut pieces = Pieces::new(&chain, 1000.0, Between::Held);
/// let mut record = Vec::new();
/// pieces.push(&[2.0; 300], &mut record)?;
/// pieces.push(&[2.0; 300], &mut record)?;
/// pieces.finish(&mut record)?;
/// assert_eq!(record.len(), 600);
/// // x(t) = 2 (1 − (1 + ω₀t) e^{−ω₀t}): 1.9728 at 0.1 s.
/// assert!((record[100] - 1.9728).abs() < 0.01 && (record[500] - 2.0).abs() < 1e-3, "{}", record[100]);
/// # Ok::<(), torqcomp_model::simulate::Diverges>(())
/// ```
pub struct Pieces<'a> {
    chain: &'a Chain,
    rate_hz: f64,
    between: Between,
    /// Samples per piece, and on either side of it; `None` if the record cannot be split.
    cut: Option<[usize; 2]>,
    /// Initial number of steps per sample.
    steps: usize,
    /// Parts of a sample at which the gage signal is kept.
    parts: usize,
    /// Largest number of steps per sample needed so far.
    finest: usize,
    /// Input samples still needed.
    input: Vec<f64>,
    /// Gage signal at the parts of the first samples of `input`.
    shown: Vec<f64>,
    /// State of the motion at the sample after them.
    progress: MotionProgress,
    /// Number of input samples already processed.
    given: usize,
}

impl<'a> Pieces<'a> {
    /// Starts at rest.
    #[must_use]
    pub fn new(chain: &'a Chain, rate_hz: f64, between: Between) -> Self {
        let steps = substeps(chain.stand.highest_hz(), rate_hz);
        Self {
            cut: is_local(chain, rate_hz, SIDE).then_some([PIECE, SIDE]),
            steps,
            parts: chain.parts_of_sample(steps),
            progress: chain.begin(MotionState::default()),
            finest: 0,
            chain,
            rate_hz,
            between,
            input: Vec::new(),
            shown: Vec::new(),
            given: 0,
        }
    }

    /// Takes input samples and appends the part of the record now known.
    ///
    /// # Errors
    /// If the motion diverges.
    pub fn push(&mut self, input: &[f64], record: &mut Vec<f64>) -> Result<(), Diverges> {
        for part in input.chunks(SIDE) {
            self.input.extend_from_slice(part);
            if let Some([piece, side]) = self.cut
                && self.input.len() >= self.given + piece + 2 * side
            {
                self.give(self.given + piece, side, record)?;
            }
        }
        Ok(())
    }

    /// Appends the rest of the record and returns the integration steps per sample. Fewer than two samples in total
    /// give no record.
    ///
    /// # Errors
    /// If the motion diverges.
    pub fn finish(mut self, record: &mut Vec<f64>) -> Result<usize, Diverges> {
        if self.input.len() > 1 {
            self.give(self.input.len(), 0, record)?;
        }
        Ok(self.finest)
    }

    /// Outputs the record up to a sample of the input in memory; the next piece sees `side` samples before it.
    fn give(&mut self, end: usize, side: usize, record: &mut Vec<f64>) -> Result<(), Diverges> {
        // The motion is handed over where it is far from the ends of both this piece and the next.
        let next = end - side;
        let samples = std::mem::take(&mut self.input);
        let input =
            Excitation::new(samples, self.rate_hz, 0.0, self.steps).with_between(self.between);
        let (mut steps, mut last) = (self.steps, self.run(&input, next));
        let (shown, progress) = loop {
            steps *= 2;
            let finer = self.run(&input.with_substeps(steps), next);
            let piece = self.given..end;
            let rms =
                |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>().sqrt();
            let pairs = finer.0[piece.clone()].iter().zip(&last.0[piece.clone()]);
            let change = rms(&mut pairs.map(|(a, b)| a - b));
            let size = rms(&mut finer.0[piece.clone()].iter().copied());
            if !size.is_finite() {
                return Err(Diverges);
            }
            if change <= FINE * size || steps >= MOST_SUBSTEPS {
                record.extend_from_slice(&finer.0[piece]);
                break (finer.1, finer.2);
            }
            last = finer;
        };
        let kept = next - side;
        self.given = end - kept;
        self.input = input.samples()[kept..].to_vec();
        // The last sample has no parts.
        let [kept, next] = [kept, next].map(|k| (k * self.parts).min(shown.len()));
        self.shown = shown[kept..next].to_vec();
        self.progress = progress;
        self.steps = steps / 2;
        self.finest = steps;
        Ok(())
    }

    /// The record for the input in memory, the gage signal, and the motion at the sample `next`.
    fn run(&self, input: &Excitation, next: usize) -> (Vec<f64>, Vec<f64>, MotionProgress) {
        let (mut progress, parts) = (self.progress.clone(), self.parts);
        let fine = input.finer(parts);
        let mut shown = self.shown.clone();
        let count = fine.samples().len();
        // The last sample has no parts.
        let next = (next * parts).min(count);
        let before = shown.len()..next;
        shown.extend(self.chain.integrated_over(fine, before, &mut progress));
        let at_next = progress.clone();
        let rest = next..count;
        shown.extend(self.chain.integrated_over(fine, rest, &mut progress));
        let record = self.chain.recorded_if_finite(shown.clone(), (input, parts));
        (record, shown, at_next)
    }
}

/// Whether the links after the stand reach no farther than the sides of a piece.
fn is_local(chain: &Chain, rate_hz: f64, side: usize) -> bool {
    let after = || {
        chain
            .links()
            .iter()
            .filter(|link| link.stage > Stage::Stand)
    };
    let is_pointwise = after().all(|link| match &link.action {
        Action::Distortion(distortion) => distortion.is_pointwise(),
        _ => true,
    });
    if !is_pointwise || after().all(|link| !link.is_linear()) {
        return is_pointwise;
    }
    let size = 4 * side;
    let plan = torqcomp_fourier::inverse(size);
    let mut spectrum = plan.make_input_vec();
    for (k, bin) in spectrum.iter_mut().enumerate() {
        let hz = k as f64 * rate_hz / size as f64;
        // The motion has little content above the natural frequency.
        let motion = 1.0 + (hz / chain.stand.highest_hz()).powi(2);
        *bin = chain.response_of(hz, |link| link.stage > Stage::Stand) / motion;
    }
    spectrum[0].im = 0.0;
    spectrum[size / 2].im = 0.0;
    let mut impulse = plan.make_output_vec();
    // Cannot fail: the lengths match the plan.
    let _ = plan.process(&mut spectrum, &mut impulse);
    let energy = |part: &[f64]| part.iter().map(|x| x * x).sum::<f64>();
    energy(&impulse[side..size - side]) <= LEFT_OUT * LEFT_OUT * energy(&impulse)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::chain::Link;
    use crate::effects::{Effect, Mode};
    use crate::modal::{ModalPart, ModalResponse};
    use crate::simulate::tests::{RATE_HZ, chain};

    /// Two modes with dry friction at the gage.
    fn several() -> Chain {
        let part = |hz: f64, residue| ModalPart {
            mode: Mode {
                omega_rad_s: TAU * hz,
                damping_ratio: 0.05,
            },
            residue,
            quadrature: 0.02,
            at_gage: Some(residue),
        };
        let modes = ModalResponse::new(vec![part(590.0, 0.8), part(900.0, 0.2)]);
        let friction = Effect::named("coulomb-friction").unwrap();
        let friction = Link::of(friction, friction.form(Some("sharp")).unwrap(), &[0.3]);
        Chain::new(modes.unwrap(), 1.0).with_links([friction])
    }

    /// Two tones and 10 % noise.
    fn input(count: usize) -> Vec<f64> {
        let mut state = 1_u64;
        let mut noise = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f64 / (1_u64 << 24) as f64 - 0.5
        };
        let tones = |t: f64| (TAU * 80.0 * t).sin() + 0.8 * (TAU * 310.3 * t).sin();
        (0..count)
            .map(|i| tones(i as f64 / RATE_HZ) + 0.2 * noise())
            .collect()
    }

    /// Simulation piece by piece equals that of the whole, whatever the effects remember; the piece boundaries differ
    /// from those of the pushed input.
    #[test]
    fn pieces_make_the_whole() {
        let [piece, side] = [1 << 14, 1 << 12];
        let input = input(2 * piece + 3 * side + 2345);
        let chains = [
            chain(&[]),
            chain(&[
                ("bouc-wen-hysteresis", "linear", &[0.4, 0.5, 0.2]),
                ("time-delay", "lag", &[1.3e-4]),
            ]),
            chain(&[
                ("coulomb-friction", "sharp", &[0.3]),
                ("recorder-lowpass", "order-2", &[900.0]),
            ]),
            chain(&[
                ("backlash", "gap-beside", &[0.2]),
                ("gage-nonlinearity", "both", &[0.02, 0.003]),
            ]),
            several(),
        ];
        for (i, chain) in chains.iter().enumerate() {
            let mut pieces = Pieces::new(chain, RATE_HZ, Between::BandLimited);
            assert!(is_local(chain, RATE_HZ, side), "{i}");
            pieces.cut = Some([piece, side]);
            let (mut record, mut held) = (Vec::new(), 0);
            for part in input.chunks(5000) {
                pieces.push(part, &mut record).unwrap();
                held = held.max(pieces.input.len());
            }
            assert!(
                held < 2 * piece + 5000 && record.len() >= 2 * piece,
                "{i}: {held}"
            );
            let steps = pieces.finish(&mut record).unwrap();
            assert_eq!(record.len(), input.len());
            let whole = Excitation::new(input.clone(), RATE_HZ, 0.0, steps);
            let whole = chain.simulate_from(&whole, MotionState::default());
            let rms = |x: &mut dyn Iterator<Item = f64>| x.map(|x| x * x).sum::<f64>().sqrt();
            let difference = rms(&mut record.iter().zip(&whole).map(|(a, b)| a - b));
            let size = rms(&mut whole.iter().copied());
            println!("{i}: {:e}", difference / size);
            assert!(difference < 3e-5 * size, "{i}: {:e}", difference / size);
        }
    }

    #[test]
    fn what_reaches_far_is_not_cut() {
        assert!(is_local(
            &chain(&[("saturation", "hard", &[9.0])]),
            RATE_HZ,
            SIDE
        ));
        for far in [
            chain(&[("thermal-drift", "linear", &[0.1])]),
            chain(&[("backlash", "recorded", &[0.1])]),
            chain(&[("recorder-lowpass", "order-1", &[0.05])]),
        ] {
            assert!(!is_local(&far, RATE_HZ, SIDE));
        }
    }

    #[test]
    fn a_motion_that_leaves_all_bounds_is_told() {
        let unstable = chain(&[("cubic-stiffness", "beside", &[-1.0])]);
        let mut pieces = Pieces::new(&unstable, RATE_HZ, Between::BandLimited);
        let mut record = Vec::new();
        pieces.push(&vec![5.0; 2000], &mut record).unwrap();
        assert_eq!(pieces.finish(&mut record), Err(Diverges));
    }
}
