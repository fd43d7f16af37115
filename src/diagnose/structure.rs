//! A model with free parameters: the plain stand and its added effects.

use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

use torqcomp_model::effects::{Action, Effect, Fixed, Form, History, RecordScales, Stage, Unit};
use torqcomp_model::{Chain, Link};
use torqcomp_model::{ModalResponse, Mode};

use super::held::HeldBody;
use super::record::NuisanceTerms;
use super::several_modes::SeveralModes;
use super::units::ChannelUnits;
use crate::identify::Motion;
use crate::stand::derivative;

/// The plain stand: one mode and a static gain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlainStand {
    pub natural_hz: f64,
    pub damping_ratio: f64,
    /// Static gain, recorded per applied quantity.
    pub gain: f64,
}

impl PlainStand {
    pub fn mode(&self) -> Mode {
        Mode {
            omega_rad_s: TAU * self.natural_hz,
            damping_ratio: self.damping_ratio,
        }
    }
}

/// Minimum number of periods of a line in the longest record.
const FEWEST_TURNS: f64 = 3.0;
/// Number of decays that represent an algebraic one, of a material that remembers the load before the record, and the
/// rate of the fastest, in units of the natural angular frequency; the slowest lasts as long as the record.
const LINGERING: usize = 4;
const FASTEST: f64 = 0.3;

/// Context shared by all models of a diagnosis.
#[derive(Clone)]
pub struct FitContext {
    /// Scales that make the parameters dimensionless.
    pub scales: RecordScales,
    /// The fitted plain stand: scale of natural frequency and gain, and mode of the free motion in the residuals.
    pub plain: PlainStand,
    /// All modes of a stand that has several.
    pub several: Option<SeveralModes>,
    /// Whether the gain is a parameter of the plain stand.
    pub gain_is_free: bool,
    /// Recorded quantity of the stand's motion.
    pub measures: Motion,
    /// Whether the response of the records to torques in the stand is known.
    pub sees_torques: bool,
    /// The recorder declared in the stand file.
    pub recorder: Option<Fixed>,
    pub units: ChannelUnits,
    /// The tying spring of a body without a spring.
    pub held: Option<HeldBody>,
    /// Whether free motion from the start of a record is visible in it.
    pub rings_at_start: bool,
    /// What a shift between the channels suggests for a delay.
    pub late: Option<LateStand>,
}

/// A plain stand, and the delay of its record.
#[derive(Clone, Copy)]
pub struct LateStand {
    pub stand: PlainStand,
    pub delay_s: f64,
}

impl FitContext {
    /// The same context for another plain stand.
    pub fn at(&self, plain: PlainStand) -> Self {
        let scales = RecordScales {
            natural_hz: plain.natural_hz,
            ..self.scales
        };
        Self {
            scales,
            plain,
            ..self.clone()
        }
    }

    /// Whether an effect in that form is considered: with a spring that only ties a free body, not all are meaningful,
    /// and a fraction of a period of a line is a drift.
    pub fn allows(&self, effect: &EffectForm) -> bool {
        let acts_at_gage = effect.form.stage == Stage::Stand;
        (self.held.is_none() || effect.needs_no_spring())
            && (!acts_at_gage || self.sees_torques)
            && effect.most_turns(&self.scales) >= FEWEST_TURNS
    }

    /// Number of constants in every fit.
    pub fn constant_count(&self) -> usize {
        2 + usize::from(self.gain_is_free)
    }

    /// Number of parameters of the plain stand, including further modes if they are fitted.
    pub fn plain_count(&self) -> usize {
        self.constant_count() + self.several.as_ref().map_or(0, SeveralModes::count)
    }

    /// The same with all modes free.
    pub fn with_modes_free(&self) -> Self {
        let mut free = self.clone();
        if let Some(several) = &mut free.several {
            several.are_free = true;
        }
        free
    }

    /// Modes with free motion from the start of a record, other than that of the plain stand.
    pub fn terms(&self) -> NuisanceTerms {
        let further = self.several.iter().flat_map(SeveralModes::further);
        NuisanceTerms {
            modes: further.collect(),
            ..NuisanceTerms::NONE
        }
    }

    /// Highest natural frequency of the stand, in Hz.
    pub fn highest_hz(&self) -> f64 {
        let further = self.several.iter().flat_map(SeveralModes::further);
        further
            .map(|mode| mode.natural_frequency_hz())
            .fold(self.plain.natural_hz, f64::max)
    }

    /// The chain of a plain stand.
    pub fn chain(&self, plain: &PlainStand) -> Chain {
        let response = match &self.several {
            Some(several) => several.response(plain.mode(), &several.values()),
            None => plain.mode().into(),
        };
        self.chain_of(response, plain.gain)
    }

    /// The chain of a stand without effects.
    fn chain_of(&self, response: ModalResponse, gain: f64) -> Chain {
        Chain::new(response, gain)
            .with_recorder(self.recorder.clone(), false)
            .with_links(derivative(self.measures))
    }

