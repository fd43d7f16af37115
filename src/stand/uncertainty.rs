//! Standard uncertainty of the factor of a compensation, from all constants of the stand file.

use std::f64::consts::TAU;

use num_complex::Complex64;
use torqcomp_model::{InverseUncertainty, ModalResponse, ParameterStd, SecondOrder};

use super::{DeclaredMode, Given, Mechanics, Stand, StandResponse};
use crate::identify::MODE_NUMBERS;

/// Relative standard uncertainty of the static constant from record to torque.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum ConstantStd {
    /// The record is the applied quantity; no constant is needed.
    NotNeeded,
    /// A constant is used, but its uncertainty is unknown.
    #[default]
    Unknown,
    /// Known value.
    Relative(f64),
}

impl ConstantStd {
    /// From an optional relative standard uncertainty.
    pub fn of(relative: Option<f64>) -> Self {
        relative.map_or(Self::Unknown, Self::Relative)
    }

    /// The value, if known.
    pub fn known(self) -> Option<f64> {
        match self {
            Self::Relative(std) => Some(std),
            Self::NotNeeded | Self::Unknown => None,
        }
    }
}

/// Standard uncertainty of a compensated torque at one frequency, as far as known.
#[derive(Debug, Clone, Default)]
pub struct TorqueStd {
    /// Of the response that is divided out; `None` if unknown.
    pub response: Option<InverseUncertainty>,
    /// Of response and static constant combined; `None` if one of them is unknown.
    pub total: Option<InverseUncertainty>,
}

impl Stand {
    /// Standard uncertainty of a compensated torque at a frequency: of the response alone, and combined with that of
    /// the static constant. Constants without a `std` count as exact if others have one. An uncertainty of exactly zero
    /// is treated as unknown, i.e. `None`.
    pub fn torque_std(&self, frequency_hz: f64, constant: ConstantStd) -> TorqueStd {
        let is_known =
            |std: &InverseUncertainty| std.magnitude_relative > 0.0 || std.phase_rad > 0.0;
        let response = self.inverse_uncertainty(frequency_hz).filter(is_known);
        let total = match constant {
            ConstantStd::NotNeeded => response,
            ConstantStd::Unknown => None,
            ConstantStd::Relative(std) => {
                let of_constant = InverseUncertainty::of_sum(std, 0.0);
                Some(response.map_or(of_constant, |of| of.and(&of_constant)))
            }
        };
        TorqueStd {
            response,
            total: total.filter(is_known),
        }
    }

    /// Standard uncertainty of the inverse response at a frequency: from inertia, damping and stiffness with their
    /// correlations, the effects' parameters, and the recorder's low-pass and delay. Constants without a `std` count
    /// as exact. `None` if no uncertainty is known, or if an effect without a frequency response has one.
    pub fn inverse_uncertainty(&self, frequency_hz: f64) -> Option<InverseUncertainty> {
        let of_stand = match self.effects.is_empty() && self.constants().is_some() {
            true => self.of_mechanics(frequency_hz),
            false => self.of_mechanics_and_effects(frequency_hz)?,
        };
        let of_recorder = self.of_recorder(frequency_hz);
        let known = [of_stand, of_recorder];
        known.into_iter().flatten().reduce(|a, b| a.and(&b))
    }

    fn of_mechanics(&self, frequency_hz: f64) -> Option<InverseUncertainty> {
        let (constants, std) = self.constants()?;
        let found = constants.inverse_uncertainty(frequency_hz, std);
        found.ok().flatten()
    }

    /// Inertia, damping and stiffness, if the response is given by constants.
    fn constants(&self) -> Option<(&SecondOrder, &ParameterStd)> {
        let mechanics = self.mechanics.as_ref()?;
        match &mechanics.response {
            StandResponse::Constants(constants) => Some((constants, &mechanics.std)),
            StandResponse::Modes(_) => None,
        }
    }

    /// From the derivatives with respect to each parameter, by central differences; `None` if the stand with
    /// its effects has no inverse response.
    fn of_mechanics_and_effects(&self, frequency_hz: f64) -> Option<Option<InverseUncertainty>> {
        let varied = self.varied();
        if self.inverse().is_err() {
            let is_exact = !varied
                .iter()
                .any(|of| matches!(of, VariedConstant::OfEffect(..)));
            return is_exact.then(|| self.of_mechanics(frequency_hz));
        }
        let term = |of: &VariedConstant| change(&|side| self.moved(*of, side), frequency_hz);
        let terms: Vec<Complex64> = varied.iter().map(term).collect::<Option<_>>()?;
        let correlations = self.correlations(&varied);
        let size = |part: fn(&Complex64) -> f64| {
            let parts: Vec<f64> = terms.iter().map(part).collect();
            combined(&correlations, &parts)
        };
        Some(
            (!terms.is_empty()).then(|| InverseUncertainty::of_sum(size(|z| z.re), size(|z| z.im))),
        )
    }

    /// The constants of mechanics and effects that have a standard uncertainty.
    pub(crate) fn varied(&self) -> Vec<VariedConstant> {
        let of_mechanics = self.mechanics.iter().flat_map(|mechanics| {
            let stds = mechanics.stds();
            (0..stds.len()).filter(move |place| stds[*place].is_some())
        });
        let mut all: Vec<VariedConstant> = of_mechanics.map(VariedConstant::OfMechanics).collect();
        for (place, effect) in self.effects.iter().enumerate() {
            let known = (0..effect.stds.len()).filter(|k| effect.stds[*k].is_some());
            all.extend(known.map(|k| VariedConstant::OfEffect(place, k)));
        }
        all
    }

