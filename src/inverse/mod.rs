//! Inversion of a record to the applied quantity for a stand with effects that a frequency response cannot describe.
//!
//! The links of the stand's [`Chain`] are inverted in reverse order: disturbances, the recorder's range, the chain,
//! the gage, the linear dynamics, and last the stand itself, whose torques are evaluated along the motion
//! (`motion`). The inverse of each effect is in its own file in `torqcomp_model::effects`; shared parts are here:
//! the band, the extension beyond the record's ends, the noise. Nothing is added beyond the band.

mod motion;
mod spread;
mod windows;

use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::Complex64;
use torqcomp_dsp::band::Band;
use torqcomp_dsp::compensate::{Extension, Inverse, InverseFilter};
use torqcomp_model::chain::{Chain, GagePath, Group, Link};
use torqcomp_model::effects::{
    self, Action, FoundLine, SampleClock, SpectralLine, SpikeTrain, Stage, Torque, Unrecovered,
};

use crate::failure::{ErrorCode, Failure};
use crate::stand::Stand;

pub(crate) use motion::{AtRest, Carried};
pub(crate) use spread::{ResultStd, Spread};
pub(crate) use windows::RecordWindow;

/// Maximum number of iterations for the torques of the stand and a coupling past it.
const ROUNDS: usize = 40;
/// Change of the torques, relative to the record, at which the iteration has converged.
const AGREED: f64 = 1e-9;
/// Minimum number of steps per sample for evaluating torques.
const FEWEST_STEPS: usize = 8;
/// Minimum extension beyond an end, in samples.
const SHORTEST_LEAD: usize = 2048;
/// Bandwidth for torques and static characteristics, relative to that of the result, where noise
/// allows it.
const WIDER: f64 = 2.0;
/// Maximum of that bandwidth, relative to the Nyquist frequency.
const HIGHEST: f64 = 0.8;
/// Noise amplification, relative to that within the band, up to which a wider band is allowed.
const GROWTH: f64 = 1.5;

/// Inversion of a record.
pub(crate) struct ChainInverse {
    chain: Arc<Chain>,
    filter: InverseFilter,
}

/// Result of an inversion.
#[derive(Debug, Default)]
pub(crate) struct InverseResult {
    /// The applied quantity, in SI units.
    pub applied: Vec<f64>,
    /// Effects with the samples that cannot be recovered.
    pub lost: Vec<(&'static str, Unrecovered)>,
    /// Lines and trains of spikes that were subtracted.
    pub lines: Vec<FoundLine>,
    /// Where the speed is not significantly different from zero, if a torque depends on its sign.
    pub at_rest: Option<AtRest>,
    /// Highest frequency used for static characteristics and torques.
    pub seen_to_hz: Option<f64>,
    /// State of the stand's torques for the next window of a long record.
    next: Option<motion::Carried>,
}

/// A record during its inversion.
struct Pass<'a> {
    inverse: &'a ChainInverse,
    extension: Extension,
    clock: SampleClock,
    samples: Vec<f64>,
    /// Standard deviation of the noise of a sample.
    noise_std: f64,
    /// Torques of the stand, as far as known, for couplings past it.
    torque: Option<&'a [f64]>,
    beside: motion::Beside,
    result: InverseResult,
}

impl ChainInverse {
    /// Prepares the inversion of a stand for a band.
    ///
    /// # Errors
    /// If the stand has no mechanics, or effects that cannot be inverted together.
    pub(crate) fn new(stand: &Stand, band: Band) -> Result<Self, Failure> {
        let chain = Arc::new(stand.chain()?);
        refuse_bent_coupling(stand, &chain)?;
        Ok(Self {
            filter: InverseFilter::design(regular_inverse(chain.clone()), band)?,
            chain,
        })
    }

    /// Inverse of the linear part of a stand, from which its band can be chosen.
    ///
    /// # Errors
    /// If the stand has no mechanics.
    pub(crate) fn linear(stand: &Stand) -> Result<Inverse, Failure> {
        Ok(regular_inverse(Arc::new(stand.chain()?)))
    }

    /// Inverse of the linear part, without factors whose inverse does not decay.
    pub(crate) fn filter(&self) -> &InverseFilter {
        &self.filter
    }

    /// Gain of the inversion relative to the filter, due to the factors whose inverse does not decay; what they block
    /// stays.
    pub(crate) fn gain_beside_filter(&self, frequency_hz: f64) -> f64 {
        let endless = |link: &Link| self.is_endless(link);
        1.0 / self.chain.response_of(frequency_hz, endless).norm()
    }

