//! From a record back to what was applied, with a stand that has effects no response over frequency can describe.
//!
//! Every link of `simulate` is taken back in reverse order: disturbances, the recorder's range, the chain, the gage,
//! the linear dynamics, and last the stand itself, whose torques are evaluated along the motion
//! (`motion`). Beyond the band nothing is added.

mod curve;
mod disturbance;
mod links;
mod motion;
mod play;
mod shown;

use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::Complex64;
use torqcomp_dsp::band::Band;
use torqcomp_dsp::compensate::{Extension, Inverse, InverseFilter};
use torqcomp_model::effects::{Action, Clock, Line, Mode, Stage};

use crate::failure::Failure;
use crate::stand::Stand;

pub use disturbance::FoundLine;
use links::Group;
pub use links::{Link, treatment};

/// Rounds in which torques of the stand and a coupling past it are brought into agreement.
const ROUNDS: usize = 40;
/// Change of the torques, relative to the record, at which they agree.
const AGREED: f64 = 1e-9;
/// Fewest steps from sample to sample along which torques are evaluated.
const FEWEST_STEPS: usize = 8;
/// Samples of continuation beyond an end, at least.
const SHORTEST_LEAD: usize = 2048;
/// Band of what torques and curves see, over that of the result, where noise allows it.
const WIDER: f64 = 2.0;
/// Highest part of half the rate that they see.
const HIGHEST: f64 = 0.8;
/// Growth of noise, over that within the band, up to which a wider band is allowed.
const GROWTH: f64 = 1.5;

/// How a record is taken back.
pub struct Undo {
    mode: Mode,
    gain: f64,
    shift: f64,
    links: Arc<[Link]>,
    filter: InverseFilter,
}

/// Samples of which a record does not tell enough.
#[derive(Debug, Clone, PartialEq)]
pub struct Lost {
    /// The effect.
    pub effect: &'static str,
    /// What it is about them.
    pub why: String,
    /// Their indices, in order.
    pub samples: Vec<usize>,
}

/// What came out.
#[derive(Debug, Default)]
pub struct Undone {
    /// The applied quantity, in SI units.
    pub applied: Vec<f64>,
    /// Samples of which the record does not tell enough.
    pub lost: Vec<Lost>,
    /// Lines that were taken off.
    pub lines: Vec<FoundLine>,
    /// Rms of a slow course that was taken off, in units of the record.
    pub course_rms: Option<f64>,
    /// Part of the record in which the speed cannot be told from zero, where a torque depends on its sign.
    pub still: Option<f64>,
    /// Highest frequency that curves and torques have seen.
    pub seen_to_hz: Option<f64>,
}

/// A record on its way back.
struct Way<'a> {
    undo: &'a Undo,
    extension: Extension,
    clock: Clock,
    samples: Vec<f64>,
    /// Standard deviation of the noise of a sample.
    noise_std: f64,
    /// Torques of the stand, as far as they are known, for couplings past it.
    torque: Option<&'a [f64]>,
    done: Undone,
}

impl Undo {
    /// Takes a stand apart for a band.
    ///
    /// # Errors
    /// If the stand has no mechanics, or effects that cannot be taken back together.
    pub fn new(stand: &Stand, band: Band) -> Result<Self, Failure> {
        let mode = stand.mode()?;
        let links: Arc<[Link]> = links::of(stand)?.into();
        let all = links.clone();
        let inverse: Inverse = Arc::new(move |hz| {
            let regular = |link: &Link| link.dies_out(&mode);
            mode.inverse(TAU * hz) / links::response(&all, &mode, hz, regular)
        });
        Ok(Self {
            filter: InverseFilter::design(inverse, band)?,
            mode,
            gain: stand.gain(),
            shift: stand.diagnosed.shift,
            links,
        })
    }

    /// The linear part of the way back, without factors whose inverse has no end in time.
    #[must_use]
    pub fn filter(&self) -> &InverseFilter {
        &self.filter
    }

