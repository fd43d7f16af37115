//! A model with free parameters: the plain stand and the forms of effects put to it.

use torqcomp_model::effects::{Action, Effect, Form, Mode, Rulers, Unit};
use torqcomp_model::simulate::{Fixed, Model};

/// An effect in one of its forms.
#[derive(Clone, Copy)]
pub struct Choice {
    /// The effect.
    pub effect: &'static Effect,
    /// Its form.
    pub form: &'static Form,
}

/// What all models of a diagnosis share.
#[derive(Clone)]
pub struct Frame {
    /// Rulers of the parameters.
    pub rulers: Rulers,
    /// Size that the gain is measured with.
    pub gain: f64,
    /// Whether the gain is a parameter of the plain stand.
    pub gain_is_free: bool,
    /// The recorder as far as the stand file declares it.
    pub recorder: Option<Fixed>,
}

/// A model with free parameters, all pure numbers: natural frequency, damping ratio, gain if free, then
/// those of the effects.
#[derive(Clone)]
pub struct Structure<'a> {
    /// What all models share.
    pub frame: &'a Frame,
    /// The effects.
    pub choices: Vec<Choice>,
}

/// What a model adds that belongs to a record: frequencies of lines, half waves of a slow course.
#[derive(Debug, Clone, Default)]
pub struct Waves {
    /// Frequencies of the lines.
    pub lines_hz: Vec<f64>,
    /// Half waves of the course.
    pub course: usize,
    /// Rates at which what was before the record fades, per s.
    pub fades_per_s: Vec<f64>,
}

impl Waves {
    /// No waves.
    pub const NONE: Self = Self {
        lines_hz: Vec::new(),
        course: 0,
        fades_per_s: Vec::new(),
    };

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !self.disturb() && self.fades_per_s.is_empty()
    }

    /// Whether something is added that does not come from what is applied.
    #[must_use]
    pub fn disturb(&self) -> bool {
        !self.lines_hz.is_empty() || self.course > 0
    }
}

/// One of the parameters.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    /// Least value.
    pub lower: f64,
    /// Greatest value.
    pub upper: f64,
}

impl Frame {
    /// Count of the plain stand's parameters.
    #[must_use]
    pub fn plain_count(&self) -> usize {
        2 + usize::from(self.gain_is_free)
    }
}

impl Structure<'_> {
    /// Count of parameters that a fit moves: amplitudes of lines follow from the data at once.
    #[must_use]
    pub fn bounds(&self) -> Vec<Bounds> {
        let mut all = vec![
            Bounds {
                lower: 0.02,
                upper: 50.0,
            },
            Bounds {
                lower: 0.0,
                upper: 10.0,
            },
        ];
        if self.frame.gain_is_free {
            all.push(Bounds {
                lower: -1e3,
                upper: 1e3,
            });
        }
        for choice in &self.choices {
            let own = choice.form.parameters.iter().take(choice.moved());
            all.extend(own.map(|p| Bounds {
                lower: p.lower,
                upper: p.upper,
            }));
        }
        all
    }

    /// The structure's own values, without what a fit adds for each record.
    #[must_use]
    pub fn own<'v>(&self, values: &'v [f64]) -> &'v [f64] {
        &values[..self.bounds().len()]
    }

    /// The mode and gain of parameter values.
    #[must_use]
    pub fn mode(&self, values: &[f64]) -> (Mode, f64) {
        let mode = Mode {
            omega_rad_s: std::f64::consts::TAU * self.frame.rulers.natural_hz * values[0],
            damping_ratio: values[1],
        };
        let gain = if self.frame.gain_is_free {
            values[2] * self.frame.gain
        } else {
            self.frame.gain
        };
        (mode, gain)
    }

    /// Values of each effect's own parameters in units of the record, s and Hz; amplitudes of lines are
    /// left at zero.
    #[must_use]
    pub fn effect_values(&self, values: &[f64]) -> Vec<Vec<f64>> {
        let mut next = self.frame.plain_count();
        let mut all = Vec::with_capacity(self.choices.len());
        for choice in &self.choices {
            let moved = choice.moved();
            let own = choice.form.parameters.iter().enumerate().map(|(k, p)| {
                if k < moved {
                    p.value(values[next + k], &self.frame.rulers)
                } else {
                    0.0
                }
            });
            all.push(own.collect());
            next += moved;
        }
        all
    }

    /// The model of parameter values, and what it adds that belongs to a record.
    #[must_use]
    pub fn model(&self, values: &[f64]) -> (Model, Waves) {
        let (mode, gain) = self.mode(values);
        let mut waves = Waves::NONE;
        let mut actions = Vec::new();
        for (choice, own) in self.choices.iter().zip(self.effect_values(values)) {
            let fading = choice.form.parameters.iter().zip(&own);
            waves.fades_per_s.extend(
                fading
                    .filter(|(p, _)| p.fades)
                    .map(|(_, corner_hz)| std::f64::consts::TAU * corner_hz),
            );
            match (choice.form.build)(&own) {
                Action::Lines(lines) => waves.lines_hz.extend(lines.iter().map(|l| l.frequency_hz)),
                Action::Course(count) => waves.course = waves.course.max(count),
                action => actions.push((choice.form.stage, action)),
            }
        }
        let recorder = self.frame.recorder.clone();
        (
            Model {
                mode,
                gain,
                recorder,
                shift: 0.0,
                actions,
            },
            waves,
        )
    }
}

impl Choice {
    /// How many of its parameters a fit moves.
    #[must_use]
    pub fn moved(&self) -> usize {
        if self.is_line() {
            1
        } else {
            self.form.parameters.len()
        }
    }

    /// Whether it adds lines: a frequency first, then amplitudes.
    #[must_use]
    pub fn is_line(&self) -> bool {
        let parameters = self.form.parameters;
        parameters.first().is_some_and(|p| p.unit == Unit::Hertz)
            && self.form.stage == torqcomp_model::effects::Stage::Disturbance
    }

    /// `backlash (joint)`, or the name alone if it has one form.
    #[must_use]
    pub fn describe(&self) -> String {
        if self.effect.forms.len() == 1 {
            self.effect.name.to_owned()
        } else {
            format!("{} ({})", self.effect.name, self.form.name)
        }
    }
}
