//! From a diagnosis to its report.

use crate::cli::Diagnose;
use crate::diagnose::{Constants, Dependence, Diagnosis, Judged, Status, Trace, Tried, Verdict};
use crate::print::rounded;
use crate::report::diagnose::{
    Candidate, Constant, Error, Levels, Line, Parameter, Report, Residual, Rms, SCHEMA, Suspected,
};
use crate::report::diagnose_page::Sights;
use crate::stand;
use crate::warning::Warning;

use super::read::Units;
use super::refined::plain_constants;

/// Factor between levels of excitation from which on errors are compared.
const LEVELS_DIFFER: f64 = 1.2;
/// Factor between relative errors at two levels from which on it is said.
const ERRORS_DIFFER: f64 = 1.3;
/// Relative standard uncertainty of natural frequency and damping ratio above which held-out records say little.
const MOST_OPEN: [f64; 2] = [0.005, 0.1];

/// A diagnosis with what belongs to its report.
pub struct Rendered<'a> {
    /// The command line.
    pub args: &'a Diagnose,
    /// What was found.
    pub diagnosis: &'a Diagnosis<'a>,
    /// Units.
    pub units: &'a Units,
    /// Declared constants.
    pub declared: Option<Constants>,
    /// Rms of the applied quantity, training and held out.
    pub levels: [f64; 2],
    /// Warnings so far.
    pub warnings: Vec<Warning>,
}

