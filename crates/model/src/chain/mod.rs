//! The chain from the applied torque to the record, link by link, in both directions.
//!
//! ```text
//! torque ─► stand, with its torques ─► dynamics ─► gage ─► recorder and chain ─► limit ─(+)─► record
//!                                                                         disturbances ─┘
//! ```
//!
//! Forward: [`Chain::simulate`]. The inverse takes the links in reverse order, those of one of the [`Chain::groups`]
//! together: nonlinear effects are inverted in their own files ([`Distortion::inverse`](crate::effects::Distortion),
//! [`subtract_lines`](crate::effects::subtract_lines), [`Torque::blurred`](crate::effects::Torque)), and the linear
//! ones are divided out of the spectrum ([`Chain::divide_out`], [`Chain::response_of`]).

mod forward;
mod gage_path;
mod slow_loads;
mod within;

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::effects::{Action, Effect, Fixed, Form, Stage, Torque};
use crate::modal::ModalResponse;

pub use forward::StandRun;
pub use gage_path::{GagePath, GageState};

/// Frequency, relative to the natural one, at which the limit at DC is evaluated.
const NEAR_REST: f64 = 1e-6;
/// Change of a factor across DC, relative to the factor, that still counts as continuous.
const LARGEST_STEP: f64 = 1e-4;
/// Response at DC, relative to that at the natural frequency, below which a link blocks constants.
const NONE_AT_REST: f64 = 1e-9;

/// A link of the chain: one effect, or the recorder.
#[derive(Debug)]
pub struct Link {
    /// Its effect; `recorder` for the recorder.
    pub effect: &'static str,
    /// Its form.
    pub form: &'static str,
    /// Its place in the chain.
    pub stage: Stage,
    /// What it does.
    pub action: Action,
}

/// A stand with its effects and its recorder, from the applied quantity to the record.
#[derive(Debug)]
pub struct Chain {
    /// Linear response of the stand.
    pub stand: ModalResponse,
    /// Static gain: recorded per applied quantity.
    pub gain: f64,
    /// Displacement, in units of the record, under a constant load that is not in the input. Torques of the
    /// stand see it; its effect on the gage signal belongs to the record's offset.
    pub shift: f64,
    /// Whether the motion is integrated from an initial state although no torque of the stand requires it: distortions
    /// after the stand then see the free motion as well.
    pub begins_at_start: bool,
    /// In order from torque to record.
    links: Vec<Link>,
}