    /// The links, in the order of `simulate`.
    #[must_use]
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Takes a record back, in SI units of the record; `noise_std` is the standard deviation of its
    /// noise, 0 if none is known.
    ///
    /// # Errors
    /// If a coupling past the stand and the torques in it do not come into agreement.
    pub fn run(&self, record: &[f64], rate_hz: f64, noise_std: f64) -> Result<Undone, Failure> {
        let lead = (4 * self.filter.half_length()).max(SHORTEST_LEAD);
        let extension = Extension::new(record.len(), rate_hz, lead);
        let clock = Clock {
            step_s: 1.0 / rate_hz,
        };
        let back = |torque: Option<&[f64]>| {
            let way = Way {
                undo: self,
                extension: extension.clone(),
                clock,
                samples: record.to_vec(),
                noise_std,
                torque,
                done: Undone::default(),
            };
            way.back()
        };
        if !self.couples() {
            return Ok(back(None).0);
        }
        let size = record.iter().map(|y| y * y).sum::<f64>().sqrt();
        let mut torque = vec![0.0; record.len()];
        for _ in 0..ROUNDS {
            let (done, now) = back(Some(&torque));
            let change = now.iter().zip(&torque).map(|(a, b)| (a - b).powi(2));
            let change = change.sum::<f64>().sqrt();
            torque = now;
            if change <= AGREED * size {
                return Ok(done);
            }
        }
        Err(Failure::failed(
            "the capacitive coupling past the stand and the torques in it do not come into agreement: one of \
             them is too large to be taken back beside the other; leave one of the effects out of the stand file",
        ))
    }

    fn band(&self) -> &Band {
        self.filter.band()
    }

    /// Whether what is applied reaches the record past torques of the stand.
    fn couples(&self) -> bool {
        let is = |f: &dyn Fn(&Action) -> bool| self.links.iter().any(|link| link.is(f));
        is(&|a| matches!(a, Action::Feedthrough(_))) && self.has_torques()
    }

    fn has_torques(&self) -> bool {
        let torque = |a: &Action| matches!(a, Action::Torque { .. });
        self.links.iter().any(|link| link.is(&torque))
    }
}