impl Rendered<'_> {
    /// The report.
    #[must_use]
    pub fn report(&self) -> Report {
        let d = self.diagnosis;
        let effects = d.effects();
        Report {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            stand: self.args.stand.as_ref().map(|p| p.display().to_string()),
            train: self.args.train.clone(),
            holdout: self.args.holdout.clone(),
            verdict: d.verdict.name(),
            input_between_samples: d.records.between().name(),
            error: Error {
                unit: self.printed_unit(),
                declared: d.declared.as_ref().map(|j| self.rms(j)),
                before: self.rms(&d.before),
                after: self.rms(&d.after),
                improvement_ci95: (!effects.is_empty())
                    .then(|| d.after.against(&d.before).improvement_ci95()),
                noise_floor_rms: d.floor.map(|f| f.rms / self.units.printed),
                noise_floor_from: d.floor.map(|f| f.from),
            },
            constants: self.constants(),
            candidates: self.candidates(),
            suspected: self.suspected(),
            residual: self.residual(),
            next_experiment: self.next_experiment(),
            warnings: [self.warnings.clone(), self.left_open()].concat(),
            effects,
        }
    }

    /// What the page shows beside the report, in the units of the report.
    #[must_use]
    pub fn sights(&self) -> Sights {
        let printed = |mut traces: Vec<Trace>| {
            let values = traces
                .iter_mut()
                .flat_map(|t| [&mut t.measured, &mut t.before, &mut t.after]);
            values.flatten().for_each(|v| *v /= self.units.printed);
            traces
        };
        let after = &self.diagnosis.after.fitted;
        let (mode, _) = after.structure.mode(&after.values);
        Sights {
            trained: printed(self.diagnosis.trained()),
            held_out: printed(self.diagnosis.held_out()),
            applied_unit: stand::si_unit(&self.units.applied),
            natural_hz: mode.omega_rad_s / std::f64::consts::TAU,
        }
    }

    /// What the training records do not determine well enough to judge held-out ones by it.
    fn left_open(&self) -> Vec<Warning> {
        let plain = &self.diagnosis.before.fitted;
        let names = [
            ("natural frequency", 0, MOST_OPEN[0]),
            ("damping ratio", 1, MOST_OPEN[1]),
        ];
        let open = names.into_iter().filter_map(|(name, k, most)| {
            let relative = plain.std[k].map(|s| s / plain.values[k].abs());
            match relative {
                Some(relative) if relative <= most => None,
                Some(relative) => Some(format!(
                    "the {name} to ± {} %",
                    rounded(100.0 * relative, 2)
                )),
                None => Some(format!("the {name} not at all")),
            }
        });
        let open: Vec<String> = open.collect();
        if open.is_empty() {
            return Vec::new();
        }
        vec![Warning::new(
            "training-leaves-constants-open",
            format!(
                "the training records determine {}: what is left on held-out records may be that and no missing effect; \
                 train on records that excite the resonance",
                open.join(" and ")
            ),
        )]
    }

    fn printed_unit(&self) -> String {
        if self.units.diagnosed == "N m" {
            "N m".to_owned()
        } else {
            self.units.measured.clone()
        }
    }

    fn rms(&self, judged: &Judged) -> Rms {
        let d = self.diagnosis;
        let (mut sum, mut count) = (0.0, 0_usize);
        for residual in &d.before.hold {
            let y: Vec<f64> = residual
                .modelled
                .iter()
                .zip(&residual.samples)
                .map(|(m, r)| m + r)
                .collect();
            let mean = y.iter().sum::<f64>() / y.len() as f64;
            sum += y.iter().map(|y| (y - mean).powi(2)).sum::<f64>();
            count += y.len();
        }
        let size = (sum / count as f64).sqrt();
        Rms {
            train_rms: judged.train_rms() / self.units.printed,
            holdout_rms: judged.hold_rms() / self.units.printed,
            holdout_relative: judged.hold_rms() / size,
        }
    }

    fn constants(&self) -> Vec<Constant> {
        let before = plain_constants(&self.diagnosis.before);
        let after = plain_constants(&self.diagnosis.after);
        let declared = self
            .declared
            .map(|d| [d.natural_hz, d.damping_ratio, d.gain]);
        let names = ["natural_frequency", "damping_ratio", "static_gain"];
        let (gain_unit, gain_scale) = self.units.gain();
        let units = ["Hz".to_owned(), String::new(), gain_unit];
        let scales = [1.0, 1.0, gain_scale];
        let free = self.diagnosis.before.fitted.structure.frame.gain_is_free;
        let shown = if free { 3 } else { 2 };
        let constant = |(k, (name, unit)): (usize, (&'static str, String))| Constant {
            name,
            unit,
            declared: declared.map(|d| d[k] * scales[k]),
            before: before[k].0 * scales[k],
            before_std: before[k].1.map(|s| s * scales[k]),
            after: after[k].0 * scales[k],
            after_std: after[k].1.map(|s| s * scales[k]),
        };
        let named = names.into_iter().zip(units).enumerate();
        named.take(shown).map(constant).collect()
    }

    fn candidates(&self) -> Vec<Candidate> {
        let mut all = Vec::new();
        let mut with: Vec<&'static str> = Vec::new();
        for round in &self.diagnosis.rounds {
            let mut sorted: Vec<&Tried> = round.iter().collect();
            let key = |t: &Tried| t.judged.as_ref().map_or(f64::INFINITY, Judged::hold_rms);
            sorted.sort_by(|a, b| {
                let first = |t: &Tried| t.status != Status::Accepted;
                first(a).cmp(&first(b)).then(key(a).total_cmp(&key(b)))
            });
            all.extend(sorted.iter().map(|t| match t.status {
                // As they are in the refined stand, not as they were when they were chosen.
                Status::Accepted => self.accepted(t, &with),
                _ => self.candidate(t, &with),
            }));
            with.extend(
                round
                    .iter()
                    .filter(|t| t.status == Status::Accepted)
                    .map(|t| t.effect.name),
            );
        }
        all
    }

    fn accepted(&self, tried: &Tried, with: &[&'static str]) -> Candidate {
        let after = &self.diagnosis.after;
        let mut candidate = self.candidate(tried, with);
        candidate.parameters = self.parameters(after).swap_remove(with.len());
        let is_last = with.len() + 1 == after.fitted.structure.choices.len();
        if is_last {
            let whole = self.rms(after);
            candidate.train_rms = Some(whole.train_rms);
            candidate.holdout_rms = Some(whole.holdout_rms);
        }
        candidate
    }

    fn candidate(&self, tried: &Tried, with: &[&'static str]) -> Candidate {
        let judged = tried.judged.as_ref();
        Candidate {
            effect: tried.effect.name,
            form: judged.and_then(|j| j.fitted.structure.choices.last().map(|c| c.form.name)),
            with: with.to_vec(),
            train_rms: judged.map(|j| j.train_rms() / self.units.printed),
            holdout_rms: judged.map(|j| j.hold_rms() / self.units.printed),
            p_value: tried.p_value,
            parameters: judged
                .map_or_else(Vec::new, |j| self.parameters(j).pop().unwrap_or_default()),
            status: match tried.status {
                Status::Accepted => "accepted",
                Status::Rejected => "rejected",
                Status::Indistinguishable => "indistinguishable",
            },
            why: tried.why.clone(),
        }
    }

    fn suspected(&self) -> Option<Suspected> {
        let rival = self.diagnosis.suspected.as_ref()?;
        Some(Suspected {
            law: rival.law.name,
            equation: rival.law.equation,
            with: self.diagnosis.effects(),
            train_rms: rival.judged.train_rms() / self.units.printed,
            holdout_rms: rival.judged.hold_rms() / self.units.printed,
            unit: self.printed_unit(),
            parameters: self.parameters(&rival.judged).pop().unwrap_or_default(),
        })
    }

    /// Parameters of each effect of a model.
    pub(super) fn parameters(&self, judged: &Judged) -> Vec<Vec<Parameter>> {
        let fitted = &judged.fitted;
        let structure = &fitted.structure;
        let rulers = &structure.frame.rulers;
        let mut next = structure.frame.plain_count();
        let mut amplitudes = fitted.amplitudes.iter();
        let mut all = Vec::new();
        for (choice, values) in structure
            .choices
            .iter()
            .zip(structure.effect_values(&fitted.values))
        {
            let moved = choice.moved();
            let own = choice
                .form
                .parameters
                .iter()
                .enumerate()
                .map(|(k, parameter)| {
                    let fitted_here = k < moved;
                    Parameter {
                        name: parameter.name,
                        value: if fitted_here {
                            values[k]
                        } else {
                            amplitudes.next().copied().unwrap_or(0.0)
                        },
                        std: fitted
                            .std
                            .get(next + k)
                            .copied()
                            .flatten()
                            .filter(|_| fitted_here)
                            .map(|s| parameter.std(fitted.values[next + k], s, rulers)),
                        unit: parameter.unit.text(&self.units.diagnosed),
                    }
                });
            all.push(own.collect());
            next += moved;
        }
        all
    }

    fn residual(&self) -> Residual {
        let d = self.diagnosis;
        let tests: Dependence = d.dependence.clone();
        let lines = d.lines.iter().map(|l| Line {
            frequency_hz: l.frequency_hz,
            amplitude: l.amplitude / self.units.printed,
        });
        Residual {
            white: tests.white,
            independent_of_input: tests.independent_of_input,
            described: self.described(&tests),
            tests,
            lines: lines.collect(),
            levels: self.levels_reached(),
        }
    }

    /// Levels of excitation, and how well the plain stand does at each.
    fn levels_reached(&self) -> Levels {
        let before = self.rms(&self.diagnosis.before);
        let frame = self.diagnosis.before.fitted.structure.frame;
        let train_size = frame.rulers.rms / self.units.printed;
        Levels {
            train_applied_rms: self.levels[0],
            holdout_applied_rms: self.levels[1],
            train_relative: before.train_rms / train_size,
            holdout_relative: before.holdout_relative,
        }
    }

    fn described(&self, tests: &Dependence) -> String {
        let mut parts = Vec::new();
        if let Some(floor) = self.diagnosis.floor {
            parts.push(format!(
                "{} times the noise floor",
                rounded(self.diagnosis.after.hold_rms() / floor.rms, 3)
            ));
        }
        parts.push(if tests.white {
            "white".to_owned()
        } else {
            "not white".to_owned()
        });
        match tests.structure() {
            Some(share) => parts.push(format!(
                "{:.0} % of its power follows from {}",
                100.0 * share.share,
                share.of
            )),
            // What changes over a record follows from the motion in each stretch of it.
            None if tests.unsteady().is_some() => {}
            None if !tests.independent_of_input => parts.push(format!(
                "correlated with the input beyond chance (99 %), most at a lag of {} samples",
                tests.largest_lag
            )),
            None => {
                parts.push("independent of input and motion as far as the tests see".to_owned())
            }
        }
        if tests.has_spikes() {
            parts.push(format!(
                "{:.0} % of its power lies in a hundredth of its samples: spikes",
                100.0 * tests.in_largest_hundredth
            ));
        }
        if let Some(share) = tests.unsteady() {
            let of_periods = self.diagnosis.floor.is_some_and(|f| f.from == "periods");
            parts.push(format!(
                "{:.0} % of its power goes with {}{}",
                100.0 * share.share.min(1.0),
                share.of,
                match of_periods {
                    true => ": it passes for noise where periods are compared",
                    false => "",
                }
            ));
        }
        if !self.diagnosis.settled && !self.diagnosis.effects().is_empty() {
            parts.push(
                "the law found switches so fast that the step of the integration is a part of the error, and no second effect was \
                 looked for"
                    .to_owned(),
            );
        }
        parts.extend(self.grows_with_level());
        for line in &self.diagnosis.lines {
            parts.push(format!("a line at {} Hz", rounded(line.frequency_hz, 5)));
        }
        parts.join("; ")
    }

    /// Whether the plain stand does worse on one set of records than on the other, which is excited less or more.
    fn grows_with_level(&self) -> Option<String> {
        let levels = self.levels_reached();
        let relative = [levels.train_relative, levels.holdout_relative];
        let level = self.levels[1] / self.levels[0];
        let error = relative[1] / relative[0];
        let differ = |ratio: f64, factor: f64| ratio.ln().abs() > factor.ln();
        let is_open = self.diagnosis.verdict != Verdict::Explained;
        (is_open && differ(level, LEVELS_DIFFER) && differ(error, ERRORS_DIFFER)).then(|| {
            format!(
                "the plain stand leaves {:.1} % of the training records and {:.1} % of the held-out ones, which are excited {} times \
                 as much: what it lacks depends on amplitude",
                100.0 * relative[0],
                100.0 * relative[1],
                rounded(level, 3)
            )
        })
    }

    fn next_experiment(&self) -> Option<String> {
        if let Some(rival) = &self.diagnosis.suspected {
            return Some(rival.law.experiment.to_owned());
        }
        let rounds = &self.diagnosis.rounds;
        let mut asked: Vec<&str> = rounds
            .iter()
            .flatten()
            .filter(|t| t.status == Status::Indistinguishable)
            .map(|t| t.effect.experiment)
            .collect();
        if asked.is_empty()
            && matches!(
                self.diagnosis.verdict,
                Verdict::PartlyExplained | Verdict::Unexplained
            )
        {
            if self.diagnosis.dependence.unsteady().is_some() {
                return Some(
                    "the same record twice, cold and after an hour of running, and at half the level: do the constants or the \
                     noise differ?"
                        .to_owned(),
                );
            }
            let follows = self.diagnosis.dependence.structure().map(|share| share.of);
            if let Some(of) = follows.filter(|of| *of != "the input") {
                let record = if of.contains("displacement") {
                    "a slow load and unload over the whole range, and the response at two more levels"
                } else {
                    "free decays from several amplitudes, and the response at two more levels"
                };
                return Some(record.to_owned());
            }
            let closest = rounds.last().into_iter().flatten().filter_map(|t| {
                t.judged
                    .as_ref()
                    .map(|j| (j.hold_rms(), t.effect.experiment))
            });
            asked.extend(closest.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, e)| e));
        }
        asked.dedup();
        (!asked.is_empty()).then(|| asked.join("; "))
    }
}