    /// Parameter values of a plain stand.
    pub fn plain_values(&self, plain: &PlainStand) -> Vec<f64> {
        let natural = plain.natural_hz / self.scales.natural_hz;
        let mut values = vec![natural, plain.damping_ratio];
        if self.gain_is_free {
            values.push(plain.gain / self.plain.gain);
        }
        values.extend(self.several.iter().flat_map(SeveralModes::values));
        values
    }
}

/// An effect in one of its forms.
#[derive(Clone, Copy)]
pub struct EffectForm {
    pub effect: &'static Effect,
    pub form: &'static Form,
}

impl EffectForm {
    /// All forms of some effects.
    pub fn all(effects: impl IntoIterator<Item = &'static Effect>) -> Vec<Self> {
        let forms = |effect: &'static Effect| {
            let forms = effect.forms.iter();
            forms.map(move |form| Self { effect, form })
        };
        effects.into_iter().flat_map(forms).collect()
    }

    /// Whether it is a body coupled to the stand.
    pub fn is_body(&self) -> bool {
        let mut parameters = self.form.parameters.iter();
        parameters.any(|p| p.history == History::RingsCoupled)
    }

    /// Number of parameters that a fit moves; amplitudes of lines follow by linear least squares.
    pub fn moved(&self) -> usize {
        if self.is_line() {
            1
        } else {
            self.form.parameters.len()
        }
    }

    /// Number of its amplitudes of lines or spikes.
    pub fn amplitudes(&self) -> usize {
        self.form.parameters.len() - self.moved()
    }

    /// Index of the parameter that measures its magnitude: the first that may be zero.
    pub fn size(&self) -> Option<usize> {
        let parameters = self.form.parameters.iter().take(self.moved());
        let mut sizes = parameters.map(|p| p.lower <= 0.0 && p.upper >= 0.0);
        sizes.position(|is_size| is_size && !self.is_line())
    }

    /// Maximum number of periods of its line in a record; unlimited for an effect without a line.
    fn most_turns(&self, scales: &RecordScales) -> f64 {
        match self.form.parameters.first() {
            Some(hz) if self.is_line() => hz.upper * hz.size(scales) * scales.duration_s,
            _ => f64::INFINITY,
        }
    }

    /// Whether it adds a signal independent of the input, which may differ between records.
    pub fn is_disturbance(&self) -> bool {
        self.form.stage == Stage::Disturbance
    }

    /// Whether it adds a train of spikes, the lines of which have one amplitude.
    pub fn is_train(&self) -> bool {
        let any = vec![1.0; self.form.parameters.len()];
        self.is_line() && matches!((self.form.build)(&any), Action::Spikes(_))
    }

    /// Whether it adds lines: its parameters are a frequency, followed by amplitudes.
    pub fn is_line(&self) -> bool {
        let first = self.form.parameters.first();
        first.is_some_and(|p| p.unit == Unit::Hertz) && self.is_disturbance()
    }
}

/// A model with free parameters, all dimensionless: natural frequency, damping ratio, gain if free, then those of
/// the effects.
#[derive(Clone)]
pub struct Structure {
    pub context: Arc<FitContext>,
    /// Those declared in the stand file come first.
    pub effects: Vec<EffectForm>,
    /// Number of effects declared in the stand file.
    pub declared: usize,
}

/// Bounds of the natural frequency, of the damping ratio and of the gain, as parameters of a fit. The gain, in units of that of
/// the plain stand, is not bounded: one that cannot follow the records, as beside a delay, has nearly none.
const PLAIN_BOUNDS: [[f64; 2]; 3] = [[0.02, 50.0], [0.0, 10.0], [-1e9, 1e9]];

impl Structure {
    /// The plain stand without effects.
    pub fn plain(context: Arc<FitContext>) -> Self {
        Self {
            context,
            effects: Vec::new(),
            declared: 0,
        }
    }

    /// The effects added to those of the stand file.
    pub fn added(&self) -> &[EffectForm] {
        &self.effects[self.declared..]
    }

    /// Whether it has the effects of another, each in the same form.
    pub fn has_effects_of(&self, other: &Self) -> bool {
        let forms = |s: &Self| {
            s.effects
                .iter()
                .map(|e| (e.effect.name, e.form.name))
                .collect::<Vec<_>>()
        };
        forms(self) == forms(other)
    }