impl Way<'_> {
    /// All the way back, and the torques that were found in the stand.
    fn back(mut self) -> (Undone, Vec<f64>) {
        self.disturbances();
        let groups = links::groups(&self.undo.links);
        let mut rest: Vec<&Link> = Vec::new();
        for group in groups.iter().rev() {
            match group {
                Group::Linear(links) => rest.clone_from(links),
                Group::Curve(link) => {
                    self.divide(&std::mem::take(&mut rest));
                    self.curve(link);
                }
                Group::Stand(links) => {
                    self.divide(&std::mem::take(&mut rest));
                    let torque = self.stand(links);
                    return (self.done, torque);
                }
            }
        }
        self.finish(&rest, None);
        (self.done, Vec::new())
    }

    fn rate_hz(&self) -> f64 {
        self.undo.band().sample_rate_hz()
    }

    fn disturbances(&mut self) {
        let mut lines: Vec<Line> = Vec::new();
        let mut waves = 0;
        for link in self
            .undo
            .links
            .iter()
            .filter(|l| l.stage == Stage::Disturbance)
        {
            match &link.action {
                Some(Action::Lines(more)) => lines.extend(more),
                Some(Action::Course(more)) => waves = waves.max(*more),
                _ => {}
            }
        }
        if !lines.is_empty() {
            let rate_hz = self.rate_hz();
            self.done.lines =
                disturbance::take_lines(&mut self.samples, rate_hz, &lines, self.noise_std);
        }
        if waves > 0 {
            self.done.course_rms = Some(disturbance::take_course(&mut self.samples, waves));
        }
    }

    fn curve(&mut self, link: &Link) {
        let Some(Action::Transform { apply, undo }) = &link.action else {
            return;
        };
        let (why, samples) = match undo {
            Some(undo) => {
                let (branch, beyond) = curve::invert(apply, undo, self.clock, &mut self.samples);
                let text = format!(
                    "beyond {:.4} to {:.4} of the record in SI units the curve cannot be inverted",
                    branch.ends[0], branch.ends[1]
                );
                (text, beyond)
            }
            None if link.stage == Stage::Limit => {
                let (limits, at) = curve::at_limit(apply, &self.samples, self.noise_std);
                let text = format!(
                    "at the limits {:.4} and {:.4} of the record in SI units it holds no more than that",
                    limits[0], limits[1]
                );
                (text, at)
            }
            None => {
                let gap = link.values.first().copied().unwrap_or(0.0);
                let still = play::invert(&mut self.samples, gap, self.noise_std);
                (
                    "the gage stands still while the play is gone through".to_owned(),
                    still,
                )
            }
        };
        self.lose(link.effect, why, samples);
    }

    fn lose(&mut self, effect: &'static str, why: String, samples: Vec<usize>) {
        if !samples.is_empty() {
            self.done.lost.push(Lost {
                effect,
                why,
                samples,
            });
        }
    }

    /// Divides linear links out, in a band as wide as noise allows.
    fn divide(&mut self, links: &[&Link]) {
        self.uncouple(links);
        if links.is_empty() {
            return;
        }
        let inverse = self.inverse(links);
        let band = self.wide(&inverse);
        let before = self.samples.clone();
        self.samples = self
            .extension
            .filter(&self.samples, |hz| held(&inverse, &band, hz));
        links::level(links, self.undo.mode, &before, &mut self.samples);
        self.noise_std *= growth(&inverse, &band);
        self.done.seen_to_hz = Some(band.top_hz());
    }

    /// The inverse of some of the linear links.
    fn inverse<'b>(&self, some: &'b [&Link]) -> impl Fn(f64) -> Complex64 + 'b
    where
        Self: 'b,
    {
        let undo = self.undo;
        move |hz| {
            let one_of = |link: &Link| some.iter().any(|s| std::ptr::eq(*s, link));
            links::response(&undo.links, &undo.mode, hz, one_of).inv()
        }
    }

    /// Takes off what torques of the stand contribute to a coupling past it.
    fn uncouple(&mut self, links: &[&Link]) {
        let Some(torque) = self.torque else { return };
        let Some(coupled) = links::coupled(links, self.undo.mode) else {
            return;
        };
        let band = self.undo.band();
        let part = self.extension.filter(torque, |hz| held(&coupled, band, hz));
        self.samples
            .iter_mut()
            .zip(&part)
            .for_each(|(y, p)| *y -= p);
    }

    /// The widest band in which an inverse does not blow noise up.
    fn wide(&self, inverse: &impl Fn(f64) -> Complex64) -> Band {
        let band = self.undo.band();
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
        let torques: Vec<motion::Link> = links
            .iter()
            .filter_map(|link| match &link.action {
                Some(Action::Torque { torque, shown }) => Some(motion::Link {
                    torque: torque.as_ref(),
                    shown: *shown,
                }),
                _ => None,
            })
            .collect();
        let rate_hz = self.rate_hz();
        let band = self.wide(&|_| Complex64::ONE);
        let natural_hz = self.undo.mode.omega_rad_s / TAU;
        let view = motion::View {
            rate_hz,
            factor: torqcomp_model::simulate::substeps(natural_hz, rate_hz).max(FEWEST_STEPS),
            shift: self.undo.shift,
            speed_std: self.noise_std * speed_gain(&band),
            noise_std: self.noise_std,
            band: &band,
        };
        let found = motion::motion(&torques, &self.samples, &view);
        let why = "the gage shows nothing within the gap".to_owned();
        self.lose(links[0].effect, why, found.hidden);
        if links.iter().any(|link| link.effect == "coulomb-friction") {
            self.done.still = Some(found.still);
        }
        let seen = self.done.seen_to_hz.unwrap_or(f64::INFINITY);
        self.done.seen_to_hz = Some(band.top_hz().min(seen));
        self.samples = found.x;
        self.finish(&[], Some(&found.torque));
        found.torque
    }

    /// The linear stand, with what is left of linear links, in the band.
    fn finish(&mut self, rest: &[&Link], torque: Option<&[f64]>) {
        let undo = self.undo;
        let inverse = self.inverse(rest);
        let band = undo.band();
        let stand = |hz: f64| {
            let omega = TAU * hz;
            held(&inverse, band, hz) * undo.mode.inverse(omega)
        };
        let mut spectrum = self
            .extension
            .times(self.extension.spectrum(&self.samples), stand);
        if let Some(torque) = torque {
            let torque = self.extension.spectrum(torque);
            let in_band = |hz: f64| Complex64::from(band.gain(hz));
            spectrum = spectrum + self.extension.times(torque, in_band);
        }
        let before = std::mem::take(&mut self.samples);
        let mut applied = self.extension.samples(&spectrum);
        links::level(rest, undo.mode, &before, &mut applied);
        applied.iter_mut().for_each(|u| *u /= undo.gain);
        self.done.applied = applied;
    }
}

/// An inverse in a band; beyond, it is not asked.
fn held(inverse: &impl Fn(f64) -> Complex64, band: &Band, hz: f64) -> Complex64 {
    match band.gain(hz) {
        0.0 => Complex64::ZERO,
        gain => gain * inverse(hz),
    }
}

/// Rms out over rms in, for white noise through an inverse in a band.
fn growth(inverse: &impl Fn(f64) -> Complex64, band: &Band) -> f64 {
    mean_square(band, |hz| held(inverse, band, hz).norm_sqr()).sqrt()
}

/// Rms of the speed over rms of the samples, for white noise in a band, per second.
fn speed_gain(band: &Band) -> f64 {
    mean_square(band, |hz| (TAU * hz * band.gain(hz)).powi(2)).sqrt()
}

/// Mean up to half the rate.
fn mean_square(band: &Band, power: impl Fn(f64) -> f64) -> f64 {
    const STEPS: usize = 2000;
    let step_hz = 0.5 * band.sample_rate_hz() / STEPS as f64;
    let sum: f64 = (0..STEPS).map(|k| power((k as f64 + 0.5) * step_hz)).sum();
    sum / STEPS as f64
}