    /// Whether dividing out a factor makes the whole record depend on what precedes and follows it.
    fn is_endless(&self, link: &Link) -> bool {
        let stand = &self.chain.stand;
        !link.dies_out(stand) && !link.blocks_constants(stand)
    }

    /// The first such effect.
    pub(crate) fn endless(&self) -> Option<&'static str> {
        let link = self.links().iter().find(|link| self.is_endless(link));
        link.map(|link| link.effect)
    }

    /// The first effect that does not pass a constant.
    pub(crate) fn blocks_constants(&self) -> Option<&'static str> {
        let stand = &self.chain.stand;
        let link = self
            .links()
            .iter()
            .find(|link| link.blocks_constants(stand));
        link.map(|link| link.effect)
    }

    /// The links in order from torque to record.
    pub(crate) fn links(&self) -> &[Link] {
        self.chain.links()
    }

    /// Inverts a record in its SI units; `noise_std` is the standard deviation of its noise, 0 if
    /// unknown.
    ///
    /// # Errors
    /// If the iteration between a coupling past the stand and its torques does not converge.
    pub(crate) fn run(
        &self,
        record: &[f64],
        rate_hz: f64,
        noise_std: f64,
    ) -> Result<InverseResult, Failure> {
        self.beside(record, rate_hz, noise_std, motion::Beside::default())
    }

    /// Samples beyond an end of a record used in the inversion.
    fn lead(&self) -> usize {
        (4 * self.filter.half_length()).max(SHORTEST_LEAD)
    }

    /// Inverts a record, or a window of one.
    fn beside(
        &self,
        record: &[f64],
        rate_hz: f64,
        noise_std: f64,
        beside: motion::Beside,
    ) -> Result<InverseResult, Failure> {
        let extension = Extension::new(record.len(), rate_hz, self.lead());
        let clock = SampleClock {
            step_s: 1.0 / rate_hz,
        };
        let back = |torque: Option<&[f64]>, beside: motion::Beside| {
            let pass = Pass {
                inverse: self,
                extension: extension.clone(),
                clock,
                samples: record.to_vec(),
                noise_std,
                torque,
                beside,
                result: InverseResult::default(),
            };
            pass.back()
        };
        let couples = self.links().iter().any(Link::is_feedthrough);
        if !(couples && self.chain.has_torques()) {
            return Ok(back(None, beside).0);
        }
        let size = record.iter().map(|y| y * y).sum::<f64>().sqrt();
        let mut torque = vec![0.0; record.len()];
        for _ in 0..ROUNDS {
            let (result, now) = back(Some(&torque), motion::Beside::default());
            let change = now.iter().zip(&torque).map(|(a, b)| (a - b).powi(2));
            let change = change.sum::<f64>().sqrt();
            torque = now;
            if change <= AGREED * size {
                return Ok(result);
            }
        }
        Err(ErrorCode::NotInvertible.failed(
            "the inversion of capacitive coupling and torques in the stand does not converge: one of them is too large \
             to be inverted together with the other; remove one of the effects from the stand file",
        ))
    }

    fn band(&self) -> &Band {
        self.filter.band()
    }
}

/// Inverse of the linear part, without factors whose inverse does not decay.
fn regular_inverse(chain: Arc<Chain>) -> Inverse {
    Arc::new(move |hz| {
        let regular = |link: &Link| link.dies_out(&chain.stand);
        chain.stand.inverse(TAU * hz) / chain.response_of(hz, regular)
    })
}

/// Rejects a coupling past a static characteristic, as that also acts on the coupled signal.
fn refuse_bent_coupling(stand: &Stand, chain: &Chain) -> Result<(), Failure> {
    let links = chain.links();
    let is_bent =
        |link: &&Link| link.stage < Stage::Chain && matches!(link.action, Action::Distortion(_));
    let coupled = links.iter().find(|link| link.is_feedthrough());
    match (coupled, links.iter().find(is_bent)) {
        (Some(coupled), Some(curve)) => Err(stand.failed(
            ErrorCode::NotInvertible,
            format_args!(
                "\"{}\" bypasses the stand, and \"{}\" distorts its response; the two cannot be inverted together; \
                 remove the smaller one",
                coupled.effect,
                curve.effect
            ),
        )),
        _ => Ok(()),
    }
}