    /// The stand with one constant changed by a multiple of its standard uncertainty; `None` if the result is
    /// invalid.
    pub(crate) fn moved(&self, constant: VariedConstant, by: f64) -> Option<Self> {
        let mut stand = self.clone();
        match constant {
            VariedConstant::OfMechanics(place) => {
                stand.mechanics = Some(self.mechanics.as_ref()?.moved(place, by)?);
            }
            VariedConstant::OfEffect(place, k) => {
                let effect = &mut stand.effects[place];
                let moved = effect.values[k] + by * effect.stds[k]?;
                effect.values[k] =
                    Some(moved).filter(|v| effect.form.parameters[k].allows_sign_of(*v))?;
            }
        }
        Some(stand)
    }

    /// Correlation coefficients between the errors of constants.
    pub(crate) fn correlations(&self, of: &[VariedConstant]) -> Vec<Vec<f64>> {
        let one = |a: &VariedConstant, b: &VariedConstant| match (a, b) {
            _ if a == b => 1.0,
            (VariedConstant::OfMechanics(i), VariedConstant::OfMechanics(k)) => {
                let mechanics = self.mechanics.as_ref();
                mechanics.map_or(0.0, |m| m.correlation(*i, *k))
            }
            _ => 0.0,
        };
        of.iter()
            .map(|a| of.iter().map(|b| one(a, b)).collect())
            .collect()
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
            second_order: 0.0,
        })
    }
}

/// A constant of the stand file that has a standard uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum VariedConstant {
    /// Inertia, damping or stiffness, from 0; for several modes the numbers of each, one after the
    /// other.
    OfMechanics(usize),
    /// An effect's parameter: the index of the effect, and that of the parameter.
    OfEffect(usize, usize),
}

/// Standard uncertainty of a sum from the signed uncertainties of its terms and their correlations.
pub(crate) fn combined(correlations: &[Vec<f64>], terms: &[f64]) -> f64 {
    let row = |(i, row): (usize, &Vec<f64>)| {
        let mixed: f64 = row.iter().zip(terms).map(|(c, term)| c * term).sum();
        mixed * terms[i]
    };
    let variance: f64 = correlations.iter().enumerate().map(row).sum();
    variance.max(0.0).sqrt()
}

impl Mechanics {
    /// Standard uncertainties of inertia, damping and stiffness, or of the numbers of several modes.
    fn stds(&self) -> Vec<Option<f64>> {
        if let Given::Modes(modes) = &self.given {
            return modes.iter().flat_map(DeclaredMode::stds).collect();
        }
        let std = &self.std;
        vec![
            std.inertia_kg_m2,
            std.damping_n_m_s_per_rad,
            std.stiffness_n_m_per_rad,
        ]
    }

    /// Correlation coefficient of two of them.
    fn correlation(&self, i: usize, k: usize) -> f64 {
        let Given::Modes(modes) = &self.given else {
            return self.std.correlations[i + k - 1];
        };
        let [(mode, i), (other, k)] = [i, k].map(DeclaredMode::place);
        match mode == other {
            true => modes[mode].correlation(i, k),
            false => 0.0,
        }
    }

    /// The name of one of them.
    pub(crate) fn name(&self, place: usize) -> String {
        match &self.given {
            Given::Constants { .. } => ["inertia", "damping", "stiffness"][place].to_owned(),
            Given::Modal { .. } => {
                ["natural frequency", "damping ratio", "stiffness"][place].to_owned()
            }
            Given::Modes(_) => {
                let (mode, number) = DeclaredMode::place(place);
                format!(
                    "{} of mode {}",
                    MODE_NUMBERS[number].replace('_', " "),
                    mode + 1
                )
            }
        }
    }

    /// The mechanics with one constant changed by its standard uncertainty; `None` if it has none, or if the result is
    /// invalid.
    fn moved(&self, place: usize, side: f64) -> Option<Self> {
        let of = match (&self.response, &self.given) {
            (StandResponse::Constants(of), _) => of,
            (_, Given::Modes(modes)) => return self.with_modes(modes, place, side),
            _ => return None,
        };
        let mut values = [
            of.inertia_kg_m2(),
            of.damping_n_m_s_per_rad(),
            of.stiffness_n_m_per_rad(),
        ];
        values[place] += side * self.stds()[place]?;
        let response = SecondOrder::new(values[0], values[1], values[2]).ok()?;
        let response = StandResponse::Constants(response);
        Some(Self {
            response,
            ..self.clone()
        })
    }
}

impl Mechanics {
    /// The mechanics with one number of their modes changed.
    fn with_modes(&self, modes: &[DeclaredMode], place: usize, side: f64) -> Option<Self> {
        let modes = DeclaredMode::all_moved(modes, place, side)?;
        let parts = modes.iter().map(DeclaredMode::part).collect();
        Some(Self {
            response: StandResponse::Modes(ModalResponse::new(parts).ok()?),
            given: Given::Modes(modes),
            ..self.clone()
        })
    }
}

/// Fraction of a standard uncertainty used as finite-difference step: far above rounding, far below significant
/// nonlinearity.
const STEP: f64 = 1e-3;

/// Change of the logarithm of the inverse response for one standard uncertainty of a parameter, by
/// linearisation.
fn change(with: &dyn Fn(f64) -> Option<Stand>, frequency_hz: f64) -> Option<Complex64> {
    let at = |side: f64| Some(with(side * STEP)?.inverse().ok()?(frequency_hz));
    let half = (at(1.0)? / at(-1.0)?).ln() / (2.0 * STEP);
    half.is_finite().then_some(half)
}