    /// Names of all effects.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.effects.iter().map(|e| e.effect.name)
    }

    /// The same with one more effect.
    pub fn with(&self, effect: EffectForm) -> Self {
        let mut structure = self.clone();
        structure.effects.push(effect);
        structure
    }

    /// The same with a selection of its effects, by index, and the corresponding parameter values.
    pub fn reduced(&self, values: &[f64], keeps: impl Fn(usize) -> bool) -> (Self, Vec<f64>) {
        let mut kept = values[..self.context.plain_count()].to_vec();
        let mut reduced = Self::plain(self.context.clone());
        for (k, (effect, own)) in self.placed().enumerate() {
            if keeps(k) {
                kept.extend(&values[own]);
                reduced.effects.push(*effect);
                reduced.declared += usize::from(k < self.declared);
            }
        }
        (reduced, kept)
    }

    /// Lower and upper bound of each fit parameter.
    pub fn bounds(&self) -> Vec<[f64; 2]> {
        let context = &self.context;
        let mut all = PLAIN_BOUNDS[..context.constant_count()].to_vec();
        all.extend(context.several.iter().flat_map(SeveralModes::bounds));
        for effect in &self.effects {
            let own = effect.form.parameters.iter().take(effect.moved());
            all.extend(own.map(|p| [p.lower, p.upper]));
        }
        all
    }

    /// Mode and gain for parameter values.
    pub fn mode(&self, values: &[f64]) -> (Mode, f64) {
        let mode = Mode {
            omega_rad_s: TAU * self.context.scales.natural_hz * values[0],
            damping_ratio: values[1],
        };
        let gain = match self.context.gain_is_free {
            true => values[2] * self.context.plain.gain,
            false => self.context.plain.gain,
        };
        (mode, gain)
    }

    /// The values of further modes, if they are fitted.
    fn values_of_modes<'a>(&self, values: &'a [f64]) -> &'a [f64] {
        &values[self.context.constant_count()..self.context.plain_count()]
    }

    /// The plain stand for parameter values.
    pub fn stand(&self, values: &[f64]) -> PlainStand {
        let (mode, gain) = self.mode(values);
        PlainStand {
            natural_hz: mode.omega_rad_s / TAU,
            damping_ratio: mode.damping_ratio,
            gain,
        }
    }

    /// Each effect with the places of its own values among those of the model.
    pub fn placed(&self) -> impl Iterator<Item = (&EffectForm, Range<usize>)> {
        let mut next = self.context.plain_count();
        self.effects.iter().map(move |effect| {
            let from = next;
            next += effect.moved();
            (effect, from..next)
        })
    }

    /// Values of each effect's own parameters in units of the record, s and Hz; amplitudes of lines are zero.
    pub fn effect_values(&self, values: &[f64]) -> Vec<Vec<f64>> {
        let of_effect = |(effect, own): (&EffectForm, Range<usize>)| {
            let fitted = effect.form.parameters.iter().zip(&values[own]);
            let mut own: Vec<f64> = fitted
                .map(|(p, value)| p.value(*value, &self.context.scales))
                .collect();
            own.resize(effect.form.parameters.len(), 0.0);
            own
        };
        self.placed().map(of_effect).collect()
    }

    /// Rates of the decays of what a material remembers.
    fn lingering(&self, mode: &Mode) -> impl Iterator<Item = f64> {
        let fastest = FASTEST * mode.omega_rad_s;
        let span = (fastest * self.context.scales.duration_s).max(1.0);
        (0..LINGERING).map(move |k| fastest * span.powf(-(k as f64) / (LINGERING - 1) as f64))
    }

    /// The model for parameter values, and its nuisance terms.
    pub fn model(&self, values: &[f64]) -> (Chain, NuisanceTerms) {
        let (mode, gain) = self.mode(values);
        let response = match &self.context.several {
            Some(several) => several.response(mode, self.values_of_modes(values)),
            None => mode.into(),
        };
        let mut terms = self.context.terms();
        if self.context.rings_at_start {
            // The free decay shows the frequencies of all modes.
            let further = response.parts().iter().skip(1);
            terms.modes = further.map(|part| part.mode).collect();
        }
        let mut links = Vec::new();
        for (effect, own) in self.effects.iter().zip(self.effect_values(values)) {
            for (k, parameter) in effect.form.parameters.iter().enumerate() {
                match parameter.history {
                    History::Fades => terms.decays_per_s.push(TAU * own[k]),
                    History::Lingers => terms.decays_per_s.extend(self.lingering(&mode)),
                    _ => {}
                }
                terms.ringing.extend(parameter.ringing(&mode, &own[k..]));
            }
            let link = Link::of(effect.effect, effect.form, &own);
            match &link.action {
                Action::Lines(lines) => terms.lines_hz.extend(lines.iter().map(|l| l.frequency_hz)),
                Action::Spikes(train) => terms.spikes_hz = Some(train.frequency_hz),
                Action::Course(count) => {
                    terms.drift_half_waves = terms.drift_half_waves.max(*count);
                }
                _ => links.push(link),
            }
        }
        let mut chain = self.context.chain_of(response, gain).with_links(links);
        chain.begins_at_start = self.context.rings_at_start && chain.distorts();
        (chain, terms)
    }
}