impl Pass<'_> {
    /// Complete inversion, and the torques found in the stand.
    fn back(mut self) -> (InverseResult, Vec<f64>) {
        self.disturbances();
        let groups = self.inverse.chain.groups();
        let mut rest: Vec<&Link> = Vec::new();
        for group in groups.iter().rev() {
            match group {
                Group::Linear(links) => rest.clone_from(links),
                Group::Distortion(link) => {
                    self.divide(&std::mem::take(&mut rest));
                    self.undistort(link);
                }
                Group::Torques(links) => {
                    self.divide(&std::mem::take(&mut rest));
                    let torque = self.stand(links);
                    return (self.result, torque);
                }
            }
        }
        self.finish(&rest, None);
        (self.result, Vec::new())
    }

    fn rate_hz(&self) -> f64 {
        self.inverse.band().sample_rate_hz()
    }

    fn disturbances(&mut self) {
        let mut lines: Vec<SpectralLine> = Vec::new();
        let mut spikes: Vec<SpikeTrain> = Vec::new();
        let mut waves = 0;
        for link in self.inverse.links() {
            match &link.action {
                Action::Lines(more) => lines.extend(more),
                Action::Spikes(train) => spikes.push(*train),
                Action::Course(more) => waves = waves.max(*more),
                _ => {}
            }
        }
        let rate_hz = self.rate_hz();
        if !lines.is_empty() {
            self.result.lines =
                effects::subtract_lines(&mut self.samples, rate_hz, &lines, self.noise_std);
        }
        let trains = effects::subtract_spikes(&mut self.samples, rate_hz, &spikes);
        self.result.lines.extend(trains);
        if waves > 0 {
            effects::subtract_course(&mut self.samples, waves);
        }
    }

    fn undistort(&mut self, link: &Link) {
        if let Action::Distortion(distortion) = &link.action {
            let lost = distortion.inverse(self.clock, self.noise_std, &mut self.samples);
            self.lose(link.effect, lost);
        }
    }

    fn lose(&mut self, effect: &'static str, lost: Unrecovered) {
        if !lost.samples.is_empty() {
            self.result.lost.push((effect, lost));
        }
    }

    /// Divides out linear links, in a band as wide as noise allows.
    fn divide(&mut self, links: &[&Link]) {
        self.uncouple(links);
        if links.is_empty() {
            return;
        }
        let inverse = self.inverse_of(links);
        let band = self.wide(&inverse);
        let before = self.samples.clone();
        self.samples = self
            .extension
            .filter(&self.samples, |hz| held(&inverse, &band, hz));
        self.level(links, &before);
        self.noise_std *= growth(&inverse, &band);
        self.result.seen_to_hz = Some(band.top_hz());
    }

    /// Removes the slope introduced by the inverse of a link that blocks constants.
    fn level(&mut self, links: &[&Link], before: &[f64]) {
        let stand = &self.inverse.chain.stand;
        if links.iter().any(|link| link.blocks_constants(stand)) {
            effects::level(before, &mut self.samples);
        }
    }

    /// Inverse of a selection of the linear links.
    fn inverse_of<'b>(&self, some: &'b [&Link]) -> impl Fn(f64) -> Complex64 + 'b
    where
        Self: 'b,
    {
        let chain = &self.inverse.chain;
        move |hz| {
            let one_of = |link: &Link| some.iter().any(|s| std::ptr::eq(*s, link));
            chain.response_of(hz, one_of).inv()
        }
    }

    /// Subtracts the contribution of the stand's torques to a coupling past it.
    fn uncouple(&mut self, links: &[&Link]) {
        let chain = &self.inverse.chain;
        if let Some(torque) = self.torque
            && let Some(coupling) = chain.coupling(links)
        {
            let band = self.inverse.band();
            let part = self
                .extension
                .filter(torque, |hz| held(&coupling, band, hz));
            let pairs = self.samples.iter_mut().zip(&part);
            pairs.for_each(|(y, p)| *y -= p);
        }
    }

    /// The widest band in which an inverse does not amplify noise excessively.
    fn wide(&self, inverse: &impl Fn(f64) -> Complex64) -> Band {
        let band = self.inverse.band();
        let rate_hz = band.sample_rate_hz();
        let highest = (WIDER * band.top_hz()).min(0.5 * HIGHEST * rate_hz);
        let steps = 200;
        let at = |k: usize| highest * k as f64 / f64::from(steps);
        let mut inside = 0.0_f64;
        let mut top = band.top_hz();
        for k in 1..=steps as usize {
            let size = inverse(at(k)).norm();
            if at(k) <= band.top_hz() {
                inside = inside.max(size);
            } else if size <= GROWTH * inside {
                top = at(k);
            } else {
                break;
            }
        }
        Band::new(rate_hz, top).unwrap_or_else(|_| band.clone())
    }

    /// The stand itself: displacement, torques, applied quantity.
    fn stand(&mut self, links: &[&Link]) -> Vec<f64> {
        let torques: Vec<(&dyn Torque, bool)> =
            links.iter().filter_map(|link| link.torque()).collect();
        let rate_hz = self.rate_hz();
        let band = self.wide(&|_| Complex64::ONE);
        let chain = &self.inverse.chain;
        let natural_hz = chain.stand.highest_hz();
        let gage_path = torques.iter().filter(|(_, in_path)| *in_path);
        let gage_path = gage_path.map(|(torque, _)| *torque).collect();
        let view = motion::View {
            rate_hz,
            factor: torqcomp_model::simulate::substeps(natural_hz, rate_hz).max(FEWEST_STEPS),
            shift: chain.shift,
            speed_std: self.noise_std * speed_gain(&band),
            band: &band,
        };
        let torques: Vec<&dyn Torque> = torques.iter().map(|(torque, _)| *torque).collect();
        let gage_path = GagePath::new(gage_path, chain.shift, self.noise_std);
        let found = motion::motion(
            &torques,
            gage_path,
            &self.samples,
            &view,
            std::mem::take(&mut self.beside),
        );
        self.result.next = found.next;
        let hides = torques.iter().position(|torque| torque.hidden() > 0.0);
        let lost = Unrecovered {
            why: "the gage reads zero within the gap".to_owned(),
            samples: found.hidden,
        };
        self.lose(links[hides.unwrap_or(0)].effect, lost);
        if torques.iter().any(|torque| torque.switches()) {
            self.result.at_rest = Some(found.at_rest);
        }
        let seen = self.result.seen_to_hz.unwrap_or(f64::INFINITY);
        self.result.seen_to_hz = Some(band.top_hz().min(seen));
        self.samples = found.x;
        self.finish(&[], Some(&found.torque));
        found.torque
    }

    /// The linear stand, with the remaining linear links, in the band.
    fn finish(&mut self, rest: &[&Link], torque: Option<&[f64]>) {
        let chain = &self.inverse.chain;
        let inverse = self.inverse_of(rest);
        let band = self.inverse.band();
        let stand = |hz: f64| {
            let omega = TAU * hz;
            held(&inverse, band, hz) * chain.stand.inverse(omega)
        };
        let mut spectrum = self
            .extension
            .times(self.extension.spectrum(&self.samples), stand);
        if let Some(torque) = torque {
            let torque = self.extension.spectrum(torque);
            let as_applied = chain.torque_as_applied();
            let in_band = |hz: f64| held(&as_applied, band, hz);
            spectrum = spectrum + self.extension.times(torque, in_band);
        }
        let applied = self.extension.samples(&spectrum);
        let before = std::mem::replace(&mut self.samples, applied);
        self.level(rest, &before);
        let gain = self.inverse.chain.gain;
        self.result.applied = self.samples.iter().map(|u| u / gain).collect();
    }
}

/// An inverse within a band; not evaluated beyond it.
fn held(inverse: &impl Fn(f64) -> Complex64, band: &Band, hz: f64) -> Complex64 {
    match band.gain(hz) {
        0.0 => Complex64::ZERO,
        gain => gain * inverse(hz),
    }
}

/// Noise gain (output over input RMS) of an inverse in a band, for white noise.
fn growth(inverse: &impl Fn(f64) -> Complex64, band: &Band) -> f64 {
    mean_square(band, |hz| held(inverse, band, hz).norm_sqr()).sqrt()
}

/// RMS speed over RMS of the samples, for white noise in a band, per second.
fn speed_gain(band: &Band) -> f64 {
    mean_square(band, |hz| (TAU * hz * band.gain(hz)).powi(2)).sqrt()
}

/// Mean up to the Nyquist frequency.
fn mean_square(band: &Band, power: impl Fn(f64) -> f64) -> f64 {
    const STEPS: usize = 2000;
    let step_hz = 0.5 * band.sample_rate_hz() / STEPS as f64;
    let sum: f64 = (0..STEPS).map(|k| power((k as f64 + 0.5) * step_hz)).sum();
    sum / STEPS as f64
}