/// Links that are inverted together.
#[derive(Debug)]
pub enum Group<'a> {
    /// Torques of the stand.
    Torques(Vec<&'a Link>),
    /// Factors and terms of the response.
    Linear(Vec<&'a Link>),
    /// A distortion of the samples.
    Distortion(&'a Link),
}

impl Link {
    /// Its torque in the stand, and whether the gage shows it; `None` for any other action.
    #[must_use]
    pub fn torque(&self) -> Option<(&dyn Torque, bool)> {
        match &self.action {
            Action::Torque {
                torque,
                in_gage_path,
            } => Some((torque.as_ref(), *in_gage_path)),
            _ => None,
        }
    }

    /// An effect in one of its forms, with parameters in units of the record, s and Hz.
    #[must_use]
    pub fn of(effect: &'static Effect, form: &'static Form, values: &[f64]) -> Self {
        Self {
            effect: effect.name,
            form: form.name,
            stage: form.stage,
            action: (form.build)(values),
        }
    }

    /// Whether it is a factor or term of the response.
    #[must_use]
    pub fn is_linear(&self) -> bool {
        matches!(
            self.action,
            Action::Factor(_)
                | Action::Stiffness(_)
                | Action::Body { .. }
                | Action::Feedthrough(_)
                | Action::Recorder { .. }
        )
    }

    /// Whether the applied quantity reaches the record past the stand.
    #[must_use]
    pub fn is_feedthrough(&self) -> bool {
        matches!(self.action, Action::Feedthrough(_))
    }

    /// Whether the impulse response of its inverse decays: the factor is continuous at DC, with a nonzero limit.
    #[must_use]
    pub fn dies_out(&self, stand: &ModalResponse) -> bool {
        let near_rest = NEAR_REST * stand.first().omega_rad_s;
        let [at_rest, near] = [0.0, near_rest].map(|omega| self.action.factor(stand, omega));
        let Some((at_rest, near)) = at_rest.zip(near) else {
            return true;
        };
        // The limit is the same for both signs of frequency only if it is real.
        let step = (near - at_rest).norm().max(near.im.abs());
        at_rest.norm() > 0.0 && step < LARGEST_STEP * at_rest.norm()
    }

    /// Whether it blocks constants.
    #[must_use]
    pub fn blocks_constants(&self, stand: &ModalResponse) -> bool {
        let resonance = stand.first().omega_rad_s;
        let [at_rest, at_resonance] =
            [0.0, resonance].map(|omega| self.action.factor(stand, omega));
        let both = at_rest.zip(at_resonance);
        both.is_some_and(|(rest, resonance)| rest.norm() < NONE_AT_REST * resonance.norm())
    }

    /// Its factor at a frequency; `before` is the response of the chain before it.
    fn factor(&self, before: Complex64, stand: &ModalResponse, frequency_hz: f64) -> Complex64 {
        let omega = TAU * frequency_hz;
        match &self.action {
            Action::Feedthrough(past) => 1.0 + (past.response)(stand, omega) / before,
            Action::Recorder { response, .. } => response(frequency_hz),
            action => action.factor(stand, omega).unwrap_or(Complex64::ONE),
        }
    }
}

impl Chain {
    /// A plain stand without a recorder.
    #[must_use]
    pub fn new(stand: impl Into<ModalResponse>, gain: f64) -> Self {
        Self {
            stand: stand.into(),
            gain,
            shift: 0.0,
            begins_at_start: false,
            links: Vec::new(),
        }
    }

    /// Sets the displacement under a constant load.
    #[must_use]
    pub fn with_shift(self, shift: f64) -> Self {
        Self { shift, ..self }
    }

    /// Adds a recorder, as the first link of its stage.
    #[must_use]
    pub fn with_recorder(mut self, recorder: Option<Fixed>, is_ideal: bool) -> Self {
        if let Some(response) = recorder {
            let link = Link {
                effect: "recorder",
                form: "",
                stage: Stage::Chain,
                action: Action::Recorder { response, is_ideal },
            };
            let place = self.links.partition_point(|l| l.stage < Stage::Chain);
            self.links.insert(place, link);
        }
        self
    }

    /// Adds links; those of one stage keep the given order. With torques, links that change how the stand moves become
    /// part of the motion on which these act (`within`).
    #[must_use]
    pub fn with_links(mut self, links: impl IntoIterator<Item = Link>) -> Self {
        self.links.extend(links);
        self.links.sort_by_key(|link| link.stage);
        match self.has_torques() {
            true => self.with_links_within(),
            false => self,
        }
    }

    /// The links in order from torque to record.
    #[must_use]
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Whether a frequency response describes the chain completely, down to DC.
    #[must_use]
    pub fn is_a_response(&self) -> bool {
        let regular = |link: &Link| link.is_linear() && link.dies_out(&self.stand);
        self.links.iter().all(regular)
    }

    /// Links that are inverted together, in order, without disturbances.
    #[must_use]
    pub fn groups(&self) -> Vec<Group<'_>> {
        let mut groups = Vec::new();
        let links = self.links.iter();
        for link in links.filter(|link| link.stage != Stage::Disturbance) {
            let is_torque = matches!(link.action, Action::Torque { .. });
            match groups.last_mut() {
                Some(Group::Torques(group)) if is_torque => group.push(link),
                Some(Group::Linear(group)) if link.is_linear() => group.push(link),
                _ if is_torque => groups.push(Group::Torques(vec![link])),
                _ if link.is_linear() => groups.push(Group::Linear(vec![link])),
                _ => groups.push(Group::Distortion(link)),
            }
        }
        groups
    }

    /// Combined response of a selection of the linear links at a frequency.
    #[must_use]
    pub fn response_of(&self, frequency_hz: f64, some: impl Fn(&Link) -> bool) -> Complex64 {
        let mut through = self.stand.response(TAU * frequency_hz);
        let mut product = Complex64::ONE;
        for link in self.links.iter().filter(|link| link.is_linear()) {
            let factor = link.factor(through, &self.stand, frequency_hz);
            through *= factor;
            if some(link) {
                product *= factor;
            }
        }
        product
    }

    /// The inverse response of the plain stand divided by all linear links, at a frequency.
    ///
    /// ```
    /// use torqcomp_model::effects::Effect;
    /// use torqcomp_model::{Chain, Link, Mode};
    /// // At ω₀ the plain stand has 2jζ = 1.2j; a gain of 1.5 in the chain divides it.
    /// let mode = Mode { omega_rad_s: 5.0, damping_ratio: 0.6 };
    /// let effect = Effect::named("gain-error").unwrap();
    /// let gain = Link::of(effect, &effect.forms[0], &[0.5]);
    /// let chain = Chain::new(mode, 1.0).with_links([gain]);
    /// let inverse = chain.divide_out(mode.inverse(5.0), mode.natural_frequency_hz());
    /// assert!((inverse.im - 0.8).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn divide_out(&self, plain: Complex64, frequency_hz: f64) -> Complex64 {
        let linear = || self.links.iter().filter(|link| link.is_linear());
        let factor = |link: &Link| link.factor(Complex64::ONE, &self.stand, frequency_hz);
        if linear().all(|link| matches!(link.action, Action::Recorder { .. })) {
            return linear().fold(plain, |inverse, link| inverse / factor(link));
        }
        let along = |through: Complex64, link: &Link| match &link.action {
            Action::Feedthrough(past) => through + (past.response)(&self.stand, TAU * frequency_hz),
            _ => through * factor(link),
        };
        linear().fold(plain.inv(), along).inv()
    }

    /// Applied quantity equivalent to a unit torque at the gage, over the gain, by frequency in Hz: 1 in a stand with
    /// one mode, where both act on the same inertia.
    pub fn torque_as_applied(&self) -> impl Fn(f64) -> Complex64 + '_ {
        let at_gage = match self.stand.only() {
            Some(_) => None,
            None => self.stand.at_gage(),
        };
        move |frequency_hz| {
            let omega = TAU * frequency_hz;
            let of_several = |g: &ModalResponse| g.response(omega) * self.stand.inverse(omega);
            at_gage.as_ref().map_or(Complex64::ONE, of_several)
        }
    }

    /// Contribution of the stand's torques to the record through couplings past it, at a frequency; `None` without
    /// such a coupling among these links.
    #[must_use]
    pub fn coupling<'a>(&'a self, some: &'a [&Link]) -> Option<impl Fn(f64) -> Complex64 + 'a> {
        let any = some.iter().any(|link| link.is_feedthrough());
        let torque_as_applied = self.torque_as_applied();
        any.then_some(move |frequency_hz| {
            let acts_as = torque_as_applied(frequency_hz);
            let add = |sum: Complex64, link: &&Link| match &link.action {
                Action::Feedthrough(past) => {
                    sum + acts_as * (past.response)(&self.stand, TAU * frequency_hz)
                }
                _ => sum * link.factor(Complex64::ONE, &self.stand, frequency_hz),
            };
            some.iter().fold(Complex64::ZERO, add)
        })
    }
}
